//! Forged logs of this code version: those that contradict their own scenario, and those that only
//! a repetition of the run detects.

use std::collections::BTreeMap;

use asperity_record::FieldRecord;
use mcap::records::op;
use serde_json::{Value, json};

use super::{Forge, Forgery, changed, named, payload};
use crate::laws::parts::Part;
use crate::laws::thin::{messages, renumber};

impl Forge {
    /// Those of a log of this program that its header, its topics or its end give away.
    pub(crate) fn of_own(sound: &[Part]) -> Vec<Forgery> {
        let mut forge = Forge { sound: sound.to_vec(), made: Vec::new() };
        forge.own_numbers();
        forge.own_scenario();
        forge.own_ruptures();
        forge.own_links();
        forge.made
    }

    /// Those that agree with themselves and with the header; `other` is a log of another scenario with
    /// as many blocks.
    pub(crate) fn of_records(sound: &[Part], other: &[Part]) -> Vec<Forgery> {
        let mut forge = Forge { sound: sound.to_vec(), made: Vec::new() };
        forge.other_records(other);
        forge.other_numbers();
        forge.other_end();
        forge.made
    }

    fn other_records(&mut self, other: &[Part]) {
        let says = "the run, made again, gives another record";
        self.parts("again-state-lost", "a state of all blocks is missing", says, |parts| {
            remove(parts, "/fields", |number| number == 3);
        });
        let more = "the run, made again, gives an additional record";
        self.parts("again-last-state-lost", "the last state is missing", more, |parts| {
            let last = messages(parts, "/fields").len() - 1;
            remove(parts, "/fields", |number| number == last);
        });
        self.parts("again-sample-lost", "a sample is missing", says, |parts| {
            remove(parts, "/step", |number| number == 1);
        });
        self.parts("again-sample-more", "a sample that nobody asked for", says, |parts| {
            let at = messages(parts, "/step")[1];
            let mut message: Value = serde_json::from_str(payload(&parts[at])).expect("it is JSON");
            let step = message["step"].as_u64().expect("it has a step") - 1;
            message["step"] = step.into();
            message["time_s"] = json!(step as f64 / 1e7);
            let channel = parts[at].channel_id().expect("it is a message");
            parts.insert(at, Part::message(channel, 0, step * 100, message.to_string().as_bytes()));
            renumber(parts);
        });
        let is_of_run = |part: &Part| part.opcode == op::MESSAGE || part.name() == Some("run_end");
        self.parts("again-another-run", "the records and the end of another run", says, |parts| {
            parts.retain(|part| !is_of_run(part));
            parts.extend(other.iter().filter(|part| is_of_run(part)).cloned());
        });
    }

    fn other_numbers(&mut self) {
        let what = "a number that the run does not give";
        let says = "the run, made again, gives another record";
        for (name, load_n) in
            [("again-normal-load", 1e300), ("again-normal-load-a-little", 400.000_000_000_1)]
        {
            self.parts(name, what, says, |parts| {
                change_step(parts, 1, |message| message["normal_load_n"] = json!(load_n));
            });
        }
        for (name, key) in [("again-threshold", "threshold_n"), ("again-switch-velocity", "velocity_m_per_s")]
        {
            self.parts(name, what, says, |parts| {
                // The events reveal the first one as well.
                let at = *messages(parts, "/switch").last().expect("blocks switch");
                change(parts, at, |message| message[key] = json!(1e-3));
            });
        }
        for (name, number) in [("again-start", 0), ("again-state", 2)] {
            self.parts(name, what, says, |parts| {
                let at = messages(parts, "/fields")[number];
                let state = parts[at].payload().expect("it is a message");
                let other = changed(state, |state: &mut FieldRecord| state.displacement_m[4] = 1e-3);
                parts[at] = parts[at].with_payload(&other);
            });
        }
        self.parts("again-heat", what, says, |parts| {
            let number = messages(parts, "/step").len() / 2;
            change_step(parts, number, |message| message["friction_heat_j"] = json!(1e-3));
        });
    }

    fn other_end(&mut self) {
        let what = "a load that the scenario does not ask for is said not to have been reached";
        let says = "the run, made again, waits for no load";
        self.says("again-status", "run_end", "status", Some("load-not-reached"), what, says);
    }

    fn own_numbers(&mut self) {
        self.parts("own-last-sample-lost", "the last sample is missing", "follows step", |parts| {
            let last = messages(parts, "/step").len() - 1;
            remove(parts, "/step", |number| number == last);
        });
        self.parts(
            "own-energy-lost",
            "a step without one of the energies",
            "missing field `elastic_j`",
            |parts| {
                change_step(parts, 3, |message| {
                    message.as_object_mut().expect("it is an object").remove("elastic_j");
                });
            },
        );
        let (key, says) = ("energy:friction_heat_j", "energies: friction_heat_j = 1.5");
        let what = "an energy at the end that is not that of the last step";
        self.says("own-end-energy", "run_end", key, Some("1.5"), what, says);
        let what = "a solver that there is not";
        self.says("own-solver", "run", "solver", Some("by hand"), what, "says \"by hand\"");
    }

    fn own_scenario(&mut self) {
        let what = "a scenario that says the same in other words";
        self.parts("own-scenario-words", what, "is not the text that this program writes", |parts| {
            let at = named(parts, "scenario.toml");
            let text = parts[at].attached().expect("it is attached").to_owned();
            parts[at] = Part::attachment("scenario.toml", &[&text[..], b"# and more\n"].concat());
        });
    }

    fn own_ruptures(&mut self) {
        let what = "an anchor that the energies of its rupture do not have";
        self.parts("own-anchor", what, "other events", |parts| {
            let at = *messages(parts, "/switch").last().expect("blocks switch");
            change(parts, at, |message| message["stick_position_m"] = json!(1e-3));
        });
        let what = "a rupture or an arrival that is not that of its steps";
        for (name, topic, key, value, says) in [
            ("own-rupture-load", "/events/rupture", "ft_fn_onset", json!(0.5), "other events"),
            ("own-arrival-slip", "/events/arrival", "slip_m", json!(1.0), "other events"),
            // These no run has, so any program sees it.
            (
                "own-rupture-blocks",
                "/events/rupture",
                "last_block",
                json!(11),
                "last_block = 11 of a chain of 10",
            ),
            ("own-rupture-end", "/events/rupture", "end_step", json!(3), "end_step = 3, and onset_step"),
            ("own-arrival-block", "/events/arrival", "block", json!(0), "block = 0 of a chain of 10"),
            ("own-arrival-stop", "/events/arrival", "stop_step", json!(3), "stop_step = 3, and arrival_step"),
        ] {
            self.parts(name, what, says, |parts| {
                let at = messages(parts, topic)[0];
                change(parts, at, |message| message[key] = value);
            });
        }
        for (name, topic) in
            [("own-rupture-lost", "/events/rupture"), ("own-arrival-lost", "/events/arrival")]
        {
            self.parts(name, "an event is missing, and counts and digest agree", "other events", |parts| {
                let at = messages(parts, topic)[1];
                parts.remove(at);
                renumber(parts);
            });
        }
    }

    /// The scales that link detachments, in the header.
    fn own_links(&mut self) {
        let what = "a header that no run has";
        for (name, key, value) in [
            ("own-link-0", "link_time_ratio", Some("0")),
            ("own-block-length-infinite", "block_length_m", Some("inf")),
            ("own-link-other-words", "link_time_ratio", Some("100.0")),
            ("own-link-other-time", "link_s", Some("1")),
        ] {
            self.says(name, "run", key, value, what, "metadata `run` has");
        }
        let missing = "a header that is silent on a part of what links detachments";
        self.says("own-no-link", "run", "link_time_ratio", None, missing, "lacks the key link_time_ratio");
        let none = "a header that is silent on what links detachments";
        self.parts("own-no-links", none, "lacks the key block_length_m", |parts| {
            change_run(parts, |map| {
                map.retain(|key, _| !key.starts_with("link_") && !key.starts_with("block_"));
            });
        });
        let other = "a header by which other detachments are linked than its scenario says";
        self.parts("own-links-other", other, "\"link_time_ratio\":50.0", |parts| {
            change_run(parts, |map| {
                let link_s: f64 = map["link_s"].parse().expect("it is a number");
                map.insert("link_time_ratio".to_owned(), "50".to_owned());
                map.insert("link_s".to_owned(), (link_s / 2.0).to_string());
            });
        });
    }
}

/// Removes messages of a topic by their number.
fn remove(parts: &mut Vec<Part>, topic: &str, is_removed: impl Fn(usize) -> bool) {
    let all = messages(parts, topic);
    let removed: Vec<usize> =
        all.into_iter().enumerate().filter(|(number, _)| is_removed(*number)).map(|(_, at)| at).collect();
    assert!(!removed.is_empty(), "{topic} has no such message");
    for at in removed.into_iter().rev() {
        parts.remove(at);
    }
    renumber(parts);
}

fn change(parts: &mut [Part], at: usize, change: impl FnOnce(&mut Value)) {
    let mut message: Value = serde_json::from_str(payload(&parts[at])).expect("messages are JSON");
    change(&mut message);
    parts[at] = parts[at].with_payload(message.to_string().as_bytes());
}

/// Changes a step, and its ratio of loads with it.
fn change_step(parts: &mut [Part], number: usize, with: impl FnOnce(&mut Value)) {
    let at = messages(parts, "/step")[number];
    change(parts, at, |message| {
        with(message);
        let load = |key: &str| message[key].as_f64().expect("it is a number");
        message["ft_fn"] = json!(load("driving_force_n") / load("normal_load_n"));
    });
}

/// Changes the header.
fn change_run(parts: &mut [Part], change: impl FnOnce(&mut BTreeMap<String, String>)) {
    let at = named(parts, "run");
    let mut map = parts[at].map().expect("it is metadata");
    change(&mut map);
    parts[at] = Part::metadata("run", &map);
}
