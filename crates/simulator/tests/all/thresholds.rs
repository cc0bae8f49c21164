//! Thresholds at the most difficult places for a solver that skips steps: between the forces on a block
//! in one step and the next, for every step of a stretch longer than any window, so that switches fall
//! on the first and last step of windows and just after jumps; and slightly above or below the largest
//! amplitude of standing waves.

use asperity_model::Plan;
use asperity_simulator::{Counters, SolverKind};
use asperity_testkit::equality::{self, Agreement};
use asperity_testkit::plan;

use crate::fast_and_plain::{fields, records, run};

/// Long chains have standing waves instead of stored modes, and no windows where these cannot pay.
const CHAINS: [(u32, &str, f64); 4] =
    [(100, "as-coded", 2e-8), (300, "as-coded", 5e-9), (300, "as-stated", 2e-8), (300, "as-stated", 9e-8)];

/// Out of reach.
const FAR_N: f64 = 1e9;

/// The force on every block in every step but the first, with these thresholds.
fn forces_n(plan: &Plan) -> Vec<Vec<f64>> {
    let mut plan = plan.clone();
    plan.recording.fields_every_steps = 1;
    let records = records(SolverKind::Plain.start(plan));
    fields(&records).into_iter().map(|state| state.tangential_force_n.clone()).collect()
}

/// Compares both solvers; returns the steps in which blocks switch.
fn compared(plan: &Plan) -> (Agreement, Vec<(u64, u32)>) {
    let mut switches = Vec::new();
    let agreement = equality::compare(
        plan,
        |plain, _| switches.extend(plain.switches.iter().map(|switch| (plain.step, switch.block))),
        |_| {},
    )
    .unwrap_or_else(|disagreement| panic!("{} blocks, {:?}: {disagreement}", plan.blocks, plan.grid));
    (agreement, switches)
}

fn counters(plan: &Plan) -> Counters {
    run(plan, SolverKind::Fast).1
}

/// Block `n` (counted from 0) detaches in each of these steps in turn, the others at their own
/// thresholds.
fn detaches_in_each(plan: &Plan, n: usize, steps: std::ops::Range<usize>) {
    let mut free = plan.clone();
    free.friction.static_threshold_n[n] = FAR_N;
    let force_n: Vec<f64> = forces_n(&free).iter().map(|forces| forces[n].abs()).collect();
    let (mut highest_n, mut tried) = (0.0_f64, 0);
    for (step, here_n) in force_n.iter().enumerate().take(steps.end).skip(1) {
        let before_n = highest_n;
        highest_n = highest_n.max(*here_n);
        // Only where the force is higher than ever before.
        if step < steps.start || highest_n - before_n < 1e-9 * highest_n {
            continue;
        }
        let mut plan = plan.clone();
        plan.friction.static_threshold_n[n] = 0.5 * (before_n + highest_n);
        plan.steps = step as u64 + 200;
        let (agreement, switches) = compared(&plan);
        let first = switches.iter().find(|(_, block)| *block as usize == n + 1);
        assert_eq!(first.map(|(step, _)| *step), Some(step as u64));
        assert!(
            !agreement.near_ties.iter().any(|tie| tie.step == step as u64),
            "{:?}",
            agreement.near_ties[0]
        );
        tried += 1;
    }
    assert!(tried > 10, "{tried} steps of {steps:?}");
}

#[test]
fn a_switch_may_fall_on_any_step() {
    switches_fall_on_any_step(&[CHAINS[0], CHAINS[2]]);
}

/// The others; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "seconds of single steps: cargo xtask ci"]
    fn a_switch_may_fall_on_any_step_of_other_chains() {
        switches_fall_on_any_step(&[CHAINS[1], CHAINS[3]]);
    }
}

fn switches_fall_on_any_step(chains: &[(u32, &str, f64)]) {
    for &(blocks, set, step_s) in chains {
        let scenario = [
            format!("slider.blocks={blocks}"),
            format!("parameter_set={set}"),
            format!("time.step_s={step_s}"),
            format!("time.duration_s={}", 6_000.0 * step_s),
            format!("drive.velocity_m_per_s={}", 0.1 / (f64::from(blocks) * step_s * 1e6)),
            "recording.sample_s=0".to_owned(),
            "recording.fields_s=0".to_owned(),
            "recording.event_fields=false".to_owned(),
        ];
        let mut plan = plan("default", &scenario);
        plan.friction.static_threshold_n.fill(FAR_N);
        let first_n = forces_n(&plan)[3_000][0];
        plan.friction.dynamic_friction_n.fill(0.5 * first_n);
        plan.friction.static_threshold_n[0] = first_n;
        assert!(counters(&plan).jumps + counters(&plan).windows > 0, "{scenario:?}");
        // The first of all, after a long rest.
        detaches_in_each(&plan, 0, 2_900..3_100);
        // The second block, while the first one slides or has stopped.
        let (_, switches) = compared(&plan);
        let (first_step, _) = switches[0];
        detaches_in_each(&plan, 1, first_step as usize + 1..first_step as usize + 40);
    }
}

#[test]
fn standing_waves_just_below_thresholds_make_no_block_slip() {
    let mut jumps = 0;
    for (blocks, set, step_s) in CHAINS {
        // Over-damped waves cost more energy in a time step than
        // [`asperity_simulator::MOST_SCHEME_SHARE`] admits.
        for mode in if set == "as-stated" { [1, 7, 40] } else { [1, 2, 3] } {
            let scenario = [
                format!("slider.blocks={blocks}"),
                format!("parameter_set={set}"),
                format!("time.step_s={step_s}"),
                format!("time.duration_s={}", 6_000.0 * step_s),
                "drive.velocity_m_per_s=1e-9".to_owned(),
                "initial_velocity.amplitude_m_per_s=1e-5".to_owned(),
                format!("initial_velocity.mode={mode}"),
                "recording.sample_s=0".to_owned(),
                "recording.fields_s=0".to_owned(),
                "recording.event_fields=false".to_owned(),
            ];
            let mut plan = plan("default", &scenario);
            plan.friction.static_threshold_n.fill(FAR_N);
            let (forces_n, whole) = (forces_n(&plan), plan.steps);
            let highest = |n: usize| {
                let sizes_n = forces_n.iter().map(|forces| forces[n].abs());
                sizes_n.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
            };
            let highest_n: Vec<f64> = (0..plan.blocks).map(|n| highest(n).1).collect();
            for (friction, highest) in plan.friction.dynamic_friction_n.iter_mut().zip(&highest_n) {
                *friction = 0.5 * highest;
            }
            let middle = plan.blocks / 3;
            for above in [1e-3, 1e-6, 1e-8, 1e-10] {
                for (threshold, highest) in plan.friction.static_threshold_n.iter_mut().zip(&highest_n) {
                    *threshold = highest * (1.0 + above);
                }
                plan.steps = whole;
                let (agreement, switches) = compared(&plan);
                assert_eq!((agreement.switches, switches), (0, Vec::new()), "{scenario:?}, {above}");
                if above == 1e-3 {
                    jumps += counters(&plan).jumps;
                }
                // One of them does if its own threshold is as much below.
                plan.friction.static_threshold_n[middle] = highest_n[middle] * (1.0 - above);
                plan.steps = (highest(middle).0 as u64 + 300).min(whole);
                let (_, switches) = compared(&plan);
                assert_eq!(switches.first().map(|(_, block)| *block as usize), Some(middle + 1));
            }
        }
    }
    assert!(jumps > 0, "waves are jumped over where they may be");
}
