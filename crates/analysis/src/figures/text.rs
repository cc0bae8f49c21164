//! Labels with subscripts and superscripts, in the embedded font.
//!
//! `F_T/F_N` sets the letter after each underscore as a subscript, `k_{tot}`
//! the group in braces; `10^{8}` sets it as a superscript. The font comes with the program, so figures look the
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

/// Size of subscripts and superscripts relative to the text.
const SCRIPT_SIZE: f64 = 0.68;

/// Where a piece of a label stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Script {
    On,
    Below,
    Above,
}

impl Script {
    fn size(self, size: f64) -> f64 {
        if self == Script::On { size } else { size * SCRIPT_SIZE }
    }

    /// How far it hangs below the line.
    fn drop(self, size: f64) -> i32 {
        match self {
            Script::On => 0,
            Script::Below => (size * 0.26) as i32,
            Script::Above => (size * -0.34) as i32,
        }
    }
}

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
        .map(|(text, script)| {
            let width = width(area, &text, script.size(size))?;
            Ok((text, script.size(size), script.drop(size), width))
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
    pieces(label).into_iter().map(|(text, script)| width(area, &text, script.size(size))).sum()
}

fn width(area: &DrawingArea<BitMapBackend<'_>, Shift>, text: &str, size: f64) -> Result<i32, String> {
    let style = TextStyle::from((FONT, size).into_font());
    let (width, _) = area.estimate_text_size(text, &style).map_err(|error| error.to_string())?;
    Ok(width as i32)
}

/// Text and where it stands.
fn pieces(label: &str) -> Vec<(String, Script)> {
    let mut pieces = vec![(String::new(), Script::On)];
    let mut letters = label.chars().peekable();
    while let Some(letter) = letters.next() {
        let script = match letter {
            '_' => Script::Below,
            '^' => Script::Above,
            _ => {
                pieces.last_mut().expect("there is always a piece").0.push(letter);
                continue;
            }
        };
        let text = if letters.next_if_eq(&'{').is_some() {
            letters.by_ref().take_while(|&letter| letter != '}').collect()
        } else {
            letters.next().into_iter().collect()
        };
        pieces.push((text, script));
        pieces.push((String::new(), Script::On));
    }
    pieces.retain(|(text, _)| !text.is_empty());
    pieces
}

#[cfg(test)]
mod tests {
    use super::pieces;

    #[test]
    fn underscores_set_subscripts_and_carets_superscripts() {
        let text =
            |label| pieces(label).into_iter().map(|(text, at)| format!("{text} {at:?}")).collect::<Vec<_>>();
        assert_eq!(text("F_T/F_N"), ["F On", "T Below", "/F On", "N Below"]);
        assert_eq!(text("k_{tot} a"), ["k On", "tot Below", " a On"]);
        assert_eq!(text("10^{8} m^2"), ["10 On", "8 Above", " m On", "2 Above"]);
    }
}
