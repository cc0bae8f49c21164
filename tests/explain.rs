//! `asperity keys`, `columns`, `numbers` and `figures` explain every column, number and key, and their examples run.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use asperity_study::pipeline::Pipeline;

use crate::support::binary::{outcome, succeed, text};

/// What a command explains in full: headings, and lines of parts.
fn explained(command: &str) -> (Vec<String>, Vec<String>) {
    let page = succeed(&[command, "--markdown"]);
    let with =
        |mark: &str| page.lines().filter_map(|line| line.strip_prefix(mark)).map(str::to_owned).collect();
    (with("### "), with("- `"))
}

#[test]
fn every_part_has_a_meaning_and_a_unit_or_type() {
    for (command, fewest) in [("keys", 90), ("columns", 200), ("numbers", 220), ("figures", 250)] {
        let (headings, parts) = explained(command);
        assert!(parts.len() > fewest && headings.len() > 10, "{command}: {}", parts.len());
        let listed = succeed(&[command]);
        assert!(headings.iter().all(|heading| listed.contains(heading.as_str())), "{command}: {headings:?}");
        for part in parts {
            let (start, meaning) = part.split_once("): ").unwrap_or_else(|| panic!("{command}: {part}"));
            let (name, of) = start.split_once("` (").expect("what it holds stands behind its name");
            assert!(meaning.len() > 5 && !of.is_empty() && !of.starts_with("value"), "{command}: {part}");
            // Claims are in the unit of what they measure.
            let has_unit = of.contains(", ") || ["ours", "standard_error", "deviation"].contains(&name);
            assert!(command != "columns" || !of.starts_with("double") || has_unit, "{part}");
        }
    }
}

#[test]
fn a_name_or_a_word_finds_its_parts() {
    let arrivals = succeed(&["columns", "/events/arrival"]);
    assert!(
        arrivals.starts_with("### /events/arrival\n\n- `rupture` (whole number, 64 bits): "),
        "{arrivals}"
    );
    assert_eq!(succeed(&["columns", "arrival"]), arrivals);
    let numbers = succeed(&["numbers", "first_slip_s"]);
    assert!(
        numbers.starts_with("### First slip\n\n- `first_slip_s` (robust at fixed l_0, s): "),
        "{numbers}"
    );
    // A kind of figure and a table of pipelines.
    let studies = succeed(&["figures", "study"]);
    assert!(studies.contains("### study\n") && studies.contains("### [[study]]\n"), "{studies}");
    let (code, _, err) = outcome(&["figures", "statoin"]);
    assert!(code == 2 && err.contains("nothing is called \"statoin\" (accepted: "), "{code}: {err}");
}

/// The kinds of figures and tables with their examples.
fn examples() -> Vec<(String, String)> {
    let page = succeed(&["figures", "--markdown"]);
    let parts = page.split("### ").skip(1);
    parts
        .map(|part| {
            let (name, part) = part.split_once('\n').expect("a heading ends");
            let (_, example) = part.split_once("```toml\n").expect("it has an example");
            let (example, _) = example.split_once("\n```").expect("it ends");
            (name.to_owned(), example.to_owned())
        })
        .collect()
}

#[test]
fn every_kind_has_an_example_of_it_alone() {
    let mut kinds = BTreeSet::new();
    for (name, example) in examples() {
        let own = [format!("[[figure.{name}]]"), format!("curve = \"{name}\""), name.clone()];
        assert!(own.iter().any(|own| example.lines().any(|line| line == own)), "{name}: {example}");
        if name != "family" {
            Pipeline::parse(&example).unwrap_or_else(|problem| panic!("{name}: {problem}\n{example}"));
            assert!(example.matches("\n[[").count() < 6, "{name}: {example}");
        }
        assert!(kinds.insert(name));
    }
    assert!(kinds.len() > 40, "{kinds:?}");
}

mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of runs: cargo xtask ci"]
    fn every_example_runs() {
        let folder = asperity_testkit::folder();
        let path = |name: &str| folder.path().join(name);
        for (number, (name, example)) in examples().into_iter().enumerate() {
            let (file, out) = (path(&format!("{number}.toml")), path(&number.to_string()));
            fs::write(&file, &example).expect("the folder can be written");
            let command: &[&str] = if name == "family" { &["sweep", "go"] } else { &["reproduce"] };
            succeed(&[command, &[text(&file), "-o", text(&out), "--quiet"]].concat());
            let drawn = |folder: &Path| fs::read_dir(folder).is_ok_and(|files| files.count() >= 3);
            assert!(name.starts_with('[') || drawn(&out.join("figures")), "{name} draws nothing");
        }
    }
}
