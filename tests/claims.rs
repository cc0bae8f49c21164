//! The claims of the pipelines: quotes of the thesis are verbatim, equal statements are judged alike, and
//! each measurement has one verdict.
//!
//! The text of the thesis is not in this repository. `fixtures/quotes.csv` has a hash of every quote that
//! was compared with it. `cargo test` never updates it: to change a quote, compare it with the thesis, and
//! enter the hash named by the test.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use crate::support::pipelines::written_out;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace is there")
}

/// All pipelines, by name.
fn pipelines() -> Vec<(String, Table)> {
    let mut files: Vec<PathBuf> = fs::read_dir(root().join("pipelines"))
        .expect("there are pipelines")
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    files
        .iter()
        .map(|file| {
            let text = fs::read_to_string(file).expect("pipelines can be read");
            let name = file.file_name().expect("files have names").to_string_lossy().into_owned();
            (name, written_out(&text))
        })
        .collect()
}

/// The tables of a list of a pipeline.
fn list(pipeline: &Table, key: &str) -> Vec<Table> {
    let tables = pipeline.get(key).map_or(&[][..], |list| list.as_array().expect("a list"));
    tables.iter().map(|table| table.as_table().expect("tables").clone()).collect()
}

/// The claims of all pipelines, each behind the name of its pipeline.
fn claims() -> Vec<(String, Table)> {
    let named = |(name, pipeline): (String, Table)| {
        list(&pipeline, "claim").into_iter().map(move |claim| (name.clone(), claim))
    };
    pipelines().into_iter().flat_map(named).collect()
}

fn text<'a>(claim: &'a Table, key: &str) -> Option<&'a str> {
    claim.get(key).and_then(Value::as_str)
}

/// Those of the thesis.
fn of_the_thesis() -> Vec<(String, Table)> {
    let mut claims = claims();
    claims.retain(|(_, claim)| text(claim, "of") != Some("this project"));
    claims
}

fn hash(quote: &str) -> String {
    blake3::hash(quote.as_bytes()).to_hex()[..32].to_owned()
}

#[test]
fn quotes_are_those_that_were_compared_with_the_thesis() {
    let table = fs::read_to_string(root().join("fixtures/quotes.csv")).expect("the hashes are there");
    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("pipeline,quote_blake3_128"));
    let compared: BTreeSet<String> = rows.map(ToOwned::to_owned).collect();
    let claims = of_the_thesis();
    assert!(claims.len() > 100, "{} claims", claims.len());
    let mut used = BTreeSet::new();
    for (pipeline, claim) in &claims {
        let quote = text(claim, "quote").expect("claims have quotes");
        let row = format!("{pipeline},{}", hash(quote));
        assert!(
            compared.contains(&row),
            "{pipeline}: {quote:?} is not in fixtures/quotes.csv (accepted: quotes that were compared with the \
             thesis, as a row {row})"
        );
        used.insert(row);
    }
    assert_eq!(compared, used, "fixtures/quotes.csv has rows of quotes that no claim has");
}

#[test]
fn numbers_stated_are_in_the_words_quoted() {
    for (pipeline, claim) in of_the_thesis() {
        let (Some(stated), Some(quote)) = (text(&claim, "stated"), text(&claim, "quote")) else { continue };
        let digit = |letter: char| letter.is_ascii_digit() || letter == '.';
        // "4.1." ends a sentence, too.
        let numbers: Vec<&str> =
            quote.split(|letter| !digit(letter)).map(|number| number.trim_matches('.')).collect();
        assert!(numbers.contains(&stated), "{pipeline}: {stated} is stated, the quote has {numbers:?}");
    }
}

#[test]
fn the_same_words_have_the_same_limit() {
    let mut limits: BTreeMap<(String, String, &str), BTreeSet<String>> = BTreeMap::new();
    for (_, claim) in claims() {
        for key in ["at_most", "at_least"] {
            let Some(limit) = claim.get(key) else { continue };
            let words = text(&claim, "quote").expect("claims have quotes").to_owned();
            let measure = text(&claim, "measure").expect("claims have measures").to_owned();
            limits.entry((words, measure, key)).or_default().insert(limit.to_string());
        }
    }
    let several: Vec<_> = limits.iter().filter(|(_, limits)| limits.len() > 1).collect();
    assert!(several.is_empty(), "{several:#?}");
    // All statements about the dynamic coefficient.
    let around = [
        "mean_behind_event_front_error_ratio",
        "mean_after_global_event_error_ratio",
        "global_event_middle_error_ratio",
    ];
    let of_mu_d = limits.iter().filter(|((_, measure, _), _)| around.contains(&measure.as_str()));
    let distinct: BTreeSet<&String> = of_mu_d.flat_map(|(_, limits)| limits).collect();
    assert_eq!(distinct.len(), 1, "{distinct:?}");
}

/// The quantity behind a measure: a slope is the coefficient over the time, an error the deviation of the
/// number from its nominal value, and a closed form is compared with the measured number.
fn quantity(measure: &str) -> &str {
    match measure {
        "slope_to_dynamic_coefficient_per_s"
        | "slope_to_dynamic_coefficient_theory_per_s"
        | "time_to_dynamic_coefficient_theory_s" => "time_to_dynamic_coefficient_s",
        "first_global_event_between_coefficients_ratio" | "first_global_event_load_error_ratio" => {
            "first_global_event_ft_fn"
        }
        "mean_behind_event_front_error_ratio" => "mean_behind_event_front_ratio",
        "mean_after_global_event_error_ratio" => "mean_after_global_event_ratio",
        "largest_global_event_drop_middle_error_ratio" => "largest_global_event_drop_middle_ft_fn",
        "affected_blocks_theory" => "affected_blocks",
        other => other,
    }
}

/// Repeated claims about one run, or about two that differ only in their names, are one measurement, as are
/// the two sides of a range.
#[test]
fn each_measurement_has_one_verdict() {
    let mut judged: BTreeMap<String, String> = BTreeMap::new();
    let mut twice = Vec::new();
    for (name, pipeline) in pipelines() {
        let runs: BTreeMap<String, String> = list(&pipeline, "run")
            .into_iter()
            .map(|mut run| {
                let called = run.remove("name").expect("runs have names");
                (called.as_str().expect("text").to_owned(), run.to_string())
            })
            .collect();
        for claim in list(&pipeline, "claim") {
            let run = |key: &str| text(&claim, key).map(|run| runs.get(run).map_or(run, String::as_str));
            let near = claim.get("near").map(Value::to_string);
            let measure = text(&claim, "measure").expect("claims have measures");
            let key = format!(
                "{:?}",
                (text(&claim, "of"), run("run"), run("minus"), quantity(measure), near, claim.get("spread"))
            );
            let what = format!("{name}: {} {measure}", text(&claim, "run").expect("claims have runs"));
            if let Some(first) = judged.insert(key, what.clone()) {
                twice.push(format!("{first} and {what}"));
            }
        }
    }
    assert!(twice.is_empty(), "{twice:#?}");
}
