//! The commands that write files, each in two variants with the same names, and the files under these names
//! afterwards.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use crate::calls::Call;
use crate::case::Case;
use crate::file;
use crate::ground::{AREA, Error, Ground, OTHER, RUN, SMALL, emptied};
use crate::studies::SWEEP;
use mcap::records::op;

/// A command that writes.
pub(crate) struct Writer {
    pub(crate) name: &'static str,
    variants: [Vec<&'static str>; 2],
    /// Whether a complete set of the first variant exists before.
    pub(crate) over_former: bool,
    /// What exists before: a path of the inputs and its name.
    given: Option<(&'static str, &'static str)>,
    /// Whether the same call again continues from what there is, instead of refusing it.
    pub(crate) continues: bool,
    /// The undisturbed output of each variant, and its duration.
    pub(crate) alone: [Written; 2],
    pub(crate) takes: Duration,
}

/// The files under their final names, by path, each with a digest. The digest of a log covers its
/// messages, since the ends of its chunks depend on timing.
pub(crate) type Written = BTreeMap<String, String>;

/// The record of a set of files: written last, removed first. The JSON of a summary lists no files.
pub(crate) fn record(written: &Written) -> Option<&String> {
    written.keys().find(|path| path.ends_with(".json") && !path.ends_with("summary.json"))
}

/// A figure of the study.
const FIGURE: &str = "[[figure.family]]
file = 'load.png'
x = 'normal_load.tilt'
y = 'largest_ft_fn'
colour = 'friction.static_coefficient'
";

/// Where the inputs are, in every folder that a command is called in.
pub(crate) const INPUTS: &str = "in";

/// The files in a folder beside the inputs.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub(crate) written: Written,
    /// Files on the way to their names.
    pub(crate) temporary: Vec<String>,
}

impl Writer {
    /// All of them, with their undisturbed output, which is determined once.
    pub(crate) fn all(ground: &Ground) -> Result<&'static [Writer], Error> {
        static ALL: OnceLock<Vec<Writer>> = OnceLock::new();
        match ALL.get() {
            Some(all) => Ok(all),
            None => Writer::learned(ground).map(|all| ALL.get_or_init(|| all).as_slice()),
        }
    }

    /// Those of studies, which continue from what there is.
    pub(crate) fn of_studies(ground: &Ground) -> Result<Vec<Writer>, Error> {
        Writer::all(ground)?;
        let go = vec!["sweep", "go", "in/s.toml", "--quiet", "--jobs", "1", "--out", "out"];
        let collect = vec!["sweep", "collect", "out", "--quiet"];
        let mut writers = vec![
            Writer { continues: true, ..Writer::new("sweep go", [go.clone(), go], false) },
            Writer {
                continues: true,
                given: Some(("study", "out")),
                ..Writer::new("sweep collect", [collect.clone(), collect], false)
            },
        ];
        writers.iter_mut().try_for_each(|writer| writer.learn(ground))?;
        Ok(writers)
    }

    fn new(name: &'static str, variants: [Vec<&'static str>; 2], over_former: bool) -> Writer {
        let (alone, takes) = Default::default();
        Writer { name, variants, over_former, given: None, continues: false, alone, takes }
    }

    fn learned(ground: &Ground) -> Result<Vec<Writer>, Error> {
        make_inputs(ground)?;
        let small = |more: &[&'static str]| [&RUN[..], &["--checkpoint-s", "0.01"], &SMALL, more].concat();
        let on = |command: &[&'static str], more: &[&'static str]| {
            [["in/a/run.mcap"], ["in/b/run.mcap"]].map(|log| [command, &log[..], more].concat())
        };
        let out: &[&str] = &["--out", "out"];
        let export = |format: &'static str, more: &[&'static str]| {
            on(&["export"], &[out, &["--quiet", "--to", format], more].concat())
        };
        let images =
            |log| vec!["export", log, "--to", "vtk", "--nodes-at-s", "0.1", "--quiet", "--out", "out"];
        let diff = |old, new| {
            vec!["diff", old, new, "--page", "page.html", "--matches", "matches.parquet", "--force"]
        };
        let salvage = |log| vec!["salvage", log, "--out", "salvaged.mcap"];
        let reproduce = |set: &[&'static str]| [&["reproduce", "in/p.toml", "--quiet"], out, set].concat();
        let drawn = |command: &[&'static str]| [command.to_vec(), [command, &["--no-provenance"]].concat()];
        let writer = Writer::new;
        let begun = Some(("begun.mcap", "run.mcap.partial"));
        let mut writers = vec![
            writer("run", [small(&[]), small(&OTHER)], false),
            Writer {
                given: begun,
                ..writer("run --resume", [small(&["--resume"]), small(&["--resume"])], false)
            },
            writer("salvage", [salvage("in/damaged-a.mcap"), salvage("in/damaged-b.mcap")], false),
            writer("export csv", export("csv", &[]), false),
            writer("export csv --force", export("csv", &["--force"]), true),
            writer("export parquet", export("parquet", &[]), false),
            writer("export parquet --force", export("parquet", &["--force"]), true),
            writer("export vtk", ["in/a/area.mcap", "in/b/area.mcap"].map(images), false),
            writer("draw", on(&["draw"], out), false),
            writer("draw --force", on(&["draw"], &[out, &["--force"]].concat()), true),
            writer("reduce", on(&["reduce"], out), false),
            writer("report", on(&["report"], &["--out", "page.html"]), false),
            writer("report --force", on(&["report"], &["--out", "page.html", "--force"]), true),
            writer("report of a study", drawn(&["report", "in/drawn", "--out", "page.html"]), false),
            writer("sweep draw", drawn(&["sweep", "draw", "in/drawn", "--quiet", "--out", "out"]), true),
            writer("replay", on(&["replay"], &[out, &["--quiet"]].concat()), false),
            writer(
                "diff",
                [diff("in/a/run.mcap", "in/a2/run.mcap"), diff("in/b/run.mcap", "in/b2/run.mcap")],
                true,
            ),
            writer("reproduce", [reproduce(&[]), reproduce(&OTHER)], false),
        ];
        for writer in &mut writers {
            writer.learn(ground)?;
        }
        Ok(writers)
    }

    /// The arguments of a variant.
    pub(crate) fn arguments(&self, variant: usize) -> &[&'static str] {
        &self.variants[variant % 2]
    }

    /// Puts into a folder what a call of it needs, but for a former set.
    fn prepare(&self, ground: &Ground, folder: &Path) -> Result<(), Error> {
        prepare(ground, folder)?;
        match self.given {
            Some((from, to)) => copy(&folder.join(INPUTS).join(from), &folder.join(to)),
            None => Ok(()),
        }
    }

    /// Puts into the folder of a case what there is before a call, and returns what is under final names.
    pub(crate) fn set_up(&self, case: &mut Case<'_>) -> Result<Written, Error> {
        let folder = case.folder.clone();
        self.prepare(case.ground, &folder)?;
        if self.over_former {
            let former = call(case.ground, &folder, self, 1)?.run()?;
            case.must_end_well(&former);
        }
        Ok(found(&folder)?.written)
    }

    /// Determines its undisturbed output.
    fn learn(&mut self, ground: &Ground) -> Result<(), Error> {
        let folder = ground.work.join("alone");
        for variant in 0..2 {
            let mut twice = Vec::new();
            for _ in 0..2 {
                self.prepare(ground, &folder)?;
                let started = Instant::now();
                ground.succeed(&folder, self.arguments(variant))?;
                self.takes = started.elapsed();
                twice.push(found(&folder)?.written);
            }
            if twice[0] != twice[1] || twice[0].is_empty() {
                return Err(format!("{} writes other bytes each time, alone", self.name).into());
            }
            self.alone[variant] = twice.swap_remove(0);
        }
        Ok(())
    }
}

/// Puts only the inputs into a folder.
pub(crate) fn prepare(ground: &Ground, folder: &Path) -> Result<(), Error> {
    emptied(folder)?;
    copy(&ground.inputs(), &folder.join(INPUTS))
}

/// Copies a file or a folder.
pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), Error> {
    if from.is_file() {
        fs::copy(from, to)?;
        return Ok(());
    }
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

/// Whether a case still has exactly the inputs that it was given.
pub(crate) fn has_its_inputs(case: &Case<'_>) -> Result<bool, Error> {
    is_copy(&case.ground.inputs(), &case.folder.join(INPUTS))
}

/// Whether a folder has exactly the files of another, with the same bytes.
fn is_copy(from: &Path, to: &Path) -> Result<bool, Error> {
    if from.is_file() {
        return Ok(to.is_file() && fs::read(from)? == fs::read(to)?);
    }
    let names = |folder: &Path| -> Result<BTreeSet<OsString>, Error> {
        fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name())).collect()
    };
    let of = names(from)?;
    let mut is_same = to.is_dir() && of == names(to)?;
    for name in of {
        is_same = is_same && is_copy(&from.join(&name), &to.join(&name))?;
    }
    Ok(is_same)
}

fn make_inputs(ground: &Ground) -> Result<(), Error> {
    let inputs = ground.inputs();
    emptied(&inputs)?;
    let a = ground.genuine("small", &SMALL)?;
    let b = ground.genuine("small-tilted", &[&SMALL[..], &OTHER].concat())?;
    for (name, more) in [("a", &[][..]), ("b", &OTHER)] {
        let log = ground.genuine_of(&format!("area-{name}"), &[&AREA, more].concat())?;
        fs::create_dir_all(inputs.join(name))?;
        fs::write(inputs.join(name).join("area.mcap"), &log.bytes)?;
    }
    for (name, log) in [("a", &a), ("a2", &a), ("b", &b), ("b2", &b)] {
        fs::create_dir_all(inputs.join(name))?;
        fs::write(inputs.join(name).join("run.mcap"), &log.bytes)?;
    }
    for (name, log) in [("damaged-a.mcap", &a), ("damaged-b.mcap", &b)] {
        fs::write(inputs.join(name), &log.bytes[..log.bytes.len() * 2 / 3])?;
    }
    let begun = ground.genuine("small-begun", &[&["--checkpoint-s", "0.01"], &SMALL[..]].concat())?;
    fs::write(inputs.join("begun.mcap"), &begun.bytes[..begun.bytes.len() * 2 / 3])?;
    let study = ground.logs.join("small-study");
    emptied(&study)?;
    fs::write(study.join("s.toml"), SWEEP)?;
    fs::write(inputs.join("s.toml"), SWEEP)?;
    ground.succeed(&study, &["sweep", "plan", "s.toml", "--quiet", "--out", "study"])?;
    ground.succeed(&study, &["sweep", "run", "study", "--quiet"])?;
    copy(&study.join("study"), &inputs.join("study"))?;
    fs::write(study.join("drawn.toml"), format!("{SWEEP}{FIGURE}"))?;
    ground.succeed(&study, &["sweep", "go", "drawn.toml", "--quiet", "--out", "drawn"])?;
    copy(&study.join("drawn"), &inputs.join("drawn"))?;
    let set = "set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=0.5\"]";
    let runs =
        ["one", "two"].map(|name| format!("[[run]]\nname = \"{name}\"\nscenario = \"default\"\n{set}\n"));
    fs::write(inputs.join("p.toml"), format!("title = \"Two runs\"\n{}", runs.concat()))?;
    Ok(())
}

/// The files in a folder beside the inputs.
pub(crate) fn found(folder: &Path) -> Result<Found, Error> {
    let mut found = Found::default();
    look(folder, "", &mut found)?;
    Ok(found)
}

fn look(folder: &Path, before: &str, found: &mut Found) -> Result<(), Error> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = format!("{before}{name}");
        let kind = entry.file_type()?;
        // Everything in such a folder.
        if is_temporary(&name) {
            found.temporary.push(path);
        } else if kind.is_dir() {
            // The segments of a study bear the numbers of their processes; its tables show what is in them.
            if path != INPUTS && name != "segments" {
                look(&entry.path(), &format!("{path}/"), found)?;
            }
        } else {
            found.written.insert(path, digest(&fs::read(entry.path())?));
        }
    }
    Ok(())
}

/// Names of files that must not be used yet.
pub(crate) fn is_temporary(name: &str) -> bool {
    name.ends_with(".partial")
        || name.contains(".partial.")
        || name.ends_with(".resumed")
        || name.ends_with(".lock")
        || (name.starts_with('.') && name.contains("asperity"))
}

/// The content of the first metadata record of that name.
fn metadata(bytes: &[u8], name: &str) -> Option<BTreeMap<String, String>> {
    let parts = file::records(bytes).into_iter().filter(|record| record.opcode == op::METADATA);
    parts.map(|record| record.part(bytes)).find(|part| part.name() == Some(name))?.map()
}

/// A digest of a file.
pub(crate) fn digest(bytes: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    if !bytes.starts_with(mcap::MAGIC) {
        return hasher.update(bytes).finalize().to_hex().to_string();
    }
    let status = metadata(bytes, "run_end").and_then(|end| end.get("status").cloned());
    match (file::messages(bytes), status) {
        (Ok(messages), Some(status)) if bytes.ends_with(mcap::MAGIC) => {
            hasher.update(status.as_bytes());
            for (_, message) in messages {
                hasher.update(message.topic.as_bytes());
                hasher.update(&message.sequence.to_le_bytes());
                hasher.update(&message.time_ns.to_le_bytes());
                hasher.update(&(message.payload.len() as u64).to_le_bytes());
                hasher.update(&message.payload);
            }
            hasher.finalize().to_hex().to_string()
        }
        // Never equal to a digest of anything whole.
        (messages, status) => {
            format!("a log that is not whole: {:?}, {status:?}", messages.map(|all| all.len()))
        }
    }
}

/// A set in words: which files of it are those of which variant.
pub(crate) fn compared(writer: &Writer, written: &Written) -> String {
    let of = |path: &String, digest: &String| {
        let same: Vec<&str> = [("first", &writer.alone[0]), ("second", &writer.alone[1])]
            .into_iter()
            .filter(|(_, alone)| alone.get(path) == Some(digest))
            .map(|(word, _)| word)
            .collect();
        match same.is_empty() {
            true => format!("{path}: of neither ({digest})"),
            false => format!("{path}: {}", same.join(" and ")),
        }
    };
    let lines: Vec<String> = written.iter().map(|(path, digest)| of(path, digest)).collect();
    if lines.is_empty() { "no files".to_owned() } else { lines.join("\n") }
}

/// A call of a variant, in a folder.
pub(crate) fn call<'a>(
    ground: &Ground,
    folder: &'a Path,
    writer: &Writer,
    variant: usize,
) -> Result<Call<'a>, Error> {
    Ok(Call::new(&ground.program, folder, writer.arguments(variant))?)
}
