//! Runs that begin in the state of another run, with the command: a series that is spun up once and branched.

use std::fs;

use asperity_runlog::partial_path;
use asperity_testkit::folder;

use crate::support::binary::{ends, run, succeed, text};
use crate::sweep::Study;

const SHORT: [&str; 6] =
    ["ten-blocks", "--set", "time.step_s=1e-7", "--set", "drive.velocity_m_per_s=2e-3", "--quiet"];

#[test]
fn a_branch_is_made_resumed_repeated_and_shown() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let (parent, branch) = (path("parent.mcap"), path("branch.mcap"));
    run(&[&SHORT[..], &["--set", "time.duration_s=0.1"]].concat(), &parent);
    let from = format!("initial.from={}", text(&parent));
    let sets = ["--set", &from, "--set", "time.duration_s=0.2", "--set", "normal_load.total_n=390"];
    run(&[&SHORT[..], &sets].concat(), &branch);
    fs::remove_file(&parent).expect("it is there");
    assert!(succeed(&["check", "--again", text(&branch)]).contains(": whole: "));
    // Shown and repeated without the other log.
    let shown = path("shown.toml");
    fs::write(&shown, succeed(&["scenario", "show", text(&branch)])).expect("the folder can be written");
    assert!(
        succeed(&["scenario", "validate", text(&shown), "--quiet"])
            .contains("in a given state, at 0.1 s on the clock")
    );
    run(&[text(&shown), "--quiet"], &path("again.mcap"));
    let differ = succeed(&["diff", text(&branch), text(&path("again.mcap"))]);
    assert!(!differ.is_empty());
    let rows = |log: &str| succeed(&["events", text(&path(log))]);
    assert_eq!(rows("branch.mcap"), rows("again.mcap"));
    // The begun log holds the state, even if it is cut in its first chunk; a state of another log it lacks.
    let bytes = fs::read(&branch).expect("it is whole");
    let zstd = bytes.windows(4).position(|there| there == 0xFD2F_B528_u32.to_le_bytes());
    for length in [zstd.expect("chunks are compressed") + 10, bytes.len() / 2] {
        let resumed = path("resumed.mcap");
        fs::write(partial_path(&resumed), &bytes[..length]).expect("the folder can be written");
        let resume = [&["run"], &SHORT[..], &sets, &["--resume", "--out", text(&resumed)]].concat();
        let other = from.replace("parent", "other");
        ends(2, &[&resume[..], &["--set", &other]].concat(), &["other.mcap: there is no"]);
        let shown = succeed(&["scenario", "show", text(&partial_path(&resumed))]);
        assert_eq!(shown, succeed(&["scenario", "show", text(&branch)]));
        // Once more: a whole log is left as it is.
        for _ in 0..2 {
            succeed(&resume);
            assert_eq!(rows("resumed.mcap"), rows("branch.mcap"));
        }
        fs::remove_file(&resumed).expect("it is there");
    }
    // Another state is read where one is asked for.
    let again = ["run", text(&branch), "-o", "never.mcap", "--set", &from];
    ends(2, &again, &["parent.mcap: there is no such file (accepted: the complete log"]);
}

#[test]
fn a_study_branches_all_of_its_runs_from_one_log() {
    let folder = folder();
    let parent = folder.path().join("parent.mcap");
    let spin_up = |velocity: &str| {
        let set = ["--set", "time.duration_s=0.05", "--set", velocity];
        run(&[&SHORT[..], &set].concat(), &parent);
    };
    spin_up("drive.velocity_m_per_s=2e-3");
    let study = Study::of(&format!(
        "title = 'Branches'\nscenario = 'ten-blocks'\nset = ['parameter_set=as-coded', 'time.step_s=1e-7', \
         'drive.velocity_m_per_s=2e-3', 'time.duration_s=0.12', 'initial.from={}']\n\
         [[axis]]\nkey = 'normal_load.total_n'\nvalues = [380, 400, 420]\n",
        text(&parent)
    ));
    let out = study.plan("out");
    succeed(&["sweep", "run", text(&out), "--quiet"]);
    succeed(&["sweep", "collect", text(&out), "--to", "csv", "--quiet"]);
    let runs = fs::read_to_string(out.join("tables/runs.csv")).expect("there is a table");
    assert_eq!(runs.lines().count(), 4, "{runs}");
    // A run of the study is the run that the command makes.
    let log = folder.path().join("one.mcap");
    succeed(&["sweep", "log", text(&out), "3", "--quiet", "--out", text(&log)]);
    let alone = folder.path().join("alone.mcap");
    let from = format!("initial.from={}", text(&parent));
    let sets = ["--set", &from, "--set", "time.duration_s=0.12", "--set", "normal_load.total_n=420"];
    run(&[&SHORT[..], &sets].concat(), &alone);
    assert_eq!(succeed(&["events", text(&log)]), succeed(&["events", text(&alone)]));
    // The plan holds the state: no reader of a study opens the log, whether it changes or is gone.
    let later = study.plan("later");
    fs::remove_file(&parent).expect("it is there");
    let (page, other) = (folder.path().join("page.html"), folder.path().join("other.mcap"));
    for command in [
        vec!["sweep", "status", text(&out)],
        vec!["sweep", "run", text(&out)],
        vec!["sweep", "collect", text(&out)],
        vec!["report", text(&out), "--out", text(&page)],
        vec!["catalogue", text(&out)],
        vec!["sweep", "log", text(&out), "3", "--out", text(&other)],
        vec!["sweep", "run", text(&out), "--verify", "1"],
    ] {
        succeed(&command);
    }
    spin_up("drive.velocity_m_per_s=2.1e-3");
    succeed(&["sweep", "run", text(&later), "--quiet"]);
    succeed(&["sweep", "collect", text(&later), "--to", "csv", "--quiet"]);
    assert_eq!(fs::read_to_string(later.join("tables/runs.csv")).expect("there is a table"), runs);
}
