//! The step record: the only input of a detector.
//!
//! Records exist for steps that a solver knows without taking every step: steps at which a block
//! switched between stick and slip, the first step of every slip event and the first one after it, and
//! the sampling instants. A solver that jumps from switch to switch yields the same records as one that
//! takes every step.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::column::{Cell, CellValue, ColumnKind};
use crate::{Energy, Measured, magnitude};

/// The chain at the end of one time step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct StepRecord {
    /// The step, counted from 1; 0 is the initial state.
    pub step: u64,
    /// Simulated time at the end of the step.
    pub time_s: f64,
    /// Sum of the driving forces `F_T` that this step's update used: the drive
    /// point at the new time, displacements from before the step.
    pub driving_force_n: f64,
    /// Total normal load `F_N` that this step's update used.
    pub normal_load_n: f64,
    /// Standard error of `F_T / F_N`; `None` in runs that are no recordings, and where it is unknown.
    pub ft_fn_error: Option<f64>,
    /// The driving forces on the first and the last block, N, where the drive pulls both ways, so that
    /// their sum has little meaning.
    pub end_forces_n: Option<[f64; 2]>,
    /// Energies up to the end of this step.
    pub energy: Energy,
    /// Breaks and re-pins of junctions in all steps before this one; `None` by laws without junctions.
    pub junctions: Option<JunctionTotals>,
    /// Largest speed of any block since the step record before, m/s; `None` by laws without a state.
    pub peak_velocity_m_per_s: Option<f64>,
    /// How many blocks slid in this step, that is, entered it detached.
    pub sliding: u32,
    /// The blocks that detached or re-attached at the end of this step, in
    /// ascending order; each change takes effect from the next step.
    pub switches: Vec<Switch>,
}

impl StepRecord {
    /// `F_T / F_N` as this step's update used it.
    pub fn load_ratio(&self) -> f64 {
        self.driving_force_n / self.normal_load_n
    }
}

/// Breaks and re-pins of the junctions of all contacts, as running totals.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JunctionTotals {
    /// Junctions that broke.
    pub breaks: u64,
    /// Junctions that were pinned again.
    pub repins: u64,
}

/// One block that changed between stick and slip at the end of a step.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Switch {
    /// The block, counted from 1.
    pub block: u32,
    /// Whether it detached or re-attached.
    pub direction: Direction,
    /// Displacement `u_n` after the step, from the initial grid; this and the next three along the sliding
    /// direction.
    pub displacement_m: f64,
    /// Velocity `v_n` after the step.
    pub velocity_m_per_s: f64,
    /// Tangential force without friction `tau_n` of this step.
    pub tangential_force_n: f64,
    /// Anchor `u_stick,n` of the friction spring: the former one of a block that detaches, the new one
    /// (5.15) of a block that re-attaches.
    pub stick_position_m: f64,
    /// Static friction threshold `mu_s p_n` of this step.
    pub threshold_n: f64,
    /// How many junctions of the contact slip at the end of the step; `None` by laws without junctions.
    pub junctions_slipping: Option<u32>,
    /// The components across the sliding direction; `None` where contacts lie in a single row.
    pub across: Option<SwitchAcross>,
    /// The step that a sensor saw; `None` in runs that are no recordings.
    pub measured: Option<Measured>,
}

impl Switch {
    /// Magnitude of the tangential force without friction, which reaches the threshold at a detachment.
    pub fn force_magnitude_n(&self) -> f64 {
        match self.across {
            None => magnitude([self.tangential_force_n]),
            Some(across) => magnitude([self.tangential_force_n, across.tangential_force_n]),
        }
    }
}

/// The components of a [`Switch`] across the sliding direction, as those along it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SwitchAcross {
    /// Displacement after the step, from the initial grid.
    pub displacement_m: f64,
    /// Velocity after the step.
    pub velocity_m_per_s: f64,
    /// Tangential force without friction of this step.
    pub tangential_force_n: f64,
    /// Anchor of the friction spring.
    pub stick_position_m: f64,
}

/// Which way a block switched.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From stick to slip.
    #[default]
    Detach,
    /// From slip to stick.
    Attach,
}

impl CellValue for Direction {
    const KIND: ColumnKind = ColumnKind::Word;

    fn cell(self) -> Cell {
        Cell::Word(match self {
            Direction::Detach => "detach".into(),
            Direction::Attach => "attach".into(),
        })
    }
}
