//! A fault line in a medium: an evaluation of its equations, of which the convolution grows as `N log N`, beside a plain
//! convolution of the same length.

use std::f64::consts::PI;
use std::hint::black_box;

use asperity_model::{Plan, RecordingPlan};
use asperity_simulator::SolverKind;

use crate::{ROUNDS, median, seconds};

/// Nodes of the line.
const NODES: [usize; 5] = [400, 800, 1600, 3200, 6400];

/// Evaluations of a step: the first one is the last of the step before.
const EVALUATIONS: u64 = 6;

/// Node pairs of the plain convolution in one measurement.
const PAIRS: usize = 100_000_000;

/// Nanoseconds of an evaluation while BP1-QD creeps, for a time in which steps, which stability bounds, are as many.
fn evaluation_ns(nodes: usize) -> f64 {
    let duration = format!("time.duration_s={}", 3_155_760_000 * 640 / nodes as u64 / 1000 * 1000);
    let plan = asperity_testkit::plan("seas-bp1-qd", &[&*format!("slider.blocks={nodes}"), &*duration]);
    let mut solver = SolverKind::Adaptive.start(Plan { recording: RecordingPlan::default(), ..plan });
    let elapsed_s = seconds(|| while solver.next_record().expect("the run stays finite").is_some() {});
    let counters = solver.counters();
    elapsed_s * 1e9 / (EVALUATIONS * (counters.adaptive_steps + counters.rejected_steps)) as f64
}

/// Nanoseconds of the convolution with its mirror image, by its definition; optimised, as this crate is not.
fn plain_ns(nodes: usize) -> f64 {
    let lag = |m: usize| match m {
        0 => -PI / 4.0,
        _ if m.is_multiple_of(2) => 0.0,
        _ => 1.0 / (PI * (m * m) as f64),
    };
    let lags: Vec<f64> = (0..2 * nodes).map(lag).collect();
    let (mut slip, mut stress) = (vec![1.0; nodes], vec![0.0; nodes]);
    let times = (PAIRS / (nodes * nodes)).max(1);
    let elapsed_s = seconds(|| {
        for _ in 0..times {
            asperity_testkit::mirrored_convolution(&lags, &slip, &mut stress);
            slip[0] += 1e-9 * black_box(&stress)[0];
        }
    });
    elapsed_s * 1e9 / times as f64
}

pub(crate) fn seas() {
    println!("## A fault line in a medium\n");
    println!(
        "| nodes | an evaluation, us | over N log N, ns | plain convolution, us | evaluation over plain convolution |\n\
         |---|---|---|---|---|"
    );
    for nodes in NODES {
        let rounds: Vec<[f64; 2]> = (0..ROUNDS).map(|_| [evaluation_ns(nodes), plain_ns(nodes)]).collect();
        let [own_ns, plain_ns] = [0, 1].map(|n| median(rounds.iter().map(|round| round[n]).collect()));
        let ratio = median(rounds.iter().map(|[own, plain]| own / plain).collect());
        println!(
            "| {nodes} | {:.1} | {:.2} | {:.1} | {ratio:.3} |",
            1e-3 * own_ns,
            own_ns / (nodes as f64 * (nodes as f64).log2()),
            1e-3 * plain_ns,
        );
    }
    println!();
}
