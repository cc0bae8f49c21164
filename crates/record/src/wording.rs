//! Counts and numbers as words for people. Tables, logs and JSON have all digits.

/// A year of 365.25 days, s.
pub const YEAR_S: f64 = 31_557_600.0;

/// The unit in which people are told times of a run that lasts so long: its length in s, and its name. Years from three of
/// them on.
pub fn unit_of_time(duration_s: f64) -> (f64, &'static str) {
    if duration_s >= 3.0 * YEAR_S { (YEAR_S, "years") } else { (1.0, "s") }
}

/// A number and its thing, in the plural unless there is one: `1 slip event`, `2 switches`.
pub fn counted(count: u64, thing: &str) -> String {
    let ending = match count {
        1 => "",
        _ if thing.ends_with(['s', 'x']) || thing.ends_with("ch") => "es",
        _ => "s",
    };
    format!("{count} {thing}{ending}")
}

/// A number of that many significant digits, at least one.
pub fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value)
}

/// Significant digits of a number in a sentence or a table for people.
const DIGITS: usize = 6;

/// A number by six significant digits, with an exponent where it is large or small.
pub fn short(value: f64) -> String {
    let value = rounded(value, DIGITS);
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) { format!("{value:e}") } else { value.to_string() }
}

/// Significant digits of a time in a sentence, enough for a step of 1e-8 s in ten seconds.
const TIME_DIGITS: usize = 9;

/// A time in seconds for a sentence; `step as f64 * step_s` may have 17 digits.
pub fn short_time(time_s: f64) -> String {
    rounded(time_s, TIME_DIGITS).to_string()
}

/// Greek letters by the words that symbols are declared with, a word before those that it holds.
pub const GREEK: [(&str, &str); 13] = [
    ("alpha", "α"),
    ("gamma", "γ"),
    ("kappa", "κ"),
    ("lambda", "λ"),
    ("theta", "θ"),
    ("beta", "β"),
    ("eta", "η"),
    ("tau", "τ"),
    ("rho", "ρ"),
    ("mu", "μ"),
    ("nu", "ν"),
    ("pi", "π"),
    ("dt", "Δt"),
];

/// The letter of a whole word; none if it names none.
pub fn greek(word: &str) -> Option<&'static str> {
    GREEK.iter().find(|(name, _)| *name == word).map(|(_, letter)| *letter)
}

#[cfg(test)]
mod tests {
    use super::{counted, rounded, short, short_time};

    #[test]
    fn one_is_singular_and_everything_else_plural() {
        let words =
            [counted(0, "run"), counted(1, "slip event"), counted(2, "slip event"), counted(2, "switch")];
        assert_eq!(words, ["0 runs", "1 slip event", "2 slip events", "2 switches"]);
        assert_eq!([counted(1, "match"), counted(3, "match")], ["1 match", "3 matches"]);
    }

    #[test]
    fn numbers_have_six_digits() {
        for (number, text) in [
            (2.634_697_6, "2.6347"),
            (0.1, "0.1"),
            (0.0, "0"),
            (1e-7, "1e-7"),
            (-8.012_345_67e-5, "-8.01235e-5"),
            (123_456_789.0, "1.23457e8"),
            (9_999_999.6, "1e7"),
        ] {
            assert_eq!(short(number), text);
        }
        assert_eq!(rounded(0.056_763_560_000_000_005, 12), 0.056_763_56);
        assert_eq!(short_time(0.056_763_560_000_000_005), "0.05676356");
        assert_eq!(short_time(2.671_946_73), "2.67194673");
    }
}
