//! What a change of events does to what is made of them: the precursor tables,
//! and the claims.

use std::collections::BTreeMap;
use std::path::Path;

use asperity_analysis::precursors::{self, PrecursorRules};
use asperity_analysis::run_data::RunData;
use asperity_diff::provenance::Provenance;
use asperity_diff::report::{ClaimChange, PrecursorChange, PrecursorChanges};
use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::SlipEvent;

use crate::exit::Failure;

/// The events of a run that may be precursors, as they go by.
#[derive(Debug, Default)]
pub(crate) struct Candidates {
    longest: u32,
    over: bool,
    slips: Vec<SlipEvent>,
}

impl Candidates {
    /// Keeps an event that starts at block 1 and runs farther than those before; never more of
    /// them than there are blocks.
    pub(crate) fn watch(&mut self, event: &SlipEvent, blocks: u32) {
        let is_global = event.is_global(blocks);
        if self.over || !(is_global || event.first_block == 1 && event.last_block > self.longest) {
            return;
        }
        self.longest = self.longest.max(event.last_block);
        self.over = is_global;
        self.slips.push(event.clone());
    }

    /// The precursors among them: length, F_T/F_N at the onset, number of the event.
    fn precursors(self, run: &Provenance) -> Result<Vec<(u32, f64, u64)>, Failure> {
        let source = ScenarioSource::new("scenario.toml", run.scenario_toml.clone());
        let scenario = Scenario::resolve(&source).map_err(Failure::bad_input)?;
        let data = RunData {
            name: String::new(),
            header: run.header.clone(),
            plan: Plan::new(&scenario),
            scenario,
            steps: Vec::new(),
            fields: Vec::new(),
            windows: Vec::new(),
            slips: self.slips,
        };
        let found = precursors::find(&data, &PrecursorRules::default());
        Ok(found.iter().map(|found| (found.last_block, found.start.ft_fn_onset, found.start.event)).collect())
    }
}

/// Which rows of the precursor table changed, by the default rules: nothing merged or dropped.
pub(crate) fn precursor_changes(
    old: Candidates,
    new: Candidates,
    runs: (&Provenance, &Provenance),
) -> Result<PrecursorChanges, Failure> {
    let blocks = f64::from(runs.0.header.blocks);
    let (old, new) = (old.precursors(runs.0)?, new.precursors(runs.1)?);
    let by_length = |rows: &[(u32, f64, u64)]| -> BTreeMap<u32, (f64, u64)> {
        rows.iter().map(|&(length, ft_fn, event)| (length, (ft_fn, event))).collect()
    };
    let (old_by_length, new_by_length) = (by_length(&old), by_length(&new));
    let lengths: std::collections::BTreeSet<&u32> =
        old_by_length.keys().chain(new_by_length.keys()).collect();
    let mut changes = PrecursorChanges {
        old_rows: old.len() as u64,
        new_rows: new.len() as u64,
        same_rows: 0,
        rows: Vec::new(),
    };
    for length in lengths {
        let (old, new) = (old_by_length.get(length), new_by_length.get(length));
        if old.map(|row| row.0) == new.map(|row| row.0) {
            changes.same_rows += 1;
            continue;
        }
        changes.rows.push(PrecursorChange {
            lp_l: f64::from(*length) / blocks,
            old_ft_fn: old.map(|row| row.0),
            new_ft_fn: new.map(|row| row.0),
            old_event: old.map(|row| row.1),
            new_event: new.map(|row| row.1),
        });
    }
    Ok(changes)
}

/// What makes a claim the same claim.
type ClaimKey = (String, String, String, String);
/// Its value and its verdict.
type Judged = (Option<f64>, String);

/// Which claims changed between two tables of them.
pub(crate) fn claim_changes(old: &Path, new: &Path) -> Result<Vec<ClaimChange>, Failure> {
    let (old, new) = (claims(old)?, claims(new)?);
    let keys: std::collections::BTreeSet<&ClaimKey> = old.keys().chain(new.keys()).collect();
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

fn claims(path: &Path) -> Result<BTreeMap<ClaimKey, Judged>, Failure> {
    let failed = |problem: String| Failure::BadInput(format!("{}: {problem}", path.display()));
    let mut reader = csv::Reader::from_path(path).map_err(|error| failed(error.to_string()))?;
    let headings = reader.headers().map_err(|error| failed(error.to_string()))?.clone();
    let place = |name: &str| headings.iter().position(|heading| heading == name);
    let needed = |name: &str| {
        place(name).ok_or_else(|| failed(format!("there is no column {name} (accepted: a table of claims)")))
    };
    let [about, run, quote, measure] = ["about", "run", "quote", "measure"].map(needed);
    let (about, run, quote, measure) = (about?, run?, quote?, measure?);
    let own = (needed("ours")?, needed("verdict")?, "");
    let second = place("as_stated_ours").zip(place("as_stated_verdict"));
    let second = second.map(|(value, verdict)| (value, verdict, ", as-stated"));
    let mut found = BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(|error| failed(error.to_string()))?;
        let text = |place: usize| record.get(place).unwrap_or_default().to_owned();
        for (value, verdict, which) in std::iter::once(own).chain(second) {
            let (value_text, verdict) = (text(value), text(verdict));
            if verdict.is_empty() {
                continue;
            }
            let value = match value_text.as_str() {
                "" => None,
                number => Some(number.parse().map_err(|_| {
                    let line = record.position().map_or(0, csv::Position::line);
                    let heading = &headings[value];
                    failed(format!("line {line}: {heading}: {number:?} is not accepted (accepted: a number)"))
                })?),
            };
            let key = (text(about), format!("{}{which}", text(run)), text(measure), text(quote));
            found.insert(key, (value, verdict));
        }
    }
    Ok(found)
}
