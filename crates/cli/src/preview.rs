//! Formats predictions about runs.

use std::collections::BTreeMap;

use asperity_model::scenario::text::short;
use asperity_model::theory::medium::{FEWEST_COHESIVE_CELLS, FaultEstimate};
use asperity_model::theory::stability::FEWEST_NUCLEATION_BLOCKS;
use asperity_model::theory::weakening::Weakening;
use asperity_model::{Plan, Preview, Scenario, Stability, Warning};
use asperity_record::counted;

use crate::validate::duration;

/// Material, load and first slip of a run, one line each, with the topic of the line; of a run in which nothing
/// sticks, material, stability and nucleation.
pub(crate) fn lines(scenario: &Scenario, preview: &Preview) -> [(&'static str, String); 3] {
    let Preview { density_kg_per_m3, wave_speed_m_per_s, decay_length_m, .. } = preview;
    let decay = decay_length_m.map(|length_m| {
        let spacings = length_m / scenario.slider.spacing_m();
        format!(", decay length l_0 = {} m = {} a", short(length_m), short(spacings))
    });
    let after = decay.into_iter().chain(preview.weakening.as_ref().map(of_weakening)).collect::<String>();
    let material = match density_kg_per_m3.zip(*wave_speed_m_per_s) {
        Some((density, speed)) => {
            format!("density {} kg/m^3, waves at c = {} m/s{after}", short(density), short(speed),)
        }
        None if scenario.slider.blocks == 1 => {
            "no inertia: slider.mass_kg sets only the link time".to_owned()
        }
        None => format!(
            "no inertia: slider.mass_kg sets only the link time and the unit of front speeds, c = {} m/s",
            short(scenario.scales().wave_speed_m_per_s())
        ),
    };
    if let Some(fault) = preview.fault {
        return of_fault(&fault);
    }
    if let Some(stability) = preview.stability {
        let [stability, nucleation] = of_sliding(scenario, &stability);
        return [("material", material), ("stability", stability), ("nucleation", nucleation)];
    }
    if scenario.initial.is_given() {
        let start = format!("in a given state, at {} s on the clock of the run", short(start_s(scenario)));
        let first_slip = "not predicted: contacts may slide already".to_owned();
        return [("material", material), ("start", start), ("first slip", first_slip)];
    }
    if !preview.is_predicted {
        let unknown = "not predicted where forces or loads of single contacts follow courses".to_owned();
        return [("material", material), ("load", unknown.clone()), ("first slip", unknown)];
    }
    let reaches = |name: &str, ratio: f64, time_s: Option<f64>| match time_s {
        Some(time_s) => format!("reaches {name} = {ratio} at {} s", short(time_s)),
        None => format!("never reaches {name} = {ratio}"),
    };
    let (mu_d, mu_s) = (scenario.friction.dynamic_coefficient, scenario.friction.static_coefficient);
    let load = match preview.largest_load_ratio {
        Some(largest) => format!(
            "F_T/F_N {}, {}, and is at most {} in this run, if nothing slides",
            reaches("mu_d", mu_d, preview.dynamic_load_s),
            reaches("mu_s", mu_s, preview.static_load_s),
            short(largest)
        ),
        None => "F_T/F_N stays about 0, since the two ends are pulled apart".to_owned(),
    };
    let first_slip = match (preview.first_slip_s, preview.first_slip_block) {
        (Some(time_s), Some(block)) => format!("at {} s, of block {block}", short(time_s)),
        (Some(time_s), None) => format!("at {} s, of several blocks at once", short(time_s)),
        (None, _) => "never".to_owned(),
    };
    [("material", material), ("load", load), ("first slip", first_slip)]
}

/// The medium of a fault line, its lengths in cells, and how long a run may take.
fn of_fault(fault: &FaultEstimate) -> [(&'static str, String); 3] {
    let length = |cells: Option<f64>| match cells {
        Some(cells) => format!("{} m = {} dz", short(cells * fault.spacing_m), short(cells)),
        None => "none".to_owned(),
    };
    let [speed, radiation] = [fault.shear_speed_m_per_s, fault.radiation_pa_s_per_m].map(short);
    let [cohesive, nucleation] = [fault.cohesive_zone_cells, fault.nucleation_cells].map(length);
    let (dz, least) = (short(fault.spacing_m), FEWEST_COHESIVE_CELLS);
    let (steps, time) = (fault.steps, duration(fault.run_time_s));
    [
        ("medium", format!("c_s = {speed} m/s, eta = mu / (2 c_s) = {radiation} Pa s/m")),
        ("cells", format!("dz = {dz} m, Lambda_0 = {cohesive} (warning below {least}), h* = {nucleation}")),
        (
            "estimate",
            format!("about {steps:.0e} steps of the solver, {time} on one core, within a factor of 3"),
        ),
    ]
}

/// How friction falls over a slip, and the length over which slip nucleates.
fn of_weakening(weakening: &Weakening) -> String {
    let Weakening { weakening_n_per_m, weakening_slip_ratio, nucleation_blocks } = weakening;
    let over = nucleation_blocks.map(|blocks| {
        let d = short(*weakening_slip_ratio);
        format!(
            ", d = k/k_w = {d} (lattice below 1), slip nucleates over pi a sqrt(k/(k_w - K_n)) = {} a",
            short(blocks)
        )
    });
    format!(", friction falls by k_w = {} N/m{}", short(*weakening_n_per_m), over.unwrap_or_default())
}

/// When a run begins, on its clock.
fn start_s(scenario: &Scenario) -> f64 {
    let plan = Plan::new(scenario);
    plan.grid.time_s(plan.initial.step)
}

/// The modes of steady sliding that grow, and the length over which slip nucleates.
fn of_sliding(scenario: &Scenario, stability: &Stability) -> [String; 2] {
    let Stability { modes, unstable_modes, critical_stiffness_n_per_m, nucleation_blocks } = *stability;
    let velocity = short(scenario.drive.velocity_m_per_s);
    let grow = match unstable_modes {
        0 => "steady sliding is stable".to_owned(),
        1 => format!("1 of {} grows", counted(modes.into(), "mode")),
        many => format!("{many} of {modes} modes grow"),
    };
    let critical = match critical_stiffness_n_per_m > 0.0 {
        true => {
            format!("a block alone is unstable below k_c = {} N/m", short(critical_stiffness_n_per_m))
        }
        false => "k_c is not above 0: no spring is too soft".to_owned(),
    };
    let nucleation = match nucleation_blocks {
        Some(blocks) => format!(
            "over sqrt(k D_c / (b p)) = {} blocks (warning below {FEWEST_NUCLEATION_BLOCKS})",
            short(blocks)
        ),
        None => "of the block as a whole".to_owned(),
    };
    [format!("at V = {velocity} m/s {grow}; {critical}"), nucleation]
}

/// Load, first slip and time step of several runs, from the least to the greatest; empty without runs.
pub(crate) fn ranges(previews: &[&Preview]) -> Option<String> {
    let range = |value: fn(&Preview) -> Option<f64>| {
        let values = || previews.iter().filter_map(|preview| value(preview));
        let (least, most) =
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        (least <= most).then(|| match (short(least), short(most)) {
            (least, most) if least == most => least,
            (least, most) => format!("{least} to {most}"),
        })
    };
    // What never sticks has no first slip, and not all first slips are predicted.
    let is_known =
        |preview: &&&Preview| preview.stability.is_none() && preview.fault.is_none() && preview.is_predicted;
    let never = previews.iter().filter(is_known).filter(|preview| preview.first_slip_s.is_none()).count();
    let slip = match (range(|preview| preview.first_slip_s), never) {
        (Some(range), 0) => Some(format!("the first slip comes at {range} s")),
        (Some(range), never) => Some(format!("the first slip comes at {range} s; {never} without slip")),
        (None, 0) => None,
        (None, _) => Some("nothing ever slips".to_owned()),
    };
    let parts = [
        range(|preview| preview.largest_load_ratio)
            .map(|range| format!("F_T/F_N is at most {range}, if nothing slides")),
        slip,
        range(|preview| preview.step_ratio)
            .map(|range| format!("the time step is {range} of the longest stable one")),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The warnings of several runs, each run with its label: one of each kind, with the number of runs that
/// it concerns.
pub(crate) fn folded<'a>(runs: impl IntoIterator<Item = (String, &'a [Warning])>) -> Vec<String> {
    let mut order: Vec<(&str, String)> = Vec::new();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for (label, warnings) in runs {
        for Warning { kind, text } in warnings {
            let count = counts.entry(*kind).or_default();
            *count += 1;
            if *count == 1 {
                order.push((*kind, format!("{label}: warning: {text}")));
            }
        }
    }
    order
        .into_iter()
        .map(|(kind, text)| match counts[kind] - 1 {
            0 => text,
            1 => format!("{text} (1 other run likewise)"),
            more => format!("{text} ({more} other runs likewise)"),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use asperity_model::resolve;
    use asperity_model::{Preview, Warning};

    use asperity_model::theory::weakening::Weakening;

    use super::{folded, lines, of_weakening, ranges};

    fn said(sets: &[&str]) -> Vec<String> {
        let scenario = resolve("default", sets).expect("it is accepted");
        lines(&scenario, &scenario.preview()).map(|(what, words)| format!("{what}: {words}")).to_vec()
    }

    #[test]
    fn a_run_is_described_in_three_lines() {
        let stated = said(&["parameter_set=as-stated"]);
        assert_eq!(
            stated,
            [
                "material: density 1200 kg/m^3, waves at c = 1451 m/s, decay length l_0 = 0.00101 m = 1 a",
                "load: F_T/F_N reaches mu_d = 0.45 at 2.254 s, reaches mu_s = 0.7 at 3.507 s, and is at most 0.998 in \
                 this run, if nothing slides",
                "first slip: at 0.05674 s, of block 1",
            ]
        );
        let held = said(&["drive.hold_from_s=0.01", "friction.law=rigid", "parameter_set=as-stated"]);
        assert_eq!(held[0], "material: density 1200 kg/m^3, waves at c = 1451 m/s");
        assert!(
            held[1].starts_with("load: F_T/F_N never reaches mu_d = 0.45, never reaches mu_s = 0.7, and")
        );
        assert_eq!(held[2], "first slip: never");
        let apart = said(&["drive.kind=left-right", "friction.reattach=two-way"]);
        assert_eq!(apart[1], "load: F_T/F_N stays about 0, since the two ends are pulled apart");
        assert!(apart[2].ends_with(" s, of several blocks at once"), "{apart:?}");
    }

    #[test]
    fn steady_sliding_is_described_by_its_modes() {
        let of = |name: &str, sets: &[&str]| {
            let scenario = resolve(name, sets).expect("it is accepted");
            lines(&scenario, &scenario.preview()).map(|(what, words)| format!("{what}: {words}"))
        };
        let chain = of("rate-and-state", &[]);
        assert_eq!(
            chain[1..],
            [
                "stability: at V = 1e-4 m/s 1 of 16 modes grows; a block alone is unstable below k_c = 1.276e5 N/m",
                "nucleation: over sqrt(k D_c / (b p)) = 8.532 blocks (warning below 3)",
            ]
        );
        let slider = of("spring-slider", &["friction.evolution_effect=0.005"]);
        assert_eq!(
            slider[1..],
            [
                "stability: at V = 1e-5 m/s steady sliding is stable; k_c is not above 0: no spring is too soft",
                "nucleation: of the block as a whole",
            ]
        );
        assert_eq!(ranges(&[&resolve::<&str>("spring-slider", &[]).unwrap().preview()]), None);
        // Without inertia nothing runs at c, and the mass is no property of the motion.
        assert_eq!(slider[0], "material: no inertia: slider.mass_kg sets only the link time");
        let without =
            ["friction.inertia=false", "friction.radiation_kg_per_s=200", "slider.relative_damping=0"];
        assert_eq!(
            of("rate-and-state", &without)[0],
            "material: no inertia: slider.mass_kg sets only the link time and the unit of front speeds, c = 1414 m/s"
        );
        assert!(chain[0].starts_with("material: density 1067 kg/m^3, waves at c = "), "{}", chain[0]);
    }

    #[test]
    fn friction_that_falls_over_a_slip_has_a_nucleation_length() {
        assert_eq!(
            of_weakening(&Weakening::new(8e6, 2e8, 0.0)),
            ", friction falls by k_w = 8e6 N/m, d = k/k_w = 25 (lattice below 1), slip nucleates over pi a \
             sqrt(k/(k_w - K_n)) = 15.71 a"
        );
        assert_eq!(of_weakening(&Weakening::new(1e7, 0.0, 8e5)), ", friction falls by k_w = 1e7 N/m");
    }

    #[test]
    fn many_runs_are_described_by_ranges() {
        let of = |set: &str| resolve("default", &[set]).expect("it is accepted").preview();
        let (long, held) = (of("time.duration_s=4"), of("drive.hold_from_s=0.01"));
        let all: [&Preview; 2] = [&long, &held];
        let words = ranges(&all).expect("there are runs");
        assert!(words.starts_with("F_T/F_N is at most 0.001996 to 0.7984, if nothing slides; "), "{words}");
        assert!(words.contains("; the first slip comes at 0.05674 s; 1 without slip; "), "{words}");
        assert!(words.ends_with("; the time step is 0.01756 of the longest stable one"), "{words}");
        assert_eq!(ranges(&[]), None);
        // What is not predicted is not said never to slip.
        let sets = ["prestress.course_s=[1]", "prestress.course_ratio=[0.1]"];
        let unknown = resolve("default", &sets).expect("it is accepted").preview();
        assert_eq!(
            ranges(&[&unknown]),
            Some("the time step is 0.01756 of the longest stable one".to_owned())
        );
    }

    #[test]
    fn warnings_of_a_kind_are_one() {
        let of = |kind, text: &str| Warning { kind, text: text.to_owned() };
        let (two, one) = ([of("a", "x = 1"), of("b", "y")], [of("a", "x = 2")]);
        let runs = [("run 1".to_owned(), &two[..]), ("run 2".to_owned(), &one), ("run 3".to_owned(), &[])];
        let expected = ["run 1: warning: x = 1 (1 other run likewise)", "run 1: warning: y"];
        assert_eq!(folded(runs), expected);
    }
}
