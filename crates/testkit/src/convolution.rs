//! The stress on a fault line by its definition.

/// The stress at every node, Pa, of slips, m, each a sum over all nodes and their mirror images at a free surface.
/// `lags` has the stress per slip by distance in nodes, Pa/m: twice as many as nodes.
pub fn mirrored_convolution(lags: &[f64], slip_m: &[f64], stress_pa: &mut [f64]) {
    let product =
        |lags: &[f64], slip_m: &[f64]| lags.iter().zip(slip_m).map(|(lag, slip)| lag * slip).sum::<f64>();
    for (i, stress) in stress_pa.iter_mut().enumerate() {
        let before: f64 = lags[..=i].iter().rev().zip(slip_m).map(|(lag, slip)| lag * slip).sum();
        *stress = before + product(&lags[1..], &slip_m[i + 1..]) + product(&lags[i + 1..], &slip_m[1..]);
    }
}
