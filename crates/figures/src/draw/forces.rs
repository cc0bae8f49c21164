//! `F_T`, `F_N`, `mu_s F_N` and `mu_d F_N` against time; of rate-and-state friction `f_0 F_N`.

use asperity_numbers::curves::pull_ratio;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, levels, of_one_run};
use super::scale::Scale;
use super::sheet::{Dash, GREY, INK, Layer, Sheet};

keys! {
    Forces: run;

    /// Start of the time axis; by default that of the run.
    from_s: Option<f64>,
    /// End of the time axis; by default that of the run.
    to_s: Option<f64>,
}

impl Figure for Forces {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let from_s = self.from_s.unwrap_or(0.0);
        let to_s = self.to_s.unwrap_or(run.plan.grid.time_s(run.header.steps));
        let shown: Vec<_> =
            run.loads()?.iter().filter(|record| (from_s..=to_s).contains(&record.time_s)).collect();
        if shown.len() < 2 {
            return Err(format!("run {} has no records from {from_s} s to {to_s} s", run.name));
        }
        let load =
            |factor: f64| shown.iter().map(|record| (record.time_s, factor * record.normal_load_n)).collect();
        let pull: Vec<(f64, f64)> =
            shown.iter().map(|record| (record.time_s, pull_ratio(record) * record.normal_load_n)).collect();
        let both_ways = run.plan.drive.pulls_both_ways();
        let x = Scale::between("t (s)", from_s, to_s);
        let mut series = vec![Layer::line("F_N", load(1.0), Dash::Solid, GREY)];
        for (level, dash, color, label) in levels(run) {
            series.push(Layer::line(format!("{label} F_N"), load(level), dash, color));
        }
        let pulls = if both_ways { "F_T, both ends added" } else { "F_T" };
        series.push(Layer::line(pulls, pull, Dash::Solid, INK));
        Ok(Sheet::single(x, Scale::free("force (N)"), series))
    }
}
