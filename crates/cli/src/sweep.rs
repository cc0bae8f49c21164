//! `asperity sweep`: parameter studies.

use std::collections::{BTreeSet, VecDeque};
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, Write};
use std::num::NonZeroUsize;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::Duration;

use asperity_model::text;
use asperity_run::Notice;
use asperity_study::emit::{Array, Job, USUAL_TASKS, UnderWay, Word, arrays};
use asperity_study::results::{Counts, MOST_DEATHS, Results, State, parse_ranges, ranges};
use asperity_study::segment::{Kind, Writer, this_node};
use asperity_study::verification::{Sample, Verification, number_in_parts};
use asperity_study::work::{Made, PATIENCE, Ways, clear_done, make_and_store};
use asperity_study::{Plan, staging};

use crate::args::{
    SweepChunk, SweepCollectArguments, SweepCommand, SweepEmitArguments, SweepEngine, SweepGoArguments,
    SweepRunArguments, SweepStatusArguments,
};
use crate::collect;
use crate::exit::{Code, Failure};
use crate::interrupt;
use crate::outputs::create_folder;
use crate::progress::{Board, StudyProgress};
use crate::study::{faults, in_words, outcome_of, read, read_plan, unreadable};
use crate::terminal::{self, say};
use crate::{sweep_log, sweep_plan};

pub(crate) fn command(command: &SweepCommand, board: &Board) -> Result<(), Failure> {
    match command {
        SweepCommand::Go(arguments) => go(arguments, board),
        SweepCommand::Log(arguments) => sweep_log::command(arguments, board),
        SweepCommand::Plan(arguments) => sweep_plan::command(arguments, board),
        SweepCommand::Run(arguments) if arguments.worker => work(arguments),
        SweepCommand::Run(arguments) => run(arguments, board),
        SweepCommand::Status(arguments) => status(arguments),
        SweepCommand::Collect(arguments) => collect::tables(arguments, board),
        #[cfg(feature = "analysis")]
        SweepCommand::Draw(arguments) => collect::figures(arguments, board),
        SweepCommand::Emit(arguments) => emit(arguments),
    }
}

fn status(arguments: &SweepStatusArguments) -> Result<(), Failure> {
    let SweepStatusArguments { folder, tasks, array_size, under_way, verify } = arguments;
    let (plan, results) = read(folder)?;
    let counts = results.counts();
    let verification = match verify {
        Some(sample) => Some(Verification::of(&sampled(*sample, &plan)?, &results, None)),
        None => None,
    };
    if let Some(tasks) = *tasks {
        let (lacking, number): (Vec<u64>, fn(u64, u64) -> u64) = match &verification {
            Some(Verification { due, missing, .. }) => {
                (due.iter().chain(missing).copied().collect(), number_in_parts)
            }
            None => (results.missing().collect(), |run, _| run),
        };
        let under_way = match under_way {
            Some(path) => text::read(path)
                .map_err(|error| error.to_string())
                .and_then(|text| UnderWay::read(&text, plan.rows.len() as u64))
                .map_err(|error| Failure::BadInput(format!("--under-way {}: {error}", path.display())))?,
            None => UnderWay::default(),
        };
        let lacking = lacking.into_iter().filter(|run| !under_way.has(|parts| number(*run, parts)));
        let numbers = lacking.map(|run| number(run, tasks));
        for Array { offset, tasks, parts } in arrays(numbers, tasks, *array_size) {
            say(format_args!("{offset} {tasks} {parts}"))?;
        }
        faults(&results).for_each(|fault| terminal::note(&fault));
        return outcome_of(&results, counts);
    }
    say(in_words(&plan, counts))?;
    let of = |word: &str| {
        ranges(plan.rows.iter().map(|row| row.run).filter(|run| results.state(*run).word() == word))
    };
    for name in ["failed", "quarantined", "refused", "contradicted", "missing"] {
        let runs = of(name);
        if !runs.is_empty() {
            say(format_args!("{name}: {runs}"))?;
        }
    }
    let begun = staging::begun(folder).map_err(|error| unreadable(folder, &error))?;
    let begun = || begun.iter().filter(|(run, _)| results.is_missing(*run));
    if begun().next().is_some() {
        let bytes: u64 = begun().map(|(_, bytes)| bytes).sum();
        let runs = ranges(begun().map(|(run, _)| *run));
        say(format_args!("begun: {runs}, with {:.1} MB in {}", bytes as f64 / 1e6, staging::FOLDER))?;
    }
    for (path, bytes) in &results.torn {
        say(format_args!("{}: its last {bytes} bytes are an incomplete result", path.display()))?;
    }
    for path in &results.foreign {
        say(format_args!("{}: not a segment of this plan, left alone", path.display()))?;
    }
    verification.iter().flat_map(Verification::lines).try_for_each(say)?;
    faults(&results).try_for_each(say)?;
    outcome_of(&results, counts)?;
    verification.as_ref().map_or(Ok(()), outcome_of_verification)
}

/// Plans a study, makes its missing runs, and its tables and figures.
fn go(arguments: &SweepGoArguments, board: &Board) -> Result<(), Failure> {
    let SweepGoArguments { sweep, out, skip_refused, jobs, max_fails, to, no_provenance } = arguments;
    let plan = sweep_plan::begun(sweep, out, *skip_refused, *jobs, board)?;
    let results = Results::read(out, &plan).map_err(|error| unreadable(out, &error))?;
    let wanted = Wanted { jobs: *jobs, max_fails: *max_fails, ..Wanted::default() };
    let missing: Vec<u64> = results.missing().collect();
    make(&plan, out, results, &missing, &wanted, board)?;
    let (folder, no_provenance) = (out.clone(), *no_provenance);
    collect::tables(&SweepCollectArguments { folder, to: to.clone(), out: None, no_provenance }, board)
}

/// Makes the runs over axes of a plan that are not made yet; `collect` reports which have failed.
#[cfg(feature = "analysis")]
pub(crate) fn make_numbered(
    plan: &Plan,
    folder: &Path,
    jobs: Option<NonZeroUsize>,
    board: &Board,
) -> Result<(), Failure> {
    let results = Results::read(folder, plan).map_err(|error| unreadable(folder, &error))?;
    let wanted = Wanted { jobs, ..Wanted::default() };
    let missing: Vec<u64> = results.missing().filter(|run| *run <= plan.numbered()).collect();
    make(plan, folder, results, &missing, &wanted, board).map(drop)
}

fn run(arguments: &SweepRunArguments, board: &Board) -> Result<(), Failure> {
    let SweepRunArguments { folder, index, chunk, verify, jobs, max_fails, patience_s, .. } = arguments;
    let (plan, results) = read(folder)?;
    plan.check_code(folder).map_err(Failure::bad_input)?;
    let chosen: Option<BTreeSet<u64>> = match index {
        None => None,
        Some(text) => {
            let runs = parse_ranges(text, plan.rows.len() as u64);
            Some(runs.map_err(|error| Failure::BadInput(format!("--index {error}")))?.into_iter().collect())
        }
    };
    let is_chosen = |run: &u64| {
        chosen.as_ref().is_none_or(|chosen| chosen.contains(run))
            && chunk.is_none_or(|SweepChunk { part, of }| {
                let number = if verify.is_some() { number_in_parts(*run, of) } else { *run };
                number % of == part % of
            })
    };
    let wanted = Wanted { jobs: *jobs, max_fails: *max_fails, patience_s: *patience_s, verify: *verify };
    if let Some(sample) = verify {
        let mut chosen = sampled(*sample, &plan)?;
        chosen.retain(is_chosen);
        return verify_chosen(&plan, folder, results, &chosen, &wanted, board);
    }
    let missing: Vec<u64> = results.missing().filter(is_chosen).collect();
    let results = make(&plan, folder, results, &missing, &wanted, board)?;
    made(&plan, &results, results.counts_of(is_chosen), board)
}

/// Makes runs a second time if they have a result, and compares both.
fn verify_chosen(
    plan: &Plan,
    folder: &Path,
    results: Results,
    chosen: &BTreeSet<u64>,
    wanted: &Wanted,
    board: &Board,
) -> Result<(), Failure> {
    let here = this_node();
    let due = Verification::of(chosen, &results, Some(&here)).due;
    let results = make(plan, folder, results, &due, wanted, board)?;
    let verification = Verification::of(chosen, &results, Some(&here));
    verification.lines().iter().try_for_each(say)?;
    faults(&results).try_for_each(say)?;
    outcome_of(&results, Counts::default())?;
    outcome_of_verification(&verification)
}

/// The exit code of a verification that has found no fault.
fn outcome_of_verification(verification: &Verification) -> Result<(), Failure> {
    if verification.is_incomplete() { Code::Incomplete.said() } else { Ok(()) }
}

/// The runs that are verified.
fn sampled(sample: Sample, plan: &Plan) -> Result<BTreeSet<u64>, Failure> {
    sample.of(plan).map_err(|error| Failure::BadInput(format!("--verify {error}")))
}

/// How runs are made.
struct Wanted {
    jobs: Option<NonZeroUsize>,
    max_fails: Option<u64>,
    patience_s: f64,
    /// Given if runs are made a second time.
    verify: Option<Sample>,
}

impl Default for Wanted {
    fn default() -> Wanted {
        Wanted { jobs: None, max_fails: None, patience_s: PATIENCE.as_secs_f64(), verify: None }
    }
}

/// Makes runs that are missing, or are verified. Returns all results.
fn make(
    plan: &Plan,
    folder: &Path,
    results: Results,
    runs: &[u64],
    wanted: &Wanted,
    board: &Board,
) -> Result<Results, Failure> {
    clear_done(folder, &results).map_err(Failure::Failed)?;
    let deaths = |run: &u64| match results.state(*run) {
        State::Missing(deaths) => deaths,
        _ => 0,
    };
    let queue: VecDeque<(u64, u32)> = runs.iter().map(|run| (*run, deaths(run))).collect();
    if queue.is_empty() {
        return Ok(results);
    }
    interrupt::install()?;
    let jobs = wanted.jobs.or_else(|| thread::available_parallelism().ok()).map_or(1, NonZeroUsize::get);
    let jobs = jobs.min(queue.len());
    let study = Study {
        plan,
        folder,
        wanted,
        shared: Mutex::new(Shared {
            progress: board.study(queue.len() as u64),
            queue,
            workers: Vec::new(),
            deaths: None,
            failed: 0,
            problem: None,
        }),
        board,
    };
    drop(results);
    thread::scope(|scope| {
        // If the system grants fewer threads, those do all the work.
        let supervise = || study.supervise();
        let start = |_| thread::Builder::new().spawn_scoped(scope, supervise);
        let started: Vec<_> = (0..jobs).map(start).collect();
        if let Some(Err(error)) = started.first() {
            study.give_up(format!("failed to start a thread: {error}"));
        }
        let supervisors: Vec<_> = started.into_iter().flatten().collect();
        while !supervisors.iter().all(|supervisor| supervisor.is_finished()) {
            if interrupt::has_come() {
                study.shared().workers.iter().for_each(|worker| lock(worker).tell = None);
            }
            thread::sleep(LOOK_INTERVAL);
        }
    });
    let shared = study.shared.into_inner().unwrap_or_else(PoisonError::into_inner);
    drop(shared.progress);
    if let Some(code) = interrupt::code() {
        board.line("interrupted; called again, the command continues from here");
        return Err(Failure::Said(code));
    }
    if let Some(problem) = shared.problem {
        return Err(Failure::Failed(problem));
    }
    let results = Results::read(folder, plan).map_err(|error| unreadable(folder, &error))?;
    clear_done(folder, &results).map_err(Failure::Failed)?;
    Ok(results)
}

/// Prints the state after runs were made; some of them were requested.
fn made(plan: &Plan, results: &Results, counts: Counts, board: &Board) -> Result<(), Failure> {
    board.line(&in_words(plan, results.counts()));
    faults(results).for_each(|fault| board.line(&fault));
    outcome_of(results, counts)
}

/// A worker's message that another process makes a run.
const BY_ANOTHER: &str = "by another";

/// Makes runs in worker processes.
struct Study<'a> {
    plan: &'a Plan,
    folder: &'a Path,
    wanted: &'a Wanted,
    shared: Mutex<Shared>,
    board: &'a Board,
}

/// The shared state of the workers' supervisors.
struct Shared {
    /// Runs to be made, and how often their process died.
    queue: VecDeque<(u64, u32)>,
    workers: Vec<Arc<Mutex<Reins>>>,
    /// The segment of recorded deaths, once there is one.
    deaths: Option<Writer>,
    failed: u64,
    progress: StudyProgress,
    /// Why no more runs are started.
    problem: Option<String>,
}

/// Time between checks for signals.
const LOOK_INTERVAL: Duration = Duration::from_millis(20);

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A process that makes the requested runs, one after the other.
struct Worker {
    reins: Arc<Mutex<Reins>>,
    hear: BufReader<ChildStdout>,
}

/// The channel to a worker. When it closes, the worker stops its run and ends.
struct Reins {
    child: Child,
    tell: Option<ChildStdin>,
}

impl Worker {
    fn start(folder: &Path, wanted: &Wanted) -> io::Result<Worker> {
        let Wanted { patience_s, verify, .. } = wanted;
        let mut child = Command::new(std::env::current_exe()?)
            .args(["--quiet", "sweep", "run", "--worker", "--patience-s", &patience_s.to_string()])
            .args(verify.map(|sample| format!("--verify={sample}")))
            .arg("--")
            .arg(folder)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (tell, hear) = (child.stdin.take(), child.stdout.take());
        let hear = BufReader::new(hear.ok_or_else(|| io::Error::other("no pipe"))?);
        Ok(Worker { reins: Arc::new(Mutex::new(Reins { child, tell })), hear })
    }

    /// Requests a run.
    fn begin(&mut self, run: u64) -> Option<()> {
        let mut reins = lock(&self.reins);
        let tell = reins.tell.as_mut()?;
        writeln!(tell, "{run}").and_then(|()| tell.flush()).ok()
    }

    /// Returns the worker's next message about the run, or None if it died.
    fn hear(&mut self) -> Option<String> {
        let mut line = String::new();
        let read = self.hear.read_line(&mut line).ok()?;
        (read > 0 && line.ends_with('\n')).then(|| line.trim_end().to_owned())
    }

    /// Ends the worker, which syncs its results first.
    fn end(&self) -> io::Result<ExitStatus> {
        let mut reins = lock(&self.reins);
        reins.tell = None;
        reins.child.wait()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.end().ok();
    }
}

impl Study<'_> {
    fn shared(&self) -> MutexGuard<'_, Shared> {
        lock(&self.shared)
    }

    fn next(&self) -> Option<(u64, u32)> {
        let mut shared = self.shared();
        if shared.problem.is_some() || interrupt::has_come() {
            return None;
        }
        shared.queue.pop_front()
    }

    /// Makes runs in a worker until there are none left, and replaces it if it dies.
    fn supervise(&self) {
        let mut worker = None;
        self.supervise_runs(&mut worker);
        // All its runs are done; at its end it syncs them to disk.
        match worker.map(|worker| worker.end()) {
            Some(Ok(status)) if status.success() || Code::of_signal(status.code()).is_some() => {}
            Some(Ok(status)) => {
                self.give_up(format!(
                    "a worker failed after its last run ({status}); its results may be lost"
                ));
            }
            Some(Err(error)) => self.give_up(format!("a worker is lost: {error}")),
            None => {}
        }
    }

    fn supervise_runs(&self, worker: &mut Option<Worker>) {
        while let Some((run, deaths)) = self.next() {
            if worker.is_none() {
                *worker = match Worker::start(self.folder, self.wanted) {
                    Ok(started) => {
                        self.shared().workers.push(Arc::clone(&started.reins));
                        Some(started)
                    }
                    Err(error) => return self.give_up(format!("failed to start a worker: {error}")),
                };
            }
            let Some(current) = worker else { return };
            current.begin(run);
            let said = loop {
                match current.hear() {
                    Some(said) if said.starts_with(Notice::RESUMES) => self.tell(run, &said),
                    said => break said,
                }
            };
            match said {
                Some(said) => self.heard(run, &said),
                None => {
                    let status = lock(&current.reins).child.wait();
                    *worker = None;
                    // It was stopped, or reported why it cannot continue.
                    if interrupt::has_come() {
                        return;
                    }
                    match status {
                        Ok(status) if status.code().is_some_and(|code| code < 100) => {
                            return self
                                .give_up("a worker cannot continue; it printed the reason".to_owned());
                        }
                        // A signal stopped it, possibly before it reaches this process: not the
                        // run's fault.
                        Ok(status) if Code::of_signal(status.code()).is_some() => {
                            self.shared().queue.push_front((run, deaths));
                            thread::sleep(LOOK_INTERVAL);
                        }
                        Ok(status) => self.died(run, deaths + 1, &status.to_string()),
                        Err(error) => return self.give_up(format!("a worker is lost: {error}")),
                    }
                }
            }
        }
    }

    fn give_up(&self, problem: String) {
        self.shared().problem.get_or_insert(problem);
    }

    fn heard(&self, run: u64, said: &str) {
        let mut shared = self.shared();
        match said.split_once(' ') {
            Some(("done", events)) => shared.progress.done(events.parse().unwrap_or(0)),
            _ if said == BY_ANOTHER => self.tell(run, "left to another process, which is making it"),
            _ => {
                let reason = said.strip_prefix("failed ").unwrap_or(said);
                self.tell(run, reason);
                self.failed(&mut shared);
            }
        }
    }

    fn died(&self, run: u64, deaths: u32, how: &str) {
        self.tell(run, &format!("its process died, {how}"));
        let mut shared = self.shared();
        let row = &self.plan.rows[run as usize - 1];
        let written = match &mut shared.deaths {
            Some(writer) => writer.add(Kind::Died, row, &[]).map_err(|error| error.to_string()),
            none => match Writer::create(self.folder, &self.plan.hash) {
                Ok(writer) => {
                    none.insert(writer).add(Kind::Died, row, &[]).map_err(|error| error.to_string())
                }
                Err(error) => Err(error.to_string()),
            },
        };
        if let Err(problem) = written {
            shared.problem.get_or_insert(problem);
        } else if deaths < MOST_DEATHS {
            shared.queue.push_back((run, deaths));
        } else {
            self.failed(&mut shared);
        }
    }

    fn tell(&self, run: u64, what: &str) {
        self.board.line(&format!("{}: {what}", self.plan.label(run)));
    }

    fn failed(&self, shared: &mut Shared) {
        shared.failed += 1;
        shared.progress.failed();
        if self.wanted.max_fails.is_some_and(|most| shared.failed > most) {
            let problem = format!("more than {} runs failed (--max-fails)", shared.failed - 1);
            shared.problem.get_or_insert(problem);
        }
    }
}

/// Makes the runs whose numbers arrive on standard input, one per line, and prints the outcome of
/// each.
fn work(arguments: &SweepRunArguments) -> Result<(), Failure> {
    let SweepRunArguments { folder, patience_s, verify, .. } = arguments;
    let patience = Duration::try_from_secs_f64(*patience_s).map_err(Failure::bad_input)?;
    // The first signal is for the current run.
    interrupt::install()?;
    let plan = Plan::read(folder).map_err(Failure::failed)?;
    plan.check_code(folder).map_err(Failure::failed)?;
    create_folder(&folder.join(staging::FOLDER))?;
    let is_left_alone = Arc::new(AtomicBool::new(false));
    let told = listen(Arc::clone(&is_left_alone))
        .map_err(|error| Failure::Failed(format!("failed to start a thread: {error}")))?;
    let stop = || interrupt::has_come() || is_left_alone.load(Ordering::Relaxed);
    let tell = |notice: Notice<'_>| say(notice).unwrap_or(());
    let ways = Ways { folder, patience, stop: &stop, tell: &tell, again: verify.is_some() };
    let mut segment: Option<Writer> = None;
    for line in told {
        let line = line.map_err(Failure::failed)?;
        let run: u64 = line.trim().parse().map_err(|_| Failure::Failed(format!("{line} is no run")))?;
        let row = (run as usize).checked_sub(1).and_then(|index| plan.rows.get(index));
        let row = row.ok_or_else(|| Failure::Failed(format!("there is no run {run}")))?;
        match make_and_store(&plan, row, ways, &mut segment).map_err(Failure::Failed)? {
            Made::Done { events, .. } => say(format_args!("done {events}"))?,
            Made::Failed(reason) => say(format_args!("failed {}", reason.replace('\n', " ")))?,
            Made::ByAnother => say(BY_ANOTHER)?,
            Made::Stopped => {
                // From now on other processes may find the study complete and not return to it.
                let results = Results::read(folder, &plan).map_err(Failure::failed)?;
                clear_done(folder, &results).map_err(Failure::Failed)?;
                break;
            }
        }
    }
    if let Some(mut segment) = segment {
        segment.sync().map_err(Failure::failed)?;
    }
    interrupt::code().map_or(Ok(()), Code::said)
}

/// Reads the lines of standard input on a thread, which notices their end while a run is made.
fn listen(is_over: Arc<AtomicBool>) -> io::Result<mpsc::Receiver<io::Result<String>>> {
    let (send, receive) = mpsc::channel();
    thread::Builder::new().spawn(move || {
        for line in io::stdin().lock().lines() {
            if send.send(line).is_err() {
                return;
            }
        }
        is_over.store(true, Ordering::Relaxed);
    })?;
    Ok(receive)
}

fn emit(arguments: &SweepEmitArguments) -> Result<(), Failure> {
    let SweepEmitArguments { engine, folder, tasks, cores, time, at_once, verify } = arguments;
    let plan = read_plan(folder)?;
    let most = plan.rows.len() as u64;
    let tasks = tasks.unwrap_or(most.min(USUAL_TASKS));
    if !(1..=most).contains(&tasks) {
        return Err(Failure::BadInput(format!("--tasks {tasks} (accepted: 1 to {most})")));
    }
    if let Some(sample) = verify {
        sampled(*sample, &plan)?;
        if *engine != SweepEngine::Slurm {
            return Err(Failure::BadInput(format!("--verify {sample} (accepted: with slurm)")));
        }
    }
    if let Some(most) = at_once.filter(|_| *engine != SweepEngine::Slurm) {
        return Err(Failure::BadInput(format!("--at-once {most} (accepted: with slurm)")));
    }
    let program = std::env::current_exe().map_err(Failure::failed)?;
    let folder = std::path::absolute(folder).map_err(Failure::failed)?;
    let word = |what: &str, text: &OsStr| Word::of(what, text).map_err(Failure::BadInput);
    let job = Job {
        program: word("the program", program.as_os_str())?,
        folder: word("the folder", folder.as_os_str())?,
        tasks,
        cores: cores.get() as u64,
        time: word("--time", time.as_ref())?,
        at_once: at_once.map(|most| most.get() as u64),
        verify: *verify,
    };
    let text = match engine {
        SweepEngine::Slurm => job.slurm().map_err(Failure::BadInput)?,
        SweepEngine::List => job.list(),
        SweepEngine::Row => job.row().map_err(Failure::BadInput)?,
    };
    let mut out = terminal::data();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}
