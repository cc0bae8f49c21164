//! What a key of a scenario is: its type, its range, its default.

use std::ops::Bound::{self, Excluded, Included, Unbounded};
use std::ops::RangeBounds;

use asperity_record::bounds::{LEAST_MAGNITUDE, MOST_MAGNITUDE};
use toml::Value;

use crate::law::laws::FrictionLaw;
use crate::scenario::choices::DriveKind;
use crate::scenario::suggest::suggestion;
use crate::scenario::typed::whole;
use Kind::{Count, Flag, Number, Numbers, Text, Word};

/// Most nodes upwards, and most across the sliding direction.
pub(crate) const MOST_ROWS: u64 = 10_000;

/// The word of `parameter_set` for the values of the thesis' program.
pub const AS_CODED: &str = "as-coded";
/// The word of `parameter_set` for the values of the thesis' text, the default.
pub const AS_STATED: &str = "as-stated";

/// Above 0.
pub(crate) const POSITIVE: Kind = Number(Excluded(0.0), Unbounded);
/// 0 or above.
pub(crate) const NOT_NEGATIVE: Kind = Number(Included(0.0), Unbounded);

/// One key of a scenario.
#[derive(Debug, Clone)]
pub struct Key {
    /// Dotted path, as in `slider.length_m`.
    pub path: &'static str,
    /// The symbol of the source thesis, or empty.
    pub symbol: &'static str,
    /// Its meaning, in a line or two.
    pub doc: &'static str,
    /// Type and accepted range.
    pub kind: Kind,
    /// Its defaults in the sets as-coded and as-stated; `None` if it must be written (only inside
    /// `[[recording.window]]`).
    pub defaults: Option<[Value; 2]>,
    /// What it needs to have another value than its default, each with the reason.
    pub needs: &'static [(Need, &'static str)],
}

/// What a key needs to have a meaning, besides a friction law that uses it ([`crate::law::laws::FrictionLaw::uses`]).
#[derive(Debug, Clone, Copy)]
pub enum Need {
    /// A chain, or a single block.
    Chain,
    /// Two blocks or more.
    Blocks,
    /// Nodes at the bottom alone: no slab, and no body.
    OneRow,
    /// Nodes above the bottom: a slab or a body.
    Rows,
    /// Contacts in one row: no sheet, and no body.
    OneRowAcross,
    /// Contacts over an area: a sheet or a body.
    RowsAcross,
    /// Nodes of a fault line in a medium.
    InMedium,
    /// One of these drives.
    Drives(&'static [DriveKind]),
    /// A law of which this holds.
    Laws(fn(FrictionLaw) -> bool),
}

/// Type and accepted range of a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A finite number within bounds.
    Number(Bound<f64>, Bound<f64>),
    /// A whole number from the first to the second, both included.
    Count(u64, u64),
    /// One of these words.
    Word(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
    /// Any text on one line, of at most this number of bytes.
    Text(usize),
    /// A list of finite numbers within bounds, empty or of a length defined elsewhere.
    Numbers(Bound<f64>, Bound<f64>),
}

impl Key {
    /// The default in the given parameter set (`true` for as-coded), if any.
    pub fn default_in(&self, as_coded_set: bool) -> Option<&Value> {
        self.defaults.as_ref().map(|[as_coded, as_stated]| if as_coded_set { as_coded } else { as_stated })
    }

    /// Whether it is a list of values by depth, of which there may be a single one, for all depths.
    pub fn is_by_depth(&self) -> bool {
        self.path.starts_with("medium.")
            && matches!(self.kind, Numbers(..))
            && self.path != "medium.profile_m"
    }

    /// Whether its default depends on the parameter set.
    pub(crate) fn follows_set(&self) -> bool {
        self.defaults.as_ref().is_some_and(|[as_coded, as_stated]| as_coded != as_stated)
    }
}

impl Kind {
    /// Whether a finite number is in range; false for kinds that are not numeric.
    pub fn accepts_number(&self, value: f64) -> bool {
        match self {
            Number(low, high) | Numbers(low, high) => value.is_finite() && (*low, *high).contains(&value),
            _ => false,
        }
    }

    /// A value as its key has it; `None` if it is not accepted.
    pub(crate) fn converted(&self, value: &Value) -> Option<Value> {
        let number = |value: &Value| any_number(value).filter(|number| self.accepts_number(*number));
        match *self {
            Number(..) => number(value).map(Value::Float),
            Numbers(..) => {
                let numbers = value.as_array()?.iter().map(|value| number(value).map(Value::Float));
                numbers.collect::<Option<_>>().map(Value::Array)
            }
            Count(low, high) => {
                let count = any_number(value).and_then(whole).filter(|count| (low..=high).contains(count));
                count.map(|count| Value::Integer(count as i64))
            }
            Word(words) => value.as_str().filter(|word| words.contains(word)).map(Value::from),
            Flag => value.as_bool().map(Value::Boolean),
            Text(most) => {
                let is_line = |text: &&str| !text.contains(['\n', '\r']) && text.len() <= most;
                value.as_str().filter(is_line).map(Value::from)
            }
        }
    }

    /// `; did you mean ...?` of the words of the key that a word may mean; empty if none is close enough.
    pub fn suggestion(&self, word: &str) -> String {
        let Word(words) = *self else { return String::new() };
        suggestion(word, words.iter().copied())
    }

    /// Whether a number is large enough to calculate with, see [`LEAST_MAGNITUDE`]. Lists of increments,
    /// block by block, may contain the rounding of a 0.
    pub(crate) fn is_usable(&self, value: f64) -> bool {
        let is_added = matches!(self, Numbers(low, _) if !matches!(low, Included(0.0) | Excluded(0.0)));
        let least = if is_added { 0.0 } else { LEAST_MAGNITUDE };
        value == 0.0 || (least..=MOST_MAGNITUDE).contains(&value.abs())
    }
}

/// A number, written with a decimal point or without.
pub(crate) fn any_number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
}

impl std::fmt::Display for Kind {
    /// The accepted values in words, for errors and comments.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Number(Unbounded, Unbounded) => f.write_str("any finite number"),
            Number(low, high) => {
                f.write_str("a number")?;
                match low {
                    Included(low) => write!(f, " from {low}")?,
                    Excluded(low) => write!(f, " above {low}")?,
                    Unbounded => {}
                }
                match high {
                    Included(high) => write!(f, " to {high}"),
                    Excluded(high) => write!(f, " below {high}"),
                    Unbounded => Ok(()),
                }
            }
            Count(low, high) => write!(f, "a whole number from {low} to {high}"),
            Word(words) => {
                let quoted: Vec<String> = words.iter().map(|word| format!("{word:?}")).collect();
                f.write_str(&quoted.join(" or "))
            }
            Flag => f.write_str("true or false"),
            Text(most) => write!(f, "text of up to {most} bytes on one line"),
            Numbers(low, high) => write!(f, "a list, each {}", Number(*low, *high)),
        }
    }
}
