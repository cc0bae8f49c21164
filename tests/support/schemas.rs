//! Every key of pipelines and of the figures of sweeps with its type and meaning, as Markdown tables derived from the
//! types that read them.

use asperity_figures::spelling::spelled;
use asperity_numbers::{Key, Number, OfRecording, Summary};
use asperity_record::{Column, ColumnKind};
use asperity_study::pipeline::Pipeline;
use schemars::{JsonSchema, SchemaGenerator};
use serde_json::{Map, Value};

/// The parts of the page that are made from the code: the name of each, and its text.
pub(crate) fn parts() -> Vec<(&'static str, String)> {
    let study = Schema::of::<Pipeline>();
    let figures = study.resolved(&study.root["properties"]["figure"]);
    vec![
        ("sweep figures", study.kinds(figures, "figure.", |name| name == "family")),
        ("pipeline figures", study.kinds(figures, "figure.", |name| name != "family")),
        ("numbers", keys(Number::all().filter(|number| !number.is_of_summary()).map(|number| number.key))),
        ("summary", keys(Summary::KEYS.iter().chain(OfRecording::KEYS))),
        ("pipeline tables", study.tables(&["run", "precursors", "study", "claim"])),
    ]
}

/// The schema of a type.
struct Schema {
    root: Value,
}

impl Schema {
    fn of<T: JsonSchema>() -> Schema {
        Schema { root: SchemaGenerator::default().into_root_schema_for::<T>().to_value() }
    }

    /// Resolves a reference; for a nullable schema, returns the other alternative.
    fn resolved<'a>(&'a self, schema: &'a Value) -> &'a Value {
        let either = schema["anyOf"].as_array().into_iter().flatten();
        if let Some(other) = either.clone().find(|other| other["type"] != "null") {
            return self.resolved(other);
        }
        match schema["$ref"].as_str().and_then(|path| path.rsplit('/').next()) {
            Some(name) => &self.root["$defs"][name],
            None => schema,
        }
    }

    /// The kinds of figures: a heading, what each shows, and its keys.
    fn kinds(&self, of: &Value, before: &str, is_wanted: fn(&str) -> bool) -> String {
        let kinds = of["properties"].as_object().into_iter().flatten().filter(|(name, _)| is_wanted(name));
        let mut kinds: Vec<(&String, &Value)> = kinds.collect();
        kinds.sort_by_key(|(name, _)| name.as_str());
        let mut text = String::new();
        for (name, kind) in kinds {
            let about = said(kind);
            let item = self.resolved(&kind["items"]);
            text.push_str(&format!(
                "### `[[{before}{name}]]`\n\n{}\n\n{}\n",
                wrapped(&about),
                self.keys(item)
            ));
        }
        text
    }

    /// The tables of a pipeline with these names.
    fn tables(&self, names: &[&str]) -> String {
        let mut text = String::new();
        for name in names {
            let item = self.resolved(&self.root["properties"][name]["items"]);
            text.push_str(&format!("### `[[{name}]]`\n\n{}\n\n{}\n", wrapped(&said(item)), self.keys(item)));
        }
        text
    }

    /// The keys of a table, those of tables within it behind a dot.
    fn keys(&self, of: &Value) -> String {
        let mut text = String::from("| key | holds | without it | meaning |\n|---|---|---|---|\n");
        self.add_keys(of, "", &mut text);
        text
    }

    fn add_keys(&self, of: &Value, before: &str, text: &mut String) {
        let none = Map::new();
        let properties = of["properties"].as_object().unwrap_or(&none);
        let required: Vec<&str> =
            of["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        // Required keys come first.
        let (needed, other): (Vec<_>, Vec<_>) =
            properties.iter().partition(|(name, _)| required.contains(&name.as_str()));
        for (name, key) in needed.into_iter().chain(other) {
            let without = match &key["default"] {
                _ if required.contains(&name.as_str()) => "refused".to_owned(),
                Value::Null => String::new(),
                Value::String(text) if text.is_empty() => String::new(),
                Value::Array(list) if list.is_empty() => String::new(),
                Value::String(text) if text == "μ_k" => "as in Chapter 5 of the thesis".to_owned(),
                Value::String(text) => format!("`\"{text}\"`"),
                other => format!("`{other}`"),
            };
            let holds = self.holds(key);
            let about = said(key).replace('|', "\\|");
            text.push_str(&format!("| `{before}{name}` | {holds} | {without} | {about} |\n"));
            let within =
                if key["items"].is_null() { self.resolved(key) } else { self.resolved(&key["items"]) };
            if within["properties"].is_object() {
                self.add_keys(within, &format!("{before}{name}."), text);
            }
        }
    }

    /// The type of a key, in words.
    fn holds(&self, key: &Value) -> String {
        let own = self.resolved(key);
        if key.to_string().contains("/Number\"") {
            let many = if key["type"] == "array" { "names of numbers" } else { "name of a number" };
            return format!("[{many}](#numbers)");
        }
        let words = words(own);
        if !words.is_empty() {
            let quoted: Vec<String> = words.iter().map(|(word, _)| format!("`{word}`")).collect();
            return quoted.join(", ");
        }
        let kind = match &own["type"] {
            Value::Array(kinds) => kinds.iter().find(|kind| *kind != "null").and_then(Value::as_str),
            kind => kind.as_str(),
        };
        match kind {
            Some("string") => "text".to_owned(),
            Some("number") => "number".to_owned(),
            Some("integer") => "whole number".to_owned(),
            Some("boolean") => "true or false".to_owned(),
            Some("object") => "table".to_owned(),
            Some("array") => match self.holds(&own["items"]).as_str() {
                kind @ ("table" | "text" | "number" | "whole number") => format!("list of {kind}s"),
                _ => "list of values".to_owned(),
            },
            _ => "value".to_owned(),
        }
    }
}

/// Numbers of a run with their units and meanings, under their headings.
fn keys<'a>(keys: impl IntoIterator<Item = &'a Key>) -> String {
    let mut text = String::from("| number | unit | meaning |\n|---|---|---|\n");
    let mut group = "";
    for key in keys {
        if key.group != group {
            group = key.group;
            text.push_str(&format!("| **{group}** | | |\n"));
        }
        let Column { name, kind, unit, about, .. } = &key.column;
        let holds = unit.unwrap_or(match kind {
            ColumnKind::Flag => "yes or no",
            ColumnKind::Word => "word",
            _ => "whole number",
        });
        let about = spelled(about).replace(&format!(", {holds};"), ";").replace(&format!(", {holds}."), ".");
        text.push_str(&format!("| `{name}` | {holds} | {} |\n", about.replace('|', "\\|")));
    }
    text
}

/// The words that an enumeration accepts, each with its meaning.
fn words(schema: &Value) -> Vec<(&str, String)> {
    let plain = schema["enum"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let one_of = schema["oneOf"].as_array().into_iter().flatten();
    let told = one_of.flat_map(|choice| {
        let about = said(choice);
        let own = choice["const"].as_str().map(|word| (word, about.clone()));
        let several = choice["enum"].as_array().into_iter().flatten().filter_map(Value::as_str);
        own.into_iter().chain(several.map(move |word| (word, about.clone())))
    });
    plain.map(|word| (word, String::new())).chain(told).collect()
}

/// The comment on a key, on one line and as pages write symbols.
fn said(schema: &Value) -> String {
    spelled(schema["description"].as_str().unwrap_or_default())
}

/// A paragraph in lines of 120 columns at most.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("there is always a line");
        if line.chars().count() + 1 + word.chars().count() > 120 {
            lines.push(word.to_owned());
        } else {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines.join("\n")
}
