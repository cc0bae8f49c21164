//! Compares the fast solver with the plain one: equal switches in equal steps, equal events, and equal
//! numbers within rounding.

use std::ops::Range;

use asperity_simulator::{Counters, SolverKind};
use asperity_testkit::{Random, plan};

use crate::fast_and_plain::{TOLERANCE, compare, compare_random, fields, run};

/// A scenario of a few hundred thousand steps with widely different parameters: soft and stiff friction
/// springs and drives, weak to strong damping including exactly critical, ringing starts, both rules.
fn random_scenario(seed: u64) -> Vec<String> {
    let mut noise = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
    let blocks: u32 = noise.pick(&[2, 3, 5, 8, 13, 24, 40]);
    let mass_kg = noise.log_uniform(1e-3, 30.0);
    let damping = noise.pick(&[0.0, 0.05, 0.3, 0.5, 1.0, 1.3, 3.0]);
    let ratio = noise.pick(&[1.0, 1e-3, 1e3, noise_ratio(seed)]);
    let drive_n_per_m = noise.log_uniform(1e4, 1e9);
    let mu_s = noise.uniform(0.1, 1.5);
    // A step well inside the stability of the chain.
    let k = 2.5e9 * f64::from(blocks - 1) * 1e-4 / 0.1;
    let m = mass_kg / f64::from(blocks);
    let omega2 = (4.0 * k + ratio * k + drive_n_per_m) / m;
    let gamma = 4.0 * damping * (k * m).sqrt() / m;
    let longest_s = ((gamma * gamma + 4.0 * omega2).sqrt() - gamma) / omega2;
    let step_s = longest_s * noise.log_uniform(0.01, 0.4);
    let step_s = format!("{step_s:.2e}").parse::<f64>().unwrap();
    // Fast enough for the whole slider to be pulled past its threshold a few times.
    let steps = 200_000.0;
    let reach_m = 400.0 * mu_s * (1.0 / drive_n_per_m + 1.0 / k) * noise.uniform(1.0, 4.0);
    let velocity_m_per_s = reach_m / (steps * step_s);
    let beta = noise.pick(&[0.0, 0.0, 0.3]);
    let kick = noise.pick(&[0.0, 0.0, 0.5]) * velocity_m_per_s;
    vec![
        format!("slider.blocks={blocks}"),
        format!("slider.mass_kg={mass_kg}"),
        format!("slider.relative_damping={damping:?}"),
        format!("friction.interfacial_stiffness_ratio={ratio}"),
        format!("friction.static_coefficient={mu_s}"),
        format!("friction.dynamic_coefficient={}", mu_s * noise.uniform(0.2, 0.95)),
        format!("friction.reattach={}", noise.pick(&["one-way", "two-way"])),
        format!("normal_load.tilt={}", noise.pick(&[0.0, 0.7, -0.7])),
        format!("initial_shear.beta={}", beta * mu_s),
        format!("initial_velocity.amplitude_m_per_s={kick}"),
        format!("initial_velocity.mode={}", noise.uniform(0.0, f64::from(blocks)) as u32),
        format!("drive.stiffness_n_per_m={drive_n_per_m}"),
        format!("drive.velocity_m_per_s={velocity_m_per_s}"),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", step_s * steps),
        format!("recording.sample_s={}", step_s * 997.0),
        format!("recording.fields_s={}", step_s * 20_000.0),
    ]
}

fn noise_ratio(seed: u64) -> f64 {
    Random::new(seed + 77).log_uniform(0.05, 20.0)
}

fn compare_scenarios(seeds: Range<u64>) {
    let known: Vec<u64> = [15, 49, 87, 117].into_iter().filter(|seed| seeds.contains(seed)).collect();
    let make = |seed| ("default", random_scenario(seed));
    let found = compare_random(seeds, make, [100, 6_000, 6_000], |_, _| {});
    // In these runs the time step does more than 30 % of the work put in, with both solvers.
    assert_eq!(found.stopped, known);
    assert!(found.parted.len() <= 2 && found.parted.iter().all(|(_, step)| *step > 50_000), "{found:?}");
    assert_eq!(found.ties, []);
}

/// Springs, loads and coefficients of their own at each block, of every distribution.
fn disordered(seed: u64) -> (&'static str, Vec<String>) {
    let mut noise = Random::new(seed);
    let mut set = random_scenario(seed);
    set.extend([
        format!("disorder.distribution={}", noise.pick(&["uniform", "lognormal", "weibull", "two-valued"])),
        "disorder.weibull_modulus=4".to_owned(),
        format!("disorder.correlation_length_m={}", noise.pick(&[0.0, 0.02])),
        format!("disorder.stiffness_spread={}", noise.uniform(0.05, 0.2)),
        format!("disorder.load_spread={}", noise.uniform(0.05, 0.2)),
        "friction.static_spread=0.005".to_owned(),
        format!("slider.left_end={}", noise.pick(&["free", "clamped"])),
        format!("friction.detach_by={}", noise.pick(&["force", "spring"])),
        format!("friction.spread_seed={seed}"),
    ]);
    assert!(!plan("default", &set).friction.has_even_springs());
    ("default", set)
}

fn compare_disordered(seeds: Range<u64>) {
    let found = compare_random(seeds, disordered, [100, 6_000, 6_000], |_, _| {});
    assert_eq!(found.ties, []);
}

/// A drive whose velocity jumps and changes linearly: holds, steps, ramps and oscillations.
fn with_a_course(seed: u64) -> (&'static str, Vec<String>) {
    let mut noise = Random::new(seed);
    let mut set = random_scenario(seed);
    let number = |key: &str| -> f64 {
        let found = set.iter().find_map(|set| set.strip_prefix(key)).expect("it is set");
        found.parse().expect("it is a number")
    };
    let step_s = number("time.step_s=");
    let fastest = 2.0 * number("drive.velocity_m_per_s=");
    let least = if set.iter().any(|set| set.ends_with("two-way")) { -0.2 } else { 0.0 };
    let start = noise.uniform(0.0, fastest);
    let (mut times, mut velocities, mut step, mut velocity) = (Vec::new(), Vec::new(), 0, start);
    while step < 180_000 {
        step += noise.uniform(2_000.0, 40_000.0) as u64;
        let other = noise.uniform(least, 1.0) * fastest;
        let next = noise.pick(&[0.0, velocity, other]);
        let before = noise.pick(&[velocity, velocity, next]);
        // A hold of the velocity or a ramp to here, then perhaps a jump.
        times.extend([step, step]);
        velocities.extend([if times.len() == 2 { velocity } else { before }, next]);
        velocity = next;
    }
    let times: Vec<f64> = times.iter().map(|step| *step as f64 * step_s).collect();
    set.extend([
        format!("drive.velocity_m_per_s={start}"),
        format!("drive.course_s={times:?}"),
        format!("drive.course_m_per_s={velocities:?}"),
    ]);
    if seed.is_multiple_of(3) {
        set.push(format!("drive.hold_from_s={}", 150_000.0 * step_s));
    }
    ("default", set)
}

fn compare_courses(seeds: Range<u64>) {
    let count = (seeds.end - seeds.start) as usize;
    let found = compare_random(seeds, with_a_course, [60, 3_000, 3_000], |_, _| {});
    assert!(found.stopped.len() <= count / 8 && found.ties.is_empty(), "{found:?}");
}

/// Both solvers do the whole run alike; returns the counters of the fast one.
fn compare_whole(scenario: &str, set: &[String], tolerance: f64) -> Counters {
    let found = compare(&format!("{scenario} {set:?}"), &plan(scenario, set), tolerance);
    assert!(found.is_whole(), "{set:?}: up to {:?}", found.parted_at);
    found.counters
}

fn compare_the_thesis_slider(set: &str, duration_s: f64) {
    let set = [format!("parameter_set={set}"), format!("time.duration_s={duration_s}")];
    let counters = compare_whole("default", &set, TOLERANCE);
    assert!(counters.switches > 0 && counters.plain_steps < 200_000, "{counters:?}");
}

/// A long chain, by its blocks, parameter set, drive, its velocity, steps, and tolerance.
fn jump_by_waves(blocks: u32, set: &str, drive: &str, velocity_m_per_s: f64, steps: u64, tolerance: f64) {
    let set = [
        format!("slider.blocks={blocks}"),
        format!("time.duration_s={steps}e-8"),
        format!("parameter_set={set}"),
        format!("drive.kind={drive}"),
        format!("drive.velocity_m_per_s={velocity_m_per_s}"),
        "friction.static_spread=0.2".to_owned(),
    ];
    let counters = compare_whole("default", &set, tolerance);
    assert!(counters.jumps > 3 && 10 * counters.jump_steps > 9 * steps, "{set:?} {counters:?}");
    assert!(counters.switches > 20 && counters.window_steps > 1_000, "{set:?} {counters:?}");
}

/// A long chain near its first slips, and far beyond: with both parameter sets, driven from the side and
/// from the top, with time steps from short to half the longest, with uniform friction and scattered.
fn random_long_chain(seed: u64) -> (&'static str, Vec<String>) {
    let mut noise = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 7);
    let blocks: u32 = noise.pick(&[257, 500, 1000, 1700, 3000]);
    let set = noise.pick(&["as-coded", "as-stated"]);
    let from_side = noise.pick(&[true, true, false]);
    let base = vec![
        format!("parameter_set={set}"),
        format!("slider.blocks={blocks}"),
        format!("drive.kind={}", if from_side { "side" } else { "top" }),
        format!("friction.static_spread={}", noise.pick(&[0.0, 0.05, 0.2])),
        format!("friction.reattach={}", noise.pick(&["one-way", "one-way", "two-way"])),
        "recording.sample_s=0".to_owned(),
        "recording.fields_s=0".to_owned(),
    ];
    let share = noise.pick(&[0.02, 0.1, 0.25, 0.5]);
    let steps = 20_000.0;
    let probe = plan("default", &[&base[..], &["time.step_s=1e-10".to_owned()]].concat());
    let stiffest_n_per_m = probe.drive.stiffest_n_per_m();
    let kt = probe.friction.interfacial_stiffness_n_per_m;
    let longest_s = probe.elastic.longest_stable_step_s(probe.block_mass_kg, kt, stiffest_n_per_m, 0.0);
    let step_s = format!("{:.2e}", share * longest_s).parse::<f64>().unwrap();
    let largest_n = probe.friction.static_threshold_n.iter().fold(0.0, |most: f64, force| most.max(*force));
    let first_m = largest_n * (1.0 / stiffest_n_per_m + if from_side { 1.0 / kt } else { 0.0 });
    // The drive advances several times as far as the first slip needs; a top drive brings all blocks to
    // it at once.
    let reach_m = first_m * if from_side { noise.log_uniform(1.5, 60.0) } else { noise.uniform(0.9, 1.3) };
    let own = [
        format!("drive.velocity_m_per_s={}", reach_m / (steps * step_s)),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", steps * step_s),
        format!("recording.sample_s={}", 997.0 * step_s),
        format!("recording.fields_s={}", 5_000.0 * step_s),
    ];
    ("default", [base, own.to_vec()].concat())
}

fn compare_long_chains(seeds: Range<u64>) {
    let count = seeds.end - seeds.start;
    let found = compare_random(seeds, random_long_chain, [400, 3_000, 6_000], |_, _| {});
    assert!(found.total.jumps > count && found.stopped.is_empty(), "{found:?}");
    assert!(found.parted.is_empty() && found.ties.is_empty(), "{found:?}");
}

#[test]
fn random_scenarios_give_the_same_switches() {
    compare_scenarios(0..7);
}

#[test]
fn disordered_chains_give_the_same_switches() {
    compare_disordered(208..216);
}

#[test]
fn drives_with_a_course_give_the_same_switches() {
    compare_courses(300..306);
}

#[test]
fn random_long_chains_give_the_same_switches() {
    compare_long_chains(2..12);
}

#[test]
fn the_thesis_slider_gives_the_same_switches() {
    compare_the_thesis_slider("as-coded", 0.06);
}

#[test]
fn long_chains_jump_by_waves() {
    // Blocks move so far that the rounding of displacements, over the step, dominates that of
    // velocities.
    jump_by_waves(300, "as-stated", "top", 3e-2, 1_000_000, 10.0 * TOLERANCE);
}

/// The seeds that are left, or all; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_scenarios_give_the_same_switches() {
        compare_scenarios(7..160);
    }

    #[test]
    #[ignore = "seconds of single steps: cargo xtask ci"]
    fn more_disordered_chains_give_the_same_switches() {
        compare_disordered(200..216);
    }

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_drives_with_a_course_give_the_same_switches() {
        compare_courses(306..400);
    }

    #[test]
    #[ignore = "seconds of single steps: cargo xtask ci"]
    fn the_thesis_slider_does_so_in_the_other_parameter_set() {
        compare_the_thesis_slider("as-stated", 0.06);
    }

    #[test]
    #[ignore = "seconds of single steps: cargo xtask ci"]
    fn longer_chains_jump_by_waves() {
        jump_by_waves(600, "as-stated", "top", 3e-2, 1_000_000, 10.0 * TOLERANCE);
    }

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_long_chains_give_the_same_switches() {
        compare_long_chains(0..100);
    }
}

#[test]
#[ignore = "half a minute of single steps: cargo xtask nightly"]
fn the_thesis_slider_gives_the_same_switches_for_longer() {
    for set in ["as-coded", "as-stated"] {
        compare_the_thesis_slider(set, 0.2);
    }
}

#[test]
#[ignore = "half a minute of single steps: cargo xtask nightly"]
fn long_chains_that_are_pushed_jump_by_waves() {
    for set in ["as-coded", "as-stated"] {
        jump_by_waves(600, set, "side", 4e-4, 3_000_000, TOLERANCE);
    }
}

#[test]
fn a_chain_without_modes_takes_windows() {
    // Only the softest friction springs restrain this chain: in double precision its lowest mode is
    // indistinguishable from rest.
    let counters = compare_whole("ring-down", &[], TOLERANCE);
    assert!(counters.jumps == 0 && counters.window_steps > 15_000, "{counters:?}");
    assert_eq!(SolverKind::Fast.start(plan::<&str>("ring-down", &[])).fallbacks().len(), 1);
}

/// Samples are computed one from the other, and would round differently from a jump that ends at each.
#[test]
fn a_jump_as_long_as_the_sample_cadence_lands_on_the_same_bits() {
    let end = |sample_s: &str| {
        let set = [
            format!("recording.sample_s={sample_s}"),
            "recording.fields_s=2e-4".to_owned(),
            "friction.interfacial_stiffness_ratio=0.01".to_owned(),
        ];
        let (records, counters, _) = run(&plan("ring-down", &set), SolverKind::Fast);
        assert_eq!(counters.jumps, 1);
        fields(&records).last().map(|record| (*record).clone())
    };
    assert!(end("0").is_some());
    assert_eq!(end("0"), end("0.00019999"));
}

#[test]
fn dense_samples_are_handed_out_one_by_one() {
    // A queue of all records would have the run's whole length in memory.
    let mut solver = SolverKind::Fast.start(plan("ring-down", &["recording.sample_s=1e-8".to_owned()]));
    let mut last = 0;
    while let Some(record) = solver.next_record().unwrap() {
        assert!(solver.step() <= record.step(), "the state waits for its samples");
        last = record.step();
    }
    assert_eq!(last, 20_000);
}

/// The cost of windows is counted in terms; a term takes about as long as a step.
#[test]
fn windows_that_do_not_pay_are_hardly_tried() {
    let set = ["parameter_set=as-stated", "friction.interfacial_stiffness_ratio=1e3", "time.duration_s=0.01"];
    let (_, counters, _) = run(&plan("default", &set), SolverKind::Fast);
    assert!(counters.windows > 0 && counters.applications < counters.steps() / 20, "{counters:?}");
}

/// Here the cancelling parts of the longest windows far exceed the velocity of a block that creeps.
#[test]
fn creeping_blocks_take_windows_of_the_length_that_is_certified() {
    let set = ["friction.interfacial_stiffness_ratio=10", "time.duration_s=0.05"];
    let (_, counters, _) = run(&plan("first-precursor", &set), SolverKind::Fast);
    assert!(counters.window_steps > 500_000, "{counters:?}");
    assert!(counters.plain_steps < counters.window_steps / 4, "{counters:?}");
    assert!(counters.applications < counters.window_steps / 2, "{counters:?}");
}

/// Computing a sample takes as long as many steps.
#[test]
fn samples_close_to_each_other_are_those_of_the_plain_solver() {
    let set = ["recording.sample_s=3e-8".to_owned(), "time.duration_s=0.0005".to_owned()];
    let counters = compare_whole("ring-down", &set, TOLERANCE);
    assert!(counters.window_steps > 45_000, "{counters:?}");
}
