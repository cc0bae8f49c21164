//! Labels with subscripts and superscripts, as outlines of the embedded font.
//!
//! `F_T/F_N` sets the letter after each underscore as a subscript, `k_{tot}`
//! the group in braces; `10^{8}` sets it as a superscript; `time.step\_s` has an underscore. The font comes with the program, so figures look the
//! same on every machine and need no font library; what a label is as wide as is read off the glyphs that are drawn.

use std::sync::LazyLock;

use plotters::style::{BLACK, Color, RGBColor};
use plotters_backend::text_anchor::HPos;
use ttf_parser::{Face, OutlineBuilder};

use super::print::page::{Item, Page, Paint, Point, Role, Segment, bounds, mapped};

static FONT: LazyLock<Face<'static>> = LazyLock::new(|| {
    Face::parse(include_bytes!("../../fonts/DejaVuSans.ttf"), 0).expect("the embedded font is a font")
});

/// How large a piece of a label is, and how far it hangs below the line, over the size of the text.
type Script = (f64, f64);
const ON_LINE: Script = (1.0, 0.0);
const SUBSCRIPT: Script = (0.7, 0.17);
const SUPERSCRIPT: Script = (0.7, -0.36);

/// What is left free after a subscript or superscript, and before one, over the size of the text.
const SCRIPT_SPACE: f64 = 0.06;

/// How high digits and capitals are, over the size of the text.
pub(super) const CAPITAL: f64 = 0.729;

/// How far letters hang below the line, over the size of the text.
pub(super) const DESCENT: f64 = 0.24;

/// Sizes of numbers and of what axes are called, in pixels.
pub(super) const TICK_TEXT: f64 = 36.0;
pub(super) const LABEL_TEXT: f64 = 42.0;

/// A label to be drawn.
#[derive(Clone, Copy)]
pub(super) struct Label<'a> {
    pub(super) text: &'a str,
    pub(super) size: f64,
    /// Which part of it is at its position.
    pub(super) align: HPos,
    /// Turned to read from bottom to top.
    pub(super) upward: bool,
    pub(super) colour: RGBColor,
    pub(super) role: Role,
}

impl<'a> Label<'a> {
    /// Words in black from left to right, about their position.
    pub(super) fn of(text: &'a str) -> Label<'a> {
        let (size, align) = (LABEL_TEXT, HPos::Center);
        Label { text, size, align, upward: false, colour: BLACK, role: Role::LABEL }
    }

    /// Smaller, if it would be longer than this.
    pub(super) fn at_most(self, longest: f64) -> Label<'a> {
        let share = (longest / label_width(self.text, self.size).max(1.0)).min(1.0);
        Label { size: self.size * share, ..self }
    }
}

/// Draws a label. Of a number beside an axis, the ink is in the middle, so that it is where its mark is.
pub(super) fn put(page: &mut Page, label: Label<'_>, (x, y): Point) {
    let (path, width) = outlines(label.text, label.size);
    let Some(((left, top), (right, bottom))) = bounds(&path) else { return };
    let along = match (label.align, label.role) {
        (HPos::Left, _) => 0.0,
        (HPos::Center, Role::NUMBER_ACROSS) => -(left + right) / 2.0,
        (HPos::Center, _) => -width / 2.0,
        (HPos::Right, _) => -right,
    };
    let down = match label.role {
        Role::NUMBER_UPWARDS => -(top + bottom) / 2.0,
        _ => CAPITAL / 2.0 * label.size,
    };
    let place = |(px, py): Point| {
        let (px, py) = (px + along, py + down);
        if label.upward { (x + py, y - px) } else { (x + px, y + py) }
    };
    let path = mapped(path, place);
    let paint = Paint::Fill(label.colour.to_rgba());
    page.add(Item { role: label.role, text: plain(label.text), path, paint });
}

/// The width of a label in pixels.
pub(super) fn label_width(label: &str, size: f64) -> f64 {
    outlines(label, size).1
}

/// A label without what sets subscripts and superscripts: `k_{tot}` is `k_tot`.
pub(super) fn plain(label: &str) -> String {
    label.chars().filter(|letter| !matches!(letter, '{' | '}' | '\\')).collect()
}

/// The outlines of a label that begins at the origin, and its width.
fn outlines(label: &str, size: f64) -> (Vec<Segment>, f64) {
    let mut outlines = Outlines { path: Vec::new(), at: (0.0, 0.0), scale: 0.0, last: (0.0, 0.0) };
    let mut along = 0.0;
    for (text, (share, drop)) in pieces(label) {
        let space = if share < 1.0 { SCRIPT_SPACE * size } else { 0.0 };
        along += space;
        outlines.scale = share * size / f64::from(FONT.units_per_em());
        for letter in text.chars() {
            // A letter that the font has not is its empty box.
            let glyph = FONT.glyph_index(letter).unwrap_or_default();
            outlines.at = (along, drop * size);
            FONT.outline_glyph(glyph, &mut outlines);
            along += f64::from(FONT.glyph_hor_advance(glyph).unwrap_or(0)) * outlines.scale;
        }
        along += space;
    }
    (outlines.path, along)
}

/// Gathers outlines of glyphs, which the font gives upwards and in its own units.
struct Outlines {
    path: Vec<Segment>,
    at: Point,
    scale: f64,
    last: Point,
}

impl Outlines {
    fn place(&mut self, x: f32, y: f32) -> Point {
        self.last = (self.at.0 + f64::from(x) * self.scale, self.at.1 - f64::from(y) * self.scale);
        self.last
    }
}

impl OutlineBuilder for Outlines {
    fn move_to(&mut self, x: f32, y: f32) {
        let to = self.place(x, y);
        self.path.push(Segment::Move(to));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = self.place(x, y);
        self.path.push(Segment::Line(to));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        // The cubic curve that a quadratic one is.
        let from = self.last;
        let control = self.place(x1, y1);
        let to = self.place(x, y);
        let towards =
            |end: Point| (end.0 + (control.0 - end.0) * 2.0 / 3.0, end.1 + (control.1 - end.1) * 2.0 / 3.0);
        self.path.push(Segment::Curve(towards(from), towards(to), to));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (a, b) = (self.place(x1, y1), self.place(x2, y2));
        let to = self.place(x, y);
        self.path.push(Segment::Curve(a, b, to));
    }

    fn close(&mut self) {
        self.path.push(Segment::Close);
    }
}

/// Letters and scripts, each with where it stands.
fn pieces(label: &str) -> Vec<(String, Script)> {
    let mut pieces = Vec::new();
    let mut letters = label.chars().peekable();
    while let Some(letter) = letters.next() {
        let script = match letter {
            '_' => SUBSCRIPT,
            '^' => SUPERSCRIPT,
            _ => ON_LINE,
        };
        let text = match letter {
            '_' | '^' if letters.next_if_eq(&'{').is_some() => {
                letters.by_ref().take_while(|&letter| letter != '}').collect()
            }
            '_' | '^' | '\\' => letters.next().into_iter().collect(),
            letter => letter.to_string(),
        };
        pieces.push((text, script));
    }
    pieces.retain(|(text, _)| !text.is_empty());
    pieces
}

#[cfg(test)]
mod tests {
    use super::{FONT, bounds, label_width, outlines, pieces};

    #[test]
    fn underscores_set_subscripts_and_carets_superscripts() {
        let text = |label| {
            let piece = |(text, (_, drop)): (String, _)| match drop {
                0.0 => text,
                below if below > 0.0 => format!("[{text}]"),
                _ => format!("<{text}>"),
            };
            pieces(label).into_iter().map(piece).collect::<String>()
        };
        assert_eq!(text("F_T/F_N"), "F[T]/F[N]");
        assert_eq!(text("k_{tot} a"), "k[tot] a");
        assert_eq!(text("10^{8} m^2"), "10<8> m<2>");
        assert_eq!(text("step\\_s"), "step_s");
    }

    #[test]
    fn a_subscript_ends_before_what_follows_it() {
        // The slash leans to the left at its foot, where the subscript stands.
        let (_, (subscript, _)) = bounds(&outlines("F_T", 100.0).0).unwrap();
        let whole = outlines("F_T/", 100.0).0;
        let slash = whole.iter().rposition(|segment| matches!(segment, super::Segment::Move(_))).unwrap();
        let ((slash, _), _) = bounds(&whole[slash..]).unwrap();
        assert!(slash > subscript + 3.0, "{slash} {subscript}");
        assert!(label_width("F_T/", 100.0) > label_width("F_T", 100.0));
    }

    #[test]
    fn the_font_has_the_letters_of_figures() {
        for letter in "0123456789−·×√αβγδηθμντΔ₀±≥→(/)%".chars() {
            assert!(FONT.glyph_index(letter).is_some(), "{letter}");
        }
    }
}
