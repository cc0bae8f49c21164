//! Refuses keys that slabs, sheets and bodies cannot have, and keys of these in sliders that lack what they are
//! about: a height, a foundation, rows across.

use asperity_record::MOST_BLOCKS;

use crate::choices::{DetachBy, DriveKind, Reattach, Start};
use crate::derive::drive_row;
use crate::keys::FOUNDATION_RATIO;
use crate::scenario::{Scenario, Slider};

/// Most nodes of a lattice.
const MOST_NODES: u64 = 1_000_000;

/// Accepted relative difference of the spacings along two axes; tighter than rounding to six digits, which is
/// therefore refused.
const SAME_SPACING: f64 = 1e-9;

/// A refusal: the key, the problem, and what is accepted.
pub(crate) type Refusal = (&'static str, String, String);

/// The refusal of a slider with more nodes or contacts than there may be.
pub(crate) fn too_large(scenario: &Scenario) -> Option<Refusal> {
    let &Slider { blocks, across, rows, .. } = &scenario.slider;
    let contacts = u64::from(blocks) * u64::from(across);
    let nodes = contacts * u64::from(rows);
    if contacts > MOST_BLOCKS {
        let problem = format!("{blocks} x {across} contacts are {contacts}");
        return Some(("slider.across", problem, format!("at most {MOST_BLOCKS} contacts")));
    }
    let counts =
        if across > 1 { format!("{blocks} x {across} x {rows}") } else { format!("{blocks} x {rows}") };
    let is_lattice = scenario.slider.is_lattice();
    (is_lattice && nodes > MOST_NODES).then(|| {
        ("slider.rows", format!("{counts} nodes are {nodes}"), format!("at most {MOST_NODES} nodes"))
    })
}

/// Checks the rules for slabs, sheets and bodies.
pub(crate) fn of_a_lattice(scenario: &Scenario) -> Vec<Refusal> {
    let slider = &scenario.slider;
    let mut refused = Vec::new();
    if !slider.is_lattice() {
        return refused;
    }
    let what = scenario.elastic().table.name;
    // The chain of a slider that can have what this one cannot.
    let or_chain = match (slider.is_over_area(), slider.rows > 1) {
        (false, _) => "slider.rows = 1",
        (true, false) => "slider.across = 1",
        (true, true) => "slider.across = 1 and slider.rows = 1",
    };
    let or = |accepted: &str| format!("{accepted}, or {or_chain}");
    if slider.blocks == 1 {
        refused.push((
            "slider.blocks",
            format!("1 column of nodes is no {what}, whose spacing is that of its columns"),
            or("a whole number from 2"),
        ));
        return refused;
    }
    refused.extend(spacings(slider));
    let mut refuse = |key, problem: String, accepted: String| refused.push((key, problem, accepted));
    let law = scenario.friction.law;
    if law.holds() {
        refuse(
            "friction.law",
            format!("a {what} at rest is held by friction springs, which this law does not have"),
            or("\"interfacial-springs\""),
        );
    } else if slider.is_over_area() && !law.is_known_over_an_area() {
        refuse(
            "friction.law",
            format!(
                "how the contacts of a {what} slip along a vector is not derived for friction.law = {:?}",
                law.word()
            ),
            "\"interfacial-springs\", or slider.across = 1".to_owned(),
        );
    }
    if scenario.contact_law().radiation_kg_per_s() != 0.0 {
        let problem =
            format!("a {what} carries the waves away itself; radiation is that of a chain's contacts");
        refuse("friction.radiation_kg_per_s", problem, or("0"));
    }
    if scenario.friction.detach_by != DetachBy::Force {
        let problem =
            format!("\"spring\": how the contacts of a {what} detach by their springs is not derived");
        refuse("friction.detach_by", problem, or("\"force\""));
    }
    if scenario.drive.kind == DriveKind::LeftRight {
        refuse(
            "drive.kind",
            format!("left-right needs the two-way rule, by which the contacts of a {what} chatter"),
            or("\"side\" or \"top\""),
        );
    }
    if !scenario.drive.course_s.is_empty() {
        let problem = format!("the drive of a {what} has a constant velocity, until it stops");
        refuse("drive.course_s", problem, or("none"));
    }
    if slider.rows > 1
        && scenario.drive.kind == DriveKind::Side
        && drive_row(scenario) >= slider.rows as usize
    {
        refuse(
            "drive.height_m",
            format!("{} is above the {what}", scenario.drive.height_m),
            format!("a number from 0 to slider.height_m = {}", slider.height_m),
        );
    }
    let shear = &scenario.initial_shear;
    let has_profile = |csv: &str, profile: &[f64]| !csv.is_empty() || !profile.is_empty();
    let why = match what {
        "slab" => {
            "the shear of a slab at rest follows from its load and its elasticity (Poisson's ratio 1/3)"
        }
        "sheet" => "the load of a sheet is given and does not stretch it, so it begins without shear",
        _ => "the shear of a body at rest follows from its load and its elasticity (Poisson's ratio 1/4)",
    };
    for (key, is_there) in [
        ("initial_shear.beta", shear.beta != 0.0),
        ("initial_shear.poisson_ratio", shear.poisson_ratio != 0.0),
        ("initial_shear.profile", has_profile(&shear.profile_csv, &shear.profile)),
    ] {
        if is_there {
            refuse(key, why.to_owned(), or("none"));
        }
    }
    let prestress = &scenario.prestress;
    for (key, is_there) in [
        ("prestress.ratio", prestress.ratio != 0.0),
        ("prestress.first_block_ratio", prestress.first_block_ratio != 0.0),
        ("prestress.rise_ratio", prestress.rise_ratio != 0.0),
        ("prestress.from_blocks", !prestress.from_blocks.is_empty()),
        ("prestress.profile", has_profile(&prestress.profile_csv, &prestress.profile)),
    ] {
        if is_there {
            refuse(key, format!("the only force from outside on a {what} is its normal load"), or("none"));
        }
    }
    if scenario.initial_velocity.amplitude_m_per_s != 0.0 {
        refuse(
            "initial_velocity.amplitude_m_per_s",
            format!("it is that of a mode of a chain, and a {what} begins at rest"),
            or("0"),
        );
    }
    // The default of laws by which nothing sticks, known for chains alone.
    if scenario.time.start == Start::Loaded && law.sticks() {
        refuse(
            "time.start",
            format!("\"loaded\" is where a chain follows its drive; a {what} begins at rest"),
            or("\"at-rest\""),
        );
    }
    refused.extend(over_an_area(scenario, what));
    refused
}

/// Lengths that are no multiples of the spacing along the sliding direction.
fn spacings(slider: &Slider) -> impl Iterator<Item = Refusal> {
    let spacing_m = slider.spacing_m();
    [
        ("slider.height_m", slider.height_m, slider.rows, "rows", "rows and blocks"),
        ("slider.width_m", slider.width_m, slider.across, "rows across", "rows across and blocks"),
    ]
    .into_iter()
    .filter_map(move |(key, length_m, nodes, over, numbers)| {
        let right_m = spacing_m * f64::from(nodes - 1);
        let is_wrong = nodes > 1 && (length_m - right_m).abs() > SAME_SPACING * right_m;
        // Rounded as far as it is accepted.
        let shown_m: f64 = format!("{right_m:.10e}").parse().unwrap_or(right_m);
        is_wrong.then(|| {
            (
                key,
                format!(
                    "{length_m} over {nodes} {over} is no square lattice with slider.length_m = {} over {} blocks",
                    slider.length_m, slider.blocks
                ),
                format!("{shown_m}, or other numbers of {numbers}"),
            )
        })
    })
}

/// The rules for contacts over an area.
fn over_an_area(scenario: &Scenario, what: &str) -> Vec<Refusal> {
    let (slider, friction, drive) = (&scenario.slider, &scenario.friction, &scenario.drive);
    let mut refused = Vec::new();
    if !slider.is_over_area() {
        return refused;
    }
    let why = match friction.reattach {
        Reattach::Turn => None,
        Reattach::OneWay => {
            Some("\"one-way\" stops in every step what the torque of the drive turns backwards")
        }
        Reattach::TwoWay => {
            Some("\"two-way\" stops in the first step what detaches while it still moves the other way")
        }
    };
    // Other laws are refused themselves.
    if let Some(why) = why.filter(|_| friction.law.is_known_over_an_area()) {
        let problem = format!("{why}: the contacts of a {what} then chatter");
        refused.push(("friction.reattach", problem, "\"turn\", or slider.across = 1".to_owned()));
    }
    if friction.ageing_coefficient != 0.0 {
        refused.push((
            "friction.ageing_coefficient",
            "the strength of contacts that age is not checked for forces along a vector".to_owned(),
            "0, or slider.across = 1".to_owned(),
        ));
    }
    if drive.across > slider.across {
        refused.push((
            "drive.across",
            format!("the {what} has no row {} across", drive.across),
            format!("a whole number from 0 to slider.across = {}", slider.across),
        ));
    }
    refused
}

/// Checks the rules for sliders that lack what a key is about.
pub(crate) fn of_others(scenario: &Scenario) -> Vec<Refusal> {
    let mut refused = Vec::new();
    let (slider, drive, is_side) =
        (&scenario.slider, &scenario.drive, scenario.drive.kind == DriveKind::Side);
    let (is_flat, height_m) = (slider.rows == 1, drive.height_m);
    let what = if slider.is_over_area() { "sheet" } else { "chain" };
    if height_m != 0.0 && is_flat {
        refused.push((
            "drive.height_m",
            format!("a {what} has no height to pull at, and {height_m} is given"),
            "0, or slider.rows above 1".to_owned(),
        ));
    } else if height_m != 0.0 && !is_side {
        refused.push((
            "drive.height_m",
            format!("{height_m} has no meaning for this drive"),
            "0, or drive.kind = \"side\"".to_owned(),
        ));
    }
    let ratio = scenario.normal_load.foundation_stiffness_ratio;
    if ratio.to_bits() != FOUNDATION_RATIO.to_bits() && is_flat {
        refused.push((
            "normal_load.foundation_stiffness_ratio",
            format!("a {what} has no foundation, and {ratio} is given"),
            format!("{FOUNDATION_RATIO}, or slider.rows above 1"),
        ));
    }
    if drive.across != 0 && !slider.is_over_area() {
        refused.push((
            "drive.across",
            format!("there is one row of contacts, and row {} is given", drive.across),
            "0, or slider.across above 1".to_owned(),
        ));
    } else if drive.across != 0 && !is_side {
        refused.push((
            "drive.across",
            format!("{} has no meaning for this drive", drive.across),
            "0, or drive.kind = \"side\"".to_owned(),
        ));
    }
    if scenario.friction.reattach == Reattach::Turn && !slider.is_over_area() {
        refused.push((
            "friction.reattach",
            "\"turn\" is for contacts that slip along a vector; in one row it is \"one-way\" for whatever detaches \
             forwards"
                .to_owned(),
            "\"one-way\" or \"two-way\", or slider.across above 1".to_owned(),
        ));
    }
    refused
}

#[cfg(test)]
mod tests {
    use crate::{Scenario, ScenarioSource};

    const SHEET: &str = "slider.blocks = 26\nslider.across = 6\nslider.width_m = 0.02\nslider.height_m = 0.005\n\
                         friction.reattach = \"turn\"\ntime.step_s = 4e-7\n";
    const BODY: &str = "slider.blocks = 15\nslider.across = 4\nslider.rows = 7\nslider.length_m = 0.14\n\
                        slider.width_m = 0.03\nslider.height_m = 0.06\nslider.mass_kg = 0.3\n\
                        friction.reattach = \"turn\"\ntime.step_s = 4e-7\n";

    fn resolve(base: &str, sets: &[&str]) -> Result<Scenario, String> {
        let source =
            sets.iter().fold(ScenarioSource::new("test.toml", base), |source, set| source.with_override(set));
        Scenario::resolve(&source).map_err(|errors| errors.to_string())
    }

    #[test]
    fn what_contacts_over_an_area_cannot_have_is_refused_with_the_reason() {
        for (base, sets, expected) in [
            (
                SHEET,
                &["slider.width_m=0.005"][..],
                "slider.width_m: 0.005 over 6 rows across is no square lattice with \
              slider.length_m = 0.1 over 26 blocks (accepted: 0.02, or other numbers of rows across and blocks)",
            ),
            (BODY, &["slider.height_m=0.07"], "slider.height_m: 0.07 over 7 rows is no square lattice"),
            (SHEET, &["slider.blocks=1"], "slider.blocks: 1 column of nodes is no sheet"),
            (
                SHEET,
                &["slider.blocks=100000"],
                "slider.across: 100000 x 6 contacts are 600000 (accepted: at most \
              100000 contacts)",
            ),
            (
                BODY,
                &["slider.rows=10000", "slider.across=10"],
                "slider.rows: 15 x 10 x 10000 nodes are 1500000",
            ),
            (
                SHEET,
                &["friction.reattach=one-way"],
                "friction.reattach: \"one-way\" stops in every step what the \
              torque of the drive turns backwards: the contacts of a sheet then chatter (accepted: \"turn\", or \
              slider.across = 1)",
            ),
            (
                BODY,
                &["friction.reattach=two-way"],
                "friction.reattach: \"two-way\" stops in the first step what",
            ),
            (
                SHEET,
                &["friction.law=junctions", "friction.reattach=two-way"],
                "friction.law: how the contacts of a \
              sheet slip along a vector is not derived for friction.law = \"junctions\"",
            ),
            (
                BODY,
                &["friction.law=rigid", "friction.reattach=two-way"],
                "friction.law: a body at rest is held by \
              friction springs",
            ),
            (
                SHEET,
                &["friction.ageing_coefficient=0.01"],
                "friction.ageing_coefficient: the strength of contacts \
              that age",
            ),
            (
                BODY,
                &["drive.kind=left-right", "friction.reattach=two-way"],
                "drive.kind: left-right needs the two-way \
              rule, by which the contacts of a body chatter (accepted: \"side\" or \"top\", or slider.across = 1 \
              and slider.rows = 1)",
            ),
            (BODY, &["drive.height_m=0.066"], "drive.height_m: 0.066 is above the body"),
            (SHEET, &["drive.height_m=0.001"], "drive.height_m: a sheet has no height to pull at"),
            (
                SHEET,
                &["drive.across=7"],
                "drive.across: the sheet has no row 7 across (accepted: a whole number from 0 \
              to slider.across = 6)",
            ),
            (SHEET, &["drive.across=2", "drive.kind=top"], "drive.across: 2 has no meaning for this drive"),
            (SHEET, &["initial_shear.beta=0.1"], "initial_shear.beta: the load of a sheet is given"),
            (
                BODY,
                &["initial_shear.poisson_ratio=0.1"],
                "initial_shear.poisson_ratio: the shear of a body at rest",
            ),
            (SHEET, &["prestress.ratio=0.1"], "prestress.ratio: the only force from outside on a sheet"),
            (
                SHEET,
                &["initial_velocity.amplitude_m_per_s=0.1"],
                "initial_velocity.amplitude_m_per_s: it is that of a \
              mode of a chain, and a sheet begins at rest",
            ),
            (
                BODY,
                &["time.start=loaded"],
                "time.start: \"loaded\" is where a chain follows its drive; a body",
            ),
            (
                SHEET,
                &["normal_load.foundation_stiffness_ratio=2"],
                "normal_load.foundation_stiffness_ratio: a sheet \
              has no foundation",
            ),
            (
                SHEET,
                &["time.step_s=2e-6", "time.duration_s=5"],
                "time.step_s: 2e-6 is above the stability limit of the \
              scheme for this sheet",
            ),
            (SHEET, &["friction.static_offsets=[0.1]"], "friction.static_offsets: 1 number for 156 blocks"),
            (
                SHEET,
                &["recording.rupture_fields_from_blocks=157", "recording.rupture_fields_s=4e-5"],
                "recording.rupture_fields_from_blocks: 157 blocks never slide at once",
            ),
            (
                "",
                &["friction.reattach=turn"],
                "friction.reattach: \"turn\" is for contacts that slip along a vector; \
              in one row it is \"one-way\" for whatever detaches forwards (accepted: \"one-way\" or \"two-way\", or \
              slider.across above 1)",
            ),
            ("", &["drive.across=1"], "drive.across: there is one row of contacts, and row 1 is given"),
        ] {
            let errors = resolve(base, sets).expect_err(expected);
            assert!(errors.contains(expected), "{sets:?}: {errors}");
        }
    }

    #[test]
    fn what_contacts_over_an_area_can_have_is_accepted() {
        for (base, sets) in [
            (SHEET, &[][..]),
            (BODY, &[]),
            (SHEET, &["drive.across=6"]),
            (SHEET, &["drive.kind=top", "drive.tilt=0.5"]),
            (BODY, &["drive.kind=top", "normal_load.tilt=0.3"]),
            (SHEET, &["normal_load.schedule_s=[1,2]", "normal_load.schedule_n=[400,200]"]),
            (SHEET, &["friction.static_spread=0.01", "friction.spread_seed=4"]),
            (BODY, &["drive.until_load_ratio=0.1"]),
        ] {
            resolve(base, sets).unwrap_or_else(|errors| panic!("{sets:?}: {errors}"));
        }
        let sheet = resolve(SHEET, &["friction.static_spread=0.01"]).unwrap();
        assert_eq!(crate::Plan::new(&sheet).friction.static_coefficients.len(), 156);
    }
}
