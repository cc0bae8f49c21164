//! Sums over the blocks that energies are made of.
//!
//! Every sum is taken in eight lanes, so that its order is the same on every machine.

use std::hint::select_unpredictable;

use asperity_model::Elastic;

use crate::sweep::versions::{Sweeps, dispatch};

impl Sweeps {
    dispatch! {
        /// What one step did, by the laws with friction springs.
        step_work(moved: &Moved<'_>) -> StepWork
    }

    dispatch! {
        /// The same by the laws without, after blocks have stopped.
        rigid_step_work(moved: &Moved<'_>) -> StepWork
    }

    dispatch! {
        /// Energies of a state.
        stored(state: &Stored<'_>) -> StoredEnergy
    }

    dispatch! {
        /// Sums of products of a state and of its change in a step.
        forms(state: &Changing<'_>) -> Forms
    }

    dispatch! {
        /// `sum_n sigma_n f_n u_n`.
        directed(sigma: &[f64], friction: &[f64], u: &[f64]) -> f64
    }
}

/// A step that has been taken.
pub(crate) struct Moved<'a> {
    pub(crate) elastic: &'a Elastic,
    /// Velocities before the step and after it.
    pub(crate) v: &'a [f64],
    pub(crate) v_new: &'a [f64],
    /// Not 0 for the contacts that slid in it.
    pub(crate) slip: &'a [f64],
    pub(crate) sliding_friction: &'a [f64],
    pub(crate) kt: f64,
    pub(crate) weakening: f64,
    pub(crate) radiation: f64,
}

/// What a step did: powers in terms of its last velocities `v'`, the change of velocity
/// `d = v' - v`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepWork {
    /// `sum f_n v'_n` over the sliding contacts, with the friction `f` of the step.
    pub(crate) friction_w: f64,
    /// `v C v'`.
    pub(crate) dampers_w: f64,
    /// `v' (K + k_t) v' / 2`, without the drive, per s^2.
    pub(crate) strain_j_per_s2: f64,
    /// `d d`.
    pub(crate) change: f64,
}

/// Goes over the blocks of arrays, with `$own` for each block and `$bond` for each pair of it and
/// the next. In groups of eight the arrays are cut to the group, so that no index is checked.
macro_rules! over_blocks {
    ($blocks:expr, ($($array:ident),*), |$n:ident, $lane:ident| $own:block, $bond:block) => {
        let mut at = 0;
        while at + 8 < $blocks {
            $(let $array = &$array[at..at + 9];)*
            for $lane in 0..8 {
                let $n = $lane;
                $own
                $bond
            }
            at += 8;
        }
        for $n in at..$blocks {
            let $lane = $n % 8;
            $own
            if $n + 1 < $blocks $bond
        }
    };
}

#[inline(always)]
fn step_work(moved: &Moved<'_>) -> StepWork {
    work_of_step::<false>(moved)
}

#[inline(always)]
fn rigid_step_work(moved: &Moved<'_>) -> StepWork {
    work_of_step::<true>(moved)
}

#[inline(always)]
fn work_of_step<const RIGID: bool>(moved: &Moved<'_>) -> StepWork {
    let Elastic::Chain(chain) = moved.elastic;
    let &Moved { v, v_new, slip, sliding_friction, kt, weakening, radiation, .. } = moved;
    let blocks = v.len();
    let (v_new, slip, sliding_friction) = (&v_new[..blocks], &slip[..blocks], &sliding_friction[..blocks]);
    let (mut friction_w, mut dampers_w, mut strain, mut change) = ([0.0; 8], [0.0; 8], [0.0; 8], [0.0; 8]);
    over_blocks!(
        blocks,
        (v, v_new, slip, sliding_friction),
        |n, lane| {
            let slides = slip[n] != 0.0;
            let drag = select_unpredictable(v[n] == 0.0, 0.0, sliding_friction[n].copysign(v[n]));
            let friction =
                if RIGID { drag / (1.0 + v[n].abs() * weakening) + radiation * v[n] } else { drag };
            friction_w[lane] += select_unpredictable(slides, friction * v_new[n], 0.0);
            let held = 0.5 * kt * v_new[n] * v_new[n];
            strain[lane] += select_unpredictable(slides, 0.0, held);
            let d = v_new[n] - v[n];
            change[lane] += d * d;
        },
        {
            let (dv, dv_new) = (v[n + 1] - v[n], v_new[n + 1] - v_new[n]);
            dampers_w[lane] += chain.bond_loss(dv, dv_new);
            strain[lane] += chain.bond_energy(dv_new);
        }
    );
    StepWork {
        friction_w: total(&friction_w),
        dampers_w: total(&dampers_w),
        strain_j_per_s2: total(&strain),
        change: total(&change),
    }
}

/// A state, for its energies.
pub(crate) struct Stored<'a> {
    pub(crate) elastic: &'a Elastic,
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) u_stick: &'a [f64],
    pub(crate) slip: &'a [f64],
    pub(crate) kt: f64,
}

/// Energies of a state, without the drive's.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StoredEnergy {
    /// `v v`.
    pub(crate) square: f64,
    /// Of springs between blocks and friction springs.
    pub(crate) elastic_j: f64,
}

#[inline(always)]
fn stored(state: &Stored<'_>) -> StoredEnergy {
    let Elastic::Chain(chain) = state.elastic;
    let &Stored { u, v, u_stick, slip, kt, .. } = state;
    let blocks = u.len();
    let (v, u_stick, slip) = (&v[..blocks], &u_stick[..blocks], &slip[..blocks]);
    let (mut square, mut elastic) = ([0.0; 8], [0.0; 8]);
    over_blocks!(
        blocks,
        (u, v, u_stick, slip),
        |n, lane| {
            square[lane] += v[n] * v[n];
            let stretch = u[n] - u_stick[n];
            elastic[lane] += select_unpredictable(slip[n] != 0.0, 0.0, 0.5 * kt * stretch * stretch);
        },
        {
            elastic[lane] += chain.bond_energy(u[n + 1] - u[n]);
        }
    );
    StoredEnergy { square: total(&square), elastic_j: total(&elastic) }
}

/// A state or one of its differences, and how its velocities change in the next step.
pub(crate) struct Changing<'a> {
    pub(crate) elastic: &'a Elastic,
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) d_v: &'a [f64],
    pub(crate) spring: &'a [f64],
}

/// Sums of products, without the drive.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Forms {
    /// `v v`.
    pub(crate) square: f64,
    /// `v d_v`.
    pub(crate) mixed: f64,
    /// `v C v`.
    pub(crate) loss: f64,
    /// `u M u / 2`.
    pub(crate) elastic: f64,
}

#[inline(always)]
fn forms(state: &Changing<'_>) -> Forms {
    let Elastic::Chain(chain) = state.elastic;
    let &Changing { u, v, d_v, spring, .. } = state;
    let blocks = u.len();
    let (v, d_v, spring) = (&v[..blocks], &d_v[..blocks], &spring[..blocks]);
    let (mut square, mut mixed, mut loss, mut elastic) = ([0.0; 8], [0.0; 8], [0.0; 8], [0.0; 8]);
    over_blocks!(
        blocks,
        (u, v, d_v, spring),
        |n, lane| {
            square[lane] += v[n] * v[n];
            mixed[lane] += v[n] * d_v[n];
            elastic[lane] += 0.5 * spring[n] * u[n] * u[n];
        },
        {
            let dv = v[n + 1] - v[n];
            loss[lane] += chain.bond_loss(dv, dv);
            elastic[lane] += chain.bond_energy(u[n + 1] - u[n]);
        }
    );
    Forms { square: total(&square), mixed: total(&mixed), loss: total(&loss), elastic: total(&elastic) }
}

#[inline(always)]
fn directed(sigma: &[f64], friction: &[f64], u: &[f64]) -> f64 {
    let blocks = u.len();
    let (sigma, friction) = (&sigma[..blocks], &friction[..blocks]);
    let mut lanes = [0.0; 8];
    for n in 0..blocks {
        lanes[n % 8] += sigma[n] * friction[n] * u[n];
    }
    total(&lanes)
}

/// The sum of eight lanes, in one order.
#[inline(always)]
fn total(lanes: &[f64; 8]) -> f64 {
    let four = [lanes[0] + lanes[4], lanes[1] + lanes[5], lanes[2] + lanes[6], lanes[3] + lanes[7]];
    (four[0] + four[2]) + (four[1] + four[3])
}
