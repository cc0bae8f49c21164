//! Lengths and times of a slider's elements, by which detectors turn blocks and steps into fronts.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How long a block is, how long a wave takes over it, and how long a front may take.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scales {
    /// Distance of neighbouring blocks, `a`, m.
    pub block_length_m: f64,
    /// Time that a long elastic wave takes from one block to the next, `a / c = sqrt(m / k)`, s.
    pub block_time_s: f64,
    /// How many such times there may be between the detachments of neighbours that are one
    /// rupture; so the slowest front that is one rupture runs at `c` over this.
    pub link_time_ratio: f64,
}

impl Scales {
    /// Most time between two detachments that are linked, `t_link`, s.
    pub fn link_s(&self) -> f64 {
        self.link_time_ratio * self.block_time_s
    }

    /// Speed of long elastic waves, `c`, m/s.
    pub fn wave_speed_m_per_s(&self) -> f64 {
        self.block_length_m / self.block_time_s
    }
}
