//! Computes the code version: a hash over the sources that shape a trajectory
//! and the events found in it. Runs made by the same code version are the same
//! runs; a change to a figure or to the command line leaves it as it is.

use std::fs;
use std::path::{Path, PathBuf};

/// The crates whose sources decide what a run gives.
const CRATES: [&str; 7] =
    ["record", "model", "simulator", "detect", "detect-onset", "detect-extent", "detect-global"];

/// The dependency whose functions enter initial states.
const DEPENDENCY: &str = "libm";

fn main() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut sources = Vec::new();
    for name in CRATES {
        let directory = workspace.join("crates").join(name).join("src");
        println!("cargo::rerun-if-changed={}", directory.display());
        collect(&directory, &mut sources);
    }
    sources.sort();
    let mut hasher = blake3::Hasher::new();
    for source in &sources {
        let name = source.strip_prefix(&workspace).expect("sources lie in the workspace");
        let content = fs::read(source).expect("sources can be read");
        hasher.update(name.to_string_lossy().as_bytes()).update(&[0]);
        hasher.update(&(content.len() as u64).to_le_bytes()).update(&content);
    }
    let lock = workspace.join("Cargo.lock");
    println!("cargo::rerun-if-changed={}", lock.display());
    let lock = fs::read_to_string(lock).expect("Cargo.lock can be read");
    let package = format!("name = \"{DEPENDENCY}\"\n");
    let version = lock.split(&package).nth(1).and_then(|rest| rest.lines().next());
    hasher.update(version.expect("Cargo.lock names the dependency").as_bytes());
    println!("cargo::rustc-env=ASPERITY_CODE_VERSION={}", &hasher.finalize().to_hex()[..16]);
}

fn collect(directory: &Path, sources: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(directory).expect("source folders can be read") {
        let path = entry.expect("source folders can be read").path();
        if path.is_dir() {
            collect(&path, sources);
        } else {
            sources.push(path);
        }
    }
}
