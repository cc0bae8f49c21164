//! Long runs of a study keep their unfinished logs and are resumed; failed runs keep their logs
//! where the sweep requires it.

use std::collections::BTreeMap;
use std::fs;
#[cfg(unix)]
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use asperity_files::LockedFile;
use asperity_runlog::partial_path;

use crate::support::binary::{ends, names, rows, run, succeed, text, with_sets};
use crate::sweep::{self, Study, sweep, tables};

const LONG: &str = "
title = 'A run that is interrupted'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=30', 'time.duration_s=1']
[[axis]]
key = 'normal_load.tilt'
values = [-0.4, 0.3]
";

/// Has all runs of a study keep their unfinished logs from the beginning, with a checkpoint after
/// every record.
const AT_ONCE: [&str; 2] = ["--patience-s", "0"];

fn staged(out: &Path) -> Vec<String> {
    let staging = out.join("staging");
    if staging.exists() { names(&staging).into_iter().collect() } else { Vec::new() }
}

fn begun(out: &Path, run: u64) -> PathBuf {
    partial_path(&out.join(format!("staging/{run}.mcap")))
}

/// Runs a study, which succeeds; returns the runs that were resumed.
fn go_on(out: &Path, more: &[&str]) -> Vec<u64> {
    let (code, _, err) = sweep(&[&["run", text(out)], more].concat());
    assert_eq!(code, 0, "{err}");
    let run = |line: &str| line.strip_prefix("run ")?.split(',').next()?.parse().ok();
    err.lines().filter(|line| line.contains(": resumes from ")).filter_map(run).collect()
}

#[test]
fn a_run_that_goes_on_gives_what_an_unbroken_one_gives() {
    break_off(&[0.0, 0.2, 0.9]);
}

#[test]
#[ignore = "half a minute of runs: cargo xtask nightly"]
fn wherever_a_run_breaks_off_it_goes_on_and_gives_what_an_unbroken_one_gives() {
    break_off(&[0.0, 0.01, 0.2, 0.5, 0.7, 0.9, 0.999, 1.0]);
}

/// Whatever the progress of a run, and however much of its end is lost.
fn break_off(shares: &[f64]) {
    let study = Study::of(LONG);
    let whole = study.plan("whole");
    assert_eq!(go_on(&whole, &[]), [0; 0]);
    // Short runs leave no staged files, even with a log.
    assert_eq!(staged(&whole), [""; 0]);
    let expected = tables(&whole);
    let log = study.path("log.mcap");
    let sets = ["slider.blocks=30", "time.duration_s=1", "normal_load.tilt=0.3"];
    succeed(&with_sets(&["run", "default", "--checkpoint-s", "0", "--out", text(&log)], &sets));
    let bytes = fs::read(&log).expect("it was just written");
    for (n, &share) in shares.iter().enumerate() {
        let out = study.plan(&format!("cut {n}"));
        fs::create_dir(out.join("staging")).expect("the folder can be written");
        let length = (bytes.len() as f64 * share) as usize;
        fs::write(begun(&out, 2), &bytes[..length]).expect("the folder can be written");
        let (code, status, _) = sweep(&["status", text(&out)]);
        assert!(code == 3 && status.contains("\nbegun: 2, with "), "{status}");
        let more: &[&str] = if n % 2 == 0 { &AT_ONCE } else { &[] };
        let goes_on = (0.1..1.0).contains(&share);
        assert!(!goes_on || go_on(&out, more) == [2], "{share}");
        succeed(&["sweep", "run", text(&out)]);
        assert!(tables(&out) == expected, "{share}: other tables");
        assert_eq!(staged(&out), [""; 0], "{share}");
    }
    // As if the process died between the result and its cleanup.
    fs::write(begun(&whole, 2), &bytes[..bytes.len() / 2]).expect("the folder can be written");
    assert!(!sweep(&["status", text(&whole)]).1.contains("begun"));
    assert_eq!(go_on(&whole, &[]), [0; 0]);
    assert_eq!(staged(&whole), [""; 0]);
    // A run does not resume from the log of another.
    let other = study.plan("other");
    fs::create_dir(other.join("staging")).expect("the folder can be written");
    fs::write(begun(&other, 1), &bytes[..bytes.len() / 2]).expect("the folder can be written");
    assert_eq!(go_on(&other, &[]), [0; 0]);
    assert!(tables(&other) == expected, "other tables");
    // A file that is no log belongs to somebody else.
    let foreign = study.plan("foreign");
    fs::create_dir(foreign.join("staging")).expect("the folder can be written");
    fs::write(begun(&foreign, 1), "my notes").expect("the folder can be written");
    let (code, _, err) = sweep(&["run", text(&foreign)]);
    assert!(code == 1 && err.contains("1.mcap.partial"), "{code} {err}");
    assert_eq!(fs::read_to_string(begun(&foreign, 1)).expect("it is there"), "my notes");
}

fn start(out: &Path, more: &[&str]) -> Child {
    sweep::start(&[&["run", text(out)], more].concat())
}

fn wait_for(what: &str, has_come: impl Fn() -> bool) {
    let deadline = Instant::now() + Duration::from_secs(120);
    while !has_come() {
        assert!(Instant::now() < deadline, "no {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

#[cfg(unix)]
fn terminate(child: &mut Child) -> Option<i32> {
    let killed = Command::new("kill").arg(child.id().to_string()).status().expect("kill is there");
    assert!(killed.success());
    child.wait().expect("it is ours").code()
}

/// It needs minutes, longer than the whole test.
const ENDLESS: &str = "
title = 'A run that does not end'
scenario = 'default'
set = ['parameter_set=as-coded', 'time.duration_s=500']
[[axis]]
key = 'slider.blocks'
values = [400]
";

#[test]
#[cfg(unix)]
fn a_long_run_is_kept_when_it_is_told_to_stop_and_a_short_one_is_not() {
    let study = Study::of(ENDLESS);
    let [short, long] = ["short", "long"].map(|name| study.plan(name));
    let mut child = start(&short, &[]);
    wait_for("run", || short.join("staging").exists());
    assert_eq!(terminate(&mut child), Some(143));
    assert_eq!(staged(&short), [""; 0]);
    // The file with that name, once it has contents.
    let log = || {
        let file = fs::metadata(begun(&long, 1)).ok()?;
        (file.len() > 0).then(|| file.ino())
    };
    for times in 0..2 {
        let before = log();
        assert_eq!(before.is_some(), times > 0);
        let mut child = start(&long, &AT_ONCE);
        // A resumed run writes another file, which replaces the first.
        wait_for("log", || log().is_some() && log() != before);
        // Nobody else makes it meanwhile.
        let (code, _, err) = sweep(&[&["run", text(&long)], &AT_ONCE[..]].concat());
        assert!(code == 3 && err.contains("another process, which is making it"), "{code} {err}");
        assert_eq!(terminate(&mut child), Some(143));
        let (code, status, _) = sweep(&["status", text(&long)]);
        assert!(code == 3 && status.contains("missing: 1\nbegun: 1, with "), "{status}");
    }
    ends(3, &["check", text(&begun(&long, 1))], &[]);
}

/// Two processes begin the same runs at once, in any order.
#[test]
fn two_that_make_the_same_runs_do_not_disturb_each_other() {
    let study = Study::of(LONG);
    let [whole, out] = ["whole", "both"].map(|name| study.plan(name));
    succeed(&["sweep", "run", text(&whole)]);
    let both = [0, 1].map(|_| start(&out, &AT_ONCE));
    for mut child in both {
        let code = child.wait().expect("it is ours").code();
        assert!(matches!(code, Some(0 | 3)), "{code:?}");
    }
    assert_eq!(go_on(&out, &[]), [0; 0]);
    assert!(tables(&out) == tables(&whole), "other tables");
    assert_eq!(staged(&out), [""; 0]);
}

const FAILING: &str = "
title = 'Time steps'
scenario = 'rigid-contacts'
set = ['slider.blocks=24', 'time.duration_s=2']
keep = [KEEP]
[[axis]]
key = 'time.step_s'
values = [2e-7, 2.5e-6]
";

#[test]
fn logs_are_kept_of_runs_that_fail_or_of_all() {
    let mut seen: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    for (keep, kept, at_once) in [
        ("'log-of-failed'", &["2.mcap"][..], &[false, true][..]),
        ("'log'", &["1.mcap", "2.mcap"], &[true]),
        ("'summary'", &[], &[false]),
    ] {
        for more in at_once.iter().map(|&at_once| if at_once { &AT_ONCE[..] } else { &[] }) {
            let study = Study::of(&FAILING.replace("KEEP", keep));
            let out = study.plan("study");
            let (code, _, err) = sweep(&[&["run", text(&out)], more].concat());
            assert!(code == 1 && err.contains("run 2, time.step_s=2.5e-6: in step "), "{code} {err}");
            let logs = out.join("logs");
            let logs: Vec<String> =
                if logs.exists() { names(&logs).into_iter().collect() } else { Vec::new() };
            assert_eq!(logs, kept, "{keep} {more:?}");
            assert_eq!(staged(&out), [""; 0]);
            for log in logs {
                // Stopped, and whole.
                let code = if log == "2.mcap" { 7 } else { 0 };
                ends(code, &["check", text(&out.join("logs").join(&log))], &[]);
            }
            let (code, ..) = sweep(&["collect", text(&out), "--to", "csv"]);
            assert_eq!(code, 1);
            let table = fs::read(out.join("tables/runs.csv")).expect("there is a table");
            assert_eq!(rows(&table)[1]["status"], "failed");
            let first = seen.entry("runs.csv".to_owned()).or_insert_with(|| table.clone());
            assert_eq!(String::from_utf8_lossy(&table), String::from_utf8_lossy(first), "{keep} {more:?}");
        }
    }
}

#[test]
fn what_is_missing_is_named_as_arrays_of_a_batch_system() {
    let study = Study::of(&LONG.replace("[-0.4, 0.3]", "[-0.4, -0.3, -0.2, -0.1, 0, 0.1, 0.2]"));
    let out = study.plan("study");
    let of = |more: &[&str]| sweep(&[&["status", text(&out), "--tasks"], more].concat());
    assert_eq!(of(&["7"]), (3, "0 1-7 1-7\n".to_owned(), String::new()));
    assert_eq!(of(&["7", "--array-size", "4"]).1, "0 1-3 1-3\n3 1-3 4-6\n6 1 7\n");
    succeed(&["sweep", "run", text(&out), "--index", "2,4-5"]);
    assert_eq!(of(&["7", "--array-size", "4"]).1, "0 1,3 1,3\n3 3 6\n6 1 7\n");
    assert_eq!(of(&["3"]).1, "0 1,3 1,3\n");
    succeed(&["sweep", "run", text(&out)]);
    assert_eq!(of(&["7"]), (0, String::new(), String::new()));
    for (more, problem) in [(&["0"][..], "0"), (&["3", "--array-size", "1"], "1")] {
        let (code, _, err) = of(more);
        assert!(code == 2 && err.contains(problem) && err.contains("not in "), "{err}");
    }
}

/// Runs of a second and more, so that the test can interfere with them.
const LONGER: &str = "
title = 'Two processes at one run'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=60', 'time.duration_s=8']
[[axis]]
key = 'normal_load.tilt'
values = [-0.4, 0.3]
";

/// Puts the results of a complete study into another folder of the same plan.
fn give_results(from: &Path, to: &Path) {
    let (from, to) = (from.join("segments"), to.join("segments"));
    fs::create_dir_all(&to).expect("the folder can be written");
    for entry in fs::read_dir(&from).expect("it has results") {
        let entry = entry.expect("it can be read");
        fs::copy(entry.path(), to.join(entry.file_name())).expect("the folder can be written");
    }
}

/// A command that is stopped leaves the unfinished log for the next one; of a run that another process
/// has made meanwhile there is no next one, and the log stayed in a complete study.
#[test]
#[cfg(unix)]
fn what_is_stopped_leaves_nothing_of_a_run_that_is_done() {
    let study = Study::of(LONGER);
    let [whole, out] = ["whole", "out"].map(|name| study.plan(name));
    go_on(&whole, &[]);
    let mut running = start(&out, &[&AT_ONCE[..], &["--index", "1"]].concat());
    wait_for("unfinished log", || begun(&out, 1).exists());
    give_results(&whole, &out);
    assert_eq!(terminate(&mut running), Some(143));
    assert_eq!(staged(&out), [""; 0]);
    assert_eq!(sweep(&["status", text(&out)]).0, 0);
}

/// Files that another process has locked at the start are cleared at the end, if they are free by then;
/// likewise complete logs that were not moved to their final place.
#[test]
fn logs_of_runs_that_are_done_are_cleared_at_the_end() {
    let study = Study::of(LONGER);
    let [whole, out] = ["whole", "out"].map(|name| study.plan(name));
    go_on(&whole, &["--index", "1"]);
    give_results(&whole, &out);
    let log = study.path("log.mcap");
    run(&with_sets(&["default"], &["slider.blocks=5", "time.duration_s=0.01"]), &log);
    fs::create_dir(out.join("staging")).expect("the folder can be written");
    fs::copy(&log, begun(&out, 1)).expect("the folder can be written");
    fs::copy(&log, out.join("staging/1.mcap")).expect("the folder can be written");
    let held = LockedFile::open(&begun(&out, 1)).expect("nobody has it").expect("it is there");
    let mut child = start(&out, &AT_ONCE);
    wait_for("unfinished log", || begun(&out, 2).exists());
    assert!(begun(&out, 1).exists());
    drop(held);
    assert!(child.wait().expect("it is ours").success());
    assert_eq!(staged(&out), [""; 0]);
}
