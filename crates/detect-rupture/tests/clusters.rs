//! Ruptures in made-up detachments, against the definition computed over all pairs at once.

use std::collections::BTreeSet;

use asperity_detect::{Detector, Detectors, SlipRules};
use asperity_detect_rupture::{ArrivalDetector, Links, RuptureDetector};
use asperity_record::{
    Arrival, Direction, Energy, Event, EventPayload, Rupture, StepRecord, Switch, TimeGrid,
};
use asperity_testkit::{Random, quiet_step, switch};

const STEP_S: f64 = 0.25;
/// Two and a half steps: detachments two steps apart are linked, three steps apart are not.
const T_LINK_S: f64 = 0.625;
const LINK_STEPS: u64 = 2;

fn links() -> Links {
    Links {
        t_link_s: T_LINK_S,
        time_grid: TimeGrid::new(STEP_S),
        spacing_m: 0.001,
        modulus_n_per_m: 50.0,
        interfacial_stiffness_n_per_m: 2.0,
        first_share: 1.0,
    }
}

/// A block that slides from one step's end to another's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Slide {
    detach: u64,
    block: u32,
    /// None if the run ends before.
    attach: Option<u64>,
}

/// A switch at which the friction spring, of 2 N/m, of block `b` has the energy `b^2` J if it detaches,
/// `4 b^2` J if it re-attaches.
fn stretched(block: u32, direction: Direction) -> Switch {
    let times = if direction == Direction::Attach { 2.0 } else { 1.0 };
    Switch { stick_position_m: times * f64::from(block), ..switch(block, direction) }
}

/// The anchor change of these slides.
fn anchored_j(slides: &[Slide]) -> f64 {
    let of = |slide: &Slide| f64::from(slide.block).powi(2) * if slide.attach.is_some() { 3.0 } else { -1.0 };
    slides.iter().map(of).sum()
}

/// The records of a run with these slides and some samples besides.
fn records(slides: &[Slide], steps: u64, random: &mut Random) -> Vec<StepRecord> {
    let mut records = Vec::new();
    for step in 1..=steps {
        let mut switches: Vec<_> = slides
            .iter()
            .filter_map(|slide| match slide {
                Slide { detach, block, .. } if *detach == step => Some(stretched(*block, Direction::Detach)),
                Slide { attach, block, .. } if *attach == Some(step) => {
                    Some(stretched(*block, Direction::Attach))
                }
                _ => None,
            })
            .collect();
        switches.sort_by_key(|switch| switch.block);
        if !switches.is_empty() || random.below(4) == 0 {
            let quiet = quiet_step(step, step as f64 * STEP_S, 0.4);
            records.push(StepRecord { switches, energy: energy(step), ..quiet });
        }
    }
    records
}

/// Energies that are a function of the step.
fn energy(step: u64) -> Energy {
    let step = step as f64;
    Energy {
        drive_work_j: step,
        prestress_work_j: 2.0 * step,
        friction_heat_j: 3.0 * step,
        anchor_change_j: 4.0 * step,
        viscous_loss_j: 5.0 * step,
        kinetic_j: 6.0 * step,
        elastic_j: 7.0 * step,
        scheme_work_j: 8.0 * step,
        radiated_j: Some(9.0 * step),
        ..Energy::default()
    }
}

/// The energies of a rupture, in the order of the fields of [`energy`].
fn energies(rupture: &Rupture) -> [Option<f64>; 9] {
    [
        rupture.drive_work_j,
        rupture.prestress_work_j,
        rupture.friction_heat_j,
        rupture.anchor_change_j,
        rupture.viscous_loss_j,
        rupture.kinetic_change_j,
        rupture.elastic_change_j,
        rupture.scheme_work_j,
        rupture.radiated_j,
    ]
}

/// Pseudo-random slides, no block twice at once.
fn slides(random: &mut Random, blocks: u32, steps: u64, count: u64) -> Vec<Slide> {
    let mut free_from = vec![1; blocks as usize];
    let mut slides = Vec::new();
    for _ in 0..count {
        let block = random.below(u64::from(blocks)) as usize;
        let detach = free_from[block] + random.below(6);
        let attach = detach + 1 + random.below(5);
        free_from[block] = attach + 1;
        if detach < steps {
            slides.push(Slide {
                detach,
                block: block as u32 + 1,
                attach: (attach < steps).then_some(attach),
            });
        }
    }
    slides.sort_unstable();
    slides
}

/// The definition: components of the graph of all detachments, compared pair by pair.
fn components(slides: &[Slide]) -> BTreeSet<Vec<Slide>> {
    let mut of: Vec<usize> = (0..slides.len()).collect();
    for (i, a) in slides.iter().enumerate() {
        for (j, b) in slides.iter().enumerate() {
            let linked = a.block.abs_diff(b.block) <= 1 && a.detach.abs_diff(b.detach) <= LINK_STEPS;
            if linked && of[i] != of[j] {
                let (from, to) = (of[i], of[j]);
                of.iter_mut().filter(|of| **of == from).for_each(|of| *of = to);
            }
        }
    }
    let names: BTreeSet<usize> = of.iter().copied().collect();
    let members =
        |name: usize| slides.iter().zip(&of).filter(move |(_, of)| **of == name).map(|(slide, _)| *slide);
    names.into_iter().map(|name| members(name).collect()).collect()
}

fn decode<P: EventPayload>(events: &[Event]) -> Vec<P> {
    events.iter().map(|event| event.get().cloned().expect("it is of that kind")).collect()
}

fn events(records: &[StepRecord], blocks: u32, detector: impl Detector + 'static) -> Vec<Event> {
    Detectors::new(blocks, SlipRules::EVERY_SLIP, vec![Box::new(detector)])
        .with_ruptures(links().tracker(blocks))
        .all_events(records)
}

fn ruptures(records: &[StepRecord], blocks: u32) -> Vec<Rupture> {
    decode(&events(records, blocks, RuptureDetector::new(blocks, links())))
}

fn arrivals(records: &[StepRecord], blocks: u32) -> Vec<Arrival> {
    decode(&events(records, blocks, ArrivalDetector::new(blocks, links())))
}

/// The numbers of a rupture that identify its component.
type Signature = (u64, Option<u64>, u32, u32, u32, u64);

fn signature_of(rupture: &Rupture) -> Signature {
    (
        rupture.onset_step,
        rupture.end_step,
        rupture.nucleation_block,
        rupture.first_block,
        rupture.last_block,
        rupture.detachments,
    )
}

fn signature(component: &[Slide]) -> Signature {
    let first = component.iter().min().expect("a component has a member");
    let ends: Option<Vec<u64>> = component.iter().map(|slide| slide.attach).collect();
    let blocks = component.iter().map(|slide| slide.block);
    (
        first.detach + 1,
        ends.map(|ends| ends.into_iter().max().expect("a component has a member") + 1),
        first.block,
        blocks.clone().min().expect("a component has a member"),
        blocks.max().expect("a component has a member"),
        component.len() as u64,
    )
}

#[test]
fn ruptures_are_the_connected_sets_of_detachments() {
    let (mut overlaps, mut budgets) = (0, 0);
    for seed in 0..400 {
        let mut random = Random::new(seed);
        let (blocks, steps) = (2 + random.below(12) as u32, 20 + random.below(60));
        let slides = slides(&mut random, blocks, steps, 4 * u64::from(blocks));
        let records = records(&slides, steps, &mut random);
        let found = ruptures(&records, blocks);
        let expected = components(&slides);
        let mut expected_signatures: Vec<Signature> = expected.iter().map(|one| signature(one)).collect();
        let mut found_signatures: Vec<Signature> = found.iter().map(signature_of).collect();
        expected_signatures.sort_unstable();
        found_signatures.sort_unstable();
        assert_eq!(found_signatures, expected_signatures, "seed {seed}");

        // Overlap follows from the steps in which each slid.
        let span = |one: &Rupture| (one.onset_step, one.end_step.unwrap_or(u64::MAX));
        for one in &found {
            let (from, to) = span(one);
            let others = found.iter().filter(|other| other.rupture != one.rupture).map(span);
            let overlapping =
                others.into_iter().any(|(other_from, other_to)| other_from < to && from < other_to);
            assert_eq!(one.overlapping, overlapping, "seed {seed}, rupture {}", one.rupture);
            overlaps += u64::from(overlapping);

            // Energies from the step before the onset to the last sliding step, if no other rupture
            // overlaps; the anchor change always comes from its own switches.
            let component =
                expected.iter().find(|other| signature(other) == signature_of(one)).expect("it is there");
            let anchor_j = anchored_j(component);
            let own = one.end_step.filter(|_| !overlapping && !one.open);
            budgets += u64::from(own.is_some());
            let mut changes = [1, 2, 3, 0, 5, 6, 7 - 4, 8, 9]
                .map(|times| own.map(|end_step| (times * (end_step - one.onset_step)) as f64));
            changes[3] = Some(anchor_j);
            changes[6] = changes[6].map(|in_steps_j| in_steps_j + anchor_j);
            assert_eq!(energies(one), changes, "seed {seed}, rupture {}", one.rupture);
        }
        assert!(found.iter().map(|one| one.rupture).eq(0..found.len() as u64), "seed {seed}");

        // The blocks of each, one by one.
        let passed = arrivals(&records, blocks);
        for one in &found {
            let of: Vec<&Arrival> = passed.iter().filter(|arrival| arrival.rupture == one.rupture).collect();
            let component =
                expected.iter().find(|other| signature(other) == signature_of(one)).expect("it is there");
            assert!(
                of.iter().map(|arrival| arrival.block).eq(one.first_block..=one.last_block),
                "seed {seed}"
            );
            for arrival in of {
                let slides: Vec<&Slide> =
                    component.iter().filter(|slide| slide.block == arrival.block).collect();
                assert_eq!(u64::from(arrival.detachments), slides.len() as u64, "seed {seed}");
                assert_eq!(arrival.arrival_step, slides[0].detach + 1, "seed {seed}");
                let last = slides[slides.len() - 1];
                assert_eq!(arrival.stop_step, last.attach.map(|step| step + 1), "seed {seed}");
            }
        }
    }
    assert!(overlaps > 100 && budgets > 100, "{overlaps}, {budgets}");
}

#[test]
fn the_order_of_switches_in_a_step_changes_nothing() {
    let mut random = Random::new(11);
    for seed in 0..100 {
        let slides = slides(&mut random, 12, 40, 60);
        let in_order = records(&slides, 40, &mut random);
        let mut out_of_order = in_order.clone();
        for record in &mut out_of_order {
            for at in 1..record.switches.len() {
                record.switches.swap(at, random.below(at as u64 + 1) as usize);
            }
        }
        assert_ne!(in_order, out_of_order, "{seed}");
        assert_eq!(ruptures(&out_of_order, 12), ruptures(&in_order, 12), "{seed}");
        assert_eq!(arrivals(&out_of_order, 12), arrivals(&in_order, 12), "{seed}");
    }
}

#[test]
fn where_samples_stand_changes_nothing() {
    let mut random = Random::new(7);
    for _ in 0..50 {
        let slides = slides(&mut random, 9, 80, 40);
        let [one, other] = [0, 1].map(|_| ruptures(&records(&slides, 80, &mut random), 9));
        assert_eq!(one, other);
    }
}

#[test]
fn a_front_tells_its_speed_and_what_was_before() {
    // From block 5 both ways, a step to each block; before that, block 7 slid alone.
    let mut slides = vec![Slide { detach: 1, block: 7, attach: Some(2) }];
    for block in 1..=12u32 {
        let away = u64::from(block.abs_diff(5));
        slides.push(Slide { detach: 20 + away, block, attach: Some(40) });
    }
    slides.sort_unstable();
    let records = records(&slides, 60, &mut Random::new(1));
    let found = ruptures(&records, 12);
    assert_eq!(found.len(), 2);
    let [alone, front] = [&found[0], &found[1]];
    assert_eq!((alone.farthest_block_before, front.farthest_block_before), (None, Some(7)));
    assert!(!alone.reached_every_block && front.reached_every_block);
    let speed = 0.001 / STEP_S;
    assert!((front.front_speed_up_m_per_s.expect("it ran") - speed).abs() < 1e-12);
    assert!((front.front_speed_down_m_per_s.expect("it ran") - speed).abs() < 1e-12);
    assert_eq!((front.onset_step, front.arrival_s, front.end_s), (21, 28.0 * STEP_S, Some(41.0 * STEP_S)));
    for arrival in arrivals(&records, 12).iter().filter(|arrival| arrival.rupture == front.rupture) {
        assert_eq!(arrival.front_speed_m_per_s.is_none(), arrival.block == 5);
        assert!(arrival.front_speed_m_per_s.is_none_or(|found| (found - speed).abs() < 1e-12));
    }
}

/// As of a node at the surface of a medium, whose force is that of half a cell, although it slips as others.
#[test]
fn half_a_first_block_counts_half() {
    let links = Links { first_share: 0.5, ..links() };
    let at = |step: u64, direction, of: [(f64, f64); 2]| {
        let switches = (1..).zip(of).map(|(block, (displacement_m, tangential_force_n))| Switch {
            displacement_m,
            stick_position_m: displacement_m,
            tangential_force_n,
            ..switch(block, direction)
        });
        StepRecord { switches: switches.collect(), ..quiet_step(step, step as f64 * STEP_S, 0.4) }
    };
    let records = [
        at(1, Direction::Detach, [(0.0, 4.0), (0.0, 8.0)]),
        at(3, Direction::Attach, [(0.004, 1.0), (0.001, 2.0)]),
        quiet_step(20, 20.0 * STEP_S, 0.4),
    ];
    let detectors = Detectors::new(2, SlipRules::EVERY_SLIP, vec![Box::new(RuptureDetector::new(2, links))]);
    let events = detectors.with_ruptures(links.tracker(2)).all_events(&records);
    let rupture: &Rupture = events.iter().find_map(Event::get).expect("there is one");
    let near = |found: Option<f64>, expected: f64| (found.unwrap() / expected - 1.0).abs() < 1e-12;
    assert!(near(rupture.mean_slip_m, 0.002) && near(rupture.potency_m2, 3e-6), "{rupture:?}");
    assert!(near(rupture.moment_n_m, 50.0 * 3e-6) && near(rupture.mean_strength_drop_n, 6.0), "{rupture:?}");
}
