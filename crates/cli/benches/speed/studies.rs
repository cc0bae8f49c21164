//! The runs of a study, against bare solvers in as many processes.
//!
//! Bare solvers take the steps of the same runs and drop the records; others hand them to the
//! detectors and drop the events. They are processes of this program, one for each core,
//! where a study has threads.

use std::fs;
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Instant;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_run::detectors::Settings;
use asperity_run::{Detectors, Task};
use asperity_simulator::SolverKind;

use crate::{ROUNDS, asperity, median, seconds};

/// Studies of one kind of run: its overrides, and the number of runs.
const STUDIES: [(&str, &[&str], usize); 2] = [
    ("100 blocks, 5 s", &[], 24),
    ("10 blocks, 0.02 s", &["slider.blocks=10", "time.duration_s=0.02"], 4_000),
];

/// The argument that starts this program as one of several processes.
pub(crate) const MAKE_RUNS: &str = "make-runs";

/// The axis: the tilt of the load of a run, counted from 0.
fn tilt(run: usize, runs: usize) -> f64 {
    -0.6 + 1.2 * run as f64 / (runs - 1) as f64
}

fn processes() -> usize {
    std::thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

pub(crate) fn studies() {
    println!("## Studies: the rate of `asperity sweep run` over that of bare solvers in as many processes\n");
    println!(
        "| runs | bare solvers, runs per minute | `sweep run`, runs per minute | over bare solvers | over solvers with \
         detectors | by CPU time | by CPU time |\n|---|---|---|---|---|---|---|"
    );
    for (study, (name, set, runs)) in STUDIES.into_iter().enumerate() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let [file, out] = ["sweep.toml", "study"].map(|name| folder.path().join(name));
        let text = format!(
            "title = 'Tilts'\nscenario = 'default'\nset = {set:?}\n\
             [[axis]]\nkey = 'normal_load.tilt'\nfrom = -0.6\nto = 0.6\ncount = {runs}\n"
        );
        fs::write(&file, text).expect("the folder can be written");
        let plain = |path: &Path| path.to_str().expect("temporary folders have plain names").to_owned();
        let (file, study_folder) = (plain(&file), plain(&out));
        asperity(&["sweep", "plan", &file, "--out", &study_folder]);
        let sweep = || {
            // In the first round there are none.
            drop(fs::remove_dir_all(out.join("segments")));
            timed(|| asperity(&["sweep", "run", "--quiet", &study_folder]))
        };
        let rounds: Vec<[Times; 3]> =
            (0..ROUNDS).map(|_| [bare(study, "bare"), bare(study, "detectors"), sweep()]).collect();
        let of = |times: &dyn Fn(&[Times; 3]) -> f64| median(rounds.iter().map(times).collect());
        let per_minute = |which: usize| 60.0 * runs as f64 / of(&|round| round[which].wall_s);
        println!(
            "| {runs} of {name} | {:.0} | {:.0} | {:.2} | {:.2} | {:.2} | {:.2} |",
            per_minute(0),
            per_minute(2),
            of(&|[bare, _, sweep]| bare.wall_s / sweep.wall_s),
            of(&|[_, detect, sweep]| detect.wall_s / sweep.wall_s),
            of(&|[bare, _, sweep]| bare.cpu_s / sweep.cpu_s),
            of(&|[_, detect, sweep]| detect.cpu_s / sweep.cpu_s),
        );
    }
    println!();
}

struct Times {
    wall_s: f64,
    /// User and system time of all processes that were waited for meanwhile.
    cpu_s: f64,
}

fn timed(work: impl FnOnce()) -> Times {
    let mut wall_s = 0.0;
    let cpu_s = seconds(|| {
        let start = Instant::now();
        work();
        wall_s = start.elapsed().as_secs_f64();
    });
    Times { wall_s, cpu_s }
}

fn bare(study: usize, kind: &str) -> Times {
    let program = std::env::current_exe().expect("this program knows where it is");
    timed(|| {
        let start = |part: usize| {
            let arguments = [MAKE_RUNS, kind, &study.to_string(), &part.to_string()];
            Command::new(&program).args(arguments).spawn().expect("this program starts")
        };
        let started: Vec<_> = (0..processes()).map(start).collect();
        for mut process in started {
            assert!(process.wait().expect("it is ours").success());
        }
    })
}

/// Makes the share of one process.
pub(crate) fn make_runs(arguments: &[String]) -> ExitCode {
    let [kind, study, part] = arguments else { return ExitCode::from(2) };
    let number = |text: &str| text.parse::<usize>().expect("it was given a number");
    let (_, set, runs) = STUDIES[number(study)];
    for run in (number(part)..runs).step_by(processes()) {
        let source = ScenarioSource::new("default", "parameter_set = \"as-coded\"");
        let source = set.iter().fold(source, |source, value| source.with_override(value));
        let source = source.with_override(&format!("normal_load.tilt={}", tilt(run, runs)));
        let scenario = Scenario::resolve(&source).expect("the scenario is accepted");
        let detectors =
            (kind == "detectors").then(|| Settings::default().start(&Task::new(&scenario).header(), None));
        std::hint::black_box(events(&Plan::new(&scenario), detectors));
    }
    ExitCode::SUCCESS
}

/// How many events detectors find in a run.
fn events(plan: &Plan, mut detectors: Option<Detectors>) -> usize {
    let mut events = 0;
    let mut fast = SolverKind::Fast.start(plan.clone());
    while let Some(record) = fast.next_record().expect("the run stays finite") {
        if let Some(detectors) = &mut detectors {
            detectors.observe(&record, &mut |_| events += 1);
        }
    }
    if let Some(detectors) = &mut detectors {
        detectors.finish(&mut |_| events += 1);
    }
    events
}
