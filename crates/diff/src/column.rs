//! The columns of the event table, which ruptures share, and the kind of each: time, place, load. Rules
//! refer to these kinds; matching and classes know no column by name.

use asperity_record::{EventPayload, Parts, SlipEvent};
use serde::{Serialize, Serializer};

/// Declares the columns from the table below, each with its kind.
macro_rules! columns {
    ($($column:ident $field:ident $kind:ident,)+) => {
        /// A column of the event table, by its place in [`SlipEvent::COLUMNS`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Column {
            $(#[doc = concat!("`", stringify!($field), "`.")] $column,)+
        }

        impl Column {
            /// All columns, in the order of [`SlipEvent::COLUMNS`].
            pub const ALL: [Column; SlipEvent::COLUMNS.len()] = [$(Column::$column),+];

            /// Its name in tables.
            pub fn name(self) -> &'static str {
                match self {
                    $(Column::$column => stringify!($field),)+
                }
            }

            /// The aspect of an event that it describes.
            pub fn kind(self) -> Kind {
                match self {
                    $(Column::$column => Kind::$kind,)+
                }
            }
        }

        /// The cell of a slip event in a column.
        #[inline]
        pub(crate) fn slip_event_cell(event: &SlipEvent, column: Column) -> Value {
            match column {
                $(Column::$column => event.$field.into(),)+
            }
        }
    };
}

columns! {
    // column, its field, its kind
    OnsetS onset_s Time,
    EndS end_s Time,
    FirstBlock first_block Extent,
    LastBlock last_block Extent,
    MaxSliding max_sliding Extent,
    FtFnOnset ft_fn_onset Load,
    FtFnEnd ft_fn_end Load,
    Event event Number,
    OnsetStep onset_step Step,
    EndStep end_step Step,
    BlocksSlipped blocks_slipped Extent,
    NucleationBlock nucleation_block Extent,
    FtFnMin ft_fn_min Load,
    FtFnMax ft_fn_max Load,
    Open open Edge,
    BreaksOnset breaks_onset Total,
    BreaksEnd breaks_end Total,
    RepinsOnset repins_onset Total,
    RepinsEnd repins_end Total,
    PeakVelocity peak_velocity_m_per_s Speed,
    FirstAcross first_across Extent,
    LastAcross last_across Extent,
}

/// The aspect of an event that a column describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// When it starts or ends.
    Time,
    /// Start or end as an integer step, which follows from its time in seconds.
    Step,
    /// The blocks that slid, or their number.
    Extent,
    /// The load.
    Load,
    /// How fast its blocks slid.
    Speed,
    /// Whether the run ended before the event.
    Edge,
    /// What has happened in the run by its start or end.
    Total,
    /// Its number in the table: it follows from the events before it.
    Number,
}

impl Kind {
    /// Whether its cells are measured numbers rather than counts or flags.
    pub(crate) fn is_measured(self) -> bool {
        matches!(self, Kind::Time | Kind::Load | Kind::Speed)
    }
}

impl Column {
    /// The column of this name.
    pub fn named(name: &str) -> Option<Column> {
        Column::ALL.into_iter().find(|column| column.name() == name)
    }

    /// Whether it is known as soon as the event starts, so that the end of a run cannot have
    /// changed it.
    pub fn is_of_onset(self) -> bool {
        matches!(
            self,
            Column::OnsetS
                | Column::FtFnOnset
                | Column::OnsetStep
                | Column::NucleationBlock
                | Column::BreaksOnset
                | Column::RepinsOnset
        )
    }

    /// Whether events of runs with these parts have it.
    pub fn is_in(self, parts: Parts) -> bool {
        SlipEvent::COLUMNS[self as usize].only.is_none_or(|part| parts.has(part))
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

/// Makes a cell of each type of field that the event table has.
macro_rules! values {
    ($($type:ty: $variant:ident),+) => {
        $(impl From<$type> for Value {
            fn from(value: $type) -> Value {
                Value::$variant(value.into())
            }
        })+
    };
}

values!(f64: Number, u32: Whole, u64: Whole, bool: Flag);

impl<T: Into<Value>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Value {
        value.map_or(Value::Empty, T::into)
    }
}

impl Value {
    /// Distance between two cells; `None` where there is none, as between a number and an empty cell.
    pub fn distance(self, other: Value) -> Option<f64> {
        match (self, other) {
            (Value::Empty, Value::Empty) => Some(0.0),
            (Value::Number(a), Value::Number(b)) => Some((a - b).abs()),
            (Value::Whole(a), Value::Whole(b)) => Some(a.abs_diff(b) as f64),
            (Value::Flag(a), Value::Flag(b)) if a == b => Some(0.0),
            _ => None,
        }
    }

    /// Its magnitude, for relative tolerances; 0 if it is no number.
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
pub struct Columns(u32);

impl Columns {
    /// All.
    pub const ALL: Columns = Columns((1 << SlipEvent::COLUMNS.len()) - 1);
    /// None.
    pub const NONE: Columns = Columns(0);

    /// Those of a run with these parts.
    pub fn of(parts: Parts) -> Columns {
        Column::ALL.into_iter().filter(|column| column.is_in(parts)).collect()
    }

    /// With one more.
    #[must_use]
    pub fn with(self, column: Column) -> Columns {
        Columns(self.0 | 1 << column as u32)
    }

    /// With one less.
    #[must_use]
    pub const fn without(self, column: Column) -> Columns {
        Columns(self.0 & !(1 << column as u32))
    }

    /// Those in both.
    #[must_use]
    pub fn and(self, other: Columns) -> Columns {
        Columns(self.0 & other.0)
    }

    /// Whether it contains this one.
    pub fn has(self, column: Column) -> bool {
        self.0 & 1 << column as u32 != 0
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

#[cfg(test)]
mod tests {
    use asperity_record::{EventPayload, SlipEvent};

    use super::Column;

    #[test]
    fn what_is_said_of_columns_is_said_of_those_of_the_event_table() {
        let names = SlipEvent::COLUMNS.iter().map(|column| column.name.as_ref());
        assert!(names.eq(Column::ALL.map(Column::name)));
        let of_onset = Column::ALL.into_iter().filter(|column| column.is_of_onset());
        assert_eq!(
            of_onset.map(Column::name).collect::<Vec<_>>(),
            ["onset_s", "ft_fn_onset", "onset_step", "nucleation_block", "breaks_onset", "repins_onset"]
        );
    }
}
