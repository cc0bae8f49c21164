//! Lengths and times of a slider's elements, by which detectors turn blocks and steps into fronts.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How long a block is, how long a wave takes over it, and how long a front may take.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scales {
    /// Distance of neighbouring blocks, `a`, m.
    pub block_length_m: f64,
    /// Time that a long elastic wave takes from one block to the next, `a / c = sqrt(m / k)`, s.
    pub block_time_s: f64,
    /// How many such times there may be between the detachments of neighbours that are one
    /// rupture; so the slowest front that is one rupture runs at `c` over this.
    pub link_time_ratio: f64,
    /// Elastic modulus times the width of the slider: of a chain `E L_y`, of a slab `G L_y` with its
    /// shear modulus `G = 3 E / 8`; the density times the square of the wave speed, times the width,
    /// in both. Over an area the shear modulus times the width of a contact, `G a`. It makes a moment of
    /// slip (docs/ruptures.md), N/m.
    pub modulus_n_per_m: f64,
    /// Stiffness of a stuck block's friction spring, `k_t`, N/m; 0 by the laws that have none.
    pub interfacial_stiffness_n_per_m: f64,
}

/// Relative error of a front's speed per time step, in units of the time that a wave takes over a block.
/// Measured (docs/ruptures.md); the error is of first order.
const FRONT_ERROR: f64 = 0.4;

impl Scales {
    /// Most time between two linked detachments, `t_link`, s.
    pub fn link_s(&self) -> f64 {
        self.link_time_ratio * self.block_time_s
    }

    /// All numbers with their names in logs.
    pub fn parts(&self) -> [(&'static str, f64); 5] {
        [
            ("block_length_m", self.block_length_m),
            ("block_time_s", self.block_time_s),
            ("link_time_ratio", self.link_time_ratio),
            ("modulus_n_per_m", self.modulus_n_per_m),
            ("interfacial_stiffness_n_per_m", self.interfacial_stiffness_n_per_m),
        ]
    }

    /// Estimated relative error of front speeds due to the time step, of either sign.
    pub fn front_error(&self, step_s: f64) -> f64 {
        FRONT_ERROR * step_s / self.block_time_s
    }

    /// Speed of long elastic waves, `c`, m/s.
    pub fn wave_speed_m_per_s(&self) -> f64 {
        self.block_length_m / self.block_time_s
    }
}
