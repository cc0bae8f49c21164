//! Compares the solvers of a law, over a run or its beginning: the fast with the plain one, or the adaptive one with
//! itself at a hundredth of its tolerance.

use std::collections::BTreeMap;

use asperity_model::{Law, Plan, RateAndState, Scenario};
use asperity_record::{Event, EventPayload, Record, SlipEvent, StepRecord};
use asperity_simulator::equality::{self, Agreement, Deviation, Disagreement, NearTie, TOLERANCE};
use asperity_simulator::{SimulationError, SolverKind};
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
    /// Of the adaptive solver, in a switch or its time.
    #[error(
        "switch {index}: {coarse} at the run's tolerance, {fine} at a hundredth of it (accepted: the same block and \
         direction, times within {accepted_s:.1e} s)"
    )]
    Tolerance {
        /// Its number, from 0.
        index: usize,
        /// The switch at the tolerance of the run.
        coarse: String,
        /// At a hundredth of it.
        fine: String,
        /// The largest accepted difference of times.
        accepted_s: f64,
    },
    /// A run stopped.
    #[error(transparent)]
    Stopped(#[from] SimulationError),
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

/// Largest difference of the times of switches at two tolerances, over the tolerance and the duration of the run. Near
/// an instability, a slider multiplies the error of each step by what it multiplies any disturbance.
const TIME_ERROR: f64 = 100.0;

/// Runs a plan by the adaptive solver at its tolerance and at a hundredth of it, and compares the switches.
fn verify_tolerance(
    plan: &Plan,
    law: &RateAndState,
    mut reached: impl FnMut(u64),
) -> Result<Verified, VerifyError> {
    let mut first_records = Vec::new();
    let [coarse, fine] = [0, 1].map(|number| {
        let tolerance = [law.tolerance, law.tolerance / 100.0][number];
        let mut plan = plan.clone();
        plan.friction.law = Law::RateAndState(RateAndState { tolerance, ..*law });
        let steps = plan.steps;
        let mut solver = SolverKind::Adaptive.start(plan);
        let mut switches = Vec::new();
        while let Some(record) = solver.next_record()? {
            let Record::Step(record) = record else { continue };
            // Half of the progress each.
            reached((number as u64 * steps + record.step) / 2);
            let of_record = record.switches.iter();
            switches.extend(of_record.map(|switch| (record.time_s, switch.block, switch.direction)));
            if number == 0 {
                first_records.push(record);
            }
        }
        // Block by block: blocks that switch at almost the same time may do so in another order.
        switches.sort_by_key(|(_, block, _)| *block);
        Ok::<_, SimulationError>(switches)
    });
    let (records, coarse, fine) = (first_records, coarse?, fine?);
    let duration_s = plan.grid.time_s(plan.steps);
    let accepted_s = TIME_ERROR * law.tolerance * duration_s + 2.0 * plan.grid.step_s();
    let mut worst_s = 0.0_f64;
    for index in 0..coarse.len().max(fine.len()) {
        let (left, right) = (coarse.get(index), fine.get(index));
        let late_s = left.zip(right).filter(|(left, right)| left.1 == right.1 && left.2 == right.2);
        let late_s = late_s.map(|(left, right)| (left.0 - right.0).abs());
        match late_s.filter(|late_s| *late_s <= accepted_s) {
            Some(late_s) => worst_s = worst_s.max(late_s),
            None => {
                let [coarse, fine] = [left, right].map(|switch| format!("{switch:?}"));
                return Err(VerifyError::Tolerance { index, coarse, fine, accepted_s });
            }
        }
    }
    let events = detectors::of_plan(plan).all_events(&records);
    Ok(Verified {
        agreement: Agreement {
            records: records.len() as u64,
            switches: coarse.len() as u64,
            deviations: vec![Deviation {
                what: "time of a switch",
                largest: duration_s,
                share: worst_s / duration_s,
            }],
            near_ties: Vec::new(),
        },
        slip_events: events.iter().filter(|event| event.topic() == SlipEvent::TOPIC).count(),
    })
}

/// Runs a plan with both solvers, and compares switches, records and the events of the registered
/// detectors. Calls `reached` with the steps that both have completed.
///
/// # Errors
/// If they differ; `equality.rs` of the simulator defines equality. By rate-and-state friction, whose solver has a
/// tolerance, the same blocks must switch at times that differ by no more than it allows.
pub fn verify(plan: &Plan, reached: impl FnMut(u64)) -> Result<Verified, VerifyError> {
    if let Some(law) = plan.friction.law.rate_and_state() {
        return verify_tolerance(plan, &law, reached);
    }
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
