//! The fast solver against the plain one: the beginning of every run of Chapter 5,
//! and the near ties that are known.

use std::fs;

use crate::support::binary::{ends, run, succeed, text};
use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_simulator::equality::{NearTie, beyond_switch, rounding_reach};
use asperity_simulator::{Plain, Solver};
use asperity_testkit::run_end;

const PIPELINE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../pipelines/chapter5.toml");
const NEAR_TIES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/near-ties");

fn verify(set: &str) {
    let set = format!("parameter_set={set}");
    let choice = ["--near-ties", NEAR_TIES, "--for-s", "0.1", "--set", &set];
    let table = succeed(&[&["verify-solver", PIPELINE][..], &choice].concat());
    let switches: u64 = table
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(1).and_then(|count| count.parse::<u64>().ok()).expect("a count"))
        .sum();
    assert!(switches > 300, "there is something to compare: {table}");
}

#[test]
#[ignore = "a minute of single steps: cargo xtask nightly"]
fn chapter_5_begins_alike_as_coded() {
    verify("as-coded");
}

#[test]
#[ignore = "a minute of single steps: cargo xtask nightly"]
fn chapter_5_begins_alike_as_stated() {
    verify("as-stated");
}

#[test]
fn known_near_ties_are_decided_by_rounding() {
    for entry in fs::read_dir(NEAR_TIES).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        let proof: serde_json::Value =
            serde_json::from_str(&fs::read_to_string(&path).expect("it is text")).expect("it is JSON");
        let scenario = proof["scenario"].as_str().expect("it names its scenario");
        let scenario = Scenario::resolve(&ScenarioSource::new(text(&path), scenario)).expect("it resolves");
        assert_eq!(proof["scenario_hash"], scenario.hash());
        let plan = Plan::new(&scenario);
        let tie: NearTie = serde_json::from_value(proof["tie"].clone()).expect("it is a near tie");
        let block = tie.block as usize - 1;

        let mut plain = Plain::new(plan.clone());
        plain.restore(&tie.before.clone().into());
        while plain.step() + 1 < tie.step {
            plain.take_step();
        }
        let before = plain.state().clone();
        plain.take_step();
        let beyond = beyond_switch(&plan, &before, plain.state(), block);
        assert_eq!(beyond, tie.beyond, "{}", path.display());
        assert_eq!(beyond >= 0.0, tie.plain_switches, "{}", path.display());
        let reach = rounding_reach(&plan, plain.state(), tie.direction);
        assert!(tie.beyond.abs() <= reach && tie.reach == reach, "{}", path.display());
        assert_eq!(plain.switched().contains(&block), tie.plain_switches, "{}", path.display());
    }
}

#[test]
fn a_near_tie_that_is_none_any_more_is_told() {
    let known = format!("{NEAR_TIES}/beta-045-as-coded-455063385-55.json");
    let known = fs::read_to_string(known).expect("it is text");
    let mut proof: serde_json::Value = serde_json::from_str(&known).expect("it is JSON");
    proof["tie"]["step"] = 1000.into();
    let folder = asperity_testkit::folder();
    fs::write(folder.path().join("moved.json"), proof.to_string()).expect("it can be written");
    let run = proof["run"].as_str().expect("it names its run");
    let choice = ["--only", run, "--for-s", "0.001", "--near-ties", text(folder.path())];
    let verify = [&["verify-solver", PIPELINE][..], &choice].concat();
    ends(1, &verify, &["moved.json: the solvers agree there now"]);
}

/// The runs of a pipeline may be of slabs.
#[test]
fn slabs_are_verified() {
    let folder = asperity_testkit::folder();
    let pipeline = folder.path().join("slabs.toml");
    let coarse = "\"slider.blocks=29\", \"slider.rows=16\", \"time.step_s=4e-7\"";
    let runs = [
        ("side", ", \"time.duration_s=0.25\""),
        ("top", ", \"time.duration_s=0.1\", \"drive.kind=top\", \"drive.height_m=0\""),
    ];
    let runs = runs.map(|(name, sets)| {
        format!("[[run]]\nname = \"{name}\"\nscenario = \"slab\"\nset = [{coarse}{sets}]\n")
    });
    fs::write(&pipeline, format!("title = \"Slabs\"\n{}", runs.concat())).expect("it can be written");
    let table = succeed(&["verify-solver", text(&pipeline)]);
    let switches = |line: &str| line.split(',').nth(1).and_then(|count| count.parse::<u64>().ok());
    let switches: Vec<u64> = table.lines().skip(1).map(|line| switches(line).expect("a count")).collect();
    assert!(switches.len() == 2 && switches[0] > 5, "{table}");
}

#[test]
fn a_log_says_what_its_run_was_made_of() {
    let folder = asperity_testkit::folder();
    for (scenario, jumps, fallbacks) in [("default", 1, 0), ("ring-down", 0, 1)] {
        let log = folder.path().join(format!("{scenario}.mcap"));
        run(&[scenario, "--set", "time.duration_s=0.0002"], &log);
        let report = run_end(&log).solver;
        assert_eq!(report.counts["steps"], 20_000);
        assert_eq!(report.counts["jumps"], jumps, "{scenario}: {report:?}");
        assert_eq!(report.fallbacks.len(), fallbacks, "{scenario}: {report:?}");
        let parts = ["plain_steps", "jump_steps", "window_steps"].map(|part| report.counts[part]);
        assert_eq!(parts.into_iter().sum::<u64>(), 20_000);
    }
    let log = folder.path().join("stats.mcap");
    let run = ["run", "default", "--set", "time.duration_s=0.002", "--stats", "--out", text(&log)];
    ends(0, &run, &["in jumps", "refused windows"]);
}

#[test]
fn what_cannot_be_verified_is_said() {
    for (arguments, said) in [
        (&["--only", "nothing"][..], "--only nothing: no such run"),
        (&["--for-s", "1e-9"][..], "--for-s 0.000000001 is not a whole number of steps"),
        (&["--near-ties", "Cargo.toml"][..], "near tie Cargo.toml"),
        (&["--near-ties", "nowhere"][..], "near tie nowhere"),
    ] {
        ends(2, &[&["verify-solver", PIPELINE], arguments].concat(), &[said]);
    }
}
