//! Independent programs read the files of asperity: the packages `mcap`, `pymcap-cli`, `rerun-sdk`,
//! `polars`, `pandas` and `duckdb` of Python, and `@mcap/core` of Node.
//!
//! Their results are compared with `asperity export` of the same log. Those that verify checksums must
//! refuse damaged copies. `cargo xtask ci` installs them and passes their paths. Without it these tests
//! skip with a message; with `ASPERITY_NO_SKIPS=1` they fail instead.

use std::collections::BTreeMap;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::export::TOPICS;
use crate::support::binary::{succeed, text, with_sets};
use crate::support::clients::{Python, file, find, said};
use crate::support::{binary, small};
use asperity_runlog::LogProblem;
use asperity_testkit::{folder, read_log};
use mcap::McapError;
use mcap::read::LinearReader;
use mcap::records::Record;
use serde_json::{Map, Value, json};

/// A range of time in which the small run has several messages of both topics, s
/// and ns.
const SLICE: [(&str, &str); 2] = [("0.55", "550000000"), ("0.75", "750000000")];

/// The folder with the packages of Node.
struct Node(PathBuf);

impl Node {
    fn find() -> Option<Node> {
        find("ASPERITY_NODE_CLIENTS", "Node").map(Node)
    }

    fn read_log(&self, log: &Path, from_ns: &str, to_ns: &str) -> Output {
        Command::new("node")
            .arg(file("tests/clients/node/read_log.cjs"))
            .args([text(&self.0), text(log), from_ns, to_ns])
            .output()
            .expect("node starts")
    }
}

/// The small run, whole, cut off and with a bit flipped.
struct Logs {
    folder: tempfile::TempDir,
    whole: PathBuf,
    cut: PathBuf,
    flipped: PathBuf,
}

impl Logs {
    fn make() -> Logs {
        let folder = folder();
        let log = |name: &str| folder.path().join(name);
        let (whole, cut, flipped) = (log("run.mcap"), log("cut.mcap"), log("flipped.mcap"));
        small::run(&whole);
        let bytes = fs::read(&whole).expect("the log can be read");
        fs::write(&cut, &bytes[..bytes.len() / 2]).expect("the folder can be written");
        flip(bytes, &flipped);
        Logs { folder, whole, cut, flipped }
    }
}

/// Flips a bit of a compressed chunk, from the middle of the log on, such that the chunk unpacks to the
/// same length and only digits change: every decoder can read it, and only the checksum reveals it. The bit
/// depends on every byte of the log.
fn flip(mut bytes: Vec<u8>, path: &Path) {
    for chunk in chunks(&bytes) {
        let whole = unpacked(&bytes[chunk.clone()]).expect("the log is whole");
        for at in chunk.clone().filter(|at| *at > bytes.len() / 2).collect::<Vec<usize>>() {
            for bit in 0..8 {
                bytes[at] ^= 1 << bit;
                let unpacked = unpacked(&bytes[chunk.clone()]);
                if unpacked.is_ok_and(|unpacked| is_misprinted(&whole, &unpacked)) {
                    fs::write(path, &bytes).expect("the folder can be written");
                    let problem = read_log(path).expect_err("its checksum is wrong").problem;
                    assert!(
                        matches!(problem, LogProblem::Record { error: McapError::BadChunkCrc { .. }, .. }),
                        "{problem}"
                    );
                    return;
                }
                bytes[at] ^= 1 << bit;
            }
        }
    }
    panic!("no flipped bit is left to the checksum");
}

/// Whether a text differs from another of the same length in digits alone, none of which becomes a 0.
fn is_misprinted(text: &[u8], other: &[u8]) -> bool {
    let mut others = text.iter().zip(other).filter(|(a, b)| a != b);
    text.len() == other.len()
        && text != other
        && others.all(|(a, b)| a.is_ascii_digit() && b.is_ascii_digit() && *b != b'0')
}

/// Positions of the packed records of each chunk of a log.
fn chunks(bytes: &[u8]) -> Vec<Range<usize>> {
    let mut chunks = Vec::new();
    let mut at = 8;
    for record in LinearReader::new(bytes).expect("the log is MCAP") {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        at += 9 + length;
        if let Record::Chunk { data, .. } = record.expect("the log is whole") {
            // The last field.
            chunks.push(at - data.len()..at);
        }
    }
    chunks
}

fn unpacked(packed: &[u8]) -> std::io::Result<Vec<u8>> {
    zstd::stream::decode_all(packed)
}

/// The rows that asperity exports for a topic, and the number of their messages.
fn exported(log: &Path, topic: &str, range: &[&str]) -> (usize, Vec<Map<String, Value>>) {
    let out = folder();
    succeed(
        &[&["export", text(log), "--to", "ndjson", "--topic", topic, "--out", text(out.path())], range]
            .concat(),
    );
    let rows = rows(out.path(), topic);
    (messages(topic, &rows), rows)
}

/// The rows of a topic among those exported into a folder.
fn rows(out: &Path, topic: &str) -> Vec<Map<String, Value>> {
    let name = format!("run.{}.ndjson", topic[1..].replace('/', "."));
    let lines = fs::read_to_string(out.join(name)).expect("the file was written");
    lines.lines().map(|line| serde_json::from_str(line).expect("a line is an object")).collect()
}

/// The number of messages that these are rows of.
fn messages(topic: &str, rows: &[Map<String, Value>]) -> usize {
    match topic {
        "/fields" | "/window" => rows.chunk_by(|row, next| row["step"] == next["step"]).count(),
        _ => rows.len(),
    }
}

/// Messages per topic of the small run, according to asperity.
fn counts(log: &Path) -> BTreeMap<String, usize> {
    let out = folder();
    succeed(&["export", text(log), "--to", "ndjson", "--out", text(out.path())]);
    TOPICS.map(|topic| (topic.to_owned(), messages(topic, &rows(out.path(), topic)))).into()
}

fn parsed(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", said(output)))
}

/// A message as in the log, which clients return as text.
fn message(text: &Value) -> Map<String, Value> {
    serde_json::from_str(text.as_str().expect("a message is a text")).expect("a message is an object")
}

/// The output of `read_log.py` and `read_log.cjs` for the small run, against the export.
fn assert_read(found: &Value, log: &Path) {
    let counts = counts(log);
    assert_eq!(found["status"], "complete");
    assert_eq!(found["attachments"], json!(["scenario.toml"]));
    assert_eq!(found["counts"], json!(counts), "after the log's statistics");
    for (topic, count) in &counts {
        let read = found["all"].get(topic).map_or(0, |entry| entry["count"].as_u64().unwrap() as usize);
        assert_eq!(read, *count, "messages of {topic}");
    }
    for topic in ["/step", "/switch", "/events/slip"] {
        let (_, rows) = exported(log, topic, &[]);
        assert_eq!(message(&found["all"][topic]["last"]), *rows.last().unwrap(), "the last of {topic}");
    }
    let range = ["--from-s", SLICE[0].0, "--to-s", SLICE[1].0];
    let (count, rows) = exported(log, "/step", &range);
    assert!(count > 100 && count < counts["/step"]);
    assert_eq!(found["slice"]["/step"]["count"], count);
    assert_eq!(message(&found["slice"]["/step"]["last"]), *rows.last().unwrap());
    let (count, rows) = exported(log, "/fields", &range);
    assert!(count > 10 && count < counts["/fields"]);
    assert_eq!(found["slice"]["/fields"]["count"], count);
    let fields = message(&found["slice"]["/fields"]["last"]);
    let last = &rows[rows.len() - 10..];
    for (name, in_log) in fields.iter().filter(|(_, values)| values.is_array()) {
        let column: Vec<&Value> = last.iter().map(|row| &row[name]).collect();
        if name == "detached" {
            assert_eq!(
                json!(column.iter().map(|flag| u8::from(**flag == true)).collect::<Vec<_>>()),
                *in_log
            );
        } else {
            // Node writes -0 as 0.
            let numbers = |values: &[&Value]| values.iter().map(|value| value.as_f64()).collect::<Vec<_>>();
            let in_log: Vec<&Value> = in_log.as_array().expect("it is an array").iter().collect();
            assert_eq!(numbers(&column), numbers(&in_log), "{name}");
        }
    }
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn python_reads_logs_and_tables() {
    let Some(python) = Python::find() else { return };
    let logs = Logs::make();
    let tables = logs.folder.path().join("tables");
    succeed(&["reduce", text(&logs.whole), "--out", text(&tables)]);
    let output =
        python.program("python", &[text(&file("tests/clients/check.py")), text(&logs.whole), text(&tables)]);
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn mcap_reads_by_topic_and_time() {
    let Some(python) = Python::find() else { return };
    let logs = Logs::make();
    let read = |log: &Path| {
        python
            .program("python", &[text(&file("tests/clients/read_log.py")), text(log), SLICE[0].1, SLICE[1].1])
    };
    let output = read(&logs.whole);
    assert!(output.status.success(), "{}", said(&output));
    assert_read(&parsed(&output), &logs.whole);
    let output = read(&logs.flipped);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("CRCValidationError"), "{}", said(&output));
}

/// Whatever the writer of `mcap` makes of a log is read with a note, as long as the messages are the same.
#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn logs_that_another_program_wrote_are_read_by_their_messages() {
    let Some(python) = Python::find() else { return };
    let folder = folder();
    // Of several chunks.
    let (log, _) = killed(folder.path());
    let copies = folder.path().join("copies");
    fs::create_dir(&copies).expect("the folder can be written");
    let made =
        python.program("python", &[text(&file("tests/clients/rewrite.py")), text(&log), text(&copies)]);
    assert!(made.status.success(), "{}", said(&made));
    let names = String::from_utf8(made.stdout).expect("it prints UTF-8");
    let (bad, good): (Vec<&str>, Vec<&str>) = names.lines().partition(|name| name.starts_with("bad-"));
    assert!(good.len() >= 18 && bad.len() >= 8, "{names}");
    let events = succeed(&["events", text(&log)]);
    let run = |arguments: &[&str]| {
        let (code, out, err) = binary::outcome(arguments);
        (code, out + &err)
    };
    let note = "in a file that another program wrote (library \"";
    for name in good {
        let copy = copies.join(name).with_extension("mcap");
        let (code, told) = run(&["check", text(&copy)]);
        assert!(code == 0 && told.contains(": whole: ") && told.contains(note), "{name}: {told}");
        let output = binary::asperity(&["events", text(&copy)]);
        assert!(output.stdout == events.as_bytes(), "{name}: {}", said(&output));
        if !["lz4", "no-chunks-no-crc", "metadata-last"].contains(&name) {
            continue;
        }
        for command in ["events", "summary", "replay", "export", "reduce"] {
            let out = folder.path().join(format!("{name}-{command}"));
            let mut arguments = vec![command, text(&copy)];
            match command {
                "export" => arguments.extend(["--to", "csv", "--out", text(&out)]),
                "reduce" => arguments.extend(["--out", text(&out)]),
                _ => {}
            }
            let (code, told) = run(&arguments);
            assert!(code == 0 && told.contains(note), "{command} {name}: {told}");
        }
        let (code, told) = run(&["salvage", text(&copy), "--out", text(&folder.path().join("none.mcap"))]);
        assert!(code == 0 && told.contains("whole: there is nothing to salvage"), "{name}: {told}");
        let (code, told) = run(&["diff", text(&log), text(&copy)]);
        assert!(code == 0 && told.contains("nothing differs"), "{name}: {told}");
    }
    for name in bad {
        let copy = copies.join(name).with_extension("mcap");
        for command in ["check", "events", "summary", "replay"] {
            let (code, told) = run(&[command, text(&copy)]);
            let reasons = ["says messages of /", "says digest of /", "each of which is right by itself"];
            let is_told = reasons.iter().any(|reason| told.contains(reason));
            assert!(code == 4 && is_told, "{command} {name}: {told}");
        }
    }
    salvage_of_copies(&copies, folder.path());
}

/// Of damaged copies, `salvage` keeps the chunks that a checksum confirms; if there is none, it fails.
fn salvage_of_copies(copies: &Path, folder: &Path) {
    for (name, kept) in [
        ("lz4", true),
        ("none", true),
        ("zstd", true),
        ("chunks-of-1-kb", true),
        ("bad-left-out", true),
        ("bad-changed", false),
        ("no-crc", false),
        ("no-chunks", false),
    ] {
        let mut bytes = fs::read(copies.join(name).with_extension("mcap")).expect("it was just written");
        if !name.starts_with("bad-") {
            // In the middle: of a log of several chunks, most are left.
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
        }
        let (damaged, out) = (folder.join(format!("{name}.mcap")), folder.join(format!("{name}-out.mcap")));
        fs::write(&damaged, bytes).expect("the folder can be written");
        let output = binary::asperity(&["salvage", text(&damaged), "--out", text(&out)]);
        assert_eq!(output.status.code(), Some(if kept { 0 } else { 4 }), "{name}: {}", said(&output));
        assert_eq!(out.exists(), kept, "{name}: {}", said(&output));
        if kept {
            let check = binary::asperity(&["check", text(&out)]);
            assert_eq!(check.status.code(), Some(5), "{name}: {}", said(&check));
            assert!(!said(&output).contains(": 0 messages salvaged"), "{name}: {}", said(&output));
        }
    }
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn node_reads_by_topic_and_time() {
    let Some(node) = Node::find() else { return };
    let logs = Logs::make();
    let output = node.read_log(&logs.whole, SLICE[0].1, SLICE[1].1);
    assert!(output.status.success(), "{}", said(&output));
    assert_read(&parsed(&output), &logs.whole);
    let output = node.read_log(&logs.flipped, SLICE[0].1, SLICE[1].1);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("Incorrect chunk CRC"), "{}", said(&output));
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn pymcap_reads_checks_and_refuses() {
    let Some(python) = Python::find() else { return };
    let logs = Logs::make();
    let pymcap = |arguments: &[&str]| python.program("pymcap-cli", arguments);
    let info = pymcap(&["info-json", text(&logs.whole)]);
    assert!(info.status.success(), "{}", said(&info));
    let info = parsed(&info);
    let found: BTreeMap<String, usize> = info["channels"]
        .as_array()
        .expect("channels are listed")
        .iter()
        .map(|channel| {
            let count = channel["message_count"].as_u64().expect("messages are counted");
            (channel["topic"].as_str().expect("a topic is a text").to_owned(), count as usize)
        })
        .collect();
    assert_eq!(found, counts(&logs.whole));
    assert_eq!(info["statistics"]["message_end_time"], 1_200_000_000);

    let slice = ["--topic", "/step", "--start", SLICE[0].1, "--end", SLICE[1].1];
    let cat = pymcap(&[&["cat", text(&logs.whole)], &slice[..]].concat());
    assert!(cat.status.success(), "{}", said(&cat));
    let lines = String::from_utf8(cat.stdout).expect("it prints UTF-8");
    let (_, rows) = exported(&logs.whole, "/step", &["--from-s", SLICE[0].0, "--to-s", SLICE[1].0]);
    let found: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(found.len(), rows.len());
    for (found, row) in found.iter().zip(rows) {
        assert_eq!(found["message"], Value::Object(row));
    }

    let metadata = parsed(&pymcap(&["get", "metadata", text(&logs.whole), "--name", "run_end"]));
    assert!(metadata.to_string().contains("\"status\":\"complete\""), "{metadata}");
    for (log, code) in [(&logs.whole, 0), (&logs.cut, 1), (&logs.flipped, 1)] {
        let doctor = pymcap(&["doctor", text(log)]);
        assert_eq!(doctor.status.code(), Some(code), "{}: {}", log.display(), said(&doctor));
    }
}

/// Rows of messages in a rerun recording, by entity, as `rerun rrd print` lists them.
fn rows_in_recording(print: &Output, component: &str) -> BTreeMap<String, usize> {
    let mut rows = BTreeMap::new();
    for line in String::from_utf8_lossy(&print.stdout).lines() {
        let Some((_, rest)) = line.split_once(") with ") else { continue };
        // It takes binary messages apart by itself.
        let is_message = line.contains(component) || line.contains("asperity.Fields:message");
        if !is_message || line.contains("McapChannel") {
            continue;
        }
        let (count, rest) = rest.split_once(" rows").expect("a chunk has rows");
        let entity = rest.split(" - ").nth(1).expect("a chunk has an entity").trim();
        let count: usize =
            count.replace([' ', '\u{202f}', '\u{2009}'], "").parse().expect("a number of rows");
        *rows.entry(entity.to_owned()).or_insert(0) += count;
    }
    rows
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn rerun_checks_and_converts() {
    let Some(python) = Python::find() else { return };
    let logs = Logs::make();
    let rerun = |arguments: &[&str]| python.program("rerun", arguments);
    let info = rerun(&["mcap", "info", text(&logs.whole)]);
    assert!(info.status.success(), "{}", said(&info));
    let info = String::from_utf8(info.stdout).expect("it prints UTF-8");
    let counts = counts(&logs.whole);
    for (topic, count) in &counts {
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let line = info.lines().map(words).find(|words| words.get(1) == Some(topic));
        assert_eq!(line.expect("topics are listed")[2], count.to_string(), "messages of {topic}\n{info}");
    }
    for (log, code) in [(&logs.whole, 0), (&logs.cut, 1), (&logs.flipped, 1)] {
        let check = rerun(&["mcap", "check", text(log)]);
        assert_eq!(check.status.code(), Some(code), "{}: {}", log.display(), said(&check));
    }

    let recording = logs.folder.path().join("run.rrd");
    let convert = rerun(&["mcap", "convert", text(&logs.whole), "-o", text(&recording)]);
    assert!(convert.status.success(), "{}", said(&convert));
    let verify = rerun(&["rrd", "verify", text(&recording)]);
    assert!(verify.status.success(), "{}", said(&verify));
    let rows = rows_in_recording(&rerun(&["rrd", "print", text(&recording)]), "McapMessage:data");
    let logged: BTreeMap<String, usize> = counts.into_iter().filter(|(_, count)| *count > 0).collect();
    assert_eq!(rows, logged);

    let slice = ["--include-topic-regex", "^/step$", "--start-time", SLICE[0].1, "--end-time", SLICE[1].1];
    let convert =
        rerun(&[&["mcap", "convert", text(&logs.whole), "-o", text(&recording)], &slice[..]].concat());
    assert!(convert.status.success(), "{}", said(&convert));
    let rows = rows_in_recording(&rerun(&["rrd", "print", text(&recording)]), "McapMessage:data");
    let (count, _) = exported(&logs.whole, "/step", &["--from-s", SLICE[0].0, "--to-s", SLICE[1].0]);
    assert_eq!(rows, BTreeMap::from([("/step".to_owned(), count)]));
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn data_frames_read_what_is_exported_to_the_bit() {
    let Some(python) = Python::find() else { return };
    let logs = Logs::make();
    assert_exported(&python, &logs.whole, logs.folder.path());
}

/// Exported tables have the values of the log, to the bit, in every table reader.
fn assert_exported(python: &Python, log: &Path, folder: &Path) {
    let mut arguments = vec![file("tests/clients/exported.py"), log.to_owned()];
    for format in ["parquet", "csv", "ndjson"] {
        let out = folder.join(format);
        succeed(&["export", text(log), "--to", format, "--out", text(&out)]);
        arguments.push(out);
    }
    let output = python.program("python", &arguments.iter().map(|path| text(path)).collect::<Vec<_>>());
    assert!(output.status.success(), "{}", said(&output));
}

/// States of a slab have one more number for each contact, its normal load.
#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn clients_read_the_log_of_a_slab() {
    let (python, node) = (Python::find(), Node::find());
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let sets = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.26"];
    binary::run(&with_sets(&["slab"], &sets), &log);
    let counts = counts(&log);
    assert!(counts["/switch"] >= 10 && counts["/fields"] > 10 && counts["/events/slip"] > 1, "{counts:?}");
    let (_, rows) = exported(&log, "/fields", &[]);
    let loads: Vec<&Value> = rows[rows.len() - 29..].iter().map(|row| &row["normal_load_n"]).collect();
    assert!(loads.iter().all(|load_n| load_n.as_f64().is_some_and(|load_n| load_n > 10.0)), "{loads:?}");
    let assert_read = |output: &Output| {
        assert!(output.status.success(), "{}", said(output));
        let found = parsed(output);
        assert_eq!((&found["status"], &found["counts"]), (&json!("complete"), &json!(counts)));
        assert_eq!(json!(loads), message(&found["all"]["/fields"]["last"])["normal_load_n"]);
    };
    if let Some(node) = node {
        assert_read(&node.read_log(&log, "0", "1"));
    }
    let Some(python) = python else { return };
    assert_read(&python.program("python", &[text(&file("tests/clients/read_log.py")), text(&log), "0", "1"]));
    for check in [("pymcap-cli", &["doctor"][..]), ("rerun", &["mcap", "check"])] {
        let output = python.program(check.0, &[check.1, &[text(&log)]].concat());
        assert!(output.status.success(), "{}", said(&output));
    }
    assert_exported(&python, &log, folder.path());
}

/// A log of several chunks, and the end of a run that was killed cut from it.
fn killed(folder: &Path) -> (PathBuf, PathBuf) {
    let whole = folder.join("run.mcap");
    binary::run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=2"], &whole);
    let bytes = fs::read(&whole).expect("the log can be read");
    let killed = folder.join("killed.mcap");
    fs::write(&killed, &bytes[..bytes.len() * 3 / 4]).expect("the folder can be written");
    (whole, killed)
}

/// A run that was killed leaves a log without summary, whose contents can be read; the page beside the
/// Foxglove layout lists the readers that report it.
#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn clients_read_what_a_killed_run_has_left() {
    let (python, node) = (Python::find(), Node::find());
    let folder = folder();
    let (whole, killed) = killed(folder.path());
    let out = folder.path().join("out");
    let export = binary::asperity(&["export", text(&killed), "--to", "ndjson", "--out", text(&out)]);
    assert_eq!(export.status.code(), Some(3), "{}", said(&export));
    let steps = fs::read_to_string(out.join("killed.step.ndjson")).expect("the file was written");
    let last: Map<String, Value> =
        serde_json::from_str(steps.lines().last().expect("there are steps")).unwrap();
    let assert_streamed = |output: &Output| {
        assert!(output.status.success(), "{}", said(output));
        let found = parsed(output);
        assert_eq!((&found["done"], &found["status"]), (&json!(false), &Value::Null));
        assert!(found["refused"].as_str().is_some_and(|error| !error.is_empty()));
        // A switch of the last step may be missing, and that step with it.
        let count = found["all"]["/step"]["count"].as_u64().unwrap() as usize;
        assert!((steps.lines().count()..=steps.lines().count() + 1).contains(&count), "{count}");
        if count == steps.lines().count() {
            assert_eq!(message(&found["all"]["/step"]["last"]), last);
        }
    };
    if let Some(node) = node {
        assert_streamed(&node.read_log(&killed, "0", "1"));
    }
    let Some(python) = python else { return };
    assert_streamed(
        &python.program("python", &[text(&file("tests/clients/read_log.py")), text(&killed), "0", "1"]),
    );

    // These report that something is wrong ...
    let rerun = |arguments: &[&str]| python.program("rerun", arguments);
    let doctor = python.program("pymcap-cli", &["doctor", text(&killed)]);
    assert_eq!(doctor.status.code(), Some(1), "{}", said(&doctor));
    let check = rerun(&["mcap", "check", text(&killed)]);
    assert_eq!(check.status.code(), Some(1), "{}", said(&check));
    // ... and rerun reads it with the corresponding option.
    let check = rerun(&["mcap", "check", "--recover", text(&killed)]);
    assert!(check.status.success(), "{}", said(&check));
    let recording = folder.path().join("killed.rrd");
    let convert = rerun(&["mcap", "convert", "--recover", text(&killed), "-o", text(&recording)]);
    assert!(convert.status.success(), "{}", said(&convert));
    let rows = rows_in_recording(&rerun(&["rrd", "print", text(&recording)]), "McapMessage:data");
    assert!(rows["/step"] > 0 && rows["/step"] < exported(&whole, "/step", &[]).0);
}

/// The log of a run that was stopped by a signal.
#[cfg(unix)]
fn interrupted(folder: &Path) -> PathBuf {
    let log = folder.join("run.mcap");
    let mut child = Command::new(env!("CARGO_BIN_EXE_asperity"))
        .args(["run", "default", "--solver", "plain", "--out", text(&log)])
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("the binary starts");
    let partial = folder.join("run.mcap.partial");
    // A run with an existing log handles signals, but the log should have some steps.
    while !partial.exists() {
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    std::thread::sleep(std::time::Duration::from_millis(300));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.expect("there is a kill").success());
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    partial
}

/// A run that a signal stopped has a sound log, so readers that do not know `run_end` find nothing wrong.
#[cfg(unix)]
#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn clients_that_give_metadata_tell_an_interrupted_run() {
    let (python, node) = (Python::find(), Node::find());
    let folder = folder();
    let log = interrupted(folder.path());
    if let Some(node) = node {
        let output = node.read_log(&log, "0", "1");
        assert_eq!(parsed(&output)["status"], "interrupted", "{}", said(&output));
    }
    let Some(python) = python else { return };
    let output = python.program("python", &[text(&file("tests/clients/read_log.py")), text(&log), "0", "1"]);
    assert_eq!(parsed(&output)["status"], "interrupted", "{}", said(&output));
    let metadata = python.program("pymcap-cli", &["get", "metadata", text(&log), "--name", "run_end"]);
    assert!(said(&metadata).contains("interrupted"), "{}", said(&metadata));
    let doctor = python.program("pymcap-cli", &["doctor", text(&log)]);
    assert!(doctor.status.success(), "{}", said(&doctor));
    let check = python.program("rerun", &["mcap", "check", text(&log)]);
    assert!(check.status.success(), "{}", said(&check));
}
