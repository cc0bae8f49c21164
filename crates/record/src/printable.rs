//! Escapes text from outside for output in lines of this program.
//!
//! Names of files, runs and topics and the values in a log may be any text. Printed unchanged, a line
//! break in one could fake a line of this program, an escape sequence could rewrite the terminal, and a
//! direction mark could display letters in another order.

use std::borrow::Cow;
use std::fmt::Write;

/// Escapes every character that does not simply appear in its place: control characters (C0, DEL, C1),
/// separators of lines and paragraphs, and marks that change the direction of writing. They are written
/// as in a Rust literal, `\n` or `\u{202e}`.
///
/// ```
/// use asperity_record::printable;
///
/// assert_eq!(printable("F_T / F_N = 0.45, µ"), "F_T / F_N = 0.45, µ");
/// assert_eq!(printable("x\nfake: whole"), "x\\nfake: whole");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(acts) {
        return text.into();
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if acts(c) {
            write!(out, "{}", c.escape_default()).expect("a string takes what is written to it");
        } else {
            out.push(c);
        }
    }
    out.into()
}

/// Whether a terminal or a page acts on a character instead of displaying it.
fn acts(c: char) -> bool {
    c.is_control()
        || matches!(c,
            '\u{2028}' | '\u{2029}'
            // Arabic letter mark, left-to-right and right-to-left marks; embeddings, overrides
            // and isolates.
            | '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::printable;

    #[test]
    fn whatever_acts_on_a_terminal_is_spelled_out() {
        assert_eq!(printable("a\r\n\tb\u{7f}\u{9b}31m"), "a\\r\\n\\tb\\u{7f}\\u{9b}31m");
        assert_eq!(
            printable("\u{1b}[2K\u{202e}txt\u{2069}\u{2028}"),
            "\\u{1b}[2K\\u{202e}txt\\u{2069}\\u{2028}"
        );
        let all: String = (0..=0x10_ffff).filter_map(char::from_u32).collect();
        let shown = printable(&all);
        assert!(shown.chars().all(|c| !c.is_control()));
        assert_eq!(shown, printable(&shown), "what is escaped is plain");
        assert!(matches!(printable("slider, 100 blocks: µ = 0.45 \u{2192}"), std::borrow::Cow::Borrowed(_)));
    }
}
