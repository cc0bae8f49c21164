//! A scenario by what the log of a recording tells of a model.

use std::collections::BTreeMap;

use asperity_record::short;
use toml::Value;

use crate::description::{Description, Role};
use crate::estimates::median_of;

/// Keys of a scenario, numbers that tell them, the better first, and where those come from.
const KEYS: [(&str, &str, &str); 8] = [
    ("friction.dynamic_coefficient", "dynamic_coefficient", "mean F_T/F_N from the first global slip"),
    ("friction.dynamic_coefficient", "dynamic_coefficient_first_reach", "loads of first reach"),
    ("friction.static_coefficient", "static_coefficient", "shear before arrivals, a lower bound"),
    ("drive.stiffness_n_per_m", "drive_stiffness_n_per_m", "F_T on the stretch of the spring"),
    ("drive.stiffness_n_per_m", "system_stiffness_n_per_m", "loading rate over V, a lower bound"),
    ("drive.velocity_m_per_s", "drive_velocity_m_per_s", "line through the load point"),
    ("normal_load.total_n", "normal_load_n", "median of F_N, or declared"),
    ("normal_load.tilt", "tilt", "loads of first reach, without initial shear"),
];

/// A scenario with those numbers, values with their standard errors, of a recording with those normal loads at its
/// records. Other keys keep their defaults, as do those whose number no scenario can have.
pub fn scenario(
    description: &Description,
    mut numbers: BTreeMap<String, [f64; 2]>,
    normal_loads_n: Vec<f64>,
    duration_s: f64,
) -> String {
    let slider = &description.slider;
    let measures_load =
        description.forces.and_then(|n| description.streams[n].with(Role::NormalForce)).is_some();
    let declared = slider.normal_force_n.map(|load| [load.0, 0.0]);
    let normal_load = if measures_load { median_of(normal_loads_n) } else { declared };
    numbers.extend(normal_load.map(|load| ("normal_load_n".to_owned(), load)));
    numbers.retain(|name, [value, _]| if name == "tilt" { value.abs() < 1.0 } else { *value > 0.0 });
    let dynamic = KEYS[..2].iter().find_map(|(_, number, _)| numbers.get(*number)).map_or(0.0, |of| of[0]);
    // A stuck block bears no less than a sliding one.
    numbers.retain(|name, [value, _]| name != "static_coefficient" || *value >= dynamic);
    let mut lines = vec![
        format!("name = {}", Value::String(description.name.clone())),
        "summary = \"Estimated from a recording\"".to_owned(),
        "parameter_set = \"as-stated\"".to_owned(),
    ];
    let density = slider.youngs_modulus_pa.0 / slider.wave_speed_m_per_s().powi(2);
    for (key, value) in [
        ("slider.length_m", slider.length_m.0),
        ("slider.width_m", slider.width_m.0),
        ("slider.height_m", slider.height_m.0),
        ("slider.youngs_modulus_pa", slider.youngs_modulus_pa.0),
        ("slider.density_kg_per_m3", density),
        ("time.duration_s", (duration_s * 1e3).ceil() / 1e3),
    ] {
        lines.push(format!("{key} = {}  # declared", Value::Float(value)));
    }
    for of_key in KEYS.chunk_by(|a, b| a.0 == b.0) {
        let key = of_key[0].0;
        let told = of_key.iter().find_map(|(_, number, origin)| Some((numbers.get(*number)?, origin)));
        lines.push(match told {
            Some(([value, error], origin)) => {
                format!("{key} = {}  # +- {}: {origin}", Value::Float(*value), short(*error))
            }
            None if key == "friction.static_coefficient" && dynamic > 0.7 => {
                format!(
                    "{key} = {}  # not identifiable; as far above dynamic_coefficient as by default",
                    Value::Float(dynamic * 0.7 / 0.45)
                )
            }
            None => format!("# {key}: not identifiable, so it keeps its default"),
        });
    }
    lines.join("\n") + "\n"
}
