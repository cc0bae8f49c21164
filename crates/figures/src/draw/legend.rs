//! Legends: in a corner of their panel where they hide nothing, else below all panels, once for all.

use plotters::prelude::RGBColor;
use plotters_backend::text_anchor::HPos;

use super::chart::Frame;
use super::ink::LINE_WIDTH;
use super::lines::within;
use super::print::page::{Page, Paint, Point, Role, Segment, around, bounds, circle};
use super::sheet::{Dash, INK, Layer, Marker, Panel, Shape};
use super::text::{self, Label, TICK_TEXT};

const ROW: f64 = 60.0;
const SAMPLE: f64 = 110.0;
const PAD: f64 = 28.0;
/// Between entries that stand side by side.
const GAP: f64 = 56.0;
/// What is left free between a legend and data.
const CLEAR: f64 = 14.0;

/// What a row shows of a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sample {
    Line(Dash, f64),
    Mark(Marker),
    Disc,
    Surface(f64),
    Cell,
}

impl Sample {
    fn of(layer: &Layer) -> Option<(Sample, RGBColor)> {
        let sample = match layer.shape {
            Shape::Line(_, dash) => Sample::Line(dash, LINE_WIDTH),
            Shape::Contours(_) | Shape::Arrows(_) => Sample::Line(Dash::Solid, LINE_WIDTH),
            Shape::Stems(_) => Sample::Line(Dash::Solid, LINE_WIDTH / 2.0),
            Shape::Marks(_, marker) => Sample::Mark(marker),
            Shape::Discs(..) => Sample::Disc,
            Shape::Surface(_, strength) => Sample::Surface(strength),
            Shape::Cells(_) => Sample::Cell,
            Shape::Words(..) | Shape::Remark => return None,
        };
        Some((sample, layer.colour))
    }
}

/// A row: words, and samples of all the layers that they stand for. A remark has none.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    label: String,
    samples: Vec<(Sample, RGBColor)>,
}

impl Row {
    /// What its samples take, and the room behind them.
    fn indent(&self) -> f64 {
        match &self.samples[..] {
            [] => 0.0,
            samples if samples.iter().any(|(sample, _)| matches!(sample, Sample::Line(..))) => SAMPLE + PAD,
            _ => SAMPLE / 2.0 + PAD,
        }
    }

    fn width(&self) -> f64 {
        self.indent() + text::label_width(&self.label, TICK_TEXT)
    }

    /// Draws it, with words that are smaller where the row would be longer than this.
    fn draw(&self, page: &mut Page, (left, y): Point, longest: f64) {
        let to = left + self.indent() - PAD;
        let middle = ((left + to) / 2.0, y);
        let (left_side, right_side) = (middle.0 - SAMPLE / 4.0, middle.0 + SAMPLE / 4.0);
        let square = Frame { left: left_side, top: y - 22.0, right: right_side, bottom: y + 22.0 };
        for (sample, colour) in &self.samples {
            let role = Role::SAMPLE;
            match sample {
                Sample::Line(dash, width) => page.line(role, &[(left, y), (to, y)], *dash, *colour, *width),
                Sample::Mark(marker) => page.mark(role, middle, *marker, *colour),
                Sample::Disc => page.fill(role, circle(middle, 8.0), *colour, 1.0),
                Sample::Surface(strength) => page.fill(role, around(&square.corners()), *colour, *strength),
                Sample::Cell => {
                    page.fill(role, around(&square.corners()), *colour, 1.0);
                    let [a, b, c, d] = square.corners();
                    page.line(role, &[a, b, c, d, a], Dash::Solid, INK, 1.0);
                }
            }
        }
        let label =
            Label { size: TICK_TEXT, align: HPos::Left, role: Role::LEGEND, ..Label::of(&self.label) };
        text::put(page, label.at_most(longest - self.indent()), (left + self.indent(), y));
    }
}

/// The rows of a panel. Layers of one label share a row, marks on their line.
fn rows(panel: &Panel) -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for layer in panel.layers.iter().filter(|layer| !layer.label.is_empty()) {
        let at = rows.iter().position(|row| row.label == layer.label).unwrap_or_else(|| {
            rows.push(Row { label: layer.label.clone(), samples: Vec::new() });
            rows.len() - 1
        });
        let samples = &mut rows[at].samples;
        samples.extend(Sample::of(layer).filter(|sample| !samples.contains(sample)));
        samples.sort_by_key(|(sample, _)| !matches!(sample, Sample::Line(..)));
    }
    rows
}

/// The legends of the panels of a sheet.
pub(super) struct Legend {
    /// Of each panel, what may stand in it.
    rows: Vec<Vec<Row>>,
    /// What stands below all panels: lines of rows side by side, no wider than this.
    below: Vec<Row>,
    pub(super) width: f64,
}

impl Legend {
    /// Of these panels: below them, if `is_below`, if there are more than two, or if several have the same.
    pub(super) fn of(panels: &[Panel], is_below: bool, width: f64) -> Legend {
        let rows: Vec<Vec<Row>> = panels.iter().map(rows).collect();
        let is_shared =
            |of: &Vec<Row>| !of.is_empty() && rows.iter().filter(|other| *other == of).count() > 1;
        let is_below = is_below || panels.len() > 2 || rows.iter().any(is_shared);
        let mut legend = Legend { rows, below: Vec::new(), width };
        (0..if is_below { panels.len() } else { 0 }).for_each(|n| legend.put_below(n));
        legend
    }

    /// Puts the rows of a panel below, each once.
    fn put_below(&mut self, n: usize) {
        for row in std::mem::take(&mut self.rows[n]) {
            if !self.below.contains(&row) {
                self.below.push(row);
            }
        }
    }

    /// Draws that of a panel into a corner in which it hides nothing of what the page has from an item on, or puts it
    /// below if there is none.
    pub(super) fn put(&mut self, page: &mut Page, n: usize, from: usize, frame: &Frame) {
        let rows = &self.rows[n];
        let (width, height) = (rows.iter().map(Row::width).fold(0.0, f64::max), ROW * rows.len() as f64);
        let fits = width + 2.0 * PAD <= frame.right - frame.left && height + PAD <= frame.bottom - frame.top;
        let (left, right) = (frame.left + PAD, frame.right - PAD - width);
        let (top, bottom) = (frame.top + PAD / 2.0, frame.bottom - PAD / 2.0 - height);
        let corners = [(right, top), (left, top), (right, bottom), (left, bottom)];
        let is_free = |(left, top): &Point| {
            let low = (left - CLEAR, top - CLEAR / 2.0);
            let high = (left + width + CLEAR, top + height + CLEAR / 2.0);
            fits && !is_hidden(page, from, low, high)
        };
        match corners.into_iter().find(is_free) {
            Some((left, top)) => {
                for (n, row) in rows.iter().enumerate() {
                    row.draw(page, (left, top + ROW * (n as f64 + 0.5)), width);
                }
            }
            None => self.put_below(n),
        }
    }

    /// What stands below, each row with its line and its place across.
    fn places(&self) -> Vec<(usize, f64, &Row)> {
        let (mut line, mut x) = (0, 0.0);
        let mut places = Vec::new();
        for row in &self.below {
            if x > 0.0 && x + row.width() > self.width {
                (line, x) = (line + 1, 0.0);
            }
            places.push((line, x, row));
            x += row.width() + GAP;
        }
        places
    }

    /// The height of what stands below.
    pub(super) fn height_below(&self) -> f64 {
        self.places().last().map_or(0.0, |(line, ..)| ROW * (*line as f64 + 1.0) + PAD)
    }

    pub(super) fn draw_below(&self, page: &mut Page, left: f64, top: f64) {
        for (line, x, row) in self.places() {
            row.draw(page, (left + x, top + ROW * (line as f64 + 0.5)), self.width - x);
        }
    }
}

/// Whether data among the items of a page from one on are between two places.
fn is_hidden(page: &Page, from: usize, low: Point, high: Point) -> bool {
    page.items[from..].iter().filter(|item| item.role == Role::DATA).any(|item| {
        // Each outline begins with a move.
        let outlines = item.path.chunk_by(|_, next| !matches!(next, Segment::Move(_)));
        outlines.into_iter().any(|outline| match &item.paint {
            Paint::Stroke { .. } => outline.windows(2).any(|pair| match (end(pair[0]), end(pair[1])) {
                (Some(a), Some(b)) => within(a, b, low, high).is_some(),
                _ => false,
            }),
            Paint::Fill(_) | Paint::Raster(_) => {
                bounds(outline).is_some_and(|((left, top), (right, bottom))| {
                    left <= high.0 && low.0 <= right && top <= high.1 && low.1 <= bottom
                })
            }
        })
    })
}

fn end(segment: Segment) -> Option<Point> {
    match segment {
        Segment::Move(to) | Segment::Line(to) | Segment::Curve(.., to) => Some(to),
        Segment::Close => None,
    }
}
