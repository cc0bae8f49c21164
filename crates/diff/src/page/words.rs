//! Names of classes, runs and numbers on the page, and their markup.

use asperity_report::html::markup::{Cell, short, text};

use crate::report::{Class, RunDiff};

/// The name of a class in sentences.
pub(super) fn title(class: Class) -> String {
    match class {
        Class::Open => "open at the edge".to_owned(),
        other => other.name().replace('-', " "),
    }
}

/// The name of a pair of runs.
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

/// The cell of a class: its swatch and name.
pub(super) fn class_cell(class: Class) -> Cell {
    Cell::Html(format!("<span class=\"class\">{}{}</span>", key(class), text(title(class))))
}

/// A difference, without digits if it is zero.
pub(super) fn short_or_zero(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { short(value) }
}
