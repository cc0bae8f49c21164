//! Running the built `asperity` binary.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use asperity_model::scenario::builtin;
use asperity_runlog::partial_path;
use asperity_testkit::read_log;

/// Runs the binary to its end, with arguments [as coded](as_coded).
pub(crate) fn asperity(arguments: &[&str]) -> Output {
    as_given(&as_coded(arguments))
}

/// Makes a command run or validate a built-in scenario as coded, unless the scenario or a later override
/// names another parameter set: the events that tests expect are those of the thesis' program.
pub(crate) fn as_coded<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = arguments.to_vec();
    let names_no_set = |name: &&str| builtin::find(name).is_some_and(|text| !text.contains("parameter_set"));
    let begins = arguments.iter().position(|word| matches!(*word, "run" | "validate"));
    let scenario = arguments.iter().position(names_no_set);
    if let (Some(place), Some(_)) = (scenario, begins.filter(|begins| Some(*begins) < scenario)) {
        arguments.splice(place + 1..=place, ["--set", AS_CODED]);
    }
    arguments
}

/// Runs the binary to its end, with no other arguments than these.
pub(crate) fn as_given(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_asperity")).args(arguments).output().expect("the binary starts")
}

/// The override that makes runs as coded.
pub(crate) const AS_CODED: &str = "parameter_set=as-coded";

/// Runs the binary to its end, which must be a good one, and gives its standard output.
pub(crate) fn succeed(arguments: &[&str]) -> String {
    let output = asperity(arguments);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "asperity {}: {}\n{stderr}", arguments.join(" "), output.status);
    String::from_utf8(output.stdout).expect("the binary writes UTF-8")
}

/// A scenario, or a command with one, with these overrides.
pub(crate) fn with_sets<'a>(scenario: &[&'a str], sets: &[&'a str]) -> Vec<&'a str> {
    let sets = sets.iter().flat_map(|set| ["--set", *set]);
    scenario.iter().copied().chain(sets).collect()
}

/// How a command ended: its exit code, standard output and standard error.
pub(crate) fn outcome(arguments: &[&str]) -> (i32, String, String) {
    let Output { status, stdout, stderr } = asperity(arguments);
    let utf8 = |bytes| String::from_utf8(bytes).expect("the binary writes UTF-8");
    (status.code().expect("it ends by itself"), utf8(stdout), utf8(stderr))
}

/// Runs the binary, which must end with this code and have these words on standard error; gives all that is there.
#[track_caller]
pub(crate) fn ends(code: i32, arguments: &[&str], words: &[&str]) -> String {
    let (found, out, said) = outcome(arguments);
    assert_eq!(found, code, "asperity {}: {out}{said}", arguments.join(" "));
    let lacks = words.iter().find(|word| !said.contains(**word));
    assert_eq!(lacks, None, "asperity {}: {said}", arguments.join(" "));
    said
}

/// Runs a scenario, given with its overrides, and logs it.
pub(crate) fn run(scenario: &[&str], out: &Path) {
    let arguments = [&["run"], scenario, &["--out", text(out)]].concat();
    succeed(&arguments);
}

/// Compares the results of a run resumed from parts of its log, in eighths, with its complete log. `run`
/// resumes it.
pub(crate) fn goes_on(run: &[&str], eighths: &[usize]) {
    let folder = asperity_testkit::folder();
    let (whole, resumed) = (folder.path().join("whole.mcap"), folder.path().join("resumed.mcap"));
    let begin = [run, &["--checkpoint-s", "0.002", "--resume", "--out"]].concat();
    succeed(&[&begin[..], &[text(&whole)]].concat());
    let (items, end) = read_log(&whole).expect("the log is whole");
    let bytes = fs::read(&whole).expect("it can be read");
    for eighths in eighths {
        let left = &bytes[..bytes.len() * eighths / 8];
        fs::write(partial_path(&resumed), left).expect("it can be written");
        succeed(&[&begin[..], &[text(&resumed)]].concat());
        let (again, end_again) = read_log(&resumed).expect("the log is whole");
        assert!(again == items, "other items after {eighths} eighths");
        assert_eq!(end_again.topic_digests, end.topic_digests);
        fs::remove_file(&resumed).expect("the log is there");
    }
}

/// The names of what is in a folder.
pub(crate) fn names(folder: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(folder).expect("the folder is there");
    entries.map(|entry| entry.expect("it can be read").file_name().to_string_lossy().into_owned()).collect()
}

/// The rows of a CSV file, by the names of its columns.
pub(crate) fn rows(csv: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_reader(csv);
    reader.deserialize().map(|row| row.expect("it is CSV")).collect()
}

/// Name and bytes of every file in a folder.
pub(crate) fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries =
        fs::read_dir(folder).expect("the folder is there").map(|entry| entry.expect("it can be read").path());
    let read = |path: PathBuf| {
        let name = path.file_name().expect("entries have names").to_string_lossy().into_owned();
        (name, fs::read(&path).expect("its files can be read"))
    };
    entries.map(read).collect()
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("temporary folders have plain names")
}
