//! Rules of rate-and-state friction: what its start and its solver need, and what they leave without a meaning. Other
//! laws cannot have what only its solver computes.

use crate::choices::{DriveKind, Start};
use crate::derive::evolution_effects;
use crate::lattice_keys::Refusal;
use crate::scenario::Scenario;

/// The law, in refusals.
const THE_LAW: &str = "friction.law = \"rate-and-state\"";

/// Checks the rules. Keys at their defaults are accepted.
pub(crate) fn refused(scenario: &Scenario) -> Vec<Refusal> {
    let drive = &scenario.drive;
    let mut refused: Vec<Refusal> = Vec::new();
    let mut refuse = |key, problem: String, accepted: &str| refused.push((key, problem, accepted.to_owned()));
    let Some(law) = scenario.contact_law().rate_and_state() else {
        if !drive.course_s.is_empty() || !drive.course_m_per_s.is_empty() {
            let key = if drive.course_s.is_empty() { "drive.course_m_per_s" } else { "drive.course_s" };
            let why = "the solvers of this law need a drive of constant velocity, until it stops";
            refuse(key, why.to_owned(), &format!("none, or {THE_LAW}"));
        }
        return refused;
    };
    let slider = &scenario.slider;
    if slider.is_lattice() {
        let key = if slider.is_over_area() { "slider.across" } else { "slider.rows" };
        let problem = format!("{THE_LAW} is known for chains, not for a {}", scenario.elastic().name());
        refuse(key, problem, "1, or another friction.law");
    }
    if drive.kind == DriveKind::LeftRight {
        let problem = format!("by {THE_LAW} blocks begin in steady sliding, in one direction");
        refuse("drive.kind", problem, "\"side\" or \"top\"");
    }
    if drive.velocity_m_per_s == 0.0 {
        let problem = "0: contacts begin in the state of steady sliding at this velocity";
        refuse(
            "drive.velocity_m_per_s",
            problem.to_owned(),
            "a number above 0; drive.hold_from_s stops the drive",
        );
    } else if law.event_speed_m_per_s <= drive.velocity_m_per_s {
        refuse(
            "friction.event_speed_m_per_s",
            format!(
                "{} is not above drive.velocity_m_per_s = {}, at which blocks creep without an event",
                law.event_speed_m_per_s, drive.velocity_m_per_s
            ),
            &format!("a number above {}, or 0 for 10 times it", drive.velocity_m_per_s),
        );
    }
    if drive.stiffness_n_per_m == 0.0 && scenario.time.start == Start::Loaded {
        let problem = "0: nothing balances friction in steady sliding";
        refuse(
            "drive.stiffness_n_per_m",
            problem.to_owned(),
            "a number above 0, or time.start = \"at-rest\"",
        );
    }
    if drive.until_load_ratio > 0.0 {
        let problem =
            format!("{}: the steps of the adaptive solver do not end at a load", drive.until_load_ratio);
        refuse("drive.until_load_ratio", problem, "0, or drive.hold_from_s");
    }
    if !law.inertia {
        if law.radiation_kg_per_s == 0.0 {
            let problem = "0: without inertia only radiation bounds the velocity of a slip";
            let accepted = "a number above 0, or friction.inertia = true";
            refuse("friction.radiation_kg_per_s", problem.to_owned(), accepted);
        }
        if slider.relative_damping != 0.0 {
            let problem = format!(
                "{}: without inertia the velocity of a block follows from the forces on it alone, not from its neighbours'",
                slider.relative_damping
            );
            refuse("slider.relative_damping", problem, "0, or friction.inertia = true");
        }
    }
    let offsets = scenario.friction.evolution_offsets.len();
    // Lists of the wrong length have a rule of their own.
    if offsets == slider.contacts() as usize
        && let Some((n, b)) = evolution_effects(scenario).iter().enumerate().find(|(_, b)| **b <= 0.0)
    {
        let problem = format!("block {} gets b = {b}", n + 1);
        refuse("friction.evolution_offsets", problem, "b > 0 for every block");
    }
    let shear = &scenario.initial_shear;
    let moves = scenario.initial_velocity.amplitude_m_per_s;
    let why = format!("by {THE_LAW} shear and velocities at the start follow from time.start");
    for (key, value) in [
        ("initial_shear.beta", shear.beta),
        ("initial_shear.poisson_ratio", shear.poisson_ratio),
        ("initial_velocity.amplitude_m_per_s", moves),
    ] {
        if value != 0.0 {
            refuse(key, format!("{value}: {why}"), "0");
        }
    }
    for (key, is_there) in [
        ("initial_shear.profile", !shear.profile.is_empty()),
        ("initial_shear.profile_csv", !shear.profile_csv.is_empty()),
    ] {
        if is_there {
            refuse(key, format!("a profile: {why}"), "none");
        }
    }
    refused
}
