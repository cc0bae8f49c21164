//! One case: its own folder, calls of the command in it, and the failures. Cases of an attack run on all
//! cores; the files of failed ones are kept, with the calls.

use std::fs;
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::calls::{Call, Outcome};
use crate::ground::{Error, Ground, emptied};
use crate::random::Random;
use crate::tally::say;

/// Interval between reports on the progress of an attack.
const NEWS: Duration = Duration::from_secs(5);

/// See the head of this file.
pub(crate) struct Case<'a> {
    pub(crate) ground: &'a Ground,
    pub(crate) number: usize,
    /// Its random numbers.
    pub(crate) random: Random,
    pub(crate) folder: PathBuf,
    /// Kind and detail of each failure.
    broken: Vec<(String, String)>,
    calls: String,
}

/// Tries all cases of an attack, on all cores.
pub(crate) fn try_all(
    ground: &Ground,
    module: &'static str,
    part: &str,
    cases: usize,
    attempt: impl Fn(&mut Case<'_>) -> Result<(), Error> + Sync,
) -> Result<(), Error> {
    let workers = thread::available_parallelism().map_or(1, usize::from);
    try_by(ground, module, part, cases, workers, attempt)
}

/// Makes one case that others need, whichever number was asked for.
pub(crate) fn once(
    ground: &Ground,
    module: &'static str,
    part: &str,
    attempt: impl FnOnce(&mut Case<'_>) -> Result<(), Error>,
) -> Result<(), Error> {
    Case::run(ground, module, part, 0, attempt)
}

/// Tries cases, `workers` of them in parallel: one, where a case itself starts several processes.
pub(crate) fn try_by(
    ground: &Ground,
    module: &'static str,
    part: &str,
    cases: usize,
    workers: usize,
    attempt: impl Fn(&mut Case<'_>) -> Result<(), Error> + Sync,
) -> Result<(), Error> {
    let next = AtomicUsize::new(0);
    let done = AtomicUsize::new(0);
    let error = Mutex::new(None);
    let started = Instant::now();
    let before = ground.tally.lock().expect("no case panics with it").counts(module);
    let deadline = ground.part_deadline();
    let is_over = || deadline.is_some_and(|deadline| Instant::now() >= deadline);
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= cases || is_over() || error.lock().expect("nobody panics with it").is_some() {
                return;
            }
            if ground.only.is_none_or(|only| only == number)
                && let Err(problem) = Case::run(ground, module, part, number, &attempt)
            {
                *error.lock().expect("nobody panics with it") = Some(problem);
            }
            done.fetch_add(1, Ordering::Relaxed);
        }
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..workers.max(1)).map(|_| scope.spawn(work)).collect();
        let mut said = Instant::now();
        while !workers.iter().all(|worker| worker.is_finished()) {
            thread::sleep(Duration::from_millis(20));
            if said.elapsed() > NEWS {
                said = Instant::now();
                let failed = ground.tally.lock().expect("no case panics with it").counts(module).1 - before.1;
                let done = done.load(Ordering::Relaxed);
                say(&format!("  {module}: {part}: {done} of {cases}, {failed} failed"));
            }
        }
    });
    if let Some(error) = error.into_inner().expect("nobody panics with it") {
        return Err(error);
    }
    let (tried, failed) = ground.tally.lock().expect("no case panics with it").counts(module);
    let (tried, failed) = (tried - before.0, failed - before.1);
    let took_s = started.elapsed().as_secs_f64();
    let left_out = match cases.saturating_sub(done.into_inner()) {
        0 => String::new(),
        cases => format!("; {cases} left out, time was over"),
    };
    say(&format!("  {module}: {part}: {tried} tried, {failed} failed, in {took_s:.1} s{left_out}"));
    Ok(())
}

impl<'a> Case<'a> {
    fn run(
        ground: &'a Ground,
        module: &'static str,
        part: &str,
        number: usize,
        attempt: impl FnOnce(&mut Case<'_>) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let name = format!("{module}-{}-{number}", part.replace(|c: char| !c.is_ascii_alphanumeric(), "-"));
        let folder = ground.work.join(&name);
        emptied(&folder)?;
        let digest = blake3::hash(format!("{} {module} {part} {number}", ground.seed).as_bytes());
        let seed = digest.as_bytes().first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let random = Random::new(seed);
        let mut case = Case { ground, number, random, folder, broken: Vec::new(), calls: String::new() };
        attempt(&mut case).map_err(|error| format!("{name}: {error}"))?;
        let Case { folder, broken, calls, .. } = case;
        let found = ground.found.join(module).join(format!("{}-{name}", ground.seed));
        let keep = ground.tally.lock().expect("no case panics with it").count(module, &broken, &found);
        if !keep {
            return Ok(fs::remove_dir_all(&folder)?);
        }
        let mut text = format!("cargo xtask attack {module} --seed {} --case {number}\n\n", ground.seed);
        for (kind, detail) in &broken {
            text += &format!("{kind}\n{detail}\n\n");
        }
        text += &format!("The calls, in this folder:\n{calls}");
        fs::write(folder.join("what.txt"), text)?;
        emptied(&found)?;
        fs::remove_dir(&found)?;
        Ok(fs::rename(&folder, &found)?)
    }

    /// A path in the folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes a file into the folder.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        Ok(fs::write(self.path(name), bytes)?)
    }

    /// Records a broken promise.
    pub(crate) fn broke(&mut self, kind: impl Into<String>, detail: impl Into<String>) {
        let kind = kind.into();
        if self.broken.iter().all(|(known, _)| *known != kind) {
            self.broken.push((kind, detail.into()));
        }
    }

    /// Checks a result against a documented property.
    pub(crate) fn hold(&mut self, holds: bool, kind: &str, detail: impl FnOnce() -> String) {
        if !holds {
            let detail = detail();
            self.broke(kind, detail);
        }
    }

    /// Calls the command in the folder. It must end by itself and not fall over.
    pub(crate) fn call(&mut self, arguments: &[&str]) -> Result<Outcome, Error> {
        let outcome = Call::new(&self.ground.program, &self.folder, arguments)?.run()?;
        self.must_end_well(&outcome);
        Ok(outcome)
    }

    /// Records a call without judging it.
    pub(crate) fn note(&mut self, outcome: &Outcome) {
        self.calls += &format!("{}    # {}\n", outcome.call, outcome.ending());
    }

    /// Checks for every call: it ends by itself, with a code.
    pub(crate) fn must_end_well(&mut self, outcome: &Outcome) {
        self.note(outcome);
        let command = outcome.call.split("asperity ").nth(1).unwrap_or_default();
        let command = command.split(' ').next().unwrap_or_default().to_owned();
        let detail = || format!("{}: {}: {}", outcome.call, outcome.ending(), outcome.said());
        if outcome.panicked() {
            self.broke(format!("{command} panics"), detail());
        } else if outcome.hung {
            self.broke(format!("{command} hangs"), detail());
        } else if outcome.code.is_none() {
            self.broke(format!("{command} is ended by a signal"), detail());
        }
    }
}
