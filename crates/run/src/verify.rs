//! Compares the fast solver with the plain one, over a run or its beginning.

use std::collections::BTreeMap;

use asperity_model::{Plan, Scenario};
use asperity_record::{Event, EventPayload, SlipEvent, StepRecord};
use asperity_simulator::equality::{self, Agreement, Disagreement, NearTie, TOLERANCE};
use serde::{Deserialize, Serialize};

use crate::detectors;

/// A near tie, with everything needed to prove it again.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Proof {
    /// The run's name in its pipeline.
    pub run: String,
    /// The run's scenario, complete.
    pub scenario: String,
    /// Its hash.
    pub scenario_hash: String,
    /// The near tie.
    pub tie: NearTie,
}

impl Proof {
    /// The proof of a near tie in a run of that name.
    pub fn of(run: &str, scenario: &Scenario, tie: &NearTie) -> Proof {
        Proof {
            run: run.to_owned(),
            scenario: scenario.to_commented_toml(),
            scenario_hash: scenario.hash(),
            tie: tie.clone(),
        }
    }

    /// The name of its file.
    pub fn file_name(&self, parameter_set: &str) -> String {
        format!("{}-{parameter_set}-{}-{}.json", self.run, self.tie.step, self.tie.block)
    }

    /// Whether it proves the same near tie.
    pub fn is_of(&self, tie: &NearTie) -> bool {
        let of = |tie: &NearTie| (tie.step, tie.block, tie.direction, tie.plain_switches);
        of(&self.tie) == of(tie)
    }
}

/// The comparison of two equal runs.
#[derive(Debug)]
pub struct Verified {
    /// The extent of the agreement: switches, near ties, deviations.
    pub agreement: Agreement,
    /// Number of slip events, equal in both.
    pub slip_events: usize,
}

/// How two runs differ.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// In their records.
    #[error(transparent)]
    Records(#[from] Disagreement),
    /// In the number of events.
    #[error("{plain} events of the plain solver, {fast} of the fast")]
    EventCount {
        /// Of the plain solver.
        plain: usize,
        /// Of the fast solver.
        fast: usize,
    },
    /// In an event.
    #[error("event {index}: plain {plain}, fast {fast}")]
    Event {
        /// Its number among all topics.
        index: usize,
        /// Of the plain solver.
        plain: String,
        /// Of the fast solver.
        fast: String,
    },
}

/// Runs a plan with both solvers, and compares switches, records and the events of the registered
/// detectors. Calls `reached` with the steps that both have completed.
///
/// # Errors
/// If they differ; `equality.rs` of the simulator defines equality.
pub fn verify(plan: &Plan, reached: impl FnMut(u64)) -> Result<Verified, VerifyError> {
    let mut records: [Vec<StepRecord>; 2] = [Vec::new(), Vec::new()];
    let each = |plain: &StepRecord, fast: &StepRecord| {
        records[0].push(plain.clone());
        records[1].push(fast.clone());
    };
    let agreement = equality::compare(plan, each, reached)?;
    // The rounding of a difference of totals is proportional to the totals.
    let largest_energy_j = records[0]
        .iter()
        .filter_map(|record| record.energy)
        .flat_map(|energy| [energy.drive_work_j, energy.friction_heat_j, energy.elastic_j])
        .fold(0.0, |most: f64, energy_j| most.max(energy_j.abs()));
    let [plain, fast] = records.map(|records| detectors::of_plan(plan).all_events(&records));
    same_events(&plain, &fast, &agreement, largest_energy_j)?;
    let slip_events = plain.iter().filter(|event| event.topic() == SlipEvent::TOPIC).count();
    Ok(Verified { agreement, slip_events })
}

/// Compares the events of two runs: integers and words must be equal, other numbers within the
/// tolerance of the largest of their kind.
fn same_events(
    plain: &[Event],
    fast: &[Event],
    agreement: &Agreement,
    largest_energy_j: f64,
) -> Result<(), VerifyError> {
    if plain.len() != fast.len() {
        return Err(VerifyError::EventCount { plain: plain.len(), fast: fast.len() });
    }
    let mut largest = BTreeMap::<(String, String), f64>::new();
    let largest_force_n = agreement
        .deviations
        .iter()
        .find(|deviation| deviation.what == "tangential force")
        .map_or(0.0, |deviation| deviation.largest);
    for event in plain {
        for (key, value) in fields(event) {
            if let Some(value) = value.as_f64().filter(|_| value.is_f64()) {
                let of_kind = match key.as_str() {
                    "tangential_force_n" => largest_force_n,
                    key if key.ends_with("_j") => largest_energy_j,
                    _ => value.abs(),
                };
                let most = largest.entry((event.topic().to_owned(), key)).or_default();
                *most = most.max(of_kind);
            }
        }
    }
    for (index, (plain, fast)) in plain.iter().zip(fast).enumerate() {
        let (left, right) = (fields(plain), fields(fast));
        let alike = plain.topic() == fast.topic()
            && left.len() == right.len()
            && left.iter().zip(&right).all(|((key, a), (other, b))| {
                let near = || match (
                    a.as_f64(),
                    b.as_f64(),
                    largest.get(&(plain.topic().to_owned(), key.clone())),
                ) {
                    (Some(a), Some(b), Some(largest)) => (a - b).abs() <= TOLERANCE * largest,
                    _ => false,
                };
                key == other && (a == b || near())
            });
        if !alike {
            return Err(VerifyError::Event { index, plain: format!("{left:?}"), fast: format!("{right:?}") });
        }
    }
    Ok(())
}

fn fields(event: &Event) -> Vec<(String, serde_json::Value)> {
    let object: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&event.json()).expect("a payload is a JSON object");
    object.into_iter().collect()
}
