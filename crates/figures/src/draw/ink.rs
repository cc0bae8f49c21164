//! Lines, marks and surfaces on a page.

use plotters::style::{Color, RGBColor, WHITE};

use super::print::page::{Item, Page, Paint, Point, Role, Segment, around, circle, through};
use super::sheet::{Dash, INK, Marker};

pub(super) const LINE_WIDTH: f64 = 4.0;
pub(super) const FRAME_WIDTH: f64 = 3.0;
const MARK_RADIUS: f64 = 11.0;

/// Lines with edges: colour and width in pixels of the edge, and of the line upon it.
const EDGED: [(RGBColor, f64); 2] = [(WHITE, 8.0), (INK, 3.0)];

/// Heads of arrows, in pixels, and the shortest arrow.
const ARROW_HEAD: f64 = 17.0;
const SHORTEST_ARROW: f64 = 3.0;

impl Page {
    /// Draws a line through places.
    pub(super) fn line(&mut self, role: Role, path: &[Point], dash: Dash, color: RGBColor, width: f64) {
        let dashes = match dash {
            Dash::Solid => Vec::new(),
            Dash::Dashed => vec![26.0, 16.0],
            Dash::Dotted => vec![6.0, 12.0],
            Dash::DotDashed => vec![40.0, 12.0, 6.0, 12.0],
            Dash::LongDashed => vec![60.0, 16.0],
        };
        let paint = Paint::Stroke { colour: color.to_rgba(), width, dashes };
        self.add(Item::new(role, through(path), paint));
    }

    /// Fills an outline with so much of a colour, from 0 to 1.
    pub(super) fn fill(&mut self, role: Role, path: Vec<Segment>, color: RGBColor, strength: f64) {
        self.add(Item::new(role, path, Paint::Fill(color.mix(strength))));
    }

    /// Draws a hollow mark about a place.
    pub(super) fn mark(&mut self, role: Role, (x, y): Point, marker: Marker, color: RGBColor) {
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
            self.fill(role, outline.clone(), WHITE, 1.0);
        }
        let paint = Paint::Stroke { colour: color.to_rgba(), width: LINE_WIDTH, dashes: Vec::new() };
        self.add(Item::new(role, outline, paint));
    }

    /// Draws lines with white edges, all edges below all lines, so that none crosses another line.
    pub(super) fn contours(&mut self, paths: &[Vec<Point>]) {
        for (color, width) in EDGED {
            for path in paths {
                self.line(Role::DATA, path, Dash::Solid, color, width);
            }
        }
    }

    /// Draws an arrow with a white edge; one that is too short to have a direction is left out.
    pub(super) fn arrow(&mut self, from: Point, to: Point) {
        let (x, y) = (to.0 - from.0, to.1 - from.1);
        let length = x.hypot(y);
        if length < SHORTEST_ARROW {
            return;
        }
        let (x, y) = (x / length, y / length);
        let head = (0.5 * length).min(ARROW_HEAD);
        for (color, width) in EDGED {
            // The edge reaches as far beyond the head as beside the shaft.
            let edge = (width - EDGED[1].1) / 2.0;
            let (tip, foot) = (length + 2.0 * edge, length - head - edge);
            let half = 0.42 * head + 1.5 * edge;
            let at =
                |along: f64, aside: f64| (from.0 + x * along - y * aside, from.1 + y * along + x * aside);
            let shaft = [at(-edge, 0.0), at(length - head / 2.0, 0.0)];
            self.line(Role::DATA, &shaft, Dash::Solid, color, width);
            self.fill(Role::DATA, around(&[at(tip, 0.0), at(foot, half), at(foot, -half)]), color, 1.0);
        }
    }
}
