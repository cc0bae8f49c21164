//! Windows: many steps at once while no block switches.
//!
//! Between two switches one step is an affine map. With `y` the state, its
//! differences `D_1 = y(s+1) - y(s)` and `D_2 = D_1(s+1) - D_1(s)` take up all that is constant
//! or steady in it (anchors of friction springs, sliding friction, the drive's
//! advance), and from there on it is linear:
//!
//! ```text
//! y(s + i) = y(s) + i D_1 + S_i D_2,    S_i = sum_{l<i-1} (i - 1 - l) A^l,
//! ```
//!
//! with `S_i D_2` a sum of the terms of [`crate::basis`].
//!
//! **Certificate.** What must not happen is told by one number per block, its guard
//! `g`: the force `tau_n` while it is stuck, its velocity while it slides. The guard
//! after `i` steps is the same sum over the guards of the terms, and its second
//! difference is `A^i D_2`'s, at most `Q = sum_j max_i |c_j(i)| |g(w_j)|`. Between two steps `h`
//! apart a guard is therefore within `Q h^2 / 8` of the straight line between its
//! values at both, and, from the window's first step, within `Q i^2 / 2` of its tangent.
//! A window is taken only as far as every stuck block stays below its threshold
//! and every sliding block keeps its direction by one of these bounds: first over
//! the window as a whole, and, for the few blocks that fail it, over its halves, their
//! halves, and so on.
//!
//! **Remainder.** With `M` the chain's stiffness (springs, drive, friction springs
//! of stuck blocks) and `C` its damping, `-eta` times the second difference, the scheme reads
//! `(m - dt C / 2)(v' - v) / dt = -M u - C (v + v') / 2`, and
//!
//! ```text
//! I(u, v) = v (m - dt C / 2) v + u M u - dt v M u
//! ```
//!
//! changes by `-(dt / 2) (v + v') C (v + v') <= 0` in a step: `A` does not expand
//! the norm `sqrt(I)`, in which [`crate::basis`] bounds what is left out.
//! With `w = u - dt v / 2`, `I = w M w + v (m - dt C / 2 - dt^2 M / 4) v`, positive
//! within the stability of the scheme, which gives the bounds of
//! [`Norms`] on forces and velocities.
//!
//! Without friction springs a stuck block does not move: `M` and `C` are then those of the
//! sliding blocks alone, parts of the chain's, and the same holds.
//!
//! **Rounding.** The plain stepper rounds as well, differently. The bounds keep
//! [`ROUNDING`] of the threshold and of the largest velocity in reserve, and
//! [`ROUNDING_ERRORS`] times the rounding of the terms that a force is made of, those
//! that cancel included: for the slider of the thesis 1e-8 N of 2.8 N, where the
//! plain stepper's own forms differ by 4e-11 N.

use asperity_model::{Law, Plan, Reattach};

use crate::basis::{Basis, GRID_STEPS, MOST_TERMS};
use crate::state::ChainState;
use crate::sweep::{Course, Guarded, Held, Reserve, Second, Sweeps, TermChain, Terms, margin};

/// Fewest terms that a window takes.
const FEWEST_TERMS: usize = 4;

/// Size of what is left out of a state, relative to it: a rounding error or two. Terms are
/// taken until it is no more.
const NEGLIGIBLE: f64 = 4e-16;

/// Share of thresholds and velocities that bounds keep in reserve for rounding.
pub(crate) const ROUNDING: f64 = 1e-9;

/// Rounding errors of the terms of a force that they keep in reserve besides.
const ROUNDING_ERRORS: f64 = 64.0;

/// Constants that turn the norm `sqrt(I)` into bounds on forces and velocities.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Norms {
    /// `|tau_n| <= force * sqrt(I)` for every block, in N / sqrt(J).
    pub(crate) force: f64,
    /// `|v_n| <= velocity * sqrt(I)` for every block, in (m/s) / sqrt(J).
    pub(crate) velocity: f64,
    /// `|sum_n K_n u_n| <= drive * sqrt(I)`, in N / sqrt(J).
    pub(crate) drive: f64,
    /// Largest sums of stiffness and damping that a force is made of.
    stiffness_n_per_m: f64,
    damping_kg_per_s: f64,
    mass_kg: f64,
    half_step_s: f64,
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
        let (kt, drive) = (plan.friction.interfacial_stiffness_n_per_m, plan.drive.stiffest_n_per_m());
        let all = plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum::<f64>();
        let inertia = plan.block_mass_kg - 2.0 * dt * eta - dt * dt * (4.0 * k + kt + drive) / 4.0;
        assert!(inertia > 0.0, "the time step is within the stability of the scheme");
        let velocity = 1.0 / inertia.sqrt();
        let row = 6f64.sqrt() * (eta + dt * k / 2.0) + dt * drive / 2.0;
        Norms {
            force: (2.0 * k + drive).sqrt() + row * velocity,
            velocity,
            // `u = w + dt v / 2`, and `(sum K_n w_n)^2 <= (sum K_n) w M w`.
            drive: all.sqrt() + dt / 2.0 * all * velocity,
            stiffness_n_per_m: 4.0 * k + kt + drive,
            damping_kg_per_s: 4.0 * eta,
            mass_kg: plan.block_mass_kg,
            half_step_s: dt / 2.0,
        }
    }

    /// `sqrt(I)` of numbers of at most this size, for any set of sliding blocks: with
    /// `w = u - dt v / 2`, `w M w <= (4 k + k_t + K) |w|^2`, and the velocity part is at most
    /// `m |v|^2`.
    pub(crate) fn at_most(&self, blocks: usize, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        let position = displacement_m + self.half_step_s * velocity_m_per_s;
        let square =
            self.stiffness_n_per_m * position * position + self.mass_kg * velocity_m_per_s * velocity_m_per_s;
        (blocks as f64 * square).sqrt()
    }

    /// How far the rounding of displacements and velocities of this size may
    /// move a force, generously.
    pub(crate) fn force_rounding(&self, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        ROUNDING_ERRORS
            * f64::EPSILON
            * (self.stiffness_n_per_m * displacement_m + self.damping_kg_per_s * velocity_m_per_s)
    }

    /// The same for velocities: those of the same energy.
    pub(crate) fn velocity_rounding(&self, displacement_m: f64, velocity_m_per_s: f64) -> f64 {
        let rate = (self.stiffness_n_per_m / self.mass_kg).sqrt();
        ROUNDING_ERRORS * f64::EPSILON * (rate * displacement_m + velocity_m_per_s)
    }
}

/// By the laws without friction springs: what is stuck does not move.
fn hold_stuck(sigma: &[f64], u: &mut [f64], v: &mut [f64]) {
    for (sigma, (u, v)) in sigma.iter().zip(u.iter_mut().zip(v)) {
        if *sigma == 0.0 {
            (*u, *v) = (0.0, 0.0);
        }
    }
}

/// `I(u, v)` of a residue of a chain with these friction springs.
pub(crate) fn invariant(plan: &Plan, sweeps: Sweeps, spring: &[f64], u: &[f64], v: &[f64]) -> f64 {
    let (k, eta, dt) = (plan.stiffness_n_per_m, plan.damping_kg_per_s, plan.grid.step_s());
    let driven = plan.drive.springs.iter();
    let drive: f64 = driven
        .map(|spring| spring.stiffness_n_per_m * u[spring.block] * (u[spring.block] - dt * v[spring.block]))
        .sum();
    let chain = sweeps.invariant(spring, u, v, &[plan.block_mass_kg, k, eta, dt]);
    (chain + drive).max(0.0)
}

/// Rows of one number per block, each row aligned as vector loads like it.
#[derive(Debug, Clone)]
struct Rows {
    values: Vec<f64>,
    pitch: usize,
    from: usize,
}

impl Rows {
    const ALIGNED_BYTES: usize = 64;

    fn new(blocks: usize, rows: usize) -> Rows {
        let aligned = Rows::ALIGNED_BYTES / size_of::<f64>();
        let pitch = blocks.next_multiple_of(aligned);
        let values = vec![0.0; pitch * rows + aligned];
        let from = values.as_ptr().align_offset(Rows::ALIGNED_BYTES).min(aligned);
        Rows { values, pitch, from }
    }

    /// All rows from the first on.
    fn all(&self) -> &[f64] {
        &self.values[self.from..]
    }

    fn all_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.from..]
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.values[self.from + row * self.pitch..][..self.pitch]
    }

    fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[self.from + row * self.pitch..][..self.pitch]
    }

    /// The first two rows.
    fn both(&self, blocks: usize) -> (&[f64], &[f64]) {
        (&self.row(0)[..blocks], &self.row(1)[..blocks])
    }

    fn both_mut(&mut self, blocks: usize) -> (&mut [f64], &mut [f64]) {
        let (first, second) = self.values[self.from..].split_at_mut(self.pitch);
        (&mut first[..blocks], &mut second[..blocks])
    }

    /// The second row, and one number on either side of it.
    fn with_image(&mut self, blocks: usize) -> &mut [f64] {
        let at = self.from + self.pitch - 1;
        &mut self.values[at..at + blocks + 2]
    }
}

/// One guard: its value and rate where a window starts, what it is of, its terms and their
/// unit, and what is kept in reserve.
struct Alone<'a> {
    now: f64,
    rate: f64,
    sigma: f64,
    threshold: f64,
    terms: &'a [f64],
    unit: f64,
    reserve: &'a Reserve,
}

/// A guard at the start of a window, or at the end of a length.
struct Place {
    index: Option<usize>,
    steps: u64,
    guard: f64,
    /// Bound on its second differences up to there.
    bend: f64,
}

/// How the normal load goes on, over that of the start.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Load {
    /// In a window's first step.
    factor: f64,
    /// By how much it changes in every step.
    rate: f64,
}

impl Load {
    /// What it is so many steps behind the first, over what it is there.
    fn decline(&self, steps: f64) -> f64 {
        if self.rate == 0.0 { 1.0 } else { (self.factor + self.rate * steps) / self.factor }
    }
}

/// The largest displacement and the largest velocity where a window starts.
struct Sizes {
    now: [f64; 2],
    /// Of their change in the first step.
    rate: [f64; 2],
    /// Of `w_0`; velocities in displacement per step.
    first_term: [f64; 2],
    /// What of them may be left out, in the units of terms.
    negligible: [f64; 2],
}

impl Sizes {
    fn are_negligible(&self, left_out: [f64; 2]) -> bool {
        left_out[0] <= self.negligible[0] && left_out[1] <= self.negligible[1]
    }
}

/// The terms of a state, and how far they may be trusted.
#[derive(Debug, Clone)]
pub(crate) struct Window {
    blocks: usize,
    sweeps: Sweeps,
    norms: Norms,
    basis: Basis,
    /// Friction spring of each block: `k_t` while stuck, 0 while sliding.
    spring: Vec<f64>,
    /// The same with the drive's, in the units of terms.
    scaled_spring: Vec<f64>,
    /// The drive's part of them.
    driven: Vec<(usize, f64)>,
    /// Thresholds and sliding friction at the load of the window's first step, where the
    /// load or the contacts' age changes them, and how the load goes on.
    threshold: Vec<f64>,
    sliding_friction: Vec<f64>,
    load: Load,
    /// Sign of the velocity of each sliding block, 0 for stuck ones.
    sigma: Vec<f64>,
    /// `y(s)` and `D_1`, and their guards, one after the other.
    first_u: Rows,
    first_v: Rows,
    first_guard: Rows,
    /// `w_0, w_1, ...`: velocities in displacement per step, guards in the units of terms.
    u: Rows,
    v: Rows,
    guard: Rows,
    /// Strains of the last two terms, with their images beyond the ends: the first
    /// block's stands where rows are aligned.
    strain: [Rows; 2],
    /// What the terms add to the guards at the end of the window, and the bounds on
    /// their second differences.
    end: Vec<f64>,
    bend: Vec<f64>,
    /// How far the whole window keeps each block from switching.
    margin: Vec<f64>,
    /// The blocks that the bound over the whole window does not clear.
    doubtful: Vec<usize>,
    /// How many terms the open window has taken.
    terms: usize,
    /// Steps until the first switch, as they were foreseen where it was opened.
    foreseen_steps: f64,
    /// How many differences and terms have been taken, for the counters.
    pub(crate) applications: u64,
}

impl Window {
    pub(crate) fn new(plan: &Plan, sweeps: Sweeps) -> Window {
        let blocks = plan.blocks;
        let several = |times: usize| vec![0.0; blocks * times];
        let rows = || Rows::new(blocks, MOST_TERMS + 1);
        Window {
            blocks,
            sweeps,
            norms: Norms::of(plan),
            basis: if plan.friction.law.is_affine() { Basis::of(plan) } else { Basis::none() },
            spring: several(1),
            scaled_spring: several(1),
            driven: plan.drive.springs.iter().map(|spring| (spring.block, 0.0)).collect(),
            threshold: plan.friction.static_threshold_n.clone(),
            sliding_friction: plan.friction.dynamic_friction_n.clone(),
            load: Load { factor: 1.0, rate: 0.0 },
            sigma: several(1),
            first_u: Rows::new(blocks, 2),
            first_v: Rows::new(blocks, 2),
            first_guard: Rows::new(blocks, 2),
            u: rows(),
            v: rows(),
            guard: rows(),
            strain: [Rows::new(blocks + 1, 2), Rows::new(blocks + 1, 2)],
            end: several(1),
            bend: several(1),
            margin: several(1),
            doubtful: Vec::new(),
            terms: 0,
            foreseen_steps: 0.0,
            applications: 0,
        }
    }

    /// Steps of a window by the index of its length.
    pub(crate) fn steps(&self, index: usize) -> u64 {
        self.basis.lengths[index].steps
    }

    /// Steps of the shortest window.
    pub(crate) fn shortest(&self) -> u64 {
        self.basis.lengths.first().map_or(u64::MAX, |length| length.steps)
    }

    /// Takes the first differences of a state. False if a sliding block has no
    /// direction that it could keep.
    fn start(&mut self, plan: &Plan, state: &ChainState) -> bool {
        let blocks = self.blocks;
        let friction = &plan.friction;
        let kt = friction.interfacial_stiffness_n_per_m;
        let rigid = friction.law != Law::Springs;
        // Without springs a block stops where its velocity changes sign, whichever it is.
        let one_way = friction.reattach == Reattach::OneWay && !rigid;
        let dt = plan.grid.step_s();
        let dt_over_m = dt / plan.block_mass_kg;
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        self.follow_load(plan, state);
        let directed = self.sweeps.sort(
            &mut self.sigma,
            &mut self.spring,
            v,
            &state.slip,
            &[kt, f64::from(u8::from(one_way))],
        );
        if !directed {
            return false;
        }
        let (now_u, d_u) = self.first_u.both_mut(blocks);
        let (now_v, d_v) = self.first_v.both_mut(blocks);
        let (guard, d_guard) = self.first_guard.both_mut(blocks);
        now_u.copy_from_slice(u);
        now_v.copy_from_slice(v);
        self.sweeps.pull_of_neighbours(guard, u, v, plan.stiffness_n_per_m, plan.damping_kg_per_s);
        let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
        for spring in &plan.drive.springs {
            guard[spring.block] += spring.force_n(point_m, u[spring.block]);
        }
        let held = Held {
            u,
            v,
            anchor: &state.stick_position_m,
            drag: &self.sliding_friction,
            spring: &self.spring,
            sigma: &self.sigma,
            dt,
            dt_over_m,
        };
        self.sweeps.first_difference(d_u, d_v, guard, &held);
        if rigid {
            hold_stuck(&self.sigma, d_u, d_v);
        }
        // The second difference, with the steady advance of drive and load.
        self.sweeps.pull_of_neighbours(d_guard, d_u, d_v, plan.stiffness_n_per_m, plan.damping_kg_per_s);
        let advance_m = if state.hold_step > state.step + 1 { plan.drive.velocity_m_per_s * dt } else { 0.0 };
        for spring in &plan.drive.springs {
            d_guard[spring.block] += spring.force_n(advance_m, d_u[spring.block]);
        }
        if self.load.rate != 0.0 {
            for ((guard, friction), sigma) in
                d_guard.iter_mut().zip(&friction.dynamic_friction_n).zip(&self.sigma)
            {
                *guard -= self.load.rate * friction * sigma;
            }
        }
        let second = Second { u: d_u, v: d_v, spring: &self.spring, sigma: &self.sigma, dt, dt_over_m };
        let (first_u, first_v) = (&mut self.u.row_mut(0)[..blocks], &mut self.v.row_mut(0)[..blocks]);
        self.sweeps.second_difference(first_u, first_v, d_guard, &second);
        if rigid {
            hold_stuck(&self.sigma, first_u, first_v);
        }
        self.applications += 2;
        true
    }

    /// Brings thresholds and sliding friction to the load of the step that comes next.
    fn follow_load(&mut self, plan: &Plan, state: &ChainState) {
        let ages = plan.friction.ageing.is_some();
        if plan.load_course.is_constant() && !ages {
            return;
        }
        let factor = plan.load_factor(state.step + 1, state.hold_step);
        self.load = Load { factor, rate: plan.load_course.rate(state.step + 1, state.hold_step) };
        let scale = |to: &mut [f64], from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = factor * from;
            }
        };
        scale(&mut self.threshold, state.least_threshold_n(plan));
        scale(&mut self.sliding_friction, &plan.friction.dynamic_friction_n);
    }

    /// Steps until the first block would switch if forces and velocities went on as
    /// they go now.
    fn foreseen_steps(&self) -> f64 {
        let blocks = self.blocks;
        let (now, rate) = self.first_guard.both(blocks);
        let guarded = Guarded {
            now,
            rate,
            sigma: &self.sigma,
            limit: &self.threshold[..blocks],
            decline: -self.load.rate / self.load.factor,
        };
        self.sweeps.first_crossing(&guarded)
    }

    /// Opens a window of at most `most_steps` steps; the index of its length, if there
    /// is one over which no block switches by the bounds, or else the steps that are
    /// best taken one by one.
    pub(crate) fn open(&mut self, plan: &Plan, state: &ChainState, most_steps: u64) -> Result<usize, u64> {
        let shortest = self.shortest();
        if shortest == u64::MAX {
            return Err(WITHOUT_WINDOWS);
        }
        if most_steps < shortest {
            return Err(most_steps);
        }
        if !self.start(plan, state) {
            return Err(1);
        }
        let foreseen = self.foreseen_steps();
        self.foreseen_steps = foreseen;
        if let Some(single_steps) = self.refused_by(foreseen) {
            return Err(single_steps);
        }
        let fitting = self
            .basis
            .lengths
            .partition_point(|length| {
                length.steps <= most_steps && length.steps as f64 <= FORESIGHT * foreseen
            })
            .max(1);
        let index = fitting - 1;
        let sizes = self.sizes(plan);
        let ends = self.take_enough_terms(plan, index, &sizes);
        match self.certified(plan, state, index, &sizes, ends) {
            Some(index) => Ok(index),
            None => Err(shortest),
        }
    }

    fn sizes(&self, plan: &Plan) -> Sizes {
        let size = |values: &[f64]| self.sweeps.largest(values);
        let now = [size(self.first_u.row(0)), size(self.first_v.row(0))];
        Sizes {
            now,
            rate: [size(self.first_u.row(1)), size(self.first_v.row(1))],
            first_term: self.size_of_term(0),
            negligible: [NEGLIGIBLE * now[0], NEGLIGIBLE * now[1] * plan.grid.step_s()],
        }
    }

    fn size_of_term(&self, term: usize) -> [f64; 2] {
        [&self.u, &self.v].map(|rows| self.sweeps.largest(rows.row(term)))
    }

    /// As many terms as leave out of a window of this length what is negligible, at most as
    /// many as the length has; sizes of the last of them and the one behind it.
    fn take_enough_terms(&mut self, plan: &Plan, index: usize, sizes: &Sizes) -> [[f64; 2]; 2] {
        let length = &self.basis.lengths[index];
        let most = length.terms;
        // As if all terms were as large as the first; most often they are smaller.
        let enough = |terms: &usize| {
            let left_out = length.left_out_of_sum(*terms).into_iter().sum::<f64>();
            sizes.are_negligible(sizes.first_term.map(|size| left_out * size))
        };
        let mut terms = (FEWEST_TERMS..=most).rev().take_while(enough).last().unwrap_or(most);
        self.scale_springs(plan);
        self.take_terms(plan, 0, terms);
        loop {
            let ends = [terms - 1, terms].map(|term| self.size_of_term(term));
            let left_out = self.basis.lengths[index].left_out_of(terms, ends);
            if terms == most || sizes.are_negligible(left_out) {
                return ends;
            }
            self.take_terms(plan, terms, terms + 1);
            terms += 1;
        }
    }

    /// Springs in the units of terms.
    fn scale_springs(&mut self, plan: &Plan) {
        let unit = self.unit_of_terms(plan);
        self.scaled_spring.copy_from_slice(&self.spring);
        self.sweeps.scale(&mut self.scaled_spring, unit);
        for ((n, drive), spring) in self.driven.iter_mut().zip(&plan.drive.springs) {
            *drive = unit * spring.stiffness_n_per_m;
            self.scaled_spring[*n] += *drive;
        }
    }

    /// What stiffnesses are multiplied with in them.
    fn unit_of_terms(&self, plan: &Plan) -> f64 {
        let dt = plan.grid.step_s();
        2.0 / self.basis.focus * dt * dt / plan.block_mass_kg
    }

    /// The terms behind `w_from` up to `w_to`, and the guards of all but the last.
    fn take_terms(&mut self, plan: &Plan, from: usize, to: usize) {
        let blocks = self.blocks;
        let Basis { centre, focus, sigma, .. } = self.basis;
        let (by, unit) = (2.0 / focus, self.unit_of_terms(plan));
        let (stiffness, damping) =
            (unit * plan.stiffness_n_per_m, unit * plan.damping_kg_per_s / plan.grid.step_s());
        let [first, second] = &mut self.strain;
        let chain = TermChain {
            spring: &self.scaled_spring,
            sigma: &self.sigma,
            rigid: plan.friction.law != Law::Springs,
            stiffness,
            damping,
            driven: &self.driven,
            by,
            stay: -by * centre,
            back: -sigma,
        };
        let pitch = self.u.pitch;
        let rows = Terms { u: self.u.all_mut(), v: self.v.all_mut(), guard: self.guard.all_mut(), pitch };
        self.sweeps.terms(rows, [first.with_image(blocks), second.with_image(blocks)], &chain, from..to);
        self.terms = to;
        self.applications += (to - from) as u64;
    }

    /// What turns guards of terms into those of stuck and of sliding blocks.
    fn units(&self, plan: &Plan) -> (f64, f64) {
        let dt = plan.grid.step_s();
        (plan.block_mass_kg / (dt * dt) * self.basis.focus / 2.0, 1.0 / dt)
    }

    /// The longest of the lengths up to `index` over which no block switches by the
    /// bounds.
    fn certified(
        &mut self,
        plan: &Plan,
        state: &ChainState,
        mut index: usize,
        sizes: &Sizes,
        ends: [[f64; 2]; 2],
    ) -> Option<usize> {
        let blocks = self.blocks;
        let dt = plan.grid.step_s();
        let &Sizes { now: [u_scale, v_scale], rate: [du, dv], first_term: first, .. } = sizes;
        let terms = self.terms;
        loop {
            let length = &self.basis.lengths[index];
            let steps = length.steps as f64;
            if sizes.are_negligible(length.left_out_of(terms, ends)) {
                let norms = ends.map(|[u, v]| self.norms.at_most(blocks, u, v / dt));
                let out = |factors: [f64; 2]| factors[0] * norms[0] + factors[1] * norms[1];
                let (bend, sum) = (out(length.left_out(terms)), out(length.left_out_of_sum(terms)));
                // Sizes of what cancels in a state, which its rounding follows. Terms grow
                // or fall along the basis, so their sizes are taken at its ends.
                let largest =
                    |part: usize| length.largest * first[part].max(ends[0][part]).max(ends[1][part]);
                let rounding = self.norms.force_rounding(
                    u_scale + steps * du + largest(0),
                    v_scale + steps * dv + largest(1) / dt,
                );
                let Norms { force, velocity, drive, .. } = self.norms;
                if let Some(ratio) = plan.drive.until_load_ratio.filter(|_| state.hold_step == u64::MAX) {
                    let reserve = Reserve {
                        stuck_bend: drive * bend,
                        stuck: drive * sum + rounding * plan.blocks as f64,
                        share: 1.0 - ROUNDING,
                        sliding_bend: 0.0,
                        sliding: 0.0,
                    };
                    index = self.certified_for_load(plan, state, ratio, index, &reserve)?;
                }
                let length = &self.basis.lengths[index];
                let steps = length.steps as f64;
                let reserve = Reserve {
                    stuck_bend: force * bend,
                    stuck: force * sum + rounding,
                    share: 1.0 - ROUNDING,
                    sliding_bend: velocity * bend,
                    sliding: velocity * sum + ROUNDING * v_scale + rounding * dt / plan.block_mass_kg * steps,
                };
                return self.certified_by(plan, index, &reserve);
            }
            // With the same terms, less is left out of fewer steps.
            index = index.checked_sub(1)?;
        }
    }

    /// The same, with the reserve that the length needs.
    fn certified_by(&mut self, plan: &Plan, index: usize, reserve: &Reserve) -> Option<usize> {
        let blocks = self.blocks;
        let length = &self.basis.lengths[index];
        let (now, rate) = self.first_guard.both(blocks);
        self.sweeps.follow(
            &mut self.end,
            &mut self.bend,
            self.guard.all(),
            self.guard.pitch,
            [&length.double_sum[..self.terms], &length.whole[..self.terms]],
        );
        let (stuck_unit, sliding_unit) = self.units(plan);
        let course = Course {
            now,
            rate,
            sum: &self.end,
            bend: &self.bend,
            stuck_unit,
            sliding_unit,
            sigma: &self.sigma,
            threshold: &self.threshold,
            decline: self.load.decline(length.steps as f64),
            steps: length.steps as f64,
            reserve,
        };
        self.doubtful.clear();
        if self.sweeps.margins(&mut self.margin, &course) {
            for (n, margin) in self.margin.iter().enumerate() {
                let stays = *margin > 0.0;
                if !stays {
                    self.doubtful.push(n);
                }
            }
        }
        let mut best = Some(index);
        for i in 0..self.doubtful.len() {
            best = self.certified_for(plan, self.doubtful[i], best?, reserve);
        }
        best
    }

    /// The longest of the lengths up to `longest` that block `n` is certified for,
    /// part by part.
    fn certified_for(&self, plan: &Plan, n: usize, longest: usize, reserve: &Reserve) -> Option<usize> {
        let (stuck_unit, sliding_unit) = self.units(plan);
        let terms = self.guard.all()[n..].iter().step_by(self.guard.pitch);
        let mut guard = [0.0; MOST_TERMS];
        for (own, term) in guard.iter_mut().zip(terms.take(self.terms)) {
            *own = *term;
        }
        let alone = Alone {
            now: self.first_guard.row(0)[n],
            rate: self.first_guard.row(1)[n],
            sigma: self.sigma[n],
            threshold: self.threshold[n],
            terms: &guard[..self.terms],
            unit: if self.sigma[n] == 0.0 { stuck_unit } else { sliding_unit },
            reserve,
        };
        self.certified_alone(&alone, longest)
    }

    /// The longest of the lengths up to `longest` over which the sum of the driving forces
    /// stays below the load at which the drive is to stop.
    fn certified_for_load(
        &self,
        plan: &Plan,
        state: &ChainState,
        ratio: f64,
        longest: usize,
        reserve: &Reserve,
    ) -> Option<usize> {
        let springs = &plan.drive.springs;
        let pull = |row: &[f64]| -springs.iter().map(|s| s.stiffness_n_per_m * row[s.block]).sum::<f64>();
        let mut guard = [0.0; MOST_TERMS];
        for (j, own) in guard.iter_mut().enumerate().take(self.terms) {
            *own = pull(self.u.row(j));
        }
        let dt = plan.grid.step_s();
        let point_m = plan.drive_point_m(state.step + 1, state.hold_step);
        let alone = Alone {
            now: plan.drive.total_force_n(point_m, self.first_u.row(0)),
            rate: plan.drive.total_force_n(plan.drive.velocity_m_per_s * dt, self.first_u.row(1)),
            sigma: 0.0,
            threshold: ratio * plan.total_normal_load_n * self.load.factor,
            terms: &guard[..self.terms],
            unit: 1.0,
            reserve,
        };
        self.certified_alone(&alone, longest)
    }

    /// The longest of the lengths up to `longest` over which one guard stays clear of its limit,
    /// part by part.
    fn certified_alone(&self, alone: &Alone<'_>, longest: usize) -> Option<usize> {
        let start = Place { index: None, steps: 0, guard: alone.now, bend: f64::NAN };
        match self.stays_clear(alone, &start, &self.place(alone, longest)) {
            Ok(()) => Some(longest),
            Err(index) => index,
        }
    }

    /// Where the guard is at the end of a length.
    fn place(&self, alone: &Alone<'_>, index: usize) -> Place {
        let length = &self.basis.lengths[index];
        let [sum, bend] = self.sweeps.products(alone.terms, &length.double_sum, &length.whole);
        let guard = alone.now + length.steps as f64 * alone.rate + alone.unit * sum;
        Place { index: Some(index), steps: length.steps, guard, bend: alone.unit * bend }
    }

    /// Whether the guard stays clear of its limit from one place to another, as a whole or
    /// else from one to the middle and from there to the other; if not, the last length that it
    /// does.
    fn stays_clear(&self, alone: &Alone<'_>, from: &Place, to: &Place) -> Result<(), Option<usize>> {
        let &Alone { rate, sigma, threshold, unit, reserve, .. } = alone;
        let steps = (to.steps - from.steps) as f64;
        // The tangent is known where the window starts.
        let tangent = if from.steps == 0 { from.guard + steps * rate } else { f64::NAN };
        let thresholds = [from, to].map(|place| threshold * self.load.decline(place.steps as f64));
        let stays =
            |bend: f64| margin(from.guard, to.guard, tangent, steps, bend, sigma, thresholds, reserve) > 0.0;
        if stays(to.bend) {
            return Ok(());
        }
        let next = from.index.map_or(0, |index| index + 1);
        let between = &self.basis.lengths[next..to.index.unwrap_or(next)];
        if between.is_empty() {
            // One length from the next: the sharper bound between these two.
            let length = &self.basis.lengths[next];
            let [_, bend] = self.sweeps.products(alone.terms, &length.double_sum, &length.last);
            return if stays(unit * bend) { Ok(()) } else { Err(from.index) };
        }
        let middle_steps = from.steps + (to.steps - from.steps) / 2;
        let below = between.partition_point(|length| length.steps <= middle_steps);
        let middle = self.place(alone, next + below.saturating_sub(1));
        self.stays_clear(alone, from, &middle)?;
        self.stays_clear(alone, &middle, to)
    }

    /// The steps that are best taken one by one where a switch is foreseen so soon that no
    /// window fits in front of it.
    pub(crate) fn refused_by(&self, foreseen_steps: f64) -> Option<u64> {
        let shortest = self.shortest();
        let refused = shortest < u64::MAX && foreseen_steps < shortest as f64;
        refused.then_some((foreseen_steps as u64).max(1))
    }

    /// Whether that is to be expected at the end of the open window.
    pub(crate) fn ends_near_switch(&self, index: usize) -> bool {
        self.refused_by(self.foreseen_steps - self.steps(index) as f64).is_some()
    }

    /// Writes displacements and velocities at the end of the window into `state`.
    pub(crate) fn land(&self, plan: &Plan, index: usize, state: &mut ChainState) {
        let length = &self.basis.lengths[index];
        self.compose(plan, length.steps, &length.double_sum[..self.terms], state);
        state.step += length.steps;
        state.sliding = state.detached;
    }

    /// The same for a number of steps on the grid of [`GRID_STEPS`], as many as fit
    /// into `steps`.
    pub(crate) fn sample(&self, plan: &Plan, steps: u64, state: &mut ChainState) {
        let steps = steps / GRID_STEPS * GRID_STEPS;
        self.compose(plan, steps, &self.basis.double_sum(steps)[..self.terms], state);
        state.step += steps;
    }

    fn compose(&self, plan: &Plan, steps: u64, coefficients: &[f64], state: &mut ChainState) {
        let parts = [
            (&mut state.displacement_m, &self.first_u, &self.u, 1.0),
            (&mut state.velocity_m_per_s, &self.first_v, &self.v, 1.0 / plan.grid.step_s()),
        ];
        for (values, first, terms, unit) in parts {
            self.sweeps.combine(values, terms.all(), terms.pitch, coefficients);
            let (now, rate) = first.both(self.blocks);
            self.sweeps.add_course(values, now, rate, steps as f64, unit);
        }
    }
}

/// Single steps at a time where there are no windows: now and then a jump may be
/// possible.
const WITHOUT_WINDOWS: u64 = 1000;

/// How much longer than foreseen a window may try to be.
const FORESIGHT: f64 = 1.1;

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::{Alone, Window};
    use crate::sweep::{Reserve, Sweeps, margin};
    use crate::{Plain, Solver};

    /// A chain in which no block switches for long: thresholds out of reach, some
    /// blocks that slide fast, others that stick.
    fn free_run(set: &str) -> (Plan, Plain) {
        let source = ScenarioSource::new("test", "time.duration_s = 1").with_override(set);
        let mut plan = Plan::new(&Scenario::resolve(&source).unwrap());
        plan.friction.static_threshold_n.fill(1e9);
        plan.friction.dynamic_friction_n.fill(0.1);
        let mut plain = Plain::new(plan.clone());
        let mut state = plain.snapshot();
        for n in 0..plan.blocks {
            // Waves of all lengths.
            let pattern = ((n * n * 7919) % 101) as f64 / 101.0;
            state.displacement_m[n] = 1e-6 * pattern;
            state.velocity_m_per_s[n] = 1e-3 * pattern;
            if n % 3 == 0 {
                state.velocity_m_per_s[n] += 10.0;
                state.slip[n] = 1.0;
                state.detached += 1;
            }
        }
        plain.restore(&state);
        (plan, plain)
    }

    #[test]
    fn windows_of_every_length_land_where_single_steps_do() {
        for set in ["parameter_set=as-coded", "parameter_set=as-stated", "slider.relative_damping=0"] {
            let (plan, start) = free_run(set);
            let mut window = Window::new(&plan, Sweeps::Baseline);
            let lengths = window.basis.lengths.len();
            let mut compared = 0;
            for opened in 0..lengths {
                let state = start.snapshot();
                assert!(window.start(&plan, &state));
                window.scale_springs(&plan);
                window.take_terms(&plan, 0, window.basis.lengths[opened].terms);
                let left_out = |index: usize| {
                    let length = &window.basis.lengths[index];
                    let factors = length.left_out_of_sum(window.terms);
                    [window.terms - 1, window.terms]
                        .iter()
                        .zip(factors)
                        .map(|(&j, factor)| factor * window.sweeps.largest(window.v.row(j)))
                        .sum::<f64>()
                };
                let mut plain = start.clone();
                'lengths: for index in 0..=opened {
                    while plain.step() < window.steps(index) {
                        plain.take_step();
                        if !plain.switched().is_empty() {
                            break 'lengths;
                        }
                    }
                    compared += 1;
                    let mut landed = state.clone();
                    window.land(&plan, index, &mut landed);
                    let exact = plain.state();
                    assert_eq!(landed.step, exact.step);
                    // In displacement per step, as left_out.
                    let dt = plan.grid.step_s();
                    let allowed = 10.0 * left_out(index) + 1e-11 * dt;
                    for n in 0..plan.blocks {
                        let off = (landed.velocity_m_per_s[n] - exact.velocity_m_per_s[n]).abs() * dt;
                        assert!(off <= allowed, "{set}, {index} of {opened}, block {n}: {off} {allowed}");
                    }
                    assert!(index == 0 || left_out(index - 1) <= left_out(index), "less for fewer steps");
                }
            }
            assert!(compared > 20, "{set}: {compared}");
        }
    }

    #[test]
    fn calm_states_take_fewer_terms_and_land_as_exactly() {
        for set in ["parameter_set=as-coded", "parameter_set=as-stated"] {
            let (plan, start) = free_run(set);
            let mut window = Window::new(&plan, Sweeps::Baseline);
            let (mut fewer, lengths) = (0, window.basis.lengths.len());
            for index in 0..lengths {
                let mut counts = Vec::new();
                for agitation in [1e-12, 1e-6, 1.0] {
                    // All slide along, by the drive's side, and ring a little.
                    let mut state = start.snapshot();
                    state.step = (1e-3 / (plan.drive.velocity_m_per_s * plan.grid.step_s())) as u64;
                    for n in 0..plan.blocks {
                        let pattern = ((n * n * 7919) % 101) as f64 / 101.0;
                        state.displacement_m[n] = 1e-3;
                        state.velocity_m_per_s[n] = 10.0 + agitation * pattern;
                        state.slip[n] = 1.0;
                    }
                    state.detached = plan.blocks as u32;
                    assert!(window.start(&plan, &state));
                    let sizes = window.sizes(&plan);
                    let ends = window.take_enough_terms(&plan, index, &sizes);
                    let length = &window.basis.lengths[index];
                    let left_out = length.left_out_of(window.terms, ends);
                    assert!(window.terms == length.terms || sizes.are_negligible(left_out));
                    counts.push(window.terms);

                    let mut plain = start.clone();
                    plain.restore(&state);
                    while plain.step() < state.step + window.steps(index) {
                        plain.take_step();
                        assert!(plain.switched().is_empty());
                    }
                    window.land(&plan, index, &mut state);
                    let exact = plain.state();
                    for n in 0..plan.blocks {
                        let off_m = (state.displacement_m[n] - exact.displacement_m[n]).abs();
                        let off_m_per_s = (state.velocity_m_per_s[n] - exact.velocity_m_per_s[n]).abs();
                        assert!(
                            off_m <= 1e-3 * 1e-12 && off_m_per_s <= 10.0 * 1e-12,
                            "{off_m} {off_m_per_s}"
                        );
                    }
                }
                assert!(counts.is_sorted(), "{set}, length {index}: {counts:?}");
                fewer += usize::from(counts[0] < counts[2]);
            }
            assert!(2 * fewer > lengths, "{set}: {fewer} of {lengths}");
        }
    }

    #[test]
    fn a_guard_is_certified_as_far_as_length_by_length_and_stays_clear_so_far() {
        const TERMS: usize = 20;
        let reserve = Reserve { stuck_bend: 0.0, sliding_bend: 0.0, stuck: 0.0, sliding: 0.0, share: 1.0 };
        // Numbers without pattern, the same on every machine.
        let mut seed = 1u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let (mut whole, mut part) = (0, 0);
        for set in ["parameter_set=as-coded", "parameter_set=as-stated"] {
            let (plan, _) = free_run(set);
            let window = Window::new(&plan, Sweeps::Baseline);
            let lengths = &window.basis.lengths;
            let longest = lengths.len() - 1;
            let steps = lengths[longest].steps as f64;
            for sigma in [0.0, 1.0, -1.0].repeat(200) {
                let terms: Vec<f64> = (0..TERMS).map(|j| noise() * libm::exp(-0.5 * j as f64)).collect();
                let now = if sigma == 0.0 { noise() } else { sigma * (0.01 + noise().abs()) };
                let alone = Alone {
                    now,
                    rate: 2.0 * noise() / steps,
                    sigma,
                    threshold: 0.55,
                    terms: &terms,
                    unit: 8.0 * noise().abs() / (steps * steps),
                    reserve: &reserve,
                };
                let at = |i: u64| {
                    let sum: f64 = terms.iter().zip(window.basis.double_sum(i)).map(|(x, s)| x * s).sum();
                    alone.now + i as f64 * alone.rate + alone.unit * sum
                };
                let certified = window.certified_alone(&alone, longest);

                let mut one_by_one = None;
                let (mut from, mut from_steps) = (alone.now, 0);
                for (index, length) in lengths.iter().enumerate() {
                    let steps = (length.steps - from_steps) as f64;
                    let bend: f64 = terms.iter().zip(&length.last).map(|(x, c)| x.abs() * c).sum();
                    let tangent = if from_steps == 0 { from + steps * alone.rate } else { f64::NAN };
                    let to = at(length.steps);
                    let bend = alone.unit * bend;
                    if margin(from, to, tangent, steps, bend, sigma, [0.55, 0.55], &reserve) <= 0.0 {
                        break;
                    }
                    one_by_one = Some(index);
                    (from, from_steps) = (to, length.steps);
                }
                assert!(certified >= one_by_one, "{certified:?} {one_by_one:?}");
                match certified {
                    Some(index) if index == longest => whole += 1,
                    _ => part += 1,
                }
                let certified_steps = certified.map_or(0, |index| lengths[index].steps);
                for i in (0..=certified_steps).step_by(super::GRID_STEPS as usize) {
                    let clear = if sigma == 0.0 { at(i).abs() < 0.55 } else { sigma * at(i) > 0.0 };
                    assert!(clear, "{i} of {certified_steps}: {} {sigma}", at(i));
                }
            }
        }
        assert!(whole > 100 && part > 100, "{whole} {part}");
    }
}
