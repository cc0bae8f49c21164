//! Typical mistakes of new users: each is refused as bad input, with the error, its place, and the
//! correction; and nothing is written.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::support::binary::names;

/// The scenario, sweep and pipeline that mistakes are made in; a mistake replaces a part of one.
const SCENARIO: &str = "[slider]\nblocks = 10\n\n[time]\nduration_s = 0.01\n";
const SWEEP: &str = "title = \"Tilts\"\nscenario = \"mine.toml\"\n\n[[axis]]\nkey = \"normal_load.tilt\"\nvalues = [0, 0.5]\n\n\
                     [[figure.family]]\nfile = \"load.png\"\nx = \"normal_load.tilt\"\ny = \"precursor_count\"\n";
const PIPELINE: &str = "title = \"One\"\n\n[[run]]\nname = \"tilted\"\nscenario = \"mine.toml\"\n\n\
                        [[claim]]\nabout = \"a\"\nquote = \"b\"\nrun = \"tilted\"\nmeasure = \"event_count\"\nat_least = 0\n";

/// A folder with these files, which commands run in.
fn folder() -> tempfile::TempDir {
    let folder = asperity_testkit::folder();
    for (name, text) in [("mine.toml", SCENARIO), ("sweep.toml", SWEEP), ("pipeline.toml", PIPELINE)] {
        fs::write(folder.path().join(name), text).expect("the folder can be written");
    }
    folder
}

/// The exit code and stderr of a command, whose words are separated by spaces.
fn said(folder: &Path, command: &str) -> (Option<i32>, String) {
    let mut asperity = Command::new(env!("CARGO_BIN_EXE_asperity"));
    let output = asperity.current_dir(folder).args(command.split(' ')).output().expect("the binary starts");
    (output.status.code(), String::from_utf8(output.stderr).expect("the binary writes UTF-8"))
}

/// Checks that a command is refused in these words, and leaves nothing.
fn refused(folder: &Path, command: &str, words: &[&str]) {
    let before = names(folder);
    let (code, said) = said(folder, command);
    assert_eq!(code, Some(2), "{command}: {said}");
    for word in words {
        assert!(said.contains(word), "{command}: {word} is not in:\n{said}");
    }
    let longest = said.lines().map(str::len).max().unwrap_or_default();
    assert!(longest < 500, "{command}: a line of {longest} bytes:\n{said}");
    assert_eq!(names(folder), before, "{command} left something");
}

#[test]
fn mistaken_commands_and_options_lead_to_the_right_ones() {
    let folder = folder();
    for (command, words) in [
        ("list", &["'asperity scenario list'"][..]),
        ("validate mine.toml", &["'asperity scenario validate'"]),
        ("show default", &["'asperity scenario show'"]),
        ("scenario run mine.toml", &["'asperity run'"]),
        ("mine.toml", &["'asperity run mine.toml -o RUN.mcap'"]),
        ("runs mine.toml", &["similar", "'run'"]),
        ("run mine.toml", &["--out <RUN.mcap>"]),
        ("run mine.toml -o x.mcap --sovler fast", &["'--solver'"]),
        ("run mine.toml -o x.mcap --solver quick", &["fast, plain"]),
        ("run defualt -o x.mcap", &["did you mean default?", "`asperity scenario list`"]),
        ("run mien.toml -o x.mcap", &["mien.toml", "No such file", "`asperity scenario list`"]),
        ("run unload -o x.mcap", &["did you mean unload-400 or unload-600 or unload-800?"]),
        ("run mine.toml -o x.h5", &["--out x.h5", "a run log", "(accepted: x.mcap)"]),
        ("run mine.toml -o mine.toml", &["mine.toml exists already"]),
        ("run mine.toml -o .", &["is a folder (accepted: a file, as ./run.mcap)"]),
        ("run mine.toml -o mine.toml/x.mcap", &["mine.toml/x.mcap.partial is in a folder that is a file"]),
        ("sweep plan sweep.toml -o plan.csv", &["--out plan.csv", "(accepted: a folder, as plan)"]),
        ("summary none.mcap", &["none.mcap: there is no such file"]),
        ("check", &["<RUN.mcap>"]),
    ] {
        refused(folder.path(), command, words);
    }
    refused(folder.path(), "plot none.mcap", &["the command is 'asperity "]);
}

#[test]
fn mistaken_values_are_refused_where_they_stand() {
    let folder = folder();
    for (set, words) in [
        ("slider.blokcs=100", &["did you mean slider.blocks?"][..]),
        ("slider.blocks=10.5", &["10.5 is not accepted (accepted: a whole number from 1 to 100000)"]),
        ("slider.blocks=many", &["\"many\" is not accepted (accepted: a whole number from 1"]),
        (
            "slider.length_m=100mm",
            &["\"100mm\" is not accepted (accepted: a number above 0, in m, without its unit"],
        ),
        ("normal_load.tilt=0,5", &["with a decimal point)"]),
        ("slider.blocks", &["KEY=VALUE"]),
        ("drive.kind=botom", &["\"side\" or \"top\" or \"left-right\""]),
    ] {
        refused(folder.path(), &format!("run mine.toml -o x.mcap --set {set}"), words);
    }
}

#[test]
fn mistakes_in_sweeps_and_pipelines_are_refused_with_what_is_meant() {
    let folder = folder();
    let made = |file: &str, of: &str, from: &str, to: &str| {
        assert!(of.contains(from), "{from}");
        fs::write(folder.path().join(file), of.replacen(from, to, 1)).expect("the folder can be written");
    };
    for (from, to, words) in [
        (
            "\"normal_load.tilt\"\nv",
            "\"normal_load.tlit\"\nv",
            &["axis 1: ", "did you mean normal_load.tilt?"][..],
        ),
        ("[[axis]]", "[[axes]]", &["line 4, column 3: axes: unknown key; did you mean axis?"]),
        ("values", "value", &["value: unknown key; did you mean values?"]),
        (
            "values = [0, 0.5]",
            "values = [0, 1.5]",
            &["1.5 is not accepted (accepted: a number from -1 to 1)"],
        ),
        ("values = [0, 0.5]", "values = []", &["no values (accepted: one or more)"]),
        (
            "values = [0, 0.5]",
            "from = 0\nto = 0.5\ncount = 2.5",
            &["count = 2.5 is not accepted (accepted: a whole"],
        ),
        ("values = [0, 0.5]", "values = [0, 0.5", &["not TOML: "]),
        (
            "values = [0, 0.5]",
            "values = [0]\nset = []",
            &["set: unknown key", "stands above the first [[...]]"],
        ),
        ("mine.toml", "mien.toml", &["scenario mien.toml", "No such file"]),
        (
            "figure.family",
            "figure.famliy",
            &["famliy: unknown key; did you mean family? (accepted: family, "],
        ),
        ("x = \"normal_load.tilt\"", "x = \"normal_load.tlit\"", &["did you mean normal_load.tilt?"]),
        (
            "precursor_count",
            "precursors",
            &["y = \"precursors\" does not vary", "`asperity summary --schema`"],
        ),
        ("load.png", "load.svg", &["ending in .png"]),
    ] {
        made("sweep.toml", SWEEP, from, to);
        refused(folder.path(), "sweep plan sweep.toml -o out", words);
    }
    for (from, to, words) in [
        ("event_count", "event_conut", &["did you mean event_count?"][..]),
        ("run = \"tilted\"", "run = \"tlited\"", &["there is no run tlited; did you mean tilted?"]),
        (
            "[[claim]]",
            "[[run]]\nname = \"tilted\"\nscenario = \"default\"\n[[claim]]",
            &["two runs are called tilted"],
        ),
        (
            "name = \"tilted\"",
            "nmae = \"tilted\"",
            &["line 4, column 1: nmae: unknown key; did you mean name?"],
        ),
        (
            "[[claim]]",
            "[[figure.spacetime]]\n[[claim]]",
            &["did you mean space-time?", "others, see asperity figures"],
        ),
        ("title = \"One\"\n", "", &["title is missing here"]),
        ("[[run]]", "run = 3\n[[runs]]", &["line 3, column 7"]),
        ("name = \"tilted\"", "name = \"a/b\"", &["\"a/b\" is no file name"]),
        ("mine.toml", "mien.toml", &["run tilted: scenario mien.toml"]),
        (
            "\"mine.toml\"",
            "\"mine.toml\"\nset = [\"slider.blocks=0\"]",
            &["run tilted: --set slider.blocks=0: slider.blocks: 0 is not accepted"],
        ),
        (
            "[[claim]]",
            "[[precursors]]\nrun = \"b\"\nlaw = \"tilted\"\n[[claim]]",
            &["there is no run b (accepted: tilted)"],
        ),
    ] {
        made("pipeline.toml", PIPELINE, from, to);
        refused(folder.path(), "reproduce pipeline.toml -o out", words);
    }
}

/// A number with a point is a whole one where a whole one is meant: the scenario, and so its log, are the same.
#[test]
fn whole_numbers_may_have_a_point() {
    let folder = folder();
    let hash = |set: &str| {
        let toml = said_out(folder.path(), &format!("scenario show mine.toml --set {set}"));
        assert!(toml.contains("blocks = 20\n"), "{toml}");
        toml
    };
    assert_eq!(hash("slider.blocks=20.0"), hash("slider.blocks=20"));
    assert_eq!(hash("slider.blocks=2e1"), hash("slider.blocks=20"));
    let plan = |values: &str, out: &str| {
        let axis = "[[axis]]\nkey = \"slider.blocks\"\n";
        let text = format!("title = \"N\"\nscenario = \"mine.toml\"\n{axis}{values}\n");
        fs::write(folder.path().join("sweep.toml"), text).expect("the folder can be written");
        said_out(folder.path(), &format!("sweep plan sweep.toml -o {out}"));
        let plan = fs::read_to_string(folder.path().join(out).join("plan.ndjson")).expect("it was planned");
        plan.lines().skip(1).map(str::to_owned).collect::<Vec<String>>()
    };
    let whole = plan("values = [10, 20]", "whole");
    assert_eq!(plan("values = [10.0, 2e1]", "pointed"), whole);
    assert_eq!(plan("from = 10\nto = 20\ncount = 2.0", "ranged"), whole);
}

/// The output of a command, which must succeed.
fn said_out(folder: &Path, command: &str) -> String {
    let mut asperity = Command::new(env!("CARGO_BIN_EXE_asperity"));
    let output = asperity.current_dir(folder).args(command.split(' ')).output().expect("the binary starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command}: {stderr}");
    String::from_utf8(output.stdout).expect("the binary writes UTF-8")
}
