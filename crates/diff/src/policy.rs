//! Which differences are ignored, and which are allowed: a TOML file.
//!
//! ```toml
//! window_s = 1e-3            # how far from an onset its counterpart is looked for; this is the
//!                            # default between runs of one time step
//! max_shift_s = 1e-6         # no pair may be shifted farther, whatever else is allowed
//!
//! [columns.onset_s]          # a column of the event table
//! absolute = 1e-9            # in its unit
//! relative = 1e-12           # of the larger of the two values; the larger tolerance counts
//!
//! [allow]
//! shifted = true             # any number of them
//! split = 2                  # at most two in the whole diff
//! ruptures = true            # ruptures may differ where no slip event does
//! ```
//!
//! Columns that are not named must be exact, and classes not named are not allowed. Two kinds of columns
//! depend on others, and give no findings of their own: `event`, the number in the table, shifts by one
//! after every missing event; it is not compared and cannot have a tolerance. `onset_step` and `end_step`
//! are `onset_s` and `end_s` in units of the time step, and are compared only where those are equal.

use std::fmt::{self, Write};
use std::ops::Range;

use asperity_record::Role;
use asperity_record::bounds::check_toml;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::column::{COUNT, Column};
use crate::report::{Class, Counts, Exceeded};

/// Default window around an event's onset in which its counterpart is searched for, s. Precursors are some
/// 0.02 s apart in the runs of Chapter 5, and last up to 1e-2 s.
///
/// Runs of different time steps part within a few events, as chaotic ones do, and the shift of
/// the n-th event grows to the time between events. There [`between_events_s`] is the window.
pub const WINDOW_S: f64 = 1e-3;

/// The window for runs of different time steps: the time between events on average, on the side
/// that has fewer; never less than [`WINDOW_S`].
pub fn between_events_s([old, new]: [Spread; 2]) -> f64 {
    let between_s = |side: Spread| side.duration_s / (side.events.max(1) as f64);
    between_s(old).max(between_s(new)).max(WINDOW_S)
}

/// A time span and the number of events in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// How many.
    pub events: u64,
    /// How long their run is, s.
    pub duration_s: f64,
}

/// How far apart two cells of a column may be and still count as equal.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tolerance {
    /// In the column's unit.
    pub absolute: f64,
    /// Of the larger of the two magnitudes.
    pub relative: f64,
}

impl Tolerance {
    /// How far apart these two may be.
    pub fn between(self, old: f64, new: f64) -> f64 {
        // The magnitude of an empty cell is 0: NaN is no maximum.
        self.absolute.max(self.relative * old.abs().max(new.abs()).max(0.0))
    }
}

/// How many matches of a class are allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Allowed {
    /// Any number.
    Any,
    /// This many in the whole diff.
    UpTo(u64),
}

/// A policy, resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Policy {
    /// Window around an event's onset in which its counterpart is searched for, s; `None` for [`WINDOW_S`],
    /// or between runs of different time steps [`between_events_s`].
    pub window_s: Option<f64>,
    /// The farthest that a pair may be shifted, s; infinite if the policy sets no limit.
    pub max_shift_s: f64,
    /// Whether ruptures may differ where every slip event is identical. Where slip events differ, their
    /// rules decide, since both follow from the same switches.
    pub allows_ruptures: bool,
    pub(crate) tolerances: [Tolerance; COUNT],
    pub(crate) allowed: [Allowed; Class::ALL.len()],
}

impl Default for Policy {
    /// Exact, with no differences allowed.
    fn default() -> Policy {
        let mut allowed = [Allowed::UpTo(0); Class::ALL.len()];
        for class in Class::ALL.into_iter().filter(|class| class.is_no_difference()) {
            allowed[class as usize] = Allowed::Any;
        }
        Policy {
            window_s: None,
            max_shift_s: f64::INFINITY,
            allows_ruptures: false,
            tolerances: [Tolerance::default(); COUNT],
            allowed,
        }
    }
}

impl Policy {
    /// The tolerance of a column.
    pub fn tolerance(&self, column: Column) -> Tolerance {
        self.tolerances[column.place()]
    }

    /// How many of a class are allowed.
    pub fn allowed(&self, class: Class) -> Allowed {
        self.allowed[class as usize]
    }

    /// The classes with more matches than allowed. If a class allows none, each of its matches is refused
    /// individually.
    pub fn exceeded(&self, counts: &Counts) -> Vec<Exceeded> {
        let exceeded = |class| match self.allowed(class) {
            Allowed::UpTo(allowed) if allowed > 0 && counts[class] > allowed => {
                Some(Exceeded { class, allowed, found: counts[class] })
            }
            _ => None,
        };
        Class::ALL.into_iter().filter_map(exceeded).collect()
    }

    /// With another tolerance for a column.
    #[must_use]
    pub fn with_tolerance(mut self, column: Column, tolerance: Tolerance) -> Policy {
        self.tolerances[column.place()] = tolerance;
        self
    }

    /// With a class allowed.
    #[must_use]
    pub fn with_allowed(mut self, class: Class, allowed: Allowed) -> Policy {
        self.allowed[class as usize] = allowed;
        self
    }

    /// Reads a policy; `origin` is its file, for errors.
    ///
    /// # Errors
    /// All errors in it, each with file, line, column, key, value and the accepted values.
    pub fn parse(origin: &str, text: &str) -> Result<Policy, PolicyErrors> {
        let mut reader = Reader { origin, text, policy: Policy::default(), errors: Vec::new() };
        match check_toml(text).map(|()| DeTable::parse(text)) {
            Err(too_long) => reader.refuse(0..0, String::new(), too_long.to_string(), ""),
            Ok(Ok(table)) => reader.top(table.get_ref()),
            Ok(Err(error)) => reader.refuse(
                error.span().unwrap_or(0..0),
                String::new(),
                format!("not TOML: {}", error.message()),
                "",
            ),
        }
        if reader.errors.is_empty() {
            return Ok(reader.policy);
        }
        reader.errors.sort_by_key(|(start, _)| *start);
        Err(PolicyErrors(reader.errors.into_iter().map(|(_, error)| error).collect()))
    }

    /// The policy as TOML; [`Policy::parse`] restores it.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        let mut line = |line: String| {
            writeln!(text, "{line}").expect("writing to a string cannot fail");
        };
        if let Some(window_s) = self.window_s {
            line(format!("window_s = {}", number(window_s)));
        }
        if self.max_shift_s.is_finite() {
            line(format!("max_shift_s = {}", number(self.max_shift_s)));
        }
        for column in Column::all() {
            let Tolerance { absolute, relative } = self.tolerance(column);
            if absolute == 0.0 && relative == 0.0 {
                continue;
            }
            line(format!("\n[columns.{column}]"));
            for (key, value) in [("absolute", absolute), ("relative", relative)] {
                if value != 0.0 {
                    line(format!("{key} = {}", number(value)));
                }
            }
        }
        let allowed = Class::ALL.into_iter().filter(|class| !class.is_no_difference());
        let allowed: Vec<Class> = allowed.filter(|&class| self.allowed(class) != Allowed::UpTo(0)).collect();
        if !allowed.is_empty() || self.allows_ruptures {
            line("\n[allow]".to_owned());
        }
        if self.allows_ruptures {
            line(format!("{RUPTURES} = true"));
        }
        for class in allowed {
            line(match self.allowed(class) {
                Allowed::Any => format!("{} = true", class.name()),
                Allowed::UpTo(count) => format!("{} = {count}", class.name()),
            });
        }
        text
    }
}

/// As TOML wants its numbers: with a point or an exponent.
fn number(value: f64) -> String {
    format!("{value:e}")
}

/// One thing wrong with a policy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolicyError {
    /// File, line and column.
    pub place: String,
    /// Dotted key; empty where the file is no TOML.
    pub key: String,
    /// The problem, with the value.
    pub problem: String,
    /// The accepted values.
    pub accepted: String,
}

impl fmt::Display for PolicyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.place)?;
        if !self.key.is_empty() {
            write!(f, "{}: ", self.key)?;
        }
        f.write_str(&self.problem)?;
        if !self.accepted.is_empty() {
            write!(f, " (accepted: {})", self.accepted)?;
        }
        Ok(())
    }
}

/// Everything that is wrong with a policy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PolicyErrors(pub Vec<PolicyError>);

impl fmt::Display for PolicyErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lines: Vec<String> = self.0.iter().map(PolicyError::to_string).collect();
        f.write_str(&lines.join("\n"))
    }
}

impl std::error::Error for PolicyErrors {}

const TOP_KEYS: &str = "window_s, max_shift_s, columns, allow";
/// The key among the classes that lets ruptures differ.
const RUPTURES: &str = "ruptures";
const TOLERANCE_KEYS: &str = "absolute, relative";

struct Reader<'a> {
    origin: &'a str,
    text: &'a str,
    policy: Policy,
    /// Each with its position in the text.
    errors: Vec<(usize, PolicyError)>,
}

impl Reader<'_> {
    fn refuse(&mut self, span: Range<usize>, key: String, problem: String, accepted: impl Into<String>) {
        let before = &self.text[..span.start.min(self.text.len())];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |tail| tail.chars().count()) + 1;
        let place = format!("{}:{line}:{column}", self.origin);
        self.errors.push((span.start, PolicyError { place, key, problem, accepted: accepted.into() }));
    }

    fn unknown(&mut self, span: Range<usize>, key: String, accepted: impl Into<String>) {
        self.refuse(span, key, "there is no such key".to_owned(), accepted);
    }

    fn as_written(&self, value: &Spanned<DeValue<'_>>) -> String {
        self.text[value.span()].to_owned()
    }

    fn top(&mut self, table: &DeTable<'_>) {
        for (key, value) in table {
            match key.get_ref().as_ref() {
                "window_s" => {
                    if let Some(window_s) = self.number("window_s", value, f64::MIN_POSITIVE, "above 0") {
                        self.policy.window_s = Some(window_s);
                    }
                }
                "max_shift_s" => {
                    if let Some(shift_s) = self.number("max_shift_s", value, 0.0, "from 0") {
                        self.policy.max_shift_s = shift_s;
                    }
                }
                "columns" => match value.get_ref() {
                    DeValue::Table(columns) => self.columns(columns),
                    _ => self.no_table("columns", value),
                },
                "allow" => match value.get_ref() {
                    DeValue::Table(classes) => self.classes(classes),
                    _ => self.no_table("allow", value),
                },
                other => self.unknown(key.span(), other.to_owned(), TOP_KEYS),
            }
        }
    }

    fn no_table(&mut self, key: &str, value: &Spanned<DeValue<'_>>) {
        let problem = format!("{} is not accepted", self.as_written(value));
        self.refuse(value.span(), key.to_owned(), problem, "a table");
    }

    fn columns(&mut self, columns: &DeTable<'_>) {
        for (key, value) in columns {
            let path = format!("columns.{}", key.get_ref());
            let Some(column) = Column::named(key.get_ref()) else {
                let names = Column::all().filter(|column| column.role() != Role::Number);
                let names: Vec<&str> = names.map(Column::name).collect();
                let problem = "the event table has no such column".to_owned();
                self.refuse(key.span(), path, problem, names.join(", "));
                continue;
            };
            if column.role() == Role::Number {
                let problem = "is not compared, because it follows from the events before".to_owned();
                self.refuse(key.span(), path, problem, "a column that is");
                continue;
            }
            let DeValue::Table(table) = value.get_ref() else {
                self.no_table(&path, value);
                continue;
            };
            for (key, value) in table {
                let path = format!("{path}.{}", key.get_ref());
                let name = key.get_ref().as_ref();
                if !matches!(name, "absolute" | "relative") {
                    self.unknown(key.span(), path, TOLERANCE_KEYS);
                    continue;
                }
                if let Some(number) = self.number(&path, value, 0.0, "from 0") {
                    let tolerance = &mut self.policy.tolerances[column.place()];
                    *(if name == "absolute" { &mut tolerance.absolute } else { &mut tolerance.relative }) =
                        number;
                }
            }
        }
    }

    fn classes(&mut self, classes: &DeTable<'_>) {
        let choices = || {
            let names = Class::ALL.into_iter().filter(|class| !class.is_no_difference());
            names.map(Class::name).chain([RUPTURES]).collect::<Vec<&str>>().join(", ")
        };
        for (key, value) in classes {
            let path = format!("allow.{}", key.get_ref());
            if key.get_ref() == RUPTURES {
                match value.get_ref() {
                    DeValue::Boolean(allows) => self.policy.allows_ruptures = *allows,
                    _ => {
                        let problem = format!("{} is not accepted", self.as_written(value));
                        self.refuse(value.span(), path, problem, "true or false");
                    }
                }
                continue;
            }
            let class = Class::named(key.get_ref()).filter(|class| !class.is_no_difference());
            let Some(class) = class else {
                let problem = "there is no such class to allow".to_owned();
                self.refuse(key.span(), path, problem, choices());
                continue;
            };
            let allowed = match value.get_ref() {
                DeValue::Boolean(true) => Some(Allowed::Any),
                DeValue::Boolean(false) => Some(Allowed::UpTo(0)),
                DeValue::Integer(digits) => {
                    u64::from_str_radix(digits.as_str(), digits.radix()).ok().map(Allowed::UpTo)
                }
                _ => None,
            };
            match allowed {
                Some(allowed) => self.policy.allowed[class as usize] = allowed,
                None => {
                    let problem = format!("{} is not accepted", self.as_written(value));
                    self.refuse(value.span(), path, problem, "true, false, or a whole number from 0");
                }
            }
        }
    }

    fn number(&mut self, key: &str, value: &Spanned<DeValue<'_>>, least: f64, range: &str) -> Option<f64> {
        let number: Option<f64> = match value.get_ref() {
            DeValue::Float(digits) => digits.as_str().parse().ok(),
            DeValue::Integer(digits) => {
                i64::from_str_radix(digits.as_str(), digits.radix()).ok().map(|whole| whole as f64)
            }
            _ => None,
        };
        let number = number.filter(|number| number.is_finite() && *number >= least);
        if number.is_none() {
            let problem = format!("{} is not accepted", self.as_written(value));
            self.refuse(value.span(), key.to_owned(), problem, format!("a number {range}"));
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::{Allowed, Policy, Spread, Tolerance, WINDOW_S, between_events_s};
    use crate::column::Column;
    use crate::report::Class;

    #[test]
    fn a_policy_reads_back_as_it_was_written() {
        let policy =
            Policy { window_s: Some(2e-4), max_shift_s: 1.5e-7, allows_ruptures: true, ..Policy::default() }
                .with_tolerance(Column::ONSET_S, Tolerance { absolute: 0.1 + 0.2, relative: 0.0 })
                .with_tolerance(
                    Column::named("ft_fn_max").unwrap(),
                    Tolerance { absolute: 0.0, relative: 1e-12 },
                )
                .with_tolerance(Column::LAST_BLOCK, Tolerance { absolute: 1.0, relative: 0.5 })
                .with_allowed(Class::Split, Allowed::UpTo(3))
                .with_allowed(Class::Open, Allowed::Any);
        assert_eq!(Policy::parse("p.toml", &policy.to_toml()), Ok(policy));
        assert_eq!(Policy::parse("p.toml", ""), Ok(Policy::default()));
    }

    /// Makes the result symmetric in the sides.
    #[test]
    fn a_relative_tolerance_is_of_the_larger_value_on_whichever_side() {
        let tolerance = Tolerance { absolute: 0.5, relative: 0.25 };
        let between = |old, new| tolerance.between(old, new);
        assert_eq!([between(1.0, 4.0), between(4.0, 1.0), between(-4.0, 1.0)], [1.0; 3]);
        assert_eq!(between(1.0, 1.5), 0.5);
    }

    #[test]
    fn between_runs_of_two_time_steps_the_window_is_the_time_between_events() {
        let spread = |events, duration_s| Spread { events, duration_s };
        assert_eq!(between_events_s([spread(200, 5.0), spread(250, 5.0)]), 0.025);
        assert_eq!(between_events_s([spread(250, 5.0), spread(200, 5.0)]), 0.025);
        // Of a run without events, its length; of one that chatters, never less than usual.
        assert_eq!(between_events_s([spread(0, 5.0), spread(10, 5.0)]), 5.0);
        assert_eq!(between_events_s([spread(100_000, 5.0), spread(90_000, 5.0)]), WINDOW_S);
    }

    #[test]
    fn what_is_no_policy_is_refused_with_its_place() {
        let refused = |text: &str| Policy::parse("p.toml", text).unwrap_err().to_string();
        assert_eq!(
            refused("widow_s = 1"),
            "p.toml:1:1: widow_s: there is no such key (accepted: window_s, max_shift_s, columns, allow)"
        );
        assert_eq!(
            refused("\nwindow_s = 0"),
            "p.toml:2:12: window_s: 0 is not accepted (accepted: a number above 0)"
        );
        let text = refused("[columns.onset]\nabsolute = 1\n\n[columns.end_s]\nabsolut = 1\nrelative = -1");
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines[0].starts_with(
                "p.toml:1:10: columns.onset: the event table has no such column (accepted: onset_s, end_s, "
            ),
            "{text}"
        );
        assert!(
            lines.contains(
                &"p.toml:5:1: columns.end_s.absolut: there is no such key (accepted: absolute, relative)"
            ),
            "{text}"
        );
        assert!(
            lines.contains(
                &"p.toml:6:12: columns.end_s.relative: -1 is not accepted (accepted: a number from 0)"
            ),
            "{text}"
        );
        assert!(
            refused("[columns.event]\nabsolute = 1")
                .starts_with("p.toml:1:10: columns.event: is not compared")
        );
        assert_eq!(
            refused("[allow]\nmoved = true"),
            "p.toml:2:1: allow.moved: there is no such class to allow \
             (accepted: shifted, changed, split, merged, missing, extra, open, ruptures)"
        );
        assert_eq!(
            refused("[allow]\nruptures = 2"),
            "p.toml:2:12: allow.ruptures: 2 is not accepted (accepted: true or false)"
        );
        assert!(
            refused("[allow]\nsplit = -1").ends_with("(accepted: true, false, or a whole number from 0)")
        );
        assert!(refused("allow = 1").ends_with("allow: 1 is not accepted (accepted: a table)"));
        assert!(refused("[allow").starts_with("p.toml:1:"));
    }
}
