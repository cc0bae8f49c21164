//! `recording.energies = "none"`: the same run, told without energies.

use asperity_model::Plan;
use asperity_record::{Direction, Record, StepRecord};
use asperity_simulator::{Ledger, SimulationError, SolverKind};
use asperity_testkit::{SMALL_SLAB, plan};

const NONE: &str = "recording.energies=none";

/// Ten blocks that soon slip.
const TEN: [&str; 3] = ["time.duration_s=0.05", "time.step_s=1e-7", "drive.velocity_m_per_s=0.05"];

/// How far numbers of the fast solver may be from those with energies, over the largest of their kind:
/// what it spends on energies decides how it cuts up the steps, and so how they round.
const TOLERANCE: f64 = 1e-9;

/// A scenario, what is set, and whether the fast solver gives the same bits.
fn scenarios() -> Vec<(&'static str, Vec<&'static str>, bool)> {
    let quick = [
        "time.step_s=1e-7",
        "time.duration_s=0.03",
        "drive.velocity_m_per_s=0.05",
        "recording.sample_s=1e-4",
    ];
    let chain = |more: &[&'static str]| [&quick[..], more].concat();
    let long = ["slider.blocks=600", "time.duration_s=0.01", "time.step_s=5e-8"];
    vec![
        ("default", chain(&[]), true),
        // It rings, and so takes windows all the time.
        ("default", chain(&["parameter_set=as-stated"]), false),
        ("top-driven", chain(&[]), true),
        ("top-driven", chain(&["parameter_set=as-stated"]), true),
        ("default", chain(&long), false),
        ("default", chain(&[&long[..], &["parameter_set=as-stated"]].concat()), false),
        ("slab", SMALL_SLAB.to_vec(), true),
    ]
}

/// The records of a run, and how it ended.
fn records(plan: &Plan, solver: SolverKind) -> (Vec<Record>, Option<SimulationError>) {
    let mut solver = solver.start(plan.clone());
    let mut records = Vec::new();
    let error = loop {
        match solver.next_record() {
            Ok(Some(record)) => records.push(record),
            ended => break ended.err(),
        }
    };
    assert_eq!(solver.snapshot().energy.is_some(), plan.recording.energies);
    (records, error)
}

/// All that a record says but for energies: what must be the same to the bit, and numbers, by kind.
fn parts(record: &Record) -> (Vec<u64>, Vec<(&'static str, f64)>) {
    let (mut exact, mut numbers) = (vec![record.step()], Vec::new());
    let mut all =
        |kind, values: &[f64]| numbers.extend(values.iter().map(|value| (kind, *value)).collect::<Vec<_>>());
    match record {
        Record::Step(step) => {
            exact.extend([step.normal_load_n.to_bits(), step.sliding.into(), step.switches.len() as u64]);
            all("load", &[step.driving_force_n]);
            all("load", &step.end_forces_n.unwrap_or_default());
            for switch in &step.switches {
                exact.extend([switch.block.into(), u64::from(switch.direction == Direction::Detach)]);
                all("u", &[switch.displacement_m, switch.stick_position_m]);
                all("v", &[switch.velocity_m_per_s]);
                all("force", &[switch.tangential_force_n, switch.threshold_n]);
            }
        }
        Record::Fields(fields) => {
            exact.extend(fields.detached.iter().map(|detached| u64::from(*detached)));
            all("u", &fields.displacement_m);
            all("u", &fields.stick_position_m);
            all("v", &fields.velocity_m_per_s);
            all("force", &fields.tangential_force_n);
            all("force", &fields.normal_load_n);
        }
        Record::Window(window) => {
            all("u", &window.displacement_m);
            all("v", &window.velocity_m_per_s);
        }
    }
    (exact, numbers)
}

#[test]
fn switches_and_states_are_those_of_the_run_with_energies() {
    for (name, sets, is_exact) in scenarios() {
        let with = plan(name, &sets);
        let without = plan(name, &[&sets[..], &[NONE]].concat());
        for solver in [SolverKind::Plain, SolverKind::Fast] {
            let (of_with, _) = records(&with, solver);
            let (of_without, _) = records(&without, solver);
            let name = format!("{name} {sets:?} {}", solver.name());
            assert_eq!(of_with.len(), of_without.len(), "{name}");
            let (mut switches, mut largest) = (0, std::collections::BTreeMap::<&str, f64>::new());
            let pairs = || of_with.iter().zip(&of_without);
            for (kind, value) in of_with.iter().flat_map(|record| parts(record).1) {
                let most = largest.entry(kind).or_default();
                *most = most.max(value.abs());
            }
            for (with, without) in pairs() {
                if let (Record::Step(with), Record::Step(without)) = (with, without) {
                    assert!(with.energy.is_some() && without.energy.is_none(), "{name}");
                    switches += with.switches.len();
                }
                let ((exact, numbers), (of_without, others)) = (parts(with), parts(without));
                assert_eq!(exact, of_without, "{name}");
                for ((kind, a), (_, b)) in numbers.into_iter().zip(others) {
                    let most = if is_exact || solver == SolverKind::Plain { 0.0 } else { TOLERANCE };
                    let off = (a - b).abs() <= most * largest[kind];
                    assert!(off, "{name}, step {}: {kind} {a} and {b}", with.step());
                }
            }
            assert!(switches > 20, "{name}: {switches} switches");
        }
    }
}

#[test]
fn a_checkpoint_has_energies_if_and_only_if_the_scenario_asks_for_them() {
    for (name, sets) in [("ten-blocks", TEN.to_vec()), ("slab", SMALL_SLAB.to_vec())] {
        for (more, forged) in [(&[NONE][..], Some(Ledger::default())), (&[], None)] {
            let plan = plan(name, &[&sets[..], more].concat());
            for solver in [SolverKind::Plain, SolverKind::Fast] {
                let mut solver = solver.start(plan.clone());
                while solver.next_record().unwrap_or_else(|error| panic!("{error}")).is_some() {}
                let mut state = solver.snapshot();
                assert!(state.fits(&plan), "{name}");
                state.energy = forged;
                assert!(!state.fits(&plan), "{name}");
            }
        }
    }
}

/// There is nothing to judge the time step by; numbers that overflow end a run as ever.
#[test]
fn a_run_without_energies_is_stopped_by_numbers_alone() {
    let long = ["slider.blocks=24", "time.step_s=2.5e-6"];
    let ended = |more: &[&str]| {
        let plan = plan("rigid-contacts", &[&long[..], more].concat());
        let (records, error) = records(&plan, SolverKind::Fast);
        let last = records.iter().rev().find_map(|record| match record {
            Record::Step(StepRecord { step, .. }) => Some(*step),
            _ => None,
        });
        (last == Some(plan.steps), error)
    };
    let (is_whole, error) = ended(&[]);
    assert!(!is_whole && matches!(error, Some(SimulationError::Energy { .. })), "{error:?}");
    assert_eq!(ended(&[NONE]), (true, None));

    for solver in [SolverKind::Plain, SolverKind::Fast] {
        let mut without = plan("ten-blocks", &["time.duration_s=0.01", "time.step_s=1e-7", NONE]);
        without.initial.velocity_m_per_s[3] = 1e307;
        let (_, error) = records(&without, solver);
        assert!(matches!(error, Some(SimulationError::NotFinite { .. })), "{error:?}");
    }
}
