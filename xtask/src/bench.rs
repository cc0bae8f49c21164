//! `cargo xtask bench`: the benchmark, in the one profile that everything is built in; or this
//! checkout against another revision.

use std::num::NonZeroUsize;

use clap::Args;

use crate::against;
use crate::workspace::{Failure, asperity, cargo, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask bench
  cargo xtask bench runs logs
  cargo xtask bench --against HEAD~1
  cargo xtask bench --against v0.1.0 --pairs 40 --within 0.01 as-coded replay

Without --against, measures the speed of this checkout as ratios to plain
loops in C, in seconds of the processor. It needs a C compiler, cc. All parts
together take about twenty minutes. Parts:
  runs            the default run, and chains of 1,000 and 3,000 blocks
  chains          longer and shorter chains
  switches        the cost of a block switch, against the number of blocks
  resolution      the study of resolution with up to 3,200 blocks
  pays            runs in which the fast solver may save no time
  slab            slabs, beside a loop over their nodes
  area            sheets and bodies
  junctions       steps of contacts made of junctions
  rate-and-state  the adaptive solver, at several tolerances
  seas            a fault line in a medium, of 400 to 6,400 nodes
  studies         asperity sweep run, beside bare solvers in as many processes
  logs            writing and reading run logs
  recordings      reading recordings, beside cat of the same files
  diff            comparing event tables of up to a million events
  chapter5        asperity reproduce pipelines/chapter5.toml

With --against, the asperity commands of REV and of this checkout run in turn:
old then new, new then old, and so on. Prints the median and the quartiles of
the ratio new/old within pairs. The verdict is by CPU time (user and system),
which other processes disturb less than wall time. Parts:
  as-coded   asperity run default
  as-stated  asperity run default --set parameter_set=as-stated
  replay     asperity replay, of the log of as-coded
  reduce     asperity reduce, of the same log

What is built of REV is kept in target/diff-events. Outputs go to
target/bench-against. Leave the machine idle meanwhile: on a busy one, the
median of a few pairs may be off by ten per cent, and of 20 by one or two.

Exit codes of --against:
  0  all medians are within the limit
  1  a median is beyond the limit
  2  the two cannot be compared")]
pub(crate) struct BenchArguments {
    /// What to measure [default: everything].
    #[arg(value_name = "PART")]
    pub(crate) parts: Vec<String>,
    /// Compare with this revision: a commit, a tag, a branch, HEAD~3.
    #[arg(long, value_name = "REV")]
    against: Option<String>,
    /// How many times both revisions run each part.
    #[arg(long, value_name = "N", default_value = "20", requires = "against")]
    pub(crate) pairs: NonZeroUsize,
    /// Largest accepted difference of a median, as a share of the time.
    #[arg(long, value_name = "SHARE", default_value = "0.03", requires = "against", value_parser = share)]
    pub(crate) within: f64,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(share) if share > 0.0 && share < 1.0 => Ok(share),
        _ => Err("accepted: a number above 0 and below 1, such as 0.03".to_owned()),
    }
}

pub(crate) fn command(arguments: &BenchArguments) -> Result<(), Failure> {
    const BENCH: [&str; 8] =
        ["bench", "--profile", "dev", "--package", "asperity-cli", "--bench", "speed", "--locked"];
    match &arguments.against {
        Some(revision) => against::command(revision, arguments),
        None => {
            run(cargo(&BENCH).env("ASPERITY", asperity()?.get_program()).arg("--").args(&arguments.parts))
        }
    }
}
