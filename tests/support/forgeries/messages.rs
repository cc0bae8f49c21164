//! Forged messages: their contents, their order, and the events among them.

use asperity_record::{BulkRecord, FieldRecord, WindowRecord};
use mcap::records::op;

use super::Verdict::{Damaged, Whole};
use super::{Forge, changed, named, payload};
use crate::laws::parts::Part;
use crate::laws::thin::{messages, renumber};

impl Forge {
    pub(super) fn messages(&mut self) {
        let read = "message 0 of /step cannot be read";
        self.payload("message-empty", "a message of no bytes", read, b"");
        self.payload("message-not-json", "a message that is no JSON", read, b"step 1 at 0.5 s");
        self.payload("message-null", "a message that is null", read, b"null");
        self.payload("message-list", "a message that is a list", read, b"[1,2,3]");
        self.payload("message-not-text", "a message that is no UTF-8", read, b"{\"step\":\xff}");
        let deep = [vec![b'['; 1000], vec![b']'; 1000]].concat();
        self.payload("message-nested", "a message nested 1000 deep", read, &deep);
        let what = "a step that is not as its schema says";
        for (name, old, new) in [
            ("message-missing-field", "\"sliding\":0,", ""),
            ("message-extra-field", "\"sliding\":0,", "\"sliding\":0,\"more\":1,"),
            ("message-field-twice", "\"sliding\":0,", "\"sliding\":0,\"sliding\":0,"),
            ("message-wrong-type", "\"sliding\":0", "\"sliding\":\"0\""),
            ("message-negative-count", "\"sliding\":0", "\"sliding\":-1"),
            ("message-too-large", "\"sliding\":0", "\"sliding\":4294967296"),
            ("message-nan", "\"driving_force_n\":", "\"driving_force_n\":NaN,\"x\":"),
            ("message-infinity", "\"driving_force_n\":", "\"driving_force_n\":Infinity,\"x\":"),
            ("message-1e999", "\"driving_force_n\":", "\"driving_force_n\":1e999,\"x\":"),
            ("message-null-number", "\"driving_force_n\":", "\"driving_force_n\":null,\"x\":"),
        ] {
            self.message(name, "/step", old, new, what, "of /step cannot be read");
        }
        self.message(
            "ratio",
            "/step",
            "\"ft_fn\":",
            "\"ft_fn\":1",
            "a ratio not of its loads",
            "but its loads give",
        );
        let ends = "a force on one end alone";
        let end = "\"first_end_force_n\":1.0,\"ft_fn\":";
        self.message("one-end", "/step", "\"ft_fn\":", end, ends, "a force on one end and none on the other");
        let short = "states of fewer blocks than there are";
        self.parts("fields-short", short, "displacement_m has 1 values", |parts| {
            change_state(parts, |state| state.displacement_m = vec![0.0]);
        });
        let detached = "states that say of a stuck block that it slides";
        self.parts("fields-detached", detached, "but its switches leave it stuck", |parts| {
            change_state(parts, |state| state.detached[0] = 1);
        });
        let infinite = "states with a number that is not finite";
        let says = "message 0 of /fields cannot be read: velocity_m_per_s has a number that is not finite";
        self.parts("fields-not-finite", infinite, says, |parts| {
            change_state(parts, |state| state.velocity_m_per_s[1] = f64::NEG_INFINITY);
        });
        let extra = "states with a field that is not in their schema";
        self.parts(
            "fields-extra-field",
            extra,
            "of /fields cannot be read: its known fields have",
            |parts| {
                let at = messages(parts, "/fields")[0];
                parts[at].body.extend(b"\xf8\x01\x00");
            },
        );
        let window = |first_block: u32| {
            let [displacement_m, velocity_m_per_s, tangential_force_n] = [[0.0; 2]; 3].map(Vec::from);
            let record =
                WindowRecord { first_block, displacement_m, velocity_m_per_s, ..WindowRecord::default() };
            WindowRecord { tangential_force_n, ..record }.to_message()
        };
        for (name, first) in [("window-from-block-0", 0), ("window-beyond-the-chain", 100_000)] {
            let what = "states of blocks that the chain does not have";
            self.parts(name, what, "a window of 2 blocks from block", |parts| {
                let channel =
                    parts.iter().find(|part| part.opcode == op::CHANNEL && part.name() == Some("/window"));
                let id = channel.and_then(Part::channel_id).expect("windows have a channel");
                let at = messages(parts, "/step")[0];
                parts.insert(at, Part::message(id, 0, 0, &window(first)));
            });
        }
        self.parts(
            "file-time",
            "a message that stands at another time in the file",
            "stands at 7 ns",
            |parts| {
                let at = messages(parts, "/step")[2];
                parts[at].body[6..14].copy_from_slice(&7u64.to_le_bytes());
            },
        );
        self.parts_only("harmless-number", "a message out of its number", Whole, "up to step", |parts| {
            let at = messages(parts, "/step")[2];
            parts[at].body[2..6].copy_from_slice(&9u32.to_le_bytes());
        });
    }

    pub(super) fn order(&mut self) {
        self.parts("chunk-twice", "the same messages twice, and counts and digest agree", "step", |parts| {
            let (from, to) = (messages(parts, "/step")[0], messages(parts, "/step")[3]);
            let again = parts[from..to].to_vec();
            parts.splice(to..to, again);
            renumber(parts);
        });
        self.parts(
            "chunks-swapped",
            "messages in another order, and counts and digest agree",
            "step",
            |parts| {
                let steps = messages(parts, "/step");
                let (first, second, third) = (steps[0], steps[2], steps[4]);
                let moved: Vec<Part> = parts.drain(first..second).collect();
                let at = third - (second - first);
                parts.splice(at..at, moved);
                renumber(parts);
            },
        );
        let what = "a switch that no block can make";
        self.parts("switch-block-0", what, "block 0 cannot", |parts| {
            change(parts, "/switch", |message| message["block"] = 0.into());
        });
        self.parts("switch-block-beyond", what, "block 4294967295 cannot", |parts| {
            change(parts, "/switch", |message| message["block"] = u32::MAX.into());
        });
        self.parts("switch-attach-stuck", what, "cannot Attach", |parts| {
            change(parts, "/switch", |message| message["direction"] = "attach".into());
        });
        self.parts(
            "switch-of-another-step",
            "a switch of another step",
            "step 1: the message of /switch stands at ",
            |parts| {
                change(parts, "/switch", |message| message["step"] = 1.into());
            },
        );
        self.parts(
            "switch-without-step",
            "a switch behind no step",
            "promises 0 switches and has 1",
            |parts| {
                let from = messages(parts, "/switch")[0];
                let switch = parts[from].clone();
                let at = messages(parts, "/step")[1];
                parts.insert(at, switch);
            },
        );
        self.parts(
            "switches-promised",
            "a step that promises 2^32 - 1 switches",
            "promises 4294967295",
            |parts| {
                change(parts, "/step", |message| message["switches"] = u32::MAX.into());
            },
        );
        self.parts("sliding", "a step in which other blocks slide than switched", "say", |parts| {
            change(parts, "/step", |message| message["sliding"] = 1.into());
        });
    }

    /// Events are only compared with the steps where the same program found them.
    pub(super) fn events(&mut self) {
        let payload = |parts: &Vec<Part>| payload(&parts[messages(parts, "/events/slip")[0]]).to_owned();
        self.parts("event-not-json", "an event that is no JSON", "event", |parts| {
            let at = messages(parts, "/events/slip")[0];
            parts[at] = parts[at].with_payload(b"a slip");
        });
        self.parts("event-not-text", "an event that is no UTF-8", "cannot be read", |parts| {
            let at = messages(parts, "/events/slip")[0];
            parts[at] = parts[at].with_payload(b"\xff\xff");
        });
        self.parts("event-other", "an event that is not that of its steps", "other events", |parts| {
            let at = messages(parts, "/events/slip")[0];
            let text = payload(parts).replacen("\"ft_fn_onset\":", "\"ft_fn_onset\":1", 1);
            parts[at] = parts[at].with_payload(text.as_bytes());
        });
        self.parts(
            "event-lost",
            "an event is missing, and counts and digest agree",
            "other events",
            |parts| {
                let at = messages(parts, "/events/slip")[0];
                parts.remove(at);
                renumber(parts);
            },
        );
        self.parts_only("scenario-other", "the scenario of another run", Damaged, "scenario.toml", |parts| {
            let at = named(parts, "scenario.toml");
            parts[at] = Part::attachment("scenario.toml", b"slider.blocks = 7\n");
        });
    }
}

/// Changes the first message of a topic.
fn change(parts: &mut [Part], topic: &str, change: impl FnOnce(&mut serde_json::Value)) {
    let at = messages(parts, topic)[0];
    let mut message: serde_json::Value =
        serde_json::from_str(payload(&parts[at])).expect("messages are JSON");
    change(&mut message);
    parts[at] = parts[at].with_payload(message.to_string().as_bytes());
}

/// Changes the first state.
fn change_state(parts: &mut [Part], change: impl FnOnce(&mut FieldRecord)) {
    let at = messages(parts, "/fields")[0];
    parts[at] = parts[at].with_payload(&changed(parts[at].payload().expect("it is a message"), change));
}
