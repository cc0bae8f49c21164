//! The output of `asperity summary` against the results of a second program from exported switches
//! (clusters by union and find, in Python), and in every place with a summary.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use asperity_numbers::{OfRecording, Summary};
use serde_json::Value;

use crate::support::binary::{self, ends, outcome, succeed, text, with_sets};
use crate::support::small;
use asperity_testkit::folder;

/// Runs a scenario in steps of 0.1 microseconds, and returns its stderr.
fn run(scenario: &str, set: &[&str], log: &Path) -> String {
    let run = ["run", scenario, "--out", text(log), "--set", "time.step_s=1e-7"];
    ends(0, &with_sets(&run, set), &[])
}

fn summary(log: &Path) -> Summary {
    serde_json::from_str(&succeed(&["summary", "--format", "json", text(log)])).expect("it is a summary")
}

#[track_caller]
fn assert_near(found: Option<f64>, expected: f64) {
    let found = found.expect("there is one");
    assert!((found / expected - 1.0).abs() < 1e-6, "{found}, not {expected}");
}

#[test]
fn the_default_slider() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let said = run("default", &["time.duration_s=2.9"], &log);
    let line = "default: 55 precursors, the whole slider slips at 2.6347 s, F_T/F_N = 0.4549";
    assert!(said.lines().any(|found| found == format!("{line}; as coded: 12 kg, c = 46 m/s")), "{said}");
    assert!(!said.contains("creeps") && !said.contains("mislead"), "{said}");
    let found = summary(&log);
    assert_eq!(found.status, "complete");
    assert_eq!((found.precursor_count, found.global_rupture_count), (Some(55), Some(5)));
    assert_near(found.first_slip_s, 0.0567637);
    assert_near(found.first_global_rupture_onset_s, 2.6346976);
    // 6.9545 ms after the detachment, which is a step before the onset.
    assert_near(found.first_global_rupture_last_block_s, 2.634_697_6 - 1e-7 + 0.0069545 + 1e-7);
    assert_near(found.first_global_event_onset_s, 2.6346976);
    assert_near(found.longest_precursor_ratio, 0.98);
    assert_near(found.recurrence_transient_s, 0.0625677);
    assert_near(found.recurrence_steady_s, 0.0602163);
    assert_near(found.precursor_duration_s, 0.0034039);
    assert_near(found.precursor_crossing_s, 0.0023773);
    assert_near(found.sliding_time_ratio, 0.10839965087454374);
    assert_eq!((found.rupture_count, found.wide_rupture_count), (Some(133), Some(104)));
    assert_eq!((found.event_count, found.global_event_count), (135, 5));
    assert_eq!((found.creeps, found.creep_front_block), (Some(false), Some(3)));
    assert_eq!(found.events_mislead, Some(false));
    // sqrt(E L_y L_z L / M) (N - 1) / N per length: 0.1 m of 2.5 GPa, 1 cm2, 12 kg.
    let wave_speed = (2.5e9 * 0.005 * 0.02 / 12.0 * 0.1 * 100.0 / 99.0_f64).sqrt();
    assert_near(found.wave_speed_m_per_s, wave_speed);
    assert_near(found.link_time_s, 100.0 * (0.1 / 99.0) / wave_speed);

    // All places agree.
    let json: Value =
        serde_json::from_str(&succeed(&["summary", "--format", "json", text(&log)])).expect("JSON");
    assert_fits_schema(&json);
    assert_eq!(json["convergence"]["precursor_count"], "one draw");
    assert!(json["convergence"].get("first_global_rupture_ft_fn").is_none(), "it is robust");
    let csv = succeed(&["summary", "--format", "csv", text(&log)]);
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!((rows.len(), rows[0].len()), (2, Summary::KEYS.len()));
    for (name, cell) in rows[0].iter().zip(&rows[1]) {
        match &json[*name] {
            Value::Null => assert_eq!(*cell, "", "{name}"),
            Value::String(word) => assert_eq!(cell, word, "{name}"),
            value => assert_eq!(serde_json::from_str::<Value>(cell).ok().as_ref(), Some(value), "{name}"),
        }
    }
    let out = folder.path().join("reduced");
    succeed(&["reduce", text(&log), "--out", text(&out)]);
    assert_eq!(fs::read_to_string(out.join("summary.csv")).expect("it is there"), csv);
    let written = fs::read_to_string(out.join("summary.json")).expect("it is there");
    assert_eq!(serde_json::from_str::<Value>(&written).expect("it is JSON"), json);
    let record = fs::read_to_string(out.join("reduce.json")).expect("it is there");
    assert!(record.contains("\"summary.csv\"") && record.contains("\"summary.json\""), "{record}");
}

/// Every key matches the schema, and there is no other key.
fn assert_fits_schema(json: &Value) {
    let schema: Value = serde_json::from_str(&succeed(&["summary", "--schema"])).expect("it is JSON");
    assert_eq!(schema["additionalProperties"], Value::Bool(false));
    let mut properties = schema["properties"].as_object().expect("it has properties").clone();
    OfRecording::KEYS
        .iter()
        .for_each(|key| drop(properties.remove(&*key.column.name).expect("of a recording")));
    let object = json.as_object().expect("a summary is an object");
    assert_eq!(object.keys().collect::<Vec<_>>(), properties.keys().collect::<Vec<_>>());
    for (name, value) in object {
        let kind = match value {
            Value::Null => "null",
            Value::Bool(_) => "boolean",
            Value::String(_) => "string",
            Value::Number(number) if number.is_f64() => "number",
            Value::Number(_) => "integer",
            Value::Object(_) => "object",
            Value::Array(_) => "array",
        };
        let kinds = match &properties[name]["type"] {
            Value::String(kind) => vec![kind.as_str()],
            Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).collect(),
            other => panic!("{name}: {other}"),
        };
        assert!(kinds.contains(&kind), "{name}: {value} is none of {kinds:?}");
    }
}

/// Its slip events include a global slip at 0.016 s that lasts until 2.763 s.
#[test]
fn a_creeping_slider() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let set = [
        "friction.static_coefficient=0.5",
        "friction.dynamic_coefficient=0.45",
        "normal_load.tilt=-0.8",
        "time.duration_s=2.85",
    ];
    let said = run("default", &set, &log);
    assert!(said.contains("default: the slider creeps: block 100 had slid before a front ran"), "{said}");
    let found = summary(&log);
    assert_near(found.first_global_rupture_onset_s, 2.7638515);
    assert_near(found.first_global_event_onset_s, 0.0159994);
    assert_eq!((found.precursor_count, found.creep_front_block), (Some(1), Some(100)));
    assert_eq!((found.creeps, found.events_mislead), (Some(true), Some(true)));
    assert!(found.sliding_time_ratio.is_some_and(|ratio| ratio > 0.99), "{found:?}");
    let (_, printed, said) = outcome(&["summary", text(&log)]);
    assert!(said.contains("run.mcap: the slider creeps"), "{said}");
    assert_eq!(outcome(&["summary", "--quiet", text(&log)]), (0, printed, String::new()));
}

#[test]
fn drives_from_above_and_from_both_ends() {
    let folder = folder();
    let log = folder.path().join("both.mcap");
    let said = run("left-right-driven", &["time.duration_s=2"], &log);
    assert!(
        said.contains("slip events mislead")
            && said.contains("the whole slider slips at 1.3238 s; as coded: "),
        "{said}"
    );
    let found = summary(&log);
    assert_near(found.first_global_rupture_onset_s, 1.3238042);
    assert_eq!((found.events_mislead, found.creeps), (Some(true), Some(false)));
    assert!(found.joined_event_count.is_some_and(|joined| 4 * joined > found.wide_event_count), "{found:?}");
    // Where both ends are pulled, F_T is a difference.
    assert_eq!((found.length_law, found.first_slip_ft_fn, found.largest_ft_fn), (None, None, None));

    // Even load and even drive: all blocks at once, at mu_s.
    let log = folder.path().join("top.mcap");
    run("top-driven", &["time.duration_s=3.6"], &log);
    let found = summary(&log);
    assert_eq!((found.precursor_count, found.global_rupture_count), (Some(0), Some(1)));
    assert_near(found.first_global_rupture_onset_s, 3.5001133);
    assert_eq!(found.first_global_rupture_onset_s, found.first_global_rupture_last_block_s);
    assert!(found.first_global_rupture_ft_fn.is_some_and(|ratio| (ratio - 0.7).abs() < 1e-3), "{found:?}");
    assert_eq!((found.creep_front_block, found.events_mislead), (None, Some(false)));
}

/// A front that no drive feeds has no law of lengths, and in long steps a speed that is somewhat wrong.
#[test]
fn fronts_without_a_drive_have_no_length_law_and_say_how_wrong_their_speeds_are() {
    let folder = folder();
    let theory = 1.25;
    for (step_s, duration_s, is_told) in [("1e-9", "3e-5", false), ("1.595e-8", "2.9986e-5", true)] {
        let log = folder.path().join(format!("{step_s}.mcap"));
        let sets = [format!("time.step_s={step_s}"), format!("time.duration_s={duration_s}")];
        let run = ["run", "front", "--set", &sets[0], "--set", &sets[1], "--out", text(&log)];
        let (_, _, warned) = outcome(&run);
        let (_, found, told) = outcome(&["summary", "--format", "json", text(&log)]);
        let found: Summary = serde_json::from_str(&found).expect("it is a summary");
        assert_eq!(
            (found.length_law, found.length_law_rms_residual, found.precursor_count),
            (None, None, Some(1))
        );
        let estimate = found.front_speed_error_ratio.expect("there is a front");
        let error = found.front_speed_over_wave_speed_ratio.expect("there is a front") / theory - 1.0;
        assert!((error - estimate).abs() < 0.003, "{error}, estimated {estimate}");
        for said in [&warned, &told] {
            assert_eq!(said.contains("speeds of fronts are wrong by about 6 %"), is_told, "{said}");
        }
    }
}

#[test]
fn several_runs_are_a_table_and_what_is_no_log_is_said() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    small::run(&path("one.mcap"));
    fs::copy(path("one.mcap"), path("two.mcap")).expect("the folder can be written");
    fs::write(path("text.mcap"), "no log").expect("the folder can be written");
    let logs = [path("one.mcap"), path("text.mcap"), path("two.mcap")];
    let of = |format: &str| {
        let mut arguments = vec!["summary", "--format", format];
        arguments.extend(logs.iter().map(|log| text(log)));
        let (code, printed, said) = outcome(&arguments);
        assert_eq!(code, 2, "{said}");
        let of_runs = said.lines().filter(|line| line.ends_with("as coded: 12 kg, c = 48 m/s")).count();
        assert!(of_runs == 2 && said.lines().count() == 3 && said.contains("text.mcap"), "{said}");
        printed
    };
    let rows = of("text");
    let names: Vec<&str> = rows.lines().filter_map(|row| row.split_whitespace().next()).collect();
    assert_eq!(names[names.len() - 2..], ["one", "two"], "{rows}");
    let array: Vec<Summary> = serde_json::from_str(&of("json")).expect("it is an array");
    assert_eq!(array.iter().map(|summary| summary.run.as_str()).collect::<Vec<_>>(), ["one", "two"]);
    assert_eq!(Summary { run: "two".to_owned(), ..array[0].clone() }, array[1]);
    assert_eq!(of("csv").lines().count(), 3);
    let (code, printed, _) = outcome(&["summary", text(&path("text.mcap"))]);
    assert_eq!((code, printed.as_str()), (2, ""));
}

#[test]
fn a_pipeline_has_the_summary_of_each_of_its_runs() {
    let folder = folder();
    let pipeline = folder.path().join("two.toml");
    let run = |name: &str, tilt: f64| {
        format!(
            "[[run]]\nname = \"{name}\"\nscenario = \"ten-blocks\"\n\
             set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=1.2\", \"normal_load.tilt={tilt}\"]\n"
        )
    };
    let toml = format!("title = \"Two\"\n{}{}", run("even", 0.0), run("tilted", 0.5));
    fs::write(&pipeline, toml).expect("the folder can be written");
    let out = folder.path().join("out");
    succeed(&["reproduce", text(&pipeline), "--out", text(&out)]);
    let read = |name: &str| fs::read_to_string(out.join(name)).expect("it is there");
    let logs = ["even", "tilted"].map(|name| out.join("runs").join(format!("{name}.mcap")));
    assert_eq!(
        read("tables/summary.csv"),
        succeed(&["summary", "--format", "csv", text(&logs[0]), text(&logs[1])])
    );
    for (name, log) in ["even", "tilted"].iter().zip(&logs) {
        let file = format!("tables/{name}.summary.json");
        let written: Summary = serde_json::from_str(&read(&file)).expect("it is a summary");
        assert_eq!(written, summary(log));
        assert!(read("reproduce.json").contains(&format!("\"{file}\"")));
    }
    assert!(read("reproduce.json").contains("\"tables/summary.csv\""));
}

/// A resumed run has the same physical numbers as an uninterrupted one.
#[test]
fn a_resumed_run_tells_all_of_it() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let whole = run("ten-blocks", &["time.duration_s=1.2"], &log);
    let bytes = fs::read(&log).expect("it was just written");
    fs::remove_file(&log).expect("it is ours");
    fs::write(folder.path().join("run.mcap.partial"), &bytes[..bytes.len() / 2])
        .expect("the folder can be written");
    let resume = [&["run"], &small::SCENARIO[..], &["--resume", "--out", text(&log)]].concat();
    let said = ends(0, &resume, &[]);
    let line = |said: &str| said.lines().find(|line| line.contains(" precursors, ")).map(str::to_owned);
    assert!(line(&whole).is_some(), "{whole}");
    assert_eq!(line(&said), line(&whole), "{said}");
    let counts: BTreeMap<String, Value> =
        serde_json::from_str(&succeed(&["summary", "--format", "json", text(&log)]))
            .expect("it is an object");
    assert_eq!(counts["event_count"], 28);
    binary::succeed(&["check", text(&log)]);
}
