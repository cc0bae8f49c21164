//! Payloads of events that say of themselves what their tables hold.

/// Declares the payload of a kind of events: the struct, its form in logs (JSON and a JSON
/// schema), and the columns of its tables, all from one list of fields.
///
/// A field is a `u32` (a count), a `u64` (a step or a number of events), an `f64`, a `bool`, or
/// an `Option` of one of them; any other [`CellValue`](crate::CellValue) will do if it can be
/// JSON. Its doc comment says on every page what the column means. The name of an `f64` ends in
/// its unit ([`unit_of`](crate::unit_of)); a number without one says `[unit = "1"]` after its
/// type.
///
/// `topic` is where the events stand in a log, `table` what the table of a replay is called after
/// the run: `NAME.longest.csv`.
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
/// assert_eq!(Event::new(&longest).payload, r#"{"event":3,"duration_s":0.25,"growth":null}"#);
/// assert_eq!(longest.cells().as_ref(), [Cell::Step(3), Cell::Number(0.25), Cell::Empty]);
/// assert_eq!(Longest::COLUMNS[1].unit, Some("s"));
/// assert_eq!(EventKind::of::<Longest>().columns[0].about, "Number of the slip event in its run, counted from 0.");
/// ```
///
/// A number whose unit is not known does not compile:
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
        table: $table:literal,
        $(#[doc = $about:tt])*
        $vis:vis struct $name:ident {
            $(
                $(#[doc = $doc:tt])*
                $field_vis:vis $field:ident: $type:ty $([unit = $unit:literal])?
            ),+ $(,)?
        }
    ) => {
        $(#[doc = $about])*
        #[derive(
            Debug,
            Clone,
            PartialEq,
            $crate::macros::serde::Serialize,
            $crate::macros::serde::Deserialize,
            $crate::macros::schemars::JsonSchema,
        )]
        #[serde(crate = "asperity_record::macros::serde", deny_unknown_fields)]
        #[schemars(crate = "asperity_record::macros::schemars")]
        $vis struct $name {
            $(
                $(#[doc = $doc])*
                $field_vis $field: $type,
            )+
        }

        impl $crate::EventPayload for $name {
            const TOPIC: &'static str = $topic;
            const TABLE: &'static str = $table;
            const COLUMNS: &'static [$crate::Column] = &[
                $($crate::payload!(
                    @column stringify!($field), $type, concat!($($doc,)* "") $(, $unit)?
                ),)+
            ];

            #[inline]
            fn cells(&self) -> impl AsRef<[$crate::Cell]> {
                [$($crate::CellValue::cell(self.$field)),+]
            }
        }

        // Looked at here, so that what is wrong with them is told where they are declared.
        const _: () = {
            assert!($crate::macros::is_event_topic($topic), "the topic of events must start with /events/");
            assert!(!<$name as $crate::EventPayload>::COLUMNS.is_empty());
        };
    };
    (@column $name:expr, $type:ty, $about:expr) => {
        $crate::Column::new($name, <$type as $crate::CellValue>::KIND, $about)
    };
    (@column $name:expr, $type:ty, $about:expr, $unit:literal) => {
        $crate::Column::with_unit($name, <$type as $crate::CellValue>::KIND, $unit, $about)
    };
}

/// What [`payload!`] needs of other crates and of this one, wherever it is used.
#[doc(hidden)]
pub mod macros {
    pub use schemars;
    pub use serde;

    /// Whether a topic is one of events.
    pub const fn is_event_topic(topic: &str) -> bool {
        crate::column::starts_with(topic.as_bytes(), b"/events/") && topic.len() > "/events/".len()
    }
}
