//! Records of every kind, each changed in one field, with everything else corrected: checksums, counts,
//! digests, indexes. `check` detects contradictions within the log, and a header or a topic that
//! contradicts its own scenario. Undetectable forgeries are listed here, each with the reason; any other
//! forgery that it accepts as complete is a failure.

use std::collections::BTreeMap;

use mcap::records::op;

use crate::case::{Case, try_all};
use crate::file;
use crate::forge::{Item, Log, Records, seal};
use crate::ground::{AREA, DENSE, Error, Genuine, Ground, RUN, SMALL, STATE};
use crate::parts::Part;
use crate::random::Random;
use crate::tally::say;
use crate::verdict::Verdict;

/// Kinds of forgeries that `check` may accept as complete, where a final `*` matches anything: data that no
/// command uses.
const WITHOUT_MEANING: [(&str, &str); 9] = [
    ("header library", "a free text of MCAP that names the library which wrote the file"),
    (
        "attachment scenario.toml times",
        "wall-clock times of MCAP; a log knows no wall clock, and nothing reads them",
    ),
    ("attachment scenario.toml media type", "a free text of MCAP for programs that show attachments"),
    ("attachment checkpoint times", "as for the scenario"),
    ("attachment checkpoint media type", "as for the scenario"),
    ("attachment checkpoint data", "of a whole log nothing goes on, so nothing reads its checkpoints"),
    ("chunk compression", "the same messages in other packing, as any MCAP tool may write them"),
    ("metadata run new key", "a key of a later program; who does not know it passes over it"),
    ("metadata run_end new key", "a key of a later program; who does not know it passes over it"),
];

/// Forgeries that only `check --again` can detect, which repeats the run; it must.
const ONLY_AGAIN: [(&str, &str); 5] = [
    ("message /fields *", "a state of the blocks"),
    ("message /window *", "a state of some blocks"),
    ("message /switch *", "a force on a block that switches, or where it is"),
    ("message /step *", "a load or an energy"),
    ("metadata run_end status", "whether the load was reached that stops the drive"),
];

/// Forgeries that no command can detect.
const NEVER: [(&str, &str); 2] = [
    ("metadata run_end solver*", "what the solver did; it is counted anew in every run, and may differ"),
    ("metadata run solver", "both solvers give the same messages"),
];

fn reason(list: &[(&str, &'static str)], kind: &str) -> Option<&'static str> {
    let fits = |pattern: &str| match pattern.strip_suffix('*') {
        Some(start) => kind.starts_with(start),
        None => kind == pattern,
    };
    list.iter().find(|(pattern, _)| fits(pattern)).map(|(_, why)| *why)
}

fn allowed(kind: &str) -> Option<&'static str> {
    let lists = [&WITHOUT_MEANING[..], &ONLY_AGAIN, &NEVER];
    lists.into_iter().find_map(|list| reason(list, kind))
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let mut logs = Vec::new();
    for (name, run) in [("small", &SMALL[..]), ("dense", &DENSE)] {
        logs.push(Log::read(&ground.genuine(name, run)?.bytes)?);
    }
    logs.push(Log::read(&ground.genuine_of("area", &AREA)?.bytes)?);
    logs.push(Log::read(&ground.genuine_of("state", &STATE)?.bytes)?);
    // Reassembled without a change they must be complete, or the tests would be meaningless.
    for log in &logs {
        let path = ground.work.join("rebuilt.mcap");
        std::fs::write(&path, log.bytes()?)?;
        let said = ground.succeed(&ground.work, &["check", "rebuilt.mcap"]);
        said.map_err(|error| format!("a log that was put together again is not whole: {error}"))?;
    }
    let whole = std::sync::Mutex::new(BTreeMap::new());
    try_all(ground, "forgeries", "whole logs", ground.size.forgeries, |case| {
        let log = &logs[case.number % logs.len()];
        let Some(kind) = forged(case, log)? else { return Ok(()) };
        *whole.lock().expect("no case panics with it").entry(kind).or_insert(0) += 1;
        Ok(())
    })?;
    for (kind, count) in whole.into_inner().expect("no case panics with it") {
        if let Some(why) = allowed(&kind) {
            say(&format!("  forgeries: {count} x {kind} called whole, as it may be: {why}"));
        }
    }
    checkpoints(ground)
}

/// One forgery; its kind, if it was called whole.
fn forged(case: &mut Case<'_>, log: &Log) -> Result<Option<String>, Error> {
    let (kind, what, bytes) = forge(&mut case.random, log)?;
    case.write("forged.mcap", &bytes)?;
    let judged = case.check("forged.mcap")?;
    if !judged.is_whole() {
        return Ok(None);
    }
    if allowed(&kind).is_none() {
        case.broke(
            format!("check calls whole a log with a forged {kind}"),
            format!("{what}: {}", judged.said()),
        );
    }
    if reason(&ONLY_AGAIN, &kind).is_some() {
        let again = case.call(&["check", "--again", "forged.mcap"])?;
        case.hold(
            again.code == Some(Verdict::Damaged.code()),
            &format!("check --again does not call damaged a log with a forged {kind}"),
            || format!("{what}: {}", again.said()),
        );
    }
    Ok(Some(kind))
}

/// The change, by kind and in detail, and the file.
type Forgery = (String, String, Vec<u8>);

fn forge(random: &mut Random, log: &Log) -> Result<Forgery, Error> {
    // Some fields do not change when they are altered as chance has it; then another one.
    loop {
        let made = match random.below(3) {
            0 => said(random, log)?,
            1 => indexed(random, log)?,
            _ => summarised(random, log)?,
        };
        if let Some(forgery) = made {
            return Ok(forgery);
        }
    }
}

/// Changes a record of the data section, and everything that repeats it.
fn said(random: &mut Random, log: &Log) -> Result<Option<Forgery>, Error> {
    let mut log = log.clone();
    let places = log.places();
    // Chooses the kind first, so that rare kinds are tried too.
    let mut kinds: BTreeMap<String, Vec<_>> = BTreeMap::new();
    let topics = topics(&log);
    for place in places {
        let Some(part) = log.at(place) else { continue };
        let topic = part.channel_id().filter(|_| part.opcode == op::MESSAGE).and_then(|id| topics.get(&id));
        let kind = topic.map_or_else(|| file::kind(part), |topic| format!("message {topic}"));
        kinds.entry(kind).or_default().push(place);
    }
    let chunks: Vec<usize> =
        (0..log.items.len()).filter(|at| matches!(&log.items[*at], Item::Chunk { .. })).collect();
    let chosen = random.below(kinds.len() as u64 + 1) as usize;
    let Some((kind, places)) = kinds.iter().nth(chosen) else {
        let at = chunks[random.below(chunks.len() as u64) as usize];
        if let Item::Chunk { compression, .. } = &mut log.items[at] {
            compression.clear();
        }
        return Ok(Some(("chunk compression".to_owned(), "a chunk unpacked".to_owned(), log.bytes()?)));
    };
    let place = places[random.below(places.len() as u64) as usize];
    if kind == "metadata chunk" {
        return chained(random, &log, kind);
    }
    let Some(part) = log.at_mut(place) else { return Ok(None) };
    let Some((field, what)) = change(random, part) else { return Ok(None) };
    if kind != "metadata run_end" {
        log.correct_end();
    }
    Ok(Some((format!("{kind} {field}"), what, log.bytes()?)))
}

/// Changes a record `chunk`; the following ones are right.
fn chained(random: &mut Random, log: &Log, kind: &str) -> Result<Option<Forgery>, Error> {
    let mut records = log.packed()?;
    records.chain();
    let links: Vec<usize> =
        (0..records.parts.len()).filter(|at| file::kind(&records.parts[*at].0) == kind).collect();
    let (part, as_is) = &mut records.parts[links[random.below(links.len() as u64) as usize]];
    let Some((field, what)) = change(random, part) else { return Ok(None) };
    *as_is = true;
    Ok(Some((format!("{kind} {field}"), what, records.sealed())))
}

/// The topic of each channel.
fn topics(log: &Log) -> BTreeMap<u16, String> {
    let places = log.places().into_iter().filter_map(|place| log.at(place));
    let channels = places.filter(|part| part.opcode == op::CHANNEL);
    channels.filter_map(|part| Some((part.channel_id()?, part.name()?.to_owned()))).collect()
}

/// A chunk's own fields or an index of messages changed; the summary follows.
fn indexed(random: &mut Random, log: &Log) -> Result<Option<Forgery>, Error> {
    let mut records: Records = log.packed()?;
    let places: Vec<usize> = (0..records.parts.len())
        .filter(|at| matches!(records.parts[*at].0.opcode, op::CHUNK | op::MESSAGE_INDEX))
        .collect();
    let place = places[random.below(places.len() as u64) as usize];
    if random.below(8) == 0 && records.parts[place].0.opcode == op::MESSAGE_INDEX {
        records.parts.remove(place);
        return Ok(Some((
            "message index gone".to_owned(),
            "one index of messages less".to_owned(),
            records.sealed(),
        )));
    }
    let part = &mut records.parts[place].0;
    let kind = file::kind(part);
    let (field, range) = match part.opcode {
        op::CHUNK => [("first time", 0..8), ("last time", 8..16), ("size", 16..24), ("checksum", 24..28)]
            [random.below(4) as usize]
            .clone(),
        _ => {
            let entry = 6 + 16 * random.below((part.body.len() as u64 - 6) / 16) as usize;
            [("channel", 0..2), ("time", entry..entry + 8), ("offset", entry + 8..entry + 16)]
                [random.below(3) as usize]
                .clone()
        }
    };
    let what = number(random, part, range);
    Ok(Some((format!("{kind} {field}"), what, records.sealed())))
}

/// A record of the summary changed, left out, or doubled.
fn summarised(random: &mut Random, log: &Log) -> Result<Option<Forgery>, Error> {
    let mut parts = log.packed()?.with_summary();
    let data_end = parts.iter().position(|part| part.opcode == op::DATA_END).unwrap_or(0);
    let kinds: std::collections::BTreeSet<u8> =
        parts[data_end + 1..].iter().map(|part| part.opcode).filter(|opcode| *opcode != op::FOOTER).collect();
    let opcode = kinds.into_iter().nth(random.below(9) as usize).unwrap_or(op::STATISTICS);
    let places: Vec<usize> = (data_end + 1..parts.len()).filter(|at| parts[*at].opcode == opcode).collect();
    if places.is_empty() {
        return Ok(None);
    }
    let place = places[random.below(places.len() as u64) as usize];
    let kind = format!("{} of the summary", file::kind(&parts[place]));
    let (field, what) = match random.below(6) {
        0 => {
            parts.remove(place);
            ("gone".to_owned(), "one record less".to_owned())
        }
        1 => {
            let again = parts[place].clone();
            parts.insert(place, again);
            ("twice".to_owned(), "one record more".to_owned())
        }
        _ => match change(random, &mut parts[place]) {
            Some(changed) => changed,
            None => return Ok(None),
        },
    };
    // The offsets of groups of records must be correct, unless they were changed.
    if opcode != op::SUMMARY_OFFSET {
        crate::forge::correct_offsets(&mut parts);
    }
    Ok(Some((format!("{kind} {field}"), what, seal(parts))))
}

/// Changes one field of a record; returns its name, with the old and the new value. Returns none if the
/// random change would leave the record unchanged.
fn change(random: &mut Random, part: &mut Part) -> Option<(String, String)> {
    let old = part.clone();
    change_field(random, part).filter(|_| *part != old)
}

fn change_field(random: &mut Random, part: &mut Part) -> Option<(String, String)> {
    if let Some(mut map) = part.map() {
        let name = part.name()?.to_owned();
        let (field, what) = match random.below(6) {
            0 => {
                map.insert("zzz".to_owned(), "1".to_owned());
                ("new key".to_owned(), "zzz = 1".to_owned())
            }
            action => {
                let key = map.keys().nth(random.below(map.len() as u64) as usize)?.clone();
                let old = map.get(&key)?.clone();
                let new = if action == 1 { None } else { Some(altered(random, &old)) };
                match &new {
                    Some(new) => map.insert(key.clone(), new.clone()),
                    None => map.remove(&key),
                };
                (key.clone(), format!("{key} from {old:?} to {new:?}"))
            }
        };
        *part = Part::metadata(&name, &map);
        return Some((field, what));
    }
    match part.opcode {
        op::HEADER => {
            let profile = text_at(&part.body, 0)?;
            let library = text_at(&part.body, 4 + profile.len())?;
            let (field, texts) = match random.below(2) {
                0 => ("profile", [altered(random, &profile), library.clone()]),
                _ => ("library", [profile.clone(), altered(random, &library)]),
            };
            part.body.clear();
            texts.iter().for_each(|text| crate::forge::put_text(&mut part.body, text));
            Some((field.to_owned(), format!("{profile:?}, {library:?} to {texts:?}")))
        }
        op::MESSAGE => match random.below(6) {
            0 => Some(("sequence".to_owned(), number(random, part, 2..6))),
            1 => Some(("log time".to_owned(), number(random, part, 6..14))),
            2 => Some(("publish time".to_owned(), number(random, part, 14..22))),
            _ => value(random, part),
        },
        op::ATTACHMENT => attachment(random, part),
        op::SCHEMA => {
            let name = text_at(&part.body, 2)?;
            let encoding_at = 2 + 4 + name.len();
            let encoding = text_at(&part.body, encoding_at)?;
            let data_at = encoding_at + 4 + encoding.len() + 4;
            let (field, at) = match random.below(3) {
                0 => ("name", 6 + random.below(name.len() as u64) as usize),
                1 => ("encoding", encoding_at + 4 + random.below(encoding.len() as u64) as usize),
                _ => ("data", data_at + random.below((part.body.len() - data_at) as u64) as usize),
            };
            Some((field.to_owned(), letter(random, part, at)))
        }
        op::CHANNEL => {
            let topic = text_at(&part.body, 4)?;
            let encoding_at = 8 + topic.len();
            let encoding = text_at(&part.body, encoding_at)?;
            match random.below(4) {
                0 => Some(("topic".to_owned(), letter(random, part, 9 + last_letter(&topic)))),
                1 => {
                    let at = encoding_at + 4 + random.below(encoding.len() as u64) as usize;
                    Some(("encoding".to_owned(), letter(random, part, at)))
                }
                2 => Some(("schema".to_owned(), number(random, part, 2..4))),
                _ => {
                    part.body.truncate(encoding_at + 4 + encoding.len());
                    let mut pairs = Vec::new();
                    ["unit", "furlong"].iter().for_each(|text| crate::forge::put_text(&mut pairs, text));
                    part.body.extend((pairs.len() as u32).to_le_bytes());
                    part.body.extend(pairs);
                    Some(("metadata".to_owned(), "unit = furlong".to_owned()))
                }
            }
        }
        _ if part.body.is_empty() => None,
        // Indexes, statistics and offsets: numbers, all of them meaningful.
        _ => {
            let at = random.below(part.body.len() as u64) as usize;
            Some(("byte".to_owned(), number(random, part, at..at + 1)))
        }
    }
}

/// Where the last letter of a name is, counted from its second.
fn last_letter(topic: &str) -> usize {
    topic.len().saturating_sub(2)
}

fn attachment(random: &mut Random, part: &mut Part) -> Option<(String, String)> {
    let name = part.name()?.to_owned();
    let media_at = 16 + 4 + name.len();
    let media = text_at(&part.body, media_at)?;
    let data_at = media_at + 4 + media.len() + 8;
    let (field, what) = match random.below(6) {
        0 => ("times", number(random, part, 0..8)),
        1 => ("times", number(random, part, 8..16)),
        2 => ("name", letter(random, part, 20 + last_letter(&name))),
        3 if !media.is_empty() => ("media type", letter(random, part, media_at + 4)),
        _ => {
            // Changes a digit to a digit, to keep the type.
            let end = part.body.len() - 4;
            let digits: Vec<usize> = (data_at..end).filter(|at| part.body[*at].is_ascii_digit()).collect();
            let at = *digits.get(random.below(digits.len().max(1) as u64) as usize)?;
            let old = part.body[at];
            part.body[at] = b'0' + (old - b'0' + 1 + random.below(9) as u8) % 10;
            let around =
                String::from_utf8_lossy(&part.body[at.saturating_sub(30).max(data_at)..end.min(at + 10)]);
            let line = part.body[data_at..at].rsplit(|byte| *byte == b'\n').next().unwrap_or_default();
            let field = if line.contains(&b'#') { "comment" } else { "data" };
            (field, format!("a digit, now ...{around}..."))
        }
    };
    let end = part.body.len() - 4;
    let crc = crc32fast::hash(&part.body[..end]);
    part.body[end..].copy_from_slice(&crc.to_le_bytes());
    Some((field.to_owned(), what))
}

/// Changes a value in a message.
fn value(random: &mut Random, part: &mut Part) -> Option<(String, String)> {
    let mut object: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(part.payload()?).ok()?;
    let key = object.keys().nth(random.below(object.len() as u64) as usize)?.clone();
    let old = object.get(&key)?.clone();
    let mut place = object.get_mut(&key)?;
    if let serde_json::Value::Array(values) = place {
        let at = random.below(values.len().max(1) as u64) as usize;
        place = match object.get_mut(&key) {
            Some(serde_json::Value::Array(values)) => values.get_mut(at)?,
            _ => return None,
        };
    }
    *place = match &*place {
        serde_json::Value::Number(number) => match (number.as_u64(), number.as_f64()) {
            (Some(whole), _) => whole.wrapping_add(1 + random.below(3)).into(),
            (None, Some(real)) => {
                let factors = [1.0 + 1e-9, 1.01, -1.0, 1e3];
                (real * random.pick(&factors) + if real == 0.0 { 1e-9 } else { 0.0 }).into()
            }
            _ => return None,
        },
        serde_json::Value::String(text) => altered(random, text).into(),
        serde_json::Value::Bool(value) => (!value).into(),
        serde_json::Value::Null => 1.into(),
        _ => return None,
    };
    let new = object.get(&key)?.clone();
    if new == old {
        return None;
    }
    let what = crate::calls::shortened(&format!("{key} from {old} to {new}"), 300);
    // Keys keep their order only in the text itself.
    let text = String::from_utf8(part.payload()?.to_vec()).ok()?;
    let (before, after) = (format!("\"{key}\":{old}"), format!("\"{key}\":{new}"));
    if !text.contains(&before) {
        return None;
    }
    *part = part.with_payload(text.replacen(&before, &after, 1).as_bytes());
    Some((key, what))
}

/// Changes a number in place.
fn number(random: &mut Random, part: &mut Part, at: std::ops::Range<usize>) -> String {
    let old = part.body[at.clone()].to_vec();
    let by = 1 + random.below(200) as u8;
    // Mostly changes the lowest byte, so the number changes little.
    let byte = if random.below(4) == 0 { random.below(at.len() as u64) as usize } else { 0 };
    part.body[at.start + byte] = part.body[at.start + byte].wrapping_add(by);
    format!("bytes {at:?} of the record from {old:?} to {:?}", &part.body[at.clone()])
}

/// Changes a letter in place, to another valid one.
fn letter(random: &mut Random, part: &mut Part, at: usize) -> String {
    let old = part.body[at];
    let new = if old.is_ascii_alphabetic() { b'a' + (old + random.below(25) as u8) % 26 } else { b'_' };
    part.body[at] = new;
    format!("byte {at} of the record from {:?} to {:?}", char::from(old), char::from(new))
}

/// Another text of the same kind: a number stays one.
fn altered(random: &mut Random, text: &str) -> String {
    if let Ok(number) = text.parse::<u64>() {
        return number.wrapping_add(1 + random.below(3)).to_string();
    }
    if let Ok(number) = text.parse::<f64>() {
        return (number * 1.5 + 1e-3).to_string();
    }
    match text {
        "fast" => "plain".to_owned(),
        "complete" => "load-not-reached".to_owned(),
        "detach" => "attach".to_owned(),
        "attach" => "detach".to_owned(),
        "as-coded" => "as-stated".to_owned(),
        _ => {
            let mut letters: Vec<char> = text.chars().collect();
            let at = random.below(letters.len().max(1) as u64) as usize;
            match letters.get_mut(at) {
                Some('a') => letters[at] = 'b',
                Some(_) => letters[at] = 'a',
                None => letters.push('x'),
            }
            letters.into_iter().collect()
        }
    }
}

/// The text behind the length at a place.
fn text_at(body: &[u8], at: usize) -> Option<String> {
    let length = u32::from_le_bytes(*body.get(at..)?.first_chunk()?) as usize;
    String::from_utf8(body.get(at + 4..at + 4 + length)?.to_vec()).ok()
}

/// A run long enough to be stopped, with few enough steps to end soon even if a forged checkpoint makes it
/// take them all singly.
const MEDIUM: [&str; 2] = ["--set", "time.step_s=1e-7"];

/// Forged checkpoints: an unfinished run refuses to continue from one, ends with the messages of an
/// undisturbed run, or `check --again` detects the difference.
fn checkpoints(ground: &Ground) -> Result<(), Error> {
    let undisturbed = ground.genuine("medium", &MEDIUM)?;
    let mut unfinished = Vec::new();
    for from_bytes in [600_000, 1_500_000, 3_000_000] {
        let stopped = crate::flips::stopped_log(ground, "KILL", from_bytes, &MEDIUM)?;
        let Some(bytes) = stopped else { continue };
        let log = Log::read(&bytes)?;
        let has = log
            .items
            .iter()
            .any(|item| matches!(item, Item::Record { part, .. } if part.name() == Some("checkpoint")));
        if has {
            unfinished.push(log);
        }
    }
    if unfinished.is_empty() {
        let reason = "checkpoints: no run was stopped behind its first one".to_owned();
        ground.tally.lock().expect("no case panics with it").skip("forgeries", reason);
        return Ok(());
    }
    try_all(ground, "forgeries", "checkpoints", ground.size.checkpoints, |case| {
        let log = unfinished[case.number % unfinished.len()].clone();
        checkpoint(case, log, &undisturbed)
    })
}

fn checkpoint(case: &mut Case<'_>, mut log: Log, undisturbed: &Genuine) -> Result<(), Error> {
    // The run continues from the last one.
    let last = log.items.iter_mut().rev().find_map(|item| match item {
        Item::Record { part, .. } if part.name() == Some("checkpoint") => Some(part),
        _ => None,
    });
    let part = last.ok_or("the log has a checkpoint")?;
    let data = part.attached().ok_or("a checkpoint holds something")?.to_vec();
    let Some((key, forged, what)) = tampered(&mut case.random, &data) else { return Ok(()) };
    *part = with_attached(part, &forged).ok_or("a checkpoint has all its fields")?;
    case.write("run.mcap.partial", &log.bytes()?)?;
    let resumed = case.call(&[&RUN[..], &["--resume"], &MEDIUM].concat())?;
    let there = case.path("run.mcap").exists();
    let is_stopped = resumed.code == Some(1) && resumed.said().contains(": stopped: in step ");
    case.hold(
        there == (resumed.code == Some(0) || is_stopped),
        "a resumed run exits with 0 without a log, or the other way",
        || format!("{what}: {}: {}", resumed.ending(), resumed.said()),
    );
    if !there {
        return Ok(());
    }
    let bytes = std::fs::read(case.path("run.mcap"))?;
    let found = file::messages(&bytes)?;
    let found: Vec<_> = found.iter().map(|(_, message)| message).collect();
    let Some(difference) = file::difference(&undisturbed.without(&[]), &found) else { return Ok(()) };
    let again = case.call(&["check", "--again", "run.mcap"])?;
    case.hold(
        again.code == Some(Verdict::Damaged.code()),
        &format!("check --again does not call damaged a run from a forged checkpoint, {key}"),
        || format!("{what}: {difference}: {}", again.said()),
    );
    Ok(())
}

/// The attachment with something else in it, everything else as it was.
fn with_attached(part: &Part, data: &[u8]) -> Option<Part> {
    let before = part.body.len() - 4 - part.attached()?.len() - 8;
    let mut body = part.body[..before].to_vec();
    body.extend((data.len() as u64).to_le_bytes());
    body.extend(data);
    let crc = crc32fast::hash(&body);
    body.extend(crc.to_le_bytes());
    Some(Part::new(part.opcode, body))
}

/// A state with one number changed, behind which key.
fn tampered(random: &mut Random, state: &[u8]) -> Option<(String, Vec<u8>, String)> {
    // Finds numbers between separators. Chooses a key first, so that long lists do not dominate.
    let mut numbers: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    let (mut key, mut quote) = (String::new(), 0);
    for at in 1..state.len() {
        match (state[at - 1], state[at]) {
            (_, b'"') => {
                key = String::from_utf8_lossy(&state[quote + 1..at]).into_owned();
                quote = at;
            }
            (b':' | b',' | b'[', b'0'..=b'9' | b'-') => numbers.entry(key.clone()).or_default().push(at),
            _ => {}
        }
    }
    let (key, starts) = numbers.iter().nth(random.below(numbers.len().max(1) as u64) as usize)?;
    let start = starts[random.below(starts.len() as u64) as usize];
    let end = (start..state.len()).find(|at| matches!(state[*at], b',' | b'}' | b']'))?;
    let old = std::str::from_utf8(&state[start..end]).ok()?;
    let new = match (old.parse::<u64>(), old.parse::<f64>()) {
        (Ok(whole), _) => {
            (if whole > 0 && random.below(2) == 0 { whole - 1 } else { whole.wrapping_add(1) }).to_string()
        }
        (_, Ok(real)) => {
            let factors = [1.0 + 1e-12, 1.0 + 1e-6, 1.1, -1.0];
            format!("{:?}", real * random.pick(&factors) + if real == 0.0 { 1e-12 } else { 0.0 })
        }
        _ => return None,
    };
    let number = starts.iter().position(|at| *at == start)?;
    let what = format!("checkpoint: {key}, its number {number}, from {old} to {new}");
    let forged = [&state[..start], new.as_bytes(), &state[end..]].concat();
    Some((key.clone(), forged, what))
}
