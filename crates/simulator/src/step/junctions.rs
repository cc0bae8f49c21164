//! Contacts of many junctions ([`asperity_model::law::junctions`], docs/contacts.md): a step.
//!
//! A step, everything from the old state unless stated otherwise:
//!
//! 1. the anchor of every slipping junction is dragged to within `d = mu_d p / (N_s k_n)` of `u`;
//! 2. friction is `-k_n (N_s u - A)`, `A` the sum of all anchors;
//! 3. a pinned junction with `k_n |u - x_j| >= mu_s p / N_s` breaks: `x_j = u - d sign(u - x_j)`, and it slips for
//!    a drawn number of steps from the next one on;
//! 4. the body moves;
//! 5. junctions whose last step of slip this is are pinned at the new position, unless the contact bore nothing.
//!
//! Each move of an anchor lowers the energy `k_n / 2 (u - x_j)^2`; that is the friction heat. A contact slides
//! from the step after one that leaves at least the given share of its junctions slipping.
//!
//! **Visits.** In most steps of a contact no junction breaks or is pinned. Only slipping junctions move then,
//! and of these only the ones with the outermost anchors: the drag moves an inner anchor only after an outer one has
//! reached it. So a kernel goes over all contacts with the two outermost anchors and the sum of the others
//! ([`crate::kernels`]), and [`JunctionLoops`] visits the junctions of those contacts alone in which more
//! happens. Each visit adds that sum up again, so the state follows from anchors and timers alone.

use asperity_model::{JunctionState, Junctions, Plan};

use crate::kernels::{self, Bearing};
use crate::step::strength::Strength;

/// Takes the steps of all contacts.
#[derive(Debug, Clone)]
pub(crate) struct JunctionLoops {
    law: Junctions,
    step_s: f64,
    /// `N_s k_n`, `k_n` and `1 / (N_s k_n)`.
    contact_stiffness_n_per_m: Vec<f64>,
    stiffness_n_per_m: Vec<f64>,
    compliance_m_per_n: Vec<f64>,
    share: f64,
    /// In this step: friction against each contact, heat of the drag, contacts that are visited, and what breaks
    /// add to the sum of their anchors.
    pub(crate) friction_n: Vec<f64>,
    heat_j: Vec<f64>,
    marks: Vec<f64>,
    visited: Vec<(usize, f64)>,
    /// Heat of visits, J.
    visits_j: f64,
}

impl JunctionLoops {
    /// For the contacts of a plan; `None` by laws without junctions.
    pub(crate) fn of(plan: &Plan) -> Option<JunctionLoops> {
        let law = plan.friction.law.junctions()?;
        let zeros = || vec![0.0; plan.blocks];
        let stiffnesses = || plan.friction.contact_stiffness_n_per_m.iter();
        Some(JunctionLoops {
            law,
            step_s: plan.grid.step_s(),
            contact_stiffness_n_per_m: stiffnesses().copied().collect(),
            stiffness_n_per_m: stiffnesses().map(|stiffness| stiffness / law.count as f64).collect(),
            compliance_m_per_n: stiffnesses().map(|stiffness| 1.0 / stiffness).collect(),
            share: 1.0 / law.count as f64,
            friction_n: zeros(),
            heat_j: zeros(),
            marks: zeros(),
            visited: Vec::new(),
            visits_j: 0.0,
        })
    }

    /// Items 1 to 3 of a step: [`JunctionLoops::friction_n`], which is taken from the forces from outside, and the
    /// mean anchors.
    pub(crate) fn pull(
        &mut self,
        state: &mut JunctionState,
        mean_anchor_m: &mut [f64],
        outer_n: &mut [f64],
        strength: &Strength,
        (step, u): (u64, &[f64]),
    ) {
        // The contacts are the first of all freedoms.
        let u = &u[..mean_anchor_m.len()];
        state.kept.totals_before = state.kept.totals;
        let contacts = &mut state.contacts;
        let bearing = Bearing {
            u,
            threshold_n: &strength.threshold_n,
            sliding_friction_n: &strength.sliding_friction_n,
            stiffness_n_per_m: &self.stiffness_n_per_m,
            compliance_m_per_n: &self.compliance_m_per_n,
            low_count: &contacts.low_count,
            high_count: &contacts.high_count,
            other_anchors_m: &contacts.other_anchors_m,
            above_low_m: &contacts.above_low_m,
            below_high_m: &contacts.below_high_m,
            pinned_low_m: &contacts.pinned_low_m,
            pinned_high_m: &contacts.pinned_high_m,
            due_step: &contacts.due_step,
            step: step as f64,
            share: self.share,
        };
        let (low_m, high_m) = (&mut contacts.low_m, &mut contacts.high_m);
        let any = kernels::drag(low_m, high_m, mean_anchor_m, &mut self.heat_j, &mut self.marks, &bearing);
        self.visits_j = 0.0;
        self.visited.clear();
        if any {
            for (n, mean_anchor_m) in mean_anchor_m.iter_mut().enumerate() {
                if self.marks[n] != 0.0 {
                    *mean_anchor_m = self.visit(state, n, strength, (step, u));
                }
            }
        }
        let friction_n = &mut self.friction_n;
        kernels::resist(friction_n, outer_n, &self.contact_stiffness_n_per_m, u, mean_anchor_m);
    }

    /// Items 1 to 3 for all junctions of a contact, of which the outermost are dragged already; returns the mean of
    /// their anchors before any breaks.
    fn visit(
        &mut self,
        state: &mut JunctionState,
        n: usize,
        strength: &Strength,
        (step, u): (u64, &[f64]),
    ) -> f64 {
        state.refresh(n);
        let (law, k, u) = (self.law, self.stiffness_n_per_m[n], u[n]);
        let reach = strength.sliding_friction_n[n] * self.compliance_m_per_n[n];
        let strength = strength.threshold_n[n] * self.share;
        let released_j = |from: f64, to: f64| 0.5 * k * (to - from) * ((u - from) + (u - to));
        let all = n * law.count..(n + 1) * law.count;
        for j in all.clone() {
            if state.kept.slips_until_step[j] != 0 {
                let from = state.kept.anchor_m[j];
                state.kept.anchor_m[j] = from.max(u - reach).min(u + reach);
                self.visits_j += released_j(from, state.kept.anchor_m[j]);
            }
        }
        let anchors: f64 = state.kept.anchor_m[all.clone()].iter().sum();
        let mut broken_m = 0.0;
        for j in all.clone() {
            let stretch = u - state.kept.anchor_m[j];
            if state.kept.slips_until_step[j] == 0 && k * stretch.abs() >= strength {
                let to = if stretch == 0.0 { u } else { u - reach.copysign(stretch) };
                self.visits_j += released_j(state.kept.anchor_m[j], to);
                broken_m += to - state.kept.anchor_m[j];
                state.kept.anchor_m[j] = to;
                state.kept.breaks[j] += 1;
                state.kept.totals.breaks += 1;
                let steps = law.slip_steps(n, j - all.start, state.kept.breaks[j], self.step_s);
                // A time that is longer than any run saturates.
                state.kept.slips_until_step[j] = step.saturating_add(steps);
            }
        }
        self.visited.push((n, broken_m));
        anchors * self.share
    }

    /// Item 5, after the motion: marks the contacts that begin or cease to slide, and returns whether any does.
    pub(crate) fn repin(
        &mut self,
        state: &mut JunctionState,
        mean_anchor_m: &mut [f64],
        slip: &[f64],
        strength: &Strength,
        (step, u): (u64, &[f64]),
    ) -> bool {
        let mut any = false;
        for &(n, _) in &self.visited {
            let (k, u) = (self.stiffness_n_per_m[n], u[n]);
            let of = n * self.law.count..(n + 1) * self.law.count;
            // Without load all junctions slip, however long.
            let bears = strength.threshold_n[n] > 0.0 || strength.sliding_friction_n[n] > 0.0;
            for j in of.clone() {
                let until = state.kept.slips_until_step[j];
                if bears && until != 0 && until <= step {
                    let stretch = u - state.kept.anchor_m[j];
                    self.visits_j += 0.5 * k * stretch * stretch;
                    state.kept.anchor_m[j] = u;
                    state.kept.slips_until_step[j] = 0;
                    state.kept.totals.repins += 1;
                }
            }
            state.summarize(n);
            mean_anchor_m[n] = state.kept.anchor_m[of].iter().sum::<f64>() * self.share;
            any |= self.law.slides(state.slipping(n)) != (slip[n] != 0.0);
        }
        any
    }

    /// Sets the bit of every contact that begins or ceases to slide.
    pub(crate) fn mark_switches(&self, state: &JunctionState, slip: &[f64], marks: &mut [u64]) {
        marks.fill(0);
        for &(n, _) in &self.visited {
            let switches = self.law.slides(state.slipping(n)) != (slip[n] != 0.0);
            marks[n / 64] |= u64::from(switches) << (n % 64);
        }
    }

    /// Friction heat of the step, and the energy that the time step adds at the contacts, whose springs keep their
    /// pull during the motion, J; given the new velocities. A junction that breaks keeps its anchor during the
    /// motion.
    pub(crate) fn heat_and_scheme_j(&self, velocity_m_per_s: &[f64]) -> [f64; 2] {
        let (dt, k) = (self.step_s, &self.stiffness_n_per_m);
        let [dragged_j, stretch] = kernels::heat_and_stretch(&self.heat_j, k, velocity_m_per_s);
        let broken = self.visited.iter();
        let broken_j: f64 = broken.map(|(n, moved_m)| k[*n] * moved_m * dt * velocity_m_per_s[*n]).sum();
        [dragged_j + (self.visits_j + broken_j), 0.5 * self.law.count as f64 * dt * dt * stretch]
    }
}

#[cfg(test)]
mod tests;
