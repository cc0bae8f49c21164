//! Accumulates the summary of a run from its records and events.

use asperity_model::theory::analytic::{LengthLaw, LengthLawParameters};
use asperity_model::{Plan, Scenario};
use asperity_record::{
    Direction, Energy, Event, LoadDrop, Observer, Record, RunEnd, RunHeader, RunStatus, Rupture, SlipEvent,
    StepRecord,
};
use serde_json::Value;

use crate::catalogue::contact_area_m2;
use crate::creep::CreepFront;
use crate::growth::RuptureGrowth;
use crate::gutenberg_richter::GutenbergRichter;
use crate::magnitudes::Magnitudes;
use crate::rupture_numbers::{self as measures, WIDE_BLOCKS};
use crate::slip_events::SlipEvents;
use crate::statistics::{mean, median};
use crate::summary::Summary;
use crate::unloaded::Unloaded;

/// A creep front counts from this share of the slider on.
const CREEP_SHARE: f64 = 0.1;

/// Fewest intervals between global ruptures whose second half shows the steady state.
const FEWEST_INTERVALS: usize = 4;

/// Receives a run in its order, and returns its [`Summary`].
///
/// Stores the size of each rupture, the global ruptures, at most one precursor per block, the beginnings of wide ruptures and
/// wide slip events, the steps of all slip events, and load drops.
#[derive(Default)]
pub struct Summarizer {
    pub(crate) name: String,
    pub(crate) header: RunHeader,
    /// The area that a contact stands for, m2.
    contact_area_m2: Option<f64>,
    /// Whether moments are per metre of strike.
    pub(crate) is_in_medium: bool,
    /// The law of precursor lengths for the scenario, and its parameters.
    pub(crate) length_law: Option<(LengthLaw, LengthLawParameters)>,
    /// The plan, if contacts have a state and every block the same drive spring, so that `F_T` says how far the
    /// blocks have moved on average.
    driven: Option<Box<Plan>>,
    /// The step of the last record.
    pub(crate) last_step: u64,
    /// Step and `F_T` of the first and of the last record.
    driving_forces_n: Option<[(u64, f64); 2]>,
    pub(crate) energy: Option<Energy>,
    pub(crate) records: u64,
    pub(crate) switches: u64,
    pub(crate) detachments: u64,
    pub(crate) largest_ft_fn: Option<f64>,
    /// Whether the drive pulls both ways, so that `F_T` is a difference with little meaning, or `F_T` was not recorded.
    pub(crate) lacks_ft: bool,
    pub(crate) drops: Vec<LoadDrop>,
    creep: CreepFront,
    pub(crate) events: SlipEvents,
    pub(crate) unloaded: Unloaded,
    pub(crate) growth: RuptureGrowth<Rupture>,
    /// The global ruptures, by onset.
    pub(crate) global: Vec<Rupture>,
    pub(crate) ruptures: u64,
    pub(crate) wide: u64,
    pub(crate) overlapping: u64,
    pub(crate) open: u64,
    pub(crate) largest_slip_m: Option<f64>,
    pub(crate) magnitudes: Magnitudes,
    pub(crate) peak_velocity_m_per_s: Option<f64>,
    /// Sum of the slips of all blocks in all ruptures; none if a block still slid at the end.
    slip_m: Option<f64>,
    /// Once the run has ended: whether its ruptures are known, its end, and the law of its magnitudes.
    pub(crate) has_ruptures: bool,
    pub(crate) end: Option<RunEnd>,
    pub(crate) sizes: Option<GutenbergRichter>,
}

impl Summarizer {
    /// A summarizer for the run of this name, with its scenario, if the log has that.
    pub fn new(name: &str, header: &RunHeader, scenario: Option<&Scenario>) -> Summarizer {
        let area_m2 = |scenario: &Scenario| contact_area_m2(scenario.scales().block_length_m, scenario);
        let law = |of: &Scenario| {
            LengthLaw::is_for(of).then(|| (LengthLaw::natural(of), LengthLawParameters::of(of)))
        };
        let plan = scenario.filter(|scenario| scenario.has_state()).map(Plan::new);
        let is_even = |plan: &Plan| {
            let springs = &plan.drive.springs;
            springs.len() == plan.blocks
                && springs.iter().all(|spring| spring.stiffness_n_per_m == springs[0].stiffness_n_per_m)
        };
        Summarizer {
            name: name.to_owned(),
            header: header.clone(),
            contact_area_m2: scenario.map(area_m2),
            is_in_medium: scenario.is_some_and(|of| of.slider.is_in_medium()),
            // With both ends pulled, F_T is a difference; lattices have no such theory.
            length_law: scenario.and_then(law),
            driven: plan.filter(is_even).map(Box::new),
            creep: CreepFront::new(header.contacts()),
            events: SlipEvents::new(header.blocks),
            slip_m: Some(0.0),
            ..Summarizer::default()
        }
    }

    /// Adds a step record.
    pub fn step(&mut self, record: &StepRecord) {
        self.last_step = record.step;
        let force_n = (record.step, record.driving_force_n);
        self.driving_forces_n = Some([self.driving_forces_n.map_or(force_n, |[first, _]| first), force_n]);
        // No sensor measures energies.
        self.energy = self.header.sensors.is_none().then_some(record.energy);
        self.records += 1;
        self.switches += record.switches.len() as u64;
        self.largest_ft_fn = largest(self.largest_ft_fn, Some(record.load_ratio()));
        self.lacks_ft |= record.end_forces_n.is_some();
        self.unloaded.take(record);
        for switch in record.switches.iter().filter(|switch| switch.direction == Direction::Detach) {
            self.detachments += 1;
            // Of a fault line, every rupture begins by creep.
            if !self.is_in_medium {
                self.creep.slides(switch.block, record.step + 1);
            }
        }
    }

    /// Adds a slip event.
    pub fn slip_event(&mut self, slip: &SlipEvent) {
        self.peak_velocity_m_per_s = largest(self.peak_velocity_m_per_s, slip.peak_velocity_m_per_s);
        self.events.take(slip);
    }

    /// Adds a rupture.
    pub fn rupture(&mut self, rupture: &Rupture) {
        self.ruptures += 1;
        self.overlapping += u64::from(rupture.overlapping);
        self.open += u64::from(rupture.open);
        self.largest_slip_m = largest(self.largest_slip_m, rupture.largest_slip_m);
        self.magnitudes.take(rupture, self.is_in_medium);
        let slip_m = rupture.mean_slip_m.map(|mean_m| mean_m * f64::from(rupture.slipped()));
        self.slip_m = self.slip_m.zip(slip_m).map(|(sum_m, slip_m)| sum_m + slip_m);
        let starts = (rupture.onset_step, rupture.rupture);
        if !self.is_in_medium {
            self.growth.take(starts, rupture.reach(), || rupture.clone());
        }
        if measures::is_wide(rupture) {
            self.wide += 1;
            self.events.wide_rupture(rupture);
        }
        if rupture.reached_every_block {
            let place = self.global.partition_point(|known| known.onset_step <= rupture.onset_step);
            self.global.insert(place, rupture.clone());
        }
    }

    /// Ends the run, with its status if known. Without ruptures, as of a log of a program without their detector, the
    /// numbers that need them are unknown.
    pub fn finish(mut self, has_ruptures: bool, end: Option<&RunEnd>) -> Summary {
        let sensors = self.header.sensors.as_ref();
        self.has_ruptures = has_ruptures && sensors.is_none_or(|sensors| !sensors.x_m.is_empty());
        self.lacks_ft |= sensors.is_some() && self.largest_ft_fn == Some(0.0);
        self.last_step = end.map_or(self.last_step, |end| end.last_step);
        self.end = end.cloned();
        self.sizes = GutenbergRichter::complete(&self.magnitudes.all);
        Summary::of(&self)
    }

    pub(crate) fn known(&self, count: u64) -> Option<u64> {
        self.has_ruptures.then_some(count)
    }

    pub(crate) fn ratio(&self, value: Option<f64>) -> Option<f64> {
        value.and_then(finite).filter(|_| !self.lacks_ft)
    }

    /// How the run ended, in the word of its log.
    pub(crate) fn status(&self) -> String {
        let word = self.end.as_ref().and_then(|end| serde_json::to_value(end.status).ok());
        word.as_ref().and_then(Value::as_str).unwrap_or("unknown").to_owned()
    }

    pub(crate) fn simulated_s(&self) -> f64 {
        self.header.time_grid().time_s(self.last_step)
    }

    pub(crate) fn wave_speed_m_per_s(&self) -> f64 {
        self.header.scales.wave_speed_m_per_s()
    }

    pub(crate) fn speed_m_per_s(&self, rupture: &Rupture) -> Option<f64> {
        measures::front_speed_m_per_s(rupture, self.header.contacts(), Some(self.wave_speed_m_per_s()))
    }

    pub(crate) fn precursors(&self) -> impl Iterator<Item = &Rupture> {
        self.growth.iter().map(|(_, rupture)| rupture).filter(|rupture| !rupture.reached_every_block)
    }

    /// The first precursor that is more than a start of creep.
    pub(crate) fn first_precursor(&self) -> Option<&Rupture> {
        self.precursors().find(|rupture| measures::is_wide(rupture))
    }

    /// `L_p / L` of the precursors.
    pub(crate) fn lengths(&self) -> Vec<f64> {
        self.precursors().map(|rupture| self.header.length_ratio(rupture.last_block)[0]).collect()
    }

    /// `L_p / L` of the precursors, and `F_T / F_N` at the onset minus the length law.
    pub(crate) fn residuals(&self) -> Vec<(f64, f64)> {
        let Some((law, parameters)) = &self.length_law else { return Vec::new() };
        let residual =
            |(rupture, lp_l): (&Rupture, f64)| (lp_l, rupture.ft_fn_onset - law.load_ratio(parameters, lp_l));
        let all = self.precursors().zip(self.lengths()).map(residual);
        all.filter(|(_, residual)| residual.is_finite()).collect()
    }

    fn intervals_s(&self) -> Vec<f64> {
        self.global.windows(2).map(|pair| pair[1].onset_s - pair[0].onset_s).collect()
    }

    /// Over a quarter of the intervals instead of the first only: another slip of the whole slider may
    /// follow one at once.
    pub(crate) fn transient_s(&self) -> Option<f64> {
        let intervals = self.intervals_s();
        let quarter = intervals.len().div_ceil(4);
        median(intervals.into_iter().take(quarter))
    }

    pub(crate) fn steady_s(&self) -> Option<f64> {
        let intervals = self.intervals_s();
        let half = intervals.len().div_ceil(2);
        if intervals.len() < FEWEST_INTERVALS { None } else { median(intervals.into_iter().skip(half)) }
    }

    pub(crate) fn front_speed_m_per_s(&self) -> Option<f64> {
        median_of(self.precursors().chain(&self.global), |rupture| self.speed_m_per_s(rupture))
    }

    pub(crate) fn over_area(&self, force_n: Option<f64>) -> Option<f64> {
        force_n.zip(self.contact_area_m2).map(|(force_n, area_m2)| force_n / area_m2)
    }

    pub(crate) fn global_moment_n_m(&self) -> Option<f64> {
        mean_of(&self.global, |rupture| rupture.potency_m2)
            .map(|potency_m2| potency_m2 * self.header.scales.modulus_n_per_m)
            // Over an area, where the potency is another one.
            .or_else(|| mean_of(&self.global, |rupture| rupture.moment_n_m))
    }

    pub(crate) fn creep_front_block(&self) -> Option<u32> {
        let front = self.growth.iter().map(|(_, rupture)| rupture).find(|rupture| measures::is_wide(rupture));
        self.creep.before(front.map(|front| front.onset_step))
    }

    pub(crate) fn creeps(&self) -> bool {
        let from = CREEP_SHARE * f64::from(self.header.contacts().columns());
        self.creep_front_block().is_some_and(|block| block >= WIDE_BLOCKS && f64::from(block) >= from)
    }

    /// The sum of the displacements of the blocks at a record of a step and its `F_T`, m.
    fn displacement_m(&self, (step, driving_force_n): (u64, f64)) -> Option<f64> {
        let plan = self.driven.as_ref()?;
        let point_m = plan.outside(step, plan.drive.hold_from_step.unwrap_or(u64::MAX)).point_m;
        let stretch_m = driving_force_n / plan.drive.springs.first()?.stiffness_n_per_m;
        Some(plan.blocks as f64 * point_m - stretch_m)
    }

    pub(crate) fn creep_ratio(&self) -> Option<f64> {
        // A log that was cut or lost records lacks ruptures, whose slip would count as creep.
        let is_all = self.has_ruptures && self.end.as_ref()?.status != RunStatus::Salvaged;
        let [first_m, last_m] = self.driving_forces_n?.map(|force_n| self.displacement_m(force_n));
        let slip_m = self.slip_m.filter(|_| is_all)?;
        finite(1.0 - slip_m / (last_m? - first_m?))
    }

    /// Onset and end of each slip event, s, in a run that lasts as long as this one.
    fn events_s(&self) -> impl Iterator<Item = (f64, f64)> {
        let (grid, end_s) = (self.header.time_grid(), self.simulated_s());
        let time_s = move |step| if step == u64::MAX { end_s } else { grid.time_s(step) };
        self.events.steps.spans.iter().map(move |&(onset, end)| (time_s(onset), time_s(end)))
    }

    pub(crate) fn longest_event_s(&self) -> Option<f64> {
        self.events_s().map(|(onset_s, end_s)| end_s - onset_s).max_by(f64::total_cmp)
    }

    pub(crate) fn sliding_time_ratio(&self) -> Option<f64> {
        let until_s = self.global.first().map_or(self.simulated_s(), |first| first.onset_s);
        let slid = self.events_s().map(|(onset_s, end_s)| (end_s.min(until_s) - onset_s).max(0.0));
        // An empty sum of floats is -0.
        let slid_s = slid.fold(0.0, |sum_s, time_s| sum_s + time_s);
        (until_s > 0.0).then(|| slid_s / until_s)
    }

    pub(crate) fn events_mislead(&self) -> bool {
        let spacings = self.header.contacts().columns().saturating_sub(1);
        self.events.mislead(f64::from(spacings) * self.header.scales.block_time_s, self.longest_event_s())
    }

    pub(crate) fn solver(&self, count: &str) -> Option<u64> {
        self.end.as_ref()?.solver.counts.get(count).copied()
    }
}

impl Observer for Summarizer {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.step(record);
        }
    }

    /// Ignores events other than slip events, ruptures and load drops.
    fn event(&mut self, event: &Event) {
        if let Some(slip) = event.get::<SlipEvent>() {
            self.slip_event(slip);
        } else if let Some(rupture) = event.get::<Rupture>() {
            self.rupture(rupture);
        } else if let Some(drop) = event.get::<LoadDrop>() {
            self.drops.push(drop.clone());
        }
    }
}

/// JSON has no numbers that are not finite, such as `F_T / F_N` without a normal load.
pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn largest(known: Option<f64>, value: Option<f64>) -> Option<f64> {
    let value = value.and_then(finite);
    known.into_iter().chain(value).max_by(f64::total_cmp)
}

pub(crate) fn mean_of<'a>(
    ruptures: impl IntoIterator<Item = &'a Rupture>,
    measure: impl Fn(&Rupture) -> Option<f64>,
) -> Option<f64> {
    mean(ruptures.into_iter().filter_map(|rupture| measure(rupture).and_then(finite)))
}

pub(crate) fn median_of<'a>(
    ruptures: impl IntoIterator<Item = &'a Rupture>,
    measure: impl Fn(&Rupture) -> Option<f64>,
) -> Option<f64> {
    median(ruptures.into_iter().filter_map(|rupture| measure(rupture).and_then(finite)))
}
