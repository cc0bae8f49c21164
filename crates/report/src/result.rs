//! What a study found: its first figure beside the claims that differ, before what was asked.

use asperity_numbers::claim::Claim;

use crate::claims;
use crate::figures::{Figure, first};
use crate::html::markup::section;

/// The answer of a study, which a reader sees before anything has to be scrolled.
pub(crate) fn result(figures: &[Figure], claims: &[Claim]) -> String {
    let parts = [first(figures, claims), section(claims::DIFFERING, &claims::differing(claims))].concat();
    if parts.is_empty() { parts } else { format!("<div class=\"result\">\n{parts}</div>\n") }
}
