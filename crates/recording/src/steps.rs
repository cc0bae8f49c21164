//! Steps of sensors as the step records of a run: an arrival is a detachment, a stop a re-attachment.

use std::collections::BTreeMap;

use asperity_record::{Direction, Energy, Measured, StepRecord, Switch, TimeGrid};

use crate::force::{Loads, Side};

/// A step that a sensor saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorStep {
    /// Counted from 1.
    pub(crate) sensor: u32,
    pub(crate) arrival_s: f64,
    pub(crate) stop_s: f64,
    /// Standard error of the arrival.
    pub(crate) error_s: f64,
    /// In the unit of the sensor.
    pub(crate) size: f64,
    pub(crate) size_error: f64,
}

/// The steps of the grid that have a record.
#[derive(Debug)]
pub(crate) struct Timeline {
    grid: TimeGrid,
    switches: BTreeMap<u64, Vec<Switch>>,
}

impl Timeline {
    /// Of steps in order of time, up to a last step of the grid, with records at an interval beside. The sizes of the
    /// steps are displacements of the sensors if `are_slips`.
    pub(crate) fn of(
        steps: Vec<SensorStep>,
        are_slips: bool,
        grid: TimeGrid,
        last: u64,
        sample_s: f64,
    ) -> Timeline {
        let mut of_sensors: BTreeMap<u32, Vec<(u64, u64, SensorStep)>> = BTreeMap::new();
        for step in steps {
            let begin = grid.nearest_step(step.arrival_s).max(2);
            let end = grid.nearest_step(step.stop_s).max(begin + 1);
            let before = of_sensors.entry(step.sensor).or_default();
            match before.last_mut() {
                // It goes on.
                Some((_, stop, first)) if begin <= *stop => {
                    *stop = end.max(*stop);
                    first.size += step.size;
                }
                _ => before.push((begin, end, step)),
            }
        }
        let mut switches: BTreeMap<u64, Vec<Switch>> = BTreeMap::new();
        for (sensor, steps) in of_sensors {
            let mut displacement_m = 0.0;
            for (begin, end, SensorStep { error_s, size, size_error, .. }) in steps {
                let measured = Measured { error_s, step: size, step_error: size_error };
                let detach = switch(sensor, Direction::Detach, displacement_m, measured);
                displacement_m += if are_slips { size } else { 0.0 };
                let attach = switch(sensor, Direction::Attach, displacement_m, measured);
                // A switch takes effect from the next step.
                switches.entry(begin - 1).or_default().push(detach);
                switches.entry(end - 1).or_default().push(attach);
            }
        }
        // The first and the last step of each slip event, and the samples.
        let (mut sliding, mut others) = (0_i64, Vec::new());
        for (step, turns) in &switches {
            let detached = i64::from(detaching(turns));
            let change = 2 * detached - turns.len() as i64;
            if sliding == 0 || sliding + change == 0 {
                others.push(step + 1);
            }
            sliding += change;
        }
        let sampled = (1..).map(|n| grid.nearest_step(n as f64 * sample_s)).take_while(|step| *step < last);
        for step in others.into_iter().chain(sampled.filter(|step| *step > 0)).chain([last]) {
            switches.entry(step).or_default();
        }
        Timeline { grid, switches }
    }

    /// The times at which loads are wanted, with the samples that tell them, in the order of the records.
    pub(crate) fn wanted(&self) -> impl Iterator<Item = (f64, Side)> {
        let mut last: Option<(u64, Side)> = None;
        self.switches.iter().map(move |(&step, turns)| {
            let detaches = detaching(turns) > 0;
            // The step behind a switch has its loads.
            let (at, side) = match last {
                Some((before, side)) if before + 1 == step && turns.is_empty() => (before, side),
                _ => (step, if detaches || turns.is_empty() { Side::Before } else { Side::Behind }),
            };
            last = Some((step, side));
            (self.grid.time_s(at), side)
        })
    }

    /// The records, with the loads that were wanted; of a recording without forces there are none.
    pub(crate) fn records(self, loads: &[Loads], normal_load_n: f64) -> Vec<StepRecord> {
        let without = Loads { driving_force_n: 0.0, normal_load_n, ratio_error: None };
        let mut sliding = 0;
        let records = self.switches.into_iter().enumerate().map(|(n, (step, mut turns))| {
            turns.sort_by_key(|turn| turn.block);
            let loads = loads.get(n).copied().unwrap_or(without);
            let detached = detaching(&turns);
            let attached = turns.len() as u32 - detached;
            let record = StepRecord {
                step,
                time_s: self.grid.time_s(step),
                driving_force_n: loads.driving_force_n,
                normal_load_n: loads.normal_load_n,
                ft_fn_error: loads.ratio_error,
                end_forces_n: None,
                energy: Energy::default(),
                junctions: None,
                peak_velocity_m_per_s: None,
                sliding,
                switches: turns,
            };
            sliding = sliding + detached - attached;
            record
        });
        records.collect()
    }
}

/// How many sensors begin to slide.
fn detaching(switches: &[Switch]) -> u32 {
    switches.iter().filter(|switch| switch.direction == Direction::Detach).count() as u32
}

/// A switch of which only the time, the displacement and the step are measured; the rest is 0.
fn switch(block: u32, direction: Direction, displacement_m: f64, measured: Measured) -> Switch {
    Switch {
        block,
        direction,
        displacement_m,
        velocity_m_per_s: 0.0,
        tangential_force_n: 0.0,
        stick_position_m: 0.0,
        threshold_n: 0.0,
        junctions_slipping: None,
        across: None,
        measured: Some(measured),
    }
}
