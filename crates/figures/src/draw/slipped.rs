//! Share of the blocks that slid against the load, for events larger than all
//! before them, wherever they began: for drives from the top and from both ends,
//! where fronts need not start at block 1.

use asperity_model::analytic::LengthLaw;
use asperity_numbers::curves::growing_slips;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Labelled, Parts, keys, of_runs_in, with_pens};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Sheet};

keys! {
    Slipped;

    /// The runs, each with its label in the legend.
    series: Vec<Labelled>,
}

/// What is shown of a run.
pub(crate) struct Part {
    points: Vec<(f64, f64)>,
    /// `mu_d` of a chain, in which what slid bears it and nothing else bears anything; none where nothing sticks.
    dynamic_coefficient: Option<f64>,
}

impl Figure for Slipped {
    of_runs_in!(series, Part);

    fn required_data(&self) -> RequiredData {
        RequiredData::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let has_theory = LengthLaw::are_known(&run.scenario);
        let dynamic_coefficient = has_theory.then_some(run.plan.friction.dynamic_coefficient);
        Ok(Part { points: growing_slips(run, run.loads()?), dynamic_coefficient })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut highest: f64 = 0.0;
        for (pen, Part { points, .. }) in with_pens(&self.series, &parts)? {
            highest = points.iter().fold(highest, |highest, (load, _)| highest.max(*load));
            series.push(pen.marks(points.clone()));
        }
        let first = self.series.iter().find_map(|labelled| parts.get(&labelled.run)?.dynamic_coefficient);
        if let Some(mu_d) = first {
            let line =
                Layer::line("F_T/F_N = μ_d × share", vec![(0.0, 0.0), (mu_d, 1.0)], Dash::Dashed, GREY);
            highest = highest.max(mu_d);
            series.insert(0, line);
        }
        let x = Scale::between("F_T/F_N", 0.0, highest * 1.06);
        let y = Scale::between("share of blocks that slid", 0.0, 1.08);
        Ok(Sheet::single(x, y, series))
    }
}
