//! HTML by hand: escaping, and tables. The page is one document of a fixed
//! form, for which a template language would be one more thing to know.

use std::fmt::Display;

use asperity_record::printable;

/// A value as text in HTML, in content and in quoted attributes. Marks that turn the direction of
/// writing would show the rest of the line in another order, so they are spelled out.
pub(super) fn text(value: impl Display) -> String {
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
pub(super) fn json(value: &impl serde::Serialize) -> String {
    let json = serde_json::to_string(value)
        .expect("what a timeline is drawn from is numbers and texts, which JSON can always hold");
    json.replace('<', "\\u003c")
}

/// A cell of a table.
pub(super) enum Cell {
    /// Text, escaped here.
    Text(String),
    /// A number, set to the right.
    Number(String),
    /// HTML that is escaped already.
    Html(String),
    /// Nothing.
    None,
}

impl Cell {
    pub(super) fn text(value: impl Display) -> Cell {
        Cell::Text(value.to_string())
    }

    pub(super) fn number(value: impl Display) -> Cell {
        Cell::Number(value.to_string())
    }

    /// A number, or nothing for none.
    pub(super) fn optional(value: Option<impl Display>) -> Cell {
        value.map_or(Cell::None, Cell::number)
    }

    fn html(&self) -> String {
        match self {
            Cell::Text(value) => format!("<td>{}</td>", text(value)),
            Cell::Number(value) => format!("<td class=\"number\">{}</td>", text(value)),
            Cell::Html(html) => format!("<td>{html}</td>"),
            Cell::None => "<td class=\"number none\">–</td>".to_owned(),
        }
    }
}

/// A row, with what else its tag says.
pub(super) struct Row {
    pub(super) attributes: String,
    pub(super) cells: Vec<Cell>,
}

impl From<Vec<Cell>> for Row {
    fn from(cells: Vec<Cell>) -> Row {
        Row { attributes: String::new(), cells }
    }
}

/// A table. Headings that begin with `#` are of numbers.
pub(super) fn table(caption: &str, headings: &[&str], rows: impl IntoIterator<Item = Row>) -> String {
    let mut out = String::from("<table>");
    if !caption.is_empty() {
        out.push_str(&format!("<caption>{}</caption>", text(caption)));
    }
    out.push_str("<thead><tr>");
    for heading in headings {
        match heading.strip_prefix('#') {
            Some(heading) => {
                out.push_str(&format!("<th scope=\"col\" class=\"number\">{}</th>", text(heading)))
            }
            None => out.push_str(&format!("<th scope=\"col\">{}</th>", text(heading))),
        }
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in rows {
        out.push_str(&format!("<tr{}>", row.attributes));
        row.cells.iter().for_each(|cell| out.push_str(&cell.html()));
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table>\n");
    out
}
