//! Counts of junctions in records and events, on a made-up log of a run that has them: every command that
//! reads it has their columns, with or without events, and a log in which they contradict each other is
//! refused.

use std::fs;
use std::path::{Path, PathBuf};

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::laws::thin::messages;
use crate::support::binary::{asperity, succeed, text};
use asperity_record::{
    Direction, FieldRecord, JunctionTotals, Parts, Record, RunHeader, RunStatus, SolverReport, StepRecord,
    Switch,
};
use asperity_run::{Task, detectors};
use asperity_runlog::{Existing, LogItem, RunWriter};
use asperity_testkit::{folder, quiet_step, read_log, read_until_problem, scenario, switch};
use mcap::records::op;
use serde_json::{Value, json};

const OF_EVENTS: &str = ",open,breaks_onset,breaks_end,repins_onset,repins_end";

/// Junctions of each contact.
const COUNT: u32 = 10;

/// Six steps: block 1 slides in steps 3 and 4, block 2 from step 6 on.
fn records(header: &RunHeader) -> Vec<Record> {
    let grid = header.time_grid();
    let step = |step: u64, sliding: u32, breaks: u64, repins: u64, switches: &[(u32, Direction, u32)]| {
        let switches = switches.iter().map(|&(block, direction, slipping)| Switch {
            junctions_slipping: Some(slipping),
            ..switch(block, direction)
        });
        Record::Step(StepRecord {
            sliding,
            switches: switches.collect(),
            junctions: Some(JunctionTotals { breaks, repins }),
            ..quiet_step(step, grid.time_s(step), 0.5)
        })
    };
    let state = FieldRecord {
        step: 3,
        time_s: grid.time_s(3),
        displacement_m: vec![0.5; 3],
        velocity_m_per_s: vec![0.25; 3],
        tangential_force_n: vec![2.0; 3],
        stick_position_m: vec![0.125; 3],
        detached: vec![1, 0, 0],
        junctions_slipping: vec![6, 1, 0],
        pinned_mean_ratio: vec![0.0625, 0.25, 0.3],
        pinned_width_ratio: vec![0.05, 0.1, 0.2],
        ..FieldRecord::default()
    };
    vec![
        step(2, 0, 0, 0, &[(1, Direction::Detach, 5)]),
        step(3, 1, 5, 0, &[]),
        Record::Fields(Box::new(state)),
        step(4, 1, 7, 1, &[(1, Direction::Attach, 4)]),
        step(5, 0, 8, 4, &[(2, Direction::Detach, 5)]),
        step(6, 1, 13, 4, &[]),
    ]
}

/// Writes the log of the first steps up to this one; returns its path and contents.
fn log(folder: &Path, steps: u64) -> (PathBuf, Vec<LogItem>) {
    let path = folder.join(format!("{steps}.mcap"));
    let (scenario, _) = scenario("default", &["slider.blocks=3", "time.duration_s=1e-3"]);
    let toml = scenario.to_commented_toml();
    let code_version = "of another program".to_owned();
    let header = RunHeader { junction_count: COUNT, code_version, steps, ..Task::new(&scenario).header() };
    let mut detectors = detectors::all(&header, &toml);
    let kinds: Vec<_> = detectors.kinds().collect();
    let mut writer = RunWriter::create(&path, Existing::Refuse, &header, &toml, &kinds).unwrap();
    let mut items = Vec::new();
    for record in records(&header).into_iter().filter(|record| record.step() <= steps) {
        writer.record(&record).unwrap();
        items.push(LogItem::Record(record.clone()));
        detectors.observe(&record, &mut |event| {
            writer.event(&event).unwrap();
            items.push(LogItem::Event(event));
        });
    }
    detectors.finish(&mut |event| {
        writer.event(&event).unwrap();
        items.push(LogItem::Event(event));
    });
    writer.finish(RunStatus::Complete, SolverReport::default()).unwrap();
    (path, items)
}

fn check(log: &Path) -> (Option<i32>, String) {
    let output = asperity(&["check", text(log)]);
    (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
}

fn heading(table: &str) -> &str {
    table.lines().next().expect("a heading")
}

#[test]
fn every_table_of_a_run_with_junctions_has_their_columns() {
    let folder = folder();
    let (run, items) = log(folder.path(), 6);
    let (still, _) = log(folder.path(), 2);
    assert_eq!(read_log(&run).expect("it is whole").0, items);
    // The detectors find the same events again.
    let (code, said) = check(&run);
    assert_eq!(code, Some(6), "{said}");

    let events = succeed(&["events", text(&run)]);
    assert!(heading(&events).ends_with(OF_EVENTS), "{events}");
    let ends: Vec<&str> = events.lines().skip(1).map(|row| row.rsplit_once(",0.5,0.5,").unwrap().1).collect();
    assert_eq!(ends, ["false,5,8,0,4", "true,13,,4,"], "{events}");
    assert_eq!(succeed(&["replay", "--format", "csv", text(&run)]), events);
    assert_eq!(succeed(&["events", text(&still)]), format!("{}\n", heading(&events)));
    assert!(
        succeed(&["events", "--format", "json", text(&run)])
            .contains(r#""breaks_onset":13,"repins_onset":4}"#)
    );

    for (format, out) in [("csv", "c"), ("ndjson", "n"), ("parquet", "p")] {
        let out = folder.path().join(out);
        fs::create_dir(&out).unwrap();
        succeed(&["export", "--to", format, "--out", text(&out), text(&run), text(&still)]);
        let table = |run: &str, topic: &str| {
            let path = out.join(format!("{run}.{topic}.{format}"));
            if format == "parquet" {
                succeed(&["events", text(&path)])
            } else {
                fs::read_to_string(path).unwrap()
            }
        };
        let (step, fields) = (table("6", "step"), table("6", "fields"));
        let (switch, slip) = (table("6", "switch"), table("6", "events.slip"));
        if format == "ndjson" {
            let rows: Vec<Value> = [&step, &switch, &fields, &slip]
                .map(|table| serde_json::from_str(table.lines().nth(1).unwrap()).unwrap())
                .into();
            assert_eq!((&rows[0]["breaks"], &rows[0]["repins"]), (&json!(5), &json!(0)));
            assert_eq!(rows[1]["junctions_slipping"], 4);
            assert_eq!(
                (&rows[2]["junctions_slipping"], &rows[2]["pinned_width_ratio"]),
                (&json!(1), &json!(0.1))
            );
            assert_eq!((&rows[3]["breaks_onset"], &rows[3]["breaks_end"]), (&json!(13), &Value::Null));
            continue;
        }
        let second = |table: &str| table.lines().nth(2).unwrap().to_owned();
        assert!(
            heading(&step).ends_with(",switches,breaks,repins") && second(&step).ends_with(",0,5,0"),
            "{step}"
        );
        assert!(heading(&switch).ends_with(",threshold_n,junctions_slipping"), "{switch}");
        assert!(second(&switch).ends_with(",4"), "{switch}");
        let last = ",detached,junctions_slipping,pinned_mean_ratio,pinned_width_ratio";
        assert!(
            heading(&fields).ends_with(last) && second(&fields).ends_with(",false,1,0.25,0.1"),
            "{fields}"
        );
        assert!(heading(&slip).ends_with(OF_EVENTS) && second(&slip).ends_with(",true,13,,4,"), "{slip}");
        assert_eq!(heading(&table("2", "events.slip")), heading(&slip));
        assert_eq!(heading(&table("2", "step")), heading(&step));
    }
}

/// Though the salvaging program is given the kinds of events of runs without junctions.
#[test]
fn salvage_keeps_counts_and_their_schemas() {
    let folder = folder();
    let (run, items) = log(folder.path(), 6);
    let (damaged, out) = (folder.path().join("damaged.mcap"), folder.path().join("out.mcap"));
    let mut bytes = fs::read(&run).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&damaged, bytes).unwrap();
    let settle = |logged: Option<RunHeader>, _: Option<&str>| Ok((logged.unwrap(), Vec::new()));
    asperity_runlog::salvage(&damaged, &out, &detectors::event_kinds(Parts::default()), &settle).unwrap();
    assert_eq!(read_until_problem(&out).0, items);
    let announced = |path: &Path| {
        let parts = take_apart(&fs::read(path).unwrap()).into_iter();
        parts.filter(|part| matches!(part.opcode, op::SCHEMA | op::CHANNEL)).collect::<Vec<Part>>()
    };
    assert_eq!(announced(&out), announced(&run));
}

/// Of two runs only the totals differ; a table without their columns is compared in the others.
#[test]
fn a_diff_compares_totals_where_both_have_them() {
    let folder = folder();
    let (run, _) = log(folder.path(), 6);
    let events = succeed(&["events", text(&run)]);
    let write = |name: &str, table: String| {
        let path = folder.path().join(name);
        fs::write(&path, table).unwrap();
        path
    };
    let same = write("same.csv", events.clone());
    assert!(succeed(&["diff", text(&run), text(&same)]).contains("nothing differs"));
    let cells = |row: &str| row.split(',').take(15).collect::<Vec<_>>().join(",") + "\n";
    let without = write("without.csv", events.lines().map(cells).collect());
    assert!(succeed(&["diff", text(&run), text(&without)]).contains("nothing differs"));
    let other = write("other.csv", events.replace("false,5,8,", "false,5,9,"));
    let output = asperity(&["diff", text(&run), text(&other)]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.code() == Some(1) && said.contains("breaks_end"), "{said}");
}

#[test]
fn counts_that_contradict_each_other_are_refused() {
    let folder = folder();
    let (run, _) = log(folder.path(), 6);
    let sound = take_apart(&fs::read(&run).unwrap());
    type Change = fn(&mut Value);
    let cases: [(&str, usize, Change, &str); 14] = [
        ("/step", 1, |step| take(step, "repins"), "step 3: it has breaks without repins"),
        ("/step", 1, |step| take(step, "breaks"), "step 3: it has repins without breaks"),
        (
            "/step",
            1,
            |step| ["breaks", "repins"].iter().for_each(|key| take(step, key)),
            "step 3: it has no breaks and repins, in a run with junctions",
        ),
        (
            "/step",
            1,
            |step| step["peak_velocity_m_per_s"] = json!(-0.5),
            "step 3: peak_velocity_m_per_s = Some(-0.5), in a run with has_state = false",
        ),
        (
            "/events/slip",
            1,
            |slip| slip["peak_velocity_m_per_s"] = json!(0.5),
            "peak_velocity_m_per_s = Some(0.5), in a run with has_state = false",
        ),
        ("/step", 2, |step| step["breaks"] = json!(4), "step 4: breaks = 4, after 5"),
        ("/step", 3, |step| step["repins"] = json!(0), "step 5: repins = 0, after 1"),
        ("/step", 2, |step| step["repins"] = json!(8), "step 4: 7 breaks and 8 repins of 30 junctions"),
        ("/step", 2, |step| step["breaks"] = json!(32), "step 4: 32 breaks and 1 repins of 30 junctions"),
        (
            "/switch",
            0,
            |switch| take(switch, "junctions_slipping"),
            "a switch of block 1 without junctions_slipping",
        ),
        (
            "/switch",
            0,
            |switch| switch["junctions_slipping"] = json!(11),
            "11 junctions slip, of 10 at each contact",
        ),
        ("/fields", 0, |state| take(state, "pinned_mean_ratio"), "pinned_mean_ratio has 0 values, not 3"),
        ("/events/slip", 0, |slip| take(slip, "repins_end"), "repins_onset = Some(0) and repins_end = None"),
        ("/events/slip", 1, |slip| slip["breaks_onset"] = json!(12), "events differ from number 3"),
    ];
    for (topic, number, change, says) in cases {
        let mut parts = sound.clone();
        let at = messages(&parts, topic)[number];
        let mut message = serde_json::from_slice(parts[at].payload().unwrap()).unwrap();
        change(&mut message);
        parts[at] = parts[at].with_payload(message.to_string().as_bytes());
        correct_end(&mut parts);
        let forged = folder.path().join("forged.mcap");
        fs::write(&forged, put_together(&parts, Packing::USUAL)).unwrap();
        let (code, said) = check(&forged);
        // Other code may find other events.
        let expected = if says.starts_with("events differ") { 6 } else { 4 };
        assert!(code == Some(expected) && said.contains(says), "{topic} {number}: {says}: {said}");
    }
}

/// Removes a key.
fn take(message: &mut Value, key: &str) {
    message.as_object_mut().expect("it is an object").remove(key);
}

/// A run without junctions that has counts of them.
#[test]
fn counts_in_a_run_without_junctions_are_refused() {
    let folder = folder();
    let (run, _) = log(folder.path(), 6);
    let mut parts = take_apart(&fs::read(&run).unwrap());
    let at = parts.iter().position(|part| part.name() == Some("run")).unwrap();
    let mut map = parts[at].map().unwrap();
    map.remove("junction_count");
    parts[at] = Part::metadata("run", &map);
    fs::write(&run, put_together(&parts, Packing::USUAL)).unwrap();
    let (code, said) = check(&run);
    assert!(code == Some(4) && said.contains("breaks and repins, in a run without junctions"), "{said}");
}
