//! The parts of a page.

use std::collections::BTreeMap;

use asperity_model::Scenario;
use asperity_numbers::Summary;
use asperity_numbers::claim::Claim;
use asperity_record::{Noise, RunHeader};

use crate::figures::Figure;
use crate::page_collector::Collected;

/// One or more runs, with their figures and claims.
#[derive(Debug, Clone)]
pub struct Study {
    /// Its subject.
    pub title: String,
    /// Its runs, in order.
    pub runs: Vec<Run>,
    /// Its claims, in order.
    pub claims: Vec<Claim>,
    /// Its figures, in order.
    pub figures: Vec<Figure>,
    /// Tables of several runs.
    pub links: Vec<Link>,
    /// Whether the page names the code version of its runs.
    pub provenance: bool,
}

/// A run.
#[derive(Debug, Clone)]
pub struct Run {
    /// Its name.
    pub name: String,
    /// Its header.
    pub header: RunHeader,
    /// Its scenario; of a recording [`Scenario::of_recording`].
    pub scenario: Scenario,
    /// Its numbers.
    pub summary: Summary,
    /// The data collected from it.
    pub collected: Collected,
    /// Of a recording, the noise of its sensors.
    pub noise: Vec<Noise>,
    /// The missing part, if its log is incomplete.
    pub lacks: Option<String>,
    /// What users noted in its log, by key.
    pub note: BTreeMap<String, String>,
    /// Its log and its tables.
    pub links: Vec<Link>,
}

/// A file beside the page.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Link {
    /// Its path from the folder of the page.
    pub path: String,
    /// Its name.
    pub words: String,
}
