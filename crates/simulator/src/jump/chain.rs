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
//! Chains too long for stored modes are decomposed into waves ([`crate::standing_waves`]), which are not
//! stored. There, recomposing the waves shows what they miss; if that is more than rounding, the jump is
//! refused.

use asperity_model::Plan;
use asperity_model::chain::{SteadyLoading, Stiffness};
use asperity_model::elastic::Chain;

use crate::clearance::Clearance;
use crate::cost::{self, Costs, LONG_CHAIN};
use crate::energy::{Accounts, Radiated};
use crate::jump::Forced;
use crate::kernels::Simd;
use crate::modes::{Coordinates, Modes};
use crate::norms::{Norms, ROUNDING, invariant_of_chain};
use crate::operator_cache::OperatorCache;
use crate::standing_waves::{DEFECT_PER_BLOCK, StandingWaves};
use crate::state::SliderState;
use crate::strength::least_threshold_n;

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

/// Workspace for decomposing the residue.
#[derive(Debug, Clone)]
enum Basis {
    Stored(Modes),
    Waves(Box<StandingWaves>),
}

impl Basis {
    fn of(plan: &Plan, chain: &Chain, simd: Simd) -> Option<Basis> {
        if plan.blocks <= LONG_CHAIN {
            OperatorCache::HERE.modes(plan, chain, simd).map(|stored| Basis::Stored(Modes::new(stored)))
        } else {
            StandingWaves::of(plan, chain, simd).map(|waves| Basis::Waves(Box::new(waves)))
        }
    }

    fn growth(&self, steps: u64) -> Coordinates {
        match self {
            Basis::Stored(modes) => modes.growth(steps),
            Basis::Waves(waves) => waves.growth(steps),
        }
    }
}

/// The stuck chain's modes, and the quasi-static state and residue of one jump.
#[derive(Debug, Clone)]
pub(crate) struct Jump {
    chain: Chain,
    simd: Simd,
    norms: Norms,
    basis: Basis,
    stiffness: Stiffness,
    spring: Vec<f64>,
    /// `b` and `v_q` for the way of the drive point in a step for which they were last computed, m.
    loading: SteadyLoading,
    loading_point_m: f64,
    /// The forced part of the jump that is open, the rest, and that in modal coordinates.
    forced: Forced,
    residue: Vec<f64>,
    composed: Vec<f64>,
    coordinates: Coordinates,
    costs: Costs,
    /// Cost of what absorbing ends radiate beside dampers; 0 without.
    products_steps: u64,
    /// Cost of the last attempt, and of landing if a jump is open.
    cost_steps: u64,
    /// How long to wait for the next one, if it was refused.
    patience_steps: u64,
    /// Size below which modes do not affect displacements.
    negligible: f64,
    /// Sum of a residue's displacements over the states on the way.
    ways_m: Vec<f64>,
    /// Coordinates at the last sample, its step, and their growth over the last interval between samples.
    sampled: Coordinates,
    sampled_step: u64,
    cadence: (u64, Coordinates),
    swing: Vec<f64>,
    /// The swing some steps later, from which the next attempt is scheduled.
    calmer_swing: Vec<f64>,
}

impl Jump {
    /// Whether the run is long enough for the modes to be worth computing; never for a law without friction
    /// springs, where nothing vibrates while all blocks are stuck.
    pub(crate) fn may_pay(plan: &Plan) -> bool {
        !plan.friction.law.holds() && Costs::of(plan).all_modes_pay(plan.steps, plan.blocks <= LONG_CHAIN)
    }

    /// `None` for chains whose modes do not span all states.
    pub(crate) fn new(plan: &Plan, chain: &Chain, simd: Simd) -> Option<Jump> {
        let blocks = plan.blocks;
        let basis = Basis::of(plan, chain, simd)?;
        let stiffness = Stiffness::of(plan, chain);
        Some(Jump {
            chain: *chain,
            simd,
            norms: Norms::of(plan),
            cadence: (0, basis.growth(0)),
            basis,
            spring: plan.friction.springs_n_per_m.clone(),
            loading: SteadyLoading::of(plan, &stiffness, 0.0),
            loading_point_m: 0.0,
            forced: Forced::of_nodes(blocks, 1),
            stiffness,
            residue: vec![0.0; 2 * blocks],
            composed: vec![0.0; 2 * blocks],
            coordinates: Coordinates::default(),
            costs: Costs::of(plan),
            products_steps: match Radiated::of(plan, chain) {
                Radiated::Apart if plan.end_bonds.iter().any(|bond| bond.radiates) => {
                    cost::products_steps(blocks as u64)
                }
                _ => 0,
            },
            cost_steps: 0,
            patience_steps: PATIENCE_STEPS,
            negligible: 0.0,
            ways_m: vec![0.0; blocks],
            sampled: Coordinates::default(),
            sampled_step: 0,
            swing: vec![0.0; blocks],
            calmer_swing: Vec::new(),
        })
    }

    /// Below this many steps a jump is not worth it.
    fn shortest_steps(&self) -> u64 {
        match &self.basis {
            Basis::Stored(_) => SHORTEST.max(8 * self.products_steps),
            Basis::Waves(_) => SHORTEST_WITH_WAVES,
        }
    }

    /// Steps after which it may be worth trying again where a jump was refused.
    pub(crate) fn patience_steps(&self) -> u64 {
        self.patience_steps
    }

    /// Cost of the last attempt, including landing if it was certified.
    pub(crate) fn cost_steps(&self) -> u64 {
        self.cost_steps
    }

    /// Of taking a state apart, or of putting it together again.
    pub(crate) fn modes_steps(&self) -> u64 {
        match &self.basis {
            Basis::Stored(_) => self.costs.modes_steps() + self.products_steps,
            Basis::Waves(_) => self.costs.waves_steps(),
        }
    }

    /// Splits a state in which every block is stuck, and gives the largest number
    /// of steps over which none detaches by the certificate, 0 if those are not worth it.
    pub(crate) fn open(&mut self, plan: &Plan, state: &SliderState, most_steps: u64) -> u64 {
        let (blocks, fewest_steps) = (plan.blocks, self.shortest_steps());
        self.cost_steps = cost::QUASI_STATIC_STEPS;
        self.patience_steps = match &self.basis {
            Basis::Stored(_) => PATIENCE_STEPS,
            Basis::Waves(_) => PATIENCE_WITH_WAVES_STEPS,
        };
        if most_steps < fewest_steps {
            return 0;
        }
        let forced = &mut self.forced;
        forced.begin(plan, state);
        let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
        if forced.point_m != self.loading_point_m {
            self.loading = SteadyLoading::of(plan, &self.stiffness, forced.point_m);
            self.loading_point_m = forced.point_m;
        }
        let loading = &self.loading;
        forced.advance_m.copy_from_slice(&loading.advance_m);
        loading.position_m(plan, &self.stiffness, &state.stick_position_m, point_m, &mut forced.position_m);
        // If the quasi-static part alone rules out the jump, the modes need not be computed.
        self.swing.fill(0.0);
        let least = self.certified_steps(plan, state, 0.0);
        if least.min(self.steps_to_stop(plan, 0.0)) < fewest_steps {
            return 0;
        }
        self.cost_steps = self.modes_steps();
        let velocity_m_per_s = &self.loading.velocity_m_per_s;
        let (u, v) = self.residue.split_at_mut(blocks);
        for n in 0..blocks {
            u[n] = state.displacement_m[n] - self.forced.position_m[n];
            v[n] = state.velocity_m_per_s[n] - velocity_m_per_s[n];
        }
        let norm = invariant_of_chain(plan, &self.chain, self.simd, &self.spring, [u, v]).sqrt();
        let simd = self.simd;
        let (u_scale, v_scale) = (simd.largest(&state.displacement_m), simd.largest(&state.velocity_m_per_s));
        let missed = match &mut self.basis {
            Basis::Stored(modes) => {
                modes.project(&self.residue, &mut self.coordinates);
                modes.bound(&self.coordinates, &mut self.swing);
                modes.missed() * norm
            }
            Basis::Waves(waves) => {
                waves.project(&self.residue, &mut self.coordinates);
                waves.bound(&self.coordinates, &mut self.swing);
                if self.certified_steps(plan, state, 0.0) < fewest_steps {
                    self.wait_for_calm(plan, state, fewest_steps);
                    return 0;
                }
                let Basis::Waves(waves) = &mut self.basis else { unreachable!("it is made of waves") };
                waves.compose(&self.coordinates, &mut self.composed);
                self.cost_steps += self.costs.waves_steps();
                let (mut missed_u, mut missed_v) = (0.0f64, 0.0f64);
                for n in 0..blocks {
                    missed_u = missed_u.max((self.composed[n] - self.residue[n]).abs());
                    missed_v = missed_v.max((self.composed[blocks + n] - self.residue[blocks + n]).abs());
                }
                let (u, v) = self.residue.split_at(blocks);
                let defect = DEFECT_PER_BLOCK * blocks as f64;
                let all_there = missed_u <= MISSED_OF_STATE * u_scale + defect * simd.largest(u)
                    && missed_v <= MISSED_OF_STATE * v_scale + defect * simd.largest(v);
                if !all_there {
                    return 0;
                }
                self.norms.at_most(blocks, missed_u, missed_v)
            }
        };
        // Displacements grow on the way.
        let advance_m = simd.largest(&self.forced.advance_m) * most_steps as f64;
        let largest_m = simd.largest(&self.forced.position_m);
        let rounding = self.norms.force_rounding(u_scale.max(largest_m) + advance_m, v_scale);
        self.negligible = NEGLIGIBLE / blocks as f64 * largest_m;
        self.sampled.clone_from(&self.coordinates);
        self.sampled_step = state.step;
        let swing = self.norms.drive * (norm + missed) + rounding * blocks as f64;
        let steps = self
            .certified_steps(plan, state, self.norms.force * missed + rounding)
            .min(self.steps_to_stop(plan, swing))
            .min(most_steps);
        if steps < fewest_steps {
            return 0;
        }
        self.cost_steps += self.modes_steps();
        steps
    }

    /// Foresees after how many steps the waves will have become calm enough for a jump, and has the
    /// next attempt wait for it.
    fn wait_for_calm(&mut self, plan: &Plan, state: &SliderState, fewest_steps: u64) {
        let Basis::Waves(waves) = &self.basis else { return };
        let mut swing = std::mem::take(&mut self.calmer_swing);
        swing.resize(plan.blocks, 0.0);
        let (steps, asked) = waves.calm_after(&self.coordinates, |[of_first, of_others]| {
            swing.fill(of_others);
            swing[0] = of_first;
            self.certified_with(plan, state, 0.0, &swing) >= fewest_steps
        });
        self.calmer_swing = swing;
        self.patience_steps = steps;
        self.cost_steps += cost::CALM_STEPS * asked;
    }

    /// Steps until the quasi-static force and the swing around it reach a threshold.
    fn certified_steps(&self, plan: &Plan, state: &SliderState, reserve: f64) -> u64 {
        self.certified_with(plan, state, reserve, &self.swing)
    }

    fn certified_with(&self, plan: &Plan, state: &SliderState, reserve: f64, swing: &[f64]) -> u64 {
        let (thresholds, ramp) = (least_threshold_n(plan, state), self.forced.ramp);
        let mut clearance = Clearance::ENDLESS;
        for n in 0..plan.blocks {
            let threshold = ramp.load.scaled_n(thresholds[n]);
            let room = threshold - ROUNDING * threshold - reserve - swing[n];
            let ([force], [rate]) = self.forced.friction_n(plan, state, n, 0.0);
            // The threshold may come down to meet the force.
            if !clearance.stays_between(force, rate, room, -ramp.change_n(thresholds[n])) {
                return 0;
            }
        }
        clearance.steps()
    }

    /// Steps until the forced driving force, with its oscillation, reaches the load that stops the drive.
    fn steps_to_stop(&self, plan: &Plan, swing: f64) -> u64 {
        let mut clearance = Clearance::ENDLESS;
        let stays = self.forced.stays_below_stop(plan, 0.0, [swing, 0.0], &mut clearance);
        if stays { clearance.steps() } else { 0 }
    }

    /// Writes displacements and velocities after `into` steps of the jump.
    pub(crate) fn land(&mut self, into: u64, state: &mut SliderState) {
        let mut coordinates = self.coordinates.clone();
        coordinates.grow_by(&self.basis.growth(into));
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
            self.cadence = (steps, self.basis.growth(steps));
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
        for n in 0..blocks {
            self.ways_m[n] =
                plan.elastic.damping_force_n(&velocities, n) - plan.block_mass_kg / dt * (new_v[n] - v[n]);
        }
        for bond in &plan.end_bonds {
            bond.add(-bond.damping_kg_per_s * bond.stretch(&velocities), &mut self.ways_m);
        }
        self.stiffness.solve(&mut self.ways_m);
        // Where nothing else is lost, it follows from the balance.
        if let (Basis::Stored(modes), Radiated::Apart) = (&self.basis, Radiated::of(plan, &self.chain)) {
            let growth = modes.growth(steps);
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
        let (ways_m, count) = (&self.ways_m, steps as f64);
        let sum_m = |n: usize| count * (position_m[n] + 0.5 * (count - 1.0) * advance_m[n]) + ways_m[n];
        accounts.add_drive(plan, state, *from_step, steps, sum_m, |n| position_m[n] + u[n]);
    }

    /// Without modes of at most the size `least`.
    fn compose(&mut self, into: u64, coordinates: &Coordinates, least: f64, state: &mut SliderState) {
        match &mut self.basis {
            Basis::Stored(modes) => modes.compose_above(coordinates, least, &mut self.composed),
            Basis::Waves(waves) => waves.compose_above(coordinates, least, &mut self.composed),
        }
        let (u, v) = self.composed.split_at(state.displacement_m.len());
        let forced_m_per_s = &self.loading.velocity_m_per_s;
        for (n, velocity_m_per_s) in state.velocity_m_per_s.iter_mut().enumerate() {
            *velocity_m_per_s = forced_m_per_s[n] + v[n];
        }
        self.forced.write(into, u, state);
    }
}
