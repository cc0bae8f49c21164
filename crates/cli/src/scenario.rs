//! `asperity scenario`, and the scenario that a command's arguments choose.

use std::io::{self, Write};
use std::path::Path;

use asperity_model::{Scenario, ScenarioSource, builtin};
use asperity_runlog::{RunReader, Topics};

use crate::args::{ScenarioChoice, ScenarioCommand};
use crate::exit::Failure;

pub(crate) fn command(command: ScenarioCommand) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    match command {
        ScenarioCommand::List => {
            for (name, text) in builtin::all() {
                let scenario =
                    Scenario::resolve(&ScenarioSource::new(name, text)).map_err(Failure::failed)?;
                writeln!(out, "{name:<20} {}", scenario.summary)?;
            }
        }
        ScenarioCommand::Show(choice) => {
            out.write_all(choice.resolve()?.to_editable_toml().as_bytes())?;
        }
    }
    Ok(())
}

impl ScenarioChoice {
    pub(crate) fn resolve(&self) -> Result<Scenario, Failure> {
        resolve(&self.scenario, &self.set)
    }
}

/// Resolves a built-in scenario, a file, or the scenario that a run log holds, with overrides.
pub(crate) fn resolve(name: &str, set: &[String]) -> Result<Scenario, Failure> {
    if Path::new(name).is_file()
        && let Ok(log) = RunReader::open(Path::new(name), Topics::NONE)
    {
        let source = ScenarioSource::new(format!("{name}: scenario.toml"), log.scenario_toml());
        let source = set.iter().fold(source, |source, assignment| source.with_override(assignment));
        return Scenario::resolve(&source).map_err(Failure::bad_input);
    }
    asperity_model::resolve(name, set).map_err(Failure::bad_input)
}
