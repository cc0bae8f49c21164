//! The magnitude of a vector, by which forces are compared with thresholds.

/// The magnitude of a vector: of one number its absolute value, to the bit.
///
/// No `hypot`: a square root is exact to the last bit on every machine, and of the square of one number it
/// is the absolute value, so contacts in a single row have the same magnitudes by either branch.
#[inline(always)]
pub fn magnitude<const D: usize>(vector: [f64; D]) -> f64 {
    if D == 1 { vector[0].abs() } else { vector.iter().map(|x| x * x).sum::<f64>().sqrt() }
}
