//! `asperity refine` from outside: its runs are those of a study, and its table follows from their summaries alone.

use std::collections::BTreeMap;
use std::fs;

use tempfile::tempdir;

use crate::support::binary::{outcome, succeed, text};

const SET: [&str; 6] =
    ["--set", "parameter_set=as-stated", "--set", "time.duration_s=1", "--set", "time.step_s=1e-7"];

#[test]
fn a_refinement_goes_on_from_runs_made_elsewhere_and_says_what_summaries_say() {
    let folder = tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let refine = |out: &str, more: &[&str]| {
        let out = path(out);
        succeed(&[&["--quiet", "refine", "ten-blocks", "-o", text(&out)], &SET[..], more].concat())
    };
    let said = refine("one", &[]);
    let figure = || fs::read(path("one/figures/refinement.png")).expect("it is drawn");
    let drawn = figure();
    // The page shows it, and marks numbers that are not robust.
    let page = fs::read_to_string(path("one/report.html")).expect("the page is there");
    let mark = "precursor count <span title=\"one draw of a chaotic series: ";
    assert!(page.contains("figures/refinement.png") && page.contains(mark) && page.contains("~ one draw of"));
    // Planned, made by another command, and judged.
    assert!(refine("two", &["--plan"]).contains("plan.ndjson"));
    succeed(&["--quiet", "sweep", "run", text(&path("two"))]);
    assert_eq!(refine("two", &[]).replace("two", "one"), said);
    let table = |out: &str| fs::read_to_string(path(out).join("tables/refinement.csv")).expect("it is there");
    assert_eq!(table("one"), table("two"));
    // Again: nothing is made anew, and the table is replaced by the same. The figure is one of a study.
    assert_eq!(refine("one", &[]), said);
    fs::remove_file(path("one/figures/refinement.png")).expect("it is there");
    succeed(&["sweep", "draw", text(&path("one"))]);
    assert_eq!(figure(), drawn);

    // The first run is the scenario itself, the fourth has twice as many gaps and the same decay length.
    let numbers = |set: &[&str]| -> BTreeMap<String, String> {
        let out = path("run.mcap");
        fs::remove_file(&out).ok();
        succeed(&[&["--quiet", "run", "ten-blocks", "-o", text(&out)], &SET[..], set].concat());
        let csv = succeed(&["summary", "--format", "csv", text(&out)]);
        let rows: Vec<Vec<String>> =
            csv.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect();
        rows[0].iter().cloned().zip(rows[1].iter().cloned()).collect()
    };
    let given = numbers(&[]);
    let finer =
        numbers(&["--set", "slider.blocks=19", "--set", "friction.decay_length_m=0.011111111111111112"]);
    let csv = table("one");
    let row = csv.lines().find(|line| line.starts_with("first_slip_s,")).expect("its row");
    let cells: Vec<f64> =
        row.split(',').skip(1).take(3).map(|cell| cell.parse().expect("a number")).collect();
    for (cell, summary) in [(cells[1], &given), (cells[2], &finer)] {
        let value: f64 = summary["first_slip_s"].parse().expect("a number");
        assert!((cell / value - 1.0).abs() < 1e-6, "{cell} {value}");
    }
    assert!(said.contains("first_slip_s") && said.contains("of the mesh"), "{said}");

    let (code, _, other) = outcome(&["--quiet", "refine", "default", "-o", text(&path("one"))]);
    assert!(code == 2 && other.contains("the plan of another study"), "{other}");
}

/// Lists with a number for each block were refused on other meshes.
#[test]
fn lists_of_blocks_are_resampled_and_a_line_says_which() {
    let folder = tempdir().expect("a folder");
    let out = folder.path().join("listed");
    let (code, _, told) = outcome(&["refine", "rate-and-state", "--plan", "-o", text(&out)]);
    assert!(code == 0 && told.contains("resampled on other meshes: friction.evolution_offsets"), "{told}");
    // Every command that reads the plan makes the same scenario of it.
    let log = folder.path().join("4.mcap");
    succeed(&["--quiet", "sweep", "log", text(&out), "4", "-o", text(&log)]);
    let shown = succeed(&["scenario", "show", text(&log)]);
    let list = shown.split("evolution_offsets = [").nth(1).and_then(|rest| rest.split(']').next());
    assert_eq!(list.expect("the list").split(',').filter(|number| !number.trim().is_empty()).count(), 31);
}
