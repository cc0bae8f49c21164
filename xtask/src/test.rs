//! `cargo xtask test`: all tests, with the clients of the run log at hand.

use clap::Args;

use crate::clients;
use crate::say::say;
use crate::workspace::{Failure, cargo, run};

#[derive(Debug, Default, Args)]
#[command(after_help = "\
Examples:
  cargo xtask test
  cargo xtask test --test root clients:: -- --nocapture

Without python3, or node and npm, or their packages, the tests of those clients
are skipped, and without Chromium those of the page that asperity diff writes.
They say so; with ASPERITY_NO_SKIPS=1 in the environment they fail instead.
Tests that take minutes and rarely fail are left to cargo xtask ci.")]
pub(crate) struct TestArguments {
    /// Further arguments of cargo test.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "ARGUMENTS")]
    further: Vec<String>,
}

pub(crate) fn command(arguments: &TestArguments) -> Result<(), Failure> {
    let mut tests = cargo(&["test", "--workspace", "--locked"]);
    tests.args(&arguments.further);
    for clients in clients::ALL {
        match (clients.set_up)() {
            Ok(path) => {
                tests.env(clients.variable, path);
            }
            Err(failure) => {
                say!("warning: no {} clients, tests go on without them: {failure}", clients.name);
                tests.env_remove(clients.variable);
            }
        }
    }
    run(&mut tests)
}
