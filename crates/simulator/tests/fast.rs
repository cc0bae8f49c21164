//! Compares the fast solver with the plain one: equal switches in equal steps, equal events, and equal
//! numbers within rounding.

use asperity_model::Plan;
use asperity_record::{Direction, FieldRecord, Record, StepRecord};
use asperity_simulator::equality::{self, Disagreement};
use asperity_simulator::{Counters, Plain, SimulationError, Solver, SolverKind};
use asperity_testkit::{Random, plan};

#[path = "fast_and_plain/amplified.rs"]
mod amplified;

use amplified::{amplified, nudged};

/// Numbers agree within this share of the largest of their kind in the run.
const TOLERANCE: f64 = 1e-9;

/// Tolerance where friction springs a thousand times stiffer or softer than the chain amplify the
/// rounding of the plain stepper itself.
const EXTREME_TOLERANCE: f64 = 1e-6;

fn run(mut solver: impl Solver) -> (Vec<Record>, Counters) {
    let records = std::iter::from_fn(|| solver.next_record().unwrap()).collect();
    (records, solver.counters())
}

/// The error that stops a run, if any.
fn error(mut solver: impl Solver) -> Option<SimulationError> {
    loop {
        match solver.next_record() {
            Ok(Some(_)) => {}
            ended => return ended.err(),
        }
    }
}

fn steps(records: &[Record]) -> Vec<&StepRecord> {
    records
        .iter()
        .filter_map(|record| if let Record::Step(step) = record { Some(step) } else { None })
        .collect()
}

fn fields(records: &[Record]) -> Vec<&FieldRecord> {
    records
        .iter()
        .filter_map(|record| if let Record::Fields(fields) = record { Some(&**fields) } else { None })
        .collect()
}

fn assert_close(what: &str, fast: &[f64], plain: &[f64], tolerance: f64) {
    assert_eq!(fast.len(), plain.len(), "{what}");
    let largest = plain.iter().fold(f64::MIN_POSITIVE, |largest: f64, value| largest.max(value.abs()));
    for (index, (fast, plain)) in fast.iter().zip(plain).enumerate() {
        let off = (fast - plain).abs();
        assert!(off <= tolerance * largest, "{what}, number {index}: {fast} and {plain}, largest {largest}");
    }
}

/// Numbers of a record, by name.
type Numbers<'a, R> = (&'a str, &'a dyn Fn(&R) -> Vec<f64>);

/// Step, number sliding, and which blocks switched which way.
type Entry = (u64, u32, Vec<(u32, bool)>);

fn entries(records: &[Record]) -> Vec<Entry> {
    steps(records)
        .iter()
        .map(|record| {
            let switches = record.switches.iter().map(|s| (s.block, s.direction == Direction::Detach));
            (record.step, record.sliding, switches.collect())
        })
        .collect()
}

/// The step at which the plain stepper diverges from itself if its velocities are changed early on by
/// one part in 10^13, or ten. Some chains are chaotic, so that no two ways of rounding agree for ever.
fn horizon(plan: &Plan, plain: &[Record]) -> u64 {
    let plain = entries(plain);
    let from = plain.partition_point(|entry| entry.0 <= 100);
    let parts_at = |nudge: f64| {
        let nudged = entries(&nudged(plan, nudge));
        let parted = plain[from..].iter().zip(&nudged).find(|(plain, nudged)| plain != nudged);
        parted.map_or(plan.steps, |(plain, nudged)| plain.0.min(nudged.0) - 1)
    };
    [1e-13, -1e-13, 1e-12].into_iter().map(parts_at).min().unwrap_or(plan.steps)
}

/// The result of a comparison.
struct Compared {
    /// Counters of the fast solver.
    counters: Counters,
    /// Number of switches compared.
    switches: usize,
    /// The last step up to which all switches are equal: the last of the run, except in a chaotic chain.
    horizon_step: u64,
}

/// Compares the two runs of one plan, record by record, those of cadences included, and by
/// [`equality::compare`], which accepts differences only by rounding. A run may diverge only if its
/// chain is chaotic, and no earlier than one with changed velocities.
fn compare(name: &str, plan: &Plan, tolerance: f64) -> Compared {
    let (mut fast, counters) = run(SolverKind::Fast.start(plan.clone()));
    let (mut plain, plain_counters) = run(Plain::new(plan.clone()));
    let whole = entries(&fast) == entries(&plain);
    match equality::compare(plan, |_, _| {}, |_| {}) {
        Ok(agreement) => {
            assert!(whole && agreement.near_ties.is_empty(), "{name}: {:?}", agreement.near_ties)
        }
        Err(Disagreement::Numbers { deviation, what }) if whole => {
            let amplified = amplified(plan, &plain);
            assert!(
                deviation < 4.0 * amplified,
                "{name}: {what} by {deviation}, and {amplified} by rounding alone"
            );
        }
        Err(error) => assert!(!whole, "{name}: {error}"),
    }
    let horizon_step = if whole { plan.steps } else { horizon(plan, &plain) };
    if !whole {
        assert!(horizon_step < plan.steps, "{name}: the runs differ, and the chain is not chaotic");
        fast.retain(|record| record.step() <= horizon_step);
        plain.retain(|record| record.step() <= horizon_step);
    }
    let (fast_list, plain_list) = (entries(&fast), entries(&plain));
    if let Some(at) = (0..fast_list.len().min(plain_list.len())).find(|&i| fast_list[i] != plain_list[i]) {
        panic!(
            "{name}: record {at} of {}: fast {:?}, plain {:?}",
            plain_list.len(),
            fast_list[at],
            plain_list[at]
        );
    }
    assert_eq!(fast_list.len(), plain_list.len(), "{name}");
    assert!(!whole || counters.switches == plain_counters.switches, "{name}");
    assert_eq!(counters.plain_steps + counters.window_steps + counters.jump_steps, plan.steps, "{name}");
    let switches = plain_list.iter().map(|(.., switches)| switches.len()).sum();
    if !whole {
        // Near its horizon a chaotic run has lost its digits; half-way there, half of them.
        fast.retain(|record| record.step() <= horizon_step / 2);
        plain.retain(|record| record.step() <= horizon_step / 2);
    }

    let collect = |records: &[Record], value: &dyn Fn(&StepRecord) -> Vec<f64>| -> Vec<f64> {
        steps(records).iter().flat_map(|record| value(record)).collect()
    };
    let numbers: [Numbers<'_, StepRecord>; 5] = [
        ("driving force", &|r| vec![r.driving_force_n]),
        ("u", &|r| r.switches.iter().map(|s| s.displacement_m).collect()),
        ("v", &|r| r.switches.iter().map(|s| s.velocity_m_per_s).collect()),
        ("tau", &|r| r.switches.iter().map(|s| s.tangential_force_n).collect()),
        ("u_stick", &|r| r.switches.iter().map(|s| s.stick_position_m).collect()),
    ];
    for (what, value) in numbers {
        assert_close(&format!("{name}: {what}"), &collect(&fast, value), &collect(&plain, value), tolerance);
    }
    let collect = |records: &[Record], value: &dyn Fn(&FieldRecord) -> Vec<f64>| -> Vec<f64> {
        fields(records).iter().flat_map(|record| value(record)).collect()
    };
    let numbers: [Numbers<'_, FieldRecord>; 4] = [
        ("fields, step", &|r| vec![r.step as f64]),
        ("fields, u", &|r| r.displacement_m.clone()),
        ("fields, v", &|r| r.velocity_m_per_s.clone()),
        ("fields, tau", &|r| r.tangential_force_n.clone()),
    ];
    for (what, value) in numbers {
        assert_close(&format!("{name}: {what}"), &collect(&fast, value), &collect(&plain, value), tolerance);
    }
    Compared { counters, switches, horizon_step }
}

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

#[test]
fn random_scenarios_give_the_same_switches() {
    compare_random(0..7);
}

/// The seeds that are left; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_scenarios_give_the_same_switches() {
        compare_random(7..160);
    }

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_drives_with_a_course_give_the_same_switches() {
        compare_random_courses(306..400);
    }

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_long_chains_give_the_same_switches() {
        compare_random_long(20..100);
    }
}

/// Springs, loads and coefficients of their own at each block, of every distribution.
#[test]
fn disordered_chains_give_the_same_switches() {
    let (mut jumps, mut windows, mut switches) = (0, 0, 0);
    for seed in 200..216 {
        let mut noise = Random::new(seed);
        let mut set = random_scenario(seed);
        set.extend([
            format!(
                "disorder.distribution={}",
                noise.pick(&["uniform", "lognormal", "weibull", "two-valued"])
            ),
            "disorder.weibull_modulus=4".to_owned(),
            format!("disorder.correlation_length_m={}", noise.pick(&[0.0, 0.02])),
            format!("disorder.stiffness_spread={}", noise.uniform(0.05, 0.2)),
            format!("disorder.load_spread={}", noise.uniform(0.05, 0.2)),
            "friction.static_spread=0.005".to_owned(),
            format!("slider.left_end={}", noise.pick(&["free", "clamped"])),
            format!("friction.detach_by={}", noise.pick(&["force", "spring"])),
            format!("friction.spread_seed={seed}"),
        ]);
        let plan = plan("default", &set);
        assert!(!plan.friction.has_even_springs());
        if error(SolverKind::Fast.start(plan.clone())).is_some() {
            continue;
        }
        let compared = compare(&format!("seed {seed} {set:?}"), &plan, EXTREME_TOLERANCE);
        jumps += compared.counters.jump_steps;
        windows += compared.counters.window_steps;
        switches += compared.switches;
    }
    assert!(jumps > 100_000 && windows > 100_000 && switches > 1_600, "{jumps} {windows} {switches}");
}

/// Compares a range of random scenarios.
fn compare_random(seeds: std::ops::Range<u64>) {
    let count = seeds.end - seeds.start;
    let in_range = |seed: &u64| seeds.contains(seed);
    let known: Vec<u64> = [15, 49, 87, 117].into_iter().filter(in_range).collect();
    let (mut total, mut chaotic, mut stopped) = (Counters::default(), Vec::new(), Vec::new());
    for seed in seeds.clone() {
        let set = random_scenario(seed);
        let plan = plan("default", &set);
        if let Some(error) = error(SolverKind::Fast.start(plan.clone())) {
            let SimulationError::Energy { step, .. } = error else { panic!("seed {seed} {set:?}: {error}") };
            let same = |other| matches!(other, Some(SimulationError::Energy { step: at, .. }) if at == step);
            assert!(same(self::error(Plain::new(plan))), "seed {seed} {set:?}: {error}");
            stopped.push(seed);
            continue;
        }
        let Compared { counters, switches, horizon_step } =
            compare(&format!("seed {seed} {set:?}"), &plan, EXTREME_TOLERANCE);
        total.switches += switches as u64;
        total.jump_steps += counters.jump_steps;
        total.window_steps += counters.window_steps;
        if horizon_step < plan.steps {
            chaotic.push((seed, horizon_step));
        }
    }
    // The comparison is meaningful only if the shortcuts were used between many switches, and nearly all
    // of it was compared.
    assert!(total.switches > 100 * count, "{total:?}");
    assert!(total.jump_steps > 6_000 * count && total.window_steps > 6_000 * count, "{total:?}");
    // In these runs the time step does more than 30 % of the work put in, with both solvers.
    assert_eq!(stopped, known);
    assert!(chaotic.len() <= 2 && chaotic.iter().all(|(_, step)| *step > 50_000), "{chaotic:?}");
}

/// A drive whose velocity jumps and changes linearly: holds, steps, ramps and oscillations.
#[test]
fn drives_with_a_course_give_the_same_switches() {
    compare_random_courses(300..306);
}

fn compare_random_courses(seeds: std::ops::Range<u64>) {
    let count = seeds.end - seeds.start;
    let (mut total, mut stopped) = (Counters::default(), 0);
    for seed in seeds {
        let mut noise = Random::new(seed);
        let mut set = random_scenario(seed);
        let number = |key: &str, set: &[String]| -> f64 {
            let found = set.iter().find_map(|set| set.strip_prefix(key)).expect("it is set");
            found.parse().expect("it is a number")
        };
        let step_s = number("time.step_s=", &set);
        let fastest = 2.0 * number("drive.velocity_m_per_s=", &set);
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
        if seed % 3 == 0 {
            set.push(format!("drive.hold_from_s={}", 150_000.0 * step_s));
        }
        let plan = plan("default", &set);
        if error(SolverKind::Fast.start(plan.clone())).is_some() {
            stopped += 1;
            continue;
        }
        let compared = compare(&format!("seed {seed} {set:?}"), &plan, EXTREME_TOLERANCE);
        total.jump_steps += compared.counters.jump_steps;
        total.window_steps += compared.counters.window_steps;
        total.switches += compared.switches as u64;
    }
    assert!(total.switches > 60 * count && stopped <= count / 8, "{total:?} {stopped}");
    assert!(total.jump_steps > 3_000 * count && total.window_steps > 3_000 * count, "{total:?}");
}

#[test]
fn the_thesis_slider_gives_the_same_switches_in_both_parameter_sets() {
    compare_the_thesis_slider(0.06);
}

#[test]
#[ignore = "half a minute of single steps: cargo xtask nightly"]
fn the_thesis_slider_gives_the_same_switches_for_longer() {
    compare_the_thesis_slider(0.2);
}

fn compare_the_thesis_slider(duration_s: f64) {
    for set in ["as-coded", "as-stated"] {
        let set = [format!("parameter_set={set}"), format!("time.duration_s={duration_s}")];
        let compared = compare("default", &plan("default", &set), TOLERANCE);
        assert!(compared.switches > 0, "{:?}", compared.counters);
        assert_eq!(compared.switches as u64, compared.counters.switches, "all of it");
        assert!(compared.counters.plain_steps < 200_000, "{:?}", compared.counters);
    }
}

/// A long chain: parameter set, drive, its velocity, steps, and tolerance.
type LongChain = (&'static str, &'static str, f64, u64, f64);

#[test]
fn long_chains_jump_by_waves() {
    // Blocks move so far that the rounding of displacements, over the step, dominates that of
    // velocities.
    jump_by_waves(&[("as-stated", "top", 3e-2, 1_000_000, 10.0 * TOLERANCE)]);
}

#[test]
#[ignore = "half a minute of single steps: cargo xtask nightly"]
fn long_chains_that_are_pushed_jump_by_waves() {
    jump_by_waves(&[
        ("as-coded", "side", 4e-4, 3_000_000, TOLERANCE),
        ("as-stated", "side", 4e-4, 3_000_000, TOLERANCE),
    ]);
}

fn jump_by_waves(chains: &[LongChain]) {
    for &(set, drive, velocity_m_per_s, steps, tolerance) in chains {
        let set = [
            "slider.blocks=600".to_owned(),
            format!("time.duration_s={steps}e-8"),
            format!("parameter_set={set}"),
            format!("drive.kind={drive}"),
            format!("drive.velocity_m_per_s={velocity_m_per_s}"),
            "friction.static_spread=0.2".to_owned(),
        ];
        let plan = plan("default", &set);
        let Compared { counters, switches, horizon_step } = compare("600 blocks", &plan, tolerance);
        assert_eq!(horizon_step, plan.steps, "all of it");
        assert!(counters.jumps > 3 && 10 * counters.jump_steps > 9 * plan.steps, "{set:?} {counters:?}");
        assert!(switches > 20 && counters.window_steps > 1_000, "{set:?} {switches} {counters:?}");
    }
}

/// A long chain near its first slips, and far beyond: with both parameter sets, driven from the side and
/// from the top, with time steps from short to half the longest, with uniform friction and scattered.
fn random_long_scenario(seed: u64) -> Vec<String> {
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
    [base, own.to_vec()].concat()
}

/// Compares a range of random long chains, and checks that shortcuts were used between many switches.
fn compare_random_long(seeds: std::ops::Range<u64>) {
    let count = seeds.end - seeds.start;
    let (mut total, mut chaotic) = (Counters::default(), Vec::new());
    for seed in seeds {
        let set = random_long_scenario(seed);
        let plan = plan("default", &set);
        let Compared { counters, switches, horizon_step } =
            compare(&format!("seed {seed} {set:?}"), &plan, EXTREME_TOLERANCE);
        total.switches += switches as u64;
        total.jumps += counters.jumps;
        total.jump_steps += counters.jump_steps;
        total.window_steps += counters.window_steps;
        if horizon_step < plan.steps {
            chaotic.push((seed, horizon_step));
        }
    }
    assert!(total.switches > 400 * count && total.jumps > count, "{total:?}");
    assert!(total.jump_steps > 6_000 * count && total.window_steps > 3_000 * count, "{total:?}");
    assert_eq!(chaotic, []);
}

#[test]
fn random_long_chains_give_the_same_switches() {
    compare_random_long(0..20);
}

#[test]
fn a_chain_without_modes_takes_windows() {
    // Only the softest friction springs restrain this chain: in double precision its lowest mode is
    // indistinguishable from rest.
    let plan = plan::<&str>("ring-down", &[]);
    let Compared { counters, horizon_step, .. } = compare("ring-down", &plan, TOLERANCE);
    assert_eq!(horizon_step, plan.steps, "all of it");
    assert!(counters.jumps == 0 && counters.window_steps > 15_000, "{counters:?}");
    assert_eq!(SolverKind::Fast.start(plan).fallbacks().len(), 1);
}

#[test]
fn cadences_never_change_a_bit_of_the_run() {
    let switches = |set: &[&str]| {
        let mut all = vec!["time.duration_s=0.3".to_owned()];
        all.extend(set.iter().map(|assignment| (*assignment).to_owned()));
        let (records, _) = run(SolverKind::Fast.start(plan("default", &all)));
        steps(&records).into_iter().filter(|record| !record.switches.is_empty()).cloned().collect::<Vec<_>>()
    };
    let usual = switches(&[]);
    let often = switches(&["recording.sample_s=3e-6", "recording.fields_s=7e-5"]);
    let never = switches(&["recording.sample_s=0", "recording.fields_s=0", "recording.event_fields=false"]);
    assert!(usual.len() > 50);
    assert_eq!(usual, often);
    assert_eq!(usual, never);
    // Long chains.
    for (long, sample) in [
        (&["slider.blocks=600", "time.duration_s=0.05"][..], "recording.sample_s=3e-6"),
        // With many single steps.
        (
            &[
                "slider.blocks=3000",
                "parameter_set=as-stated",
                "drive.velocity_m_per_s=0.008231330882585005",
                "time.step_s=3.78e-9",
                "time.duration_s=1.134e-4",
                "recording.fields_s=0",
            ],
            "recording.sample_s=1.3986e-7",
        ),
    ] {
        let usual = switches(&[long, &["recording.sample_s=0"]].concat());
        assert!(usual.len() > 50, "{}", usual.len());
        assert_eq!(usual, switches(&[long, &[sample]].concat()));
    }
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
        let (records, counters) = run(SolverKind::Fast.start(plan("ring-down", &set)));
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

#[test]
fn a_restored_state_continues_to_the_bit() {
    let cases: [&[&str]; 8] = [
        &["time.duration_s=0.15"],
        // Long chains: waves, windows of most lengths, and no windows for long steps.
        &["slider.blocks=600", "time.duration_s=0.02", "recording.sample_s=1e-5"],
        &[
            "slider.blocks=600",
            "parameter_set=as-stated",
            "time.step_s=1.6e-8",
            "time.duration_s=0.016",
            "recording.sample_s=1.6e-5",
            "recording.fields_s=1.6e-3",
        ],
        &[
            "slider.blocks=600",
            "parameter_set=as-stated",
            "time.step_s=4e-8",
            "time.duration_s=0.02",
            "recording.sample_s=1e-5",
        ],
        // States of ruptures, inside windows.
        &[
            "time.duration_s=0.15",
            "recording.rupture_fields_from_blocks=2",
            "recording.rupture_fields_s=1e-5",
        ],
        // An unloaded block that chatters until the credit of saved steps is used up.
        &["normal_load.tilt=1", "time.step_s=1e-7", "time.duration_s=0.004"],
        // Windows that cost as much as they save.
        &[
            "parameter_set=as-stated",
            "friction.interfacial_stiffness_ratio=1e3",
            "initial_velocity.amplitude_m_per_s=1e-3",
            "time.duration_s=0.002",
        ],
        // Samples so dense that single steps connect them.
        &["time.duration_s=0.002", "recording.sample_s=1e-7"],
    ];
    for set in cases {
        let plan = plan("default", set);
        let (whole, _) = run(SolverKind::Fast.start(plan.clone()));
        let mut solver = SolverKind::Fast.start(plan.clone());
        for part in 1..7 {
            for _ in 0..whole.len() / 7 {
                solver.next_record().unwrap();
            }
            while !solver.is_between_records() {
                solver.next_record().unwrap();
            }
            let snapshot = solver.snapshot();
            let mut other = SolverKind::Fast.start(plan.clone());
            other.restore(&snapshot);
            let rest: Vec<Record> = std::iter::from_fn(|| other.next_record().unwrap()).collect();
            let expected: Vec<&Record> =
                whole.iter().filter(|record| record.step() > snapshot.slider.step).collect();
            assert!(rest.iter().eq(expected), "{set:?}, part {part}, from step {}", snapshot.slider.step);
        }
    }
}

/// The cost of windows is counted in terms; a term takes about as long as a step.
#[test]
fn windows_that_do_not_pay_are_hardly_tried() {
    let set = ["parameter_set=as-stated", "friction.interfacial_stiffness_ratio=1e3", "time.duration_s=0.01"];
    let (_, counters) = run(SolverKind::Fast.start(plan("default", &set)));
    assert!(counters.windows > 0 && counters.applications < counters.steps() / 20, "{counters:?}");
}

/// Here the cancelling parts of the longest windows far exceed the velocity of a block that creeps.
#[test]
fn creeping_blocks_take_windows_of_the_length_that_is_certified() {
    let set = ["friction.interfacial_stiffness_ratio=10", "time.duration_s=0.05"];
    let (_, counters) = run(SolverKind::Fast.start(plan("first-precursor", &set)));
    assert!(counters.window_steps > 500_000, "{counters:?}");
    assert!(counters.plain_steps < counters.window_steps / 4, "{counters:?}");
    assert!(counters.applications < counters.window_steps / 2, "{counters:?}");
}

/// Computing a sample takes as long as many steps.
#[test]
fn samples_close_to_each_other_are_those_of_the_plain_solver() {
    let set = ["recording.sample_s=3e-8", "time.duration_s=0.0005"];
    let plan = plan("ring-down", &set);
    let compared = compare("ring-down", &plan, TOLERANCE);
    assert!(compared.counters.window_steps > 45_000, "{:?}", compared.counters);
}
