//! Compares the fast solver with the plain one.
//!
//! Both run the same plan side by side. They are equal if the same blocks switch in the same direction in
//! the same steps, equally many slide, and numbers agree within [`TOLERANCE`] of the run's largest of their
//! kind. In a run that hardly moves, the scale is what a block reaches as it starts to slip: its threshold,
//! the stretch `mu_s p / k` of a spring at that force, the energy of that spring, the velocity
//! `(mu_s - mu_d) p / sqrt(k m)`. Energies are all one kind. Where displacements are large, rounding
//! exceeds that: velocities may differ by `2 eps u / dt`, since a displacement is rounded in every step,
//! and forces by [`Norms::force_rounding`].
//!
//! A difference is accepted as a near tie only under two conditions. The step, taken by the plain solver from the last
//! common state, leaves the block that switched in one solver within the reach of rounding from its switch
//! ([`beyond_switch`]); and the other solver has that switch within [`LATE_STEPS`]. The comparison then continues from
//! the plain solver's state.

use std::sync::Arc;

use asperity_model::law::magnitude;
use asperity_model::{Ledger, Plan, SliderState};
use asperity_record::{Direction, FieldRecord, Record, StepRecord};
use asperity_simulator::{Norms, Plain, SimulationError, Solver, SolverKind, fields, threshold_n};
use serde::{Deserialize, Serialize};

/// Numbers agree within this share of the largest of their kind in the run.
pub const TOLERANCE: f64 = 1e-9;

/// Steps within which the second solver must have a switch of the first.
pub const LATE_STEPS: u64 = 1000;

/// A switch that rounding decides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NearTie {
    /// The step in which the first of the solvers has it.
    pub step: u64,
    /// The block, counted from 1.
    pub block: u32,
    /// Which way it switches.
    pub direction: Direction,
    /// Whether the plain solver has it in this step and the fast one later, or vice versa.
    pub plain_switches: bool,
    /// Delay of the other solver, in steps.
    pub late_steps: u64,
    /// How far the plain solver has the block beyond its switch in that step: N of force for detachment, m/s of
    /// velocity for re-attachment.
    pub beyond: f64,
    /// How far rounding reaches in a state of that size ([`rounding_reach`]), in the unit of `beyond`.
    pub reach: f64,
    /// The last common state, as the plain solver has it.
    pub before: SliderState,
}

/// How far two runs of a plan agree.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Agreement {
    /// Records that were compared.
    pub records: u64,
    /// Block switches among them.
    pub switches: u64,
    /// How far each kind of number differs.
    pub deviations: Vec<Deviation>,
    /// The differences, all of them admitted.
    pub near_ties: Vec<NearTie>,
}

/// How far one kind of number differs between two runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// The kind.
    pub what: &'static str,
    /// The scale: the largest magnitude of its kind, SI.
    pub largest: f64,
    /// The largest difference relative to that.
    pub share: f64,
}

/// Two runs that do not agree.
#[derive(Debug, thiserror::Error)]
pub enum Disagreement {
    /// In their switches, and not by rounding, or in their records.
    #[error("{0}")]
    Records(String),
    /// Numbers too far apart.
    #[error("{what}: the runs differ by {deviation:e} of the largest (accepted: {TOLERANCE:e})")]
    Numbers {
        /// The kind of number.
        what: &'static str,
        /// Its largest deviation.
        deviation: f64,
    },
    /// One of the runs failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
}

/// Runs a plan with both solvers and compares them. Calls `each` with the records of the plain and the
/// fast solver of every compared step (at a near tie with the plain one's twice), and `progress` with
/// the last step.
///
/// # Errors
/// If they disagree, or one of them fails.
pub fn compare(
    plan: &Plan,
    each: impl FnMut(&StepRecord, &StepRecord),
    progress: impl FnMut(u64),
) -> Result<Agreement, Disagreement> {
    let plan = Arc::new(bare(plan));
    let solvers = [SolverKind::Plain, SolverKind::Fast].map(|kind| Side::begin(kind, &plan));
    hold(&plan, solvers, each, progress)
}

/// Compares the plain and another solver at the start of their runs.
fn hold(
    plan: &Plan,
    [mut plain, mut fast]: [Side; 2],
    mut each: impl FnMut(&StepRecord, &StepRecord),
    mut progress: impl FnMut(u64),
) -> Result<Agreement, Disagreement> {
    let mut agreement = Agreement::default();
    let mut numbers = Numbers::of(plan);
    let mut common = plain.solver.snapshot().slider;
    plain.advance()?;
    fast.advance()?;
    loop {
        match (&plain.record, &fast.record) {
            (None, None) => break,
            (Some(left), Some(right)) if same(left, right) => {
                agreement.records += 1;
                agreement.switches += left.switches.len() as u64;
                common = plain.solver.snapshot().slider;
                numbers.add((left, &plain.fields()), (right, &fast.fields()));
                each(left, right);
                progress(left.step);
                plain.advance()?;
            }
            (left, right) => {
                let step = [left, right].into_iter().flatten().map(|record| record.step).min();
                let step = step.expect("one of them is there");
                let tied = left.clone().filter(|record| record.step == step);
                let coming = [plain.switches_to_come(step)?, fast.switches_to_come(step)?];
                common = settle(plan, &common, step, &coming, &mut agreement)?;
                fast.solver.restore(&common.clone().into());
                if let Some(record) = &tied {
                    each(record, record);
                    plain.advance()?;
                }
            }
        }
        fast.advance()?;
    }
    agreement.deviations = numbers.deviations(plan);
    match agreement
        .deviations
        .iter()
        .find(|deviation| deviation.share.is_nan() || deviation.share > TOLERANCE)
    {
        Some(&Deviation { what, share, .. }) => Err(Disagreement::Numbers { what, deviation: share }),
        None => Ok(agreement),
    }
}

/// The plan with only the required records, switches and the edges of slip events, and a hundred states
/// in between.
fn bare(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.recording = asperity_model::RecordingPlan {
        fields_every_steps: (plan.steps / 100).max(1),
        ..asperity_model::RecordingPlan::default()
    };
    plan
}

/// A solver just after its last step record, which is `None` before the first and at the end.
struct Side {
    kind: SolverKind,
    plan: Arc<Plan>,
    solver: Box<dyn Solver>,
    record: Option<StepRecord>,
    /// The state that was recorded with it, if any.
    fields: Option<Box<FieldRecord>>,
}

impl Side {
    fn begin(kind: SolverKind, plan: &Arc<Plan>) -> Side {
        Side {
            kind,
            plan: Arc::clone(plan),
            solver: kind.start(Arc::clone(plan)),
            record: None,
            fields: None,
        }
    }

    /// Goes on to the next step worth recording.
    fn advance(&mut self) -> Result<(), SimulationError> {
        (self.record, self.fields) = (None, None);
        while let Some(record) = self.solver.next_record()? {
            match record {
                Record::Step(record) => self.record = Some(record),
                Record::Fields(fields) => self.fields = Some(fields),
                _ => {}
            }
            let is_due =
                |record: &StepRecord| record.step.is_multiple_of(self.plan.recording.fields_every_steps);
            if self.record.as_ref().is_some_and(|record| !is_due(record) || self.fields.is_some()) {
                break;
            }
            if self.record.is_none() {
                // The initial state.
                self.fields = None;
            }
        }
        Ok(())
    }

    /// The state after that step. Unless one is recorded, the solver has not left it.
    fn fields(&self) -> FieldRecord {
        self.fields.as_deref().cloned().unwrap_or_else(|| fields(&self.plan, &self.solver.snapshot().slider))
    }

    /// The switches from `step` on and within [`LATE_STEPS`].
    fn switches_to_come(&self, step: u64) -> Result<Vec<(u64, Turn)>, SimulationError> {
        let mut ahead = Side::begin(self.kind, &self.plan);
        ahead.solver.restore(&self.solver.snapshot());
        ahead.record.clone_from(&self.record);
        let mut coming = Vec::new();
        while let Some(record) = ahead.record.take().filter(|record| record.step <= step + LATE_STEPS) {
            coming.extend(switches(&record).into_iter().map(|switch| (record.step, switch)));
            ahead.advance()?;
        }
        Ok(coming)
    }
}

/// A block and the direction in which it switches.
type Turn = (u32, Direction);

/// All switches of a record.
fn switches(record: &StepRecord) -> Vec<Turn> {
    record.switches.iter().map(|s| (s.block, s.direction)).collect()
}

fn same(a: &StepRecord, b: &StepRecord) -> bool {
    a.step == b.step && a.sliding == b.sliding && switches(a) == switches(b)
}

/// Proves that the differences in a step are near ties; returns the plain solver's state after it.
fn settle(
    plan: &Plan,
    plain: &SliderState,
    step: u64,
    coming: &[Vec<(u64, Turn)>; 2],
    agreement: &mut Agreement,
) -> Result<SliderState, Disagreement> {
    let unexplained = || {
        Disagreement::Records(format!("step {step}: the records differ without a switch that explains it"))
    };
    if plan.friction.law.affine().is_none() {
        // Only a step that both solvers take singly can be settled.
        return Err(unexplained());
    }
    let [before, after] = step_after(&mut Plain::new(plan.clone()), plain, step);
    let mut any = false;
    for (plain_switches, [own, other]) in [(true, [0, 1]), (false, [1, 0])] {
        let [own, other] = [&coming[own], &coming[other]];
        for (_, switch) in own.iter().filter(|turn| turn.0 == step && !other.contains(turn)) {
            any = true;
            let (block, direction) = *switch;
            let by = if plain_switches { "plain" } else { "fast" };
            let beyond = beyond_switch(plan, &before, &after, block as usize - 1);
            let reach = rounding_reach(plan, &after, direction);
            let within = beyond.abs() <= reach;
            if !within {
                return Err(Disagreement::Records(format!(
                    "step {step}, block {block}: {direction:?} by the {by} solver alone; the plain one has it \
                     {beyond:e} beyond its switch, where rounding reaches {reach:e}"
                )));
            }
            let (late, _) = other.iter().find(|(_, other)| other == switch).ok_or_else(|| {
                Disagreement::Records(format!(
                    "step {step}, block {block}: switches by the {by} solver alone, and not within {LATE_STEPS} steps \
                     by the other"
                ))
            })?;
            agreement.near_ties.push(NearTie {
                step,
                block,
                direction,
                plain_switches,
                late_steps: late - step,
                beyond,
                reach,
                // The proof concerns the switch alone.
                before: SliderState { energy: Ledger::default(), ..plain.clone() },
            });
        }
    }
    if any { Ok(after) } else { Err(unexplained()) }
}

/// Takes single steps from a state up to a step; gives the states before and after the last of them.
pub fn step_after(plain: &mut Plain, from: &SliderState, step: u64) -> [SliderState; 2] {
    plain.restore(&from.clone().into());
    while plain.step() + 1 < step {
        plain.take_step();
    }
    let before = plain.state().clone();
    plain.take_step();
    [before, plain.state().clone()]
}

/// How far contact `n`, counted from 0, is beyond its switch in the single step that leads from one state to the next:
/// of one that stuck, the force above its threshold, N; of one that slid, the velocity below 0 or, by the two-way rule
/// and over an area, against its former direction, m/s. It switches if this is not negative. A law that stops a contact
/// leaves no velocity behind: there the one before the step counts.
pub fn beyond_switch(plan: &Plan, before: &SliderState, after: &SliderState, n: usize) -> f64 {
    // Where contacts have one tangential freedom, the other component is zero.
    let along = |of: &[f64], from_one_to_next: usize| -> [f64; 2] {
        std::array::from_fn(|axis| match axis < plan.elastic.tangential_axes() {
            true => of[axis * from_one_to_next + n],
            false => 0.0,
        })
    };
    let nodes = plan.elastic.nodes();
    if before.slip[n] == 0.0 {
        let force_n = if plan.friction.law.detaches_by_spring() {
            let [at_m, anchor_m] =
                [along(&before.displacement_m, nodes), along(&before.stick_position_m, plan.blocks)];
            [0, 1].map(|axis| plan.friction.springs_n_per_m[n] * (anchor_m[axis] - at_m[axis]))
        } else {
            along(&after.tangential_force_n, plan.blocks)
        };
        return magnitude(force_n) - threshold_n(plan, after, n);
    }
    let was_stopped = after.slip[n] == 0.0 && plan.friction.law.holds();
    let velocity = along(if was_stopped { &before.velocity_m_per_s } else { &after.velocity_m_per_s }, nodes);
    let has_just_detached = before.just_detached.contains(&(n as u32));
    let direction = match plan.friction.law.affine() {
        Some(form) if form.forward_only && plan.elastic.tangential_axes() == 1 => [1.0, 0.0],
        _ if has_just_detached => along(&before.tangential_force_n, plan.blocks),
        _ => along(&before.velocity_m_per_s, nodes),
    };
    let length = magnitude(direction);
    let forwards: f64 = velocity.iter().zip(&direction).map(|(v, d)| v * d).sum();
    if length == 0.0 { 0.0 } else { -forwards / length }
}

/// How far the rounding of a state of this size may move the quantity that decides a switch.
pub fn rounding_reach(plan: &Plan, state: &SliderState, direction: Direction) -> f64 {
    let largest = |values: &[f64]| values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let norms = Norms::of(plan);
    let (u, v) = (largest(&state.displacement_m), largest(&state.velocity_m_per_s));
    match direction {
        Direction::Detach => norms.force_rounding(u, v),
        Direction::Attach => norms.velocity_rounding(u, v),
    }
}

/// Largest numbers and largest differences, by kind, over all blocks at every compared step.
#[derive(Debug)]
struct Numbers([(f64, f64); 6]);

impl Numbers {
    const KINDS: [&'static str; 6] =
        ["driving force", "displacement", "velocity", "tangential force", "stick position", "energy"];

    fn of(plan: &Plan) -> Numbers {
        let friction = &plan.friction;
        let most = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(*value));
        let force_n = most(&friction.static_threshold_n);
        let released_n = (force_n - most(&friction.dynamic_friction_n)).abs();
        let k = plan.elastic.stiffness_n_per_m;
        let stretch_m = force_n / k;
        let velocity_m_per_s = released_n / (k * plan.block_mass_kg).sqrt();
        // Energy of a spring between blocks at that stretch.
        let energy_j = 0.5 * force_n * stretch_m;
        let least = [force_n, stretch_m, velocity_m_per_s, force_n, stretch_m, energy_j];
        Numbers(least.map(|least| (least, 0.0)))
    }

    fn add(&mut self, plain: (&StepRecord, &FieldRecord), fast: (&StepRecord, &FieldRecord)) {
        self.one(0, plain.0.driving_force_n, fast.0.driving_force_n);
        // All energies relative to the largest of them.
        for ((_, plain), (_, fast)) in plain.0.energy.parts().zip(fast.0.energy.parts()) {
            self.one(5, plain, fast);
        }
        // Along the sliding direction, and over an area across it.
        fn of(state: &FieldRecord) -> [[&[f64]; 2]; 4] {
            [
                [&state.displacement_m, &state.displacement_across_m],
                [&state.velocity_m_per_s, &state.velocity_across_m_per_s],
                [&state.tangential_force_n, &state.tangential_force_across_n],
                [&state.stick_position_m, &state.stick_position_across_m],
            ]
        }
        for (kind, (plain, fast)) in (1..).zip(of(plain.1).into_iter().zip(of(fast.1))) {
            for (a, b) in plain.into_iter().flatten().zip(fast.into_iter().flatten()) {
                self.one(kind, *a, *b);
            }
        }
    }

    fn one(&mut self, kind: usize, plain: f64, fast: f64) {
        let (largest, deviation) = &mut self.0[kind];
        *largest = largest.max(plain.abs());
        let off = (plain - fast).abs();
        // NaN differs from everything.
        *deviation = if off <= *deviation { *deviation } else { off };
    }

    fn deviations(&self, plan: &Plan) -> Vec<Deviation> {
        let mut all = self.0;
        let (u, v) = (all[1].0, all[2].0);
        let jitter_m_per_s = 2.0 * f64::EPSILON * u / plan.grid.step_s();
        all[2].0 = v.max(jitter_m_per_s / TOLERANCE);
        all[3].0 = all[3].0.max(Norms::of(plan).force_rounding(u, v) / TOLERANCE);
        let of = |(what, (largest, deviation)): (&'static str, (f64, f64))| Deviation {
            what,
            largest,
            share: if deviation == 0.0 { 0.0 } else { deviation / largest },
        };
        Numbers::KINDS.into_iter().zip(all).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::{Plan, Scenario, ScenarioSource};
    use asperity_record::Direction;
    use asperity_simulator::SolverKind;

    use super::{Side, bare, compare, hold};

    fn plan() -> Plan {
        // A hundred times the drive velocity, so that the first detachment comes within some 60,000
        // steps.
        let source = ScenarioSource::new(
            "test",
            "parameter_set = \"as-coded\"\ntime.duration_s = 0.0015\ndrive.velocity_m_per_s = 0.01",
        );
        Plan::new(&Scenario::resolve(&source).unwrap())
    }

    /// The first detachment: step, block from 0, and the force at it.
    fn first_detachment(plan: &Plan) -> (u64, usize, f64) {
        let mut plain = Side::begin(SolverKind::Plain, &Arc::new(bare(plan)));
        loop {
            plain.advance().unwrap();
            let record = plain.record.as_ref().expect("a block detaches");
            if let Some(switch) = record.switches.first() {
                return (record.step, switch.block as usize - 1, switch.tangential_force_n);
            }
        }
    }

    #[test]
    fn thresholds_that_rounding_decides_are_near_ties_and_proved() {
        let (step, block, force_n) = first_detachment(&plan());
        let mut ties = 0;
        for digits in (-40..40).step_by(3) {
            let mut plan = plan();
            plan.friction.static_threshold_n[block] = force_n * (1.0 + f64::from(digits) * f64::EPSILON);
            let agreement = compare(&plan, |_, _| {}, |_| {}).unwrap();
            for tie in &agreement.near_ties {
                assert_eq!((tie.step, tie.block, tie.direction), (step, block as u32 + 1, Direction::Detach));
                assert!(tie.beyond.abs() <= tie.reach && tie.reach < 1e-7, "{tie:?}");
                assert_eq!(tie.beyond >= 0.0, tie.plain_switches, "{tie:?}");
            }
            ties += agreement.near_ties.len();
        }
        assert!(ties > 0, "rounding decides some of these");
    }

    #[test]
    fn a_solver_that_is_wrong_is_told_from_one_that_rounds() {
        let plan = bare(&plan());
        let (.., force_n) = first_detachment(&plan);
        // Late by one step: far more than rounding, and invisible in a figure.
        let mut off = plan.clone();
        off.friction.static_threshold_n[0] = force_n * (1.0 + 1e-6);
        let plain = Side::begin(SolverKind::Plain, &Arc::new(plan.clone()));
        let fast = Side::begin(SolverKind::Fast, &Arc::new(off));
        let outcome = hold(&plan, [plain, fast], |_, _| {}, |_| {});
        let said = outcome.expect_err("it is wrong").to_string();
        assert!(said.contains(", block 1: ") && said.contains(" beyond its switch"), "{said}");
    }
}
