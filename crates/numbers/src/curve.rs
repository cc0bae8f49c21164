//! Curves of a run by name, as [`Number`](crate::Number) is for numbers: figures draw them, `export` writes
//! them as tables, and Python returns them as arrays.

use asperity_model::among;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Map, Value, json};

use crate::curve_list::CURVES;
use crate::required_data::RequiredData;
use crate::run_data::RunData;

/// What the points of a curve are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Simulated, one after the other.
    Measured,
    /// Simulated, of which one in so many is marked beside a line.
    Marked(usize),
    /// From theory.
    Theory,
    /// What contacts bear before they slide.
    Static,
    /// What contacts bear while they slide.
    Sliding,
    /// A line that guides the eye.
    Guide,
    /// No points: what its label says of the curves beside it.
    Remark,
}

impl Role {
    /// What it is called in tables.
    pub fn word(self) -> &'static str {
        match self {
            Role::Measured | Role::Marked(_) => "measured",
            Role::Theory => "theory",
            Role::Static => "static friction",
            Role::Sliding => "sliding friction",
            Role::Guide => "guide",
            Role::Remark => "remark",
        }
    }
}

/// A curve of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Which of the quantities upwards it shows, from 0.
    pub axis: usize,
    /// What it is called; empty if it is what its run is called.
    pub label: String,
    /// What its points are.
    pub role: Role,
    /// Its points, in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

impl Curve {
    /// A curve of the first quantity.
    pub(crate) fn new(role: Role, label: impl Into<String>, points: Vec<(f64, f64)>) -> Curve {
        Curve { axis: 0, label: label.into(), role, points }
    }

    /// It, of the second quantity.
    pub(crate) fn below(self) -> Curve {
        Curve { axis: 1, ..self }
    }

    pub(crate) fn remark(text: impl Into<String>) -> Curve {
        Curve::new(Role::Remark, text, Vec::new())
    }
}

/// What curves are asked for; each uses the keys that it names.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CurveKeys {
    /// A length in blocks.
    pub blocks: Option<u32>,
    /// Blocks, counted from 1.
    pub at_blocks: Vec<u32>,
    /// Instants, s.
    pub at_s: Vec<f64>,
    /// Whether states after the first precursors count as well.
    pub after_slips: bool,
    /// Where the time axis begins, s.
    pub from_s: Option<f64>,
    /// Where the time axis ends, s.
    pub to_s: Option<f64>,
    /// Time before a pulse, over `a / c`.
    pub before: Option<f64>,
    /// Time after a pulse, over `a / c`.
    pub after: Option<f64>,
    /// A block, counted from 1; by default the first.
    pub block: Option<u32>,
    /// What friction is drawn against.
    pub against: Against,
    /// Time between states in which nothing slides, s; by default 5 years.
    pub every_s: Option<f64>,
    /// Time between states while something slides, s; by default 1 s.
    pub event_every_s: Option<f64>,
}

impl CurveKeys {
    /// Whether a time is on the axis, s.
    pub fn is_from_to(&self, time_s: f64) -> bool {
        self.from_s.is_none_or(|from_s| time_s >= from_s) && self.to_s.is_none_or(|to_s| time_s <= to_s)
    }
}

/// What friction of a block is drawn against.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Against {
    /// Its velocity, with friction in steady sliding.
    #[default]
    Velocity,
    /// Its slip from the first record, over `D_c`, with the closed form for a step from the velocity of the first
    /// record to that of the last one in a stiff machine.
    Slip,
}

/// Curves of this name of any run.
#[derive(Debug)]
pub struct NamedCurves {
    /// Their name.
    pub name: &'static str,
    /// What they show.
    pub about: &'static str,
    /// The quantity across, with its unit; over an area columns take the place of blocks.
    pub x: &'static str,
    /// The quantities upwards, with their units.
    pub y: &'static [&'static str],
    /// The keys that they use, of [`CurveKeys`].
    pub keys: &'static [&'static str],
    pub(crate) required: fn(&CurveKeys) -> RequiredData,
    pub(crate) of: fn(&RunData, &CurveKeys) -> Result<Vec<Curve>, String>,
}

impl NamedCurves {
    /// All of them.
    pub const fn all() -> &'static [NamedCurves] {
        CURVES
    }

    /// Those of a name.
    ///
    /// # Errors
    /// In words, with the names that there are.
    pub fn find(name: &str) -> Result<&'static NamedCurves, String> {
        let names: Vec<&str> = CURVES.iter().map(|curves| curves.name).collect();
        let found = CURVES.iter().find(|curves| curves.name == name);
        found
            .ok_or_else(|| format!("there is no curve {name:?}{}", among(name, &names, "`asperity figures`")))
    }

    /// What the axis across is called for a run.
    pub fn across(&self, run: &RunData, keys: &CurveKeys) -> &'static str {
        match self.x {
            "block n" if run.of_one_row().is_none() => "column i",
            "t (s)" if run.unit_of_time().1 == "years" => "t (years)",
            "v (m/s)" if keys.against == Against::Slip || run.plan.friction.weakens() => "slip over D_c",
            across => across,
        }
    }

    /// Keys that are given as `KEY=VALUE`.
    ///
    /// # Errors
    /// In words, with what is accepted.
    pub fn keys_of(&self, set: &[String]) -> Result<CurveKeys, String> {
        let mut keys = Map::new();
        for assignment in set {
            let key = assignment.split('=').next().unwrap_or_default().trim();
            let parsed = match self.has(key) {
                Ok(()) => assignment.parse::<toml::Table>(),
                Err(problem) => return Err(problem),
            };
            let parsed = parsed.map_err(|error| format!("{assignment}: {error}"))?;
            keys.extend(parsed.into_iter().map(|(key, value)| (key, json!(value))));
        }
        self.read_keys(&keys)
    }

    /// Keys that are given as values.
    ///
    /// # Errors
    /// In words, with what is accepted.
    pub fn read_keys(&self, given: &Map<String, Value>) -> Result<CurveKeys, String> {
        given.keys().try_for_each(|key| self.has(key))?;
        let keys: Vec<&str> = given.keys().map(String::as_str).collect();
        serde_json::from_value(json!(given)).map_err(|error| format!("{}: {error}", keys.join(", ")))
    }

    fn has(&self, key: &str) -> Result<(), String> {
        let accepted = if self.keys.is_empty() { "none".to_owned() } else { self.keys.join(", ") };
        let refused = || format!("{key}: curves {} have no such key (accepted: {accepted})", self.name);
        if self.keys.contains(&key) { Ok(()) } else { Err(refused()) }
    }

    /// What they read of a run.
    pub fn required_data(&self, keys: &CurveKeys) -> RequiredData {
        (self.required)(keys)
    }

    /// The curves of a run.
    ///
    /// # Errors
    /// In words, what the run lacks.
    pub fn of(&self, run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
        let mut curves = (self.of)(run, keys)?;
        if self.x == "t (s)" {
            let (unit_s, _) = run.unit_of_time();
            curves.iter_mut().flat_map(|curve| &mut curve.points).for_each(|point| point.0 /= unit_s);
        }
        Ok(curves)
    }
}

/// Declares curves: name, the axis across and those upwards, the keys that they use, what they read of a
/// run, and their function.
macro_rules! curves {
    ($($(#[doc = $doc:literal])* $name:literal: $y:expr, over $x:literal, [$($key:literal)*], $required:expr, $of:expr;)+) => {
        /// All curves, by name.
        pub(crate) const CURVES: &[$crate::curve::NamedCurves] = &[$($crate::curve::NamedCurves {
            name: $name,
            about: concat!($($doc),*),
            x: $x,
            y: &$y,
            keys: &[$($key),*],
            required: $required,
            of: $of,
        }),+];
    };
}

pub(crate) use curves;
