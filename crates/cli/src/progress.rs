//! Progress on stderr: a bar on a terminal, a line now and then elsewhere.

use std::io::{IsTerminal, stderr};
use std::time::{Duration, Instant};

use asperity_record::{Event, EventPayload, SlipEvent};
use asperity_run::{Notice, Watch};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// How often a run that goes on for long says so where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(30);

/// The bars of all runs that go on at once.
#[derive(Debug, Clone)]
pub(crate) struct Board {
    bars: MultiProgress,
    on_terminal: bool,
}

impl Board {
    pub(crate) fn new() -> Board {
        Board { bars: MultiProgress::new(), on_terminal: stderr().is_terminal() }
    }

    /// Prints a line above the bars.
    #[expect(clippy::print_stderr, reason = "progress goes to stderr")]
    pub(crate) fn line(&self, text: &str) {
        if self.on_terminal {
            self.bars.suspend(|| eprintln!("{text}"));
        } else {
            eprintln!("{text}");
        }
    }

    /// Starts the progress of a run whose events are counted.
    pub(crate) fn run(&self, name: &str, steps: u64, duration_s: f64) -> RunProgress {
        RunProgress { events: Some(0), ..self.steps(name, steps, duration_s) }
    }

    /// Starts the progress of a run of which only the steps are told.
    pub(crate) fn steps(&self, name: &str, steps: u64, duration_s: f64) -> RunProgress {
        let bar = if self.on_terminal {
            let style = ProgressStyle::with_template("{prefix:20} {bar:30} {msg} {eta} left")
                .expect("the template is well formed");
            self.bars.add(ProgressBar::new(steps).with_style(style).with_prefix(name.to_owned()))
        } else {
            ProgressBar::hidden()
        };
        RunProgress {
            board: self.clone(),
            bar,
            name: name.to_owned(),
            steps,
            duration_s,
            events: None,
            started: Instant::now(),
            last_line: Instant::now(),
        }
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
}

impl Watch for RunProgress {
    fn event(&mut self, event: &Event) {
        if let Some(events) = &mut self.events {
            *events += u64::from(event.topic == SlipEvent::TOPIC);
        }
    }

    fn reached(&mut self, step: u64) {
        self.advance(step);
    }

    fn notice(&mut self, notice: Notice<'_>) {
        self.board.line(&format!("{}: {notice}", self.name));
    }
}

impl RunProgress {
    /// Takes note of the last step taken.
    pub(crate) fn advance(&mut self, step: u64) {
        self.bar.set_position(step);
        if self.board.on_terminal {
            self.bar.set_message(self.status(step));
        } else if self.last_line.elapsed() > LINE_INTERVAL {
            self.last_line = Instant::now();
            self.board.line(&format!("{}: {}", self.name, self.status(step)));
        }
    }

    /// Takes the bar away.
    pub(crate) fn clear(self) {
        self.bar.finish_and_clear();
    }

    fn status(&self, step: u64) -> String {
        let time_s = self.duration_s * step as f64 / self.steps as f64;
        let time = format!("{time_s:.3} of {} s", self.duration_s);
        match self.events {
            Some(events) => format!("{time}, {events} slip events"),
            None => time,
        }
    }

    /// Says that the run is over.
    pub(crate) fn finish(self) {
        self.bar.finish_and_clear();
        self.board.line(&format!(
            "{}: {} s simulated, {} slip events, in {:.1} s",
            self.name,
            self.duration_s,
            self.events.unwrap_or(0),
            self.started.elapsed().as_secs_f64()
        ));
    }
}
