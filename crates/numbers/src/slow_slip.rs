//! Slow slip: how far the contacts that a front has passed still move.

use std::collections::BTreeMap;

use asperity_record::{Arrival, Rupture};

use crate::fronts::FROM_BLOCKS;
use crate::run_data::{NotKept, OfMotion, RunData, RunEvents};
use crate::statistics::median;

/// Time after a front's arrival from which displacement is slow slip, s: the fast slip behind a front of
/// the default slab takes 0.1 ms.
const AFTER_S: f64 = 5e-4;

/// Longest time, s, between the two records from which the displacement at that instant is interpolated: as long as
/// that, and what their times are rounded by.
const APART_S: f64 = AFTER_S * (1.0 + 1e-9);

/// The slow slip behind one rupture.
#[derive(Debug, Clone, Copy)]
pub struct SlowSlip<'a> {
    /// The rupture.
    pub rupture: &'a Rupture,
    /// How many contacts have records 0.5 ms after its arrival; the displacements are of these, m.
    pub contacts: u32,
    /// The median of the displacements up to the last record before the next rupture there, or of the run.
    pub median_m: Option<f64>,
    /// The largest of them.
    pub largest_m: Option<f64>,
    /// The median of the displacements up to `t_link` after the arrival.
    pub until_link_time_m: Option<f64>,
}

/// The slow slip behind each rupture with a contact that has records then, in the order of the log.
///
/// # Errors
/// If the motion of the run, [`RequiredData::motion`](crate::required_data::RequiredData::motion), was not
/// kept.
pub fn slow_slips(run: &RunData) -> Result<Vec<SlowSlip<'_>>, NotKept> {
    let motion = (run.arrivals()?, run.states()?, run.windows()?);
    let link_s = run.header.scales.link_s();
    let moved_m = by_rupture(motion, [f64::INFINITY, link_s]);
    let mut slips = Vec::new();
    for rupture in run.ruptures.iter().flatten() {
        let Some([whole, linked]) = moved_m.get(&rupture.rupture) else { continue };
        let median_of = |moved_m: &[f64]| median(moved_m.iter().copied());
        slips.push(SlowSlip {
            rupture,
            contacts: whole.len() as u32,
            median_m: median_of(whole),
            largest_m: whole.iter().copied().reduce(f64::max),
            until_link_time_m: median_of(linked),
        });
    }
    Ok(slips)
}

/// The displacements of the contacts of each rupture, by its number: from [`AFTER_S`] after the arrival to the
/// last record before the next rupture there, but no later than each of `until_s` after the arrival.
fn by_rupture<const N: usize>(
    (arrivals, states, windows): OfMotion<'_>,
    until_s: [f64; N],
) -> BTreeMap<u64, [Vec<f64>; N]> {
    let mut of_block: BTreeMap<u32, Vec<&Arrival>> = BTreeMap::new();
    arrivals.iter().for_each(|arrival| of_block.entry(arrival.block).or_default().push(arrival));
    let mut by_rupture: BTreeMap<u64, [Vec<f64>; N]> = BTreeMap::new();
    for (block, mut arrivals) in of_block {
        arrivals.sort_by_key(|arrival| arrival.arrival_step);
        let mut course = states.displacement_of(block).to_vec();
        course.extend(windows.iter().filter_map(|record| {
            let place = block.checked_sub(record.first_block)? as usize;
            Some((record.time_s, *record.displacement_m.get(place)?))
        }));
        course.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (place, arrival) in arrivals.iter().enumerate() {
            let next_s = arrivals.get(place + 1).map_or(f64::INFINITY, |next| next.arrival_s);
            for (slot, until_s) in until_s.iter().enumerate() {
                let to_s = next_s.min(arrival.arrival_s + until_s);
                if let Some(moved_m) = moved_m(&course, arrival.arrival_s + AFTER_S, to_s) {
                    let none = || std::array::from_fn(|_| Vec::new());
                    by_rupture.entry(arrival.rupture).or_insert_with(none)[slot].push(moved_m);
                }
            }
        }
    }
    by_rupture
}

/// The median of the slow slip behind the first rupture of [`FROM_BLOCKS`] or more, or of any in a slider of
/// fewer blocks.
pub(crate) fn median_m(run: &RunEvents, motion: OfMotion<'_>, until_s: f64) -> Option<f64> {
    let from_blocks = if run.header.blocks < FROM_BLOCKS { 1 } else { FROM_BLOCKS };
    let first = run.ruptures_by_onset().into_iter().find(|rupture| rupture.slipped() >= from_blocks)?;
    by_rupture(motion, [until_s]).remove(&first.rupture).and_then(|[moved_m]| median(moved_m))
}

/// The displacement from a time to the last record up to another, given times and displacements.
fn moved_m(course: &[(f64, f64)], from_s: f64, to_s: f64) -> Option<f64> {
    let after = course.partition_point(|(time_s, _)| *time_s <= from_s);
    let ((t0, u0), (t1, u1)) = (*course.get(after.checked_sub(1)?)?, *course.get(after)?);
    let end = course.partition_point(|(time_s, _)| *time_s <= to_s);
    let from_m = u0 + (u1 - u0) * (from_s - t0) / (t1 - t0);
    (t1 - t0 <= APART_S && end > after).then(|| course[end - 1].1 - from_m)
}

#[cfg(test)]
mod tests {
    use asperity_record::{FieldRecord, WindowRecord};

    use crate::made_up;
    use crate::number::number;
    use crate::run_data::RunData;

    /// Six blocks that a rupture passes at 0.1 ms, and a second one at 3.1 ms in steps of 0.1 us. Block n
    /// moves by n um a millisecond, and by 100 n um in each rupture.
    fn passed_twice() -> RunData {
        let mut run = made_up::run("", &[]);
        run.header.blocks = 6;
        let rupture = |step: u64| -> Vec<made_up::Passed> {
            (1..=6).map(|block| (block, step, Some(step + 500))).collect()
        };
        made_up::with_ruptures(&mut run, &[&[(1, 10, Some(20))], &rupture(1000), &rupture(31_000)]);
        run
    }

    fn displacement_m(step: u64) -> Vec<f64> {
        let jumps = [1000, 31_000].iter().filter(|jump| step > **jump).count() as f64;
        (1..=6).map(|n| f64::from(n) * 1e-6 * (step as f64 * 1e-4 + 100.0 * jumps)).collect()
    }

    fn with_states_every(steps: usize) -> RunData {
        let mut run = passed_twice();
        let state = |step: u64| FieldRecord {
            step,
            time_s: run.plan.grid.time_s(step),
            displacement_m: displacement_m(step),
            velocity_m_per_s: vec![0.0; 6],
            tangential_force_n: vec![0.0; 6],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 6],
            detached: vec![0; 6],
            ..FieldRecord::default()
        };
        let states: Vec<FieldRecord> = (0..=40_000).step_by(steps).map(state).collect();
        made_up::with_states(&mut run, &states);
        run
    }

    fn is(found: Option<f64>, um: f64) {
        assert!(found.is_some_and(|found| (found * 1e6 - um).abs() < 1e-9), "{found:?}, not {um} um");
    }

    /// From 0.6 ms to 3 ms, where the last state before the second rupture is, in the median 3.5 um a ms.
    #[test]
    fn slow_slip_is_that_between_two_ruptures() {
        let run = with_states_every(2000);
        is(number("slow_slip_m", &run, None), 3.5 * 2.4);
        // Up to 1.1 ms; the last state is that of 1.0 ms.
        is(number("slow_slip_until_m", &run, Some(1e-3)), 3.5 * 0.4);
        is(number("slow_slip_until_m", &run, Some(0.5)), 3.5 * 2.4);
        assert_eq!(number("slow_slip_until_m", &run, Some(4e-4)), None);
        assert_eq!(number("slow_slip_until_m", &run, None), None);
        assert!(number("slow_slip_m", &with_states_every(5000), None).is_some(), "0.5 ms apart");
        assert_eq!(number("slow_slip_m", &with_states_every(6000), None), None, "too few states");
        assert_eq!(number("slow_slip_m", &passed_twice(), None), None, "no states");
    }

    /// The second rupture has slow slip up to the end of the run, 4 ms; the first, of block 1 alone at 1 us, has
    /// too little time before the next.
    #[test]
    fn every_rupture_has_its_own_slow_slip() {
        let mut run = with_states_every(2000);
        run.kept = crate::required_data::RequiredData::all();
        let found = super::slow_slips(&run).unwrap();
        let of = |slip: &super::SlowSlip<'_>| (slip.rupture.rupture, slip.contacts);
        assert_eq!(found.iter().map(of).collect::<Vec<_>>(), [(1, 6), (2, 6)]);
        for (slip, ms) in found.iter().zip([2.4, 0.4]) {
            is(slip.median_m, 3.5 * ms);
            is(slip.largest_m, 6.0 * ms);
        }
    }

    /// In a slider of fewer than five blocks the first rupture counts, at 1 us, of block 1 alone; the second
    /// comes at 0.1 ms, too early.
    #[test]
    fn of_few_blocks_any_rupture_counts() {
        let mut run = with_states_every(2000);
        run.header.blocks = 4;
        assert_eq!(number("slow_slip_m", &run, None), None);
        run.arrivals.retain(|arrival| arrival.rupture != 1);
        // From 0.501 ms to 3 ms.
        is(number("slow_slip_m", &run, None), 2.499);
    }

    #[test]
    fn dense_windows_do_where_there_are_no_states() {
        let mut run = passed_twice();
        run.windows = (0..=30)
            .map(|n| WindowRecord {
                window: 0,
                step: 500 * n,
                time_s: run.plan.grid.time_s(500 * n),
                sliding: 0,
                first_block: 2,
                displacement_m: displacement_m(500 * n)[1..4].to_vec(),
                velocity_m_per_s: vec![0.0; 3],
                tangential_force_n: vec![0.0; 3],
                ..WindowRecord::default()
            })
            .collect();
        // Blocks 2 to 4, up to 1.5 ms.
        is(number("slow_slip_m", &run, None), 3.0 * 0.9);
    }
}
