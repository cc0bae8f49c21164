//! Runs that begin in the state of another one: reads the log that `initial.from` names.
//!
//! A log that was not finished has states up to the last step that its check finds sound; a salvaged one, up to its
//! first gap.
//!
//! The state is that of the run to the bit: the solver that made it restores the last checkpoint before the step and
//! takes the steps up to it again. It does not depend on where the checkpoints are, which is a matter of computing
//! time, so a log that is made again gives the same state.

use std::collections::VecDeque;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use crate::check::check;
use crate::states::{self, StatesError};
use crate::verdict::Verdict;
use asperity_model::scenario::files::UnfitState;
use asperity_model::{Files, Plan, RecordingPlan, Scenario};
use asperity_record::bounds::LONGEST_STATE_BYTES;
use asperity_record::{RunHeader, short_time};
use asperity_runlog::{RunReader, Topics, is_being_written};

/// Logs that are kept: a study plans its runs, and makes them, from one or a few.
const LOGS_KEPT: usize = 8;

/// Most bytes of states that are kept of a log, besides the one that was asked for last.
const STATES_KEPT_BYTES: usize = 32 << 20;

/// Opens what a scenario of a user names: texts, and logs of runs in whose states it begins.
pub struct Opened;

impl Files for Opened {
    fn state(&self, scenario: &Scenario) -> Result<String, UnfitState> {
        state_of_log(scenario, false)
    }
}

/// As [`Opened`], for the runs of a study, which begin at a stated time of a log that was not finished: it may go on.
pub struct OpenedForStudy;

impl Files for OpenedForStudy {
    fn state(&self, scenario: &Scenario) -> Result<String, UnfitState> {
        state_of_log(scenario, true)
    }
}

/// Where a scenario that was resolved just now begins, in words, if that is the end of a log that was not finished.
pub fn begins_at_end(scenario: &Scenario) -> Option<String> {
    let parents = PARENTS.lock().unwrap_or_else(PoisonError::into_inner);
    let parent = parents.iter().find(|parent| parent.log == Path::new(&scenario.initial.from))?;
    let end = (parent.last_step, scenario.initial.state.clone());
    parent.unfinished.clone().filter(|_| scenario.initial.at_s == 0.0 && parent.states.contains(&end))
}

/// A logged run, and the states that have been asked for.
struct Parent {
    log: PathBuf,
    /// Length and time of change of its file.
    stamp: (u64, Option<SystemTime>),
    header: RunHeader,
    scenario: Scenario,
    plan: Arc<Plan>,
    /// The last step of which the log is sound, and all before it.
    last_step: u64,
    /// Where that is, in words, unless it is the end of the run.
    unfinished: Option<String>,
    /// Their texts by step, the one that was asked for last at the front.
    states: VecDeque<(u64, String)>,
}

static PARENTS: Mutex<VecDeque<Parent>> = Mutex::new(VecDeque::new());

/// The state of a logged run as the text of `initial.state`.
fn state_of_log(scenario: &Scenario, is_of_study: bool) -> Result<String, UnfitState> {
    let log = Path::new(&scenario.initial.from);
    let refuse = |problem: String, accepted: &str| UnfitState {
        key: "initial.from",
        problem: format!("{}: {problem}", log.display()),
        accepted: accepted.to_owned(),
    };
    // Other runs of a study wait, and find it.
    let mut parents = PARENTS.lock().unwrap_or_else(PoisonError::into_inner);
    let stamp = |of: &Metadata| (of.len(), of.modified().ok());
    let now = std::fs::metadata(log).ok().as_ref().map(stamp);
    let kept = parents.iter().position(|parent| parent.log == log && Some(parent.stamp) == now);
    let mut parent = match kept.and_then(|index| parents.remove(index)) {
        Some(parent) => parent,
        None => {
            let accepted = "the log of a run by this program: complete, incomplete or salvaged";
            Parent::open(log, now.unwrap_or_default()).map_err(|problem| refuse(problem, accepted))?
        }
    };
    let outcome = match (&parent.unfinished, scenario.initial.at_s) {
        (Some(end), 0.0) if is_of_study => Err(refuse(format!("a study {end}"), "beside it initial.at_s")),
        _ => parent.state(scenario, &refuse),
    };
    parents.truncate(LOGS_KEPT - 1);
    parents.push_front(parent);
    outcome
}

impl Parent {
    fn open(log: &Path, stamp: (u64, Option<SystemTime>)) -> Result<Parent, String> {
        let checked = check(log);
        match checked.verdict {
            _ if is_being_written(log) => return Err("another process is writing it".to_owned()),
            Verdict::Whole | Verdict::OtherCode | Verdict::Incomplete | Verdict::Salvaged => {}
            Verdict::NoRunLog => return Err(checked.to_string()),
            Verdict::Damaged => return Err(format!("the log is {checked}; salvage it first")),
            _ => return Err(format!("the log is {checked}")),
        }
        let mut reader =
            RunReader::open(log, Topics::RECORDS).map_err(|_| format!("the log is {checked}"))?;
        let header = reader.header().clone();
        let (scenario, plan) = states::resolve(&header, &reader).map_err(|error| error.to_string())?;
        let (grid, verdict, seen_step) = (plan.grid, checked.verdict, checked.seen.last_step);
        let last_step = match verdict {
            Verdict::Salvaged => states::saved(&mut reader, seen_step, &[], &|| false, &mut |_| ()).0,
            _ => seen_step,
        };
        let last_step = last_step.max(plan.initial.step);
        let ends = if last_step < seen_step { "has its first gap" } else { "ends" };
        let begins = format!("begins at {} s, where {}", short_time(grid.time_s(last_step)), log.display());
        let unfinished = (!verdict.holds_all()).then(|| format!("{begins}, {verdict}, {ends}"));
        Ok(Parent {
            log: log.to_owned(),
            stamp,
            header,
            scenario,
            plan: Arc::new(plan),
            last_step,
            unfinished,
            states: VecDeque::new(),
        })
    }

    fn state(
        &mut self,
        scenario: &Scenario,
        refuse: &dyn Fn(String, &str) -> UnfitState,
    ) -> Result<String, UnfitState> {
        if let Some((key, found, wanted)) = scenario.differs_in(&self.scenario.keys_of_states()) {
            return Err(refuse(
                format!("its run has {key} = {found}, not {wanted}"),
                "a run of the same slider, friction law and time step",
            ));
        }
        let (grid, first) = (self.plan.grid, self.plan.initial.step);
        let step = match scenario.initial.at_s {
            0.0 => self.last_step,
            at_s => grid.nearest_step(at_s),
        };
        if !(first..=self.last_step).contains(&step) {
            return Err(UnfitState {
                key: "initial.at_s",
                problem: format!("{} s is not in the run of {}", scenario.initial.at_s, self.log.display()),
                accepted: format!(
                    "a time {} to {} s, or 0 for its end",
                    // 0 has another meaning.
                    match first {
                        0 => "above 0, up".to_owned(),
                        first => format!("from {}", grid.time_s(first)),
                    },
                    grid.time_s(self.last_step)
                ),
            });
        }
        let text =
            self.text(step).map_err(|error| refuse(error.to_string(), "a run whose state is known"))?;
        if text.len() > LONGEST_STATE_BYTES {
            return Err(refuse(
                format!("its state has {} bytes as text", text.len()),
                &format!(
                    "a state of up to {LONGEST_STATE_BYTES} bytes, as of a chain of 100000 blocks or a sheet of 50000"
                ),
            ));
        }
        Ok(text)
    }

    /// The state after a step. It depends on this run alone, so all runs that begin in it share its text.
    fn text(&mut self, step: u64) -> Result<String, StatesError> {
        let kept = self.states.iter().position(|(at, _)| *at == step);
        let text = match kept.and_then(|index| self.states.remove(index)) {
            Some((_, text)) => text,
            None => self.simulated(step)?,
        };
        let mut bytes = 0;
        self.states.retain(|(_, text)| {
            bytes += text.len();
            bytes <= STATES_KEPT_BYTES
        });
        self.states.push_front((step, text.clone()));
        Ok(text)
    }

    fn simulated(&self, step: u64) -> Result<String, StatesError> {
        let mut reader = RunReader::open(&self.log, Topics::NONE)?;
        let saved = states::fitting(states::last_saved(&mut reader, step, &|| false), &self.plan)?;
        let recording = RecordingPlan::default();
        let plan = Plan { steps: step, recording, ..Plan::clone(&self.plan) };
        let mut solver = states::kind(&self.header).start(plan);
        if let Some((_, snapshot)) = saved.into_iter().next_back() {
            solver.restore(&snapshot);
        }
        while solver.next_record()?.is_some() {}
        Ok(solver.snapshot().to_given(&self.scenario, &self.plan).to_text())
    }
}
