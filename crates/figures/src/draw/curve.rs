//! Figures that say nothing but the curves of runs: these are computed by `asperity_numbers::curve`, and here
//! are their keys in a pipeline and their look.

use asperity_numbers::curve::{Curve, CurveKeys, NamedCurves, Role};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use plotters::prelude::RGBColor;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Deserializer, de};

use super::kind::{Figure, Frame, Framed, Labelled, Parts, keys, level_look, with_parts};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Panel, Pen, RED, Sheet};

keys! {
    Keys;

    /// The run.
    run: Option<String>,
    /// The runs, each with its label in the legend.
    #[serde(default)]
    series: Vec<Labelled>,
    /// The length of a precursor or a slip event; the nearest one is shown.
    blocks: Option<u32>,
    /// The blocks, counted from 1; over an area contacts, row by row.
    #[serde(default)]
    at_blocks: Vec<u32>,
    /// Start of the time axis; by default that of the run.
    from_s: Option<f64>,
    /// End of the time axis; by default that of the run.
    to_s: Option<f64>,
    /// Time shown before a pulse reaches a block, over `a / c`.
    before: Option<f64>,
    /// Time shown after a pulse reaches a block, over `a / c`.
    after: Option<f64>,
}

/// A figure of the curves at a place in the list, of one run.
pub(crate) type OfRun<const N: usize> = CurveFigure<N, false>;
/// Of several, in the order of their labels.
pub(crate) type OfSeries<const N: usize> = CurveFigure<N, true>;

/// A figure of the curves at a place in the list, of one run or of several.
#[derive(Debug, Clone)]
pub(crate) struct CurveFigure<const N: usize, const SEVERAL: bool> {
    file: String,
    title: String,
    width_mm: Option<f64>,
    runs: Vec<Labelled>,
    keys: CurveKeys,
}

impl<const N: usize, const SEVERAL: bool> CurveFigure<N, SEVERAL> {
    const CURVES: &'static NamedCurves = &NamedCurves::all()[N];
    const RUNS: &'static str = if SEVERAL { "series" } else { "run" };

    /// Whether a pipeline may give a key.
    fn has(key: &str) -> bool {
        ["file", "title", "width_mm", Self::RUNS].contains(&key) || Self::CURVES.keys.contains(&key)
    }
}

impl<'de, const N: usize, const SEVERAL: bool> Deserialize<'de> for CurveFigure<N, SEVERAL> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let Keys { file, title, width_mm, run, series, blocks, at_blocks, from_s, to_s, before, after } =
            Keys::deserialize(deserializer)?;
        let given = [
            ("run", run.is_some()),
            ("series", !series.is_empty()),
            ("blocks", blocks.is_some()),
            ("at_blocks", !at_blocks.is_empty()),
            ("from_s", from_s.is_some()),
            ("to_s", to_s.is_some()),
            ("before", before.is_some()),
            ("after", after.is_some()),
        ];
        if let Some((key, _)) = given.iter().find(|(key, is_given)| *is_given && !Self::has(key)) {
            let known: Vec<&str> = ["file", "title", "width_mm", Self::RUNS]
                .into_iter()
                .chain(Self::CURVES.keys.iter().copied())
                .collect();
            return Err(de::Error::custom(format!("unknown field `{key}`, expected one of {known:?}")));
        }
        let of_run = run.map(|run| Labelled { run, label: String::new() });
        let runs: Vec<Labelled> = of_run.into_iter().chain(series).collect();
        if runs.is_empty() {
            return Err(de::Error::missing_field(Self::RUNS));
        }
        let keys = CurveKeys { blocks, at_blocks, from_s, to_s, before, after };
        Ok(CurveFigure { file, title, width_mm, runs, keys })
    }
}

impl<const N: usize, const SEVERAL: bool> JsonSchema for CurveFigure<N, SEVERAL> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        Self::CURVES.name.into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = Keys::json_schema(generator);
        if let Some(properties) = schema.get_mut("properties").and_then(|of| of.as_object_mut()) {
            properties.retain(|key, _| Self::has(key));
        }
        schema.insert("required".to_owned(), serde_json::json!(["file", Self::RUNS]));
        schema
    }
}

impl<const N: usize, const SEVERAL: bool> Framed for CurveFigure<N, SEVERAL> {
    fn frame(&self) -> Frame<'_> {
        Frame { file: &self.file, title: &self.title, width_mm: self.width_mm }
    }
}

impl<const N: usize, const SEVERAL: bool> Figure for CurveFigure<N, SEVERAL> {
    /// What the axis across is called, and the curves.
    type Part = (&'static str, Vec<Curve>);

    fn runs(&self) -> Vec<&str> {
        self.runs.iter().flat_map(Labelled::runs).collect()
    }

    fn required_data(&self) -> RequiredData {
        Self::CURVES.required_data(&self.keys)
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        Ok((Self::CURVES.across(run), Self::CURVES.of(run, &self.keys)?))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let NamedCurves { y, mut x, .. } = *Self::CURVES;
        let mut panels = vec![(Vec::new(), Vec::new()); y.len()];
        for (n, (of_run, (across, curves))) in with_parts(&self.runs, &parts)?.into_iter().enumerate() {
            x = across;
            let mut measured = vec![0; y.len()];
            for curve in curves {
                let (layers, remarks): &mut (Vec<Layer>, Vec<Layer>) = &mut panels[curve.axis];
                let said = |layer: &Layer| !curve.label.is_empty() && layer.label == curve.label;
                if layers.iter().chain(remarks.iter()).any(said) {
                    continue;
                }
                // Several curves of one run differ as those of several runs.
                let place = if SEVERAL { n } else { measured[curve.axis] };
                measured[curve.axis] += usize::from(curve.role == Role::Measured);
                let is_of_run = curve.label.is_empty() && curve.axis == 0 && curve.role != Role::Guide;
                let label = if is_of_run { of_run } else { &curve.label };
                let layer = layer(Self::CURVES.name, curve, Pen::nth(place, label));
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
