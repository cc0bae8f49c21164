//! Breaks every chunk of genuine logs, one at a time: the damage is detected, salvage keeps exactly the
//! messages of the other chunks, and its result is usable.

use std::fs;

use crate::case::{Case, try_all};
use crate::file;
use crate::ground::{Error, Genuine, Ground};
use crate::verdict::Verdict;

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    for path in ground.genuine_logs()? {
        let log = Genuine::read(&path)?;
        try_all(ground, "chunks", &log.name.clone(), log.chunks.len(), |case| broken(case, &log))?;
    }
    Ok(())
}

fn broken(case: &mut Case<'_>, log: &Genuine) -> Result<(), Error> {
    let number = case.number;
    let chunk = &log.chunks[number];
    let fields = file::chunk(chunk.body(&log.bytes)).ok_or("a genuine chunk cannot be read")?;
    let start = chunk.at.end - fields.records.len();
    let place = start + case.random.below(fields.records.len() as u64) as usize;
    let mut bytes = log.bytes.clone();
    bytes[place] ^= 1 << case.random.below(8);
    case.write("damaged.mcap", &bytes)?;
    let what = format!("byte {place} of {}, in chunk {number} of {}", log.name, log.chunks.len());

    case.must_be("a log with a broken chunk", "damaged.mcap", Verdict::Damaged)?;
    let salvage = case.call(&["salvage", "damaged.mcap", "--out", "salvaged.mcap"])?;
    case.hold(salvage.code == Some(0), "salvage of a log with a broken chunk does not exit with 0", || {
        format!("{what}: {}: {}", salvage.ending(), salvage.said())
    });
    if !case.path("salvaged.mcap").exists() {
        case.broke(
            "salvage of a log with a broken chunk makes nothing",
            format!("{what}: {}", salvage.said()),
        );
        return Ok(());
    }
    let salvaged = fs::read(case.path("salvaged.mcap"))?;
    let kept = match file::messages(&salvaged) {
        Ok(kept) => kept,
        Err(problem) => {
            case.broke("what salvage makes cannot be read", format!("{what}: {problem}"));
            return Ok(());
        }
    };
    let kept: Vec<&file::Message> = kept.iter().map(|(_, message)| message).collect();
    let expected = log.without(&[number]);
    if let Some(difference) = file::difference(&expected, &kept) {
        case.broke(
            "salvage keeps other messages than those outside the broken chunk",
            format!("{what}: {difference}"),
        );
    }
    case.must_be("a salvaged log", "salvaged.mcap", Verdict::Gaps)?;
    let gaps = Some(Verdict::Gaps.code());
    let export = case.call(&["export", "salvaged.mcap", "--to", "csv", "--out", "exported"])?;
    case.hold(export.code == gaps, "export of a salvaged log does not exit with 5", || {
        format!("{what}: {}: {}", export.ending(), export.said())
    });
    // Around the gap, and not only up to it: every step and event that was kept is a row.
    for (topic, table) in [("/step", "step"), ("/events/slip", "events.slip")] {
        let kept = kept.iter().filter(|message| &*message.topic == topic).count();
        let table = format!("exported/salvaged.{table}.csv");
        let rows = fs::read_to_string(case.path(&table)).map(|text| text.lines().count().saturating_sub(1));
        case.hold(
            rows.as_ref().is_ok_and(|rows| *rows == kept),
            "export of a salvaged log lacks rows",
            || {
                format!(
                    "{what}: {table} has {rows:?} rows, the log {kept} messages of {topic}: {}",
                    export.said()
                )
            },
        );
    }
    let reduce = case.call(&["reduce", "salvaged.mcap", "--out", "reduced"])?;
    case.hold(reduce.code == gaps, "reduce of a salvaged log does not exit with 5", || {
        format!("{what}: {}: {}", reduce.ending(), reduce.said())
    });
    Ok(())
}
