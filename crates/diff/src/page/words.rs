//! What the page calls classes, runs and numbers, and how it sets them.

use super::markup::{Cell, text};
use crate::report::{Class, RunDiff};

/// What a class is called in sentences.
pub(super) fn title(class: Class) -> String {
    match class {
        Class::Open => "open at the edge".to_owned(),
        other => other.name().replace('-', " "),
    }
}

/// What a pair of runs is called.
pub(super) fn name(run: &RunDiff) -> String {
    if run.old.name == run.new.name {
        run.old.name.clone()
    } else {
        format!("{} → {}", run.old.name, run.new.name)
    }
}

/// A section under a heading; nothing where there is nothing to say.
pub(super) fn section(title: &str, body: &str) -> String {
    if body.is_empty() {
        String::new()
    } else {
        format!("<section>\n<h2>{}</h2>\n{body}</section>\n", text(title))
    }
}

/// A paragraph of plain text.
pub(super) fn paragraph(words: &str) -> String {
    format!("<p>{}</p>\n", text(words))
}

/// A number and its thing, in the singular where there is one.
pub(super) fn counted(count: u64, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// The swatch of a class, as the timeline draws it.
pub(super) fn key(class: Class) -> String {
    format!(
        "<canvas class=\"key needs-script\" width=\"22\" height=\"14\" data-class=\"{}\" aria-hidden=\"true\"></canvas>",
        class.name()
    )
}

/// The cell of a class: its swatch and what it is called.
pub(super) fn class_cell(class: Class) -> Cell {
    Cell::Html(format!("<span class=\"class\">{}{}</span>", key(class), text(title(class))))
}

/// A difference: three digits tell how large it is.
pub(super) fn short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e4).contains(&value.abs()) {
        format!("{value:.2e}")
    } else {
        format!("{value:.3}")
    }
}

/// The same, without digits for what does not differ.
pub(super) fn short_or_zero(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { short(value) }
}
