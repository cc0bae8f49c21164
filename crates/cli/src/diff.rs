//! `asperity diff`: compares the events of two runs, or of all runs in two folders. Exits with 0
//! where the policy is kept, 1 where not, 2 where there is nothing to compare or it cannot be read.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use asperity_compare::sides;
use asperity_compare::{CompareError, Compared, Settings, Told, compare};
use asperity_diff::policy::Policy;
use asperity_diff::report::{Report, Verdict};
use asperity_diff::{page, summary};
use asperity_files::{Existing, FileError, FileSet, Inputs};
use asperity_model::text;
use asperity_summary::{RupturesFrom, Summary};

use crate::args::{DiffArguments, DiffFormat, PairBy};
use crate::exit::{self, Code, Failure};
use crate::outputs::refused;
use crate::ruptures::found_in_steps;
use crate::terminal;
use crate::verdict_exit;

pub(crate) fn command(arguments: &DiffArguments) -> Result<(), Failure> {
    let settings = settings(arguments)?;
    let files = outputs(arguments)?;
    let told = |error: FileError| refused("", &error, true);
    hold_all(arguments)?;
    let Compared { report, draft } =
        compare(&arguments.old, &arguments.new, &settings, &files).map_err(as_failure)?;
    if let Some(path) = &arguments.draft_policy {
        let text = format!(
            "# The tightest policy under which {} passes against {}.\n{}",
            report.new,
            report.old,
            draft.policy(settings.policy.window_s).to_toml()
        );
        files.write(path, text).map_err(told)?;
    }
    if let Some(path) = &arguments.page {
        files.write(path, page::page(&report)).map_err(told)?;
    }
    files.publish().map_err(told)?;
    print(&report, arguments.format)?;
    match report.verdict {
        Verdict::WithinPolicy => Ok(()),
        Verdict::Differs => Err(Failure::Said(Code::Failed)),
    }
}

/// Checks that every run log on either side is complete. Other code versions are accepted:
/// comparing them is the purpose.
fn hold_all(arguments: &DiffArguments) -> Result<(), Failure> {
    let mut logs = Vec::new();
    for side in [&arguments.old, &arguments.new] {
        logs.extend(sides::logs(side).map_err(|error| as_failure(error.into()))?);
    }
    let judged = exit::each_of(&logs, None, |log| verdict_exit::holds_all(log))?;
    Code::worst(judged.into_iter().filter_map(Result::err)).said()
}

/// Reserves the outputs, which must not overwrite inputs.
fn outputs(arguments: &DiffArguments) -> Result<FileSet, Failure> {
    let existing = if arguments.force { Existing::Replace } else { Existing::Refuse };
    let inputs = [Some(&arguments.old), Some(&arguments.new), arguments.policy.as_ref()];
    let files = FileSet::new(existing, Inputs::of(inputs.into_iter().flatten()));
    let outputs = [
        ("--draft-policy", arguments.draft_policy.clone()),
        ("--page", arguments.page.clone()),
        ("--matches", matches_file(arguments)),
    ];
    for (option, path) in outputs {
        files.reserve(path).map_err(|error| refused(option, &error, true))?;
    }
    Ok(files)
}

fn settings(arguments: &DiffArguments) -> Result<Settings, Failure> {
    let (keep_findings, keep_matches) = match arguments.format {
        DiffFormat::Json => (usize::MAX, usize::MAX),
        DiffFormat::Text if arguments.page.is_some() => (page::FINDINGS_OF_A_CLASS, page::MATCHES_OF_A_RUN),
        DiffFormat::Text => (summary::KEPT_OF_A_CLASS, 0),
    };
    Ok(Settings {
        policy: read_policy(arguments)?,
        policy_file: arguments.policy.clone(),
        pair_by: match arguments.pair {
            PairBy::Hash => sides::PairBy::Hash,
            PairBy::Name => sides::PairBy::Name,
        },
        keep_findings,
        keep_matches,
        matches_file: matches_file(arguments),
        tell: Some(tell),
    })
}

/// The summary of a log, and its ruptures if the log contains none.
fn tell(log: &Path) -> Result<Told, String> {
    let told = || {
        let summary = crate::summary::of_whole_log(log)?;
        let found = (summary.ruptures_from == RupturesFrom::Steps.word()).then(|| found_in_steps(log));
        let keys = Summary::KEYS.iter().map(|key| key.column.name.to_string());
        Ok(Told { summary: keys.zip(summary.values()).collect(), ruptures: found.transpose()? })
    };
    told().map_err(|failure: Failure| failure.to_string())
}

fn read_policy(arguments: &DiffArguments) -> Result<Policy, Failure> {
    let Some(path) = &arguments.policy else { return Ok(Policy::default()) };
    let text = text::read(path).map_err(|error| {
        Failure::BadInput(format!("policy {}: {error} (accepted: a TOML file)", path.display()))
    })?;
    Policy::parse(&path.display().to_string(), &text).map_err(Failure::bad_input)
}

#[cfg(feature = "analysis")]
fn matches_file(arguments: &DiffArguments) -> Option<PathBuf> {
    arguments.matches.clone()
}

#[cfg(not(feature = "analysis"))]
fn matches_file(_arguments: &DiffArguments) -> Option<PathBuf> {
    None
}

fn as_failure(error: CompareError) -> Failure {
    match error {
        CompareError::File(error) => refused("", &error, true),
        error if error.is_of_output() => Failure::failed(error),
        error => Failure::bad_input(error),
    }
}

fn print(report: &Report, format: DiffFormat) -> Result<(), Failure> {
    match format {
        DiffFormat::Text => {
            for line in summary::lines(report) {
                terminal::say(line)?;
            }
        }
        DiffFormat::Json => {
            let mut out = io::BufWriter::new(terminal::data());
            serde_json::to_writer_pretty(&mut out, report).map_err(|error| Failure::Output(error.into()))?;
            writeln!(out)?;
            out.flush()?;
        }
    }
    Ok(())
}
