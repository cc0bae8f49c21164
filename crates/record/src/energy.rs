//! What became of the work that a run put into the slider.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Running totals from the start of a run to the end of a step, each by a definition of its own,
/// so that their balance is a check:
///
/// `drive_work + prestress_work + scheme_work = friction_heat + anchor_change + viscous_loss
/// + change of kinetic + change of elastic`
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Energy {
    /// Work of the drive points on the drive springs, J.
    pub drive_work_j: f64,
    /// Work of the prestress, J.
    pub prestress_work_j: f64,
    /// Work that sliding contacts have turned into heat, J.
    pub friction_heat_j: f64,
    /// What friction springs lost when they let go, less what they held when they took hold anew,
    /// J; negative where re-attachment has put more in than detachment took out.
    pub anchor_change_j: f64,
    /// Work of the dampers between blocks, J.
    pub viscous_loss_j: f64,
    /// Kinetic energy now, J.
    pub kinetic_j: f64,
    /// Energy of all springs now: between blocks, of the drive, and of friction, J.
    pub elastic_j: f64,
    /// What the time step itself added: Euler-Cromer keeps energy only on average, J.
    pub scheme_work_j: f64,
}
