//! Scenario texts as layers, and the errors that point into them.
//!
//! A scenario consists of a file or a built-in text and any number of `--set key=value` overrides, each
//! parsed as a line of TOML. Every value keeps the place where it was written, so that an error found
//! later, when values are compared, still names file, line and column.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use asperity_record::bounds::check_toml;
use serde::Deserialize;
use toml::Value;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::scenario::files::Files;
use crate::scenario::key::any_number;
use crate::scenario::keys::{self, WINDOW};
use crate::scenario::stand_ins;
use crate::scenario::text::Lines;

/// A scenario as written: a base text and its overrides, each parsed once, however many scenarios have it as a layer.
#[derive(Debug, Clone)]
pub struct ScenarioSource {
    layers: Vec<Arc<Result<Entries, ScenarioError>>>,
}

/// A text while it is parsed.
struct Layer<'a> {
    /// A file's path, `built-in default`, or `--set`.
    origin: &'a str,
    text: &'a str,
    lines: Lines,
    kind: LayerKind,
}

/// The origin of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LayerKind {
    /// A scenario file or built-in text.
    Scenario,
    /// The log of a run; a program with fewer rules may have written it.
    Log,
    /// An override for one run.
    Override,
}

impl ScenarioSource {
    /// A scenario text and the name of its source, for error messages.
    pub fn new(origin: impl Into<String>, text: impl Into<String>) -> ScenarioSource {
        ScenarioSource { layers: vec![Layer::parsed(&origin.into(), &text.into(), LayerKind::Scenario)] }
    }

    /// The scenario embedded in a run log. Keys that its friction law does not use are ignored. No file that it names
    /// is opened.
    pub fn logged(origin: impl Into<String>, text: impl Into<String>) -> ScenarioSource {
        ScenarioSource { layers: vec![Layer::parsed(&origin.into(), &text.into(), LayerKind::Log)] }
    }

    /// The `parameter_set` that a layer names, as written.
    pub fn named_set(&self) -> Option<String> {
        let mut entries = self.entries().ok()?;
        let entry = entries.values.remove("parameter_set")?;
        let word = entry.value.as_ref().and_then(Value::as_str).map(str::to_owned);
        Some(word.unwrap_or(entry.written))
    }

    /// Adds an override of the form `key=value`; later overrides win. A value that is not TOML is
    /// read as a string, so that `friction.reattach=two-way` needs no quotes. A key that is not
    /// TOML, such as `k_t/k`, is quoted, so that the error can suggest a known key.
    #[must_use]
    pub fn with_override(self, assignment: &str) -> ScenarioSource {
        self.with_override_from(format!("--set {assignment}"), assignment)
    }

    /// Adds an override as [`ScenarioSource::with_override`] does; errors call it `origin`.
    #[must_use]
    pub fn with_override_from(mut self, origin: String, assignment: &str) -> ScenarioSource {
        let layer = |text: &str| Layer::parsed(&origin, text, LayerKind::Override);
        let is_toml = |layer: &Arc<Result<Entries, ScenarioError>>| layer.is_ok();
        let mut added = layer(assignment);
        if let Some((key, value)) = assignment.split_once('=').filter(|_| !is_toml(&added)) {
            let quoted = |text: &str| toml::Value::String(text.trim().to_owned()).to_string();
            added = layer(&format!("{key}={}", quoted(value)));
            let is_word = !key.trim().is_empty() && !key.contains(['"', '\'', '[', '#', '\n', '\r']);
            if is_word && !is_toml(&added) {
                let with_quoted_key =
                    [value.to_owned(), quoted(value)].map(|value| layer(&format!("{}={value}", quoted(key))));
                added = with_quoted_key.into_iter().find(is_toml).unwrap_or(added);
            }
        }
        self.layers.push(added);
        self
    }

    /// Its layers, the lowest first, without those that are no TOML.
    pub(crate) fn readable(&self) -> impl Iterator<Item = &Entries> {
        self.layers.iter().filter_map(|layer| layer.as_ref().as_ref().ok())
    }

    /// Collects all values by dotted key; later layers override earlier ones.
    ///
    /// # Errors
    /// If a layer is not valid TOML.
    pub(crate) fn entries(&self) -> Result<Entries, ScenarioErrors> {
        let mut entries = Entries::default();
        let mut errors = Vec::new();
        for layer in &self.layers {
            match layer.as_ref() {
                Ok(layer @ Entries { values, windows }) => {
                    stand_ins::give_way(&mut entries, layer);
                    entries.values.extend(values.clone());
                    // A layer with windows replaces the windows of all layers below.
                    entries.windows = windows.clone().or(entries.windows);
                }
                Err(error) => errors.push(error.clone()),
            }
        }
        if errors.is_empty() { Ok(entries) } else { Err(ScenarioErrors(errors)) }
    }
}

impl Layer<'_> {
    fn parsed(origin: &str, text: &str, kind: LayerKind) -> Arc<Result<Entries, ScenarioError>> {
        Arc::new(Layer { origin, text, lines: Lines::of(text), kind }.entries())
    }

    fn entries(&self) -> Result<Entries, ScenarioError> {
        let error =
            |place, problem, accepted| ScenarioError { place: Some(place), key: None, problem, accepted };
        check_toml(self.text)
            .map_err(|too_long| error(self.origin.to_owned(), too_long.to_string(), None))?;
        let table = DeTable::parse(self.text).map_err(|wrong| {
            let at = wrong.span().unwrap_or(0..0);
            if let Some(unquoted) = self.unquoted(at.start) {
                return unquoted;
            }
            let accepted = match is_decimal_comma(self.text, at.start) {
                _ if self.is_override() => Some("KEY=VALUE, as in --set time.duration_s=0.1"),
                is_comma => is_comma.then_some("a number with a decimal point, as 0.1"),
            };
            let problem = format!("not TOML: {}", wrong.message());
            error(self.place(at), problem, accepted.map(str::to_owned))
        })?;
        let mut entries = Entries::default();
        collect(self, "", table.get_ref(), &mut entries);
        Ok(entries)
    }

    /// The error of a word without quotes, if that is all that is wrong with the text, in the words of its key.
    fn unquoted(&self, at: usize) -> Option<ScenarioError> {
        let rest = self.text.get(at..)?;
        let is_of_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_');
        let word = &rest[..rest.find(|c| !is_of_word(c)).unwrap_or(rest.len())];
        let text = format!("{}\"{word}\"{}", &self.text[..at], &rest[word.len()..]);
        let quoted = Layer { text: &text, lines: Lines::of(&text), ..*self };
        let mut entries = Entries::default();
        collect(&quoted, "", DeTable::parse(&text).ok()?.get_ref(), &mut entries);
        let (path, entry) = entries.values.iter().find(|(_, entry)| entry.place == self.place(at..at))?;
        let (key, words) = (keys::named(path)?, entry.value.as_ref()?.as_str()?);
        let problem = format!("{word} lacks its quotes{}", key.kind.suggestion(words));
        Some(entry.error(path, problem, key.kind.to_string()))
    }

    fn is_override(&self) -> bool {
        self.kind == LayerKind::Override
    }

    fn place(&self, span: Range<usize>) -> String {
        if self.is_override() {
            return self.origin.to_owned();
        }
        format!("{}:{}", self.origin, self.lines.place(self.text, span.start))
    }
}

/// A value and where it was written.
#[derive(Debug, Clone)]
pub(crate) struct Entry {
    /// `None` of a whole number that no program holds.
    pub(crate) value: Option<Value>,
    /// The value as it was written, in short.
    pub(crate) written: String,
    pub(crate) place: String,
    pub(crate) layer: LayerKind,
}

impl Entry {
    /// An error in the value, of a key of this path.
    pub(crate) fn error(
        &self,
        path: impl Into<String>,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) -> ScenarioError {
        ScenarioError {
            place: Some(self.place.clone()),
            key: Some(path.into()),
            problem: problem.into(),
            accepted: Some(accepted.into()),
        }
    }
}

/// All written values: by key, and by window.
#[derive(Debug, Default)]
pub(crate) struct Entries {
    pub(crate) values: BTreeMap<String, Entry>,
    /// None if no layer has a list of windows.
    pub(crate) windows: Option<Vec<BTreeMap<String, Entry>>>,
}

impl Entries {
    /// An error in the value of a key.
    pub(crate) fn error(
        &self,
        key: &str,
        problem: impl Into<String>,
        accepted: impl Into<String>,
    ) -> ScenarioError {
        let place = self.values.get(key).map(|entry| entry.place.clone());
        let (problem, accepted) = (problem.into(), Some(accepted.into()));
        ScenarioError { place, key: Some(key.to_owned()), problem, accepted }
    }

    /// Whether they are overrides for one run.
    pub(crate) fn is_override(&self) -> bool {
        self.values.values().any(|entry| entry.layer == LayerKind::Override)
    }

    pub(crate) fn has(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }

    /// The number written for a key.
    pub(crate) fn number(&self, key: &str) -> Option<f64> {
        self.values.get(key)?.value.as_ref().and_then(any_number)
    }

    /// Whether a key was written for this run alone, and another one was not.
    pub(crate) fn overrides(&self, key: &str, other: &str) -> bool {
        let is_override =
            |key: &str| self.values.get(key).is_some_and(|entry| entry.layer == LayerKind::Override);
        is_override(key) && !is_override(other)
    }
}

/// A scenario as written, what opens its files, and the errors found so far.
pub(crate) struct Refusals<'a> {
    pub(crate) entries: &'a Entries,
    pub(crate) files: Option<&'a dyn Files>,
    pub(crate) errors: Vec<ScenarioError>,
}

impl Refusals<'_> {
    /// Refuses the value of a key.
    pub(crate) fn refuse(&mut self, key: &str, problem: impl Into<String>, accepted: impl Into<String>) {
        self.errors.push(self.entries.error(key, problem, accepted));
    }

    /// Refuses a key of a window, counted from 0.
    pub(crate) fn refuse_in_window(&mut self, index: usize, key: &str, problem: String, accepted: String) {
        let window = self.entries.windows.iter().flatten().nth(index);
        self.errors.push(ScenarioError {
            place: window.and_then(|window| window.get(key)).map(|entry| entry.place.clone()),
            key: Some(format!("{WINDOW}.{key}")),
            problem,
            accepted: Some(accepted),
        });
    }

    /// Goes on if nothing has been refused so far.
    pub(crate) fn none_so_far(&mut self) -> Result<(), ScenarioErrors> {
        let errors = std::mem::take(&mut self.errors);
        if errors.is_empty() { Ok(()) } else { Err(ScenarioErrors(errors)) }
    }
}

/// Whether there is a comma between two digits.
fn is_decimal_comma(text: &str, at: usize) -> bool {
    let around = text.as_bytes().get(at.saturating_sub(1)..).unwrap_or_default();
    matches!(around, [before, b',', after, ..] if before.is_ascii_digit() && after.is_ascii_digit())
}

fn collect(layer: &Layer<'_>, prefix: &str, table: &DeTable<'_>, entries: &mut Entries) {
    for (key, value) in table {
        let path =
            if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        match value.get_ref() {
            // Every record has energies, which a key of earlier code says; what is drawn follows from other keys.
            _ if layer.kind == LayerKind::Log && ["recording.energies", "drawn"].contains(&&*path) => {}
            DeValue::Table(inner) => collect(layer, &path, inner, entries),
            DeValue::Array(windows) if path == WINDOW && windows.iter().all(|w| w.get_ref().is_table()) => {
                let windows = windows.iter().map(|window| {
                    let mut found = Entries::default();
                    if let Some(table) = window.get_ref().as_table() {
                        collect(layer, "", table, &mut found);
                    }
                    found.values
                });
                entries.windows = Some(windows.collect());
            }
            _ => {
                let (place, written) = (layer.place(value.span()), in_short(&layer.text[value.span()]));
                let value = Value::deserialize(ValueDeserializer::from(value.clone())).ok();
                let entry = Entry { value, written, place, layer: layer.kind };
                entries.values.insert(path, entry);
            }
        }
    }
}

/// Most bytes of a value that messages show.
const MOST_SHOWN: usize = 100;

/// A value as it was written, on one line.
fn in_short(written: &str) -> String {
    let shown = written.split_whitespace().collect::<Vec<_>>().join(" ");
    if shown.len() <= MOST_SHOWN {
        return shown;
    }
    format!("{}... ({} bytes)", &shown[..shown.floor_char_boundary(MOST_SHOWN)], written.len())
}

/// One thing wrong with a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioError {
    /// File, line and column, or the override; `None` for a default.
    pub place: Option<String>,
    /// Dotted key.
    pub key: Option<String>,
    /// The error, with the value.
    pub problem: String,
    /// The accepted values.
    pub accepted: Option<String>,
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        if let Some(key) = &self.key {
            write!(f, "{key}: ")?;
        }
        f.write_str(&self.problem)?;
        if let Some(accepted) = &self.accepted {
            write!(f, " (accepted: {accepted})")?;
        }
        Ok(())
    }
}

/// Everything that is wrong with a scenario, in the order of the keys.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(ScenarioError::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ScenarioErrors(pub Vec<ScenarioError>);
