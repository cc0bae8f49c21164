//! What only recordings of laboratories have, which are measured with errors and noise.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{RunHeader, payload};

/// The sensors of a recording, each a block.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Length of the slider, m.
    pub length_m: f64,
    /// Their positions from the driven end, ascending, m; none if only forces are recorded.
    pub x_m: Vec<f64>,
    /// Whether they measure slip.
    pub are_of_slip: bool,
    /// Least size of a step that counts, in scatters of the noise of its sensor.
    pub threshold: f64,
    /// Least size of a step that counts whatever the noise, in the unit of the sensors.
    pub least_step: f64,
}

impl Sensors {
    /// The position of a sensor, counted from 1, m; none if only forces are recorded.
    pub fn x_m(&self, sensor: u32) -> Option<f64> {
        self.x_m.get(sensor as usize - 1).copied()
    }

    /// What lies between a sensor and the next one, or the end of the slider: middle and length, m.
    pub fn behind_m(&self, sensor: u32) -> Option<[f64; 2]> {
        let (x_m, next_m) = (self.x_m(sensor)?, self.x_m(sensor + 1).unwrap_or(self.length_m));
        Some([(x_m + next_m) / 2.0, next_m - x_m])
    }

    /// The least size of a step that counts where the noise of a sensor has this scatter, in the unit of the sensors.
    pub fn least_step(&self, sigma: f64) -> f64 {
        (self.threshold * sigma).max(self.least_step)
    }

    /// The length of the slider that is nearer to a sensor than to any other, m; none if only forces are recorded.
    pub fn share_m(&self, sensor: u32) -> Option<f64> {
        let to_m = if self.x_m(sensor + 1).is_some() { self.behind_m(sensor)?[0] } else { self.length_m };
        Some(to_m - if sensor > 1 { self.behind_m(sensor - 1)?[0] } else { 0.0 })
    }
}

/// What the log of a recording has beside its records.
#[derive(Debug)]
pub struct Recorded {
    /// Its header, without code version and run id.
    pub header: RunHeader,
    /// The description of the recording, as TOML.
    pub toml: String,
    /// Length and hash of its files, by their paths.
    pub inputs: BTreeMap<String, String>,
    /// Its load drops, in order.
    pub drops: Vec<LoadDrop>,
}

/// The step that a sensor saw, beside the times of its switches.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measured {
    /// Standard error of the time of the switch, s.
    pub error_s: f64,
    /// Size of the step, in the unit of the sensor.
    pub step: f64,
    /// Standard error of the size.
    pub step_error: f64,
}

payload! {
    topic: "/events/load-drop",
    table: "load-drops",
    /// A fall of the tangential force, found in its own record.
    pub struct LoadDrop {
        /// Number of the load drop in its recording, counted from 0.
        pub drop: u64 [role = Number],
        /// Part of the stream, counted from 1: a segment, or what lies between two gaps.
        pub part: u64,
        /// Time at which the force begins to fall, s.
        pub onset_s: f64 [role = Time],
        /// Time at which it has fallen, s.
        pub end_s: f64 [role = Time],
        /// `F_T` before, N: of the line through the samples before, at the onset.
        pub ft_before_n: f64,
        /// `F_T` after, N: of the line through the samples after, at the onset.
        pub ft_after_n: f64,
        /// The drop, N.
        pub drop_n: f64,
        /// Its standard error, N, that of both lines; too small where noise has low frequencies.
        pub drop_error_n: f64,
        /// `F_T / F_N` before: the peak friction; null where the normal force is unknown.
        pub ft_fn_before: Option<f64> [role = Load],
        /// `F_T / F_N` after: the residual friction; null likewise.
        pub ft_fn_after: Option<f64> [role = Load],
        /// Time since the onset of the load drop before it, s; null for the first of a part.
        pub recurrence_s: Option<f64>,
        /// Rate at which the force rose before, N/s.
        pub loading_rate_n_per_s: f64,
        /// That rate over the speed of the load point, N/m; null where that is not recorded.
        pub stiffness_n_per_m: Option<f64>,
        /// Slip at the load point, the drop over that stiffness, m; null likewise.
        pub load_point_slip_m: Option<f64>,
    }
}

payload! {
    topic: "/noise",
    table: "noise",
    /// The noise of a sensor in a part of its stream, from which the least size of a step follows.
    pub struct Noise {
        /// The step in which the part begins.
        pub step: u64 [role = Step],
        /// Its time, s.
        pub time_s: f64 [role = Time],
        /// The stream, counted from 1.
        pub stream: u32,
        /// The part of the stream, counted from 1.
        pub part: u64,
        /// The sensor of the array.
        pub sensor: u32,
        /// Samples of a window.
        pub window: u64,
        /// Median of the step statistic, in the unit of the sensor.
        pub median: f64 [unit = "of the sensor"],
        /// Its scatter, 1.4826 times the median of deviations from the median.
        pub sigma: f64 [unit = "of the sensor"],
        /// How many samples are clipped.
        pub clipped: u64,
        /// How many samples are missing.
        pub missing: u64,
    }
}

payload! {
    topic: "/load-noise",
    table: "load-noise",
    /// The noise of `F_T` in a part of its stream, from which the least load drop follows.
    pub struct LoadNoise {
        /// The step in which the part begins.
        pub step: u64 [role = Step],
        /// Its time, s.
        pub time_s: f64 [role = Time],
        /// The stream, counted from 1.
        pub stream: u32,
        /// The part of the stream, counted from 1.
        pub part: u64,
        /// Samples of a window.
        pub window: u64,
        /// Median of the step statistic, N.
        pub median_n: f64,
        /// Its scatter, 1.4826 times the median of deviations from the median, N.
        pub sigma_n: f64,
        /// How many samples are clipped.
        pub clipped: u64,
        /// How many samples are missing.
        pub missing: u64,
    }
}

payload! {
    topic: "/estimates",
    table: "estimates",
    /// A number of a model that a recording tells; what it does not tell has no row.
    pub struct Estimate {
        /// The last step.
        pub step: u64 [role = Step],
        /// Its time, s.
        pub time_s: f64 [role = Time],
        /// Its name, with the unit last.
        pub number: String,
        /// Its value.
        pub value: f64 [unit = "of the number"],
        /// Its standard error.
        pub error: f64 [unit = "of the number"],
    }
}

payload! {
    topic: "/first-reach",
    table: "first-reach",
    /// A sensor that a rupture from the driven end reached for the first time, up to the first global one.
    pub struct FirstReach {
        /// The last step.
        pub step: u64 [role = Step],
        /// Its time, s.
        pub time_s: f64 [role = Time],
        /// The sensor.
        pub sensor: u32,
        /// Its distance from the driven end over the length of the slider.
        pub x_over_l: f64 [unit = "1"],
        /// `F_T / F_N`, midway between that rupture and the last one before which had reached farthest.
        pub ft_fn: f64,
        /// Its standard error, their distance over the root of 12.
        pub ft_fn_error: f64,
    }
}
