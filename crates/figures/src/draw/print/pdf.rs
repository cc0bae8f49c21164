//! A page as PDF, all text as outlines.

use std::collections::BTreeMap;

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::LineJoinStyle;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};

use super::about::About;
use super::page::{Colour, PER_INCH, POINTS, Page, Paint, Segment};
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
    let Drawn { content: drawn, strengths, pictures } = drawn(page, scale, height);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([only]).count(1);
    let mut sheet = pdf.page(only);
    sheet.parent(pages).media_box(Rect::new(0.0, 0.0, width, height)).contents(content);
    let mut resources = sheet.resources();
    let mut states = resources.ext_g_states();
    for (name, at) in strengths.values().zip(6..) {
        states.pair(Name(name.as_bytes()), Ref::new(at));
    }
    states.finish();
    // Two for each: its colours, and where it has some.
    let of_pictures = || (6 + strengths.len() as i32..).step_by(2).map(Ref::new);
    if !pictures.is_empty() {
        let mut objects = resources.x_objects();
        for (n, at) in (0..pictures.len()).zip(of_pictures()) {
            objects.pair(Name(picture_name(n).as_bytes()), at);
        }
    }
    resources.finish();
    sheet.finish();
    for (strength, at) in strengths.keys().zip(6..) {
        let strength = *strength as f32 / 100.0;
        pdf.ext_graphics(Ref::new(at)).non_stroking_alpha(strength).stroking_alpha(strength);
    }
    for (raster, at) in pictures.into_iter().zip(of_pictures()) {
        picture(&mut pdf, raster, at);
    }
    let packed = compress_to_vec_zlib(&drawn, LEVEL);
    pdf.stream(content, &packed).filter(Filter::FlateDecode);
    let facts: Vec<String> =
        about.facts().into_iter().map(|(word, value)| format!("{word}: {value}")).collect();
    pdf.document_info(info)
        .title(TextStr(&about.title))
        .subject(TextStr(&about.caption))
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
    write(at, raster.rgb(), false);
    if let Some(mask) = mask {
        write(mask, raster.mask(), true);
    }
}

fn picture_name(n: usize) -> String {
    format!("P{n}")
}

/// The content, the names of the strengths of its colours, in hundredths, and the pictures that it has.
struct Drawn<'a> {
    content: Vec<u8>,
    strengths: BTreeMap<u8, String>,
    pictures: Vec<&'a Raster>,
}

fn drawn(page: &Page, scale: f32, height: f32) -> Drawn<'_> {
    let mut content = Content::new();
    let mut strengths = BTreeMap::new();
    let mut pictures = Vec::new();
    content.transform([scale, 0.0, 0.0, -scale, 0.0, height]);
    content.set_line_join(LineJoinStyle::RoundJoin);
    for item in &page.items {
        match &item.paint {
            Paint::Fill(colour) => {
                let is_pale = begin(&mut content, &mut strengths, colour);
                let [r, g, b] = rgb(colour);
                content.set_fill_rgb(r, g, b);
                outline(&mut content, &item.path);
                content.fill_nonzero();
                end(&mut content, is_pale);
            }
            Paint::Stroke { colour, width, dashes } => {
                let is_pale = begin(&mut content, &mut strengths, colour);
                let [r, g, b] = rgb(colour);
                content.set_stroke_rgb(r, g, b);
                content.set_line_width(*width as f32);
                content.set_dash_pattern(dashes.iter().map(|length| *length as f32), 0.0);
                outline(&mut content, &item.path);
                content.stroke();
                end(&mut content, is_pale);
            }
            Paint::Raster(raster) => {
                let ((x, y), (width, height)) = (raster.corner(), raster.size());
                content.save_state();
                // A picture is one wide and one high, from its lower left corner.
                let (left, bottom) = (x as f32 + WITHIN, y as f32 + height as f32 - WITHIN);
                let (wide, high) = (width as f32 - 2.0 * WITHIN, height as f32 - 2.0 * WITHIN);
                content.transform([wide, 0.0, 0.0, -high, left, bottom]);
                content.x_object(Name(picture_name(pictures.len()).as_bytes()));
                content.restore_state();
                pictures.push(raster);
            }
        }
    }
    Drawn { content: content.finish().to_vec(), strengths, pictures }
}

/// Sets the strength of a colour, if it has not all of it; whether it has not.
fn begin(content: &mut Content, strengths: &mut BTreeMap<u8, String>, colour: &Colour) -> bool {
    let is_pale = colour.strength < 1.0;
    if is_pale {
        let hundredths = (colour.strength * 100.0).round() as u8;
        let name = strengths.entry(hundredths).or_insert_with(|| format!("S{hundredths}"));
        content.save_state();
        content.set_parameters(Name(name.as_bytes()));
    }
    is_pale
}

fn end(content: &mut Content, is_pale: bool) {
    if is_pale {
        content.restore_state();
    }
}

fn rgb(colour: &Colour) -> [f32; 3] {
    let (r, g, b) = colour.rgb;
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
