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
    pub(crate) dt: f64,
    pub(crate) mass: f64,
}

/// What a step did, in terms of its last velocities `v'` and the change of velocity `d = v' - v`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepWork {
    /// `sum f_n v'_n` over the sliding contacts, with the friction `f` of the step.
    pub(crate) friction_w: f64,
    /// `v C v'`.
    pub(crate) dampers_w: f64,
    /// `dt^2 v' (K + k_t) v' / 2 - m d d / 2`, without the drive.
    pub(crate) scheme_j: f64,
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

/// Blocks whose parts of the sums are laid out at a time: a loop that does so is one that compilers
/// turn into vector instructions, and one that adds them up on the way is not.
const PANEL: usize = 64;

#[inline(always)]
fn work_of_step<const RIGID: bool>(moved: &Moved<'_>) -> StepWork {
    let Elastic::Chain(chain) = moved.elastic;
    let &Moved { v, v_new, slip, sliding_friction, kt, weakening, radiation, .. } = moved;
    let &Moved { dt, mass, .. } = moved;
    let rubbing = |v: f64, v_new: f64, slip: f64, sliding_friction: f64| {
        let drag = select_unpredictable(v == 0.0, 0.0, sliding_friction.copysign(v));
        let friction = if RIGID { drag / (1.0 + v.abs() * weakening) + radiation * v } else { drag };
        select_unpredictable(slip != 0.0, friction * v_new, 0.0)
    };
    let scheme = |v: f64, v_new: f64, slip: f64| {
        let held = select_unpredictable(slip != 0.0, 0.0, 0.5 * kt * v_new * v_new);
        (dt * dt * held, 0.5 * mass * (v_new - v) * (v_new - v))
    };
    let last = v.len() - 1;
    let mut sums = [[0.0; 8]; 3];
    let mut parts = [[0.0; PANEL]; 3];
    for from in (0..last).step_by(PANEL) {
        let to = last.min(from + PANEL);
        let count = to - from;
        let (v_next, v_new_next) = (&v[from + 1..=to], &v_new[from + 1..=to]);
        let (v, v_new, slip) = (&v[from..to], &v_new[from..to], &slip[from..to]);
        let sliding_friction = &sliding_friction[from..to];
        let [rubbed, damped, schemed] = &mut parts;
        {
            let (rubbed, damped, schemed) =
                (&mut rubbed[..count], &mut damped[..count], &mut schemed[..count]);
            for n in 0..count {
                let (dv, dv_new) = (v_next[n] - v[n], v_new_next[n] - v_new[n]);
                rubbed[n] = rubbing(v[n], v_new[n], slip[n], sliding_friction[n]);
                damped[n] = chain.bond_loss(dv, dv_new);
                let (held, changed) = scheme(v[n], v_new[n], slip[n]);
                schemed[n] = dt * dt * chain.bond_energy(dv_new) + held - changed;
            }
        }
        for (sum, part) in sums.iter_mut().zip(&parts) {
            let (groups, rest) = part[..count].as_chunks::<8>();
            for group in groups {
                for lane in 0..8 {
                    sum[lane] += group[lane];
                }
            }
            for lane in 0..rest.len() {
                sum[lane] += rest[lane];
            }
        }
    }
    let [rubbed, damped, schemed] = sums.map(|sum| total(&sum));
    let (held, changed) = scheme(v[last], v_new[last], slip[last]);
    StepWork {
        friction_w: rubbed + rubbing(v[last], v_new[last], slip[last], sliding_friction[last]),
        dampers_w: damped,
        scheme_j: schemed + (held - changed),
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
