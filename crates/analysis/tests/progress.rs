//! A reduction says how far it has come.

use std::path::Path;

use asperity_analysis::pipeline::{Pipeline, Progress, Stage};

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
    let mut told = Vec::new();
    pipeline
        .reduce(&runs, out.path(), asperity_files::Inputs::default(), &mut |progress| told.push(progress))
        .expect("the logs can be reduced");
    // The precursors, their residuals, the first global slips and the study.
    let expected: Vec<Progress> = [(Stage::Runs, 2), (Stage::Tables, 4), (Stage::Figures, 1)]
        .into_iter()
        .flat_map(|(stage, of)| (0..=of).map(move |done| Progress { stage, done, of }))
        .collect();
    assert_eq!(told, expected);
    let tables = std::fs::read_dir(out.path().join("tables")).expect("tables are written").count();
    // Events and load of each run and the four above, as CSV and as Parquet.
    assert_eq!(tables, 2 * (2 * 2 + 4));
    assert!(out.path().join("figures/load.png").is_file());
}
