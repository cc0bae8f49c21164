//! Speed of fronts against prestress: runs as marks, the theory of a steady front on rigid
//! contacts as lines. Below, how far the marks are from their lines; or, where the theory does not
//! speak of some of them, how much faster each is than a front on rigid contacts without damping.

use asperity_model::front::{self, Front};
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, Parts, find, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Panel, Pen, Sheet};

keys! {
    FrontSpeed;

    /// Text above the legend.
    #[serde(default)]
    note: String,
    /// The lower end of the axis of speeds, over `c`.
    from_speed: f64,
    /// The upper end of the axis of speeds, over `c`. Faster fronts are not shown.
    to_speed: f64,
    /// Runs that belong together.
    pub(super) series: Vec<Group>,
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
                errors.extend(error.map(|error| (prestress, 1e3 * error.abs())));
            }
            if let Some(theory) = theory {
                speeds.push(pen.line(theory.curve(self.to_speed)));
            }
            speeds.push(pen.marks(points));
            let pen = pen.unlabelled();
            ratios.extend([pen.line(ratio.clone()), pen.marks(ratio)]);
            deviations.push((theory.is_some(), pen.marks(errors)));
        }
        let lower = if deviations.iter().all(|(has_law, _)| *has_law) {
            let layers = deviations.into_iter().map(|(_, layer)| layer).collect();
            Panel::new(Scale::between("τ", 0.0, 1.0), Scale::free_powers("1000 |Δv|/v"), layers)
        } else {
            Panel::new(Scale::between("τ", 0.0, 1.0), Scale::free("√(1 − τ²) v/c"), ratios)
        };
        if lower.is_empty() {
            return Err("no run has a front so far".to_owned());
        }
        let y = Scale::between("v/c", self.from_speed, self.to_speed);
        let upper = Panel::new(Scale::between("", 0.0, 1.0), y, speeds).noted(&self.note);
        Ok(Sheet::stacked(upper, lower))
    }
}
