//! The runs of a study that have names: single ones, and ensembles, runs that differ in the value of one
//! key, written as one table.
//!
//! The motion is chaotic: a time such as that of the first global slip is one draw among many, and only a
//! distribution can be compared with a stated number. An ensemble gives one: the same scenario, started
//! with velocities that no experiment could distinguish from rest.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_model::{Files, Scenario, ScenarioSource, builtin, find};
use asperity_record::bounds::LONGEST_TOML_BYTES;
use asperity_run::study::Job;
use asperity_runlog::{RunReader, Topics};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The folder of the logs of runs that have names, within that of the study.
pub const FOLDER: &str = "runs";

/// A run: a scenario and overrides.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunSpec {
    /// Its name, for files and for the rest of the study.
    pub name: String,
    /// Name of a built-in scenario, or path of a file or a run log, relative to the folder of the study
    /// or to the current folder.
    pub scenario: String,
    /// Overrides, `key=value`, after those of the whole study.
    #[serde(default)]
    pub set: Vec<String>,
}

impl RunSpec {
    /// The run with the text of its scenario.
    pub(crate) fn read(&self, folder: &Path) -> Result<Named, String> {
        let RunSpec { name, scenario, set } = self.clone();
        let problem = |problem: String| format!("run {name}: {problem}");
        let (scenario_toml, of_log) = read_scenario(&scenario, folder).map_err(problem)?;
        Ok(Named { name, scenario, scenario_toml, of_log, set })
    }
}

/// Checks that a name is valid as a file name and is no number, since numbers denote runs over axes.
pub(crate) fn check_name(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || !name.chars().all(plain) {
        return Err(format!("run name {name:?} is no file name (accepted: letters, digits, - and _)"));
    }
    Ok(())
}

/// A run that has a name, as a plan stores it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Named {
    /// Its name, and that of its log in [`FOLDER`].
    pub name: String,
    /// The name or path of its scenario.
    pub scenario: String,
    /// The text of that scenario.
    pub scenario_toml: String,
    /// Whether the text is from a run log.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub of_log: bool,
    /// Overrides, `key=value`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
}

impl Named {
    /// Its scenario, resolved by this program, with what opens the files that it names.
    ///
    /// # Errors
    /// If it is refused, in words.
    pub fn resolve(&self, files: &dyn Files) -> Result<Scenario, String> {
        let Named { name, scenario, set, .. } = self;
        self.source().resolve(scenario, set, files).map_err(|errors| format!("run {name}: {errors}"))
    }

    /// Its scenario as written, without overrides.
    pub(crate) fn source(&self) -> ScenarioSource {
        let Named { scenario, scenario_toml, of_log, .. } = self;
        if *of_log {
            ScenarioSource::logged(format!("{scenario}: scenario.toml"), scenario_toml)
        } else if builtin::find(scenario).is_some() {
            ScenarioSource::new(format!("built-in {scenario}"), scenario_toml)
        } else {
            ScenarioSource::new(scenario, scenario_toml)
        }
    }

    /// The run, ready to be made, likewise.
    ///
    /// # Errors
    /// If its scenario is refused, in words.
    pub fn job(&self, files: &dyn Files) -> Result<Job, String> {
        Ok(Job { name: self.name.clone(), scenario: self.resolve(files)? })
    }

    /// The path of its log, in the folder of a study.
    pub fn log(&self, folder: &Path) -> PathBuf {
        folder.join(FOLDER).join(format!("{}.mcap", self.name))
    }
}

/// Reads a scenario: a built-in one, a file or a run log, looked up in a folder, then in the current one. Returns its text,
/// and whether that is from a run log.
pub(crate) fn read_scenario(name: &str, folder: &Path) -> Result<(String, bool), String> {
    let in_folder = folder.join(name);
    let is_built_in = builtin::find(name).is_some();
    let path = if !is_built_in && in_folder.is_file() { &in_folder } else { Path::new(name) };
    if !is_built_in
        && path.is_file()
        && let Ok(log) = RunReader::open(path, Topics::NONE)
    {
        return Ok((log.scenario_toml().to_owned(), true));
    }
    find(path).map(|text| (text, false)).map_err(|error| error.to_string())
}

/// Most members of an ensemble: a pipeline of a few lines shall not ask for runs without end.
const MOST_MEMBERS: usize = 1000;

/// Runs that differ in one key: `NAME-1`, `NAME-2` and so on. In a list of runs, the name of the ensemble
/// means all of them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ensemble {
    /// The name, with which the names of its runs begin.
    pub name: String,
    /// Name of a built-in scenario, or path of a file or a run log, relative to the folder of the study
    /// or to the current folder.
    pub scenario: String,
    /// Overrides of all its runs, `key=value`.
    #[serde(default)]
    pub set: Vec<String>,
    /// The key in which they differ.
    pub key: String,
    /// Its values, one for each run.
    #[schemars(with = "Vec<serde_json::Value>")]
    pub values: Vec<toml::Value>,
}

impl Ensemble {
    /// The names of its runs.
    fn names(&self) -> impl Iterator<Item = String> {
        (1..=self.values.len()).map(|member| format!("{}-{member}", self.name))
    }

    /// Its runs.
    fn runs(&self) -> impl Iterator<Item = RunSpec> {
        self.names().zip(&self.values).map(|(name, value)| {
            let own = format!("{}={value}", self.key);
            let set = self.set.iter().cloned().chain([own]).collect();
            RunSpec { name, scenario: self.scenario.clone(), set }
        })
    }

    /// Approximate bytes of its names when they are written out.
    fn bytes_of_names(&self) -> usize {
        self.values.len() * (self.name.len() + 5)
    }

    /// Approximate bytes of its runs when they are written out.
    fn bytes_of_runs(&self) -> usize {
        let each = self.scenario.len() + self.key.len() + self.set.iter().map(String::len).sum::<usize>();
        self.values.len() * each + self.bytes_of_names()
    }
}

/// Writes ensembles out, within the memory that the longest text without ensembles may need.
#[derive(Debug)]
pub(crate) struct SpellOut<'a> {
    ensembles: BTreeMap<&'a str, &'a Ensemble>,
    /// Number of bytes that may still be written.
    left: usize,
}

impl<'a> SpellOut<'a> {
    /// These ensembles, of different names.
    ///
    /// # Errors
    /// In words: key, value and the accepted values.
    pub(crate) fn new(ensembles: &'a [Ensemble]) -> Result<SpellOut<'a>, String> {
        let mut by_name = BTreeMap::new();
        for ensemble in ensembles {
            let (name, count) = (&ensemble.name, ensemble.values.len());
            if !(1..=MOST_MEMBERS).contains(&count) {
                return Err(format!(
                    "ensemble {name}: {count} values are not accepted (accepted: 1 to {MOST_MEMBERS})"
                ));
            }
            if by_name.insert(ensemble.name.as_str(), ensemble).is_some() {
                return Err(format!(
                    "two ensembles are called {name} (accepted: a name of its own for each)"
                ));
            }
        }
        Ok(SpellOut { ensembles: by_name, left: LONGEST_TOML_BYTES })
    }

    fn take(&mut self, bytes: usize) -> Result<(), String> {
        let left = self.left.checked_sub(bytes);
        self.left = left.ok_or_else(|| {
            format!(
                "ensembles and set: more than {LONGEST_TOML_BYTES} bytes when written out (accepted: fewer)"
            )
        })?;
        Ok(())
    }

    /// Puts the runs of the ensembles beside the others.
    ///
    /// # Errors
    /// If there would be too many, or a run has the name of an ensemble.
    pub(crate) fn add_runs(&mut self, runs: &mut Vec<RunSpec>) -> Result<(), String> {
        if let Some(run) = runs.iter().find(|run| self.ensembles.contains_key(run.name.as_str())) {
            return Err(format!(
                "an ensemble and a run are both called {} (accepted: different names)",
                run.name
            ));
        }
        for ensemble in self.ensembles.values().copied().collect::<Vec<_>>() {
            self.take(ensemble.bytes_of_runs())?;
            runs.extend(ensemble.runs());
        }
        Ok(())
    }

    /// Puts overrides before those of each run.
    ///
    /// # Errors
    /// If there would be too many.
    pub(crate) fn set_in_all(&mut self, set: &[String], runs: &mut [RunSpec]) -> Result<(), String> {
        let bytes: usize = set.iter().map(String::len).sum();
        self.take(bytes.saturating_mul(runs.len()))?;
        runs.iter_mut().for_each(|run| drop(run.set.splice(..0, set.iter().cloned())));
        Ok(())
    }

    /// Puts their names in a list that names the ensembles.
    ///
    /// # Errors
    /// If there would be too many.
    pub(crate) fn replace_in(&mut self, names: &mut Vec<String>) -> Result<(), String> {
        if !names.iter().any(|name| self.ensembles.contains_key(name.as_str())) {
            return Ok(());
        }
        let mut all = Vec::new();
        for name in std::mem::take(names) {
            match self.ensembles.get(name.as_str()).copied() {
                None => all.push(name),
                Some(ensemble) => {
                    self.take(ensemble.bytes_of_names())?;
                    all.extend(ensemble.names());
                }
            }
        }
        *names = all;
        Ok(())
    }
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
measures = ["precursor_event_count"]

[[figure.spread]]
file = "f.png"
panel = [{ label = "p", stated_s = 1.0, series = [{ label = "a", runs = ["base", "kicked"] }] }]

[[claim]]
about = "a"
quote = "q"
run = "base"
spread = ["kicked"]
measure = "precursor_event_count"
stated = "58"
as_stated = { run = "base", spread = ["kicked", "base"] }
"#;

    #[test]
    fn an_ensemble_is_its_runs_wherever_it_is_named() {
        let file = Pipeline::unchecked(TEXT).unwrap();
        let runs: Vec<(&str, &[String])> =
            file.run.iter().map(|run| (run.name.as_str(), run.set.as_slice())).collect();
        let set = |value: &str| {
            ["time.step_s=1e-7".to_owned(), format!("initial_velocity.amplitude_m_per_s={value}")]
        };
        assert_eq!(
            runs,
            [("base", &[][..]), ("kicked-1", &set("0.000000001")), ("kicked-2", &set("0.000000002"))]
        );
        let pipeline = Pipeline::parse(TEXT).unwrap();
        let all = ["base", "kicked-1", "kicked-2"];
        assert_eq!(pipeline.runs, all);
        assert_eq!(pipeline.first_global_slips, all);
        assert_eq!(pipeline.study[0].runs, all);
        assert_eq!(pipeline.figure.runs().collect::<Vec<_>>(), all);
        assert_eq!(pipeline.claim[0].spread, all[1..]);
        assert_eq!(pipeline.claim[0].as_stated.as_ref().unwrap().spread, ["kicked-1", "kicked-2", "base"]);
    }

    #[test]
    fn the_set_of_a_study_comes_before_that_of_each_run() {
        let text = TEXT.replace("title = \"t\"", "title = \"t\"\nset = [\"parameter_set=as-coded\"]");
        let file = Pipeline::unchecked(&text).unwrap();
        let sets: Vec<&[String]> = file.run.iter().map(|run| run.set.as_slice()).collect();
        let kick = |value: &str| format!("initial_velocity.amplitude_m_per_s={value}");
        let of_study = "parameter_set=as-coded".to_owned();
        let step = "time.step_s=1e-7".to_owned();
        assert_eq!(sets[0], std::slice::from_ref(&of_study));
        assert_eq!(sets[2], [of_study, step, kick("0.000000002")]);
    }

    #[test]
    fn ensembles_that_make_no_sense_are_refused() {
        let refused = |old: &str, new: &str| Pipeline::parse(&TEXT.replace(old, new)).unwrap_err();
        assert_eq!(
            refused("values = [1e-9, 2e-9]", "values = []"),
            "ensemble kicked: 0 values are not accepted (accepted: 1 to 1000)"
        );
        assert_eq!(
            refused("name = \"base\"", "name = \"kicked-2\""),
            "two runs are called kicked-2 (accepted: a name of its own for each)"
        );
        assert_eq!(
            refused("name = \"base\"\nscenario", "name = \"kicked\"\nscenario"),
            "an ensemble and a run are both called kicked (accepted: different names)"
        );
        assert!(
            refused("spread = [\"kicked\"]", "spread = [\"kicker\"]").starts_with("there is no run kicker")
        );
        // Short texts that ask for much: long overrides of each of a thousand, long lists of them.
        let many = format!("values = [{}]", "1,".repeat(1000));
        let long = format!("set = [\"{}\"]", "a".repeat(20_000));
        let told = "ensembles and set: more than 12582912 bytes when written out (accepted: fewer)";
        let text = TEXT.replace("values = [1e-9, 2e-9]", &many);
        assert!(Pipeline::parse(&text).is_ok());
        assert_eq!(Pipeline::parse(&text.replace("set = [\"time.step_s=1e-7\"]", &long)).unwrap_err(), told);
        let top = format!("title = \"t\"\nset = [\"{}\"]", "a".repeat(20_000));
        assert_eq!(Pipeline::parse(&text.replace("title = \"t\"", &top)).unwrap_err(), told);
        let lists = format!("runs = [{}]", "\"kicked\",".repeat(2000));
        assert_eq!(
            Pipeline::parse(&text.replace("runs = [\"base\", \"kicked\"]", &lists)).unwrap_err(),
            told
        );
    }
}
