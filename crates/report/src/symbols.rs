//! Symbols and numbers as they are printed.

use asperity_record::{GREEK, greek, unit_of_time};

use crate::html::markup::text;

/// A symbol of the key table as HTML: `mu_s` as the letter with its subscript.
pub(crate) fn symbol(written: &str) -> String {
    let part = |part: &str| {
        let (name, index) = part.split_once('_').map_or((part, None), |(name, index)| (name, Some(index)));
        let letter = text(greek(name).unwrap_or(name));
        let index = index.map_or(String::new(), |index| format!("<sub>{}</sub>", text(index)));
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

/// A time of a run that lasts so long, with its unit, by its digits and not by decimals: short runs slip within
/// microseconds.
pub(crate) fn time(time_s: f64, duration_s: f64) -> String {
    let (unit_s, unit) = unit_of_time(duration_s);
    format!("{} {unit}", rounded(time_s / unit_s, 5))
}

/// Words with formulas between dollar signs, as the source writes them, as HTML. Words without any that
/// are written as formulas are one; others may have [symbols](lettered).
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
    if parts.len() == 1 && !is_bare {
        return lettered(words);
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
    let set = |(n, part): (usize, &&str)| if is_bare || n % 2 == 1 { formula(part) } else { text(part) };
    parts.iter().enumerate().map(set).collect()
}

/// Words of our own with symbols among them, as HTML: `F_T/F_N`, `mu_{k}`, `10^-8`, `1e-8`, `sqrt(k m)` and
/// `<=` as they are printed, and text between backquotes as code. Other words with an underscore, such as
/// names of keys or columns, are unchanged.
pub(crate) fn lettered(words: &str) -> String {
    let mut out = String::new();
    let mut rest = words;
    while let Some(first) = rest.chars().next() {
        let before = &words[..words.len() - rest.len()];
        let (html, length) = token(before, rest).unwrap_or_else(|| (text(first), first.len_utf8()));
        out += &html;
        rest = &rest[length..];
    }
    out
}

/// The first symbol of a text, as HTML, and its length; none for an ordinary character.
fn token(before: &str, rest: &str) -> Option<(String, usize)> {
    const SIGNS: [(&str, &str); 3] = [("<=", "≤"), (">=", "≥"), ("sqrt(", "√(")];
    if let Some((sign, printed)) = SIGNS.iter().find(|(sign, _)| rest.starts_with(sign)) {
        return Some(((*printed).to_owned(), sign.len()));
    }
    if let Some((code, _)) = rest.strip_prefix('`').and_then(|rest| rest.split_once('`')) {
        return Some((format!("<code>{}</code>", text(code)), code.len() + 2));
    }
    if let Some(after) = rest.strip_prefix('^') {
        let (power, length) = index(after)?;
        return Some((format!("<sup>{}</sup>", power.replace('-', "−")), length + 1));
    }
    let is_of_name = |c: char| c.is_alphanumeric() || c == '_';
    if !rest.starts_with(is_of_name) {
        return None;
    }
    if let Some(length) = scientific(rest) {
        return Some((number(rest[..length].parse().ok()?), length));
    }
    let end = rest.find(|c| !is_of_name(c)).unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    // Keys have dots, and names of runs hyphens, without a space beside them.
    let joins = |c: char| c == '.' || c == '-';
    let is_of_key = before.ends_with(joins) && !before[..before.len() - 1].ends_with([' ', '('])
        || after.strip_prefix(joins).is_some_and(|after| after.starts_with(is_of_name));
    let known =
        |base: &str| greek(base).map(text).or_else(|| (base.chars().count() == 1).then(|| text(base)));
    let indexed = |letter: String, index: &str| format!("{letter}<sub>{}</sub>", text(index));
    let symbol = match name.split_once('_') {
        _ if is_of_key => None,
        None => known(name).map(|letter| (letter, end)),
        // `mu_{k}`
        Some((base, "")) => {
            let (inside, _) = after.strip_prefix('{')?.split_once('}')?;
            Some((indexed(known(base)?, inside.trim()), end + inside.len() + 2))
        }
        Some((_, index)) if index.contains('_') => None,
        Some((base, index)) => known(base).map(|letter| (indexed(letter, index), end)),
    };
    Some(symbol.unwrap_or_else(|| (text(name), end)))
}

/// The index or power that a text begins with, in braces or not, and its length.
fn index(text: &str) -> Option<(&str, usize)> {
    if let Some((inside, _)) = text.strip_prefix('{').and_then(|rest| rest.split_once('}')) {
        return Some((inside.trim(), inside.len() + 2));
    }
    let sign = text.chars().next().filter(|c| "-−+".contains(*c)).map_or(0, char::len_utf8);
    let length = text[sign..].find(|c: char| !c.is_alphanumeric()).unwrap_or(text.len() - sign);
    (length > 0).then(|| (&text[..sign + length], sign + length))
}

/// The length of a number with an exponent, as `2.5e-9`, that a text begins with.
fn scientific(text: &str) -> Option<usize> {
    let digits =
        |from: usize| from + text[from..].find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len() - from);
    let mut end = digits(0);
    if text[end..].starts_with('.') {
        end = digits(end + 1);
    }
    if end == 0 || !text[end..].starts_with('e') {
        return None;
    }
    let sign = end + 1 + usize::from(text[end + 1..].starts_with(['-', '+']));
    let whole = digits(sign);
    (whole > sign && !text[whole..].starts_with(char::is_alphanumeric)).then_some(whole)
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
    number(asperity_record::rounded(value, digits))
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
    use super::{formulas, lettered, number, rounded, symbol};

    #[test]
    fn symbols_are_those_of_the_field() {
        assert_eq!(symbol("mu_s"), "<i>μ</i><sub>s</sub>");
        assert_eq!(symbol("k_t / k"), "<i>k</i><sub>t</sub>/<i>k</i>");
        assert_eq!(symbol("dt"), "Δt");
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
        assert_eq!(
            lettered("dt = 2.5e-9 s, |tau_n| <= mu_{s} p_n"),
            "Δt = 2.5 × 10<sup>−9</sup> s, |τ<sub>n</sub>| ≤ μ<sub>s</sub> p<sub>n</sub>"
        );
        assert_eq!(
            lettered("10^−8 and s^{−α}, 10^-8, kg/m^3"),
            "10<sup>−8</sup> and s<sup>−α</sup>, 10<sup>−8</sup>, kg/m<sup>3</sup>"
        );
        assert_eq!(lettered("lambda sqrt(m/k); `a_b <c>` x^"), "λ √(m/k); <code>a_b &lt;c&gt;</code> x^");
        assert_eq!(lettered("mu_{ is 1e5x, 0.5 and 1.e"), "mu_{ is 1e5x, 0.5 and 1.e");
        for name in [
            "precursor_count of a",
            "time.step_s",
            "initial_shear.beta = 1",
            "theta.x",
            "a_b_c",
            "x_",
            "meta",
            "beta-045",
            "chain-beta",
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
        assert_eq!(rounded(0.123456, 3), "0.123");
    }
}
