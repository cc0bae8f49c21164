//! Progress on stderr: bars on a terminal, occasional lines elsewhere.

use std::io::{IsTerminal, stderr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use asperity_record::{Event, EventPayload, SlipEvent, counted, printable};
use asperity_run::study::Job;
use asperity_run::{Notice, Observer};
use asperity_study::Watcher;
use asperity_study::work::Made;
use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressStyle};

use crate::{interrupt, terminal};

/// Time between lines about long work without a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(30);

/// Time between updates of the progress of all runs.
const TELL_INTERVAL: Duration = Duration::from_millis(100);

/// All progress that is shown, and notes above it.
#[derive(Debug, Clone)]
pub(crate) struct Board {
    bars: MultiProgress,
    on_terminal: bool,
    quiet: bool,
    shared: Arc<Mutex<Shared>>,
}

/// What all runs come to.
#[derive(Debug, Default)]
struct Shared {
    runs: Option<(Bar, Tally)>,
    stage: Option<Bar>,
}

impl Board {
    /// A board; a quiet one shows neither progress nor notes.
    pub(crate) fn new(quiet: bool) -> Board {
        let on_terminal = stderr().is_terminal() && !quiet;
        Board { bars: MultiProgress::new(), on_terminal, quiet, shared: Arc::default() }
    }

    /// Whether it shows neither progress nor notes.
    pub(crate) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Prints a note above the bars, unless the board is quiet.
    pub(crate) fn line(&self, text: &str) {
        if !self.quiet {
            self.answer(&printable(text));
        }
    }

    /// Prints a note above the bars; on a terminal only, like the bars.
    pub(crate) fn aside(&self, text: &str) {
        if self.on_terminal {
            self.line(text);
        }
    }

    /// Prints requested output above the bars, even if the board is quiet.
    pub(crate) fn answer(&self, text: &str) {
        for line in text.lines() {
            if self.on_terminal {
                // A failure to write is ignored, since nobody reads it.
                self.bars.println(printable(line)).ok();
            } else {
                terminal::note(line);
            }
        }
    }

    /// Starts the progress of a run, with its number of events.
    pub(crate) fn run(&self, name: &str, steps: u64, duration_s: f64) -> RunProgress {
        let mut progress = self.steps(name, steps, duration_s);
        progress.events = Some(0);
        progress
    }

    /// Starts the progress of a run, with its steps only.
    pub(crate) fn steps(&self, name: &str, steps: u64, duration_s: f64) -> RunProgress {
        RunProgress {
            board: self.clone(),
            bar: self.bar(name, steps, "{prefix:20} {bar:30} {msg} {eta} left"),
            steps,
            step: 0,
            duration_s,
            events: None,
            work: 0,
            told: (0.0, None),
            started: Instant::now(),
            notes: Vec::new(),
        }
    }

    /// A bar, drawn on terminals only.
    fn bar(&self, name: &str, length: u64, template: &str) -> Bar {
        let bar = match self.on_terminal {
            true => {
                let style = ProgressStyle::with_template(template).expect("the template is well formed");
                let bar = ProgressBar::new(length).with_style(style);
                self.bars.add(bar.with_prefix(printable(name).into_owned()))
            }
            false => ProgressBar::hidden(),
        };
        Bar { bar, name: name.to_owned(), last_line: Instant::now() }
    }

    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what all runs come to, if they are counted.
    fn tell(&self, change: impl FnOnce(&mut Tally)) {
        if let Some((bar, tally)) = &mut self.shared().runs {
            change(tally);
            let position = (tally.share() * OVERALL_LENGTH as f64) as u64;
            bar.show(self, position, || tally.status());
        }
    }
}

/// Resolution of the bar of all runs.
const OVERALL_LENGTH: u64 = 1000;

impl Watcher for Board {
    fn is_stopped(&self) -> bool {
        interrupt::has_come()
    }

    fn note(&self, line: &str) {
        self.line(line);
    }

    fn begin(&self, runs: u64, work: u64) {
        let bar = self.bar("all runs", OVERALL_LENGTH, "{prefix:20} {bar:30} {msg}");
        self.shared().runs = Some((bar, Tally::new(runs, work)));
        self.tell(|_| ());
    }

    fn run(&self, job: &Job) -> Box<dyn Observer + '_> {
        let mut progress = self.run(&job.name, job.steps(), job.scenario.time.duration_s);
        progress.work = job.cost();
        Box::new(progress)
    }

    fn over(&self, made: &Made) {
        self.tell(|tally| match made {
            Made::Done => tally.done += 1,
            Made::Failed(_) => tally.failed += 1,
            Made::Stopped | Made::ByAnother => {}
        });
    }

    fn end(&self) {
        self.shared().runs = None;
    }

    fn reached(&self, what: &str, done: usize, of: usize) {
        let stage = &mut self.shared().stage;
        if done == of {
            *stage = None;
            return;
        }
        let bar = stage.get_or_insert_with(|| self.bar(what, of as u64, "{prefix:20} {bar:30} {msg}"));
        bar.show(self, done as u64, || format!("{done} of {of}"));
    }
}

/// The bar of one thing.
#[derive(Debug)]
struct Bar {
    bar: ProgressBar,
    name: String,
    last_line: Instant,
}

impl Bar {
    fn show(&mut self, board: &Board, position: u64, status: impl FnOnce() -> String) {
        self.bar.set_position(position);
        if board.on_terminal {
            self.bar.set_message(status());
        } else if self.last_line.elapsed() > LINE_INTERVAL {
            self.last_line = Instant::now();
            board.line(&format!("{}: {}", self.name, status()));
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The progress of one run. At its end, it prints what was simulated, and notes about it.
pub(crate) struct RunProgress {
    board: Board,
    bar: Bar,
    steps: u64,
    step: u64,
    duration_s: f64,
    events: Option<u64>,
    /// Block steps, if it is one of several runs.
    work: u64,
    /// The share that these know, and since when.
    told: (f64, Option<Instant>),
    started: Instant,
    notes: Vec<String>,
}

impl Observer for RunProgress {
    fn event(&mut self, event: &Event) {
        if let Some(events) = &mut self.events {
            *events += u64::from(event.topic() == SlipEvent::TOPIC);
        }
    }

    fn reached(&mut self, step: u64) {
        self.advance(step);
    }

    fn notice(&mut self, notice: Notice<'_>) {
        let note = format!("{}: {notice}", self.bar.name);
        match notice {
            Notice::GoesOn { step, .. } => {
                self.told.0 = step as f64 / self.steps as f64;
                let before = self.told.0 * self.work as f64;
                self.board
                    .tell(|tally| (tally.before, tally.made) = (tally.before + before, tally.made + before));
                self.board.line(&note);
            }
            Notice::LackedItsName | Notice::Warning(_) => self.board.line(&note),
            Notice::LoadNotReached { .. } | Notice::NoEvents { .. } => self.notes.push(note),
            // The log has it, and `--stats` prints it.
            Notice::Fallback(_) => {}
        }
    }
}

impl RunProgress {
    /// Sets the last step taken.
    pub(crate) fn advance(&mut self, step: u64) {
        self.step = step;
        let (time_s, duration_s) = (self.duration_s * step as f64 / self.steps as f64, self.duration_s);
        let events = self.events;
        self.bar.show(&self.board, step, || {
            let events = events.map(|events| format!(", {}", counted(events, "slip event")));
            format!("{time_s:.3} of {duration_s} s{}", events.unwrap_or_default())
        });
        // Records of an earlier call are repeated.
        let (share, is_end) = (step as f64 / self.steps as f64, step == self.steps);
        let (known, since) = self.told;
        let is_due = is_end || since.is_none_or(|since| since.elapsed() > TELL_INTERVAL);
        if self.work > 0 && share > known && is_due {
            self.told = (share, Some(Instant::now()));
            let more = (share - known) * self.work as f64;
            self.board.tell(|tally| tally.made += more);
        }
    }
}

impl Drop for RunProgress {
    fn drop(&mut self) {
        let Some(events) = self.events.filter(|_| self.step == self.steps) else { return };
        self.bar.bar.finish_and_clear();
        self.board.line(&format!(
            "{}: {} s simulated, {}, in {:.1} s",
            self.bar.name,
            self.duration_s,
            counted(events, "slip event"),
            self.started.elapsed().as_secs_f64()
        ));
        self.notes.iter().for_each(|note| self.board.line(note));
    }
}

/// What several runs come to.
#[derive(Debug)]
struct Tally {
    started: Instant,
    runs: u64,
    done: u64,
    failed: u64,
    /// Block steps of all; 0 if runs are only counted.
    work: f64,
    /// Those that are made.
    made: f64,
    /// Those that an earlier call has made.
    before: f64,
}

impl Tally {
    fn new(runs: u64, work: u64) -> Tally {
        let (started, work) = (Instant::now(), work as f64);
        Tally { started, runs, done: 0, failed: 0, work, made: 0.0, before: 0.0 }
    }

    /// Share of the work that is done.
    fn share(&self) -> f64 {
        match self.work > 0.0 {
            true => self.made / self.work,
            false => (self.done + self.failed) as f64 / self.runs as f64,
        }
    }

    /// The time left at the speed so far; None before there is one.
    fn left(&self, elapsed: Duration) -> Option<Duration> {
        let before = if self.work > 0.0 { self.before / self.work } else { 0.0 };
        let share = self.share();
        Duration::try_from_secs_f64(elapsed.as_secs_f64() * (1.0 - share) / (share - before)).ok()
    }

    fn status(&self) -> String {
        let mut status = format!("{} of {} runs done", self.done, self.runs);
        if self.failed > 0 {
            status += &format!(", {} failed", self.failed);
        }
        status += &format!(", {:.0} % of the work", 100.0 * self.share());
        match self.left(self.started.elapsed()) {
            Some(left) if self.done + self.failed < self.runs => {
                format!("{status}, {:#} left", HumanDuration(left))
            }
            _ => status,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: Duration = Duration::from_secs(1);

    /// The time left follows the work; work of an earlier call does not enter the speed of this one.
    #[test]
    fn the_time_left_is_that_of_the_work() {
        let mut tally = Tally::new(2, 400);
        assert_eq!((tally.status().as_str(), tally.left(S)), ("0 of 2 runs done, 0 % of the work", None));
        tally.made = 150.0;
        assert_eq!((tally.share(), tally.left(3 * S)), (0.375, Some(5 * S)));
        tally.before = 50.0;
        assert_eq!(tally.left(2 * S), Some(5 * S));
        (tally.made, tally.done) = (400.0, 2);
        assert_eq!(tally.status(), "2 of 2 runs done, 100 % of the work");
        let mut counts = Tally { done: 2, failed: 1, ..Tally::new(3, 0) };
        assert_eq!(counts.status(), "2 of 3 runs done, 1 failed, 100 % of the work");
        counts.done = 1;
        assert_eq!(counts.left(2 * S), Some(S));
    }
}
