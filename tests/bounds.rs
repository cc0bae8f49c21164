//! Memory and time in proportion to the input: small files that expand to large ones, texts and logs beyond
//! the limits, forged checkpoints. The limits of commands are in `hostile.rs`.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::hostile::refused;
use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::support::binary::{self, ends, outcome, succeed, text, with_sets};
use crate::support::small;

/// A log of the smallest run, taken apart.
fn parts_of(log: &Path) -> Vec<Part> {
    take_apart(&fs::read(log).expect("the log can be read"))
}

#[test]
fn logs_of_more_than_a_log_has_are_refused_at_once() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("small.mcap");
    small::run(&log);
    let parts = parts_of(&log);
    let place = |name: &str| {
        parts
            .iter()
            .position(|part| part.name() == Some(name))
            .unwrap_or_else(|| panic!("there is no {name}"))
    };
    let channel =
        parts.iter().position(|part| part.opcode == mcap::records::op::CHANNEL).expect("it has channels");
    let slip = parts
        .iter()
        .position(|part| part.payload().is_some_and(|text| text.starts_with(b"{\"onset_s\"")))
        .expect("it has events");
    let mut forged: Vec<(&str, Vec<Part>)> = Vec::new();
    let mut with = |name, change: &dyn Fn(&mut Vec<Part>)| {
        let mut parts = parts.clone();
        change(&mut parts);
        forged.push((name, parts));
    };
    with("channels", &|parts| {
        let many = (100..60_000_u16).map(|id| Part::channel(id, 1, &format!("/events/{id}")));
        drop(parts.splice(channel..channel, many));
    });
    with("bytes in the name of a topic", &|parts| {
        parts.insert(channel, Part::channel(999, 1, &format!("/events/{}", "x".repeat(5_000_000))));
    });
    with("a TOML text of", &|parts| {
        let toml = "# nothing at all\n".repeat(800_000);
        parts[place("scenario.toml")] = Part::attachment("scenario.toml", toml.as_bytes());
    });
    with("keys, values and lines", &|parts| {
        let toml = format!("a = [{}]", "1,".repeat(3_000_000));
        parts[place("scenario.toml")] = Part::attachment("scenario.toml", toml.as_bytes());
    });
    with("bytes in an event", &|parts| {
        parts[slip] = parts[slip].with_payload(format!("{{\"a\":{}", "[".repeat(5_000_000)).as_bytes());
    });
    with("message 0 of /events/slip cannot be read", &|parts| {
        parts[slip] = parts[slip].with_payload(format!("{{\"a\":{}", "[".repeat(50_000)).as_bytes());
        correct_end(parts);
    });
    with("bytes of metadata in one record", &|parts| {
        let map = (0..700_000).map(|number| (format!("{number:x}"), String::new())).collect();
        parts[place("run")] = Part::metadata("run", &map);
    });
    for (number, (says, parts)) in forged.into_iter().enumerate() {
        let file = folder.path().join("forged.mcap");
        fs::write(&file, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
        let said = refused(folder.path(), &["check", text(&file)], &file);
        assert!(said.contains(says), "{says}: {said}");
        // What another command makes of it, in turn.
        let others = [&["events", text(&file)][..], &["diff", text(&file), text(&log)]];
        refused(folder.path(), others[number % 2], &file);
    }
}

/// What is accepted gives a log that is read, at every bound; what would not is refused with the key, before it runs.
#[test]
fn what_is_accepted_is_read_at_every_bound() {
    hold_bounds(false);
}

/// With those of scenarios of megabytes, or without.
fn hold_bounds(with_large: bool) {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    let csv = |name: &str, header: &str, rows: &mut dyn Iterator<Item = String>| {
        let rows = format!("{header}\n{}\n", rows.collect::<Vec<_>>().join("\n"));
        fs::write(folder.join(name), rows).expect("the folder can be written");
        text(&folder.join(name)).to_owned()
    };
    let state = "displacement_m,velocity_m_per_s,stick_position_m,slides";
    let ends = |of: &'static str| {
        csv(
            of,
            &format!("time_s,x_over_l,{of}"),
            &mut (0..400).map(|n| format!("{},{},0.{}", f64::from(n / 2) * 1e-3, n % 2, 91_234_567 + 13 * n)),
        )
    };
    let one_large = |n: u32, what: &'static str| if n == 9 { what } else { "1e-6" };
    let large =
        csv("large.csv", state, &mut (0..10).map(|n| format!("{},-1e30,1e30,1", one_large(n, "1e30"))));
    let larger = csv("larger.csv", state, &mut (0..10).map(|n| format!("{},0,1e-6,0", one_large(n, "1e31"))));
    let steep =
        csv("steep.csv", "x_over_l,tau_over_p", &mut ["0,-1e7", "1,1e7"].into_iter().map(str::to_owned));
    let uneven =
        csv("uneven.csv", "stiffness_offset", &mut (0..100_000).map(|n| format!("0.0000000123{n:05}")));
    let (factor, ratio) = (ends("factor"), ends("ratio"));
    let (name, longer) = ("n".repeat(4096), "n".repeat(4097));
    let spreads = "slider.blocks=100000 time.step_s=1e-10 time.duration_s=1e-9 recording.sample_s=0 \
                   friction.static_spread=0.05 friction.dynamic_spread=0.05 disorder.stiffness_spread=0.05 \
                   disorder.load_spread=0.05";
    let short = "slider.blocks=10 time.duration_s=1e-6";
    for (sets, refused_key) in [
        (spreads.to_owned(), ""),
        (format!("{spreads} disorder.contacts_csv={uneven}"), "a log of this scenario would hold "),
        (
            format!(
                "slider.blocks=1000 time.duration_s=1e-7 normal_load.course_csv={factor} prestress.course_csv={ratio}"
            ),
            "",
        ),
        (format!("{short} name={name} summary={name}"), ""),
        (format!("{short} name={longer}"), "nnn... (4099 bytes) is not accepted"),
        (format!("{short} initial.state_csv={large}"), ""),
        (format!("{short} initial.state_csv={larger}"), "initial.state_csv: "),
        (format!("{short} prestress.profile_csv={steep}"), "prestress.profile_csv: "),
        (format!("{short} initial_shear.profile_csv={steep}"), "initial_shear.profile_csv: "),
        (format!("{short} normal_load.course_s=[0] normal_load.course_factor=[1e30]"), ""),
    ]
    .into_iter()
    .skip(if with_large { 0 } else { 2 })
    {
        let log = folder.join("run.mcap");
        let sets: Vec<&str> = sets.split_whitespace().collect();
        let run = ["run", "default", "--quiet", "--out", text(&log)];
        let (code, _, said) = outcome(&with_sets(&run, &sets));
        let short: String = said.chars().take(1000).collect();
        if refused_key.is_empty() {
            assert!(log.exists(), "{short}");
            succeed(&["check", text(&log)]);
            succeed(&["scenario", "show", text(&log)]);
            fs::remove_file(&log).expect("it is there");
        } else {
            assert_eq!(code, 2, "{short}");
            assert!(said.contains(refused_key) && said.contains("(accepted: "), "{refused_key}: {short}");
            assert!(said.len() < 20_000 && !log.exists(), "{short}");
        }
    }
}

#[test]
fn csv_tables_of_no_run_are_refused() {
    const HEADING: &str = "onset_s,end_s,first_block,last_block\n";
    let folder = asperity_testkit::folder();
    let tables = [
        ("block", format!("{HEADING}0.5,0.6,1,4294967295\n"), "from 1 to 100000"),
        ("at-once", format!("{HEADING}{}", "0.5,0.6,1,3\n".repeat(500_000)), "events start at 0.5 s"),
        ("line", format!("{HEADING}{}", "1".repeat(10_000_000)), "line 2 is longer than"),
        ("commas", format!("{HEADING}{}", ",".repeat(10_000_000)), "line 2 is longer than"),
        (
            "step",
            "onset_s,end_s,first_block,last_block,onset_step\n0.5,0.6,1,3,18446744073709551615\n".to_owned(),
            "up to 9007199254740992",
        ),
    ];
    for (name, content, says) in tables {
        let file = folder.path().join(format!("{name}.csv"));
        fs::write(&file, content).expect("the folder can be written");
        let said = refused(folder.path(), &["diff", text(&file), text(&file)], &file);
        assert!(said.contains(says), "{name}: {said}");
    }
    let file = folder.path().join("endless.csv");
    fs::write(&file, "a".repeat(1 << 17)).expect("the folder can be written");
    let said = refused(folder.path(), &["diff", text(&file), text(&file)], &file);
    assert!(said.contains("line 1 is longer than"), "{said}");
}

/// However often checkpoints are requested, they do not dominate a log.
#[test]
fn checkpoints_have_a_budget() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("often.mcap");
    binary::run(&["default", "--set", "time.duration_s=2", "--checkpoint-s", "0"], &log);
    let bytes = fs::metadata(&log).expect("it was just written").len();
    // A hundred megabytes and more without it, and some with it even on a slow machine.
    assert!((10_000_000..40_000_000).contains(&bytes), "{bytes} bytes");
}

#[test]
fn a_start_that_overflows_is_refused_and_leaves_nothing() {
    let folder = asperity_testkit::folder();
    let profile = folder.path().join("profile.csv");
    fs::write(&profile, "x_over_l,tau_over_p\n0,1e308\n1,-1e308\n").expect("the folder can be written");
    let set = format!("initial_shear.profile_csv={}", text(&profile));
    let out = folder.path().join("run.mcap");
    let place = format!("initial_shear.profile_csv: {}:2: 1e308 is too large", text(&profile));
    ends(2, &["run", "default", "--set", &set, "--out", text(&out)], &[&place]);
    assert_eq!(fs::read_dir(folder.path()).expect("the folder is there").count(), 1);
}

/// Places of numbers in a JSON value.
fn numbers(value: &Value, at: &str, found: &mut Vec<String>) {
    match value {
        Value::Number(_) => found.push(at.to_owned()),
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(n, value)| numbers(value, &format!("{at}/{n}"), found));
        }
        Value::Object(map) => {
            map.iter().for_each(|(key, value)| numbers(value, &format!("{at}/{key}"), found))
        }
        _ => {}
    }
}

/// The forged value of a number; whole numbers stay whole.
fn changed(value: &Value, how: usize) -> Value {
    match (value.as_u64(), value.as_f64(), how) {
        (Some(whole), _, 0) => Value::from(whole.saturating_add(1)),
        (Some(_), _, _) => Value::from(1_u64 << 60),
        (_, Some(number), 0) if number != 0.0 => Value::from(number * 1.01),
        (_, Some(number), _) => Value::from(number + 1.0),
        _ => Value::Null,
    }
}

#[test]
fn a_forged_checkpoint_is_refused_or_seen_by_making_the_run_again() {
    forge_checkpoints(10);
}

/// A checkpoint that fits no step of the run is refused. A run that continues from any other is stopped,
/// ends with the original messages, or is another run, which repeating it reveals. Every `each`-th number
/// of a checkpoint is forged.
fn forge_checkpoints(each: usize) {
    let short = ["time.step_s=1e-7", "time.duration_s=1.2", "slider.blocks=10"];
    let folder = asperity_testkit::folder();
    let (mut refusals, mut others) = (0, 0);
    for scenario in ["ten-blocks", "ageing-contacts"] {
        let scenario = &with_sets(&[scenario], &short)[..];
        let whole = folder.path().join("whole.mcap");
        fs::remove_file(&whole).ok();
        // One after each record, on any machine. Only one after the middle is kept.
        binary::run(&[scenario, &["--checkpoint-s", "0"]].concat(), &whole);
        let mut parts = parts_of(&whole);
        let is_checkpoint = |part: &Part| part.name() == Some("checkpoint");
        let state_of = |part: &Part| -> Value {
            serde_json::from_slice(part.attached().expect("it has content")).expect("it is JSON")
        };
        let middle = parts.len() / 2;
        let has_slipped = |part: &Part| state_of(part)["counters"]["switches"].as_u64() > Some(0);
        let at = (middle..parts.len())
            .find(|at| is_checkpoint(&parts[*at]) && has_slipped(&parts[*at]))
            .expect("there are checkpoints");
        let checkpoint = parts[at].clone();
        parts.truncate(at);
        parts.retain(|part| !is_checkpoint(part));
        parts.push(checkpoint);
        let last = parts.len() - 1;
        let state = state_of(&parts[last]);
        let mut places = Vec::new();
        numbers(&state, "", &mut places);
        assert!(places.len() > 50, "{places:?}");
        // All single fields, and every fifth of the blocks.
        let of_block = |place: &str| place.rsplit('/').next().and_then(|n| n.parse::<usize>().ok());
        places.retain(|place| of_block(place).is_none_or(|n| n % 5 == 0));
        let out = folder.path().join("run.mcap");
        let partial: PathBuf = folder.path().join("run.mcap.partial");
        let goes_on = |state: &Value| {
            let mut parts = parts.clone();
            parts[last] = Part::attachment("checkpoint", state.to_string().as_bytes());
            fs::write(&partial, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
            fs::remove_file(&out).ok();
            let (code, _, err) = outcome(&[&["run"], scenario, &["--resume", "--out", text(&out)]].concat());
            fs::remove_file(&partial).ok();
            (code, err)
        };
        let (code, err) = goes_on(&state);
        assert!(code == 0 && err.contains("resumes from"), "the true one: {err}");
        let digest = asperity_testkit::run_end(&whole).digest;
        assert_eq!(asperity_testkit::run_end(&out).digest, digest);
        let mut forgeries: Vec<(String, Value)> = Vec::new();
        for (place, how) in places.iter().step_by(each).flat_map(|place| [(place, 0), (place, 1)]) {
            let mut forged = state.clone();
            let value = forged.pointer_mut(place).expect("it was just found");
            *value = changed(value, how);
            forgeries.push((place.clone(), forged));
        }
        // Contacts that are not as their switches left them, in numbers that agree.
        let mut forged = state.clone();
        let slip = forged.pointer("/solver/slider/slip").and_then(Value::as_array).expect("it has contacts");
        let turned: Vec<f64> = slip.iter().map(|slip| 1.0 - slip.as_f64().expect("a number")).collect();
        forged["solver"]["slider"]["detached"] =
            Value::from(turned.iter().filter(|slip| **slip == 1.0).count());
        forged["solver"]["slider"]["slip"] = Value::from(turned);
        forgeries.push(("slip".to_owned(), forged));
        for (place, forged) in forgeries {
            let (code, err) = goes_on(&forged);
            assert!(!err.contains("panicked"), "{place}: {code} {err}");
            if !out.exists() {
                let says = "its last checkpoint is not a state of this run";
                assert!(code != 0 && err.contains(says), "{place}: {code} {err}");
                refusals += 1;
                continue;
            }
            let is_stopped = code == 1 && err.contains("stopped: in step ");
            assert!(code == 0 || is_stopped, "{place}: {code} {err}");
            let (code, said, _) = outcome(&["check", "--again", text(&out)]);
            if code == 0 {
                assert_eq!(asperity_testkit::run_end(&out).digest, digest, "{place}");
            } else {
                assert_eq!(code, 4, "{place}: {said}");
                others += 1;
            }
        }
    }
    let least = 20 / each;
    assert!(refusals > least && others > least, "{refusals} were refused, {others} made other runs");
}

#[test]
#[ignore = "half a minute, hundreds of runs: cargo xtask nightly"]
fn every_forged_checkpoint_is_refused_or_seen_by_making_the_run_again() {
    forge_checkpoints(1);
}

mod in_ci {
    #[test]
    #[ignore = "scenarios of megabytes: cargo xtask ci"]
    fn what_is_accepted_is_read_at_the_largest_bounds() {
        super::hold_bounds(true);
    }
}
