//! Data that a diff takes from a run log: header and scenario, slip events, ruptures, and the numbers of
//! its summary, all collected in one pass over the file.

use std::path::Path;

use asperity_model::Scenario;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Collector, RunData};
use asperity_numbers::{Summarizer, Summary, front_speeds_m_per_s};
use asperity_record::{Event, LoadDrop, Observer, Record, RunEnd, RunHeader, Rupture, SlipEvent};

use crate::column::Column;
use crate::provenance::Provenance;
use crate::table::{Collected, Table};

/// The contents of a run log that are compared.
#[derive(Debug, Clone)]
pub struct RunLog {
    /// Header and scenario.
    pub provenance: Provenance,
    /// Its summary, or why it could not be determined.
    pub summary: Result<Summary, String>,
    /// Its slip events.
    pub events: Table,
    /// Its ruptures, in the order of their onsets; a log has them in the order in which they became certain.
    /// None if it has no topic for them.
    pub ruptures: Option<Table>,
    /// Onsets of the ruptures of the whole slider, s, in order.
    pub global_s: Vec<f64>,
    /// Speeds of fronts, m/s, towards either end.
    pub fronts_m_per_s: Vec<f64>,
    /// By how much `F_T / F_N` fell, in ruptures; in the load drops of a recording.
    pub drops_ft_fn: Vec<f64>,
    /// The data of figures, if they are drawn.
    pub drawn: Option<RunData>,
}

/// Collects a log that is being read.
pub struct Summarized {
    provenance: Provenance,
    events: Collected<SlipEvent>,
    ruptures: Collected<Rupture>,
    global_s: Vec<f64>,
    fronts_m_per_s: Vec<f64>,
    drops_ft_fn: Vec<f64>,
    /// Or why there is none: the comparison reports it.
    summarizer: Result<Summarizer, String>,
    drawn: Option<Collector>,
}

impl Summarized {
    /// Begins after header and scenario have been read. `summarizer` may be the reason why there is none; `drawn` is
    /// the scenario, if figures are drawn.
    pub fn begin(
        header: &RunHeader,
        scenario_toml: &str,
        summarizer: Result<Summarizer, String>,
        drawn: Option<&Scenario>,
    ) -> Summarized {
        let parts = header.parts();
        let collector = |of: &Scenario| Collector::of_log(&header.scenario, header, of, RequiredData::LOADS);
        Summarized {
            provenance: Provenance { header: header.clone(), scenario_toml: scenario_toml.to_owned() },
            events: Collected::new(parts),
            ruptures: Collected::new(parts),
            global_s: Vec::new(),
            fronts_m_per_s: Vec::new(),
            drops_ft_fn: Vec::new(),
            summarizer,
            drawn: drawn.and_then(|scenario| collector(scenario).ok()),
        }
    }

    /// The log at this path, after its last event.
    pub fn finish(mut self, path: &Path, has_ruptures: bool, end: Option<&RunEnd>) -> RunLog {
        self.global_s.sort_by(f64::total_cmp);
        self.ruptures.table.sort_by(&[Column::ONSET_STEP, Column::FIRST_BLOCK, Column::NUCLEATION_BLOCK]);
        let summary = self.summarizer.map(|summarizer| summarizer.finish(has_ruptures, end));
        RunLog {
            provenance: self.provenance,
            summary: summary.map_err(|problem| format!("{}: {problem}", path.display())),
            events: self.events.table,
            ruptures: has_ruptures.then_some(self.ruptures.table),
            global_s: self.global_s,
            fronts_m_per_s: self.fronts_m_per_s,
            drops_ft_fn: self.drops_ft_fn,
            drawn: self.drawn.map(|collector| collector.finish(has_ruptures, end)),
        }
    }
}

impl Observer for Summarized {
    fn record(&mut self, record: &Record) {
        if let Ok(summarizer) = &mut self.summarizer {
            summarizer.record(record);
        }
        if let Some(collector) = &mut self.drawn {
            collector.record(record);
        }
    }

    fn event(&mut self, event: &Event) {
        if let Some(slip) = event.get() {
            self.events.push(slip);
        } else if let Some(rupture) = event.get::<Rupture>() {
            self.ruptures.push(rupture);
            self.global_s.extend(rupture.reached_every_block.then_some(rupture.onset_s));
            let header = &self.provenance.header;
            let is_run = header.sensors.is_none();
            // A front that outruns the grid is none; sensors have errors instead.
            let wave_m_per_s = is_run.then(|| header.scales.wave_speed_m_per_s());
            let fronts = front_speeds_m_per_s(rupture, header.contacts(), wave_m_per_s);
            self.fronts_m_per_s.extend(fronts.into_iter().flatten());
            self.drops_ft_fn
                .extend(rupture.ft_fn_end.map(|end| rupture.ft_fn_onset - end).filter(|_| is_run));
        } else if let Some(drop) = event.get::<LoadDrop>() {
            self.drops_ft_fn
                .extend(drop.ft_fn_before.zip(drop.ft_fn_after).map(|(before, after)| before - after));
        }
        if let Ok(summarizer) = &mut self.summarizer {
            summarizer.event(event);
        }
        if let Some(collector) = &mut self.drawn {
            collector.event(event);
        }
    }
}
