//! Tables that are written once for several: `each`.

use asperity_model::scenario::typed::Refused;
use asperity_record::bounds::LONGEST_TOML_BYTES;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue};

/// Replaces every table of a list that has `each`, a list of tables, by one for each of these: with its own keys, those
/// of the member before them, and the overrides `set` of both.
///
/// # Errors
/// If `each` is no list of tables, or all that it stands for is longer than the longest text.
pub(crate) fn write_out(root: &mut DeTable<'_>) -> Result<(), Refused> {
    let mut left = LONGEST_TOML_BYTES;
    in_table(root, &mut left)
}

fn in_table<'i>(table: &mut DeTable<'i>, left: &mut usize) -> Result<(), Refused> {
    for (_, value) in table.iter_mut() {
        match value.get_mut() {
            DeValue::Table(table) => in_table(table, left)?,
            DeValue::Array(array) if array.iter().any(|item| item.get_ref().is_table()) => {
                in_array(array, left)?
            }
            _ => {}
        }
    }
    Ok(())
}

fn in_array<'i>(array: &mut DeArray<'i>, left: &mut usize) -> Result<(), Refused> {
    let mut all: DeArray<'i> = DeArray::new();
    for mut item in std::mem::replace(array, DeArray::new()) {
        let at = item.span();
        let DeValue::Table(table) = item.get_mut() else {
            all.push(item);
            continue;
        };
        let Some(each) = table.remove("each") else {
            in_table(table, left)?;
            all.push(item);
            continue;
        };
        let refused =
            |problem: &str| (each.span().start, format!("each: {problem} (accepted: a list of tables)"));
        let members = each.get_ref().as_array().ok_or_else(|| refused("it is no list"))?;
        let common: usize = table.values().map(|value| value.span().len()).sum();
        for member in members.iter() {
            let own = member.get_ref().as_table().ok_or_else(|| refused("a member is no table"))?;
            *left = left.checked_sub(common + member.span().len()).ok_or_else(|| {
                let most = format!("more than {LONGEST_TOML_BYTES} bytes when written out (accepted: fewer)");
                (each.span().start, format!("each: {most}"))
            })?;
            let mut whole = table.clone();
            for (key, value) in own {
                let value =
                    match (key.get_ref().as_ref(), table.get("set").map(Spanned::get_ref), value.get_ref()) {
                        ("set", Some(DeValue::Array(common)), DeValue::Array(own)) => {
                            let both: DeArray<'i> = common.iter().chain(own.iter()).cloned().collect();
                            Spanned::new(value.span(), DeValue::Array(both))
                        }
                        _ => value.clone(),
                    };
                whole.insert(key.clone(), value);
            }
            in_table(&mut whole, left)?;
            all.push(Spanned::new(at.clone(), DeValue::Table(whole)));
        }
    }
    *array = all;
    Ok(())
}
