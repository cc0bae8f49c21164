//! Scenarios that contradict themselves.

use super::{RULES, Refusals};
use crate::scenario::Scenario;
use crate::scenario::defaults::fill_in;
use crate::scenario::source::ScenarioSource;

/// Scenarios and their errors.
const CASES: &[(&str, &str)] = &[
    ("drive.kind = \"left-right\"", "drive.kind: left-right pulls block 1 backwards"),
    (
        "drive.course_s = [1, 2]\ndrive.course_m_per_s = [1e-4, -1e-4]",
        "drive.course_m_per_s: -0.0001 pulls backwards, where the one-way rule",
    ),
    (
        "time.start = \"loaded\"\ndrive.course_s = [1, 2]\ndrive.course_m_per_s = [1e-4, 0]",
        "time.start: \"loaded\" needs interfacial springs, a constant load and a drive of constant velocity",
    ),
    ("drive.kind = \"plate\"", "drive.kind: \"plate\" with slider.medium"),
    ("slider.medium = \"periodic\"", "medium.width_m: 0 with slider.medium = \"periodic\""),
    ("drive.kind = \"force\"", "drive.course_n: a drive by force has no forces"),
    (
        "drive.kind = \"force\"\ndrive.course_s = [1, 2]\ndrive.course_n = [1]",
        "drive.course_n: 1 value at 2 times",
    ),
    (
        "drive.kind = \"force\"\nslider.blocks = 11\nslider.rows = 3\ndrive.course_s = [1, 2]\ndrive.course_n = [1, 2]",
        "drive.kind: \"force\" pulls block 1 of a chain by whose friction blocks stick",
    ),
    (
        "normal_load.course_s = [1, 2]\nnormal_load.course_factor = [1, 1, 1]",
        "normal_load.course_factor: 3 values at 2 times of 100 blocks (accepted: 2 or 200 values)",
    ),
    (
        "prestress.course_s = [2, 1]\nprestress.course_ratio = [0, 0]",
        "prestress.course_s: goes from 2 to 1 (accepted: times that ascend",
    ),
    ("normal_load.course_csv = \"no such file\"", "normal_load.course_csv: no such file: "),
    ("drive.kind = \"top\"\ndrive.tilt = 0.5\ndrive.decay_length_m = 0.1", "drive.tilt: the springs"),
    ("drive.until_load_ratio = 0.3\ndrive.hold_from_s = 1", "drive.until_load_ratio: the drive stops either"),
    ("normal_load.schedule_s = [1, 2]", "normal_load.schedule_n: 0 values at 2 times"),
    (
        "normal_load.schedule_s = [2, 1]\nnormal_load.schedule_n = [400, 100]",
        "normal_load.schedule_s: goes from 2 to 1",
    ),
    (
        "normal_load.schedule_s = [1, 2]\nnormal_load.schedule_n = [300, 100]",
        "normal_load.schedule_n: begins with 300, but before it normal_load.total_n is 400",
    ),
    (
        "normal_load.schedule_s = [1, 2]\nnormal_load.schedule_n = [400, -1]",
        "normal_load.schedule_n: [400, -1] is not accepted",
    ),
    (
        "normal_load.schedule_s = [1e-9, 2]\nnormal_load.schedule_n = [400, 100]",
        "normal_load.schedule_s: 0.000000001 is not a whole number of steps",
    ),
    ("normal_load.schedule_from = \"hold\"", "normal_load.schedule_from: the drive never stops"),
    ("initial.at_s = 1", "initial.at_s: 1 is the time of a state, and none is given"),
    (
        "initial.from = \"a.mcap\"\ninitial.state_csv = \"a.csv\"",
        "initial.state_csv: the state is that of a log already",
    ),
    ("friction.static_offsets = [0.1]", "friction.static_offsets: 1 number for 100 blocks"),
    ("friction.static_spread = 0.5", "friction.static_spread: block"),
    ("friction.stuck_blocks = [1, 1]", "entry 2 is 1 (accepted: ascending whole numbers from 1 to 100)"),
    ("recording.series_every = 10", "recording.series_every: 10 has no meaning for friction.law = \"interf"),
    (
        "friction.law = \"rate-and-state\"\nrecording.series_blocks = [1]",
        "recording.series_blocks: blocks without recording.series_every",
    ),
    (
        "friction.law = \"rate-and-state\"\nrecording.series_every = 1\nrecording.series_blocks = [1, 101]",
        "recording.series_blocks: entry 2 is 101 (accepted: ascending whole numbers from 1 to 100)",
    ),
    ("friction.stuck_blocks = [2.5]", "friction.stuck_blocks: entry 1 is 2.5 (accepted: "),
    ("prestress.from_blocks = [101]\nprestress.from_blocks_ratio = [0]", "entry 1 is 101 (accepted: "),
    ("prestress.from_blocks = [2, 3]", "0 ratios at 2 blocks (accepted: as many as prestress.from_blocks)"),
    (
        "time.start = \"loaded\"\nfriction.ageing_coefficient = 0.01",
        "time.start: \"loaded\" leaves out the ramp",
    ),
    (
        "time.start = \"loaded\"\ndrive.velocity_m_per_s = 0",
        "time.start: \"loaded\", but no block comes to its threshold within the run",
    ),
    (
        "time.start = \"loaded\"\ninitial_shear.beta = -0.8",
        "time.start: \"loaded\", but a block is beyond its threshold before the drive moves",
    ),
    (
        "normal_load.schedule_s = [1, 1.000000000000001]\nnormal_load.schedule_n = [400, 100]",
        "normal_load.schedule_s: goes from 1 to 1.000000000000001",
    ),
    (
        "normal_load.schedule_s = [1, 2]\nnormal_load.schedule_n = [400, 0]",
        "normal_load.schedule_n: [400, 0] is not accepted",
    ),
    ("friction.dynamic_spread = 0.3", "friction.dynamic_spread: block"),
    ("disorder.load_offsets = [0.1]", "disorder.load_offsets: 1 number for 100 blocks"),
    ("disorder.load_spread = 1.5", "disorder.load_spread: block"),
    (
        "slider.blocks = 2\ndisorder.stiffness_offsets = [0, -1]",
        "disorder.stiffness_offsets: block 2 gets 0 times k_t (accepted: k_t above 0 for every block)",
    ),
    (
        "friction.dynamic_coefficient = 0\nfriction.dynamic_spread = 0.1\ndisorder.distribution = \"lognormal\"",
        "friction.dynamic_spread: lognormal values are above 0, and so is their mean",
    ),
    ("disorder.contacts_csv = \"no such file\"", "disorder.contacts_csv: no such file: "),
    (
        "friction.law = \"junctions\"\nslider.blocks = 200\nfriction.junction_count = 10000",
        "friction.junction_count: 10000 of each of 200 contacts are 2000000 junctions (accepted: at most 1000000",
    ),
    (
        "friction.law = \"junctions\"\nnormal_load.tilt = -1",
        "normal_load.tilt: -1 leaves a contact without load, and junctions that bear nothing have no stiffness",
    ),
    ("time.start = \"loaded\"\nfriction.law = \"rigid\"", "time.start: \"loaded\" needs interfacial springs"),
    ("friction.dynamic_coefficient = 0.8", "friction.dynamic_coefficient: 0.8 is above"),
    ("initial_velocity.mode = 100", "initial_velocity.mode: a chain of 100 blocks has no mode 100"),
    ("time.step_s = 1e-4", "time.step_s: 1e-4 is above the stability limit of the scheme"),
    (
        "[[recording.window]]\nfrom_s = 0\nto_s = 9\nevery_s = 1e-3\nfirst_block = 1\nlast_block = 2",
        "recording.window.to_s: 9 is not inside the run",
    ),
    (
        "recording.rupture_fields_from_blocks = 101\nrecording.rupture_fields_s = 1e-5",
        "recording.rupture_fields_from_blocks: 101 blocks never slide at once in a chain of 100 \
         (accepted: a whole number from 0 to 100)",
    ),
    (
        "recording.rupture_fields_from_blocks = 10",
        "recording.rupture_fields_s: 0 is no cadence, and recording.rupture_fields_from_blocks = 10 asks for one",
    ),
    (
        "recording.rupture_fields_s = 1e-5",
        "recording.rupture_fields_s: 0.00001 has no meaning without recording.rupture_fields_from_blocks",
    ),
    (
        "slider.rows = 31",
        "slider.height_m: 0.02 over 31 rows is no square lattice with slider.length_m = 0.1",
    ),
    (
        "slider.blocks = 9\nslider.rows = 4\nslider.length_m = 0.14",
        "over 9 blocks (accepted: 0.0525, or other numbers of rows and blocks)",
    ),
    (
        "slider.blocks = 11\nslider.rows = 3\nfriction.law = \"rigid\"",
        "friction.law: a slab at rest is held by friction springs",
    ),
    (
        "slider.blocks = 11\nslider.rows = 3\nfriction.reattach = \"two-way\"\ndrive.kind = \"left-right\"",
        "drive.kind: left-right needs the two-way rule, by which the contacts of slabs, sheets and bodies chatter",
    ),
    (
        "slider.blocks = 11\nslider.rows = 3\ndrive.height_m = 0.0251",
        "drive.height_m: 0.0251 is above the slab (accepted: a number from 0 to slider.height_m = 0.02)",
    ),
    (
        "slider.blocks = 11\nslider.rows = 3\ntime.start = \"loaded\"",
        "time.start: \"loaded\" is where a chain follows its drive",
    ),
    (
        "slider.blocks = 10001\nslider.rows = 101\nslider.height_m = 0.001",
        "slider.rows: 10001 x 101 nodes are 1010101 (accepted: at most 1000000 nodes)",
    ),
    (
        "slider.blocks = 3\nslider.rows = 11\nslider.height_m = 0.5\nnormal_load.tilt = 1",
        "slider.rows: contact 3 bears nothing of the load",
    ),
    ("slider.blocks = 0", "slider.blocks: 0 is not accepted (accepted: a whole number from 1 to 100000)"),
    (
        "slider.blocks = 1\nslider.rows = 3",
        "slider.blocks: 1 column of nodes is no slab, whose spacing is that of its columns (accepted: a whole \
         number from 2, or slider.rows = 1)",
    ),
    (
        "friction.law = \"rate-and-state\"\nfriction.event_speed_m_per_s = 1e-4",
        "friction.event_speed_m_per_s: 0.0001 is not above drive.velocity_m_per_s = 0.0001",
    ),
    (
        "slider.left_end = \"periodic\"",
        "test.toml:1:19: slider.left_end: \"periodic\" joins both ends, and slider.right_end is another (accepted: \
         slider.right_end = \"periodic\" as well, or another end)",
    ),
    (
        "slider.left_end = \"clamped\"\nslider.right_end = \"periodic\"",
        "slider.right_end: \"periodic\" joins both ends",
    ),
    ("slider.right_end = \"fixed\"", "slider.right_end: \"fixed\" is not accepted (accepted: \"free\""),
    ("initial_shear.profile_csv = \"no such file\"", "initial_shear.profile_csv: no such file: "),
    ("prestress.profile_csv = \"no such file\"", "prestress.profile_csv: no such file: "),
    (
        "prestress.ratio = nan",
        "test.toml:1:19: prestress.ratio: nan is not accepted (accepted: a number from -1000000 to 1000000)",
    ),
    (
        "prestress.profile = [0.1, 0.2]",
        "prestress.profile: 2 numbers for 100 blocks (accepted: 100 numbers, or none)",
    ),
    ("prestress.profile = 0.1", "prestress.profile: 0.1 is not accepted (accepted: a list"),
    ("prestress.rato = 1", "prestress.rato: unknown key, set to 1; did you mean prestress.ratio?"),
    (
        "slider.blocks = 1\nnormal_load.tilt = 0.5",
        "normal_load.tilt: 0.5 has no meaning for a single block: it shifts load from one block to another, and there is \
         one (accepted: 0, or slider.blocks from 2)",
    ),
    (
        "slider.blocks = 11\nslider.rows = 3\nprestress.ratio = 0.1",
        "test.toml:3:19: prestress.ratio: 0.1 has no meaning for a slab: the only force from outside on this body is its \
         normal load (accepted: 0, or slider.rows = 1)",
    ),
    (
        "friction.law = \"junctions\"\nslider.left_end = \"clamped\"",
        "slider.left_end: \"clamped\" has no meaning for friction.law = \"junctions\": it is not derived for this law \
         (accepted: \"free\", or friction.law = \"interfacial-springs\" or ",
    ),
    (
        "slider.blocks = 1\ninitial_velocity.amplitude_m_per_s = 0.1",
        "initial_velocity.mode: a chain of 1 block has no mode 1 (accepted: a whole number below 1, or slider.blocks \
         above 1)",
    ),
    (
        "slider.blocks = 1\ndrive.kind = \"left-right\"",
        "drive.kind: left-right pulls the first block backwards and the last forwards, and one block is both",
    ),
    (
        "slider.blocks = 26\nslider.across = 6",
        "slider.width_m: 0.005 over 6 rows across is no square lattice with slider.length_m = 0.1 over 26 blocks \
         (accepted: 0.02, or other numbers of rows across and blocks)",
    ),
    ("slider.blocks = 100000\nslider.across = 6", "slider.across: 100000 x 6 contacts are 600000"),
    ("slider.rows = 10000\nslider.across = 2", "slider.rows: 100 x 2 x 10000 nodes are 2000000"),
    (
        "slider.across = 6",
        "\"one-way\" stops in every step what the torque of the drive turns backwards: contacts",
    ),
    ("slider.across = 6\nfriction.reattach = \"two-way\"", "\"two-way\" stops in the first step what"),
    (
        "friction.reattach = \"turn\"",
        "friction.reattach: \"turn\" is for contacts that slip along a vector; in one row",
    ),
    (
        "slider.across = 6\nfriction.law = \"junctions\"",
        "friction.law: how the contacts of a sheet slip along a vector is not derived for friction.law = \"junctions\"",
    ),
    (
        "slider.blocks = 2\nfriction.weakening_slip_m = 1e-8\nfriction.weakening_slip_offsets_m = [0, -2e-8]",
        "friction.weakening_slip_offsets_m: block 2 gets D_c = -1e-8 m (accepted: D_c >= 0 for every block)",
    ),
    (
        "friction.weakening_slip_m = 1e-8\nfriction.weakening_fractions = [0.5]",
        "friction.weakening_shares: 0 shares at 1 fraction (accepted: as many as friction.weakening_fractions)",
    ),
    (
        "friction.weakening_slip_m = 1e-8\nfriction.weakening_fractions = [0.5, 0.25]\nfriction.weakening_shares = [1, 1]",
        "friction.weakening_fractions: [0.5, 0.25] (accepted: up to 3 ascending numbers above 0 and below 1)",
    ),
    (
        "friction.weakening_fractions = [0.5]\nfriction.weakening_shares = [1]",
        "friction.weakening_fractions: friction does not weaken by slip (accepted: friction.weakening_slip_m above 0",
    ),
    (
        "friction.law = \"rigid\"\nfriction.slip_memory_s = 1e-3",
        "friction.slip_memory_s: friction does not weaken by slip",
    ),
    (
        "friction.weakening_slip_m = 1e-8\nfriction.ageing_coefficient = 0.1",
        "friction.ageing_coefficient: 0.1 beside friction.weakening_slip_m",
    ),
    (
        "friction.weakening_slip_m = 1e-8\nfriction.detach_by = \"spring\"",
        "friction.detach_by: \"spring\" beside friction.weakening_slip_m",
    ),
    (
        "friction.weakening_slip_m = 1e-8\nfriction.weakening_fractions = [0.5]\nfriction.weakening_shares = [11]",
        "friction.weakening_shares: [11] is not accepted (accepted: a list, each a number from 0 to 10)",
    ),
    (
        "friction.law = \"rigid\"\nfriction.weakening_slip_m = 1e-8\nfriction.slip_memory_s = 1.5e-8",
        "friction.slip_memory_s: 0.000000015 is not a whole number of steps",
    ),
    (
        "slider.across = 6\nfriction.reattach = \"turn\"\nfriction.weakening_slip_m = 1e-8",
        "friction.weakening_slip_m: 1e-8 has no meaning for a sheet",
    ),
    (
        "friction.weakening_slip_m = 1e-13\nfriction.law = \"rigid\"",
        "time.step_s: 1e-8 is above the time sqrt(m / k_w) in which friction falls, by friction.weakening_slip_m",
    ),
    (
        "slider.across = 6\ndrive.across = 7",
        "drive.across: the sheet has no row 7 across (accepted: a whole number from",
    ),
];

#[test]
fn contradictions_are_refused_with_the_reason() {
    for (text, expected) in CASES {
        let source = ScenarioSource::new("test.toml", *text);
        let errors = Scenario::resolve_with(&source, &crate::Texts).unwrap_err().to_string();
        assert!(errors.contains(expected), "{text}: {errors}");
    }
}

#[test]
fn every_rule_refuses_one_of_them() {
    let mut refused = vec![0; RULES.len()];
    for (text, _) in CASES {
        let entries = ScenarioSource::new("test.toml", *text).entries().unwrap();
        let mut errors = Vec::new();
        let values = fill_in(&entries, &mut errors);
        if !errors.is_empty() {
            continue;
        }
        let scenario = Scenario::of(values);
        for (rule, count) in RULES.iter().zip(&mut refused) {
            let mut refusals = Refusals { entries: &entries, files: None, errors: Vec::new() };
            rule(&scenario, &mut refusals);
            *count += refusals.errors.len();
        }
    }
    assert!(!refused.contains(&0), "of the rules in their order: {refused:?}");
}
