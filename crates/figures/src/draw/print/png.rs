//! A page as PNG.

use plotters::style::RGBAColor;
use png::{BitDepth, ColorType, Compression, Encoder, Filter, PixelDimensions, Unit};
use tiny_skia::{Color, FillRule, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

use super::about::About;
use super::page::{self, PER_INCH, Page, Segment};
use super::raster::Raster;

/// Pixels that are copied together.
const RUN: usize = 32;

pub(super) fn bytes(page: &Page, about: &About) -> Result<Vec<u8>, String> {
    let mut pixels = Pixmap::new(page.width, page.height)
        .ok_or_else(|| format!("{} × {} pixels are no picture", page.width, page.height))?;
    pixels.fill(Color::WHITE);
    for item in &page.items {
        let Some(path) = path(&item.path) else { continue };
        let at = Transform::identity();
        match &item.paint {
            page::Paint::Fill(colour) => {
                pixels.fill_path(&path, &paint(*colour), FillRule::Winding, at, None);
            }
            page::Paint::Stroke { colour, width, dashes } => {
                let pattern: Vec<f32> = dashes.iter().map(|length| *length as f32).collect();
                let stroke = Stroke {
                    width: *width as f32,
                    line_join: LineJoin::Round,
                    dash: StrokeDash::new(pattern, 0.0),
                    ..Stroke::default()
                };
                pixels.stroke_path(&path, &paint(*colour), &stroke, at, None);
            }
            page::Paint::Raster(raster) => raster.put(&mut pixels),
        }
    }
    // On the white ground all pixels are opaque, and most runs of them are white. This crate is compiled without
    // optimisation: copying all of them, or a call for each, takes as long as all other drawing.
    let mut rgb = vec![255; pixels.data().len() / 4 * 3];
    let white = [255; 4 * RUN];
    for (rgb, rgba) in rgb.chunks_mut(3 * RUN).zip(pixels.data().chunks(4 * RUN)) {
        if *rgba != white[..rgba.len()] {
            let (mut to, mut from) = (0, 0);
            while to < rgb.len() {
                (rgb[to], rgb[to + 1], rgb[to + 2]) = (rgba[from], rgba[from + 1], rgba[from + 2]);
                (to, from) = (to + 3, from + 4);
            }
        }
    }
    let mut words = vec![("Title", about.words.title.clone()), ("Description", about.words.caption.clone())];
    words.extend(about.facts());
    encoded((page.width, page.height), ColorType::Rgb, &rgb, &words)
}

/// Pixels alone, for a page that has them within.
pub(super) fn of_raster(raster: &Raster) -> Result<Vec<u8>, String> {
    match raster.has_gaps() {
        true => encoded(raster.size(), ColorType::Rgba, &raster.rgba().flatten().collect::<Vec<_>>(), &[]),
        false => encoded(raster.size(), ColorType::Rgb, &raster.rgb(), &[]),
    }
}

/// A picture, compressed not as hard as it could be, but by code that does the same on every processor; with words for
/// one that is a page.
fn encoded(
    (width, height): (u32, u32),
    kind: ColorType,
    samples: &[u8],
    words: &[(&'static str, String)],
) -> Result<Vec<u8>, String> {
    let failed = |error: png::EncodingError| error.to_string();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_color(kind);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    encoder.set_filter(Filter::Up);
    let per_metre = (PER_INCH / 0.0254).round() as u32;
    let size = PixelDimensions { xppu: per_metre, yppu: per_metre, unit: Unit::Meter };
    encoder.set_pixel_dims((!words.is_empty()).then_some(size));
    for (word, text) in words {
        // Only Latin-1 has a place in a text chunk of the older kind.
        match text.chars().all(|letter| (' '..='~').contains(&letter)) {
            true => encoder.add_text_chunk((*word).to_owned(), text.clone()),
            false => encoder.add_itxt_chunk((*word).to_owned(), text.clone()),
        }
        .map_err(failed)?;
    }
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(samples).and_then(|()| writer.finish()).map_err(failed)?;
    Ok(bytes)
}

fn paint(RGBAColor(r, g, b, strength): RGBAColor) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, (strength * 255.0).round() as u8);
    paint
}

fn path(segments: &[Segment]) -> Option<Path> {
    let mut path = PathBuilder::new();
    let place = |(x, y): page::Point| (x as f32, y as f32);
    for segment in segments {
        match *segment {
            Segment::Move(to) => {
                let (x, y) = place(to);
                path.move_to(x, y);
            }
            Segment::Line(to) => {
                let (x, y) = place(to);
                path.line_to(x, y);
            }
            Segment::Curve(a, b, to) => {
                let [(x1, y1), (x2, y2), (x, y)] = [a, b, to].map(place);
                path.cubic_to(x1, y1, x2, y2, x, y);
            }
            Segment::Close => path.close(),
        }
    }
    path.finish()
}

#[cfg(test)]
mod tests {
    use super::super::about::About;
    use super::super::page::{Item, Page, Paint, Role, through};
    use super::bytes;
    use plotters::style::{BLACK, Color};

    /// How much ink a line of 300 pixels has, per pixel of its length, at an angle in degrees.
    fn width_at(angle: f64, drawn: f64) -> f64 {
        let mut page = Page::new(400, 400);
        let (sine, cosine) = angle.to_radians().sin_cos();
        let end = |side: f64| (200.0 + side * 150.0 * cosine, 200.0 + side * 150.0 * sine);
        let paint = Paint::Stroke { colour: BLACK.to_rgba(), width: drawn, dashes: Vec::new() };
        let path = through(&[end(-1.0), end(1.0)]);
        page.add(Item::new(Role::DATA, path, paint));
        let png = bytes(&page, &About::default()).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut pixels).unwrap();
        pixels.iter().map(|value| f64::from(255 - value) / 255.0).sum::<f64>() / 3.0 / 300.0
    }

    #[test]
    fn strokes_are_as_thick_at_all_slopes() {
        for angle in [0.0, 3.0, 30.0, 45.0, 63.4, 80.0, 87.0, 90.0] {
            let width = width_at(angle, 4.0);
            assert!((width - 4.0).abs() < 0.12, "{width} at {angle} degrees");
        }
        // What the eye saw before: half as much in steep lines.
        assert!((width_at(87.0, 2.0) - 4.0).abs() > 1.9);
    }
}
