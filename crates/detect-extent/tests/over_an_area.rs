//! Slip events over an area of contact, against their definition on random switches.

use std::collections::BTreeSet;

use asperity_detect::{Detectors, SlipRules};
use asperity_detect_extent::ExtentDetector;
use asperity_record::{BoundingBox, Contacts, Direction, Parts, Reach, SlipEvent, StepRecord};
use asperity_testkit::{Random, quiet_step, switch};

const COLUMNS: u32 = 5;
const ROWS: u32 = 3;

/// A record of every step, with random switches: a stuck contact detaches with a chance of one in `detach`, a
/// sliding one attaches with one in `attach`; and the contacts that slide in a step, by steps.
fn run(random: &mut Random, [detach, attach]: [u64; 2]) -> (Vec<StepRecord>, Vec<BTreeSet<u32>>) {
    let (mut records, mut sliding) = (Vec::new(), vec![BTreeSet::new()]);
    let mut detached: BTreeSet<u32> = BTreeSet::new();
    for step in 1..=120 {
        let slides = detached.clone();
        let mut switches = Vec::new();
        for contact in 1..=COLUMNS * ROWS {
            let (direction, odds) = match slides.contains(&contact) {
                true => (Direction::Attach, attach),
                false => (Direction::Detach, detach),
            };
            if random.below(odds) == 0 {
                match direction {
                    Direction::Detach => detached.insert(contact),
                    Direction::Attach => detached.remove(&contact),
                };
                switches.push(switch(contact, direction));
            }
        }
        let record = quiet_step(step, step as f64, step as f64);
        records.push(StepRecord { sliding: slides.len() as u32, switches, ..record });
        sliding.push(slides);
    }
    (records, sliding)
}

/// What an event is: its first step, the step after, its contacts, the most of one step, and the lowest of
/// its first.
type Event = (u64, Option<u64>, BTreeSet<u32>, u32, u32);

/// Maximal runs of steps in which a contact slides.
fn defined(sliding: &[BTreeSet<u32>]) -> Vec<Event> {
    let mut events: Vec<Event> = Vec::new();
    for (step, slides) in (0..).zip(sliding) {
        let goes_on = step > 0 && !sliding[step as usize - 1].is_empty();
        match (goes_on, slides.first()) {
            (false, Some(lowest)) => {
                events.push((step, None, slides.clone(), slides.len() as u32, *lowest));
            }
            (true, _) => {
                let (_, end, contacts, most, _) = events.last_mut().expect("one goes on");
                contacts.extend(slides);
                *most = (*most).max(slides.len() as u32);
                *end = slides.is_empty().then_some(step);
            }
            (false, None) => {}
        }
    }
    events
}

#[test]
fn events_are_the_runs_of_sliding_steps_with_the_box_of_their_contacts() {
    let contacts = Contacts::in_rows(COLUMNS * ROWS, ROWS).expect("whole rows");
    let parts = Parts { area: true, ..Parts::default() };
    let (mut random, mut several, mut global) = (Random::new(34), 0, 0);
    for n in 0..40 {
        let (records, sliding) = run(&mut random, [[40, 2], [20, 4]][n % 2]);
        let list = vec![Box::new(ExtentDetector { parts }) as _];
        let found = Detectors::new(contacts, SlipRules::EVERY_SLIP, list).all_events(&records);
        let slips: Vec<&SlipEvent> = found.iter().filter_map(|event| event.get()).collect();
        let expected = defined(&sliding);
        assert_eq!(slips.len(), expected.len());
        for (slip, (onset, end, of, most, nucleation)) in slips.iter().zip(&expected) {
            let over = |place: fn(u32) -> u32| {
                Reach::over(of.iter().map(|&one| Reach { first: place(one), last: place(one) })).unwrap()
            };
            let columns = over(|contact| (contact - 1) % COLUMNS + 1);
            let rows = over(|contact| (contact - 1) / COLUMNS + 1);
            assert_eq!(slip.bounding_box(), BoundingBox { columns, rows });
            assert_eq!((slip.first_across, slip.last_across), (Some(rows.first), Some(rows.last)));
            assert_eq!((slip.first_block, slip.last_block), (columns.first, columns.last));
            assert_eq!((slip.onset_step, slip.end_step), (*onset, *end));
            assert_eq!((slip.blocks_slipped, slip.max_sliding), (of.len() as u32, *most));
            assert_eq!((slip.nucleation_block, slip.open), (*nucleation, end.is_none()));
            several += u32::from(columns.count() > 1 && rows.count() > 1);
        }
        let all = expected.iter().filter(|(_, _, of, ..)| of.len() as u32 == COLUMNS * ROWS).count();
        assert_eq!(slips.iter().filter(|slip| slip.is_global(contacts.count())).count(), all);
        global += all;
    }
    assert!(several > 100 && global > 0, "{several} {global}");
}
