//! The verdict of `asperity check` on a file, by its word and by its exit code, which must agree.

use crate::calls::Outcome;
use crate::case::Case;
use crate::ground::Error;

/// The possible verdicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    Whole,
    NoRunLog,
    Incomplete,
    Damaged,
    Gaps,
    OtherCode,
    Stopped,
}

impl Verdict {
    /// Each with its word and its exit code.
    const ALL: [(Verdict, &'static str, i32); 7] = [
        (Verdict::Whole, "whole", 0),
        (Verdict::NoRunLog, "not a run log", 2),
        (Verdict::Incomplete, "incomplete", 3),
        (Verdict::Damaged, "damaged", 4),
        (Verdict::Gaps, "salvaged with gaps", 5),
        (Verdict::OtherCode, "by other code or detectors", 6),
        (Verdict::Stopped, "stopped", 7),
    ];

    pub(crate) fn word(self) -> &'static str {
        Verdict::ALL.iter().find(|(verdict, ..)| *verdict == self).map_or("", |(_, word, _)| word)
    }

    pub(crate) fn code(self) -> i32 {
        Verdict::ALL.iter().find(|(verdict, ..)| *verdict == self).map_or(-1, |(.., code)| *code)
    }

    fn of_word(said: &str, file: &str) -> Option<Verdict> {
        let behind = said.lines().next()?.strip_prefix(file)?.strip_prefix(": ")?;
        let found = Verdict::ALL.iter().find(|(_, word, _)| behind.starts_with(word));
        // A file that is no log is reported in a sentence.
        let found = found.or_else(|| Verdict::ALL.iter().find(|(_, word, _)| behind.contains(word)));
        found.map(|(verdict, ..)| *verdict)
    }
}

/// The output about a file.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    pub(crate) verdict: Option<Verdict>,
    pub(crate) outcome: Outcome,
}

impl Judged {
    /// Whether the word or the code indicates a complete log.
    pub(crate) fn is_whole(&self) -> bool {
        self.verdict == Some(Verdict::Whole) || self.outcome.code == Some(0)
    }

    /// The output, for a report.
    pub(crate) fn said(&self) -> String {
        format!("{}: {}: {}", self.outcome.call, self.outcome.ending(), self.outcome.said().trim())
    }
}

impl Case<'_> {
    /// Has `check` judge a file of the case's folder. Word and code must be those of one verdict.
    pub(crate) fn check(&mut self, file: &str) -> Result<Judged, Error> {
        let outcome = self.call(&["check", file])?;
        let verdict = Verdict::of_word(&outcome.out, file).or_else(|| Verdict::of_word(&outcome.err, file));
        let judged = Judged { verdict, outcome };
        match verdict {
            Some(verdict) => self.hold(
                judged.outcome.code == Some(verdict.code()),
                &format!(
                    "check of what is {:?} exits with another code than {}",
                    verdict.word(),
                    verdict.code()
                ),
                || judged.said(),
            ),
            None if judged.outcome.code.is_some() => self.broke("check gives no verdict", judged.said()),
            None => {}
        }
        Ok(judged)
    }

    /// Checks a log, which must have that verdict.
    pub(crate) fn must_be(&mut self, what: &str, file: &str, expected: Verdict) -> Result<(), Error> {
        let judged = self.check(file)?;
        self.hold(
            judged.verdict == Some(expected),
            &format!("check of {what} does not say {:?}", expected.word()),
            || judged.said(),
        );
        Ok(())
    }
}
