//! The matching of least cost (`cost.rs`) between two tables.
//!
//! Slip events of one run follow each other in time, so a matching need not cross itself: it is a path
//! through the grid of (old events consumed, new events consumed), and the cheapest path is found row by
//! row (`grid.rs`), as in the alignment of sequences (Needleman and Wunsch 1970). The modes of a state
//! represent an open split or merge, which may thus have any number of parts at one move each.
//!
//! Three restrictions keep this near linear; the result is optimal among the matchings that they allow:
//!
//! - Events that are equal in every column compared are the same event; the path
//!   must go through them.
//! - An event is compared with those that start before its end or within one window of its onset, and
//!   before the [`NEAREST`]th later event of its own side; in two chattering runs that leaves a few dozen
//!   candidates. The rule applies to the earlier of two events, whichever its side.
//! - Once all open paths share one state, everything before it is settled: of the grid, only the undecided
//!   stretch is in memory.

use std::borrow::Cow;
use std::collections::VecDeque;

use asperity_record::{BoundingBox, Role};

use crate::column::{Column, Columns};
use crate::cost::Span;
use crate::grid::{CostRow, MODES, Mode, Move, Moves, State};
use crate::progress::Cycles;
use crate::table::{Row, Table, in_order};

/// Number of later events of its own side up to which an event is compared. If more of them start within
/// one window, their assignment is arbitrary anyway.
pub const NEAREST: usize = 32;

/// Most events with the same onset, which are all compared with each other. A run has one per onset.
pub const MOST_AT_ONCE: usize = 100;

/// Rows between searches for a state that all paths share.
const ROWS_BETWEEN_FLUSHES: usize = 64;

/// Events that belong together, in order of onset on each side.
#[derive(Debug, Clone)]
pub struct Group<'a> {
    /// The old events.
    pub old: Vec<Row<'a>>,
    /// The new events.
    pub new: Vec<Row<'a>>,
    /// Whether they are one old and one new event, equal in all compared columns.
    pub identical: bool,
    /// The place of the earliest of them.
    place: f64,
}

impl Group<'_> {
    /// The earliest onset of its events, s.
    pub fn onset_s(&self) -> f64 {
        let first = |events: &[Row<'_>]| events.first().map_or(f64::INFINITY, |event| event.onset_s());
        first(&self.old).min(first(&self.new))
    }

    /// The order of groups of one place, which does not depend on the side.
    fn key(&self) -> (f64, Option<BoundingBox>) {
        let all = || self.old.iter().chain(&self.new);
        let end_s = all().map(|event| event.end_s().unwrap_or(event.onset_s())).fold(0.0, f64::max);
        (end_s, BoundingBox::over(all().map(|event| event.bounding_box())))
    }
}

/// Matches two tables in time, or by cycles, with the window of these, and hands out the groups in that order.
///
/// # Errors
/// If `emit` fails. Tables that [`check`] refuses are matched in no particular way.
pub fn match_tables<'a, E>(
    tables: [&'a Table; 2],
    columns: Columns,
    window_s: f64,
    cycles: Option<&'a Cycles>,
    emit: impl FnMut(Group<'a>) -> Result<(), E>,
) -> Result<(), E> {
    let compared: Columns = columns.iter().filter(|column| column.role() != Role::Number).collect();
    let [old, new] = Side::of(tables, compared, cycles);
    let matcher = Matcher {
        twins: twins(&old, &new, compared),
        old,
        new,
        window: cycles.map_or(window_s, |cycles| cycles.window),
        cycles,
        rows: VecDeque::new(),
        settled: (0, 0),
        row: CostRow::start(0),
        held: Vec::new(),
        emit,
    };
    matcher.run()
}

/// Columns in which two tables can be compared: those that both have, without steps if the time steps
/// differ.
pub fn comparable(old: Columns, new: Columns, same_step: bool) -> Columns {
    let is_comparable = |column: &Column| same_step || column.role() != Role::Step;
    old.and(new).iter().filter(is_comparable).collect()
}

/// Why a table cannot be matched: events must be in order of their onsets, and few with the same one.
///
/// # Errors
/// The events that are out of order, or too many at once.
pub fn check(table: &Table) -> Result<(), String> {
    let (mut before_s, mut at_once) = (f64::NEG_INFINITY, 0);
    for row in table.rows() {
        let (event, onset_s) = (row.number(), row.onset_s());
        // Written so that a NaN onset counts as out of order.
        let in_order = onset_s >= before_s && onset_s.is_finite();
        if !in_order {
            return Err(format!(
                "event {event} starts at {onset_s} s, the one before it at {before_s} s (accepted: events in order \
                 of their onsets)"
            ));
        }
        at_once = if onset_s == before_s { at_once + 1 } else { 1 };
        if at_once > MOST_AT_ONCE {
            return Err(format!(
                "more than {MOST_AT_ONCE} events start at {onset_s} s (accepted: one in a step, as in a run; up to \
                 {MOST_AT_ONCE} where times are rounded)"
            ));
        }
        before_s = onset_s;
    }
    Ok(())
}

/// One side: its events, those of one onset in an order that does not depend on the table's.
struct Side<'a> {
    table: &'a Table,
    order: Vec<u32>,
    /// Where each starts: at its onset, s, or at a place in the cycles.
    places: Cow<'a, [f64]>,
    /// Number of different places before, on both sides.
    ranks: Vec<u32>,
}

impl<'a> Side<'a> {
    fn of(tables: [&'a Table; 2], columns: Columns, cycles: Option<&Cycles>) -> [Side<'a>; 2] {
        let mut sides = [0, 1].map(|side| {
            let table = tables[side];
            let mut order: Vec<u32> = (0..table.len() as u32).collect();
            let row = |row: u32| table.row(row as usize);
            let is_at_once = |a: &u32, b: &u32| row(*a).onset_s() == row(*b).onset_s();
            for at_once in order.chunk_by_mut(is_at_once).filter(|rows| rows.len() > 1) {
                at_once.sort_by(|&a, &b| in_order(row(a), row(b), columns.iter().chain([Column::EVENT])));
            }
            let places = match cycles.map(|cycles| &cycles.progress[side]) {
                Some(progress) => table.rows().map(|row| progress.place(row.onset_s())).collect(),
                None => table.onsets_s(),
            };
            Side { places, ranks: Vec::with_capacity(table.len()), order, table }
        });
        let (mut next, mut rank) = ([0, 0], 0);
        loop {
            let place = sides[0].place(next[0]).min(sides[1].place(next[1]));
            if place == f64::INFINITY {
                return sides;
            }
            for (side, next) in sides.iter_mut().zip(&mut next) {
                while side.place(*next) == place {
                    side.ranks.push(rank);
                    *next += 1;
                }
            }
            rank += 1;
        }
    }

    fn row(&self, event: usize) -> Row<'a> {
        self.table.row(self.order[event] as usize)
    }

    /// Where an event starts; infinite after the last.
    fn place(&self, event: usize) -> f64 {
        self.places.get(event).copied().unwrap_or(f64::INFINITY)
    }

    /// The quantities of an event that are compared. It reaches no farther than the later events of its side.
    fn span(&self, event: usize, is_time: bool, window: f64) -> Span {
        let farthest = self.place(event + NEAREST);
        Span::new(self.row(event), self.places[event], is_time, self.ranks[event].into(), window, farthest)
    }
}

/// Events that are equal in every column compared, as far as they need not cross.
fn twins(old: &Side<'_>, new: &Side<'_>, columns: Columns) -> VecDeque<(u32, u32)> {
    let mut twins = VecDeque::new();
    let mut next = 0;
    for n in 0..old.order.len() {
        while new.place(next) < old.places[n] {
            next += 1;
        }
        let at_once = (next..new.order.len()).take_while(|&new_n| new.places[new_n] == old.places[n]);
        let is_twin =
            |other: &usize| columns.iter().all(|column| old.row(n).is_same(new.row(*other), column));
        if let Some(twin) = { at_once }.find(is_twin) {
            twins.push_back((n as u32, twin as u32));
            next = twin + 1;
        }
    }
    twins
}

struct Matcher<'a, F> {
    old: Side<'a>,
    new: Side<'a>,
    /// Events that are equal and lie ahead.
    twins: VecDeque<(u32, u32)>,
    window: f64,
    cycles: Option<&'a Cycles>,
    /// Rows of the grid that are finished and not settled: their first cells, and the moves.
    rows: VecDeque<(usize, Vec<Moves>)>,
    /// The state that all paths share: old and new events consumed.
    settled: (usize, usize),
    /// The row at hand, number `settled.0 + rows.len()`.
    row: CostRow,
    /// Groups that are settled, but may not be the next in time.
    held: Vec<Group<'a>>,
    emit: F,
}

impl<'a, F, E> Matcher<'a, F>
where
    F: FnMut(Group<'a>) -> Result<(), E>,
{
    fn run(mut self) -> Result<(), E> {
        let mut flush_at = ROWS_BETWEEN_FLUSHES;
        // The quantities of new events from one on, up to the last that was compared.
        let mut spans: VecDeque<Span> = VecDeque::new();
        let mut first = 0;
        // Memory of a row that is finished, for the next one.
        let mut spare = Vec::new();
        for taken in 0..self.old.order.len() {
            if let Some((_, new)) = self.twins.pop_front_if(|(old, _)| *old as usize == taken) {
                self.pass(taken, new as usize);
                self.hold(vec![self.old.row(taken)], vec![self.new.row(new as usize)], true);
                self.release()?;
                flush_at = ROWS_BETWEEN_FLUSHES;
                continue;
            }
            let whole = self.old.span(taken, self.cycles.is_none(), self.window);
            // New events in the row: those within reach, and up to the next event that has a twin.
            let mut end = self.row.from + self.row.moves.len() - 1;
            while self.new.place(end) <= whole.reach_s {
                end += 1;
            }
            end = self.twins.front().map_or(end, |&(_, new)| end.min(new as usize));
            spans.drain(..self.row.from.saturating_sub(first).min(spans.len()));
            first = self.row.from;
            spans.extend(
                (first + spans.len()..end).map(|new| self.new.span(new, self.cycles.is_none(), self.window)),
            );
            // Those that no old event from this one on reaches never meet one.
            let near =
                first + spans.iter().take(end - first).take_while(|new| new.reach_s < whole.onset_s).count();
            let mut next = CostRow::cleared(near, end, spare);
            self.row.advance(&mut next, end, &whole, |new| &spans[new - first], self.window);
            let row = std::mem::replace(&mut self.row, next);
            self.rows.push_back((row.from, row.moves));
            spare = row.costs;
            if self.rows.len() >= flush_at {
                flush_at = if self.flush()? { self.rows.len() + ROWS_BETWEEN_FLUSHES } else { 2 * flush_at };
            }
        }
        self.pass(self.old.order.len(), self.new.order.len());
        self.release()
    }

    /// Leads all paths to a state without an open group, settles all before it, and passes one event of each
    /// side there, which are twins or the end.
    fn pass(&mut self, old: usize, new: usize) {
        self.row.run_to(new);
        let row = std::mem::replace(&mut self.row, CostRow::start(new + 1));
        self.rows.push_back((row.from, row.moves));
        self.settle((old, new, Mode::Between));
        self.rows.clear();
        self.settled = (old + 1, new + 1);
    }

    /// Settles the common part of all open paths, if there is any.
    fn flush(&mut self) -> Result<bool, E> {
        let common = self.common();
        if common == (self.settled.0, self.settled.1, Mode::Between) {
            return Ok(false);
        }
        self.settle(common);
        self.rows.drain(..common.0 - self.settled.0);
        self.settled = (common.0, common.1);
        self.release()?;
        Ok(true)
    }

    /// The last state, at the end of a row's paths from the row before, that all open paths go through.
    fn common(&self) -> State {
        let mut row = self.settled.0 + self.rows.len();
        // States of a row that lie on an open path.
        let live = |moves: &Moves| moves.map(|last| last != Move::None);
        let mut from = self.row.from;
        let mut open: Vec<[bool; 5]> = self.row.moves.iter().map(live).collect();
        loop {
            let states = open.iter().flatten().filter(|is_open| **is_open).count();
            let between = open.iter().position(|modes| modes[Mode::Between as usize]);
            if let Some(cell) = between.filter(|_| states == 1) {
                return (row, from + cell, Mode::Between);
            }
            if row == self.settled.0 {
                return (row, self.settled.1, Mode::Between);
            }
            let (before_from, moves) = &self.rows[row - 1 - self.settled.0];
            let mut before = vec![[false; 5]; moves.len()];
            for cell in (0..open.len()).rev() {
                for mode in MODES {
                    if !open[cell][mode as usize] {
                        continue;
                    }
                    let ((old, new, mode), _) = self.before((row, from + cell, mode));
                    if old == row {
                        open[new - from][mode as usize] = true;
                    } else {
                        before[new - before_from][mode as usize] = true;
                    }
                }
            }
            (row, from, open) = (row - 1, *before_from, before);
        }
    }

    /// The state before one on its cheapest path, and the move between.
    fn before(&self, (old, new, mode): State) -> (State, Move) {
        let row = self.rows.get(old - self.settled.0);
        let (from, moves) = row.map_or((self.row.from, &self.row.moves), |(from, moves)| (*from, moves));
        let last = moves[new - from][mode as usize];
        let splitting = matches!(mode, Mode::Split1 | Mode::Split2);
        // A part of a split is a new event, one of a merge an old one.
        let part = |mode| if splitting { (old, new - 1, mode) } else { (old - 1, new, mode) };
        let before = match last {
            Move::None | Move::Origin => unreachable!("no path goes back beyond its origin"),
            Move::SkipOld => (old - 1, new, mode),
            Move::SkipNew => (old, new - 1, mode),
            Move::Pair => (old - 1, new - 1, mode),
            Move::CloseSplit => (old - 1, new, Mode::Split2),
            Move::CloseMerge => (old, new - 1, Mode::Merge2),
            Move::Start => part(Mode::Between),
            Move::Second => part(if splitting { Mode::Split1 } else { Mode::Merge1 }),
            Move::Further => part(mode),
        };
        (before, last)
    }

    /// Stores the groups of the path up to a state.
    fn settle(&mut self, end: State) {
        let start = (self.settled.0, self.settled.1, Mode::Between);
        let (mut old, mut new) = (Vec::new(), Vec::new());
        let mut state = end;
        while state != start {
            let (before, last) = self.before(state);
            let (old_event, new_event) = (|| self.old.row(before.0), || self.new.row(before.1));
            match last {
                Move::SkipOld => self.hold(vec![old_event()], Vec::new(), false),
                Move::SkipNew => self.hold(Vec::new(), vec![new_event()], false),
                Move::Pair => self.hold(vec![old_event()], vec![new_event()], false),
                // Walking back, a group begins at its end.
                Move::CloseSplit => old.push(old_event()),
                Move::CloseMerge => new.push(new_event()),
                _ if matches!(state.2, Mode::Split1 | Mode::Split2) => new.push(new_event()),
                _ => old.push(old_event()),
            }
            if last == Move::Start {
                old.reverse();
                new.reverse();
                self.hold(std::mem::take(&mut old), std::mem::take(&mut new), false);
            }
            state = before;
        }
    }

    fn hold(&mut self, old: Vec<Row<'a>>, new: Vec<Row<'a>>, identical: bool) {
        let place = |side: usize, events: &[Row<'_>]| match (events.first(), self.cycles) {
            (None, _) => f64::INFINITY,
            (Some(event), None) => event.onset_s(),
            (Some(event), Some(cycles)) => cycles.progress[side].place(event.onset_s()),
        };
        let place = place(0, &old).min(place(1, &new));
        self.held.push(Group { old, new, identical, place });
    }

    /// Emits the groups that no later group can precede, in order of place.
    fn release(&mut self) -> Result<(), E> {
        let until = self.old.place(self.settled.0).min(self.new.place(self.settled.1));
        if self.held.len() > 1 {
            self.held.sort_by(|a, b| {
                let ((a_end_s, a_box), (b_end_s, b_box)) = (a.key(), b.key());
                a.place.total_cmp(&b.place).then(a_end_s.total_cmp(&b_end_s)).then(a_box.cmp(&b_box))
            });
        }
        let ready = self.held.partition_point(|group| group.place < until);
        for group in self.held.drain(..ready) {
            (self.emit)(group)?;
        }
        Ok(())
    }
}
#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use asperity_record::{Parts, SlipEvent};
    use asperity_testkit::{Random, slip_event};

    use super::{Group, check, match_tables};
    use crate::column::Columns;
    use crate::cost::{self, ALONE, BEGUN, Overlap, Span};
    use crate::table::{Row, Table};

    const WINDOW_S: f64 = 4.0;

    fn event(number: u64, onset: u64, length: u64, first_block: u32, last_block: u32) -> SlipEvent {
        SlipEvent { event: number, ..slip_event(onset, onset + length, first_block..=last_block) }
    }

    /// Events on a coarse grid, so that costs are often equal, some of them side by side.
    fn table(random: &mut Random, events: u64, closest: u64) -> Vec<SlipEvent> {
        let mut onset = random.below(3);
        (0..events)
            .map(|number| {
                let first = 1 + random.below(4) as u32;
                let made = event(number, onset, 1 + random.below(6), first, first + random.below(4) as u32);
                onset += closest + random.below(8);
                made
            })
            .collect()
    }

    fn groups<'a>(old: &'a Table, new: &'a Table) -> Vec<Group<'a>> {
        let mut groups = Vec::new();
        let Ok(()) = match_tables([old, new], Columns::ALL, WINDOW_S, None, |group| {
            groups.push(group);
            Ok::<(), Infallible>(())
        });
        groups
    }

    fn of(events: &[SlipEvent]) -> Table {
        Table::of(Parts::ALL, events)
    }

    /// An event and its features.
    type Ranked<'a> = (Row<'a>, Span);

    fn ranked<'a>(rows: impl IntoIterator<Item = Row<'a>>) -> Vec<Ranked<'a>> {
        let span = |row: Row<'_>| Span::new(row, row.onset_s(), true, 0, WINDOW_S, f64::INFINITY);
        rows.into_iter().map(|row| (row, span(row))).collect()
    }

    /// The cost of a group by the table at the head of `cost.rs`.
    fn cost_of(old: &[Ranked<'_>], new: &[Ranked<'_>]) -> Option<i64> {
        let parts = |whole: &Ranked<'_>, parts: &[Ranked<'_>]| {
            let costs = parts.iter().map(|part| {
                let overlap = Overlap::of(&whole.1, &part.1)?;
                cost::part(&whole.1, &part.1, overlap).map(|cost| cost.primary)
            });
            Some(BEGUN + costs.sum::<Option<i64>>()?)
        };
        match (old, new) {
            ([_], []) | ([], [_]) => Some(ALONE),
            ([a], [b]) => {
                let overlap = Overlap::of(&a.1, &b.1)?;
                cost::pair(&a.1, &b.1, overlap, WINDOW_S).map(|cost| cost.primary)
            }
            ([whole], several) | (several, [whole]) => parts(whole, several),
            _ => None,
        }
    }

    /// The least cost of all matchings that do not cross, by trying every one.
    fn least(old: &[Ranked<'_>], new: &[Ranked<'_>]) -> i64 {
        let twin = |a: &Ranked<'_>, b: &Ranked<'_>| {
            Columns::ALL
                .iter()
                .filter(|column| column.name() != "event")
                .all(|column| a.0.is_same(b.0, column))
        };
        // Twins are matched with each other: the first old one that has one, with its first.
        for (i, a) in old.iter().enumerate() {
            if let Some(j) = new.iter().position(|b| twin(a, b)) {
                return least(&old[..i], &new[..j]) + least(&old[i + 1..], &new[j + 1..]);
            }
        }
        least_without_twins(old, new)
    }

    fn least_without_twins(old: &[Ranked<'_>], new: &[Ranked<'_>]) -> i64 {
        let ([_, ..], [_, ..]) = (old, new) else { return ALONE * (old.len() + new.len()) as i64 };
        let mut best = i64::MAX;
        // Tries all groups of the first old event: none, a pair or split with any choice of new events, or
        // a merge with any choice of old ones.
        best = best.min(ALONE + least_without_twins(&old[1..], new));
        for (whole_side, part_side, is_split) in [(old, new, true), (new, old, false)] {
            for (at, whole) in whole_side.iter().enumerate() {
                if is_split && at > 0 {
                    break;
                }
                for choice in 1u32..1 << part_side.len() {
                    if !is_split && (choice & 1 == 0 || choice.count_ones() < 2) {
                        continue;
                    }
                    let chosen: Vec<Ranked<'_>> = (0..part_side.len())
                        .filter(|part| choice >> part & 1 == 1)
                        .map(|part| part_side[part])
                        .collect();
                    let whole = std::slice::from_ref(whole);
                    let Some(cost) =
                        (if is_split { cost_of(whole, &chosen) } else { cost_of(&chosen, whole) })
                    else {
                        continue;
                    };
                    // Events before and between stay single; the rest follows.
                    let last = 32 - choice.leading_zeros() as usize;
                    let passed = last - chosen.len() + at;
                    let rest = if is_split {
                        least_without_twins(&old[1..], &new[last..])
                    } else {
                        least_without_twins(&old[last..], &new[at + 1..])
                    };
                    // New events before a part cannot belong to an earlier old event: there is none.
                    best = best.min(cost + ALONE * passed as i64 + rest);
                }
            }
        }
        best
    }

    #[test]
    fn the_matching_is_the_cheapest_there_is() {
        let mut random = Random::new(1);
        let (mut pairs, mut several) = (0, 0);
        for case in 0..3000 {
            let sizes = [random.below(6), random.below(6)];
            let old = table(&mut random, sizes[0], 1);
            let new = table(&mut random, sizes[1], 1);
            let tables = [of(&old), of(&new)];
            let found = groups(&tables[0], &tables[1]);
            let costs = found.iter().map(|group| match group.identical {
                true => 0,
                false => cost_of(&ranked(group.old.clone()), &ranked(group.new.clone()))
                    .expect("groups are admissible"),
            });
            assert_eq!(
                costs.sum::<i64>(),
                least(&ranked(tables[0].rows()), &ranked(tables[1].rows())),
                "case {case}: {old:#?} {new:#?}"
            );
            pairs += found.iter().filter(|group| group.old.len() == 1 && group.new.len() == 1).count();
            several += found.iter().filter(|group| group.old.len() + group.new.len() > 2).count();
        }
        assert!(pairs > 1500 && several > 500, "{pairs} pairs, {several} splits and merges");
    }

    #[test]
    fn every_event_is_in_one_group_and_groups_come_in_order_of_time() {
        let mut random = Random::new(2);
        for _ in 0..500 {
            let old = table(&mut random, 200, 0);
            let new = table(&mut random, 200, 0);
            let [old, new] = [of(&old), of(&new)];
            let found = groups(&old, &new);
            for (side, table) in [(0, &old), (1, &new)] {
                let mut numbers: Vec<u64> = found
                    .iter()
                    .flat_map(|group| [&group.old, &group.new][side])
                    .map(|event| event.number())
                    .collect();
                numbers.sort_unstable();
                assert_eq!(numbers, (0..table.len() as u64).collect::<Vec<_>>());
            }
            assert!(found.is_sorted_by(|a, b| a.onset_s() <= b.onset_s()));
        }
    }

    #[test]
    fn swapping_the_sides_swaps_the_groups() {
        let mut random = Random::new(3);
        for _ in 0..2000 {
            let old = table(&mut random, 60, 0);
            let new = table(&mut random, 60, 0);
            let [old, new] = [of(&old), of(&new)];
            let numbers =
                |events: &[Row<'_>]| events.iter().map(|event| event.number()).collect::<Vec<u64>>();
            let mut forth: Vec<_> =
                groups(&old, &new).iter().map(|group| (numbers(&group.old), numbers(&group.new))).collect();
            let mut back: Vec<_> =
                groups(&new, &old).iter().map(|group| (numbers(&group.new), numbers(&group.old))).collect();
            forth.sort();
            back.sort();
            assert_eq!(forth, back);
        }
    }

    #[test]
    fn tables_out_of_order_are_refused() {
        let checked = |onsets: &[u64]| {
            let events: Vec<SlipEvent> =
                onsets.iter().zip(0..).map(|(onset, number)| event(number, *onset, 1, 1, 1)).collect();
            check(&of(&events))
        };
        assert_eq!(
            checked(&[8, 7]),
            Err(
                "event 1 starts at 7 s, the one before it at 8 s (accepted: events in order of their onsets)"
                    .to_owned()
            )
        );
        assert_eq!(checked(&[1, 1, 2]), Ok(()));
        assert_eq!(checked(&[3; 100]), Ok(()));
        assert!(
            checked(&[3; 101])
                .is_err_and(|why| why.starts_with("more than 100 events start at 3 s (accepted: "))
        );
    }
}
