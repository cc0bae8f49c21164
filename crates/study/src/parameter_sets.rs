//! Describes the parameter sets of the runs of a study, and the source of each, in one line for people.

use std::collections::BTreeMap;

use asperity_model::ScenarioSource;
use asperity_model::scenario::keys::AS_STATED;

use crate::runs::Named;
use crate::study::{Grid, Study};

const KEY: &str = "parameter_set";

/// The source of a parameter set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum By {
    Study,
    Run,
    CommandLine,
    Axis,
    Scenario,
    Nothing,
}

impl By {
    fn words(self) -> &'static str {
        match self {
            By::Study => "set of the study",
            By::Run => "set of the run",
            By::CommandLine => "--set",
            By::Axis => "an axis",
            By::Scenario => "named by the scenario",
            By::Nothing => "the default, as nothing names a set",
        }
    }
}

impl Study {
    /// The parameter sets of its runs, with numbers of runs and sources:
    /// `as-coded in 19 runs (set of the study)`.
    pub fn parameter_sets(&self) -> String {
        let mut counts: BTreeMap<(String, By), u64> = BTreeMap::new();
        for (word, by) in self.runs.iter().map(|run| self.set_of(run)) {
            *counts.entry((word, by)).or_default() += 1;
        }
        for (word, by, count) in self.grid.iter().flat_map(Grid::parameter_sets) {
            *counts.entry((word, by)).or_default() += count;
        }
        let in_words = counts.iter().map(|((word, by), count)| {
            let runs = if *count == 1 { "run" } else { "runs" };
            format!("{word} in {count} {runs} ({})", by.words())
        });
        in_words.collect::<Vec<_>>().join(", ")
    }

    fn set_of(&self, run: &Named) -> (String, By) {
        let (first, last) = self.shared_sets;
        match assigned(&run.set) {
            Some((index, word)) if index < first => (word, By::Study),
            Some((index, word)) if index + last >= run.set.len() => (word, By::CommandLine),
            Some((_, word)) => (word, By::Run),
            None => written(&run.source()),
        }
    }
}

impl Grid {
    fn parameter_sets(&self) -> Vec<(String, By, u64)> {
        for axis in &self.axes {
            if let Some(place) = axis.keys.iter().position(|key| key.path == KEY) {
                let each = self.count() / axis.rows.len() as u64;
                return axis.rows.iter().map(|row| (row[place].to_string(), By::Axis, each)).collect();
            }
        }
        let (word, by) = match assigned(&self.set) {
            Some((_, word)) => (word, By::Study),
            None => written(&ScenarioSource::new(&self.scenario, &self.scenario_toml)),
        };
        vec![(word, by, self.count())]
    }
}

/// The last override that sets it, and its place among them.
fn assigned(set: &[String]) -> Option<(usize, String)> {
    let assigned = set.iter().enumerate().rev().find_map(|(index, assignment)| {
        let (key, word) = assignment.split_once('=')?;
        (key.trim() == KEY).then_some((index, word))
    });
    assigned.map(|(index, word)| (index, word.trim().trim_matches(['"', '\'']).to_owned()))
}

fn written(source: &ScenarioSource) -> (String, By) {
    match source.named_set() {
        Some(word) => (word, By::Scenario),
        None => (AS_STATED.to_owned(), By::Nothing),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::study::Study;

    #[test]
    fn the_sets_of_runs_are_counted_with_what_chose_them() {
        let run = |name: &str, scenario: &str, set: &str| {
            format!("[[run]]\nname = '{name}'\nscenario = '{scenario}'\nset = [{set}]\n")
        };
        let runs = run("a", "default", "")
            + &run("b", "slab", "'time.step_s=1e-7'")
            + &run("c", "default", "'parameter_set=\"as-stated\"', 'slider.blocks=20'");
        let of = |text: &str| Study::parse(&format!("title = 't'\n{text}"), Path::new(".")).unwrap();
        assert_eq!(
            of(&runs).parameter_sets(),
            "as-stated in 1 run (set of the run), as-stated in 1 run (named by the scenario), \
             as-stated in 1 run (the default, as nothing names a set)"
        );
        let coded = format!("set = ['parameter_set=as-coded', 'slider.width_m=0.01']\n{runs}");
        let mut study = of(&coded);
        assert_eq!(
            study.parameter_sets(),
            "as-coded in 2 runs (set of the study), as-stated in 1 run (set of the run)"
        );
        study.set(&["time.duration_s=1".to_owned(), "parameter_set=as-stated".to_owned()]);
        assert_eq!(study.parameter_sets(), "as-stated in 3 runs (--set)");
        let tilts = "[[axis]]\nkey = 'normal_load.tilt'\nvalues = [0, 0.5, 1]\n";
        let sets = "[[axis]]\nkey = 'parameter_set'\nvalues = ['as-coded', 'as-stated']\n";
        let grid = |text: &str| of(&format!("scenario = 'default'\n{text}{tilts}")).parameter_sets();
        assert_eq!(grid(sets), "as-coded in 3 runs (an axis), as-stated in 3 runs (an axis)");
        assert_eq!(grid("set = ['parameter_set=as-coded']\n"), "as-coded in 3 runs (set of the study)");
        assert_eq!(grid(""), "as-stated in 3 runs (the default, as nothing names a set)");
    }
}
