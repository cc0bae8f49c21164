//! Legends: in a corner of their panel where they hide nothing, else below all panels, once for all.

use super::lines::within;
use super::plot::{Area, Corner, Dash, Frame, INK, LINE_WIDTH, Look, Panel, TICK_TEXT, line, mark_at};
use super::print::canvas;
use super::print::page::{Colour, Item, Paint, Point, Role, circle};
use super::text::{self, Align, Label};

const ROW: f64 = 60.0;
const SAMPLE: f64 = 110.0;
const PAD: f64 = 28.0;
/// Between entries that stand side by side.
const GAP: f64 = 56.0;
/// What is left free between a legend and data.
const CLEAR: f64 = 14.0;

/// A row: words, and all the looks that they stand for. A note has no looks.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    label: String,
    looks: Vec<Look>,
}

impl Row {
    fn width(&self) -> f64 {
        let sample = if self.looks.is_empty() { 0.0 } else { SAMPLE + PAD };
        sample + text::label_width(&self.label, TICK_TEXT)
    }

    fn draw(&self, root: &Area<'_>, (left, y): Point) -> Result<(), String> {
        for look in &self.looks {
            let across = vec![(left, y), (left + SAMPLE, y)];
            let middle = (left + SAMPLE / 2.0, y);
            match *look {
                Look::Line(dash, color) => {
                    line(root, Role::Sample, across, dash, color, f64::from(LINE_WIDTH))?;
                }
                Look::Marks(marker, color) => mark_at(root, Role::Sample, middle, marker, color)?,
                Look::Impulses(color) => line(root, Role::Sample, across, Dash::Solid, color, 2.0)?,
                Look::Dots(color, _) => {
                    let plotters::prelude::RGBColor(r, g, b) = color;
                    let paint = Paint::Fill(Colour { rgb: (r, g, b), strength: 1.0 });
                    let path = circle(middle, 5.0);
                    canvas::draw(root, Item { role: Role::Sample, text: String::new(), path, paint })?;
                }
            }
        }
        let beside = if self.looks.is_empty() { left } else { left + SAMPLE + PAD };
        let label = Label {
            text: &self.label,
            size: TICK_TEXT,
            align: Align::Left,
            upward: false,
            colour: INK,
            role: Role::Legend,
        };
        text::put(root, label, (beside, y))
    }
}

/// The rows of a panel: its note, and its labels. Series of one label share a row, marks on their line.
fn rows(panel: &Panel) -> Vec<Row> {
    let note = Row { label: panel.note.clone(), looks: Vec::new() };
    let mut rows: Vec<Row> = if panel.note.is_empty() { Vec::new() } else { vec![note] };
    let mut series: Vec<_> = panel.series.iter().filter(|series| !series.label.is_empty()).collect();
    // Lines lie below their marks, in the legend as well.
    series.sort_by_key(|series| matches!(series.look, Look::Marks(..)));
    for label in panel.series.iter().map(|series| &series.label).filter(|label| !label.is_empty()) {
        if rows.iter().any(|row| row.label == *label && !row.looks.is_empty()) {
            continue;
        }
        let mut looks: Vec<Look> = Vec::new();
        for series in series.iter().filter(|series| series.label == *label) {
            if !looks.contains(&series.look) {
                looks.push(series.look);
            }
        }
        rows.push(Row { label: label.clone(), looks });
    }
    rows
}

/// Where a legend of this size stands in a corner: left, top.
fn stand(corner: Corner, frame: &Frame, (width, height): Point) -> Point {
    let left = match corner {
        Corner::TopLeft => frame.left + PAD,
        Corner::TopRight | Corner::BottomRight => frame.right - PAD - width,
    };
    let top = match corner {
        Corner::TopLeft | Corner::TopRight => frame.top + PAD / 2.0,
        Corner::BottomRight => frame.bottom - PAD / 2.0 - height,
    };
    (left, top)
}

fn size(rows: &[Row]) -> Point {
    (rows.iter().map(Row::width).fold(0.0, f64::max), ROW * rows.len() as f64)
}

/// Whether something in a panel is between two places.
fn is_hidden(panel: &Panel, frame: &Frame, low: Point, high: Point) -> bool {
    let inside = |&(x, y): &Point| (low.0..=high.0).contains(&x) && (low.1..=high.1).contains(&y);
    panel.series.iter().any(|series| match series.look {
        Look::Line(..) => {
            let paths = panel.paths(frame, &series.points);
            paths.iter().any(|path| path.windows(2).any(|ends| within(ends[0], ends[1], low, high).is_some()))
        }
        Look::Impulses(_) => series.points.iter().any(|&(x, y)| {
            let stem = [(x, panel.y.from.max(0.0)), (x, y)].map(|point| frame.place(panel, point));
            within(stem[0], stem[1], low, high).is_some()
        }),
        Look::Marks(..) | Look::Dots(..) => {
            series.points.iter().any(|point| inside(&frame.place(panel, *point)))
        }
    })
}

/// In which corner of each panel its legend stands; in none where it would hide something, and in none
/// of a sheet on which several panels have the same legend.
pub(super) fn corners(panels: &[Panel], frames: &[Frame]) -> Vec<Option<Corner>> {
    let all: Vec<Vec<Row>> = panels.iter().map(rows).collect();
    let is_shared = |n: usize| !all[n].is_empty() && all.iter().filter(|rows| **rows == all[n]).count() > 1;
    let is_one_for_all = panels.len() > 2 || (0..panels.len()).any(is_shared);
    let corner = |n: usize| {
        if is_one_for_all || all[n].is_empty() {
            return None;
        }
        let size = size(&all[n]);
        let corners = [panels[n].legend, Corner::TopRight, Corner::TopLeft, Corner::BottomRight];
        corners.into_iter().find(|corner| {
            let (left, top) = stand(*corner, &frames[n], size);
            let low = (left - CLEAR, top - CLEAR / 2.0);
            let high = (left + size.0 + CLEAR, top + size.1 + CLEAR / 2.0);
            let fits = left > frames[n].left && top > frames[n].top && top + size.1 < frames[n].bottom;
            fits && !is_hidden(&panels[n], &frames[n], low, high)
        })
    };
    (0..panels.len()).map(corner).collect()
}

/// Draws the legend of a panel into a corner.
pub(super) fn inside(root: &Area<'_>, panel: &Panel, frame: &Frame, corner: Corner) -> Result<(), String> {
    let rows = rows(panel);
    let (left, top) = stand(corner, frame, size(&rows));
    let mut y = top + ROW / 2.0;
    for row in rows {
        row.draw(root, (left, y))?;
        y += ROW;
    }
    Ok(())
}

/// The legend below all panels: lines of entries side by side.
pub(super) struct Outside {
    lines: Vec<Vec<Row>>,
}

impl Outside {
    /// Of the panels that have none in a corner, no wider than this.
    pub(super) fn of(panels: &[Panel], corners: &[Option<Corner>], width: f64) -> Outside {
        let mut all: Vec<Row> = Vec::new();
        for (panel, _) in panels.iter().zip(corners).filter(|(_, corner)| corner.is_none()) {
            for row in rows(panel) {
                if !all.contains(&row) {
                    all.push(row);
                }
            }
        }
        let mut lines: Vec<Vec<Row>> = Vec::new();
        let mut free = 0.0;
        for row in all {
            let taken = row.width() + GAP;
            match lines.last_mut() {
                Some(line) if taken - GAP <= free => line.push(row),
                _ => {
                    free = width;
                    lines.push(vec![row]);
                }
            }
            free -= taken;
        }
        Outside { lines }
    }

    pub(super) fn height(&self) -> u32 {
        let rows = self.lines.len() as f64 * ROW;
        if self.lines.is_empty() { 0 } else { (rows + PAD) as u32 }
    }

    pub(super) fn draw(&self, root: &Area<'_>, left: f64, top: f64) -> Result<(), String> {
        let mut y = top + ROW / 2.0;
        for line in &self.lines {
            let mut x = left;
            for row in line {
                row.draw(root, (x, y))?;
                x += row.width() + GAP;
            }
            y += ROW;
        }
        Ok(())
    }
}
