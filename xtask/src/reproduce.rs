//! `cargo xtask reproduce...`: builds the binary and hands it one pipeline or all.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::workspace::{Failure, absolute, asperity, emptied, entries, output, program, run, write};

pub(crate) const CHAPTER5: &str = "chapter5";
pub(crate) const CHAPTER6: &str = "chapter6";

/// The pipelines, each `pipelines/NAME.toml`, in the order of `reproduce-all`.
pub(crate) const ALL: [&str; 15] = [
    CHAPTER5,
    CHAPTER6,
    "appendix-a",
    "goals",
    "top-driven",
    "resolution",
    "front-speed",
    "slip-pulses",
    "fracture-energy",
    "slab",
    "slow-slip",
    "area",
    "rate-and-state",
    "carlson-langer",
    "seas",
];

/// The readings of the thesis.
pub(crate) const SETS: [&str; 2] = ["as-coded", "as-stated"];

/// Path of a pipeline, from the root of the workspace.
pub(crate) fn pipeline(name: &str) -> String {
    format!("pipelines/{name}.toml")
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask reproduce-chapter5
  cargo xtask reproduce chapter6 --parameter-set as-stated
  cargo xtask reproduce-all --out /tmp/all --fresh --jobs 1

Runs found in the folder are used again if their scenario and the code that made
them are the same; --fresh repeats them. Each study has a page report.html;
reproduce-all writes index.html, which leads to all of them.")]
pub(crate) struct ReproduceArguments {
    /// Folder for runs, tables and figures; for reproduce-all, of one such folder each
    /// [default: out/NAME, or out/NAME-as-stated for that set].
    #[arg(short, long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Which reading of the thesis to run: as-coded is what its program computed, and its figures show; as-stated is what
    /// its text says.
    #[arg(long, value_name = "SET", value_parser = SETS)]
    parameter_set: Option<String>,
    /// Repeat runs that are already in the folder.
    #[arg(long)]
    fresh: bool,
    /// Draw figures without the code version and without the line that names their source.
    #[arg(long)]
    no_provenance: bool,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

#[derive(Debug, Args)]
pub(crate) struct OneArguments {
    /// Which of pipelines/NAME.toml.
    #[arg(value_parser = ALL)]
    name: String,
    #[command(flatten)]
    arguments: ReproduceArguments,
}

impl OneArguments {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        command(&self.arguments, &[&self.name])
    }
}

/// Runs these pipelines, one after the other: each uses all cores.
pub(crate) fn command(arguments: &ReproduceArguments, names: &[&str]) -> Result<(), Failure> {
    let &ReproduceArguments { ref out, ref parameter_set, fresh, no_provenance, jobs } = arguments;
    let as_stated = if parameter_set.as_deref() == Some(SETS[1]) { "-as-stated" } else { "" };
    let given = out.as_deref().map(absolute).transpose()?;
    let mut folders = Vec::new();
    for name in names {
        let out = match &given {
            Some(out) if names.len() == 1 => out.clone(),
            Some(out) => out.join(name),
            None => Path::new("out").join(format!("{name}{as_stated}")),
        };
        let mut asperity = asperity()?;
        asperity.args(["reproduce", &pipeline(name), "--out"]).arg(&out);
        asperity
            .args(parameter_set.iter().flat_map(|set| ["--set".to_owned(), format!("parameter_set={set}")]));
        asperity.args(fresh.then_some("--fresh")).args(no_provenance.then_some("--no-provenance"));
        asperity.args(jobs.iter().flat_map(|jobs| ["--jobs".to_owned(), jobs.to_string()]));
        run(&mut asperity)?;
        folders.push(out);
    }
    if folders.len() == 1 {
        return Ok(());
    }
    let index = if given.is_none() { format!("index{as_stated}.html") } else { "index.html".to_owned() };
    let page = given.unwrap_or_else(|| PathBuf::from("out")).join(index);
    run(asperity()?.arg("report").args(folders).arg("--out").arg(page).arg("--force"))
}

/// Writes the slip events of every run of an output by the program that made it.
pub(crate) fn event_tables(asperity: &Path, out: &Path, tables: &Path) -> Result<(), Failure> {
    emptied(tables)?;
    for log in entries(&out.join("runs"))?.iter().filter(|path| path.extension() == Some("mcap".as_ref())) {
        let table = tables.join(log.with_extension("csv").file_name().unwrap_or_default());
        write(&table, &output(program(asperity).arg("events").arg(log))?)?;
    }
    Ok(())
}
