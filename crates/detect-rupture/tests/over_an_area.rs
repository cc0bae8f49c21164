//! Ruptures over an area of 6 columns and 4 rows, where neighbours lie in two directions.

use std::collections::BTreeSet;

use asperity_detect::{Detector, Detectors, RuptureTracker, SlipRules, Slipped};
use asperity_detect_rupture::{ArrivalDetector, Links, RuptureDetector};
use asperity_record::{Arrival, Contacts, Direction, Reach, Rupture, StepRecord, TimeGrid};
use asperity_testkit::{Random, quiet_step, switch};

/// Detachments two steps apart are linked, three steps apart are not.
const LINK_STEPS: u64 = 2;

fn area() -> Contacts {
    Contacts::in_rows(24, 4).expect("4 rows of 6")
}

/// Contacts that detach at the end of a step and re-attach at that of the next.
fn records(detachments: &[(u64, u32)]) -> Vec<StepRecord> {
    let last = detachments.iter().map(|(step, _)| *step).max().unwrap_or(0);
    let records = (1..=last + 1).map(|step| {
        let of = |at: u64, direction: Direction| {
            let then = detachments.iter().filter(move |(step, _)| *step == at);
            then.map(move |(_, contact)| switch(*contact, direction))
        };
        let switches = of(step, Direction::Detach).chain(of(step - 1, Direction::Attach)).collect();
        StepRecord { switches, ..quiet_step(step, step as f64, 0.4) }
    });
    records.collect()
}

fn slipped(detachments: &[(u64, u32)]) -> Vec<Slipped> {
    let mut tracker = RuptureTracker::new(area(), 1.0, LINK_STEPS as f64);
    let mut found = Vec::new();
    records(detachments).iter().for_each(|record| tracker.observe(record, &mut found));
    tracker.finish(&mut found);
    found
}

/// The contacts of each rupture.
fn members(detachments: &[(u64, u32)]) -> BTreeSet<Vec<u32>> {
    slipped(detachments).iter().map(|slipped| slipped.blocks.keys().copied().collect()).collect()
}

#[test]
fn diagonals_link_and_the_ends_of_rows_do_not() {
    // Column 2 of rows 1 and 2, then column 3 of row 3: 2, 8 and 15.
    assert_eq!(members(&[(1, 2), (1, 8), (2, 15)]), [vec![2, 8, 15]].into());
    // 6 ends the first row, 7 begins the second; 12 and 13 likewise.
    assert_eq!(members(&[(1, 6), (1, 7), (1, 13)]), [vec![6], vec![7, 13]].into());
    assert_eq!(members(&[(1, 12), (1, 13)]), [vec![12], vec![13]].into());
    // A contact between two ruptures unites them.
    assert_eq!(members(&[(1, 1), (1, 15), (2, 8)]), [vec![1, 8, 15]].into());
    assert_eq!(members(&[(1, 1), (4, 8)]), [vec![1], vec![8]].into());
}

/// The definition: components of the graph of all detachments, compared pair by pair.
fn components(detachments: &[(u64, u32)]) -> BTreeSet<Vec<(u64, u32)>> {
    let place = |contact: u32| ((contact - 1) % 6, (contact - 1) / 6);
    let mut of: Vec<usize> = (0..detachments.len()).collect();
    for (i, (a_step, a)) in detachments.iter().enumerate() {
        for (j, (b_step, b)) in detachments.iter().enumerate() {
            let (a, b) = (place(*a), place(*b));
            let linked = a.0.abs_diff(b.0).max(a.1.abs_diff(b.1)) <= 1
                && a_step.abs_diff(*b_step) <= LINK_STEPS
                && of[i] != of[j];
            if linked {
                let (from, to) = (of[i], of[j]);
                of.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
            }
        }
    }
    let all = |name: &usize| -> Vec<(u64, u32)> {
        detachments.iter().zip(&of).filter(|(_, of)| *of == name).map(|(one, _)| *one).collect()
    };
    of.iter().map(all).collect()
}

#[test]
fn ruptures_are_the_components_of_linked_detachments() {
    let mut random = Random::new(3);
    let mut several = 0;
    for _ in 0..200 {
        // Each contact slides for a step, and so detaches again two steps later at the earliest.
        let all = (1..40).flat_map(|step| (1..=24).map(move |contact| (step, contact)));
        let mut detachments: Vec<(u64, u32)> = all.filter(|_| random.below(30) == 0).collect();
        let mut before: BTreeSet<(u64, u32)> = BTreeSet::new();
        detachments.retain(|&(step, contact)| {
            !before.contains(&(step - 1, contact)) && before.insert((step, contact))
        });

        let expected = components(&detachments);
        let found = slipped(&detachments);
        let told: BTreeSet<_> = found
            .iter()
            .map(|one| {
                (one.onset_step, one.nucleation_block, one.blocks.keys().copied().collect(), one.detachments)
            })
            .collect();
        let signature = |component: &Vec<(u64, u32)>| {
            let (step, nucleation) = *component.iter().min().expect("a component has a member");
            let contacts: BTreeSet<u32> = component.iter().map(|(_, contact)| *contact).collect();
            (step + 1, nucleation, Vec::from_iter(contacts), component.len() as u64)
        };
        assert_eq!(told, expected.iter().map(signature).collect());
        for one in &found {
            let extent = one.extent(area());
            let over = |places: &dyn Fn(u32) -> u32| {
                let places = one.blocks.keys().map(|&contact| places(contact));
                Reach::over(places.map(|place| Reach { first: place, last: place }))
            };
            assert_eq!(extent.columns(), over(&|contact| area().column(contact)));
            assert_eq!(extent.rows(), over(&|contact| area().row(contact)));
            several += u32::from(extent.count() > 1);
        }
    }
    assert!(several > 200, "{several}");
}

#[test]
fn an_event_reaches_from_column_to_column_and_has_no_front_along_its_numbers() {
    let links = Links {
        t_link_s: LINK_STEPS as f64,
        time_grid: TimeGrid::new(1.0),
        spacing_m: 0.001,
        modulus_n_per_m: None,
        interfacial_stiffness_n_per_m: None,
    };
    // Column 4 of each row in turn, and column 3 of the last; then all.
    let first = [(1, 4), (2, 10), (3, 16), (4, 22), (4, 21)];
    let all: Vec<(u64, u32)> = first.into_iter().chain((1..=24).map(|contact| (20, contact))).collect();
    let list: Vec<Box<dyn Detector>> =
        vec![Box::new(RuptureDetector::new(area(), links)), Box::new(ArrivalDetector::new(area(), links))];
    let mut detectors =
        Detectors::new(area(), SlipRules::EVERY_SLIP, list).with_ruptures(Some(links.tracker(area())));
    let events = detectors.all_events(&records(&all));
    let ruptures: Vec<&Rupture> = events.iter().filter_map(|event| event.get()).collect();
    let seen: Vec<_> = ruptures
        .iter()
        .map(|one| {
            (one.reach(), one.reached_every_block, one.farthest_block_before, one.front_speed_up_m_per_s)
        })
        .collect();
    assert_eq!(
        seen,
        [
            (Reach { first: 3, last: 4 }, false, None, None),
            (Reach { first: 1, last: 6 }, true, Some(4), None)
        ]
    );
    let arrivals: Vec<&Arrival> = events.iter().filter_map(|event| event.get()).collect();
    assert_eq!(arrivals.len(), 29);
    assert!(arrivals.iter().all(|arrival| arrival.front_speed_m_per_s.is_none()));
}
