//! The record of a set of tables and figures: their sources and files. It is written last, so if it exists,
//! so do the others.

use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_record::RunHeader;
use asperity_report::Contents;
use serde::Serialize;

use crate::error::StudyError;

/// The layout of [`Record`].
const VERSION: u32 = 1;

#[derive(Serialize)]
struct Record<'a> {
    format: &'a str,
    version: u32,
    runs: Vec<Run<'a>>,
    /// Paths relative to the folder of this file.
    files: Vec<String>,
    /// Those shown on the page.
    #[serde(skip_serializing_if = "Option::is_none")]
    page: Option<&'a Contents>,
}

#[derive(Serialize)]
struct Run<'a> {
    name: &'a str,
    run: &'a RunHeader,
}

/// Writes `COMMAND.json` into a folder, as the record of a set of files that are there or below.
///
/// # Errors
/// If it cannot be written.
pub fn write<'a, P: AsRef<Path>>(
    files: &FileSet,
    folder: &Path,
    command: &str,
    runs: impl IntoIterator<Item = (&'a str, &'a RunHeader)>,
    written: impl IntoIterator<Item = P>,
    page: Option<&Contents>,
) -> Result<(), StudyError> {
    let from_folder = |path: P| {
        let path = path.as_ref();
        path.strip_prefix(folder).unwrap_or(path).display().to_string()
    };
    let record = Record {
        format: &format!("asperity-{command}"),
        version: VERSION,
        runs: runs.into_iter().map(|(name, run)| Run { name, run }).collect(),
        files: written.into_iter().map(from_folder).collect(),
        page,
    };
    let text = serde_json::to_string_pretty(&record).expect("texts and finite numbers can always be JSON");
    Ok(files.write_record(&path(folder, command), text + "\n")?)
}

/// The path of the record of a command.
pub(crate) fn path(folder: &Path, command: &str) -> PathBuf {
    folder.join(format!("{command}.json"))
}
