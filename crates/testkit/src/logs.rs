//! Logs read to their end.

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

/// How the run of a whole log ended.
///
/// # Panics
/// If the log is not whole.
pub fn run_end(path: &Path) -> RunEnd {
    RunReader::open(path, Topics::ALL)
        .and_then(|mut reader| reader.verify())
        .unwrap_or_else(|error| panic!("{error}"))
}
