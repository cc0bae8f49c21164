//! Properties for any input: it is read, or refused with an error that names place and problem; nothing
//! panics, and no length is trusted before the data exist.
//!
//! The fuzzers call these functions with inputs that they make up (`targets/`), and `tests/hostile.rs` with
//! the inputs found before, so that fixed bugs do not return, and these functions compile, without a
//! fuzzer.

pub mod edits;
pub mod file;
pub mod frames;
pub mod packing;
pub mod parts;
pub mod thin;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use asperity_model::{Plan, Scenario, ScenarioErrors, ScenarioSource, Texts};
use asperity_record::{Event, EventPayload, Record, SlipEvent};
use asperity_run::Forecast;
use asperity_run::detectors::Settings;
use asperity_runlog::{LogError, LogItem, RunReader, Topics};
use asperity_simulator::SolverKind;

use parts::Part;

/// Where inputs go that must be files: in memory where there is such a place.
fn scratch(name: &str) -> PathBuf {
    let memory = Path::new("/dev/shm");
    let folder = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
    let thread = format!("{:?}", std::thread::current().id());
    let thread: String = thread.chars().filter(char::is_ascii_digit).collect();
    folder.join(format!("asperity-fuzz-{}-{thread}-{name}", std::process::id()))
}

/// A log of any bytes.
pub fn log_bytes(bytes: &[u8]) {
    let path = scratch("log.mcap");
    fs::write(&path, bytes).expect("the scratch folder can be written");
    log_file(&path);
    fs::remove_file(&path).expect("the file was just written");
}

/// A log that is sound except for the changes by the input.
pub fn log_edits(script: &[u8]) {
    log_bytes(&edits::edited(short_log(), script));
}

/// A log whose `run` and `run_end` are given by the input: lines of `key=value`, those of `run_end` with
/// `end.` in front.
pub fn metadata(text: &[u8]) {
    let text = String::from_utf8_lossy(text);
    let mut parts = short_log().to_vec();
    for part in &mut parts {
        let (Some(name), Some(mut map)) = (part.name().map(str::to_owned), part.map()) else { continue };
        for (key, value) in text.split('\n').filter_map(|line| line.split_once('=')) {
            match (name.as_str(), key.strip_prefix("end.")) {
                ("run_end", Some(key)) => map.insert(key.to_owned(), value.to_owned()),
                ("run", None) => map.insert(key.to_owned(), value.to_owned()),
                _ => None,
            };
        }
        *part = Part::metadata(&name, &map);
    }
    log_bytes(&packing::put_together(&parts, packing::Packing::USUAL));
}

/// The beginning of a log of every kind of message.
fn short_log() -> &'static [Part] {
    static LOG: OnceLock<Vec<Part>> = OnceLock::new();
    LOG.get_or_init(|| {
        let log = Path::new(env!("CARGO_MANIFEST_DIR")).join(LOG_FROM_HERE);
        let bytes = fs::read(&log).unwrap_or_else(|error| panic!("{}: {error}", log.display()));
        let sound = parts::beginning(&parts::take_apart(&bytes), 60);
        thin::thinned(&sound.expect("all blocks come to rest in it"))
    })
}

/// The path of a log from the folder of either crate that this is compiled in.
const LOG_FROM_HERE: &str = "../../fixtures/logs/complete.mcap";

fn log_file(path: &Path) {
    let all = read_log(path, Topics::ALL);
    for topics in [Topics::STEPS, Topics::EVENTS, Topics::RECORDS, Topics::NONE] {
        let some = read_log(path, topics);
        if all.is_err() {
            // One more is enough, that of `replay`.
            break;
        }
        // A table that is sound as a whole is sound in parts, with equal rows.
        if let Ok(all) = &all {
            let some = some.unwrap_or_else(|error| panic!("whole, but not with {topics:?}: {error}"));
            let has_input = topics.steps && topics.fields;
            assert!(!has_input || some.found == all.found, "other events with {topics:?}");
            assert!(!topics.events || some.logged == all.logged, "other logged events with {topics:?}");
        }
    }
    if let Err(error) = &all {
        let said = error.to_string();
        let place = path.display().to_string();
        let what = said.strip_prefix(&place).and_then(|rest| rest.strip_prefix(": "));
        assert!(what.is_some_and(|what| !what.is_empty()), "says not where and what: {said}");
    }
}

/// The contents of a log.
struct Seen {
    logged: Vec<Event>,
    found: Vec<Event>,
}

/// Reads a log as `check` and `replay` do.
fn read_log(path: &Path, topics: Topics) -> Result<Seen, LogError> {
    let mut seen = Seen { logged: Vec::new(), found: Vec::new() };
    let mut reader = RunReader::open(path, topics)?;
    let header = reader.header().clone();
    let grid = header.time_grid();
    let blocks = header.blocks;
    let mut detectors = Settings::default().start(&header, None);
    let mut last_step = 0;
    while let Some(item) = reader.next_item()? {
        if reader.has_gap() {
            // The gap may contain the beginning of an event, so no detector continues.
            continue;
        }
        match item {
            LogItem::Event(event) => {
                // Its contents concern its detector, but it must be readable or refused.
                assert_eq!(event.topic() == SlipEvent::TOPIC, event.get::<SlipEvent>().is_some());
                seen.logged.push(event);
            }
            LogItem::Record(record) => {
                assert!(grid.time_s(record.step()).is_finite());
                // The check refuses steps out of order before a detector sees them.
                if !matches!(record, Record::Step(_) | Record::Fields(_)) || record.step() >= last_step {
                    detectors.observe(&record, &mut |event| seen.found.push(event));
                    last_step = last_step.max(record.step());
                }
                match record {
                    Record::Step(_) | Record::Row(_) | Record::Signal(_) | Record::Traces(_) => {}
                    Record::Fields(fields) => assert_eq!(fields.displacement_m.len(), blocks as usize),
                    Record::Window(window) => {
                        let last = window.first_block as usize + window.displacement_m.len();
                        assert!(window.first_block > 0 && last <= blocks as usize + 1);
                    }
                }
            }
        }
    }
    detectors.finish(&mut |event| seen.found.push(event));
    Ok(seen)
}

/// A scenario's text, and overrides behind it, each after a zero byte.
pub fn scenario(input: &[u8]) {
    let input = String::from_utf8_lossy(input);
    let mut pieces = input.split('\0');
    let text = pieces.next().unwrap_or_default();
    let source = ScenarioSource::new("fuzz.toml", text);
    let source = pieces.fold(source, |source, assignment| source.with_override(assignment));
    // No file is opened; `profile` checks their contents.
    resolved(Scenario::resolve(&source));
}

/// A shear profile.
pub fn profile(text: &[u8]) {
    let path = scratch("profile.csv");
    fs::write(&path, text).expect("the scratch folder can be written");
    let set = format!("initial_shear.profile_csv={}", path.display());
    for blocks in [2, 100] {
        let source = ScenarioSource::new("fuzz.toml", format!("slider.blocks = {blocks}"));
        if let Some(scenario) = resolved(Scenario::resolve_with(&source.with_override(&set), &Texts)) {
            assert_eq!(scenario.initial_shear.profile.len(), blocks);
            assert!(scenario.initial_shear.profile.iter().all(|ratio| ratio.is_finite()));
        }
    }
    fs::remove_file(&path).expect("the file was just written");
}

/// Follows a scenario as far as the first step of its run.
fn resolved(scenario: Result<Scenario, ScenarioErrors>) -> Option<Scenario> {
    let scenario = match scenario {
        Ok(scenario) => scenario,
        Err(errors) => {
            assert!(!errors.0.is_empty());
            for error in &errors.0 {
                assert!(error.key.is_some() || error.place.is_some(), "says not where: {error}");
                assert!(!error.problem.is_empty());
            }
            return None;
        }
    };
    for (source, written) in [
        (ScenarioSource::logged as fn(_, _) -> _, scenario.to_commented_toml()),
        (ScenarioSource::new, scenario.to_editable_toml()),
    ] {
        let again = Scenario::resolve(&source("again.toml", written.clone()))
            .unwrap_or_else(|errors| panic!("refuses what it wrote itself: {errors}\n{written}"));
        assert_eq!(again.hash(), scenario.hash(), "reads other than it wrote:\n{written}");
    }
    let plan = Plan::new(&scenario);
    assert!(plan.steps > 0 && plan.blocks >= 2);
    let forecast = Forecast::of(&scenario);
    assert!(forecast.log.scheduled_bytes > 0 && forecast.warnings.iter().all(|warning| !warning.is_empty()));
    for solver in [SolverKind::Plain, SolverKind::Fast] {
        solver.start(plan.clone());
    }
    Some(scenario)
}

/// A plan of a study: its lines without the last one, which is recomputed. A plan that is read is written
/// back unchanged.
pub fn plan(lines: &[u8]) {
    let lines = String::from_utf8_lossy(lines);
    let text = frames::sealed(lines.trim_end_matches('\n'));
    match asperity_study::Plan::parse(text.as_bytes()) {
        Ok(plan) => {
            assert!(plan.rows.iter().map(|row| row.run).eq(1..=plan.rows.len() as u64));
            let has_all = |row: &asperity_study::plan::Row| match plan.named(row.run) {
                Some(_) => row.values.is_empty(),
                None => row.values.len() == plan.common.keys.len(),
            };
            assert!(plan.rows.iter().all(has_all));
        }
        Err(problem) => assert!(problem.contains("(accepted: "), "{problem}"),
    }
}

/// The result of the first run of a study, from the input, packed with the correct checksum.
pub fn results(text: &[u8]) {
    let folder = scratch("study");
    fs::create_dir_all(folder.join("segments")).expect("the scratch folder can be written");
    let plan = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(PLAN_FROM_HERE));
    let plan = frames::sealed(plan.expect("the fixture is there").trim_end());
    let segment = frames::Segment { first_line: Vec::new(), frames: vec![frames::Frame::done(1, text)] };
    fs::write(folder.join("segments/a.seg"), segment.of_plan(&plan).bytes())
        .expect("the scratch folder can be written");
    let plan = asperity_study::Plan::parse(plan.as_bytes()).expect("the fixture is sound");
    let found = asperity_study::Results::read(&folder, &plan).expect("the segment can be read");
    let mut rows = 0;
    match asperity_study::collect(&plan, &found, &mut Counted(&mut rows)) {
        Ok(()) => assert_eq!(rows, plan.numbered()),
        Err(error) => assert!(error.to_string().contains("a.seg: byte "), "{error}"),
    }
    fs::remove_dir_all(&folder).expect("it was just written");
}

/// Counts the rows of the table of runs.
struct Counted<'a>(&'a mut u64);

impl asperity_study::RowSink for Counted<'_> {
    fn begin(
        &mut self,
        _: &'static str,
        _: &[asperity_record::Column],
    ) -> Result<(), asperity_study::StudyError> {
        Ok(())
    }

    fn row(
        &mut self,
        table: &'static str,
        _: &[asperity_record::Cell],
    ) -> Result<(), asperity_study::StudyError> {
        *self.0 += u64::from(table == asperity_study::RUNS);
        Ok(())
    }
}

/// The path of the lines of a plan without the last one from the folder of either crate that this is compiled in.
const PLAN_FROM_HERE: &str = "../../fixtures/hostile/corpus/plan/sound";

/// A pipeline.
pub fn pipeline(text: &[u8]) {
    let text = String::from_utf8_lossy(text);
    if let Err(problem) = asperity_study::pipeline::Pipeline::parse(&text) {
        assert!(!problem.is_empty());
    }
}

/// A file of a recording: the first byte chooses its format, the rest are its bytes.
pub fn recording(input: &[u8]) {
    use asperity_recording::{Description, Recording};

    let Some((format, bytes)) = input.split_first() else { return };
    let formats = [
        ("lab.csv", ""),
        ("lab.csv", "missing = 'gap'"),
        ("lab.npy", ""),
        ("lab.npz", "dataset = 'slip'"),
        ("lab.h5", "dataset = 'slip'"),
        ("lab.mat", "dataset = 'slip'"),
        ("lab.tdms", "dataset = 'slip'"),
        ("lab.raw", "numbers = '>f4'\nchannels_in_file = 3"),
    ];
    let (name, keys) = formats[usize::from(*format) % formats.len()];
    let folder = scratch("recording");
    fs::create_dir_all(&folder).expect("the scratch folder can be written");
    fs::write(folder.join(name), bytes).expect("the scratch folder can be written");
    let text = format!(
        "format = 1\nname = 'any'\n[slider]\nlength_m = 1\nwidth_m = 1\nheight_m = 1\nyoungs_modulus_pa = 1e9\n\
         wave_speed_m_per_s = 1e3\n[[stream]]\nfile = '{name}'\n{keys}\nrate_hz = 1e6\n[[stream.array]]\n\
         role = 'slip'\nunit = 'm'\nchannels = '1..2'\nx_m = [0.2, 0.4]\n"
    );
    let description = Description::parse(&folder.join("recording.toml"), &text);
    if let Err(error) =
        description.and_then(Recording::open).and_then(|recording| recording.detect(&|_, _| false))
    {
        let said = error.to_string();
        assert!(said.contains(name), "says not where and what: {said}");
    }
    fs::remove_dir_all(&folder).expect("the folder was just written");
}

/// The tables of a log that is sound except for the changes by the input.
pub fn tables(script: &[u8]) {
    use asperity_model::theory::analytic::LengthLaw;
    use asperity_numbers::precursors::PrecursorRules;
    use asperity_numbers::required_data::RequiredData;
    use asperity_numbers::run_data::Collector;
    use asperity_run::{CheckProblem, Checked, OpenLog, read_once};

    let path = scratch("tables.mcap");
    fs::write(&path, edits::edited(short_log(), script)).expect("the scratch folder can be written");
    let begin =
        |log: &OpenLog| Collector::of_log("fuzz", log.header(), log.needed_scenario()?, RequiredData::all());
    let accept = |checked: &Checked| match checked.problem {
        Some(CheckProblem::Log(_)) => Err(()),
        _ => Ok(()),
    };
    if let Ok(read) = read_once(&path, &[], begin, accept) {
        let run = read.observer.finish(read.has_ruptures, read.checked.seen.end.as_ref());
        let rules = PrecursorRules { min_blocks: 2, merge_gap_s: 1e-3 };
        drop(asperity_tables::tables::precursor_ruptures(&run, &[(LengthLaw::Linear, rules)]));
        drop(asperity_tables::tables::residuals(&run, LengthLaw::Linear, &rules).expect("all is kept"));
        drop(asperity_tables::tables::precursors(&run, LengthLaw::Tilted, &rules).expect("all is kept"));
    }
    fs::remove_file(&path).expect("the file was just written");
}
