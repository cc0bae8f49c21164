//! What one block does to others, step by step.

use crate::sweep::versions::{Sweeps, dispatch};

/// A long chain in which every block sticks, from its middle on, which mirrors the other half: what has
/// become of it since its middle was pushed.
#[derive(Debug, Clone)]
pub(crate) struct Impulse {
    /// `dt^2 k / m`, `dt eta / m` and `dt^2 k_t / m`.
    pub(crate) spring: f64,
    pub(crate) damper: f64,
    pub(crate) held: f64,
    /// Displacements, ways in the last step, and the largest of both up to now.
    pub(crate) u: Vec<f64>,
    pub(crate) way: Vec<f64>,
    pub(crate) most: Vec<f64>,
    /// Room for the next step.
    pub(crate) next: Vec<f64>,
}

impl Sweeps {
    dispatch! {
        /// The next step, up to a block that is not the last.
        push_on(impulse: &mut Impulse, front: usize)
    }
}

#[inline(always)]
fn push_on(impulse: &mut Impulse, front: usize) {
    let Impulse { spring, damper, held, u, way, most, next } = impulse;
    let (spring, damper, held) = (*spring, *damper, *held);
    let to = front + 1;
    next[0] = way[0] + 2.0 * (spring * (u[1] - u[0]) + damper * (way[1] - way[0])) - held * u[0];
    {
        let (u_below, u_at, u_above) = (&u[..front], &u[1..to], &u[2..to + 1]);
        let (way_below, way_at, way_above) = (&way[..front], &way[1..to], &way[2..to + 1]);
        let next = &mut next[1..to];
        for n in 0..front {
            let bend_u = (u_below[n] - u_at[n]) + (u_above[n] - u_at[n]);
            let bend_way = (way_below[n] - way_at[n]) + (way_above[n] - way_at[n]);
            next[n] = way_at[n] + spring * bend_u + damper * bend_way - held * u_at[n];
        }
    }
    let (u, next, most) = (&mut u[..to], &next[..to], &mut most[..to]);
    for n in 0..to {
        u[n] += next[n];
        let (size, way) = (u[n].abs(), next[n].abs());
        let larger = if way > size { way } else { size };
        most[n] = if larger > most[n] { larger } else { most[n] };
    }
    std::mem::swap(&mut impulse.way, &mut impulse.next);
}
