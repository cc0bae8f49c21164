//! Fronts from the switches of a run: their arrival at each block, their speed, and the slip behind them.

use std::collections::BTreeMap;

use asperity_model::theory::front::{Front, relative_prestress};
use asperity_model::theory::weakening::pulled_speed;
use asperity_record::{Arrival, Direction, magnitude};

use crate::precursors::{PrecursorRules, among_ruptures};
use crate::run_data::{OfFronts, RunEvents};
use crate::statistics::quantile;

/// The passage of a front at a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// The block, counted from 1.
    pub block: u32,
    /// Time of the first step in which it slid.
    pub arrival_s: f64,
    /// Time of the first step after the last one in which it slid; None if it slid at the end.
    pub stop_s: Option<f64>,
    /// Its slip between the two.
    pub slip_m: Option<f64>,
}

/// The blocks passed by a front from block 1: all up to the first one that never slid.
pub fn passages(run: &RunEvents) -> Vec<Passage> {
    // A switch takes effect in the next step.
    let after = |step: u64| run.plan.grid.time_s(step + 1);
    let slid = run.switches.iter().map_while(|switched| switched.as_ref()).zip(1..);
    slid.map(|([first, last], block)| {
        let stopped = last.direction == Direction::Attach;
        Passage {
            block,
            arrival_s: after(first.step),
            stop_s: stopped.then(|| after(last.step)),
            slip_m: stopped.then_some(last.displacement_m - first.displacement_m),
        }
    })
    .collect()
}

/// The blocks over which a front is assumed to be steady: from the middle of the slider to 11/12 of it, 300
/// to 550 of 600. Transients have decayed before; waves from the far end have not arrived yet.
pub fn steady_span(blocks: usize) -> std::ops::RangeInclusive<usize> {
    (blocks / 2).max(1)..=blocks * 11 / 12
}

/// The time in which the chain's waves cross a block, `a / c = sqrt(m / k)`.
pub fn crossing_s(run: &RunEvents) -> f64 {
    run.plan.scales.block_time_s
}

/// The passages of the blocks of the steady span; None if the front did not reach all of them.
fn steady(run: &RunEvents) -> Option<Vec<Passage>> {
    let span = steady_span(run.plan.blocks);
    let passages = passages(run);
    let steady = passages.get(span.start() - 1..*span.end())?.to_vec();
    (steady.len() > 1).then_some(steady)
}

/// Speed of the front over the wave speed: the straight line through the arrivals at the blocks
/// of the steady span, by least squares.
///
/// A median of delays would not do: without damping each delay is a whole number of steps.
pub fn speed_over_c(run: &RunEvents) -> Option<f64> {
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
pub fn local_speeds(run: &RunEvents) -> Vec<(f64, f64)> {
    let crossing_s = crossing_s(run);
    let took = |pair: &[Passage]| pair[1].arrival_s - pair[0].arrival_s;
    let passages = passages(run);
    let forward = passages.windows(2).filter(|pair| took(pair) > 0.0);
    forward.map(|pair| (f64::from(pair[1].block), crossing_s / took(pair))).collect()
}

/// Default number of spacings over which a speed is measured: between two neighbours the time is a whole
/// number of steps, and it jumps where an earlier rupture has left a peak of stress.
pub const ACROSS: u32 = 4;

/// Fewest blocks of a rupture that has such a speed.
pub const FROM_BLOCKS: u32 = ACROSS + 1;

/// Fronts below this share of the wave speed are slow.
pub const SLOW: f64 = 0.1;

/// Local speeds of the fronts of a rupture over the wave speed, given its arrivals. Two blocks `across`
/// spacings apart have one if both are on one side of the nucleation block, or one of them is it: their
/// distance over the time from the arrival at the nearer one to that at the farther one. Stretches that a
/// front passed in no time or backwards are left out. Before each speed is the lower-numbered block.
fn speeds_of_rupture(arrivals: &[Arrival], across: u32, crossing_s: f64) -> Vec<(u32, f64)> {
    let first = arrivals.iter().min_by_key(|arrival| (arrival.arrival_step, arrival.block));
    let Some(nucleation) = first.map(|arrival| arrival.block) else { return Vec::new() };
    let at: BTreeMap<u32, f64> = arrivals.iter().map(|arrival| (arrival.block, arrival.arrival_s)).collect();
    let speed = |(&block, from_s): (&u32, &f64)| {
        let other = block.saturating_add(across);
        let took_s = match at.get(&other)? - from_s {
            took_s if block >= nucleation => took_s,
            took_s if other <= nucleation => -took_s,
            _ => return None,
        };
        (took_s > 0.0).then(|| (block, f64::from(across) * crossing_s / took_s))
    };
    at.iter().filter_map(speed).collect()
}

/// Local speeds of the fronts of a rupture over an area, over the wave speed, each after its contact.
fn speeds_over_area<'a>(
    run: &RunEvents,
    arrivals: &'a [Arrival],
) -> impl Iterator<Item = (&'a Arrival, f64)> {
    let wave_m_per_s = run.plan.scales.wave_speed_m_per_s();
    let speed = move |arrival: &Arrival| Some(arrival.local_speed_m_per_s? / wave_m_per_s);
    arrivals.iter().filter_map(move |arrival| Some((arrival, speed(arrival)?)))
}

/// Local speeds of the fronts of all ruptures of `from_blocks` or more, over the wave speed; `None` where
/// the log has no ruptures. Over an area they are those of the arrivals, by the contacts around each, whatever
/// `across` is.
pub fn speeds(run: &RunEvents, arrivals: &[Arrival], from_blocks: u32, across: u32) -> Option<Vec<f64>> {
    run.ruptures.as_ref()?;
    let ruptures = arrivals.chunk_by(|a, b| a.rupture == b.rupture);
    let counted = ruptures.filter(|passed| passed.len() >= from_blocks as usize);
    Some(counted.flat_map(|passed| local_speeds_of(run, passed, across)).collect())
}

/// The arrivals of one rupture, which follow each other.
fn of_rupture(arrivals: &[Arrival], rupture: u64) -> &[Arrival] {
    arrivals.chunk_by(|a, b| a.rupture == b.rupture).find(|of| of[0].rupture == rupture).unwrap_or_default()
}

/// Local speeds of the fronts of one rupture, over the wave speed.
fn local_speeds_of(run: &RunEvents, passed: &[Arrival], across: u32) -> Vec<f64> {
    match run.of_one_row() {
        Some(run) => {
            speeds_of_rupture(passed, across, crossing_s(run)).into_iter().map(|(_, speed)| speed).collect()
        }
        None => speeds_over_area(run, passed).map(|(_, speed)| speed).collect(),
    }
}

/// The number below which a share of the local speeds of the first rupture that reached every block lies, over
/// the wave speed.
pub(crate) fn global_quantile(run: &RunEvents, arrivals: &[Arrival], share: f64) -> Option<f64> {
    let global = run.ruptures_by_onset().into_iter().find(|rupture| rupture.reached_every_block)?;
    let mut speeds = local_speeds_of(run, of_rupture(arrivals, global.rupture), ACROSS);
    speeds.sort_by(f64::total_cmp);
    quantile(&speeds, share)
}

/// Share of the slow ones among local speeds; `None` without any.
pub fn slow_ratio(speeds: &[f64]) -> Option<f64> {
    let slow = speeds.iter().filter(|speed| **speed < SLOW).count();
    (!speeds.is_empty()).then(|| slow as f64 / speeds.len() as f64)
}

/// Local speeds of the fronts of precursors and of the first global slip towards higher-numbered blocks,
/// over the wave speed, each preceded by the stress ahead of the front: the mean of `tau_n / p_n` over the
/// blocks between which the speed is measured, in the state at the onset of the slip event in which the
/// rupture began. Over an area the speed and the stress, by the size of the tangential force, are those of a
/// contact that bears load, in the column of nucleation or beyond. (When a front reaches a block, the block is at its threshold, by the definition of
/// detachment.)
pub fn over_stress(
    run: &RunEvents,
    (loads, states, arrivals): OfFronts<'_>,
    from_blocks: u32,
    across: u32,
) -> [Vec<(f64, f64)>; 2] {
    let mut all = [Vec::new(), Vec::new()];
    for rupture in among_ruptures(run, &PrecursorRules { min_blocks: from_blocks, merge_gap_s: 0.0 }) {
        let slip = run.slip_steps.event_at(rupture.onset_step);
        let state = slip.and_then(|(_, onset)| states.at_precursor_onset(onset));
        let Some((state, p_n)) = state.and_then(|state| Some((state, run.normal_load_n(loads, state)?)))
        else {
            continue;
        };
        let of = of_rupture(arrivals, rupture.rupture);
        let found = &mut all[usize::from(rupture.reached_every_block)];
        if run.of_one_row().is_none() {
            let nucleation = run.header.contacts().column(rupture.nucleation_block);
            for (arrival, speed) in speeds_over_area(run, of) {
                let n = arrival.block as usize - 1;
                let (along_n, across_n) = (state.tangential_force_n[n], state.tangential_force_across_n[n]);
                if p_n[n] > 0.0 && arrival.column.is_some_and(|column| column >= nucleation) {
                    found.push((magnitude([along_n, across_n]) / p_n[n], speed));
                }
            }
            continue;
        }
        let speeds = speeds_of_rupture(of, across, crossing_s(run)).into_iter();
        for (block, speed) in speeds.filter(|(block, _)| *block >= rupture.nucleation_block) {
            let passed = block as usize - 1..(block + across) as usize;
            let ratios = state.tangential_force_n[passed.clone()].iter().zip(&p_n[passed]);
            let stress = ratios.map(|(tau_n, p_n)| tau_n / p_n).sum::<f64>() / f64::from(across + 1);
            found.push((stress, speed));
        }
    }
    all
}

/// Correlation of front speed and stress: Spearman's rank correlation over the results of [`over_stress`]
/// for ruptures of [`FROM_BLOCKS`] or more, -1 to 1.
pub fn speed_stress_correlation(run: &RunEvents, passed: OfFronts<'_>) -> Option<f64> {
    let points = over_stress(run, passed, FROM_BLOCKS, ACROSS).concat();
    let ranks = |of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        // Equals share the mean of their ranks.
        let rank = |value: f64| {
            let below = points.iter().filter(|point| of(point) < value).count();
            let equal = points.iter().filter(|point| of(point) == value).count();
            below as f64 + 0.5 * (equal as f64 - 1.0)
        };
        points.iter().map(|point| rank(of(point))).collect()
    };
    let (stress, speed) = (ranks(|point| point.0), ranks(|point| point.1));
    let middle = (points.len() as f64 - 1.0) / 2.0;
    let product =
        |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - middle) * (b - middle)).sum::<f64>();
    let scale = (product(&stress, &stress) * product(&speed, &speed)).sqrt();
    (scale > 0.0).then(|| product(&stress, &speed) / scale)
}

/// The theory for the run, with the prestress of the middle block.
pub fn theory(run: &RunEvents) -> Option<Front> {
    Front::of(&run.plan, run.plan.blocks / 2)
}

/// The displacement that strains a spring between blocks by `(mu_s - mu_d) p`, in the middle; `None` if friction does
/// not weaken.
pub fn unit_m(run: &RunEvents) -> Option<f64> {
    let (friction, middle) = (&run.plan.friction, run.plan.blocks / 2);
    let weakening_n = friction.static_threshold_n[middle] - friction.dynamic_friction_n[middle];
    (weakening_n > 0.0).then(|| weakening_n / run.plan.elastic.stiffness_n_per_m)
}

/// Speed of the front over the wave speed, in theory: of a steady one, or where friction falls over a slip without
/// prestress and losses, of one that the force on block 1 pulls.
pub fn speed_theory(run: &RunEvents) -> Option<f64> {
    let (front, d) = (theory(run)?, theory(run)?.weakening_slip);
    let is_pulled = Front { prestress: 0.0, weakening_slip: 0.0, ..front } == Front::default();
    if is_pulled && d > 0.0 && front.prestress.abs() < 1e-9 {
        return pulled_speed(relative_prestress(&run.plan, 0)?, d);
    }
    front.speed_over_c()
}

/// Deviation of the speed from the theory, over it.
pub fn speed_error(run: &RunEvents) -> Option<f64> {
    Some(speed_over_c(run)? / speed_theory(run)? - 1.0)
}

/// How many blocks a pulse is long: its speed times the mean time for which a block slides, over
/// the steady span.
pub fn pulse_length_blocks(run: &RunEvents) -> Option<f64> {
    let steady = steady(run)?;
    let slid_s: Option<f64> = steady.iter().map(|passage| Some(passage.stop_s? - passage.arrival_s)).sum();
    Some(speed_over_c(run)? * slid_s? / steady.len() as f64 / crossing_s(run))
}

/// The mean slip behind a pulse over the steady span, over that of the theory without damping.
pub fn pulse_slip_ratio(run: &RunEvents) -> Option<f64> {
    let steady = steady(run)?;
    let slip_m: Option<f64> = steady.iter().map(|passage| passage.slip_m).sum();
    Some(slip_m? / steady.len() as f64 / unit_m(run)? / theory(run)?.pulse_slip()?)
}

/// The relative prestress of the last block that the front reached; None if it reached all, or
/// if something still slid at the end of the run.
pub fn arrest_prestress(run: &RunEvents) -> Option<f64> {
    let passages = passages(run);
    let over = passages.iter().all(|passage| passage.stop_s.is_some());
    let last = passages.last().filter(|last| over && (last.block as usize) < run.plan.blocks)?;
    relative_prestress(&run.plan, last.block as usize - 1)
}

#[cfg(test)]
mod tests {
    use asperity_record::{Direction, FieldRecord};

    use super::*;
    use crate::made_up::{self, pulse};
    use crate::required_data::RequiredData;
    use crate::run_data::Switched;

    #[test]
    fn speed_length_and_slip_are_those_of_the_steady_span() {
        let run = pulse(12, "prestress.ratio = 0.6");
        assert_eq!(steady_span(12), 6..=11);
        assert_eq!(steady_span(600), 300..=550);
        assert!(steady_span(1).is_empty(), "one block has no fronts");
        let crossing_s = (12.0 / 12.0 / 2.75e7f64).sqrt();
        assert!((speed_over_c(&run).unwrap() * 1e-7 / crossing_s - 1.0).abs() < 1e-9);
        assert!((pulse_length_blocks(&run).unwrap() - 2.5).abs() < 1e-9);
        // (0.7 - 0.45) * 400 / 12 N at k; 2 tau / gamma = 2 * 0.6 / 0.5.
        let slip = 2e-6 / (0.25 * 400.0 / 12.0 / 2.75e7) / 2.4;
        assert!((pulse_slip_ratio(&run).unwrap() / slip - 1.0).abs() < 1e-9);
        let local = local_speeds(&run);
        assert_eq!(local.len(), 11);
        assert!((local[0].1 * 3e-8 / crossing_s - 1.0).abs() < 1e-9 && local[0].0 == 2.0);
        assert!((local[10].1 * 1e-7 / crossing_s - 1.0).abs() < 1e-9 && local[10].0 == 12.0);
        assert_eq!(arrest_prestress(&run), None, "nothing stopped it");
    }

    #[test]
    fn a_front_that_stops_has_an_end_and_no_speed() {
        let falling: Vec<f64> = (0..12).map(|n| 0.6 - 0.01 * f64::from(n)).collect();
        let mut run = pulse(7, &format!("prestress.profile = {falling:?}"));
        assert_eq!(passages(&run).len(), 7);
        assert_eq!((speed_over_c(&run), pulse_length_blocks(&run)), (None, None));
        // Block 7: (0.54 - 0.45) / 0.25.
        assert!((arrest_prestress(&run).unwrap() - 0.36).abs() < 1e-9);
        // A block that slides at the end may continue to slide; one far away does not belong to this front.
        let [first, last] = run.switches[6].as_mut().unwrap();
        *last = *first;
        assert_eq!(arrest_prestress(&run), None);
        run.switches[9] = run.switches[0];
        assert_eq!(passages(&run).len(), 7);
    }

    #[test]
    fn blocks_that_slide_again_slid_from_first_to_last() {
        let mut run = pulse(12, "prestress.ratio = 0.6");
        let again = Switched { step: 5100, direction: Direction::Attach, displacement_m: 4e-6 };
        run.switches[7].as_mut().unwrap()[1] = again;
        let passage = passages(&run)[7];
        assert!((passage.slip_m.unwrap() - 3e-6).abs() < 1e-15);
        assert!((passage.stop_s.unwrap() - 5.101e-6).abs() < 1e-15);
    }

    /// Twelve blocks that a rupture passes from block 2 on; the ones that bear more, faster.
    #[test]
    fn fronts_are_set_against_the_stress_that_they_found() {
        let delays = [0, 40, 40, 20, 20, 10, 10, 5, 5, 2, 2];
        let mut at = 1000;
        let mut passed: Vec<made_up::Passed> = delays
            .iter()
            .zip(2..)
            .map(|(delay, block)| {
                at += delay;
                (block, at, Some(5000))
            })
            .collect();
        passed.push((1, 1010, Some(5000)));
        passed.sort_by_key(|(_, step, _)| *step);
        let mut run = made_up::run("", &[(1000, 5000, &[1, 2, 3])]);
        (run.header.blocks, run.slips[0].last_block, run.slips[0].blocks_slipped) = (12, 12, 12);
        made_up::with_ruptures(&mut run, &[&passed]);
        let state = FieldRecord {
            step: 1000,
            time_s: run.plan.grid.time_s(1000),
            displacement_m: vec![0.0; 12],
            velocity_m_per_s: vec![0.0; 12],
            tangential_force_n: (0..12).map(f64::from).collect(),
            normal_load_n: vec![10.0; 12],
            stick_position_m: vec![0.0; 12],
            detached: vec![0; 12],
            ..FieldRecord::default()
        };
        run.kept |= RequiredData::fronts();
        made_up::with_states(&mut run, &[state]);
        let passed = run.of_fronts().unwrap();
        let [precursors, global] = over_stress(&run, passed, 5, 4);
        assert!(precursors.is_empty());
        // Block 2 to block 6: 120 steps of 1e-7 s, and 0.1 to 0.5.
        assert!((global[0].0 - 0.3).abs() < 1e-12, "{global:?}");
        assert!((global[0].1 - 4.0 * crossing_s(&run) / 120e-7).abs() < 1e-9, "{global:?}");
        assert_eq!(global.len(), 7, "from block 2 to 6, up to from 8 to 12");
        assert_eq!(speed_stress_correlation(&run, passed), Some(1.0));
        let [_, short] = over_stress(&run, passed, 13, 4);
        assert!(short.is_empty(), "it has twelve blocks");
    }

    /// A rupture that runs both ways from block 6, slowly to block 11 and fast to block 1, which slides
    /// before block 2; one that arrives everywhere at once, and one of four blocks.
    #[test]
    fn local_speeds_are_those_of_all_fronts_away_from_nucleation() {
        let up = [(7, 5000), (8, 10_000), (9, 15_000), (10, 20_000), (11, 40_000)];
        let down = [(6, 0), (5, 10), (4, 20), (3, 30), (2, 50), (1, 35)];
        let passed = |blocks: &[(u32, u64)]| -> Vec<made_up::Passed> {
            blocks.iter().map(|(block, after)| (*block, 1000 + after, None)).collect()
        };
        let at_once: Vec<(u32, u64)> = (1..=9).map(|block| (block, 90_000)).collect();
        let ruptures = [passed(&[&down[..], &up[..]].concat()), passed(&at_once), passed(&up[..4])];
        let mut run = made_up::run("", &[]);
        assert_eq!(speeds(&run, &run.arrivals, FROM_BLOCKS, ACROSS), None, "the log has no ruptures");
        made_up::with_ruptures(&mut run, &ruptures.each_ref().map(Vec::as_slice));
        // From 1 to 5 and from 2 to 6; from 6 to 10 and from 7 to 11; none across block 6.
        let took = [25.0, 50.0, 20_000.0, 35_000.0].map(|steps| steps * 1e-7);
        let found = speeds(&run, run.arrivals().unwrap(), FROM_BLOCKS, ACROSS).unwrap();
        assert_eq!(found.len(), 4, "{found:?}");
        for (speed, took_s) in found.iter().zip(took) {
            assert!((speed * took_s / (4.0 * crossing_s(&run)) - 1.0).abs() < 1e-9, "{found:?}");
        }
        assert_eq!(speeds(&run, &run.arrivals, 4, 3).unwrap().len(), 3 + 3 + 1, "and from 7 to 10");
        let number = |name: &str| crate::number::number(name, &run, None);
        assert_eq!(number("local_front_speed_count"), Some(4.0));
        assert_eq!(number("slow_front_ratio"), Some(slow_ratio(&found).unwrap()));
        assert_eq!((slow_ratio(&[]), slow_ratio(&[0.09, 0.1, 0.0, 7.0])), (None, Some(0.5)));
    }
}
