//! Every match of a comparison, identical ones too, as a row of a Parquet file.

use std::path::Path;

use asperity_files::FileSet;
use asperity_record::{BoundingBox, SlipEvent};
use asperity_tables::event_file::{MatchFile, MatchRow, MatchSide};

use crate::error::CompareError;
use crate::tally::Matched;

/// The file of matches, if one was asked for.
pub(crate) struct Matches(Option<MatchFile>);

impl Matches {
    /// Creates the file, with columns of rows if some events are over an area.
    pub(crate) fn create(
        files: &FileSet,
        path: Option<&Path>,
        is_over_area: bool,
    ) -> Result<Matches, CompareError> {
        let file = path.map(|path| MatchFile::create(files, path, is_over_area));
        file.transpose().map(Matches).map_err(CompareError::NoMatchesFile)
    }

    pub(crate) fn push(&mut self, run: &str, matched: &Matched<'_, SlipEvent>) -> Result<(), CompareError> {
        let Some(file) = &mut self.0 else { return Ok(()) };
        let side = |events: &[SlipEvent]| {
            let (first, last) = (events.first()?, events.last()?);
            let BoundingBox { columns, rows } =
                BoundingBox::over(events.iter().map(SlipEvent::bounding_box))?;
            let is_over_area = first.first_across.is_some();
            Some(MatchSide {
                events: events.len() as u32,
                event: first.event,
                last_event: last.event,
                onset_s: first.onset_s,
                end_s: last.end_s,
                first_block: columns.first,
                last_block: columns.last,
                first_across: is_over_area.then_some(rows.first),
                last_across: is_over_area.then_some(rows.last),
                ft_fn_onset: first.ft_fn_onset,
            })
        };
        let row = MatchRow {
            run: run.to_owned(),
            class: matched.class.name(),
            allowed: matched.allowed,
            shift_s: matched.shift_s,
            old: side(&matched.group.old),
            new: side(&matched.group.new),
        };
        file.push(row).map_err(CompareError::Matches)
    }

    pub(crate) fn finish(self) -> Result<(), CompareError> {
        self.0.map_or(Ok(()), |file| file.finish().map_err(CompareError::Matches))
    }
}
