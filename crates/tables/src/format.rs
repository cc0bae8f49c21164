//! The interface of a file format for tables.

use std::fs::File;
use std::io;

use asperity_record::RunHeader;

use crate::batch::Batch;
use crate::layout::Layout;

/// A file that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format's library refused.
    #[error("{0}")]
    Library(String),
}

/// A file format.
pub trait Format {
    /// How its files' names end, without the dot.
    fn extension(&self) -> &'static str;

    /// Starts the file of a table.
    ///
    /// # Errors
    /// If the file cannot be written.
    fn start(&self, layout: &Layout, file: File) -> Result<Box<dyn TableWriter>, FormatError>;
}

/// A table's file that is being written.
pub trait TableWriter {
    /// Adds rows.
    ///
    /// # Errors
    /// If the file cannot be written.
    fn write(&mut self, batch: &Batch) -> Result<(), FormatError>;

    /// Writes the remaining rows and returns the file, to be synced.
    /// `about` describes the source of the rows, as names and texts; formats that have a place for it
    /// store it.
    ///
    /// # Errors
    /// If the file cannot be written.
    fn finish(self: Box<Self>, about: &[(String, String)]) -> Result<File, FormatError>;
}

/// The state of a log, as stated in tables derived from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// The log is complete.
    Whole,
    /// So it does, and another version of the program or other detectors made it.
    OtherCode,
    /// It ends before its run does.
    Incomplete,
    /// It contains all of a run that was stopped because it could not continue.
    Stopped,
    /// It was salvaged from a damaged log, and may have gaps.
    Salvaged,
    /// It is damaged, and everything after the damage is left out.
    Damaged,
}

impl State {
    /// As it is written.
    pub fn word(self) -> &'static str {
        match self {
            State::Whole => "whole",
            State::OtherCode => "by other code or detectors",
            State::Incomplete => "incomplete",
            State::Stopped => "stopped",
            State::Salvaged => "salvaged with gaps",
            State::Damaged => "damaged",
        }
    }
}

impl serde::Serialize for State {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.word())
    }
}

/// The source of a table's rows.
#[derive(Debug, Clone)]
pub struct About {
    /// The header of the run.
    pub header: RunHeader,
    /// The state of its log.
    pub state: State,
    /// The last step that could be read.
    pub last_step: u64,
    /// Rows are from this time on, if that was asked for, s.
    pub from_s: Option<f64>,
    /// Rows are from before this time, if that was asked for, s.
    pub to_s: Option<f64>,
}

impl About {
    /// As pairs of name and text, for formats that store metadata. `units` is a JSON object of columns and
    /// units.
    pub fn pairs(&self, layout: &Layout) -> Vec<(String, String)> {
        let RunHeader {
            record_schema_version,
            scenario,
            scenario_hash,
            run_id,
            code_version,
            parameter_set,
            solver,
            blocks,
            rows,
            junction_count,
            radiates,
            has_state,
            time_step_s,
            longest_stable_step_s,
            steps,
            scales,
        } = &self.header;
        let units: serde_json::Map<String, serde_json::Value> = layout
            .columns
            .iter()
            .filter_map(|column| Some((column.name.to_string(), column.unit?.into())))
            .collect();
        let mut pairs = vec![
            ("topic", layout.topic.to_string()),
            ("units", serde_json::Value::Object(units).to_string()),
            ("log", self.state.word().to_owned()),
            ("last_step", self.last_step.to_string()),
            ("record_schema_version", record_schema_version.to_string()),
            ("scenario", scenario.clone()),
            ("scenario_hash", scenario_hash.clone()),
            ("run_id", run_id.clone()),
            ("code_version", code_version.clone()),
            ("parameter_set", parameter_set.clone()),
            ("solver", solver.clone()),
            ("blocks", blocks.to_string()),
            ("time_step_s", time_step_s.to_string()),
            ("steps", steps.to_string()),
        ];
        pairs.extend((*rows != 1).then(|| ("rows", rows.to_string())));
        pairs.extend((*junction_count > 0).then(|| ("junction_count", junction_count.to_string())));
        pairs.extend(radiates.then(|| ("radiates", radiates.to_string())));
        pairs.extend(has_state.then(|| ("has_state", has_state.to_string())));
        pairs.extend(longest_stable_step_s.map(|longest_s| ("longest_stable_step_s", longest_s.to_string())));
        pairs.extend(scales.parts().map(|(key, value)| (key, value.to_string())));
        pairs.extend(self.from_s.map(|from_s| ("from_s", from_s.to_string())));
        pairs.extend(self.to_s.map(|to_s| ("to_s", to_s.to_string())));
        pairs.into_iter().map(|(name, text)| (format!("asperity:{name}"), text)).collect()
    }
}
