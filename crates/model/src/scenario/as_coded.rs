//! Describes the slider of a parameter set, in words: the thesis' program computed a different slider from
//! the one stated in its text, with front speeds unlike those of a solid.

use toml::Value;

use crate::scenario::Scenario;
use crate::scenario::choices::ParameterSet;
use crate::scenario::keys;

impl Scenario {
    /// Mass of the slider and speed of long elastic waves in it, as in `0.012 kg, c = 1451 m/s`.
    pub fn mass_and_wave_speed(&self) -> String {
        let c_m_per_s = self.scales().wave_speed_m_per_s();
        let digits = if c_m_per_s < 10.0 { 2 } else { 0 };
        format!("{} kg, c = {c_m_per_s:.digits$} m/s", self.slider.mass_kg)
    }

    /// `as coded: 12 kg, c = 46 m/s` if mass or damping are those of the thesis' program.
    pub fn as_coded_in_words(&self) -> Option<String> {
        let Scenario { parameter_set, slider, .. } = self;
        let has = |path: &str, number: f64| {
            let key = keys::named(path);
            key.and_then(|key| key.default_in(true)) == Some(&Value::from(number))
        };
        let is_coded =
            has("slider.mass_kg", slider.mass_kg) || has("slider.relative_damping", slider.relative_damping);
        (is_coded && *parameter_set == ParameterSet::AsCoded)
            .then(|| format!("as coded: {}", self.mass_and_wave_speed()))
    }
}

#[cfg(test)]
mod tests {
    use crate::resolve;
    use crate::scenario::builtin;
    use crate::scenario::choices::ParameterSet;

    #[test]
    fn built_in_scenarios_are_physical_unless_they_say_otherwise() {
        let is_coded = |(name, _): &(&str, &str)| {
            resolve::<&str>(name, &[]).unwrap().parameter_set == ParameterSet::AsCoded
        };
        let coded: Vec<&str> = builtin::all().filter(is_coded).map(|(name, _)| name).collect();
        assert_eq!(coded, ["ring-down", "left-right-driven"]);
    }

    #[test]
    fn words_have_the_mass_and_the_wave_speed() {
        let of = |sets: &[&str]| resolve("default", sets).unwrap();
        assert_eq!(of(&[]).mass_and_wave_speed(), "0.012 kg, c = 1451 m/s");
        assert_eq!(of(&[]).as_coded_in_words(), None);
        let coded = of(&["parameter_set=as-coded"]);
        assert_eq!(coded.as_coded_in_words().as_deref(), Some("as coded: 12 kg, c = 46 m/s"));
        // The set is named, but none of its values remains.
        let own = ["parameter_set=as-coded", "slider.mass_kg=0.012", "slider.relative_damping=0"];
        assert_eq!(of(&own).as_coded_in_words(), None);
        assert_eq!(of(&["slider.mass_kg=12000"]).mass_and_wave_speed(), "12000 kg, c = 1.45 m/s");
    }
}
