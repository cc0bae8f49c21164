//! Speed of fronts against prestress: runs as marks, the theory of a steady front on rigid
//! contacts as lines. Below, how far the marks are from their lines; or, where the theory does not
//! speak of some of them, how much faster each is than a front on rigid contacts without damping.

use asperity_model::front::{self, Front};
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, Parts, find, keys, of_runs_in};
use super::plot::{Axis, Corner, Panel, Pen, Series, Sheet};

keys! {
    FrontSpeed: file, title;

    /// Text above the legend.
    #[serde(default)]
    note: String,
    /// The lower end of the axis of speeds, over `c`.
    from_speed: f64,
    /// The upper end of the axis of speeds, over `c`. Faster fronts are not shown.
    to_speed: f64,
    /// Runs that belong together.
    series: Vec<Group>,
}

/// What is shown of a run.
pub(crate) struct Part {
    prestress: f64,
    /// The front by the theory, where there is one.
    theory: Option<Front>,
    speed: Option<f64>,
    error: Option<f64>,
}

impl Figure for FrontSpeed {
    of_runs_in!(series, Part);

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let prestress = front::relative_prestress(&run.plan, run.plan.blocks / 2)
            .ok_or_else(|| format!("run {} has no static friction above sliding friction", run.name))?;
        Ok(Part {
            prestress,
            theory: fronts::theory(run),
            speed: fronts::speed_over_c(run),
            error: fronts::speed_error(run),
        })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let (mut speeds, mut deviations, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
        for (index, series) in self.series.iter().enumerate() {
            let pen = Pen::nth(index, &series.label);
            let (mut points, mut errors, mut ratio) = (Vec::new(), Vec::new(), Vec::new());
            let mut theory = None;
            for name in &series.runs {
                let Part { prestress, theory: of_run, speed, error } = *find(&parts, name)?;
                theory = theory.or(of_run);
                // A front that did not come so far leaves a gap.
                let Some(speed) = speed else { continue };
                points.push((prestress, speed));
                ratio.push((prestress, speed * (1.0 - prestress * prestress).sqrt()));
                errors.extend(error.map(|error| (prestress, (1e3 * error.abs()).log10())));
            }
            if let Some(theory) = theory {
                speeds.push(pen.line(theory.curve(self.to_speed)));
            }
            speeds.push(pen.marks(points));
            let pen = pen.unlabelled();
            ratios.extend([pen.line(ratio.clone()), pen.marks(ratio)]);
            deviations.push((theory.is_some(), pen.marks(errors)));
        }
        let all = |series: &[Series]| -> Vec<f64> {
            series.iter().flat_map(|series| &series.points).map(|(_, y)| *y).collect()
        };
        let lower = if deviations.iter().all(|(has_law, _)| *has_law) {
            let deviations: Vec<Series> = deviations.into_iter().map(|(_, series)| series).collect();
            let (low, high) = range(&all(&deviations)).ok_or("no run has a front so far")?;
            let x = Axis::new("τ", 0.0, 1.0);
            let y = Axis::decades("1000 |Δv|/v", low.floor(), high.ceil());
            Panel::new(x, y, Corner::TopRight, deviations)
        } else {
            let (low, high) = range(&all(&ratios)).ok_or("no run has a front so far")?;
            let margin = 0.12 * (high - low).max(1e-3);
            let x = Axis::new("τ", 0.0, 1.0);
            let y = Axis::new("√(1 − τ²) v/c", low - margin, high + margin);
            Panel::new(x, y, Corner::TopRight, ratios)
        };
        let x = Axis::new("", 0.0, 1.0);
        let y = Axis::new("v/c", self.from_speed, self.to_speed);
        let upper = Panel::new(x, y, Corner::TopLeft, speeds).titled(&self.title).noted(&self.note);
        Ok(Sheet::stacked(upper, lower))
    }
}

/// The smallest and the largest of some numbers.
fn range(values: &[f64]) -> Option<(f64, f64)> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    Some((finite().reduce(f64::min)?, finite().reduce(f64::max)?))
}
