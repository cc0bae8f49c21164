//! Rate-and-state friction under forces from outside that change in time, and from free starts: tables of independent
//! programs (`fixtures/reference/laws`), closed forms, and numbers of others' codes.

use std::f64::consts::TAU;

use asperity_model::Plan;
use asperity_record::Record;
use asperity_simulator::SolverKind;
use asperity_testkit::{plan, reference};

use crate::fast_and_plain::{detachments, fields, last_energy, records, steps};

/// The load of `spring-slider`, N, its direct effect times it, its stiffness, N/m, and the velocity of its drive, m/s.
const LOAD_N: f64 = 5e6;
const DIRECT_N: f64 = 5e4;
const STIFFNESS_N_PER_M: f64 = 2e9;
const DRIVE_M_PER_S: f64 = 1e-5;

fn run(scenario: &str, sets: &[&str]) -> (Plan, Vec<Record>) {
    let plan = plan(scenario, sets);
    let records = records(SolverKind::Adaptive.start(plan.clone()));
    (plan, records)
}

fn onsets(sets: &[&str]) -> Vec<f64> {
    let (_, records) = run("spring-slider", &[&["recording.fields_s=0"], sets].concat());
    detachments(&records).map(|(step, _)| step.time_s).collect()
}

fn number(cell: &str) -> f64 {
    cell.parse().unwrap_or_else(|_| panic!("{cell:?} is no number"))
}

/// A force that is added at a time and stays.
fn step(at_s: f64, force_n: f64) -> [String; 2] {
    let ratio = force_n / LOAD_N;
    [format!("prestress.course_s=[{at_s},{at_s}]"), format!("prestress.course_ratio=[0,{ratio}]")]
}

fn are_close(found: &[f64], expected: &[f64], error_s: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}: {found:?} for {expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < error_s, "{what}: {found} for {expected}");
    }
}

/// A force on a block is as good as a drive that has moved by it over the stiffness: the same velocities and states, and
/// a driving force that differs by it.
#[test]
fn a_force_on_a_block_is_a_drive_that_is_elsewhere() {
    let inertial = [
        "friction.inertia=true",
        "friction.radiation_kg_per_s=0",
        "friction.evolution_effect=0.02",
        "friction.critical_slip_m=1e-6",
        "friction.reference_velocity_m_per_s=1e-6",
        "slider.mass_kg=0.012",
        "drive.stiffness_n_per_m=8e5",
        "drive.velocity_m_per_s=1e-4",
        "normal_load.total_n=400",
        "time.duration_s=4",
        "time.step_s=1e-9",
        "recording.fields_s=0.02",
    ];
    for (sets, times, ratios) in [
        (&["time.duration_s=150"][..], [80.0, 100.0, 120.0], [0.0, 0.01, -0.004]),
        (&inertial, [0.5, 1.5, 3.0], [0.0, 0.05, -0.1]),
    ] {
        let sets = [sets, &["time.tolerance=1e-10", "friction.event_speed_m_per_s=1e-3"]].concat();
        let course = [format!("prestress.course_s={times:?}"), format!("prestress.course_ratio={ratios:?}")];
        let pushed = run("spring-slider", &[&sets[..], &[&course[0], &course[1]]].concat());
        let (stiffness, load_n) = (pushed.0.drive.springs[0].stiffness_n_per_m, pushed.0.total_normal_load_n);
        let v = pushed.0.drive.velocity_m_per_s;
        let faster =
            [0, 1].map(|n| v + load_n / stiffness * (ratios[n + 1] - ratios[n]) / (times[n + 1] - times[n]));
        let [from, middle, to] = times;
        let velocities = [v, faster[0], faster[0], faster[1], faster[1], v];
        let course = [
            format!("drive.course_s={:?}", [from, from, middle, middle, to, to]),
            format!("drive.course_m_per_s={velocities:?}"),
        ];
        let moved = run("spring-slider", &[&sets[..], &[&course[0], &course[1]]].concat());
        let of = |records: &[Record]| detachments(records).map(|(step, _)| step.time_s).collect::<Vec<_>>();
        let [found, expected] = [&pushed, &moved].map(|(_, records)| of(records));
        assert!(found.len() > 2, "{found:?}");
        are_close(&found, &expected, 2e-7, "onset");
        let force_n = |time_s: f64| {
            let at = |n: usize| {
                let share = ((time_s - times[n]) / (times[n + 1] - times[n])).clamp(0.0, 1.0);
                ratios[n] + share * (ratios[n + 1] - ratios[n])
            };
            load_n * if time_s < middle { at(0) } else { at(1) }
        };
        let pairs = fields(&pushed.1).into_iter().zip(fields(&moved.1));
        for (pushed, moved) in pairs.filter(|(pushed, _)| onsets_are_far(&found, pushed.time_s)) {
            let [v, there] = [pushed, moved].map(|fields| fields.velocity_m_per_s[0].ln());
            assert!((v - there).abs() < 1e-5, "{}: {v} {there}", pushed.time_s);
            assert!((pushed.state[0] - moved.state[0]).abs() < 1e-7, "{}", pushed.time_s);
        }
        for (pushed, moved) in steps(&pushed.1).into_iter().zip(steps(&moved.1)) {
            if pushed.time_s == moved.time_s && onsets_are_far(&found, pushed.time_s) {
                let more_n = moved.driving_force_n - pushed.driving_force_n;
                let error_n = (more_n - force_n(pushed.time_s)).abs();
                assert!(error_n < 1e-7 * load_n, "{}: {more_n}", pushed.time_s);
            }
        }
    }
}

/// Whether a time is not within a slip.
fn onsets_are_far(onsets: &[f64], time_s: f64) -> bool {
    onsets.iter().all(|onset| !(-1e-3..0.1).contains(&(time_s - onset)))
}

/// Dieterich's clock advance: `t_i(V) = (a / r) ln[1 + r / (H V)]` before and behind a step of the force, which takes
/// `V` to `V e^(dQ / (p a))`, from a free start.
#[test]
fn a_step_of_a_force_advances_the_clock_in_closed_form() {
    let start = [
        "friction.radiation_kg_per_s=1",
        "friction.initial_velocity_m_per_s=1e-6",
        "friction.initial_theta_s=1e7",
        "friction.event_speed_m_per_s=1e-3",
        "time.tolerance=1e-10",
        "time.duration_s=7",
    ];
    let (a, h) = (0.01, 0.015 / 1e-5 - STIFFNESS_N_PER_M / LOAD_N);
    let r = STIFFNESS_N_PER_M * DRIVE_M_PER_S / LOAD_N;
    let left_s = |v: f64| a / r * (r / (h * v)).ln_1p();
    for row in reference("laws/rsf-free-start.csv") {
        assert_eq!(row[0], "1e+07");
        let force_n = number(&row[2]);
        let sets = if force_n == 0.0 { Vec::new() } else { step(number(&row[1]), force_n).to_vec() };
        let sets: Vec<&str> = start.iter().copied().chain(sets.iter().map(String::as_str)).collect();
        let found = onsets(&sets);
        are_close(&found, &[number(&row[3])], 1e-7, "by another program");
        // Up to the step, and with the velocity behind it.
        let at_s = if force_n == 0.0 { 0.0 } else { number(&row[1]) };
        let v = r / h / ((r * (left_s(1e-6) - at_s) / a).exp_m1());
        let closed_s = at_s + left_s(v * (force_n / DIRECT_N).exp()) - left_s(1e-3);
        assert!((closed_s - number(&row[4])).abs() < 1e-7, "{closed_s}");
        are_close(&found, &[closed_s], 3e-6, "in closed form");
    }
}

/// Onsets of an independent program for steps of the force in a cycle.
#[test]
fn steps_of_a_force_in_the_cycle_move_onsets_as_by_another_program() {
    let rows = reference("laws/rsf-clock-advance.csv");
    let cases: Vec<_> = rows.chunk_by(|a, b| a[..2] == b[..2]).collect();
    assert!(cases.len() >= 6);
    for rows in cases {
        let (at_s, force_n) = (number(&rows[0][0]), number(&rows[0][1]));
        let course = step(at_s, force_n);
        let (from_s, to_s) = if at_s < 250.0 { (0.0, 170.0) } else { (230.0, 300.0) };
        let duration = format!("time.duration_s={to_s}");
        let mut found = onsets(&[&course[0], &course[1], "time.tolerance=1e-10", &duration]);
        found.retain(|time_s| *time_s >= from_s);
        let expected: Vec<f64> = rows.iter().map(|row| number(&row[3])).collect();
        are_close(&found, &expected, 1e-5, &format!("{force_n} N at {at_s} s"));
    }
}

/// A ramp of the force within a millisecond, whose errors the slip that it starts amplifies.
#[test]
fn a_pulse_of_a_force_moves_onsets_as_by_another_program() {
    let ramp = ["prestress.course_s=[110,110.001]", "prestress.course_ratio=[0,0.02]", "time.duration_s=170"];
    for (speed, tolerance, expected, error_s) in [
        ("0.1", "1e-10", &[140.220084, 162.876097][..], 2e-6),
        ("0.1", "1e-7", &[140.220084, 162.876097], 3e-4),
        ("0.015", "1e-10", &[118.375160, 140.219350, 162.875369], 2e-6),
    ] {
        let sets = [format!("friction.event_speed_m_per_s={speed}"), format!("time.tolerance={tolerance}")];
        let mut found = onsets(&[&ramp[..], &[&sets[0], &sets[1]]].concat());
        found.retain(|time_s| *time_s > 110.002);
        are_close(&found, expected, error_s, speed);
    }
}

/// The response of steady sliding to a small swing: `V = i w Q / (K + i w Z)`,
/// `Z = (p / V_l) (a - b / (1 + i w D_c / V_l)) + E`; amplitude and phase by an independent program.
#[test]
fn a_swing_of_the_force_swings_the_velocity_in_closed_form() {
    let sets = [
        "friction.direct_effect=0.015",
        "friction.evolution_effect=0.010",
        "friction.radiation_kg_per_s=1",
        "friction.initial_kick=0",
        "prestress.swing_ratio=1.5e-5",
        "prestress.swing_period_s=10",
        "time.duration_s=220",
        "time.tolerance=1e-9",
        "recording.fields_s=0.1",
    ];
    let (_, all) = run("spring-slider", &sets);
    let last: Vec<_> = fields(&all).into_iter().filter(|fields| fields.time_s > 200.05).collect();
    assert_eq!(last.len(), 200);
    let project = |of: fn(f64) -> f64| {
        let parts =
            last.iter().map(|at| (at.velocity_m_per_s[0] / DRIVE_M_PER_S - 1.0) * of(TAU * at.time_s / 10.0));
        parts.sum::<f64>() / 100.0
    };
    let (cosine, sine) = (project(f64::cos), project(f64::sin));
    let (amplitude, phase) = (cosine.hypot(sine), (-sine).atan2(cosine));
    assert!((amplitude / 1.863668e-3 - 1.0).abs() < 2e-6, "{amplitude}");
    assert!((phase + 1.337411).abs() < 2e-6, "{phase}");
    // A loose tolerance misses no period either.
    let coarse =
        [&sets[..], &["time.tolerance=1e-2", "prestress.swing_period_s=0.01", "time.duration_s=1"]].concat();
    let mut solver = SolverKind::Adaptive.start(plan("spring-slider", &coarse));
    while solver.next_record().unwrap().is_some() {}
    assert!(solver.counters().adaptive_steps >= 2000);
}

/// At a jump of the force the contact answers at once: without inertia by `V e^(dQ / (p a))`, with it after
/// `m V / (a p)`, while `y = F / (p a)` stays. A slip that begins there begins in the next step of the grid.
#[test]
fn at_a_jump_of_the_force_velocities_follow_friction() {
    let jump = step(1.0, 1.5 * DIRECT_N);
    let window = "recording.window=[{ from_s = 1, to_s = 1.00000001, every_s = 1e-8, first_block = 1, last_block = 1 }]";
    let sets = [
        "friction.radiation_kg_per_s=1",
        "time.duration_s=1.1",
        "time.tolerance=1e-10",
        window,
        &jump[0],
        &jump[1],
    ];
    for inertia in ["friction.inertia=false", "friction.inertia=true"] {
        let sets = [&sets[..], &[inertia, "slider.mass_kg=1e-9"]].concat();
        let (_, all) = run("spring-slider", &sets);
        let speeds: Vec<f64> =
            crate::fast_and_plain::windows(&all).iter().map(|at| at.velocity_m_per_s[0]).collect();
        let [before, after] = speeds[..] else { panic!("{speeds:?}") };
        // Within 1e-8 s `V` grows by `H V / a` times that.
        assert!(((after / before).ln() - 1.5).abs() < 1e-6, "{inertia}: {before} {after}");
    }
    let with_speed = |speed: &str| onsets(&[&sets[..], &[speed]].concat());
    assert_eq!(with_speed("friction.event_speed_m_per_s=4e-5"), [1.00000001]);
    assert_eq!(
        with_speed("friction.event_speed_m_per_s=5e-5").first().map(|at| *at > 1.00000001),
        Some(true)
    );
}

/// Energies close over courses, jumps and swings, with the work of the prestress integrated.
#[test]
fn energies_close_under_forces_in_time() {
    let forces = [
        "prestress.course_s=[0.2,0.4,0.4,0.9]",
        "prestress.course_ratio=[0,0.02,-0.01,0.03]",
        "prestress.ratio=0.05",
        "prestress.swing_ratio=0.004",
        "prestress.swing_period_s=0.03",
        "prestress.swing_from_s=0.1",
        "time.duration_s=1.2",
        "recording.sample_s=0.01",
        "time.tolerance=1e-8",
    ];
    for sets in [
        &["friction.radiation_kg_per_s=3"][..],
        &["friction.inertia=false", "friction.radiation_kg_per_s=20", "slider.relative_damping=0"],
        &["normal_load.schedule_s=[0.1, 0.9]", "normal_load.schedule_n=[400, 300]", "drive.kind=side"],
    ] {
        let (_, all) = run("rate-and-state", &[&forces[..], sets].concat());
        let balances_j: Vec<f64> = steps(&all).iter().map(|step| step.energy.balance_j()).collect();
        let worst_j = balances_j.iter().fold(0.0, |most: f64, at_j| most.max((at_j - balances_j[0]).abs()));
        let last = last_energy(&all);
        assert!(worst_j < 1e-7 * last.drive_work_j.abs(), "{sets:?}: {worst_j} of {}", last.drive_work_j);
        assert!(last.prestress_work_j.abs() > 1e-3 * last.drive_work_j.abs(), "{}", last.prestress_work_j);
    }
}

/// In a stiff machine a state begins where it is set and decays to that of steady sliding, `D_c / V_l`.
#[test]
fn a_free_state_decays_in_closed_form() {
    let sets = [
        "friction.initial_theta_s=10",
        "friction.initial_velocity_m_per_s=1e-5",
        "friction.radiation_kg_per_s=1",
        "drive.stiffness_n_per_m=1e18",
        "friction.event_speed_m_per_s=1e-2",
        "time.duration_s=5",
        "time.step_s=1e-6",
        "time.tolerance=1e-11",
        "recording.fields_s=0.25",
    ];
    let (_, all) = run("spring-slider", &sets);
    let mut seen = 0;
    for fields in fields(&all) {
        let theta_s = ((fields.state[0] - 0.6) / 0.015).exp();
        let expected_s = 1.0 + 9.0 * (-fields.time_s).exp();
        assert!((theta_s / expected_s - 1.0).abs() < 1e-6, "{}: {theta_s} for {expected_s}", fields.time_s);
        seen += 1;
    }
    assert!(seen > 19, "{seen}");
}

/// A drive may begin at rest, where the blocks have velocities: with the drive held for all of the run, and at rest by
/// its state alone.
#[test]
fn blocks_begin_to_move_behind_a_drive_at_rest() {
    let start = ["drive.velocity_m_per_s=0", "friction.initial_velocity_m_per_s=1e-6", "time.duration_s=20"];
    let (plan, all) = run("spring-slider", &start);
    let law = plan.friction.law.rate_and_state().unwrap();
    // max(10 V(0), V_dyn / 10), as no drive is faster.
    assert!((law.event_speed_m_per_s / (0.1 * DIRECT_N / law.radiation_kg_per_s) - 1.0).abs() < 1e-12);
    let v: Vec<f64> = fields(&all).iter().map(|at| at.velocity_m_per_s[0]).collect();
    // theta is that of steady sliding at V(0), and the spring unloads.
    assert!(
        (v[0] / 1e-6 - 1.0).abs() < 1e-9 && v.is_sorted_by(|a, b| a > b) && v[v.len() - 1] > 0.0,
        "{v:?}"
    );
    let rest = [
        "drive.velocity_m_per_s=0",
        "friction.initial_theta_s=3",
        "time.start=at-rest",
        "time.duration_s=20",
    ];
    let (plan, all) = run(
        "spring-slider",
        &[&rest[..], &["prestress.swing_ratio=0.1", "prestress.swing_period_s=1"]].concat(),
    );
    assert!((plan.initial.friction_state[0] - (0.6 + 0.015 * 3f64.ln())).abs() < 1e-14);
    assert!(fields(&all).iter().all(|at| at.velocity_m_per_s[0].abs() < 1e-12));
}

/// A handful of numbers of two codes of others, from free starts, friction at displacements of the drive and at times:
/// C. Marone's program as kept in the history of rsfmodel, one step of the velocity, and QDYN's test of steps.
#[test]
fn velocity_steps_are_those_of_other_codes() {
    let marone = [
        "friction.inertia=false",
        "friction.radiation_kg_per_s=1",
        "friction.direct_effect=0.005",
        "friction.evolution_effect=0.01",
        "friction.reference_velocity_m_per_s=1e-6",
        "friction.initial_velocity_m_per_s=1e-6",
        "friction.initial_theta_s=10",
        "drive.stiffness_n_per_m=1e9",
        "normal_load.total_n=1e6",
        "time.step_s=1e-6",
        "time.duration_s=30",
        "time.tolerance=1e-10",
        "recording.fields_s=0.01",
    ];
    let (plan, all) = run("spring-slider", &marone);
    let coefficient =
        |plan: &Plan, v: f64, state: f64| plan.friction.law.rate_and_state().unwrap().coefficient(v, state);
    let frictions: Vec<f64> =
        fields(&all).iter().map(|at| coefficient(&plan, at.velocity_m_per_s[0], at.state[0])).collect();
    let beyond = frictions.len() - 3001;
    for (way_um, expected) in [
        (0.1, 0.600089909),
        (0.2, 0.600179636),
        (99.4, 0.588571788),
        (99.7, 0.588577621),
        (199.5, 0.588488292),
        (298.5, 0.588487084),
    ] {
        let found = frictions[beyond + (way_um * 10.0_f64).round() as usize];
        assert!((found - expected).abs() < 3e-9, "{way_um}: {found} for {expected}");
    }

    let qdyn = [
        "friction.radiation_kg_per_s=5e6",
        "friction.direct_effect=0.001",
        "friction.evolution_effect=0.0015",
        "friction.reference_velocity_m_per_s=1e-6",
        "friction.initial_velocity_m_per_s=1e-5",
        "friction.initial_theta_s=0.5",
        "drive.stiffness_n_per_m=3e10",
        "drive.course_s=[10, 10, 15, 15]",
        "drive.course_m_per_s=[1e-5, 2e-5, 2e-5, 1e-5]",
        "time.step_s=1e-6",
        "time.duration_s=25",
        "time.tolerance=1e-10",
        "recording.fields_s=1e-3",
    ];
    let (plan, all) = run("spring-slider", &qdyn);
    let all = fields(&all);
    for (time_s, theta_s, friction) in [
        (0.0, 0.5, 0.597809),
        (1.0067413857640999, 0.8219931, 0.598549),
        (5.0005102291376, 0.9970444, 0.5988442),
        (10.10182159607481, 0.9158228, 0.5994216),
        (10.50236247086877, 0.6828017, 0.5989764),
        (12.0061170977826, 0.5083521, 0.5985274),
        (15.10063760816203, 0.5433375, 0.5979128),
        (16.0073795672716, 0.8199262, 0.5985452),
        (24.0639617066889, 0.9999537, 0.5988486),
    ] {
        let behind = all.partition_point(|at| at.time_s <= time_s).min(all.len() - 1);
        let (from, to) = (all[behind - 1], all[behind]);
        let share = (time_s - from.time_s) / (to.time_s - from.time_s);
        let between = |of: &dyn Fn(f64, f64) -> f64| {
            let [a, b] = [from, to].map(|at| of(at.velocity_m_per_s[0], at.state[0]));
            a + share * (b - a)
        };
        let found = between(&|v, state| coefficient(&plan, v, state));
        assert!((found - friction).abs() < 2e-7, "{time_s}: {found} for {friction}");
        // The reference velocity is 1 um/s: psi - f_0 = b ln(theta / 10 s).
        let found_s = 10.0 * (between(&|_, state| state - 0.6) / 0.0015).exp();
        assert!((found_s / theta_s - 1.0).abs() < 6e-6, "{time_s}: {found_s} for {theta_s}");
    }
}
