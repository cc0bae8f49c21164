//! Progress on stderr: a bar on a terminal, occasional lines elsewhere.

use std::collections::BTreeMap;
use std::io::{IsTerminal, stderr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use asperity_record::{Event, EventPayload, SlipEvent, counted, printable};
use asperity_run::{Notice, Observer};
use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressStyle};

use crate::terminal;

/// Time between lines about a long run without a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(30);

/// Time between updates of the overall progress.
const TELL_INTERVAL: Duration = Duration::from_millis(100);

/// The bars of all current runs.
#[derive(Debug, Clone)]
pub(crate) struct Board {
    bars: MultiProgress,
    on_terminal: bool,
    quiet: bool,
    /// The group whose runs are counted together, if any.
    together: Option<Arc<Together>>,
}

impl Board {
    /// A board; a quiet one shows neither progress nor notes.
    pub(crate) fn new(quiet: bool) -> Board {
        Board {
            bars: MultiProgress::new(),
            on_terminal: stderr().is_terminal() && !quiet,
            quiet,
            together: None,
        }
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
        RunProgress { events: Some(0), ..self.steps(name, steps, duration_s) }
    }

    /// Starts the progress of a run, with its steps only.
    pub(crate) fn steps(&self, name: &str, steps: u64, duration_s: f64) -> RunProgress {
        let bar = self.bar(name, steps, "{prefix:20} {bar:30} {msg} {eta} left", |bar| self.bars.add(bar));
        RunProgress {
            board: self.clone(),
            bar,
            name: name.to_owned(),
            steps,
            duration_s,
            events: None,
            started: Instant::now(),
            last_line: Instant::now(),
            last_told: None,
            notes: Vec::new(),
        }
    }

    /// Starts the overall progress of runs, given with their work in block steps. The runs must be
    /// shown, under the same names, on the returned board.
    pub(crate) fn overall(&self, runs: impl IntoIterator<Item = (String, u64)>) -> Overall {
        let place = |bar| self.bars.insert(0, bar);
        let bar = self.bar("all runs", OVERALL_LENGTH, "{prefix:20} {bar:30} {msg}", place);
        let now = Instant::now();
        let tally = Tally::new(runs);
        bar.set_message(tally.status(Duration::ZERO));
        let together =
            Arc::new(Together { bar, started: now, tally: Mutex::new(tally), last_line: Mutex::new(now) });
        Overall { board: Board { together: Some(together), ..self.clone() } }
    }

    /// Starts the progress of named stages.
    pub(crate) fn stages(&self, name: &str) -> Stages {
        Stages { bar: self.bar(name, 1, "{prefix:20} {bar:30} {msg}", |bar| self.bars.add(bar)) }
    }

    /// Starts the progress of a study with that many runs.
    pub(crate) fn study(&self, runs: u64) -> StudyProgress {
        let bar = self.bar("runs", runs, "{prefix:6} {bar:30} {msg}", |bar| self.bars.add(bar));
        let now = Instant::now();
        StudyProgress {
            board: self.clone(),
            bar,
            runs,
            done: 0,
            failed: 0,
            events: 0,
            started: now,
            last_line: now,
        }
    }

    /// A bar, drawn on terminals only.
    fn bar(
        &self,
        name: &str,
        length: u64,
        template: &str,
        place: impl FnOnce(ProgressBar) -> ProgressBar,
    ) -> ProgressBar {
        if !self.on_terminal {
            return ProgressBar::hidden();
        }
        let style = ProgressStyle::with_template(template).expect("the template is well formed");
        place(ProgressBar::new(length).with_style(style).with_prefix(printable(name).into_owned()))
    }
}

/// The progress through stages.
pub(crate) struct Stages {
    bar: ProgressBar,
}

impl Stages {
    /// Sets the number of completed items of a stage.
    pub(crate) fn reached(&self, stage: &str, done: usize, of: usize) {
        self.bar.set_length(of as u64);
        self.bar.set_position(done as u64);
        self.bar.set_message(format!("{stage}: {done} of {of}"));
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The progress of many runs that are only counted.
pub(crate) struct StudyProgress {
    board: Board,
    bar: ProgressBar,
    runs: u64,
    done: u64,
    failed: u64,
    events: u64,
    started: Instant,
    last_line: Instant,
}

impl StudyProgress {
    /// Counts a finished run with its slip events.
    pub(crate) fn done(&mut self, events: u64) {
        self.done += 1;
        self.events += events;
        self.show();
    }

    /// Counts a failed run.
    pub(crate) fn failed(&mut self) {
        self.failed += 1;
        self.show();
    }

    fn show(&mut self) {
        let over = self.done + self.failed;
        self.bar.set_position(over);
        self.bar.set_message(self.status());
        if !self.board.on_terminal && self.last_line.elapsed() > LINE_INTERVAL {
            self.last_line = Instant::now();
            self.board.line(&self.status());
        }
    }

    fn status(&self) -> String {
        let (over, elapsed) = (self.done + self.failed, self.started.elapsed().as_secs_f64());
        let mut status = format!("{} of {} runs done", self.done, self.runs);
        if self.failed > 0 {
            status.push_str(&format!(", {} failed", self.failed));
        }
        status.push_str(&format!(", {}", counted(self.events, "slip event")));
        let left_s = elapsed * (self.runs - over) as f64 / over as f64;
        match Duration::try_from_secs_f64(left_s) {
            Ok(left) if over < self.runs => format!("{status}, {:#} left", HumanDuration(left)),
            _ => status,
        }
    }
}

impl Drop for StudyProgress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// The progress of one run.
pub(crate) struct RunProgress {
    board: Board,
    bar: ProgressBar,
    name: String,
    steps: u64,
    duration_s: f64,
    events: Option<u64>,
    started: Instant,
    last_line: Instant,
    last_told: Option<Instant>,
    /// Notes to print at the end.
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
        let note = format!("{}: {notice}", self.name);
        match notice {
            Notice::GoesOn { step, .. } => {
                if let Some(together) = &self.board.together {
                    together.tally().goes_on(&self.name, step as f64 / self.steps as f64);
                }
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
        self.bar.set_position(step);
        if self.board.on_terminal {
            self.bar.set_message(self.status(step));
        } else if self.last_line.elapsed() > LINE_INTERVAL {
            self.last_line = Instant::now();
            self.board.line(&format!("{}: {}", self.name, self.status(step)));
        }
        if let Some(together) = &self.board.together
            && self.last_told.is_none_or(|told| told.elapsed() > TELL_INTERVAL)
        {
            self.last_told = Some(Instant::now());
            together.tally().reached(&self.name, step as f64 / self.steps as f64);
            together.show(&self.board);
        }
    }

    /// Removes the bar.
    pub(crate) fn clear(self) {
        self.bar.finish_and_clear();
    }

    fn status(&self, step: u64) -> String {
        let time_s = self.duration_s * step as f64 / self.steps as f64;
        let time = format!("{time_s:.3} of {} s", self.duration_s);
        match self.events {
            Some(events) => format!("{time}, {}", counted(events, "slip event")),
            None => time,
        }
    }

    /// Prints that the run is over, if it took any steps, and its notes.
    pub(crate) fn end(self, has_run: bool) {
        self.bar.finish_and_clear();
        if !has_run {
            return;
        }
        self.board.line(&format!(
            "{}: {} s simulated, {}, in {:.1} s",
            self.name,
            self.duration_s,
            counted(self.events.unwrap_or(0), "slip event"),
            self.started.elapsed().as_secs_f64()
        ));
        for note in &self.notes {
            self.board.line(note);
        }
    }
}

/// The progress of several runs together.
pub(crate) struct Overall {
    board: Board,
}

impl Overall {
    /// The board for these runs.
    pub(crate) fn board(&self) -> &Board {
        &self.board
    }

    /// Counts a finished run.
    pub(crate) fn done(&self, name: &str) {
        if let Some(together) = &self.board.together {
            together.tally().done(name);
            together.show(&self.board);
        }
    }
}

impl Drop for Overall {
    fn drop(&mut self) {
        if let Some(together) = &self.board.together {
            together.bar.finish_and_clear();
        }
    }
}

/// The shared state of runs that are counted together.
#[derive(Debug)]
struct Together {
    bar: ProgressBar,
    started: Instant,
    tally: Mutex<Tally>,
    last_line: Mutex<Instant>,
}

/// Resolution of the overall bar.
const OVERALL_LENGTH: u64 = 1000;

impl Together {
    fn tally(&self) -> MutexGuard<'_, Tally> {
        self.tally.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, board: &Board) {
        let (share, status) = {
            let tally = self.tally();
            (tally.share(), tally.status(self.started.elapsed()))
        };
        self.bar.set_position((share * OVERALL_LENGTH as f64) as u64);
        self.bar.set_message(status.clone());
        let mut last_line = self.last_line.lock().unwrap_or_else(PoisonError::into_inner);
        if !board.on_terminal && last_line.elapsed() > LINE_INTERVAL {
            *last_line = Instant::now();
            board.line(&format!("all runs: {status}"));
        }
    }
}

/// The progress of the work of several runs.
#[derive(Debug)]
struct Tally {
    runs: BTreeMap<String, Part>,
}

/// One of the runs.
#[derive(Debug)]
struct Part {
    /// Block steps.
    work: f64,
    /// Share of it done by an earlier call.
    before: f64,
    /// Share of it done so far.
    share: f64,
    is_done: bool,
}

impl Tally {
    fn new(runs: impl IntoIterator<Item = (String, u64)>) -> Tally {
        let part = |work: u64| Part { work: work as f64, before: 0.0, share: 0.0, is_done: false };
        Tally { runs: runs.into_iter().map(|(name, work)| (name, part(work))).collect() }
    }

    /// A run resumes where an earlier call left it. Its records before that are repeated.
    fn goes_on(&mut self, name: &str, share: f64) {
        if let Some(run) = self.runs.get_mut(name) {
            (run.before, run.share) = (share, share);
        }
    }

    fn reached(&mut self, name: &str, share: f64) {
        if let Some(run) = self.runs.get_mut(name) {
            run.share = share.max(run.before);
        }
    }

    fn done(&mut self, name: &str) {
        if let Some(run) = self.runs.get_mut(name) {
            run.is_done = true;
            run.share = 1.0;
        }
    }

    fn work(&self, of: impl Fn(&Part) -> f64) -> f64 {
        self.runs.values().map(|run| run.work * of(run)).sum()
    }

    /// Share of the work done.
    fn share(&self) -> f64 {
        let all = self.work(|_| 1.0);
        if all > 0.0 { self.work(|run| run.share) / all } else { 1.0 }
    }

    /// Estimated remaining time at the speed so far; None before there is one.
    fn left(&self, elapsed: Duration) -> Option<Duration> {
        let made = self.work(|run| run.share - run.before);
        let missing = self.work(|run| 1.0 - run.share);
        Duration::try_from_secs_f64(elapsed.as_secs_f64() * missing / made).ok()
    }

    fn status(&self, elapsed: Duration) -> String {
        let done = self.runs.values().filter(|run| run.is_done).count();
        let status =
            format!("{done} of {} runs done, {:.0} % of the work", self.runs.len(), 100.0 * self.share());
        match self.left(elapsed) {
            Some(left) if done < self.runs.len() => format!("{status}, {:#} left", HumanDuration(left)),
            _ => status,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: Duration = Duration::from_secs(1);

    #[test]
    fn the_share_and_the_time_left_follow_the_work() {
        let mut tally = Tally::new([("long".to_owned(), 300), ("short".to_owned(), 100)]);
        assert_eq!(tally.status(S), "0 of 2 runs done, 0 % of the work");
        tally.reached("long", 0.0);
        tally.reached("long", 0.5);
        assert_eq!(tally.share(), 0.375);
        assert_eq!(tally.left(3 * S), Some(5 * S));
        assert_eq!(tally.status(3 * S), "0 of 2 runs done, 38 % of the work, 5s left");
        tally.done("short");
        assert_eq!(tally.status(3 * S), "1 of 2 runs done, 62 % of the work, 2s left");
        tally.done("long");
        assert_eq!(tally.status(3 * S), "2 of 2 runs done, 100 % of the work");
    }

    /// Work of an earlier call does not enter the speed of this one.
    #[test]
    fn a_resumed_run_begins_where_it_was_left() {
        let mut tally = Tally::new([("a".to_owned(), 100)]);
        tally.goes_on("a", 0.5);
        // The records before the checkpoint are repeated.
        tally.reached("a", 0.1);
        assert_eq!((tally.share(), tally.left(S)), (0.5, None));
        tally.reached("a", 0.75);
        assert_eq!(tally.left(S), Some(S));
    }
}
