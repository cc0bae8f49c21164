//! The stated gaps of a salvaged log, across which its reader relaxes its checks. Its messages keep
//! their original numbers.

use std::collections::BTreeMap;

use asperity_record::RunHeader;

use crate::agree;
use crate::findings::Gap;
use crate::metadata;
use crate::problem::LogProblem;

/// Follows the messages of a salvaged log from gap to gap.
pub(crate) struct Gaps {
    stated: Vec<Gap>,
    /// The times of the last message before and of the first after each gap.
    times: Vec<(u64, u64)>,
    /// Number of gaps before the current message.
    passed: usize,
    /// The next number of each topic, and the number of gaps before its last message.
    topics: BTreeMap<String, (u32, usize)>,
    has_any: bool,
    is_state_unknown: bool,
    says_lost: bool,
    /// Whether there has been no record since the last gap.
    is_before_record: bool,
}

impl Gaps {
    /// # Errors
    /// If metadata `salvage` is invalid.
    pub(crate) fn new(header: &RunHeader, map: &BTreeMap<String, String>) -> Result<Gaps, LogProblem> {
        let stated = metadata::gaps_from_map(map)?;
        let time_ns = |step| agree::time_ns(header, step).unwrap_or(u64::MAX);
        let times = stated
            .iter()
            .map(|gap| (gap.after_step.map_or(0, time_ns), gap.before_step.map_or(u64::MAX, time_ns)));
        Ok(Gaps {
            says_lost: metadata::says_lost(map),
            times: times.collect(),
            stated,
            passed: 0,
            topics: BTreeMap::new(),
            has_any: false,
            is_state_unknown: false,
            is_before_record: false,
        })
    }

    pub(crate) fn stated(&self) -> &[Gap] {
        &self.stated
    }

    /// Whether the log states that messages were lost or may have been.
    pub(crate) fn says_lost(&self) -> bool {
        self.says_lost
    }

    /// Whether there was a gap before the current message.
    pub(crate) fn has_any(&self) -> bool {
        self.has_any
    }

    /// Whether switches may be missing since the last state of all blocks.
    pub(crate) fn is_state_unknown(&self) -> bool {
        self.is_state_unknown
    }

    pub(crate) fn state_is_known(&mut self) {
        self.is_state_unknown = false;
    }

    /// Checks the number of the next message.
    ///
    /// # Errors
    /// If messages are missing outside the gaps.
    pub(crate) fn message(&mut self, topic: &str, sequence: u32, time_ns: u64) -> Result<(), LogProblem> {
        while self.times.get(self.passed).is_some_and(|(_, before_ns)| *before_ns <= time_ns) {
            self.pass();
        }
        let (expected, passed) = self.topics.get(topic).copied().unwrap_or_default();
        let is_lost = sequence > expected && (passed < self.passed || self.pass_before(time_ns));
        if sequence != expected && !is_lost {
            let topic = topic.to_owned();
            return Err(LogProblem::Number { topic, expected, found: sequence });
        }
        self.topics.insert(topic.to_owned(), (sequence.saturating_add(1), self.passed));
        Ok(())
    }

    /// Whether an event may have another time than the record before it: the record that completed
    /// it is in the gap between them.
    pub(crate) fn event(&mut self, record_ns: Option<u64>, time_ns: u64, publish_ns: u64) -> bool {
        let is_later = publish_ns == time_ns && record_ns.is_some_and(|record_ns| record_ns < time_ns);
        is_later && (self.is_before_record || self.pass_before(time_ns))
    }

    /// Records that there was a record: events follow their records again.
    pub(crate) fn record(&mut self) {
        self.is_before_record = false;
    }

    /// Passes the next gap if it begins before that time.
    fn pass_before(&mut self, time_ns: u64) -> bool {
        let begins = self.times.get(self.passed).is_some_and(|(after_ns, _)| *after_ns <= time_ns);
        if begins {
            self.pass();
        }
        begins
    }

    fn pass(&mut self) {
        self.passed += 1;
        (self.has_any, self.is_state_unknown, self.is_before_record) = (true, true, true);
    }
}
