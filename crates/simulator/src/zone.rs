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
//! **What it needs.** No record but states of all blocks may need the blocks behind the zone: one is
//! opened only in runs without energies, without dense windows and without the states of ruptures.
//! States of all blocks are put together from both parts.

use asperity_model::{Elastic, Law, Plan};
use asperity_record::FieldRecord;

use crate::counters::Counters;
use crate::jump::Jump;
use crate::solver::Solver;
use crate::state::ChainState;

/// Shorter chains are stepped whole.
const SHORTEST_CHAIN: usize = 512;

/// Reaches are known for so many steps.
const STEPS: [u64; 6] = [256, 512, 1024, 2048, 4096, 8192];

/// No reach is further.
const FURTHEST: usize = 512;

/// What is not felt, over the way that it came from.
const UNFELT: f64 = 1.0 / (1u64 << 60) as f64;

/// What is not followed any further.
const AT_REST: f64 = 1e-40;

/// Lengths of zones are multiples of this.
const GRANULE: usize = 64;

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

/// So many zones follow each other at once. From inside of one no run can be gone on with: behind them
/// comes a switch of the whole chain.
const MOST_IN_A_ROW: u32 = 16;

/// A threshold that is never reached.
const NEVER_N: f64 = 1e30;

/// What zones of a chain have in common; `S` steps their blocks.
#[derive(Debug, Clone)]
pub(crate) struct Zones<S> {
    /// Steps, and how far they are felt, ascending.
    reaches: Vec<(u64, usize)>,
    /// How many have followed each other at once.
    pub(crate) in_a_row: u32,
    pub(crate) open: Option<Zone<S>>,
}

/// A zone that is open.
#[derive(Debug, Clone)]
pub(crate) struct Zone<S> {
    /// Steps the first blocks.
    pub(crate) first: Box<S>,
    /// The chain that sticks, where the zone begins.
    pub(crate) stuck: ChainState,
    pub(crate) extent: Extent,
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
    pub(crate) fn of(plan: &Plan) -> Option<Zones<S>> {
        let recording = &plan.recording;
        let may = !recording.energies
            && plan.blocks >= SHORTEST_CHAIN
            && plan.friction.law == Law::Springs
            && plan.friction.ageing.is_none()
            && plan.load_course.is_constant()
            && plan.drive.only_side().is_some()
            && recording.windows.is_empty()
            && recording.rupture_fields.is_none();
        let reaches = if may { reaches(plan) } else { Vec::new() };
        (!reaches.is_empty()).then_some(Zones { reaches, in_a_row: 0, open: None })
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
    pub(crate) fn next(&self, plan: &Plan, state: &ChainState, waves_steps: u64) -> Option<Extent> {
        let active = state.slip.iter().rposition(|&slip| slip != 0.0)? + 1;
        if state.step < state.no_jump_before_step || state.energy.is_some() {
            return None;
        }
        let to_end = plan.steps - state.step;
        let extents = self.reaches.iter().map(|&(steps, reach)| {
            let calm_from = (active + reach / 4 + GRANULE / 2).next_multiple_of(GRANULE);
            let (cut, end) = (calm_from + reach, calm_from + 2 * reach);
            Extent { steps: steps.min(to_end), calm_from, cut, end }
        });
        let share = |extent: &Extent| {
            extent.end as f64 / plan.blocks as f64
                + TIMES_WAVES * waves_steps as f64 / (SHARE_OF_WINDOWS * extent.steps as f64)
        };
        let best = extents.min_by(|a, b| share(a).total_cmp(&share(b)))?;
        (share(&best) <= MOST_SHARE).then_some(best)
    }

    /// Whether so many have followed each other that the whole chain is to go on up to its next switch.
    pub(crate) fn must_rest(&self) -> bool {
        self.in_a_row >= MOST_IN_A_ROW
    }

    /// The zone that is open has ended.
    pub(crate) fn take(&mut self) -> Option<Zone<S>> {
        self.in_a_row += 1;
        self.open.take()
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

/// The chain in which every block sticks for ever: behind the zone with the state and the anchors of
/// the blocks there, before it at rest under the forces of now.
pub(crate) fn stuck_chain(plan: &Plan, state: &ChainState, jump: &Jump, extent: Extent) -> ChainState {
    let mut stuck = state.clone();
    stuck.slip.fill(0.0);
    (stuck.detached, stuck.sliding) = (0, 0);
    let steady = jump.steady_velocity_m_per_s(state);
    let Extent { calm_from, .. } = extent;
    // From rest to what the blocks do, over some blocks.
    let fades_from = calm_from - GRANULE / 2;
    for (n, (velocity, steady)) in stuck.velocity_m_per_s.iter_mut().zip(steady).enumerate().take(calm_from) {
        let share = match n.checked_sub(fades_from) {
            None => 0.0,
            Some(into) => into as f64 / (calm_from - fades_from) as f64,
        };
        *velocity = steady + share * (*velocity - steady);
    }
    let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    for (n, anchor_m) in stuck.stick_position_m[..calm_from].iter_mut().enumerate() {
        let mut force_n = plan.elastic.pull_n(&state.displacement_m, steady, n);
        for spring in plan.drive.springs.iter().filter(|spring| spring.block == n) {
            force_n += spring.force_n(point_m, state.displacement_m[n]);
        }
        force_n += plan.prestress_n.get(n).unwrap_or(&0.0);
        *anchor_m = state.displacement_m[n] - force_n / kt;
    }
    stuck
}

/// The state of the first blocks.
pub(crate) fn first_of_state(state: &ChainState, extent: Extent) -> ChainState {
    let mut first = state.clone();
    for values in [
        &mut first.displacement_m,
        &mut first.velocity_m_per_s,
        &mut first.stick_position_m,
        &mut first.slip,
        &mut first.tangential_force_n,
    ] {
        values.truncate(extent.end);
    }
    first
}

/// The plan of the first blocks as a chain of their own, of which those behind `cut` never switch.
pub(crate) fn first_blocks(plan: &Plan, extent: Extent) -> Plan {
    let mut part = plan.clone();
    let Extent { cut, end, .. } = extent;
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
fn reaches(plan: &Plan) -> Vec<(u64, usize)> {
    let chain = plan.elastic.chain();
    let (dt, dt_over_m) = (plan.grid.step_s(), plan.grid.step_s() / plan.block_mass_kg);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    // From the middle of a chain, which mirrors the other half, up to where all is as good as at rest.
    // Ways in a step, of a unit velocity's way.
    let zeros = || vec![0.0f64; FURTHEST + 2];
    let (mut u, mut way, mut next, mut most) = (zeros(), zeros(), zeros(), zeros());
    way[0] = 1.0;
    let (spring, damper, held) =
        (dt * dt_over_m * chain.stiffness_n_per_m, dt_over_m * chain.damping_kg_per_s, dt * dt_over_m * kt);
    let (mut found, mut step, mut front) = (Vec::new(), 0, 1);
    for steps in STEPS {
        while step < steps {
            let bend = |x: &[f64], n: usize| (x[n - 1] - x[n]) + (x[n + 1] - x[n]);
            next[0] = way[0] + 2.0 * (spring * (u[1] - u[0]) + damper * (way[1] - way[0])) - held * u[0];
            for n in 1..=front {
                next[n] = way[n] + spring * bend(&u, n) + damper * bend(&way, n) - held * u[n];
            }
            std::mem::swap(&mut way, &mut next);
            for n in 0..=front {
                u[n] += way[n];
                most[n] = most[n].max(u[n].abs()).max(way[n].abs());
            }
            if front < FURTHEST && most[front] > AT_REST {
                front += 1;
            }
            step += 1;
        }
        let unit = (spring + damper) * steps as f64;
        match most[..=FURTHEST].iter().rposition(|most| unit * most > UNFELT) {
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

    use super::{Extent, NEVER_N, first_blocks, reaches};
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
        let part = first_blocks(&whole, Extent { steps, calm_from: 10, cut: reach + 10, end });
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
            let reaches = reaches(&plan);
            assert!(reaches.len() > 2 && reaches.is_sorted(), "{set:?}: {reaches:?}");
            for (steps, reach) in reaches.into_iter().take(3) {
                let [at_reach, at_half] = apart(&plan, steps, reach);
                assert!(at_reach <= f64::EPSILON, "{set:?}, {steps} steps: {at_reach}");
                assert!(at_half > 1e-13, "{set:?}, {steps} steps: no shorter reach would do: {at_half}");
            }
        }
    }
}
