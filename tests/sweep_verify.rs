//! Runs of a study that are made a second time: a node that computes wrongly is found and named, and nothing
//! else changes.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
#[cfg(target_os = "linux")]
use std::{
    thread,
    time::{Duration, Instant},
};

use asperity_study::Plan;
use asperity_study::segment::{node_of, this_node};

use crate::laws::frames::{Frame, Segment};
use crate::support::binary::{succeed, text};
use crate::sweep::{SHORT, Study, results, sweep, tables};
#[cfg(target_os = "linux")]
use crate::sweep::{kill, start};

/// A thousand short runs.
fn thousand(stiffness_n_per_m: f64) -> String {
    format!(
        "
title = 'A thousand runs'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=5', 'time.duration_s=0.6',
       'drive.stiffness_n_per_m={stiffness_n_per_m:?}']
[[axis]]
key = 'normal_load.tilt'
from = -0.6
to = 0.6
count = 25
[[axis]]
key = 'friction.static_coefficient'
from = 0.5
to = 0.6
count = 40
"
    )
}

fn segments(study: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(study.join("segments")).expect("there are segments");
    entries.map(|entry| entry.expect("the folder can be read").path()).collect()
}

/// Makes the segments of this node those of another one.
fn give_to_node(study: &Path, node: &str) {
    for path in segments(study).into_iter().filter(|path| node_of(path) == this_node()) {
        let name = path.file_name().expect("it has a name").to_string_lossy().replacen(&this_node(), node, 1);
        fs::rename(&path, path.with_file_name(name)).expect("the folder can be written");
    }
}

/// The runs that have two results; none has more.
fn twice(study: &Path) -> BTreeSet<u64> {
    let results = results(study);
    assert!(results.values().all(|count| *count <= 2), "{results:?}");
    results.into_iter().filter(|(_, count)| *count == 2).map(|(run, _)| run).collect()
}

/// The standard output of a verification, and its exit code.
fn verify(study: &Path, arguments: &[&str]) -> (i32, String) {
    let (code, out, err) = sweep(&[&["run", text(study)], arguments].concat());
    assert_eq!(err, "");
    (code, out)
}

/// Of a thousand runs a quarter is by a node on which the last bit of a stiffness is flipped. All numbers of
/// its results are possible, and those of a real run.
#[test]
fn a_lying_node_is_found_by_a_twentieth_of_a_thousand_runs() {
    let honest = 8e5_f64;
    let lying = f64::from_bits(honest.to_bits() + 1);
    let study = Study::of(&thousand(honest));
    let [whole, out] = ["whole", "out"].map(|name| study.plan(name));
    let other = Study::of(&thousand(lying));
    let liar = other.plan("liar");
    for (folder, part) in [(&whole, "1/1"), (&out, "2/4"), (&out, "3/4"), (&out, "4/4"), (&liar, "1/4")] {
        succeed(&["sweep", "run", text(folder), "--chunk", part]);
    }
    give_to_node(&out, "node-9");
    // The liar's results, under the plan and the ids that it was given.
    let plan = Plan::read(&out).expect("it is a plan");
    let plan_text = fs::read_to_string(out.join("plan.ndjson")).expect("it is a plan");
    let contents = |study: &Path| -> BTreeMap<u64, String> {
        let read = |path: PathBuf| Segment::read(&fs::read(path).expect("it can be read"));
        let frames = segments(study).into_iter().flat_map(|path| read(path).frames);
        let outcome = |text: String| text.split_once("\"outcome\"").expect("it has one").1.to_owned();
        frames.map(|frame| (frame.run, outcome(frame.text()))).collect()
    };
    let (right, made_by_liar) = (contents(&whole), contents(&liar));
    let lies: BTreeSet<u64> =
        made_by_liar.into_iter().filter(|(run, text)| right[run] != *text).map(|(run, _)| run).collect();
    assert!(lies.len() >= 200, "most of 250 results are wrong: {}", lies.len());
    for (n, path) in segments(&liar).iter().enumerate() {
        let mut segment = Segment::read(&fs::read(path).expect("it can be read")).of_plan(&plan_text);
        for frame in &mut segment.frames {
            let id = plan.rows[frame.run as usize - 1].id.as_deref().expect("it has an id");
            let text = frame.text();
            let (before, behind) = text.split_once("\"id\":\"").expect("it has an id");
            let text = format!("{before}\"id\":\"{id}{}", &behind[id.len()..]);
            *frame = Frame::done(frame.run, text.as_bytes());
        }
        let name = format!("segments/node-7-{n}-1.seg");
        fs::write(out.join(name), segment.bytes()).expect("the folder can be written");
    }
    assert_eq!(sweep(&["status", text(&out)]).0, 0, "nobody notices");

    let (code, told) = verify(&out, &["--verify", "5%"]);
    assert_eq!(code, 1, "{told}");
    let (chosen, here) = (twice(&out), this_node());
    assert_eq!(chosen.len(), 50, "both results are kept");
    let lies = chosen.intersection(&lies).count();
    let pair = |other: &str| {
        if *other < *here { format!("{other} and {here}") } else { format!("{here} and {other}") }
    };
    let verified = format!("{} of 50 chosen runs verified: ", 50 - lies);
    let contradicted = format!("\n{lies} contradicted: {lies} on {}\n", pair("node-7"));
    assert!(lies > 0 && told.starts_with(&verified) && told.contains(&contradicted), "{lies}: {told}");
    assert!(told.contains(&format!(" on {}", pair("node-9"))), "{told}");
    let named = |line: &&str| {
        ["has two results that differ: ", "segments/node-7-", &format!("segments/{here}-")]
            .into_iter()
            .all(|part| line.contains(part))
    };
    assert_eq!(told.lines().filter(named).count(), lies, "{told}");
    assert_eq!(verify(&out, &["--verify", "5%"]), (1, told), "no run is made a third time");
    let (code, _, err) = sweep(&["collect", text(&out)]);
    assert!(code == 1 && err.contains("two results that differ"), "{code} {err}");
    assert!(!out.join("tables/runs.csv").exists() && !out.join("tables/runs.parquet").exists());

    // The recommended remedy.
    for path in segments(&out) {
        if node_of(&path) == "node-7" {
            fs::remove_file(path).expect("it is there");
        }
    }
    succeed(&["sweep", "run", text(&out)]);
    let before = results(&out);
    let (code, told) = verify(&out, &["--verify", "5%"]);
    let left = format!("\n{lies} to be made a second time on another node than {here}\n");
    assert!(code == 3 && told.ends_with(&left) && before == results(&out), "{code} {told}");
    give_to_node(&out, "node-8");
    let (code, told) = verify(&out, &["--verify", "5%"]);
    assert!(code == 0 && told.starts_with("50 of 50 chosen runs verified: "), "{code} {told}");
    assert!(tables(&out) == tables(&whole), "other tables");
}

/// Every call chooses the same runs, and a larger sample contains the smaller one.
#[test]
fn verified_runs_change_no_table_and_are_not_made_a_third_time() {
    let study = Study::of(&format!("keep = ['events', 'ruptures', 'log']\n{SHORT}"));
    let out = study.plan("study");
    let here = this_node();
    let missing = "0 of 3 chosen runs verified\n3 without a first result\n".to_owned();
    assert_eq!(verify(&out, &["--verify", "50%"]), (3, missing), "missing runs are not made");
    assert!(results(&out).is_empty());
    succeed(&["sweep", "run", text(&out)]);
    let logs = || {
        let entries = fs::read_dir(out.join("logs")).expect("there are logs");
        let paths = entries.map(|entry| entry.expect("the folder can be read").path());
        let written = |path: &PathBuf| path.metadata().and_then(|file| file.modified()).expect("it is there");
        paths.map(|path| (path.clone(), written(&path))).collect::<BTreeMap<_, _>>()
    };
    let (made, kept) = (tables(&out), logs());
    let verified = |count: usize| {
        let words = if count == 1 { "chosen run" } else { "chosen runs" };
        (0, format!("{count} of {count} {words} verified: {count} on {here} alone\n"))
    };
    assert_eq!(verify(&out, &["--verify", "1"]), verified(1));
    let first = twice(&out);
    // As if it was killed before the other two.
    assert_eq!(verify(&out, &["--verify", "3"]), verified(3));
    let three = twice(&out);
    assert!(three.len() == 3 && three.is_superset(&first), "{first:?} {three:?}");
    assert_eq!(verify(&out, &["--verify", "50%"]), verified(3));
    assert_eq!(twice(&out), three);
    // Each part is made by the task of another part.
    let mut runs = three.clone();
    for (part, expected) in [("1/2", [2, 4, 6]), ("2/2", [1, 3, 5])] {
        assert_eq!(verify(&out, &["--verify", "100%", "--chunk", part]), verified(3));
        runs.extend(expected);
        assert_eq!(twice(&out), runs);
    }
    let (_, status, _) = sweep(&["status", text(&out), "--verify", "6"]);
    assert_eq!(status, format!("6 of 6 runs done\n{}", verified(6).1));
    assert!(tables(&out) == made, "other tables");
    assert_eq!(logs(), kept, "no log is replaced");
    assert_eq!(fs::read_dir(out.join("staging")).expect("it is there").count(), 0);

    // Results of one other node are verified once more, on this one.
    give_to_node(&out, "node-9");
    let mut pair = ["node-9", &here];
    pair.sort_unstable();
    let [a, b] = pair;
    let expected = format!("3 of 3 chosen runs verified: 3 on {a} and {b}\n");
    assert_eq!(verify(&out, &["--verify", "3"]), (0, expected.clone()));
    assert_eq!(verify(&out, &["--verify", "3"]), (0, expected));
    assert_eq!(results(&out).values().sum::<usize>(), 15);
    assert!(tables(&out) == made, "other tables");
}

/// A verification that is killed is continued by the next one. How far it had come depends on the clock; the
/// assertions do not.
#[test]
#[cfg(target_os = "linux")]
fn a_killed_verification_is_continued() {
    let study = Study::of(SHORT);
    let out = study.plan("study");
    succeed(&["sweep", "run", text(&out)]);
    let made = tables(&out);
    let all = ["--verify", "100%", "--jobs", "2"];
    let mut child = start(&[&["run", text(&out)], &all[..]].concat());
    let begun = Instant::now();
    while results(&out).values().all(|count| *count == 1) && begun.elapsed() < Duration::from_secs(60) {
        thread::sleep(Duration::from_millis(1));
    }
    kill(child.id());
    child.wait().expect("it is ours");
    let expected = format!("6 of 6 chosen runs verified: 6 on {} alone\n", this_node());
    assert_eq!(verify(&out, &all), (0, expected));
    assert_eq!(twice(&out), (1..=6).collect());
    assert!(tables(&out) == made, "other tables");
}

#[test]
fn numbers_of_runs_that_no_study_has_are_refused() {
    let study = Study::of(SHORT);
    let out = study.plan("study");
    let form = "accepted: a number of runs, from 1; or a share of them, above 0% and up to 100%, as in 5%";
    for (number, problem) in [
        ("x", form),
        ("0", form),
        ("0%", form),
        ("101%", form),
        ("NaN%", form),
        ("7", "--verify 7 (accepted: 1 to 6, the runs over axes)"),
    ] {
        for command in [&["run"][..], &["status"], &["emit", "slurm"]] {
            let (code, _, err) = sweep(&[command, &[text(&out), "--verify", number]].concat());
            assert!(code == 2 && err.contains(problem) && err.contains(number), "{number}: {err}");
        }
    }
    let (code, _, err) = sweep(&["emit", "list", text(&out), "--verify", "5%"]);
    assert!(code == 2 && err.contains("--verify 5% (accepted: with slurm)"), "{err}");
}
