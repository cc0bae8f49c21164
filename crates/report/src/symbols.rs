//! Symbols and numbers as they are printed.

use asperity_page::markup::text;

/// Names of Greek letters in symbols, and the letters. A name that holds another stands before it.
const GREEK: [(&str, &str); 8] = [
    ("lambda", "λ"),
    ("theta", "θ"),
    ("beta", "β"),
    ("eta", "η"),
    ("tau", "τ"),
    ("mu", "μ"),
    ("nu", "ν"),
    ("dt", "Δt"),
];

/// A symbol of the key table as HTML: `mu_s` as the letter with its subscript.
pub(crate) fn symbol(written: &str) -> String {
    let part = |part: &str| {
        let (name, index) = part.split_once('_').map_or((part, None), |(name, index)| (name, Some(index)));
        let letter = GREEK.iter().find(|(word, _)| *word == name).map_or(name, |(_, letter)| letter);
        let index = index.map_or(String::new(), |index| format!("<sub>{}</sub>", text(index)));
        let letter = text(letter);
        if letter.chars().all(char::is_alphabetic) && !letter.starts_with('Δ') && letter != "sqrt" {
            format!("<i>{letter}</i>{index}")
        } else {
            format!("{letter}{index}")
        }
    };
    if written == "eta / sqrt(k m)" {
        return "<i>η</i>/√(<i>km</i>)".to_owned();
    }
    written.split(' ').map(part).collect::<String>()
}

/// Words with formulas between dollar signs, as the source writes them, as HTML.
pub(crate) fn formulas(words: &str) -> String {
    const SIGNS: [(&str, &str); 14] = [
        ("\\rightarrow", "→"),
        ("\\infty", "∞"),
        ("\\alpha", "α"),
        ("\\approx", "≈"),
        ("\\cdot", "·"),
        ("\\%", "%"),
        ("\\int", "∫"),
        ("\\pm", "±"),
        ("\\sqrt", "√"),
        ("\\text ", ""),
        ("\\mathrm", ""),
        ("\\left", ""),
        ("\\right", ""),
        ("~", " "),
    ];
    let parts: Vec<&str> = words.split('$').collect();
    if parts.len().is_multiple_of(2) {
        return text(words);
    }
    let formula = |part: &str| {
        let mut out = part.to_owned();
        for (word, letter) in SIGNS {
            out = out.replace(word, letter);
        }
        for (word, letter) in GREEK {
            out = out.replace(&format!("\\{word}"), letter);
        }
        let mut html = String::new();
        let mut rest = text(out).replace("\\", "").replace("{{", "{").replace("}}", "}");
        // `_{p}` and `_p` are subscripts, `^` in place of `_` superscripts; braces elsewhere group.
        while let Some((before, after)) = rest.clone().split_once(['_', '^']) {
            let tag = if rest[before.len()..].starts_with('_') { "sub" } else { "sup" };
            let (index, left) = match after.strip_prefix('{').and_then(|after| after.split_once('}')) {
                Some((index, left)) => (index, left),
                None => after.split_at(after.chars().next().map_or(0, char::len_utf8)),
            };
            html += &format!("{}<{tag}>{}</{tag}>", before.replace(['{', '}'], ""), index.trim());
            rest = left.to_owned();
        }
        html + &rest.replace(['{', '}'], "")
    };
    let set = |(n, part): (usize, &&str)| if n % 2 == 1 { formula(part) } else { text(part) };
    parts.iter().enumerate().map(set).collect()
}

/// The same as plain text, for headings and labels.
pub(crate) fn plain(written: &str) -> String {
    let mut out = written.to_owned();
    for (word, letter) in GREEK {
        out = out.replace(word, letter);
    }
    out.replace(" / ", "/")
}

/// A number as HTML: powers of ten where digits would have to be counted.
pub(crate) fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1e-3..1e5).contains(&size) {
        return signed(&value.to_string());
    }
    let text = format!("{value:e}");
    let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
    let power = power.replace('-', "−");
    match digits {
        "1" => format!("10<sup>{power}</sup>"),
        "-1" => format!("−10<sup>{power}</sup>"),
        digits => format!("{} × 10<sup>{power}</sup>", signed(digits)),
    }
}

/// The same with so many significant digits.
pub(crate) fn rounded(value: f64, digits: usize) -> String {
    number(round(value, digits))
}

/// A number with so many significant digits.
pub(crate) fn round(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

fn signed(text: &str) -> String {
    text.replace('-', "−")
}

/// A number with its unit, without markup that SVG does not know.
pub(crate) fn spelled(value: f64, unit: &str) -> String {
    let html = number(value);
    let Some((digits, power)) = html.split_once("<sup>") else { return format!("{html} {unit}") };
    let power = power.trim_end_matches("</sup>");
    format!("{digits}<tspan class=\"d\" dy=\"-5\">{power}</tspan><tspan dy=\"5\"> {unit}</tspan>")
}

#[cfg(test)]
mod tests {
    use super::{formulas, number, plain, round, rounded, symbol};

    #[test]
    fn symbols_are_those_of_the_field() {
        assert_eq!(symbol("mu_s"), "<i>μ</i><sub>s</sub>");
        assert_eq!(symbol("k_t / k"), "<i>k</i><sub>t</sub>/<i>k</i>");
        assert_eq!((symbol("dt").as_str(), plain("theta").as_str()), ("Δt", "θ"));
        assert_eq!((plain("beta"), plain("k_t / k")), ("β".to_owned(), "k_t/k".to_owned()));
    }

    #[test]
    fn formulas_of_the_source_can_be_read() {
        assert_eq!(formulas("$L_{p}$ falls, $\\mu_k$ < 1"), "L<sub>p</sub> falls, μ<sub>k</sub> &lt; 1");
        assert_eq!(formulas("$k_t/k \\rightarrow \\infty$"), "k<sub>t</sub>/k → ∞");
        assert_eq!(formulas("$F_{N}^{\\text {start }}$"), "F<sub>N</sub><sup>start</sup>");
        assert_eq!(formulas("for 5 $"), "for 5 $");
    }

    #[test]
    fn numbers_have_powers_of_ten() {
        assert_eq!(
            (number(1e-8).as_str(), number(2.5e9).as_str()),
            ("10<sup>−8</sup>", "2.5 × 10<sup>9</sup>")
        );
        assert_eq!((number(-0.5).as_str(), number(0.0).as_str()), ("−0.5", "0"));
        assert_eq!((rounded(0.123456, 3).as_str(), round(2.648_123_4, 5)), ("0.123", 2.6481));
    }
}
