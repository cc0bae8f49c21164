//! The speed, as ratios within one run of the benchmark: `cargo xtask bench`.
//!
//! Everything is measured against a plain loop in C that records nothing (`chain.c`), which runs a few million steps
//! just before and just after, since the speed of a shared machine changes from minute to minute; seconds are those of
//! the processor.

#![expect(clippy::print_stdout, reason = "the tables are what a benchmark is for")]

mod area;
mod chains;
#[path = "../../../../xtask/src/cpu.rs"]
mod cpu;
mod diff;
mod junctions;
mod logs;
mod pays;
mod rate_and_state;
mod recordings;
mod seas;
mod slabs;
mod studies;

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::sync::LazyLock;
use std::time::Duration;

use asperity_model::Plan;
use asperity_simulator::{Counters, Plain, SolverKind};

/// Rounds of each comparison; the median counts.
const ROUNDS: usize = 5;

/// Steps of the loop in one measurement, for 100 blocks.
const LOOP_STEPS: u64 = 2_000_000;

/// The available measurements, by name.
const PARTS: [(&str, fn()); 15] = [
    ("runs", whole_runs),
    ("chains", long_chains),
    ("switches", chains::switches),
    ("resolution", chains::resolution),
    ("pays", pays::pays),
    ("slab", slabs::slabs),
    ("area", area::area),
    ("junctions", junctions::junctions),
    ("rate-and-state", rate_and_state::rate_and_state),
    ("seas", seas::seas),
    ("studies", studies::studies),
    ("logs", logs::logs),
    ("recordings", recordings::recordings),
    ("diff", diff::tables),
    ("chapter5", whole_chapter),
];

fn main() -> ExitCode {
    // Cargo hands `--bench` to every benchmark.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let Some((studies::MAKE_RUNS, arguments)) = arguments.split_first().map(|(name, rest)| (&**name, rest))
    {
        return studies::make_runs(arguments);
    }
    let parts = arguments.iter().map(|name| PARTS.iter().find(|(part, _)| part == name).ok_or(name));
    match parts.collect::<Result<Vec<_>, _>>() {
        Ok(parts) if parts.is_empty() => PARTS.iter().for_each(|(_, measure)| measure()),
        Ok(parts) => parts.into_iter().for_each(|(_, measure)| measure()),
        Err(unknown) => {
            println!("unknown part {unknown} (accepted: {})", PARTS.map(|(part, _)| part).join(", "));
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

fn plan(set: &[&str]) -> Plan {
    asperity_testkit::plan("default", set)
}

/// Seconds of the processor, of this process and of those that it waits for meanwhile: others on the machine disturb
/// them less than the time on the wall.
fn seconds(work: impl FnOnce()) -> f64 {
    let before_s = used_s();
    work();
    used_s() - before_s
}

fn used_s() -> f64 {
    cpu::used_s().expect("the system reports it")
}

/// Steps of a measurement that takes as long for any number of blocks.
fn steps_of(plan: &Plan) -> u64 {
    (LOOP_STEPS * 100 / plan.blocks as u64).clamp(2_000, 20_000_000)
}

/// Nanoseconds of one step of the loop in C.
fn loop_ns(plan: &Plan) -> f64 {
    loop_in_c(plan, steps_of(plan))[0]
}

/// Takes so many steps of the loop in C; nanoseconds of one, and the displacement of block 1 behind them.
fn loop_in_c(plan: &Plan, steps: u64) -> [f64; 2] {
    static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| compiled("chain"));
    let numbers = [
        plan.elastic.stiffness_n_per_m,
        plan.elastic.damping_kg_per_s,
        plan.friction.interfacial_stiffness_n_per_m,
        plan.grid.step_s(),
        plan.block_mass_kg,
        plan.friction.static_threshold_n[0],
        plan.friction.dynamic_friction_n[0],
        plan.drive.stiffest_n_per_m(),
        plan.drive.velocity_m_per_s,
    ];
    let mut program = Command::new(&*PROGRAM);
    let found = printed(
        program
            .args([plan.blocks.to_string(), steps.to_string()])
            .args(numbers.map(|number| number.to_string())),
    );
    [found[0], found[1]]
}

/// Nanoseconds of one step of the plain solver.
fn plain_ns(plan: &Plan) -> f64 {
    first_steps(plan, steps_of(plan)).0
}

/// Nanoseconds of one step of the plain solver, over so many from the start, and the solver behind them.
fn first_steps(plan: &Plan, steps: u64) -> (f64, Plain) {
    let mut plain = Plain::new(plan.clone());
    let elapsed_s = seconds(|| {
        for _ in 0..steps {
            plain.take_step();
        }
    });
    (elapsed_s * 1e9 / steps as f64, plain)
}

/// Seconds of a whole run of the fast solver, and its statistics.
fn fast_s(plan: &Plan) -> (f64, Counters) {
    let mut counters = Counters::default();
    let elapsed_s = seconds(|| {
        let mut fast = SolverKind::Fast.start(plan.clone());
        while fast.next_record().expect("the run stays finite").is_some() {}
        counters = fast.counters();
    });
    (elapsed_s, counters)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The speed-up over the loop, for the same number of steps: the median over rounds, each of which measures the loop
/// before and after.
fn times_loop(plan: &Plan, mut measure_s: impl FnMut() -> f64) -> f64 {
    let mut before = loop_ns(plan);
    let ratios = (0..ROUNDS).map(|_| {
        let elapsed_s = measure_s();
        let after = loop_ns(plan);
        let loop_s = (before + after) / 2.0 * 1e-9 * plan.steps as f64;
        before = after;
        loop_s / elapsed_s
    });
    median(ratios.collect())
}

/// Compiles a program in C that is beside this file, as fast as it gets.
fn compiled(name: &str) -> PathBuf {
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("benches/speed/{name}.c"));
    let flags = ["-O3", "-march=native", "-o"];
    let compiled = Command::new("cc").args(flags).arg(&program).arg(&source).arg("-lm").status();
    assert!(compiled.is_ok_and(|status| status.success()), "there is no C compiler `cc`, or it fails");
    program
}

/// The numbers that a program prints, which was just compiled.
fn printed(program: &mut Command) -> Vec<f64> {
    let output = program.output().expect("what was just compiled runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.split_whitespace().map(|word| word.parse().expect("it prints numbers")).collect()
}

/// Whole runs: what they are called, and how they differ from the default one.
const RUNS: [(&str, &[&str]); 4] = [
    ("as coded", &["parameter_set=as-coded"]),
    ("as stated", &["parameter_set=as-stated"]),
    (
        "as stated, 1,000 blocks for 0.5 s",
        &["parameter_set=as-stated", "slider.blocks=1000", "time.duration_s=0.5"],
    ),
    (
        "as stated, 3,000 blocks for 0.15 s",
        &["parameter_set=as-stated", "slider.blocks=3000", "time.duration_s=0.15"],
    ),
];

fn whole_runs() {
    println!(
        "## The default run (100 blocks, 5 s in 5e8 steps), and longer chains: speed-up over the loop in C\n"
    );
    println!(
        "| run | plain solver | fast solver | `asperity run --solver fast` | `asperity replay` |\n|---|---|---|---|---|"
    );
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let log = folder.path().join("run.mcap");
    let path = log.to_str().expect("temporary folders have plain names");
    let mut made_of = Vec::new();
    for (name, set) in RUNS {
        let plan = plan(set);
        let steps = steps_of(&plan);
        let (of_c, plain) = (loop_in_c(&plan, steps)[1], first_steps(&plan, steps).1);
        let own = plain.state().displacement_m[0];
        assert!((of_c - own).abs() <= 1e-9 * own.abs(), "C has {of_c}, the plain solver {own}");
        let plain = times_loop(&plan, || plain_ns(&plan) * 1e-9 * plan.steps as f64);
        let mut counters = Counters::default();
        let fast = times_loop(&plan, || {
            let (elapsed_s, counted) = fast_s(&plan);
            counters = counted;
            elapsed_s
        });
        made_of.push((name, counters));
        let start = ["run", "default", "--out", path];
        let arguments: Vec<&str> =
            start.into_iter().chain(set.iter().flat_map(|value| ["--set", value])).collect();
        let run = times_loop(&plan, || {
            // In the first round there is none.
            drop(fs::remove_file(&log));
            seconds(|| asperity(&arguments))
        });
        let replay = times_loop(&plan, || seconds(|| asperity(&["replay", path])));
        println!("| {name} | {plain:.1} | {fast:.0} | {run:.0} | {replay:.0} |");
    }
    println!("\nWhat the fast runs were made of:\n");
    for (name, counters) in made_of {
        println!("{name}\n{counters}");
    }
}

/// The asperity binary, which `cargo xtask bench` has built.
fn binary() -> OsString {
    std::env::var_os("ASPERITY").expect("ASPERITY names the binary: call `cargo xtask bench`")
}

fn asperity(arguments: &[&str]) {
    let output = Command::new(binary()).args(arguments).output().expect("the binary starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Runs the binary, whose output is dropped; how it ended, its seconds of the processor, and the most memory that it
/// had, in MB.
fn watched(arguments: &[&str]) -> (ExitStatus, f64, f64) {
    let before_s = used_s();
    let command = Command::new(binary()).args(arguments).stdout(Stdio::null()).spawn();
    let mut child = command.expect("the binary was built with the bench");
    let mut most_mb = 0.0_f64;
    loop {
        most_mb = most_mb.max(memory_mb(&child.id().to_string(), "VmHWM:"));
        match child.try_wait().expect("it can be waited for") {
            Some(status) => return (status, used_s() - before_s, most_mb),
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

/// Resident memory of this process, in MB.
fn resident_mb() -> f64 {
    memory_mb("self", "VmRSS:")
}

/// Memory of a process, in MB; 0 if the system does not report it.
fn memory_mb(process: &str, key: &str) -> f64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(key));
    line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0)
}

fn long_chains() {
    println!("## Longer and shorter chains\n");
    println!(
        "The slider of the thesis in N blocks, simulated until several precursors have run. With 10,000 blocks, as stated,\n\
         a time step of 1e-8 s would be unstable; 1e-9 s serves both parameter sets there.\n"
    );
    println!(
        "| parameter set | N | time step, s | simulated, s | switches | steps per switch | cost of a switch in steps of the loop | \
         of which terms of windows | speed-up over the loop | memory of the solver, MB |\n|---|---|---|---|---|---|---|---|---|---|"
    );
    let chains = [
        (10, "1e-8", "5"),
        (30, "1e-8", "2"),
        (100, "1e-8", "1"),
        (300, "1e-8", "0.4"),
        (1_000, "1e-8", "0.2"),
        (3_000, "1e-8", "0.06"),
        (10_000, "1e-9", "0.004"),
    ];
    for set in ["as-coded", "as-stated"] {
        for (blocks, step_s, duration_s) in chains {
            let plan = plan(&[
                &format!("parameter_set={set}"),
                &format!("slider.blocks={blocks}"),
                &format!("time.step_s={step_s}"),
                &format!("time.duration_s={duration_s}"),
                "recording.sample_s=0",
                "recording.fields_s=0",
                "recording.event_fields=false",
            ]);
            let before_mb = resident_mb();
            let solver = SolverKind::Fast.start(plan.clone());
            let memory_mb = resident_mb() - before_mb;
            drop(solver);
            let before_ns = loop_ns(&plan);
            let (elapsed_s, counters) = fast_s(&plan);
            let loop_ns = (before_ns + loop_ns(&plan)) / 2.0;
            let switches = counters.switches.max(1) as f64;
            let steps = plan.steps as f64;
            println!(
                "| {set} | {blocks} | {step_s} | {duration_s} | {} | {:.0} | {:.0} | {:.0} | {:.0} | {memory_mb:.1} |",
                counters.switches,
                steps / switches,
                elapsed_s * 1e9 / loop_ns / switches,
                counters.applications as f64 / switches,
                loop_ns * 1e-9 * steps / elapsed_s,
            );
        }
    }
    println!();
}

fn whole_chapter() {
    println!("## All of Chapter 5\n");
    let root =
        Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the crate lies in the workspace");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let out = folder.path().to_str().expect("temporary folders have plain names").to_owned();
    let plan = plan(&[]);
    let ratio = times_loop(&plan, || {
        let mut command = Command::new(binary());
        command.current_dir(root).args(["reproduce", "pipelines/chapter5.toml", "--fresh", "--out", &out]);
        seconds(|| assert!(command.output().expect("the binary starts").status.success()))
    });
    println!(
        "`asperity reproduce pipelines/chapter5.toml --fresh` takes {:.3} times the seconds of the processor that the loop in C takes for the default run alone.\n",
        1.0 / ratio
    );
}
