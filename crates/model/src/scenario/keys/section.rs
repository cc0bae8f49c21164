//! A section of a scenario: its keys are its fields, each declared once with type, default, range, symbol and meaning.

use toml::Value;

use crate::scenario::key::Key;

/// A section with its keys.
pub(crate) trait Section {
    /// Its keys, in the order in which they are shown.
    fn keys() -> &'static [Key];

    /// Their values.
    fn values(&self) -> Vec<Value>;

    /// Whether all of them are the defaults.
    fn is_default(&self) -> bool {
        Self::keys().iter().zip(self.values()).all(|(key, value)| key.has_default(&value))
    }
}

/// Declares a section: `field: type = default; kind, "symbol", later;`. The comment is the meaning of the key, unless
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
                $kind:expr $(, $symbol:literal)? $(, $later:ident)? $(=> $meaning:expr)? $(; needs $needs:expr)?;
            )+
        }
        $($(#[doc = $of_list:literal])+ list $list:ident: $item:ident;)?
    ) => {
        $(#[doc = $about])+
        #[derive(Debug, Clone, PartialEq, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            $($(#[doc = $doc])+ pub $field: $type,)+
            $($(#[doc = $of_list])+ #[serde(default)] pub $list: Vec<$item>,)?
        }

        impl $crate::scenario::keys::section::Section for $name {
            fn keys() -> &'static [$crate::scenario::key::Key] {
                static KEYS: std::sync::LazyLock<Vec<$crate::scenario::key::Key>> =
                    std::sync::LazyLock::new(|| vec![$($crate::scenario::key::Key {
                        path: concat!($path, stringify!($field)),
                        symbol: concat!($($symbol)?),
                        doc: $crate::scenario::keys::section::meaning!(concat!($($doc),+) $(, $meaning)?),
                        kind: $kind,
                        is_later: !concat!($(stringify!($later))?).is_empty(),
                        defaults: $crate::scenario::keys::section::defaults!($($default $(, $stated)?)?),
                        needs: const { $crate::scenario::keys::section::needs!($($needs)?) },
                    }),+]);
                &KEYS
            }

            fn values(&self) -> Vec<toml::Value> {
                let values = [$(toml::Value::try_from(&self.$field)),+];
                values.map(|value| value.expect("it is a plain number, text or list")).into()
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                use serde::ser::SerializeMap;
                use $crate::scenario::keys::section::Section;
                let mut fields = serializer.serialize_map(None)?;
                for (key, value) in Self::keys().iter().zip(self.values()) {
                    if !(key.is_later && key.has_default(&value)) {
                        fields.serialize_entry(key.name(), &value)?;
                    }
                }
                $(
                    if !self.$list.is_empty() {
                        fields.serialize_entry(stringify!($list), &self.$list)?;
                    }
                )?
                fields.end()
            }
        }
    };
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
