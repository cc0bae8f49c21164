//! Falsified indexes and summaries of logs, with correct checksums: readers detect them, since
//! programs that read by index rely on nothing else.

use std::fs;
use std::path::Path;

use crate::laws::parts::Part;
use crate::support::{binary, small};
use asperity_runlog::{RunReader, Topics};
use mcap::records::op;

/// The records of a file outside chunks, up to its last bytes.
fn records(bytes: &[u8]) -> Vec<Part> {
    let mut parts = Vec::new();
    let mut at = 8;
    while at + 9 < bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes")) as usize;
        parts.push(Part::new(bytes[at], &bytes[at + 9..at + 9 + length]));
        at += 9 + length;
    }
    parts
}

/// A file of these records, with the checksums of the records `chunk`, of the data and of the
/// summary as they must be, and the places of the summary's parts.
fn file(parts: &[Part], data_crc: bool, summary_crc: bool) -> Vec<u8> {
    let mut out = mcap::MAGIC.to_vec();
    let mut start = 0;
    let mut groups: Vec<(u8, u64, u64)> = Vec::new();
    for part in parts {
        let mut part = part.clone();
        let at = out.len() as u64;
        match (part.opcode, part.name()) {
            (op::METADATA, Some("chunk")) => {
                let mut map = part.map().expect("it is metadata");
                map.insert("bytes".to_owned(), at.to_string());
                map.insert("bytes_crc".to_owned(), format!("{:08x}", crc32fast::hash(&out)));
                part = Part::metadata("chunk", &map);
            }
            (op::DATA_END, _) => {
                let crc = if data_crc { crc32fast::hash(&out) } else { 0 };
                part.body = crc.to_le_bytes().to_vec();
                start = out.len() + 9 + 4;
            }
            (op::FOOTER, _) => {
                let offsets = groups.iter().filter(|(kind, ..)| *kind == op::SUMMARY_OFFSET);
                let offsets_at = offsets.map(|(_, at, _)| *at).next().unwrap_or(0);
                part.body = [(start as u64).to_le_bytes(), offsets_at.to_le_bytes()].concat();
                let head = [&[op::FOOTER][..], &20u64.to_le_bytes()].concat();
                let crc = crc32fast::hash(&[&out[start..], &head, &part.body].concat());
                part.body.extend(if summary_crc { crc } else { 0 }.to_le_bytes());
            }
            _ => {}
        }
        part.put(&mut out);
        if start > 0 && part.opcode != op::DATA_END {
            match groups.last_mut() {
                Some((kind, _, length)) if *kind == part.opcode => *length += out.len() as u64 - at,
                _ => groups.push((part.opcode, at, out.len() as u64 - at)),
            }
        }
    }
    out.extend(mcap::MAGIC);
    out
}

/// Why a log is damaged; it must be.
fn damage(folder: &Path, what: &str, bytes: &[u8]) -> String {
    let path = folder.join("changed.mcap");
    fs::write(&path, bytes).expect("the folder can be written");
    let outcome = RunReader::open(&path, Topics::ALL).and_then(|mut reader| reader.verify());
    match outcome {
        Err(error) if !error.problem.is_early_end() => error.problem.to_string(),
        other => panic!("{what}: {other:?}"),
    }
}

/// Where the records of a kind are, behind the data or in it.
fn places(parts: &[Part], kind: u8, in_summary: bool) -> Vec<usize> {
    let end = parts.iter().position(|part| part.opcode == op::DATA_END).expect("it has an end");
    (0..parts.len()).filter(|&at| parts[at].opcode == kind && (at > end) == in_summary).collect()
}

#[test]
fn a_summary_names_all_that_the_log_holds_and_nothing_else() {
    let folder = asperity_testkit::folder();
    let path = folder.path().join("sound.mcap");
    small::run(&path);
    let bytes = fs::read(&path).expect("the log can be read");
    let sound = records(&bytes);
    assert_eq!(file(&sound, true, true), bytes, "taken apart and put together");

    for (kind, name) in [
        (op::SCHEMA, "schema"),
        (op::CHANNEL, "channel"),
        (op::STATISTICS, "statistics"),
        (op::CHUNK_INDEX, "chunk index"),
        (op::ATTACHMENT_INDEX, "attachment index"),
        (op::METADATA_INDEX, "metadata index"),
        (op::SUMMARY_OFFSET, "summary offset"),
    ] {
        let places = places(&sound, kind, true);
        for &at in &places {
            let mut parts = sound.clone();
            let gone = parts.remove(at);
            damage(folder.path(), &format!("{name} {at} gone"), &file(&parts, true, true));
            parts.insert(at, gone.clone());
            parts.insert(at, gone);
            damage(folder.path(), &format!("{name} {at} twice"), &file(&parts, true, true));
        }
        // Every byte of the first one, and the lowest bit of it.
        for byte in 0..sound[places[0]].body.len().min(120) {
            let mut parts = sound.clone();
            parts[places[0]].body[byte] ^= 1;
            damage(folder.path(), &format!("byte {byte} of the first {name}"), &file(&parts, true, true));
        }
    }
    let says = damage(folder.path(), "no checksum of the data", &file(&sound, false, true));
    assert!(says.contains("the checksum of the data is not that of the data"), "{says}");
    let says = damage(folder.path(), "no checksum of the summary", &file(&sound, true, false));
    assert!(says.contains("the footer says something else than the summary"), "{says}");
}

#[test]
fn message_indexes_and_chunks_say_what_is_in_them() {
    let folder = asperity_testkit::folder();
    let path = folder.path().join("sound.mcap");
    small::run(&path);
    let sound = records(&fs::read(&path).expect("the log can be read"));
    let changed = |what: &str, change: &dyn Fn(&mut Vec<Part>)| {
        let mut parts = sound.clone();
        change(&mut parts);
        damage(folder.path(), what, &file(&parts, true, true))
    };
    let index = places(&sound, op::MESSAGE_INDEX, false)[0];
    let end = sound[index].body.len();
    // Channel, length of the list, then time and place of each message.
    for byte in [0, 6, 14, end - 16, end - 8] {
        let says = changed("a message index", &|parts| parts[index].body[byte] ^= 1);
        assert!(says.contains("message index"), "byte {byte}: {says}");
    }
    let says = changed("a message index gone", &|parts| drop(parts.remove(index)));
    assert!(says.contains("lacks the message index of a channel"), "{says}");
    let says = changed("a message index twice", &|parts| parts.insert(index, parts[index].clone()));
    assert!(says.contains("a second message index of the same channel"), "{says}");
    let chunk = places(&sound, op::CHUNK, false)[0];
    for byte in [0, 8] {
        let says = changed("the times of a chunk", &|parts| parts[chunk].body[byte] ^= 1);
        assert!(says.contains("other times than its messages"), "{says}");
    }
    let scenario = places(&sound, op::ATTACHMENT, false)[0];
    let says = changed("an attachment without checksum", &|parts| {
        let crc = parts[scenario].body.len() - 4;
        parts[scenario].body[crc..].fill(0);
    });
    assert!(says.contains("an attachment without its checksum"), "{says}");
    let behind =
        places(&sound, op::METADATA, false).into_iter().find(|&at| at > chunk).expect("it follows") + 1;
    for (what, part) in [
        ("a message outside chunks", Part::message(1, 0, 0, b"{}")),
        ("a record of another program", Part::new(0x80, *b"anything")),
        ("metadata of another name", Part::metadata("more", &[].into())),
        ("an attachment of another name", Part::attachment("more", b"")),
    ] {
        let says = changed(what, &|parts| parts.insert(behind, part.clone()));
        assert!(says.contains("no run log"), "{what}: {says}");
    }
}

/// A run resumes only from a checkpoint that a record `chunk` confirms.
#[test]
fn a_checkpoint_counts_once_it_is_vouched_for() {
    let folder = asperity_testkit::folder();
    let path = folder.path().join("often.mcap");
    let often = ["--set", "time.duration_s=0.05", "--checkpoint-s", "0"];
    binary::run(&[&small::SCENARIO[..3], &often].concat(), &path);
    let parts = records(&fs::read(&path).expect("the log can be read"));
    let is_checkpoint = |part: &Part| part.opcode == op::ATTACHMENT && part.name() == Some("checkpoint");
    let mut places = (0..parts.len()).rev().filter(|&at| is_checkpoint(&parts[at]));
    let [last, before] = std::array::from_fn(|_| places.next().expect("there are some"));
    let state = |at: usize| parts[at].attached().map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let found_in_first = |count: usize| {
        let mut bytes = mcap::MAGIC.to_vec();
        parts[..count].iter().for_each(|part| part.put(&mut bytes));
        fs::write(&path, bytes).expect("the folder can be written");
        let mut reader = RunReader::open(&path, Topics::NONE).expect("it has a header");
        while let Ok(Some(_)) = reader.next_item() {}
        reader.checkpoint().map(str::to_owned)
    };
    assert_ne!(state(last), state(before));
    assert!(found_in_first(last + 1) == state(before), "its record `chunk` is still missing");
    assert!(found_in_first(last + 2) == state(last), "it is vouched for");
}

#[test]
fn records_chunk_are_all_there_in_their_order_and_of_this_run() {
    let folder = asperity_testkit::folder();
    let path = folder.path().join("sound.mcap");
    small::run(&path);
    let sound = records(&fs::read(&path).expect("the log can be read"));
    let links: Vec<usize> = (0..sound.len())
        .filter(|&at| sound[at].opcode == op::METADATA && sound[at].name() == Some("chunk"))
        .collect();
    assert!(links.len() >= 3);
    for &at in &links {
        let changed = |change: &dyn Fn(&mut Vec<Part>)| {
            let mut parts = sound.clone();
            change(&mut parts);
            damage(folder.path(), &format!("record {at}"), &file(&parts, true, true))
        };
        changed(&|parts| drop(parts.remove(at)));
        let says = changed(&|parts| parts.insert(at, parts[at].clone()));
        assert!(says.contains("does not follow what it vouches for"), "{says}");
        for (key, told) in [
            ("run_id", "of another run"),
            ("number", "out of order"),
            ("crc", "does not follow"),
            ("before_crc", "out of order"),
        ] {
            let says = changed(&|parts| {
                let mut map = parts[at].map().expect("it is metadata");
                let value = map.get_mut(key).expect("it has the key");
                let last = value.pop().expect("it says something");
                value.push(if last == '1' { '2' } else { '1' });
                parts[at] = Part::metadata("chunk", &map);
            });
            assert!(says.contains(told), "{key}: {says}");
        }
    }
    // A log cannot take itself out of it by an older version's number.
    let run = sound.iter().position(|part| part.name() == Some("run")).expect("it has a header");
    let mut parts = sound.clone();
    let mut map = parts[run].map().expect("it is metadata");
    map.insert("record_schema_version".to_owned(), "2".to_owned());
    parts[run] = Part::metadata("run", &map);
    let says = damage(folder.path(), "version 2", &file(&parts, true, true));
    assert!(says.contains("metadata `chunk` in a log of a version that has none"), "{says}");
}
