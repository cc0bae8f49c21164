//! Normal load and driving force against time, in one plot (Figures 6.3, 6.14, 6.16, 6.18,
//! 6.20, 6.22).

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::plot::{Axis, BLUE, Corner, Dash, Panel, RED, Series, Sheet};

keys! {
    Loads: file, run, title;
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
        let both = || normal.iter().chain(&driving).map(|(_, force_n)| *force_n);
        let (lowest, highest) = (both().fold(0.0, f64::min), both().fold(0.0, f64::max));
        let x = Axis::new("t (s)", 0.0, run.plan.grid.time_s(run.header.steps));
        let y = Axis::new("force (N)", lowest * 1.1, highest * 1.08);
        let series = vec![
            Series::line("F_N", normal, Dash::Dashed, BLUE),
            Series::line("F_T", driving, Dash::Solid, RED),
        ];
        Ok(Sheet::single(Panel::new(x, y, Corner::TopRight, series).titled(&self.title)))
    }
}
