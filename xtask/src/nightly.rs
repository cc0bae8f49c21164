//! `cargo xtask nightly`: what takes too long for every change, and rarely fails.

use clap::Args;

use crate::attack;
use crate::test;
use crate::workspace::Failure;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask nightly
  ASPERITY_NO_SKIPS=1 cargo xtask nightly

Runs all tests that are ignored otherwise, those in modules named in_ci among
them, and then all attacks with a new seed, which is printed.")]
pub(crate) struct NightlyArguments {}

pub(crate) fn command(_arguments: &NightlyArguments) -> Result<(), Failure> {
    test::ignored(None)?;
    attack::command(&[])
}
