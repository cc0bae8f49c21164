//! A page as SVG, all text as outlines.

use std::fmt::{self, Write};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::about::About;
use super::page::{Colour, Item, PER_INCH, POINTS, Page, Paint, Segment, short};
use super::png;
use super::raster::Raster;

pub(super) fn bytes(page: &Page, about: &About) -> Result<Vec<u8>, String> {
    let pictures = page.items.iter().map(|item| match &item.paint {
        Paint::Raster(raster) => png::of_raster(raster),
        Paint::Fill(_) | Paint::Stroke { .. } => Ok(Vec::new()),
    });
    let pictures = pictures.collect::<Result<Vec<Vec<u8>>, String>>()?;
    let mut text = String::new();
    write(&mut text, page, &pictures, about).expect("a text takes whatever is written");
    Ok(text.into_bytes())
}

/// `pictures` are the PNG of the items that are pixels.
fn write(text: &mut String, page: &Page, pictures: &[Vec<u8>], about: &About) -> fmt::Result {
    let (width, height) = (page.width, page.height);
    let points = |units: u32| short(f64::from(units) / PER_INCH * POINTS);
    write!(
        text,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" \
         width=\"{}pt\" height=\"{}pt\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<desc>{}</desc>\n",
        points(width),
        points(height),
        escaped(&about.title),
        escaped(&about.caption),
    )?;
    *text += "<metadata>\n<figure xmlns=\"urn:asperity:figure\">\n";
    for (word, value) in about.facts() {
        writeln!(text, "<{word}>{}</{word}>", escaped(&value))?;
    }
    *text += "</figure>\n</metadata>\n";
    writeln!(text, "<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>")?;
    for (item, picture) in page.items.iter().zip(pictures) {
        match &item.paint {
            Paint::Raster(raster) => {
                image(text, item, raster, picture)?;
                continue;
            }
            Paint::Fill(colour) => {
                begin_path(text, item)?;
                paint(text, "fill", colour)?;
            }
            Paint::Stroke { colour, width, dashes } => {
                begin_path(text, item)?;
                *text += " fill=\"none\"";
                paint(text, "stroke", colour)?;
                write!(text, " stroke-width=\"{}\" stroke-linejoin=\"round\"", short(*width))?;
                if !dashes.is_empty() {
                    let pattern: Vec<String> = dashes.iter().map(|length| short(*length)).collect();
                    write!(text, " stroke-dasharray=\"{}\"", pattern.join(" "))?;
                }
            }
        }
        *text += " d=\"";
        outline(text, &item.path)?;
        *text += "\"/>\n";
    }
    *text += "</svg>\n";
    Ok(())
}

/// The commands of a path.
fn outline(text: &mut String, path: &[Segment]) -> fmt::Result {
    path.iter().try_for_each(|segment| match *segment {
        Segment::Move((x, y)) => write!(text, "M{} {}", short(x), short(y)),
        Segment::Line((x, y)) => write!(text, "L{} {}", short(x), short(y)),
        Segment::Curve(a, b, to) => {
            let [a, b, to] = [a, b, to].map(|(x, y)| format!("{} {}", short(x), short(y)));
            write!(text, "C{a} {b} {to}")
        }
        Segment::Close => write!(text, "Z"),
    })
}

fn begin_path(text: &mut String, item: &Item) -> fmt::Result {
    write!(text, "<path class=\"{}\"", item.role.word())?;
    if !item.text.is_empty() {
        write!(text, " aria-label=\"{}\"", escaped(&item.text))?;
    }
    Ok(())
}

fn image(text: &mut String, item: &Item, raster: &Raster, picture: &[u8]) -> fmt::Result {
    let ((x, y), (width, height)) = (raster.corner(), raster.size());
    writeln!(
        text,
        "<image class=\"{}\" x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" \
         href=\"data:image/png;base64,{}\"/>",
        item.role.word(),
        short(x),
        short(y),
        STANDARD.encode(picture)
    )
}

fn paint(text: &mut String, what: &str, colour: &Colour) -> fmt::Result {
    let (r, g, b) = colour.rgb;
    write!(text, " {what}=\"#{r:02x}{g:02x}{b:02x}\"")?;
    if colour.strength < 1.0 {
        write!(text, " {what}-opacity=\"{}\"", short(colour.strength))?;
    }
    Ok(())
}

fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe += "&amp;",
            '<' => safe += "&lt;",
            '>' => safe += "&gt;",
            '"' => safe += "&quot;",
            // XML has no place for other control characters.
            control if control.is_control() => safe.push(' '),
            letter => safe.push(letter),
        }
    }
    safe
}

#[cfg(test)]
mod tests {
    use super::super::page::Segment::{Close, Curve, Line, Move};
    use super::outline;

    #[test]
    fn outlines_keep_the_order_of_their_points() {
        let path = [Move((1.0, 2.0)), Line((3.0, 4.5)), Curve((5.0, 6.0), (7.0, 8.0), (9.0, -0.001)), Close];
        let mut text = String::new();
        outline(&mut text, &path).expect("a text takes whatever is written");
        assert_eq!(text, "M1 2L3 4.5C5 6 7 8 9 0Z");
    }
}
