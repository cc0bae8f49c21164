//! The matching of least cost (`cost.rs`) between two tables, as they are read.
//!
//! Slip events of one run follow each other in time, so a matching need not cross itself: it is a path
//! through the grid of (old events consumed, new events consumed), and the cheapest path is found row by
//! row, as in the alignment of sequences (Needleman and Wunsch 1970). The modes of a state represent an
//! open split or merge, which may thus have any number of parts at one move each.
//!
//! Three restrictions keep this near linear; the result is optimal among the matchings that they allow:
//!
//! - Events that are equal in every column compared are the same event; the path
//!   must go through them.
//! - An event is compared with those that start before its end or within one window of its onset, and
//!   before the [`NEAREST`]th later event of its own side; in two chattering runs that leaves a few dozen
//!   candidates. The rule applies to the earlier of two events, whichever its side.
//! - Once all open paths share one state, everything before it is settled and freed. Only the undecided
//!   stretch stays in memory, not the table.

use std::collections::VecDeque;

use asperity_record::BoundingBox;

use crate::column::{Column, Columns, Kind};
use crate::cost::Cost;
use crate::grid::{CostRow, MODES, Mode, Move, Moves, State, bit};
use crate::pending::Pending;
pub use crate::pending::{MOST_AT_ONCE, MatchError, NEAREST};
use crate::progress::Cycles;
use crate::row::Row;

/// Rows between searches for a state that all paths share.
const ROWS_BETWEEN_FLUSHES: usize = 64;

/// Events that belong together, in order of onset on each side.
#[derive(Debug, Clone, PartialEq)]
pub struct Group<R> {
    /// The old events.
    pub old: Vec<R>,
    /// The new events.
    pub new: Vec<R>,
    /// Whether they are one old and one new event, equal in all compared columns.
    pub identical: bool,
}

impl<R: Row> Group<R> {
    /// The earliest onset of its events, s.
    pub fn onset_s(&self) -> f64 {
        let first = |events: &[R]| events.first().map_or(f64::INFINITY, R::onset_s);
        first(&self.old).min(first(&self.new))
    }
}

/// Matches two tables in time and hands out the groups in order of their onsets.
///
/// # Errors
/// If a table cannot be read or is not in order, or `emit` fails.
pub fn match_tables<R: Row, E>(
    old: impl Iterator<Item = Result<R, E>>,
    new: impl Iterator<Item = Result<R, E>>,
    columns: Columns,
    window_s: f64,
    emit: impl FnMut(Group<R>) -> Result<(), E>,
) -> Result<(), MatchError<E>> {
    match_by(old, new, columns, window_s, None, emit)
}

/// Matches two tables in time, or by cycles, and hands out the groups in that order.
pub(crate) fn match_by<R: Row, E>(
    old: impl Iterator<Item = Result<R, E>>,
    new: impl Iterator<Item = Result<R, E>>,
    columns: Columns,
    window_s: f64,
    cycles: Option<&Cycles>,
    emit: impl FnMut(Group<R>) -> Result<(), E>,
) -> Result<(), MatchError<E>> {
    let window_s = cycles.map_or(window_s, |cycles| cycles.window);
    let [old_progress, new_progress] = cycles.map_or_else(Default::default, |cycles| cycles.progress.clone());
    let compared = columns.iter().filter(|column| column.kind() != Kind::Number).collect::<Columns>();
    let mut matcher = Matcher {
        old: Pending::new("old", old, old_progress),
        new: Pending::new("new", new, new_progress),
        twins: VecDeque::new(),
        columns: compared,
        window_s,
        onsets: 0,
        rows: VecDeque::new(),
        settled: (0, 0),
        row: CostRow::start(0),
        spare: Vec::new(),
        flush_at: ROWS_BETWEEN_FLUSHES,
        held: Vec::new(),
        emit,
    };
    matcher.run()
}

struct Matcher<O, N, R, F> {
    old: Pending<O, R>,
    new: Pending<N, R>,
    /// Events that are equal in every column compared and lie ahead, by their numbers.
    twins: VecDeque<(usize, usize)>,
    columns: Columns,
    window_s: f64,
    /// Number of different onsets read.
    onsets: u64,
    /// Rows that are finished and not settled: their first cells, and the moves.
    rows: VecDeque<(usize, Vec<Moves>)>,
    /// The state that all paths share: old and new events consumed.
    settled: (usize, usize),
    /// The row at hand, number `settled.0 + rows.len()`.
    row: CostRow,
    /// Memory of a row that is finished, for the next one.
    spare: Vec<[Cost; 5]>,
    flush_at: usize,
    /// Groups that are settled, but may not be the next in time.
    held: Vec<Group<R>>,
    emit: F,
}

impl<O, N, R, F, E> Matcher<O, N, R, F>
where
    O: Iterator<Item = Result<R, E>>,
    N: Iterator<Item = Result<R, E>>,
    R: Row,
    F: FnMut(Group<R>) -> Result<(), E>,
{
    fn run(&mut self) -> Result<(), MatchError<E>> {
        loop {
            let taken = self.settled.0 + self.rows.len();
            if taken == self.old.read() {
                if !self.read_onset()? {
                    return self.finish();
                }
                // Not if there is also an old event with this onset, which may match the new ones.
                let is_at_end = taken == self.old.read();
                if is_at_end && self.new.waiting() >= ROWS_BETWEEN_FLUSHES {
                    self.roll()?;
                }
                continue;
            }
            self.read_ahead(taken)?;
            match self.twins.front() {
                Some(&(old, new)) if old == taken => self.pass_twins(new)?,
                _ => self.take_row(taken),
            }
            if self.rows.len() >= self.flush_at {
                self.flush()?;
            }
        }
    }

    /// Reads the events of the next onset of both sides; `false` after the last.
    fn read_onset(&mut self) -> Result<bool, MatchError<E>> {
        let onset_s = self.old.next_onset_s()?.min(self.new.next_onset_s()?);
        if onset_s == f64::INFINITY {
            return Ok(false);
        }
        let (old, new) = (self.old.read(), self.new.read());
        self.old.read_onset(onset_s, self.onsets, self.columns, self.window_s)?;
        self.new.read_onset(onset_s, self.onsets, self.columns, self.window_s)?;
        self.onsets += 1;
        let mut next = new;
        for old in old..self.old.read() {
            let event = self.old.event(old);
            let twin = (next..self.new.read()).find(|&new| self.equal(event, self.new.event(new)));
            if let Some(new) = twin {
                self.twins.push_back((old, new));
                next = new + 1;
            }
        }
        Ok(true)
    }

    fn equal(&self, old: &R, new: &R) -> bool {
        self.columns.iter().all(|column| old.cell(column) == new.cell(column))
    }

    /// Reads all events that the old event `taken` is compared with.
    fn read_ahead(&mut self, taken: usize) -> Result<(), MatchError<E>> {
        loop {
            let next_s = self.old.next_onset_s()?.min(self.new.next_onset_s()?);
            if next_s > self.old.span(taken).reach_s {
                return Ok(());
            }
            self.read_onset()?;
        }
    }

    /// New events in the row of an old event: those within its reach, and up to the next event that has a
    /// twin.
    fn row_end(&self, taken: usize) -> usize {
        let mut end = self.row.from + self.row.moves.len() - 1;
        let reach_s = self.old.span(taken).reach_s;
        while self.new.onset_s(end).is_some_and(|new_s| new_s <= reach_s) {
            end += 1;
        }
        self.twins.front().map_or(end, |&(_, new)| end.min(new))
    }

    /// Extends paths along the current row and to the next one, which consumes one more old event.
    fn take_row(&mut self, taken: usize) {
        let end = self.row_end(taken);
        let whole = *self.old.span(taken);
        let near = self.first_within_sight(self.row.from, end, whole.onset_s);
        let next = CostRow::cleared(near, end, std::mem::take(&mut self.spare));
        let mut row = std::mem::replace(&mut self.row, next);
        row.reach_to(end);
        row.advance(&mut self.row, &whole, self.new.spans(near, end), self.window_s);
        self.rows.push_back((row.from, row.moves));
        self.spare = row.costs;
    }

    /// The first new event, from one of them up to another, that may meet an old one of this
    /// onset or a later one. Those before it never will.
    fn first_within_sight(&self, from: usize, end: usize, onset_s: f64) -> usize {
        let from = from.max(self.new.first).min(end);
        let is_far = |&new: &usize| self.new.span(new).reach_s < onset_s;
        from + (from..end).take_while(is_far).count()
    }

    /// Leads all paths to `end` new events, without taking an old one.
    fn run_out(&mut self, end: usize) {
        self.row.run_to(end);
        let row = std::mem::replace(&mut self.row, CostRow::start(end));
        self.rows.push_back((row.from, row.moves));
    }

    /// While no old event comes, settles the new ones that the next will be too late for.
    fn roll(&mut self) -> Result<(), MatchError<E>> {
        let next_s = self.old.next_onset_s()?.min(self.new.next_onset_s()?);
        let near = self.first_within_sight(self.row.from, self.new.read(), next_s);
        // New events with a twin wait for it.
        let near = self.twins.front().map_or(near, |&(_, new)| near.min(new));
        if near < self.new.first + ROWS_BETWEEN_FLUSHES / 2 {
            return Ok(());
        }
        self.row.run_to(near);
        self.flush()?;
        // Cells of settled events are of no more use.
        let settled = self.settled.1.saturating_sub(self.row.from);
        self.row.costs.drain(..settled);
        self.row.moves.drain(..settled);
        self.row.from += settled;
        Ok(())
    }

    /// Settles all before a pair of twins, and the pair.
    fn pass_twins(&mut self, new: usize) -> Result<(), MatchError<E>> {
        let old = self.settled.0 + self.rows.len();
        self.run_out(new);
        self.settle((old, new, Mode::Between));
        self.rows.clear();
        self.twins.pop_front();
        let (old_twin, new_twin) = (self.old.event(old).clone(), self.new.event(new).clone());
        self.held.push(Group { old: vec![old_twin], new: vec![new_twin], identical: true });
        self.old.settle(old + 1);
        self.new.settle(new + 1);
        self.settled = (old + 1, new + 1);
        self.row = CostRow::start(new + 1);
        self.flush_at = ROWS_BETWEEN_FLUSHES;
        self.release()
    }

    /// After the last old event: the remaining new events are extra.
    fn finish(&mut self) -> Result<(), MatchError<E>> {
        let old = self.settled.0 + self.rows.len();
        let end = self.new.read();
        self.run_out(end);
        self.settle((old, end, Mode::Between));
        self.rows.clear();
        self.settled = (old, end);
        self.release()
    }

    /// Settles the common part of all open paths.
    fn flush(&mut self) -> Result<(), MatchError<E>> {
        let start = (self.settled.0, self.settled.1, Mode::Between);
        let Some(common) = self.common() else { unreachable!("there is a path to every row") };
        if common == start {
            self.flush_at *= 2;
            return Ok(());
        }
        self.settle(common);
        let (old, new, _) = common;
        self.rows.drain(..old - self.settled.0);
        self.settled = (old, new);
        self.flush_at = self.rows.len() + ROWS_BETWEEN_FLUSHES;
        self.release()
    }

    /// The last state, at the end of a row's paths from the row before, that all open paths go
    /// through.
    fn common(&self) -> Option<State> {
        let mut row = self.settled.0 + self.rows.len();
        // States of a row that lie on an open path: one bit per mode.
        let mut from = self.row.from;
        let mut open: Vec<u8> = self.row.moves.iter().map(|moves| moves.live()).collect();
        loop {
            if open.iter().map(|set| set.count_ones()).sum::<u32>() == 1 {
                let cell = open.iter().position(|&set| set != 0)?;
                if open[cell] == bit(Mode::Between) {
                    return Some((row, from + cell, Mode::Between));
                }
            }
            if row == self.settled.0 {
                return Some((row, self.settled.1, Mode::Between));
            }
            let (before_from, moves) = &self.rows[row - 1 - self.settled.0];
            let mut before = vec![0; moves.len()];
            for cell in (0..open.len()).rev() {
                let mut here = open[cell];
                while here != 0 {
                    let mode = MODES[here.trailing_zeros() as usize];
                    here &= here - 1;
                    let ((old, new, mode), _) = self.before((row, from + cell, mode));
                    if old == row {
                        open[new - from] |= bit(mode);
                    } else {
                        before[new - before_from] |= bit(mode);
                    }
                }
            }
            (row, from, open) = (row - 1, *before_from, before);
        }
    }

    /// The state before one on its cheapest path, and the move between.
    fn before(&self, (old, new, mode): State) -> (State, Move) {
        let row = old - self.settled.0;
        let last = match self.rows.get(row) {
            Some((from, moves)) => moves[new - from].get(mode),
            None => self.row.moves[new - self.row.from].get(mode),
        };
        let splitting = matches!(mode, Mode::Split1 | Mode::Split2);
        let from = |mode: Mode| match (last, splitting) {
            (Move::SkipOld, _) => (old - 1, new, mode),
            (Move::SkipNew, _) => (old, new - 1, mode),
            (Move::Pair, _) => (old - 1, new - 1, mode),
            (Move::CloseSplit, _) => (old - 1, new, Mode::Split2),
            (Move::CloseMerge, _) => (old, new - 1, Mode::Merge2),
            // A part of a split is a new event, one of a merge an old one.
            (Move::None | Move::Start | Move::Second | Move::Further, true) => (old, new - 1, mode),
            (Move::None | Move::Start | Move::Second | Move::Further, false) => (old - 1, new, mode),
        };
        let before = match (last, splitting) {
            (Move::None, _) => unreachable!("a state without a path is never looked back from"),
            (Move::Start, _) => from(Mode::Between),
            (Move::Second, true) => from(Mode::Split1),
            (Move::Second, false) => from(Mode::Merge1),
            _ => from(mode),
        };
        (before, last)
    }

    /// Stores the groups of the path up to a state, and drops their events.
    fn settle(&mut self, end: State) {
        let empty = Group { old: Vec::new(), new: Vec::new(), identical: false };
        let start = (self.settled.0, self.settled.1, Mode::Between);
        let mut group = empty.clone();
        let mut state = end;
        while state != start {
            let (before, last) = self.before(state);
            let old = || self.old.event(before.0).clone();
            let new = || self.new.event(before.1).clone();
            match last {
                Move::SkipOld => self.held.push(Group { old: vec![old()], ..empty.clone() }),
                Move::SkipNew => self.held.push(Group { new: vec![new()], ..empty.clone() }),
                Move::Pair => self.held.push(Group { old: vec![old()], new: vec![new()], identical: false }),
                // Walking back, a group begins at its end.
                Move::CloseSplit => group.old.push(old()),
                Move::CloseMerge => group.new.push(new()),
                Move::Start | Move::Second | Move::Further => {
                    if matches!(state.2, Mode::Split1 | Mode::Split2) {
                        group.new.push(new());
                    } else {
                        group.old.push(old());
                    }
                    if last == Move::Start {
                        group.old.reverse();
                        group.new.reverse();
                        self.held.push(std::mem::replace(&mut group, empty.clone()));
                    }
                }
                Move::None => unreachable!("every state on a path has a move"),
            }
            state = before;
        }
        self.old.settle(end.0);
        self.new.settle(end.1);
    }

    /// Emits the groups that no later group can precede, in order of onset.
    fn release(&mut self) -> Result<(), MatchError<E>> {
        let front = |s: Option<f64>, next_s: f64| s.unwrap_or(next_s);
        let old_s = front(self.old.onset_s(self.old.first), self.old.next_onset_s()?);
        let new_s = front(self.new.onset_s(self.new.first), self.new.next_onset_s()?);
        let until_s = old_s.min(new_s);
        let place = |group: &Group<R>| {
            let first = |side: Option<f64>| side.unwrap_or(f64::INFINITY);
            let old = first(group.old.first().map(|event| self.old.place(event)));
            old.min(first(group.new.first().map(|event| self.new.place(event))))
        };
        // Those of one place in an order that does not depend on the side.
        let key = |group: &Group<R>| {
            let all = || group.old.iter().chain(&group.new);
            let end_s = all().map(|event| event.end_s().unwrap_or(event.onset_s())).fold(0.0, f64::max);
            (end_s, BoundingBox::over(all().map(R::bounding_box)))
        };
        if self.held.len() > 1 {
            self.held.sort_by(|a, b| {
                let ((a_end_s, a_reach), (b_end_s, b_reach)) = (key(a), key(b));
                let ends = a_end_s.total_cmp(&b_end_s);
                place(a).total_cmp(&place(b)).then(ends).then(a_reach.cmp(&b_reach))
            });
        }
        let ready = self.held.partition_point(|group| place(group) < until_s);
        for group in self.held.drain(..ready) {
            (self.emit)(group).map_err(MatchError::Source)?;
        }
        Ok(())
    }
}

/// Columns in which two tables can be compared: those that both have, without steps if the time steps
/// differ.
pub fn comparable(old: Columns, new: Columns, same_step: bool) -> Columns {
    let is_comparable = |column: &Column| same_step || column.kind() != Kind::Step;
    old.and(new).iter().filter(is_comparable).collect()
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use asperity_record::SlipEvent;
    use asperity_testkit::{Random, slip_event};

    use super::{Group, match_tables};
    use crate::column::Columns;
    use crate::cost::{self, ALONE, BEGUN, Overlap, Span};
    use crate::progress::Progress;

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

    fn groups(old: &[SlipEvent], new: &[SlipEvent]) -> Vec<Group<SlipEvent>> {
        let mut groups = Vec::new();
        fn source(events: &[SlipEvent]) -> impl Iterator<Item = Result<SlipEvent, Infallible>> {
            events.iter().cloned().map(Ok)
        }
        match_tables(source(old), source(new), Columns::ALL, WINDOW_S, |group| {
            groups.push(group);
            Ok(())
        })
        .unwrap();
        groups
    }

    /// An event and its features.
    type Ranked = (SlipEvent, Span);

    fn ranked(events: &[SlipEvent]) -> Vec<Ranked> {
        events
            .iter()
            .map(|event| (event.clone(), Span::new(event, &Progress::default(), 0, WINDOW_S)))
            .collect()
    }

    /// The cost of a group by the table at the head of `cost.rs`.
    fn cost_of(old: &[Ranked], new: &[Ranked]) -> Option<i64> {
        let parts = |whole: &Ranked, parts: &[Ranked]| {
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
    fn least(old: &[Ranked], new: &[Ranked]) -> i64 {
        let twin = |a: &Ranked, b: &Ranked| {
            let number = |ranked: &Ranked| SlipEvent { event: 0, ..ranked.0.clone() };
            number(a) == number(b)
        };
        // Twins are matched with each other: the first old one that has one, with its first.
        for (i, a) in old.iter().enumerate() {
            if let Some(j) = new.iter().position(|b| twin(a, b)) {
                return least(&old[..i], &new[..j]) + least(&old[i + 1..], &new[j + 1..]);
            }
        }
        least_without_twins(old, new)
    }

    fn least_without_twins(old: &[Ranked], new: &[Ranked]) -> i64 {
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
                    let chosen: Vec<Ranked> = (0..part_side.len())
                        .filter(|part| choice >> part & 1 == 1)
                        .map(|part| part_side[part].clone())
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
            let found = groups(&old, &new);
            let costs = found.iter().map(|group| match group.identical {
                true => 0,
                false => cost_of(&ranked(&group.old), &ranked(&group.new)).expect("groups are admissible"),
            });
            assert_eq!(
                costs.sum::<i64>(),
                least(&ranked(&old), &ranked(&new)),
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
            let found = groups(&old, &new);
            for (side, table) in [(0, &old), (1, &new)] {
                let mut numbers: Vec<u64> = found
                    .iter()
                    .flat_map(|group| [&group.old, &group.new][side])
                    .map(|event| event.event)
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
            let numbers = |events: &[SlipEvent]| events.iter().map(|event| event.event).collect::<Vec<u64>>();
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
        let source = |onsets: [u64; 2]| {
            onsets
                .into_iter()
                .zip(0..)
                .map(|(onset, number)| Ok::<_, Infallible>(event(number, onset, 1, 1, 1)))
        };
        let refused = |old, new| {
            match_tables(source(old), source(new), Columns::ALL, WINDOW_S, |_| Ok(()))
                .unwrap_err()
                .to_string()
        };
        assert_eq!(
            refused([1, 2], [8, 7]),
            "new table: event 1 starts at 7 s, the one before it at 8 s (accepted: events in order of their onsets)"
        );
        assert!(refused([2, 1], [1, 1]).starts_with("old table: event 1"));
    }
}
