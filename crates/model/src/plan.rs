//! The plan: the numbers of the physics, derived from a scenario once.

use serde::{Deserialize, Serialize};

use crate::initial::InitialState;
use crate::{Scenario, initial, load};
use asperity_record::TimeGrid;

/// Everything a solver needs to know. SI units; per-block arrays have length
/// [`Plan::blocks`].
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Number of blocks `N`.
    pub blocks: usize,
    /// Length of the slider `L`.
    pub length_m: f64,
    /// Spacing `a = L / (N - 1)`.
    pub spacing_m: f64,
    /// Block mass `m = M / N`.
    pub block_mass_kg: f64,
    /// Stiffness between neighbours `k` (5.5).
    pub stiffness_n_per_m: f64,
    /// Viscous damping between neighbours `eta` (5.7).
    pub damping_kg_per_s: f64,
    /// The friction law's numbers.
    pub friction: Friction,
    /// Total normal load `F_N`.
    pub total_normal_load_n: f64,
    /// Normal load per block `p_n` (5.18).
    pub normal_load_n: Vec<f64>,
    /// The driving spring on block 1.
    pub drive: SideDrive,
    /// The chain before the first step.
    pub initial: InitialState,
    /// The grid of time steps.
    pub grid: TimeGrid,
    /// Number of steps to take.
    pub steps: u64,
    /// What to record besides switches and event edges.
    pub recording: RecordingPlan,
}

/// Amontons-Coulomb friction with interfacial springs (section 5.3).
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// `mu_s`.
    pub static_coefficient: f64,
    /// `mu_d`.
    pub dynamic_coefficient: f64,
    /// Stiffness of a stuck block's friction spring, `k_t`.
    pub interfacial_stiffness_n_per_m: f64,
    /// Static thresholds `mu_s p_n`.
    pub static_threshold_n: Vec<f64>,
    /// Sliding friction `mu_d p_n`.
    pub dynamic_friction_n: Vec<f64>,
    /// When a sliding block re-attaches.
    pub reattach: Reattach,
}

/// When a sliding block re-attaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reattach {
    /// At a new velocity `<= 0`: the rule of the thesis' program.
    OneWay,
    /// Where the velocity changes sign or vanishes, `v_new v_old <= 0`.
    TwoWay,
}

/// A spring from block 1 to a point that moves at constant velocity (5.8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SideDrive {
    /// `K`.
    pub stiffness_n_per_m: f64,
    /// `V`.
    pub velocity_m_per_s: f64,
}

impl SideDrive {
    /// `F_X = K (V t - u_1)` (5.8).
    #[inline]
    pub fn force_n(&self, time_s: f64, first_displacement_m: f64) -> f64 {
        self.stiffness_n_per_m * (self.velocity_m_per_s * time_s - first_displacement_m)
    }
}

/// When to record what nothing forces to be recorded. Cadences are in steps; 0
/// means never. None of it influences the run.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingPlan {
    /// Cadence of load samples.
    pub sample_every_steps: u64,
    /// Cadence of states of all blocks.
    pub fields_every_steps: u64,
    /// Whether to record all blocks at the onset and end of every slip event.
    pub event_fields: bool,
    /// Dense windows of chosen blocks.
    pub windows: Vec<WindowPlan>,
}

/// A dense window: steps `from, from + every, ...` up to `to`, some blocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WindowPlan {
    /// First step.
    pub from_step: u64,
    /// Last step.
    pub to_step: u64,
    /// Cadence.
    pub every_steps: u64,
    /// Blocks, counted from 0.
    pub blocks: std::ops::Range<usize>,
}

impl Plan {
    /// Derives the numbers of the physics from a resolved scenario.
    pub fn new(scenario: &Scenario) -> Plan {
        let blocks = scenario.slider.blocks as usize;
        let springs = Springs::of(scenario);
        let normal_load_n = load::tilted(scenario.normal_load.total_n, scenario.normal_load.tilt, blocks);
        let friction = &scenario.friction;
        let scaled = |factor: f64| normal_load_n.iter().map(|p| factor * p).collect();
        let grid = TimeGrid::new(scenario.time.step_s);
        let steps =
            |seconds| grid.whole_steps(seconds).expect("a resolved scenario has whole numbers of steps");
        Plan {
            blocks,
            length_m: scenario.slider.length_m,
            spacing_m: springs.spacing_m,
            block_mass_kg: springs.block_mass_kg,
            stiffness_n_per_m: springs.stiffness_n_per_m,
            damping_kg_per_s: springs.damping_kg_per_s,
            friction: Friction {
                static_coefficient: friction.static_coefficient,
                dynamic_coefficient: friction.dynamic_coefficient,
                interfacial_stiffness_n_per_m: springs.interfacial_stiffness_n_per_m,
                static_threshold_n: scaled(friction.static_coefficient),
                dynamic_friction_n: scaled(friction.dynamic_coefficient),
                reattach: friction.reattach,
            },
            total_normal_load_n: scenario.normal_load.total_n,
            drive: SideDrive {
                stiffness_n_per_m: scenario.drive.stiffness_n_per_m,
                velocity_m_per_s: scenario.drive.velocity_m_per_s,
            },
            initial: initial::state(scenario, &springs, &normal_load_n),
            normal_load_n,
            grid,
            steps: steps(scenario.time.duration_s),
            recording: RecordingPlan {
                sample_every_steps: steps(scenario.recording.sample_s),
                fields_every_steps: steps(scenario.recording.fields_s),
                event_fields: scenario.recording.event_fields,
                windows: scenario
                    .recording
                    .window
                    .iter()
                    .map(|window| WindowPlan {
                        from_step: steps(window.from_s),
                        to_step: steps(window.to_s),
                        every_steps: steps(window.every_s),
                        blocks: window.first_block as usize - 1..window.last_block as usize,
                    })
                    .collect(),
            },
        }
    }

    /// Length over which a stuck chain screens a force on its end,
    /// `l_0 = a sqrt(k / k_t)`: (5.39), where the thesis misplaces the root.
    pub fn screening_length_m(&self) -> f64 {
        self.spacing_m * (self.stiffness_n_per_m / self.friction.interfacial_stiffness_n_per_m).sqrt()
    }
}

/// The chain's constants, needed before there is a plan.
pub(crate) struct Springs {
    pub(crate) spacing_m: f64,
    pub(crate) block_mass_kg: f64,
    pub(crate) stiffness_n_per_m: f64,
    pub(crate) interfacial_stiffness_n_per_m: f64,
    pub(crate) damping_kg_per_s: f64,
}

impl Springs {
    pub(crate) fn of(scenario: &Scenario) -> Springs {
        let slider = &scenario.slider;
        let gaps = f64::from(slider.blocks - 1);
        let block_mass_kg = slider.mass_kg / f64::from(slider.blocks);
        let stiffness_n_per_m =
            slider.youngs_modulus_pa * gaps * slider.width_m * slider.height_m / slider.length_m;
        Springs {
            spacing_m: slider.length_m / gaps,
            block_mass_kg,
            stiffness_n_per_m,
            interfacial_stiffness_n_per_m: scenario.friction.interfacial_stiffness_ratio * stiffness_n_per_m,
            damping_kg_per_s: slider.relative_damping * (stiffness_n_per_m * block_mass_kg).sqrt(),
        }
    }
}

/// The time step beyond which the scheme is unstable for a scenario's chain.
///
/// One mode with `x'' = -w^2 x - g x'` advances by Euler-Cromer as
/// `v' = v - dt (w^2 x + g v)`, `x' = x + dt v'`. Its characteristic polynomial
/// `z^2 - (2 - g dt - w^2 dt^2) z + (1 - g dt)` has both roots inside the unit
/// circle if and only if `w^2 dt^2 + 2 g dt < 4`. The stiffest mode is bounded by
/// `w^2 = (4 k + k_t + K) / m` and `g = 4 eta / m`.
pub(crate) fn longest_stable_step_s(scenario: &Scenario) -> f64 {
    let springs = Springs::of(scenario);
    let stiffest = (4.0 * springs.stiffness_n_per_m
        + springs.interfacial_stiffness_n_per_m
        + scenario.drive.stiffness_n_per_m)
        / springs.block_mass_kg;
    let damping = 4.0 * springs.damping_kg_per_s / springs.block_mass_kg;
    ((damping * damping + 4.0 * stiffest).sqrt() - damping) / stiffest
}
