//! Speed of fronts against prestress: runs as marks, the theory of a steady front on rigid
//! contacts as lines. Below, how far the marks are from their lines; or, where the theory does not
//! speak of some of them, how much faster each is than a front on rigid contacts without damping.

use asperity_model::front;
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Parts, find};
use super::plot::{Axis, Corner, Look, Panel, Series, Sheet, nth};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct FrontSpeed {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// Stands above the legend.
    #[serde(default)]
    note: String,
    /// The lower end of the axis of speeds, over `c`. Faster fronts are not shown.
    from_speed: f64,
    /// The upper end of the axis of speeds, over `c`.
    to_speed: f64,
    /// Runs that belong together.
    series: Vec<Runs>,
}

/// Runs with one damping, one kind of contact and one drive, and what the legend calls them.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Runs {
    /// What the legend calls it; `k_t` and `k_{t}` set subscripts.
    label: String,
    /// The runs.
    runs: Vec<String>,
}

/// What is shown of a run.
pub(crate) struct Part {
    prestress: f64,
    /// Damping and stiffness of the top drive, where there is a theory.
    law: Option<(f64, f64)>,
    speed: Option<f64>,
    error: Option<f64>,
}

impl Figure for FrontSpeed {
    type Part = Part;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        self.series.iter().flat_map(|series| series.runs.iter().map(String::as_str)).collect()
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let prestress = front::relative_prestress(&run.plan, run.plan.blocks / 2)
            .ok_or_else(|| format!("run {} has no static friction above sliding friction", run.name))?;
        Ok(Part {
            prestress,
            law: fronts::theory(run).map(|theory| (theory.relative_damping, theory.top_stiffness)),
            speed: fronts::speed_over_c(run),
            error: fronts::speed_error(run),
        })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let (mut speeds, mut deviations, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        for (index, series) in self.series.iter().enumerate() {
            let (marker, dash, color) = nth(index);
            let (line, marks) = (Look::Line(dash, color), Look::Marks(marker, color));
            let (mut points, mut errors, mut ratio) = (Vec::new(), Vec::new(), Vec::new());
            let mut law = None;
            for name in &series.runs {
                let Part { prestress, law: of_run, speed, error } = *find(&parts, name)?;
                law = law.or(of_run);
                // A front that did not come so far leaves a gap.
                let Some(speed) = speed else { continue };
                points.push((prestress, speed));
                ratio.push((prestress, speed * (1.0 - prestress * prestress).sqrt()));
                errors.extend(error.map(|error| (prestress, (1e3 * error.abs()).log10())));
            }
            let of =
                |label: &str, points: Vec<(f64, f64)>, look| Series { label: label.to_owned(), points, look };
            if let Some((damping, top)) = law {
                speeds.push(of(&series.label, front::curve(damping, top, self.to_speed), line));
            }
            speeds.push(of(&series.label, points, marks));
            ratios.extend([of("", ratio.clone(), line), of("", ratio, marks)]);
            deviations.push((law.is_some(), of("", errors, marks)));
        }
        let all = |series: &[Series]| -> Vec<f64> {
            series.iter().flat_map(|series| &series.points).map(|(_, y)| *y).collect()
        };
        let lower = if deviations.iter().all(|(has_law, _)| *has_law) {
            let deviations: Vec<Series> = deviations.into_iter().map(|(_, series)| series).collect();
            let (low, high) = range(&all(&deviations)).ok_or("no run has a front so far")?;
            Panel {
                title: String::new(),
                x: Axis::new("τ", 0.0, 1.0),
                y: Axis::decades("1000 |Δv|/v", low.floor(), high.ceil()),
                series: deviations,
                legend: Corner::TopRight,
                note: String::new(),
            }
        } else {
            let (low, high) = range(&all(&ratios)).ok_or("no run has a front so far")?;
            let margin = 0.12 * (high - low).max(1e-3);
            Panel {
                title: String::new(),
                x: Axis::new("τ", 0.0, 1.0),
                y: Axis::new("√(1 − τ²) v/c", low - margin, high + margin),
                series: ratios,
                legend: Corner::TopRight,
                note: String::new(),
            }
        };
        let upper = Panel {
            title: self.title.clone(),
            x: Axis::new("", 0.0, 1.0),
            y: Axis::new("v/c", self.from_speed, self.to_speed),
            series: speeds,
            legend: Corner::TopLeft,
            note: self.note.clone(),
        };
        Ok(Sheet::Stacked(Box::new([upper, lower])))
    }
}

/// The smallest and the largest of some numbers.
fn range(values: &[f64]) -> Option<(f64, f64)> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    Some((finite().reduce(f64::min)?, finite().reduce(f64::max)?))
}
