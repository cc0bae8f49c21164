//! Warns of sliders unlike any solid and of runs in which nothing can slip, and names the unit that was
//! probably mistaken.

use std::ops::RangeInclusive;

use crate::law::laws::FrictionLaw;
use crate::scenario::choices::ParameterSet;
use crate::scenario::stand_ins::default_of;
use crate::scenario::text::short;
use crate::scenario::{Scenario, Slider};
use crate::theory::preview::Preview;

/// Densities of solids, kg/m^3: from the lightest foams and aerogels to osmium, 22,590.
const DENSITIES: RangeInclusive<f64> = 10.0..=25_000.0;

/// Young's moduli of solids, Pa: from soft gels to diamond, 1.2e12.
const MODULI: RangeInclusive<f64> = 1e4..=1.3e12;

/// Speeds of waves in solids, m/s: from a few in soft gels to 18,000 in diamond.
const SPEEDS: RangeInclusive<f64> = 1.0..=20_000.0;

/// Speeds of drives, m/s: up to the fastest of stick-slip experiments; in mm/s or um/s most are above.
const DRIVES: RangeInclusive<f64> = 0.0..=0.1;

/// Length over the larger other side: of blocks that are wide or high, and of long bars.
const SLENDERNESS: RangeInclusive<f64> = 0.05..=1000.0;

/// Least normal load over the weight of the slider, which is part of it unless something else bears it.
const LEAST_LOAD_RATIO: f64 = 0.01;

const GRAVITY_M_PER_S2: f64 = 9.81;

/// A value must differ from its default by this factor to count as one in another unit, and be closer to it
/// in that unit: within a factor of 100 of the default there are other sliders.
const FAR: f64 = 100.0;

/// A key, its value in a scenario, and units in which it may have been written, with their values in SI.
type Slot = (&'static str, fn(&mut Scenario) -> &mut f64, &'static [(&'static str, f64)]);

const LENGTHS: &[(&str, f64)] = &[("mm", 1e-3), ("um", 1e-6)];

static SLOTS: [Slot; 8] = [
    ("slider.length_m", |scenario| &mut scenario.slider.length_m, LENGTHS),
    ("slider.width_m", |scenario| &mut scenario.slider.width_m, LENGTHS),
    ("slider.height_m", |scenario| &mut scenario.slider.height_m, LENGTHS),
    ("slider.mass_kg", |scenario| &mut scenario.slider.mass_kg, &[("g", 1e-3), ("mg", 1e-6)]),
    (MODULUS, |scenario| &mut scenario.slider.youngs_modulus_pa, &[("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3)]),
    (
        "drive.stiffness_n_per_m",
        |scenario| &mut scenario.drive.stiffness_n_per_m,
        &[("N/um", 1e6), ("N/mm", 1e3)],
    ),
    ("normal_load.total_n", |scenario| &mut scenario.normal_load.total_n, &[("mN", 1e-3)]),
    (VELOCITY, |scenario| &mut scenario.drive.velocity_m_per_s, &[("mm/s", 1e-3), ("um/s", 1e-6)]),
];

const MODULUS: &str = "slider.youngs_modulus_pa";
const VELOCITY: &str = "drive.velocity_m_per_s";

/// How many of the first slots may all be in one unit: the lengths.
const TOGETHER: usize = 3;

/// Warns of a density, a modulus or a speed of waves that solids do not have, and of a drive as fast as none.
pub(crate) fn no_solid(scenario: &Scenario) -> Option<String> {
    if scenario.slider.is_in_medium() {
        return None;
    }
    let outside = outside(scenario);
    let (key, value, _) = outside.first()?;
    let (written, question) = meant(scenario, key, *value);
    let words: Vec<&str> = outside.iter().map(|(.., words)| words.as_str()).collect();
    Some(format!("{written}: {}{question}", words.join("; ")))
}

/// Warns of a run that ends before anything can slip.
pub(crate) fn no_slip(scenario: &Scenario, preview: &Preview) -> Option<String> {
    if slips(scenario, preview) {
        return None;
    }
    let drive = &scenario.drive;
    // Contacts of junctions yield below their static friction.
    let has_junctions = scenario.friction.law == FrictionLaw::Junctions;
    let (limit, reaches) = match has_junctions {
        true => ("its contacts' strength", "yields"),
        false => ("static friction", "reaches its static friction"),
    };
    let when = match (preview.first_slip_s, preview.first_slip_block) {
        (Some(time_s), Some(block)) => format!("block {block} {reaches} at {} s", short(time_s)),
        (Some(time_s), None) => format!("{limit} is reached at {} s", short(time_s)),
        (None, _) => format!("{limit} is never reached"),
    };
    let (key, value) = match preview.first_slip_s {
        Some(_) => ("time.duration_s", scenario.time.duration_s),
        None if drive.hold_from_s > 0.0 => ("drive.hold_from_s", drive.hold_from_s),
        None if drive.until_load_ratio > 0.0 => ("drive.until_load_ratio", drive.until_load_ratio),
        None if drive.fastest_m_per_s() == 0.0 => ("drive.velocity_m_per_s", drive.velocity_m_per_s),
        None => ("drive.stiffness_n_per_m", drive.stiffness_n_per_m),
    };
    let (written, question) = meant(scenario, key, value);
    let duration = short(scenario.time.duration_s);
    Some(format!("{written}: nothing slips within {duration} s: {when}{question}"))
}

/// Whether anything can slip in a run; blocks that start moving may do so at any time.
fn slips(scenario: &Scenario, preview: &Preview) -> bool {
    !scenario.friction.law.sticks()
        || scenario.has_contact_courses()
        || scenario.initial_velocity.amplitude_m_per_s != 0.0
        || preview.first_slip_s.is_some_and(|time_s| time_s <= scenario.time.duration_s)
}

/// Properties that no solid and no experiment has, in words, each with the key to name.
fn outside(scenario: &Scenario) -> Vec<(&'static str, f64, String)> {
    // The mass of the set as-coded is intentionally a thousand times that of the real slider.
    let [as_coded_kg, as_stated_kg] = [true, false].map(|set| default_of("slider.mass_kg", set));
    let is_of_set = scenario.parameter_set == ParameterSet::AsCoded && scenario.slider.mass_kg == as_coded_kg;
    let heavier = if is_of_set { as_coded_kg / as_stated_kg } else { 1.0 };
    let density = scenario.density_kg_per_m3() / heavier;
    let speed = scenario.scales().wave_speed_m_per_s() * heavier.sqrt();
    let words = |what: &str, value: f64, unit: &str, range: &RangeInclusive<f64>, whose: &str| {
        (!range.contains(&value)).then(|| {
            let [least, most] = [range.start(), range.end()].map(|bound| short(*bound));
            format!("{what} is {}{unit}, and {whose} have {least} to {most}", short(value))
        })
    };
    let (slider, velocity, load_n) =
        (&scenario.slider, scenario.drive.velocity_m_per_s, scenario.normal_load.total_n);
    let slenderness = slider.length_m / slider.width_m.max(slider.height_m);
    let weight_n = slider.mass_kg / heavier * GRAVITY_M_PER_S2;
    let weight = (load_n < LEAST_LOAD_RATIO * weight_n)
        .then(|| format!("the normal load is less than a hundredth of the weight, {} N", short(weight_n)));
    // Without inertia the mass moves nothing.
    let dynamic = |words: Option<String>| words.filter(|_| scenario.has_inertia());
    let (modulus, mass) = (slider.youngs_modulus_pa, slider.mass_kg);
    let (solids, sliders, tests) = ("solids", "sliders", "experiments on stick-slip");
    [
        (MODULUS, modulus, words("Young's modulus", modulus, " Pa", &MODULI, solids)),
        ("slider.mass_kg", mass, dynamic(words("the density", density, " kg/m^3", &DENSITIES, solids))),
        (MODULUS, modulus, dynamic(words("the speed of waves", speed, " m/s", &SPEEDS, solids))),
        (
            "slider.length_m",
            slider.length_m,
            words("the length over the larger other side", slenderness, "", &SLENDERNESS, sliders),
        ),
        ("normal_load.total_n", load_n, dynamic(weight)),
        (VELOCITY, velocity, words("the speed of the drive", velocity.abs(), " m/s", &DRIVES, tests)),
    ]
    .into_iter()
    .filter_map(|(key, value, words)| Some((key, value, words?)))
    .collect()
}

/// Values as they are written, and those that were probably meant, as the end of a sentence: the ones of the key that is
/// to blame, and nothing, unless others were probably written in another unit. Converted, these are closest to their
/// defaults among the candidates that leave no warning.
fn meant(scenario: &Scenario, to_blame: &str, value: f64) -> (String, String) {
    let is_good = |other: &Scenario| outside(other).is_empty() && slips(other, &other.preview());
    let volume_m3 = |of: &Slider| of.length_m * of.width_m * of.height_m;
    // The mass may be written, or follow from the sides.
    let read = |slots: &'static [Slot], unit: usize, follows: bool| {
        let mut other = scenario.clone();
        let mut distance: f64 = 0.0;
        let (mut before, mut after) = (Vec::new(), Vec::new());
        for (key, value, units) in slots {
            let default = default_of(key, scenario.parameter_set == ParameterSet::AsCoded);
            let value = value(&mut other);
            let far = |value: f64| (value / default).max(default / value);
            if far(*value) < FAR {
                return None;
            }
            before.push(short(*value));
            *value *= units.get(unit)?.1;
            after.push(short(*value));
            distance = distance.max(far(*value));
        }
        if follows {
            other.slider.mass_kg *= volume_m3(&other.slider) / volume_m3(&scenario.slider);
        }
        let (keys, unit) = (slots.iter().map(|(key, ..)| *key).collect::<Vec<_>>(), slots[0].2[unit].0);
        let [keys, before, after] = [keys.join(", "), before.join(", "), after.join(", ")];
        let question = format!("; was {after} meant, that is {before} {unit}?");
        (distance < FAR).then_some((distance, other, (format!("{keys} = {before}"), question)))
    };
    let groups = SLOTS.iter().map(std::slice::from_ref).chain([&SLOTS[..TOGETHER]]);
    let groups = groups.flat_map(|slots| (0..slots[0].2.len()).map(move |unit| (slots, unit)));
    let both = groups.flat_map(|group| [(group, false), (group, true)]);
    let mut candidates: Vec<_> =
        both.filter_map(|((slots, unit), follows)| read(slots, unit, follows)).collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let found = candidates.into_iter().find(|(_, other, _)| is_good(other));
    found.map_or_else(|| (format!("{to_blame} = {}", short(value)), String::new()), |(.., words)| words)
}

#[cfg(test)]
mod tests {
    use crate::resolve;
    use crate::scenario::builtin;

    fn warnings(sets: &[&str]) -> Vec<String> {
        let scenario = resolve("default", sets).unwrap_or_else(|errors| panic!("{errors}"));
        scenario.warnings().into_iter().map(|warning| warning.text).collect()
    }

    #[test]
    fn values_in_other_units_are_warned_of_in_both_sets() {
        for set in ["parameter_set=as-coded", "parameter_set=as-stated"] {
            let said = warnings(&[set, "slider.length_m=100"]).concat();
            assert!(said.starts_with("slider.length_m = 100: "), "{said}");
            let end = "the length over the larger other side is 5000, and sliders have 0.05 to 1000; was 0.1 meant, that \
                       is 100 mm?";
            assert!(said.ends_with(end), "{said}");

            for (written, meant) in
                [("0.2", "2e-4 meant, that is 0.2 mm/s?"), ("200", "2e-4 meant, that is 200 um/s?")]
            {
                let said = warnings(&[set, &format!("drive.velocity_m_per_s={written}")]).concat();
                let start = format!(
                    "drive.velocity_m_per_s = {written}: the speed of the drive is {written} m/s, and "
                );
                assert!(said.starts_with(&start) && said.ends_with(meant), "{said}");
            }

            let said = warnings(&[set, "slider.youngs_modulus_pa=2.5"]);
            assert_eq!(said.len(), 2, "{said:?}");
            let start = "slider.youngs_modulus_pa = 2.5: Young's modulus is 2.5 Pa, and solids have 10000 to 1.3e12; \
                         the speed of waves is ";
            let end = "; was 2.5e9 meant, that is 2.5 GPa?";
            assert!(said[0].starts_with(start) && said[0].ends_with(end), "{said:?}");
            let start = "slider.youngs_modulus_pa = 2.5: nothing slips within 5 s: block 1 reaches its static friction at ";
            assert!(said[1].starts_with(start) && said[1].ends_with(end), "{said:?}");

            let expected = "drive.stiffness_n_per_m = 0.8: nothing slips within 5 s: block 1 reaches its static friction \
                            at 56630 s; was 8e5 meant, that is 0.8 N/um?";
            assert_eq!(warnings(&[set, "drive.stiffness_n_per_m=0.8"]), [expected]);
        }
    }

    #[test]
    fn lengths_may_all_be_in_millimetres() {
        let lengths = ["slider.length_m=100", "slider.width_m=5", "slider.height_m=20"];
        for (set, wrong) in [
            ("parameter_set=as-coded", "the density is "),
            ("parameter_set=as-stated", "the normal load is less than a hundredth of the weight, "),
        ] {
            let said = warnings(&[&[set], &lengths[..]].concat());
            let start = format!("slider.length_m, slider.width_m, slider.height_m = 100, 5, 20: {wrong}");
            assert!(said[0].starts_with(&start), "{said:?}");
            assert!(said[0].ends_with("; was 0.1, 0.005, 0.02 meant, that is 100, 5, 20 mm?"), "{said:?}");
        }
    }

    #[test]
    fn what_cannot_be_guessed_is_not() {
        let said = warnings(&["slider.mass_kg=1"]);
        assert_eq!(said, ["slider.mass_kg = 1: the density is 1e5 kg/m^3, and solids have 10 to 25000"]);
        // Without inertia the mass moves nothing.
        let law = ["friction.law=rate-and-state", "friction.critical_slip_m=1e-4", "slider.mass_kg=1"];
        let without =
            ["friction.inertia=false", "friction.radiation_kg_per_s=100", "slider.relative_damping=0"];
        assert_eq!((warnings(&law).len(), warnings(&[law, without].concat())), (1, Vec::new()));
        let said = warnings(&["time.duration_s=0.01"]);
        let expected = "time.duration_s = 0.01: nothing slips within 0.01 s: block 1 reaches its static friction at \
                        0.05674 s";
        assert_eq!(said, [expected]);
    }

    #[test]
    fn a_drive_that_never_gets_there_is_named() {
        let of = |set: &str| warnings(&[set]).concat();
        for (set, start) in [
            ("drive.hold_from_s=0.01", "drive.hold_from_s = 0.01: "),
            ("drive.until_load_ratio=0.001", "drive.until_load_ratio = 0.001: "),
            ("drive.velocity_m_per_s=0", "drive.velocity_m_per_s = 0: "),
            ("drive.stiffness_n_per_m=0", "drive.stiffness_n_per_m = 0: "),
        ] {
            let said = of(set);
            let expected = format!("{start}nothing slips within 5 s: static friction is never reached");
            assert_eq!(said, expected);
        }
        assert_eq!(
            warnings(&["drive.velocity_m_per_s=0", "initial_velocity.amplitude_m_per_s=0.1"]),
            [""; 0]
        );
    }

    #[test]
    fn built_in_scenarios_are_of_solids_and_slip() {
        let mut without = 0;
        for (name, _) in builtin::all() {
            // Young's modulus of lattices, which take long, is the same in both sets.
            let sets = ["parameter_set=as-stated", "parameter_set=as-coded"];
            let is_lattice = resolve::<&str>(name, &[]).unwrap().slider.is_lattice();
            for set in &sets[..if is_lattice { 1 } else { 2 }] {
                let warnings = resolve(name, &[set]).unwrap().warnings();
                without += usize::from(warnings.is_empty());
                let kinds: Vec<&str> = warnings.iter().map(|warning| warning.kind).collect();
                // Its units are those of a model without dimensions.
                let is_of_numbers = name == "carlson-langer";
                assert!(
                    kinds.contains(&"no-solid") == is_of_numbers && !kinds.contains(&"no-slip"),
                    "{name} {set}: {kinds:?}"
                );
            }
        }
        assert!(without > 25, "only {without} have no warning");
    }
}
