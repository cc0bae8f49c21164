//! Every drive, load, friction law and start: the fast solver is compared with the plain one, and each
//! with independent results.

use asperity_model::Plan;
use asperity_record::Direction;
use asperity_simulator::{Plain, Solver, SolverKind};

use crate::fast_and_plain::{
    agree, assert_balanced, entries, fields, last_energy, records, run, steps, switching,
};

/// A short chain that is driven fast, so that a short run has many events.
const SHORT: [&str; 4] =
    ["slider.blocks=24", "time.step_s=1e-7", "time.duration_s=0.2", "drive.velocity_m_per_s=2e-3"];

fn plan(sets: &[&str]) -> Plan {
    asperity_testkit::plan("default", &[&SHORT[..], sets].concat())
}

const TWO_WAY: &str = "friction.reattach=two-way";
const HOLD: &str = "drive.hold_from_s=0.08";
const UNLOAD_S: &str = "normal_load.schedule_s=[0.08,0.12,0.15,0.2]";
const UNLOAD_N: &str = "normal_load.schedule_n=[400,250,250,100]";

#[test]
fn the_fast_solver_does_what_the_plain_one_does_by_every_law_and_drive() {
    by_every_law_and_drive(4);
}

/// All of them; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn the_fast_solver_does_so_in_both_parameter_sets() {
        by_every_law_and_drive(1);
    }
}

/// Compares the solvers in all cases and both parameter sets, or in one of so many of these combinations.
fn by_every_law_and_drive(one_of: usize) {
    let cases: &[&[&str]] = &[
        &["drive.kind=top", "normal_load.tilt=0.5"],
        &["drive.kind=top", "drive.tilt=0.8"],
        &["drive.kind=top", "drive.decay_length_m=0.02"],
        &["drive.kind=left-right", TWO_WAY],
        &[HOLD],
        &[HOLD, UNLOAD_S, UNLOAD_N],
        // The stop is known from the start, and the load is constant until then.
        &[
            HOLD,
            "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0,0.1]",
            "normal_load.schedule_n=[400,100]",
        ],
        &[HOLD, UNLOAD_S, UNLOAD_N, "normal_load.tilt=0.7", "drive.kind=top"],
        &[HOLD, UNLOAD_S, UNLOAD_N, "drive.kind=left-right", TWO_WAY],
        &["normal_load.schedule_s=[0.02,0.1]", "normal_load.schedule_n=[400,700]"],
        &["drive.until_load_ratio=0.2"],
        &[
            "drive.until_load_ratio=0.2",
            "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0.01,0.1]",
            "normal_load.schedule_n=[400,50]",
        ],
        // The load at which the drive stops falls while the chain rests.
        &[
            "drive.until_load_ratio=0.04",
            "normal_load.schedule_s=[0,0.04]",
            "normal_load.schedule_n=[400,300]",
        ],
        &[
            "friction.law=rigid",
            "drive.until_load_ratio=0.02",
            "normal_load.schedule_s=[0,0.04,0.2]",
            "normal_load.schedule_n=[400,300,3]",
        ],
        // A load that drops almost at once.
        &[HOLD, "normal_load.schedule_s=[0.08,0.0800001]", "normal_load.schedule_n=[400,60]"],
        &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3"],
        &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3", HOLD, UNLOAD_S, UNLOAD_N],
        &["friction.static_spread=0.1", "friction.dynamic_spread=0.1", "friction.spread_seed=7"],
        &["initial_shear.poisson_ratio=0.35"],
        &["time.start=loaded"],
        &["time.start=loaded", "initial_shear.beta=0.225", "drive.kind=top", "drive.decay_length_m=0.02"],
        &["prestress.ratio=0.5"],
        &["prestress.ratio=-0.3", "drive.kind=top", "initial_shear.beta=0.2"],
        &["prestress.ratio=0.4", HOLD, UNLOAD_S, UNLOAD_N],
        &["prestress.ratio=0.3", "time.start=loaded", "normal_load.tilt=0.5"],
        &["prestress.ratio=0.5", "friction.law=rigid"],
        &["prestress.ratio=0.5", "friction.law=velocity-weakening"],
        &["friction.law=rigid"],
        &["friction.law=rigid", HOLD, UNLOAD_S, UNLOAD_N],
        &["friction.law=rigid", "drive.until_load_ratio=0.2"],
        &["friction.law=velocity-weakening", "friction.weakening_velocity_m_per_s=0.05"],
        &[
            "friction.law=velocity-weakening",
            "friction.radiation_kg_per_s=3",
            "drive.kind=top",
            "normal_load.tilt=0.3",
        ],
        &["slider.relative_damping=0"],
        &["friction.law=rigid", "friction.weakening_slip_m=1e-7", HOLD, UNLOAD_S, UNLOAD_N],
        &["friction.law=rigid", "friction.weakening_slip_m=1e-7", "friction.slip_memory_s=1e-3"],
        &["friction.law=rigid", "friction.drag_at_rest=true"],
        &["initial_velocity.amplitude_m_per_s=0.1"],
        &["friction.law=velocity-weakening", "friction.drag_at_rest=true"],
    ];
    let (mut all, mut leaps) = (0, 0);
    for (n, sets) in cases.iter().enumerate() {
        for (set, parameters) in ["parameter_set=as-coded", "parameter_set=as-stated"].into_iter().enumerate()
        {
            // One of four has each drive, law and start.
            if (2 * n + set) % one_of != (n / 4 + 3) % one_of {
                continue;
            }
            let plan = plan(&[sets, &[parameters][..]].concat());
            let agreement = agree(&plan, &format!("{sets:?}, {parameters}"));
            assert!(agreement.switches >= 2, "{sets:?}, {parameters}: {} switches", agreement.switches);
            all += agreement.switches;
            let (_, counters, _) = run(&plan, SolverKind::Fast);
            // Friction that depends on velocity takes single steps while anything slides, and where
            // blocks chatter no shortcut pays.
            let few = plan.steps / if plan.friction.law.affine().is_some() { 2 } else { 1 };
            assert!(counters.plain_steps < few, "{sets:?}, {parameters}: {counters}");
            leaps += counters.jumps;
        }
    }
    assert!(all > 10_000 / one_of as u64 && leaps > 500 / one_of as u64, "{all} switches, {leaps} jumps");
}

/// Forces from outside on all blocks or on some, with every kind of contact and drive.
#[test]
fn prestress_is_the_same_to_both_solvers_by_every_law_and_drive() {
    let profile =
        format!("prestress.profile={:?}", (0..24).map(|n| 0.02 * f64::from(n % 5)).collect::<Vec<_>>());
    let prestresses: [&[&str]; 3] = [
        &["prestress.ratio=0.55", "prestress.first_block_ratio=0.1"],
        &["prestress.ratio=-0.2", "prestress.first_block_ratio=0.3", "prestress.rise_ratio=0.5"],
        &["prestress.ratio=0.4", &profile],
    ];
    let laws: [&[&str]; 3] = [
        &["friction.law=interfacial-springs"],
        &["friction.law=rigid"],
        &["friction.law=velocity-weakening", "friction.weakening_velocity_m_per_s=0.05"],
    ];
    let drives: [&[&str]; 5] = [
        &["drive.kind=side"],
        &["drive.kind=top", "drive.tilt=0.5"],
        &["drive.kind=top", "drive.decay_length_m=0.02"],
        // With `as-stated`, blocks chatter under the two-way rule, and rounding grows.
        &["drive.kind=left-right", TWO_WAY, "parameter_set=as-coded"],
        &["drive.kind=top", "drive.velocity_m_per_s=0", "drive.stiffness_n_per_m=1e8"],
    ];
    let mut switches = 0;
    for prestress in prestresses {
        for law in laws {
            for drive in drives {
                let sets =
                    [prestress, law, &["parameter_set=as-stated", "time.duration_s=0.03"], drive].concat();
                switches += agree(&plan(&sets), &format!("{sets:?}")).switches;
            }
        }
    }
    assert!(switches > 3000, "{switches} switches");
}

#[test]
fn a_slow_ramp_does_not_drift_over_a_long_jump() {
    ramp(0.1);
}

#[test]
#[ignore = "a minute of single steps: cargo xtask nightly"]
fn a_ramp_of_200_million_steps_does_not_drift() {
    ramp(2.0);
}

/// The rounding of a load's rate, times all the steps of a jump, exceeds the reserve of the bounds.
fn ramp(duration_s: f64) {
    for law in ["interfacial-springs", "rigid"] {
        let plan = plan(&[
            &format!("friction.law={law}"),
            "slider.blocks=4",
            "time.step_s=1e-8",
            &format!("time.duration_s={}", 0.955 * duration_s),
            "drive.velocity_m_per_s=0",
            "initial_shear.beta=0.45",
            &format!("normal_load.schedule_s=[0,{duration_s}]"),
            "normal_load.schedule_n=[400,250]",
        ]);
        assert!(agree(&plan, law).switches > 0, "{law}");
    }
}

/// Thresholds and sliding friction are those of the load in the step, independently of the comparison of
/// solvers.
#[test]
fn friction_follows_the_load() {
    let plan = plan(&[HOLD, UNLOAD_S, UNLOAD_N]);
    let dt = plan.grid.step_s();
    let mut plain = Plain::new(plan.clone());
    let (mut slid, mut detached) = (0, 0);
    while plain.step() < plan.steps {
        let before = plain.snapshot();
        plain.take_step();
        let state = plain.state();
        let t = plan.grid.time_s(state.step);
        let load_n = match t {
            t if t <= 0.08 => 400.0,
            t if t <= 0.12 => 400.0 - 150.0 * (t - 0.08) / 0.04,
            t if t <= 0.15 => 250.0,
            t => 250.0 - 150.0 * (t - 0.15) / 0.05,
        };
        let p = load_n / plan.blocks as f64;
        for n in 0..plan.blocks {
            let (v, tau) = (before.slider.velocity_m_per_s[n], state.tangential_force_n[n]);
            if before.slider.slip[n] != 0.0 && v > 0.0 {
                let friction = (state.velocity_m_per_s[n] - v) * plan.block_mass_kg / dt - tau;
                assert!((friction + 0.45 * p).abs() < 1e-6, "step {}: {friction} at {p}", state.step);
                slid += u32::from(t > 0.08);
            } else if before.slider.slip[n] == 0.0 {
                assert_eq!(state.slip[n] != 0.0, tau.abs() >= 0.7 * p * (1.0 - 1e-12), "step {}", state.step);
                detached += u32::from(t > 0.08 && state.slip[n] != 0.0);
            }
        }
    }
    assert!(slid > 10_000 && detached > 10, "{slid} {detached}");
}

#[test]
fn settings_of_no_effect_change_nothing() {
    let records_of = |sets: &[&str]| records(SolverKind::Plain.start(plan(sets)));
    let side = records_of(&[]);
    let even = ["normal_load.schedule_s=[0.01,0.05,0.1]", "normal_load.schedule_n=[400,400,400]"];
    assert_eq!(records_of(&even), side);
    assert_eq!(records_of(&["drive.kind=top", "drive.decay_length_m=1e-6"]), side);
    // A rate indistinguishable from zero, handled by the code for a positive rate.
    let [aged, ageing] =
        ["1e-30", "1e-3"].map(|rate| records_of(&[&format!("friction.ageing_coefficient={rate}")]));
    assert_eq!(entries(&aged), entries(&side));
    assert_ne!(entries(&ageing), entries(&side));
}

#[test]
fn a_contact_has_aged_by_the_logarithm_of_its_time_at_rest() {
    let plan = plan(&["friction.ageing_coefficient=0.05", "friction.ageing_time_s=1e-4"]);
    let records = records(SolverKind::Plain.start(plan.clone()));
    let mut since = vec![0; plan.blocks];
    let mut held = 0;
    for record in steps(&records) {
        for switch in &record.switches {
            let n = switch.block as usize - 1;
            let p = plan.normal_load_n[n];
            let waited_s = (record.step - since[n]) as f64 * 1e-7;
            if switch.direction == Direction::Detach {
                let aged = (0.7 + 0.05 * (1.0 + waited_s / 1e-4).ln()) * p;
                assert!((switch.threshold_n / aged - 1.0).abs() < 1e-12, "{switch:?}, {waited_s} s");
                assert!(switch.tangential_force_n.abs() >= switch.threshold_n);
                held += 1;
            } else {
                since[n] = record.step;
            }
        }
    }
    assert!(held > 50, "{held}");
}

/// With ever stiffer friction springs, the times and distances of first slips converge to those without
/// springs.
#[test]
fn ever_stiffer_friction_springs_become_rigid() {
    let first = |sets: &[&str]| {
        let plan =
            plan(&[&["slider.blocks=8", "drive.velocity_m_per_s=1e-3", "time.step_s=2e-8"], sets].concat());
        let records = records(SolverKind::Fast.start(plan));
        switching(&records).first().expect("a block detaches").driving_force_n
    };
    let rigid = first(&["friction.law=rigid"]);
    let mut last = f64::INFINITY;
    for ratio in ["3", "30", "300"] {
        let springs = first(&[&format!("friction.interfacial_stiffness_ratio={ratio}"), "time.step_s=2e-8"]);
        let off = (springs / rigid - 1.0).abs();
        assert!(off < last / 3.0, "k_t / k = {ratio}: {off} after {last}");
        last = off;
    }
    assert!(last < 5e-3, "{last}");
}

/// `friction.drag_at_rest`: the first step of a slip adds `(mu_s - mu_d) p dt / m` to the velocity instead of
/// `mu_s p dt / m`, by the little that the drive exceeds the threshold.
#[test]
fn drag_at_rest_resists_in_the_first_step_of_a_slip() {
    let after_first = |law: &str, at_rest: &str| {
        let plan = plan(&[
            "slider.blocks=1",
            &format!("friction.law={law}"),
            &format!("friction.drag_at_rest={at_rest}"),
            "friction.static_coefficient=0.5",
            "friction.dynamic_coefficient=0.49",
            "drive.velocity_m_per_s=1e-2",
            "time.step_s=1e-8",
        ]);
        let per_n = plan.grid.step_s() / plan.block_mass_kg;
        let load_n = plan.total_normal_load_n;
        let mut plain = Plain::new(plan);
        while plain.take_step().total_n < 0.5 * load_n {}
        // The step after the one in which it detached.
        plain.take_step();
        plain.state().velocity_m_per_s[0] / (per_n * load_n)
    };
    for law in ["velocity-weakening", "rigid"] {
        let (with, without) = (after_first(law, "true"), after_first(law, "false"));
        assert!((with - 0.01).abs() < 1e-5 && (without - 0.5).abs() < 1e-5, "{law}: {with} {without}");
    }
}

/// (2.5, 2.6): the work of the drive that is not stored becomes friction, which falls with velocity, and radiation.
#[test]
fn burridge_and_knopoffs_losses_are_recorded() {
    let plan = plan(&[
        "friction.law=velocity-weakening",
        "friction.weakening_velocity_m_per_s=0.02",
        "friction.radiation_kg_per_s=2",
        "slider.relative_damping=0",
        "drive.kind=top",
        "normal_load.tilt=0.4",
        "drive.velocity_m_per_s=2e-2",
        "time.step_s=2e-8",
        "time.duration_s=0.05",
    ]);
    let dt = plan.grid.step_s();
    let mut plain = Plain::new(plan.clone());
    let (mut work_j, mut friction_j, mut radiated_j) = (0.0, 0.0, 0.0);
    for _ in 0..plan.steps {
        work_j += plain.take_step().total_n * plan.drive.velocity_m_per_s * dt;
        for (n, v) in plain.state().velocity_m_per_s.iter().enumerate() {
            friction_j += plan.friction.dynamic_friction_n[n] / (1.0 + v.abs() / 0.02) * v.abs() * dt;
            radiated_j += 2.0 * v * v * dt;
        }
    }
    assert!(friction_j > 0.2 * work_j && radiated_j > 1e-3 * work_j, "{work_j} {friction_j} {radiated_j}");
    let records = records(SolverKind::Plain.start(plan));
    assert_balanced(&records, 1e-11, "of all energies");
    let last = last_energy(&records);
    for (found_j, expected_j) in [
        (last.drive_work_j, work_j),
        (last.friction_heat_j, friction_j),
        (last.radiated_j.expect("the law radiates"), radiated_j),
    ] {
        assert!((found_j / expected_j - 1.0).abs() < 5e-3, "{found_j}, not {expected_j}: {last:?}");
    }
    assert!(last.scheme_work_j.abs() < 5e-3 * work_j, "{last:?}");
}

#[test]
fn an_even_top_drive_slips_all_at_once_at_the_static_coefficient() {
    let plan = plan(&["drive.kind=top", "time.duration_s=0.3"]);
    let records = records(SolverKind::Fast.start(plan.clone()));
    let first = switching(&records)[0];
    assert_eq!(first.switches.len(), plan.blocks);
    // `mu_s F_N = K V t`, except for the displacement that friction springs allow.
    assert!((first.load_ratio() - 0.7).abs() < 1e-3, "{}", first.load_ratio());
    let stretched = 1.0 + 8e5 / 24.0 / plan.friction.interfacial_stiffness_n_per_m;
    let expected_s = 0.7 * 400.0 / (8e5 * 2e-3) * stretched;
    assert!((first.time_s / expected_s - 1.0).abs() < 1e-3, "{} and {expected_s}", first.time_s);
}

#[test]
fn both_ends_mirror_each_other() {
    let plan = plan(&["drive.kind=left-right", TWO_WAY, "time.duration_s=0.05"]);
    let records = records(SolverKind::Fast.start(plan.clone()));
    let last = plan.blocks - 1;
    let u = &fields(&records).last().expect("states are recorded").displacement_m;
    assert!(u[0] < 0.0 && u[last] > 0.0, "apart, not together: {u:?}");
    let mut seen = 0;
    for record in steps(&records) {
        let [first, other] = record.end_forces_n.expect("both ends are driven");
        assert!((first + other).abs() < 1e-6 && record.driving_force_n == first + other, "{first} {other}");
        seen += record.switches.len();
        for switch in &record.switches {
            let mirrored = (last + 2) as u32 - switch.block;
            assert!(record.switches.iter().any(|other| other.block == mirrored), "{record:?}");
        }
    }
    assert!(seen >= 10, "{seen}");
}

#[test]
fn the_drive_stops_where_its_load_is_reached_and_the_load_falls_from_there() {
    let plan = plan(&[
        "drive.until_load_ratio=0.25",
        "normal_load.schedule_from=hold",
        "normal_load.schedule_s=[0.01,0.05]",
        "normal_load.schedule_n=[400,200]",
    ]);
    let mut plain = Plain::new(plan.clone());
    let (mut before, mut stopped) = (0.0, None);
    for _ in 0..plan.steps {
        let total_n = plain.take_step().total_n;
        if stopped.is_none() && plain.state().hold_step < u64::MAX {
            assert!(before < 100.0 && total_n >= 100.0, "{before} {total_n}");
            stopped = Some(plain.step());
        }
        before = total_n;
    }
    let stopped = stopped.expect("the load is reached");
    for (behind_s, factor) in [(0.0, 1.0), (0.01, 1.0), (0.03, 0.75), (0.05, 0.5), (0.06, 0.5)] {
        let step = stopped + (behind_s / 1e-7f64).round() as u64;
        assert!((plan.outside(step, stopped).load().scaled_n(1.0) - factor).abs() < 1e-12, "{behind_s} s");
        assert_eq!(plan.outside(step, stopped).point_m, plan.outside(stopped, stopped).point_m);
    }
}

/// Section 7.3: a run that starts loaded has the same first slips as one with its ramp, slightly shifted
/// in time, because the ramp leaves the chain vibrating.
#[test]
fn a_loaded_start_slips_as_the_ramp_does() {
    let sets = ["slider.blocks=40", "drive.velocity_m_per_s=1e-4", "time.duration_s=0.6"];
    let onsets = |start: &str| {
        let plan = plan(&[&sets[..], &[start]].concat());
        let begins = plan.initial.step;
        let records = records(SolverKind::Fast.start(plan));
        let mut blocks = Vec::new();
        for (step, _, switches) in entries(&records) {
            for (block, detaches) in switches {
                if detaches && !blocks.iter().any(|(_, known)| *known == block) {
                    blocks.push((step, block));
                }
            }
        }
        (begins, blocks)
    };
    let (from_rest, ramp) = onsets("time.start=at-rest");
    let (from_loaded, loaded) = onsets("time.start=loaded");
    assert_eq!(from_rest, 0);
    assert!(from_loaded > 100_000, "{from_loaded}");
    let in_both = ramp.len().min(loaded.len());
    assert!(in_both > 5, "{in_both}");
    for ((a, block), (b, other)) in ramp.iter().zip(&loaded) {
        assert_eq!(block, other);
        let apart_s = a.abs_diff(*b) as f64 * 1e-7;
        assert!(apart_s < 5e-3, "block {block}: {apart_s} s apart");
    }
}

/// In a slider that only slides forward, a force on each block proportional to its normal load is
/// equivalent to an equally large reduction of friction.
#[test]
fn an_even_prestress_is_weaker_friction() {
    // Not to the bit: a block that starts from rest, or moves back, has its full friction.
    let first_all_sliding = |extra: &[&str]| {
        let plan = plan(&[&["normal_load.tilt=0.5"], extra].concat());
        let records = records(SolverKind::Fast.start(plan.clone()));
        let (first, steps) = (switching(&records)[0], steps(&records));
        let global = steps.iter().find(|record| record.sliding == 24).expect("all of them slide");
        [first.load_ratio(), global.load_ratio()]
    };
    let pushed = first_all_sliding(&["prestress.ratio=0.25"]);
    let weaker = first_all_sliding(&["friction.static_coefficient=0.45", "friction.dynamic_coefficient=0.2"]);
    let neither = first_all_sliding(&[]);
    for (n, within) in [1e-6, 0.05].into_iter().enumerate() {
        assert!((pushed[n] / weaker[n] - 1.0).abs() < within, "{pushed:?} {weaker:?}");
        assert!(neither[n] > 1.3 * pushed[n], "{pushed:?} {neither:?}");
    }
}

/// One rigid block: it slips when its spring reaches static friction, at a time that follows from the integral of the
/// velocity: through steps, ramps and holds of it.
#[test]
fn a_rigid_block_slips_when_the_course_of_the_drive_has_brought_it_to_its_threshold() {
    let (stiffness, threshold_n) = (8e5, 280.0);
    let reach_m = threshold_n / stiffness;
    let cases: [(&str, &str, f64); 4] = [
        // V = 1e-4 up to 1 s, then 1e-3.
        ("[1,1]", "[1e-4,1e-3]", 1.0 + (reach_m - 1e-4) / 1e-3),
        // A hold from 1 s to 2 s.
        ("[1,1,2,2]", "[1e-4,0,0,1e-4]", 2.0 + (reach_m - 1e-4) / 1e-4),
        // From 1e-4 at 1 s to 5e-4 at 2 s: the point is at 1e-4 + 1e-4 t + 2e-4 t^2.
        ("[1,2]", "[1e-4,5e-4]", 1.0 + (-1e-4 + (1e-8_f64 + 8e-4 * (reach_m - 1e-4)).sqrt()) / 4e-4),
        // From 1e-4 to 0 over 2 s, after 3 s.
        ("[3,5]", "[1e-4,0]", 3.0 + (1e-4 - (1e-8_f64 - 1e-4 * (reach_m - 3e-4)).sqrt()) / 5e-5),
    ];
    for (times, velocities, onset_s) in cases {
        let course = [format!("drive.course_s={times}"), format!("drive.course_m_per_s={velocities}")];
        let plan = plan(&[
            "slider.blocks=1",
            "friction.law=rigid",
            "time.step_s=1e-6",
            "time.duration_s=6",
            "drive.velocity_m_per_s=1e-4",
            "drive.stiffness_n_per_m=8e5",
            &course[0],
            &course[1],
        ]);
        for kind in [SolverKind::Fast, SolverKind::Plain] {
            let records = records(kind.start(plan.clone()));
            let found_s = switching(&records).first().expect("it slips").time_s;
            // The first step from there on.
            assert!((0.0..1.01e-6).contains(&(found_s - onset_s)), "{times}: {found_s}, not {onset_s}");
        }
    }
}
