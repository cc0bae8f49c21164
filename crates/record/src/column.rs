//! The columns of tables: name, kind, unit and meaning, defined once for every file and page that has
//! the table.

use std::borrow::Cow;
use std::fmt;

use serde::{Deserialize, Serialize};

use crate::{Part, Parts};

/// What the cells of a column hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColumnKind {
    /// A small whole number: blocks and how many of them; 32 bits, unsigned.
    Count,
    /// A whole number that grows with the run: steps and events; 64 bits, unsigned.
    Step,
    /// A double.
    Number,
    /// Yes or no.
    Flag,
    /// One of a few words.
    Word,
}

impl ColumnKind {
    /// The kind in words, for pages of documentation.
    pub fn words(self) -> &'static str {
        match self {
            ColumnKind::Count => "whole number, 32 bits",
            ColumnKind::Step => "whole number, 64 bits",
            ColumnKind::Number => "double",
            ColumnKind::Flag => "true or false",
            ColumnKind::Word => "word",
        }
    }
}

/// What a column says of an event. Range checks of logs, classes of a diff and cells of tables that are read
/// follow from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// A block, a column or a row of contacts, or how many of them: from 1 to as many as there are.
    Place,
    /// A step: the same as a time, counted.
    Step,
    /// A time, s.
    Time,
    /// A load, `F_T / F_N`.
    Load,
    /// A speed, m/s.
    Speed,
    /// How often something has happened in the run by the start or the end of the event.
    Total,
    /// Whether the run ended before the event.
    Edge,
    /// Its number in its table, which follows from the events before it.
    Number,
}

impl Role {
    /// Whether its cells are measured numbers rather than counts or flags.
    pub fn is_measured(self) -> bool {
        matches!(self, Role::Time | Role::Load | Role::Speed)
    }
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name, that of the field in the log, with the unit last.
    pub name: Cow<'static, str>,
    /// What its cells hold.
    pub kind: ColumnKind,
    /// The unit, SI; `1` for ratios, none for what is counted or named.
    pub unit: Option<&'static str>,
    /// Its meaning, in a sentence or two.
    pub about: Cow<'static, str>,
    /// Tables of runs without this lack the column.
    pub only: Option<Part>,
    /// Its meaning in runs with contacts over an area, where that is another one.
    pub over_area: Option<&'static str>,
    /// What it says of an event, if that is one of these.
    pub role: Option<Role>,
    /// Whether its cells may be empty.
    pub is_optional: bool,
}

impl Column {
    /// A column with the unit in which its name ends, see [`unit_of`].
    ///
    /// If it has numbers and its name ends in no unit. In a constant, as in those of
    /// [`payload!`](crate::payload), this is a compile-time error.
    pub const fn new(name: &'static str, kind: ColumnKind, about: &'static str) -> Column {
        let unit = match kind {
            ColumnKind::Number => {
                let unit = unit_of(name);
                assert!(
                    unit.is_some(),
                    "the name of a column of numbers must end in an SI unit, as in onset_s"
                );
                unit
            }
            _ => None,
        };
        Column::of(name, kind, unit, about)
    }

    const fn of(
        name: &'static str,
        kind: ColumnKind,
        unit: Option<&'static str>,
        about: &'static str,
    ) -> Column {
        let about = Cow::Borrowed(about.trim_ascii());
        Column {
            name: Cow::Borrowed(name),
            kind,
            unit,
            about,
            only: None,
            over_area: None,
            role: None,
            is_optional: false,
        }
    }

    /// A column whose name does not end in its unit: a ratio, `1`.
    pub const fn with_unit(
        name: &'static str,
        kind: ColumnKind,
        unit: &'static str,
        about: &'static str,
    ) -> Column {
        Column::of(name, kind, Some(unit), about)
    }

    /// The column, of runs with this part only.
    pub const fn only(mut self, part: Part) -> Column {
        self.only = Some(part);
        self
    }

    /// The column as it is in a run with these parts, with its meaning there alone.
    #[must_use]
    pub fn in_run(mut self, parts: Parts) -> Column {
        if let Some(over_area) = self.over_area.take().filter(|_| parts.area) {
            self.about = Cow::Borrowed(over_area);
        }
        self
    }

    /// The column, with this role; its cells may be empty if those of its field may.
    pub const fn with_role(mut self, role: Option<Role>, is_optional: bool) -> Column {
        self.role = role;
        self.is_optional = is_optional;
        self
    }

    /// Whether it is known as soon as the event starts, so that the end of a run cannot have changed it: its
    /// name speaks of the onset or the nucleation.
    pub fn is_of_onset(&self) -> bool {
        self.name.contains("onset") || self.name.starts_with("nucleation")
    }

    /// The column, with this meaning in runs with contacts over an area.
    pub const fn over_area(mut self, about: &'static str) -> Column {
        self.over_area = Some(about);
        self
    }
}

/// Suffixes of names and their units. A suffix that ends in another one comes before that.
const UNITS: [(&str, &str); 27] = [
    ("_m_per_s2", "m/s2"),
    ("_n_per_m2", "N/m2"),
    ("_kg_per_s", "kg/s"),
    ("_kg_per_m3", "kg/m3"),
    ("_kg_per_m", "kg/m"),
    ("_n_per_m", "N/m"),
    ("_n_per_s", "N/s"),
    ("_pa_per_s", "Pa/s"),
    ("_n_s_per_m", "N s/m"),
    ("_rad_per_s", "rad/s"),
    ("_n_m_per_s", "N m/s"),
    ("_m_per_s", "m/s"),
    ("_per_m", "1/m"),
    ("_per_s", "1/s"),
    ("_ratio", "1"),
    ("_rad", "rad"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_pa", "Pa"),
    ("_n_m", "N m"),
    ("_m2", "m2"),
    ("_m3", "m3"),
    ("_j", "J"),
    ("_w", "W"),
    ("_m", "m"),
    ("_s", "s"),
    ("_n", "N"),
];

/// The unit in which a name ends; `1` for ratios, `ft_fn...` and `..._ratio`.
pub const fn unit_of(name: &str) -> Option<&'static str> {
    if starts_with(name.as_bytes(), b"ft_fn") {
        return Some("1");
    }
    let mut n = 0;
    while n < UNITS.len() {
        let (end, unit) = UNITS[n];
        if ends_with(name.as_bytes(), end.as_bytes()) {
            return Some(unit);
        }
        n += 1;
    }
    None
}

pub(crate) const fn starts_with(text: &[u8], start: &[u8]) -> bool {
    match text.split_at_checked(start.len()) {
        Some((head, _)) => ends_with(head, start),
        None => false,
    }
}

const fn ends_with(text: &[u8], end: &[u8]) -> bool {
    let Some(before) = text.len().checked_sub(end.len()) else { return false };
    let mut n = 0;
    while n < end.len() {
        if text[before + n] != end[n] {
            return false;
        }
        n += 1;
    }
    true
}

/// One cell of a table, or a value of a key of a scenario: as JSON the value itself, null where it is empty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// Empty: the run ended before the value was known.
    Empty,
    /// Of a [`ColumnKind::Step`]; every whole number from 0 that is read without its kind.
    Step(u64),
    /// Of a [`ColumnKind::Count`].
    Count(u32),
    /// Of a [`ColumnKind::Number`].
    Number(f64),
    /// Of a [`ColumnKind::Flag`].
    Flag(bool),
    /// Of a [`ColumnKind::Word`].
    Word(Cow<'static, str>),
}

impl Cell {
    /// The cell of a column of this kind with a JSON value, if the value fits it.
    pub fn of_json(kind: ColumnKind, value: &serde_json::Value) -> Option<Cell> {
        match kind {
            _ if value.is_null() => Some(Cell::Empty),
            ColumnKind::Count => value.as_u64().and_then(|value| value.try_into().ok()).map(Cell::Count),
            ColumnKind::Step => value.as_u64().map(Cell::Step),
            ColumnKind::Number => value.as_f64().map(Cell::Number),
            ColumnKind::Flag => value.as_bool().map(Cell::Flag),
            ColumnKind::Word => value.as_str().map(Cell::word),
        }
    }

    /// A word of its own.
    pub fn word(word: &str) -> Cell {
        Cell::Word(word.to_owned().into())
    }

    /// The cell as a number, 0 or 1 for a flag.
    pub fn number(&self) -> Option<f64> {
        match *self {
            Cell::Count(value) => Some(value.into()),
            Cell::Step(value) => Some(value as f64),
            Cell::Number(value) => Some(value),
            Cell::Flag(value) => Some(f64::from(u8::from(value))),
            Cell::Empty | Cell::Word(_) => None,
        }
    }
}

/// Numbers with the fewest digits that give the same double back; an empty string for empty cells.
impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cell::Empty => Ok(()),
            Cell::Count(value) => write!(f, "{value}"),
            Cell::Step(value) => write!(f, "{value}"),
            Cell::Number(value) => write!(f, "{value}"),
            Cell::Flag(value) => write!(f, "{value}"),
            Cell::Word(value) => f.write_str(value),
        }
    }
}

/// A type of cell values: that of a field of a [`payload!`](crate::payload) or of a summary.
pub trait CellValue {
    /// The kind of its columns.
    const KIND: ColumnKind;
    /// Whether its cells may be empty.
    const IS_OPTIONAL: bool = false;

    /// The cell.
    fn cell(self) -> Cell;
}

impl CellValue for u32 {
    const KIND: ColumnKind = ColumnKind::Count;

    #[inline]
    fn cell(self) -> Cell {
        Cell::Count(self)
    }
}

impl CellValue for u64 {
    const KIND: ColumnKind = ColumnKind::Step;

    #[inline]
    fn cell(self) -> Cell {
        Cell::Step(self)
    }
}

impl CellValue for f64 {
    const KIND: ColumnKind = ColumnKind::Number;

    #[inline]
    fn cell(self) -> Cell {
        Cell::Number(self)
    }
}

impl CellValue for bool {
    const KIND: ColumnKind = ColumnKind::Flag;

    #[inline]
    fn cell(self) -> Cell {
        Cell::Flag(self)
    }
}

impl CellValue for String {
    const KIND: ColumnKind = ColumnKind::Word;

    fn cell(self) -> Cell {
        Cell::word(&self)
    }
}

impl<T: CellValue> CellValue for Option<T> {
    const KIND: ColumnKind = T::KIND;
    const IS_OPTIONAL: bool = true;

    #[inline]
    fn cell(self) -> Cell {
        self.map_or(Cell::Empty, T::cell)
    }
}

#[cfg(test)]
mod tests {
    use super::{Column, ColumnKind, UNITS, unit_of};

    #[test]
    fn units_stand_last_in_names() {
        for (name, unit) in [
            ("ft_fn_onset", Some("1")),
            ("velocity_m_per_s", Some("m/s")),
            ("displacement_m", Some("m")),
            ("onset_s", Some("s")),
            ("threshold_n", Some("N")),
            ("released_j", Some("J")),
            ("area_m2", Some("m2")),
            ("density_kg_per_m3", Some("kg/m3")),
            ("block", None),
            ("m", None),
        ] {
            assert_eq!(unit_of(name), unit, "{name}");
        }
        // No suffix is hidden by a shorter one before it.
        for (end, unit) in UNITS {
            assert_eq!(unit_of(end), Some(unit), "{end}");
        }
    }

    #[test]
    #[should_panic(expected = "must end in an SI unit")]
    fn numbers_without_a_unit_are_refused() {
        Column::new("slowness", ColumnKind::Number, "How slow it is.");
    }
}
