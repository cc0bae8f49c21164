//! The basis of all attacks: the built command, a working folder, genuine logs, and the seed of all random
//! choices.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::calls::{Call, Outcome};
use crate::file::{self, Message};
use crate::random::Random;
use crate::tally::Tally;

/// How many cases each attack tries.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Size {
    /// Whether the logs are those of a whole pipeline, and every chunk and border has its turn.
    pub(crate) full: bool,
    pub(crate) flips: usize,
    pub(crate) mixes: usize,
    /// Of each kind of harm to studies.
    pub(crate) studies: usize,
    /// Rounds over all commands, of pairs and of eights.
    pub(crate) pairs: usize,
    pub(crate) kills: usize,
    /// Operations that fail, and as many power cuts.
    pub(crate) faults: usize,
    /// Allocations that are refused, of each reading command.
    pub(crate) refusals: usize,
    /// Random scenarios.
    pub(crate) soak: usize,
}

impl Size {
    /// For every change: a few minutes.
    pub(crate) const USUAL: Size = Size {
        full: false,
        flips: 200,
        mixes: 60,
        studies: 60,
        pairs: 5,
        kills: 24,
        faults: 160,
        refusals: 12,
        soak: 60,
    };

    /// For a night.
    pub(crate) const FULL: Size = Size {
        full: true,
        flips: 2000,
        mixes: 600,
        studies: 1000,
        pairs: 200,
        kills: 1000,
        faults: usize::MAX,
        refusals: 300,
        soak: 1000,
    };
}

/// Why an attack could not be made; that one failed to do harm is no error.
pub(crate) type Error = Box<dyn std::error::Error + Send + Sync>;

/// A genuine log, read by other code than that which wrote it.
pub(crate) struct Genuine {
    pub(crate) name: String,
    pub(crate) bytes: Vec<u8>,
    /// Each with the number of its chunk.
    pub(crate) messages: Vec<(usize, Message)>,
    /// Of the records in `bytes`, those that are chunks.
    pub(crate) chunks: Vec<file::Record>,
}

impl Genuine {
    /// Reads a whole log.
    pub(crate) fn read(path: &Path) -> Result<Genuine, Error> {
        let bytes = fs::read(path)?;
        let messages = file::messages(&bytes).map_err(|what| format!("{}: {what}", path.display()))?;
        let chunks = file::chunks(&bytes);
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Genuine { name, bytes, messages, chunks })
    }

    /// Its messages without those of some chunks.
    pub(crate) fn without(&self, lost: &[usize]) -> Vec<&Message> {
        let kept = self.messages.iter().filter(|(chunk, _)| !lost.contains(chunk));
        kept.map(|(_, message)| message).collect()
    }
}

/// See the head of this file.
pub(crate) struct Ground {
    pub(crate) program: PathBuf,
    /// The round and the seed.
    pub(crate) seed: u64,
    pub(crate) size: Size,
    /// Only the case with this number.
    pub(crate) only: Option<usize>,
    /// The time to stop, whatever is left.
    pub(crate) deadline: Option<Instant>,
    /// Where cases work.
    pub(crate) work: PathBuf,
    /// Where the files of failures are kept.
    pub(crate) found: PathBuf,
    /// Where genuine logs are.
    pub(crate) logs: PathBuf,
    /// The root folder of the checkout.
    pub(crate) root: PathBuf,
    pub(crate) tally: Mutex<Tally>,
    /// No other process uses these folders while this lock is held.
    pub(crate) _lock: File,
}

/// A run of the slider of the thesis' program, in the folder of the case, with these further overrides.
pub(crate) const RUN: [&str; 7] =
    ["run", "default", "--set", "parameter_set=as-coded", "--quiet", "--out", "run.mcap"];

/// A run of a twentieth of a second with all kinds of records and events.
pub(crate) const SMALL: [&str; 4] = ["--set", "time.step_s=1e-7", "--set", "time.duration_s=1"];

/// The run with a log of mostly states of all blocks, so that it has several chunks.
pub(crate) const DENSE: [&str; 6] =
    ["--set", "time.step_s=1e-7", "--set", "time.duration_s=0.4", "--set", "recording.fields_s=0.0005"];

/// A run whose contacts cover an area: its records have components across the sliding direction.
pub(crate) const AREA: [&str; 11] = [
    "sheet-coarse",
    "--set",
    "slider.blocks=13",
    "--set",
    "slider.length_m=0.048",
    "--set",
    "normal_load.total_n=60",
    "--set",
    "drive.across=2",
    "--set",
    "time.duration_s=0.2",
];

/// A run by rate-and-state friction: its records have states and largest speeds.
pub(crate) const STATE: [&str; 3] = ["rate-and-state", "--set", "time.duration_s=2"];

/// Another run that looks the same from outside.
pub(crate) const OTHER: [&str; 2] = ["--set", "normal_load.tilt=-0.3"];

impl Ground {
    /// Runs the command, which must succeed to give something to attack.
    pub(crate) fn succeed(&self, folder: &Path, arguments: &[&str]) -> Result<Outcome, Error> {
        let outcome = Call::new(&self.program, folder, arguments)?.run()?;
        if outcome.code != Some(0) {
            let Outcome { call, err, .. } = &outcome;
            return Err(
                format!("{call} in {}: {}: {}", folder.display(), outcome.ending(), err.trim()).into()
            );
        }
        Ok(outcome)
    }

    /// A genuine log of the default scenario, made when it is first asked for.
    pub(crate) fn genuine(&self, name: &str, run: &[&str]) -> Result<Genuine, Error> {
        self.genuine_of(name, &[&["default", "--set", "parameter_set=as-coded"], run].concat())
    }

    /// The genuine log of a scenario with overrides.
    pub(crate) fn genuine_of(&self, name: &str, run: &[&str]) -> Result<Genuine, Error> {
        let path = self.logs.join(format!("{name}.mcap"));
        if !path.exists() {
            let file = format!("{name}.mcap");
            self.succeed(&self.logs, &[&["run", "--quiet", "--out", &file], run].concat())?;
            // A log that counts as damaged already would prove nothing.
            self.succeed(&self.logs, &["check", &file])?;
        }
        Genuine::read(&path)
    }

    /// What writing commands are given.
    pub(crate) fn inputs(&self) -> PathBuf {
        self.logs.join("inputs")
    }

    /// The library that refuses memory, which cargo builds beside the attack.
    pub(crate) fn library(&self) -> PathBuf {
        self.program.with_file_name("examples").join("librefuse_memory.so")
    }

    /// The log of the default scenario; of a full attack, those of all runs of a pipeline.
    pub(crate) fn genuine_logs(&self) -> Result<Vec<PathBuf>, Error> {
        if !self.size.full {
            self.genuine("default", &[])?;
            return Ok(vec![self.logs.join("default.mcap")]);
        }
        let pipeline = self.root.join("pipelines/chapter5.toml");
        let pipeline = pipeline.to_str().ok_or("the path of the checkout is no text")?;
        self.succeed(&self.logs, &["reproduce", pipeline, "--quiet", "--out", "chapter5"])?;
        logs_in(&self.logs.join("chapter5/runs"))
    }

    /// Some of the cases, by chance; all of them in a full round.
    pub(crate) fn some_of(&self, cases: usize, some: usize) -> Vec<usize> {
        self.some_of_each(&vec![(); cases], some)
    }

    /// Some of the cases, given the kind of each: by chance, and one of every kind before a second of any. In a
    /// full round, all of them.
    pub(crate) fn some_of_each<Kind: Ord>(&self, kinds: &[Kind], some: usize) -> Vec<usize> {
        let mut cases: Vec<usize> = (0..kinds.len()).collect();
        if self.size.full {
            return cases;
        }
        let mut random = Random::new(self.seed);
        for last in (1..cases.len()).rev() {
            cases.swap(last, random.below(last as u64 + 1) as usize);
        }
        let mut before = BTreeMap::new();
        let mut ranked: Vec<(usize, usize)> = Vec::new();
        for case in cases {
            let rank = before.entry(&kinds[case]).or_insert(0);
            ranked.push((*rank, case));
            *rank += 1;
        }
        ranked.sort_by_key(|(rank, _)| *rank);
        ranked.into_iter().take(some).map(|(_, case)| case).collect()
    }

    /// When an attack of several parts leaves the rest of its time to the next part.
    pub(crate) fn part_deadline(&self) -> Option<Instant> {
        // However late it is, something of every part is tried.
        const LEAST: Duration = Duration::from_secs(3);
        let now = Instant::now();
        let share = |deadline: Instant| deadline.saturating_duration_since(now).mul_f64(0.6).max(LEAST);
        self.deadline.map(|deadline| now + share(deadline))
    }
}

/// The logs in a folder.
pub(crate) fn logs_in(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "mcap") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// Makes a folder empty.
pub(crate) fn emptied(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    fs::create_dir_all(folder)
}
