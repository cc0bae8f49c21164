//! The columns of the event table, and what each says of an event: when, where,
//! at what load. Rules about columns are rules about these kinds, so that the
//! matching and the classes know no column by name.

use asperity_record::{Cell, EventPayload, SlipEvent};
use serde::{Serialize, Serializer};

/// Makes of the table below the columns and what is said of each.
macro_rules! columns {
    ($($column:ident $name:literal $kind:ident $known:ident,)+) => {
        /// A column of the event table, by its place in [`SlipEvent::COLUMNS`].
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u8)]
        pub enum Column {
            $(#[doc = concat!("`", $name, "`.")] $column,)+
        }

        impl Column {
            /// All columns, in the order of [`SlipEvent::COLUMNS`].
            pub const ALL: [Column; SlipEvent::COLUMNS.len()] = [$(Column::$column),+];

            /// What it says of an event.
            pub fn kind(self) -> Kind {
                match self {
                    $(Column::$column => Kind::$kind,)+
                }
            }

            fn known(self) -> Known {
                match self {
                    $(Column::$column => Known::$known,)+
                }
            }
        }

        #[cfg(test)]
        const NAMES: &[&str] = &[$($name),+];
    };
}

columns! {
    // column, its name, what it says, when it is known
    OnsetS "onset_s" Time AtOnset,
    EndS "end_s" Time Later,
    FirstBlock "first_block" Extent Later,
    LastBlock "last_block" Extent Later,
    MaxSliding "max_sliding" Extent Later,
    FtFnOnset "ft_fn_onset" Load AtOnset,
    FtFnEnd "ft_fn_end" Load Later,
    Event "event" Number Later,
    OnsetStep "onset_step" Step AtOnset,
    EndStep "end_step" Step Later,
    BlocksSlipped "blocks_slipped" Extent Later,
    NucleationBlock "nucleation_block" Extent AtOnset,
    FtFnMin "ft_fn_min" Load Later,
    FtFnMax "ft_fn_max" Load Later,
    Open "open" Edge Later,
}

/// Since when a column's cell is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Known {
    /// Since the event started.
    AtOnset,
    /// It may change while the event goes on.
    Later,
}

/// What a column says of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// When it starts or ends.
    Time,
    /// Start or end as an integer step, which follows from its time in seconds.
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
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        &SlipEvent::COLUMNS[self as usize].name
    }

    /// The column of this name.
    pub fn named(name: &str) -> Option<Column> {
        Column::ALL.into_iter().find(|column| column.name() == name)
    }

    /// Whether it is known as soon as the event starts, so that the end of a run
    /// cannot have cut it.
    pub fn is_of_onset(self) -> bool {
        self.known() == Known::AtOnset
    }

    /// The cell of an event in this column.
    pub fn of(self, event: &SlipEvent) -> Value {
        event.cells().as_ref()[self as usize].into()
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

impl From<Cell> for Value {
    fn from(cell: Cell) -> Value {
        match cell {
            Cell::Empty => Value::Empty,
            Cell::Count(value) => Value::Whole(value.into()),
            Cell::Step(value) => Value::Whole(value),
            Cell::Number(value) => Value::Number(value),
            Cell::Flag(value) => Value::Flag(value),
            Cell::Word(word) => unreachable!("the event table has no words, as {word:?}"),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::{Column, NAMES};

    #[test]
    fn what_is_said_of_columns_is_said_of_those_of_the_event_table() {
        assert_eq!(Column::ALL.map(Column::name)[..], *NAMES);
        let of_onset = Column::ALL.into_iter().filter(|column| column.is_of_onset());
        assert_eq!(
            of_onset.map(Column::name).collect::<Vec<_>>(),
            ["onset_s", "ft_fn_onset", "onset_step", "nucleation_block"]
        );
    }
}
