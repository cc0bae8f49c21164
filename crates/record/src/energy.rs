//! Energies of a run: what the work put into the slider became.

use serde::{Deserialize, Serialize};

use crate::{Column, ColumnKind, Part};

/// Hands the table of energies to a macro: `energies!(logged m)` in the order of logs, with those that only some runs
/// have last; `energies!(shown m)` in the order of summaries and of the table.
///
/// An energy has its comment in summaries; its name, which ends in its unit; its type, an option where only some runs have
/// it; and its meaning in logs. In brackets stand what its total is worth (a class of `asperity_numbers::Convergence`), its
/// sign in the balance, behind `+` what tables add to its meaning, and behind `of` the part of runs that have it. Where
/// solvers compute it, all else follows from this.
#[doc(hidden)]
#[macro_export]
macro_rules! energies {
    (@logged $to:ident {$($first:tt)*} {$($of_parts:tt)*} {$($last:tt)*}) => {
        $to! { $($first)* $($last)* $($of_parts)* }
    };
    (@shown $to:ident {$($first:tt)*} {$($of_parts:tt)*} {$($last:tt)*}) => {
        $to! { $($first)* $($of_parts)* $($last)* }
    };
    ($order:ident $to:ident) => {
        $crate::energies! {
            @$order $to
            {
                /// Work of the drive points on the drive springs, J; null, as are all energies, in logs
                /// without step records.
                drive_work_j: f64 = "Work of the drive points on the drive springs since the start" [Robust, 1.0];
                /// Work of the prestress, J.
                // Of all forces from outside but the drive: also of the normal load, under which slabs sink and tilt.
                prestress_work_j: f64 = "Work of the prestress" [OfTheMesh, 1.0];
                /// Heat of sliding contacts, J.
                friction_heat_j: f64 = "Work that sliding contacts have turned into heat" [OfTheMesh, -1.0];
            }
            {
                /// Work of radiation damping on sliding contacts, J; null in runs without it, whose ruptures may radiate into the
                /// slider.
                radiated_j: Option<f64> =
                    "Work of radiation damping" [OneDraw, -1.0, + " on sliding contacts", of Radiation];
                /// The part of this heat above sliding friction: the fracture energy of contacts that weaken by slip, J; null in
                /// runs without.
                fracture_energy_j: Option<f64> =
                    "The part of the friction heat above sliding friction" [OneDraw, 0.0, of Weakening];
            }
            {
                /// Energy that friction springs stored when blocks re-attached, less the energy that they
                /// lost when blocks detached, J.
                // Negative where detachment has taken out more than re-attachment put in.
                anchor_change_j: f64 =
                    "What friction springs held when they took hold again, less what they lost when they let go"
                    [OneDraw, 1.0];
                /// Work of the dampers between blocks, J.
                viscous_loss_j: f64 = "Work of the dampers between blocks" [OfTheMesh, -1.0];
                /// Kinetic energy at the end, J.
                kinetic_j: f64 = "Kinetic energy" [OneDraw, -1.0];
                /// Energy of all springs at the end, J.
                elastic_j: f64 =
                    "Energy of all springs" [OfTheMesh, -1.0, + ": between blocks, of the drive, and of friction"];
                /// Energy added by the finite time step, J.
                // Euler-Cromer keeps energy only on average.
                scheme_work_j: f64 = "What the time step itself added" [OneDraw, 1.0];
            }
        }
    };
}

macro_rules! energy {
    ($(
        $(#[doc = $_shown:tt])+
        $name:ident: $type:ty = $about:literal
            [$_class:ident, $sign:literal $(, + $more:literal)? $(, of $Part:ident)?];
    )+) => {
        /// Running totals from the start of a run to the end of a step, each by a definition of its own, so that
        /// [their balance](Energy::balance_j) is a check.
        #[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Energy {
            $(
                #[doc = concat!($about, $($more,)? ", J", $("; `None` in runs without ", stringify!($Part),)? ".")]
                #[serde(skip_serializing_if = "Energy::lacks")]
                pub $name: $type,
            )+
        }

        impl Energy {
            /// How many there are.
            pub const COUNT: usize = Energy::COLUMNS.len();

            /// Names and meanings of all, in the order of the fields.
            pub const COLUMNS: &[Column] = &[$(
                Column::new(stringify!($name), ColumnKind::Number, concat!($about, $($more,)? "."))
                    $(.only(Part::$Part))?,
            )+];

            /// Those of the columns, J.
            pub fn values(&self) -> [Option<f64>; Energy::COUNT] {
                [$(self.$name.into(),)+]
            }

            /// Energy put in less energy lost and stored, J: constant over a run except for rounding, and equal to minus
            /// the energy at the start.
            pub fn balance_j(&self) -> f64 {
                self.values().iter().zip([$($sign,)+]).map(|(energy_j, sign)| sign * energy_j.unwrap_or(0.0)).sum()
            }
        }
    };
}

energies!(logged energy);

impl Energy {
    /// Whether a run lacks this energy.
    pub fn lacks(energy_j: &(impl Copy + Into<Option<f64>>)) -> bool {
        (*energy_j).into().is_none()
    }

    /// Names and values of all energies that the run has, in the order of the fields.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let all = Energy::COLUMNS.iter().zip(self.values());
        all.filter_map(|(column, energy_j)| Some((&*column.name, energy_j?)))
    }
}
