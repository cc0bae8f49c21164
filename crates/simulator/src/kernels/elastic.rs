//! The pull between the nodes of a chain, and the invariant of the scheme.
//!
//! The stencil is defined in [`asperity_model::body::elastic`]; here it is compiled for every instruction set.
//! The kernels that build on these are for chains as well.

use asperity_model::body::elastic::Chain;

use crate::kernels::simd::kernel;

kernel! {
    /// The pull of springs and dashpots on every node (5.6, 5.7), without drive and friction.
    fn pull(tau: &mut [f64], u: &[f64], v: &[f64], chain: &Chain) {
        chain.pull(tau, u, v);
    }
}

kernel! {
    /// The part of `I(u, v)` from springs, dashpots and friction springs, with the mass of a node
    /// and the time step.
    fn invariant(spring: &[f64], u: &[f64], v: &[f64], chain: &Chain, mass: f64, dt: f64) -> f64 {
        let blocks = u.len();
        let (v, spring) = (&v[..blocks], &spring[..blocks]);
        macro_rules! own {
            ($u:expr, $v:expr, $spring:expr) => {
                mass * $v * $v + $spring * $u * ($u - dt * $v)
            };
        }
        // Independent lanes: the order of the sum is the same on every machine.
        let mut lanes = [0.0; 8];
        let mut at = 0;
        while at + 8 < blocks {
            let (u, next_u) = (&u[at..at + 8], &u[at + 1..at + 9]);
            let (v, next_v) = (&v[at..at + 8], &v[at + 1..at + 9]);
            let spring = &spring[at..at + 8];
            for lane in 0..8 {
                let (u, v) = (u[lane], v[lane]);
                let bond = chain.invariant_of_bond(next_u[lane] - u, next_v[lane] - v, dt);
                lanes[lane] += own!(u, v, spring[lane]) + bond;
            }
            at += 8;
        }
        for n in at..blocks {
            lanes[n % 8] += own!(u[n], v[n], spring[n]);
            if n + 1 < blocks {
                lanes[n % 8] += chain.invariant_of_bond(u[n + 1] - u[n], v[n + 1] - v[n], dt);
            }
        }
        lanes.into_iter().sum()
    }
}
