//! `cargo xtask diff-events`: runs one pipeline with two revisions of this project, and compares the
//! events.
//!
//! Old means the other revision, new this checkout, including changes that are not committed. The diff
//! itself is always the present one.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;

use crate::git::{Commit, Repository};
use crate::interrupt;
use crate::reproduce::{ALL, CHAPTER5, ParameterSet, pipeline};
use crate::revision;
use crate::say::say;
use crate::workspace::{Failure, asperity, program, root};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask diff-events HEAD~1
  cargo xtask diff-events v0.1.0 --pipeline chapter6
  cargo xtask diff-events HEAD~5 --new HEAD~4
  cargo xtask diff-events main --policy rounding.toml
  cargo xtask diff-events --clean

Both sides run the pipeline file of this checkout. A revision that refuses it
runs its own version of the file. The outputs stay in
out/diff-events/PIPELINE/REVISION, with a page of both timelines beside them.
Builds stay in target/diff-events, so that a second call is quick. This
checkout, its index and its branches are left unchanged.

Exit codes:
  0  nothing differs except what the policy allows
  1  something differs
  2  the two sides cannot be compared")]
pub(crate) struct DiffEventsArguments {
    /// The older revision: a commit, a tag, a branch, HEAD~3.
    #[arg(value_name = "REV", required_unless_present = "clean")]
    old: Option<String>,
    /// The newer revision [default: this checkout as it stands].
    #[arg(long, value_name = "REV", conflicts_with = "clean")]
    new: Option<String>,
    /// The pipeline whose runs are compared.
    #[arg(long, value_name = "NAME", default_value = CHAPTER5, value_parser = ALL)]
    pipeline: String,
    /// Which reading of the thesis to run [default: that of the pipeline].
    #[arg(long, value_enum, value_name = "SET")]
    parameter_set: Option<ParameterSet>,
    /// What may differ, as for `asperity diff` [default: nothing].
    #[arg(long, value_name = "POLICY.toml")]
    policy: Option<PathBuf>,
    /// Only remove the build of REV, or of all revisions.
    #[arg(long)]
    clean: bool,
}

pub(crate) fn command(arguments: &DiffEventsArguments) -> Result<(), Failure> {
    let repository = Repository::new(root());
    let old = arguments.old.as_deref().map(|revision| repository.commit(revision)).transpose();
    let old = old.map_err(Failure::of_comparison)?;
    match old {
        _ if arguments.clean => revision::clean(&repository, old.as_ref()),
        Some(old) => {
            let sides = run_both(&repository, &old, arguments).map_err(Failure::of_comparison)?;
            compare(&sides, arguments)
        }
        None => Err(Failure::CannotCompare("no revision to compare with (accepted: REV)".to_owned())),
    }
}

/// One of the two.
struct Side {
    /// The commit; for the checkout, the one that it is based on.
    commit: Commit,
    /// How many files differ from that commit; none of a revision.
    changed_files: usize,
    is_checkout: bool,
    out: PathBuf,
}

impl Side {
    fn new(
        repository: &Repository,
        revision: Option<&str>,
        arguments: &DiffEventsArguments,
    ) -> Result<Side, Failure> {
        let commit = repository.commit(revision.unwrap_or("HEAD"))?;
        let changed_files = if revision.is_some() { 0 } else { repository.changed_files()? };
        let mut name = commit.short().to_owned();
        if changed_files > 0 {
            name.push_str("-changed");
        }
        let pipeline = match arguments.parameter_set {
            Some(set) => format!("{}-{}", arguments.pipeline, set.word()),
            None => arguments.pipeline.clone(),
        };
        let out = Path::new("out").join("diff-events").join(pipeline).join(name);
        Ok(Side { commit, changed_files, is_checkout: revision.is_none(), out })
    }

    /// Its name in messages.
    fn title(&self) -> String {
        match (self.is_checkout, self.changed_files) {
            (false, _) => self.commit.title.clone(),
            (true, 0) => format!("this checkout, {}", self.commit.title),
            (true, files) => {
                format!("this checkout, {} and changes in {files} files not committed", self.commit.title)
            }
        }
    }

    fn asperity(&self, repository: &Repository) -> Result<PathBuf, Failure> {
        if self.is_checkout {
            Ok(asperity()?.get_program().into())
        } else {
            revision::build(repository, &self.commit)
        }
    }
}

struct Sides {
    old: Side,
    new: Side,
}

fn run_both(
    repository: &Repository,
    old: &Commit,
    arguments: &DiffEventsArguments,
) -> Result<Sides, Failure> {
    interrupt::install()?;
    let old = Side::new(repository, Some(&old.id), arguments)?;
    let new = Side::new(repository, arguments.new.as_deref(), arguments)?;
    say!("==> old: {}", old.title());
    say!("==> new: {}", new.title());
    let programs = [old.asperity(repository)?, new.asperity(repository)?];
    for (side, program) in [&old, &new].into_iter().zip(programs) {
        run_side(repository, side, &program, arguments)?;
    }
    Ok(Sides { old, new })
}

/// Runs the pipeline of this checkout, or the side's own if it refuses that one.
fn run_side(
    repository: &Repository,
    side: &Side,
    asperity: &Path,
    arguments: &DiffEventsArguments,
) -> Result<(), Failure> {
    let path = pipeline(&arguments.pipeline);
    let present = read(&root().join(&path))?;
    let own = if !side.is_checkout && repository.has(&side.commit, &path)? {
        Some(repository.show(&side.commit, &path)?)
    } else {
        None
    };
    discard_others(&side.out, &[Some(present.as_str()), own.as_deref()])?;

    say!("==> {}: {path} of this checkout", side.title());
    let refused = match (reproduce(asperity, Path::new(&path), side, arguments)?, own) {
        (Outcome::Done, _) => return record(&side.out, &present),
        (Outcome::Refused(refused), None) => refused,
        (Outcome::Refused(refused), Some(own)) => {
            say!("==> {}: runs its own pipeline, for it refuses that one: {refused}", side.title());
            let file = revision::kept_of(&side.commit).join(format!("{}.toml", arguments.pipeline));
            write(&file, &own)?;
            match reproduce(asperity, &file, side, arguments)? {
                Outcome::Done => return record(&side.out, &own),
                Outcome::Refused(refused) => refused,
            }
        }
    };
    Err(Failure::Check(format!("{} refuses {path}: {refused}", side.title())))
}

enum Outcome {
    Done,
    /// Bad input, with the message.
    Refused(String),
}

fn reproduce(
    asperity: &Path,
    pipeline: &Path,
    side: &Side,
    arguments: &DiffEventsArguments,
) -> Result<Outcome, Failure> {
    let mut command = program(asperity);
    command.arg("reproduce").arg(pipeline).arg("--out").arg(&side.out);
    if let Some(set) = arguments.parameter_set {
        command.arg("--set").arg(format!("parameter_set={}", set.word()));
    }
    let (outcome, errors) = with_errors(&mut command)?;
    match outcome {
        Ok(()) => Ok(Outcome::Done),
        Err(Failure::Exit { code: 2, .. }) => Ok(Outcome::Refused(errors)),
        Err(Failure::Exit { code, .. }) => {
            Err(Failure::Check(format!("{} failed with code {code}: {errors}", side.title())))
        }
        Err(other) => Err(other),
    }
}

/// Runs a command, copies its stderr, and keeps its errors for later: they may mean that the version is
/// old.
fn with_errors(command: &mut Command) -> Result<(Result<(), Failure>, String), Failure> {
    let (reader, writer) =
        std::io::pipe().map_err(|error| Failure::Io { what: "make a pipe".to_owned(), error })?;
    command.stdout(Stdio::null()).stderr(writer);
    let said = std::thread::spawn(move || {
        let mut errors = Vec::new();
        for line in BufReader::new(reader).lines() {
            match line {
                Ok(line) => match line.strip_prefix("error: ") {
                    Some(error) => errors.push(error.to_owned()),
                    None => say!("    {line}"),
                },
                Err(error) => {
                    errors.push(format!("the rest cannot be read: {error}"));
                    break;
                }
            }
        }
        errors.join("\n")
    });
    let outcome = interrupt::run(command);
    // Otherwise the reader would wait for further output of this end.
    command.stderr(Stdio::null());
    let errors = said.join().map_err(|_panic| Failure::Check("the reader of errors panicked".to_owned()))?;
    Ok((outcome, errors))
}

/// The pipeline of a folder, written once the folder is complete.
fn record(out: &Path, text: &str) -> Result<(), Failure> {
    write(&root().join(out).join("pipeline.toml"), text)
}

/// Removes an output of another pipeline, whose extra runs would otherwise be compared too.
fn discard_others(out: &Path, texts: &[Option<&str>]) -> Result<(), Failure> {
    let out = root().join(out);
    let made_of = fs::read_to_string(out.join("pipeline.toml")).ok();
    if !out.exists() || made_of.is_some() && texts.contains(&made_of.as_deref()) {
        return Ok(());
    }
    fs::remove_dir_all(&out).map_err(|error| Failure::Io { what: format!("remove {}", out.display()), error })
}

fn compare(sides: &Sides, arguments: &DiffEventsArguments) -> Result<(), Failure> {
    let Sides { old, new } = sides;
    let name = |side: &Side| side.out.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let page = old.out.with_file_name(format!("{}..{}.html", name(old), name(new)));
    let mut diff = asperity()?;
    diff.arg("diff").args([&old.out, &new.out]).arg("--force").arg("--page").arg(&page);
    if let Some(policy) = &arguments.policy {
        let policy = std::path::absolute(policy)
            .map_err(|error| Failure::Io { what: format!("find {}", policy.display()), error })?;
        diff.arg("--policy").arg(policy);
    }
    let outcome = interrupt::run(&mut diff);
    say!("==> old  {}: {}", old.out.display(), old.title());
    say!("==> new  {}: {}", new.out.display(), new.title());
    say!("==> page {}", page.display());
    outcome
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|error| Failure::Io { what: format!("read {}", path.display()), error })
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    fs::write(path, text).map_err(|error| Failure::Io { what: format!("write {}", path.display()), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_kept_and_the_code_tells_a_refusal() {
        let run = |script: &str| {
            let mut command = Command::new("sh");
            command.args(["-c", script]);
            with_errors(&mut command).expect("sh starts")
        };
        let (outcome, errors) = run("echo 'error: a' >&2; echo other >&2; echo 'error: b' >&2; exit 2");
        assert!(matches!(outcome, Err(Failure::Exit { code: 2, .. })), "{outcome:?}");
        assert_eq!(errors, "a\nb");
        let (outcome, errors) = run("true");
        assert!(outcome.is_ok() && errors.is_empty());
    }

    #[test]
    fn outputs_of_another_pipeline_are_not_compared() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let out = folder.path().join("out");
        let there = || out.join("runs").exists();
        // Interrupted before the record, of this pipeline, of the revision's own, of another.
        for (made_of, stays) in [(None, false), (Some("new"), true), (Some("own"), true), (Some("x"), false)]
        {
            fs::create_dir_all(out.join("runs")).expect("folders can be made");
            if let Some(text) = made_of {
                record(&out, text).expect("it can be written");
            }
            discard_others(&out, &[Some("new"), Some("own")]).expect("it can be removed");
            assert_eq!(there(), stays, "{made_of:?}");
            discard_others(&out, &[Some("other"), None]).expect("it can be removed");
            assert!(!there());
        }
    }
}
