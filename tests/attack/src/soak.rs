//! Random scenarios over all bodies, laws, drives, loads and ends, by both solvers. Each run is killed and resumed
//! to the messages of an undisturbed one, checked, replayed and compared with itself, and its exports are read by
//! a program of another language, which finds the ruptures again by their definition.
//!
//! Combinations that a scenario refuses are counted and cost nothing; a refusal has a message.

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::calls::{Call, shortened};
use crate::case::{Case, try_all};
use crate::ground::{Error, Genuine, Ground};
use crate::random::Random;
use crate::tally::say;
use crate::verdict::Verdict;

/// Bodies and laws, with a duration in which something slips.
const SCENARIOS: [(&str, f64); 20] = [
    ("default", 0.5),
    ("ten-blocks", 0.5),
    ("scattered-friction", 0.4),
    ("ageing-contacts", 0.4),
    ("rigid-contacts", 0.3),
    ("velocity-weakening", 3.0),
    ("slip-weakening", 0.01),
    ("carlson-langer", 3.0),
    ("top-driven", 0.4),
    ("left-right-driven", 0.4),
    ("unloading-ageing", 0.5),
    ("unloading-top-driven-poisson", 0.5),
    ("beta-0225", 0.4),
    ("chain-junctions", 0.1),
    ("junction-slider", 0.1),
    ("slab", 0.02),
    ("sheet-coarse", 0.05),
    ("body-coarse", 0.02),
    ("spring-slider", 10.0),
    ("rate-and-state", 2.0),
];

/// The plain stepper takes a minute or more for each of their seconds.
const SLOW: [&str; 2] = ["velocity-weakening", "carlson-langer"];

/// What is changed by chance: keys with values.
const CHANGES: [(&str, &[&str]); 14] = [
    ("slider.left_end", &["clamped", "absorbing", "free"]),
    ("slider.right_end", &["clamped", "absorbing", "free"]),
    ("slider.blocks", &["1", "2", "7", "33", "300"]),
    ("normal_load.tilt", &["-0.8", "-0.3", "0.4", "0.9"]),
    ("drive.kind", &["side", "top"]),
    ("drive.velocity_m_per_s", &["0.0004", "0.002", "0.01"]),
    ("friction.detach_by", &["spring", "force"]),
    ("friction.static_coefficient", &["0.5", "0.7"]),
    ("friction.static_spread", &["0.05", "0.2"]),
    ("disorder.load_spread", &["0.1"]),
    ("disorder.correlation_length_m", &["0.005"]),
    ("initial_shear.beta", &["0.3"]),
    ("recording.fields_s", &["0.001", "0.01"]),
    ("recording.sample_s", &["0.0005", "0.002"]),
];

/// The program that finds ruptures by their definition. It needs no packages.
const READER: &str = "tests/clients/ruptures.py";

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let refused = AtomicUsize::new(0);
    try_all(ground, "soak", "random scenarios", ground.size.soak, |case| {
        if !once(case)? {
            refused.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    })?;
    let refused = refused.into_inner();
    say(&format!("  soak: {refused} scenarios were refused"));
    if refused > ground.size.soak / 2 {
        return Err("more than half of the random scenarios were refused".into());
    }
    Ok(())
}

/// A random scenario: its name, and overrides.
fn scenario(random: &mut Random) -> Vec<String> {
    let (name, duration_s) = random.pick(&SCENARIOS);
    let mut set =
        vec![format!("time.duration_s={}", (duration_s * random.uniform(200.0, 1000.0)).round() / 1000.0)];
    if !["spring-slider", "rate-and-state", "velocity-weakening", "carlson-langer"].contains(&name) {
        set.push("time.step_s=1e-7".to_owned());
    }
    for _ in 0..random.below(4) {
        let (key, values) = random.pick(&CHANGES);
        let value = random.pick(values);
        set.push(format!("{key}={value}"));
    }
    if random.below(6) == 0 {
        set.push("slider.left_end=periodic".to_owned());
        set.push("slider.right_end=periodic".to_owned());
        set.push("drive.kind=top".to_owned());
    }
    let pairs = set.into_iter().flat_map(|set| ["--set".to_owned(), set]);
    std::iter::once(name.to_owned()).chain(pairs).collect()
}

/// One scenario. Returns false if it was refused.
fn once(case: &mut Case<'_>) -> Result<bool, Error> {
    let folder = case.folder.clone();
    let mut scenario = scenario(&mut case.random);
    if case.random.below(3) == 0 {
        scenario.extend(["--solver", "plain"].map(str::to_owned));
        if SLOW.contains(&scenario[0].as_str()) {
            "time.duration_s=0.1".clone_into(&mut scenario[2]);
        }
    }
    let words: Vec<&str> = scenario.iter().map(String::as_str).collect();
    let run = |out: &'static str| [&["run"][..], &words, &["--quiet", "--out", out]].concat();
    let started = Instant::now();
    let whole = case.call(&run("whole.mcap"))?;
    let takes = started.elapsed();
    if whole.code == Some(2) {
        case.hold(whole.err.contains("accepted: "), "a refusal does not name what is accepted", || {
            whole.said()
        });
        return Ok(false);
    }
    // A run that the solver stops ends with 1 and a whole log of what there is.
    let stopped = whole.code == Some(1) && folder.join("whole.mcap").exists();
    case.hold(whole.code == Some(0) || stopped, "a random run fails", || whole.said());
    if whole.code != Some(0) {
        return Ok(true);
    }
    case.must_be("a random run", "whole.mcap", Verdict::Whole)?;
    let resume = [&run("killed.mcap")[..], &["--resume", "--checkpoint-s", "0.005"]].concat();
    for _ in 0..4 {
        let after = takes.mul_f64(case.random.uniform(0.1, 1.0));
        let mut running = Call::new(&case.ground.program, &folder, &resume)?.start()?;
        let started = Instant::now();
        while started.elapsed() < after && !running.has_ended()? {
            thread::sleep(Duration::from_millis(1));
        }
        running.signal("KILL")?;
        let outcome = running.wait()?;
        match outcome.signal {
            Some(9) => case.note(&outcome),
            _ => case.must_end_well(&outcome),
        }
    }
    must_succeed(case, "a random run that was killed is not resumed", &resume)?;
    let [whole, killed] = ["whole.mcap", "killed.mcap"].map(|name| Genuine::read(&folder.join(name)));
    if let Some(difference) = crate::file::difference(&whole?.without(&[]), &killed?.without(&[])) {
        case.broke("a resumed random run has other messages than an undisturbed one", difference);
    }
    if takes < Duration::from_secs(2) {
        must_succeed(case, "a random run, made again, differs", &["check", "--again", "killed.mcap"])?;
    }
    must_succeed(
        case,
        "a replay of a random run differs",
        &["replay", "killed.mcap", "--quiet", "--out", "replayed"],
    )?;
    must_succeed(case, "a random run differs from itself", &["diff", "whole.mcap", "killed.mcap"])?;
    must_succeed(case, "a summary of a random run fails", &["summary", "killed.mcap"])?;
    let export = ["export", "killed.mcap", "--quiet", "--to", "csv", "--out", "tables"];
    if must_succeed(case, "an export of a random run fails", &export)? {
        let reader = case.ground.root.join(READER);
        let mut python = Command::new("python3");
        python.arg(reader).arg(folder.join("tables")).env("PYTHONDONTWRITEBYTECODE", "1");
        let output = python.stdin(Stdio::null()).output()?;
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        case.hold(output.status.success(), "ruptures differ from those by the definition", || {
            format!("{}\n{}", words.join(" "), shortened(&err, 2000))
        });
    }
    Ok(true)
}

/// Calls the command, which must succeed; whether it did.
fn must_succeed(case: &mut Case<'_>, otherwise: &str, arguments: &[&str]) -> Result<bool, Error> {
    let outcome = case.call(arguments)?;
    let succeeded = outcome.code == Some(0);
    case.hold(succeeded, otherwise, || format!("{}: {}: {}", outcome.call, outcome.ending(), outcome.said()));
    Ok(succeeded)
}
