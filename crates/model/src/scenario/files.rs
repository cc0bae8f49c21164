//! The files that a scenario names: who opens them, and how their values become those of keys.
//!
//! A scenario that someone wrote may name files. One that a log or a plan holds has the values beside the names, and
//! its reader opens nothing: [`Scenario::resolve`] has nothing to open files with, and a name in a log is never passed
//! to what [`Scenario::resolve_with`] is given.

use std::io;
use std::path::Path;

use crate::scenario::Scenario;
use crate::scenario::defaults::unusable;
use crate::scenario::keys;
use crate::scenario::source::{LayerKind, Refusals, ScenarioError, ScenarioErrors};
use crate::scenario::text;

/// Opens the files that a scenario names.
pub trait Files {
    /// The text of a file.
    ///
    /// # Errors
    /// If there is none.
    fn text(&self, path: &Path) -> io::Result<String> {
        text::read(path)
    }

    /// The state in which the logged run named by `initial.from` was at `initial.at_s`, for a scenario that is
    /// resolved but for it, as the text of `initial.state`.
    ///
    /// # Errors
    /// If there is none, or it does not fit.
    fn state(&self, scenario: &Scenario) -> Result<String, UnfitState> {
        Err(UnfitState {
            key: "initial.from",
            problem: format!("{:?} is the log of a run, and logs are not read here", scenario.initial.from),
            accepted: "a scenario that holds the state, as `asperity scenario show` prints it".to_owned(),
        })
    }
}

/// Why a run cannot begin in the state of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnfitState {
    /// The key that is refused.
    pub key: &'static str,
    /// The error, with the value.
    pub problem: String,
    /// The accepted values.
    pub accepted: String,
}

/// Opens texts, and no logs.
pub struct Texts;

impl Files for Texts {}

/// The accepted values where no file is opened.
const VALUES: &str = "its values beside it, as in logs and plans, or a file of your own, as by --set";

impl ScenarioErrors {
    /// Whether it names a file whose values it lacks.
    pub fn lack_values(&self) -> bool {
        self.0.iter().any(|error| error.accepted.as_deref() == Some(VALUES))
    }
}

impl Refusals<'_> {
    /// What opens the file that a key names.
    ///
    /// # Errors
    /// If nothing may open it.
    pub(crate) fn files(&self, key: &str, name: &str) -> Result<&dyn Files, ScenarioError> {
        let is_logged = self.entries.values.get(key).is_none_or(|entry| entry.layer == LayerKind::Log);
        let problem = || format!("{name:?} is named, and its values are missing");
        self.files.filter(|_| !is_logged).ok_or_else(|| self.entries.error(key, problem(), VALUES))
    }

    /// Reads the lists of a file that a key names, each a value of a key as if it were written there, unless one of
    /// them is given; those of a log do not count beside a file that is named for this run.
    pub(crate) fn lists<const N: usize>(
        &mut self,
        (key, name): (&str, &str),
        lists: [(&str, &mut Vec<f64>); N],
        parse: impl FnOnce(&str) -> Result<[Vec<f64>; N], (usize, String)>,
        accepted: String,
    ) {
        let is_newer = lists.iter().all(|(list, _)| self.entries.overrides(key, list));
        if name.is_empty() || !(is_newer || lists.iter().all(|(_, values)| values.is_empty())) {
            return;
        }
        let text = self.files(key, name).map(|files| files.text(Path::new(name)));
        let read = text.and_then(|text| {
            let text = text.map_err(|error| format!("{name}: {error}"));
            let read = text
                .and_then(|text| parse(&text).map_err(|(line, problem)| format!("{name}:{line}: {problem}")));
            read.map_err(|problem| self.entries.error(key, problem, accepted))
        });
        match read {
            Ok(read) => {
                for ((list, values), read) in lists.into_iter().zip(read) {
                    let kind = keys::named(list).expect("it is a key").kind;
                    let wrong =
                        read.iter().enumerate().find_map(|(n, value)| Some((n, unusable(kind, *value)?)));
                    if let Some((n, (problem, accepted))) = wrong {
                        let problem = format!("{name}: {list}, number {}: {problem}", n + 1);
                        self.refuse(key, problem, accepted);
                    }
                    *values = read;
                }
            }
            Err(error) => self.errors.push(error),
        }
    }
}
