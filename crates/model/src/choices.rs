//! The words that a scenario chooses from.

use serde::{Deserialize, Serialize};

use crate::keys;

/// The two readings of the source thesis.
///
/// Its program kept positions in mm, stiffness in N/mm and mass in kg, and so
/// lost a factor 1000 in `v += F dt / m`. In SI terms it computed a slider of
/// 12 kg with `eta = sqrt(10) sqrt(k m)`, not one of 0.012 kg with
/// `eta = sqrt(0.01) sqrt(k m)`. The slip lives only in these values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterSet {
    /// What the thesis' program computed; its figures come from this.
    AsCoded,
    /// What the thesis' text says; the physical one.
    AsStated,
}

impl ParameterSet {
    /// The word that scenarios use.
    pub fn word(self) -> &'static str {
        match self {
            ParameterSet::AsCoded => keys::PARAMETER_SETS[0],
            ParameterSet::AsStated => keys::PARAMETER_SETS[1],
        }
    }
}

/// How a block sticks and slides.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLaw {
    /// Amontons-Coulomb with interfacial springs (section 5.3).
    #[default]
    InterfacialSprings,
    /// Rigid Amontons-Coulomb (2.7), Maegawa's.
    Rigid,
    /// Burridge and Knopoff's (2.4).
    VelocityWeakening,
}

impl FrictionLaw {
    /// The word that scenarios use.
    pub(crate) fn word(self) -> &'static str {
        match self {
            FrictionLaw::InterfacialSprings => "interfacial-springs",
            FrictionLaw::Rigid => "rigid",
            FrictionLaw::VelocityWeakening => "velocity-weakening",
        }
    }
}

/// Where the drive pulls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DriveKind {
    /// Block 1 (5.8).
    #[default]
    Side,
    /// Every block (5.53).
    Top,
    /// Block 1 backwards, block N forwards.
    LeftRight,
}

/// What the times of a load schedule count from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScheduleFrom {
    /// The start of the run.
    #[default]
    Start,
    /// The step in which the drive stops.
    Hold,
}

/// Where a run begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At time 0, at rest.
    #[default]
    AtRest,
    /// Just before the first block would detach.
    Loaded,
}

/// Which records have the energies of the slider.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Energies {
    /// That of every step that is recorded.
    #[default]
    EveryRecord,
    /// None.
    None,
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
