//! Runs the programs that tests are compiled to: one process per module of tests, as many at once as
//! there are cores and those first that take longest. `cargo test` runs one program after the other,
//! and waits with all cores but one for the last test of each.

use std::io::Read;
use std::num::NonZeroUsize;
use std::panic::resume_unwind;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Instant;

use crate::say::say;
use crate::workspace::{Failure, not_started, output, program, root};

/// Environment variables for tests; those without a value are removed.
pub(crate) type Variables = [(&'static str, Option<PathBuf>)];

/// A test program, and the folder of its package, where cargo would run it.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Program {
    /// That of its target, such as `root` or `asperity_model`.
    pub(crate) name: String,
    path: PathBuf,
    folder: PathBuf,
}

/// The test programs that `cargo test --no-run` reports in JSON, a message per line.
pub(crate) fn programs(messages: &str) -> Vec<Program> {
    let of_line = |line: &str| {
        let path = PathBuf::from(text(line, "\"executable\":\"")?);
        let manifest = PathBuf::from(text(line, "\"manifest_path\":\"")?);
        // Cargo appends a hash of the inputs to the name of a program.
        let name = path.file_stem()?.to_str()?.rsplit_once('-')?.0.to_owned();
        let folder = manifest.parent()?.to_owned();
        let profile = line.split_once("\"profile\":{")?.1.split('}').next()?;
        profile.contains("\"test\":true").then_some(Program { name, path, folder })
    };
    messages.lines().filter_map(of_line).collect()
}

/// The text after a key in a line, up to the next quote.
fn text<'a>(line: &'a str, key: &str) -> Option<&'a str> {
    line.split_once(key)?.1.split('"').next()
}

/// The work of one process.
#[derive(Debug)]
pub(crate) struct Job {
    /// The program, and the module or the test.
    pub(crate) name: String,
    program: PathBuf,
    arguments: Vec<String>,
    folder: PathBuf,
}

impl Job {
    /// The selected tests of one program, a job per module; tests outside modules form one job.
    pub(crate) fn all_of(program: &Program) -> Result<Vec<Job>, Failure> {
        let mut modules: Vec<(String, Vec<String>)> = Vec::new();
        for test in tests(program, &[])? {
            let module = test.split_once("::").map_or(test.as_str(), |(module, _)| module).to_owned();
            match modules.iter_mut().find(|(name, _)| *name == module) {
                Some((_, tests)) => tests.push(test),
                None => modules.push((module, vec![test])),
            }
        }
        let job = |(module, tests): (String, Vec<String>)| {
            let exact = ["--exact", "--test-threads", "1"].map(str::to_owned);
            Job::of(program, &module, [tests, exact.to_vec()].concat())
        };
        Ok(modules.into_iter().map(job).collect())
    }

    /// The ignored tests of one program, a job each: all, or those in modules with that name.
    pub(crate) fn ignored(program: &Program, module: Option<&str>) -> Result<Vec<Job>, Failure> {
        let tests = tests(program, &["--ignored"])?.into_iter();
        let chosen = tests.filter(|test| module.is_none_or(|module| is_in(test, module)));
        let arguments = |test: &str| [test, "--exact", "--ignored"].map(str::to_owned).to_vec();
        Ok(chosen.map(|test| Job::of(program, &test, arguments(&test))).collect())
    }

    fn of(program: &Program, what: &str, arguments: Vec<String>) -> Job {
        let name = format!("{} {what}", program.name);
        Job { name, program: program.path.clone(), arguments, folder: program.folder.clone() }
    }

    /// A call of another program, in the root folder.
    pub(crate) fn call(name: &str, call: &Command) -> Job {
        let arguments = call.get_args().map(|argument| argument.to_string_lossy().into_owned());
        let program = call.get_program().into();
        Job { name: name.to_owned(), program, arguments: arguments.collect(), folder: root().to_owned() }
    }
}

/// Whether a test is in a module with that name, however deep.
fn is_in(test: &str, module: &str) -> bool {
    format!("::{test}").contains(&format!("::{module}::"))
}

/// The names of a program's tests, of all or of those that options choose.
fn tests(of: &Program, options: &[&str]) -> Result<Vec<String>, Failure> {
    let mut list = program(&of.path);
    let list = list.current_dir(&of.folder).args(["--list", "--format", "terse"]).args(options);
    let list = output(list)?;
    Ok(list.lines().filter_map(|line| line.strip_suffix(": test")).map(str::to_owned).collect())
}

/// The result of a job: success, and its output.
struct Outcome {
    passed: bool,
    said: String,
}

/// Jobs that wait for a core.
#[derive(Default)]
struct Waiting {
    jobs: Vec<Job>,
    /// Whether no more will come.
    is_complete: bool,
}

/// Runs jobs on all cores. One core begins by making them: `make` submits jobs as soon as their program is
/// compiled, so the other cores have work meanwhile. Among waiting jobs, those named in `first` go first,
/// in that order. Failures are shown at the end, with the time since the command started.
pub(crate) fn run_all(
    started: Instant,
    first: &[&str],
    variables: &Variables,
    make: impl FnOnce(&dyn Fn(Vec<Job>)) -> Result<(), Failure> + Send,
) -> Result<(), Failure> {
    let (waiting, changed) = (Mutex::new(Waiting::default()), Condvar::new());
    let rank = |job: &Job| first.iter().position(|name| *name == job.name).unwrap_or(first.len());
    let add = |jobs: Vec<Job>| {
        let mut waiting = lock(&waiting);
        waiting.jobs.extend(jobs);
        waiting.jobs.sort_by_key(rank);
        changed.notify_all();
    };
    let close = |abandon: bool| {
        let mut waiting = lock(&waiting);
        waiting.is_complete = true;
        if abandon {
            waiting.jobs.clear();
        }
        changed.notify_all();
    };
    let next = || {
        let waits = |waiting: &mut Waiting| waiting.jobs.is_empty() && !waiting.is_complete;
        let mut waiting = changed.wait_while(lock(&waiting), waits).unwrap_or_else(PoisonError::into_inner);
        (!waiting.jobs.is_empty()).then(|| waiting.jobs.remove(0))
    };
    let outcomes = Mutex::new(Vec::new());
    let work = || {
        while let Some(job) = next() {
            let outcome = run(&job, variables).inspect_err(|_| close(true))?;
            lock(&outcomes).push((job.name, outcome));
        }
        Ok(())
    };
    let make_and_work = || {
        let made = make(&add);
        close(made.is_err());
        made.and_then(|()| work())
    };
    let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    thread::scope(|scope| {
        let mut workers = vec![scope.spawn(make_and_work)];
        workers.extend((1..cores).map(|_| scope.spawn(work)));
        workers.into_iter().try_for_each(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic)))
    })?;
    let outcomes = outcomes.into_inner().unwrap_or_else(PoisonError::into_inner);
    let failed: Vec<_> = outcomes.iter().filter(|(_, outcome)| !outcome.passed).collect();
    for (name, outcome) in &failed {
        say!("\n==> {name}:\n{}", outcome.said.trim_end());
    }
    let took = started.elapsed().as_secs_f64();
    say!("==> {} groups of tests in {took:.0} s, {} failed", outcomes.len(), failed.len());
    let names: Vec<&str> = failed.iter().map(|(name, _)| name.as_str()).collect();
    match names.is_empty() {
        true => Ok(()),
        false => Err(Failure::Check(format!("tests failed: {}", names.join(", ")))),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs one, and collects both its outputs in order of arrival.
fn run(job: &Job, variables: &Variables) -> Result<Outcome, Failure> {
    let began = Instant::now();
    let mut command = Command::new(&job.program);
    command.args(&job.arguments).current_dir(&job.folder).stdin(Stdio::null());
    for (name, value) in variables {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    let failed = |error| Failure::Io { what: format!("run {}", job.name), error };
    let (mut from, to) = std::io::pipe().map_err(failed)?;
    command.stdout(to.try_clone().map_err(failed)?).stderr(to);
    let mut child = command.spawn().map_err(|error| not_started(&command, error))?;
    // It owns the writing end; unless it is dropped, reading would not end.
    drop(command);
    let mut said = Vec::new();
    from.read_to_end(&mut said).map_err(failed)?;
    let status = child.wait().map_err(failed)?;
    let outcome = Outcome { passed: status.success(), said: String::from_utf8_lossy(&said).into_owned() };
    let word = if outcome.passed { "ok    " } else { "FAILED" };
    say!("{word} {}, {:.1} s{}", job.name, began.elapsed().as_secs_f64(), counts(&outcome.said));
    // A test without its requirements has reported it.
    outcome.said.lines().filter(|line| line.starts_with("SKIPPED")).for_each(|line| say!("{line}"));
    Ok(outcome)
}

/// Numbers of passed and failed tests, from the last line of their program.
fn counts(said: &str) -> String {
    let result = said.lines().rev().find_map(|line| line.strip_prefix("test result: "));
    let counts = result.and_then(|result| result.split(". ").nth(1)).unwrap_or_default();
    let told = counts.split("; ").take(3).filter(|count| !count.is_empty() && !count.starts_with("0 "));
    told.map(|count| format!(", {count}")).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn tests_are_in_their_modules() {
        assert!(is_in("in_ci::random", "in_ci") && is_in("reference::in_ci::as_coded", "in_ci"));
        assert!(!is_in("reference::as_coded", "in_ci") && !is_in("reference::in_ci", "in_ci"));
        assert!(!is_in("not_in_ci::random", "in_ci"));
    }

    #[test]
    fn programs_of_tests_are_found_among_what_cargo_says() {
        let line = |test: bool, executable: &str| {
            format!(
                "{{\"manifest_path\":\"/w/crates/cli/Cargo.toml\",\"target\":{{\"test\":true}},\
                 \"profile\":{{\"opt_level\":\"1\",\"test\":{test}}},\"executable\":{executable}}}"
            )
        };
        let messages = [
            line(true, "\"/t/debug/deps/asperity_cli-0a1b\""),
            line(false, "\"/t/debug/asperity\""),
            line(true, "null"),
            "{\"reason\":\"build-finished\",\"success\":true}".to_owned(),
        ];
        let found = programs(&messages.join("\n"));
        let [found] = &found[..] else { panic!("{found:?}") };
        assert_eq!(found.name, "asperity_cli");
        assert_eq!(found.folder, Path::new("/w/crates/cli"));
    }
}
