//! Parameter studies: the results depend only on the plan, however often the command is
//! killed, and however the runs are divided.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Instant;

use asperity_study::segment::this_node;
#[cfg(target_os = "linux")]
use asperity_testkit::Random;

use crate::laws::frames::{Segment, body, sealed};
use crate::support::binary::{contents, outcome, rows, run, succeed, text, with_sets};

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

/// The overrides of its fifth run.
pub(crate) const FIFTH: [&str; 6] = [
    "slider.blocks=20",
    "time.step_s=1e-7",
    "time.duration_s=1",
    "normal_load.tilt=0.5",
    "friction.static_coefficient=0.5",
    "friction.dynamic_coefficient=0.3",
];

impl Study {
    pub(crate) fn of(sweep: &str) -> Study {
        let study = Study { folder: asperity_testkit::folder() };
        study.write("sweep.toml", sweep);
        study
    }

    pub(crate) fn write(&self, name: &str, content: &str) {
        fs::write(self.path(name), content).expect("the folder can be written");
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
    succeed(&["sweep", "collect", text(study), "--to", "parquet,csv"]);
    contents(&study.join("tables"))
}

pub(crate) fn sweep(arguments: &[&str]) -> (i32, String, String) {
    outcome(&[&["sweep"], arguments].concat())
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
    run(&with_sets(&["default"], &FIFTH), &log);
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

/// Ends may radiate too: the column of this energy was missing where the first run had none.
#[test]
fn tables_have_the_energies_of_all_runs() {
    let study = Study::of(
        "title = 'Ends'\nscenario = 'first-precursor'\nset = ['time.duration_s=0.1']\nkeep = ['ruptures']\n\
         [[axis]]\nkey = 'slider.right_end'\nvalues = ['free', 'absorbing']\n",
    );
    let out = study.plan("study");
    succeed(&["sweep", "run", text(&out)]);
    let has: Vec<bool> =
        rows(&tables(&out)["ruptures.csv"]).iter().map(|rupture| !rupture["radiated_j"].is_empty()).collect();
    assert!(has.len() > 1 && !has[0] && has[has.len() - 1], "{has:?}");
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

/// How many whole results there are of each run that is done.
pub(crate) fn results(study: &Path) -> BTreeMap<u64, usize> {
    let mut counts = BTreeMap::new();
    for segment in fs::read_dir(study.join("segments")).into_iter().flatten() {
        let bytes = fs::read(segment.expect("the folder can be read").path()).expect("it can be read");
        for frame in Segment::read(&bytes).frames.iter().filter(|frame| frame.kind == 1) {
            *counts.entry(frame.run).or_default() += 1;
        }
    }
    counts
}

/// The command is killed at any time. In which step of a run depends on the clock; the assertions do not.
#[test]
#[cfg(target_os = "linux")]
fn killed_again_and_again_a_study_gives_the_same_tables() {
    const RUNS: usize = 80;
    let study = Study::of(
        "
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
",
    );
    let [whole, killed] = ["whole", "killed"].map(|name| study.plan(name));
    let started = Instant::now();
    succeed(&["sweep", "run", text(&whole)]);
    let takes = started.elapsed();
    let mut random = Random::new(11);
    let (mut kills, mut before, mut is_over) = (0, 0, false);
    while !is_over {
        let mut running = start(&["run", text(&killed)]);
        thread::sleep(takes.mul_f64(random.uniform(0.0, 0.2)));
        is_over = running.try_wait().expect("it is ours").is_some();
        if !is_over {
            kill(running.id());
            kills += 1;
        }
        running.wait().expect("it is ours");
        let (_, status, _) = sweep(&["status", text(&killed)]);
        let done: usize = status.split(' ').next().and_then(|n| n.parse().ok()).expect("it counts them");
        assert!(done >= before && results(&killed).len() == done, "{before}: {status}");
        before = done;
    }
    assert!(kills > 2, "{kills}");
    // Once more, when there is nothing to do: completed runs are not repeated.
    succeed(&["sweep", "run", text(&killed)]);
    assert_eq!(results(&killed), (1..=RUNS as u64).map(|run| (run, 1)).collect());
    assert!(tables(&killed) == tables(&whole), "other tables");
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

#[test]
fn plans_of_others_and_edited_ones_are_refused() {
    let study = Study::of(SHORT);
    let out = study.plan("study");
    let plan = out.join("plan.ndjson");
    let good = fs::read_to_string(&plan).expect("there is a plan");
    let lines = body(&good);
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
        (sealed(&lines.replace(version, "0123456789abcdef")), "code version 0123456789abcdef"),
        (sealed(&turned(lines)), "its scenario has changed since it was planned"),
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
    // It is verified by failing for the same reason.
    let verified = format!("2 of 2 chosen runs verified: 2 on {} alone\n", this_node());
    let (code, told, err) = sweep(&["run", text(&out), "--verify", "2"]);
    assert_eq!((code, told), (0, verified), "{err}");
    // In one call there are tables all the same.
    let go = study.path("go");
    let (code, _, err) = sweep(&["go", text(&study.path("sweep.toml")), "-o", text(&go), "--to", "csv"]);
    assert!(
        code == 1 && rows(&fs::read(go.join("tables/runs.csv")).expect("there is a table")) == runs,
        "{err}"
    );
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
    let whole = study.plan("whole");
    succeed(&["sweep", "run", text(&whole)]);
    // By the shell, and by programs that run commands side by side, those that are there.
    let file = study.path("commands.txt");
    for (name, how) in
        [("sh", "sh <"), ("xargs", "xargs -d '\\n' -P 2 -n 1 sh -c <"), ("parallel", "parallel --jobs 2 <")]
    {
        let is_there = Command::new("sh").args(["-c", &format!("command -v {name}")]).output();
        if !is_there.expect("there is a shell").status.success() {
            continue;
        }
        let out = study.plan(&format!("a study by {name}"));
        let list = succeed(&["sweep", "emit", "list", text(&out), "--tasks", "4"]);
        assert_eq!(list.lines().count(), 4);
        fs::write(&file, list).expect("the folder can be written");
        let status = Command::new("sh").args(["-c", &format!("{how} '{}'", text(&file))]).status();
        assert!(status.expect("there is a shell").success(), "{name}");
        assert!(tables(&out) == tables(&whole), "{name}: other tables");
    }
}

/// Named runs, and their outputs.
pub(crate) const RUNS: &str = "
first_global_slips = ['base', 'perturbed-*']
[[run]]
name = 'base'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=1']
[[run]]
name = 'perturbed'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=1']
keys = ['initial_velocity.amplitude_m_per_s']
values = [1e-9, 2e-9]
[[figure.load]]
file = 'load.png'
sliding = true
run = 'base'
[[claim]]
about = 'the load'
figures = ['load.png']
quote = 'it slips'
run = 'base'
measure = 'precursor_event_count'
at_least = 1
";

/// A pipeline that is planned and made in parts, one of them killed, ends in the files of `reproduce`; so
/// do runs with names beside runs over axes.
#[test]
fn runs_with_names_are_made_in_parts_as_reproduce_makes_them() {
    let (slips, runs) = RUNS.trim_start().split_once('\n').unwrap();
    let axes = SHORT.to_owned()
        + "[[figure.family]]\nfile = 'lengths.png'\nx = 'ft_fn_onset'\ny = 'length_ratio'\n\
           over = ['normal_load.tilt', 'friction.static_coefficient']\n";
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
            let (code, _, said) = sweep(&[&["run", text(&out)], part].concat());
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
        let log = out.join("runs/perturbed-1.mcap");
        let mut bytes = fs::read(&log).unwrap();
        let behind_its_header = bytes.len() - 3000;
        bytes[behind_its_header] ^= 1;
        fs::write(&log, bytes).unwrap();
        let (code, _, said) = sweep(&formats);
        assert!(code == 1 && said.contains("run perturbed-1: its log is "), "{code} {said}");
    }
}

/// Claims of runs over axes are judged by the numbers of their summaries, and appear beside their figures.
#[test]
fn claims_of_runs_over_axes_are_judged_by_their_summaries() {
    const CLAIMS: &str = "
[[figure.family]]
file = 'count.png'
x = 'normal_load.tilt'
y = 'event_count'
over = ['friction.static_coefficient']
[[claim]]
about = 'counts'
figures = ['count.png']
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
    assert!(beside.contains("many events") && page.contains("The thesis:"));
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
