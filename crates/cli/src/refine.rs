//! `asperity refine`: what the numbers of a scenario are worth.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use asperity_numbers::Convergence;
use asperity_numbers::refined::Refined;
use asperity_record::{counted, short};
use asperity_study::refine;
use asperity_study::work::Making;
use asperity_study::{Plan, plan};
use clap::Args;

use crate::exit::Failure;
use crate::interrupt;
use crate::outputs::{A_FOLDER, fits, must_be_new};
use crate::progress::Board;
use crate::scenario::ScenarioChoice;
use crate::study::outcome;
use crate::terminal::say;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity refine pmma-block -o out/refined
  asperity refine out/mine.toml -o out/refined --set time.duration_s=2
  asperity refine pmma-block -o out/refined --plan
  asperity sweep emit slurm out/refined --tasks 9 > out/refined/sweep.slurm

Twelve runs: as given, on a mesh twice as fine, with half the time step, and
on a mesh half as fine, each three times, with moduli that differ in their
sixth digit; nine of a lattice that has no node halfway along a side. A chain
keeps its decay length. A line for each number: its value, its class as found,
and its changes on the finer mesh, with the shorter step, and between runs
with perturbed moduli, as figures/refinement.png shows. Called again, it goes
on, also with results that other processes or nodes have made.
docs/findings.md says more.")]
pub(crate) struct RefineArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// Folder of the study; new or empty, or that of an earlier call.
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: PathBuf,
    /// How many runs to make at once [default: one per core].
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<NonZeroUsize>,
    /// Only write the plan, for `asperity sweep run` or `sweep emit`.
    #[arg(long)]
    pub(crate) plan: bool,
}

pub(crate) fn command(arguments: &RefineArguments, board: &Board) -> Result<(), Failure> {
    let RefineArguments { choice, out, jobs, plan: only_plan } = arguments;
    if !out.join(plan::FILE).exists() {
        fits("--out", out, "", A_FOLDER)?;
        must_be_new(out)?;
    }
    let scenario = choice.resolve_and_tell(board)?;
    let (study, work_ratio) = refine::study_of(&scenario)
        .map_err(|problem| Failure::BadInput(format!("{}: {problem}", choice.scenario.display())))?;
    let runs = counted(study.count(), "run");
    board.line(&format!("{}: {runs}, the work of {work_ratio:.0} as given", scenario.name));
    let lists: Vec<&str> = scenario.lists_by_block().map(|(key, _)| key).collect();
    if !lists.is_empty() {
        board.line(&format!("resampled on other meshes: {}", lists.join(", ")));
    }
    if *only_plan {
        Plan::begun(&study, &choice.scenario, out, false, *jobs)?;
        return Ok(say(out.join(plan::FILE).display())?);
    }
    interrupt::install()?;
    let making = Making { jobs: *jobs, ..Making::new(out, board) };
    let (refined, results) = refine::make(&study, &choice.scenario, &making)?;
    lines(&refined).iter().try_for_each(say)?;
    for file in ["tables/refinement.csv", "figures/refinement.png"] {
        say(out.join(file).display())?;
    }
    outcome(&results, |_| true)
}

/// A line for each number that all runs have, by its class as found, and how many numbers some run lacks.
fn lines(refined: &[Refined]) -> Vec<String> {
    let name_width = refined.iter().map(|one| one.number.name().len()).max().unwrap_or(0);
    let line = |one: &Refined| {
        let (found, [mesh, step, perturbed]) = (one.found()?, one.changes?.map(|change| 100.0 * change));
        let value = short(one.medians[0]?);
        let is_worse = found != Convergence::Robust && one.number.key.convergence == Convergence::Robust;
        let worse = if is_worse { "; stated as robust" } else { "" };
        let name = one.number.name();
        Some(format!(
            "{name:name_width$}  {value:>12}  {:<11}  finer mesh {mesh:.1} %, shorter step {step:.1} %, perturbed moduli {perturbed:.1} %{worse}",
            found.word()
        ))
    };
    let mut sorted: Vec<&Refined> = refined.iter().collect();
    sorted.sort_by_key(|one| one.found());
    let mut lines: Vec<String> = sorted.into_iter().filter_map(line).collect();
    lines.push(format!("{} not all runs have", counted((refined.len() - lines.len()) as u64, "number")));
    lines
}
