//! A detector is a crate and a line, a contact law a file and a line: these tests follow the guide of
//! `docs/extending.md` in a copy of the workspace, with the crate of `fixtures/detector-template` and the
//! file of `fixtures/law-template`. Events of the detector appear in logs, tables and exports, and older
//! logs are still read correctly. With that law, and with one with a memory and a timer for each contact,
//! chains and slabs run with both solvers, resume and are checked.
//!
//! The copy stays in the target folder, so that only what changed is compiled again, and starts
//! with the dependencies that the tests were built with.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

use asperity_runlog::{RunReader, Topics};
use asperity_testkit::{folder, run_end};

use crate::support::binary::{self, text, with_sets};
use crate::support::clients::{file, said};
use crate::support::{seed, small};

const TEMPLATE: &str = "fixtures/detector-template";
const LAWS: [&str; 2] = ["viscous.rs", "healing.rs"];
const TOPIC: &str = "/events/longest";
const COLUMNS: &str = "event,onset_s,duration_s,duration_ratio,blocks_slipped";

/// The changes described by the guide: the file, the line before the new one, and the new line. The places
/// in code are the lists of detectors and of laws.
const CHANGES: [(&str, &str, &str); 4] = [
    (
        "Cargo.toml",
        "asperity-detect-rupture = { path = \"crates/detect-rupture\", version = \"=0.1.0\" }\n",
        "asperity-detect-longest = { path = \"crates/detect-longest\" }\n",
    ),
    (
        "crates/run/Cargo.toml",
        "asperity-detect-rupture.workspace = true\n",
        "asperity-detect-longest.workspace = true\n",
    ),
    (
        "crates/run/src/detectors.rs",
        "(\"arrival\", |run| boxed(ArrivalDetector::new(run.blocks, run.links).with_sensors(run.sensors))),\n",
        "    (\"longest\", |_| boxed(asperity_detect_longest::LongestDetector::default())),\n",
    ),
    (
        "crates/model/src/law/laws.rs",
        "    InterfacialSprings in springs: \"interfacial-springs\", \"Amontons-Coulomb with a spring that holds a stuck block (5.12-5.15)\";\n",
        "    Viscous in viscous: \"viscous\", \"springs, and sliding friction that grows with speed\";\n    \
             Healing in healing: \"healing\", \"springs, and contacts that are stronger for a known time\";\n",
    ),
];

/// The workspace with one more detector and one more law.
struct Copy {
    folder: PathBuf,
}

impl Copy {
    fn make(folder: PathBuf) -> Copy {
        let copy = Copy { folder };
        let mut written = BTreeSet::new();
        let guide = fs::read_to_string(file("docs/extending.md")).expect("the guide can be read");
        for part in ["Cargo.toml", "crates", "tests/attack", "xtask"] {
            copy.take(&file(part), Path::new(part), &mut written);
        }
        copy.take(&file(TEMPLATE), Path::new("crates/detect-longest"), &mut written);
        for law in LAWS {
            let [from, to] =
                ["fixtures/law-template", "crates/model/src/law/laws"].map(|at| Path::new(at).join(law));
            copy.take(&file(text(&from)), &to, &mut written);
        }
        for (path, _, _) in CHANGES {
            assert!(guide.contains(&format!("`{path}`")), "docs/extending.md does not speak of {path}");
        }
        // Files removed from the workspace are removed here too.
        for path in files(&copy.folder.join("crates")) {
            if !written.contains(&path) {
                fs::remove_file(&path).expect("the copy can be changed");
            }
        }
        let lock = copy.folder.join("Cargo.lock");
        if !lock.exists() {
            fs::copy(file("Cargo.lock"), &lock).expect("the copy can be written");
        }
        copy
    }

    /// Copies a file or folder; unchanged files keep their modification times, which cargo compares.
    fn take(&self, from: &Path, to: &Path, written: &mut BTreeSet<PathBuf>) {
        for path in files(from) {
            let inside = path.strip_prefix(from).expect("it is below the folder");
            // For a file the relative path is empty, and joining it would append a slash.
            let to = if inside.as_os_str().is_empty() { to.to_owned() } else { to.join(inside) };
            let target = self.folder.join(&to);
            let mut bytes = fs::read(&path).expect("the workspace can be read");
            for (changed, behind, line) in CHANGES {
                if to == Path::new(changed) {
                    let text = String::from_utf8(bytes).expect("sources are text");
                    let at = text.find(behind).unwrap_or_else(|| panic!("{changed} lacks {behind}"));
                    let at = at + behind.len();
                    bytes = [&text[..at], line, &text[at..]].concat().into_bytes();
                }
            }
            if fs::read(&target).is_ok_and(|there| there != bytes) || !target.exists() {
                let folder = target.parent().expect("a file lies in a folder");
                fs::create_dir_all(folder).expect("folders can be made");
                fs::write(&target, bytes).expect("the copy can be written");
            }
            written.insert(target);
        }
    }

    /// Builds the command.
    fn build(&self) -> PathBuf {
        let target = self.folder.join("target");
        let built = Path::new(env!("CARGO_BIN_EXE_asperity")).parent().expect("it lies in a folder");
        seed::dependencies(built, &target.join("debug")).expect("compiled dependencies can be copied");
        let started = Instant::now();
        let output = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--offline", "--package", "asperity-cli"])
            .current_dir(&self.folder)
            .env("CARGO_TARGET_DIR", &target)
            // For one short run the compiler's time counts, not the program's.
            .env("CARGO_PROFILE_DEV_OPT_LEVEL", "0")
            .output()
            .expect("cargo starts");
        assert!(output.status.success(), "{}", said(&output));
        writeln!(std::io::stdout(), "built in {:.0} s", started.elapsed().as_secs_f64()).expect("it is open");
        target.join("debug").join("asperity")
    }
}

/// The files below a folder, or the file itself.
fn files(path: &Path) -> Vec<PathBuf> {
    if !path.is_dir() {
        return vec![path.to_owned()];
    }
    let entries = fs::read_dir(path).expect("the folder can be read");
    entries.flat_map(|entry| files(&entry.expect("the folder can be read").path())).collect()
}

/// Runs the command that has the new detector, which must end well.
fn succeed(asperity: &Path, arguments: &[&str]) -> String {
    let output: Output = Command::new(asperity).args(arguments).output().expect("the binary starts");
    assert!(output.status.success(), "{}: {}", arguments.join(" "), said(&output));
    said(&output)
}

fn code_version(log: &Path) -> String {
    let reader = RunReader::open(log, Topics::NONE).expect("it is a log");
    reader.header().code_version.clone()
}

/// Columns of a table that was exported, by name.
fn column(table: &Path, name: &str) -> Vec<f64> {
    let text = fs::read_to_string(table).expect("the table can be read");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().expect("it has a head").split(',');
    let at = names.enumerate().find(|(_, column)| *column == name).expect("it has the column").0;
    let cell = |line: &str| line.split(',').nth(at).and_then(|cell| cell.parse().ok()).expect("a number");
    lines.map(cell).collect()
}

/// The result of a run of the law: the folder of its exported tables.
fn exported(asperity: &Path, scenario: &[&str], log: &Path) -> PathBuf {
    succeed(asperity, &[&["run"], scenario, &["--out", text(log)]].concat());
    let tables = log.with_extension("tables");
    succeed(asperity, &["export", text(log), "--to", "csv", "--out", text(&tables)]);
    tables
}

fn table(tables: &Path, name: &str) -> PathBuf {
    let found = files(tables).into_iter().find(|path| text(path).ends_with(name));
    found.unwrap_or_else(|| panic!("no {name} in {}", tables.display()))
}

/// Under a constant force, that of the prestress, sliding blocks approach the velocity at which viscosity
/// balances the force less friction: `(tau_p - mu_d p) / E`.
fn blocks_approach_the_terminal_velocity(asperity: &Path, folder: &Path) {
    let sets = [
        "parameter_set=as-coded",
        "friction.law=viscous",
        "friction.radiation_kg_per_s=70",
        "prestress.ratio=0.8",
        "drive.velocity_m_per_s=0",
        "drive.stiffness_n_per_m=1e-9",
        "time.step_s=1e-6",
        "time.duration_s=0.5",
        "recording.fields_s=0.5",
    ];
    for solver in ["fast", "plain"] {
        let log = folder.join(format!("terminal-{solver}.mcap"));
        let tables = exported(asperity, &with_sets(&["ten-blocks", "--solver", solver], &sets), &log);
        let velocities = column(&table(&tables, "fields.csv"), "velocity_m_per_s");
        let terminal_m_per_s = (0.8 - 0.45) * 40.0 / 70.0;
        assert!(velocities.len() >= 20, "{}", velocities.len());
        for velocity in &velocities[velocities.len() - 10..] {
            assert!((velocity / terminal_m_per_s - 1.0).abs() < 1e-9, "{solver}: {velocity}");
        }
    }
}

/// A chain, and a slab whose contacts slip several times.
const BODIES: [(&str, &[&str]); 2] = [
    (
        "ten-blocks",
        &[
            "parameter_set=as-coded",
            "drive.velocity_m_per_s=1e-2",
            "time.step_s=1e-6",
            "time.duration_s=0.2",
            "recording.sample_s=1e-2",
        ],
    ),
    (
        "slab",
        &[
            "slider.blocks=5",
            "slider.rows=3",
            "slider.height_m=0.07",
            "slider.mass_kg=2",
            "drive.height_m=0.035",
            "drive.velocity_m_per_s=2e-2",
            "time.step_s=1e-5",
            "time.duration_s=0.1",
            "recording.fields_s=0",
            "recording.sample_s=1e-2",
        ],
    ),
];

/// Chains and slabs slip under the law, equally with both solvers, and are resumed and checked; without
/// viscosity they agree with the underlying law up to rounding.
fn chains_and_slabs_run_by_the_law(asperity: &Path, folder: &Path) {
    for (body, sets) in BODIES {
        let scenario = &with_sets(&[body], sets)[..];
        let run = |name: &str, law: &str, solver: &str| {
            let law: Vec<&str> = law.split_whitespace().collect();
            let log = folder.join(format!("{body}-{name}.mcap"));
            let scenario = [scenario, &["--solver", solver]].concat();
            (exported(asperity, &with_sets(&scenario, &law), &log), log)
        };
        let viscous = "friction.law=viscous friction.radiation_kg_per_s=20";
        let (fast, log) = run("fast", viscous, "fast");
        let (plain, ..) = run("plain", viscous, "plain");
        let steps = |tables: &Path| column(&table(tables, "switch.csv"), "step");
        assert!(steps(&fast).len() >= 10, "{body}: {:?}", steps(&fast));
        assert_eq!(steps(&fast), steps(&plain), "{body}");
        let (without, ..) = run("without", "friction.law=viscous", "fast");
        let (springs, ..) = run("springs", "friction.law=interfacial-springs", "fast");
        let forces = |tables: &Path| column(&table(tables, "switch.csv"), "tangential_force_n");
        assert_eq!(steps(&without), steps(&springs), "{body}");
        for (without, springs) in forces(&without).iter().zip(forces(&springs)) {
            // With one law the fast solver uses windows, with the other single steps.
            assert!((without / springs - 1.0).abs() < 1e-9, "{body}: {without} {springs}");
        }
        assert_ne!(steps(&without), steps(&fast), "{body}: viscosity changes the run");

        is_checked_and_resumed(asperity, scenario, viscous, &log);
    }
}

/// A contact that re-attached detaches at 1.1 times its threshold of 28 N for 10,000 steps, and at that
/// after them.
fn contacts_heal_for_a_known_time(asperity: &Path, folder: &Path) {
    const HEALING_STEPS: u64 = 10_000;
    const LAW: &str = "friction.law=healing";
    let chain = ["drive.velocity_m_per_s=3e-3", "time.duration_s=0.5"];
    let chain = with_sets(&with_sets(&[BODIES[0].0], BODIES[0].1), &chain);
    let run = |name: &str, scenario: &[&str], law: &str, solver: &str| {
        let log = folder.join(format!("{name}-{solver}.mcap"));
        let tables = exported(asperity, &[scenario, &["--set", law, "--solver", solver]].concat(), &log);
        let table = table(&tables, "switch.csv");
        let columns = ["step", "block", "tangential_force_n", "threshold_n"].map(|name| column(&table, name));
        (columns, log)
    };
    for (body, scenario) in [("chain", &chain), ("slab", &with_sets(&["slab"], BODIES[1].1))] {
        let name = format!("healing-{body}");
        let ([steps, ..], log) = run(&name, scenario, LAW, "fast");
        let ([of_plain, ..], _) = run(&name, scenario, LAW, "plain");
        let springs = "friction.law=interfacial-springs";
        let ([of_springs, ..], _) = run(&format!("{name}-springs"), scenario, springs, "fast");
        assert!(steps == of_plain && steps != of_springs, "{body}: {steps:?} {of_plain:?} {of_springs:?}");
        is_checked_and_resumed(asperity, scenario, LAW, &log);
    }
    let ([steps, blocks, forces, thresholds], _) = run("healing", &chain, LAW, "fast");
    let (mut slides, mut attached_step) = ([false; 10], [f64::NEG_INFINITY; 10]);
    let (mut early, mut late) = (0, 0);
    for n in 0..steps.len() {
        let block = blocks[n] as usize - 1;
        slides[block] = !slides[block];
        if !slides[block] {
            attached_step[block] = steps[n];
            continue;
        }
        let stuck_steps = (steps[n] - attached_step[block]) as u64;
        let heals = stuck_steps <= HEALING_STEPS;
        *(if heals { &mut early } else { &mut late }) += 1;
        assert_eq!(thresholds[n], if heals { 1.1 * 28.0 } else { 28.0 }, "step {}", steps[n]);
        // A contact that has healed may have been pulled by more than its present strength.
        let most = if stuck_steps == HEALING_STEPS + 1 { 1.1 } else { 1.01 };
        assert!((1.0..most).contains(&(forces[n] / thresholds[n])), "step {}: {}", steps[n], forces[n]);
    }
    assert!(early > 10 && late > 10, "{early} early, {late} late");
}

/// A log of a run with the law matches its scenario, and half of it, with many checkpoints, resumes to the
/// same log.
fn is_checked_and_resumed(asperity: &Path, scenario: &[&str], law: &str, log: &Path) {
    succeed(asperity, &["check", "--again", text(log)]);
    let sets = with_sets(&[], &law.split_whitespace().collect::<Vec<_>>());
    let half = log.with_extension("half.mcap");
    let made = ["--solver", "fast", "--checkpoint-s", "0", "--out", text(&half)];
    succeed(asperity, &[&["run"], scenario, &sets, &made].concat());
    let bytes = fs::read(&half).expect("the log can be read");
    fs::remove_file(&half).expect("it can be removed");
    fs::write(asperity_runlog::partial_path(&half), &bytes[..bytes.len() / 2]).expect("it can be written");
    let resume = ["--solver", "fast", "--resume", "--out", text(&half)];
    let said = succeed(asperity, &[&["run"], scenario, &sets, &resume].concat());
    assert!(said.contains("resumes from"), "{law}: {said}");
    assert_eq!(run_end(&half).digest, run_end(log).digest, "{law}");
}

/// Without building: the places named by the guide exist, and the template fits there.
#[test]
fn the_guide_names_places_that_are_there() {
    let scratch = folder();
    let copy = Copy::make(scratch.path().join("copy"));
    for (path, _, line) in CHANGES {
        let changed = fs::read_to_string(copy.folder.join(path)).expect("it was copied");
        assert!(changed.contains(line), "{path}");
    }
    for part in ["detect-longest/Cargo.toml", "detect-longest/src/lib.rs", "model/src/law/laws/viscous.rs"] {
        assert!(copy.folder.join("crates").join(part).is_file(), "{part}");
    }
}

#[test]
#[ignore = "a minute of compiling: cargo xtask nightly"]
fn the_guide_gives_a_detector_and_a_law_that_runs_and_logs_have() {
    let asperity = Copy::make(Path::new(env!("CARGO_TARGET_TMPDIR")).join("new-detector")).build();
    let scratch = folder();
    blocks_approach_the_terminal_velocity(&asperity, scratch.path());
    contacts_heal_for_a_known_time(&asperity, scratch.path());
    chains_and_slabs_run_by_the_law(&asperity, scratch.path());
    let [old, new] = ["old.mcap", "new.mcap"].map(|name| scratch.path().join(name));
    small::run(&old);
    succeed(&asperity, &[&["run"], &small::SCENARIO[..], &["--out", text(&new)]].concat());

    // Topics of both are equal, and the new one has one more.
    let [before, after] = [&old, &new].map(|log| run_end(log));
    let [code_before, code_after] = [&old, &new].map(|log| code_version(log));
    assert_ne!(code_before, code_after, "a detector makes another program");
    let mut common = after.topic_digests.clone();
    common.remove(TOPIC).expect("it has that topic");
    assert_eq!(common, before.topic_digests);
    let events = after.message_counts[TOPIC];
    assert!(events > 0, "nothing of it was found");

    // Its table and its export follow from its payload.
    let tables = scratch.path().join("tables");
    succeed(&asperity, &["replay", text(&new), "--out", text(&tables)]);
    let exported = scratch.path().join("exported");
    succeed(&asperity, &["export", text(&new), "--to", "csv", "--topic", TOPIC, "--out", text(&exported)]);
    for folder in [tables, exported] {
        let table = files(&folder).into_iter().find(|path| text(path).contains("longest"));
        let table = table.unwrap_or_else(|| panic!("no table of it in {}", folder.display()));
        let table = fs::read_to_string(&table).expect("the table can be read");
        let columns = table.lines().next().unwrap_or_default();
        assert!(columns.ends_with(COLUMNS), "{columns}");
        assert_eq!(table.lines().count() as u64, events + 1, "{table}");
    }

    // A log from before is sound, and so is the new one to the command from before.
    let check = |asperity: &Path, log: &Path| {
        let output = Command::new(asperity).args(["check", text(log)]).output().expect("the binary starts");
        assert_eq!(output.status.code(), Some(6), "{}", said(&output));
        said(&output)
    };
    let lacks = check(&asperity, &old);
    assert!(lacks.contains(&format!("by other detectors: it lacks {TOPIC}")), "{lacks}");
    let has = check(Path::new(env!("CARGO_BIN_EXE_asperity")), &new);
    assert!(has.contains(&format!("by other detectors: it also has {TOPIC}")), "{has}");
    for said in [&lacks, &has] {
        assert!(said.contains(": by other code or detectors: "), "{said}");
    }
    succeed(&asperity, &["replay", text(&old)]);
    binary::succeed(&["replay", text(&new)]);
}
