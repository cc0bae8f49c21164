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
    /// Red, green and blue row by row from the top; white where the page shows through. Each kind of file
    /// takes samples in an order of its own: a cell is copied into all of them at once, which is far quicker
    /// than to convert pixel by pixel where this crate is compiled without optimisation.
    rgb: Vec<u8>,
    /// Red, green, blue and opacity; transparent white where the page shows through.
    rgba: Vec<u8>,
    /// 255 for each pixel that has a colour, 0 where the page shows through.
    mask: Vec<u8>,
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
        let pixels = width * height;
        let (mut rgb, mut mask) = (vec![255; 3 * pixels], vec![0; pixels]);
        let mut rgba = [255, 255, 255, 0].repeat(pixels);
        for (low, high, colour) in cells {
            let (to_x, to_y) = end(low, high);
            let columns = (to_x - low.0) as usize;
            let (r, g, b) = *colour;
            let (row_rgb, row_rgba) = ([r, g, b].repeat(columns), [r, g, b, 255].repeat(columns));
            for row in (low.1 - top) as usize..(to_y - top) as usize {
                let first = row * width + (low.0 - left) as usize;
                rgb[3 * first..][..3 * columns].copy_from_slice(&row_rgb);
                rgba[4 * first..][..4 * columns].copy_from_slice(&row_rgba);
                mask[first..][..columns].fill(255);
            }
        }
        Some(Raster { corner: (left, top), width, rgb, rgba, mask })
    }

    /// Moves it.
    pub(super) fn shift(&mut self, (x, y): (f64, f64)) {
        self.corner = (self.corner.0 + x as i32, self.corner.1 + y as i32);
    }

    /// Its upper left corner.
    pub(super) fn corner(&self) -> (f64, f64) {
        (f64::from(self.corner.0), f64::from(self.corner.1))
    }

    /// Width and height.
    pub(super) fn size(&self) -> (u32, u32) {
        (self.width as u32, (self.mask.len() / self.width) as u32)
    }

    /// Whether the page shows through somewhere.
    pub(super) fn has_gaps(&self) -> bool {
        self.mask.contains(&0)
    }

    /// Red, green and blue of all pixels, white where the page shows through.
    pub(super) fn rgb(&self) -> &[u8] {
        &self.rgb
    }

    /// 255 for each pixel that has a colour, 0 where the page shows through.
    pub(super) fn mask(&self) -> &[u8] {
        &self.mask
    }

    /// Red, green, blue and opacity of all pixels, transparent where the page shows through.
    pub(super) fn rgba(&self) -> &[u8] {
        &self.rgba
    }

    /// Writes its colours upon a page of opaque pixels, four samples each, as far as they are within it.
    pub(super) fn put(&self, page: &mut [u8], page_width: usize) {
        let within = |from: i32, size: usize, page: usize| {
            (-from).max(0) as usize..size.min((page as i32 - from).max(0) as usize)
        };
        let (width, height) = (self.width, self.mask.len() / self.width);
        let columns = within(self.corner.0, width, page_width);
        for row in within(self.corner.1, height, page.len() / 4 / page_width) {
            let y = (self.corner.1 + row as i32) as usize;
            let mask = &self.mask[row * width..][..width];
            let mut column = columns.start;
            while column < columns.end {
                let start = column;
                while column < columns.end && mask[column] == mask[start] {
                    column += 1;
                }
                if mask[start] == 255 {
                    let x = (self.corner.0 + start as i32) as usize;
                    let drawn = &self.rgba[4 * (row * width + start)..4 * (row * width + column)];
                    page[4 * (y * page_width + x)..][..drawn.len()].copy_from_slice(drawn);
                }
            }
        }
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
        // A page that holds all of it, and one that ends within it on two sides.
        for (width, height) in [(14, 24), (12, 22)] {
            let mut page = vec![255; 4 * width * height];
            raster.put(&mut page, width);
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
            let drawn = page.chunks_exact(4).enumerate().filter(|(_, pixel)| **pixel != [255; 4]);
            let seen: Vec<_> =
                drawn.map(|(n, pixel)| ((n % width, n / width), (pixel[0], pixel[1], pixel[2]))).collect();
            assert_eq!(seen, within);
        }
        assert_eq!(raster.mask(), [255, 255, 255, 255, 255, 255, 0, 0, 255]);
        assert_eq!(raster.rgb()[18..], [255, 255, 255, 255, 255, 255, 0, 0, 255]);
        assert_eq!(Raster::of(&[]), None);
    }
}
