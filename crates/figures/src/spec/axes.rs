//! What varies in a study, as far as its figures ask.

use asperity_record::Cell;

/// A value of a key or a column as a figure tells them apart: by its number, or as a word; none where it has no place.
pub fn place(value: &Cell) -> Option<Cell> {
    match value {
        Cell::Flag(_) | Cell::Word(_) => Some(Cell::Word(value.to_string().into())),
        // The two zeros are one value.
        number => number.number().filter(|n| n.is_finite()).map(|number| Cell::Number(number + 0.0)),
    }
}

/// What a text stands for, as in `key=value`.
pub fn read_place(text: &str) -> Cell {
    let text = text.trim();
    text.parse().map_or_else(|_| Cell::word(text.trim_matches(['"', '\''])), Cell::Number)
}

/// Keys that change together.
#[derive(Debug, Clone)]
pub struct Axis<'a> {
    /// The keys.
    pub keys: Vec<Key<'a>>,
    /// Whether a curve through its points, one after the other, means something: not where several
    /// keys are drawn by chance or come from a table.
    pub joined: bool,
}

/// A key that varies.
#[derive(Debug, Clone)]
pub struct Key<'a> {
    /// As in a scenario, `slider.length_m`.
    pub path: &'a str,
    /// Whether it holds numbers.
    pub is_number: bool,
    /// Whether the sweep spaces it by factors.
    pub log: bool,
    /// Its places ([`place`]), each once.
    pub values: Vec<Cell>,
}
