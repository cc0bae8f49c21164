//! Steps of sensors as the step records of a run: an arrival is a detachment, a stop a re-attachment.

use std::collections::BTreeMap;

use asperity_record::{Direction, Measured, StepRecord, Switch, TimeGrid};

use crate::force::{Loads, Side};

/// A step that a sensor saw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SensorStep {
    pub(crate) part: usize,
    /// Counted from 1.
    pub(crate) sensor: u32,
    pub(crate) arrival_s: f64,
    pub(crate) stop_s: f64,
    /// With the error of the arrival.
    pub(crate) measured: Measured,
    /// The least and the largest value that it has for a while.
    pub(crate) plateaus: [f64; 2],
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

/// A step at which a sensor begins or ends to slide from the next one on, with its number and that of its slide; without
/// both a step that has a record for another reason.
type Turn = (u64, Option<(u32, usize)>);

/// The steps of the grid that have a record.
#[derive(Debug)]
pub(crate) struct Timeline {
    grid: TimeGrid,
    are_slips: bool,
    slides: Vec<Slide>,
    /// In order.
    turns: Vec<Turn>,
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
        for SensorStep { sensor, arrival_s, stop_s, measured, .. } in steps {
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
        let ends = |(n, of): (usize, &Slide)| [of.begin, of.end].map(|step| (step - 1, Some((of.sensor, n))));
        let mut turns: Vec<Turn> = slides.iter().enumerate().flat_map(ends).collect();
        turns.sort_unstable();
        let mut timeline = Timeline { grid, are_slips, slides, turns };
        // Beside switches the first and the last step of each slip event, and the samples.
        let counts: Vec<(u64, u32)> = timeline.all().map(|(of, ..)| (of.step, of.sliding)).collect();
        let behind = counts.iter().skip(1).map(|(_, sliding)| *sliding).chain([0]);
        let ends = counts.iter().zip(behind).filter(|((_, before), behind)| *before == 0 || *behind == 0);
        let sampled = (1..).map(|n| grid.nearest_step(n as f64 * sample_s)).take_while(|step| *step < last);
        let beside = ends.map(|((step, _), _)| step + 1).chain(sampled.filter(|step| *step > 0));
        timeline.turns.extend(beside.chain([last]).map(|step| (step, None)));
        timeline.turns.sort_unstable();
        timeline
    }

    /// The records without loads, each with the time whose loads it has, and the samples that tell those.
    pub(crate) fn all(&self) -> impl Iterator<Item = (StepRecord, f64, Side)> {
        let (mut sliding, mut last) = (0, None);
        self.turns.chunk_by(|a, b| a.0 == b.0).map(move |turns| {
            let step = turns[0].0;
            let slides = turns.iter().filter_map(|(_, turn)| Some(&self.slides[(*turn)?.1]));
            let switches: Vec<Switch> = slides.map(|slide| self.switch(step, slide)).collect();
            let detached = switches.iter().filter(|of| of.direction == Direction::Detach).count() as u32;
            let (at, side) = match last {
                // The step behind a switch has its loads.
                Some((before, side)) if before + 1 == step && switches.is_empty() => (before, side),
                _ if detached > 0 || switches.is_empty() => (step, Side::Before),
                _ => (step, Side::Behind),
            };
            last = Some((step, side));
            let behind = sliding + 2 * detached - switches.len() as u32;
            let sliding = std::mem::replace(&mut sliding, behind);
            let time_s = self.grid.time_s(step);
            let record = StepRecord { step, time_s, sliding, switches, ..StepRecord::default() };
            (record, self.grid.time_s(at), side)
        })
    }

    /// The records, with these loads; of a recording without forces there are none.
    pub(crate) fn records(&self, loads: &[Loads], normal_load_n: f64) -> impl Iterator<Item = StepRecord> {
        let without = Loads { driving_force_n: 0.0, normal_load_n, ratio_error: None };
        self.all().enumerate().map(move |(n, (record, ..))| {
            let Loads { driving_force_n, normal_load_n, ratio_error: ft_fn_error } =
                loads.get(n).copied().unwrap_or(without);
            StepRecord { driving_force_n, normal_load_n, ft_fn_error, ..record }
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
