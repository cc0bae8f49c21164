//! MCAP files of other programs: no command takes one for a run log, or destroys it.
//!
//! They are of the kinds of MCAP's conformance suite, written by its library: contents, and any combination of
//! the suite's features. An MCAP file without messages passed for an unfinished run once, and was overwritten.

use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use asperity_run::{Verdict, check};
use asperity_runlog::{must_be_ours, partial_path};
use mcap::Attachment;
use mcap::records::{MessageHeader, Metadata};

use crate::laws::file::records;
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
    let options = mcap::WriteOptions::new()
        .profile("")
        .library("")
        .compression(None)
        .use_chunks(has("ch"))
        .emit_message_indexes(has("mx"))
        .repeat_channels(has("rch"))
        .repeat_schemas(has("rsh"))
        .emit_attachment_indexes(has("ax"))
        .emit_metadata_indexes(has("mdx"))
        .emit_statistics(has("st"))
        .emit_chunk_indexes(has("chx"))
        .emit_summary_offsets(has("sum"));
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let messages = match content {
        "OneMessage" | "OneSchemalessMessage" => 1,
        "TenMessages" => 10,
        _ => 0,
    };
    if messages > 0 {
        let is_plain = content == "OneSchemalessMessage";
        let schema = if is_plain { 0 } else { writer.add_schema("Example", "c", &[4, 5, 6]).unwrap() };
        let channel_id = writer.add_channel(schema, "example", "a", &BTreeMap::new()).unwrap();
        for sequence in 0..messages {
            let [log_time, publish_time] = [u64::from(sequence); 2];
            let header = MessageHeader { channel_id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, &[1, 2, 3]).unwrap();
        }
    }
    match content {
        "OneAttachment" => {
            let [name, media_type] = ["myFile", "application/octet-stream"].map(str::to_owned);
            let data = [1, 2, 3][..].into();
            let attachment = Attachment { log_time: 2, create_time: 1, name, media_type, data };
            writer.attach(&attachment).unwrap();
        }
        "OneMetadata" => {
            let metadata = [("foo".to_owned(), "bar".to_owned())].into();
            writer.write_metadata(&Metadata { name: "myMetadata".to_owned(), metadata }).unwrap();
        }
        _ => {}
    }
    writer.finish().unwrap();
    let mut bytes = writer.into_inner().into_inner();
    if has("pad") {
        let records = records(&bytes);
        let mut padded = mcap::MAGIC.to_vec();
        for mut part in records.iter().map(|record| record.part(&bytes)) {
            part.body.extend(if UNPADDED.contains(&part.opcode) { &[][..] } else { &[1, 255, 255] });
            part.put(&mut padded);
        }
        padded.extend(mcap::MAGIC);
        bytes = padded;
    }
    ([&[content], features].concat().join("-"), bytes)
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
    assert_eq!(all.len(), 440);
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
