//! What has come of the runs of a plan so far, read off all segments in one pass.

use std::io;
use std::path::{Path, PathBuf};

use crate::plan::Plan;
use crate::segment::{self, Kind, Reader};

/// A run that took its process with it so often is not tried again.
pub const MOST_DEATHS: u32 = 3;

/// Where a result stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    segment: u32,
    at: u64,
    length: u32,
}

/// What has come of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Nothing yet; its process died so many times.
    Missing(u32),
    /// It is done.
    Done(Place),
    /// It failed.
    Failed(Place),
    /// Its process died so often that it is not tried again.
    Quarantined,
    /// Its scenario refuses its values.
    Refused,
}

impl State {
    /// In a word, as in tables.
    pub fn word(self) -> &'static str {
        match self {
            State::Missing(_) => "missing",
            State::Done(_) => "done",
            State::Failed(_) => "failed",
            State::Quarantined => "quarantined",
            State::Refused => "refused",
        }
    }

    /// Whether the run is still to be made.
    pub fn is_missing(self) -> bool {
        matches!(self, State::Missing(_))
    }
}

/// How many runs are in which state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Done.
    pub done: u64,
    /// Failed.
    pub failed: u64,
    /// Quarantined.
    pub quarantined: u64,
    /// Refused.
    pub refused: u64,
    /// Still to be made.
    pub missing: u64,
}

/// What there is of the runs of a plan.
#[derive(Debug)]
pub struct Results {
    states: Vec<State>,
    segments: Vec<Reader>,
    /// Segments with an end that is of no whole result, and how many bytes that is.
    pub torn: Vec<(PathBuf, u64)>,
    /// Files that are no segments of this plan.
    pub foreign: Vec<PathBuf>,
}

impl Results {
    /// Reads all segments in the folder of a plan.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn read(folder: &Path, plan: &Plan) -> io::Result<Results> {
        let state = |refused: bool| if refused { State::Refused } else { State::Missing(0) };
        let states = plan.rows.iter().map(|row| state(row.refused.is_some())).collect();
        let mut results = Results { states, segments: Vec::new(), torn: Vec::new(), foreign: Vec::new() };
        for path in segment::all(folder)? {
            let Some(mut reader) = Reader::open(&path, &plan.hash)? else {
                results.foreign.push(path);
                continue;
            };
            let number = results.segments.len() as u32;
            while let Some((frame, _)) = reader.next_frame()? {
                let place = Place { segment: number, at: frame.at, length: frame.length };
                results.take(frame.run, frame.kind, place);
            }
            let torn = reader.torn()?;
            if torn > 0 {
                results.torn.push((path, torn));
            }
            results.segments.push(reader);
        }
        Ok(results)
    }

    /// A result of a run whose process died before counts, and the first of several, all of which
    /// are the same.
    fn take(&mut self, run: u64, kind: Kind, place: Place) {
        let index = run.checked_sub(1).and_then(|index| usize::try_from(index).ok());
        let Some(state) = index.and_then(|index| self.states.get_mut(index)) else { return };
        *state = match (*state, kind) {
            (State::Missing(_) | State::Quarantined, Kind::Done) => State::Done(place),
            (State::Missing(_) | State::Quarantined, Kind::Failed) => State::Failed(place),
            (State::Missing(deaths), Kind::Died) if deaths + 1 < MOST_DEATHS => State::Missing(deaths + 1),
            (State::Missing(_), Kind::Died) => State::Quarantined,
            (state, _) => state,
        };
    }

    /// What has come of a run, counted from 1.
    pub fn state(&self, run: u64) -> State {
        self.states[run as usize - 1]
    }

    /// Whether a run of the plan is still to be made.
    pub fn is_missing(&self, run: u64) -> bool {
        let index = run.checked_sub(1).and_then(|index| usize::try_from(index).ok());
        index.and_then(|index| self.states.get(index)).is_some_and(|state| state.is_missing())
    }

    /// How many runs are in which state.
    pub fn counts(&self) -> Counts {
        self.counts_of(|_| true)
    }

    /// The same of some runs alone.
    pub fn counts_of(&self, is_counted: impl Fn(&u64) -> bool) -> Counts {
        let mut counts = Counts::default();
        for (_, state) in (1..).zip(&self.states).filter(|(run, _)| is_counted(run)) {
            *match state {
                State::Missing(_) => &mut counts.missing,
                State::Done(_) => &mut counts.done,
                State::Failed(_) => &mut counts.failed,
                State::Quarantined => &mut counts.quarantined,
                State::Refused => &mut counts.refused,
            } += 1;
        }
        counts
    }

    /// The runs that are still to be made, in order.
    pub fn missing(&self) -> impl Iterator<Item = u64> {
        (1..).zip(&self.states).filter(|(_, state)| state.is_missing()).map(|(run, _)| run)
    }

    /// The content of a result.
    ///
    /// # Errors
    /// If its segment cannot be read.
    pub fn content(&mut self, place: Place) -> io::Result<Vec<u8>> {
        self.segments[place.segment as usize].content(place.at, place.length)
    }
}

/// Runs as batch systems name them: `3,7-9`.
pub fn ranges(runs: impl IntoIterator<Item = u64>) -> String {
    let mut ranges: Vec<(u64, u64)> = Vec::new();
    for run in runs {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == run => *last = run,
            _ => ranges.push((run, run)),
        }
    }
    let word = |(first, last): (u64, u64)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    };
    ranges.into_iter().map(word).collect::<Vec<_>>().join(",")
}

/// The runs that `3,7-9` names.
///
/// # Errors
/// In words, if it names none.
pub fn parse_ranges(text: &str, most: u64) -> Result<Vec<u64>, String> {
    let refused = || format!("{text} (accepted: runs from 1 to {most}, as in 3,7-9)");
    let mut runs = Vec::new();
    for part in text.split(',') {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let [first, last] = [first, last].map(|number| number.trim().parse::<u64>());
        let (Ok(first), Ok(last)) = (first, last) else { return Err(refused()) };
        if !(1 <= first && first <= last && last <= most) {
            return Err(refused());
        }
        runs.extend(first..=last);
    }
    runs.sort_unstable();
    runs.dedup();
    Ok(runs)
}

#[cfg(test)]
mod tests {
    use super::{parse_ranges, ranges};

    #[test]
    fn ranges_are_written_as_they_are_read() {
        for text in ["3,7-9", "1-2", "5", "1,3,5-100"] {
            assert_eq!(ranges(parse_ranges(text, 100).unwrap()), text);
        }
        assert_eq!(parse_ranges("3,1-2,2", 9).unwrap(), [1, 2, 3]);
        for text in ["", "0", "3-2", "1-10", "x", "-", "1,,2"] {
            assert!(parse_ranges(text, 9).unwrap_err().contains("(accepted: runs from 1 to 9"), "{text}");
        }
    }
}
