//! The build script of `crates/run` in a workspace of a few lines, built by cargo: the code
//! version is that of the sources beside the script, wherever a checkout is moved or copied to
//! with all that was built of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A hash that is quick to compile replaces BLAKE3; these tests are about files.
const HASHER: &str = "\
use std::hash::Hasher as _;
pub struct Hasher(std::hash::DefaultHasher);
pub struct Hash(u64);
impl Hasher {
    pub fn new() -> Hasher { Hasher(std::hash::DefaultHasher::new()) }
    pub fn update(&mut self, bytes: &[u8]) -> &mut Hasher { self.0.write(bytes); self }
    pub fn finalize(&self) -> Hash { Hash(self.0.finish()) }
}
impl Hash {
    pub fn to_hex(&self) -> String { format!(\"{0:016x}{0:016x}\", self.0) }
}
";

const MANIFEST: &str = "\
[workspace]
resolver = \"3\"
members = [\"crates/*\"]

[workspace.dependencies]
asperity-detect-new = { path = \"crates/detect-new\" }
asperity-stream = { path = \"crates/stream\" }
blake3 = { path = \"crates/blake3\" }
";

const MAIN: &str = "\
fn main() { print!(\"{} {}\", env!(\"ASPERITY_CODE_VERSION\"), env!(\"ASPERITY_RECORDING_CODE_VERSION\")); }
";

fn write(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().expect("files lie in folders")).expect("folders can be made");
    fs::write(path, text).expect("files can be written");
}

fn manifest(name: &str, uses: &str) -> String {
    let package = format!("[package]\nname = \"{name}\"\nversion = \"0.1.0\"\nedition = \"2024\"\n");
    match uses {
        "" => package,
        uses => format!("{package}\n[dependencies]\n{uses}\n[build-dependencies]\nblake3.workspace = true\n"),
    }
}

/// A workspace whose program prints its code version, and that of recordings.
fn make(workspace: &Path) {
    let run = Path::new(env!("CARGO_MANIFEST_DIR")).join("../run");
    let at = |name: &str| workspace.join("crates").join(name);
    write(&workspace.join("Cargo.toml"), MANIFEST);
    for (folder, package) in [
        ("stream", "asperity-stream"),
        ("detect-new", "asperity-detect-new"),
        ("figures", "asperity-figures"),
        ("recording", "asperity-recording"),
    ] {
        write(&at(folder).join("Cargo.toml"), &manifest(package, ""));
        write(&at(folder).join("src/lib.rs"), "// As it was.\n");
    }
    write(&at("blake3/Cargo.toml"), &manifest("blake3", ""));
    write(&at("blake3/src/lib.rs"), HASHER);
    write(&at("run/Cargo.toml"), &manifest("asperity-run", "asperity-stream.workspace = true\n"));
    write(&at("run/src/main.rs"), MAIN);
    for file in ["build.rs", "src/code_version.rs"] {
        fs::copy(run.join(file), at("run").join(file)).expect("the build script can be copied");
    }
}

/// Builds the changes, and runs the program.
fn version(workspace: &Path) -> String {
    let output = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--offline", "--package", "asperity-run"])
        .current_dir(workspace)
        .env("CARGO_TARGET_DIR", workspace.join("target"))
        .output()
        .expect("cargo starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    String::from_utf8(output.stdout).expect("the version is text")
}

/// With the modification times of the files, which cargo uses to detect changes.
fn copy(from: &Path, to: &Path) {
    let status = Command::new("cp").arg("-a").args([from, to]).status().expect("cp starts");
    assert!(status.success());
}

#[test]
fn it_is_that_of_the_sources_beside_it_in_copies_and_moved_checkouts() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let [original, copied, moved]: [PathBuf; 3] =
        ["original", "copied", "moved"].map(|name| folder.path().join(name));
    make(&original);
    let before = version(&original);
    assert_eq!(before.len(), 16 + 1 + 16, "{before}");

    copy(&original, &copied);
    write(&copied.join("crates/stream/src/lib.rs"), "// Another stream.\n");
    let other = version(&copied);
    assert_ne!(other, before, "a copy has its own sources");
    assert_eq!(version(&original), before, "which are not those of the original");

    fs::rename(&original, &moved).expect("a folder can be moved");
    assert_eq!(version(&moved), before);
    write(&moved.join("crates/figures/src/lib.rs"), "// Another figure.\n");
    assert_eq!(version(&moved), before, "a figure shapes no run");
    write(&moved.join("crates/recording/src/lib.rs"), "// Another recording.\n");
    let of_recordings = version(&moved);
    assert!(
        of_recordings != before && of_recordings[..16] == before[..16],
        "a recording shapes its own log alone"
    );
    write(&moved.join("crates/recording/src/lib.rs"), "// As it was.\n");
    write(&moved.join("crates/stream/src/lib.rs"), "// Another stream.\n");
    assert_eq!(version(&moved), other, "the same sources, in another folder");

    let uses = "asperity-detect-new.workspace = true\nasperity-stream.workspace = true\n";
    write(&moved.join("crates/run/Cargo.toml"), &manifest("asperity-run", uses));
    let with = version(&moved);
    assert_ne!(with, other, "a detector was added");
    write(&moved.join("crates/detect-new/src/lib.rs"), "// Another detector.\n");
    assert_ne!(version(&moved), with, "and changed");
}

/// What a registry gives has no workspace, and was not compiled.
#[test]
fn a_package_from_a_registry_has_that_of_its_release() {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    make(folder.path());
    let package = folder.path().join("crates/run");
    let of_release = |release: &str| {
        let uses = "blake3 = { path = \"../blake3\" }\n";
        let text = format!("{}[build-dependencies]\n{uses}[workspace]\n", manifest("asperity-run", ""));
        write(&package.join("Cargo.toml"), &text.replace("0.1.0", release));
        version(&package)
    };
    fs::remove_file(folder.path().join("Cargo.toml")).expect("it was made");
    let first = of_release("0.1.0");
    write(&package.join("src/lib.rs"), "// More.\n");
    assert_eq!(of_release("0.1.0"), first);
    assert_ne!(of_release("0.1.1"), first);
}
