//! The solvers by name.

use std::sync::Arc;

use asperity_model::{Elastic, Plan};

use crate::fast::Fast;
use crate::plain::Plain;
use crate::slab::FastSlab;
use crate::solver::Solver;

/// The fast solver of a plan.
fn fast(plan: Arc<Plan>) -> Box<dyn Solver> {
    match plan.elastic {
        Elastic::Chain(_) => Box::new(Fast::new(plan)),
        Elastic::Lattice(_) => Box::new(FastSlab::new(plan)),
    }
}

/// Which solver is to take the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverKind {
    /// [`Fast`].
    #[default]
    Fast,
    /// [`Plain`].
    Plain,
}

impl SolverKind {
    /// The solver's name in run headers and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            SolverKind::Fast => Fast::NAME,
            SolverKind::Plain => Plain::NAME,
        }
    }

    /// The solver of that name.
    pub fn named(name: &str) -> Option<SolverKind> {
        [SolverKind::Fast, SolverKind::Plain].into_iter().find(|kind| kind.name() == name)
    }

    /// A solver of this kind at the start of a plan.
    pub fn start(self, plan: impl Into<Arc<Plan>>) -> Box<dyn Solver> {
        match self {
            SolverKind::Fast => fast(plan.into()),
            SolverKind::Plain => Box::new(Plain::new(plan)),
        }
    }
}
