//! What a set of tables and figures was made of, beside it: where this stands, the others do.

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
    /// Paths from the folder that this stands in.
    files: Vec<String>,
    /// What stands on the page among them.
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

/// Where the record of a command stands.
pub(crate) fn path(folder: &Path, command: &str) -> PathBuf {
    folder.join(format!("{command}.json"))
}
