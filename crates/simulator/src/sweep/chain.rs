//! The chain's springs and dampers: what its nodes pull at each other, and the invariant of
//! that.

use crate::sweep::versions::{Sweeps, dispatch};

impl Sweeps {
    dispatch! {
        /// `tau_n = k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1})`
        /// with free ends (5.6, 5.7).
        pull_of_neighbours(tau: &mut [f64], u: &[f64], v: &[f64], k: f64, eta: f64)
    }

    dispatch! {
        /// The chain's part of `I(u, v)`, with mass, stiffness, damping and time step.
        invariant(spring: &[f64], u: &[f64], v: &[f64], constants: &[f64; 4]) -> f64
    }
}

/// `k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1})`, free ends.
#[inline(always)]
pub(super) fn pull_of_neighbours(tau: &mut [f64], u: &[f64], v: &[f64], k: f64, eta: f64) {
    let last = tau.len() - 1;
    let inner = last.saturating_sub(1);
    let [u_left, u_here, u_right] = [0, 1, 2].map(|from| &u[from..][..inner]);
    let [v_left, v_here, v_right] = [0, 1, 2].map(|from| &v[from..][..inner]);
    let tau_here = &mut tau[1..][..inner];
    for n in 0..inner {
        tau_here[n] =
            k * (u_right[n] - 2.0 * u_here[n] + u_left[n]) + eta * (v_right[n] - 2.0 * v_here[n] + v_left[n]);
    }
    tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]);
    tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
}

#[inline(always)]
fn invariant(spring: &[f64], u: &[f64], v: &[f64], constants: &[f64; 4]) -> f64 {
    let &[mass, k, eta, dt] = constants;
    let blocks = u.len();
    let (v, spring) = (&v[..blocks], &spring[..blocks]);
    macro_rules! own {
        ($u:expr, $v:expr, $spring:expr) => {
            mass * $v * $v + $spring * $u * ($u - dt * $v)
        };
    }
    macro_rules! pair {
        ($du:expr, $dv:expr) => {{
            let (du, dv) = ($du, $dv);
            k * du * (du - dt * dv) - 0.5 * dt * eta * dv * dv
        }};
    }
    // Lanes of their own: the order of the sum is the same on every machine.
    let mut lanes = [0.0; 8];
    let mut at = 0;
    while at + 8 < blocks {
        let (u, next_u) = (&u[at..at + 8], &u[at + 1..at + 9]);
        let (v, next_v) = (&v[at..at + 8], &v[at + 1..at + 9]);
        let spring = &spring[at..at + 8];
        for lane in 0..8 {
            let (u, v) = (u[lane], v[lane]);
            lanes[lane] += own!(u, v, spring[lane]) + pair!(next_u[lane] - u, next_v[lane] - v);
        }
        at += 8;
    }
    for n in at..blocks {
        lanes[n % 8] += own!(u[n], v[n], spring[n]);
        if n + 1 < blocks {
            lanes[n % 8] += pair!(u[n + 1] - u[n], v[n + 1] - v[n]);
        }
    }
    lanes.into_iter().sum()
}
