//! A fault line in an elastic medium: nodes by depth, the friction and the load of each, and what the medium is.
//!
//! Slip is antiplane, and blocks are nodes, from the top downwards; below the last one the fault slips at the velocity
//! of the drive. All forces are per metre of strike. In the form of the SEAS benchmark BP1-QD (Erickson et al., Seismol.
//! Res. Lett. 91, 874, 2020).

use crate::scenario::choices::{MediumChoice, words};

words! {
    /// Where the nodes are.
    FirstNode {
        /// At `i dz`, the first one at the surface.
        Surface = "surface",
        /// At `(i + 1/2) dz`.
        HalfCell = "half-cell",
    }
}

impl FirstNode {
    /// Its depth over `dz`.
    pub fn cells(self) -> f64 {
        if self == FirstNode::HalfCell { 0.5 } else { 0.0 }
    }
}

/// The medium and the fault in it, node by node.
#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    /// What it is: below a free surface, where `w_-j = w_j`; on all sides; or of a fault that repeats itself.
    pub kind: MediumChoice,
    /// `W` of a periodic one, over which a uniform slip is unloaded: stiffness `mu pi / W`; 0 of others.
    pub width_m: f64,
    /// Where its nodes are.
    pub first_node: FirstNode,
    /// `mu`.
    pub shear_modulus_pa: f64,
    /// `rho`.
    pub density_kg_per_m3: f64,
    /// `dz = W_f / N`.
    pub spacing_m: f64,
    /// `a` of each node.
    pub direct_effect: Vec<f64>,
    /// `b` of each node.
    pub evolution_effect: Vec<f64>,
    /// `D_c` of each node.
    pub critical_slip_m: Vec<f64>,
    /// `sigma` of each node.
    pub normal_stress_pa: Vec<f64>,
    /// `tau_0` of each node, the shear stress without slip.
    pub prestress_pa: Vec<f64>,
}

impl Medium {
    /// How many nodes it has.
    pub fn nodes(&self) -> usize {
        self.direct_effect.len()
    }

    /// Depth of a node, counted from 0.
    pub fn depth_m(&self, node: usize) -> f64 {
        (node as f64 + self.first_node.cells()) * self.spacing_m
    }

    /// `c_s = sqrt(mu / rho)`.
    pub fn shear_speed_m_per_s(&self) -> f64 {
        (self.shear_modulus_pa / self.density_kg_per_m3).sqrt()
    }

    /// `eta = mu / (2 c_s)`, of the stress `eta V` that waves carry away.
    pub fn radiation_pa_s_per_m(&self) -> f64 {
        self.shear_modulus_pa / (2.0 * self.shear_speed_m_per_s())
    }

    /// Length of the transforms that add up stresses: a power of two in which the line, with its mirror image if it has
    /// one, is as far from itself as it is long; in a periodic medium the line alone.
    pub fn transform_length(&self) -> usize {
        let lines = match self.kind {
            MediumChoice::HalfSpace => 4,
            MediumChoice::Periodic => 1,
            _ => 2,
        };
        (lines * self.nodes()).next_power_of_two()
    }

    /// The share of a cell that belongs to a node: half at the surface of a half-space.
    pub fn weight(&self, node: usize) -> f64 {
        let is_at_surface = self.kind == MediumChoice::HalfSpace && self.first_node == FirstNode::Surface;
        if node == 0 && is_at_surface { 0.5 } else { 1.0 }
    }

    /// The height of the cell of a node: stress over it is force per metre of strike.
    pub fn cell_m(&self, node: usize) -> f64 {
        self.weight(node) * self.spacing_m
    }
}
