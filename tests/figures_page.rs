//! `docs/figures.md` has every key of every figure, study and claim, and every number of a run, as the
//! code describes them, and an example of each kind; `docs/outputs.md` has the keys of the summary.
//!
//! To update the pages from the code: `UPDATE_EXPECT=1 cargo xtask test --test root figures_page::`

use std::env;
use std::fs;

use crate::support::clients::file;
use crate::support::markdown::blocks;
use crate::support::schemas::parts;

const PAGE: &str = "docs/figures.md";

/// The pages with parts that are made from the code.
const PAGES: [&str; 2] = [PAGE, "docs/outputs.md"];

fn page(path: &str) -> String {
    fs::read_to_string(file(path)).expect("the page is there")
}

#[test]
fn the_pages_say_what_the_code_does() {
    let mut pages = PAGES.map(|path| (path, page(path)));
    for (name, text) in parts() {
        let lacks = |line: &&str| line.contains("| value |") || line.ends_with("|  |");
        assert_eq!(text.lines().find(lacks), None, "{name}: a key lacks its type or meaning");
        let begin = format!("<!-- from the code: {name} -->\n");
        let found = pages.iter_mut().find(|(_, page)| page.contains(&begin));
        let (path, page) = found.unwrap_or_else(|| panic!("{PAGES:?} lack {begin}"));
        let start = page.find(&begin).expect("it was just found") + begin.len();
        let length = page[start..].find("<!-- end -->").expect("what is from the code ends");
        let text = format!("\n{}\n\n", text.trim_end());
        if env::var_os("UPDATE_EXPECT").is_some() {
            page.replace_range(start..start + length, &text);
            continue;
        }
        assert!(page[start..start + length] == text, "{path}: of {name} the code says\n{text}");
    }
    if env::var_os("UPDATE_EXPECT").is_some() {
        for (path, page) in pages {
            fs::write(file(path), page).expect("the page can be written");
        }
    }
}

/// The examples are run as those of all pages are.
#[test]
fn every_kind_has_an_example() {
    let page = page(PAGE);
    let examples: String =
        blocks(&page).into_iter().filter(|block| block.language == "toml").map(|block| block.text).collect();
    let headings = page.lines().filter_map(|line| line.strip_prefix("### `")?.strip_suffix('`'));
    let mut found = 0;
    for kind in headings {
        found += 1;
        assert!(examples.lines().any(|line| line == kind), "{PAGE}: {kind} has no example");
    }
    assert!(found > 20, "{found} kinds");
}
