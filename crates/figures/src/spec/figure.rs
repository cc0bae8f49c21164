//! A figure as understood: what is drawn without asking for more than the tables of the study.

use asperity_model::Scenario;
use asperity_model::plan::Plan;
use asperity_model::theory::analytic::{LengthLaw, LengthLawParameters, LoadCurve};
use asperity_model::theory::front::Front;
use asperity_record::Cell;
use serde::{Deserialize, Serialize};

use super::measured::Measured;
use super::written::Statistic;

/// What is on an axis of a figure, or in its colours: a column of the table of runs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// The column.
    pub column: String,
    /// What the figure calls it, with its unit in parentheses.
    pub label: String,
    /// Whether equal steps are equal factors.
    pub log: bool,
    /// Whether it holds words rather than numbers.
    pub is_word: bool,
}

/// What sort of figure it is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Colours over two keys.
    PhaseMap {
        /// Statistic of the runs that share a place.
        statistic: Statistic,
        /// Whether both keys are of one axis, so that places are scattered.
        scattered: bool,
    },
    /// Curves.
    Family {
        /// Whether the points of one colour make a curve.
        joined: bool,
        /// Whether theory stands beside them.
        theory: bool,
    },
    /// What the numbers of a refined scenario are worth.
    #[default]
    Refinement,
    /// Precursor lengths against the load.
    Lengths {
        /// The law; none for the one that a scenario calls for.
        law: Option<LengthLaw>,
    },
}

/// The numbers of the summary that there is a theory of.
pub(super) const OF_THEORY: [&str; 3] =
    ["first_global_rupture_ft_fn", "first_global_rupture_onset_s", "front_speed_over_wave_speed_ratio"];

/// What theory says that a number of the summary is in a scenario; nothing where it does not apply.
pub(crate) fn theory(number: &str, scenario: &Scenario) -> Option<f64> {
    match number {
        "first_global_rupture_ft_fn" => LengthLaw::is_for(scenario)
            .then(|| LengthLaw::natural(scenario).load_ratio(&LengthLawParameters::of(scenario), 1.0)),
        "first_global_rupture_onset_s" => LoadCurve::of(scenario)?.time_to_dynamic_s(),
        _ => {
            let plan = Plan::new(scenario);
            Front::of(&plan, plan.blocks / 2)?.speed_over_c()
        }
    }
}

/// A figure whose names are all known.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Figure {
    /// Its kind.
    pub kind: Kind,
    /// The file, without folder.
    pub file: String,
    /// Stands above it; may be empty.
    pub title: String,
    /// Its width on paper; by default as wide as its panels need.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_mm: Option<f64>,
    /// What stands across.
    pub x: Quantity,
    /// What stands upwards.
    pub y: Quantity,
    /// What the colours say.
    pub colour: Option<Quantity>,
    /// What the panels differ in.
    pub facet: Option<Quantity>,
    /// Whether several runs may share a place.
    pub is_spread: bool,
    /// Keys and the one value of each that is shown.
    pub at: Vec<(String, Cell)>,
    /// Points that were measured elsewhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Measured>,
}

impl Figure {
    /// That of a refinement: what each number is worth.
    pub fn refinement() -> Figure {
        let quantity = |label: &str| Quantity { label: label.to_owned(), ..Quantity::default() };
        let (x, y) = (quantity("change over the larger value (%)"), quantity("what numbers are worth"));
        Figure { kind: Kind::Refinement, file: "refinement.png".to_owned(), x, y, ..Figure::default() }
    }
}
