//! Selects the chunks of a damaged file that belong to the run to be salvaged, and orders them.
//!
//! From version 3 on the records `chunk` determine this. A chunk is kept if a record of this run
//! names its checksum (its own record, or the following one), and is placed by its number, wherever
//! in the file it was found. The run to be salvaged must be confirmed by a header or a scenario;
//! among several, it is the one that most of these records name.
//!
//! Older logs have only the numbers and times of messages. Chunks are ordered by time. Where two
//! contradict each other under one number, two runs were mixed: chunks whose numbers continue each
//! other form stretches, and of two contradictory stretches the later one in the file is dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};

use asperity_record::{RunEnd, RunHeader, counted};

use crate::findings::Damage;
use crate::seal::Seal;
use crate::walk::Message;

/// A chunk or checkpoint whose checksum is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) at: u64,
    pub(crate) end: u64,
    pub(crate) crc: u32,
    pub(crate) is_chunk: bool,
}

/// The contents of a file other than messages.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) headers: Vec<RunHeader>,
    /// With their checksums.
    pub(crate) scenarios: Vec<(u32, String)>,
    pub(crate) ends: Vec<(u32, RunEnd)>,
    pub(crate) entries: Vec<Entry>,
    /// With their offsets, in order.
    pub(crate) seals: Vec<(u64, Seal)>,
    /// The unknown format version of a header, if there is one.
    pub(crate) newer: Option<u32>,
}

/// The parts kept, in order, and remarks about the rest.
#[derive(Default)]
pub(crate) struct Kept {
    pub(crate) entries: Vec<Entry>,
    /// Offsets of entries before which a number is missing.
    pub(crate) after_missing: BTreeSet<u64>,
    pub(crate) damage: Vec<Damage>,
    pub(crate) remarks: Vec<String>,
}

/// The records `chunk` of one run.
pub(crate) struct Run<'a> {
    pub(crate) id: &'a str,
    /// The numbers of each checksum.
    numbers: BTreeMap<u32, BTreeSet<u64>>,
}

impl Found {
    /// The run that most records `chunk` name among those that a header or a scenario confirms;
    /// None if there is none.
    pub(crate) fn run(&self) -> Option<Run<'_>> {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for (_, seal) in &self.seals {
            *counts.entry(&seal.run_id).or_insert(0) += 1;
        }
        let mut confirmed: BTreeSet<&str> =
            self.headers.iter().map(|header| header.run_id.as_str()).collect();
        for (crc, _) in &self.scenarios {
            confirmed.extend(
                self.seals.iter().filter(|(_, seal)| ties(seal, *crc)).map(|(_, seal)| &*seal.run_id),
            );
        }
        counts.retain(|id, _| confirmed.contains(id));
        let most = counts.values().max().copied()?;
        // Among equals, the first.
        let (_, first) = self.seals.iter().find(|(_, seal)| counts.get(&*seal.run_id) == Some(&most))?;
        let id = first.run_id.as_str();
        let mut numbers: BTreeMap<u32, BTreeSet<u64>> = BTreeMap::new();
        for (_, seal) in self.seals.iter().filter(|(_, seal)| seal.run_id == id) {
            numbers.entry(seal.crc).or_default().insert(seal.number);
            if let Some(before) = seal.number.checked_sub(1) {
                numbers.entry(seal.before_crc).or_default().insert(before);
            }
        }
        Some(Run { id, numbers })
    }

    /// The scenario named by the records `chunk` of a run.
    pub(crate) fn scenario_of(&self, run: &Run<'_>) -> Option<&str> {
        let of_run = |crc: u32| self.seals.iter().any(|(_, seal)| seal.run_id == run.id && ties(seal, crc));
        let named = self.scenarios.iter().find(|(crc, _)| of_run(*crc));
        named.map(|(_, text)| text.as_str())
    }

    /// Selects and orders the entries of a run.
    pub(crate) fn keep(&self, run: &Run<'_>) -> Kept {
        let mut kept = Kept::default();
        let mut numbered: Vec<(u64, Entry)> = Vec::new();
        let mut taken = BTreeSet::new();
        let mut twice = 0;
        for (place, entry) in self.entries.iter().enumerate() {
            let next_at = self.entries.get(place + 1).map_or(u64::MAX, |next| next.at);
            let first = self.seals.partition_point(|(at, _)| *at < entry.end);
            let own = self.seals.get(first).filter(|(at, _)| *at < next_at).map(|(_, seal)| seal);
            let Some(numbers) = run.numbers.get(&entry.crc) else {
                let kind = if entry.is_chunk { "a chunk" } else { "a checkpoint" };
                let what = match own {
                    Some(seal) if seal.run_id != run.id => format!("{kind} of another run, {}", seal.run_id),
                    _ => format!("{kind} that no record `chunk` of this run names"),
                };
                kept.damage.push(Damage { from_byte: entry.at, to_byte: entry.end, what });
                continue;
            };
            let own =
                own.filter(|seal| seal.run_id == run.id && seal.crc == entry.crc).map(|seal| seal.number);
            let number = own.or(numbers.first().copied()).unwrap_or_default();
            if taken.insert((number, entry.crc)) {
                numbered.push((number, *entry));
            } else {
                twice += 1;
            }
        }
        if !numbered.is_sorted_by_key(|(number, _)| *number) {
            kept.remarks.push("chunks stood out of their order, and were put back".to_owned());
            numbered.sort_by_key(|(number, entry)| (*number, entry.at));
        }
        if twice > 0 {
            kept.remarks.push(format!("{} stood there twice", counted(twice, "chunk")));
        }
        let mut before = 0;
        for (number, entry) in numbered {
            if number > before + 1 {
                kept.after_missing.insert(entry.at);
            }
            before = number;
            kept.entries.push(entry);
        }
        kept
    }

    /// The end of a run, if the records `chunk` name it.
    pub(crate) fn end_of(&self, run: &Run<'_>) -> Option<&RunEnd> {
        self.ends.iter().find(|(crc, _)| run.numbers.contains_key(crc)).map(|(_, end)| end)
    }

    /// Keeps no entries, since none identifies the run of the log.
    pub(crate) fn keep_none(&self) -> Kept {
        let refused = |entry: &Entry| Damage {
            from_byte: entry.at,
            to_byte: entry.end,
            what: "a chunk or checkpoint, and no record `chunk` is left to say of which run".to_owned(),
        };
        Kept { damage: self.entries.iter().map(refused).collect(), ..Kept::default() }
    }
}

/// Whether a record `chunk` names a scenario with that checksum as that of its run.
fn ties(seal: &Seal, crc: u32) -> bool {
    match seal.number {
        0 => seal.crc == crc,
        1 => seal.before_crc == crc,
        _ => false,
    }
}

/// The messages of a chunk of an old log, reduced to what determines order and contradictions.
pub(crate) struct Outline {
    entry: Entry,
    /// The first and last number of each topic.
    numbers: BTreeMap<String, (u32, u32)>,
    /// The times of the first and last message.
    times: (u64, u64),
    first_step: u64,
}

impl Outline {
    pub(crate) fn new(entry: Entry, messages: &[Message]) -> Outline {
        let mut outline = Outline { entry, numbers: BTreeMap::new(), times: (0, 0), first_step: 0 };
        for message in messages {
            let range = outline.numbers.entry(message.topic.clone()).or_insert((message.sequence, 0));
            *range = (range.0.min(message.sequence), range.1.max(message.sequence));
        }
        if let (Some(first), Some(last)) = (messages.first(), messages.last()) {
            outline.times = (first.time_ns, last.time_ns);
        }
        outline.first_step = messages.iter().find_map(Message::step).unwrap_or_default();
        outline
    }

    /// Whether the numbers of every topic continue those of the previous chunks.
    fn follows(&self, next: &BTreeMap<String, u32>) -> bool {
        self.numbers.iter().all(|(topic, (first, _))| next.get(topic).is_none_or(|next| next == first))
    }
}

/// Orders the chunks of an old log, and drops those that contradict others. `read` reads the
/// messages of a chunk again.
///
/// # Errors
/// Errors of `read`.
pub(crate) fn keep_old<E>(
    outlines: Vec<Outline>,
    mut read: impl FnMut(&Entry) -> Result<Vec<Message>, E>,
) -> Result<Kept, E> {
    let mut kept = Kept::default();
    // Stretches of the file in which each chunk continues the previous one.
    let mut stretches = Vec::new();
    let mut next: BTreeMap<String, u32> = BTreeMap::new();
    let mut stretch = 0;
    for outline in &outlines {
        if !outline.follows(&next) {
            stretch += 1;
            next.clear();
        }
        next.extend(outline.numbers.iter().map(|(topic, (_, last))| (topic.clone(), last.saturating_add(1))));
        stretches.push(stretch);
    }
    let mut refused: BTreeSet<usize> = BTreeSet::new();
    let mut said: BTreeMap<(String, u32), (u64, usize)> = BTreeMap::new();
    for number in overlapping(&outlines) {
        for message in read(&outlines[number].entry)? {
            let mut hasher = DefaultHasher::new();
            (message.time_ns, &message.payload).hash(&mut hasher);
            let what = (hasher.finish(), stretches[number]);
            let first = *said.entry((message.topic, message.sequence)).or_insert(what);
            if first.0 != what.0 && !refused.contains(&first.1) {
                refused.insert(stretches[number].max(first.1));
            }
        }
    }
    let mut in_order = Vec::new();
    for (outline, stretch) in outlines.into_iter().zip(stretches) {
        if refused.contains(&stretch) {
            let what = "a chunk that contradicts others before it: it is of another run".to_owned();
            let Entry { at, end, .. } = outline.entry;
            kept.damage.push(Damage { from_byte: at, to_byte: end, what });
        } else {
            in_order.push(outline);
        }
    }
    let key = |outline: &Outline| (outline.times, outline.first_step);
    if !in_order.is_sorted_by_key(key) {
        kept.remarks.push("chunks stood out of their order, and were put back".to_owned());
        in_order.sort_by_key(key);
    }
    kept.entries = in_order.into_iter().map(|outline| outline.entry).collect();
    Ok(kept)
}

/// The chunks that share a message's number with another one, in the order of the file.
fn overlapping(outlines: &[Outline]) -> BTreeSet<usize> {
    let mut ranges: BTreeMap<&str, Vec<(u32, u32, usize)>> = BTreeMap::new();
    for (number, outline) in outlines.iter().enumerate() {
        for (topic, (first, last)) in &outline.numbers {
            ranges.entry(topic).or_default().push((*first, *last, number));
        }
    }
    let mut found = BTreeSet::new();
    for mut of_topic in ranges.into_values() {
        of_topic.sort_unstable();
        // Everything since `from` overlaps the next chunk.
        let mut end: Option<(u32, usize)> = None;
        for (first, last, number) in of_topic {
            match end {
                Some((reach, holder)) if first <= reach => {
                    found.extend([holder, number]);
                    if last > reach {
                        end = Some((last, number));
                    }
                }
                _ => end = Some((last, number)),
            }
        }
    }
    found
}
