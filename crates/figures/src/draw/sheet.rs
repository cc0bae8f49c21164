//! A figure as data: panels of layers on axes, which [`super::chart`] draws.
//!
//! Curves differ by dash and marks by shape, so that a grey print shows what colours do.

use plotters::prelude::{BLACK, RGBColor};

use super::colours::Colours;
use super::scale::Scale;
use super::text::plain;

/// Colours that stay apart for colour-blind eyes and in grey.
pub(super) const INK: RGBColor = BLACK;
pub(super) const BLUE: RGBColor = RGBColor(0, 90, 181);
pub(super) const RED: RGBColor = RGBColor(200, 60, 0);
pub(super) const GREY: RGBColor = RGBColor(130, 130, 130);
pub(super) const GREEN: RGBColor = RGBColor(0, 120, 90);

/// A point in values of the axes.
pub(super) type Point = (f64, f64);

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

/// A rectangle between its lower left and its upper right corner, and its colour.
pub(super) type Tile = ([Point; 2], RGBColor);

/// What a layer shows, in values of the axes.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Shape {
    /// A line through the points, with gaps at those that are no numbers.
    Line(Vec<Point>, Dash),
    /// A hollow mark at every point.
    Marks(Vec<Point>, Marker),
    /// A disc with this radius, in pixels, at every point.
    Discs(Vec<Point>, f64),
    /// A line from zero to every point.
    Stems(Vec<Point>),
    /// A surface in a paler colour: so much of it, from 0 to 1.
    Surface(Vec<Point>, f64),
    /// Rectangles between two corners, each in its own colour, behind all other layers.
    Cells(Vec<Tile>),
    /// Black lines with white edges, which stay visible on all colours.
    Contours(Vec<Vec<Point>>),
    /// Arrows from one point to another, likewise.
    Arrows(Vec<[Point; 2]>),
    /// Small words that read upwards from this point, clear of lines across.
    Words(Point, String),
    /// A remark in the legend.
    Remark,
}

/// A shape with its colour; one with a label has a row in the legend, also if it has no points. Layers of one label
/// share a row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layer {
    pub(super) label: String,
    pub(super) shape: Shape,
    pub(super) colour: RGBColor,
}

impl Layer {
    pub(super) fn new(label: impl Into<String>, shape: Shape, colour: RGBColor) -> Layer {
        Layer { label: label.into(), shape, colour }
    }

    /// A line through the points.
    pub(super) fn line(label: impl Into<String>, points: Vec<Point>, dash: Dash, colour: RGBColor) -> Layer {
        Layer::new(label, Shape::Line(points, dash), colour)
    }

    /// A hollow mark at every point.
    pub(super) fn marks(label: impl Into<String>, at: Vec<Point>, marker: Marker, colour: RGBColor) -> Layer {
        Layer::new(label, Shape::Marks(at, marker), colour)
    }

    /// A disc at every point.
    pub(super) fn discs(label: impl Into<String>, at: Vec<Point>, radius: f64, colour: RGBColor) -> Layer {
        Layer::new(label, Shape::Discs(at, radius), colour)
    }

    /// A surface within an edge, with this share of the colour.
    pub(super) fn surface(label: impl Into<String>, edge: Vec<Point>, share: f64, colour: RGBColor) -> Layer {
        Layer::new(label, Shape::Surface(edge, share), colour)
    }

    /// Rectangles in colours of their own.
    pub(super) fn cells(cells: Vec<Tile>) -> Layer {
        Layer::new("", Shape::Cells(cells), INK)
    }

    /// Lines that stay visible on all colours.
    pub(super) fn contours(label: impl Into<String>, lines: Vec<Vec<Point>>) -> Layer {
        Layer::new(label, Shape::Contours(lines), INK)
    }

    /// A remark in the legend.
    pub(super) fn remark(text: impl Into<String>) -> Layer {
        Layer::new(text, Shape::Remark, INK)
    }

    /// All its points.
    pub(super) fn points(&self) -> Vec<Point> {
        match &self.shape {
            Shape::Line(points, _)
            | Shape::Marks(points, _)
            | Shape::Discs(points, _)
            | Shape::Stems(points)
            | Shape::Surface(points, _) => points.clone(),
            Shape::Cells(cells) => cells.iter().flat_map(|(corners, _)| *corners).collect(),
            Shape::Contours(lines) => lines.concat(),
            Shape::Arrows(arrows) => arrows.concat(),
            Shape::Words(at, _) => vec![*at],
            Shape::Remark => Vec::new(),
        }
    }
}

/// Draws what belongs together in a figure: one label, one colour, one dash, one marker.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pen<'a> {
    pub(super) label: &'a str,
    pub(super) look: (Marker, Dash, RGBColor),
}

impl<'a> Pen<'a> {
    /// For the series number `index`.
    pub(super) fn nth(index: usize, label: &'a str) -> Pen<'a> {
        Pen { label, look: nth(index) }
    }

    /// One that draws alike under another label.
    pub(super) fn called<'b>(self, label: &'b str) -> Pen<'b> {
        Pen { label, look: self.look }
    }

    pub(super) fn line(&self, points: Vec<Point>) -> Layer {
        Layer::line(self.label, points, self.look.1, self.look.2)
    }

    pub(super) fn marks(&self, points: Vec<Point>) -> Layer {
        Layer::marks(self.label, points, self.look.0, self.look.2)
    }

    /// Discs that fit into hollow marks.
    pub(super) fn discs(&self, points: Vec<Point>) -> Layer {
        Layer::discs(self.label, points, 6.5, self.look.2)
    }
}

/// A panel, its layers from back to front.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    /// Stands above the panel; may be empty.
    pub(super) title: String,
    pub(super) x: Scale,
    pub(super) y: Scale,
    pub(super) layers: Vec<Layer>,
}

impl Panel {
    /// A panel without title.
    pub(super) fn new(x: Scale, y: Scale, layers: Vec<Layer>) -> Panel {
        Panel { title: String::new(), x, y, layers }
    }

    pub(super) fn titled(self, title: impl Into<String>) -> Panel {
        Panel { title: title.into(), ..self }
    }

    /// Whether it shows nothing.
    pub(super) fn is_empty(&self) -> bool {
        self.layers.iter().all(|layer| layer.points().is_empty())
    }
}

/// How the panels of a sheet stand.
#[derive(Debug, Clone)]
pub(super) enum Layout {
    /// In columns, row by row, each with the numbers of its axes.
    Columns,
    /// A tall panel above a low one.
    Stacked,
    /// Close together, with numbers at the outer ones alone: panels of the same axes, of this height over their width.
    Close(f64),
    /// One panel of this height, in pixels.
    Tall(f64),
    /// On a page of the format A4: sheets one above the other, others side by side below them, and at the foot a table
    /// of what numbers are of, and the numbers.
    Page { wide: Vec<Sheet>, beside: Vec<Sheet>, numbers: Vec<(String, String)> },
}

/// A figure.
#[derive(Debug, Clone)]
pub(super) struct Sheet {
    /// Stands above all panels; may be empty.
    pub(super) title: String,
    /// Its width on paper; by default as wide as its panels need.
    pub(super) width_mm: Option<f64>,
    pub(super) panels: Vec<Panel>,
    pub(super) layout: Layout,
    /// What colours show, at the right of the panels.
    pub(super) bar: Option<Colours>,
}

impl Sheet {
    /// Panels in columns, without title.
    pub(super) fn of(panels: Vec<Panel>) -> Sheet {
        Sheet { title: String::new(), width_mm: None, panels, layout: Layout::Columns, bar: None }
    }

    pub(super) fn titled(self, title: impl Into<String>) -> Sheet {
        Sheet { title: title.into(), ..self }
    }

    /// One panel.
    pub(super) fn single(x: Scale, y: Scale, layers: Vec<Layer>) -> Sheet {
        Sheet::of(vec![Panel::new(x, y, layers)])
    }

    /// A tall panel above a low one.
    pub(super) fn stacked(upper: Panel, lower: Panel) -> Sheet {
        Sheet { layout: Layout::Stacked, ..Sheet::of(vec![upper, lower]) }
    }

    /// It with a remark below the legend of its first panel, as in "lines: theory".
    pub(super) fn noted(mut self, note: &str) -> Sheet {
        self.panels[0].layers.extend((!note.is_empty()).then(|| Layer::remark(note)));
        self
    }

    /// It and the sheets on it.
    pub(super) fn all(&self) -> Vec<&Sheet> {
        let mut all = vec![self];
        if let Layout::Page { wide, beside, .. } = &self.layout {
            all.extend(wide.iter().chain(beside));
        }
        all
    }

    /// What its legends say, each once.
    pub(super) fn labels(&self) -> Vec<String> {
        each_once(self.layers().map(|layer| layer.label.clone()))
    }

    /// All layers.
    pub(super) fn layers(&self) -> impl Iterator<Item = &Layer> {
        self.all_panels().flat_map(|panel| &panel.layers)
    }

    /// All panels.
    pub(super) fn all_panels(&self) -> impl Iterator<Item = &Panel> {
        self.all().into_iter().flat_map(|sheet| &sheet.panels)
    }
}

/// Texts that say something, as they are read, each once.
pub(super) fn each_once(texts: impl Iterator<Item = String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for text in texts.map(|text| plain(&text)) {
        if !text.is_empty() && !all.contains(&text) {
            all.push(text);
        }
    }
    all
}
