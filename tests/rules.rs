//! `docs/rules.md` suffices to compute a run elsewhere: a small program that was written from it
//! (`rules/stepper.py`) gets the same slip events.

use std::fs;

use serde_json::Value;

use crate::support::binary::{self, succeed, text, with_sets};
use crate::support::clients::{Python, file, said};

/// A stiff drive and long steps, so that few of them contain many events.
const STATED: [&str; 5] = [
    "parameter_set=as-stated",
    "slider.blocks=20",
    "time.step_s=2e-7",
    "time.duration_s=0.04",
    "drive.velocity_m_per_s=0.06",
];

const MORE_BLOCKS: [&str; 1] = ["slider.blocks=25"];

/// Thirty-one runs over all laws, drives, courses of the load and starts.
const CASES: [(&str, &[&str]); 31] = [
    ("stated", &[]),
    ("two-way", &["friction.reattach=two-way", "time.duration_s=0.02"]),
    ("tilt-and-shear", &["normal_load.tilt=-0.5", "initial_shear.beta=0.2"]),
    (
        "expansion-and-prestress",
        &["initial_shear.poisson_ratio=0.3", "normal_load.tilt=0.3", "prestress.ratio=0.05"],
    ),
    ("scatter", &["friction.static_spread=0.1", "friction.dynamic_spread=0.05", "friction.spread_seed=7"]),
    (
        "course",
        &[
            "drive.course_s=[0.01,0.01,0.02,0.024,0.024,0.03]",
            "drive.course_m_per_s=[0.06,0.03,0.12,0.12,0,0.1]",
        ],
    ),
    ("clamped", &["slider.right_end=clamped"]),
    ("absorbing", &["slider.right_end=absorbing", "normal_load.tilt=-0.5"]),
    (
        "periodic",
        &[
            "slider.left_end=periodic",
            "slider.right_end=periodic",
            "drive.kind=top",
            "drive.tilt=0.5",
            "friction.static_spread=0.1",
        ],
    ),
    ("by-spring", &["friction.detach_by=spring"]),
    (
        "drag-at-rest",
        &[
            "friction.law=velocity-weakening",
            "friction.drag_at_rest=true",
            "friction.dynamic_coefficient=0.6",
            "time.duration_s=0.008",
        ],
    ),
    (
        "by-force",
        &[
            "drive.kind=force",
            "drive.course_s=[0,0.02,0.02,0.03]",
            "drive.course_n=[0,260,100,320]",
            "slider.blocks=20",
        ],
    ),
    (
        "courses-of-blocks",
        &[
            "slider.blocks=3",
            "normal_load.course_s=[0.005,0.015,0.03]",
            "normal_load.course_factor=[1,1,1,0.4,1.2,0.9,1,0.5,1]",
            "prestress.course_s=[0,0.02]",
            "prestress.course_ratio=[0.05,0.2]",
            "prestress.rise_ratio=0.1",
        ],
    ),
    (
        "correlated",
        &[
            "disorder.correlation_length_m=0.02",
            "disorder.stiffness_spread=0.4",
            "disorder.load_spread=0.3",
            "friction.static_spread=0.1",
        ],
    ),
    (
        "asperities",
        &[
            "disorder.distribution=two-valued",
            "disorder.asperity_share=0.3",
            "disorder.correlation_length_m=0.01",
            "disorder.load_spread=0.2",
            "disorder.stiffness_offsets=[0,0.5,-0.5,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0.2]",
        ],
    ),
    (
        "lognormal",
        &["disorder.distribution=lognormal", "disorder.load_spread=0.5", "friction.dynamic_spread=0.1"],
    ),
    (
        "weibull",
        &[
            "disorder.distribution=weibull",
            "disorder.weibull_modulus=3",
            "disorder.stiffness_spread=0.3",
            "friction.static_spread=0.1",
        ],
    ),
    ("ageing", &["friction.ageing_coefficient=0.05", "friction.ageing_time_s=1e-3"]),
    ("rigid", &["friction.law=rigid", "slider.blocks=20"]),
    ("slip-weakening", &["friction.law=rigid", "slider.blocks=20", "friction.weakening_slip_m=1e-6"]),
    (
        "slip-memory",
        &[
            "friction.law=rigid",
            "slider.blocks=20",
            "normal_load.tilt=-0.5",
            "friction.weakening_slip_m=3e-6",
            "friction.slip_memory_s=2e-5",
            "normal_load.schedule_s=[0.001,0.01]",
            "normal_load.schedule_n=[400,300]",
        ],
    ),
    (
        "slip-weakening-springs",
        &[
            "friction.weakening_slip_m=1e-6",
            "friction.weakening_slip_offsets_m=[0,0,0,0,0,0,0,0,0,0,0,0,0,0,2e-6,2e-6,0,0,0,0,0,0,0,0,0]",
            "friction.weakening_fractions=[0.1,0.5]",
            "friction.weakening_shares=[1.2,0.3]",
        ],
    ),
    (
        "barrier",
        &[
            "friction.law=rigid",
            "prestress.from_blocks=[1,6,20]",
            "prestress.from_blocks_ratio=[0.1,0.3,-0.2]",
            "friction.stuck_blocks=[3,25]",
        ],
    ),
    ("radiating", &["friction.radiation_kg_per_s=0.5"]),
    ("rigid-radiating", &["friction.law=rigid", "slider.blocks=20", "friction.radiation_kg_per_s=0.5"]),
    (
        "weakening",
        &[
            "friction.law=velocity-weakening",
            "friction.weakening_velocity_m_per_s=0.05",
            "friction.radiation_kg_per_s=0.5",
            // Later, rounding is amplified.
            "time.duration_s=0.015",
        ],
    ),
    ("top", &["drive.kind=top", "drive.decay_length_m=0.02", "initial_shear.beta=0.3"]),
    ("both-ends", &["drive.kind=left-right", "friction.reattach=two-way", "time.duration_s=0.015"]),
    (
        "unloaded",
        &[
            "drive.until_load_ratio=0.3",
            "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0,0.01]",
            "normal_load.schedule_n=[400,60]",
        ],
    ),
    (
        "one-block",
        &[
            "slider.blocks=1",
            "friction.interfacial_stiffness_ratio=10",
            "drive.stiffness_n_per_m=8e6",
            "drive.velocity_m_per_s=0.2",
            "time.duration_s=0.01",
        ],
    ),
    (
        "coded-and-loaded",
        &[
            "parameter_set=as-coded",
            "slider.blocks=40",
            "time.step_s=2e-6",
            "time.duration_s=0.4",
            "drive.velocity_m_per_s=0.0005",
            "time.start=loaded",
        ],
    ),
];

/// Short runs of two laws and of slip that is remembered; the last is two-way.
const SHORT: [&str; 3] = ["weakening", "slip-memory", "both-ends"];

mod in_ci {
    use super::*;

    #[test]
    #[ignore = "needs packages of others: cargo xtask ci"]
    fn a_program_written_from_the_rules_gets_the_same_events() {
        compare_with_the_program(|name| SHORT.contains(&name));
    }
}

#[test]
#[ignore = "a minute of a slow program: cargo xtask nightly"]
fn a_program_written_from_the_rules_gets_the_same_events_in_all_cases() {
    compare_with_the_program(|_| true);
}

fn compare_with_the_program(is_wanted: fn(&str) -> bool) {
    let Some(python) = Python::find() else { return };
    let folder = asperity_testkit::folder();
    let compare = |&(name, sets): &(&str, &[&str])| {
        let log = folder.path().join(format!("{name}.mcap"));
        let sets = [&STATED[..], &MORE_BLOCKS, sets].concat();
        binary::run(&with_sets(&["default"], &sets), &log);
        let scenario = folder.path().join(format!("{name}.toml"));
        fs::write(&scenario, succeed(&["scenario", "show", text(&log)])).expect("the folder can be written");
        let ours = succeed(&["events", text(&log), "--format", "json"]);
        let ours: Vec<Value> = serde_json::from_str(&ours).expect("it is JSON");
        let stepper = file("tests/rules/stepper.py");
        let output = python.program("python3", &[text(&stepper), text(&scenario)]);
        assert!(output.status.success(), "{name}: {}", said(&output));
        let theirs = String::from_utf8(output.stdout).expect("it is text");
        let rows: Vec<Vec<&str>> = theirs.lines().skip(1).map(|row| row.split(',').collect()).collect();
        assert!(ours.len() >= 20, "{name} has {} events", ours.len());
        assert_eq!(rows.len(), ours.len(), "{name}");
        let columns =
            ["onset_step", "end_step", "first_block", "last_block", "blocks_slipped", "max_sliding"];
        for (number, (row, event)) in rows.iter().zip(&ours).enumerate() {
            let expected =
                columns.map(|column| event[column].as_u64().map_or(String::new(), |n| n.to_string()));
            assert_eq!(row[..6], expected, "{name}, event {number}");
            let (load, expected) = (row[6].parse::<f64>().expect("a number"), &event["ft_fn_onset"]);
            let expected = expected.as_f64().expect("a number");
            assert!((load - expected).abs() < 1e-6, "{name}, event {number}: {load}, not {expected}");
        }
    };
    // One case after the other on each of two threads: the program is slow.
    std::thread::scope(|scope| {
        for half in CASES.chunks(CASES.len().div_ceil(2)) {
            scope.spawn(move || half.iter().filter(|(name, _)| is_wanted(name)).for_each(compare));
        }
    });
}
