//! `cargo xtask golden`: the golden event tables against the present code, and
//! the one way to accept that they change.
//!
//! Accepting requires a reason, which the repository records beside the change.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::golden_tables::{CHANGES, ENTRY, TABLES, newest, signature, tables};
use crate::reproduce::{CHAPTER5, event_tables, pipeline};
use crate::say::{print, say};
use crate::workspace::{
    Failure, asperity, emptied, io, not_started, output, program, read, root, run, write,
};

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
    let (made, code_version) = make().map_err(Failure::of_comparison)?;
    let (golden, changes) = (root().join(TABLES), root().join(CHANGES));
    let record = if changes.exists() { read(&changes)? } else { HEADING.to_owned() };
    let accept = |summary: &str| match &arguments.accept {
        Some(reason) => accept(&made, &record, |signature| {
            // Temporary paths are meaningless to later readers.
            let summary = summary.replace(&made.display().to_string(), "the present code");
            entry(signature, &code_version, reason, &summary)
        }),
        None => Err(Failure::CannotCompare(format!("{TABLES} is not there (accepted: --accept REASON)"))),
    };
    if !golden.exists() {
        return accept("The first tables.");
    }
    let is_signed = newest(&record) == Some(&*signature(&golden).map_err(io("read", &golden))?);
    if !is_signed {
        say!("warning: {TABLES} are not those of the newest entry of {CHANGES}");
    }
    let mut diff = asperity()?;
    diff.arg("diff").arg(TABLES).arg(&made).arg("--force");
    diff.arg("--page").arg(made.with_file_name("golden.html"));
    let compared = diff.output().map_err(not_started(&diff))?;
    let summary = String::from_utf8_lossy(&compared.stdout).into_owned();
    print(format_args!("{}{summary}", String::from_utf8_lossy(&compared.stderr)));
    let code = compared.status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(2);
    match (&arguments.accept, code) {
        (Some(_), 1) => accept(&summary),
        (Some(_), 0) if !is_signed => accept(&summary),
        (Some(_), 0) => {
            say!("nothing to accept: the tables are the same");
            Ok(())
        }
        (None, 0) => Ok(()),
        _ => Err(Failure::Exit { program: "asperity diff".to_owned(), code }),
    }
}

/// Makes the tables of the present code, and returns their folder and the code version.
fn make() -> Result<(PathBuf, String), Failure> {
    let mut asperity = asperity()?;
    let (program_of, out) = (asperity.get_program().to_owned(), root().join("out").join("golden"));
    // Tables of runs that the pipeline no longer has would be compared all the same.
    emptied(&out)?;
    let (reproduced, tables) = (out.join("reproduced"), out.join("events"));
    let mut reproduce = program(&program_of);
    reproduce.args(["reproduce", &pipeline(CHAPTER5), "--out"]).arg(&reproduced);
    run(reproduce.stdout(std::process::Stdio::null()))?;
    event_tables(program_of.as_ref(), &reproduced, &tables)?;
    let said = output(asperity.arg("--version"))?;
    let version = said.lines().find_map(|line| line.strip_prefix("code version ")).ok_or_else(|| {
        Failure::Check(format!("asperity --version says {said:?} (accepted: a line `code version ...`)"))
    })?;
    Ok((tables, version.to_owned()))
}

/// Replaces the golden tables by those in a folder, and adds the entry for their signature to the record.
fn accept(made: &Path, record: &str, entry: impl FnOnce(&str) -> String) -> Result<(), Failure> {
    let (golden, changes) = (root().join(TABLES), root().join(CHANGES));
    emptied(&golden)?;
    for table in tables(made).map_err(io("read", made))? {
        let to = golden.join(table.file_name().unwrap_or_default());
        fs::copy(&table, &to).map_err(io("write", &to))?;
    }
    let signature = signature(&golden).map_err(io("read", &golden))?;
    write(&changes, &with_entry(record, &entry(&signature)))?;
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
