//! The plan of a study: made once, and never changed.
//!
//! A plan is a file of JSON lines: the common part of all runs, a line per run, and finally a BLAKE3 hash
//! of everything before, which detects edits. What would make a command fail later, or write outside of the
//! folder, is refused also where somebody has computed the hash anew.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Read};
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};

use asperity_figures::{Figure, Kind};
use asperity_files::{Existing, FileSet, Inputs, at_once, create_folder};
use asperity_model::scenario::files::UnfitState;
use asperity_model::scenario::keys::Key;
use asperity_model::{Files, Preview, Scenario, ScenarioSource, Warning};
use asperity_record::bounds::{LONGEST_COMMON_BYTES, LONGEST_PLAN_BYTES};
use asperity_record::{Cell, Parts, RECORD_SCHEMA_VERSION, RunHeader};
use asperity_run::{CODE_VERSION, Derived, OpenedForStudy, Task};
use serde::{Deserialize, Serialize};

use crate::axis::{check_value, key_of, names, runs_at, settled, spelled};
use crate::error::StudyError;
use crate::file::Keep;
use crate::refine::resampled;
use crate::runs::{Named, check_name};
use crate::study::{Grid, Study};

/// The file name of a plan.
pub const FILE: &str = "plan.ndjson";

/// The version of the format.
const FORMAT: u32 = 2;

/// The common part of all runs.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Common {
    format: u32,
    /// The title of the study.
    pub title: String,
    /// The name or path, when the plan was made, of the scenario that the axes vary.
    pub scenario: String,
    /// The text of that scenario at that time, which is the one used.
    pub scenario_toml: String,
    /// Overrides in all runs over the axes.
    pub set: Vec<String>,
    /// The data stored of each run over the axes.
    pub keep: Vec<Keep>,
    /// The keys that vary.
    pub keys: Vec<String>,
    /// The version of step records and events.
    pub record_schema_version: u32,
    /// The code version that made the plan and must make the runs.
    pub code_version: String,
    /// The figures of its tables.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    /// The named runs, which are the last rows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub runs: Vec<Named>,
    /// The text of the study, if it requests more than the tables of runs over axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study_toml: Option<String>,
    /// The files that its scenarios name.
    #[serde(default, skip_serializing_if = "is_empty")]
    pub files: Held,
    /// The scenario with the overrides in all runs, parsed on first use.
    #[serde(skip)]
    source: OnceLock<ScenarioSource>,
}

fn is_empty(held: &Held) -> bool {
    held.texts.lock().is_ok_and(|texts| texts.is_empty())
}

/// A run of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Its number, from 1.
    pub run: u64,
    /// The values of the keys that vary; none for a named run.
    pub values: Vec<Cell>,
    /// Its id in logs: a hash of scenario, record schema and code.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Why the scenario refuses these values, if it does; such a run is recorded and not made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
    /// Warnings of the scenario when the plan is made; not stored.
    #[serde(skip)]
    pub warnings: Vec<Warning>,
    /// Predictions about the run at the time of planning; not stored.
    #[serde(skip)]
    pub preview: Option<Preview>,
}

/// The last line.
#[derive(Serialize)]
struct End<'a> {
    rows: usize,
    blake3: &'a str,
}

/// A plan.
#[derive(Debug)]
pub struct Plan {
    /// The common part of all runs.
    pub common: Common,
    /// The runs; run `n` is at index `n - 1`.
    pub rows: Vec<Row>,
    /// A hash of the plan.
    pub hash: String,
}

/// Most refused runs that are listed.
const MOST_TOLD: usize = 5;

impl Plan {
    /// Plans a study, on several threads. Combinations that the scenario refuses are an error, or
    /// recorded as refused with `skip_refused`; runs that have names are not left out.
    ///
    /// # Errors
    /// If a scenario refuses combinations, or all of them, or a run that has a name.
    pub fn of(study: &Study, skip_refused: bool, jobs: Option<NonZeroUsize>) -> Result<Plan, String> {
        let none = Grid::default();
        let grid = study.grid.as_ref().unwrap_or(&none);
        let mut common = Common {
            format: FORMAT,
            title: study.pipeline.title.clone(),
            scenario: grid.scenario.clone(),
            scenario_toml: grid.scenario_toml.clone(),
            set: grid.set.clone(),
            keep: grid.keep.clone(),
            keys: grid.keys(),
            record_schema_version: RECORD_SCHEMA_VERSION,
            code_version: CODE_VERSION.to_owned(),
            figures: study.figures.clone(),
            runs: study.runs.clone(),
            study_toml: study.is_more_than_tables().then(|| study.text.clone()),
            files: Held { opens: true, ..Held::default() },
            source: OnceLock::new(),
        };
        for file in study.pipeline.figure.clone().measured_mut() {
            let (path, text) = file.read_text();
            common.files.measured(path, || Ok(text.to_owned()))?;
        }
        let numbers: Vec<u64> = (0..study.count()).collect();
        let mut rows = at_once(&numbers, jobs, |number| {
            let values = grid.values(*number);
            let resolved = common.resolve(&values);
            Ok::<_, String>(Row::of(number + 1, values, resolved))
        })?;
        let first = rows.len() as u64 + 1;
        let numbers: Vec<u64> = (0..study.runs.len() as u64).collect();
        rows.extend(at_once(&numbers, jobs, |number| {
            let scenario = study.runs[*number as usize].resolve(&common.files)?;
            Ok::<_, String>(Row::of(first + number, Vec::new(), Ok(scenario)))
        })?);
        common.files.opens = false;
        let refused: Vec<&Row> = rows.iter().filter(|row| row.refused.is_some()).collect();
        let all = refused.len() == rows.len() - study.runs.len();
        if !refused.is_empty() && (!skip_refused || all) {
            let mut problem = format!("{} of {} runs are refused", refused.len(), study.count());
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
            return Err(problem);
        }
        let text = lines(&common, &rows);
        if text.len() > LONGEST_PLAN_BYTES {
            return Err(format!("{} bytes in a plan (accepted: up to {LONGEST_PLAN_BYTES})", text.len()));
        }
        Ok(Plan { hash: blake3::hash(text.as_bytes()).to_hex().to_string(), common, rows })
    }

    /// Writes the plan into a folder without one.
    ///
    /// # Errors
    /// If the folder has one, or the system refuses.
    pub fn write(&self, folder: &Path, inputs: Inputs) -> Result<(), StudyError> {
        let end = End { rows: self.rows.len(), blake3: &self.hash };
        let text = lines(&self.common, &self.rows) + &json(&end);
        Ok(FileSet::write_one(&folder.join(FILE), text, Existing::Refuse, inputs)?)
    }

    /// The plan of a study in a folder, written if there is none yet, and whether that is so. `file` is that of the study.
    ///
    /// # Errors
    /// As [`Plan::of`]; if the folder has the plan of another study, or the system refuses.
    pub fn begun(
        study: &Study,
        file: &Path,
        folder: &Path,
        skip_refused: bool,
        jobs: Option<NonZeroUsize>,
    ) -> Result<(Plan, bool), StudyError> {
        let plan = Plan::of(study, skip_refused, jobs).map_err(StudyError::refused(file))?;
        let is_new = !folder.join(FILE).exists();
        if is_new {
            create_folder(folder)?;
            plan.write(folder, Inputs::of([file]))?;
        } else if Plan::read(folder)?.hash != plan.hash {
            let problem = "it has the plan of another study, or by other code (accepted: another folder)";
            return Err(StudyError::refused(folder)(problem.to_owned()));
        }
        Ok((plan, is_new))
    }

    /// Reads the plan of a folder.
    ///
    /// # Errors
    /// If there is none, or it is invalid or edited.
    pub fn read(folder: &Path) -> Result<Plan, StudyError> {
        let path = folder.join(FILE);
        let no_plan = StudyError::refused(&path);
        let file = asperity_files::open(&path).map_err(|error| {
            no_plan(format!("there is no plan ({error}) (accepted: a folder of `asperity sweep plan`)"))
        })?;
        Plan::parse(file).map_err(no_plan)
    }

    /// Parses the lines of a plan.
    ///
    /// # Errors
    /// A message with line, key, value and what is accepted, if the plan is invalid or edited.
    pub fn parse(source: impl Read) -> Result<Plan, String> {
        let mut text = String::new();
        let read = source.take(LONGEST_PLAN_BYTES as u64).read_to_string(&mut text);
        read.map_err(|error| format!("{error} (accepted: an unedited plan)"))?;
        let (body, end) = text.split_at(text.trim_end().rfind('\n').map_or(0, |at| at + 1));
        let mut lines = (1_u64..).zip(body.lines());
        let common = lines.next().map_or("", |(_, line)| line);
        check_version(common)?;
        let all = lines.clone().count();
        let hash = blake3::hash(body.as_bytes()).to_hex().to_string();
        if end != json(&End { rows: all, blake3: &hash }) {
            return Err("it was changed after it was written (accepted: an unedited plan)".to_owned());
        }
        let at = |number: u64| move |problem: String| format!("line {number}: {problem}");
        let (common, keys) = Common::parse(common).map_err(at(1))?;
        let named = common.runs.len();
        let numbered = all.checked_sub(named).ok_or(format!("{all} runs (accepted: {named} or more)"))?;
        let row = |(number, line): (u64, &str)| {
            let keys = if number - 1 <= numbered as u64 { &keys[..] } else { &[] };
            Row::parse(line, number - 1, keys).map_err(at(number))
        };
        let rows = lines.map(row).collect::<Result<_, _>>()?;
        Ok(Plan { common, rows, hash })
    }

    /// Checks that this program is the one that the runs were planned for.
    ///
    /// # Errors
    /// If another code version made the plan.
    pub fn check_code(&self, folder: &Path) -> Result<(), StudyError> {
        if self.common.code_version == CODE_VERSION {
            return Ok(());
        }
        let problem = format!(
            "a plan by code version {} and this program is {CODE_VERSION} (accepted: the program that made it, or a new \
             plan in another folder)",
            self.common.code_version
        );
        Err(StudyError::refused(&folder.join(FILE))(problem))
    }

    /// The number of runs over axes; the rows after them have names.
    pub fn numbered(&self) -> u64 {
        self.rows.len().saturating_sub(self.common.runs.len()) as u64
    }

    /// The run of that number, if it has a name.
    pub fn named(&self, run: u64) -> Option<&Named> {
        let index = run.checked_sub(self.numbered() + 1)?;
        self.common.runs.get(usize::try_from(index).ok()?)
    }

    /// The runs over axes with these values of keys, each `key=value`.
    ///
    /// # Errors
    /// If there is no such key or run, with the accepted values.
    pub fn runs_at(&self, at: &[String]) -> Result<Vec<u64>, String> {
        let rows = &self.rows[..self.numbered() as usize];
        runs_at(at, &self.common.keys, rows.iter().map(|row| (row.run, Cow::Borrowed(&*row.values))))
    }

    /// The name of a run in messages: its name, or its number and values.
    pub fn label(&self, run: u64) -> String {
        match self.named(run) {
            Some(named) => format!("run {}", named.name),
            None => {
                let values = self.common.assignments(&self.rows[run as usize - 1].values).join(" ");
                format!("run {run}, {values}")
            }
        }
    }

    /// What some run over the axes has: tables have columns for it, empty for the others.
    pub fn parts(&self) -> Parts {
        let rows = self.rows[..self.numbered() as usize].iter().filter(|row| row.refused.is_none());
        // Only these keys decide, so one run of each of their values is enough.
        let deciding = [
            "friction.law",
            "slider.across",
            "slider.left_end",
            "slider.right_end",
            "friction.radiation_kg_per_s",
            "friction.weakening_slip_m",
            "friction.weakening_slip_offsets_m",
        ]
        .map(|decides| self.common.keys.iter().position(|key| key == decides));
        let mut seen = BTreeSet::new();
        let value = |row: &Row, place: Option<usize>| place.map(|place| row.values[place].to_string());
        let firsts = rows.filter(|row| seen.insert(deciding.map(|place| value(row, place))));
        firsts
            .filter_map(|row| self.resolve(row).ok())
            .fold(Parts::default(), |parts, run| parts.or(run.parts()))
    }

    /// The scenario of a run, resolved by this program.
    ///
    /// # Errors
    /// If it is refused.
    pub fn resolve(&self, row: &Row) -> Result<Scenario, String> {
        let named = self.named(row.run).map(|run| run.resolve(&self.common.files));
        named.unwrap_or_else(|| self.common.resolve(&row.values))
    }

    /// The scenario of a run, and its header as this program makes it. Ids of plans by other code versions differ, and
    /// cannot verify that it is the planned one.
    ///
    /// # Errors
    /// If they are not those planned.
    pub fn scenario(&self, row: &Row) -> Result<(Scenario, RunHeader), String> {
        self.derive(row).map(|(scenario, Derived { header, .. })| (scenario, header))
    }

    /// The scenario of a run, and what follows from it, likewise.
    ///
    /// # Errors
    /// Likewise.
    pub(crate) fn derive(&self, row: &Row) -> Result<(Scenario, Derived), String> {
        let scenario = self.resolve(row)?;
        let derived = Task::new(&scenario).derive();
        if self.common.code_version == CODE_VERSION && row.id.as_ref() != Some(&derived.header.run_id) {
            return Err("its scenario has changed since it was planned".to_owned());
        }
        Ok((scenario, derived))
    }
}

/// Checks the version of a plan before anything else in it, since another one may mean anything.
fn check_version(line: &str) -> Result<(), String> {
    #[derive(Deserialize)]
    struct Versioned {
        format: u32,
    }
    match serde_json::from_str(line) {
        Ok(Versioned { format }) if format != FORMAT => {
            Err(format!("written with version {format} of the format; this program reads version {FORMAT}"))
        }
        _ => Ok(()),
    }
}

impl Row {
    /// A run with the scenario that was resolved for it, or the reason why it is refused.
    fn of(run: u64, values: Vec<Cell>, resolved: Result<Scenario, String>) -> Row {
        let scenario = resolved.as_ref().ok();
        Row {
            run,
            values,
            id: scenario.map(|scenario| Task::new(scenario).header().run_id),
            warnings: scenario.map(Scenario::warnings).unwrap_or_default(),
            preview: scenario.map(Scenario::preview),
            refused: resolved.err(),
        }
    }

    fn parse(line: &str, run: u64, keys: &[&'static Key]) -> Result<Row, String> {
        let mut row: Row = serde_json::from_str(line).map_err(|error| {
            format!("{} (accepted: run {run}, as `asperity sweep plan` writes it)", problem_of(&error))
        })?;
        if row.run != run {
            return Err(format!(
                "run = {} (accepted: {run}; runs are numbered from 1 in their order)",
                row.run
            ));
        }
        if row.values.len() != keys.len() {
            let (count, names) = (row.values.len(), names(keys));
            return Err(format!("values: {count} of them (accepted: {}, of {names})", keys.len()));
        }
        keys.iter().zip(&mut row.values).for_each(|(key, value)| *value = settled(key, value));
        keys.iter().zip(&row.values).try_for_each(|(key, value)| check_value(key, value))?;
        match row.id.is_some() == row.refused.is_some() {
            true => Err("it has both id and refused, or neither (accepted: one of them)".to_owned()),
            false => Ok(row),
        }
    }
}

impl Common {
    fn parse(line: &str) -> Result<(Common, Vec<&'static Key>), String> {
        let common: Common = serde_json::from_str(line).map_err(|error| {
            let problem = problem_of(&error);
            format!("a plan of another form: {problem} (accepted: a plan by this version of the program)")
        })?;
        let keys = common.keys.iter().map(|key| key_of(key)).collect::<Result<Vec<_>, _>>();
        let keys = keys.map_err(|problem| format!("keys: {problem}"))?;
        Figure::check_files(&common.figures)?;
        common.runs.iter().try_for_each(|run| check_name(&run.name))?;
        Ok((common, keys))
    }

    /// The overrides of a run, as `key=value`.
    pub fn assignments(&self, values: &[Cell]) -> Vec<String> {
        let assignment = |(path, value): (&String, &Cell)| match key_of(path) {
            // Of a list, one value for all depths.
            Ok(key) if key.is_by_depth() => format!("{path}=[{}]", spelled(value)),
            _ => format!("{path}={}", spelled(value)),
        };
        self.keys.iter().zip(values).map(assignment).collect()
    }

    /// The scenario with these values, resolved by this program.
    ///
    /// # Errors
    /// If it refuses them.
    pub fn resolve(&self, values: &[Cell]) -> Result<Scenario, String> {
        let with = |source: ScenarioSource, assignment: &String| source.with_override(assignment);
        let source = self.source.get_or_init(|| {
            self.set.iter().fold(ScenarioSource::new(&self.scenario, &self.scenario_toml), with)
        });
        let resolve = |assignments: &[String]| {
            let source = assignments.iter().fold(source.clone(), with);
            Scenario::resolve_with(&source, &self.files).map_err(|errors| errors.to_string())
        };
        let mut assignments = self.assignments(values);
        // A refinement, which its figure marks, has its lists on each mesh.
        let is_refinement = self.figures.iter().any(|figure| figure.kind == Kind::Refinement);
        let blocks = self.keys.iter().zip(values).find(|(key, _)| *key == "slider.blocks");
        if let (true, Some((_, Cell::Step(blocks)))) = (is_refinement, blocks) {
            let given = resolve(&[])?;
            let lists = given.lists_by_block().filter(|_| !given.slider.is_over_area());
            let new = lists.map(|(key, list)| format!("{key}={:?}", resampled(list, *blocks as usize)));
            assignments.extend(new);
        }
        resolve(&assignments)
    }
}

/// What the scenarios of a plan name, as it was when the plan was made: texts by their paths, and states of logged runs.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Held {
    texts: Mutex<BTreeMap<String, String>>,
    /// Whether what it does not hold is opened, once: while the plan is made.
    #[serde(skip)]
    opens: bool,
}

impl Held {
    /// The text of that name. One that it does not hold, or that a plan is too short for, is refused, with what is
    /// accepted.
    fn get<E>(
        &self,
        name: String,
        read: impl FnOnce() -> Result<String, E>,
        refused: impl FnOnce(String, String) -> E,
    ) -> Result<String, E> {
        let mut texts = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(text) = texts.get(&name) {
            return Ok(text.clone());
        }
        if !self.opens {
            let problem = format!("{name}: the plan names it, and does not hold it");
            return Err(refused(problem, "a plan by this version of the program".to_owned()));
        }
        let text = read()?;
        let bytes = texts.values().map(String::len).sum::<usize>() + text.len();
        if bytes > LONGEST_COMMON_BYTES {
            let problem = format!("{bytes} bytes of files and states in a plan");
            return Err(refused(problem, format!("up to {LONGEST_COMMON_BYTES}, fewer or smaller ones")));
        }
        texts.insert(name, text.clone());
        Ok(text)
    }

    /// The text of a file of measured points.
    pub(crate) fn measured(
        &self,
        path: &str,
        read: impl FnOnce() -> Result<String, String>,
    ) -> Result<String, String> {
        let refused = |problem, accepted| format!("{problem} (accepted: {accepted})");
        self.get(format!("measured {path}"), read, refused)
    }
}

impl Files for Held {
    fn text(&self, path: &Path) -> io::Result<String> {
        let refused = |problem, accepted| io::Error::other(format!("{problem} (accepted: {accepted})"));
        self.get(path.to_string_lossy().into_owned(), || OpenedForStudy.text(path), refused)
    }

    fn state(&self, scenario: &Scenario) -> Result<String, UnfitState> {
        let name = format!("{} at {:e} s", scenario.initial.from, scenario.initial.at_s);
        let refused = |problem, accepted| UnfitState { key: "initial.from", problem, accepted };
        self.get(name, || OpenedForStudy.state(scenario), refused)
    }
}

fn lines(common: &Common, rows: &[Row]) -> String {
    let mut text = json(common);
    rows.iter().for_each(|row| text.push_str(&json(row)));
    text
}

/// The message of a JSON error, without the line number, which is always 1.
fn problem_of(error: &serde_json::Error) -> String {
    let words = error.to_string();
    let problem = words.rsplit_once(" at line ").map_or(&*words, |(problem, _)| problem);
    format!("column {}: {problem}", error.column())
}

fn json(value: &impl Serialize) -> String {
    let mut line = serde_json::to_string(value).expect("texts and finite numbers are JSON");
    line.push('\n');
    line
}

#[cfg(test)]
mod tests {
    use super::{Held, LONGEST_COMMON_BYTES};

    #[test]
    fn more_than_a_plan_has_room_for_is_refused_while_it_is_read() {
        let mut held = Held { opens: true, ..Held::default() };
        let half = "x".repeat(LONGEST_COMMON_BYTES / 2);
        let get = |held: &Held, name: &str| {
            held.get(name.to_owned(), || Ok(half.clone()), |problem, accepted| [problem, accepted].join("; "))
        };
        assert!(["a", "b", "a"].iter().all(|name| get(&held, name).is_ok()));
        let bytes = format!("{} bytes of files and states in a plan", LONGEST_COMMON_BYTES / 2 * 3);
        assert!(get(&held, "c").unwrap_err().starts_with(&bytes));
        held.opens = false;
        assert!(get(&held, "a").is_ok() && get(&held, "c").unwrap_err().contains("does not hold it"));
    }
}
