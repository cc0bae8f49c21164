//! What only some runs have: records, events and tables of other runs lack it.

use serde::Serialize;

/// Declares a variant of [`Part`] and a field of [`Parts`] for each, behind `=` its flag in the header of a run; of the
/// others other keys of the header tell.
macro_rules! parts {
    ($($(#[doc = $doc:literal])+ $Part:ident $part:ident $(= $flag:literal)?,)+) => {
        /// What a run may have.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Part {
            $($(#[doc = $doc])+ $Part,)+
        }

        /// What one run has; nothing by default.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
        pub struct Parts {
            $(
                $(#[doc = $doc])+
                #[serde($(rename = $flag,)? skip_serializing_if = "std::ops::Not::not")]
                pub $part: bool,
            )+
        }

        impl Parts {
            /// What any run may have.
            pub const ALL: Parts = Parts { $($part: true,)+ };

            /// Whether the run has this.
            pub fn has(self, part: Part) -> bool {
                match part {
                    $(Part::$Part => self.$part,)+
                }
            }

            /// What this run or another one has.
            #[must_use]
            pub fn or(self, other: Parts) -> Parts {
                Parts { $($part: self.$part || other.$part,)+ }
            }

            /// Those of which flags tell.
            ///
            /// # Errors
            /// That of the first flag without a value.
            pub fn flags<E>(value: impl Fn(&'static str) -> Result<bool, E>) -> Result<Parts, E> {
                Ok(Parts { $($($part: value($flag)?,)?)+ ..Parts::default() })
            }
        }
    };
}

parts! {
    /// Counts of the junctions of contacts, by laws that have junctions.
    Junctions junctions,
    /// Components across the sliding direction, and extents of rows, where contacts lie in several rows.
    Area area,
    /// Radiated energy, where sliding contacts radiate.
    Radiation radiation = "radiates",
    /// Fracture energy, where contacts weaken by slip.
    Weakening weakening = "weakens",
    /// The state of contacts, by rate-and-state friction.
    State state = "has_state",
    /// Errors of what is measured, in the recording of a laboratory.
    Recording recording,
    /// Series at the steps of the solver, where a scenario asks for them.
    Series series = "has_series",
}
