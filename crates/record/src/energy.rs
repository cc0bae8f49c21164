//! Energies of a run: what the work put into the slider became.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Running totals from the start of a run to the end of a step, each by a definition of its own,
/// so that their balance is a check:
///
/// `drive_work + prestress_work + anchor_change + scheme_work = friction_heat + viscous_loss
/// + radiated + change of kinetic + change of elastic`
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Energy {
    /// Work of the drive points on the drive springs, J.
    pub drive_work_j: f64,
    /// Work of the forces from outside other than the drive, J: of a chain's prestress; of the normal
    /// load on a slab or a body, which sinks and tilts under it.
    pub prestress_work_j: f64,
    /// Work that sliding contacts have turned into heat, J.
    pub friction_heat_j: f64,
    /// What friction springs held when they took hold again, less what they lost when they let go,
    /// J; negative where detachment has taken out more than re-attachment put in.
    pub anchor_change_j: f64,
    /// Work of the dampers between blocks, J.
    pub viscous_loss_j: f64,
    /// Kinetic energy now, J.
    pub kinetic_j: f64,
    /// Energy of all springs now: between blocks, of the drive, and of friction, J.
    pub elastic_j: f64,
    /// What the time step itself added: Euler-Cromer keeps energy only on average, J.
    pub scheme_work_j: f64,
    /// Work of radiation damping on sliding contacts, `E v^2`, J; `None` in runs without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiated_j: Option<f64>,
    /// The part of the friction heat above sliding friction, where contacts weaken by slip, J; `None` in runs without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fracture_energy_j: Option<f64>,
}

impl Energy {
    /// Names and values of all energies that the run has, in the order of the fields.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let always = [
            ("drive_work_j", self.drive_work_j),
            ("prestress_work_j", self.prestress_work_j),
            ("friction_heat_j", self.friction_heat_j),
            ("anchor_change_j", self.anchor_change_j),
            ("viscous_loss_j", self.viscous_loss_j),
            ("kinetic_j", self.kinetic_j),
            ("elastic_j", self.elastic_j),
            ("scheme_work_j", self.scheme_work_j),
        ];
        let of_parts = [("radiated_j", self.radiated_j), ("fracture_energy_j", self.fracture_energy_j)];
        always.into_iter().chain(of_parts.into_iter().filter_map(|(name, energy_j)| Some((name, energy_j?))))
    }

    /// Energy put in less energy lost and stored: constant over a run except for rounding, and equal to
    /// minus the energy at the start.
    pub fn balance_j(&self) -> f64 {
        (self.drive_work_j + self.prestress_work_j) + (self.anchor_change_j + self.scheme_work_j)
            - (self.friction_heat_j + self.viscous_loss_j + self.radiated_j.unwrap_or(0.0))
            - (self.kinetic_j + self.elastic_j)
    }
}
