//! The registered contact laws: for each a file of the folder `laws` and a line of the list at the end.

use crate::law::weakening::Weakening;
use crate::law::{Affine, ContactLaw, Strength, WithLaw};
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

/// What laws say of the memory of contacts, by the code that [`ContactLaw::with`] chooses.
trait Remembers {
    fn memory(&self) -> usize;
    fn strength_n(&self, strength: &Strength<'_>) -> f64;
    fn next_change_step(&self, memory: &[f64]) -> u64;
    fn weak_until_step(&self, memory: &[f64]) -> u64;
    fn begin(&self, slip: &[f64], displacement_m: &[f64], memory: &mut [f64]);
}

impl<L: ContactLaw> Remembers for L {
    fn memory(&self) -> usize {
        L::MEMORY
    }

    fn strength_n(&self, strength: &Strength<'_>) -> f64 {
        ContactLaw::strength_n(self, strength)
    }

    fn next_change_step(&self, memory: &[f64]) -> u64 {
        memory
            .chunks_exact(L::MEMORY)
            .map(|of| ContactLaw::next_change_step(self, of))
            .min()
            .unwrap_or(u64::MAX)
    }

    fn weak_until_step(&self, memory: &[f64]) -> u64 {
        memory.chunks_exact(L::MEMORY).map(|of| ContactLaw::weak_until_step(self, of)).max().unwrap_or(0)
    }

    fn begin(&self, slip: &[f64], displacement_m: &[f64], memory: &mut [f64]) {
        for ((memory, slip), u) in memory.chunks_exact_mut(L::MEMORY).zip(slip).zip(displacement_m) {
            if *slip != 0.0 {
                self.begin_slip(*u, memory);
            }
        }
    }
}

/// A question to a law.
struct Ask<F>(F);

impl<T, F: FnOnce(&dyn Remembers) -> T> WithLaw for Ask<F> {
    type Output = T;
    fn with<L: ContactLaw>(self, law: L) -> T {
        (self.0)(&law)
    }
}

impl Law {
    /// [`ContactLaw::MEMORY`].
    pub fn memory(self) -> usize {
        self.with(Ask(|law: &dyn Remembers| law.memory()))
    }

    /// [`ContactLaw::strength_n`].
    pub fn strength_n(self, strength: &Strength<'_>) -> f64 {
        self.with(Ask(|law: &dyn Remembers| law.strength_n(strength)))
    }

    /// The earliest of [`ContactLaw::next_change_step`], of the memory of all contacts; `u64::MAX` for none.
    pub fn next_change_step(self, memory: &[f64]) -> u64 {
        match memory {
            [] => u64::MAX,
            _ => self.with(Ask(|law: &dyn Remembers| law.next_change_step(memory))),
        }
    }

    /// The latest of [`ContactLaw::weak_until_step`], of the memory of all contacts; 0 for none.
    pub fn weak_until_step(self, memory: &[f64]) -> u64 {
        match memory {
            [] => 0,
            _ => self.with(Ask(|law: &dyn Remembers| law.weak_until_step(memory))),
        }
    }

    /// Sets the memory of contacts of which nothing is known but that they slide: [`ContactLaw::begin_slip`].
    pub(crate) fn begin(self, slip: &[f64], displacement_m: &[f64], memory: &mut [f64]) {
        if !memory.is_empty() {
            self.with(Ask(|law: &dyn Remembers| law.begin(slip, displacement_m, memory)));
        }
    }
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

    /// How friction falls with slip, if it does not fall at once.
    pub fn weakening(self) -> Option<Weakening> {
        match self {
            Law::Rigid(law) => law.weakening,
            Law::InterfacialSprings(law) => law.weakening,
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
    Junctions in junctions: "junctions", "many junctions that break one by one and heal after a random time (docs/contacts.md)";
    RateAndState in rate_and_state: "rate-and-state", "friction that depends on velocity and state (docs/contacts.md): nothing sticks";
}
