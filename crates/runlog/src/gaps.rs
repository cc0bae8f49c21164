//! Where a salvaged log may be read with less to hold its messages against: across the gaps
//! that it states, and nowhere else. Its messages bear the numbers that they had.
//!
//! Logs of version 2 state their gaps as well, but not the order of events in them: there, any
//! number that is left out is one.

use std::collections::BTreeMap;

use asperity_record::RunHeader;

use crate::agree;
use crate::findings::Gap;
use crate::format::CHUNK_SINCE;
use crate::metadata;
use crate::problem::LogProblem;

/// Follows the messages of a salvaged log from gap to gap.
pub(crate) struct Gaps {
    stated: Vec<Gap>,
    /// The times of the last message before each gap and of the first after it.
    times: Vec<(u64, u64)>,
    /// Whether what is missing must be where a gap is stated.
    is_strict: bool,
    /// How many gaps lie before what is read now.
    passed: usize,
    /// The number of the next message of each topic, and how many gaps there were before the
    /// last one.
    topics: BTreeMap<String, (u32, usize)>,
    has_any: bool,
    is_state_unknown: bool,
    says_lost: bool,
    /// Whether there was no record since the last gap.
    is_before_record: bool,
}

impl Gaps {
    /// # Errors
    /// If metadata `salvage` does not state them as it must.
    pub(crate) fn new(header: &RunHeader, map: &BTreeMap<String, String>) -> Result<Gaps, LogProblem> {
        let is_strict = header.record_schema_version >= CHUNK_SINCE;
        let stated = if is_strict { metadata::gaps_from_map(map)? } else { Vec::new() };
        let time_ns = |step| agree::time_ns(header, step).unwrap_or(u64::MAX);
        let times = stated
            .iter()
            .map(|gap| (gap.after_step.map_or(0, time_ns), gap.before_step.map_or(u64::MAX, time_ns)));
        Ok(Gaps {
            says_lost: metadata::says_lost(map),
            times: times.collect(),
            stated,
            is_strict,
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

    /// Whether the log says that messages were lost, or that nobody knows.
    pub(crate) fn says_lost(&self) -> bool {
        self.says_lost
    }

    /// Whether any gap lies before what is read now.
    pub(crate) fn has_any(&self) -> bool {
        self.has_any
    }

    /// Whether switches may be missing since the state of all blocks was last known.
    pub(crate) fn is_state_unknown(&self) -> bool {
        self.is_state_unknown
    }

    pub(crate) fn state_is_known(&mut self) {
        self.is_state_unknown = false;
    }

    /// Takes the next message.
    ///
    /// # Errors
    /// If it bears a number that no gap explains.
    pub(crate) fn message(&mut self, topic: &str, sequence: u32, time_ns: u64) -> Result<(), LogProblem> {
        while self.times.get(self.passed).is_some_and(|(_, before_ns)| *before_ns <= time_ns) {
            self.pass();
        }
        let (expected, passed) = self.topics.get(topic).copied().unwrap_or_default();
        if sequence != expected {
            if !self.is_strict {
                self.enter();
            } else if sequence < expected || (passed == self.passed && !self.pass_before(time_ns)) {
                let topic = topic.to_owned();
                return Err(LogProblem::Number { topic, expected, found: sequence });
            }
        }
        self.topics.insert(topic.to_owned(), (sequence.saturating_add(1), self.passed));
        Ok(())
    }

    /// Whether an event may stand after a record of another time: what made it certain is in
    /// the gap between them.
    pub(crate) fn event(&mut self, record_ns: Option<u64>, time_ns: u64, publish_ns: u64) -> bool {
        let is_later = publish_ns == time_ns && record_ns.is_some_and(|record_ns| record_ns < time_ns);
        self.is_strict && is_later && (self.is_before_record || self.pass_before(time_ns))
    }

    /// Takes note of a record: from here on events follow their records again.
    pub(crate) fn record(&mut self) {
        self.is_before_record = false;
    }

    /// Goes past the next gap if it begins before that time.
    fn pass_before(&mut self, time_ns: u64) -> bool {
        let begins = self.times.get(self.passed).is_some_and(|(after_ns, _)| *after_ns <= time_ns);
        if begins {
            self.pass();
        }
        begins
    }

    fn pass(&mut self) {
        self.passed += 1;
        self.enter();
    }

    fn enter(&mut self) {
        (self.has_any, self.is_state_unknown, self.is_before_record) = (true, true, true);
    }
}
