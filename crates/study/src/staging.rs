//! Logs of runs in progress: unfinished logs of long runs, from which a killed run resumes, and logs to be
//! kept, until they are complete.
//!
//! They only save time. Without them, a run is made from its beginning.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileError, LockedFile, create_folder};
use asperity_runlog::{Unfinished, WriteError, partial_path};

use crate::segment::entries;

/// The folder of logs in progress, within that of the plan.
pub const FOLDER: &str = "staging";

/// The folder of logs that are kept, within that of the plan.
pub const LOGS: &str = "logs";

/// The path of a run's log in progress, in the folder of a plan.
pub fn log(folder: &Path, run: u64) -> PathBuf {
    folder.join(FOLDER).join(format!("{run}.mcap"))
}

/// Moves the whole log of a run to the kept ones, replacing an existing one.
///
/// # Errors
/// If the system refuses.
pub(crate) fn keep(folder: &Path, run: u64) -> Result<(), FileError> {
    create_folder(&folder.join(LOGS))?;
    let path = log(folder, run);
    let kept = folder.join(LOGS).join(path.file_name().unwrap_or_default());
    match LockedFile::open(&path)? {
        Some(mut locked) => locked.rename(&kept, Existing::Replace),
        // Another process made the run in the meantime, and cleared this log.
        None if kept.exists() => Ok(()),
        None => Err(FileError::Lost(path)),
    }
}

/// Removes the whole log of a run that was not kept.
///
/// # Errors
/// If the system refuses.
pub(crate) fn discard(folder: &Path, run: u64) -> Result<(), FileError> {
    LockedFile::open(&log(folder, run))?.map_or(Ok(()), |locked| locked.remove())
}

/// Whether there is an unfinished log of a run.
pub fn is_begun(folder: &Path, run: u64) -> bool {
    partial_path(&log(folder, run)).exists()
}

/// Removes the log of a run, unfinished or whole, whose result is on disk. Leaves a log that
/// another process has locked; that process clears it.
///
/// # Errors
/// If the system refuses, or it is not a run log.
pub fn clear(folder: &Path, run: u64) -> Result<(), WriteError> {
    let unfinished =
        Unfinished::of(&log(folder, run)).and_then(|left| left.map_or(Ok(()), Unfinished::remove));
    for cleared in [unfinished, discard(folder, run).map_err(WriteError::from)] {
        match cleared {
            Err(WriteError::Busy(_) | WriteError::File(FileError::Lost(_))) => {}
            cleared => cleared?,
        }
    }
    Ok(())
}

/// The runs that have a log in progress, unfinished or whole, in order, with its bytes.
///
/// # Errors
/// If the folder cannot be read.
pub fn begun(folder: &Path) -> io::Result<BTreeMap<u64, u64>> {
    let mut begun = BTreeMap::new();
    for entry in entries(&folder.join(FOLDER))? {
        let name = entry.file_name();
        let run = name.to_str().and_then(|name| name.split_once(".mcap")?.0.parse().ok());
        let Some(run) = run else { continue };
        match entry.metadata() {
            Ok(file) => *begun.entry(run).or_default() += file.len(),
            // Its run has finished in the meantime.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
    Ok(begun)
}
