//! Errors for a path of the wrong kind: they name the kind, and the command for it.

use std::path::Path;

use asperity_study::given::Given;

use crate::exit::Failure;

/// The kinds of paths that a command accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Taken {
    /// A scenario, or a log for its scenario.
    Scenario,
    /// A file of runs: a sweep or a pipeline.
    Runs,
    /// The folder of a study, with its plan.
    Study,
    /// A side of a diff.
    Side,
}

impl Taken {
    fn accepts(self, given: Given) -> bool {
        use Given::{Folder, Log, Other, Pipeline, Reproduced, Scenario, Sweep, Text, Toml};
        // Other kinds are reported when they are opened.
        let is_open = matches!(given, Folder | Text | Other);
        is_open
            || match self {
                Taken::Scenario => matches!(given, Scenario | Toml | Log),
                Taken::Runs => matches!(given, Sweep | Pipeline | Toml),
                Taken::Study => given == Given::Study,
                Taken::Side => matches!(given, Log | Reproduced | Given::Logs | Given::Study),
            }
    }

    fn words(self) -> &'static str {
        match self {
            Taken::Scenario => "a scenario, or a run log for its scenario",
            Taken::Runs => "a sweep or a pipeline",
            Taken::Study => "the folder of a study",
            Taken::Side => "run logs, event tables, or a folder of them",
        }
    }
}

/// Refuses a path that is clearly of a kind that the command does not accept, and returns the kind of others.
///
/// # Errors
/// If it is, with the command for it; or if a scenario cannot be read.
pub(crate) fn check(path: &Path, taken: Taken) -> Result<Given, Failure> {
    let given = match Given::read(path) {
        // Whoever opens it next might say that it is something else.
        Err(error) if taken == Taken::Scenario => {
            return Err(Failure::BadInput(format!("{}: {error}", path.display())));
        }
        given => given.unwrap_or(Given::Other),
    };
    match said(path, given).filter(|_| !taken.accepts(given)) {
        Some(said) => {
            Err(Failure::BadInput(format!("{}: {said} (accepted: {})", path.display(), taken.words())))
        }
        None => Ok(given),
    }
}

/// The kind of a path that is no run log, if known.
pub(crate) fn instead_of_log(path: &Path) -> Option<String> {
    let given = Given::of(path);
    let said = said(path, given).filter(|_| given != Given::Log)?;
    Some(format!("{said} (accepted: a run log, as asperity run writes it)"))
}

/// The kind of the path, and the command for it.
fn said(path: &Path, given: Given) -> Option<String> {
    let path = path.display();
    Some(match given {
        Given::Foreign(what) => format!("this is {what}"),
        Given::Text => "this is a text, as a CSV table is, and no MCAP file".to_owned(),
        Given::Log => {
            format!("this is a run log: asperity summary {path}, or asperity report {path} -o PAGE.html")
        }
        Given::Parquet => {
            "this is a Parquet table, which is written for other programs: give the log of its run, or for \
                           asperity diff the table as CSV"
                .to_owned()
        }
        Given::Scenario => format!("this is a scenario: asperity run {path} -o RUN.mcap"),
        Given::Sweep => format!("this is a sweep: asperity sweep go {path} -o FOLDER"),
        Given::Pipeline => format!("this is a pipeline: asperity reproduce {path} -o FOLDER"),
        Given::Toml => "this is a TOML file, but not a scenario, sweep or pipeline".to_owned(),
        Given::Reproduced => {
            format!("this is a folder of asperity reproduce: its logs are {path}/runs/*.mcap")
        }
        Given::Study => {
            format!(
                "this is the folder of a study: asperity sweep status {path}, or asperity sweep collect {path}"
            )
        }
        Given::Logs => format!("this is a folder of run logs: {path}/*.mcap"),
        Given::Folder | Given::Other => return None,
    })
}
