//! Enumerations of the words that scenario keys accept.

/// Declares enumerations of words, each with its meaning.
macro_rules! words {
    ($(
        $(#[doc = $about:literal])+
        $name:ident { $($(#[doc = $meaning:literal])+ $variant:ident = $word:literal,)+ }
    )+) => {$(
        $(#[doc = $about])+
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
        pub enum $name {
            $($(#[doc = $meaning])+ #[serde(rename = $word)] $variant,)+
        }

        impl $name {
            /// All words, in the order of the key table.
            pub(crate) const WORDS: &[&str] = &[$($word,)+];

            /// The word that scenarios use.
            pub fn word(self) -> &'static str {
                match self {
                    $($name::$variant => $word,)+
                }
            }
        }
    )+};
}

pub(crate) use words;

words! {
    /// The two readings of the source thesis.
    ///
    /// Its program kept positions in mm, stiffness in N/mm and mass in kg, and so lost a factor of 1000
    /// in `v += F dt / m`. In SI units it computed a slider of 12 kg with `eta = sqrt(10) sqrt(k m)`
    /// instead of 0.012 kg with `eta = sqrt(0.01) sqrt(k m)`. The slip is confined to these two values.
    ParameterSet {
        /// The values that the thesis' program computed with; its figures come from them.
        AsCoded = "as-coded",
        /// The values that the thesis' text states; physically consistent.
        AsStated = "as-stated",
    }

    /// The points that the drive acts on.
    DriveKind {
        /// Block 1 (5.8).
        Side = "side",
        /// Every block (5.53).
        Top = "top",
        /// Block 1 backwards, block N forwards.
        LeftRight = "left-right",
        /// Block 1, by a force that is given instead of a spring.
        Force = "force",
        /// What is below a fault line in a medium, which slips with it.
        Plate = "plate",
    }

    /// The origin of the times of a load schedule.
    ScheduleFrom {
        /// The start of the run.
        Start = "start",
        /// The step in which the drive stops.
        Hold = "hold",
    }

    /// The state in which a run begins.
    Start {
        /// At rest at time 0.
        AtRest = "at-rest",
        /// Just before the first detachment; by rate-and-state friction, in balance with it at time 0.
        Loaded = "loaded",
        /// In a medium, with the same stress at all nodes, and the states that balance it.
        Uniform = "uniform",
        /// In a medium, with states near those of steady sliding, and the stress that balances them.
        Steady = "steady",
    }

    /// What joins the blocks.
    MediumChoice {
        /// Springs, or the elements of a lattice.
        None = "none",
        /// The stress in an elastic half-space.
        HalfSpace = "half-space",
        /// That in an elastic space.
        WholeSpace = "whole-space",
        /// That in a space in which the fault line repeats itself.
        Periodic = "periodic",
    }

    /// How what is drawn for each contact is distributed.
    Distribution {
        /// Between mean less spread and mean plus spread.
        Uniform = "uniform",
        /// With the spread as standard deviation.
        Normal = "normal",
        /// With mean and standard deviation as given.
        Lognormal = "lognormal",
        /// With mean and standard deviation as given, and a modulus.
        Weibull = "weibull",
        /// Mean plus spread in a share of the contacts, mean less spread elsewhere.
        TwoValued = "two-valued",
    }

    /// The forces of a contact's junctions at the start.
    JunctionStart {
        /// Evenly spread.
        Even = "even",
        /// Drawn from a uniform distribution.
        Drawn = "drawn",
    }

    /// What an end of a chain is joined to.
    End {
        /// Nothing.
        Free = "free",
        /// A wall at rest, by a bond like those between blocks.
        Clamped = "clamped",
        /// A dashpot of the impedance of long waves.
        Absorbing = "absorbing",
        /// The other end, by a bond like those between blocks.
        Periodic = "periodic",
    }

    /// The force by which a stuck contact detaches.
    DetachBy {
        /// That of all but friction, `tau_n`.
        Force = "force",
        /// That of its friction spring.
        Spring = "spring",
    }

    /// The condition for a sliding block to re-attach.
    Reattach {
        /// New velocity `<= 0`: the rule of the thesis' program.
        OneWay = "one-way",
        /// The velocity changes sign or vanishes: `v_new v_old <= 0`.
        TwoWay = "two-way",
        /// Over an area, the new velocity has turned by a right angle or more from the direction of the slip.
        Turn = "turn",
    }
}
