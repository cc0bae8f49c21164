//! Synthetic runs whose summaries can be computed by hand.

use std::collections::{BTreeMap, BTreeSet};

use asperity_model::Scenario;
use asperity_model::resolve;
use asperity_numbers::{OfRecording, Summarizer, Summary, text};
use asperity_record::{
    Direction, Energy, Event, Observer, Parts, RunEnd, RunHeader, RunStatus, Rupture, Scales, SlipEvent,
    SolverReport, StepRecord, unit_of,
};
use asperity_testkit::{quiet_step, run_header, slip_event, switch};
use serde_json::Value;

/// Ten blocks, in steps of a millisecond. Nine waves from block to block take half a second, at 4 m/s.
fn header() -> RunHeader {
    let scales = Scales {
        block_length_m: 2.0 / 9.0,
        block_time_s: 0.5 / 9.0,
        link_time_ratio: 3.0,
        modulus_n_per_m: 2e4,
        interfacial_stiffness_n_per_m: 1e4,
    };
    RunHeader { blocks: 10, time_step_s: 1e-3, steps: 10_000, scales, ..run_header() }
}

/// That header, of a run whose contacts have a state.
fn header_with_state() -> RunHeader {
    RunHeader { flags: Parts { state: true, ..Parts::default() }, ..header() }
}

/// Contacts of 2 mm by 1 mm, and the length law `linear`.
fn scenario() -> Scenario {
    let keys = [
        "friction.dynamic_coefficient=0.5",
        "slider.blocks=10",
        "slider.length_m=0.018",
        "slider.width_m=1e-3",
    ];
    resolve("default", &keys).unwrap()
}

fn summarizer() -> Summarizer {
    Summarizer::new("mine", &header(), Some(&scenario()))
}

fn seconds(step: u64) -> f64 {
    step as f64 / 1000.0
}

/// A rupture from block 1 to another block, with times in milliseconds; its load drops by a
/// hundredth, its mean slip is 2 mm.
fn rupture(number: u64, onset: u64, arrival: u64, end: u64, last_block: u32, ft_fn: f64) -> Rupture {
    let wide = last_block >= 4;
    Rupture {
        rupture: number,
        onset_s: seconds(onset),
        end_s: Some(seconds(end)),
        reached_every_block: last_block == 10,
        ft_fn_onset: ft_fn,
        ft_fn_arrival: ft_fn,
        ft_fn_end: Some(ft_fn - 0.01),
        arrival_s: seconds(arrival),
        front_speed_up_m_per_s: wide.then_some(f64::from(last_block) / 2.0),
        mean_slip_m: Some(2e-3),
        largest_slip_m: Some(f64::from(last_block) * 1e-3),
        potency_m2: Some(f64::from(last_block) * 1e-4),
        moment_n_m: Some(f64::from(last_block) * 2.0),
        mean_strength_drop_n: Some(1.5),
        friction_heat_j: Some(f64::from(last_block) / 4.0),
        mean_shear_force_drop_n: Some(0.5),
        slip_weighted_shear_force_drop_n: Some(f64::from(last_block)),
        ..asperity_testkit::rupture(onset, Some(end), 1..=last_block)
    }
}

fn slip(number: u64, onset: u64, end: Option<u64>, blocks: u32) -> SlipEvent {
    SlipEvent {
        onset_s: seconds(onset),
        end_s: end.map(seconds),
        max_sliding: blocks,
        ft_fn_onset: 0.125,
        ft_fn_end: end.map(|_| 0.1),
        event: number,
        end_step: end,
        ft_fn_min: 0.1,
        ft_fn_max: 0.2,
        open: end.is_none(),
        ..slip_event(onset, end.unwrap_or(onset), 1..=blocks)
    }
}

/// A record of blocks that detach in a step.
fn detach(step: u64, blocks: &[u32]) -> StepRecord {
    StepRecord {
        switches: blocks.iter().map(|&block| switch(block, Direction::Detach)).collect(),
        ..quiet_step(step, seconds(step), 0.4)
    }
}

fn assert_near(found: Option<f64>, expected: f64) {
    let found = found.expect("there is one");
    assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
}

#[test]
fn precursors_grow_from_block_1_and_the_whole_slider_is_none_of_them() {
    let mut run = summarizer();
    // Not in the order of onsets: 2 comes after 5, is shorter, and is no precursor; 3 does not
    // include block 1.
    let ruptures = [
        rupture(0, 1000, 1010, 1020, 2, 0.10),
        rupture(1, 3000, 3040, 3100, 8, 0.45),
        rupture(2, 2000, 2020, 2040, 5, 0.30),
        Rupture { first_block: 4, nucleation_block: 5, ..rupture(3, 1500, 1505, 1510, 9, 0.2) },
        rupture(4, 2500, 2510, 2515, 5, 0.35),
        rupture(5, 4000, 4080, 4200, 10, 0.50),
        rupture(6, 4500, 4520, 4540, 9, 0.48),
        rupture(7, 5000, 5080, 5200, 10, 0.52),
    ];
    for rupture in &ruptures {
        run.event(&Event::new(rupture.clone()));
    }
    let found = run.finish(true, None);
    assert_eq!((found.precursor_count, found.global_rupture_count), (Some(3), Some(2)));
    assert_eq!((found.rupture_count, found.wide_rupture_count), (Some(8), Some(7)));
    assert_near(found.longest_precursor_ratio, 0.8);
    // The rupture of two blocks before it is not wide.
    assert_eq!((found.first_precursor_onset_s, found.first_precursor_ft_fn), (Some(2.0), Some(0.3)));
    assert_eq!(found.first_precursor_contacts, Some(5));
    // From 0.2 over 0.5 to 0.8.
    assert_near(found.precursor_growth_ratio, 0.3);
    assert_eq!(found.first_global_rupture_onset_s, Some(4.0));
    assert_eq!(found.first_global_rupture_last_block_s, Some(4.08));
    assert_eq!(found.first_global_rupture_end_s, Some(4.2));
    assert_eq!(found.first_global_rupture_ft_fn, Some(0.5));
    assert_near(found.first_global_rupture_front_speed_m_per_s, 5.0);
    assert_near(found.precursor_drop_ft_fn, 0.01);
    // 20, 40 and 100 ms; 10, 20 and 40 ms; 200 and 200; 80 and 80.
    assert_near(found.precursor_duration_s, 0.04);
    assert_near(found.precursor_crossing_s, 0.02);
    assert_near(found.global_rupture_duration_s, 0.2);
    assert_near(found.global_rupture_crossing_s, 0.08);
    // Precursors of 5 and 8 blocks at 2.5 and 4 m/s, two global ones at 5.
    assert_near(found.precursor_front_speed_m_per_s, 3.25);
    assert_near(found.front_speed_m_per_s, 4.5);
    assert_near(found.front_speed_over_wave_speed_ratio, 1.125);
    assert_near(found.largest_slip_m, 0.01);
    // The mean potency, 1e-3 m2, by the modulus of the header.
    assert_near(found.global_rupture_moment_n_m, 20.0);
    assert_near(found.global_rupture_strength_drop_n, 1.5);
    assert_near(found.global_rupture_stress_drop_pa, 2.5e5);
    assert_near(found.global_rupture_weighted_stress_drop_pa, 5e6);
    // Of 2, 5 and 8 blocks, a quarter of a joule each; of 10 and 10.
    assert_near(found.precursor_heat_j, 1.25);
    assert_near(found.global_rupture_heat_j, 2.5);
    // Residuals against 0.5 x: 0 at 0.2, 0.05 at 0.5, 0.05 at 0.8. Slope (0.3 * 0.05) / 0.18; the
    // line passes the mean, 1/30 at 0.5.
    assert_eq!(found.length_law.as_deref(), Some("linear"));
    assert_near(found.length_law_slope_residual, 0.015 / 0.18);
    assert_near(found.length_law_intercept_residual, 0.1 / 3.0 - 0.5 * 0.015 / 0.18);
    assert_near(found.length_law_rms_residual, (0.005_f64 / 3.0).sqrt());
}

/// A solver that chooses its steps has no error of fronts from the step of the grid.
#[test]
fn only_fixed_steps_have_an_error_of_front_speeds() {
    let error_of = |header: &RunHeader| {
        let mut run = Summarizer::new("front", header, Some(&scenario()));
        run.rupture(&rupture(0, 1000, 1040, 1100, 8, 0.4));
        let found = run.finish(true, None);
        assert_near(found.front_speed_m_per_s, 4.0);
        found.front_speed_error_ratio
    };
    assert!(error_of(&header()).is_some_and(|error| error > 0.0));
    assert_eq!(error_of(&header_with_state()), None);
}

#[test]
fn what_contacts_radiated_is_that_of_the_last_record() {
    let radiated_j = |energies: &[Option<f64>]| {
        let mut run = summarizer();
        for (step, radiated_j) in (1..).zip(energies) {
            let energy = Energy { radiated_j: *radiated_j, ..Energy::default() };
            run.step(&StepRecord { energy, ..quiet_step(step, seconds(step), 0.4) });
        }
        run.finish(true, None).radiated_j
    };
    assert_eq!([radiated_j(&[Some(0.5), Some(0.75)]), radiated_j(&[None, None])], [Some(0.75), None]);
}

/// Ten blocks by rate-and-state friction, with drive springs of 1 N/m each whose point moves at 1 mm/s.
fn with_state(keys: &[&str]) -> Scenario {
    let usual = [
        "slider.blocks=10",
        "friction.evolution_offsets=[]",
        "drive.stiffness_n_per_m=10",
        "drive.velocity_m_per_s=1e-3",
        "time.step_s=1e-3",
        "time.duration_s=10",
    ];
    resolve("rate-and-state", &[&usual[..], keys].concat()).unwrap()
}

/// The drive point moves by 9 mm and its springs shorten by 1 mm, so that the blocks move by 10 mm on average. One
/// rupture moves all ten by 2 mm, another five of them.
#[test]
fn creep_is_what_moves_outside_of_ruptures() {
    let creep_ratio = |scenario: Scenario, last: &Rupture, has_ruptures: bool, status: Option<RunStatus>| {
        let mut run = Summarizer::new("creep", &header_with_state(), Some(&scenario));
        let of_force = |step: u64, driving_force_n: f64| StepRecord {
            driving_force_n,
            ..quiet_step(step, seconds(step), 0.4)
        };
        run.step(&of_force(1_000, 0.03));
        run.rupture(&rupture(0, 2_000, 2_040, 2_100, 10, 0.4));
        run.rupture(last);
        run.step(&of_force(10_000, 0.02));
        run.finish(has_ruptures, status.map(|status| end(status, 10_000, &[])).as_ref()).creep_ratio
    };
    let last = rupture(1, 3_000, 3_040, 3_100, 5, 0.4);
    let whole = Some(RunStatus::Complete);
    assert_near(creep_ratio(with_state(&[]), &last, true, whole), 1.0 - 30e-3 / 100e-3);
    let sliding = Rupture { mean_slip_m: None, ..last.clone() };
    let other = resolve("default", &["slider.blocks=10"]).unwrap();
    for (scenario, last, from, status, why) in [
        (with_state(&[]), &last, false, whole, "without ruptures"),
        (with_state(&[]), &sliding, true, whole, "a block slid at the end"),
        (with_state(&["drive.kind=side"]), &last, true, whole, "one block is pulled"),
        (other, &last, true, whole, "no state"),
        (with_state(&[]), &last, true, None, "the log was cut"),
        (with_state(&[]), &last, true, Some(RunStatus::Salvaged), "the log lost records"),
    ] {
        assert_eq!(creep_ratio(scenario, last, from, status), None, "{why}");
    }
}

#[test]
fn the_peak_velocity_is_the_largest_of_all_slips() {
    let peak = |peaks: &[Option<f64>]| {
        let mut run = summarizer();
        for (number, peak_velocity_m_per_s) in (0..).zip(peaks) {
            let peak_velocity_m_per_s = *peak_velocity_m_per_s;
            run.slip_event(&SlipEvent { peak_velocity_m_per_s, ..slip(number, 100 * (number + 1), None, 2) });
        }
        run.finish(true, None).peak_velocity_m_per_s
    };
    assert_eq!([peak(&[Some(0.25), Some(0.5), Some(0.125)]), peak(&[None])], [Some(0.5), None]);
}

#[test]
fn recurrence_is_that_of_the_first_times_and_of_the_later_half() {
    let of = |onsets: &[u64]| {
        let mut run = summarizer();
        for (number, onset) in onsets.iter().enumerate() {
            run.rupture(&rupture(number as u64, *onset, onset + 50, onset + 90, 10, 0.45));
        }
        let found = run.finish(true, None);
        (found.recurrence_transient_s, found.recurrence_steady_s)
    };
    assert_eq!(of(&[]), (None, None));
    assert_eq!(of(&[1000]), (None, None));
    assert_eq!(of(&[1000, 1500]), (Some(0.5), None));
    assert_eq!(of(&[1000, 1500, 2250, 2500]), (Some(0.5), None));
    // 1, 0.25, 0.5 and 0.75 s: the first of them; the middle of the last two.
    assert_eq!(of(&[1000, 2000, 2250, 2750, 3500]), (Some(1.0), Some(0.625)));
    // Five times: two are in the first quarter and two in the later half.
    assert_eq!(of(&[1000, 2000, 2250, 2750, 3500, 4000]), (Some(0.625), Some(0.625)));
}

#[test]
fn creep_comes_to_the_blocks_that_slid_before_a_front_did() {
    let mut run = summarizer();
    for (step, blocks) in [(99, vec![1]), (199, vec![2]), (299, vec![10]), (399, vec![3, 4]), (999, vec![5])]
    {
        run.step(&detach(step, &blocks));
    }
    run.rupture(&rupture(0, 100, 400, 420, 3, 0.1));
    // Block 5 is the first of it: it had not slid before.
    run.rupture(&rupture(1, 1000, 1080, 1200, 10, 0.4));
    run.slip_event(&slip(0, 100, Some(900), 5));
    run.slip_event(&slip(1, 1000, Some(1300), 10));
    let found = run.finish(true, None);
    assert_eq!((found.creep_front_block, found.creeps), (Some(4), Some(true)));
    // 0.8 s of the first second.
    assert_near(found.sliding_time_ratio, 0.8);
    assert_eq!(found.detachment_count, 6);

    // As above without the two blocks in the middle.
    let mut run = summarizer();
    run.step(&detach(99, &[1, 5]));
    run.rupture(&rupture(0, 1000, 1080, 1200, 10, 0.4));
    let found = run.finish(true, None);
    assert_eq!((found.creep_front_block, found.creeps), (Some(1), Some(false)));
}

/// Ten columns of two rows: contacts 1 to 10 and 11 to 20.
#[test]
fn over_an_area_lengths_are_columns_and_sizes_contacts() {
    let header = RunHeader { blocks: 20, rows: 2, ..header() };
    let mut run = Summarizer::new("area", &header, None);
    // Column 1 as a whole, then up to column 4; contact 15 stays.
    for (step, contacts) in [(99, vec![1, 11, 2]), (199, vec![12, 13, 3, 14, 4, 5])] {
        run.step(&detach(step, &contacts));
    }
    let over_area = |contacts: u32, rupture: Rupture| Rupture {
        first_across: Some(1),
        last_across: Some(2),
        contacts: Some(contacts),
        potency_m2: None,
        potency_m3: Some(1e-6),
        moment_n_m: Some(3.0),
        ..rupture
    };
    // Three contacts in two columns, four in three; two precursors, of which the second is wide.
    let slow = rupture(0, 1000, 1010, 1020, 2, 0.1);
    run.rupture(&over_area(3, Rupture { front_speed_up_m_per_s: None, ..slow }));
    run.rupture(&over_area(4, rupture(1, 2000, 2010, 2020, 3, 0.2)));
    // From column 8 of the second row, farther down than up.
    let global = Rupture {
        nucleation_block: 18,
        front_speed_up_m_per_s: Some(2.0),
        front_speed_down_m_per_s: Some(7.0),
        ..rupture(2, 3000, 3010, 3020, 10, 0.3)
    };
    run.rupture(&over_area(20, global));
    let found = run.finish(true, None);
    assert_eq!((found.blocks, found.precursor_count, found.global_rupture_count), (20, Some(2), Some(1)));
    assert_near(found.longest_precursor_ratio, 0.3);
    assert_eq!((found.rupture_count, found.wide_rupture_count), (Some(3), Some(2)));
    // Before the first wide rupture, at step 2000.
    assert_eq!((found.creep_front_block, found.creeps), (Some(4), Some(true)));
    assert_near(found.global_rupture_front_speed_m_per_s, 7.0);
    assert_near(found.global_rupture_moment_n_m, 3.0);
}

#[test]
fn events_mislead_where_they_outlast_fronts_or_join_them() {
    let of = |slips: &[SlipEvent], ruptures: &[Rupture]| {
        let mut run = summarizer();
        run.step(&quiet_step(30_000, 30.0, 0.4));
        slips.iter().for_each(|slip| run.slip_event(slip));
        ruptures.iter().for_each(|rupture| run.rupture(rupture));
        run.finish(true, None)
    };
    // A wave takes 0.5 s and the front 0.6 s: 12 s are twenty times as long.
    let crossing = [rupture(0, 1000, 1600, 1700, 10, 0.4)];
    let found = of(&[slip(0, 1000, Some(13_000), 10)], &crossing);
    assert_eq!((found.events_mislead, found.longest_event_s), (Some(false), Some(12.0)));
    let found = of(&[slip(0, 1000, Some(13_001), 10)], &crossing);
    assert_eq!(found.events_mislead, Some(true));
    assert_eq!((found.first_global_event_onset_s, found.global_event_count), (Some(1.0), 1));
    // An event in progress lasts up to the end of the run.
    let found = of(&[slip(0, 1000, None, 10)], &crossing);
    assert_eq!((found.events_mislead, found.longest_event_s), (Some(true), Some(29.0)));
    // Without fronts, ten seconds are twenty times the travel time of a wave.
    assert_eq!(of(&[slip(0, 1000, Some(11_001), 10)], &[]).events_mislead, Some(true));

    // Two of four wide events contain two ruptures each; one rupture lies in none.
    let slips = [1000, 2000, 3000, 4000].map(|onset| slip(0, onset, Some(onset + 500), 8));
    let onsets = [1000, 1200, 1500, 2100, 2300, 3000];
    let ruptures: Vec<Rupture> =
        onsets.iter().map(|&onset| rupture(0, onset, onset + 100, onset + 150, 5, 0.4)).collect();
    let found = of(&slips, &ruptures);
    assert_eq!((found.wide_event_count, found.joined_event_count), (4, Some(2)));
    assert_eq!(found.events_mislead, Some(true));
    // Without one of the second two, one of four.
    let found = of(&slips, &[&ruptures[..3], &ruptures[4..]].concat());
    assert_eq!((found.joined_event_count, found.events_mislead), (Some(1), Some(false)));
}

#[test]
fn a_run_without_ruptures_has_the_numbers_of_its_slip_events() {
    let mut run = summarizer();
    run.slip_event(&slip(0, 500, Some(600), 3));
    run.slip_event(&slip(1, 700, Some(900), 10));
    let found = run.finish(false, None);
    assert_eq!((found.first_slip_s, found.first_slip_ft_fn), (Some(0.5), Some(0.125)));
    assert_eq!((found.event_count, found.first_global_event_onset_s), (2, Some(0.7)));
    assert_eq!((found.precursor_count, found.global_rupture_count, found.rupture_count), (None, None, None));
    assert_eq!((found.creeps, found.events_mislead, found.joined_event_count), (None, None, None));
}

#[test]
fn energies_are_those_of_the_last_record_and_counters_those_of_the_end() {
    let energy = Energy { drive_work_j: 3.0, scheme_work_j: -1e-9, ..Energy::default() };
    let mut run = summarizer();
    run.step(&StepRecord { energy: Energy::default(), ..quiet_step(5, 0.005, 0.25) });
    run.step(&StepRecord { energy, normal_load_n: 0.0, ..quiet_step(9, 0.009, 0.5) });
    let end = end(RunStatus::LoadNotReached, 20, &[("windows", 7)]);
    let found = run.finish(true, Some(&end));
    assert_eq!((found.drive_work_j, found.scheme_work_j), (Some(3.0), Some(-1e-9)));
    assert_eq!((found.status.as_str(), found.windows, found.jumps), ("load-not-reached", Some(7), None));
    assert_eq!((found.last_step, found.simulated_s, found.step_record_count), (20, 0.02, 2));
    // Without a normal load there is no ratio.
    assert_eq!(found.largest_ft_fn, Some(0.25));
    assert_eq!(summarizer().finish(true, None).drive_work_j, None);
}

/// The end of a run, with counts of its solver.
fn end(status: RunStatus, last_step: u64, counts: &[(&str, u64)]) -> RunEnd {
    RunEnd {
        energy: None,
        status,
        stopped: None,
        last_step,
        message_counts: BTreeMap::new(),
        switches: 0,
        digest: String::new(),
        topic_digests: BTreeMap::new(),
        solver: SolverReport {
            counts: counts.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect(),
            fallbacks: Vec::new(),
        },
    }
}

/// A summary in which every key has a value.
fn full() -> Summary {
    let mut run = summarizer();
    let energy = Energy { radiated_j: Some(0.5), fracture_energy_j: Some(0.25), ..Energy::default() };
    run.step(&StepRecord { energy, ..detach(99, &[1]) });
    run.step(&StepRecord { energy, ..quiet_step(9_999, 9.999, 0.4) });
    run.slip_event(&SlipEvent { peak_velocity_m_per_s: Some(0.5), ..slip(0, 100, Some(600), 10) });
    for (number, last_block) in [(0, 3), (1, 5), (2, 7), (3, 10), (4, 10), (5, 10), (6, 10), (7, 10)] {
        let onset = 100 + number * 1000;
        run.rupture(&rupture(number, onset, onset + 10, onset + 30, last_block, 0.4));
    }
    let counts = ["plain_steps", "window_steps", "windows", "jump_steps", "jumps"].map(|name| (name, 1));
    let end = end(RunStatus::Complete, 10_000, &counts);
    let summary = run.finish(true, Some(&end));
    // Of eight ruptures there is no law.
    assert_eq!(summary.gutenberg_richter_b, None);
    Summary {
        // Of friction with a state, for which there is no length law.
        creep_ratio: Some(0.5),
        completeness_magnitude: Some(-6.0),
        complete_rupture_count: Some(60),
        gutenberg_richter_b: Some(0.8),
        gutenberg_richter_b_error: Some(0.1),
        gutenberg_richter_test: Some("b = 0.8".to_owned()),
        radiated_over_released_energy_ratio: summary.radiated_over_released_energy_ratio.or(Some(0.01)),
        ruptures_radiated_j: summary.ruptures_radiated_j.or(Some(0.02)),
        ..summary
    }
}

/// A front of 10 blocks over which it would run sooner than waves pass one, and energies no larger than their errors.
#[test]
fn what_the_grid_or_the_step_does_not_resolve_is_no_number() {
    let wave_m_per_s = header().scales.wave_speed_m_per_s();
    let of = |over_wave: f64, viscous_j: f64| {
        let mut run = summarizer();
        run.rupture(&Rupture {
            front_speed_up_m_per_s: Some(over_wave * wave_m_per_s),
            drive_work_j: Some(1.0),
            prestress_work_j: Some(0.0),
            friction_heat_j: Some(3.0 - viscous_j),
            anchor_change_j: Some(0.0),
            viscous_loss_j: Some(viscous_j),
            kinetic_change_j: Some(0.0),
            elastic_change_j: Some(-2.0 - 1e-3),
            scheme_work_j: Some(-1e-3),
            ..rupture(0, 100, 110, 130, 10, 0.4)
        });
        let summary = run.finish(true, Some(&end(RunStatus::Complete, 10_000, &[])));
        let ratio = summary.radiated_over_released_energy_ratio.map(|ratio| (ratio * 3.001 * 1e4).round());
        // The ratio and its energy are known together.
        let radiated_j = summary.ruptures_radiated_j.map(|radiated_j| (radiated_j * 1e4).round());
        assert_eq!(radiated_j, ratio);
        (summary.front_speed_over_wave_speed_ratio, ratio)
    };
    assert_eq!(of(8.0, 0.5), (Some(8.0), Some(5000.0)));
    assert_eq!(of(9.1, 0.0), (None, Some(0.0)));
    assert_eq!([0.9e-3, -0.5, 1.1e-3].map(|viscous_j| of(1.0, viscous_j).1), [None, None, Some(11.0)]);
}

#[test]
fn json_row_keys_and_schema_are_of_one_mind() {
    let full = full();
    let json = serde_json::to_value(&full).expect("it can be JSON");
    let object = json.as_object().expect("it is an object");
    let names: Vec<&str> = Summary::KEYS.iter().map(|key| key.column.name.as_ref()).collect();
    assert_eq!(object.len(), names.len());
    for ((name, value), cell) in names.iter().zip(full.values()).zip(full.row()) {
        assert_eq!(object[*name], value, "{name}");
        assert!(!value.is_null(), "{name} has a value here");
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        assert_eq!(text, cell, "{name}");
    }
    let again: Summary = serde_json::from_value(json.clone()).expect("it can be read");
    assert_eq!(again, full);

    let schema = Summary::schema();
    let properties = schema["properties"].as_object().expect("it has properties");
    // And what they are worth.
    assert_eq!(properties.len(), names.len() + OfRecording::KEYS.len() + 1);
    let required: BTreeSet<&str> =
        schema["required"].as_array().expect("keys are required").iter().filter_map(Value::as_str).collect();
    assert_eq!(required, names[..8].iter().copied().collect());
    for key in Summary::KEYS.iter().chain(OfRecording::KEYS) {
        let name: &str = &key.column.name;
        let said = properties[name]["description"].as_str().expect("each key has a meaning");
        let flat = |text: &str| text.split_whitespace().collect::<Vec<&str>>().join(" ");
        assert_eq!(flat(said), flat(&key.column.about), "{name}");
    }
}

#[test]
fn units_stand_last_and_every_meaning_is_a_sentence() {
    for key in Summary::KEYS {
        let column = &key.column;
        assert!(column.about.ends_with('.') && column.about.len() > 10, "{}: {}", column.name, column.about);
        if let Some(unit) = column.unit.filter(|unit| *unit != "1") {
            assert_eq!(unit_of(&column.name), Some(unit));
        }
    }
}

#[test]
fn a_terminal_gets_a_line_for_each_key_and_a_row_for_each_run() {
    let full = full();
    let one = text::of_one(&full, None);
    let lines: Vec<String> =
        one.lines().map(|line| line.split_whitespace().collect::<Vec<&str>>().join(" ")).collect();
    for line in [
        "First slip of the whole slider",
        "# first global rupture onset 3.1 s",
        "first global rupture F_T/F_N 0.4",
        "~ precursor count 3",
        "~ recurrence steady 1 s",
        "length law linear",
        "# creeps no",
    ] {
        assert!(lines.iter().any(|found| found == line), "{line}\n{one}");
    }
    assert!(one.lines().all(|line| line.chars().count() <= 80), "{one}");
    let mut empty = Summarizer::new("other", &header(), None);
    empty.step(&quiet_step(1, 0.001, 0.1));
    let empty = empty.finish(true, None);
    let without = text::of_one(&empty, None);
    let line = without.lines().find(|line| line.starts_with("~ radiated  ")).expect("it has one");
    assert!(line.ends_with(" -, no radiation damping"), "{line}");
    let several = text::of_several([&full, &empty]);
    let rows: Vec<Vec<&str>> = several.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[2], ["mine", "3", "5", "3.1", "0.4", "1", "5", "0.01", "1", "no"]);
    assert_eq!(rows[3], ["other", "0", "0", "-", "-", "-", "-", "-", "0", "no"]);
    assert!(several.lines().all(|line| line.chars().count() <= 100), "{several}");
}
