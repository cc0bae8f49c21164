//! `asperity sweep go`, a study in one call, and `asperity sweep log`, the log of one of its runs.

use std::fs;

use asperity_runlog::{RunReader, Topics};
use asperity_testkit::read_log;

use crate::support::binary::{run, succeed, text, with_sets};
use crate::sweep::{FIFTH, SHORT, Study, sweep};

#[test]
fn go_does_what_plan_run_and_collect_do() {
    let study = Study::of(SHORT);
    let steps = study.plan("steps");
    succeed(&["sweep", "run", text(&steps)]);
    succeed(&["sweep", "collect", text(&steps), "--to", "csv"]);
    let file = study.path("sweep.toml");
    // Begun as a study with two completed runs.
    let out = study.plan("go");
    succeed(&["sweep", "run", text(&out), "--index", "2,5"]);
    let go = || sweep(&["go", text(&file), "-o", text(&out), "--to", "csv"]);
    let (code, said, err) = go();
    assert_eq!(code, 0, "{err}");
    assert!(said.contains("tables/runs.csv") && err.contains("6 of 6 runs done"), "{said}{err}");
    for name in ["plan.ndjson", "tables/runs.csv", "tables/events.csv", "tables/ruptures.csv", "report.html"]
    {
        let bytes = [&steps, &out].map(|folder| fs::read(folder.join(name)).expect(name));
        assert!(bytes[0] == bytes[1], "{name} differs");
    }
    // A second call makes nothing.
    let before = fs::read_dir(out.join("segments")).expect("there are segments").count();
    assert_eq!(go().0, 0);
    assert_eq!(fs::read_dir(out.join("segments")).expect("there are segments").count(), before);
    // A new folder is planned first.
    let (code, _, err) = sweep(&["go", text(&file), "-o", text(&study.path("new")), "--to", "csv"]);
    assert!(code == 0 && err.contains("6 runs planned"), "{code}: {err}");
}

#[test]
fn a_folder_of_another_study_is_left_alone() {
    let study = Study::of(SHORT);
    let (file, out) = (study.path("sweep.toml"), study.plan("out"));
    fs::write(&file, SHORT.replace("-0.5, 0, 0.5", "-0.5, 0")).expect("the folder can be written");
    let (code, _, err) = sweep(&["go", text(&file), "-o", text(&out)]);
    assert!(code == 2 && err.contains("the plan of another study"), "{code}: {err}");
    let full = study.path("full");
    fs::create_dir(&full).expect("the folder can be written");
    fs::write(full.join("a.txt"), "mine").expect("the folder can be written");
    let (code, _, err) = sweep(&["go", text(&file), "-o", text(&full)]);
    assert!(code == 2 && err.contains("not an empty folder"), "{code}: {err}");
    assert_eq!(fs::read_dir(&full).expect("it is there").count(), 1);
}

#[test]
fn the_log_of_a_run_is_that_of_its_scenario() {
    let study = Study::of(SHORT);
    let out = study.plan("out");
    let log = study.path("five.mcap");
    let (code, _, err) = sweep(&["log", text(&out), "5", "-o", text(&log)]);
    assert!(code == 0 && err.contains("run 5, normal_load.tilt=0.5"), "{code}: {err}");
    let alone = study.path("alone.mcap");
    run(&with_sets(&["default"], &FIFTH), &alone);
    let [made, expected] = [&log, &alone].map(|log| read_log(log).expect("the log is whole").1);
    assert_eq!((made.digest, made.topic_digests), (expected.digest, expected.topic_digests));
    let id = RunReader::open(&log, Topics::NONE).expect("it is a log").header().run_id.clone();
    let plan = fs::read_to_string(out.join("plan.ndjson")).expect("there is a plan");
    assert!(plan.lines().nth(5).expect("run 5").contains(&id), "{id}");
    succeed(&["check", text(&log)]);
    for (run, says) in [("7", "run 7: there is none (accepted: 1 to 6)"), ("0", "run 0: there is none")] {
        let (code, _, err) = sweep(&["log", text(&out), run, "-o", text(&study.path("x.mcap"))]);
        assert!(code == 2 && err.contains(says), "{code}: {err}");
    }
    let (code, _, err) = sweep(&["log", text(&out), "5", "-o", text(&log)]);
    assert!(code == 2 && err.contains("exists already"), "{code}: {err}");
    assert_eq!(sweep(&["log", text(&out), "5", "-o", text(&log), "--resume"]).0, 0);
}

/// A run with a name is asked for by it, and a run that is refused cannot be made.
#[test]
fn runs_have_names_and_reasons() {
    let toml = SHORT.replace("[-0.5, 0, 0.5]", "[0, 0.5]").replace("[0.5, 0.3]", "[0.3, 0.5]")
        + "[[run]]\nname = 'own'\nscenario = 'ten-blocks'\nset = ['time.step_s=1e-7', 'time.duration_s=0.01']\n";
    let study = Study::of(&toml);
    let out = study.path("out");
    let planned = sweep(&["plan", text(&study.path("sweep.toml")), "-o", text(&out), "--skip-refused"]);
    assert_eq!(planned.0, 0, "{}", planned.2);
    let log = |run: &str, name: &str| sweep(&["log", text(&out), run, "-o", text(&study.path(name))]);
    assert_eq!((log("own", "a.mcap").0, log("5", "b.mcap").0), (0, 0));
    let (code, _, err) = log("3", "c.mcap");
    assert!(code == 2 && err.contains("is refused: "), "{code}: {err}");
    let (code, _, err) = log("owm", "c.mcap");
    assert!(code == 2 && err.contains("(accepted: 1 to 5, or the name of one)"), "{code}: {err}");
}
