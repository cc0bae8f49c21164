//! Where ruptures stop, and how long slow ones take, beside tables of an independent program
//! (`fixtures/reference/fronts`) and closed forms.
//!
//! Units are those of `crates/model/src/front.rs`: `a`, `sqrt(m / k)` and `(mu_s - mu_d) p`.

use std::f64::consts::PI;

use asperity_model::Plan;
use asperity_record::{Direction, Record};
use asperity_simulator::SolverKind;
use asperity_testkit::{plan, reference};

/// A chain without drive or dampers, with that step and duration, radiation `alpha` and a stiffness `gamma` that
/// pulls every block back.
fn chain(blocks: usize, [step, duration]: [f64; 2], [alpha, gamma]: [f64; 2]) -> Plan {
    let n = blocks as f64;
    let (k, m) = (2.5e6 * (n - 1.0), 0.012 / n);
    let step_s = step * (m / k).sqrt();
    let mut sets = vec![
        format!("slider.blocks={blocks}"),
        format!("friction.radiation_kg_per_s={}", alpha * (k * m).sqrt()),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", (duration / step).round() * step_s),
    ];
    if gamma > 0.0 {
        sets.extend(["drive.kind=top".to_owned(), format!("drive.stiffness_n_per_m={}", gamma * k * n)]);
    }
    plan("front", &sets)
}

/// Gives every block its `tau`.
fn stress(plan: &mut Plan, tau: impl Fn(usize) -> f64) {
    for n in 0..plan.blocks {
        let dynamic_n = plan.friction.dynamic_friction_n[n];
        plan.prestress_n[n] = dynamic_n + tau(n) * (plan.friction.static_threshold_n[n] - dynamic_n);
    }
}

/// A hair above the threshold.
const STARTS: f64 = 1.0 + 1e-12;

/// For each block that slid, the time of its first detachment.
fn arrivals(plan: &Plan) -> Vec<Option<f64>> {
    let mut solver = SolverKind::Fast.start(plan.clone());
    let mut arrivals = vec![None; plan.blocks];
    while let Some(record) = solver.next_record().expect("it goes on") {
        let Record::Step(step) = record else { continue };
        for switch in step.switches.iter().filter(|switch| switch.direction == Direction::Detach) {
            arrivals[switch.block as usize - 1].get_or_insert(step.time_s / plan.scales.block_time_s);
        }
    }
    arrivals
}

/// How far a rupture came behind a barrier, in blocks, with `tau` on the blocks before it and `tau_b` behind.
fn blocks_behind_barrier(plan: &mut Plan, is_stuck: bool, [tau, tau_b]: [f64; 2], before: usize) -> usize {
    let first = usize::from(is_stuck);
    if is_stuck {
        plan.friction.static_threshold_n[0] = 1e9;
    }
    stress(plan, |n| if n < before { tau } else { tau_b });
    if is_stuck {
        plan.prestress_n[0] = 0.0;
    }
    let starts_n = plan.friction.static_threshold_n[first] * STARTS;
    plan.prestress_n[first] = starts_n;
    let arrivals = arrivals(plan);
    let last = arrivals.iter().rposition(Option::is_some).expect("the first block slides");
    assert!(last + 1 < plan.blocks, "it stops before the end");
    (last + 1).saturating_sub(before)
}

/// Without fracture energy a crack stops where the stress that its first characteristic has passed adds up to 0:
/// `n tau / |tau_b|` behind the barrier, and twice as far if its beginning is free, where waves are mirrored.
#[test]
fn cracks_stop_where_the_stress_behind_the_barrier_has_used_up_that_before_it() {
    for row in reference("fronts/arrest-crack.csv").iter().filter(|row| row[3] != "1000") {
        let number = |at: usize| row[at].parse::<f64>().expect("a number");
        let (tau, tau_b, before, blocks) = (number(1), number(2), number(3), number(4));
        let mut plan = chain(blocks as usize, [0.01, 4.0 * blocks], [0.0, 0.0]);
        let found = blocks_behind_barrier(&mut plan, row[0] == "stuck", [tau, tau_b], before as usize) as f64;
        let (of_table, theory) = (number(6), number(8) * before * tau / tau_b.abs());
        // Some blocks depend on the last digits.
        assert!((found / of_table - 1.0).abs() <= 15.0 / before, "{row:?}: {found}");
        // The part of the lattice falls with `n`: 0.16 at 250 blocks, 0.11 at 500.
        assert!((found / theory - 1.0).abs() < 10.0 / before.sqrt() / 4.0, "{row:?}: {found} of {theory}");
    }
}

#[test]
fn pulses_stop_where_those_of_the_table_do() {
    let of_gamma = |gamma: &str| -> Vec<f64> {
        let rows = reference("fronts/arrest-pulse.csv");
        let of = rows.iter().filter(|row| row[0] == gamma).map(|row| {
            let number = |at: usize| row[at].parse::<f64>().expect("a number");
            let (gamma, tau, tau_b, before) = (number(0), number(1), number(2), number(3));
            let blocks = before as usize + 2 * number(4) as usize + 20;
            let mut plan = chain(blocks, [0.01, 2.0 * blocks as f64], [0.0, gamma]);
            let found = blocks_behind_barrier(&mut plan, false, [tau, tau_b], before as usize) as f64;
            // Some blocks depend on the last digits.
            assert!((found - number(4)).abs() <= f64::max(1.0, 0.03 * number(4)), "{row:?}: {found}");
            let length = found * gamma.sqrt();
            assert!(length <= (1.0 + (1.0 - tau * tau).sqrt()) / tau_b.abs(), "{row:?}: {length}");
            length
        });
        of.collect()
    };
    let lengths = of_gamma("0.0065");
    assert_eq!(lengths.len(), 5);
}

/// The time at which a slow front comes to block `n`, over `sqrt(m / k)`, for `tau n^2` far below 1: block `j` has
/// joined, all `j` follow by 1, and the next one goes once all but `j tau` of the pull is made up.
fn slow_front(alpha: f64, tau: f64, n: u32) -> f64 {
    let takes = |j: u32| {
        let of_mode = |i: u32| (PI * (f64::from(i) - 0.5) / f64::from(2 * j + 1)).cos();
        let sum: f64 = (1..=j).map(of_mode).sum();
        let square: f64 = (1..=j).map(|i| of_mode(i).powi(2)).sum();
        let amplitude = of_mode(j) * sum / square;
        let half = (PI / f64::from(4 * j + 2)).sin();
        (amplitude / (f64::from(j) * tau)).ln() / (4.0 * half * half)
    };
    alpha * (1..n).map(takes).sum::<f64>()
}

#[test]
fn slow_fronts_take_as_long_as_their_formula_says() {
    for row in
        reference("fronts/moment-duration.csv").iter().filter(|row| row[0] == "10" && row[1] == "1e-05")
    {
        let number = |at: usize| row[at].parse::<f64>().expect("a number");
        let (tau, sliding, of_table) = (number(1), number(2) as u32, number(3));
        if sliding > 8 {
            continue;
        }
        let mut plan = chain(sliding as usize + 1, [0.01, 1.1 * of_table], [10.0, 0.0]);
        stress(&mut plan, |_| tau);
        plan.prestress_n[0] = plan.friction.static_threshold_n[0] * STARTS;
        plan.friction.static_threshold_n[sliding as usize] = 1e9;
        let arrivals = arrivals(&plan);
        let took = arrivals[sliding as usize - 1].expect("it comes so far") - arrivals[0].expect("it starts");
        let formula = slow_front(10.0, tau, sliding);
        assert!((took / of_table - 1.0).abs() < 1e-3, "{row:?}: {took}");
        assert!((took / formula - 1.0).abs() < 0.01, "{row:?}: {took} by the formula {formula}");
    }
}
