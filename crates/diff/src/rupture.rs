//! Ruptures as rows that are matched as slip events are: by when and where blocks slid, and at
//! what load.

use asperity_record::{Rupture, SlipEvent};

use crate::column::{Column, Columns};

/// What a rupture has of the columns of a slip event: [`row`] fills these.
pub fn columns() -> Columns {
    [
        Column::OnsetS,
        Column::EndS,
        Column::FirstBlock,
        Column::LastBlock,
        Column::FtFnOnset,
        Column::FtFnEnd,
        Column::Event,
        Column::OnsetStep,
        Column::EndStep,
        Column::BlocksSlipped,
        Column::NucleationBlock,
        Column::Open,
    ]
    .into_iter()
    .collect()
}

/// A rupture as a row; its number stands for that of an event.
pub fn row(rupture: &Rupture) -> SlipEvent {
    let Rupture { first_block, last_block, ft_fn_onset, .. } = *rupture;
    SlipEvent {
        onset_s: rupture.onset_s,
        end_s: rupture.end_s,
        first_block,
        last_block,
        ft_fn_onset,
        ft_fn_end: rupture.ft_fn_end,
        event: rupture.rupture,
        onset_step: rupture.onset_step,
        end_step: rupture.end_step,
        // Blocks are linked to their neighbours, so that none between the two is left out.
        blocks_slipped: rupture.reach().count(),
        nucleation_block: rupture.nucleation_block,
        open: rupture.open,
        // Columns that a rupture does not have.
        max_sliding: 0,
        ft_fn_min: ft_fn_onset,
        ft_fn_max: ft_fn_onset,
    }
}

/// Puts the rows of ruptures in the order of their onsets: a log has them in the order in which
/// they became certain.
pub fn sort(rows: &mut [SlipEvent]) {
    rows.sort_by_key(|row| (row.onset_step, row.first_block));
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use asperity_record::Rupture;

    use super::{columns, row, sort};
    use crate::column::Column;
    use crate::policy::Policy;
    use crate::report::{Class, RunSide};
    use crate::tally::{Comparison, Draft, compare};

    /// With nothing but when and where; the rest is null.
    fn rupture(number: u64, onset_step: u64, blocks: [u32; 2], end_step: Option<u64>) -> Rupture {
        let time_s = |step: u64| step as f64 / 1e7;
        let rupture = serde_json::json!({
            "rupture": number,
            "onset_s": time_s(onset_step),
            "end_s": end_step.map(time_s),
            "first_block": blocks[0],
            "last_block": blocks[1],
            "nucleation_block": blocks[0],
            "reached_every_block": false,
            "ft_fn_onset": 0.25,
            "ft_fn_arrival": 0.25,
            "ft_fn_end": end_step.map(|_| 0.125),
            "onset_step": onset_step,
            "arrival_s": time_s(onset_step),
            "end_step": end_step,
            "detachments": 1,
            "overlapping": false,
            "open": end_step.is_none(),
        });
        serde_json::from_value(rupture).unwrap()
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
        let rows = |ruptures: &[Rupture]| {
            let mut rows: Vec<_> = ruptures.iter().map(row).collect();
            sort(&mut rows);
            rows.into_iter().map(Ok::<_, Infallible>)
        };
        let comparison = Comparison {
            columns: columns(),
            window_s: 1e-3,
            policy: &Policy::default(),
            old: RunSide::default(),
            new: RunSide::default(),
            keep_findings: 9,
            keep_matches: 9,
        };
        let found = compare(comparison, rows(&old), rows(&new), &mut Draft::default(), |_| Ok(())).unwrap();
        let told: Vec<(Class, Option<u64>, Option<u64>)> = found
            .matches
            .iter()
            .map(|one| (one.class, one.old.first().map(|e| e.event), one.new.first().map(|e| e.event)))
            .collect();
        assert_eq!(
            told,
            [
                (Class::Identical, Some(2), Some(0)),
                (Class::Shifted, Some(0), Some(1)),
                (Class::Missing, Some(1), None),
                (Class::Extra, None, Some(2)),
            ]
        );
        assert!(!found.columns.contains(&Column::MaxSliding) && found.columns.contains(&Column::FtFnOnset));
    }
}
