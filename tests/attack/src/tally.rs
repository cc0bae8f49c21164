//! Counts of passed and failed checks by kind, so that a thousand failures of one kind are one line.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Write};
use std::path::PathBuf;

/// Number of cases per kind of failure whose files are kept.
const KEPT: usize = 3;

/// All attacks of a call.
#[derive(Debug, Default)]
pub(crate) struct Tally {
    modules: BTreeMap<&'static str, Module>,
}

/// One attack.
#[derive(Debug, Default)]
struct Module {
    tried: usize,
    failed: usize,
    kinds: BTreeMap<String, Kind>,
    /// Attacks that could not be tried here, with the reason.
    skipped: Vec<String>,
}

/// Failures of one kind.
#[derive(Debug, Default)]
struct Kind {
    count: usize,
    first: String,
    kept: Vec<PathBuf>,
}

impl Tally {
    /// Counts a case with these kinds of failures; returns whether to keep its files.
    pub(crate) fn count(
        &mut self,
        module: &'static str,
        kinds: &[(String, String)],
        found: &std::path::Path,
    ) -> bool {
        let entry = self.modules.entry(module).or_default();
        entry.tried += 1;
        entry.failed += usize::from(!kinds.is_empty());
        let mut keep = false;
        for (kind, detail) in kinds {
            let kind = entry.kinds.entry(kind.clone()).or_default();
            kind.count += 1;
            if kind.count == 1 {
                kind.first.clone_from(detail);
            }
            if kind.kept.len() < KEPT {
                kind.kept.push(found.to_owned());
                keep = true;
            }
        }
        keep
    }

    /// Records that something could not be tried.
    pub(crate) fn skip(&mut self, module: &'static str, reason: String) {
        let skipped = &mut self.modules.entry(module).or_default().skipped;
        if !skipped.contains(&reason) {
            skipped.push(reason);
        }
    }

    /// Cases tried and failed.
    pub(crate) fn counts(&self, module: &str) -> (usize, usize) {
        self.modules.get(module).map_or((0, 0), |module| (module.tried, module.failed))
    }

    /// Whether something failed.
    pub(crate) fn has_failed(&self) -> bool {
        self.modules.values().any(|module| module.failed > 0)
    }

    /// Attacks that could not be tried.
    pub(crate) fn skipped(&self) -> Vec<String> {
        self.modules
            .iter()
            .flat_map(|(name, module)| module.skipped.iter().map(move |reason| format!("{name}: {reason}")))
            .collect()
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, module) in &self.modules {
            let Module { tried, failed, kinds, skipped } = module;
            writeln!(f, "{name}: {tried} tried, {} held, {failed} failed", tried - failed)?;
            for (kind, Kind { count, first, kept }) in kinds {
                writeln!(f, "  {count} x {kind}")?;
                for line in first.lines() {
                    writeln!(f, "      {line}")?;
                }
                if let Some(folder) = kept.first() {
                    writeln!(f, "      kept: {}", folder.display())?;
                }
            }
            for reason in skipped {
                writeln!(f, "  not tried: {reason}")?;
            }
        }
        Ok(())
    }
}

/// A line on progress. Failures to print it are ignored.
pub(crate) fn say(line: &str) {
    writeln!(io::stderr(), "{line}").ok();
}
