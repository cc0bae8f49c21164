//! Which claims changed between two outputs of a pipeline: from their tables of claims.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use asperity_files::ShortLines;
use asperity_numbers::claim::{self, Judgement};

use crate::error::CompareError;
use crate::report::ClaimChange;

/// Key of a claim in both tables: about, run, measure and quote.
type ClaimKey = [String; 4];

/// Which claims changed between two tables of them.
pub(crate) fn changes(old: &Path, new: &Path) -> Result<Vec<ClaimChange>, CompareError> {
    let (old, new) = (judgements(old)?, judgements(new)?);
    let keys: BTreeSet<&ClaimKey> = old.keys().chain(new.keys()).collect();
    let change = |key: &ClaimKey| {
        let outcome = |judged: &Judgement| (judged.ours, judged.verdict.word().to_owned());
        let (before, now) = (old.get(key).map(outcome), new.get(key).map(outcome));
        let [about, run, measure, _] = key.clone();
        (before != now).then(|| ClaimChange {
            about,
            run,
            measure,
            old_value: before.as_ref().and_then(|(value, _)| *value),
            new_value: now.as_ref().and_then(|(value, _)| *value),
            old_verdict: before.map(|(_, verdict)| verdict),
            new_verdict: now.map(|(_, verdict)| verdict),
        })
    };
    Ok(keys.into_iter().filter_map(change).collect())
}

/// The judgements of a table, those of the second runs of a claim as claims of their own.
fn judgements(path: &Path) -> Result<BTreeMap<ClaimKey, Judgement>, CompareError> {
    let failed = |error: String| CompareError::Input(format!("{}: {error}", path.display()));
    let file = asperity_files::open(path).map_err(|error| failed(error.to_string()))?;
    let mut found = BTreeMap::new();
    for claim in claim::read(ShortLines::of(file)).map_err(failed)? {
        let key = |which: &str| {
            let run = format!("{}{which}", claim.run);
            [claim.about.clone(), run, claim.measure.clone(), claim.quote.clone()]
        };
        let second = claim.as_stated.map(|judged| (key(", as-stated"), judged));
        found.extend([(key(""), claim.own)].into_iter().chain(second));
    }
    Ok(found)
}
