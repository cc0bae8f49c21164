//! Units of laboratory files.

use serde::Deserialize;

/// What a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// A length, m.
    Length,
    /// A force, N.
    Force,
    /// A time, s.
    Time,
    /// A force on an area, Pa.
    Stress,
    /// A number without unit, such as a strain.
    Ratio,
    /// An electric signal, such as that of an acoustic sensor, V.
    Voltage,
}

impl Quantity {
    /// Its name in messages.
    pub fn words(self) -> String {
        format!("a {self:?}").to_lowercase()
    }
}

/// A unit, as it is written.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct Unit {
    /// Its name.
    pub name: String,
    /// What it measures.
    pub quantity: Quantity,
    /// How many SI units it is.
    pub scale: f64,
}

/// SI prefixes with their powers of ten; `u` and both signs for micro are the same.
const PREFIXES: [(&str, i32); 9] =
    [("", 0), ("n", -9), ("u", -6), ("\u{b5}", -6), ("\u{3bc}", -6), ("m", -3), ("k", 3), ("M", 6), ("G", 9)];

/// Units with prefixes.
const BASES: [(&str, Quantity); 6] = [
    ("m", Quantity::Length),
    ("N", Quantity::Force),
    ("s", Quantity::Time),
    ("Pa", Quantity::Stress),
    ("V", Quantity::Voltage),
    ("strain", Quantity::Ratio),
];

/// Units without.
const OTHERS: [(&str, Quantity, f64); 4] = [
    ("1", Quantity::Ratio, 1.0),
    ("%", Quantity::Ratio, 1e-2),
    ("cm", Quantity::Length, 1e-2),
    ("bar", Quantity::Stress, 1e5),
];

impl Unit {
    /// The unit of this name; none of an unknown one.
    ///
    /// ```
    /// use asperity_recording::unit::{Quantity, Unit};
    ///
    /// let of = |name| Unit::of(name).map(|unit| (unit.quantity, unit.scale));
    /// assert_eq!(of("kN"), Some((Quantity::Force, 1e3)));
    /// assert_eq!(of("um"), Some((Quantity::Length, 1e-6)));
    /// assert_eq!(of("furlong"), None);
    /// ```
    pub fn of(name: &str) -> Option<Unit> {
        let with_prefix = BASES.iter().find_map(|(base, quantity)| {
            let prefix = name.strip_suffix(base)?;
            let (_, power) = PREFIXES.iter().find(|(known, _)| *known == prefix)?;
            // A quotient is the nearest double of a negative power.
            Some((*quantity, if *power < 0 { 1.0 / 10f64.powi(-power) } else { 10f64.powi(*power) }))
        });
        let other =
            OTHERS.iter().find(|(known, ..)| *known == name).map(|(_, quantity, scale)| (*quantity, *scale));
        let (quantity, scale) = with_prefix.or(other)?;
        Some(Unit { name: name.to_owned(), quantity, scale })
    }
}

impl TryFrom<String> for Unit {
    type Error = &'static str;

    fn try_from(name: String) -> Result<Unit, &'static str> {
        Unit::of(&name).ok_or("accepted: 1, or N, m, s, Pa, V, strain with a prefix n, u, m, k, M, G")
    }
}
