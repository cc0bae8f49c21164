//! Panels that share their axes, and beside them what the colours say.

use std::sync::Arc;

use plotters::element::{Circle, Polygon, Rectangle};
use plotters::prelude::{IntoDrawingArea, RGBColor, WHITE};
use plotters::style::Color;

use super::colours::Colours;
use crate::draw::axes::{self, Ruler};
use crate::draw::lines::thinned;
use crate::draw::plot::{
    Area, Dash, Frame, GREY, INK, Keys, LINE_WIDTH, Layout, Marker, PANEL, Picture, SMALL_PANEL, Sheet,
    TICK_TEXT, Told, filled, line, mark, mark_at, nothing, stroke,
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
    /// Black lines with white edges, which stay visible on all colours.
    Contours(Vec<Vec<(f64, f64)>>),
    /// Arrows from one point to another, likewise.
    Arrows(Vec<[(f64, f64); 2]>),
}

impl Item {
    /// Whether it has no point at all.
    fn is_empty(&self) -> bool {
        match self {
            Item::Line(points, ..)
            | Item::Surface(points, ..)
            | Item::Marks(points, ..)
            | Item::Discs(points, ..) => points.is_empty(),
            Item::Contours(lines) => lines.is_empty(),
            Item::Arrows(arrows) => arrows.is_empty(),
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
    /// At the foot, rows side by side in lines of the width of the panels, without a colour bar.
    InLines,
    /// In lines, with the colour bar at the right, with this width in pixels.
    BarBeside(i32),
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
    /// Whether panels stand close together, with numbers at the outer ones alone, and the key below them.
    pub(crate) is_close: bool,
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

/// Pixels at the left of a panel and below it where panels stand close together, and the height up to
/// which they stand in one column, or two.
const CLOSE: (i32, i32) = (40, 24);
const CLOSE_HEIGHT: f64 = 1500.0;

/// What their numbers need across, and those of their colour bar upwards, in pixels.
const CLOSE_NUMBERS: (f64, f64) = (130.0, 40.0);

/// Lines with edges: colour and width in pixels of the edge, and of the line upon it.
const EDGED: [(RGBColor, f64); 2] = [(WHITE, 8.0), (INK, 3.0)];

/// Heads of arrows, in pixels, and the shortest arrow.
const ARROW_HEAD: f64 = 17.0;
const SHORTEST_ARROW: f64 = 3.0;

/// What a number upwards needs, in pixels.
const ROW_OF_NUMBERS: f64 = 60.0;

/// The key: its rows, the samples in them, and the colour bar.
const ROW: i32 = 64;
const SAMPLE: i32 = 100;
const PAD: i32 = 28;
/// Between rows that stand side by side.
const GAP: i32 = 56;
const BAR_WIDTH: i32 = 56;

/// Words in a panel, 7 points high.
const SMALL_TEXT: f64 = 29.0;

impl Paper {
    /// Without title, shape, bar and heading.
    pub(crate) fn new(x: Scale, y: Scale, panels: Vec<Panel>, rows: Vec<(Sample, String)>) -> Paper {
        let (title, heading) = (String::new(), String::new());
        Paper { title, x, y, panels, shape: None, is_close: false, bar: None, heading, rows }
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
            count if self.is_close => self.close_columns(count as i32),
            2..=8 => 2,
            _ => 3,
        };
        let rows = (self.panels.len().max(1) as i32).div_euclid(columns)
            + i32::from(self.panels.len() as i32 % columns != 0);
        (columns, rows)
    }

    /// As few columns of panels as leave the sheet no taller than wide.
    fn close_columns(&self, count: i32) -> i32 {
        let shape = self.shape.unwrap_or(1.0);
        let is_low = |columns: &i32| {
            let wide = f64::from(PANEL.0) / f64::from(*columns);
            f64::from((count + columns - 1) / columns) * (shape * wide + f64::from(TITLE)) < CLOSE_HEIGHT
        };
        (1..3).find(is_low).unwrap_or(3)
    }

    /// What is free at the left of each panel and below it, for its numbers and labels.
    fn about_panel(&self) -> (i32, i32) {
        if self.is_close { CLOSE } else { (LEFT, BELOW) }
    }

    fn title_height(&self) -> i32 {
        if self.title.is_empty() { 0 } else { TITLE }
    }

    /// Width and height on a sheet of its own, in pixels.
    fn size(&self, key: Key) -> (i32, i32) {
        let (columns, rows) = self.columns_and_rows();
        let (left, below) = self.about_panel();
        let key = if let Key::Beside(key) | Key::BarBeside(key) = key { key } else { 0 };
        let small = match columns {
            1 => (PANEL.0 as i32 - key - (LEFT - left), PANEL.1 as i32),
            _ if self.is_close => ((PAGE_WIDTH - key - (LEFT - left)) / columns, SMALL_PANEL.1 as i32),
            2 => ((PAGE_WIDTH - key) / 2, SMALL_PANEL.1 as i32),
            _ => (SMALL_PANEL.0 as i32, SMALL_PANEL.1 as i32),
        };
        let is_titled = self.panels.iter().any(|panel| !panel.title.is_empty());
        let about = below + if is_titled { TITLE } else { ABOVE };
        let tall = |shape: f64| (shape * f64::from(small.0 - left - RIGHT)).round() as i32 + about;
        let height = self.shape.map_or(small.1, tall);
        (columns * small.0 + key + (LEFT - left), self.title_height() + rows * height + (BELOW - below))
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
        let in_lines = || ROW * self.key_lines(width).len() as i32;
        let (beside, below) = match key {
            Key::Beside(wide) => (wide, 0),
            Key::Below(rows) => (0, ROW * rows),
            Key::InLines => (0, in_lines()),
            Key::BarBeside(wide) => (wide, in_lines()),
        };
        let about = self.about_panel();
        // What only the outer panels have.
        let outer = (LEFT - about.0, BELOW - about.1);
        let small = ((width - beside - outer.0) / columns, (height - title - below - outer.1) / rows);
        let middle = float((left + columns * small.0 / 2 + LEFT / 2, top + 20 + TITLE / 2));
        // Close panels are wide, and their title may be as long as the page.
        let beside_middle = f64::from(left + width) - middle.0.max(f64::from(2 * left + width) - middle.0);
        let longest = if self.is_close { 2.0 * beside_middle } else { f64::from(width) } - f64::from(2 * PAD);
        axes::label(root, &self.title, middle, longest, false)?;
        for (n, panel) in self.panels.iter().enumerate() {
            let (column, row) = (n as i32 % columns, n as i32 / columns);
            let above = if panel.title.is_empty() { ABOVE } else { TITLE };
            let low = (left + outer.0 + column * small.0 + about.0, top + title + row * small.1 + above);
            let right = left + outer.0 + (column + 1) * small.0 - RIGHT;
            let high = (right, top + title + (row + 1) * small.1 - about.1);
            let is_lowest = n + columns as usize >= self.panels.len();
            let has_numbers = [is_lowest || !self.is_close, column == 0 || !self.is_close];
            self.panel(root, panel, (low, high), has_numbers)?;
        }
        match key {
            Key::Beside(_) => {
                let above = if columns == 1 { ABOVE } else { TITLE };
                let at = (left + columns * small.0 + PAD, top + title + above);
                self.key(root, at, top + height - BELOW)
            }
            Key::Below(_) => self.key(root, (left + LEFT, top + height - below), top + height),
            Key::InLines | Key::BarBeside(_) => {
                if let (Key::BarBeside(_), Some(bar)) = (key, &self.bar) {
                    let is_titled = self.panels.iter().any(|panel| !panel.title.is_empty());
                    let above = if is_titled { TITLE } else { ABOVE };
                    let at = (left + outer.0 + columns * small.0 + PAD, top + title + above);
                    let end = top + height - below - BELOW;
                    self.bar(root, bar, at, end.min(at.1 + 1000))?;
                }
                let lines = self.key_lines(width);
                lines.iter().zip(1..).try_for_each(|(line, n)| {
                    let y = top + height - below + ROW * n - ROW / 2;
                    line.iter().try_for_each(|(x, (sample, label))| sample.row(root, label, (left + x, y)))
                })
            }
        }
    }

    /// The rows of the key side by side, in lines that fit below panels of this width, each with its place
    /// across.
    fn key_lines(&self, width: i32) -> Vec<Vec<(i32, &(Sample, String))>> {
        let mut lines: Vec<Vec<(i32, &(Sample, String))>> = Vec::new();
        let mut x = width;
        for row in &self.rows {
            let taken = row.0.width() + text::label_width(&row.1, TICK_TEXT).ceil() as i32;
            if x + taken > width - RIGHT {
                lines.push(Vec::new());
                x = LEFT;
            }
            lines.last_mut().expect("the first row begins a line").push((x, row));
            x += taken + GAP;
        }
        lines
    }

    /// How wide the key is beside the panels, in pixels.
    pub(crate) fn key_width(&self) -> i32 {
        let width = |text: &str| text::label_width(text, TICK_TEXT).ceil() as i32;
        let rows = self.rows.iter().filter(|_| !self.is_close);
        let rows = rows.map(|(_, text)| SAMPLE + PAD + width(text)).max().unwrap_or(0);
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

    /// Draws a panel between two corners, with numbers and labels across and upwards if it has them.
    fn panel(
        &self,
        root: &Area<'_>,
        panel: &Panel,
        (low, high): ((i32, i32), (i32, i32)),
        [has_across, has_upwards]: [bool; 2],
    ) -> Result<(), String> {
        let place = |(x, y): (f64, f64)| -> Option<Point> {
            let across = self.x.share(x)? * f64::from(high.0 - low.0);
            let down = (1.0 - self.y.share(y)?) * f64::from(high.1 - low.1);
            Some((f64::from(low.0) + across, f64::from(low.1) + down))
        };
        let cells: Vec<_> = panel.items.iter().filter_map(|item| cell(item, &place)).collect();
        raster(root, &cells)?;
        let frame = frame(low, high);
        let levels: Vec<f64> =
            panel.items.iter().filter_map(level).filter_map(|at| Some(place(at)?.1)).collect();
        for item in &panel.items {
            match item {
                Item::Words(at, words, true) => upright(root, words, place(*at), &frame, &levels)?,
                _ => draw(root, item, &place)?,
            }
        }
        if panel.items.iter().all(Item::is_empty) {
            nothing(root, &frame)?;
        }
        let ruler = |scale| Ruler { scale, ticks: Scale::ticks(scale) };
        let mut upwards = ruler(&self.y);
        if self.shape.is_some() {
            // A panel may be low.
            upwards.ticks = self.y.ticks_at_most((f64::from(high.1 - low.1) / ROW_OF_NUMBERS).min(7.0));
        }
        let mut across = ruler(&self.x);
        if self.is_close {
            across.ticks = self.x.ticks_at_most((f64::from(high.0 - low.0) / CLOSE_NUMBERS.0).min(9.0));
        }
        for (ruler, has_numbers) in [(&mut across, has_across), (&mut upwards, has_upwards)] {
            if !has_numbers {
                ruler.ticks.iter_mut().for_each(|tick| tick.label.clear());
            }
        }
        axes::draw(root, &frame, &across, &upwards)?;
        let (middle, between) = ((frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0);
        let (wide, tall) = (f64::from(high.0 - low.0 + RIGHT), f64::from(high.1 - low.1));
        axes::label(root, &panel.title, (middle, frame.top - 40.0), wide, false)?;
        if has_across {
            axes::label(root, &self.x.label(), (middle, frame.bottom + 112.0), wide, false)?;
        }
        if has_upwards {
            axes::label(root, &self.y.label(), (frame.left - f64::from(LEFT - 45), between), tall, true)?;
        }
        Ok(())
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
        let room = f64::from(bottom - top) / CLOSE_NUMBERS.1;
        let ticks = if self.is_close { bar.scale.ticks_at_most(room.min(7.0)) } else { bar.scale.ticks() };
        let ruler = Ruler { scale: &bar.scale, ticks };
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

/// The left end of a line across a panel; none of anything else.
fn level(item: &Item) -> Option<(f64, f64)> {
    match item {
        Item::Line(points, ..) if points.len() == 2 && points[0].1 == points[1].1 => Some(points[0]),
        _ => None,
    }
}

/// What words leave free about themselves, in pixels.
const CLEAR: f64 = 7.0;

/// Where words of this length that read upwards begin, so that they cross neither the frame nor a level:
/// as near to this place as may be, and above it. None where there is no room.
fn clear_of(levels: &[f64], frame: &Frame, (x, y): Point, length: f64) -> Option<Point> {
    let half = SMALL_TEXT / 2.0 + CLEAR;
    let x = x.max(frame.left + half).min(frame.right - half);
    let mut y = y.min(frame.bottom - CLEAR);
    let mut upwards: Vec<f64> = levels.to_vec();
    upwards.sort_by(|a, b| b.total_cmp(a));
    for level in upwards {
        if (y - length - CLEAR..y + CLEAR).contains(&level) {
            y = level - CLEAR;
        }
    }
    (y - length - CLEAR >= frame.top).then_some((x, y))
}

/// Draws words that read upwards from a place.
fn upright(
    root: &Area<'_>,
    words: &str,
    at: Option<Point>,
    frame: &Frame,
    levels: &[f64],
) -> Result<(), String> {
    let length = text::label_width(words, SMALL_TEXT);
    let clear = at.and_then(|at| clear_of(levels, frame, at, length));
    let Some((x, y)) = clear.map(pixel) else { return Ok(()) };
    let half = (length / 2.0).round() as i32;
    text::draw(root, words, (x, y - half), SMALL_TEXT, Align::Center, true)
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
        Item::Contours(lines) => {
            let paths: Vec<Vec<Point>> =
                lines.iter().map(|line| line.iter().filter_map(|point| place(*point)).collect()).collect();
            // All edges below all lines, so that none crosses another line.
            for (color, width) in EDGED {
                for path in paths.iter().filter(|path| path.len() > 1) {
                    line(root, Role::Data, path.clone(), Dash::Solid, color, width)?;
                }
            }
        }
        Item::Arrows(arrows) => {
            for [from, to] in arrows {
                if let (Some(from), Some(to)) = (place(*from), place(*to)) {
                    arrow(root, from, to)?;
                }
            }
        }
        // All of a panel are one picture.
        Item::Cell(..) => {}
        Item::Words(point, words, upward) => {
            let Some(at) = pixel(*point) else { return Ok(()) };
            text::draw(root, words, at, SMALL_TEXT, Align::Center, *upward)?;
        }
        Item::Crossed(point) => {
            if let Some(point) = place(*point) {
                mark_at(root, Role::Data, point, Marker::Cross, GREY)?;
            }
        }
    }
    Ok(())
}

/// Draws an arrow with a white edge; one that is too short to have a direction is left out.
fn arrow(root: &Area<'_>, from: Point, to: Point) -> Result<(), String> {
    let (x, y) = (to.0 - from.0, to.1 - from.1);
    let length = (x * x + y * y).sqrt();
    if length < SHORTEST_ARROW {
        return Ok(());
    }
    let (x, y) = (x / length, y / length);
    let head = (0.5 * length).min(ARROW_HEAD);
    for (color, width) in EDGED {
        // The edge reaches as far beyond the head as beside the shaft.
        let edge = (width - EDGED[1].1) / 2.0;
        let (tip, foot) = (length + 2.0 * edge, length - head - edge);
        let half = 0.42 * head + 1.5 * edge;
        let at = |along: f64, aside: f64| (from.0 + x * along - y * aside, from.1 + y * along + x * aside);
        line(
            root,
            Role::Data,
            vec![at(-edge, 0.0), at(length - head / 2.0, 0.0)],
            Dash::Solid,
            color,
            width,
        )?;
        filled(root, Role::Data, page::around(&[at(tip, 0.0), at(foot, half), at(foot, -half)]), color)?;
    }
    Ok(())
}

impl Sample {
    /// What it takes before its words, in a line of rows.
    fn width(self) -> i32 {
        match self {
            Sample::Nothing => 0,
            Sample::Line(..) | Sample::LineAndMarks(..) => SAMPLE + PAD,
            _ => SAMPLE / 2 + PAD,
        }
    }

    /// Draws it with its words, in a line of rows.
    fn row(self, root: &Area<'_>, label: &str, (left, y): (i32, i32)) -> Result<(), String> {
        // A mark or a surface is in the middle of its sample.
        let is_narrow = self.width() < SAMPLE;
        self.draw(root, (if is_narrow { left - SAMPLE / 4 } else { left }, y))?;
        words(root, label, (left + self.width(), y))
    }

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
    fn page(&self, layout: Layout<'_>) -> Result<Page, String> {
        let beside = Key::Beside(self.key_width());
        let is_below = layout.keys == Keys::Below && self.bar.is_none() && self.heading.is_empty();
        let key = match beside {
            Key::Beside(width) if self.is_close => Key::BarBeside(width),
            _ if is_below => Key::InLines,
            beside => beside,
        };
        let (width, mut height) = self.size(key);
        let mut free = 0;
        if (is_below || self.is_close) && !self.rows.is_empty() {
            height += ROW * self.key_lines(width).len() as i32;
            free = PAD;
        }
        let mut page = Page::new(width as u32, (height + free) as u32 + layout.foot_height());
        {
            let root = Canvas(&mut page).into_drawing_area();
            self.draw(&root, (0, 0), (width, height), key)?;
            let at = (f64::from(LEFT), f64::from(height + free));
            layout.footer(&root, at, f64::from(width - LEFT - RIGHT))?;
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

#[cfg(test)]
mod tests {
    use super::{CLEAR, Frame, Key, Keys, Layout, Paper, Picture, SMALL_TEXT, Sample, clear_of};
    use crate::draw::plot::{Dash, INK};
    use crate::draw::scale::Scale;

    /// Numbers of ruptures were crossed by the line of the friction coefficient and by the frame.
    #[test]
    fn words_cross_neither_frames_nor_levels() {
        let frame = Frame { left: 100.0, top: 100.0, right: 900.0, bottom: 900.0 };
        let of = |levels: &[f64], at| clear_of(levels, &frame, at, 60.0);
        assert_eq!(of(&[], (500.0, 500.0)), Some((500.0, 500.0)));
        // Below the words, through them, and one above the other.
        assert_eq!(of(&[520.0], (500.0, 500.0)), Some((500.0, 500.0)));
        assert_eq!(of(&[470.0], (500.0, 500.0)), Some((500.0, 470.0 - CLEAR)));
        assert_eq!(of(&[430.0, 470.0], (500.0, 500.0)), Some((500.0, 430.0 - CLEAR)));
        let half = SMALL_TEXT / 2.0 + CLEAR;
        assert_eq!(of(&[], (899.0, 500.0)), Some((900.0 - half, 500.0)));
        assert_eq!(of(&[], (100.0, 500.0)), Some((100.0 + half, 500.0)));
        assert_eq!((of(&[], (500.0, 150.0)), of(&[130.0], (500.0, 180.0))), (None, None));
    }

    /// A key below takes lines, and none of the width.
    #[test]
    fn keys_below_leave_the_width_to_the_panels() {
        let scale = |label: &str| Scale::between(label, 0.0, 1.0);
        let row = |n: usize| (Sample::Line(Dash::Solid, INK), format!("a row of the key, number {n}"));
        let paper =
            |rows: usize| Paper::single(scale("x"), scale("y"), Vec::new(), (0..rows).map(row).collect());
        assert_eq!(paper(0).key_lines(1800).len(), 0);
        let lines = paper(5).key_lines(1800).iter().map(Vec::len).collect::<Vec<usize>>();
        assert_eq!(lines, [2, 2, 1]);
        let with_nothing = Paper { rows: vec![(Sample::Nothing, "words".to_owned()), row(1)], ..paper(0) };
        assert_eq!(with_nothing.key_lines(1800)[0][0].0, super::LEFT);
        let beside = paper(1).size(Key::Beside(paper(1).key_width()));
        assert_eq!(beside, paper(1).size(Key::InLines));
        let page = |keys| paper(1).page(Layout { foot: None, keys }).unwrap();
        assert!(page(Keys::Below).height > page(Keys::Beside).height + 50);
        assert_eq!(page(Keys::Below).width, page(Keys::Beside).width);
    }
}
