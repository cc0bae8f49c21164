//! The outputs of a study for its named runs: tables, figures and claims.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use asperity_figures::draw::{Caption, files_of};
use asperity_model::among;
use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::claims::ClaimSpec;
use asperity_numbers::precursors::PrecursorRules;
use asperity_numbers::required_data::RequiredData;
use asperity_report::{Contents, Figure};
use asperity_tables::tables::{FIRST_GLOBAL_SLIPS, RESIDUALS};
use asperity_tables::{summaries, table_files, tables};

use crate::error::StudyError;
pub use crate::file::Pipeline;
use crate::file::PrecursorSpec;
use crate::parameter_table::Study;
use crate::plan::{self, Plan};

/// The name of a table of one run.
pub(crate) fn table_of(run: &str, what: &str) -> String {
    format!("{run}.{what}")
}

/// The name of the table of precursors beside a law.
pub(crate) fn precursor_table(spec: &PrecursorSpec) -> String {
    table_of(&spec.run, &format!("precursors-{}", spec.law.word()))
}

/// The name of a table of several.
pub(crate) fn study_table(study: &Study) -> String {
    format!("study-{}", study.name)
}

/// The page of all of it.
pub const REPORT: &str = "report.html";

/// The name of the table of claims.
pub(crate) const CLAIMS: &str = "claims";
/// The file of the claims as a page.
pub(crate) const CLAIMS_PAGE: &str = "claims.md";

/// Finds the runs over axes with given values of keys, each `key=value`.
pub(crate) type At<'a> = &'a dyn Fn(&[String]) -> Result<Vec<u64>, String>;

impl Pipeline {
    /// Parses the text of a study, and checks that it speaks of no run that it does not have.
    ///
    /// # Errors
    /// In words, with line and column if the TOML is at fault.
    pub fn parse(text: &str) -> Result<Pipeline, String> {
        Pipeline::unchecked(text)?.checked(0, &|_| Ok(Vec::new()))
    }

    /// The outputs of the study of a plan in a folder, if it requests more than the tables of runs over axes.
    ///
    /// # Errors
    /// If its text is not accepted.
    pub(crate) fn of_plan(plan: &Plan, folder: &Path) -> Result<Option<Pipeline>, StudyError> {
        let Some(text) = &plan.common.study_toml else { return Ok(None) };
        let pipeline = Pipeline::unchecked(text).and_then(|mut pipeline| {
            let read = |path: &str| plan.common.files.measured(path, || Err("no such file".to_owned()));
            pipeline.figure.measured_mut().try_for_each(|file| file.read(read))?;
            pipeline.checked(plan.numbered(), &|at| plan.runs_at(at))
        });
        pipeline.map(Some).map_err(StudyError::refused(&folder.join(plan::FILE)))
    }

    /// The study beside a number of runs over axes, where `at` finds those with given values of keys, if it speaks of no
    /// run that it does not have.
    pub(crate) fn checked(mut self, numbered: u64, at: At<'_>) -> Result<Pipeline, String> {
        self.check(numbered)?;
        for claim in self.claim.iter_mut().filter(|claim| !claim.at.is_empty()) {
            let runs = if numbered == 0 { Err("at: nothing varies".to_owned()) } else { at(&claim.at) };
            claim.choose(&runs.map_err(|error| format!("claim about {}: {error}", claim.about))?);
        }
        Ok(self)
    }

    fn check(&self, numbered: u64) -> Result<(), String> {
        let of_tables = || self.figure.family.iter().map(|family| family.file.as_str());
        let names: BTreeSet<&str> = self.runs.iter().map(String::as_str).collect();
        let is_over_axes =
            |run: &&str| !names.contains(run) && run.parse().is_ok_and(|run| (1..=numbered).contains(&run));
        let claimed = self.claim.iter().flat_map(ClaimSpec::runs).filter(|run| !is_over_axes(run));
        let spoken_of = self
            .precursors
            .iter()
            .map(|spec| spec.run.as_str())
            .chain(self.first_global_slips.iter().chain(&self.slow_slip).map(String::as_str))
            .chain(claimed)
            .chain(self.study.iter().flat_map(|study| study.runs.iter().map(String::as_str)))
            .chain(self.figure.runs());
        for run in spoken_of {
            if !names.contains(run) {
                let known: Vec<&str> = names.into_iter().collect();
                return Err(format!(
                    "there is no run {run}{}",
                    among(run, &known, "the [[run]] of this file")
                ));
            }
        }
        self.figure.check()?;
        let files: Vec<&str> = self.figure.files().chain(of_tables()).collect();
        if let Some(file) = self.main_figure.as_ref().filter(|file| !files.contains(&file.as_str())) {
            let meant = among(file, &files, "the files of the figures of this file");
            return Err(format!("main_figure: there is no figure {file}{meant}"));
        }
        for claim in &self.claim {
            if let Some(file) = claim.figures.iter().find(|file| !files.contains(&file.as_str())) {
                let meant = among(file, &files, "the files of the figures of this file");
                return Err(format!("claim about {}: there is no figure {file}{meant}", claim.about));
            }
        }
        // Files named by the study must be plain names, so that they are written only into the output
        // folder.
        let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        for (what, name) in (self.study.iter().map(|study| ("study name", study.name.as_str())))
            .chain(self.figure.files().map(|file| ("figure file", file)))
        {
            if name.is_empty() || name.starts_with('.') || !name.chars().all(plain) {
                return Err(format!(
                    "{what} {name:?} is no file name (accepted: letters, digits, -, _ and dots inside)"
                ));
            }
        }
        if let Some(file) = self.figure.files().find(|file| !file.ends_with(".png")) {
            return Err(format!(
                "figure file {file:?} does not end in .png (accepted: NAME.png, beside which NAME.svg and NAME.pdf stand)"
            ));
        }
        // All files must have different names.
        let tables = self.tables();
        let tables = tables.iter().map(|table| ("table", table.as_str()));
        let figures = self.figure.files().chain(of_tables());
        let mut written = BTreeSet::new();
        for file in tables.chain(figures.map(|file| ("figure file", file))) {
            if !written.insert(file) {
                let (what, name) = file;
                return Err(format!("{what} {name:?} would be written twice (accepted: different names)"));
            }
        }
        for spec in &self.precursors {
            spec.rules.check().map_err(|error| format!("precursors of {}: {error}", spec.run))?;
        }
        for claim in &self.claim {
            claim.check().map_err(|error| format!("claim about {}: {error}", claim.about))?;
            let is_over_axes = !claim.at.is_empty() || claim.runs().any(|run| is_over_axes(&run));
            let measures = [("measure", Some(claim.measure)), ("power_of", claim.power_of)];
            let mut measures = measures.into_iter().filter_map(|(key, number)| Some((key, number?)));
            if let Some((key, number)) = measures.find(|(_, number)| is_over_axes && !number.is_of_summary())
            {
                return Err(format!(
                    "claim about {}: {key} = {:?} of a run over axes, of which no log is read (accepted: a number of \
                     `asperity summary --schema`)",
                    claim.about,
                    number.name()
                ));
            }
        }
        Ok(())
    }

    /// The laws with which the precursors of a run are compared.
    pub(crate) fn laws_of(&self, run: &str) -> impl Iterator<Item = (LengthLaw, PrecursorRules)> {
        let of_run = self.precursors.iter().filter(move |spec| spec.run == run);
        of_run.map(|spec| (spec.law, spec.rules))
    }

    /// The names of its tables, without their endings.
    fn tables(&self) -> Vec<String> {
        let of_runs = self.runs.iter().flat_map(|run| {
            let precursors = self.laws_of(run).next().map(|_| tables::PRECURSOR_RUPTURES);
            let slow_slip = self.slow_slip.contains(run).then_some(tables::SLOW_SLIP);
            let names = [Some(tables::RUPTURES), precursors, slow_slip, Some("events"), Some("load")];
            names.into_iter().flatten().map(|what| table_of(run, what))
        });
        let singles = [
            (!self.precursors.is_empty(), RESIDUALS),
            (!self.first_global_slips.is_empty(), FIRST_GLOBAL_SLIPS),
            (!self.claim.is_empty(), CLAIMS),
        ];
        of_runs
            .chain(self.precursors.iter().map(precursor_table))
            .chain(self.study.iter().map(study_table))
            .chain(singles.into_iter().filter(|(there, _)| *there).map(|(_, name)| name.to_owned()))
            .collect()
    }

    /// All files that a reduction writes into a folder, except for their record.
    pub fn outputs(&self, out: &Path) -> Vec<PathBuf> {
        let (tables, figures) = (out.join("tables"), out.join("figures"));
        let mut outputs: Vec<PathBuf> =
            self.tables().iter().flat_map(|name| table_files::paths(&tables, name)).collect();
        outputs.extend((!self.claim.is_empty()).then(|| tables.join(CLAIMS_PAGE)));
        outputs.push(tables.join(summaries::TABLE));
        outputs.extend(self.runs.iter().map(|run| tables.join(table_of(run, summaries::JSON))));
        outputs.extend(self.figure.files().flat_map(|file| files_of(&figures.join(file))));
        outputs.push(out.join(REPORT));
        outputs
    }

    /// Parts of its page beside the runs, given the figures' captions by file.
    pub(crate) fn contents(&self, captions: &BTreeMap<String, Caption>) -> Contents {
        let shown = |(file, of): (&str, Vec<&str>)| {
            let Caption { title, caption } = captions.get(file).cloned().unwrap_or_default();
            // In the order of the pipeline.
            let runs = self.runs.iter().filter(|name| of.contains(&name.as_str())).cloned().collect();
            Figure { file: format!("figures/{file}"), title, caption, runs, picture: None }
        };
        let mut files: Vec<_> = self.figure.by_file().into_iter().collect();
        files.sort_by_key(|(file, _)| self.main_figure.as_deref() != Some(*file));
        Contents { title: self.title.clone(), figures: files.into_iter().map(shown).collect() }
    }

    /// Data that tables, figures, studies and claims read from a run.
    pub(crate) fn required_data(&self, run: &str) -> RequiredData {
        let mut required = self.figure.required_data(run);
        for spec in self.precursors.iter().filter(|spec| spec.run == run) {
            required |= spec.rules.required_data();
        }
        if self.first_global_slips.iter().any(|name| name == run) {
            required |= tables::REQUIRED_FOR_FIRST_GLOBAL_SLIP;
        }
        if self.slow_slip.iter().any(|name| name == run) {
            required |= RequiredData::motion();
        }
        for study in self.study.iter().filter(|study| study.runs.iter().any(|name| name == run)) {
            required |= study.required_data();
        }
        for claim in self.claim.iter().filter(|claim| claim.runs().any(|name| name == run)) {
            required |= claim.required_data();
        }
        required
    }
}

#[cfg(test)]
mod tests {
    use super::Pipeline;

    #[test]
    fn over_axes_both_numbers_of_an_exponent_are_of_the_summary() {
        let refused = |measure: &str, power_of: &str| {
            let text = format!(
                "title = \"t\"\n[[claim]]\nabout = \"a\"\nquote = \"q\"\nrun = \"2\"\nminus = \"1\"\nstated = \"1\"\n\
                 measure = \"{measure}\"\npower_of = \"{power_of}\"\n"
            );
            Pipeline::unchecked(&text).unwrap().checked(2, &|_| Ok(Vec::new())).err()
        };
        let (summary, log) = ("event_count", "coefficient_ratio");
        assert_eq!(refused(summary, summary), None);
        assert!(
            refused(log, summary).unwrap().contains("measure = \"coefficient_ratio\" of a run over axes")
        );
        assert!(
            refused(summary, log).unwrap().contains("power_of = \"coefficient_ratio\" of a run over axes")
        );
    }

    #[test]
    fn numbers_that_are_not_there_are_refused_with_the_line() {
        let text = "title = \"t\"\n[[claim]]\nabout = \"a\"\nquote = \"q\"\nrun = \"r\"\nmeasure = \"event_conut\"\n";
        let refused = Pipeline::parse(text).unwrap_err();
        assert!(refused.contains("line 6") && refused.contains("did you mean event_count?"), "{refused}");
    }
}
