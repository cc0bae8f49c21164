//! The TOML that says what to run, reduce and draw.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use asperity_figures::draw::{Figures, files_of};
use asperity_model::analytic::LengthLaw;
use asperity_numbers::Number;
use asperity_numbers::claims::ClaimSpec;
use asperity_numbers::precursors::PrecursorRules;
use asperity_numbers::wants::Wants;
use asperity_record::bounds::check_toml;
use asperity_report::{Contents, Shown};
use asperity_tables::tables::FirstGlobalSlip;
use asperity_tables::{summaries, table_file, tables};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::parameter_table::Study;
use crate::runs::{Ensemble, RunSpec, SpellOut};

/// A pipeline, as written.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pipeline {
    /// What it reproduces, for headings.
    pub title: String,
    /// The runs, those of ensembles included.
    #[serde(default)]
    pub run: Vec<RunSpec>,
    /// Runs that differ in one key.
    #[serde(default)]
    pub ensemble: Vec<Ensemble>,
    /// Runs whose first global slips are set side by side in a table.
    #[serde(default)]
    pub first_global_slips: Vec<String>,
    /// The precursor tables, one per run and length law.
    #[serde(default)]
    pub precursors: Vec<PrecursorSpec>,
    /// The tables of numbers against a parameter.
    #[serde(default)]
    pub study: Vec<Study>,
    /// The figures, by kind.
    #[serde(default)]
    pub figure: Figures,
    /// The claims.
    #[serde(default)]
    pub claim: Vec<ClaimSpec>,
    /// What its author should change, a line each: old names of numbers.
    #[serde(skip)]
    pub notes: Vec<String>,
}

/// The old names of numbers in a file, each with its new one.
fn old_names(file: &toml::Table) -> Vec<String> {
    fn find(value: &toml::Value, is_name: bool, found: &mut BTreeSet<String>) {
        match value {
            toml::Value::String(name) if is_name => {
                let number = Number::find(name).ok().filter(|number| number.name() != name);
                found
                    .extend(number.map(|number| format!("measure {name:?} is now called {}", number.name())));
            }
            toml::Value::Array(values) => values.iter().for_each(|value| find(value, is_name, found)),
            toml::Value::Table(table) => table.iter().for_each(|(key, value)| {
                find(value, matches!(key.as_str(), "measure" | "measures"), found);
            }),
            _ => {}
        }
    }
    let mut found = BTreeSet::new();
    file.values().for_each(|value| find(value, false, &mut found));
    found.into_iter().collect()
}

/// A run whose precursors are compared with a length law.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrecursorSpec {
    /// The run.
    pub run: String,
    /// The law.
    pub law: LengthLaw,
    /// Which events to merge and drop; by default none.
    #[serde(default)]
    pub rules: PrecursorRules,
}

impl PrecursorSpec {
    /// The name of its table.
    pub(crate) fn table(&self) -> String {
        table_of(&self.run, &format!("precursors-{}", self.law.file_word()))
    }
}

/// The name of a table of one run.
pub(crate) fn table_of(run: &str, what: &str) -> String {
    format!("{run}.{what}")
}

/// The name of a table of several.
pub(crate) fn study_table(study: &Study) -> String {
    format!("study-{}", study.name)
}

/// The page of all of it.
pub(crate) const REPORT: &str = "report.html";

/// The names of the tables that there is one of.
pub(crate) const RESIDUALS: &str = "residuals";
pub(crate) const FIRST_GLOBAL_SLIPS: &str = "first-global-slips";
pub(crate) const CLAIMS: &str = "claims";
/// The file of the claims as a page.
pub(crate) const CLAIMS_PAGE: &str = "claims.md";

impl Pipeline {
    /// Parses a pipeline and checks that it speaks of no run that it does not have.
    ///
    /// # Errors
    /// In words, with line and column where the TOML is at fault.
    pub fn parse(text: &str) -> Result<Pipeline, String> {
        check_toml(text).map_err(|too_long| too_long.to_string())?;
        let mut pipeline: Pipeline = toml::from_str(text).map_err(|error| error.to_string())?;
        pipeline.notes = old_names(&toml::from_str(text).map_err(|error| error.to_string())?);
        pipeline.spell_out_ensembles()?;
        if pipeline.run.is_empty() {
            return Err("there are no runs (accepted: [[run]] or [[ensemble]])".to_owned());
        }
        let mut names = BTreeSet::new();
        for run in &pipeline.run {
            if !names.insert(run.name.as_str()) {
                return Err(format!("two runs are called {}", run.name));
            }
            let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
            if run.name.is_empty() || !run.name.chars().all(plain) {
                return Err(format!(
                    "run name {:?} is no file name (accepted: letters, digits, - and _)",
                    run.name
                ));
            }
        }
        let spoken_of = pipeline
            .precursors
            .iter()
            .map(|spec| spec.run.as_str())
            .chain(pipeline.first_global_slips.iter().map(String::as_str))
            .chain(pipeline.claim.iter().flat_map(ClaimSpec::runs))
            .chain(pipeline.study.iter().flat_map(|study| study.runs.iter().map(String::as_str)))
            .chain(pipeline.figure.runs());
        for run in spoken_of {
            if !names.contains(run) {
                let known: Vec<&str> = names.into_iter().collect();
                return Err(format!("there is no run {run} (accepted: {})", known.join(", ")));
            }
        }
        // Files that it names are written into the folder that it is given, and nowhere else.
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        for (what, name) in (pipeline.study.iter().map(|study| ("study name", study.name.as_str())))
            .chain(pipeline.figure.files().map(|file| ("figure file", file)))
        {
            if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
                return Err(format!(
                    "{what} {name:?} is no file name (accepted: letters, digits, -, _ and dots inside)"
                ));
            }
        }
        if let Some(file) = pipeline.figure.files().find(|file| !file.ends_with(".png")) {
            return Err(format!(
                "figure file {file:?} does not end in .png (accepted: NAME.png, beside which NAME.svg and NAME.pdf stand)"
            ));
        }
        // None takes the place of another.
        let tables = pipeline.tables();
        let tables = tables.iter().map(|table| ("table", table.as_str()));
        let mut written = BTreeSet::new();
        for file in tables.chain(pipeline.figure.files().map(|file| ("figure file", file))) {
            if !written.insert(file) {
                let (what, name) = file;
                return Err(format!("{what} {name:?} would be written twice (accepted: different names)"));
            }
        }
        for spec in &pipeline.precursors {
            spec.rules.check().map_err(|error| format!("precursors of {}: {error}", spec.run))?;
        }
        for claim in &pipeline.claim {
            claim.check().map_err(|error| format!("claim about {}: {error}", claim.about))?;
        }
        Ok(pipeline)
    }

    /// Puts the runs of ensembles beside the others, and wherever an ensemble is named.
    fn spell_out_ensembles(&mut self) -> Result<(), String> {
        let mut spell_out = SpellOut::new(&self.ensemble)?;
        spell_out.add_runs(&mut self.run)?;
        let mut lists = (self.claim.iter_mut().flat_map(ClaimSpec::lists_mut))
            .chain(self.study.iter_mut().map(|study| &mut study.runs))
            .chain(self.figure.lists_mut())
            .chain([&mut self.first_global_slips]);
        lists.try_for_each(|names| spell_out.replace_in(names))
    }

    /// The laws with which the precursors of a run are compared.
    fn laws_of(&self, run: &RunSpec) -> impl Iterator<Item = (LengthLaw, PrecursorRules)> {
        let of_run = self.precursors.iter().filter(|spec| spec.run == run.name);
        of_run.map(|spec| (spec.law, spec.rules))
    }

    /// The names of its tables, without their endings.
    fn tables(&self) -> Vec<String> {
        let of_runs = self.run.iter().flat_map(|run| {
            let precursors = self.laws_of(run).next().map(|_| tables::PRECURSOR_RUPTURES);
            let names = [Some(tables::RUPTURES), precursors, Some("events"), Some("load")];
            names.into_iter().flatten().map(|what| table_of(&run.name, what))
        });
        let singles = [
            (!self.precursors.is_empty(), RESIDUALS),
            (!self.first_global_slips.is_empty(), FIRST_GLOBAL_SLIPS),
            (!self.claim.is_empty(), CLAIMS),
        ];
        of_runs
            .chain(self.precursors.iter().map(PrecursorSpec::table))
            .chain(self.study.iter().map(study_table))
            .chain(singles.into_iter().filter(|(there, _)| *there).map(|(_, name)| name.to_owned()))
            .collect()
    }

    /// All files that a reduction writes into a folder, but for the record of them.
    pub fn outputs(&self, out: &Path) -> Vec<PathBuf> {
        let (tables, figures) = (out.join("tables"), out.join("figures"));
        let mut outputs: Vec<PathBuf> =
            self.tables().iter().flat_map(|name| table_file::paths(&tables, name)).collect();
        outputs.extend((!self.claim.is_empty()).then(|| tables.join(CLAIMS_PAGE)));
        outputs.push(tables.join(summaries::TABLE));
        outputs.extend(self.run.iter().map(|run| tables.join(table_of(&run.name, summaries::JSON))));
        outputs.extend(self.figure.files().flat_map(|file| files_of(&figures.join(file))));
        outputs.push(out.join(REPORT));
        outputs
    }

    /// What its page shows beside its runs, given the figures' captions by file.
    pub(crate) fn contents(&self, captions: &BTreeMap<String, String>) -> Contents {
        let shown = |(file, of): (&str, Vec<&str>)| {
            // In the order of the pipeline.
            let runs = self.run.iter().map(|run| &run.name).filter(|name| of.contains(&name.as_str()));
            Shown {
                file: format!("figures/{file}"),
                caption: captions.get(file).cloned().unwrap_or_default(),
                runs: runs.cloned().collect(),
            }
        };
        Contents {
            title: self.title.clone(),
            figures: self.figure.by_file().into_iter().map(shown).collect(),
        }
    }

    /// What tables, figures, studies and claims read of a run.
    pub(crate) fn wants(&self, run: &str) -> Wants {
        let mut wants = self.figure.wants(run);
        for spec in self.precursors.iter().filter(|spec| spec.run == run) {
            wants |= spec.rules.wants();
        }
        if self.first_global_slips.iter().any(|name| name == run) {
            wants |= FirstGlobalSlip::WANTS;
        }
        for study in self.study.iter().filter(|study| study.runs.iter().any(|name| name == run)) {
            wants |= study.wants();
        }
        for claim in self.claim.iter().filter(|claim| claim.runs().any(|name| name == run)) {
            wants |= claim.wants();
        }
        wants
    }
}

#[cfg(test)]
mod tests {
    use super::Pipeline;

    #[test]
    fn old_names_of_numbers_are_read_and_noted_once() {
        let pipeline = Pipeline::parse(
            "title = \"t\"\n[[run]]\nname = \"precursor-count\"\nscenario = \"default\"\n\
             [[study]]\nname = \"s\"\nparameter = \"slider.blocks\"\nruns = [\"precursor-count\"]\n\
             measures = [\"precursor-count\", \"creeps\"]\n\
             [[figure.study]]\nfile = \"f.png\"\nparameter = \"slider.blocks\"\nparameter_label = \"N\"\n\
             measure = \"precursor-count\"\nmeasure_label = \"n\"\nseries = []\n\
             [[claim]]\nabout = \"a\"\nquote = \"q\"\nrun = \"precursor-count\"\n\
             measure = \"first-global-slip-time\"\nat_most = 1\n",
        );
        let pipeline = pipeline.unwrap();
        assert_eq!(
            pipeline.notes,
            [
                "measure \"first-global-slip-time\" is now called first_global_event_onset_s",
                "measure \"precursor-count\" is now called precursor_event_count",
            ]
        );
        assert_eq!(pipeline.study[0].measures[0].words(), "precursor count");
        assert_eq!(pipeline.claim[0].measure.name(), "first_global_event_onset_s");
    }

    #[test]
    fn numbers_that_are_not_there_are_refused_with_the_line() {
        let text = "title = \"t\"\n[[claim]]\nabout = \"a\"\nquote = \"q\"\nrun = \"r\"\nmeasure = \"event_conut\"\n";
        let refused = Pipeline::parse(text).unwrap_err();
        assert!(refused.contains("line 6") && refused.contains("did you mean event_count?"), "{refused}");
    }
}
