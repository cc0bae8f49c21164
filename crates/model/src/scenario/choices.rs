//! Enumerations of the words that scenario keys accept.

use serde::{Deserialize, Serialize};

use crate::scenario::keys;

/// The two readings of the source thesis.
///
/// Its program kept positions in mm, stiffness in N/mm and mass in kg, and so lost a factor of 1000
/// in `v += F dt / m`. In SI units it computed a slider of 12 kg with `eta = sqrt(10) sqrt(k m)`
/// instead of 0.012 kg with `eta = sqrt(0.01) sqrt(k m)`. The slip is confined to these two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterSet {
    /// The values that the thesis' program computed with; its figures come from them.
    AsCoded,
    /// The values that the thesis' text states; physically consistent.
    AsStated,
}

impl ParameterSet {
    /// The word that scenarios use.
    pub fn word(self) -> &'static str {
        match self {
            ParameterSet::AsCoded => keys::AS_CODED,
            ParameterSet::AsStated => keys::AS_STATED,
        }
    }
}

/// The points that the drive acts on.
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
    /// Block 1, by a force that is given instead of a spring.
    Force,
}

/// The origin of the times of a load schedule.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScheduleFrom {
    /// The start of the run.
    #[default]
    Start,
    /// The step in which the drive stops.
    Hold,
}

/// The state in which a run begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At rest at time 0.
    #[default]
    AtRest,
    /// Just before the first detachment; by rate-and-state friction, in balance with it at time 0.
    Loaded,
}

/// How what is drawn for each contact is distributed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// Between mean less spread and mean plus spread.
    #[default]
    Uniform,
    /// With the spread as standard deviation.
    Normal,
    /// With mean and standard deviation as given.
    Lognormal,
    /// Likewise, with a modulus.
    Weibull,
    /// Mean plus spread in a share of the contacts, mean less spread elsewhere.
    TwoValued,
}

/// The forces of a contact's junctions at the start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JunctionStart {
    /// Evenly spread.
    #[default]
    Even,
    /// Drawn from a uniform distribution.
    Drawn,
}

/// What an end of a chain is joined to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum End {
    /// Nothing.
    #[default]
    Free,
    /// A wall at rest, by a bond like those between blocks.
    Clamped,
    /// A dashpot of the impedance of long waves.
    Absorbing,
    /// The other end, by a bond like those between blocks.
    Periodic,
}

impl End {
    /// The word that scenarios use.
    pub fn word(self) -> &'static str {
        match self {
            End::Free => "free",
            End::Clamped => "clamped",
            End::Absorbing => "absorbing",
            End::Periodic => "periodic",
        }
    }
}

/// The force by which a stuck contact detaches.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DetachBy {
    /// That of all but friction, `tau_n`.
    #[default]
    Force,
    /// That of its friction spring.
    Spring,
}

/// The condition for a sliding block to re-attach.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reattach {
    /// New velocity `<= 0`: the rule of the thesis' program.
    #[default]
    OneWay,
    /// The velocity changes sign or vanishes: `v_new v_old <= 0`.
    TwoWay,
    /// Over an area, the new velocity has turned by a right angle or more from the direction of the slip.
    Turn,
}
