//! Panels that share their axes, and beside them what the colours say.

use std::sync::Arc;

use plotters::element::{Circle, Polygon, Rectangle};
use plotters::prelude::{IntoDrawingArea, RGBColor};
use plotters::style::Color;

use super::colours::Colours;
use crate::draw::axes::{self, Ruler};
use crate::draw::lines::thinned;
use crate::draw::plot::{
    Area, Dash, Frame, GREY, INK, LINE_WIDTH, Marker, PANEL, Picture, SMALL_PANEL, Sheet, TICK_TEXT, Told,
    foot_height, footer, line, mark, mark_at, nothing, stroke,
};
use crate::draw::print::canvas::{self, Canvas};
use crate::draw::print::page::{self, Page, Point, Role};
use crate::draw::print::raster::{Pixel, Raster, Rgb};
use crate::draw::scale::Scale;
use crate::draw::text::{self, Align, Label};

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

impl Item {
    /// Whether it has no point at all.
    fn is_empty(&self) -> bool {
        match self {
            Item::Line(points, ..)
            | Item::Surface(points, ..)
            | Item::Marks(points, ..)
            | Item::Discs(points, ..) => points.is_empty(),
            Item::Cell(..) | Item::Crossed(_) | Item::Words(..) => false,
        }
    }
}

/// A panel.
#[derive(Debug, Clone, Default)]
pub(crate) struct Panel {
    pub(crate) title: String,
    /// From back to front, but for cells, which are behind everything else.
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

/// Where the key stands in the rectangle of a sheet.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Key {
    /// At the right, with this width in pixels.
    Beside(i32),
    /// At the foot, with room for this many rows, without a colour bar.
    Below(i32),
}

/// A sheet of panels.
#[derive(Debug, Clone)]
pub(crate) struct Paper {
    pub(crate) title: String,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    pub(crate) panels: Vec<Panel>,
    /// Height of a panel over its width, where both axes have the same unit; else as there is room.
    pub(crate) shape: Option<f64>,
    /// What the colour bar shows.
    pub(crate) bar: Option<Colours>,
    /// Above the rows.
    pub(crate) heading: String,
    pub(crate) rows: Vec<(Sample, String)>,
}

/// Pixels of a page of two columns, on which letters keep their size.
const PAGE_WIDTH: i32 = 2250;

/// Pixels about a panel, for its numbers and labels.
const LEFT: i32 = 220;
const RIGHT: i32 = 40;
const BELOW: i32 = 165;
const ABOVE: i32 = 50;
const TITLE: i32 = 90;

/// What a number upwards needs, in pixels.
const ROW_OF_NUMBERS: f64 = 60.0;

/// The key: its rows, the samples in them, and the colour bar.
const ROW: i32 = 64;
const SAMPLE: i32 = 100;
const PAD: i32 = 28;
const BAR_WIDTH: i32 = 56;

/// Words in a panel, 7 points high.
const SMALL_TEXT: f64 = 29.0;

impl Paper {
    /// Without title, shape, bar and heading.
    pub(crate) fn new(x: Scale, y: Scale, panels: Vec<Panel>, rows: Vec<(Sample, String)>) -> Paper {
        Paper { title: String::new(), x, y, panels, shape: None, bar: None, heading: String::new(), rows }
    }

    /// One panel, from back to front.
    pub(crate) fn single(x: Scale, y: Scale, items: Vec<Item>, rows: Vec<(Sample, String)>) -> Paper {
        Paper::new(x, y, vec![Panel { title: String::new(), items }], rows)
    }

    /// It with a title, as a figure of runs.
    pub(crate) fn sheet(self, title: &str) -> Sheet {
        Sheet::Other(Arc::new(Paper { title: title.to_owned(), ..self }))
    }

    /// How many panels stand beside and above each other.
    fn columns_and_rows(&self) -> (i32, i32) {
        let columns = match self.panels.len() {
            0 | 1 => 1,
            2..=8 => 2,
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
        let small = match columns {
            1 => (PANEL.0 as i32 - key, PANEL.1 as i32),
            2 => ((PAGE_WIDTH - key) / 2, SMALL_PANEL.1 as i32),
            _ => (SMALL_PANEL.0 as i32, SMALL_PANEL.1 as i32),
        };
        let is_titled = self.panels.iter().any(|panel| !panel.title.is_empty());
        let about = BELOW + if is_titled { TITLE } else { ABOVE };
        let tall = |shape: f64| (shape * f64::from(small.0 - LEFT - RIGHT)).round() as i32 + about;
        let height = self.shape.map_or(small.1, tall);
        (columns * small.0 + key, self.title_height() + rows * height)
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
        let middle = float((left + columns * small.0 / 2 + LEFT / 2, top + 20 + TITLE / 2));
        axes::label(root, &self.title, middle, f64::from(width - 2 * PAD), false)?;
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
        let width = |text: &str| text::label_width(text, TICK_TEXT).ceil() as i32;
        let rows = self.rows.iter().map(|(_, text)| SAMPLE + PAD + width(text)).max().unwrap_or(0);
        let bar = self.bar.as_ref().map_or(0, |bar| {
            let ticks = bar.scale.ticks();
            let widest = ticks.iter().map(|tick| width(&tick.label)).max().unwrap_or(0);
            BAR_WIDTH + 30 + widest + 90
        });
        let heading = width(&self.heading);
        match rows.max(bar).max(heading) {
            0 => 0,
            widest => widest + 2 * PAD,
        }
    }

    fn panel(&self, root: &Area<'_>, panel: &Panel, low: (i32, i32), high: (i32, i32)) -> Result<(), String> {
        let place = |(x, y): (f64, f64)| -> Option<Point> {
            let across = self.x.share(x)? * f64::from(high.0 - low.0);
            let down = (1.0 - self.y.share(y)?) * f64::from(high.1 - low.1);
            Some((f64::from(low.0) + across, f64::from(low.1) + down))
        };
        let cells: Vec<_> = panel.items.iter().filter_map(|item| cell(item, &place)).collect();
        raster(root, &cells)?;
        for item in &panel.items {
            draw(root, item, &place)?;
        }
        let frame = frame(low, high);
        if panel.items.iter().all(Item::is_empty) {
            nothing(root, &frame)?;
        }
        let ruler = |scale| Ruler { scale, ticks: Scale::ticks(scale) };
        let mut upwards = ruler(&self.y);
        if self.shape.is_some() {
            // A panel may be low.
            upwards.ticks = self.y.ticks_at_most((f64::from(high.1 - low.1) / ROW_OF_NUMBERS).min(7.0));
        }
        axes::draw(root, &frame, &ruler(&self.x), &upwards)?;
        let (middle, between) = ((frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0);
        let (wide, tall) = (f64::from(high.0 - low.0 + RIGHT), f64::from(high.1 - low.1));
        axes::label(root, &panel.title, (middle, frame.top - 40.0), wide, false)?;
        axes::label(root, &self.x.label(), (middle, frame.bottom + 112.0), wide, false)?;
        axes::label(root, &self.y.label(), (frame.left - f64::from(LEFT - 45), between), tall, true)
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
        words(root, &self.heading, (left, y))?;
        y += ROW * heading;
        for (sample, label) in &self.rows {
            sample.draw(root, (left, y))?;
            words(root, label, (left + SAMPLE + PAD, y))?;
            y += ROW;
        }
        Ok(())
    }

    fn bar(
        &self,
        root: &Area<'_>,
        bar: &Colours,
        (left, top): (i32, i32),
        bottom: i32,
    ) -> Result<(), String> {
        let row = |y: i32| {
            let share = f64::from(bottom - 1 - y) / f64::from(bottom - top);
            ((left, y), (left + BAR_WIDTH, y + 1), bar.at(share).rgb())
        };
        raster(root, &(top..bottom).map(row).collect::<Vec<_>>())?;
        let frame = frame((left, top), (left + BAR_WIDTH, bottom));
        let ruler = Ruler { scale: &bar.scale, ticks: bar.scale.ticks() };
        let reach = axes::draw_at_the_right(root, &frame, &ruler)?;
        let beside = (frame.right + reach + 48.0, (frame.top + frame.bottom) / 2.0);
        axes::label(root, &bar.scale.label(), beside, frame.bottom - frame.top, true)
    }
}

/// A frame between two corners.
fn frame(low: (i32, i32), high: (i32, i32)) -> Frame {
    let ((left, top), (right, bottom)) = (float(low), float(high));
    Frame { left, top, right, bottom }
}

fn float((x, y): (i32, i32)) -> Point {
    (f64::from(x), f64::from(y))
}

/// Draws words of the key.
fn words(root: &Area<'_>, text: &str, at: (i32, i32)) -> Result<(), String> {
    let role = Role::Legend;
    text::put(
        root,
        Label { text, size: TICK_TEXT, align: Align::Left, upward: false, colour: INK, role },
        float(at),
    )
}

/// The page's pixel at a place.
fn pixel((x, y): Point) -> Pixel {
    (x.round() as i32, y.round() as i32)
}

/// The pixels of a cell; none of what is no cell.
fn cell(item: &Item, place: &dyn Fn((f64, f64)) -> Option<Point>) -> Option<(Pixel, Pixel, Rgb)> {
    let Item::Cell(low, high, color) = item else { return None };
    let ((left, bottom), (right, top)) = (pixel(place(*low)?), pixel(place(*high)?));
    // With a pixel more at the right and below, the shortest slips are seen on a page that is made smaller.
    Some(((left, top), (right + 1, bottom + 1), color.rgb()))
}

/// Draws cells as one picture.
fn raster(root: &Area<'_>, cells: &[(Pixel, Pixel, Rgb)]) -> Result<(), String> {
    Raster::of(cells).map_or(Ok(()), |raster| canvas::draw(root, page::Item::of_raster(Role::Data, raster)))
}

fn draw(root: &Area<'_>, item: &Item, place: &dyn Fn((f64, f64)) -> Option<Point>) -> Result<(), String> {
    let failed = |error: plotters::drawing::DrawingAreaErrorKind<_>| format!("{error}");
    // Surfaces meet without a seam where their corners are pixels.
    let pixel = |point: (f64, f64)| place(point).map(pixel);
    match item {
        Item::Line(points, dash, color) => {
            let places: Vec<Option<Point>> = points.iter().map(|point| place(*point)).collect();
            for piece in places.split(Option::is_none).filter(|piece| piece.len() > 1) {
                let path: Vec<Point> = piece.iter().copied().flatten().collect();
                line(root, Role::Data, thinned(&path), *dash, *color, f64::from(LINE_WIDTH))?;
            }
        }
        Item::Surface(outline, color, strength) => {
            let outline: Vec<(i32, i32)> = outline.iter().filter_map(|point| pixel(*point)).collect();
            if outline.len() > 2 {
                root.draw(&Polygon::new(outline, color.mix(*strength).filled())).map_err(failed)?;
            }
        }
        Item::Marks(points, marker, color) => {
            for point in points.iter().filter_map(|point| place(*point)) {
                mark_at(root, Role::Data, point, *marker, *color)?;
            }
        }
        Item::Discs(points, radius, color) => {
            for point in points.iter().filter_map(|point| pixel(*point)) {
                root.draw(&Circle::new(point, *radius, color.filled())).map_err(failed)?;
            }
        }
        // All of a panel are one picture.
        Item::Cell(..) => {}
        Item::Words(point, words, upward) => {
            let Some((x, y)) = pixel(*point) else { return Ok(()) };
            let half = if *upward { (text::label_width(words, SMALL_TEXT) / 2.0).round() as i32 } else { 0 };
            text::draw(root, words, (x, y - half), SMALL_TEXT, Align::Center, *upward)?;
        }
        Item::Crossed(point) => {
            if let Some(point) = place(*point) {
                mark_at(root, Role::Data, point, Marker::Cross, GREY)?;
            }
        }
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
    fn page(&self, foot: Option<&str>) -> Result<Page, String> {
        let (width, height) = self.size();
        let mut page = Page::new(width as u32, height as u32 + foot_height(foot));
        {
            let root = Canvas(&mut page).into_drawing_area();
            self.draw(&root, (0, 0), (width, height), Key::Beside(self.key_width()))?;
            if let Some(foot) = foot {
                footer(&root, foot, (f64::from(LEFT), f64::from(height)), f64::from(width - LEFT - RIGHT))?;
            }
        }
        Ok(page)
    }

    fn told(&self) -> Told {
        let titles = std::iter::once(&self.title).chain(self.panels.iter().map(|panel| &panel.title));
        let bar = self.bar.iter().map(|bar| bar.scale.label());
        Told {
            titles: titles.cloned().collect(),
            upwards: vec![self.y.label()],
            across: vec![self.x.label()],
            labels: self.rows.iter().map(|(_, label)| label.clone()).chain(bar).collect(),
            notes: vec![self.heading.clone()],
        }
    }
}
