//! The house rules that no compiler checks. The rules for crates (allowed uses, sole wrappers of
//! dependencies, files that may be long) are read from ARCHITECTURE.md (`tidy/page.rs`) and compared with
//! cargo and the sources; the rules for files are here.

mod page;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use asperity_model::scenario::builtin;
use asperity_model::{Scenario, ScenarioSource};
use page::Page;
use serde_json::Value;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace is there")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("failed to read {}: {error}", path.display()))
}

/// A path as it is written in messages: from the root folder.
fn short(path: &Path) -> String {
    path.strip_prefix(root()).unwrap_or(path).display().to_string()
}

/// The files below a path, or the path itself if it is a file.
fn files(path: &Path, found: &mut Vec<PathBuf>) {
    if path.is_dir() {
        if path.ends_with("target") || path.ends_with("__pycache__") {
            return;
        }
        let mut entries: Vec<PathBuf> = fs::read_dir(path)
            .expect("folders of the workspace can be read")
            .map(|entry| entry.expect("folders of the workspace can be read").path())
            .collect();
        entries.sort();
        entries.iter().for_each(|entry| files(entry, found));
    } else {
        found.push(path.to_owned());
    }
}

fn files_in(parts: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    parts.iter().for_each(|part| files(&root().join(part), &mut found));
    found
}

/// A workspace crate, as cargo understands its manifest.
struct Member {
    /// Without the `asperity-` in front.
    name: String,
    manifest: PathBuf,
    /// Dependencies of its library, binary or build script.
    uses: BTreeSet<String>,
}

fn short_name(package: &str) -> String {
    package.strip_prefix("asperity-").unwrap_or(package).to_owned()
}

/// Asked of cargo itself; the crate that wraps this switches a feature of
/// `serde_json` on, and with it half of the workspace would be built twice.
fn members() -> Vec<Member> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version", "1"])
        .current_dir(root())
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo writes JSON");
    let text = |value: &Value| value.as_str().expect("cargo gives a text").to_owned();
    metadata["packages"]
        .as_array()
        .expect("cargo lists packages")
        .iter()
        .map(|package| Member {
            name: short_name(&text(&package["name"])),
            manifest: text(&package["manifest_path"]).into(),
            uses: package["dependencies"]
                .as_array()
                .expect("cargo lists dependencies")
                .iter()
                .filter(|dependency| dependency["kind"] != "dev")
                .map(|dependency| text(&dependency["name"]))
                .collect(),
        })
        .collect()
}

fn architecture() -> Page {
    let text = read(&root().join("ARCHITECTURE.md"));
    Page::parse(&text).unwrap_or_else(|error| panic!("ARCHITECTURE.md: {error}"))
}

#[test]
fn arrows_between_crates_are_those_of_the_page() {
    let page = architecture();
    let members = members();
    let names: BTreeSet<&String> = members.iter().map(|member| &member.name).collect();
    let rows: BTreeSet<&String> = page.may_use.keys().collect();
    assert_eq!(names, rows, "the workspace on the left, the table of crates in ARCHITECTURE.md on the right");
    for member in &members {
        let may = &page.may_use[&member.name];
        let used: BTreeSet<String> = member.uses.iter().map(|package| short_name(package)).collect();
        let more: Vec<&String> = used.difference(may).filter(|used| names.contains(used)).collect();
        assert!(
            more.is_empty(),
            "{} uses {more:?}, ARCHITECTURE.md says that it may use {may:?}",
            member.name
        );
        assert!(!may.contains("testkit"), "{}: testkit is for tests alone", member.name);
    }
}

#[test]
fn wrapped_dependencies_have_one_user() {
    let wrapped = architecture().wrapped;
    assert!(wrapped.len() >= 4, "ARCHITECTURE.md says \"the only user of\" of {wrapped:?} alone");
    let members = members();
    for (dependency, wrapper) in wrapped {
        let users: Vec<&String> = members
            .iter()
            // Crates that only tests compare with others may use anything.
            .filter(|member| member.name != "xtask")
            .filter(|member| member.uses.contains(&dependency))
            .map(|member| &member.name)
            .collect();
        assert_eq!(
            users,
            [&wrapper],
            "users of {dependency}; ARCHITECTURE.md says {wrapper} is the only one"
        );
    }
}

#[test]
fn long_files_have_a_reason() {
    const LINES: usize = 700;
    let accepted = architecture().long_files;
    let mut long = BTreeSet::new();
    for path in files_in(&["crates", "tests", "xtask"]) {
        let is_source = path.extension().is_some_and(|extension| extension == "rs");
        let lines = if is_source { read(&path).lines().count() } else { 0 };
        if lines > LINES {
            let name = short(&path);
            assert!(
                accepted.contains_key(&name),
                "{name} has {lines} lines (accepted: {LINES}, or a line under \"Long files\" in ARCHITECTURE.md)"
            );
            long.insert(name);
        }
    }
    let short: Vec<&String> = accepted.keys().filter(|name| !long.contains(*name)).collect();
    assert!(
        short.is_empty(),
        "not long any more, take them from \"Long files\" in ARCHITECTURE.md: {short:?}"
    );
}

/// Every crate shows its purpose in a short example that its tests run; those of the Python package are in
/// Python.
#[test]
fn every_library_shows_an_example_that_runs() {
    let mut without = Vec::new();
    for member in members() {
        let lib = member.manifest.with_file_name("src").join("lib.rs");
        if lib.exists() && member.name != "python" && !has_example(&read(&lib)) {
            without.push(member.name);
        }
    }
    assert!(without.is_empty(), "no example that runs at the head of lib.rs: {without:?}");
}

/// Whether the text of a crate's own documentation has a block of code that is compiled and run.
fn has_example(lib: &str) -> bool {
    let fences = lib.lines().filter_map(|line| line.strip_prefix("//! ```"));
    // Every other fence closes a block.
    fences.step_by(2).any(|words| {
        let runs = |word: &str| matches!(word, "" | "rust") || word.starts_with("edition");
        words.split(',').all(|word| runs(word.trim()))
    })
}

#[test]
fn only_examples_that_run_count() {
    for (block, runs) in [
        ("//! ```\n//! f();\n//! ```\n", true),
        ("//! ```rust\n//! f();\n//! ```\n", true),
        ("//! ```text\n//! a -> b\n//! ```\n", false),
        ("//! ```no_run\n//! f();\n//! ```\n", false),
        ("//! ```rust,ignore\n//! f();\n//! ```\n", false),
        ("//! ```toml\n//! ```\n//!\n//! ```\n//! f();\n//! ```\n", true),
        ("/// ```\n/// f();\n/// ```\n", false),
    ] {
        assert_eq!(has_example(block), runs, "{block}");
    }
}

/// Features anywhere else would make the ways of building the workspace differ,
/// and each of them would compile the dependency again.
#[test]
fn versions_and_features_stand_in_the_workspace_manifest_alone() {
    for member in members() {
        let manifest: toml::Table = read(&member.manifest).parse().expect("a manifest is TOML");
        assert!(!manifest.contains_key("target"), "{}: dependencies by platform", member.name);
        for kind in ["dependencies", "dev-dependencies", "build-dependencies"] {
            for (name, dependency) in manifest.get(kind).and_then(toml::Value::as_table).into_iter().flatten()
            {
                let keys: Option<BTreeSet<&str>> =
                    dependency.as_table().map(|table| table.keys().map(String::as_str).collect());
                let plain = keys == Some(BTreeSet::from(["workspace"]));
                // Tables and figures of runs need polars and plotters, the attack needs libraries for
                // writing files.
                let may_lack =
                    matches!(member.name.as_str(), "diff" | "figures" | "study" | "tables" | "xtask");
                assert!(
                    plain || may_lack && keys == Some(BTreeSet::from(["workspace", "optional"])),
                    "{}: {name} = {dependency} (accepted: workspace = true)",
                    member.name
                );
            }
        }
    }
}

/// Functions that create, rename or remove files, and so must be in `crates/files`.
const WRITERS: [&str; 9] = [
    "File::create",
    "File::options",
    "OpenOptions",
    "fs::write",
    "fs::rename",
    "fs::copy",
    "fs::remove_",
    "fs::create_dir",
    "fs::hard_link",
];

/// The places of a crate's own code, without its tests, where files are written.
fn writes(source: &str) -> impl Iterator<Item = (usize, &'static str)> {
    let own = source.split("#[cfg(test)]").next().unwrap_or_default();
    let lines = (1..).zip(own.lines()).filter(|(_, line)| !line.trim_start().starts_with("//"));
    // That library only reads.
    let lines = lines.filter(|(_, line)| !line.contains("hdf5_reader::OpenOptions"));
    lines.flat_map(|(number, line)| {
        WRITERS.into_iter().filter(|word| has_word(line, word)).map(move |word| (number, word))
    })
}

/// Whether a line has a word, and not only as the end of a longer one, such as `MatchFile::create`.
fn has_word(line: &str, word: &str) -> bool {
    let begins = |at: usize| !line[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    line.match_indices(word).any(|(at, _)| begins(at))
}

/// Code that bypasses `crates/files` has no lock, and may overwrite a file that is being read.
#[test]
fn files_are_written_in_one_place() {
    let mut found = String::new();
    for path in files_in(&["crates"]) {
        let name = short(&path);
        let is_source = name.contains("/src/") && name.ends_with(".rs");
        // Sources of tests and the benchmark only.
        let is_for_tests = ["files", "testkit"].map(|name| format!("crates/{name}/"));
        if is_source && !is_for_tests.iter().any(|folder| name.starts_with(folder)) {
            for (line, word) in writes(&read(&path)) {
                found += &format!("{name}:{line} uses {word}\n");
            }
        }
    }
    assert!(found.is_empty(), "files are written past crates/files:\n{found}");
    let sample = "// fs::write is no use\nMatchFile::create(path);\nlet file = File::create(path);\n#[cfg(test)]\nfs::write(path, text)";
    assert_eq!(writes(sample).collect::<Vec<_>>(), [(3, "File::create")]);
}

/// Functions that open files for reading, and would wait for a writer if the path is a pipe.
const READERS: [&str; 3] = ["File::open", "fs::read(", "fs::read_to_string"];

#[test]
fn files_of_others_are_opened_in_one_place() {
    // Sources read by the build and tests, and files written by the kernel.
    let is_own =
        |name: &str, line: &str| name == "crates/run/src/code_version.rs" || line.contains("\"/proc/");
    let mut found = String::new();
    for path in files_in(&["crates"]) {
        let name = short(&path);
        let is_source = name.contains("/src/") && name.ends_with(".rs");
        let is_for_tests = ["files", "testkit"].map(|name| format!("crates/{name}/"));
        if !is_source || is_for_tests.iter().any(|folder| name.starts_with(folder)) {
            continue;
        }
        let source = read(&path);
        let own = source.split("#[cfg(test)]").next().unwrap_or_default();
        let code = (1..).zip(own.lines()).filter(|(_, line)| !line.trim_start().starts_with("//"));
        for (number, line) in code.filter(|(_, line)| !is_own(&name, line)) {
            for word in READERS.into_iter().filter(|word| has_word(line, word)) {
                found += &format!("{name}:{number} uses {word}\n");
            }
        }
    }
    assert!(found.is_empty(), "files are opened past asperity_files::open:\n{found}");
}

#[test]
fn every_source_file_says_what_it_is_for() {
    for path in files_in(&["crates", "tests", "xtask"]) {
        if path.extension().is_some_and(|extension| extension == "rs") {
            assert!(read(&path).starts_with("//! "), "{} does not open with //!", short(&path));
        }
    }
}

/// A file that no module names is never compiled, without a warning.
#[test]
fn every_file_of_tests_is_a_module_of_their_program() {
    for (program, folders) in [
        ("tests", &["", "in_ci", "support"][..]),
        ("crates/run/tests/all", &[""]),
        ("crates/simulator/tests/all", &[""]),
    ] {
        let program = root().join(program);
        let main = read(&program.join("main.rs"));
        let modules: BTreeSet<&str> =
            main.lines().map(|line| line.trim().trim_start_matches("pub(crate) ")).collect();
        for folder in folders {
            for entry in fs::read_dir(program.join(folder)).expect("the folder is there") {
                let path = entry.expect("the folder can be read").path();
                let name = path.file_stem().unwrap_or_default().to_string_lossy();
                let is_source = path.extension().is_some_and(|extension| extension == "rs");
                let named = name == "main" || modules.contains(format!("mod {name};").as_str());
                assert!(!is_source || named, "{} names no module {name}", short(&program.join("main.rs")));
            }
        }
    }
}

#[test]
fn the_architecture_page_and_the_crates_agree() {
    let page = read(&root().join("ARCHITECTURE.md"));
    let is_name = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let named: BTreeSet<&str> = page
        .split("crates/")
        .skip(1)
        .map(|rest| rest.split(|c| !is_name(c)).next().unwrap_or_default())
        .filter(|name| !name.is_empty())
        .collect();
    let there: BTreeSet<String> = fs::read_dir(root().join("crates"))
        .expect("the folder is there")
        .map(|entry| entry.expect("the folder can be read"))
        .filter(|entry| entry.path().is_dir())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    let gone: Vec<&&str> = named.iter().filter(|name| !there.contains(**name)).collect();
    let untold: Vec<&String> = there.iter().filter(|name| !named.contains(name.as_str())).collect();
    assert!(gone.is_empty(), "ARCHITECTURE.md names crates that are not there: {gone:?}");
    assert!(untold.is_empty(), "ARCHITECTURE.md does not name as crates/NAME: {untold:?}");
    let paragraphs = architecture().paragraphs;
    for name in there.iter().map(String::as_str).chain(["xtask"]) {
        let words = paragraphs.get(name).map_or(0, |paragraph| paragraph.split_whitespace().count());
        assert!(words >= 5, "ARCHITECTURE.md has no paragraph under a heading for {name}");
    }
}

/// The repository is self-contained; a path out of it is meaningless to its readers.
#[test]
fn nothing_points_out_of_the_repository() {
    // Put together here, or this file would be the first to fail.
    let foreign = [concat!("..", "/shared"), concat!("/wo", "rk/")];
    let parts = [
        ".cargo",
        ".ci",
        ".github",
        "ARCHITECTURE.md",
        "Cargo.toml",
        "README.md",
        "SECURITY.md",
        "crates",
        "fixtures",
        "pipelines",
        "tests",
        "xtask",
    ];
    for path in files_in(&parts) {
        // Binary files are skipped, since nobody reads paths in them.
        let bytes = fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", short(&path)));
        let Ok(text) = String::from_utf8(bytes) else { continue };
        for word in foreign {
            let line = text.lines().position(|line| line.contains(word));
            assert!(line.is_none(), "{}:{} has {word}", short(&path), line.unwrap_or_default() + 1);
        }
    }
}

#[test]
fn every_built_in_scenario_resolves_in_both_parameter_sets() {
    for (name, text) in builtin::all() {
        for set in ["as-coded", "as-stated"] {
            let source = ScenarioSource::new(name, text).with_override(&format!("parameter_set={set}"));
            Scenario::resolve(&source).unwrap_or_else(|errors| panic!("{errors}"));
        }
    }
}

#[test]
fn every_pipeline_resolves_in_both_parameter_sets() {
    let studies = files_in(&["pipelines"]);
    assert!(studies.len() > 10);
    for path in studies {
        for set in ["as-coded", "as-stated"] {
            let mut study = asperity_study::Study::read(&path).unwrap_or_else(|error| panic!("{error}"));
            let own = study.parameter_sets();
            assert!(!own.contains("the default"), "{}: {own}", short(&path));
            study.set(&[format!("parameter_set={set}")]);
            assert!(!study.runs.is_empty() || study.count() > 0, "{}", short(&path));
            study.jobs().unwrap_or_else(|problem| panic!("{}: {problem}", short(&path)));
        }
    }
}
