//! Refuses keys of slabs in chains and keys of chains in slabs.

use crate::choices::{DriveKind, Start};
use crate::derive::drive_row;
use crate::elastic::gaps;
use crate::keys::FOUNDATION_RATIO;
use crate::scenario::Scenario;

/// Most nodes of a slab.
const MOST_NODES: u64 = 1_000_000;

/// Accepted relative difference of the spacings along `x` and `z`; tighter than rounding to six
/// digits, which is therefore refused.
const SAME_SPACING: f64 = 1e-9;

/// A refusal: the key, the problem, and what is accepted.
pub(crate) type Refusal = (&'static str, String, String);

/// Checks the rules for slabs.
pub(crate) fn of_a_slab(scenario: &Scenario) -> Vec<Refusal> {
    let slider = &scenario.slider;
    let mut refused = Vec::new();
    if !slider.is_slab() {
        return refused;
    }
    let mut refuse = |key, problem: String, accepted: String| refused.push((key, problem, accepted));
    if slider.blocks == 1 {
        refuse(
            "slider.blocks",
            "1 column of nodes is no slab, whose spacing is that of its columns".to_owned(),
            "a whole number from 2, or slider.rows = 1".to_owned(),
        );
        return refused;
    }
    let nodes = u64::from(slider.blocks) * u64::from(slider.rows);
    if nodes > MOST_NODES {
        refuse(
            "slider.rows",
            format!("{} x {} nodes are {nodes}", slider.blocks, slider.rows),
            format!("at most {MOST_NODES} nodes"),
        );
    }
    let spacing_m = slider.length_m / gaps(slider.blocks as usize) as f64;
    let height_m = spacing_m * f64::from(slider.rows - 1);
    if (slider.height_m - height_m).abs() > SAME_SPACING * height_m {
        refuse(
            "slider.height_m",
            format!(
                "{} over {} rows is no square lattice with slider.length_m = {} over {} blocks",
                slider.height_m, slider.rows, slider.length_m, slider.blocks
            ),
            // Rounded as far as it is accepted.
            format!(
                "{}, or other numbers of rows and blocks",
                format!("{height_m:.10e}").parse().unwrap_or(height_m)
            ),
        );
    }
    if scenario.friction.law.holds() {
        refuse(
            "friction.law",
            "a slab at rest is held by friction springs, which this law does not have".to_owned(),
            "\"interfacial-springs\", or slider.rows = 1".to_owned(),
        );
    }
    let drive = &scenario.drive;
    if drive.kind == DriveKind::LeftRight {
        refuse(
            "drive.kind",
            "left-right needs the two-way rule, by which the contacts of a slab chatter".to_owned(),
            "\"side\" or \"top\", or slider.rows = 1".to_owned(),
        );
    }
    if drive.kind == DriveKind::Side && drive_row(scenario) >= slider.rows as usize {
        refuse(
            "drive.height_m",
            format!("{} is above the slab", drive.height_m),
            format!("a number from 0 to slider.height_m = {}", slider.height_m),
        );
    }
    let shear = &scenario.initial_shear;
    let has_profile = |csv: &str, profile: &[f64]| !csv.is_empty() || !profile.is_empty();
    for (key, is_there) in [
        ("initial_shear.beta", shear.beta != 0.0),
        ("initial_shear.poisson_ratio", shear.poisson_ratio != 0.0),
        ("initial_shear.profile", has_profile(&shear.profile_csv, &shear.profile)),
    ] {
        if is_there {
            refuse(
                key,
                "the shear of a slab at rest follows from its load and its elasticity (Poisson's ratio 1/3)"
                    .to_owned(),
                "none, or slider.rows = 1".to_owned(),
            );
        }
    }
    let prestress = &scenario.prestress;
    for (key, is_there) in [
        ("prestress.ratio", prestress.ratio != 0.0),
        ("prestress.first_block_ratio", prestress.first_block_ratio != 0.0),
        ("prestress.rise_ratio", prestress.rise_ratio != 0.0),
        ("prestress.profile", has_profile(&prestress.profile_csv, &prestress.profile)),
    ] {
        if is_there {
            refuse(
                key,
                "the only force from outside on a slab is its normal load".to_owned(),
                "none, or slider.rows = 1".to_owned(),
            );
        }
    }
    if scenario.initial_velocity.amplitude_m_per_s != 0.0 {
        refuse(
            "initial_velocity.amplitude_m_per_s",
            "it is that of a mode of a chain, and a slab begins at rest".to_owned(),
            "0, or slider.rows = 1".to_owned(),
        );
    }
    if scenario.time.start == Start::Loaded {
        refuse(
            "time.start",
            "\"loaded\" is where a chain follows its drive; a slab begins at rest".to_owned(),
            "\"at-rest\", or slider.rows = 1".to_owned(),
        );
    }
    refused
}

/// Checks the rules for chains: keys that only slabs can have.
pub(crate) fn of_a_chain(scenario: &Scenario) -> Vec<Refusal> {
    let mut refused = Vec::new();
    let (height_m, is_chain) = (scenario.drive.height_m, !scenario.slider.is_slab());
    if height_m != 0.0 && is_chain {
        refused.push((
            "drive.height_m",
            format!("a chain has no height to pull at, and {height_m} is given"),
            "0, or slider.rows above 1".to_owned(),
        ));
    } else if height_m != 0.0 && scenario.drive.kind != DriveKind::Side {
        refused.push((
            "drive.height_m",
            format!("{height_m} has no meaning for this drive"),
            "0, or drive.kind = \"side\"".to_owned(),
        ));
    }
    let ratio = scenario.normal_load.foundation_stiffness_ratio;
    if ratio.to_bits() != FOUNDATION_RATIO.to_bits() && is_chain {
        refused.push((
            "normal_load.foundation_stiffness_ratio",
            format!("a chain has no foundation, and {ratio} is given"),
            format!("{FOUNDATION_RATIO}, or slider.rows above 1"),
        ));
    }
    refused
}
