//! Sums over the blocks for the energies.
//!
//! Every sum has eight lanes, so its order is the same on every machine.

use std::hint::select_unpredictable;

use asperity_model::body::elastic::Chain;
use asperity_model::law::{ContactLaw, Sliding};

use crate::kernels::simd::kernel;
use crate::kernels::step::Strengths;

/// A completed step.
pub(crate) struct Moved<'a> {
    pub(crate) chain: &'a Chain,
    /// Displacements before the step.
    pub(crate) u: &'a [f64],
    /// Velocities before the step and after it.
    pub(crate) v: &'a [f64],
    pub(crate) v_new: &'a [f64],
    /// Tangential forces without friction in it.
    pub(crate) tau: &'a [f64],
    /// Not 0 for the contacts that slid in it.
    pub(crate) slip: &'a [f64],
    pub(crate) strengths: Strengths<'a>,
    pub(crate) kt: &'a [f64],
    pub(crate) dt: f64,
    pub(crate) mass: f64,
}

/// The work of a step, in terms of its last velocities `v'` and the change of velocity `d = v' - v`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct StepWork {
    /// `sum f_n v'_n` over the sliding contacts, with the friction `f` of the step.
    pub(crate) friction_w: f64,
    /// `v C v'`.
    pub(crate) dampers_w: f64,
    /// `dt^2 v' (K + k_t) v' / 2 - m d d / 2`, without the drive.
    pub(crate) scheme_j: f64,
}

/// Sums over the first `count` elements of arrays of what `parts_of` makes of the numbers of each.
#[inline(always)]
pub(super) fn sums<const ARRAYS: usize, const SUMS: usize>(
    count: usize,
    arrays: [&[f64]; ARRAYS],
    parts_of: impl Fn(usize, [f64; ARRAYS]) -> [f64; SUMS],
) -> [f64; SUMS] {
    let mut sums = [[0.0; 8]; SUMS];
    let arrays = arrays.map(|array| array[..count].as_chunks::<8>());
    for group in 0..count / 8 {
        let lanes = arrays.map(|(groups, _)| &groups[group]);
        for lane in 0..8 {
            let values = parts_of(8 * group + lane, lanes.map(|lanes| lanes[lane]));
            for sum in 0..SUMS {
                sums[sum][lane] += values[sum];
            }
        }
    }
    for lane in 0..count % 8 {
        let values = parts_of(count / 8 * 8 + lane, arrays.map(|(_, rest)| rest[lane]));
        for sum in 0..SUMS {
            sums[sum][lane] += values[sum];
        }
    }
    sums.map(|lanes| total(&lanes))
}

kernel! {
    /// The work of one step; for a law without friction springs, evaluated after stuck blocks have
    /// stopped.
    fn step_work[L: ContactLaw](moved: &Moved<'_>, law: &L) -> StepWork {
        let chain = moved.chain;
        let &Moved { u, v, v_new, tau, slip, strengths, kt, dt, mass, .. } = moved;
        let Strengths { threshold, sliding_friction, .. } = strengths;
        let rubbing = |u: f64, [v, v_new]: [f64; 2], tau: f64, slip: f64, [static_n, friction_n]: [f64; 2], n: usize| {
            let [friction] = law.drag_n(&Sliding {
                displacement_m: [u],
                velocity_m_per_s: [v],
                tangential_force_n: [tau],
                step_over_mass_s_per_kg: dt / mass,
                strength: strengths.of::<1, L>(n, static_n, friction_n),
            });
            select_unpredictable(slip != 0.0, friction * v_new, 0.0)
        };
        let scheme = |v: f64, v_new: f64, slip: f64, kt: f64, bent: f64| {
            let held = select_unpredictable(slip != 0.0, 0.0, 0.5 * kt * v_new * v_new);
            let d = v_new - v;
            dt * dt * (bent + held) - 0.5 * mass * d * d
        };
        let last = v.len() - 1;
        let (v_next, v_new_next) = (&v[1..], &v_new[1..]);
        let [friction_w, dampers_w, scheme_j] = sums(
            last,
            [u, v, v_next, v_new, v_new_next, tau, slip, threshold, sliding_friction, kt],
            |n, [u, v, v_next, v_new, v_new_next, tau, slip, threshold, sliding_friction, kt]| {
                [
                    rubbing(u, [v, v_new], tau, slip, [threshold, sliding_friction], n),
                    chain.bond_loss(v_next - v, v_new_next - v_new),
                    scheme(v, v_new, slip, kt, chain.bond_energy(v_new_next - v_new)),
                ]
            },
        );
        let (velocities, strengths) = ([v[last], v_new[last]], [threshold[last], sliding_friction[last]]);
        StepWork {
            friction_w: friction_w + rubbing(u[last], velocities, tau[last], slip[last], strengths, last),
            dampers_w,
            scheme_j: scheme_j + scheme(v[last], v_new[last], slip[last], kt[last], 0.0),
        }
    }
}

kernel! {
    /// `v v` of a state, and its energy of springs between blocks and friction springs.
    fn stored(chain: &Chain, u: &[f64], v: &[f64], u_stick: &[f64], slip: &[f64], kt: &[f64]) -> [f64; 2] {
        let held = |u: f64, u_stick: f64, slip: f64, kt: f64| {
            select_unpredictable(slip != 0.0, 0.0, 0.5 * kt * (u - u_stick) * (u - u_stick))
        };
        let last = u.len() - 1;
        let u_next = &u[1..];
        let [square, elastic_j] = sums(
            last,
            [u, u_next, v, u_stick, slip, kt],
            |_, [u, u_next, v, u_stick, slip, kt]| [v * v, held(u, u_stick, slip, kt) + chain.bond_energy(u_next - u)],
        );
        [square + v[last] * v[last], elastic_j + held(u[last], u_stick[last], slip[last], kt[last])]
    }
}

/// A state or one of its differences, and how its velocities change in the next step.
pub(crate) struct Changing<'a> {
    pub(crate) chain: &'a Chain,
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

kernel! {
    /// Sums of products of a state and of its change in a step.
    fn forms(state: &Changing<'_>) -> Forms {
        let chain = state.chain;
        let &Changing { u, v, d_v, spring, .. } = state;
        let last = u.len() - 1;
        let (u_next, v_next) = (&u[1..], &v[1..]);
        let held = |spring: f64, u: f64| 0.5 * spring * u * u;
        // Two sums at a time: compilers put the lanes of four in the wrong order.
        let [square, mixed] = sums(last, [v, d_v], |_, [v, d_v]| [v * v, v * d_v]);
        let [loss, elastic] = sums(last, [u, u_next, v, v_next, spring], |_, [u, u_next, v, v_next, spring]| {
            [chain.bond_loss(v_next - v, v_next - v), held(spring, u) + chain.bond_energy(u_next - u)]
        });
        Forms {
            square: square + v[last] * v[last],
            mixed: mixed + v[last] * d_v[last],
            loss,
            elastic: elastic + held(spring[last], u[last]),
        }
    }
}

kernel! {
    /// `v v'` summed over the contacts whose mark is not 0.
    fn sliding_product(mark: &[f64], v: &[f64], v_new: &[f64]) -> f64 {
        let [product] = sums(mark.len(), [mark, v, v_new], |_, [mark, v, v_new]| [
            select_unpredictable(mark != 0.0, v * v_new, 0.0)
        ]);
        product
    }
}

kernel! {
    /// `sum_n sigma_n f_n u_n`.
    fn directed(sigma: &[f64], friction: &[f64], u: &[f64]) -> f64 {
        let [way_j] = sums(u.len(), [sigma, friction, u], |_, [sigma, friction, u]| [sigma * friction * u]);
        way_j
    }
}

/// The sum of eight lanes, in one order.
#[inline(always)]
pub(super) fn total(lanes: &[f64; 8]) -> f64 {
    let four = [lanes[0] + lanes[4], lanes[1] + lanes[5], lanes[2] + lanes[6], lanes[3] + lanes[7]];
    (four[0] + four[2]) + (four[1] + four[3])
}
