//! Single numbers of several runs against a parameter that they differ in.

use asperity_numbers::Number;
use asperity_numbers::claim::Cells;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_tables::{Frame, tables};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::StudyError;

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

/// A row of a study's table: the data of one run.
#[derive(Debug, Clone)]
pub struct StudyRow {
    run: String,
    parameter_set: String,
    time_step_s: f64,
    parameter: f64,
    measured: Vec<Option<f64>>,
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
    pub fn row(&self, run: &RunData) -> Result<StudyRow, StudyError> {
        let parameter = run
            .parameter(&self.parameter)
            .map_err(|problem| StudyError::Failed(format!("{}: study {}: {problem}", run.name, self.name)))?;
        Ok(StudyRow {
            run: run.name.clone(),
            parameter_set: run.header.parameter_set.clone(),
            time_step_s: run.header.time_step_s,
            parameter,
            measured: self.measures.iter().map(|measure| measure.of(run, None)).collect(),
        })
    }

    /// The table: run, parameter set, time step, parameter, measures.
    ///
    /// # Errors
    /// If polars refuses.
    pub fn table(&self, rows: &[&StudyRow]) -> Result<Frame, StudyError> {
        let texts = |value: fn(&StudyRow) -> &str| {
            Cells::Texts(rows.iter().map(|row| value(row).to_owned()).collect())
        };
        let numbers = |value: &dyn Fn(&StudyRow) -> Option<f64>| {
            Cells::Numbers(rows.iter().map(|row| value(row)).collect())
        };
        let mut columns = vec![
            ("run".to_owned(), texts(|row| &row.run)),
            ("parameter_set".to_owned(), texts(|row| &row.parameter_set)),
            ("time_step_s".to_owned(), numbers(&|row| Some(row.time_step_s))),
            (self.parameter.clone(), numbers(&|row| Some(row.parameter))),
        ];
        let measures = self.measures.iter().enumerate();
        columns.extend(
            measures.map(|(index, measure)| (measure.name().to_owned(), numbers(&|row| row.measured[index]))),
        );
        Ok(tables::of_columns(columns)?)
    }
}

#[cfg(test)]
mod tests {
    use super::Study;
    use asperity_testkit::made_up;
    use asperity_testkit::made_up::EVENTS;

    #[test]
    fn a_study_has_a_row_per_run_and_a_column_per_measure() {
        let study: Study = toml::from_str(
            "name = \"s\"\nparameter = \"slider.blocks\"\nruns = [\"b\", \"a\"]\n\
             measures = [\"precursor_event_count\", \"event_residual_linear_ratio\", \"event_count\"]",
        )
        .unwrap();
        let rows = [made_up::run("", &[]), made_up::run("", &EVENTS)].map(|run| study.row(&run).unwrap());
        let table = study.table(&rows.each_ref()).unwrap();
        let names: Vec<&str> = table.get_column_names().into_iter().map(|name| name.as_str()).collect();
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
        let counts = table.column("precursor_event_count").unwrap().f64().unwrap().to_vec();
        assert_eq!(counts, [Some(0.0), Some(3.0)]);
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
