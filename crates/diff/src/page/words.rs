//! What the page calls classes, runs and numbers, and how it sets them.

use asperity_report::html::markup::{Cell, short, text};

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

/// The swatch of a class, as the timeline draws it.
pub(super) fn key(class: Class) -> String {
    format!(
        "<canvas class=\"key needs-script\" width=\"22\" height=\"14\" data-look=\"{}\" aria-hidden=\"true\"></canvas>",
        class.name()
    )
}

/// The cell of a class: its swatch and what it is called.
pub(super) fn class_cell(class: Class) -> Cell {
    Cell::Html(format!("<span class=\"class\">{}{}</span>", key(class), text(title(class))))
}

/// A difference, without digits for what does not differ.
pub(super) fn short_or_zero(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { short(value) }
}
