//! `asperity diff`: what became of the events between two runs, or between all
//! runs of two folders. Exit 0 where the policy is kept, 1 where not, 2 where
//! there is nothing to compare or it cannot be read.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use asperity_compare::sides;
use asperity_compare::{CompareError, Compared, Settings, compare};
use asperity_diff::policy::Policy;
use asperity_diff::report::{Report, Verdict};
use asperity_diff::{page, summary};
use asperity_model::text;
use asperity_runlog::WholeFile;

use crate::args::{DiffArguments, DiffFormat, PairBy};
use crate::exit::{Code, Failure};
use crate::terminal;

pub(crate) fn command(arguments: &DiffArguments) -> Result<(), Failure> {
    let settings = settings(arguments)?;
    outputs_are_free(arguments)?;
    let Compared { report, draft } =
        compare(&arguments.old, &arguments.new, &settings).map_err(as_failure)?;
    if let Some(path) = &arguments.draft_policy {
        let text = format!(
            "# The tightest policy under which {} passes against {}.\n{}",
            report.new,
            report.old,
            draft.policy(settings.policy.window_s).to_toml()
        );
        write(path, &text)?;
    }
    if let Some(path) = &arguments.page {
        write(path, &page::page(&report))?;
    }
    print(&report, arguments.format)?;
    match report.verdict {
        Verdict::WithinPolicy => Ok(()),
        Verdict::Differs => Err(Failure::Said(Code::Failed)),
    }
}

/// Makes sure that nothing would be written over what is there: never over an input.
fn outputs_are_free(arguments: &DiffArguments) -> Result<(), Failure> {
    let outputs = [
        ("--draft-policy", arguments.draft_policy.clone()),
        ("--page", arguments.page.clone()),
        ("--matches", matches_file(arguments)),
    ];
    let inputs = [Some(&arguments.old), Some(&arguments.new), arguments.policy.as_ref()];
    let same =
        |a: &Path, b: &Path| a.canonicalize().ok().zip(b.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    for (option, path) in outputs {
        let Some(path) = path.filter(|path| path.is_file()) else { continue };
        let is_input = inputs.iter().flatten().any(|input| same(input, &path));
        if is_input || !arguments.force {
            let accepted = if is_input { "another file" } else { "another file, or --force" };
            return Err(Failure::BadInput(format!(
                "{option} {} exists already (accepted: {accepted})",
                path.display()
            )));
        }
    }
    Ok(())
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
    })
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
    if error.is_of_output() { Failure::failed(error) } else { Failure::bad_input(error) }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    WholeFile::write(path, text)
        .map_err(|error| Failure::Failed(format!("failed to write {}: {error}", path.display())))
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
