//! `cargo xtask reproduce-chapter5`: builds the binary and hands it the pipeline.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::workspace::{Failure, asperity, run};

pub(crate) const PIPELINE: &str = "pipelines/chapter5.toml";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask reproduce-chapter5
  cargo xtask reproduce-chapter5 --parameter-set as-stated
  cargo xtask reproduce-chapter5 --out /tmp/chapter5 --fresh --jobs 1

Runs that are in the folder already are used again when their scenario and the code are the same.")]
pub(crate) struct ReproduceArguments {
    /// Folder for runs, tables and figures
    /// [default: out/chapter5, or out/chapter5-as-stated for that set].
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Which reading of the thesis to run; its figures come from as-coded.
    #[arg(long, value_enum, value_name = "SET")]
    parameter_set: Option<ParameterSet>,
    /// Make every run anew.
    #[arg(long)]
    fresh: bool,
    /// How many runs go on at once [default: one per core].
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

    fn default_folder(self) -> &'static str {
        match self {
            ParameterSet::AsCoded => "out/chapter5",
            ParameterSet::AsStated => "out/chapter5-as-stated",
        }
    }
}

pub(crate) fn command(arguments: &ReproduceArguments) -> Result<(), Failure> {
    let mut asperity = asperity()?;
    let out = match &arguments.out {
        // What the user writes is meant from where the user stands, not from the root.
        Some(out) => std::path::absolute(out)
            .map_err(|error| Failure::Io { what: format!("find {}", out.display()), error })?,
        None => arguments.parameter_set.unwrap_or(ParameterSet::AsCoded).default_folder().into(),
    };
    asperity.args(["reproduce", PIPELINE, "--out"]).arg(out);
    if let Some(set) = arguments.parameter_set {
        asperity.arg("--set").arg(format!("parameter_set={}", set.word()));
    }
    if arguments.fresh {
        asperity.arg("--fresh");
    }
    if let Some(jobs) = arguments.jobs {
        asperity.arg("--jobs").arg(jobs.to_string());
    }
    run(&mut asperity)
}
