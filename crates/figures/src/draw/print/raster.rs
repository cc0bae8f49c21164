//! Pixels on a page: the colours of a map or a colour bar as one picture.
//!
//! As outlines, cells next to each other would share edges that viewers smooth one by one, so that the
//! page shows through between them: a bar of a thousand slivers looks washed out.

use plotters::style::RGBColor;
use tiny_skia::{Paint, Pixmap, PixmapPaint, Rect, Transform};

use super::page::Point;

/// A place on the page, in whole page units.
pub(crate) type Pixel = (i32, i32);

/// A rectangle in one colour, by its upper left corner and its lower right one, which is no longer part of it; one
/// without width or height is a pixel wide or high.
pub(crate) type Cell = (Pixel, Pixel, RGBColor);

/// A picture that stands on the page as it is, a pixel for each page unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    /// Its upper left corner.
    pub(super) corner: Pixel,
    /// Opaque, or transparent where the page shows through.
    pixels: Pixmap,
}

impl Raster {
    /// Cells from back to front. None if there are none.
    pub(crate) fn of(cells: &[Cell]) -> Option<Raster> {
        let end = |low: &Pixel, high: &Pixel| (high.0.max(low.0 + 1), high.1.max(low.1 + 1));
        let left = cells.iter().map(|(low, ..)| low.0).min()?;
        let top = cells.iter().map(|(low, ..)| low.1).min()?;
        let right = cells.iter().map(|(low, high, _)| end(low, high).0).max()?;
        let bottom = cells.iter().map(|(low, high, _)| end(low, high).1).max()?;
        let mut pixels = Pixmap::new((right - left) as u32, (bottom - top) as u32)?;
        for (low, high, RGBColor(r, g, b)) in cells {
            let mut paint = Paint { anti_alias: false, ..Paint::default() };
            paint.set_color_rgba8(*r, *g, *b, 255);
            let (right, bottom) = end(low, high);
            let [left, top, right, bottom] =
                [low.0 - left, low.1 - top, right - left, bottom - top].map(|at| at as f32);
            let rectangle = Rect::from_ltrb(left, top, right, bottom)?;
            pixels.fill_rect(rectangle, &paint, Transform::identity(), None);
        }
        Some(Raster { corner: (left, top), pixels })
    }

    /// Its upper left corner.
    pub(crate) fn corner(&self) -> Point {
        (f64::from(self.corner.0), f64::from(self.corner.1))
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (u32, u32) {
        (self.pixels.width(), self.pixels.height())
    }

    /// Red, green, blue and opacity of its pixels row by row; transparent white where the page shows through.
    pub(super) fn rgba(&self) -> impl Iterator<Item = [u8; 4]> {
        self.pixels.pixels().iter().map(|pixel| match pixel.alpha() {
            0 => [255, 255, 255, 0],
            opacity => [pixel.red(), pixel.green(), pixel.blue(), opacity],
        })
    }

    /// Red, green and blue alone.
    pub(super) fn rgb(&self) -> Vec<u8> {
        self.rgba().flat_map(|[r, g, b, _]| [r, g, b]).collect()
    }

    /// Whether the page shows through somewhere.
    pub(super) fn has_gaps(&self) -> bool {
        self.pixels.pixels().iter().any(|pixel| pixel.alpha() == 0)
    }

    /// Draws it upon a page, as far as it is within it.
    pub(super) fn put(&self, page: &mut Pixmap) {
        let ((x, y), paint) = (self.corner, PixmapPaint::default());
        page.draw_pixmap(x, y, self.pixels.as_ref(), &paint, Transform::identity(), None);
    }
}

#[cfg(test)]
mod tests {
    use plotters::style::{RGBColor, WHITE};
    use tiny_skia::{Color, Pixmap};

    use super::Raster;

    #[test]
    fn the_front_cell_is_seen_and_none_is_narrower_than_a_pixel() {
        let (red, blue) = (RGBColor(255, 0, 0), RGBColor(0, 0, 255));
        let raster = Raster::of(&[((10, 20), (13, 22), red), ((12, 21), (12, 23), blue)]).unwrap();
        assert_eq!((raster.corner(), raster.size(), raster.has_gaps()), ((10.0, 20.0), (3, 3), true));
        // A page that holds all of it, and one that ends within it on two sides.
        for (width, height) in [(14, 24), (12, 22)] {
            let mut page = Pixmap::new(width, height).unwrap();
            page.fill(Color::WHITE);
            raster.put(&mut page);
            let expected = [
                ((10, 20), red),
                ((11, 20), red),
                ((12, 20), red),
                ((10, 21), red),
                ((11, 21), red),
                ((12, 21), blue),
                ((12, 22), blue),
            ];
            let within: Vec<_> =
                expected.into_iter().filter(|((x, y), _)| *x < width && *y < height).collect();
            let all = page.pixels().iter().map(|pixel| RGBColor(pixel.red(), pixel.green(), pixel.blue()));
            let drawn = (0..).zip(all).filter(|(_, colour)| *colour != WHITE);
            let seen: Vec<_> = drawn.map(|(n, colour)| ((n % width, n / width), colour)).collect();
            assert_eq!(seen, within);
        }
        let opacity: Vec<u8> = raster.rgba().map(|[.., opacity]| opacity).collect();
        assert_eq!(opacity, [255, 255, 255, 255, 255, 255, 0, 0, 255]);
        assert_eq!(raster.rgb()[18..], [255, 255, 255, 255, 255, 255, 0, 0, 255]);
        assert_eq!(Raster::of(&[]), None);
    }
}
