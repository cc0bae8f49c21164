//! Ruptures over an area of 6 columns and 4 rows, where neighbours lie in two directions.

use std::collections::BTreeSet;

use asperity_detect::{Detector, Detectors, RuptureTracker, SlipRules, Slipped};
use asperity_detect_rupture::{ArrivalDetector, Links, RuptureDetector};
use asperity_record::{
    Arrival, BoundingBox, Contacts, Direction, Energy, Reach, Rupture, StepRecord, Switch, SwitchAcross,
    TimeGrid,
};
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

fn links() -> Links {
    Links {
        t_link_s: LINK_STEPS as f64,
        time_grid: TimeGrid::new(1.0),
        spacing_m: SPACING_M,
        modulus_n_per_m: MODULUS_N_PER_M,
        interfacial_stiffness_n_per_m: 2.0,
        first_share: 1.0,
    }
}

const SPACING_M: f64 = 0.001;

/// Shear modulus times spacing.
const MODULUS_N_PER_M: f64 = 50.0;

/// Ruptures and arrivals in these records.
fn events(contacts: Contacts, records: &[StepRecord]) -> (Vec<Rupture>, Vec<Arrival>) {
    let links = links();
    let list: Vec<Box<dyn Detector>> = vec![
        Box::new(RuptureDetector::new(contacts, links)),
        Box::new(ArrivalDetector::new(contacts, links)),
    ];
    let mut detectors =
        Detectors::new(contacts, SlipRules::EVERY_SLIP, list).with_ruptures(links.tracker(contacts));
    let events = detectors.all_events(records);
    let ruptures = events.iter().filter_map(|event| event.get().cloned()).collect();
    (ruptures, events.iter().filter_map(|event| event.get().cloned()).collect())
}

#[test]
fn a_rupture_has_the_box_of_its_contacts_and_the_farthest_column_before() {
    // Column 4 of each row in turn, and column 3 of the last; then all.
    let first = [(1, 4), (2, 10), (3, 16), (4, 22), (4, 21)];
    let all: Vec<(u64, u32)> = first.into_iter().chain((1..=24).map(|contact| (20, contact))).collect();
    let (ruptures, arrivals) = events(area(), &records(&all));
    let seen: Vec<_> = ruptures
        .iter()
        .map(|one| {
            let BoundingBox { columns, rows } = one.bounding_box();
            let told = (one.contacts, one.reached_every_block, one.farthest_block_before);
            (columns, rows, told, one.front_speed_up_m_per_s)
        })
        .collect();
    let reach = |first, last| Reach { first, last };
    assert_eq!(
        seen,
        [
            (reach(3, 4), reach(1, 4), (Some(5), false, None), None),
            // All of its contacts detach at once.
            (reach(1, 6), reach(1, 4), (Some(24), true, Some(4)), None)
        ]
    );
    assert_eq!(arrivals.len(), 29);
    for arrival in &arrivals {
        let place = (area().column(arrival.block), area().row(arrival.block));
        assert_eq!((arrival.column, arrival.across), (Some(place.0), Some(place.1)));
        assert_eq!((arrival.front_speed_m_per_s, arrival.local_speed_m_per_s), (None, None));
    }
}

/// Two contacts that slide by known vectors under known forces.
#[test]
fn slip_and_forces_are_vectors() {
    let at = |u: [f64; 2], tau: [f64; 2], block: u32, direction: Direction| Switch {
        displacement_m: u[0],
        tangential_force_n: tau[0],
        across: Some(SwitchAcross {
            displacement_m: u[1],
            tangential_force_n: tau[1],
            stick_position_m: 1.0,
            ..SwitchAcross::default()
        }),
        ..switch(block, direction)
    };
    use Direction::{Attach, Detach};
    let step = |step: u64, switches: Vec<Switch>| StepRecord {
        switches,
        energy: Energy::default(),
        ..quiet_step(step, step as f64, 0.4)
    };
    let records = [
        step(1, vec![at([1.0, 1.0], [-3.0, 4.0], 8, Detach), at([0.0, 0.0], [5.0, 12.0], 15, Detach)]),
        step(2, vec![at([4.0, -3.0], [0.0, -1.0], 8, Attach), at([-6.0, 8.0], [-15.0, 8.0], 15, Attach)]),
        step(9, vec![]),
    ];
    let (ruptures, arrivals) = events(area(), &records);
    let [rupture] = &ruptures[..] else { panic!("{ruptures:?}") };
    // Slips (3, -4) and (-6, 8); forces fall from 5 to 1 and rise from 13 to 17.
    assert_eq!((rupture.mean_slip_m, rupture.largest_slip_m), (Some(7.5), Some(10.0)));
    assert_eq!(rupture.mean_strength_drop_n, Some(0.0));
    let near = |found: Option<f64>, expected: f64| (found.unwrap() / expected - 1.0).abs() < 1e-15;
    assert!(near(rupture.potency_m3, 15.0 * SPACING_M * SPACING_M), "{rupture:?}");
    assert!(near(rupture.moment_n_m, MODULUS_N_PER_M * SPACING_M * 15.0), "{rupture:?}");
    assert_eq!(rupture.potency_m2, None);
    // Of both components: (16 + 16 + 36 + 49) - (1 + 0 + 0 + 1), of springs of 2 N/m.
    assert_eq!(rupture.anchor_change_j, Some(115.0));
    let slips: Vec<_> = arrivals
        .iter()
        .map(|one| (one.slip_m, one.slip_across_m, one.slip_size_m(), one.force_detach_n, one.force_attach_n))
        .collect();
    assert_eq!(
        slips,
        [
            (Some(3.0), Some(-4.0), Some(5.0), 5.0, Some(1.0)),
            (Some(-6.0), Some(8.0), Some(10.0), 13.0, Some(17.0)),
        ]
    );
}

/// A map of arrivals: the contact detaches at the end of the step, and attaches in the next but one.
fn front(contacts: Contacts, arrival: impl Fn(u32, u32) -> Option<u64>) -> (Vec<Rupture>, Vec<Arrival>) {
    let of = |contact: u32| Some((arrival(contacts.column(contact), contacts.row(contact))?, contact));
    let detachments: Vec<(u64, u32)> = (1..=contacts.count()).filter_map(of).collect();
    events(contacts, &records(&detachments))
}

/// Fronts of known slowness: oblique, and bent with one row late.
#[test]
fn fronts_have_the_speeds_of_their_maps() {
    let contacts = Contacts::in_rows(20 * 5, 5).expect("5 rows of 20");
    // Three steps for two columns would not link; these link.
    let (ruptures, arrivals) = front(contacts, |column, row| Some(u64::from(2 * column + row)));
    let [rupture] = &ruptures[..] else { panic!("{ruptures:?}") };
    assert_eq!(rupture.nucleation_block, 1);
    assert_eq!(
        (rupture.front_speed_up_m_per_s, rupture.front_speed_down_m_per_s),
        (Some(SPACING_M / 2.0), None)
    );
    let expected = SPACING_M / 5.0_f64.sqrt();
    for arrival in &arrivals {
        let corner = [1, 20].contains(&arrival.column.unwrap()) && [1, 5].contains(&arrival.across.unwrap());
        match arrival.local_speed_m_per_s {
            // A corner has four contacts around, itself included.
            None => assert!(corner),
            Some(speed) => assert!(!corner && (speed / expected - 1.0).abs() < 1e-14, "{arrival:?}"),
        }
    }
    assert_eq!(arrivals.len(), 100);

    // From column 8 of row 3 both ways, slower downwards, each row a step later than the one before it.
    let (ruptures, _) = front(contacts, |column, row| {
        let along = if column >= 8 { column - 8 } else { 2 * (8 - column) };
        Some(u64::from(10 + along + row.abs_diff(3)))
    });
    let [rupture] = &ruptures[..] else { panic!("{ruptures:?}") };
    assert_eq!(rupture.nucleation_block, 2 * 20 + 8);
    let speeds = (rupture.front_speed_up_m_per_s, rupture.front_speed_down_m_per_s);
    assert_eq!(speeds, (Some(SPACING_M), Some(SPACING_M / 2.0)));
}

/// Against sums over all pairs of contacts of the same row, on random maps.
#[test]
fn front_speeds_are_medians_over_pairs_of_the_same_row() {
    let contacts = Contacts::in_rows(9 * 4, 4).expect("4 rows of 9");
    let mut random = Random::new(8);
    let (mut with_speed, mut without) = (0, 0);
    for _ in 0..300 {
        let base = random.below(2);
        let arrival: Vec<Option<u64>> = (0..36)
            .map(|contact| {
                let late = base * (contact % 9) + random.below(2) + 1;
                (random.below(8) > 0).then_some(late)
            })
            .collect();
        let at = |column: u32, row: u32| arrival[((row - 1) * 9 + column - 1) as usize];
        let (ruptures, arrivals) = front(contacts, at);
        for rupture in &ruptures {
            let own: Vec<&Arrival> = arrivals.iter().filter(|one| one.rupture == rupture.rupture).collect();
            let nucleation = contacts.column(rupture.nucleation_block);
            let median = |is_there: &dyn Fn(u32) -> bool, way: f64| {
                let on_side: Vec<&&Arrival> =
                    own.iter().filter(|one| is_there(one.column.unwrap())).collect();
                let in_row = |row| on_side.iter().filter(|one| one.across == Some(row)).count();
                if (1..=4).all(|row| in_row(row) < 4) {
                    return None;
                }
                let mut slowness: Vec<f64> = Vec::new();
                for a in &on_side {
                    for b in on_side.iter().filter(|b| b.across == a.across && b.column > a.column) {
                        let columns = f64::from(b.column.unwrap() - a.column.unwrap());
                        slowness.push(way * (b.arrival_s - a.arrival_s) / columns);
                    }
                }
                slowness.sort_by(f64::total_cmp);
                let [low, high] = [(slowness.len() - 1) / 2, slowness.len() / 2].map(|n| slowness[n]);
                let median = (low + high) / 2.0;
                (median > 0.0).then(|| SPACING_M / median)
            };
            let up = median(&|column| column >= nucleation, 1.0);
            let down = median(&|column| column <= nucleation, -1.0);
            assert_eq!((rupture.front_speed_up_m_per_s, rupture.front_speed_down_m_per_s), (up, down));
            with_speed += u32::from(up.is_some()) + u32::from(down.is_some());
            without += u32::from(up.is_none() && down.is_none());
            // The plane of least squares, by its normal equations about the mean.
            for one in &own {
                let near = |other: &&&Arrival| {
                    other.column.unwrap().abs_diff(one.column.unwrap()) <= 1
                        && other.across.unwrap().abs_diff(one.across.unwrap()) <= 1
                };
                let around: Vec<[f64; 3]> = own
                    .iter()
                    .filter(near)
                    .map(|other| {
                        [other.column.unwrap().into(), other.across.unwrap().into(), other.arrival_s]
                    })
                    .collect();
                let mean = |axis: usize| around.iter().map(|at| at[axis]).sum::<f64>() / around.len() as f64;
                let means = [mean(0), mean(1), mean(2)];
                let product = |a: usize, b: usize| {
                    around.iter().map(|at| (at[a] - means[a]) * (at[b] - means[b])).sum::<f64>()
                };
                let determinant = product(0, 0) * product(1, 1) - product(0, 1).powi(2);
                let part = |a: usize, b: usize| {
                    (product(a, 2) * product(b, b) - product(b, 2) * product(a, b)) / determinant
                };
                let slowness = part(0, 1).hypot(part(1, 0));
                match one.local_speed_m_per_s {
                    None => assert!(around.len() < 6 || slowness < 1e-12),
                    Some(speed) => {
                        assert!(around.len() >= 6 && (speed * slowness / SPACING_M - 1.0).abs() < 1e-9);
                    }
                }
            }
        }
    }
    assert!(with_speed > 100 && without > 20, "{with_speed} {without}");
}
