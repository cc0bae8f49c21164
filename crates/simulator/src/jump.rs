//! Jumps: most of a stick phase at once.
//!
//! While every block is stuck the map of a step is the same for the whole run.
//! Its quasi-static solution advances by the same displacement every step,
//!
//! ```text
//! u_q(s + i) = a + i b,  v_q = b / dt,  M a = k_t u_stick + eta L v_q + e_1 K V t(s + 1),  M b = e_1 K V dt,
//! ```
//!
//! with `M` the stiffness of chain, drive and friction springs and `L` the second
//! difference. What is left, `r = y - y_q`, obeys the homogeneous map, `r(s + i) = A^i r(s)`,
//! which powers of `A` by repeated squaring carry over any number of steps.
//!
//! **Certificate.** The force of the quasi-static part on a block is
//! `k_t (u_q - u_stick)`, linear in time. That of the residue is bounded for all the
//! jump, mode by mode ([`crate::modes`]), with `velocity sqrt(I(r))` as the largest velocity,
//! since no step lets `I` grow ([`crate::window`]). A jump ends before their sum
//! reaches any threshold. Where the modes bound nothing, at critical damping,
//! `force sqrt(I(r))` does.

use asperity_model::Plan;

use crate::modes::Modes;
use crate::state::ChainState;
use crate::sweep::{Pull, Sweeps};
use crate::window::{Norms, invariant};

/// Largest chain that is jumped with: beyond, the powers of `A`, which grow as
/// the square of its size, cost more memory and time than they save.
pub(crate) const LARGEST_CHAIN: usize = 256;

/// Share of a threshold that the certificate keeps in reserve for rounding.
const ROUNDING: f64 = 1e-9;

/// The stuck chain's map, and the quasi-static state and residue of one jump.
#[derive(Debug, Clone)]
pub(crate) struct Jump {
    sweeps: Sweeps,
    norms: Norms,
    modes: Option<Modes>,
    /// `A^(2^p)`, as far as they have been needed; columns one after the other.
    powers: Vec<Vec<f64>>,
    /// `A` to the cadence of samples, once it has been needed.
    cadence: Option<Vec<f64>>,
    cadence_steps: u64,
    spring: Vec<f64>,
    /// `b` and `v_q`.
    advance_m: Vec<f64>,
    velocity_m_per_s: Vec<f64>,
    /// `a` and `r` of the jump that is open.
    position_m: Vec<f64>,
    residue: Vec<f64>,
    from_step: u64,
    /// Residue at the last sample, and where that was.
    sampled: Vec<f64>,
    sampled_step: u64,
    swing: Vec<f64>,
    scratch: Vec<f64>,
}

impl Jump {
    pub(crate) fn new(plan: &Plan, sweeps: Sweeps) -> Jump {
        let blocks = plan.blocks;
        let mut pull = vec![0.0; blocks];
        pull[0] = plan.drive.force_n(plan.grid.step_s(), 0.0);
        let advance_m = solve_stuck(plan, pull);
        let dt = plan.grid.step_s();
        Jump {
            sweeps,
            norms: Norms::of(plan),
            modes: Modes::of(plan, sweeps),
            powers: Vec::new(),
            cadence: None,
            cadence_steps: plan.recording.sample_every_steps,
            spring: vec![plan.friction.interfacial_stiffness_n_per_m; blocks],
            velocity_m_per_s: advance_m.iter().map(|advance| advance / dt).collect(),
            advance_m,
            position_m: vec![0.0; blocks],
            residue: vec![0.0; 2 * blocks],
            from_step: 0,
            sampled: vec![0.0; 2 * blocks],
            sampled_step: 0,
            swing: vec![0.0; blocks],
            scratch: vec![0.0; 2 * blocks],
        }
    }

    /// Splits a state in which every block is stuck, and gives the largest number
    /// of steps over which none detaches by the certificate.
    pub(crate) fn open(&mut self, plan: &Plan, state: &ChainState, most_steps: u64) -> u64 {
        let blocks = plan.blocks;
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let mut pull: Vec<f64> = state.stick_position_m.iter().map(|stick| kt * stick).collect();
        for (n, pull) in pull.iter_mut().enumerate() {
            *pull +=
                plan.damping_kg_per_s * asperity_model::initial::neighbour_pull(&self.velocity_m_per_s, n);
        }
        pull[0] += plan.drive.force_n(plan.grid.time_s(state.step + 1), 0.0);
        self.position_m = solve_stuck(plan, pull);
        let (u, v) = self.residue.split_at_mut(blocks);
        for n in 0..blocks {
            u[n] = state.displacement_m[n] - self.position_m[n];
            v[n] = state.velocity_m_per_s[n] - self.velocity_m_per_s[n];
        }
        let norm = invariant(plan, &self.spring, u, v).sqrt();
        match &mut self.modes {
            Some(modes) => modes.bound(u, v, self.norms.velocity * norm, most_steps, &mut self.swing),
            None => self.swing.fill(self.norms.force * norm),
        }
        let sweeps = self.sweeps;
        let rounding = self
            .norms
            .force_rounding(sweeps.largest(&state.displacement_m), sweeps.largest(&state.velocity_m_per_s));
        self.from_step = state.step;
        self.sampled.copy_from_slice(&self.residue);
        self.sampled_step = state.step;
        (0..blocks)
            .map(|n| {
                let threshold = plan.friction.static_threshold_n[n];
                let room = threshold - ROUNDING * threshold - rounding - self.swing[n];
                let (force, rate) =
                    (kt * (self.position_m[n] - state.stick_position_m[n]), kt * self.advance_m[n]);
                // Written so that what is not a number certifies nothing.
                let stays = force.abs() < room;
                if !stays {
                    return 0;
                }
                let steps = if rate > 0.0 { (room - force) / rate } else { (room + force) / -rate };
                // Casting saturates; without a rate there is no end.
                if rate == 0.0 { u64::MAX } else { steps as u64 }
            })
            .min()
            .map_or(0, |steps| steps.min(most_steps))
    }

    /// Writes displacements and velocities after `into` steps of the jump.
    pub(crate) fn land(&mut self, plan: &Plan, into: u64, state: &mut ChainState) {
        let mut residue = std::mem::take(&mut self.residue);
        self.advance_residue(plan, &mut residue, into);
        self.compose(into, &residue, state);
        self.residue = residue;
    }

    /// The same for a sample, which leaves the jump open; samples must come in
    /// the order of time.
    pub(crate) fn sample(&mut self, plan: &Plan, into: u64, state: &mut ChainState) {
        let mut residue = std::mem::take(&mut self.sampled);
        let target = self.from_step + into;
        let steps = target - self.sampled_step;
        // Only samples go this way, which rounds differently: where a jump lands
        // must not depend on what is recorded.
        if steps == self.cadence_steps && steps > 0 {
            self.advance_by_cadence(plan, &mut residue);
        } else {
            self.advance_residue(plan, &mut residue, steps);
        }
        self.sampled_step = target;
        self.compose(into, &residue, state);
        self.sampled = residue;
    }

    fn compose(&self, into: u64, residue: &[f64], state: &mut ChainState) {
        let blocks = self.position_m.len();
        let (u, v) = residue.split_at(blocks);
        for n in 0..blocks {
            state.displacement_m[n] = self.position_m[n] + into as f64 * self.advance_m[n] + u[n];
            state.velocity_m_per_s[n] = self.velocity_m_per_s[n] + v[n];
        }
        state.step = self.from_step + into;
        state.sliding = 0;
    }

    /// From one sample to the next of their cadence, with one matrix.
    fn advance_by_cadence(&mut self, plan: &Plan, residue: &mut Vec<f64>) {
        if self.cadence.is_none() {
            self.cadence = Some(self.power(plan, self.cadence_steps));
        }
        if let Some(matrix) = &self.cadence {
            self.sweeps.multiply(&mut self.scratch, matrix, residue);
            std::mem::swap(residue, &mut self.scratch);
        }
    }

    fn advance_residue(&mut self, plan: &Plan, residue: &mut Vec<f64>, steps: u64) {
        let mut left = steps;
        let mut p = 0;
        while left > 0 {
            if left & 1 == 1 {
                self.need_power(plan, p);
                self.sweeps.multiply(&mut self.scratch, &self.powers[p], residue);
                std::mem::swap(residue, &mut self.scratch);
            }
            left >>= 1;
            p += 1;
        }
    }

    /// `A^steps` as a matrix of its own.
    fn power(&mut self, plan: &Plan, steps: u64) -> Vec<f64> {
        let mut product: Option<Vec<f64>> = None;
        for p in (0..64).filter(|p| steps >> p & 1 == 1) {
            self.need_power(plan, p);
            product = Some(match product {
                None => self.powers[p].clone(),
                Some(product) => self.product(&self.powers[p], &product),
            });
        }
        product.expect("a cadence is at least one step")
    }

    fn need_power(&mut self, plan: &Plan, p: usize) {
        if self.powers.is_empty() {
            self.powers.push(self.one_step(plan));
        }
        while self.powers.len() <= p {
            let last = self.powers.last().expect("there is the first power");
            let square = self.product(last, last);
            self.powers.push(square);
        }
    }

    fn product(&self, left: &[f64], right: &[f64]) -> Vec<f64> {
        let size = self.scratch.len();
        let mut product = vec![0.0; size * size];
        for (to, from) in product.chunks_exact_mut(size).zip(right.chunks_exact(size)) {
            self.sweeps.multiply(to, left, from);
        }
        product
    }

    /// The matrix of one step of the stuck chain without forcing.
    fn one_step(&self, plan: &Plan) -> Vec<f64> {
        let blocks = plan.blocks;
        let dt = plan.grid.step_s();
        let mut matrix = vec![0.0; 4 * blocks * blocks];
        let (mut u, mut v, mut tau) = (vec![0.0; blocks], vec![0.0; blocks], vec![0.0; blocks]);
        let (mut du, mut dv) = (vec![0.0; blocks], vec![0.0; blocks]);
        for (column, entries) in matrix.chunks_exact_mut(2 * blocks).enumerate() {
            u.fill(0.0);
            v.fill(0.0);
            if column < blocks {
                u[column] = 1.0
            } else {
                v[column - blocks] = 1.0
            }
            self.sweeps.pull_of_neighbours(&mut tau, &u, &v, plan.stiffness_n_per_m, plan.damping_kg_per_s);
            tau[0] += plan.drive.force_n(0.0, u[0]);
            let pull = Pull { tau: &tau, spring: &self.spring, dt, dt_over_m: dt / plan.block_mass_kg };
            self.sweeps.differentiate(&mut du, &mut dv, &u, &v, &pull);
            for n in 0..blocks {
                entries[n] = u[n] + du[n];
                entries[blocks + n] = v[n] + dv[n];
            }
        }
        matrix
    }
}

/// Solves `M x = pull` for the stuck chain: `M` is tridiagonal and positive
/// definite, so elimination without pivoting is stable.
fn solve_stuck(plan: &Plan, mut pull: Vec<f64>) -> Vec<f64> {
    let (k, kt) = (plan.stiffness_n_per_m, plan.friction.interfacial_stiffness_n_per_m);
    let last = pull.len() - 1;
    let diagonal = |n: usize| {
        let neighbours = if n == 0 || n == last { 1.0 } else { 2.0 };
        kt + neighbours * k + if n == 0 { plan.drive.stiffness_n_per_m } else { 0.0 }
    };
    let mut pivot = vec![diagonal(0)];
    for n in 1..=last {
        let factor = k / pivot[n - 1];
        pivot.push(diagonal(n) - factor * k);
        pull[n] += factor * pull[n - 1];
    }
    pull[last] /= pivot[last];
    for n in (0..last).rev() {
        pull[n] = (pull[n] + k * pull[n + 1]) / pivot[n];
    }
    pull
}
