//! Contacts over an area and counts of junctions in records, events and ruptures, on made-up logs: every
//! command that reads one has their columns, with or without events, and a log in which they contradict each
//! other is refused. A further kind is one more constant here.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::laws::thin::messages;
use crate::support::binary::{ends, outcome, succeed, text};
use crate::support::forgeries::changed;
use crate::support::kinds as made;
use crate::support::parquet::csv_of;
use asperity_record::{FieldRecord, Parts, RunHeader, RunStatus, SolverReport, WindowRecord};
use asperity_run::detectors::{self, Settings};
use asperity_run::{Task, Verdict};
use asperity_runlog::{Content, Existing, LogItem, RunWriter};
use asperity_testkit::{folder, read_log, read_until_problem, scenario};
use mcap::records::op;
use serde_json::Value;

/// What is asked of a kind.
struct Kind {
    made: made::Kind,
    /// The end of the headings of its tables, by topic.
    headings: &'static [(&'static str, &'static str)],
    /// Those that only a state, not the header, gives their columns.
    by_state: &'static [&'static str],
    /// Texts of its schemas, and words that they lack, by topic.
    schemas: &'static [(&'static str, &'static str, &'static str)],
    /// The ends of its two slip events as rows, and that of one as JSON.
    slips: [&'static str; 2],
    json: &'static str,
    /// The topic, the row, and cells of it.
    cells: &'static [(&'static str, usize, &'static str)],
    /// What is replaced in the events, by what, the code of a comparison, and what it says.
    differs: &'static [(&'static str, &'static str, i32, &'static [&'static str])],
    /// A cell of what matches in the first of them.
    matches: Option<(&'static str, &'static str)>,
    /// Forged messages: the topic, the number, keys that are changed, or removed by null, and what is said of it.
    refused: &'static [(&'static str, usize, &'static str, &'static str)],
    /// The same of binary messages: the topic, a change of its first message, and what is said of it.
    refused_bulk: &'static [(&'static str, Change, &'static str)],
    /// The key of the header that makes the kind, with other values or without, and what is said of it.
    key: &'static str,
    headers: &'static [(Option<&'static str>, &'static str)],
}

/// Another message in the place of one.
type Change = fn(&[u8]) -> Vec<u8>;

/// Keys or columns, each with a value in JSON.
fn values(text: &str) -> impl Iterator<Item = (&str, Value)> {
    let pairs = text.split(' ').map(|pair| pair.split_once('=').expect("a key and its value"));
    pairs.map(|(key, value)| (key, serde_json::from_str(value).expect("JSON")))
}

/// The last step of logs without events.
const STILL: u64 = 2;

const AREA: Kind = Kind {
    made: made::AREA,
    headings: &[
        (
            "switch",
            ",threshold_n,displacement_across_m,velocity_across_m_per_s,tangential_force_across_n,stick_position_across_m",
        ),
        (
            "fields",
            ",detached,displacement_across_m,velocity_across_m_per_s,tangential_force_across_n,stick_position_across_m",
        ),
        (
            "window",
            ",tangential_force_n,displacement_across_m,velocity_across_m_per_s,tangential_force_across_n",
        ),
        ("events.slip", ",open,first_across,last_across"),
        ("events.onset", ",ft_fn_onset,tangential_force_across_n"),
        ("events.rupture", ",slip_weighted_shear_force_drop_n,first_across,last_across,contacts,potency_m3"),
        ("events.arrival", ",force_after_n,column,across,slip_across_m,local_speed_m_per_s"),
    ],
    by_state: &[],
    schemas: &[
        ("/switch", "stick_position_across_m", "junctions"),
        ("/events/slip", "First column in which a contact slid.", "breaks_onset"),
    ],
    slips: ["false,1,2", "true,3,3"],
    json: r#""first_across":1,"last_across":2}"#,
    cells: &[
        ("switch", 0, "tangential_force_across_n=-4"),
        ("switch", 1, "block=3 stick_position_across_m=0.0625"),
        ("fields", 1, "block=2 tangential_force_across_n=-1"),
        ("fields", 11, "stick_position_across_m=10.875"),
        ("window", 1, "block=6 displacement_across_m=-1.5 velocity_across_m_per_s=-1.25"),
        ("events.slip", 0, "first_block=2 last_block=3 blocks_slipped=2 nucleation_block=6"),
        ("events.slip", 1, "first_block=4 last_block=4 blocks_slipped=1 nucleation_block=12 first_across=3"),
        ("events.onset", 0, "tangential_force_across_n=-4"),
        (
            "events.rupture",
            0,
            "first_block=2 last_block=3 first_across=1 last_across=2 contacts=2 potency_m2=null",
        ),
        (
            "events.arrival",
            1,
            "block=6 column=2 across=2 slip_m=1.5 slip_across_m=0.5 local_speed_m_per_s=null",
        ),
        ("events.arrival", 1, "force_detach_n=5 force_attach_n=1"),
    ],
    differs: &[
        ("false,1,2", "false,1,3", 1, &["columns 2-3, rows 1-2", "last_across 2 -> 3"]),
        // Rows 1 and 2 have nothing in common with row 3, so the events are no pair.
        ("false,1,2", "false,3,3", 1, &["missing: old 0", "extra: new 0"]),
        ("false,1,2", "false,2,1", 2, &["last_across: \"1\" is not accepted"]),
    ],
    matches: Some(("new_last_across", "3")),
    refused: &[
        ("/switch", 0, "velocity_across_m_per_s=null", "a switch of block 6 without velocity_across_m_per_s"),
        ("/switch", 1, "tangential_force_across_n=-3.9", "block 3 detaches under 4.92"),
        ("/switch", 0, "threshold_n=5.5", "block 6 detaches under 5 N, below 5.5 N"),
        ("/events/slip", 0, "last_across=null", "it lacks last_across, in a run with Area"),
        ("/events/slip", 0, "last_across=4", "last_across = 4 of 4 columns and 3 rows"),
        ("/events/slip", 0, "last_block=5", "last_block = 5 of 4 columns"),
        ("/events/slip", 0, "last_block=1", "last_block = 1, and first_block = 2"),
        ("/events/slip", 0, "blocks_slipped=13", "blocks_slipped = 13 of 4 columns"),
        ("/events/slip", 0, "blocks_slipped=5", "events differ from number"),
        ("/events/rupture", 0, "contacts=null", "it lacks contacts, in a run with Area"),
        ("/events/rupture", 0, "nucleation_block=0", "nucleation_block = 0 of 4 columns"),
        ("/events/arrival", 0, "column=null", "it lacks column, in a run with Area"),
        ("/events/arrival", 0, "slip_across_m=0.25", "events differ from number"),
    ],
    refused_bulk: &[
        (
            "/fields",
            |message| changed(message, |state: &mut FieldRecord| state.displacement_across_m.clear()),
            "displacement_across_m has 0 values, not 12",
        ),
        (
            "/fields",
            |message| changed(message, |state: &mut FieldRecord| state.stick_position_across_m.truncate(1)),
            "stick_position_across_m has 1 values, not 12",
        ),
        (
            "/window",
            |message| changed(message, |state: &mut WindowRecord| state.velocity_across_m_per_s.push(0.5)),
            "velocity_across_m_per_s has 3 values, not 2",
        ),
    ],
    key: "rows",
    headers: &[
        (None, "a switch of block 6 with displacement_across_m"),
        (Some("5"), "a whole number that divides that of blocks"),
        (Some("2"), "first_across = 3 of 6 columns and 2 rows"),
    ],
};

const JUNCTIONS: Kind = Kind {
    made: made::JUNCTIONS,
    headings: &[
        ("step", ",scheme_work_j,breaks,repins"),
        ("switch", ",threshold_n,junctions_slipping"),
        ("fields", ",detached,junctions_slipping,pinned_mean_ratio,pinned_width_ratio"),
        ("events.slip", ",open,breaks_onset,breaks_end,repins_onset,repins_end"),
    ],
    by_state: &["fields"],
    schemas: &[("/switch", "junctions_slipping", "across"), ("/events/slip", "breaks_onset", "across")],
    slips: ["false,5,8,0,4", "true,13,,4,"],
    json: r#""breaks_onset":13,"repins_onset":4}"#,
    cells: &[
        ("step", 1, "switches=0 breaks=5 repins=0"),
        ("switch", 1, "junctions_slipping=4"),
        ("fields", 1, "detached=false junctions_slipping=1 pinned_mean_ratio=0.25 pinned_width_ratio=0.1"),
        ("events.slip", 1, "open=true breaks_onset=13 breaks_end=null repins_onset=4 repins_end=null"),
    ],
    differs: &[("false,5,8,", "false,5,9,", 1, &["breaks_end"])],
    matches: None,
    refused: &[
        ("/step", 1, "repins=null", "step 3: it has breaks without repins"),
        ("/step", 1, "breaks=null", "step 3: it has repins without breaks"),
        (
            "/step",
            1,
            "breaks=null repins=null",
            "step 3: it has no breaks and repins, in a run with junctions",
        ),
        (
            "/step",
            1,
            "peak_velocity_m_per_s=-0.5",
            "step 3: peak_velocity_m_per_s = Some(-0.5), in a run with has_state = false",
        ),
        (
            "/events/slip",
            1,
            "peak_velocity_m_per_s=0.5",
            "it has peak_velocity_m_per_s, in a run without State",
        ),
        ("/step", 2, "breaks=4", "step 4: breaks = 4, after 5"),
        ("/step", 3, "repins=0", "step 5: repins = 0, after 1"),
        ("/step", 2, "repins=8", "step 4: 7 breaks and 8 repins of 30 junctions"),
        ("/step", 2, "breaks=32", "step 4: 32 breaks and 1 repins of 30 junctions"),
        ("/switch", 0, "junctions_slipping=null", "a switch of block 1 without junctions_slipping"),
        ("/switch", 0, "junctions_slipping=11", "11 junctions slip, of 10 at each contact"),
        ("/events/slip", 0, "breaks_end=3", "breaks_end = 3, and breaks_onset = 5"),
        ("/events/slip", 1, "breaks_onset=12", "events differ from number 3"),
    ],
    refused_bulk: &[(
        "/fields",
        |message| changed(message, |state: &mut FieldRecord| state.pinned_mean_ratio.clear()),
        "pinned_mean_ratio has 0 values, not 3",
    )],
    key: "junction_count",
    headers: &[(None, "breaks and repins, in a run without junctions")],
};

impl Kind {
    /// Writes the log of the steps up to this one, as by another program; returns its contents.
    fn log(&self, path: &Path, last: u64) -> Vec<LogItem> {
        let (scenario, _) = scenario("default", self.made.sets);
        let toml = scenario.to_commented_toml();
        let mut header =
            RunHeader { code_version: "of another program".to_owned(), ..Task::new(&scenario).header() };
        (self.made.announce)(&mut header);
        let mut records = (self.made.records)(&header);
        records.retain(|record| record.step() <= last);
        header.steps = records[records.len() - 1].step();
        let mut detectors = Settings::default().start(&header, Some(&scenario));
        let kinds: Vec<_> = detectors.kinds().collect();
        let mut writer =
            RunWriter::create(path, Existing::Refuse, &header, &toml, &kinds, Content::Text).unwrap();
        let mut items = Vec::new();
        for record in records {
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
        items
    }
}

/// A log of a kind, and one without events.
struct Logs {
    folder: tempfile::TempDir,
    run: PathBuf,
    still: PathBuf,
    items: Vec<LogItem>,
}

/// Does something with the logs of each kind.
fn each(ask: impl Fn(&Kind, &Logs)) {
    for kind in [AREA, JUNCTIONS] {
        let folder = folder();
        let [run, still] = ["run", "still"].map(|name| folder.path().join(format!("{name}.mcap")));
        let items = kind.log(&run, u64::MAX);
        kind.log(&still, STILL);
        ask(&kind, &Logs { folder, run, still, items });
    }
}

fn heading(table: &str) -> &str {
    table.lines().next().expect("a heading")
}

/// A row of a table in CSV or NDJSON.
fn row(table: &str, number: usize) -> BTreeMap<String, Value> {
    if table.starts_with('{') {
        return serde_json::from_str(table.lines().nth(number).unwrap()).unwrap();
    }
    let cells = table.lines().nth(number + 1).unwrap().split(',');
    // Numbers and words as JSON has them; nothing is null.
    let value =
        |cell: &str| serde_json::from_str(if cell.is_empty() { "null" } else { cell }).unwrap_or_default();
    heading(table).split(',').map(str::to_owned).zip(cells.map(value)).collect()
}

fn assert_cells(kind: &Kind, topic: &str, table: &str) {
    for (_, number, cells) in kind.cells.iter().filter(|(of, ..)| *of == topic) {
        let row = row(table, *number);
        for (column, expected) in values(cells) {
            let found = row.get(column).unwrap_or(&Value::Null);
            let is_equal = *found == expected || found.is_number() && found.as_f64() == expected.as_f64();
            assert!(is_equal, "{topic}, row {number}: {column} is {found}, not {expected}\n{table}");
        }
    }
}

#[test]
fn every_table_has_the_columns_of_its_kind() {
    each(|kind, Logs { folder, run, still, items }| {
        assert_eq!(read_log(run).expect("it is whole").0, *items);
        // The detectors find the same events again.
        ends(6, &["check", text(run)], &[]);

        let events = succeed(&["events", text(run)]);
        let ends: Vec<&str> =
            events.lines().skip(1).map(|row| row.rsplit_once(",0.5,0.5,").unwrap().1).collect();
        assert_eq!(ends, kind.slips, "{events}");
        assert_eq!(succeed(&["replay", "--format", "csv", text(run)]), events);
        assert_eq!(succeed(&["events", text(still)]), format!("{}\n", heading(&events)));
        assert!(succeed(&["events", "--format", "json", text(run)]).contains(kind.json));

        let replayed = folder.path().join("replayed");
        succeed(&["replay", text(run), "--out", text(&replayed)]);
        for (format, is_table) in [("csv", true), ("parquet", true), ("ndjson", false)] {
            let out = folder.path().join(format);
            fs::create_dir(&out).unwrap();
            succeed(&["export", "--to", format, "--out", text(&out), text(run), text(still)]);
            let table = |run: &str, topic: &str| {
                let path = out.join(format!("{run}.{topic}.{format}"));
                if format == "parquet" { csv_of(&path) } else { fs::read_to_string(path).unwrap() }
            };
            for (topic, end) in kind.headings {
                let of_topic = table("run", topic);
                assert!(!is_table || heading(&of_topic).ends_with(end), "{topic}: {of_topic}");
                assert_cells(kind, topic, &of_topic);
                // Also of a log without such events and states.
                let is_told = is_table && !kind.by_state.contains(topic);
                assert!(!is_told || heading(&table("still", topic)) == heading(&of_topic), "{topic}");
                if let (Some(event), "csv") = (topic.strip_prefix("events."), format) {
                    let name = if event == "slip" { "event" } else { event };
                    let again = fs::read_to_string(replayed.join(format!("run.{name}s.csv"))).unwrap();
                    assert_cells(kind, topic, &again);
                    assert!(heading(&again).ends_with(end), "{topic}: {again}");
                }
            }
        }
    });
}

/// Though the salvaging program is given the kinds of events of plain runs.
#[test]
fn salvage_keeps_items_and_schemas() {
    each(|kind, Logs { folder, run, items, .. }| {
        let (damaged, out) = (folder.path().join("damaged.mcap"), folder.path().join("out.mcap"));
        let mut bytes = fs::read(run).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        fs::write(&damaged, bytes).unwrap();
        let settle = |logged: Option<RunHeader>, _: Option<&str>| Ok((logged.unwrap(), Vec::new()));
        asperity_runlog::salvage(&damaged, &out, &detectors::event_kinds(Parts::default()), &settle).unwrap();
        assert_eq!(read_until_problem(&out).0, *items);
        let announced = |path: &Path| {
            let parts = take_apart(&fs::read(path).unwrap()).into_iter();
            parts.filter(|part| matches!(part.opcode, op::SCHEMA | op::CHANNEL)).collect::<Vec<Part>>()
        };
        let parts = announced(run);
        assert_eq!(announced(&out), parts);
        for (topic, has, lacks) in kind.schemas {
            let channel = parts.iter().find(|part| part.name() == Some(topic)).unwrap();
            let is_its = |part: &&Part| part.opcode == op::SCHEMA && part.body[..2] == channel.body[2..4];
            let schema = String::from_utf8_lossy(&parts.iter().find(is_its).unwrap().body);
            assert!(schema.contains(has) && !schema.contains(lacks), "{topic}: {schema}");
        }
    });
}

/// A table without the columns is compared in the others.
#[test]
fn a_diff_compares_what_both_sides_have() {
    each(|kind, Logs { folder, run, .. }| {
        let events = succeed(&["events", text(run)]);
        let other = folder.path().join("other.csv");
        let cells = |row: &str| row.split(',').take(15).collect::<Vec<_>>().join(",") + "\n";
        for same in [events.clone(), events.lines().map(cells).collect()] {
            fs::write(&other, same).unwrap();
            assert!(succeed(&["diff", text(run), text(&other)]).contains("nothing differs"));
        }
        for (number, (from, to, code, says)) in kind.differs.iter().enumerate() {
            fs::write(&other, events.replace(from, to)).unwrap();
            let matches = folder.path().join(format!("{number}.parquet"));
            let (found, out, err) = outcome(&["diff", text(run), text(&other), "--matches", text(&matches)]);
            let said = out + &err;
            assert_eq!(found, *code, "{said}");
            assert!(says.iter().all(|says| said.contains(says)), "{says:?}: {said}");
            if let (0, Some((column, cell))) = (number, kind.matches) {
                assert_eq!(row(&csv_of(&matches), 0)[column].to_string(), cell);
            }
        }
    });
}

/// Changes a sound log; what is then said of it, and the verdict.
fn forged(sound: &[Part], change: impl FnOnce(&mut Vec<Part>)) -> (Verdict, String) {
    let folder = folder();
    let forged = folder.path().join("forged.mcap");
    let mut parts = sound.to_vec();
    change(&mut parts);
    fs::write(&forged, put_together(&parts, Packing::USUAL)).unwrap();
    let checked = asperity_run::check(&forged);
    (checked.verdict, checked.to_string())
}

#[test]
fn messages_that_contradict_each_other_are_refused() {
    each(|kind, Logs { run, .. }| {
        let sound = take_apart(&fs::read(run).unwrap());
        for (topic, number, changes, says) in kind.refused {
            let (verdict, said) = forged(&sound, |parts| {
                let at = messages(parts, topic)[*number];
                let mut message: serde_json::Map<String, Value> =
                    serde_json::from_slice(parts[at].payload().unwrap()).unwrap();
                for (key, value) in values(changes) {
                    let former = message.remove(key);
                    assert!(former.is_some() || !value.is_null(), "{topic} has no {key}");
                    message.extend((!value.is_null()).then(|| (key.to_owned(), value)));
                }
                parts[at] = parts[at].with_payload(Value::from(message).to_string().as_bytes());
                correct_end(parts);
            });
            // Other code may find other events.
            let may_be = says.starts_with("events differ");
            let expected = if may_be { Verdict::OtherCode } else { Verdict::Damaged };
            assert!(verdict == expected && said.contains(says), "{topic} {number}: {says}: {said}");
        }
        for (topic, change, says) in kind.refused_bulk {
            let (verdict, said) = forged(&sound, |parts| {
                let at = messages(parts, topic)[0];
                parts[at] = parts[at].with_payload(&change(parts[at].payload().unwrap()));
                correct_end(parts);
            });
            assert!(verdict == Verdict::Damaged && said.contains(says), "{topic}: {says}: {said}");
        }
    });
}

/// Messages under a header of another kind.
#[test]
fn messages_that_contradict_the_header_are_refused() {
    each(|kind, Logs { run, .. }| {
        let sound = take_apart(&fs::read(run).unwrap());
        for (value, says) in kind.headers {
            let (verdict, said) = forged(&sound, |parts| {
                let at = parts.iter().position(|part| part.name() == Some("run")).unwrap();
                let mut map = parts[at].map().unwrap();
                assert!(map.remove(kind.key).is_some(), "no {}", kind.key);
                map.extend(value.map(|value| (kind.key.to_owned(), value.to_owned())));
                parts[at] = Part::metadata("run", &map);
            });
            assert!(verdict == Verdict::Damaged && said.contains(says), "{value:?}: {says}: {said}");
        }
    });
}
