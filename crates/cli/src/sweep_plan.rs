//! `asperity sweep plan`, and the plan that `asperity sweep go` and `asperity reproduce` begin with.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_files::Inputs;
use asperity_model::Preview;
use asperity_study::plan::FILE;
use asperity_study::{Plan, PlanError, Study};
use clap::Args;

use crate::exit::Failure;
use crate::given::{self, Taken};
use crate::outputs::{A_FOLDER, create_folder, fits, must_be_new, refused};
use crate::preview;
use crate::progress::Board;
use crate::study::runs;
use crate::terminal::say;

#[derive(Debug, Args)]
pub(crate) struct SweepPlanArguments {
    /// The sweep.
    #[arg(value_name = "SWEEP.toml")]
    pub(crate) sweep: PathBuf,
    /// Folder of the study; must be new or empty.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Record combinations that the scenario refuses, instead of stopping at them.
    #[arg(long)]
    pub(crate) skip_refused: bool,
    /// How many runs to resolve at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

pub(crate) fn command(arguments: &SweepPlanArguments, board: &Board) -> Result<(), Failure> {
    let SweepPlanArguments { sweep, out, skip_refused, jobs } = arguments;
    is_new(out)?;
    let study = read_study(sweep, &[])?;
    let plan = resolved(&study, sweep, *skip_refused, *jobs)?;
    tell_parameter_sets(&study, sweep, board);
    write(&plan, sweep, out)?;
    tell(&plan, board);
    Ok(say(out.join(FILE).display())?)
}

/// Reads a study with overrides for its named runs.
pub(crate) fn read_study(file: &Path, set: &[String]) -> Result<Study, Failure> {
    given::check(file, Taken::Runs)?;
    let mut study = Study::read(file).map_err(Failure::bad_input)?;
    study.set(set);
    Ok(study)
}

/// Prints the parameter sets of the runs of a study, and their sources.
pub(crate) fn tell_parameter_sets(study: &Study, file: &Path, board: &Board) {
    board.line(&format!("{}: {}", file.display(), study.parameter_sets()));
}

/// The plan of a sweep in a folder: that which is there, if it is of this sweep, or a new one.
pub(crate) fn begun(
    sweep: &Path,
    folder: &Path,
    skip_refused: bool,
    jobs: Option<NonZeroUsize>,
    board: &Board,
) -> Result<Plan, Failure> {
    let is_there = folder.join(FILE).exists();
    if !is_there {
        is_new(folder)?;
    }
    let study = read_study(sweep, &[])?;
    let plan = resolved(&study, sweep, skip_refused, jobs)?;
    tell_parameter_sets(&study, sweep, board);
    if is_there {
        is_of(&plan, folder)?;
    } else {
        write(&plan, sweep, folder)?;
        tell(&plan, board);
    }
    Ok(plan)
}

/// The plan of a study in a folder, which is made if there is none.
pub(crate) fn planned(
    study: &Study,
    file: &Path,
    folder: &Path,
    jobs: Option<NonZeroUsize>,
) -> Result<Plan, Failure> {
    let plan = resolved(study, file, false, jobs)?;
    if folder.join(FILE).exists() {
        is_of(&plan, folder)?
    } else {
        write(&plan, file, folder)?
    }
    Ok(plan)
}

fn is_new(folder: &Path) -> Result<(), Failure> {
    fits("--out", folder, "", A_FOLDER)?;
    must_be_new(folder)
}

fn resolved(
    study: &Study,
    file: &Path,
    skip_refused: bool,
    jobs: Option<NonZeroUsize>,
) -> Result<Plan, Failure> {
    Plan::of(study, skip_refused, jobs)
        .map_err(|error| Failure::BadInput(format!("{}: {error}", file.display())))
}

fn write(plan: &Plan, file: &Path, folder: &Path) -> Result<(), Failure> {
    create_folder(folder)?;
    plan.write(folder, Inputs::of([file])).map_err(|error| match error {
        PlanError::File(error) => refused("--out", &error, false),
        error => Failure::failed(error),
    })
}

/// Checks that a folder has this plan.
fn is_of(plan: &Plan, folder: &Path) -> Result<(), Failure> {
    if Plan::read(folder).map_err(Failure::bad_input)?.hash == plan.hash {
        return Ok(());
    }
    Err(Failure::BadInput(format!(
        "--out {}: it has the plan of another study, or by other code (accepted: another folder)",
        folder.display()
    )))
}

/// Prints the number of planned runs, and the warnings of the first of them.
fn tell(plan: &Plan, board: &Board) {
    let warned = plan.rows.iter().filter(|row| !row.warnings.is_empty());
    let warned = warned.map(|row| (plan.label(row.run), &row.warnings[..]));
    preview::folded(warned).iter().for_each(|line| board.line(line));
    let previews: Vec<&Preview> = plan.rows.iter().filter_map(|row| row.preview.as_ref()).collect();
    if let Some(words) = preview::ranges(&previews) {
        board.line(&words);
    }
    let refused = plan.rows.iter().filter(|row| row.refused.is_some()).count();
    let mut line = format!("{} planned", runs(plan.rows.len() as u64));
    if refused > 0 {
        line.push_str(&format!(", of which {refused} are refused"));
    }
    board.line(&line);
}
