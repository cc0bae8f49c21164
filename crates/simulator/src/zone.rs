//! Zones: where the first blocks of a long chain slide, they alone are stepped, while the others go
//! on in a jump.
//!
//! What a block does reaches its neighbours step by step. Over some hundred or thousand steps it is
//! felt, but for rounding, no further than a *reach* of a few dozen or hundred blocks. So a chain
//! that is driven at its first block, and of which only blocks up to some `x` slide, is cut in two:
//!
//! ```text
//! | may switch | reach | reach |  the rest of the chain
//! 0 .......... x .... cut ..... end .................... N
//! |<-------- stepped -------->|
//!                     |<------------ in the jump ------->|
//! ```
//!
//! `x` is some way behind the last block that slides. *Stepped* are the blocks before `end`, as a chain
//! of its own, without what lies behind. That is wrong at `end`; one reach before it, at `cut`, it is
//! not felt. *In the jump* is a whole chain in which every block sticks for ever, which is what the
//! blocks behind `x` have been up to now and go on to be: there it has their state and anchors. Before
//! `x` it may be any chain, since that is not felt at `cut`: here one at rest under the forces of now,
//! so that it rings as little as may be. Its certificate ([`crate::jump`]) is that no block behind
//! `cut` detaches. Blocks between `x` and `cut` are stepped and right. When one of them switches, when
//! all blocks have stuck for some time, or when the steps are used up for which the reach holds, the two
//! parts are put together again at `cut`.
//!
//! **Reach.** Between `x` and `end` every block sticks, so what passes there goes by the one map of
//! the stuck chain, however the blocks before `x` switch: first by what is wrong at `end`, then, at
//! `cut`, by what happens before `x`. What is wrong at an edge is a force of at most `k` times a
//! difference `u` of displacements and `eta` times one of velocities; in a step its block takes the
//! velocities `dt k u / m` and `dt eta v / m` from it. What one unit of that becomes is followed step by
//! step, from the middle of a stuck chain; over `i` steps no block feels more than `i` times the largest
//! of it. It is felt where that is more than [`UNFELT`] of the displacements, or ways in a step, that it
//! came from: some hundredths of a rounding error.
//!
//! **Going on.** A zone that opens where a jump of the whole chain ends takes only its own blocks from the
//! waves, and has that jump go on for all others. Once its blocks stick, the jump goes on over the whole
//! chain, with what has become of the blocks before `cut`; see [`crate::jump`]. So in the longest chains
//! the parts are put together, at the cost of the whole chain, once in [`MOST_IN_A_ROW`] zones. While a
//! zone is open, or a jump that has gone on, the solver's state has the step and the anchors from which
//! the jump goes on; displacements and velocities are with the waves.
//!
//! **What it needs.** No record but states of all blocks may need the blocks behind the zone: one is
//! opened only in runs without energies, without dense windows and without the states of ruptures.
//! States of all blocks are put together from both parts.

use asperity_model::{Elastic, Law, Plan};
use asperity_record::FieldRecord;

use crate::counters::Counters;
use crate::jump::Jump;
use crate::solver::Solver;
use crate::state::ChainState;
use crate::sweep::{Impulse, Sweeps};

/// Shorter chains are stepped whole.
const SHORTEST_CHAIN: usize = 512;

/// Reaches are known for so many steps; in chains of fewer blocks than [`SHORTEST_GOING_ON`] for at most
/// [`MOST_STEPS_OF_SHORT`], since it takes some milliseconds to find them.
const STEPS: [u64; 8] = [256, 512, 1024, 2048, 4096, 8192, 16_384, 32_768];
const MOST_STEPS_OF_SHORT: u64 = 8192;

/// No reach is further.
const FURTHEST: usize = 512;

/// What is not felt, over the way that it came from.
const UNFELT: f64 = 1.0 / (1u64 << 60) as f64;

/// What is not followed any further.
const AT_REST: f64 = 1e-40;

/// Lengths of zones are multiples of this.
const GRANULE: usize = 64;

/// A jump of chains of so many blocks goes on with what so many of the first have become.
const SHORTEST_GOING_ON: usize = 2048;
const FIRST_BLOCKS: usize = 1024;

/// What a step of a window takes, over a single step, about.
const SHARE_OF_WINDOWS: f64 = 0.7;

/// What it takes to open and to close a zone, over taking a chain apart into waves or putting it
/// together again.
const TIMES_WAVES: f64 = 6.0;

/// A zone is opened if it takes no more than such a part of what the whole chain would.
const MOST_SHARE: f64 = 0.6;

/// Steps before the next zone is tried where the rest of the chain allowed none.
pub(crate) const PATIENCE_STEPS: u64 = 4096;

/// Steps without a switch behind which a chain that sticks is left to a jump.
pub(crate) const QUIET_STEPS: u64 = 400;

/// The same where that jump goes on with what the first blocks have become.
pub(crate) const QUIET_STEPS_GOING_ON: u64 = 64;

/// So many zones follow each other at once. From inside of one, or of a jump between them, no run can
/// be gone on with: behind them the chain is stepped whole up to its next switch.
const MOST_IN_A_ROW: u32 = 64;

/// A threshold that is never reached.
const NEVER_N: f64 = 1e30;

/// What zones of a chain have in common; `S` steps their blocks.
#[derive(Debug, Clone)]
pub(crate) struct Zones<S> {
    /// Steps, and how far they are felt, ascending.
    reaches: Vec<(u64, usize)>,
    /// The first blocks of the plan, of which zones behind a jump that goes on are made.
    first_blocks: Option<Plan>,
    /// How many have followed each other, with nothing but jumps that go on between them.
    pub(crate) in_a_row: u32,
    pub(crate) open: Option<Zone<S>>,
}

/// A zone that is open.
#[derive(Debug, Clone)]
pub(crate) struct Zone<S> {
    /// Steps the first blocks.
    pub(crate) first: Box<S>,
    pub(crate) from_step: u64,
    pub(crate) extent: Extent,
    /// No block from this one on has slipped in it.
    pub(crate) active: usize,
    /// Up to where nothing has happened in it but what its jump says.
    pub(crate) as_foreseen_until: u64,
}

/// The zone that takes least, and what it does of what the whole chain would.
#[derive(Debug, Clone, Copy)]
struct Best {
    of: Extent,
    share: f64,
}

/// How far a zone goes, in steps and blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Extent {
    pub(crate) steps: u64,
    /// Blocks from here on end the zone if they switch.
    pub(crate) calm_from: usize,
    /// Blocks from here on are those of the chain that sticks.
    pub(crate) cut: usize,
    /// Blocks from here on are not stepped.
    pub(crate) end: usize,
}

impl<S: Solver> Zones<S> {
    /// `None` for chains in which none is opened.
    pub(crate) fn of(plan: &Plan, sweeps: Sweeps) -> Option<Zones<S>> {
        let recording = &plan.recording;
        let may = !recording.energies
            && plan.blocks >= SHORTEST_CHAIN
            && plan.friction.law == Law::Springs
            && plan.friction.ageing.is_none()
            && plan.load_course.is_constant()
            && plan.drive.only_side().is_some()
            && recording.windows.is_empty()
            && recording.rupture_fields.is_none();
        let reaches = if may { reaches(plan, sweeps) } else { Vec::new() };
        let goes_on = plan.blocks >= SHORTEST_GOING_ON && plan.drive.until_load_ratio.is_none();
        let first_blocks = goes_on.then(|| first_blocks(plan, FIRST_BLOCKS, FIRST_BLOCKS));
        (!reaches.is_empty()).then_some(Zones { reaches, first_blocks, in_a_row: 0, open: None })
    }

    /// With so many of the first blocks a jump may go on.
    pub(crate) fn first_blocks(&self) -> usize {
        self.first_blocks.as_ref().map_or(0, |plan| plan.blocks)
    }

    pub(crate) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// The last step that was taken, in the zone that is open.
    pub(crate) fn step(&self) -> Option<u64> {
        self.open.as_ref().map(|zone| zone.first.step())
    }

    /// What the steps in it were made of.
    pub(crate) fn counters(&self) -> Counters {
        self.open.as_ref().map_or_else(Counters::default, |zone| zone.first.counters())
    }

    /// Forgets what is open, at a state to go on from.
    pub(crate) fn restart(&mut self) {
        (self.in_a_row, self.open) = (0, None);
    }

    /// The next zone, if one is worth it: that which takes least for its steps.
    pub(crate) fn next(&self, plan: &Plan, state: &ChainState, waves_steps: u64) -> Option<(usize, Extent)> {
        let active = state.slip.iter().rposition(|&slip| slip != 0.0)? + 1;
        if state.step < state.no_jump_before_step || state.energy.is_some() || state.whole_until_switch {
            return None;
        }
        let extent = self.best(plan, [active, usize::MAX], state.step, waves_steps)?;
        (extent.share <= MOST_SHARE).then_some((active, extent.of))
    }

    /// The next behind a jump that goes on, in which blocks before `active` slide.
    pub(crate) fn next_going_on(
        &self,
        plan: &Plan,
        active: usize,
        state: &ChainState,
        step: u64,
        waves_steps: u64,
    ) -> Option<Extent> {
        if self.must_rest() || state.whole_until_switch {
            return None;
        }
        self.best(plan, [active, self.first_blocks()], step, waves_steps).map(|best| best.of)
    }

    /// That which takes least for its steps, of at most so many blocks.
    fn best(&self, plan: &Plan, [active, furthest]: [usize; 2], step: u64, waves_steps: u64) -> Option<Best> {
        let to_end = plan.steps - step;
        let opening_steps = TIMES_WAVES * waves_steps as f64 / SHARE_OF_WINDOWS;
        let extents = self.reaches.iter().map(|&(steps, reach)| {
            let steps = steps.min(to_end);
            let calm_from = (active + reach / 4 + GRANULE / 2).next_multiple_of(GRANULE);
            let (cut, end) = (calm_from + reach, calm_from + 2 * reach);
            let share = end as f64 / plan.blocks as f64 + opening_steps / steps as f64;
            Best { of: Extent { steps, calm_from, cut, end }, share }
        });
        extents.filter(|best| best.of.end <= furthest).min_by(|a, b| a.share.total_cmp(&b.share))
    }

    /// The plan of the first blocks as a chain of their own, of which those behind `cut` never switch.
    pub(crate) fn plan_of(&self, plan: &Plan, extent: Extent) -> Plan {
        let of = self.first_blocks.as_ref().filter(|first| extent.end <= first.blocks).unwrap_or(plan);
        first_blocks(of, extent.cut, extent.end)
    }

    /// Whether so many have followed each other that the whole chain is to go on up to its next switch.
    pub(crate) fn must_rest(&self) -> bool {
        self.in_a_row >= MOST_IN_A_ROW
    }
}

impl<S> Zone<S> {
    /// A state of all blocks, from one of the first blocks and one of the chain that sticks; `anchors_m`
    /// are those of all blocks where the zone began.
    pub(crate) fn whole(&self, first: FieldRecord, rest: &ChainState, anchors_m: &[f64]) -> FieldRecord {
        let join = |mut first: Vec<f64>, rest: &[f64]| {
            first.truncate(self.extent.cut);
            first.extend_from_slice(&rest[self.extent.cut..]);
            first
        };
        let mut detached = first.detached;
        detached.truncate(self.extent.cut);
        detached.resize(anchors_m.len(), 0);
        FieldRecord {
            displacement_m: join(first.displacement_m, &rest.displacement_m),
            velocity_m_per_s: join(first.velocity_m_per_s, &rest.velocity_m_per_s),
            tangential_force_n: join(first.tangential_force_n, &rest.tangential_force_n),
            stick_position_m: join(first.stick_position_m, anchors_m),
            detached,
            ..first
        }
    }

    /// Brings the state in which the zone began to where it ends.
    pub(crate) fn join(&self, first: &ChainState, rest: &ChainState, state: &mut ChainState) {
        let cut = self.extent.cut;
        let join = |to: &mut [f64], first: &[f64], rest: &[f64]| {
            to[..cut].copy_from_slice(&first[..cut]);
            to[cut..].copy_from_slice(&rest[cut..]);
        };
        join(&mut state.displacement_m, &first.displacement_m, &rest.displacement_m);
        join(&mut state.velocity_m_per_s, &first.velocity_m_per_s, &rest.velocity_m_per_s);
        join(&mut state.tangential_force_n, &first.tangential_force_n, &rest.tangential_force_n);
        // Of the others, which stick, these stay.
        state.stick_position_m[..cut].copy_from_slice(&first.stick_position_m[..cut]);
        state.slip[..cut].copy_from_slice(&first.slip[..cut]);
        state.step = first.step;
        (state.detached, state.sliding) = (first.detached, first.sliding);
        (state.hold_step, state.saved_steps) = (first.hold_step, first.saved_steps);
        state.single_steps = 0;
    }
}

/// Makes a chain stick for ever: from `calm_from` on with its state and anchors, before it at rest under
/// the forces of now.
pub(crate) fn stick(plan: &Plan, state: &mut ChainState, jump: &Jump, calm_from: usize) {
    state.slip.fill(0.0);
    (state.detached, state.sliding) = (0, 0);
    let steady = jump.steady_velocity_m_per_s(state);
    // From rest to what the blocks do, over some blocks.
    let fades_from = calm_from - GRANULE / 2;
    for (n, (velocity, steady)) in state.velocity_m_per_s.iter_mut().zip(steady).enumerate().take(calm_from) {
        let share = match n.checked_sub(fades_from) {
            None => 0.0,
            Some(into) => into as f64 / (calm_from - fades_from) as f64,
        };
        *velocity = steady + share * (*velocity - steady);
    }
    let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    for (n, anchor_m) in state.stick_position_m[..calm_from].iter_mut().enumerate() {
        let mut force_n = plan.elastic.pull_n(&state.displacement_m, steady, n);
        for spring in plan.drive.springs.iter().filter(|spring| spring.block == n) {
            force_n += spring.force_n(point_m, state.displacement_m[n]);
        }
        force_n += plan.prestress_n.get(n).unwrap_or(&0.0);
        *anchor_m = state.displacement_m[n] - force_n / kt;
    }
}

/// The state of so many first blocks.
pub(crate) fn first_of_state(state: &ChainState, end: usize) -> ChainState {
    let first = |values: &[f64]| values[..end].to_vec();
    ChainState {
        displacement_m: first(&state.displacement_m),
        velocity_m_per_s: first(&state.velocity_m_per_s),
        stick_position_m: first(&state.stick_position_m),
        slip: first(&state.slip),
        tangential_force_n: first(&state.tangential_force_n),
        normal_load_n: Vec::new(),
        stuck_since_step: Vec::new(),
        aged_threshold_n: Vec::new(),
        ..*state
    }
}

/// The plan of the blocks before `end` as a chain of their own, of which those behind `cut` never switch.
fn first_blocks(plan: &Plan, cut: usize, end: usize) -> Plan {
    let mut part = plan.clone();
    part.blocks = end;
    let Elastic::Chain(chain) = &mut part.elastic else { panic!("a slab has no zones") };
    chain.nodes = end;
    let friction = &mut part.friction;
    let initial = &mut part.initial;
    for values in [
        &mut friction.static_coefficients,
        &mut friction.dynamic_coefficients,
        &mut friction.static_threshold_n,
        &mut friction.dynamic_friction_n,
        &mut part.normal_load_n,
        &mut part.prestress_n,
        &mut initial.displacement_m,
        &mut initial.velocity_m_per_s,
        &mut initial.stick_position_m,
    ] {
        values.truncate(end);
    }
    part.friction.static_threshold_n[cut..].fill(NEVER_N);
    part
}

/// Steps, and how far in blocks anything is felt after them, as far as that is not too far.
fn reaches(plan: &Plan, sweeps: Sweeps) -> Vec<(u64, usize)> {
    let chain = plan.elastic.chain();
    let (dt, dt_over_m) = (plan.grid.step_s(), plan.grid.step_s() / plan.block_mass_kg);
    let zeros = || vec![0.0f64; FURTHEST + 2];
    // Ways in a step, of a unit velocity's way; up to where all is as good as at rest.
    let mut impulse = Impulse {
        spring: dt * dt_over_m * chain.stiffness_n_per_m,
        damper: dt_over_m * chain.damping_kg_per_s,
        held: dt * dt_over_m * plan.friction.interfacial_stiffness_n_per_m,
        u: zeros(),
        way: zeros(),
        most: zeros(),
        next: zeros(),
    };
    impulse.way[0] = 1.0;
    let (mut found, mut step, mut front) = (Vec::new(), 0, 1);
    let is_short = plan.blocks < SHORTEST_GOING_ON;
    for steps in STEPS.into_iter().take_while(|steps| !is_short || *steps <= MOST_STEPS_OF_SHORT) {
        while step < steps {
            sweeps.push_on(&mut impulse, front);
            if front < FURTHEST && impulse.most[front] > AT_REST {
                front += 1;
            }
            step += 1;
        }
        let unit = (impulse.spring + impulse.damper) * steps as f64;
        match impulse.most[..=FURTHEST].iter().rposition(|most| unit * most > UNFELT) {
            Some(reach) if reach < FURTHEST - 1 => found.push((steps, reach + 1)),
            _ => break,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::{NEVER_N, first_blocks, reaches};
    use crate::energy::Bookkeeping;
    use crate::state::ChainState;
    use crate::stepper::Stepper;
    use crate::sweep::Sweeps;

    /// The chain and its first blocks alone, both ringing without pattern: how far they are apart after
    /// so many steps, over the largest displacement, at the reach from the end and at half of that.
    fn apart(plan: &Plan, steps: u64, reach: usize) -> [f64; 2] {
        let mut whole = plan.clone();
        whole.friction.static_threshold_n.fill(NEVER_N);
        let end = 2 * reach + 10;
        let part = first_blocks(&whole, reach + 10, end);
        let mut state = ChainState::initial(&whole);
        for n in 0..whole.blocks {
            let pattern = ((n * n * 7919) % 101) as f64 / 101.0;
            state.displacement_m[n] = 1e-6 * pattern;
            state.velocity_m_per_s[n] = 1e-2 * pattern;
        }
        let run = |plan: Plan| {
            let mut stepper = Stepper::new(Arc::new(plan), Sweeps::detect(), Bookkeeping::EveryStep);
            let mut start = state.clone();
            for values in [&mut start.displacement_m, &mut start.velocity_m_per_s] {
                values.truncate(stepper.state().slip.len());
            }
            for values in [&mut start.stick_position_m, &mut start.slip, &mut start.tangential_force_n] {
                values.truncate(stepper.state().slip.len());
            }
            stepper.restore(&start);
            // The largest difference on the way counts, not only that at the end.
            let mut ways = Vec::new();
            for _ in 0..steps {
                stepper.take_step();
                ways.push([reach + 9, end - reach / 2].map(|n| stepper.state().displacement_m[n]));
            }
            ways
        };
        let (all, first) = (run(whole), run(part));
        [0, 1].map(|place| {
            let off = all.iter().zip(&first).map(|(a, b)| (a[place] - b[place]).abs());
            off.fold(0.0, f64::max) / all.iter().map(|a| a[place].abs()).fold(0.0, f64::max)
        })
    }

    #[test]
    fn what_lies_behind_the_end_is_not_felt_one_reach_before_it() {
        for set in [
            &["parameter_set=as-coded"][..],
            &["parameter_set=as-stated"],
            &["parameter_set=as-stated", "slider.relative_damping=0"],
            &["parameter_set=as-coded", "friction.interfacial_stiffness_ratio=0.01"],
        ] {
            let source = ScenarioSource::new("test", "slider.blocks = 1200\ntime.step_s = 2e-9");
            let source = set.iter().fold(source, |source, value| source.with_override(value));
            let plan = Plan::new(&Scenario::resolve(&source).unwrap());
            let reaches = reaches(&plan, Sweeps::detect());
            assert!(reaches.len() > 2 && reaches.is_sorted(), "{set:?}: {reaches:?}");
            for (steps, reach) in reaches.into_iter().take(3) {
                let [at_reach, at_half] = apart(&plan, steps, reach);
                assert!(at_reach <= f64::EPSILON, "{set:?}, {steps} steps: {at_reach}");
                assert!(at_half > 1e-13, "{set:?}, {steps} steps: no shorter reach would do: {at_half}");
            }
        }
    }
}
