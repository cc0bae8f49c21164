//! Friction that falls over a slip: closed forms of one block, stability, energies, and both solvers.

use asperity_model::theory::weakening::{Beginning, OneBlock, weakening_n_per_m};
use asperity_record::Record;
use asperity_simulator::SolverKind;

use crate::fast_and_plain::{assert_balanced, entries, last_energy, records, steps, switching};

fn plan(name: &str, sets: &[&str]) -> asperity_model::Plan {
    asperity_testkit::plan(name, sets)
}

#[test]
fn one_block_slips_as_the_closed_form() {
    let (d_m, step_s) = (1e-5, 1e-8);
    let plan = plan(
        "rigid-contacts",
        &[
            "slider.blocks=1",
            &format!("friction.weakening_slip_m={d_m}"),
            &format!("time.step_s={step_s}"),
            "time.duration_s=3.52",
        ],
    );
    let records = records(SolverKind::Fast.start(plan));
    let [detached, attached] = [0, 1].map(|which| switching(&records)[which]);
    let slip = OneBlock {
        mass_kg: 0.012,
        drive_n_per_m: 8e5,
        velocity_m_per_s: 1e-4,
        static_n: 280.0,
        dynamic_n: 180.0,
        weakening_slip_m: d_m,
    }
    .slip()
    .expect("it runs away");
    let steps = (attached.step - detached.step) as f64;
    assert!((steps * step_s / slip.duration_s - 1.0).abs() < 1e-4, "{steps}");
    let moved_m = attached.switches[0].displacement_m - detached.switches[0].displacement_m;
    assert!((moved_m / slip.slip_m - 1.0).abs() < 3e-5, "{moved_m}");
    assert!((attached.driving_force_n / slip.end_n - 1.0).abs() < 3e-4, "{}", attached.driving_force_n);
    let fracture_j = last_energy(&records).fracture_energy_j.expect("it weakens");
    let excess = 0.5 * step_s * (1e7_f64 / 0.012).sqrt();
    assert!((fracture_j / slip.fracture_j - 1.0 - excess).abs() < 2e-5, "{fracture_j}");
}

/// Blocks between stuck ones, at 0.97 and 1.03 of the slip below which they run away.
#[test]
fn blocks_run_away_below_the_critical_slip() {
    for (blocks, beginning) in [(1, Beginning::Stuck), (3, Beginning::Stuck), (4, Beginning::Free)] {
        let first = if beginning == Beginning::Stuck { 3 } else { 1 };
        let ends: Vec<u32> = [first - 1, first + blocks].into_iter().filter(|n| *n > 0).collect();
        let fastest = |share: f64| {
            let d = share * beginning.critical_slip(blocks, 0.0);
            // k = 2.5e9 * 11 * 0.005 * 0.02 / 0.1 N/m; (mu_s - mu_d) p = 0.25 * 400 / 12 N.
            let slip_m = d * 0.25 * (400.0 / 12.0) / 2.75e7;
            let plan = plan(
                "rigid-contacts",
                &[
                    "slider.blocks=12",
                    "drive.kind=top",
                    "drive.stiffness_n_per_m=1e3",
                    "drive.velocity_m_per_s=1",
                    "prestress.ratio=0.69999",
                    &format!("friction.stuck_blocks={ends:?}"),
                    &format!("friction.weakening_slip_m={slip_m:e}"),
                    "time.step_s=1e-8",
                    "time.duration_s=2e-3",
                    "recording.fields_s=1e-5",
                ],
            );
            let inside = first as usize - 1..(first + blocks) as usize - 1;
            let records = records(SolverKind::Fast.start(plan));
            let speeds = records.iter().filter_map(|record| match record {
                Record::Fields(state) => Some(state.velocity_m_per_s[inside.clone()].iter().copied()),
                _ => None,
            });
            speeds.flatten().fold(0.0, f64::max)
        };
        let [below, above] = [0.97, 1.03].map(fastest);
        assert!(below > 5.0 * above, "{blocks} {beginning:?}: {below} {above}");
    }
}

#[test]
fn energies_balance_and_fracture_energy_is_part_of_the_heat() {
    for (name, sets) in [
        ("rigid-contacts", &["slider.blocks=24", "friction.weakening_slip_m=1e-7"][..]),
        (
            "rigid-contacts",
            &["slider.blocks=24", "friction.weakening_slip_m=1e-7", "friction.drag_at_rest=true"],
        ),
        ("default", &["slider.blocks=24", "friction.weakening_slip_m=1e-7", "friction.radiation_kg_per_s=2"]),
        (
            "slab",
            &["slider.blocks=29", "slider.rows=16", "friction.weakening_slip_m=3e-6", "time.step_s=4e-7"],
        ),
    ] {
        let quick = ["time.duration_s=0.2", "drive.velocity_m_per_s=2e-3", "time.step_s=1e-7"];
        let quick = if name == "slab" { &quick[..2] } else { &quick };
        let plan = plan(name, &[sets, quick].concat());
        for solver in [SolverKind::Plain, SolverKind::Fast] {
            let records = records(solver.start(plan.clone()));
            assert_balanced(&records, 1e-9, &format!("{name} {sets:?}"));
            let last = last_energy(&records);
            let fracture_j = last.fracture_energy_j.expect("it weakens");
            assert!(0.0 < fracture_j && fracture_j < last.friction_heat_j, "{name}: {last:?}");
            if name == "rigid-contacts" {
                assert!(
                    steps(&records)
                        .is_sorted_by(|a, b| a.energy.fracture_energy_j <= b.energy.fracture_energy_j)
                );
            }
        }
    }
}

#[test]
fn a_slab_weakens_by_both_solvers_alike() {
    let plan = plan(
        "slab",
        &[
            "slider.blocks=29",
            "slider.rows=16",
            "friction.weakening_slip_m=3e-6",
            "time.step_s=4e-7",
            "time.duration_s=0.1",
            "drive.velocity_m_per_s=2e-3",
        ],
    );
    let [plain, fast] =
        [SolverKind::Plain, SolverKind::Fast].map(|kind| entries(&records(kind.start(plan.clone()))));
    assert_eq!(plain, fast);
    assert!(plain.iter().map(|(_, _, switches)| switches.len()).sum::<usize>() > 20);
}

#[test]
fn without_slip_friction_falls_at_once() {
    let [law, zero] = ["friction.law=rigid", "friction.weakening_slip_m=0"];
    assert_eq!(plan("default", &[law]), plan("default", &[law, zero]));
    let plan = plan(
        "default",
        &[
            law,
            "friction.weakening_slip_m=1e-7",
            "friction.weakening_fractions=[0.25]",
            "friction.weakening_shares=[0.1]",
        ],
    );
    // Of the first quarter.
    let fall = 0.9 / 0.25 * 0.25 * 4.0 / 1e-7;
    assert!((weakening_n_per_m(&plan, 7) / fall - 1.0).abs() < 1e-12);
}
