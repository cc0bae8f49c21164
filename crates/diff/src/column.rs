//! The columns of the event table, which ruptures share. Matching and classes go by their roles; the few that
//! they know by name are constants here.

use asperity_record::{Cell, EventPayload, Part, Parts, Role, SlipEvent};
use serde::{Serialize, Serializer};

/// A column of the event table, by its place in [`SlipEvent::COLUMNS`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Column(u8);

/// How many columns the event table has.
pub(crate) const COUNT: usize = SlipEvent::COLUMNS.len();

// Evaluated here, so that the compiler reports a column that nothing can be said of.
const _: () = {
    let mut place = 0;
    while place < COUNT {
        assert!(SlipEvent::COLUMNS[place].role.is_some(), "every column of the event table must have a role");
        place += 1;
    }
};

impl Column {
    /// Onset, s.
    pub const ONSET_S: Column = Column::of("onset_s");
    /// End, s.
    pub const END_S: Column = Column::of("end_s");
    /// Lowest-numbered block, or first column.
    pub const FIRST_BLOCK: Column = Column::of("first_block");
    /// Highest-numbered block, or last column.
    pub const LAST_BLOCK: Column = Column::of("last_block");
    /// First row.
    pub const FIRST_ACROSS: Column = Column::of("first_across");
    /// Last row.
    pub const LAST_ACROSS: Column = Column::of("last_across");
    /// How many blocks slid.
    pub const BLOCKS_SLIPPED: Column = Column::of("blocks_slipped");
    /// Block that slid first.
    pub const NUCLEATION_BLOCK: Column = Column::of("nucleation_block");
    /// Number in the table.
    pub const EVENT: Column = Column::of("event");
    /// Step of the onset.
    pub const ONSET_STEP: Column = Column::of("onset_step");
    /// Step of the end.
    pub const END_STEP: Column = Column::of("end_step");
    /// Whether the run ended before.
    pub const OPEN: Column = Column::of("open");
    /// `F_T / F_N` at the onset.
    pub const FT_FN_ONSET: Column = Column::of("ft_fn_onset");

    /// The column of this name, which there must be.
    const fn of(name: &str) -> Column {
        let mut place = 0;
        while place < COUNT {
            if let std::borrow::Cow::Borrowed(other) = SlipEvent::COLUMNS[place].name
                && is_same(other.as_bytes(), name.as_bytes())
            {
                return Column(place as u8);
            }
            place += 1;
        }
        panic!("the event table has no such column")
    }

    /// All columns, in order.
    pub fn all() -> impl Iterator<Item = Column> + Clone {
        (0..COUNT as u8).map(Column)
    }

    /// The column of this name.
    pub fn named(name: &str) -> Option<Column> {
        Column::all().find(|column| column.name() == name)
    }

    /// What the table says of it.
    pub fn about(self) -> &'static asperity_record::Column {
        &SlipEvent::COLUMNS[self.place()]
    }

    /// Its place in the table.
    pub(crate) fn place(self) -> usize {
        usize::from(self.0)
    }

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        &self.about().name
    }

    /// What it says of an event.
    pub fn role(self) -> Role {
        self.about().role.expect("the compiler has seen that it has one")
    }

    /// Whether it is known as soon as the event starts.
    pub fn is_of_onset(self) -> bool {
        self.about().is_of_onset()
    }

    /// Whether events of runs with these parts have it.
    pub fn is_in(self, parts: Parts) -> bool {
        self.about().only.is_none_or(|part: Part| parts.has(part))
    }

    /// A value as a cell.
    pub(crate) fn cell(self, value: f64) -> Cell {
        match self.role() {
            _ if value.is_nan() => Cell::Empty,
            Role::Edge => Cell::Flag(value != 0.0),
            role if role.is_measured() => Cell::Number(value),
            _ => Cell::Step(value as u64),
        }
    }
}

const fn is_same(a: &[u8], b: &[u8]) -> bool {
    let mut place = 0;
    while place < a.len() && place < b.len() && a[place] == b[place] {
        place += 1;
    }
    place == a.len() && place == b.len()
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

/// A set of columns: those that a table has, or that two tables share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Columns(u32);

impl Columns {
    /// None.
    pub const NONE: Columns = Columns(0);
    /// All.
    pub const ALL: Columns = Columns((1 << COUNT) - 1);

    /// With one more.
    #[must_use]
    pub fn with(self, column: Column) -> Columns {
        Columns(self.0 | 1 << column.0)
    }

    /// Those in both.
    #[must_use]
    pub fn and(self, other: Columns) -> Columns {
        Columns(self.0 & other.0)
    }

    /// Whether it contains this one.
    pub fn has(self, column: Column) -> bool {
        self.0 & 1 << column.0 != 0
    }

    /// Its members, in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = Column> {
        Column::all().filter(move |&column| self.has(column))
    }
}

impl FromIterator<Column> for Columns {
    fn from_iter<I: IntoIterator<Item = Column>>(columns: I) -> Columns {
        columns.into_iter().fold(Columns::NONE, Columns::with)
    }
}
