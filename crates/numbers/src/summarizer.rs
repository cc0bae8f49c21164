//! Accumulates the summary of a run from its records and events.

use asperity_model::analytic::{LengthLaw, LengthLawParameters};
use asperity_model::{Plan, Scenario};
use asperity_record::{
    Direction, Energy, Event, Observer, Record, RunEnd, RunHeader, RunStatus, Rupture, SlipEvent, StepRecord,
    TimeGrid,
};

use crate::catalogue::contact_area_m2;
use crate::creep::CreepFront;
use crate::estimate;
use crate::growth::RuptureGrowth;
use crate::magnitudes::Magnitudes;
use crate::raw::RawEvents;
use crate::rupture_numbers::{self as measures, WIDE_BLOCKS};
use crate::statistics::{mean, median};
use crate::summary::{Summary, status};
use crate::unloaded::Unloaded;

/// A creep front counts from this share of the slider on.
const CREEP_SHARE: f64 = 0.1;

/// Fewest intervals between global ruptures whose second half shows the steady state.
const FEWEST_INTERVALS: usize = 4;

/// Properties of a slider beyond the header of its run.
#[derive(Default)]
pub struct Slider {
    /// The area that a contact stands for, m2.
    pub contact_area_m2: Option<f64>,
    /// The law of precursor lengths for the scenario, and its parameters.
    pub length_law: Option<(LengthLaw, LengthLawParameters)>,
    /// Its plan, if contacts have a state and every block the same drive spring, so that `F_T` says how far the
    /// blocks have moved on average.
    pub driven: Option<Box<Plan>>,
}

impl Slider {
    /// The properties of a scenario's slider.
    pub fn of(scenario: &Scenario) -> Slider {
        let law = (LengthLaw::natural(scenario), LengthLawParameters::of(scenario));
        // With both ends pulled, F_T is a difference; lattices have no such theory.
        let plan = scenario.has_state().then(|| Plan::new(scenario));
        let is_even = |plan: &Plan| {
            let springs = &plan.drive.springs;
            springs.len() == plan.blocks
                && springs.iter().all(|spring| spring.stiffness_n_per_m == springs[0].stiffness_n_per_m)
        };
        Slider {
            contact_area_m2: Some(contact_area_m2(scenario.scales().block_length_m, scenario)),
            length_law: LengthLaw::is_for(scenario).then_some(law),
            driven: plan.filter(is_even).map(Box::new),
        }
    }

    /// The sum of the displacements of the blocks at a record of a step and its `F_T`, m.
    fn displacement_m(&self, (step, driving_force_n): (u64, f64)) -> Option<f64> {
        let plan = self.driven.as_ref()?;
        let drive = &plan.drive;
        let point_m = plan.drive_point_m(step, drive.hold_from_step.unwrap_or(u64::MAX));
        let stretch_m = driving_force_n / drive.springs.first()?.stiffness_n_per_m;
        Some(plan.blocks as f64 * point_m - stretch_m)
    }
}

/// Receives a run in its order, and returns its [`Summary`].
///
/// Stores the size of each rupture, the global ruptures, at most one precursor per block, the beginnings of wide ruptures and
/// wide raw events, and, until the first global rupture is known, the times of raw events.
pub struct Summarizer {
    name: String,
    header: RunHeader,
    slider: Slider,
    grid: TimeGrid,
    /// The step of the last record.
    last_step: u64,
    /// Step and `F_T` of the first and of the last record.
    driving_forces_n: Option<[(u64, f64); 2]>,
    energy: Option<Energy>,
    records: u64,
    switches: u64,
    detachments: u64,
    largest_ft_fn: Option<f64>,
    /// Whether the drive pulls both ways, so that `F_T` is a difference with little meaning.
    pulls_both_ways: bool,
    creep: CreepFront,
    raw: RawEvents,
    unloaded: Unloaded,
    growth: RuptureGrowth<Rupture>,
    global: Vec<Rupture>,
    ruptures: u64,
    wide: u64,
    overlapping: u64,
    open: u64,
    largest_slip_m: Option<f64>,
    magnitudes: Magnitudes,
    peak_velocity_m_per_s: Option<f64>,
    /// Sum of the slips of all blocks in all ruptures; none if a block still slid at the end.
    slip_m: Option<f64>,
}

impl Summarizer {
    /// A summarizer for the run of this name.
    pub fn new(name: &str, header: &RunHeader, slider: Slider) -> Summarizer {
        Summarizer {
            name: name.to_owned(),
            header: header.clone(),
            slider,
            grid: header.time_grid(),
            last_step: 0,
            driving_forces_n: None,
            energy: None,
            records: 0,
            switches: 0,
            detachments: 0,
            largest_ft_fn: None,
            pulls_both_ways: false,
            creep: CreepFront::new(header.contacts()),
            raw: RawEvents::new(header.blocks),
            unloaded: Unloaded::default(),
            growth: RuptureGrowth::default(),
            global: Vec::new(),
            ruptures: 0,
            wide: 0,
            overlapping: 0,
            open: 0,
            largest_slip_m: None,
            magnitudes: Magnitudes::default(),
            peak_velocity_m_per_s: None,
            slip_m: Some(0.0),
        }
    }

    /// Adds a step record.
    pub fn step(&mut self, record: &StepRecord) {
        self.last_step = record.step;
        let force_n = (record.step, record.driving_force_n);
        self.driving_forces_n = Some([self.driving_forces_n.map_or(force_n, |[first, _]| first), force_n]);
        self.energy = Some(record.energy);
        self.records += 1;
        self.switches += record.switches.len() as u64;
        self.largest_ft_fn = largest(self.largest_ft_fn, Some(record.load_ratio()));
        self.pulls_both_ways |= record.end_forces_n.is_some();
        self.unloaded.take(record);
        for switch in record.switches.iter().filter(|switch| switch.direction == Direction::Detach) {
            self.detachments += 1;
            self.creep.slides(switch.block, record.step + 1);
        }
    }

    /// Adds a raw slip event.
    pub fn slip_event(&mut self, slip: &SlipEvent) {
        self.peak_velocity_m_per_s = largest(self.peak_velocity_m_per_s, slip.peak_velocity_m_per_s);
        self.raw.take(slip);
    }

    /// Adds a rupture.
    pub fn rupture(&mut self, rupture: &Rupture) {
        self.ruptures += 1;
        self.overlapping += u64::from(rupture.overlapping);
        self.open += u64::from(rupture.open);
        self.largest_slip_m = largest(self.largest_slip_m, rupture.largest_slip_m);
        self.magnitudes.take(rupture);
        let slip_m = rupture.mean_slip_m.map(|mean_m| mean_m * f64::from(rupture.slipped()));
        self.slip_m = self.slip_m.zip(slip_m).map(|(sum_m, slip_m)| sum_m + slip_m);
        let starts = (rupture.onset_step, rupture.rupture);
        self.growth.take(starts, rupture.reach(), || rupture.clone());
        if measures::is_wide(rupture) {
            self.wide += 1;
            self.raw.wide_rupture(rupture);
        }
        if rupture.reached_every_block {
            self.raw.global_rupture(rupture);
            let place = self.global.partition_point(|known| known.onset_step <= rupture.onset_step);
            self.global.insert(place, rupture.clone());
        }
    }

    /// Ends the run, with its status if known. Without ruptures, as of a log of a program without their detector, the
    /// numbers that need them are unknown.
    pub fn finish(self, has_ruptures: bool, end: Option<&RunEnd>) -> Summary {
        let Summarizer { header, slider, grid, growth, global, raw, unloaded, .. } = self;
        let known = |count: u64| has_ruptures.then_some(count);
        let pulls_one_way = !self.pulls_both_ways;
        let ratio = |value: Option<f64>| value.and_then(finite).filter(|_| pulls_one_way);
        let last_step = end.map_or(self.last_step, |end| end.last_step);
        let simulated_s = grid.time_s(last_step);
        let contacts = header.contacts();
        let length_ratio = |rupture: &Rupture| rupture.reach().length_ratio(contacts.columns());
        let scales = header.scales;
        let wave_speed_m_per_s = Some(scales.wave_speed_m_per_s());
        let speed_m_per_s =
            |rupture: &Rupture| measures::front_speed_m_per_s(rupture, contacts, wave_speed_m_per_s);

        let farthest = || growth.iter().map(|(_, rupture)| rupture);
        let precursors: Vec<&Rupture> = farthest().filter(|rupture| !rupture.reached_every_block).collect();
        let global: Vec<&Rupture> = global.iter().collect();
        let growing: Vec<&Rupture> = precursors.iter().chain(&global).copied().collect();
        let first_global = global.first().copied();

        let law = slider.length_law.as_ref();
        let residuals: Vec<(f64, f64)> = law.map_or(Vec::new(), |(law, parameters)| {
            let residual = |rupture: &&Rupture| {
                let lp_l = length_ratio(rupture);
                (lp_l, rupture.ft_fn_onset - law.load_ratio(parameters, lp_l))
            };
            precursors.iter().map(residual).filter(|(_, residual)| residual.is_finite()).collect()
        });
        let line = estimate::line(&residuals);
        let lengths: Vec<f64> = precursors.iter().map(|rupture| length_ratio(rupture)).collect();
        let growths = lengths.windows(2).map(|pair| pair[1] - pair[0]);

        let front = farthest().find(|rupture| measures::is_wide(rupture));
        let creep_front_block = self.creep.before(front.map(|front| front.onset_step));
        let creeps = creep_front_block.is_some_and(|block| {
            block >= WIDE_BLOCKS && f64::from(block) >= CREEP_SHARE * f64::from(contacts.columns())
        });
        let (largest_magnitude, sizes) = self.magnitudes.sizes();
        let wave_s = f64::from(contacts.columns().saturating_sub(1)) * scales.block_time_s;
        let front_speed_m_per_s = median_of(&growing, speed_m_per_s);
        let solver = |name: &str| end.and_then(|end| end.solver.counts.get(name).copied());
        let energy = self.energy.as_ref();
        let stress_pa = |of: &[&Rupture], drop_n: fn(&Rupture) -> Option<f64>| {
            mean_of(of, drop_n).zip(slider.contact_area_m2).map(|(drop_n, area_m2)| drop_n / area_m2)
        };
        let weighted_drop_n = |rupture: &Rupture| rupture.slip_weighted_shear_force_drop_n;
        let moved_m = || {
            let [first_m, last_m] = self.driving_forces_n?.map(|force_n| slider.displacement_m(force_n));
            Some(last_m? - first_m?)
        };
        // A log that was cut or lost records lacks ruptures, whose slip would count as creep.
        let is_all = has_ruptures && end.is_some_and(|end| end.status != RunStatus::Salvaged);
        let slip_m = self.slip_m.filter(|_| is_all);
        let [unloaded_contact_count, unloaded_detachment_count, unloaded_event_count] = unloaded.counts();
        // A log that counts them omits a count of zero.
        let none_in_air = end.is_some().then_some(0);

        Summary {
            run: self.name,
            scenario: header.scenario,
            parameter_set: header.parameter_set,
            status: status(end),
            blocks: header.blocks,
            time_step_s: header.time_step_s,
            simulated_s,
            link_time_s: has_ruptures.then(|| scales.link_s()),
            first_slip_s: raw.first().map(|first| first.onset_s),
            first_slip_ft_fn: ratio(raw.first().map(|first| first.ft_fn)),
            first_global_rupture_onset_s: first_global.map(|first| first.onset_s),
            first_global_rupture_last_block_s: first_global.map(|first| first.arrival_s),
            first_global_rupture_end_s: first_global.and_then(|first| first.end_s),
            first_global_rupture_ft_fn: ratio(first_global.map(|first| first.ft_fn_onset)),
            first_global_rupture_nucleation_block: first_global.map(|first| first.nucleation_block),
            first_global_rupture_front_speed_m_per_s: first_global.and_then(speed_m_per_s),
            first_global_event_onset_s: raw.first_global().map(|first| first.onset_s),
            first_global_event_ft_fn: ratio(raw.first_global().map(|first| first.ft_fn)),
            global_rupture_count: known(global.len() as u64),
            precursor_count: known(precursors.len() as u64),
            longest_precursor_ratio: lengths.last().copied(),
            precursor_growth_ratio: mean(growths),
            length_law: law.map(|(law, _)| law.table_word()),
            length_law_slope_residual: line.map(|[slope, _]| slope.value),
            length_law_intercept_residual: line.map(|[_, intercept]| intercept.value),
            length_law_rms_residual: mean(residuals.iter().map(|(_, residual)| residual * residual))
                .map(f64::sqrt),
            recurrence_transient_s: transient_s(&global),
            recurrence_steady_s: steady_s(&global),
            largest_ft_fn: ratio(self.largest_ft_fn),
            precursor_drop_ft_fn: ratio(mean_of(&precursors, measures::drop_ft_fn)),
            global_rupture_drop_ft_fn: ratio(mean_of(&global, measures::drop_ft_fn)),
            precursor_duration_s: median_of(&precursors, measures::duration_s),
            precursor_crossing_s: median_of(&precursors, |rupture| Some(measures::crossing_s(rupture))),
            global_rupture_duration_s: median_of(&global, measures::duration_s),
            global_rupture_crossing_s: median_of(&global, |rupture| Some(measures::crossing_s(rupture))),
            front_speed_m_per_s,
            precursor_front_speed_m_per_s: median_of(&precursors, speed_m_per_s),
            global_rupture_front_speed_m_per_s: median_of(&global, speed_m_per_s),
            wave_speed_m_per_s,
            front_speed_over_wave_speed_ratio: front_speed_m_per_s
                .zip(wave_speed_m_per_s)
                .and_then(|(front, wave)| finite(front / wave)),
            // With a state the solver chooses its steps.
            front_speed_error_ratio: (front_speed_m_per_s.is_some() && !header.has_state)
                .then(|| scales.front_error(header.time_step_s)),
            precursor_slip_m: mean_of(&precursors, |rupture| rupture.mean_slip_m),
            global_rupture_slip_m: mean_of(&global, |rupture| rupture.mean_slip_m),
            largest_slip_m: self.largest_slip_m,
            peak_velocity_m_per_s: self.peak_velocity_m_per_s,
            precursor_stress_drop_pa: stress_pa(&precursors, |rupture| rupture.mean_shear_force_drop_n),
            precursor_weighted_stress_drop_pa: stress_pa(&precursors, weighted_drop_n),
            global_rupture_stress_drop_pa: stress_pa(&global, |rupture| rupture.mean_shear_force_drop_n),
            global_rupture_weighted_stress_drop_pa: stress_pa(&global, weighted_drop_n),
            precursor_strength_drop_n: mean_of(&precursors, |rupture| rupture.mean_strength_drop_n),
            global_rupture_strength_drop_n: mean_of(&global, |rupture| rupture.mean_strength_drop_n),
            global_rupture_moment_n_m: mean_of(&global, |rupture| rupture.potency_m2)
                .map(|potency_m2| potency_m2 * scales.modulus_n_per_m)
                // Over an area, where the potency is another one.
                .or_else(|| mean_of(&global, |rupture| rupture.moment_n_m)),
            largest_magnitude,
            completeness_magnitude: sizes.as_ref().map(|sizes| sizes.completeness),
            complete_rupture_count: sizes.as_ref().map(|sizes| sizes.count as u64),
            gutenberg_richter_b: sizes.as_ref().and_then(|sizes| Some(sizes.b.ok()?.value)),
            gutenberg_richter_b_error: sizes.as_ref().and_then(|sizes| Some(sizes.b.ok()?.error)),
            // Without commas, as cells of tables are.
            gutenberg_richter_test: sizes.as_ref().map(|sizes| sizes.words().replace(',', ";")),
            radiated_over_released_energy_ratio: self.magnitudes.radiated_ratio(),
            drive_work_j: energy.map(|energy| energy.drive_work_j),
            prestress_work_j: energy.map(|energy| energy.prestress_work_j),
            friction_heat_j: energy.map(|energy| energy.friction_heat_j),
            radiated_j: energy.and_then(|energy| energy.radiated_j),
            anchor_change_j: energy.map(|energy| energy.anchor_change_j),
            viscous_loss_j: energy.map(|energy| energy.viscous_loss_j),
            kinetic_j: energy.map(|energy| energy.kinetic_j),
            elastic_j: energy.map(|energy| energy.elastic_j),
            scheme_work_j: energy.map(|energy| energy.scheme_work_j),
            precursor_heat_j: mean_of(&precursors, |rupture| rupture.friction_heat_j),
            global_rupture_heat_j: mean_of(&global, |rupture| rupture.friction_heat_j),
            creeps: has_ruptures.then_some(creeps),
            creep_front_block: creep_front_block.filter(|_| has_ruptures),
            sliding_time_ratio: raw.sliding_time_ratio(first_global.map(|first| first.onset_s), simulated_s),
            creep_ratio: slip_m.zip(moved_m()).and_then(|(slip_m, moved_m)| finite(1.0 - slip_m / moved_m)),
            raw_events_mislead: has_ruptures.then(|| raw.mislead(wave_s, simulated_s)),
            event_count: raw.count(),
            global_event_count: raw.global_count(),
            longest_event_s: raw.longest_s(simulated_s),
            wide_event_count: raw.wide_count(),
            joined_event_count: known(raw.joined_count()),
            contact_steps_in_air: solver("contact_steps_in_air").or(none_in_air),
            unloaded_contact_count,
            unloaded_detachment_count,
            unloaded_event_count,
            rupture_count: known(self.ruptures),
            wide_rupture_count: known(self.wide),
            overlapping_rupture_count: known(self.overlapping),
            open_rupture_count: known(self.open),
            switch_count: self.switches,
            detachment_count: self.detachments,
            last_step,
            step_record_count: self.records,
            plain_steps: solver("plain_steps"),
            window_steps: solver("window_steps"),
            windows: solver("windows"),
            jump_steps: solver("jump_steps"),
            jumps: solver("jumps"),
        }
    }
}

impl Observer for Summarizer {
    fn record(&mut self, record: &Record) {
        if let Record::Step(record) = record {
            self.step(record);
        }
    }

    /// Ignores events other than raw slip events and ruptures.
    fn event(&mut self, event: &Event) {
        if let Some(slip) = event.get::<SlipEvent>() {
            self.slip_event(slip);
        } else if let Some(rupture) = event.get::<Rupture>() {
            self.rupture(rupture);
        }
    }
}

/// JSON has no numbers that are not finite, such as `F_T / F_N` without a normal load.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn largest(known: Option<f64>, value: Option<f64>) -> Option<f64> {
    let value = value.and_then(finite);
    known.into_iter().chain(value).max_by(f64::total_cmp)
}

fn mean_of(ruptures: &[&Rupture], measure: impl Fn(&Rupture) -> Option<f64>) -> Option<f64> {
    mean(ruptures.iter().filter_map(|rupture| measure(rupture).and_then(finite)))
}

fn median_of(ruptures: &[&Rupture], measure: impl Fn(&Rupture) -> Option<f64>) -> Option<f64> {
    median(ruptures.iter().filter_map(|rupture| measure(rupture).and_then(finite)))
}

fn intervals_s(global: &[&Rupture]) -> Vec<f64> {
    global.windows(2).map(|pair| pair[1].onset_s - pair[0].onset_s).collect()
}

/// Over a quarter of the intervals instead of the first only: another slip of the whole slider may
/// follow one at once.
fn transient_s(global: &[&Rupture]) -> Option<f64> {
    let intervals = intervals_s(global);
    let quarter = intervals.len().div_ceil(4);
    median(intervals.into_iter().take(quarter))
}

fn steady_s(global: &[&Rupture]) -> Option<f64> {
    let intervals = intervals_s(global);
    let half = intervals.len().div_ceil(2);
    if intervals.len() < FEWEST_INTERVALS { None } else { median(intervals.into_iter().skip(half)) }
}
