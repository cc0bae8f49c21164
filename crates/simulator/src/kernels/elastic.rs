//! The pull between the nodes of a chain.
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
