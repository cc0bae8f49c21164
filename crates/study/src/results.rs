//! The results of a plan's runs so far, read from all segments in one pass.
//!
//! A run has one result, wherever and however often it is made; the result of a named run is its log. Two
//! different results of a run, or a result under the number of another run, indicate a node that computes
//! or stores wrongly: these are [`Fault`]s, and prevent tables.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::{self, BufRead};
use std::path::{Path, PathBuf};

use asperity_files::fill;
use asperity_runlog::{RunReader, Topics};

use crate::plan::{Plan, Row};
use crate::segment::{self, Frame, Kind, Owner, Reader};
use crate::stored::{KeptEvents, Stored, kept_events, reason};

/// Most faults that are stored: enough to identify the files.
const MOST_FAULTS: usize = 100;

/// The remedy for a [`Fault`].
pub const WHAT_TO_DO: &str = "a run gives the same result wherever it is made: remove the file of the \
                              faulty node (its name begins with the name of the node), or all of these \
                              files, and `asperity sweep run` repeats their runs";

/// The position of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    segment: u32,
    at: u64,
    length: u64,
}

/// The position of a result in readable form: file and byte.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Spot {
    /// The segment.
    pub path: PathBuf,
    /// The offset of the result's content.
    pub at: u64,
}

impl fmt::Display for Spot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: byte {}", self.path.display(), self.at)
    }
}

/// A result that contradicts the plan or another result.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// A result that is not of the run of its number.
    #[error("{spot}: run {run}: {problem}")]
    Stray {
        /// Its position.
        spot: Spot,
        /// Its number.
        run: u64,
        /// The error, and the accepted values.
        problem: String,
    },
    /// Two different results of one run.
    #[error("run {run} has two results that differ: {difference}, in {first} and {second}")]
    Differ {
        /// The run.
        run: u64,
        /// The position of one.
        first: Spot,
        /// The position of the other.
        second: Spot,
        /// The first number that differs.
        difference: String,
    },
}

/// The state of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// No result yet.
    Missing,
    /// It has a result.
    Done(Place),
    /// It is a named run, and its log exists and is complete.
    Logged,
    /// It failed.
    Failed(Place),
    /// The scenario refuses its values.
    Refused,
    /// It has two different results.
    Contradicted,
}

impl State {
    /// The word in tables.
    pub fn word(self) -> &'static str {
        match self {
            State::Missing => "missing",
            State::Done(_) | State::Logged => "done",
            State::Failed(_) => "failed",
            State::Refused => "refused",
            State::Contradicted => "contradicted",
        }
    }

    /// Whether the run must still be made.
    pub fn is_missing(self) -> bool {
        self == State::Missing
    }
}

/// Numbers of runs by state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Done.
    pub done: u64,
    /// Failed.
    pub failed: u64,
    /// Refused.
    pub refused: u64,
    /// With two different results.
    pub contradicted: u64,
    /// To be made.
    pub missing: u64,
}

/// The results of a plan's runs.
#[derive(Debug)]
pub struct Results {
    states: Vec<State>,
    segments: Vec<PathBuf>,
    /// The segment of a second result of a run, equal to the first; of another node, if there is one.
    again: BTreeMap<u64, u32>,
    /// Segments that end in an incomplete frame, and its bytes.
    pub torn: Vec<(PathBuf, u64)>,
    /// Files that are not segments of this plan.
    pub foreign: Vec<PathBuf>,
    /// Results that contradict the plan or each other.
    pub faults: Vec<Fault>,
}

impl Results {
    /// Reads all segments in the folder of a plan, and looks for the logs of runs that have names.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn read(folder: &Path, plan: &Plan) -> io::Result<Results> {
        let state = |refused: bool| if refused { State::Refused } else { State::Missing };
        let states = plan.rows.iter().map(|row| state(row.refused.is_some())).collect();
        let (torn, foreign, faults) = (Vec::new(), Vec::new(), Vec::new());
        let mut results =
            Results { states, segments: Vec::new(), again: BTreeMap::new(), torn, foreign, faults };
        let mut doubtful = Vec::new();
        for path in segment::all(folder)? {
            let named = |error: io::Error| {
                let name = path.strip_prefix(folder).unwrap_or(&path).display().to_string();
                io::Error::new(error.kind(), format!("{name}: {error}"))
            };
            let Some(mut reader) = Reader::open(&path, &plan.hash).map_err(named)? else {
                results.foreign.push(path);
                continue;
            };
            let number = results.segments.len() as u32;
            results.segments.push(path.clone());
            while let Some(frame) = reader.next_frame()? {
                let place = Place { segment: number, at: frame.at, length: frame.length };
                match of_run(plan, &frame) {
                    Ok(row) => doubtful.extend(results.take(row, &frame, place)),
                    Err(problem) => {
                        let spot = results.spot(place);
                        results.add(Fault::Stray { spot, run: frame.run, problem });
                    }
                }
            }
            let torn = reader.torn()?;
            if torn > 0 {
                results.torn.push((path, torn));
            }
        }
        let kept = kept_events(plan);
        for doubt in doubtful {
            results.settle(plan, &kept, doubt)?;
        }
        for row in &plan.rows[plan.numbered() as usize..] {
            if plan.named(row.run).is_some_and(|named| is_logged(&named.log(folder), row)) {
                results.states[row.run as usize - 1] = State::Logged;
            }
        }
        Ok(results)
    }

    /// Adds a result: the first of a run counts. Returns further ones, which
    /// must be compared with it.
    fn take(&mut self, row: &Row, frame: &Frame, place: Place) -> Option<Doubt> {
        let state = &mut self.states[row.run as usize - 1];
        let known = match *state {
            State::Done(known) => Some((Kind::Done, known)),
            State::Failed(known) => Some((Kind::Failed, known)),
            _ => None,
        };
        *state = match (*state, frame.kind) {
            (State::Missing, Kind::Done) => State::Done(place),
            (State::Missing, Kind::Failed) => State::Failed(place),
            (state, _) => state,
        };
        Some(Doubt { run: row.run, known: known?, new: (frame.kind, place) })
    }

    /// Compares a doubtful result with the known one.
    fn settle(
        &mut self,
        plan: &Plan,
        kept: &[KeptEvents],
        Doubt { run, known, new }: Doubt,
    ) -> io::Result<()> {
        let row = &plan.rows[run as usize - 1];
        let stray = |results: &mut Results, place: Place, problem: String| {
            let spot = results.spot(place);
            // Without another result the run is missing again.
            let state = &mut results.states[run as usize - 1];
            if matches!(*state, State::Done(known) | State::Failed(known) if known == place) {
                *state = State::Missing;
            }
            results.add(Fault::Stray { spot, run, problem });
        };
        let opened = |results: &Results, (_, place): (Kind, Place)| {
            let content = results.content(place)?;
            Ok::<_, io::Error>(Stored::open(content, &plan.common, row, kept))
        };
        if known.0 == new.0 && self.are_same_bytes(known.1, new.1)? {
            self.confirm(run, known.1, new.1);
            return Ok(());
        }
        let difference = match (known.0, new.0) {
            (Kind::Done, Kind::Done) => match (opened(self, known)?, opened(self, new)?) {
                (Ok(a), Ok(b)) => a.difference(b),
                (a, b) => Err([a.err(), b.err()]),
            },
            (Kind::Failed, Kind::Failed) => {
                match (reason(self.content(known.1)?), reason(self.content(new.1)?)) {
                    (Ok(a), Ok(b)) => {
                        Ok((a != b).then(|| format!("it failed because of {a:?} and of {b:?}")))
                    }
                    (a, b) => Err([a.err(), b.err()]),
                }
            }
            _ => Ok(Some("it is done, and it failed".to_owned())),
        };
        match difference {
            Ok(None) => self.confirm(run, known.1, new.1),
            Ok(Some(difference)) => {
                let [first, second] = [known, new].map(|(_, place)| self.spot(place));
                self.states[run as usize - 1] = State::Contradicted;
                self.add(Fault::Differ { run, first, second, difference });
            }
            Err(problems) => {
                for (problem, (_, place)) in problems.into_iter().zip([known, new]) {
                    if let Some(problem) = problem {
                        stray(self, place, problem);
                    }
                }
            }
        }
        Ok(())
    }

    /// Records that two results of a run are equal. In one segment they are of one process.
    fn confirm(&mut self, run: u64, known: Place, new: Place) {
        if known.segment != new.segment {
            let is_of_other_node = self.node(known.segment) != self.node(new.segment);
            let second = self.again.entry(run).or_insert(new.segment);
            if is_of_other_node {
                *second = new.segment;
            }
        }
    }

    fn node(&self, segment: u32) -> String {
        segment::node_of(&self.segments[segment as usize])
    }

    /// The nodes that made results.
    pub fn nodes(&self) -> BTreeSet<String> {
        self.segments.iter().map(|path| segment::node_of(path)).collect()
    }

    /// The node that made the first result of a run, and the one that made an equal second result: another
    /// node, if there is such a result.
    pub fn made_on(&self, run: u64) -> (Option<String>, Option<String>) {
        let first = match self.state(run) {
            State::Done(place) | State::Failed(place) => Some(self.node(place.segment)),
            _ => None,
        };
        (first, self.again.get(&run).map(|segment| self.node(*segment)))
    }

    fn add(&mut self, fault: Fault) {
        if self.faults.len() < MOST_FAULTS && !self.faults.contains(&fault) {
            self.faults.push(fault);
        }
    }

    fn are_same_bytes(&self, a: Place, b: Place) -> io::Result<bool> {
        if a.length != b.length {
            return Ok(false);
        }
        let [mut a, mut b] = [self.content(a)?, self.content(b)?];
        loop {
            fill(&mut a)?;
            fill(&mut b)?;
            let (x, y) = (a.fill_buf()?, b.fill_buf()?);
            let count = x.len().min(y.len());
            if count == 0 || x[..count] != y[..count] {
                return Ok(x.is_empty() && y.is_empty());
            }
            a.consume(count);
            b.consume(count);
        }
    }

    /// The state of a run, counted from 1.
    pub fn state(&self, run: u64) -> State {
        self.states[run as usize - 1]
    }

    /// Whether a run of the plan must still be made.
    pub fn is_missing(&self, run: u64) -> bool {
        let index = run.checked_sub(1).and_then(|index| usize::try_from(index).ok());
        index.and_then(|index| self.states.get(index)).is_some_and(|state| state.is_missing())
    }

    /// Counts all runs by state.
    pub fn counts(&self) -> Counts {
        self.counts_of(|_| true)
    }

    /// Counts some of the runs by state.
    pub fn counts_of(&self, is_counted: impl Fn(&u64) -> bool) -> Counts {
        let mut counts = Counts::default();
        for (_, state) in (1..).zip(&self.states).filter(|(run, _)| is_counted(run)) {
            *match state {
                State::Missing => &mut counts.missing,
                State::Done(_) | State::Logged => &mut counts.done,
                State::Failed(_) => &mut counts.failed,
                State::Refused => &mut counts.refused,
                State::Contradicted => &mut counts.contradicted,
            } += 1;
        }
        counts
    }

    /// The runs to be made, in order.
    pub fn missing(&self) -> impl Iterator<Item = u64> {
        (1..).zip(&self.states).filter(|(_, state)| state.is_missing()).map(|(run, _)| run)
    }

    /// Opens the content of a result.
    ///
    /// # Errors
    /// If its segment cannot be read.
    pub(crate) fn content(&self, place: Place) -> io::Result<impl BufRead + use<>> {
        segment::content(&self.segments[place.segment as usize], place.at, place.length)
    }

    /// The position of a result in readable form.
    pub(crate) fn spot(&self, place: Place) -> Spot {
        Spot { path: self.segments[place.segment as usize].clone(), at: place.at }
    }
}

/// A result to be compared with the known one of its run.
struct Doubt {
    run: u64,
    known: (Kind, Place),
    new: (Kind, Place),
}

/// Whether there is a log of a run: a log has its final name only if it is complete.
fn is_logged(log: &Path, row: &Row) -> bool {
    RunReader::open(log, Topics::NONE).is_ok_and(|log| row.id.as_ref() == Some(&log.header().run_id))
}

/// The run of a result, if its owner line agrees.
fn of_run<'a>(plan: &'a Plan, frame: &Frame) -> Result<&'a Row, String> {
    let index = frame.run.checked_sub(1).and_then(|index| usize::try_from(index).ok());
    let row = index.and_then(|index| plan.rows.get(index));
    let row = row.ok_or_else(|| format!("the plan has no such run (accepted: 1 to {})", plan.rows.len()))?;
    if row.refused.is_some() {
        return Err("its scenario refuses its values (accepted: results of the other runs)".to_owned());
    }
    if frame.kind == Kind::Done && plan.named(frame.run).is_some() {
        return Err("the result of a run with a name is its log (accepted: results of other runs)".to_owned());
    }
    match &frame.owner {
        Err(problem) => Err(format!("{problem} (accepted: number and id of its run)")),
        Ok(Owner { run, .. }) if *run != row.run => Err(format!(
            "its content says that it is of run {run} (accepted: {}, under which it stands)",
            row.run
        )),
        Ok(Owner { run_id, .. }) if row.id.as_ref() != Some(run_id) => Err(format!(
            "its content says that its run has the id {run_id:?} (accepted: {}, as it is planned)",
            row.id.as_deref().unwrap_or_default()
        )),
        _ => Ok(row),
    }
}

/// Formats runs as batch systems do: `3,7-9`.
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

/// Parses runs such as `3,7-9`.
///
/// # Errors
/// A message, if there are none.
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
