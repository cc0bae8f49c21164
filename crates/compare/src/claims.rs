//! Which claims changed between two outputs of a pipeline: from their tables of claims.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use asperity_diff::report::ClaimChange;

use crate::lines::ShortLines;

/// A table of claims that cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ClaimsError {
    /// Not CSV, or the system refused.
    #[error("{}: {error}", path.display())]
    Csv {
        /// The table.
        path: PathBuf,
        /// What is wrong.
        error: csv::Error,
    },
    /// A heading that is not of claims.
    #[error("{}: there is no column {column} (accepted: a table of claims)", path.display())]
    NoColumn {
        /// The table.
        path: PathBuf,
        /// What it lacks.
        column: String,
    },
    /// A cell that is no number.
    #[error("{}: line {line}: {column}: {value:?} is not accepted (accepted: a number)", path.display())]
    Number {
        /// The table.
        path: PathBuf,
        /// The line, the heading's being 1.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        value: String,
    },
}

/// What makes a claim the same claim.
type ClaimKey = (String, String, String, String);
/// Its value and its verdict.
type Judged = (Option<f64>, String);

/// Which claims changed between two tables of them.
pub(crate) fn changes(old: &Path, new: &Path) -> Result<Vec<ClaimChange>, ClaimsError> {
    let (old, new) = (claims(old)?, claims(new)?);
    let keys: BTreeSet<&ClaimKey> = old.keys().chain(new.keys()).collect();
    let changed = keys.into_iter().filter(|key| old.get(*key) != new.get(*key));
    Ok(changed
        .map(|key| {
            let (before, now) = (old.get(key), new.get(key));
            ClaimChange {
                about: key.0.clone(),
                run: key.1.clone(),
                measure: key.2.clone(),
                old_value: before.and_then(|(value, _)| *value),
                new_value: now.and_then(|(value, _)| *value),
                old_verdict: before.map(|(_, verdict)| verdict.clone()),
                new_verdict: now.map(|(_, verdict)| verdict.clone()),
            }
        })
        .collect())
}

fn claims(path: &Path) -> Result<BTreeMap<ClaimKey, Judged>, ClaimsError> {
    let failed = |error: csv::Error| ClaimsError::Csv { path: path.to_owned(), error };
    let file = asperity_files::open(path).map_err(|error| failed(error.into()))?;
    let mut reader = csv::Reader::from_reader(ShortLines::of(file));
    let headings = reader.headers().map_err(failed)?.clone();
    let place = |name: &str| headings.iter().position(|heading| heading == name);
    let needed = |name: &str| {
        place(name).ok_or_else(|| ClaimsError::NoColumn { path: path.to_owned(), column: name.to_owned() })
    };
    let [about, run, quote, measure] = ["about", "run", "quote", "measure"].map(needed);
    let (about, run, quote, measure) = (about?, run?, quote?, measure?);
    let own = (needed("ours")?, needed("verdict")?, "");
    let second = place("as_stated_ours").zip(place("as_stated_verdict"));
    let second = second.map(|(value, verdict)| (value, verdict, ", as-stated"));
    let mut found = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(failed)?;
        let text = |place: usize| record.get(place).unwrap_or_default().to_owned();
        for (value, verdict, which) in std::iter::once(own).chain(second) {
            let (value_text, verdict) = (text(value), text(verdict));
            if verdict.is_empty() {
                continue;
            }
            let value = match value_text.as_str() {
                "" => None,
                number => Some(number.parse().map_err(|_| ClaimsError::Number {
                    path: path.to_owned(),
                    line: record.position().map_or(0, csv::Position::line),
                    column: headings[value].to_owned(),
                    value: number.to_owned(),
                })?),
            };
            let key = (text(about), format!("{}{which}", text(run)), text(measure), text(quote));
            found.insert(key, (value, verdict));
        }
    }
    Ok(found)
}
