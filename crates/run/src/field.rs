//! A quantity of all contacts over time, as an array: the front of any rupture of any run, although its log
//! recorded only switches there.
//!
//! States that the log recorded densely are taken from it. Otherwise the solver that made the run takes the
//! same steps once more, from the last checkpoint before the range, or from the initial state, and records
//! each requested step. Sampling never changes a trajectory, so switches and plain steps are those of the run
//! to the bit; inside a leap of the fast solver a state rounds differently, by less than 1e-12 of the
//! largest value.

use std::path::Path;

use asperity_model::body::medium::Medium;
use asperity_model::{Plan, RecordingPlan, Scenario, WindowPlan};
use asperity_record::{Contacts, Observer, Record};
use asperity_runlog::{RunReader, Topics};
use asperity_simulator::{Snapshot, SolverKind};

use crate::states::{self, StatesError};

/// A quantity of contacts, in the order of [`Record::motion`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Displacement from the initial grid, m.
    Displacement,
    /// Velocity, m/s.
    Velocity,
    /// Tangential force without friction, N.
    TangentialForce,
    /// Displacement across the sliding direction, over an area, m.
    DisplacementAcross,
    /// Velocity across it, m/s.
    VelocityAcross,
    /// Tangential force across it, N.
    TangentialForceAcross,
}

impl Quantity {
    /// Whether it exists over an area only.
    pub fn is_across(self) -> bool {
        self >= Quantity::DisplacementAcross
    }

    fn of(self, record: &Record) -> &[f64] {
        record.motion().map_or(&[], |motion| motion[self as usize])
    }
}

/// A range of steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// The first.
    pub from_step: u64,
    /// None is later.
    pub to_step: u64,
    /// From one to the next.
    pub every_steps: u64,
}

impl Span {
    fn contains(self, step: u64) -> bool {
        (self.from_step..=self.to_step).contains(&step)
            && (step - self.from_step).is_multiple_of(self.every_steps.max(1))
    }

    /// The number of steps.
    pub fn count(self) -> u64 {
        self.to_step.checked_sub(self.from_step).map_or(0, |steps| steps / self.every_steps.max(1) + 1)
    }
}

/// A quantity of all contacts at steps of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// The steps, ascending.
    pub steps: Vec<u64>,
    /// Their times, s.
    pub time_s: Vec<f64>,
    /// The positions of the contacts along the slider, m; the first is 0, in a medium at its depth.
    pub position_m: Vec<f64>,
    /// Their positions across it, m; all 0 where they lie in a single row.
    pub position_across_m: Vec<f64>,
    /// The values, time by time: contact n at step i is at `i * position_m.len() + n`.
    pub values: Vec<f64>,
}

impl Field {
    /// Of a run without a log.
    ///
    /// # Errors
    /// If the run has no such step, the solver stops before, or the caller stops it.
    pub fn of_scenario(
        scenario: &Scenario,
        solver: SolverKind,
        quantity: Quantity,
        span: Span,
        stop: &dyn Fn() -> bool,
    ) -> Result<Field, StatesError> {
        let plan = Plan::new(scenario);
        there_is(quantity, plan.elastic.layout())?;
        is_in(&plan, span, plan.steps)?;
        compute(plan, solver, None, quantity, span, stop)
    }

    /// Of a logged run, up to its last sound step, as [`check`](crate::check) found it, or its first gap.
    ///
    /// # Errors
    /// If the log is not sound up to there, or of another code version and without dense records of the
    /// range; or as [`Field::of_scenario`].
    pub fn of_log(
        log: &Path,
        last_sound_step: u64,
        quantity: Quantity,
        span: Span,
        stop: &dyn Fn() -> bool,
    ) -> Result<Field, StatesError> {
        let mut reader = RunReader::open(log, Topics::NONE)?;
        let header = reader.header().clone();
        let contacts = header.contacts();
        there_is(quantity, contacts)?;
        let plan = states::resolve(&header, &reader).map(|(_, plan)| plan);
        // Without dense records, only checkpoints are read.
        let is_sparse =
            |plan: &Plan| plan.recording.windows.is_empty() && plan.recording.rupture_fields.is_none();
        let before_step = span.from_step.saturating_sub(1);
        let (last_step, saved) = if plan.as_ref().is_ok_and(is_sparse) {
            (last_sound_step, states::last_saved(&mut reader, before_step, stop))
        } else {
            let mut recorded = Collected { span, quantity, contacts, steps: Vec::new(), values: Vec::new() };
            let mut reader = RunReader::open(log, Topics::RECORDS)?;
            let observe = &mut |record: &Record| recorded.add(record);
            let found = states::saved(&mut reader, last_sound_step, &[before_step], stop, observe);
            if recorded.is_whole() {
                let grid = header.time_grid();
                let medium = plan.ok().and_then(|plan| plan.medium);
                return Ok(recorded.field(|step| grid.time_s(step), header.scales.block_length_m, medium));
            }
            found
        };
        if stop() {
            return Err(StatesError::Interrupted);
        }
        let plan = plan?;
        is_in(&plan, span, last_step)?;
        let from = states::fitting(saved, &plan)?.into_iter().next_back();
        let from = from.filter(|(step, _)| *step < span.from_step).map(|(_, state)| state);
        compute(plan, states::kind(&header), from, quantity, span, stop)
    }
}

/// Refuses a quantity that contacts in a single row do not have.
fn there_is(quantity: Quantity, contacts: Contacts) -> Result<(), StatesError> {
    match quantity.is_across() && !contacts.is_area() {
        true => Err(StatesError::Refused(
            "contacts in a single row do not move across (accepted: a run over an area, of slider.across above 1)"
                .to_owned(),
        )),
        false => Ok(()),
    }
}

fn is_in(plan: &Plan, span: Span, last_step: u64) -> Result<(), StatesError> {
    if span.count() > 0 && span.to_step <= last_step {
        return Ok(());
    }
    let time_s = |step| plan.grid.time_s(step);
    Err(StatesError::Refused(format!(
        "no step of the run is from {} s to {} s (accepted: a range in 0 to {} s)",
        time_s(span.from_step),
        time_s(span.to_step),
        time_s(last_step)
    )))
}

fn compute(
    plan: Plan,
    kind: SolverKind,
    from: Option<Snapshot>,
    quantity: Quantity,
    span: Span,
    stop: &dyn Fn() -> bool,
) -> Result<Field, StatesError> {
    let (contacts, spacing_m, grid) = (plan.elastic.layout(), plan.spacing_m, plan.grid);
    let medium = plan.medium.clone();
    let Span { from_step, to_step, every_steps } = span;
    let window = WindowPlan { from_step, to_step, every_steps: every_steps.max(1), blocks: 0..plan.blocks };
    let recording = RecordingPlan { windows: vec![window], ..RecordingPlan::default() };
    let mut solver = kind.start(Plan { recording, steps: to_step, ..plan });
    if let Some(state) = &from {
        solver.restore(state);
    }
    let mut found = Collected { span, quantity, contacts, steps: Vec::new(), values: Vec::new() };
    while let Some(record) = states::next(&mut *solver, stop)? {
        found.add(&record);
    }
    Ok(found.field(|step| grid.time_s(step), spacing_m, medium))
}

/// Takes the steps of a logged run once more, from its beginning, and passes other records to an observer than the log
/// has: those that `recording` names.
///
/// # Errors
/// If the log cannot be read, is of another code version, or its scenario is of another run; if the solver stops before
/// its end, or the caller stops it.
pub fn record_again(
    log: &Path,
    recording: RecordingPlan,
    observer: &mut dyn Observer,
    stop: &dyn Fn() -> bool,
) -> Result<(), StatesError> {
    let reader = RunReader::open(log, Topics::NONE)?;
    let header = reader.header().clone();
    let (_, plan) = states::resolve(&header, &reader)?;
    let mut solver = states::kind(&header).start(Plan { recording, ..plan });
    while let Some(record) = states::next(&mut *solver, stop)? {
        observer.record(&record);
    }
    Ok(())
}

/// The requested states among records.
struct Collected {
    span: Span,
    quantity: Quantity,
    contacts: Contacts,
    steps: Vec<u64>,
    values: Vec<f64>,
}

impl Collected {
    fn add(&mut self, record: &Record) {
        let (step, values) = (record.step(), self.quantity.of(record));
        let is_new = self.steps.last().is_none_or(|last| *last < step);
        if is_new && values.len() == self.contacts.count() as usize && self.span.contains(step) {
            self.steps.push(step);
            self.values.extend_from_slice(values);
        }
    }

    fn is_whole(&self) -> bool {
        self.steps.len() as u64 == self.span.count() && !self.steps.is_empty()
    }

    fn positions_m(&self, spacing_m: f64, place: fn(Contacts, u32) -> u32) -> Vec<f64> {
        let all = 1..=self.contacts.count();
        all.map(|contact| f64::from(place(self.contacts, contact) - 1) * spacing_m).collect()
    }

    fn field(self, time_s: impl Fn(u64) -> f64, spacing_m: f64, medium: Option<Box<Medium>>) -> Field {
        let along_m = |medium: Box<Medium>| (0..medium.nodes()).map(|node| medium.depth_m(node)).collect();
        Field {
            time_s: self.steps.iter().map(|step| time_s(*step)).collect(),
            position_m: medium.map_or_else(|| self.positions_m(spacing_m, Contacts::column), along_m),
            position_across_m: self.positions_m(spacing_m, Contacts::row),
            steps: self.steps,
            values: self.values,
        }
    }
}
