//! Reads a log once for a command, whose failure names the log and its verdict.

use std::path::Path;

use asperity_record::Observer;
use asperity_run::{Checked, OpenLog, Unread, read_once};

use crate::exit::Failure;
use crate::verdict_exit::{self, unreadable};

pub(crate) use asperity_run::Reading;

/// Reads a log as [`read_once`] does.
///
/// # Errors
/// If it is not a run log, is not accepted, or cannot be observed.
pub(crate) fn once<O: Observer>(
    run: &Path,
    skims: &'static [&'static str],
    begin: impl FnOnce(&OpenLog) -> Result<O, String>,
    accept: impl FnOnce(&Checked) -> Result<(), Failure>,
) -> Result<Reading<O>, Failure> {
    read_once(run, skims, begin, accept).map_err(|unread| match unread {
        Unread::NoRunLog(checked) => verdict_exit::failure(run, &checked),
        Unread::Refused(failure) => failure,
        Unread::Unobserved { verdict, problem } => unreadable(run, verdict, problem),
    })
}
