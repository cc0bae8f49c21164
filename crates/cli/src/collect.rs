//! `asperity sweep collect` and `asperity sweep draw`: the tables and figures of a study.

use std::path::{Path, PathBuf};

use asperity_study::{Outputs, reduce};
use asperity_tables::Format;
use clap::{Args, ValueEnum};

use crate::exit::Failure;
use crate::given::{self, Taken};
use crate::interrupt;
use crate::outputs::{A_FOLDER, fits};
use crate::progress::Board;
use crate::reproduce::tell_where_to_look;
use crate::study::{outcome, read};
use crate::terminal::say;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum SweepTable {
    /// Columns with types and units, compressed.
    Parquet,
    /// Comma-separated, one header line, numbers in full precision.
    Csv,
}

pub(crate) const USUAL_FORMAT: &str = "parquet";

#[derive(Debug, Args)]
pub(crate) struct SweepCollectArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The formats of the tables.
    #[arg(long, value_enum, value_name = "FORMAT", value_delimiter = ',', default_value = USUAL_FORMAT)]
    pub(crate) to: Vec<SweepTable>,
    /// Folder for the tables, and for a folder of figures [default: tables and
    /// figures, in the folder of the study].
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SweepDrawArguments {
    /// Folder of the study.
    pub(crate) folder: PathBuf,
    /// The sweep whose figures are drawn [default: as it was planned].
    #[arg(long, value_name = "SWEEP.toml")]
    pub(crate) from: Option<PathBuf>,
    /// Folder for the figures [default: figures, in the folder of the study].
    #[arg(short, long, value_name = "FOLDER")]
    pub(crate) out: Option<PathBuf>,
    /// Draw figures without the code version and without the line that names
    /// their source: for comparison byte by byte.
    #[arg(long)]
    pub(crate) no_provenance: bool,
}

pub(crate) fn tables(arguments: &SweepCollectArguments, board: &Board) -> Result<(), Failure> {
    let SweepCollectArguments { folder, to, out, no_provenance } = arguments;
    out.as_ref().map_or(Ok(()), |out| fits("--out", out, "", A_FOLDER))?;
    let (plan, results) = &read(folder)?;
    make(
        &Outputs { plan, results, folder, provenance: !no_provenance, watcher: board },
        to,
        out.as_deref(),
        board,
    )
}

/// Makes all outputs of a study.
pub(crate) fn make(
    outputs: &Outputs<'_>,
    to: &[SweepTable],
    out: Option<&Path>,
    board: &Board,
) -> Result<(), Failure> {
    let &Outputs { plan, results, folder, .. } = outputs;
    let has_names = !plan.common.runs.is_empty();
    if has_names && out.is_some() {
        return Err(Failure::BadInput(
            "--out: the study has runs with names (accepted: no --out, since their outputs are written \
             beside their logs)"
                .to_owned(),
        ));
    }
    let mut beside = Default::default();
    if plan.numbered() > 0 {
        let format = |table: &SweepTable| match table {
            SweepTable::Parquet => Format::Parquet,
            SweepTable::Csv => Format::Csv,
        };
        let formats: Vec<Format> = to.iter().map(format).collect();
        beside = outputs.tables(&formats, out)?;
        beside.files.iter().try_for_each(|path| say(path.display()))?;
    }
    board.line(&results.in_words());
    if has_names {
        interrupt::install()?;
        if !reduce(*outputs, beside)?.is_empty() {
            tell_where_to_look(&plan.common.title, folder)?;
        }
    }
    outcome(results, |_| true)
}

pub(crate) fn figures(arguments: &SweepDrawArguments, board: &Board) -> Result<(), Failure> {
    let SweepDrawArguments { folder, from, out, no_provenance } = arguments;
    out.as_ref().map_or(Ok(()), |out| fits("--out", out, "", A_FOLDER))?;
    let (plan, results) = &read(folder)?;
    if let Some(from) = from {
        given::check(from, Taken::Runs)?;
    }
    let outputs = Outputs { plan, results, folder, provenance: !no_provenance, watcher: board };
    let paths = outputs.figures(from.as_deref(), out.as_deref())?;
    paths.iter().try_for_each(|path| say(path.display()))?;
    board.line(&results.in_words());
    outcome(results, |_| true)
}
