//! The golden tables: their paths, their hashes, and the record of accepted changes. The test and
//! `cargo xtask golden` share it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The tables, from the root of the workspace: one CSV file per run of chapter 5.
pub(crate) const TABLES: &str = "fixtures/golden/chapter5";
/// Every change of them that was accepted, the newest first.
pub(crate) const CHANGES: &str = "fixtures/golden/CHANGES.md";
/// The start of an entry.
pub(crate) const ENTRY: &str = "## Tables ";

/// A hash over the names and contents of the tables in a folder.
///
/// # Errors
/// If one cannot be read.
pub(crate) fn signature(folder: &Path) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    for path in tables(folder)? {
        let content = fs::read(&path)?;
        let name = path.file_name().unwrap_or_default();
        hasher.update(name.as_encoded_bytes()).update(&[0]);
        hasher.update(&(content.len() as u64).to_le_bytes()).update(&content);
    }
    Ok(hasher.finalize().to_hex()[..16].to_owned())
}

/// The tables in a folder, by name.
///
/// # Errors
/// If the folder cannot be read.
pub(crate) fn tables(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut paths: Vec<PathBuf> = entries.collect::<io::Result<_>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
    paths.sort();
    Ok(paths)
}

/// The signature in the newest entry of the record.
pub(crate) fn newest(changes: &str) -> Option<&str> {
    changes.lines().find_map(|line| line.strip_prefix(ENTRY)).and_then(|rest| rest.split(',').next())
}
