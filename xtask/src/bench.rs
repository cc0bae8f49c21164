//! `cargo xtask bench`: the benchmark, in the one profile that everything is built in.

use clap::Args;

use crate::workspace::{Failure, cargo, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask bench
  cargo xtask bench runs logs

Parts: loop (the scalar loop against C), runs (the default run), chains (longer and shorter ones), logs (reading them),
diff (event tables of up to a million events), chapter5 (all of it). Prints tables of ratios to what is measured along in
the same minutes. Leave the machine alone meanwhile. All of it takes some ten minutes.")]
pub(crate) struct BenchArguments {
    /// What to measure [default: everything].
    #[arg(value_name = "PART")]
    parts: Vec<String>,
}

pub(crate) fn command(arguments: &BenchArguments) -> Result<(), Failure> {
    const BENCH: [&str; 8] =
        ["bench", "--profile", "dev", "--package", "asperity-cli", "--bench", "speed", "--locked"];
    run(cargo(&BENCH).arg("--").args(&arguments.parts))
}
