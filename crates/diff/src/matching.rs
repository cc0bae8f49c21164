//! The matching of least cost (`cost.rs`) between two tables, as they are read.
//!
//! Slip events of one run follow each other in time, so a matching need not
//! cross itself: it is a path through the grid of (old events taken, new events
//! taken), and the cheapest path is found row by row, as in the alignment of
//! sequences (Needleman and Wunsch 1970). The modes of a state stand for a
//! split or merge that is still open, so that it may have any number of parts
//! and each costs one move.
//!
//! Three things keep this near linear, and none of them makes the result less
//! than optimal among the matchings that they allow:
//!
//! - Events that are equal in every column compared are the same event; the path
//!   must go through them.
//! - An event is held against those that start before it ends, or up to one
//!   window behind its onset, and not behind the [`NEAREST`]th event after it on
//!   its own side: of two chattering runs each event meets a few dozen others.
//!   Which of two events starts first decides, not its side.
//! - Once all paths that are still open go through one state, what lies before it is
//!   settled and leaves memory. Only a stretch over which it is open what is
//!   best stays, not the table.

use std::collections::{BTreeSet, VecDeque};

use asperity_record::SlipEvent;

use crate::column::{Column, Columns, Kind, Value};
use crate::cost::{self, ALONE, Cost, Ranked};

/// How many events of its own side an event may look past. Beyond so many that start
/// within one window of each other it is arbitrary which is which.
pub const NEAREST: usize = 32;

/// Rows after which it is looked for a state that all paths go through.
const ROWS_BETWEEN_FLUSHES: usize = 64;

/// Two tables that cannot be matched.
#[derive(Debug, thiserror::Error)]
pub enum MatchError<E> {
    /// A table could not be read.
    #[error("{0}")]
    Source(E),
    /// A table is not in order.
    #[error(
        "{side} table: event {event} starts at {onset_s} s, the one before it at {before_s} s \
         (accepted: events in order of their onsets)"
    )]
    Order {
        /// `old` or `new`.
        side: &'static str,
        /// Number of the event.
        event: u64,
        /// Its onset, s.
        onset_s: f64,
        /// Onset of the event before it, s.
        before_s: f64,
    },
}

/// Events that belong together, in order of onset on each side.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// The old events.
    pub old: Vec<SlipEvent>,
    /// The new events.
    pub new: Vec<SlipEvent>,
    /// Whether they are one old and one new event, equal in every column compared.
    pub identical: bool,
}

impl Group {
    /// The earliest onset of its events, s.
    pub fn onset_s(&self) -> f64 {
        let first = |events: &[SlipEvent]| events.first().map_or(f64::INFINITY, |event| event.onset_s);
        first(&self.old).min(first(&self.new))
    }
}

/// Matches two tables and hands out the groups in order of their onsets.
///
/// # Errors
/// If a table cannot be read or is not in order, or `emit` fails.
pub fn match_tables<E>(
    old: impl Iterator<Item = Result<SlipEvent, E>>,
    new: impl Iterator<Item = Result<SlipEvent, E>>,
    columns: Columns,
    window_s: f64,
    emit: impl FnMut(Group) -> Result<(), E>,
) -> Result<(), MatchError<E>> {
    let compared = columns.iter().filter(|column| column.kind() != Kind::Number).collect::<Columns>();
    let mut matcher = Matcher {
        old: Side::new("old", old),
        new: Side::new("new", new),
        twins: VecDeque::new(),
        columns: compared,
        window_s,
        onsets: 0,
        rows: VecDeque::new(),
        settled: (0, 0),
        row: Row::start(0),
        flush_at: ROWS_BETWEEN_FLUSHES,
        held: Vec::new(),
        emit,
    };
    matcher.run()
}

/// One table as it is read: what was read and is not settled, and the event after it.
struct Side<I> {
    name: &'static str,
    source: I,
    ahead: Option<SlipEvent>,
    started: bool,
    /// Events from number `first` of the table on.
    events: VecDeque<Ranked>,
    first: usize,
}

impl<I, E> Side<I>
where
    I: Iterator<Item = Result<SlipEvent, E>>,
{
    fn new(name: &'static str, source: I) -> Side<I> {
        Side { name, source, ahead: None, started: false, events: VecDeque::new(), first: 0 }
    }

    /// How many have been read, settled ones included.
    fn read(&self) -> usize {
        self.first + self.events.len()
    }

    fn get(&self, index: usize) -> &Ranked {
        &self.events[index - self.first]
    }

    /// Onset of an event, if it has been read.
    fn onset_s(&self, index: usize) -> Option<f64> {
        self.events.get(index - self.first).map(|ranked| ranked.event.onset_s)
    }

    /// Onset of the event that will be read next, s; infinite behind the last.
    fn next_onset_s(&mut self) -> Result<f64, MatchError<E>> {
        if !self.started {
            self.started = true;
            self.advance()?;
        }
        Ok(self.ahead.as_ref().map_or(f64::INFINITY, |event| event.onset_s))
    }

    fn advance(&mut self) -> Result<Option<SlipEvent>, MatchError<E>> {
        let next = self.source.next().transpose().map_err(MatchError::Source)?;
        if let Some(next) = &next {
            let before_s = self.ahead.as_ref().map_or(f64::NEG_INFINITY, |event| event.onset_s);
            // Written so that an onset that is no number is not in order either.
            let in_order = next.onset_s >= before_s && next.onset_s.is_finite();
            if !in_order {
                let (event, onset_s) = (next.event, next.onset_s);
                return Err(MatchError::Order { side: self.name, event, onset_s, before_s });
            }
        }
        Ok(std::mem::replace(&mut self.ahead, next))
    }

    /// Reads all events of one onset, in an order that does not depend on the table's.
    fn read_onset(&mut self, onset_s: f64, rank: u64, columns: Columns) -> Result<(), MatchError<E>> {
        let from = self.events.len();
        while self.next_onset_s()? == onset_s {
            if let Some(event) = self.advance()? {
                self.events.push_back(Ranked::new(event, rank));
            }
        }
        if self.events.len() > from + 1 {
            self.events.make_contiguous()[from..].sort_by(|a, b| {
                let keys = columns.iter().map(|column| (column.of(&a.event), column.of(&b.event)));
                keys.map(|(a, b)| in_order(a, b))
                    .find(|order| order.is_ne())
                    .unwrap_or(a.event.event.cmp(&b.event.event))
            });
        }
        Ok(())
    }

    /// Whether the event `index` looks as far as an onset behind its own.
    fn reaches(&self, index: usize, onset_s: f64, window_s: f64) -> bool {
        let event = &self.get(index).event;
        onset_s <= latest_s(event, window_s)
            && self.onset_s(index + NEAREST).is_none_or(|limit_s| onset_s <= limit_s)
    }
}

fn latest_s(event: &SlipEvent, window_s: f64) -> f64 {
    event.end_s.unwrap_or(event.onset_s).max(event.onset_s + window_s)
}

fn in_order(a: Value, b: Value) -> std::cmp::Ordering {
    let key = |value: Value| match value {
        Value::Empty => (1, 0.0),
        Value::Number(value) => (0, value),
        Value::Whole(value) => (0, value as f64),
        Value::Flag(value) => (0, f64::from(u8::from(value))),
    };
    let ((a_kind, a), (b_kind, b)) = (key(a), key(b));
    a_kind.cmp(&b_kind).then(a.total_cmp(&b))
}

/// What a path through the grid is in the middle of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
enum Mode {
    /// Nothing.
    Between,
    /// The next old event is split; one part has been found.
    Split1,
    /// The same, with two parts or more.
    Split2,
    /// The next new event is merged; one part has been found.
    Merge1,
    /// The same, with two parts or more.
    Merge2,
}

const MODES: [Mode; 5] = [Mode::Between, Mode::Split1, Mode::Split2, Mode::Merge1, Mode::Merge2];

/// The last move of the cheapest path to a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
enum Move {
    /// There is no path.
    None,
    /// An old event is left over.
    SkipOld,
    /// A new event is left over.
    SkipNew,
    /// A pair.
    Pair,
    /// A split is complete.
    CloseSplit,
    /// A merge is complete.
    CloseMerge,
    /// The first part of a split or merge.
    Start,
    /// The second part.
    Second,
    /// A further part.
    Further,
}

const MOVES: [Move; 9] = [
    Move::None,
    Move::SkipOld,
    Move::SkipNew,
    Move::Pair,
    Move::CloseSplit,
    Move::CloseMerge,
    Move::Start,
    Move::Second,
    Move::Further,
];

/// The last moves to the five states of a cell, four bits each.
#[derive(Debug, Clone, Copy, Default)]
struct Moves(u32);

impl Moves {
    fn get(self, mode: Mode) -> Move {
        MOVES[(self.0 >> (4 * mode as u32) & 0xf) as usize]
    }

    fn set(&mut self, mode: Mode, last: Move) {
        let shift = 4 * mode as u32;
        self.0 = self.0 & !(0xf << shift) | (last as u32) << shift;
    }
}

/// A state: so many old and new events taken, in this mode.
type State = (usize, usize, Mode);

/// A row of the grid: the cells with so many old events taken.
struct Row {
    /// New events taken in its first cell.
    from: usize,
    costs: Vec<[Cost; 5]>,
    moves: Vec<Moves>,
}

impl Row {
    /// A row with one cell, where paths start.
    fn start(taken: usize) -> Row {
        let mut row = Row { from: taken, costs: Vec::new(), moves: Vec::new() };
        row.reach_to(taken);
        row.costs[0][Mode::Between as usize] = Cost::NONE;
        row
    }

    /// Makes room for cells with up to so many new events taken.
    fn reach_to(&mut self, taken: usize) {
        let cells = taken + 1 - self.from;
        if self.costs.len() < cells {
            self.costs.resize(cells, [Cost::NEVER; 5]);
            self.moves.resize(cells, Moves::default());
        }
    }

    fn cost(&self, taken: usize, mode: Mode) -> Cost {
        self.costs[taken - self.from][mode as usize]
    }

    /// Takes a path to a state if it is cheaper than that known.
    fn offer(&mut self, taken: usize, mode: Mode, cost: Cost, last: Move) {
        let cell = taken - self.from;
        let best = &mut self.costs[cell][mode as usize];
        if cost < *best {
            *best = cost;
            self.moves[cell].set(mode, last);
        }
    }
}

struct Matcher<O, N, F> {
    old: Side<O>,
    new: Side<N>,
    /// Events that are equal in every column compared and lie ahead, by their numbers.
    twins: VecDeque<(usize, usize)>,
    columns: Columns,
    window_s: f64,
    /// Number of different onsets read.
    onsets: u64,
    /// Rows that are finished and not settled: their first cells, and the moves.
    rows: VecDeque<(usize, Vec<Moves>)>,
    /// The state that all paths go through: old and new events taken.
    settled: (usize, usize),
    /// The row at hand, number `settled.0 + rows.len()`.
    row: Row,
    flush_at: usize,
    /// Groups that are settled, but may not be the next in time.
    held: Vec<Group>,
    emit: F,
}

impl<O, N, F, E> Matcher<O, N, F>
where
    O: Iterator<Item = Result<SlipEvent, E>>,
    N: Iterator<Item = Result<SlipEvent, E>>,
    F: FnMut(Group) -> Result<(), E>,
{
    fn run(&mut self) -> Result<(), MatchError<E>> {
        loop {
            let taken = self.settled.0 + self.rows.len();
            if taken == self.old.read() {
                if !self.read_onset()? {
                    return self.finish();
                }
                if self.new.events.len() >= ROWS_BETWEEN_FLUSHES {
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

    /// Reads the events of the next onset of both sides; `false` behind the last.
    fn read_onset(&mut self) -> Result<bool, MatchError<E>> {
        let onset_s = self.old.next_onset_s()?.min(self.new.next_onset_s()?);
        if onset_s == f64::INFINITY {
            return Ok(false);
        }
        let (old, new) = (self.old.read(), self.new.read());
        self.old.read_onset(onset_s, self.onsets, self.columns)?;
        self.new.read_onset(onset_s, self.onsets, self.columns)?;
        self.onsets += 1;
        let mut next = new;
        for old in old..self.old.read() {
            let event = &self.old.get(old).event;
            let twin = (next..self.new.read()).find(|&new| self.equal(event, &self.new.get(new).event));
            if let Some(new) = twin {
                self.twins.push_back((old, new));
                next = new + 1;
            }
        }
        Ok(true)
    }

    fn equal(&self, old: &SlipEvent, new: &SlipEvent) -> bool {
        self.columns.iter().all(|column| column.of(old) == column.of(new))
    }

    /// Reads all that the old event `taken` is to be held against.
    fn read_ahead(&mut self, taken: usize) -> Result<(), MatchError<E>> {
        loop {
            let next_s = self.old.next_onset_s()?.min(self.new.next_onset_s()?);
            if !self.old.reaches(taken, next_s, self.window_s) {
                return Ok(());
            }
            self.read_onset()?;
        }
    }

    /// Whether two events may be held against each other.
    fn may_meet(&self, old: usize, new: usize) -> bool {
        let (old_s, new_s) = (self.old.get(old).event.onset_s, self.new.get(new).event.onset_s);
        if old_s <= new_s {
            self.old.reaches(old, new_s, self.window_s)
        } else {
            self.new.reaches(new, old_s, self.window_s)
        }
    }

    /// New events that the row of an old event takes in: up to those that it reaches, and to
    /// the next event that has a twin.
    fn row_end(&self, taken: usize) -> usize {
        let mut end = self.row.from + self.row.costs.len() - 1;
        let onset_s = self.old.get(taken).event.onset_s;
        while let Some(new_s) = self.new.onset_s(end) {
            if new_s > onset_s && !self.old.reaches(taken, new_s, self.window_s) {
                break;
            }
            end += 1;
        }
        self.twins.front().map_or(end, |&(_, new)| end.min(new))
    }

    /// Moves along the row at hand and from it to the next, which takes one old event more.
    fn take_row(&mut self, taken: usize) {
        let end = self.row_end(taken);
        let mut row = std::mem::replace(&mut self.row, Row { from: 0, costs: Vec::new(), moves: Vec::new() });
        row.reach_to(end);
        // No later old event comes near those before: they start no earlier.
        let onset_s = self.old.get(taken).event.onset_s;
        let mut near = row.from.max(self.new.first);
        while near < end && !self.is_within_sight(near, onset_s) {
            near += 1;
        }
        let mut next = Row { from: near, costs: Vec::with_capacity(end + 2 - near), moves: Vec::new() };
        next.reach_to(end);
        let whole = self.old.get(taken);
        for new in row.from..=end {
            let between = row.cost(new, Mode::Between);
            let splits = [row.cost(new, Mode::Split1), row.cost(new, Mode::Split2)];
            let merges = [row.cost(new, Mode::Merge1), row.cost(new, Mode::Merge2)];
            if new >= near {
                if between.is_possible() {
                    next.offer(new, Mode::Between, between.and(ALONE), Move::SkipOld);
                }
                if splits[1].is_possible() {
                    next.offer(new, Mode::Between, splits[1], Move::CloseSplit);
                }
            }
            if new == end {
                break;
            }
            if between.is_possible() {
                row.offer(new + 1, Mode::Between, between.and(ALONE), Move::SkipNew);
            }
            if merges[1].is_possible() {
                row.offer(new + 1, Mode::Between, merges[1], Move::CloseMerge);
            }
            for (cost, mode) in splits.into_iter().zip([Mode::Split1, Mode::Split2]) {
                if cost.is_possible() {
                    row.offer(new + 1, mode, cost.and(ALONE), Move::SkipNew);
                }
            }
            if new < near {
                continue;
            }
            for (cost, mode) in merges.into_iter().zip([Mode::Merge1, Mode::Merge2]) {
                if cost.is_possible() {
                    next.offer(new, mode, cost.and(ALONE), Move::SkipOld);
                }
            }
            let is_live =
                between.is_possible() || splits.iter().chain(&merges).any(|cost| cost.is_possible());
            if !is_live || !self.may_meet(taken, new) {
                continue;
            }
            let other = self.new.get(new);
            if between.is_possible()
                && let Some(pair) = cost::pair(whole, other, self.window_s)
            {
                next.offer(new + 1, Mode::Between, between + pair, Move::Pair);
            }
            if let Some(part) = cost::part(whole, other) {
                if between.is_possible() {
                    row.offer(new + 1, Mode::Split1, between.and(cost::begun()) + part, Move::Start);
                }
                if splits[0].is_possible() {
                    row.offer(new + 1, Mode::Split2, splits[0] + part, Move::Second);
                }
                if splits[1].is_possible() {
                    row.offer(new + 1, Mode::Split2, splits[1] + part, Move::Further);
                }
            }
            if let Some(part) = cost::part(other, whole) {
                if between.is_possible() {
                    next.offer(new, Mode::Merge1, between.and(cost::begun()) + part, Move::Start);
                }
                if merges[0].is_possible() {
                    next.offer(new, Mode::Merge2, merges[0] + part, Move::Second);
                }
                if merges[1].is_possible() {
                    next.offer(new, Mode::Merge2, merges[1] + part, Move::Further);
                }
            }
        }
        self.rows.push_back((row.from, row.moves));
        self.row = next;
    }

    /// Whether a new event may meet an old one of this onset, or a later one.
    fn is_within_sight(&self, new: usize, onset_s: f64) -> bool {
        self.new.get(new).event.onset_s >= onset_s || self.new.reaches(new, onset_s, self.window_s)
    }

    /// Leads all paths to so many new events or more, without taking an old one.
    fn run_to(&mut self, end: usize) {
        self.row.reach_to(end);
        for new in self.row.from..end {
            let between = self.row.cost(new, Mode::Between);
            let merge = self.row.cost(new, Mode::Merge2);
            if between.is_possible() {
                self.row.offer(new + 1, Mode::Between, between.and(ALONE), Move::SkipNew);
            }
            if merge.is_possible() {
                self.row.offer(new + 1, Mode::Between, merge, Move::CloseMerge);
            }
            self.row.costs[new - self.row.from] = [Cost::NEVER; 5];
        }
    }

    /// The same, where all paths end there.
    fn run_out(&mut self, end: usize) {
        self.run_to(end);
        let row = std::mem::replace(&mut self.row, Row::start(end));
        self.rows.push_back((row.from, row.moves));
    }

    /// While no old event comes, settles the new ones that the next will be too late for.
    fn roll(&mut self) -> Result<(), MatchError<E>> {
        let next_s = self.old.next_onset_s()?.min(self.new.next_onset_s()?);
        let mut near = self.row.from.max(self.new.first);
        while near < self.new.read() && !self.is_within_sight(near, next_s) {
            near += 1;
        }
        // New events with a twin wait for it.
        near = self.twins.front().map_or(near, |&(_, new)| near.min(new));
        if near < self.new.first + ROWS_BETWEEN_FLUSHES / 2 {
            return Ok(());
        }
        self.run_to(near);
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
        let pair = [&mut self.old.events, &mut self.new.events].map(|events| events.pop_front());
        let [Some(old_twin), Some(new_twin)] = pair else { unreachable!("twins have been read") };
        self.held.push(Group { old: vec![old_twin.event], new: vec![new_twin.event], identical: true });
        self.old.first = old + 1;
        self.new.first = new + 1;
        self.settled = (old + 1, new + 1);
        self.row = Row::start(new + 1);
        self.flush_at = ROWS_BETWEEN_FLUSHES;
        self.release()
    }

    /// Behind the last old event: what is left of the new side is extra.
    fn finish(&mut self) -> Result<(), MatchError<E>> {
        let old = self.settled.0 + self.rows.len();
        let end = self.new.read();
        self.run_out(end);
        self.settle((old, end, Mode::Between));
        self.rows.clear();
        self.settled = (old, end);
        self.release()
    }

    /// Settles what all open paths have in common.
    fn flush(&mut self) -> Result<(), MatchError<E>> {
        let taken = self.settled.0 + self.rows.len();
        let mut open: BTreeSet<State> = BTreeSet::new();
        for (cell, costs) in self.row.costs.iter().enumerate() {
            let possible = MODES.into_iter().filter(|&mode| costs[mode as usize].is_possible());
            open.extend(possible.map(|mode| (taken, self.row.from + cell, mode)));
        }
        let start = (self.settled.0, self.settled.1, Mode::Between);
        while let Some(last) = open.pop_last() {
            if open.is_empty() && last.2 == Mode::Between {
                open.insert(last);
                break;
            }
            open.insert(self.before(last).0);
        }
        let Some(&common) = open.first() else { unreachable!("there is a path to every row") };
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

    /// Holds the groups of the path up to a state, and forgets their events.
    fn settle(&mut self, (end_old, end_new, mode): State) {
        let (first_old, first_new) = self.settled;
        let mut olds: Vec<Option<SlipEvent>> =
            self.old.events.drain(..end_old - first_old).map(|ranked| Some(ranked.event)).collect();
        let mut news: Vec<Option<SlipEvent>> =
            self.new.events.drain(..end_new - first_new).map(|ranked| Some(ranked.event)).collect();
        self.old.first = end_old;
        self.new.first = end_new;
        let mut group = Group { old: Vec::new(), new: Vec::new(), identical: false };
        let mut state = (end_old, end_new, mode);
        while state != (first_old, first_new, Mode::Between) {
            let (before, last) = self.before(state);
            let old = |olds: &mut [Option<SlipEvent>]| olds[before.0 - first_old].take();
            let new = |news: &mut [Option<SlipEvent>]| news[before.1 - first_new].take();
            let splitting = matches!(state.2, Mode::Split1 | Mode::Split2);
            let alone = |old: Option<SlipEvent>, new: Option<SlipEvent>| Group {
                old: old.into_iter().collect(),
                new: new.into_iter().collect(),
                identical: false,
            };
            match last {
                Move::SkipOld => self.held.push(alone(old(&mut olds), None)),
                Move::SkipNew => self.held.push(alone(None, new(&mut news))),
                Move::Pair => self.held.push(alone(old(&mut olds), new(&mut news))),
                // Walking back, a group opens where it closed.
                Move::CloseSplit => group = alone(old(&mut olds), None),
                Move::CloseMerge => group = alone(None, new(&mut news)),
                Move::Start | Move::Second | Move::Further => {
                    if splitting {
                        group.new.extend(new(&mut news));
                    } else {
                        group.old.extend(old(&mut olds));
                    }
                    if last == Move::Start {
                        group.old.reverse();
                        group.new.reverse();
                        let empty = Group { old: Vec::new(), new: Vec::new(), identical: false };
                        self.held.push(std::mem::replace(&mut group, empty));
                    }
                }
                Move::None => unreachable!("every state on a path has a move"),
            }
            state = before;
        }
    }

    /// Hands out what no later group can come before, in order of onset.
    fn release(&mut self) -> Result<(), MatchError<E>> {
        let front = |s: Option<f64>, next_s: f64| s.unwrap_or(next_s);
        let old_s = front(self.old.onset_s(self.old.first), self.old.next_onset_s()?);
        let new_s = front(self.new.onset_s(self.new.first), self.new.next_onset_s()?);
        let until_s = old_s.min(new_s);
        // Those of one onset in an order that does not depend on the side.
        let key = |group: &Group| {
            let all = || group.old.iter().chain(&group.new);
            let end_s = all().map(|event| event.end_s.unwrap_or(event.onset_s)).fold(0.0, f64::max);
            (end_s, all().map(|event| event.first_block).min(), all().map(|event| event.last_block).max())
        };
        if self.held.len() > 1 {
            self.held.sort_by(|a, b| {
                let ((a_end_s, a_first, a_last), (b_end_s, b_first, b_last)) = (key(a), key(b));
                let blocks = (a_first, a_last).cmp(&(b_first, b_last));
                a.onset_s().total_cmp(&b.onset_s()).then(a_end_s.total_cmp(&b_end_s)).then(blocks)
            });
        }
        let ready = self.held.partition_point(|group| group.onset_s() < until_s);
        for group in self.held.drain(..ready) {
            (self.emit)(group).map_err(MatchError::Source)?;
        }
        Ok(())
    }
}

/// Columns that two tables can be held against each other in: those that both have, but
/// for the steps where the tables count steps of different length.
pub fn comparable(old: Columns, new: Columns, same_step: bool) -> Columns {
    let is_comparable = |column: &Column| same_step || column.kind() != Kind::Step;
    old.and(new).iter().filter(is_comparable).collect()
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use asperity_record::SlipEvent;

    use super::{Group, match_tables};
    use crate::column::Columns;
    use crate::cost::{self, ALONE, Ranked};

    const WINDOW_S: f64 = 4.0;

    /// Numbers that look random, and are the same each time (Knuth's MMIX generator).
    struct Random(u64);

    impl Random {
        fn below(&mut self, bound: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) % bound
        }
    }

    fn event(number: u64, onset: u64, length: u64, first_block: u32, last_block: u32) -> SlipEvent {
        SlipEvent {
            onset_s: onset as f64,
            end_s: Some((onset + length) as f64),
            first_block,
            last_block,
            max_sliding: 1,
            ft_fn_onset: 0.0,
            ft_fn_end: Some(0.0),
            event: number,
            onset_step: onset,
            end_step: Some(onset + length),
            blocks_slipped: last_block - first_block + 1,
            nucleation_block: first_block,
            ft_fn_min: 0.0,
            ft_fn_max: 0.0,
            open: false,
        }
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

    fn groups(old: &[SlipEvent], new: &[SlipEvent]) -> Vec<Group> {
        let mut groups = Vec::new();
        let source = |events: &[SlipEvent]| events.to_vec().into_iter().map(Ok::<_, Infallible>);
        match_tables(source(old), source(new), Columns::ALL, WINDOW_S, |group| {
            groups.push(group);
            Ok(())
        })
        .unwrap();
        groups
    }

    fn ranked(events: &[SlipEvent]) -> Vec<Ranked> {
        events.iter().map(|event| Ranked::new(event.clone(), 0)).collect()
    }

    /// What a group costs by the table at the head of `cost.rs`.
    fn cost_of(old: &[Ranked], new: &[Ranked]) -> Option<i64> {
        let parts = |whole: &Ranked, parts: &[Ranked]| {
            let costs = parts.iter().map(|part| cost::part(whole, part).map(|cost| cost.primary));
            Some(cost::begun() + costs.sum::<Option<i64>>()?)
        };
        match (old, new) {
            ([_], []) | ([], [_]) => Some(ALONE),
            ([a], [b]) => cost::pair(a, b, WINDOW_S).map(|cost| cost.primary),
            ([whole], several) | (several, [whole]) => parts(whole, several),
            _ => None,
        }
    }

    /// The least cost of all matchings that do not cross, by trying every one.
    fn least(old: &[Ranked], new: &[Ranked]) -> i64 {
        let twin = |a: &Ranked, b: &Ranked| {
            let number = |ranked: &Ranked| SlipEvent { event: 0, ..ranked.event.clone() };
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
        // What the first old event is part of: nothing, a pair or split with any choice of new
        // events, or a merge with any choice of old ones.
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
                    // What lies before and between stays alone; the rest goes on behind.
                    let last = 32 - choice.leading_zeros() as usize;
                    let passed = last - chosen.len() + at;
                    let rest = if is_split {
                        least_without_twins(&old[1..], &new[last..])
                    } else {
                        least_without_twins(&old[last..], &new[at + 1..])
                    };
                    // New events before a part may still belong to no earlier old one: there is none.
                    best = best.min(cost + ALONE * passed as i64 + rest);
                }
            }
        }
        best
    }

    #[test]
    fn the_matching_is_the_cheapest_there_is() {
        let mut random = Random(1);
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
        let mut random = Random(2);
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
        let mut random = Random(3);
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
