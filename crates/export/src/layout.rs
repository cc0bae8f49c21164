//! The columns of each topic's table.
//!
//! Every table is long: one row per step record, per switch, per event, and for
//! states of the chain one row per block. So a message of N blocks gives N rows
//! that repeat `step` and `time_s`. That is the shape that data frames and SQL
//! filter, group and join without a word about arrays (`where block = 1`, `group
//! by step`), it is the same for a chain of ten blocks and of ten thousand, and
//! CSV can hold it. What repeats costs next to nothing in Parquet.

use asperity_record::{EventPayload, GlobalSlip, Onset, SlipEvent};

/// What the cells of a column hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A small whole number: blocks and how many of them; 32 bits, unsigned.
    Count,
    /// A whole number that grows with the run: steps and events; 64 bits, unsigned.
    Step,
    /// A double.
    Number,
    /// Yes or no.
    Flag,
    /// One of a few words.
    Word,
}

/// A column of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Column {
    /// Its name, with the unit last; that of the field in the log.
    pub name: &'static str,
    /// What its cells hold.
    pub kind: Kind,
    /// The unit, SI; `1` for ratios, none for what is counted or named.
    pub unit: Option<&'static str>,
}

/// The table of a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// The topic in the log.
    pub topic: &'static str,
    /// Its columns, in order.
    pub columns: Vec<Column>,
}

impl Layout {
    /// The topic as part of a file name: `step`, `events.slip`.
    pub fn file_part(&self) -> String {
        self.topic.trim_start_matches('/').replace('/', ".")
    }
}

pub(crate) const STEP: &str = "/step";
pub(crate) const SWITCH: &str = "/switch";
pub(crate) const FIELDS: &str = "/fields";
pub(crate) const WINDOW: &str = "/window";

/// The tables of a log, in the order in which they are written.
///
/// `end_forces` says whether the drive pulls on both ends, and step records
/// say so separately.
pub fn layouts(end_forces: bool) -> Vec<Layout> {
    let layout = |topic, columns: &[Column]| Layout { topic, columns: columns.to_vec() };
    // As in the load table that runs are reduced to.
    let mut step = vec![
        STEP_COLUMN,
        TIME,
        number("driving_force_n", "N"),
        number("normal_load_n", "N"),
        number("ft_fn", "1"),
        count("sliding"),
        count("switches"),
    ];
    if end_forces {
        step.extend([number("first_end_force_n", "N"), number("last_end_force_n", "N")]);
    }
    vec![
        layout(STEP, &step),
        layout(
            SWITCH,
            &[
                STEP_COLUMN,
                TIME,
                count("block"),
                word("direction"),
                number("displacement_m", "m"),
                number("velocity_m_per_s", "m/s"),
                number("tangential_force_n", "N"),
                number("stick_position_m", "m"),
                number("threshold_n", "N"),
            ],
        ),
        layout(
            FIELDS,
            &[
                STEP_COLUMN,
                TIME,
                count("block"),
                number("displacement_m", "m"),
                number("velocity_m_per_s", "m/s"),
                number("tangential_force_n", "N"),
                number("stick_position_m", "m"),
                flag("detached"),
            ],
        ),
        layout(
            WINDOW,
            &[
                count("window"),
                STEP_COLUMN,
                TIME,
                count("sliding"),
                count("block"),
                number("displacement_m", "m"),
                number("velocity_m_per_s", "m/s"),
                number("tangential_force_n", "N"),
            ],
        ),
        layout(
            Onset::TOPIC,
            &[
                index("event"),
                index("onset_step"),
                number("onset_s", "s"),
                count("nucleation_block"),
                count("nucleation_blocks"),
                number("tangential_force_n", "N"),
                number("threshold_n", "N"),
                number("ft_fn_onset", "1"),
            ],
        ),
        // In the order of the raw event table, `SlipEvent::COLUMNS`.
        layout(
            SlipEvent::TOPIC,
            &[
                number("onset_s", "s"),
                number("end_s", "s"),
                count("first_block"),
                count("last_block"),
                count("max_sliding"),
                number("ft_fn_onset", "1"),
                number("ft_fn_end", "1"),
                index("event"),
                index("onset_step"),
                index("end_step"),
                count("blocks_slipped"),
                count("nucleation_block"),
                number("ft_fn_min", "1"),
                number("ft_fn_max", "1"),
                flag("open"),
            ],
        ),
        layout(
            GlobalSlip::TOPIC,
            &[
                index("global"),
                index("event"),
                number("onset_s", "s"),
                number("end_s", "s"),
                number("recurrence_s", "s"),
                number("load_drop_n", "N"),
                number("ft_fn_drop", "1"),
            ],
        ),
    ]
}

const STEP_COLUMN: Column = index("step");
const TIME: Column = number("time_s", "s");

const fn count(name: &'static str) -> Column {
    Column { name, kind: Kind::Count, unit: None }
}

const fn index(name: &'static str) -> Column {
    Column { name, kind: Kind::Step, unit: None }
}

const fn number(name: &'static str, unit: &'static str) -> Column {
    Column { name, kind: Kind::Number, unit: Some(unit) }
}

const fn flag(name: &'static str) -> Column {
    Column { name, kind: Kind::Flag, unit: None }
}

const fn word(name: &'static str) -> Column {
    Column { name, kind: Kind::Word, unit: None }
}

#[cfg(test)]
mod tests {
    use asperity_record::{EventPayload, GlobalSlip, Onset, SlipEvent};

    use super::{Kind, layouts};

    #[test]
    fn units_stand_last_in_names() {
        let columns = layouts(true).into_iter().flat_map(|layout| layout.columns);
        for column in columns {
            let by_name = match column.name {
                name if name.starts_with("ft_fn") => Some("1"),
                name if name.ends_with("_m_per_s") => Some("m/s"),
                name if name.ends_with("_m") => Some("m"),
                name if name.ends_with("_s") => Some("s"),
                name if name.ends_with("_n") => Some("N"),
                _ => None,
            };
            assert_eq!(column.unit, by_name, "{}", column.name);
            assert_eq!(column.kind == Kind::Number, column.unit.is_some(), "{}", column.name);
        }
    }

    #[test]
    fn events_have_the_columns_of_their_tables() {
        let layouts = layouts(false);
        let names = |topic: &str| {
            let layout = layouts.iter().find(|layout| layout.topic == topic).unwrap();
            layout.columns.iter().map(|column| column.name).collect::<Vec<_>>()
        };
        assert_eq!(names(Onset::TOPIC), Onset::COLUMNS);
        assert_eq!(names(SlipEvent::TOPIC), SlipEvent::COLUMNS);
        assert_eq!(names(GlobalSlip::TOPIC), GlobalSlip::COLUMNS);
        assert_eq!(layouts[5].file_part(), "events.slip");
    }
}
