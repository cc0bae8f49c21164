//! Records as rows, with the doubles of the log as they are. Events define their own rows.

use std::iter::repeat_n;

use asperity_model::NodeState;
use asperity_record::{
    Cell, CellValue, FieldRecord, JunctionTotals, Measured, SignalRecord, StepRecord, Switch, SwitchAcross,
    TraceRecord, WindowRecord,
};

use crate::layout::{
    ArrayColumn, Cells, FIELDS, SIGNAL, StepParts, WINDOW, fields_arrays, signal_arrays, window_arrays,
};
use crate::table::Table;

/// Adds the rows of a state, one per block, which begin with the same cells and the block.
fn blocks(
    table: &mut Table,
    topic: &'static str,
    step: u64,
    same: &[Cell],
    first_block: u32,
    arrays: Vec<ArrayColumn<'_>>,
) -> Result<(), String> {
    // Values without a column are an error, as too few values are.
    let needed = arrays.iter().filter(|(_, values, is_there)| *is_there || values.len() > 0);
    let lengths: Vec<usize> =
        needed.map(|(_, values, is_there)| if *is_there { values.len() } else { 0 }).collect();
    if lengths.iter().any(|length| *length != lengths[0]) {
        return Err(format!(
            "step {step}: a record of {topic} has arrays of {lengths:?} values (accepted: one length for all)"
        ));
    }
    let rows = lengths[0];
    let same = same.iter().map(|cell| Box::new(repeat_n(cell.clone(), rows)) as Cells<'_>);
    let counted = (0..rows).map(|n| Cell::Count(first_block.saturating_add(n as u32)));
    let arrays = arrays.into_iter().filter(|(.., is_there)| *is_there).map(|(_, values, _)| values);
    table.push_columns(rows, same.chain([Box::new(counted) as _]).chain(arrays));
    Ok(())
}

/// A step record as a row of the table of [`step_columns`](crate::layout::step_columns).
pub(crate) fn step(record: &StepRecord, parts: StepParts) -> Vec<Cell> {
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
    let energies = record.energy.values().into_iter().zip(parts.energies).filter(|(_, has)| *has);
    row.extend(energies.map(|(energy_j, _)| energy_j.cell()));
    row.extend(parts.run.state.then(|| record.peak_velocity_m_per_s.cell()));
    if parts.run.junctions {
        let JunctionTotals { breaks, repins } = record.junctions.unwrap_or_default();
        row.extend([breaks, repins].map(Cell::Step));
    }
    row.extend(parts.run.recording.then(|| record.ft_fn_error.cell()));
    row
}

pub(crate) fn switch(table: &mut Table, record: &StepRecord, switch: &Switch, parts: StepParts) {
    let mut row = vec![
        Cell::Step(record.step),
        Cell::Number(record.time_s),
        Cell::Count(switch.block),
        switch.direction.cell(),
        Cell::Number(switch.displacement_m),
        Cell::Number(switch.velocity_m_per_s),
        Cell::Number(switch.tangential_force_n),
        Cell::Number(switch.stick_position_m),
        Cell::Number(switch.threshold_n),
    ];
    row.extend(parts.run.junctions.then(|| switch.junctions_slipping.cell()));
    if parts.run.area {
        let across = |component: fn(SwitchAcross) -> f64| switch.across.map(component).cell();
        row.extend([
            across(|across| across.displacement_m),
            across(|across| across.velocity_m_per_s),
            across(|across| across.tangential_force_n),
            across(|across| across.stick_position_m),
        ]);
    }
    if parts.run.recording {
        let of = |number: fn(Measured) -> f64| switch.measured.map(number).cell();
        row.extend([of(|of| of.error_s), of(|of| of.step), of(|of| of.step_error)]);
    }
    table.push(row);
}

pub(crate) fn fields(table: &mut Table, record: &FieldRecord, parts: StepParts) -> Result<(), String> {
    let same = [Cell::Step(record.step), Cell::Number(record.time_s)];
    blocks(table, FIELDS, record.step, &same, 1, fields_arrays(record, parts))
}

pub(crate) fn window(table: &mut Table, record: &WindowRecord, parts: StepParts) -> Result<(), String> {
    let same = [
        Cell::Count(record.window),
        Cell::Step(record.step),
        Cell::Number(record.time_s),
        Cell::Count(record.sliding),
    ];
    blocks(table, WINDOW, record.step, &same, record.first_block, window_arrays(record, parts))
}

pub(crate) fn signal(table: &mut Table, record: &SignalRecord) -> Result<(), String> {
    let SignalRecord { step, time_s, stream, part, samples, .. } = *record;
    let same =
        [Cell::Step(step), Cell::Number(time_s), Cell::Count(stream), Cell::Step(part), Cell::Count(samples)];
    blocks(table, SIGNAL, step, &same, 1, signal_arrays(record).into())
}

pub(crate) fn traces(table: &mut Table, record: &TraceRecord) {
    let samples = record.samples.max(1) as usize;
    for (n, value) in record.values.iter().enumerate() {
        table.push(vec![
            Cell::Step(record.rupture),
            Cell::Step(record.part),
            Cell::Number(record.time_s + (n % samples) as f64 * record.interval_s),
            Cell::Count((n / samples) as u32 + 1),
            Cell::Number(*value),
        ]);
    }
}

/// The nodes of a slab, a sheet or a body after a step.
pub(crate) fn nodes(table: &mut Table, of: &NodeState) {
    let (columns, across, nodes) = (of.lattice.columns, of.lattice.lanes, of.lattice.nodes());
    let axes = of.lattice.table.axes;
    let counted = |index: usize| Cell::Count(u32::try_from(index + 1).expect("there are fewer nodes"));
    for node in 0..nodes {
        let mut row = vec![Cell::Step(of.step), Cell::Number(of.time_s), counted(node / columns / across)];
        row.extend(axes.contains(&1).then(|| counted(node / columns % across)));
        row.push(counted(node % columns));
        for values in [&of.displacement_m, &of.velocity_m_per_s] {
            row.extend((0..axes.len()).map(|axis| Cell::Number(values[axis * nodes + node])));
        }
        table.push(row);
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{Cell, Direction, FieldRecord, Parts, Switch, SwitchAcross, WindowRecord};

    use super::{fields, switch, window};
    use crate::layout::{StepParts, record_tables};

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
        let mut table = record_tables(StepParts::default()).remove(2);
        fields(&mut table, &state, StepParts::default()).unwrap();
        let column = |n: usize| (0..2).map(|row| table.values()[n].cell(row)).collect::<Vec<_>>();
        assert_eq!(column(0), [Cell::Step(8), Cell::Step(8)]);
        assert_eq!(column(2), [Cell::Count(1), Cell::Count(2)]);
        assert_eq!(column(4), [Cell::Number(5e-324), Cell::Number(-0.0)]);
        assert_eq!(column(7), [Cell::Flag(false), Cell::Flag(true)]);

        let short = FieldRecord { stick_position_m: vec![3.0], ..state };
        let error = fields(&mut table, &short, StepParts::default()).unwrap_err().to_string();
        assert!(error.contains("step 8") && error.contains("/fields") && error.contains("[2, 2, 2, 1, 2]"));
        assert_eq!(table.rows(), 2, "nothing of it is taken");

        let parts = StepParts { contact_loads: true, ..StepParts::default() };
        let mut table = record_tables(parts).remove(2);
        let slab = FieldRecord { normal_load_n: vec![5.0, 6.0], stick_position_m: vec![3.0, 4.0], ..short };
        fields(&mut table, &slab, parts).unwrap();
        assert_eq!(table.values()[8].cell(1), Cell::Number(6.0));
        assert!(fields(&mut table, &slab, StepParts::default()).is_err(), "a log is of a chain or of a slab");

        let parts = StepParts { run: Parts { junctions: true, ..Parts::default() }, ..parts };
        let mut table = record_tables(parts).remove(2);
        assert!(fields(&mut table, &slab, parts).is_err(), "it has no junctions");
        let torn = FieldRecord {
            junctions_slipping: vec![0, 7],
            pinned_mean_ratio: vec![0.1, 0.2],
            pinned_width_ratio: vec![0.3, 0.4],
            ..slab
        };
        fields(&mut table, &torn, parts).unwrap();
        let last = [9, 10, 11].map(|n| table.values()[n].cell(1));
        assert_eq!(last, [Cell::Count(7), Cell::Number(0.2), Cell::Number(0.4)]);

        let parts = StepParts { run: Parts { area: true, ..parts.run }, ..parts };
        let mut table = record_tables(parts).remove(2);
        assert!(fields(&mut table, &torn, parts).is_err(), "it has nothing across");
        let over_area = FieldRecord {
            state: Vec::new(),
            displacement_across_m: vec![1.0, 2.0],
            velocity_across_m_per_s: vec![3.0, 4.0],
            tangential_force_across_n: vec![5.0, 6.0],
            stick_position_across_m: vec![7.0, 8.0],
            ..torn
        };
        fields(&mut table, &over_area, parts).unwrap();
        let last = [12, 13, 14, 15].map(|n| table.values()[n].cell(1));
        assert_eq!(last, [2.0, 4.0, 6.0, 8.0].map(Cell::Number));
        let without = StepParts { run: Parts { area: false, ..parts.run }, ..parts };
        assert!(fields(&mut table, &over_area, without).is_err());
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
            let parts =
                StepParts { run: Parts { junctions, area, ..Parts::default() }, ..StepParts::default() };
            let mut table = record_tables(parts).remove(1);
            switch(&mut table, &record, &one, parts);
            let cells: Vec<Cell> = table.values().iter().skip(8).map(|column| column.cell(0)).collect();
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
        let mut table = record_tables(parts).remove(3);
        window(&mut table, &dense, parts).unwrap();
        let blocks: Vec<Cell> = (0..3).map(|row| table.values()[4].cell(row)).collect();
        assert_eq!(blocks, [Cell::Count(41), Cell::Count(42), Cell::Count(43)]);

        let area = StepParts { run: Parts { area: true, ..Parts::default() }, ..parts };
        let mut table = record_tables(area).remove(3);
        assert!(window(&mut table, &dense, area).is_err(), "it has nothing across");
        let over_area = WindowRecord {
            displacement_across_m: vec![1.0; 3],
            velocity_across_m_per_s: vec![2.0; 3],
            tangential_force_across_n: vec![3.0; 3],
            ..dense
        };
        window(&mut table, &over_area, area).unwrap();
        let last = [8, 9, 10].map(|n| table.values()[n].cell(2));
        assert_eq!(last, [1.0, 2.0, 3.0].map(Cell::Number));
        assert!(window(&mut table, &over_area, parts).is_err());
    }
}
