//! Pages as what plotters draws on.

use std::convert::Infallible;

use plotters::coord::Shift;
use plotters::element::{Drawable, PointCollection};
use plotters::prelude::DrawingArea;
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, DrawingBackend, DrawingErrorKind};

use super::page::{Colour, Item, Page, Paint, Point, Role, around, circle, through};

/// A page that is being drawn on.
pub(crate) struct Canvas<'a>(pub(crate) &'a mut Page);

/// A part of a page, in pixels from its upper left corner.
pub(crate) type Area<'a> = DrawingArea<Canvas<'a>, Shift>;

fn colour(color: BackendColor) -> Colour {
    Colour { rgb: color.rgb, strength: color.alpha }
}

fn place((x, y): BackendCoord) -> Point {
    (f64::from(x), f64::from(y))
}

impl Canvas<'_> {
    fn put(&mut self, path: Vec<super::page::Segment>, style: &impl BackendStyle, fill: bool) {
        let colour = colour(style.color());
        let paint = if fill {
            Paint::Fill(colour)
        } else {
            Paint::Stroke { colour, width: f64::from(style.stroke_width()), dashes: Vec::new() }
        };
        self.0.add(Item { role: Role::Data, text: String::new(), path, paint });
    }
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;

impl DrawingBackend for Canvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        (self.0.width, self.0.height)
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, color: BackendColor) -> Drawn {
        let (x, y) = place(at);
        self.put(around(&[(x, y), (x + 1.0, y), (x + 1.0, y + 1.0), (x, y + 1.0)]), &color, true);
        Ok(())
    }

    fn draw_line<S: BackendStyle>(&mut self, from: BackendCoord, to: BackendCoord, style: &S) -> Drawn {
        self.put(through(&[place(from), place(to)]), style, false);
        Ok(())
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        low: BackendCoord,
        high: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Drawn {
        let ((x0, y0), (x1, y1)) = (place(low), place(high));
        self.put(around(&[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]), style, fill);
        Ok(())
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        self.put(through(&path.into_iter().map(place).collect::<Vec<_>>()), style, false);
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        center: BackendCoord,
        radius: u32,
        style: &S,
        fill: bool,
    ) -> Drawn {
        self.put(circle(place(center), f64::from(radius)), style, fill);
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        corners: I,
        style: &S,
    ) -> Drawn {
        self.put(around(&corners.into_iter().map(place).collect::<Vec<_>>()), style, true);
        Ok(())
    }
}

/// A path as an element of plotters, between pixels where it must be.
struct Element(Item);

impl<'a> PointCollection<'a, BackendCoord> for &'a Element {
    type Point = BackendCoord;
    type IntoIter = std::iter::Empty<BackendCoord>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::empty()
    }
}

impl Drawable<Canvas<'_>> for Element {
    fn draw<I: Iterator<Item = BackendCoord>>(&self, _: I, canvas: &mut Canvas<'_>, _: (u32, u32)) -> Drawn {
        canvas.0.add(self.0.clone());
        Ok(())
    }
}

/// Draws a path; places are those of the whole page.
pub(crate) fn draw(area: &Area<'_>, item: Item) -> Result<(), String> {
    area.draw(&Element(item)).map_err(|error| error.to_string())
}
