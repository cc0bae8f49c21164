//! Rules of slabs, sheets and bodies: their sizes, and what of laws and drives is known for them.

use asperity_record::MOST_BLOCKS;

use crate::plan::derive::drive_row;
use crate::scenario::choices::{DriveKind, Reattach};
use crate::scenario::source::Refusals;
use crate::scenario::{Scenario, Slider};

/// Most nodes of a lattice.
const MOST_NODES: u64 = 1_000_000;

/// Accepted relative difference of the spacings along two axes; tighter than rounding to six digits, which is
/// therefore refused.
const SAME_SPACING: f64 = 1e-9;

/// Refuses a slider with more nodes or contacts than there may be.
pub(super) fn too_large(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let &Slider { blocks, across, rows, .. } = &scenario.slider;
    let contacts = u64::from(blocks) * u64::from(across);
    let nodes = contacts * u64::from(rows);
    if contacts > MOST_BLOCKS {
        let problem = format!("{blocks} x {across} contacts are {contacts}");
        refusals.refuse("slider.across", problem, format!("at most {MOST_BLOCKS} contacts"));
    } else if scenario.slider.is_lattice() && nodes > MOST_NODES {
        let across = if across > 1 { format!("{across} x ") } else { String::new() };
        let problem = format!("{blocks} x {across}{rows} nodes are {nodes}");
        refusals.refuse("slider.rows", problem, format!("at most {MOST_NODES} nodes"));
    }
}

pub(super) fn lattices_are_square_and_known(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (slider, law) = (&scenario.slider, scenario.friction.law);
    if !slider.is_lattice() {
        return;
    }
    let (what, chain) = (scenario.elastic().table.name, slider.keys_of_a_chain());
    if slider.blocks == 1 {
        refusals.refuse(
            "slider.blocks",
            format!("1 column of nodes is no {what}, whose spacing is that of its columns"),
            format!("a whole number from 2, or {chain}"),
        );
        return;
    }
    let spacing_m = slider.spacing_m();
    for (key, length_m, nodes, over) in [
        ("slider.height_m", slider.height_m, slider.rows, "rows"),
        ("slider.width_m", slider.width_m, slider.across, "rows across"),
    ] {
        let right_m = spacing_m * f64::from(nodes - 1);
        if nodes > 1 && (length_m - right_m).abs() > SAME_SPACING * right_m {
            // Rounded as far as it is accepted.
            let shown_m: f64 = format!("{right_m:.10e}").parse().unwrap_or(right_m);
            let along = format!("slider.length_m = {} over {} blocks", slider.length_m, slider.blocks);
            refusals.refuse(
                key,
                format!("{length_m} over {nodes} {over} is no square lattice with {along}"),
                format!("{shown_m}, or other numbers of {over} and blocks"),
            );
        }
    }
    if law.holds() {
        refusals.refuse(
            "friction.law",
            format!("a {what} at rest is held by friction springs, which this law does not have"),
            format!("\"interfacial-springs\", or {chain}"),
        );
    } else if slider.is_over_area() && !law.is_known_over_an_area() {
        let law = law.word();
        refusals.refuse(
            "friction.law",
            format!(
                "how the contacts of a {what} slip along a vector is not derived for friction.law = {law:?}"
            ),
            "\"interfacial-springs\", or slider.across = 1",
        );
    }
    let is_side = scenario.drive.kind == DriveKind::Side;
    if slider.rows > 1 && is_side && drive_row(scenario) >= slider.rows as usize {
        refusals.refuse(
            "drive.height_m",
            format!("{} is above the {what}", scenario.drive.height_m),
            format!("a number from 0 to slider.height_m = {}", slider.height_m),
        );
    }
    if slider.is_over_area() && scenario.drive.across > slider.across {
        refusals.refuse(
            "drive.across",
            format!("the {what} has no row {} across", scenario.drive.across),
            format!("a whole number from 0 to slider.across = {}", slider.across),
        );
    }
}

pub(super) fn contacts_over_an_area_turn(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let is_over_area = scenario.slider.is_over_area();
    let why = match scenario.friction.reattach {
        // Other laws are refused themselves.
        _ if is_over_area && !scenario.friction.law.is_known_over_an_area() => return,
        Reattach::OneWay if is_over_area => {
            "\"one-way\" stops in every step what the torque of the drive turns backwards: contacts over an area then \
             chatter"
        }
        Reattach::TwoWay if is_over_area => {
            "\"two-way\" stops in the first step what detaches while it still moves the other way: contacts over an \
             area then chatter"
        }
        Reattach::Turn if !is_over_area => {
            "\"turn\" is for contacts that slip along a vector; in one row it is \"one-way\" for whatever detaches \
             forwards"
        }
        _ => return,
    };
    let accepted = match is_over_area {
        true => "\"turn\", or slider.across = 1",
        false => "\"one-way\" or \"two-way\", or slider.across above 1",
    };
    refusals.refuse("friction.reattach", why, accepted);
}
