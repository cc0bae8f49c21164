//! Tables of independent programs.

use std::path::Path;

/// The rows of a table of `fixtures/reference`, given its path there: cells as texts, without the heading and without
/// lines that begin with `#`.
///
/// # Panics
/// If there is no such table.
pub fn reference(table: &str) -> Vec<Vec<String>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/reference").join(table);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.map(|line| line.split(',').map(str::to_owned).collect()).collect()
}
