//! Where ruptures stop behind a barrier, and when slow ones are over, beside tables of an independent program
//! (`fixtures/reference/fronts`) and closed forms. More of both is claimed by `cargo xtask reproduce front-speed`.
//!
//! Units are those of `crates/model/src/theory/front.rs`: `a`, `sqrt(m / k)` and `(mu_s - mu_d) p`.

use asperity_model::Plan;
use asperity_model::theory::front::{Front, relative_prestress};
use asperity_record::Record;
use asperity_simulator::SolverKind;
use asperity_testkit::{plan, reference};

use crate::fast_and_plain::{detachments, records};

/// A chain without drive or dampers, with that step and duration, and more overrides.
fn chain(blocks: usize, [step, duration]: [f64; 2], more: &[String]) -> Plan {
    let n = blocks as f64;
    let (k, m) = (2.5e6 * (n - 1.0), 0.012 / n);
    let step_s = step * (m / k).sqrt();
    let own = [
        format!("slider.blocks={blocks}"),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", (duration / step).round() * step_s),
    ];
    plan("front", &[&own, more].concat())
}

/// The prestress of `tau` over the normal load.
fn ratio(tau: f64) -> f64 {
    0.45 + 0.25 * tau
}

/// A hair above what takes a block from a prestress of `tau` to its threshold.
fn starts(tau: f64) -> f64 {
    ratio(1.0) - ratio(tau) + 1e-12
}

/// How far a rupture came behind a barrier, in blocks, with `tau` on the blocks before it and `tau_b` behind.
fn blocks_behind_barrier(plan: &Plan, before: usize) -> usize {
    let records = records(SolverKind::Fast.start(plan.clone()));
    let last = detachments(&records).map(|(_, switch)| switch.block as usize).max().unwrap_or(0);
    assert!(last < plan.blocks, "it stops before the end");
    last.saturating_sub(before)
}

/// Without fracture energy a crack stops where the stress that its first characteristic has passed adds up to 0:
/// `n tau / |tau_b|` behind the barrier, and twice as far if its beginning is free, where waves are mirrored.
#[test]
fn cracks_stop_where_the_stress_behind_the_barrier_has_used_up_that_before_it() {
    for row in reference("fronts/arrest-crack.csv").iter().filter(|row| row[3] == "250") {
        let number = |at: usize| row[at].parse::<f64>().expect("a number");
        let (tau, tau_b, before, blocks) = (number(1), number(2), number(3), number(4));
        let (start, drop) = (starts(tau), ratio(tau_b) - ratio(tau));
        let barrier = before + 1.0;
        let mut sets = vec![format!("prestress.ratio={}", ratio(tau))];
        sets.extend(match row[0].as_str() {
            "stuck" => vec![
                "friction.stuck_blocks=[1]".to_owned(),
                format!("prestress.from_blocks=[2,3,{barrier}]"),
                format!("prestress.from_blocks_ratio=[{start},0,{drop}]"),
            ],
            _ => vec![
                format!("prestress.first_block_ratio={start}"),
                format!("prestress.from_blocks=[{barrier}]"),
                format!("prestress.from_blocks_ratio=[{drop}]"),
            ],
        });
        let plan = chain(blocks as usize, [0.01, 4.0 * blocks], &sets);
        let found = blocks_behind_barrier(&plan, before as usize) as f64;
        let (of_table, theory) = (number(6), number(8) * before * tau / tau_b.abs());
        // At a free end the last blocks depend on the step: for tau = 0.2 steps from 0.02 to 0.00125 give 181 to 199
        // blocks, and the table has 201; 15 blocks would be too few. Longer cracks, of 500 and 1000 blocks, take minutes here; the
        // pipeline has them.
        assert!((found / of_table - 1.0).abs() <= 0.1, "{row:?}: {found}");
        assert!((found / theory - 1.0).abs() < 0.16, "{row:?}: {found} of {theory}");
    }
}

/// With large `tau` the front is soon over, and the blocks relax for long: the time until the root mean square of
/// velocities is 0.01 of the drift, by recorded states, and the exponent of the moment as a power of it.
#[test]
fn slow_ruptures_of_large_prestress_last_as_long_as_they_relax() {
    let (alpha, tau) = (10.0, 0.6);
    let mut ends = Vec::new();
    for row in reference("fronts/moment-duration.csv").iter().filter(|row| row[0] == "10" && row[1] == "0.6")
    {
        let number = |at: usize| row[at].parse::<f64>().expect("a number");
        let (sliding, of_table) = (number(2), number(4));
        if sliding > 32.0 {
            continue;
        }
        let blocks = sliding + 1.0;
        let (k, m) = (2.5e6 * sliding, 0.012 / blocks);
        let sets = [
            format!("friction.radiation_kg_per_s={}", alpha * (k * m).sqrt()),
            format!("friction.stuck_blocks=[{blocks}]"),
            format!("prestress.ratio={}", ratio(tau)),
            format!("prestress.first_block_ratio={}", starts(tau)),
            format!("recording.fields_s={}", (of_table / 0.05 / 500.0).round() * 0.05 * (m / k).sqrt()),
        ];
        let plan = chain(blocks as usize, [0.05, 1.1 * of_table], &sets);
        let weakening_n = plan.friction.static_threshold_n[0] - plan.friction.dynamic_friction_n[0];
        let drift_m_per_s = weakening_n / k / plan.scales.block_time_s * tau / alpha;
        let mut solver = SolverKind::Fast.start(plan.clone());
        let mut before = (0.0, f64::INFINITY);
        let (end, moment) = loop {
            let Some(record) = solver.next_record().expect("it goes on") else {
                panic!("{row:?}: it does not rest")
            };
            let Record::Fields(state) = record else { continue };
            let square: f64 = state.velocity_m_per_s.iter().map(|v| v * v).sum();
            // As a logarithm, since it falls exponentially.
            let now = (state.time_s, ((square / blocks).sqrt() / drift_m_per_s / 0.01).ln());
            if state.time_s > 0.0 && now.1 < 0.0 {
                let share = before.1 / (before.1 - now.1);
                let end_s = before.0 + share * (now.0 - before.0);
                let moment = state.displacement_m.iter().sum::<f64>() / (weakening_n / k);
                break (end_s / plan.scales.block_time_s, moment);
            }
            before = now;
        };
        assert!((end / of_table - 1.0).abs() < 2e-3, "{row:?}: {end}");
        assert!((relative_prestress(&plan, 1).expect("it weakens") - tau).abs() < 1e-12);
        assert!((moment / number(5) - 1.0).abs() < 1e-3, "{row:?}: {moment}");
        // The blocks have nearly come to rest.
        let front = Front::of(&plan, 1).expect("there is a theory");
        let rest = front.static_slip_sum(sliding as usize).expect("nothing drives it");
        assert!((0.985..1.0).contains(&(moment / rest)), "{row:?}: {moment} of {rest}");
        ends.push((end, moment));
    }
    let exponents: Vec<f64> =
        ends.windows(2).map(|pair| (pair[1].1 / pair[0].1).ln() / (pair[1].0 / pair[0].0).ln()).collect();
    for (found, expected) in exponents.iter().zip([1.479, 1.488]) {
        assert!((found - expected).abs() < 0.005, "{exponents:?}");
    }
    assert_eq!(exponents.len(), 2);
}
