//! Finds the runs of each side, and pairs them.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use asperity_record::RunHeader;

use crate::error::CompareError;
use crate::report::{RunSide, Unpaired};
use crate::run_log::RunLog;
use crate::table::{self, Table};

/// How the runs of two folders are paired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PairBy {
    /// By the hash of the resolved scenario; by the file's name if one of the two has none.
    #[default]
    Hash,
    /// The file's name, also between scenarios that differ.
    Name,
}

/// One run of a side.
#[derive(Debug, Clone)]
pub struct Run {
    /// The file's name without the ending of its kind.
    pub name: String,
    /// The file.
    pub path: PathBuf,
    /// The contents of its log; `None` if the file is a table.
    pub log: Option<Arc<RunLog>>,
}

/// Run logs that have been read, by their paths.
pub type Logs = BTreeMap<PathBuf, Arc<RunLog>>;

impl Run {
    fn open(path: &Path, logs: &Logs) -> Run {
        Run { name: name_of(path), path: path.to_owned(), log: logs.get(path).cloned() }
    }

    /// Its slip events: those of its log, else of the table that it is.
    pub(crate) fn events(&self) -> Result<Cow<'_, Table>, CompareError> {
        match &self.log {
            Some(log) => Ok(Cow::Borrowed(&log.events)),
            None => table::read(&self.path).map(Cow::Owned),
        }
    }

    /// The header of its log.
    pub fn header(&self) -> Option<&RunHeader> {
        self.log.as_ref().map(|log| &log.provenance.header)
    }

    /// Its entry in a report.
    pub fn side(&self) -> RunSide {
        RunSide {
            name: self.name.clone(),
            path: self.path.display().to_string(),
            events: 0,
            duration_s: self.log.as_ref().map(|log| log.provenance.duration_s()),
            blocks: self.header().map(|header| header.blocks),
            rows: self.header().map(|header| header.rows).filter(|rows| *rows > 1),
            scenario_hash: self.hash().map(str::to_owned),
        }
    }

    fn hash(&self) -> Option<&str> {
        self.header().map(|header| header.scenario_hash.as_str())
    }
}

fn ending(path: &Path) -> Option<&str> {
    path.extension().and_then(|extension| extension.to_str())
}

/// `default` for `default.mcap`, `default.csv` and `default.events.csv`.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    stem.strip_suffix(".events").map_or(stem.clone(), str::to_owned)
}

/// The input for one side: a file, a folder of them, or the output of `asperity reproduce`.
#[derive(Debug, Clone)]
pub struct Side {
    /// Its runs, in the order of their names.
    pub runs: Vec<Run>,
    /// Whether it is one file, to be compared with any file on the other side.
    is_file: bool,
    /// The table of claims, if any.
    pub claims: Option<PathBuf>,
}

impl Side {
    /// The files that are read.
    pub(crate) fn files(&self) -> impl Iterator<Item = &Path> {
        self.runs.iter().map(|run| &run.path).chain(&self.claims).map(PathBuf::as_path)
    }

    /// Finds the runs of a side, whose logs have been read.
    ///
    /// # Errors
    /// If there are none.
    pub fn find(path: &Path, logs: &Logs) -> Result<Side, CompareError> {
        let refused = |problem| Err(CompareError::Input(format!("{}: {problem}", path.display())));
        if !path.is_dir() {
            if !matches!(ending(path), Some("mcap" | "csv" | "partial")) {
                return refused(
                    "is neither a run nor a table that is read (accepted: .mcap, .csv, or a folder of them; Parquet \
                     files are written for other programs)",
                );
            }
            return Ok(Side { runs: vec![Run::open(path, logs)], is_file: true, claims: None });
        }
        let (runs, tables) = (path.join("runs"), path.join("tables"));
        let is_output = runs.is_dir() && tables.is_dir();
        let files = files_in(if is_output { &runs } else { path })?;
        let of_kind = |is_of_kind: &dyn Fn(&Path) -> bool| -> Vec<PathBuf> {
            files.iter().filter(|file| is_of_kind(file)).cloned().collect()
        };
        let is_table = |file: &Path| ending(file) == Some("csv");
        let is_events = |file: &Path| {
            let stem = file.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
            is_table(file) && (stem == "events" || stem.ends_with(".events"))
        };
        // Logs contain more than tables, and only event tables can be compared.
        let mut chosen = of_kind(&|file| ending(file) == Some("mcap"));
        if chosen.is_empty() {
            chosen = of_kind(&is_events);
        }
        if chosen.is_empty() {
            chosen = of_kind(&is_table);
        }
        if chosen.is_empty() {
            return refused(
                "holds no runs and no tables that are read (accepted: .mcap, .csv, or an output of asperity reproduce; \
                 Parquet files are written for other programs)",
            );
        }
        let claims = tables.join("claims.csv");
        let runs = chosen.iter().map(|file| Run::open(file, logs)).collect();
        Ok(Side { runs, is_file: false, claims: (is_output && claims.is_file()).then_some(claims) })
    }
}

/// The run logs of a side, for callers that check them first.
///
/// # Errors
/// If the side has no runs.
pub fn logs(path: &Path) -> Result<Vec<PathBuf>, CompareError> {
    let files = Side::find(path, &Logs::new())?.runs.into_iter().map(|run| run.path);
    Ok(files.filter(|file| matches!(ending(file), Some("mcap" | "partial"))).collect())
}

/// The files of a folder, by name.
fn files_in(folder: &Path) -> Result<Vec<PathBuf>, CompareError> {
    let failed = |error| CompareError::Input(format!("{}: {error}", folder.display()));
    let entries = asperity_files::entries(folder).map_err(failed)?;
    let mut files: Vec<PathBuf> = entries.iter().map(DirEntry::path).collect();
    files.retain(|file| file.is_file());
    files.sort();
    Ok(files)
}

/// Pairs of runs, and runs without a counterpart.
#[derive(Debug)]
pub struct Paired {
    /// Old and new, in the order of the old side.
    pub pairs: Vec<(Run, Run)>,
    /// Runs without a counterpart.
    pub unpaired: Vec<Unpaired>,
}

/// Pairs the runs of both sides. Two files are a pair whatever they are.
pub fn pair(old: &Side, new: &Side, by: PairBy) -> Paired {
    if let ([old_run], [new_run], true) = (&old.runs[..], &new.runs[..], old.is_file && new.is_file) {
        return Paired { pairs: vec![(old_run.clone(), new_run.clone())], unpaired: Vec::new() };
    }
    let mut left: Vec<Option<&Run>> = new.runs.iter().map(Some).collect();
    let mut partners: Vec<Option<&Run>> = vec![None; old.runs.len()];
    let by_hash =
        |old: &Run, new: &Run| by == PairBy::Hash && old.hash().is_some() && old.hash() == new.hash();
    let same_name = |old: &Run, new: &Run| old.name == new.name;
    // If both have a hash, it decides; otherwise the name does.
    let by_name = |old: &Run, new: &Run| {
        same_name(old, new) && (by == PairBy::Name || old.hash().is_none() || new.hash().is_none())
    };
    type Rule<'a> = &'a dyn Fn(&Run, &Run) -> bool;
    let rules: [Rule<'_>; 3] = [&|old, new| by_hash(old, new) && same_name(old, new), &by_hash, &by_name];
    for rule in rules {
        for (run, partner) in old.runs.iter().zip(&mut partners).filter(|(_, partner)| partner.is_none()) {
            let found = left.iter_mut().find(|other| other.is_some_and(|other| rule(run, other)));
            *partner = found.and_then(Option::take);
        }
    }
    let mut paired = Paired { pairs: Vec::new(), unpaired: Vec::new() };
    let alone = |side: &'static str, run: &Run, others: &[Run]| {
        let why = match others.iter().any(|other| same_name(run, other)) {
            true if by == PairBy::Hash => {
                "the run of this name on the other side is of another scenario (--pair name compares them)"
            }
            _ => "the other side has no run of this scenario or name",
        };
        Unpaired { side, run: run.side(), why: why.to_owned() }
    };
    for (run, partner) in old.runs.iter().zip(partners) {
        match partner {
            Some(partner) => paired.pairs.push((run.clone(), partner.clone())),
            None => paired.unpaired.push(alone("old", run, &new.runs)),
        }
    }
    paired.unpaired.extend(left.into_iter().flatten().map(|run| alone("new", run, &old.runs)));
    paired
}
