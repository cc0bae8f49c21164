//! Initial shear profiles: as set up, and as (5.50) asks (Figure 5.7); of slabs what their load leaves.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::area::along;
use super::kind::{Figure, Labelled, Parts, keys, of_runs_in, with_pens};
use super::scale::Scale;
use super::sheet::Sheet;

keys! {
    InitialShear;

    /// The runs, each with its label in the legend.
    series: Vec<Labelled>,
}

/// One block in this many is marked, so that the lines beneath can be seen.
const MARKED: usize = 6;

/// What is shown of a run.
pub(crate) struct Part {
    /// That of (5.50); through all contacts of a slab.
    line: Vec<(f64, f64)>,
    is_pressed: bool,
    is_over_area: bool,
    shear: Vec<(f64, f64)>,
}

impl Figure for InitialShear {
    of_runs_in!(series, Part);

    fn required_data(&self) -> RequiredData {
        RequiredData::STATES
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let fields = run.states()?.first();
        let fields = fields.ok_or_else(|| format!("run {} has no initial fields", run.name))?;
        let x = |n: usize| n as f64 * run.plan.spacing_m / run.plan.length_m;
        let shear = fields.tangential_force_n.iter().zip(&run.plan.normal_load_n);
        let shear = along(run, &shear.map(|(tau, p)| tau / p).collect::<Vec<f64>>());
        let shear: Vec<(f64, f64)> = shear.into_iter().enumerate().map(|(n, ratio)| (x(n), ratio)).collect();
        let (beta, is_pressed) = (run.scenario.initial_shear.beta, run.plan.elastic.has_foundation());
        Ok(Part {
            line: if is_pressed { shear.clone() } else { vec![(0.0, -beta), (1.0, beta)] },
            is_pressed,
            is_over_area: run.of_one_row().is_none(),
            shear: shear.into_iter().step_by(MARKED).collect(),
        })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut largest: f64 = 0.1;
        let (mut slabs, mut chains, mut bodies) = (false, false, false);
        for (pen, Part { line, is_pressed, is_over_area, shear }) in with_pens(&self.series, &parts)? {
            largest = line.iter().fold(largest, |largest, (_, ratio)| largest.max(ratio.abs()));
            (slabs, chains) = (slabs || *is_pressed, chains || !is_pressed);
            bodies |= *is_over_area;
            series.extend([pen.line(line.clone()), pen.marks(shear.clone())]);
        }
        let note = match (slabs, chains) {
            (false, _) => "marks: set up, lines: eq. (5.50)",
            (true, false) if bodies => "at rest, means of columns",
            (true, false) => "slabs at rest",
            (true, true) => "slabs at rest; chains as set up, lines: eq. (5.50)",
        };
        let x = Scale::between("x/L", 0.0, 1.0);
        let y = Scale::between("τ_0/p", -1.15 * largest, 1.15 * largest);
        Ok(Sheet::single(x, y, series).noted(note))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Figure, InitialShear};
    use asperity_testkit::made_up;

    #[test]
    fn a_slab_has_the_shear_of_all_its_contacts() {
        let figure: InitialShear =
            toml::from_str("file = 'f.png'\nseries = [{ run = 'a', label = 'A' }]").unwrap();
        let mut run = made_up::slab(&[]);
        // As the run begins: each contact bears its part of the load.
        run.plan.normal_load_n = vec![100.0, 200.0, 100.0];
        let parts = BTreeMap::from([("a".to_owned(), figure.part(&run).unwrap())]);
        let panel = figure.sheet(parts).unwrap().panels.remove(0);
        assert_eq!(panel.layers[0].points(), [(0.0, -0.2), (0.5, 0.0), (1.0, 0.2)]);
        assert_eq!(panel.layers.last().unwrap().label, "slabs at rest");
        assert_eq!(panel.y.ends().1, 1.15 * 0.2);
    }
}
