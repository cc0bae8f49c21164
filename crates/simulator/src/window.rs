//! Windows: many steps at once while no block switches.
//!
//! Between two switches one step is an affine map, so the state after `i` steps
//! is Newton's forward-difference formula, exact once the differences vanish:
//!
//! ```text
//! y(s + i) = sum_j C(i, j) D_j,    D_0 = y(s),  D_{j+1} = y-difference of D_j
//! ```
//!
//! A difference costs about one plain step. Constants (anchors of friction
//! springs, sliding friction) enter `D_1` only, the steady drive `D_1` and `D_2`
//! only; from `D_3` on the map is linear and homogeneous.
//!
//! **Certificate.** The same differences bound what happens on the way. The force
//! that step `s + 1 + i` uses is `sum_j C(i, j) T_j`, so over `0 <= i < k`
//!
//! ```text
//! |tau_n| <= max(|T_0|, |T_0 + (k-1) T_1|) + sum_{j>=2} C(k, j) |T_j|,
//! ```
//!
//! and a sliding block's velocity is at least
//! `min(|V_0|, |V_0| + k sigma V_1) - sum_{j>=2} C(k, j) |V_j|`, with `sigma` the sign of `V_0`.
//! A window is taken only as far as every stuck block stays below its threshold
//! and every sliding block keeps its direction by these bounds.
//!
//! **Remainder.** Stopping at `J` differences leaves
//! `sum_{i<k} C(i, J-1) A^{k-1-i} D_J`. With `M` the chain's stiffness (springs,
//! drive, friction springs of stuck blocks), `C = eta` times the chain's second
//! difference, the scheme reads
//! `(m - dt C / 2)(v' - v) / dt = -M u - C (v + v') / 2`, and
//!
//! ```text
//! I(u, v) = v (m - dt C / 2) v + u M u - dt v M u
//! ```
//!
//! changes by `-(dt / 2) (v + v') C (v + v') <= 0` in a step: `A` does not expand
//! the norm `sqrt(I)`. So the remainder is at most `C(k, J) sqrt(I(D_J))` in it.
//! With `w = u - dt v / 2`, `I = w M w + v (m - dt C / 2 - dt^2 M / 4) v`, positive
//! within the stability of the scheme, which gives the bounds of
//! [`Norms`] on forces and velocities.
//!
//! **Rounding.** The plain stepper rounds as well, differently. Both bounds keep
//! [`ROUNDING`] of the threshold and of the largest velocity in reserve, and
//! [`ROUNDING_ERRORS`] times the rounding of the terms that a force is made of: for
//! the slider of the thesis 1e-8 N of 2.8 N, where the plain stepper's own forms
//! differ by 4e-11 N.

use asperity_model::{Plan, Reattach};

use crate::state::ChainState;
use crate::sweep::{Pull, Sweeps};

/// Most differences that a window is made of.
pub(crate) const DIFFERENCES: usize = 34;

/// Length of the longest window in units of the time of the fastest mode,
/// `1 / |A - 1|`: more differences per window against fewer windows.
const REACH: f64 = 4.0;

/// Fewest differences.
const FEWEST: usize = 4;

/// Relative size at which the next difference no longer matters: the rounding
/// error of the state itself.
const NEGLIGIBLE: f64 = 1e-16;

/// Share of thresholds and velocities that bounds keep in reserve for rounding.
const ROUNDING: f64 = 1e-9;

/// Rounding errors of the terms of a force that they keep in reserve besides.
const ROUNDING_ERRORS: f64 = 64.0;

/// Constants that turn the norm `sqrt(I)` into bounds on forces and velocities.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Norms {
    /// `|tau_n| <= force * sqrt(I)` for every block, in N / sqrt(J).
    pub(crate) force: f64,
    /// `|v_n| <= velocity * sqrt(I)` for every block, in (m/s) / sqrt(J).
    pub(crate) velocity: f64,
    /// Largest sums of stiffness and damping that a force is made of.
    stiffness_n_per_m: f64,
    damping_kg_per_s: f64,
}

impl Norms {
    /// From the plan's constants alone, for any set of sliding blocks.
    ///
    /// The velocity part of `I` is at least
    /// `s = m - 2 dt eta - dt^2 (4 k + k_t + K) / 4 > 0` times `|v|^2`. A force is
    /// `tau = -P w - (C + dt P / 2) v` with `P` the stiffness without friction
    /// springs; a row of it is bounded by `sqrt(P_nn) sqrt(w M w)`, since `P <= M`,
    /// and a row of a second difference has length `sqrt(6)`.
    pub(crate) fn of(plan: &Plan) -> Norms {
        let (k, eta, dt) = (plan.stiffness_n_per_m, plan.damping_kg_per_s, plan.grid.step_s());
        let (kt, drive) = (plan.friction.interfacial_stiffness_n_per_m, plan.drive.stiffness_n_per_m);
        let inertia = plan.block_mass_kg - 2.0 * dt * eta - dt * dt * (4.0 * k + kt + drive) / 4.0;
        assert!(inertia > 0.0, "the time step is within the stability of the scheme");
        let velocity = 1.0 / inertia.sqrt();
        let row = 6f64.sqrt() * (eta + dt * k / 2.0) + dt * drive / 2.0;
        Norms {
            force: (2.0 * k + drive).sqrt() + row * velocity,
            velocity,
            stiffness_n_per_m: 4.0 * k + kt + drive,
            damping_kg_per_s: 4.0 * eta,
        }
    }

    /// How far the rounding of displacements and velocities of this size may
    /// move a force, generously.
    pub(crate) fn force_rounding(&self, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        ROUNDING_ERRORS
            * f64::EPSILON
            * (self.stiffness_n_per_m * displacement_m + self.damping_kg_per_s * velocity_m_per_s)
    }
}

/// `I(u, v)` of a difference or a residual of a chain with these stuck blocks.
pub(crate) fn invariant(plan: &Plan, spring: &[f64], u: &[f64], v: &[f64]) -> f64 {
    let (k, eta, dt) = (plan.stiffness_n_per_m, plan.damping_kg_per_s, plan.grid.step_s());
    let mut sum = 0.0;
    for n in 0..u.len() {
        let held = spring[n] + if n == 0 { plan.drive.stiffness_n_per_m } else { 0.0 };
        sum += plan.block_mass_kg * v[n] * v[n] + held * u[n] * (u[n] - dt * v[n]);
    }
    for (u, v) in u.windows(2).zip(v.windows(2)) {
        let (du, dv) = (u[1] - u[0], v[1] - v[0]);
        sum += k * du * (du - dt * dv) - 0.5 * dt * eta * dv * dv;
    }
    sum.max(0.0)
}

/// The differences of a state, and how far they may be trusted.
#[derive(Debug, Clone)]
pub(crate) struct Window {
    blocks: usize,
    sweeps: Sweeps,
    norms: Norms,
    /// Longest window that the differences converge over, in steps.
    reach_steps: u64,
    /// Friction spring of each block: `k_t` while stuck, 0 while sliding.
    spring: Vec<f64>,
    /// Sign of the velocity of each sliding block, 0 for stuck ones.
    sigma: Vec<f64>,
    /// `D_0, D_1, ...`: displacements, velocities, and forces of the next step.
    u: Vec<f64>,
    v: Vec<f64>,
    tau: Vec<f64>,
    /// Bounds on what the differences from the second on add.
    tau_tail: Vec<f64>,
    v_tail: Vec<f64>,
    /// How many differences count; the next one bounds the remainder.
    terms: usize,
    /// `sqrt(I)` of the first difference left out, and its size relative to the state.
    remainder: f64,
    left_out: f64,
    /// Reserve for the rounding of forces, N.
    force_rounding: f64,
    /// How many differences have been taken, for the counters.
    pub(crate) applications: u64,
}

impl Window {
    pub(crate) fn new(plan: &Plan, sweeps: Sweeps) -> Window {
        let (k, eta, dt) = (plan.stiffness_n_per_m, plan.damping_kg_per_s, plan.grid.step_s());
        let stiffest = 4.0 * k + plan.friction.interfacial_stiffness_n_per_m + plan.drive.stiffness_n_per_m;
        let fastest = (stiffest / plan.block_mass_kg).sqrt().max(4.0 * eta / plan.block_mass_kg);
        let blocks = plan.blocks;
        Window {
            blocks,
            sweeps,
            norms: Norms::of(plan),
            reach_steps: (REACH / (dt * fastest)) as u64,
            spring: vec![0.0; blocks],
            sigma: vec![0.0; blocks],
            u: vec![0.0; blocks * (DIFFERENCES + 2)],
            v: vec![0.0; blocks * (DIFFERENCES + 2)],
            tau: vec![0.0; blocks * (DIFFERENCES + 1)],
            tau_tail: vec![0.0; blocks],
            v_tail: vec![0.0; blocks],
            terms: 0,
            remainder: 0.0,
            left_out: 0.0,
            force_rounding: 0.0,
            applications: 0,
        }
    }

    /// Takes the differences of a state. False if a sliding block has no
    /// direction that it could keep.
    pub(crate) fn open(&mut self, plan: &Plan, state: &ChainState, most_steps: u64) -> bool {
        let friction = &plan.friction;
        let kt = friction.interfacial_stiffness_n_per_m;
        let one_way = friction.reattach == Reattach::OneWay;
        for n in 0..self.blocks {
            let (slides, v) = (state.slip[n] != 0.0, state.velocity_m_per_s[n]);
            if slides && (v == 0.0 || (one_way && v < 0.0)) {
                return false;
            }
            self.sigma[n] = if slides { v.signum() } else { 0.0 };
            self.spring[n] = if slides { 0.0 } else { kt };
        }
        let blocks = self.blocks;
        self.u[..blocks].copy_from_slice(&state.displacement_m);
        self.v[..blocks].copy_from_slice(&state.velocity_m_per_s);

        let dt = plan.grid.step_s();
        let dt_over_m = dt / plan.block_mass_kg;
        let drive = &plan.drive;
        let k = most_steps.min(self.reach_steps) as f64;
        let sweeps = self.sweeps;
        let (u_scale, v_scale) = (sweeps.largest(&self.u[..blocks]), sweeps.largest(&self.v[..blocks]));
        let mut binomial = 1.0;
        for j in 0..=DIFFERENCES {
            let at = j * blocks;
            let (u, u_next) = self.u[at..at + 2 * blocks].split_at_mut(blocks);
            let (v, v_next) = self.v[at..at + 2 * blocks].split_at_mut(blocks);
            let tau = &mut self.tau[at..at + blocks];
            self.sweeps.pull_of_neighbours(tau, u, v, plan.stiffness_n_per_m, plan.damping_kg_per_s);
            // The drive point and its steady advance: differences 0 and 1 of the forcing.
            tau[0] += match j {
                0 => drive.force_n(plan.grid.time_s(state.step + 1), u[0]),
                1 => drive.force_n(dt, u[0]),
                _ => -drive.stiffness_n_per_m * u[0],
            };
            if j == 0 {
                for n in 0..blocks {
                    let friction = if self.sigma[n] == 0.0 {
                        -kt * (u[n] - state.stick_position_m[n])
                    } else {
                        -friction.dynamic_friction_n[n] * self.sigma[n]
                    };
                    v_next[n] = (tau[n] + friction) * dt_over_m;
                    u_next[n] = (v[n] + v_next[n]) * dt;
                }
            } else {
                let pull = Pull { tau, spring: &self.spring, dt, dt_over_m };
                self.sweeps.differentiate(u_next, v_next, u, v, &pull);
            }
            self.applications += 1;
            self.terms = j + 1;
            binomial *= (k - j as f64) / (j + 1) as f64;
            // Only every second one is looked at, and none of the first: looking
            // costs half as much as a difference.
            if j >= FEWEST && j % 2 == 0 {
                let next_matters = binomial * sweeps.largest(u_next) > NEGLIGIBLE * u_scale
                    || binomial * sweeps.largest(v_next) > NEGLIGIBLE * v_scale;
                if !next_matters {
                    break;
                }
            }
        }
        let next = self.terms * blocks..(self.terms + 1) * blocks;
        let relative = |size: f64, scale: f64| if size == 0.0 { 0.0 } else { size / scale };
        self.left_out = relative(sweeps.largest(&self.u[next.clone()]), u_scale)
            .max(relative(sweeps.largest(&self.v[next.clone()]), v_scale));
        self.force_rounding = self.norms.force_rounding(u_scale, v_scale);
        self.remainder = invariant(plan, &self.spring, &self.u[next.clone()], &self.v[next]).sqrt();
        true
    }

    /// The largest number of steps, up to `most_steps`, over which no block
    /// switches by the bounds; 0 if there is none.
    pub(crate) fn certified_steps(&mut self, plan: &Plan, most_steps: u64) -> u64 {
        let blocks = self.blocks;
        let v_scale = self.sweeps.largest(&self.v[..blocks]);
        let mut steps = most_steps.min(self.reach_steps);
        let mut binomial = binomials(steps, self.terms + 1);
        // What is left out must not matter to the state either.
        while steps > 0 && binomial[self.terms] * self.left_out > NEGLIGIBLE {
            steps -= steps / 8 + 1;
            binomial = binomials(steps, self.terms + 1);
        }
        if steps == 0 {
            return 0;
        }
        let (from, to) = (2 * blocks, self.terms * blocks);
        self.sweeps.combine_magnitudes(&mut self.tau_tail, &self.tau[from..to], &binomial[2..self.terms]);
        self.sweeps.combine_magnitudes(&mut self.v_tail, &self.v[from..to], &binomial[2..self.terms]);
        for n in 0..blocks {
            // The tails are those of the longest window, too large for a shorter
            // one: a block that fits with them fits.
            let tail = if self.sigma[n] == 0.0 { self.tau_tail[n] } else { self.v_tail[n] };
            if self.fits_with(plan, n, steps, tail, &binomial, v_scale)
                || self.fits(plan, n, steps, &binomial, v_scale)
            {
                continue;
            }
            // The bounds grow with the number of steps: bisect.
            let (mut low, mut high) = (0, steps);
            while high - low > 1 + low / 16 {
                let middle = low + (high - low) / 2;
                if self.fits(plan, n, middle, &binomials(middle, self.terms + 1), v_scale) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            steps = low;
            binomial = binomials(steps, self.terms + 1);
            if steps == 0 {
                break;
            }
        }
        steps
    }

    /// Whether a block does not switch within so many steps, by the bounds.
    fn fits(
        &self,
        plan: &Plan,
        n: usize,
        steps: u64,
        binomial: &[f64; DIFFERENCES + 2],
        v_scale: f64,
    ) -> bool {
        let terms = if self.sigma[n] == 0.0 { &self.tau } else { &self.v };
        let tail = (2..self.terms).map(|j| binomial[j] * terms[j * self.blocks + n].abs()).sum();
        self.fits_with(plan, n, steps, tail, binomial, v_scale)
    }

    fn fits_with(
        &self,
        plan: &Plan,
        n: usize,
        steps: u64,
        tail: f64,
        binomial: &[f64; DIFFERENCES + 2],
        v_scale: f64,
    ) -> bool {
        let at = |values: &[f64], j: usize| values[j * self.blocks + n];
        let remainder = binomial[self.terms] * self.remainder;
        if self.sigma[n] == 0.0 {
            let threshold = plan.friction.static_threshold_n[n];
            let first = at(&self.tau, 0);
            let last = first + (steps as f64 - 1.0) * at(&self.tau, 1);
            let bound = first.abs().max(last.abs()) + tail + self.norms.force * remainder;
            bound < threshold - ROUNDING * threshold - self.force_rounding
        } else {
            let first = at(&self.v, 0).abs();
            let last = first + steps as f64 * self.sigma[n] * at(&self.v, 1);
            let rounding = self.force_rounding * plan.grid.step_s() / plan.block_mass_kg * steps as f64;
            first.min(last) - tail - self.norms.velocity * remainder > ROUNDING * v_scale + rounding
        }
    }

    /// Writes the state after `steps` steps of the window into `state`, which
    /// must be the state that it was opened at or one written before.
    pub(crate) fn evaluate(&self, from_step: u64, steps: u64, state: &mut ChainState) {
        let binomial = binomials(steps, self.terms);
        let before = binomials(steps - 1, self.terms);
        self.sweeps.combine(&mut state.displacement_m, &self.u, &binomial[..self.terms]);
        self.sweeps.combine(&mut state.velocity_m_per_s, &self.v, &binomial[..self.terms]);
        self.sweeps.combine(&mut state.tangential_force_n, &self.tau, &before[..self.terms]);
        state.step = from_step + steps;
        state.sliding = state.detached;
    }

    /// The driving force that the last of `steps` steps used.
    pub(crate) fn driving_force_n(&self, plan: &Plan, from_step: u64, steps: u64) -> f64 {
        let before = binomials(steps - 1, self.terms);
        let first_m = (0..self.terms).rev().map(|j| before[j] * self.u[j * self.blocks]).sum();
        plan.drive.force_n(plan.grid.time_s(from_step + steps), first_m)
    }
}

/// `C(steps, j)` for `j = 0 ..`, as many as asked for.
fn binomials(steps: u64, count: usize) -> [f64; DIFFERENCES + 2] {
    let mut binomial = [0.0; DIFFERENCES + 2];
    binomial[0] = 1.0;
    for j in 1..count.min(DIFFERENCES + 2) {
        binomial[j] = binomial[j - 1] * (steps as f64 - (j - 1) as f64) / j as f64;
    }
    binomial
}
