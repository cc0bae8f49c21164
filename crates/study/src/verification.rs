//! Makes some runs of a study a second time, on another node if possible: a node that computes wrongly gives
//! results that differ from those of another one.
//!
//! The plan alone decides which runs these are, so that every call on every node chooses the same ones.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use asperity_record::counted;

use crate::plan::{Plan, Row};
use crate::results::{Results, State};
use crate::segment::node_of;

/// Most pairs of nodes that are named.
const MOST_PAIRS: usize = 20;

/// How many runs over axes to verify.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sample {
    /// This many, at least 1.
    Count(u64),
    /// This share in percent, above 0 and up to 100; rounded up to whole runs.
    Percent(f64),
}

impl FromStr for Sample {
    type Err = String;

    fn from_str(text: &str) -> Result<Sample, String> {
        let sample = match text.strip_suffix('%') {
            Some(percent) => percent.parse().ok().filter(|p| 0.0 < *p && *p <= 100.0).map(Sample::Percent),
            None => text.parse().ok().filter(|count| *count > 0).map(Sample::Count),
        };
        sample.ok_or_else(|| {
            "accepted: a number of runs, from 1; or a share of them, above 0% and up to 100%, as in 5%"
                .to_owned()
        })
    }
}

impl fmt::Display for Sample {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Sample::Count(count) => write!(f, "{count}"),
            Sample::Percent(percent) => write!(f, "{percent}%"),
        }
    }
}

impl Sample {
    /// The runs of a plan that are verified. A larger sample contains all smaller ones.
    ///
    /// # Errors
    /// A message with the accepted numbers, if the plan has fewer runs over axes.
    pub fn of(self, plan: &Plan) -> Result<BTreeSet<u64>, String> {
        let numbered = plan.rows[..plan.numbered() as usize].iter();
        let mut rows: Vec<&Row> = numbered.filter(|row| row.refused.is_none()).collect();
        let most = rows.len() as u64;
        let count = match self {
            Sample::Count(count) => count,
            Sample::Percent(percent) => (percent * most as f64 / 100.0).ceil() as u64,
        };
        if most == 0 {
            return Err(format!("{self}: no run over axes is made (accepted: a study with such runs)"));
        }
        if count > most {
            return Err(format!("{self} (accepted: 1 to {most}, the runs over axes)"));
        }
        // Ids are hashes: the sample does not follow any axis, nor the division into parts.
        rows.sort_by_key(|row| (&row.id, row.run));
        Ok(rows[..count as usize].iter().map(|row| row.run).collect())
    }
}

/// The number in whose part a run is verified if all runs are divided into this many parts: half of them
/// away from its own, since tasks of near numbers are often on one node.
pub fn number_in_parts(run: u64, parts: u64) -> u64 {
    run + parts - parts / 2
}

/// Numbers of runs by the two nodes that made them.
type Pairs = BTreeMap<[String; 2], u64>;

/// The progress of verifying some runs.
#[derive(Debug, Default)]
pub struct Verification {
    chosen: u64,
    verified: Pairs,
    contradicted: u64,
    /// By the two nodes, as far as faults are [listed](Results::faults).
    differ: Pairs,
    /// Runs with a result, to be made a second time, in order.
    pub due: Vec<u64>,
    /// Runs whose only result is of this node, and which another one must make: the node, and their number.
    elsewhere: Option<(String, u64)>,
    /// Runs without a first result, which may still come, in order.
    pub missing: Vec<u64>,
}

impl Verification {
    /// Compares the results of these runs so far. `here` is the name of this node, if it may make some.
    ///
    /// A run is verified by two equal results: of two nodes if several took part in the study, or else of two
    /// processes.
    pub fn of(chosen: &BTreeSet<u64>, results: &Results, here: Option<&str>) -> Verification {
        let mut nodes = results.nodes();
        nodes.extend(here.map(str::to_owned));
        let are_several = nodes.len() > 1;
        let mut all = Verification { chosen: chosen.len() as u64, ..Verification::default() };
        let count = |pairs: &mut Pairs, mut nodes: [String; 2]| {
            nodes.sort();
            *pairs.entry(nodes).or_default() += 1;
        };
        for &run in chosen {
            match (results.state(run), results.made_on(run)) {
                (_, (Some(first), Some(second))) if first != second || !are_several => {
                    count(&mut all.verified, [first, second]);
                }
                (_, (Some(first), _)) if are_several && here == Some(&first) => {
                    all.elsewhere.get_or_insert((first, 0)).1 += 1;
                }
                (_, (Some(_), _)) => all.due.push(run),
                (State::Missing, _) => all.missing.push(run),
                (State::Contradicted, _) => all.contradicted += 1,
                // Not chosen, or made without a segment.
                (State::Done(_) | State::Failed(_) | State::Logged | State::Refused, _) => {}
            }
        }
        for fault in &results.faults {
            if let [first, second] = &fault.spots[..]
                && chosen.contains(&fault.run)
            {
                count(&mut all.differ, [first, second].map(|(path, _)| node_of(path)));
            }
        }
        all
    }

    /// Whether runs still lack a second result.
    pub fn is_incomplete(&self) -> bool {
        !self.missing.is_empty() || !self.due.is_empty() || self.elsewhere.is_some()
    }

    /// Says on which nodes how many runs were verified, and how many were not: a line for each case.
    pub fn lines(&self) -> Vec<String> {
        let verified: u64 = self.verified.values().sum();
        let of = counted(self.chosen, "chosen run");
        let mut lines = vec![format!("{verified} of {of} verified{}", on(&self.verified))];
        let (node, elsewhere) = self.elsewhere.clone().unwrap_or_default();
        let others = [
            (self.contradicted, format!("contradicted{}", on(&self.differ))),
            (self.due.len() as u64, "to be made a second time".to_owned()),
            (elsewhere, format!("to be made a second time on another node than {node}")),
            (self.missing.len() as u64, "without a first result".to_owned()),
        ];
        let others = others.into_iter().filter(|(count, _)| *count > 0);
        lines.extend(others.map(|(count, what)| format!("{count} {what}")));
        lines
    }
}

/// Formats on which nodes runs were made, most frequent pairs first.
fn on(pairs: &Pairs) -> String {
    let mut pairs: Vec<(&[String; 2], &u64)> = pairs.iter().collect();
    pairs.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    let named = pairs.iter().take(MOST_PAIRS).map(|([first, second], count)| match first == second {
        true => format!("{count} on {first} alone"),
        false => format!("{count} on {first} and {second}"),
    });
    let others = pairs.len().saturating_sub(MOST_PAIRS) as u64;
    let others = (others > 0).then(|| format!("others on {}", counted(others, "more pair")));
    let words = named.chain(others).collect::<Vec<_>>().join(", ");
    if words.is_empty() { words } else { format!(": {words}") }
}
