//! Records of the blocks themselves: what the profiles in figures are drawn
//! from, and what a run can be restarted from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The state of every block after a step; each array has one value per block. The blocks of a slab, a
/// sheet or a body are its contacts.
///
/// Written for the initial state, at the onset and end of every slip event, and
/// at a cadence of its own.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldRecord {
    /// The step; 0 is the initial state.
    pub step: u64,
    /// Simulated time at the end of the step, s.
    pub time_s: f64,
    /// Displacement `u_n` from the initial grid, m.
    pub displacement_m: Vec<f64>,
    /// Velocity `v_n`, m/s.
    pub velocity_m_per_s: Vec<f64>,
    /// Tangential force without friction `tau_n` that this step's update used, N.
    pub tangential_force_n: Vec<f64>,
    /// Normal load `p_n` that this step's update used, N; none of a chain or a sheet, whose load follows
    /// from the scenario.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub normal_load_n: Vec<f64>,
    /// Anchor `u_stick,n` of the friction spring, m; without meaning while the
    /// block slides.
    pub stick_position_m: Vec<f64>,
    /// 1 for a block that enters the next step detached, else 0.
    pub detached: Vec<u8>,
    /// How many junctions of the contact slip; none by laws without junctions, as below.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub junctions_slipping: Vec<u32>,
    /// Mean force of the contact's pinned junctions over the load that each bears, `p_n / N_s`; 0 if
    /// none is pinned, or the contact bears nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pinned_mean_ratio: Vec<f64>,
    /// Width of the uniform distribution with the standard deviation of these forces, `sqrt(12)` times
    /// that, over the same load; 0 likewise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pinned_width_ratio: Vec<f64>,
    /// State of rate-and-state friction, `psi_n = f_0 + b_n ln(V_0 theta_n / D_c)`; none by other laws.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub state: Vec<f64>,
    /// Displacement across the sliding direction, from the initial grid, m; none where contacts lie in a
    /// single row, as below.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub displacement_across_m: Vec<f64>,
    /// Velocity across it, m/s.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub velocity_across_m_per_s: Vec<f64>,
    /// Tangential force without friction across it that this step's update used, N.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tangential_force_across_n: Vec<f64>,
    /// Anchor of the friction spring across it, m; without meaning while the contact slides.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stick_position_across_m: Vec<f64>,
}

/// The state of some neighbouring blocks after a step inside a dense window.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WindowRecord {
    /// Which window of the scenario this belongs to, counted from 0.
    pub window: u32,
    /// The step.
    pub step: u64,
    /// Simulated time at the end of the step, s.
    pub time_s: f64,
    /// How many blocks of the whole chain slid in this step.
    pub sliding: u32,
    /// The block that the first value of each array belongs to.
    pub first_block: u32,
    /// Displacement `u_n` from the initial grid, m.
    pub displacement_m: Vec<f64>,
    /// Velocity `v_n`, m/s.
    pub velocity_m_per_s: Vec<f64>,
    /// Tangential force without friction `tau_n` that this step's update used, N.
    pub tangential_force_n: Vec<f64>,
    /// Displacement across the sliding direction, from the initial grid, m; none where contacts lie in a
    /// single row, as below.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub displacement_across_m: Vec<f64>,
    /// Velocity across it, m/s.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub velocity_across_m_per_s: Vec<f64>,
    /// Tangential force without friction across it that this step's update used, N.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tangential_force_across_n: Vec<f64>,
}
