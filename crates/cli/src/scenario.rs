//! `asperity scenario`, and finding a scenario by name or path.

use std::io::{self, Write};
use std::path::Path;

use asperity_model::{Scenario, ScenarioSource, builtin, text};

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
            out.write_all(resolve(&choice.scenario, &choice.set)?.to_editable_toml().as_bytes())?;
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
    let source = match builtin::find(name) {
        Some(text) => ScenarioSource::new(format!("built-in {name}"), text),
        None => ScenarioSource::new(
            name,
            text::read(Path::new(name)).map_err(|error| {
                let names: Vec<&str> = builtin::all().map(|(name, _)| name).collect();
                Failure::BadInput(format!(
                    "scenario {name}: neither a file that can be read ({error}) nor a built-in scenario \
                 (accepted: a path, or one of {})",
                    names.join(", ")
                ))
            })?,
        ),
    };
    let source = set.iter().fold(source, |source, assignment| source.with_override(assignment));
    Scenario::resolve(&source).map_err(|mut errors| {
        // What was left at its default stands nowhere, but what it contradicts stands here.
        for error in errors.0.iter_mut().filter(|error| error.place.is_none()) {
            error.place = Some(name.to_owned());
        }
        Failure::bad_input(errors)
    })
}
