//! The bodies that plans can have: each is an arm of [`with_body`].

use asperity_model::{Elastic, Plan};

use crate::body::{ChainBody, LatticeBody, OfPlan};

/// What is to be compiled for each body.
pub(crate) trait WithBody {
    /// What it gives.
    type Output;
    /// The work, for the body.
    fn with<B: OfPlan>(self, elastic: &B::Elastic) -> Self::Output;
}

/// Does what is compiled for each body with that of a plan.
pub(crate) fn with_body<W: WithBody>(plan: &Plan, what: W) -> W::Output {
    match &plan.elastic {
        Elastic::Chain(chain) => what.with::<ChainBody>(chain),
        Elastic::Lattice(lattice) => what.with::<LatticeBody>(lattice),
    }
}
