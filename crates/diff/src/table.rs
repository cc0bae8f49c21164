//! Reads slip events from a run log, a CSV or a Parquet file, one at a time where the format permits, with
//! the columns that exist.

use std::path::{Path, PathBuf};

use asperity_files::ShortLines;
use asperity_record::{MOST_BLOCKS, SlipEvent};
use asperity_runlog::{LogError, LogItem, RunReader, Topics};

use crate::column::{Column, Columns, Kind, Value};

/// The columns required for matching.
const NEEDED: [Column; 4] = [Column::OnsetS, Column::EndS, Column::FirstBlock, Column::LastBlock];

/// A table that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// A run log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The system refused.
    #[error("{}: {error}", path.display())]
    Io {
        /// The table.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// Not CSV.
    #[error("{}: {error}", path.display())]
    Csv {
        /// The table.
        path: PathBuf,
        /// The error, with its line.
        error: csv::Error,
    },
    /// A heading that is no event table's.
    #[error("{}:1: {problem} (accepted: {})", path.display(), accepted())]
    Heading {
        /// The table.
        path: PathBuf,
        /// The error.
        problem: String,
    },
    /// A cell that its column does not accept.
    #[error("{}:{line}: {column}: {value:?} is not accepted (accepted: {accepted})", path.display())]
    Cell {
        /// The table.
        path: PathBuf,
        /// The line, the heading's being 1.
        line: u64,
        /// The column.
        column: Column,
        /// The cell, as written.
        value: String,
        /// The accepted values.
        accepted: &'static str,
    },
    /// A Parquet file.
    #[error(transparent)]
    Parquet(#[from] asperity_tables::TableFileError),
}

fn accepted() -> String {
    let needed: Vec<&str> = NEEDED.into_iter().map(Column::name).collect();
    format!("a table with at least {}", needed.join(", "))
}

/// Events, one after the other.
pub type Events<'a> = Box<dyn Iterator<Item = Result<SlipEvent, TableError>> + 'a>;

/// An event table that is open.
pub struct Table<'a> {
    /// The columns that it has.
    pub columns: Columns,
    /// Its events.
    pub events: Events<'a>,
}

/// Opens a run log or a table, by the ending of its name.
///
/// # Errors
/// If it cannot be read, or its heading is no event table's.
pub fn open(path: &Path) -> Result<Table<'static>, TableError> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("csv") => csv(path),
        Some("parquet") => parquet(path),
        _ => log(path),
    }
}

fn log(path: &Path) -> Result<Table<'static>, TableError> {
    let mut reader = RunReader::open(path, Topics::EVENTS)?;
    let columns = Columns::of(reader.header().parts());
    let events = one_by_one(move || {
        while let Some(item) = reader.next_item()? {
            if let LogItem::Event(event) = item
                && let Some(slip) = event.get::<SlipEvent>()
            {
                return Ok(Some(slip.clone()));
            }
        }
        Ok(None)
    });
    Ok(Table { columns, events })
}

/// Iterates over the events that a function returns, until `None`.
fn one_by_one(mut next: impl FnMut() -> Result<Option<SlipEvent>, TableError> + 'static) -> Events<'static> {
    Box::new(std::iter::from_fn(move || next().transpose()))
}

/// Positions of the columns in the rows of a table.
struct Places {
    path: PathBuf,
    places: Vec<(Column, usize)>,
    columns: Columns,
}

impl Places {
    fn of<'a>(path: &Path, names: impl Iterator<Item = &'a str>) -> Result<Places, TableError> {
        let problem = |problem: String| TableError::Heading { path: path.to_owned(), problem };
        let mut places: Vec<(Column, usize)> = Vec::new();
        for (place, name) in names.enumerate() {
            // Columns that others added are theirs.
            let Some(column) = Column::named(name.trim()) else { continue };
            if places.iter().any(|(other, _)| *other == column) {
                return Err(problem(format!("there are two columns {column}")));
            }
            places.push((column, place));
        }
        let lacks = |column: &Column| !places.iter().any(|(there, _)| there == column);
        if let Some(column) = NEEDED.into_iter().find(lacks) {
            return Err(problem(format!("there is no column {column}")));
        }
        // In the order of the table: an onset comes before the end that is compared with it.
        places.sort_unstable();
        let columns = places.iter().map(|(column, _)| *column).collect();
        Ok(Places { path: path.to_owned(), places, columns })
    }

    /// Converts a row to an event. Fields whose columns the table lacks follow from the others, or are 0;
    /// they are not compared.
    fn event(
        &self,
        line: u64,
        number: u64,
        cell: impl Fn(usize, Column) -> Result<Value, String>,
    ) -> Result<SlipEvent, TableError> {
        let mut event = SlipEvent {
            onset_s: 0.0,
            end_s: None,
            first_block: 0,
            last_block: 0,
            max_sliding: 0,
            ft_fn_onset: 0.0,
            ft_fn_end: None,
            event: number,
            onset_step: 0,
            end_step: None,
            blocks_slipped: 0,
            nucleation_block: 0,
            ft_fn_min: 0.0,
            ft_fn_max: 0.0,
            open: false,
            breaks_onset: None,
            breaks_end: None,
            repins_onset: None,
            repins_end: None,
            peak_velocity_m_per_s: None,
            first_across: None,
            last_across: None,
        };
        for &(column, place) in &self.places {
            let refused = |value: String, accepted: &'static str| TableError::Cell {
                path: self.path.clone(),
                line,
                column,
                value,
                accepted,
            };
            let value = cell(place, column).map_err(|text| refused(text, kind_accepted(column)))?;
            put(&mut event, column, value).map_err(|accepted| {
                let text = if value == Value::Empty { String::new() } else { value.to_string() };
                refused(text, accepted)
            })?;
        }
        if !self.columns.has(Column::Open) {
            event.open = event.end_s.is_none();
        }
        Ok(event)
    }
}

/// Accepted values of a column, in words.
fn kind_accepted(column: Column) -> &'static str {
    match column {
        Column::EndS | Column::FtFnEnd => "a number, or nothing where the run ended before",
        Column::EndStep => "a whole number, or nothing where the run ended before",
        Column::Open => "true or false",
        _ if column.kind() == Kind::Total => "a whole number, or nothing",
        _ if column.kind().is_measured() => "a number",
        _ if column.kind() == Kind::Extent => "a whole number of blocks",
        _ => "a whole number",
    }
}

/// Stores a cell in its field, or returns the accepted values.
fn put(event: &mut SlipEvent, column: Column, value: Value) -> Result<(), &'static str> {
    const BLOCK: &str = "a whole number from 1 to 100000";
    const _: () = assert!(MOST_BLOCKS == 100_000);
    let number = || match value {
        Value::Number(number) if number.is_finite() => Ok(number),
        Value::Whole(whole) => Ok(whole as f64),
        _ => Err(kind_accepted(column)),
    };
    let whole = || match value {
        // Counts must also be exact as doubles.
        Value::Whole(whole @ 0..=MOST_WHOLE) => Ok(whole),
        Value::Whole(_) => Err("a whole number up to 9007199254740992"),
        _ => Err(kind_accepted(column)),
    };
    let is_empty = value == Value::Empty;
    let total = || if is_empty { Ok(None) } else { whole().map(Some) };
    let block = || match value {
        Value::Whole(whole @ 1..=MOST_BLOCKS) => u32::try_from(whole).map_err(|_| BLOCK),
        _ => Err(BLOCK),
    };
    match column {
        Column::OnsetS => event.onset_s = number()?,
        Column::EndS if is_empty => event.end_s = None,
        Column::EndS => match number()? {
            end_s if end_s >= event.onset_s => event.end_s = Some(end_s),
            _ => return Err("a number from onset_s, or nothing where the run ended before"),
        },
        Column::FirstBlock => event.first_block = block()?,
        Column::LastBlock => match block()? {
            last_block if last_block >= event.first_block => event.last_block = last_block,
            _ => return Err("a block from first_block"),
        },
        Column::MaxSliding => event.max_sliding = block()?,
        Column::BlocksSlipped => event.blocks_slipped = block()?,
        Column::NucleationBlock => event.nucleation_block = block()?,
        Column::FtFnOnset => event.ft_fn_onset = number()?,
        Column::FtFnEnd if is_empty => event.ft_fn_end = None,
        Column::FtFnEnd => event.ft_fn_end = Some(number()?),
        Column::FtFnMin => event.ft_fn_min = number()?,
        Column::FtFnMax => event.ft_fn_max = number()?,
        Column::Event => event.event = whole()?,
        Column::OnsetStep => event.onset_step = whole()?,
        Column::EndStep if is_empty => event.end_step = None,
        Column::EndStep => event.end_step = Some(whole()?),
        Column::BreaksOnset => event.breaks_onset = total()?,
        Column::BreaksEnd => event.breaks_end = total()?,
        Column::RepinsOnset => event.repins_onset = total()?,
        Column::RepinsEnd => event.repins_end = total()?,
        Column::PeakVelocity if is_empty => event.peak_velocity_m_per_s = None,
        Column::PeakVelocity => event.peak_velocity_m_per_s = Some(number()?),
        Column::FirstAcross if is_empty => event.first_across = None,
        Column::FirstAcross => event.first_across = Some(block()?),
        Column::LastAcross if is_empty && event.first_across.is_none() => event.last_across = None,
        Column::LastAcross => match (event.first_across, block()?) {
            (Some(first), last) if last >= first => event.last_across = Some(last),
            _ => return Err("a row from first_across"),
        },
        Column::Open => match value {
            Value::Flag(open) => event.open = open,
            _ => return Err(kind_accepted(column)),
        },
    }
    Ok(())
}

/// The largest whole number up to which doubles are exact.
const MOST_WHOLE: u64 = 1 << 53;

fn csv(path: &Path) -> Result<Table<'static>, TableError> {
    let file = asperity_files::open(path).map_err(|error| TableError::Io { path: path.to_owned(), error })?;
    let mut reader = csv::Reader::from_reader(ShortLines::of(file));
    let broken = {
        let path = path.to_owned();
        move |error: csv::Error| TableError::Csv { path: path.clone(), error }
    };
    let places = Places::of(path, reader.headers().map_err(&broken)?.iter())?;
    let columns = places.columns;
    let mut record = csv::StringRecord::new();
    let mut number = 0;
    let events = one_by_one(move || {
        if !reader.read_record(&mut record).map_err(&broken)? {
            return Ok(None);
        }
        let line = record.position().map_or(0, csv::Position::line);
        let event = places.event(line, number, |place, column| {
            let text = trimmed(record.get(place).unwrap_or_default());
            written(column, text).ok_or_else(|| text.to_owned())
        })?;
        number += 1;
        Ok(Some(event))
    });
    Ok(Table { columns, events })
}

/// A cell without the spaces around it, which are rare.
fn trimmed(text: &str) -> &str {
    let is_plain = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_graphic);
    let bytes = text.as_bytes();
    if is_plain(bytes.first()) && is_plain(bytes.last()) { text } else { text.trim() }
}

/// A cell as it is written in CSV.
fn written(column: Column, text: &str) -> Option<Value> {
    if text.is_empty() {
        return Some(Value::Empty);
    }
    match column.kind() {
        Kind::Time | Kind::Load | Kind::Speed => text.parse().ok().map(Value::Number),
        Kind::Edge => text.parse().ok().map(Value::Flag),
        Kind::Step | Kind::Extent | Kind::Total | Kind::Number => text.parse().ok().map(Value::Whole),
    }
}

fn parquet(path: &Path) -> Result<Table<'static>, TableError> {
    use asperity_tables::event_file::{Cell, Rows};

    let mut rows = Rows::open(path)?;
    let places = Places::of(path, rows.names().iter().map(String::as_str))?;
    let columns = places.columns;
    let mut number = 0;
    let events = one_by_one(move || {
        let Some(row) = rows.next_row()? else { return Ok(None) };
        // Numbered as lines of the same table in CSV are, below the heading.
        let event = places.event(number + 2, number, |place, _| match &row[place] {
            Cell::Empty => Ok(Value::Empty),
            Cell::Number(number) => Ok(Value::Number(*number)),
            Cell::Whole(whole) => Ok(Value::Whole(*whole)),
            Cell::Flag(flag) => Ok(Value::Flag(*flag)),
            Cell::Other(text) => Err(text.clone()),
        })?;
        number += 1;
        Ok(Some(event))
    });
    Ok(Table { columns, events })
}
