//! The results of a plan's runs so far, read from all segments in one pass.
//!
//! A run has one result, wherever and however often it is made; the result of a named run is its log. Two
//! different results of a run, or a result that is not of the run that it is stored for, indicate a node that
//! computes or stores wrongly: these are [`Fault`]s, and prevent tables.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use asperity_numbers::{RunOutcome, RunResult};
use asperity_record::counted;
use asperity_runlog::{RunReader, Topics};

use crate::error::StudyError;
use crate::file::Keep;
use crate::plan::{Plan, Row};
use crate::segment::{self, Frame};

/// Most faults that are stored: enough to identify the files.
const MOST_FAULTS: usize = 100;

/// The remedy for a [`Fault`].
const WHAT_TO_DO: &str = "a run gives the same result wherever it is made: remove the file of the \
                          faulty node (its name begins with the name of the node), or all of these \
                          files, and `asperity sweep run` repeats their runs";

/// The position of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    segment: u32,
    frame: Frame,
}

/// A result that is not of its run, or two results of a run that differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// The run.
    pub run: u64,
    /// The segments with the results, and the offsets of these.
    pub spots: Vec<(PathBuf, u64)>,
    /// The problem, and what is accepted; or the first number that differs.
    pub problem: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Fault { run, spots, problem } = self;
        let spots: Vec<String> =
            spots.iter().map(|(path, at)| format!("{}: byte {at}", path.display())).collect();
        match &spots[..] {
            [spot] => write!(f, "{spot}: run {run}: {problem}"),
            spots => {
                write!(f, "run {run} has two results that differ: {problem}, in {}", spots.join(" and "))
            }
        }
    }
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

    fn place(self) -> Option<Place> {
        match self {
            State::Done(place) | State::Failed(place) => Some(place),
            _ => None,
        }
    }
}

/// The results of a plan's runs.
#[derive(Debug)]
pub struct Results {
    states: Vec<State>,
    segments: Vec<PathBuf>,
    /// The segment of a second result of a run, equal to the first; of another node, if there is one.
    again: BTreeMap<u64, u32>,
    /// Segments that end in an incomplete or changed frame, and its bytes.
    pub torn: Vec<(PathBuf, u64)>,
    /// Files that are not segments of this plan.
    pub foreign: Vec<PathBuf>,
    /// Results that differ.
    pub faults: Vec<Fault>,
}

impl Results {
    /// Reads all segments in the folder of a plan, and looks for the logs of runs that have names.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn read(folder: &Path, plan: &Plan) -> Result<Results, StudyError> {
        Results::scan(folder, plan).map_err(StudyError::at(folder))
    }

    fn scan(folder: &Path, plan: &Plan) -> io::Result<Results> {
        let state = |row: &Row| if row.refused.is_some() { State::Refused } else { State::Missing };
        let mut states: Vec<State> = plan.rows.iter().map(state).collect();
        let (mut segments, mut torn, mut foreign) = (Vec::new(), Vec::new(), Vec::new());
        let mut further = Vec::new();
        for path in segment::all(folder)? {
            let number = segments.len() as u32;
            let take = |frame @ Frame { is_done, run, .. }: Frame| {
                let place = Place { segment: number, frame };
                let Some(state) = place_of(run).and_then(|index| states.get_mut(index)) else { return false };
                match state.place() {
                    Some(first) => further.push((run, first, place)),
                    // The result of a run with a name is its log.
                    None if *state == State::Refused || is_done && run > plan.numbered() => return false,
                    None if is_done => *state = State::Done(place),
                    None => *state = State::Failed(place),
                }
                true
            };
            let scanned = segment::scan(&path, &plan.hash, take).map_err(|error| {
                let name = path.strip_prefix(folder).unwrap_or(&path).display();
                io::Error::new(error.kind(), format!("{name}: {error}"))
            })?;
            match scanned {
                None => foreign.push(path),
                Some(left) => {
                    torn.extend((left > 0).then(|| (path.clone(), left)));
                    segments.push(path);
                }
            }
        }
        let (again, faults) = (BTreeMap::new(), Vec::new());
        let mut results = Results { states, segments, again, torn, foreign, faults };
        for (run, first, second) in further {
            results.compare(plan, run, first, second)?;
        }
        for row in &plan.rows[plan.numbered() as usize..] {
            if plan.named(row.run).is_some_and(|named| is_logged(&named.log(folder), row)) {
                results.states[row.run as usize - 1] = State::Logged;
            }
        }
        Ok(results)
    }

    /// Compares a further result of a run with the first one.
    fn compare(&mut self, plan: &Plan, run: u64, first: Place, second: Place) -> io::Result<()> {
        let difference = if self.content(first)? == self.content(second)? {
            None
        } else {
            match (self.result(plan, run, first)?, self.result(plan, run, second)?) {
                (Ok(one), Ok(other)) => one.difference(&other),
                (one, other) => one.err().or(other.err()),
            }
        };
        if let Some(problem) = difference {
            self.states[run as usize - 1] = State::Contradicted;
            let fault = Fault { run, spots: [first, second].map(|place| self.spot(place)).into(), problem };
            if self.faults.len() < MOST_FAULTS {
                self.faults.push(fault);
            }
        } else if first.segment != second.segment {
            // In one segment they are of one process.
            let is_of_other_node = self.node(first.segment) != self.node(second.segment);
            let known = self.again.entry(run).or_insert(second.segment);
            if is_of_other_node {
                *known = second.segment;
            }
        }
        Ok(())
    }

    fn content(&self, Place { segment, frame }: Place) -> io::Result<Vec<u8>> {
        segment::content(&self.segments[segment as usize], frame)
    }

    fn spot(&self, place: Place) -> (PathBuf, u64) {
        (self.segments[place.segment as usize].clone(), place.frame.at)
    }

    /// The result at a place, or why it is not of this run.
    fn result(&self, plan: &Plan, run: u64, place: Place) -> io::Result<Result<RunResult, String>> {
        let (row, kept) = (&plan.rows[run as usize - 1], &plan.common.keep);
        let result = match segment::unpacked(&self.content(place)?) {
            Ok(result) => result,
            Err(error) => return Ok(Err(error.to_string())),
        };
        let lacks_events = |RunOutcome { summary, slips, ruptures }: &RunOutcome| {
            let slips = slips.iter().map(|slip| slip.event);
            let ruptures = ruptures.iter().map(|rupture| rupture.rupture);
            (kept.contains(&Keep::Events) && !slips.eq(0..summary.event_count))
                || (kept.contains(&Keep::Ruptures) && !ruptures.eq(0..summary.rupture_count.unwrap_or(0)))
        };
        Ok(if result.run != run || Some(&result.id) != row.id.as_ref() {
            let planned = row.id.as_deref().unwrap_or_default();
            Err(format!(
                "it is of run {} of id {} (accepted: run {run} of id {planned}, under which it stands)",
                result.run, result.id
            ))
        } else if place.frame.is_done != result.outcome.is_ok() {
            Err("its frame and its content disagree whether it is done (accepted: the same of both)"
                .to_owned())
        } else if result.outcome.as_ref().is_ok_and(lacks_events) {
            Err("its events are not those that its summary counts (accepted: all, in their order)".to_owned())
        } else {
            Ok(result)
        })
    }

    /// What a run gave, or why it failed; none of a run without a result in a segment.
    ///
    /// # Errors
    /// If it cannot be read, or is not of this run.
    pub fn outcome(&self, plan: &Plan, run: u64) -> Result<Option<Result<RunOutcome, String>>, StudyError> {
        let Some(place) = self.state(run).place() else { return Ok(None) };
        let fault = |problem: String| Fault { run, spots: vec![self.spot(place)], problem };
        match self.result(plan, run, place) {
            Ok(Ok(result)) => Ok(Some(result.outcome)),
            Ok(Err(problem)) => Err(faulty(&[fault(problem)])),
            Err(error) => Err(StudyError::failed(fault(error.to_string()))),
        }
    }

    /// Refuses to go on with results that differ.
    ///
    /// # Errors
    /// If there are such.
    pub fn check(&self) -> Result<(), StudyError> {
        if self.faults.is_empty() { Ok(()) } else { Err(faulty(&self.faults)) }
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
        let first = self.state(run).place().map(|place| self.node(place.segment));
        (first, self.again.get(&run).map(|segment| self.node(*segment)))
    }

    /// The state of a run, counted from 1.
    pub fn state(&self, run: u64) -> State {
        self.states[run as usize - 1]
    }

    /// Whether a run of the plan must still be made.
    pub fn is_missing(&self, run: u64) -> bool {
        place_of(run).and_then(|index| self.states.get(index)) == Some(&State::Missing)
    }

    /// The number of runs in each state, in words.
    pub fn in_words(&self) -> String {
        let count = |word| self.runs(word).count();
        let others = ["failed", "refused", "contradicted", "missing"].map(|word| (word, count(word)));
        let others = others.iter().filter(|(_, count)| *count > 0);
        let others: String = others.map(|(word, count)| format!(", {count} {word}")).collect();
        format!("{} of {} done{others}", count("done"), counted(self.states.len() as u64, "run"))
    }

    /// The runs in a state, by its [word](State::word), in order.
    pub fn runs(&self, word: &str) -> impl Iterator<Item = u64> {
        (1..).zip(&self.states).filter(move |(_, state)| state.word() == word).map(|(run, _)| run)
    }

    /// The runs to be made, in order.
    pub fn missing(&self) -> impl Iterator<Item = u64> {
        self.runs("missing")
    }
}

/// The place of a run in the plan, if its number can be one.
fn place_of(run: u64) -> Option<usize> {
    usize::try_from(run.checked_sub(1)?).ok()
}

/// Says a line for each fault, and the remedy.
fn faulty(faults: &[Fault]) -> StudyError {
    let lines: String = faults.iter().map(|fault| format!("{fault}\n")).collect();
    StudyError::Failed(lines + WHAT_TO_DO)
}

/// Whether there is a log of a run: a log has its final name only if it is complete.
fn is_logged(log: &Path, row: &Row) -> bool {
    RunReader::open(log, Topics::NONE).is_ok_and(|log| row.id.as_ref() == Some(&log.header().run_id))
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
