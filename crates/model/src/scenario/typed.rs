//! Reads TOML texts that are no scenarios, such as studies and settings, into types. Errors name
//! place, key and what is accepted, in the words of the errors of scenarios.

use serde::de::DeserializeOwned;
use toml::de::{DeTable, Deserializer};

use crate::scenario::suggest;

/// The place of an error in a text, an offset in bytes, and a description with key, value and accepted values.
pub type Refused = (usize, String);

/// Most numbers such as `100.0` that are read as whole ones, since each costs a pass over the text.
const MOST_WHOLE: usize = 100;

/// Reads a text, see [`parse_prepared`].
///
/// # Errors
/// If it is not TOML, or does not match the type.
pub fn parse<T: DeserializeOwned>(text: &str, listed_in: &str) -> Result<T, Refused> {
    parse_prepared(text, listed_in, |_| Ok(()))
}

/// Reads a text after `prepare` has changed its table, or refused it at a place. Where a whole number is meant, `100.0`
/// and `1e2` are accepted as well. `listed_in` names the place of long lists of names.
///
/// # Errors
/// If it is not TOML, or does not match the type.
pub fn parse_prepared<T: DeserializeOwned>(
    text: &str,
    listed_in: &str,
    prepare: impl Fn(&mut DeTable<'_>) -> Result<(), Refused>,
) -> Result<T, Refused> {
    if let Err(error) = DeTable::parse(text) {
        let at = error.span().map_or(0, |span| span.start);
        return Err((at, format!("not TOML: {}", error.message())));
    }
    let mut read = text.to_owned();
    // Places where the digits are longer than the original text, and by how much.
    let mut longer: Vec<(usize, usize)> = Vec::new();
    for _ in 0..MOST_WHOLE {
        let mut table = DeTable::parse(&read).map_err(|error| (0, error.to_string()))?;
        prepare(table.get_mut()).map_err(|(at, problem)| (written_at(&longer, at), problem))?;
        let error = match T::deserialize(Deserializer::from(table)) {
            Ok(value) => return Ok(value),
            Err(error) => error,
        };
        let span = error.span().unwrap_or(0..0);
        let literal = Some(&read[span.clone()]).filter(|_| error.message().contains("floating point"));
        match literal.and_then(|literal| whole(literal.replace('_', "").parse().ok()?)) {
            Some(number) => {
                let digits = number.to_string();
                longer.push((written_at(&longer, span.start), digits.len().saturating_sub(span.len())));
                longer.sort_unstable();
                read.replace_range(span.clone(), &format!("{digits:<width$}", width = span.len()));
            }
            None => {
                let mut problem = with_its_key(&read, &span, error.message(), listed_in);
                if is_of_the_top::<T>(error.message()) {
                    problem.push_str("; as a key of the whole file it stands above the first [[...]]");
                }
                return Err((written_at(&longer, span.start), problem));
            }
        }
    }
    Err((0, format!("more than {MOST_WHOLE} whole numbers with a decimal point")))
}

/// The place in the text as it was written.
fn written_at(longer: &[(usize, usize)], at: usize) -> usize {
    at - longer.iter().fold(0, |shift, (from, by)| if at > from + shift { shift + by } else { shift })
}

/// Converts a number such as `100.0` to a whole number.
pub fn whole(value: f64) -> Option<u64> {
    (value.fract() == 0.0 && (0.0..=2f64.powi(53)).contains(&value)).then_some(value as u64)
}

/// Rewrites an error of the TOML library, with key and accepted values.
fn with_its_key(text: &str, span: &std::ops::Range<usize>, message: &str, listed_in: &str) -> String {
    let value = &text[span.clone()];
    if value.starts_with("[[") {
        return format!(
            "{value} is not accepted (accepted: with a kind, {}.KIND]])",
            value.trim_end_matches(']')
        );
    }
    let key = key_before(text, span.start);
    in_words(&key.map_or(value.to_owned(), |key| format!("{key} = {value}")), message, listed_in)
}

/// Rewrites a message of serde about `what`, a value or a key with its value: with the names or the values accepted, in
/// the words of a user. `listed_in` names the place of long lists of names.
pub fn in_words(what: &str, message: &str, listed_in: &str) -> String {
    let names = names_in(message);
    if let Some(unknown) = message.strip_prefix("unknown field ") {
        let key = quoted(unknown);
        return format!("{key}: unknown key{}", suggest::among(key, &names, listed_in));
    }
    if let Some(missing) = message.strip_prefix("missing field ") {
        return format!("{} is missing here", quoted(missing));
    }
    if let Some(unknown) = message.strip_prefix("unknown variant ") {
        return format!("{what} is not accepted{}", suggest::among(quoted(unknown), &names, listed_in));
    }
    let expected = match message.rsplit_once(", expected ") {
        _ if message.contains("untagged enum") => "a number, a word in quotes, true or false",
        Some((start, expected)) if start.starts_with("invalid ") => match expected {
            "a sequence" => "a list",
            "a string" => "a text in quotes",
            "a boolean" => "true or false",
            "f64" => "a number",
            "u8" | "u32" | "u64" | "usize" => "a whole number from 0",
            "i64" => "a whole number",
            _ if expected.starts_with("struct ") => "a table",
            _ if expected.contains("nonzero") => "a whole number from 1",
            _ => expected,
        },
        // The words of a type of a file.
        _ => match message.strip_prefix("accepted: ") {
            Some(accepted) => accepted,
            None => return message.to_owned(),
        },
    };
    format!("{what} is not accepted (accepted: {expected})")
}

/// The first name in backticks.
fn quoted(text: &str) -> &str {
    text.split('`').nth(1).unwrap_or(text)
}

/// The names listed as expected in a message of serde.
fn names_in(message: &str) -> Vec<&str> {
    let expected = message.split_once(", expected ").map_or("", |(_, expected)| expected);
    expected.split('`').skip(1).step_by(2).collect()
}

/// The key whose value begins there, if it is on the same line.
fn key_before(text: &str, at: usize) -> Option<&str> {
    let line = text[..at].rsplit('\n').next()?;
    let (before, _) = line.rsplit_once('=')?;
    // In an inline table it follows a brace or a comma.
    let key = before.rsplit(['{', ',']).next()?;
    let is_bare = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    Some(key.trim()).filter(|key| !key.is_empty() && key.chars().all(is_bare))
}

/// Whether a key that a table lacks exists in the file.
fn is_of_the_top<T: DeserializeOwned>(message: &str) -> bool {
    let Some(unknown) = message.strip_prefix("unknown field ") else { return false };
    // The error about an unknown key lists those of the file.
    let Err(error) = toml::from_str::<T>("\"?\" = 0") else { return false };
    let top = names_in(error.message());
    top != names_in(message) && top.contains(&quoted(unknown))
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::parse;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        title: String,
        #[serde(default)]
        set: Vec<String>,
        #[serde(default)]
        run: Vec<Run>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Run {
        name: String,
        #[serde(default)]
        blocks: Vec<u32>,
        count: Option<u64>,
        share: Option<f64>,
        shape: Option<Shape>,
    }

    #[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    enum Shape {
        SideDriven,
        TopDriven,
    }

    fn problem(text: &str) -> (usize, String) {
        parse::<File>(text, "the manual").unwrap_err()
    }

    #[test]
    fn whole_numbers_may_have_a_point_where_whole_numbers_are_meant() {
        let text = "title = 'a'\n[[run]]\nname = 'b'\nblocks = [10.0, 2e1, 3e4]\ncount = 1_000.0\nshare = 2.0\n\
                    shape = 'top-driven'\n";
        let file: File = parse(text, "").unwrap();
        let run = &file.run[0];
        assert_eq!(
            (run.blocks.as_slice(), run.count, run.share),
            (&[10, 20, 30_000][..], Some(1000), Some(2.0))
        );
        assert_eq!((file.title.as_str(), file.set.len(), run.name.as_str()), ("a", 0, "b"));
        assert_eq!(run.shape, Some(Shape::TopDriven));
        let behind = text.replace("shape = 'top-driven'", "other = 1");
        assert_eq!(problem(&behind).0, behind.find("other").unwrap());
        for wrong in ["2.5", "-1.0", "1e300", "nan"] {
            let text = format!("title = 'a'\n[[run]]\nname = 'b'\ncount = {wrong}\n");
            let expected = format!("count = {wrong} is not accepted (accepted: a whole number from 0)");
            assert_eq!(problem(&text), (text.find(wrong).unwrap(), expected));
        }
    }

    #[test]
    fn errors_name_key_value_and_what_is_accepted() {
        for (text, at, words) in [
            ("title = 'a", 10, "not TOML: "),
            ("title = 3", 8, "title = 3 is not accepted (accepted: a text in quotes)"),
            ("[[run]]\nname = 'a'", 0, "title is missing here"),
            ("tilte = 'a'", 0, "tilte: unknown key; did you mean title? (accepted: title, set, run)"),
            (
                "title = 'a'\n[[run]]\nname = 'b'\nshape = 'side'",
                39,
                "shape = 'side' is not accepted; did you mean side-driven? (accepted: side-driven, top-driven)",
            ),
            (
                "title = 'a'\n[[run]]\nname = 'b'\nset = []",
                31,
                "set: unknown key (accepted: name, blocks, count, share, shape); as a key of the whole file it stands \
                 above the first [[...]]",
            ),
            ("title = 'a'\nrun = 3", 18, "run = 3 is not accepted (accepted: a list)"),
        ] {
            let (place, problem) = problem(text);
            assert!(problem.starts_with(words), "{text}: {problem}");
            assert_eq!(place, at, "{text}: {problem}");
        }
    }
}
