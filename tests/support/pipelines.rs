//! Pipelines as they are meant: `each`, rows of values and names with `*` written out, as docs/studies.md says.

use toml::{Table, Value};

/// The text of a pipeline, written out.
pub(crate) fn written_out(text: &str) -> Table {
    let mut pipeline: Table = text.parse().expect("it is TOML");
    pipeline.iter_mut().for_each(|(_, value)| each(value));
    let runs = pipeline.get("run").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let runs: Vec<Value> = runs.iter().flat_map(|run| members(run.as_table().expect("a table"))).collect();
    let names: Vec<String> =
        runs.iter().map(|run| run["name"].as_str().expect("a name").to_owned()).collect();
    pipeline.iter_mut().for_each(|(_, value)| stars(value, &names));
    if !runs.is_empty() {
        pipeline.insert("run".to_owned(), Value::Array(runs));
    }
    pipeline
}

fn each(value: &mut Value) {
    match value {
        Value::Table(table) => table.iter_mut().for_each(|(_, value)| each(value)),
        Value::Array(items) => {
            let all = std::mem::take(items).into_iter().flat_map(|item| match item {
                Value::Table(mut table) if table.contains_key("each") => {
                    let members = table.remove("each").expect("it is there");
                    let members = members.as_array().expect("a list").clone();
                    let whole = |member: Value| {
                        let mut whole = table.clone();
                        whole.extend(member.as_table().expect("a table").clone());
                        Value::Table(whole)
                    };
                    members.into_iter().map(whole).collect::<Vec<Value>>()
                }
                other => vec![other],
            });
            *items = all.collect();
            items.iter_mut().for_each(each);
        }
        _ => {}
    }
}

/// The runs that one with `keys` and `values` stands for.
fn members(run: &Table) -> Vec<Value> {
    let Some(rows) = run.get("values").and_then(Value::as_array) else {
        return vec![Value::Table(run.clone())];
    };
    let name = run["name"].as_str().expect("a name");
    let member = |(number, row): (usize, &Value)| {
        let mut cells = row.as_array().map_or_else(|| vec![row.clone()], Clone::clone).into_iter();
        let name = if name.contains("{}") {
            let own = cells.next().expect("it begins with what stands in the name");
            name.replace("{}", own.as_str().expect("text"))
        } else {
            format!("{name}-{number}")
        };
        let common = run.get("set").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let keys = run["keys"].as_array().expect("a list").iter().map(|key| key.as_str().expect("text"));
        let own = keys.zip(cells).map(|(key, cell)| Value::String(format!("{key}={cell}")));
        let set: Vec<Value> = common.iter().cloned().chain(own).collect();
        let mut member = run.clone();
        member.retain(|key, _| key != "keys" && key != "values");
        member.extend([("name".to_owned(), Value::String(name)), ("set".to_owned(), Value::Array(set))]);
        Value::Table(member)
    };
    (1..).zip(rows).map(member).collect()
}

fn stars(value: &mut Value, names: &[String]) {
    match value {
        Value::Table(table) => table.iter_mut().for_each(|(_, value)| stars(value, names)),
        Value::Array(items) => {
            let fit = |item: Value| match item.as_str().and_then(|name| name.split_once('*')) {
                Some((start, end)) => names
                    .iter()
                    .filter(|name| name.len() >= start.len() + end.len())
                    .filter(|name| name.starts_with(start) && name.ends_with(end))
                    .map(|name| Value::String(name.clone()))
                    .collect(),
                None => vec![item],
            };
            *items = std::mem::take(items).into_iter().flat_map(fit).collect();
            items.iter_mut().for_each(|item| stars(item, names));
        }
        _ => {}
    }
}
