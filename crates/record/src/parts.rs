//! What only some runs have: records, events and tables of other runs lack it.

/// Declares a variant of [`Part`] and a field of [`Parts`] for each.
macro_rules! parts {
    ($($(#[doc = $doc:literal])+ $Part:ident $part:ident,)+) => {
        /// What a run may have.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Part {
            $($(#[doc = $doc])+ $Part,)+
        }

        /// What one run has; nothing by default.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
        pub struct Parts {
            $($(#[doc = $doc])+ pub $part: bool,)+
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
        }
    };
}

parts! {
    /// Counts of the junctions of contacts, by laws that have junctions.
    Junctions junctions,
    /// Components across the sliding direction, and extents of rows, where contacts lie in several rows.
    Area area,
    /// Radiated energy, where sliding contacts radiate.
    Radiation radiation,
    /// Fracture energy, where contacts weaken by slip.
    Weakening weakening,
    /// The state of contacts, by rate-and-state friction.
    State state,
    /// Errors of what is measured, in the recording of a laboratory.
    Recording recording,
    /// Series at the steps of the solver, where a scenario asks for them.
    Series series,
}
