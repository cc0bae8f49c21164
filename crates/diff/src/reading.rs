//! Numbers as people read them, rounded; the JSON has them whole.

use asperity_record::Cell;
use serde_json::Value;

use crate::report::{KolmogorovSmirnov, NumberChange, Sample};

/// Digits of a value: enough to show a relative difference of one in a million.
const DIGITS: i32 = 6;
/// Digits of a difference.
const DIGITS_OF_DIFFERENCE: i32 = 3;

/// The numbers of a summary that are shown first, in this order: precursors, the first slip of the whole
/// slider with its load and the speed of its front, the recurrence and load drop of such slips, and the
/// median speed of fronts.
pub(crate) const SHOWN: [&str; 12] = [
    "precursor_count",
    "longest_precursor_ratio",
    "first_global_rupture_onset_s",
    "first_global_rupture_ft_fn",
    "first_global_rupture_front_speed_m_per_s",
    "largest_ft_fn",
    "global_rupture_count",
    "recurrence_transient_s",
    "recurrence_steady_s",
    "global_rupture_drop_ft_fn",
    "front_speed_m_per_s",
    "front_speed_over_wave_speed_ratio",
];

fn rounded(value: f64, digits: i32) -> String {
    let magnitude = if value == 0.0 { 0 } else { value.abs().log10().floor() as i32 };
    match magnitude {
        -4..6 => format!("{value:.*}", usize::try_from(digits - 1 - magnitude).unwrap_or(0)),
        _ => format!("{value:.*e}", usize::try_from(digits - 1).unwrap_or(0)),
    }
}

fn without_zeros(text: String) -> String {
    let (digits, exponent) =
        text.split_once('e').map_or((&*text, None), |(digits, power)| (digits, Some(power)));
    let digits = match digits.contains('.') {
        true => digits.trim_end_matches('0').trim_end_matches('.'),
        false => digits,
    };
    exponent.map_or(digits.to_owned(), |power| format!("{digits}e{power}"))
}

/// A number, without zeros at its end.
pub(crate) fn number(value: f64) -> String {
    without_zeros(rounded(value, DIGITS))
}

/// A cell of the event table.
pub(crate) fn cell(value: &Cell) -> String {
    match value {
        Cell::Empty => "nothing".to_owned(),
        Cell::Number(value) => number(*value),
        other => other.to_string(),
    }
}

/// A number of a summary, to be aligned with others.
pub(crate) fn value(value: &Value) -> String {
    match value {
        Value::Number(number) if number.is_f64() => rounded(number.as_f64().unwrap_or(f64::NAN), DIGITS),
        other => setting(other),
    }
}

/// The value of a key of a scenario; of a long list, or one of tables, its length.
pub(crate) fn setting(value: &Value) -> String {
    /// Most values of a list that are shown.
    const SHORT: usize = 4;
    match value {
        Value::Null => "-".to_owned(),
        Value::Number(whole) if whole.is_f64() => number(whole.as_f64().unwrap_or(f64::NAN)),
        Value::String(text) => text.clone(),
        Value::Array(values) if values.len() > SHORT || values.iter().any(Value::is_object) => {
            format!("[{} values]", values.len())
        }
        Value::Array(values) => format!("[{}]", values.iter().map(setting).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// Three digits, without any if it is whole.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || (0.01..1e5).contains(&value) && value.fract() == 0.0 {
        return value.to_string();
    }
    format!("{value:.2e}")
}

/// A difference, with its sign.
pub(crate) fn signed(difference: f64) -> String {
    let text = match difference.fract() == 0.0 && difference.abs() < 1e6 {
        true => difference.abs().to_string(),
        false => without_zeros(rounded(difference.abs(), DIGITS_OF_DIFFERENCE)),
    };
    format!("{}{text}", if difference < 0.0 { "-" } else { "+" })
}

/// The difference of both sides; empty if there is none, or it is no number.
pub(crate) fn difference(number: &NumberChange) -> String {
    match number.difference {
        Some(difference) if number.old != number.new => signed(difference),
        _ => String::new(),
    }
}

/// The difference relative to the old side.
pub(crate) fn change(number: &NumberChange) -> String {
    match number.relative_change {
        _ if number.old == number.new => "same".to_owned(),
        Some(relative) if relative.abs() >= 5e-5 => format!("{:+.2} %", 100.0 * relative),
        Some(relative) => format!("{relative:+.0e}"),
        None => String::new(),
    }
}

/// The test result for both sides of a quantity.
pub(crate) fn test(sample: &Sample) -> String {
    match sample.test {
        None => "too few values for the test".to_owned(),
        Some(KolmogorovSmirnov { p, .. }) if p >= KolmogorovSmirnov::SIGNIFICANT => {
            format!("no difference shown, p = {p:.2}")
        }
        Some(KolmogorovSmirnov { p, .. }) => format!("they differ, p = {p:.0e}"),
    }
}

/// Whether either run has the number at all.
pub(crate) fn is_there(number: &NumberChange) -> bool {
    !(number.old.is_null() && number.new.is_null())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{change, difference, number, setting, value};
    use crate::report::NumberChange;

    #[test]
    fn numbers_have_six_digits_and_changes_are_in_percent() {
        let read = |old, new| {
            let number = NumberChange::between("a_s", &old, &new);
            [value(&number.old), value(&number.new), difference(&number), change(&number)]
        };
        assert_eq!(read(json!(55), json!(58)), ["55", "58", "+3", "+5.45 %"]);
        assert_eq!(read(json!(2.6346976), json!(2.62232)), ["2.63470", "2.62232", "-0.0124", "-0.47 %"]);
        assert_eq!(read(json!(-2.0), json!(-1.0)), ["-2.00000", "-1.00000", "+1", "+50.00 %"]);
        assert_eq!(read(json!(123456.7), json!(123456.8)), ["123457", "123457", "+0.1", "+8e-7"]);
        assert_eq!(read(json!(1.5e-9), json!(1.5e-9)), ["1.50000e-9", "1.50000e-9", "", "same"]);
        assert_eq!(read(json!(0.0), json!(0.25)), ["0.00000", "0.250000", "+0.25", ""]);
        assert_eq!(read(json!(null), json!(3)), ["-", "3", "", ""]);
        assert_eq!(read(json!(false), json!(true)), ["false", "true", "", ""]);
    }

    #[test]
    fn zeros_at_the_end_of_a_number_are_left_out_and_long_lists_counted() {
        assert_eq!(
            [0.7, 4e6, 2.5e9, 100.0, 0.1 + 0.2, 0.0].map(number),
            ["0.7", "4e6", "2.5e9", "100", "0.3", "0"]
        );
        assert_eq!(setting(&json!([1.0, 2.5])), "[1, 2.5]");
        assert_eq!(setting(&json!([0, 1, 2, 3, 4])), "[5 values]");
        assert_eq!(setting(&json!("rigid")), "rigid");
    }
}
