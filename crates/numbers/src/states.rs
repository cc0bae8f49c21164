//! The states of all blocks that something is measured in, picked out as they pass.
//!
//! A log has a state at the onset and at the end of every slip event. Whether the event counts is known
//! only from its record, which follows its end. So states at onsets and ends wait until the next event says
//! which of them are kept. A run has at most as many precursors as blocks, however long it is.

use std::collections::BTreeMap;

use asperity_record::{FieldRecord, SlipEvent, StepRecord};

use crate::growth::EventGrowth;
use crate::required_data::RequiredData;

/// States and quantities derived from them.
#[derive(Debug, Clone, Default)]
pub struct States {
    first: Option<FieldRecord>,
    at_first_onset: Option<FieldRecord>,
    at_precursor_onsets: Vec<FieldRecord>,
    at_precursor_ends: Vec<FieldRecord>,
    near_s: Vec<(f64, Option<FieldRecord>)>,
    displacements: BTreeMap<u32, Vec<(f64, f64)>>,
    /// The largest displacement of any block in any state, m.
    pub largest_displacement_m: Option<f64>,
    /// The sum of the displacements of all blocks in the last state, m.
    pub(crate) last_displacement_sum_m: Option<f64>,
    keeps: bool,
    keeps_onsets: bool,
    /// States at onsets and ends since the last slip event.
    waiting: Vec<FieldRecord>,
    /// Ends of precursors whose states are still to come.
    awaited: Vec<u64>,
    growth: EventGrowth,
    any_slip: bool,
    /// The last step, the number of blocks that slid in it, and whether it changed from or to 0.
    last: (u64, u32, bool),
}

impl States {
    /// Without data yet, for a slider of this many blocks.
    pub fn new(blocks: u32, required: &RequiredData) -> States {
        let moving = |block: &u32| required.displacements || required.displacements_of.contains(block);
        States {
            near_s: required.states_near_s.iter().map(|at_s| (*at_s, None)).collect(),
            displacements: (1..=blocks).filter(moving).map(|block| (block, Vec::new())).collect(),
            keeps: required.states,
            keeps_onsets: required.precursor_onsets,
            growth: EventGrowth::new(blocks),
            ..States::default()
        }
    }

    /// A step record has passed.
    pub fn step(&mut self, record: &StepRecord) {
        let (_, before, _) = self.last;
        self.last = (record.step, record.sliding, (before == 0) != (record.sliding == 0));
    }

    /// A state has passed.
    pub fn state(&mut self, record: &FieldRecord) {
        for (at_s, nearest) in &mut self.near_s {
            let distance = |state: &FieldRecord| (state.time_s - *at_s).abs();
            // The earliest of equals.
            if nearest.as_ref().is_none_or(|nearest| distance(record).total_cmp(&distance(nearest)).is_lt()) {
                *nearest = Some(record.clone());
            }
        }
        for (block, course) in &mut self.displacements {
            if let Some(displacement_m) = record.displacement_m.get(*block as usize - 1) {
                course.push((record.time_s, *displacement_m));
            }
        }
        if !self.keeps {
            return;
        }
        let largest = record.displacement_m.iter().copied().reduce(f64::max);
        self.largest_displacement_m = self.largest_displacement_m.into_iter().chain(largest).reduce(f64::max);
        self.last_displacement_sum_m = Some(record.displacement_m.iter().sum());
        if record.step == 0 {
            self.first = Some(record.clone());
        }
        if self.awaited.contains(&record.step) {
            self.awaited.retain(|step| *step != record.step);
            self.at_precursor_ends.push(record.clone());
        } else if self.last.2 && self.last.0 == record.step && !(self.any_slip && self.growth.is_over()) {
            self.waiting.push(record.clone());
        }
    }

    /// A slip event has become certain.
    pub fn slip(&mut self, slip: &SlipEvent) {
        if !self.keeps {
            return;
        }
        let at_onset = self.waiting.iter().find(|state| state.step == slip.onset_step);
        if !self.any_slip {
            self.at_first_onset = at_onset.cloned();
            self.any_slip = true;
        }
        let extends = self.growth.extends(slip.reach(), slip.blocks_slipped);
        if extends && self.keeps_onsets {
            self.at_precursor_onsets.extend(at_onset.cloned());
        }
        if let Some(end_step) = slip.end_step.filter(|_| extends) {
            match self.waiting.iter().position(|state| state.step == end_step) {
                Some(index) => self.at_precursor_ends.push(self.waiting.swap_remove(index)),
                None => self.awaited.push(end_step),
            }
        }
        self.waiting.retain(|state| slip.end_step.is_some_and(|end_step| state.step > end_step));
        if self.growth.is_over() {
            self.waiting = Vec::new();
        }
    }

    /// No more comes.
    pub fn end(&mut self) {
        self.waiting = Vec::new();
        self.at_precursor_ends.sort_by_key(|state| state.step);
    }

    /// That before the first step.
    pub fn first(&self) -> Option<&FieldRecord> {
        self.first.as_ref()
    }

    /// That at the onset of the first slip event.
    pub fn at_first_onset(&self) -> Option<&FieldRecord> {
        self.at_first_onset.as_ref()
    }

    /// The state at the onset of a precursor, for slip events without merging: after the first step in
    /// which a block slid.
    pub fn at_precursor_onset(&self, step: u64) -> Option<&FieldRecord> {
        self.at_precursor_onsets.iter().find(|state| state.step == step)
    }

    /// The state at the end of a precursor, for slip events without merging.
    pub fn at_precursor_end(&self, step: u64) -> Option<&FieldRecord> {
        self.at_precursor_ends.iter().find(|state| state.step == step)
    }

    /// That nearest to one of the times that were asked for, s; the earliest of equals.
    pub fn near(&self, at_s: f64) -> Option<&FieldRecord> {
        self.near_s.iter().find(|(asked_s, _)| *asked_s == at_s)?.1.as_ref()
    }

    /// Time, s, and displacement, m, in all states of one of the blocks that were asked for.
    pub fn displacement_of(&self, block: u32) -> &[(f64, f64)] {
        self.displacements.get(&block).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{Direction, FieldRecord, StepRecord};
    use asperity_testkit::{quiet_step, slip_event, switch};

    use super::States;
    use crate::required_data::RequiredData;

    fn state(step: u64, displacement_m: f64) -> FieldRecord {
        FieldRecord {
            step,
            time_s: step as f64,
            displacement_m: vec![displacement_m; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![0.0; 3],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 3],
            detached: vec![0; 3],
            ..FieldRecord::default()
        }
    }

    /// However many events there are, no more states stay than there are precursors, whether an
    /// event arrives before the state at its end or after it.
    #[test]
    fn states_at_the_first_onset_and_at_ends_of_precursors_stay() {
        for event_first in [false, true] {
            let mut states = States::new(
                3,
                &(RequiredData { states_near_s: vec![24.6], ..RequiredData::STATES } | RequiredData::NOTHING),
            );
            states.state(&state(0, -2.0));
            for event in 0..1000u64 {
                let (onset, end) = (10 * event + 2, 10 * event + 5);
                let step = |step: u64, sliding| StepRecord {
                    sliding,
                    switches: vec![switch(1, Direction::Detach)],
                    ..quiet_step(step, step as f64, 0.0)
                };
                // Event 1 has one more block, event 500 all three.
                let last = if event >= 500 { 3 } else { 1 + event.min(1) as u32 };
                let slip = slip_event(onset, end, 1..=last);
                states.step(&step(onset, 1));
                states.state(&state(onset, 0.0));
                states.state(&state(onset + 1, 0.5));
                states.step(&step(end, 0));
                if event_first {
                    states.slip(&slip);
                }
                states.state(&state(end, 0.0));
                if !event_first {
                    states.slip(&slip);
                }
            }
            states.end();
            assert_eq!(states.first().unwrap().displacement_m[0], -2.0);
            assert_eq!(states.at_first_onset().unwrap().step, 2);
            let kept: Vec<u64> =
                (0..10_010).filter(|step| states.at_precursor_end(*step).is_some()).collect();
            assert_eq!(kept, [5, 15, 5005]);
            assert_eq!(states.largest_displacement_m, Some(0.5));
            assert_eq!(states.near(24.6).unwrap().step, 25);
        }
    }
}
