//! A page as a file: its head, its words, its data, its scripts.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use sha2::{Digest as _, Sha256};

use crate::html::markup::text;

const LOOK: &str = include_str!("look.css");
const BASE: &str = include_str!("base.js");

/// Additions to the words of a page: a style and a script. Either may be empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// CSS.
    pub style: &'static str,
    /// JavaScript. It exports functions by adding them to `asperity`.
    pub script: &'static str,
}

/// The space-time map on a canvas: `asperity.map`. One, or several one above the other; time
/// across, blocks up.
pub const MAP: Part = Part { style: "", script: include_str!("map.js") };

/// Curves on a canvas: `uPlot` (MIT, see `vendor/uplot`).
pub const CURVES: Part = Part {
    style: include_str!("vendor/uplot/uPlot.min.css"),
    script: include_str!("vendor/uplot/uPlot.iife.min.js"),
};

/// A table of any length that renders only visible rows: `asperity.longTable`.
pub const LONG_TABLE: Part = Part { style: "", script: include_str!("long_table.js") };

/// A page.
#[derive(Debug, Clone)]
pub struct Document<'a> {
    /// Its title, as plain text.
    pub title: String,
    /// Its content, as HTML.
    pub main: String,
    /// Data for its scripts: attributes of each script element, as HTML, and JSON as
    /// [`markup::json`](crate::html::markup::json) writes it.
    pub data: Vec<(String, String)>,
    /// Its parts; those used by others come before them.
    pub parts: &'a [Part],
}

impl Document<'_> {
    /// The file. A policy in its head keeps the browser from fetching anything, and from running other scripts than
    /// those of the page.
    pub fn html(&self) -> String {
        self.with_pictures_from("data:")
    }

    /// Formats a page, and allows pictures from these sources to be shown.
    pub(crate) fn with_pictures_from(&self, sources: &str) -> String {
        let styles = Inline::of(std::iter::once(LOOK).chain(self.parts.iter().map(|part| part.style)));
        let scripts = Inline::of(std::iter::once(BASE).chain(self.parts.iter().map(|part| part.script)));
        let mut out = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src{}; \
             script-src{}; img-src {sources}; base-uri 'none'; form-action 'none'\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{}</title>\n",
            styles.sources,
            scripts.sources,
            text(&self.title)
        );
        styles.contents.iter().for_each(|style| out += &format!("<style>{style}</style>\n"));
        out += "</head>\n<body>\n\
                <button id=\"theme\" class=\"needs-script\" type=\"button\">dark</button>\n<main>\n";
        out += &self.main;
        out += "</main>\n";
        for (attributes, json) in &self.data {
            out += &format!("<script type=\"application/json\"{attributes}>{json}</script>\n");
        }
        scripts.contents.iter().for_each(|script| out += &format!("<script>{script}</script>\n"));
        out += "</body>\n</html>\n";
        out
    }
}

/// The contents of the style or script elements of a page, and their hashes for its policy. A browser applies nothing
/// else: no style or script from the words or the data of a page, and no attribute such as `style` or `onclick`.
struct Inline {
    contents: Vec<String>,
    sources: String,
}

impl Inline {
    fn of(contents: impl Iterator<Item = &'static str>) -> Inline {
        let contents: Vec<String> =
            contents.filter(|content| !content.is_empty()).map(|content| format!("\n{content}")).collect();
        let sources =
            contents.iter().map(|content| format!(" 'sha256-{}'", BASE64.encode(Sha256::digest(content))));
        Inline { sources: sources.collect(), contents }
    }
}

#[cfg(test)]
mod tests {
    use super::{CURVES, Document, LONG_TABLE, MAP};

    #[test]
    fn scripts_do_not_end_before_they_are_over() {
        let parts = [CURVES, MAP, LONG_TABLE];
        let html = Document { title: String::new(), main: String::new(), data: vec![], parts: &parts }.html();
        assert_eq!(html.matches("<script").count(), 4);
        assert_eq!(html.matches("</script").count(), 4);
        assert_eq!(html.matches("</style").count(), 2);
    }

    /// Text from others is unchanged.
    #[test]
    fn vendored_files_are_those_that_the_readme_names() {
        let readme = include_str!("vendor/uplot/README.md");
        assert!(readme.contains("uPlot 1.6.32") && CURVES.script.contains("uPlot (v1.6.32)"));
        for (name, file) in [("uPlot.iife.min.js", CURVES.script), ("uPlot.min.css", CURVES.style)] {
            let line = format!("| `{name}` | `{}` |", blake3::hash(file.as_bytes()).to_hex());
            assert!(readme.contains(&line), "README.md has no line {line}");
        }
        assert!(include_str!("vendor/uplot/LICENSE").contains("MIT License"));
    }
}
