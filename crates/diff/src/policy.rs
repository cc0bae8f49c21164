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

use std::collections::BTreeMap;
use std::fmt::Write;

use asperity_model::scenario::text::Lines;
use asperity_model::scenario::typed;
use asperity_record::Role;
use asperity_record::bounds::check_toml;
use serde::Deserialize;
use toml::Spanned;

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
    /// The first thing wrong in it, with file, line, column, key, value and the accepted values.
    pub fn parse(origin: &str, text: &str) -> Result<Policy, String> {
        let read = check_toml(text)
            .map_err(|too_long| (0, too_long.to_string()))
            .and_then(|()| Policy::of(typed::parse(text, "docs/run-logs.md")?));
        read.map_err(|(at, problem)| format!("{origin}:{}: {problem}", Lines::of(text).place(text, at)))
    }

    /// The policy that is written, or a place and what is wrong there.
    fn of(written: Written) -> Result<Policy, (usize, String)> {
        let number = |key: &str, value: &Spanned<f64>, is_accepted: fn(f64) -> bool, range: &str| {
            let number = *value.get_ref();
            let problem = || format!("{key} = {number} is not accepted (accepted: a number {range})");
            let is_accepted = number.is_finite() && is_accepted(number);
            is_accepted.then_some(number).ok_or_else(|| (value.span().start, problem()))
        };
        let mut policy = Policy::default();
        if let Some(value) = &written.window_s {
            policy.window_s = Some(number("window_s", value, |window_s| window_s > 0.0, "above 0")?);
        }
        if let Some(value) = &written.max_shift_s {
            policy.max_shift_s = number("max_shift_s", value, |shift_s| shift_s >= 0.0, "from 0")?;
        }
        let at = |name: &Spanned<String>| name.span().start;
        for (name, tolerance) in &written.columns {
            let is_compared = |column: &Column| column.role() != Role::Number;
            let Some(column) = Column::named(name.get_ref()).filter(is_compared) else {
                let names: Vec<&str> = Column::all().filter(is_compared).map(Column::name).collect();
                let problem = "no column of the event table that is compared";
                let key = name.get_ref();
                return Err((at(name), format!("columns.{key}: {problem} (accepted: {})", names.join(", "))));
            };
            let part = |part: &str, value: &Option<Spanned<f64>>| match value {
                Some(value) => {
                    number(&format!("columns.{column}.{part}"), value, |part| part >= 0.0, "from 0")
                }
                None => Ok(0.0),
            };
            let absolute = part("absolute", &tolerance.absolute)?;
            policy = policy.with_tolerance(
                column,
                Tolerance { absolute, relative: part("relative", &tolerance.relative)? },
            );
        }
        for (name, value) in &written.allow {
            let (key, is_ruptures) = (name.get_ref(), name.get_ref() == RUPTURES);
            let class = Class::named(key).filter(|class| !class.is_no_difference());
            if class.is_none() && !is_ruptures {
                let names = Class::ALL.into_iter().filter(|class| !class.is_no_difference()).map(Class::name);
                let names: Vec<&str> = names.chain([RUPTURES]).collect();
                let problem = format!("allow.{key}: no class to allow (accepted: {})", names.join(", "));
                return Err((at(name), problem));
            }
            let allowed = match value.get_ref() {
                toml::Value::Boolean(true) => Some(Allowed::Any),
                toml::Value::Boolean(false) => Some(Allowed::UpTo(0)),
                toml::Value::Integer(count) if !is_ruptures => u64::try_from(*count).ok().map(Allowed::UpTo),
                _ => None,
            };
            match (allowed, class) {
                (Some(allowed), Some(class)) => policy = policy.with_allowed(class, allowed),
                (Some(allowed), None) => policy.allows_ruptures = allowed == Allowed::Any,
                (None, _) => {
                    let or_count =
                        if is_ruptures { "true or false" } else { "true, false, or a whole number from 0" };
                    let value_of = value.get_ref();
                    let problem = format!("allow.{key} = {value_of} is not accepted (accepted: {or_count})");
                    return Err((value.span().start, problem));
                }
            }
        }
        Ok(policy)
    }

    /// The policy as TOML; [`Policy::parse`] restores it.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        let mut line = |line: String| {
            writeln!(text, "{line}").expect("writing to a string cannot fail");
        };
        // TOML wants numbers with a point or an exponent.
        if let Some(window_s) = self.window_s {
            line(format!("window_s = {window_s:e}"));
        }
        if self.max_shift_s.is_finite() {
            line(format!("max_shift_s = {:e}", self.max_shift_s));
        }
        for column in Column::all() {
            let Tolerance { absolute, relative } = self.tolerance(column);
            if absolute == 0.0 && relative == 0.0 {
                continue;
            }
            line(format!("\n[columns.{column}]"));
            for (key, value) in [("absolute", absolute), ("relative", relative)] {
                if value != 0.0 {
                    line(format!("{key} = {value:e}"));
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

/// The key among the classes that lets ruptures differ.
const RUPTURES: &str = "ruptures";

/// A policy as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    window_s: Option<Spanned<f64>>,
    max_shift_s: Option<Spanned<f64>>,
    #[serde(default)]
    columns: BTreeMap<Spanned<String>, WrittenTolerance>,
    #[serde(default)]
    allow: BTreeMap<Spanned<String>, Spanned<toml::Value>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenTolerance {
    absolute: Option<Spanned<f64>>,
    relative: Option<Spanned<f64>>,
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
        let refused = |text: &str| Policy::parse("p.toml", text).unwrap_err();
        for (text, problem) in [
            ("widow_s = 1", "p.toml:1:1: widow_s: unknown key; did you mean window_s? (accepted: "),
            ("\nwindow_s = 0", "p.toml:2:12: window_s = 0 is not accepted (accepted: a number above 0)"),
            (
                "max_shift_s = nan",
                "p.toml:1:15: max_shift_s = NaN is not accepted (accepted: a number from 0)",
            ),
            (
                "[columns.onset]\nabsolute = 1",
                "p.toml:1:10: columns.onset: no column of the event table that is compared (accepted: onset_s, end_s, ",
            ),
            (
                "[columns.event]\nabsolute = 1",
                "p.toml:1:10: columns.event: no column of the event table that is compared",
            ),
            (
                "[columns.end_s]\nabsolut = 1",
                "p.toml:2:1: absolut: unknown key; did you mean absolute? (accepted: ",
            ),
            (
                "[columns.end_s]\nrelative = -1",
                "p.toml:2:12: columns.end_s.relative = -1 is not accepted (accepted: a number from 0)",
            ),
            (
                "[allow]\nmoved = true",
                "p.toml:2:1: allow.moved: no class to allow (accepted: shifted, changed, split, merged, missing, extra, open, ruptures)",
            ),
            (
                "[allow]\nruptures = 2",
                "p.toml:2:12: allow.ruptures = 2 is not accepted (accepted: true or false)",
            ),
            (
                "[allow]\nsplit = -1",
                "p.toml:2:9: allow.split = -1 is not accepted (accepted: true, false, or a whole number from 0)",
            ),
            ("allow = 1", "p.toml:1:9: allow = 1 is not accepted (accepted: a "),
            ("[allow", "p.toml:1:"),
        ] {
            let said = refused(text);
            assert!(said.starts_with(problem), "{text}: {said}");
        }
    }
}
