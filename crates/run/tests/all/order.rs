//! Order, backpressure and failures of a stream under any scheduling.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use asperity_detect::{Detector, Detectors, SlipRules};
use asperity_record::{Event, EventKind, Onset, Record, StepRecord};
use asperity_run::stream::{Item, StreamError, run, run_in_turn};
use asperity_testkit::quiet_step;

fn step(step: u64) -> Record {
    Record::Step(quiet_step(step, step as f64, 0.0))
}

/// Emits an event for every tenth record, and one at the end of the run.
struct Tenth(u64);

impl Detector for Tenth {
    fn emits(&self) -> EventKind {
        EventKind::of::<Onset>()
    }

    fn observe(&mut self, record: &StepRecord, emit: &mut dyn FnMut(Event)) {
        if record.step % 10 == self.0 {
            emit(Event::of_json("/events/tenth", &format!("{} {}", self.0, record.step)));
        }
    }

    fn finish(&mut self, emit: &mut dyn FnMut(Event)) {
        emit(Event::of_json("/events/tenth", &format!("{} over", self.0)));
    }
}

fn source(steps: u64) -> impl FnMut() -> Result<Option<Item>, String> + Send {
    let mut next = 0;
    move || {
        next += 1;
        Ok((next <= steps).then(|| Item::Record(step(next))))
    }
}

fn detectors() -> Detectors {
    let list: Vec<Box<dyn Detector>> = vec![Box::new(Tenth(0)), Box::new(Tenth(0)), Box::new(Tenth(3))];
    Detectors::new(1, SlipRules::EVERY_SLIP, list)
}

#[test]
fn events_follow_their_record_in_the_order_of_the_detectors() {
    let collect = |pause: Duration| {
        let mut seen = Vec::new();
        run(source(1000), detectors(), |item| {
            if seen.len() % 97 == 0 {
                std::thread::sleep(pause);
            }
            seen.push(item);
            Ok::<(), String>(())
        })
        .unwrap();
        seen
    };
    let seen = collect(Duration::ZERO);
    assert_eq!(seen.len(), 1000 + 300 + 3);
    let mut last = 0;
    for item in &seen[..1300] {
        match item {
            Item::Record(record) => {
                assert_eq!(record.step(), last + 1);
                last = record.step();
            }
            Item::Event(event) => assert!(event.json().ends_with(&format!(" {last}"))),
            Item::Checkpoint(_) => unreachable!("the source gives none"),
        }
    }
    assert!(matches!(&seen[1302], Item::Event(event) if event.json() == "3 over"));
    assert_eq!(collect(Duration::from_millis(2)), seen, "a slow sink sees the same");
    let mut in_turn = Vec::new();
    let sink = |item| {
        in_turn.push(item);
        Ok::<(), String>(())
    };
    run_in_turn(source(1000), detectors(), sink).unwrap();
    assert_eq!(in_turn, seen, "on one thread it sees the same");
}

#[test]
fn a_slow_sink_holds_the_source_back() {
    static MADE: AtomicU64 = AtomicU64::new(0);
    let mut next = 0;
    let mut seen = 0;
    run(
        || {
            next += 1;
            MADE.store(next, Ordering::SeqCst);
            Ok::<_, String>((next <= 2000).then(|| Item::Record(step(next))))
        },
        Detectors::new(1, SlipRules::EVERY_SLIP, Vec::new()),
        |_| {
            if seen == 500 {
                std::thread::sleep(Duration::from_millis(200));
                let ahead = MADE.load(Ordering::SeqCst) - 500;
                assert!(ahead < 200, "the source is {ahead} records ahead");
            }
            seen += 1;
            Ok::<(), String>(())
        },
    )
    .unwrap();
    assert_eq!(seen, 2000);
}

#[test]
fn a_failing_sink_stops_the_run_with_its_own_error() {
    let mut seen = 0;
    let outcome = run(source(u64::MAX - 1), detectors(), |_| {
        seen += 1;
        if seen == 300 { Err("disk full".to_owned()) } else { Ok(()) }
    });
    assert_eq!(outcome, Err(StreamError::Sink("disk full".to_owned())));
    seen = 0;
    let outcome = run_in_turn(source(u64::MAX - 1), detectors(), |_| {
        seen += 1;
        if seen == 300 { Err("disk full".to_owned()) } else { Ok(()) }
    });
    assert_eq!((outcome, seen), (Err(StreamError::Sink("disk full".to_owned())), 300));
}

#[test]
fn a_failing_source_is_reported_and_closes_no_event() {
    for in_turn in [false, true] {
        let (mut next, mut over, mut records) = (0, 0, 0);
        let source = || {
            next += 1;
            if next < 50 { Ok(Some(Item::Record(step(next)))) } else { Err("overflow") }
        };
        let sink = |item| {
            over += usize::from(matches!(&item, Item::Event(event) if event.json().ends_with("over")));
            records += usize::from(matches!(item, Item::Record(_)));
            Ok::<(), String>(())
        };
        let outcome = match in_turn {
            false => run(source, detectors(), sink),
            true => run_in_turn(source, detectors(), sink),
        };
        assert_eq!(outcome, Err(StreamError::Source("overflow")));
        assert_eq!((over, records), (0, 49));
    }
}
