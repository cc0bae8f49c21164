//! Runs whose time step is too long: they cause a warning, are stopped, and their logs record it.

use std::fs;
use std::path::Path;

use asperity_record::RunStatus;
use asperity_runlog::{LogProblem, RunReader, Topics, partial_path};

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::support::binary::{outcome, succeed, text};
use crate::support::small;

/// Stopped half-way, after some slip events, at 0.94 of the longest stable step.
const LONG: [&str; 5] = ["rigid-contacts", "--set", "slider.blocks=24", "--set", "time.step_s=2.5e-6"];

fn run(out: &Path, more: &[&str]) -> (i32, String) {
    let (code, _, said) = outcome(&[&["run"], &LONG[..], more, &["--out", text(out)]].concat());
    (code, said)
}

/// Of a log of a run that was stopped: why, by its end, and its digest.
fn stopped(log: &Path) -> (String, String) {
    let mut reader = RunReader::open(log, Topics::ALL).expect("it has a header");
    let error = reader.verify().expect_err("not all of its steps were taken");
    assert!(matches!(error.problem, LogProblem::Stopped(_)), "{error}");
    let end = reader.end().expect("it says how it ended").clone();
    assert_eq!(end.status, RunStatus::StoppedEnergy);
    assert!(end.last_step < reader.header().steps);
    (end.stopped.expect("it says why"), end.digest)
}

#[test]
fn a_run_that_its_time_step_drives_is_stopped_and_says_why() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("long.mcap");
    let (code, said) = run(&log, &[]);
    assert_eq!(code, 1, "{said}");
    // Both numbers, once, and the effect of such a long step on fronts.
    assert_eq!(said.matches("warning").count(), 2, "{said}");
    assert!(said.contains("time.step_s = 2.5e-6 is 0.94 of the longest stable step, 2.664e-6 s"), "{said}");
    let (why, digest) = stopped(&log);
    assert!(why.starts_with("in step ") && why.contains("more than 30 % of the "), "{why}");
    assert!(
        said.contains(&format!("error: rigid-contacts: stopped: {why}; {} contains", log.display())),
        "{said}"
    );
    assert!(!partial_path(&log).exists());
    for again in [&["check"][..], &["check", "--again"]] {
        let (code, told, _) = outcome(&[again, &[text(&log)]].concat());
        assert!(code == 7 && told.contains(": stopped: ") && told.contains(&why), "{told}");
    }
    // No file to resume from, and none that looks like a finished run.
    let (code, said) = run(&log, &["--resume"]);
    assert!(code == 1 && said.contains(&why), "{said}");

    // Quiet: only the error. The other solver, the same step.
    let plain = folder.path().join("plain.mcap");
    let (code, said) = run(&plain, &["--quiet", "--solver", "plain"]);
    assert!(code == 1 && said.starts_with("error: ") && said.lines().count() == 1, "{said}");
    let step = |why: &str| why.split(' ').nth(2).map(str::to_owned);
    assert_eq!(step(&stopped(&plain).0), step(&why));

    // Killed halfway and resumed: equal, to its last message.
    let bytes = fs::read(&log).expect("it was just written");
    let checkpoints = folder.path().join("checkpoints.mcap");
    let (code, said) = run(&checkpoints, &["--checkpoint-s", "0"]);
    assert_eq!(code, 1, "{said}");
    let whole = fs::read(&checkpoints).expect("it was just written");
    let resumed = folder.path().join("resumed.mcap");
    for share in [0.5, 0.999] {
        let length = (whole.len() as f64 * share) as usize;
        fs::write(partial_path(&resumed), &whole[..length]).expect("the folder can be written");
        let (code, said) = run(&resumed, &["--resume"]);
        assert!(code == 1 && said.contains("resumes from"), "{said}");
        assert_eq!(stopped(&resumed), (why.clone(), digest.clone()));
        fs::remove_file(&resumed).expect("it can be removed");
    }
    assert!(bytes.len() < whole.len());
}

/// Another log, with other values in one metadata record, and everything else right.
fn forge(log: &Path, forged: &Path, record: &str, pairs: &[(&str, Option<&str>)]) {
    let mut parts = take_apart(&fs::read(log).expect("it was just written"));
    for part in parts.iter_mut().filter(|part| part.name() == Some(record)) {
        let mut map = part.map().expect("it is metadata");
        for (key, value) in pairs {
            match value {
                Some(value) => map.insert((*key).to_owned(), (*value).to_owned()),
                None => map.remove(*key),
            };
        }
        *part = Part::metadata(record, &map);
    }
    correct_end(&mut parts);
    fs::write(forged, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
}

/// The end of a run must be stated consistently; repeating the run shows whether it is true.
#[test]
fn how_a_run_ended_is_said_in_one_way_and_seen_by_making_it_again() {
    let folder = asperity_testkit::folder();
    let (long, sound) = (folder.path().join("long.mcap"), folder.path().join("sound.mcap"));
    assert_eq!(run(&long, &[]).0, 1);
    small::run(&sound);
    let forged = folder.path().join("forged.mcap");
    let check = |log: &Path, record: &str, pairs: &[(&str, Option<&str>)]| {
        forge(log, &forged, record, pairs);
        outcome(&["check", text(&forged)])
    };
    let (code, said, _) = check(&long, "run", &[]);
    assert!(code == 7, "as it was: {said}");
    for (log, record, pairs, told) in [
        (&sound, "run_end", &[("status", Some("stopped-energy"))][..], "is not why the run was stopped"),
        (&sound, "run_end", &[("stopped", Some("so"))], "is not why the run was stopped"),
        (&sound, "run_end", &[("status", Some("stopped"))], "`stopped-energy`, `stopped-not-finite`"),
        (&sound, "run", &[("longest_stable_step_s", None)], "longest_stable_step_s"),
        (&sound, "run", &[("longest_stable_step_s", Some("1e-5"))], "longest_stable_step_s"),
        (&sound, "run", &[("longest_stable_step_s", Some("-1"))], "a number above 0"),
        (&long, "run_end", &[("status", Some("complete")), ("stopped", None)], "the last step"),
    ] {
        let (code, said, _) = check(log, record, pairs);
        assert!(code == 4 && said.contains(told), "{pairs:?}: {said}");
    }
    for (log, pairs, told) in [
        (&sound, &[("status", Some("stopped-energy")), ("stopped", Some("so"))][..], "is not stopped"),
        (&long, &[("stopped", Some("in step 1 it was tired"))], "is stopped: in step "),
        (&long, &[("status", Some("stopped-not-finite"))], "is stopped: in step "),
    ] {
        let (code, said, _) = check(log, "run_end", pairs);
        assert_eq!(code, 7, "{pairs:?}: {said}");
        let (code, said, _) = outcome(&["check", "--again", text(&forged)]);
        let told = format!("the run, made again, {told}");
        assert!(code == 4 && said.contains(&told), "{pairs:?}: {said}");
    }
}

/// Scenarios that would overflow are refused before a run.
#[test]
fn numbers_that_would_overflow_are_refused_with_what_is_accepted() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("overflow.mcap");
    for set in ["normal_load.total_n=1e160", "drive.velocity_m_per_s=1e156"] {
        let (code, _, said) = outcome(&["run", "default", "--set", set, "--out", text(&log)]);
        assert!(code == 2 && said.contains(" is too large to calculate with (accepted: a number "), "{said}");
        assert!(!log.exists());
    }
}

/// The ratio of the time step to the limit of stability is printed before a run.
#[test]
fn a_scenario_shows_its_longest_stable_step() {
    let told = succeed(&["scenario", "show", "default", "--set", "parameter_set=as-stated"]);
    assert!(told.contains("# dt_max = 5.694e-7 s: "), "{told}");
    assert!(told.contains("1.76e-2 dt_max; at most 0.4 is advised.\n"), "{told}");
    let told = succeed(&[&["scenario", "show"], &LONG[..]].concat());
    assert!(
        told.replace("\n# ", " ")
            .contains("9.38e-1 dt_max; at most 0.4 is advised; above this, blocks that switch"),
        "{told}"
    );
}
