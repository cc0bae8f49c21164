//! What the kinds of figures have in common.

use std::any::Any;
use std::collections::BTreeMap;

use asperity_numbers::curve::Role;
use asperity_numbers::curve_list;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use plotters::prelude::RGBColor;
use schemars::JsonSchema;
use serde::Deserialize;

use super::sheet::{BLUE, Dash, GREY, Layer, Pen, RED, Sheet};

/// A kind of figure. It takes its part of every run as runs go by, one after the other, and is drawn
/// from these parts once it has all.
pub(super) trait Figure: Framed + Sync {
    /// What it takes of a run: the points that it shows, and no more.
    type Part: Send + 'static;

    /// The runs it is made of.
    fn runs(&self) -> Vec<&str>;

    /// What it reads of a run beside slip events, ruptures and switches.
    fn required_data(&self) -> RequiredData {
        RequiredData::NOTHING
    }

    /// Checks its keys; in words, what is not accepted.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Its part of a run; in words, what the run lacks.
    fn part(&self, run: &RunData) -> Result<Self::Part, String>;

    /// What is on it, made of the parts of all its runs; in words, what they lack. One without a title has that of the
    /// figure.
    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String>;
}

/// Parts by the name of their run.
pub(super) type Parts<P> = BTreeMap<String, P>;

/// A figure of whichever kind.
pub(super) trait AnyFigure: Framed + Sync {
    fn runs(&self) -> Vec<&str>;
    fn required_data(&self) -> RequiredData;
    fn check(&self) -> Result<(), String>;
    fn part(&self, run: &RunData) -> Result<AnyPart, String>;
    fn sheet(&self, parts: Parts<AnyPart>) -> Result<Sheet, String>;
}

/// A part of a figure of whichever kind.
pub(super) type AnyPart = Box<dyn Any + Send>;

impl<F: Figure> AnyFigure for F {
    fn runs(&self) -> Vec<&str> {
        Figure::runs(self)
    }

    fn required_data(&self) -> RequiredData {
        Figure::required_data(self)
    }

    fn check(&self) -> Result<(), String> {
        Figure::check(self)
    }

    fn part(&self, run: &RunData) -> Result<AnyPart, String> {
        Ok(Box::new(Figure::part(self, run)?))
    }

    fn sheet(&self, parts: Parts<AnyPart>) -> Result<Sheet, String> {
        let own = |part: AnyPart| *part.downcast().expect("a figure gets back the parts that it took");
        let sheet = Figure::sheet(self, parts.into_iter().map(|(run, part)| (run, own(part))).collect())?;
        let Frame { title, width_mm, .. } = self.frame();
        let title = if title.is_empty() { sheet.title } else { title.to_owned() };
        Ok(Sheet { title, width_mm, ..sheet })
    }
}

/// What all figures say of themselves.
pub(super) struct Frame<'a> {
    /// The file to write, without folder.
    pub(super) file: &'a str,
    /// Stands above it, if it is not empty.
    pub(super) title: &'a str,
    /// Its width on paper; by default as wide as its panels need.
    pub(super) width_mm: Option<f64>,
}

/// A figure with the keys that all have.
pub(super) trait Framed {
    fn frame(&self) -> Frame<'_>;
}

/// Declares a kind of figure by the keys that a pipeline gives: those of all figures, `run` or `series` where
/// named behind the kind, and those of its own, each with its comment.
macro_rules! keys {
    ($figure:ident: run; $($own:tt)*) => {
        $crate::draw::kind::keys! {
            $figure;
            /// The run.
            run: String,
            $($own)*
        }
    };
    ($figure:ident: series; $($own:tt)*) => {
        $crate::draw::kind::keys! {
            $figure;
            /// The runs, each with its label in the legend.
            series: Vec<$crate::draw::kind::Labelled>,
            $($own)*
        }
    };
    ($figure:ident; $($own:tt)*) => {
        #[derive(Debug, Clone, serde::Deserialize, schemars::JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub(crate) struct $figure {
            /// Name of the file in the folder `figures`, ending in `.png`.
            file: String,
            /// Title above the figure.
            #[serde(default)]
            title: String,
            /// Width on paper, 40 to 400 mm.
            #[serde(default)]
            width_mm: Option<f64>,
            $($own)*
        }

        impl $crate::draw::kind::Framed for $figure {
            fn frame(&self) -> $crate::draw::kind::Frame<'_> {
                let Self { file, title, width_mm, .. } = self;
                $crate::draw::kind::Frame { file, title, width_mm: *width_mm }
            }
        }
    };
}

/// In a [`Figure`] with the keys `file` and `run`: the part of its one run is all of it.
macro_rules! of_one_run {
    () => {
        type Part = $crate::draw::sheet::Sheet;

        fn runs(&self) -> Vec<&str> {
            vec![&self.run]
        }

        fn sheet(
            &self,
            parts: $crate::draw::kind::Parts<Self::Part>,
        ) -> Result<$crate::draw::sheet::Sheet, String> {
            $crate::draw::kind::find(&parts, &self.run).cloned()
        }
    };
}

/// In a [`Figure`] with the key `file` and a list of series or panels: its runs are those of the list,
/// and it takes a part of this type of each.
macro_rules! of_runs_in {
    ($list:ident, $part:ty) => {
        type Part = $part;

        fn runs(&self) -> Vec<&str> {
            self.$list.iter().flat_map(|labelled| labelled.runs()).collect()
        }
    };
}

pub(super) use {keys, of_one_run, of_runs_in};

/// A run and what the legend calls it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Labelled {
    /// The run.
    pub(super) run: String,
    /// Label in the legend; `k_t` and `k_{t}` set subscripts.
    pub(super) label: String,
}

impl Labelled {
    pub(super) fn runs(&self) -> [&str; 1] {
        [&self.run]
    }
}

/// Runs that belong together, and what the legend calls them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Group {
    /// Label in the legend; `k_t` and `k_{t}` set subscripts.
    pub(super) label: String,
    /// The runs.
    pub(super) runs: Vec<String>,
}

impl Group {
    pub(super) fn runs(&self) -> impl Iterator<Item = &str> {
        self.runs.iter().map(String::as_str)
    }
}

/// The runs of a figure's series, each with what the legend calls it and its part.
pub(super) fn with_parts<'a, P>(
    series: &'a [Labelled],
    parts: &'a Parts<P>,
) -> Result<Vec<(&'a str, &'a P)>, String> {
    series.iter().map(|labelled| Ok((labelled.label.as_str(), find(parts, &labelled.run)?))).collect()
}

/// The runs of a figure's series, each with the pen that draws it and its part.
pub(super) fn with_pens<'a, P>(
    series: &'a [Labelled],
    parts: &'a Parts<P>,
) -> Result<Vec<(Pen<'a>, &'a P)>, String> {
    let all = with_parts(series, parts)?.into_iter().enumerate();
    Ok(all.map(|(index, (label, part))| (Pen::nth(index, label), part)).collect())
}

/// What the wave speed is called that front speeds are compared with: where there are shear waves, theirs.
pub(super) fn wave_speed_name(run: &RunData) -> &'static str {
    if run.plan.elastic.longitudinal_over_shear().is_some() { "c_S" } else { "c" }
}

/// What places along the slider are called on an axis: columns of contacts over an area.
pub(super) fn place_name(run: &RunData) -> &'static str {
    if run.of_one_row().is_some() { "block n" } else { "column i" }
}

/// A level of friction over load, how its line looks, and what it is called.
pub(super) type Level = (f64, Dash, RGBColor, &'static str);

/// How lines look that are not measured.
pub(super) fn level_look(role: Role) -> (Dash, RGBColor) {
    match role {
        Role::Sliding => (Dash::DotDashed, RED),
        Role::Guide => (Dash::Dotted, GREY),
        _ => (Dash::Dashed, BLUE),
    }
}

/// Levels of friction over load that the law of a run has: the two coefficients, or `f_0`.
pub(super) fn levels(run: &RunData) -> Vec<Level> {
    let look = |(level, role, label)| {
        let (dash, colour) = level_look(role);
        (level, dash, colour, label)
    };
    curve_list::levels(run).into_iter().map(look).collect()
}

/// They as lines across a figure.
pub(super) fn coefficient_lines(run: &RunData, to_x: f64) -> Vec<Layer> {
    let line = |(mu, dash, color, label)| Layer::line(label, vec![(0.0, mu), (to_x, mu)], dash, color);
    levels(run).into_iter().map(line).collect()
}

/// The part of the run of this name.
pub(super) fn find<'a, P>(parts: &'a Parts<P>, name: &str) -> Result<&'a P, String> {
    parts.get(name).ok_or_else(|| format!("there is no run {name}"))
}
