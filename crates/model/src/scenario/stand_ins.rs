//! Keys that stand for others: a material by its density instead of a mass, a mesh by the decay length of stress instead
//! of a ratio of stiffnesses that belongs to one spacing.
//!
//! They become the values of those before a scenario exists, so that no log and no hash has them. Of two layers the later
//! decides.

use std::sync::LazyLock;

use toml::Value;

use crate::body::elastic::gaps;
use crate::scenario::defaults::unusable;
use crate::scenario::key::{AS_CODED, Key, Need, POSITIVE};
use crate::scenario::keys::{self, KEYS, Slider, place};
use crate::scenario::source::{Entries, Refusals, ScenarioSource};

/// The mass of the slider.
pub(super) const MASS: &str = "slider.mass_kg";
const DENSITY: &str = "slider.density_kg_per_m3";
const SIDES: [&str; 3] = ["slider.length_m", "slider.width_m", "slider.height_m"];
const STIFFNESS_RATIO: &str = "friction.interfacial_stiffness_ratio";
const DECAY_LENGTH: &str = "friction.decay_length_m";

/// The keys that stand for others.
pub static STAND_INS: LazyLock<[Key; 2]> = LazyLock::new(|| {
    let key = |path, symbol, doc, needs| Key { path, symbol, doc, kind: POSITIVE, defaults: None, needs };
    let length = "Length over which a stuck chain screens a force on its end, instead of \
                  friction.interfacial_stiffness_ratio: k_t / k = (a / l_0)^2 (5.39), whatever the number of blocks.";
    const NEEDS: &[(Need, &str)] = &[
        (Need::Chain, "how a force on it decays does not follow from this ratio alone"),
        (Need::Blocks, "there is no block behind the first"),
    ];
    [
        key(DENSITY, "rho", "Density, instead of slider.mass_kg: M = rho L_x L_y L_z.", &[]),
        key(DECAY_LENGTH, "l_0", length, NEEDS),
    ]
});

/// All keys that a scenario may be written with.
pub(super) static ALL_KEYS: LazyLock<Vec<&Key>> =
    LazyLock::new(|| KEYS.iter().chain(STAND_INS.iter()).collect());

/// Each with the key that it stands for.
const PAIRS: [(&str, &str); 2] = [(DENSITY, MASS), (DECAY_LENGTH, STIFFNESS_RATIO)];

/// Drops of a lower layer what a higher one says in the other way.
pub(super) fn give_way(below: &mut Entries, above: &Entries) {
    for (one, other) in PAIRS.into_iter().flat_map(|(one, other)| [(one, other), (other, one)]) {
        if above.values.contains_key(one) {
            below.values.remove(other);
        }
    }
}

/// The key by which a layer says the value of another: this or its stand-in; `None` if none does.
pub(super) fn written<'a>(key: &'a Key, entries: &Entries) -> Option<&'a Key> {
    let is_written = |key: &&Key| entries.values.contains_key(key.path);
    let pair = PAIRS.iter().find(|(_, of)| *of == key.path);
    let stand_in = pair.and_then(|(path, _)| STAND_INS.iter().find(|stand_in| stand_in.path == *path));
    [Some(key), stand_in].into_iter().flatten().find(is_written)
}

/// Whether the mass of a set belongs to sides like these, so that a text without it leaves the mass of this slider.
pub(super) fn has_default_sides(slider: &Slider) -> bool {
    [slider.length_m, slider.width_m, slider.height_m] == SIDES.map(|side| default_of(side, false))
}

/// The default of a key whose value is a number, in the set as-coded or in the other one.
pub(super) fn default_of(path: &str, is_as_coded: bool) -> f64 {
    let key = keys::named(path).expect("it is a key");
    key.default_in(is_as_coded).and_then(Value::as_float).expect("its default is a number")
}

/// Puts what the stand-ins stand for into the values of all other keys. The mass follows the sides of the slider as
/// well: where a layer changes one without a mass, the density stays, but for the mass of the set as-coded.
pub(super) fn replace(source: &ScenarioSource, values: &mut [Value], refusals: &mut Refusals<'_>) {
    let entries = refusals.entries;
    for (stand_in, key) in PAIRS.iter().filter(|(one, other)| entries.has(one) && entries.has(other)) {
        let accepted = format!("one of {stand_in} and {key}");
        refusals.refuse(stand_in, format!("{key} is given as well, and each determines the other"), accepted);
    }
    let number = |path: &str| values[place(path)].as_float().expect("a checked number");
    let mass_kg = mass_kg(source, values[place("parameter_set")].as_str() == Some(AS_CODED));
    let of_mass = if entries.has(DENSITY) { DENSITY } else { MASS };
    let mass = (mass_kg != number(MASS)).then_some((MASS, of_mass, mass_kg));
    let blocks = values[place("slider.blocks")].as_integer().expect("a checked count");
    let spacing_m = number(SIDES[0]) / gaps(blocks as usize) as f64;
    let ratio = entries.number(DECAY_LENGTH).map(|length_m| (spacing_m / length_m).powi(2));
    for (path, of, value) in mass.into_iter().chain(ratio.map(|ratio| (STIFFNESS_RATIO, DECAY_LENGTH, ratio)))
    {
        // In as many digits as one would write.
        let value: f64 = format!("{value:.11e}").parse().expect("a number is read as it is written");
        match unusable(POSITIVE, value) {
            Some((problem, accepted)) if path == of => refusals.refuse(of, problem, accepted),
            Some((problem, accepted)) => refusals.refuse(of, format!("{path}: {problem}"), accepted),
            None => values[place(path)] = Value::Float(value),
        }
    }
}

/// The mass that the layers of a scenario give its slider. All overrides together are one layer, in whatever order.
fn mass_kg(source: &ScenarioSource, is_as_coded: bool) -> f64 {
    let default = |path| default_of(path, is_as_coded);
    let (mut sides_m, mut mass_kg, mut is_given) = (SIDES.map(default), default(MASS), false);
    let layers: Vec<&Entries> = source.readable().collect();
    for group in layers.chunk_by(|a, b| a.is_override() && b.is_override()) {
        let number =
            |layer: &Entries, key: &str| layer.number(key).filter(|number| POSITIVE.accepts_number(*number));
        let before_m3: f64 = sides_m.iter().product();
        for (side_m, key) in sides_m.iter_mut().zip(SIDES) {
            *side_m = group.iter().rev().find_map(|layer| number(layer, key)).unwrap_or(*side_m);
        }
        let volume_m3: f64 = sides_m.iter().product();
        let given =
            |layer: &&Entries| number(layer, MASS).or_else(|| Some(number(layer, DENSITY)? * volume_m3));
        let given_kg = group.iter().rev().find_map(given);
        is_given |= given_kg.is_some();
        let stays = is_as_coded && !is_given;
        mass_kg = given_kg.unwrap_or(if stays { mass_kg } else { mass_kg * (volume_m3 / before_m3) });
    }
    mass_kg
}

#[cfg(test)]
mod tests {
    use crate::resolve;
    use crate::scenario::Scenario;
    use crate::scenario::source::ScenarioSource;

    fn of(text: &str, overrides: &[&str]) -> Result<Scenario, String> {
        let source = ScenarioSource::new("own.toml", text);
        source.resolve("own", overrides, &crate::scenario::files::Texts).map_err(|errors| errors.to_string())
    }

    #[test]
    fn the_density_stays_where_a_side_changes_and_no_mass_is_given() {
        let block = "[slider]\nlength_m = 0.14\nheight_m = 0.075\nwidth_m = 0.006\n";
        let mass_kg = |text: &str, overrides: &[&str]| of(text, overrides).unwrap().slider.mass_kg;
        // 1200 kg/m^3, as the default; the same digits as one would write.
        assert_eq!(mass_kg(block, &[]), 0.0756);
        assert_eq!(mass_kg(block, &["slider.width_m=0.012"]), 0.1512);
        assert_eq!(mass_kg(&format!("{block}mass_kg = 0.3"), &["slider.width_m=0.012"]), 0.6);
        // The order of overrides means nothing.
        assert_eq!(mass_kg(block, &["slider.mass_kg=0.3", "slider.width_m=0.012"]), 0.3);
        assert_eq!(mass_kg(block, &["slider.width_m=0.012", "slider.mass_kg=0.3"]), 0.3);
        assert_eq!(mass_kg(block, &["slider.density_kg_per_m3=2500"]), 0.1575);
        assert_eq!(mass_kg(block, &["slider.density_kg_per_m3=2500", "slider.width_m=0.012"]), 0.315);
        assert_eq!(mass_kg("slider.mass_kg = 0.3", &["slider.density_kg_per_m3=1200"]), 0.012);
        assert_eq!(mass_kg("", &["slider.mass_kg=0.3", "slider.density_kg_per_m3=1200"]), 0.012);
        // Sides written again, and other keys, leave every bit.
        let same = ["slider.width_m=0.005", "slider.blocks=50"];
        assert_eq!(mass_kg("slider.mass_kg = 0.012345678901234567", &same), 0.012345678901234567);
        // The mass of the thesis' program belongs to no material.
        let coded = "parameter_set = 'as-coded'\nslider.length_m = 0.2";
        assert_eq!(mass_kg(coded, &[]), 12.0);
        assert_eq!(mass_kg(&format!("{coded}\nslider.mass_kg=3"), &["slider.length_m=0.4"]), 6.0);
        assert_eq!(resolve("slab", &["slider.width_m=0.012"]).unwrap().slider.mass_kg, 0.1512);
        assert_eq!(resolve("unload-comparison", &[""; 0]).unwrap().slider.mass_kg, 0.012);
    }

    #[test]
    fn a_decay_length_gives_the_stiffness_of_any_mesh() {
        let ratio = |overrides: &[&str]| of("", overrides).unwrap().friction.interfacial_stiffness_ratio;
        let spacing_m = 0.1 / 99.0;
        let l0 = "friction.decay_length_m=0.001";
        assert!((ratio(&[l0]) / (spacing_m / 0.001f64).powi(2) - 1.0).abs() < 1e-11);
        let scenario = of("", &[l0, "slider.blocks=199"]).unwrap();
        assert!((scenario.preview().decay_length_m.unwrap() / 0.001 - 1.0).abs() < 1e-11);
        assert_eq!(ratio(&[l0, "friction.interfacial_stiffness_ratio=2"]), 2.0);
        assert_ne!(ratio(&["friction.interfacial_stiffness_ratio=2", l0]), 2.0);
    }

    #[test]
    fn what_cannot_be_stood_for_is_refused_with_its_place() {
        for (text, overrides, problem) in [
            (
                "slider.mass_kg = 1\nslider.density_kg_per_m3 = 1200",
                vec![],
                "own.toml:2:28: slider.density_kg_per_m3: slider.mass_kg is given as well, and each determines the \
                 other (accepted: one of slider.density_kg_per_m3 and slider.mass_kg)",
            ),
            ("slider.density_kg_per_m3 = 0", vec![], "0 is not accepted (accepted: a number above 0)"),
            ("", vec!["slider.density_kg_per_m3=1.2e308"], "slider.density_kg_per_m3: 1.2e308 is too large"),
            ("friction.decay_length_m = 1e-20", vec![], "friction.interfacial_stiffness_ratio: 1.02030405"),
            (
                "",
                vec!["friction.law=rigid", "friction.decay_length_m=0.01"],
                "friction.decay_length_m: 0.01 has no meaning for friction.law = \"rigid\"",
            ),
            (
                "slider.blocks = 1",
                vec!["friction.decay_length_m=0.01"],
                "friction.decay_length_m: 0.01 has no meaning for a single block: there is no block behind the first \
                 (accepted: none, or slider.blocks from 2)",
            ),
            ("slider.densty_kg_per_m3 = 3", vec![], "did you mean slider.density_kg_per_m3?"),
            ("", vec!["density=3"], "or slider.density_kg_per_m3?"),
            ("", vec!["rho=3"], "did you mean slider.density_kg_per_m3?"),
            ("", vec!["l_0=3"], "did you mean friction.decay_length_m?"),
        ] {
            let error = of(text, &overrides).unwrap_err();
            assert!(error.contains(problem), "{text}, {overrides:?}: {error}");
        }
        let error = resolve("slab", &["friction.decay_length_m=0.01"]).unwrap_err().to_string();
        assert!(error.contains("has no meaning for a slab: how a force on it decays"), "{error}");
    }

    #[test]
    fn a_log_has_the_mass_and_no_density() {
        let scenario = of("slider.density_kg_per_m3 = 2500", &[]).unwrap();
        let logged = ScenarioSource::logged("x.mcap", scenario.to_commented_toml());
        assert_eq!(Scenario::resolve(&logged).unwrap(), scenario);
        assert_eq!(scenario.hash(), of("slider.mass_kg = 0.025", &[]).unwrap().hash());
    }
}
