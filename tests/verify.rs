//! The fast solver against the plain one, and the adaptive one at two tolerances: the runs of a pipeline, or their
//! beginnings, and the near ties that are known.
//!
//! `cargo xtask verify` chooses the pipeline, and how much of each run is compared, by [`PIPELINE`] and [`FOR_S`].

use std::cmp::Reverse;
use std::env;
use std::fs;
use std::io::{Write, stderr};
use std::path::Path;

use crate::support::binary::{ends, run, text};
use crate::support::verify::{Verified, verify};
use asperity_files::at_once;
use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_run::detectors;
use asperity_run::study::Job;
use asperity_simulator::Plain;
use asperity_study::Study;
use asperity_testkit::equality::{NearTie, beyond_switch, rounding_reach, step_after};
use asperity_testkit::run_end;
use serde_json::Value;

/// Environment variables: a pipeline to compare instead of the beginnings of Chapter 5, and the seconds of simulated time
/// of each of its runs, all of them unless given.
const PIPELINE: &str = "ASPERITY_VERIFY_PIPELINE";
const FOR_S: &str = "ASPERITY_VERIFY_FOR_S";

const CHAPTER_5: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../pipelines/chapter5.toml");
const NEAR_TIES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/near-ties");

/// Where the proofs of near ties that are not listed are written.
const FOUND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../out/near-ties");

fn jobs(pipeline: &str, set: &[String]) -> Vec<Job> {
    let mut study = Study::read(Path::new(pipeline)).unwrap_or_else(|error| panic!("{error}"));
    study.set(set);
    study.jobs().unwrap_or_else(|error| panic!("{pipeline}: {error}"))
}

/// Compares the solvers of each run, or of its first seconds. Returns how many switches are equal.
///
/// # Errors
/// How they differ; or, if only by near ties, which of these are not listed, and which of those listed do not occur.
fn compare(jobs: &[Job], for_s: Option<f64>, known: &[(String, Value)]) -> Result<u64, String> {
    let each = at_once(jobs, None, |job| {
        let mut plan = Plan::new(&job.scenario);
        if let Some(seconds) = for_s {
            plan.steps = plan.steps.min(plan.grid.whole_steps(seconds).expect("whole steps"));
        }
        let verified = verify(&plan, |records| detectors::of_plan(&plan).all_events(records), |_| ());
        let verified = verified.map_err(|error| format!("run {}: {error}", job.name))?;
        let Verified { agreement, slip_events } = &verified;
        let most = agreement.deviations.iter().max_by(|a, b| a.share.total_cmp(&b.share));
        writeln!(
            stderr(),
            "{}: {} switches and {slip_events} slip events are equal, {} near ties; {most:?}",
            job.name,
            agreement.switches,
            agreement.near_ties.len(),
        )
        .expect("standard error is open");
        near_ties_are_listed(job, plan.steps, &agreement.near_ties, known)?;
        Ok(agreement.switches)
    });
    each.map(|switches| switches.into_iter().sum())
}

fn near_ties_are_listed(
    job: &Job,
    steps: u64,
    found: &[NearTie],
    known: &[(String, Value)],
) -> Result<(), String> {
    let of = |tie: &Value| ["step", "block", "direction", "plain_switches"].map(|key| tie[key].clone());
    let found: Vec<Value> = found.iter().map(|tie| serde_json::to_value(tie).expect("plain data")).collect();
    let hash = job.scenario.hash();
    let listed = || known.iter().filter(|(_, proof)| proof["scenario_hash"] == hash.as_str());
    for tie in &found {
        if !listed().any(|(_, proof)| of(&proof["tie"]) == of(tie)) {
            let scenario = job.scenario.to_commented_toml();
            let proof = serde_json::json!({
                "run": job.name, "scenario": scenario, "scenario_hash": hash, "tie": tie,
            });
            let set = job.scenario.parameter_set.word();
            let path = format!("{FOUND}/{}-{set}-{}-{}.json", job.name, tie["step"], tie["block"]);
            fs::create_dir_all(FOUND).expect("it can be made");
            fs::write(&path, format!("{proof}\n")).expect("it can be written");
            return Err(format!("run {}: a near tie that is not listed; its proof is {path}", job.name));
        }
    }
    for (file, proof) in listed().filter(|(_, proof)| proof["tie"]["step"].as_u64() <= Some(steps)) {
        if !found.iter().any(|tie| of(tie) == of(&proof["tie"])) {
            return Err(format!("{file}: the solvers agree there now"));
        }
    }
    Ok(())
}

/// The near ties that are listed: files, and what these hold.
fn known() -> Vec<(String, Value)> {
    let files = fs::read_dir(NEAR_TIES).expect("the folder is there").map(|entry| {
        let path = entry.expect("it can be read").path();
        let proof = fs::read_to_string(&path).expect("it is text");
        (text(&path).to_owned(), serde_json::from_str(&proof).expect("it is JSON"))
    });
    files.collect()
}

fn verify_pipeline(set: &str) {
    let set = [format!("parameter_set={set}")];
    let (pipeline, for_s, least) = match env::var(PIPELINE) {
        Ok(pipeline) => (pipeline, env::var(FOR_S).ok().map(|s| s.parse().expect("a number")), 0),
        Err(_) => (CHAPTER_5.to_owned(), Some(0.1), 300),
    };
    let mut jobs = jobs(&pipeline, &set);
    jobs.sort_by_cached_key(|job| Reverse(job.cost()));
    let switches = compare(&jobs, for_s, &known()).unwrap_or_else(|error| panic!("{error}"));
    assert!(switches > least, "there is something to compare: {switches} switches");
}

#[test]
#[ignore = "a minute of single steps: cargo xtask nightly, and cargo xtask verify"]
fn a_pipeline_is_solved_alike_as_coded() {
    verify_pipeline("as-coded");
}

#[test]
#[ignore = "a minute of single steps: cargo xtask nightly, and cargo xtask verify"]
fn a_pipeline_is_solved_alike_as_stated() {
    verify_pipeline("as-stated");
}

#[test]
fn known_near_ties_are_decided_by_rounding() {
    for (file, proof) in known() {
        let scenario = proof["scenario"].as_str().expect("it names its scenario");
        let scenario = Scenario::resolve(&ScenarioSource::new(&file, scenario)).expect("it resolves");
        assert_eq!(proof["scenario_hash"], scenario.hash());
        let plan = Plan::new(&scenario);
        let tie: NearTie = serde_json::from_value(proof["tie"].clone()).expect("it is a near tie");
        let block = tie.block as usize - 1;

        let mut plain = Plain::new(plan.clone());
        let [before, after] = step_after(&mut plain, &tie.before, tie.step);
        let beyond = beyond_switch(&plan, &before, &after, block);
        assert_eq!(beyond, tie.beyond, "{file}");
        assert_eq!(beyond >= 0.0, tie.plain_switches, "{file}");
        let reach = rounding_reach(&plan, &after, tie.direction);
        assert!(tie.beyond.abs() <= reach && tie.reach == reach, "{file}");
        assert_eq!(plain.switched().contains(&block), tie.plain_switches, "{file}");
    }
}

#[test]
fn a_near_tie_that_is_none_any_more_is_told() {
    let (_, mut proof) =
        known().into_iter().find(|(_, proof)| proof["run"] == "beta-045").expect("it is there");
    proof["tie"]["step"] = 1000.into();
    let mut jobs = jobs(CHAPTER_5, &["parameter_set=as-coded".to_owned()]);
    jobs.retain(|job| job.name == "beta-045");
    let told = compare(&jobs, Some(0.001), &[("moved.json".to_owned(), proof)]);
    assert_eq!(told, Err("moved.json: the solvers agree there now".to_owned()));
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
    let [side, top] = <[Job; 2]>::try_from(jobs(text(&pipeline), &[])).expect("two runs");
    assert!(compare(&[side], None, &[]).expect("they agree") > 5);
    compare(&[top], None, &[]).expect("they agree");
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
