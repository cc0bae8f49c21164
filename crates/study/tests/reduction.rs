//! A reduction accepts runs in any order.

use std::path::Path;

use asperity_model::{Scenario, ScenarioSource};
use asperity_numbers::Summary;
use asperity_record::Observer;
use asperity_runlog::{LogItem, RunReader, Topics};
use asperity_study::pipeline::Pipeline;
use asperity_study::reduction::{Beside, Reduction};

const PIPELINE: &str = r#"
title = "two logs"
first_global_slips = ["complete"]

[[run]]
name = "complete"
scenario = "default"

[[run]]
name = "again"
scenario = "default"

[[precursors]]
run = "complete"
law = "tilted"

[[study]]
name = "counts"
parameter = "slider.blocks"
runs = ["complete", "again"]
measures = ["precursor_event_count"]

[[figure.load]]
file = "load.png"
run = "complete"
sliding = true
"#;

#[test]
fn runs_come_in_any_order() {
    let log = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/complete.mcap");
    let out = tempfile::tempdir().expect("a temporary folder can be made");
    let pipeline = Pipeline::parse(PIPELINE).expect("the pipeline is sound");
    let reduction = Reduction::begin(&pipeline, out.path(), asperity_files::Inputs::default(), true)
        .expect("files can be written");
    // Whichever run comes first, the tables have them in the order of the pipeline.
    for name in ["again", "complete"] {
        let mut reader = RunReader::open(&log, Topics::ALL).expect("the log is there");
        let source = ScenarioSource::logged("scenario.toml".to_owned(), reader.scenario_toml());
        let scenario = Scenario::resolve(&source).expect("its scenario is sound");
        let passing = || reduction.passing(name, reader.header().clone(), scenario.clone());
        // A discarded run leaves no trace.
        reduction.discard(passing());
        let mut passing = passing();
        while let Some(item) = reader.next_item().expect("the log is whole") {
            match item {
                LogItem::Record(record) => passing.record(&record),
                LogItem::Event(event) => passing.event(&event),
            }
        }
        let end = reader.end().expect("the log is whole");
        reduction.passed(passing, end).expect("the log can be reduced");
    }
    let in_order = reduction.finish(Beside::default()).expect("the tables can be written");
    let names: Vec<&str> = in_order.iter().map(|summary| summary.run.as_str()).collect();
    assert_eq!(names, ["complete", "again"]);
    let page = std::fs::read_to_string(out.path().join("report.html")).expect("it is there");
    assert!(page.contains("id=\"run-complete\"") && page.contains("src=\"data:image/svg+xml;base64,"));
    let tables = std::fs::read_dir(out.path().join("tables")).expect("tables are written").count();
    // Ruptures, events and load of each run, the precursors among the ruptures of one and those
    // among its events, and the last three above, as CSV and as Parquet; the summaries of both in one table, and each by itself.
    assert_eq!(tables, 2 * (2 * 3 + 1 + 4) + 1 + 2);
    let table = std::fs::read_to_string(out.path().join("tables/summary.csv")).expect("it is there");
    let runs: Vec<&str> = table.lines().filter_map(|row| row.split(',').next()).collect();
    assert_eq!(runs, ["run", "complete", "again"]);
    let json = std::fs::read(out.path().join("tables/again.summary.json")).expect("it is there");
    assert_eq!(serde_json::from_slice::<Summary>(&json).expect("it is a summary"), in_order[1]);
    assert!(out.path().join("figures/load.png").is_file());
}
