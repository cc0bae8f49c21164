//! Forged logs, derived from a genuine one: each with its error and the required report of
//! `asperity check`.

mod messages;
mod own;

use asperity_record::BulkRecord;
use mcap::records::op;

use crate::laws::file;
use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end};
use crate::laws::thin::messages;

/// The verdict of `check`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Nothing in it is changed that is read.
    Whole,
    /// Nothing that is read was changed; another code version made the log.
    OtherCode,
    /// It ends too early, and is sound up to there.
    Incomplete,
    /// Something in it is not as it must be.
    Damaged,
    /// It is something else.
    NoRunLog,
}

impl Verdict {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Verdict::Whole => "whole",
            Verdict::OtherCode => "by other code or detectors",
            Verdict::Incomplete => "incomplete",
            Verdict::Damaged => "damaged",
            Verdict::NoRunLog => "not a run log",
        }
    }
}

/// One of them.
pub(crate) struct Forgery {
    /// Its file's name, without extension.
    pub(crate) name: &'static str,
    /// The error in it.
    pub(crate) what: &'static str,
    /// The required verdict.
    pub(crate) verdict: Verdict,
    /// The required message; one of several, if the order of checks matters.
    pub(crate) says: &'static str,
    /// Whether its end agrees with its messages, so that only their contents reveal the forgery.
    pub(crate) consistent: bool,
    pub(crate) bytes: Vec<u8>,
}

impl Forgery {
    /// Adapts the expectation to a log by another code version.
    pub(crate) fn of_another_program(mut self) -> Forgery {
        if self.verdict == Verdict::Whole {
            self.verdict = Verdict::OtherCode;
        }
        self
    }
}

/// The message of a binary record after a change.
pub(crate) fn changed<R: BulkRecord>(message: &[u8], change: impl FnOnce(&mut R)) -> Vec<u8> {
    let mut record = R::of_message(message).expect("it is a message of the record");
    change(&mut record);
    record.to_message()
}

/// A sound log, and the forgeries derived from it.
pub(crate) struct Forge {
    sound: Vec<Part>,
    made: Vec<Forgery>,
}

use Verdict::{Damaged, Incomplete, NoRunLog, Whole};

impl Forge {
    /// All forgeries of a sound log, taken apart. It must have messages on `/step`, `/switch`,
    /// `/fields` and `/events/slip`.
    pub(crate) fn all(sound: &[Part]) -> Vec<Forgery> {
        let mut forge = Forge { sound: sound.to_vec(), made: Vec::new() };
        forge.harmless();
        forge.cut();
        forge.lengths();
        forge.layout();
        forge.header();
        forge.end();
        forge.messages();
        forge.order();
        forge.events();
        forge.made
    }

    /// A file as it is.
    fn file(
        &mut self,
        name: &'static str,
        what: &'static str,
        verdict: Verdict,
        says: &'static str,
        bytes: Vec<u8>,
    ) {
        self.made.push(Forgery { name, what, verdict, says, consistent: false, bytes });
    }

    /// A file of changed records; `run_end` is made to agree with the messages.
    fn parts(
        &mut self,
        name: &'static str,
        what: &'static str,
        says: &'static str,
        change: impl FnOnce(&mut Vec<Part>),
    ) {
        let mut parts = self.sound.clone();
        change(&mut parts);
        correct_end(&mut parts);
        let bytes = put_together(&parts, Packing::USUAL);
        self.made.push(Forgery { name, what, verdict: Damaged, says, consistent: true, bytes });
    }

    /// A file of changed records; `run_end` stays as it was.
    fn parts_only(
        &mut self,
        name: &'static str,
        what: &'static str,
        verdict: Verdict,
        says: &'static str,
        change: impl FnOnce(&mut Vec<Part>),
    ) {
        let mut parts = self.sound.clone();
        change(&mut parts);
        self.file(name, what, verdict, says, put_together(&parts, Packing::USUAL));
    }

    /// A file with changed metadata.
    fn says(
        &mut self,
        name: &'static str,
        record: &str,
        key: &str,
        value: Option<&str>,
        what: &'static str,
        says: &'static str,
    ) {
        self.parts_only(name, what, Damaged, says, |parts| {
            let at = named(parts, record);
            let mut map = parts[at].map().expect("it is metadata");
            match value {
                Some(value) => map.insert(key.to_owned(), value.to_owned()),
                None => map.remove(key),
            };
            parts[at] = Part::metadata(record, &map);
        });
    }

    /// A file with one changed message: the first on that topic with the text to be replaced.
    fn message(
        &mut self,
        name: &'static str,
        topic: &str,
        old: &str,
        new: &str,
        what: &'static str,
        says: &'static str,
    ) {
        self.parts(name, what, says, |parts| {
            let at = messages(parts, topic)
                .into_iter()
                .find(|&at| payload(&parts[at]).contains(old))
                .unwrap_or_else(|| panic!("{name}: no message of {topic} has {old}"));
            let text = payload(&parts[at]).replacen(old, new, 1);
            parts[at] = parts[at].with_payload(text.as_bytes());
        });
    }

    /// A file with another first message on a topic.
    fn payload(&mut self, name: &'static str, what: &'static str, says: &'static str, payload: &[u8]) {
        self.parts(name, what, says, |parts| {
            let at = messages(parts, "/step")[0];
            parts[at] = parts[at].with_payload(payload);
        });
    }

    fn harmless(&mut self) {
        self.parts_only(
            "harmless-repacked",
            "the same records in other chunks, without compression",
            Whole,
            "up to step",
            |_| {},
        );
        self.parts_only(
            "harmless-unknown-kind",
            "a record of a kind that MCAP leaves to programs of their own",
            Whole,
            "up to step",
            |parts| parts.insert(1, Part::new(0x80, *b"anything")),
        );
        self.parts_only(
            "harmless-order",
            "metadata and scenario behind the messages, as other programs write them",
            Whole,
            "up to step",
            |parts| {
                let behind: Vec<Part> = parts
                    .extract_if(1.., |part| part.name().is_some() && part.opcode != op::CHANNEL)
                    .collect();
                parts.extend(behind.into_iter().rev());
            },
        );
        self.parts_only("harmless-empty-chunk", "a chunk without records", Whole, "up to step", |parts| {
            let at = named(parts, "run_end");
            parts.insert(at, Part::chunk(&[]));
        });
    }

    fn cut(&mut self) {
        let whole = put_together(&self.sound, Packing::USUAL);
        let chunked = put_together(&self.sound, Packing { per_chunk: 20, ..Packing::USUAL });
        let end = b"\x07\0\0\0run_end";
        let run_end = whole.windows(end.len()).position(|bytes| bytes == end).expect("it has an end") - 9;
        self.file("cut-empty", "no bytes at all", Incomplete, "the file is empty", Vec::new());
        let cut = |bytes: &[u8], length: usize| bytes[..length].to_vec();
        self.file("cut-in-magic", "four bytes", Incomplete, "ended in the middle", cut(&whole, 4));
        self.file("cut-behind-magic", "eight bytes", Incomplete, "ended in the middle", cut(&whole, 8));
        self.file("cut-in-chunk", "its first half", Incomplete, "middle", cut(&chunked, chunked.len() / 2));
        self.file(
            "cut-before-run-end",
            "all of its messages and no more",
            Incomplete,
            "ended in the middle of a record",
            cut(&whole, run_end),
        );
        self.parts_only(
            "cut-and-closed",
            "cut off before `run_end`, and an end of an MCAP file put behind",
            Incomplete,
            "no metadata `run_end`",
            |parts| {
                parts.pop();
            },
        );
        self.file(
            "cut-end-magic",
            "without its last byte",
            Incomplete,
            "middle",
            cut(&whole, whole.len() - 1),
        );
        self.file(
            "two-files",
            "a log behind a log",
            Damaged,
            "after the end of the MCAP file",
            whole.repeat(2),
        );
        let text = b"step,time_s\n1,0.5\n".to_vec();
        let says = "this is a text";
        self.file("no-mcap", "another kind of file", NoRunLog, says, text);
        let mut header = Vec::new();
        for text in ["", "another program"] {
            header.extend((text.len() as u32).to_le_bytes());
            header.extend(text.as_bytes());
        }
        let header = Part::new(op::HEADER, header);
        let says = "it is an MCAP file of another program (\"another program\")";
        let message = self.sound[messages(&self.sound, "/step")[0]].clone();
        let parts =
            [header, Part::channel(message.channel_id().expect("it is a message"), 0, "/step"), message];
        let bytes = put_together(&parts, Packing::USUAL);
        self.file("mcap-of-another-program", "a log of another program", NoRunLog, says, bytes);
        let mut zeros = whole.clone();
        zeros[run_end - 400..run_end - 200].fill(0);
        self.file(
            "zeros",
            "a piece of it overwritten with zeros",
            Damaged,
            "CRC failed|the record at byte",
            zeros,
        );
        let mut bytes = whole;
        let place = bytes.len() / 2;
        bytes[place] ^= 0x10;
        self.file("flipped-bit", "one bit of a message flipped", Damaged, "CRC failed", bytes);
    }

    fn lengths(&mut self) {
        let head = |opcode: u8, length: u64| [&[opcode][..], &length.to_le_bytes()].concat();
        let whole = put_together(&self.sound, Packing::USUAL);
        for (name, length, says) in [
            ("length-of-record-2-63", 1 << 63, "exceeds limit"),
            ("length-of-record-over-the-end", 1 << 20, "claims to be longer than the rest of the file"),
        ] {
            let bytes = [&whole[..8], &head(op::HEADER, length), &whole[17..]].concat();
            self.file(name, "its first record claims to be longer than it is", Damaged, says, bytes);
        }
        let small = |parts: &mut Vec<Part>, part: Part| parts.insert(3, part);
        self.parts_only(
            "chunk-claims-2-63",
            "a chunk that claims to unpack to 2^63 bytes",
            Damaged,
            "length exceeds limit",
            |parts| small(parts, Part::chunk_of(1 << 63, 1, "zstd", 4, b"abcd")),
        );
        let bomb = zstd::bulk::compress(&vec![0; 30_000_000], 19).expect("zeros compress");
        self.parts_only(
            "chunk-unpacks-to-more",
            "a chunk that claims 1000 bytes and unpacks to 30 million",
            Damaged,
            "Error during decompression",
            |parts| small(parts, Part::chunk_of(1000, 1, "zstd", bomb.len() as u64, &bomb)),
        );
        let bomb = zstd::bulk::compress(&vec![0; 100_000_000], 19).expect("zeros compress");
        self.parts_only(
            "chunk-of-100-million-zeros",
            "a chunk that unpacks to as much as it claims, which is more than any ever had",
            Damaged,
            "length exceeds limit",
            |parts| small(parts, Part::chunk_of(100_000_000, 1, "zstd", bomb.len() as u64, &bomb)),
        );
        let bomb = zstd::bulk::compress(&vec![0; 54_000_000], 19).expect("zeros compress");
        let crc = crc32fast::hash(&vec![0; 54_000_000]);
        self.parts_only(
            "chunk-of-54-million-zeros",
            "a chunk of six million records of no kind and no length",
            Damaged,
            "something other than schemas",
            |parts| {
                let chunk = Part::chunk_of(54_000_000, crc, "zstd", bomb.len() as u64, &bomb);
                small(parts, chunk);
                parts.insert(4, parts[0].clone());
            },
        );
        self.parts_only(
            "chunk-of-another-compression",
            "a chunk of a compression that does not exist",
            Damaged,
            "Unsupported compression format `shrunk`",
            |parts| small(parts, Part::chunk_of(4, 1, "shrunk", 4, b"abcd")),
        );
        let over = head(op::MESSAGE, 1000);
        self.parts_only(
            "chunk-record-over-its-end",
            "a message that claims to be longer than its chunk, which is not compressed",
            Damaged,
            "Chunk ended in the middle of a record",
            |parts| small(parts, Part::chunk_of(9, crc32fast::hash(&over), "", 9, &over)),
        );
        self.parts_only(
            "chunk-in-chunk",
            "a chunk in a chunk",
            Damaged,
            "a chunk holds something",
            |parts| {
                small(parts, Part::chunk(&[Part::chunk(&[])]));
            },
        );
        self.parts_only(
            "text-of-4-gb",
            "metadata whose name claims to be 2^32 - 1 bytes long",
            Damaged,
            "holds a length that reaches over its end",
            |parts| small(parts, Part::new(op::METADATA, [0xff; 12])),
        );
        let mut huge = Part::attachment("a", b"").body;
        huge[25..33].copy_from_slice(&(1u64 << 62).to_le_bytes());
        self.parts_only(
            "attachment-of-2-62",
            "an attachment that claims 2^62 bytes of data",
            Damaged,
            "holds a length that reaches over its end",
            |parts| small(parts, Part::new(op::ATTACHMENT, huge)),
        );
    }

    fn layout(&mut self) {
        self.parts_only(
            "two-logs-in-one",
            "the records of a log behind those of a log",
            Damaged,
            "messages of /events/arrival: |follows step",
            |parts| {
                let again = parts.clone();
                parts.extend(again);
            },
        );
        self.parts_only("no-run", "no metadata `run`", Damaged, "no metadata `run`", |parts| {
            parts.remove(named(parts, "run"));
        });
        self.parts_only(
            "no-scenario",
            "no scenario, which would be taken for the default one",
            Damaged,
            "no attachment `scenario.toml`",
            |parts| {
                parts.remove(named(parts, "scenario.toml"));
            },
        );
        self.parts_only(
            "scenario-not-text",
            "a scenario that is no UTF-8",
            Damaged,
            "attachment `scenario.toml` is not UTF-8",
            |parts| {
                let at = named(parts, "scenario.toml");
                parts[at] = Part::attachment("scenario.toml", b"name = \"\xff\"");
            },
        );
        self.parts(
            "channel-reused",
            "a channel that becomes that of another topic",
            "and of /fields",
            |parts| {
                let steps = messages(parts, "/step");
                let id = parts[steps[0]].channel_id().expect("it is a message");
                parts.insert(steps[3], Part::channel(id, 1, "/fields"));
            },
        );
        self.parts("topic-twice", "a topic on two channels", "/step has two channels", |parts| {
            let steps = messages(parts, "/step");
            parts.insert(steps[3], Part::channel(77, 1, "/step"));
        });
        self.parts(
            "channel-unknown",
            "a message on a channel that nothing announced",
            "a message of channel 77, which nothing announced",
            |parts| {
                let at = messages(parts, "/step")[3];
                parts[at].body[..2].copy_from_slice(&77u16.to_le_bytes());
            },
        );
        let whole = put_together(&self.sound, Packing::USUAL);
        let data_end = file::records(&whole).into_iter().find(|record| record.opcode == op::DATA_END);
        let (records, rest) = whole.split_at(data_end.expect("it has one").at.start);
        let with = |between: &[Part], behind: &[Part]| {
            let mut file = records.to_vec();
            file.extend(&rest[..13]);
            between.iter().for_each(|part| part.put(&mut file));
            let magic = rest.len() - mcap::MAGIC.len();
            file.extend(&rest[13..magic]);
            behind.iter().for_each(|part| part.put(&mut file));
            file.extend(&rest[magic..]);
            file
        };
        let step = self.sound[messages(&self.sound, "/step")[0]].clone();
        let behind_data = with(std::slice::from_ref(&step), &[]);
        let behind_footer = with(&[], &[step]);
        let no_data_end = [records, &rest[13..]].concat();
        self.file(
            "message-behind-data",
            "a message after the end of the data",
            Damaged,
            "messages of /step: |follows step",
            behind_data,
        );
        self.file(
            "message-behind-footer",
            "a message behind the footer",
            Damaged,
            "Bad magic",
            behind_footer,
        );
        self.file(
            "no-data-end",
            "no end of the data, so that its checksum is not looked at",
            Damaged,
            "a footer before the end of the data",
            no_data_end,
        );
    }

    fn header(&mut self) {
        let whole = "metadata `run` has";
        self.says("run-without-blocks", "run", "blocks", None, "no number of blocks", "lacks the key blocks");
        for (name, key, value) in [
            ("run-blocks-4294967295", "blocks", "4294967295"),
            ("run-blocks-0", "blocks", "0"),
            ("run-step-0", "time_step_s", "0"),
            ("run-step-nan", "time_step_s", "NaN"),
            ("run-steps-2-64", "steps", "18446744073709551616"),
            ("run-version-text", "record_schema_version", "two"),
        ] {
            self.says(name, "run", key, Some(value), "a header that no run has", whole);
        }
        let times = "stands at|metadata `run` says|which the other keys give";
        let other = "a time step that is not that of the messages";
        let from = self.made.len();
        self.says("run-step-1e-320", "run", "time_step_s", Some("1e-320"), other, times);
        let ends = "says the last step|metadata `run` says";
        let steps = "more steps than it took";
        self.says("run-steps-most", "run", "steps", Some("18446744073709551615"), steps, ends);
        let fewer = "fewer blocks than it has states of";
        let says = "values, not 3|metadata `run` says 3";
        self.says("run-blocks-fewer", "run", "blocks", Some("3"), fewer, says);
        self.made[from..].iter_mut().for_each(|forgery| forgery.consistent = true);
    }

    fn end(&mut self) {
        let mut end = |name, key, value, what, says| self.says(name, "run_end", key, value, what, says);
        let what = "an end that is not that of the messages";
        end("end-status", "status", Some("splendid"), what, "has status = \"splendid\"");
        end("end-switches", "switches", Some("7"), what, "says switches: 7");
        end("end-digest", "digest", Some("00"), what, "right by itself: 00|says digest: 00");
        end("end-last-step", "last_step", Some("7"), what, "says the last step: 7");
        end("end-count", "messages:/step", Some("7"), what, "says messages of /step: 7");
        end("end-count-text", "messages:/step", Some("x"), what, "which is not a whole number");
        let missing = "an end that is silent on a topic";
        end("end-without-count", "messages:/fields", None, missing, "says messages of /fields: 0");
        let more = "an end that counts a topic which is not there";
        end("end-with-count", "messages:/more", Some("1"), more, "says messages of /more: 1");
        end("end-without-digest", "digest", None, "no digest", "lacks the key digest");
        let other = "a digest of a topic that is not that of its messages";
        end("end-topic-digest", "digest:/step", Some("00"), other, "says digest of /step: 00, the file has");
        let missing = "digests of all topics but one";
        end("end-without-topic-digest", "digest:/fields", None, missing, "says digest of /fields: nothing");
        let more = "a digest of a topic which is not there";
        end(
            "end-with-topic-digest",
            "digest:/more",
            Some("00"),
            more,
            "says digest of /more: 00, the file has",
        );
    }
}

/// Where a record of that name is.
fn named(parts: &[Part], name: &str) -> usize {
    parts.iter().position(|part| part.name() == Some(name)).unwrap_or_else(|| panic!("no record {name}"))
}

fn payload(part: &Part) -> &str {
    part.payload().and_then(|bytes| std::str::from_utf8(bytes).ok()).expect("messages are text")
}
