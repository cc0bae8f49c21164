//! What varies in a study, as far as its figures ask.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The value of a key in a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// Of a key of numbers.
    Number(f64),
    /// Of any other, as it is written.
    Word(String),
}

impl Place {
    /// What a text stands for, as in `key=value`.
    pub fn read(text: &str) -> Place {
        let text = text.trim();
        text.parse().map_or_else(|_| Place::Word(text.trim_matches(['"', '\'']).to_owned()), Place::Number)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Number(number) => write!(f, "{number}"),
            Place::Word(word) => f.write_str(word),
        }
    }
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
    /// Its values, each once.
    pub values: Vec<Place>,
}
