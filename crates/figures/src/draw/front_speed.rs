//! Speed of fronts against prestress: runs as marks, the theory of a steady front on rigid
//! contacts as lines. Below, how far the marks are from their lines; or, where the theory does not
//! speak of some of them, how much faster each is than a front on rigid contacts without damping.

use asperity_model::theory::front::{Front, relative_prestress};
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, joined, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Layer, Panel, Pen, Shape, Sheet};

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

impl Figure for FrontSpeed {
    of_runs_in!(series);

    /// Three panels: speeds, and below them how far they are from the theory, or how much faster than another one.
    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let at = relative_prestress(&run.plan, run.plan.blocks / 2)
            .ok_or_else(|| format!("run {} has no static friction above sliding friction", run.name))?;
        let theory = fronts::theory(run).filter(Front::has_speed);
        let line = theory.map(|theory| pen.line(theory.curve(self.to_speed)));
        // A front that did not come so far leaves a gap.
        let speed = fronts::speed_over_c(run);
        let error = speed.and(fronts::speed_error(run)).map(|error| 1e3 * error.abs());
        let ratio = speed.map(|speed| speed * (1.0 - at * at).sqrt());
        let [speed, error, ratio] =
            [speed, error, ratio].map(|of| of.map(|of| (at, of)).into_iter().collect());
        let below = pen.called("");
        let speeds = line.into_iter().chain([pen.marks(speed)]).collect();
        let ratios = vec![below.line(Vec::clone(&ratio)), below.marks(ratio)];
        let tau = |label| Scale::between(label, 0.0, 1.0);
        Ok(Sheet::of(vec![
            Panel::new(tau(""), Scale::between("v/c", self.from_speed, self.to_speed), speeds),
            Panel::new(tau("τ"), Scale::free_powers("1000 |Δv|/v"), vec![below.marks(error)]),
            Panel::new(tau("τ"), Scale::free("√(1 − τ²) v/c"), ratios),
        ]))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let mut panels = joined(parts).panels;
        let is_theory = |layer: &&Layer| matches!(layer.shape, Shape::Line(..));
        let is_of_law = panels[0].layers.iter().filter(is_theory).count() == self.series.len();
        let (lower, upper) = (panels.remove(if is_of_law { 1 } else { 2 }), panels.remove(0));
        if lower.is_empty() {
            return Err("no run has a front so far".to_owned());
        }
        Ok(Sheet::stacked(upper, lower).noted(&self.note))
    }
}
