//! Kinds of runs whose records and events have parts that those of a chain lack, each with made-up records:
//! contacts over an area, and counts of junctions. Everything in them follows from a few numbers.

use asperity_record::{
    Direction, FieldRecord, JunctionTotals, Record, RunHeader, StepRecord, Switch, SwitchAcross, WindowRecord,
};
use asperity_testkit::{quiet_step, switch};

/// A kind of run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kind {
    /// Overrides of the default scenario.
    pub(crate) sets: &'static [&'static str],
    /// Gives the header of that scenario this kind.
    pub(crate) announce: fn(&mut RunHeader),
    /// The records. Nothing slides in those up to step 2.
    pub(crate) records: fn(&RunHeader) -> Vec<Record>,
}

/// Four columns and three rows of contacts. Contacts 1 to 4 are the first row, 5 to 8 the second.
pub(crate) const AREA: Kind = Kind {
    sets: &["slider.blocks=12", "time.duration_s=1e-3"],
    announce: |header| header.rows = 3,
    records: over_area,
};

/// Three blocks with ten junctions at each contact.
pub(crate) const JUNCTIONS: Kind = Kind {
    sets: &["slider.blocks=3", "time.duration_s=1e-3"],
    announce: |header| header.junction_count = 10,
    records: of_junctions,
};

/// Contact 6 slides in steps 3 and 4, contact 3, a neighbour across a corner, in step 4; contact 12 from step
/// 9 on.
fn over_area(header: &RunHeader) -> Vec<Record> {
    use Direction::{Attach, Detach};
    let grid = header.time_grid();
    // Force and displacement follow from the number of the contact.
    let at = |&(contact, direction): &(u32, Direction)| {
        let n = f64::from(contact);
        let [along, across] = match direction {
            Detach => [[0.0, 3.0], [0.0, -4.0]],
            Attach => [[0.25 * n, 1.0], [0.5, 0.0]],
        };
        Switch {
            displacement_m: along[0],
            tangential_force_n: along[1],
            threshold_n: 5.0,
            across: Some(SwitchAcross {
                displacement_m: across[0],
                tangential_force_n: across[1],
                velocity_m_per_s: -0.125,
                stick_position_m: 0.0625,
            }),
            ..switch(contact, direction)
        }
    };
    let step = |step: u64, sliding: u32, switches: &[(u32, Direction)]| {
        let switches = switches.iter().map(at).collect();
        Record::Step(StepRecord { sliding, switches, ..quiet_step(step, grid.time_s(step), 0.5) })
    };
    let count = header.blocks as usize;
    let numbers = |from: f64| (0..count).map(|n| from + n as f64).collect::<Vec<f64>>();
    let state = FieldRecord {
        step: 3,
        time_s: grid.time_s(3),
        displacement_m: numbers(0.5),
        velocity_m_per_s: numbers(0.25),
        tangential_force_n: numbers(2.0),
        stick_position_m: numbers(0.125),
        detached: (1..=count).map(|contact| u8::from([3, 6].contains(&contact))).collect(),
        displacement_across_m: numbers(-0.5),
        velocity_across_m_per_s: numbers(-0.25),
        tangential_force_across_n: numbers(-2.0),
        stick_position_across_m: numbers(-0.125),
        ..FieldRecord::default()
    };
    let window = WindowRecord {
        step: 3,
        time_s: grid.time_s(3),
        sliding: 1,
        first_block: 5,
        displacement_m: vec![0.5, 1.5],
        velocity_m_per_s: vec![0.25, 1.25],
        tangential_force_n: vec![2.0, 3.0],
        displacement_across_m: vec![-0.5, -1.5],
        velocity_across_m_per_s: vec![-0.25, -1.25],
        tangential_force_across_n: vec![-2.0, -3.0],
        ..WindowRecord::default()
    };
    vec![
        step(2, 0, &[(6, Detach)]),
        step(3, 1, &[(3, Detach)]),
        Record::Fields(Box::new(state)),
        Record::Window(window),
        step(4, 2, &[(3, Attach), (6, Attach)]),
        step(5, 0, &[]),
        step(8, 0, &[(12, Detach)]),
        step(9, 1, &[]),
    ]
}

/// Block 1 slides in steps 3 and 4, block 2 from step 6 on.
fn of_junctions(header: &RunHeader) -> Vec<Record> {
    use Direction::{Attach, Detach};
    let grid = header.time_grid();
    let step = |step: u64, sliding: u32, breaks: u64, repins: u64, switches: &[(u32, Direction, u32)]| {
        let switches = switches.iter().map(|&(block, direction, slipping)| Switch {
            junctions_slipping: Some(slipping),
            ..switch(block, direction)
        });
        Record::Step(StepRecord {
            sliding,
            switches: switches.collect(),
            junctions: Some(JunctionTotals { breaks, repins }),
            ..quiet_step(step, grid.time_s(step), 0.5)
        })
    };
    let state = FieldRecord {
        step: 3,
        time_s: grid.time_s(3),
        displacement_m: vec![0.5; 3],
        velocity_m_per_s: vec![0.25; 3],
        tangential_force_n: vec![2.0; 3],
        stick_position_m: vec![0.125; 3],
        detached: vec![1, 0, 0],
        junctions_slipping: vec![6, 1, 0],
        pinned_mean_ratio: vec![0.0625, 0.25, 0.3],
        pinned_width_ratio: vec![0.05, 0.1, 0.2],
        ..FieldRecord::default()
    };
    vec![
        step(2, 0, 0, 0, &[(1, Detach, 5)]),
        step(3, 1, 5, 0, &[]),
        Record::Fields(Box::new(state)),
        step(4, 1, 7, 1, &[(1, Attach, 4)]),
        step(5, 0, 8, 4, &[(2, Detach, 5)]),
        step(6, 1, 13, 4, &[]),
    ]
}
