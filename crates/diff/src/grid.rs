//! The grid for the search of the cheapest path, row by row: one cell per number of old and new events
//! consumed, with one state per mode.

use crate::cost::{self, ALONE, BEGUN, Cost, Overlap, Span};

/// The group that is still open on a path through the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    /// Nothing.
    Between,
    /// The next old event is split; one part has been found.
    Split1,
    /// The next old event is split; two or more parts have been found.
    Split2,
    /// The next new event is merged; one part has been found.
    Merge1,
    /// The next new event is merged; two or more parts have been found.
    Merge2,
}

pub(crate) const MODES: [Mode; 5] = [Mode::Between, Mode::Split1, Mode::Split2, Mode::Merge1, Mode::Merge2];

/// The last move of the cheapest path to a state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Move {
    /// There is no path.
    #[default]
    None,
    /// Paths start here.
    Origin,
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

/// The last moves to the five states of a cell.
pub(crate) type Moves = [Move; 5];

/// A state: the numbers of old and new events consumed, and the mode.
pub(crate) type State = (usize, usize, Mode);

/// A row of the grid: all cells with the same number of old events consumed.
pub(crate) struct CostRow {
    /// Number of new events consumed in its first cell.
    pub(crate) from: usize,
    /// At least as many as cells; valid for states that a path leads to.
    pub(crate) costs: Vec<[Cost; 5]>,
    /// One for each cell.
    pub(crate) moves: Vec<Moves>,
}

impl CostRow {
    /// A row without paths, for a range of numbers of new events consumed; `costs` is reused memory.
    pub(crate) fn cleared(from: usize, to: usize, costs: Vec<[Cost; 5]>) -> CostRow {
        let mut row = CostRow { from, costs, moves: Vec::new() };
        row.reach_to(to);
        row
    }

    /// A row with one cell, where paths start.
    pub(crate) fn start(taken: usize) -> CostRow {
        let mut row = CostRow::cleared(taken, taken, Vec::new());
        row.offer(taken, Mode::Between, Cost::NONE, Move::Origin);
        row
    }

    /// Makes room for cells with up to this many new events consumed.
    pub(crate) fn reach_to(&mut self, taken: usize) {
        let cells = taken + 1 - self.from;
        if self.moves.len() < cells {
            self.moves.resize(cells, Moves::default());
        }
        if self.costs.len() < cells {
            self.costs.resize(cells, [Cost::NONE; 5]);
        }
    }

    /// Stores a path to a state if it is cheaper than the known one.
    #[inline]
    pub(crate) fn offer(&mut self, taken: usize, mode: Mode, cost: Cost, last: Move) {
        let cell = taken - self.from;
        let (moves, best) = (&mut self.moves[cell], &mut self.costs[cell][mode as usize]);
        let moves = &mut moves[mode as usize];
        if *moves == Move::None || cost < *best {
            (*best, *moves) = (cost, last);
        }
    }

    /// Extends paths along the row, up to `end` new events, and to the next one, which also consumes the old
    /// event `whole`. New events before the next row's first cell are too far from this old event and all
    /// later ones.
    pub(crate) fn advance<'a>(
        &mut self,
        next: &mut CostRow,
        end: usize,
        whole: &Span,
        news: impl Fn(usize) -> &'a Span,
        window_s: f64,
    ) {
        let near = next.from;
        self.reach_to(end);
        for new in self.from..=end {
            let live = self.moves[new - self.from].map(|last| last != Move::None);
            let [between, split1, split2, merge1, merge2] = self.costs[new - self.from];
            let [is_between, is_split1, is_split2, is_merge1, is_merge2] = live;
            if new >= near {
                if is_between {
                    next.offer(new, Mode::Between, between.and(ALONE), Move::SkipOld);
                }
                if is_split2 {
                    next.offer(new, Mode::Between, split2, Move::CloseSplit);
                }
            }
            if new == end {
                break;
            }
            if is_between {
                self.offer(new + 1, Mode::Between, between.and(ALONE), Move::SkipNew);
            }
            if is_merge2 {
                self.offer(new + 1, Mode::Between, merge2, Move::CloseMerge);
            }
            if is_split1 {
                self.offer(new + 1, Mode::Split1, split1.and(ALONE), Move::SkipNew);
            }
            if is_split2 {
                self.offer(new + 1, Mode::Split2, split2.and(ALONE), Move::SkipNew);
            }
            if new < near {
                continue;
            }
            if is_merge1 {
                next.offer(new, Mode::Merge1, merge1.and(ALONE), Move::SkipOld);
            }
            if is_merge2 {
                next.offer(new, Mode::Merge2, merge2.and(ALONE), Move::SkipOld);
            }
            let other = news(new);
            // The reach of the one that starts first counts.
            let may_meet = match whole.onset_s <= other.onset_s {
                true => other.onset_s <= whole.reach_s,
                false => whole.onset_s <= other.reach_s,
            };
            if !may_meet {
                continue;
            }
            let Some(overlap) = Overlap::of(whole, other) else { continue };
            if is_between && let Some(pair) = cost::pair(whole, other, overlap, window_s) {
                next.offer(new + 1, Mode::Between, between + pair, Move::Pair);
            }
            if overlap.common_s == 0.0 {
                continue;
            }
            if let Some(part) = cost::part(whole, other, overlap) {
                if is_between {
                    self.offer(new + 1, Mode::Split1, between.and(BEGUN) + part, Move::Start);
                }
                if is_split1 {
                    self.offer(new + 1, Mode::Split2, split1 + part, Move::Second);
                }
                if is_split2 {
                    self.offer(new + 1, Mode::Split2, split2 + part, Move::Further);
                }
            }
            if let Some(part) = cost::part(other, whole, overlap) {
                if is_between {
                    next.offer(new, Mode::Merge1, between.and(BEGUN) + part, Move::Start);
                }
                if is_merge1 {
                    next.offer(new, Mode::Merge2, merge1 + part, Move::Second);
                }
                if is_merge2 {
                    next.offer(new, Mode::Merge2, merge2 + part, Move::Further);
                }
            }
        }
    }

    /// Leads all paths to this many new events or more, without taking an old one.
    pub(crate) fn run_to(&mut self, end: usize) {
        self.reach_to(end);
        for new in self.from..end {
            let [between, .., merge] = self.costs[new - self.from];
            let [is_between, .., is_merge] = self.moves[new - self.from].map(|last| last != Move::None);
            if is_between {
                self.offer(new + 1, Mode::Between, between.and(ALONE), Move::SkipNew);
            }
            if is_merge {
                self.offer(new + 1, Mode::Between, merge, Move::CloseMerge);
            }
        }
    }
}
