//! `recording.energies = "none"`: the key has no effect but a warning, and logs without energies, which
//! older versions of the program made by it, are read by everything that reads logs.

use std::fs;
use std::path::{Path, PathBuf};

use asperity_testkit::{read_log, run_end};

use crate::support::binary::{outcome, run, succeed, text, with_sets};

const NONE: [&str; 2] = ["--set", "recording.energies=none"];
const WARNED: &str = "warning: recording.energies = \"none\": energies are always recorded now";
const SAID: &str =
    "its records have no energies, so numbers that need them are empty (recording.energies = \"none\"";

const CHAIN: [&str; 7] =
    ["default", "--set", "slider.blocks=30", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1"];

/// A log of a chain of 600 blocks without energies, whose first blocks were stepped alone.
fn without() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/v6/without-energies.mcap")
}

/// Exit code and output.
fn ended(arguments: &[&str]) -> (i32, String) {
    let (code, out, err) = outcome(arguments);
    (code, out + &err)
}

#[test]
fn a_run_that_asks_for_none_is_warned_of_and_has_energies_all_the_same() {
    let folder = asperity_testkit::folder();
    let (with, asked) = (folder.path().join("with.mcap"), folder.path().join("asked.mcap"));
    run(&CHAIN, &with);
    let (code, said) = ended(&[&["run"], &CHAIN[..], &NONE, &["--out", text(&asked)]].concat());
    assert!(code == 0 && said.contains(WARNED), "{said}");
    let (of_with, of_asked) = [&with, &asked].map(|log| read_log(log).expect("the log is whole")).into();
    assert!(of_with.0 == of_asked.0, "other items");
    assert!(of_with.1.energy.is_some());
    assert_eq!(of_with.1.energy, of_asked.1.energy);
    assert_eq!(ended(&["check", "--again", text(&asked)]).0, 0);
    let (code, said) = ended(&[&["scenario", "validate", "default"][..], &NONE].concat());
    assert!(code == 0 && said.contains(WARNED), "{said}");
}

/// Its energies determine the result, whatever the key.
#[test]
fn a_run_that_asks_for_none_is_stopped_for_its_time_step() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("long.mcap");
    let long = ["rigid-contacts", "--set", "slider.blocks=24", "--set", "time.step_s=2.5e-6", "--out"];
    let (code, said) = ended(&[&["run"], &long[..], &[text(&log)], &NONE].concat());
    assert!(code == 1 && said.contains(WARNED), "{said}");
    assert!(said.contains("a shorter time.step_s is needed"), "{said}");
}

/// Messages about a run without energies, from all commands that read its log.
#[test]
fn a_log_without_energies_is_read_by_all_and_what_is_missing_is_said() {
    let folder = asperity_testkit::folder();
    let log = without();
    let out = |name: &str| folder.path().join(name);
    assert!(succeed(&["replay", text(&log)]).contains("the same as logged"));
    // Neither in the records nor at the end, whose counters include some that the solver no longer has.
    let end = run_end(&log);
    assert_eq!(end.energy, None);
    assert!(end.solver.counts["zones"] > 5 && end.solver.counts["zone_steps"] > 10_000);

    let (code, said) = ended(&["export", text(&log), "--to", "csv", "--out", text(&out("tables"))]);
    assert!(code == 0 && said.contains(SAID), "{said}");
    let steps = out("tables").join("without-energies.step.csv");
    let steps = fs::read_to_string(steps).expect("a table");
    assert!(steps.lines().any(|line| line.ends_with("ft_fn,sliding,switches")), "{steps:.300}");

    let (code, said) = ended(&["summary", text(&log)]);
    assert!(code == 0 && said.contains(SAID), "{said}");
    assert!(said.contains("drive work                             -"), "{said}");

    // Its switches are those of a run with energies.
    let with = out("with.mcap");
    let sets = ["slider.blocks=600", "time.duration_s=0.03", "recording.fields_s=0"];
    let more = ["recording.event_fields=false", "recording.sample_s=0.003"];
    run(&with_sets(&["default"], &[&sets[..], &more].concat()), &with);
    assert!(!ended(&["summary", text(&with)]).1.contains(SAID));
    let (code, said) = ended(&["diff", text(&with), text(&log)]);
    assert!(code == 0 && said.contains("nothing differs"), "{said}");

    // A salvaged log is one as well.
    let bytes = fs::read(&log).expect("it can be read");
    assert!(!bytes.windows(7).any(|window| window == b"energy:"));
    let damaged = out("damaged.mcap");
    fs::write(&damaged, &bytes[..bytes.len() * 9 / 10]).expect("the folder can be written");
    let salvaged = out("salvaged.mcap");
    let (code, said) = ended(&["salvage", text(&damaged), "--out", text(&salvaged)]);
    assert_eq!(code, 0, "{said}");
    assert_eq!(ended(&["check", text(&salvaged)]).0, 5);
}

#[cfg(feature = "analysis")]
#[test]
fn a_log_without_energies_is_reduced_and_reported() {
    let folder = asperity_testkit::folder();
    let log = without();
    let (tables, page) = (folder.path().join("tables"), folder.path().join("page.html"));
    let (code, said) = ended(&["reduce", text(&log), "--out", text(&tables)]);
    assert!(code == 0 && said.contains(SAID), "{said}");
    succeed(&["report", text(&log), "--out", text(&page)]);
    let page = fs::read_to_string(page).expect("the page is there");
    assert!(page.contains("No energies: recording.energies = &quot;none&quot;."));
}
