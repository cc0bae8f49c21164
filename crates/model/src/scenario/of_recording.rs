//! What stands where the scenario of a run would, in figures and pages of a recording.

use asperity_record::RunHeader;

use super::Scenario;
use super::source::ScenarioSource;

impl Scenario {
    /// A scenario for the header of a recording and its description, as TOML: a chain with its name, its length, its
    /// wave speed and its time, and sensors as blocks. All else is by default, since nobody measured it: whoever shows a parameter or a theory looks at
    /// [`RunHeader::sensors`] first.
    pub fn of_recording(header: &RunHeader, description: &str) -> Scenario {
        let all_by_default = ScenarioSource::new("recording", "");
        let mut scenario = Scenario::resolve(&all_by_default).expect("the defaults are a scenario");
        let slider = &mut scenario.slider;
        slider.blocks = header.blocks;
        slider.length_m = header.sensors.as_ref().map_or(slider.length_m, |sensors| sensors.length_m);
        // c^2 = E / rho
        let volume_m3 = slider.length_m * slider.width_m * slider.height_m;
        slider.mass_kg = slider.youngs_modulus_pa * volume_m3 / header.scales.wave_speed_m_per_s().powi(2);
        scenario.name.clone_from(&header.scenario);
        let description: toml::Table = description.parse().unwrap_or_default();
        scenario.summary =
            description.get("summary").and_then(|line| line.as_str()).unwrap_or_default().to_owned();
        scenario.time.step_s = header.time_step_s;
        scenario.time.duration_s = header.time_grid().time_s(header.steps);
        scenario
    }
}
