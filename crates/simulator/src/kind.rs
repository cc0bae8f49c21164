//! The solvers by name.

use std::sync::Arc;

use asperity_model::{Elastic, Plan};

use crate::fast::{self, ChainLeaps, Fast, LatticeLeaps};
use crate::plain::Plain;
use crate::solver::Solver;
use crate::sweep::Sweeps;

/// The fast solver of a plan: which leaps the body has is registered here.
pub(crate) fn fast(plan: Arc<Plan>, sweeps: Sweeps) -> Box<dyn Solver> {
    match plan.elastic {
        Elastic::Chain(_) => Box::new(Fast::<ChainLeaps>::new(plan, sweeps)),
        Elastic::Lattice(_) => Box::new(Fast::<LatticeLeaps>::new(plan, sweeps)),
    }
}

/// Which solver is to take the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverKind {
    /// The one whose cost follows the switches, and leaps over the steps between them.
    #[default]
    Fast,
    /// [`Plain`], which takes every step.
    Plain,
}

impl SolverKind {
    /// The solver's name in run headers and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            SolverKind::Fast => fast::NAME,
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
            SolverKind::Fast => fast(plan.into(), Sweeps::detect()),
            SolverKind::Plain => Box::new(Plain::new(plan)),
        }
    }
}
