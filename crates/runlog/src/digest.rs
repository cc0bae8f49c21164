//! The digests in `run_end`: one over all messages, and one per topic, which compare logs with
//! different sets of topics. The documentation of the crate defines them, so that other programs
//! can compute them.
//!
//! Lengths precede the contents, so that different sequences of messages give different bytes. The
//! order of messages of different topics enters `digest` only.

use std::collections::BTreeMap;

/// Bytes hashed at once. BLAKE3 hashes long inputs several times faster than single messages, so
/// that the batch pays for the second digest.
const BATCH_BYTES: usize = 1 << 18;

/// The digests of the messages so far.
#[derive(Debug, Default)]
pub(crate) struct Digests {
    all: blake3::Hasher,
    topics: Vec<blake3::Hasher>,
    /// The index of each topic's hash.
    numbers: BTreeMap<String, usize>,
    /// Messages that have not been hashed, in the hashed format.
    batch: Vec<u8>,
    /// The topic and the end of each message in the batch.
    ends: Vec<(usize, usize)>,
    /// The messages of one topic in the batch.
    of_topic: Vec<u8>,
}

impl Digests {
    /// Adds the next message.
    pub(crate) fn add(&mut self, topic: &str, payload: &[u8]) {
        let number = match self.numbers.get(topic) {
            Some(number) => *number,
            None => {
                self.topics.push(blake3::Hasher::new());
                self.numbers.insert(topic.to_owned(), self.topics.len() - 1);
                self.topics.len() - 1
            }
        };
        for bytes in [topic.as_bytes(), payload] {
            self.batch.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
            self.batch.extend_from_slice(bytes);
        }
        self.ends.push((number, self.batch.len()));
        if self.batch.len() >= BATCH_BYTES {
            self.hash_batch();
        }
    }

    /// The digest of all messages, and those of the given topics, with or without messages.
    pub(crate) fn finish<'a>(
        &mut self,
        topics: impl IntoIterator<Item = &'a String>,
    ) -> (String, BTreeMap<String, String>) {
        self.hash_batch();
        let nothing = blake3::Hasher::new();
        let text = |hasher: &blake3::Hasher| hasher.finalize().to_hex().to_string();
        let of_topic = |topic: &String| match self.numbers.get(topic) {
            Some(number) => text(&self.topics[*number]),
            None => text(&nothing),
        };
        let topics = topics.into_iter().map(|topic| (topic.clone(), of_topic(topic))).collect();
        (text(&self.all), topics)
    }

    fn hash_batch(&mut self) {
        self.all.update(&self.batch);
        let mut from = 0;
        let mut stretches: Vec<(usize, std::ops::Range<usize>)> = Vec::new();
        for (number, end) in self.ends.drain(..) {
            match stretches.last_mut() {
                Some((last, stretch)) if *last == number => stretch.end = end,
                _ => stretches.push((number, from..end)),
            }
            from = end;
        }
        // A stable sort keeps the order of messages within a topic.
        stretches.sort_by_key(|(number, _)| *number);
        for of_topic in stretches.chunk_by(|(a, _), (b, _)| a == b) {
            let hasher = &mut self.topics[of_topic[0].0];
            if let [(_, stretch)] = of_topic {
                hasher.update(&self.batch[stretch.clone()]);
                continue;
            }
            self.of_topic.clear();
            for (_, stretch) in of_topic {
                self.of_topic.extend_from_slice(&self.batch[stretch.clone()]);
            }
            hasher.update(&self.of_topic);
        }
        self.batch.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{BATCH_BYTES, Digests};

    /// The definition in the documentation of the crate, message by message.
    fn digest<'a>(messages: impl Iterator<Item = &'a (String, Vec<u8>)>) -> String {
        let mut hasher = blake3::Hasher::new();
        for (topic, payload) in messages {
            hasher.update(&(topic.len() as u64).to_le_bytes()).update(topic.as_bytes());
            hasher.update(&(payload.len() as u64).to_le_bytes()).update(payload);
        }
        hasher.finalize().to_hex().to_string()
    }

    #[test]
    fn digests_are_those_of_messages_one_by_one() {
        // Shorter than a batch, longer, empty, and exactly full.
        for lengths in [vec![], vec![0, 1, 2, 3], vec![100; 5000], vec![3 * BATCH_BYTES, 0, 7, BATCH_BYTES]] {
            let messages: Vec<(String, Vec<u8>)> = lengths
                .iter()
                .enumerate()
                .map(|(number, &length)| {
                    (["/a", "/b", "/a", "/c"][number * 7 / 3 % 4].to_owned(), vec![number as u8; length])
                })
                .collect();
            let mut digests = Digests::default();
            messages.iter().for_each(|(topic, payload)| digests.add(topic, payload));
            let topics = ["/a", "/b", "/c", "/never"].map(str::to_owned);
            let (all, by_topic) = digests.finish(&topics);
            assert_eq!(all, digest(messages.iter()));
            let expected: BTreeMap<String, String> = topics
                .iter()
                .map(|topic| (topic.clone(), digest(messages.iter().filter(|(of, _)| of == topic))))
                .collect();
            assert_eq!(by_topic, expected);
            assert_eq!(by_topic["/never"], blake3::hash(b"").to_hex().as_str());
        }
    }
}
