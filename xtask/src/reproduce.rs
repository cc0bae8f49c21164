//! `cargo xtask reproduce...`: builds the binary and hands it one pipeline or all.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::workspace::{Failure, asperity, run};

pub(crate) const CHAPTER5: &str = "chapter5";
pub(crate) const CHAPTER6: &str = "chapter6";

/// The pipelines, each `pipelines/NAME.toml`, in the order of `reproduce-all`.
pub(crate) const ALL: [&str; 13] = [
    CHAPTER5,
    CHAPTER6,
    "appendix-a",
    "goals",
    "top-driven",
    "resolution",
    "front-speed",
    "slip-pulses",
    "slab",
    "slow-slip",
    "area",
    "rate-and-state",
    "carlson-langer",
];

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
    /// Which reading of the thesis to run; its figures come from as-coded.
    #[arg(long, value_enum, value_name = "SET")]
    parameter_set: Option<ParameterSet>,
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

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ParameterSet {
    /// What the thesis' program computed.
    AsCoded,
    /// What the thesis' text says.
    AsStated,
}

impl ParameterSet {
    pub(crate) fn word(self) -> &'static str {
        match self {
            ParameterSet::AsCoded => "as-coded",
            ParameterSet::AsStated => "as-stated",
        }
    }
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
    let set = arguments.parameter_set;
    // Paths of the user are relative to the current folder, not to the root.
    let given = match &arguments.out {
        Some(out) => Some(
            std::path::absolute(out)
                .map_err(|error| Failure::Io { what: format!("find {}", out.display()), error })?,
        ),
        None => None,
    };
    let mut folders = Vec::new();
    for name in names {
        let out = match &given {
            Some(out) if names.len() == 1 => out.clone(),
            Some(out) => out.join(name),
            None if set == Some(ParameterSet::AsStated) => Path::new("out").join(format!("{name}-as-stated")),
            None => Path::new("out").join(name),
        };
        let mut asperity = asperity()?;
        asperity.args(["reproduce", &pipeline(name), "--out"]).arg(&out);
        if let Some(set) = set {
            asperity.arg("--set").arg(format!("parameter_set={}", set.word()));
        }
        if arguments.fresh {
            asperity.arg("--fresh");
        }
        if arguments.no_provenance {
            asperity.arg("--no-provenance");
        }
        if let Some(jobs) = arguments.jobs {
            asperity.arg("--jobs").arg(jobs.to_string());
        }
        run(&mut asperity)?;
        folders.push(out);
    }
    if folders.len() == 1 {
        return Ok(());
    }
    let index = match set {
        Some(ParameterSet::AsStated) if given.is_none() => "index-as-stated.html",
        _ => "index.html",
    };
    let page = given.unwrap_or_else(|| PathBuf::from("out")).join(index);
    run(asperity()?.arg("report").args(folders).arg("--out").arg(page).arg("--force"))
}
