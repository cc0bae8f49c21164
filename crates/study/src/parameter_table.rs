//! Single numbers of several runs against a parameter that they differ in.

use asperity_model::scenario::keys;
use asperity_numbers::Number;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Cell, CellValue, Column, ColumnKind, unit_of};
use asperity_tables::{Table, tables};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::StudyError;
use crate::pipeline::study_table;

/// A table with one row per run.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Its name, for the file.
    pub name: String,
    /// The scenario key that the runs differ in.
    pub parameter: String,
    /// The runs, in the order of the rows.
    pub runs: Vec<String>,
    /// The numbers to measure.
    pub measures: Vec<Number>,
}

impl Study {
    /// Data that it reads from each of its runs.
    pub fn required_data(&self) -> RequiredData {
        self.measures
            .iter()
            .fold(RequiredData::NOTHING, |required, measure| required | measure.required_data())
    }

    /// The row of a run.
    ///
    /// # Errors
    /// If the run has no such parameter.
    pub fn row(&self, run: &RunData) -> Result<Vec<Cell>, StudyError> {
        let parameter = run
            .parameter(&self.parameter)
            .map_err(|problem| StudyError::Failed(format!("{}: study {}: {problem}", run.name, self.name)))?;
        let mut row = vec![Cell::word(&run.name), Cell::word(&run.header.parameter_set)];
        row.extend([run.header.time_step_s, parameter].map(Cell::Number));
        row.extend(self.measures.iter().map(|measure| measure.of(run, None).cell()));
        Ok(row)
    }

    /// The table, still empty: run, parameter set, time step, parameter, measures.
    pub fn table(&self) -> Table {
        let time_step = Column::new("time_step_s", ColumnKind::Number, "The time step.");
        let mut columns = vec![tables::RUN, tables::PARAMETER_SET, time_step.clone()];
        columns.push(Column {
            name: self.parameter.clone().into(),
            unit: unit_of(&self.parameter),
            about: keys::named(&self.parameter).map_or("", |key| key.doc).into(),
            ..time_step
        });
        let number = |column: &Column| Column { kind: ColumnKind::Number, ..column.clone() };
        columns.extend(self.measures.iter().map(|measure| number(&measure.key.column)));
        Table::new(study_table(self), columns)
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Study};
    use asperity_testkit::made_up;
    use asperity_testkit::made_up::EVENTS;

    #[test]
    fn a_study_has_a_row_per_run_and_a_column_per_measure() {
        let study: Study = toml::from_str(
            "name = \"s\"\nparameter = \"slider.blocks\"\nruns = [\"b\", \"a\"]\n\
             measures = [\"precursor_event_count\", \"event_residual_linear_ratio\", \"event_count\"]",
        )
        .unwrap();
        let mut table = study.table();
        for run in [made_up::run("", &[]), made_up::run("", &EVENTS)] {
            table.push(study.row(&run).unwrap());
        }
        let names: Vec<&str> = table.columns.iter().map(|column| &*column.name).collect();
        assert_eq!(
            names,
            [
                "run",
                "parameter_set",
                "time_step_s",
                "slider.blocks",
                "precursor_event_count",
                "event_residual_linear_ratio",
                "event_count"
            ]
        );
        let counts = table.column("precursor_event_count").unwrap();
        assert_eq!([0, 1].map(|row| counts.cell(row)), [0.0, 3.0].map(Cell::Number));
        assert_eq!(table.columns[5].unit, Some("1"));
    }

    #[test]
    fn a_parameter_is_read_from_the_scenario_or_refused_by_name() {
        let run = made_up::run("", &EVENTS);
        assert_eq!(run.parameter("slider.blocks"), Ok(3.0));
        assert_eq!(run.parameter("drive.decay_length_m"), Ok(0.0));
        assert_eq!(
            run.parameter("drive.kind").unwrap_err(),
            "parameter \"drive.kind\" is not accepted (accepted: a scenario key that holds a number)"
        );
    }
}
