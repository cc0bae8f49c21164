//! Classifies the events of a group, and names the rule.
//!
//! | class | rule |
//! |---|---|
//! | identical | one on each side, equal in every column compared |
//! | within tolerance | one on each side, every difference within its column's tolerance |
//! | open | one of the two was cut short by the end of its run, and what is known at an onset is within tolerance; or it starts after the end of the other run |
//! | shifted | the onset moved beyond tolerance, the blocks did not change, and the end moved no more than [`END_MOVES_ALONG`] times as far; loads may follow |
//! | changed | anything else between one and one |
//! | split, merged | one old event matches several new ones, or the reverse |
//! | missing, extra | no counterpart |

use asperity_record::{BoundingBox, Reach, Role};

use crate::column::{Column, Columns};
use crate::matching::Group;
use crate::policy::{Allowed, Policy};
use crate::report::{CellChange, Class, Conservation};
use crate::table::Row;
use crate::tally::Comparison;

/// How much farther than its onset the end of a shifted event may move: beyond, its
/// duration changed rather than its place.
pub const END_MOVES_ALONG: f64 = 3.0;

/// Why an event has no counterpart: it starts after the end of the new run or of the old one, or nothing
/// fits.
const ALONE_IN_TIME: [&str; 4] = [
    "starts after the end of the new run",
    "starts after the end of the old run",
    "no new event overlaps it in blocks and overlaps it in time or starts within the window, or another fits better",
    "no old event overlaps it in blocks and overlaps it in time or starts within the window, or another fits better",
];
const ALONE_IN_CYCLES: [&str; 4] = [
    "the new run ends before this cycle, or before this place in it",
    "the old run ends before this cycle, or before this place in it",
    "no new event overlaps it in blocks and starts within the window of its place in the cycle, or another fits better",
    "no old event overlaps it in blocks and starts within the window of its place in the cycle, or another fits better",
];

/// The class of a group, with details.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) class: Class,
    pub(crate) rule: &'static str,
    /// Of one against one: every cell that differs.
    pub(crate) cells: Vec<CellChange>,
    /// Of one against one: the farther of the shifts of onset and end, s.
    pub(crate) shift_s: Option<f64>,
    pub(crate) conservation: Option<Conservation>,
}

impl Comparison<'_> {
    pub(crate) fn classify(&self, group: &Group<'_>) -> Outcome {
        let unpaired =
            |class, rule| Outcome { class, rule, cells: Vec::new(), shift_s: None, conservation: None };
        let place = |side: usize, time_s: f64| match self.cycles {
            Some(cycles) => cycles.progress[side].place(time_s),
            None => time_s,
        };
        // Whether an event of one side starts after the other run has ended.
        let is_after = |event: Row<'_>, side: usize| {
            let other = 1 - side;
            self.until_s[other].is_some_and(|end_s| place(side, event.onset_s()) > place(other, end_s))
        };
        let [after_new, after_old, no_new, no_old] = match self.cycles {
            None => ALONE_IN_TIME,
            Some(_) => ALONE_IN_CYCLES,
        };
        match (&group.old[..], &group.new[..]) {
            (&[old], &[new]) => self.pair(old, new, group.identical),
            (&[old], []) if is_after(old, 0) => unpaired(Class::Open, after_new),
            ([], &[new]) if is_after(new, 1) => unpaired(Class::Open, after_old),
            (_, []) => unpaired(Class::Missing, no_new),
            ([], _) => unpaired(Class::Extra, no_old),
            ([_], _) => Outcome {
                conservation: Some(self.conservation(group)),
                ..unpaired(Class::Split, "several new events lie in its time and blocks")
            },
            (_, _) => Outcome {
                conservation: Some(self.conservation(group)),
                ..unpaired(Class::Merged, "several old events lie in its time and blocks")
            },
        }
    }

    fn pair(&self, old: Row<'_>, new: Row<'_>, identical: bool) -> Outcome {
        let shift_s = shift_s(old, new);
        let outcome =
            |class, rule, cells| Outcome { class, rule, cells, shift_s: Some(shift_s), conservation: None };
        if identical {
            return outcome(Class::Identical, "equal in every column compared", Vec::new());
        }
        let cells = differing(old, new, self.columns, self.policy);
        let is_beyond = |column: Column| cells.iter().any(|cell| cell.column == column && cell.is_beyond());
        let any_beyond = |role: Option<Role>, of_onset: bool| {
            let of_role = |cell: &&CellChange| role.is_none_or(|role| cell.column.role() == role);
            let mut of_role = cells.iter().filter(of_role);
            of_role.any(|cell| cell.is_beyond() && (cell.column.is_of_onset() || !of_onset))
        };
        // Events truncated by the end of a run are compared only in columns known at the onset.
        let cut = old.is_cut() || new.is_cut();
        let (class, rule) = if cells.is_empty() {
            (Class::Identical, "equal in every column compared")
        } else if !any_beyond(None, false) {
            (Class::WithinTolerance, "every column within its tolerance")
        } else if cut && !any_beyond(None, true) {
            (Class::Open, "the end of a run cut it short, and it starts alike")
        } else if is_beyond(Column::ONSET_S) && !any_beyond(Some(Role::Place), cut) {
            let onset_s = (old.onset_s() - new.onset_s()).abs();
            if cut || shift_s <= END_MOVES_ALONG * onset_s {
                (Class::Shifted, "same blocks, another time")
            } else {
                (Class::Changed, "same blocks, another duration")
            }
        } else if any_beyond(Some(Role::Place), false) {
            (Class::Changed, "other blocks")
        } else if is_beyond(Column::END_S) {
            (Class::Changed, "same onset, another end")
        } else if any_beyond(Some(Role::Load), false) {
            (Class::Changed, "same time and blocks, another load")
        } else if any_beyond(Some(Role::Speed), false) {
            (Class::Changed, "same time, blocks and load, another speed")
        } else if any_beyond(Some(Role::Total), false) {
            (Class::Changed, "same time, blocks and load, another total")
        } else {
            (Class::Changed, "same time in seconds, another step or edge")
        };
        outcome(class, rule, cells)
    }

    /// Whether the policy lets a match pass; numbers of matches are compared with it at the end.
    pub(crate) fn allows(&self, outcome: &Outcome) -> bool {
        let of_class = self.policy.allowed(outcome.class) != Allowed::UpTo(0);
        let near = outcome.shift_s.is_none_or(|shift_s| shift_s <= self.policy.max_shift_s);
        of_class && (near || outcome.class.is_no_difference())
    }

    fn conservation(&self, group: &Group<'_>) -> Conservation {
        let (old_duration_s, new_duration_s) = (covered_s(&group.old), covered_s(&group.new));
        let [onset_s, end_s] = [Column::ONSET_S, Column::END_S].map(|column| {
            let last = |events: &[Row<'_>]| events.last().map(|event| event.value(column));
            let (old, new) = (last(&group.old), last(&group.new));
            old.zip(new).map_or(0.0, |(old, new)| self.policy.tolerance(column).between(old, new))
        });
        // Both are sums of differences of times: rounding is no loss.
        let last_s = group.onset_s().abs() + old_duration_s + new_duration_s;
        let rounding_s = (group.old.len() + group.new.len()) as f64 * f64::EPSILON * last_s;
        let [old_blocks, new_blocks] = [&group.old, &group.new]
            .map(|events| covered_blocks(events.iter().map(|event| event.bounding_box())));
        let count = |boxes: &[BoundingBox]| boxes.iter().map(|one| one.count()).sum();
        Conservation {
            old_duration_s,
            new_duration_s,
            duration_conserved: (old_duration_s - new_duration_s).abs() <= onset_s + end_s + rounding_s,
            old_blocks: count(&old_blocks),
            new_blocks: count(&new_blocks),
            blocks_conserved: old_blocks == new_blocks,
        }
    }
}

impl CellChange {
    /// Whether it differs by more than its tolerance.
    pub fn is_beyond(&self) -> bool {
        self.difference.is_none_or(|difference| difference > self.tolerance)
    }
}

/// The farther of the shifts of onset and end, s.
pub(crate) fn shift_s(old: Row<'_>, new: Row<'_>) -> f64 {
    let end_s = old.end_s().zip(new.end_s()).map_or(0.0, |(old, new)| (old - new).abs());
    (old.onset_s() - new.onset_s()).abs().max(end_s)
}

/// The cells in which two events differ. Steps are compared only where their seconds are equal:
/// otherwise the difference follows from that of the seconds.
fn differing(old: Row<'_>, new: Row<'_>, columns: Columns, policy: &Policy) -> Vec<CellChange> {
    let is_its_own = |column: &Column| match *column {
        Column::EVENT => false,
        Column::ONSET_STEP => old.is_same(new, Column::ONSET_S),
        Column::END_STEP => old.is_same(new, Column::END_S),
        _ => true,
    };
    let change = |column: Column| {
        let (a, b) = (old.value(column), new.value(column));
        // There is none between a number and an empty cell, or between yes and no.
        let is_measurable = !(a.is_nan() || b.is_nan() || column.role() == Role::Edge);
        CellChange {
            column,
            old: old.cell(column),
            new: new.cell(column),
            difference: is_measurable.then_some((a - b).abs()),
            tolerance: policy.tolerance(column).between(a, b),
        }
    };
    columns.iter().filter(|&column| !old.is_same(new, column)).filter(is_its_own).map(change).collect()
}

/// Time covered by events in order of onset, s.
fn covered_s(events: &[Row<'_>]) -> f64 {
    let mut until_s = f64::NEG_INFINITY;
    let mut covered_s = 0.0;
    for event in events {
        let end_s = event.end_s().unwrap_or(event.onset_s());
        covered_s += (end_s - event.onset_s().max(until_s)).max(0.0);
        until_s = until_s.max(end_s);
    }
    covered_s
}

/// Blocks covered by events, as boxes that do not overlap: each of the most rows with the same columns.
fn covered_blocks(events: impl Iterator<Item = BoundingBox>) -> Vec<BoundingBox> {
    let boxes: Vec<BoundingBox> = events.collect();
    // Rows at which a box begins, or the first after one: between them the columns are the same.
    let mut edges: Vec<u32> = boxes.iter().flat_map(|one| [one.rows.first, one.rows.last + 1]).collect();
    edges.sort_unstable();
    edges.dedup();
    let mut covered: Vec<(Reach, Vec<Reach>)> = Vec::new();
    for edge in edges.windows(2) {
        let rows = Reach { first: edge[0], last: edge[1] - 1 };
        let of_rows = boxes.iter().filter(|one| one.rows.contains(rows.first)).map(|one| one.columns);
        let columns = without_overlap(of_rows.collect());
        match covered.last_mut() {
            Some((before, same)) if before.last + 1 == rows.first && *same == columns => {
                before.last = rows.last
            }
            _ => covered.push((rows, columns)),
        }
    }
    let boxes = covered
        .into_iter()
        .flat_map(|(rows, columns)| columns.into_iter().map(move |columns| BoundingBox { columns, rows }));
    boxes.collect()
}

/// These blocks as ranges that do not touch.
fn without_overlap(mut ranges: Vec<Reach>) -> Vec<Reach> {
    ranges.sort_unstable();
    let mut covered: Vec<Reach> = Vec::new();
    for next in ranges {
        match covered.last_mut() {
            Some(before) if next.first <= before.last + 1 => before.last = next.last.max(before.last),
            _ => covered.push(next),
        }
    }
    covered
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use asperity_record::{BoundingBox, Reach};
    use asperity_testkit::Random;

    use super::covered_blocks;

    /// Against a set of single contacts; the same set gives the same boxes, whichever events cover it.
    #[test]
    fn covered_blocks_are_those_of_a_set() {
        let mut random = Random::new(5);
        for _ in 0..300 {
            let mut below = |bound: u64| random.below(bound) as u32;
            let boxes: Vec<BoundingBox> = (0..=below(4))
                .map(|_| {
                    let (first, row) = (1 + below(6), 1 + below(5));
                    BoundingBox {
                        columns: Reach { first, last: first + below(3) },
                        rows: Reach { first: row, last: row + below(3) },
                    }
                })
                .collect();
            let places = |of: &BoundingBox| {
                let (columns, rows) = (of.columns, of.rows);
                (rows.first..=rows.last)
                    .flat_map(move |row| (columns.first..=columns.last).map(move |n| (n, row)))
            };
            let set: BTreeSet<(u32, u32)> = boxes.iter().flat_map(places).collect();
            let found = covered_blocks(boxes.iter().copied());
            assert_eq!(found.iter().map(|one| one.count()).sum::<u64>(), set.len() as u64);
            // As single contacts, in any order.
            let single = |&(column, row): &(u32, u32)| BoundingBox {
                columns: Reach { first: column, last: column },
                rows: Reach { first: row, last: row },
            };
            assert_eq!(covered_blocks(set.iter().rev().map(single)), found);
        }
    }
}
