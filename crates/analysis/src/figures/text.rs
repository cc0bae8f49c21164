//! Labels with subscripts, in the embedded font.
//!
//! `F_T/F_N` sets the letter after each underscore as a subscript, `k_{tot}`
//! the group in braces. The font comes with the program, so figures look the
//! same on every machine and need no font library.

use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::{BLACK, BitMapBackend, DrawingArea, FontTransform, IntoFont, TextStyle};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{FontStyle, register_font};

pub(super) const FONT: &str = "DejaVu Sans";

/// Makes the embedded font known to plotters; to be called before drawing.
pub(super) fn embed_font() {
    static EMBED: Once = Once::new();
    EMBED.call_once(|| {
        let font = include_bytes!("../../fonts/DejaVuSans.ttf");
        let known = register_font(FONT, FontStyle::Normal, font);
        assert!(known.is_ok(), "the embedded font is a font");
    });
}

/// Where a label stands relative to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    /// Begins there.
    Left,
    /// Its middle is there.
    Center,
}

/// Size of subscripts relative to the text, and how far they hang below it.
const SUBSCRIPT_SIZE: f64 = 0.68;
const SUBSCRIPT_DROP: f64 = 0.26;

/// Draws a label; `upward` turns it to read from bottom to top.
pub(super) fn draw(
    area: &DrawingArea<BitMapBackend<'_>, Shift>,
    label: &str,
    (x, y): (i32, i32),
    size: f64,
    align: Align,
    upward: bool,
) -> Result<(), String> {
    let pieces: Vec<(String, f64, i32, i32)> = pieces(label)
        .into_iter()
        .map(|(text, subscript)| {
            let (size, drop) =
                if subscript { (size * SUBSCRIPT_SIZE, (size * SUBSCRIPT_DROP) as i32) } else { (size, 0) };
            let width = width(area, &text, size)?;
            Ok((text, size, drop, width))
        })
        .collect::<Result<_, String>>()?;
    let total: i32 = pieces.iter().map(|(.., width)| width).sum();
    let mut along = if align == Align::Center { -total / 2 } else { 0 };
    for (text, size, drop, width) in pieces {
        let (position, transform) = if upward {
            ((x + drop, y - along), FontTransform::Rotate270)
        } else {
            ((x + along, y + drop), FontTransform::None)
        };
        let style = TextStyle::from((FONT, size).into_font().transform(transform))
            .color(&BLACK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(&text, &style, position).map_err(|error| error.to_string())?;
        along += width;
    }
    Ok(())
}

/// The width of a label in pixels.
pub(super) fn label_width(
    area: &DrawingArea<BitMapBackend<'_>, Shift>,
    label: &str,
    size: f64,
) -> Result<i32, String> {
    pieces(label)
        .into_iter()
        .map(|(text, subscript)| width(area, &text, if subscript { size * SUBSCRIPT_SIZE } else { size }))
        .sum()
}

fn width(area: &DrawingArea<BitMapBackend<'_>, Shift>, text: &str, size: f64) -> Result<i32, String> {
    let style = TextStyle::from((FONT, size).into_font());
    let (width, _) = area.estimate_text_size(text, &style).map_err(|error| error.to_string())?;
    Ok(width as i32)
}

/// Text and whether it is a subscript.
fn pieces(label: &str) -> Vec<(String, bool)> {
    let mut pieces = vec![(String::new(), false)];
    let mut letters = label.chars().peekable();
    while let Some(letter) = letters.next() {
        if letter == '_' {
            let subscript = if letters.next_if_eq(&'{').is_some() {
                letters.by_ref().take_while(|&letter| letter != '}').collect()
            } else {
                letters.next().into_iter().collect()
            };
            pieces.push((subscript, true));
            pieces.push((String::new(), false));
        } else if let Some((text, _)) = pieces.last_mut() {
            text.push(letter);
        }
    }
    pieces.retain(|(text, _)| !text.is_empty());
    pieces
}

#[cfg(test)]
mod tests {
    use super::pieces;

    #[test]
    fn underscores_set_subscripts() {
        let text =
            |label| pieces(label).into_iter().map(|(text, sub)| format!("{text}{sub}")).collect::<Vec<_>>();
        assert_eq!(text("F_T/F_N"), ["Ffalse", "Ttrue", "/Ffalse", "Ntrue"]);
        assert_eq!(text("k_{tot} a"), ["kfalse", "tottrue", " afalse"]);
    }
}
