//! Rate-and-state friction: cycles and chains of independent programs (`fixtures/reference/laws`), closed forms, and
//! the two promises of the solver: its error follows the tolerance, and a restored run has the same bits.

use asperity_model::Plan;
use asperity_record::RunStatus;
use asperity_simulator::{Solver, SolverKind};
use asperity_testkit::{plan, reference};

use crate::fast_and_plain::{detachments, fields, last_energy, left_of, records, run, steps, windows};

fn solver(plan: &Plan) -> Box<dyn Solver> {
    SolverKind::Adaptive.start(plan.clone())
}

/// Times and blocks of the detachments: where the speed rises above the event speed.
fn onsets(plan: &Plan) -> Vec<(f64, u32)> {
    detachments(&records(solver(plan))).map(|(step, switch)| (step.time_s, switch.block)).collect()
}

fn number(cell: &str) -> f64 {
    cell.parse().unwrap_or_else(|_| panic!("{cell:?} is no number"))
}

/// A short fast part of a course, by which a force steps, hides no events; onsets from the design of the threshold.
#[test]
fn slips_behind_a_pulse_of_the_drive_are_events() {
    let pulse = [
        "drive.course_s=[110,110,110.001,110.001]",
        "drive.course_m_per_s=[1e-5,0.05001,0.05001,1e-5]",
        "time.duration_s=170",
        "time.tolerance=1e-9",
        "recording.fields_s=0",
    ];
    let all = onsets(&plan("spring-slider", &pulse));
    let found: Vec<f64> = all.iter().map(|(time_s, _)| *time_s).filter(|time_s| *time_s > 110.1).collect();
    let expected = [118.375160, 140.219350, 162.875369];
    assert_eq!(found.len(), expected.len(), "{all:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 2e-6, "{found} {expected}");
    }
}

/// Onsets and largest speed of an independent program.
#[test]
fn cycles_by_the_law_of_perrin_rice_and_zheng_are_those_of_another_program() {
    let sets =
        ["friction.evolution=prz", "time.duration_s=150", "time.tolerance=1e-10", "recording.fields_s=0"];
    let records = records(solver(&plan("spring-slider", &sets)));
    let found: Vec<f64> = detachments(&records).map(|(step, _)| step.time_s).collect();
    let expected = [81.836734, 93.284474, 113.934126, 134.561573];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 2e-6, "{found} {expected}");
    }
    let fastest =
        steps(&records).into_iter().filter_map(|step| step.peak_velocity_m_per_s).fold(0.0, f64::max);
    assert!((fastest / 0.865462 - 1.0).abs() < 1e-5, "{fastest}");
}

/// Onsets at the tolerance of the table's programs, which agree in nine digits.
#[test]
fn cycles_of_a_slider_are_those_of_other_integrators() {
    let s2 = [
        "friction.evolution_effect=0.025",
        "friction.reference_velocity_m_per_s=1e-6",
        "friction.radiation_kg_per_s=3333333.3333333335",
        "friction.initial_kick=2.995732273553991",
        "drive.velocity_m_per_s=1e-6",
        "time.duration_s=10000",
        "recording.sample_s=0",
        "recording.fields_s=0",
        "time.step_s=1e-7",
    ];
    let s3 = [
        "friction.inertia=true",
        "friction.radiation_kg_per_s=0",
        "friction.evolution_effect=0.02",
        "friction.critical_slip_m=1e-6",
        "friction.reference_velocity_m_per_s=1e-6",
        "friction.initial_kick=0.01",
        "slider.mass_kg=0.012",
        "drive.stiffness_n_per_m=8e5",
        "drive.velocity_m_per_s=1e-4",
        "normal_load.total_n=400",
        "time.duration_s=12",
        "time.step_s=1e-9",
    ];
    for (file, name, sets, digits_s) in [
        ("laws/rsf-cycles-qd.csv", "S1", &[][..], 2e-7),
        ("laws/rsf-cycles-qd.csv", "S2", &s2, 2e-6),
        ("laws/rsf-cycles-inertial.csv", "S3", &s3, 1e-8),
    ] {
        let sets = [sets, &["time.tolerance=1e-10"]].concat();
        let found = onsets(&plan("spring-slider", &sets));
        let rows = reference(file);
        let row = rows.iter().find(|row| row[0] == name).expect("the table has it");
        let [events, first_s, last_s, period_s] =
            [row.len() - 5, row.len() - 4, row.len() - 3, row.len() - 2].map(|n| number(&row[n]));
        // One that begins above the event speed counts for some of them as an event at time 0.
        let later: Vec<f64> =
            found.iter().map(|(time_s, _)| *time_s).filter(|time_s| *time_s > 1e-3).collect();
        assert_eq!(later.len() as f64, events, "{name}");
        let [.., before_s, end_s] = later[..] else { panic!("{name}: {later:?}") };
        for (found_s, expected_s) in [(later[0], first_s), (end_s, last_s), (end_s - before_s, period_s)] {
            assert!((found_s - expected_s).abs() < digits_s, "{name}: {found_s} for {expected_s}");
        }
    }
}

/// Every onset of every block.
#[test]
fn chains_slip_as_by_other_integrators() {
    // b_n = b (1 + 0.2 sin n).
    let offsets: Vec<f64> = (1..=6).map(|n| 0.2 * 0.016 * f64::from(n).sin()).collect();
    let offsets = format!("friction.evolution_offsets={offsets:?}");
    let chain_6 = [
        "slider.blocks=6",
        "slider.length_m=0.05",
        "slider.mass_kg=0.03",
        "slider.youngs_modulus_pa=1e8",
        "slider.relative_damping=0.09899494936611666",
        "friction.evolution_effect=0.016",
        &offsets,
        "friction.critical_slip_m=1e-6",
        "drive.stiffness_n_per_m=1.2e5",
        "normal_load.total_n=120",
        "time.duration_s=4",
    ];
    for (file, sets, error_s) in
        [("laws/rsf-chain-top-16.csv", &[][..], 4e-10), ("laws/rsf-chain-top-6.csv", &chain_6, 4e-10)]
    {
        let sets = [sets, &["time.tolerance=1e-9", "time.step_s=1e-10"]].concat();
        let mut found = onsets(&plan("rate-and-state", &sets));
        let mut expected: Vec<(f64, u32)> =
            reference(file).iter().map(|row| (number(&row[2]), row[1].parse().unwrap())).collect();
        assert!(expected.len() >= 12, "{file}");
        assert_eq!(found.len(), expected.len(), "{file}");
        // The table's order within an event is by its own steps.
        for list in [&mut found, &mut expected] {
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let worst = found.iter().zip(&expected).map(|(found, expected)| {
            assert_eq!(found.1, expected.1, "{file} at {}", expected.0);
            (found.0 - expected.0).abs()
        });
        let worst: Vec<f64> = worst.collect();
        let worst_s = worst.into_iter().fold(0.0, f64::max);
        assert!(worst_s < error_s, "{file}: {worst_s}");
    }
}

/// The largest speed of each slip, which does not depend on what is recorded.
#[test]
fn slips_have_the_peaks_of_another_integrator() {
    let peaks = |sets: &[&str]| {
        let all = records(solver(&plan("rate-and-state", sets)));
        let mut peaks = Vec::new();
        let (mut slid, mut before) = (false, 0.0);
        for step in steps(&all) {
            let peak = step.peak_velocity_m_per_s.expect("the law has a state");
            match (step.sliding > 0, slid) {
                (true, false) => peaks.push(f64::max(peak, before)),
                (true, true) => *peaks.last_mut().unwrap() = peak.max(*peaks.last().unwrap()),
                _ => {}
            }
            (slid, before) = (step.sliding > 0, peak);
        }
        peaks
    };
    let found = peaks(&["time.tolerance=1e-8"]);
    let rows = reference("laws/rsf-chain-top-16.csv");
    assert_eq!(found.len(), 5);
    for (event, found) in (1..).zip(&found) {
        let of_event = rows.iter().filter(|row| number(&row[0]) == f64::from(event));
        let expected = of_event.map(|row| number(&row[4])).fold(0.0, f64::max);
        assert!((found / expected - 1.0).abs() < 1e-4, "{event}: {found} for {expected}");
    }
    // Records in the middle of steps leave what lies between them, and one grid step may contain all of a slip.
    for set in ["recording.sample_s=1e-5", "time.step_s=1e-3"] {
        let others = peaks(&["time.tolerance=1e-8", set, "time.duration_s=2"]);
        assert_eq!(others.len(), 2, "{set}");
        for (other, found) in others.iter().zip(&found) {
            assert!((other / found - 1.0).abs() < 1e-12, "{set}: {other} for {found}");
        }
    }
}

/// The error falls with the tolerance, and steps are as many as an independent program takes (5,655, 9,979 and
/// 17,752).
#[test]
fn steps_and_errors_follow_the_tolerance() {
    let run = |tolerance: &str| {
        let sets = [&format!("time.tolerance={tolerance}")[..], "time.step_s=1e-10"];
        let mut solver = solver(&plan("rate-and-state", &sets));
        let records = left_of(&mut *solver);
        let found: Vec<f64> = detachments(&records).map(|(step, _)| step.time_s).collect();
        (found, solver.counters().adaptive_steps)
    };
    let (exact, _) = run("1e-9");
    for (tolerance, steps, error_s) in [("1e-5", 5655, 8e-8), ("1e-6", 9979, 8e-9), ("1e-7", 17752, 1e-9)] {
        let (found, taken) = run(tolerance);
        assert!(taken as f64 <= 1.05 * f64::from(steps), "{tolerance}: {taken} steps");
        assert_eq!(found.len(), exact.len());
        let worst_s = found.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst_s < error_s, "{tolerance}: {worst_s}");
    }
}

/// Without inertia and at the critical stiffness, steady sliding is a centre: every amplitude has its own period, which
/// follows from the first integral (Ranjith and Rice 1999).
#[test]
fn at_the_critical_stiffness_each_amplitude_has_its_period() {
    for row in reference("laws/rsf-first-integral.csv") {
        let [kick, _, period_s, highest] = [0, 1, 2, 3].map(|n| number(&row[n]));
        let sets = [
            format!("friction.initial_kick={kick}"),
            "drive.stiffness_n_per_m=2.5e9".to_owned(),
            "friction.radiation_kg_per_s=1e-3".to_owned(),
            "time.tolerance=1e-10".to_owned(),
            "time.duration_s=60".to_owned(),
            "time.step_s=1e-6".to_owned(),
            "recording.window=[{ from_s = 0, to_s = 60, every_s = 1e-4, first_block = 1, last_block = 1 }]"
                .to_owned(),
        ];
        let all = records(solver(&plan("spring-slider", &sets)));
        let ln = windows(&all).into_iter();
        let ln: Vec<(f64, f64)> =
            ln.map(|window| (window.time_s, (window.velocity_m_per_s[0] / 1e-5).ln())).collect();
        let upwards: Vec<f64> = ln
            .windows(2)
            .filter(|pair| pair[0].1 < 0.0 && pair[1].1 >= 0.0)
            .map(|pair| pair[0].0 - pair[0].1 * (pair[1].0 - pair[0].0) / (pair[1].1 - pair[0].1))
            .collect();
        let periods = upwards.windows(2).map(|pair| pair[1] - pair[0]);
        for found_s in periods {
            assert!((found_s - period_s).abs() < 1e-6 * period_s, "x = {kick}: {found_s} for {period_s}");
        }
        assert!(upwards.len() > 2, "x = {kick}");
        let found = ln.iter().fold(0.0, |most: f64, (_, ln)| most.max(*ln));
        assert!((found / highest - 1.0).abs() < 5e-3, "x = {kick}: {found} for {highest}");
    }
}

/// What is put in is dissipated or stored, to the error of the tolerance.
#[test]
fn energies_close_to_the_tolerance() {
    for (tolerance, share) in [("1e-6", 3e-6), ("1e-8", 3e-8)] {
        for sets in [
            &["friction.radiation_kg_per_s=3"][..],
            &["friction.evolution=slip", "drive.kind=side", "drive.stiffness_n_per_m=4e6"],
            &["friction.inertia=false", "friction.radiation_kg_per_s=20", "slider.relative_damping=0"],
            &["normal_load.schedule_s=[0.1, 0.9]", "normal_load.schedule_n=[400, 300]"],
            &["drive.course_s=[0.2, 0.3, 0.3, 0.5]", "drive.course_m_per_s=[1e-4, 1e-3, 1e-5, 3e-4]"],
        ] {
            let tolerance = format!("time.tolerance={tolerance}");
            let sets = [sets, &[&tolerance, "time.duration_s=1.2", "recording.sample_s=0.01"]].concat();
            let all = records(solver(&plan("rate-and-state", &sets)));
            let balances_j: Vec<f64> = steps(&all).iter().map(|step| step.energy.balance_j()).collect();
            let worst_j =
                balances_j.iter().fold(0.0, |most: f64, at_j| most.max((at_j - balances_j[0]).abs()));
            let last = last_energy(&all);
            let largest_j = last.drive_work_j.abs();
            assert!(worst_j < share * largest_j, "{sets:?}: {worst_j} of {largest_j}");
            assert!(last.friction_heat_j > 0.1 * largest_j, "{sets:?}");
        }
    }
}

/// A stiff machine whose velocity steps: the state follows its slip in closed form, the ageing law by
/// `theta = Dc / V2 + (Dc / V1 - Dc / V2) exp(-d / Dc)`, the slip law by `ln(V2 theta / Dc) = ln(V2 / V1) exp(-d / Dc)`;
/// at rest the ageing law heals by `theta = theta_0 + t`; by prz `V2 theta / 2 Dc` goes from `r = V2 / V1` on as
/// `(r + w) / (1 + r w)`, with `w = tanh(d / 2 Dc)`.
#[test]
fn the_state_follows_velocity_steps_and_holds_in_closed_form() {
    for evolution in ["ageing", "slip", "prz"] {
        let law = format!("friction.evolution={evolution}");
        let sets = [
            &law[..],
            "friction.initial_kick=0",
            "drive.stiffness_n_per_m=1e18",
            "friction.event_speed_m_per_s=1e-2",
            "friction.radiation_kg_per_s=1",
            "time.tolerance=1e-11",
            "drive.course_s=[1, 1]",
            "drive.course_m_per_s=[1e-5, 1e-4]",
            "time.duration_s=1.3",
            "time.step_s=1e-6",
            "recording.fields_s=0.05",
            "recording.sample_s=0",
        ];
        let records = records(solver(&plan("spring-slider", &sets)));
        let (v1, v2, slip_m, b, v0) = (1e-5_f64, 1e-4_f64, 1e-5, 0.015, 1e-5);
        let worn = |d: f64| (0.5 * d / slip_m).tanh();
        let mut checked = 0;
        for fields in fields(&records).into_iter().filter(|fields| fields.time_s > 1.0) {
            let d = (fields.time_s - 1.0) * v2;
            let decay = (-d / slip_m).exp();
            let expected = match evolution {
                "ageing" => (slip_m / v2 + (slip_m / v1 - slip_m / v2) * decay) * v0 / slip_m,
                "prz" => (v2 / v1 + worn(d)) / (1.0 + v2 / v1 * worn(d)) * v0 / v2,
                _ => ((v2 / v1).ln() * decay).exp() * v0 / v2,
            };
            let found = ((fields.state[0] - 0.6) / b).exp();
            assert!((found / expected - 1.0).abs() < 1e-6, "{evolution} {d}: {found} for {expected}");
            checked += 1;
        }
        assert!(checked >= 5);
    }
}

/// A held load point, without inertia: with `w = ln(V theta / Dc)` and the slip `d`, the slip law gives
/// `w = k / k_c + (w_0 - k / k_c) exp((b - a) d / (a Dc))`, so that a slider runs away if and only if `w_0 > k / k_c`, however
/// stiff (Gu et al. 1984); by the ageing law `w` only falls above `k_c`.
#[test]
fn a_held_slider_runs_away_beyond_a_threshold() {
    let run = |evolution: &str, kick: f64| {
        let sets = [
            format!("friction.evolution={evolution}"),
            format!("friction.initial_kick={kick}"),
            // 1.5 k_c.
            "drive.stiffness_n_per_m=3.75e9".to_owned(),
            "friction.radiation_kg_per_s=1e-3".to_owned(),
            "time.tolerance=1e-10".to_owned(),
            "time.step_s=1e-9".to_owned(),
            "time.duration_s=4".to_owned(),
            "drive.hold_from_s=1e-9".to_owned(),
            "recording.fields_s=1e-2".to_owned(),
        ];
        let records = records(solver(&plan("spring-slider", &sets)));
        let (a, b, slip_m, v0) = (0.01, 0.015, 1e-5, 1e-5);
        let (mut from_m, mut slips, mut worst) = (None, 0.0_f64, 0.0_f64);
        let (mut last, mut rise) = (f64::INFINITY, f64::NEG_INFINITY);
        for fields in fields(&records) {
            let (u, v, state) = (fields.displacement_m[0], fields.velocity_m_per_s[0], fields.state[0]);
            let d = u - *from_m.get_or_insert(u);
            slips = slips.max(d / slip_m);
            // Radiation bounds the velocity of a slip, which ends far beyond balance.
            if slips > 15.0 {
                break;
            }
            let w = (v / v0).ln() + (state - 0.6) / b;
            let expected = 1.5 + (kick - 1.5) * ((b - a) * d / (a * slip_m)).exp();
            worst = worst.max((w - expected).abs());
            rise = rise.max(w - last);
            last = w;
        }
        (slips, worst, rise)
    };
    for (kick, runs_away) in [(1.4, false), (1.6, true)] {
        let (slips, worst, rise) = run("slip", kick);
        assert_eq!(slips > 15.0, runs_away, "{kick}: {slips}");
        assert!(worst < 1e-6, "{kick}: {worst}");
        assert_eq!(rise > 0.0, runs_away, "{kick}: {rise}");
    }
    for kick in [1.6, 6.0] {
        let (_, _, rise) = run("ageing", kick);
        assert!(rise < 0.0, "{kick}: {rise}");
    }
}

/// A uniform chain whose start is uniform is one slider, block by block.
#[test]
fn a_uniform_chain_is_a_slider() {
    let zeros = "friction.evolution_offsets=[0,0,0,0]";
    let chain = [
        "slider.blocks=4",
        zeros,
        "slider.length_m=0.03",
        "slider.mass_kg=0.004",
        "drive.stiffness_n_per_m=2e5",
    ];
    let chain =
        [&chain[..], &["normal_load.total_n=100", "time.duration_s=2.5", "time.tolerance=1e-9"]].concat();
    let found = onsets(&plan("rate-and-state", &chain));
    let one = [
        "slider.blocks=1",
        "friction.evolution_offsets=[]",
        "slider.mass_kg=0.001",
        "drive.stiffness_n_per_m=5e4",
    ];
    let one = [
        &one[..],
        &[
            "normal_load.total_n=25",
            "slider.relative_damping=0",
            "time.duration_s=2.5",
            "time.tolerance=1e-9",
        ],
    ]
    .concat();
    let alone = onsets(&plan("rate-and-state", &one));
    assert!(alone.len() >= 2 && found.len() == 4 * alone.len(), "{} {}", found.len(), alone.len());
    for (n, (time_s, _)) in found.iter().enumerate() {
        assert!((time_s - alone[n / 4].0).abs() < 5e-8, "{time_s} for {}", alone[n / 4].0);
    }
}

/// A spring of 1e30 N/m swings so fast that a run of milliseconds would take days.
#[test]
fn a_run_whose_steps_no_longer_end_is_stopped() {
    let plan = plan("spring-slider", &["drive.stiffness_n_per_m=1e30", "friction.inertia=true"]);
    let error = run(&plan, SolverKind::Adaptive).2.expect("it is to be stopped");
    assert_eq!(error.status(), RunStatus::StoppedStalled);
}

/// One course for the loads of all contacts is the course of the load.
#[test]
fn loads_of_contacts_that_change_alike_are_the_load() {
    let onsets_of = |load: [&str; 2]| {
        let sets = [&["time.duration_s=3", "recording.fields_s=0"][..], &load].concat();
        onsets(&plan("rate-and-state", &sets))
    };
    let total = plan::<&str>("rate-and-state", &[]).total_normal_load_n;
    let schedule = format!("normal_load.schedule_n=[{total},{}]", 0.7 * total);
    let of_all = onsets_of(["normal_load.schedule_s=[0.5,2.5]", &schedule]);
    let of_each = onsets_of(["normal_load.course_s=[0.5,2.5]", "normal_load.course_factor=[1,0.7]"]);
    assert!(of_all.len() > 5 && of_all.len() == of_each.len(), "{} {}", of_all.len(), of_each.len());
    for (all, each) in of_all.iter().zip(&of_each) {
        assert!(all.1 == each.1 && (all.0 - each.0).abs() < 1e-8, "{all:?} {each:?}");
    }
}

/// In steady sliding with friction that grows with velocity, each contact bears its own load times steady friction, and
/// the energies close.
#[test]
fn steady_friction_follows_the_load_of_each_contact() {
    let sets = [
        "slider.blocks=3",
        "drive.kind=top",
        "friction.evolution_offsets=[]",
        "friction.direct_effect=0.02",
        "friction.evolution_effect=0.01",
        "friction.initial_kick=0",
        "time.duration_s=4",
        "time.tolerance=1e-9",
        "normal_load.course_s=[1,3]",
        "normal_load.course_factor=[1,1,1,0.5,1.5,0.8]",
        "recording.fields_s=0.5",
    ];
    let plan = plan("rate-and-state", &sets);
    let law = plan.friction.law.rate_and_state().unwrap();
    let v_m_per_s = plan.drive.velocity_m_per_s;
    let steady = law.coefficient(v_m_per_s, law.steady_state(law.evolution_effect, v_m_per_s));
    let records = records(solver(&plan));
    let mut seen = 0;
    for fields in fields(&records).into_iter().filter(|fields| !(0.9..3.4).contains(&fields.time_s)) {
        seen += 1;
        let factors = if fields.time_s > 2.0 { [0.5, 1.5, 0.8] } else { [1.0; 3] };
        for (n, factor) in factors.into_iter().enumerate() {
            let load_n = factor * plan.normal_load_n[n];
            assert!((fields.normal_load_n[n] / load_n - 1.0).abs() < 1e-12);
            let ratio = fields.tangential_force_n[n] / load_n;
            assert!(
                (ratio / steady - 1.0).abs() < 1e-6,
                "block {n} at {}: {ratio}, not {steady}",
                fields.time_s
            );
        }
    }
    assert!(seen > 3, "{seen}");
}
