//! A page as SVG, all text as outlines.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use plotters::style::RGBAColor;

use super::about::About;
use super::page::{Item, PER_INCH, POINTS, Page, Paint, Point, Segment, short};
use super::png;

pub(super) fn bytes(page: &Page, about: &About) -> Result<Vec<u8>, String> {
    let (width, height) = (page.width, page.height);
    let points = |units: u32| short(f64::from(units) / PER_INCH * POINTS);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" \
         width=\"{}pt\" height=\"{}pt\" viewBox=\"0 0 {width} {height}\">\n<title>{}</title>\n<desc>{}</desc>\n\
         <metadata>\n<figure xmlns=\"urn:asperity:figure\">\n",
        points(width),
        points(height),
        escaped(&about.words.title),
        escaped(&about.words.caption),
    );
    for (word, value) in about.facts() {
        text += &format!("<{word}>{}</{word}>\n", escaped(&value));
    }
    text += "</figure>\n</metadata>\n";
    text += &format!("<rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n");
    for item in &page.items {
        text += &element(item)?;
    }
    text += "</svg>\n";
    Ok(text.into_bytes())
}

/// A path or a picture.
fn element(item: &Item) -> Result<String, String> {
    let class = item.role.0;
    let painted = match &item.paint {
        Paint::Raster(raster) => {
            let ((x, y), (width, height)) = (raster.corner(), raster.size());
            return Ok(format!(
                "<image class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" \
                 href=\"data:image/png;base64,{}\"/>\n",
                short(x),
                short(y),
                STANDARD.encode(png::of_raster(raster)?)
            ));
        }
        Paint::Fill(colour) => painted("fill", *colour),
        Paint::Stroke { colour, width, dashes } => {
            let (stroke, width) = (painted("stroke", *colour), short(*width));
            let pattern: Vec<String> = dashes.iter().map(|length| short(*length)).collect();
            let dashes = attribute("stroke-dasharray", &pattern.join(" "));
            format!(" fill=\"none\"{stroke} stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}")
        }
    };
    let label = attribute("aria-label", &escaped(&item.text));
    Ok(format!("<path class=\"{class}\"{label}{painted} d=\"{}\"/>\n", outline(&item.path)))
}

/// An attribute, if it has a value.
fn attribute(name: &str, value: &str) -> String {
    if value.is_empty() { String::new() } else { format!(" {name}=\"{value}\"") }
}

/// The commands of a path.
fn outline(path: &[Segment]) -> String {
    let place = |(x, y): Point| format!("{} {}", short(x), short(y));
    let command = |segment: &Segment| match *segment {
        Segment::Move(to) => format!("M{}", place(to)),
        Segment::Line(to) => format!("L{}", place(to)),
        Segment::Curve(a, b, to) => format!("C{} {} {}", place(a), place(b), place(to)),
        Segment::Close => "Z".to_owned(),
    };
    path.iter().map(command).collect()
}

fn painted(what: &str, RGBAColor(r, g, b, strength): RGBAColor) -> String {
    let opacity = if strength < 1.0 { short(strength) } else { String::new() };
    format!(" {what}=\"#{r:02x}{g:02x}{b:02x}\"{}", attribute(&format!("{what}-opacity"), &opacity))
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
        assert_eq!(outline(&path), "M1 2L3 4.5C5 6 7 8 9 0Z");
    }
}
