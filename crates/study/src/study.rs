//! A study as written: named runs, one scenario over axes, the data stored of them, and their outputs.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

use asperity_figures::{Family, Figure};
use asperity_model::scenario::text;
use asperity_record::Cell;
use asperity_record::bounds::MOST_RUNS;
use asperity_run::OpenedForStudy;
use asperity_run::study::Job;

use crate::axis;
use crate::axis::Axis;
use crate::error::StudyError;
pub use crate::file::Keep;
use crate::pipeline::Pipeline;
use crate::runs::{Named, read_scenario};

/// One scenario over axes: its runs have numbers.
#[derive(Debug, Clone, Default)]
pub struct Grid {
    /// The name or path of the scenario.
    pub scenario: String,
    /// The text of that scenario.
    pub scenario_toml: String,
    /// Overrides in all runs of the study, `key=value`.
    pub set: Vec<String>,
    /// The data stored of each run.
    pub keep: Vec<Keep>,
    /// The axes. Every point of each axis is combined with all points of the others; the last axis varies
    /// fastest.
    pub axes: Vec<Axis>,
}

/// Many runs, and their outputs.
#[derive(Debug, Clone)]
pub struct Study {
    /// One scenario over axes.
    pub grid: Option<Grid>,
    /// The runs that have names; their results are run logs.
    pub runs: Vec<Named>,
    /// How many of each run's overrides are those of the whole study, and from the command line: the
    /// first and the last of them.
    pub(crate) shared_sets: (usize, usize),
    /// The figures of the tables of the grid.
    pub figures: Vec<Figure>,
    /// The outputs of single runs, and the claims.
    pub pipeline: Pipeline,
    /// Its text.
    pub text: String,
}

impl Study {
    /// Reads a study. A scenario is a built-in one, or a file that is looked up in the folder of the
    /// study, then in the current one.
    ///
    /// # Errors
    /// A message with file, key, value and the accepted values.
    pub fn read(path: &Path) -> Result<Study, StudyError> {
        let refused = StudyError::refused(path);
        let text = text::read(path)
            .map_err(|error| refused(format!("study cannot be read: {error} (accepted: a TOML file)")))?;
        Study::parse(&text, path.parent().unwrap_or(Path::new("."))).map_err(refused)
    }

    /// A study from its text. A scenario that is a file is looked up in this folder, then in the current one.
    ///
    /// # Errors
    /// A message with key, value and the accepted values.
    pub fn parse(text: &str, folder: &Path) -> Result<Study, String> {
        let mut file = Pipeline::unchecked(text)?;
        let read = |path: &str| text::read(&folder.join(path)).map_err(|error| error.to_string());
        file.figure.measured_mut().try_for_each(|file| file.read(read))?;
        if file.axis.is_empty() && file.run.is_empty() {
            return Err("there are no runs and nothing varies (accepted: [[run]], or scenario \
                        with one or more [[axis]])"
                .to_owned());
        }
        let grid = Grid::of(&file, folder)?;
        let axes = grid.iter().flat_map(|grid| &grid.axes);
        let for_figures: Vec<_> = axes.map(Axis::for_figures).collect();
        let keeps_ruptures = grid.as_ref().is_some_and(|grid| grid.keep.contains(&Keep::Ruptures));
        if grid.is_none() && !file.figure.family.is_empty() {
            return Err("figures of the tables of runs ([[figure.family]]) need runs over axes (accepted: \
                        scenario with one or more [[axis]])"
                .to_owned());
        }
        let figures = Family::understand(&file.figure.family, &for_figures, keeps_ruptures)?;
        let runs = file.run.iter().map(|run| run.read(folder)).collect::<Result<_, _>>()?;
        let at = |at: &[String]| grid.as_ref().map_or(Ok(Vec::new()), |grid| grid.runs_at(at));
        let pipeline = file.checked(grid.as_ref().map_or(0, Grid::count), &at)?;
        let shared_sets = (pipeline.set.len(), 0);
        Ok(Study { grid, runs, shared_sets, figures, pipeline, text: text.to_owned() })
    }

    /// Whether it has outputs beyond the tables of its grid and their figures, which need its text.
    pub(crate) fn is_more_than_tables(&self) -> bool {
        let claims = !self.pipeline.claim.is_empty();
        claims || !self.runs.is_empty()
    }

    /// Adds overrides to the runs that have names.
    pub fn set(&mut self, set: &[String]) {
        self.runs.iter_mut().for_each(|run| run.set.extend_from_slice(set));
        self.shared_sets.1 += set.len();
    }

    /// The runs that have names, ready to be made.
    ///
    /// # Errors
    /// If a scenario refuses its overrides, in words.
    pub fn jobs(&self) -> Result<Vec<Job>, String> {
        self.runs.iter().map(|run| run.job(&OpenedForStudy)).collect()
    }

    /// The number of runs over the axes.
    pub fn count(&self) -> u64 {
        self.grid.as_ref().map_or(0, Grid::count)
    }
}

impl Grid {
    /// The runs over axes of a file; file names in it are relative to a folder.
    fn of(file: &Pipeline, folder: &Path) -> Result<Option<Grid>, String> {
        let Pipeline { scenario, set, axis, .. } = file;
        if axis.is_empty() {
            return match scenario {
                Some(scenario) => Err(format!(
                    "scenario = {scenario:?} and nothing varies (accepted: one or more [[axis]])"
                )),
                None => Ok(None),
            };
        }
        let Some(scenario) = scenario else {
            return Err("[[axis]] without scenario (accepted: the scenario that the axes vary)".to_owned());
        };
        let axes = axis
            .iter()
            .enumerate()
            .map(|(n, axis)| axis.read(folder).map_err(|error| format!("axis {}: {error}", n + 1)))
            .collect::<Result<Vec<_>, _>>()?;
        let mut set_by: BTreeMap<&str, usize> = BTreeMap::new();
        for (n, axis) in axes.iter().enumerate() {
            for key in &axis.keys {
                if let Some(other) = set_by.insert(key.path, n + 1) {
                    return Err(format!(
                        "{} varies on axes {other} and {} (accepted: on one axis)",
                        key.path,
                        n + 1
                    ));
                }
            }
        }
        for assignment in set {
            let key = assignment.split('=').next().unwrap_or_default().trim();
            if let Some(axis) = set_by.get(key) {
                return Err(format!(
                    "set: {assignment} and axis {axis} both set {key} (accepted: one of them)"
                ));
            }
        }
        let mut keep = file.keep.clone();
        keep.push(Keep::Summary);
        keep.sort_unstable();
        keep.dedup();
        let scenario_toml = read_scenario(scenario, folder)?.0;
        let grid = Grid { scenario: scenario.clone(), scenario_toml, set: set.clone(), keep, axes };
        match grid.runs() {
            Some(_) => Ok(Some(grid)),
            None => Err(format!("its axes make too many runs (accepted: up to {MOST_RUNS})")),
        }
    }

    fn runs(&self) -> Option<u64> {
        let count = |axis: &Axis| axis.rows.len() as u64;
        let runs = self.axes.iter().try_fold(1_u64, |runs, axis| runs.checked_mul(count(axis)))?;
        (runs <= MOST_RUNS).then_some(runs)
    }

    /// The number of its runs.
    pub fn count(&self) -> u64 {
        self.runs().expect("a study is read only if it has not too many runs")
    }

    /// The values of its keys in a run, counted from 0.
    pub fn values(&self, run: u64) -> Vec<Cell> {
        let mut left = run;
        let mut points = Vec::with_capacity(self.axes.len());
        for axis in self.axes.iter().rev() {
            let count = axis.rows.len() as u64;
            points.push(&axis.rows[(left % count) as usize]);
            left /= count;
        }
        points.into_iter().rev().flatten().cloned().collect()
    }

    /// The runs with these values of keys, counted from 1.
    fn runs_at(&self, at: &[String]) -> Result<Vec<u64>, String> {
        let runs = (0..self.count()).map(|run| (run + 1, Cow::Owned(self.values(run))));
        axis::runs_at(at, &self.keys(), runs)
    }

    /// The keys that vary, in the order of their values.
    pub fn keys(&self) -> Vec<String> {
        self.axes.iter().flat_map(|axis| axis.keys.iter().map(|key| key.path.to_owned())).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use asperity_record::Cell;

    use super::{Grid, Keep, Study};
    use crate::pipeline::Pipeline;
    use crate::plan::Plan;

    const TILTS: &str = "[[axis]]\nkey = 'normal_load.tilt'\nvalues = [-0.5, 0.5]\n";

    fn parse(text: &str) -> Result<Grid, String> {
        let text = format!("title = 'Tilts'\nscenario = 'default'\n{text}");
        Study::parse(&text, Path::new(".")).map(|study| study.grid.expect("it has axes"))
    }

    #[test]
    fn every_point_meets_every_other_and_the_last_axis_runs_fastest() {
        let grid =
            parse(&format!("{TILTS}[[axis]]\nkey = 'slider.blocks'\nvalues = [10, 20, 30]\n")).unwrap();
        assert_eq!((grid.count(), grid.keys().join(" ").as_str()), (6, "normal_load.tilt slider.blocks"));
        let blocks = |run| grid.values(run)[1].clone();
        assert_eq!([0, 1, 2, 3].map(blocks), [10, 20, 30, 10].map(Cell::Step));
        assert_eq!(grid.values(3)[0], Cell::Number(0.5));
        assert_eq!(grid.keep, [Keep::Events, Keep::Ruptures, Keep::Summary]);
    }

    #[test]
    fn contradictions_are_refused() {
        let many = "[[axis]]\nkey = 'time.duration_s'\nfrom = 1\nto = 2\ncount = 4000\n\
                    [[axis]]\nkey = 'slider.mass_kg'\nfrom = 1\nto = 2\ncount = 4000\n";
        for (text, problem) in [
            (String::new(), "nothing varies"),
            (format!("{TILTS}{TILTS}"), "normal_load.tilt varies on axes 1 and 2"),
            (format!("set = ['normal_load.tilt=0']\n{TILTS}"), "both set normal_load.tilt"),
            (many.to_owned(), "too many runs"),
            (
                format!("keep = ['movies']\n{TILTS}"),
                "keep = 'movies' is not accepted (accepted: events, ruptures, ",
            ),
            (format!("colour = 1\n{TILTS}"), "line 3, column 1: colour: unknown key"),
            (
                format!("{TILTS}[[figure]]\nkind = 'family'\n"),
                "[[figure]] is not accepted (accepted: with a kind, [[figure.KIND]])",
            ),
            (
                format!("{TILTS}[[figure.family]]\nfile = 'a.png'\nx = 'normal_load.tilt'\ny = 'count'\n"),
                "figure.family \"a.png\": y = \"count\" does not vary",
            ),
            (
                format!(
                    "keep = ['events']\n{TILTS}[[figure.family]]\nfile = 'a.png'\nx = 'ft_fn_onset'\n\
                     y = 'length_ratio'\n"
                ),
                "keeps no ruptures",
            ),
        ] {
            let error = parse(&text).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
    }

    /// Measured points are read beside the study, and a plan holds them.
    #[test]
    fn measured_points_are_beside_the_study_and_in_its_plan() {
        let folder = tempfile::tempdir().unwrap();
        let points = folder.path().join("lab.csv");
        let text = format!(
            "title = 't'\nscenario = 'default'\n{TILTS}[[run]]\nname = 'a'\nscenario = 'default'\n\
             [[figure.load]]\nfile = 'a.png'\nrun = 'a'\nsliding = true\nmeasured = 'lab.csv'\n\
             [[figure.family]]\nfile = 'b.png'\nx = 'normal_load.tilt'\ny = 'precursor_count'\n\
             measured = 'lab.csv'\nmeasured_label = 'a laboratory'\n"
        );
        let of = |written: &str| {
            std::fs::write(&points, written).unwrap();
            Study::parse(&text, folder.path())
        };
        let study = of("time_s,ft_fn,normal_load.tilt,precursor_count\n1,0.1,0.2,3\n").unwrap();
        let measured = study.figures[0].measured.as_ref().unwrap();
        assert_eq!(
            (measured.label.as_str(), &measured.points[..]),
            ("a laboratory", &[[[0.2, 0.0], [3.0, 0.0]]][..])
        );
        let plan = Plan::of(&study, false, None).unwrap();
        std::fs::remove_file(&points).unwrap();
        let again = Pipeline::of_plan(&plan, folder.path()).unwrap().unwrap();
        let read = |of: &Pipeline| of.figure.clone().measured_mut().next().unwrap().read_text().1.to_owned();
        assert_eq!(read(&again), read(&study.pipeline));
        let missing = Study::parse(&text, folder.path()).unwrap_err();
        assert!(missing.starts_with("measured = \"lab.csv\" cannot be read: "), "{missing}");
        let of_load = of("time_s,ft_fn,normal_load.tilt,precursor_count\n1,much,0.2,3\n").unwrap_err();
        assert!(of_load.contains("line 2, column \"ft_fn\": \"much\" (accepted: a number)"), "{of_load}");
        let of_family = of("time_s,ft_fn,normal_load.tilt\n1,0.1,0.2\n").unwrap_err();
        assert!(
            of_family.contains("family \"b.png\": measured") && of_family.contains("\"precursor_count\""),
            "{of_family}"
        );
    }

    /// Named runs may accompany runs over axes, which need a scenario, as do figures of their tables.
    #[test]
    fn runs_and_axes_stand_in_one_file() {
        let of = |text: &str| Study::parse(&format!("title = 't'\n{text}"), Path::new("."));
        let run = "[[run]]\nname = 'a'\nscenario = 'default'\n";
        let both = of(&format!("scenario = 'slab'\n{TILTS}{run}")).unwrap();
        assert_eq!((both.count(), both.runs.len(), both.jobs().unwrap()[0].name.as_str()), (2, 1, "a"));
        for (text, problem) in [
            (String::new(), "there are no runs and nothing varies"),
            (TILTS.to_owned(), "[[axis]] without scenario"),
            (format!("scenario = 'slab'\n{run}"), "scenario = \"slab\" and nothing varies"),
            (format!("{run}{run}"), "two runs are called a"),
            (run.replace("'a'", "'a/b'"), "run name \"a/b\" is no file name"),
            (run.replace("'default'", "'defualt'"), "did you mean default?"),
            (
                format!(
                    "{run}[[figure.family]]\nfile = 'a.png'\nx = 'normal_load.tilt'\ny = 'event_count'\n"
                ),
                "figures of the tables of runs",
            ),
        ] {
            let error = of(&text).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
        {
            let series = "[[figure.lengths]]\nfile = 'a.png'\nseries = [{ run = 'a', label = 'a' }]\n";
            assert!(of(&format!("{run}{series}")).is_ok());
            let family = "[[figure.family]]\nfile = 'a.png'\nx = 'normal_load.tilt'\ny = 'precursor_count'\n";
            let error = of(&format!("scenario = 'slab'\n{TILTS}{run}{series}{family}")).unwrap_err();
            assert!(error.contains("would be written twice"), "{error}");
        }
    }
}
