//! Compares the fast solver with the plain one.
//!
//! Both run the same plan side by side. They are equal if the same blocks switch in the same direction in
//! the same steps, equally many slide, and numbers agree within [`TOLERANCE`] of the run's largest of their
//! kind. In a run that hardly moves, the scale is what a block reaches as it starts to slip: its threshold,
//! the stretch `mu_s p / k` of a spring at that force, the energy of that spring, the velocity
//! `(mu_s - mu_d) p / sqrt(k m)`. Energies are all one kind. Where displacements are large, rounding
//! exceeds that: velocities may differ by `2 eps u / dt`, since a displacement is rounded in every step,
//! and forces by [`rounding_reach`].
//!
//! A difference is accepted as a near tie only under two conditions. The step, taken by the plain solver from the last
//! common state, leaves the block that switched in one solver within the reach of rounding from its switch
//! ([`beyond_switch`]); and the other solver has that switch within [`LATE_STEPS`]. The comparison then continues from
//! the plain solver's state.

use std::sync::Arc;

use asperity_model::Plan;
use asperity_model::law::magnitude;
use asperity_record::{Direction, Energy, FieldRecord, Record, StepRecord};
use serde::{Deserialize, Serialize};

use crate::kind;
use crate::ledger::Ledger;
use crate::norms::Norms;
use crate::plain::Plain;
use crate::recorder::{fields, is_on_cadence};
use crate::solver::{SimulationError, Solver};
use crate::state::SliderState;
use crate::strength::threshold_n;

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
    /// A switch that only one of them has, and not by rounding.
    #[error(
        "step {step}, block {block}: {what} by the {by} solver alone; the plain one has it {beyond:e} beyond its switch, where rounding reaches {reach:e}"
    )]
    Switch {
        /// The step.
        step: u64,
        /// The block, counted from 1.
        block: u32,
        /// "detaches" or "attaches".
        what: &'static str,
        /// Name of the solver that has it.
        by: &'static str,
        /// As in [`NearTie`].
        beyond: f64,
        /// As in [`NearTie`].
        reach: f64,
    },
    /// A switch within reach of rounding that the other solver does not have soon after.
    #[error(
        "step {step}, block {block}: switches by the {by} solver alone, and not within {LATE_STEPS} steps by the other"
    )]
    Missed {
        /// The step.
        step: u64,
        /// The block, counted from 1.
        block: u32,
        /// Name of the solver that has it.
        by: &'static str,
    },
    /// Equal switches, but another number of sliding blocks, or no record.
    #[error("step {step}: the records differ without a switch that explains it")]
    Records {
        /// The step.
        step: u64,
    },
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
    let plain = Plain::new(Arc::clone(&plan));
    hold(&plan, plain, kind::fast(Arc::clone(&plan)), each, progress)
}

/// Compares two solvers at the start of their runs.
fn hold(
    plan: &Plan,
    mut plain: Plain,
    mut fast: Box<dyn Solver>,
    mut each: impl FnMut(&StepRecord, &StepRecord),
    mut progress: impl FnMut(u64),
) -> Result<Agreement, Disagreement> {
    let mut agreement = Agreement::default();
    let mut numbers = Numbers::of(plan);
    let mut common = plain.state().clone();
    let mut of_plain = next_step(plan, &mut plain)?;
    let mut of_fast = next_step(plan, &mut *fast)?;
    loop {
        let (left, right) = match (&of_plain, &of_fast) {
            (None, None) => break,
            (Some(left), Some(right)) if same(&left.record, &right.record) => (left, right),
            _ => {
                let step = [&of_plain, &of_fast].into_iter().flatten().map(|next| next.record.step).min();
                let step = step.expect("one of them is there");
                let here = |next: &Option<Next>| {
                    next.as_ref().map(|next| next.record.clone()).filter(|record| record.step == step)
                };
                let tied = here(&of_plain);
                let coming = [
                    switches_to_come(plan, &plain, of_plain.as_ref(), step)?,
                    switches_to_come(plan, &*fast, of_fast.as_ref(), step)?,
                ];
                common = settle(plan, &common, step, &coming, &mut agreement)?;
                fast.restore(&common.clone().into());
                if let Some(record) = &tied {
                    each(record, record);
                    of_plain = next_step(plan, &mut plain)?;
                }
                of_fast = next_step(plan, &mut *fast)?;
                continue;
            }
        };
        agreement.records += 1;
        agreement.switches += left.record.switches.len() as u64;
        numbers.add(left, right);
        each(&left.record, &right.record);
        progress(left.record.step);
        common.clone_from(plain.state());
        of_plain = next_step(plan, &mut plain)?;
        of_fast = next_step(plan, &mut *fast)?;
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
    plan.recording.sample_every_steps = 0;
    plan.recording.fields_every_steps = (plan.steps / 100).max(1);
    plan.recording.event_fields = false;
    plan.recording.windows.clear();
    plan.recording.rupture_fields = None;
    plan
}

/// The next step worth recording, with the state after it.
struct Next {
    record: StepRecord,
    fields: FieldRecord,
}

fn next_step(plan: &Plan, solver: &mut dyn Solver) -> Result<Option<Next>, SimulationError> {
    let mut step = None;
    loop {
        match (solver.next_record()?, step.take()) {
            (None, _) => return Ok(None),
            (Some(Record::Fields(fields)), Some(record)) => {
                return Ok(Some(Next { record, fields: *fields }));
            }
            (Some(Record::Step(record)), _) => {
                let fields_follow = is_on_cadence(plan.recording.fields_every_steps, record.step);
                if !fields_follow {
                    // Recorded for a cadence: the solver is just after it.
                    let fields = fields(plan, &solver.snapshot().slider);
                    return Ok(Some(Next { record, fields }));
                }
                step = Some(record);
            }
            // The initial state.
            _ => {}
        }
    }
}

/// A block and the direction in which it switches.
type Turn = (u32, Direction);

/// All switches of a record.
fn switches(record: Option<&StepRecord>) -> Vec<Turn> {
    record.map_or(Vec::new(), |record| record.switches.iter().map(|s| (s.block, s.direction)).collect())
}

fn same(a: &StepRecord, b: &StepRecord) -> bool {
    a.step == b.step && a.sliding == b.sliding && switches(Some(a)) == switches(Some(b))
}

/// The switches of a solver that has advanced to `next`, from `step` on and within [`LATE_STEPS`].
fn switches_to_come(
    plan: &Plan,
    solver: &dyn Solver,
    next: Option<&Next>,
    step: u64,
) -> Result<Vec<(u64, Turn)>, SimulationError> {
    let mut solver = solver.fork();
    let mut coming = Vec::new();
    let mut record = next.map(|next| next.record.clone());
    while let Some(known) = record.filter(|record| record.step <= step + LATE_STEPS) {
        coming.extend(switches(Some(&known)).into_iter().map(|switch| (known.step, switch)));
        record = next_step(plan, &mut *solver)?.map(|next| next.record);
    }
    Ok(coming)
}

/// Proves that the differences in a step are near ties; returns the plain solver's state after it.
fn settle(
    plan: &Plan,
    plain: &SliderState,
    step: u64,
    coming: &[Vec<(u64, Turn)>; 2],
    agreement: &mut Agreement,
) -> Result<SliderState, Disagreement> {
    let here =
        |of: usize| coming[of].iter().filter(|(at, _)| *at == step).map(|(_, s)| *s).collect::<Vec<_>>();
    let (by_plain, by_fast) = (here(0), here(1));
    if plan.friction.law.affine().is_none() {
        // Only a step that both solvers take singly can be settled.
        return Err(Disagreement::Records { step });
    }
    let mut again = Plain::new(plan.clone());
    again.restore(&plain.clone().into());
    while again.step() + 1 < step {
        again.take_step();
    }
    let before = again.state().clone();
    again.take_step();
    let after = again.state().clone();
    let mut any = false;
    for (switch, plain_switches) in
        by_plain.iter().map(|s| (s, true)).chain(by_fast.iter().map(|s| (s, false)))
    {
        let both = by_plain.contains(switch) && by_fast.contains(switch);
        if both {
            continue;
        }
        any = true;
        let (block, direction) = *switch;
        let by = if plain_switches { "plain" } else { "fast" };
        let beyond = beyond_switch(plan, &before, &after, block as usize - 1);
        let reach = rounding_reach(plan, &after, direction);
        let within = beyond.abs() <= reach;
        if !within {
            return Err(Disagreement::Switch {
                step,
                block,
                what: if direction == Direction::Detach { "detaches" } else { "attaches" },
                by,
                beyond,
                reach,
            });
        }
        let later = &coming[usize::from(plain_switches)];
        let (late, _) = later.iter().find(|(_, other)| other == switch).ok_or(Disagreement::Missed {
            step,
            block,
            by,
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
    if !any {
        return Err(Disagreement::Records { step });
    }
    Ok(after)
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
        let k = plan.elastic.stiffness_n_per_m();
        let stretch_m = force_n / k;
        let velocity_m_per_s = released_n / (k * plan.block_mass_kg).sqrt();
        // Energy of a spring between blocks at that stretch.
        let energy_j = 0.5 * force_n * stretch_m;
        let least = [force_n, stretch_m, velocity_m_per_s, force_n, stretch_m, energy_j];
        Numbers(least.map(|least| (least, 0.0)))
    }

    fn add(&mut self, plain: &Next, fast: &Next) {
        self.one(0, plain.record.driving_force_n, fast.record.driving_force_n);
        self.energies(&plain.record.energy, &fast.record.energy);
        let (plain, fast) = (&plain.fields, &fast.fields);
        // Along the sliding direction, and over an area across it.
        fn of(state: &FieldRecord) -> [[&[f64]; 2]; 4] {
            [
                [&state.displacement_m, &state.displacement_across_m],
                [&state.velocity_m_per_s, &state.velocity_across_m_per_s],
                [&state.tangential_force_n, &state.tangential_force_across_n],
                [&state.stick_position_m, &state.stick_position_across_m],
            ]
        }
        for (kind, (plain, fast)) in (1..).zip(of(plain).into_iter().zip(of(fast))) {
            for (a, b) in plain.into_iter().flatten().zip(fast.into_iter().flatten()) {
                self.one(kind, *a, *b);
            }
        }
    }

    /// Compares all energies relative to the largest of them.
    fn energies(&mut self, plain: &Energy, fast: &Energy) {
        for ((_, plain), (_, fast)) in plain.parts().zip(fast.parts()) {
            self.one(5, plain, fast);
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
    use asperity_model::{Plan, Scenario, ScenarioSource};
    use asperity_record::Direction;

    use super::{Disagreement, bare, compare, hold};
    use crate::{Plain, SolverKind};

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
        let plan = bare(plan);
        let mut plain = Plain::new(plan.clone());
        loop {
            let record = super::next_step(&plan, &mut plain).unwrap().expect("a block detaches").record;
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
        let outcome = hold(&plan, Plain::new(plan.clone()), SolverKind::Fast.start(off), |_, _| {}, |_| {});
        assert!(matches!(outcome, Err(Disagreement::Switch { block: 1, .. })), "{outcome:?}");
    }
}
