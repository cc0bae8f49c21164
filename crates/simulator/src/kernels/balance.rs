//! The velocities under rate-and-state friction at which stresses balance without inertia, node by node.

use std::hint::select_unpredictable;

use crate::kernels::energy::sums;
use crate::kernels::simd::kernel;

/// Nodes whose iterations run side by side.
const GROUP: usize = 32;

/// Change of `y` from which on Newton's method is done, as its error is the square.
const DONE: f64 = 1e-8;

/// Most iterations; some ten are needed.
const MOST_ITERATIONS: usize = 100;

/// Largest argument of [`exp`].
const LARGEST: f64 = 708.0;

/// `1 / k!`, from 1 on.
const OVER_FACTORIALS: [f64; 13] = {
    let (mut values, mut k) = ([1.0; 13], 1);
    while k < values.len() {
        values[k] = values[k - 1] / (k + 1) as f64;
        k += 1;
    }
    values
};

/// Rate-and-state friction of nodes.
#[derive(Debug, Clone)]
pub(crate) struct NodeFriction {
    /// `sigma a`.
    pub(crate) direct_pa: Vec<f64>,
    /// `f_0 / a` and `b / a`: `psi / a` is `f_0 / a + (b / a) phi`.
    pub(crate) state_over_a: [Vec<f64>; 2],
    /// `V_0`.
    pub(crate) reference_m_per_s: f64,
    /// `eta`.
    pub(crate) radiation_pa_s_per_m: f64,
}

/// `e^x` within two units in the last place; NaN beyond [`LARGEST`]. In steps of `ln 2`, between which Taylor's series
/// serves, as the same operations in any vectors.
#[inline(always)]
fn exp(x: f64) -> f64 {
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    /// Added to a number, it leaves the nearest integer in its last digits.
    const INTEGERS: f64 = 6_755_399_441_055_744.0;
    let shifted = x * std::f64::consts::LOG2_E + INTEGERS;
    let whole = shifted - INTEGERS;
    let r = (x - whole * LN_2_HIGH) - whole * LN_2_LOW;
    let (square, mut odd, mut even) = (r * r, OVER_FACTORIALS[12], 0.0);
    for k in (0..6).rev() {
        odd = odd * square + OVER_FACTORIALS[2 * k];
        even = even * square + OVER_FACTORIALS[2 * k + 1];
    }
    let power = f64::from_bits((shifted.to_bits().wrapping_add(1023)) << 52);
    select_unpredictable(x.abs() <= LARGEST, (1.0 + (r * odd + square * even)) * power, f64::NAN)
}

/// A group of numbers, filled up with 1.
#[inline(always)]
fn group(of: &[f64], at: usize) -> [f64; GROUP] {
    let mut group = [1.0; GROUP];
    let count = (of.len() - at).min(GROUP);
    group[..count].copy_from_slice(&of[at..at + count]);
    group
}

kernel! {
    /// `V` with `|T| = sigma a y + eta V`, `V = q (e^y - e^-y)`, `q = V_0 e^(-psi / a)`, and the sign of `T`; and
    /// `dV / dT`. By Newton's method from above, where the left side is convex, from the smaller of two bounds: all of
    /// the stress is friction, or radiation. Each node ends for itself, so that none depends on its group.
    fn velocities(found: [&mut [f64]; 2], first: usize, stress: &[f64], state: &[f64], friction: &NodeFriction) {
        let ([velocity, slope], eta) = (found, friction.radiation_pa_s_per_m);
        for at in (0..stress.len()).step_by(GROUP) {
            let (signed, phi) = (group(stress, at), group(state, at));
            let direct = group(&friction.direct_pa, first + at);
            let [offset, ratio] = friction.state_over_a.each_ref().map(|of| group(of, first + at));
            let ([mut q, mut t, mut y, mut e, mut last], mut left) = ([[0.0; GROUP]; 5], [0; GROUP]);
            for n in 0..GROUP {
                q[n] = friction.reference_m_per_s * exp(-(offset[n] + ratio[n] * phi[n]));
                t[n] = signed[n].abs();
                y[n] = t[n] / direct[n];
                e[n] = exp(y[n]);
                // NaN, of what is too large for `exp`, radiates as well.
                left[n] = u64::from(y[n] > 1.0) & (1 - u64::from(eta * q[n] * e[n] <= 0.01 * t[n]));
            }
            for n in (0..GROUP).filter(|n| left[*n] != 0) {
                y[n] = y[n].min(libm::asinh(t[n] / (2.0 * eta * q[n])));
                e[n] = exp(y[n]);
            }
            left.fill(1);
            for _ in 0..MOST_ITERATIONS {
                let mut any = 0;
                for n in 0..GROUP {
                    let (less, radiated) = (1.0 / e[n], eta * q[n]);
                    let excess = direct[n] * y[n] + radiated * (e[n] - less) - t[n];
                    let change = excess / (direct[n] + radiated * (e[n] + less));
                    y[n] -= change;
                    // At the new `y`: the next term is below rounding where this is the last one.
                    let next = e[n] * (1.0 - change * (1.0 - 0.5 * change));
                    last[n] = select_unpredictable(left[n] != 0, next, last[n]);
                    left[n] &= u64::from(change.abs() >= DONE);
                    any |= left[n];
                }
                if any == 0 {
                    break;
                }
                e = y.map(exp);
            }
            for n in 0..GROUP.min(stress.len() - at) {
                let less = 1.0 / last[n];
                let by_y = q[n] * (last[n] + less);
                velocity[at + n] = (q[n] * (last[n] - less)).copysign(signed[n]);
                slope[at + n] = by_y / (direct[n] + eta * by_y);
            }
        }
    }
}

kernel! {
    /// `phi' = (V_0 e^-phi - |V|) / D_c`, the ageing law.
    fn age(rate: &mut [f64], state: &[f64], velocity: &[f64], slip_m: &[f64], reference_m_per_s: f64) {
        let count = rate.len();
        let (state, velocity, slip_m) = (&state[..count], &velocity[..count], &slip_m[..count]);
        for n in 0..count {
            rate[n] = (reference_m_per_s * exp(-state[n]) - velocity[n].abs()) / slip_m[n];
        }
    }
}

kernel! {
    /// The powers `sum c [T V_p + tau_0 (V - V_p)]` of the drive, `sum c (T - eta V) V` of friction and `sum c eta V^2` of
    /// waves, over `dz`, of stresses, velocities, prestresses and weights.
    fn powers(of: [&[f64]; 4], drive_m_per_s: f64, radiation_pa_s_per_m: f64) -> [f64; 3] {
        sums(of[0].len(), of, |_, [stress, v, prestress, weight]| {
            let radiated = radiation_pa_s_per_m * v;
            [
                weight * (stress * drive_m_per_s + prestress * (v - drive_m_per_s)),
                weight * ((stress - radiated) * v),
                weight * (radiated * v),
            ]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{NodeFriction, exp, velocities};
    use crate::kernels::by_all;

    #[test]
    fn exponentials_are_exact_to_rounding() {
        for k in -7000..7000 {
            let x = f64::from(k) * 0.101_3;
            let off = (exp(x) / libm::exp(x) - 1.0).abs();
            assert!(off <= 2.0 * f64::EPSILON || x.abs() > 708.0, "{x}: {off}");
        }
        assert!(exp(710.0).is_nan() && exp(-709.0).is_nan() && exp(0.0) == 1.0);
    }

    /// From creep to slip, forwards and backwards, for any number of nodes.
    #[test]
    fn velocities_balance_the_stress_alike_on_every_instruction_set_and_in_every_group() {
        let count = 77;
        let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { (0..count).map(|n| f(f64::from(n))).collect() };
        let stress = of(&|n| (26e6 + 1.5e6 * (3.0 * n).sin()) * if n > 70.0 { -1.0 } else { 1.0 });
        let state = of(&|n| -18.0 + 0.4 * n);
        let (direct, offset, ratio) = (of(&|n| 5e5 + 1e4 * n), of(&|n| 60.0 - 0.3 * n), of(&|_| 1.5));
        let (v0, eta) = (1e-6, 4.62444e6);
        let friction = NodeFriction {
            direct_pa: direct.clone(),
            state_over_a: [offset.clone(), ratio.clone()],
            reference_m_per_s: v0,
            radiation_pa_s_per_m: eta,
        };
        let compute = |from: usize| {
            let (mut v, mut slope) = (vec![0.0; stress.len() - from], vec![0.0; stress.len() - from]);
            velocities([&mut v, &mut slope], from, &stress[from..], &state[from..], &friction);
            (v, slope)
        };
        let (v, slope) = by_all(|| compute(0));
        assert_eq!(compute(13).0, v[13..]);
        let (slowest, fastest) =
            v.iter().fold((1.0_f64, 0.0_f64), |(low, high), v| (low.min(v.abs()), high.max(v.abs())));
        assert!(slowest < 1e-12 && fastest > 0.1, "{slowest} {fastest}");
        for n in 0..stress.len() {
            let l = (v[n].abs() / (2.0 * v0)).ln() + offset[n] + ratio[n] * state[n];
            let friction = direct[n] * asperity_model::law::rate_and_state::asinh_of_exp(l);
            let found = (friction + eta * v[n].abs()).copysign(v[n]);
            assert!((found / stress[n] - 1.0).abs() < 1e-14, "{n}: {found} {}", stress[n]);
            let rise =
                direct[n] * friction.signum() / (v[n].abs() * 1.0_f64.max((friction / direct[n]).tanh()));
            assert!((slope[n] * (rise * (friction / direct[n]).tanh() + eta) - 1.0).abs() < 1e-12, "{n}");
        }
    }
}
