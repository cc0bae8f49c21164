//! Panels that share their axes, and beside them what the colours say.

use std::path::Path;

use plotters::element::{Circle, Polygon, Rectangle};
use plotters::prelude::{BitMapBackend, IntoDrawingArea, RGBColor, WHITE};
use plotters::style::Color;

use super::colours::viridis;
use super::scale::Scale;
use crate::figures::plot::{
    Area, Dash, FRAME_WIDTH, GREY, INK, LABEL_TEXT, LINE_WIDTH, Marker, PANEL, Picture, TICK_TEXT, mark,
    stroke,
};
use crate::figures::text::{self, Align};

/// Something in a panel, in values of its axes.
#[derive(Debug, Clone)]
pub(crate) enum Item {
    /// A line.
    Line(Vec<(f64, f64)>, Dash, RGBColor),
    /// A surface in a paler colour: so much of it, from 0 to 1.
    Surface(Vec<(f64, f64)>, RGBColor, f64),
    /// Hollow marks.
    Marks(Vec<(f64, f64)>, Marker, RGBColor),
    /// Filled discs with this radius, in pixels.
    Discs(Vec<(f64, f64)>, i32, RGBColor),
    /// A rectangle between two corners.
    Cell((f64, f64), (f64, f64), RGBColor),
    /// A grey cross: runs that are not there.
    Crossed((f64, f64)),
    /// Small words in the middle of this point, or reading upwards from it.
    Words((f64, f64), String, bool),
}

/// A panel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Panel {
    pub(crate) title: String,
    /// From back to front.
    pub(crate) items: Vec<Item>,
}

/// What stands beside a row of the key.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Sample {
    Line(Dash, RGBColor),
    LineAndMarks(Dash, Marker, RGBColor),
    Marks(Marker, RGBColor),
    Surface(RGBColor, f64),
    Empty,
    Crossed,
    /// Words alone.
    Nothing,
}

/// A colour bar.
#[derive(Debug, Clone)]
pub(crate) struct Bar {
    pub(crate) scale: Scale,
    /// How much of the colour scale is in use.
    pub(crate) span: f64,
}

/// Where the key stands in the rectangle of a sheet.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Key {
    /// At the right, with so many pixels.
    Beside(i32),
    /// At the foot, with room for so many rows, without a colour bar.
    Below(i32),
}

/// A sheet of panels.
#[derive(Debug, Clone)]
pub(crate) struct Paper {
    pub(crate) title: String,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    pub(crate) panels: Vec<Panel>,
    pub(crate) bar: Option<Bar>,
    /// Above the rows.
    pub(crate) heading: String,
    pub(crate) rows: Vec<(Sample, String)>,
}

/// Pixels of a panel that stands beside others.
const SMALL_PANEL: (i32, i32) = (1050, 900);

/// Pixels about a panel, for its numbers and labels.
const LEFT: i32 = 220;
const RIGHT: i32 = 40;
const BELOW: i32 = 165;
const ABOVE: i32 = 50;
const TITLE: i32 = 90;

/// The key: its rows, the samples in them, and the colour bar.
const ROW: i32 = 64;
const SAMPLE: i32 = 100;
const PAD: i32 = 28;
const BAR_WIDTH: i32 = 56;

/// Words in a panel, 7 points high.
const SMALL_TEXT: f64 = 29.0;

/// Digits stand a little above the middle of their line.
const LOWER: i32 = 6;

/// About the width of a letter, over the size of the text.
const LETTER: f64 = 0.6;

impl Paper {
    /// Draws it as a PNG into a file that is there.
    pub(crate) fn write(&self, path: &Path) -> Result<(), String> {
        text::embed_font();
        let (width, height) = self.size();
        let root = BitMapBackend::new(path, (width as u32, height as u32)).into_drawing_area();
        root.fill(&WHITE).map_err(|error| error.to_string())?;
        self.draw(&root, (0, 0), (width, height), Key::Beside(self.key_width()))?;
        root.present().map_err(|error| error.to_string())
    }

    /// How many panels stand beside and above each other.
    fn columns_and_rows(&self) -> (i32, i32) {
        let columns = match self.panels.len() {
            0 | 1 => 1,
            2..=4 => 2,
            _ => 3,
        };
        let rows = (self.panels.len().max(1) as i32).div_euclid(columns)
            + i32::from(self.panels.len() as i32 % columns != 0);
        (columns, rows)
    }

    fn title_height(&self) -> i32 {
        if self.title.is_empty() { 0 } else { TITLE }
    }

    /// Width and height on a sheet of its own, in pixels.
    fn size(&self) -> (i32, i32) {
        let (columns, rows) = self.columns_and_rows();
        let key = self.key_width();
        let small = if columns == 1 { (PANEL.0 as i32 - key, PANEL.1 as i32) } else { SMALL_PANEL };
        (columns * small.0 + key, self.title_height() + rows * small.1)
    }

    /// Draws it into a rectangle of a picture: its upper left corner, its width and height.
    pub(crate) fn draw(
        &self,
        root: &Area<'_>,
        (left, top): (i32, i32),
        (width, height): (i32, i32),
        key: Key,
    ) -> Result<(), String> {
        let (columns, rows) = self.columns_and_rows();
        let title = self.title_height();
        let (beside, below) = match key {
            Key::Beside(wide) => (wide, 0),
            Key::Below(rows) => (0, ROW * rows),
        };
        let small = ((width - beside) / columns, (height - title - below) / rows);
        let middle = (left + columns * small.0 / 2 + LEFT / 2, top + 20 + TITLE / 2);
        fitted(root, &self.title, middle, LABEL_TEXT, width - 2 * PAD, false)?;
        for (n, panel) in self.panels.iter().enumerate() {
            let (column, row) = (n as i32 % columns, n as i32 / columns);
            let above = if panel.title.is_empty() { ABOVE } else { TITLE };
            let low = (left + column * small.0 + LEFT, top + title + row * small.1 + above);
            let high = (left + (column + 1) * small.0 - RIGHT, top + title + (row + 1) * small.1 - BELOW);
            self.panel(root, panel, low, high)?;
        }
        match key {
            Key::Beside(_) => {
                let above = if columns == 1 { ABOVE } else { TITLE };
                let at = (left + columns * small.0 + PAD, top + title + above);
                self.key(root, at, top + height - BELOW)
            }
            Key::Below(_) => self.key(root, (left + LEFT, top + height - below), top + height),
        }
    }

    /// How wide the key is beside the panels, in pixels.
    pub(crate) fn key_width(&self) -> i32 {
        let letters = |text: &str| {
            (text.chars().filter(|c| !"{}_^".contains(*c)).count() as f64 * TICK_TEXT * LETTER) as i32
        };
        let rows = self.rows.iter().map(|(_, text)| SAMPLE + PAD + letters(text)).max().unwrap_or(0);
        let bar = self.bar.as_ref().map_or(0, |bar| {
            let ticks = bar.scale.ticks();
            let widest = ticks.iter().map(|tick| letters(&tick.label)).max().unwrap_or(0);
            BAR_WIDTH + 30 + widest + 90
        });
        let heading = letters(&self.heading);
        match rows.max(bar).max(heading) {
            0 => 0,
            widest => widest + 2 * PAD,
        }
    }

    fn panel(&self, root: &Area<'_>, panel: &Panel, low: (i32, i32), high: (i32, i32)) -> Result<(), String> {
        let pixel = |(x, y): (f64, f64)| -> Option<(i32, i32)> {
            let across = self.x.share(x)? * f64::from(high.0 - low.0);
            let down = (1.0 - self.y.share(y)?) * f64::from(high.1 - low.1);
            Some((low.0 + across.round() as i32, low.1 + down.round() as i32))
        };
        for item in &panel.items {
            draw(root, item, &pixel)?;
        }
        let frame = vec![low, (high.0, low.1), high, (low.0, high.1), low];
        stroke(root, frame, Dash::Solid, INK, FRAME_WIDTH)?;
        let across = |share: f64| low.0 + (share * f64::from(high.0 - low.0)).round() as i32;
        let upwards = |share: f64| high.1 - (share * f64::from(high.1 - low.1)).round() as i32;
        let mut free_from = i32::MIN;
        for tick in self.x.ticks() {
            let Some(x) = self.x.share(tick.at).map(across) else { continue };
            stroke(root, vec![(x, high.1), (x, high.1 + 14)], Dash::Solid, INK, FRAME_WIDTH)?;
            let half = text::label_width(root, &tick.label, TICK_TEXT)? / 2;
            if x - half >= free_from {
                text::draw(root, &tick.label, (x, high.1 + 44), TICK_TEXT, Align::Center, false)?;
                free_from = x + half + 20;
            }
        }
        for tick in self.y.ticks() {
            let Some(y) = self.y.share(tick.at).map(upwards) else { continue };
            stroke(root, vec![(low.0 - 14, y), (low.0, y)], Dash::Solid, INK, FRAME_WIDTH)?;
            let width = text::label_width(root, &tick.label, TICK_TEXT)?;
            text::draw(root, &tick.label, (low.0 - 24 - width, y + LOWER), TICK_TEXT, Align::Left, false)?;
        }
        for x in self.x.between_ticks().into_iter().filter_map(|value| self.x.share(value).map(across)) {
            stroke(root, vec![(x, high.1), (x, high.1 + 8)], Dash::Solid, INK, FRAME_WIDTH)?;
        }
        for y in self.y.between_ticks().into_iter().filter_map(|value| self.y.share(value).map(upwards)) {
            stroke(root, vec![(low.0 - 8, y), (low.0, y)], Dash::Solid, INK, FRAME_WIDTH)?;
        }
        let middle = ((low.0 + high.0) / 2, (low.1 + high.1) / 2);
        let (wide, tall) = (high.0 - low.0 + RIGHT, high.1 - low.1);
        fitted(root, &panel.title, (middle.0, low.1 - 40), LABEL_TEXT, wide, false)?;
        fitted(root, &self.x.label(), (middle.0, high.1 + 112), LABEL_TEXT, wide, false)?;
        fitted(root, &self.y.label(), (low.0 - LEFT + 45, middle.1), LABEL_TEXT, tall, true)
    }

    fn key(&self, root: &Area<'_>, (left, top): (i32, i32), bottom: i32) -> Result<(), String> {
        let heading = i32::from(!self.heading.is_empty());
        let below = ROW * (self.rows.len() as i32 + heading);
        let mut y = top + ROW / 2;
        if let Some(bar) = &self.bar {
            let end = (bottom - below - if below > 0 { PAD } else { 0 }).min(top + 1000);
            self.bar(root, bar, (left, top), end)?;
            y = end + PAD + ROW / 2;
        }
        text::draw(root, &self.heading, (left, y), TICK_TEXT, Align::Left, false)?;
        y += ROW * heading;
        for (sample, label) in &self.rows {
            sample.draw(root, (left, y))?;
            text::draw(root, label, (left + SAMPLE + PAD, y + LOWER), TICK_TEXT, Align::Left, false)?;
            y += ROW;
        }
        Ok(())
    }

    fn bar(&self, root: &Area<'_>, bar: &Bar, (left, top): (i32, i32), bottom: i32) -> Result<(), String> {
        for y in top..bottom {
            let share = f64::from(bottom - 1 - y) / f64::from((bottom - top).max(1));
            let row =
                Rectangle::new([(left, y), (left + BAR_WIDTH, y + 1)], viridis(bar.span * share).filled());
            root.draw(&row).map_err(|error| error.to_string())?;
        }
        let right = left + BAR_WIDTH;
        let frame = vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
        stroke(root, frame, Dash::Solid, INK, FRAME_WIDTH)?;
        let place = |share: f64| bottom - (share * f64::from(bottom - top)).round() as i32;
        let mut widest = 0;
        for tick in bar.scale.ticks() {
            let Some(y) = bar.scale.share(tick.at).map(place) else { continue };
            stroke(root, vec![(right, y), (right + 12, y)], Dash::Solid, INK, FRAME_WIDTH)?;
            text::draw(root, &tick.label, (right + 24, y + LOWER), TICK_TEXT, Align::Left, false)?;
            widest = widest.max(text::label_width(root, &tick.label, TICK_TEXT)?);
        }
        for y in bar.scale.between_ticks().into_iter().filter_map(|value| bar.scale.share(value).map(place)) {
            stroke(root, vec![(right, y), (right + 7, y)], Dash::Solid, INK, FRAME_WIDTH)?;
        }
        let beside = (right + 24 + widest + 48, (top + bottom) / 2);
        fitted(root, &bar.scale.label(), beside, LABEL_TEXT, bottom - top, true)
    }
}

/// Draws a label in the middle of a place, smaller if it would be longer than that allows.
fn fitted(
    root: &Area<'_>,
    label: &str,
    at: (i32, i32),
    size: f64,
    longest: i32,
    upward: bool,
) -> Result<(), String> {
    let width = text::label_width(root, label, size)?;
    let size = if width > longest { size * f64::from(longest) / f64::from(width) } else { size };
    text::draw(root, label, at, size, Align::Center, upward)
}

fn draw(
    root: &Area<'_>,
    item: &Item,
    pixel: &dyn Fn((f64, f64)) -> Option<(i32, i32)>,
) -> Result<(), String> {
    let failed = |error: plotters::drawing::DrawingAreaErrorKind<_>| format!("{error}");
    match item {
        Item::Line(points, dash, color) => {
            let places: Vec<Option<(i32, i32)>> = points.iter().map(|point| pixel(*point)).collect();
            for piece in places.split(Option::is_none).filter(|piece| piece.len() > 1) {
                let mut path: Vec<(i32, i32)> = piece.iter().copied().flatten().collect();
                path.dedup();
                if *dash == Dash::Solid {
                    pen(root, &path, *color)?;
                } else {
                    stroke(root, path, *dash, *color, LINE_WIDTH)?;
                }
            }
        }
        Item::Surface(outline, color, strength) => {
            let outline: Vec<(i32, i32)> = outline.iter().filter_map(|point| pixel(*point)).collect();
            if outline.len() > 2 {
                root.draw(&Polygon::new(outline, color.mix(*strength).filled())).map_err(failed)?;
            }
        }
        Item::Marks(points, marker, color) => {
            for point in points.iter().filter_map(|point| pixel(*point)) {
                mark(root, point, *marker, *color)?;
            }
        }
        Item::Discs(points, radius, color) => {
            for point in points.iter().filter_map(|point| pixel(*point)) {
                root.draw(&Circle::new(point, *radius, color.filled())).map_err(failed)?;
            }
        }
        Item::Cell(low, high, color) => {
            if let (Some(low), Some(high)) = (pixel(*low), pixel(*high)) {
                root.draw(&Rectangle::new([low, high], color.filled())).map_err(failed)?;
            }
        }
        Item::Words(point, words, upward) => {
            let Some((x, y)) = pixel(*point) else { return Ok(()) };
            let half = if *upward { text::label_width(root, words, SMALL_TEXT)? / 2 } else { 0 };
            text::draw(root, words, (x, y - half), SMALL_TEXT, Align::Center, *upward)?;
        }
        Item::Crossed(point) => {
            if let Some(point) = pixel(*point) {
                mark(root, point, Marker::Cross, GREY)?;
            }
        }
    }
    Ok(())
}

/// Draws a line as a pen does, by discs close to one another: as thick in all directions.
fn pen(root: &Area<'_>, path: &[(i32, i32)], color: RGBColor) -> Result<(), String> {
    let disc = |at: (i32, i32)| {
        let disc = Circle::new(at, LINE_WIDTH as i32 / 2, color.filled());
        root.draw(&disc).map_err(|error| error.to_string())
    };
    for ends in path.windows(2) {
        let (dx, dy) = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
        let steps = dx.abs().max(dy.abs()).max(1);
        let part = |d: i32, n: i32| (f64::from(d) * f64::from(n) / f64::from(steps)).round() as i32;
        (0..=steps).try_for_each(|n| disc((ends[0].0 + part(dx, n), ends[0].1 + part(dy, n))))?;
    }
    Ok(())
}

impl Sample {
    fn draw(self, root: &Area<'_>, (left, y): (i32, i32)) -> Result<(), String> {
        let line = vec![(left, y), (left + SAMPLE, y)];
        let middle = (left + SAMPLE / 2, y);
        let (low, high) = ((left + SAMPLE / 4, y - 22), (left + SAMPLE * 3 / 4, y + 22));
        let frame = vec![low, (high.0, low.1), high, (low.0, high.1), low];
        match self {
            Sample::Line(dash, color) => stroke(root, line, dash, color, LINE_WIDTH),
            Sample::LineAndMarks(dash, marker, color) => {
                stroke(root, line, dash, color, LINE_WIDTH)?;
                mark(root, middle, marker, color)
            }
            Sample::Marks(marker, color) => mark(root, middle, marker, color),
            Sample::Surface(color, strength) => {
                let surface = Rectangle::new([low, high], color.mix(strength).filled());
                root.draw(&surface).map_err(|error| error.to_string())
            }
            Sample::Empty => stroke(root, frame, Dash::Solid, INK, 2),
            Sample::Crossed => mark(root, middle, Marker::Cross, GREY),
            Sample::Nothing => Ok(()),
        }
    }
}

impl Picture for Paper {
    fn write(&self, path: &Path) -> Result<(), String> {
        Paper::write(self, path)
    }
}
