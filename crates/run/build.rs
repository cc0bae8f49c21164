//! Computes the code version, see `src/code_version.rs`.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

#[path = "src/code_version.rs"]
mod code_version;

fn main() {
    // Read when the script runs, because a checkout may be moved or copied together with its build.
    let this = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo says where the crate is"));
    let name = this.file_name().expect("the crate has a folder").to_string_lossy().into_owned();
    let workspace = fs::canonicalize(this.join("../..")).expect("the workspace is there");
    let rustc = rustc();
    if !workspace.join("Cargo.toml").exists() {
        return of_release(&rustc);
    }
    let inputs = match code_version::Inputs::of(&workspace, &name, &rustc) {
        Ok(inputs) => inputs,
        Err(error) => panic!("the code version cannot be made: {error}"),
    };
    let mut of_recordings = code_version::Inputs::of(&workspace, "recording", &rustc).expect("as that one");
    of_recordings.files.extend(inputs.files.clone());
    of_recordings.words.extend(inputs.words.clone());
    // Paths relative to this crate, so that a copy watches its own files. Cargo watches folders
    // recursively.
    let crates: BTreeSet<&str> =
        of_recordings.files.keys().filter_map(|name| name.split('/').nth(1)).collect();
    for name in crates {
        println!("cargo::rerun-if-changed=../{name}/src");
        println!("cargo::rerun-if-changed=../{name}/Cargo.toml");
    }
    println!("cargo::rerun-if-changed=../../Cargo.toml");
    println!("cargo::rerun-if-changed=../../Cargo.lock");
    println!("cargo::rustc-env=ASPERITY_RUSTC={rustc}");
    for (name, inputs) in [("CODE_VERSION", inputs), ("RECORDING_CODE_VERSION", of_recordings)] {
        let version = inputs.version().expect("the sources can be read");
        println!("cargo::rustc-env=ASPERITY_{name}={version}");
    }
}

/// A package from a registry has no workspace around it: its release names what it is built of, but for packages of others.
fn of_release(rustc: &str) {
    let release = env::var("CARGO_PKG_VERSION").expect("cargo says which release it is");
    println!("cargo::rustc-env=ASPERITY_RUSTC={rustc}");
    for name in ["CODE_VERSION", "RECORDING_CODE_VERSION"] {
        let words = [("release", &*release), ("rustc", rustc)].map(|(name, word)| (name.into(), word.into()));
        let inputs = code_version::Inputs { files: [].into(), words: words.into() };
        println!("cargo::rustc-env=ASPERITY_{name}={}", inputs.version().expect("no file is read"));
    }
}

/// The compiler's name, version and revision, without host information.
fn rustc() -> String {
    let rustc = env::var_os("RUSTC").expect("cargo says which compiler it calls");
    let output = Command::new(rustc).arg("--version").output().expect("the compiler starts");
    String::from_utf8_lossy(&output.stdout).trim().to_owned()
}
