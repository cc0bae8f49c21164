//! From the log of a recording to a scenario: what of a model its events and samples tell, with errors.
//!
//! Friction and tilt follow from *first reach*: up to the first global rupture, a precursor that begins at the driven
//! end and for the first time reaches a place `x` needs `F_T / F_N = mu_d (x + theta (x - x^2))`, with `x` over the
//! length of the slider. That load lies between those of the rupture which did and of the last one before which had
//! reached farthest.

use std::collections::BTreeMap;

use asperity_record::{Estimates, EventPayload, LoadDrop, Rupture, Sensors, short};
use toml::Value;

use crate::description::{Description, Role};
use crate::estimates::{Estimate, median_of};

/// Fewest points of first reach to which a line of two parameters is fitted.
const FEWEST_POINTS: usize = 4;

/// Where a sensor was first reached by a precursor from the driven end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FirstReach {
    /// The sensor, counted from 1.
    pub sensor: u32,
    /// Its distance from the driven end over the length of the slider.
    pub x_over_l: f64,
    /// `F_T / F_N` then, and its standard error.
    pub ft_fn: [f64; 2],
}

/// The points of first reach of the ruptures of a recording, in any order.
pub fn first_reach(sensors: &Sensors, ruptures: &[Rupture]) -> Vec<FirstReach> {
    let mut from_end: Vec<&Rupture> = ruptures.iter().filter(|rupture| rupture.first_block == 1).collect();
    from_end.sort_by_key(|rupture| rupture.onset_step);
    let global = from_end.iter().position(|rupture| rupture.reached_every_block);
    from_end.truncate(global.map_or(from_end.len(), |global| global + 1));
    let (mut points, mut farthest): (Vec<FirstReach>, Option<&Rupture>) = (Vec::new(), None);
    for rupture in from_end {
        let before = farthest.unwrap_or(rupture);
        if rupture.last_block < before.last_block {
            continue;
        }
        let [low, high] = [before.ft_fn_onset, rupture.ft_fn_onset];
        let ft_fn = [(low + high) / 2.0, (high - low).abs() / 12f64.sqrt()];
        points.extend((before.last_block + 1..=rupture.last_block).filter_map(|sensor| {
            let x_over_l = sensors.x_m(sensor)? / sensors.length_m;
            Some(FirstReach { sensor, x_over_l, ft_fn })
        }));
        farthest = Some(rupture);
    }
    points
}

/// `mu_d` and the tilt `theta` of the normal load by points `x / L` and `F_T / F_N` of first reach; none of fewer than
/// four. The errors are those of the fit, up to ten times too small.
pub fn length_law(points: &[[f64; 2]]) -> Option<[[f64; 2]; 2]> {
    let [mut aa, mut ab, mut bb, mut ay, mut by] = [0.0; 5];
    for [x, y] in points {
        let bend = x - x * x;
        [aa, ab, bb, ay, by] = [aa + x * x, ab + x * bend, bb + bend * bend, ay + x * y, by + bend * y];
    }
    let determinant = aa * bb - ab * ab;
    let (a, b) = ((bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant);
    let squares: f64 = points.iter().map(|[x, y]| (y - a * x - b * (x - x * x)).powi(2)).sum();
    let variance = squares / (points.len() as f64 - 2.0) / determinant;
    let (a_error, b_error) = ((variance * bb).sqrt(), (variance * aa).sqrt());
    let is_fit = points.len() >= FEWEST_POINTS && determinant > 0.0 && a > 0.0;
    is_fit.then(|| [[a, a_error], [b / a, (b_error / a).hypot(b * a_error / (a * a))]])
}

/// All numbers that are identifiable, by their names, with their standard errors.
pub fn numbers(
    estimates: &Estimates,
    drops: &[LoadDrop],
    reach: &[FirstReach],
) -> BTreeMap<&'static str, [f64; 2]> {
    let cells = estimates.cells();
    let told = Estimates::COLUMNS.chunks_exact(2).zip(cells.as_ref().chunks_exact(2)).skip(1);
    let mut found: BTreeMap<&str, Estimate> = told
        .filter_map(|(columns, cells)| Some((&*columns[0].name, [cells[0].number()?, cells[1].number()?])))
        .collect();
    if let Some([speed, _]) = found.get("drive_velocity_m_per_s").copied().filter(|[speed, _]| *speed != 0.0)
        && let Some(rate) = median_of(drops.iter().map(|drop| drop.loading_rate_n_per_s).collect())
    {
        found.insert("system_stiffness_n_per_m", rate.map(|of| of / speed));
    }
    let points: Vec<[f64; 2]> = reach.iter().map(|point| [point.x_over_l, point.ft_fn[0]]).collect();
    if let Some([dynamic, tilt]) = length_law(&points) {
        found.extend([("dynamic_coefficient_first_reach", dynamic), ("tilt", tilt)]);
    }
    found
}

/// A key of a scenario: its section and name, the numbers that may give it, each with its origin, and what it takes.
type Key = (&'static str, &'static str, &'static [(&'static str, &'static str)], &'static str);

const KEYS: [Key; 6] = [
    (
        "friction",
        "dynamic_coefficient",
        &[
            ("dynamic_coefficient", "mean of F_T/F_N from the first global slip on"),
            ("dynamic_coefficient_first_reach", "loads at which precursors first reached each sensor"),
        ],
        "a global slip, or four sensors beyond the first precursor",
    ),
    (
        "friction",
        "static_coefficient",
        &[(
            "static_coefficient",
            "largest local shear before arrivals; a lower bound, since a gauge averages",
        )],
        "shear gauges with normal_n",
    ),
    (
        "drive",
        "stiffness_n_per_m",
        &[
            ("drive_stiffness_n_per_m", "slope of F_T on the load point less the slip at the pushed end"),
            (
                "system_stiffness_n_per_m",
                "median loading rate over V; a lower bound, for the slider yields too",
            ),
        ],
        "load point, and slip at the pushed end or load drops",
    ),
    (
        "drive",
        "velocity_m_per_s",
        &[("drive_velocity_m_per_s", "line through the load point")],
        "a load point",
    ),
    ("normal_load", "total_n", &[("normal_load", "median of F_N, or declared")], "F_N"),
    (
        "normal_load",
        "tilt",
        &[("tilt", "loads at which precursors first reached each sensor, without initial shear")],
        "four sensors beyond the first precursor",
    ),
];

/// A scenario with what is identifiable, and why the rest has its default, of a recording with those normal loads at the
/// times of its records. Numbers that no scenario can have are taken as not identifiable.
pub fn scenario(
    description: &Description,
    numbers: &BTreeMap<&'static str, [f64; 2]>,
    normal_loads_n: &[f64],
    duration_s: f64,
) -> String {
    let slider = &description.slider;
    let (modulus, speed) = (slider.youngs_modulus_pa.0, slider.wave_speed_m_per_s());
    let measures_load =
        description.forces.and_then(|n| description.streams[n].with(Role::NormalForce)).is_some();
    let normal_load = match slider.normal_force_n {
        _ if measures_load => median_of(normal_loads_n.to_vec()),
        declared => declared.map(|load| [load.0, 0.0]),
    };
    let known = |name: &str| if name == "normal_load" { normal_load } else { numbers.get(name).copied() };
    let fits = |name: &str, [value, _]: &Estimate| if name == "tilt" { value.abs() < 1.0 } else { *value > 0.0 };
    let float = |value: f64| Value::Float(value).to_string();
    let mut text = format!("name = {}\n", Value::String(description.name.clone()));
    text += "summary = \"Estimated from a recording\"\n\n[slider]\n# Declared in the recording.\n";
    for (key, value) in [
        ("length_m", slider.length_m.0),
        ("width_m", slider.width_m.0),
        ("height_m", slider.height_m.0),
        ("youngs_modulus_pa", modulus),
    ] {
        text += &format!("{key} = {}\n", float(value));
    }
    let density = float(modulus / (speed * speed));
    text += &format!("# By the wave speed {} m/s.\ndensity_kg_per_m3 = {density}\n", short(speed));
    let mut section = "slider";
    let mut dynamic: f64 = 0.0;
    for (of, key, sources, takes) in KEYS {
        if of != section {
            text += &format!("\n[{of}]\n");
            section = of;
        }
        let found = sources
            .iter()
            .find_map(|(name, origin)| Some((known(name).filter(|of| fits(name, of))?, origin)));
        // It must not be below the dynamic one.
        let is_static = key == "static_coefficient";
        text += &match found.filter(|([value, _], _)| !is_static || *value >= dynamic) {
            Some(([value, error], origin)) => {
                dynamic = if key == "dynamic_coefficient" { value } else { dynamic };
                format!("# +- {}: {origin}.\n{key} = {}\n", short(error), float(value))
            }
            None if is_static && dynamic > 0.7 => {
                format!(
                    "# Not identifiable without {takes}, and not below dynamic_coefficient.\n{key} = {}\n",
                    float(dynamic)
                )
            }
            None => format!("# {key} is not identifiable without {takes}: it keeps its default.\n"),
        };
    }
    let duration_s = (duration_s * 1e3).ceil() / 1e3;
    text + &format!("\n[time]\n# As long as the recording.\nduration_s = {}\n", float(duration_s))
}
