//! A small run all the way: solver, detectors, log, replay, tables, figures, and
//! a pipeline over several runs.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::binary::{contents, ends, run, succeed, text};
use crate::support::small;
use asperity_record::RunEnd;
use asperity_testkit::{folder, run_end};

/// The columns of the table of slip events that other people's programs rely on.
const PINNED: &str = "onset_s,end_s,first_block,last_block,max_sliding,ft_fn_onset,ft_fn_end";

fn events(log: &Path) -> String {
    succeed(&["events", text(log), "--format", "csv"])
}

#[test]
fn from_solver_to_figures() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    small::run(&log);
    assert_eq!(contents(folder.path()).len(), 1, "nothing but the log stays behind");

    let csv = events(&log);
    let (header, rows) = csv.split_once('\n').expect("the table has a header");
    let columns: Vec<&str> = header.split(',').collect();
    assert_eq!(columns[..7].join(","), PINNED);
    assert_eq!(rows.lines().count(), 28);

    let json: Vec<BTreeMap<String, serde_json::Value>> =
        serde_json::from_str(&succeed(&["events", text(&log), "--format", "json"]))
            .expect("the table is an array of objects");
    assert_eq!(json.len(), rows.lines().count());
    for (object, row) in json.iter().zip(rows.lines()) {
        assert_eq!(object.len(), columns.len());
        for (column, cell) in columns.iter().zip(row.split(',')) {
            // Read back, for the two write the same double differently.
            match object[*column].as_f64() {
                Some(number) => assert_eq!(Ok(number), cell.parse(), "{column}"),
                None => assert_eq!(object[*column].to_string(), cell, "{column}"),
            }
        }
    }

    assert!(succeed(&["replay", text(&log)]).contains("28 slip events, the same as logged"));
    assert_eq!(succeed(&["replay", text(&log), "--format", "csv"]), csv);

    let reduced = folder.path().join("reduced");
    succeed(&["reduce", text(&log), "--out", text(&reduced)]);
    let files = contents(&reduced);
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "events.csv",
            "events.parquet",
            "lengths.pdf",
            "lengths.png",
            "lengths.svg",
            "load.csv",
            "load.parquet",
            "load.pdf",
            "load.png",
            "load.svg",
            "precursor-ruptures.csv",
            "precursor-ruptures.parquet",
            "precursors.csv",
            "precursors.parquet",
            "reduce.json",
            "residuals.csv",
            "residuals.parquet",
            "ruptures.csv",
            "ruptures.parquet",
            "summary.csv",
            "summary.json",
        ]
    );
    assert_eq!(files["events.csv"], csv.as_bytes(), "both event tables are the same bytes");
    for (name, content) in &files {
        let (_, extension) = name.rsplit_once('.').expect("files have extensions");
        let is_whole = match extension {
            "png" => content.starts_with(b"\x89PNG\r\n\x1a\n") && content.ends_with(b"IEND\xaeB`\x82"),
            "pdf" => content.starts_with(b"%PDF-") && content.ends_with(b"%%EOF"),
            "svg" => content.starts_with(b"<?xml ") && content.ends_with(b"</svg>\n"),
            "parquet" => content.starts_with(b"PAR1") && content.ends_with(b"PAR1"),
            "csv" => std::str::from_utf8(content).is_ok_and(|text| text.lines().count() > 1),
            "json" => {
                serde_json::from_slice::<serde_json::Value>(content).is_ok_and(|record| record.is_object())
            }
            _ => false,
        };
        assert!(is_whole, "{name} is not what its name says");
    }
}

#[test]
fn a_run_is_repeated_from_its_log() {
    let folder = folder();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(format!("{name}.mcap")));
    small::run(&first);
    run(&[text(&first)], &second);
    assert_eq!(run_end(&first), run_end(&second));
    let shown = succeed(&["scenario", "show", text(&first), "--set", "time.duration_s=7"]);
    assert!(shown.contains("duration_s = 7.0"), "{shown}");
}

const PIPELINE: &str = r#"
title = "Two short runs"

[[run]]
name = "plain"
scenario = "ten-blocks"
set = ["parameter_set=as-coded", "time.step_s=1e-7", "time.duration_s=0.9"]

[[run]]
name = "tilted"
scenario = "ten-blocks"
set = ["parameter_set=as-coded", "time.step_s=1e-7", "time.duration_s=0.6", "normal_load.tilt=-0.5"]

[[precursors]]
run = "plain"
law = "linear"

[[figure.lengths]]
file = "lengths.png"
law = "tilted"
series = [{ run = "plain", label = "level" }, { run = "tilted", label = "tilted" }]
"#;

/// Runs the pipeline and returns its stderr.
fn reproduce(pipeline: &Path, out: &Path, jobs: &str) -> String {
    ends(0, &["reproduce", text(pipeline), "--out", text(out), "--jobs", jobs], &[])
}

/// The outputs of a pipeline: the run ends, the tables, the figures.
#[derive(PartialEq)]
struct Made {
    runs: BTreeMap<&'static str, RunEnd>,
    tables: BTreeMap<String, Vec<u8>>,
    figures: BTreeMap<String, Vec<u8>>,
}

impl Made {
    fn in_folder(out: &Path) -> Made {
        Made {
            runs: ["plain", "tilted"]
                .map(|name| (name, run_end(&out.join("runs").join(format!("{name}.mcap")))))
                .into(),
            tables: contents(&out.join("tables")),
            figures: contents(&out.join("figures")),
        }
    }
}

#[test]
fn pipelines_repeat_reuse_and_repair() {
    let folder = folder();
    let pipeline = folder.path().join("pipeline.toml");
    fs::write(&pipeline, PIPELINE).expect("the folder can be written");
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));

    let first = reproduce(&pipeline, &one, "1");
    assert!(!first.contains("there already"), "{first}");
    reproduce(&pipeline, &two, "2");
    let made = Made::in_folder(&one);
    assert!(made == Made::in_folder(&two), "one thread and two made different things");
    assert!(made.tables.contains_key("plain.precursors-linear.csv"));
    assert!(made.figures["lengths.png"].starts_with(b"\x89PNG"));

    let second = reproduce(&pipeline, &one, "1");
    assert!(second.contains("2 runs used again"), "{second}");
    assert!(Made::in_folder(&one) == made, "a second call made different things");

    let log = one.join("runs").join("tilted.mcap");
    let good = fs::read(&log).expect("the log can be read");
    let mut altered = good.clone();
    altered[good.len() / 2] ^= 1;
    for damaged in [&good[..good.len() / 2], &altered] {
        fs::write(&log, damaged).expect("the log can be damaged");
        let again = reproduce(&pipeline, &one, "1");
        assert!(again.contains("1 run used again"), "{again}");
        assert!(Made::in_folder(&one) == made, "a damaged log was not made again");
    }
}

#[test]
fn what_is_no_run_log_is_never_replaced() {
    let folder = folder();
    let (pipeline, out) = (folder.path().join("pipeline.toml"), folder.path().join("out"));
    fs::write(&pipeline, PIPELINE).expect("the folder can be written");
    fs::create_dir_all(out.join("runs")).expect("folders can be made");
    for (name, arguments) in
        [("tilted.mcap", &["--jobs", "1"][..]), ("tilted.mcap", &["--fresh"]), ("tilted.mcap.partial", &[])]
    {
        let notes = out.join("runs").join(name);
        fs::write(&notes, "what I measured on Monday").expect("the folder can be written");
        let refused = format!("{name}: not a run log");
        let reproduce = [&["reproduce", text(&pipeline), "--out", text(&out)], arguments].concat();
        ends(2, &reproduce, &[&refused, "it is not replaced"]);
        assert_eq!(fs::read_to_string(&notes).expect("it is there"), "what I measured on Monday");
        assert!(!out.join("runs").join("plain.mcap").exists(), "nothing was begun");
        fs::remove_file(&notes).expect("it is there");
    }
}

/// Ten blocks, driven and then unloaded until they slip as a whole, with a dense window; in both
/// parameter sets and with a second time step. All figures that such runs allow.
const UNLOADING: &str = r#"
title = "Short unloading"
first_global_slips = ["coded", "stated"]

[[run]]
name = "coded"
scenario = "ten-blocks"
set = [
  "parameter_set=as-coded",
  "time.step_s=2e-7", "time.duration_s=1.6", "normal_load.total_n=400",
  "drive.hold_from_s=1.0", "normal_load.schedule_s=[1.0, 1.6]", "normal_load.schedule_n=[400.0, 40.0]",
  "recording.window=[{ from_s = 0.0, to_s = 1.6, every_s = 1e-4, first_block = 1, last_block = 5 }]",
]

[[run]]
name = "stated"
scenario = "ten-blocks"
set = [
  "parameter_set=as-stated",
  "time.step_s=2e-7", "time.duration_s=1.6", "normal_load.total_n=400",
  "drive.hold_from_s=1.0", "normal_load.schedule_s=[1.0, 1.6]", "normal_load.schedule_n=[400.0, 40.0]",
]

[[run]]
name = "perturbed"
scenario = "ten-blocks"
set = [
  "parameter_set=as-coded",
  "time.step_s=2e-7", "time.duration_s=1.6", "normal_load.total_n=400", "initial_velocity.mode=0",
  "drive.hold_from_s=1.0", "normal_load.schedule_s=[1.0, 1.6]", "normal_load.schedule_n=[400.0, 40.0]",
]
keys = ["initial_velocity.amplitude_m_per_s"]
values = [1e-8, 2e-8]

[[figure.curve]]
curve = "loads"
file = "loads.png"
run = "coded"

[[figure.load]]
file = "load.png"
run = "coded"
sliding = true

[[figure.lengths]]
file = "lengths.png"
law = "linear"
series = [{ run = "coded", label = "N = 10" }]

[[figure.curve]]
curve = "displacement"
file = "displacement.png"
run = "coded"
keys.at_blocks = [1, 5, 10]

[[figure.curve]]
curve = "velocities"
file = "velocities.png"
run = "coded"
keys.blocks = 10

[[figure.study]]
file = "spread.png"
parameter = "time.step_s"
parameter_label = "Δt (s)"
logarithmic = true
measure = "first_global_event_onset_s"
measure_label = "t of first global slip (s)"
[[figure.study.panel]]
label = "N = 10"
stated = 1.4
series = [{ label = "coded", runs = ["coded", "perturbed-*"] }, { label = "stated", runs = ["stated"] }]

[[claim]]
about = "first global slip"
quote = "it comes after the hold"
of = "this project"
run = "coded"
spread = ["perturbed-*"]
measure = "first_global_event_onset_s"
at_least = 1.0
as_stated = { run = "stated" }
"#;

#[test]
fn unloading_is_drawn_and_claimed_in_both_parameter_sets() {
    let folder = folder();
    let pipeline = folder.path().join("pipeline.toml");
    fs::write(&pipeline, UNLOADING).expect("the folder can be written");
    let out = folder.path().join("out");
    reproduce(&pipeline, &out, "2");
    let figures = contents(&out.join("figures"));
    let names: Vec<&str> = figures.keys().map(String::as_str).collect();
    let stems = ["displacement", "lengths", "load", "loads", "spread", "velocities"];
    let expected =
        stems.into_iter().flat_map(|stem| ["pdf", "png", "svg"].map(|kind| format!("{stem}.{kind}")));
    assert_eq!(names, expected.collect::<Vec<_>>());
    let tables = contents(&out.join("tables"));
    let text = |name: &str| String::from_utf8(tables[name].clone()).expect("tables are UTF-8");
    let claims = text("claims.csv");
    assert!(claims.lines().next().is_some_and(|header| header.ends_with("as_stated_rule,as_stated_verdict")));
    assert!(claims.trim_end().ends_with("at least 1,agrees"), "{claims}");
    assert!(claims.contains(",\"at least 1, the median of 3 runs\",agrees,"), "{claims}");
    let page = text("claims.md");
    assert!(page.contains("What this project says:") && !page.contains("the thesis says"), "{page}");
    assert!(out.join("runs/perturbed-1.mcap").exists() && out.join("runs/perturbed-2.mcap").exists());
    // The load of the step, not that of the start.
    let slips = text("first-global-slips.csv");
    let row: BTreeMap<&str, &str> = {
        let mut lines = slips.lines();
        let header = lines.next().expect("the table has a header").split(',');
        header.zip(lines.next().expect("the table has rows").split(',')).collect()
    };
    let number = |name: &str| row[name].parse::<f64>().expect("the column holds numbers");
    let expected_n = 400.0 - 600.0 * (number("onset_s") - 1.0);
    assert!((number("normal_load_onset_n") - expected_n).abs() < 1e-6, "{slips}");
}

#[test]
fn pipelines_that_ask_for_what_is_not_there_are_refused_by_name() {
    let folder = folder();
    let refused = |code: i32, from: &str, to: &str, expected: &str| {
        let pipeline = folder.path().join("pipeline.toml");
        fs::write(&pipeline, UNLOADING.replace(from, to)).expect("the folder can be written");
        let out = folder.path().join("out");
        ends(code, &["reproduce", text(&pipeline), "--out", text(&out)], &[expected])
    };
    let missing = "there is no run missing (accepted: coded, perturbed-1, perturbed-2, stated)";
    let spread = "claim about first global slip: minus_spread: 0 runs (accepted: 2, one for each of spread)";
    for (from, to, expected) in [
        ("as_stated = { run = \"stated\" }", "as_stated = { run = \"missing\" }", missing),
        ("at_least = 1.0\n", "at_least = 1.0\nminus = \"missing\"\n", missing),
        ("first_global_slips = [\"coded\", ", "first_global_slips = [\"missing\", ", missing),
        ("runs = [\"stated\"]", "runs = [\"missing\"]", missing),
        (
            "first_global_slips = [\"coded\", ",
            "main_figure = \"load\"\nfirst_global_slips = [\"coded\", ",
            "main_figure: there is no figure load; did you mean ",
        ),
        ("at_least = 1.0\n", "at_least = 1.0\nminus = \"stated\"\n", spread),
        (
            "values = [1e-8, 2e-8]",
            "values = []",
            "run perturbed: 0 values are not accepted (accepted: 1 to 1000)",
        ),
        (
            "of = \"this project\"",
            "of = \"us\"",
            "of = \"us\" is not accepted (accepted: the thesis, this project)",
        ),
    ] {
        refused(2, from, to, expected);
    }
    let expected = "figure displacement.png: at_blocks: 11 is not in run coded (accepted: 1 to 10)";
    refused(1, "blocks = [1, 5, 10]", "blocks = [1, 11]", expected);
}
