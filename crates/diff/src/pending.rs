//! One side of the matching: a table that is read in order, and the part whose matches are not final yet.

use crate::column::{Columns, Value};
use crate::cost::Span;
use crate::progress::Progress;
use crate::row::Row;

/// Number of later events of its own side up to which an event is compared. If more of them start within
/// one window, their assignment is arbitrary anyway.
pub const NEAREST: usize = 32;

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
    /// Too many events start together to be distinguished.
    #[error(
        "{side} table: more than {MOST_AT_ONCE} events start at {onset_s} s (accepted: one in a step, as in a run; \
         up to {MOST_AT_ONCE} where times are rounded)"
    )]
    AtOnce {
        /// `old` or `new`.
        side: &'static str,
        /// Their onset, s.
        onset_s: f64,
    },
}

/// Most events with the same onset, which are all compared with each other. A run has one per onset.
pub const MOST_AT_ONCE: usize = 100;

/// A table as it is read: the events that are not settled, and the one after them.
pub(crate) struct Pending<I, R> {
    name: &'static str,
    source: I,
    progress: Progress,
    ahead: Option<R>,
    started: bool,
    /// Events from number `first` of the table on, after `gone` settled ones.
    events: Vec<R>,
    /// Their features.
    spans: Vec<Span>,
    gone: usize,
    pub(crate) first: usize,
}

/// Settled events that may stay in memory before they are dropped all at once.
const GONE: usize = 1024;

impl<I, R, E> Pending<I, R>
where
    I: Iterator<Item = Result<R, E>>,
    R: Row,
{
    pub(crate) fn new(name: &'static str, source: I, progress: Progress) -> Pending<I, R> {
        let (events, spans) = (Vec::new(), Vec::new());
        Pending { name, source, progress, ahead: None, started: false, events, spans, gone: 0, first: 0 }
    }

    /// Start of an event: its onset, s, or its place in the cycles.
    pub(crate) fn place(&self, event: &R) -> f64 {
        self.progress.place(event.onset_s())
    }

    /// How many have been read, settled ones included.
    pub(crate) fn read(&self) -> usize {
        self.first + self.waiting()
    }

    /// How many have been read and are not settled.
    pub(crate) fn waiting(&self) -> usize {
        self.events.len() - self.gone
    }

    pub(crate) fn event(&self, index: usize) -> &R {
        &self.events[index - self.first + self.gone]
    }

    pub(crate) fn spans(&self, from: usize, to: usize) -> &[Span] {
        let physical = |index: usize| index - self.first + self.gone;
        &self.spans[physical(from)..physical(to)]
    }

    pub(crate) fn span(&self, index: usize) -> &Span {
        &self.spans[index - self.first + self.gone]
    }

    /// Place of an event, if it has been read.
    pub(crate) fn onset_s(&self, index: usize) -> Option<f64> {
        self.spans.get(index - self.first + self.gone).map(|span| span.onset_s)
    }

    /// Forgets the events before this one.
    pub(crate) fn settle(&mut self, index: usize) {
        self.gone += index - self.first;
        self.first = index;
        if self.gone > GONE && 2 * self.gone > self.events.len() {
            self.events.drain(..self.gone);
            self.spans.drain(..self.gone);
            self.gone = 0;
        }
    }

    /// Place of the event that will be read next; infinite after the last.
    pub(crate) fn next_onset_s(&mut self) -> Result<f64, MatchError<E>> {
        if !self.started {
            self.started = true;
            self.advance()?;
        }
        Ok(self.ahead.as_ref().map_or(f64::INFINITY, |event| self.place(event)))
    }

    fn advance(&mut self) -> Result<Option<R>, MatchError<E>> {
        let next = self.source.next().transpose().map_err(MatchError::Source)?;
        if let Some(next) = &next {
            let (event, onset_s) = (next.number(), next.onset_s());
            let before_s = self.ahead.as_ref().map_or(f64::NEG_INFINITY, R::onset_s);
            // Written so that a NaN onset counts as out of order.
            let in_order = onset_s >= before_s && onset_s.is_finite();
            if !in_order {
                return Err(MatchError::Order { side: self.name, event, onset_s, before_s });
            }
        }
        Ok(std::mem::replace(&mut self.ahead, next))
    }

    /// Reads all events of one place, in an order that does not depend on the table's.
    pub(crate) fn read_onset(
        &mut self,
        onset_s: f64,
        rank: u64,
        columns: Columns,
        window_s: f64,
    ) -> Result<(), MatchError<E>> {
        let from = self.events.len();
        while self.next_onset_s()? == onset_s {
            if self.events.len() == from + MOST_AT_ONCE {
                let onset_s = self.ahead.as_ref().map_or(onset_s, R::onset_s);
                return Err(MatchError::AtOnce { side: self.name, onset_s });
            }
            let event = self.advance()?;
            self.events.extend(event);
        }
        if self.events.len() > from + 1 {
            self.events[from..].sort_by(|a, b| {
                let keys = columns.iter().map(|column| (a.cell(column), b.cell(column)));
                let order = keys.map(|(a, b)| in_order(a, b)).find(|order| order.is_ne());
                order.unwrap_or(a.number().cmp(&b.number()))
            });
        }
        for index in from..self.events.len() {
            self.spans.push(Span::new(&self.events[index], &self.progress, rank, window_s));
            // No event reaches beyond the later events of its own side.
            if let Some(before) = index.checked_sub(NEAREST) {
                let before = &mut self.spans[before];
                before.reach_s = before.reach_s.min(onset_s);
            }
        }
        Ok(())
    }
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
