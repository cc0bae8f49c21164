//! Runs that are killed, interrupted, or out of disk: their files never claim to be complete, and
//! `--resume` ends with the log of an uninterrupted run, to the byte.

use std::fs;
use std::io::Write;
use std::ops::Deref;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::support::binary;
use crate::support::binary::{as_coded, ends, succeed, text, with_sets};
use asperity_record::{RunEnd, RunStatus};
use asperity_runlog::{LogItem, RunReader, Topics, partial_path};
use asperity_testkit::{Random, read_log};

/// Runs that differ in the parts of a solver's state, with their overrides.
const SCENARIOS: [(&[&str], &[&str]); 6] = [
    // Jumps, windows and single steps, a record about every twenty microseconds of work.
    (&["default"], &["time.duration_s=2"]),
    // A hold whose step is not known in advance, and every step taken.
    (
        &["ten-blocks", "--solver", "plain"],
        &["time.duration_s=1.2", "time.step_s=2e-7", "drive.until_load_ratio=0.16"],
    ),
    // Steps of varying length, the state of friction from a free start, and a force that jumps and swings.
    (
        &[
            "rate-and-state",
            "--set",
            "friction.evolution_offsets=[]",
            "--set",
            "friction.initial_velocity_m_per_s=2e-4",
            "--set",
            "friction.initial_theta_s=0.02",
            "--set",
            "prestress.course_s=[0.5,0.5,1]",
            "--set",
            "prestress.course_ratio=[0,0.02,-0.01]",
            "--set",
            "prestress.swing_ratio=1e-3",
            "--set",
            "prestress.swing_period_s=0.2",
        ],
        &["slider.blocks=100", "slider.length_m=1", "time.duration_s=1.5", "recording.sample_s=1e-3"],
    ),
    // Friction that falls over a slip, which blocks remember.
    (
        &[
            "rigid-contacts",
            "--set",
            "friction.weakening_slip_m=1e-7",
            "--set",
            "friction.slip_memory_s=1e-3",
        ],
        &[
            "time.duration_s=0.5",
            "time.step_s=1e-7",
            "drive.velocity_m_per_s=1e-3",
            "recording.sample_s=5e-5",
        ],
    ),
    // A fault line in a medium, up to the end of its first earthquake.
    (&["seas-bp1-qd-coarse"], &["time.duration_s=6.13e9"]),
    // A force from outside on every block.
    (&["default"], &["time.duration_s=1.2", "prestress.ratio=0.1", "prestress.first_block_ratio=0.05"]),
];

/// The result of an uninterrupted run, and its duration.
struct Whole {
    bytes: Vec<u8>,
    items: Vec<LogItem>,
    end: RunEnd,
    takes: Duration,
}

impl Whole {
    fn of(scenario: &[&str]) -> Whole {
        let folder = asperity_testkit::folder();
        let whole = folder.path().join("whole.mcap");
        let started = Instant::now();
        binary::run(scenario, &whole);
        let takes = started.elapsed();
        let (items, end) = read_log(&whole).expect("the log is whole");
        assert!(items.len() > 1000, "too little happens: {} items", items.len());
        for topic in ["/events/slip", "/events/rupture", "/events/arrival"] {
            assert!(end.message_counts[topic] > 0, "no {topic}");
        }
        Whole { bytes: fs::read(&whole).expect("it was just read"), items, end, takes }
    }
}

/// A run of a scenario with frequent checkpoints.
struct Run {
    folder: tempfile::TempDir,
    arguments: Vec<String>,
    whole: &'static Whole,
}

impl Deref for Run {
    type Target = Whole;

    fn deref(&self) -> &Whole {
        self.whole
    }
}

impl Run {
    /// One of the scenarios, whose uninterrupted run is in `whole.mcap`.
    fn of(number: usize) -> Run {
        static WHOLE: [OnceLock<Whole>; SCENARIOS.len()] = [const { OnceLock::new() }; SCENARIOS.len()];
        let (scenario, sets) = SCENARIOS[number];
        let scenario = &with_sets(scenario, sets)[..];
        let whole = WHOLE[number].get_or_init(|| Whole::of(scenario));
        let folder = asperity_testkit::folder();
        fs::write(folder.path().join("whole.mcap"), &whole.bytes).expect("the folder can be written");
        let arguments =
            as_coded(&[&["run"], scenario, &["--resume", "--checkpoint-s", "0.004", "--out"]].concat());
        let mut arguments: Vec<String> = arguments.into_iter().map(str::to_owned).collect();
        arguments.push(text(&folder.path().join("run.mcap")).to_owned());
        Run { folder, arguments, whole }
    }

    fn log(&self) -> PathBuf {
        self.folder.path().join("run.mcap")
    }

    /// Begins the run, or resumes it.
    fn start(&self) -> Child {
        Command::new(env!("CARGO_BIN_EXE_asperity"))
            .args(&self.arguments)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary starts")
    }

    /// Checks the present files: a file with the final name is complete, and a file that claims to be
    /// complete is.
    fn must_not_lie(&self) {
        let log = self.log();
        if log.exists() {
            assert_eq!(read_log(&log).expect("a log with its final name is whole").1.digest, self.end.digest);
        }
        let partial = partial_path(&log);
        if let Ok((items, end)) = read_log(&partial) {
            // Killed between the last byte and the new name.
            assert_eq!((end.status, items.len()), (self.end.status, self.items.len()));
            assert_eq!(end.digest, self.end.digest);
        }
        let resumed = self.folder.path().join("run.mcap.resumed");
        assert!(!resumed.exists() || partial.exists(), "the unfinished log gave way too early");
    }

    /// Compares the complete log with that of the uninterrupted run.
    fn must_be_equal(&self) {
        let (items, end) = read_log(&self.log()).expect("the log is whole");
        let first = items.iter().zip(&self.items).position(|(resumed, whole)| resumed != whole);
        assert_eq!(first, None, "another item");
        assert_eq!(items.len(), self.items.len());
        assert_eq!(
            (&end.digest, end.switches, end.last_step),
            (&self.end.digest, self.end.switches, self.end.last_step)
        );
        assert_eq!((end.status, &end.message_counts), (self.end.status, &self.end.message_counts));
        // The statistics of the solver add up over all parts of the run.
        for name in ["steps", "switches", "plain_steps", "adaptive_steps"] {
            assert_eq!(end.solver.counts.get(name), self.end.solver.counts.get(name), "{name}");
        }
        let events = |log: &Path| succeed(&["events", text(log)]);
        assert_eq!(events(&self.log()), events(&self.folder.path().join("whole.mcap")));
        let left: Vec<_> = fs::read_dir(self.folder.path())
            .expect("the folder is there")
            .map(|entry| entry.expect("the folder is there").file_name())
            .filter(|name| !name.to_string_lossy().ends_with(".mcap"))
            .collect();
        assert!(left.is_empty(), "left behind: {left:?}");
    }

    fn remove(&self) {
        fs::remove_file(self.log()).expect("the log is there");
    }
}

/// The scenario and its overrides had to be named again.
#[test]
fn a_run_is_resumed_by_its_log_alone() {
    // Of another solver than the default of its law.
    let run = Run::of(1);
    let log = run.log();
    let cut = &run.bytes[..run.bytes.len() / 2];
    for named in [log.clone(), partial_path(&log)] {
        fs::write(partial_path(&log), cut).expect("the folder can be written");
        succeed(&["resume", text(&named), "--quiet"]);
        run.must_be_equal();
        ends(
            2,
            &["resume", text(&named)],
            &["run.mcap: whole: ", "(accepted: a log whose unfinished run is in "],
        );
        run.remove();
        ends(2, &["resume", text(&named)], &["there is no such file"]);
    }
    fs::write(&log, cut).expect("the folder can be written");
    ends(
        2,
        &["resume", text(&log)],
        &["run.mcap: incomplete: ", "(accepted: a log whose unfinished run is in "],
    );
    fs::write(partial_path(&log), &cut[..100]).expect("the folder can be written");
    run.remove();
    ends(2, &["resume", text(&log)], &["it ends before its scenario (accepted: asperity run SCENARIO -o "]);
}

/// Kills real processes at random points of all phases: before the log is begun, while it is
/// written, while its records are given again, while it gets its name. The attacks `kills` and `soak` kill
/// more of them, on all bodies and laws.
#[test]
fn killed_often_a_run_ends_as_if_never_killed() {
    const KILLS_OF_EACH: usize = 4;
    let mut random = Random::new(1);
    let (mut kills, mut gone_on, mut runs) = (0, 0, 0);
    for number in 0..SCENARIOS.len() {
        let run = Run::of(number);
        let (mut killed, mut went_on) = (0, 0);
        // The duration of a run depends on the load of the machine.
        let mut longest = run.takes.mul_f64(1.1);
        while killed < KILLS_OF_EACH || went_on == 0 {
            let mut child = run.start();
            // Most are killed early, so one run continues many times.
            let fraction = random.uniform(0.0, 1.0);
            std::thread::sleep(longest.mul_f64(fraction * fraction));
            child.kill().expect("it can be killed, or has ended");
            let output = child.wait_with_output().expect("it ends");
            let said = String::from_utf8_lossy(&output.stderr);
            let goes_on = said.contains("resumes from");
            went_on += usize::from(goes_on);
            longest = longest.mul_f64(match (output.status.success(), goes_on) {
                (true, _) => 0.95,
                (false, true) => 1.0,
                (false, false) => 1.05,
            });
            run.must_not_lie();
            if output.status.success() {
                run.must_be_equal();
                run.remove();
                runs += 1;
            } else {
                assert_eq!(output.status.code(), None, "it was killed: {said}");
                killed += 1;
            }
        }
        kills += killed;
        gone_on += went_on;
        // And now to its end.
        let output = run.start().wait_with_output().expect("it ends");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        run.must_be_equal();
        runs += 1;
    }
    writeln!(std::io::stdout(), "{kills} kills, {gone_on} times gone on, {runs} runs equal")
        .expect("it is open");
}

/// Kills a run some time after it began, and gives where its unfinished log is.
fn kill_halfway(run: &Run) -> PathBuf {
    let partial = partial_path(&run.log());
    loop {
        let mut child = run.start();
        std::thread::sleep(run.takes.mul_f64(0.6));
        child.kill().expect("it can be killed, or has ended");
        if !child.wait().expect("it ends").success() && has_checkpoint(&partial) {
            return partial;
        }
        if run.log().exists() {
            run.remove();
        }
    }
}

fn has_checkpoint(partial: &Path) -> bool {
    let Ok(mut reader) = RunReader::open(partial, Topics::NONE) else { return false };
    while let Ok(Some(_)) = reader.next_item() {}
    reader.checkpoint().is_some()
}

fn finish(run: &Run) -> String {
    let output = run.start().wait_with_output().expect("it ends");
    let said = String::from_utf8(output.stderr).expect("the binary writes UTF-8");
    assert!(output.status.success(), "{said}");
    run.must_be_equal();
    said
}

#[cfg(unix)]
#[test]
fn interrupted_a_run_goes_on_from_where_it_was() {
    let run = Run::of(0);
    let partial = partial_path(&run.log());
    // Beyond the first leap, which is the longest, however busy the machine is.
    let is_half_done = || fs::metadata(&partial).is_ok_and(|file| file.len() > run.bytes.len() as u64 / 2);
    loop {
        let mut child = run.start();
        while !is_half_done() && child.try_wait().expect("it can be asked").is_none() {
            std::thread::sleep(Duration::from_millis(2));
        }
        let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(sent.is_ok(), "there is a kill");
        let output = child.wait_with_output().expect("it ends");
        if output.status.code() == Some(130) {
            break;
        }
        run.remove();
    }
    let mut reader = RunReader::open(&partial, Topics::ALL).expect("it has a header");
    let mut last_step = 0;
    while let Ok(Some(item)) = reader.next_item() {
        if let LogItem::Record(record) = item {
            last_step = record.step();
        }
    }
    assert_eq!(reader.end().map(|end| end.status), Some(RunStatus::Interrupted));
    let state: serde_json::Value =
        serde_json::from_str(reader.checkpoint().expect("closed with one")).unwrap();
    // No step is repeated except those that a leap had recorded ahead.
    assert!(state["solver"]["slider"]["step"].as_u64().unwrap() + 2_000_000 > last_step);
    assert!(finish(&run).contains("resumes from"));
}

/// One signal ends a run between its records, the first and the last alone, and it goes on from there.
#[cfg(unix)]
#[test]
fn a_signal_ends_a_run_between_its_records() {
    let folder = asperity_testkit::folder();
    let command = |name: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_asperity"));
        command.current_dir(folder.path()).args([
            "run",
            "ten-blocks",
            "--solver=plain",
            "--resume",
            "-o",
            name,
        ]);
        let rare =
            ["recording.sample_s=0", "recording.fields_s=0", "time.step_s=2e-8", "time.duration_s=0.2"];
        command.args(with_sets(&[], &rare));
        command
    };
    let partial = folder.path().join("run.mcap.partial");
    let mut child = command("run.mcap").spawn().expect("the binary starts");
    while !partial.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    std::thread::sleep(Duration::from_millis(100));
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("there is a kill");
    assert_eq!(child.wait().expect("it ends").code(), Some(130));
    let mut reader = RunReader::open(&partial, Topics::ALL).expect("it has a header");
    while let Ok(Some(_)) = reader.next_item() {}
    let state: serde_json::Value =
        serde_json::from_str(reader.checkpoint().expect("closed with one")).unwrap();
    let step = state["solver"]["slider"]["step"].as_u64().unwrap();
    assert!(0 < step && step < reader.header().steps / 2, "{step}");
    let [resumed, whole] = ["run.mcap", "whole.mcap"].map(|name| {
        assert!(command(name).status().expect("it starts").success());
        read_log(&folder.path().join(name)).expect("it is whole").1.digest
    });
    assert_eq!(resumed, whole);
}

#[test]
fn a_run_that_lacks_only_its_name_gets_it() {
    let run = Run::of(1);
    fs::copy(run.folder.path().join("whole.mcap"), partial_path(&run.log())).expect("a file can be copied");
    assert!(finish(&run).contains("its log was whole and only had to be renamed"));
    // And then no work is left.
    assert!(finish(&run).contains("is whole already"));
}

/// Damage after the last sound checkpoint is repaired by repeating the steps.
#[test]
fn a_damaged_log_is_gone_on_with_from_before_the_damage() {
    let run = Run::of(0);
    let partial = kill_halfway(&run);
    let sound = fs::read(&partial).expect("the log can be read");
    let mut gone_on = 0;
    for part in [1, 3, 5, 7] {
        let mut bytes = sound.clone();
        let place = sound.len() * part / 8;
        bytes[place] ^= 0x10;
        fs::write(&partial, &bytes).expect("the folder can be written");
        gone_on += usize::from(finish(&run).contains("resumes from"));
        run.remove();
    }
    assert!(gone_on >= 2, "{gone_on}");
}

#[test]
fn what_is_left_of_another_run_is_refused_and_kept() {
    let run = Run::of(0);
    let partial = kill_halfway(&run);
    let before = fs::read(&partial).expect("the log can be read");
    let log = run.log();
    let refused = |arguments: &[&str], reason: &str| {
        ends(2, &[arguments, &["--out", text(&log)]].concat(), &[reason, "(accepted: "]);
        assert!(fs::read(&partial).expect("it is still there") == before && !log.exists());
    };
    refused(
        &["run", "default", "--set", "time.duration_s=3", "--resume"],
        "time.duration_s = 2.0 in it, not 3.0",
    );
    refused(
        &["run", "default", "--set", "time.duration_s=2", "--solver", "plain", "--resume"],
        "another solver",
    );
    refused(&["run", "default", "--set", "time.duration_s=2"], "an unfinished run");
    // A whole log of another run is not touched either.
    fs::copy(run.folder.path().join("whole.mcap"), &log).expect("a file can be copied");
    ends(2, &["run", "default", "--resume", "--out", text(&log)], &[]);
}

#[test]
fn two_processes_never_write_one_log() {
    let run = Run::of(1);
    let mut first = run.start();
    let partial = partial_path(&run.log());
    while !partial.exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    let second = run.start().wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&second.stderr);
    assert!(first.try_wait().expect("it can be asked").is_none(), "the first was over too soon");
    assert_eq!(second.status.code(), Some(1), "{said}");
    assert!(said.contains("is being written by another process"), "{said}");
    assert!(first.wait().expect("it ends").success());
    run.must_be_equal();
}
