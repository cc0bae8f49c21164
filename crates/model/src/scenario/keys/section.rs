//! A section of a scenario: its keys are its fields, each declared once with type, default, range, symbol and meaning.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde::de::value::SeqDeserializer;
use toml::Value;

use crate::scenario::key::Key;

/// Declares a section: `field: type = default; kind, "symbol";`. The comment is the meaning of the key, unless
/// one follows behind `=>`. With `as_stated` behind it a default is that of the set as-coded. A key that came `later` is
/// not written at its default, so that hashes of scenarios without it stay the same. What it `needs` to have another
/// value than its default stands at the end. A `list` of tables behind the fields may be left out.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        $name:ident $path:literal {
            $(
                $(#[doc = $doc:literal])+
                $field:ident: $type:ident $(= $default:expr $(, as_stated $stated:expr)?)?;
                $kind:expr $(, $symbol:literal)? $(=> $meaning:expr)? $(; needs $needs:expr)?;
            )+
        }
        $($(#[doc = $of_list:literal])+ list $list:ident: $item:ident;)?
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[doc = $doc])+ pub $field: $type,)+
            $($(#[doc = $of_list])+ #[serde(default)] pub $list: Vec<$item>,)?
        }

        impl $name {
            /// Its keys, in the order in which they are shown.
            pub(crate) fn keys() -> &'static [$crate::scenario::key::Key] {
                static KEYS: std::sync::LazyLock<Vec<$crate::scenario::key::Key>> =
                    std::sync::LazyLock::new(|| vec![$($crate::scenario::key::Key {
                        path: concat!($path, stringify!($field)),
                        symbol: concat!($($symbol)?),
                        doc: $crate::scenario::keys::section::meaning!(concat!($($doc),+) $(, $meaning)?),
                        kind: $kind,
                        defaults: $crate::scenario::keys::section::defaults!($($default $(, $stated)?)?),
                        needs: const { $crate::scenario::keys::section::needs!($($needs)?) },
                    }),+]);
                &KEYS
            }

            /// Its values, in the order of its keys, and last its list.
            pub(crate) fn values(&self) -> Vec<toml::Value> {
                use $crate::scenario::keys::section::value;
                vec![$(value(&self.$field),)+ $(value(&self.$list),)?]
            }
        }
    };
}

/// The value of a field.
pub(crate) fn value(field: &impl Serialize) -> Value {
    Value::try_from(field).expect("fields are numbers, words, flags, texts and lists")
}

/// The section with the next values, one for each of its keys.
pub(crate) fn of<T: DeserializeOwned>(keys: &[Key], values: &mut impl Iterator<Item = Value>) -> T {
    let values = SeqDeserializer::<_, toml::de::Error>::new(values.take(keys.len()));
    T::deserialize(values).expect("what keys accept is of the types of their fields")
}

/// What a key means: its comment, or what is given instead.
macro_rules! meaning {
    ($doc:expr) => {
        $doc.trim_ascii()
    };
    ($doc:expr, $meaning:expr) => {
        $meaning
    };
}

/// What a key needs to have a meaning, if anything.
macro_rules! needs {
    () => {
        &[]
    };
    ($needs:expr) => {
        $needs
    };
}

/// The defaults of a key in the sets as-coded and as-stated, if it has any.
macro_rules! defaults {
    () => {
        None
    };
    ($value:expr) => {
        Some([$value, $value].map(toml::Value::from))
    };
    ($coded:expr, $stated:expr) => {
        Some([$coded, $stated].map(toml::Value::from))
    };
}

pub(crate) use {defaults, meaning, needs, section};
