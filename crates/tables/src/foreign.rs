//! Events of detectors that this program does not have: their columns follow from the schema stored in the
//! log, if that is one flat object of numbers and flags.

use asperity_record::{Cell, Column, ColumnKind, unit_of};
use indexmap::IndexMap;
use serde::Deserialize;
use serde_json::{Map, Value};

/// Most columns of a table; no hand-written schema has more.
const MOST_COLUMNS: usize = 1000;

/// Names of topics and columns are no longer than this, in bytes: files are named after them.
const LONGEST_NAME: usize = 100;

/// The parts of a schema that are used.
#[derive(Deserialize)]
struct Schema {
    r#type: Value,
    /// In the order in which they are written.
    properties: IndexMap<String, Value>,
}

/// Whether a table can be named after a topic. Few characters are allowed, so that no two topics give the
/// same file.
pub(crate) fn is_plain(topic: &str) -> bool {
    let Some(name) = topic.strip_prefix("/events/") else { return false };
    let is_plain = |part: &str| {
        !part.is_empty() && part.bytes().all(|c| matches!(c, b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_'))
    };
    topic.len() <= LONGEST_NAME && name.split('/').all(is_plain)
}

/// The columns of a table of messages with this JSON schema, in the order of its properties;
/// none if they are not flat.
pub(crate) fn columns(schema: &str) -> Option<Vec<Column>> {
    let Schema { r#type, properties } = serde_json::from_str(schema).ok()?;
    if r#type != "object" || properties.is_empty() || properties.len() > MOST_COLUMNS {
        return None;
    }
    let mut columns: Vec<Column> = Vec::new();
    for (name, property) in properties {
        if name.is_empty() || name.len() > LONGEST_NAME {
            return None;
        }
        let kind = kind(&property)?;
        let unit = unit_of(&name).filter(|_| kind == ColumnKind::Number);
        let about = property["description"].as_str().unwrap_or_default().replace('\n', " ");
        columns.push(Column {
            name: name.into(),
            kind,
            unit,
            about: about.into(),
            is_optional: true,
            ..Column::new("", ColumnKind::Word, "")
        });
    }
    Some(columns)
}

/// Type of a property's values, apart from null.
fn kind(property: &Value) -> Option<ColumnKind> {
    let types: Vec<&str> = match &property["type"] {
        Value::String(one) => vec![one],
        Value::Array(several) => several.iter().map(Value::as_str).collect::<Option<_>>()?,
        _ => return None,
    };
    let types: Vec<&str> = types.into_iter().filter(|name| *name != "null").collect();
    match types[..] {
        ["boolean"] => Some(ColumnKind::Flag),
        ["number"] => Some(ColumnKind::Number),
        ["integer"] if property["format"] == "uint32" => Some(ColumnKind::Count),
        ["integer"] if property["minimum"].as_f64().is_some_and(|least| least >= 0.0) => {
            Some(ColumnKind::Step)
        }
        // Values that may be negative fit no other column.
        ["integer"] => Some(ColumnKind::Number),
        _ => None,
    }
}

/// The row of a payload, which must match its schema exactly.
///
/// # Errors
/// If it does not match the columns.
pub(crate) fn cells(columns: &[Column], payload: &str) -> Result<Vec<Cell>, String> {
    let object: Map<String, Value> = serde_json::from_str(payload).map_err(|error| error.to_string())?;
    if let Some(name) = object.keys().find(|name| columns.iter().all(|column| column.name != **name)) {
        return Err(format!("{name:?} is not in its schema"));
    }
    let cell = |column: &Column| {
        let value = object.get(&*column.name).unwrap_or(&Value::Null);
        let unlike = || format!("{} = {value} (accepted: {})", column.name, column.kind.words());
        Cell::of_json(column.kind, value).ok_or_else(unlike)
    };
    columns.iter().map(cell).collect()
}

#[cfg(test)]
mod tests {
    use asperity_record::{Cell, ColumnKind, EventKind, GlobalSlip, SlipEvent};

    use super::{cells, columns, is_plain};

    #[test]
    fn our_own_schemas_give_the_columns_that_we_have() {
        for kind in [EventKind::of::<SlipEvent>(), EventKind::of::<GlobalSlip>()] {
            let mut found = columns(&kind.schema().to_string()).unwrap();
            let mut own = kind.columns();
            // A schema in a log is that of its run, and speaks of no roles.
            own.iter_mut().for_each(|column| column.over_area = None);
            own = own.into_iter().map(|column| column.with_role(None, true)).collect();
            found.sort_by(|a, b| a.name.cmp(&b.name));
            own.sort_by(|a, b| a.name.cmp(&b.name));
            assert_eq!(found, own);
        }
    }

    #[test]
    fn columns_stand_in_the_order_of_the_schema() {
        let schema = r#"{"type": "object", "properties": {
            "released_j": {"type": ["number", "null"], "description": "Energy."},
            "block": {"type": "integer", "format": "uint32", "minimum": 0},
            "change": {"type": "array"},
            "change": {"type": "integer"},
            "whole": {"type": "boolean"}
        }}"#;
        // A name written twice counts as written last, as for any reader of JSON.
        let columns = columns(schema).unwrap();
        let seen: Vec<_> = columns.iter().map(|column| (&*column.name, column.kind, column.unit)).collect();
        assert_eq!(
            seen,
            [
                ("released_j", ColumnKind::Number, Some("J")),
                ("block", ColumnKind::Count, None),
                ("change", ColumnKind::Number, None),
                ("whole", ColumnKind::Flag, None),
            ]
        );
        assert_eq!(
            cells(&columns, r#"{"block": 7, "change": -3, "whole": true}"#).unwrap(),
            [Cell::Empty, Cell::Count(7), Cell::Number(-3.0), Cell::Flag(true)]
        );
        for (payload, problem) in [
            (r#"{"block": -7}"#, "block = -7 (accepted: whole number, 32 bits)"),
            (r#"{"blocks": 7}"#, "\"blocks\" is not in its schema"),
            ("[]", "invalid type"),
        ] {
            let error = cells(&columns, payload).unwrap_err();
            assert!(error.contains(problem), "{payload}: {error}");
        }
    }

    #[test]
    fn what_is_not_flat_has_no_columns() {
        for schema in [
            "true",
            r#"{"type": "array"}"#,
            r#"{"type": "object", "properties": {}}"#,
            r#"{"type": "object", "properties": {"a": {"type": "array"}}}"#,
            r#"{"type": "object", "properties": {"a": {"type": "string"}}}"#,
            r##"{"type": "object", "properties": {"a": {"$ref": "#/$defs/A"}}}"##,
        ] {
            assert_eq!(columns(schema), None, "{schema}");
        }
    }

    #[test]
    fn tables_are_named_after_plain_topics_only() {
        for (topic, plain) in [
            ("/events/longest", true),
            ("/events/mine/longest-2", true),
            ("/events/", false),
            ("/events/../x", false),
            ("/events/a//b", false),
            ("/events/a.b", false),
            ("/events/A", false),
            ("/step", false),
        ] {
            assert_eq!(is_plain(topic), plain, "{topic}");
        }
    }
}
