//! `asperity salvage`: what is left of a damaged log, as a log that says what it lacks.

use std::io::{self, Write};
use std::path::Path;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{RECORD_SCHEMA_VERSION, RunHeader};
use asperity_runlog::{SalvageError, Salvaged, WriteError, salvage};

use crate::args::SalvageArguments;
use crate::detectors;
use crate::exit::Failure;
use crate::run;

/// Stands where nobody knows any more which program or solver it was.
const UNKNOWN: &str = "unknown";

pub(crate) fn command(arguments: &SalvageArguments) -> Result<(), Failure> {
    let (input, out) = (&arguments.run, &arguments.out);
    let kinds = detectors::event_kinds();
    match salvage(input, out, &kinds, &settle) {
        Ok(salvaged) => tell(input, out, &salvaged),
        Err(SalvageError::Whole(path)) => {
            writeln!(io::stdout().lock(), "{path}: whole: there is nothing to salvage")?;
            Ok(())
        }
        Err(error @ SalvageError::Write(WriteError::Exists(_))) => {
            Err(Failure::BadInput(format!("--out: {error} (accepted: a path that does not exist)")))
        }
        Err(error) => Err(Failure::failed(error)),
    }
}

/// Holds the header against the scenario, of which a checksum says that it is what was
/// written: nothing else says so of the header.
fn settle(header: Option<RunHeader>, scenario: Option<&str>) -> Result<(RunHeader, Vec<String>), String> {
    let resolved =
        scenario.and_then(|text| Scenario::resolve(&ScenarioSource::new("scenario.toml", text)).ok());
    match (header, resolved) {
        (Some(header), Some(scenario)) => {
            let (solver, code_version) = (header.solver.clone(), header.code_version.clone());
            let expected = of(&scenario, &solver, &code_version, header.record_schema_version);
            if expected == header {
                return Ok((header, Vec::new()));
            }
            let remark =
                "metadata `run` was not what the scenario says, and was made anew from it".to_owned();
            Ok((of(&scenario, UNKNOWN, UNKNOWN, header.record_schema_version), vec![remark]))
        }
        (None, Some(scenario)) => {
            let remark = "metadata `run` is lost, and was made anew from the scenario".to_owned();
            Ok((of(&scenario, UNKNOWN, UNKNOWN, RECORD_SCHEMA_VERSION), vec![remark]))
        }
        // Its own id is all there is to hold it against.
        (Some(header), None) if header.run_id == run::run_id(&header) => Ok((header, Vec::new())),
        (Some(_), None) => Err("metadata `run` contradicts itself, and the scenario is lost".to_owned()),
        (None, None) => {
            Err("neither metadata `run` nor the scenario is left: nothing says what run it is of".to_owned())
        }
    }
}

/// The header of a run of a scenario, by whatever program.
fn of(scenario: &Scenario, solver: &str, code_version: &str, version: u32) -> RunHeader {
    let mut header = run::header(scenario, &Plan::new(scenario), solver);
    header.code_version = code_version.to_owned();
    header.record_schema_version = version;
    header.run_id = run::run_id(&header);
    header
}

fn tell(input: &Path, out: &Path, salvaged: &Salvaged) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    let sum = |counts: &std::collections::BTreeMap<String, u64>| counts.values().sum::<u64>();
    writeln!(stdout, "{}: {} messages salvaged to {}", input.display(), sum(&salvaged.kept), out.display())?;
    for damage in &salvaged.damage {
        writeln!(stdout, "  bytes {} to {}: {}", damage.from_byte, damage.to_byte, damage.what)?;
    }
    for (topic, count) in &salvaged.lost {
        let kept = salvaged.kept.get(topic).copied().unwrap_or(0);
        writeln!(stdout, "  {topic}: {kept} kept, {count} lost")?;
    }
    for gap in &salvaged.gaps {
        let after = gap.after_step.map_or("the beginning".to_owned(), |step| format!("step {step}"));
        let before = gap.before_step.map_or("the end".to_owned(), |step| format!("step {step}"));
        writeln!(stdout, "  nothing between {after} and {before}")?;
    }
    if !salvaged.end_is_known {
        writeln!(stdout, "  its end is lost, and how many messages there were")?;
    }
    for remark in &salvaged.remarks {
        writeln!(stdout, "  {remark}")?;
    }
    Ok(())
}
