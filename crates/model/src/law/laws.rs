//! The registered contact laws: for each a file of the folder `laws` and a line of the list at the end.

use crate::law::{Affine, ContactLaw, WithLaw, memory_of};
use crate::scenario::Scenario;
use crate::scenario::choices::words;
pub use junctions::Junctions;
pub use rate_and_state::RateAndState;
pub use springs::SpringsOverArea;

/// The laws' text in the key table: each word and its meaning.
macro_rules! text {
    ($word:literal $meaning:literal $($others:literal $of_others:literal)*) => {
        concat!(
            "How a block sticks and slides: ", $word, ", ", $meaning,
            $("; ", $others, ", ", $of_others,)*
            "."
        )
    };
}

/// Declares the registered laws: the variant, its file, its word and its text in the key table.
macro_rules! laws {
    ($($law:ident in $file:ident: $word:literal, $meaning:literal;)*) => {
        $(pub mod $file;)*

        words! {
            /// The law that a scenario selects.
            FrictionLaw { $(#[doc = $meaning] $law = $word,)* }
        }

        impl FrictionLaw {
            /// All of them, in the order of the key table.
            pub const ALL: &'static [FrictionLaw] = &[$(FrictionLaw::$law,)*];

            /// Whether a key has a meaning for this law and not for every law: one of [`ContactLaw::KEYS`], or of
            /// those of laws whose contacts stick.
            pub fn uses(self, path: &str) -> bool {
                let own = match self {
                    $(FrictionLaw::$law => <$file::$law as ContactLaw>::KEYS,)*
                };
                own.contains(&path) || (self.sticks() && THRESHOLD_KEYS.contains(&path))
            }

            /// [`ContactLaw::STICKS`].
            pub fn sticks(self) -> bool {
                match self {
                    $(FrictionLaw::$law => <$file::$law as ContactLaw>::STICKS,)*
                }
            }

            /// [`ContactLaw::HOLDS`].
            pub fn holds(self) -> bool {
                match self {
                    $(FrictionLaw::$law => <$file::$law as ContactLaw>::HOLDS,)*
                }
            }
        }

        /// The laws' text in the key table.
        pub(crate) const MEANING: &str = text!($($word $meaning)*);

        /// A law with its numbers.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Law {
            $(#[doc = $meaning] $law($file::$law),)*
        }

        impl Law {
            /// The law that a scenario asks for.
            pub fn of(scenario: &Scenario) -> Law {
                match scenario.friction.law {
                    $(FrictionLaw::$law => Law::$law(<$file::$law as ContactLaw>::of(scenario)),)*
                }
            }

            /// [`ContactLaw::HOLDS`].
            pub fn holds(self) -> bool {
                self.word().holds()
            }

            /// The word of the law.
            pub fn word(self) -> FrictionLaw {
                match self {
                    $(Law::$law(_) => FrictionLaw::$law,)*
                }
            }

            /// [`ContactLaw::affine`], of a law without memory.
            pub fn affine(self) -> Option<Affine> {
                let form = match self {
                    $(Law::$law(law) => law.affine(),)*
                };
                form.filter(|_| self.memory() == 0)
            }

            /// [`ContactLaw::MEMORY`].
            pub fn memory(self) -> usize {
                match self {
                    $(Law::$law(_) => <$file::$law as ContactLaw>::MEMORY,)*
                }
            }

            /// [`ContactLaw::strength_n`].
            pub fn strength_n(self, static_n: f64, memory: &[f64], contact: usize) -> f64 {
                match self {
                    $(Law::$law(law) => law.strength_n(static_n, memory_of::<1, $file::$law>(memory, contact)),)*
                }
            }

            /// The earliest of [`ContactLaw::next_change_step`], of the memory of all contacts.
            pub fn next_change_step(self, memory: &[f64]) -> u64 {
                if memory.is_empty() {
                    return u64::MAX;
                }
                let contacts = memory.chunks_exact(self.memory());
                let next_step = |memory: &[f64]| match self {
                    $(Law::$law(law) => law.next_change_step(memory),)*
                };
                contacts.map(next_step).min().unwrap_or(u64::MAX)
            }

            /// [`ContactLaw::detaches_by_spring`].
            pub fn detaches_by_spring(self) -> bool {
                match self {
                    $(Law::$law(law) => law.detaches_by_spring(),)*
                }
            }

            /// [`ContactLaw::damping_kg_per_s`].
            pub fn damping_kg_per_s(self) -> f64 {
                match self {
                    $(Law::$law(law) => law.damping_kg_per_s(),)*
                }
            }

            /// [`ContactLaw::radiation_kg_per_s`].
            pub fn radiation_kg_per_s(self) -> f64 {
                match self {
                    $(Law::$law(law) => law.radiation_kg_per_s(),)*
                }
            }

            /// Runs the code compiled for this law.
            pub fn with<W: WithLaw>(self, what: W) -> W::Output {
                match self {
                    $(Law::$law(law) => law.with(what),)*
                }
            }
        }
    };
}

/// The keys of static and sliding friction.
const THRESHOLD_KEYS: &[&str] = &[
    "friction.static_coefficient",
    "friction.dynamic_coefficient",
    "friction.static_offsets",
    "friction.dynamic_offsets",
    "friction.stuck_blocks",
    "friction.static_spread",
    "friction.dynamic_spread",
];

impl FrictionLaw {
    /// Whether a key has a meaning for other laws, and not for this one.
    pub fn lacks(self, path: &str) -> bool {
        !self.uses(path) && FrictionLaw::ALL.iter().any(|law| law.uses(path))
    }

    /// Whether a contact either sticks or slides, as a whole.
    pub(crate) fn has_two_states(self) -> bool {
        self.sticks() && self != FrictionLaw::Junctions
    }

    /// Whether the law is known for contacts that slip along a vector.
    pub(crate) fn is_known_over_an_area(self) -> bool {
        matches!(self, FrictionLaw::InterfacialSprings)
    }
}

impl Law {
    /// The law of a contact that slips along a vector; `None` by laws that have no such form.
    pub fn over_area(self) -> Option<SpringsOverArea> {
        self.word().is_known_over_an_area().then_some(SpringsOverArea)
    }

    /// The numbers of the law whose contacts are junctions.
    pub fn junctions(self) -> Option<Junctions> {
        match self {
            Law::Junctions(law) => Some(law),
            _ => None,
        }
    }

    /// The numbers of rate-and-state friction.
    pub fn rate_and_state(self) -> Option<RateAndState> {
        match self {
            Law::RateAndState(law) => Some(law),
            _ => None,
        }
    }
}

// The registered laws.
laws! {
    InterfacialSprings in springs: "interfacial-springs", "Amontons-Coulomb with a spring that holds a stuck block (5.12-5.15)";
    Rigid in rigid: "rigid", "without it (2.7): a stuck block does not move";
    VelocityWeakening in velocity_weakening: "velocity-weakening", "rigid with sliding friction that falls with velocity (Burridge and Knopoff, 2.4)";
    Junctions in junctions: "junctions", "many junctions that break one by one and heal after a random time (docs/junctions.md)";
    RateAndState in rate_and_state: "rate-and-state", "friction that depends on velocity and state (docs/rate-and-state.md): nothing sticks";
}
