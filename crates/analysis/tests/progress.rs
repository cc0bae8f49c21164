//! A reduction says how far it has come.

use std::path::Path;

use asperity_analysis::pipeline::{Pipeline, Progress, Stage};
use asperity_runlog::{RunReader, Topics};
use asperity_summary::{RupturesFrom, Slider, Summarizer, Summary};

const PIPELINE: &str = r#"
title = "two logs"
first_global_slips = ["complete"]

[[run]]
name = "complete"
scenario = "default"

[[run]]
name = "left-right"
scenario = "default"

[[precursors]]
run = "complete"
law = "eq-5.22"

[[study]]
name = "counts"
parameter = "slider.blocks"
runs = ["complete", "left-right"]
measures = ["precursor-count"]

[[figure.load]]
file = "load.png"
run = "complete"
sliding = true
"#;

#[test]
fn every_stage_is_told_from_its_beginning_to_its_end() {
    let runs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/v2");
    let out = tempfile::tempdir().expect("a temporary folder can be made");
    let pipeline = Pipeline::parse(PIPELINE).expect("the pipeline is sound");
    let summaries = ["complete", "left-right"].map(|name| -> Summary {
        let log =
            RunReader::open(&runs.join(format!("{name}.mcap")), Topics::NONE).expect("the log is there");
        Summarizer::new(name, log.header(), Slider::default()).finish(RupturesFrom::None, None)
    });
    let mut told = Vec::new();
    pipeline
        .reduce(&runs, out.path(), asperity_files::Inputs::default(), &summaries, &mut |progress| {
            told.push(progress);
        })
        .expect("the logs can be reduced");
    // The precursors, their residuals, the first global slips and the study.
    let expected: Vec<Progress> = [(Stage::Runs, 2), (Stage::Tables, 4), (Stage::Figures, 1)]
        .into_iter()
        .flat_map(|(stage, of)| (0..=of).map(move |done| Progress { stage, done, of }))
        .collect();
    assert_eq!(told, expected);
    let tables = std::fs::read_dir(out.path().join("tables")).expect("tables are written").count();
    // Ruptures, events and load of each run, the precursors among the ruptures of one, and the four
    // above, as CSV and as Parquet; the summaries of both in one table, and each by itself.
    assert_eq!(tables, 2 * (2 * 3 + 1 + 4) + 1 + 2);
    let table = std::fs::read_to_string(out.path().join("tables/summary.csv")).expect("it is there");
    let runs: Vec<&str> = table.lines().filter_map(|row| row.split(',').next()).collect();
    assert_eq!(runs, ["run", "complete", "left-right"]);
    let json = std::fs::read(out.path().join("tables/left-right.summary.json")).expect("it is there");
    assert_eq!(serde_json::from_slice::<Summary>(&json).expect("it is a summary"), summaries[1]);
    assert!(out.path().join("figures/load.png").is_file());
}
