//! The keys of the tables of a study as the types that read them describe them, with examples that run.

use asperity_numbers::curve::NamedCurves;
use schemars::schema_for;
use serde_json::{Map, Value};

use crate::draw::Figures;
use crate::spelling::spelled;

/// Studies with each kind of figure: of named runs, and of runs over axes.
pub const EXAMPLES: [&str; 2] = [include_str!("examples/kinds.toml"), include_str!("examples/family.toml")];

/// A thing with named parts: a table with its columns or keys, or a group of numbers.
#[derive(Debug, Default)]
pub struct Explained {
    /// What it is called.
    pub name: String,
    /// What it is.
    pub about: String,
    /// Its parts: the name of each, what it holds, what goes with that, and its meaning.
    pub parts: Vec<[String; 4]>,
    /// A file that uses it, where there is one.
    pub example: String,
}

impl Explained {
    /// A list of tables in a schema, by its name in files: each key with name, type, default and meaning.
    pub fn of_list(name: &str, root: &Value, list: &Value) -> Explained {
        let mut parts = Vec::new();
        let item = resolved(root, &list["items"]);
        add_keys(root, item, "", &mut parts);
        let (about, head) = if name.starts_with('[') {
            (item, name.to_owned())
        } else {
            (list, format!("[[figure.{name}]]"))
        };
        Explained { name: name.to_owned(), about: said(about), parts, example: example(&head) }
    }
}

/// All kinds of figures by name, curves as a kind each.
pub fn figures() -> Vec<Explained> {
    let root = schema_for!(Figures).to_value();
    let kinds = root["properties"].as_object().into_iter().flatten();
    let mut all: Vec<_> = kinds.map(|(name, list)| Explained::of_list(name, &root, list)).collect();
    let curve = all.remove(all.iter().position(|kind| kind.name == "curve").expect("curves are figures"));
    all.extend(NamedCurves::all().iter().map(|curves| {
        let is_its =
            |key: &&[String; 4]| key[0].strip_prefix("keys.").is_none_or(|own| curves.keys.contains(&own));
        let parts = curve.parts.iter().filter(is_its).cloned().collect();
        let example = example(&format!("curve = \"{}\"\n", curves.name));
        Explained { name: curves.name.to_owned(), about: spelled(curves.about), parts, example }
    }));
    all.sort_by(|one, other| one.name.cmp(&other.name));
    all
}

/// The last part of the examples that has this, and the runs that it names.
fn example(head: &str) -> String {
    let parts = || EXAMPLES[0].trim_end().split("\n\n");
    let Some(own) = parts().filter(|part| part.contains(head)).last() else { return EXAMPLES[1].to_owned() };
    let is_named = |part: &&str| {
        let run = part.strip_prefix("[[run]]\nname = \"").and_then(|rest| rest.split('"').next());
        *part != own && run.is_some_and(|run| own.contains(&format!("\"{run}")))
    };
    let all: Vec<_> =
        ["title = \"An example\""].into_iter().chain(parts().filter(is_named)).chain([own]).collect();
    all.join("\n\n") + "\n"
}

/// Resolves a reference; of a schema that may be null, gives the other alternative.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let mut either = schema["anyOf"].as_array().into_iter().flatten();
    match (either.find(|other| other["type"] != "null"), schema["$ref"].as_str()) {
        (Some(other), _) => resolved(root, other),
        (None, Some(path)) => &root["$defs"][path.rsplit('/').next().unwrap_or_default()],
        (None, None) => schema,
    }
}

/// Adds the keys of a table, required ones first, those of tables within it behind a dot.
fn add_keys(root: &Value, table: &Value, before: &str, keys: &mut Vec<[String; 4]>) {
    let is_required =
        |name: &str| table["required"].as_array().is_some_and(|all| all.iter().any(|key| key == name));
    let all = table["properties"].as_object().into_iter().flat_map(Map::iter);
    let (needed, other): (Vec<_>, Vec<_>) = all.partition(|(name, _)| is_required(name));
    for (name, key) in needed.into_iter().chain(other) {
        let default = match &key["default"] {
            _ if is_required(name) => "required".to_owned(),
            Value::Bool(_) | Value::Number(_) => format!("default {}", key["default"]),
            _ => String::new(),
        };
        keys.push([format!("{before}{name}"), type_of(root, key), default, said(key)]);
        let within = if key["items"].is_null() { key } else { &key["items"] };
        add_keys(root, resolved(root, within), &format!("{before}{name}."), keys);
    }
}

/// The type of a key in words, or the words that it accepts.
fn type_of(root: &Value, key: &Value) -> String {
    let own = resolved(root, key);
    let choices = own["oneOf"].as_array().into_iter().flatten().chain([own]);
    let words = choices.flat_map(|of| of["enum"].as_array().into_iter().flatten().chain([&of["const"]]));
    let words: Vec<&str> = words.filter_map(Value::as_str).collect();
    match (words.len(), own["type"].as_str().or(own["type"][0].as_str())) {
        (0, Some("array")) => format!("list of {}", type_of(root, &own["items"])),
        (0, kind) => kind.unwrap_or("value").replace("object", "table"),
        (1..20, _) => words.join(", "),
        _ => "number (asperity numbers)".to_owned(),
    }
}

/// The comment on a key, as pages write symbols.
fn said(schema: &Value) -> String {
    spelled(schema["description"].as_str().unwrap_or_default())
}
