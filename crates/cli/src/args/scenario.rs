//! Arguments of `asperity scenario`, and the scenario that commands are given.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// List the built-in scenarios and what each is for.
    List,
    /// Print a scenario as complete TOML: each key with symbol, meaning and accepted values.
    #[command(after_help = "\
Examples:
  asperity scenario show default
  asperity scenario show default --set parameter_set=as-coded
  asperity scenario show out/mine.toml")]
    Show(ScenarioChoice),
    /// Preview a run without making it: material, load, first slip, time step, length of its log.
    #[command(after_help = "\
Examples:
  asperity scenario validate out/mine.toml
  asperity scenario validate default --set time.step_s=3e-6
  asperity scenario validate out/mine.toml --format json | python3 -m json.tool

Everything that is wrong with a scenario is said as `run` would say it, with the
place and what is accepted, and so are its warnings. The time step is compared
with the longest one that is stable while no block switches; beyond 0.4 of that,
the energy that switches feed into the slider shows in the results.

Material, load and first slip follow from the parameters, as long as nothing
slides: docs/scenarios.md derives them.

The bound on the log holds whatever the numbers are; compressed, a log has a
third of it or less. What depends on events is given for each of them. How long
the plain solver takes is tried on this machine for a quarter of a second, and
said on stderr; with --quiet it is not tried, and the same scenario gives the
same words. The fast solver, the default, takes less wherever few blocks switch.

Exit codes:
  0  the scenario is valid, with warnings or without
  1  failure
  2  it is not")]
    Validate(ValidateArguments),
}

#[derive(Debug, Args)]
pub(crate) struct ValidateArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// How to print it.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: ForecastFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ForecastFormat {
    /// For people.
    Text,
    /// An object, with the estimate of the plain solver's time unless --quiet is given.
    Json,
}

#[derive(Debug, Args)]
pub(crate) struct ScenarioChoice {
    /// Name of a built-in scenario, path of a TOML file, or a run log, for its scenario.
    pub(crate) scenario: PathBuf,
    /// Override one key. May be repeated; the last one wins.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}
