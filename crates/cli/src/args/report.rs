//! Arguments of `asperity report`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity report out/mine.mcap --out out/mine.html
  asperity report out/chapter5 --out out/chapter5.html
  asperity report out/tilts --out out/tilts.html
  asperity report out/chapter5 out/chapter6 --out out/index.html

A page is one file that fetches nothing: what was asked, the claims beside their
figures, and of every run its load curve and the space-time map of its ruptures,
with a table of them. A rupture picked in one is shown in all. It says the same
in words without scripts. docs/report.md has all of it.

Of several folders there is a page with their scores and figures that leads to
the report.html of each; its pictures stay where they are. reproduce and sweep
collect write report.html by themselves.

Exit codes:
  0  done
  1  failure
  2  bad input; nothing was written
  3, 5, 7  a log is incomplete, salvaged with gaps or of a run that was
           stopped: the page is of what there is, and says so
  4  a log is damaged; nothing was written")]
pub(crate) struct ReportArguments {
    /// Run logs; or the folder of a pipeline or a sweep, or several.
    #[arg(value_name = "RUN.mcap|STUDY", required = true)]
    pub(crate) of: Vec<PathBuf>,
    /// The page.
    #[arg(short, long, value_name = "PAGE.html")]
    pub(crate) out: PathBuf,
    /// Say nothing of the code, the time step and the solver that runs were made with.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// Replace an existing file.
    #[arg(long)]
    pub(crate) force: bool,
}
