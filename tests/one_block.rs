//! A single block on its driving spring, from its scenario to tables, figures, pages and a study.

use std::fs;

use asperity_testkit::folder;

use asperity_figures::draw::of_one_run::Kind;

use crate::support::binary::{outcome, run, succeed, text, with_sets};

const SCENARIO: &str = "name = \"slider\"
parameter_set = \"as-stated\"
slider.blocks = 1
drive.velocity_m_per_s = 2e-3
time.step_s = 2e-6
time.duration_s = 0.8
recording.sample_s = 0.01
recording.fields_s = 0.1
";

#[test]
fn one_block_is_a_slider_for_every_command() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let (scenario, log) = (path("slider.toml"), path("slider.mcap"));
    fs::write(&scenario, SCENARIO).expect("the folder can be written");
    let valid = succeed(&["scenario", "validate", text(&scenario)]);
    assert!(valid.contains("slider: valid") && valid.contains("of block 1"), "{valid}");
    succeed(&["run", text(&scenario), "-o", text(&log)]);
    assert!(succeed(&["check", "--again", text(&log)]).contains("whole"));
    assert!(succeed(&["replay", text(&log), "-o", text(&path("replay"))]).contains("same as logged"));
    // The scenario in the log leads to the same run.
    let shown = path("shown.toml");
    fs::write(&shown, succeed(&["scenario", "show", text(&log)])).expect("the folder can be written");
    let again = path("again.mcap");
    succeed(&["run", text(&shown), "-o", text(&again)]);
    succeed(&["diff", text(&log), text(&again)]);

    let events = succeed(&["events", text(&log)]);
    let rows: Vec<Vec<&str>> = events.lines().skip(1).map(|row| row.split(',').collect()).collect();
    assert!(rows.len() >= 3 && rows.iter().all(|row| row[2..5] == ["1", "1", "1"]), "{events}");
    // Every slip is one of the whole slider; no front crosses a single block.
    let summary: serde_json::Value =
        serde_json::from_str(&succeed(&["summary", text(&log), "--format", "json"])).expect("it is JSON");
    let number = |key: &str| &summary[key];
    for key in ["event_count", "global_event_count", "rupture_count", "global_rupture_count"] {
        assert_eq!(number(key), rows.len(), "{key}");
    }
    for key in ["front_speed_m_per_s", "length_law", "longest_precursor_ratio"] {
        assert!(number(key).is_null(), "{key}: {}", number(key));
    }
    assert!(number("precursor_count") == 0 && number("events_mislead") == false, "{summary}");

    let figures = path("figures");
    succeed(&["draw", text(&log), "-o", text(&figures)]);
    assert!(figures.join("space-time.svg").is_file());
    // Each kind is drawn, or says what lacks.
    for Kind { name: kind } in Kind::all() {
        let figure = path(&format!("{kind}.svg"));
        let (code, _, why) = outcome(&["draw", text(&log), "--kind", kind, "-o", text(&figure)]);
        let lacks = why.starts_with(&format!("error: figure {kind}: "));
        assert!(if code == 0 { figure.is_file() } else { lacks }, "{kind}: {why}");
        assert!(kind != "stress" || why.contains("has one block, and forces along a slider need several"));
    }
    let page = path("page.html");
    succeed(&["report", text(&log), "-o", text(&page)]);
    let page = fs::read_to_string(page).expect("it was written");
    assert!(page.contains("The model: 1 block, each held by a friction spring"));
    assert!(!page.contains("1 blocks"));
    for (command, out) in [(&["reduce"][..], "reduced"), (&["export", "--to", "csv"], "tables")] {
        succeed(&[command, &[text(&log), "-o", text(&path(out))]].concat());
    }

    let sweep = path("sweep.toml");
    let axis = "[[axis]]\nkey = \"friction.law\"\nvalues = [\"interfacial-springs\", \"rigid\"]\n";
    let file = format!("title = \"Laws\"\nscenario = {:?}\n{axis}", text(&scenario));
    fs::write(&sweep, file).expect("the folder can be written");
    succeed(&["sweep", "go", text(&sweep), "-o", text(&path("study")), "--to", "csv"]);
    let runs = fs::read_to_string(path("study/tables/runs.csv")).expect("there is a table");
    assert_eq!(runs.lines().count(), 3, "{runs}");
}

#[test]
fn a_run_without_a_speed_above_the_threshold_of_events_says_so() {
    let folder = asperity_testkit::folder();
    let said = |event_speed: &str, name: &str| {
        let out = folder.path().join(name);
        outcome(&["run", "spring-slider", "--set", event_speed, "--out", text(&out)]).2
    };
    let note = "spring-slider: no block came above V_th = 5.0000e0 m/s; the largest speed was 2.9411e-1 m/s";
    assert!(said("friction.event_speed_m_per_s=5", "none.mcap").contains(note));
    assert!(!said("friction.event_speed_m_per_s=0.2", "some.mcap").contains("no block came above"));
}

/// A free start from a file, and a force that jumps, from a file, and swings.
#[test]
fn a_slider_under_forces_in_time_is_repeated_replayed_and_branched() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let (force, start, log) = (path("force.csv"), path("start.csv"), path("run.mcap"));
    fs::write(&force, "time_s,ratio\n105,0\n105,0.01\n110,-0.01\n").expect("the folder can be written");
    fs::write(&start, "x_over_l,velocity_m_per_s,theta_s\n0,2e-5,0.5\n").expect("the folder can be written");
    let sets = [
        &*format!("prestress.course_csv={}", text(&force)),
        &*format!("friction.initial_csv={}", text(&start)),
        "prestress.swing_ratio=1e-4",
        "prestress.swing_period_s=3",
        "prestress.swing_from_s=20",
        "time.duration_s=150",
    ];
    run(&with_sets(&["spring-slider"], &sets), &log);
    [&force, &start].into_iter().for_each(|file| fs::remove_file(file).expect("it is there"));
    assert!(succeed(&["check", "--again", text(&log)]).contains("whole"));
    assert!(succeed(&["replay", text(&log)]).contains("same as logged"));
    // Without the numbers of the events.
    let events = |log| -> Vec<Vec<String>> {
        let rows = succeed(&["events", text(log)]);
        rows.lines().map(|row| row.split(',').take(7).map(str::to_owned).collect()).collect()
    };
    let again = path("again.mcap");
    run(&[text(&log)], &again);
    assert_eq!(events(&again), events(&log));
    // A branch has no free start of its own, and the events that are left.
    let (from, branch) = (format!("initial.from={}", text(&log)), path("branch.mcap"));
    let there = [&*from, "initial.at_s=112"];
    let refused =
        outcome(&[&["run"], &with_sets(&[text(&log)], &there)[..], &["-o", text(&branch)]].concat());
    assert!(refused.0 == 2 && refused.2.contains("the state is that of a log already"), "{}", refused.2);
    let free =
        ["friction.initial_velocities_m_per_s=[]", "friction.initial_thetas_s=[]", "friction.initial_csv="];
    run(&with_sets(&[text(&log)], &[&there[..], &free].concat()), &branch);
    let (whole, branched) = (events(&log), events(&branch));
    assert!(branched.len() > 2 && whole.ends_with(&branched[1..]), "{whole:?} {branched:?}");
}
