//! The runs of a pipeline: single ones, and ensembles, runs that differ in the value of one key,
//! written as one table.
//!
//! The motion is chaotic: a time such as that of the first global slip is one draw among many,
//! and what can be compared with a number that someone states is a distribution. An ensemble is
//! how a pipeline asks for one: the same scenario, kicked by velocities that no experiment could
//! tell from rest.

use serde::Deserialize;

/// A run: a scenario and overrides.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunSpec {
    /// Its name, for files and for the rest of the pipeline.
    pub name: String,
    /// Name of a built-in scenario, or path of a file from the current folder.
    pub scenario: String,
    /// Overrides, `key=value`.
    #[serde(default)]
    pub set: Vec<String>,
}

/// Most members of an ensemble: a pipeline of a few lines shall not ask for runs without end.
const MOST_MEMBERS: usize = 1000;

/// Runs that differ in one key: `NAME-1`, `NAME-2` and so on. Where a list of runs names the
/// ensemble, it means all of them.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ensemble {
    /// The name, which those of its runs begin with.
    pub name: String,
    /// Name of a built-in scenario, or path of a file from the current folder.
    pub scenario: String,
    /// Overrides of all its runs, `key=value`.
    #[serde(default)]
    pub set: Vec<String>,
    /// The key in which they differ.
    pub key: String,
    /// Its values, one for each run.
    pub values: Vec<toml::Value>,
}

impl Ensemble {
    /// Checks that it has members, and not too many.
    ///
    /// # Errors
    /// In words: key, value and what would be accepted.
    pub(crate) fn check(&self) -> Result<(), String> {
        let count = self.values.len();
        if !(1..=MOST_MEMBERS).contains(&count) {
            return Err(format!(
                "ensemble {}: {count} values are not accepted (accepted: 1 to {MOST_MEMBERS})",
                self.name
            ));
        }
        Ok(())
    }

    /// The names of its runs.
    pub(crate) fn names(&self) -> impl Iterator<Item = String> {
        (1..=self.values.len()).map(|member| format!("{}-{member}", self.name))
    }

    /// Its runs.
    pub(crate) fn runs(&self) -> impl Iterator<Item = RunSpec> {
        self.names().zip(&self.values).map(|(name, value)| {
            let own = format!("{}={value}", self.key);
            RunSpec {
                name,
                scenario: self.scenario.clone(),
                set: self.set.iter().cloned().chain([own]).collect(),
            }
        })
    }
}

/// Puts the runs of ensembles in a list where it names these.
pub(crate) fn spell_out(ensembles: &[Ensemble], runs: &mut Vec<String>) {
    if !runs.iter().any(|name| ensembles.iter().any(|ensemble| ensemble.name == *name)) {
        return;
    }
    let named = |name: &String| ensembles.iter().find(|ensemble| ensemble.name == *name);
    *runs = std::mem::take(runs)
        .into_iter()
        .flat_map(|name| named(&name).map_or_else(|| vec![name], |ensemble| ensemble.names().collect()))
        .collect();
}

#[cfg(test)]
mod tests {
    use crate::pipeline::Pipeline;

    const TEXT: &str = r#"
title = "t"
first_global_slips = ["base", "kicked"]

[[run]]
name = "base"
scenario = "default"

[[ensemble]]
name = "kicked"
scenario = "default"
set = ["time.step_s=1e-7"]
key = "initial_velocity.amplitude_m_per_s"
values = [1e-9, 2e-9]

[[study]]
name = "s"
parameter = "initial_velocity.amplitude_m_per_s"
runs = ["base", "kicked"]
measures = ["precursor-count"]

[[figure.spread]]
file = "f.png"
panel = [{ label = "p", stated_s = 1.0, series = [{ label = "a", runs = ["base", "kicked"] }] }]

[[claim]]
about = "a"
quote = "q"
run = "base"
spread = ["kicked"]
measure = "precursor-count"
stated = "58"
as_stated = { run = "base", spread = ["kicked", "base"] }
"#;

    #[test]
    fn an_ensemble_is_its_runs_wherever_it_is_named() {
        let pipeline = Pipeline::parse(TEXT).unwrap();
        let runs: Vec<(&str, &[String])> =
            pipeline.run.iter().map(|run| (run.name.as_str(), run.set.as_slice())).collect();
        let set = |value: &str| {
            ["time.step_s=1e-7".to_owned(), format!("initial_velocity.amplitude_m_per_s={value}")]
        };
        assert_eq!(
            runs,
            [("base", &[][..]), ("kicked-1", &set("0.000000001")), ("kicked-2", &set("0.000000002"))]
        );
        let all = ["base", "kicked-1", "kicked-2"];
        assert_eq!(pipeline.first_global_slips, all);
        assert_eq!(pipeline.study[0].runs, all);
        assert_eq!(pipeline.figure.runs().collect::<Vec<_>>(), all);
        assert_eq!(pipeline.claim[0].spread, all[1..]);
        assert_eq!(pipeline.claim[0].as_stated.as_ref().unwrap().spread, ["kicked-1", "kicked-2", "base"]);
    }

    #[test]
    fn ensembles_that_make_no_sense_are_refused() {
        let refused = |old: &str, new: &str| Pipeline::parse(&TEXT.replace(old, new)).unwrap_err();
        assert_eq!(
            refused("values = [1e-9, 2e-9]", "values = []"),
            "ensemble kicked: 0 values are not accepted (accepted: 1 to 1000)"
        );
        assert_eq!(
            Pipeline::parse("title = \"t\"").unwrap_err(),
            "there are no runs (accepted: [[run]] or [[ensemble]])"
        );
        assert_eq!(refused("name = \"base\"", "name = \"kicked-2\""), "two runs are called kicked-2");
        assert_eq!(
            refused("name = \"base\"\nscenario", "name = \"kicked\"\nscenario"),
            "an ensemble and a run are both called kicked (accepted: different names)"
        );
        assert!(
            refused("spread = [\"kicked\"]", "spread = [\"kicker\"]").starts_with("there is no run kicker")
        );
    }
}
