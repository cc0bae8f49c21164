//! Figures that say nothing but the curves of runs: these are computed by `asperity_numbers::curve`, and here
//! are their keys in a pipeline and their look.

use asperity_numbers::curve::{Curve, CurveKeys, NamedCurves, Role};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use plotters::prelude::RGBColor;

use super::kind::{Figure, Framed, Parts, find, level_look};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Panel, Pen, RED, Sheet};

/// The figures of named curves: of one run, or of several in the order of their labels.
pub(crate) trait OfCurves: Framed + Sync {
    /// The curves.
    fn curves() -> &'static NamedCurves;

    /// Each run with what the legend calls it, where there may be several.
    fn labelled(&self) -> Vec<(Option<&str>, &str)>;

    fn keys(&self) -> CurveKeys;
}

/// Declares a figure of named curves, of one run or of several, with those of their keys that a pipeline may give.
macro_rules! of_curves {
    (@labelled $of:ident run) => { vec![(None, $of.run.as_str())] };
    (@labelled $of:ident series) => {
        $of.series.iter().map(|of| (Some(of.label.as_str()), of.run.as_str())).collect()
    };
    ($kind:ident: $runs:ident $name:literal { $($(#[$about:meta])* $key:ident: $type:ty),* $(,)? }) => {
        $crate::draw::kind::keys! {
            $kind: $runs;
            $($(#[$about])* #[serde(default)] $key: $type,)*
        }

        impl $crate::draw::curve::OfCurves for $kind {
            fn curves() -> &'static asperity_numbers::curve::NamedCurves {
                asperity_numbers::curve::NamedCurves::find($name).expect("a kind is of curves that there are")
            }

            fn labelled(&self) -> Vec<(Option<&str>, &str)> {
                $crate::draw::curve::of_curves!(@labelled self $runs)
            }

            fn keys(&self) -> asperity_numbers::curve::CurveKeys {
                asperity_numbers::curve::CurveKeys {
                    $($key: Clone::clone(&self.$key),)*
                    ..Default::default()
                }
            }
        }
    };
}

pub(super) use of_curves;

impl<F: OfCurves> Figure for F {
    /// What the axis across is called, and the curves.
    type Part = (&'static str, Vec<Curve>);

    fn runs(&self) -> Vec<&str> {
        self.labelled().into_iter().map(|(_, run)| run).collect()
    }

    fn required_data(&self) -> RequiredData {
        Self::curves().required_data(&self.keys())
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        Ok((Self::curves().across(run), Self::curves().of(run, &self.keys())?))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let NamedCurves { y, mut x, .. } = *Self::curves();
        let mut panels = vec![(Vec::new(), Vec::new()); y.len()];
        for (n, (of_run, run)) in self.labelled().into_iter().enumerate() {
            let (across, curves) = find(&parts, run)?;
            x = across;
            let mut measured = vec![0; y.len()];
            for curve in curves {
                let (layers, remarks): &mut (Vec<Layer>, Vec<Layer>) = &mut panels[curve.axis];
                let said = |layer: &Layer| !curve.label.is_empty() && layer.label == curve.label;
                if layers.iter().chain(remarks.iter()).any(said) {
                    continue;
                }
                // Several curves of one run differ as those of several runs.
                let place = of_run.map_or(measured[curve.axis], |_| n);
                measured[curve.axis] += usize::from(curve.role == Role::Measured);
                let is_of_run = curve.label.is_empty() && curve.axis == 0 && curve.role != Role::Guide;
                let label = of_run.filter(|_| is_of_run).unwrap_or(&curve.label);
                let layer = layer(Self::curves().name, curve, Pen::nth(place, label));
                if curve.role == Role::Remark { remarks } else { layers }.push(layer);
            }
        }
        let values = |of: fn(&(f64, f64)) -> f64| {
            let layers = panels.iter().flat_map(|(layers, _)| layers);
            layers.flat_map(|layer| layer.points()).map(|point| of(&point)).collect::<Vec<f64>>()
        };
        let across = Scale::tight(x).fitted(values(|point| point.0).into_iter());
        let last = y.len() - 1;
        let mut panels: Vec<Panel> = panels
            .into_iter()
            .zip(y)
            .enumerate()
            .map(|(n, ((layers, remarks), y))| {
                let x = if n == last { across.clone() } else { across.clone().unlabelled() };
                Panel::new(x, Scale::free(y), layers.into_iter().chain(remarks).collect())
            })
            .collect();
        let lower = panels.split_off(1).pop();
        let upper = panels.remove(0);
        Ok(match lower {
            Some(lower) => Sheet::stacked(upper, lower),
            None => Sheet::of(vec![upper]),
        })
    }
}

/// Looks that are not those of the role: kind, beginning of the label, dash and colour.
const LOOKS: [(&str, &str, Dash, RGBColor); 5] = [
    ("loads", "F_N", Dash::Dashed, BLUE),
    ("loads", "F_T", Dash::Solid, RED),
    ("forces", "F_N", Dash::Solid, GREY),
    ("forces", "F_T", Dash::Solid, INK),
    ("slipped", "F_T/F_N", Dash::Dashed, GREY),
];

/// A curve as a layer, drawn with a pen where its role has no look of its own.
fn layer(name: &str, curve: &Curve, pen: Pen) -> Layer {
    let points = curve.points.clone();
    let chosen = LOOKS.iter().find(|look| look.0 == name && curve.label.starts_with(look.1));
    match (curve.role, chosen) {
        (Role::Remark, _) => Layer::remark(&curve.label),
        (Role::Marked(every), _) => pen.marks(points.into_iter().step_by(every).collect()),
        (_, Some(&(.., dash, colour))) => Layer::line(pen.label, points, dash, colour),
        (Role::Measured | Role::Theory, None) => pen.line(points),
        (role, None) => {
            let (dash, colour) = level_look(role);
            Layer::line(pen.label, points, dash, colour)
        }
    }
}
