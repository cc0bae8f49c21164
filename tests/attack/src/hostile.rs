//! Inputs of at most ten million bytes that are made to use up memory and time, to forge messages, or to
//! crash something. Every command that reads such files ends by itself, with a message, and within
//! documented bounds.

use std::fs;
use std::io::Write;

use mcap::records::op;

use crate::calls::{Call, Outcome};
use crate::case::{Case, try_all};
use crate::commands::{ON_LOGS, arguments, words};
use crate::forge::{Item, Log};
use crate::frames::{Frame, body, sealed};
use crate::ground::{Error, Ground, SMALL};
use crate::parts::Part;
use crate::studies::{self, Study};

/// Limit on the memory of a command, MB, whatever it reads.
const MEMORY_MB: f64 = 300.0;

/// Limit on its processor time, s, of the slowest machine so far; others take half.
const TIME_S: f64 = 8.0;

/// Where a call is stopped that keeps to neither.
const STOP: &str = "ulimit -v 1500000; ulimit -t 12";

/// No input is longer.
const LONGEST: usize = 10_000_000;

/// The commands that read a kind of file, with FILE in place of its name.
fn on_logs() -> Vec<&'static str> {
    let of_records = ON_LOGS.iter().filter(|command| !command.scenario_alone).map(|command| command.words);
    of_records.chain(["scenario show FILE", "scenario validate ten-blocks --set initial.from=FILE"]).collect()
}
const ON_UNFINISHED: [&str; 2] =
    ["check FILE", "run default --set parameter_set=as-coded --quiet --resume --out run.mcap"];
const ON_CSV: [&str; 2] = ["diff FILE FILE", "scenario validate ten-blocks --set initial.state_csv=FILE"];
const ON_SCENARIOS: [&str; 3] = ["scenario show FILE", "scenario validate FILE", "run FILE --out run.mcap"];
const ON_PIPELINES: [&str; 1] = ["reproduce FILE --out reproduced"];
const ON_POLICIES: [&str; 1] = ["diff sound.mcap sound.mcap --policy FILE"];
/// Of a study that is sound except for this file.
const ON_STUDIES: [&str; 5] = [
    "sweep status study",
    "sweep collect study --to csv",
    "sweep run study",
    "sweep log study 1 --quiet --out one.mcap",
    "sweep emit list study",
];
/// Of a description, and of the one file of a recording.
const ON_RECORDINGS: [&str; 1] = ["recording validate FILE"];
const OF_RECORDINGS: [&str; 2] = ["recording validate FILE.toml", "recording read FILE.toml -o lab.mcap"];
const ON_SETTINGS: [&str; 1] = ["replay sound.mcap --detectors FILE"];

/// The places of files in studies.
const STUDY: &str = "study";

/// One input.
struct Input {
    name: String,
    bytes: Vec<u8>,
    commands: Vec<&'static str>,
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let sound = ground.genuine("small", &SMALL)?.bytes;
    let mut inputs = inputs(&sound)?;
    let study = Study::made(ground, "bounded-study", studies::SWEEP)?;
    inputs.extend(of_studies(&study)?);
    if let Some(long) = inputs.iter().find(|input| input.bytes.len() > LONGEST) {
        return Err(format!("{} has {} bytes", long.name, long.bytes.len()).into());
    }
    let calls: Vec<(&Input, &str)> =
        inputs.iter().flat_map(|input| input.commands.iter().map(move |command| (input, *command))).collect();
    // One call of every input before a second of any; those with numbers count as one.
    let kinds: Vec<_> = calls.iter().map(|(input, _)| input.name.split(char::is_numeric).next()).collect();
    let chosen = ground.some_of_each(&kinds, 90);
    try_all(ground, "limits", "hostile inputs", chosen.len(), |case| {
        let (input, command) = calls[chosen[case.number]];
        for (name, bytes) in study.files().iter().filter(|_| input.name.starts_with(STUDY)) {
            fs::create_dir_all(case.path(STUDY).join("segments"))?;
            case.write(&format!("{STUDY}/{name}"), bytes)?;
        }
        bounded(case, input, command, &sound)
    })
}

fn bounded(case: &mut Case<'_>, input: &Input, command: &str, sound: &[u8]) -> Result<(), Error> {
    case.write(&input.name, &input.bytes)?;
    case.write("sound.mcap", sound)?;
    if command.starts_with("recording") && command.contains("FILE.toml") {
        case.write(&format!("{}.toml", input.name), description(&input.name).as_bytes())?;
    }
    let words = words(command, &[&input.name], "new");
    let arguments = arguments(&words);
    let program = &case.ground.program;
    let outcome = Call::by_shell(program, &case.folder, STOP, &arguments, "")?.run()?;
    let Outcome { cpu_s, peak_mb, .. } = outcome;
    // A command that was stopped here has failed by its time.
    if outcome.signal.is_some() && cpu_s > TIME_S {
        case.note(&outcome);
    } else {
        case.must_end_well(&outcome);
    }
    let told = || {
        format!("{}: {}, {cpu_s:.1} s, {peak_mb:.0} MB: {}", outcome.call, outcome.ending(), outcome.said())
    };
    let word = arguments[0];
    case.hold(
        peak_mb < MEMORY_MB,
        &format!("{word} takes more than {MEMORY_MB} MB for {}", input.name),
        told,
    );
    case.hold(cpu_s < TIME_S, &format!("{word} takes more than {TIME_S} s for {}", input.name), told);
    let said = format!("{}{}", outcome.out, outcome.err);
    if outcome.code.is_some_and(|code| code != 0) && !outcome.panicked() {
        case.hold(
            said.contains(&input.name) || said.contains("run.mcap"),
            &format!("{word} fails and does not name the file"),
            told,
        );
    }
    // Control characters would let a file write lines of its own on a terminal.
    let raw = |c: char| {
        (c.is_control() && !"\n\t\r".contains(c))
            || ('\u{202a}'..='\u{202e}').contains(&c)
            || ('\u{2066}'..='\u{2069}').contains(&c)
            || "\u{2028}\u{2029}".contains(c)
    };
    // Data on standard output are data.
    let words = if word == "check" || word == "salvage" { &said } else { &outcome.err };
    case.hold(!words.contains(raw), &format!("{word} prints control characters of its input"), told);
    let forged = words.lines().any(|line| line.starts_with("forged: whole"));
    case.hold(!forged, &format!("{word} prints a line that its input made up"), told);
    Ok(())
}

/// The description of a recording of one file.
fn description(name: &str) -> String {
    let keys = match name.rsplit_once('.') {
        Some((_, "h5" | "mat" | "tdms")) => "dataset = 'slip'",
        Some((_, "raw")) => "numbers = '<i2'\nchannels_in_file = 2",
        Some((_, "csv")) => "missing = 'gap'",
        _ => "",
    };
    format!(
        "format = 1\nname = 'any'\n[slider]\nlength_m = 1\nwidth_m = 1\nheight_m = 1\nyoungs_modulus_pa = 1e9\n\
         wave_speed_m_per_s = 1e3\n[[stream]]\nfile = '{name}'\n{keys}\nrate_hz = 1e6\n[[stream.array]]\n\
         role = 'slip'\nunit = 'm'\nchannels = '1..2'\nx_m = [0.2, 0.4]\n"
    )
}

/// Files of a study: segments of results that unpack to more than there is memory for, and plans that no
/// sweep makes.
fn of_studies(study: &Study) -> Result<Vec<Input>, Error> {
    let of_name = |name: &str, bytes: Vec<u8>| Input {
        name: format!("{STUDY}/{name}"),
        bytes,
        commands: ON_STUDIES.to_vec(),
    };
    let mut inputs = Vec::new();
    let first = &study.segments[0].1;
    for (name, filling) in [("zeros", "\0"), ("lines", "\n"), ("texts", "{\"run\":")] {
        let piece = filling.repeat((1 << 22) / filling.len());
        let mut encoder = zstd::stream::write::Encoder::new(Vec::new(), 3)?;
        for _ in 0..1024 {
            encoder.write_all(piece.as_bytes())?;
        }
        let mut segment = first.clone();
        segment.frames[0].content = encoder.finish()?;
        inputs.push(of_name(&format!("segments/{name}.seg"), segment.bytes()));
    }
    let mut twice = first.clone();
    twice.frames = vec![Frame { content: b"x".to_vec(), ..first.frames[0].clone() }; 80_000];
    inputs.push(of_name("segments/twice.seg", twice.bytes()));
    let mut nobody = first.clone();
    nobody.frames = (0..80_000).map(|n| Frame { run: 1000 + n, ..twice.frames[0].clone() }).collect();
    inputs.push(of_name("segments/nobody.seg", nobody.bytes()));
    let lines: Vec<&str> = body(&study.plan).lines().collect();
    let [common, row] = [0, 1].map(|line| lines.get(line).copied().unwrap_or_default());
    let with = |row: &str| sealed(&format!("{common}\n{row}")).into_bytes();
    inputs.push(of_name("plan.ndjson", with(&row.repeat(40_000))));
    inputs.push(of_name("plan.ndjson", with(&format!("{row}\n").repeat(40_000))));
    inputs.push(of_name("plan.ndjson", with(&"[".repeat(9_000_000))));
    inputs
        .push(of_name("plan.ndjson", with(&format!("{{\"run\":1,\"values\":[{}0]}}", "0,".repeat(500_000)))));
    inputs.push(of_name("plan.ndjson", with(&"{}\n".repeat(3_000_000))));
    inputs.push(of_name("plan.ndjson", sealed(&"{\"a\":".repeat(1_500_000)).into_bytes()));
    inputs.push(of_name("plan.ndjson", vec![b'\n'; 9_000_000]));
    inputs.push(of_name("plan.ndjson", vec![b' '; 9_000_000]));
    Ok(inputs)
}

fn inputs(sound: &[u8]) -> Result<Vec<Input>, Error> {
    let log = Log::read(sound)?;
    let mut inputs = Vec::new();
    let mut add = |name: &str, commands: &[&'static str], bytes: Vec<u8>| {
        inputs.push(Input { name: name.to_owned(), bytes, commands: commands.to_vec() });
    };
    let on_logs = on_logs();
    add("packed.mcap", &on_logs, packed(&log)?);
    add("zeros.mcap", &on_logs, with_chunks(&log, &vec![0; 54_000_000], 8)?);
    add("chunk-heads.mcap", &on_logs, chunk_heads(sound));
    // The log is longer where it took longer, by checkpoints.
    let lines = LONGEST.saturating_sub(sound.len() + 100_000) / 10;
    add("scenario.mcap", &on_logs, with_scenario(&log, &"# nothing\n".repeat(lines))?);
    add("nested-scenario.mcap", &on_logs, with_scenario(&log, &format!("a = {}", "[".repeat(2_000_000)))?);
    let channel = |number: usize| Part::channel(500 + number as u16, 1, &format!("/events/x{number}"));
    add("channels.mcap", &on_logs, many(&log, 50_000, &channel)?);
    add("schemas.mcap", &on_logs, many(&log, 60_000, &schema)?);
    let note = |number: usize| Part::attachment(&format!("note {number}"), b"nothing");
    add("attachments.mcap", &on_logs, many(&log, 40_000, &note)?);
    add("checkpoints.mcap", &on_logs, many(&log, 40_000, &|_| Part::attachment("checkpoint", b"{}"))?);
    let note = |number: usize| Part::metadata("note", &[(number.to_string(), String::new())].into());
    add("metadata.mcap", &on_logs, many(&log, 40_000, &note)?);
    let keys = (0..300_000).map(|number| (format!("k{number}"), "v".to_owned())).collect();
    add("keys.mcap", &on_logs, many(&log, 1, &|_| Part::metadata("note", &keys))?);
    add("nested-message.mcap", &on_logs, with_message(&log, &"[".repeat(60_000_000))?);
    let numbers = format!("{{\"step\":1,\"time_s\":1e-7,\"displacement_m\":[{}0]}}", "0,".repeat(25_000_000));
    add("long-message.mcap", &on_logs, with_message(&log, &numbers)?);
    for (name, text) in [
        ("line.mcap", "x\nforged: whole: 1 record"),
        ("escape.mcap", "\u{1b}[2J\u{1b}[31mx\u{9b}5m"),
        ("turned.mcap", "\u{202e}elohw\u{2066}\u{2028}forged: whole"),
    ] {
        for key in ["parameter_set", "scenario", "code_version"] {
            let name = format!("{key}-{name}");
            add(&name, &on_logs, with_key(&log, key, text)?);
        }
    }
    let mut unfinished = sound[..sound.len() / 2].to_vec();
    let huge = Part::attachment("checkpoint", format!("{{\"chain\":{}", "[".repeat(5_000_000)).as_bytes());
    let end = crate::file::records(&unfinished).last().map_or(0, |record| record.at.end);
    unfinished.truncate(end);
    huge.put(&mut unfinished);
    add("run.mcap.partial", &ON_UNFINISHED, unfinished);

    let head = "displacement_m,velocity_m_per_s,stick_position_m,slides\n";
    add("states.csv", &ON_CSV, format!("{head}{}", "0,0,0,0\n".repeat(900_000)).into_bytes());
    add("state.csv", &ON_CSV, format!("{head}{}", "1".repeat(9_000_000)).into_bytes());
    let head = "onset_s,end_s,first_block,last_block\n";
    add("block.csv", &ON_CSV, format!("{head}0.1,0.2,4294967295,4294967295\n").into_bytes());
    add("blocks.csv", &ON_CSV, format!("{head}0.1,0.2,0,18446744073709551615\n").into_bytes());
    add("line.csv", &ON_CSV, format!("{head}{}", "1".repeat(9_000_000)).into_bytes());
    add("field.csv", &ON_CSV, format!("{head}\"{}", "1,".repeat(4_000_000)).into_bytes());
    add("columns.csv", &ON_CSV, format!("{}{head}", "c,".repeat(4_000_000)).into_bytes());
    add("rows.csv", &ON_CSV, format!("{head}{}", "0.1,0.2,1,2\n".repeat(700_000)).into_bytes());
    for (folder, commands) in [
        ("scenario", &ON_SCENARIOS[..]),
        ("pipeline", &ON_PIPELINES),
        ("policy", &ON_POLICIES),
        ("settings", &ON_SETTINGS),
        ("recording", &ON_RECORDINGS),
    ] {
        add(&format!("{folder}-comments.toml"), commands, "# nothing\n".repeat(900_000).into_bytes());
        add(
            &format!("{folder}-nested.toml"),
            commands,
            format!("name = {}", "[".repeat(3_000_000)).into_bytes(),
        );
        add(
            &format!("{folder}-keys.toml"),
            commands,
            (0..700_000).map(|n| format!("k{n} = 1\n")).collect::<String>().into_bytes(),
        );
        add(
            &format!("{folder}-dotted.toml"),
            commands,
            format!("{}a = 1", "a.".repeat(3_000_000)).into_bytes(),
        );
        add(
            &format!("{folder}-escape.toml"),
            commands,
            b"\"\\u001b[2J\\nforged: whole\" = \"\\u001b[31m\\nforged: whole\"\n".to_vec(),
        );
    }
    let npy = |shape: &str| {
        let header = format!("{{'descr': '<i2', 'fortran_order': False, 'shape': ({shape}), }}\n");
        let head =
            [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes()].concat();
        [head, vec![7; 4_000_000]].concat()
    };
    add("claim.npy", &OF_RECORDINGS, npy("1152921504606846976, 2"));
    add("wide.npy", &OF_RECORDINGS, npy("2, 1000000"));
    add("claim.h5", &OF_RECORDINGS, include_bytes!("../../../fixtures/recordings/arrays/claims.h5").to_vec());
    add("ends.h5", &OF_RECORDINGS, b"\x89HDF\r\n\x1a\n\x00".to_vec());
    add("claim.tdms", &OF_RECORDINGS, [&b"TDSm\x0e\x00\x00\x00"[..], &[0xff; 64]].concat());
    add("lists.tdms", &OF_RECORDINGS, [&b"TDSm\x02"[..], &[0; 27]].concat().repeat(LONGEST / 33));
    let head = [&[b' '; 124][..], b"\x00\x01IM"].concat();
    add("claim.mat", &OF_RECORDINGS, [&head[..], &14_u32.to_le_bytes(), &[0xff; 60]].concat());
    add(
        "names.mat",
        &OF_RECORDINGS,
        [head, [14_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat().repeat(1_000_000)].concat(),
    );
    add("one-value.raw", &OF_RECORDINGS, vec![1; 4_000_000]);
    add("gaps.csv", &OF_RECORDINGS, format!("a,b\n{}", "1,2\n,\n".repeat(1_200_000)).into_bytes());
    add("line-of-samples.csv", &OF_RECORDINGS, format!("a,b\n{}", "1,".repeat(4_000_000)).into_bytes());
    add("escape.csv", &OF_RECORDINGS, b"a,b\n1,\x1b[2J\x1b[31m\rforged: whole\n".to_vec());
    let profile =
        |course: &str| format!("slider.blocks = 3\ntime.duration_s = 1e-4\n{course}\n").into_bytes();
    add("huge-number.toml", &ON_SCENARIOS, profile("normal_load.total_n = 1e308"));
    add("huge-state.toml", &ON_SCENARIOS, profile("initial.displacement_m = [1e30, -1e30, 1e30]"));
    add("long-state.toml", &ON_SCENARIOS, profile(&format!("initial.state = '{}'", "A".repeat(8_000_000))));
    Ok(inputs)
}

fn schema(number: usize) -> Part {
    let mut body = (1000 + number as u16).to_le_bytes().to_vec();
    for text in ["name", "jsonschema", "{}"] {
        crate::forge::put_text(&mut body, text);
    }
    Part::new(op::SCHEMA, body)
}

/// The log with that many more records before its messages.
fn many(log: &Log, count: usize, each: &dyn Fn(usize) -> Part) -> Result<Vec<u8>, Error> {
    let mut log = log.clone();
    let first = log.items.iter().position(|item| matches!(item, Item::Chunk { .. }));
    let first = first.ok_or("the log has a chunk")?;
    let in_chunks = matches!(each(0).opcode, op::SCHEMA | op::CHANNEL);
    match &mut log.items[first] {
        Item::Chunk { records, .. } if in_chunks => {
            records.splice(0..0, (0..count).map(each));
        }
        _ => {
            let more = (0..count).map(|number| Item::Record(each(number)));
            log.items.splice(first..first, more);
        }
    }
    log.correct_end();
    Ok(log.bytes()?)
}

/// Chunks that unpack to fifty million bytes of events each.
fn packed(log: &Log) -> Result<Vec<u8>, Error> {
    let mut log = log.clone();
    let event = log
        .in_chunks()
        .find(|part| part.payload().is_some_and(|text| text.starts_with(b"{\"onset_s\"")))
        .cloned()
        .ok_or("the log has a slip event")?;
    let mut records = Vec::new();
    while records.len() < 50_000_000 {
        event.put(&mut records);
    }
    with_chunks(&log, &records, 8)
}

/// The log with `times` chunks of these records after its last one.
fn with_chunks(log: &Log, records: &[u8], times: usize) -> Result<Vec<u8>, Error> {
    let packed = zstd::bulk::compress(records, 1)?;
    let crc = crc32fast::hash(records);
    let chunk = Part::chunk_of(records.len() as u64, crc, "zstd", packed.len() as u64, &packed);
    let mut log = log.clone();
    let last = log.items.iter().rposition(|item| matches!(item, Item::Chunk { .. }));
    let at = last.ok_or("the log has a chunk")? + 1;
    log.items.splice(at..at, std::iter::repeat_n(Item::Record(chunk), times));
    Ok(log.unfinished_bytes()?)
}

/// Eight million bytes with an apparent beginning of a chunk at every thirtieth.
fn chunk_heads(sound: &[u8]) -> Vec<u8> {
    let mut bytes = sound[..sound.len() / 4].to_vec();
    let mut head = vec![op::CHUNK];
    head.extend(4_000_000u64.to_le_bytes());
    head.extend([0; 16]);
    head.extend(1_000_000u64.to_le_bytes());
    while bytes.len() < 8_000_000 {
        bytes.extend(&head);
    }
    bytes
}

fn with_scenario(log: &Log, text: &str) -> Result<Vec<u8>, Error> {
    let mut log = log.clone();
    if let Some(part) = log.named("scenario.toml") {
        *part = Part::attachment("scenario.toml", text.as_bytes());
    }
    Ok(log.bytes()?)
}

fn with_key(log: &Log, key: &str, value: &str) -> Result<Vec<u8>, Error> {
    let mut log = log.clone();
    if let Some(part) = log.named("run")
        && let Some(mut map) = part.map()
    {
        map.insert(key.to_owned(), value.to_owned());
        *part = Part::metadata("run", &map);
    }
    Ok(log.bytes()?)
}

/// The log with its first message saying something else.
fn with_message(log: &Log, payload: &str) -> Result<Vec<u8>, Error> {
    let mut log = log.clone();
    if let Some(part) = log.in_chunks().find(|part| part.opcode == op::MESSAGE) {
        *part = part.with_payload(payload.as_bytes());
    }
    log.correct_end();
    Ok(log.bytes()?)
}
