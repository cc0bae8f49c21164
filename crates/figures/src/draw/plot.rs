//! Sheets of panels: axes, curves, marks and legends for all figures.
//!
//! Curves differ by dash and marks by shape, so that a grey print shows what colours do.

use std::sync::Arc;

use plotters::prelude::{BLACK, RGBColor, WHITE};

use super::lines::{clipped, thinned};
use super::print::canvas;
use super::print::page::{Colour, Item, Page, Paint, Point, Role, Segment, around, circle, through};
use super::scale::{Scale, ends, powers};
use super::text::{self, Align, Label};

pub(super) use super::print::canvas::Area;

/// Colours that stay apart for colour-blind eyes and in grey.
pub(super) const INK: RGBColor = BLACK;
pub(super) const BLUE: RGBColor = RGBColor(0, 90, 181);
pub(super) const RED: RGBColor = RGBColor(200, 60, 0);
pub(super) const GREY: RGBColor = RGBColor(130, 130, 130);
pub(super) const GREEN: RGBColor = RGBColor(0, 120, 90);

/// Look of the series number `index` of a figure that holds several of a kind.
pub(super) fn nth(index: usize) -> (Marker, Dash, RGBColor) {
    const LOOKS: [(Marker, Dash, RGBColor); 5] = [
        (Marker::Circle, Dash::Solid, INK),
        (Marker::Triangle, Dash::Dashed, BLUE),
        (Marker::Square, Dash::Dotted, RED),
        (Marker::Cross, Dash::DotDashed, GREY),
        (Marker::Diamond, Dash::LongDashed, GREEN),
    ];
    LOOKS[index % LOOKS.len()]
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dash {
    Solid,
    Dashed,
    Dotted,
    DotDashed,
    LongDashed,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Marker {
    Circle,
    Triangle,
    Square,
    Cross,
    Diamond,
}

/// How points look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Look {
    /// A curve through the points.
    Line(Dash, RGBColor),
    /// A hollow mark at every point.
    Marks(Marker, RGBColor),
    /// A line from zero to every point.
    Impulses(RGBColor),
    /// A disc with this radius, in pixels, at every point.
    Dots(RGBColor, f64),
}

/// Points and how they look; an empty label keeps them out of the legend.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub(super) label: String,
    pub(super) points: Vec<(f64, f64)>,
    pub(super) look: Look,
}

impl Series {
    /// A curve through the points.
    pub(super) fn line(
        label: impl Into<String>,
        points: Vec<(f64, f64)>,
        dash: Dash,
        color: RGBColor,
    ) -> Series {
        Series { label: label.into(), points, look: Look::Line(dash, color) }
    }

    /// A hollow mark at every point.
    pub(super) fn marks(
        label: impl Into<String>,
        points: Vec<(f64, f64)>,
        marker: Marker,
        color: RGBColor,
    ) -> Series {
        Series { label: label.into(), points, look: Look::Marks(marker, color) }
    }
}

/// Draws what belongs together in a figure: one label, one colour, one dash, one marker.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) label: &'a str,
    look: (Marker, Dash, RGBColor),
}

impl<'a> Pen<'a> {
    /// For the series number `index`.
    pub(super) fn nth(index: usize, label: &'a str) -> Pen<'a> {
        Pen { label, look: nth(index) }
    }

    /// One that draws alike and keeps out of the legend.
    pub(super) fn unlabelled(self) -> Pen<'a> {
        Pen { label: "", ..self }
    }

    pub(super) fn line(&self, points: Vec<(f64, f64)>) -> Series {
        let (_, dash, color) = self.look;
        Series::line(self.label, points, dash, color)
    }

    pub(super) fn marks(&self, points: Vec<(f64, f64)>) -> Series {
        let (marker, _, color) = self.look;
        Series::marks(self.label, points, marker, color)
    }

    /// Discs that fit into hollow marks.
    pub(super) fn dots(&self, points: Vec<(f64, f64)>) -> Series {
        let (.., color) = self.look;
        Series { label: self.label.to_owned(), points, look: Look::Dots(color, DISC_RADIUS) }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) from: f64,
    pub(super) to: f64,
    /// Values are decimal logarithms; label whole decades.
    pub(super) decades: bool,
    /// Only whole numbers are labelled.
    pub(super) whole: bool,
}

impl Axis {
    /// An axis with these ends; two alike, or no numbers, give way to [`ends`].
    pub(super) fn new(label: &str, from: f64, to: f64) -> Axis {
        let (from, to) = ends(from, to);
        Axis { label: label.to_owned(), from, to, decades: false, whole: false }
    }

    /// An axis for counts up to the largest.
    pub(super) fn counts(label: &str, largest: f64) -> Axis {
        Axis { whole: true, ..Axis::new(label, 0.0, largest.max(1.0) * 1.08) }
    }

    /// An axis for logarithms to base 10.
    pub(super) fn decades(label: &str, from: f64, to: f64) -> Axis {
        let (from, to) = powers(from, to);
        Axis { decades: true, ..Axis::new(label, from, to) }
    }

    /// An axis that holds these values with a little room on both sides; from zero where that leaves no
    /// more than half of it empty.
    pub(super) fn about(label: &str, values: impl Iterator<Item = f64>) -> Axis {
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let half = if high > low { 0.0 } else { (0.1 * low.abs()).max(1e-9) };
        let (low, high) = (low - half, high + half);
        let room = ROOM * (high - low);
        let from = if low >= 0.0 && low <= 0.5 * high { 0.0 } else { low - room };
        Axis::new(label, from, high + room)
    }

    pub(super) fn holds(&self, value: f64) -> bool {
        (self.from..=self.to).contains(&value)
    }

    fn share(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from)
    }

    pub(super) fn scale(&self) -> Scale {
        if self.decades {
            Scale::logarithms(&self.label, self.from, self.to)
        } else {
            Scale::between(&self.label, self.from, self.to).in_whole_numbers(self.whole)
        }
    }
}

/// What an axis leaves free beyond its values, over their range.
const ROOM: f64 = 0.06;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Corner {
    TopLeft,
    TopRight,
    BottomRight,
}

#[derive(Debug, Clone)]
pub(super) struct Panel {
    /// Stands above the panel; may be empty.
    pub(super) title: String,
    pub(super) x: Axis,
    pub(super) y: Axis,
    pub(super) series: Vec<Series>,
    /// Where the legend stands, unless it would hide something there.
    pub(super) legend: Corner,
    /// Stands above the legend, as in "lines: eq. (5.22)"; may be empty.
    pub(super) note: String,
}

impl Panel {
    /// A panel without title and note.
    pub(super) fn new(x: Axis, y: Axis, legend: Corner, series: Vec<Series>) -> Panel {
        Panel { title: String::new(), x, y, series, legend, note: String::new() }
    }

    pub(super) fn titled(self, title: impl Into<String>) -> Panel {
        Panel { title: title.into(), ..self }
    }

    pub(super) fn noted(self, note: impl Into<String>) -> Panel {
        Panel { note: note.into(), ..self }
    }
}

/// Panels on one picture.
#[derive(Debug, Clone)]
pub(super) enum Sheet {
    /// One panel.
    Single(Box<Panel>),
    /// A tall panel above a low one.
    Stacked(Box<[Panel; 2]>),
    /// Two columns, row by row.
    Grid(Vec<Panel>),
    /// A picture of another make.
    Other(Arc<dyn Picture>),
}

impl Sheet {
    pub(super) fn single(panel: Panel) -> Sheet {
        Sheet::Single(Box::new(panel))
    }

    pub(super) fn stacked(upper: Panel, lower: Panel) -> Sheet {
        Sheet::Stacked(Box::new([upper, lower]))
    }

    /// One panel as [`Sheet::single`], others in two columns.
    pub(super) fn of(mut panels: Vec<Panel>) -> Sheet {
        if panels.len() == 1 { Sheet::single(panels.remove(0)) } else { Sheet::Grid(panels) }
    }
}

/// What is drawn as a whole, without panels of this file.
pub(super) trait Picture: std::fmt::Debug + Send + Sync {
    /// Draws it.
    fn page(&self, layout: Layout<'_>) -> Result<Page, String>;

    /// What is written on it.
    fn told(&self) -> Told;
}

/// What is written on a sheet: titles, what is shown against what, what the legend says, and notes.
#[derive(Debug, Clone, Default)]
pub(super) struct Told {
    pub(super) titles: Vec<String>,
    pub(super) upwards: Vec<String>,
    pub(super) across: Vec<String>,
    pub(super) labels: Vec<String>,
    pub(super) notes: Vec<String>,
}

impl Told {
    /// What another picture beside it says as well.
    pub(super) fn add(&mut self, other: Told) {
        self.titles.extend(other.titles);
        self.upwards.extend(other.upwards);
        self.across.extend(other.across);
        self.labels.extend(other.labels);
        self.notes.extend(other.notes);
    }
}

/// Pixels of a panel: 6 by 4 inches at 300 dots per inch.
pub(super) const PANEL: (u32, u32) = (1800, 1200);
/// Pixels of a panel that stands beside another: two are as wide as a page, with letters of full size.
pub(super) const SMALL_PANEL: (u32, u32) = (1100, 860);
pub(super) const TICK_TEXT: f64 = 36.0;
pub(super) const LABEL_TEXT: f64 = 42.0;
pub(super) const LINE_WIDTH: u32 = 4;
pub(super) const FRAME_WIDTH: u32 = 3;
const MARK_RADIUS: f64 = 11.0;
const DISC_RADIUS: f64 = 6.5;

/// The line at the foot.
const FOOT: u32 = 44;
const FOOT_TEXT: f64 = 24.0;
/// 7 points, in a grey that a copier keeps.
const READABLE_FOOT_TEXT: f64 = 29.0;
const READABLE_FOOT: RGBColor = RGBColor(80, 80, 80);

/// The frame of a panel, in pixels of the page.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) right: f64,
    pub(super) bottom: f64,
}

impl Frame {
    /// Where a point of a panel is.
    pub(super) fn place(&self, panel: &Panel, (x, y): (f64, f64)) -> Point {
        let across = panel.x.share(x) * (self.right - self.left);
        let upwards = panel.y.share(y) * (self.bottom - self.top);
        (self.left + across, self.bottom - upwards)
    }

    pub(super) fn corners(&self) -> [Point; 4] {
        [(self.left, self.top), (self.right, self.top), (self.right, self.bottom), (self.left, self.bottom)]
    }
}

/// How a sheet is laid out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout<'a> {
    /// The line at its foot, if it has one.
    pub(super) foot: Option<&'a str>,
    pub(super) keys: Keys,
}

/// Where keys of [pictures](Picture) stand that have no colour bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Keys {
    /// At the right of the panels: figures of pipelines.
    Beside,
    /// In lines below the panels, which then take the whole width: figures of one run. Their foot has the
    /// size and the colour of print.
    Below,
}

impl Layout<'_> {
    /// How much taller a page with its foot is.
    pub(super) fn foot_height(&self) -> u32 {
        if self.foot.is_some() { FOOT } else { 0 }
    }

    /// Draws the line at the foot.
    pub(super) fn footer(&self, root: &Area<'_>, (x, y): Point, longest: f64) -> Result<(), String> {
        let Some(text) = self.foot else { return Ok(()) };
        let (size, colour) = match self.keys {
            Keys::Beside => (FOOT_TEXT, GREY),
            Keys::Below => (READABLE_FOOT_TEXT, READABLE_FOOT),
        };
        let size = size * (longest / text::label_width(text, size)).min(1.0);
        if self.keys == Keys::Below && size < FOOT_TEXT {
            return Ok(());
        }
        let label = Label { text, size, align: Align::Left, upward: false, colour, role: Role::Foot };
        text::put(root, label, (x, y + f64::from(FOOT) / 3.0))
    }
}

/// Says in the middle of a frame that there is nothing in it.
pub(super) fn nothing(root: &Area<'_>, frame: &Frame) -> Result<(), String> {
    let label = Label {
        text: "nothing to draw",
        size: TICK_TEXT,
        align: Align::Center,
        upward: false,
        colour: GREY,
        role: Role::Legend,
    };
    text::put(root, label, ((frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0))
}

impl Panel {
    /// A curve's stretches within the frame, with no more points than can be seen.
    pub(super) fn paths(&self, frame: &Frame, points: &[(f64, f64)]) -> Vec<Vec<Point>> {
        let low = (frame.left, frame.top);
        let high = (frame.right, frame.bottom);
        let stretches = points.split(|(x, y)| !x.is_finite() || !y.is_finite());
        stretches
            .flat_map(|stretch| {
                let places: Vec<Point> = stretch.iter().map(|point| frame.place(self, *point)).collect();
                clipped(&thinned(&places), low, high)
            })
            .collect()
    }
}

fn full(RGBColor(r, g, b): RGBColor) -> Colour {
    Colour { rgb: (r, g, b), strength: 1.0 }
}

/// Draws a line of a frame or an axis.
pub(super) fn ruled(root: &Area<'_>, role: Role, path: Vec<Segment>) -> Result<(), String> {
    let paint = Paint::Stroke { colour: full(INK), width: f64::from(FRAME_WIDTH), dashes: Vec::new() };
    canvas::draw(root, Item { role, text: String::new(), path, paint })
}

pub(super) fn filled(root: &Area<'_>, role: Role, path: Vec<Segment>, color: RGBColor) -> Result<(), String> {
    canvas::draw(root, Item { role, text: String::new(), path, paint: Paint::Fill(full(color)) })
}

/// Draws a line through places of the page.
pub(super) fn line(
    root: &Area<'_>,
    role: Role,
    path: Vec<Point>,
    dash: Dash,
    color: RGBColor,
    width: f64,
) -> Result<(), String> {
    let dashes = match dash {
        Dash::Solid => Vec::new(),
        Dash::Dashed => vec![26.0, 16.0],
        Dash::Dotted => vec![6.0, 12.0],
        Dash::DotDashed => vec![40.0, 12.0, 6.0, 12.0],
        Dash::LongDashed => vec![60.0, 16.0],
    };
    let paint = Paint::Stroke { colour: full(color), width, dashes };
    canvas::draw(root, Item { role, text: String::new(), path: through(&path), paint })
}

/// Draws a line through pixels.
pub(super) fn stroke(
    root: &Area<'_>,
    path: Vec<(i32, i32)>,
    dash: Dash,
    color: RGBColor,
    width: u32,
) -> Result<(), String> {
    let path = path.into_iter().map(|(x, y)| (f64::from(x), f64::from(y))).collect();
    line(root, Role::Data, path, dash, color, f64::from(width))
}

/// Draws a mark at a pixel.
pub(super) fn mark(
    root: &Area<'_>,
    (x, y): (i32, i32),
    marker: Marker,
    color: RGBColor,
) -> Result<(), String> {
    mark_at(root, Role::Data, (f64::from(x), f64::from(y)), marker, color)
}

/// Draws a mark at a place of the page.
pub(super) fn mark_at(
    root: &Area<'_>,
    role: Role,
    (x, y): Point,
    marker: Marker,
    color: RGBColor,
) -> Result<(), String> {
    let r = MARK_RADIUS;
    let outline = match marker {
        Marker::Circle => circle((x, y), r - 1.0),
        Marker::Triangle => {
            around(&[(x, y - r - 2.0), (x + r + 1.0, y + r - 2.0), (x - r - 1.0, y + r - 2.0)])
        }
        Marker::Square => {
            let r = r - 1.0;
            around(&[(x - r, y - r), (x + r, y - r), (x + r, y + r), (x - r, y + r)])
        }
        Marker::Diamond => around(&[(x, y - r - 3.0), (x + r, y), (x, y + r + 3.0), (x - r, y)]),
        Marker::Cross => {
            let mut cross = through(&[(x - r, y - r), (x + r, y + r)]);
            cross.extend(through(&[(x - r, y + r), (x + r, y - r)]));
            cross
        }
    };
    if marker != Marker::Cross {
        filled(root, role, outline.clone(), WHITE)?;
    }
    let paint = Paint::Stroke { colour: full(color), width: f64::from(LINE_WIDTH), dashes: Vec::new() };
    canvas::draw(root, Item { role, text: String::new(), path: outline, paint })
}
