//! The runs of a study that have names: single ones, and ensembles, runs that differ in the values of keys,
//! written as one table.
//!
//! The motion is chaotic: a time such as that of the first global slip is one draw among many, and only a
//! distribution can be compared with a stated number. An ensemble gives one: the same scenario, started
//! with velocities that no experiment could distinguish from rest.

use std::path::{Path, PathBuf};

use asperity_model::scenario::builtin;
use asperity_model::{Files, Scenario, ScenarioSource, find};
use asperity_record::bounds::LONGEST_TOML_BYTES;
use asperity_record::counted;
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
    /// Keys in which the runs of an ensemble differ.
    #[serde(default)]
    pub keys: Vec<String>,
    /// An ensemble: for each run a list with a value for each of `keys`, or of a single one the value itself. Its runs
    /// are `NAME-1`, `NAME-2` and so on; or, where `name` contains `{}`, what stands first in each list takes its place.
    #[serde(default)]
    #[schemars(with = "Vec<serde_json::Value>")]
    pub values: Vec<toml::Value>,
}

impl RunSpec {
    /// The runs that it stands for, each by its name and the overrides that are its own.
    fn members(&self) -> Result<Vec<(String, Vec<String>)>, String> {
        let RunSpec { name, keys, values, .. } = self;
        let refused = |problem: String| Err(format!("run {name}: {problem}"));
        if keys.is_empty() && values.is_empty() {
            return Ok(vec![(name.clone(), Vec::new())]);
        }
        if !(1..=MOST_MEMBERS).contains(&values.len()) {
            return refused(format!(
                "{} values are not accepted (accepted: 1 to {MOST_MEMBERS})",
                values.len()
            ));
        }
        let names_are_given = name.contains(OWN);
        let cells = keys.len() + usize::from(names_are_given);
        let mut members = Vec::new();
        for (number, value) in (1..).zip(values) {
            let row = value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice);
            if row.len() != cells {
                return refused(format!(
                    "values = {value}: {} (accepted: {cells}, {})",
                    counted(row.len() as u64, "value"),
                    if names_are_given {
                        "what stands for {} in its name and one for each of keys"
                    } else {
                        "one for each of keys"
                    }
                ));
            }
            let (own, row) = row.split_at(usize::from(names_are_given));
            let name = match own {
                [toml::Value::String(own)] => name.replace(OWN, own),
                [own] => name.replace(OWN, &own.to_string()),
                _ => format!("{name}-{number}"),
            };
            members.push((name, keys.iter().zip(row).map(|(key, value)| format!("{key}={value}")).collect()));
        }
        Ok(members)
    }

    /// The run with the text of its scenario.
    pub(crate) fn read(&self, folder: &Path) -> Result<Named, String> {
        let RunSpec { name, scenario, set, .. } = self.clone();
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

/// What the text of a name stands for that a member gives.
const OWN: &str = "{}";

/// Writes runs and the lists that name them out, within the memory that the longest text may need.
#[derive(Debug)]
pub(crate) struct SpellOut {
    /// Number of bytes that may still be written.
    left: usize,
}

impl SpellOut {
    pub(crate) fn new() -> SpellOut {
        SpellOut { left: LONGEST_TOML_BYTES }
    }

    fn take(&mut self, bytes: usize) -> Result<(), String> {
        let left = self.left.checked_sub(bytes);
        self.left = left.ok_or_else(|| {
            format!(
                "runs, lists and set: more than {LONGEST_TOML_BYTES} bytes when written out (accepted: fewer)"
            )
        })?;
        Ok(())
    }

    /// Puts the runs of each ensemble in its place, and these overrides before those of each run.
    ///
    /// # Errors
    /// In words: key, value and what is accepted.
    pub(crate) fn runs(&mut self, set: &[String], written: Vec<RunSpec>) -> Result<Vec<RunSpec>, String> {
        let mut all = Vec::new();
        for run in written {
            let common: Vec<String> = set.iter().chain(&run.set).cloned().collect();
            let bytes = run.scenario.len() + run.name.len() + common.iter().map(String::len).sum::<usize>();
            let members = run.members()?;
            self.take(members.len().saturating_mul(bytes))?;
            all.extend(members.into_iter().map(|(name, own)| RunSpec {
                name,
                scenario: run.scenario.clone(),
                set: common.iter().cloned().chain(own).collect(),
                keys: Vec::new(),
                values: Vec::new(),
            }));
        }
        Ok(all)
    }

    /// Replaces each name with `*` in a list by the names of these runs that it matches, in their order.
    ///
    /// # Errors
    /// If it matches none, or there would be too many.
    pub(crate) fn names(&mut self, runs: &[String], names: &mut Vec<String>) -> Result<(), String> {
        if !names.iter().any(|name| name.contains('*')) {
            return Ok(());
        }
        for name in std::mem::take(names) {
            if !name.contains('*') {
                names.push(name);
                continue;
            }
            let matching: Vec<&String> = runs.iter().filter(|run| matches(&name, run)).collect();
            if matching.is_empty() {
                return Err(format!(
                    "no run is called {name} (accepted: names of [[run]], with * for any letters)"
                ));
            }
            self.take(matching.iter().map(|run| run.len()).sum())?;
            names.extend(matching.into_iter().cloned());
        }
        Ok(())
    }
}

/// Whether a name fits a pattern, in which each `*` is any letters or none. The first place of each part is as good as
/// any later one, so that the work grows with the name alone.
fn matches(pattern: &str, name: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('*') else { return pattern == name };
    let (middle, end) = rest.rsplit_once('*').unwrap_or(("", rest));
    let between = name.strip_prefix(start).and_then(|name| name.strip_suffix(end));
    between.is_some_and(|mut left| {
        middle.split('*').filter(|part| !part.is_empty()).all(|part| {
            let found = left.split_once(part);
            left = found.map_or("", |(_, behind)| behind);
            found.is_some()
        })
    })
}

#[cfg(test)]
mod tests {
    use crate::pipeline::Pipeline;

    const TEXT: &str = r#"
title = "t"
first_global_slips = ["base", "perturbed-*"]

[[run]]
name = "base"
scenario = "default"

[[run]]
name = "perturbed"
scenario = "default"
set = ["time.step_s=1e-7"]
keys = ["initial_velocity.amplitude_m_per_s"]
values = [1e-9, 2e-9]

[[study]]
name = "s"
parameter = "initial_velocity.amplitude_m_per_s"
runs = ["base", "perturbed-*"]
measures = ["precursor_event_count"]

[[figure.study]]
file = "f.png"
parameter = "time.step_s"
parameter_label = "Δt (s)"
logarithmic = true
measure = "first_global_event_onset_s"
measure_label = "t of first global slip (s)"
panel = [{ label = "p", stated = 1.0, series = [{ label = "a", runs = ["base", "perturbed-*"] }] }]

[[claim]]
about = "a"
quote = "q"
run = "base"
spread = ["perturbed-*"]
measure = "precursor_event_count"
stated = "58"
as_stated = { run = "base", spread = ["perturbed-*", "base"] }
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
            [("base", &[][..]), ("perturbed-1", &set("0.000000001")), ("perturbed-2", &set("0.000000002"))]
        );
        let pipeline = Pipeline::parse(TEXT).unwrap();
        let all = ["base", "perturbed-1", "perturbed-2"];
        assert_eq!(pipeline.runs, all);
        assert_eq!(pipeline.first_global_slips, all);
        assert_eq!(pipeline.study[0].runs, all);
        assert_eq!(pipeline.figure.runs().collect::<Vec<_>>(), all);
        assert_eq!(pipeline.claim[0].spread, all[1..]);
        assert_eq!(
            pipeline.claim[0].as_stated.as_ref().unwrap().spread,
            ["perturbed-1", "perturbed-2", "base"]
        );
    }

    #[test]
    fn each_star_is_any_letters_or_none() {
        for pattern in ["tau*-eta0", "*", "tau10-eta0", "*10*", "t*0-*0", "tau10-eta0*", "*a*-*t*0", "**"] {
            assert!(super::matches(pattern, "tau10-eta0"), "{pattern}");
        }
        for pattern in ["tau*-eta", "au*", "tau10-eta0-*", "*0*0*0*", "tau10-eta0*0", "", "*eta*tau*"] {
            assert!(!super::matches(pattern, "tau10-eta0"), "{pattern}");
        }
        // Thousands of stars take no longer than the name is.
        assert!(!super::matches(&"*a".repeat(5_000), &"a".repeat(4_000)));
    }

    #[test]
    fn a_row_of_values_names_its_run_and_sets_each_key() {
        let rows = "keys = [\"time.duration_s\", \"friction.law\"]\nvalues = [[\"a-1\", 0.5, \"rigid\"], [2, 1, \"rigid\"]]";
        let text = TEXT.replace("name = \"perturbed\"", "name = \"k{}\"").replace("perturbed-*", "k*");
        let text =
            text.replace("keys = [\"initial_velocity.amplitude_m_per_s\"]\nvalues = [1e-9, 2e-9]", rows);
        let file = Pipeline::unchecked(&text).unwrap();
        let own = |run: usize| (file.run[run].name.as_str(), file.run[run].set[1..].join(" "));
        assert_eq!(own(1), ("ka-1", "time.duration_s=0.5 friction.law=\"rigid\"".to_owned()));
        assert_eq!(own(2), ("k2", "time.duration_s=1 friction.law=\"rigid\"".to_owned()));
        assert_eq!(file.claim[0].spread, ["ka-1", "k2"]);
    }

    #[test]
    fn a_table_is_written_once_for_each_of_its_members() {
        let each = |members: &str| TEXT.replace("about = \"a\"", &format!("each = {members}"));
        let text = each("[{ about = \"a\" }, { about = \"b\", run = \"perturbed-2\", stated = \"3\" }]");
        let claims = Pipeline::parse(&text).unwrap().claim;
        let of = |n: usize| {
            (claims[n].about.as_str(), claims[n].run.as_str(), claims[n].stated.as_deref().unwrap())
        };
        assert_eq!((claims.len(), of(0), of(1)), (2, ("a", "base", "58"), ("b", "perturbed-2", "3")));
        for (members, problem) in [
            ("3", "line 32, column 8: each: it is no list (accepted: a list of tables)"),
            ("[3]", "line 32, column 8: each: a member is no table (accepted: a list of tables)"),
            ("[{ about = 3 }]", "line 32, column 19: about = 3 is not accepted (accepted: a text in quotes)"),
            (
                "[{ abuot = \"a\" }]",
                "line 32, column 11: abuot: unknown key; did you mean about? (accepted: about, quote, at, of, run and 14 \
                 others, see asperity figures and docs/studies.md)",
            ),
        ] {
            assert_eq!(Pipeline::parse(&each(members)).unwrap_err(), problem);
        }
        // Two overrides: those of all, then those of the member.
        let set = "set = [\"time.step_s=1e-7\"]\neach = [{ set = [\"slider.blocks=3\"] }]";
        let file = Pipeline::unchecked(&TEXT.replace("set = [\"time.step_s=1e-7\"]", set)).unwrap();
        assert_eq!(file.run[1].set[..2], ["time.step_s=1e-7", "slider.blocks=3"]);
        let long = format!("[{}]", "{},".repeat(400_000));
        let said = Pipeline::parse(
            &each(&long).replace("quote = \"q\"", &format!("quote = \"{}\"", "q".repeat(100))),
        );
        let end = "each: more than 12582912 bytes when written out (accepted: fewer)";
        assert!(said.clone().unwrap_err().ends_with(end), "{:.200}", said.unwrap_err());
    }

    #[test]
    fn the_set_of_a_study_comes_before_that_of_each_run() {
        let text = TEXT.replace("title = \"t\"", "title = \"t\"\nset = [\"parameter_set=as-coded\"]");
        let file = Pipeline::unchecked(&text).unwrap();
        let sets: Vec<&[String]> = file.run.iter().map(|run| run.set.as_slice()).collect();
        let speed = |value: &str| format!("initial_velocity.amplitude_m_per_s={value}");
        let of_study = "parameter_set=as-coded".to_owned();
        let step = "time.step_s=1e-7".to_owned();
        assert_eq!(sets[0], std::slice::from_ref(&of_study));
        assert_eq!(sets[2], [of_study, step, speed("0.000000002")]);
    }

    #[test]
    fn ensembles_that_make_no_sense_are_refused() {
        let refused = |old: &str, new: &str| Pipeline::parse(&TEXT.replace(old, new)).unwrap_err();
        assert_eq!(
            refused("values = [1e-9, 2e-9]", "values = []"),
            "run perturbed: 0 values are not accepted (accepted: 1 to 1000)"
        );
        assert_eq!(
            refused("values = [1e-9, 2e-9]", "values = [1e-9, [1, 2]]"),
            "run perturbed: values = [1, 2]: 2 values (accepted: 1, one for each of keys)"
        );
        assert_eq!(
            refused("name = \"perturbed\"", "name = \"perturbed-{}\""),
            "run perturbed-{}: values = 0.000000001: 1 value (accepted: 2, what stands for {} in its name and one for \
             each of keys)"
        );
        assert_eq!(
            refused("name = \"base\"", "name = \"perturbed-2\""),
            "two runs are called perturbed-2 (accepted: a name of its own for each)"
        );
        assert_eq!(
            refused("spread = [\"perturbed-*\"]", "spread = [\"perturbing-*\"]"),
            "no run is called perturbing-* (accepted: names of [[run]], with * for any letters)"
        );
        // Short texts that ask for much: long overrides of each of a thousand, long lists of them.
        let many = format!("values = [{}]", "1,".repeat(1000));
        let long = format!("set = [\"{}\"]", "a".repeat(20_000));
        let told = "runs, lists and set: more than 12582912 bytes when written out (accepted: fewer)";
        let text = TEXT.replace("values = [1e-9, 2e-9]", &many);
        assert!(Pipeline::parse(&text).is_ok());
        assert_eq!(Pipeline::parse(&text.replace("set = [\"time.step_s=1e-7\"]", &long)).unwrap_err(), told);
        let top = format!("title = \"t\"\nset = [\"{}\"]", "a".repeat(20_000));
        assert_eq!(Pipeline::parse(&text.replace("title = \"t\"", &top)).unwrap_err(), told);
        let lists = format!("runs = [{}]", "\"perturbed-*\",".repeat(2000));
        assert_eq!(
            Pipeline::parse(&text.replace("runs = [\"base\", \"perturbed-*\"]", &lists)).unwrap_err(),
            told
        );
    }
}
