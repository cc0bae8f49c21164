//! Displacement of chosen blocks against time (Figure 6.7).

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{Layer, Sheet, nth};

keys! {
    Displacement: run;

    /// The blocks, counted from 1; over an area contacts, row by row.
    blocks: Vec<u32>,
}

impl Figure for Displacement {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { displacements_of: self.blocks.iter().copied().collect(), ..RequiredData::NOTHING }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let mut series = Vec::new();
        for (index, &block) in self.blocks.iter().enumerate() {
            if !(1..=run.header.blocks).contains(&block) {
                return Err(format!(
                    "blocks: {block} is not in run {} (accepted: 1 to {})",
                    run.name, run.header.blocks
                ));
            }
            let (_, dash, color) = nth(index);
            let course = run.states()?.displacement_of(block);
            series.push(Layer::line(
                match run.of_one_row() {
                    Some(_) => format!("block {block}"),
                    None => {
                        let contacts = run.header.contacts();
                        format!(
                            "contact {block}: column {}, row {}",
                            contacts.column(block),
                            contacts.row(block)
                        )
                    }
                },
                course.iter().map(|(time_s, displacement_m)| (*time_s, displacement_m * 1e3)).collect(),
                dash,
                color,
            ));
        }
        if series.iter().flat_map(Layer::points).all(|(_, displacement_mm)| displacement_mm <= 0.0) {
            return Err(format!("no displacement of its blocks is recorded in run {}", run.name));
        }
        let x = Scale::between("t (s)", 0.0, run.plan.grid.time_s(run.header.steps));
        Ok(Sheet::single(x, Scale::free("u_n (mm)"), series))
    }
}
