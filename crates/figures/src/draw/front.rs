//! `tau_n / p_n` along the slider after a precursor (Figure 5.6).

use asperity_numbers::curves::front_profile;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::area::along;
use super::kind::{Figure, coefficient_lines, keys, of_one_run, place_name};
use super::scale::Scale;
use super::sheet::{Dash, GREY, INK, Layer, Sheet};

keys! {
    Front: run;

    /// The length of the precursor; the nearest one is shown.
    blocks: u32,
}

impl Figure for Front {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData::LOADS | RequiredData::STATES
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let (precursor, profile) = front_profile(run, run.loads()?, run.states()?, f64::from(self.blocks))
            .ok_or_else(|| format!("run {} has no precursor with fields at its end", run.name))?;
        let profile = along(run, &profile);
        let last = f64::from(run.columns());
        let friction = &run.plan.friction;
        let tip = f64::from(precursor.last_block) + 0.5;
        let tip = vec![(tip, 0.0), (tip, friction.static_coefficient)];
        let profile = profile.iter().enumerate().map(|(n, ratio)| (n as f64 + 1.0, *ratio)).collect();
        let end_s = precursor.end.end_s.unwrap_or(precursor.end.onset_s);
        let mut series = coefficient_lines(run, last);
        series.extend([
            Layer::line(
                format!(
                    "front, {} {}",
                    place_name(run).split(' ').next().unwrap_or_default(),
                    precursor.last_block
                ),
                tip,
                Dash::Dotted,
                GREY,
            ),
            Layer::line(format!("simulated, t = {end_s:.3} s"), profile, Dash::Solid, INK),
        ]);
        let x = Scale::between(place_name(run), 0.0, last);
        Ok(Sheet::single(x, Scale::free("τ_n/p_n"), series))
    }
}
