//! `cargo xtask golden`: the golden event tables against the present code, and
//! the one way to accept that they change.
//!
//! Accepting requires a reason, which the repository records beside the change.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use clap::Args;

use crate::golden_tables::{CHANGES, ENTRY, TABLES, newest, signature, tables};
use crate::reproduce::{CHAPTER5, pipeline};
use crate::say::{print, say};
use crate::workspace::{Failure, asperity, io, output, program, root, run};

/// The head of the record; entries follow.
const HEADING: &str = "\
# Accepted changes of the golden tables

The event tables beside this file are what the runs of Chapter 5 give. A test compares every change of the code with them. A
change that is meant to alter them is accepted by `cargo xtask golden --accept REASON`, which rewrites the tables and adds an
entry here, newest first: the signature of the tables, the version of the code that made them, the reason, and what
`asperity diff` found.
";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask golden
  cargo xtask golden --accept 'thresholds are compared after the step'

Without --accept nothing in the repository changes: the runs of chapter 5 are
made, and their events compared exactly with fixtures/golden/chapter5. The
tables and a page of the differences are left in out/golden.

Exit codes:
  0  nothing differs, or the change is accepted
  1  something differs
  2  the two sides cannot be compared")]
pub(crate) struct GoldenArguments {
    /// Replace the golden tables with those of the present code, for this reason.
    #[arg(long, value_name = "REASON", value_parser = reason)]
    accept: Option<String>,
}

/// A reason must consist of words, in one paragraph.
fn reason(text: &str) -> Result<String, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    if words.len() < 3 {
        return Err("no reason that a reader could understand (accepted: three words or more)".to_owned());
    }
    Ok(words.join(" "))
}

pub(crate) fn command(arguments: &GoldenArguments) -> Result<(), Failure> {
    let made = make().map_err(Failure::of_comparison)?;
    let golden = root().join(TABLES);
    if !golden.exists() {
        return match &arguments.accept {
            Some(reason) => accept(&made, reason, "The first tables."),
            None => Err(Failure::CannotCompare(format!("{TABLES} is not there (accepted: --accept REASON)"))),
        };
    }
    let is_signed =
        newest(&record()?) == Some(&*signature(&golden).map_err(|error| io("read", &golden, error))?);
    if !is_signed {
        say!("warning: {TABLES} are not those of the newest entry of {CHANGES}");
    }
    let mut diff = asperity()?;
    diff.arg("diff")
        .arg(TABLES)
        .arg(&made.tables)
        .arg("--force")
        .arg("--page")
        .arg(made.out.join("golden.html"));
    let compared =
        diff.output().map_err(|error| Failure::Io { what: "run asperity diff".to_owned(), error })?;
    print(format_args!("{}", String::from_utf8_lossy(&compared.stderr)));
    let summary = String::from_utf8_lossy(&compared.stdout).into_owned();
    print(format_args!("{summary}"));
    let code = compared.status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(2);
    match (&arguments.accept, code) {
        (Some(reason), 0) if !is_signed => accept(&made, reason, &summary),
        (Some(reason), 1) => accept(&made, reason, &summary),
        (Some(_), 0) => {
            say!("nothing to accept: the tables are the same");
            Ok(())
        }
        (_, 0) => Ok(()),
        _ => Err(Failure::Exit { program: "asperity diff".to_owned(), code }),
    }
}

/// The tables of the present code.
struct Made {
    out: PathBuf,
    tables: PathBuf,
    code_version: String,
}

fn make() -> Result<Made, Failure> {
    let asperity = asperity()?.get_program().to_owned();
    let out = root().join("out").join("golden");
    let tables = out.join("events");
    // Tables of runs that the pipeline no longer has would be compared all the same.
    if out.exists() {
        fs::remove_dir_all(&out).map_err(|error| io("remove", &out, error))?;
    }
    fs::create_dir_all(&tables).map_err(|error| io("create", &tables, error))?;
    let reproduced = out.join("reproduced");
    let mut reproduce = program(&asperity);
    reproduce.args(["reproduce", &pipeline(CHAPTER5), "--out"]).arg(&reproduced);
    run(reproduce.stdout(std::process::Stdio::null()))?;
    let runs = reproduced.join("runs");
    for entry in fs::read_dir(&runs).map_err(|error| io("read", &runs, error))? {
        let log = entry.map_err(|error| io("read", &runs, error))?.path();
        let table = tables.join(log.with_extension("csv").file_name().unwrap_or_default());
        let events = output(program(&asperity).arg("events").arg(&log))?;
        fs::write(&table, events).map_err(|error| io("write", &table, error))?;
    }
    Ok(Made { code_version: code_version(&mut program(&asperity))?, out, tables })
}

fn code_version(asperity: &mut Command) -> Result<String, Failure> {
    let said = output(asperity.arg("--version"))?;
    let version = said.lines().find_map(|line| line.strip_prefix("code version "));
    version.map(ToOwned::to_owned).ok_or_else(|| {
        Failure::Check(format!("asperity --version says {said:?} (accepted: a line `code version ...`)"))
    })
}

/// The accepted changes so far.
fn record() -> Result<String, Failure> {
    let changes = root().join(CHANGES);
    match fs::read_to_string(&changes) {
        Ok(text) => Ok(text),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(HEADING.to_owned()),
        Err(error) => Err(io("read", &changes, error)),
    }
}

/// Replaces the golden tables, and adds an entry to the record.
fn accept(made: &Made, reason: &str, summary: &str) -> Result<(), Failure> {
    let golden = root().join(TABLES);
    let changes = root().join(CHANGES);
    let before = record()?;
    if golden.exists() {
        for table in tables(&golden).map_err(|error| io("read", &golden, error))? {
            fs::remove_file(&table).map_err(|error| io("remove", &table, error))?;
        }
    }
    fs::create_dir_all(&golden).map_err(|error| io("create", &golden, error))?;
    for table in tables(&made.tables).map_err(|error| io("read", &made.tables, error))? {
        let to = golden.join(table.file_name().unwrap_or_default());
        fs::copy(&table, &to).map_err(|error| io("write", &to, error))?;
    }
    let signature = signature(&golden).map_err(|error| io("read", &golden, error))?;
    // Temporary paths are meaningless to later readers.
    let summary = summary.replace(&made.tables.display().to_string(), "the present code");
    let entry = entry(&signature, &made.code_version, reason, &summary);
    fs::write(&changes, with_entry(&before, &entry)).map_err(|error| io("write", &changes, error))?;
    say!("{TABLES} are those of the present code now; {CHANGES} says why");
    Ok(())
}

fn entry(signature: &str, code_version: &str, reason: &str, summary: &str) -> String {
    let mut entry = format!("{ENTRY}{signature}, by code version {code_version}\n\n{reason}\n\n");
    for line in summary.lines() {
        // Set as code, which Markdown leaves as it is.
        entry.push_str(format!("    {line}").trim_end());
        entry.push('\n');
    }
    entry
}

/// The record with an entry above those that it has.
fn with_entry(changes: &str, entry: &str) -> String {
    match changes.find(&format!("\n{ENTRY}")) {
        Some(first) => format!("{}\n{entry}\n{}", &changes[..first], &changes[first + 1..]),
        None => format!("{}\n\n{entry}", changes.trim_end()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_says_something() {
        for text in ["", "  ", "\n", "because", "new tables"] {
            assert!(reason(text).is_err(), "{text:?}");
        }
        assert_eq!(reason(" the load\n is  tilted ").as_deref(), Ok("the load is tilted"));
    }

    #[test]
    fn the_newest_change_stands_first() {
        let first = with_entry(HEADING, &entry("aa", "01", "the first one", "The first tables."));
        let second = with_entry(&first, &entry("bb", "02", "the second one", "1 of 2\n\n  differs"));
        let third = with_entry(&second, &entry("cc", "03", "the third one", "1"));
        assert_eq!(newest(HEADING), None);
        for (record, signature) in [(&first, "aa"), (&second, "bb"), (&third, "cc")] {
            assert_eq!(newest(record), Some(signature), "{record}");
            assert!(record.starts_with(HEADING), "{record}");
        }
        let entries: Vec<&str> = third.lines().filter(|line| line.starts_with("## ")).collect();
        assert_eq!(
            entries,
            [
                "## Tables cc, by code version 03",
                "## Tables bb, by code version 02",
                "## Tables aa, by code version 01"
            ]
        );
        assert!(third.contains("\n    1 of 2\n\n      differs\n\n## Tables aa"), "{third}");
    }

    #[test]
    fn a_signature_sees_names_and_contents() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("a.csv"), "1").expect("the folder can be written");
        let sign = || signature(folder.path()).expect("the folder can be read");
        let before = sign();
        fs::write(path("notes.md"), "no table").expect("the folder can be written");
        assert_eq!(sign(), before);
        fs::rename(path("a.csv"), path("b.csv")).expect("the folder can be written");
        let renamed = sign();
        fs::write(path("b.csv"), "2").expect("the folder can be written");
        assert!(renamed != before && sign() != renamed && sign() != before);
    }
}
