//! Comparisons of the fast solver with single steps, for any lattice.

use asperity_model::Plan;
use asperity_record::{Direction, Record, StepRecord};
use asperity_simulator::equality::{self, Disagreement};
use asperity_simulator::{Counters, SimulationError, SliderState, SolverKind};

mod amplified;

use amplified::amplified;

/// All records of a run, its counters, and the error that stopped it, if any.
pub(crate) fn run(plan: &Plan, kind: SolverKind) -> (Vec<Record>, Counters, Option<SimulationError>) {
    let mut solver = kind.start(plan.clone());
    let mut records = Vec::new();
    loop {
        match solver.next_record() {
            Ok(Some(record)) => records.push(record),
            ended => return (records, solver.counters(), ended.err()),
        }
    }
}

/// Step, number sliding, and which contacts switched which way.
pub(crate) type Entry = (u64, u32, Vec<(u32, bool)>);

pub(crate) fn entries(records: &[Record]) -> Vec<Entry> {
    let steps = records.iter().filter_map(|record| match record {
        Record::Step(step) => Some(step),
        _ => None,
    });
    let switches = |step: &StepRecord| {
        step.switches.iter().map(|s| (s.block, s.direction == Direction::Detach)).collect()
    };
    steps.map(|step| (step.step, step.sliding, switches(step))).collect()
}

/// All numbers of steps in which a contact switches, to the bit.
fn switches(records: &[Record]) -> Vec<String> {
    let steps = records.iter().filter_map(|record| match record {
        Record::Step(step) if !step.switches.is_empty() => Some(format!("{step:?}")),
        _ => None,
    });
    steps.collect()
}

/// Recording of any density changes neither switches, to the bit, nor counters; returns these.
pub(crate) fn recording_changes_nothing(plan: impl Fn(&[&str]) -> Plan) -> Counters {
    let (none, counters, _) = run(&plan(&["recording.sample_s=0"]), SolverKind::Fast);
    for sets in [
        &["recording.sample_s=1e-3"][..],
        &["recording.sample_s=1.3e-4", "recording.fields_s=2e-3"],
        &["recording.sample_s=0.1", "recording.event_fields=false"],
    ] {
        let (some, with, _) = run(&plan(sets), SolverKind::Fast);
        assert_eq!(switches(&some), switches(&none), "{sets:?}");
        assert_eq!(with, counters, "{sets:?}");
    }
    counters
}

/// Samples inside jumps, states and energies, equal those of single steps.
pub(crate) fn samples_agree(plan: &Plan, least_jump_steps: u64) {
    let (fast, counters, _) = run(plan, SolverKind::Fast);
    let (plain, ..) = run(plan, SolverKind::Plain);
    assert!(counters.jump_steps > least_jump_steps, "{counters:?}");
    assert_eq!(entries(&fast), entries(&plain));
    let mut most = [[0.0_f64; 2]; 6];
    let mut hold = |kind: usize, plain: f64, fast: f64| {
        most[kind] = [most[kind][0].max(plain.abs()), most[kind][1].max((plain - fast).abs())];
    };
    let mut worst_j = 0.0_f64;
    for (fast, plain) in fast.iter().zip(&plain) {
        match (fast, plain) {
            (Record::Step(fast), Record::Step(plain)) => {
                hold(0, plain.driving_force_n, fast.driving_force_n);
                let (fast, plain) =
                    (fast.energy.expect("it has energies"), plain.energy.expect("it has energies"));
                for ((_, plain), (_, fast)) in plain.parts().zip(fast.parts()) {
                    hold(1, plain, fast);
                }
                worst_j = worst_j.max((fast.balance_j() - plain.balance_j()).abs());
            }
            (Record::Fields(fast), Record::Fields(plain)) => {
                assert_eq!((fast.step, &fast.detached), (plain.step, &plain.detached));
                for (kind, fast, plain) in [
                    (2, &fast.displacement_m, &plain.displacement_m),
                    (3, &fast.velocity_m_per_s, &plain.velocity_m_per_s),
                    (4, &fast.tangential_force_n, &plain.tangential_force_n),
                    (2, &fast.displacement_across_m, &plain.displacement_across_m),
                    (3, &fast.velocity_across_m_per_s, &plain.velocity_across_m_per_s),
                    (4, &fast.tangential_force_across_n, &plain.tangential_force_across_n),
                    (5, &fast.normal_load_n, &plain.normal_load_n),
                ] {
                    for (fast, plain) in fast.iter().zip(plain) {
                        hold(kind, *plain, *fast);
                    }
                }
            }
            _ => panic!("{fast:?} and {plain:?}"),
        }
    }
    for (kind, [largest, off]) in most.into_iter().enumerate() {
        assert!(off <= 1e-9 * largest, "kind {kind}: {off} of {largest}");
    }
    assert!(worst_j <= 1e-11 * most[1][0], "{worst_j} of {}", most[1][0]);
}

/// A run that is resumed behind each `every`-th record continues to the bit; returns how often it was resumed
/// inside a jump.
pub(crate) fn resumes_to_the_bit(plan: &Plan, every: usize) -> u32 {
    let (whole, ..) = run(plan, SolverKind::Fast);
    let mut solver = SolverKind::Fast.start(plan.clone());
    let (mut count, mut inside) = (0, 0);
    while let Some(record) = solver.next_record().expect("it goes on") {
        count += 1;
        let step = match &record {
            Record::Step(step) => step.step,
            _ => continue,
        };
        if !solver.is_between_records() || count % every != 0 {
            continue;
        }
        let state = solver.snapshot();
        inside += u32::from(state.slider.step < step);
        let mut again = SolverKind::Fast.start(plan.clone());
        again.restore(&state);
        // The state inside a jump is that of its start: later records are yielded again.
        let coming = std::iter::from_fn(|| again.next_record().expect("it goes on"));
        let coming: Vec<Record> = coming.filter(|record| record_step(record) > step).collect();
        let left: Vec<&Record> = whole[count..].iter().filter(|record| record_step(record) > step).collect();
        assert_eq!(coming.len(), left.len(), "behind step {step}");
        for (coming, left) in coming.iter().zip(left) {
            assert_eq!(format!("{coming:?}"), format!("{left:?}"), "behind step {step}");
        }
    }
    inside
}

fn record_step(record: &Record) -> u64 {
    match record {
        Record::Step(step) => step.step,
        Record::Fields(state) => state.step,
        Record::Window(state) => state.step,
    }
}

/// Continues a state with both solvers; returns the steps in which contacts switch, which must be equal,
/// and the counters of the fast solver.
pub(crate) fn from_state(plan: &Plan, state: &SliderState) -> (Vec<Entry>, Counters) {
    let run = |kind: SolverKind| {
        let mut solver = kind.start(plan.clone());
        solver.restore(&state.clone().into());
        let records = std::iter::from_fn(|| solver.next_record().ok().flatten());
        let records: Vec<Record> = records.collect();
        (entries(&records), solver.counters())
    };
    let (fast, counters) = run(SolverKind::Fast);
    let (plain, _) = run(SolverKind::Plain);
    assert_eq!(fast, plain);
    (fast, counters)
}

/// What many comparisons found.
#[derive(Debug, Default)]
pub(crate) struct Compared {
    /// Of the fast solver.
    pub(crate) total: Counters,
    /// Runs stopped because the time step does more than 30 % of the work put in.
    pub(crate) stopped: Vec<u64>,
    /// Near ties, which are proved, with their steps.
    pub(crate) ties: Vec<(u64, u64)>,
    /// Runs in which rounding decides and the decision is permanent, with the steps.
    pub(crate) parted: Vec<(u64, u64)>,
}

impl Compared {
    /// Compares both solvers switch by switch.
    pub(crate) fn add(&mut self, seed: u64, set: &[String], plan: &Plan, may_part: bool) {
        let (records, counters, error) = run(plan, SolverKind::Fast);
        self.total = self.total + counters;
        if error.is_some() {
            // As single steps find too.
            let (plain, _, of_plain) = run(plan, SolverKind::Plain);
            assert_eq!(entries(&records), entries(&plain), "seed {seed} {set:?}");
            assert!(matches!(of_plain, Some(SimulationError::Energy { .. })), "{error:?} {of_plain:?}");
            self.stopped.push(seed);
            return;
        }
        match equality::compare(plan, |_, _| {}, |_| {}) {
            Ok(agreement) => {
                self.ties.extend(agreement.near_ties.iter().map(|tie| (seed, tie.step)));
                let is_whole = agreement.switches == counters.switches;
                assert!(is_whole || !agreement.near_ties.is_empty(), "seed {seed} {set:?}");
            }
            Err(Disagreement::Missed { step, .. }) if may_part => self.parted.push((seed, step)),
            // Equal switches, with rounding amplified along the run as by the plain stepper itself.
            Err(Disagreement::Numbers { deviation, what }) if may_part => {
                let (plain, ..) = run(plan, SolverKind::Plain);
                let by_rounding = amplified(plan, &plain);
                assert_eq!(entries(&records), entries(&plain), "seed {seed} {set:?}");
                assert!(
                    deviation < 4.0 * by_rounding,
                    "seed {seed} {set:?}: {what} {deviation} {by_rounding}"
                );
                self.parted.push((seed, plan.steps));
            }
            Err(error) => panic!("seed {seed} {set:?}: {error}"),
        }
    }
}
