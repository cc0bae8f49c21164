//! The study of slabs, `pipelines/slab.toml`, as far as it can be made in some seconds: the runs with
//! few nodes or few steps, and all figures, tables and claims that are of these alone.

use std::collections::BTreeSet;
use std::fs;

use toml::{Table, Value};

use crate::support::binary::{rows, succeed, text};
use crate::support::clients::file;
use crate::support::pipelines::written_out;

/// The runs that are made.
const RUNS: [&str; 12] = [
    "slab",
    "mu-s-060",
    "mu-s-030",
    "chain",
    "chain-beta",
    "top-017-00",
    "top-030-50",
    "height-100",
    "height-150",
    "rest-29",
    "rest-57",
    "length-29",
];

/// The runs that a part of the pipeline names, wherever in it.
fn runs_of(part: &Value, found: &mut BTreeSet<String>) {
    match part {
        Value::Table(table) => {
            for (key, value) in table {
                match (key.as_str(), value) {
                    ("run" | "minus", Value::String(run)) => {
                        found.insert(run.clone());
                    }
                    ("runs", Value::Array(runs)) => {
                        found.extend(runs.iter().filter_map(Value::as_str).map(str::to_owned));
                    }
                    _ => runs_of(value, found),
                }
            }
        }
        Value::Array(values) => values.iter().for_each(|value| runs_of(value, found)),
        _ => {}
    }
}

/// The pipeline without outputs that need other runs.
fn short() -> Table {
    let whole = fs::read_to_string(file("pipelines/slab.toml")).expect("the pipeline is there");
    let mut pipeline = written_out(&whole);
    let is_made = |part: &Value| {
        let mut runs = BTreeSet::new();
        runs_of(part, &mut runs);
        runs.iter().all(|run| RUNS.contains(&run.as_str()))
    };
    let keep = |parts: &mut Value, is_kept: &dyn Fn(&Value) -> bool| {
        parts.as_array_mut().expect("a list").retain(is_kept);
    };
    keep(&mut pipeline["run"], &|run| run["name"].as_str().is_some_and(|name| RUNS.contains(&name)));
    for key in ["study", "claim"] {
        keep(&mut pipeline[key], &is_made);
    }
    for (_, figures) in pipeline["figure"].as_table_mut().expect("figures by kind").iter_mut() {
        keep(figures, &is_made);
    }
    pipeline
}

#[test]
fn what_the_study_says_of_its_short_runs_holds() {
    let folder = asperity_testkit::folder();
    let pipeline = short();
    let claims = pipeline["claim"].as_array().expect("a list").len();
    assert!(claims >= 25, "{claims} claims");
    let figures = pipeline["figure"].as_table().expect("by kind");
    let figures: usize = figures.values().map(|of| of.as_array().expect("a list").len()).sum();
    assert!(figures >= 10, "{figures} figures");
    let asked = folder.path().join("slab.toml");
    fs::write(&asked, pipeline.to_string()).expect("the folder can be written");
    let out = folder.path().join("out");
    succeed(&["reproduce", text(&asked), "-o", text(&out), "--quiet"]);
    let judged = rows(&fs::read(out.join("tables/claims.csv")).expect("claims were judged"));
    judged.iter().for_each(|row| assert_eq!(row["verdict"], "agrees", "{}", row["quote"]));
    assert_eq!(judged.len(), claims);
    let drawn = fs::read_dir(out.join("figures")).expect("figures were drawn").count();
    assert_eq!(drawn, 3 * figures, "each as PNG, SVG and PDF");
}
