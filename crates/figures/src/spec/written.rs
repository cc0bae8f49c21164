//! A figure of runs over axes as a study writes it. The comments on the keys are what `asperity figures` says of them.

use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::quantile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measured::MeasuredFile;

/// Columns across and upwards of the figures that show precursors one by one.
pub(super) const OF_PRECURSORS: [&str; 2] = ["ft_fn_onset", "length_ratio"];

/// A figure of the runs over axes: curves, a phase map, or lengths of precursors.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Family {
    /// Name of the file in the folder `figures` of the study, ending in `.png`.
    pub file: String,
    /// Title above the figure.
    #[serde(default)]
    pub title: String,
    /// Width on paper, 40 to 400 mm.
    #[serde(default)]
    pub width_mm: Option<f64>,
    /// The quantity across: a key that varies, or a number of the summary, which then has a mark for each
    /// run; for lengths of precursors `ft_fn_onset`.
    pub x: String,
    /// The quantity upwards: a number of the summary; a key that varies, for a phase map; or `length_ratio`, for
    /// lengths of precursors.
    pub y: String,
    /// A key with a curve, or with marks and a law, for each of its values; of a phase map the number of the summary
    /// that gives the colour, for a flag yes is 1.
    pub colour: Option<String>,
    /// A key with a panel for each of its values.
    pub facet: Option<String>,
    /// Keys of axes whose runs share a place, such as seeds. A curve is their median; the darker band
    /// lies between the quartiles, the lighter band between the extremes. Of lengths these are of the load at which
    /// precursors reach a length, in place of the marks; the caption of a phase map says how many runs a cell has.
    #[serde(default)]
    pub over: Vec<String>,
    /// Values of keys, such as `slider.blocks=100`: other runs are not shown.
    #[serde(default)]
    pub at: Vec<String>,
    /// Statistic of the runs that share a cell of a phase map; by default `median`.
    pub statistic: Option<Statistic>,
    /// Whether to show the theory of `y` as a dashed line: for `first_global_rupture_ft_fn` the length
    /// law at L_p = L, for `first_global_rupture_onset_s` the load in time, for
    /// `front_speed_over_wave_speed_ratio` the steady front.
    #[serde(default)]
    pub theory: bool,
    /// The law of lengths of precursors; slabs, sheets and bodies have none. Without this key it is the one that applies
    /// to each scenario; if runs of one colour have more than twelve laws, none is drawn.
    pub law: Option<LengthLaw>,
    /// A CSV file of measured points, drawn as diamonds with bars of errors: columns named as `x` and `y` or as their labels,
    /// each optionally with a column NAME_error. Its path is relative to this file.
    pub measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    pub measured_label: Option<String>,
    /// Label of the axis across, by default symbol and unit; `k_t` and `k_{t}` set subscripts.
    pub x_label: Option<String>,
    /// Label of the axis upwards; by default symbol and unit.
    pub y_label: Option<String>,
    /// Label of the colours; by default symbol and unit.
    pub colour_label: Option<String>,
    /// Scale of the axis across; by default that of the sweep, of a number `linear`.
    pub x_scale: Option<Scale>,
    /// Scale of the axis upwards; by default that of the sweep, of a number `linear`.
    pub y_scale: Option<Scale>,
    /// Scale of the colours; by default that of the sweep, of a number `linear`.
    pub colour_scale: Option<Scale>,
}

/// How an axis is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// Equal steps are equal differences.
    Linear,
    /// Equal steps are equal factors.
    Log,
}

/// One number for several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Statistic {
    /// The middle one.
    #[default]
    Median,
    /// Their mean.
    Mean,
    /// The smallest.
    Smallest,
    /// The largest.
    Largest,
}

impl Statistic {
    /// What it makes of numbers in ascending order; none of none.
    pub fn of(self, ascending: &[f64]) -> Option<f64> {
        let count = ascending.len();
        match self {
            Statistic::Median => quantile(ascending, 0.5),
            Statistic::Mean => (count > 0).then(|| ascending.iter().sum::<f64>() / count as f64),
            Statistic::Smallest => ascending.first().copied(),
            Statistic::Largest => ascending.last().copied(),
        }
    }

    /// What it is called.
    pub fn word(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// The number of runs per cell of a map, with the statistic shown, for a caption; `None` if no cell has
    /// several.
    pub fn of_runs_per_cell(self, counts: impl Iterator<Item = usize>) -> Option<String> {
        let (least, most) = counts
            .filter(|count| *count > 0)
            .fold((usize::MAX, 0), |(least, most), count| (least.min(count), most.max(count)));
        let runs = if least < most { format!("{least} to {most}") } else { most.to_string() };
        (most > 1).then(|| format!("{} of {runs} runs per cell", self.word()))
    }
}
