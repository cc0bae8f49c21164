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

A page is one file that fetches nothing. It shows what a study asks, its claims
beside their figures, and for every run the load curve, the space-time map of
its ruptures, and a table of them; a rupture selected in one is marked in all.
Without scripts, text and tables remain. docs/report.md describes the page.

For several folders, the page shows their scores and figures and links to the
report.html of each; pictures stay in their folders. asperity reproduce and
asperity sweep collect write report.html themselves.

Exit codes:
  0  done
  1  failure
  2  bad input; nothing was written
  3, 5, 7  a log is incomplete, salvaged with gaps, or its run was stopped: the
           page shows what the log contains, and says so
  4  a log is damaged; nothing was written")]
pub(crate) struct ReportArguments {
    /// Run logs; or one or more folders of pipelines or sweeps.
    #[arg(value_name = "RUN.mcap|STUDY", required = true)]
    pub(crate) of: Vec<PathBuf>,
    /// The page.
    #[arg(short, long, value_name = "PAGE.html")]
    pub(crate) out: PathBuf,
    /// Omit the code version, the time step and the solver of the runs.
    #[arg(long)]
    pub(crate) no_provenance: bool,
    /// Replace an existing file.
    #[arg(long)]
    pub(crate) force: bool,
}
