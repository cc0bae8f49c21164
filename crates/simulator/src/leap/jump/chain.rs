//! Jumps of a chain.
//!
//! With `eta L` the damping, `L` the second difference, `K_n` the drive's springs and `X` its point, whose
//! velocity `V` is 0 once it has stopped, the forced part is
//!
//! ```text
//! M a = k_t u_stick + eta L v_q + prestress + sum_n e_n K_n X(s + 1),  M b = sum_n e_n K_n V dt.
//! ```
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

use asperity_model::body::chain::{SteadyLoading, Stiffness};
use asperity_model::body::elastic::Chain;
use asperity_model::{Plan, SliderState};

use crate::energy::{Accounts, Radiated};
use crate::kernels;
use crate::leap::cost::{self, Costs, LONG_CHAIN};
use crate::leap::jump::Forced;
use crate::leap::jump::certificate::{Certificate, Swing};
use crate::leap::norms::{Norms, invariant_of_chain};
use crate::modes::operator_cache;
use crate::modes::standing_waves::{DEFECT_PER_BLOCK, StandingWaves};
use crate::modes::{Coordinates, Modes, Powers};

/// Below this many steps windows are cheaper than a jump with stored modes.
const SHORTEST: u64 = 10_000;

/// As [`SHORTEST`], for jumps with waves.
const SHORTEST_WITH_WAVES: u64 = 1_500;

/// Steps after which it may be worth trying again where a jump with stored modes was refused, and
/// where the quasi-static part alone refused one with waves.
const PATIENCE_STEPS: u64 = SHORTEST / 16;
const PATIENCE_WITH_WAVES_STEPS: u64 = 100;

/// Largest truncation of displacements in samples, relative to the largest one: a rounding error or two.
const NEGLIGIBLE: f64 = 4e-16;

/// Allowance for what waves miss besides their defect: rounding errors of the state.
const MISSED_OF_STATE: f64 = 4.0 * f64::EPSILON;

/// The modes of the stuck chain.
#[derive(Debug)]
enum Basis {
    Stored(Arc<Modes>),
    Waves(Box<StandingWaves>),
}

/// The stuck chain's modes, and the quasi-static state and residue of one jump.
#[derive(Debug)]
pub(crate) struct ChainJump {
    chain: Chain,
    norms: Norms,
    basis: Basis,
    powers: Powers,
    /// Below this many steps a jump is not worth it.
    shortest_steps: u64,
    /// Steps after which it may be worth trying again where a jump was refused.
    refused_steps: u64,
    /// Cost of projecting a state onto the modes, or of composing it from them.
    pub(crate) modes_steps: u64,
    stiffness: Stiffness,
    loading: SteadyLoading,
    /// The forced part of the jump that is open, the rest, and that in modal coordinates.
    forced: Forced,
    residue: Vec<f64>,
    composed: Vec<f64>,
    coordinates: Coordinates,
    /// Cost of the last attempt, and of landing if a jump is open.
    pub(crate) cost_steps: u64,
    /// Size below which modes do not affect displacements.
    negligible: f64,
    /// Coordinates at the last sample, its step, and their growth over the last interval between samples.
    sampled: Coordinates,
    sampled_step: u64,
    cadence: (u64, Coordinates),
    swing: Swing,
}

impl ChainJump {
    /// Whether the run is long enough for the modes to be worth computing; never for a law without friction
    /// springs, where nothing vibrates while all blocks are stuck.
    pub(crate) fn may_pay(plan: &Plan) -> bool {
        !plan.friction.law.holds() && Costs::of(plan).all_modes_pay(plan.steps)
    }

    /// `None` for chains whose modes do not span all states.
    pub(crate) fn new(plan: &Plan, chain: &Chain) -> Option<ChainJump> {
        let (blocks, costs) = (plan.blocks, Costs::of(plan));
        let (basis, powers, [shortest_steps, refused_steps, modes_steps]) = if blocks <= LONG_CHAIN {
            let modes = operator_cache::HERE.modes(plan, chain)?;
            let products_steps = match Radiated::of(plan, chain) {
                Radiated::Apart if plan.end_bonds.iter().any(|bond| bond.radiates) => {
                    cost::products_steps(blocks as u64)
                }
                _ => 0,
            };
            let steps =
                [SHORTEST.max(8 * products_steps), PATIENCE_STEPS, costs.modes_steps() + products_steps];
            let powers = modes.powers.clone();
            (Basis::Stored(modes), powers, steps)
        } else {
            let waves = Box::new(StandingWaves::of(plan, chain)?);
            let steps = [SHORTEST_WITH_WAVES, PATIENCE_WITH_WAVES_STEPS, costs.modes_steps()];
            let powers = waves.powers.clone();
            (Basis::Waves(waves), powers, steps)
        };
        let stiffness = Stiffness::of(plan, chain);
        Some(ChainJump {
            chain: *chain,
            norms: Norms::of(plan),
            cadence: (0, powers.growth(0)),
            basis,
            powers,
            shortest_steps,
            refused_steps,
            modes_steps,
            loading: SteadyLoading::of(plan, &stiffness, 0.0),
            forced: Forced::of_nodes(blocks, 1),
            stiffness,
            residue: vec![0.0; 2 * blocks],
            composed: vec![0.0; 2 * blocks],
            coordinates: Coordinates::default(),
            cost_steps: 0,
            negligible: 0.0,
            sampled: Coordinates::default(),
            sampled_step: 0,
            swing: Swing::none(plan),
        })
    }

    /// Splits a state in which every block is stuck, and gives the largest number
    /// of steps over which none detaches by the certificate; if those are not worth it, the number after which the next
    /// attempt is due.
    pub(crate) fn open(&mut self, plan: &Plan, state: &SliderState, most_steps: u64) -> Result<u64, u64> {
        let (blocks, fewest_steps) = (plan.blocks, self.shortest_steps);
        self.cost_steps = cost::QUASI_STATIC_STEPS;
        let refused = Err(self.refused_steps);
        if most_steps < fewest_steps {
            return refused;
        }
        self.forced.begin(plan, state);
        let outside = plan.outside(state.step + 1, state.hold_step);
        self.loading = SteadyLoading::of(plan, &self.stiffness, self.forced.point_m);
        let ChainJump { forced, loading, residue, swing, .. } = self;
        forced.advance_m.copy_from_slice(&loading.advance_m);
        loading.position_m(plan, &self.stiffness, &state.stick_position_m, outside, &mut forced.position_m);
        let certificate = |reserves| Certificate::<1> {
            plan,
            state,
            lattice: plan.elastic,
            forced,
            parts: &[],
            coefficients: &[],
            reserves,
        };
        // If the quasi-static part alone rules out the jump, the modes need not be computed.
        let bare = certificate([0.0; 3]);
        if bare.of_forced() < fewest_steps {
            return refused;
        }
        self.cost_steps = self.modes_steps;
        let (u, v) = residue.split_at_mut(blocks);
        for n in 0..blocks {
            u[n] = state.displacement_m[n] - forced.position_m[n];
            v[n] = state.velocity_m_per_s[n] - loading.velocity_m_per_s[n];
        }
        let norm = invariant_of_chain(plan, &self.chain, [u, v]).sqrt();
        let scales = [&state.displacement_m, &state.velocity_m_per_s].map(|of| kernels::largest(of));
        let missed = match &mut self.basis {
            Basis::Stored(modes) => {
                self.coordinates = modes.project(residue);
                modes.bound(&self.coordinates, &mut swing.force_n);
                modes.missed() * norm
            }
            Basis::Waves(waves) => {
                self.coordinates = waves.project(residue);
                let bound = waves.bound(&self.coordinates);
                let mut is_calm = |[of_first, of_others]: [f64; 2]| {
                    swing.force_n.fill(of_others);
                    swing.force_n[0] = of_first;
                    bare.certified(0, swing) >= fewest_steps
                };
                if !is_calm(bound) {
                    let (steps, asked) = waves.calm_after(&self.coordinates, is_calm);
                    self.cost_steps += cost::CALM_STEPS * asked;
                    return Err(steps);
                }
                waves.compose(&self.coordinates, f64::NEG_INFINITY, &mut self.composed);
                self.cost_steps += self.modes_steps;
                let mut missed = [0.0f64; 2];
                for (n, (composed, residue)) in self.composed.iter().zip(&*residue).enumerate() {
                    let most = &mut missed[n / blocks];
                    *most = most.max((composed - residue).abs());
                }
                let defect = DEFECT_PER_BLOCK * blocks as f64;
                let are_there = missed.iter().zip(scales).zip(residue.chunks(blocks)).all(
                    |((missed, scale), residue)| {
                        *missed <= MISSED_OF_STATE * scale + defect * kernels::largest(residue)
                    },
                );
                if !are_there {
                    return refused;
                }
                self.norms.at_most(blocks, missed[0], missed[1])
            }
        };
        // Displacements grow on the way.
        let advance_m = kernels::largest(&forced.advance_m) * most_steps as f64;
        let largest_m = kernels::largest(&forced.position_m);
        let rounding = self.norms.force_rounding(scales[0].max(largest_m) + advance_m, scales[1]);
        self.negligible = NEGLIGIBLE / blocks as f64 * largest_m;
        self.sampled.clone_from(&self.coordinates);
        self.sampled_step = state.step;
        let of_drive = self.norms.drive * (norm + missed) + rounding * blocks as f64;
        let reserves = [self.norms.force * missed + rounding, 0.0, of_drive];
        let steps = certificate(reserves).certified(0, swing).min(most_steps);
        if steps < fewest_steps {
            return refused;
        }
        self.cost_steps += self.modes_steps;
        Ok(steps)
    }

    /// Writes displacements and velocities after `into` steps of the jump.
    pub(crate) fn land(&mut self, into: u64, state: &mut SliderState) {
        let mut coordinates = self.coordinates.clone();
        coordinates.grow_by(&self.powers.growth(into));
        self.compose(into, &coordinates, f64::NEG_INFINITY, state);
    }

    /// Writes the state for a sample and leaves the jump open; samples must come in
    /// the order of time.
    pub(crate) fn sample(&mut self, into: u64, state: &mut SliderState) {
        // Only samples advance from one to the next, which rounds differently: the landing of a jump must
        // not depend on the records.
        let target = self.forced.from_step + into;
        let steps = target - self.sampled_step;
        if self.cadence.0 != steps {
            self.cadence = (steps, self.powers.growth(steps));
        }
        self.sampled.grow_by(&self.cadence.1);
        self.sampled_step = target;
        let sampled = std::mem::take(&mut self.sampled);
        self.compose(into, &sampled, self.negligible, state);
        self.sampled = sampled;
    }

    /// Adds to the energies the contributions of the steps up to the present state.
    ///
    /// The residue's displacements sum up by its map, summed over the steps `r -> r'`:
    /// `M sum u = eta L sum v - m / dt (v' - v)`, with `sum v = (u' - u) / dt + v - v'`.
    pub(crate) fn account(&mut self, plan: &Plan, state: &mut SliderState, accounts: &Accounts) {
        let blocks = plan.blocks;
        let Forced { position_m, advance_m, from_step, .. } = &self.forced;
        let steps = state.step - from_step;
        let dt = plan.grid.step_s();
        let (u, v) = self.residue.split_at(blocks);
        let (new_u, new_v) = self.composed.split_at(blocks);
        let velocities: Vec<f64> = (0..blocks).map(|n| (new_u[n] - u[n]) / dt + (v[n] - new_v[n])).collect();
        let own_m = |n: usize| {
            plan.elastic.damping_force_n(&velocities, n) - plan.block_mass_kg / dt * (new_v[n] - v[n])
        };
        let mut sums_m: Vec<f64> = (0..blocks).map(own_m).collect();
        for bond in &plan.end_bonds {
            bond.add(-bond.damping_kg_per_s * bond.stretch(&velocities), &mut sums_m);
        }
        self.stiffness.solve(&mut sums_m);
        // Where nothing else is lost, it follows from the balance.
        if let (Basis::Stored(modes), Radiated::Apart) = (&self.basis, Radiated::of(plan, &self.chain)) {
            let growth = self.powers.growth(steps);
            let forced_m_per_s = &self.loading.velocity_m_per_s;
            for bond in plan.end_bonds.iter().filter(|bond| bond.radiates) {
                let n = bond.block;
                let forced = forced_m_per_s[n];
                // Of the velocities before each step, and after it.
                let sums = 2.0 * (new_u[n] - u[n]) / dt + (v[n] - new_v[n]);
                let products = modes.products(&self.coordinates, &growth, n);
                let squares = forced * (steps as f64 * forced + sums) + products;
                state.energy.radiated_j.add(bond.damping_kg_per_s * dt * squares);
            }
        }
        let count = steps as f64;
        let sum_m = |n: usize| count * (position_m[n] + 0.5 * (count - 1.0) * advance_m[n]) + sums_m[n];
        accounts.add_drive(plan, state, *from_step, steps, sum_m, |n| position_m[n] + u[n]);
    }

    /// Without modes of at most the size `least`.
    fn compose(&mut self, into: u64, coordinates: &Coordinates, least: f64, state: &mut SliderState) {
        match &mut self.basis {
            Basis::Stored(modes) => modes.compose(coordinates, least, &mut self.composed),
            Basis::Waves(waves) => waves.compose(coordinates, least, &mut self.composed),
        }
        let (u, v) = self.composed.split_at(state.displacement_m.len());
        let forced_m_per_s = &self.loading.velocity_m_per_s;
        for (n, velocity_m_per_s) in state.velocity_m_per_s.iter_mut().enumerate() {
            *velocity_m_per_s = forced_m_per_s[n] + v[n];
        }
        self.forced.write(into, u, state);
    }
}
