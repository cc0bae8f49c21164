//! What a key of a scenario is: its type, its range, its default.

use asperity_record::bounds::{LEAST_MAGNITUDE, MOST_MAGNITUDE};

use self::Default::{BySet, Is};
use crate::law::laws::FrictionLaw;
use crate::scenario::choices::DriveKind;
use crate::scenario::typed::whole;
use Bound::{Excluding, Including, Open};
use Kind::{Count, Flag, Number, Numbers, Text, Word};

/// Most nodes upwards, and most across the sliding direction.
pub(crate) const MOST_ROWS: u64 = 10_000;

/// The word of `parameter_set` for the values of the thesis' program.
pub const AS_CODED: &str = "as-coded";
/// The word of `parameter_set` for the values of the thesis' text, the default.
pub const AS_STATED: &str = "as-stated";

/// The words of `parameter_set`, in the order of [`Default::BySet`].
pub const PARAMETER_SETS: &[&str] = &[AS_CODED, AS_STATED];

/// Above 0.
pub(crate) const POSITIVE: Kind = Number(Excluding(0.0), Open);
/// 0 or above.
pub(crate) const NOT_NEGATIVE: Kind = Number(Including(0.0), Open);

/// One key of a scenario.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Dotted path, as in `slider.length_m`.
    pub path: &'static str,
    /// The symbol of the source thesis, or empty.
    pub symbol: &'static str,
    /// Its meaning, in a line or two.
    pub doc: &'static str,
    /// Type and accepted range.
    pub kind: Kind,
    /// The default value.
    pub default: Default,
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
    /// One of these drives.
    Drives(&'static [DriveKind]),
    /// A law of which this holds.
    Laws(fn(FrictionLaw) -> bool),
}

/// Type and accepted range of a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A finite number within bounds.
    Number(Bound, Bound),
    /// A whole number from the first to the second, both included.
    Count(u64, u64),
    /// One of these words.
    Word(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
    /// Any text on one line, of at most this number of bytes.
    Text(usize),
    /// A list of finite numbers within bounds, empty or of a length defined elsewhere.
    Numbers(Bound, Bound),
}

/// One end of a range of numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// No bound on this side; the value must be finite all the same.
    Open,
    /// The bound itself is accepted.
    Including(f64),
    /// The bound itself is refused.
    Excluding(f64),
}

/// The default of a key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Default {
    /// One value for both parameter sets.
    Is(Value),
    /// The values of the thesis' program, and those of its text.
    BySet {
        /// In the set `as-coded`.
        as_coded: Value,
        /// In the set `as-stated`.
        as_stated: Value,
    },
    /// Must be written (only inside `[[recording.window]]`).
    Required,
}

/// A default value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Of a [`Kind::Number`].
    Number(f64),
    /// Of a [`Kind::Count`].
    Count(u64),
    /// Of a [`Kind::Word`] or [`Kind::Text`].
    Text(&'static str),
    /// Of a [`Kind::Flag`].
    Flag(bool),
    /// Of a [`Kind::Numbers`]: the empty list.
    NoNumbers,
}

impl Key {
    /// Its value in the tables of a scenario; `None` where a default is left out.
    pub(crate) fn value_in<'a>(&self, scenario: &'a toml::Value) -> Option<&'a toml::Value> {
        self.path.split('.').try_fold(scenario, |value, part| value.get(part))
    }

    /// The default in the given parameter set (`true` for as-coded), if any.
    pub fn default_in(&self, as_coded_set: bool) -> Option<Value> {
        match self.default {
            Is(value) => Some(value),
            BySet { as_coded, as_stated } => Some(if as_coded_set { as_coded } else { as_stated }),
            Default::Required => None,
        }
    }
}

impl Value {
    /// As a value of TOML.
    pub(crate) fn to_toml(self) -> toml::Value {
        match self {
            Value::Number(value) => toml::Value::Float(value),
            Value::Count(value) => toml::Value::Integer(value as i64),
            Value::Text(text) => toml::Value::String(text.to_owned()),
            Value::Flag(flag) => toml::Value::Boolean(flag),
            Value::NoNumbers => toml::Value::Array(Vec::new()),
        }
    }
}

impl Kind {
    /// Whether a finite number is in range; false for kinds that are not numeric.
    pub fn accepts_number(&self, value: f64) -> bool {
        match self {
            Number(low, high) | Numbers(low, high) => {
                value.is_finite()
                    && match *low {
                        Open => true,
                        Including(bound) => value >= bound,
                        Excluding(bound) => value > bound,
                    }
                    && match *high {
                        Open => true,
                        Including(bound) => value <= bound,
                        Excluding(bound) => value < bound,
                    }
            }
            _ => false,
        }
    }

    /// A value as its key has it; `None` if it is not accepted.
    pub(crate) fn converted(&self, value: &toml::Value) -> Option<toml::Value> {
        let any_number = |value: &toml::Value| match value {
            toml::Value::Integer(number) => Some(*number as f64),
            value => value.as_float(),
        };
        let number = |value: &toml::Value| any_number(value).filter(|number| self.accepts_number(*number));
        match *self {
            Number(..) => number(value).map(toml::Value::Float),
            Numbers(..) => {
                let numbers = value.as_array()?.iter().map(|value| number(value).map(toml::Value::Float));
                numbers.collect::<Option<_>>().map(toml::Value::Array)
            }
            Count(low, high) => {
                let count = any_number(value).and_then(whole).filter(|count| (low..=high).contains(count));
                count.map(|count| toml::Value::Integer(count as i64))
            }
            Word(words) => value.as_str().filter(|word| words.contains(word)).map(toml::Value::from),
            Flag => value.as_bool().map(toml::Value::Boolean),
            Text(most) => {
                let is_line = |text: &&str| !text.contains(['\n', '\r']) && text.len() <= most;
                value.as_str().filter(is_line).map(toml::Value::from)
            }
        }
    }

    /// Whether a number is large enough to calculate with, see [`LEAST_MAGNITUDE`]. Lists of increments,
    /// block by block, may contain the rounding of a 0.
    pub(crate) fn is_usable(&self, value: f64) -> bool {
        let is_added = matches!(self, Numbers(low, _) if !matches!(low, Including(0.0) | Excluding(0.0)));
        let least = if is_added { 0.0 } else { LEAST_MAGNITUDE };
        value == 0.0 || (least..=MOST_MAGNITUDE).contains(&value.abs())
    }
}

impl std::fmt::Display for Kind {
    /// The accepted values in words, for errors and comments.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Number(low, high) => match (low, high) {
                (Open, Open) => f.write_str("any finite number"),
                (Excluding(low), Open) => write!(f, "a number above {low}"),
                (Including(low), Open) => write!(f, "a number from {low}"),
                _ => {
                    f.write_str("a number")?;
                    match low {
                        Including(low) => write!(f, " from {low}")?,
                        Excluding(low) => write!(f, " above {low}")?,
                        Open => {}
                    }
                    match high {
                        Including(high) => write!(f, " to {high}"),
                        Excluding(high) => write!(f, " below {high}"),
                        Open => Ok(()),
                    }
                }
            },
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
