//! Records as rows, with the doubles of the log as they are. Events define their own rows.

use asperity_record::{Cell, CellValue, FieldRecord, JunctionTotals, StepRecord, Switch, WindowRecord};

use crate::batch::Batch;
use crate::layout::StepParts;

/// A record with an array that does not have one value per block.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("step {step}: a record of {topic} has arrays of {lengths:?} values (accepted: one length for all)")]
pub(crate) struct Ragged {
    topic: &'static str,
    step: u64,
    lengths: Vec<usize>,
}

impl Ragged {
    fn check(topic: &'static str, step: u64, lengths: &[usize]) -> Result<(), Ragged> {
        match lengths.iter().all(|length| *length == lengths[0]) {
            true => Ok(()),
            false => Err(Ragged { topic, step, lengths: lengths.to_vec() }),
        }
    }
}

/// A step record as a row of the table of [`step_columns`](crate::layout::step_columns).
pub fn step(batch: &mut Batch, record: &StepRecord, parts: StepParts) {
    let mut row = vec![
        Cell::Step(record.step),
        Cell::Number(record.time_s),
        Cell::Number(record.driving_force_n),
        Cell::Number(record.normal_load_n),
        Cell::Number(record.load_ratio()),
        Cell::Count(record.sliding),
        Cell::Count(record.switches.len() as u32),
    ];
    if parts.end_forces {
        row.extend([0, 1].map(|end| record.end_forces_n.map(|ends| ends[end]).cell()));
    }
    if parts.energies {
        let energies = record.energy.parts();
        row.extend(energies.map(|(_, energy)| Cell::Number(energy)));
    }
    row.extend(parts.state.then(|| record.peak_velocity_m_per_s.cell()));
    if parts.junctions {
        let JunctionTotals { breaks, repins } = record.junctions.unwrap_or_default();
        row.extend([breaks, repins].map(Cell::Step));
    }
    batch.push(&row);
}

pub(crate) fn switch(batch: &mut Batch, record: &StepRecord, switch: &Switch, parts: StepParts) {
    let cells = [
        Cell::Step(record.step),
        Cell::Number(record.time_s),
        Cell::Count(switch.block),
        switch.direction.cell(),
        Cell::Number(switch.displacement_m),
        Cell::Number(switch.velocity_m_per_s),
        Cell::Number(switch.tangential_force_n),
        Cell::Number(switch.stick_position_m),
        Cell::Number(switch.threshold_n),
        switch.junctions_slipping.cell(),
    ];
    let cells = &cells[..if parts.junctions { 10 } else { 9 }];
    if !parts.area {
        return batch.push(cells);
    }
    let across = [
        switch.across.map(|across| across.displacement_m).cell(),
        switch.across.map(|across| across.velocity_m_per_s).cell(),
        switch.across.map(|across| across.tangential_force_n).cell(),
        switch.across.map(|across| across.stick_position_m).cell(),
    ];
    batch.push(&[cells, &across].concat());
}

pub(crate) fn fields(batch: &mut Batch, record: &FieldRecord, parts: StepParts) -> Result<(), Ragged> {
    let FieldRecord {
        step,
        time_s,
        displacement_m,
        velocity_m_per_s,
        tangential_force_n,
        normal_load_n,
        stick_position_m,
        detached,
        junctions_slipping,
        pinned_mean_ratio,
        pinned_width_ratio,
        state,
        displacement_across_m,
        velocity_across_m_per_s,
        tangential_force_across_n,
        stick_position_across_m,
    } = record;
    let across =
        [displacement_across_m, velocity_across_m_per_s, tangential_force_across_n, stick_position_across_m];
    let mut lengths = vec![
        displacement_m.len(),
        velocity_m_per_s.len(),
        tangential_force_n.len(),
        stick_position_m.len(),
        detached.len(),
    ];
    let mut optional = |length: usize, is_there: bool| {
        if is_there || length > 0 {
            // If the table has no column for them, they are an error, as too few values are.
            lengths.push(if is_there { length } else { 0 });
        }
    };
    optional(normal_load_n.len(), parts.contact_loads);
    optional(junctions_slipping.len(), parts.junctions);
    optional(pinned_mean_ratio.len(), parts.junctions);
    optional(pinned_width_ratio.len(), parts.junctions);
    optional(state.len(), parts.state);
    across.iter().for_each(|values| optional(values.len(), parts.area));
    Ragged::check(crate::layout::FIELDS, *step, &lengths)?;
    let mut row = Vec::new();
    for (index, block) in (0..displacement_m.len()).zip(1..) {
        row.clear();
        row.extend([
            Cell::Step(*step),
            Cell::Number(*time_s),
            Cell::Count(block),
            Cell::Number(displacement_m[index]),
            Cell::Number(velocity_m_per_s[index]),
            Cell::Number(tangential_force_n[index]),
            Cell::Number(stick_position_m[index]),
            Cell::Flag(detached[index] != 0),
        ]);
        row.extend(parts.contact_loads.then(|| Cell::Number(normal_load_n[index])));
        if parts.junctions {
            row.extend([
                Cell::Count(junctions_slipping[index]),
                Cell::Number(pinned_mean_ratio[index]),
                Cell::Number(pinned_width_ratio[index]),
            ]);
        }
        row.extend(parts.state.then(|| Cell::Number(state[index])));
        if parts.area {
            row.extend(across.map(|values| Cell::Number(values[index])));
        }
        batch.push(&row);
    }
    Ok(())
}

/// The nodes of a slab, a sheet or a body after a step.
#[derive(Debug, Clone, Copy)]
pub struct NodeRows<'a> {
    /// The step.
    pub step: u64,
    /// Its time, s.
    pub time_s: f64,
    /// Nodes along the sliding direction, across it, and upwards; they are counted in this order.
    pub counts: [usize; 3],
    /// The axes along which they move, ascending: 0 along the sliding direction, 1 across, 2 upwards.
    pub axes: &'static [usize],
    /// Displacements of all nodes along the first of the axes, then along the next, m.
    pub displacement_m: &'a [f64],
    /// Velocities in the same order, m/s.
    pub velocity_m_per_s: &'a [f64],
}

pub(crate) fn nodes(batch: &mut Batch, of: &NodeRows<'_>) {
    let [columns, across, rows] = of.counts;
    let nodes = columns * across * rows;
    let counted = |index: usize| Cell::Count(u32::try_from(index + 1).expect("there are fewer nodes"));
    let mut row = Vec::new();
    for node in 0..nodes {
        row.clear();
        row.extend([Cell::Step(of.step), Cell::Number(of.time_s), counted(node / columns / across)]);
        row.extend(of.axes.contains(&1).then(|| counted(node / columns % across)));
        row.push(counted(node % columns));
        for values in [of.displacement_m, of.velocity_m_per_s] {
            row.extend((0..of.axes.len()).map(|axis| Cell::Number(values[axis * nodes + node])));
        }
        batch.push(&row);
    }
}

pub(crate) fn window(batch: &mut Batch, record: &WindowRecord, parts: StepParts) -> Result<(), Ragged> {
    let WindowRecord {
        window,
        step,
        time_s,
        sliding,
        first_block,
        displacement_m,
        velocity_m_per_s,
        tangential_force_n,
        displacement_across_m,
        velocity_across_m_per_s,
        tangential_force_across_n,
    } = record;
    let across = [displacement_across_m, velocity_across_m_per_s, tangential_force_across_n];
    let mut lengths = vec![displacement_m.len(), velocity_m_per_s.len(), tangential_force_n.len()];
    if parts.area || across.iter().any(|values| !values.is_empty()) {
        // If the table has no column for them, they are an error, as too few values are.
        lengths.extend(across.map(|values| if parts.area { values.len() } else { 0 }));
    }
    Ragged::check(crate::layout::WINDOW, *step, &lengths)?;
    let mut row = Vec::new();
    for (index, block) in (0..displacement_m.len()).zip(*first_block..) {
        row.clear();
        row.extend([
            Cell::Count(*window),
            Cell::Step(*step),
            Cell::Number(*time_s),
            Cell::Count(*sliding),
            Cell::Count(block),
            Cell::Number(displacement_m[index]),
            Cell::Number(velocity_m_per_s[index]),
            Cell::Number(tangential_force_n[index]),
        ]);
        if parts.area {
            row.extend(across.map(|values| Cell::Number(values[index])));
        }
        batch.push(&row);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use asperity_record::{Cell, Direction, FieldRecord, Switch, SwitchAcross, WindowRecord};

    use super::{fields, switch, window};
    use crate::batch::Batch;
    use crate::layout::{StepParts, record_layouts};

    #[test]
    fn a_state_becomes_one_row_per_block() {
        let state = FieldRecord {
            step: 8,
            time_s: 0.5,
            displacement_m: vec![1e-7, 2e-7],
            velocity_m_per_s: vec![5e-324, -0.0],
            tangential_force_n: vec![1.0, 2.0],
            normal_load_n: Vec::new(),
            stick_position_m: vec![3.0, 4.0],
            detached: vec![0, 1],
            ..FieldRecord::default()
        };
        let mut batch = Batch::new(&record_layouts(StepParts::default())[2].columns);
        fields(&mut batch, &state, StepParts::default()).unwrap();
        let column = |n: usize| (0..2).map(|row| batch.columns()[n].cell(row)).collect::<Vec<_>>();
        assert_eq!(column(0), [Cell::Step(8), Cell::Step(8)]);
        assert_eq!(column(2), [Cell::Count(1), Cell::Count(2)]);
        assert_eq!(column(4), [Cell::Number(5e-324), Cell::Number(-0.0)]);
        assert_eq!(column(7), [Cell::Flag(false), Cell::Flag(true)]);

        let short = FieldRecord { stick_position_m: vec![3.0], ..state };
        let error = fields(&mut batch, &short, StepParts::default()).unwrap_err().to_string();
        assert!(error.contains("step 8") && error.contains("/fields") && error.contains("[2, 2, 2, 1, 2]"));
        assert_eq!(batch.rows(), 2, "nothing of it is taken");

        let parts = StepParts { contact_loads: true, ..StepParts::default() };
        let mut batch = Batch::new(&record_layouts(parts)[2].columns);
        let slab = FieldRecord { normal_load_n: vec![5.0, 6.0], stick_position_m: vec![3.0, 4.0], ..short };
        fields(&mut batch, &slab, parts).unwrap();
        assert_eq!(batch.columns()[8].cell(1), Cell::Number(6.0));
        assert!(fields(&mut batch, &slab, StepParts::default()).is_err(), "a log is of a chain or of a slab");

        let parts = StepParts { junctions: true, ..parts };
        let mut batch = Batch::new(&record_layouts(parts)[2].columns);
        assert!(fields(&mut batch, &slab, parts).is_err(), "it has no junctions");
        let torn = FieldRecord {
            junctions_slipping: vec![0, 7],
            pinned_mean_ratio: vec![0.1, 0.2],
            pinned_width_ratio: vec![0.3, 0.4],
            ..slab
        };
        fields(&mut batch, &torn, parts).unwrap();
        let last = [9, 10, 11].map(|n| batch.columns()[n].cell(1));
        assert_eq!(last, [Cell::Count(7), Cell::Number(0.2), Cell::Number(0.4)]);

        let parts = StepParts { area: true, ..parts };
        let mut batch = Batch::new(&record_layouts(parts)[2].columns);
        assert!(fields(&mut batch, &torn, parts).is_err(), "it has nothing across");
        let over_area = FieldRecord {
            state: Vec::new(),
            displacement_across_m: vec![1.0, 2.0],
            velocity_across_m_per_s: vec![3.0, 4.0],
            tangential_force_across_n: vec![5.0, 6.0],
            stick_position_across_m: vec![7.0, 8.0],
            ..torn
        };
        fields(&mut batch, &over_area, parts).unwrap();
        let last = [12, 13, 14, 15].map(|n| batch.columns()[n].cell(1));
        assert_eq!(last, [2.0, 4.0, 6.0, 8.0].map(Cell::Number));
        let without = StepParts { area: false, ..parts };
        assert!(fields(&mut batch, &over_area, without).is_err());
    }

    #[test]
    fn a_switch_over_an_area_has_its_components_across_last() {
        let across = SwitchAcross {
            displacement_m: 1.0,
            velocity_m_per_s: 2.0,
            tangential_force_n: 3.0,
            stick_position_m: 4.0,
        };
        let one = Switch {
            threshold_n: 5.0,
            junctions_slipping: Some(6),
            across: Some(across),
            ..asperity_testkit::switch(2, Direction::Detach)
        };
        let record = asperity_testkit::quiet_step(8, 0.5, 0.25);
        for (junctions, area, last) in [
            (false, false, vec![]),
            (true, false, vec![Cell::Count(6)]),
            (false, true, [1.0, 2.0, 3.0, 4.0].map(Cell::Number).to_vec()),
        ] {
            let parts = StepParts { junctions, area, ..StepParts::default() };
            let mut batch = Batch::new(&record_layouts(parts)[1].columns);
            switch(&mut batch, &record, &one, parts);
            let cells: Vec<Cell> = batch.columns().iter().skip(8).map(|column| column.cell(0)).collect();
            assert_eq!(cells, [vec![Cell::Number(5.0)], last].concat());
        }
    }

    #[test]
    fn blocks_of_a_window_count_from_its_first() {
        let dense = WindowRecord {
            window: 3,
            step: 8,
            time_s: 0.5,
            sliding: 1,
            first_block: 41,
            displacement_m: vec![0.0; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![0.0; 3],
            ..WindowRecord::default()
        };
        let parts = StepParts::default();
        let mut batch = Batch::new(&record_layouts(parts)[3].columns);
        window(&mut batch, &dense, parts).unwrap();
        let blocks: Vec<Cell> = (0..3).map(|row| batch.columns()[4].cell(row)).collect();
        assert_eq!(blocks, [Cell::Count(41), Cell::Count(42), Cell::Count(43)]);

        let area = StepParts { area: true, ..parts };
        let mut batch = Batch::new(&record_layouts(area)[3].columns);
        assert!(window(&mut batch, &dense, area).is_err(), "it has nothing across");
        let over_area = WindowRecord {
            displacement_across_m: vec![1.0; 3],
            velocity_across_m_per_s: vec![2.0; 3],
            tangential_force_across_n: vec![3.0; 3],
            ..dense
        };
        window(&mut batch, &over_area, area).unwrap();
        let last = [8, 9, 10].map(|n| batch.columns()[n].cell(2));
        assert_eq!(last, [1.0, 2.0, 3.0].map(Cell::Number));
        assert!(window(&mut batch, &over_area, parts).is_err());
    }
}
