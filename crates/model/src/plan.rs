//! The plan: the numbers of the physics. `derive.rs` derives them from a scenario, once.

pub mod adaptive_state;
pub mod course;
pub(crate) mod derive;
pub(crate) mod disorder;
pub mod given_state;
pub mod initial;
pub mod junction_state;
pub mod ledger;
pub mod load;
pub(crate) mod medium;
pub mod outside;
pub mod slab;
pub(crate) mod splitmix;
pub mod state;

use crate::body::ends::EndBond;
use crate::body::lattice::Lattice;
use crate::body::medium::Medium;
use crate::law::laws::Law;
use crate::plan::course::{ContactCourse, Course, Swing};
use crate::plan::given_state::GivenStart;
use crate::plan::state::SliderState;
use asperity_record::{Scales, TimeGrid};

/// All inputs of a solver, in SI units; per-block arrays have length [`Plan::blocks`].
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Number of blocks `N`; over an area, of contacts.
    pub blocks: usize,
    /// Length of the slider `L`.
    pub length_m: f64,
    /// Spacing `a = L / (N - 1)`; `L` of a single block.
    pub spacing_m: f64,
    /// Mass of a block `m = M / N`; of a slab, of a node.
    pub block_mass_kg: f64,
    /// The bonds between blocks: springs `k` (5.5) and dashpots `eta` (5.7).
    pub elastic: Lattice,
    /// What joins the ends of a chain to a wall or to each other, by end; empty for free ends.
    pub end_bonds: Vec<EndBond>,
    /// The medium whose stress joins the blocks instead of bonds, with the friction of each.
    pub medium: Option<Box<Medium>>,
    /// The friction law's numbers.
    pub friction: Friction,
    /// Total normal load `F_N` at the start.
    pub total_normal_load_n: f64,
    /// Normal load per contact `p_n` at the start: (5.18); of a body on a foundation, that of its rest state.
    pub normal_load_n: Vec<f64>,
    /// Vertical load on each node at the top of a body on a foundation at the start; empty for others.
    pub top_load_n: Vec<f64>,
    /// Course of the load over time, for all blocks alike, as a factor on its value at the start.
    pub load_course: Course,
    /// A constant force from outside on each block, besides the drive; empty for none.
    pub prestress_n: Vec<f64>,
    /// Course of the force from outside on each block, in addition to the constant one, N.
    pub prestress_course: Option<ContactCourse>,
    /// A swing of that force.
    pub swing: Option<Swing>,
    /// Course of each contact's normal load, as a factor on that of all.
    pub contact_load_course: Option<ContactCourse>,
    /// The driving springs.
    pub drive: Drive,
    /// The slider before the first step.
    pub initial: SliderState,
    /// What goes on besides, if it begins in a state that is given.
    pub given: Option<GivenStart>,
    /// The grid of time steps.
    pub grid: TimeGrid,
    /// The time step beyond which the scheme is unstable even if nothing switches, `dt_max`.
    pub longest_stable_step_s: f64,
    /// Number of steps to take.
    pub steps: u64,
    /// Scales for converting blocks and steps to fronts, for detectors.
    pub scales: Scales,
    /// What to record besides switches and event edges.
    pub recording: RecordingPlan,
}

/// The friction law and its numbers; those proportional to the normal load are given at the load of the
/// start.
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// The rules of sticking and sliding.
    pub law: Law,
    /// `mu_s` without offsets.
    pub static_coefficient: f64,
    /// `mu_d` without offsets.
    pub dynamic_coefficient: f64,
    /// Stiffness of a stuck block's friction spring without disorder, `k_t`; 0 by the laws that have none. Of
    /// junctions, that of a contact that bears the mean load.
    pub interfacial_stiffness_n_per_m: f64,
    /// `k_t` of each contact, disorder included; all alike in bodies other than chains.
    pub springs_n_per_m: Vec<f64>,
    /// Of junctions, the stiffness `N_s k_n` of each contact; empty by other laws.
    pub contact_stiffness_n_per_m: Vec<f64>,
    /// `mu_s` of each contact, offsets and spread included.
    pub static_coefficients: Vec<f64>,
    /// `mu_d` of each contact, offsets and spread included.
    pub dynamic_coefficients: Vec<f64>,
    /// Static thresholds `mu_s p_n`, of contacts that have not aged.
    pub static_threshold_n: Vec<f64>,
    /// Sliding friction `mu_d p_n`.
    pub dynamic_friction_n: Vec<f64>,
    /// The slip `D_c` over which each contact weakens; empty where all weaken at once.
    pub weakening_slip_m: Vec<f64>,
    /// How thresholds grow while a block sticks.
    pub ageing: Option<Ageing>,
    /// Of rate-and-state, `b` of each contact, offsets included; empty by other laws. Its thresholds and sliding
    /// friction are `f_0 p_n`.
    pub evolution_effects: Vec<f64>,
}

/// Logarithmic ageing, `mu_s + b ln(1 + t_w / t_0)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Ageing {
    /// `b`.
    pub coefficient: f64,
    /// `b p_n`.
    pub growth_n: Vec<f64>,
    /// `t_0`.
    pub time_s: f64,
}

/// Springs from blocks to a point that moves until it stops, at constant velocity unless it has a course: (5.8),
/// (5.53).
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// The springs, by ascending block.
    pub springs: Vec<DriveSpring>,
    /// Velocity of the point, `V`; with a course, that of the start.
    pub velocity_m_per_s: f64,
    /// The course of its velocity, m/s; `None` for a constant one.
    pub course: Option<Course>,
    /// The force that drives block 1 instead of springs, N, if any.
    pub force_n: Option<Course>,
    /// Displacement of the point at time 0: 0 unless a run goes on from another with another velocity or stop.
    pub offset_m: f64,
    /// The step from which on the point rests, if given.
    pub hold_from_step: Option<u64>,
    /// The load `F_T / F_N` that stops it, if any.
    pub until_load_ratio: Option<f64>,
}

/// A driving spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveSpring {
    /// The block, counted from 0; of a lattice, the node, in the order of [`crate::body::lattice`].
    pub block: usize,
    /// `K_n`.
    pub stiffness_n_per_m: f64,
    /// The displacement of the block at which the spring is relaxed at the start: 0 in a chain.
    pub rest_m: f64,
    /// 1 where the point moves forward, -1 where it moves backward.
    pub direction: f64,
}

impl Friction {
    /// Whether friction falls with slip at any contact, instead of at once.
    pub fn weakens(&self) -> bool {
        !self.weakening_slip_m.is_empty()
    }

    /// The largest `k_t`.
    pub fn stiffest_spring_n_per_m(&self) -> f64 {
        self.springs_n_per_m.iter().fold(0.0, |most: f64, spring| most.max(*spring))
    }

    /// Whether all contacts have the same `k_t`.
    pub fn has_even_springs(&self) -> bool {
        self.springs_n_per_m.iter().all(|spring| *spring == self.interfacial_stiffness_n_per_m)
    }
}

impl DriveSpring {
    /// `K_n (V t - u_n)` (5.8), with `point_m` the displacement of the point from its start, and `u_n`
    /// counted from where the spring is relaxed.
    #[inline]
    pub fn force_n(&self, point_m: f64, displacement_m: f64) -> f64 {
        self.stiffness_n_per_m * (self.direction * point_m - (displacement_m - self.rest_m))
    }
}

impl Drive {
    /// `K_n` of every block.
    pub fn stiffness_n_per_m(&self, blocks: usize) -> Vec<f64> {
        let mut all = vec![0.0; blocks];
        for spring in &self.springs {
            all[spring.block] += spring.stiffness_n_per_m;
        }
        all
    }

    /// `sum_n K_n x_n^2 / 2`, of displacements or velocities counted from any state.
    #[inline]
    pub fn half_form(&self, x: &[f64]) -> f64 {
        let of = |spring: &DriveSpring| 0.5 * spring.stiffness_n_per_m * x[spring.block] * x[spring.block];
        self.springs.iter().map(of).sum()
    }

    /// The largest `K_n`.
    pub fn stiffest_n_per_m(&self) -> f64 {
        self.springs.iter().fold(0.0, |most: f64, spring| most.max(spring.stiffness_n_per_m))
    }

    /// The spring of a drive that pulls at block 1 alone.
    pub fn only_side(&self) -> Option<&DriveSpring> {
        match self.springs.as_slice() {
            [spring] if spring.block == 0 && spring.direction > 0.0 => Some(spring),
            _ => None,
        }
    }

    /// Whether it pulls blocks in opposite directions.
    pub fn pulls_both_ways(&self) -> bool {
        self.springs.iter().any(|spring| spring.direction < 0.0)
    }

    /// Whether it pulls any block but the first and the last.
    pub fn pulls_inside(&self, blocks: usize) -> bool {
        self.springs.iter().any(|spring| spring.block != 0 && spring.block != blocks - 1)
    }

    /// Sum of the driving forces, with the point at `point_m` from its start.
    pub fn total_force_n(&self, point_m: f64, displacement_m: &[f64]) -> f64 {
        self.springs.iter().map(|spring| spring.force_n(point_m, displacement_m[spring.block])).sum()
    }
}

/// Cadences of optional records. Cadences are in steps; 0 means never. None of it influences the run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RecordingPlan {
    /// Cadence of load samples.
    pub sample_every_steps: u64,
    /// Cadence of states of all blocks.
    pub fields_every_steps: u64,
    /// Whether to record all blocks at the onset and end of every slip event.
    pub event_fields: bool,
    /// Dense windows of chosen blocks.
    pub windows: Vec<WindowPlan>,
    /// Whether to record all blocks while many slide.
    pub rupture_fields: Option<RuptureFields>,
    /// Cadence of series, in accepted steps of the adaptive solver.
    pub series_every: u64,
    /// The blocks that they have, counted from 0.
    pub series_blocks: Vec<usize>,
}

/// When to record all blocks because many slide at once. Such records form a window whose index follows
/// those of the dense windows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RuptureFields {
    /// Fewest sliding blocks, 1 or more.
    pub from_blocks: u32,
    /// Cadence: multiples of this number of steps are recorded, 1 or more.
    pub every_steps: u64,
}

impl RuptureFields {
    /// Whether they are recorded after a step in which `sliding` blocks slid.
    pub fn are_due(&self, step: u64, sliding: u32) -> bool {
        sliding >= self.from_blocks && step.is_multiple_of(self.every_steps)
    }

    /// The next step after `step` after which they are recorded, if `detached` blocks keep sliding.
    pub fn next_due(&self, step: u64, detached: u32) -> Option<u64> {
        (detached >= self.from_blocks)
            .then(|| (step / self.every_steps).saturating_add(1).checked_mul(self.every_steps))?
    }
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
    /// The first and the last row across, from 1, in which the drive pulls the nodes of the first column; none
    /// where it pulls others as well, or nothing.
    pub fn driven_rows(&self) -> Option<[u32; 2]> {
        let lattice = &self.elastic;
        let places = || self.drive.springs.iter().map(|spring| lattice.place(spring.block));
        let rows = || places().map(|[_, lane, _]| lane as u32 + 1);
        let ends = rows().min().zip(rows().max()).map(|(first, last)| [first, last]);
        ends.filter(|_| places().all(|[column, ..]| column == 0))
    }

    /// `k_t` of each contact over that without disorder; empty where all are alike.
    pub fn spring_factors(&self) -> Vec<f64> {
        let friction = &self.friction;
        if friction.has_even_springs() {
            return Vec::new();
        }
        let kt = friction.interfacial_stiffness_n_per_m;
        friction.springs_n_per_m.iter().map(|spring| spring / kt).collect()
    }

    /// Whether forces or loads follow courses over which no solver leaps: those of single contacts, and a drive by
    /// force.
    pub fn has_contact_courses(&self) -> bool {
        self.prestress_course.is_some()
            || self.swing.is_some()
            || self.contact_load_course.is_some()
            || self.drive.force_n.is_some()
    }

    /// Whether the normal load of each contact follows from the load at the start and one course of all.
    pub fn has_given_loads(&self) -> bool {
        !self.elastic.has_foundation() && self.contact_load_course.is_none()
    }

    /// Whether the theory of the thesis applies to its slider: [`Lattice::has_theory`], with free ends.
    pub fn has_theory(&self) -> bool {
        self.medium.is_none() && self.elastic.has_theory() && self.end_bonds.is_empty()
    }

    /// Whether it is a chain with free ends whose stuck blocks have springs, so that force decays along it.
    pub fn has_decay(&self) -> bool {
        self.has_theory()
            && self.friction.interfacial_stiffness_n_per_m > 0.0
            && self.friction.has_even_springs()
    }

    /// Length over which a stuck chain screens a force on its end,
    /// `l_0 = a sqrt(k / k_t)`: (5.39), where the thesis misplaces the root.
    pub fn screening_length_m(&self) -> f64 {
        self.spacing_m * (self.elastic.stiffness_n_per_m / self.friction.interfacial_stiffness_n_per_m).sqrt()
    }
}
