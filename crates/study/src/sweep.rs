//! A sweep as written: a scenario, what varies, and what is stored of each run.

use std::collections::BTreeMap;
use std::path::Path;

use asperity_figures::{Figure, Figures};
use asperity_model::{builtin, text};
use asperity_record::bounds::check_toml;
use serde::{Deserialize, Serialize};

use crate::axis::{Axis, MOST_RUNS, Value, Written};

/// What is stored of each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// Its slip events.
    Events,
    /// Its ruptures.
    Ruptures,
    /// Its summary; always stored.
    Summary,
    /// Its run log, a file of its own.
    Log,
    /// Its run log, if the run fails.
    LogOfFailed,
}

impl Keep {
    fn all_but_logs() -> Vec<Keep> {
        vec![Keep::Events, Keep::Ruptures, Keep::Summary]
    }
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    title: String,
    scenario: String,
    #[serde(default)]
    set: Vec<String>,
    #[serde(default = "Keep::all_but_logs")]
    keep: Vec<Keep>,
    #[serde(default)]
    axis: Vec<Written>,
    #[serde(default)]
    figure: Figures,
}

/// Many runs of one scenario.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Its title, for headings.
    pub title: String,
    /// The name or path of the scenario of all runs.
    pub scenario: String,
    /// The text of that scenario.
    pub scenario_toml: String,
    /// Overrides in all runs, `key=value`.
    pub set: Vec<String>,
    /// What is stored of each run.
    pub keep: Vec<Keep>,
    /// What varies. Every point of each axis is combined with all points of the others; the last
    /// axis varies fastest.
    pub axes: Vec<Axis>,
    /// The figures of its tables.
    pub figures: Vec<Figure>,
}

/// Why a sweep cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {problem}")]
pub struct SweepError {
    file: String,
    problem: String,
}

impl Sweep {
    /// Reads a sweep. Files are looked up relative to its folder, scenarios first among the
    /// built-in ones.
    ///
    /// # Errors
    /// A message with file, key, value and what is accepted.
    pub fn read(path: &Path) -> Result<Sweep, SweepError> {
        let refused = |problem: String| SweepError { file: path.display().to_string(), problem };
        let text = text::read(path)
            .map_err(|error| refused(format!("sweep cannot be read: {error} (accepted: a TOML file)")))?;
        Sweep::parse(&text, path.parent().unwrap_or(Path::new("."))).map_err(refused)
    }

    fn parse(text: &str, folder: &Path) -> Result<Sweep, String> {
        check_toml(text).map_err(|too_long| too_long.to_string())?;
        let File { title, scenario, set, mut keep, axis, figure } =
            toml::from_str(text).map_err(|error| error.to_string())?;
        if axis.is_empty() {
            return Err("nothing varies (accepted: one or more [[axis]])".to_owned());
        }
        let axes = axis
            .iter()
            .enumerate()
            .map(|(n, axis)| axis.read(folder).map_err(|error| format!("axis {}: {error}", n + 1)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut set_by: BTreeMap<&str, usize> = BTreeMap::new();
        for (n, axis) in axes.iter().enumerate() {
            for key in &axis.keys {
                if let Some(other) = set_by.insert(key.path, n + 1) {
                    return Err(format!(
                        "{} varies on axes {other} and {} (accepted: on one axis)",
                        key.path,
                        n + 1
                    ));
                }
            }
        }
        for assignment in &set {
            let key = assignment.split('=').next().unwrap_or_default().trim();
            if let Some(axis) = set_by.get(key) {
                return Err(format!(
                    "set: {assignment} and axis {axis} both set {key} (accepted: one of them)"
                ));
            }
        }
        keep.push(Keep::Summary);
        keep.sort_unstable();
        keep.dedup();
        let scenario_toml = match builtin::find(&scenario) {
            Some(text) => text.to_owned(),
            None => text::read(&folder.join(&scenario)).map_err(|error| {
                format!(
                    "scenario {scenario}: neither a built-in one nor a file that can be read ({error}) (accepted: a \
                     name of `asperity scenario list`, or a path)"
                )
            })?,
        };
        let for_figures: Vec<_> = axes.iter().map(Axis::for_figures).collect();
        let figures = figure.understand(&for_figures, keep.contains(&Keep::Ruptures))?;
        let sweep = Sweep { title, scenario, scenario_toml, set, keep, axes, figures };
        match sweep.runs() {
            Some(_) => Ok(sweep),
            None => Err(format!("its axes make too many runs (accepted: up to {MOST_RUNS})")),
        }
    }

    fn runs(&self) -> Option<u64> {
        let count = |axis: &Axis| axis.rows.len() as u64;
        let runs = self.axes.iter().try_fold(1_u64, |runs, axis| runs.checked_mul(count(axis)))?;
        (runs <= MOST_RUNS).then_some(runs)
    }

    /// The number of its runs.
    pub fn count(&self) -> u64 {
        self.runs().expect("a sweep is read only if it has not too many runs")
    }

    /// The values of its keys in a run, counted from 0.
    pub fn values(&self, run: u64) -> Vec<Value> {
        let mut left = run;
        let mut points = Vec::with_capacity(self.axes.len());
        for axis in self.axes.iter().rev() {
            let count = axis.rows.len() as u64;
            points.push(&axis.rows[(left % count) as usize]);
            left /= count;
        }
        points.into_iter().rev().flatten().cloned().collect()
    }

    /// The keys that vary, in the order of their values.
    pub fn keys(&self) -> Vec<String> {
        self.axes.iter().flat_map(|axis| axis.keys.iter().map(|key| key.path.to_owned())).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::{Keep, Sweep};
    use crate::axis::Value;

    const TILTS: &str = "[[axis]]\nkey = 'normal_load.tilt'\nvalues = [-0.5, 0.5]\n";

    fn parse(text: &str) -> Result<Sweep, String> {
        Sweep::parse(&format!("title = 'Tilts'\nscenario = 'default'\n{text}"), Path::new("."))
    }

    #[test]
    fn every_point_meets_every_other_and_the_last_axis_runs_fastest() {
        let sweep =
            parse(&format!("{TILTS}[[axis]]\nkey = 'slider.blocks'\nvalues = [10, 20, 30]\n")).unwrap();
        assert_eq!((sweep.count(), sweep.keys().join(" ").as_str()), (6, "normal_load.tilt slider.blocks"));
        let blocks = |run| sweep.values(run)[1].clone();
        assert_eq!([0, 1, 2, 3].map(blocks), [10, 20, 30, 10].map(Value::Whole));
        assert_eq!(sweep.values(3)[0], Value::Number(0.5));
        assert_eq!(sweep.keep, [Keep::Events, Keep::Ruptures, Keep::Summary]);
    }

    #[test]
    fn contradictions_are_refused() {
        let many = "[[axis]]\nkey = 'time.duration_s'\nfrom = 1\nto = 2\ncount = 4000\n\
                    [[axis]]\nkey = 'slider.mass_kg'\nfrom = 1\nto = 2\ncount = 4000\n";
        for (text, problem) in [
            (String::new(), "nothing varies"),
            (format!("{TILTS}{TILTS}"), "normal_load.tilt varies on axes 1 and 2"),
            (format!("set = ['normal_load.tilt=0']\n{TILTS}"), "both set normal_load.tilt"),
            (many.to_owned(), "too many runs"),
            (format!("keep = ['movies']\n{TILTS}"), "unknown variant"),
            (format!("colour = 1\n{TILTS}"), "unknown field"),
            (
                format!("{TILTS}[[figure.family]]\nfile = 'a.png'\nx = 'normal_load.tilt'\ny = 'count'\n"),
                "figure.family \"a.png\": y = \"count\" is no number",
            ),
            (format!("keep = ['events']\n{TILTS}[[figure.lengths]]\nfile = 'a.png'\n"), "keeps no ruptures"),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
    }
}
