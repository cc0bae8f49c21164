//! `asperity catalogue` of studies and logs; its numbers are computed again in tests/python/test_catalogue.py.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::support::binary::{ends, outcome, succeed, text};

const STUDY: &str = "title = 'Loads'\nscenario = 'default'\n\
                     set = ['time.step_s=1e-7', 'time.duration_s=1', 'slider.blocks=20']\n\
                     [[axis]]\nkey = 'normal_load.tilt'\nvalues = [-0.4, 0.0, 0.4]\n";

/// Plans a study of three runs in the folder.
fn plan(folder: &Path, sweep: &str) -> String {
    let file = folder.join("sweep.toml");
    fs::write(&file, sweep).expect("it can be written");
    let study = text(&folder.join("study")).to_owned();
    succeed(&["sweep", "plan", text(&file), "-o", &study]);
    study
}

/// The rows of a run in a catalogue, without the names of path and run.
fn rows<'a>(table: &'a str, run: &str) -> Vec<Vec<&'a str>> {
    let cells = table.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    cells.filter(|row| row[1] == run).map(|row| row[2..].to_vec()).collect()
}

#[test]
fn studies_have_the_entries_of_the_logs_of_their_runs() {
    let folder = asperity_testkit::folder();
    let study = plan(folder.path(), STUDY);
    let (code, printed, _) = outcome(&["catalogue", &study]);
    assert!(code == 3 && printed.lines().count() == 1, "before any run: {printed}");
    succeed(&["sweep", "run", &study, "--quiet"]);
    let of_study = succeed(&["catalogue", &study]);
    let names: Vec<&str> = of_study.lines().next().expect("a header").split(',').skip(2).collect();
    let mut compared = 0;
    for run in ["1", "2", "3"] {
        let log = folder.path().join(format!("{run}.mcap"));
        succeed(&["sweep", "log", &study, run, "-o", text(&log), "--quiet"]);
        let of_log = succeed(&["catalogue", text(&log)]);
        let (study_rows, log_rows) = (rows(&of_study, run), rows(&of_log, run));
        assert_eq!(study_rows.len(), log_rows.len());
        for (study_row, log_row) in study_rows.iter().zip(&log_rows) {
            for ((name, of_study), of_log) in names.iter().zip(study_row).zip(log_row) {
                // Studies do not keep the slip of each block.
                if ["slip_weighted_strength_drop_pa", "slip_skewness"].contains(name) {
                    assert_eq!(*of_study, "", "{name}");
                } else {
                    assert_eq!(of_study, of_log, "{name}");
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 400, "{compared}");
    let events = succeed(&["catalogue", &study, "--format", "quakeml"]);
    assert_eq!(events.matches("<event ").count(), of_study.lines().count() - 1);
    let statistics = succeed(&["catalogue", &study, "--format", "statistics"]);
    assert!(statistics.contains(&format!("/study: {} ruptures of 3 runs\n", of_study.lines().count() - 1)));
}

#[test]
fn a_study_without_ruptures_is_refused() {
    let folder = asperity_testkit::folder();
    let study = plan(folder.path(), &format!("keep = ['events']\n{STUDY}"));
    succeed(&["sweep", "run", &study, "--quiet"]);
    let expected = "its runs keep no ruptures (accepted: a study with \"ruptures\" in keep)";
    ends(2, &["catalogue", &study], &[expected]);
}

#[test]
fn runs_without_ruptures_are_runs_and_several_paths_have_names_of_their_own() {
    let folder = asperity_testkit::folder();
    // The first slip comes at 0.1 to 0.4 s.
    let study = plan(folder.path(), &STUDY.replace("duration_s=1'", "duration_s=0.2'"));
    succeed(&["sweep", "run", &study, "--quiet"]);
    let table = succeed(&["catalogue", &study]);
    let with: BTreeSet<&str> = table.lines().skip(1).filter_map(|line| line.split(',').nth(1)).collect();
    assert!(!with.is_empty() && with.len() < 3, "{table}");
    let statistics = succeed(&["catalogue", &study, "--format", "statistics"]);
    assert!(statistics.contains(" of 3 runs\n") && !statistics.contains("times between"), "{statistics}");
    let twice = succeed(&["catalogue", &study, &study, "--format", "quakeml"]);
    let events = twice.split("<event publicID=\"").skip(1);
    let ids: Vec<&str> = events.filter_map(|event| event.split('"').next()).collect();
    let different: BTreeSet<&&str> = ids.iter().collect();
    assert_eq!((ids.len(), different.len()), (2 * (table.lines().count() - 1), ids.len()));
    // Without statistics, and not finite.
    ends(2, &["catalogue", &study, "--completeness", "-7"], &[]);
    ends(2, &["catalogue", &study, "--format", "statistics", "--completeness", "-inf"], &[]);
}

#[test]
fn named_runs_of_a_study_are_read_from_their_logs() {
    let folder = asperity_testkit::folder();
    let named = "[[run]]\nname = 'alone'\nscenario = 'default'\n\
                 set = ['time.step_s=1e-7', 'time.duration_s=1', 'slider.blocks=20']\n";
    let study = plan(folder.path(), &format!("{STUDY}{named}"));
    succeed(&["sweep", "run", &study, "--quiet"]);
    let table = succeed(&["catalogue", &study]);
    let times =
        |run: &str| -> Vec<String> { rows(&table, run).iter().map(|row| row[0].to_owned()).collect() };
    // The load of the second run is even, as by default.
    assert!(!times("2").is_empty());
    assert_eq!(times("alone"), times("2"));
}

/// Ruptures without a magnitude were left out of events and statistics without a word.
#[test]
fn ruptures_without_a_magnitude_are_counted_where_they_are_left_out() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("quakes.mcap");
    succeed(&["run", "carlson-langer", "--quiet", "--set", "time.duration_s=6000", "-o", text(&log)]);
    let (_, table, said) = outcome(&["catalogue", text(&log)]);
    let without = table.lines().skip(1).filter(|line| line.split(',').nth(6) == Some("")).count();
    assert!(without > 1 && !said.contains("moment"), "{without}: {said}");
    assert!(said.contains(": 1 rupture left out, which still slid at the end"), "{said}");
    for format in ["quakeml", "statistics"] {
        let (_, _, said) = outcome(&["catalogue", text(&log), "--format", format]);
        let expected =
            format!("{without} ruptures left out, whose moment is 0, so that they have no magnitude");
        assert!(said.contains(&expected), "{said}");
    }
}

/// Sizes between bounds follow no exponential law: then there is no b, and no error.
#[test]
fn statistics_without_a_law_have_no_b() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("default.mcap");
    succeed(&["run", "default", "--set", "time.step_s=5e-8", "--quiet", "-o", text(&log)]);
    let least =
        succeed(&["catalogue", text(&log), "--format", "statistics", "--completeness", "-100", "--quiet"]);
    assert!(least.contains("  sizes: no law of Gutenberg and Richter above -100.000, n = "), "{least}");
    assert!(!least.contains('±'), "{least}");
    let few = succeed(&["catalogue", text(&log), "--format", "statistics", "--completeness", "1", "--quiet"]);
    assert!(few.contains("  sizes: fewer than 50 above 1, or all are equal\n"), "{few}");
    assert!(few.contains("times between them: fewer than five"), "{few}");
    assert!(few.contains("after large ones: fewer than two within magnitude 1 of the largest"), "{few}");
    assert!(least.contains(" within ") && least.contains(" main shocks: "), "{least}");
    assert!(!least.contains("law of Omori, p"), "{least}");
}
