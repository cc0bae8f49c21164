//! Plans and segments of studies: bits and bytes changed, files cut, results changed with correct checksums,
//! results of two studies mixed. Tables of a study are those of its runs or are not made: if
//! `sweep collect` exits with 0, they are equal to the byte. It names what it refuses, and if it reports a
//! run as missing, `sweep run` restores the tables.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::case::{Case, try_all};
use crate::frames::{Frame, Segment};
use crate::ground::{Error, Ground, emptied};
use crate::random::Random;

/// The files of a study by their paths in its folder.
pub(crate) type Files = BTreeMap<String, Vec<u8>>;

/// Runs of a hundredth of a second each, with slip events and ruptures.
pub(crate) const SWEEP: &str = "title = 'Short runs'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=0.5']
[[axis]]
key = 'normal_load.tilt'
values = [-0.5, 0, 0.5]
[[axis]]
keys = ['friction.static_coefficient', 'friction.dynamic_coefficient']
rows = [[0.5, 0.3], [0.7, 0.45]]
";

/// Another study that looks the same from outside.
const OTHER: (&str, &str) = ("slider.blocks=20", "slider.blocks=21");

const PLAN: &str = "plan.ndjson";

/// A study whose runs are made.
pub(crate) struct Study {
    pub(crate) plan: String,
    pub(crate) segments: Vec<(String, Segment)>,
    tables: Files,
}

impl Study {
    pub(crate) fn made(ground: &Ground, name: &str, sweep: &str) -> Result<Study, Error> {
        let folder = ground.logs.join(name);
        emptied(&folder)?;
        fs::write(folder.join("sweep.toml"), sweep)?;
        ground.succeed(&folder, &["sweep", "plan", "sweep.toml", "--quiet", "--out", "study"])?;
        // Two segments at least, whatever the machine.
        for part in ["1/2", "2/2"] {
            ground.succeed(&folder, &["sweep", "run", "study", "--quiet", "--jobs", "1", "--chunk", part])?;
        }
        ground.succeed(&folder, &["sweep", "collect", "study", "--quiet", "--to", "csv"])?;
        let study = folder.join("study");
        let segments = files_in(&study.join("segments"))?;
        Ok(Study {
            plan: fs::read_to_string(study.join(PLAN))?,
            segments: segments.into_iter().map(|(name, bytes)| (name, Segment::read(&bytes))).collect(),
            tables: files_in(&study.join("tables"))?,
        })
    }

    pub(crate) fn files(&self) -> Files {
        let segments =
            self.segments.iter().map(|(name, segment)| (format!("segments/{name}"), segment.bytes()));
        [(PLAN.to_owned(), self.plan.clone().into_bytes())].into_iter().chain(segments).collect()
    }

    /// The file with the result of a run, by their numbers.
    fn chosen(&self, random: &mut Random) -> (usize, usize) {
        let segment = random.below(self.segments.len() as u64) as usize;
        (segment, random.below(self.segments[segment].1.frames.len() as u64) as usize)
    }
}

fn files_in(folder: &Path) -> Result<Files, Error> {
    let mut files = Files::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        files.insert(entry.file_name().to_string_lossy().into_owned(), fs::read(entry.path())?);
    }
    Ok(files)
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let ours = Study::made(ground, "study", SWEEP)?;
    let other = Study::made(ground, "other-study", &SWEEP.replace(OTHER.0, OTHER.1))?;
    let cases = ground.size.studies;
    try_all(ground, "studies", "flips", cases, |case| {
        let mut files = ours.files();
        let (name, bytes) = any(&mut case.random, &mut files);
        let at = case.random.below(bytes.len() as u64) as usize;
        let old = bytes[at];
        bytes[at] = match case.random.below(3) {
            0 => old.wrapping_add(1 + case.random.below(255) as u8),
            _ => old ^ 1 << case.random.below(8),
        };
        let what = format!("byte {at} of {name} from {old:#04x} to {:#04x}", bytes[at]);
        judged(case, "a flip", &what, &files, &ours)
    })?;
    try_all(ground, "studies", "cuts", cases, |case| {
        let mut files = ours.files();
        let (name, bytes) = any(&mut case.random, &mut files);
        let length = bytes.len();
        bytes.truncate(case.random.below(length as u64) as usize);
        let what = format!("{name} cut at byte {} of {length}", bytes.len());
        judged(case, "a cut", &what, &files, &ours)
    })?;
    try_all(ground, "studies", "forgeries", cases, |case| {
        let (what, files) = forged(&mut case.random, &ours);
        judged(case, "a forgery", &what, &files, &ours)
    })?;
    try_all(ground, "studies", "mixes", cases, |case| {
        let (what, files) = mixed(&mut case.random, &ours, &other);
        judged(case, "a mix", &what, &files, &ours)
    })
}

fn any<'a>(random: &mut Random, files: &'a mut Files) -> (String, &'a mut Vec<u8>) {
    let chosen = random.below(files.len() as u64) as usize;
    let (name, bytes) = files.iter_mut().nth(chosen).expect("there is a plan");
    (name.clone(), bytes)
}

/// Makes tables of a study with the command, and compares the result with the genuine ones.
fn judged(case: &mut Case<'_>, kind: &str, what: &str, files: &Files, ours: &Study) -> Result<(), Error> {
    fs::create_dir_all(case.path("study/segments"))?;
    for (name, bytes) in files {
        case.write(&format!("study/{name}"), bytes)?;
    }
    let status = case.call(&["sweep", "status", "study"])?;
    let collect = case.call(&["sweep", "collect", "study", "--quiet", "--to", "csv"])?;
    let told = || format!("{what}: {}: {}", collect.ending(), collect.said());
    let of_tables = |case: &Case<'_>| files_in(&case.path("study/tables"));
    match collect.code {
        Some(0) => {
            let tables = of_tables(case)?;
            case.hold(
                tables == ours.tables,
                &format!("collect makes other tables with exit 0 of {kind}"),
                told,
            );
        }
        // Runs are missing, and no result contradicts that.
        Some(3) => {
            case.hold(status.code == Some(3), &format!("status and collect disagree of {kind}"), || {
                format!("{}\n{}: {}", told(), status.ending(), status.said())
            });
            let run = case.call(&["sweep", "run", "study", "--quiet"])?;
            let again = case.call(&["sweep", "collect", "study", "--quiet", "--to", "csv"])?;
            let is_same = again.code == Some(0) && of_tables(case)? == ours.tables;
            case.hold(is_same, &format!("run does not bring the tables of {kind}"), || {
                format!("{}\n{}: {}\n{}", told(), run.ending(), run.said(), again.said())
            });
        }
        // A forged failure appears in the tables as such.
        Some(1) if collect.err.is_empty() => {}
        Some(1 | 2) => {
            let named =
                collect.err.contains("study/plan.ndjson: ") || collect.err.contains("study/segments/");
            case.hold(named, &format!("collect names no file of {kind}"), told);
            let left = case.path("study/tables");
            let none = !left.exists() || of_tables(case)?.is_empty();
            case.hold(none, &format!("collect fails and leaves tables of {kind}"), told);
        }
        _ => case.broke(format!("collect has another exit code of {kind}"), told()),
    }
    Ok(())
}

/// One thing changed in a result that no checksum gives away, as by a node that computes wrongly.
fn forged(random: &mut Random, ours: &Study) -> (String, Files) {
    let mut files = ours.files();
    let (chosen, at) = ours.chosen(random);
    let (name, mut segment) = ours.segments[chosen].clone();
    let frame = &mut segment.frames[at];
    let what = match random.below(5) {
        0 => {
            let numbers = [0, frame.run + 1, frame.run.saturating_sub(1), 1 << 40, u64::MAX];
            let run = random.pick(&numbers);
            let what = format!("run {} stands under {run}", frame.run);
            frame.run = run;
            what
        }
        1 => {
            let kind = random.below(256) as u8;
            let what = format!("kind of run {} from {} to {kind}", frame.run, frame.kind);
            frame.kind = kind;
            what
        }
        2 => {
            let at = random.below(frame.content.len() as u64) as usize;
            frame.content[at] ^= 1 << random.below(8);
            format!("a bit of byte {at} of the content of run {}", frame.run)
        }
        _ => {
            let mut result: serde_json::Value =
                serde_json::from_str(&frame.text()).expect("it is a sound one");
            let list = random.pick(&["slips", "ruptures"]);
            let events = result["outcome"]["Ok"][list].as_array_mut().expect("it is a sound one");
            let at = random.below(events.len() as u64) as usize;
            let what = match random.below(3) {
                0 => {
                    events.remove(at);
                    "is gone".to_owned()
                }
                1 => {
                    events.insert(at, events[at].clone());
                    "appears twice".to_owned()
                }
                _ => {
                    let other = random.below(events.len() as u64) as usize;
                    if at == other {
                        return forged(random, ours);
                    }
                    events.swap(at, other);
                    format!("changed places with {other}")
                }
            };
            *frame = Frame::done(frame.run, result.to_string().as_bytes());
            format!("{at} of {list} of run {} {what}", frame.run)
        }
    };
    if segment.bytes() == ours.segments[chosen].1.bytes() {
        return forged(random, ours);
    }
    files.insert(format!("segments/{name}"), segment.bytes());
    (format!("{name}: {what}"), files)
}

/// Results where they do not belong: of another study, of another run, doubled with other numbers.
fn mixed(random: &mut Random, ours: &Study, other: &Study) -> (String, Files) {
    let mut files = ours.files();
    let (chosen, at) = ours.chosen(random);
    let (name, mut segment) = ours.segments[chosen].clone();
    let of_other = |run: u64| {
        let mut frames = other.segments.iter().flat_map(|(_, segment)| &segment.frames);
        frames.find(|frame| frame.run == run).cloned().expect("it has the same runs")
    };
    let run = segment.frames[at].run;
    let what = match random.below(6) {
        0 => {
            segment.frames[at] = of_other(run);
            format!("the result of run {run} is that of another study")
        }
        1 => {
            // Its numbers under our id.
            let read = |frame: &Frame| -> serde_json::Value {
                serde_json::from_str(&frame.text()).expect("it is a sound one")
            };
            let mut numbers = read(&of_other(run));
            numbers["id"] = read(&segment.frames[at])["id"].take();
            segment.frames[at] = Frame::done(run, numbers.to_string().as_bytes());
            return twice_told(ours, files, &name, segment, run);
        }
        2 => {
            let (donor, from) = ours.chosen(random);
            let content = ours.segments[donor].1.frames[from].clone();
            if content.run == run {
                return mixed(random, ours, other);
            }
            let what = format!("the result of run {run} is that of run {}", content.run);
            segment.frames[at].content = content.content;
            what
        }
        3 => {
            let again = segment.frames[at].clone();
            segment.frames.push(again);
            format!("the result of run {run} appears twice")
        }
        4 => {
            segment.frames.push(of_other(run));
            format!("run {run} has a result of another study as well")
        }
        _ => {
            segment = segment.of_plan(&other.plan);
            "a segment says that it is of another study".to_owned()
        }
    };
    files.insert(format!("segments/{name}"), segment.bytes());
    (format!("{name}: {what}"), files)
}

/// Forgeries that only a second result reveals: other valid numbers, beside ours.
fn twice_told(ours: &Study, mut files: Files, name: &str, segment: Segment, run: u64) -> (String, Files) {
    files.insert("segments/another-node.seg".to_owned(), segment.bytes());
    let known = ours.segments.iter().any(|(_, segment)| segment.frames.iter().any(|frame| frame.run == run));
    debug_assert!(known, "run {run} is ours");
    (format!("{name} stands there again with other numbers for run {run}"), files)
}
