//! The numbers of a run, and claims about them: when it slipped, how far its precursors reached, the speed
//! of its fronts, its energy balance.
//!
//! A [`Summarizer`] receives a run live or from a log, and returns a [`Summary`]. [`Summary::KEYS`]
//! defines the meaning and unit of every number; the page that explains them, the tables and
//! [`Summary::schema`] are generated from it. [`text`] formats summaries for a terminal.
//!
//! ```
//! use asperity_record::RunHeader;
//! use asperity_numbers::{Summarizer, Summary};
//! use asperity_testkit::{quiet_step, run_header};
//!
//! let header = RunHeader { blocks: 10, time_step_s: 1e-7, steps: 20_000_000, ..run_header() };
//! let mut summarizer = Summarizer::new("mine", &header, None);
//! summarizer.step(&quiet_step(20_000_000, 2.0, 0.25));
//! let summary = summarizer.finish(true, None);
//! assert_eq!((summary.precursor_count, summary.largest_ft_fn), (Some(0), Some(0.25)));
//! assert_eq!(summary.first_slip_s, None);
//! assert_eq!(Summary::KEYS.len(), summary.row().len());
//! ```
//!
//! A [`run_data::Collector`] keeps the requested data of a run ([`required_data`]), including the summary;
//! each [`Number`] is computed from these by its name, curves by [`curves`], fronts by [`fronts`],
//! distributions and their fits by [`distributions`] and [`goodness`], and [`claims`] compares numbers with
//! the statements of a text.
//!
//! ```
//! use asperity_model::{Scenario, ScenarioSource};
//! use asperity_numbers::{Number, precursors};
//! use asperity_numbers::required_data::RequiredData;
//! use asperity_numbers::run_data::Collector;
//! use asperity_record::Observer;
//! use asperity_runlog::{LogItem, RunReader, Topics};
//!
//! # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/logs/complete.mcap");
//! let mut log = RunReader::open(path.as_ref(), Topics::ALL)?;
//! let scenario = Scenario::resolve(&ScenarioSource::logged("scenario.toml", log.scenario_toml()))?;
//! let mut collector = Collector::of_log("complete", log.header(), &scenario, RequiredData::all())?;
//! while let Some(item) = log.next_item()? {
//!     match item {
//!         LogItem::Record(record) => collector.record(&record),
//!         LogItem::Event(event) => collector.event(&event),
//!     }
//! }
//! let run = collector.finish(true, log.end());
//! for precursor in precursors::one_by_one(&run) {
//!     let (length, load) = (precursor.length_ratio(run.columns()), precursor.start.ft_fn_onset);
//!     println!("L_p/L = {length:.2} at F_T/F_N = {load:.3}");
//! }
//! assert_eq!(Number::find("coefficient_ratio")?.of(&run, None), Some(0.7 / 0.45));
//! assert!(Number::find("precursor_event_count")?.of(&run, None) > Some(0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#[cfg(test)]
extern crate self as asperity_numbers;

mod arrest;
mod at_rest;
pub mod catalogue;
pub mod claim;
pub mod claims;
pub mod convergence;
mod creep;
pub mod curve;
pub mod curve_list;
pub mod curves;
pub mod distributions;
pub mod estimate;
mod fault_line;
pub mod fronts;
pub mod goodness;
mod growth;
pub mod gutenberg_richter;
mod hold_phase;
mod junctions;
mod key;
mod list;
#[cfg(test)]
#[path = "../../testkit/src/made_up.rs"]
pub mod made_up;
mod magnitudes;
mod moments;
mod number;
mod of;
pub mod omori;
mod partial_ruptures;
pub mod plane_waves;
pub mod precursors;
mod rate_and_state;
pub mod refined;
pub mod required_data;
pub mod run_data;
mod run_result;
mod rupture_numbers;
pub mod rupture_selector;
mod series;
mod slip_events;
pub mod slip_steps;
pub mod slow_slip;
pub mod states;
mod statistics;
mod summarizer;
mod summary;
pub mod text;
mod theory_residuals;
mod unloaded;

pub use convergence::Convergence;
pub use growth::{EventGrowth, RuptureGrowth};
pub use key::Key;
pub use number::Number;
pub use run_result::{RunOutcome, RunResult};
pub use rupture_numbers::{
    WIDE_BLOCKS, front_speed_m_per_s, front_speeds_m_per_s, radiated_energy_j, radiation_efficiency,
};
pub use statistics::{median, quantile};
pub use summarizer::Summarizer;
pub use summary::{OfRecording, Summary};
pub use theory_residuals::AFFECTED_THRESHOLD;
