//! Edits a sound log as directed by a string of bytes, and makes it consistent again: so a fuzzer that
//! knows nothing of MCAP passes checksums, lengths and digest with every input.

use mcap::records::op;

use super::packing::{Packing, put_together};
use super::parts::{MESSAGE_HEAD, Part, correct_end};

/// Values at the limits of their ranges.
const VALUES: [&str; 36] = [
    "0",
    "1",
    "-1",
    "2",
    "0.5",
    "-0.0",
    "1e-320",
    "1e308",
    "1e999",
    "-1e999",
    "255",
    "256",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "18446744073709551615",
    "18446744073709551616",
    "null",
    "true",
    "\"\"",
    "\"detach\"",
    "\"attach\"",
    "[]",
    "[1]",
    "{}",
    "NaN",
    "Infinity",
    "complete",
    "interrupted",
    "salvaged",
    "100000",
    "",
    "1e-8",
];

/// The bytes of an input, taken from the front; 0 when they are used up.
struct Script<'a>(&'a [u8]);

impl Script<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    fn below(&mut self, bound: usize) -> usize {
        let number = usize::from(self.byte()) | usize::from(self.byte()) << 8;
        number % bound.max(1)
    }

    fn long(&mut self) -> u64 {
        // Mostly small or nearly the largest, where lengths go wrong.
        match self.byte() {
            kind @ 0..128 => u64::from(kind),
            kind @ 128..192 => u64::MAX - u64::from(kind - 128),
            kind => 1u64 << (kind - 192),
        }
    }

    fn bytes(&mut self) -> Vec<u8> {
        let length = usize::from(self.byte()).min(self.0.len());
        let (taken, rest) = self.0.split_at(length);
        self.0 = rest;
        taken.to_vec()
    }
}

/// The log that a script makes of a sound one.
pub fn edited(sound: &[Part], script: &[u8]) -> Vec<u8> {
    let mut script = Script(script);
    let flags = script.byte();
    let mut parts = sound.to_vec();
    while !script.0.is_empty() {
        edit(&mut parts, &mut script);
        if parts.is_empty() || parts.len() > 4 * sound.len() {
            break;
        }
    }
    if flags & 1 == 0 {
        correct_end(&mut parts);
    }
    let per_chunk = [1000, 1, 7, 0][usize::from(flags >> 1 & 3)];
    put_together(&parts, Packing { per_chunk, data_crc: flags & 8 == 0 })
}

fn edit(parts: &mut Vec<Part>, script: &mut Script<'_>) {
    let kind = script.byte() % 16;
    let at = script.below(parts.len());
    match kind {
        0 => {
            parts.remove(at);
        }
        1 => {
            let to = script.below(parts.len());
            let copy = parts[at].clone();
            parts.insert(to, copy);
        }
        2 => {
            let other = script.below(parts.len());
            parts.swap(at, other);
        }
        3 => {
            let place = script.below(parts[at].body.len());
            let byte = script.byte();
            if let Some(old) = parts[at].body.get_mut(place) {
                *old = byte;
            }
        }
        4 => {
            let length = script.below(parts[at].body.len() + 1);
            parts[at].body.truncate(length);
        }
        5 => {
            let part = Part::new(script.byte(), script.bytes());
            parts.insert(at, part);
        }
        // Most checks concern values.
        6..=9 => value(&mut parts[at], script),
        10 => {
            let bytes = script.bytes();
            parts[at].body.extend(bytes);
        }
        11 => {
            let from = at.min(parts.len() - 1);
            let to = (from + 1 + usize::from(script.byte() % 32)).min(parts.len());
            let again = parts[from..to].to_vec();
            let place = script.below(parts.len() + 1);
            parts.splice(place..place, again);
        }
        12 => {
            let records = script.bytes();
            let compression = ["", "zstd", "lz4", "none"][usize::from(script.byte() % 4)];
            let crc = if script.byte() & 1 == 0 { 0 } else { crc32fast::hash(&records) };
            let part = Part::chunk_of(script.long(), crc, compression, script.long(), &records);
            parts.insert(at, part);
        }
        13 => {
            // A chunk in a chunk, or a message alone.
            let part = Part::chunk(&parts[at..(at + 2).min(parts.len())]);
            parts[at] = part;
        }
        14 => {
            let id = u16::from(script.byte() % 10).to_le_bytes();
            if parts[at].channel_id().is_some() {
                parts[at].body[..2].copy_from_slice(&id);
            }
        }
        _ => {
            let data = script.bytes();
            let name = ["scenario.toml", "checkpoint", "other"][usize::from(script.byte() % 3)];
            parts.insert(at, Part::attachment(name, &data));
        }
    }
}

/// Puts another value in the place of one of a message or of metadata.
fn value(part: &mut Part, script: &mut Script<'_>) {
    let chosen = usize::from(script.byte());
    let value = VALUES[usize::from(script.byte()) % VALUES.len()];
    if let (Some(mut map), Some(name)) = (part.map(), part.name().map(str::to_owned)) {
        let key = map.keys().nth(chosen % map.len().max(1)).cloned().unwrap_or_default();
        map.insert(key, value.to_owned());
        *part = Part::metadata(&name, &map);
        return;
    }
    let Some(payload) = part.payload() else { return };
    // Values lie between a colon or a separator of a list and the next of these.
    let starts: Vec<usize> =
        (1..payload.len()).filter(|&at| matches!(payload[at - 1], b':' | b',' | b'[')).collect();
    let Some(&start) = starts.get(chosen % starts.len().max(1)) else { return };
    let end =
        (start..payload.len()).find(|&at| matches!(payload[at], b',' | b'}' | b']')).unwrap_or(payload.len());
    let mut changed = payload[..start].to_vec();
    changed.extend(value.as_bytes());
    changed.extend(&payload[end..]);
    part.body.truncate(MESSAGE_HEAD);
    part.body.extend(changed);
    debug_assert_eq!(part.opcode, op::MESSAGE);
}
