//! A report in words and tables, most important parts first: what was set differently, the numbers of the runs,
//! their ruptures, and then the fate of the slip events. Of two parameter sets figures and distributions of both come
//! before all single events. A terminal shows the first rows of each table, so that all fits on a screen; a page has
//! the rest.

pub(crate) mod events;
mod runs;

use asperity_report::Figure;

use crate::finding::told;
use crate::report::{Class, Counts, Extent, Finding, PairedBy, Report, RunDiff, Verdict};
use crate::side_by_side::SideBySide;

pub use events::KEPT_OF_A_CLASS;
pub(crate) use events::listed;

/// Findings listed below numbers and ruptures.
const FINDINGS_BELOW_PHYSICS: usize = 2;
const OTHERS: usize = 2;
/// Most rows of other tables on a page.
const ROWS_MOST: usize = 200;

/// A part of a report, below a heading on the page.
pub(crate) struct Part {
    pub(crate) title: &'static str,
    pub(crate) blocks: Vec<Block>,
}

/// A sentence, a table, or what only a page has.
pub(crate) enum Block {
    Words(String),
    /// On a terminal only: the page says it elsewhere.
    OnScreen(String),
    /// On a page only.
    OnPage(String),
    Table(Table),
    /// On a page only, side by side where there is room.
    Figures(Vec<Figure>),
    /// Parts that are folded below these words, the only ones on a terminal, unless they are open.
    Fold {
        words: String,
        is_open: bool,
        parts: Vec<Part>,
    },
}

/// A table.
#[derive(Default)]
pub(crate) struct Table {
    /// Its caption on the page, where it is folded if it has one.
    pub(crate) caption: String,
    /// Headings; those of numbers begin with `#`.
    pub(crate) headings: Vec<String>,
    pub(crate) rows: Vec<Row>,
    /// Whether a page can sort it; that of the runs.
    pub(crate) is_of_runs: bool,
    /// How many rows a terminal shows.
    pub(crate) on_screen: usize,
    /// How many more there are, beyond its rows.
    pub(crate) left_out: u64,
    /// What they are, if a terminal says how many it leaves out.
    pub(crate) more: Option<&'static str>,
}

/// A row of a table.
pub(crate) struct Row {
    pub(crate) cells: Vec<Cell>,
    /// On a terminal it is this line, with its indent, if not its cells.
    pub(crate) line: Option<String>,
    /// The place of the finding among those listed, for the timeline.
    pub(crate) finding: Option<usize>,
}

/// A cell of a table.
#[derive(Clone)]
pub(crate) enum Cell {
    Text(String),
    Number(String),
    /// A key, which may break after its points and underscores on a narrow page.
    Key(String),
    Class(Class),
    /// A pair of runs, by its place, which the timeline then shows.
    Run(usize, String),
    /// Events of one side.
    Events(Vec<Extent>),
    /// One below the other.
    Lines(Vec<String>),
}

impl Row {
    fn of<const N: usize>(cells: [Cell; N]) -> Row {
        Row { cells: cells.into(), line: None, finding: None }
    }
}

fn text(value: impl ToString) -> Cell {
    Cell::Text(value.to_string())
}

fn num(value: impl ToString) -> Cell {
    Cell::Number(value.to_string())
}

fn optional(value: Option<impl ToString>) -> Cell {
    Cell::Number(value.map_or_else(String::new, |value| value.to_string()))
}

fn headings(names: &[&str]) -> Vec<String> {
    names.iter().map(|&name| name.to_owned()).collect()
}

/// The name of a class in sentences on a page.
pub(crate) fn title(class: Class) -> String {
    match class {
        Class::Open => "open at the edge".to_owned(),
        other => other.name().replace('-', " "),
    }
}

/// Number of matches in each class.
pub(crate) fn by_class(counts: &Counts, none: &str) -> String {
    let words: Vec<String> =
        counts.there().map(|(class, count)| format!("{count} {}", class.name())).collect();
    if words.is_empty() { none.to_owned() } else { words.join(", ") }
}

/// Events of both sides in all runs, by class.
pub(crate) fn events(report: &Report) -> String {
    let sum = |side: fn(&RunDiff) -> u64| report.runs.iter().map(side).sum::<u64>();
    format!(
        "{} {}, {} old and {} new events{}: {}",
        report.runs.len(),
        if report.runs.len() == 1 { "run" } else { "pairs of runs" },
        sum(|run| run.old.events),
        sum(|run| run.new.events),
        match report.runs.iter().filter(|run| run.events.paired_by == PairedBy::Cycles).count() {
            0 => String::new(),
            _ if report.runs.len() == 1 => ", paired as the ruptures are".to_owned(),
            pairs => format!(", in {pairs} of the pairs paired by cycles"),
        },
        by_class(&report.counts, "no events")
    )
}

/// The outcome, in words.
pub(crate) fn verdict(report: &Report) -> String {
    let exceeded: Vec<String> = report
        .exceeded
        .iter()
        .map(|over| format!("{} {} where the policy allows {}", over.found, over.class.name(), over.allowed))
        .collect();
    let same = report.counts.differing() == 0;
    let ruptures = report.runs.iter().filter_map(|run| run.ruptures.as_ref());
    let ruptures_differ = ruptures.into_iter().any(|ruptures| ruptures.table.counts.differing() > 0);
    let allowed = report.runs.iter().any(RunDiff::ruptures_alone_differ);
    match report.verdict {
        Verdict::WithinPolicy if same && !ruptures_differ => "nothing differs".to_owned(),
        // Within the tolerances of slip events only, or found in step records.
        Verdict::WithinPolicy if same && !allowed => "no slip event differs, but ruptures do".to_owned(),
        Verdict::WithinPolicy => "differs, as the policy allows".to_owned(),
        Verdict::Differs if !exceeded.is_empty() => format!("differs: {}", exceeded.join(", ")),
        // No slip event, but something: ruptures, or a run that one side lacks.
        Verdict::Differs if same && report.unpaired.is_empty() => {
            "differs: the ruptures do, and no slip event".to_owned()
        }
        Verdict::Differs => "differs".to_owned(),
    }
}

/// A report as parts. `listed` are the findings that a page lists, each with the place of its run.
pub(crate) fn parts(report: &Report, listed: &[(usize, &Finding)]) -> Vec<Part> {
    let part = |title, blocks| Part { title, blocks };
    let settings = part("Set differently", runs::settings(report));
    let numbers = part("The runs in numbers", runs::numbers(report));
    let single = [
        part("Ruptures", runs::ruptures(report)),
        part("Runs", events::runs(report)),
        part("Findings", events::findings(report, listed)),
        part("Columns", events::columns(report)),
        part("Where runs part", events::beyond(report)),
        part("What follows for the results", events::downstream(report)),
    ];
    let others = part("What else differs", events::others(report));
    let classes = part("Classes", events::classes(report));
    let Some(of) = side_by_side(report) else {
        return [settings, numbers].into_iter().chain(single).chain([others, classes]).collect();
    };
    let matched = Block::Fold {
        words: runs::fates(report).unwrap_or_default(),
        is_open: !of.is_chaotic,
        parts: single.into_iter().chain([classes]).collect(),
    };
    vec![
        settings,
        part("Load and lengths of ruptures", vec![Block::Figures(of.courses.clone())]),
        numbers,
        part("Distributions", events::distributions(of)),
        part("Matched events", vec![matched]),
        others,
    ]
}

/// What is compared of two parameter sets before single events, unless runs of whole pipelines are compared.
pub(crate) fn side_by_side(report: &Report) -> Option<&SideBySide> {
    let is_alone = is_one(report) && report.claims.is_empty();
    report.runs.first().filter(|_| is_alone)?.side_by_side.as_ref()
}

/// The same for several pairs of runs is one row, with their number.
fn merged<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<(T, usize)> {
    let mut seen: Vec<(T, usize)> = Vec::new();
    for one in all {
        match seen.iter_mut().find(|(known, _)| *known == one) {
            Some((_, count)) => *count += 1,
            None => seen.push((one, 1)),
        }
    }
    seen
}

fn is_one(report: &Report) -> bool {
    report.runs.len() == 1
}

/// A table, if it has rows.
fn table(table: Table) -> Vec<Block> {
    if table.rows.is_empty() { Vec::new() } else { vec![Block::Table(table)] }
}

/// The name of one of several pairs of runs, before what is said of it.
fn of_run(report: &Report, run: &RunDiff) -> String {
    if is_one(report) { String::new() } else { format!("{} ", run.name()) }
}

fn line_of(report: &Report, place: usize, finding: &Finding) -> String {
    format!("{}{}", of_run(report, &report.runs[place]), told(finding))
}
