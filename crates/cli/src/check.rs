//! `asperity check`: whether logs are whole, and if not, how far they can be trusted.

use std::io::{self, Write};
use std::path::Path;

use asperity_record::{EventPayload, Record, RunHeader, SlipEvent};
use asperity_runlog::{LogError, LogItem, RunReader, Topics};

use crate::args::CheckArguments;
use crate::detectors;
use crate::exit::{Code, Failure};
use crate::held::{Difference, Held};
use crate::run::CODE_VERSION;

/// What a log is worth, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verdict {
    /// It holds all of its run, and says so.
    Whole,
    /// It ends before its run does; what it holds is sound.
    Incomplete,
    /// Something in it is not what was written, or contradicts the rest.
    Damaged,
}

impl Verdict {
    fn word(self) -> &'static str {
        match self {
            Verdict::Whole => "whole",
            Verdict::Incomplete => "incomplete",
            Verdict::Damaged => "damaged",
        }
    }
}

pub(crate) fn command(arguments: &CheckArguments) -> Result<(), Failure> {
    let mut worst = Verdict::Whole;
    for run in &arguments.runs {
        let mut seen = Seen::default();
        let (verdict, what) = match seen.read(run) {
            Ok(()) => (Verdict::Whole, seen.summary()),
            Err(problem) => (problem.verdict(), format!("{}: {problem}", seen.summary())),
        };
        writeln!(io::stdout().lock(), "{}: {}: {what}", run.display(), verdict.word())?;
        worst = worst.max(verdict);
    }
    match worst {
        Verdict::Whole => Ok(()),
        Verdict::Incomplete => Err(Failure::Said(Code::Failed)),
        Verdict::Damaged => Err(Failure::Said(Code::BadInput)),
    }
}

/// Why a log is not whole.
#[derive(Debug, thiserror::Error)]
enum Problem {
    #[error("{}", .0.problem)]
    Log(#[from] LogError),
    #[error("step {step} follows step {before}")]
    Order { step: u64, before: u64 },
    #[error("step {step} is at {found_s} s, not {expected_s} s")]
    Time { step: u64, found_s: f64, expected_s: f64 },
    #[error("step {step}: {what} is not finite")]
    NotFinite { step: u64, what: &'static str },
    #[error("its steps give {0}")]
    Events(#[from] Difference),
}

impl Problem {
    fn verdict(&self) -> Verdict {
        match self {
            Problem::Log(LogError { problem, .. }) if problem.is_early_end() => Verdict::Incomplete,
            _ => Verdict::Damaged,
        }
    }
}

/// What has been read of a log and found sound.
#[derive(Debug, Default)]
struct Seen {
    messages: u64,
    last_step: u64,
    last_s: f64,
    slips: u64,
    /// Where the events of a log of another version part from those found now.
    other_events_from: Option<usize>,
}

impl Seen {
    fn summary(&self) -> String {
        let Seen { messages, last_step, last_s, slips, other_events_from } = self;
        let note = other_events_from.map_or(String::new(), |number| {
            format!(", events of another version that differ from this one's from number {number} on")
        });
        format!(
            "{messages} records and events, {slips} slip events, up to step {last_step} ({last_s} s){note}"
        )
    }

    fn read(&mut self, run: &Path) -> Result<(), Problem> {
        let mut reader = RunReader::open(run, Topics::ALL)?;
        let header = reader.header().clone();
        let mut detectors = detectors::all(&header);
        let mut held = Some(Held::default());
        while let Some(item) = reader.next_item()? {
            if reader.has_gap() {
                // What is missing may have been the beginning of an event.
                held = None;
            }
            match item {
                LogItem::Event(event) => {
                    self.slips += u64::from(event.topic == SlipEvent::TOPIC);
                    if let Some(held) = &mut held {
                        held.logged(event);
                    }
                }
                LogItem::Record(record) => {
                    self.record(&header, &record)?;
                    if let (Record::Step(step), Some(held)) = (&record, &mut held) {
                        for detector in &mut detectors {
                            detector.observe(step, &mut |event| held.found(event));
                        }
                    }
                }
            }
            if let Some(Err(difference)) = held.as_mut().map(Held::compare) {
                self.events_differ(&header, difference)?;
                held = None;
            }
            self.messages += 1;
        }
        if let Some(mut held) = held {
            for detector in &mut detectors {
                detector.finish(&mut |event| held.found(event));
            }
            if let Err(difference) = held.finish() {
                self.events_differ(&header, difference)?;
            }
        }
        Ok(())
    }

    /// Other events than those of this program's detectors are damage, unless they were found
    /// by another version of it.
    fn events_differ(&mut self, header: &RunHeader, difference: Difference) -> Result<(), Problem> {
        if header.code_version == CODE_VERSION {
            return Err(Problem::Events(difference));
        }
        self.other_events_from = Some(difference.number);
        Ok(())
    }

    fn record(&mut self, header: &RunHeader, record: &Record) -> Result<(), Problem> {
        let (step, time_s) = match record {
            Record::Step(record) => (record.step, record.time_s),
            Record::Fields(record) => (record.step, record.time_s),
            Record::Window(record) => (record.step, record.time_s),
        };
        // States stand behind the step that they are of; the first is that before the run.
        let in_order = match record {
            Record::Step(_) => step > self.last_step,
            Record::Fields(_) | Record::Window(_) => self.messages == 0 || step == self.last_step,
        };
        if !in_order {
            return Err(Problem::Order { step, before: self.last_step });
        }
        let expected_s = header.time_grid().time_s(step);
        if time_s != expected_s {
            return Err(Problem::Time { step, found_s: time_s, expected_s });
        }
        if let Some(what) = not_finite(record) {
            return Err(Problem::NotFinite { step, what });
        }
        (self.last_step, self.last_s) = (step, time_s);
        Ok(())
    }
}

/// What in a record is no finite number, if anything.
fn not_finite(record: &Record) -> Option<&'static str> {
    let all = |values: &[f64]| values.iter().all(|value| value.is_finite());
    let states = |u: &[f64], v: &[f64], tau: &[f64]| {
        [("a displacement", all(u)), ("a velocity", all(v)), ("a tangential force", all(tau))]
    };
    let checks = match record {
        Record::Step(record) => {
            let loads = [record.driving_force_n, record.normal_load_n];
            let switches = record.switches.iter().all(|s| {
                all(&[
                    s.displacement_m,
                    s.velocity_m_per_s,
                    s.tangential_force_n,
                    s.stick_position_m,
                    s.threshold_n,
                ])
            });
            [
                ("a load", all(&loads)),
                ("a switch", switches),
                ("an end's load", record.end_forces_n.is_none_or(|ends| all(&ends))),
            ]
        }
        Record::Fields(record) => {
            states(&record.displacement_m, &record.velocity_m_per_s, &record.tangential_force_n)
        }
        Record::Window(record) => {
            states(&record.displacement_m, &record.velocity_m_per_s, &record.tangential_force_n)
        }
    };
    checks.into_iter().find(|(_, finite)| !finite).map(|(what, _)| what)
}

#[cfg(test)]
mod tests {
    use asperity_record::{FieldRecord, Record, RunHeader, StepRecord};

    use super::{Problem, Seen};

    fn header() -> RunHeader {
        RunHeader {
            record_schema_version: 1,
            scenario: String::new(),
            scenario_hash: String::new(),
            run_id: String::new(),
            code_version: String::new(),
            parameter_set: String::new(),
            solver: String::new(),
            blocks: 2,
            time_step_s: 0.5,
            steps: 9,
        }
    }

    fn step(step: u64) -> StepRecord {
        StepRecord {
            step,
            time_s: 0.5 * step as f64,
            driving_force_n: 1.0,
            end_forces_n: None,
            normal_load_n: 2.0,
            sliding: 0,
            switches: Vec::new(),
        }
    }

    fn fields(step: u64, velocity_m_per_s: f64) -> Record {
        Record::Fields(FieldRecord {
            step,
            time_s: 0.5 * step as f64,
            displacement_m: vec![0.0; 2],
            velocity_m_per_s: vec![velocity_m_per_s; 2],
            tangential_force_n: vec![0.0; 2],
            stick_position_m: vec![0.0; 2],
            detached: vec![0; 2],
        })
    }

    fn read(records: &[Record]) -> Result<(), Problem> {
        let mut seen = Seen::default();
        records.iter().try_for_each(|record| {
            seen.record(&header(), record)?;
            seen.messages += 1;
            Ok(())
        })
    }

    #[test]
    fn what_no_run_writes_is_damage() {
        let wrong = |record: StepRecord| read(&[Record::Step(record)]).unwrap_err();
        assert!(
            read(&[fields(0, 0.0), Record::Step(step(1)), fields(1, 1.0), Record::Step(step(4))]).is_ok()
        );
        assert!(matches!(read(&[Record::Step(step(2)), Record::Step(step(2))]), Err(Problem::Order { .. })));
        assert!(matches!(read(&[Record::Step(step(2)), fields(3, 0.0)]), Err(Problem::Order { .. })));
        assert!(matches!(wrong(StepRecord { time_s: 0.6, ..step(1) }), Problem::Time { .. }));
        assert!(matches!(
            wrong(StepRecord { driving_force_n: f64::NAN, ..step(1) }),
            Problem::NotFinite { .. }
        ));
        assert!(matches!(read(&[fields(0, f64::INFINITY)]), Err(Problem::NotFinite { .. })));
    }
}
