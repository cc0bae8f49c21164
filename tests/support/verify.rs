//! Compares the solvers of a law, over a run or its beginning: the fast with the plain one, or the adaptive one with
//! itself at a hundredth of its tolerance.

use std::collections::BTreeMap;

use asperity_model::{Law, Plan, RateAndState};
use asperity_record::{Direction, Event, EventPayload, Record, SlipEvent, StepRecord};
use asperity_simulator::{SimulationError, SolverKind};
use asperity_testkit::equality::{self, Agreement, Deviation, Disagreement, TOLERANCE};

/// The comparison of two equal runs.
#[derive(Debug)]
pub(crate) struct Verified {
    /// The extent of the agreement: switches, near ties, deviations.
    pub(crate) agreement: Agreement,
    /// Number of slip events, equal in both.
    pub(crate) slip_events: usize,
}

/// How two runs differ.
#[derive(Debug, thiserror::Error)]
pub(crate) enum VerifyError {
    /// In their records.
    #[error(transparent)]
    Records(#[from] Disagreement),
    /// Of the adaptive solver, in a switch or its time.
    #[error(
        "with time.tolerance = {tolerance:e} {coarse}, with a hundredth of it {fine} (accepted: the same switches, at \
         times within {accepted_s:.1e} s)"
    )]
    Tolerance {
        /// The tolerance of the run.
        tolerance: f64,
        /// The switch at the tolerance of the run, in words.
        coarse: String,
        /// At a hundredth of it.
        fine: String,
        /// The largest accepted difference of times.
        accepted_s: f64,
    },
    /// In nothing yet: a hundredth of the tolerance is less than the adaptive solver can be asked for.
    #[error(
        "time.tolerance = {tolerance:e} is too small to be compared with a hundredth of it (accepted: a number from \
         {least:e} to {largest})"
    )]
    TooAccurate {
        /// The tolerance of the run.
        tolerance: f64,
        /// The least one that can be checked.
        least: f64,
        /// The largest.
        largest: f64,
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

/// Tolerance of the run that others are compared with, over theirs.
const FINER: f64 = 0.01;

/// Least and largest `time.tolerance` that can be checked: from the first one on, a hundredth of it is one that the key
/// accepts. Below, rounding is most of the error of a step.
pub(crate) const CHECKED_TOLERANCES: [f64; 2] = [1e-10, 1e-2];

/// A switch of a block, counted from 1.
#[derive(Debug, Clone, Copy)]
struct Switched {
    block: u32,
    direction: Direction,
    time_s: f64,
}

impl Switched {
    fn words(self) -> String {
        let Switched { block, direction, time_s } = self;
        let switches = match direction {
            Direction::Detach => "detaches",
            Direction::Attach => "re-attaches",
        };
        format!("block {block} {switches} at {time_s} s")
    }
}

/// Runs a plan by the adaptive solver at its tolerance and at a hundredth of it, and compares the switches.
fn verify_tolerance(
    plan: &Plan,
    law: &RateAndState,
    mut events_of: impl FnMut(&[StepRecord]) -> Vec<Event>,
    mut reached: impl FnMut(u64),
) -> Result<Verified, VerifyError> {
    let [least, largest] = CHECKED_TOLERANCES;
    if law.tolerance < least {
        return Err(VerifyError::TooAccurate { tolerance: law.tolerance, least, largest });
    }
    let mut records = Vec::new();
    let mut switches: [Vec<Switched>; 2] = Default::default();
    for (number, tolerance) in [law.tolerance, FINER * law.tolerance].into_iter().enumerate() {
        let mut plan = plan.clone();
        plan.friction.law = Law::RateAndState(RateAndState { tolerance, ..*law });
        let steps = plan.steps;
        let mut solver = SolverKind::Adaptive.start(plan);
        while let Some(record) = solver.next_record()? {
            let Record::Step(record) = record else { continue };
            // Half of the progress each.
            reached((number as u64 * steps + record.step) / 2);
            switches[number].extend(record.switches.iter().map(|switch| Switched {
                block: switch.block,
                direction: switch.direction,
                time_s: record.time_s,
            }));
            if number == 0 {
                records.push(record);
            }
        }
    }
    let duration_s = plan.grid.time_s(plan.steps);
    let accepted_s = TIME_ERROR * law.tolerance * duration_s + 2.0 * plan.grid.step_s();
    let count = switches[0].len() as u64;
    let worst_s = largest_delay_s(switches, law.tolerance, accepted_s)?;
    let events = events_of(&records);
    Ok(Verified {
        agreement: Agreement {
            records: records.len() as u64,
            switches: count,
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

/// The largest difference of the times of equal switches: of the run's tolerance, and of a finer one.
fn largest_delay_s(
    mut switches: [Vec<Switched>; 2],
    tolerance: f64,
    accepted_s: f64,
) -> Result<f64, VerifyError> {
    // Block by block: blocks that switch at almost the same time may do so in another order.
    switches.iter_mut().for_each(|of_run| of_run.sort_by_key(|switch| switch.block));
    let [coarse, fine] = switches;
    let mut worst_s = 0.0_f64;
    for index in 0..coarse.len().max(fine.len()) {
        let (left, right) = (coarse.get(index), fine.get(index));
        let alike = left
            .zip(right)
            .filter(|(left, right)| left.block == right.block && left.direction == right.direction);
        let late_s = alike.map(|(left, right)| (left.time_s - right.time_s).abs());
        match late_s.filter(|late_s| *late_s <= accepted_s) {
            Some(late_s) => worst_s = worst_s.max(late_s),
            None => {
                // Where they are of two blocks, the run with the later block lacks the switch of the earlier one.
                let first = left.into_iter().chain(right).map(|switch| switch.block).min();
                let [coarse, fine] = [left, right].map(|switch| {
                    let switch = switch.filter(|switch| Some(switch.block) == first);
                    switch.map_or("there is no such switch".to_owned(), |switch| switch.words())
                });
                return Err(VerifyError::Tolerance { tolerance, coarse, fine, accepted_s });
            }
        }
    }
    Ok(worst_s)
}

/// Runs a plan with both solvers, and compares switches, records and the events that detectors find in those. Calls `reached` with the steps that both have completed.
///
/// # Errors
/// If they differ; `equality.rs` defines equality. By rate-and-state friction, whose solver has a
/// tolerance, the same blocks must switch at times that differ by no more than it allows.
pub(crate) fn verify(
    plan: &Plan,
    mut events_of: impl FnMut(&[StepRecord]) -> Vec<Event>,
    reached: impl FnMut(u64),
) -> Result<Verified, VerifyError> {
    if let Some(law) = plan.friction.law.rate_and_state() {
        return verify_tolerance(plan, &law, events_of, reached);
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
        .map(|record| record.energy)
        .flat_map(|energy| [energy.drive_work_j, energy.friction_heat_j, energy.elastic_j])
        .fold(0.0, |most: f64, energy_j| most.max(energy_j.abs()));
    let [plain, fast] = records.map(|records| events_of(&records));
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

#[cfg(test)]
mod tests {
    use asperity_model::Plan;
    use asperity_model::resolve;
    use asperity_model::scenario::keys::KEYS;
    use asperity_record::Direction::{self, Attach, Detach};
    use asperity_record::StepRecord;

    use super::{CHECKED_TOLERANCES, FINER, Switched, largest_delay_s, verify};

    fn plan(set: &str) -> Plan {
        let sets = ["time.duration_s=0.5", set];
        Plan::new(&resolve("rate-and-state", &sets).unwrap_or_else(|errors| panic!("{errors}")))
    }

    #[test]
    fn two_tolerances_have_the_same_switches() {
        let plan = plan("time.tolerance=1e-5");
        let mut steps = Vec::new();
        let none = |_: &[StepRecord]| Vec::new();
        let verified = verify(&plan, none, |step| steps.push(step)).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(verified.agreement.switches, 32);
        let share = verified.agreement.deviations[0].share;
        assert!(share > 0.0 && share < 1e-6, "{share}");
        assert!(steps.is_sorted() && steps.last() == Some(&plan.steps), "{:?}", steps.last());
    }

    #[test]
    fn a_tolerance_that_no_finer_one_can_check_is_refused() {
        let [least, largest] = CHECKED_TOLERANCES;
        let key = KEYS.iter().find(|key| key.path == "time.tolerance").expect("it is a key");
        let is_checked =
            |tolerance: f64| key.kind.accepts_number(FINER * tolerance) && key.kind.accepts_number(tolerance);
        assert!(is_checked(least) && !is_checked(0.999 * least));
        assert!(is_checked(largest) && !is_checked(1.001 * largest));
        let refused =
            verify(&plan("time.tolerance=5e-11"), |_| Vec::new(), |_| ()).expect_err("it is too small");
        assert_eq!(
            refused.to_string(),
            "time.tolerance = 5e-11 is too small to be compared with a hundredth of it (accepted: a number from 1e-10 \
             to 0.01)"
        );
    }

    #[test]
    fn a_difference_is_said_by_block_switch_and_time() {
        let switches = |all: &[(u32, Direction, f64)]| -> Vec<Switched> {
            all.iter().map(|&(block, direction, time_s)| Switched { block, direction, time_s }).collect()
        };
        let coarse = [(2, Detach, 0.5), (1, Detach, 0.5), (1, Attach, 0.75)];
        let of =
            |fine: &[(u32, Direction, f64)]| largest_delay_s([switches(&coarse), switches(fine)], 1e-6, 0.01);
        // In another order, as neighbours may switch.
        let same = of(&[(1, Detach, 0.5), (2, Detach, 0.502), (1, Attach, 0.751)]).expect("they are equal");
        assert!((same - 0.002).abs() < 1e-12, "{same}");
        for (fine, said) in [
            (
                &[(1, Detach, 0.5), (2, Detach, 0.52), (1, Attach, 0.75)][..],
                "with time.tolerance = 1e-6 block 2 detaches at 0.5 s, with a hundredth of it block 2 detaches at \
                 0.52 s (accepted: the same switches, at times within 1.0e-2 s)",
            ),
            (
                &[(1, Detach, 0.5), (2, Detach, 0.5)],
                "with time.tolerance = 1e-6 block 1 re-attaches at 0.75 s, with a hundredth of it there is no such \
                 switch (accepted: the same switches, at times within 1.0e-2 s)",
            ),
            (
                &[(1, Detach, 0.5), (1, Attach, 0.75), (1, Detach, 0.8), (2, Detach, 0.5)],
                "with time.tolerance = 1e-6 there is no such switch, with a hundredth of it block 1 detaches at 0.8 s \
                 (accepted: the same switches, at times within 1.0e-2 s)",
            ),
        ] {
            assert_eq!(of(fine).expect_err("they differ").to_string(), said);
        }
    }
}
