//! Figures of a parameter study, drawn from the rows of its tables as they pass.
//!
//! Each run contributes only the numbers that its figures show, and no more points of precursor
//! lengths than paper resolves. Memory therefore grows by some tens of bytes per run, whatever the
//! number of its events.

mod curves;
mod gather;
mod map;
mod refinement;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use asperity_files::FileSet;
use asperity_numbers::{Convergence, Number};
use asperity_record::{Cell, Column};

use super::drawn;
pub use super::print::about::Origins;
use super::print::{self, files_of};
use super::sheet::Sheet;
use crate::draw::error::FigureError;
use crate::{Figure, Kind, Quantity};
pub use gather::ScenarioOf;
use gather::{Gathered, Heads, Row};

/// Gathers what figures show, and draws them.
#[derive(Debug)]
pub struct Drawer {
    figures: Vec<Gathered>,
    /// Of each table that has begun.
    heads: HashMap<String, Heads>,
}

impl Drawer {
    /// Of these figures.
    pub fn new(figures: &[Figure]) -> Drawer {
        let begun = |figure: &Figure| Gathered { figure: figure.clone(), ..Gathered::default() };
        Drawer { figures: figures.iter().map(begun).collect(), heads: <_>::default() }
    }

    /// A table with these columns begins.
    pub fn begin(&mut self, table: &str, columns: &[Column]) {
        let heads = columns.iter().enumerate().map(|(at, column)| (column.name.to_string(), at));
        self.heads.insert(table.to_owned(), heads.collect());
    }

    /// A row of a table: the ruptures of a run come before the run.
    pub fn row(&mut self, table: &str, cells: &[Cell]) {
        let Some(heads) = self.heads.get(table) else { return };
        for figure in &mut self.figures {
            match (table, figure.figure.kind) {
                ("runs", _) => figure.run(Row(heads, cells)),
                ("ruptures", Kind::Lengths { .. }) => figure.rupture(Row(heads, cells)),
                _ => {}
            }
        }
    }

    /// Draws the figures into a folder, as files of a set, and says which files they are. A study that
    /// has nothing to show yet gives figures without data. `provenance` is whether they name the code and
    /// bear a line at their foot.
    ///
    /// # Errors
    /// If the scenario of a run that a theory asks for is not to be had, or a file cannot be written.
    pub fn draw(
        &self,
        scenario_of: ScenarioOf<'_>,
        origins: &Origins,
        provenance: bool,
        files: &FileSet,
        folder: &Path,
    ) -> Result<Vec<PathBuf>, FigureError> {
        let mut paths = Vec::new();
        for gathered in &self.figures {
            let file = &gathered.figure.file;
            let failed = |problem: String| FigureError::Figure { file: file.clone(), problem };
            let sheet = match gathered.figure.kind {
                Kind::PhaseMap { statistic, scattered } => map::sheet(gathered, statistic, scattered),
                Kind::Family { joined, theory } => curves::family(gathered, joined, theory, scenario_of),
                Kind::Lengths { law } => curves::lengths(gathered, law, scenario_of),
                Kind::Refinement => Ok(refinement::sheet(&gathered.figure, &gathered.refined)),
            };
            let Figure { title, width_mm, measured, .. } = &gathered.figure;
            let sheet = Sheet { width_mm: *width_mm, ..sheet.map_err(failed)?.titled(title) };
            let sheet = sheet.with_measured(measured.as_ref());
            let (page, about) =
                drawn(&what(gathered), &sheet, origins.clone(), provenance).map_err(failed)?;
            let written = files_of(&folder.join(file));
            print::write(&page, &about, files, &written)?;
            paths.extend(written);
        }
        Ok(paths)
    }
}

/// What a figure shows.
fn what(gathered: &Gathered) -> String {
    match gathered.figure.kind {
        Kind::PhaseMap { statistic, .. } => {
            let shared = map::shared(gathered, statistic).map(|shared| format!("; {shared}"));
            let worth = worth(gathered.figure.colour.as_ref());
            format!("A number of runs as colour over two keys{worth}{}", shared.unwrap_or_default())
        }
        Kind::Family { .. } => format!("Curves of a number of runs{}", worth(Some(&gathered.figure.y))),
        Kind::Lengths { .. } => "Lengths of precursors, and the load at which each begins".to_owned(),
        Kind::Refinement => {
            "What numbers are worth: how they change with mesh, step and perturbed moduli".to_owned()
        }
    }
}

/// What a number that is not robust is worth, as the end of a sentence.
fn worth(shown: Option<&Quantity>) -> String {
    let number = shown.and_then(|shown| Number::find(&shown.column).ok());
    let class = number.map(|number| number.key.convergence).filter(|class| *class != Convergence::Robust);
    class.map_or_else(String::new, |class| format!("; the number is {}: {}", class.word(), class.why()))
}

#[cfg(test)]
mod tests {
    use crate::draw::Figures;
    use crate::{Axis, Family, Key, Kind, Statistic};
    use asperity_record::{Cell, Column, ColumnKind, EventPayload, Rupture};
    use asperity_testkit::scenario;

    use super::{Drawer, curves, map, what};
    use crate::draw::scale::Scale;
    use crate::draw::sheet::{Marker, Shape, Sheet};
    use crate::draw::{Caption, words};

    /// What is gathered for one figure of a sweep of tilts and stiffnesses.
    fn gathered(figure: &str) -> Drawer {
        let values = |values: &[f64]| values.iter().map(|value| Cell::Number(*value)).collect();
        let key = |path, numbers| Axis {
            keys: vec![Key { path, is_number: true, log: false, values: values(numbers) }],
            joined: true,
        };
        let axes = [key("normal_load.tilt", &[0.0, 0.5]), key("drive.stiffness_n_per_m", &[1.0, 2.0, 4.0])];
        let figures: Figures = toml::from_str(figure).unwrap();
        let mut drawer = Drawer::new(&Family::understand(&figures.family, &axes, true).unwrap());
        let column = |name: &'static str, kind| Column {
            name: name.into(),
            kind,
            unit: None,
            about: "".into(),
            only: None,
            over_area: None,
            role: None,
            is_optional: true,
        };
        drawer.begin(
            "runs",
            &[
                column("run", ColumnKind::Step),
                column("normal_load.tilt", ColumnKind::Number),
                column("drive.stiffness_n_per_m", ColumnKind::Number),
                column("status", ColumnKind::Word),
                column("first_slip_s", ColumnKind::Number),
                column("blocks", ColumnKind::Count),
            ],
        );
        drawer.begin("ruptures", Rupture::COLUMNS);
        drawer
    }

    /// Tells of a run, whose first slip may lack.
    fn run(
        to: &mut Drawer,
        number: u64,
        (tilt, stiffness): (f64, f64),
        status: &'static str,
        slip_s: Option<f64>,
    ) {
        let blocks = if status == "done" { Cell::Count(10) } else { Cell::Empty };
        let slip = slip_s.map_or(Cell::Empty, Cell::Number);
        to.row(
            "runs",
            &[
                Cell::Step(number),
                Cell::Number(tilt),
                Cell::Number(stiffness),
                Cell::Word(status.into()),
                slip,
                blocks,
            ],
        );
    }

    fn lines(sheet: &Sheet) -> Vec<Vec<(f64, f64)>> {
        let of = |shape: &Shape| match shape {
            Shape::Line(points, _) if !points.is_empty() => Some(points.clone()),
            _ => None,
        };
        sheet.layers().filter_map(|layer| of(&layer.shape)).collect()
    }

    const MAP: &str = "[[family]]\nfile = 'a.png'\nx = 'normal_load.tilt'\ny = 'drive.stiffness_n_per_m'\n\
        colour = 'first_slip_s'\n";

    #[test]
    fn what_is_missing_in_a_map_is_no_colour() {
        let mut gathered = gathered(MAP);
        let places = [(0.0, 1.0), (0.0, 2.0), (0.0, 4.0), (0.5, 1.0), (0.5, 2.0), (0.5, 4.0)];
        for (n, place) in (1..).zip(places) {
            let (status, slip_s) = match n {
                2 => ("failed", None),
                5 => ("done", None),
                _ => ("done", Some(f64::from(n as u32))),
            };
            run(&mut gathered, n, place, status, slip_s);
        }
        let sheet = map::sheet(&gathered.figures[0], Statistic::Median, false).unwrap();
        let [cells, none, crossed] = &sheet.panels[0].layers[..] else { panic!("{sheet:?}") };
        let Shape::Cells(cells) = &cells.shape else { panic!("{cells:?}") };
        assert_eq!(cells.len(), 4);
        assert_eq!(crossed.shape, Shape::Marks(vec![(0.0, 2.0)], Marker::Cross));
        assert_eq!([none.label.as_str(), crossed.label.as_str()], ["none", "no run"]);
        // What is labelled was run.
        let labels = |scale: &Scale| -> Vec<String> {
            scale.ticks_at_most(7.0).into_iter().map(|tick| tick.label).collect()
        };
        assert_eq!(
            (labels(&sheet.panels[0].x).join(" "), labels(&sheet.panels[0].y).join(" ")),
            ("0.0 0.5".to_owned(), "1 2 4".to_owned())
        );
        // The colours are those of the numbers there are: 1 to 6 and not from 0.
        let bar = sheet.bar.as_ref().unwrap();
        assert_eq!(
            (bar.scale.share(1.0), bar.scale.share(6.0), bar.scale.share(0.0)),
            (Some(0.0), Some(1.0), None)
        );
        // Cells meet half way, and the outer ones are as wide on both sides.
        assert_eq!(cells[0].0, [(-0.25, 0.5), (0.25, 1.5)]);
    }

    #[test]
    fn several_runs_in_a_place_are_one_number() {
        let of = |statistic: &str| {
            let text = MAP.replace("x = 'normal_load.tilt'", "x = 'drive.stiffness_n_per_m'").replace(
                "y = 'drive.stiffness_n_per_m'",
                &format!("y = 'normal_load.tilt'\nstatistic = '{statistic}'"),
            );
            let mut gathered = gathered(&text);
            for (n, slip_s) in [1.0, 2.0, 6.0].into_iter().enumerate() {
                run(&mut gathered, n as u64, (0.0, 1.0), "done", Some(slip_s));
            }
            run(&mut gathered, 9, (0.0, 2.0), "done", Some(0.0));
            let Kind::PhaseMap { statistic, .. } = gathered.figures[0].figure.kind else { panic!("a map") };
            let sheet = map::sheet(&gathered.figures[0], statistic, false).unwrap();
            let Caption { caption, .. } = words(&what(&gathered.figures[0]), &sheet);
            assert!(
                caption.contains(&format!("; {} of 1 to 3 runs per cell.", statistic.word())),
                "{caption}"
            );
            let bar = sheet.bar.unwrap();
            [2.0, 3.0, 1.0, 6.0].map(|value| bar.scale.share(value) == Some(1.0))
        };
        assert_eq!(of("median"), [true, false, false, false]);
        assert_eq!(of("mean"), [false, true, false, false]);
        assert_eq!(of("smallest"), [false, false, true, false]);
        assert_eq!(of("largest"), [false, false, false, true]);
    }

    #[test]
    fn a_curve_has_a_gap_where_no_run_has_the_number() {
        let mut gathered = gathered(
            "[[family]]\nfile = 'a.png'\nx = 'drive.stiffness_n_per_m'\ny = 'first_slip_s'\n\
             over = ['normal_load.tilt']\n",
        );
        for (n, tilt) in [0.0, 0.5].into_iter().enumerate() {
            let extra = n as f64;
            run(&mut gathered, 1, (tilt, 1.0), "done", Some(1.0 + extra));
            run(&mut gathered, 2, (tilt, 2.0), "done", None);
            run(&mut gathered, 3, (tilt, 4.0), "done", Some(3.0 + extra));
        }
        let none = |_| Err("no scenario is asked for".to_owned());
        let sheet = curves::family(&gathered.figures[0], true, false, &none).unwrap();
        let line = &lines(&sheet)[0];
        assert!(line[0] == (1.0, 1.5) && line[1].1.is_nan() && line[2] == (4.0, 3.5), "{line:?}");
        let of = |shape: &Shape| match shape {
            Shape::Surface(points, _) => Some((true, points.len())),
            Shape::Marks(points, _) => Some((false, points.len())),
            _ => None,
        };
        let shown: Vec<(bool, usize)> = sheet.layers().filter_map(|layer| of(&layer.shape)).collect();
        // No band across the gap, but its rows in the legend.
        assert_eq!(shown, [(false, 2), (true, 0), (true, 0)]);
    }

    /// A rupture from one block to another.
    fn rupture(to: &mut Drawer, number: u64, onset_step: u64, blocks: (u32, u32), ft_fn: f64) {
        let cell = |column: &Column| match column.name.as_ref() {
            "rupture" => Cell::Step(number),
            "onset_step" => Cell::Step(onset_step),
            "first_block" => Cell::Count(blocks.0),
            "last_block" => Cell::Count(blocks.1),
            "reached_every_block" => Cell::Flag(blocks == (1, 10)),
            "ft_fn_onset" => Cell::Number(ft_fn),
            _ => Cell::Empty,
        };
        to.row("ruptures", &Rupture::COLUMNS.iter().map(cell).collect::<Vec<Cell>>());
    }

    #[test]
    fn precursors_are_found_in_whatever_order_ruptures_come() {
        let mut gathered = gathered(
            "[[family]]\nfile = 'a.png'\nx = 'ft_fn_onset'\ny = 'length_ratio'\ncolour = 'normal_load.tilt'\nat = ['drive.stiffness_n_per_m=2']\n",
        );
        // By onset: 2, a shorter one, one that misses block 1, 5, the whole slider, and one after it.
        for (number, onset_step, blocks, ft_fn) in [
            (0, 40, (1, 5), 0.25),
            (1, 10, (1, 2), 0.125),
            (2, 20, (1, 1), 0.15),
            (3, 30, (2, 8), 0.2),
            (4, 60, (1, 7), 0.5),
            (5, 50, (1, 10), 0.4),
        ] {
            rupture(&mut gathered, number, onset_step, blocks, ft_fn);
        }
        run(&mut gathered, 1, (0.5, 2.0), "done", None);
        // What belongs to one run is not the next one's, nor shown if another stiffness is.
        run(&mut gathered, 2, (0.0, 2.0), "done", None);
        rupture(&mut gathered, 0, 10, (1, 3), 0.1);
        run(&mut gathered, 3, (0.0, 4.0), "done", None);
        let marks = gathered.figures[0].marks.values().flatten();
        let marks: Vec<(f64, f64)> =
            marks.map(|(load, length)| (f64::from_bits(*load), f64::from_bits(*length))).collect();
        let near = |found: (f64, f64), load: f64, length: f64| {
            (found.0 / load - 1.0).abs() < 2e-4 && (found.1 / length - 1.0).abs() < 2e-4
        };
        assert!(marks.len() == 2 && near(marks[0], 0.125, 0.2) && near(marks[1], 0.25, 0.5), "{marks:?}");
        // The law of each colour, as a line.
        let tilts = [(1, "0.5"), (2, "0")];
        let scenario_of = |run| {
            let tilt = tilts.iter().find(|(of, _)| *of == run).map(|(_, tilt)| *tilt).ok_or("not shown")?;
            Ok(scenario("default", &[format!("normal_load.tilt={tilt}")]).0)
        };
        let lines = lines(&curves::lengths(&gathered.figures[0], None, &scenario_of).unwrap());
        assert_eq!(lines.len(), 2);
        // (5.22) for the tilted load, (5.57) for the even one: 0.45 at the end, and half of it half way.
        assert!(lines.iter().all(|line| (line[200].0 - 0.45).abs() < 1e-12), "{lines:?}");
        assert!(lines.iter().any(|line| (line[100].0 - 0.225).abs() < 1e-12));
    }
}
