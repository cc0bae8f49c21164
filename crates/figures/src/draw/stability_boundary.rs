//! The stiffness below which steady sliding is unstable, against the velocity: where measured growth changes its sign,
//! and in theory.

use asperity_model::Stability;
use asperity_numbers::Number;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, joined, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Panel, Pen, Point, Shape, Sheet};

keys! {
    StabilityBoundary;

    /// Sliders that differ in the velocity and the stiffness of their drive: at each velocity two or more
    /// stiffnesses, from which oscillations grow and decay.
    pub(super) series: Vec<Group>,
}

/// The theory is shown from a third of a velocity to three times it, with this number of points on each side.
const ABOUT: f64 = 3.0;
const POINTS: i32 = 20;

fn growth() -> Number {
    Number::find("oscillation_growth_ratio").expect("it is in the list")
}

impl Figure for StabilityBoundary {
    of_runs_in!(series, growth().required_data());

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let lacks = |what: &str| format!("run {} has no {what}", run.name);
        let plan = &run.plan;
        let law = plan.friction.law.rate_and_state().ok_or_else(|| lacks("rate-and-state friction"))?;
        let weakening = plan.friction.evolution_effects[0] - law.direct_effect;
        let (1, [spring], true) = (plan.blocks, &plan.drive.springs[..], weakening > 0.0) else {
            return Err(lacks("single block whose friction falls with velocity"));
        };
        let unit_n_per_m = weakening * plan.normal_load_n[0] / law.critical_slip_m;
        let velocity_m_per_s = plan.drive.velocity_m_per_s;
        let stiffness = spring.stiffness_n_per_m / unit_n_per_m;
        let mut plan = plan.clone();
        let theory = (-POINTS..=POINTS).filter_map(|n| {
            plan.drive.velocity_m_per_s = velocity_m_per_s * ABOUT.powf(f64::from(n) / f64::from(POINTS));
            let critical_n_per_m = Stability::of(&plan)?.critical_stiffness_n_per_m;
            Some((plan.drive.velocity_m_per_s, critical_n_per_m / unit_n_per_m))
        });
        let growth = growth().of(run, None).ok_or_else(|| lacks("oscillations"))?;
        Ok(about(pen, theory.collect(), (velocity_m_per_s, stiffness), growth))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let mut panels = joined(parts).panels;
        let (growths, mut layers) = (panels.remove(1).layers, panels.remove(0).layers);
        let mut marks: Vec<Point> = Vec::new();
        for (layer, growths) in layers.iter_mut().skip(1).step_by(2).zip(growths) {
            let Shape::Marks(points, _) = &mut layer.shape else { continue };
            let mut runs: Vec<(Point, Point)> = points.drain(..).zip(growths.points()).collect();
            runs.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            for pair in runs.windows(2) {
                let [((velocity, low), (_, grows)), ((of_next, high), (_, decays))] = [pair[0], pair[1]];
                if velocity == of_next && grows > 0.0 && decays <= 0.0 {
                    points.push((velocity, low + grows / (grows - decays) * (high - low)));
                }
            }
            marks.extend(&*points);
        }
        if marks.is_empty() {
            return Err("at no velocity do oscillations both grow and decay".to_owned());
        }
        let ends = marks.iter().flat_map(|at| [at.0 / 2.0, 2.0 * at.0]);
        let x = Scale::free_powers("velocity (m/s)").fitted(ends);
        // Inertia lifts the theory beyond all bounds.
        let top = 1.15 * marks.iter().fold(0.0, |most: f64, at| most.max(at.1));
        let in_view = |at: &Point| x.share(at.0).is_some() && (0.0..=top).contains(&at.1);
        let y = Scale::free("k_c D_c / (b − a) p")
            .fitted(layers.iter().flat_map(Layer::points).filter(in_view).map(|at| at.1));
        let note = "marks: oscillations neither grow nor decay, lines: closed form";
        Ok(Sheet::single(x, y, layers).noted(note))
    }
}

/// Of a run: its stiffness and that of theory against velocity, over `(b - a) p / D_c`; and, in a second panel, growth
/// against velocity.
fn about(pen: Pen<'_>, theory: Vec<Point>, at: Point, growth: f64) -> Sheet {
    let theory = Layer::line("", theory, Dash::Solid, pen.look.2);
    let panel = |layers| Panel::new(Scale::free_powers(""), Scale::free(""), layers);
    Sheet::of(vec![panel(vec![theory, pen.marks(vec![at])]), panel(vec![pen.marks(vec![(at.0, growth)])])])
}

#[cfg(test)]
mod tests {
    use super::{Figure, Pen, Sheet, StabilityBoundary, about};

    fn part((velocity_m_per_s, stiffness, growth): (f64, f64, f64)) -> Sheet {
        about(Pen::nth(0, "A"), vec![(velocity_m_per_s, 1.0)], (velocity_m_per_s, stiffness), growth)
    }

    fn figure() -> StabilityBoundary {
        let keys = "file = \"a.png\"\ntitle = \"\"\nseries = [{ label = \"A\", runs = [\"a\", \"b\", \"c\", \"d\"] }]";
        toml::from_str(keys).unwrap()
    }

    #[test]
    fn marks_are_where_growth_between_two_stiffnesses_is_0() {
        // At 1 mm/s growth falls from 0.03 to -0.01; at 10 mm/s there is no decay.
        let of = [(1e-3, 1.2, -0.01), (1e-3, 0.8, 0.03), (1e-2, 0.5, 0.1), (1e-2, 0.6, 0.05)];
        let panel = figure().sheet(of.map(part).into()).unwrap().panels.remove(0);
        let [(x, y)] = panel.layers[1].points()[..] else { panic!("{:?}", panel.layers[1].points()) };
        assert!((x - 1e-3).abs() < 1e-12 && (y - 1.1).abs() < 1e-12, "{x} {y}");
        let grow = [(1e-3, 0.8, 0.03); 4];
        assert_eq!(
            figure().sheet(grow.map(part).into()).err().as_deref(),
            Some("at no velocity do oscillations both grow and decay")
        );
    }
}
