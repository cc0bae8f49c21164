//! `cargo xtask bench --against`: whether another revision is as fast as this checkout.
//!
//! The speed of a shared machine changes from minute to minute, and with it any time measured on it. So
//! both binaries run in turn, the order changing from pair to pair, and the ratio within a pair counts. The
//! verdict uses CPU time, user and system, which excludes time that other processes took.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::bench::BenchArguments;
use crate::cpu;
use crate::revision::Revision;
use crate::say::say;
use crate::workspace::{Failure, emptied, io, not_started, program, target_folder};

/// A command that both revisions run, by its name: LOG is there, OUT is not.
type Part = (&'static str, &'static [&'static str]);

const PARTS: [Part; 4] = [
    ("as-coded", &["run", "default", "--set", "parameter_set=as-coded", "--out", "OUT"]),
    ("as-stated", &["run", "default", "--set", "parameter_set=as-stated", "--out", "OUT"]),
    ("replay", &["replay", "LOG"]),
    ("reduce", &["reduce", "LOG", "--out", "OUT"]),
];

/// The named parts, in the order of the list.
fn parts(names: &[String]) -> Result<Vec<Part>, Failure> {
    if let Some(unknown) = names.iter().find(|name| PARTS.iter().all(|(part, _)| part != *name)) {
        return Err(Failure::Check(format!(
            "unknown part {unknown} (accepted with --against: {})",
            PARTS.map(|(name, _)| name).join(", ")
        )));
    }
    let is_named = |(part, _): &Part| names.is_empty() || names.iter().any(|name| name == part);
    Ok(PARTS.into_iter().filter(is_named).collect())
}

/// One of the two binaries.
struct Side {
    title: String,
    binary: PathBuf,
    /// The log of the default run that this binary made.
    log: PathBuf,
}

/// Compares the older revision with this checkout.
pub(crate) fn command(revision: &str, arguments: &BenchArguments) -> Result<(), Failure> {
    let is_within = compare(revision, arguments).map_err(Failure::of_comparison)?;
    if is_within { Ok(()) } else { Err(Failure::Exit { program: "bench".to_owned(), code: 1 }) }
}

fn compare(revision: &str, arguments: &BenchArguments) -> Result<bool, Failure> {
    let parts = parts(&arguments.parts)?;
    let folder = target_folder().join("bench-against");
    emptied(&folder)?;
    let mut sides = Vec::new();
    for (name, revision) in [("old", Revision::of(revision)?), ("new", Revision::checkout()?)] {
        say!("==> {name}: {}", revision.title);
        let built = revision.asperity()?;
        // A copy, which builds in the meantime do not change.
        let binary = folder.join(format!("asperity-{name}{}", std::env::consts::EXE_SUFFIX));
        fs::copy(&built, &binary).map_err(io("copy", &built))?;
        sides.push(Side { title: revision.title, binary, log: folder.join(format!("{name}.mcap")) });
    }
    for side in &sides {
        run_once(side, PARTS[0], &side.log)?;
    }
    let mut results = Vec::new();
    for part in parts {
        say!("==> {}: {} pairs", part.0, arguments.pairs);
        let out = folder.join("out");
        let once = |side: usize| {
            let times = run_once(&sides[side], part, &out)?;
            let removed = if out.is_dir() { fs::remove_dir_all(&out) } else { fs::remove_file(&out) };
            match removed {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(io("remove", &out)(error)),
                _ => Ok(times),
            }
        };
        // Not counted: it fills caches, and shows whether both know the command.
        once(0)?;
        once(1)?;
        let mut pairs = Vec::new();
        for number in 0..arguments.pairs.get() {
            let mut pair = [Times::default(); 2];
            for side in order(number) {
                pair[side] = once(side)?;
            }
            pairs.push(pair);
        }
        results.push((part.0, Compared::of(&pairs)));
    }
    report(&results, arguments.within).map_err(io("write to", Path::new("stdout")))
}

/// Which side runs first in a pair, and which second: 0 is the old one.
fn order(pair: usize) -> [usize; 2] {
    if pair.is_multiple_of(2) { [0, 1] } else { [1, 0] }
}

/// The times of one execution.
#[derive(Debug, Clone, Copy, Default)]
struct Times {
    /// User and system time of all its threads.
    cpu_s: f64,
    wall_s: f64,
}

/// Runs one part with one side.
fn run_once(side: &Side, (_, words): Part, out: &Path) -> Result<Times, Failure> {
    let mut command = program(&side.binary);
    command.args(words.iter().map(|word| match *word {
        "LOG" => side.log.as_os_str(),
        "OUT" => out.as_os_str(),
        word => word.as_ref(),
    }));
    timed(command.stdin(Stdio::null())).map_err(|failure| {
        let words: Vec<_> = command.get_args().map(|word| word.to_string_lossy()).collect();
        Failure::Check(format!(
            "{}: `asperity {}` {failure} (accepted: a revision that has this command with these flags, or only parts \
             that both have)",
            side.title,
            words.join(" "),
        ))
    })
}

/// Runs a command, which must succeed, and returns its times.
fn timed(command: &mut Command) -> Result<Times, Failure> {
    let usage = |error| Failure::Check(format!("has no CPU time: {error}"));
    let before_s = cpu::used_s().map_err(usage)?;
    let started = Instant::now();
    let output = command.output().map_err(not_started(command))?;
    let wall_s = started.elapsed().as_secs_f64();
    let cpu_s = cpu::used_s().map_err(usage)? - before_s;
    if output.status.success() {
        return Ok(Times { cpu_s, wall_s });
    }
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let error = said.lines().find_map(|line| line.strip_prefix("error: ")).unwrap_or("it does not say why");
    Err(Failure::Check(format!("ended with {}: {error}", output.status)))
}

/// The times of both sides for one part.
#[derive(Debug)]
struct Compared {
    /// Median of the old side's CPU time.
    old_cpu_s: f64,
    /// Quartiles of new over old, within pairs.
    cpu: [f64; 3],
    wall: [f64; 3],
}

impl Compared {
    fn of(pairs: &[[Times; 2]]) -> Compared {
        let ratios = |of: fn(&Times) -> f64| quartiles(pairs.iter().map(|[old, new]| of(new) / of(old)));
        Compared {
            old_cpu_s: quartiles(pairs.iter().map(|[old, _]| old.cpu_s))[1],
            cpu: ratios(|times| times.cpu_s),
            wall: ratios(|times| times.wall_s),
        }
    }
}

/// Lower quartile, median and upper quartile of one value or more; between two values they are interpolated linearly.
fn quartiles(values: impl IntoIterator<Item = f64>) -> [f64; 3] {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    [0.25, 0.5, 0.75].map(|share| {
        let place = share * (sorted.len() - 1) as f64;
        let [low, high] = [place.floor(), place.ceil()].map(|at| sorted[at as usize]);
        low + (high - low) * place.fract()
    })
}

/// Whether a ratio is within a share of 1, whichever of the two is the divisor.
fn is_within(ratio: f64, share: f64) -> bool {
    ratio <= 1.0 + share && 1.0 <= ratio * (1.0 + share)
}

/// Prints the table and the verdict, and returns whether all medians are within the limit.
fn report(results: &[(&str, Compared)], within: f64) -> io::Result<bool> {
    let mut out = io::stdout().lock();
    writeln!(out, "| part | old, CPU s | CPU time, new/old | quartiles | wall time, new/old | quartiles |")?;
    writeln!(out, "|---|---|---|---|---|---|")?;
    for (name, Compared { old_cpu_s, cpu, wall }) in results {
        let [cpu, wall] =
            [cpu, wall].map(|[lower, median, upper]| format!("{median:.3} | {lower:.3} to {upper:.3}"));
        writeln!(out, "| {name} | {old_cpu_s:.3} | {cpu} | {wall} |")?;
    }
    let percent = 100.0 * within;
    let mut all_within = true;
    for (name, Compared { cpu: [_, median, _], .. }) in results {
        if !is_within(*median, within) {
            all_within = false;
            let word = if *median > 1.0 { "slower" } else { "faster" };
            writeln!(out, "{name}: the new side is {word} by more than {percent} % of CPU time")?;
        }
    }
    if all_within {
        writeln!(out, "All medians of CPU time (user and system) are within {percent} %.")?;
    }
    Ok(all_within)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_interpolated_and_the_order_does_not_matter() {
        let of = |values: &[f64]| quartiles(values.iter().copied());
        assert_eq!(of(&[3.0]), [3.0, 3.0, 3.0]);
        assert_eq!(of(&[4.0, 1.0, 3.0, 2.0]), [1.75, 2.5, 3.25]);
        assert_eq!(of(&[9.0, 1.0, 5.0, 2.0, 7.0]), [2.0, 5.0, 7.0]);
        // A single disturbed pair moves no median.
        assert_eq!(of(&[1.0, 1.0, 1.0, 1.0, 50.0])[1], 1.0);
    }

    #[test]
    fn pairs_are_interleaved_and_each_side_goes_first_as_often() {
        let first: Vec<usize> = (0..20).map(|pair| order(pair)[0]).collect();
        assert_eq!(&first[..4], [0, 1, 0, 1]);
        assert_eq!(first.iter().sum::<usize>(), 10);
        assert!((0..20).all(|pair| order(pair)[0] + order(pair)[1] == 1));
    }

    #[test]
    fn ratios_are_of_new_to_old_within_a_pair() {
        let times = |cpu_s: f64, wall_s: f64| Times { cpu_s, wall_s };
        // The machine was half as fast during the second pair.
        let pairs = [[times(1.0, 2.0), times(1.1, 2.0)], [times(2.0, 4.0), times(2.2, 2.0)]];
        let compared = Compared::of(&pairs);
        assert_eq!(compared.old_cpu_s, 1.5);
        assert!(compared.cpu[1..].iter().all(|ratio| (ratio - 1.1).abs() < 1e-12));
        assert_eq!(compared.wall[1], 0.75);
    }

    #[test]
    fn what_is_near_enough_does_not_depend_on_the_side() {
        for ratio in [1.0, 1.029, 1.0 / 1.029] {
            assert!(is_within(ratio, 0.03), "{ratio}");
        }
        for ratio in [1.031, 1.0 / 1.031, 0.5, f64::NAN] {
            assert!(!is_within(ratio, 0.03), "{ratio}");
        }
    }

    #[test]
    fn parts_are_those_named_or_all() {
        let named = |names: &[&str]| parts(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        assert_eq!(named(&[]).expect("all of them"), PARTS);
        assert_eq!(named(&["replay", "as-coded"]).expect("both exist"), [PARTS[0], PARTS[2]]);
        let refused = named(&["replay", "loop"]).expect_err("that is a part of the other benchmark");
        assert!(refused.to_string().starts_with("unknown part loop (accepted with --against: "), "{refused}");
    }

    #[cfg(unix)]
    #[test]
    fn a_revision_without_the_command_is_named() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let log = folder.path().join("a.mcap");
        // A shell takes `reduce` for a script, and fails to find it.
        let side = Side { title: "1a2b3c4 An old one".to_owned(), binary: "/bin/sh".into(), log };
        let refused = run_once(&side, PARTS[3], &folder.path().join("out"));
        let problem = refused.expect_err("it knows no such command").to_string();
        assert!(problem.starts_with("1a2b3c4 An old one: `asperity reduce "), "{problem}");
        assert!(
            problem.contains("a.mcap --out ") && problem.contains(" ended with exit status: "),
            "{problem}"
        );
    }

    #[cfg(unix)]
    #[test]
    fn work_and_waiting_are_told_and_what_fails_says_why() {
        let sh = |script: &str| timed(Command::new("sh").args(["-c", script]));
        // Lower bounds only: the children of tests that run meanwhile count as well.
        let waited = sh("sleep 0.3").expect("sh runs");
        assert!(waited.wall_s >= 0.3, "{waited:?}");
        let worked = sh("i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done").expect("sh runs");
        assert!(worked.cpu_s > 0.02, "{worked:?}");
        let failed = sh("echo 'error: no such flag' >&2; exit 2").expect_err("it fails");
        assert_eq!(failed.to_string(), "ended with exit status: 2: no such flag");
    }
}
