//! The keys of a fault line in an elastic medium.

use std::ops::Bound::{Excluded, Included, Unbounded};

use asperity_record::bounds::LONGEST_NAME_BYTES;

use super::section::section;
use crate::body::medium::FirstNode;
use crate::scenario::key::Kind::{self, Numbers, Text, Word};
use crate::scenario::key::Need::{self, InMedium};
use crate::scenario::key::{NOT_NEGATIVE, POSITIVE};
use crate::scenario::keys::List;

/// What all of them need.
pub(super) const MEDIUM: &[(Need, &str)] = &[(InMedium, "only nodes of a fault line have a depth")];

const ABOVE_ZERO: Kind = Numbers(Excluded(0.0), Unbounded);
const FROM_ZERO: Kind = Numbers(Included(0.0), Unbounded);

section! {
    /// `[medium]`
    Medium "medium." {
        /// Where the nodes are, downwards from the top with dz = L_x / N: surface, at 0, dz, ...; half-cell, at dz / 2,
        /// 3 dz / 2, ...
        first_node: FirstNode = "surface"; Word(FirstNode::WORDS); needs MEDIUM;
        /// Shear modulus of the medium, which gives c_s = sqrt(mu / rho) and the radiation damping eta = mu / (2 c_s).
        shear_modulus_pa: f64 = 32_038_120_320.0; POSITIVE, "mu"; needs MEDIUM;
        /// Density of the medium.
        density_kg_per_m3: f64 = 2670.0; POSITIVE; needs MEDIUM;
        /// Of a periodic one, which needs it: the distance W from the fault that bears the mean slip, with the stiffness
        /// pi mu / W; 0 for others.
        width_m: f64 = 0.0; NOT_NEGATIVE, "W"; needs MEDIUM;
        /// Depths at which the four lists below have their values, ascending; linear between them, constant beyond.
        /// Empty where each has a single one.
        profile_m: List = List::new(); FROM_ZERO, "z"; needs MEDIUM;
        /// friction.direct_effect by depth: a value for each of profile_m, or one for all nodes.
        direct_effect: List = List::new(); ABOVE_ZERO, "a(z)"; needs MEDIUM;
        /// friction.evolution_effect by depth, likewise; may be 0 with time.start = "steady".
        evolution_effect: List = List::new(); FROM_ZERO, "b(z)"; needs MEDIUM;
        /// friction.critical_slip_m by depth, likewise.
        critical_slip_m: List = List::new(); ABOVE_ZERO, "D_c(z)"; needs MEDIUM;
        /// Normal stress by depth, likewise; constant in time.
        normal_stress_pa: List = List::new(); ABOVE_ZERO, "sigma(z)"; needs MEDIUM;
        /// A file of columns depth_m, direct_effect, evolution_effect, critical_slip_m and normal_stress_pa, named from
        /// the current folder: profile_m and the four lists. It is read once; the run's log holds what it said.
        profile_csv: String = ""; Text(LONGEST_NAME_BYTES); needs MEDIUM;
        /// Of time.start = "steady": theta at the start over that of steady sliding at the velocity of the drive.
        initial_theta_ratio: f64 = 1.0; POSITIVE, "r"; needs MEDIUM;
    }
}
