//! `asperity sweep log`: the log of one run of a study.

use std::path::PathBuf;

use asperity_run::{LogTo, Task};
use asperity_study::Plan;
use asperity_study::plan::Row;
use clap::Args;

use crate::exit::Failure;
use crate::progress::Board;
use crate::run;
use crate::study::read_plan;

#[derive(Debug, Args)]
pub(crate) struct SweepLogArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The number of the run, as in the tables; or its name, if it has one.
    #[arg(value_name = "RUN")]
    pub(crate) run: String,
    /// The log to write; must not exist, except with --resume.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
    /// Continue the run in RUN.mcap.partial, or start it if there is none.
    #[arg(long)]
    pub(crate) resume: bool,
}

/// Makes the run as planned and logs it; its id is that in the plan.
pub(crate) fn command(arguments: &SweepLogArguments, board: &Board) -> Result<(), Failure> {
    let SweepLogArguments { folder, run, out, resume } = arguments;
    let plan = read_plan(folder)?;
    plan.check_code(folder).map_err(Failure::bad_input)?;
    let row = row(&plan, run)?;
    if let Some(reason) = &row.refused {
        return Err(Failure::BadInput(format!(
            "{} is refused: {reason} (accepted: a run that is made)",
            plan.label(row.run)
        )));
    }
    let (scenario, _) = plan
        .scenario(row)
        .map_err(|reason| Failure::BadInput(format!("{}: {reason}", plan.label(row.run))))?;
    board.line(&plan.label(row.run));
    run::make(Task::new(&scenario), LogTo::new(out), *resume, false, board)
}

/// The run of a number, or of a name.
fn row<'a>(plan: &'a Plan, run: &str) -> Result<&'a Row, Failure> {
    let numbered = run.parse::<usize>().ok().and_then(|run| plan.rows.get(run.checked_sub(1)?));
    let is_named = |row: &&Row| plan.named(row.run).is_some_and(|named| named.name == run);
    numbered.or_else(|| plan.rows.iter().find(is_named)).ok_or_else(|| {
        let names = if plan.common.runs.is_empty() { "" } else { ", or the name of one" };
        Failure::BadInput(format!("run {run}: there is none (accepted: 1 to {}{names})", plan.rows.len()))
    })
}
