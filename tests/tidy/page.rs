//! The rules of ARCHITECTURE.md that tests enforce on the sources: the page is the only place where they
//! are written.

use std::collections::{BTreeMap, BTreeSet};

/// The page, read.
#[derive(Debug, Default)]
pub(super) struct Page {
    /// The workspace crates that each crate may use, by the table of crates.
    pub(super) may_use: BTreeMap<String, BTreeSet<String>>,
    /// Who wraps a dependency for all others, by the words "the only user of".
    pub(super) wrapped: BTreeMap<String, String>,
    /// The paragraph of each crate, and of `xtask`.
    pub(super) paragraphs: BTreeMap<String, String>,
    /// The long files that are accepted, each with the reason.
    pub(super) long_files: BTreeMap<String, String>,
}

/// The first cells of the table of crates.
const TABLE: [&str; 2] = ["crate", "may use"];
/// The heading of the list of long files.
const LONG_FILES: &str = "Long files";

impl Page {
    /// Reads the page.
    ///
    /// # Errors
    /// A line that cannot be parsed, with the accepted form.
    pub(super) fn parse(text: &str) -> Result<Page, String> {
        let mut page = Page::default();
        page.read_sections(text)?;
        page.read_table(text)?;
        Ok(page)
    }

    fn read_sections(&mut self, text: &str) -> Result<(), String> {
        let mut heading = "";
        for (line, number) in text.lines().zip(1..) {
            if line.starts_with('#') {
                heading = line.trim_start_matches('#').trim();
            } else if let Some(name) = crate_of(heading) {
                let paragraph = self.paragraphs.entry(name.to_owned()).or_default();
                paragraph.push_str(line.trim());
                paragraph.push(' ');
            } else if let Some(entry) = line.strip_prefix("- ").filter(|_| heading == LONG_FILES) {
                let (path, reason) = entry
                    .strip_prefix('`')
                    .and_then(|entry| entry.split_once("`: "))
                    .filter(|(_, reason)| reason.split_whitespace().count() > 2)
                    .ok_or_else(|| format!("line {number}: {line:?} (accepted: - `PATH`: REASON)"))?;
                self.long_files.insert(path.to_owned(), reason.to_owned());
            }
        }
        for (name, paragraph) in &self.paragraphs {
            for rest in paragraph.split("the only user of ").skip(1) {
                let end = rest.find(['.', ';', ':', ',']).unwrap_or(rest.len());
                for dependency in rest[..end].split(" and ").map(|name| name.trim().trim_matches('`')) {
                    if let Some(other) = self.wrapped.insert(dependency.to_owned(), name.clone()) {
                        return Err(format!("{name} and {other} are both the only user of {dependency}"));
                    }
                }
            }
        }
        Ok(())
    }

    fn read_table(&mut self, text: &str) -> Result<(), String> {
        let rows: Vec<(usize, Vec<&str>)> = (1..)
            .zip(text.lines())
            .skip_while(|(_, line)| cells(line) != TABLE)
            .skip(2)
            .take_while(|(_, line)| line.starts_with('|'))
            .map(|(number, line)| (number, cells(line)))
            .collect();
        if rows.is_empty() {
            return Err(format!("there is no table | {} |", TABLE.join(" | ")));
        }
        // Several crates may share a row.
        let names = |cell: &str| cell.split(',').map(plain).filter(|name| !name.is_empty()).collect();
        let rows: Vec<(usize, BTreeSet<String>, &str)> = rows
            .into_iter()
            .map(|(number, cells)| match cells[..] {
                [crates, used] => Ok((number, names(crates), used)),
                _ => Err(format!("line {number}: {} cells (accepted: {})", cells.len(), TABLE.len())),
            })
            .collect::<Result<_, String>>()?;
        let all: BTreeSet<String> = rows.iter().flat_map(|(_, crates, _)| crates.clone()).collect();
        let mut above = BTreeSet::new();
        for (number, crates, used) in rows {
            // Text after a colon is prose.
            let used = match used.split(':').next().unwrap_or_default().trim() {
                "-" | "none" => BTreeSet::new(),
                "all" | "all above" => above.clone(),
                used => names(used),
            };
            if let Some(unknown) = used.difference(&all).next() {
                let all: Vec<&str> = all.iter().map(String::as_str).collect();
                let accepted = all.join(", ");
                return Err(format!(
                    "line {number}: no crate {unknown} (accepted: -, all above, {accepted})"
                ));
            }
            for name in &crates {
                if self.may_use.insert(name.clone(), used.clone()).is_some() {
                    return Err(format!("line {number}: {name} stands twice"));
                }
            }
            above.extend(crates);
        }
        Ok(())
    }
}

/// The crate that a heading such as "`crates/record`" or "`xtask`" is of.
fn crate_of(heading: &str) -> Option<&str> {
    let name = heading.strip_prefix('`')?.strip_suffix('`')?;
    name.strip_prefix("crates/").or_else(|| (name == "xtask").then_some(name))
}

fn cells(line: &str) -> Vec<&str> {
    let inner = line.trim().strip_prefix('|').and_then(|line| line.strip_suffix('|'));
    inner.map(|line| line.split('|').map(str::trim).collect()).unwrap_or_default()
}

fn plain(name: &str) -> String {
    name.trim().trim_matches('`').to_owned()
}

#[test]
fn the_page_is_read_as_it_is_written() {
    let text = "\
| crate | may use |
|---|---|
| record | - |
| `detect-onset`, detect-global | record |
| run | all above |
| xtask | none: it drives the binary |

### `crates/run`

A run. *Invariants:* the only
user of mcap and `zstd`; no clock.

## Long files

- `crates/run/src/long.rs`: one table of numbers.
";
    let page = Page::parse(text).expect("it is well formed");
    let used = |name: &str| page.may_use[name].iter().map(String::as_str).collect::<Vec<_>>();
    assert_eq!(used("record"), [""; 0]);
    assert_eq!(used("detect-global"), ["record"]);
    assert_eq!(used("run"), ["detect-global", "detect-onset", "record"]);
    assert_eq!(used("xtask"), [""; 0]);
    assert_eq!(page.wrapped, ["mcap", "zstd"].map(|name| (name.to_owned(), "run".to_owned())).into());
    assert_eq!(page.long_files["crates/run/src/long.rs"], "one table of numbers.");
    assert!(page.paragraphs["run"].starts_with(" A run."));
    for (from, to, said) in [
        ("record | - |", "record | recrod |", "no crate recrod"),
        ("| run |", "| record |", "stands twice"),
        ("| crate |", "| crates |", "there is no table"),
        ("long.rs`: one table of numbers.", "long.rs`", "accepted: - `PATH`: REASON"),
    ] {
        let error = Page::parse(&text.replace(from, to)).expect_err(said);
        assert!(error.contains(said), "{error}");
    }
}
