//! `cargo xtask verify-solver`: the fast solver against the plain one, run by run.

use std::num::NonZeroUsize;

use clap::Args;

use crate::reproduce::{ALL, CHAPTER5, ParameterSet, pipeline};
use crate::say::say;
use crate::workspace::{Failure, asperity, run};

/// Runs that are made for this comparison alone.
const LONG_CHAINS: &str = "long-chains";

/// The pipelines with comparable runs: all reproduced ones, and [`LONG_CHAINS`].
const PIPELINES: [&str; ALL.len() + 1] = {
    let mut pipelines = [LONG_CHAINS; ALL.len() + 1];
    let mut at = 0;
    while at < ALL.len() {
        pipelines[at] = ALL[at];
        at += 1;
    }
    pipelines
};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask verify-solver
  cargo xtask verify-solver --parameter-set as-stated
  cargo xtask verify-solver --for-s 0.1
  cargo xtask verify-solver --pipeline long-chains

All runs together take 1.1e10 steps of the plain solver: half an hour on one
core, a quarter of an hour on two. The tests compare the first 0.1 s of each.")]
pub(crate) struct VerifyArguments {
    /// Only this reading of the thesis.
    #[arg(long, value_enum, value_name = "SET")]
    parameter_set: Option<ParameterSet>,
    /// Only the first SECONDS of each run, in simulated time.
    #[arg(long, value_name = "SECONDS")]
    for_s: Option<f64>,
    /// The pipeline whose runs are compared.
    #[arg(long, value_name = "NAME", default_value = CHAPTER5, value_parser = PIPELINES)]
    pipeline: String,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

pub(crate) fn command(arguments: &VerifyArguments) -> Result<(), Failure> {
    let sets = match arguments.parameter_set {
        Some(set) => vec![set],
        None => vec![ParameterSet::AsCoded, ParameterSet::AsStated],
    };
    for set in sets {
        say!("==> {}", set.word());
        let mut asperity = asperity()?;
        asperity
            .args(["verify-solver", &pipeline(&arguments.pipeline), "--set"])
            .arg(format!("parameter_set={}", set.word()));
        if let Some(seconds) = arguments.for_s {
            asperity.arg("--for-s").arg(seconds.to_string());
        }
        if let Some(jobs) = arguments.jobs {
            asperity.arg("--jobs").arg(jobs.to_string());
        }
        run(&mut asperity)?;
    }
    Ok(())
}
