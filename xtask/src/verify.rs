//! `cargo xtask verify`: the fast solver against the plain one, run by run.

use clap::Args;

use crate::reproduce::{CHAPTER5, SETS, pipeline as path};
use crate::say::say;
use crate::test;
use crate::workspace::{Failure, root};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask verify
  cargo xtask verify --parameter-set as-stated
  cargo xtask verify --for-s 0.1
  cargo xtask verify --pipeline long-chains

All runs together take 1.1e10 steps of the plain solver: half an hour on one
core, a quarter of an hour on two. The tests compare the first 0.1 s of each.

Two runs are equal if every switch happens in the same step, every event has the
same integers, and every number agrees within 1e-9 of the largest of its kind.
Where a block comes so close to switching that rounding decides, the solvers may
see the switch some steps apart. The plain solver must then have the block
within rounding of its switch, and fixtures/near-ties lists the case.

A run by rate-and-state friction is compared with itself at a hundredth of
time.tolerance, which must be 1e-10 or above (docs/contacts.md).")]
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
}

pub(crate) fn command(arguments: &VerifyArguments) -> Result<(), Failure> {
    let VerifyArguments { parameter_set, for_s, pipeline } = arguments;
    for set in SETS.into_iter().filter(|set| parameter_set.as_ref().is_none_or(|wanted| wanted == set)) {
        say!("==> {set}");
        let pipeline = root().join(path(pipeline)).display().to_string();
        let for_s = for_s.map(|seconds| ("ASPERITY_VERIFY_FOR_S", seconds.to_string()));
        let variables: Vec<_> = for_s.into_iter().chain([("ASPERITY_VERIFY_PIPELINE", pipeline)]).collect();
        test::of_command(&format!("a_pipeline_is_solved_alike_{}", set.replace('-', "_")), &variables)?;
    }
    Ok(())
}
