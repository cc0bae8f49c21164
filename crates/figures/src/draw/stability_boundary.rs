//! The stiffness below which steady sliding is unstable, against the velocity: where measured growth changes its sign,
//! and in theory.

use asperity_model::Stability;
use asperity_numbers::Number;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Group, Parts, keys, of_runs_in};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Sheet, nth};
use super::study::groups;

keys! {
    StabilityBoundary;

    /// Sliders that differ in the velocity and the stiffness of their drive: at each velocity two or more
    /// stiffnesses, from which oscillations grow and decay.
    pub(super) series: Vec<Group>,
}

/// What is shown of a run: velocity, stiffness and growth, and the critical stiffness in theory about that velocity.
/// Stiffnesses are over `(b - a) p / D_c`.
pub(crate) struct Part {
    velocity_m_per_s: f64,
    stiffness: f64,
    growth: f64,
    theory: Vec<(f64, f64)>,
}

/// The theory is shown from a third of a velocity to three times it, with this number of points on each side.
const ABOUT: f64 = 3.0;
const POINTS: i32 = 20;

fn growth() -> Number {
    Number::find("oscillation_growth_ratio").expect("it is in the list")
}

impl Figure for StabilityBoundary {
    of_runs_in!(series, Part);

    fn required_data(&self) -> RequiredData {
        growth().required_data()
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let lacks = |what: &str| format!("run {} has no {what}", run.name);
        let plan = &run.plan;
        let law = plan.friction.law.rate_and_state().ok_or_else(|| lacks("rate-and-state friction"))?;
        let weakening = plan.friction.evolution_effects[0] - law.direct_effect;
        let (1, [spring], true) = (plan.blocks, &plan.drive.springs[..], weakening > 0.0) else {
            return Err(lacks("single block whose friction falls with velocity"));
        };
        let unit_n_per_m = weakening * plan.normal_load_n[0] / law.critical_slip_m;
        let velocity_m_per_s = plan.drive.velocity_m_per_s;
        let mut plan = plan.clone();
        let theory = (-POINTS..=POINTS).filter_map(|n| {
            plan.drive.velocity_m_per_s = velocity_m_per_s * ABOUT.powf(f64::from(n) / f64::from(POINTS));
            let critical_n_per_m = Stability::of(&plan)?.critical_stiffness_n_per_m;
            Some((plan.drive.velocity_m_per_s, critical_n_per_m / unit_n_per_m))
        });
        Ok(Part {
            velocity_m_per_s,
            stiffness: spring.stiffness_n_per_m / unit_n_per_m,
            theory: theory.collect(),
            growth: growth().of(run, None).ok_or_else(|| lacks("oscillations"))?,
        })
    }

    fn sheet(&self, parts: Parts<Part>) -> Result<Sheet, String> {
        let mut drawn = Vec::new();
        for (index, (pen, mut of_group)) in groups(&self.series, &parts)?.into_iter().enumerate() {
            of_group.sort_by(|a, b| {
                (a.velocity_m_per_s.total_cmp(&b.velocity_m_per_s)).then(a.stiffness.total_cmp(&b.stiffness))
            });
            let crossings = of_group.windows(2).filter(|pair| {
                pair[0].velocity_m_per_s == pair[1].velocity_m_per_s
                    && pair[0].growth > 0.0
                    && pair[1].growth <= 0.0
            });
            let marks = crossings.map(|pair| {
                let share = pair[0].growth / (pair[0].growth - pair[1].growth);
                let stiffness = pair[0].stiffness + share * (pair[1].stiffness - pair[0].stiffness);
                (pair[0].velocity_m_per_s, stiffness)
            });
            let mut theory: Vec<(f64, f64)> = of_group.iter().flat_map(|part| part.theory.clone()).collect();
            theory.sort_by(|a, b| a.0.total_cmp(&b.0));
            drawn.push(Layer::line("", theory, Dash::Solid, nth(index).2));
            drawn.push(pen.marks(marks.collect()));
        }
        let marks = || drawn.iter().skip(1).step_by(2).flat_map(Layer::points);
        if marks().next().is_none() {
            return Err("at no velocity do oscillations both grow and decay".to_owned());
        }
        let x = Scale::free_powers("velocity (m/s)").fitted(marks().flat_map(|at| [at.0 / 2.0, 2.0 * at.0]));
        // Inertia lifts the theory beyond all bounds.
        let top = 1.15 * marks().fold(0.0, |most: f64, at| most.max(at.1));
        let in_view = |at: &(f64, f64)| x.share(at.0).is_some() && (0.0..=top).contains(&at.1);
        let y = Scale::free("k_c D_c / (b − a) p")
            .fitted(drawn.iter().flat_map(Layer::points).filter(in_view).map(|at| at.1));
        let note = "marks: oscillations neither grow nor decay, lines: closed form";
        Ok(Sheet::single(x, y, drawn).noted(note))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Figure, Part, StabilityBoundary};

    fn part(velocity_m_per_s: f64, stiffness: f64, growth: f64) -> Part {
        let theory = vec![(velocity_m_per_s, 1.0)];
        Part { velocity_m_per_s, stiffness, growth, theory }
    }

    fn figure() -> StabilityBoundary {
        let keys = "file = \"a.png\"\ntitle = \"\"\nseries = [{ label = \"A\", runs = [\"a\", \"b\", \"c\", \"d\"] }]";
        toml::from_str(keys).unwrap()
    }

    #[test]
    fn marks_are_where_growth_between_two_stiffnesses_is_0() {
        // At 1 mm/s growth falls from 0.03 to -0.01; at 10 mm/s there is no decay.
        let of = [part(1e-3, 1.2, -0.01), part(1e-3, 0.8, 0.03), part(1e-2, 0.5, 0.1), part(1e-2, 0.6, 0.05)];
        let parts: BTreeMap<String, Part> =
            ["a", "b", "c", "d"].map(str::to_owned).into_iter().zip(of).collect();
        let panel = figure().sheet(parts).unwrap().panels.remove(0);
        let [(x, y)] = panel.layers[1].points()[..] else { panic!("{:?}", panel.layers[1].points()) };
        assert!((x - 1e-3).abs() < 1e-12 && (y - 1.1).abs() < 1e-12, "{x} {y}");
        let grow = ["a", "b", "c", "d"].map(|name| (name.to_owned(), part(1e-3, 0.8, 0.03)));
        assert_eq!(
            figure().sheet(grow.into_iter().collect()).err().as_deref(),
            Some("at no velocity do oscillations both grow and decay")
        );
    }
}
