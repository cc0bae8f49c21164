//! One number per run against a parameter that the runs differ in.

use asperity_numbers::Number;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, Parts, find, keys, of_runs_in};
use super::plot::{Axis, Corner, Panel, Pen, Sheet};

keys! {
    StudyFigure: file;

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
    series: Vec<Group>,
}

fn one() -> f64 {
    1.0
}

impl Figure for StudyFigure {
    of_runs_in!(series, (f64, [Option<f64>; 2]));

    fn required_data(&self) -> RequiredData {
        let of_theory = self.theory.map_or(RequiredData::NOTHING, Number::required_data);
        let of_parameter = Number::find(&self.parameter).map_or(RequiredData::NOTHING, Number::required_data);
        self.measure.required_data() | of_theory | of_parameter
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        let at = match Number::find(&self.parameter) {
            Ok(number) => {
                number.of(run, None).ok_or_else(|| format!("run {} has no {}", run.name, self.parameter))?
            }
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
            let place = if self.logarithmic_measure { value.log10() } else { value };
            Some(place).filter(|place| place.is_finite())
        };
        Ok((at, [of(self.measure), self.theory.and_then(of)]))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut drawn = Vec::new();
        for (index, series) in self.series.iter().enumerate() {
            let pen = Pen::nth(index, &series.label);
            let (mut points, mut theory) = (Vec::new(), Vec::new());
            for name in &series.runs {
                let (at, [measured, by_theory]) = *find(&parts, name)?;
                let at = if self.logarithmic { at.log10() } else { at };
                // A run without such a number leaves a gap.
                points.extend(measured.map(|value| (at, value)));
                theory.extend(by_theory.map(|value| (at, value)));
            }
            if self.theory.is_some() {
                theory.sort_by(|a, b| a.0.total_cmp(&b.0));
                // A name for the lines of all series stands in the legend once.
                let of_first = self.theory_label.as_deref().map(|label| if index == 0 { label } else { "" });
                drawn.push(Pen::nth(index, of_first.unwrap_or(&series.label)).line(theory));
            } else if !self.measure.is_count() {
                // Between whole numbers there is nothing that a line could show.
                drawn.push(pen.line(points.clone()));
            }
            drawn.push(pen.marks(points));
        }
        let all = || drawn.iter().flat_map(|series| series.points.iter().copied());
        if all().next().is_none() {
            return Err(format!("no run has a {}", self.measure.name()));
        }
        let range = |values: &dyn Fn((f64, f64)) -> f64| {
            all()
                .map(values)
                .fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)))
        };
        let (left, right) = range(&|point| point.0);
        // About one value alone, half as much again to both sides.
        let margin = if right > left { 0.06 * (right - left) } else { (0.5 * right.abs()).max(0.5) };
        let x = if self.logarithmic {
            Axis::decades(&self.parameter_label, left - margin, right + margin)
        } else {
            Axis::new(&self.parameter_label, left - margin, right + margin)
        };
        let y = if self.logarithmic_measure {
            let (low, high) = range(&|point| point.1);
            Axis::decades(&self.measure_label, low - 0.06 * (high - low), high + 0.06 * (high - low))
        } else {
            Axis {
                whole: self.measure.is_count(),
                ..Axis::about(&self.measure_label, all().map(|point| point.1))
            }
        };
        Ok(Sheet::single(Panel::new(x, y, Corner::TopRight, drawn)))
    }
}
