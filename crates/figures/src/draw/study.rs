//! One number per run against a parameter that the runs differ in; for several cases beside what the source states of
//! each: how far such a number is an outcome of the parameters, and how far it is one draw among many.

use asperity_numbers::Number;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Group, Parts, find, keys};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Panel, Pen, Point, RED, Sheet};

keys! {
    StudyFigure;

    /// The scenario key that the runs differ in, or a number of them.
    parameter: String,
    /// Label of the axis across.
    parameter_label: String,
    /// The number to measure.
    measure: Number,
    /// Label of the axis upwards.
    measure_label: String,
    /// Whether the parameter's axis is logarithmic, with a label at every decade.
    #[serde(default)]
    logarithmic: bool,
    /// Whether the axis upwards is logarithmic.
    #[serde(default)]
    logarithmic_measure: bool,
    /// Factor of the parameter on the axis, such as 1000 for millimetres.
    #[serde(default = "one")]
    parameter_factor: f64,
    /// Factor of the number on its axis, such as 1e6 for micrometres.
    #[serde(default = "one")]
    measure_factor: f64,
    /// A number of the same runs to draw beside it, as lines; those of the measured number are left out.
    theory: Option<Number>,
    /// What the legend calls these lines; by default they share the labels of the marks.
    theory_label: Option<String>,
    /// Runs that belong together.
    #[serde(default)]
    pub(super) series: Vec<Group>,
    /// In place of `series`, panels of the same axes, one for each case, with marks alone.
    #[serde(default)]
    panel: Vec<Case>,
}

/// Runs of one case.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Case {
    /// Title above the panel.
    label: String,
    /// The number that the source gives, as on the axis: a dashed line.
    stated: f64,
    /// Its runs, in one or several series.
    series: Vec<Group>,
}

fn one() -> f64 {
    1.0
}

fn scale(is_logarithmic: bool, label: &str) -> Scale {
    if is_logarithmic { Scale::free_powers(label) } else { Scale::free(label) }
}

/// The groups of a figure, each with the pen that draws it and the parts of its runs.
pub(super) fn groups<'a, P>(
    series: &'a [Group],
    parts: &'a Parts<P>,
) -> Result<Vec<(Pen<'a>, Vec<&'a P>)>, String> {
    let group = |(index, group): (usize, &'a Group)| {
        let runs = group.runs().map(|name| find(parts, name)).collect::<Result<_, _>>()?;
        Ok((Pen::nth(index, &group.label), runs))
    };
    series.iter().enumerate().map(group).collect()
}

/// The parameter of a run, its number and what theory says of it.
type Part = (f64, [Option<f64>; 2]);

/// A panel: its title, the number that the source gives, and the runs.
type Shown<'a> = (&'a str, Option<f64>, &'a [Group]);

impl StudyFigure {
    fn panels(&self) -> Vec<Shown<'_>> {
        let own = self.panel.iter().map(|case| (case.label.as_str(), Some(case.stated), &case.series[..]));
        own.chain((!self.series.is_empty()).then_some(("", None, &self.series[..]))).collect()
    }

    /// Its groups of runs.
    pub(super) fn groups_mut(&mut self) -> impl Iterator<Item = &mut Group> {
        self.series.iter_mut().chain(self.panel.iter_mut().flat_map(|case| &mut case.series))
    }

    /// Lines and marks of groups of runs.
    fn layers(&self, series: &[Group], parts: &Parts<Part>) -> Result<Vec<Layer>, String> {
        let mut drawn = Vec::new();
        for (index, (pen, runs)) in groups(series, parts)?.into_iter().enumerate() {
            // A run without such a number leaves a gap.
            let numbers = |n: usize| runs.iter().filter_map(move |(at, of)| Some((*at, of[n]?)));
            let points: Vec<Point> = numbers(0).collect();
            if self.theory.is_some() {
                let mut theory: Vec<Point> = numbers(1).collect();
                theory.sort_by(|a, b| a.0.total_cmp(&b.0));
                // A name for the lines of all series stands in the legend once.
                let of_first = self.theory_label.as_deref().map(|label| if index == 0 { label } else { "" });
                drawn.push(Pen::nth(index, of_first.unwrap_or(pen.label)).line(theory));
            } else if !self.measure.is_count() && self.panel.is_empty() {
                // Between whole numbers there is nothing that a line could show, nor between draws of one number.
                drawn.push(pen.line(points.clone()));
            }
            drawn.push(pen.marks(points));
        }
        Ok(drawn)
    }
}

impl Figure for StudyFigure {
    type Part = Part;

    fn runs(&self) -> Vec<&str> {
        self.panels().into_iter().flat_map(|(.., series)| series.iter().flat_map(Group::runs)).collect()
    }

    fn required_data(&self) -> RequiredData {
        let of_theory = self.theory.map_or(RequiredData::NOTHING, Number::required_data);
        let of_parameter = Number::find(&self.parameter).map_or(RequiredData::NOTHING, Number::required_data);
        self.measure.required_data() | of_theory | of_parameter
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let lacks = || format!("run {} has no {}", run.name, self.parameter);
        let at = match Number::find(&self.parameter) {
            Ok(number) => number.of(run, None).ok_or_else(lacks)?,
            Err(_) => run.parameter(&self.parameter)?,
        };
        let at = at * self.parameter_factor;
        if self.logarithmic && at <= 0.0 {
            return Err(format!(
                "{} of run {} is {at}: no place on a logarithmic axis",
                self.parameter, run.name
            ));
        }
        let of = |number: Number| {
            let value = number.of(run, None)? * self.measure_factor;
            Some(value).filter(|value| value.is_finite() && (!self.logarithmic_measure || *value > 0.0))
        };
        Ok((at, [of(self.measure), self.theory.and_then(of)]))
    }

    fn sheet(&self, parts: Parts<Part>) -> Result<Sheet, String> {
        let shown = self.panels();
        let drawn = shown.iter().map(|(.., series)| self.layers(series, &parts));
        let drawn = drawn.collect::<Result<Vec<Vec<Layer>>, String>>()?;
        let points = || drawn.iter().flatten().flat_map(Layer::points);
        if points().next().is_none() {
            return Err(format!("no run has a {}", self.measure.name()));
        }
        let mut x = scale(self.logarithmic, &self.parameter_label);
        let mut y =
            scale(self.logarithmic_measure, &self.measure_label).in_whole_numbers(self.measure.is_count());
        // All cases share their axes.
        if !self.panel.is_empty() {
            let stated = self.panel.iter().map(|case| case.stated);
            x = x.fitted(points().map(|at| at.0));
            y = y.fitted(points().map(|at| at.1).chain(stated));
        }
        let ends = x.ends();
        let panel = |((title, stated, _), drawn): (&Shown<'_>, Vec<Layer>)| {
            let across = |stated| vec![(ends.0, stated), (ends.1, stated)];
            let stated = stated.map(|stated| Layer::line("thesis", across(stated), Dash::Dashed, RED));
            Panel::new(x.clone(), y.clone(), stated.into_iter().chain(drawn).collect()).titled(*title)
        };
        Ok(Sheet::of(shown.iter().zip(drawn).map(panel).collect()))
    }
}
