//! The claims of the pipelines: what they put into the mouth of the thesis it says, to the letter,
//! and they judge alike what is said alike.
//!
//! The text of the thesis is not in this repository. `fixtures/quotes.csv` holds a hash of every
//! quote that was compared with it, made by `cargo test` in no way: who changes a quote compares
//! it with the thesis, and puts the hash that the test names in its place.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace is there")
}

/// The claims of all pipelines, each behind the name of its pipeline.
fn claims() -> Vec<(String, Table)> {
    let mut files: Vec<PathBuf> = fs::read_dir(root().join("pipelines"))
        .expect("there are pipelines")
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    files
        .iter()
        .flat_map(|file| {
            let text = fs::read_to_string(file).expect("pipelines can be read");
            let mut pipeline: Table = text.parse().expect("pipelines are TOML");
            let name = file.file_name().expect("files have names").to_string_lossy().into_owned();
            let claims = pipeline.remove("claim").unwrap_or_else(|| Value::Array(Vec::new()));
            let claims = claims.as_array().expect("claims are a list").clone();
            claims.into_iter().map(move |claim| (name.clone(), claim.as_table().expect("tables").clone()))
        })
        .collect()
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
    // Whatever is said of the dynamic coefficient.
    let around = ["mean-behind-front-error", "mean-after-global-slip-error", "global-slip-middle-error"];
    let of_mu_d = limits.iter().filter(|((_, measure, _), _)| around.contains(&measure.as_str()));
    let distinct: BTreeSet<&String> = of_mu_d.flat_map(|(_, limits)| limits).collect();
    assert_eq!(distinct.len(), 1, "{distinct:?}");
}
