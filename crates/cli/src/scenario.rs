//! `asperity scenario`, and the scenario named by a command's arguments.

use std::path::{Path, PathBuf};

use asperity_model::scenario::builtin::{self, EXPERIMENTS, Experiment};
use asperity_model::{Scenario, ScenarioSource};
use asperity_run::{Opened, begins_at_end, check};
use asperity_runlog::RunReader;
use asperity_study::given::Given;
use clap::{Args, Subcommand};

use crate::exit::Failure;
use crate::given::{self, Taken};
use crate::progress::Board;
use crate::validate::{self, ValidateArguments};
use crate::{terminal, verdict_exit};

#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// List the built-in scenarios, each with its purpose; with --for, which model fits which experiment.
    #[command(after_help = "\
Examples:
  asperity scenario list
  asperity scenario list --for
  asperity scenario list --for glass")]
    List {
        /// List kinds of experiments, or those that a word is found in, with the model for each and what it cannot show.
        #[arg(long = "for", value_name = "WORD", num_args = 0..=1)]
        experiments: Option<Option<String>>,
    },
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
wherever few blocks switch.")]
    Validate(ValidateArguments),
}

#[derive(Debug, Args)]
pub(crate) struct ScenarioChoice {
    /// Name of a built-in scenario; path of a TOML file; or path of a run log, whose scenario is used.
    pub(crate) scenario: PathBuf,
    /// Override one key. May be repeated; the last one wins.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

pub(crate) fn command(command: ScenarioCommand, board: &Board) -> Result<(), Failure> {
    match command {
        ScenarioCommand::List { experiments: Some(word) } => models_for(word.as_deref().unwrap_or_default())?,
        ScenarioCommand::List { experiments: None } => {
            for (name, text) in builtin::all() {
                let scenario =
                    Scenario::resolve(&ScenarioSource::new(name, text)).map_err(Failure::failed)?;
                terminal::say(format_args!("{name:<20} {}", scenario.summary))?;
            }
        }
        ScenarioCommand::Show(choice) => {
            terminal::print(choice.resolve()?.to_editable_toml().as_bytes())?;
        }
        ScenarioCommand::Validate(arguments) => {
            let scenario = arguments.choice.resolve_and_tell(board)?;
            if let Some(as_coded) = scenario.as_coded_in_words() {
                board.line(&format!("{}: {as_coded}", scenario.name));
            }
            validate::command(&scenario, arguments.format, board)?;
        }
    }
    Ok(())
}

/// Prints which model fits the experiments that a word is found in.
fn models_for(word: &str) -> Result<(), Failure> {
    let has = |text: &str| text.to_lowercase().contains(&word.to_lowercase());
    let mut found = EXPERIMENTS.iter().filter(|of| has(of.what) || has(of.model)).peekable();
    if found.peek().is_none() {
        let known: Vec<&str> = EXPERIMENTS.iter().map(|of| of.what).collect();
        let accepted = known.join("; ");
        return Err(Failure::BadInput(format!(
            "--for: no experiment with {word:?} (accepted: a word of: {accepted})"
        )));
    }
    for Experiment { what, model, scenarios, cannot } in found {
        terminal::say(format_args!("{what}: {model}"))?;
        terminal::say(format_args!("  scenarios    {}", scenarios.join(", ")))?;
        terminal::say(format_args!("  cannot show  {cannot}"))?;
    }
    Ok(())
}

impl ScenarioChoice {
    fn resolve(&self) -> Result<Scenario, Failure> {
        source_of(&self.scenario)?
            .resolve(&self.scenario.to_string_lossy(), &self.set, &Opened)
            .map_err(Failure::bad_input)
    }

    /// Resolves it, and reports the end of a run where it begins.
    pub(crate) fn resolve_and_tell(&self, board: &Board) -> Result<Scenario, Failure> {
        let scenario = self.resolve()?;
        let begins = begins_at_end(&scenario);
        begins.iter().for_each(|begins| board.line(&format!("{}: {begins}", scenario.name)));
        Ok(scenario)
    }
}

/// A scenario as written: built in, of a file, or of a run log.
fn source_of(path: &Path) -> Result<ScenarioSource, Failure> {
    let is_built_in = path.to_str().and_then(builtin::find).is_some();
    let given = if is_built_in { Given::of(path) } else { given::check(path, Taken::Scenario)? };
    if given == Given::Log {
        // What follows the scenario may be cut off or damaged.
        let toml = RunReader::scenario_of(path)
            .map_err(|error| verdict_exit::unreadable(path, check(path).verdict, error.problem))?;
        let origin = format!("{}: scenario.toml", path.display());
        return Ok(ScenarioSource::logged(origin, toml));
    }
    asperity_model::source(path).map_err(Failure::bad_input)
}
