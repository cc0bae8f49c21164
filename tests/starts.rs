//! Runs that begin in the state of another run, with the command: a series that is spun up once and branched.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use asperity_runlog::partial_path;
use asperity_testkit::folder;

use crate::support::binary::{as_coded, ends, outcome, run, succeed, text, with_sets};
use crate::sweep::Study;

const SHORT: [&str; 6] =
    ["ten-blocks", "--set", "time.step_s=1e-7", "--set", "drive.velocity_m_per_s=2e-3", "--quiet"];

#[test]
fn a_branch_is_made_resumed_repeated_and_shown() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let (parent, branch) = (path("parent.mcap"), path("branch.mcap"));
    run(&[&SHORT[..], &["--set", "time.duration_s=0.1"]].concat(), &parent);
    let from = format!("initial.from={}", text(&parent));
    let sets = ["--set", &from, "--set", "time.duration_s=0.2", "--set", "normal_load.total_n=390"];
    run(&[&SHORT[..], &sets].concat(), &branch);
    fs::remove_file(&parent).expect("it is there");
    assert!(succeed(&["check", "--again", text(&branch)]).contains(": whole: "));
    // Shown and repeated without the other log.
    let shown = path("shown.toml");
    fs::write(&shown, succeed(&["scenario", "show", text(&branch)])).expect("the folder can be written");
    assert!(
        succeed(&["scenario", "validate", text(&shown), "--quiet"])
            .contains("in a given state, at 0.1 s on the clock")
    );
    run(&[text(&shown), "--quiet"], &path("again.mcap"));
    let differ = succeed(&["diff", text(&branch), text(&path("again.mcap"))]);
    assert!(!differ.is_empty());
    let rows = |log: &str| succeed(&["events", text(&path(log))]);
    assert_eq!(rows("branch.mcap"), rows("again.mcap"));
    // The begun log holds the state, even if it is cut in its first chunk; a state of another log it lacks.
    let bytes = fs::read(&branch).expect("it is whole");
    let zstd = bytes.windows(4).position(|there| there == 0xFD2F_B528_u32.to_le_bytes());
    for length in [zstd.expect("chunks are compressed") + 10, bytes.len() / 2] {
        let resumed = path("resumed.mcap");
        fs::write(partial_path(&resumed), &bytes[..length]).expect("the folder can be written");
        let resume = [&["run"], &SHORT[..], &sets, &["--resume", "--out", text(&resumed)]].concat();
        let other = from.replace("parent", "other");
        ends(2, &[&resume[..], &["--set", &other]].concat(), &["other.mcap: there is no"]);
        let shown = succeed(&["scenario", "show", text(&partial_path(&resumed))]);
        assert_eq!(shown, succeed(&["scenario", "show", text(&branch)]));
        // Once more: a whole log is left as it is.
        for _ in 0..2 {
            succeed(&resume);
            assert_eq!(rows("resumed.mcap"), rows("branch.mcap"));
        }
        fs::remove_file(&resumed).expect("it is there");
    }
    // Another state is read where one is asked for.
    let again = ["run", text(&branch), "-o", "never.mcap", "--set", &from];
    ends(2, &again, &["parent.mcap: there is no such file (accepted: the log of a run"]);
}

#[test]
fn a_fault_line_goes_on_in_the_state_of_another_run() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let coarse = |sets: &[&str], log: &str| run(&with_sets(&["seas-bp1-qd-coarse"], sets), &path(log));
    coarse(&["time.duration_s=6.13e9"], "whole.mcap");
    coarse(&["time.duration_s=3e9"], "parent.mcap");
    let from = format!("initial.from={}", text(&path("parent.mcap")));
    coarse(&[&from, "time.duration_s=6.13e9"], "branch.mcap");
    let events = |log| -> Vec<String> {
        let rows = succeed(&["events", text(&path(log))]);
        rows.lines().map(|row| row.split(',').take(7).collect::<Vec<_>>().join(",")).collect()
    };
    assert!(events("whole.mcap").len() > 1);
    assert_eq!(events("whole.mcap"), events("branch.mcap"));
    // Another motion, from the slip and the states there.
    coarse(&[&from, "medium.critical_slip_m=[0.01]", "time.duration_s=3.1e9"], "other.mcap");
    for log in ["branch.mcap", "other.mcap"].map(path) {
        assert!(succeed(&["check", "--again", text(&log)]).contains(": whole: "));
        assert!(succeed(&["replay", text(&log)]).contains("same as logged"));
    }
}

#[test]
fn a_study_branches_all_of_its_runs_from_one_log() {
    let folder = folder();
    let parent = folder.path().join("parent.mcap");
    let spin_up = |velocity: &str| {
        let set = ["--set", "time.duration_s=0.05", "--set", velocity, "--checkpoint-s", "0.001"];
        run(&[&SHORT[..], &set].concat(), &parent);
    };
    spin_up("drive.velocity_m_per_s=2e-3");
    let study = Study::of(&format!(
        "title = 'Branches'\nscenario = 'ten-blocks'\nset = ['parameter_set=as-coded', 'time.step_s=1e-7', \
         'drive.velocity_m_per_s=2e-3', 'time.duration_s=0.12', 'initial.from={}']\n\
         [[axis]]\nkey = 'normal_load.total_n'\nvalues = [380, 400, 420]\n",
        text(&parent)
    ));
    let out = study.plan("out");
    succeed(&["sweep", "run", text(&out), "--quiet"]);
    succeed(&["sweep", "collect", text(&out), "--to", "csv", "--quiet"]);
    let runs = fs::read_to_string(out.join("tables/runs.csv")).expect("there is a table");
    assert_eq!(runs.lines().count(), 4, "{runs}");
    // A run of the study is the run that the command makes.
    let log = folder.path().join("one.mcap");
    succeed(&["sweep", "log", text(&out), "3", "--quiet", "--out", text(&log)]);
    let alone = folder.path().join("alone.mcap");
    let from = format!("initial.from={}", text(&parent));
    let sets = ["--set", &from, "--set", "time.duration_s=0.12", "--set", "normal_load.total_n=420"];
    run(&[&SHORT[..], &sets].concat(), &alone);
    assert_eq!(succeed(&["events", text(&log)]), succeed(&["events", text(&alone)]));
    // The end of an unfinished log may move, a time in it does not.
    let partial = folder.path().join("part.mcap.partial");
    let bytes = fs::read(&parent).expect("it is whole");
    fs::write(&partial, &bytes[..bytes.len() * 3 / 4]).expect("the folder can be written");
    let of = |at: &str| {
        let toml = fs::read_to_string(study.path("sweep.toml")).expect("it is there");
        let end = format!("initial.from={}", text(&parent));
        study.write("of.toml", &toml.replace(&end, &format!("initial.from={}{at}", text(&partial))));
        let (plan, out) = (study.path("of.toml"), study.path("of"));
        ["sweep", "plan", text(&plan), "--out", text(&out)].map(str::to_owned)
    };
    let end = of("");
    ends(
        2,
        &end.each_ref().map(String::as_str),
        &[": a study begins at ", "incomplete, ends (accepted: beside it initial.at_s)"],
    );
    let at = of("', 'initial.at_s=0.001");
    succeed(&at.each_ref().map(String::as_str));
    // The plan holds the state: no reader of a study opens the log, whether it changes or is gone.
    let later = study.plan("later");
    fs::remove_file(&parent).expect("it is there");
    let (page, other) = (folder.path().join("page.html"), folder.path().join("other.mcap"));
    for command in [
        vec!["sweep", "status", text(&out)],
        vec!["sweep", "run", text(&out)],
        vec!["sweep", "collect", text(&out)],
        vec!["report", text(&out), "--out", text(&page)],
        vec!["catalogue", text(&out)],
        vec!["sweep", "log", text(&out), "3", "--out", text(&other)],
        vec!["sweep", "run", text(&out), "--verify", "1"],
    ] {
        succeed(&command);
    }
    spin_up("drive.velocity_m_per_s=2.1e-3");
    succeed(&["sweep", "run", text(&later), "--quiet"]);
    succeed(&["sweep", "collect", text(&later), "--to", "csv", "--quiet"]);
    assert_eq!(fs::read_to_string(later.join("tables/runs.csv")).expect("there is a table"), runs);
}

/// A run that was interrupted, killed, cut or salvaged is gone on from where its log ends, without making it again.
#[test]
fn a_branch_of_an_unfinished_log_is_the_rest_of_the_run() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let of = |name: &str, duration: &str| -> Vec<String> {
        let out = path(name);
        let frequent = ["--checkpoint-s", "0.002", "--quiet", "--out", text(&out)];
        let words = [&["run", "default", "--set", duration], &frequent[..]].concat();
        as_coded(&words).into_iter().map(str::to_owned).collect()
    };
    let make = |words: &[String]| succeed(&words.iter().map(String::as_str).collect::<Vec<_>>());
    let [part, longer] = ["time.duration_s=2", "time.duration_s=2.5"];
    make(&of("whole.mcap", longer));
    make(&of("part.mcap", part));
    let bytes = fs::read(path("part.mcap")).expect("it is whole");
    for percent in [30, 60, 90] {
        let cut = &bytes[..bytes.len() * percent / 100];
        fs::write(path(&format!("cut{percent}.mcap.partial")), cut).expect("the folder can be written");
    }
    let mut damaged = bytes.clone();
    // Chunks among the checkpoints.
    damaged[bytes.len() / 2..bytes.len() * 6 / 10].fill(0x55);
    fs::write(path("damaged.mcap"), damaged).expect("the folder can be written");
    succeed(&["salvage", text(&path("damaged.mcap")), "--out", text(&path("salvaged.mcap"))]);
    for (name, signal) in [("interrupted.mcap", "-INT"), ("killed.mcap", "-KILL")] {
        let partial = partial_path(&path(name));
        let mut run = Command::new(env!("CARGO_BIN_EXE_asperity"));
        // So long that it is stopped before it ends, and at a time that is in the whole run.
        let mut run = run.args(of(name, "time.duration_s=500")).spawn().expect("the binary starts");
        while !fs::metadata(&partial).is_ok_and(|file| file.len() > bytes.len() as u64 / 4) {
            std::thread::sleep(Duration::from_millis(1));
        }
        let busy = format!("initial.from={}", text(&partial));
        let busy = ["scenario", "validate", "default", "--set", &busy];
        ends(2, &busy, &["mcap.partial: another process is writing it (accepted: the log of a run"]);
        let sent = Command::new("kill").args([signal, &run.id().to_string()]).status();
        assert!(sent.is_ok() && !run.wait().expect("it ends").success(), "there is a kill");
    }
    // Without the number of the event in its run.
    let rows = |log: &Path, after_s: f64| -> Vec<String> {
        let events = succeed(&["events", text(log)]);
        let cells = events.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let is_later = |onset: &str| onset.parse().is_ok_and(|onset_s: f64| onset_s > after_s);
        let later = cells.filter(|cells| is_later(cells[0]));
        later.map(|cells| [&cells[..7], &cells[8..]].concat().join(",")).collect()
    };
    for name in [
        "cut30.mcap.partial",
        "cut60.mcap.partial",
        "cut90.mcap.partial",
        "salvaged.mcap",
        "interrupted.mcap.partial",
        "killed.mcap.partial",
    ] {
        let (log, branch) = (path(name), path(&format!("of-{name}.mcap")));
        let from = format!("initial.from={}", text(&log));
        let words = ["default", "--set", longer, "--set", &from];
        let said = outcome(&[&["run"], &words[..], &["--out", text(&branch)]].concat()).2;
        let (begins, ends_there) = said
            .split_once("begins at ")
            .and_then(|(_, said)| said.split_once(" s, where "))
            .unwrap_or_else(|| panic!("{name}: {said}"));
        let verdict = if name.starts_with("salvaged") {
            "salvaged with gaps, has its first gap"
        } else {
            "incomplete, ends"
        };
        assert!(ends_there.starts_with(&format!("{}, {verdict}\n", text(&log))), "{said}");
        let begins_s: f64 = begins.parse().expect("it is a time");
        let checked = outcome(&["check", text(&log)]).1 + &outcome(&["check", text(&log)]).2;
        assert!(name.starts_with("salvaged") || checked.contains(&format!("({begins} s)")), "{checked}");
        // What slides at the beginning detaches in the next step there, in an event of its own.
        let [expected, found] = [&path("whole.mcap"), &branch].map(|log| rows(log, begins_s + 1.5e-8));
        assert!(expected.len() > 3, "{name} begins at {begins_s} s");
        assert_eq!(found.len(), expected.len(), "{name}");
        // Forces inside a leap round differently; steps, blocks and times do not.
        let near = |cells: (&str, &str)| {
            let [found, expected] = [cells.0, cells.1].map(|cell| cell.parse::<f64>().unwrap_or(0.0));
            cells.0 == cells.1 || cells.0.contains('.') && (found - expected).abs() < 1e-12 * expected
        };
        for (found, expected) in found.iter().zip(&expected) {
            assert!(found.split(',').zip(expected.split(',')).all(near), "{name}: {found}, not {expected}");
        }
        // The log holds the state.
        fs::remove_file(&log).expect("it is there");
        assert!(succeed(&["check", "--again", text(&branch)]).contains(": whole: "));
    }
}
