//! Figures that say nothing but the curves of runs: these are computed by `asperity_numbers::curve`, and here
//! are their keys in a pipeline and their look.

use asperity_numbers::curve::{Curve, CurveKeys, NamedCurves, Role};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::YEAR_S;
use plotters::prelude::RGBColor;
use serde::{Deserialize, Deserializer, de};
use serde_json::{Map, Value};

use super::kind::{Figure, Labelled, keys, level_look, not_both, one_or_several, overlaid};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Layout, Panel, Pen, RED, Shape, Sheet};
use crate::spec::{Measured, MeasuredFile};

keys! {
    CurveFigure;

    /// The curves, by their name.
    #[serde(deserialize_with = "named")]
    #[schemars(with = "String")]
    pub(super) curve: &'static NamedCurves,
    /// Keys of the curves.
    #[serde(default)]
    #[schemars(with = "CurveKeys")]
    keys: Map<String, Value>,
    /// The run, where it is one.
    run: Option<String>,
    /// In place of `run` several, each with its label in the legend.
    #[serde(default)]
    series: Vec<Labelled>,
    /// A CSV file of points to compare with the upper quantity, drawn as diamonds with bars of errors: columns `x` and `y`,
    /// or called as the axes are, time in years, each optionally with a column NAME_error. Its path is relative to this
    /// file.
    pub(super) measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    measured_label: Option<String>,
}

fn named<'de, D: Deserializer<'de>>(name: D) -> Result<&'static NamedCurves, D::Error> {
    NamedCurves::find(&String::deserialize(name)?).map_err(de::Error::custom)
}

impl CurveFigure {
    fn keys(&self) -> Result<CurveKeys, String> {
        self.curve.read_keys(&self.keys).map_err(|problem| format!("keys.{problem}"))
    }
}

impl Figure for CurveFigure {
    fn runs(&self) -> Vec<(&str, Pen<'_>)> {
        one_or_several(&self.run, &self.series)
    }

    fn check(&self) -> Result<(), String> {
        not_both(&self.run, &self.series)?;
        self.keys().map(drop)
    }

    fn measured(&self) -> Result<Option<Measured>, String> {
        let (x, y) = (self.curve.x.replace("t (s)", "t (years)"), self.curve.y[0]);
        let axes = [(["x", &x], false), (["y", y], LOGARITHMIC.contains(&y))];
        let (keys, unit_s) = (self.keys()?, if x == self.curve.x { 1.0 } else { YEAR_S });
        let mut measured = MeasuredFile::points(&self.measured, &self.measured_label, axes)?;
        let is_shown = |[x, _]: &[[f64; 2]; 2]| keys.is_from_to(x[0] * unit_s);
        measured.iter_mut().for_each(|measured| measured.points.retain(is_shown));
        Ok(measured)
    }

    fn required_data(&self) -> RequiredData {
        self.keys().map_or(RequiredData::NOTHING, |keys| self.curve.required_data(&keys))
    }

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let (&NamedCurves { name, y, .. }, keys) = (self.curve, self.keys()?);
        let mut panels: Vec<Vec<Layer>> = vec![Vec::new(); y.len()];
        let mut measured = vec![0; y.len()];
        for curve in self.curve.of(run, &keys)? {
            let is_labelled = curve.label.is_empty() && curve.axis == 0 && curve.role != Role::Guide;
            let label = if is_labelled { pen.label } else { &curve.label };
            // Several curves of one run differ as those of several runs.
            let pen =
                if self.series.len() > 1 { pen.called(label) } else { Pen::nth(measured[curve.axis], label) };
            measured[curve.axis] += usize::from(curve.role == Role::Measured);
            panels[curve.axis].push(layer(name, &curve, pen));
        }
        let across = self.curve.across(run, &keys);
        let x = match across {
            "v (m/s)" => Scale::free_powers(across),
            _ => Scale::tight(across).in_powers(name == "front-transient"),
        };
        let upwards = |y: &str| match y {
            "depth (km)" => Scale::tight(y).downwards(true),
            _ => Scale::free(y).in_powers(LOGARITHMIC.contains(&y)),
        };
        let panel = |(layers, y): (_, &&str)| Panel::new(x.clone(), upwards(y), layers);
        Ok(Sheet::of(panels.into_iter().zip(y).map(panel).collect()))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let mut sheet = overlaid(parts);
        let layers = sheet.panels.iter().flat_map(|panel| &panel.layers);
        let across = sheet.panels[0].x.fitted(layers.flat_map(Layer::points).map(|point| point.0));
        let last = sheet.panels.len() - 1;
        for panel in &mut sheet.panels {
            panel.layers.sort_by_key(|layer| layer.shape == Shape::Remark);
            panel.x = across.clone();
        }
        // More than two stand in columns.
        if last == 1 {
            sheet.panels[0].x.label.clear();
        }
        let layout = if last == 1 { Layout::Stacked } else { Layout::Columns };
        Ok(Sheet { layout, ..sheet })
    }
}

/// Quantities upwards that vary over powers of ten.
const LOGARITHMIC: [&str; 3] = ["largest velocity (m/s)", "slip rate (m/s)", "state θ (s)"];

/// Looks that are not those of the role: kind, beginning of the label, dash and colour.
const LOOKS: [(&str, &str, Dash, RGBColor); 10] = [
    ("slip-profiles", "slow", Dash::Solid, BLUE),
    ("slip-profiles", "in events", Dash::Solid, RED),
    ("loads", "F_N", Dash::Dashed, BLUE),
    ("loads", "F_T", Dash::Solid, RED),
    ("forces", "F_N", Dash::Solid, GREY),
    ("forces", "F_T", Dash::Solid, INK),
    ("friction", "steady", Dash::Dashed, INK),
    ("slipped", "F_T/F_N", Dash::Dashed, GREY),
    ("junction-forces", "μ_s", Dash::Dashed, GREY),
    ("junction-forces", "μ_d", Dash::DotDashed, GREY),
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

#[cfg(test)]
mod tests {
    use super::{CurveFigure, Figure, Panel, Pen};
    use asperity_numbers::run_data::RunData;
    use asperity_record::FieldRecord;
    use asperity_testkit::made_up::{self, EVENTS};

    const LAW: &str = "friction.law = \"junctions\"\nfriction.dynamic_coefficient = 0.2";

    fn figure(keys: &str) -> CurveFigure {
        toml::from_str(&format!("file = 'f.png'\nrun = 'a'\ncurve = 'junction-forces'\n{keys}")).unwrap()
    }

    fn panels(figure: &CurveFigure, run: &RunData) -> Result<Vec<Panel>, String> {
        let run = RunData { kept: figure.required_data(), ..run.clone() };
        Ok(figure.sheet(vec![figure.part(&run, Pen::nth(0, ""))?])?.panels)
    }

    #[test]
    fn each_instant_has_a_line_with_gaps_where_no_junction_is_pinned() {
        let mut run = made_up::run(LAW, &EVENTS);
        let state = |step: u64, slipping: u32| FieldRecord {
            step,
            time_s: run.plan.grid.time_s(step),
            junctions_slipping: vec![0, slipping, 3],
            pinned_mean_ratio: vec![0.1, 0.2, 0.3],
            pinned_width_ratio: vec![0.05, 0.06, step as f64],
            ..FieldRecord::default()
        };
        let states = [state(0, 0), state(510, 100), state(700, 7)];
        let figure = figure("keys = { at_s = [0.0, 1.0, 2.0], after_slips = true }");
        run.kept = figure.required_data();
        made_up::with_states(&mut run, &states);
        // The first global slip ends in step 510; no precursor has five blocks. Two instants share the last state.
        let panels = panels(&figure, &run).unwrap();
        let [upper, lower] = &panels[..] else { panic!("two panels") };
        let labels: Vec<&str> = upper.layers.iter().map(|series| series.label.as_str()).collect();
        assert_eq!(labels, ["μ_s", "μ_d", "t = 0.0000 s", "t = 0.0001 s", "t = 0.0001 s"]);
        assert_eq!(upper.layers[2].points(), [(0.0, 0.1), (50.0, 0.2), (100.0, 0.3)]);
        assert!(upper.layers[3].points()[1].1.is_nan() && upper.layers[3].points()[2].1 == 0.3);
        assert_eq!((lower.layers[0].points()[0].1, lower.layers[3].points()[2].1), (0.05, 700.0));
    }

    #[test]
    fn runs_without_junctions_or_states_of_them_are_refused() {
        let figure: CurveFigure =
            toml::from_str("file = 'f.png'\nrun = 'a'\ncurve = 'junction-forces'\nkeys.at_s = [0.0]")
                .unwrap();
        for (toml, why) in [
            ("", "run test has no junctions (accepted: friction.law = \"junctions\")"),
            (LAW, "run test has no states with junctions at these instants"),
        ] {
            assert_eq!(panels(&figure, &made_up::run(toml, &EVENTS)).unwrap_err(), why);
        }
    }
}
