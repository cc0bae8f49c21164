//! Prestress and the fronts that it drives, tested with the command: support by both solvers and every
//! command, and agreement of fronts in switches and fields.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary;
use crate::support::binary::{succeed, text, with_sets};
use asperity_testkit::folder;

/// A front in forty blocks: a / c = 1.754e-6 s, so dt = 5.7e-4 a / c.
const FRONT: [&str; 8] = [
    "front",
    "slider.blocks=40",
    "time.step_s=1e-9",
    "time.duration_s=6e-5",
    "prestress.ratio=0.6",
    "prestress.first_block_ratio=0.100000000001",
    "slider.relative_damping=0.1",
    "friction.law=rigid",
];

/// A scenario with overrides as arguments.
fn arguments<'a>(scenario: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    with_sets(&scenario[..1], &[&scenario[1..], more].concat())
}

/// The rows of a topic of a log, as numbers; words are not numbers.
fn rows(log: &Path, topic: &str, columns: &[&str]) -> Vec<Vec<f64>> {
    let folder = folder();
    let exported =
        succeed(&["export", text(log), "--to", "csv", "--topic", topic, "--out", text(folder.path())]);
    let table = fs::read_dir(folder.path())
        .expect("the folder is there")
        .map(|entry| entry.expect("the folder is there").path())
        .find(|path| path.extension().is_some_and(|ending| ending == "csv"))
        .unwrap_or_else(|| panic!("no table: {exported}"));
    let number = |cell: &str| match cell {
        "detach" => 1.0,
        "attach" => -1.0,
        number => number.parse().expect("a number"),
    };
    let rows = binary::rows(&fs::read(table).expect("the table is there"));
    rows.iter().map(|row| columns.iter().map(|column| number(&row[*column])).collect()).collect()
}

/// Block and the first step in which it slides, by the switches.
fn arrivals(log: &Path) -> Vec<(f64, f64)> {
    let mut found: Vec<(f64, f64)> = Vec::new();
    for row in rows(log, "/switch", &["block", "step", "direction"]) {
        if row[2] > 0.0 && found.iter().all(|(block, _)| *block != row[0]) {
            found.push((row[0], row[1] + 1.0));
        }
    }
    found
}

/// Blocks per step, by least squares.
fn speed(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (x, t) = points.iter().fold((0.0, 0.0), |(x, t), point| (x + point.0 / count, t + point.1 / count));
    let (xx, xt) = points.iter().fold((0.0, 0.0), |(xx, xt), point| {
        (xx + (point.0 - x) * (point.0 - x), xt + (point.0 - x) * (point.1 - t))
    });
    xx / xt
}

fn run(scenario: &[&str], more: &[&str], log: &Path) {
    binary::run(&arguments(scenario, more), log);
}

#[test]
fn fronts_in_the_switches_are_those_in_the_fields() {
    let folder = folder();
    let log = folder.path().join("front.mcap");
    // Blocks 10 to 35 at every 20th step, and block 20 at every step.
    let windows = "recording.window=[\
        { from_s = 0, to_s = 6e-5, every_s = 2e-8, first_block = 10, last_block = 35 }, \
        { from_s = 2e-5, to_s = 3e-5, every_s = 1e-9, first_block = 20, last_block = 20 }]";
    run(&FRONT, &[windows], &log);
    let by_switches: Vec<(f64, f64)> =
        arrivals(&log).into_iter().filter(|(block, _)| (10.0..=35.0).contains(block)).collect();
    assert_eq!(by_switches.len(), 26);

    // The detector of ruptures agrees: one rupture of all forty blocks.
    let detected = rows(&log, "/events/arrival", &["rupture", "block", "arrival_step"]);
    assert_eq!(detected.len(), 40);
    for (block, step) in arrivals(&log) {
        assert!(detected.contains(&vec![0.0, block, step]), "block {block}, step {step}: {detected:?}");
    }

    let fields = rows(&log, "/window", &["window", "block", "step", "velocity_m_per_s"]);
    let moving = |window: f64, block: f64| -> Vec<(f64, f64)> {
        let of = fields.iter().filter(|row| row[0] == window && row[1] == block && row[3] > 0.0);
        of.map(|row| (row[2], row[3])).collect()
    };
    // To the step where every step is there.
    let at_20 = by_switches.iter().find(|(block, _)| *block == 20.0).expect("it slides").1;
    assert_eq!(moving(1.0, 20.0)[0].0, at_20);
    // Within the cadence elsewhere; and the speed by the times at which velocities leave zero.
    let mut by_fields = Vec::new();
    for &(block, step) in &by_switches {
        let moving = moving(0.0, block);
        let ((t0, v0), (t1, v1)) = (moving[0], moving[1]);
        assert!((step..step + 20.0).contains(&t0), "block {block}: {step} {t0}");
        by_fields.push((block, t0 - v0 * (t1 - t0) / (v1 - v0)));
    }
    let (switched, dense) = (speed(&by_switches), speed(&by_fields));
    assert!((dense / switched - 1.0).abs() < 2e-4, "{switched} {dense}");
    // And both agree with theory: v = 1.3604 c.
    let over_c = switched * 1.754_116e-6 / 1e-9;
    assert!((over_c / 1.3604 - 1.0).abs() < 1e-3, "{over_c}");
}

#[test]
fn fronts_through_soft_contacts_come_where_the_force_comes_to_the_threshold() {
    let folder = folder();
    let log = folder.path().join("front.mcap");
    let window = "recording.window=[\
        { from_s = 2e-5, to_s = 3e-5, every_s = 1e-9, first_block = 20, last_block = 20 }]";
    run(&FRONT, &["friction.law=interfacial-springs", window], &log);
    let at_20 = arrivals(&log).into_iter().find(|(block, _)| *block == 20.0).expect("it slides").1;
    // mu_s p_n = 0.7 * 10 N; the switch is at the end of the first step with the force.
    let forces = rows(&log, "/window", &["step", "tangential_force_n"]);
    let first = forces.iter().find(|row| row[1] >= 7.0).expect("it comes to the threshold");
    assert_eq!(first[0] + 1.0, at_20);
}

#[test]
fn both_solvers_write_the_same_events_and_every_command_knows_them() {
    let folder = folder();
    let profile = folder.path().join("profile.csv");
    fs::write(&profile, "x_over_l,tau_over_p\n0,0.15\n0.4,0\n1,0.1\n").expect("the folder can be written");
    let from_file = format!("prestress.profile_csv={}", text(&profile));
    let cases: [(&str, &[&str], &[&str]); 4] = [
        ("front", &FRONT, &[]),
        (
            "pulse",
            &FRONT,
            &[
                "drive.kind=top",
                "drive.stiffness_n_per_m=2.6e9",
                "prestress.ratio=0.55",
                "prestress.first_block_ratio=0.150000000001",
            ],
        ),
        (
            "barrier",
            &FRONT,
            &[
                "prestress.first_block_ratio=0",
                "prestress.from_blocks=[2,3,20]",
                "prestress.from_blocks_ratio=[0.100000000001,0,-0.3]",
                "friction.stuck_blocks=[1,40]",
            ],
        ),
        (
            "profile",
            &["ten-blocks"],
            &["time.step_s=1e-7", "time.duration_s=1.2", "prestress.ratio=0.1", &from_file],
        ),
    ];
    for (name, scenario, more) in cases {
        let log = |what: &str| -> PathBuf { folder.path().join(format!("{name}-{what}.mcap")) };
        run(scenario, more, &log("fast"));
        binary::run(&[&arguments(scenario, more)[..], &["--solver", "plain"]].concat(), &log("plain"));
        let events = |log: &Path| succeed(&["events", text(log)]);
        let fast = events(&log("fast"));
        assert!(fast.lines().count() > 1, "{name}: no events");
        // Loads to their last digits are the solver's own.
        let columns = |table: &str| -> Vec<String> {
            let of = |line: &str| line.split(',').take(5).collect::<Vec<_>>().join(",");
            table.lines().map(of).collect()
        };
        assert_eq!(columns(&fast), columns(&events(&log("plain"))), "{name}");
        let all = |log: &Path| rows(log, "/switch", &["step", "block", "direction"]);
        assert_eq!(all(&log("fast")), all(&log("plain")), "{name}");

        let said = succeed(&["check", text(&log("fast"))]);
        assert!(said.contains(": whole: "), "{said}");
        assert!(succeed(&["replay", text(&log("fast"))]).contains("the same as logged"), "{name}");
    }
    // The log contains the contents of the file, and can replace it once it is gone.
    fs::remove_file(&profile).expect("it is there");
    let log = folder.path().join("profile-fast.mcap");
    assert!(succeed(&["check", "--again", text(&log)]).contains(": whole: "));
    let again = folder.path().join("again.mcap");
    binary::run(&[text(&log)], &again);
    assert_eq!(succeed(&["events", text(&log)]), succeed(&["events", text(&again)]));
    let shown = succeed(&["scenario", "show", text(&log)]);
    assert!(shown.contains("[prestress]") && shown.contains("ratio = 0.1"), "{shown}");
}
