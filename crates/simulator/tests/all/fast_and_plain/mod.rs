//! Runs, their records, and comparisons of the fast solver with single steps, for any body.

use std::collections::BTreeMap;
use std::ops::Range;

use asperity_model::{Plan, SliderState};
use asperity_record::{Direction, Energy, FieldRecord, Record, StepRecord, Switch, WindowRecord};
use asperity_simulator::{Counters, Plain, SimulationError, Solver, SolverKind};
use asperity_testkit::equality::{self, Agreement, Disagreement};
use asperity_testkit::{Random, plan};

mod amplified;

use amplified::{amplified, horizon};

/// Samples agree within this share of the largest of their kind in the run.
pub(crate) const TOLERANCE: f64 = 1e-9;

/// Tolerance where friction springs a thousand times stiffer or softer than the chain amplify the
/// rounding of the plain stepper itself.
const EXTREME_TOLERANCE: f64 = 1e-6;

/// All records that are left of a run, which must not fail.
pub(crate) fn records(mut solver: Box<dyn Solver>) -> Vec<Record> {
    left_of(&mut *solver)
}

/// As [`records`], of a solver that is needed behind its end.
pub(crate) fn left_of(solver: &mut dyn Solver) -> Vec<Record> {
    std::iter::from_fn(|| solver.next_record().unwrap_or_else(|error| panic!("{error}"))).collect()
}

/// All records of a run, its counters, and the error that stopped it, if any, behind which it does not go on. Where it
/// ends, state and counters are those of its plan.
pub(crate) fn run(plan: &Plan, kind: SolverKind) -> (Vec<Record>, Counters, Option<SimulationError>) {
    let mut solver = kind.start(plan.clone());
    let mut records = Vec::new();
    loop {
        match solver.next_record() {
            Ok(Some(record)) => records.push(record),
            Err(error) => {
                assert!(!solver.is_between_records(), "{error}");
                assert_eq!(solver.next_record(), Err(error.clone()));
                return (records, solver.counters(), Some(error));
            }
            Ok(None) => {
                let counters = solver.counters();
                assert!(solver.snapshot().fits(plan), "{counters}");
                assert!(counters.fit(plan.steps - plan.initial.step), "{counters}");
                return (records, counters, None);
            }
        }
    }
}

pub(crate) fn steps(records: &[Record]) -> Vec<&StepRecord> {
    let steps = records.iter().filter_map(|record| match record {
        Record::Step(step) => Some(step),
        _ => None,
    });
    steps.collect()
}

/// The steps in which a contact switches.
pub(crate) fn switching(records: &[Record]) -> Vec<&StepRecord> {
    steps(records).into_iter().filter(|step| !step.switches.is_empty()).collect()
}

pub(crate) fn fields(records: &[Record]) -> Vec<&FieldRecord> {
    let states = records.iter().filter_map(|record| match record {
        Record::Fields(state) => Some(&**state),
        _ => None,
    });
    states.collect()
}

pub(crate) fn windows(records: &[Record]) -> Vec<&WindowRecord> {
    let windows = records.iter().filter_map(|record| match record {
        Record::Window(window) => Some(window),
        _ => None,
    });
    windows.collect()
}

/// When and where contacts detach.
pub(crate) fn detachments(records: &[Record]) -> impl Iterator<Item = (&StepRecord, &Switch)> {
    let switches = steps(records).into_iter().flat_map(|step| step.switches.iter().map(move |s| (step, s)));
    switches.filter(|(_, switch)| switch.direction == Direction::Detach)
}

/// Which contacts switched which way in the last step of a stepper.
pub(crate) fn switched(plain: &Plain) -> Vec<(u32, Direction)> {
    let direction = |n: usize| match plain.state().slip[n] != 0.0 {
        true => Direction::Detach,
        false => Direction::Attach,
    };
    plain.switched().iter().map(|&n| (n as u32 + 1, direction(n))).collect()
}

/// Step, number sliding, and which contacts switched which way.
pub(crate) type Entry = (u64, u32, Vec<(u32, bool)>);

pub(crate) fn entries(records: &[Record]) -> Vec<Entry> {
    let switches = |step: &StepRecord| {
        step.switches.iter().map(|s| (s.block, s.direction == Direction::Detach)).collect()
    };
    steps(records).into_iter().map(|step| (step.step, step.sliding, switches(step))).collect()
}

/// Asserts that energies keep the balance of the start, within a share of the largest part up to then.
pub(crate) fn assert_balanced(records: &[Record], share: f64, what: &str) {
    let (mut start_j, mut largest_j) = (None, 0.0);
    for (step, energy) in steps(records).into_iter().map(|step| (step.step, step.energy)) {
        largest_j = energy.parts().fold(largest_j, |most: f64, (_, part_j)| most.max(part_j.abs()));
        let off_j = energy.balance_j() - *start_j.get_or_insert(energy.balance_j());
        assert!(off_j.abs() <= share * largest_j, "{what}, step {step}: {off_j} of {largest_j} J");
    }
}

/// The energies in the last step record of a run.
pub(crate) fn last_energy(records: &[Record]) -> Energy {
    steps(records).last().expect("the run has steps").energy
}

/// Compares both solvers, whose energies balance, in a run in which rounding decides nothing.
pub(crate) fn agree(plan: &Plan, what: &str) -> Agreement {
    let mut of_plain = Vec::new();
    let (mut apart_j, mut largest_j) = (0.0, 0.0);
    let each = |plain: &StepRecord, fast: &StepRecord| {
        for ((_, plain_j), (_, fast_j)) in plain.energy.parts().zip(fast.energy.parts()) {
            apart_j = f64::max(apart_j, (plain_j - fast_j).abs());
            largest_j = f64::max(largest_j, plain_j.abs());
        }
        of_plain.push(Record::Step(plain.clone()));
    };
    let agreement = equality::compare(plan, each, |_| {}).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert_eq!(agreement.near_ties, [], "{what}");
    assert_balanced(&of_plain, 1e-12, what);
    assert!(apart_j <= 1e-11 * largest_j, "{what}: energies are {apart_j:e} of {largest_j:e} J apart");
    agreement
}

/// Continues a state with both solvers; returns the steps in which contacts switch, which must be equal,
/// and the counters of the fast solver.
pub(crate) fn from_state(plan: &Plan, state: &SliderState) -> (Vec<Entry>, Counters) {
    let run = |kind: SolverKind| {
        let mut solver = kind.start(plan.clone());
        solver.restore(&state.clone().into());
        let records: Vec<Record> = std::iter::from_fn(|| solver.next_record().ok().flatten()).collect();
        (entries(&records), solver.counters())
    };
    let (fast, counters) = run(SolverKind::Fast);
    let (plain, _) = run(SolverKind::Plain);
    assert_eq!(fast, plain);
    (fast, counters)
}

/// Asserts that a slider vibrating with growing amplitude is quiet at first, until contacts switch at once; the state
/// follows from the amplitude, which counts up to `loudest`. Returns the steps of jumps.
pub(crate) fn vibrations(plan: &Plan, loudest: u32, state: impl Fn(f64) -> SliderState) -> u64 {
    let (mut quiet, mut loud, mut jumped) = (0, 0, 0);
    for amplitude in 1..=loudest {
        let (found, counters) = from_state(plan, &state(f64::from(amplitude)));
        let switched = found.iter().any(|(step, _, switches)| *step < 1000 && !switches.is_empty());
        (quiet, loud) = if switched { (quiet, loud + 1) } else { (quiet + 1, loud) };
        jumped += counters.jump_steps;
    }
    assert!(quiet > 0 && loud > 0, "{quiet} {loud}");
    jumped
}

/// The largest numbers and the largest differences of each kind in two runs.
#[derive(Debug, Default)]
struct Differences {
    kinds: BTreeMap<&'static str, [f64; 2]>,
    /// Largest difference in what is left over of the balance of energies.
    balance_j: f64,
}

impl Differences {
    /// Compares two runs with equal switches record by record, samples included.
    fn of(plain: &[Record], fast: &[Record]) -> Differences {
        let mut found = Differences::default();
        assert_eq!(plain.len(), fast.len());
        for pair in plain.iter().zip(fast) {
            match pair {
                (Record::Step(plain), Record::Step(fast)) => found.in_steps(plain, fast),
                (Record::Fields(plain), Record::Fields(fast)) => found.in_states(plain, fast),
                (Record::Window(plain), Record::Window(fast)) => found.in_windows(plain, fast),
                other => panic!("{other:?}"),
            }
        }
        found
    }

    fn hold(&mut self, kind: &'static str, plain: f64, fast: f64) {
        let [largest, off] = self.kinds.entry(kind).or_default();
        (*largest, *off) = (largest.max(plain.abs()), off.max((plain - fast).abs()));
    }

    fn hold_all(&mut self, kind: &'static str, plain: &[f64], fast: &[f64]) {
        assert_eq!(plain.len(), fast.len(), "{kind}");
        plain.iter().zip(fast).for_each(|(plain, fast)| self.hold(kind, *plain, *fast));
    }

    fn in_steps(&mut self, plain: &StepRecord, fast: &StepRecord) {
        self.hold("driving force", plain.driving_force_n, fast.driving_force_n);
        for (plain, fast) in plain.switches.iter().zip(&fast.switches) {
            self.hold("u of switches", plain.displacement_m, fast.displacement_m);
            self.hold("v of switches", plain.velocity_m_per_s, fast.velocity_m_per_s);
            self.hold("tau of switches", plain.tangential_force_n, fast.tangential_force_n);
            self.hold("anchors of switches", plain.stick_position_m, fast.stick_position_m);
        }
        let [plain, fast] = [plain, fast].map(|step| step.energy);
        for ((_, plain), (_, fast)) in plain.parts().zip(fast.parts()) {
            self.hold("energy", plain, fast);
        }
        self.balance_j = self.balance_j.max((fast.balance_j() - plain.balance_j()).abs());
    }

    fn in_states(&mut self, plain: &FieldRecord, fast: &FieldRecord) {
        assert_eq!((fast.step, &fast.detached), (plain.step, &plain.detached));
        for (kind, plain, fast) in [
            ("u", &plain.displacement_m, &fast.displacement_m),
            ("v", &plain.velocity_m_per_s, &fast.velocity_m_per_s),
            ("tau", &plain.tangential_force_n, &fast.tangential_force_n),
            ("u", &plain.displacement_across_m, &fast.displacement_across_m),
            ("v", &plain.velocity_across_m_per_s, &fast.velocity_across_m_per_s),
            ("tau", &plain.tangential_force_across_n, &fast.tangential_force_across_n),
            ("load", &plain.normal_load_n, &fast.normal_load_n),
        ] {
            self.hold_all(kind, plain, fast);
        }
    }

    fn in_windows(&mut self, plain: &WindowRecord, fast: &WindowRecord) {
        assert_eq!((fast.step, fast.first_block), (plain.step, plain.first_block));
        for (kind, plain, fast) in [
            ("u", &plain.displacement_m, &fast.displacement_m),
            ("v", &plain.velocity_m_per_s, &fast.velocity_m_per_s),
            ("tau", &plain.tangential_force_n, &fast.tangential_force_n),
        ] {
            self.hold_all(kind, plain, fast);
        }
    }

    fn assert_within(&self, tolerance: f64, what: &str) {
        for (kind, [largest, off]) in &self.kinds {
            // The comparison is false for what is no number.
            assert!(*off <= tolerance * largest, "{what}: {kind} differs by {off}, at most {largest}");
        }
    }
}

/// Samples inside windows and jumps, states and energies, equal those of single steps. Returns the fast solver's
/// counters.
pub(crate) fn samples_agree(plan: &Plan, what: &str) -> Counters {
    let (fast, counters, _) = run(plan, SolverKind::Fast);
    let (plain, ..) = run(plan, SolverKind::Plain);
    assert_eq!(entries(&fast), entries(&plain), "{what}");
    assert_balanced(&plain, 1e-11, what);
    let found = Differences::of(&plain, &fast);
    found.assert_within(TOLERANCE, what);
    assert!(found.balance_j <= 1e-11 * found.kinds["energy"][0], "{what}: {found:?}");
    counters
}

/// What the comparison of two runs of a plan found.
pub(crate) struct Comparison {
    /// Of the fast solver.
    pub(crate) counters: Counters,
    /// The records of the fast solver, all of them.
    pub(crate) fast: Vec<Record>,
    /// Both runs were stopped, because the time step does more than 30 % of the work put in.
    pub(crate) is_stopped: bool,
    /// Steps of near ties, which are proved.
    pub(crate) ties: Vec<u64>,
    /// The last step up to which all switches are equal, in a chaotic slider.
    pub(crate) parted_at: Option<u64>,
    /// Switches are equal, with rounding amplified along the run as by the plain stepper itself.
    pub(crate) is_amplified: bool,
}

impl Comparison {
    /// Both solvers did the whole run alike.
    pub(crate) fn is_whole(&self) -> bool {
        !self.is_stopped && self.ties.is_empty() && self.parted_at.is_none()
    }
}

/// Compares the two runs of one plan by [`equality::compare`], which accepts differences only by rounding, and, if it
/// has cadences, record by record. A run may diverge only if its slider is chaotic, and no earlier than one with changed
/// velocities.
pub(crate) fn compare(name: &str, plan: &Plan, tolerance: f64) -> Comparison {
    let (fast, counters, error) = run(plan, SolverKind::Fast);
    assert_balanced(&fast, 1e-9, name);
    let mut found = Comparison {
        counters,
        fast,
        is_stopped: error.is_some(),
        ties: Vec::new(),
        parted_at: None,
        is_amplified: false,
    };
    if let Some(error) = error {
        let (plain, _, of_plain) = run(plan, SolverKind::Plain);
        assert_eq!(entries(&found.fast), entries(&plain), "{name}: {error}");
        let [at, of_plain] = [Some(error), of_plain].map(|error| match error {
            Some(SimulationError::Energy { step, .. }) => step,
            other => panic!("{name}: {other:?}"),
        });
        assert_eq!(at, of_plain, "{name}");
        return found;
    }
    assert_eq!(counters.steps(), plan.steps - plan.initial.step, "{name}");
    let agreement = equality::compare(plan, |_, _| {}, |_| {});
    if let Ok(agreement) = &agreement {
        found.ties = agreement.near_ties.iter().map(|tie| tie.step).collect();
        let is_whole = agreement.switches == counters.switches;
        assert!(is_whole || !found.ties.is_empty(), "{name}: {counters:?}");
        let is_sampled = plan.recording.sample_every_steps + plan.recording.fields_every_steps > 0;
        if !is_sampled || !found.ties.is_empty() {
            return found;
        }
    }
    let (plain, plain_counters, _) = run(plan, SolverKind::Plain);
    assert_balanced(&plain, 1e-9, name);
    let (mut last, mut last_of_numbers) = (plan.steps, plan.steps);
    if entries(&found.fast) == entries(&plain) {
        assert_eq!(counters.switches, plain_counters.switches, "{name}");
        match agreement {
            Ok(_) => {}
            Err(Disagreement::Numbers { deviation, what }) => {
                let by_rounding = amplified(plan, &plain);
                assert!(
                    deviation < 4.0 * by_rounding,
                    "{name}: {what} by {deviation}, and {by_rounding} by rounding alone"
                );
                found.is_amplified = true;
            }
            Err(error) => panic!("{name}: {error}"),
        }
    } else {
        last = horizon(plan, &plain);
        assert!(last < plan.steps, "{name}: {agreement:?}, and the slider is not chaotic");
        // Near its horizon a chaotic run has lost its digits; half-way there, half of them.
        last_of_numbers = last / 2;
        found.parted_at = Some(last);
    }
    let until = |records: &[Record], last: u64| -> Vec<Record> {
        records.iter().filter(|record| record.step() <= last).cloned().collect()
    };
    assert_eq!(entries(&until(&found.fast, last)), entries(&until(&plain, last)), "{name}: to step {last}");
    let [plain, fast] = [&plain, &found.fast].map(|records| until(records, last_of_numbers));
    Differences::of(&plain, &fast).assert_within(tolerance, name);
    found
}

/// What many comparisons found.
#[derive(Debug, Default)]
pub(crate) struct Compared {
    /// Of the fast solver, in all runs that were not stopped.
    pub(crate) total: Counters,
    /// Runs that were stopped.
    pub(crate) stopped: Vec<u64>,
    /// Near ties with their steps.
    pub(crate) ties: Vec<(u64, u64)>,
    /// Runs in which rounding decides and the decision is permanent, with the steps.
    pub(crate) parted: Vec<(u64, u64)>,
    /// Runs in which rounding is amplified.
    pub(crate) amplified: Vec<u64>,
}

/// Compares both solvers in random runs, a scenario with overrides for each seed. Per run they must have at least so
/// many switches, steps in windows, and steps in jumps: the comparison means something only if the shortcuts were used
/// between many switches.
pub(crate) fn compare_random(
    seeds: Range<u64>,
    make: impl Fn(u64) -> (&'static str, Vec<String>),
    [switches, window_steps, jump_steps]: [u64; 3],
    mut each: impl FnMut(&[String], &Comparison),
) -> Compared {
    let (mut compared, count) = (Compared::default(), seeds.end - seeds.start);
    for seed in seeds {
        let (scenario, sets) = make(seed);
        let found = compare(&format!("seed {seed} {sets:?}"), &plan(scenario, &sets), EXTREME_TOLERANCE);
        each(&sets, &found);
        if found.is_stopped {
            compared.stopped.push(seed);
            continue;
        }
        compared.total = compared.total + found.counters;
        compared.ties.extend(found.ties.iter().map(|step| (seed, *step)));
        compared.parted.extend(found.parted_at.map(|step| (seed, step)));
        if found.is_amplified {
            compared.amplified.push(seed);
        }
    }
    let total = &compared.total;
    assert!(
        total.switches > switches * count
            && total.window_steps >= window_steps * count
            && total.jump_steps > jump_steps * count,
        "{compared:?}"
    );
    compared
}

/// What a random chain has besides its sets.
pub(crate) struct SomeChain {
    pub(crate) radiation_kg_per_s: f64,
    pub(crate) mu_s: f64,
    pub(crate) step_s: f64,
    ratio: f64,
}

impl SomeChain {
    /// Steps of its run.
    const STEPS: f64 = 100_000.0;

    /// Friction springs, with the one-way rule or the two-way one.
    pub(crate) fn springs(&self, rule: usize) -> [String; 2] {
        [
            format!("friction.interfacial_stiffness_ratio={}", self.ratio),
            format!("friction.reattach={}", ["one-way", "two-way"][rule]),
        ]
    }

    /// A load that falls.
    pub(crate) fn schedule(&self) -> [String; 2] {
        let times_s = [0.3, 0.8].map(|share| share * SomeChain::STEPS * self.step_s);
        [format!("normal_load.schedule_s={times_s:?}"), "normal_load.schedule_n=[400, 250]".to_owned()]
    }
}

/// A random chain within the stability of the scheme, driven so that it slips a few times. Its relative damping and
/// radiation, the latter in `sqrt(k m)`, are drawn by a function; its ends damp it by so many `sqrt(k m)`.
pub(crate) fn some_chain(
    noise: &mut Random,
    dampers: impl Fn(&mut Random) -> [f64; 2],
    at_ends: f64,
) -> (Vec<String>, SomeChain) {
    let blocks: u32 = noise.pick(&[2, 3, 5, 8, 13, 24, 40]);
    let mass_kg = noise.log_uniform(1e-2, 3.0);
    let (k, m) = (2.5e9 * f64::from(blocks - 1) * 1e-4 / 0.1, mass_kg / f64::from(blocks));
    let [eta, alpha] = dampers(noise);
    let ratio = noise.log_uniform(0.1, 10.0);
    let drive_n_per_m = noise.log_uniform(1e5, 1e8);
    let omega2 = (4.0 * k + ratio * k + drive_n_per_m) / m;
    let gamma = (4.0 * eta + alpha + at_ends) * (k / m).sqrt();
    let step_s = ((gamma * gamma + 4.0 * omega2).sqrt() - gamma) / omega2 * noise.log_uniform(0.01, 0.3);
    let step_s = format!("{step_s:.2e}").parse::<f64>().unwrap();
    let duration_s = step_s * SomeChain::STEPS;
    let mu_s = noise.uniform(0.2, 1.2);
    let reach_m = 400.0 * mu_s * (1.0 / drive_n_per_m + 1.0 / k) * noise.uniform(1.0, 4.0);
    let sets = vec![
        format!("slider.blocks={blocks}"),
        format!("slider.mass_kg={mass_kg}"),
        format!("slider.relative_damping={eta:?}"),
        format!("friction.static_coefficient={mu_s}"),
        format!("friction.dynamic_coefficient={}", mu_s * noise.uniform(0.2, 0.9)),
        format!("drive.kind={}", noise.pick(&["side", "top"])),
        format!("drive.stiffness_n_per_m={drive_n_per_m}"),
        format!("drive.velocity_m_per_s={}", reach_m / duration_s),
        format!("normal_load.tilt={}", noise.pick(&[0.0, 0.5])),
        format!("prestress.ratio={}", noise.pick(&[0.0, 0.2 * mu_s])),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={duration_s}"),
        format!("recording.sample_s={}", step_s * 997.0),
        format!("recording.fields_s={}", step_s * 20_000.0),
    ];
    (sets, SomeChain { radiation_kg_per_s: alpha * (k * m).sqrt(), mu_s, step_s, ratio })
}

/// Recording of any density changes neither switches, to the bit, nor counters; returns these.
pub(crate) fn recording_changes_nothing(kind: SolverKind, plan: &Plan, what: &str) -> Counters {
    let run = |sample_every_steps: u64, fields_every_steps: u64, more: bool| {
        let mut plan = plan.clone();
        plan.recording.sample_every_steps = sample_every_steps;
        plan.recording.fields_every_steps = fields_every_steps;
        if !more {
            plan.recording.event_fields = false;
            plan.recording.windows.clear();
        }
        let (records, counters, _) = run(&plan, kind);
        // Debug output distinguishes finite doubles to the bit.
        (format!("{:?}", switching(&records)), counters)
    };
    let (switches, counters) = run(0, 0, false);
    let dense = (plan.steps / 30_000).max(13);
    for (sample, fields, more) in [(dense, 20 * dense, true), (997, 0, true), (9973, 0, false)] {
        let with = run(sample, fields, more);
        assert!(with.0 == switches, "{what}, sampled every {sample} steps");
        assert_eq!(with.1, counters, "{what}, sampled every {sample} steps");
    }
    counters
}

/// A run that is saved in about so many places, as text, and resumed continues to the bit and ends in the same state;
/// returns how often it was resumed, how often inside a jump, and in how many
/// records contacts detach.
pub(crate) fn resumes_to_the_bit(plan: &Plan, kind: SolverKind, places: usize, what: &str) -> [usize; 3] {
    let mut solver = kind.start(plan.clone());
    let (mut all, mut saved) = (Vec::new(), Vec::new());
    while let Some(record) = solver.next_record().expect("it goes on") {
        // Debug output distinguishes finite doubles to the bit.
        all.push((record.step(), format!("{record:?}")));
        if solver.is_between_records() {
            saved.push((all.len(), solver.snapshot()));
        }
    }
    let end = solver.snapshot();
    let every = saved.len().div_ceil(places);
    let (mut times, mut inside) = (0, 0);
    for (count, snapshot) in saved.iter().skip(every / 2).step_by(every) {
        let what = format!("{what}, behind record {count} of {}", all.len());
        assert!(snapshot.fits(plan), "{what}");
        let text = serde_json::to_string(snapshot).expect("it can be written");
        let mut again = kind.start(plan.clone());
        again.restore(&serde_json::from_str(&text).expect("it can be read"));
        // The state inside a jump is that of its start: later records are yielded again.
        let from = again.step();
        let first = all[..*count].partition_point(|(step, _)| *step <= from);
        let mut left = all[first..].iter();
        while let Some(record) = again.next_record().expect("it goes on") {
            let expected = left.next().map(|(_, text)| &**text);
            assert_eq!(expected, Some(&*format!("{record:?}")), "{what}");
        }
        assert_eq!(left.next(), None, "{what}");
        assert!(again.snapshot() == end, "{what}: the end");
        (times, inside) = (times + 1, inside + usize::from(first < *count));
    }
    [times, inside, all.iter().filter(|(_, text)| text.contains("Detach")).count()]
}
