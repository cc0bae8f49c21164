//! Figures of a parameter study, drawn of the rows of its tables as they pass.
//!
//! What is kept of a run are the few numbers that its figures show, and no more points of precursor
//! lengths than can be told apart on paper. So memory grows by some tens of bytes with each run,
//! whatever the number of its events.

mod colours;
mod curves;
mod gather;
mod map;
mod paper;
mod scale;

use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_model::Scenario;
use asperity_record::{Cell, Column};
use asperity_study_figures::{Figure, Kind};

use crate::error::AnalysisError;
use gather::Gathered;

/// The tables whose rows are asked for.
const TABLES: [&str; 2] = ["runs", "ruptures"];

/// Gives the scenario of a run by its number, for theories.
pub type ScenarioOf<'a> = &'a dyn Fn(u64) -> Result<Scenario, String>;

/// Gathers what figures show, and draws them.
#[derive(Debug)]
pub struct Drawer {
    figures: Vec<Gathered>,
}

impl Drawer {
    /// Of these figures.
    pub fn new(figures: &[Figure]) -> Drawer {
        Drawer { figures: figures.iter().cloned().map(Gathered::new).collect() }
    }

    /// A table with these columns begins.
    pub fn begin(&mut self, table: &str, columns: &[Column]) {
        let [runs, ruptures] = TABLES;
        for figure in &mut self.figures {
            if table == runs {
                figure.find_columns(columns);
            } else if table == ruptures {
                figure.find_rupture_columns(columns);
            }
        }
    }

    /// A row of a table: the ruptures of a run come before the run.
    pub fn row(&mut self, table: &str, cells: &[Cell]) {
        let [runs, ruptures] = TABLES;
        for figure in &mut self.figures {
            if table == runs {
                figure.run(cells);
            } else if table == ruptures {
                figure.rupture(cells);
            }
        }
    }

    /// Draws the figures into a folder, as files of a set, and says which they are. A study that has
    /// nothing to show yet gives figures without data.
    ///
    /// # Errors
    /// If the scenario of a run that a theory asks for is not to be had, or a file cannot be written.
    pub fn draw(
        &self,
        scenario_of: ScenarioOf<'_>,
        files: &FileSet,
        folder: &Path,
    ) -> Result<Vec<PathBuf>, AnalysisError> {
        let mut paths = Vec::new();
        for gathered in &self.figures {
            let file = &gathered.figure.file;
            let failed = |problem: String| AnalysisError::Figure { file: file.clone(), problem };
            let paper = match gathered.figure.kind {
                Kind::PhaseMap { statistic, scattered } => map::paper(gathered, statistic, scattered),
                Kind::Family { joined, theory } => curves::family(gathered, joined, theory, scenario_of),
                Kind::Lengths { law } => curves::lengths(gathered, law, scenario_of),
            };
            let path = folder.join(file);
            paper
                .and_then(|paper| paper.write(&files.create_by_path(&path).map_err(|e| e.to_string())?))
                .map_err(failed)?;
            paths.push(path);
        }
        Ok(paths)
    }
}
