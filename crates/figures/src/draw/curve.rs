//! Figures that say nothing but the curves of runs: these are computed by `asperity_numbers::curve`, and here
//! are their keys in a pipeline and their look.

use asperity_numbers::curve::{Curve, CurveKeys, NamedCurves, Role};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use plotters::prelude::RGBColor;
use serde::{Deserialize, Deserializer, de};

use super::kind::{Figure, Labelled, Parts, find, keys, level_look};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Layout, Panel, Pen, RED, Shape, Sheet};

keys! {
    CurveFigure;

    /// The curves, by their [name](outputs.md#curves).
    #[serde(deserialize_with = "named")]
    #[schemars(with = "String")]
    pub(super) curve: &'static NamedCurves,
    /// Keys of the curves.
    #[serde(default)]
    keys: CurveKeys,
    /// The run, where it is one.
    run: Option<String>,
    /// In place of `run` several, each with its label in the legend.
    #[serde(default)]
    series: Vec<Labelled>,
}

fn named<'de, D: Deserializer<'de>>(name: D) -> Result<&'static NamedCurves, D::Error> {
    NamedCurves::find(&String::deserialize(name)?).map_err(de::Error::custom)
}

impl Figure for CurveFigure {
    /// What the axis across is called, and the curves.
    type Part = (&'static str, Vec<Curve>);

    fn runs(&self) -> Vec<&str> {
        self.series.iter().map(|of| &of.run).chain(&self.run).map(String::as_str).collect()
    }

    fn check(&self) -> Result<(), String> {
        let CurveKeys { blocks, at_blocks, from_s, to_s, before, after } = &self.keys;
        let given = [
            ("blocks", blocks.is_some()),
            ("at_blocks", !at_blocks.is_empty()),
            ("from_s", from_s.is_some()),
            ("to_s", to_s.is_some()),
            ("before", before.is_some()),
            ("after", after.is_some()),
        ];
        let NamedCurves { name, keys, .. } = self.curve;
        match given.into_iter().find(|(key, is_given)| *is_given && !keys.contains(key)) {
            Some((key, _)) => {
                let accepted = if keys.is_empty() { "none".to_owned() } else { keys.join(", ") };
                Err(format!("keys.{key}: curves {name} have no such key (accepted: {accepted})"))
            }
            None => Ok(()),
        }
    }

    fn required_data(&self) -> RequiredData {
        self.curve.required_data(&self.keys)
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        Ok((self.curve.across(run), self.curve.of(run, &self.keys)?))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let NamedCurves { y, mut x, .. } = *self.curve;
        let labels = self.series.iter().map(|of| of.label.as_str()).chain([""]);
        let mut panels: Vec<Vec<Layer>> = vec![Vec::new(); y.len()];
        for (n, (label, run)) in labels.zip(self.runs()).enumerate() {
            let (across, curves) = find(&parts, run)?;
            x = across;
            let mut measured = vec![0; y.len()];
            for curve in curves {
                let layers = &mut panels[curve.axis];
                let is_of_run = curve.label.is_empty();
                if !is_of_run && layers.iter().any(|layer| layer.label == curve.label) {
                    continue;
                }
                // Several curves of one run differ as those of several runs.
                let place = if is_of_run { n } else { measured[curve.axis] };
                measured[curve.axis] += usize::from(curve.role == Role::Measured);
                let is_labelled = is_of_run && curve.axis == 0 && curve.role != Role::Guide;
                let label = if is_labelled { label } else { &curve.label };
                layers.push(layer(self.curve.name, curve, Pen::nth(place, label)));
            }
        }
        let points = panels.iter().flatten().flat_map(Layer::points);
        let across = Scale::tight(x).fitted(points.map(|point| point.0));
        let last = y.len() - 1;
        let panel = |(n, (mut layers, y)): (usize, (Vec<Layer>, &&str))| {
            layers.sort_by_key(|layer| layer.shape == Shape::Remark);
            let x = if n == last { across.clone() } else { across.clone().unlabelled() };
            Panel::new(x, Scale::free(y), layers)
        };
        let panels = panels.into_iter().zip(y).enumerate().map(panel).collect();
        let layout = if last > 0 { Layout::Stacked } else { Layout::Columns };
        Ok(Sheet { layout, ..Sheet::of(panels) })
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
