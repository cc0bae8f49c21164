//! Takes compiled dependencies over into a fresh target folder.
//!
//! Two revisions of this workspace share nearly all dependencies, and polars alone takes minutes. Cargo
//! accepts files compiled elsewhere if names and modification times agree; a package that a revision builds
//! differently has another name, and is built. The workspace's own crates are left out: those must be
//! compiled from the revision's sources.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// Prefix of the packages of this workspace.
const OURS: [&str; 2] = ["asperity", "xtask"];

/// Copies the compiled dependencies in `from`, a folder of one profile such as `target/debug`, unless `to` exists.
///
/// # Errors
/// If a file cannot be read or written.
pub(crate) fn dependencies(from: &Path, to: &Path) -> io::Result<()> {
    if to.exists() || !from.join("deps").is_dir() {
        return Ok(());
    }
    // Under its name only when it is whole: half of it would never be filled up.
    let partial = to.with_extension("partial");
    if partial.exists() {
        fs::remove_dir_all(&partial)?;
    }
    for folder in ["deps", "build", ".fingerprint"] {
        fs::create_dir_all(partial.join(folder))?;
        for entry in fs::read_dir(from.join(folder))? {
            let name = entry?.file_name();
            let [from, to] = [from, &partial].map(|profile| profile.join(folder).join(&name));
            let name = name.to_string_lossy();
            // Programs have no `lib` in front; all of them are this workspace's.
            let library = if folder == "deps" { name.strip_prefix("lib") } else { Some(&*name) };
            if library.is_none_or(|name| OURS.iter().any(|ours| name.starts_with(ours))) {
                continue;
            }
            // One library for both: compilers replace it and never write into it. Cargo does write into the others.
            if folder != "deps" || fs::hard_link(&from, &to).is_err() {
                copy(&from, &to)?;
            }
        }
    }
    fs::rename(&partial, to)
}

/// Copies a file or a folder with its contents; files keep their modification times, which cargo compares.
fn copy(from: &Path, to: &Path) -> io::Result<()> {
    if !from.is_dir() {
        fs::copy(from, to)?;
        return File::open(to)?.set_modified(fs::metadata(from)?.modified()?);
    }
    fs::create_dir_all(to)?;
    fs::read_dir(from)?.try_for_each(|entry| {
        let entry = entry?;
        copy(&entry.path(), &to.join(entry.file_name()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, SystemTime};

    #[test]
    fn dependencies_are_taken_over_with_their_times_and_our_own_crates_are_not() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let from = folder.path().join("present/debug");
        let to = folder.path().join("old/target/debug");
        let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000);
        let theirs = [
            "deps/libpolars-12.rlib",
            "deps/libpolars-12.rmeta",
            ".fingerprint/polars-12/lib-polars",
            "build/libc-3/out/flags",
        ];
        let ours = [
            "deps/libasperity_model-4.rlib",
            "deps/tidy-5",
            "deps/libxtask-6.rmeta",
            ".fingerprint/asperity-model-4/lib-asperity_model",
            "build/asperity-cli-7/output",
        ];
        for name in theirs.iter().chain(&ours) {
            let path = from.join(name);
            fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("folders can be made");
            fs::write(&path, name).expect("files can be written");
            let file = File::open(&path).expect("it is there");
            file.set_modified(long_ago).expect("times can be set");
        }
        dependencies(&from, &to).expect("all can be read");
        for name in theirs {
            let time = fs::metadata(to.join(name)).and_then(|metadata| metadata.modified());
            assert_eq!(time.expect("it was taken over"), long_ago, "{name}");
        }
        for name in ours {
            assert!(!to.join(name).exists(), "{name}");
        }
        // Files that cargo rewrites in one must not change in the other.
        fs::write(to.join(theirs[2]), "other").expect("files can be written");
        assert_eq!(fs::read_to_string(from.join(theirs[2])).expect("it is there"), theirs[2]);
        dependencies(&from, &to).expect("it is there");
        assert_eq!(
            fs::read_to_string(to.join(theirs[2])).expect("it is there"),
            "other",
            "only into a fresh folder"
        );
    }
}
