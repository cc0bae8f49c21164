//! Speed of fronts against prestress: runs as marks, the theory of a steady front on rigid
//! contacts as lines. Below, how far the marks are from their lines; or, where the theory does not
//! speak of some of them, how much faster each is than a front on rigid contacts without damping.

use asperity_model::theory::front::{self, Front};
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, Parts, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Panel, Point, Sheet};
use super::study::groups;

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
        let mut is_of_law = true;
        for (pen, runs) in groups(&self.series, &parts)? {
            let theory = runs.iter().find_map(|run| run.theory);
            is_of_law &= theory.is_some();
            // A front that did not come so far leaves a gap.
            let fronts = || runs.iter().filter_map(|run| Some((run.prestress, run.speed?, run.error)));
            let points = fronts().map(|(prestress, speed, _)| (prestress, speed)).collect();
            let ratio: Vec<Point> =
                fronts().map(|(at, speed, _)| (at, speed * (1.0 - at * at).sqrt())).collect();
            let errors = fronts().filter_map(|(at, _, error)| Some((at, 1e3 * error?.abs()))).collect();
            if let Some(theory) = theory {
                speeds.push(pen.line(theory.curve(self.to_speed)));
            }
            speeds.push(pen.marks(points));
            let pen = pen.unlabelled();
            ratios.extend([pen.line(ratio.clone()), pen.marks(ratio)]);
            deviations.push(pen.marks(errors));
        }
        let (y, layers) = match is_of_law {
            true => (Scale::free_powers("1000 |Δv|/v"), deviations),
            false => (Scale::free("√(1 − τ²) v/c"), ratios),
        };
        let lower = Panel::new(Scale::between("τ", 0.0, 1.0), y, layers);
        if lower.is_empty() {
            return Err("no run has a front so far".to_owned());
        }
        let y = Scale::between("v/c", self.from_speed, self.to_speed);
        let upper = Panel::new(Scale::between("", 0.0, 1.0), y, speeds);
        Ok(Sheet::stacked(upper, lower).noted(&self.note))
    }
}
