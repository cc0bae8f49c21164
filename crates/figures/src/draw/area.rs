//! Maps over an area of contact, drawn to scale: a cell for each contact, with outlines of sets of contacts,
//! contour lines, arrows, and the driven edge.

use std::collections::{BTreeMap, BTreeSet};

use asperity_numbers::run_data::RunEvents;
use asperity_record::{Contacts, magnitude};

use super::colours::Colours;
use super::scale::{Scale, number};
use super::sheet::{INK, Layer, Layout, Panel, Point, RED, Shape, Sheet};

/// Points of the map, mm.
type Points = Vec<Point>;

/// The contacts of a run over an area.
#[derive(Debug, Clone)]
pub(super) struct Area {
    pub(super) contacts: Contacts,
    spacing_mm: f64,
    /// Where it is driven.
    drive: Option<Layer>,
}

/// What lies on a map: its title, the number of each cell, and layers upon these.
pub(super) type Map = (String, Vec<f64>, Vec<Layer>);

/// What is free beside the driven edge, and how thick its mark is, over the length of the slider.
const MARGIN: f64 = 0.035;
const EDGE: f64 = 0.012;

/// About how far apart arrows are, over the length of the slider.
const BETWEEN_ARROWS: f64 = 0.035;

impl Area {
    /// That of a run; in words, why it has none.
    pub(super) fn of(run: &RunEvents) -> Result<Area, String> {
        if run.of_one_row().is_some() {
            let accepted = "(accepted: a run over an area, slider.across of 2 or more)";
            return Err(format!("the contacts of run {} lie in a single row {accepted}", run.name));
        }
        let plan = &run.plan;
        let mut area =
            Area { contacts: run.header.contacts(), spacing_mm: plan.spacing_m * 1e3, drive: None };
        let from_top = || (!plan.drive.springs.is_empty()).then(|| Layer::remark("driven from the top"));
        area.drive = plan.driven_rows().map(|rows| area.driven_edge(rows)).or_else(from_top);
        Ok(area)
    }

    /// Numbers of all contacts.
    pub(super) fn all(&self) -> impl Iterator<Item = u32> + use<> {
        1..=self.contacts.count()
    }

    /// Where a contact is.
    pub(super) fn place(&self, contact: u32) -> (f64, f64) {
        let at = |place: u32| f64::from(place - 1) * self.spacing_mm;
        (at(self.contacts.column(contact)), at(self.contacts.row(contact)))
    }

    fn length_mm(&self) -> f64 {
        f64::from(self.contacts.columns() - 1) * self.spacing_mm
    }

    /// The outlines of a set of contacts, along the edges of their cells.
    pub(super) fn outlines(&self, has: &dyn Fn(u32) -> bool) -> Vec<Points> {
        let (columns, rows) = (self.contacts.columns(), self.contacts.rows());
        // Columns and rows from 1; beyond them there is nothing.
        let inside = |column: u32, row: u32| {
            (1..=columns).contains(&column) && (1..=rows).contains(&row) && has((row - 1) * columns + column)
        };
        let mut edges = Vec::new();
        for (column, row) in (0..=columns).flat_map(|column| (0..=rows).map(move |row| (column, row))) {
            // From the corner above and at the right of a contact back.
            if inside(column, row) != inside(column + 1, row) {
                edges.push([(column, row - 1), (column, row)]);
            }
            if inside(column, row) != inside(column, row + 1) {
                edges.push([(column - 1, row), (column, row)]);
            }
        }
        let at = |corner: u32| (f64::from(corner) - 0.5) * self.spacing_mm;
        joined(&edges, |(column, row)| (at(column), at(row)))
    }

    /// Lines along which a quantity has a level, between contacts that all have a value: those of squares of
    /// four contacts, by straight lines between them.
    pub(super) fn contours(&self, values: &[f64], level: f64) -> Vec<Points> {
        let columns = self.contacts.columns();
        let mut crossings: BTreeMap<[u32; 2], (f64, f64)> = BTreeMap::new();
        let mut edges = Vec::new();
        for contact in self.all() {
            // Around the square; beyond the last row there is nothing.
            let corners = [contact, contact + 1, contact + columns + 1, contact + columns];
            let of = corners.map(|corner| values.get(corner as usize - 1).copied().unwrap_or(f64::NAN));
            if self.contacts.column(contact) == columns || of.iter().any(|value| value.is_nan()) {
                continue;
            }
            let mut crossed = Vec::new();
            let sides = [(0, 1), (1, 2), (2, 3), (3, 0)].into_iter();
            for (a, b) in sides.filter(|(a, b)| (of[*a] < level) != (of[*b] < level)) {
                let share = (level - of[a]) / (of[b] - of[a]);
                let ((x0, y0), (x1, y1)) = (self.place(corners[a]), self.place(corners[b]));
                let key = [corners[a].min(corners[b]), corners[a].max(corners[b])];
                crossings.insert(key, (x0 + share * (x1 - x0), y0 + share * (y1 - y0)));
                crossed.push(key);
            }
            // At a saddle the two lines keep to the corners that are not as the middle is.
            if (of.iter().sum::<f64>() / 4.0 < level) != (of[0] < level) {
                let last = crossed.pop();
                crossed.splice(..0, last);
            }
            edges.extend(crossed.chunks_exact(2).map(|ends| [ends[0], ends[1]]));
        }
        joined(&edges, |key| crossings[&key])
    }

    /// Arrows of a vector at contacts that are far enough apart in `panels` panels on a sheet, with the
    /// size of the longest in its unit; none of zero alone.
    pub(super) fn arrows(&self, vectors: &[[f64; 2]], longest: f64, panels: usize, unit: &str) -> Vec<Layer> {
        if longest <= 0.0 {
            return Vec::new();
        }
        // Several panels are in two columns.
        let smaller = if panels > 3 { 2.0 } else { 1.0 };
        let apart = (smaller * BETWEEN_ARROWS * self.length_mm() / self.spacing_mm).round().max(1.0) as u32;
        let longest_mm = 0.9 * f64::from(apart) * self.spacing_mm;
        let counts = [self.contacts.columns(), self.contacts.rows()];
        let places = |contact: u32| [self.contacts.column(contact), self.contacts.row(contact)];
        // From both edges the same, so that what is symmetric looks so.
        let is_drawn = |contact: &u32| {
            let mut both = places(*contact).into_iter().zip(counts);
            both.all(|(place, count)| (place + apart - 1 - (count - 1) % apart / 2).is_multiple_of(apart))
        };
        let arrow = |contact: u32| {
            let [x, y] = [0, 1].map(|axis| {
                let half = vectors[contact as usize - 1][axis] / longest * longest_mm / 2.0;
                // About the contact, but within the map: an arrow that leaves the axes would not be drawn.
                let margin = half.abs() - 0.49 * self.spacing_mm;
                let [at, last] =
                    [places(contact)[axis], counts[axis]].map(|n| f64::from(n - 1) * self.spacing_mm);
                let at = if 2.0 * margin < last { at.clamp(margin, last - margin) } else { 0.5 * last };
                [at - half, at + half]
            });
            [(x[0], y[0]), (x[1], y[1])]
        };
        let arrows = Shape::Arrows(self.all().filter(is_drawn).map(arrow).collect());
        vec![Layer::new("", arrows, INK), Layer::remark(format!("longest arrow: {}{unit}", number(longest)))]
    }

    /// The mark of the driven edge, from the first to the last row.
    fn driven_edge(&self, [first, last]: [u32; 2]) -> Layer {
        let (x, thick) = (-0.5 * self.spacing_mm, EDGE * self.length_mm());
        let y = [f64::from(first) - 1.5, f64::from(last) - 0.5].map(|row| row * self.spacing_mm);
        let outline = vec![(x - thick, y[0]), (x, y[0]), (x, y[1]), (x - thick, y[1])];
        Layer::surface("driven edge", outline, 1.0, RED)
    }

    /// Maps over the area, to which the drive is added.
    pub(super) fn sheet(&self, panels: Vec<Map>, colours: Colours) -> Sheet {
        let half = 0.5 * self.spacing_mm;
        let (length, rows) = (self.length_mm(), f64::from(self.contacts.rows()));
        let x = Scale::between("x (mm)", -half - MARGIN * length, length + half);
        let y = Scale::between("y (mm)", -half, (rows - 0.5) * self.spacing_mm);
        maps(panels, self.drive.as_slice(), [x, y], self.contacts.columns() as usize, colours)
    }
}

/// Maps of the same axes, drawn to scale, with one colour bar and layers on all of them. Cells are squares in so many
/// columns, row by row from the lower end of the axes; no square is of what is no number.
pub(super) fn maps(all: Vec<Map>, also: &[Layer], [x, y]: [Scale; 2], columns: usize, bar: Colours) -> Sheet {
    let [across, upwards] = [&x, &y].map(|axis| axis.ends().1 - axis.ends().0);
    let panel = |(title, values, layers): Map| {
        let side = upwards / (values.len() / columns) as f64;
        let cell = |(n, value): (usize, &f64)| {
            let at = |cells: usize| y.ends().0 + cells as f64 * side;
            let corner = |far: usize| (at(n % columns + far), at(n / columns + far));
            ([corner(0), corner(1)], bar.nearest(*value))
        };
        let cells = values.iter().enumerate().filter(|(_, value)| value.is_finite()).map(cell);
        let layers = std::iter::once(Layer::cells(cells.collect())).chain(layers);
        Panel::new(x.clone(), y.clone(), layers.chain(also.iter().cloned()).collect()).titled(title)
    };
    let panels = all.into_iter().map(panel).collect();
    Sheet { layout: Layout::Close(upwards / across), bar: Some(bar), ..Sheet::of(panels) }
}

/// Sizes of vectors.
pub(super) fn sizes(vectors: &[[f64; 2]]) -> Vec<f64> {
    vectors.iter().map(|vector| magnitude(*vector)).collect()
}

/// Lines through edges that meet, each edge once, and where their points are.
fn joined<P: Copy + Ord, Q>(edges: &[[P; 2]], at: impl Fn(P) -> Q) -> Vec<Vec<Q>> {
    let mut met: BTreeMap<P, BTreeSet<P>> = BTreeMap::new();
    for (from, to) in edges.iter().flat_map(|&[a, b]| [(a, b), (b, a)]) {
        met.entry(from).or_default().insert(to);
    }
    // From open ends first, so that no line begins in its middle.
    let ends = met.iter().filter(|(_, to)| to.len() % 2 == 1).map(|(end, _)| *end);
    let starts: Vec<P> = ends.chain(edges.iter().map(|edge| edge[0])).collect();
    let line = |mut here: P| {
        let mut line = vec![at(here)];
        while let Some(next) = met.get_mut(&here).and_then(BTreeSet::pop_first) {
            met.entry(next).or_default().remove(&here);
            line.push(at(next));
            here = next;
        }
        line
    };
    starts.into_iter().map(line).filter(|line| line.len() > 1).collect()
}

#[cfg(test)]
mod tests {
    use super::{Area, Points, Shape, joined};
    use asperity_testkit::made_up;

    /// Four columns of three rows, 100/3 mm apart.
    fn area() -> Area {
        Area::of(&made_up::sheet(&[])).unwrap()
    }

    const A: f64 = 100.0 / 3.0;

    fn length(lines: &[Points]) -> f64 {
        let of =
            |line: &Points| line.windows(2).map(|p| (p[1].0 - p[0].0).hypot(p[1].1 - p[0].1)).sum::<f64>();
        lines.iter().map(of).sum()
    }

    #[test]
    fn an_outline_goes_once_around_what_it_encloses() {
        let area = area();
        let of = |set: &[u32]| area.outlines(&|contact| set.contains(&contact));
        let all: Vec<u32> = area.all().collect();
        let [whole] = &of(&all)[..] else { panic!("one line") };
        assert!(
            (length(std::slice::from_ref(whole)) - 14.0 * A).abs() < 1e-9 && whole.first() == whole.last()
        );
        // A single contact, two that touch at a corner alone, and a ring about a hole.
        assert!((length(&of(&[6])) - 4.0 * A).abs() < 1e-9);
        assert!((length(&of(&[1, 6])) - 8.0 * A).abs() < 1e-9);
        let ring: Vec<u32> = all.iter().copied().filter(|n| ![4, 8, 12, 6].contains(n)).collect();
        let lines = of(&ring);
        assert!(lines.len() == 2 && (length(&lines) - 16.0 * A).abs() < 1e-9, "{lines:?}");
        assert!(of(&[]).is_empty());
    }

    #[test]
    fn contours_are_where_the_value_is() {
        let area = area();
        // A plane that rises along x and y: each level is a straight line.
        let plane: Vec<f64> = area.all().map(|n| area.place(n)).map(|(x, y)| x + 0.5 * y).collect();
        let lines = area.contours(&plane, 50.0);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].iter().all(|(x, y)| (x + 0.5 * y - 50.0).abs() < 1e-9), "{lines:?}");
        let ends = [lines[0][0], lines[0][lines[0].len() - 1]];
        assert!((length(&lines) - (ends[0].0 - ends[1].0).hypot(ends[0].1 - ends[1].1)).abs() < 1e-9);
        // Around a hill the line is closed.
        let hill: Vec<f64> = area.all().map(|n| f64::from(u8::from(n == 6))).collect();
        let lines = area.contours(&hill, 0.5);
        assert!(lines.len() == 1 && lines[0].first() == lines[0].last() && lines[0].len() == 5, "{lines:?}");
        // At a saddle lines do not cross, and where a value is missing there is none.
        let saddle: Vec<f64> = area.all().map(|n| f64::from(u8::from([2, 5].contains(&n)))).collect();
        assert_eq!(area.contours(&saddle, 0.4).len(), 2);
        let gaps: Vec<f64> =
            plane.iter().map(|value| if *value < 50.0 { *value } else { f64::NAN }).collect();
        assert!(area.contours(&gaps, 60.0).is_empty() && area.contours(&plane, 1e3).is_empty());
    }

    #[test]
    fn arrows_are_as_long_as_their_vectors() {
        let area = area();
        let vectors: Vec<[f64; 2]> = area.all().map(|n| [f64::from(n), 0.0]).collect();
        let layers = area.arrows(&vectors, 12.0, 1, " mm");
        let Shape::Arrows(arrows) = &layers[0].shape else { panic!("arrows") };
        assert_eq!(layers[1].label, "longest arrow: 12 mm");
        let lengths: Vec<f64> = arrows.iter().map(|[from, to]| to.0 - from.0).collect();
        assert_eq!(lengths.len(), 12);
        assert!(
            lengths.iter().zip(1..).all(|(l, n)| (l / (0.9 * A * f64::from(n) / 12.0) - 1.0).abs() < 1e-9)
        );
        assert!(area.arrows(&vectors, 0.0, 1, "").is_empty());
        // At the edges they are moved into the map, whichever way they point.
        let half = 0.5 * area.spacing_mm;
        let last = [area.contacts.columns(), area.contacts.rows()]
            .map(|count| f64::from(count - 1) * area.spacing_mm + half);
        for vector in [[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
            let layers = area.arrows(&[vector; 12], 0.5, 1, "");
            let Shape::Arrows(arrows) = &layers[0].shape else { panic!("arrows") };
            for (x, y) in arrows.iter().flatten() {
                assert!(
                    (-half..=last[0]).contains(x) && (-half..=last[1]).contains(y),
                    "{vector:?}: {x} {y}"
                );
            }
        }
    }

    #[test]
    fn the_driven_rows_are_marked() {
        let drive = area().drive.unwrap();
        let y: Vec<f64> = drive.points().iter().map(|point| (point.1 / A * 2.0).round()).collect();
        assert_eq!((drive.label.as_str(), y), ("driven edge", vec![-1.0, -1.0, 5.0, 5.0]));
        let refused = Area::of(&made_up::run("", &[])).unwrap_err();
        assert!(refused.contains("run test lie in a single row (accepted: a run over an area"), "{refused}");
    }

    #[test]
    fn edges_are_joined_to_lines() {
        assert_eq!(joined(&[[3, 4], [1, 2], [2, 3]], |n| n), [[1, 2, 3, 4]]);
        assert_eq!(joined(&[[1, 2], [2, 3], [3, 1]], |n| n), [[1, 2, 3, 1]]);
        assert!(joined::<u32, u32>(&[], |n| n).is_empty());
    }
}
