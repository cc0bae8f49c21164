//! Stubs for `matches` and `precursors` without the feature `analysis`.

use std::path::Path;

use asperity_files::FileSet;
use asperity_record::SlipEvent;

use crate::error::CompareError;
use crate::report::PrecursorChanges;
use crate::sides::Run;
use crate::tally::Matched;

/// No file of matches can be asked for.
pub(crate) struct Matches;

impl Matches {
    pub(crate) fn create(
        _files: &FileSet,
        path: Option<&Path>,
        _is_over_area: bool,
    ) -> Result<Matches, CompareError> {
        match path {
            None => Ok(Matches),
            Some(path) => Err(CompareError::NoParquet { path: path.to_owned() }),
        }
    }

    pub(crate) fn push(&mut self, _run: &str, _matched: &Matched<'_, SlipEvent>) -> Result<(), CompareError> {
        Ok(())
    }

    pub(crate) fn finish(self) -> Result<(), CompareError> {
        Ok(())
    }
}

/// There are no precursor tables.
pub(crate) struct Precursors;

impl Precursors {
    pub(crate) fn of(_old: &Run, _new: &Run) -> Precursors {
        Precursors
    }

    pub(crate) fn watch(&mut self, _matched: &Matched<'_, SlipEvent>) {}

    pub(crate) fn changes(self) -> Option<PrecursorChanges> {
        None
    }
}
