//! `cargo xtask bench`: the benchmark, in the one profile that everything is built in.

use clap::Args;

use crate::workspace::{Failure, cargo, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask bench
  cargo xtask bench --chapter5

Prints tables of ratios to a plain scalar loop that is measured along with what it is compared with. Leave the machine
alone meanwhile. Without --chapter5 it takes some five minutes.")]
pub(crate) struct BenchArguments {
    /// Reproduce all of chapter 5 as well.
    #[arg(long)]
    chapter5: bool,
}

pub(crate) fn command(arguments: &BenchArguments) -> Result<(), Failure> {
    const BENCH: [&str; 8] =
        ["bench", "--profile", "dev", "--package", "asperity-cli", "--bench", "speed", "--locked"];
    let mut command = cargo(&BENCH);
    if arguments.chapter5 {
        command.args(["--", "--chapter5"]);
    }
    run(&mut command)
}
