//! The recipes of `fixtures/clients/README.md` run in order in one folder, and print the output given on
//! the page.
//!
//! To update the page with the present output, for review and commit:
//! `UPDATE_EXPECT=1 cargo xtask test --test root recipes::`

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::clients::{Python, file, said};
use crate::support::markdown::{Block, blocks};

fn page() -> String {
    fs::read_to_string(file("fixtures/clients/README.md")).expect("the page is there")
}

#[test]
#[ignore = "needs packages of others: cargo xtask ci"]
fn every_recipe_runs_and_prints_what_the_page_says() {
    let Some(python) = Python::find() else { return };
    let folder = asperity_testkit::folder();
    let asperity = Path::new(env!("CARGO_BIN_EXE_asperity"));
    let path = env::var_os("PATH").unwrap_or_default();
    let clients = python.interpreter.parent().map(Path::to_owned);
    let programs = [asperity.parent().map(Path::to_owned), clients].into_iter().flatten();
    let path = env::join_paths(programs.chain(env::split_paths(&path))).expect("folders have plain names");

    let update = env::var_os("UPDATE_EXPECT").is_some();
    let blocks = blocks(&page());
    let languages = |language: &str| blocks.iter().filter(|block| block.language == language).count();
    assert!(
        languages("sh") >= 4 && languages("python") >= 4 && languages("text") >= 4,
        "the page has recipes"
    );
    let mut printed: Option<String> = None;
    let mut all_printed = Vec::new();
    for Block { line, language, text, .. } in &blocks {
        if language == "text" {
            let printed = printed.take().unwrap_or_else(|| panic!("line {line}: nothing ran before this"));
            let printed = trimmed(&printed);
            if !update {
                assert_eq!(printed, *text, "line {line}: what is printed (left)");
            }
            all_printed.push((*line, printed));
            continue;
        }
        let (program, option): (PathBuf, &str) = match language.as_str() {
            "sh" => ("sh".into(), "-euc"),
            "python" => (python.interpreter.clone(), "-c"),
            other => panic!("line {line}: a block of {other:?} (accepted: sh, python, text)"),
        };
        let output = python
            .command(&program)
            .args([option, text])
            .current_dir(folder.path())
            .env("PATH", &path)
            // Frames and tables are as wide as the terminal.
            .env("COLUMNS", "100")
            .output()
            .expect("the program starts");
        assert!(output.status.success(), "line {line}: {}", said(&output));
        printed = Some(String::from_utf8(output.stdout).expect("it prints UTF-8"));
    }
    if update {
        let page = updated(&page(), &all_printed);
        fs::write(file("fixtures/clients/README.md"), page).expect("the page can be written");
    }
}

/// Without the spaces and empty lines that only fill.
fn trimmed(printed: &str) -> String {
    let lines: Vec<&str> = printed.trim_end().lines().map(str::trim_end).collect();
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// A page with other texts in the blocks that start on these lines.
fn updated(page: &str, texts: &[(usize, String)]) -> String {
    let mut updated = String::new();
    let mut lines = page.lines().zip(1..);
    while let Some((line, number)) = lines.next() {
        updated.push_str(line);
        updated.push('\n');
        if let Some((_, text)) = texts.iter().find(|(start, _)| *start == number) {
            updated.push_str(text);
            lines.by_ref().find(|(line, _)| *line == "```").expect("blocks are closed");
            updated.push_str("```\n");
        }
    }
    updated
}

#[test]
fn blocks_are_found_and_updated() {
    let page = "a\n```sh\nls\n```\n```text\nold\nold\n```\nb\n";
    let found: Vec<_> =
        blocks(page).into_iter().map(|block| (block.line, block.language, block.text)).collect();
    let block = |line: usize, language: &str, text: &str| (line, language.to_owned(), text.to_owned());
    assert_eq!(found, [block(2, "sh", "ls\n"), block(5, "text", "old\nold\n")]);
    let new = updated(page, &[(5, trimmed("new \n\n"))]);
    assert_eq!(new, "a\n```sh\nls\n```\n```text\nnew\n```\nb\n");
}
