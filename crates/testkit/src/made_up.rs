//! Made-up runs for unit tests.

use std::collections::BTreeSet;

use asperity_model::{NodeState, Plan, Scenario, ScenarioSource};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Collector, RunData};
use asperity_numbers::states::States;
use asperity_record::{
    Arrival, Direction, Event, FieldRecord, Observer, Record, RunHeader, Rupture, SlipEvent, StepRecord,
    Switch,
};
use asperity_testkit::{quiet_step, run_header, rupture, slip_event, switch};

/// Slip events of three blocks: onset and end step, blocks.
pub const EVENTS: [(u64, u64, &[u32]); 7] = [
    (100, 101, &[1]),
    (200, 210, &[1, 2]),
    (300, 310, &[1]),
    (400, 410, &[2, 3]),
    (412, 420, &[1, 3]),
    (500, 510, &[1, 2, 3]),
    (600, 610, &[1, 2, 3]),
];

/// A run of three blocks with these slip events: onset and end step, blocks. There is a step
/// record before each onset, where its blocks detach, and none besides.
pub fn run(scenario_toml: &str, events: &[(u64, u64, &[u32])]) -> RunData {
    of_toml(
        &format!("parameter_set = \"as-coded\"\nslider.blocks = 3\ntime.step_s = 1e-7\n{scenario_toml}"),
        events,
    )
}

/// A run of this scenario with these slip events, see [`run`].
fn of_toml(scenario_toml: &str, events: &[(u64, u64, &[u32])]) -> RunData {
    let source = ScenarioSource::new("test", scenario_toml);
    let scenario = Scenario::resolve(&source).unwrap();
    let plan = Plan::new(&scenario);
    let steps: Vec<StepRecord> = events
        .iter()
        .map(|&(onset, _, blocks)| StepRecord {
            driving_force_n: 1.0,
            normal_load_n: 400.0,
            switches: blocks.iter().map(|&block| switch(block, Direction::Detach)).collect(),
            ..quiet_step(onset - 1, plan.grid.time_s(onset - 1), 0.0)
        })
        .collect();
    let slips = events.iter().zip(0..).map(|(&(onset, end, blocks), event)| SlipEvent {
        onset_s: plan.grid.time_s(onset),
        end_s: Some(plan.grid.time_s(end)),
        max_sliding: blocks.len() as u32,
        ft_fn_onset: 0.1,
        ft_fn_end: Some(0.1),
        event,
        blocks_slipped: blocks.len() as u32,
        nucleation_block: blocks[0],
        ft_fn_min: 0.1,
        ft_fn_max: 0.1,
        ..slip_event(onset, end, *blocks.iter().min().unwrap()..=*blocks.iter().max().unwrap())
    });
    gone_by(&scenario, &steps, slips)
}

/// The data of a run with these step records and slip events.
fn gone_by(scenario: &Scenario, steps: &[StepRecord], slips: impl IntoIterator<Item = SlipEvent>) -> RunData {
    let plan = Plan::new(scenario);
    let header = RunHeader {
        scenario: "test".to_owned(),
        blocks: plan.blocks as u32,
        rows: plan.elastic.layout().rows(),
        time_step_s: plan.grid.step_s(),
        longest_stable_step_s: Some(plan.longest_stable_step_s).filter(|longest_s| longest_s.is_finite()),
        steps: plan.steps,
        ..run_header()
    };
    let mut collector = Collector::new("test", header, scenario.clone(), RequiredData::all());
    steps.iter().for_each(|step| collector.record(&Record::Step(step.clone())));
    slips.into_iter().for_each(|slip| collector.event(&Event::new(slip)));
    collector.finish(false, None)
}

/// Lets these states of all blocks go by once more, among the slip events that the run has.
pub fn with_states(run: &mut RunData, states: &[FieldRecord]) {
    let mut kept = States::new(run.header.blocks, &run.kept);
    let onsets = run.slips.iter().map(|slip| slip.onset_step);
    let ends = run.slips.iter().filter_map(|slip| slip.end_step);
    let steps: BTreeSet<u64> = onsets.chain(ends).chain(states.iter().map(|state| state.step)).collect();
    for step in steps {
        let slides =
            |slip: &&SlipEvent| slip.onset_step <= step && slip.end_step.is_none_or(|end| step < end);
        let sliding = run.slips.iter().filter(slides).count() as u32;
        kept.step(&StepRecord { sliding, ..quiet_step(step, run.plan.grid.time_s(step), 0.0) });
        states.iter().filter(|state| state.step == step).for_each(|state| kept.state(state));
        run.slips.iter().filter(|slip| slip.end_step == Some(step)).for_each(|slip| kept.slip(slip));
    }
    kept.end();
    run.states = kept;
}

/// A block that a rupture passes: its number, the steps of its arrival and, if it stops, of its stop.
pub type Passed = (u32, u64, Option<u64>);

/// Gives a run these ruptures, each by the blocks that it passes in the order of their arrival.
pub fn with_ruptures(run: &mut RunData, ruptures: &[&[Passed]]) {
    let time_s = |step: u64| run.plan.grid.time_s(step);
    let c_m_per_s = |from: &Passed, to: &Passed| {
        let way_m = f64::from(to.0.abs_diff(from.0)) * run.plan.spacing_m;
        (to.1 > from.1).then(|| way_m / (time_s(to.1) - time_s(from.1)))
    };
    let mut told = Vec::new();
    let mut arrivals = Vec::new();
    for (number, passed) in ruptures.iter().enumerate() {
        let (number, first) = (number as u64, passed[0]);
        let blocks = passed.iter().map(|(block, ..)| *block);
        let slipped = blocks.clone().count() as u32;
        let contacts = run.header.contacts();
        let columns = blocks.clone().map(|block| contacts.column(block));
        let (low, high) = (columns.clone().min().unwrap(), columns.max().unwrap());
        let rows = blocks.map(|block| contacts.row(block));
        let over_area = |value: Option<u32>| value.filter(|_| contacts.is_area());
        let end_step = passed.iter().map(|(.., stop)| *stop).collect::<Option<Vec<u64>>>();
        let end_step = end_step.map(|stops| stops.into_iter().max().unwrap());
        let last = passed[passed.len() - 1];
        told.push(Rupture {
            rupture: number,
            onset_s: time_s(first.1),
            end_s: end_step.map(time_s),
            nucleation_block: first.0,
            reached_every_block: match contacts.rows() {
                1 => (low, high) == (1, run.header.blocks),
                _ => slipped == contacts.count(),
            },
            ft_fn_onset: 0.01 * number as f64,
            arrival_s: time_s(last.1),
            detachments: passed.len() as u64,
            front_speed_up_m_per_s: c_m_per_s(&first, &last),
            first_across: over_area(rows.clone().min()),
            last_across: over_area(rows.max()),
            contacts: over_area(Some(slipped)),
            ..rupture(first.1, end_step, low..=high)
        });
        for (n, (block, arrival_step, stop_step)) in passed.iter().enumerate() {
            arrivals.push(Arrival {
                rupture: number,
                block: *block,
                arrival_s: time_s(*arrival_step),
                stop_s: stop_step.map(time_s),
                arrival_step: *arrival_step,
                stop_step: *stop_step,
                detachments: 1,
                front_speed_m_per_s: n
                    .checked_sub(1)
                    .and_then(|before| c_m_per_s(&passed[before], &passed[n])),
                column: over_area(Some(contacts.column(*block))),
                across: over_area(Some(contacts.row(*block))),
                ..Arrival::default()
            });
        }
    }
    run.ruptures = Some(told);
    run.arrivals = arrivals;
    run.kept.arrivals = true;
}

/// Twelve blocks: those up to `reached` slide one after the other for 250 steps each, by 2e-6 m; the first
/// three start 30 steps apart, the others 100.
pub fn pulse(reached: u32, toml: &str) -> RunData {
    let text = format!(
        "parameter_set = \"as-coded\"\nslider.blocks = 12\ntime.step_s = 1e-9\nfriction.law = \"rigid\"\n\
         drive = {{ kind = \"top\", velocity_m_per_s = 0, stiffness_n_per_m = 1.65e8 }}\n{toml}"
    );
    let scenario = Scenario::resolve(&ScenarioSource::new("test", &text)).unwrap();
    let plan = Plan::new(&scenario);
    let arrival = |block: u32| if block <= 3 { 30 * block } else { 90 + 100 * (block - 3) };
    let mut records: Vec<StepRecord> = (1..=reached)
        .flat_map(|block| {
            [(arrival(block), Direction::Detach, 1e-6), (arrival(block) + 250, Direction::Attach, 3e-6)].map(
                |(step, direction, displacement_m)| StepRecord {
                    switches: vec![Switch { displacement_m, ..switch(block, direction) }],
                    ..quiet_step(u64::from(step), plan.grid.time_s(u64::from(step)), 0.0)
                },
            )
        })
        .collect();
    records.sort_by_key(|record| record.step);
    gone_by(&scenario, &records, [])
}

/// A slab of three contacts and as many rows with these slip events, and its state at rest, where the
/// contacts bear 1/4, 1/2 and 1/4 of 400 N.
pub fn slab(events: &[(u64, u64, &[u32])]) -> RunData {
    let mut run = run("slider.rows = 3\nslider.length_m = 0.1\nslider.height_m = 0.1", events);
    run.kept.states = true;
    let state = FieldRecord {
        step: 0,
        time_s: 0.0,
        displacement_m: vec![0.0; 3],
        velocity_m_per_s: vec![0.0; 3],
        tangential_force_n: vec![-20.0, 0.0, 20.0],
        normal_load_n: vec![100.0, 200.0, 100.0],
        stick_position_m: vec![0.0; 3],
        detached: vec![0; 3],
        ..FieldRecord::default()
    };
    with_states(&mut run, &[state]);
    run
}

/// A sheet of four columns and three rows with these slip events, at rest, 0.1 m long and 0.2/3 m wide. Contacts
/// 1 to 4 are the first row.
pub fn sheet(events: &[(u64, u64, &[u32])]) -> RunData {
    let size = "slider.blocks = 4\nslider.width_m = 0.06666666666666667\nslider.height_m = 0.01";
    of_toml(&format!("{OVER_AREA}\n{size}\ntime.step_s = 1e-7"), events)
}

/// A body of three nodes along each axis, a cube of 0.1 m, with these slip events.
pub fn body(events: &[(u64, u64, &[u32])]) -> RunData {
    let size = "slider.blocks = 3\nslider.rows = 3\nslider.width_m = 0.1\nslider.height_m = 0.1";
    of_toml(&format!("{OVER_AREA}\n{size}\ntime.step_s = 1e-7"), events)
}

/// The keys of sliders over an area.
const OVER_AREA: &str =
    "parameter_set = \"as-stated\"\nslider.across = 3\nslider.length_m = 0.1\nfriction.reattach = \"turn\"";

/// The state of all nodes of a lattice at a step: at rest but for these displacements, m.
pub fn nodes(run: &RunData, step: u64, displacement_m: Vec<f64>) -> NodeState {
    let lattice = run.plan.elastic;
    NodeState {
        step,
        time_s: run.plan.grid.time_s(step),
        lattice,
        spacing_m: run.plan.spacing_m,
        velocity_m_per_s: vec![0.0; lattice.freedoms()],
        tangential_force_n: vec![0.0; lattice.contacts() * lattice.tangential_axes()],
        normal_load_n: run.plan.normal_load_n.clone(),
        slides: vec![0.0; lattice.contacts()],
        displacement_m,
    }
}
