//! Builds the `asperity` command of another revision, beside this checkout and
//! without touching it.
//!
//! Builds of a commit are kept under `target/diff-events`, since a commit does not change; its sources
//! exist only while they are compiled.

use std::env;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::Stdio;
use std::time::Instant;

use crate::git::{Commit, Repository};
use crate::interrupt;
use crate::say::say;
use crate::seed;
use crate::workspace::{Failure, cargo, target_folder};

/// The package that the command is built from, and its folder.
const PACKAGE: &str = "asperity-cli";
const PACKAGE_MANIFEST: &str = "crates/cli/Cargo.toml";

/// Where all of it is kept.
pub(crate) fn kept() -> PathBuf {
    target_folder().join("diff-events")
}

/// The folder for the files of one commit.
pub(crate) fn kept_of(commit: &Commit) -> PathBuf {
    kept().join(commit.short())
}

fn checkout_of(commit: &Commit) -> PathBuf {
    kept_of(commit).join(format!("checkout-{}", commit.short()))
}

/// The `asperity` command of a commit, built unless an earlier call has done it.
///
/// # Errors
/// If the revision has no such command, or does not build.
pub(crate) fn build(repository: &Repository, commit: &Commit) -> Result<PathBuf, Failure> {
    let folder = kept_of(commit);
    let io = |what: &str| {
        let what = format!("{what} {}", folder.display());
        move |error| Failure::Io { what, error }
    };
    if !repository.has(commit, PACKAGE_MANIFEST)? {
        return Err(Failure::Check(format!("{} has no asperity command", commit.title)));
    }
    fs::create_dir_all(&folder).map_err(io("create"))?;
    // Two calls at once would build in each other's checkout. The lock goes with the file.
    let lock = File::create(folder.join("lock")).map_err(io("write into"))?;
    lock.lock().map_err(io("lock"))?;

    let name = format!("asperity{}", env::consts::EXE_SUFFIX);
    let binary = folder.join(&name);
    if binary.exists() {
        say!("==> {}: built before", commit.title);
        return Ok(binary);
    }
    let started = Instant::now();
    let target = folder.join("target");
    let libraries = seed::dependencies(&target_folder().join("debug"), &target.join("debug"))
        .map_err(io("write into"))?;
    match libraries {
        0 => say!("==> {}: building", commit.title),
        _ => say!("==> {}: building, with {libraries} libraries of this checkout", commit.title),
    }
    interrupt::check()?;
    let checkout = repository.worktree(commit, &checkout_of(commit))?;
    let cargo = |arguments: &[&str]| {
        let mut cargo = cargo(arguments);
        cargo.args(["--locked", "--package", PACKAGE]);
        cargo.current_dir(checkout.folder()).env("CARGO_TARGET_DIR", &target);
        cargo
    };
    // Checked first: a build exits alike whether the network is missing or its sources fail.
    let mut resolved = cargo(&["tree", "--offline", "--edges", "normal,build"]);
    let is_at_hand = interrupt::run(resolved.stdout(Stdio::null()).stderr(Stdio::null())).is_ok();
    let mut build = cargo(&["build"]);
    if is_at_hand {
        build.arg("--offline");
    }
    interrupt::run(build.stdout(Stdio::null())).map_err(|failure| match failure {
        Failure::Exit { .. } => Failure::Check(format!(
            "{} does not build here; what cargo says stands above (accepted: a revision that builds with this \
             toolchain{})",
            commit.title,
            if is_at_hand { "" } else { ", and the network, for dependencies that are not at hand" }
        )),
        other => other,
    })?;
    // Under its name only when it is whole.
    let partial = folder.join(format!("{name}.partial"));
    fs::copy(target.join("debug").join(&name), &partial)
        .and_then(|_bytes| fs::rename(&partial, &binary))
        .map_err(io("write into"))?;
    say!("==> {}: built in {:.0} s", commit.title, started.elapsed().as_secs_f64());
    Ok(binary)
}

/// Removes the files kept of one commit, or of all.
pub(crate) fn clean(repository: &Repository, commit: Option<&Commit>) -> Result<(), Failure> {
    let folder = commit.map_or_else(kept, kept_of);
    // A killed call may have left checkouts, which git would continue to list.
    let there = match fs::read_dir(kept()) {
        Ok(entries) => entries.collect::<Result<Vec<_>, _>>(),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => Err(error),
    };
    let there = there.map_err(|error| Failure::Io { what: format!("read {}", kept().display()), error })?;
    for entry in there {
        let path = entry.path();
        if path.starts_with(&folder) {
            let name = entry.file_name().to_string_lossy().into_owned();
            repository.forget_worktree(&path.join(format!("checkout-{name}")))?;
        }
    }
    match fs::remove_dir_all(&folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::Io { what: format!("remove {}", folder.display()), error })
        }
        _ => Ok(()),
    }
}
