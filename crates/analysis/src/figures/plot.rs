//! Sheets of panels: axes, curves, marks and legends in one hand for all figures.
//!
//! Curves are told apart by dash and marks by shape, so that a grey print keeps
//! what colours say.

use std::path::Path;
use std::sync::Arc;

use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::types::RangedCoordf64;
use plotters::element::{Circle, PathElement, Polygon};
use plotters::prelude::{BLACK, BitMapBackend, DrawingArea, IntoDrawingArea, RGBColor, WHITE};
use plotters::style::{Color, ShapeStyle};

use super::text::{self, Align, FONT};

pub(super) type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, BitMapBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

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

#[derive(Debug, Clone, Copy)]
pub(super) enum Look {
    /// A curve through the points.
    Line(Dash, RGBColor),
    /// A hollow mark at every point.
    Marks(Marker, RGBColor),
    /// A line from zero to every point.
    Impulses(RGBColor),
}

/// Points and how they look; an empty label keeps them out of the legend.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub(super) label: String,
    pub(super) points: Vec<(f64, f64)>,
    pub(super) look: Look,
}

#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) from: f64,
    pub(super) to: f64,
    /// Values are decimal logarithms; label whole decades.
    pub(super) decades: bool,
}

impl Axis {
    pub(super) fn new(label: &str, from: f64, to: f64) -> Axis {
        Axis { label: label.to_owned(), from, to, decades: false }
    }

    /// An axis for logarithms to base 10.
    pub(super) fn decades(label: &str, from: f64, to: f64) -> Axis {
        Axis { decades: true, ..Axis::new(label, from, to) }
    }

    fn holds(&self, value: f64) -> bool {
        (self.from..=self.to).contains(&value)
    }
}

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
    pub(super) legend: Corner,
    /// Stands above the legend, as in "lines: eq. (5.22)"; may be empty.
    pub(super) note: String,
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

/// What is drawn as a whole, without panels of this file.
pub(super) trait Picture: std::fmt::Debug + Send + Sync {
    /// Draws it as a PNG into a file that is there.
    fn write(&self, path: &Path) -> Result<(), String>;
}

/// Pixels of a panel: 6 by 4 inches at 300 dots per inch.
pub(super) const PANEL: (u32, u32) = (1800, 1200);
pub(super) const TICK_TEXT: f64 = 40.0;
pub(super) const LABEL_TEXT: f64 = 48.0;
pub(super) const LINE_WIDTH: u32 = 4;
pub(super) const FRAME_WIDTH: u32 = 3;
const MARK_RADIUS: i32 = 11;

impl Sheet {
    /// Draws the sheet as a PNG into a file that is there.
    pub(super) fn write(&self, path: &Path) -> Result<(), String> {
        text::embed_font();
        let (width, height) = match self {
            Sheet::Other(picture) => return picture.write(path),
            Sheet::Single(_) => PANEL,
            Sheet::Stacked(_) => (PANEL.0, PANEL.1 * 3 / 2),
            Sheet::Grid(panels) => (PANEL.0 * 2, PANEL.1 * (panels.len() as u32).div_ceil(2)),
        };
        {
            let root = BitMapBackend::new(path, (width, height)).into_drawing_area();
            root.fill(&WHITE).map_err(|error| error.to_string())?;
            match self {
                Sheet::Single(panel) => panel.draw(&root, &root)?,
                Sheet::Stacked(panels) => {
                    let (upper, lower) = root.split_vertically(height * 62 / 100);
                    panels[0].draw(&root, &upper)?;
                    panels[1].draw(&root, &lower)?;
                }
                Sheet::Grid(panels) => {
                    let areas = root.split_evenly((panels.len().div_ceil(2), 2));
                    for (panel, area) in panels.iter().zip(&areas) {
                        panel.draw(&root, area)?;
                    }
                }
                Sheet::Other(_) => {}
            }
            root.present().map_err(|error| error.to_string())
        }
    }
}

impl Panel {
    fn draw(&self, root: &Area<'_>, area: &Area<'_>) -> Result<(), String> {
        let text_error = |error: plotters::drawing::DrawingAreaErrorKind<_>| format!("{error}");
        let (_, height) = area.dim_in_pixel();
        let (left, top) = area.get_base_pixel();
        let title_height = if self.title.is_empty() { 20 } else { 80 };
        let mut chart = ChartBuilder::on(area)
            .margin_top(title_height + 20)
            .margin_right(60)
            .margin_left(90)
            .margin_bottom(80)
            .x_label_area_size(70)
            .y_label_area_size(120)
            .build_cartesian_2d(self.x.from..self.x.to, self.y.from..self.y.to)
            .map_err(text_error)?;
        let (x_format, y_format) = (formatter(&self.x), formatter(&self.y));
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(ShapeStyle::from(&INK).stroke_width(FRAME_WIDTH))
            .set_all_tick_mark_size(12)
            .label_style((FONT, TICK_TEXT))
            .x_labels(ticks(&self.x))
            .y_labels(if height < PANEL.1 { 5 } else { ticks(&self.y) })
            .x_label_formatter(&x_format)
            .y_label_formatter(&y_format)
            .draw()
            .map_err(text_error)?;

        let inner = chart.plotting_area();
        let (x0, y0) = inner.get_base_pixel();
        let (inner_width, inner_height) = inner.dim_in_pixel();
        let (x1, y1) = (x0 + inner_width as i32, y0 + inner_height as i32);
        for series in &self.series {
            self.draw_series(root, &chart, series)?;
        }
        let frame = vec![(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)];
        stroke(root, frame, Dash::Solid, INK, FRAME_WIDTH)?;

        let center = (x0 + x1) / 2;
        text::draw(
            root,
            &self.title,
            (center, top + title_height / 2 + 10),
            LABEL_TEXT,
            Align::Center,
            false,
        )?;
        let below = top + height as i32 - 50;
        text::draw(root, &self.x.label, (center, below), LABEL_TEXT, Align::Center, false)?;
        text::draw(root, &self.y.label, (left + 50, (y0 + y1) / 2), LABEL_TEXT, Align::Center, true)?;
        self.draw_legend(root, (x0, y0), (x1, y1))
    }

    fn draw_series(&self, root: &Area<'_>, chart: &Chart<'_, '_>, series: &Series) -> Result<(), String> {
        let inside = |&(x, y): &(f64, f64)| self.x.holds(x) && self.y.holds(y);
        let pixel = |point: &(f64, f64)| chart.backend_coord(point);
        match series.look {
            Look::Line(dash, color) => {
                for piece in series.points.split(|point| !inside(point)).filter(|piece| piece.len() > 1) {
                    let mut path: Vec<(i32, i32)> = piece.iter().map(pixel).collect();
                    path.dedup();
                    stroke(root, path, dash, color, LINE_WIDTH)?;
                }
            }
            Look::Marks(marker, color) => {
                for point in series.points.iter().filter(|point| inside(point)) {
                    mark(root, pixel(point), marker, color)?;
                }
            }
            Look::Impulses(color) => {
                for &(x, y) in series.points.iter().filter(|point| inside(point)) {
                    let foot = pixel(&(x, self.y.from.max(0.0)));
                    stroke(root, vec![foot, pixel(&(x, y))], Dash::Solid, color, 2)?;
                }
            }
        }
        Ok(())
    }

    fn draw_legend(&self, root: &Area<'_>, low: (i32, i32), high: (i32, i32)) -> Result<(), String> {
        const ROW: i32 = 62;
        const SAMPLE: i32 = 110;
        const PAD: i32 = 28;
        // Series of one label share a row: marks on their line.
        let mut rows: Vec<&str> = Vec::new();
        for series in &self.series {
            if !series.label.is_empty() && !rows.contains(&series.label.as_str()) {
                rows.push(&series.label);
            }
        }
        let note_rows = i32::from(!self.note.is_empty());
        let widths = rows.iter().map(|label| text::label_width(root, label, TICK_TEXT));
        let widest = widths.collect::<Result<Vec<i32>, String>>()?.into_iter().max().unwrap_or(0);
        let note_width = text::label_width(root, &self.note, TICK_TEXT)?;
        let width = (SAMPLE + PAD + widest).max(note_width);
        let height = ROW * (rows.len() as i32 + note_rows);
        let left = match self.legend {
            Corner::TopLeft => low.0 + PAD,
            Corner::TopRight | Corner::BottomRight => high.0 - PAD - width,
        };
        let top = match self.legend {
            Corner::TopLeft | Corner::TopRight => low.1 + PAD / 2,
            Corner::BottomRight => high.1 - PAD / 2 - height,
        };
        text::draw(root, &self.note, (left, top + ROW / 2), TICK_TEXT, Align::Left, false)?;
        for (row, label) in rows.iter().enumerate() {
            let y = top + ROW * (row as i32 + note_rows) + ROW / 2;
            for series in self.series.iter().filter(|series| series.label == *label) {
                let line = vec![(left, y), (left + SAMPLE, y)];
                match series.look {
                    Look::Line(dash, color) => stroke(root, line, dash, color, LINE_WIDTH)?,
                    Look::Marks(marker, color) => mark(root, (left + SAMPLE / 2, y), marker, color)?,
                    Look::Impulses(color) => stroke(root, line, Dash::Solid, color, LINE_WIDTH)?,
                }
            }
            text::draw(root, label, (left + SAMPLE + PAD, y), TICK_TEXT, Align::Left, false)?;
        }
        Ok(())
    }
}

pub(super) fn stroke(
    root: &Area<'_>,
    path: Vec<(i32, i32)>,
    dash: Dash,
    color: RGBColor,
    width: u32,
) -> Result<(), String> {
    let pattern: &[f64] = match dash {
        Dash::Solid => return polyline(root, &path, color, width),
        Dash::Dashed => &[26.0, 16.0],
        Dash::Dotted => &[6.0, 12.0],
        Dash::DotDashed => &[40.0, 12.0, 6.0, 12.0],
        Dash::LongDashed => &[60.0, 16.0],
    };
    dashes(&path, pattern).iter().try_for_each(|piece| polyline(root, piece, color, width))
}

/// Draws a path segment by segment, with a disc on every joint: as one outline it
/// would leave white specks where it turns back on itself.
fn polyline(root: &Area<'_>, path: &[(i32, i32)], color: RGBColor, width: u32) -> Result<(), String> {
    for segment in path.windows(2) {
        root.draw(&PathElement::new(segment, color.stroke_width(width)))
            .map_err(|error| error.to_string())?;
    }
    for joint in path.iter().skip(1).take(path.len().saturating_sub(2)) {
        let disc = Circle::new(*joint, width as i32 / 2, color.filled());
        root.draw(&disc).map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// Cuts a path into the pieces that a pattern of lengths, on and off in turn, leaves.
fn dashes(path: &[(i32, i32)], pattern: &[f64]) -> Vec<Vec<(i32, i32)>> {
    let mut pieces = vec![path.first().copied().into_iter().collect::<Vec<_>>()];
    let mut phase = 0;
    let mut left = pattern[0];
    for pair in path.windows(2) {
        let (dx, dy) = (f64::from(pair[1].0 - pair[0].0), f64::from(pair[1].1 - pair[0].1));
        let length = dx.hypot(dy);
        let at = |along: f64| {
            let share = along / length;
            (pair[0].0 + (dx * share).round() as i32, pair[0].1 + (dy * share).round() as i32)
        };
        let mut along = 0.0;
        while along + left < length {
            along += left;
            if phase % 2 == 0 {
                pieces.last_mut().expect("there is always a piece").push(at(along));
            } else {
                pieces.push(vec![at(along)]);
            }
            phase = (phase + 1) % pattern.len();
            left = pattern[phase];
        }
        left -= length - along;
        if phase % 2 == 0 {
            pieces.last_mut().expect("there is always a piece").push(pair[1]);
        }
    }
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

pub(super) fn mark(
    root: &Area<'_>,
    (x, y): (i32, i32),
    marker: Marker,
    color: RGBColor,
) -> Result<(), String> {
    let r = MARK_RADIUS;
    let outline = match marker {
        Marker::Circle => {
            let circle = |radius, style| root.draw(&Circle::new((x, y), radius, style));
            return circle(r + 1, color.filled())
                .and_then(|()| circle(r - 3, WHITE.filled()))
                .map_err(|error| error.to_string());
        }
        Marker::Triangle => vec![(x, y - r - 2), (x + r + 1, y + r - 2), (x - r - 1, y + r - 2)],
        Marker::Square => vec![
            (x - r + 1, y - r + 1),
            (x + r - 1, y - r + 1),
            (x + r - 1, y + r - 1),
            (x - r + 1, y + r - 1),
        ],
        Marker::Diamond => vec![(x, y - r - 3), (x + r, y), (x, y + r + 3), (x - r, y)],
        Marker::Cross => {
            stroke(root, vec![(x - r, y - r), (x + r, y + r)], Dash::Solid, color, LINE_WIDTH)?;
            return stroke(root, vec![(x - r, y + r), (x + r, y - r)], Dash::Solid, color, LINE_WIDTH);
        }
    };
    root.draw(&Polygon::new(outline.clone(), WHITE.filled())).map_err(|error| error.to_string())?;
    let closed = outline.iter().chain(&outline[..1]).copied().collect();
    stroke(root, closed, Dash::Solid, color, LINE_WIDTH)
}

fn ticks(axis: &Axis) -> usize {
    if axis.decades { (axis.to - axis.from).round() as usize + 1 } else { 9 }
}

/// Tick labels: as many decimals as the range needs, the same for all ticks.
fn formatter(axis: &Axis) -> impl Fn(&f64) -> String + use<> {
    let span = axis.to - axis.from;
    let decades = axis.decades;
    move |&value: &f64| {
        if decades {
            let whole = value.round();
            return if (value - whole).abs() < 1e-9 { decade(whole as i32) } else { String::new() };
        }
        let decimals = (1.0 - (span / 2.0).log10().floor()).clamp(0.0, 6.0) as usize;
        let text = format!("{value:.decimals$}");
        // A rounded zero may come out as -0.
        let text = if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
            text.trim_start_matches('-').to_owned()
        } else {
            text
        };
        text.replace('-', "\u{2212}")
    }
}

/// Powers of ten that would be long in full are written as `1e-8`.
fn decade(exponent: i32) -> String {
    if exponent < -4 {
        format!("1e\u{2212}{}", -exponent)
    } else if exponent >= 0 {
        format!("{}", 10f64.powi(exponent))
    } else {
        format!("{:.*}", -exponent as usize, 10f64.powi(exponent))
    }
}
