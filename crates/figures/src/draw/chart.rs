//! Draws sheets with plotters: sub-areas, coordinates, axes, marks and words.

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::cartesian::Cartesian2d;
use plotters::prelude::IntoDrawingArea;
use plotters::style::{BLACK, Color, FontDesc, FontFamily, FontStyle, RGBColor, TextStyle};
use plotters_backend::text_anchor::HPos;

use super::axis::Axis;
use super::colours::Colours;
use super::ink::{FRAME_WIDTH, LINE_WIDTH};
use super::legend::Legend;
use super::lines::{clipped, thinned};
use super::print::canvas::{Canvas, UNIT, place, units};
use super::print::page::{Item, PER_INCH, Page, Paint, Point, Role, around, circle};
use super::print::raster::{Cell, Raster};
use super::scale::{Scale, Tick};
use super::sheet::{Dash, GREY, INK, Layer, Layout, Panel, Shape, Sheet};
use super::text::{self, Label, TICK_TEXT};

/// Pixels across of a sheet with one column of panels, with two, and with three: 6 inches, and pages of two columns,
/// on which letters keep their size.
const WIDTHS: [f64; 3] = [1800.0, 2250.0, 3300.0];

/// Heights of cells of one column, of the two that stand one above the other, and of more columns.
const NARROWEST: f64 = 700.0;
const TALL: f64 = 1200.0;
const STACKED: [f64; 2] = [1104.0, 696.0];
const LOW: f64 = 860.0;

/// What stands about a frame, in pixels: a title above or none, numbers and a label below, a label to the left.
const TITLE: f64 = 84.0;
const NO_TITLE: f64 = 30.0;
/// What a b is taller than an a, which alone is at the top of one column.
const TALLER: f64 = 4.0;
const NUMBERS: f64 = 66.0;
const LABEL: f64 = 72.0;
const EDGE: f64 = 20.0;
const RIGHT: f64 = 50.0;
/// About what numbers and a label take at the left.
const LEFT: f64 = 200.0;

/// From a frame up to the middle of its panel's letter.
const LETTER: f64 = 15.0;

/// Between panels that stand close together, and the height up to which they stand in one column, or two.
const CLOSE: [f64; 2] = [70.0, 34.0];
const CLOSE_HEIGHT: f64 = 1500.0;

/// Lengths of marks with a number and without; from the end of one to its number.
const MARK: f64 = 13.0;
const SHORT_MARK: f64 = 8.0;
const BESIDE_MARK: f64 = 12.0;

/// The colour bar: its width, its greatest height, and from the panels to it.
const BAR: f64 = 56.0;
const BAR_HEIGHT: f64 = 1000.0;
const BESIDE_PANELS: f64 = 28.0;

/// Words in a panel, 7 points high, and what they leave free about themselves.
const SMALL_TEXT: f64 = 29.0;
const CLEAR: f64 = 7.0;

/// The line at the foot, in a grey that a copier keeps.
const FOOT: f64 = 44.0;
const FOOT_TEXT: f64 = 29.0;
const FOOT_GREY: RGBColor = RGBColor(80, 80, 80);

/// A page of the format A4 upright, its margin, and the rows of its table.
const A4: (f64, f64) = (2480.0, 3508.0);
const MARGIN: f64 = 60.0;
const TABLE_ROW: f64 = 66.0;

/// The frame of a panel or a bar, in pixels of the page.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Frame {
    fn middle(&self) -> f64 {
        (self.left + self.right) / 2.0
    }

    fn width(&self) -> f64 {
        self.right - self.left
    }

    fn height(&self) -> f64 {
        self.bottom - self.top
    }

    /// The places of its corners.
    pub(super) fn corners(&self) -> [Point; 4] {
        let Frame { left, top, right, bottom } = *self;
        [(left, top), (right, top), (right, bottom), (left, bottom)]
    }
}

type Chart<'p, 's> = ChartContext<'static, Canvas<'p>, Cartesian2d<Axis<'s>, Axis<'s>>>;

impl Sheet {
    /// Draws it, with a line at its foot.
    pub(super) fn page(&self, foot: Option<&str>) -> Result<Page, String> {
        let mut page = match &self.layout {
            Layout::Page { wide, beside, numbers } => self.full_page(wide, beside, numbers)?,
            _ => self.drawn(None)?,
        };
        if let Some(text) = foot {
            let (left, y) = (LABEL + EDGE, f64::from(page.height) + FOOT / 3.0);
            let label = Label {
                size: FOOT_TEXT,
                align: HPos::Left,
                colour: FOOT_GREY,
                role: Role::FOOT,
                ..Label::of(text)
            };
            let label = label.at_most(f64::from(page.width) - left - RIGHT);
            page.grow(FOOT);
            text::put(&mut page, label, (left, y));
        }
        Ok(page)
    }

    /// Draws it, in this width and height if they are given.
    fn drawn(&self, size: Option<(f64, f64)>) -> Result<Page, String> {
        let mut panels: Vec<Panel> = self.panels.iter().map(Panel::fitted).collect();
        if panels.is_empty() {
            // It says that there is nothing to draw.
            panels.push(Panel::new(Scale::between("", 0.0, 1.0), Scale::between("", 0.0, 1.0), Vec::new()));
        }
        let columns = self.columns();
        let natural = self.width().unwrap_or(WIDTHS[columns - 1]);
        let width = size.map_or(natural, |size| size.0);
        // On a page of several pictures, legends stand below, where all of them have room.
        let mut legend = Legend::of(&panels, size.is_some(), width - LEFT - RIGHT);
        let height = size.map(|size| size.1 - legend.height_below());
        let (about, _) = self.frames(&panels, LEFT, width, height);
        let numbers: Vec<Vec<Tick>> =
            panels.iter().zip(&about).map(|(panel, frame)| panel.upwards(frame)).collect();
        let left = EDGE + LABEL + widest(numbers.iter().flatten()) + BESIDE_MARK + MARK;
        let (frames, height) = self.frames(&panels, left, width, height);
        legend.width = width - left.max(LEFT) - RIGHT;
        let mut page = Page::new(width.ceil() as u32, height.ceil() as u32);
        for (n, ((panel, frame), numbers)) in panels.iter().zip(&frames).zip(numbers).enumerate() {
            let is_close = matches!(self.layout, Layout::Close(_));
            let has_numbers = [!is_close || n + columns >= panels.len(), !is_close || n % columns == 0];
            let first = page.items.len();
            panel.draw(&mut page, frame, numbers, left, has_numbers)?;
            legend.put(&mut page, n, first, frame);
            if panels.len() > 1 {
                let letter = char::from(b'a' + (n % 26) as u8).to_string();
                let at = (frame.left - if has_numbers[1] { left - EDGE } else { 0.0 }, frame.top - LETTER);
                text::put(&mut page, Label { align: HPos::Left, ..Label::of(&letter) }, at);
            }
        }
        let last = &frames[columns.min(frames.len()) - 1];
        let middle = (frames[0].left + last.right) / 2.0;
        let title = Label::of(&self.title).at_most(2.0 * (width - EDGE - middle).min(middle - EDGE));
        text::put(&mut page, title, (middle, TITLE / 2.0));
        if let Some(bar) = &self.bar {
            let (left, top) = (last.right + BESIDE_PANELS, last.top);
            let bottom = frames[frames.len() - 1].bottom.max(last.bottom).min(top + BAR_HEIGHT);
            bar.draw(&mut page, &Frame { left, top, right: left + BAR, bottom })?;
        }
        let foot = f64::from(page.height);
        page.grow(legend.height_below());
        legend.draw_below(&mut page, frames[0].left, foot);
        Ok(page)
    }

    /// The height of its legend, if it stands below panels of this width.
    fn below(&self, width: f64) -> f64 {
        Legend::of(&self.panels, true, width - LEFT - RIGHT).height_below()
    }

    /// The width that is asked for, in pixels.
    fn width(&self) -> Option<f64> {
        self.width_mm.map(|width_mm| width_mm / 25.4 * PER_INCH)
    }

    /// How many panels stand beside each other.
    fn columns(&self) -> usize {
        // Narrower ones have no room beside their numbers.
        let most = self.width().map_or(3, |width| (width / NARROWEST).clamp(1.0, 3.0) as usize);
        self.usual_columns().min(most)
    }

    fn usual_columns(&self) -> usize {
        match (&self.layout, self.panels.len()) {
            (Layout::Stacked, _) | (_, 0 | 1) => 1,
            (Layout::Close(shape), count) => {
                let is_low = |columns: &usize| {
                    let tall = shape * WIDTHS[0] / *columns as f64 + TITLE;
                    count.div_ceil(*columns) as f64 * tall < CLOSE_HEIGHT
                };
                (1..3).find(is_low).unwrap_or(3)
            }
            (_, 2..=8) => 2,
            _ => 3,
        }
    }

    /// The frames of its panels, with this room for what stands at their left, and the height of all.
    fn frames(&self, panels: &[Panel], left: f64, width: f64, height: Option<f64>) -> (Vec<Frame>, f64) {
        let columns = self.columns();
        let rows = panels.len().div_ceil(columns);
        // A narrower page is lower as well.
        let shorter = self.width().map_or(1.0, |width| (width / WIDTHS[columns - 1]).clamp(0.6, 1.5));
        let title = if self.title.is_empty() { 0.0 } else { TITLE };
        let is_titled = panels.iter().any(|panel| !panel.title.is_empty());
        let above = |row: usize| match row {
            _ if is_titled => TITLE,
            0 if title > 0.0 => 0.0,
            0 if columns > 1 => NO_TITLE + TALLER,
            _ => NO_TITLE,
        };
        let width = width - self.bar.as_ref().map_or(0.0, |bar| BESIDE_PANELS + BAR + bar.room());
        // From one panel to the next, and what the last pixels of that are not its frame.
        let is_close = matches!(self.layout, Layout::Close(_));
        let (all, behind) = match is_close {
            true => (width - left - RIGHT + CLOSE[0], CLOSE[0] - left),
            false => (width, RIGHT),
        };
        let cell = all / columns as f64;
        let place = |column: usize| (column as f64 * cell + left, (column + 1) as f64 * cell - behind);
        let (mut frames, mut top) = (Vec::new(), title);
        for row in 0..rows {
            let of_row = &panels[row * columns..panels.len().min((row + 1) * columns)];
            let below = match of_row.iter().all(|panel| panel.x.label().is_empty()) {
                _ if is_close && row + 1 < rows => CLOSE[1],
                true => NUMBERS,
                false => NUMBERS + LABEL,
            };
            let natural = match (&self.layout, columns) {
                (Layout::Close(shape), _) => above(row) + shape * (place(0).1 - place(0).0) + below,
                (Layout::Tall(height), _) => above(row) + height + below,
                (Layout::Stacked, _) => STACKED[row] * shorter,
                (_, 1) => TALL * shorter,
                _ => LOW * shorter,
            };
            let tall = height.map_or(natural, |height| (height - title) / rows as f64);
            frames.extend((0..of_row.len()).map(|column| {
                let (left, right) = place(column);
                // On half pixels, so that lines of an odd width are sharp.
                let [left, top, right, bottom] =
                    [left, top + above(row), right, top + tall - below].map(|at| at.floor() + 0.5);
                Frame { left, top, right, bottom }
            }));
            top += tall;
        }
        (frames, top)
    }

    /// Draws sheets on a page, one above the other, others side by side below them, and a table of numbers.
    fn full_page(
        &self,
        wide: &[Sheet],
        beside: &[Sheet],
        numbers: &[(String, String)],
    ) -> Result<Page, String> {
        let mut page = Page::new(A4.0 as u32, A4.1 as u32);
        let width = A4.0 - 2.0 * MARGIN;
        let at = (A4.0 / 2.0, MARGIN + TITLE / 2.0);
        text::put(&mut page, Label::of(&self.title).at_most(width), at);
        let rows = numbers.len().div_ceil(2);
        let table = A4.1 - MARGIN - TABLE_ROW * (rows as f64 + 0.5);
        let pictures = (wide.len() + usize::from(!beside.is_empty())).max(1) as f64;
        let (mut top, below) = (MARGIN + 1.5 * TITLE, table - TABLE_ROW / 2.0);
        let height = (below - top) / pictures;
        for sheet in wide {
            page.paste(sheet.drawn(Some((width, height)))?, (MARGIN, top));
            top += height;
        }
        // Side by side, frames are of one height, whatever stands below them.
        let share = width / beside.len().max(1) as f64;
        let below: Vec<f64> = beside.iter().map(|sheet| sheet.below(share)).collect();
        let most = below.iter().copied().fold(0.0, f64::max);
        for (n, (sheet, below)) in beside.iter().zip(below).enumerate() {
            let page_of = sheet.drawn(Some((share, height - most + below)))?;
            page.paste(page_of, (MARGIN + share * n as f64, top));
        }
        for (n, (of, number)) in numbers.iter().enumerate() {
            let (column, row) = (n / rows, n % rows);
            let left = MARGIN + column as f64 * width / 2.0 + EDGE;
            let y = table + TABLE_ROW * (row as f64 + 0.5);
            for (words, left) in [(of, left), (number, left + width * 9.0 / 40.0)] {
                text::put(
                    &mut page,
                    Label { size: TICK_TEXT, align: HPos::Left, ..Label::of(words) },
                    (left, y),
                );
            }
        }
        for y in [table, table + TABLE_ROW * rows as f64] {
            page.line(Role::FRAME, &[(MARGIN, y), (A4.0 - MARGIN, y)], Dash::Solid, INK, 2.0);
        }
        Ok(page)
    }
}

/// The width of the widest number.
fn widest<'a>(numbers: impl Iterator<Item = &'a Tick>) -> f64 {
    numbers.map(|tick| text::label_width(&tick.label, TICK_TEXT)).fold(0.0, f64::max)
}

/// Words of plotters in a role, of this size.
fn style(role: &'static str, size: f64) -> TextStyle<'static> {
    TextStyle::from(FontDesc::new(FontFamily::Name(role), size * UNIT, FontStyle::Normal))
}

/// A chart whose coordinates fill a frame, with room at its left, at its right and below it.
fn chart<'p, 's>(
    page: &'p mut Page,
    frame: &Frame,
    [left, right, below]: [f64; 3],
    x: Axis<'s>,
    y: Axis<'s>,
) -> Result<Chart<'p, 's>, String> {
    let corner = (units(frame.left - left), units(frame.top));
    let size = (units(frame.width() + left + right), units(frame.height() + below));
    let area = Canvas(page).into_drawing_area().shrink(corner, size);
    let mut builder = ChartBuilder::on(&area);
    builder.y_label_area_size(units(left)).right_y_label_area_size(units(right));
    builder.x_label_area_size(units(below)).build_cartesian_2d(x, y).map_err(|error| error.to_string())
}

/// Draws the axes of a chart with their marks and numbers, and what they are called.
fn axes(chart: &mut Chart<'_, '_>, frame: &Frame, [x, y]: [&str; 2]) -> Result<(), String> {
    let fits = |text: &str, longest: f64| Label::of(text).at_most(longest).size;
    let size = fits(x, frame.width() + 2.0 * RIGHT).min(fits(y, frame.height() - 2.0 * LETTER));
    // First the marks with numbers, then those between.
    for (numbers, mark) in [(100, MARK), (0, SHORT_MARK)] {
        let mut mesh = chart.configure_mesh();
        mesh.disable_mesh().axis_style(BLACK.stroke_width(units(FRAME_WIDTH) as u32));
        mesh.x_labels(numbers).y_labels(numbers).set_all_tick_mark_size(units(mark));
        mesh.x_label_style(style("number-across", TICK_TEXT))
            .y_label_style(style("number-upwards", TICK_TEXT));
        mesh.axis_desc_style(style("label", size));
        if numbers > 0 {
            mesh.x_desc(x).y_desc(y);
        }
        mesh.draw().map_err(|error| error.to_string())?;
    }
    Ok(())
}

impl Page {
    fn frame(&mut self, frame: &Frame) {
        let [a, b, c, d] = frame.corners();
        self.line(Role::FRAME, &[a, b, c, d, a], Dash::Solid, INK, FRAME_WIDTH);
    }

    /// Draws cells as one picture.
    fn raster(&mut self, cells: &[Cell]) {
        if let Some(raster) = Raster::of(cells) {
            let ((left, top), (width, height)) = (raster.corner(), raster.size());
            let (right, bottom) = (left + f64::from(width), top + f64::from(height));
            let path = around(&Frame { left, top, right, bottom }.corners());
            self.add(Item::new(Role::DATA, path, Paint::Raster(raster)));
        }
    }
}

impl Colours {
    /// What its numbers and its label take at the right of a bar.
    fn room(&self) -> f64 {
        MARK + BESIDE_MARK + widest(self.scale.ticks_with_ends(7.0).iter()) + LABEL + EDGE
    }

    /// Draws the bar of its colours.
    fn draw(&self, page: &mut Page, frame: &Frame) -> Result<(), String> {
        let (top, bottom) = (frame.top as i32, frame.bottom as i32);
        let row = |y: i32| {
            let colour = self.at(f64::from(bottom - 1 - y) / f64::from(bottom - top));
            ((frame.left as i32, y), (frame.right as i32, y + 1), colour)
        };
        page.raster(&(top..bottom).map(row).collect::<Vec<_>>());
        page.frame(frame);
        let across = Scale::between("", 0.0, 1.0);
        let x = Axis { scale: &across, ticks: Vec::new() };
        let y =
            Axis { scale: &self.scale, ticks: self.scale.ticks_with_ends((frame.height() / 60.0).min(7.0)) };
        let mut chart = chart(page, frame, [0.0, self.room(), 0.0], x, y)?;
        axes(&mut chart, frame, ["", &self.scale.label()])
    }
}

impl Panel {
    /// It with axes that hold its layers.
    pub(super) fn fitted(&self) -> Panel {
        // Surfaces go as far as the axes do.
        let shown = self.layers.iter().filter(|layer| !matches!(layer.shape, Shape::Surface(..)));
        let points: Vec<(f64, f64)> = shown.flat_map(Layer::points).collect();
        let x = self.x.fitted(points.iter().map(|point| point.0));
        // Only what is on the axis across counts upwards.
        let y = self.y.fitted(points.iter().filter(|point| x.share(point.0).is_some()).map(|point| point.1));
        Panel { title: self.title.clone(), x, y, layers: self.layers.clone() }
    }

    /// The numbers at the left of a frame.
    fn upwards(&self, frame: &Frame) -> Vec<Tick> {
        self.y.ticks_at_most((frame.height() / 75.0).min(8.0))
    }

    /// The numbers below a frame, without those that would run into the one before.
    fn across(&self, frame: &Frame) -> Vec<Tick> {
        let mut ticks = self.x.ticks_at_most((frame.width() / 150.0).min(9.0));
        let mut free_from = f64::NEG_INFINITY;
        for tick in &mut ticks {
            let at = self.x.way(tick.at) * frame.width();
            let half = text::label_width(&tick.label, TICK_TEXT) / 2.0;
            if at - half < free_from {
                tick.label.clear();
            } else {
                free_from = at + half + EDGE;
            }
        }
        ticks
    }

    /// Draws it, with numbers and labels across and upwards if it has them.
    fn draw(
        &self,
        page: &mut Page,
        frame: &Frame,
        mut upwards: Vec<Tick>,
        left: f64,
        [has_across, has_upwards]: [bool; 2],
    ) -> Result<(), String> {
        let mut across = self.across(frame);
        for (ticks, has_numbers) in [(&mut across, has_across), (&mut upwards, has_upwards)] {
            if !has_numbers {
                ticks.iter_mut().for_each(|tick| tick.label.clear());
            }
        }
        let (x, y) = (Axis { scale: &self.x, ticks: across }, Axis { scale: &self.y, ticks: upwards });
        let labels = [(has_across, &self.x), (has_upwards, &self.y)]
            .map(|(has, scale)| if has { scale.label() } else { String::new() });
        let left = if has_upwards { left - EDGE } else { MARK + 1.0 };
        let below = match (has_across, labels[0].is_empty()) {
            (false, _) => MARK + 1.0,
            (true, true) => NUMBERS,
            (true, false) => NUMBERS + LABEL,
        };
        let mut in_front = Page::new(page.width, page.height);
        let mut chart = chart(&mut in_front, frame, [left, 0.0, below], x, y)?;
        let (behind, before): (Vec<&Layer>, Vec<&Layer>) =
            self.layers.iter().partition(|layer| matches!(layer.shape, Shape::Cells(_)));
        for layer in behind.into_iter().chain(before) {
            self.layer(page, &|point| place(chart.backend_coord(point)), frame, layer);
        }
        axes(&mut chart, frame, [&labels[0], &labels[1]])?;
        drop(chart);
        page.items.append(&mut in_front.items);
        page.frame(frame);
        let longest = frame.width() + 2.0 * RIGHT;
        text::put(page, Label::of(&self.title).at_most(longest), (frame.middle(), frame.top - TITLE / 2.0));
        if self.is_empty() {
            let label =
                Label { size: TICK_TEXT, colour: GREY, role: Role::LEGEND, ..Label::of("nothing to draw") };
            text::put(page, label, (frame.middle(), (frame.top + frame.bottom) / 2.0));
        }
        Ok(())
    }

    fn is_inside(&self, (x, y): &(f64, f64)) -> bool {
        self.x.share(*x).is_some() && self.y.share(*y).is_some()
    }

    /// Draws a layer; `at` is where a point of the axes is on the page.
    fn layer(&self, page: &mut Page, at: &dyn Fn(&(f64, f64)) -> Point, frame: &Frame, layer: &Layer) {
        let colour = layer.colour;
        let (low, high) = ((frame.left, frame.top), (frame.right, frame.bottom));
        let has_place = |(x, y): &(f64, f64)| self.x.way(*x).is_finite() && self.y.way(*y).is_finite();
        let inside = |points: &[(f64, f64)]| -> Vec<Point> {
            points.iter().filter(|point| self.is_inside(point)).map(at).collect()
        };
        match &layer.shape {
            Shape::Line(points, dash) => {
                for stretch in points.split(|point| !has_place(point)) {
                    let places: Vec<Point> = stretch.iter().map(at).collect();
                    for path in clipped(&thinned(&places), low, high) {
                        page.line(Role::DATA, &path, *dash, colour, LINE_WIDTH);
                    }
                }
            }
            Shape::Marks(points, marker) => {
                inside(points).into_iter().for_each(|place| page.mark(Role::DATA, place, *marker, colour));
            }
            Shape::Discs(points, radius) => {
                let mut discs = Vec::new();
                let mut last = (f64::INFINITY, f64::INFINITY);
                for (x, y) in inside(points) {
                    // What would lie upon the last one is not seen.
                    if (x - last.0).abs() >= 0.5 || (y - last.1).abs() >= 0.5 {
                        last = (x, y);
                        discs.extend(circle(last, *radius));
                    }
                }
                page.fill(Role::DATA, discs, colour, 1.0);
            }
            Shape::Stems(points) => {
                let foot = self.y.ends().0.max(0.0);
                for point in points.iter().filter(|point| self.is_inside(point)) {
                    let stem = [at(&(point.0, foot)), at(point)];
                    page.line(Role::DATA, &stem, Dash::Solid, colour, LINE_WIDTH / 2.0);
                }
            }
            Shape::Surface(outline, strength) => {
                // Surfaces meet without a seam where their corners are pixels.
                let corner = |(x, y): Point| (x.clamp(low.0, high.0).round(), y.clamp(low.1, high.1).round());
                let corners = outline.iter().filter(|point| has_place(point)).map(at).map(corner);
                page.fill(Role::DATA, around(&corners.collect::<Vec<_>>()), colour, *strength);
            }
            Shape::Cells(cells) => {
                let shown = cells.iter().filter(|(corners, _)| corners.iter().all(|at| self.is_inside(at)));
                let cells = shown.map(|(corners, colour)| {
                    let [(left, bottom), (right, top)] = corners.each_ref().map(|corner| {
                        let (x, y) = at(corner);
                        (x.round() as i32, y.round() as i32)
                    });
                    // With a pixel more at the right and below, the shortest slips are seen on a smaller page.
                    ((left, top.min(bottom)), (right + 1, top.max(bottom) + 1), *colour)
                });
                page.raster(&cells.collect::<Vec<_>>());
            }
            Shape::Contours(lines) => {
                page.contours(&lines.iter().map(|line| inside(line)).collect::<Vec<_>>());
            }
            Shape::Arrows(arrows) => {
                for [from, to] in arrows.iter().filter(|ends| ends.iter().all(|end| self.is_inside(end))) {
                    page.arrow(at(from), at(to));
                }
            }
            Shape::Words(point, words) if self.is_inside(point) => {
                let levels: Vec<(f64, f64)> = self.layers.iter().filter_map(level).collect();
                let levels: Vec<f64> = inside(&levels).into_iter().map(|place| place.1).collect();
                let label = Label { size: SMALL_TEXT, upward: true, align: HPos::Left, ..Label::of(words) };
                let length = text::label_width(words, SMALL_TEXT);
                if let Some(place) = clear_of(&levels, frame, at(point), length) {
                    text::put(page, label, place);
                }
            }
            Shape::Words(..) | Shape::Remark => {}
        }
    }
}

/// The left end of a line across a panel; none of anything else.
fn level(layer: &Layer) -> Option<(f64, f64)> {
    match &layer.shape {
        Shape::Line(points, _) if points.len() == 2 && points[0].1 == points[1].1 => Some(points[0]),
        _ => None,
    }
}

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

#[cfg(test)]
mod tests {
    use super::{CLEAR, Frame, SMALL_TEXT, Sheet, clear_of};

    /// As of `stress` with `at_s = []`.
    #[test]
    fn a_sheet_without_panels_says_that_there_is_nothing() {
        let page = Sheet::of(Vec::new()).page(None).unwrap();
        assert!(page.items.iter().any(|item| item.text == "nothing to draw"), "{page:?}");
    }

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
}
