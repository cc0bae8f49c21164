//! Radiation damping of rigid contacts and of friction springs: both solvers agree switch by switch, and on all
//! energies, which balance.

use asperity_simulator::SolverKind;
use asperity_testkit::{Random, plan};

use crate::fast_and_plain::{compare_random, fields, from_state, last_energy, run, some_chain, switching};

/// A chain of any law that radiates, with `sqrt(k m)` from 0.02 to 20 of it.
fn random_chain(seed: u64) -> (&'static str, Vec<String>) {
    let mut noise = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 5);
    let dampers = |noise: &mut Random| {
        let alpha = noise.log_uniform(0.02, 20.0);
        [noise.pick(&[0.0, 0.0, 0.3]), alpha]
    };
    let (mut set, chain) = some_chain(&mut noise, dampers, 0.0);
    set.push(format!("friction.radiation_kg_per_s={}", chain.radiation_kg_per_s));
    match noise.pick(&[0, 1, 2]) {
        0 => set.push("friction.law=rigid".to_owned()),
        rule => set.extend(chain.springs(rule as usize - 1)),
    }
    if noise.pick(&[false, true]) {
        set.extend(chain.schedule());
    }
    ("default", set)
}

fn compare_chains(seeds: std::ops::Range<u64>) {
    let count = (seeds.end - seeds.start) as usize;
    let mut radiating = 0;
    let found = compare_random(seeds, random_chain, [40, 5_000, 10_000], |set, found| {
        let last = last_energy(&found.fast);
        let radiated_j = last.radiated_j.expect("the run radiates");
        radiating += usize::from(radiated_j > 1e-3 * last.friction_heat_j);
        let little_j = 1e-9 * last.parts().fold(0.0, |most: f64, (_, part_j)| most.max(part_j.abs()));
        assert!(radiated_j > -little_j && last.friction_heat_j >= 0.0, "{set:?} {last:?}");
        assert!(last.viscous_loss_j > -little_j, "{set:?} {last:?}");
    });
    assert!(2 * radiating > count, "{radiating} radiate");
    assert!(found.stopped.len() <= count / 10 && found.ties.is_empty(), "{found:?}");
    assert!(found.parted.is_empty() && found.amplified.is_empty(), "{found:?}");
}

#[test]
fn random_chains_that_radiate_switch_alike() {
    compare_chains(0..8);
}

/// The seeds that are left; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_chains_that_radiate_switch_alike() {
        compare_chains(8..200);
    }
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
    let (found, _) = from_state(&plan, &plan.initial.clone());
    assert!(found.iter().any(|(_, sliding, _)| *sliding == 12), "{found:?}");
    let pushes = plan.prestress_n.iter().zip(&plan.friction.dynamic_friction_n);
    let steady_m_per_s = pushes.map(|(push, friction)| push - friction).sum::<f64>() / 40.0;
    for kind in [SolverKind::Plain, SolverKind::Fast] {
        let (records, counters, _) = run(&plan, kind);
        assert_eq!(counters.windows > 10, kind == SolverKind::Fast, "{counters:?}");
        let speed_m_per_s: f64 =
            fields(&records).last().expect("it is recorded").velocity_m_per_s.iter().sum();
        assert!((speed_m_per_s / steady_m_per_s - 1.0).abs() < 1e-6, "{speed_m_per_s} {steady_m_per_s}");
        let switched = found.iter().filter(|entry| !entry.2.is_empty()).count();
        assert_eq!(switching(&records).len(), switched);
    }
}
