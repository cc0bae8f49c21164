//! What a sweep will run: made once, and never changed.
//!
//! A plan is a file of JSON lines: what all runs have in common, a line for each run, and last a
//! BLAKE3 hash over all of it, by which an edited plan is known.

use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_model::{Energies, Scenario, ScenarioSource};
use asperity_record::{RECORD_SCHEMA_VERSION, RunHeader};
use asperity_run::{CODE_VERSION, Task, at_once};
use asperity_study_figures::Figure;
use serde::{Deserialize, Serialize};

use crate::axis::Value;
use crate::sweep::{Keep, Sweep};

/// What a plan is called in its folder.
pub const FILE: &str = "plan.ndjson";

/// The version of the form of plans and segments.
const FORMAT: u32 = 1;

/// What all runs have in common.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Common {
    format: u32,
    /// What the sweep is about.
    pub title: String,
    /// The scenario's name or path when the plan was made.
    pub scenario: String,
    /// Its text then, which is what is run.
    pub scenario_toml: String,
    /// Overrides in all runs.
    pub set: Vec<String>,
    /// What is kept of each run.
    pub keep: Vec<Keep>,
    /// The keys that vary.
    pub keys: Vec<String>,
    /// The version of step records and events.
    pub record_schema_version: u32,
    /// The code that the plan was made by and that runs it.
    pub code_version: String,
    /// What is drawn of its tables.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
}

/// A run of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Its number, from 1.
    pub run: u64,
    /// The values of the keys that vary.
    pub values: Vec<Value>,
    /// What it is called in logs: a hash of scenario, record schema and code.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Why the scenario refuses these values, if it does; such a run is recorded and not made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// What is accepted and may surprise, when the plan is made; it is not kept.
    #[serde(skip)]
    pub warnings: Vec<String>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct End {
    rows: u64,
    blake3: String,
}

/// A plan, read or made.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// What all runs have in common.
    pub common: Common,
    /// The runs; run `n` stands at `n - 1`.
    pub rows: Vec<Row>,
    /// A hash of all of it.
    pub hash: String,
}

/// A plan that cannot be made, read or followed.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// Scenarios refuse some of the combinations, or a figure asks for what no run has.
    #[error("{problem}")]
    Refused {
        /// Which, why, and what is accepted.
        problem: String,
    },
    /// There is none, or it is none.
    #[error("{}: {problem}", path.display())]
    NoPlan {
        /// Where it was looked for.
        path: PathBuf,
        /// What was found, and what is accepted.
        problem: String,
    },
    /// It cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The key by which runs have energies or not.
const ENERGIES: &str = "recording.energies";

/// Most refused runs that are told one by one.
const MOST_TOLD: usize = 5;

impl Plan {
    /// The plan of a sweep, on several threads. Combinations that the scenario refuses are an error,
    /// or recorded as such if they are to be skipped.
    ///
    /// # Errors
    /// If the scenario refuses combinations, or all of them, or a figure shows energies that no run has.
    pub fn of(sweep: &Sweep, skip_refused: bool, jobs: Option<NonZeroUsize>) -> Result<Plan, PlanError> {
        let common = Common {
            format: FORMAT,
            title: sweep.title.clone(),
            scenario: sweep.scenario.clone(),
            scenario_toml: sweep.scenario_toml.clone(),
            set: sweep.set.clone(),
            keep: sweep.keep.clone(),
            keys: sweep.keys(),
            record_schema_version: RECORD_SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            figures: sweep.figures.clone(),
        };
        let numbers: Vec<u64> = (0..sweep.count()).collect();
        let rows = at_once(&numbers, jobs, |number| {
            let values = sweep.values(*number);
            let run = number + 1;
            Ok::<_, PlanError>(match common.resolve(&values) {
                Ok(scenario) => Row {
                    run,
                    values,
                    id: Some(Task::new(&scenario).header().run_id),
                    refused: None,
                    warnings: scenario.warnings(),
                },
                Err(reason) => Row { run, values, id: None, refused: Some(reason), warnings: Vec::new() },
            })
        })?;
        let refused: Vec<&Row> = rows.iter().filter(|row| row.refused.is_some()).collect();
        if !refused.is_empty() && (!skip_refused || refused.len() == rows.len()) {
            let mut problem = format!("{} of {} runs are refused", refused.len(), rows.len());
            for row in refused.iter().take(MOST_TOLD) {
                let values = common.assignments(&row.values).join(" ");
                let reason = row.refused.as_deref().unwrap_or_default();
                problem.push_str(&format!("\nrun {}, {values}: {reason}", row.run));
            }
            if refused.len() > MOST_TOLD {
                problem.push_str(&format!("\nand {} more", refused.len() - MOST_TOLD));
            }
            problem.push_str(
                "\n(accepted: other values, or --skip-refused to leave those out that are refused)",
            );
            return Err(PlanError::Refused { problem });
        }
        let text = lines(&common, &rows);
        let plan = Plan { hash: hash(&text), common, rows };
        match plan.energy_of_none(&plan.common.figures) {
            Some(problem) => Err(PlanError::Refused { problem }),
            None => Ok(plan),
        }
    }

    /// Which of some figures shows energies although no run of the plan has any, if one does, in words.
    pub fn energy_of_none(&self, figures: &[Figure]) -> Option<String> {
        let energies = figures.iter().filter_map(|figure| Some((figure, figure.energies().next()?)));
        let (figure, (what, energy)) = energies.into_iter().next()?;
        let most = if self.common.keys.iter().any(|key| key == ENERGIES) { self.rows.len() } else { 1 };
        let mut made = self.rows.iter().filter(|row| row.refused.is_none()).take(most);
        let has_any = made.any(|row| {
            let scenario = self.common.resolve(&row.values);
            scenario.is_ok_and(|scenario| scenario.recording.energies == Energies::EveryRecord)
        });
        (!has_any).then(|| {
            format!(
                "figure.{} {:?}: {what} = {energy:?} is an energy, and by {ENERGIES} = \"none\" no run has any \
                 (accepted: another number, or {ENERGIES} = \"every-record\")",
                figure.word(),
                figure.file
            )
        })
    }

    /// Writes it into a folder that holds none.
    ///
    /// # Errors
    /// If there is one, or the system refuses.
    pub fn write(&self, folder: &Path, inputs: Inputs) -> Result<(), PlanError> {
        let mut text = lines(&self.common, &self.rows);
        let end = End { rows: self.rows.len() as u64, blake3: self.hash.clone() };
        text.push_str(&json(&end));
        Ok(FileSet::write_one(&folder.join(FILE), text, Existing::Refuse, inputs)?)
    }

    /// Reads the plan of a folder.
    ///
    /// # Errors
    /// If there is none, or it is not as it was written.
    pub fn read(folder: &Path) -> Result<Plan, PlanError> {
        let path = folder.join(FILE);
        let no_plan = |problem: &str| PlanError::NoPlan { path: path.clone(), problem: problem.to_owned() };
        let text = asperity_files::read(&path)
            .and_then(|bytes| String::from_utf8(bytes).map_err(io::Error::other))
            .map_err(|error| {
                no_plan(&format!("there is no plan ({error}) (accepted: a folder of `asperity sweep plan`)"))
            })?;
        let edited = || no_plan("it is not as it was written (accepted: a plan nobody edited)");
        let split = text.trim_end_matches('\n').rfind('\n').ok_or_else(edited)?;
        let (body, end) = text.split_at(split + 1);
        let end: End = serde_json::from_str(end).map_err(|_| edited())?;
        if end.blake3 != hash(body) {
            return Err(edited());
        }
        let (first, rows) = body.split_once('\n').ok_or_else(edited)?;
        let common: Common = serde_json::from_str(first).map_err(|error| {
            no_plan(&format!(
                "a plan of another form: {error} (accepted: one by this version of the program)"
            ))
        })?;
        let rows =
            rows.lines().map(serde_json::from_str).collect::<Result<Vec<Row>, _>>().map_err(|_| edited())?;
        Ok(Plan { common, rows, hash: end.blake3 })
    }

    /// Makes sure that this program makes the runs as they are planned.
    ///
    /// # Errors
    /// If the plan was made by other code.
    pub fn check_code(&self, folder: &Path) -> Result<(), PlanError> {
        if self.common.code_version == CODE_VERSION && self.common.format == FORMAT {
            return Ok(());
        }
        Err(PlanError::NoPlan {
            path: folder.join(FILE),
            problem: format!(
                "a plan by code version {} and this program is {CODE_VERSION} (accepted: the program that made it, or \
                 a new plan in another folder)",
                self.common.code_version
            ),
        })
    }

    /// The scenario of a run, and what the run says of itself.
    ///
    /// # Errors
    /// If it is not what was planned, as when a file that the scenario names has changed.
    pub fn scenario(&self, row: &Row) -> Result<(Scenario, RunHeader), String> {
        let scenario = self.common.resolve(&row.values)?;
        let header = Task::new(&scenario).header();
        match &row.id {
            Some(planned) if *planned == header.run_id => Ok((scenario, header)),
            _ => {
                Err("its scenario is another now than when it was planned; a file that it names has changed"
                    .to_owned())
            }
        }
    }
}

impl Common {
    /// What a run sets, as `key=value`.
    pub fn assignments(&self, values: &[Value]) -> Vec<String> {
        self.keys.iter().zip(values).map(|(key, value)| format!("{key}={value}")).collect()
    }

    /// The scenario with these values, as this program understands it.
    ///
    /// # Errors
    /// If it refuses them.
    pub fn resolve(&self, values: &[Value]) -> Result<Scenario, String> {
        let source = ScenarioSource::new(&self.scenario, &self.scenario_toml);
        let assignments = self.set.iter().cloned().chain(self.assignments(values));
        let source = assignments.fold(source, |source, assignment| source.with_override(&assignment));
        Scenario::resolve(&source).map_err(|errors| errors.to_string())
    }
}

fn lines(common: &Common, rows: &[Row]) -> String {
    let mut text = json(common);
    rows.iter().for_each(|row| text.push_str(&json(row)));
    text
}

fn json(value: &impl Serialize) -> String {
    let mut line = serde_json::to_string(value).expect("texts and finite numbers are JSON");
    line.push('\n');
    line
}

fn hash(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}
