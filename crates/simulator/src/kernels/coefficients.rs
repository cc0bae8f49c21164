//! The coefficients of terms ([`crate::leap::chebyshev`]), advanced step by step.

use crate::kernels::simd::kernel;

/// Number of coefficients that are computed.
pub(crate) const FOLLOWED: usize = 64;

/// Coefficients of a number of steps, by term.
#[derive(Debug, Clone)]
pub(crate) struct Coefficients {
    /// `1 + centre`, half the focus, and `sigma`.
    stay: f64,
    half: f64,
    sigma: f64,
    /// `c_j`, and their single, double and triple sums over the steps before.
    pub(crate) now: [f64; FOLLOWED],
    single: [f64; FOLLOWED],
    pub(crate) double: [f64; FOLLOWED],
    pub(crate) triple: [f64; FOLLOWED],
    /// Sums of `|c_j|`, and these summed up once and twice.
    pub(crate) sums: [[f64; FOLLOWED]; 3],
    /// The largest `|c_j|`, over all steps and since it was last reset.
    pub(crate) whole: [f64; FOLLOWED],
    pub(crate) last: [f64; FOLLOWED],
}

impl Coefficients {
    pub(crate) fn of_no_step(centre: f64, focus: f64, sigma: f64) -> Coefficients {
        let zeros = [0.0; FOLLOWED];
        let mut now = zeros;
        now[0] = 1.0;
        Coefficients {
            stay: 1.0 + centre,
            half: focus / 2.0,
            sigma,
            now,
            single: zeros,
            double: zeros,
            triple: zeros,
            sums: [zeros; 3],
            whole: now,
            last: now,
        }
    }
}

kernel! {
    /// Advances by one step: multiplies a sum of terms by `A`, and updates all sums and extremes.
    fn next_coefficients(c: &mut Coefficients) {
        let &mut Coefficients { stay, half, sigma, .. } = c;
        let Coefficients { now, single, double, triple, sums: [first, second, third], whole, last, .. } = c;
        for j in 0..FOLLOWED {
            third[j] += second[j];
            second[j] += first[j];
            first[j] += now[j].abs();
            triple[j] += double[j];
            double[j] += single[j];
            single[j] += now[j];
        }
        // Each with its neighbours, none beyond the ends; `X w_0 = w_1` without the factor one half.
        let mut beside = [0.0; FOLLOWED + 2];
        beside[1..=FOLLOWED].copy_from_slice(now);
        let (mut below, above) = ([0.0; FOLLOWED], &beside[2..]);
        below.copy_from_slice(&beside[..FOLLOWED]);
        below[1] *= 2.0;
        for j in 0..FOLLOWED {
            now[j] = stay * now[j] + half * (below[j] + sigma * above[j]);
            whole[j] = whole[j].max(now[j].abs());
            last[j] = last[j].max(now[j].abs());
        }
    }
}
