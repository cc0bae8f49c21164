//! Arguments of `asperity run`.

use std::path::PathBuf;

use asperity_run::SolverKind;
use clap::{Args, ValueEnum};

use super::ScenarioChoice;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity run default -o out/default.mcap
  asperity run out/mine.toml -o out/mine.mcap --set normal_load.tilt=-0.5
  asperity run out/long.toml -o out/long.mcap --resume

During the run its log is called RUN.mcap.partial. About once a second a
checkpoint, the complete state of the solver, is written to it. If the run is
killed or the disk is full, --resume continues from the last checkpoint and ends
with the same records and events as an uninterrupted run. With --resume, a
finished run is left unchanged, and a run that was never begun is started, so a
batch job can repeat the same command line.

A run is stopped, with exit code 1, if the work of its finite time step exceeds
30 % of the energy input, or if a number overflows; its log contains the run up
to there, and the reason. A time step above 0.4 dt_max causes a warning
(docs/model.md).")]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// The log to write; must not exist, except with --resume.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
    /// The solver to use; fast and plain give the same events. Default: adaptive for rate-and-state friction, fast
    /// for other laws.
    #[arg(long, value_enum)]
    pub(crate) solver: Option<SolverChoice>,
    /// Print statistics of the solver on stderr, even with --quiet.
    #[arg(long)]
    pub(crate) stats: bool,
    /// Continue the run in RUN.mcap.partial, or start it if there is none.
    #[arg(long)]
    pub(crate) resume: bool,
    /// Shortest wall-clock time between two checkpoints, in seconds. Below 1 s, they take up to
    /// 16 MB, and from then on 0.1 MB per second.
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    pub(crate) checkpoint_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SolverChoice {
    /// Many steps at once wherever it is certain that no block switches.
    Fast,
    /// One step at a time, as in the equations.
    Plain,
    /// Steps as long as their error allows, for rate-and-state friction.
    Adaptive,
}

impl From<SolverChoice> for SolverKind {
    fn from(choice: SolverChoice) -> SolverKind {
        match choice {
            SolverChoice::Fast => SolverKind::Fast,
            SolverChoice::Plain => SolverKind::Plain,
            SolverChoice::Adaptive => SolverKind::Adaptive,
        }
    }
}
