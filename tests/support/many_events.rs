//! Logs of as many slip events as a test asks for, written without a solver.

use std::path::Path;

use asperity_model::Plan;
use asperity_record::{Direction, Event, Record, RunStatus, SolverReport, StepRecord, Switch};
use asperity_run::OpenLog;
use asperity_run::detectors::of_plan;
use asperity_runlog::{Content, Existing, RunWriter};
use asperity_testkit::{Random, quiet_step, switch};

use super::binary;

/// Blocks of the chain, every second of which slides, one after the other: none is the neighbour of one that slid
/// within the link time.
const BLOCKS: u64 = 1000;

/// Steps from one onset to the next.
const STEPS: u64 = 45;

/// Writes a whole log of so many slip events of one block, each a rupture as well. Above them the load rises and falls.
pub(crate) fn log(path: &Path, events: u64) {
    let quiet = path.with_extension("quiet.mcap");
    let scenario = [
        "slider.blocks=1000",
        "drive.velocity_m_per_s=1e-12",
        "time.step_s=1e-8",
        "recording.sample_s=1",
        &format!("time.duration_s={}", ((events + 1) * STEPS) as f64 * 1e-8),
    ];
    binary::run(&binary::with_sets(&["default"], &scenario), &quiet);
    let quiet = OpenLog::open(&quiet).expect("the log opens");
    let header = quiet.header();
    let mut detectors = of_plan(&Plan::new(quiet.needed_scenario().expect("it has a scenario")));
    let kinds: Vec<_> = detectors.kinds().collect();
    let mut log =
        RunWriter::create(path, Existing::Refuse, header, quiet.scenario_toml(), &kinds, Content::Text)
            .expect("a log can be begun");
    let mut random = Random::new(1);
    let mut displacement_m = vec![0.0; BLOCKS as usize];
    let mut found: Vec<Event> = Vec::new();
    let mut write = |step: u64, sliding: u32, switches: Vec<Switch>| {
        let time_s = header.time_grid().time_s(step);
        let load_ratio = 0.3 + 0.1 * (step as f64 * 1e-6).sin();
        let record = Record::Step(StepRecord { sliding, switches, ..quiet_step(step, time_s, load_ratio) });
        log.record(&record).expect("a record can be written");
        detectors.observe(&record, &mut |event| found.push(event));
        found.drain(..).for_each(|event| log.event(&event).expect("an event can be written"));
    };
    for event in 0..events {
        let block = (2 * event % BLOCKS) as u32 + 1;
        let place_m = &mut displacement_m[block as usize - 1];
        let onset = (event + 1) * STEPS;
        let of = |direction, displacement_m| Switch {
            displacement_m,
            tangential_force_n: 0.1,
            threshold_n: 0.28,
            ..switch(block, direction)
        };
        write(onset - 1, 0, vec![of(Direction::Detach, *place_m)]);
        write(onset, 1, Vec::new());
        *place_m += random.log_uniform(1e-9, 1e-6);
        let last = onset + random.below(STEPS - 3);
        if last > onset {
            write(last, 1, vec![of(Direction::Attach, *place_m)]);
            write(last + 1, 0, Vec::new());
        } else {
            write(last + 1, 1, vec![of(Direction::Attach, *place_m)]);
            write(last + 2, 0, Vec::new());
        }
    }
    write(header.steps, 0, Vec::new());
    detectors.finish(&mut |event| log.event(&event).expect("an event can be written"));
    log.finish(RunStatus::Complete, SolverReport::default()).expect("the log can be finished");
}
