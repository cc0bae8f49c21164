//! The linear part of a step as a map of the state. It depends neither on thresholds and loads nor on
//! the position of the drive point.
//!
//! The polynomials of windows ([`crate::leap::chebyshev`]) and the modes of the stuck chain ([`crate::modes`])
//! depend on this alone, so runs with the same propagator share them ([`crate::modes::operator_cache`]).

use asperity_model::Lattice;
use asperity_model::Plan;
use asperity_model::body::elastic::Chain;
use asperity_model::body::ends::EndBond;

/// The linear part of a plan's steps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Propagator {
    pub(crate) step_s: f64,
    pub(crate) block_mass_kg: f64,
    pub(crate) chain: Chain,
    /// `E` of a sliding block.
    pub(crate) radiation_kg_per_s: f64,
    /// `k_t` of every block.
    pub(crate) springs_n_per_m: Vec<f64>,
    /// The largest of them.
    pub(crate) stiffest_spring_n_per_m: f64,
    /// `K_n` of every block.
    pub(crate) drive_n_per_m: Vec<f64>,
    /// The largest stiffness of a driving spring.
    pub(crate) stiffest_drive_n_per_m: f64,
    /// What joins the ends.
    pub(crate) end_bonds: Vec<EndBond>,
    /// Whether the forces of friction springs detach contacts.
    pub(crate) detaches_by_spring: bool,
}

impl Propagator {
    pub(crate) fn of(plan: &Plan, chain: &Chain) -> Propagator {
        Propagator {
            step_s: plan.grid.step_s(),
            block_mass_kg: plan.block_mass_kg,
            chain: *chain,
            radiation_kg_per_s: plan.friction.law.radiation_kg_per_s(),
            springs_n_per_m: plan.friction.springs_n_per_m.clone(),
            stiffest_spring_n_per_m: plan.friction.stiffest_spring_n_per_m(),
            drive_n_per_m: plan.drive.stiffness_n_per_m(plan.blocks),
            stiffest_drive_n_per_m: plan.drive.stiffest_n_per_m(),
            // The map does not depend on where they are relaxed.
            end_bonds: plan.end_bonds.iter().map(|bond| EndBond { rest_m: 0.0, ..*bond }).collect(),
            detaches_by_spring: plan.friction.law.detaches_by_spring(),
        }
    }

    /// The chain as a lattice.
    pub(crate) fn elastic(&self) -> Lattice {
        self.chain.as_lattice()
    }

    pub(crate) fn blocks(&self) -> usize {
        self.drive_n_per_m.len()
    }
}
