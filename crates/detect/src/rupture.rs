//! Connects detachments to ruptures as records arrive.
//!
//! Only the last detachment of each block can link to later ones: if an earlier one is close enough in
//! time, so is the last one. A rupture is certain once `t_link` has passed since its last detachment and
//! all of its blocks are stuck again. So only blocks, uncertain ruptures and those that wait for the state at
//! their end are stored, with the states at their onsets.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use asperity_record::{
    Contacts, Direction, Energy, Extent, FieldRecord, Measured, StepRecord, Switch, drop_n,
};

/// Derives ruptures from step records, and from states the forces before and after them.
#[derive(Debug, Clone)]
pub struct RuptureTracker {
    contacts: Contacts,
    /// Most steps between detachments that are linked.
    link_steps: u64,
    /// The last detachment of each block.
    last: Vec<Option<Detachment>>,
    open: BTreeMap<Id, Slipping>,
    /// Ruptures that a detachment may still join, by the step of their last one.
    growing: BTreeSet<(u64, Id)>,
    next: Id,
    /// Slip intervals of certain ruptures that may overlap with one that is open.
    certain: Vec<(u64, u64)>,
    /// The farthest column in which a block has slid.
    farthest: Option<u32>,
    ruptures: u64,
    /// Stiffness of each contact's friction spring over their mean; empty where all are alike.
    pub(crate) spring_factors: Vec<f64>,
    /// Certain ruptures in order, from the first on whose state at the end may still come: records of states follow
    /// that of their step.
    held: VecDeque<Held>,
}

/// A rupture that is certain, and the state at its onset while that at its end may still come.
#[derive(Debug, Clone)]
struct Held {
    slipped: Slipped,
    before: Option<Arc<Forces>>,
}

/// Tangential forces without friction on all contacts after which a step moved them, N.
#[derive(Debug)]
struct Forces {
    step: u64,
    along_n: Vec<f64>,
    across_n: Vec<f64>,
}

impl Forces {
    /// The force on a contact in a direction, N.
    fn on(&self, block: u32, direction: [f64; 2]) -> Option<f64> {
        let of = |forces_n: &[f64]| forces_n.get(block as usize - 1).copied();
        let along_n = direction[0] * of(&self.along_n)?;
        Some(of(&self.across_n).map_or(along_n, |across_n| along_n + direction[1] * across_n))
    }
}

/// Identifies a rupture that is not certain yet.
type Id = u64;

/// The last detachment of a block.
#[derive(Debug, Clone, Copy)]
struct Detachment {
    step: u64,
    of: Id,
}

/// A rupture that is not certain yet.
#[derive(Debug, Clone)]
struct Slipping {
    blocks: BTreeMap<u32, Passage>,
    /// The earliest detachment, the lowest block first.
    nucleation: (u64, u32),
    ft_fn_onset: f64,
    ft_fn_error: Option<f64>,
    energy_before: Energy,
    last_detachment: u64,
    detachments: u64,
    /// How many of its blocks slide.
    sliding: u32,
    last_attachment: Attachment,
    farthest_before: Option<u32>,
    anchored_m2: f64,
    /// The state in the step in which it began, and in the last one in which it may have ended, if recorded.
    before: Option<Arc<Forces>>,
    after: Option<Arc<Forces>>,
}

/// The last re-attachment of a rupture: its step, and `F_T / F_N` and the run's energies there.
#[derive(Debug, Clone, Copy)]
struct Attachment {
    step: u64,
    ft_fn: f64,
    energy: Energy,
}

impl Attachment {
    fn at(record: &StepRecord) -> Attachment {
        Attachment { step: record.step, ft_fn: record.load_ratio(), energy: record.energy }
    }
}

/// A rupture, as far as it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Slipped {
    /// Number of the rupture in its run, counted from 0.
    pub rupture: u64,
    /// Passages by block; in one row, block numbers have no gap.
    pub blocks: BTreeMap<u32, Passage>,
    /// The block that slid first.
    pub nucleation_block: u32,
    /// First step in which a block slides.
    pub onset_step: u64,
    /// `F_T / F_N` in the step before.
    pub ft_fn_onset: f64,
    /// Standard error of that, in a recording.
    pub ft_fn_error: Option<f64>,
    /// First step after it, and `F_T / F_N` in the step before; none while a block slides.
    pub end: Option<(u64, f64)>,
    /// Number of detachments.
    pub detachments: u64,
    /// The farthest column in which a block had slid before: in one row, the highest-numbered block.
    pub farthest_before: Option<u32>,
    /// Whether another rupture slid at the same time.
    pub overlapping: bool,
    /// Whether the run ended before it was certain.
    pub open: bool,
    /// The run's energies after the detachments of the step before its first sliding one, and after its
    /// last sliding step; `None` if other ruptures contribute to the difference.
    pub energies: Option<[Energy; 2]>,
    /// Squared stretch of friction springs, times their stiffness over the mean one, summed over its re-attachments
    /// less its detachments, m2.
    pub anchored_m2: f64,
}

/// How a rupture passed a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// First step in which the block slides.
    pub arrival_step: u64,
    /// `F_T / F_N` in the step before.
    pub ft_fn_arrival: f64,
    /// Displacement at the first detachment, along the sliding direction and across it, m.
    pub displacement_detach_m: [f64; 2],
    /// Tangential force without friction there, N: in a single row along the sliding direction, over an area
    /// its magnitude.
    pub force_detach_n: f64,
    /// In which direction forces before and after the rupture count: over an area that of the force at the
    /// detachment, a unit vector, in a single row the sliding direction.
    pub direction: [f64; 2],
    /// Tangential force without friction in the states at the onset and at the end of the rupture, N; none as the
    /// energies of the rupture, and where they were not recorded.
    pub states_n: Option<[f64; 2]>,
    /// What the sensor saw at the first detachment, with the sum of the steps of all; none of a run.
    pub measured: Option<Measured>,
    /// Number of detachments.
    pub detachments: u32,
    /// The last re-attachment; none while the block slides.
    pub stop: Option<Stop>,
}

/// The last re-attachment of a block in a rupture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// First step in which the block does not slide.
    pub step: u64,
    /// Displacement, along the sliding direction and across it, m.
    pub displacement_m: [f64; 2],
    /// Tangential force without friction, N, as at the detachment.
    pub force_n: f64,
}

/// Displacement at a switch, along the sliding direction and across it, m.
fn displacement_m(switch: &Switch) -> [f64; 2] {
    [switch.displacement_m, switch.across.map_or(0.0, |across| across.displacement_m)]
}

/// The force whose fall is a force drop, N: over an area a magnitude.
fn force_n(switch: &Switch) -> f64 {
    if switch.across.is_some() { switch.force_magnitude_n() } else { switch.tangential_force_n }
}

/// [`Passage::direction`] of a contact that detaches.
fn direction(switch: &Switch) -> [f64; 2] {
    let size_n = switch.force_magnitude_n();
    match switch.across {
        Some(across) if size_n > 0.0 => {
            [switch.tangential_force_n / size_n, across.tangential_force_n / size_n]
        }
        _ => [1.0, 0.0],
    }
}

/// Squared stretch of a friction spring at detachment or re-attachment, m2.
fn squared_stretch_m2(switch: &Switch) -> f64 {
    let squared = |stretch_m: f64| stretch_m * stretch_m;
    let along_m2 = squared(switch.displacement_m - switch.stick_position_m);
    match switch.across {
        None => along_m2,
        Some(across) => along_m2 + squared(across.displacement_m - across.stick_position_m),
    }
}

impl Slipped {
    /// Its blocks as a set.
    pub fn extent(&self, contacts: Contacts) -> Extent {
        Extent::with(contacts, self.blocks.keys().copied())
    }

    fn ends_in(&self, step: u64) -> bool {
        self.end.is_some_and(|(end_step, _)| end_step == step)
    }

    /// Takes the forces on its contacts from the states at its onset and at its end.
    fn bear(&mut self, before: &Forces, after: &Forces) {
        for (&block, passage) in &mut self.blocks {
            let on = |forces: &Forces| forces.on(block, passage.direction);
            passage.states_n = on(before).zip(on(after)).map(<[f64; 2]>::from);
        }
    }
}

impl Passage {
    /// How far the block slid, along the sliding direction and across it, m.
    pub fn slip_m(&self) -> Option<[f64; 2]> {
        let part_m = |stop: &Stop, axis: usize| stop.displacement_m[axis] - self.displacement_detach_m[axis];
        self.stop.map(|stop| [part_m(&stop, 0), part_m(&stop, 1)])
    }

    /// Strength before less resistance after, N: the fall of the tangential force from detachment to re-attachment,
    /// in the direction that it had.
    pub fn strength_drop_n(&self) -> Option<f64> {
        self.stop.map(|stop| drop_n(self.force_detach_n, stop.force_n, self.force_detach_n))
    }

    /// Shear force before less that after the rupture, in the same direction, N.
    pub fn shear_force_drop_n(&self) -> Option<f64> {
        self.states_n.map(|[before_n, after_n]| drop_n(before_n, after_n, self.force_detach_n))
    }

    /// Merges the passages of a block in two ruptures that are united.
    fn join(self, other: Passage) -> Passage {
        let (first, later) =
            if self.arrival_step <= other.arrival_step { (self, other) } else { (other, self) };
        // If the block slides, it detached after all of its re-attachments.
        let stop = match (first.stop, later.stop) {
            (Some(a), Some(b)) => Some(if a.step >= b.step { a } else { b }),
            _ => None,
        };
        let measured = first
            .measured
            .zip(later.measured)
            .map(|(of_first, of_later)| Measured { step: of_first.step + of_later.step, ..of_first });
        Passage { stop, measured, detachments: first.detachments + later.detachments, ..first }
    }
}

/// The largest number of steps whose product with `step_s`, in double precision, is at most `time_s`.
fn most_steps_within(time_s: f64, step_s: f64) -> u64 {
    let near = time_s / step_s;
    if near >= MOST_EXACT_STEPS {
        return u64::MAX;
    }
    // Division and multiplication may round to either side.
    let near = near as u64;
    let within = |steps: &u64| *steps as f64 * step_s <= time_s;
    (near.saturating_sub(1)..=near + 1).rev().find(within).unwrap_or(0)
}

/// Largest whole number up to which doubles are exact; no run has more steps.
const MOST_EXACT_STEPS: f64 = (1u64 << 53) as f64;

impl RuptureTracker {
    /// A tracker for these contacts, all stuck, with time steps of `step_s` seconds.
    pub fn new(blocks: impl Into<Contacts>, step_s: f64, t_link_s: f64) -> RuptureTracker {
        let contacts = blocks.into();
        RuptureTracker {
            contacts,
            link_steps: most_steps_within(t_link_s, step_s),
            last: vec![None; contacts.count() as usize],
            open: BTreeMap::new(),
            growing: BTreeSet::new(),
            next: 0,
            certain: Vec::new(),
            farthest: None,
            ruptures: 0,
            spring_factors: Vec::new(),
            held: VecDeque::new(),
        }
    }

    /// Processes the next record, and adds the ruptures that are now certain and wait for no state to `slipped`.
    pub fn observe(&mut self, record: &StepRecord, slipped: &mut Vec<Slipped>) {
        let mut ended = Vec::new();
        while let Some(&(step, id)) = self.growing.first()
            && !self.links(step, record.step)
        {
            self.growing.pop_first();
            if self.open[&id].sliding == 0 {
                ended.push(id);
            }
        }
        // Independent of the order of switches within a step.
        let farthest_before = self.farthest;
        for switch in &record.switches {
            match switch.direction {
                Direction::Detach => self.detach(record, switch, farthest_before),
                Direction::Attach => ended.extend(self.attach(record, switch)),
            }
        }
        // In the order in which they became certain, whatever the distance between records.
        ended.sort_by_key(|id| (self.certain_step(&self.open[id]), self.open[id].nucleation));
        for id in ended {
            let held = self.close(id, false);
            self.held.push_back(held);
        }
        self.release(record.step, slipped);
    }

    /// Processes the state of all contacts, which follows the record of its step, and adds the ruptures that waited
    /// for it to `slipped`.
    pub fn observe_state(&mut self, state: &FieldRecord, slipped: &mut Vec<Slipped>) {
        let begins = |slipping: &Slipping| slipping.nucleation.0 + 1 == state.step;
        let stops =
            |slipping: &Slipping| slipping.sliding == 0 && slipping.last_attachment.step + 1 == state.step;
        let is_of_open = self.open.values().any(|slipping| begins(slipping) || stops(slipping));
        if self.held.is_empty() && !is_of_open {
            return;
        }
        let forces = Arc::new(Forces {
            step: state.step,
            along_n: state.tangential_force_n.clone(),
            across_n: state.tangential_force_across_n.clone(),
        });
        for slipping in self.open.values_mut() {
            if begins(slipping) {
                slipping.before = Some(Arc::clone(&forces));
            }
            if stops(slipping) {
                slipping.after = Some(Arc::clone(&forces));
            }
        }
        for Held { slipped, before } in &mut self.held {
            if slipped.ends_in(state.step)
                && let Some(before) = before.take()
            {
                slipped.bear(&before, &forces);
            }
        }
        self.release(state.step, slipped);
    }

    /// Adds the first certain ruptures whose state at the end is known, or was not recorded up to a step, to `slipped`.
    fn release(&mut self, step: u64, slipped: &mut Vec<Slipped>) {
        let waits = |held: &Held| {
            held.before.is_some() && held.slipped.end.is_some_and(|(end_step, _)| end_step >= step)
        };
        while let Some(held) = self.held.pop_front_if(|held| !waits(held)) {
            slipped.push(held.slipped);
        }
    }

    /// Ends the run, and adds the ruptures that are not certain to `slipped`.
    pub fn finish(&mut self, slipped: &mut Vec<Slipped>) {
        slipped.extend(self.held.drain(..).map(|held| held.slipped));
        let mut left: Vec<Id> = self.open.keys().copied().collect();
        left.sort_by_key(|id| self.open[id].nucleation);
        slipped.extend(left.into_iter().map(|id| self.close(id, true).slipped));
    }

    /// Whether detachments in these steps are close enough to be linked.
    fn links(&self, earlier: u64, later: u64) -> bool {
        later - earlier <= self.link_steps
    }

    /// The first step after which nothing can join a rupture.
    fn certain_step(&self, slipping: &Slipping) -> u64 {
        let linked_no_more = slipping.last_detachment.saturating_add(self.link_steps).saturating_add(1);
        slipping.last_attachment.step.max(linked_no_more)
    }

    fn detach(&mut self, record: &StepRecord, switch: &Switch, farthest_before: Option<u32>) {
        // Ruptures of a contact and its neighbours, nine at most over an area.
        let mut linked = [0; 9];
        let mut count = 0;
        self.contacts.around(switch.block).for_each(|block| {
            if let Some(last) = self.last[block as usize - 1]
                && self.links(last.step, record.step)
            {
                linked[count] = last.of;
                count += 1;
            }
        });
        let linked = &mut linked[..count];
        linked.sort_unstable();
        let linked = linked.chunk_by(|a, b| a == b).map(|same| same[0]);
        let passage = Passage {
            arrival_step: record.step + 1,
            ft_fn_arrival: record.load_ratio(),
            displacement_detach_m: displacement_m(switch),
            force_detach_n: force_n(switch),
            direction: direction(switch),
            states_n: None,
            measured: switch.measured,
            detachments: 1,
            stop: None,
        };
        let id = match linked.reduce(|a, b| self.unite(a, b)) {
            Some(id) => id,
            None => {
                let id = self.next;
                self.next += 1;
                let begun = Slipping {
                    blocks: BTreeMap::new(),
                    nucleation: (record.step, switch.block),
                    ft_fn_onset: record.load_ratio(),
                    ft_fn_error: record.ft_fn_error,
                    energy_before: record.energy,
                    last_detachment: record.step,
                    detachments: 0,
                    sliding: 0,
                    last_attachment: Attachment::at(record),
                    farthest_before,
                    anchored_m2: 0.0,
                    before: None,
                    after: None,
                };
                self.open.insert(id, begun);
                id
            }
        };
        let stretch_m2 = self.stretch_m2(switch);
        let slipping = self.open.get_mut(&id).expect("it was found or made");
        self.growing.remove(&(slipping.last_detachment, id));
        self.growing.insert((record.step, id));
        slipping.nucleation = slipping.nucleation.min((record.step, switch.block));
        slipping.last_detachment = record.step;
        slipping.detachments += 1;
        slipping.sliding += 1;
        slipping.anchored_m2 -= stretch_m2;
        let before = slipping.blocks.get(&switch.block).copied();
        slipping.blocks.insert(switch.block, before.map_or(passage, |before| before.join(passage)));
        self.last[switch.block as usize - 1] = Some(Detachment { step: record.step, of: id });
        self.farthest = self.farthest.max(Some(self.contacts.column(switch.block)));
    }

    /// The rupture of the block, if this makes it certain.
    fn attach(&mut self, record: &StepRecord, switch: &Switch) -> Option<Id> {
        let Detachment { of: id, .. } = self.last[switch.block as usize - 1]?;
        let stretch_m2 = self.stretch_m2(switch);
        let slipping = self.open.get_mut(&id)?;
        let passage = slipping.blocks.get_mut(&switch.block)?;
        passage.stop = Some(Stop {
            step: record.step + 1,
            displacement_m: displacement_m(switch),
            force_n: force_n(switch),
        });
        slipping.last_attachment = Attachment::at(record);
        slipping.sliding -= 1;
        slipping.anchored_m2 += stretch_m2;
        let waits = self.growing.contains(&(slipping.last_detachment, id));
        (slipping.sliding == 0 && !waits).then_some(id)
    }

    /// [`squared_stretch_m2`], times the spring's stiffness over the mean one.
    fn stretch_m2(&self, switch: &Switch) -> f64 {
        let factor = self.spring_factors.get(switch.block as usize - 1).copied().unwrap_or(1.0);
        factor * squared_stretch_m2(switch)
    }

    /// Merges two ruptures, the smaller into the larger.
    fn unite(&mut self, a: Id, b: Id) -> Id {
        let (small, large) =
            if self.open[&a].blocks.len() < self.open[&b].blocks.len() { (a, b) } else { (b, a) };
        let joining = self.open.remove(&small).expect("it is open");
        self.growing.remove(&(joining.last_detachment, small));
        let slipping = self.open.get_mut(&large).expect("it is open");
        self.growing.remove(&(slipping.last_detachment, large));
        if joining.nucleation < slipping.nucleation {
            slipping.nucleation = joining.nucleation;
            slipping.ft_fn_onset = joining.ft_fn_onset;
            slipping.ft_fn_error = joining.ft_fn_error;
            slipping.energy_before = joining.energy_before;
            slipping.farthest_before = joining.farthest_before;
            slipping.before = joining.before;
        }
        slipping.last_detachment = slipping.last_detachment.max(joining.last_detachment);
        if joining.last_attachment.step > slipping.last_attachment.step {
            slipping.last_attachment = joining.last_attachment;
        }
        slipping.detachments += joining.detachments;
        slipping.sliding += joining.sliding;
        slipping.anchored_m2 += joining.anchored_m2;
        for (block, passage) in joining.blocks {
            let there = slipping.blocks.get(&block).copied();
            slipping.blocks.insert(block, there.map_or(passage, |there| there.join(passage)));
            if let Some(last) = self.last[block as usize - 1].as_mut().filter(|last| last.of == small) {
                last.of = large;
            }
        }
        self.growing.insert((slipping.last_detachment, large));
        large
    }

    fn close(&mut self, id: Id, open: bool) -> Held {
        let slipping = self.open.remove(&id).expect("it is open");
        self.growing.remove(&(slipping.last_detachment, id));
        let (step, nucleation_block) = slipping.nucleation;
        let onset_step = step + 1;
        let end = (slipping.sliding == 0).then_some(slipping.last_attachment);
        let end_step = end.map_or(u64::MAX, |end| end.step + 1);
        // An open rupture that began before this one's end overlaps with it: if it had ended before this
        // one began, it would have become certain first.
        let overlapping = self.open.values().any(|other| other.nucleation.0 + 1 < end_step)
            || self.certain.iter().any(|&(from, to)| from < end_step && onset_step < to);
        self.certain.push((onset_step, end_step));
        let earliest = self.open.values().map(|other| other.nucleation.0 + 1).min();
        self.certain.retain(|&(_, to)| earliest.is_some_and(|earliest| earliest < to));
        let rupture = self.ruptures;
        self.ruptures += 1;
        let before = slipping.before.filter(|_| !overlapping && !open);
        let mut slipped = Slipped {
            rupture,
            blocks: slipping.blocks,
            nucleation_block,
            onset_step,
            ft_fn_onset: slipping.ft_fn_onset,
            ft_fn_error: slipping.ft_fn_error,
            end: end.map(|end| (end.step + 1, end.ft_fn)),
            detachments: slipping.detachments,
            farthest_before: slipping.farthest_before,
            overlapping,
            open,
            energies: end.filter(|_| !overlapping && !open).map(|end| [slipping.energy_before, end.energy]),
            anchored_m2: slipping.anchored_m2,
        };
        match (before, slipping.after) {
            (Some(before), Some(after)) if slipped.ends_in(after.step) => {
                slipped.bear(&before, &after);
                Held { slipped, before: None }
            }
            (before, _) => Held { slipped, before },
        }
    }
}
