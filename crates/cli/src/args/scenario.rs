//! Arguments of `asperity scenario`, and the scenario that commands are given.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// List the built-in scenarios, each with its purpose.
    List,
    /// Print a scenario as complete TOML: each key with symbol, meaning and accepted values.
    #[command(after_help = "\
Examples:
  asperity scenario show default
  asperity scenario show default --set parameter_set=as-coded
  asperity scenario show out/mine.toml")]
    Show(ScenarioChoice),
    /// Preview a run without making it: material, load, first slip, time step, size of its log.
    #[command(after_help = "\
Examples:
  asperity scenario validate out/mine.toml
  asperity scenario validate default --set time.step_s=3e-6
  asperity scenario validate out/mine.toml --format json | python3 -m json.tool

Prints all errors and warnings that `run` would print, with the place and the
accepted values. The time step is compared with the longest one that is stable
while no block switches; above 0.4 of it, the energy that switches feed into the
slider affects the results.

Material, load and first slip follow from the parameters as long as nothing
slides; docs/scenarios.md derives them.

The bound on the size of the log holds for any numbers; compressed, a log takes
at most a third of it. Sizes that depend on events are given per event. The time
that the plain solver would take is measured on this machine for a quarter of a
second, and printed on stderr; with --quiet it is not measured, and the same
scenario gives the same output. The fast solver, the default, takes less time
wherever few blocks switch.

Exit codes:
  0  the scenario is valid, with or without warnings
  1  failure
  2  the scenario is not valid")]
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
    /// Name of a built-in scenario; path of a TOML file; or path of a run log, whose scenario is used.
    pub(crate) scenario: PathBuf,
    /// Override one key. May be repeated; the last one wins.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}
