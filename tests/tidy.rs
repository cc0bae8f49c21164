//! The house rules that no compiler checks: which crate may use which, where
//! dependencies and their features stand, and that the pages tell the truth.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use asperity_model::{Scenario, ScenarioSource, builtin};
use serde_json::Value;

/// Which crates of the workspace each may use, in its library or binary and its
/// build script. A new crate needs a line here and a paragraph in ARCHITECTURE.md.
const MAY_USE: &[(&str, &[&str])] = &[
    ("record", &[]),
    ("model", &["record"]),
    ("simulator", &["record", "model"]),
    ("detect", &["record"]),
    ("detect-onset", &["record", "detect"]),
    ("detect-extent", &["record", "detect"]),
    ("detect-global", &["record", "detect"]),
    ("stream", &["record", "detect"]),
    ("runlog", &["record"]),
    ("export", &["record", "runlog"]),
    ("analysis", &["record", "runlog", "model", "export", "stream"]),
    ("diff", &["record"]),
    ("compare", &["record", "runlog", "analysis", "diff"]),
    (
        "cli",
        &[
            "record",
            "model",
            "simulator",
            "detect",
            "detect-onset",
            "detect-extent",
            "detect-global",
            "stream",
            "runlog",
            "export",
            "analysis",
            "diff",
            "compare",
        ],
    ),
    ("xtask", &[]),
];

/// Dependencies that one crate wraps for all others.
const WRAPPED: &[(&str, &str)] =
    &[("crossbeam-channel", "stream"), ("mcap", "runlog"), ("polars", "analysis"), ("plotters", "analysis")];

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
    /// What its library, binary or build script depends on.
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

#[test]
fn arrows_between_crates_are_those_of_the_map() {
    let map: BTreeMap<&str, &[&str]> = MAY_USE.iter().copied().collect();
    let members = members();
    let names: BTreeSet<&str> = members.iter().map(|member| member.name.as_str()).collect();
    assert_eq!(names, map.keys().copied().collect(), "the map names other crates than the workspace has");
    for member in &members {
        for used in member.uses.iter().map(|package| short_name(package)) {
            let is_ours = names.contains(used.as_str());
            let may = map[member.name.as_str()].contains(&used.as_str());
            assert!(!is_ours || may, "{} uses {used} (see MAY_USE)", member.name);
        }
    }
}

#[test]
fn wrapped_dependencies_have_one_user() {
    let members = members();
    for (dependency, wrapper) in WRAPPED {
        let users: Vec<&str> = members
            .iter()
            .filter(|member| member.uses.contains(*dependency))
            .map(|member| member.name.as_str())
            .collect();
        assert_eq!(users, [*wrapper], "users of {dependency}");
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
                let analysis = matches!(member.name.as_str(), "cli" | "compare")
                    && name == "asperity-analysis"
                    && keys == Some(BTreeSet::from(["workspace", "optional"]));
                assert!(
                    plain || analysis,
                    "{}: {name} = {dependency} (accepted: workspace = true)",
                    member.name
                );
            }
        }
    }
}

#[test]
fn every_source_file_says_what_it_is_for() {
    for path in files_in(&["crates", "tests", "xtask"]) {
        if path.extension().is_some_and(|extension| extension == "rs") {
            assert!(read(&path).starts_with("//! "), "{} does not open with //!", short(&path));
        }
    }
}

/// Cargo does not look into the tests folder of a virtual workspace.
#[test]
fn every_root_test_is_declared() {
    let manifest: toml::Table =
        read(&root().join("crates/cli/Cargo.toml")).parse().expect("a manifest is TOML");
    let declared: BTreeSet<&str> = manifest["test"]
        .as_array()
        .expect("tests are declared")
        .iter()
        .map(|test| test["path"].as_str().expect("a declared test has a path"))
        .collect();
    for entry in fs::read_dir(root().join("tests")).expect("the folder is there") {
        let path = entry.expect("the folder can be read").path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            let expected = format!("../../{}", short(&path));
            assert!(
                declared.contains(&*expected),
                "crates/cli/Cargo.toml lacks [[test]] path = {expected:?}"
            );
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
}

/// The repository stands alone; a path out of it means nothing to its readers.
#[test]
fn nothing_points_out_of_the_repository() {
    // Put together here, or this file would be the first to fail.
    let foreign = [concat!("..", "/shared"), concat!("/wo", "rk/")];
    let parts = [
        ".cargo",
        ".ci",
        "ARCHITECTURE.md",
        "Cargo.toml",
        "README.md",
        "crates",
        "fixtures",
        "pipelines",
        "tests",
        "xtask",
    ];
    for path in files_in(&parts) {
        // What is no text cannot be read by those whom a path would mislead.
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

#[cfg(feature = "analysis")]
#[test]
fn every_pipeline_resolves_in_both_parameter_sets() {
    let pipelines = files_in(&["pipelines"]);
    assert!(!pipelines.is_empty());
    for path in pipelines {
        let pipeline = asperity_analysis::pipeline::Pipeline::parse(&read(&path))
            .unwrap_or_else(|error| panic!("{}: {error}", short(&path)));
        for run in &pipeline.run {
            let text = builtin::find(&run.scenario)
                .map_or_else(|| read(&root().join(&run.scenario)), ToOwned::to_owned);
            for set in ["as-coded", "as-stated"] {
                let source = ScenarioSource::new(&run.scenario, &text);
                let source =
                    run.set.iter().fold(source, |source, assignment| source.with_override(assignment));
                let source = source.with_override(&format!("parameter_set={set}"));
                Scenario::resolve(&source)
                    .unwrap_or_else(|errors| panic!("{}: run {}: {errors}", short(&path), run.name));
            }
        }
    }
}
