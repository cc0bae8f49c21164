//! Guards: how far each block stays from switching, and when the first would.

use std::hint::select_unpredictable;

use crate::kernels::simd::{kernel, sign};
use crate::leap::norms::ROUNDING;

/// Reserve of the bounds for truncation and rounding, for one length of window: of forces of stuck
/// blocks and velocities of sliding ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reserve {
    /// Added to second differences.
    pub(crate) stuck_bend: f64,
    pub(crate) sliding_bend: f64,
    /// Distance to be kept from the limit.
    pub(crate) stuck: f64,
    pub(crate) sliding: f64,
}

/// Guards over a window.
pub(crate) struct Course<'a> {
    pub(crate) now: &'a [f64],
    pub(crate) rate: &'a [f64],
    /// Contribution of the window's last step, besides the value at the start and the rate.
    pub(crate) sum: &'a [f64],
    /// Bound on second differences.
    pub(crate) bend: &'a [f64],
    /// Units of these two, for stuck and for sliding blocks.
    pub(crate) stuck_unit: f64,
    pub(crate) sliding_unit: f64,
    pub(crate) sigma: &'a [f64],
    /// Thresholds at the start, and their ratio at the end to that.
    pub(crate) threshold: &'a [f64],
    pub(crate) decline: f64,
    pub(crate) steps: f64,
    pub(crate) reserve: &'a Reserve,
}

/// How far a guard stays from its limit between `from` and `to`, by the better of two bounds: from the
/// chord, and from the tangent, which ends at `tangent`. The threshold changes linearly from the first
/// to the second.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "numbers of one block, in registers")]
pub(crate) fn margin(
    from: f64,
    to: f64,
    tangent: f64,
    steps: f64,
    bend: f64,
    sigma: f64,
    [threshold, last_threshold]: [f64; 2],
    reserve: &Reserve,
) -> f64 {
    let stuck = sigma == 0.0;
    let more_bend = select_unpredictable(stuck, reserve.stuck_bend, reserve.sliding_bend);
    let limit = select_unpredictable(stuck, -reserve.stuck, -reserve.sliding);
    let (first, last) = ((1.0 - ROUNDING) * threshold, (1.0 - ROUNDING) * last_threshold);
    // Distance from the limit without the reserve: the missing force of a stuck block, the velocity of a
    // sliding one.
    macro_rules! clear {
        ($limit:expr, $guard:expr) => {
            select_unpredictable(stuck, $limit - $guard.abs(), sigma * $guard)
        };
    }
    let sag = (bend + more_bend) * steps * steps / 8.0;
    let (start, end) = (clear!(first, from), clear!(last, to));
    let straight = clear!(last, tangent) - 4.0 * sag;
    let chord = if start < end { start } else { end } - sag;
    let tangent = if start < straight { start } else { straight };
    limit + if tangent > chord { tangent } else { chord }
}

kernel! {
    /// How far each block stays from switching over a window; returns whether the bounds fail to
    /// exclude a switch of any block.
    fn margins(kept: &mut [f64], course: &Course<'_>) -> bool {
        let blocks = kept.len();
        let &Course { now, rate, sum, bend, stuck_unit, sliding_unit, sigma, threshold, decline, steps, reserve } =
            course;
        let (now, rate, sum, bend) = (&now[..blocks], &rate[..blocks], &sum[..blocks], &bend[..blocks]);
        let (sigma, threshold) = (&sigma[..blocks], &threshold[..blocks]);
        let mut any = 0u64;
        for n in 0..blocks {
            let tangent = now[n] + steps * rate[n];
            let unit = select_unpredictable(sigma[n] == 0.0, stuck_unit, sliding_unit);
            let (end, bend) = (tangent + unit * sum[n], unit * bend[n]);
            let thresholds = [threshold[n], threshold[n] * decline];
            let margin = margin(now[n], end, tangent, steps, bend, sigma[n], thresholds, reserve);
            kept[n] = margin;
            // Written so that NaN counts as a possible switch.
            let stays = margin > 0.0;
            any |= u64::from(!stays);
        }
        any != 0
    }
}

kernel! {
    /// Steps until the first guard would reach its limit at its present rate, from the thresholds of stuck blocks and
    /// their relative decrease in a step.
    fn first_crossing(now: &[f64], rate: &[f64], sigma: &[f64], limit: &[f64], decline: f64) -> f64 {
        let blocks = now.len();
        let (rate, sigma, limit) = (&rate[..blocks], &sigma[..blocks], &limit[..blocks]);
        let mut first = NEVER;
        for n in 0..blocks {
            first = first.min(crossing(now[n], rate[n], sigma[n], limit[n], decline));
        }
        f64::from_bits(first as u64)
    }
}

kernel! {
    /// Steps until the first guard would reach its limit, from the forces and velocities of two
    /// steps, the last first; thresholds fall by the share `decline` in each step.
    fn crossing_ahead(
        taus: [&[f64]; 2],
        velocities: [&[f64]; 2],
        slip: &[f64],
        threshold: &[f64],
        decline: f64,
    ) -> f64 {
        let blocks = slip.len();
        let [tau, tau_before] = taus.map(|tau| &tau[..blocks]);
        let [v, v_before] = velocities.map(|v| &v[..blocks]);
        let threshold = &threshold[..blocks];
        let mut first = NEVER;
        for n in 0..blocks {
            let stuck = slip[n] == 0.0;
            let now = select_unpredictable(stuck, tau[n], v[n]);
            let rate = now - select_unpredictable(stuck, tau_before[n], v_before[n]);
            first = first.min(crossing(now, rate, slip[n] * sign(v[n]), threshold[n], decline));
        }
        f64::from_bits(first as u64)
    }
}

/// The bits of infinity.
const NEVER: i64 = f64::INFINITY.to_bits() as i64;

/// Steps until one guard would reach its limit, as the bits of a double. Bits sort like the numbers,
/// except among negative ones, and the minimum of integers is vectorised.
#[inline(always)]
fn crossing(now: f64, rate: f64, sigma: f64, limit: f64, decline: f64) -> i64 {
    let stuck = sigma == 0.0;
    // A falling threshold may be reached on either side.
    let by_rate = select_unpredictable(rate > 0.0, now, -now);
    let towards = select_unpredictable(decline == 0.0, by_rate, now.abs());
    let room = select_unpredictable(stuck, limit - towards, sigma * now);
    let closing = select_unpredictable(stuck, rate.abs() + limit * decline, -sigma * rate);
    select_unpredictable(closing > 0.0, room / closing, f64::INFINITY).to_bits() as i64
}
