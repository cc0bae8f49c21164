//! `asperity sweep plan`, and the plan that `asperity sweep go` begins with.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use asperity_model::Preview;
use asperity_model::scenario::keys::AS_CODED;
use asperity_record::counted;
use asperity_study::plan::FILE;
use asperity_study::{Plan, Study};
use clap::Args;

use crate::exit::Failure;
use crate::given::{self, Taken};
use crate::outputs::{A_FOLDER, fits, must_be_new};
use crate::preview;
use crate::progress::Board;
use crate::terminal::say;

#[derive(Debug, Args)]
pub(crate) struct SweepPlanArguments {
    /// The sweep, or a pipeline.
    #[arg(value_name = "SWEEP.toml")]
    pub(crate) sweep: PathBuf,
    /// Folder of the study; must be new or empty, and for sweep go may be that of an earlier call.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// Record combinations that the scenario refuses, instead of stopping at them.
    #[arg(long)]
    pub(crate) skip_refused: bool,
    /// How many runs to resolve, and to make, at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
}

pub(crate) fn command(arguments: &SweepPlanArguments, board: &Board) -> Result<(), Failure> {
    let plan = arguments.out.join(FILE);
    if plan.exists() {
        must_be_new(&arguments.out)?;
    }
    begun(arguments, board)?;
    Ok(say(plan.display())?)
}

/// Reads a study with overrides for its named runs, and prints their parameter sets with the sources of these if some are as coded.
pub(crate) fn read_study(file: &Path, set: &[String], board: &Board) -> Result<Study, Failure> {
    given::check(file, Taken::Runs)?;
    let mut study = Study::read(file)?;
    study.set(set);
    let sets = Some(study.parameter_sets()).filter(|sets| sets.contains(AS_CODED));
    sets.iter().for_each(|sets| board.line(&format!("{}: {sets}", file.display())));
    Ok(study)
}

/// The plan of a sweep in a folder: that which is there, if it is of this sweep, or a new one.
pub(crate) fn begun(arguments: &SweepPlanArguments, board: &Board) -> Result<Plan, Failure> {
    let SweepPlanArguments { sweep, out, skip_refused, jobs } = arguments;
    if !out.join(FILE).exists() {
        fits("--out", out, "", A_FOLDER)?;
        must_be_new(out)?;
    }
    let study = read_study(sweep, &[], board)?;
    let (plan, is_new) = Plan::begun(&study, sweep, out, *skip_refused, *jobs)?;
    if is_new {
        tell(&plan, board);
    }
    Ok(plan)
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
    let mut line = format!("{} planned", counted(plan.rows.len() as u64, "run"));
    if refused > 0 {
        line.push_str(&format!(", of which {refused} are refused"));
    }
    board.line(&line);
}
