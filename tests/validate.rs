//! `asperity scenario validate`: its predictions agree with the run, and random draws are written to the
//! log.

use std::fs;
use std::time::Instant;

use serde_json::Value;

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::support::binary::{self, outcome, succeed, text, with_sets};

/// The exit code and stderr of a command.
fn said(arguments: &[&str]) -> (i32, String) {
    let (code, _, said) = outcome(arguments);
    (code, said)
}

fn forecast(arguments: &[&str]) -> Value {
    let all = [&["scenario", "validate", "--format", "json"], arguments].concat();
    serde_json::from_str(&succeed(&all)).expect("it is JSON")
}

#[test]
fn it_is_valid_with_the_same_words_or_refused_as_run_refuses_it() {
    let quiet = ["--quiet", "scenario", "validate", "default"];
    let words = succeed(&quiet);
    assert_eq!(succeed(&quiet), words);
    let lines: Vec<&str> = words.lines().collect();
    assert_eq!(lines[0], "default: valid");
    let load = "  load         F_T/F_N reaches mu_d = 0.45 at 2.254 s, reaches mu_s = 0.7 at 3.507 s, and is at most 0.998 in \
                this run, if nothing slides";
    assert_eq!(lines[2..4], [load, "  first slip   at 0.05674 s, of block 1"]);
    assert_eq!(
        lines[4],
        "  time step    1e-8 s, 2.96e-3 of the longest stable one, 3.379e-6 s (warning above 0.4)"
    );
    assert_eq!(lines[5], "  steps        500000000");
    assert!(lines[6].contains(" for scheduled records, 5001 samples, 251 states; more"), "{words}");
    assert_eq!(said(&quiet).1, "", "nothing is tried, and nothing noted");

    let (code, noted) = said(&["scenario", "validate", "default"]);
    assert_eq!(code, 0);
    let expected = "default: as coded: 12 kg, c = 46 m/s\ndefault: --solver plain, which computes every step, would take about ";
    assert!(noted.starts_with(expected), "{noted}");
    assert!(
        noted.ends_with(
            " here, as its first 0.25 s show; the default solver takes far less wherever few blocks switch\n"
        ),
        "{noted}"
    );
    let (_, noted) = said(&["scenario", "validate", "junction-slider"]);
    assert!(
        noted.contains("the default solver takes as long, since contacts of junctions have no leaps"),
        "{noted}"
    );

    let folder = asperity_testkit::folder();
    let (file, log) = (folder.path().join("mine.toml"), folder.path().join("mine.mcap"));
    fs::write(&file, "[friction]\nlaw = \"rigid\"\nreattach = \"one-way\"\nsliding_share = 0.25\n")
        .expect("it can be written");
    let validated = said(&["scenario", "validate", text(&file)]);
    let path = text(&file);
    let expected = format!(
        "error: {path}:3:12: friction.reattach: \"one-way\" has no meaning for friction.law = \"rigid\": its \
         contacts stop whichever way they slid, if they stick (accepted: \"two-way\", or friction.law = \"interfacial-springs\")\n\
         error: {path}:4:17: friction.sliding_share: 0.25 has no meaning for friction.law = \"rigid\" (accepted: 0.5, \
         or friction.law = \"junctions\")\n"
    );
    assert_eq!(validated, (2, expected));
    assert_eq!(said(&["run", text(&file), "--out", text(&log)]), validated);
    assert!(!log.exists());
}

/// Scenarios that are warned of; unit tests of the model have the other warnings.
const WARNED: [(&str, &[&str]); 4] = [
    ("warning: time.step_s = 2e-6 is 0.59 of the longest stable step, 3.379e-6 s", &["time.step_s=2e-6"]),
    ("F_T/F_N = 0.0122 at the start, most on block 100", &["drive.kind=top", "initial_shear.beta=0.45"]),
    ("warning: time.duration_s = 2e-4: nothing slips within 2e-4 s: block 1 reaches its", &[]),
    (
        "warning: drive.stiffness_n_per_m = 0.8: nothing slips within 0.1 s: block 1 reaches its static friction at \
         56630 s; was 8e5 meant, that is 0.8 N/um?",
        &["drive.stiffness_n_per_m=0.8", IN_TIME[0], IN_TIME[1]],
    ),
];

/// A run whose blocks would slip if its values were in the units of their keys.
const IN_TIME: [&str; 2] = ["time.step_s=5e-8", "time.duration_s=0.1"];

#[test]
fn what_may_surprise_is_said_before_and_by_the_run() {
    let folder = asperity_testkit::folder();
    for (number, (expected, sets)) in WARNED.iter().enumerate() {
        let short = ["time.duration_s=2e-4", "recording.sample_s=0", "recording.fields_s=0"];
        let short =
            short.into_iter().filter(|set| !set.starts_with("time") || !sets.concat().contains("duration"));
        let sets: Vec<&str> = sets.iter().copied().chain(short).flat_map(|set| ["--set", set]).collect();
        let before = succeed(&[&["-q", "scenario", "validate", "default"], &sets[..]].concat());
        let warnings: Vec<&str> =
            before.lines().filter_map(|line| line.strip_prefix("  warning: ")).collect();
        let head = match warnings.len() {
            1 => "default: valid, with a warning\n".to_owned(),
            more => format!("default: valid, with {more} warnings\n"),
        };
        assert!(before.starts_with(&head) && before.contains(expected), "{before}");
        let log = folder.path().join(format!("{number}.mcap"));
        let run = [&["run", "default", "--out", text(&log)], &sets[..]].concat();
        let (code, by_the_run) = said(&run);
        assert_eq!(code, 0, "{by_the_run}");
        let printed: String =
            warnings.iter().map(|warning| format!("default: warning: {warning}\n")).collect();
        let (material, behind) = by_the_run.split_once('\n').expect("lines");
        assert!(material.starts_with("default: density ") && behind.starts_with(&printed), "{by_the_run}");
        let again = folder.path().join(format!("{number}-quiet.mcap"));
        let quiet = [&["--quiet", "run", "default", "--out", text(&again)], &sets[..]].concat();
        assert_eq!(said(&quiet), (0, String::new()));
        assert_eq!(
            forecast(&[&["default", "--quiet"], &sets[..]].concat())["warnings"],
            serde_json::json!(warnings)
        );
    }
}

#[test]
fn the_numbers_of_a_preview_are_in_the_json_with_their_units() {
    let found = forecast(&["default", "--quiet", "--set", "parameter_set=as-stated"]);
    let preview = &found["preview"];
    for (key, expected) in [
        ("density_kg_per_m3", 1200.0),
        ("wave_speed_m_per_s", 1451.0),
        ("decay_length_m", 1.01e-3),
        ("first_slip_s", 0.05674),
        ("first_slip_block", 1.0),
        ("dynamic_load_s", 2.254),
        ("static_load_s", 3.507),
        ("largest_load_ratio", 0.998),
    ] {
        let number = preview[key].as_f64().unwrap_or_else(|| panic!("{key} in {found}"));
        assert!((number / expected - 1.0).abs() < 1e-3, "{key}: {number}");
    }
}

/// The adaptive solver has no longest step, so the step of the grid is no share of it; it was 0 once. What has no
/// inertia has no density that matters and no waves.
#[test]
fn numbers_that_a_scenario_lacks_are_null() {
    for (sets, has_inertia) in [(&["rate-and-state"][..], true), (&["spring-slider"], false)] {
        let found = forecast(&[sets, &["--quiet"]].concat());
        assert!(found["step_ratio"].is_null() && found["longest_stable_step_s"].is_null(), "{found}");
        for key in ["density_kg_per_m3", "wave_speed_m_per_s"] {
            assert_eq!(found["preview"][key].is_number(), has_inertia, "{key}: {found}");
        }
    }
    assert!(forecast(&["default", "--quiet"])["step_ratio"].is_number());
}

/// Samples, states of long chains, windows, and a slab: runs in which little else is recorded.
#[test]
fn a_log_is_about_as_long_as_said() {
    let window = "recording.window=[{from_s=0,to_s=0.002,every_s=1e-7,first_block=2,last_block=20}]";
    let folder = asperity_testkit::folder();
    for (number, (scenario, sets)) in [
        ("default", &["time.duration_s=0.05"][..]),
        ("default", &["time.step_s=1e-7", "time.duration_s=0.002", "recording.sample_s=1e-7"]),
        ("default", &["slider.blocks=3000", "time.duration_s=1e-3", "recording.fields_s=1e-5"]),
        ("default", &["time.step_s=1e-7", "time.duration_s=0.002", window]),
        ("slab", &["time.duration_s=1e-3", "recording.fields_s=1e-5"]),
    ]
    .into_iter()
    .enumerate()
    {
        let run = with_sets(&[scenario], sets);
        let said = forecast(&[&["--quiet"], &run[..]].concat());
        assert_eq!(said["plain_solver_s"], Value::Null);
        let log = folder.path().join(format!("{number}.mcap"));
        binary::run(&run, &log);
        let end = asperity_testkit::run_end(&log);
        assert_eq!(said["steps"], end.last_step, "{run:?}");
        let of = |key: &str| said["log"][key].as_f64().expect("it is a number");
        let ratio = fs::metadata(&log).expect("the log is there").len() as f64 / of("scheduled_bytes");
        assert!((0.3..3.0).contains(&ratio), "{run:?}: {ratio} times as long as said");
        for (key, topic) in [("states", "/fields"), ("window_records", "/window")] {
            let count = end.message_counts[topic] as f64;
            assert!((count - of(key)).abs() <= 4.0, "{run:?}: {count} on {topic}, not {}", of(key));
        }
    }
}

#[test]
fn the_plain_solver_is_tried_and_takes_about_as_long() {
    let run = ["default", "--set", "time.duration_s=0.01"];
    let expected_s = forecast(&run)["plain_solver_s"].as_f64().expect("it was tried");
    let folder = asperity_testkit::folder();
    let started = Instant::now();
    binary::run(&[&run[..], &["--solver", "plain"]].concat(), &folder.path().join("run.mcap"));
    let taken_s = started.elapsed().as_secs_f64();
    // Other tests run beside this one.
    assert!(expected_s > taken_s / 20.0 && expected_s < taken_s * 20.0, "{taken_s} s, not {expected_s} s");
}

#[test]
fn what_was_drawn_is_in_the_log_and_cannot_be_changed_there() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("run.mcap");
    let sets =
        ["friction.static_spread=0.1", "friction.spread_seed=7", "time.step_s=1e-7", "time.duration_s=0.3"];
    binary::run(&with_sets(&["ten-blocks"], &sets), &log);
    let parts = take_apart(&fs::read(&log).expect("it was just written"));
    let at = parts.iter().position(|part| part.name() == Some("scenario.toml")).expect("it is there");
    let toml =
        String::from_utf8(parts[at].attached().expect("it is attached").to_owned()).expect("it is text");
    let table: toml::Table = toml.parse().expect("it is TOML");
    let drawn = table["drawn"]["static_offsets"].as_array().expect("it is a list");
    assert!(
        drawn.len() == 10
            && !table["drawn"].as_table().expect("it is a table").contains_key("dynamic_offsets")
    );

    let check = |name: &str, toml: &str| {
        let mut parts: Vec<Part> = parts.clone();
        parts[at] = Part::attachment("scenario.toml", toml.as_bytes());
        correct_end(&mut parts);
        let path = folder.path().join(name);
        fs::write(&path, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
        let (code, said, _) = outcome(&["check", text(&path)]);
        (code, said)
    };
    let (code, said) = check("same.mcap", &toml);
    assert!(code == 0 && said.contains(": whole: "), "{said}");
    // The last digit of one of them.
    let number = drawn[4].as_float().expect("it is a number");
    let other = f64::from_bits(number.to_bits() + 1);
    let (code, said) = check("other.mcap", &toml.replace(&format!("{number}"), &format!("{other}")));
    assert!(code == 4 && said.contains(": damaged: "), "{said}");
    assert!(said.contains("is not the text that this program writes"), "{said}");
    let without: String = toml
        .lines()
        .filter(|line| !line.contains(&format!("{number}")))
        .map(|line| line.to_owned() + "\n")
        .collect();
    let (code, said) = check("without.mcap", &without);
    assert!(code == 4 && said.contains("is not the text that this program writes"), "{said}");

    // A run of the log draws equal numbers, and others with another seed.
    for (set, is_same) in [("time.duration_s=0.3", true), ("friction.spread_seed=8", false)] {
        let again = folder.path().join(format!("again-{is_same}.mcap"));
        binary::run(&[text(&log), "--set", set], &again);
        let shown = succeed(&["scenario", "show", text(&again)]);
        let list = format!("# static_offsets = {}\n", table["drawn"]["static_offsets"]);
        assert_eq!(shown.contains(&list), is_same);
        assert!(succeed(&["check", text(&again)]).contains(": whole: "));
    }
}
