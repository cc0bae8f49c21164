//! The columns of each topic's table.
//!
//! Every table is long: one row per step record, per switch, per event, and for states of the chain one row
//! per block. So a message of N blocks gives N rows that repeat `step` and `time_s`. Data frames and SQL
//! filter, group and join this shape without array functions (`where block = 1`, `group by step`); it does
//! not depend on the number of blocks, and CSV can represent it. Repeated values cost next to nothing in
//! Parquet.

use asperity_record::{
    Cell, Column, ColumnKind, Energy, EventKind, FieldRecord, Parts, ROWS, SignalRecord, StepRecord,
    WindowRecord,
};

use crate::table::Table;

pub(crate) const STEP: &str = "/step";
pub(crate) const SWITCH: &str = "/switch";
pub(crate) const FIELDS: &str = "/fields";
pub(crate) const WINDOW: &str = "/window";
pub(crate) const SIGNAL: &str = "/signal";
pub(crate) const TRACES: &str = "/traces";
pub(crate) const NODES: &str = "/nodes";
pub(crate) const EVENTS: &str = "/events/";

/// The tables of a log's records, still empty, in the order in which they are written.
///
/// `parts` selects the optional columns.
pub fn record_tables(parts: StepParts) -> Vec<Table> {
    let mut tables = vec![
        Table::new(STEP, step_columns(parts)),
        Table::new(SWITCH, switch_columns(parts)),
        Table::new(FIELDS, fields_columns(parts)),
        Table::new(WINDOW, window_columns(parts)),
    ];
    if parts.run.recording {
        tables.push(Table::new(SIGNAL, columns_of(&OF_SIGNAL, signal_arrays(&SignalRecord::default()))));
        tables.push(Table::new(TRACES, OF_TRACES.to_vec()));
    }
    tables
}

/// The table of the nodes of a slab, a sheet or a body at chosen times, given the axes along which they move. It
/// has no topic in a log: it is computed from a log by repeating steps.
pub fn nodes_table(axes: &[usize]) -> Table {
    let mut columns =
        vec![STEP_COLUMN, TIME, count("row", "Row of the node upwards, counted from 1 at the bottom.")];
    if axes.contains(&1) {
        columns.push(count("across", "Row of the node across the sliding direction, counted from 1."));
    }
    columns.push(count("column", "Column of the node, counted from 1."));
    let displacements = [
        number("displacement_x_m", "Displacement from the grid along the sliding direction."),
        number("displacement_y_m", "Displacement from the grid across the sliding direction."),
        number("displacement_z_m", "Displacement from the grid upwards."),
    ];
    let velocities = [
        number("velocity_x_m_per_s", "Velocity along the sliding direction."),
        number("velocity_y_m_per_s", "Velocity across the sliding direction."),
        number("velocity_z_m_per_s", "Velocity upwards."),
    ];
    for of_axes in [displacements, velocities] {
        let there = of_axes.into_iter().enumerate().filter(|(axis, _)| axes.contains(axis));
        columns.extend(there.map(|(_, column)| column));
    }
    Table::new(NODES, columns)
}

/// All tables of logs, without rows, with the columns that any run may have.
pub fn all(events: &[EventKind]) -> Vec<Table> {
    let parts =
        StepParts { end_forces: true, energies: [true; Energy::COUNT], contact_loads: true, run: Parts::ALL };
    let rows = ROWS.iter().map(|row| (row.kind)().with(Parts::ALL));
    let kinds = rows.chain(events.iter().cloned()).map(|kind| Table::new(kind.topic, kind.columns()));
    record_tables(parts).into_iter().chain([nodes_table(&[0, 1, 2])]).chain(kinds).collect()
}

/// Optional parts of records, which only some runs have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StepParts {
    /// Forces on both ends, if the drive pulls there.
    pub end_forces: bool,
    /// Which energies, in the order of [`Energy::COLUMNS`]; the load tables that runs are reduced to leave them out.
    pub energies: [bool; Energy::COUNT],
    /// In states of all blocks, the normal load of each: of slabs and bodies.
    pub contact_loads: bool,
    /// Of these, those that the records of the run have.
    pub run: Parts,
}

impl StepParts {
    /// Of that record. Whether switches have components across the sliding direction follows from the run, as
    /// a step may have none.
    pub fn of(record: &StepRecord, run: Parts) -> StepParts {
        StepParts {
            end_forces: record.end_forces_n.is_some(),
            energies: record.energy.values().map(|energy_j| energy_j.is_some()),
            contact_loads: false,
            run: Parts {
                junctions: record.junctions.is_some(),
                state: record.peak_velocity_m_per_s.is_some(),
                ..run
            },
        }
    }

    /// Of that state of all blocks.
    pub fn of_state(record: &FieldRecord) -> StepParts {
        let run = Parts {
            junctions: !record.junctions_slipping.is_empty(),
            state: !record.state.is_empty(),
            area: !record.displacement_across_m.is_empty(),
            ..Parts::default()
        };
        StepParts { contact_loads: !record.normal_load_n.is_empty(), run, ..StepParts::default() }
    }
}

/// The columns of the table of switches.
pub(crate) fn switch_columns(parts: StepParts) -> Vec<Column> {
    let mut columns = vec![
        STEP_COLUMN,
        TIME,
        BLOCK,
        word("direction", "`detach`: from stick to slip; `attach`: from slip to stick."),
        DISPLACEMENT,
        VELOCITY,
        TANGENTIAL_FORCE,
        number("stick_position_m", "Anchor of the friction spring: left behind or newly taken."),
        number("threshold_n", "Static friction threshold of this step."),
    ];
    columns.extend(parts.run.junctions.then_some(JUNCTIONS_SLIPPING));
    if parts.run.area {
        columns.extend(ACROSS);
        columns.push(number("stick_position_across_m", "Anchor of the friction spring across it."));
    }
    if parts.run.recording {
        columns.extend([
            number("error_s", "Standard error of the time."),
            of_sensor("step_size", "Size of the step that the sensor saw."),
            of_sensor("step_size_error", "Standard error of that size."),
        ]);
    }
    columns
}

/// A column of states of blocks, the cells of a state in it, and whether the table has it.
pub(crate) type ArrayColumn<'a> = (Column, Cells<'a>, bool);

/// The cells of several rows in a column.
pub(crate) type Cells<'a> = Box<dyn ExactSizeIterator<Item = Cell> + 'a>;

fn array(column: Column, values: &[f64], is_there: bool) -> ArrayColumn<'_> {
    (column, Box::new(values.iter().copied().map(Cell::Number)), is_there)
}

fn columns_of<'a>(same: &[Column], arrays: impl IntoIterator<Item = ArrayColumn<'a>>) -> Vec<Column> {
    let arrays = arrays.into_iter().filter(|(.., is_there)| *is_there).map(|(column, ..)| column);
    same.iter().cloned().chain(arrays).collect()
}

/// The columns of the table of states of all blocks.
pub(crate) fn fields_columns(parts: StepParts) -> Vec<Column> {
    columns_of(&[STEP_COLUMN, TIME, BLOCK], fields_arrays(&FieldRecord::default(), parts))
}

/// Those of its columns that arrays of a state fill.
pub(crate) fn fields_arrays(of: &FieldRecord, parts: StepParts) -> Vec<ArrayColumn<'_>> {
    let StepParts { contact_loads, run: Parts { junctions, state, area, .. }, .. } = parts;
    let detached = of.detached.iter().map(|flag| Cell::Flag(*flag != 0));
    let slipping = of.junctions_slipping.iter().copied().map(Cell::Count);
    let [displacement_across, velocity_across, force_across] = ACROSS;
    vec![
        array(DISPLACEMENT, &of.displacement_m, true),
        array(VELOCITY, &of.velocity_m_per_s, true),
        array(TANGENTIAL_FORCE, &of.tangential_force_n, true),
        array(STICK_POSITION, &of.stick_position_m, true),
        (DETACHED, Box::new(detached), true),
        array(CONTACT_LOAD, &of.normal_load_n, contact_loads),
        (JUNCTIONS_SLIPPING, Box::new(slipping), junctions),
        array(PINNED_MEAN, &of.pinned_mean_ratio, junctions),
        array(PINNED_WIDTH, &of.pinned_width_ratio, junctions),
        array(STATE, &of.state, state),
        array(displacement_across, &of.displacement_across_m, area),
        array(velocity_across, &of.velocity_across_m_per_s, area),
        array(force_across, &of.tangential_force_across_n, area),
        array(STICK_POSITION_ACROSS, &of.stick_position_across_m, area),
    ]
}

/// The columns of the table of dense windows.
fn window_columns(parts: StepParts) -> Vec<Column> {
    let window = count("window", "Which dense window of the scenario this belongs to, counted from 0.");
    let sliding = count("sliding", "How many blocks of the whole chain slid in this step.");
    let same = [window, STEP_COLUMN, TIME, sliding, BLOCK];
    columns_of(&same, window_arrays(&WindowRecord::default(), parts))
}

/// Those of its columns that arrays of a record fill.
pub(crate) fn window_arrays(of: &WindowRecord, parts: StepParts) -> Vec<ArrayColumn<'_>> {
    let [displacement_across, velocity_across, force_across] = ACROSS;
    vec![
        array(DISPLACEMENT, &of.displacement_m, true),
        array(VELOCITY, &of.velocity_m_per_s, true),
        array(TANGENTIAL_FORCE, &of.tangential_force_n, true),
        array(displacement_across, &of.displacement_across_m, parts.run.area),
        array(velocity_across, &of.velocity_across_m_per_s, parts.run.area),
        array(force_across, &of.tangential_force_across_n, parts.run.area),
    ]
}

/// The columns of what the channels of a recording read, those that arrays of a record fill.
pub(crate) fn signal_arrays(of: &SignalRecord) -> [ArrayColumn<'_>; 3] {
    let column = |name, about| Column::with_unit(name, ColumnKind::Number, "of the channel", about);
    [
        array(column("least", "The least of them."), &of.least, true),
        array(column("mean", "Their mean."), &of.mean, true),
        array(column("largest", "The largest of them."), &of.largest, true),
    ]
}

/// Those of its columns that are the same for all of its channels, but for the last.
const OF_SIGNAL: [Column; 6] = [
    STEP_COLUMN,
    TIME,
    count("stream", "The stream, counted from 1."),
    step("part", "The part of the stream, counted from 1."),
    count("samples", "How many samples the numbers are of, from this time on."),
    count("channel", "The channel, counted from 1, sensors first."),
];

/// The columns of samples about ruptures.
const OF_TRACES: [Column; 5] = [
    step("rupture", "Number of the rupture."),
    step("part", "The part of the stream, counted from 1."),
    number("time_s", "Time of the sample."),
    count("sensor", "The sensor, counted from 1."),
    of_sensor("value", "The sample."),
];

/// The columns of the table of step records.
pub fn step_columns(parts: StepParts) -> Vec<Column> {
    let mut columns = vec![
        STEP_COLUMN,
        TIME,
        number("driving_force_n", "Sum of the driving forces `F_T` that this step's update used."),
        number("normal_load_n", "Total normal load `F_N` that this step's update used."),
        number("ft_fn", "The driving force over the normal load, `F_T / F_N`."),
        count("sliding", "How many blocks slid in this step."),
        count("switches", "How many blocks detached or re-attached at its end."),
    ];
    if parts.end_forces {
        columns.push(number("first_end_force_n", "Driving force on the first block."));
        columns.push(number("last_end_force_n", "Driving force on the last block."));
    }
    let energies = Energy::COLUMNS.iter().zip(parts.energies).filter(|(_, has)| *has);
    columns.extend(energies.map(|(column, _)| column.clone()));
    if parts.run.state {
        columns.push(number("peak_velocity_m_per_s", "Largest speed of any block since the record before."));
    }
    if parts.run.junctions {
        columns.push(step("breaks", "How many junctions broke in all steps before this one."));
        columns.push(step("repins", "How many junctions were pinned again in all steps before this one."));
    }
    columns.extend(parts.run.recording.then(|| number("ft_fn_error", "Standard error of `F_T / F_N`.")));
    columns
}

const STEP_COLUMN: Column =
    Column::new("step", ColumnKind::Step, "The step, counted from 1; 0 is the initial state.");
const TIME: Column = number("time_s", "Simulated time at the end of the step.");
const BLOCK: Column = count("block", "The block, counted from 1 at the driven end.")
    .over_area("The contact, counted from 1 row by row, along each row from the driven end.");
const DISPLACEMENT: Column = number("displacement_m", "Displacement from the initial grid after the step.");
const VELOCITY: Column = number("velocity_m_per_s", "Velocity after the step.");
const TANGENTIAL_FORCE: Column =
    number("tangential_force_n", "Tangential force without friction that this step's update used.");

const STICK_POSITION: Column =
    number("stick_position_m", "Anchor of the friction spring; without meaning while the block slides.");
const DETACHED: Column = flag("detached", "Whether the block enters the next step detached.");
const CONTACT_LOAD: Column =
    number("normal_load_n", "Normal load on the contact that this step's update used.");
const PINNED_MEAN: Column = number(
    "pinned_mean_ratio",
    "Mean force of the contact's pinned junctions over the load that each bears, `p_n / N_s`; 0 if none is pinned, or the contact bears nothing.",
);
const PINNED_WIDTH: Column = number(
    "pinned_width_ratio",
    "Width of the uniform distribution with the standard deviation of these forces, over the same load; 0 likewise.",
);
const STICK_POSITION_ACROSS: Column = number(
    "stick_position_across_m",
    "Anchor of the friction spring across it; without meaning while the contact slides.",
);

/// Components across the sliding direction.
const ACROSS: [Column; 3] = [
    number(
        "displacement_across_m",
        "Displacement across the sliding direction, from the initial grid, after the step.",
    ),
    number("velocity_across_m_per_s", "Velocity across the sliding direction after the step."),
    number(
        "tangential_force_across_n",
        "Tangential force across the sliding direction, without friction, that this step's update used.",
    ),
];

const STATE: Column = Column::with_unit(
    "state",
    ColumnKind::Number,
    "1",
    "State of rate-and-state friction, `f_0 + b_n ln(V_0 theta_n / D_c)`.",
);
const JUNCTIONS_SLIPPING: Column =
    count("junctions_slipping", "How many junctions of the contact slip at the end of the step.");

pub(crate) const fn step(name: &'static str, about: &'static str) -> Column {
    Column::new(name, ColumnKind::Step, about)
}

pub(crate) const fn count(name: &'static str, about: &'static str) -> Column {
    Column::new(name, ColumnKind::Count, about)
}

pub(crate) const fn number(name: &'static str, about: &'static str) -> Column {
    Column::new(name, ColumnKind::Number, about)
}

const fn of_sensor(name: &'static str, about: &'static str) -> Column {
    Column::with_unit(name, ColumnKind::Number, "of the sensor", about)
}

/// A ratio whose name does not say so.
pub(crate) const fn ratio(name: &'static str, about: &'static str) -> Column {
    Column::with_unit(name, ColumnKind::Number, "1", about)
}

pub(crate) const fn flag(name: &'static str, about: &'static str) -> Column {
    Column::new(name, ColumnKind::Flag, about)
}

pub(crate) const fn word(name: &'static str, about: &'static str) -> Column {
    Column::new(name, ColumnKind::Word, about)
}

#[cfg(test)]
mod tests {

    use super::{StepParts, step_columns};

    #[test]
    fn forces_on_the_ends_stand_behind_the_other_columns() {
        let of = |end_forces| step_columns(StepParts { end_forces, ..StepParts::default() });
        let [short, long] = [false, true].map(of);
        assert_eq!(short[..], long[..short.len()]);
        assert_eq!(&*long[short.len()].name, "first_end_force_n");
    }
}
