//! Contacts of junctions: single steps of a chain beside the law applied to every junction, and of chain and slab beside
//! Amontons-Coulomb contacts.

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_testkit::DirectChain;

use crate::{ROUNDS, first_steps, median, seconds};

/// Steps in one measurement, up to the first slip of the whole chain, and behind the first precursor of the slab.
const CHAIN_STEPS: u64 = 3_000_000;
const SLAB_STEPS: u64 = 1_000_000;

/// Steps with every junction in each, which take as long whatever the junctions do.
const DIRECT_STEPS: u64 = 50_000;

fn plan(scenario: &str, sets: &[&str]) -> Plan {
    Plan::new(&resolve(scenario, sets).unwrap_or_else(|error| panic!("{error}")))
}

/// Medians of the rounds of several measurements, one after the other in each round.
fn medians<const N: usize>(measure: impl Fn() -> [f64; N]) -> [f64; N] {
    let rounds: Vec<[f64; N]> = (0..ROUNDS).map(|_| measure()).collect();
    std::array::from_fn(|n| median(rounds.iter().map(|round| round[n]).collect()))
}

pub(crate) fn junctions() {
    println!("## Contacts of 100 junctions: a step\n");
    println!(
        "| | time of a step, ns | over Amontons-Coulomb | every junction in every step |\n|---|---|---|---|"
    );
    let sets = ["recording.sample_s=0"];
    let chain = plan("chain-junctions", &sets);
    let simple = plan("chain-junctions", &[&sets[..], &["friction.law=interfacial-springs"]].concat());
    let [ours, beside, direct] = medians(|| {
        let [ours, beside] = [&chain, &simple].map(|plan| first_steps(plan, CHAIN_STEPS).0);
        let mut direct = DirectChain::of(chain.clone());
        let direct_s = seconds(|| (0..DIRECT_STEPS).for_each(|_| direct.step(|_, _| {})));
        [ours, beside, direct_s * 1e9 / DIRECT_STEPS as f64]
    });
    println!("| chain of 50 | {ours:.0} | {:.2} | {:.2} |", ours / beside, direct / ours);
    let slab = plan("slab-junctions", &sets);
    let simple = [&sets[..], &["friction.law=interfacial-springs"]].concat();
    let simple =
        plan("slab-junctions", &[&simple[..], &["friction.interfacial_stiffness_ratio=0.8512"]].concat());
    let [ours, beside] = medians(|| [&slab, &simple].map(|plan| first_steps(plan, SLAB_STEPS).0));
    println!("| slab of 57 x 31 | {ours:.0} | {:.2} | - |\n", ours / beside);
}
