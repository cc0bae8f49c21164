//! Single numbers of several runs against a parameter that they differ in.

use polars::prelude::{Column, DataFrame, NamedFrom, Series};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::AnalysisError;
use crate::measure::Measure;
use crate::run_data::RunData;
use crate::wants::Wants;

/// A table with one row per run, as the pipeline has it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Its name, for the file.
    pub name: String,
    /// The scenario key that the runs differ in.
    pub parameter: String,
    /// The runs, in the order of the rows.
    pub runs: Vec<String>,
    /// What to measure.
    pub measures: Vec<Measure>,
}

/// What a study has of a run: a row of its table.
#[derive(Debug, Clone)]
pub struct StudyRow {
    run: String,
    parameter_set: String,
    time_step_s: f64,
    parameter: f64,
    measured: Vec<Option<f64>>,
}

impl Study {
    /// What it reads of each of its runs.
    pub fn wants(&self) -> Wants {
        self.measures.iter().fold(Wants::NOTHING, |wants, measure| wants | measure.wants())
    }

    /// The row of a run.
    ///
    /// # Errors
    /// If the run has no such parameter.
    pub fn row(&self, run: &RunData) -> Result<StudyRow, AnalysisError> {
        let parameter = parameter(run, &self.parameter).map_err(|problem| AnalysisError::Run {
            run: run.name.clone(),
            problem: format!("study {}: {problem}", self.name),
        })?;
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
    pub fn table(&self, rows: &[&StudyRow]) -> Result<DataFrame, AnalysisError> {
        let texts = |name: &str, value: &dyn Fn(&StudyRow) -> String| -> Column {
            Series::new(name.into(), rows.iter().map(|row| value(row)).collect::<Vec<String>>()).into()
        };
        let numbers = |name: &str, value: &dyn Fn(&StudyRow) -> f64| -> Column {
            Series::new(name.into(), rows.iter().map(|row| value(row)).collect::<Vec<f64>>()).into()
        };
        let mut columns = vec![
            texts("run", &|row| row.run.clone()),
            texts("parameter_set", &|row| row.parameter_set.clone()),
            numbers("time_step_s", &|row| row.time_step_s),
            numbers(&self.parameter, &|row| row.parameter),
        ];
        for (index, measure) in self.measures.iter().enumerate() {
            let measured: Vec<Option<f64>> = rows.iter().map(|row| row.measured[index]).collect();
            columns.push(Series::new(measure.name().replace(' ', "_").into(), measured).into());
        }
        Ok(DataFrame::new_infer_height(columns)?)
    }
}

/// The value of a numerical scenario key of a run; in words, if it has none.
pub fn parameter(run: &RunData, key: &str) -> Result<f64, String> {
    let text = run.scenario.to_commented_toml();
    let scenario: toml::Table = toml::from_str(&text).map_err(|error| error.to_string())?;
    let mut value = Some(&toml::Value::Table(scenario)).cloned();
    for part in key.split('.') {
        value = value.and_then(|value| value.get(part).cloned());
    }
    let number =
        value.and_then(|value| value.as_float().or_else(|| value.as_integer().map(|count| count as f64)));
    number.ok_or_else(|| {
        format!("parameter {key:?} is not accepted (accepted: a scenario key that holds a number)")
    })
}

#[cfg(test)]
mod tests {
    use super::{Study, parameter};
    use crate::made_up;
    use crate::made_up::EVENTS;

    #[test]
    fn a_study_has_a_row_per_run_and_a_column_per_measure() {
        let study: Study = toml::from_str(
            "name = \"s\"\nparameter = \"slider.blocks\"\nruns = [\"b\", \"a\"]\n\
             measures = [\"precursor-count\", \"residual-rms-5.57\"]",
        )
        .unwrap();
        let rows = [made_up::run("", &[]), made_up::run("", &EVENTS)].map(|run| study.row(&run).unwrap());
        let table = study.table(&rows.each_ref()).unwrap();
        let names: Vec<&str> = table.get_column_names().into_iter().map(|name| name.as_str()).collect();
        assert_eq!(
            names,
            ["run", "parameter_set", "time_step_s", "slider.blocks", "precursor_count", "residual_linear"]
        );
        let counts = table.column("precursor_count").unwrap().f64().unwrap().to_vec();
        assert_eq!(counts, [Some(0.0), Some(3.0)]);
    }

    #[test]
    fn a_parameter_is_read_from_the_scenario_or_refused_by_name() {
        let run = made_up::run("", &EVENTS);
        assert_eq!(parameter(&run, "slider.blocks"), Ok(3.0));
        assert_eq!(parameter(&run, "drive.decay_length_m"), Ok(0.0));
        assert_eq!(
            parameter(&run, "drive.kind").unwrap_err(),
            "parameter \"drive.kind\" is not accepted (accepted: a scenario key that holds a number)"
        );
    }
}
