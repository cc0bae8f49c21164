//! A study as the commands of `asperity sweep` find it, and what they say of its state.

use std::io;
use std::path::Path;

use asperity_sweep::results::{Counts, WHAT_TO_DO};
use asperity_sweep::{Plan, Results};

use crate::exit::{Code, Failure};

/// The plan of a folder, and the results that there are.
pub(crate) fn read(folder: &Path) -> Result<(Plan, Results), Failure> {
    let plan = Plan::read(folder).map_err(Failure::bad_input)?;
    let results = Results::read(folder, &plan).map_err(|error| unreadable(folder, &error))?;
    Ok((plan, results))
}

/// The same for tables and figures, which show the values of the runs: these must be what the runs were
/// made with.
pub(crate) fn read_for_tables(folder: &Path) -> Result<(Plan, Results), Failure> {
    let (plan, results) = read(folder)?;
    plan.check_ids(folder).map_err(Failure::bad_input)?;
    Ok((plan, results))
}

/// What it means that a file in the folder cannot be read.
pub(crate) fn unreadable(folder: &Path, error: &io::Error) -> Failure {
    Failure::Failed(format!("{}: {error}", folder.display()))
}

/// What contradicts the plan or itself among the results, a line each, and what to do about it.
pub(crate) fn faults(results: &Results) -> impl Iterator<Item = String> {
    let advice = (!results.faults.is_empty()).then(|| WHAT_TO_DO.to_owned());
    results.faults.iter().map(ToString::to_string).chain(advice)
}

/// The exit code of a study with these results, of which some runs are asked for.
pub(crate) fn outcome_of(results: &Results, counts: Counts) -> Result<(), Failure> {
    if results.faults.is_empty() { outcome(counts) } else { Code::Failed.said() }
}

/// The exit code of a study in that state.
pub(crate) fn outcome(counts: Counts) -> Result<(), Failure> {
    let code = if counts.missing > 0 {
        Code::Incomplete
    } else if counts.failed + counts.quarantined > 0 {
        Code::Failed
    } else {
        Code::Success
    };
    code.said()
}

/// A number of runs, in words.
pub(crate) fn runs(count: u64) -> String {
    if count == 1 { "1 run".to_owned() } else { format!("{count} runs") }
}

/// How many of its runs are in which state.
pub(crate) fn in_words(plan: &Plan, counts: Counts) -> String {
    let Counts { done, failed, quarantined, refused, contradicted, missing } = counts;
    let mut words = format!("{} of {} done", done, runs(plan.rows.len() as u64));
    let others = [
        (failed, "failed"),
        (quarantined, "quarantined"),
        (refused, "refused"),
        (contradicted, "contradicted"),
        (missing, "missing"),
    ];
    for (count, word) in others {
        if count > 0 {
            words.push_str(&format!(", {count} {word}"));
        }
    }
    words
}
