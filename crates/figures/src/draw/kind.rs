//! What the kinds of figures have in common.

use asperity_numbers::curve::Role;
use asperity_numbers::curve_list;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Load, NotKept, RunData};
use plotters::prelude::RGBColor;
use schemars::JsonSchema;
use serde::Deserialize;

use super::sheet::{BLUE, Dash, GREY, Layer, Pen, Point, RED, Shape, Sheet};
use crate::spec::Measured;

/// A kind of figure. It takes its part of every run as runs go by, one after the other, and is drawn
/// from these parts once it has all.
pub(super) trait Figure: Framed + Sync {
    /// The runs it is made of, each with the pen that draws it.
    fn runs(&self) -> Vec<(&str, Pen<'_>)>;

    /// What it reads of a run beside slip events, ruptures and switches.
    fn required_data(&self) -> RequiredData {
        RequiredData::NOTHING
    }

    /// Points to compare with; in words, what is not accepted of them.
    fn measured(&self) -> Result<Option<Measured>, String> {
        Ok(None)
    }

    /// Checks its other keys; in words, what is not accepted.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Its part of a run, the points that it shows and no more; in words, what the run lacks.
    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String>;

    /// What is on it, made of the parts of all its runs in their order; in words, what they lack.
    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        Ok(overlaid(parts))
    }

    /// The same with measured points, its width, and its title or, without one, that of what is on it.
    fn sheet(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let sheet = self.together(parts)?.with_measured(self.measured()?.as_ref());
        let Frame { title, width_mm, .. } = self.frame();
        let title = if title.is_empty() { sheet.title } else { title.to_owned() };
        Ok(Sheet { title, width_mm, ..sheet })
    }
}

/// Sheets one upon the other, panel upon panel, with surfaces behind; what several show alike is drawn once.
pub(super) fn overlaid(parts: Vec<Sheet>) -> Sheet {
    upon_each_other(parts, |layers, layer| {
        if !layers.contains(&layer) {
            layers.push(layer);
            layers.sort_by_key(|layer| !matches!(layer.shape, Shape::Surface(..)));
        }
    })
}

/// Sheets one upon the other, in which lines and marks of one label and colour are one, as of runs that belong
/// together; lines from left to right.
pub(super) fn joined(parts: Vec<Sheet>) -> Sheet {
    upon_each_other(parts, |layers, layer| {
        let alike = layers.iter_mut().filter(|of| of.label == layer.label && of.colour == layer.colour);
        for known in alike {
            match (&mut known.shape, &layer.shape) {
                (Shape::Line(points, _), Shape::Line(more, _)) => {
                    if points != more {
                        points.extend(more);
                        points.sort_by(|a, b| a.0.total_cmp(&b.0));
                    }
                    return;
                }
                (Shape::Marks(points, _), Shape::Marks(more, _)) => return points.extend(more),
                _ => {}
            }
        }
        layers.push(layer);
    })
}

fn upon_each_other(parts: Vec<Sheet>, add: impl Fn(&mut Vec<Layer>, Layer)) -> Sheet {
    let upon = |mut whole: Sheet, part: Sheet| {
        for (panel, of_part) in whole.panels.iter_mut().zip(part.panels) {
            of_part.layers.into_iter().for_each(|layer| add(&mut panel.layers, layer));
        }
        whole
    };
    parts.into_iter().reduce(upon).unwrap_or_else(|| Sheet::of(Vec::new()))
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

/// In a [`Figure`] with the key `run`: its only run, and what it reads of it, if this needs no key.
macro_rules! of_one_run {
    ($($required_data:expr)?) => {
        fn runs(&self) -> Vec<(&str, $crate::draw::sheet::Pen<'_>)> {
            vec![(&self.run, $crate::draw::sheet::Pen::nth(0, ""))]
        }

        $(fn required_data(&self) -> RequiredData {
            $required_data
        })?
    };
}

/// In a [`Figure`] with a list of series or panels: its runs are those of the list, and those of one entry have one
/// pen; and what it reads of them.
macro_rules! of_runs_in {
    ($list:ident $(, $required_data:expr)?) => {
        fn runs(&self) -> Vec<(&str, $crate::draw::sheet::Pen<'_>)> {
            let pen = $crate::draw::sheet::Pen::nth;
            let all = self.$list.iter().enumerate();
            all.flat_map(|(n, of)| of.runs().map(move |run| (run, pen(n, &of.label)))).collect()
        }

        $(fn required_data(&self) -> RequiredData {
            $required_data
        })?
    };
}

pub(super) use {keys, of_one_run, of_runs_in};

/// The default of a key.
pub(super) fn number<const N: u32>() -> u32 {
    N
}

/// A run and what the legend calls it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Labelled {
    /// The run.
    pub(super) run: String,
    /// Label in the legend; `k_t` and `k_{t}` set subscripts.
    pub(super) label: String,
}

/// The runs of a figure of one run or, in place of it, of several.
pub(super) fn one_or_several<'a>(run: &'a Option<String>, series: &'a [Labelled]) -> Vec<(&'a str, Pen<'a>)> {
    let series = series.iter().enumerate().map(|(n, of)| (of.run.as_str(), Pen::nth(n, &of.label)));
    series.chain(run.as_deref().map(|run| (run, Pen::nth(0, "")))).collect()
}

/// Refuses both, one run and several.
pub(super) fn not_both(run: &Option<String>, series: &[Labelled]) -> Result<(), String> {
    let refused = "it has both run and series (accepted: one of them)";
    if run.is_some() && !series.is_empty() { Err(refused.to_owned()) } else { Ok(()) }
}

impl Labelled {
    pub(super) fn runs(&self) -> impl Iterator<Item = &str> {
        std::iter::once(self.run.as_str())
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

/// What the wave speed is called that front speeds are compared with: where there are shear waves, theirs.
pub(super) fn wave_speed_name(run: &RunData) -> &'static str {
    if run.plan.elastic.longitudinal_over_shear().is_some() { "c_S" } else { "c" }
}

/// What places along the slider are called on an axis: columns of contacts over an area.
pub(super) fn place_name(run: &RunData) -> &'static str {
    match run.of_one_row() {
        Some(run) if run.is_measured() => "sensor j",
        Some(_) => "block n",
        None => "column i",
    }
}

/// What the load of a run is called on an axis: of a recording without normal force, which counts as 1 N, `F_T` alone.
///
/// # Errors
/// In words, of a recording without any force, and if loads were not kept.
pub(super) fn load_name(run: &RunData) -> Result<&'static str, String> {
    let all = |is: fn(&Load) -> bool| Ok::<_, NotKept>(run.is_measured() && run.loads()?.iter().all(is));
    if all(|load| load.driving_force_n == 0.0)? {
        return Err(format!("run {} has no forces", run.name));
    }
    Ok(if all(|load| load.normal_load_n == 1.0)? { "F_T (N)" } else { "F_T/F_N" })
}

/// How lines look that are not measured.
pub(super) fn level_look(role: Role) -> (Dash, RGBColor) {
    match role {
        Role::Sliding => (Dash::DotDashed, RED),
        Role::Guide => (Dash::Dotted, GREY),
        _ => (Dash::Dashed, BLUE),
    }
}

/// The lines of the levels of friction over load that the law of a run has, the two coefficients or `f_0`.
pub(super) fn levels(run: &RunData, line: impl Fn(f64) -> Vec<Point>) -> Vec<Layer> {
    let layer = |(level, role, label)| {
        let (dash, colour) = level_look(role);
        Layer::line(label, line(level), dash, colour)
    };
    curve_list::levels(run).into_iter().map(layer).collect()
}
