//! Every kind of figure of runs in which little or nothing happens: it is drawn, or says what lacks.

use std::collections::BTreeMap;

use asperity_numbers::run_data::RunData;
use asperity_record::{FieldRecord, WindowRecord};
use asperity_testkit::made_up::{self, EVENTS};
use schemars::schema_for;

use crate::draw::Figures;
use crate::draw::kind::Figure;

/// One of each kind.
fn examples() -> Figures {
    let mut example: toml::Table = crate::keys::EXAMPLES[0].parse().unwrap();
    let figures: toml::Table = example.remove("figure").unwrap().try_into().unwrap();
    let schema = serde_json::to_value(schema_for!(Figures)).unwrap();
    let kinds = schema["properties"].as_object().unwrap().keys();
    let of_runs: Vec<&String> = kinds.filter(|kind| *kind != "family").collect();
    assert_eq!(of_runs.len(), figures.len(), "a kind has no example");
    figures.try_into().unwrap()
}

/// With a state of all blocks, a dense record of them and, of a slab, its nodes, all at rest in the first step.
fn with_records(mut run: RunData) -> RunData {
    let blocks = run.plan.blocks;
    let rest = || vec![0.0; blocks];
    let is_area = run.plan.elastic.layout().is_area();
    let across = || if is_area { rest() } else { Vec::new() };
    let loads_n = if !run.plan.has_given_loads() { rest() } else { Vec::new() };
    let state = FieldRecord {
        step: 0,
        time_s: 0.0,
        displacement_m: rest(),
        velocity_m_per_s: rest(),
        tangential_force_n: rest(),
        normal_load_n: loads_n,
        stick_position_m: rest(),
        detached: vec![0; blocks],
        junctions_slipping: if run.plan.friction.law.junctions().is_some() {
            vec![0; blocks]
        } else {
            Vec::new()
        },
        pinned_mean_ratio: rest(),
        pinned_width_ratio: rest(),
        state: Vec::new(),
        displacement_across_m: across(),
        velocity_across_m_per_s: across(),
        tangential_force_across_n: across(),
        stick_position_across_m: across(),
    };
    made_up::with_states(&mut run, &[state]);
    let record = WindowRecord {
        window: 0,
        step: 0,
        time_s: 0.0,
        sliding: 0,
        first_block: 1,
        displacement_m: rest(),
        velocity_m_per_s: rest(),
        tangential_force_n: rest(),
        displacement_across_m: across(),
        velocity_across_m_per_s: across(),
        tangential_force_across_n: across(),
    };
    run.windows = vec![record];
    let elastic = &run.plan.elastic;
    if elastic.as_chain().is_none() {
        run.nodes = vec![made_up::nodes(&run, 0, vec![0.0; elastic.freedoms()])];
    }
    run
}

/// Runs of one step and more, without an event and with some, of chains and slabs, at rest and
/// unloaded.
pub(in crate::draw) fn runs() -> Vec<RunData> {
    let mut runs = Vec::new();
    for events in [&[][..], &[(1, 2, &[1][..])], &EVENTS[..1], &EVENTS] {
        for toml in ["", "drive.velocity_m_per_s = 0", "initial_shear.beta = 0.2", "friction.law = \"rigid\""]
        {
            runs.push(made_up::run(toml, events));
        }
        runs.push(made_up::slab(events));
        runs.extend([made_up::sheet(events), made_up::body(events)]);
    }
    runs.extend([1, 2, 12].map(|reached| made_up::pulse(reached, "prestress.ratio = 0.6")));
    runs.push(made_up::pulse(1, ""));
    runs.push(made_up::run("friction.law = \"junctions\"\nfriction.dynamic_coefficient = 0.2", &EVENTS));
    let with_ruptures = |mut run: RunData, ruptures: &[&[made_up::Passed]]| {
        made_up::with_ruptures(&mut run, ruptures);
        run
    };
    let mut all = Vec::new();
    for run in runs {
        let last = run.header.steps;
        let ruptures: [&[&[made_up::Passed]]; 4] = [
            &[],
            // One that begins in the last step, one of the first, and one of all blocks.
            &[&[(1, last, None)]],
            &[&[(1, 0, Some(0))]],
            &[&[(1, 1, None), (2, 1, None), (3, 1, None)]],
        ];
        for ruptures in ruptures {
            let run = with_ruptures(with_records(run.clone()), ruptures);
            let of_steps = |steps: u64| {
                let mut run = run.clone();
                run.header.steps = steps;
                run
            };
            let loaded_with = |load_n: f64| {
                let mut run = run.clone();
                run.loads.iter_mut().for_each(|load| load.normal_load_n = load_n);
                run
            };
            all.extend([of_steps(1), of_steps(600), loaded_with(0.0), loaded_with(f64::MIN_POSITIVE)]);
            all.push(run);
        }
    }
    all
}

/// The page of a figure all of whose runs are this one.
fn drawn(figure: &dyn Figure, run: &RunData) -> Result<(), String> {
    let run = RunData { kept: figure.required_data(), ..run.clone() };
    let parts = figure.runs().into_iter().map(|(_, pen)| figure.part(&run, pen));
    let sheet = figure.sheet(parts.collect::<Result<_, String>>()?)?;
    sheet.page(Some("foot")).map(drop)
}

#[test]
fn a_figure_of_any_run_is_drawn_or_says_what_lacks() {
    // Each kind with runs of every sort: variants of a run follow each other by fives and by twenties.
    draw_one_in(11);
}

#[test]
#[ignore = "a minute of drawing: cargo xtask nightly"]
fn every_figure_of_every_run_is_drawn_or_says_what_lacks() {
    draw_one_in(1);
}

/// Draws every `stride`-th run as each kind, another of them as each next kind. An axis of no length made
/// `reduce` panic.
fn draw_one_in(stride: usize) {
    let (figures, runs) = (examples(), runs());
    let (mut drawn_of, mut refused, mut cells) = (BTreeMap::new(), 0, 0);
    let mut all_of = BTreeMap::new();
    for (kind, (_, figure)) in figures.all().into_iter().enumerate() {
        for run in runs.iter().skip(kind % stride).step_by(stride) {
            cells += 1;
            *all_of.entry(figure.frame().file).or_insert(0) += 1;
            match drawn(figure, run) {
                Ok(()) => *drawn_of.entry(figure.frame().file).or_insert(0) += 1,
                Err(why) => {
                    let is_wanted = !why.contains("not kept");
                    assert!(
                        why.len() > 10 && !why.contains("NaN") && is_wanted,
                        "{}: {why}",
                        figure.frame().file
                    );
                    refused += 1;
                }
            }
        }
    }
    assert!(
        cells > 10_000 / stride && refused < 3 * cells / 4,
        "{refused} of {cells} are not drawn: {drawn_of:?}"
    );
    // What any run has is drawn of all.
    for always in ["load.png", "loads.png", "slipped.png", "sizes.png", "recurrence.png"] {
        assert_eq!(drawn_of[always], all_of[always], "{always}: {drawn_of:?}");
    }
}
