//! The standing attack: tries from outside to break what the `asperity` command promises of
//! files. `cargo xtask attack` builds the command and calls this, which knows of the project
//! only what a user knows, its command line and its documents.
//!
//! Each module is one way to do harm, and says at its head what must hold. A failure is
//! counted by kind and kept with its files and the calls that led to it. Every choice made by
//! chance follows from one seed, which is printed; only the races of processes do not repeat.

mod calls;
mod case;
mod chunks;
#[path = "../../support/commands.rs"]
#[expect(dead_code, reason = "the tests share it, and need more of it")]
mod commands;
mod disk;
mod faults;
#[path = "../../fuzz/src/file.rs"]
#[expect(unreachable_pub, reason = "the tests share it")]
mod file;
mod flips;
mod forge;
#[path = "../../fuzz/src/frames.rs"]
#[expect(unreachable_pub, reason = "the fuzzers share it")]
mod frames;
mod ground;
mod hostile;
mod kernel;
mod kills;
mod limits;
mod memory;
mod mixes;
mod operations;
mod pairs;
#[path = "../../fuzz/src/parts.rs"]
#[expect(dead_code, unreachable_pub, reason = "the fuzzers share it, and need more of it")]
mod parts;
mod power;
#[path = "../../../crates/testkit/src/random.rs"]
#[expect(unreachable_pub, reason = "a crate that the tests share has it")]
mod random;
mod soak;
mod studies;
mod tally;
mod verdict;
mod writers;

use std::fs::{self, File};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use clap::Parser;

use ground::{Error, Ground, Size};
use tally::{Tally, say};

/// The attacks, in the order in which they are made.
type Attack = fn(&Ground) -> Result<(), Error>;
const ATTACKS: [(&str, Attack); 11] = [
    ("chunks", chunks::attack),
    ("flips", flips::attack),
    ("mixes", mixes::attack),
    ("studies", studies::attack),
    ("pairs", pairs::attack),
    ("kills", kills::attack),
    ("limits", limits::attack),
    ("faults", faults::attack),
    ("power", power::attack),
    ("memory", memory::attack),
    ("soak", soak::attack),
];

/// What a call takes at most that says neither `--for-s` nor `--full`. An idle machine gets
/// through all cases in that time; a busy one leaves some out, and says so.
const USUAL_TIME: Duration = Duration::from_secs(150);

/// Tries to break, from outside, the promises of the built command about files.
#[derive(Debug, Parser)]
#[command(
    name = "cargo xtask attack",
    after_help = "\
Calls the built command as any user could, with damaged files, in pairs and
short of resources, and compares the outcome with the promises of the docs;
docs/extending.md has what each attack does.

Each attack lists the broken promises by kind. The files of the first cases of
each kind are kept in target/attack/found, with the calls that lead to them
(what.txt). Only races between processes do not repeat with the same seed.
Without --for-s and --full, the attacks end after 150 s; on a busy machine, the
cases left out are listed.

Exit codes:
  0  all promises were kept
  1  a promise was broken
  2  an attack could not be made"
)]
struct Arguments {
    /// Which attacks [default: all, one after the other].
    #[arg(value_name = "ATTACK", value_parser = ATTACKS.map(|(name, _)| name))]
    modules: Vec<String>,
    /// The built command.
    #[arg(long, hide = true)]
    program: PathBuf,
    /// The root folder of the checkout.
    #[arg(long, hide = true)]
    root: PathBuf,
    /// Folder for temporary files, and for the files of failed cases.
    #[arg(long, hide = true)]
    work: PathBuf,
    /// The seed of an earlier call [default: the time].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Repeat the attacks with new seeds until this many seconds have passed.
    #[arg(long, value_name = "SECONDS")]
    for_s: Option<u64>,
    /// Use all logs of chapter 5, and ten times as many cases or more: takes some hours.
    #[arg(long)]
    full: bool,
    /// Only the case with this number, in each attack.
    #[arg(long, value_name = "N")]
    case: Option<usize>,
}

fn main() -> ExitCode {
    match attack(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            say(&format!("error: the attack could not be made: {error}"));
            ExitCode::from(2)
        }
    }
}

/// Makes the attacks; whether all promises held.
fn attack(arguments: &Arguments) -> Result<bool, Error> {
    let Arguments { modules, program, root, work, seed, for_s, full, case } = arguments;
    let begun = Instant::now();
    let seed = match seed {
        Some(seed) => *seed,
        None => SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs() % 1_000_000,
    };
    fs::create_dir_all(work)?;
    let work = &work.canonicalize()?;
    let lock = File::create(work.join("lock"))?;
    lock.try_lock().map_err(|_| format!("another attack works in {}", work.display()))?;
    let [logs, cases, found] = ["logs", "work", "found"].map(|name| work.join(name));
    ground::emptied(&logs)?;
    ground::emptied(&cases)?;
    ground::emptied(&found)?;
    let mut ground = Ground {
        program: program.canonicalize().map_err(|error| format!("{}: {error}", program.display()))?,
        seed,
        size: if *full { Size::FULL } else { Size::USUAL },
        only: *case,
        deadline: None,
        work: cases,
        found,
        logs,
        root: root.canonicalize()?,
        tally: Mutex::new(Tally::default()),
        _lock: lock,
    };
    let chosen: Vec<(&str, Attack)> = ATTACKS
        .into_iter()
        .filter(|(name, _)| modules.is_empty() || modules.iter().any(|wanted| wanted == name))
        .collect();
    let end = for_s.map(|seconds| begun + Duration::from_secs(seconds));
    let mut not_made = false;
    loop {
        say(&format!("seed {}", ground.seed));
        let round_end = end.or_else(|| (!full).then(|| begun + USUAL_TIME));
        for (number, &(name, attack)) in chosen.iter().enumerate() {
            // What is left of the time, in equal shares.
            let left = u32::try_from(chosen.len() - number)?;
            ground.deadline = round_end.map(|end| {
                let now = Instant::now();
                now + end.saturating_duration_since(now) / left
            });
            // The others are made all the same.
            if let Err(error) = attack(&ground) {
                say(&format!("error: {name}: the attack could not be made: {error}"));
                not_made = true;
            }
        }
        if end.is_none_or(|end| Instant::now() >= end) || not_made {
            break;
        }
        ground.seed += 1;
    }
    let tally = ground.tally.into_inner().expect("no case panics with it");
    say(&format!("\n{tally}"));
    if not_made {
        return Err("see above".into());
    }
    let no_skips = std::env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
    let skipped = tally.skipped();
    if no_skips && !skipped.is_empty() {
        say(&format!("error: not tried, and nothing must be left out here: {}", skipped.join("; ")));
        return Ok(false);
    }
    Ok(!tally.has_failed())
}
