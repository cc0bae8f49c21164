//! Energies: their balance, and that both solvers tell the same.

use std::sync::Arc;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{Energy, Record, StepRecord};
use asperity_simulator::{Fast, Plain, Solver};

fn plan(text: &str) -> Arc<Plan> {
    let source = ScenarioSource::new("test", text);
    Arc::new(Plan::new(&Scenario::resolve(&source).unwrap()))
}

fn steps(mut solver: impl Solver) -> Vec<StepRecord> {
    let mut steps = Vec::new();
    while let Some(record) = solver.next_record().unwrap() {
        if let Record::Step(step) = record {
            steps.push(step);
        }
    }
    steps
}

fn parts(energy: &Energy) -> [(&'static str, f64); 8] {
    [
        ("drive work", energy.drive_work_j),
        ("prestress work", energy.prestress_work_j),
        ("friction heat", energy.friction_heat_j),
        ("anchor change", energy.anchor_change_j),
        ("viscous loss", energy.viscous_loss_j),
        ("kinetic", energy.kinetic_j),
        ("elastic", energy.elastic_j),
        ("scheme work", energy.scheme_work_j),
    ]
}

/// Scenarios of every kind.
fn scenarios() -> Vec<(&'static str, String)> {
    let quick = "time.step_s = 1e-7\ndrive.velocity_m_per_s = 0.01\ntime.duration_s = 0.03\nrecording.sample_s = 1e-4\n";
    let of = |more: &str| format!("{quick}{more}");
    vec![
        ("as coded", of("")),
        ("as stated", of("parameter_set = \"as-stated\"")),
    ]
}

#[test]
fn both_solvers_tell_the_same_energies() {
    for (name, text) in scenarios() {
        let plan = plan(&text);
        let (plain, fast) = (steps(Plain::new(Arc::clone(&plan))), steps(Fast::new(Arc::clone(&plan))));
        assert_eq!(plain.len(), fast.len(), "{name}");
        let last = plain.last().unwrap().energy.unwrap();
        println!("{name}: {} records {last:?}", plain.len());
        println!("{name}: {} records {:?}", plain.len(), fast.last().unwrap().energy.unwrap());
        let mut worst = [0.0f64; 8];
        for (plain, fast) in plain.iter().zip(&fast) {
            assert_eq!((plain.step, plain.switches.len()), (fast.step, fast.switches.len()), "{name}");
            let (plain, fast) = (parts(&plain.energy.unwrap()), parts(&fast.energy.unwrap()));
            for n in 0..8 {
                worst[n] = worst[n].max((plain[n].1 - fast[n].1).abs() / last.drive_work_j);
            }
        }
        println!("{worst:?}");
        for (worst, (what, _)) in worst.into_iter().zip(parts(&last)) {
            assert!(worst < 1e-9, "{name}, {what}: {worst:e}");
        }
    }
}
