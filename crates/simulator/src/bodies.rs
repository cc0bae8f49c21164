//! The bodies that plans can have: each is an arm of [`with_body`].

use asperity_model::Plan;

use crate::body::{ChainBody, LatticeBody, OfPlan};

/// Code to compile for each kind of body.
pub(crate) trait WithBody {
    /// The result.
    type Output;
    /// The work, for the body.
    fn with<B: OfPlan>(self, elastic: &B::Elastic) -> Self::Output;
}

/// Runs the code compiled for the body of a plan.
pub(crate) fn with_body<W: WithBody>(plan: &Plan, what: W) -> W::Output {
    match plan.elastic.as_chain() {
        Some(chain) => what.with::<ChainBody>(&chain),
        None if plan.elastic.tangential_axes() > 1 => what.with::<LatticeBody<2>>(&plan.elastic),
        None => what.with::<LatticeBody>(&plan.elastic),
    }
}
