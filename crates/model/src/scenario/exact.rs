//! Lists of numbers as text, to the bit: for states in scenarios, whose lists have up to a million numbers.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serializer};

/// A list of doubles as Base64 of their little-endian bytes.
pub(crate) mod numbers {
    use super::{Deserializer, Engine, Error, STANDARD, Serializer, bytes};

    pub(crate) fn serialize<S: Serializer>(values: &[f64], to: S) -> Result<S::Ok, S::Error> {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        to.serialize_str(&STANDARD.encode(bytes))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<f64>, D::Error> {
        let bytes = bytes(from)?;
        let (numbers, []) = bytes.as_chunks::<8>() else {
            return Err(D::Error::custom(format!("{} bytes of numbers of 8 bytes", bytes.len())));
        };
        let numbers: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        match numbers.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(D::Error::custom(format!("a number is {value}"))),
            None => Ok(numbers),
        }
    }
}

/// A list of whole numbers as Base64 of seven bits a byte, the lowest first, with a bit for "more": most are small.
pub(crate) mod counts {
    use super::{Deserializer, Engine, Error, STANDARD, Serializer, bytes};

    pub(crate) fn serialize<S: Serializer>(values: &[u64], to: S) -> Result<S::Ok, S::Error> {
        let mut bytes = Vec::new();
        for value in values {
            let mut rest = *value;
            while rest > 0x7f {
                bytes.push(rest as u8 | 0x80);
                rest >>= 7;
            }
            bytes.push(rest as u8);
        }
        to.serialize_str(&STANDARD.encode(bytes))
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u64>, D::Error> {
        let (mut counts, mut count, mut bits) = (Vec::new(), 0_u64, 0);
        for byte in bytes(from)? {
            let part = u64::from(byte & 0x7f);
            if bits > 63 || part << bits >> bits != part {
                return Err(D::Error::custom("a whole number of more than 64 bits"));
            }
            count |= part << bits;
            bits += 7;
            if byte & 0x80 == 0 {
                counts.push(count);
                (count, bits) = (0, 0);
            }
        }
        if bits > 0 { Err(D::Error::custom("a whole number that is cut")) } else { Ok(counts) }
    }
}

fn bytes<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<u8>, D::Error> {
    let text = String::deserialize(from)?;
    STANDARD.decode(text).map_err(D::Error::custom)
}
