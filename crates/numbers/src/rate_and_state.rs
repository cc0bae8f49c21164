//! Rate-and-state friction of a run: what theory says of steady sliding, of steps and holds of the drive and of
//! small oscillations (docs/contacts.md), and what loads say of them.

use std::f64::consts::{PI, TAU};

use asperity_model::{Evolution, RateAndState, Stability};

use crate::run_data::{Load, RunEvents};

/// The law, with the mean `b` of the contacts.
fn law(run: &RunEvents) -> Option<(RateAndState, f64)> {
    let law = run.plan.friction.law.rate_and_state()?;
    let effects = &run.plan.friction.evolution_effects;
    Some((law, effects.iter().sum::<f64>() / effects.len() as f64))
}

/// The step from which the drive rests or the run has ended.
fn last_step(run: &RunEvents) -> u64 {
    run.plan.drive.hold_from_step.unwrap_or(u64::MAX).min(run.plan.steps)
}

/// The velocity of the drive at the start and at the end of the run, m/s; 0 where it has been stopped.
fn velocities_m_per_s(run: &RunEvents) -> [f64; 2] {
    let plan = &run.plan;
    let hold_step = plan.drive.hold_from_step.unwrap_or(u64::MAX);
    [plan.drive.velocity_m_per_s, plan.outside(plan.steps, hold_step).velocity_m_per_s()]
}

/// Friction over normal load of steady sliding at the last velocity of the drive.
pub(crate) fn steady_ratio(run: &RunEvents) -> Option<f64> {
    let (law, b) = law(run)?;
    let velocity_m_per_s = velocities_m_per_s(run)[1];
    let state = law.steady_state(b, velocity_m_per_s);
    (velocity_m_per_s > 0.0).then(|| law.coefficient(velocity_m_per_s, state))
}

/// Longest time for which the drive rests by its course before it moves again within the run, s; 0 if it never does.
pub(crate) fn hold_s(run: &RunEvents) -> Option<f64> {
    run.plan.friction.law.rate_and_state()?;
    let drive = &run.scenario.drive;
    let knots: Vec<(f64, f64)> =
        drive.course_s.iter().copied().zip(drive.course_m_per_s.iter().copied()).collect();
    let rests = knots.chunk_by(|(_, before), (_, after)| *before == 0.0 && *after == 0.0);
    // What follows the last knot of a rest ends it, as a jump or a ramp.
    let ends_before = |rest: &&[(f64, f64)]| rest[rest.len() - 1].0 < run.plan.grid.time_s(last_step(run));
    let last_s = knots.last().map_or(0.0, |(time_s, _)| *time_s);
    let moves_on = drive.course_m_per_s.last().is_some_and(|m_per_s| *m_per_s > 0.0);
    let is_hold = |rest: &&[(f64, f64)]| rest[0].1 == 0.0 && (moves_on || rest[rest.len() - 1].0 < last_s);
    let holds = rests.filter(ends_before).filter(is_hold);
    Some(holds.map(|rest| rest[rest.len() - 1].0 - rest[0].0).fold(0.0, f64::max))
}

/// Friction over normal load at the last velocity of the drive with the state of steady sliding at the first one and
/// of the longest hold: contacts age by its length, or do not change.
pub(crate) fn peak_ratio(run: &RunEvents) -> Option<f64> {
    let (law, b) = law(run)?;
    let [before_m_per_s, after_m_per_s] = velocities_m_per_s(run);
    let aged_s = match law.evolution {
        Evolution::Slip => 0.0,
        Evolution::Ageing | Evolution::Prz => hold_s(run)?,
    };
    let aged = aged_s / law.steady_theta_s(before_m_per_s);
    let state = law.steady_state(b, before_m_per_s) + b * libm::log1p(aged);
    (before_m_per_s > 0.0 && after_m_per_s > 0.0).then(|| law.coefficient(after_m_per_s, state))
}

/// `F_T / F_N` at a time, linear in time between records.
pub(crate) fn ft_fn_at(loads: &[Load], at_s: f64) -> Option<f64> {
    let behind = loads.partition_point(|load| load.time_s < at_s);
    let after = loads.get(behind)?;
    if after.time_s == at_s {
        return Some(after.load_ratio());
    }
    let before = &loads[behind.checked_sub(1)?];
    let share = (at_s - before.time_s) / (after.time_s - before.time_s);
    Some(before.load_ratio() + share * (after.load_ratio() - before.load_ratio()))
}

/// The stiffness of the drive per block over `k_c`.
pub(crate) fn stiffness_over_critical(run: &RunEvents) -> Option<f64> {
    let critical_n_per_m = Stability::of(&run.plan)?.critical_stiffness_n_per_m;
    (critical_n_per_m > 0.0).then(|| drive_n_per_m(run) / critical_n_per_m)
}

fn drive_n_per_m(run: &RunEvents) -> f64 {
    let springs = &run.plan.drive.springs;
    springs.iter().map(|spring| spring.stiffness_n_per_m).sum::<f64>() / run.plan.blocks as f64
}

/// By how much oscillations of `F_T / F_N` grow per radian: the logarithm of the last rise or fall over the first
/// one, over pi times the number of half periods between them. Turning points are those of parabolas through three
/// records, which may be apart by any number of steps.
pub(crate) fn growth(loads: &[Load]) -> Option<f64> {
    let mut turns = Vec::new();
    for three in loads.windows(3) {
        let [low, middle, high] = [0, 1, 2].map(|n| three[n].load_ratio());
        let [before, after] = [0, 1].map(|n| (three[n + 1].step - three[n].step) as f64);
        if (middle - low) * (high - middle) < 0.0 {
            // In units of the mean distance; equal distances leave the usual second difference.
            let [left, right] = [before, after].map(|distance| 0.5 * (before + after) / distance);
            let uneven = (after - before) * ((middle - low) / before - (high - middle) / after);
            let rise = (high - low) + uneven;
            let bend = right * high - (left + right) * middle + left * low;
            turns.push(middle - rise.powi(2) / (8.0 * bend));
        }
    }
    let swings: Vec<f64> = turns.windows(2).map(|ends| (ends[1] - ends[0]).abs()).collect();
    let [first, .., last] = &swings[..] else { return None };
    Some((last / first).ln() / (PI * (swings.len() - 1) as f64))
}

/// Growth per radian of small oscillations about steady sliding, in theory: the real part over the imaginary part of the
/// pair of roots of the cubic of [`RateAndState::cubic`], for a slider of one block; none if they are real.
pub(crate) fn growth_theory(run: &RunEvents) -> Option<f64> {
    let [mass_kg, square, linear, constant] = cubic(run)?;
    // Of the pair, half its sum and its product. The third root is far to the left, where this iteration converges
    // to it; from it and the coefficients without difference of large numbers (Vieta).
    let (half_sum, product) = if mass_kg > 0.0 {
        let mut third = -square / mass_kg;
        for _ in 0..200 {
            third = -(square + linear / third + constant / (third * third)) / mass_kg;
        }
        let product = -constant / (mass_kg * third);
        ((linear / mass_kg - product) / (2.0 * third), product)
    } else {
        (-linear / (2.0 * square), constant / square)
    };
    let imaginary_squared = product - half_sum * half_sum;
    (imaginary_squared > 0.0).then(|| half_sum / imaginary_squared.sqrt())
}

/// The coefficients of [`RateAndState::cubic`], for a slider of one block that slides steadily.
fn cubic(run: &RunEvents) -> Option<[f64; 4]> {
    let (law, b) = law(run).filter(|_| run.plan.blocks == 1)?;
    let mass_kg = if law.inertia { run.plan.block_mass_kg } else { 0.0 };
    let (v, load_n) = (run.plan.drive.velocity_m_per_s, run.plan.total_normal_load_n);
    Some(law.cubic(v, drive_n_per_m(run), load_n, b, mass_kg, law.radiation_kg_per_s))
}

/// Of the velocity of one block in the last period of a swing of the prestress, by `V - V_l = -F_T' / K`: amplitude over
/// `V_l`, and phase of its cosine, rad, where the force is a sine. None unless records are evenly apart in whole parts of the period, as sums are exact then.
pub(crate) fn swing(run: &RunEvents, loads: &[Load]) -> Option<[f64; 2]> {
    let swing = run.plan.swing.filter(|_| run.plan.blocks == 1)?;
    let (end, period) = (loads.last()?.step, run.plan.grid.nearest_step(swing.period_s));
    let last = &loads[loads.partition_point(|load| load.step + period <= end)..];
    let is_even = |two: &[Load]| (two[1].step - two[0].step) * last.len() as u64 == period;
    let sum = |n: usize| last.iter().map(|load| load.driving_force_n * swing.at(load.time_s)[n]).sum::<f64>();
    let (sine, cosine) = (TAU / swing.period_s * sum(0), sum(1));
    let full = 0.5 * last.len() as f64 * (drive_n_per_m(run) * run.plan.drive.velocity_m_per_s) * swing.ratio;
    let found = [sine.hypot(cosine) / full.abs(), libm::atan2(-cosine, -sine)];
    (last.len() > 2 && last.windows(2).all(is_even)).then_some(found)
}

/// That amplitude in theory, to first order: `V = i w Q / (K + i w Z)`, `Z = i w m + (p / V_l) (a - b / (1 + i w D_c / V_l))
/// + E`; the cubic at `i w` is `(K + i w Z) (i w + V_l / D_c)`.
pub(crate) fn swing_theory(run: &RunEvents) -> Option<f64> {
    let (swing, [cube, square, linear, constant]) = (run.plan.swing?, cubic(run)?);
    let (per_s, v) = (TAU / swing.period_s, run.plan.drive.velocity_m_per_s);
    let cubic = (constant - square * per_s.powi(2)).hypot(per_s * (linear - cube * per_s.powi(2)));
    let force_n = swing.ratio.abs() * run.plan.total_normal_load_n;
    Some(per_s * force_n * per_s.hypot(v / law(run)?.0.critical_slip_m) / (cubic * v))
}

#[cfg(test)]
mod tests {
    use crate::made_up;
    use crate::number::number;
    use crate::run_data::{Load, RunData};

    fn slider(keys: &str) -> RunData {
        let law = "friction.law = \"rate-and-state\"\nfriction.direct_effect = 0.01\n\
                   friction.evolution_effect = 0.015\nfriction.critical_slip_m = 1e-5\n\
                   friction.reference_velocity_m_per_s = 1e-5\nslider.relative_damping = 0\ntime.duration_s = 20";
        let stays = |line: &&str| line.split(" =").next().is_some_and(|key| !keys.contains(key));
        let law: Vec<&str> = law.lines().filter(stays).collect();
        let mut run = made_up::run(&format!("{}\n{keys}", law.join("\n")), &[]);
        run.plan.friction.evolution_effects.truncate(1);
        run.plan.blocks = 1;
        run.plan.normal_load_n = vec![run.plan.total_normal_load_n];
        run
    }

    fn close(found: Option<f64>, expected: f64) {
        assert!(found.is_some_and(|found| (found - expected).abs() < 1e-12), "{found:?} {expected}");
    }

    fn with_loads(ft_fn: impl Iterator<Item = (f64, f64)>) -> RunData {
        let mut run = made_up::run("", &[]);
        run.loads = ft_fn
            .map(|(time_s, ft_fn)| Load {
                step: run.plan.grid.nearest_step(time_s),
                time_s,
                driving_force_n: 100.0 * ft_fn,
                normal_load_n: 100.0,
                end_forces_n: None,
                sliding: 0,
            })
            .collect();
        run
    }

    #[test]
    fn friction_of_steady_sliding_steps_and_holds_is_that_of_the_logarithms() {
        let steady = slider("drive.velocity_m_per_s = 1e-4");
        close(number("steady_friction_theory_ratio", &steady, None), 0.6 - 0.005 * 10f64.ln());
        assert_eq!(number("hold_s", &steady, None), Some(0.0));
        let step =
            "drive.velocity_m_per_s = 1e-5\ndrive.course_s = [1, 1]\ndrive.course_m_per_s = [1e-5, 1e-4]";
        let run = slider(step);
        close(number("steady_friction_theory_ratio", &run, None), 0.6 - 0.005 * 10f64.ln());
        close(number("peak_friction_theory_ratio", &run, None), 0.6 + 0.01 * 10f64.ln());
        let hold = "drive.velocity_m_per_s = 1e-5\ndrive.course_s = [1, 1, 8, 8]\n\
                    drive.course_m_per_s = [1e-5, 0, 0, 1e-5]";
        let run = slider(hold);
        assert_eq!(number("hold_s", &run, None), Some(7.0));
        // A knot within the hold, and a shorter hold after it.
        let several = "drive.velocity_m_per_s = 1e-5\ndrive.course_s = [1, 1, 3, 8, 8, 9, 9, 11, 11]\n\
                       drive.course_m_per_s = [1e-5, 0, 0, 0, 1e-5, 1e-5, 0, 0, 1e-5]";
        assert_eq!(number("hold_s", &slider(several), None), Some(7.0));
        close(number("peak_friction_theory_ratio", &run, None), 0.6 + 0.015 * 8f64.ln());
        let run = slider(&format!("{hold}\nfriction.evolution = \"slip\""));
        close(number("peak_friction_theory_ratio", &run, None), 0.6);
        for name in [
            "steady_friction_theory_ratio",
            "peak_friction_theory_ratio",
            "oscillation_growth_theory_ratio",
            "hold_s",
        ] {
            assert_eq!(number(name, &made_up::run("", &[]), None), None, "{name}");
        }
    }

    /// A drive that rests at the end has no steady sliding then, and its rest is no hold.
    #[test]
    fn a_drive_that_stops_for_good_has_neither_steady_friction_nor_a_hold() {
        let hold = "drive.velocity_m_per_s = 1e-5\ndrive.course_s = [1, 1, 8, 8]\n\
                    drive.course_m_per_s = [1e-5, 0, 0, 1e-5]\n";
        for (keys, hold_s) in [
            ("drive.velocity_m_per_s = 1e-5\ndrive.hold_from_s = 2", 0.0),
            (&format!("{hold}drive.hold_from_s = 9"), 7.0),
            (&format!("{hold}drive.hold_from_s = 7"), 0.0),
            (&format!("{hold}time.duration_s = 7"), 0.0),
            (&hold.replace("0, 0, 1e-5]", "0, 0, 0]"), 0.0),
        ] {
            let run = slider(keys);
            assert_eq!(number("hold_s", &run, None), Some(hold_s), "{keys}");
            for name in ["steady_friction_theory_ratio", "peak_friction_theory_ratio"] {
                assert_eq!(number(name, &run, None), None, "{name}: {keys}");
            }
        }
        // A stop after the end of the run is none.
        let run = slider("drive.velocity_m_per_s = 1e-5\ntime.duration_s = 7\ndrive.hold_from_s = 9");
        close(number("steady_friction_theory_ratio", &run, None), 0.6);
    }

    /// A number of an independent program; a velocity in closed form gives back its amplitude and phase.
    #[test]
    fn swings_of_the_velocity_are_those_of_the_force_of_the_spring() {
        let mut run = slider(
            "friction.direct_effect = 0.015\nfriction.evolution_effect = 0.010\nfriction.inertia = false\n\
             friction.radiation_kg_per_s = 1\ndrive.velocity_m_per_s = 1e-5\nprestress.swing_ratio = 1.5e-5\n\
             prestress.swing_period_s = 10\nprestress.swing_from_s = 1",
        );
        run.plan.total_normal_load_n = 5e6;
        run.plan.drive.springs[0].stiffness_n_per_m = 2e9;
        let theory = number("swing_velocity_theory_ratio", &run, None).unwrap();
        assert!((theory / 1.863669e-3 - 1.0).abs() < 1e-6, "{theory}");
        let per_s = 0.2 * std::f64::consts::PI;
        let force = |time_s: f64| 3e6 - 2e4 * 1.9e-3 / per_s * (per_s * (time_s - 1.0) - 1.3).sin();
        let of = |time_s: f64| (time_s, force(time_s) / 100.0);
        run.loads = with_loads((0..=400).map(|n| of(f64::from(n) * 0.05))).loads;
        let found = ["swing_velocity_ratio", "swing_phase_rad"].map(|name| number(name, &run, None).unwrap());
        assert!((found[0] / 1.9e-3 - 1.0).abs() < 1e-9 && (found[1] + 1.3).abs() < 1e-9, "{found:?}");
        run.loads.remove(390);
        assert_eq!(number("swing_velocity_ratio", &run, None), None, "not evenly apart");
        run.plan.swing = None;
        for name in ["swing_velocity_ratio", "swing_phase_rad", "swing_velocity_theory_ratio"] {
            assert_eq!(number(name, &run, None), None, "{name}");
        }
    }

    /// It has neither `mu_s` nor `mu_d`, and nothing decays along a chain without friction springs.
    #[test]
    fn numbers_of_what_sticks_are_absent() {
        let law = "friction.law = \"rate-and-state\"\n";
        let keys = "drive.kind = \"top\"\ndrive.decay_length_m = 0.02\n";
        let of = |toml: &str| made_up::run(&format!("{keys}{toml}"), &made_up::EVENTS);
        let sticks = of("");
        let with_states = |mut run: RunData| {
            let state = |step: u64| asperity_record::FieldRecord {
                step,
                time_s: run.plan.grid.time_s(step),
                displacement_m: vec![0.0; 3],
                velocity_m_per_s: vec![0.0; 3],
                tangential_force_n: vec![3.0, 2.0, 1.0],
                stick_position_m: vec![0.0; 3],
                detached: vec![0; 3],
                ..asperity_record::FieldRecord::default()
            };
            let steps = [100, 101, 200, 210, 300, 310, 400, 410, 412, 420, 500, 510, 600, 610];
            let states: Vec<_> = steps.into_iter().map(state).collect();
            made_up::with_states(&mut run, &states);
            run
        };
        let (sticks, slides) = (with_states(sticks), with_states(of(law)));
        let rigid = with_states(of("friction.law = \"rigid\""));
        let of_springs = [
            "affected_blocks_theory",
            "affected_blocks_error",
            "onset_profile_error_ratio",
            "first_event_decaying_drive_error_ratio",
        ];
        for name in of_springs {
            assert!(number(name, &sticks, None).is_some(), "{name}");
            assert_eq!([number(name, &slides, None), number(name, &rigid, None)], [None, None], "{name}");
        }
        for name in [
            "coefficient_ratio",
            "first_global_event_load_error_ratio",
            "global_event_middle_error_ratio",
            "largest_global_event_drop_middle_error_ratio",
            "ahead_of_event_front_error_ratio",
            "event_residual_balance_ratio",
            "event_slope_error_balance_ratio",
            "law_end_error_initial_shear_ratio",
        ] {
            assert!(number(name, &sticks, None).is_some(), "{name}");
            assert_eq!(number(name, &slides, None), None, "{name}");
        }
    }

    #[test]
    fn the_load_at_a_time_is_between_records() {
        let run = with_loads([(0.0, 0.1), (2.0, 0.3), (2.0, 0.5), (4.0, 0.5)].into_iter());
        for (at_s, expected) in [(0.0, 0.1), (1.0, 0.2), (2.0, 0.3), (3.0, 0.5), (4.0, 0.5)] {
            close(number("at_time_ft_fn", &run, Some(at_s)), expected);
        }
        assert_eq!(number("at_time_ft_fn", &run, Some(4.1)), None);
    }

    #[test]
    fn growth_is_that_of_the_wave_put_in() {
        for growth in [0.03, -0.05] {
            let wave = |n: u32| {
                (
                    f64::from(n) * 0.01,
                    0.6 + 1e-3 * (growth * f64::from(n) * 0.01).exp() * (f64::from(n) * 0.01).cos(),
                )
            };
            let found = number("oscillation_growth_ratio", &with_loads((0..6000).map(wave)), None).unwrap();
            assert!((found - growth).abs() < 1e-6, "{found} {growth}");
        }
        // Records of switches besides, now and then: each turn is that of its own three records.
        let extra = |n: &u32| [0, 1, 3, 10, 12].contains(&(n % 20));
        let wave = |n: u32| {
            let t = f64::from(n) * 0.02;
            (t, 0.6 + 1e-3 * (0.03 * t).exp() * t.cos())
        };
        let uneven = with_loads((0..3000).filter(extra).map(wave));
        let found = number("oscillation_growth_ratio", &uneven, None).unwrap();
        assert!((found - 0.03).abs() < 1e-6, "{found}");
        assert_eq!(
            number("oscillation_growth_ratio", &with_loads((0..9).map(|n| (f64::from(n), 0.1))), None),
            None
        );
    }

    /// Without inertia the roots are those of a square; at the critical stiffness growth is 0, with and without it.
    #[test]
    fn oscillations_neither_grow_nor_decay_at_the_critical_stiffness() {
        let inertia = "friction.radiation_kg_per_s = 200\nslider.mass_kg = 0.03";
        let without = "friction.radiation_kg_per_s = 30\nfriction.inertia = false";
        for keys in [inertia, without] {
            let mut run = slider(&format!("{keys}\ndrive.velocity_m_per_s = 1e-3"));
            let over = number("stiffness_over_critical_ratio", &run, None).unwrap();
            let growth = |run: &RunData| number("oscillation_growth_theory_ratio", run, None).unwrap();
            run.plan.drive.springs[0].stiffness_n_per_m /= over;
            assert!(growth(&run).abs() < 1e-9, "{keys}: {}", growth(&run));
            close(number("stiffness_over_critical_ratio", &run, None), 1.0);
            run.plan.drive.springs[0].stiffness_n_per_m *= 1.01;
            assert!(growth(&run) < -1e-4, "{}", growth(&run));
        }
    }
}
