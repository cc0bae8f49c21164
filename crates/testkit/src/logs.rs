//! Logs read to their end: here, because tests that call the command are compiled without optimisation.

use std::path::Path;

use asperity_record::RunEnd;
use asperity_runlog::{LogError, LogItem, RunReader, Topics};

/// All contents of a complete log, and how its run ended.
///
/// # Errors
/// If it is not whole.
pub fn read_log(path: &Path) -> Result<(Vec<LogItem>, RunEnd), LogError> {
    let mut reader = RunReader::open(path, Topics::ALL)?;
    let mut items = Vec::new();
    while let Some(item) = reader.next_item()? {
        items.push(item);
    }
    Ok((items, reader.verify()?))
}

/// All contents of a log up to its end or the first problem, and that problem.
#[must_use]
pub fn read_until_problem(path: &Path) -> (Vec<LogItem>, Option<LogError>) {
    let mut items = Vec::new();
    let mut read = || -> Result<(), LogError> {
        let mut reader = RunReader::open(path, Topics::ALL)?;
        while let Some(item) = reader.next_item()? {
            items.push(item);
        }
        Ok(())
    };
    let problem = read().err();
    (items, problem)
}

/// The place of the first item of some that are not, in this order, among all.
#[must_use]
pub fn first_stray(items: &[LogItem], all: &[LogItem]) -> Option<usize> {
    let mut all = all.iter();
    items.iter().position(|item| !all.any(|other| other == item))
}

/// How the run of a whole log ended.
///
/// # Panics
/// If the log is not whole.
pub fn run_end(path: &Path) -> RunEnd {
    RunReader::open(path, Topics::ALL)
        .and_then(|mut reader| reader.verify())
        .unwrap_or_else(|error| panic!("{error}"))
}
