//! Jumps of a chain.
//!
//! The modes are those of the map of a step ([`crate::modes`]), all of them. The certificate keeps a
//! reserve for the part of the rest that they may not span.
//!
//! Clamped and absorbing ends add to `M` and `C` at the end blocks, and to the forces where a spring is relaxed elsewhere
//! than at 0. What absorbing ends radiate is a sum over pairs of modes ([`Modes::products`]). There are no modes where the
//! ends are joined, and no waves of long chains whose ends are not free.
//!
//! Chains too long for stored modes are decomposed into waves ([`crate::modes::standing_waves`]), which are not
//! stored. There, recomposing the waves shows what they miss; if that is more than rounding, the jump is
//! refused.

use std::sync::Arc;

use asperity_model::body::chain::Stiffness;
use asperity_model::body::elastic::Chain;
use asperity_model::{Plan, SliderState};

use crate::energy::Radiated;
use crate::kernels;
use crate::leap::cost::{self, Costs, LONG_CHAIN};
use crate::leap::jump::{Attempt, Forced, Jump, Limits, Stuck};
use crate::leap::norms::invariant;
use crate::modes::standing_waves::{DEFECT_PER_BLOCK, StandingWaves};
use crate::modes::{Grown, Modes, operator_cache};
use crate::records::stop::Stop;

/// Below this many steps windows are cheaper than a jump with stored modes.
const SHORTEST: u64 = 10_000;

/// As [`SHORTEST`], for jumps with waves.
const SHORTEST_WITH_WAVES: u64 = 1_500;

/// Steps after which it may be worth trying again where a jump with stored modes was refused, and
/// where the quasi-static part alone refused one with waves.
const PATIENCE_STEPS: u64 = SHORTEST / 16;
const PATIENCE_WITH_WAVES_STEPS: u64 = 100;

/// Allowance for what waves miss besides their defect: rounding errors of the state.
const MISSED_OF_STATE: f64 = 4.0 * f64::EPSILON;

/// The stuck chain, with all of its modes, stored or as waves.
#[derive(Debug)]
struct StuckChain<M> {
    chain: Chain,
    stiffness: Stiffness,
    modes: M,
    grown: Grown,
    /// Cost of projecting a state onto the modes.
    modes_steps: u64,
}

/// Whether the run is long enough for the modes to be worth computing; never for a law without friction
/// springs, where nothing vibrates while all blocks are stuck.
pub(crate) fn may_pay(plan: &Plan) -> bool {
    !plan.friction.law.holds() && Costs::of(plan).all_modes_pay(plan.steps)
}

/// The jumps of a chain; `None` if its modes do not span all states.
pub(crate) fn jump(plan: &Plan, chain: &Chain) -> Option<Jump<1>> {
    let mut limits = Limits {
        shortest_steps: SHORTEST,
        refused_steps: PATIENCE_STEPS,
        forced_steps: cost::QUASI_STATIC_STEPS,
        composed_steps: Costs::of(plan).modes_steps(),
        solves_in_sweeps: true,
    };
    if plan.blocks > LONG_CHAIN {
        limits.shortest_steps = SHORTEST_WITH_WAVES;
        limits.refused_steps = PATIENCE_WITH_WAVES_STEPS;
        return Some(StuckChain::jump(plan, chain, StandingWaves::of(plan, chain)?, limits));
    }
    let modes = operator_cache::HERE.modes(plan, chain)?;
    if Radiated::of(plan, chain) == Radiated::Apart && plan.end_bonds.iter().any(|bond| bond.radiates) {
        let products_steps = cost::products_steps(plan.blocks as u64);
        limits.shortest_steps = SHORTEST.max(8 * products_steps);
        limits.composed_steps += products_steps;
    }
    Some(StuckChain::jump(plan, chain, modes, limits))
}

impl<M: 'static> StuckChain<M>
where
    StuckChain<M>: Stuck<1>,
{
    fn jump(plan: &Plan, chain: &Chain, modes: M, limits: Limits) -> Jump<1> {
        let stuck = StuckChain {
            chain: *chain,
            stiffness: Stiffness::of(plan, chain),
            modes,
            grown: Grown::default(),
            modes_steps: limits.composed_steps,
        };
        Jump::of(plan, Box::new(stuck), limits)
    }

    /// The norm of a motion, which bounds what it adds to the driving forces.
    fn norm(&self, Attempt { certificate, norms, motion, .. }: &mut Attempt<'_, 1>) -> f64 {
        let plan = certificate.plan;
        let (u, v) = motion.split_at(plan.blocks);
        let dt = plan.grid.step_s();
        let w: Vec<f64> = v.iter().map(|v| dt * v).collect();
        let mut held_n_per_m = plan.drive.stiffness_n_per_m(plan.blocks);
        held_n_per_m.iter_mut().zip(&plan.friction.springs_n_per_m).for_each(|(held, kt)| *held += kt);
        let (mut springs, mut damped) = (vec![0.0; plan.blocks], vec![0.0; plan.blocks]);
        kernels::lattice_springs(&mut springs, u, &plan.elastic);
        kernels::lattice_dashpots(&mut damped, &w, &plan.elastic);
        let mut stiff: Vec<f64> = (0..plan.blocks).map(|n| held_n_per_m[n] * u[n] - springs[n]).collect();
        for bond in &plan.end_bonds {
            bond.add(bond.stiffness_n_per_m * bond.stretch(u), &mut stiff);
            bond.add(-bond.damping_kg_per_s * bond.stretch(&w), &mut damped);
        }
        damped.iter_mut().for_each(|damped| *damped = -*damped);
        let norm = invariant((plan.block_mass_kg, dt), [u, &w], [&stiff, &damped]).sqrt();
        certificate.swing.drive_n = norms.drive * norm;
        norm
    }
}

impl Stuck<1> for StuckChain<Arc<Modes>> {
    fn solve(&self, force: &mut [f64], _: &Stop<'_>) -> bool {
        self.stiffness.solve(force);
        true
    }

    fn project(&mut self, attempt: &mut Attempt<'_, 1>) -> Result<f64, u64> {
        attempt.cost_steps = self.modes_steps;
        self.grown.begin(self.modes.project(attempt.motion));
        self.modes.bound(&self.grown.start, &mut attempt.certificate.swing.force_n);
        Ok(self.modes.missed() * self.norm(attempt))
    }

    fn compose(&mut self, into: u64, least: f64, motion: &mut [f64]) {
        let at = self.grown.at(&self.modes.powers, into, least > f64::NEG_INFINITY);
        self.modes.compose(&at, least, motion);
    }

    /// What absorbing ends radiate, unless it follows from the balance: where nothing else is lost.
    fn add_energies(
        &self,
        plan: &Plan,
        forced: &Forced,
        [from, to]: [&[f64]; 2],
        _: f64,
        state: &mut SliderState,
    ) {
        if Radiated::of(plan, &self.chain) != Radiated::Apart {
            return;
        }
        let (steps, dt) = (state.step - forced.from_step, plan.grid.step_s());
        let growth = self.modes.powers.growth(steps);
        for bond in plan.end_bonds.iter().filter(|bond| bond.radiates) {
            let n = bond.block;
            let steady = forced.velocity_m_per_s(n);
            // Of the velocities before each step, and after it.
            let sums = 2.0 * (to[n] - from[n]) / dt + (from[plan.blocks + n] - to[plan.blocks + n]);
            let products = self.modes.products(&self.grown.start, &growth, n);
            let squares = steady * (steps as f64 * steady + sums) + products;
            state.energy.radiated_j.add(bond.damping_kg_per_s * dt * squares);
        }
    }
}

impl Stuck<1> for StuckChain<StandingWaves> {
    fn solve(&self, force: &mut [f64], _: &Stop<'_>) -> bool {
        self.stiffness.solve(force);
        true
    }

    fn project(&mut self, attempt: &mut Attempt<'_, 1>) -> Result<f64, u64> {
        let Attempt { certificate, motion, scales, .. } = attempt;
        let blocks = certificate.plan.blocks;
        attempt.cost_steps = self.modes_steps;
        self.grown.begin(self.modes.project(motion));
        let mut is_calm = |[of_first, of_others]: [f64; 2]| {
            certificate.swing.force_n.fill(of_others);
            certificate.swing.force_n[0] = of_first;
            certificate.at_once() >= SHORTEST_WITH_WAVES
        };
        if !is_calm(self.modes.bound(&self.grown.start)) {
            let (steps, asked) = self.modes.calm_after(&self.grown.start, is_calm);
            attempt.cost_steps += cost::CALM_STEPS * asked;
            return Err(steps);
        }
        let mut composed = vec![0.0; motion.len()];
        self.modes.compose(&self.grown.start, f64::NEG_INFINITY, &mut composed);
        attempt.cost_steps += self.modes_steps;
        let mut missed = [0.0f64; 2];
        for (n, (composed, exact)) in composed.iter().zip(*motion).enumerate() {
            let most = &mut missed[n / blocks];
            *most = most.max((composed - exact).abs());
        }
        let defect = DEFECT_PER_BLOCK * blocks as f64;
        let are_there =
            missed.iter().zip(scales).zip(motion.chunks(blocks)).all(|((missed, scale), motion)| {
                *missed <= MISSED_OF_STATE * *scale + defect * kernels::largest(motion)
            });
        if !are_there {
            return Err(PATIENCE_WITH_WAVES_STEPS);
        }
        self.norm(attempt);
        Ok(attempt.norms.at_most(blocks, missed[0], missed[1]))
    }

    fn compose(&mut self, into: u64, least: f64, motion: &mut [f64]) {
        let at = self.grown.at(&self.modes.powers, into, least > f64::NEG_INFINITY);
        self.modes.compose(&at, least, motion);
    }
}
