//! Parameter studies: the results depend only on the plan, however often workers and their coordinators are
//! killed, and however the runs are divided.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use asperity_testkit::Random;

use crate::support::binary::{asperity, run, succeed, text};

/// A folder with a sweep in it.
pub(crate) struct Study {
    folder: tempfile::TempDir,
}

pub(crate) const SHORT: &str = "
title = 'Short runs'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=1']
[[axis]]
key = 'normal_load.tilt'
values = [-0.5, 0, 0.5]
[[axis]]
keys = ['friction.static_coefficient', 'friction.dynamic_coefficient']
rows = [[0.5, 0.3], [0.7, 0.45]]
";

impl Study {
    pub(crate) fn of(sweep: &str) -> Study {
        let study = Study { folder: asperity_testkit::folder() };
        fs::write(study.path("sweep.toml"), sweep).expect("the folder can be written");
        study
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn plan(&self, name: &str) -> PathBuf {
        let out = self.path(name);
        succeed(&["sweep", "plan", text(&self.path("sweep.toml")), "--out", text(&out)]);
        out
    }
}

/// The bytes of all tables of a study.
pub(crate) fn tables(study: &Path) -> BTreeMap<String, Vec<u8>> {
    let formats = if cfg!(feature = "analysis") { "parquet,csv" } else { "csv" };
    succeed(&["sweep", "collect", text(study), "--to", formats]);
    let entries = fs::read_dir(study.join("tables")).expect("there are tables");
    entries
        .map(|entry| {
            let path = entry.expect("the folder can be read").path();
            let name = path.file_name().expect("a file has a name").to_string_lossy().into_owned();
            (name, fs::read(path).expect("the table can be read"))
        })
        .collect()
}

/// The rows of a CSV file, by the names of its columns.
pub(crate) fn rows(csv: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_reader(csv);
    reader.deserialize().map(|row| row.expect("it is CSV")).collect()
}

pub(crate) fn sweep(arguments: &[&str]) -> (i32, String, String) {
    let output = asperity(&[&["sweep"], arguments].concat());
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), words(&output.stdout), words(&output.stderr))
}

/// A study has the same results for a run as the run itself.
#[test]
fn tables_of_a_study_are_those_of_its_runs() {
    let study = Study::of(SHORT);
    let out = study.plan("study");
    assert_eq!(sweep(&["status", text(&out)]).0, 3);
    succeed(&["sweep", "run", text(&out)]);
    assert_eq!(sweep(&["status", text(&out)]), (0, "6 of 6 runs done\n".to_owned(), String::new()));
    let tables = tables(&out);
    let all = rows(&tables["runs.csv"]);
    let events = rows(&tables["events.csv"]);
    assert_eq!(all.len(), 6);
    let log = study.path("one.mcap");
    run(
        &[
            "default",
            "--set",
            "slider.blocks=20",
            "--set",
            "time.step_s=1e-7",
            "--set",
            "time.duration_s=1",
            "--set",
            "normal_load.tilt=0.5",
            "--set",
            "friction.static_coefficient=0.5",
            "--set",
            "friction.dynamic_coefficient=0.3",
        ],
        &log,
    );
    let row = &all[4];
    assert_eq!((&*row["run"], &*row["normal_load.tilt"], &*row["status"]), ("5", "0.5", "done"));
    let summary = rows(succeed(&["summary", text(&log), "--format", "csv"]).as_bytes()).remove(0);
    let mut compared = 0;
    for (key, expected) in summary.iter().filter(|(key, _)| !["run", "status"].contains(&key.as_str())) {
        let number = |text: &str| text.parse::<f64>().ok();
        let found = &row[key];
        let same = found == expected || number(found).is_some() && number(found) == number(expected);
        assert!(same, "{key}: {found}, and the log has {expected}");
        compared += usize::from(!expected.is_empty());
    }
    assert!(compared > 40, "{compared}");
    let of_log = rows(succeed(&["events", text(&log), "--format", "csv"]).as_bytes());
    let of_study: Vec<_> = events.iter().filter(|event| event["run"] == "5").collect();
    assert!(of_log.len() > 5, "{}", of_log.len());
    assert_eq!(of_log.len(), of_study.len());
    for (expected, found) in of_log.iter().zip(of_study) {
        for column in ["onset_s", "end_s", "last_block", "ft_fn_onset"] {
            let [expected, found] = [expected, found].map(|row| row[column].parse::<f64>().ok());
            assert_eq!(expected, found, "{column}");
        }
    }
}

/// The processes that a process has started.
#[cfg(target_os = "linux")]
pub(crate) fn children(parent: u32) -> Vec<u32> {
    let of = |task: PathBuf| fs::read_to_string(task.join("children")).unwrap_or_default();
    let tasks = fs::read_dir(format!("/proc/{parent}/task")).into_iter().flatten().flatten();
    let lists: Vec<String> = tasks.map(|task| of(task.path())).collect();
    lists.iter().flat_map(|list| list.split_whitespace()).filter_map(|id| id.parse().ok()).collect()
}

#[cfg(target_os = "linux")]
pub(crate) fn kill(process: u32) {
    // It may be over already.
    let killed = Command::new("kill").args(["-9", &process.to_string()]).stderr(Stdio::null()).status();
    killed.expect("kill is there");
}

pub(crate) fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_asperity"))
        .args(["--quiet", "sweep"])
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts")
}

/// Bytes of all segments of a study.
#[cfg(target_os = "linux")]
fn bytes_of_segments(study: &Path) -> u64 {
    let segments = fs::read_dir(study.join("segments")).into_iter().flatten().flatten();
    segments.filter_map(|segment| segment.metadata().ok()).map(|file| file.len()).sum()
}

/// The contents of segments, by the format in the manual: the kind of each complete result (1 done, 3
/// process died), and its run.
fn frames(study: &Path) -> Vec<(u8, u64)> {
    let mut frames = Vec::new();
    for segment in fs::read_dir(study.join("segments")).into_iter().flatten() {
        let bytes = fs::read(segment.expect("the folder can be read").path()).expect("it can be read");
        let mut at = bytes.iter().position(|byte| *byte == b'\n').map_or(bytes.len(), |end| end + 1);
        while let Some(head) = bytes.get(at..at + 17) {
            let run = u64::from_le_bytes(head[1..9].try_into().expect("there are eight"));
            let length = u32::from_le_bytes(head[9..13].try_into().expect("there are four")) as usize;
            at += 17 + length;
            if at <= bytes.len() {
                frames.push((head[0], run));
            }
        }
    }
    frames
}

/// How often each run has a result of a kind.
fn counts(frames: &[(u8, u64)], kind: u8) -> BTreeMap<u64, usize> {
    let mut counts = BTreeMap::new();
    frames.iter().filter(|frame| frame.0 == kind).for_each(|frame| *counts.entry(frame.1).or_default() += 1);
    counts
}

/// How many whole results there are of each run that is done.
pub(crate) fn results(study: &Path) -> BTreeMap<u64, usize> {
    counts(&frames(study), 1)
}

/// Whether the next death of a run would be its last: a slow run may be hit repeatedly.
#[cfg(target_os = "linux")]
fn has_one_that_died_twice(study: &Path) -> bool {
    let frames = frames(study);
    let done = counts(&frames, 1);
    counts(&frames, 3).iter().any(|(run, deaths)| *deaths >= 2 && !done.contains_key(run))
}

/// The step at which a run is killed depends on the clock; the assertions do not.
#[test]
#[cfg(target_os = "linux")]
fn killed_thirty_times_a_study_gives_the_same_tables() {
    const RUNS: usize = 80;
    let text_of = "
title = 'Runs to be killed'
scenario = 'default'
set = ['slider.blocks=30', 'time.duration_s=0.5']
[[axis]]
key = 'normal_load.tilt'
from = -0.6
to = 0.6
count = 40
[[axis]]
key = 'parameter_set'
values = ['as-coded', 'as-stated']
";
    let study = Study::of(text_of);
    let whole = study.plan("whole");
    succeed(&["sweep", "run", text(&whole)]);
    let expected = tables(&whole);
    let mut random = Random::new(11);
    let mut any = |below| random.below(below);
    let (mut kills, mut studies) = (0, 0);
    while kills < 30 {
        // If one finishes before enough kills, another follows.
        studies += 1;
        let killed = study.plan(&format!("killed-{studies}"));
        let mut before = 0;
        while kills < 30 {
            let workers_are_spared = has_one_that_died_twice(&killed);
            let mut parent = start(&["run", text(&killed)]);
            let mut workers = Vec::new();
            let mut grows_by = |results: u64, parent: &mut Child| {
                // About as many: results differ in length.
                let enough = bytes_of_segments(&killed) + results * 1500;
                while bytes_of_segments(&killed) < enough && parent.try_wait().expect("it is ours").is_none()
                {
                    workers.extend(children(parent.id()));
                    thread::sleep(Duration::from_millis(1));
                }
                workers.extend(children(parent.id()));
                children(parent.id())
            };
            // At once, with some runs done, or after one worker is gone. No run may lose its worker three
            // times: it would be left out.
            let kind = any(3);
            let begun = grows_by([0, 1, 3][kind as usize], &mut parent);
            if kind == 2 && !begun.is_empty() && !workers_are_spared {
                kill(begun[any(begun.len() as u64) as usize]);
                kills += 1;
                grows_by(any(3), &mut parent);
            }
            thread::sleep(Duration::from_millis(any(20)));
            workers.extend(children(parent.id()));
            let is_over = parent.try_wait().expect("it is ours").is_some();
            if !is_over {
                kill(parent.id());
                kills += 1;
            }
            parent.wait().expect("it is ours");
            // Workers that have lost their leader end with the run that they are at.
            let deadline = Instant::now() + Duration::from_secs(60);
            while workers.iter().any(|worker| Path::new(&format!("/proc/{worker}/exe")).exists()) {
                assert!(Instant::now() < deadline, "a worker goes on without its leader");
                thread::sleep(Duration::from_millis(5));
            }
            let (_, status, _) = sweep(&["status", text(&killed)]);
            let done: usize = status.split(' ').next().and_then(|n| n.parse().ok()).expect("it counts them");
            assert!(done >= before, "{status}");
            assert_eq!(results(&killed).len(), done, "{status}");
            before = done;
            if is_over {
                break;
            }
        }
        succeed(&["sweep", "run", text(&killed)]);
        assert!(tables(&killed) == expected, "other tables");
        // Completed runs were not repeated.
        assert_eq!(results(&killed), (1..=RUNS as u64).map(|run| (run, 1)).collect());
        let bytes = bytes_of_segments(&killed);
        succeed(&["sweep", "run", text(&killed)]);
        assert_eq!(bytes_of_segments(&killed), bytes);
    }
}

#[test]
fn parts_made_at_once_give_the_same_tables() {
    let study = Study::of(SHORT);
    let [whole, parts] = ["whole", "parts"].map(|name| study.plan(name));
    succeed(&["sweep", "run", text(&whole), "--jobs", "1"]);
    let running: Vec<Child> = ["1/3", "2/3", "3/3"]
        .map(|chunk| start(&["run", text(&parts), "--chunk", chunk, "--jobs", "1"]))
        .into();
    for mut child in running {
        assert!(child.wait().expect("it is ours").success());
    }
    assert!(tables(&parts) == tables(&whole), "other tables");
    // One by one, and one of them twice.
    let single = study.plan("single");
    for index in ["6", "1-2", "4", "3-5", "1"] {
        succeed(&["sweep", "run", text(&single), "--index", index]);
    }
    assert!(tables(&single) == tables(&whole), "other tables");
    // A torn end costs the run that it was of.
    let segment = fs::read_dir(single.join("segments")).expect("it is there").next();
    let segment = segment.expect("there is one").expect("it can be read").path();
    let bytes = fs::read(&segment).expect("it can be read");
    fs::write(&segment, &bytes[..bytes.len() - 3]).expect("it can be written");
    let (code, status, _) = sweep(&["status", text(&single)]);
    assert_eq!(code, 3, "{status}");
    assert!(
        status.contains("5 of 6 runs done, 1 missing") && status.contains("an incomplete result"),
        "{status}"
    );
    succeed(&["sweep", "run", text(&single)]);
    assert!(tables(&single) == tables(&whole), "other tables");
}

/// A run that crashes its process is tried three times.
#[test]
#[cfg(target_os = "linux")]
fn a_run_whose_process_dies_again_and_again_is_left_out() {
    let study = Study::of(
        "
title = 'A run that kills'
scenario = 'default'
[[axis]]
keys = ['slider.blocks', 'time.duration_s']
rows = [[10, 0.1], [400, 50.0]]
",
    );
    let out = study.plan("study");
    succeed(&["sweep", "run", text(&out), "--index", "1"]);
    let mut parent = start(&["run", text(&out)]);
    let deadline = Instant::now() + Duration::from_secs(120);
    while parent.try_wait().expect("it is ours").is_none() {
        assert!(Instant::now() < deadline, "it goes on for ever");
        children(parent.id()).into_iter().for_each(kill);
        thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(parent.wait().expect("it is ours").code(), Some(1));
    let (code, status, _) = sweep(&["status", text(&out)]);
    assert_eq!(code, 1, "{status}");
    assert_eq!(status, "1 of 2 runs done, 1 quarantined\nquarantined: 2\n");
    let (code, _, err) = sweep(&["collect", text(&out), "--to", "csv"]);
    assert_eq!(code, 1, "{err}");
    let runs = rows(&fs::read(out.join("tables/runs.csv")).expect("there is a table"));
    assert_eq!((&*runs[0]["status"], &*runs[1]["status"]), ("done", "quarantined"));
}

#[test]
fn plans_of_others_and_edited_ones_are_refused() {
    let study = Study::of(SHORT);
    let out = study.plan("study");
    let plan = out.join("plan.ndjson");
    let good = fs::read_to_string(&plan).expect("there is a plan");
    let (body, _) = good.trim_end().rsplit_once('\n').expect("it has lines");
    let sealed = |body: String| {
        let body = body + "\n";
        format!("{body}{{\"rows\":6,\"blake3\":\"{}\"}}\n", blake3::hash(body.as_bytes()).to_hex())
    };
    assert_eq!(sealed(body.to_owned()), good);
    // The digits of every id from behind.
    let turned = |body: &str| {
        let line = |line: &str| match line.rsplit_once("\"id\":\"") {
            Some((before, id)) => {
                let id: String = id.trim_end_matches("\"}").chars().rev().collect();
                format!("{before}\"id\":\"{id}\"}}")
            }
            None => line.to_owned(),
        };
        body.lines().map(line).collect::<Vec<_>>().join("\n")
    };
    let version = good.split("\"code_version\":\"").nth(1).expect("it has one").split('"').next();
    let version = version.expect("it has one");
    for (text_of, problem) in [
        (good.replace("0.45", "0.46"), "it was changed after it was written"),
        (good[..good.len() / 2].to_owned(), "it was changed after it was written"),
        (String::new(), "it was changed after it was written"),
        (sealed(body.replace(version, "0123456789abcdef")), "code version 0123456789abcdef"),
        (sealed(turned(body)), "its scenario has changed since it was planned"),
    ] {
        fs::write(&plan, &text_of).expect("the folder can be written");
        let (code, _, err) = sweep(&["run", text(&out)]);
        assert!(matches!(code, 1 | 2) && err.contains(problem), "{problem}: {code} {err}");
        assert!(!out.join("tables").exists());
    }
    fs::remove_file(&plan).expect("it is there");
    let (code, _, err) = sweep(&["status", text(&out)]);
    assert!(code == 2 && err.contains("there is no plan") && err.contains("(accepted: "), "{err}");
}

#[test]
fn combinations_that_a_scenario_refuses_are_named_or_recorded() {
    let study = Study::of(
        "
title = 'Friction'
scenario = 'ten-blocks'
set = ['parameter_set=as-coded', 'time.duration_s=0.1']
[[axis]]
key = 'friction.static_coefficient'
values = [0.4, 0.7]
",
    );
    let (file, out) = (study.path("sweep.toml"), study.path("study"));
    let (code, _, err) = sweep(&["plan", text(&file), "--out", text(&out)]);
    assert_eq!(code, 2, "{err}");
    for words in ["1 of 2 runs are refused", "run 1, friction.static_coefficient=0.4", "--skip-refused"] {
        assert!(err.contains(words), "{words}: {err}");
    }
    assert!(!out.exists());
    succeed(&["sweep", "plan", text(&file), "--out", text(&out), "--skip-refused"]);
    succeed(&["sweep", "run", text(&out)]);
    let runs = rows(&tables(&out)["runs.csv"]);
    assert_eq!((&*runs[0]["status"], &*runs[1]["status"]), ("refused", "done"));
    assert!(runs[0]["reason"].contains("friction.dynamic_coefficient"), "{:?}", runs[0]["reason"]);
    // A non-empty folder is refused for another plan.
    let (code, _, err) = sweep(&["plan", text(&file), "--out", text(&out), "--skip-refused"]);
    assert!(code == 2 && err.contains("(accepted: a new or empty folder)"), "{err}");
}

/// A run driven by its time step always fails, with a reason; the others continue.
#[test]
fn a_run_that_is_stopped_is_a_row_with_the_reason() {
    let study = Study::of(
        "
title = 'Time steps'
scenario = 'rigid-contacts'
set = ['slider.blocks=24']
[[axis]]
key = 'time.step_s'
values = [2e-7, 2.5e-6]
",
    );
    let out = study.path("study");
    let (code, _, err) = sweep(&["plan", text(&study.path("sweep.toml")), "--out", text(&out)]);
    assert!(
        code == 0 && err.contains("run 2, time.step_s=2.5e-6: warning: time.step_s = 2.5e-6 is"),
        "{err}"
    );
    let ranges =
        "F_T/F_N is at most 1, if nothing slides; the first slip comes at 0.1458 s; the time step is ";
    assert!(err.contains(ranges) && err.contains(" of the longest stable one\n2 runs planned\n"), "{err}");
    let (code, _, err) = sweep(&["run", text(&out)]);
    assert!(code == 1 && err.contains("run 2, time.step_s=2.5e-6: in step "), "{code} {err}");
    let (code, status, _) = sweep(&["status", text(&out)]);
    assert_eq!((code, status.as_str()), (1, "1 of 2 runs done, 1 failed\nfailed: 2\n"));
    let (code, ..) = sweep(&["collect", text(&out), "--to", "csv"]);
    assert_eq!(code, 1);
    let runs = rows(&fs::read(out.join("tables/runs.csv")).expect("there is a table"));
    assert_eq!((&*runs[0]["status"], &*runs[1]["status"]), ("done", "failed"));
    assert!(runs[1]["reason"].starts_with("in step "), "{:?}", runs[1]["reason"]);
    // It is not tried again.
    let (code, _, err) = sweep(&["run", text(&out)]);
    assert!(code == 1 && !err.contains("in step"), "{err}");
    // The exit code is about the requested runs only.
    for (run, expected) in [("1", 0), ("2", 1)] {
        assert_eq!(sweep(&["run", text(&out), "--index", run]).0, expected, "run {run}");
    }
}

#[test]
fn arguments_that_name_no_runs_are_refused() {
    let study = Study::of(SHORT);
    let out = study.plan("study");
    for (arguments, problem) in [
        (["--index", "7"], "--index 7 (accepted: runs from 1 to 6"),
        (["--index", "x"], "--index x (accepted: runs from 1 to 6"),
        (["--chunk", "3/2"], "accepted: K/N with K from 1 to N"),
    ] {
        let (code, _, err) = sweep(&[&["run", text(&out)], &arguments[..]].concat());
        assert!(code == 2 && err.contains(problem), "{err}");
    }
    let (code, _, err) = sweep(&["emit", "slurm", text(&out), "--tasks", "7"]);
    assert!(code == 2 && err.contains("--tasks 7 (accepted: 1 to 6)"), "{err}");
}

/// The lines of a list are commands that together make all runs.
#[test]
fn a_list_of_commands_makes_all_runs() {
    let study = Study::of(SHORT);
    let [whole, out] = ["whole", "a study"].map(|name| study.plan(name));
    succeed(&["sweep", "run", text(&whole)]);
    let list = succeed(&["sweep", "emit", "list", text(&out), "--tasks", "4"]);
    assert_eq!(list.lines().count(), 4);
    for line in list.lines() {
        let status = Command::new("sh").args(["-c", line]).status().expect("there is a shell");
        assert!(status.success(), "{line}");
    }
    assert!(tables(&out) == tables(&whole), "other tables");
    // By programs that run commands side by side, those that are there.
    let file = study.path("commands.txt");
    for (name, how) in [("xargs", "xargs -d '\\n' -P 2 -n 1 sh -c <"), ("parallel", "parallel --jobs 2 <")] {
        let is_there = Command::new("sh").args(["-c", &format!("command -v {name}")]).output();
        if !is_there.expect("there is a shell").status.success() {
            continue;
        }
        let out = study.plan(&format!("by {name}"));
        fs::write(&file, succeed(&["sweep", "emit", "list", text(&out), "--tasks", "3"]))
            .expect("the folder can be written");
        let status = Command::new("sh").args(["-c", &format!("{how} '{}'", text(&file))]).status();
        assert!(status.expect("there is a shell").success(), "{name}");
        assert!(tables(&out) == tables(&whole), "{name}: other tables");
    }
    let script = study.path("sweep.slurm");
    fs::write(&script, succeed(&["sweep", "emit", "slurm", text(&out)])).expect("the folder can be written");
    let status = Command::new("bash").args(["-n", text(&script)]).status().expect("there is bash");
    assert!(status.success());
    let row: toml::Table = succeed(&["sweep", "emit", "row", text(&out)]).parse().expect("it is TOML");
    assert!(row.contains_key("action"));
}

/// Named runs, and their outputs.
#[cfg(feature = "analysis")]
pub(crate) const RUNS: &str = "
first_global_slips = ['base', 'kicked']
[[run]]
name = 'base'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=1']
[[ensemble]]
name = 'kicked'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=1']
key = 'initial_velocity.amplitude_m_per_s'
values = [1e-9, 2e-9]
[[figure.load]]
file = 'load.png'
sliding = true
run = 'base'
[[claim]]
about = 'load.png'
quote = 'it slips'
run = 'base'
measure = 'precursor-count'
at_least = 1
";

/// A pipeline that is planned and made by workers, some of them killed, ends in the files of `reproduce`; so
/// do runs with names beside runs over axes.
#[cfg(feature = "analysis")]
#[test]
fn runs_with_names_are_made_by_workers_as_reproduce_makes_them() {
    let (slips, runs) = RUNS.trim_start().split_once('\n').unwrap();
    let axes = SHORT.to_owned()
        + "[[figure.lengths]]\nfile = 'lengths.png'\nover = ['normal_load.tilt', \
                                   'friction.static_coefficient']\n";
    let both = format!("{slips}\n{axes}{runs}");
    for (name, toml) in [("pipeline", format!("title = 'Runs'\n{RUNS}")), ("both", both)] {
        let study = Study::of(&toml);
        let (whole, out) = (study.path("whole"), study.plan(name));
        succeed(&["reproduce", text(&study.path("sweep.toml")), "--out", text(&whole)]);
        // One run alone; the rest in two parts, with the first part stopped at once.
        succeed(&["sweep", "run", text(&out), "--index", "2"]);
        assert_eq!(sweep(&["collect", text(&out)]).0, 3);
        let mut first =
            Command::new(env!("CARGO_BIN_EXE_asperity")).args(["sweep", "run", text(&out)]).spawn().unwrap();
        first.kill().unwrap();
        first.wait().unwrap();
        for part in [&["--chunk", "1/2"][..], &[]] {
            let arguments = [&["run", text(&out)], part].concat();
            // While the workers of the stopped one end, their runs are left to them.
            let ended = std::iter::repeat_with(|| sweep(&arguments)).find(|(code, ..)| *code != 3);
            let (code, _, said) = ended.expect("it ends");
            assert_eq!(code, 0, "{said}");
        }
        let formats = ["collect", text(&out), "--to", "csv,parquet"];
        let (code, _, said) = sweep(&formats);
        assert_eq!(code, 0, "{said}");
        assert_eq!(files_below(&out), files_below(&whole), "{name}");
        // A missing log is made again, and a damaged one is named.
        fs::remove_file(out.join("runs/base.mcap")).unwrap();
        let (code, said, _) = sweep(&["status", text(&out)]);
        assert!(code == 3 && said.contains("1 missing"), "{said}");
        succeed(&["sweep", "run", text(&out)]);
        let log = out.join("runs/kicked-1.mcap");
        let mut bytes = fs::read(&log).unwrap();
        let behind_its_header = bytes.len() - 3000;
        bytes[behind_its_header] ^= 1;
        fs::write(&log, bytes).unwrap();
        let (code, _, said) = sweep(&formats);
        assert!(code == 1 && said.contains("run kicked-1: its log is "), "{code} {said}");
    }
}

/// Claims of runs over axes are judged by the numbers of their summaries, and appear beside their figures.
#[cfg(feature = "analysis")]
#[test]
fn claims_of_runs_over_axes_are_judged_by_their_summaries() {
    const CLAIMS: &str = "
[[figure.family]]
file = 'count.png'
x = 'normal_load.tilt'
y = 'event_count'
over = ['friction.static_coefficient']
[[claim]]
about = 'count.png'
quote = 'many events'
run = '5'
measure = 'event_count'
at_least = 1
[[claim]]
about = 'the load'
quote = 'about a half'
at = ['normal_load.tilt=0.5']
measure = 'largest_ft_fn'
stated = '0.5'
";
    let toml = SHORT.to_owned() + CLAIMS;
    let study = Study::of(&toml);
    let out = study.plan("study");
    succeed(&["sweep", "run", text(&out)]);
    let tables = tables(&out);
    let (all, claims) = (rows(&tables["runs.csv"]), rows(&tables["claims.csv"]));
    assert!(tables.contains_key("claims.md") && tables.contains_key("claims.parquet"));
    let number = |text: &str| text.parse::<f64>().expect("it is a number");
    assert_eq!(number(&claims[0]["ours"]), number(&all[4]["event_count"]));
    assert_eq!((&*claims[0]["run"], &*claims[0]["verdict"]), ("5", "agrees"));
    // Runs 5 and 6 have that tilt.
    assert_eq!((&*claims[1]["run"], number(&claims[1]["ours"])), ("5", number(&all[4]["largest_ft_fn"])));
    assert!(claims[1]["rule"].contains("the spread of 2 runs"), "{}", claims[1]["rule"]);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    let beside = page.split("<figure").find(|part| part.contains("count.png")).expect("it is there");
    assert!(beside.contains("many events") && page.contains("The source:"));
    assert!(page.contains("href=\"#run-5\"") && page.contains("<code id=\"run-5\">"), "a link leads nowhere");
    // A page made later has them as well.
    let later = study.path("later.html");
    succeed(&["report", text(&out), "--out", text(&later)]);
    assert!(fs::read_to_string(later).unwrap().contains("many events"));
    let refused = |old: &str, new: &str| {
        let study = Study::of(&toml.replace(old, new));
        let (code, _, said) =
            sweep(&["plan", text(&study.path("sweep.toml")), "--out", text(&study.path("x"))]);
        assert_eq!(code, 2, "{said}");
        said
    };
    for (old, new, problem) in [
        (
            "'event_count'\nat_least",
            "'precursor_event_count'\nat_least",
            "of which no log is read (accepted: ",
        ),
        ("run = '5'", "run = '7'", "there is no run 7"),
        ("tilt=0.5", "tilt=0.6", "at: no run has normal_load.tilt=0.6"),
        (
            "load.tilt=0.5",
            "load.tint=0.5",
            "at: normal_load.tint does not vary; did you mean normal_load.tilt? (accepted: normal_load.tilt,",
        ),
        ("run = '5'", "run = '5'\nat = ['normal_load.tilt=0.5']", "needs run, or at without run"),
    ] {
        let said = refused(old, new);
        assert!(said.contains(problem), "{said}");
    }
}

/// The bytes of all files below a folder, except plan, segments and staging, by their paths.
#[cfg(feature = "analysis")]
pub(crate) fn files_below(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for of in ["tables", "figures", "runs", "report.html", "reproduce.json"] {
        let path = folder.join(of);
        let mut paths = vec![path.clone()];
        if path.is_dir() {
            paths = fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()).collect();
        }
        all.extend(paths.into_iter().map(|path| {
            let bytes = fs::read(&path).unwrap();
            (path.strip_prefix(folder).unwrap().to_owned(), bytes)
        }));
    }
    assert!(all.len() > 20, "{}", all.len());
    all
}
