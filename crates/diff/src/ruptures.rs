//! Compares the ruptures of two runs: their classes, the differences of pairs, and the loads at which
//! precursors reached a quarter of the slider, half of it, and so on.

use std::convert::Infallible;

use asperity_numbers::{RuptureGrowth, median};
use asperity_record::RunHeader;

use crate::column::Column;
use crate::matching;
use crate::report::{LengthReached, PairDifferences, RuptureDiff};
use crate::table::Table;
use crate::tally::{self, Comparison, Draft};

/// The shares of the slider for which [`reached`] finds the load.
const SHARES: [f64; 3] = [0.25, 0.5, 0.75];

/// Compares ruptures, or returns why that is impossible.
pub(crate) fn compare(comparison: Comparison<'_>, sides: [&Table; 2]) -> Result<RuptureDiff, String> {
    for side in sides {
        matching::check(side).map_err(|problem| format!("they cannot be told apart: {problem}"))?;
    }
    // There are few ruptures, so all findings are kept, to list the largest first. Drafted
    // tolerances are of slip events only.
    let comparison = Comparison { keep_findings: usize::MAX, ..comparison };
    let (mut lengths, mut loads) = (Vec::new(), Vec::new());
    let (mut same_blocks, mut matches) = (0, 0);
    let Ok(mut table) = tally::compare(comparison, sides, &mut Draft::default(), |matched| {
        let (old, new) = (&matched.group.old, &matched.group.new);
        matches += u64::from(!old.is_empty() && !new.is_empty());
        if let ([old], [new]) = (&old[..], &new[..]) {
            same_blocks += u64::from(old.bounding_box() == new.bounding_box());
            lengths.push(f64::from(new.reach().count()) - f64::from(old.reach().count()));
            loads.push(new.value(Column::FT_FN_ONSET) - old.value(Column::FT_FN_ONSET));
        }
        Ok::<(), Infallible>(())
    });
    (table.columns_left_out, table.not_allowed) = (None, None);
    let pairs = lengths.len() as u64;
    let medians = median(lengths).zip(median(loads.into_iter().filter(|load| load.is_finite())));
    Ok(RuptureDiff {
        matches_in_time: matches,
        pairs: medians.map(|(median_length_blocks, median_ft_fn_onset)| PairDifferences {
            pairs,
            same_blocks,
            median_length_blocks,
            median_ft_fn_onset,
        }),
        reached: Vec::new(),
        old: table.old_rows,
        new: table.new_rows,
        table,
    })
}

/// Loads at which ruptures from block 1 first reached given shares of the slider, for shares that one of
/// the runs reached.
pub(crate) fn reached(sides: [&Table; 2], headers: [&RunHeader; 2]) -> Vec<LengthReached> {
    let growing = sides.map(|ruptures| {
        let mut growth = RuptureGrowth::default();
        for rupture in ruptures.rows() {
            let order = (rupture.value(Column::ONSET_STEP) as u64, rupture.number());
            growth.take(order, rupture.reach(), || rupture.value(Column::FT_FN_ONSET));
        }
        growth
    });
    let load = |side: usize, share: f64| {
        let enough = |to: u32| headers[side].length_ratio(to)[0] >= share;
        let first = growing[side].iter().find(|(to, _)| enough(*to));
        first.map(|(_, load)| *load).filter(|load| load.is_finite())
    };
    let reached =
        SHARES.map(|lp_l| LengthReached { lp_l, old_ft_fn: load(0, lp_l), new_ft_fn: load(1, lp_l) });
    reached.into_iter().filter(|reached| reached.old_ft_fn.is_some() || reached.new_ft_fn.is_some()).collect()
}

#[cfg(test)]
mod tests {
    use asperity_record::{Parts, Rupture};

    use super::{RuptureDiff, compare, reached};
    use crate::column::Column;
    use crate::policy::Policy;
    use crate::report::{Class, Extent};
    use crate::table::Table;
    use crate::tally::Comparison;

    /// With times and blocks only; other fields are null.
    fn rupture(number: u64, onset_step: u64, blocks: [u32; 2], end_step: Option<u64>) -> Rupture {
        let time_s = |step: u64| step as f64 / 1e7;
        Rupture {
            rupture: number,
            onset_s: time_s(onset_step),
            end_s: end_step.map(time_s),
            ft_fn_end: end_step.map(|_| 0.125),
            arrival_s: time_s(onset_step),
            open: end_step.is_none(),
            ..asperity_testkit::rupture(onset_step, end_step, blocks[0]..=blocks[1])
        }
    }

    /// In the order of their onsets.
    fn sorted(ruptures: &[Rupture]) -> Table {
        let mut table = Table::of(Parts::default(), ruptures);
        table.sort_by(&[Column::ONSET_STEP, Column::FIRST_BLOCK, Column::NUCLEATION_BLOCK]);
        table
    }

    fn compared(old: &[Rupture], new: &[Rupture]) -> RuptureDiff {
        let (old, new) = (sorted(old), sorted(new));
        let comparison = Comparison {
            columns: old.columns,
            window_s: 1e-3,
            cycles: None,
            policy: &Policy::default(),
            until_s: [None; 2],
            keep_findings: 9,
            keep_matches: 9,
        };
        compare(comparison, [&old, &new]).unwrap()
    }

    #[test]
    fn ruptures_are_matched_by_onset_and_extent_whatever_order_they_became_certain_in() {
        // A long one that began first became certain last.
        let old = [
            rupture(0, 3_000_000, [1, 7], Some(3_010_000)),
            rupture(1, 5_000_000, [40, 60], Some(5_010_000)),
            rupture(2, 1_000_000, [1, 30], Some(6_000_000)),
        ];
        let new = [
            rupture(0, 1_000_000, [1, 30], Some(6_000_000)),
            rupture(1, 3_000_400, [1, 7], Some(3_010_400)),
            rupture(2, 7_000_000, [1, 2], None),
        ];
        let found = compared(&old, &new);
        let number = |events: &[Extent]| events.first().map(|event| event.event);
        let matches = found.table.matches.iter();
        let matches: Vec<_> = matches.map(|one| (one.class, number(&one.old), number(&one.new))).collect();
        assert_eq!(
            matches,
            [
                (Class::Identical, Some(2), Some(0)),
                (Class::Shifted, Some(0), Some(1)),
                (Class::Missing, Some(1), None),
                (Class::Extra, None, Some(2)),
            ]
        );
        let columns = &found.table.columns;
        let has = |name: &str| columns.contains(&Column::named(name).unwrap());
        assert!(!has("max_sliding") && !has("event") && has("ft_fn_onset") && has("blocks_slipped"));
    }

    #[test]
    fn the_load_of_a_length_is_that_of_the_first_rupture_from_block_1_that_reaches_it() {
        let at = |number: u64, blocks: [u32; 2], ft_fn_onset: f64| Rupture {
            ft_fn_onset,
            ..rupture(number, 1_000 * (number + 1), blocks, Some(1_000 * (number + 1) + 9))
        };
        let old = [at(0, [1, 30], 0.1), at(1, [40, 90], 0.2), at(2, [1, 50], 0.3), at(3, [1, 60], 0.4)];
        let sides = [sorted(&old), sorted(&old[..1])];
        let header = asperity_record::RunHeader { blocks: 100, ..asperity_testkit::run_header() };
        let loads: Vec<(f64, Option<f64>, Option<f64>)> = reached(sides.each_ref(), [&header; 2])
            .iter()
            .map(|of| (of.lp_l, of.old_ft_fn, of.new_ft_fn))
            .collect();
        // Neither run reaches three quarters.
        assert_eq!(loads, [(0.25, Some(0.1), Some(0.1)), (0.5, Some(0.3), None)]);
    }

    #[test]
    fn the_differences_of_pairs_are_medians_of_new_less_old() {
        let old = [rupture(0, 1_000, [1, 10], Some(2_000)), rupture(1, 500_000, [1, 20], Some(501_000))];
        let mut new = [rupture(0, 1_000, [1, 10], Some(2_000)), rupture(1, 500_000, [1, 24], Some(501_000))];
        new[1].ft_fn_onset += 0.5;
        let found = compared(&old, &new);
        let pairs = found.pairs.unwrap();
        assert_eq!((found.matches_in_time, pairs.pairs, pairs.same_blocks), (2, 2, 1));
        assert_eq!((pairs.median_length_blocks, pairs.median_ft_fn_onset), (2.0, 0.25));
    }
}
