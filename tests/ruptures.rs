//! Ruptures of whole runs: against the definition of `docs/ruptures.md` computed in another language from
//! exported switches, against known counts, and with other criteria for linking detachments.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

use asperity_record::{EventKind, GlobalSlip, Onset, RunHeader, RunStatus, SlipEvent, SolverReport};
use asperity_runlog::{Content, Existing, LogItem, RunReader, RunWriter, Topics};
use serde_json::Value;

use crate::support::binary::{self, asperity, ends, outcome, succeed, text, with_sets};
use crate::support::clients::{file, said};
use crate::support::small;

/// Ruptures by the definition, of a log that is exported beside itself.
fn by_definition(tables: &Path) -> Output {
    Command::new("python3")
        .arg(file("tests/clients/ruptures.py"))
        .arg(tables)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .expect("python3 starts")
}

/// Exports a log, and checks its ruptures and arrivals against the definition. Returns their counts.
fn held_to_the_definition(log: &Path) -> Value {
    let tables = log.with_extension("tables");
    succeed(&["export", text(log), "--to", "csv", "--out", text(&tables)]);
    let output = by_definition(&tables);
    assert!(output.status.success(), "{}: {}", log.display(), said(&output));
    serde_json::from_slice(&output.stdout).expect("it prints JSON")
}

/// Makes a run and checks its ruptures against the definition.
fn run_and_hold(folder: &Path, name: &str, scenario: &[&str]) -> Value {
    let log = folder.join(format!("{name}.mcap"));
    binary::run(scenario, &log);
    held_to_the_definition(&log)
}

fn count(counts: &Value, of: &str) -> u64 {
    counts[of].as_u64().unwrap_or_else(|| panic!("{of} is not among {counts}"))
}

/// Longer steps than the default, to keep runs short.
const STEP: [&str; 2] = ["--set", "time.step_s=1e-7"];

/// Creeps at its driven end from the start on; its first global slip is at 2.764 s.
const CREEPING: [&str; 7] = [
    "default",
    "--set",
    "friction.static_coefficient=0.5",
    "--set",
    "friction.dynamic_coefficient=0.45",
    "--set",
    "normal_load.tilt=-0.8",
];

#[test]
fn ruptures_are_those_of_the_definition() {
    let folder = asperity_testkit::folder();
    let run = |name: &str, scenario: &[&str], set: &[&str]| {
        run_and_hold(folder.path(), name, &with_sets(&[scenario, &STEP].concat(), set))
    };
    let default = run("default", &["default"], &["time.duration_s=3"]);
    assert!(count(&default, "growing") > 40 && count(&default, "global") > 3, "{default}");
    assert!(count(&default, "again") > 0 && count(&default, "open") > 0, "{default}");

    let creeping = run("creeping", &CREEPING, &["time.duration_s=3.2"]);
    assert!(count(&creeping, "overlapping") > 50 && count(&creeping, "global") > 3, "{creeping}");

    let both = run("both", &["left-right-driven"], &["time.duration_s=2.5"]);
    assert!(count(&both, "down") > 50 && count(&both, "overlapping") > 50, "{both}");

    let scattered = run("scattered", &["scattered-friction"], &["slider.blocks=300", "time.duration_s=0.5"]);
    assert!(count(&scattered, "down") > 30 && count(&scattered, "of_three_blocks") > 30, "{scattered}");

    let top = ["drive.kind=top", "slider.blocks=50", "time.duration_s=3.6"];
    let top = run("top", &["scattered-friction"], &top);
    assert!(count(&top, "global") > 0 && count(&top, "down") > 0, "{top}");

    // Over an area: oblique fronts, and ruptures that do not fill their boxes.
    for (name, scenario, sets, least) in [
        ("sheet", "sheet-coarse", &small::SHEET[..], [20, 200]),
        ("body", "body-coarse", &small::BODY[..], [5, 10]),
    ] {
        let found = run_and_hold(folder.path(), name, &with_sets(&[scenario], sets));
        let [boxes, speeds] = least;
        assert!(count(&found, "in_part_of_their_box") >= boxes && count(&found, "global") > 0, "{found}");
        assert!(count(&found, "with_local_speeds") >= speeds && count(&found, "overlapping") > 0, "{found}");
    }

    let stated = run_and_hold(
        folder.path(),
        "stated",
        &["default", "--set", "parameter_set=as-stated", "--set", "time.duration_s=1"],
    );
    assert!(count(&stated, "growing") > 20 && count(&stated, "down") > 0, "{stated}");
}

/// The comparison must detect differences: one wrong value of each table, one row more.
#[test]
#[ignore = "fifty calls of another program: cargo xtask nightly"]
fn the_program_of_the_definition_sees_what_differs() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    binary::run(&["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1.2"], &log);
    assert_eq!(count(&held_to_the_definition(&log), "ruptures"), 3);
    let tables = folder.path().join("run.tables");
    let mut tried = 0;
    for name in ["run.events.rupture.csv", "run.events.arrival.csv"] {
        let path = tables.join(name);
        let table = fs::read_to_string(&path).expect("the table is there");
        let mut lines = table.lines();
        let header = lines.next().expect("it has a header");
        let row: Vec<&str> = lines.next().expect("it has a row").split(',').collect();
        let rest: Vec<&str> = lines.collect();
        for (column, column_name) in header.split(',').enumerate() {
            let mut wrong = row.clone();
            wrong[column] = match wrong[column] {
                "" => "1",
                "true" => "false",
                "false" => "true",
                "0" => "7",
                _ => "0",
            };
            let wrong = wrong.join(",");
            let lines = [&[header, &wrong], &rest[..]].concat();
            fs::write(&path, lines.join("\n") + "\n").expect("the table can be written");
            let output = by_definition(&tables);
            assert!(!output.status.success(), "{name}: {column_name} of another value passes");
            tried += 1;
        }
        fs::write(&path, format!("{table}{}\n", row.join(","))).expect("the table can be written");
        assert!(!by_definition(&tables).status.success(), "{name}: a row more passes");
        fs::write(&path, &table).expect("the table can be written");
    }
    assert!(by_definition(&tables).status.success() && tried > 40);
}

/// The table of `docs/ruptures.md`: ruptures of three blocks or more, those that contain block 1 and reach
/// farther than all before, and those of the whole slider, for several criteria of linking detachments.
fn assert_counts(folder: &Path, scenario: &[&str], expected: &[(f64, [u64; 3])]) {
    let log = folder.join("run.mcap");
    binary::run(scenario, &log);
    for (ratio, expected) in expected {
        let out = folder.join(format!("ratio-{ratio}"));
        let rows = replayed(&log, *ratio, &out);
        let mut reached = 0;
        let mut counts = [0; 3];
        for row in &rows {
            let (first, last) = (row[3].parse::<u64>().unwrap(), row[4].parse::<u64>().unwrap());
            counts[0] += u64::from(last - first >= 2);
            if first == 1 && last > reached {
                reached = last;
                counts[1] += 1;
            }
            counts[2] += u64::from(row[6] == "true");
        }
        assert_eq!(counts, *expected, "{scenario:?} by a ratio of {ratio}");
    }
}

/// The ruptures of a log by another ratio, as a replay writes them.
fn replayed(log: &Path, ratio: f64, out: &Path) -> Vec<Vec<String>> {
    let settings = out.with_extension("toml");
    fs::write(&settings, format!("detectors = [\"rupture\"]\nlink_time_ratio = {ratio:?}\n")).unwrap();
    succeed(&["replay", text(log), "--detectors", text(&settings), "--out", text(out)]);
    let name = log.file_stem().expect("it has a name").to_string_lossy();
    let table = fs::read_to_string(out.join(format!("{name}.ruptures.csv"))).expect("the table is there");
    assert!(
        table.starts_with(
            "rupture,onset_s,end_s,first_block,last_block,nucleation_block,reached_every_block,"
        )
    );
    table.lines().skip(1).map(|row| row.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn counts_hardly_depend_on_what_links_detachments() {
    let folder = asperity_testkit::folder();
    let as_coded = [
        (3.0, [157, 11, 0]),
        (10.0, [196, 58, 25]),
        (30.0, [196, 58, 25]),
        (100.0, [196, 58, 25]),
        (300.0, [186, 58, 25]),
        (1000.0, [121, 54, 25]),
    ];
    assert_counts(folder.path(), &["default"], &as_coded);
}

#[test]
#[ignore = "half a minute: cargo xtask nightly, and when the definition or its detector changes"]
fn counts_hardly_depend_on_what_links_detachments_as_stated_and_creeping() {
    let folder = asperity_testkit::folder();
    let as_stated = [
        (3.0, [668, 19, 6]),
        (10.0, [323, 52, 35]),
        (30.0, [315, 52, 35]),
        (100.0, [286, 52, 39]),
        (300.0, [263, 52, 35]),
        (1000.0, [230, 52, 35]),
    ];
    assert_counts(folder.path(), &["default", "--set", "parameter_set=as-stated"], &as_stated);
    let folder = asperity_testkit::folder();
    let creeping = [
        (3.0, [0, 2, 0]),
        (10.0, [115, 3, 0]),
        (30.0, [39, 3, 38]),
        (100.0, [40, 2, 38]),
        (300.0, [40, 2, 38]),
        (1000.0, [40, 2, 38]),
    ];
    assert_counts(folder.path(), &[&CREEPING[..], &["--set", "time.duration_s=4"]].concat(), &creeping);
}

/// Every run of Chapter 5, at its own resolution.
#[test]
#[ignore = "minutes: cargo xtask nightly, and when the definition or its detector changes"]
fn ruptures_of_chapter_5_are_those_of_the_definition() {
    for set in ["as-coded", "as-stated"] {
        let folder = asperity_testkit::folder();
        let pipeline = file("pipelines/chapter5.toml");
        let set = format!("parameter_set={set}");
        succeed(&["reproduce", text(&pipeline), "--set", &set, "--out", text(folder.path())]);
        let mut logs: Vec<_> = fs::read_dir(folder.path().join("runs"))
            .expect("there are runs")
            .map(|entry| entry.expect("the folder can be read").path())
            .filter(|path| path.extension().is_some_and(|extension| extension == "mcap"))
            .collect();
        logs.sort();
        assert!(logs.len() > 15, "{} runs", logs.len());
        for log in logs {
            let counts = held_to_the_definition(&log);
            let name = log.file_stem().expect("it has a name").to_string_lossy();
            writeln!(std::io::stdout(), "{set} {name}: {counts}").expect("it is open");
        }
    }
}

#[test]
fn a_replay_by_the_ratio_of_another_run_gives_its_ruptures() {
    let folder = asperity_testkit::folder();
    let set = ["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=3"];
    let [usual, narrow] = ["usual", "narrow"].map(|name| folder.path().join(format!("{name}.mcap")));
    binary::run(&set, &usual);
    binary::run(&[&set[..], &["--set", "detection.link_time_ratio=3"]].concat(), &narrow);
    let of = |log: &Path, ratio, name: &str| replayed(log, ratio, &folder.path().join(name));
    let live = of(&narrow, 3.0, "live");
    assert_eq!(of(&usual, 3.0, "replayed"), live);
    assert_ne!(of(&usual, 100.0, "as-usual"), live);
    // Those are the events of the log, and the log states the criteria.
    assert!(succeed(&["replay", text(&narrow)]).contains("the same as logged"));
    held_to_the_definition(&narrow);
    let manifest = fs::read_to_string(folder.path().join("narrow.tables/narrow.csv.export.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(manifest["run"]["scales"]["link_time_ratio"], 3.0);
}

/// Detectors of other code find no ruptures in this run.
fn without_ruptures(log: &Path, to: &Path) {
    let mut reader = RunReader::open(log, Topics::ALL).expect("the log has a header");
    let header = RunHeader { code_version: "other".to_owned(), ..reader.header().clone() };
    let kinds = [EventKind::of::<Onset>(), EventKind::of::<SlipEvent>(), EventKind::of::<GlobalSlip>()];
    let scenario = reader.scenario_toml().to_owned();
    let mut writer =
        RunWriter::create(to, Existing::Refuse, &header, &scenario, &kinds, Content::Text).unwrap();
    while let Some(item) = reader.next_item().expect("the log is whole") {
        match item {
            LogItem::Record(record) => writer.record(&record).unwrap(),
            LogItem::Event(event) if kinds.iter().any(|kind| kind.topic == event.topic()) => {
                writer.event(&event).unwrap();
            }
            LogItem::Event(_) => {}
        }
    }
    writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
}

#[test]
fn a_log_by_other_detectors_has_no_ruptures_and_commands_say_so() {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let (usual, log) = (path("usual.mcap"), path("log.mcap"));
    small::run(&usual);
    without_ruptures(&usual, &log);
    ends(6, &["check", text(&log)], &[]);
    let said = String::from_utf8(asperity(&["check", text(&log)]).stdout).unwrap();
    assert!(said.contains("it lacks /events/arrival, /events/rupture"), "{said}");
    let none = "its log has no ruptures, since other detectors wrote it";
    ends(0, &["summary", text(&log)], &[none]);
    let out = path("exported");
    let export = ["export", text(&log), "--to", "csv", "--topic", "/events/rupture", "-o", text(&out)];
    ends(2, &export, &["the log holds no /events/rupture, since", "replay"]);
    let (_, said, _) = outcome(&["diff", text(&log), text(&usual)]);
    assert!(said.contains("ruptures not compared: "), "{said}");
    // A replay finds them.
    assert_eq!(replayed(&log, 100.0, &path("of-log")), replayed(&usual, 100.0, &path("of-usual")));
    {
        let tables = path("tables");
        ends(0, &["reduce", text(&log), "--out", text(&tables)], &[none]);
        assert!(!tables.join("ruptures.csv").exists() && tables.join("events.csv").exists());
    }
}

#[test]
fn what_links_detachments_must_be_a_number_above_0() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    for value in ["0", "-1", "nan", "inf"] {
        let set = format!("detection.link_time_ratio={value}");
        let expected = "is not accepted (accepted: a number above 0)";
        ends(2, &["run", "ten-blocks", "--set", &set, "--out", text(&log)], &[expected]);
        assert!(!log.exists());
        let settings = folder.path().join("settings.toml");
        fs::write(&settings, format!("link_time_ratio = {value}\n")).unwrap();
        let golden = file("fixtures/logs/complete.mcap");
        let replay = ["replay", text(&golden), "--detectors", text(&settings)];
        ends(2, &replay, &["settings.toml:1:19: link_time_ratio"]);
    }
}
