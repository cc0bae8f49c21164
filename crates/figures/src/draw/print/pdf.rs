//! A page as PDF, all text as outlines.

use std::collections::BTreeSet;

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use plotters::style::RGBAColor;

use super::about::About;
use super::page::{PER_INCH, POINTS, Page, Paint, Segment};
use super::raster::Raster;

/// How hard the content is compressed, of 10.
const LEVEL: u8 = 6;

/// By how much of a pixel a picture ends within the pixels that it covers. Programs show it in all pixels that it
/// touches: one that ends where a pixel does would be stretched by one more, which blurs slips a pixel wide.
const WITHIN: f32 = 0.02;

pub(super) fn bytes(page: &Page, about: &About) -> Vec<u8> {
    let [catalog, pages, only, content, info] = [1, 2, 3, 4, 5].map(Ref::new);
    let scale = (POINTS / PER_INCH) as f32;
    let (width, height) = (page.width as f32 * scale, page.height as f32 * scale);
    let strengths: BTreeSet<u8> = page.items.iter().filter_map(|item| strength(&item.paint)).collect();
    let pictures = page.items.iter().filter_map(|item| match &item.paint {
        Paint::Raster(raster) => Some(raster),
        Paint::Fill(_) | Paint::Stroke { .. } => None,
    });
    let pictures: Vec<&Raster> = pictures.collect();
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([only]).count(1);
    let mut sheet = pdf.page(only);
    sheet.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
    let mut resources = sheet.resources();
    let mut states = resources.ext_g_states();
    for (strength, at) in strengths.iter().zip(6..) {
        states.pair(Name(state_name(*strength).as_bytes()), Ref::new(at));
    }
    states.finish();
    // Two for each: its colours, and where it has some.
    let of_pictures = || (6 + strengths.len() as i32..).step_by(2).map(Ref::new);
    if !pictures.is_empty() {
        let mut objects = resources.x_objects();
        for (n, at) in (0..pictures.len()).zip(of_pictures()) {
            objects.pair(Name(format!("P{n}").as_bytes()), at);
        }
    }
    resources.finish();
    sheet.finish();
    for (strength, at) in strengths.iter().zip(6..) {
        let strength = f32::from(*strength) / 100.0;
        pdf.ext_graphics(Ref::new(at)).non_stroking_alpha(strength).stroking_alpha(strength);
    }
    for (raster, at) in pictures.into_iter().zip(of_pictures()) {
        picture(&mut pdf, raster, at);
    }
    let packed = compress_to_vec_zlib(&drawn(page, scale, height), LEVEL);
    pdf.stream(content, &packed).filter(Filter::FlateDecode);
    let facts: Vec<String> =
        about.facts().into_iter().map(|(word, value)| format!("{word}: {value}")).collect();
    pdf.document_info(info)
        .title(TextStr(&about.words.title))
        .subject(TextStr(&about.words.caption))
        .keywords(TextStr(&facts.join("; ")))
        .creator(TextStr("Asperity"));
    pdf.finish()
}

/// Writes pixels, and where the page shows through them.
fn picture(pdf: &mut Pdf, raster: &Raster, at: Ref) {
    let mask = raster.has_gaps().then(|| Ref::new(at.get() + 1));
    let mut write = |at: Ref, samples: &[u8], is_mask: bool| {
        let packed = compress_to_vec_zlib(samples, LEVEL);
        let mut image = pdf.image_xobject(at, &packed);
        image.filter(Filter::FlateDecode);
        let (width, height) = raster.size();
        image.width(width as i32).height(height as i32).bits_per_component(8);
        if is_mask {
            image.color_space().device_gray();
        } else {
            image.color_space().device_rgb();
            if let Some(mask) = mask {
                image.s_mask(mask);
            }
        }
    };
    write(at, &raster.rgb(), false);
    if let Some(mask) = mask {
        write(mask, &raster.rgba().map(|[.., opacity]| opacity).collect::<Vec<u8>>(), true);
    }
}

/// The name of what sets a strength, in hundredths.
fn state_name(strength: u8) -> String {
    format!("S{strength}")
}

/// The strength of a colour that has not all of it, in hundredths.
fn strength(paint: &Paint) -> Option<u8> {
    match paint {
        Paint::Fill(RGBAColor(.., strength)) | Paint::Stroke { colour: RGBAColor(.., strength), .. } => {
            (*strength < 1.0).then(|| (strength * 100.0).round() as u8)
        }
        Paint::Raster(_) => None,
    }
}

/// The content of the page.
fn drawn(page: &Page, scale: f32, height: f32) -> Vec<u8> {
    let mut content = Content::new();
    let mut pictures = 0;
    content.transform([scale, 0.0, 0.0, -scale, 0.0, height]);
    content.set_line_join(LineJoinStyle::RoundJoin);
    for item in &page.items {
        let strength = strength(&item.paint);
        if let Some(strength) = strength {
            content.save_state();
            content.set_parameters(Name(state_name(strength).as_bytes()));
        }
        match &item.paint {
            Paint::Fill(colour) => {
                let [r, g, b] = rgb(*colour);
                content.set_fill_rgb(r, g, b);
                outline(&mut content, &item.path);
                content.fill_nonzero();
            }
            Paint::Stroke { colour, width, dashes } => {
                let [r, g, b] = rgb(*colour);
                content.set_stroke_rgb(r, g, b);
                content.set_line_width(*width as f32);
                content.set_dash_pattern(dashes.iter().map(|length| *length as f32), 0.0);
                outline(&mut content, &item.path);
                content.stroke();
            }
            Paint::Raster(raster) => {
                let ((x, y), (width, height)) = (raster.corner(), raster.size());
                content.save_state();
                // A picture is one wide and one high, from its lower left corner.
                let (left, bottom) = (x as f32 + WITHIN, y as f32 + height as f32 - WITHIN);
                let (wide, high) = (width as f32 - 2.0 * WITHIN, height as f32 - 2.0 * WITHIN);
                content.transform([wide, 0.0, 0.0, -high, left, bottom]);
                content.x_object(Name(format!("P{pictures}").as_bytes()));
                content.restore_state();
                pictures += 1;
            }
        }
        if strength.is_some() {
            content.restore_state();
        }
    }
    content.finish().to_vec()
}

fn rgb(RGBAColor(r, g, b, _): RGBAColor) -> [f32; 3] {
    // Three decimals tell all 256 values apart.
    [r, g, b].map(|part| (f32::from(part) / 255.0 * 1000.0).round() / 1000.0)
}

fn outline(content: &mut Content, path: &[Segment]) {
    for segment in path {
        match *segment {
            Segment::Move((x, y)) => content.move_to(x as f32, y as f32),
            Segment::Line((x, y)) => content.line_to(x as f32, y as f32),
            Segment::Curve(a, b, to) => {
                content.cubic_to(a.0 as f32, a.1 as f32, b.0 as f32, b.1 as f32, to.0 as f32, to.1 as f32)
            }
            Segment::Close => content.close_path(),
        };
    }
}
