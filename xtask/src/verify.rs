//! `cargo xtask verify-solver`: the fast solver against the plain one, run by run.

use std::num::NonZeroUsize;

use clap::Args;

use crate::reproduce::{CHAPTER5, SETS, pipeline as path};
use crate::say::say;
use crate::workspace::{Failure, asperity, run};

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
    #[arg(long, value_name = "SET", value_parser = SETS)]
    parameter_set: Option<String>,
    /// Only the first SECONDS of each run, in simulated time.
    #[arg(long, value_name = "SECONDS")]
    for_s: Option<f64>,
    /// Which of pipelines/NAME.toml.
    #[arg(long, value_name = "NAME", default_value = CHAPTER5)]
    pipeline: String,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    jobs: Option<NonZeroUsize>,
}

pub(crate) fn command(arguments: &VerifyArguments) -> Result<(), Failure> {
    let &VerifyArguments { ref parameter_set, for_s, ref pipeline, jobs } = arguments;
    for set in SETS.into_iter().filter(|set| parameter_set.as_ref().is_none_or(|wanted| wanted == set)) {
        say!("==> {set}");
        let mut asperity = asperity()?;
        asperity.args(["verify-solver", &path(pipeline), "--set", &format!("parameter_set={set}")]);
        asperity.args(for_s.iter().flat_map(|seconds| ["--for-s".to_owned(), seconds.to_string()]));
        asperity.args(jobs.iter().flat_map(|jobs| ["--jobs".to_owned(), jobs.to_string()]));
        run(&mut asperity)?;
    }
    Ok(())
}
