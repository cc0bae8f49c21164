//! Symbols and numbers as they are printed.

use crate::html::markup::text;

/// Names of Greek letters in symbols, and the letters. A name that holds another stands before it.
const GREEK: [(&str, &str); 11] = [
    ("alpha", "α"),
    ("gamma", "γ"),
    ("lambda", "λ"),
    ("theta", "θ"),
    ("beta", "β"),
    ("eta", "η"),
    ("tau", "τ"),
    ("rho", "ρ"),
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

/// Words with formulas between dollar signs, as the source writes them, as HTML. Words without any that
/// are written as formulas are one.
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
    let is_bare = parts.len() == 1 && (words.contains('\\') || words.contains("_{"));
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
    let set = |(n, part): (usize, &&str)| if is_bare || n % 2 == 1 { formula(part) } else { text(part) };
    parts.iter().enumerate().map(set).collect()
}

/// Words of our own with symbols among them, as HTML: `F_T/F_N` and `mu_k` with letter and subscript.
/// What else has an underscore, as the name of a key or of a column, stays as it is.
pub(crate) fn lettered(words: &str) -> String {
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let letter = |name: &str| -> Option<String> {
        let known = GREEK.iter().find(|(word, _)| *word == name).map(|(_, letter)| (*letter).to_owned());
        known.or_else(|| (name.chars().count() == 1).then(|| name.to_owned()))
    };
    let set = |name: &str| -> Option<String> {
        let (base, index) = name.split_once('_').map_or((name, None), |(base, index)| (base, Some(index)));
        let letter = letter(base)?;
        match index {
            None => Some(text(letter)),
            Some(index) if index.is_empty() || index.contains('_') => None,
            Some(index) => Some(format!("{}<sub>{}</sub>", text(letter), text(index))),
        }
    };
    let mut out = String::new();
    let mut rest = words;
    while let Some(first) = rest.chars().next() {
        let is_name = is_of_name(first);
        let end = rest.find(|c| is_of_name(c) != is_name).unwrap_or(rest.len());
        let (part, after) = rest.split_at(end);
        // Between dots are keys.
        let before = &words[..words.len() - rest.len()];
        let is_of_key = before.ends_with('.')
            || after.strip_prefix('.').is_some_and(|after| after.starts_with(is_of_name));
        let symbol = if is_name && !is_of_key { set(part) } else { None };
        out += &symbol.unwrap_or_else(|| text(part));
        rest = after;
    }
    out
}

/// Formats a symbol as plain text, for headings and labels.
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

/// Formats a number with that many significant digits.
pub(crate) fn rounded(value: f64, digits: usize) -> String {
    number(round(value, digits))
}

/// Rounds a number to that many significant digits.
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
    use super::{formulas, lettered, number, plain, round, rounded, symbol};

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
        // Without dollar signs.
        assert_eq!(
            formulas("F_{T} / F_{N}=\\mu_{k} L_{P} / L"),
            "F<sub>T</sub> / F<sub>N</sub>=μ<sub>k</sub> L<sub>P</sub> / L"
        );
        assert_eq!(formulas("\\mu_{k} \\approx 0.17 t"), "μ<sub>k</sub> ≈ 0.17 t");
    }

    #[test]
    fn notes_and_captions_have_letters_and_subscripts() {
        assert_eq!(
            lettered("L_p/L against F_T/F_N; over mu_k < alpha l_0/L."),
            "L<sub>p</sub>/L against F<sub>T</sub>/F<sub>N</sub>; over μ<sub>k</sub> &lt; α l<sub>0</sub>/L."
        );
        assert_eq!(lettered("tau_n / p_n, μ_s."), "τ<sub>n</sub> / p<sub>n</sub>, μ<sub>s</sub>.");
        for name in [
            "precursor_count of a",
            "time.step_s",
            "initial_shear.beta = 1",
            "theta.x",
            "a_b_c",
            "x_",
            "meta",
        ] {
            assert_eq!(lettered(name), name);
        }
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
