//! The state in which a run begins: derived from a scenario, or given, as a text that one run leaves to another.

use serde::{Deserialize, Serialize};

use crate::scenario::exact;

/// Displacements from the grid, velocities and friction springs before the first step. One value per freedom (`u`,
/// `v`) or tangential freedom of a contact. Unless more is carried, all contacts are stuck, except by rate-and-state.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InitialState {
    /// The step after which the run begins: 0, or a later one for a loaded start and a state that is given.
    pub step: u64,
    /// `u_n`.
    #[serde(with = "exact::numbers")]
    pub displacement_m: Vec<f64>,
    /// `v_n`.
    #[serde(with = "exact::numbers")]
    pub velocity_m_per_s: Vec<f64>,
    /// `u_stick,n`, along each axis of the surface.
    #[serde(with = "exact::numbers")]
    pub stick_position_m: Vec<f64>,
    /// Of rate-and-state, the state `psi_n` of each contact; empty by other laws.
    #[serde(with = "exact::numbers")]
    pub state: Vec<f64>,
    /// What a given state has besides; `None` if the run does not begin in one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub carried: Option<Box<Carried>>,
}

/// What decides the future of a slider besides displacements, velocities and anchors. Empty lists are those of
/// contacts that have just come to rest.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Carried {
    /// Keys that a run which begins in it must share, and their values ([`Scenario::keys_of_states`]); empty for a
    /// state of no log.
    ///
    /// [`Scenario::keys_of_states`]: crate::Scenario::keys_of_states
    pub keys: Vec<(String, String)>,
    /// The contacts that slide, counted from 0, ascending.
    #[serde(with = "exact::counts")]
    pub detached: Vec<u64>,
    /// Over an area, those that detached in the last step, ascending.
    #[serde(with = "exact::counts")]
    pub just_detached: Vec<u64>,
    /// Normal load on each contact of a body on a foundation in the last step; empty for others.
    #[serde(with = "exact::numbers")]
    pub normal_load_n: Vec<f64>,
    /// The step in which each contact began to stick, where contacts age.
    #[serde(with = "exact::counts")]
    pub stuck_since_step: Vec<u64>,
    /// What each contact remembers.
    #[serde(with = "exact::numbers")]
    pub memory: Vec<f64>,
    /// The step in which the drive point stopped or will stop; `u64::MAX` for none.
    pub hold_step: u64,
    /// The drive that the state was reached with; `None` for one whose point moved from 0.
    pub drive: Option<CarriedDrive>,
    /// The junctions, by the law that has them.
    pub junctions: Option<CarriedJunctions>,
    /// How the solver went on. A run that moves in another way begins without it.
    pub solver: Option<CarriedSolver>,
}

/// The drive of a run at the end of which another begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarriedDrive {
    /// Displacement of its point, and the part that is no way of the drive ([`Drive::offset_m`](crate::Drive)).
    pub point_m: f64,
    /// That part.
    pub offset_m: f64,
    /// The load `F_T / F_N` that stops it, if any.
    pub until_load_ratio: Option<f64>,
    /// Where each spring is relaxed.
    #[serde(with = "exact::numbers")]
    pub rest_m: Vec<f64>,
    /// Where the bond of each end is.
    #[serde(with = "exact::numbers")]
    pub ends_m: Vec<f64>,
}

/// Junctions, contact by contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarriedJunctions {
    /// The anchor of each.
    #[serde(with = "exact::numbers")]
    pub anchor_m: Vec<f64>,
    /// Its last step of slip, 0 for a pinned one.
    #[serde(with = "exact::counts")]
    pub slips_until_step: Vec<u64>,
    /// How often it has broken.
    #[serde(with = "exact::counts")]
    pub breaks: Vec<u64>,
    /// Breaks and re-pins of all, up to the last step, and up to the one before.
    pub totals: [[u64; 2]; 2],
}

/// What rounds the next steps of a solver as those of the run that it goes on from; no physics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarriedSolver {
    /// The motion that it belongs to ([`Plan::motion_hash`](crate::Plan::motion_hash)).
    pub motion: String,
    /// How many contacts slid in the last step.
    pub sliding: u32,
    /// Tangential forces of the last step; of a lattice those of the contacts that detached in it, axis by axis.
    #[serde(with = "exact::numbers")]
    pub tangential_force_n: Vec<f64>,
    /// Lower bounds on the thresholds of contacts, where those of a chain age.
    #[serde(with = "exact::numbers")]
    pub aged_threshold_n: Vec<f64>,
    /// Whether a span of steps is open, over which energies are added up at once.
    pub has_open_span: bool,
    /// The accounts on which the fast solver bases its choice of steps.
    pub pace: [u64; 3],
    /// Whether the fast solver takes an area for its own mirror image.
    pub mirrors: bool,
    /// Largest speed since the last step record, and the step in progress, by rate-and-state friction.
    pub adaptive: Option<(f64, CarriedStep)>,
}

/// The step in which the adaptive solver is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CarriedStep {
    /// Where it begins, s: a sum and its rounding error.
    pub time_s: [f64; 2],
    /// Its length, 0 before the first one, and the length to try next, s.
    pub lengths_s: [f64; 2],
    /// The unknowns of the blocks at its beginning.
    #[serde(with = "exact::numbers")]
    pub unknowns: Vec<f64>,
    /// Crossings of the event speed up to its end: grid steps, and blocks counted from 0.
    #[serde(with = "exact::counts")]
    pub crossing_steps: Vec<u64>,
    /// The blocks.
    #[serde(with = "exact::counts")]
    pub crossing_blocks: Vec<u64>,
}

/// Hexadecimal digits of the checksum at the beginning of a text.
const CHECKSUM_LENGTH: usize = 16;

impl InitialState {
    /// As a text on one line, exact: a checksum and JSON, in which lists are Base64.
    pub fn to_text(&self) -> String {
        let json = serde_json::to_string(self).expect("a state is a plain struct of finite numbers");
        format!("{} {json}", checksum(&json))
    }

    /// Reads [`InitialState::to_text`].
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn from_text(text: &str) -> Result<InitialState, String> {
        let (stated, json) = text.split_once(' ').ok_or("it does not begin with a checksum")?;
        if stated != checksum(json) {
            return Err("its checksum is another one: it was changed or cut".to_owned());
        }
        serde_json::from_str(json).map_err(|error| error.to_string())
    }
}

fn checksum(json: &str) -> String {
    blake3::hash(json.as_bytes()).to_hex().as_str()[..CHECKSUM_LENGTH].to_owned()
}
