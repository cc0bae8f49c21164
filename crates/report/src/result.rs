//! What a study found: its first figure beside the claims that differ, before what was asked.

use asperity_numbers::claim::Claim;

use crate::claims;
use crate::figures::{Figure, about, first};
use crate::html::markup::section;

/// The answer of a study, which a reader sees before anything has to be scrolled.
pub(crate) fn result(figures: &[Figure], claims: &[Claim]) -> String {
    let differing = claims::differing(claims, &|claim| about(claim, figures));
    let parts = [first(figures, claims), section(claims::DIFFERING, &differing)].concat();
    if parts.is_empty() { parts } else { format!("<div class=\"result\">\n{parts}</div>\n") }
}
