//! Lays out the panels of a sheet, their axes and legends, and draws them.

use plotters::prelude::IntoDrawingArea;

use super::axes::{self, BESIDE_TICK, Ruler, TICK};
use super::legend::{self, Outside};
use super::plot::{
    Area, Corner, Dash, Frame, LINE_WIDTH, Layout, Look, PANEL, Panel, SMALL_PANEL, Series, Sheet, TICK_TEXT,
    Told, filled, line, mark_at, nothing,
};
use super::print::canvas::Canvas;
use super::print::page::{Page, Role, circle};
use super::scale::Tick;
use super::text;

/// What stands about a frame: a title above or none, numbers and a label below, a label to the left.
const TITLE: f64 = 84.0;
const NO_TITLE: f64 = 30.0;
const NUMBERS: f64 = 66.0;
const LABEL: f64 = 72.0;
const EDGE: f64 = 20.0;
const RIGHT: f64 = 50.0;

impl Sheet {
    pub(super) fn panels(&self) -> &[Panel] {
        match self {
            Sheet::Single(panel) => std::slice::from_ref(panel),
            Sheet::Stacked(panels) => &panels[..],
            Sheet::Grid(panels) => panels,
            Sheet::Other(_) => &[],
        }
    }

    /// What is written on it.
    pub(super) fn told(&self) -> Told {
        if let Sheet::Other(picture) = self {
            return picture.told();
        }
        let of =
            |text: fn(&Panel) -> &String| self.panels().iter().map(|panel| text(panel).clone()).collect();
        Told {
            titles: of(|panel| &panel.title),
            upwards: of(|panel| &panel.y.label),
            across: of(|panel| &panel.x.label),
            labels: self
                .panels()
                .iter()
                .flat_map(|panel| panel.series.iter().map(|series| series.label.clone()))
                .collect(),
            notes: of(|panel| &panel.note),
        }
    }

    /// Width, height, and the panels' areas: left, top, right, bottom.
    fn areas(&self) -> (u32, u32, Vec<[f64; 4]>) {
        let (width, height) = (f64::from(PANEL.0), f64::from(PANEL.1));
        match self {
            Sheet::Single(_) => (PANEL.0, PANEL.1, vec![[0.0, 0.0, width, height]]),
            Sheet::Stacked(_) => {
                let (whole, cut) = (height * 1.5, height * 0.92);
                (PANEL.0, PANEL.1 * 3 / 2, vec![[0.0, 0.0, width, cut], [0.0, cut, width, whole]])
            }
            Sheet::Grid(panels) => {
                let (wide, tall) = (f64::from(SMALL_PANEL.0), f64::from(SMALL_PANEL.1));
                let area = |n: usize| {
                    let (column, row) = ((n % 2) as f64, (n / 2) as f64);
                    [column * wide, row * tall, (column + 1.0) * wide, (row + 1.0) * tall]
                };
                let columns = panels.len().clamp(1, 2) as u32;
                let rows = panels.len().div_ceil(2).max(1) as u32;
                (SMALL_PANEL.0 * columns, SMALL_PANEL.1 * rows, (0..panels.len()).map(area).collect())
            }
            Sheet::Other(_) => (0, 0, Vec::new()),
        }
    }

    /// Draws the sheet.
    pub(super) fn page(&self, layout: Layout<'_>) -> Result<Page, String> {
        if let Sheet::Other(picture) = self {
            return picture.page(layout);
        }
        let (width, mut height, areas) = self.areas();
        let panels = self.panels();
        let frames = frames(panels, &areas);
        let corners = legend::corners(panels, &frames);
        let left = frames.first().map_or(EDGE, |frame| frame.left);
        let outside = Outside::of(panels, &corners, f64::from(width) - left - RIGHT);
        let below = height;
        height += outside.height();
        let line = height;
        height += layout.foot_height();
        let mut page = Page::new(width, height);
        {
            let root = Canvas(&mut page).into_drawing_area();
            for ((panel, frame), corner) in panels.iter().zip(&frames).zip(&corners) {
                panel.draw(&root, frame, *corner)?;
            }
            outside.draw(&root, left, f64::from(below))?;
            layout.footer(&root, (left, f64::from(line)), f64::from(width) - left - RIGHT)?;
        }
        Ok(page)
    }
}

/// The frames of panels in their areas. They stand below one another, whatever is beside them.
fn frames(panels: &[Panel], areas: &[[f64; 4]]) -> Vec<Frame> {
    let mut frames: Vec<Frame> = panels.iter().zip(areas).map(|(panel, area)| panel.frame(*area)).collect();
    let widest = panels.iter().zip(&frames).map(|(panel, frame)| panel.numbers_width(frame));
    let widest = widest.fold(0.0, f64::max);
    frames.iter_mut().for_each(|frame| frame.left += widest);
    frames
}

impl Panel {
    /// The frame, if the numbers at its left had no width.
    fn frame(&self, [left, top, right, bottom]: [f64; 4]) -> Frame {
        let above = if self.title.is_empty() { NO_TITLE } else { TITLE };
        let label = if self.x.label.is_empty() { 0.0 } else { LABEL };
        Frame {
            left: left + EDGE + LABEL + TICK + BESIDE_TICK,
            top: top + above,
            right: right - RIGHT,
            bottom: bottom - NUMBERS - label - 14.0,
        }
    }

    /// The numbers at the left of a frame.
    fn numbers(&self, frame: &Frame) -> Vec<Tick> {
        self.y.scale().ticks_at_most(((frame.bottom - frame.top) / 75.0).min(8.0))
    }

    fn numbers_width(&self, frame: &Frame) -> f64 {
        let widths = self.numbers(frame).into_iter();
        widths.map(|tick| text::label_width(&tick.label, TICK_TEXT)).fold(0.0, f64::max)
    }

    fn draw(&self, root: &Area<'_>, frame: &Frame, legend: Option<Corner>) -> Result<(), String> {
        for series in &self.series {
            self.draw_series(root, frame, series)?;
        }
        if self.series.iter().all(|series| series.points.is_empty()) {
            nothing(root, frame)?;
        }
        let (x, y) = (self.x.scale(), self.y.scale());
        let (wide, tall) = (frame.right - frame.left, frame.bottom - frame.top);
        let across = Ruler { scale: &x, ticks: x.ticks_at_most((wide / 150.0).min(9.0)) };
        let upwards = Ruler { scale: &y, ticks: self.numbers(frame) };
        axes::draw(root, frame, &across, &upwards)?;
        let (middle, between) = ((frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0);
        let longest = wide + 2.0 * RIGHT;
        axes::label(root, &self.title, (middle, frame.top - TITLE / 2.0), longest, false)?;
        axes::label(root, &x.label(), (middle, frame.bottom + NUMBERS + LABEL / 2.0), longest, false)?;
        let left = frame.left - TICK - BESIDE_TICK - self.numbers_width(frame) - LABEL / 2.0;
        axes::label(root, &y.label(), (left, between), tall, true)?;
        match legend {
            Some(corner) => legend::inside(root, self, frame, corner),
            None => Ok(()),
        }
    }

    fn draw_series(&self, root: &Area<'_>, frame: &Frame, series: &Series) -> Result<(), String> {
        let inside = |&(x, y): &(f64, f64)| self.x.holds(x) && self.y.holds(y);
        match series.look {
            Look::Line(dash, color) => {
                for path in self.paths(frame, &series.points) {
                    line(root, Role::Data, path, dash, color, f64::from(LINE_WIDTH))?;
                }
            }
            Look::Marks(marker, color) => {
                for point in series.points.iter().filter(|point| inside(point)) {
                    mark_at(root, Role::Data, frame.place(self, *point), marker, color)?;
                }
            }
            Look::Impulses(color) => {
                for &(x, y) in series.points.iter().filter(|point| inside(point)) {
                    let stem = [(x, self.y.from.max(0.0)), (x, y)].map(|point| frame.place(self, point));
                    line(root, Role::Data, stem.to_vec(), Dash::Solid, color, 2.0)?;
                }
            }
            Look::Dots(color, radius) => {
                let mut discs = Vec::new();
                let mut last = (f64::NAN, f64::NAN);
                for point in series.points.iter().filter(|point| inside(point)) {
                    let (x, y) = frame.place(self, *point);
                    // What would lie upon the last one is not seen.
                    if (x - last.0).abs() < 0.5 && (y - last.1).abs() < 0.5 {
                        continue;
                    }
                    last = (x, y);
                    discs.extend(circle(last, radius));
                }
                filled(root, Role::Data, discs, color)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::plot::{Axis, Corner, Panel, TICK_TEXT};
    use super::super::text::label_width;
    use super::{BESIDE_TICK, EDGE, LABEL, TICK, frames};

    #[test]
    fn there_is_room_for_numbers_beside_any_frame() {
        // A low panel has fewer numbers than a high one, and they may be longer.
        let panel = |to| Panel {
            title: String::new(),
            x: Axis::new("x", 0.0, 1.0),
            y: Axis::new("y", -0.57, to),
            series: Vec::new(),
            legend: Corner::TopLeft,
            note: String::new(),
        };
        for height in [300.0, 400.0, 500.0, 700.0, 1000.0] {
            let panels = [panel(3.02), panel(30.2), panel(0.2)];
            let areas = panels.each_ref().map(|_| [100.0, 0.0, 800.0, height]);
            for (panel, frame) in panels.iter().zip(frames(&panels, &areas)) {
                let widths = panel.numbers(&frame).into_iter();
                let widest = widths.map(|tick| label_width(&tick.label, TICK_TEXT)).fold(0.0, f64::max);
                let left = frame.left - TICK - BESIDE_TICK - widest - LABEL - EDGE;
                assert!(left >= 100.0 - 1e-9, "{height}: {left}");
            }
        }
    }
}
