//! `asperity export` against the log itself: every value to the bit, only the requested part, and for an
//! incomplete log the sound part.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{ends, names, succeed, text};
use crate::support::{binary, small};
use asperity_record::{Event, FieldRecord, Record, StepRecord, WindowRecord};
use asperity_runlog::{LogItem, RunReader, Topics};
use asperity_testkit::folder;
use serde_json::{Map, Value, json};

pub(crate) const TOPICS: [&str; 9] = [
    "/step",
    "/switch",
    "/fields",
    "/window",
    "/events/onset",
    "/events/slip",
    "/events/global",
    "/events/rupture",
    "/events/arrival",
];

/// The small run with a dense window around its first event.
fn run_with_window(folder: &Path) -> PathBuf {
    let scenario = folder.join("windowed.toml");
    let window = "\n[[recording.window]]\nfrom_s = 0.578\nto_s = 0.58\nevery_s = 1e-5\nfirst_block = 2\nlast_block = 4\n";
    let base = include_str!("../crates/model/scenarios/ten-blocks.toml");
    fs::write(&scenario, format!("parameter_set = \"as-coded\"\n{base}{window}"))
        .expect("the folder can be written");
    let log = folder.join("run.mcap");
    let set = ["--set", "time.step_s=1e-7", "--set", "time.duration_s=1.2"];
    binary::run(&[&[text(&scenario)], &set[..]].concat(), &log);
    log
}

fn export(log: &Path, to: &str, out: &Path, further: &[&str]) -> String {
    succeed(&[&["export", text(log), "--to", to, "--out", text(out)], further].concat())
}

/// The rows that a log's messages should give, as JSON objects, topic by topic.
#[derive(Default)]
struct Expected {
    rows: Vec<(&'static str, Map<String, Value>)>,
}

impl Expected {
    /// Of a log, as far as it is sound.
    fn of(log: &Path) -> Expected {
        let mut reader = RunReader::open(log, Topics::ALL).expect("the log has a header");
        let mut expected = Expected::default();
        while let Ok(Some(item)) = reader.next_item() {
            match item {
                LogItem::Record(Record::Step(record)) => expected.step(&record),
                LogItem::Record(Record::Fields(record)) => expected.fields(&record),
                LogItem::Record(Record::Window(record)) => expected.window(&record),
                LogItem::Record(Record::Row(row)) => expected.event(&row.values),
                LogItem::Record(Record::Signal(_) | Record::Traces(_)) => unreachable!("it is no recording"),
                LogItem::Event(event) => expected.event(&event),
            }
        }
        expected
    }

    fn push(&mut self, topic: &str, row: Value) {
        let topic = TOPICS.into_iter().find(|known| *known == topic).expect("a topic that is exported");
        let Value::Object(row) = row else { panic!("not an object") };
        self.rows.push((topic, row));
    }

    fn step(&mut self, record: &StepRecord) {
        self.push(
            "/step",
            json!({
                "step": record.step,
                "time_s": record.time_s,
                "driving_force_n": record.driving_force_n,
                "normal_load_n": record.normal_load_n,
                "ft_fn": record.driving_force_n / record.normal_load_n,
                "sliding": record.sliding,
                "switches": record.switches.len(),
            }),
        );
        if let Some(ends) = record.end_forces_n {
            let (_, row) = self.rows.last_mut().expect("a row was pushed");
            row.insert("first_end_force_n".to_owned(), json!(ends[0]));
            row.insert("last_end_force_n".to_owned(), json!(ends[1]));
        }
        let (_, row) = self.rows.last_mut().expect("a row was pushed");
        for (name, energy) in record.energy.parts() {
            row.insert(name.to_owned(), json!(energy));
        }
        for switch in &record.switches {
            self.push(
                "/switch",
                json!({
                    "step": record.step,
                    "time_s": record.time_s,
                    "block": switch.block,
                    "direction": switch.direction,
                    "displacement_m": switch.displacement_m,
                    "velocity_m_per_s": switch.velocity_m_per_s,
                    "tangential_force_n": switch.tangential_force_n,
                    "stick_position_m": switch.stick_position_m,
                    "threshold_n": switch.threshold_n,
                }),
            );
        }
    }

    fn fields(&mut self, record: &FieldRecord) {
        for n in 0..record.detached.len() {
            self.push(
                "/fields",
                json!({
                    "step": record.step,
                    "time_s": record.time_s,
                    "block": n + 1,
                    "displacement_m": record.displacement_m[n],
                    "velocity_m_per_s": record.velocity_m_per_s[n],
                    "tangential_force_n": record.tangential_force_n[n],
                    "stick_position_m": record.stick_position_m[n],
                    "detached": record.detached[n] == 1,
                }),
            );
        }
    }

    fn window(&mut self, record: &WindowRecord) {
        for n in 0..record.displacement_m.len() {
            self.push(
                "/window",
                json!({
                    "window": record.window,
                    "step": record.step,
                    "time_s": record.time_s,
                    "sliding": record.sliding,
                    "block": record.first_block as usize + n,
                    "displacement_m": record.displacement_m[n],
                    "velocity_m_per_s": record.velocity_m_per_s[n],
                    "tangential_force_n": record.tangential_force_n[n],
                }),
            );
        }
    }

    /// As in the log.
    fn event(&mut self, event: &Event) {
        let row = serde_json::from_str(&event.json()).expect("an event is JSON");
        self.push(event.topic(), row);
    }

    fn of_topic(&self, topic: &str) -> Vec<&Map<String, Value>> {
        self.rows.iter().filter(|(of, _)| *of == topic).map(|(_, row)| row).collect()
    }
}

fn file(out: &Path, topic: &str, extension: &str) -> PathBuf {
    out.join(format!("run.{}.{extension}", topic[1..].replace('/', ".")))
}

/// JSON numbers are compared as the doubles that they are; `==` of JSON values
/// would take 0 and -0 for the same.
fn same(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => a.to_bits() == b.to_bits(),
        _ => a == b,
    }
}

fn assert_ndjson(expected: &Expected, out: &Path) {
    for &topic in &TOPICS {
        let path = file(out, topic, "ndjson");
        let lines = fs::read_to_string(&path).expect("the file is there");
        let expected = expected.of_topic(topic);
        assert_eq!(lines.lines().count(), expected.len(), "rows of {topic}");
        for (line, expected) in lines.lines().zip(expected) {
            let row: Map<String, Value> = serde_json::from_str(line).expect("a line is an object");
            let keys = |row: &Map<String, Value>| row.keys().cloned().collect::<BTreeSet<_>>();
            assert_eq!(keys(&row), keys(expected), "{topic}");
            let differs = row.iter().find(|(key, value)| !same(value, &expected[*key]));
            assert_eq!(differs, None, "{topic}: expected {expected:?}");
        }
    }
}

fn assert_csv(expected: &Expected, out: &Path) {
    for &topic in &TOPICS {
        let mut table = csv::Reader::from_path(file(out, topic, "csv")).expect("the file is there");
        let names = table.headers().expect("there is a header line").clone();
        let expected = expected.of_topic(topic);
        let mut rows = 0;
        for (row, expected) in table.records().zip(&expected) {
            rows += 1;
            let row = row.expect("a row can be read");
            assert_eq!(row.len(), expected.len(), "{topic}");
            for (name, cell) in names.iter().zip(&row) {
                let ok = match &expected[name] {
                    Value::Null => cell.is_empty(),
                    Value::Bool(flag) => cell == flag.to_string(),
                    Value::String(word) => cell == word,
                    number => {
                        let cell: f64 = cell.parse().expect("a number");
                        number.as_f64().is_some_and(|number| number.to_bits() == cell.to_bits())
                    }
                };
                assert!(ok, "{topic}: {name} is {cell:?}, in the log {}", expected[name]);
            }
        }
        assert_eq!(rows, expected.len(), "rows of {topic}");
    }
}

fn manifest(out: &Path) -> Value {
    let name = names(out).into_iter().find(|name| name.ends_with(".export.json"));
    let text = fs::read_to_string(out.join(name.expect("the file is there"))).expect("it can be read");
    serde_json::from_str(&text).expect("it is JSON")
}

#[test]
fn every_value_is_that_of_the_log_to_the_bit() {
    let folder = folder();
    let log = run_with_window(folder.path());
    let expected = Expected::of(&log);
    for topic in TOPICS {
        // The small run has no slip of the whole slider.
        assert_eq!(expected.of_topic(topic).is_empty(), topic == "/events/global", "rows of {topic}");
    }
    let out = folder.path().join("out");
    let said = export(&log, "ndjson", &out, &[]);
    assert_ndjson(&expected, &out);
    for topic in TOPICS {
        let rows = expected.of_topic(topic).len();
        let line = format!("{}: {rows} rows\n", file(&out, topic, "ndjson").display());
        assert!(said.contains(&line), "{said}");
    }
    let out = folder.path().join("csv");
    export(&log, "csv", &out, &[]);
    assert_csv(&expected, &out);

    let manifest = manifest(&out);
    assert_eq!(
        manifest["log"],
        json!({"state": "whole", "last_step": 12000000, "last_s": 1.2, "problem": null})
    );
    assert_eq!(manifest["run"]["blocks"], 10);
    assert!(manifest["scenario_toml"].as_str().unwrap().contains("\nmass_kg = 12.0\n"));
    let switch = &manifest["tables"][1];
    assert_eq!((&switch["topic"], &switch["file"]), (&json!("/switch"), &json!("run.switch.csv")));
    assert_eq!(switch["columns"][5], json!({"name": "velocity_m_per_s", "unit": "m/s"}));
}

/// The events and the load have been tables before; both ways must give the same bytes.
#[test]
fn csv_is_spelled_as_the_tables_are() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    small::run(&log);
    let out = folder.path().join("out");
    export(&log, "csv", &out, &["--topic", "/step", "--topic", "/events/slip"]);
    let read = |path: PathBuf| fs::read_to_string(path).expect("the file is there");
    assert_eq!(read(file(&out, "/events/slip", "csv")), succeed(&["events", text(&log)]));
    let tables = folder.path().join("tables");
    succeed(&["reduce", text(&log), "--out", text(&tables)]);
    assert_eq!(read(file(&out, "/events/slip", "csv")), read(tables.join("events.csv")));
    // The table of the load lacks the energies, which are the last columns.
    let steps = read(file(&out, "/step", "csv"));
    let load = read(tables.join("load.csv"));
    let columns = load.lines().next().map_or(0, |header| header.split(',').count());
    let first = |line: &str| line.split(',').take(columns).collect::<Vec<_>>().join(",") + "\n";
    assert!(columns > 6 && steps.lines().map(first).collect::<String>() == load);
}

#[test]
fn forces_on_both_ends_get_columns_of_their_own() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let set = ["--set", "time.step_s=1e-7", "--set", "time.duration_s=0.05"];
    binary::run(&[&["left-right-driven"], &set[..]].concat(), &log);
    let expected = Expected::of(&log);
    assert!(expected.of_topic("/step")[0].contains_key("scheme_work_j"), "a run has energies");
    assert!(expected.of_topic("/step")[0].contains_key("last_end_force_n"));
    // The first records are left out, and the columns must be there all the same.
    for (number, range) in [&[][..], &["--from-s", "0.02"]].into_iter().enumerate() {
        let out = folder.path().join(number.to_string());
        export(&log, "csv", &out, &[&["--topic", "/step"], range].concat());
        let table = fs::read_to_string(file(&out, "/step", "csv")).expect("the file is there");
        assert!(
            table
                .lines()
                .next()
                .unwrap()
                .contains(",switches,first_end_force_n,last_end_force_n,drive_work_j,")
        );
        assert!(table.lines().count() > 10);
    }
    let out = folder.path().join("ndjson");
    export(&log, "ndjson", &out, &[]);
    assert_ndjson(&expected, &out);
}

#[test]
fn topics_and_times_can_be_chosen() {
    let folder = folder();
    let log = run_with_window(folder.path());
    let all = folder.path().join("all");
    export(&log, "ndjson", &all, &[]);
    let out = folder.path().join("out");
    let chosen = ["/fields", "/step", "/events/slip"];
    let topics: Vec<&str> = chosen.iter().flat_map(|topic| ["--topic", topic]).collect();
    export(&log, "ndjson", &out, &[&topics[..], &["--from-s", "0.4", "--to-s", "0.9"]].concat());
    let expected: BTreeSet<String> =
        ["run.events.slip.ndjson", "run.fields.ndjson", "run.ndjson.export.json", "run.step.ndjson"]
            .map(Into::into)
            .into();
    assert_eq!(names(&out), expected);
    for (topic, time) in chosen.into_iter().zip(["time_s", "time_s", "onset_s"]) {
        let lines = |out: &Path| fs::read_to_string(file(out, topic, "ndjson")).expect("the file is there");
        let inside = |line: &&str| {
            let row: Value = serde_json::from_str(line).expect("a line is JSON");
            (0.4..0.9).contains(&row[time].as_f64().unwrap())
        };
        let all = lines(&all);
        let expected: Vec<&str> = all.lines().filter(inside).collect();
        assert!(!expected.is_empty() && expected.len() < all.lines().count(), "{topic}");
        assert_eq!(lines(&out).lines().collect::<Vec<_>>(), expected, "{topic}");
    }
    // The bounds are grid times: the first is in, the last is not, so that slices tile.
    let steps = fs::read_to_string(file(&out, "/step", "ndjson")).unwrap();
    assert!(steps.starts_with("{\"step\":4000000,\"time_s\":0.4,") && !steps.contains("\"time_s\":0.9,"));
    assert_eq!((&manifest(&out)["from_s"], &manifest(&out)["to_s"]), (&json!(0.4), &json!(0.9)));
}

/// A copy of the default run's log with several chunks, so that some precede the damage.
fn chunked(folder: &Path) -> (PathBuf, Vec<u8>) {
    let log = folder.join("whole.mcap");
    binary::run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=2"], &log);
    let bytes = fs::read(&log).expect("the log can be read");
    (folder.join("run.mcap"), bytes)
}

fn export_in_part(log: &Path, out: &Path, code: i32) -> (String, Expected) {
    let said = ends(code, &["export", text(log), "--to", "ndjson", "--out", text(out)], &[]);
    let expected = Expected::of(log);
    assert_ndjson(&expected, out);
    assert!(!names(out).iter().any(|name| name.ends_with(".partial")));
    (said, expected)
}

#[test]
fn what_is_sound_of_a_log_that_is_not_whole_is_exported() {
    let folder = folder();
    let (log, bytes) = chunked(folder.path());
    let steps = |expected: &Expected| expected.of_topic("/step").len();
    let whole = steps(&Expected::of(&folder.path().join("whole.mcap")));

    fs::write(&log, &bytes[..bytes.len() * 3 / 4]).expect("the folder can be written");
    let out = folder.path().join("cut");
    let (said, expected) = export_in_part(&log, &out, 3);
    let last = expected.of_topic("/step").last().copied().cloned().expect("there are chunks before the cut");
    assert!(steps(&expected) > 0 && steps(&expected) < whole);
    assert!(
        said.contains(&format!(
            "exported up to step {} ({} s), where the log ends: ",
            last["step"], last["time_s"]
        )),
        "{said}"
    );
    assert_eq!(manifest(&out)["log"]["state"], "incomplete");
    assert_eq!(manifest(&out)["log"]["last_step"], last["step"]);

    let mut flipped = bytes.clone();
    flipped[bytes.len() * 3 / 4] ^= 0x10;
    fs::write(&log, &flipped).expect("the folder can be written");
    let out = folder.path().join("flipped");
    let (said, expected) = export_in_part(&log, &out, 4);
    assert!(steps(&expected) > 0 && steps(&expected) < whole);
    assert!(said.contains("exported up to step ") && said.contains("where the log is damaged: "), "{said}");
    assert_eq!(manifest(&out)["log"]["state"], "damaged");
    assert!(manifest(&out)["log"]["problem"].as_str().is_some_and(|problem| said.contains(problem)));

    // The damage is reported for a slice before it as well.
    let out = folder.path().join("slice");
    let slice = ["--to", "csv", "--topic", "/step", "--to-s", "0.01", "--out", text(&out)];
    ends(4, &[&["export", text(&log)], &slice[..]].concat(), &[]);
}

#[test]
fn logs_by_other_code_and_salvaged_ones_are_exported() {
    let logs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs");
    let folder = folder();
    let out = folder.path().join("out");
    export(&logs.join("complete.mcap"), "csv", &out, &[]);
    let read = |path: PathBuf| fs::read_to_string(path).expect("the file is there");
    assert_eq!(read(out.join("complete.events.slip.csv")), read(logs.join("complete.events.csv")));
    // A salvaged log has gaps, and must not pass for a whole one.
    let log = folder.path().join("run.mcap");
    fs::copy(logs.join("salvaged.mcap"), &log).expect("the folder can be written");
    let out = folder.path().join("salvaged");
    let (said, expected) = export_in_part(&log, &out, 5);
    assert!(expected.of_topic("/step").len() > 10);
    assert!(said.contains(", with gaps: it was salvaged from a damaged log"), "{said}");
    assert_eq!(manifest(&out)["log"]["state"], "salvaged with gaps");
}

#[test]
fn files_that_are_there_are_kept_unless_told() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    small::run(&log);
    let out = folder.path().join("out");
    let arguments = ["export", text(&log), "--to", "csv", "--topic", "/step", "--out", text(&out)];
    succeed(&arguments);
    let path = file(&out, "/step", "csv");
    fs::write(&path, "mine").expect("the folder can be written");
    ends(2, &arguments, &["run.step.csv exists already", "--force"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "mine");
    succeed(&[&arguments[..], &["--force"]].concat());
    assert!(fs::read_to_string(&path).unwrap().starts_with("step,time_s,"));
    assert_eq!(names(&out).len(), 2);
}

#[test]
fn what_cannot_be_asked_for_is_refused_before_anything_is_written() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    small::run(&log);
    let out = folder.path().join("out");
    let refuse = |further: &[&str], words: &[&str]| {
        ends(2, &[&["export", text(&log), "--to", "csv", "--out", text(&out)], further].concat(), words);
        assert!(!out.exists() || names(&out).is_empty());
    };
    refuse(&["--topic", "step"], &["\"step\"", "accepted: /step, /switch, /fields"]);
    refuse(&["--from-s", "2", "--to-s", "1"], &["from 2 s", "before 1 s"]);
    refuse(&["--to-s", "NaN"], &["NaN"]);
    let twin = folder.path().join("run.mcap.partial");
    fs::copy(&log, &twin).expect("the folder can be written");
    refuse(&[text(&twin)], &["both be exported as run", "different names"]);
}

#[test]
fn many_runs_are_exported_and_the_unreadable_told() {
    let folder = folder();
    let logs: Vec<PathBuf> = ["a", "b"].map(|name| folder.path().join(format!("{name}.mcap"))).into();
    small::run(&logs[0]);
    fs::write(&logs[1], "not a log").expect("the folder can be written");
    let out = folder.path().join("out");
    let runs = [text(&logs[1]), text(&logs[0])];
    ends(2, &[&["export"], &runs[..], &["--to", "csv", "--out", text(&out)]].concat(), &["b.mcap: "]);
    let written = names(&out);
    assert!(
        written.contains("a.step.csv") && !written.iter().any(|name| name.starts_with("b.")),
        "{written:?}"
    );
}

/// The curves of a figure as a table, which a figure of the same kind shows.
#[test]
fn curves_are_exported_by_name() {
    let folder = folder();
    let (log, out) = (run_with_window(folder.path()), folder.path().join("out"));
    fs::create_dir(&out).expect("it is new");
    export(&log, "csv", &out, &["--curve", "forces", "--set", "to_s=0.5"]);
    let table = fs::read_to_string(out.join("run.curve.forces.csv")).expect("it is written");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("curve,label,role,quantity,x,y"));
    let normal: Vec<&str> = lines.filter(|line| line.starts_with("1,F_N,measured,force (N),")).collect();
    assert!(normal.len() > 100 && table.contains("\n4,F_T,measured,force (N),"), "{table}");
    let refused = ["export", text(&log), "--to", "csv", "--out", text(&out), "--curve"];
    ends(2, &[&refused[..], &["farces"]].concat(), &["there is no curve \"farces\"; did you mean forces?"]);
    ends(2, &[&refused[..], &["loads", "--set", "blocks=5"]].concat(), &["(accepted: none)"]);
}
