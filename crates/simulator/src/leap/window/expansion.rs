//! The terms of a state: its change over many steps while no block switches.
//!
//! Between two switches a step is an affine map, with radiation as a damping of the sliding blocks alone. With `y`
//! the state, its differences `D_1 = y(s+1) - y(s)` and `D_2 = D_1(s+1) - D_1(s)` eliminate what is constant or
//! linear in time (anchors of friction springs, sliding friction, the drive's advance), and the remaining map is
//! linear:
//!
//! ```text
//! y(s + i) = y(s) + i D_1 + S_i D_2,    S_i = sum_{l<i-1} (i - 1 - l) A^l,
//! ```
//!
//! with `S_i D_2` a sum of the terms of [`crate::leap::chebyshev`].

use std::hint::select_unpredictable;
use std::sync::Arc;

use asperity_model::body::elastic::Chain;
use asperity_model::body::ends::EndBond;
use asperity_model::plan::load::Ramp;
use asperity_model::{Plan, SliderState};

use crate::energy::{Radiated, hold_stuck};
use crate::kernels::{self, Held, TermChain, Terms};
use crate::leap::chebyshev::{Chebyshev, MOST_TERMS};
use crate::leap::window::rows::Rows;
use crate::modes::operator_cache;
use crate::step::strength::Strength;

/// Fewest terms of a window.
const FEWEST_TERMS: usize = 4;

/// Size of the truncation, relative to the state: one or two rounding errors. Terms are added until this is
/// reached.
const NEGLIGIBLE: f64 = 4e-16;

/// The largest displacement and the largest velocity where a window starts.
pub(super) struct Sizes {
    pub(super) now: [f64; 2],
    /// Their change in the first step.
    pub(super) rate: [f64; 2],
    /// Of `w_0`; velocities in displacement per step.
    pub(super) first_term: [f64; 2],
    /// Parts of them that may be left out, in the units of terms.
    negligible: [f64; 2],
}

impl Sizes {
    pub(super) fn are_negligible(&self, left_out: [f64; 2]) -> bool {
        left_out[0] <= self.negligible[0] && left_out[1] <= self.negligible[1]
    }
}

/// A state, its first two differences and the terms that follow from them.
#[derive(Debug, Clone)]
pub(super) struct Expansion {
    chain: Chain,
    pub(super) blocks: usize,
    pub(super) basis: Arc<Chebyshev>,
    /// Friction spring of each block: `k_t` while stuck, 0 while sliding.
    spring: Vec<f64>,
    /// Friction springs with those of the drive, in the units of terms.
    scaled_spring: Vec<f64>,
    /// The drive's part of these springs.
    driven: Vec<(usize, f64)>,
    /// The strength of contacts in the window's first step.
    pub(super) strength: Strength,
    /// The load and its rate from there.
    pub(super) ramp: Ramp,
    /// Sign of the velocity of each sliding block, 0 for stuck ones.
    pub(super) sigma: Vec<f64>,
    /// `y(s)` and `D_1`, and their guards.
    pub(super) first_u: Rows,
    first_v: Rows,
    pub(super) first_guard: Rows,
    /// `w_0, w_1, ...`: velocities in displacement per step, guards in the units of terms.
    pub(super) u: Rows,
    pub(super) v: Rows,
    pub(super) guard: Rows,
    /// Strains of the last two terms, with their images beyond the ends; the first block's is aligned as
    /// rows are.
    strain: [Rows; 2],
    /// Number of terms used.
    pub(super) terms: usize,
    /// Number of differences and terms computed in all, for the counters.
    pub(super) applications: u64,
}

impl Expansion {
    pub(super) fn new(plan: &Plan, chain: &Chain) -> Expansion {
        let basis = match plan.friction.law.affine() {
            Some(_) if Radiated::of(plan, chain) != Radiated::Apart => {
                operator_cache::HERE.basis(plan, chain)
            }
            _ => Arc::new(Chebyshev::default()),
        };
        let blocks = plan.blocks;
        let zeros = || vec![0.0; blocks];
        Expansion {
            chain: *chain,
            blocks,
            basis,
            spring: zeros(),
            scaled_spring: zeros(),
            driven: plan.drive.springs.iter().map(|spring| (spring.block, 0.0)).collect(),
            strength: Strength::new(plan),
            ramp: Ramp::FLAT,
            sigma: zeros(),
            first_u: Rows::new(blocks, 2),
            first_v: Rows::new(blocks, 2),
            first_guard: Rows::new(blocks, 2),
            u: Rows::new(blocks, 0),
            v: Rows::new(blocks, 0),
            guard: Rows::new(blocks, 0),
            strain: [Rows::new(blocks + 1, 2), Rows::new(blocks + 1, 2)],
            terms: 0,
            applications: 0,
        }
    }

    /// Computes the first differences of a state. False if a sliding block has no direction that it
    /// could keep.
    pub(super) fn start(&mut self, plan: &Plan, state: &SliderState) -> bool {
        let blocks = self.blocks;
        let friction = &plan.friction;
        let rigid = friction.law.holds();
        let one_way = friction.law.affine().is_some_and(|form| form.forward_only);
        let dt = plan.grid.step_s();
        let dt_over_m = dt / plan.block_mass_kg;
        let (u, v) = (&state.displacement_m, &state.velocity_m_per_s);
        let outside = plan.outside(state.step + 1, state.hold_step);
        if self.strength.changes() {
            self.ramp = outside.ramp();
            self.strength.follow(plan, state, self.ramp.load);
        }
        let directed = kernels::classify(
            &mut self.sigma,
            &mut self.spring,
            v,
            &state.slip,
            &friction.springs_n_per_m,
            one_way,
        );
        if !directed {
            return false;
        }
        let (now_u, d_u) = self.first_u.both_mut(blocks);
        let (now_v, d_v) = self.first_v.both_mut(blocks);
        let (guard, d_guard) = self.first_guard.both_mut(blocks);
        now_u.copy_from_slice(u);
        now_v.copy_from_slice(v);
        kernels::pull(guard, u, v, &self.chain);
        outside.add_n(guard, [u, v]);
        let radiation = friction.law.radiation_kg_per_s();
        if radiation > 0.0 {
            kernels::radiate(guard, v, &self.sigma, radiation);
        }
        let held = Held {
            u,
            v,
            anchor: &state.stick_position_m,
            drag: &self.strength.sliding_friction_n,
            spring: &self.spring,
            sigma: &self.sigma,
            dt,
            dt_over_m,
        };
        kernels::first_difference(d_u, d_v, guard, &held);
        if rigid {
            hold_stuck(&self.sigma, [d_u, d_v]);
        }
        // The second difference includes the constant rates of drive and load.
        kernels::pull(d_guard, d_u, d_v, &self.chain);
        plan.add_change_n(d_guard, [d_u, d_v], outside.advance_m());
        if !self.ramp.is_flat() {
            for ((guard, friction), sigma) in
                d_guard.iter_mut().zip(&friction.dynamic_friction_n).zip(&self.sigma)
            {
                *guard -= self.ramp.change_n(*friction) * sigma;
            }
        }
        if radiation > 0.0 {
            kernels::radiate(d_guard, d_v, &self.sigma, radiation);
        }
        // Not before: many runs of a study have no windows.
        if self.u.all().len() <= self.u.pitch {
            [self.u, self.v, self.guard] = [(); 3].map(|()| Rows::new(blocks, MOST_TERMS + 1));
        }
        let second = Held { u: d_u, v: d_v, ..held };
        let (first_u, first_v) = (&mut self.u.row_mut(0)[..blocks], &mut self.v.row_mut(0)[..blocks]);
        kernels::second_difference(first_u, first_v, d_guard, &second);
        if rigid {
            hold_stuck(&self.sigma, [first_u, first_v]);
        }
        if friction.law.detaches_by_spring() {
            let anchored = now_u.iter().zip(&state.stick_position_m).map(|(u, anchor)| u - anchor);
            let stretches = anchored.zip(&*d_u).zip(&self.spring).zip(&self.sigma);
            for ((guard, d_guard), (((stretch_m, change_m), kt), sigma)) in
                guard.iter_mut().zip(d_guard).zip(stretches)
            {
                if *sigma == 0.0 {
                    (*guard, *d_guard) = (kt * stretch_m, kt * change_m);
                }
            }
        }
        self.applications += 2;
        true
    }

    /// Predicts the steps until the first block switches, by linear extrapolation of forces and
    /// velocities.
    pub(super) fn foreseen_steps(&self) -> f64 {
        let (now, rate) = self.first_guard.both(self.blocks);
        kernels::first_crossing(now, rate, &self.sigma, &self.strength.threshold_n, self.ramp.fall())
    }

    pub(super) fn sizes(&self, plan: &Plan) -> Sizes {
        let sizes = |row: usize| [&self.first_u, &self.first_v].map(|rows| kernels::largest(rows.row(row)));
        let now = sizes(0);
        Sizes {
            now,
            rate: sizes(1),
            first_term: self.size_of_term(0),
            negligible: [NEGLIGIBLE * now[0], NEGLIGIBLE * now[1] * plan.grid.step_s()],
        }
    }

    fn size_of_term(&self, term: usize) -> [f64; 2] {
        [&self.u, &self.v].map(|rows| kernels::largest(rows.row(term)))
    }

    /// Adds terms until the truncation of a window of this length is negligible, at most as many as are
    /// tabulated for the length; returns the sizes of the last term and of the next.
    pub(super) fn take_enough_terms(&mut self, plan: &Plan, index: usize, sizes: &Sizes) -> [[f64; 2]; 2] {
        let length = &self.basis.lengths[index];
        let most = length.terms;
        // As if all terms were as large as the first; mostly they are smaller.
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

    /// Converts springs to the units of terms.
    pub(super) fn scale_springs(&mut self, plan: &Plan) {
        let unit = self.unit_of_terms(plan);
        for (scaled, spring) in self.scaled_spring.iter_mut().zip(&self.spring) {
            *scaled = unit * spring;
        }
        for ((n, drive), spring) in self.driven.iter_mut().zip(&plan.drive.springs) {
            *drive = unit * spring.stiffness_n_per_m;
            self.scaled_spring[*n] += *drive;
        }
    }

    /// Factor from stiffnesses to those units.
    fn unit_of_terms(&self, plan: &Plan) -> f64 {
        let dt = plan.grid.step_s();
        2.0 / self.basis.focus * dt * dt / plan.block_mass_kg
    }

    /// Adds the terms after `w_from` up to `w_to`, and the guards of all but the last.
    pub(super) fn take_terms(&mut self, plan: &Plan, from: usize, to: usize) {
        let blocks = self.blocks;
        let Chebyshev { centre, focus, sigma, .. } = *self.basis;
        let (by, unit) = (2.0 / focus, self.unit_of_terms(plan));
        let chain = &self.chain;
        let springs = Chain {
            stiffness_n_per_m: unit * chain.stiffness_n_per_m,
            damping_kg_per_s: unit * chain.damping_kg_per_s / plan.grid.step_s(),
            ..*chain
        };
        let [first, second] = &mut self.strain;
        let at_ends: Vec<EndBond> = plan
            .end_bonds
            .iter()
            .map(|bond| EndBond {
                stiffness_n_per_m: unit * bond.stiffness_n_per_m,
                damping_kg_per_s: unit * bond.damping_kg_per_s / plan.grid.step_s(),
                ..*bond
            })
            .collect();
        let chain = TermChain {
            spring: &self.scaled_spring,
            sigma: &self.sigma,
            rigid: plan.friction.law.holds(),
            springs,
            radiation: unit * plan.friction.law.radiation_kg_per_s() / plan.grid.step_s(),
            driven: &self.driven,
            at_ends: &at_ends,
            by,
            stay: -by * centre,
            back: -sigma,
        };
        let pitch = self.u.pitch;
        let rows = Terms { u: self.u.all_mut(), v: self.v.all_mut(), guard: self.guard.all_mut(), pitch };
        kernels::terms(rows, [first.with_image(blocks), second.with_image(blocks)], &chain, from..to);
        if plan.friction.law.detaches_by_spring() {
            for term in from..to {
                let guards = self.guard.row_mut(term)[..blocks].iter_mut().zip(self.u.row(term));
                for (((guard, u), kt), sigma) in guards.zip(&self.spring).zip(&self.sigma) {
                    *guard = select_unpredictable(*sigma == 0.0, unit * kt * u, *guard);
                }
            }
        }
        self.terms = to;
        self.applications += (to - from) as u64;
    }

    /// Factors from guards of terms to guards of stuck and of sliding blocks.
    pub(super) fn units(&self, plan: &Plan) -> (f64, f64) {
        let dt = plan.grid.step_s();
        (plan.block_mass_kg / (dt * dt) * self.basis.focus / 2.0, 1.0 / dt)
    }

    /// The sum of a block's displacements over `steps` states from the first on, given the coefficients
    /// of the terms in it.
    pub(super) fn displacement_sum_m(&self, n: usize, steps: u64, coefficients: &[f64]) -> f64 {
        let terms = coefficients.iter().enumerate().rev();
        let of_terms = terms.fold(0.0, |sum, (j, coefficient)| sum + coefficient * self.u.row(j)[n]);
        let (now, rate) = (self.first_u.row(0)[n], self.first_u.row(1)[n]);
        let count = steps as f64;
        count * now + (0.5 * count * (count - 1.0) * rate + of_terms)
    }

    /// The sums of displacements of all blocks over `steps` states.
    pub(super) fn displacement_sums_m(&self, sums_m: &mut [f64], steps: u64, coefficients: &[f64]) {
        kernels::combine(sums_m, self.u.all(), self.u.pitch, coefficients);
        let (now, rate) = self.first_u.both(self.blocks);
        let count = steps as f64;
        for ((sum, now), rate) in sums_m.iter_mut().zip(now).zip(rate) {
            *sum += 0.5 * count * (count - 1.0) * rate + count * now;
        }
    }

    /// Writes displacements and velocities after `steps` steps.
    pub(super) fn compose(&self, plan: &Plan, steps: u64, state: &mut SliderState) {
        let coefficients = &self.basis.double_sum(steps)[..self.terms];
        let parts = [
            (&mut state.displacement_m, &self.first_u, &self.u, 1.0),
            (&mut state.velocity_m_per_s, &self.first_v, &self.v, 1.0 / plan.grid.step_s()),
        ];
        for (values, first, terms, unit) in parts {
            kernels::combine(values, terms.all(), terms.pitch, coefficients);
            let (now, rate) = first.both(self.blocks);
            kernels::add_course(values, now, rate, steps as f64, unit);
        }
    }
}
