//! Pages as what plotters draws on.

use std::convert::Infallible;

use plotters::style::RGBAColor;
use plotters_backend::text_anchor::VPos;
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontTransform,
};

use super::page::{Item, Page, Paint, Point, Role, through};
use crate::draw::text::{self, CAPITAL, Label};

/// Whole numbers of plotters to a unit of the page.
pub(crate) const UNIT: f64 = 16.0;

/// A page that is being drawn on.
pub(crate) struct Canvas<'a>(pub(crate) &'a mut Page);

/// A length in whole numbers of plotters.
pub(crate) fn units(length: f64) -> i32 {
    (length * UNIT).round() as i32
}

/// Where that is on the page.
pub(crate) fn place((x, y): BackendCoord) -> Point {
    (f64::from(x) / UNIT, f64::from(y) / UNIT)
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

/// What charts draw: axes, marks and words.
impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        [self.0.width, self.0.height].map(|length| length * UNIT as u32).into()
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Drawn {
        self.draw_path([at, (at.0 + 1, at.1)], &color)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let BackendColor { rgb: (r, g, b), alpha } = style.color();
        let width = f64::from(style.stroke_width()) / UNIT;
        let paint = Paint::Stroke { colour: RGBAColor(r, g, b, alpha), width, dashes: Vec::new() };
        let path = through(&path.into_iter().map(place).collect::<Vec<_>>());
        let item = Item::new(Role::TICK, path, paint);
        // Axes are drawn with each of the two kinds of their marks.
        if !self.0.items.contains(&item) {
            self.0.add(item);
        }
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(&mut self, text: &str, style: &S, at: BackendCoord) -> Drawn {
        let (size, anchor) = (style.size() / UNIT, style.anchor());
        let (x, y) = place(at);
        // From the middle of capitals to their upper or lower end, of which letters leave room for their own.
        let away = match anchor.v_pos {
            VPos::Top => size * CAPITAL / 2.0,
            VPos::Center => 0.0,
            VPos::Bottom => -size * (CAPITAL / 2.0 + text::DESCENT),
        };
        let (upward, at) = match style.transform() {
            FontTransform::None | FontTransform::Rotate180 => (false, (x, y + away)),
            FontTransform::Rotate270 => (true, (x + away, y)),
            // Words at the right read upwards as well.
            FontTransform::Rotate90 => (true, (x - size * (CAPITAL / 2.0 + text::DESCENT), y)),
        };
        let role = Role::named(style.family().as_str());
        text::put(self.0, Label { size, align: anchor.h_pos, upward, role, ..Label::of(text) }, at);
        Ok(())
    }

    /// All as wide, so that numbers at the right of a frame begin at one place.
    fn estimate_text_size<S: BackendTextStyle>(
        &self,
        _: &str,
        _: &S,
    ) -> Result<(u32, u32), DrawingErrorKind<Infallible>> {
        Ok((1, 1))
    }
}
