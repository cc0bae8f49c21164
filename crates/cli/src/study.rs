//! Reads a study for the commands of `asperity sweep`, and formats its state.

use std::io;
use std::path::Path;

use asperity_record::counted;
use asperity_study::plan::FILE;
use asperity_study::results::{Counts, WHAT_TO_DO};
use asperity_study::{Plan, Results};

use crate::exit::{Code, Failure};
use crate::given::{self, Taken};

/// Reads the plan in a folder.
pub(crate) fn read_plan(folder: &Path) -> Result<Plan, Failure> {
    Plan::read(folder).map_err(|error| match given::check(folder, Taken::Study) {
        Err(other) if !folder.join(FILE).exists() => other,
        _ => Failure::bad_input(error),
    })
}

/// Reads the plan and the results in a folder.
pub(crate) fn read(folder: &Path) -> Result<(Plan, Results), Failure> {
    let plan = read_plan(folder)?;
    let results = Results::read(folder, &plan).map_err(|error| unreadable(folder, &error))?;
    Ok((plan, results))
}

/// Reads a study for tables and figures, after checking that the values in its plan are those of
/// the runs.
pub(crate) fn read_for_tables(folder: &Path) -> Result<(Plan, Results), Failure> {
    let (plan, results) = read(folder)?;
    plan.check_ids(folder).map_err(Failure::bad_input)?;
    Ok((plan, results))
}

/// The failure for an unreadable file in the folder.
pub(crate) fn unreadable(folder: &Path, error: &io::Error) -> Failure {
    Failure::Failed(format!("{}: {error}", folder.display()))
}

/// Formats the contradictions among the results or with the plan, a line each, with the remedy.
pub(crate) fn faults(results: &Results) -> impl Iterator<Item = String> {
    let advice = (!results.faults.is_empty()).then(|| WHAT_TO_DO.to_owned());
    results.faults.iter().map(ToString::to_string).chain(advice)
}

/// The exit code of a study with these results, counting the requested runs.
pub(crate) fn outcome_of(results: &Results, counts: Counts) -> Result<(), Failure> {
    if results.faults.is_empty() { outcome(counts) } else { Code::Failed.said() }
}

/// The exit code of a study in that state.
pub(crate) fn outcome(counts: Counts) -> Result<(), Failure> {
    let code = if counts.missing > 0 {
        Code::Incomplete
    } else if counts.failed > 0 {
        Code::Failed
    } else {
        Code::Success
    };
    code.said()
}

/// Formats a number of runs.
pub(crate) fn runs(count: u64) -> String {
    counted(count, "run")
}

/// Most names of runs in a line.
const MOST_NAMED: usize = 5;

/// Lists names; for a long list, the first ones and the number of the others.
pub(crate) fn some_of(names: &[&str]) -> String {
    match names.len().saturating_sub(MOST_NAMED) {
        0 => names.join(", "),
        more => format!("{} and {more} more", names[..MOST_NAMED].join(", ")),
    }
}

/// Formats the number of runs in each state.
pub(crate) fn in_words(plan: &Plan, counts: Counts) -> String {
    let Counts { done, failed, refused, contradicted, missing } = counts;
    let mut words = format!("{} of {} done", done, runs(plan.rows.len() as u64));
    let others =
        [(failed, "failed"), (refused, "refused"), (contradicted, "contradicted"), (missing, "missing")];
    for (count, word) in others {
        if count > 0 {
            words.push_str(&format!(", {count} {word}"));
        }
    }
    words
}
