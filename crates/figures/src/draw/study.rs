//! One number per run against a parameter that the runs differ in; for several cases beside what the thesis states of
//! each: how far such a number is an outcome of the parameters, and how far it is one draw among many.

use asperity_numbers::Number;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Group, joined, keys};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Pen, RED, Sheet};

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
    /// The number that the thesis gives, as on the axis: a dashed line.
    stated: f64,
    /// Its runs, in one or several series.
    series: Vec<Group>,
}

fn one() -> f64 {
    1.0
}

/// A panel: its title, the number that the thesis gives, and the runs.
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
}

impl Figure for StudyFigure {
    fn runs(&self) -> Vec<(&str, Pen<'_>)> {
        let series = self.panels().into_iter().flat_map(|(.., series)| series.iter().enumerate());
        series.flat_map(|(n, of)| of.runs().map(move |run| (run, Pen::nth(n, &of.label)))).collect()
    }

    fn required_data(&self) -> RequiredData {
        let of_theory = self.theory.map_or(RequiredData::NOTHING, Number::required_data);
        let of_parameter = Number::find(&self.parameter).map_or(RequiredData::NOTHING, Number::required_data);
        self.measure.required_data() | of_theory | of_parameter
    }

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
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
        // A run without such a number leaves a gap.
        let numbers = |number: Number| Vec::from_iter(of(number).map(|value| (at, value)));
        let mut layers = Vec::new();
        if let Some(theory) = self.theory {
            // A name for the lines of all series stands in the legend once.
            let is_first = self.series.first().is_some_and(|group| group.label == pen.label);
            let of_first = self.theory_label.as_deref().map(|label| if is_first { label } else { "" });
            layers.push(pen.called(of_first.unwrap_or(pen.label)).line(numbers(theory)));
        } else if !self.measure.is_count() && self.panel.is_empty() {
            // Between whole numbers there is nothing that a line could show, nor between draws of one number.
            layers.push(pen.line(numbers(self.measure)));
        }
        layers.push(pen.marks(numbers(self.measure)));
        let x = Scale::free(&self.parameter_label).in_powers(self.logarithmic);
        let y = Scale::free(&self.measure_label).in_powers(self.logarithmic_measure);
        Ok(Sheet::single(x, y.in_whole_numbers(self.measure.is_count()), layers))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let mut parts = parts.into_iter();
        let mut panels = Vec::new();
        for (title, stated, series) in self.panels() {
            let of_panel = parts.by_ref().take(series.iter().flat_map(Group::runs).count()).collect();
            panels.extend(joined(of_panel).panels.into_iter().map(|panel| (panel.titled(title), stated)));
        }
        let points = || panels.iter().flat_map(|(panel, _)| &panel.layers).flat_map(Layer::points);
        if points().next().is_none() {
            return Err(format!("no run has a {}", self.measure.name()));
        }
        // All cases share their axes.
        if !self.panel.is_empty() {
            let stated = self.panel.iter().map(|case| case.stated);
            let x = panels[0].0.x.fitted(points().map(|at| at.0));
            let y = panels[0].0.y.fitted(points().map(|at| at.1).chain(stated));
            let ends = x.ends();
            for (panel, stated) in &mut panels {
                (panel.x, panel.y) = (x.clone(), y.clone());
                let across = |stated| vec![(ends.0, stated), (ends.1, stated)];
                let stated = stated.map(|stated| Layer::line("thesis", across(stated), Dash::Dashed, RED));
                panel.layers.splice(..0, stated);
            }
        }
        Ok(Sheet::of(panels.into_iter().map(|(panel, _)| panel).collect()))
    }
}
