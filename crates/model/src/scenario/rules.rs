//! Rules between keys, each with its own error.

mod bodies;
mod courses;
mod medium;
mod rate_and_state;
mod weakening;

use asperity_record::bounds::LEAST_MAGNITUDE;
use asperity_record::{MOST_STEPS, TimeGrid, counted, rounded, short};

use crate::plan::Plan;
use crate::plan::disorder::{Quantity, coefficients};
use crate::plan::given_state;
use crate::plan::slab;
use crate::scenario::choices::{Distribution, DriveKind, End, Start};
use crate::scenario::meaning;
use crate::scenario::source::Refusals;
use crate::scenario::{Friction, Scenario};

/// A refusal: the key, the problem, and what is accepted.
pub(crate) type Refusal = (&'static str, String, String);

/// Refuses a scenario that violates the rule.
type Rule = fn(&Scenario, &mut Refusals<'_>);

/// The rules, in the order in which their errors are printed.
const RULES: &[Rule] = &[
    meaning::keys_have_what_they_need,
    sliding_friction_is_not_above_the_threshold,
    initial_velocity_is_a_mode_of_the_chain,
    drives_pull_what_they_can,
    drives_move_backwards_by_the_two_way_rule,
    one_of_two_is_zero,
    courses::courses_ascend_from_the_start,
    given_state::states_are_of_one_kind,
    lists_have_a_number_for_each_block,
    lists_of_blocks_ascend,
    every_block_has_ordered_coefficients,
    every_contact_has_load_and_stiffness,
    lognormal_values_have_a_mean,
    bodies::lattices_are_square_and_known,
    bodies::contacts_over_an_area_turn,
    both_ends_are_periodic_or_none,
    rate_and_state::steady_sliding_is_a_start,
    medium::a_fault_line_is_known,
    weakening::weakening_is_known,
    junctions_bear_load_and_fit,
    loaded_starts_leave_out_nothing_but_known_motion,
    the_scheme_is_stable,
    times_are_whole_numbers_of_steps,
    windows_are_inside_run_and_chain,
    rupture_fields_have_a_cadence_and_a_size,
];

/// Checks a scenario, each of whose keys is in range, against the rules.
pub(crate) fn check(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let before = refusals.errors.len();
    bodies::too_large(scenario, refusals);
    // The rules may allocate memory for every contact.
    if refusals.errors.len() == before {
        RULES.iter().for_each(|rule| rule(scenario, refusals));
    }
}

/// Refuses a loaded start whose load the run never reaches. For scenarios that obey all rules.
pub(crate) fn check_start(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    weakening::steps_resolve_the_fall(scenario, refusals);
    if let Some((key, problem, accepted)) = given_state::check(scenario) {
        return refusals.refuse(key, problem, accepted);
    }
    let body = scenario.elastic();
    if body.has_foundation() {
        if let Some(problem) = slab::problem_at_rest(&Plan::without_given_state(scenario)) {
            let accepted = format!("a {} that its load presses onto all of its contacts", body.table.name);
            refusals.refuse("slider.rows", problem, accepted);
        }
        return;
    }
    // Just before the first block would detach.
    let is_loaded = scenario.time.start == Start::Loaded && scenario.friction.law.sticks();
    if !is_loaded || scenario.initial.is_given() {
        return;
    }
    let plan = Plan::new(scenario);
    let problem = if plan.initial.step == 0 {
        "\"loaded\", but a block is beyond its threshold before the drive moves"
    } else if plan.initial.step + 1 >= plan.steps {
        "\"loaded\", but no block comes to its threshold within the run"
    } else {
        return;
    };
    refusals.refuse("time.start", problem, "\"at-rest\", or a drive that brings the first slip");
}

fn sliding_friction_is_not_above_the_threshold(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let Friction { static_coefficient, dynamic_coefficient, .. } = scenario.friction;
    if dynamic_coefficient > static_coefficient {
        refusals.refuse(
            "friction.dynamic_coefficient",
            format!("{dynamic_coefficient} is above friction.static_coefficient = {static_coefficient}"),
            format!("a number from 0 to {static_coefficient}"),
        );
    }
}

fn initial_velocity_is_a_mode_of_the_chain(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (blocks, velocity) = (scenario.slider.blocks, &scenario.initial_velocity);
    let mode = velocity.mode;
    // Nothing reads the mode of a chain at rest, whose default is 1.
    if mode >= blocks && (mode > 1 || velocity.amplitude_m_per_s != 0.0) {
        let problem = format!("a chain of {} has no mode {mode}", counted(u64::from(blocks), "block"));
        let accepted = format!("a whole number below {blocks}, or slider.blocks above {mode}");
        refusals.refuse("initial_velocity.mode", problem, accepted);
    }
}

fn drives_pull_what_they_can(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (slider, law) = (&scenario.slider, scenario.friction.law);
    let other = |or: &str| format!("\"side\" or \"top\"{or}");
    let (problem, accepted) = match scenario.drive.kind {
        DriveKind::Force if slider.is_lattice() || !law.sticks() => {
            ("\"force\" pulls block 1 of a chain by whose friction blocks stick", other(""))
        }
        DriveKind::LeftRight if slider.is_lattice() => (
            "left-right needs the two-way rule, by which the contacts of slabs, sheets and bodies chatter",
            other(&format!(", or {}", slider.keys_of_a_chain())),
        ),
        DriveKind::LeftRight if slider.blocks == 1 => (
            "left-right pulls the first block backwards and the last forwards, and one block is both",
            other(", or slider.blocks from 2"),
        ),
        DriveKind::LeftRight if !law.sticks() => (
            "\"left-right\": by friction.law = \"rate-and-state\" blocks begin in steady sliding, in one direction",
            other(""),
        ),
        DriveKind::LeftRight if !scenario.friction.is_two_way() => (
            "left-right pulls block 1 backwards, where the one-way rule would stop it in every step",
            "left-right with friction.reattach = \"two-way\"".to_owned(),
        ),
        _ => return,
    };
    refusals.refuse("drive.kind", problem, accepted);
}

fn one_of_two_is_zero(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let drive = &scenario.drive;
    if drive.tilt != 0.0 && drive.decay_length_m != 0.0 {
        let problem = "the springs of a top drive either tilt or decay";
        refusals.refuse("drive.tilt", problem, "one of them 0");
    }
    if drive.until_load_ratio != 0.0 && drive.hold_from_s != 0.0 {
        let problem = "the drive stops either at a load or at drive.hold_from_s";
        refusals.refuse("drive.until_load_ratio", problem, "one of them 0");
    }
}

fn drives_move_backwards_by_the_two_way_rule(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let one_way = scenario.friction.law.sticks() && !scenario.friction.is_two_way();
    let drive = &scenario.drive;
    for (key, values) in
        [("drive.course_m_per_s", &drive.course_m_per_s), ("drive.course_n", &drive.course_n)]
    {
        if let Some(value) = values.iter().find(|value| **value < 0.0).filter(|_| one_way) {
            refusals.refuse(
                key,
                format!("{value} pulls backwards, where the one-way rule would stop a block in every step"),
                "numbers from 0, or friction.reattach = \"two-way\"",
            );
        }
    }
}

fn lists_have_a_number_for_each_block(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let blocks = scenario.slider.contacts() as usize;
    for (key, values) in scenario.lists_by_block() {
        if values.len() != blocks {
            refusals.refuse(
                key,
                format!("{} for {}", counted(values.len() as u64, "number"), counted(blocks as u64, "block")),
                format!("{blocks} numbers, or none"),
            );
        }
    }
}

fn lists_of_blocks_ascend(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (prestress, recording) = (&scenario.prestress, &scenario.recording);
    let lists = [
        ("friction.stuck_blocks", scenario.friction.stuck_blocks.as_slice()),
        ("prestress.from_blocks", &prestress.from_blocks),
        ("recording.series_blocks", &recording.series_blocks),
    ];
    if recording.series_every == 0 && !recording.series_blocks.is_empty() {
        let problem = "blocks without recording.series_every, which says when they are recorded";
        refusals.refuse("recording.series_blocks", problem, "none, or recording.series_every from 1");
    }
    lists_ascend(lists, scenario.slider.contacts(), refusals);
    let [from, ratios] = [&prestress.from_blocks, &prestress.from_blocks_ratio].map(Vec::len);
    if from != ratios {
        let problem = format!("{} at {}", counted(ratios as u64, "ratio"), counted(from as u64, "block"));
        refusals.refuse("prestress.from_blocks_ratio", problem, "as many as prestress.from_blocks");
    }
}

/// Refuses lists of blocks that do not ascend or name others than there are.
pub(crate) fn lists_ascend<const N: usize>(
    lists: [(&str, &[f64]); N],
    blocks: u32,
    refusals: &mut Refusals<'_>,
) {
    for (key, list) in lists {
        let is_next = |at: usize| {
            let n = list[at];
            n.fract() == 0.0 && n <= f64::from(blocks) && (at == 0 || list[at - 1] < n)
        };
        if let Some(at) = (0..list.len()).find(|at| !is_next(*at)) {
            let problem = format!("entry {} is {}", at + 1, list[at]);
            refusals.refuse(key, problem, format!("ascending whole numbers from 1 to {blocks}"));
        }
    }
}

fn every_block_has_ordered_coefficients(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let blocks = scenario.slider.contacts() as usize;
    let both = [Quantity::Static, Quantity::Dynamic];
    // Uniform coefficients and lists of the wrong length have rules of their own.
    if both.iter().all(|of| of.is_even(scenario)) || !both.iter().all(|of| fits(*of, scenario)) {
        return;
    }
    let (mu_s, mu_d) = coefficients(scenario);
    if let Some(n) = (0..blocks).find(|&n| !(0.0..=mu_s[n]).contains(&mu_d[n]) || mu_s[n].is_infinite()) {
        let listed = both.iter().find(|of| !of.offsets(scenario).is_empty()).map(|of| of.offsets_key());
        let drawn = both.iter().find(|of| of.spread(scenario) != 0.0).map(|of| of.spread_key());
        refusals.refuse(
            listed.or(drawn).expect("coefficients that are not even are listed or drawn"),
            format!("block {} gets mu_s = {} and mu_d = {}", n + 1, short(mu_s[n]), short(mu_d[n])),
            "0 <= mu_d <= mu_s for every block",
        );
    }
}

/// Whether a list of offsets is empty or has a number for each contact.
fn fits(quantity: Quantity, scenario: &Scenario) -> bool {
    let listed = quantity.offsets(scenario).len();
    listed == 0 || listed == scenario.slider.contacts() as usize
}

fn every_contact_has_load_and_stiffness(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    for (quantity, symbol) in [(Quantity::Stiffness, "k_t"), (Quantity::Load, "p")] {
        if quantity.is_even(scenario) || !fits(quantity, scenario) {
            continue;
        }
        let key = match quantity.offsets(scenario) {
            [] => quantity.spread_key(),
            _ => quantity.offsets_key(),
        };
        let factors = quantity.values(scenario);
        if let Some(n) = factors.iter().position(|factor| !factor.is_finite() || *factor <= 0.0) {
            let problem = format!("block {} gets {} times {symbol}", n + 1, short(factors[n]));
            refusals.refuse(key, problem, format!("{symbol} above 0 for every block"));
        }
    }
}

fn lognormal_values_have_a_mean(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let [mu_s, mu_d] = scenario.mean_coefficients();
    let is_lognormal = scenario.disorder.distribution == Distribution::Lognormal;
    for (quantity, mean) in [(Quantity::Static, mu_s), (Quantity::Dynamic, mu_d)] {
        if is_lognormal && mean == 0.0 && quantity.spread(scenario) != 0.0 {
            let problem = "lognormal values are above 0, and so is their mean";
            refusals.refuse(
                quantity.spread_key(),
                problem,
                "a mean above 0, or another disorder.distribution",
            );
        }
    }
}

fn both_ends_are_periodic_or_none(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (key, other) = match (scenario.slider.left_end, scenario.slider.right_end) {
        (End::Periodic, End::Periodic) => return,
        (End::Periodic, _) => ("slider.left_end", "slider.right_end"),
        (_, End::Periodic) => ("slider.right_end", "slider.left_end"),
        _ => return,
    };
    let problem = format!("\"periodic\" joins both ends, and {other} is another");
    refusals.refuse(key, problem, format!("{other} = \"periodic\" as well, or another end"));
}

/// Most junctions of all contacts, whose state takes 24 bytes each.
const MOST_JUNCTIONS: u64 = 1_000_000;

fn junctions_bear_load_and_fit(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (slider, tilt) = (&scenario.slider, scenario.normal_load.tilt);
    let Some(law) = scenario.contact_law().junctions() else { return };
    let all = law.count as u64 * u64::from(slider.contacts());
    if all > MOST_JUNCTIONS {
        refusals.refuse(
            "friction.junction_count",
            format!("{} of each of {} contacts are {all} junctions", law.count, slider.contacts()),
            format!("at most {MOST_JUNCTIONS} junctions"),
        );
    }
    if tilt.abs() == 1.0 {
        refusals.refuse(
            "normal_load.tilt",
            format!(
                "{tilt} leaves a contact without load, and junctions that bear nothing have no stiffness"
            ),
            "a number above -1 and below 1",
        );
    }
}

fn loaded_starts_leave_out_nothing_but_known_motion(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (drive, friction) = (&scenario.drive, &scenario.friction);
    if scenario.time.start != Start::Loaded || !friction.law.sticks() {
        return;
    }
    let ramp_matters = scenario.initial_velocity.amplitude_m_per_s != 0.0
        || drive.until_load_ratio > 0.0
        || friction.ageing_coefficient > 0.0;
    let is_known = !friction.law.holds()
        && scenario.contact_law().junctions().is_none()
        && drive.kind != DriveKind::LeftRight
        && drive.course_s.is_empty()
        && !scenario.has_contact_courses()
        && scenario.normal_load.schedule_s.is_empty();
    let mut refuse = |problem: &str, accepted: &str| refusals.refuse("time.start", problem, accepted);
    if scenario.slider.is_lattice() {
        let (what, chain) = (scenario.elastic().table.name, scenario.slider.keys_of_a_chain());
        refuse(
            &format!("\"loaded\" is where a chain follows its drive; a {what} begins at rest"),
            &format!("\"at-rest\", or {chain}"),
        );
    } else if ramp_matters && !scenario.initial.is_given() {
        refuse(
            "\"loaded\" leaves out the ramp, on which initial velocities die away, contacts age and the drive may stop \
             at a load",
            "\"at-rest\", or none of these",
        );
    } else if !is_known && !scenario.initial.is_given() {
        refuse(
            "\"loaded\" needs interfacial springs, a constant load and a drive of constant velocity in one direction",
            "\"at-rest\"",
        );
    }
}

/// Margin below the longest stable step, as a share of it, for the rounding of that bound.
const BELOW_THE_BOUND: f64 = 1e-12;

fn the_scheme_is_stable(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let longest_s = scenario.longest_stable_step_s();
    if scenario.time.step_s >= longest_s * (1.0 - BELOW_THE_BOUND) {
        let body = scenario.elastic().table.name;
        refusals.refuse(
            "time.step_s",
            format!("{:e} is above the stability limit of the scheme for this {body}", scenario.time.step_s),
            if longest_s > LEAST_MAGNITUDE {
                format!("a number above 0 and below {longest_s:.3e}")
            } else {
                format!(
                    "none: its blocks swing so fast that it would have to be below {longest_s:.3e} s, and steps are \
                     from {LEAST_MAGNITUDE:e} s"
                )
            },
        );
    }
}

/// Digits from which a time is tried as a whole number of steps.
const FEW_DIGITS: usize = 12;

/// A time on the grid by as few digits as lead to its step: 0.0010000200000000001 is 0.00100002.
pub(crate) fn in_few_digits(grid: &TimeGrid, time_s: f64) -> f64 {
    let shorter = (FEW_DIGITS..17).map(|digits| rounded(time_s, digits));
    shorter.into_iter().find(|short_s| grid.whole_steps(*short_s).is_some()).unwrap_or(time_s)
}

fn times_are_whole_numbers_of_steps(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let grid = TimeGrid::new(scenario.time.step_s);
    let wrong = |value_s: f64, zero_allowed: bool| {
        let steps = grid.whole_steps(value_s);
        let (step_s, nearest) = (grid.step_s(), grid.nearest_step(value_s).max(1));
        if steps.is_some_and(|steps| steps > 0 || zero_allowed) {
            None
        } else if nearest > MOST_STEPS {
            Some((
                format!("{value_s} is {} steps of {step_s:e} s", short(value_s / step_s)),
                format!("at most 2^53 steps, {}", grid.time_s(MOST_STEPS)),
            ))
        } else {
            let nearest_s = in_few_digits(&grid, grid.time_s(nearest));
            Some((
                format!("{value_s} is not a whole number of steps of {step_s:e} s"),
                format!("a multiple of time.step_s; the nearest is {nearest_s}"),
            ))
        }
    };
    let of_courses = courses::times_s(scenario).into_iter();
    let of_courses = of_courses.flat_map(|(key, times)| times.iter().map(move |time_s| (key, *time_s, true)));
    // Where 0 stands for never, or for the end, less than a step does not.
    let times = [
        ("drive.hold_from_s", scenario.drive.hold_from_s),
        ("friction.slip_memory_s", scenario.friction.slip_memory_s),
        ("prestress.swing_from_s", scenario.prestress.swing_from_s),
        ("initial.at_s", scenario.initial.at_s),
        ("recording.sample_s", scenario.recording.sample_s),
        ("recording.fields_s", scenario.recording.fields_s),
        ("recording.rupture_fields_s", scenario.recording.rupture_fields_s),
    ];
    let times = times.map(|(key, time_s)| (key, time_s, time_s == 0.0));
    let times = times.into_iter().chain([("time.duration_s", scenario.time.duration_s, false)]);
    for (key, value_s, zero_allowed) in of_courses.chain(times) {
        if let Some((problem, accepted)) = wrong(value_s, zero_allowed) {
            refusals.refuse(key, problem, accepted);
        }
    }
    for (index, window) in scenario.recording.window.iter().enumerate() {
        let times = [
            ("from_s", window.from_s, true),
            ("to_s", window.to_s, true),
            ("every_s", window.every_s, false),
        ];
        for (key, value_s, zero_allowed) in times {
            if let Some((problem, accepted)) = wrong(value_s, zero_allowed) {
                refusals.refuse_in_window(index, key, problem, accepted);
            }
        }
    }
}

fn windows_are_inside_run_and_chain(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (duration_s, blocks) = (scenario.time.duration_s, scenario.slider.contacts());
    let run_has_an_end = TimeGrid::new(scenario.time.step_s).whole_steps(duration_s).is_some();
    for (index, window) in scenario.recording.window.iter().enumerate() {
        if window.to_s < window.from_s || (run_has_an_end && window.to_s > duration_s) {
            refusals.refuse_in_window(
                index,
                "to_s",
                format!("{} is not inside the run", window.to_s),
                format!("a number from {} to {duration_s}", window.from_s),
            );
        }
        if window.last_block < window.first_block || window.last_block > blocks {
            refusals.refuse_in_window(
                index,
                "last_block",
                format!("{} is not inside the chain", window.last_block),
                format!("a whole number from {} to {blocks}", window.first_block),
            );
        }
    }
}

fn rupture_fields_have_a_cadence_and_a_size(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (from_blocks, every_s) =
        (scenario.recording.rupture_fields_from_blocks, scenario.recording.rupture_fields_s);
    let blocks = scenario.slider.contacts();
    if from_blocks > blocks {
        refusals.refuse(
            "recording.rupture_fields_from_blocks",
            format!("{from_blocks} blocks never slide at once in a chain of {blocks}"),
            format!("a whole number from 0 to {blocks}"),
        );
    }
    if from_blocks > 0 && every_s == 0.0 {
        refusals.refuse(
            "recording.rupture_fields_s",
            format!("0 is no cadence, and recording.rupture_fields_from_blocks = {from_blocks} asks for one"),
            "a multiple of time.step_s above 0",
        );
    }
    if from_blocks == 0 && every_s > 0.0 {
        refusals.refuse(
            "recording.rupture_fields_s",
            format!("{every_s} has no meaning without recording.rupture_fields_from_blocks"),
            "0, or recording.rupture_fields_from_blocks from 1",
        );
    }
}

#[cfg(test)]
mod tests;
