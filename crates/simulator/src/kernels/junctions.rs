//! The drag and the pull of junctions on all contacts ([`crate::step::junctions`]), and which contacts need a visit.

use std::hint::select_unpredictable;

use crate::kernels::simd::kernel;

/// Contacts before a step: one number for each.
pub(crate) struct Bearing<'a> {
    pub(crate) u: &'a [f64],
    /// `mu_s p`, `mu_d p`, `k_n` and `1 / (N_s k_n)`.
    pub(crate) threshold_n: &'a [f64],
    pub(crate) sliding_friction_n: &'a [f64],
    pub(crate) stiffness_n_per_m: &'a [f64],
    pub(crate) compliance_m_per_n: &'a [f64],
    /// How many junctions share each of the outermost anchors. With a single anchor all are at the low one.
    pub(crate) low_count: &'a [f64],
    pub(crate) high_count: &'a [f64],
    /// The sum of all other anchors.
    pub(crate) other_anchors_m: &'a [f64],
    /// The next anchors of slipping junctions inwards; infinite without.
    pub(crate) above_low_m: &'a [f64],
    pub(crate) below_high_m: &'a [f64],
    /// The outermost anchors of pinned junctions; NaN without.
    pub(crate) pinned_low_m: &'a [f64],
    pub(crate) pinned_high_m: &'a [f64],
    /// The step at whose end the next junction is pinned; infinite without.
    pub(crate) due_step: &'a [f64],
    /// This step, and `1 / N_s`.
    pub(crate) step: f64,
    pub(crate) share: f64,
}

kernel! {
    /// Drags the outermost anchors of slipping junctions; computes the mean of all anchors of each contact, and
    /// the heat of the drag. Marks contacts in which more happens in this step, by 1; returns whether there are
    /// any.
    fn drag(
        low_m: &mut [f64],
        high_m: &mut [f64],
        mean_anchor_m: &mut [f64],
        heat_j: &mut [f64],
        marks: &mut [f64],
        at: &Bearing<'_>,
    ) -> bool {
        let contacts = at.u.len();
        let (low, high, mean_anchor) =
            (&mut low_m[..contacts], &mut high_m[..contacts], &mut mean_anchor_m[..contacts]);
        let (heat, marks) = (&mut heat_j[..contacts], &mut marks[..contacts]);
        let [u, threshold, sliding_friction, stiffness, compliance] = [
            at.u,
            at.threshold_n,
            at.sliding_friction_n,
            at.stiffness_n_per_m,
            at.compliance_m_per_n,
        ]
        .map(|of| &of[..contacts]);
        let [low_count, high_count, others, due_step] =
            [at.low_count, at.high_count, at.other_anchors_m, at.due_step].map(|of| &of[..contacts]);
        let [above_low, below_high, pinned_low, pinned_high] =
            [at.above_low_m, at.below_high_m, at.pinned_low_m, at.pinned_high_m].map(|of| &of[..contacts]);
        let &Bearing { step, share, .. } = at;
        let mut any = 0;
        for n in 0..contacts {
            let (u, k) = (u[n], stiffness[n]);
            let reach = sliding_friction[n] * compliance[n];
            let dragged = |x: f64| x.max(u - reach).min(u + reach);
            let (new_low, new_high) = (dragged(low[n]), dragged(high[n]));
            // Energy of a spring before its anchor moves, less that after.
            let released = |from: f64, to: f64| (to - from) * ((u - from) + (u - to));
            heat[n] = 0.5
                * k
                * (low_count[n] * released(low[n], new_low) + high_count[n] * released(high[n], new_high));
            (low[n], high[n]) = (new_low, new_high);
            let anchors = others[n] + (low_count[n] * new_low + high_count[n] * new_high);
            mean_anchor[n] = anchors * share;
            let strength = threshold[n] * share;
            let breaks =
                (k * (u - pinned_low[n]).abs() >= strength) | (k * (u - pinned_high[n]).abs() >= strength);
            let meets = (new_low >= above_low[n]) | (new_high <= below_high[n]);
            let meets = meets | ((high_count[n] > 0.0) & (new_low >= new_high));
            marks[n] = select_unpredictable(breaks | meets | (due_step[n] <= step), 1.0, 0.0);
            any |= marks[n].to_bits();
        }
        any != 0
    }
}

kernel! {
    /// The friction `K (u - x)` of contacts of stiffness `K` with the mean anchor `x`, and what is left of the
    /// forces from outside.
    fn resist(
        friction_n: &mut [f64],
        outer_n: &mut [f64],
        stiffness_n_per_m: &[f64],
        u: &[f64],
        mean_anchor_m: &[f64],
    ) {
        let contacts = friction_n.len();
        let (outer, stiffness) = (&mut outer_n[..contacts], &stiffness_n_per_m[..contacts]);
        let (u, mean_anchor) = (&u[..contacts], &mean_anchor_m[..contacts]);
        for n in 0..contacts {
            friction_n[n] = stiffness[n] * (u[n] - mean_anchor[n]);
            outer[n] -= friction_n[n];
        }
    }
}

kernel! {
    /// The sum of the heat of contacts, and that of `k_n v v`.
    fn heat_and_stretch(heat_j: &[f64], stiffness_n_per_m: &[f64], v: &[f64]) -> [f64; 2] {
        let contacts = heat_j.len();
        let (stiffness, v) = (&stiffness_n_per_m[..contacts], &v[..contacts]);
        // Lanes: the order of the sums is the same on every machine.
        let mut lanes = [[0.0; 8]; 2];
        let whole = contacts - contacts % 8;
        for at in (0..whole).step_by(8) {
            for lane in 0..8 {
                lanes[0][lane] += heat_j[at + lane];
                lanes[1][lane] += stiffness[at + lane] * v[at + lane] * v[at + lane];
            }
        }
        for n in whole..contacts {
            lanes[0][n - whole] += heat_j[n];
            lanes[1][n - whole] += stiffness[n] * v[n] * v[n];
        }
        lanes.map(|lanes| lanes.into_iter().sum())
    }
}
