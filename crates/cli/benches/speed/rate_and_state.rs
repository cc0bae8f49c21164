//! Rate-and-state friction: steps beside those of an independent program with the same method, and their time.

use asperity_record::Record;
use asperity_simulator::SolverKind;

use crate::{ROUNDS, loop_ns, median, plan, seconds};

/// Runs: name, scenario, overrides, and the steps that the independent program took.
const RUNS: [(&str, &str, &[&str], u64); 5] = [
    ("slider, 300 s, tolerance 1e-7", "spring-slider", &[], 8170),
    ("chain of 16, 6 s, 1e-5", "rate-and-state", &["time.tolerance=1e-5"], 5655),
    ("chain of 16, 6 s, 1e-6", "rate-and-state", &["time.tolerance=1e-6"], 9979),
    ("chain of 16, 6 s, 1e-7", "rate-and-state", &[], 17_752),
    (
        "chain of 100, driven from the side, 4 s, 1e-6",
        "default",
        &[
            "parameter_set=as-stated",
            "friction.law=rate-and-state",
            "friction.evolution_effect=0.015",
            "friction.critical_slip_m=1e-7",
            "time.tolerance=1e-6",
            "time.duration_s=4",
        ],
        100_000,
    ),
];

pub(crate) fn rate_and_state() {
    println!("## Rate-and-state friction\n");
    println!(
        "| run | steps | over the independent program's | slip events | steps per event | ns per block and step | over \
         a block's step of the loop in C |\n|---|---|---|---|---|---|---|"
    );
    let block_ns = loop_ns(&plan(&[])) / 100.0;
    for (name, scenario, sets, independent) in RUNS {
        let plan = asperity_testkit::plan(scenario, sets);
        let (mut steps, mut events) = (0, 0);
        let rounds = (0..ROUNDS).map(|_| {
            let mut solver = SolverKind::Adaptive.start(plan.clone());
            let mut slid = false;
            events = 0;
            let elapsed_s = seconds(|| {
                while let Some(record) = solver.next_record().expect("the run stays finite") {
                    if let Record::Step(step) = record {
                        events += u64::from(step.sliding > 0 && !slid);
                        slid = step.sliding > 0;
                    }
                }
            });
            let counters = solver.counters();
            steps = counters.adaptive_steps;
            elapsed_s * 1e9 / ((steps + counters.rejected_steps) * plan.blocks as u64) as f64
        });
        let ns = median(rounds.collect());
        let share = steps as f64 / independent as f64;
        let per_event = steps.checked_div(events).unwrap_or(0);
        println!(
            "| {name} | {steps} | {share:.3} | {events} | {per_event} | {ns:.0} | {:.0} |",
            ns / block_ns
        );
    }
    println!();
}
