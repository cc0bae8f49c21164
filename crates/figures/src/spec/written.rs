//! Figures as a sweep writes them. The comments on the keys are what `docs/figures.md` says of them.

use asperity_model::analytic::LengthLaw;
use asperity_numbers::quantile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::measured::{Measured, MeasuredFile};

/// The figures of a sweep, by kind.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// A number of the summary as colour over two keys that vary. A place without the number is
    /// empty; one whose runs all failed, or are not made, is crossed out. The axes are labelled at values
    /// that were run.
    #[serde(default, rename = "phase-map")]
    pub phase_map: Vec<PhaseMap>,
    /// Curves of a number against a key that varies or another number, a curve for every value of
    /// `colour`. A run without the number leaves a gap.
    #[serde(default)]
    pub family: Vec<Family>,
    /// L_p/L of precursors against F_T/F_N at their onset, with the length law: for named runs,
    /// `series`, by their slip events; without `series`, for all runs over the axes, by the ruptures
    /// that the study keeps.
    #[serde(default)]
    pub lengths: Vec<Lengths>,
}

impl Figures {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.files().next().is_none()
    }

    /// The files of its figures.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        let maps = self.phase_map.iter().map(PhaseMap::common);
        let others = self.family.iter().map(Family::common).chain(self.lengths.iter().map(Lengths::common));
        maps.chain(others).map(|of| of.file)
    }
}

/// What all kinds say of themselves.
pub(super) struct Common<'a> {
    pub(super) kind: &'static str,
    pub(super) file: &'a str,
    pub(super) title: &'a str,
    pub(super) width_mm: Option<f64>,
    /// Label and scale of the colours.
    pub(super) colours: (&'a Option<String>, Option<Scale>),
    pub(super) facet: Option<&'a str>,
    pub(super) over: &'a [String],
    pub(super) at: &'a [String],
}

/// Declares a kind with the keys that all have, of which the comments on some are its own.
macro_rules! kind {
    (
        $(#[$about:meta])* $kind:ident $name:literal;
        $(#[$over:meta])* over;
        $(#[$scale:meta])* colour_scale;
        $($own:tt)*
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $kind {
            /// Name of the file in the folder `figures` of the study, ending in `.png`.
            pub file: String,
            /// Title above the figure.
            #[serde(default)]
            pub title: String,
            /// Width on paper, 40 to 400 mm.
            #[serde(default)]
            pub width_mm: Option<f64>,
            /// A key with a panel for each of its values.
            pub facet: Option<String>,
            $(#[$over])*
            #[serde(default)]
            pub over: Vec<String>,
            /// Values of keys, such as `slider.blocks=100`: other runs are not shown.
            #[serde(default)]
            pub at: Vec<String>,
            /// Label of the colours; by default symbol and unit.
            pub colour_label: Option<String>,
            $(#[$scale])*
            pub colour_scale: Option<Scale>,
            $($own)*
        }

        impl $kind {
            pub(super) fn common(&self) -> Common<'_> {
                let $kind { file, title, width_mm, colour_label, over, at, .. } = self;
                let colours = (colour_label, self.colour_scale);
                let facet = self.facet.as_deref();
                Common { kind: $name, file, title, width_mm: *width_mm, colours, facet, over, at }
            }
        }
    };
}

kind! {
    /// One number of the runs over two keys that vary.
    PhaseMap "phase-map";
    /// Keys of axes whose runs share a place, such as seeds; the caption says how many runs a cell has.
    over;
    /// Scale of the colours; by default `linear`.
    colour_scale;
    /// The number of the summary that gives the colour; for a flag, yes is 1.
    pub colour: String,
    /// The key across.
    pub x: String,
    /// The key upwards.
    pub y: String,
    /// Statistic of the runs that share a place.
    #[serde(default)]
    pub statistic: Statistic,
    /// Label of the axis across, by default symbol and unit; `k_t` and `k_{t}` set subscripts.
    pub x_label: Option<String>,
    /// Label of the axis upwards; by default symbol and unit.
    pub y_label: Option<String>,
    /// Scale of the axis across; by default that of the sweep.
    pub x_scale: Option<Scale>,
    /// Scale of the axis upwards; by default that of the sweep.
    pub y_scale: Option<Scale>,
}

kind! {
    /// A number of the runs as a family of curves.
    Family "family";
    /// Keys of axes whose runs share a place, such as seeds. The curve is their median; the darker band
    /// lies between the quartiles, the lighter band between the extremes.
    over;
    /// Scale of the colours; by default that of the sweep.
    colour_scale;
    /// A key with a curve for each of its values.
    pub colour: Option<String>,
    /// The quantity across: a key that varies, or a number of the summary, which then has a mark for each
    /// run.
    pub x: String,
    /// The quantity upwards: a number of the summary.
    pub y: String,
    /// Whether to show the theory of `y` as a dashed line: for `first_global_rupture_ft_fn` the length
    /// law at L_p = L, for `first_global_rupture_onset_s` the load in time, for
    /// `front_speed_over_wave_speed_ratio` the steady front.
    #[serde(default)]
    pub theory: bool,
    /// A CSV file of measured points, drawn as diamonds with bars of errors: columns named as `x` and `y` or as their labels,
    /// each optionally with a column NAME_error. Its path is relative to this file.
    pub measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    pub measured_label: Option<String>,
    /// Label of the axis across, by default symbol and unit; `k_t` and `k_{t}` set subscripts.
    pub x_label: Option<String>,
    /// Label of the axis upwards; by default symbol and unit.
    pub y_label: Option<String>,
    /// Scale of the axis across; by default that of the sweep, or `linear`.
    pub x_scale: Option<Scale>,
    /// Scale of the axis upwards; by default `linear`.
    pub y_scale: Option<Scale>,
}

kind! {
    /// Precursor lengths against load.
    Lengths "lengths";
    /// Keys of axes whose runs belong together, such as seeds. Bands replace the marks: median, quartiles
    /// and extremes of the load at which precursors reach a length.
    over;
    /// Scale of the colours; by default that of the sweep's axis.
    colour_scale;
    /// A key with marks and a law of its own for each of its values.
    pub colour: Option<String>,
    /// The law drawn as a line; slabs, sheets and bodies have none. Without this key, `series` have no line, and runs over
    /// axes have the law that applies to each scenario; if runs of one colour have more than twelve laws,
    /// none is drawn.
    pub law: Option<LengthLaw>,
    /// A CSV file of measured points, drawn as diamonds with bars of errors: columns named `F_T/F_N` and `L_p/L`,
    /// each optionally with a column NAME_error. Its path is relative to this file.
    pub measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    pub measured_label: Option<String>,
    /// Named runs, each with its label in the legend.
    #[serde(default)]
    pub series: Vec<Labelled>,
}

/// A run and what the legend calls it; `k_t` and `k_{t}` set subscripts.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Labelled {
    /// The run.
    pub run: String,
    /// Label in the legend; `k_t` and `k_{t}` set subscripts.
    pub label: String,
}

impl Lengths {
    /// Whether it is made of single runs, and not of the tables of runs over axes.
    pub fn is_of_runs(&self) -> bool {
        !self.series.is_empty()
    }

    /// Its measured points, if it names any.
    ///
    /// # Errors
    /// In words, with file, line, column, value and what is accepted.
    pub fn measured(&self) -> Result<Option<Measured>, String> {
        let names = [["ft_fn_onset", "F_T/F_N"], ["length_ratio", "L_p/L"]];
        MeasuredFile::points(&self.measured, &self.measured_label, names.map(|names| (names, false)))
    }

    /// Checks that it is of runs with names, or of those over the axes.
    ///
    /// # Errors
    /// In words, with the keys and what is accepted.
    pub fn check(&self) -> Result<(), String> {
        let Common { colours: (colour_label, colour_scale), facet, over, at, .. } = self.common();
        let of_tables = [
            ("colour", self.colour.is_some()),
            ("facet", facet.is_some()),
            ("over", !over.is_empty()),
            ("at", !at.is_empty()),
            ("colour_label", colour_label.is_some()),
            ("colour_scale", colour_scale.is_some()),
        ];
        match of_tables.into_iter().find(|(_, given)| *given) {
            Some((key, _)) if self.is_of_runs() => Err(format!(
                "figure.lengths {:?}: series and {key} (accepted: series of runs with names, or {key} of the runs \
                 over axes)",
                self.file
            )),
            _ => Ok(()),
        }
    }
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
    pub fn word(self) -> &'static str {
        match self {
            Statistic::Median => "median",
            Statistic::Mean => "mean",
            Statistic::Smallest => "smallest",
            Statistic::Largest => "largest",
        }
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
