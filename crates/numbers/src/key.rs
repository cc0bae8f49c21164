//! The names of the numbers of a run, each declared once for files that ask for it, JSON, its schema,
//! tables and the page that explains them.

use asperity_record::Column;

use crate::convergence::Convergence;

/// What a number of a run is called, and what it means.
#[derive(Debug, Clone, PartialEq)]
pub struct Key {
    /// Its topic, as a heading.
    pub group: &'static str,
    /// What it is worth.
    pub convergence: Convergence,
    /// Its name, type, unit and meaning.
    pub column: Column,
}

impl Key {
    /// Its readable name: `first global rupture onset` for `first_global_rupture_onset_s`; logs call the work of the
    /// time step `scheme_work_j`.
    pub fn label(&self) -> String {
        let name: &str = &self.column.name;
        let unit = match self.column.unit {
            None | Some("1") => None,
            Some(unit) => Some(unit.to_lowercase().replace('/', "_per_").replace(' ', "_")),
        };
        let bare = unit.and_then(|unit| name.strip_suffix(&format!("_{unit}"))).unwrap_or(name);
        bare.replace("ft_fn", "F_T/F_N")
            .replace("_over_", "/")
            .replace('_', " ")
            .replace("F T/F N", "F_T/F_N")
            .replace("scheme work", "work of the step")
    }
}

/// A [`Key`], of its group with the class of its numbers, its own class if that is another one, its name, type, meaning
/// and attributes.
macro_rules! key {
    (
        $group:literal $class:ident $(as $own:ident)?, $name:ident: $type:ty, $about:expr $(, unit = $unit:literal)?
    ) => {
        $crate::key::Key {
            group: $group,
            convergence: $crate::key::key!(@class $class $($own)?),
            column: $crate::key::key!(@column stringify!($name), $type, $about $(, $unit)?),
        }
    };
    (@class $class:ident) => {
        $crate::convergence::Convergence::$class
    };
    (@class $class:ident $own:ident) => {
        $crate::convergence::Convergence::$own
    };
    (@column $name:expr, $type:ty, $about:expr) => {
        ::asperity_record::Column::new($name, <$type as ::asperity_record::CellValue>::KIND, $about)
    };
    (@column $name:expr, $type:ty, $about:expr, $unit:literal) => {
        ::asperity_record::Column::with_unit($name, <$type as ::asperity_record::CellValue>::KIND, $unit, $about)
    };
}

pub(crate) use key;

/// Declares a summary: generates the struct, its JSON form with a schema, its keys, and how each value is computed
/// of a run that has ended, behind `=`.
///
/// The doc comment of a field is the meaning of its key on every page. The name of a number ends in
/// its unit; a number without unit has `[unit = "1"]` after its type. Behind a group stands the class of its numbers, and
/// behind `as` that of a number of another class. Behind all may stand a summary that only some runs have.
macro_rules! summary {
    (
        $(#[doc = $about:tt])*
        pub struct $name:ident = |$run:ident: $of:ty| {
            $(
                $group:literal $class:ident {
                    $(
                        $(#[doc = $doc:tt])*
                        $field:ident: $type:ty $([unit = $unit:literal])? $(as $own:ident)? = $value:expr,
                    )+
                }
            )+
        }
        $($(#[doc = $of_part:tt])* $part:ident: $part_type:ty = $part_value:expr,)?
    ) => {
        $(#[doc = $about])*
        #[derive(Debug, Clone, Default, PartialEq, ::serde::Serialize, ::serde::Deserialize, ::schemars::JsonSchema)]
        // The schema is that of this code; in results of other code, numbers that it lacks are ignored.
        #[schemars(deny_unknown_fields)]
        pub struct $name {
            $($(
                $(#[doc = $doc])*
                pub $field: $type,
            )+)+
            $($(#[doc = $of_part])* #[serde(skip)] pub $part: $part_type,)?
        }

        impl $name {
            /// The keys in their order on pages.
            pub const KEYS: &'static [$crate::Key] = &[
                $($($crate::key::key!(
                    $group $class $(as $own)?, $field: $type, concat!($($doc,)* "")
                    $(, unit = $unit)?
                ),)+)+
            ];

            /// That of a run.
            pub(crate) fn of($run: $of) -> $name {
                $name { $($($field: $value,)+)+ $($part: $part_value,)? }
            }

            /// The value of each key, in the same order; null where the run does not determine it.
            pub fn values(&self) -> Vec<::serde_json::Value> {
                let mut all = ::serde_json::json!(self);
                $name::KEYS.iter().map(|key| all[&*key.column.name].take()).collect()
            }
        }
    };
}

pub(crate) use summary;
