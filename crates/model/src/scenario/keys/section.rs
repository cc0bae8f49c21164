//! A section of a scenario: its keys are its fields, each declared once with type, default, range, symbol and meaning.

/// Declares a section: `field: type = default; kind, "symbol";`. The comment is the meaning of the key, unless one
/// follows behind `=>`. With `as_stated` behind it a default is that of the set as-coded. What it `needs` to have
/// another value than its default stands at the end. A `list` of tables behind the fields may be left out.
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
            pub(crate) const KEYS: &[$crate::scenario::key::Key] = &[$($crate::scenario::key::Key {
                path: concat!($path, stringify!($field)),
                symbol: concat!($($symbol)?),
                doc: $crate::scenario::keys::section::meaning!(concat!($($doc),+) $(, $meaning)?),
                kind: $kind,
                default: $crate::scenario::keys::section::default!($type $(, $default $(, $stated)?)?),
                needs: $crate::scenario::keys::section::needs!($($needs)?),
            }),+];
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

pub(crate) use {default, meaning, needs, section, value};
