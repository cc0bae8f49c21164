//! All nodes at one time: what logs leave out, and figures and exports of a lattice show.

use crate::body::lattice::Lattice;

/// The state of all nodes after a step.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeState {
    /// The step.
    pub step: u64,
    /// Its time, s.
    pub time_s: f64,
    /// The arrangement of the nodes, and the axes along which they move.
    pub lattice: Lattice,
    /// The distance of neighbours, m.
    pub spacing_m: f64,
    /// Displacement of every node from the grid, m: all components along the sliding direction, node by node
    /// as the lattice counts them, then all along the next axis.
    pub displacement_m: Vec<f64>,
    /// Velocities, m/s, in the order of the displacements.
    pub velocity_m_per_s: Vec<f64>,
    /// Tangential force without friction on each contact in the step, N: all components along the sliding
    /// direction, then across it over an area.
    pub tangential_force_n: Vec<f64>,
    /// Normal load of each contact in the step, N.
    pub normal_load_n: Vec<f64>,
    /// 1 for a contact that slides in the next step, otherwise 0.
    pub slides: Vec<f64>,
}
