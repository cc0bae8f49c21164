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
    const CURVES: &'static NamedCurves;

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
            const CURVES: &'static asperity_numbers::curve::NamedCurves =
                &asperity_numbers::curve::NamedCurves::all()[asperity_numbers::curve::place($name)];

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
        Self::CURVES.required_data(&self.keys())
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        Ok((Self::CURVES.across(run), Self::CURVES.of(run, &self.keys())?))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let NamedCurves { y, mut x, .. } = *Self::CURVES;
        let mut panels = vec![(Vec::new(), Vec::new()); y.len()];
        for (n, (of_run, run)) in self.labelled().into_iter().enumerate() {
            let (across, curves) = find(&parts, run)?;
            x = across;
            let mut measured = vec![0; y.len()];
            for curve in curves {
                let (layers, remarks): &mut (Vec<Layer>, Vec<Layer>) = &mut panels[curve.axis];
                let is_said = layers.iter().chain(remarks.iter()).any(|layer| layer.label == curve.label);
                if is_said && !curve.label.is_empty() && curve.role != Role::Measured {
                    continue;
                }
                // Several curves of one run differ as those of several runs.
                let place = of_run.map_or(measured[curve.axis], |_| n);
                measured[curve.axis] += usize::from(curve.role == Role::Measured);
                let is_of_run = curve.label.is_empty() && curve.axis == 0 && curve.role != Role::Guide;
                let label = of_run.filter(|_| is_of_run).unwrap_or(&curve.label);
                let layer = layer(Self::CURVES.name, curve, Pen::nth(place, label));
                if curve.role == Role::Remark { remarks } else { layers }.push(layer);
            }
        }
        let values = |of: fn(&(f64, f64)) -> f64| {
            let layers = panels.iter().flat_map(|(layers, _)| layers);
            layers.flat_map(|layer| layer.points()).map(|point| of(&point)).collect::<Vec<f64>>()
        };
        let is_log = LOGARITHMIC.contains(&Self::CURVES.name);
        let across = Scale::tight(x).in_powers(is_log).fitted(values(|point| point.0).into_iter());
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

/// Kinds with a logarithmic axis across.
const LOGARITHMIC: [&str; 1] = ["front-transient"];

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
    use super::{Figure, Panel, Parts};
    use crate::draw::JunctionForces;
    use asperity_numbers::run_data::RunData;
    use asperity_record::FieldRecord;
    use asperity_testkit::made_up::{self, EVENTS};

    const LAW: &str = "friction.law = \"junctions\"\nfriction.dynamic_coefficient = 0.2";

    fn panels(figure: &JunctionForces, run: &RunData) -> Result<Vec<Panel>, String> {
        let part = figure.part(&RunData { kept: figure.required_data(), ..run.clone() })?;
        Ok(figure.sheet(Parts::from([("a".to_owned(), part)]))?.panels)
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
        let figure: JunctionForces =
            toml::from_str("file = 'f.png'\nrun = 'a'\nat_s = [0.0, 1.0, 2.0]\nafter_slips = true").unwrap();
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
        let figure: JunctionForces = toml::from_str("file = 'f.png'\nrun = 'a'\nat_s = [0.0]").unwrap();
        for (toml, why) in [
            ("", "run test has no junctions (accepted: friction.law = \"junctions\")"),
            (LAW, "run test has no states with junctions at these instants"),
        ] {
            assert_eq!(panels(&figure, &made_up::run(toml, &EVENTS)).unwrap_err(), why);
        }
    }
}
