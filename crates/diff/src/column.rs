//! The columns of the event table, and what each says of an event: when, where,
//! at what load. Rules about columns are rules about these kinds, so that the
//! matching and the classes know no column by name.

use asperity_record::SlipEvent;
use serde::{Serialize, Serializer};

/// A column of the event table, by its place in [`SlipEvent::COLUMNS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Column {
    /// `onset_s`.
    OnsetS,
    /// `end_s`.
    EndS,
    /// `first_block`.
    FirstBlock,
    /// `last_block`.
    LastBlock,
    /// `max_sliding`.
    MaxSliding,
    /// `ft_fn_onset`.
    FtFnOnset,
    /// `ft_fn_end`.
    FtFnEnd,
    /// `event`.
    Event,
    /// `onset_step`.
    OnsetStep,
    /// `end_step`.
    EndStep,
    /// `blocks_slipped`.
    BlocksSlipped,
    /// `nucleation_block`.
    NucleationBlock,
    /// `ft_fn_min`.
    FtFnMin,
    /// `ft_fn_max`.
    FtFnMax,
    /// `open`.
    Open,
}

/// What a column says of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// When it starts or ends.
    Time,
    /// The same as an integer step: it follows from its seconds.
    Step,
    /// Which blocks slid, or how many.
    Extent,
    /// At what load.
    Load,
    /// Whether the run ended before it did.
    Edge,
    /// Its number in the table: it follows from the events before it.
    Number,
}

impl Column {
    /// All columns, in the order of [`SlipEvent::COLUMNS`].
    pub const ALL: [Column; SlipEvent::COLUMNS.len()] = [
        Column::OnsetS,
        Column::EndS,
        Column::FirstBlock,
        Column::LastBlock,
        Column::MaxSliding,
        Column::FtFnOnset,
        Column::FtFnEnd,
        Column::Event,
        Column::OnsetStep,
        Column::EndStep,
        Column::BlocksSlipped,
        Column::NucleationBlock,
        Column::FtFnMin,
        Column::FtFnMax,
        Column::Open,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        SlipEvent::COLUMNS[self as usize]
    }

    /// The column of this name.
    pub fn named(name: &str) -> Option<Column> {
        Column::ALL.into_iter().find(|column| column.name() == name)
    }

    /// What it says of an event.
    pub fn kind(self) -> Kind {
        match self {
            Column::OnsetS | Column::EndS => Kind::Time,
            Column::OnsetStep | Column::EndStep => Kind::Step,
            Column::FirstBlock
            | Column::LastBlock
            | Column::MaxSliding
            | Column::BlocksSlipped
            | Column::NucleationBlock => Kind::Extent,
            Column::FtFnOnset | Column::FtFnEnd | Column::FtFnMin | Column::FtFnMax => Kind::Load,
            Column::Open => Kind::Edge,
            Column::Event => Kind::Number,
        }
    }

    /// Whether it is known as soon as the event starts, so that the end of a run
    /// cannot have cut it.
    pub fn is_of_onset(self) -> bool {
        matches!(self, Column::OnsetS | Column::OnsetStep | Column::FtFnOnset | Column::NucleationBlock)
    }

    /// The cell of an event in this column.
    pub fn of(self, event: &SlipEvent) -> Value {
        match self {
            Column::OnsetS => Value::Number(event.onset_s),
            Column::EndS => event.end_s.map_or(Value::Empty, Value::Number),
            Column::FirstBlock => Value::Whole(event.first_block.into()),
            Column::LastBlock => Value::Whole(event.last_block.into()),
            Column::MaxSliding => Value::Whole(event.max_sliding.into()),
            Column::FtFnOnset => Value::Number(event.ft_fn_onset),
            Column::FtFnEnd => event.ft_fn_end.map_or(Value::Empty, Value::Number),
            Column::Event => Value::Whole(event.event),
            Column::OnsetStep => Value::Whole(event.onset_step),
            Column::EndStep => event.end_step.map_or(Value::Empty, Value::Whole),
            Column::BlocksSlipped => Value::Whole(event.blocks_slipped.into()),
            Column::NucleationBlock => Value::Whole(event.nucleation_block.into()),
            Column::FtFnMin => Value::Number(event.ft_fn_min),
            Column::FtFnMax => Value::Number(event.ft_fn_max),
            Column::Open => Value::Flag(event.open),
        }
    }
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl Serialize for Column {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A cell of the event table. In JSON a number, a flag or null.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Nothing: the run ended before.
    Empty,
    /// A number, in the unit of its column.
    Number(f64),
    /// A whole number.
    Whole(u64),
    /// Yes or no.
    Flag(bool),
}

impl Value {
    /// How far apart two cells are; `None` where no distance can be given, as
    /// between a number and nothing.
    pub fn distance(self, other: Value) -> Option<f64> {
        match (self, other) {
            (Value::Empty, Value::Empty) => Some(0.0),
            (Value::Number(a), Value::Number(b)) => Some((a - b).abs()),
            (Value::Whole(a), Value::Whole(b)) => Some(a.abs_diff(b) as f64),
            (Value::Flag(a), Value::Flag(b)) if a == b => Some(0.0),
            _ => None,
        }
    }

    /// Its magnitude, for relative tolerances; 0 where it is no number.
    pub fn magnitude(self) -> f64 {
        match self {
            Value::Number(value) => value.abs(),
            Value::Whole(value) => value as f64,
            Value::Empty | Value::Flag(_) => 0.0,
        }
    }
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Empty => f.write_str("nothing"),
            Value::Number(value) if *value != 0.0 && value.abs() < 1e-4 => write!(f, "{value:e}"),
            Value::Number(value) => write!(f, "{value}"),
            Value::Whole(value) => write!(f, "{value}"),
            Value::Flag(value) => write!(f, "{value}"),
        }
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Empty => serializer.serialize_none(),
            Value::Number(value) => serializer.serialize_f64(*value),
            Value::Whole(value) => serializer.serialize_u64(*value),
            Value::Flag(value) => serializer.serialize_bool(*value),
        }
    }
}

/// A set of columns: those that a table has, or that two tables share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns(u16);

impl Columns {
    /// All fifteen.
    pub const ALL: Columns = Columns((1 << SlipEvent::COLUMNS.len()) - 1);
    /// None.
    pub const NONE: Columns = Columns(0);

    /// With one more.
    #[must_use]
    pub fn with(self, column: Column) -> Columns {
        Columns(self.0 | 1 << column as u16)
    }

    /// Those in both.
    #[must_use]
    pub fn and(self, other: Columns) -> Columns {
        Columns(self.0 & other.0)
    }

    /// Whether it holds this one.
    pub fn has(self, column: Column) -> bool {
        self.0 & 1 << column as u16 != 0
    }

    /// Its members, in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = Column> {
        Column::ALL.into_iter().filter(move |&column| self.has(column))
    }
}

impl FromIterator<Column> for Columns {
    fn from_iter<I: IntoIterator<Item = Column>>(columns: I) -> Columns {
        columns.into_iter().fold(Columns::NONE, Columns::with)
    }
}
