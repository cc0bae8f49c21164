//! Payloads of events, with a description of their tables.

/// Declares the payload of a kind of events: the struct, its form in logs (JSON and a JSON
/// schema), and the columns of its tables, all from one list of fields.
///
/// A field is a `u32` (a count), a `u64` (a step or a number of events), an `f64`, a `bool`, or an
/// `Option` of one of them, or any other [`CellValue`](crate::CellValue) with a JSON form. Its doc
/// comment is the meaning of the column on every page. The name of an `f64` ends in its unit
/// ([`unit_of`](crate::unit_of)); a number without one has `[unit = "1"]` after its type.
///
/// `[role = ROLE]` behind its type says which [`Role`](crate::Role) it has, from which range checks of logs and
/// the classes of a diff follow.
///
/// Where a field means something else in runs with contacts over an area, `[area = "..."]` behind its type,
/// its role and its unit, is its meaning there.
///
/// Fields that only runs with a [`Part`](crate::Part) have stand in a block `only PART { ... }` behind
/// the others. They are `Option`s, absent from JSON while they are `None`; tables and schemas of other
/// runs ([`EventKind::with`](crate::EventKind::with)) lack them.
///
/// `topic` is the events' topic in a log, `table` the name of a table of a replay, after the run:
/// `NAME.longest.csv`. `[derive = Default]` behind it derives that, for payloads of numbers.
///
/// ```
/// use asperity_record::{Cell, Event, EventKind, EventPayload};
///
/// asperity_record::payload! {
///     topic: "/events/longest",
///     table: "longest",
///     /// A slip event that lasted longer than all before it.
///     pub struct Longest {
///         /// Number of the slip event in its run, counted from 0.
///         pub event: u64,
///         /// How long it lasted, s.
///         pub duration_s: f64,
///         /// Its duration over that of the longest before it; null for the first.
///         pub growth: Option<f64> [unit = "1"],
///     }
/// }
///
/// let longest = Longest { event: 3, duration_s: 0.25, growth: None };
/// assert_eq!(Event::new(longest.clone()).json(), r#"{"event":3,"duration_s":0.25,"growth":null}"#);
/// assert_eq!(longest.cells().as_ref(), [Cell::Step(3), Cell::Number(0.25), Cell::Empty]);
/// assert_eq!(Longest::COLUMNS[1].unit, Some("s"));
/// assert_eq!(EventKind::of::<Longest>().columns()[0].about, "Number of the slip event in its run, counted from 0.");
/// ```
///
/// A number without a known unit is a compile-time error:
///
/// ```compile_fail
/// asperity_record::payload! {
///     topic: "/events/slow",
///     table: "slow",
///     /// A slow slip event.
///     pub struct Slow {
///         /// How slow it is.
///         pub slowness: f64,
///     }
/// }
/// ```
#[macro_export]
macro_rules! payload {
    (
        topic: $topic:literal,
        table: $table:literal $([derive = $derive:ident])?,
        $(#[doc = $about:tt])*
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $doc:tt])*
                $field_vis:vis $field:ident: $type:ty $([role = $role:ident])? $([unit = $unit:literal])? $([area = $area:literal])?
            ),+ $(,)?
        }
        $(only $part:ident {
            $(
                $(#[doc = $part_doc:tt])*
                $part_vis:vis $part_field:ident: $part_type:ty $([role = $part_role:ident])? $([unit = $part_unit:literal])?
            ),+ $(,)?
        })*
    ) => {
        $(#[doc = $about])*
        #[derive(
            Debug,
            Clone,
            PartialEq,
            $($derive,)?
            $crate::macros::serde::Serialize,
            $crate::macros::serde::Deserialize,
            $crate::macros::schemars::JsonSchema,
        )]
        #[serde(crate = "asperity_record::macros::serde")]
        #[schemars(crate = "asperity_record::macros::schemars")]
        $vis struct $name {
            $(
                $(#[doc = $doc])*
                $field_vis $field: $type,
            )+
            $($(
                $(#[doc = $part_doc])*
                #[serde(default, skip_serializing_if = "Option::is_none")]
                $part_vis $part_field: $part_type,
            )+)*
        }

        impl $crate::EventPayload for $name {
            const TOPIC: &'static str = $topic;
            const TABLE: &'static str = $table;
            const COLUMNS: &'static [$crate::Column] = &[
                $($crate::payload!(
                    @column stringify!($field), $type, concat!($($doc,)* "") $(, $unit)?
                ).with_role($crate::payload!(@role $($role)?), <$type as $crate::CellValue>::IS_OPTIONAL)$(.over_area($area))?,)+
                $($($crate::payload!(
                    @column stringify!($part_field), $part_type, concat!($($part_doc,)* "") $(, $part_unit)?
                ).with_role($crate::payload!(@role $($part_role)?), <$part_type as $crate::CellValue>::IS_OPTIONAL).only($crate::Part::$part),)+)*
            ];

            #[inline]
            fn cells(&self) -> impl AsRef<[$crate::Cell]> {
                [
                    $($crate::CellValue::cell(::std::borrow::ToOwned::to_owned(&self.$field)),)+
                    $($($crate::CellValue::cell(self.$part_field),)+)*
                ]
            }
        }

        // Evaluated here, so that the compiler reports errors at the declaration.
        const _: () = {
            assert!($crate::macros::is_topic($topic), "a topic is /NAME, that of events /events/NAME");
            assert!(!<$name as $crate::EventPayload>::COLUMNS.is_empty());
        };
    };
    (@role) => {
        None
    };
    (@role $role:ident) => {
        Some($crate::Role::$role)
    };
    (@column $name:expr, $type:ty, $about:expr) => {
        $crate::Column::new($name, <$type as $crate::CellValue>::KIND, $about)
    };
    (@column $name:expr, $type:ty, $about:expr, $unit:literal) => {
        $crate::Column::with_unit($name, <$type as $crate::CellValue>::KIND, $unit, $about)
    };
}

/// Items that [`payload!`] uses in any crate.
#[doc(hidden)]
pub mod macros {
    pub use schemars;
    pub use serde;

    /// Whether a topic has a name.
    pub const fn is_topic(topic: &str) -> bool {
        let is_event = crate::column::starts_with(topic.as_bytes(), b"/events/");
        crate::column::starts_with(topic.as_bytes(), b"/") && topic.len() > if is_event { 8 } else { 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::macros::is_topic;

    #[test]
    fn a_topic_has_a_name() {
        assert_eq!(
            ["/events/a", "/events/", "/", "step", "/step"].map(is_topic),
            [true, false, false, false, true]
        );
    }
}
