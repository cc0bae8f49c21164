//! Prints the first slip of the whole slider, and the moment when all its blocks slide, found by a
//! custom detector.
//!
//! `cargo run --package asperity-run --example first_global_slip`; `docs/extending.md` shows it as a
//! program outside the workspace.

#![expect(clippy::print_stdout, reason = "a program prints what it finds")]

use asperity_record::{Event, EventKind, GlobalSlip, StepRecord, payload};
use asperity_run::{Begin, Detector, Observer, Task, run};

payload! {
    topic: "/events/all-sliding",
    table: "all-sliding",
    /// All blocks slide in the same step.
    struct AllSliding {
        /// Time of that step, s.
        time_s: f64,
        /// F_T / F_N in it.
        ft_fn: f64,
    }
}

/// Waits until this many blocks slide.
struct Wait(Option<u32>);

impl Detector for Wait {
    fn emits(&self) -> EventKind {
        EventKind::of::<AllSliding>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if self.0 == Some(record.sliding) {
            self.0 = None;
            emit(Event::new(AllSliding { time_s: record.time_s, ft_fn: record.load_ratio() }));
        }
    }
}

struct Print;

impl Observer for Print {
    fn event(&mut self, event: &Event) {
        if let Some(AllSliding { time_s, ft_fn }) = event.get() {
            println!("all blocks slide at {time_s} s, F_T/F_N = {ft_fn:.4}");
        }
        if let Some(GlobalSlip { global: 0, onset_s, .. }) = event.get() {
            println!("the first global slip began at {onset_s} s");
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scenario = asperity_model::resolve("default", &["slider.blocks=10", "time.step_s=1e-7"])?;
    let wait = Wait(Some(scenario.slider.blocks));
    run(Task::new(&scenario).detect(wait), Begin::Anew, &|| false, &mut Print)?;
    Ok(())
}
