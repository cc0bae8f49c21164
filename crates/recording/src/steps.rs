//! Steps of sensors as the step records of a run: an arrival is a detachment, a stop a re-attachment.

use std::collections::BTreeMap;

use asperity_record::{Direction, Measured, StepRecord, Switch, TimeGrid};

use crate::force::{Loads, Side};

/// A step that a sensor saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorStep {
    /// Counted from 1.
    pub(crate) sensor: u32,
    pub(crate) arrival_s: f64,
    pub(crate) stop_s: f64,
    /// With the error of the arrival.
    pub(crate) measured: Measured,
}

/// What a sensor does between two steps of the grid.
#[derive(Debug, Clone, Copy)]
struct Slide {
    sensor: u32,
    begin: u64,
    end: u64,
    /// Where it was at the beginning.
    displacement_m: f64,
    measured: Measured,
}

/// The steps of the grid that have a record.
#[derive(Debug)]
pub(crate) struct Timeline {
    grid: TimeGrid,
    are_slips: bool,
    slides: Vec<Slide>,
    /// By the step of each record, the numbers of the slides that begin or end there, in order of their sensors.
    turns: BTreeMap<u64, Vec<usize>>,
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
        let mut slides: Vec<Slide> = Vec::with_capacity(steps.len());
        let mut last_of: BTreeMap<u32, usize> = BTreeMap::new();
        for SensorStep { sensor, arrival_s, stop_s, measured } in steps {
            let begin = grid.nearest_step(arrival_s).max(2);
            let end = grid.nearest_step(stop_s).max(begin + 1);
            let before = last_of.get(&sensor).map(|n| &mut slides[*n]);
            let displacement_m = match before {
                // It goes on.
                Some(before) if begin <= before.end => {
                    before.end = end.max(before.end);
                    before.measured.step += measured.step;
                    continue;
                }
                Some(before) if are_slips => before.displacement_m + before.measured.step,
                _ => 0.0,
            };
            last_of.insert(sensor, slides.len());
            slides.push(Slide { sensor, begin, end, displacement_m, measured });
        }
        let mut turns: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for (n, slide) in slides.iter().enumerate() {
            // A switch takes effect from the next step.
            turns.entry(slide.begin - 1).or_default().push(n);
            turns.entry(slide.end - 1).or_default().push(n);
        }
        turns.values_mut().for_each(|turns| turns.sort_unstable_by_key(|n| slides[*n].sensor));
        let mut timeline = Timeline { grid, are_slips, slides, turns };
        // Beside switches the first and the last step of each slip event, and the samples.
        let (mut beside, mut sliding) = (vec![last], 0);
        for (step, turns) in &timeline.turns {
            let before = sliding;
            sliding = timeline.sliding(sliding, *step, turns);
            beside.extend((before == 0 || sliding == 0).then_some(step + 1));
        }
        let sampled = (1..).map(|n| grid.nearest_step(n as f64 * sample_s)).take_while(|step| *step < last);
        for step in beside.into_iter().chain(sampled.filter(|step| *step > 0)) {
            timeline.turns.entry(step).or_default();
        }
        timeline
    }

    /// How many sensors slide behind a step, of so many before.
    fn sliding(&self, before: u32, step: u64, turns: &[usize]) -> u32 {
        let detached = self.detaching(step, turns);
        before + detached - (turns.len() as u32 - detached)
    }

    /// How many sensors begin to slide behind a step.
    fn detaching(&self, step: u64, turns: &[usize]) -> u32 {
        turns.iter().filter(|n| self.slides[**n].begin == step + 1).count() as u32
    }

    /// The times at which loads are wanted, with the samples that tell them, in the order of the records.
    pub(crate) fn wanted(&self) -> impl Iterator<Item = (f64, Side)> {
        let mut last: Option<(u64, Side)> = None;
        self.turns.iter().map(move |(&step, turns)| {
            // The step behind a switch has its loads.
            let (at, side) = match last {
                Some((before, side)) if before + 1 == step && turns.is_empty() => (before, side),
                _ if self.detaching(step, turns) > 0 || turns.is_empty() => (step, Side::Before),
                _ => (step, Side::Behind),
            };
            last = Some((step, side));
            (self.grid.time_s(at), side)
        })
    }

    /// The records, with the loads that were wanted; of a recording without forces there are none.
    pub(crate) fn records(&self, loads: &[Loads], normal_load_n: f64) -> impl Iterator<Item = StepRecord> {
        let without = Loads { driving_force_n: 0.0, normal_load_n, ratio_error: None };
        let mut sliding = 0;
        self.turns.iter().enumerate().map(move |(n, (&step, turns))| {
            let loads = loads.get(n).copied().unwrap_or(without);
            let record = StepRecord {
                step,
                time_s: self.grid.time_s(step),
                driving_force_n: loads.driving_force_n,
                normal_load_n: loads.normal_load_n,
                ft_fn_error: loads.ratio_error,
                sliding,
                switches: turns.iter().map(|n| self.switch(step, &self.slides[*n])).collect(),
                ..StepRecord::default()
            };
            sliding = self.sliding(sliding, step, turns);
            record
        })
    }

    /// A switch of which only the time, the displacement and the step are measured; the rest is 0.
    fn switch(&self, step: u64, slide: &Slide) -> Switch {
        let Slide { sensor, begin, displacement_m, measured, .. } = *slide;
        let detaches = begin == step + 1;
        Switch {
            block: sensor,
            direction: if detaches { Direction::Detach } else { Direction::Attach },
            displacement_m: displacement_m + if self.are_slips && !detaches { measured.step } else { 0.0 },
            measured: Some(measured),
            ..Switch::default()
        }
    }
}
