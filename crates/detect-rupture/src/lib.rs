//! Finds ruptures: detachments that are connected in space and time.
//!
//! A slip event ends when no block slides anywhere. So creep merges everything that happens during it,
//! and two distant fronts are one event if they run at the same time. A rupture is the work of one
//! front: two detachments are linked if their blocks are the same or neighbours ([`Contacts::around`])
//! and at most `t_link` lies between them, and a rupture is a set of detachments connected by links.
//!
//! ```
//! use asperity_detect::{Detectors, SlipRules};
//! use asperity_detect_rupture::{Links, RuptureDetector};
//! use asperity_record::{Direction, Rupture, StepRecord, TimeGrid};
//! use asperity_testkit::{quiet_step, switch};
//!
//! // Blocks 2 and 3 detach one after the other; block 9 does at the same time, far away.
//! let at = |step: u64, switches: &[(u32, Direction)]| StepRecord {
//!     switches: switches.iter().map(|&(block, direction)| switch(block, direction)).collect(),
//!     ..quiet_step(step, step as f64 * 0.25, 0.4)
//! };
//! use Direction::{Attach, Detach};
//! let records = [
//!     at(8, &[(2, Detach), (9, Detach)]),
//!     at(9, &[(3, Detach)]),
//!     at(12, &[(2, Attach), (3, Attach), (9, Attach)]),
//!     at(20, &[]),
//! ];
//! let links = Links {
//!     t_link_s: 1.0,
//!     time_grid: TimeGrid::new(0.25),
//!     spacing_m: 0.001,
//!     modulus_n_per_m: 5e6,
//!     interfacial_stiffness_n_per_m: 2e6,
//!     first_share: 1.0,
//! };
//! let detector = RuptureDetector::new(10, links);
//! let detectors = Detectors::new(10, SlipRules::EVERY_SLIP, vec![Box::new(detector)]);
//! let mut detectors = detectors.with_ruptures(links.tracker(10));
//! let events = detectors.all_events(&records);
//! let ruptures: Vec<&Rupture> = events.iter().filter_map(|event| event.get()).collect();
//! assert_eq!(ruptures.len(), 2);
//! // The lonely block was certain first, a step before the other two.
//! assert_eq!((ruptures[0].first_block, ruptures[0].last_block), (9, 9));
//! assert_eq!((ruptures[1].first_block, ruptures[1].last_block), (2, 3));
//! assert_eq!((ruptures[1].onset_s, ruptures[1].end_s), (2.25, Some(3.25)));
//! assert!(ruptures[1].overlapping);
//! ```

mod front;

use std::sync::Arc;

use asperity_detect::{Detector, Passage, RuptureTracker, Slipped};
use asperity_record::{
    Arrival, BoundingBox, Contacts, Energy, Event, EventKind, Parts, Reach, Rupture, Sensors, TimeGrid,
    magnitude,
};

/// The link time, and the scales that convert blocks and steps to lengths and times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Links {
    /// Most time between two detachments that are linked, s.
    pub t_link_s: f64,
    /// The run's time steps.
    pub time_grid: TimeGrid,
    /// Length of a block, m.
    pub spacing_m: f64,
    /// Elastic modulus times width, N/m, for the moment of a rupture. Over an area the width is that of a contact.
    pub modulus_n_per_m: f64,
    /// Stiffness of a friction spring, N/m, for the energy of its stretch.
    pub interfacial_stiffness_n_per_m: f64,
    /// The share of a block's length that belongs to the first one: half of a node at the surface of a medium.
    pub first_share: f64,
}

impl Links {
    /// The tracker of the ruptures that they link, from which both detectors read.
    pub fn tracker(&self, contacts: impl Into<Contacts>) -> RuptureTracker {
        RuptureTracker::new(contacts, self.time_grid.step_s(), self.t_link_s)
    }
}

/// Emits a [`Rupture`] once nothing can join it any more.
#[derive(Debug, Clone)]
pub struct RuptureDetector {
    links: Links,
    contacts: Contacts,
    radiates: bool,
    sensors: Option<Arc<Sensors>>,
}

impl RuptureDetector {
    /// A detector for these contacts, in a run without radiation.
    pub fn new(blocks: impl Into<Contacts>, links: Links) -> RuptureDetector {
        RuptureDetector { links, contacts: blocks.into(), radiates: false, sensors: None }
    }

    /// This detector in a run whose contacts radiate, if `radiates`.
    #[must_use]
    pub fn radiating(self, radiates: bool) -> RuptureDetector {
        RuptureDetector { radiates, ..self }
    }

    /// This detector in a recording with these sensors.
    #[must_use]
    pub fn with_sensors(self, sensors: Option<Arc<Sensors>>) -> RuptureDetector {
        RuptureDetector { sensors, ..self }
    }
}

impl Detector for RuptureDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<Rupture>().with(Parts {
            area: self.contacts.is_area(),
            radiation: self.radiates,
            recording: self.sensors.is_some(),
            ..Parts::default()
        })
    }

    fn rupture(&mut self, slipped: &Slipped, emit: &mut dyn FnMut(Event)) {
        emit(Event::new(match &self.sensors {
            Some(sensors) => measured(slipped, &self.links, self.contacts, sensors),
            None => rupture(slipped, &self.links, self.contacts),
        }));
    }
}

/// Emits an [`Arrival`] for every block of a rupture, once nothing can join the rupture any more.
#[derive(Debug, Clone)]
pub struct ArrivalDetector {
    links: Links,
    contacts: Contacts,
    sensors: Option<Arc<Sensors>>,
}

impl ArrivalDetector {
    /// A detector for these contacts.
    pub fn new(blocks: impl Into<Contacts>, links: Links) -> ArrivalDetector {
        ArrivalDetector { links, contacts: blocks.into(), sensors: None }
    }

    /// This detector in a recording with these sensors.
    #[must_use]
    pub fn with_sensors(self, sensors: Option<Arc<Sensors>>) -> ArrivalDetector {
        ArrivalDetector { sensors, ..self }
    }
}

impl Detector for ArrivalDetector {
    fn emits(&self) -> EventKind {
        EventKind::of::<Arrival>().with(Parts {
            area: self.contacts.is_area(),
            recording: self.sensors.is_some(),
            ..Parts::default()
        })
    }

    fn rupture(&mut self, slipped: &Slipped, emit: &mut dyn FnMut(Event)) {
        let ArrivalDetector { links: Links { time_grid, spacing_m, .. }, contacts, ref sensors } = *self;
        let is_area = contacts.is_area();
        for (&block, passage) in &slipped.blocks {
            let towards = match block.cmp(&slipped.nucleation_block) {
                std::cmp::Ordering::Less => Some(block + 1),
                std::cmp::Ordering::Equal => None,
                std::cmp::Ordering::Greater => Some(block - 1),
            };
            let arrival_s = time_grid.time_s(passage.arrival_step);
            let of_slip = sensors.as_ref().is_none_or(|sensors| sensors.are_of_slip);
            let slip_m = passage.slip_m().filter(|_| of_slip);
            let at_m = |block: u32| sensors.as_ref().and_then(|sensors| sensors.x_m(block));
            // Block numbers are positions along a front only in a single row.
            let took_s = towards
                .filter(|_| !is_area)
                .map(|towards| arrival_s - time_grid.time_s(slipped.blocks[&towards].arrival_step));
            let apart_m = towards.and_then(|towards| Some((at_m(block)? - at_m(towards)?).abs()));
            emit(Event::new(Arrival {
                rupture: slipped.rupture,
                block,
                arrival_s,
                stop_s: passage.stop.map(|stop| time_grid.time_s(stop.step)),
                arrival_step: passage.arrival_step,
                stop_step: passage.stop.map(|stop| stop.step),
                detachments: passage.detachments,
                slip_m: slip_m.map(|[along_m, _]| along_m),
                force_detach_n: passage.force_detach_n,
                force_attach_n: passage.stop.filter(|_| sensors.is_none()).map(|stop| stop.force_n),
                front_speed_m_per_s: took_s
                    .filter(|took_s| *took_s != 0.0)
                    .map(|took_s| apart_m.unwrap_or(spacing_m) / took_s),
                force_before_n: passage.states_n.map(|[before_n, _]| before_n),
                force_after_n: passage.states_n.map(|[_, after_n]| after_n),
                column: is_area.then(|| contacts.column(block)),
                across: is_area.then(|| contacts.row(block)),
                slip_across_m: slip_m.filter(|_| is_area).map(|[_, across_m]| across_m),
                local_speed_m_per_s: is_area
                    .then(|| local_speed_m_per_s(slipped, &self.links, contacts, block))
                    .flatten(),
                x_m: at_m(block),
                arrival_error_s: passage.measured.map(|measured| measured.error_s),
                step: passage.measured.map(|measured| measured.step),
                step_error: passage.measured.map(|measured| measured.step_error),
            }));
        }
    }
}

/// How far a contact slid, m, whichever way.
fn slip_size_m(passage: &Passage) -> Option<f64> {
    passage.slip_m().map(magnitude)
}

/// The contacts of a rupture in the column of nucleation and on one side of it, row by row.
fn rows_on_side(
    slipped: &Slipped,
    contacts: Contacts,
    is_on_side: impl Fn(u32, u32) -> bool,
    time_s: impl Fn(&Passage) -> f64,
) -> Vec<Vec<front::Passed>> {
    let nucleation = contacts.column(slipped.nucleation_block);
    let mut rows: Vec<Vec<front::Passed>> = Vec::new();
    let mut last_row = 0;
    for (&contact, passage) in &slipped.blocks {
        let (column, row) = (contacts.column(contact), contacts.row(contact));
        if !is_on_side(column, nucleation) {
            continue;
        }
        if row != last_row {
            rows.push(Vec::new());
            last_row = row;
        }
        let row = rows.last_mut().expect("it has just begun");
        row.push((column.abs_diff(nucleation), time_s(passage)));
    }
    // Away from the nucleation.
    rows.iter_mut().for_each(|row| row.sort_by_key(|(distance, _)| *distance));
    rows
}

fn rupture(slipped: &Slipped, links: &Links, contacts: Contacts) -> Rupture {
    let Links { time_grid, spacing_m, modulus_n_per_m, interfacial_stiffness_n_per_m, .. } = *links;
    let passages = &slipped.blocks;
    let extent = slipped.extent(contacts);
    let BoundingBox { columns: Reach { first, last }, rows } =
        extent.bounding_box().expect("a rupture has a block");
    let rows = contacts.is_area().then_some(rows);
    let last_to_slide =
        passages.values().max_by_key(|passage| passage.arrival_step).expect("a rupture has a block");
    let arrival_s = |passage: &Passage| time_grid.time_s(passage.arrival_step);
    let speed_m_per_s = |is_on_side: fn(u32, u32) -> bool| {
        front::speed_m_per_s(&rows_on_side(slipped, contacts, is_on_side, arrival_s), spacing_m)
    };
    let slips: Option<Vec<f64>> = passages.values().map(slip_size_m).collect();
    let strength_drops: Option<Vec<f64>> = passages.values().map(Passage::strength_drop_n).collect();
    let force_drops: Option<Vec<f64>> = passages.values().map(Passage::shear_force_drop_n).collect();
    // Forces are over the length that belongs to a block, slips are not.
    let share = |block: &u32| if *block == 1 { links.first_share } else { 1.0 };
    let sum = |values: &Vec<f64>| values.iter().sum::<f64>();
    let sum_of_slips =
        |slips: &Vec<f64>| passages.keys().zip(slips).map(|(block, slip)| share(block) * slip).sum::<f64>();
    let weighted = |(drops, slips): (&Vec<f64>, &Vec<f64>)| {
        let weighted: f64 = drops.iter().zip(slips).map(|(drop, slip)| drop * slip).sum();
        let sum_m = sum_of_slips(slips);
        (sum_m > 0.0).then(|| weighted / sum_m)
    };
    let count: f64 = passages.keys().map(share).sum();
    // Over the width of the slider, or of a contact.
    let potency_m2 = slips.as_ref().map(|slips| sum_of_slips(slips) * spacing_m);
    let change = |of: fn(&Energy) -> f64| slipped.energies.map(|[before, after]| of(&after) - of(&before));
    // Adds 0 to avoid -0 for laws without friction springs.
    let anchor_change_j = 0.5 * interfacial_stiffness_n_per_m * slipped.anchored_m2 + 0.0;
    // Records have the energies of springs after the switches of their step. The energy changed by
    // switches is therefore removed from both records, and that of the rupture's own switches is added.
    let in_steps_j = change(|energy| energy.elastic_j - energy.anchor_change_j);
    Rupture {
        rupture: slipped.rupture,
        onset_s: time_grid.time_s(slipped.onset_step),
        end_s: slipped.end.map(|(step, _)| time_grid.time_s(step)),
        first_block: first,
        last_block: last,
        nucleation_block: slipped.nucleation_block,
        reached_every_block: extent.is_whole(),
        ft_fn_onset: slipped.ft_fn_onset,
        ft_fn_arrival: last_to_slide.ft_fn_arrival,
        ft_fn_end: slipped.end.map(|(_, ft_fn)| ft_fn),
        onset_step: slipped.onset_step,
        arrival_s: arrival_s(last_to_slide),
        end_step: slipped.end.map(|(step, _)| step),
        detachments: slipped.detachments,
        front_speed_up_m_per_s: speed_m_per_s(|column, nucleation| column >= nucleation),
        front_speed_down_m_per_s: speed_m_per_s(|column, nucleation| column <= nucleation),
        mean_slip_m: slips.as_ref().map(|slips| sum_of_slips(slips) / count),
        largest_slip_m: slips.as_ref().map(|slips| slips.iter().copied().fold(0.0, f64::max)),
        potency_m2: potency_m2.filter(|_| rows.is_none()),
        moment_n_m: potency_m2.map(|potency_m2| potency_m2 * modulus_n_per_m),
        mean_strength_drop_n: strength_drops.as_ref().map(|drops| sum(drops) / count),
        farthest_block_before: slipped.farthest_before,
        overlapping: slipped.overlapping,
        open: slipped.open,
        drive_work_j: change(|energy| energy.drive_work_j),
        prestress_work_j: change(|energy| energy.prestress_work_j),
        friction_heat_j: change(|energy| energy.friction_heat_j),
        anchor_change_j: Some(anchor_change_j),
        viscous_loss_j: change(|energy| energy.viscous_loss_j),
        kinetic_change_j: change(|energy| energy.kinetic_j),
        elastic_change_j: in_steps_j.map(|in_steps_j| in_steps_j + anchor_change_j),
        scheme_work_j: change(|energy| energy.scheme_work_j),
        mean_shear_force_drop_n: force_drops.as_ref().map(|drops| sum(drops) / count),
        slip_weighted_shear_force_drop_n: force_drops.as_ref().zip(slips.as_ref()).and_then(weighted),
        first_across: rows.map(|rows| rows.first),
        last_across: rows.map(|rows| rows.last),
        contacts: rows.map(|_| extent.count()),
        potency_m3: rows.and(potency_m2).map(|potency_m2| potency_m2 * spacing_m),
        radiated_j: slipped
            .energies
            .and_then(|[before, after]| after.radiated_j.zip(before.radiated_j))
            .map(|(after_j, before_j)| after_j - before_j),
        ..Rupture::default()
    }
}

/// A rupture of a recording: without energies, which no sensor measures, and with errors.
fn measured(slipped: &Slipped, links: &Links, contacts: Contacts, sensors: &Sensors) -> Rupture {
    let rupture = rupture(&Slipped { energies: None, ..slipped.clone() }, links, contacts);
    let nucleation_m = sensors.x_m(rupture.nucleation_block);
    let seen = |is_on_side: fn(&u32, &u32) -> bool| {
        let there = slipped.blocks.iter().filter(|(sensor, _)| is_on_side(sensor, &rupture.nucleation_block));
        let mut seen: Vec<front::Seen> = there
            .filter_map(|(&sensor, passage)| {
                let away_m = (sensors.x_m(sensor)? - nucleation_m?).abs();
                Some([away_m, links.time_grid.time_s(passage.arrival_step), passage.measured?.error_s])
            })
            .collect();
        // Away from the nucleation.
        seen.sort_by(|a, b| a[0].total_cmp(&b[0]));
        front::measured_speed_m_per_s(&seen)
    };
    let (up, down) = (seen(u32::ge), seen(u32::le));
    let slips = slipped
        .blocks
        .iter()
        .map(|(&sensor, passage)| Some((slip_size_m(passage)?, sensors.share_m(sensor)?)));
    let slips: Option<Vec<(f64, f64)>> = slips.collect();
    let potency_m2 = slips
        .filter(|_| sensors.are_of_slip)
        .map(|slips| slips.iter().map(|(slip_m, share_m)| slip_m * share_m).sum::<f64>());
    let reached_m = sensors.behind_m(rupture.last_block);
    // The standard deviation of what lies anywhere in between.
    let length_error_m = reached_m.map(|[_, apart_m]| apart_m / 12f64.sqrt());
    Rupture {
        front_speed_up_m_per_s: up.map(|[speed, _]| speed),
        front_speed_down_m_per_s: down.map(|[speed, _]| speed),
        mean_slip_m: rupture.mean_slip_m.filter(|_| sensors.are_of_slip),
        largest_slip_m: rupture.largest_slip_m.filter(|_| sensors.are_of_slip),
        potency_m2,
        moment_n_m: potency_m2.map(|potency_m2| potency_m2 * links.modulus_n_per_m),
        mean_strength_drop_n: None,
        anchor_change_j: None,
        onset_error_s: slipped.blocks[&rupture.nucleation_block].measured.map(|measured| measured.error_s),
        length_m: reached_m.map(|[middle_m, _]| middle_m),
        length_error_m,
        front_speed_up_error_m_per_s: up.map(|[_, error]| error),
        front_speed_down_error_m_per_s: down.map(|[_, error]| error),
        ft_fn_error: slipped.ft_fn_error,
        ..rupture
    }
}

/// Speed of the front at a contact, by the arrivals of the rupture around it.
fn local_speed_m_per_s(slipped: &Slipped, links: &Links, contacts: Contacts, contact: u32) -> Option<f64> {
    let arrival = |near: u32| {
        let passage = slipped.blocks.get(&near)?;
        Some((contacts.column(near), contacts.row(near), passage.arrival_step))
    };
    let around: Vec<_> = contacts.around(contact).filter_map(arrival).collect();
    let steps_per_spacing = magnitude(front::gradient(&around)?);
    let spacing_s = steps_per_spacing * links.time_grid.step_s();
    (spacing_s > 0.0).then(|| links.spacing_m / spacing_s)
}
