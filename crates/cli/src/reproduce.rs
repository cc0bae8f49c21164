//! `asperity reproduce` and `asperity reduce`: runs to tables and figures.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_figures::draw::of_one_run::{Kind, Target};
use asperity_files::{Existing, FileSet, Inputs, is_taken, remove_file};
use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::precursors::PrecursorRules;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::Collector;
use asperity_record::{EventPayload, Rupture};
use asperity_run::{Checked, OpenLog, SolverKind};
use asperity_study::{Reproduction, StudyError, record};
use asperity_tables::table_files::{self, PassingTable};
use asperity_tables::{Table, summaries, tables};
use clap::Args;

use crate::exit::Failure;
use crate::outputs::{A_FOLDER, fits, must_be_new, refused};
use crate::progress::Board;
use crate::reading::{self, Reading};
use crate::run::solvers;
use crate::terminal::say;
use crate::{interrupt, summary, sweep_plan, verdict_exit};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reduce out/mine.mcap -o out/mine
  asperity reduce out/mine.mcap -o out/sifted --merge-gap-s 1e-4 --min-blocks 2")]
pub(crate) struct ReduceArguments {
    /// The run log.
    #[arg(value_name = "RUN.mcap")]
    pub(crate) run: PathBuf,
    /// Folder for tables and figures; must be new or empty, except with --force.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Precursor tables: leave out ruptures and events of fewer distinct blocks.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) min_blocks: u32,
    /// Precursor table of slip events: merge events that are no farther apart than this; 0 merges
    /// none.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub(crate) merge_gap_s: f64,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// Replace existing files of the same names; others in the folder stay.
    #[arg(long)]
    pub(crate) force: bool,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity reproduce pipelines/chapter5.toml -o out/chapter5
  asperity reproduce pipelines/chapter5.toml -o out/chapter5-as-stated \\
    --set parameter_set=as-stated

Runs already in the folder are reused if asperity check finds their logs whole:
complete, and made by this version of the program with its detectors. Other runs
are repeated, and a line gives the reason. A run of another scenario or solver
is replaced only with --fresh, which repeats all runs. Tables, figures and the
page report.html are replaced together; reproduce.json records their sources.
Only one process at a time can write to the folder.")]
pub(crate) struct ReproduceArguments {
    /// The pipeline; or any other file of a study, even with runs over axes.
    #[arg(value_name = "PIPELINE.toml")]
    pub(crate) pipeline: PathBuf,
    /// Folder for runs, tables and figures.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Override one key in every run of the pipeline.
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Repeat runs that are already in the folder, and replace those of other scenarios.
    #[arg(long)]
    pub(crate) fresh: bool,
    /// The solver to use for every run; fast and plain give the same events. Default: that of the run's law.
    #[arg(long, value_parser = solvers())]
    pub(crate) solver: Option<SolverKind>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// How many runs to make, and to reduce, at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

/// The file beside tables and figures of an incomplete log.
const MISSING: &str = "what-is-missing.txt";

pub(crate) fn reduce_command(arguments: &ReduceArguments, board: &Board) -> Result<(), Failure> {
    let out = &arguments.out;
    let rules = PrecursorRules { min_blocks: arguments.min_blocks, merge_gap_s: arguments.merge_gap_s };
    rules.check().map_err(|error| Failure::BadInput(format!("--merge-gap-s: {error}")))?;
    fits("--out", out, "", A_FOLDER)?;
    if !arguments.force {
        must_be_new(out)?;
    }
    let name = summary::name(&arguments.run);
    let run = &arguments.run;
    let existing = if arguments.force { Existing::Replace } else { Existing::Refuse };
    let files = FileSet::new(existing, Inputs::of([run]));
    files.folder(out).map_err(|error| refused("--out", &error, false))?;
    let begin = |log: &OpenLog| {
        let mut required = RequiredData::LOADS | rules.required_data();
        if log.header().junction_count > 0 {
            required |= RequiredData::motion();
        }
        let collector = Collector::of_log(&name, log.header(), log.needed_scenario()?, required)?;
        let loads = PassingTable::loads((&files, out, "load"), collector.both_ways());
        let events = PassingTable::events((&files, out, tables::EVENTS), log.header().parts());
        Ok((collector.bounded(&rules), (loads, events)))
    };
    let accept = |checked: &Checked| verdict_exit::must_be_sound(run, checked);
    let Reading { checked, observer: (collector, (loads, events)), has_ruptures } =
        reading::once(run, &[], begin, accept)?;
    loads.finish().and_then(|()| events.finish()).map_err(StudyError::from)?;
    let verdict = checked.verdict;
    let data = collector.finish(has_ruptures, checked.seen.end.as_ref());
    let summary = &data.summary;
    let law = LengthLaw::natural(&data.scenario);
    let has_slow_slip = data.header.junction_count > 0;
    let folder = Target::Folder(out.clone());
    let mut figures = Vec::new();
    // A log by other detectors has slip events alone.
    let of_events = ["of=slip-events".to_owned()];
    let set = if data.ruptures.is_none() { &of_events[..] } else { &[] };
    for (kind, set) in [("load", &[][..]), ("lengths", set)] {
        let kind = Kind::find(kind).expect("it is a kind");
        let figure = kind.of_run(&name, &data.header, &data.scenario, set).map_err(Failure::failed)?;
        figures.push(figure.or_empty());
    }
    if !verdict.holds_all() {
        let note = format!(
            "These tables and figures show only what the log of a run contains. The log is not whole.\n{}: \
             {checked}\n",
            arguments.run.display()
        );
        files.write(&out.join(MISSING), note).map_err(|error| refused("--out", &error, false))?;
    }
    if data.ruptures.is_some() {
        // Its rows have numbers of the whole run.
        let table = PassingTable::ruptures((&files, out, tables::RUPTURES), &data);
        let skims: &[&str] = if checked.problem.is_none() { &[Rupture::TOPIC] } else { &[] };
        let accept = |again: &Checked| match again.problem.is_some() == checked.problem.is_some() {
            true => Ok(()),
            false => Err(verdict_exit::failure(run, again)),
        };
        let again = reading::once(run, skims, |_| Ok(table), accept)?;
        again.observer.finish().map_err(StudyError::from)?;
    }
    let write = || -> Result<(), StudyError> {
        let write = |table: Table| table_files::write(&files, out, &table.name.clone(), table);
        if data.ruptures.is_some() {
            write(tables::precursor_ruptures(&data, &[(law, rules)]))?;
            if has_slow_slip {
                write(tables::slow_slip(&data)?)?;
            }
        }
        write(tables::precursors(&data, law, &rules)?)?;
        write(tables::residuals(&data, law, &rules)?)?;
        summaries::write_table(&files, &out.join(summaries::TABLE), [summary])?;
        summaries::write_json(&files, &out.join(summaries::JSON), summary)?;
        let of_ruptures = [tables::RUPTURES, tables::PRECURSOR_RUPTURES];
        let of_ruptures = of_ruptures.into_iter().chain(has_slow_slip.then_some(tables::SLOW_SLIP));
        let tables = of_ruptures.filter(|_| data.ruptures.is_some());
        let tables = tables
            .chain([tables::EVENTS, "load", tables::PRECURSORS, tables::RESIDUALS])
            .flat_map(|name| table_files::paths(out, name));
        let tables = tables.chain([summaries::TABLE, summaries::JSON].map(|name| out.join(name)));
        let pictures = figures.iter().flat_map(|figure| folder.files(figure.kind));
        record::write(&files, out, "reduce", [(name.as_str(), &data.header)], tables.chain(pictures), None)?;
        for figure in &figures {
            figure.draw(&data, !arguments.no_provenance, &files, &folder)?;
        }
        Ok(files.publish()?)
    };
    write()?;
    // Of a log that was not whole, which these files replace.
    if verdict.holds_all() && is_taken(&out.join(MISSING)) {
        remove_file(&out.join(MISSING))?;
    }
    say(out.display())?;
    summary::tell(arguments.run.display(), summary, board);
    verdict_exit::finish(&arguments.run, &checked, board)
}

pub(crate) fn command(arguments: &ReproduceArguments, board: &Board) -> Result<(), Failure> {
    let ReproduceArguments { pipeline: file, out, set, solver, fresh, no_provenance, jobs } = arguments;
    fits("--out", out, "", A_FOLDER)?;
    let study = sweep_plan::read_study(file, set, board)?;
    let of_names = [("--set", !set.is_empty()), ("--fresh", *fresh), ("--solver", solver.is_some())];
    if let Some((option, _)) = of_names.into_iter().find(|(_, given)| *given && study.grid.is_some()) {
        return Err(Failure::BadInput(format!(
            "{option}: {} has runs over axes (accepted: {option} for studies without)",
            file.display()
        )));
    }
    interrupt::install()?;
    let reproduction = Reproduction {
        solver: *solver,
        fresh: *fresh,
        jobs: *jobs,
        provenance: !no_provenance,
        watcher: board,
    };
    match reproduction.of(&study, file, out)?.is_empty() {
        true => Ok(()),
        false => tell_where_to_look(&study.pipeline.title, out),
    }
}

/// Prints the folders of the outputs of runs that have names.
pub(crate) fn tell_where_to_look(title: &str, out: &Path) -> Result<(), Failure> {
    say(title)?;
    let all =
        [("figures", "figures"), ("tables", "tables"), ("claims", "tables/claims.md"), ("runs", "runs")];
    let there = all.iter().map(|(what, path)| (what, out.join(path))).filter(|(_, path)| path.exists());
    for (what, path) in there {
        say(format_args!("  {what:8} {}", path.display()))?;
    }
    Ok(())
}
