//! `asperity diff`: what became of the events between two runs, or between all
//! runs of two folders. Exit 0 where the policy is kept, 1 where not, 2 where
//! there is nothing to compare or it cannot be read.

#[cfg(feature = "analysis")]
mod downstream;
mod sides;
mod summary;
mod table;

use std::io::{self, Write};
use std::path::Path;

use asperity_diff::column::{Column, Columns};
use asperity_diff::matching::{self, MatchError};
use asperity_diff::policy::{Allowed, Policy};
use asperity_diff::provenance;
use asperity_diff::report::{
    ClaimChange, Class, Counts, Exceeded, FORMAT, Report, RunDiff, VERSION, Verdict,
};
use asperity_diff::tally::{self, Comparison, Draft, Matched};
use asperity_export::whole::WholeFile;
use asperity_model::text;
use asperity_record::SlipEvent;

use crate::args::{DiffArguments, DiffFormat};
use crate::exit::{Code, Failure};
use sides::{Given, Run};
use table::{Events, TableError};

pub(crate) fn command(arguments: &DiffArguments) -> Result<(), Failure> {
    let policy = read_policy(arguments)?;
    if let Some(path) = arguments.draft_policy.as_ref().filter(|path| path.exists()) {
        return Err(Failure::BadInput(format!(
            "--draft-policy {} exists already (accepted: a new file)",
            path.display()
        )));
    }
    let (old, new) = (Given::find(&arguments.old)?, Given::find(&arguments.new)?);
    let sides::Paired { pairs, unpaired } = sides::pair(&old, &new, arguments.pair);
    let mut draft = Draft::default();
    let mut matches = matches_file(arguments)?;
    let mut runs = Vec::new();
    for (old, new) in &pairs {
        runs.push(compare(old, new, &policy, arguments, &mut draft, &mut matches)?);
    }
    matches.finish()?;
    let mut counts = Counts::default();
    let mut not_allowed = 0;
    for run in &runs {
        counts.add(&run.counts);
        not_allowed += run.not_allowed.total();
    }
    let exceeded: Vec<Exceeded> = Class::ALL
        .into_iter()
        .filter_map(|class| match policy.allowed(class) {
            // Where none is allowed each is a finding that is not.
            Allowed::UpTo(allowed) if allowed > 0 && counts.of(class) > allowed => {
                Some(Exceeded { class, allowed, found: counts.of(class) })
            }
            _ => None,
        })
        .collect();
    let keeps = not_allowed == 0 && exceeded.is_empty() && unpaired.is_empty();
    let report = Report {
        format: FORMAT,
        version: VERSION,
        old: arguments.old.display().to_string(),
        new: arguments.new.display().to_string(),
        policy: arguments.policy.as_ref().map(|path| path.display().to_string()),
        verdict: if keeps { Verdict::WithinPolicy } else { Verdict::Differs },
        counts,
        runs,
        unpaired,
        exceeded,
        claims: claims(&old, &new)?,
    };
    if let Some(path) = &arguments.draft_policy {
        let text = format!(
            "# The tightest policy under which {} passes against {}.\n{}",
            report.new,
            report.old,
            draft.policy(policy.window_s).to_toml()
        );
        write(path, &text)?;
    }
    if let Some(path) = &arguments.page {
        write(path, &asperity_diff::page::page(&report))?;
    }
    print(&report, arguments.format)?;
    if keeps { Ok(()) } else { Err(Failure::Said(Code::Failed)) }
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    WholeFile::write(path, text)
        .map_err(|error| Failure::Failed(format!("failed to write {}: {error}", path.display())))
}

fn read_policy(arguments: &DiffArguments) -> Result<Policy, Failure> {
    let Some(path) = &arguments.policy else { return Ok(Policy::default()) };
    let text = text::read(path).map_err(|error| {
        Failure::BadInput(format!("policy {}: {error} (accepted: a TOML file)", path.display()))
    })?;
    Policy::parse(&path.display().to_string(), &text).map_err(Failure::bad_input)
}

/// What a page has room for, of each class and of matches in a run.
const FINDINGS_OF_A_PAGE: usize = 1000;
const MATCHES_OF_A_PAGE: usize = 200_000;

/// How many findings of each class and how many matches the report of a pair of runs has to hold.
fn room(arguments: &DiffArguments) -> (usize, usize) {
    match arguments.format {
        DiffFormat::Json => (usize::MAX, usize::MAX),
        DiffFormat::Text if arguments.page.is_some() => (FINDINGS_OF_A_PAGE, MATCHES_OF_A_PAGE),
        DiffFormat::Text => (summary::KEPT_OF_A_CLASS, 0),
    }
}

fn compare(
    old: &Run,
    new: &Run,
    policy: &Policy,
    arguments: &DiffArguments,
    draft: &mut Draft,
    matches: &mut Matches,
) -> Result<RunDiff, Failure> {
    let (old_table, new_table) = (
        table::open(&old.path).map_err(Failure::bad_input)?,
        table::open(&new.path).map_err(Failure::bad_input)?,
    );
    let (old_events, old_step_s) = step_s(old, old_table.columns, old_table.events);
    let (new_events, new_step_s) = step_s(new, new_table.columns, new_table.events);
    // Where a table does not tell its step, its steps are taken for the other's.
    let same_step = old_step_s.zip(new_step_s).is_none_or(|(old, new)| (old - new).abs() < 1e-6 * old);
    let (keep_findings, keep_matches) = room(arguments);
    let comparison = Comparison {
        columns: matching::comparable(old_table.columns, new_table.columns, same_step),
        policy,
        old: old.side(),
        new: new.side(),
        keep_findings,
        keep_matches,
    };
    let name = if old.name == new.name { old.name.clone() } else { format!("{} / {}", old.name, new.name) };
    let mut downstream = Downstream::new(old, new);
    let compared = tally::compare(comparison, old_events, new_events, draft, |matched| {
        downstream.watch(matched);
        matches.push(&name, matched)
    });
    let mut run = compared.map_err(|error| match error {
        MatchError::Source(error) => Failure::bad_input(error),
        MatchError::Order { side, .. } => {
            let path = if side == "old" { &old.path } else { &new.path };
            Failure::BadInput(format!("{}: {error}", path.display()))
        }
    })?;
    downstream.tell(old, new, &mut run)?;
    if let (Some(old_run), Some(new_run)) = (&old.provenance, &new.provenance) {
        run.provenance = provenance::changes(old_run, new_run).map_err(|error| {
            Failure::BadInput(format!(
                "{}, {}: scenario.toml: {error}",
                old.path.display(),
                new.path.display()
            ))
        })?;
    }
    Ok(run)
}

/// The time step that a table counts in, s: from the run's header, else from its first event.
fn step_s(run: &Run, columns: Columns, events: Events) -> (Events, Option<f64>) {
    if let Some(provenance) = &run.provenance {
        return (events, Some(provenance.header.time_step_s));
    }
    if !columns.has(Column::OnsetStep) {
        return (events, None);
    }
    let mut events = events.peekable();
    let of = |event: &SlipEvent| (event.onset_step > 0).then(|| event.onset_s / event.onset_step as f64);
    let step_s = events.peek().and_then(|event| event.as_ref().ok().and_then(of));
    (Box::new(events), step_s)
}

fn print(report: &Report, format: DiffFormat) -> Result<(), Failure> {
    let mut out = io::BufWriter::new(io::stdout().lock());
    match format {
        DiffFormat::Text => {
            for line in summary::lines(report) {
                writeln!(out, "{line}")?;
            }
        }
        DiffFormat::Json => {
            serde_json::to_writer_pretty(&mut out, report).map_err(|error| Failure::Output(error.into()))?;
            writeln!(out)?;
        }
    }
    out.flush()?;
    Ok(())
}

/// The changes that the analysis makes of changed events.
#[cfg(feature = "analysis")]
struct Downstream {
    blocks: Option<(u32, u32)>,
    old: downstream::Candidates,
    new: downstream::Candidates,
}

#[cfg(feature = "analysis")]
impl Downstream {
    fn new(old: &Run, new: &Run) -> Downstream {
        let blocks = |run: &Run| run.provenance.as_ref().map(|provenance| provenance.header.blocks);
        Downstream {
            blocks: blocks(old).zip(blocks(new)),
            old: downstream::Candidates::default(),
            new: downstream::Candidates::default(),
        }
    }

    fn watch(&mut self, matched: Matched<'_>) {
        if let Some((old_blocks, new_blocks)) = self.blocks {
            matched.group.old.iter().for_each(|event| self.old.watch(event, old_blocks));
            matched.group.new.iter().for_each(|event| self.new.watch(event, new_blocks));
        }
    }

    fn tell(self, old: &Run, new: &Run, run: &mut RunDiff) -> Result<(), Failure> {
        if let (Some(old_run), Some(new_run)) = (&old.provenance, &new.provenance) {
            let changes = downstream::precursor_changes(self.old, self.new, (old_run, new_run))?;
            run.precursors = Some(changes);
        }
        Ok(())
    }
}

#[cfg(not(feature = "analysis"))]
struct Downstream;

#[cfg(not(feature = "analysis"))]
impl Downstream {
    fn new(_old: &Run, _new: &Run) -> Downstream {
        Downstream
    }

    fn watch(&mut self, _matched: Matched<'_>) {}

    fn tell(self, _old: &Run, _new: &Run, _run: &mut RunDiff) -> Result<(), Failure> {
        Ok(())
    }
}

#[cfg(feature = "analysis")]
fn claims(old: &Given, new: &Given) -> Result<Vec<ClaimChange>, Failure> {
    match (&old.claims, &new.claims) {
        (Some(old), Some(new)) => downstream::claim_changes(old, new),
        _ => Ok(Vec::new()),
    }
}

#[cfg(not(feature = "analysis"))]
fn claims(_old: &Given, _new: &Given) -> Result<Vec<ClaimChange>, Failure> {
    Ok(Vec::new())
}

/// The file of matches, if one was asked for.
#[cfg(feature = "analysis")]
struct Matches(Option<asperity_analysis::event_file::MatchFile>);

#[cfg(feature = "analysis")]
fn matches_file(arguments: &DiffArguments) -> Result<Matches, Failure> {
    let file = arguments.matches.as_ref().map(|path| asperity_analysis::event_file::MatchFile::create(path));
    file.transpose().map(Matches).map_err(Failure::bad_input)
}

#[cfg(feature = "analysis")]
impl Matches {
    fn push(&mut self, run: &str, matched: Matched<'_>) -> Result<(), TableError> {
        use asperity_analysis::event_file::{MatchRow, MatchSide};

        let Some(file) = &mut self.0 else { return Ok(()) };
        let side = |events: &[SlipEvent]| {
            let (first, last) = (events.first()?, events.last()?);
            Some(MatchSide {
                events: events.len() as u32,
                event: first.event,
                last_event: last.event,
                onset_s: first.onset_s,
                end_s: last.end_s,
                first_block: events.iter().map(|event| event.first_block).min()?,
                last_block: events.iter().map(|event| event.last_block).max()?,
                ft_fn_onset: first.ft_fn_onset,
            })
        };
        Ok(file.push(MatchRow {
            run: run.to_owned(),
            class: matched.class.name(),
            allowed: matched.allowed,
            shift_s: matched.shift_s,
            old: side(&matched.group.old),
            new: side(&matched.group.new),
        })?)
    }

    fn finish(self) -> Result<(), Failure> {
        self.0.map_or(Ok(()), |file| file.finish().map_err(Failure::failed))
    }
}

#[cfg(not(feature = "analysis"))]
struct Matches;

#[cfg(not(feature = "analysis"))]
fn matches_file(_arguments: &DiffArguments) -> Result<Matches, Failure> {
    Ok(Matches)
}

#[cfg(not(feature = "analysis"))]
impl Matches {
    fn push(&mut self, _run: &str, _matched: Matched<'_>) -> Result<(), TableError> {
        Ok(())
    }

    fn finish(self) -> Result<(), Failure> {
        Ok(())
    }
}
