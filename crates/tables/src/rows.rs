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
        let energies = record.energy.unwrap_or_default().parts();
        row.extend(energies.map(|(_, energy)| Cell::Number(energy)));
    }
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
    batch.push(&cells[..if parts.junctions { 10 } else { 9 }]);
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
    } = record;
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
        batch.push(&row);
    }
    Ok(())
}

/// The nodes of a slab after a step.
#[derive(Debug, Clone, Copy)]
pub struct NodeRows<'a> {
    /// The step.
    pub step: u64,
    /// Its time, s.
    pub time_s: f64,
    /// Nodes in a row.
    pub columns: usize,
    /// Displacements of all nodes along the sliding direction, row by row, then upwards, m.
    pub displacement_m: &'a [f64],
    /// Velocities in the same order, m/s.
    pub velocity_m_per_s: &'a [f64],
}

pub(crate) fn nodes(batch: &mut Batch, of: &NodeRows<'_>) {
    let (u, v) = (of.displacement_m, of.velocity_m_per_s);
    let nodes = u.len() / 2;
    let counted = |index: usize| u32::try_from(index + 1).expect("slabs have no more nodes than that");
    for node in 0..nodes {
        batch.push(&[
            Cell::Step(of.step),
            Cell::Number(of.time_s),
            Cell::Count(counted(node / of.columns)),
            Cell::Count(counted(node % of.columns)),
            Cell::Number(u[node]),
            Cell::Number(u[nodes + node]),
            Cell::Number(v[node]),
            Cell::Number(v[nodes + node]),
        ]);
    }
}

pub(crate) fn window(batch: &mut Batch, record: &WindowRecord) -> Result<(), Ragged> {
    let WindowRecord {
        window,
        step,
        time_s,
        sliding,
        first_block,
        displacement_m,
        velocity_m_per_s,
        tangential_force_n,
    } = record;
    let lengths = [displacement_m.len(), velocity_m_per_s.len(), tangential_force_n.len()];
    Ragged::check(crate::layout::WINDOW, *step, &lengths)?;
    for (index, block) in (0..displacement_m.len()).zip(*first_block..) {
        batch.push(&[
            Cell::Count(*window),
            Cell::Step(*step),
            Cell::Number(*time_s),
            Cell::Count(*sliding),
            Cell::Count(block),
            Cell::Number(displacement_m[index]),
            Cell::Number(velocity_m_per_s[index]),
            Cell::Number(tangential_force_n[index]),
        ]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use asperity_record::{Cell, FieldRecord, WindowRecord};

    use super::{fields, window};
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
            junctions_slipping: Vec::new(),
            pinned_mean_ratio: Vec::new(),
            pinned_width_ratio: Vec::new(),
        };
        let mut batch = Batch::new(&record_layouts(StepParts::default())[2].columns);
        fields(&mut batch, &state, StepParts::default()).unwrap();
        let column = |n: usize| (0..2).map(|row| batch.columns()[n].cell(row)).collect::<Vec<_>>();
        assert_eq!(column(0), [Cell::Step(8); 2]);
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
        };
        let mut batch = Batch::new(&record_layouts(StepParts::default())[3].columns);
        window(&mut batch, &dense).unwrap();
        let blocks: Vec<Cell> = (0..3).map(|row| batch.columns()[4].cell(row)).collect();
        assert_eq!(blocks, [Cell::Count(41), Cell::Count(42), Cell::Count(43)]);
    }
}
