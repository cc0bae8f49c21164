//! `asperity scenario`, and the scenario that a command's arguments choose.

use std::io::{self, Write};

use asperity_model::{Scenario, ScenarioSource, builtin};

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

/// Resolves a built-in scenario or a file, with overrides.
pub(crate) fn resolve(name: &str, set: &[String]) -> Result<Scenario, Failure> {
    asperity_model::resolve(name, set).map_err(Failure::bad_input)
}
