//! A section of a scenario: its keys are its fields, each declared once with type, default, range, symbol and meaning.

/// Declares a section: `field: type = default; kind, "symbol", later;`. The comment is the meaning of the key, unless
/// one follows behind `=>`. With `as_stated` behind it a default is that of the set as-coded. A key that came `later` is
/// not written at its default, so that hashes of scenarios without it stay the same. What it `needs` to have another
/// value than its default stands at the end. An `optional` section may be left out, and a `list` of tables behind the
/// fields too.
macro_rules! section {
    (
        $(#[doc = $about:literal])+
        $name:ident $path:literal $($optional:ident)? {
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

        impl $name {
            /// Its keys, in the order in which they are shown.
            pub(crate) const KEYS: &[$crate::scenario::key::Key] = &[$($crate::scenario::key::Key {
                path: concat!($path, stringify!($field)),
                symbol: concat!($($symbol)?),
                doc: $crate::scenario::keys::section::meaning!(concat!($($doc),+) $(, $meaning)?),
                kind: $kind,
                default: $crate::scenario::keys::section::default!($type $(, $default $(, $stated)?)?),
                needs: $crate::scenario::keys::section::needs!($($needs)?),
            }),+];
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                use serde::ser::SerializeStruct;
                let mut fields = serializer.serialize_struct(stringify!($name), Self::KEYS.len())?;
                $(
                    let is_later = !concat!($(stringify!($later))?).is_empty();
                    if !is_later || !$crate::scenario::keys::section::is_default!(self.$field, $type $(, $default)?) {
                        fields.serialize_field(stringify!($field), &self.$field)?;
                    }
                )+
                $(
                    if !self.$list.is_empty() {
                        fields.serialize_field(stringify!($list), &self.$list)?;
                    }
                )?
                fields.end()
            }
        }

        $crate::scenario::keys::section::optional!([$($optional)?] $name $(, $field $type [$($default)?])+);
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

/// A default as a value of the type of its field.
macro_rules! value {
    (f64, $value:expr) => {
        $crate::scenario::key::Value::Number($value)
    };
    (u32, $value:expr) => {
        $crate::scenario::key::Value::Count($value)
    };
    (bool, $value:expr) => {
        $crate::scenario::key::Value::Flag($value)
    };
    (List, $value:expr) => {
        $crate::scenario::key::Value::NoNumbers
    };
    ($word:ident, $value:expr) => {
        $crate::scenario::key::Value::Text($value)
    };
}

/// The default of a key.
macro_rules! default {
    ($type:ident) => {
        $crate::scenario::key::Default::Required
    };
    ($type:ident, $value:expr) => {
        $crate::scenario::key::Default::Is($crate::scenario::keys::section::value!($type, $value))
    };
    ($type:ident, $coded:expr, $stated:expr) => {
        $crate::scenario::key::Default::BySet {
            as_coded: $crate::scenario::keys::section::value!($type, $coded),
            as_stated: $crate::scenario::keys::section::value!($type, $stated),
        }
    };
}

/// The default of a key as its field has it.
macro_rules! field {
    (f64, $value:expr) => {
        $value
    };
    (u32, $value:expr) => {
        $value
    };
    (bool, $value:expr) => {
        $value
    };
    (String, $value:expr) => {
        String::from($value)
    };
    ($type:ident, $value:expr) => {
        <$type as Default>::default()
    };
}

/// Whether a field has the default of its key.
macro_rules! is_default {
    ($field:expr, $type:ident) => {
        false
    };
    ($field:expr, $type:ident, $default:expr) => {
        $crate::scenario::keys::section::is_same(
            &$field,
            &$crate::scenario::keys::section::field!($type, $default),
        )
    };
}

/// Whether two values of a key are the same.
pub(crate) fn is_same<T: PartialEq>(a: &T, b: &T) -> bool {
    a == b
}

/// Makes an optional section begin with all keys at their defaults.
macro_rules! optional {
    ([] $($rest:tt)*) => {};
    ([optional] $name:ident $(, $field:ident $type:ident [$default:expr])+) => {
        impl Default for $name {
            fn default() -> $name {
                $name { $($field: $crate::scenario::keys::section::field!($type, $default)),+ }
            }
        }
    };
}

pub(crate) use {default, field, is_default, meaning, needs, optional, section, value};
