//! Radiation damping of rigid contacts and of friction springs: both solvers agree switch by switch, and on all
//! energies, which balance.

use asperity_model::Plan;
use asperity_record::Record;
use asperity_simulator::{SliderState, SolverKind};
use asperity_testkit::{Random, balance_j, plan};

mod fast_and_plain;

use fast_and_plain::{
    Compared, entries, from_state, recording_changes_nothing, resumes_to_the_bit, run, samples_agree,
};

/// A chain of any law that radiates, over a hundred thousand steps, with `sqrt(k m)` from 0.02 to 20 of it.
fn random_chain(seed: u64) -> Vec<String> {
    let mut noise = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 5);
    let blocks: u32 = noise.pick(&[2, 3, 5, 8, 13, 24, 40]);
    let mass_kg = noise.log_uniform(1e-2, 3.0);
    let (k, m) = (2.5e9 * f64::from(blocks - 1) * 1e-4 / 0.1, mass_kg / f64::from(blocks));
    let alpha = noise.log_uniform(0.02, 20.0);
    let eta = noise.pick(&[0.0, 0.0, 0.3]);
    let ratio = noise.log_uniform(0.1, 10.0);
    let drive_n_per_m = noise.log_uniform(1e5, 1e8);
    let omega2 = (4.0 * k + ratio * k + drive_n_per_m) / m;
    let gamma = (4.0 * eta + alpha) * (k / m).sqrt();
    let step_s = ((gamma * gamma + 4.0 * omega2).sqrt() - gamma) / omega2 * noise.log_uniform(0.01, 0.3);
    let step_s = format!("{step_s:.2e}").parse::<f64>().unwrap();
    let steps = 100_000.0;
    let mu_s = noise.uniform(0.2, 1.2);
    let reach_m = 400.0 * mu_s * (1.0 / drive_n_per_m + 1.0 / k) * noise.uniform(1.0, 4.0);
    let mut set = vec![
        format!("slider.blocks={blocks}"),
        format!("slider.mass_kg={mass_kg}"),
        format!("slider.relative_damping={eta:?}"),
        format!("friction.static_coefficient={mu_s}"),
        format!("friction.dynamic_coefficient={}", mu_s * noise.uniform(0.2, 0.9)),
        format!("friction.radiation_kg_per_s={}", alpha * (k * m).sqrt()),
        format!("drive.kind={}", noise.pick(&["side", "top"])),
        format!("drive.stiffness_n_per_m={drive_n_per_m}"),
        format!("drive.velocity_m_per_s={}", reach_m / (steps * step_s)),
        format!("normal_load.tilt={}", noise.pick(&[0.0, 0.5])),
        format!("prestress.ratio={}", noise.pick(&[0.0, 0.2 * mu_s])),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", step_s * steps),
        format!("recording.sample_s={}", step_s * 997.0),
        format!("recording.fields_s={}", step_s * 20_000.0),
    ];
    match noise.pick(&[0, 1, 2]) {
        0 => set.push("friction.law=rigid".to_owned()),
        rule => {
            set.push(format!("friction.interfacial_stiffness_ratio={ratio}"));
            set.push(format!("friction.reattach={}", ["one-way", "two-way"][rule as usize - 1]));
        }
    }
    if noise.pick(&[false, true]) {
        let times_s = [0.3, 0.8].map(|share| share * steps * step_s);
        set.push(format!("normal_load.schedule_s={times_s:?}"));
        set.push("normal_load.schedule_n=[400, 250]".to_owned());
    }
    set
}

fn compare(seeds: std::ops::Range<u64>) {
    let (mut compared, count) = (Compared::default(), seeds.end - seeds.start);
    let mut radiating = 0;
    for seed in seeds {
        let set = random_chain(seed);
        let plan = plan("default", &set);
        compared.add(seed, &set, &plan, false);
        for kind in [SolverKind::Plain, SolverKind::Fast] {
            let (records, ..) = run(&plan, kind);
            let (off_j, largest_j) = balance_j(&records);
            assert!(off_j <= 1e-9 * largest_j, "seed {seed} {set:?}: {off_j} of {largest_j} J");
            let last = records.iter().rev().find_map(|record| match record {
                Record::Step(step) => step.energy,
                _ => None,
            });
            let last = last.expect("the run has energies");
            let radiated_j = last.radiated_j.expect("the run radiates");
            radiating += u64::from(radiated_j > 1e-3 * last.friction_heat_j);
            let (heat_j, lost_j) = (last.friction_heat_j, last.viscous_loss_j);
            assert!(
                radiated_j > -1e-9 * largest_j && heat_j >= 0.0 && lost_j > -1e-9 * largest_j,
                "{last:?}"
            );
        }
    }
    let total = compared.total;
    assert!(total.switches > 40 * count && radiating > count, "{total:?}, {radiating} radiate");
    assert!(total.window_steps > 5_000 * count && total.jump_steps > 10_000 * count, "{total:?}");
    assert!(compared.stopped.len() as u64 <= count / 10 && compared.ties.is_empty(), "{compared:?}");
}

#[test]
fn random_chains_that_radiate_switch_alike() {
    compare(0..8);
}

/// The seeds that are left; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_chains_that_radiate_switch_alike() {
        compare(8..200);
    }
}

/// Ten blocks on friction springs, half critically damped by radiation where they slide.
fn small(sets: &[&str]) -> Plan {
    let own = [
        "slider.relative_damping=0",
        "friction.radiation_kg_per_s=2600",
        "drive.velocity_m_per_s=0.02",
        "time.step_s=1e-7",
        "time.duration_s=0.06",
    ];
    plan("ten-blocks", &[&own, sets].concat())
}

#[test]
fn what_is_recorded_changes_nothing() {
    let counters = recording_changes_nothing(small);
    assert!(counters.jumps > 0 && counters.windows > 20 && counters.switches > 20, "{counters:?}");
}

/// Samples inside windows and jumps, states and energies, equal those of single steps.
#[test]
fn samples_are_those_of_single_steps() {
    for sets in [&[][..], &["friction.reattach=two-way"], &["drive.hold_from_s=0.03"]] {
        let sets = [sets, &["recording.sample_s=1e-5", "recording.fields_s=1e-3"]].concat();
        samples_agree(&small(&sets), 20_000);
    }
}

#[test]
fn a_run_that_is_resumed_is_the_run() {
    let inside = resumes_to_the_bit(&small(&["recording.sample_s=1e-3"]), 1);
    assert!(inside > 20, "{inside}");
}

/// All equations of a chain that slides as one add up to `m dV/dt = sum (tau - mu_d p) - E V`, with `V` the sum of
/// the velocities, since bonds cancel.
#[test]
fn a_chain_slides_up_to_the_speed_at_which_it_radiates_all_work() {
    let sets = [
        "slider.blocks=12",
        "friction.radiation_kg_per_s=40",
        "time.duration_s=2e-3",
        "time.step_s=1e-8",
        "recording.fields_s=1e-4",
    ];
    let plan = plan("front", &sets);
    let (found, _) = from_state(&plan, &SliderState::initial(&plan));
    assert!(found.iter().any(|(_, sliding, _)| *sliding == 12), "{found:?}");
    let pushes = plan.prestress_n.iter().zip(&plan.friction.dynamic_friction_n);
    let steady_m_per_s = pushes.map(|(push, friction)| push - friction).sum::<f64>() / 40.0;
    for kind in [SolverKind::Plain, SolverKind::Fast] {
        let (records, counters, _) = run(&plan, kind);
        assert_eq!(counters.windows > 10, kind == SolverKind::Fast, "{counters:?}");
        let Some(Record::Fields(state)) = records.last() else { panic!("the last record is a state") };
        let speed_m_per_s: f64 = state.velocity_m_per_s.iter().sum();
        assert!((speed_m_per_s / steady_m_per_s - 1.0).abs() < 1e-6, "{speed_m_per_s} {steady_m_per_s}");
        let at =
            |records: &[Record]| entries(records).into_iter().filter(|entry| !entry.2.is_empty()).count();
        assert_eq!(at(&records), found.iter().filter(|entry| !entry.2.is_empty()).count());
    }
}
