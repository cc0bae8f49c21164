//! Comparing the outputs of two revisions of the command, of which one may write logs that the other refuses. The test and
//! `cargo xtask diff-events` share it.

use std::ffi::OsStr;
use std::io;
use std::path::Path;
use std::process::Command;

/// The folder of each output with a table of events for each run, written by the command that made it.
pub(crate) const TABLES: &str = "events";

/// Compares two outputs by `asperity diff`; where it cannot read a log to its end, the event tables beside the logs, paired
/// by name. Returns its exit code.
pub(crate) fn compare(asperity: &Path, outs: [&Path; 2], more: &[&OsStr]) -> io::Result<Option<i32>> {
    let diff = |sides: [&Path; 2]| Command::new(asperity).arg("diff").args(sides).args(more).status();
    match diff(outs)?.code() {
        code @ Some(0 | 1) => Ok(code),
        _ => {
            let tables = outs.map(|out| out.join(TABLES));
            Ok(diff([&tables[0], &tables[1]])?.code())
        }
    }
}
