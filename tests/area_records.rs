//! Contacts over an area in records, events and ruptures, on a made-up log: every command that reads it has
//! their columns, with or without events, and a log in which they contradict each other is refused.

use std::fs;
use std::path::{Path, PathBuf};

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::laws::thin::messages;
use crate::support::binary::{asperity, succeed, text};
use asperity_record::{
    Direction, FieldRecord, Parts, Record, RunHeader, RunStatus, SolverReport, StepRecord, Switch,
    SwitchAcross, WindowRecord,
};
use asperity_run::{Task, detectors};
use asperity_runlog::{Existing, LogItem, RunWriter};
use asperity_testkit::{folder, quiet_step, read_log, read_until_problem, scenario, switch};
use mcap::records::op;
use serde_json::{Value, json};

/// What runs over an area have behind the other columns of their slip events.
const OF_EVENTS: &str = ",open,first_across,last_across";

const OF_RUPTURES: &str = ",slip_weighted_shear_force_drop_n,first_across,last_across,contacts,potency_m3";

const OF_ARRIVALS: &str = ",force_after_n,column,across,slip_across_m,local_speed_m_per_s";

/// Rows of contacts, and contacts in each.
const ROWS: u32 = 3;
const COLUMNS: u32 = 4;

/// A switch of a contact whose force and displacement follow from its number.
fn at(contact: u32, direction: Direction) -> Switch {
    let n = f64::from(contact);
    let [along, across] = match direction {
        Direction::Detach => [[0.0, 3.0], [0.0, -4.0]],
        Direction::Attach => [[0.25 * n, 1.0], [0.5, 0.0]],
    };
    Switch {
        displacement_m: along[0],
        tangential_force_n: along[1],
        threshold_n: 5.0,
        across: Some(SwitchAcross {
            displacement_m: across[0],
            tangential_force_n: across[1],
            velocity_m_per_s: -0.125,
            stick_position_m: 0.0625,
        }),
        ..switch(contact, direction)
    }
}

/// Contact 6 slides in steps 3 and 4, contact 3, a neighbour across a corner, in step 4; contact 12 from step
/// 9 on. Contacts 1 to 4 are the first row, 5 to 8 the second.
fn records(header: &RunHeader) -> Vec<Record> {
    use Direction::{Attach, Detach};
    let grid = header.time_grid();
    let step = |step: u64, sliding: u32, switches: &[(u32, Direction)]| {
        Record::Step(StepRecord {
            sliding,
            switches: switches.iter().map(|&(contact, direction)| at(contact, direction)).collect(),
            ..quiet_step(step, grid.time_s(step), 0.5)
        })
    };
    let count = (ROWS * COLUMNS) as usize;
    let numbers = |from: f64| (0..count).map(|n| from + n as f64).collect::<Vec<f64>>();
    let state = FieldRecord {
        step: 3,
        time_s: grid.time_s(3),
        displacement_m: numbers(0.5),
        velocity_m_per_s: numbers(0.25),
        tangential_force_n: numbers(2.0),
        stick_position_m: numbers(0.125),
        detached: (1..=count).map(|contact| u8::from([3, 6].contains(&contact))).collect(),
        state: Vec::new(),
        displacement_across_m: numbers(-0.5),
        velocity_across_m_per_s: numbers(-0.25),
        tangential_force_across_n: numbers(-2.0),
        stick_position_across_m: numbers(-0.125),
        ..FieldRecord::default()
    };
    let window = WindowRecord {
        step: 3,
        time_s: grid.time_s(3),
        sliding: 1,
        first_block: 5,
        displacement_m: vec![0.5, 1.5],
        velocity_m_per_s: vec![0.25, 1.25],
        tangential_force_n: vec![2.0, 3.0],
        displacement_across_m: vec![-0.5, -1.5],
        velocity_across_m_per_s: vec![-0.25, -1.25],
        tangential_force_across_n: vec![-2.0, -3.0],
        ..WindowRecord::default()
    };
    vec![
        step(2, 0, &[(6, Detach)]),
        step(3, 1, &[(3, Detach)]),
        Record::Fields(Box::new(state)),
        Record::Window(window),
        step(4, 2, &[(3, Attach), (6, Attach)]),
        step(5, 0, &[]),
        step(8, 0, &[(12, Detach)]),
        step(9, 1, &[]),
    ]
}

/// Writes the log of the first steps up to this one; returns its path and contents.
fn log(folder: &Path, steps: u64) -> (PathBuf, Vec<LogItem>) {
    let path = folder.join(format!("{steps}.mcap"));
    let blocks = format!("slider.blocks={}", ROWS * COLUMNS);
    let (scenario, _) = scenario("default", &[&blocks, "time.duration_s=1e-3"]);
    let toml = scenario.to_commented_toml();
    let code_version = "of another program".to_owned();
    let header = RunHeader { rows: ROWS, code_version, steps, ..Task::new(&scenario).header() };
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

/// The cells of a row of a table in CSV, by their columns.
fn row(table: &str, number: usize) -> Vec<(String, String)> {
    let cells =
        |line: usize| table.lines().nth(line).unwrap().split(',').map(str::to_owned).collect::<Vec<_>>();
    cells(0).into_iter().zip(cells(number + 1)).collect()
}

fn cell(table: &str, number: usize, column: &str) -> String {
    let row = row(table, number);
    let found = row.iter().find(|(name, _)| name == column);
    found.unwrap_or_else(|| panic!("no {column} in {table}")).1.clone()
}

#[test]
fn every_table_of_a_run_over_an_area_has_its_columns() {
    let folder = folder();
    let (run, items) = log(folder.path(), 9);
    let (still, _) = log(folder.path(), 2);
    assert_eq!(read_log(&run).expect("it is whole").0, items);
    // The detectors find the same events again.
    let (code, said) = check(&run);
    assert_eq!(code, Some(6), "{said}");

    let events = succeed(&["events", text(&run)]);
    assert!(heading(&events).ends_with(OF_EVENTS), "{events}");
    let ends: Vec<&str> = events.lines().skip(1).map(|row| row.rsplit_once(",0.5,0.5,").unwrap().1).collect();
    assert_eq!(ends, ["false,1,2", "true,3,3"], "{events}");
    let places = |number: usize| {
        ["first_block", "last_block", "blocks_slipped", "nucleation_block"]
            .map(|column| cell(&events, number, column).parse::<u32>().unwrap())
    };
    assert_eq!([places(0), places(1)], [[2, 3, 2, 6], [4, 4, 1, 12]]);
    assert_eq!(succeed(&["replay", "--format", "csv", text(&run)]), events);
    assert_eq!(succeed(&["events", text(&still)]), format!("{}\n", heading(&events)));
    assert!(
        succeed(&["events", "--format", "json", text(&run)]).contains(r#""first_across":1,"last_across":2}"#)
    );

    let replayed = folder.path().join("replayed");
    succeed(&["replay", text(&run), "--out", text(&replayed)]);
    let table = |name: &str| fs::read_to_string(replayed.join(format!("9.{name}.csv"))).unwrap();
    assert!(heading(&table("onsets")).ends_with(",ft_fn_onset,tangential_force_across_n"));
    let number = |table: &str, n: usize, column: &str| cell(table, n, column).parse::<f64>().unwrap();
    assert_eq!(number(&table("onsets"), 0, "tangential_force_across_n"), -4.0);
    let ruptures = table("ruptures");
    assert!(heading(&ruptures).ends_with(OF_RUPTURES), "{ruptures}");
    let of_first = ["first_block", "last_block", "first_across", "last_across", "contacts", "potency_m2"]
        .map(|column| cell(&ruptures, 0, column));
    assert_eq!(of_first, ["2", "3", "1", "2", "2", ""]);
    let arrivals = table("arrivals");
    assert!(heading(&arrivals).ends_with(OF_ARRIVALS), "{arrivals}");
    let of_second =
        ["block", "column", "across", "slip_m", "slip_across_m", "force_detach_n", "force_attach_n"]
            .map(|column| number(&arrivals, 1, column));
    assert_eq!(of_second, [6.0, 2.0, 2.0, 1.5, 0.5, 5.0, 1.0]);
}

#[test]
fn every_export_of_a_run_over_an_area_has_its_columns() {
    let folder = folder();
    let (run, _) = log(folder.path(), 9);
    let (still, _) = log(folder.path(), 2);
    let topics =
        ["switch", "fields", "window", "events.slip", "events.onset", "events.rupture", "events.arrival"];
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
        let [switch, fields, window, slip, onset, rupture, arrival] = topics.map(|topic| table("9", topic));
        if format == "ndjson" {
            let rows: Vec<Value> = [&switch, &fields, &window, &slip, &arrival]
                .map(|table| serde_json::from_str(table.lines().nth(1).unwrap()).unwrap())
                .into();
            assert_eq!((&rows[0]["block"], &rows[0]["stick_position_across_m"]), (&json!(3), &json!(0.0625)));
            assert_eq!((&rows[1]["block"], &rows[1]["tangential_force_across_n"]), (&json!(2), &json!(-1.0)));
            assert_eq!((&rows[2]["block"], &rows[2]["displacement_across_m"]), (&json!(6), &json!(-1.5)));
            assert_eq!((&rows[3]["first_across"], &rows[3]["last_across"]), (&json!(3), &json!(3)));
            assert_eq!((&rows[4]["across"], &rows[4]["local_speed_m_per_s"]), (&json!(2), &Value::Null));
            continue;
        }
        let across = ",displacement_across_m,velocity_across_m_per_s,tangential_force_across_n";
        let anchor = format!("{across},stick_position_across_m");
        let number = |table: &str, n: usize, column: &str| cell(table, n, column).parse::<f64>().unwrap();
        assert!(heading(&switch).ends_with(&format!(",threshold_n{anchor}")), "{switch}");
        assert_eq!(number(&switch, 0, "tangential_force_across_n"), -4.0);
        assert!(heading(&fields).ends_with(&format!(",detached{anchor}")), "{fields}");
        assert_eq!((fields.lines().count(), number(&fields, 11, "stick_position_across_m")), (13, 10.875));
        assert!(heading(&window).ends_with(&format!(",tangential_force_n{across}")), "{window}");
        assert_eq!(number(&window, 1, "velocity_across_m_per_s"), -1.25);
        assert!(heading(&slip).ends_with(OF_EVENTS) && heading(&rupture).ends_with(OF_RUPTURES));
        assert!(heading(&arrival).ends_with(OF_ARRIVALS), "{arrival}");
        assert!(heading(&onset).ends_with(",tangential_force_across_n"), "{onset}");
        // Also of a log without such events and states.
        for topic in topics {
            assert_eq!(heading(&table("2", topic)), heading(&table("9", topic)), "{topic}");
        }
    }
}

/// Though the salvaging program is given the kinds of events of runs without an area.
#[test]
fn salvage_keeps_components_and_their_schemas() {
    let folder = folder();
    let (run, items) = log(folder.path(), 9);
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
    let schema = |topic: &str| {
        let of = announced(&run);
        let channel = of.iter().find(|part| part.name() == Some(topic)).unwrap();
        let schema = of.iter().find(|part| part.opcode == op::SCHEMA && part.body[..2] == channel.body[2..4]);
        String::from_utf8_lossy(&schema.unwrap().body).into_owned()
    };
    assert!(
        schema("/switch").contains("stick_position_across_m") && !schema("/switch").contains("junctions")
    );
    assert!(schema("/events/slip").contains("First column in which a contact slid."));
}

/// Events are paired by their boxes, and other rows are a difference; a table without rows is compared in the
/// other columns.
#[test]
fn a_diff_compares_rows_where_both_sides_have_them() {
    let folder = folder();
    let (run, _) = log(folder.path(), 9);
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
    let differs = |name: &str, table: String| {
        let path = write(name, table);
        let matches = folder.path().join(format!("{name}.parquet"));
        let output = asperity(&["diff", text(&run), text(&path), "--matches", text(&matches)]);
        assert_eq!(output.status.code(), Some(1));
        (String::from_utf8(output.stdout).unwrap(), succeed(&["events", text(&matches)]))
    };
    let (said, matches) = differs("wider.csv", events.replace("false,1,2", "false,1,3"));
    assert!(said.contains("columns 2-3, rows 1-2") && said.contains("last_across 2 -> 3"), "{said}");
    assert_eq!(cell(&matches, 0, "new_last_across"), "3", "{matches}");
    // Rows 1 and 2 have nothing in common with row 3, so the events are no pair.
    let (said, _) = differs("elsewhere.csv", events.replace("false,1,2", "false,3,3"));
    assert!(said.contains("missing: old 0") && said.contains("extra: new 0"), "{said}");
    let broken = write("broken.csv", events.replace("false,1,2", "false,2,1"));
    let output = asperity(&["diff", text(&run), text(&broken)]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(2) && said.contains("last_across: \"1\" is not accepted"), "{said}");
}

/// Removes a key.
fn take(message: &mut Value, key: &str) {
    message.as_object_mut().expect("it is an object").remove(key);
}

#[test]
fn components_and_boxes_that_contradict_each_other_are_refused() {
    let folder = folder();
    let (run, _) = log(folder.path(), 9);
    let sound = take_apart(&fs::read(&run).unwrap());
    type Change = fn(&mut Value);
    let cases: [(&str, usize, Change, &str); 23] = [
        (
            "/switch",
            0,
            |switch| take(switch, "velocity_across_m_per_s"),
            "a switch of block 6 without velocity_across_m_per_s",
        ),
        (
            "/switch",
            1,
            |switch| switch["tangential_force_across_n"] = json!(-3.9),
            "block 3 detaches under 4.92",
        ),
        (
            "/switch",
            0,
            |switch| switch["threshold_n"] = json!(5.5),
            "block 6 detaches under 5 N, below 5.5 N",
        ),
        (
            "/fields",
            0,
            |state| take(state, "displacement_across_m"),
            "displacement_across_m has 0 values, not 12",
        ),
        (
            "/fields",
            0,
            |state| state["stick_position_across_m"] = json!([0.5]),
            "stick_position_across_m has 1 values, not 12",
        ),
        (
            "/window",
            0,
            |window| window["velocity_across_m_per_s"] = json!([0.5, 0.5, 0.5]),
            "velocity_across_m_per_s has 3 values, not 2",
        ),
        ("/events/onset", 0, |onset| take(onset, "tangential_force_across_n"), "None, in a run with 3 rows"),
        (
            "/events/slip",
            0,
            |slip| take(slip, "last_across"),
            "first_across = Some(1) and last_across = None",
        ),
        (
            "/events/slip",
            0,
            |slip| slip["last_across"] = json!(4),
            "columns 2 to 3 and rows 1 to 4 of 4 columns and 3 rows",
        ),
        (
            "/events/slip",
            0,
            |slip| slip["last_block"] = json!(5),
            "columns 2 to 5 and rows 1 to 2 of 4 columns",
        ),
        (
            "/events/slip",
            0,
            |slip| slip["nucleation_block"] = json!(9),
            "nucleation at block 9, outside 2 to 3 and rows 1 to 2",
        ),
        (
            "/events/slip",
            0,
            |slip| slip["blocks_slipped"] = json!(5),
            "blocks_slipped = 5 between columns 2 and 3, rows 1 and 2",
        ),
        ("/events/slip", 1, |slip| slip["max_sliding"] = json!(2), "max_sliding = 2 between columns 4 and 4"),
        ("/events/rupture", 0, |rupture| take(rupture, "contacts"), "contacts = None, in a run with 3 rows"),
        (
            "/events/rupture",
            0,
            |rupture| rupture["contacts"] = json!(1),
            "contacts = 1 between columns 2 and 3",
        ),
        (
            "/events/rupture",
            0,
            |rupture| rupture["contacts"] = json!(5),
            "contacts = 5 between columns 2 and 3",
        ),
        (
            "/events/rupture",
            0,
            |rupture| rupture["potency_m2"] = json!(1.0),
            "it has potency_m2, in a run with",
        ),
        (
            "/events/rupture",
            0,
            |rupture| rupture["reached_every_block"] = json!(true),
            "reached_every_block = true of 2 blocks",
        ),
        ("/events/rupture", 0, |rupture| rupture["contacts"] = json!(3), "2 detachments of 3 blocks"),
        ("/events/arrival", 0, |arrival| arrival["across"] = json!(2), "across = Some(2) of block 3"),
        (
            "/events/arrival",
            0,
            |arrival| take(arrival, "column"),
            "column = None and across = Some(1) of block 3",
        ),
        (
            "/events/arrival",
            0,
            |arrival| take(arrival, "slip_across_m"),
            "slip_across_m = None, in a run with",
        ),
        ("/events/arrival", 0, |arrival| arrival["slip_across_m"] = json!(0.25), "events differ from number"),
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

/// Messages under a header of another arrangement.
#[test]
fn components_in_a_run_without_rows_and_rows_that_do_not_fit_are_refused() {
    let folder = folder();
    let (run, _) = log(folder.path(), 9);
    let sound = take_apart(&fs::read(&run).unwrap());
    for (rows, says) in [
        (None, "a switch of block 6 with displacement_across_m"),
        (Some("5"), "a whole number that divides that of blocks"),
        (Some("2"), "nucleation at block 6, outside 2 to 3 and rows 1 to 2"),
    ] {
        let mut parts = sound.clone();
        let at = parts.iter().position(|part| part.name() == Some("run")).unwrap();
        let mut map = parts[at].map().unwrap();
        map.remove("rows");
        map.extend(rows.map(|rows| ("rows".to_owned(), rows.to_owned())));
        parts[at] = Part::metadata("run", &map);
        fs::write(&run, put_together(&parts, Packing::USUAL)).unwrap();
        let (code, said) = check(&run);
        assert!(code == Some(4) && said.contains(says), "{rows:?}: {says}: {code:?}: {said}");
    }
}
