//! A study as its file has it.

use std::collections::BTreeSet;

use asperity_figures::draw::Figures;
use asperity_figures::keys::Explained;
use asperity_model::scenario::text::Lines;
use asperity_model::scenario::typed;
use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::claims::ClaimSpec;
use asperity_numbers::precursors::PrecursorRules;
use asperity_record::bounds::check_toml;
use schemars::{JsonSchema, schema_for};
use serde::{Deserialize, Serialize};

use crate::axis::Written;
use crate::each;
use crate::parameter_table;
use crate::runs::{RunSpec, SpellOut, check_name};

/// Where all kinds of figures and all keys of a study are listed.
const LISTED_IN: &str = "asperity figures and docs/studies.md";

/// What is stored of each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// Its slip events.
    Events,
    /// Its ruptures.
    Ruptures,
    /// Its summary; always stored.
    Summary,
    /// Its run log, a file of its own.
    Log,
    /// Its run log, if the run fails.
    LogOfFailed,
}

impl Pipeline {
    /// The tables of its file that are about named runs.
    pub fn explained() -> [Explained; 4] {
        let root = schema_for!(Pipeline).to_value();
        ["run", "precursors", "study", "claim"]
            .map(|name| Explained::of_list(&format!("[[{name}]]"), &root, &root["properties"][name]))
    }
}

impl Keep {
    fn all_but_logs() -> Vec<Keep> {
        vec![Keep::Events, Keep::Ruptures, Keep::Summary]
    }
}

/// A study, as its file has it: its runs, and tables, figures and claims of those that have names.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pipeline {
    /// What it is about, for headings.
    pub title: String,
    /// The names of its runs.
    #[serde(skip)]
    pub runs: Vec<String>,
    /// The scenario that its axes vary.
    pub(crate) scenario: Option<String>,
    /// Overrides of all its runs, `key=value`; those of a run come after them.
    #[serde(default)]
    pub(crate) set: Vec<String>,
    /// What is stored of each run over the axes.
    #[serde(default = "Keep::all_but_logs")]
    pub(crate) keep: Vec<Keep>,
    /// What varies.
    #[serde(default)]
    #[schemars(with = "Vec<serde_json::Value>")]
    pub(crate) axis: Vec<Written>,
    /// The runs that have names.
    #[serde(default)]
    pub(crate) run: Vec<RunSpec>,
    /// The file of the figure that its page begins with; by default the first by its name.
    pub main_figure: Option<String>,
    /// The figures, by kind.
    #[serde(default)]
    pub figure: Figures,
    /// Runs whose first global slips are set side by side in a table.
    #[serde(default)]
    pub first_global_slips: Vec<String>,
    /// Runs of which a table gives the slow slip behind each rupture.
    #[serde(default)]
    pub slow_slip: Vec<String>,
    /// The precursor tables, one per run and length law.
    #[serde(default)]
    pub precursors: Vec<PrecursorSpec>,
    /// The tables of numbers against a parameter.
    #[serde(default)]
    pub study: Vec<parameter_table::Study>,
    /// The claims.
    #[serde(default)]
    pub claim: Vec<ClaimSpec>,
}

impl Pipeline {
    /// Reads the text of a study, without checking what it speaks of.
    pub(crate) fn unchecked(text: &str) -> Result<Pipeline, String> {
        check_toml(text).map_err(|too_long| too_long.to_string())?;
        let mut file: Pipeline =
            typed::parse_prepared(text, LISTED_IN, each::write_out).map_err(|(at, problem)| {
                let place = Lines::of(text).place(text, at);
                let (line, column) = place.split_once(':').unwrap_or((&place, "1"));
                format!("line {line}, column {column}: {problem}")
            })?;
        let mut spell_out = SpellOut::new();
        file.run = spell_out.runs(&file.set, std::mem::take(&mut file.run))?;
        let mut names = BTreeSet::new();
        for run in &file.run {
            if !names.insert(run.name.as_str()) {
                return Err(format!(
                    "two runs are called {} (accepted: a name of its own for each)",
                    run.name
                ));
            }
            check_name(&run.name)?;
        }
        file.runs = file.run.iter().map(|run| run.name.clone()).collect();
        let lists = (file.claim.iter_mut().flat_map(ClaimSpec::lists_mut))
            .chain(file.study.iter_mut().map(|study| &mut study.runs))
            .chain(file.figure.lists_mut())
            .chain([&mut file.first_global_slips, &mut file.slow_slip]);
        for names in lists {
            spell_out.names(&file.runs, names)?;
        }
        Ok(file)
    }
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
