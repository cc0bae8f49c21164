//! Fronts read off the switches of a run: when they came to each block, how fast they ran, what
//! they left behind.

use asperity_model::front::{Front, relative_prestress};
use asperity_record::{Direction, Switch};

use crate::run_data::RunData;

/// What happened to a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Passage {
    /// The block, counted from 1.
    pub(crate) block: u32,
    /// Time of the first step in which it slid.
    pub(crate) arrival_s: f64,
    /// Time of the first step after the last one in which it slid; None if it slid at the end.
    pub(crate) stop_s: Option<f64>,
    /// How far it slid between the two.
    pub(crate) slip_m: Option<f64>,
}

/// The blocks that a front has passed which came from block 1: all up to the first one that never
/// slid.
pub(crate) fn passages(run: &RunData) -> Vec<Passage> {
    let mut first: Vec<Option<(u64, &Switch)>> = vec![None; run.plan.blocks];
    let mut last = first.clone();
    for record in &run.steps {
        for switch in &record.switches {
            let block = switch.block as usize - 1;
            first[block].get_or_insert((record.step, switch));
            last[block] = Some((record.step, switch));
        }
    }
    // A switch takes effect in the next step.
    let after = |step: u64| run.plan.grid.time_s(step + 1);
    let pairs = first.into_iter().zip(last).map_while(|(first, last)| first.zip(last)).zip(1..);
    pairs
        .map(|(((first_step, first), (last_step, last)), block)| {
            let stopped = last.direction == Direction::Attach;
            Passage {
                block,
                arrival_s: after(first_step),
                stop_s: stopped.then(|| after(last_step)),
                slip_m: stopped.then(|| last.displacement_m - first.displacement_m),
            }
        })
        .collect()
}

/// The blocks over which a front is taken to be steady: from the middle of the slider to 11/12 of
/// it, 300 to 550 of 600. Transients are over before; waves from the far end have not come yet.
pub(crate) fn steady_span(blocks: usize) -> std::ops::RangeInclusive<usize> {
    blocks / 2..=blocks * 11 / 12
}

/// The time in which the chain's waves cross a block, `a / c = sqrt(m / k)`.
pub(crate) fn crossing_s(run: &RunData) -> f64 {
    (run.plan.block_mass_kg / run.plan.elastic.stiffness_n_per_m()).sqrt()
}

/// The passages of the blocks of the steady span; None if the front did not come to all of them.
fn steady(run: &RunData) -> Option<Vec<Passage>> {
    let span = steady_span(run.plan.blocks);
    let passages = passages(run);
    let steady = passages.get(span.start() - 1..*span.end())?.to_vec();
    (steady.len() > 1).then_some(steady)
}

/// Speed of the front over the wave speed: the straight line through the arrivals at the blocks
/// of the steady span, by least squares.
///
/// A median of delays would not do: without damping each delay is a whole number of steps.
pub(crate) fn speed_over_c(run: &RunData) -> Option<f64> {
    let steady = steady(run)?;
    let count = steady.len() as f64;
    let (x, t) = steady.iter().fold((0.0, 0.0), |(x, t), passage| {
        (x + f64::from(passage.block) / count, t + passage.arrival_s / count)
    });
    let (xx, xt) = steady.iter().fold((0.0, 0.0), |(xx, xt), passage| {
        let from_mean = f64::from(passage.block) - x;
        (xx + from_mean * from_mean, xt + from_mean * (passage.arrival_s - t))
    });
    (xt > 0.0).then(|| xx / xt * crossing_s(run))
}

/// Speed of the front between neighbours over the wave speed: the later one of the two, and the
/// speed. Blocks that a front from block 1 did not reach after their neighbour are left out.
pub(crate) fn local_speeds(run: &RunData) -> Vec<(f64, f64)> {
    let crossing_s = crossing_s(run);
    let took = |pair: &[Passage]| pair[1].arrival_s - pair[0].arrival_s;
    let passages = passages(run);
    let forward = passages.windows(2).filter(|pair| took(pair) > 0.0);
    forward.map(|pair| (f64::from(pair[1].block), crossing_s / took(pair))).collect()
}

/// The theory for the run, with the prestress of the middle block.
pub(crate) fn theory(run: &RunData) -> Option<Front> {
    Front::of(&run.plan, run.plan.blocks / 2)
}

/// The displacement that strains a spring between blocks by `(mu_s - mu_d) p`, in the middle.
pub(crate) fn unit_m(run: &RunData) -> f64 {
    let (friction, middle) = (&run.plan.friction, run.plan.blocks / 2);
    (friction.static_threshold_n[middle] - friction.dynamic_friction_n[middle])
        / run.plan.elastic.stiffness_n_per_m()
}

/// Deviation of the speed from the theory, over it.
pub(crate) fn speed_error(run: &RunData) -> Option<f64> {
    Some(speed_over_c(run)? / theory(run)?.speed_over_c()? - 1.0)
}

/// How many blocks a pulse is long: its speed times the mean time for which a block slides, over
/// the steady span.
pub(crate) fn pulse_length_blocks(run: &RunData) -> Option<f64> {
    let steady = steady(run)?;
    let slid_s: Option<f64> = steady.iter().map(|passage| Some(passage.stop_s? - passage.arrival_s)).sum();
    Some(speed_over_c(run)? * slid_s? / steady.len() as f64 / crossing_s(run))
}

/// The mean slip behind a pulse over the steady span, over that of the theory without damping.
pub(crate) fn pulse_slip_ratio(run: &RunData) -> Option<f64> {
    let steady = steady(run)?;
    let slip_m: Option<f64> = steady.iter().map(|passage| passage.slip_m).sum();
    Some(slip_m? / steady.len() as f64 / unit_m(run) / theory(run)?.pulse_slip()?)
}

/// The relative prestress of the last block that the front reached; None if it reached all, or
/// if something still slid at the end of the run.
pub(crate) fn arrest_prestress(run: &RunData) -> Option<f64> {
    let passages = passages(run);
    let over = passages.iter().all(|passage| passage.stop_s.is_some());
    let last = passages.last().filter(|last| over && (last.block as usize) < run.plan.blocks)?;
    relative_prestress(&run.plan, last.block as usize - 1)
}
