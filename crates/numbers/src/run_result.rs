//! The result of a run, as studies store it: a line of JSON with its numbers and its events.

use asperity_record::{Rupture, SlipEvent};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use crate::Summary;

/// The result of a run of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunResult {
    /// Its number in the plan, from 1.
    pub run: u64,
    /// Its id, as in the plan and in a log.
    pub id: String,
    /// What it gave; or why it failed, as it always will.
    pub outcome: Result<RunOutcome, String>,
}

/// What a run gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunOutcome {
    /// Its numbers.
    pub summary: Summary,
    /// Its slip events in their order, if they are kept.
    pub slips: Vec<SlipEvent>,
    /// Its ruptures in their order, if they are kept.
    pub ruptures: Vec<Rupture>,
}

impl RunResult {
    /// Its line.
    ///
    /// # Errors
    /// If it has a number that JSON cannot hold.
    pub fn to_json(&self) -> serde_json::Result<Vec<u8>> {
        serde_json::to_vec(self)
    }

    /// The first difference to another result of the run, with both values; none if tables would have the same of both.
    pub fn difference(&self, other: &RunResult) -> Option<String> {
        match (&self.outcome, &other.outcome) {
            (Ok(one), Ok(other)) => {
                let (one, other) = (json!(one), json!(other));
                let all = ["summary", "slips", "ruptures"];
                all.iter().find_map(|key| difference(&one[key], &other[key], key))
            }
            (Err(one), Err(other)) => difference(&json!(one), &json!(other), "the reason of its failure"),
            _ => Some("it is done, and it failed".to_owned()),
        }
    }
}

/// The first difference of two values at a place. Numbers are compared as written: 0 and -0 differ in a table.
fn difference(one: &Value, other: &Value, at: &str) -> Option<String> {
    match (one, other) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter().zip(b.values()).find_map(|((key, a), b)| difference(a, b, &format!("{at}.{key}")))
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(n, (a, b))| difference(a, b, &format!("{at}[{n}]")))
        }
        (Value::Array(a), Value::Array(b)) => Some(format!("there are {} and {} {at}", a.len(), b.len())),
        (one, other) => {
            let [one, other] = [one, other].map(Value::to_string);
            (one != other).then(|| format!("{at} is {one} and {other}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{RunOutcome, RunResult};
    use crate::Summary;

    #[test]
    fn results_differ_in_a_number_an_event_or_the_reason() {
        let of = |outcome| RunResult { run: 4, id: "ab".to_owned(), outcome };
        let done = |change: fn(&mut Summary)| {
            let mut summary = Summary { drive_work_j: Some(0.0), ..Summary::default() };
            change(&mut summary);
            of(Ok(RunOutcome { summary, slips: Vec::new(), ruptures: Vec::new() }))
        };
        let failed = |reason: &str| of(Err(reason.to_owned()));
        let one = done(|_| ());
        assert_eq!(serde_json::from_slice::<RunResult>(&one.to_json().unwrap()).unwrap(), one);
        for (a, b, said) in [
            (
                &one,
                &done(|summary| summary.drive_work_j = Some(-0.0)),
                "summary.drive_work_j is 0.0 and -0.0",
            ),
            (&one, &failed("a"), "it is done, and it failed"),
            (&failed("a"), &failed("b"), "the reason of its failure is \"a\" and \"b\""),
        ] {
            assert_eq!((a.difference(b).as_deref(), b.difference(b)), (Some(said), None));
        }
    }
}
