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
    // Planned, made by another command, and judged.
    assert!(refine("two", &["--plan"]).contains("plan.ndjson"));
    succeed(&["--quiet", "sweep", "run", text(&path("two"))]);
    assert_eq!(refine("two", &[]).replace("two", "one"), said);
    let table = |out: &str| fs::read_to_string(path(out).join("tables/refinement.csv")).expect("it is there");
    assert_eq!(table("one"), table("two"));
    // Again: nothing is made anew, and the table is replaced by the same.
    assert_eq!(refine("one", &[]), said);

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
