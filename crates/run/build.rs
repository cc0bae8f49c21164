//! Computes the code version, see `src/code_version.rs`.

use std::path::PathBuf;
use std::{env, fs};

#[path = "src/code_version.rs"]
mod code_version;

fn main() {
    let this = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").expect("cargo says where the crate is"));
    let name = this.file_name().expect("the crate has a folder").to_string_lossy().into_owned();
    let workspace = this.join("../..").canonicalize().expect("the workspace is there");
    let sources = code_version::sources(&workspace, &name).expect("the workspace's sources can be read");
    let lock = workspace.join("Cargo.lock");
    // A new file shows in its folder, a new crate in a manifest.
    for path in sources.values() {
        println!("cargo::rerun-if-changed={}", path.display());
        println!("cargo::rerun-if-changed={}", path.parent().expect("files lie in folders").display());
    }
    println!("cargo::rerun-if-changed={}", lock.display());
    let lock = fs::read_to_string(lock).expect("Cargo.lock can be read");
    let version = code_version::hash(&sources, &lock).expect("sources can be read, and the lock names libm");
    println!("cargo::rustc-env=ASPERITY_CODE_VERSION={version}");
}
