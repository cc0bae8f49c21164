//! Pixels on a page: the colours of a map or a colour bar as one picture.
//!
//! As outlines, cells next to each other would share edges that viewers smooth one by one, so that the
//! page shows through between them: a bar of a thousand slivers looks washed out.

/// A place on the page, in whole page units.
pub(crate) type Pixel = (i32, i32);

/// Red, green and blue.
pub(crate) type Rgb = (u8, u8, u8);

/// A picture that stands on the page as it is, a pixel for each page unit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    /// Its upper left corner.
    corner: Pixel,
    width: usize,
    /// Row by row from the top; nothing where the page shows through.
    pixels: Vec<Option<Rgb>>,
}

impl Raster {
    /// Rectangles from back to front, each by its upper left corner and its lower right one, which is no
    /// longer part of it; one without width or height is a pixel wide or high. None if there are none.
    pub(crate) fn of(cells: &[(Pixel, Pixel, Rgb)]) -> Option<Raster> {
        let end = |low: &Pixel, high: &Pixel| (high.0.max(low.0 + 1), high.1.max(low.1 + 1));
        let left = cells.iter().map(|(low, ..)| low.0).min()?;
        let top = cells.iter().map(|(low, ..)| low.1).min()?;
        let right = cells.iter().map(|(low, high, _)| end(low, high).0).max()?;
        let bottom = cells.iter().map(|(low, high, _)| end(low, high).1).max()?;
        let (width, height) = ((right - left) as usize, (bottom - top) as usize);
        let mut pixels = vec![None; width * height];
        for (low, high, rgb) in cells {
            let (to_x, to_y) = end(low, high);
            let columns = (low.0 - left) as usize..(to_x - left) as usize;
            for row in (low.1 - top) as usize..(to_y - top) as usize {
                pixels[row * width..][columns.clone()].fill(Some(*rgb));
            }
        }
        Some(Raster { corner: (left, top), width, pixels })
    }

    /// Its upper left corner.
    pub(super) fn corner(&self) -> (f64, f64) {
        (f64::from(self.corner.0), f64::from(self.corner.1))
    }

    /// Width and height.
    pub(super) fn size(&self) -> (u32, u32) {
        (self.width as u32, (self.pixels.len() / self.width) as u32)
    }

    /// Whether the page shows through somewhere.
    pub(super) fn has_gaps(&self) -> bool {
        self.pixels.iter().any(Option::is_none)
    }

    /// Red, green and blue of all pixels, white where the page shows through.
    pub(super) fn rgb(&self) -> Vec<u8> {
        self.pixels.iter().flat_map(|pixel| <[u8; 3]>::from(pixel.unwrap_or((255, 255, 255)))).collect()
    }

    /// 255 for each pixel that has a colour, 0 where the page shows through.
    pub(super) fn mask(&self) -> Vec<u8> {
        self.pixels.iter().map(|pixel| if pixel.is_some() { 255 } else { 0 }).collect()
    }

    /// The pixels that have a colour, with their place on the page.
    pub(super) fn coloured(&self) -> impl Iterator<Item = (Pixel, Rgb)> {
        let place =
            |n: usize| (self.corner.0 + (n % self.width) as i32, self.corner.1 + (n / self.width) as i32);
        self.pixels.iter().enumerate().filter_map(move |(n, pixel)| Some((place(n), (*pixel)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::Raster;

    #[test]
    fn the_front_cell_is_seen_and_none_is_narrower_than_a_pixel() {
        let (red, blue) = ((255, 0, 0), (0, 0, 255));
        let raster = Raster::of(&[((10, 20), (13, 22), red), ((12, 21), (12, 23), blue)]).unwrap();
        assert_eq!((raster.corner(), raster.size(), raster.has_gaps()), ((10.0, 20.0), (3, 3), true));
        let seen: Vec<_> = raster.coloured().collect();
        let expected = [
            ((10, 20), red),
            ((11, 20), red),
            ((12, 20), red),
            ((10, 21), red),
            ((11, 21), red),
            ((12, 21), blue),
            ((12, 22), blue),
        ];
        assert_eq!(seen, expected);
        assert_eq!(raster.mask(), [255, 255, 255, 255, 255, 255, 0, 0, 255]);
        assert_eq!(raster.rgb()[18..], [255, 255, 255, 255, 255, 255, 0, 0, 255]);
        assert_eq!(Raster::of(&[]), None);
    }
}
