//! Every match of a comparison, identical ones too, as a row of a Parquet file.

use std::path::Path;

use asperity_files::FileSet;
use asperity_record::BoundingBox;
use asperity_tables::event_file::{MatchFile, MatchRow, MatchSide};

use crate::column::Column;
use crate::error::CompareError;
use crate::table::Row;
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

    pub(crate) fn push(&mut self, run: &str, matched: &Matched<'_>) -> Result<(), CompareError> {
        let Some(file) = &mut self.0 else { return Ok(()) };
        let side = |events: &[Row<'_>]| {
            let (first, last) = (events.first()?, events.last()?);
            let BoundingBox { columns, rows } =
                BoundingBox::over(events.iter().map(|event| event.bounding_box()))?;
            let across = first.across().map(|_| rows);
            Some(MatchSide {
                events: events.len() as u32,
                event: first.number(),
                last_event: last.number(),
                onset_s: first.onset_s(),
                end_s: last.end_s(),
                first_block: columns.first,
                last_block: columns.last,
                first_across: across.map(|rows| rows.first),
                last_across: across.map(|rows| rows.last),
                ft_fn_onset: Some(first.value(Column::FT_FN_ONSET))
                    .filter(|load| !load.is_nan())
                    .unwrap_or(0.0),
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
