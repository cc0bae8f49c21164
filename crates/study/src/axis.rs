//! The axes of a sweep: one key, or several that change together, and their values.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;

use asperity_figures::{self as study_figures, place, read_place};
use asperity_model::scenario::keys::{self, Key, Kind};
use asperity_model::scenario::rows::{Row, Rows};
use asperity_model::scenario::text;
use asperity_model::scenario::typed::whole;
use asperity_model::{key_suggestion, mixed, suggestion};
use asperity_record::bounds::MOST_RUNS;
use asperity_record::{Cell, Column, ColumnKind, counted, rounded};
use serde::Deserialize;

/// The value of a key as in a scenario, where a number may be plain or have a power of ten.
pub(crate) fn spelled(value: &Cell) -> String {
    match value {
        Cell::Number(number) => {
            let (plain, short) = (number.to_string(), format!("{number:e}"));
            if short.len() < plain.len() { short } else { plain }
        }
        Cell::Empty => "null".to_owned(),
        Cell::Word(word) => toml::Value::from(&**word).to_string(),
        value => value.to_string(),
    }
}

/// The value as the column of its key has it: 100.0 is 100 for a key of whole numbers, and 1 is 1.0 for one of others.
pub(crate) fn settled(key: &Key, value: &Cell) -> Cell {
    match (key.kind, value) {
        (Kind::Count(..), Cell::Number(number)) => whole(*number).map_or_else(|| value.clone(), Cell::Step),
        (Kind::Number(..) | Kind::Numbers(..), Cell::Step(number)) => Cell::Number(*number as f64),
        _ => value.clone(),
    }
}

/// An axis as written: `key` with `values` or a range; `keys` with `rows`; a table `csv`; or
/// `count` draws from `ranges`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Written {
    key: Option<String>,
    values: Option<Vec<Cell>>,
    from: Option<f64>,
    to: Option<f64>,
    spacing: Option<Spacing>,
    keys: Option<Vec<String>>,
    rows: Option<Vec<Vec<Cell>>>,
    csv: Option<String>,
    sample: Option<Method>,
    ranges: Option<Vec<Range>>,
    count: Option<u64>,
    seed: Option<u32>,
}

/// The spacing of the values of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Spacing {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Log,
}

/// The method of sampling.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Method {
    /// Independent draws.
    Random,
    /// One draw in each of as many equal parts of every range.
    LatinHypercube,
}

/// The distribution of a sampled key.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    key: String,
    from: f64,
    to: f64,
    #[serde(default)]
    spacing: Spacing,
}

/// An axis: keys, and a row of values for each point.
#[derive(Debug, Clone)]
pub struct Axis {
    /// The scenario keys that it sets.
    pub keys: Vec<&'static Key>,
    /// The values of the keys, point by point.
    pub rows: Vec<Vec<Cell>>,
    /// The keys with equal ratios.
    pub log: Vec<bool>,
    /// Whether its points form a sequence, as those of a list or a range.
    pub joined: bool,
}

/// The forms of an axis, for errors.
const ACCEPTED: &str = "key with values, or with from, to and count; keys with rows; csv; or sample with count \
                        and ranges";

impl Written {
    /// Expands an axis. Tables are read from files relative to the folder of the sweep.
    ///
    /// # Errors
    /// A message with the key and what is accepted.
    pub(crate) fn read(&self, folder: &Path) -> Result<Axis, String> {
        let Written { key, values, from, to, spacing, keys, rows, csv, sample, ranges, count, seed } = self;
        let range = from.is_some() || to.is_some();
        let mut axis = match (key, values, range, keys, rows, csv, sample) {
            (Some(key), Some(values), false, None, None, None, None) => Axis {
                keys: vec![key_of(key)?],
                rows: values.iter().map(|value| vec![value.clone()]).collect(),
                log: vec![false],
                joined: true,
            },
            (Some(key), None, true, None, None, None, None) => {
                let (Some(from), Some(to), Some(count)) = (*from, *to, *count) else {
                    return Err(format!(
                        "{key}: a range lacks one of from, to and count (accepted: all three)"
                    ));
                };
                let range = Range { key: key.clone(), from, to, spacing: spacing.unwrap_or_default() };
                let key = range.check()?;
                few_enough(count)?;
                let last = (count.max(2) - 1) as f64;
                let rows = (0..count).map(|n| vec![range.at(key, n as f64 / last)]).collect();
                Axis { keys: vec![key], rows, log: vec![range.spacing == Spacing::Log], joined: true }
            }
            (None, None, false, Some(keys), Some(rows), None, None) => {
                let keys = keys.iter().map(|key| key_of(key)).collect::<Result<Vec<_>, _>>()?;
                if let Some(row) = rows.iter().position(|row| row.len() != keys.len()) {
                    return Err(format!(
                        "row {} of {} has {} values (accepted: {})",
                        row + 1,
                        names(&keys),
                        rows[row].len(),
                        keys.len()
                    ));
                }
                Axis { log: vec![false; keys.len()], keys, rows: rows.clone(), joined: true }
            }
            (None, None, false, None, None, Some(csv), None) => table(&folder.join(csv))?,
            (None, None, false, None, None, None, Some(method)) => {
                let (Some(ranges), Some(count)) = (ranges, *count) else {
                    return Err("a sample lacks count or ranges (accepted: both)".to_owned());
                };
                few_enough(count)?;
                drawn(*method, ranges, count, u64::from(seed.unwrap_or(1)))?
            }
            _ => return Err(format!("not exactly one way to vary keys (accepted: {ACCEPTED})")),
        };
        let needless = [
            ("spacing", spacing.is_some() && !range),
            ("ranges", ranges.is_some() && sample.is_none()),
            ("seed", seed.is_some() && sample.is_none()),
            ("count", count.is_some() && sample.is_none() && !range),
        ];
        if let Some((name, _)) = needless.iter().find(|(_, given)| *given) {
            return Err(format!("{name} has no effect here (accepted: {ACCEPTED})"));
        }
        // 100.0 is 100 for keys that are whole numbers.
        for row in &mut axis.rows {
            axis.keys.iter().zip(row).for_each(|(key, value)| *value = settled(key, value));
        }
        axis.check()?;
        Ok(axis)
    }
}

impl Axis {
    fn check(&self) -> Result<(), String> {
        let names = names(&self.keys);
        if self.keys.is_empty() {
            return Err("it sets no keys (accepted: one or more)".to_owned());
        }
        if self.rows.is_empty() {
            return Err(format!("{names}: no values (accepted: one or more)"));
        }
        let mut seen = BTreeSet::new();
        if let Some(twice) = self.keys.iter().find(|key| !seen.insert(key.path)) {
            return Err(format!("{} appears twice on one axis (accepted: once)", twice.path));
        }
        for row in &self.rows {
            for (key, value) in self.keys.iter().zip(row) {
                check_value(key, value)?;
            }
        }
        let mut sorted: Vec<usize> = (0..self.rows.len()).collect();
        sorted.sort_by_cached_key(|row| self.rows[*row].iter().map(sortable).collect::<Vec<_>>());
        if let Some(pair) = sorted.windows(2).find(|pair| self.rows[pair[0]] == self.rows[pair[1]]) {
            let values: Vec<String> = self.rows[pair[0]].iter().map(spelled).collect();
            return Err(format!("{names}: {} appears twice (accepted: each once)", values.join(", ")));
        }
        Ok(())
    }

    /// The axis as figures need it.
    pub(crate) fn for_figures(&self) -> study_figures::Axis<'_> {
        let key = |n: usize| {
            let mut seen = BTreeSet::new();
            let values = self.rows.iter().map(|row| &row[n]).filter(|value| seen.insert(sortable(value)));
            study_figures::Key {
                path: self.keys[n].path,
                is_number: matches!(column(self.keys[n]).kind, ColumnKind::Number | ColumnKind::Step),
                log: self.log[n],
                values: values.filter_map(place).collect(),
            }
        };
        study_figures::Axis { keys: (0..self.keys.len()).map(key).collect(), joined: self.joined }
    }
}

/// The column of a key in the tables of a study.
pub(crate) fn column(key: &Key) -> Column {
    let kind = match key.kind {
        Kind::Number(..) | Kind::Numbers(..) => ColumnKind::Number,
        Kind::Count(..) => ColumnKind::Step,
        Kind::Flag => ColumnKind::Flag,
        Kind::Word(_) | Kind::Text(_) => ColumnKind::Word,
    };
    Column {
        name: key.path.into(),
        kind,
        unit: asperity_record::unit_of(key.path).filter(|_| kind == ColumnKind::Number),
        about: key.doc.into(),
        ..Column::new("", ColumnKind::Word, "")
    }
}

/// A sort key of the values of a key under which equal ones are adjacent: -0 and 0 are equal.
fn sortable(value: &Cell) -> (u64, String) {
    match value {
        Cell::Number(number) => ((number + 0.0).to_bits(), String::new()),
        value => (0, value.to_string()),
    }
}

/// The numbers of the runs with these values of keys, each `key=value`, given all keys and the values of
/// every run.
///
/// # Errors
/// If there is no such key or no such run, with what is accepted.
pub(crate) fn runs_at<'a, S: AsRef<str>>(
    at: &[S],
    keys: &[String],
    runs: impl Iterator<Item = (u64, Cow<'a, [Cell]>)>,
) -> Result<Vec<u64>, String> {
    let mut wanted = Vec::new();
    for text in at.iter().map(AsRef::as_ref) {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| format!("at: {text:?} is not accepted (accepted: key=value)"))?;
        let place = keys.iter().position(|key| key == name.trim()).ok_or_else(|| {
            let meant = suggestion(name.trim(), keys.iter().map(String::as_str));
            format!("at: {} does not vary{meant} (accepted: {})", name.trim(), keys.join(", "))
        })?;
        wanted.push((place, read_place(value)));
    }
    let has_all =
        |values: &[Cell]| wanted.iter().all(|(key, wanted)| place(&values[*key]).as_ref() == Some(wanted));
    let found: Vec<u64> = runs.filter(|(_, values)| has_all(values)).map(|(run, _)| run).collect();
    if found.is_empty() {
        let all: Vec<&str> = at.iter().map(AsRef::as_ref).collect();
        return Err(format!("at: no run has {} (accepted: values of the axes)", all.join(" and ")));
    }
    Ok(found)
}

pub(crate) fn names(keys: &[&Key]) -> String {
    let names: Vec<&str> = keys.iter().map(|key| key.path).collect();
    names.join(", ")
}

fn few_enough(count: u64) -> Result<(), String> {
    match count {
        1..=MOST_RUNS => Ok(()),
        _ => Err(format!("count = {count} (accepted: a whole number from 1 to {MOST_RUNS})")),
    }
}

pub(crate) fn key_of(path: &str) -> Result<&'static Key, String> {
    let key = keys::named(path).ok_or_else(|| {
        let meant = key_suggestion(path);
        format!("{path}: unknown key{meant} (accepted: the keys of `asperity scenario show default`)")
    })?;
    match key.kind {
        Kind::Numbers(..) if !key.is_by_depth() => {
            Err(format!("{path}: a list cannot be an axis (accepted: keys of one value)"))
        }
        _ => Ok(key),
    }
}

pub(crate) fn check_value(key: &Key, value: &Cell) -> Result<(), String> {
    let fits = match (key.kind, value) {
        (Kind::Number(..) | Kind::Numbers(..), Cell::Number(number)) => key.kind.accepts_number(*number),
        (Kind::Count(low, high), Cell::Step(number)) => (low..=high).contains(number),
        (Kind::Flag, Cell::Flag(_)) | (Kind::Text(_), Cell::Word(_)) => true,
        (Kind::Word(words), Cell::Word(word)) => words.contains(&&**word),
        _ => false,
    };
    let refused = || {
        let meant = if let Cell::Word(word) = value { key.kind.suggestion(word) } else { String::new() };
        format!("{}: {} is not accepted{meant} (accepted: {})", key.path, spelled(value), key.kind)
    };
    if fits { Ok(()) } else { Err(refused()) }
}

impl Range {
    fn check(&self) -> Result<&'static Key, String> {
        let Range { key: name, from, to, spacing } = self;
        let key = key_of(name)?;
        if !matches!(key.kind, Kind::Number(..) | Kind::Numbers(..) | Kind::Count(..)) {
            return Err(format!("{name}: values other than numbers have no range (accepted: values)"));
        }
        if !(from.is_finite() && to.is_finite()) {
            return Err(format!("{name}: from {from} to {to} (accepted: finite numbers)"));
        }
        if *spacing == Spacing::Log && !(*from > 0.0 && *to > 0.0) {
            return Err(format!("{name}: by factors from {from} to {to} (accepted: numbers above 0)"));
        }
        Ok(key)
    }

    /// The value at a share of the range, rounded to twelve digits, so that a sixth of the way from
    /// 0 to 0.6 is 0.1; the ends are as written.
    fn at(&self, key: &Key, share: f64) -> Cell {
        let (from, to) = (self.from, self.to);
        let value = match self.spacing {
            _ if share == 0.0 => from,
            _ if share == 1.0 => to,
            Spacing::Linear => rounded(from + (to - from) * share, 12),
            Spacing::Log => rounded(from * libm::pow(to / from, share), 12),
        };
        Cell::Number(if matches!(key.kind, Kind::Count(..)) { value.round() } else { value })
    }
}

/// Reads a table of values with the keys as its heading.
fn table(path: &Path) -> Result<Axis, String> {
    let name = path.display();
    let text = text::read(path).map_err(|error| format!("csv {name}: {error} (accepted: a CSV file)"))?;
    let mut table = Rows::of(&text);
    let heading = table.next().unwrap_or_default();
    let keys = heading
        .cells
        .iter()
        .map(|key| key_of(key).map_err(|error| format!("csv {name}: {error}")))
        .collect::<Result<Vec<_>, _>>()?;
    let mut rows = Vec::new();
    for Row { line, cells } in table {
        if cells.len() != keys.len() {
            let (found, keys) = (counted(cells.len() as u64, "cell"), counted(keys.len() as u64, "key"));
            return Err(format!("csv {name}:{line}: {found} for {keys} (accepted: a value for each key)"));
        }
        let row = keys.iter().zip(&cells).map(|(key, cell)| {
            let value = settled(key, &read_cell(key, cell));
            check_value(key, &value).map(|()| value).map_err(|error| format!("csv {name}:{line}: {error}"))
        });
        rows.push(row.collect::<Result<Vec<_>, _>>()?);
    }
    Ok(Axis { log: vec![false; keys.len()], keys, rows, joined: false })
}

fn read_cell(key: &Key, cell: &str) -> Cell {
    let read = match key.kind {
        Kind::Number(..) | Kind::Count(..) => cell.parse().ok().map(Cell::Number),
        Kind::Flag => cell.parse().ok().map(Cell::Flag),
        _ => None,
    };
    read.unwrap_or_else(|| Cell::word(cell))
}

fn drawn(method: Method, ranges: &[Range], count: u64, seed: u64) -> Result<Axis, String> {
    let keys = ranges.iter().map(Range::check).collect::<Result<Vec<_>, _>>()?;
    let shares: Vec<Vec<f64>> = (0..ranges.len() as u64)
        .map(|stream| {
            let mut draws = Draws { seed, stream, next: 0 };
            match method {
                Method::Random => (0..count).map(|_| draws.share()).collect(),
                Method::LatinHypercube => {
                    let mut parts: Vec<u64> = (0..count).collect();
                    // Fisher-Yates shuffle.
                    for last in (1..parts.len()).rev() {
                        parts.swap(last, draws.below(last as u64 + 1) as usize);
                    }
                    parts.iter().map(|part| (*part as f64 + draws.share()) / count as f64).collect()
                }
            }
        })
        .collect();
    let row = |n: usize| {
        let values = ranges.iter().zip(&keys).zip(&shares);
        values.map(|((range, key), shares)| range.at(key, shares[n])).collect()
    };
    Ok(Axis {
        rows: (0..count as usize).map(row).collect(),
        log: ranges.iter().map(|range| range.spacing == Spacing::Log).collect(),
        joined: keys.len() == 1,
        keys,
    })
}

/// Pseudo-random numbers, the same on every machine: SplitMix64's output function of seed, stream
/// and number.
struct Draws {
    seed: u64,
    stream: u64,
    next: u64,
}

impl Draws {
    fn bits(&mut self) -> u64 {
        self.next += 1;
        mixed(self.seed << 32 ^ self.stream << 24 ^ self.next)
    }

    /// Uniform from 0 to 1, excluding 1.
    fn share(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn below(&mut self, count: u64) -> u64 {
        ((u128::from(self.bits()) * u128::from(count)) >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use asperity_record::Cell;

    use super::{Axis, Written};

    fn axis(text: &str) -> Result<Axis, String> {
        let written: Written = toml::from_str(text).map_err(|error| error.to_string())?;
        written.read(Path::new("."))
    }

    fn numbers(axis: &Axis, key: usize) -> Vec<f64> {
        axis.rows.iter().map(|row| row[key].number().expect("a number")).collect()
    }

    #[test]
    fn lists_ranges_rows_and_draws() {
        let list = axis("key = 'normal_load.tilt'\nvalues = [-0.5, 0, 0.5]").unwrap();
        assert_eq!(numbers(&list, 0), [-0.5, 0.0, 0.5]);
        let range = axis("key = 'time.duration_s'\nfrom = 1\nto = 2\ncount = 5").unwrap();
        assert_eq!(numbers(&range, 0), [1.0, 1.25, 1.5, 1.75, 2.0]);
        let log = axis("key = 'slider.mass_kg'\nfrom = 0.01\nto = 100\ncount = 5\nspacing = 'log'").unwrap();
        assert_eq!(numbers(&log, 0), [0.01, 0.1, 1.0, 10.0, 100.0]);
        let tenths = axis("key = 'normal_load.tilt'\nfrom = -0.5\nto = 0.5\ncount = 11").unwrap();
        assert_eq!(numbers(&tenths, 0), [-0.5, -0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5]);
        let whole = axis("key = 'slider.blocks'\nfrom = 10\nto = 40\ncount = 4").unwrap();
        assert_eq!(whole.rows[1], [Cell::Step(20)]);
        let whole = axis("key = 'slider.blocks'\nvalues = [10.0, 2e1]").unwrap();
        assert_eq!(whole.rows, [[Cell::Step(10)], [Cell::Step(20)]]);
        let rows = axis(
            "keys = ['friction.static_coefficient', 'friction.dynamic_coefficient']\nrows = [[0.5, 0.3], [0.7, 0.45]]",
        );
        assert_eq!(numbers(&rows.unwrap(), 1), [0.3, 0.45]);
        let latin = "sample = 'latin-hypercube'\ncount = 50\nseed = 3\nranges = [\
                     { key = 'normal_load.tilt', from = -1, to = 1 }, { key = 'initial_shear.beta', from = 0, to = 0.5 }]";
        let latin = axis(latin).unwrap();
        for (key, low, high) in [(0, -1.0, 1.0), (1, 0.0, 0.5)] {
            let mut parts: Vec<i64> =
                numbers(&latin, key).iter().map(|x| ((x - low) / (high - low) * 50.0) as i64).collect();
            assert!(!parts.is_sorted());
            parts.sort_unstable();
            assert_eq!(parts, (0..50).collect::<Vec<_>>());
        }
        let random =
            "sample = 'random'\ncount = 2000\nranges = [{ key = 'normal_load.tilt', from = -1, to = 1 }]";
        let numbers = numbers(&axis(random).unwrap(), 0);
        let mean = numbers.iter().sum::<f64>() / 2000.0;
        assert!(mean.abs() < 0.05 && numbers.iter().any(|x| *x < -0.99) && numbers.iter().any(|x| *x > 0.99));
    }

    #[test]
    fn what_cannot_be_an_axis_is_refused_with_what_can() {
        for (text, problem) in [
            ("key = 'normal_load.tilt'\nvalues = []", "normal_load.tilt: no values"),
            ("key = 'normal_load.tilt'\nvalues = [0, 0.5, 0.0]", "appears twice"),
            (
                "key = 'normal_load.tlit'\nvalues = [0]",
                "normal_load.tlit: unknown key; did you mean normal_load.tilt?",
            ),
            (
                "key = 'normal_load.tilt'\nvalues = [1.5]",
                "1.5 is not accepted (accepted: a number from -1 to 1)",
            ),
            ("key = 'slider.blocks'\nvalues = [10.5]", "10.5 is not accepted"),
            (
                "key = 'drive.kind'\nvalues = ['sidee']",
                "\"sidee\" is not accepted; did you mean side? (accepted: ",
            ),
            (
                "key = 'drive.velocty'\nvalues = [0]",
                "unknown key; did you mean drive.velocity_m_per_s? (accepted: ",
            ),
            ("key = 'normal_load.tilt'\nfrom = 0\nto = 1", "lacks one of from, to and count"),
            ("key = 'slider.mass_kg'\nfrom = 0\nto = 1\ncount = 3\nspacing = 'log'", "numbers above 0"),
            ("key = 'normal_load.tilt'\nvalues = [0]\nseed = 1", "seed has no effect here"),
            ("key = 'drive.kind'\nfrom = 0\nto = 1\ncount = 2", "values other than numbers have no range"),
            ("key = 'friction.static_offsets'\nvalues = [0]", "a list cannot be an axis"),
            ("keys = ['slider.blocks', 'slider.blocks']\nrows = [[10, 20]]", "appears twice on one axis"),
            (
                "keys = ['slider.blocks', 'slider.mass_kg']\nrows = [[10]]",
                "row 1 of slider.blocks, slider.mass_kg has 1",
            ),
            ("count = 3", "not exactly one way to vary keys"),
            ("csv = 'nowhere.csv'", "nowhere.csv"),
            ("colour = 1", "unknown field"),
        ] {
            let error = axis(text).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
            assert!(error.contains("(accepted: ") || error.contains("expected"), "{text}: {error}");
        }
    }
}
