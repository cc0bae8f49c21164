//! Axes at the edges of a frame: ticks, their numbers, and labels.

use super::plot::{Area, Frame, INK, LABEL_TEXT, TICK_TEXT, ruled};
use super::print::page::{Point, Role, around, through};
use super::scale::{Scale, Tick};
use super::text::{self, Align, Label};

/// Lengths of ticks, and of those without a number.
pub(super) const TICK: f64 = 13.0;
const SHORT_TICK: f64 = 8.0;

/// From the end of a tick to its number: beside it, and to the middle of one below it.
pub(super) const BESIDE_TICK: f64 = 12.0;
const BELOW_TICK: f64 = 36.0;

/// The least between two numbers beside each other.
const BETWEEN_NUMBERS: f64 = 20.0;

/// An axis, and those of its ticks that have numbers.
pub(super) struct Ruler<'a> {
    pub(super) scale: &'a Scale,
    pub(super) ticks: Vec<Tick>,
}

impl Ruler<'_> {
    /// The shares of the axis at which ticks without a number stand.
    fn between(&self) -> impl Iterator<Item = f64> {
        self.scale.between_ticks().into_iter().filter_map(|value| self.scale.share(value))
    }

    /// The shares at which the others stand, with their numbers.
    fn numbered(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks.iter().filter_map(|tick| Some((self.scale.share(tick.at)?, tick.label.as_str())))
    }

    fn widest_number(&self) -> f64 {
        let widths = self.ticks.iter().map(|tick| text::label_width(&tick.label, TICK_TEXT));
        widths.fold(0.0, f64::max)
    }

    /// Draws it at an edge on the right or the left of a frame; how far it reaches out.
    fn draw_upright(&self, root: &Area<'_>, frame: &Frame, on_the_right: bool) -> Result<f64, String> {
        let (edge, outwards, align) =
            if on_the_right { (frame.right, 1.0, Align::Left) } else { (frame.left, -1.0, Align::Right) };
        let height = |share: f64| frame.bottom - share * (frame.bottom - frame.top);
        let out = |y: f64, length: f64| through(&[(edge, y), (edge + outwards * length, y)]);
        for (y, words) in self.numbered().map(|(share, words)| (height(share), words)) {
            ruled(root, Role::Tick, out(y, TICK))?;
            let at = (edge + outwards * (TICK + BESIDE_TICK), y);
            number(root, words, at, align, Role::NumberUpwards)?;
        }
        for y in self.between().map(height) {
            ruled(root, Role::Tick, out(y, SHORT_TICK))?;
        }
        Ok(TICK + BESIDE_TICK + self.widest_number())
    }

    /// Draws it below a frame, without numbers that would run into the one before.
    fn draw_level(&self, root: &Area<'_>, frame: &Frame) -> Result<(), String> {
        let place = |share: f64| frame.left + share * (frame.right - frame.left);
        let down = |x: f64, length: f64| through(&[(x, frame.bottom), (x, frame.bottom + length)]);
        let mut free_from = f64::NEG_INFINITY;
        for (x, words) in self.numbered().map(|(share, words)| (place(share), words)) {
            ruled(root, Role::Tick, down(x, TICK))?;
            let half = text::label_width(words, TICK_TEXT) / 2.0;
            if x - half >= free_from {
                let at = (x, frame.bottom + TICK + BELOW_TICK);
                number(root, words, at, Align::Center, Role::NumberAcross)?;
                free_from = x + half + BETWEEN_NUMBERS;
            }
        }
        for x in self.between().map(place) {
            ruled(root, Role::Tick, down(x, SHORT_TICK))?;
        }
        Ok(())
    }
}

/// Draws a frame with an axis below it and one at its left.
pub(super) fn draw(
    root: &Area<'_>,
    frame: &Frame,
    across: &Ruler<'_>,
    upwards: &Ruler<'_>,
) -> Result<(), String> {
    ruled(root, Role::Frame, around(&frame.corners()))?;
    across.draw_level(root, frame)?;
    upwards.draw_upright(root, frame, false)?;
    Ok(())
}

/// Draws a frame with an axis at its right; how far that reaches out.
pub(super) fn draw_at_the_right(root: &Area<'_>, frame: &Frame, upwards: &Ruler<'_>) -> Result<f64, String> {
    ruled(root, Role::Frame, around(&frame.corners()))?;
    upwards.draw_upright(root, frame, true)
}

/// Draws a title or what an axis is called about a point, smaller if it would be longer than there is
/// room.
pub(super) fn label(
    root: &Area<'_>,
    text: &str,
    at: Point,
    longest: f64,
    upward: bool,
) -> Result<(), String> {
    let size = LABEL_TEXT * (longest / text::label_width(text, LABEL_TEXT).max(1.0)).min(1.0);
    text::put(root, Label { text, size, align: Align::Center, upward, colour: INK, role: Role::Label }, at)
}

fn number(root: &Area<'_>, text: &str, at: Point, align: Align, role: Role) -> Result<(), String> {
    // Panels beside each other have the numbers of the outer ones.
    if text.is_empty() {
        return Ok(());
    }
    text::put(root, Label { text, size: TICK_TEXT, align, upward: false, colour: INK, role }, at)
}
