//! A run log in memory, as far as tables and figures need it.

use std::path::Path;

use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_record::{
    Event, EventPayload, FieldRecord, Record, RunHeader, Rupture, SlipEvent, StepRecord, WindowRecord,
};
use asperity_runlog::{LogItem, RunReader, Topics};

use crate::error::AnalysisError;

/// Everything in a run log.
#[derive(Debug)]
pub struct RunData {
    /// The run's name in its pipeline.
    pub name: String,
    /// What the run is.
    pub header: RunHeader,
    /// Its scenario.
    pub scenario: Scenario,
    /// The numbers derived from it.
    pub plan: Plan,
    /// Step records, in order.
    pub steps: Vec<StepRecord>,
    /// States of all blocks, in order.
    pub fields: Vec<FieldRecord>,
    /// Dense windows, in order.
    pub windows: Vec<WindowRecord>,
    /// Slip events, in order.
    pub slips: Vec<SlipEvent>,
    /// Ruptures, in the order in which they became certain, as in the log; none where the log is
    /// from before there were any.
    pub ruptures: Option<Vec<Rupture>>,
    /// What of the run is missing, where the log does not hold all of it.
    pub lacks: Option<String>,
}

impl RunData {
    /// Reads a run log.
    ///
    /// # Errors
    /// If the log is damaged, incomplete, or holds what cannot be understood.
    pub fn read(name: &str, path: &Path) -> Result<RunData, AnalysisError> {
        let data = RunData::read_part(name, path)?;
        match data.lacks {
            None => Ok(data),
            Some(problem) => Err(AnalysisError::Run { run: path.display().to_string(), problem }),
        }
    }

    /// Reads what there is in a run log that ends too early or was salvaged, see
    /// [`RunData::lacks`].
    ///
    /// # Errors
    /// If the log is damaged, or holds what cannot be understood.
    pub fn read_part(name: &str, path: &Path) -> Result<RunData, AnalysisError> {
        let understood = |problem: String| AnalysisError::Run { run: path.display().to_string(), problem };
        let mut reader = RunReader::open(path, Topics::ALL)?;
        // Of a log that breaks off so early, or was salvaged without it, no scenario says what it is of.
        if reader.scenario_toml().is_empty() {
            return Err(understood("it has no attachment `scenario.toml`".to_owned()));
        }
        let source =
            ScenarioSource::logged(format!("{}: scenario.toml", path.display()), reader.scenario_toml());
        let scenario = Scenario::resolve(&source).map_err(|errors| understood(errors.to_string()))?;
        // What is read by block and step from here on is that of the header.
        if scenario.hash() != reader.header().scenario_hash {
            return Err(understood(format!(
                "scenario.toml has the hash {}, metadata `run` says {}",
                scenario.hash(),
                reader.header().scenario_hash
            )));
        }
        let mut data = RunData {
            name: name.to_owned(),
            header: reader.header().clone(),
            plan: Plan::new(&scenario),
            scenario,
            steps: Vec::new(),
            fields: Vec::new(),
            windows: Vec::new(),
            slips: Vec::new(),
            ruptures: None,
            lacks: None,
        };
        let mut ruptures = Vec::new();
        loop {
            let item = match reader.next_item() {
                Ok(Some(item)) => item,
                Ok(None) => break,
                Err(error) if error.problem.is_early_end() => {
                    data.lacks = Some(error.problem.to_string());
                    break;
                }
                Err(error) => return Err(error.into()),
            };
            match item {
                LogItem::Record(Record::Step(record)) => data.steps.push(record),
                LogItem::Record(Record::Fields(record)) => data.fields.push(record),
                LogItem::Record(Record::Window(record)) => data.windows.push(record),
                LogItem::Event(event) => {
                    data.slips.extend(decoded(&event).map_err(understood)?);
                    ruptures.extend(decoded(&event).map_err(understood)?);
                }
            }
        }
        if reader.event_topics().any(|topic| topic == Rupture::TOPIC) {
            data.ruptures = Some(ruptures);
        }
        Ok(data)
    }

    /// The ruptures in the order of their onsets; none where the log has none.
    pub fn ruptures_by_onset(&self) -> Vec<&Rupture> {
        let mut ruptures: Vec<&Rupture> = self.ruptures.iter().flatten().collect();
        ruptures.sort_by_key(|rupture| (rupture.onset_step, rupture.rupture));
        ruptures
    }

    /// The slip event in which a rupture began.
    pub fn event_of(&self, rupture: &Rupture) -> Option<&SlipEvent> {
        let after = self.slips.partition_point(|slip| slip.onset_step <= rupture.onset_step);
        let slip = self.slips.get(after.checked_sub(1)?)?;
        slip.end_step.is_none_or(|end| rupture.onset_step < end).then_some(slip)
    }

    /// The state of all blocks after a step, if it was recorded.
    pub fn fields_at(&self, step: u64) -> Option<&FieldRecord> {
        let index = self.fields.binary_search_by_key(&step, |record| record.step).ok()?;
        Some(&self.fields[index])
    }

    /// The last step record up to a step, or the first one where the step is before it.
    pub fn record_at(&self, step: u64) -> Option<&StepRecord> {
        let after = self.steps.partition_point(|record| record.step <= step);
        self.steps.get(after.saturating_sub(1))
    }

    /// The first slip event in which every block slid.
    pub fn first_global_slip(&self) -> Option<&SlipEvent> {
        self.slips.iter().find(|slip| slip.is_global(self.header.blocks))
    }
}

fn decoded<P: EventPayload>(event: &Event) -> Result<Option<P>, String> {
    event.decode().transpose().map_err(|error| format!("an event of {} cannot be read: {error}", event.topic))
}
