//! Warnings about scenarios that are accepted but may surprise their users.

use toml::Value;

use crate::law::weakening::Weakening as Fall;
use crate::plan::Plan;
use crate::plan::derive::ADVISED_SHARE;
use crate::plan::disorder::Quantity;
use crate::plan::initial;
use crate::plan::slab;
use crate::scenario::Scenario;
use crate::scenario::implausible;
use crate::scenario::keys;
use crate::scenario::text;
use crate::theory::medium::{FEWEST_COHESIVE_CELLS, FaultEstimate};
use crate::theory::preview::Preview;
use crate::theory::stability::{FEWEST_NUCLEATION_BLOCKS, Stability};
use crate::theory::weakening::{Weakening, fall_time_s};

/// Smallest driving force at the start, over the normal load, that exceeds rounding.
const LEAST_LOAD_RATIO: f64 = 1e-9;

/// Smallest shear that a profile leaves to the last block, over the mean load of a block, that
/// exceeds rounding.
const LEAST_REMAINDER_RATIO: f64 = 1e-6;

/// A warning about a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Its topic, in a word that does not depend on the scenario.
    pub kind: &'static str,
    /// A sentence that begins with the key.
    pub text: String,
}

/// A check of a scenario and its plan: the text of a warning.
type Check = fn(&Scenario, &Plan) -> Option<String>;

/// All checks, each with the kind of its warnings.
const CHECKS: [(&str, Check); 19] = [
    ("time-step", step),
    ("without-effect", without_effect),
    ("front-speed", fronts),
    ("chatter", chatter),
    ("joined-ends", joined_ends),
    ("load-at-start", load_at_start),
    ("remainder", remainder),
    ("beyond-at-start", beyond_at_start),
    ("without-threshold", without_threshold),
    ("no-weakening", no_weakening),
    ("broken-at-start", broken_at_start),
    ("healing-times", healing_times),
    ("nucleation-length", nucleation_length),
    ("cohesive-zone", cohesive_zone),
    ("many-rows", many_rows),
    ("event-speed", event_speed),
    ("slip-weakening", slip_weakening),
    ("no-solid", |scenario, _| implausible::no_solid(scenario)),
    ("no-slip", |scenario, plan| implausible::no_slip(scenario, &Preview::of(scenario, plan))),
];

/// Kinds of warnings about a start at rest, which a run that begins in a given state does not have.
const AT_REST: [&str; 5] = ["load-at-start", "remainder", "beyond-at-start", "broken-at-start", "no-slip"];

impl Scenario {
    /// Possible surprises in this scenario, printed by `asperity run` and `asperity scenario validate`.
    pub fn warnings(&self) -> Vec<Warning> {
        // A loaded start continues from the state of a start at rest.
        let plan = self.plan_at_rest();
        let warning =
            |(kind, check): &(&'static str, Check)| Some(Warning { kind, text: check(self, &plan)? });
        let applies =
            |(kind, _): &&(&'static str, Check)| !(self.initial.is_given() && AT_REST.contains(kind));
        CHECKS.iter().filter(applies).filter_map(warning).collect()
    }
}

/// Warns of a time step so long that it changes the results.
fn step(scenario: &Scenario, _plan: &Plan) -> Option<String> {
    let longest_s = scenario.longest_stable_step_s();
    let ratio = scenario.time.step_s / longest_s;
    (ratio > ADVISED_SHARE).then(|| {
        format!(
            "time.step_s = {:e} is {ratio:.2} of the longest stable step, {longest_s:.3e} s: beyond \
             {ADVISED_SHARE} of it every switch feeds energy into the slider, and the number of events \
             depends on the step",
            scenario.time.step_s
        )
    })
}

/// Most rows of blocks that a log may be asked for without a warning: of 24 bytes each, some 240 GB.
const MANY_ROWS: f64 = 1e10;

/// Largest `dt sqrt(k_w / m)` without a warning: half of it is the relative error of fracture energy.
const FAST_FALL: f64 = 0.05;

/// Warns where friction falls so fast that the time step or the lattice decides, and of contacts that a stop weakens.
fn slip_weakening(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let share = scenario.time.step_s / fall_time_s(plan)?;
    let d = Weakening::of(plan).map_or(f64::INFINITY, |of| of.weakening_slip_ratio);
    let grows =
        Fall::of(scenario).is_some_and(|fall| fall.strengthens()) && scenario.friction.slip_memory_s == 0.0;
    let texts = [
        (share > FAST_FALL).then(|| {
            format!(
                "time.step_s = {:e} is {share:.2} of sqrt(m / k_w): each slip dissipates some {:.0} % too much fracture \
                 energy, in proportion to the step",
                scenario.time.step_s,
                50.0 * share
            )
        }),
        (d < 1.0 && plan.blocks > 1).then(|| {
            format!(
                "friction.weakening_slip_m: d = D_c k / ((mu_s - mu_d) p) = {d:.3} is below 1, so that friction falls \
                 within the slip of one block, and numbers are those of the lattice"
            )
        }),
        grows.then(|| {
            "friction.weakening_shares: a block that stops where friction is above mu_s p detaches at mu_s p again, \
             without friction.slip_memory_s"
                .to_owned()
        }),
    ];
    texts.into_iter().flatten().reduce(|all, text| format!("{all}; {text}"))
}

/// Warns of scheduled records that hardly any disk holds.
fn many_rows(_scenario: &Scenario, plan: &Plan) -> Option<String> {
    let recording = &plan.recording;
    let on_cadence = |every: u64| (plan.steps - plan.initial.step).checked_div(every).unwrap_or(0) as f64;
    let of_windows = recording.windows.iter().map(|window| {
        ((window.to_step - window.from_step) / window.every_steps + 1) as f64 * window.blocks.len() as f64
    });
    let rows = [
        ("recording.sample_s", on_cadence(recording.sample_every_steps)),
        ("recording.fields_s", on_cadence(recording.fields_every_steps) * plan.blocks as f64),
        ("recording.window", of_windows.sum()),
    ];
    let (key, rows) = rows.into_iter().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (rows > MANY_ROWS).then(|| {
        let gigabytes = text::short(rows * 24.0 / 1e9);
        format!(
            "{key}: {} rows are to be recorded, some {gigabytes} GB before compression",
            text::short(rows)
        )
    })
}

/// Warns of a seed without random draws.
fn without_effect(scenario: &Scenario, _plan: &Plan) -> Option<String> {
    let friction = &scenario.friction;
    let draws = Quantity::ALL.iter().any(|quantity| quantity.spread(scenario) != 0.0);
    let key = keys::named("friction.spread_seed").expect("the key is in the table");
    let is_default = key.default_in(true) == Some(&Value::from(friction.spread_seed));
    (!is_default && !draws).then(|| {
        format!(
            "friction.spread_seed = {} has no effect: nothing is drawn (friction.static_spread, friction.dynamic_spread, \
             disorder.stiffness_spread and disorder.load_spread are 0), so runs with other seeds are identical",
            friction.spread_seed
        )
    })
}

/// Relative error of a front's speed due to the time step above which `run`, `scenario validate` and
/// `summary` warn.
pub const WRONG_FRONT: f64 = 0.04;

/// Warns of a time step so long that it changes the speeds of fronts.
fn fronts(scenario: &Scenario, plan: &Plan) -> Option<String> {
    if !plan.friction.law.word().sticks() {
        // Its solver chooses its steps; times are merely rounded to `time.step_s`.
        return None;
    }
    let error = plan.scales.front_error(scenario.time.step_s);
    // One block has no fronts.
    (error > WRONG_FRONT && plan.blocks > 1).then(|| {
        format!(
            "time.step_s = {:e} is {:.3} of the time in which a wave crosses a block, {:.3e} s: speeds of \
             fronts are wrong by about {:.0} %, in proportion to the step (docs/ruptures.md)",
            scenario.time.step_s,
            scenario.time.step_s / plan.scales.block_time_s,
            plan.scales.block_time_s,
            100.0 * error
        )
    })
}

/// Warns of a re-attachment rule that makes the contacts of a slab chatter.
fn chatter(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let has_springs = plan.friction.law.junctions().is_none();
    (has_springs && scenario.friction.is_two_way() && plan.elastic.axes() > 1).then(|| {
        "friction.reattach = \"two-way\": with it the contacts of a slab chatter, thousands of times where \
         \"one-way\" gives a dozen events"
            .to_owned()
    })
}

/// Warns of events that an extent from a first to a last block cannot describe.
fn joined_ends(_: &Scenario, plan: &Plan) -> Option<String> {
    plan.end_bonds.iter().any(|bond| bond.other.is_some()).then(|| {
        format!(
            "slider.left_end = \"periodic\": ranges of blocks end at blocks 1 and {}, so a rupture that passes from one \
             to the other is recorded as two, and the length of a precursor counts from block 1 (docs/model.md)",
            plan.blocks
        )
    })
}

/// Warns of driving springs that pull before the drive point moves.
fn load_at_start(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let u = &plan.initial.displacement_m;
    let pulls = plan.drive.springs.iter().map(|spring| (spring.block, spring.force_n(0.0, u[spring.block])));
    let (block, most_n) = pulls.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    if most_n.abs() <= LEAST_LOAD_RATIO * plan.total_normal_load_n {
        return None;
    }
    let kind = scenario.drive.kind.word();
    let load_ratio = plan.drive.total_force_n(0.0, u) / plan.total_normal_load_n;
    Some(format!(
        "drive.kind = \"{kind}\" with initial shear: the driving springs are measured from the grid, so they pull \
         before the drive point moves: F_T/F_N = {load_ratio:.4} at the start, most on block {}, {most_n:.3e} N",
        block + 1
    ))
}

/// Warns of an initial shear profile whose sum is not 0.
fn remainder(scenario: &Scenario, plan: &Plan) -> Option<String> {
    // Others have no initial shear that is given.
    plan.elastic.as_chain()?;
    let given_n = initial::shear_n(scenario, &plan.normal_load_n, plan.spacing_m);
    let last = plan.blocks - 1;
    let taken_n = plan.elastic.spring_force_n(&plan.initial.displacement_m, last);
    let mean_n = plan.total_normal_load_n / plan.blocks as f64;
    ((taken_n - given_n[last]).abs() > LEAST_REMAINDER_RATIO * mean_n).then(|| {
        format!(
            "initial_shear does not add up to 0: block {} takes the remainder, and starts with {:.4} of a \
             block's mean normal load, not {:.4}",
            plan.blocks,
            taken_n / mean_n,
            given_n[last] / mean_n
        )
    })
}

/// Warns of blocks that slip at once.
fn beyond_at_start(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let force_n = slab::shear_sizes_at_start_n(plan);
    let threshold_n = &plan.friction.static_threshold_n;
    let loads_n = plan.outside(0, u64::MAX).loads_n();
    let ratio = |n: usize| force_n[n] / (threshold_n[n] * (loads_n[n] / plan.normal_load_n[n]));
    if plan.friction.law.junctions().is_some() || !plan.friction.law.word().sticks() {
        return None;
    }
    let beyond: Vec<usize> = (0..plan.blocks).filter(|&n| threshold_n[n] > 0.0 && ratio(n) >= 1.0).collect();
    let most = *beyond.iter().max_by(|a, b| ratio(**a).total_cmp(&ratio(**b)))?;
    let has_springs = plan.friction.interfacial_stiffness_n_per_m > 0.0;
    let again = match has_springs && scenario.friction.is_two_way() {
        true => ", re-attachment by the two-way rule in the next one, at a velocity of exactly 0",
        false => "",
    };
    // With friction springs the start is in equilibrium, so velocities at a detachment are
    // rounding.
    let sign = match has_springs {
        true => {
            ". Where nothing else moves a block, its velocity is then a rounding error, whose sign decides \
             whether sliding friction pushes it on or back in step 2"
        }
        false => "",
    };
    let what = if plan.elastic.has_foundation() {
        format!("slider.rows: the shear of the {} at rest exceeds", plan.elastic.table.name)
    } else {
        "initial_shear and prestress exceed".to_owned()
    };
    Some(format!(
        "{what} static friction on {}, up to {} times it on block {}: detachment in step 1{again}{sign}",
        blocks(&beyond),
        times(ratio(most)),
        most + 1
    ))
}

/// Warns of junctions whose friction does not fall with velocity: in steady sliding it goes from `mu_s / 2`, at
/// rest, to `mu_d`.
fn no_weakening(scenario: &Scenario, plan: &Plan) -> Option<String> {
    plan.friction.law.junctions()?;
    let (mu_s, mu_d) = (scenario.friction.static_coefficient, scenario.friction.dynamic_coefficient);
    (mu_s <= 2.0 * mu_d).then(|| {
        format!(
            "friction.dynamic_coefficient = {mu_d} is not below half of friction.static_coefficient = {mu_s}: the \
             friction of junctions then does not fall with velocity, from mu_s / 2 to mu_d, so contacts do not \
             stick and slip (docs/contacts.md)"
        )
    })
}

/// Warns of junctions that break in the first step.
fn broken_at_start(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let law = plan.friction.law.junctions()?;
    let shear_n = slab::shear_at_start_n(plan);
    let most = |n: usize| {
        let force = |q: &f64| (shear_n[n] / plan.normal_load_n[n] + law.width * q).abs();
        law.offsets(n).iter().map(force).fold(0.0, f64::max)
    };
    let beyond: Vec<usize> =
        (0..plan.blocks).filter(|&n| most(n) >= plan.friction.static_coefficients[n]).collect();
    let first = *beyond.first()?;
    Some(format!(
        "friction.junction_width = {}: the most strained junctions at rest bear more than static friction on {}, \
         {:.4} of their load on block {}: they break in step 1",
        scenario.friction.junction_width,
        blocks(&beyond),
        most(first),
        first + 1
    ))
}

/// Warns of slip times whose mean is not that of the key: those of 0 or below are drawn again, and all last for at
/// least a step.
fn healing_times(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let law = plan.friction.law.junctions()?;
    let (mean_s, deviation_s) = (law.healing_time_s, law.healing_deviation_s);
    let why = if mean_s < 2.0 * scenario.time.step_s {
        format!(
            "slip lasts for whole steps of {:e} s, at least one, so the mean is not",
            scenario.time.step_s
        )
    } else if 3.0 * deviation_s > mean_s {
        format!(
            "a deviation of {deviation_s} s draws times of 0 or below, which are drawn again, so the mean is above"
        )
    } else {
        return None;
    };
    Some(format!(
        "friction.healing_time_s = {mean_s}: {why} this number, which closed forms and the link time use \
         (docs/contacts.md)"
    ))
}

/// Warns of blocks that are too large for the length over which slip nucleates.
fn nucleation_length(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let blocks = Stability::of(plan)?.nucleation_blocks?;
    (blocks < FEWEST_NUCLEATION_BLOCKS).then(|| {
        format!(
            "friction.critical_slip_m = {:e}: the nucleation length sqrt(k D_c / (b p)) is {blocks:.2} blocks: below \
             {FEWEST_NUCLEATION_BLOCKS} blocks fail one by one, and the results depend on slider.blocks \
             (docs/contacts.md)",
            scenario.friction.critical_slip_m
        )
    })
}

/// Warns of nodes too far apart for the zone in which friction falls behind the tip of a rupture.
fn cohesive_zone(_scenario: &Scenario, plan: &Plan) -> Option<String> {
    let cells = FaultEstimate::of(plan)?.cohesive_zone_cells?;
    (cells < FEWEST_COHESIVE_CELLS).then(|| {
        format!(
            "slider.blocks = {}: the cohesive zone (9 pi / 32) mu D_c / (b sigma) is {cells:.2} cells: below \
             {FEWEST_COHESIVE_CELLS} the results depend on slider.blocks",
            plan.blocks
        )
    })
}

/// Warns of a drive that is faster somewhere than the threshold of events.
fn event_speed(scenario: &Scenario, plan: &Plan) -> Option<String> {
    let law = plan.friction.law.rate_and_state()?;
    let (fastest_m_per_s, event_speed_m_per_s) = (scenario.drive.fastest_m_per_s(), law.event_speed_m_per_s);
    (fastest_m_per_s > event_speed_m_per_s).then(|| {
        format!(
            "drive.course_m_per_s = {fastest_m_per_s} is above V_th = {event_speed_m_per_s:.4e} m/s \
             (friction.event_speed_m_per_s): blocks that follow the drive there count as slipping"
        )
    })
}

/// Warns of blocks without a static threshold.
fn without_threshold(scenario: &Scenario, plan: &Plan) -> Option<String> {
    if !plan.friction.law.word().sticks() {
        return None;
    }
    let free: Vec<usize> = (0..plan.blocks).filter(|&n| plan.friction.static_threshold_n[n] == 0.0).collect();
    if free.is_empty() {
        return None;
    }
    let why = if free.iter().all(|&n| plan.normal_load_n[n] == 0.0) {
        format!("normal_load.tilt = {} leaves {} without load", scenario.normal_load.tilt, blocks(&free))
    } else {
        format!(
            "friction.static_coefficient and the offsets added to it leave {} without friction",
            blocks(&free)
        )
    };
    Some(format!(
        "{why}: with a threshold of 0, each detaches in every step in which it is stuck. Nearly every step then has \
         switches and is recorded, so the log is long, and the run takes about as long as with --solver plain"
    ))
}

/// Formats a ratio of at least 1 with as many digits as distinguish it from 1.
fn times(ratio: f64) -> String {
    if ratio >= 1e6 {
        return format!("{ratio:.3e}");
    }
    let short = format!("{ratio:.4}");
    if ratio > 1.0 && short == "1.0000" { format!("{ratio}") } else { short }
}

/// Formats numbers of blocks, given counted from 0, as ranges.
fn blocks(found: &[usize]) -> String {
    let mut ranges: Vec<(usize, usize)> = Vec::new();
    for &n in found {
        match ranges.last_mut() {
            Some((_, to)) if *to + 1 == n => *to = n,
            _ => ranges.push((n, n)),
        }
    }
    let more = ranges.len().saturating_sub(MOST_RANGES);
    let ranges = ranges.iter().take(MOST_RANGES).map(|&(from, to)| match to - from {
        0 => format!("{}", from + 1),
        _ => format!("{} to {}", from + 1, to + 1),
    });
    let listed = ranges.collect::<Vec<_>>().join(", ");
    let rest = if more > 0 { format!(" and {more} other places") } else { String::new() };
    format!("{} {listed}{rest}", if found.len() == 1 { "block" } else { "blocks" })
}

/// Most ranges of blocks that are listed.
const MOST_RANGES: usize = 5;

#[cfg(test)]
mod tests {
    use super::blocks;
    use crate::scenario::builtin;
    use crate::{Scenario, ScenarioSource};

    fn warnings(sets: &[&str]) -> Vec<String> {
        let source =
            sets.iter().fold(ScenarioSource::new("test", ""), |source, set| source.with_override(set));
        let scenario = Scenario::resolve(&source).unwrap_or_else(|errors| panic!("{errors}"));
        scenario.warnings().into_iter().map(|warning| warning.text).collect()
    }

    fn only(sets: &[&str]) -> String {
        let found = warnings(sets);
        assert_eq!(found.len(), 1, "{found:?}");
        found[0].clone()
    }

    #[test]
    fn what_does_not_surprise_is_not_warned_of() {
        assert_eq!(warnings(&[]), Vec::<String>::new());
        assert_eq!(warnings(&["initial_shear.beta=0.45"]), Vec::<String>::new());
        assert_eq!(warnings(&["time.start=loaded", "normal_load.tilt=0.5"]), Vec::<String>::new());
    }

    #[test]
    fn rows_that_no_disk_holds_are_warned_of() {
        let window = "[[recording.window]]\nfrom_s = 0\nto_s = 100\nfirst_block = 1\nlast_block = 100";
        let of = |every_s: &str, set: &str| {
            let text = format!("time.duration_s = 100\n{window}\nevery_s = {every_s}");
            let source = ScenarioSource::new("test", text).with_override(set);
            Scenario::resolve(&source).unwrap().warnings().into_iter().map(|w| w.text).collect::<Vec<_>>()
        };
        let expected = "recording.window: 1e12 rows are to be recorded, some 24000 GB before compression";
        assert_eq!(of("1e-8", "recording.fields_s=0.1"), [expected]);
        assert_eq!(of("2e-6", "recording.fields_s=0.1"), Vec::<String>::new());
        assert!(of("2e-6", "recording.fields_s=1e-8")[0].starts_with("recording.fields_s: 1e12 rows"));
    }

    #[test]
    fn a_drive_above_the_threshold_of_events_is_warned_of() {
        let of = |event_speed: &str| {
            let course = ["drive.course_s=[0,1]", "drive.course_m_per_s=[1e-4,-0.01]", event_speed];
            let source = ScenarioSource::new("test", "friction.law = 'rate-and-state'");
            let source = course.iter().fold(source, |source, set| source.with_override(set));
            Scenario::resolve(&source).unwrap().warnings().into_iter().map(|w| w.text).collect::<Vec<_>>()
        };
        let start = "drive.course_m_per_s = 0.01 is above V_th = 1.0000e-3 m/s";
        let is_said = |warnings: &[String]| warnings.iter().any(|warning| warning.starts_with(start));
        assert!(is_said(&of("friction.event_speed_m_per_s=1e-3")));
        assert!(!is_said(&of("friction.event_speed_m_per_s=2e-2")));
    }

    #[test]
    fn junctions_that_do_not_weaken_or_break_at_once_are_warned_of() {
        let of = |name: &str, set: &str| {
            let text = builtin::find(name).unwrap();
            let source = ScenarioSource::new(name, text).with_override(set);
            Scenario::resolve(&source).unwrap().warnings().into_iter().map(|w| w.text).collect::<Vec<_>>()
        };
        for name in ["slab-junctions", "chain-junctions", "junction-slider"] {
            assert_eq!(of(name, "time.start=at-rest"), Vec::<String>::new(), "{name}");
        }
        let flat = of("chain-junctions", "friction.dynamic_coefficient=0.2");
        assert!(flat.len() == 1 && flat[0].contains("does not fall with velocity"), "{flat:?}");
        let wide = |width: &str| of("slab-junctions", &format!("friction.junction_width={width}"));
        assert_eq!(wide("0.377"), Vec::<String>::new());
        let broken = wide("0.38");
        assert!(broken.len() == 1 && broken[0].contains("they break in step 1"), "{broken:?}");
        // The outermost of 100 are 0.495 of the width from the mean.
        assert_eq!(of("chain-junctions", "friction.junction_width=0.808"), Vec::<String>::new());
        assert_eq!(of("chain-junctions", "friction.junction_width=0.809").len(), 1);
        for (key, says) in
            [("healing_deviation_s=0.001", "drawn again"), ("healing_time_s=1e-9", "at least one")]
        {
            let said = of("chain-junctions", &format!("friction.{key}"));
            assert!(said.iter().any(|text| text.contains(says)), "{key}: {said:?}");
        }
    }

    #[test]
    fn long_steps_are_warned_of_with_the_longest_stable_one() {
        let coded = "parameter_set=as-coded";
        let source = ScenarioSource::new("", "").with_override(coded);
        let longest_s = Scenario::resolve(&source).unwrap().longest_stable_step_s();
        let at = |ratio: f64| {
            let step_s = ratio * longest_s;
            let sets = [format!("time.step_s={step_s}"), format!("time.duration_s={}", step_s * 1e5)];
            let quiet = ["recording.sample_s=0", "recording.fields_s=0"];
            warnings(&[coded, &sets[0], &sets[1], quiet[0], quiet[1]])
        };
        assert_eq!(at(0.399), Vec::<String>::new());
        let warned = at(0.95);
        assert!(warned[0].starts_with("time.step_s = "), "{warned:?}");
        assert!(warned[0].contains(" is 0.95 of the longest stable step, 3.379e-6 s: beyond 0.4 of it"));
    }

    /// A front is timed in whole steps, so the error of its speed is proportional to them.
    #[test]
    fn steps_too_long_for_fronts_are_warned_of_with_the_error_of_their_speeds() {
        let front = |ratio: f64| {
            let step_s = ratio * 1.155_67e-7;
            let set = [format!("time.step_s={step_s:e}"), format!("time.duration_s={:e}", 1000.0 * step_s)];
            let sets = ["slider.blocks=600", "slider.mass_kg=0.012", "slider.relative_damping=0", &set[0]];
            let quiet = [&set[1], "recording.sample_s=0", "recording.fields_s=0"];
            // Blocks that move from the start may slip in so short a run.
            let moves = ["initial_velocity.amplitude_m_per_s=1e-9"];
            warnings(&[&sets[..], &quiet[..], &moves[..]].concat())
        };
        assert_eq!(front(0.09), Vec::<String>::new());
        let warned = front(0.138);
        assert_eq!(warned.len(), 1, "{warned:?}");
        let expected = "is 0.138 of the time in which a wave crosses a block, 1.156e-7 s: speeds of fronts are wrong by \
                        about 6 %, in proportion to the step";
        assert!(warned[0].contains(expected), "{warned:?}");
        // The steps of the adaptive solver are not those of the grid.
        let sets = ["friction.law=rate-and-state", "friction.critical_slip_m=1e-4"];
        assert_eq!(warnings(&[&sets[..], &["time.step_s=1e-5"]].concat()), Vec::<String>::new());
    }

    #[test]
    fn joined_ends_are_warned_of() {
        let ends = |end: &str| ["left", "right"].map(|side| format!("slider.{side}_end={end}"));
        let of = |end: &str| warnings(&ends(end).each_ref().map(String::as_str));
        let said = of("periodic");
        assert!(said.len() == 1 && said[0].contains("blocks 1 and 100, so a rupture"), "{said:?}");
        for end in ["free", "clamped", "absorbing"] {
            assert_eq!(of(end), Vec::<String>::new(), "{end}");
        }
    }

    #[test]
    fn a_key_without_effect_is_named() {
        assert_eq!(
            only(&["friction.spread_seed=7"]),
            "friction.spread_seed = 7 has no effect: nothing is drawn (friction.static_spread, friction.dynamic_spread, \
             disorder.stiffness_spread and disorder.load_spread are 0), so runs \
             with other seeds are identical"
        );
        for spread in ["friction.static_spread=0.1", "friction.dynamic_spread=0.1"] {
            assert_eq!(warnings(&["friction.spread_seed=7", spread]), Vec::<String>::new());
        }
    }

    #[test]
    fn top_drives_pull_at_the_start_where_there_is_shear() {
        for (set, expected) in
            [("initial_shear.poisson_ratio=0.35", "0.0076"), ("initial_shear.beta=0.45", "0.0122")]
        {
            let said = only(&["drive.kind=top", set]);
            assert!(said.starts_with("drive.kind = \"top\" with initial shear"), "{said}");
            assert!(said.contains(&format!("F_T/F_N = {expected} at the start")), "{said}");
        }
        // K_n u_N is a force on block 100 in addition to its shear of 0.45 times 4 N.
        assert!(
            only(&["drive.kind=top", "initial_shear.beta=0.45"]).ends_with("most on block 100, 9.794e-2 N")
        );
        let said = only(&["drive.kind=left-right", "friction.reattach=two-way", "initial_shear.beta=0.05"]);
        assert!(said.contains("most on block 100"), "{said}");
    }

    #[test]
    fn the_last_block_takes_what_a_profile_leaves() {
        let said = only(&["slider.blocks=4", "initial_shear.profile=[0.1, 0.1, 0.0, 0.1]"]);
        let expected = "initial_shear does not add up to 0: block 4 takes the remainder, and starts with \
                        -0.2000 of a block's mean normal load, not 0.1000";
        assert_eq!(said, expected);
        // A tilt disturbs the balance of (5.50): the last block slips.
        let said = warnings(&["initial_shear.beta=0.2", "normal_load.tilt=0.5"]);
        assert!(said[0].contains("block 100 takes the remainder, and starts with 3.5007 of"), "{said:?}");
        assert!(
            said[1].contains(
                "static friction on block 100, up to 10.0019 times it on block 100: detachment in step 1"
            ),
            "{said:?}"
        );
    }

    #[test]
    fn shear_beyond_static_friction_names_the_blocks() {
        let said = only(&["initial_shear.beta=0.77"]);
        let expected = "initial_shear and prestress exceed static friction on blocks 1 to 5, 96 to 100, \
                        up to 1.1000 times it on block ";
        assert!(said.starts_with(expected), "{said}");
        assert!(
            said.contains(": detachment in step 1. Where nothing else moves a block, its velocity"),
            "{said}"
        );
        let said = only(&["initial_shear.beta=0.77", "friction.reattach=two-way"]);
        assert!(said.contains("rule in the next one, at a velocity of exactly 0. Where"), "{said}");
        // Without friction springs a stuck block is exactly at rest.
        let said = only(&["initial_shear.beta=0.77", "friction.law=rigid"]);
        assert!(said.ends_with(": detachment in step 1"), "{said}");
        let said = only(&["prestress.ratio=0.6", "prestress.first_block_ratio=0.100000000001"]);
        assert!(said.contains("on block 1, up to 1.00000000000"), "{said}");
    }

    #[test]
    fn blocks_that_nothing_holds_are_named_with_what_they_cost() {
        let said = only(&["normal_load.tilt=1"]);
        assert!(
            said.starts_with("normal_load.tilt = 1 leaves block 100 without load: with a threshold of 0")
        );
        assert!(said.ends_with("about as long as with --solver plain"), "{said}");
        assert!(only(&["normal_load.tilt=-1"]).contains("leaves block 1 without load"));
        let said = only(&["friction.static_coefficient=0", "friction.dynamic_coefficient=0"]);
        assert!(said.contains("leave blocks 1 to 100 without friction"), "{said}");
    }

    #[test]
    fn lists_of_blocks_are_short() {
        assert_eq!(blocks(&[0]), "block 1");
        assert_eq!(blocks(&[0, 1, 2, 9]), "blocks 1 to 3, 10");
        let scattered: Vec<usize> = (0..20).step_by(2).collect();
        assert_eq!(blocks(&scattered), "blocks 1, 3, 5, 7, 9 and 5 other places");
    }
}
