//! MCAP files of other programs: no command takes one for a run log, or destroys it.
//!
//! They are of the kinds of MCAP's conformance suite, written after the specification: contents, and any combination of
//! the suite's features. An MCAP file without messages passed for an unfinished run once, and was overwritten.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use asperity_run::{Verdict, check};
use asperity_runlog::{must_be_ours, partial_path};

use crate::support::binary::{asperity, text};
use crate::support::commands::{ON_LOGS, arguments, words};

const CONTENTS: [&str; 6] =
    ["NoData", "OneAttachment", "OneMetadata", "OneMessage", "OneSchemalessMessage", "TenMessages"];

/// Chunks, indexes of messages, repeated channels and schemas, indexes of attachments and metadata, statistics, indexes
/// of chunks, offsets in the summary, and bytes after the fields of records, which readers must skip.
const FEATURES: [&str; 10] = ["ch", "mx", "rch", "rsh", "ax", "mdx", "st", "chx", "sum", "pad"];

/// The opcodes of records whose last field is as long as the rest, or that have one length.
const UNPADDED: [u8; 2] = [0x02, 0x05];

/// A file of these contents and features, as name and bytes.
fn file(content: &str, features: &[&str]) -> (String, Vec<u8>) {
    let has = |feature: &str| features.contains(&feature);
    let record = |opcode: u8, fields: &[&[u8]]| {
        let padding: &[u8] = if has("pad") && !UNPADDED.contains(&opcode) { &[1, 255, 255] } else { &[] };
        let body = [&fields.concat(), padding].concat();
        [&[opcode][..], &long(body.len()), &body].concat()
    };
    let messages = match content {
        "OneMessage" | "OneSchemalessMessage" => 1,
        "TenMessages" => 10,
        _ => 0,
    };
    let has_schema = messages > 0 && content != "OneSchemalessMessage";
    let schema = record(0x03, &[&[1, 0], &string("Example"), &string("c"), &[3, 0, 0, 0], &[4, 5, 6]]);
    let topic = [string("example"), string("a"), vec![0; 4]].concat();
    let channel = record(0x04, &[&[1, 0], &[u8::from(has_schema), 0], &topic]);
    let mut bytes = [mcap::MAGIC, &record(0x01, &[&string(""), &string("")])].concat();
    let mut summary: BTreeMap<u8, Vec<u8>> = BTreeMap::new();
    let (mut chunk, mut index) = (Vec::new(), Vec::new());
    if has_schema {
        chunk.extend_from_slice(&schema);
        summary.extend(has("rsh").then_some((0x03, schema)));
    }
    if messages > 0 {
        chunk.extend_from_slice(&channel);
        summary.extend(has("rch").then_some((0x04, channel)));
    }
    for n in 0..messages {
        index.extend([long(n), long(chunk.len())].concat());
        chunk.extend(record(0x05, &[&[1, 0], &[n as u8, 0, 0, 0], &long(n), &long(n), &[1, 2, 3]]));
    }
    let times = [long(0), long(messages.max(1) - 1)].concat();
    if has("ch") && messages > 0 {
        let (at, size) = (bytes.len(), long(chunk.len()));
        let crc = crc32fast::hash(&chunk).to_le_bytes();
        bytes.extend(record(0x06, &[&times, &size, &crc, &string(""), &size, &chunk]));
        let (indexes_at, length) = (long(bytes.len()), long(bytes.len() - at));
        let mut offsets = Vec::new();
        if has("mx") {
            bytes.extend(record(0x07, &[&[1, 0], &(index.len() as u32).to_le_bytes(), &index]));
            offsets.extend([&[1, 0], &indexes_at[..]].concat());
        }
        let offsets = [&(offsets.len() as u32).to_le_bytes()[..], &offsets].concat();
        let length_of_indexes = long(bytes.len() - at - u64::from_le_bytes(length) as usize);
        let fields: [&[u8]; 8] =
            [&times, &long(at), &length, &offsets, &length_of_indexes, &string(""), &size, &size];
        summary.extend(has("chx").then(|| (0x08, record(0x08, &fields))));
    } else {
        bytes.extend(chunk);
    }
    let at = long(bytes.len());
    if content == "OneAttachment" {
        let [name, media] = [string("myFile"), string("application/octet-stream")];
        let fields = [&long(2)[..], &long(1), &name, &media, &long(3), &[1, 2, 3]].concat();
        bytes.extend(record(0x09, &[&fields, &crc32fast::hash(&fields).to_le_bytes()]));
        let length = long(bytes.len() - u64::from_le_bytes(at) as usize);
        let fields: [&[u8]; 7] = [&at, &length, &long(2), &long(1), &long(3), &name, &media];
        summary.extend(has("ax").then(|| (0x0A, record(0x0A, &fields))));
    }
    if content == "OneMetadata" {
        let map = [string("foo"), string("bar")].concat();
        bytes.extend(record(0x0C, &[&string("myMetadata"), &(map.len() as u32).to_le_bytes(), &map]));
        let length = long(bytes.len() - u64::from_le_bytes(at) as usize);
        summary.extend(has("mdx").then(|| (0x0D, record(0x0D, &[&at, &length, &string("myMetadata")]))));
    }
    if has("st") {
        let counts = [
            u32::from(messages > 0),
            u32::from(content == "OneAttachment"),
            u32::from(content == "OneMetadata"),
            u32::from(has("ch") && messages > 0),
        ];
        let counts: Vec<u8> = counts.iter().flat_map(|count| count.to_le_bytes()).collect();
        let of_channel = if messages > 0 { [&[1, 0], &long(messages)[..]].concat() } else { Vec::new() };
        let length = (of_channel.len() as u32).to_le_bytes();
        let schemas = [u8::from(has_schema), 0];
        summary
            .insert(0x0B, record(0x0B, &[&long(messages), &schemas, &counts, &times, &length, &of_channel]));
    }
    bytes.extend(record(0x0F, &[&[0; 4]]));
    let mut begins = [0, 0];
    let mut offsets = Vec::new();
    for (opcode, records) in &summary {
        begins[0] = if begins[0] == 0 { bytes.len() } else { begins[0] };
        offsets.extend(record(0x0E, &[&[*opcode], &long(bytes.len()), &long(records.len())]));
        bytes.extend(records);
    }
    if has("sum") && !summary.is_empty() {
        begins[1] = bytes.len();
        bytes.extend(offsets);
    }
    bytes.extend(record(0x02, &[&long(begins[0]), &long(begins[1]), &[0; 4]]));
    bytes.extend(mcap::MAGIC);
    ([&[content], features].concat().join("-"), bytes)
}

fn long(value: usize) -> [u8; 8] {
    (value as u64).to_le_bytes()
}

fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
}

/// All contents with every combination of features, each file once.
fn all() -> BTreeMap<Vec<u8>, String> {
    let combinations = 0..1_usize << FEATURES.len();
    let of = |set: usize| -> Vec<&str> {
        let chosen = FEATURES.iter().enumerate().filter(|(n, _)| set >> n & 1 == 1);
        chosen.map(|(_, feature)| *feature).collect()
    };
    let files = CONTENTS.iter().flat_map(|content| combinations.clone().map(|set| file(content, &of(set))));
    files.map(|(name, bytes)| (bytes, name)).collect()
}

/// Commands beside those on any log: those that would write one where the file is.
const COMMANDS: [&str; 4] = [
    "note FILE author=nobody",
    "run ten-blocks --set initial.from=FILE --out NEW.mcap",
    "run ten-blocks --resume --out FILE",
    "run ten-blocks --resume --out UNFINISHED",
];

/// Has every command given such files, each of which must remain and be said to be no run log.
fn are_left_alone(files: &[(String, Vec<u8>)]) {
    let scratch = asperity_testkit::folder();
    let at = |name: &str| scratch.path().join(name);
    let paths: Vec<PathBuf> = files.iter().map(|(name, _)| at(&format!("{name}.mcap"))).collect();
    let begun = |path: &Path| path.with_extension("begun.mcap");
    for ((_, bytes), path) in files.iter().zip(&paths) {
        [path.clone(), partial_path(&begun(path))].iter().for_each(|path| fs::write(path, bytes).unwrap());
    }
    let entries = || fs::read_dir(scratch.path()).unwrap().count();
    let before = entries();
    let call = |command: &str, given: &[PathBuf]| {
        let files: Vec<&str> = given.iter().map(|path| text(path)).collect();
        let unfinished = command.replace("UNFINISHED", text(&begun(&given[0])));
        let words = words(&unfinished, &files, text(&at("new")));
        let output = asperity(&arguments(&words));
        let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
        let said = said.lines().filter(|line| !line.is_empty()).collect::<Vec<_>>();
        for path in given {
            let path = text(path).trim_end_matches(".mcap");
            let is_said = |line: &&&str| line.contains(path) && line.contains("not a run log");
            // A report and other single results end with the first one.
            let is_named =
                said.iter().any(|line| is_said(&line)) || (given.len() > 1 && command.contains("NEW"));
            assert!(
                output.status.code() == Some(2) && is_named,
                "{command:?} {path}: {}: {said:?}",
                output.status
            );
        }
        assert!(!said.iter().any(|line| line.contains("panicked")), "{said:?}");
    };
    for command in ON_LOGS.iter().map(|command| command.words).chain(COMMANDS) {
        let at_once = if command.contains("FILES") { paths.len() } else { 1 };
        paths.chunks(at_once).for_each(|given| call(command, given));
    }
    for ((_, bytes), path) in files.iter().zip(&paths) {
        for path in [path.clone(), partial_path(&begun(path))] {
            assert_eq!(fs::read(&path).unwrap(), *bytes, "{}", path.display());
        }
    }
    assert_eq!(entries(), before, "something was written");
}

/// One of each content, and beginnings of them.
#[test]
fn some_are_left_alone_by_all_commands() {
    let of = |n: usize| file(CONTENTS[n], &FEATURES[n..]);
    let cut = |length: usize| {
        let (name, bytes) = file("OneAttachment", &["ax", "st", "sum"]);
        (format!("{name}-{length}"), bytes[..length].to_vec())
    };
    are_left_alone(&[of(0), of(1), of(2), of(3), of(4), of(5), cut(150), cut(21)]);
}

#[test]
#[ignore = "a minute of starting commands: cargo xtask nightly"]
fn all_are_left_alone_by_all_commands() {
    are_left_alone(&all().into_iter().map(|(bytes, name)| (name, bytes)).collect::<Vec<_>>());
}

/// What every command asks for, of every file, whole and cut: the one verdict, and whether the file may be replaced.
#[test]
fn none_is_a_run_log_wherever_it_is_cut() {
    let scratch = asperity_testkit::folder();
    let path = scratch.path().join("a.mcap");
    let all = all();
    assert_eq!(all.len(), 416);
    for (n, (bytes, name)) in all.iter().enumerate() {
        // Shorter beginnings are also those of run logs.
        let cut = 10 + n % (bytes.len() - 10);
        for length in [cut, bytes.len()] {
            fs::write(&path, &bytes[..length]).unwrap();
            let checked = check(&path);
            assert_eq!(checked.verdict, Verdict::NoRunLog, "{name} cut to {length}: {checked}");
            let refused = must_be_ours(&path).expect_err("it is another program's").to_string();
            assert!(refused.contains("not a run log: it is an MCAP file of another program"), "{refused}");
        }
    }
    // Whatever is replaced begins as a log does.
    let log = scratch.path().join("log.mcap");
    crate::support::small::run(&log);
    let bytes = fs::read(&log).unwrap();
    for length in (0..100).chain([bytes.len()]) {
        fs::write(&path, &bytes[..length]).unwrap();
        must_be_ours(&path).unwrap();
    }
}
