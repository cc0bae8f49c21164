//! Elementary vector operations: sums, products, largest magnitudes.

use crate::kernels::simd::kernel;

kernel! {
    /// Converts sums of terms to SI, and adds `now` and `steps` times `rate`.
    fn add_course(values: &mut [f64], now: &[f64], rate: &[f64], steps: f64, unit: f64) {
        let (now, rate) = (&now[..values.len()], &rate[..values.len()]);
        for n in 0..values.len() {
            values[n] = now[n] + (steps * rate[n] + unit * values[n]);
        }
    }
}

kernel! {
    /// `to += sum_j factor_j of_j`, from the lowest term up.
    fn add_multiples[V: AsRef<[f64]>](to: &mut [f64], factors: &[f64], of: &[V]) {
        for (factor, of) in factors.iter().zip(of) {
            for (to, of) in to.iter_mut().zip(of.as_ref()) {
                *to += factor * of;
            }
        }
    }
}

/// `sum_j coefficient_j term_j` for `LANES` blocks from `at` on.
#[inline(always)]
fn combined<const LANES: usize>(
    terms: &[f64],
    pitch: usize,
    at: usize,
    coefficients: &[f64],
) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for (j, coefficient) in coefficients.iter().enumerate().rev() {
        let term = &terms[j * pitch + at..][..LANES];
        for lane in 0..LANES {
            sum[lane] += coefficient * term[lane];
        }
    }
    sum
}

kernel! {
    /// `sum_j coefficient_j term_j`, from the highest term down; rows of terms are `pitch` numbers
    /// apart.
    fn combine(sum: &mut [f64], terms: &[f64], pitch: usize, coefficients: &[f64]) {
        let blocks = sum.len();
        let mut at = 0;
        while at + 32 <= blocks {
            sum[at..at + 32].copy_from_slice(&combined::<32>(terms, pitch, at, coefficients));
            at += 32;
        }
        while at < blocks {
            if blocks < 8 {
                sum[at] = combined::<1>(terms, pitch, at, coefficients)[0];
                at += 1;
            } else {
                // The last eight blocks may overlap those before.
                let from = at.min(blocks - 8);
                sum[from..from + 8].copy_from_slice(&combined::<8>(terms, pitch, from, coefficients));
                at += 8;
            }
        }
    }
}

/// The values and bounds of [`follow`] for `LANES` blocks from `at` on.
#[inline(always)]
fn followed<const LANES: usize>(
    values: &mut [f64],
    bounds: &mut [f64],
    terms: &[f64],
    pitch: usize,
    at: usize,
    [value, bound]: [&[f64]; 2],
) {
    let (mut sum, mut magnitude) = ([0.0; LANES], [0.0; LANES]);
    for j in (0..value.len().min(bound.len())).rev() {
        let term = &terms[j * pitch + at..][..LANES];
        for lane in 0..LANES {
            sum[lane] += value[j] * term[lane];
            magnitude[lane] += bound[j] * term[lane].abs();
        }
    }
    values[at..at + LANES].copy_from_slice(&sum);
    bounds[at..at + LANES].copy_from_slice(&magnitude);
}

kernel! {
    /// `sum_j value_j term_j` and `sum_j bound_j |term_j|`, from the highest term down; rows of
    /// terms are `pitch` numbers apart.
    fn follow(values: &mut [f64], bounds: &mut [f64], terms: &[f64], pitch: usize, coefficients: [&[f64]; 2]) {
        let blocks = values.len();
        let mut at = 0;
        while at + 16 <= blocks {
            followed::<16>(values, bounds, terms, pitch, at, coefficients);
            at += 16;
        }
        while at < blocks {
            if blocks < 8 {
                followed::<1>(values, bounds, terms, pitch, at, coefficients);
                at += 1;
            } else {
                followed::<8>(values, bounds, terms, pitch, at.min(blocks - 8), coefficients);
                at += 8;
            }
        }
    }
}

kernel! {
    /// `sum_j a_j x_j` and `sum_j b_j |x_j|`, in four lanes.
    fn products(x: &[f64], a: &[f64], b: &[f64]) -> [f64; 2] {
        let (mut sum, mut magnitude) = ([0.0; 4], [0.0; 4]);
        let count = a.len().min(b.len()).min(x.len());
        let whole = count / 4 * 4;
        for at in (0..whole).step_by(4) {
            let (x, a, b) = (&x[at..at + 4], &a[at..at + 4], &b[at..at + 4]);
            for lane in 0..4 {
                sum[lane] += a[lane] * x[lane];
                magnitude[lane] += b[lane] * x[lane].abs();
            }
        }
        for j in whole..count {
            sum[j - whole] += a[j] * x[j];
            magnitude[j - whole] += b[j] * x[j].abs();
        }
        let total = |lanes: [f64; 4]| (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
        [total(sum), total(magnitude)]
    }
}

kernel! {
    /// The largest magnitude.
    fn largest(values: &[f64]) -> f64 {
        // Independent lanes, which the compiler may keep in one register; the maximum does not depend on the
        // order.
        let mut lanes = [0.0f64; 8];
        let chunks = values.chunks_exact(8);
        let rest = chunks
            .remainder()
            .iter()
            .fold(0.0, |max: f64, value| if value.abs() > max { value.abs() } else { max });
        for chunk in chunks {
            for lane in 0..8 {
                let value = chunk[lane].abs();
                lanes[lane] = if value > lanes[lane] { value } else { lanes[lane] };
            }
        }
        lanes.into_iter().fold(rest, f64::max)
    }
}

kernel! {
    /// Whether all values are finite, by `0 * x = 0`, which fails for infinities and NaN.
    fn are_finite(values: &[f64]) -> bool {
        let (groups, rest) = values.as_chunks::<8>();
        let mut lanes = [0.0; 8];
        for group in groups {
            for lane in 0..8 {
                lanes[lane] += group[lane] * 0.0;
            }
        }
        lanes.iter().sum::<f64>() == 0.0 && rest.iter().all(|value| value.is_finite())
    }
}

kernel! {
    /// Multiplies complex numbers by `1 + growth`.
    fn grow(numbers: [&mut [f64]; 2], growth: [&[f64]; 2]) {
        let count = numbers[0].len();
        let ([x, y], [re, im]) = (numbers.map(|part| &mut part[..count]), growth.map(|part| &part[..count]));
        for e in 0..x.len() {
            (x[e], y[e]) = (x[e] + (x[e] * re[e] - y[e] * im[e]), y[e] + (x[e] * im[e] + y[e] * re[e]));
        }
    }
}

kernel! {
    /// The growth over two intervals one after the other, `(1 + a)(1 + b) - 1`, computed without adding to 1.
    fn compound(numbers: [&mut [f64]; 2], growth: [&[f64]; 2]) {
        let count = numbers[0].len();
        let ([x, y], [re, im]) = (numbers.map(|part| &mut part[..count]), growth.map(|part| &part[..count]));
        for e in 0..x.len() {
            let (a, b) = (x[e] + re[e] + (x[e] * re[e] - y[e] * im[e]), y[e] + im[e] + (x[e] * im[e] + y[e] * re[e]));
            (x[e], y[e]) = (a, b);
        }
    }
}
