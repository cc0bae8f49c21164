//! Normal load and driving force against time, in one plot (Figures 6.3, 6.14, 6.16, 6.18,
//! 6.20, 6.22).

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, Layer, RED, Sheet};

keys! {
    Loads: run;
}

impl Figure for Loads {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let normal: Vec<(f64, f64)> =
            run.loads()?.iter().map(|record| (record.time_s, record.normal_load_n)).collect();
        let driving: Vec<(f64, f64)> =
            run.loads()?.iter().map(|record| (record.time_s, record.driving_force_n)).collect();
        let x = Scale::between("t (s)", 0.0, run.plan.grid.time_s(run.header.steps));
        let series = vec![
            Layer::line("F_N", normal, Dash::Dashed, BLUE),
            Layer::line("F_T", driving, Dash::Solid, RED),
        ];
        Ok(Sheet::single(x, Scale::free("force (N)"), series))
    }
}
