//! Energies: their balance, and the agreement of both solvers on them.

use asperity_model::Plan;
use asperity_simulator::SolverKind;

use crate::fast_and_plain::{run, steps};

/// Scenarios of every kind, with a hundred thousand steps or more and a hundred times the drive
/// velocity.
fn scenarios() -> Vec<(&'static str, Vec<&'static str>)> {
    vec![
        ("default", vec![]),
        ("default", vec!["parameter_set=as-stated"]),
        ("default", vec!["parameter_set=as-stated", "time.step_s=4e-7"]),
        ("default", vec!["friction.reattach=two-way", "parameter_set=as-stated"]),
        ("default", vec!["slider.relative_damping=0"]),
        ("default", vec!["initial_shear.beta=0.3", "normal_load.tilt=-0.8"]),
        ("default", vec!["prestress.ratio=0.25", "normal_load.tilt=0.5"]),
        ("default", vec!["prestress.ratio=0.3", "drive.kind=left-right", "friction.reattach=two-way"]),
        ("default", vec!["drive.hold_from_s=0.011"]),
        ("default", vec!["drive.velocity_m_per_s=0", "initial_velocity.amplitude_m_per_s=0.01"]),
        ("default", vec!["slider.blocks=600", "time.duration_s=0.01", "recording.sample_s=1e-3"]),
        ("ten-blocks", vec![]),
        ("rigid-contacts", vec![]),
        ("rigid-contacts", vec!["friction.drag_at_rest=true"]),
        ("velocity-weakening", vec![]),
        ("velocity-weakening", vec!["friction.drag_at_rest=true"]),
        ("scattered-friction", vec![]),
        ("ageing-contacts", vec![]),
        ("top-driven", vec![]),
        ("left-right-driven", vec![]),
        ("default", vec!["normal_load.schedule_s=[0.005, 0.02]", "normal_load.schedule_n=[400, 300]"]),
        (
            "unloading-desired-load",
            vec!["drive.until_load_ratio=0.2", "normal_load.schedule_s=[0, 0.02]", "time.duration_s=0.03"],
        ),
        (
            "top-driven",
            vec![
                "drive.hold_from_s=0.02",
                "normal_load.schedule_s=[0.02, 0.03]",
                "normal_load.schedule_n=[400, 100]",
            ],
        ),
    ]
}

fn plan(name: &str, sets: &[&str]) -> Plan {
    let quick = [
        "time.step_s=1e-7",
        "time.duration_s=0.03",
        "drive.velocity_m_per_s=0.05",
        "recording.sample_s=1e-4",
        "recording.fields_s=0",
    ];
    asperity_testkit::plan(name, &[&quick[..], sets].concat())
}

#[test]
fn both_solvers_tell_the_same_energies_and_the_plain_ones_balance() {
    for (name, sets) in scenarios() {
        let plan = plan(name, &sets);
        let name = format!("{name} {sets:?}");
        let [(plain, ..), (fast, ..)] = [SolverKind::Plain, SolverKind::Fast].map(|kind| run(&plan, kind));
        let (plain, fast) = (steps(&plain), steps(&fast));
        assert_eq!(plain.len(), fast.len(), "{name}");
        let first = plain[0].energy;
        let last = plain.last().unwrap().energy;
        // The energy put in, and that at the start.
        let put_in_j = last.drive_work_j + last.prestress_work_j.abs();
        let scale = put_in_j + first.kinetic_j + first.elastic_j;
        let mut worst = vec![0.0f64; last.parts().count()];
        // Without dampers, and where all blocks move alike, nothing is lost in them.
        if plan.elastic.damping_kg_per_s == 0.0 || name == "top-driven []" {
            assert!(fast.iter().all(|step| step.energy.viscous_loss_j == 0.0), "{name}");
        }
        for (plain, fast) in plain.iter().zip(&fast) {
            assert_eq!((plain.step, plain.switches.len()), (fast.step, fast.switches.len()), "{name}");
            let [plain, fast] = [plain, fast].map(|step| step.energy);
            for (worst, ((_, plain), (_, fast))) in worst.iter_mut().zip(plain.parts().zip(fast.parts())) {
                *worst = worst.max((plain - fast).abs() / scale);
            }
            let off = (plain.balance_j() - first.balance_j()).abs() / scale;
            assert!(off < 1e-12, "{name}: {off:e} of {scale:e} are out of balance");
        }
        for (worst, (what, value)) in worst.into_iter().zip(last.parts()) {
            assert!(worst < 1e-11, "{name}, {what}: {worst:e} of {scale:e}, {value:e} at the end");
        }
    }
}
