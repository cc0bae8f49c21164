//! What a solver records is what a plan makes one expect, and hardly anything else is.

use asperity_model::Plan;
use asperity_record::{Energy, Record, RunStatus, StepRecord, WindowRecord};
use asperity_simulator::{Departure, Expectation, Fast, Plain, Solver};

const SHORT: [&str; 4] =
    ["slider.blocks=12", "time.step_s=1e-7", "time.duration_s=0.1", "drive.velocity_m_per_s=2e-3"];

fn plan(sets: &[&str]) -> Plan {
    asperity_testkit::plan("default", &[&SHORT[..], sets].concat())
}

fn records(mut solver: impl Solver) -> Vec<Record> {
    std::iter::from_fn(|| solver.next_record().unwrap()).collect()
}

/// Takes all of them but some, which are excused where `has_gaps`.
fn take(
    plan: &Plan,
    records: &[Record],
    has_gaps: bool,
    is_there: impl Fn(usize) -> bool,
) -> Result<(), Departure> {
    let mut expectation = Expectation::of(plan.clone(), has_gaps);
    let kind = |record: &Record| match record {
        Record::Step(_) => 0,
        Record::Fields(_) => 1,
        Record::Window(_) => 2,
    };
    let mut missing = [false; 3];
    for (number, record) in records.iter().enumerate() {
        if is_there(number) {
            expectation.take(record, std::mem::take(&mut missing[kind(record)]) && has_gaps)?;
        } else {
            missing[kind(record)] = true;
        }
    }
    if has_gaps { Ok(()) } else { expectation.finish(RunStatus::Complete, None) }
}

const WINDOWS: &str = "recording.window=[{from_s=0.02,to_s=0.03,every_s=1e-5,first_block=2,last_block=5},{from_s=0,to_s=0.1,every_s=3e-3,first_block=1,last_block=12}]";

/// While three blocks slide at once.
const RUPTURES: [&str; 2] = ["recording.rupture_fields_from_blocks=3", "recording.rupture_fields_s=2e-5"];

/// Recorded densely, so that there is some of everything.
fn dense() -> Vec<Plan> {
    [
        &["recording.fields_s=1e-3", "recording.sample_s=1e-4", WINDOWS][..],
        &["recording.event_fields=false", "recording.fields_s=0.007", "recording.sample_s=0", WINDOWS],
        &["recording.fields_s=0", "recording.sample_s=0", "parameter_set=as-stated"],
        &["drive.kind=left-right", "friction.reattach=two-way", WINDOWS],
        &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3", WINDOWS],
        &["time.start=loaded", "recording.sample_s=1e-4"],
        &RUPTURES,
        &[RUPTURES[0], RUPTURES[1], "recording.sample_s=1e-4", "recording.event_fields=false", WINDOWS],
    ]
    .map(plan)
    .into()
}

#[test]
fn what_solvers_record_is_expected() {
    for plan in dense() {
        for records in [records(Fast::new(plan.clone())), records(Plain::new(plan.clone()))] {
            assert!(records.len() > 20, "{} records", records.len());
            take(&plan, &records, false, |_| true)
                .unwrap_or_else(|error| panic!("{:?}: {error}", plan.recording));
        }
    }
}

/// Of a whole log no record may be missing; of a salvaged one any, as long as the numbers say so.
#[test]
fn what_is_missing_is_seen_and_can_be_excused() {
    for plan in dense() {
        let records = records(Fast::new(plan.clone()));
        let stride = records.len() / 150 + 1;
        let mut unseen = 0;
        for from in (0..records.len()).step_by(stride) {
            for count in [1, 2, 7] {
                let is_there = |number: usize| number < from || number >= from + count;
                let told = take(&plan, &records, false, is_there);
                // A block that slips and sticks again between two records may have done so unseen,
                // until it slips next.
                unseen += usize::from(told.is_ok());
                assert!(count > 1 || told.is_err(), "record {from} of {}", records.len());
                take(&plan, &records, true, is_there)
                    .unwrap_or_else(|error| panic!("{count} records from {from} on: {error}"));
            }
        }
        assert!(unseen < 5, "{unseen} unseen");
    }
}

/// Numbers of a record that are changed by a millionth are seen, if anything follows from them.
#[test]
fn what_is_changed_is_seen() {
    let plan = plan(&["recording.fields_s=1e-3", "recording.sample_s=0.01"]);
    let records = records(Fast::new(plan.clone()));
    let mut unseen = 0;
    let mut changed = 0;
    for (number, record) in records.iter().enumerate() {
        let mut all = records.clone();
        let mut told = |change: &dyn Fn(&mut Record)| {
            all[number] = record.clone();
            change(&mut all[number]);
            changed += 1;
            take(&plan, &all, false, |_| true).is_err()
        };
        let by = 1.0 + 1e-6;
        match record {
            Record::Step(step) => {
                let is_followed = matches!(records.get(number + 1), Some(Record::Fields(_)));
                assert!(told(&|record| normal_load(record, by)), "normal load, record {number}");
                assert!(
                    !is_followed || told(&|record| driving_force(record, by)),
                    "driving force, record {number}"
                );
                for part in 0..Energy::COUNT {
                    // Of half of them only the balance is known.
                    let seen = told(&|record| energy(record, part, 0.1));
                    assert!(seen, "energy {part}, record {number}");
                }
                for switch in 0..step.switches.len() {
                    assert!(told(&|record| threshold(record, switch, by)), "threshold, record {number}");
                    assert!(told(&|record| anchor(record, switch, by)), "anchor, record {number}");
                }
            }
            Record::Fields(fields) => {
                for block in 0..fields.displacement_m.len() {
                    for kind in 0..4 {
                        let value = state(&mut record.clone(), kind, block).abs();
                        let seen = told(&|record| *state(record, kind, block) *= by);
                        unseen += usize::from(!seen && value > 0.0);
                    }
                }
            }
            Record::Window(_) => {}
        }
    }
    // Velocities near rest are below the rounding of the forces.
    assert!(changed > 3000 && unseen * 4 < changed, "{unseen} of {changed} unseen");
}

fn energy(record: &mut Record, part: usize, by_j: f64) {
    let Record::Step(StepRecord { energy: Some(energy), .. }) = record else {
        panic!("a step with energies")
    };
    let parts = [
        &mut energy.drive_work_j,
        &mut energy.prestress_work_j,
        &mut energy.friction_heat_j,
        &mut energy.anchor_change_j,
        &mut energy.viscous_loss_j,
        &mut energy.kinetic_j,
        &mut energy.elastic_j,
        &mut energy.scheme_work_j,
    ];
    *parts.into_iter().nth(part).expect("there are so many") += by_j;
}

fn normal_load(record: &mut Record, by: f64) {
    if let Record::Step(step) = record {
        step.normal_load_n *= by;
    }
}

fn driving_force(record: &mut Record, by: f64) {
    if let Record::Step(step) = record {
        step.driving_force_n *= by;
    }
}

fn threshold(record: &mut Record, switch: usize, by: f64) {
    if let Record::Step(step) = record {
        step.switches[switch].threshold_n *= by;
    }
}

fn anchor(record: &mut Record, switch: usize, by: f64) {
    if let Record::Step(step) = record {
        step.switches[switch].stick_position_m = step.switches[switch].stick_position_m.mul_add(by, 1e-15);
    }
}

fn state(record: &mut Record, kind: usize, block: usize) -> &mut f64 {
    let Record::Fields(fields) = record else { panic!("states of all blocks") };
    match kind {
        0 => &mut fields.displacement_m[block],
        1 => &mut fields.velocity_m_per_s[block],
        2 => &mut fields.tangential_force_n[block],
        _ => &mut fields.stick_position_m[block],
    }
}

/// How a run that waits for a load may end.
#[test]
fn a_load_that_was_reached_is_not_said_to_be_missing() {
    // Where the load falls from there on, it tells when that was.
    let plan = plan(&[
        "drive.until_load_ratio=0.05",
        "normal_load.schedule_from=hold",
        "normal_load.schedule_s=[0.01,0.03]",
        "normal_load.schedule_n=[400,300]",
        "recording.sample_s=1e-3",
    ]);
    let mut expectation = Expectation::of(plan.clone(), false);
    for record in records(Fast::new(plan)) {
        expectation.take(&record, false).unwrap();
    }
    assert!(expectation.clone().finish(RunStatus::Complete, None).is_ok());
    let told = expectation.finish(RunStatus::LoadNotReached, None).unwrap_err();
    assert!(told.what.contains("and it has been"), "{told}");
}

/// The states of ruptures are those of a window that is always open, where enough blocks slide; and
/// nothing else is recorded otherwise, by either solver.
#[test]
fn ruptures_are_recorded_while_they_are_large() {
    let windows = |records: &[Record], number: u32| -> Vec<WindowRecord> {
        let of = records.iter().filter_map(|record| match record {
            Record::Window(record) if record.window == number => Some(record.clone()),
            _ => None,
        });
        of.collect()
    };
    let open = "recording.window=[{from_s=0,to_s=0.1,every_s=2e-5,first_block=1,last_block=12}]";
    let all = windows(&records(Plain::new(plan(&[open]))), 0);
    let expected: Vec<WindowRecord> = all.into_iter().filter(|record| record.sliding >= 3).collect();
    assert!(expected.len() > 30, "{} records", expected.len());
    let bare = plan(&[]);
    let with = plan(&RUPTURES);
    for (plain, dense) in [
        (records(Plain::new(bare.clone())), records(Plain::new(with.clone()))),
        (records(Fast::new(bare)), records(Fast::new(with))),
    ] {
        assert_eq!(windows(&dense, 0).len(), expected.len());
        for (found, expected) in windows(&dense, 0).iter().zip(&expected) {
            assert_eq!((found.step, found.sliding), (expected.step, expected.sliding));
            // The fast solver rounds otherwise.
            let close = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.abs().max(1e-6);
            let pairs = found.displacement_m.iter().zip(&expected.displacement_m);
            assert!(pairs.clone().all(|(a, b)| close(*a, *b)), "step {}", found.step);
        }
        let others: Vec<Record> =
            dense.into_iter().filter(|record| !matches!(record, Record::Window(_))).collect();
        assert!(others == plain, "the other records are the same to the bit");
    }
}

/// Records of ruptures where there should be none, or changed ones.
#[test]
fn states_of_ruptures_that_no_run_has_are_seen() {
    let plan = plan(&RUPTURES);
    let records = records(Fast::new(plan.clone()));
    let number = |is: &dyn Fn(&WindowRecord) -> bool| {
        let found = records.iter().position(|record| matches!(record, Record::Window(window) if is(window)));
        found.expect("there is one")
    };
    let with_step = |number: usize| {
        let Record::Window(window) = &records[number] else { panic!("a window") };
        matches!(&records[number - 1], Record::Step(step) if step.step == window.step)
    };
    let alone =
        (1..records.len()).find(|n| matches!(records[*n], Record::Window(_)) && !with_step(*n)).unwrap();
    assert!(alone > 0 && number(&|window| window.sliding >= 3) <= alone);
    let told = |change: &dyn Fn(&mut WindowRecord)| {
        let mut all = records.clone();
        let Record::Window(window) = &mut all[alone] else { panic!("a window") };
        change(window);
        take(&plan, &all, false, |_| true).unwrap_err().to_string()
    };
    assert!(told(&|window| window.step += 1).contains("where the scenario asks for none"));
    assert!(told(&|window| window.step += 200).contains("does not follow"));
    assert!(told(&|window| window.sliding += 1).contains("blocks slide, and"));
    assert!(told(&|window| window.sliding = 2).contains("where the scenario asks for none"));
    assert!(told(&|window| window.window = 1).contains("no dense window 1"));
    assert!(told(&|window| window.first_block = 2).contains("of other blocks"));
    // One twice, and one more at the end of a stretch.
    let mut twice = records.clone();
    twice.insert(alone, records[alone].clone());
    assert!(take(&plan, &twice, false, |_| true).is_err());
}
