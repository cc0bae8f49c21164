//! What a page is made of.

use asperity_model::Scenario;
use asperity_numbers::Summary;
use asperity_numbers::claim::Claim;
use asperity_record::RunHeader;

use crate::figures::Figure;
use crate::page_collector::Collected;

/// A run or several, with the figures and claims that are made of them.
#[derive(Debug, Clone)]
pub struct Study {
    /// What it is about.
    pub title: String,
    /// Its runs, in order.
    pub runs: Vec<Run>,
    /// Its claims, in order.
    pub claims: Vec<Claim>,
    /// Its figures, in order.
    pub figures: Vec<Figure>,
    /// Tables of several runs.
    pub links: Vec<Link>,
    /// Whether the page says by which code its runs were made.
    pub provenance: bool,
}

/// A run.
#[derive(Debug, Clone)]
pub struct Run {
    /// Its name.
    pub name: String,
    /// What it is.
    pub header: RunHeader,
    /// Its scenario.
    pub scenario: Scenario,
    /// Its numbers.
    pub summary: Summary,
    /// What went by.
    pub collected: Collected,
    /// What is missing of it, if its log does not hold all of it.
    pub lacks: Option<String>,
    /// Its log and its tables.
    pub links: Vec<Link>,
}

/// A file beside the page.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Link {
    /// Its path from the folder of the page.
    pub path: String,
    /// What it is called.
    pub words: String,
}
