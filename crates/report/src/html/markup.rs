//! HTML by hand: escaping, and tables. A page is one document of a fixed form, for which a template
//! language would be one more thing to know.

use std::fmt::Display;

use asperity_numbers::estimate::Estimate;
pub use asperity_record::counted;
use asperity_record::{Cell as Stored, printable};

use crate::symbols::rounded;

/// A value as text in HTML, in content and in quoted attributes. Marks that turn the direction of
/// writing would show the rest of the line in another order, so they are spelled out.
pub fn text(value: impl Display) -> String {
    let mut out = String::new();
    for c in printable(&value.to_string()).chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// JSON as the content of a script element, which a tag within would end.
///
/// # Panics
/// If JSON cannot represent it, such as a map whose keys are no texts.
pub fn json(value: &impl serde::Serialize) -> String {
    let json =
        serde_json::to_string(value).expect("what a page knows is numbers and texts, which JSON holds");
    json.replace('<', "\\u003c")
}

/// A section under a heading; empty without content.
pub fn section(title: &str, body: &str) -> String {
    if body.is_empty() {
        String::new()
    } else {
        format!("<section id=\"{}\">\n<h2>{}</h2>\n{body}</section>\n", section_id(title), text(title))
    }
}

/// The id of a section, as links name it.
pub fn section_id(title: &str) -> String {
    let words = title.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let words: Vec<String> = words.map(str::to_ascii_lowercase).collect();
    format!("part-{}", words.join("-"))
}

/// The sections with content, preceded by a list of links to them.
pub fn sections_with_contents(sections: &[(&str, String)]) -> String {
    let there = || sections.iter().filter(|(_, body)| !body.is_empty());
    let links: Vec<String> =
        there().map(|(title, _)| format!("<a href=\"#{}\">{}</a>", section_id(title), text(title))).collect();
    let all: String = there().map(|(title, body)| section(title, body)).collect();
    format!("<nav aria-label=\"Contents\"><b>Contents:</b> {}</nav>\n{all}", links.join(" · "))
}

/// A key, a column or another name, which breaks between its words alone.
pub fn name(name: &str) -> String {
    format!("<code class=\"name\">{}</code>", text(name).replace('_', "_<wbr>").replace('.', ".<wbr>"))
}

/// A paragraph of plain text.
pub fn paragraph(words: &str) -> String {
    format!("<p>{}</p>\n", text(words))
}

/// A number by three decimals or, if it is large or small, three digits.
pub fn short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e4).contains(&value.abs()) {
        format!("{value:.2e}")
    } else {
        format!("{value:.3}")
    }
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// Text, escaped here.
    Text(String),
    /// A number, set to the right.
    Number(String),
    /// A number that is shown as HTML, and sorted by its value.
    Value(f64, String),
    /// HTML that is escaped already.
    Html(String),
    /// Nothing.
    None,
}

impl Cell {
    /// Text.
    pub fn text(value: impl Display) -> Cell {
        Cell::Text(value.to_string())
    }

    /// A number.
    pub fn number(value: impl Display) -> Cell {
        Cell::Number(value.to_string())
    }

    /// A number, rounded to that many significant digits, or nothing for none.
    pub(crate) fn rounded(value: impl Into<Option<f64>>, digits: usize) -> Cell {
        value.into().map_or(Cell::None, |value| Cell::Value(value, rounded(value, digits)))
    }

    /// A number to two digits of its error, or without one, rounded to that many digits.
    pub(crate) fn estimate(value: Option<f64>, error: Option<f64>, digits: usize) -> Cell {
        match (value, error) {
            (Some(value), Some(error)) => Cell::Value(value, Estimate { value, error }.to_string()),
            _ => Cell::rounded(value, digits),
        }
    }

    /// A cell of a table of data, with that many digits of a double.
    pub(crate) fn of(cell: &Stored, digits: usize) -> Cell {
        match cell {
            Stored::Empty => Cell::None,
            Stored::Number(value) => Cell::rounded(*value, digits),
            Stored::Count(_) | Stored::Step(_) => Cell::number(cell),
            Stored::Flag(flag) => Cell::text(if *flag { "yes" } else { "no" }),
            Stored::Word(word) => Cell::text(word),
        }
    }

    fn html(&self) -> String {
        match self {
            Cell::Text(value) => format!("<td>{}</td>", text(value)),
            Cell::Number(value) => format!("<td class=\"number\">{}</td>", text(value)),
            Cell::Value(value, html) => format!("<td class=\"number\" data-value=\"{value}\">{html}</td>"),
            Cell::Html(html) => format!("<td>{html}</td>"),
            Cell::None => "<td class=\"number none\">–</td>".to_owned(),
        }
    }
}

/// A row, with further attributes of its tag.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Further attributes, as HTML.
    pub attributes: String,
    /// Its cells.
    pub cells: Vec<Cell>,
}

impl From<Vec<Cell>> for Row {
    fn from(cells: Vec<Cell>) -> Row {
        Row { attributes: String::new(), cells }
    }
}

/// A table, which scrolls by itself where it is wider than the page; one with an id is made sortable by scripts and,
/// if it is long, filterable. Headings are HTML; those that begin with `#` are of numbers.
pub fn table(
    id: &str,
    caption: &str,
    headings: &[impl AsRef<str>],
    rows: impl IntoIterator<Item = Row>,
) -> String {
    let attributes = match id {
        "" => String::new(),
        id => format!(" id=\"{}\" class=\"sortable\"", text(id)),
    };
    let mut out = format!("<div class=\"wide\"><table{attributes}>");
    if !caption.is_empty() {
        out.push_str(&format!("<caption>{}</caption>", text(caption)));
    }
    out.push_str("<thead><tr>");
    for heading in headings.iter().map(AsRef::as_ref) {
        match heading.strip_prefix('#') {
            Some(heading) => out.push_str(&format!("<th scope=\"col\" class=\"number\">{heading}</th>")),
            None => out.push_str(&format!("<th scope=\"col\">{heading}</th>")),
        }
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        out.push_str(&format!("<tr{}>", row.attributes));
        row.cells.iter().for_each(|cell| out.push_str(&cell.html()));
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
    out
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn numbers_are_short_at_either_end() {
        let numbers = [0.0, 9.99e-4, 1e-3, 9999.9, 1e4, -1e4].map(short);
        assert_eq!(numbers, ["0.000", "9.99e-4", "0.001", "9999.900", "1.00e4", "-1.00e4"]);
    }
}
