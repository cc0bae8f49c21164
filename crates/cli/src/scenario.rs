//! `asperity scenario`, and the scenario named by a command's arguments.

use std::ffi::OsStr;
use std::io::Write;
use std::path::Path;

use asperity_model::{Scenario, ScenarioSource, builtin};
use asperity_runlog::{RunReader, Topics};

use crate::args::{ScenarioChoice, ScenarioCommand};
use crate::exit::Failure;
use crate::given::{self, Taken};
use crate::progress::Board;
use crate::{terminal, validate};

pub(crate) fn command(command: ScenarioCommand, board: &Board) -> Result<(), Failure> {
    match command {
        ScenarioCommand::List => {
            for (name, text) in builtin::all() {
                let scenario =
                    Scenario::resolve(&ScenarioSource::new(name, text)).map_err(Failure::failed)?;
                terminal::say(format_args!("{name:<20} {}", scenario.summary))?;
            }
        }
        ScenarioCommand::Show(choice) => {
            let toml = choice.resolve()?.to_editable_toml();
            let mut out = terminal::data();
            out.write_all(toml.as_bytes())?;
            out.flush()?;
        }
        ScenarioCommand::Validate(arguments) => {
            validate::command(&arguments.choice.resolve()?, arguments.format, board)?;
        }
    }
    Ok(())
}

impl ScenarioChoice {
    pub(crate) fn resolve(&self) -> Result<Scenario, Failure> {
        resolve(&self.scenario, &self.set)
    }
}

/// Resolves a built-in scenario, a file, or the scenario of a run log, with overrides.
pub(crate) fn resolve(name: impl AsRef<OsStr>, set: &[String]) -> Result<Scenario, Failure> {
    let path = Path::new(name.as_ref());
    if path.to_str().and_then(builtin::find).is_none() {
        given::check(path, Taken::Scenario)?;
    }
    if path.is_file()
        && let Ok(log) = RunReader::open(path, Topics::NONE)
    {
        let source =
            ScenarioSource::logged(format!("{}: scenario.toml", path.display()), log.scenario_toml());
        let source = set.iter().fold(source, |source, assignment| source.with_override(assignment));
        return Scenario::resolve(&source).map_err(Failure::bad_input);
    }
    asperity_model::resolve(path, set).map_err(Failure::bad_input)
}
