//! Renames a file to its final name.

use std::fs;
use std::io;
use std::path::Path;

use tempfile::TempPath;

use crate::error::FileError;
use crate::lock::open_folder;
use crate::place::{folder_of, is_taken};

/// What to do with an existing file of the new name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Existing {
    /// Keep it, and refuse the new name.
    #[default]
    Refuse,
    /// Replace it once the new file is complete. A link is replaced itself; its target stays.
    Replace,
}

/// Renames atomically; with [`Existing::Refuse`], fails if the target exists.
pub(crate) fn rename(from: &Path, to: &Path, existing: Existing) -> Result<(), FileError> {
    let at = FileError::io(to);
    if existing == Existing::Replace {
        return fs::rename(from, to).map_err(at);
    }
    let mut file = TempPath::try_from_path(from).map_err(&at)?;
    file.disable_cleanup(true);
    match file.persist_noclobber(to) {
        Ok(()) => Ok(()),
        Err(_) if is_taken(to) => Err(FileError::Exists(to.to_owned())),
        // Some file systems support neither such a rename nor hard links.
        Err(refused) if refused.error.kind() != io::ErrorKind::NotFound => fs::rename(from, to).map_err(at),
        Err(refused) => Err(at(refused.error)),
    }
}

/// Syncs a folder, so that new names in it survive a crash of the machine; does nothing where folders cannot be opened.
pub(crate) fn sync_folder(folder: &Path) -> Result<(), FileError> {
    let synced = open_folder(folder).and_then(|open| open.map_or(Ok(()), |open| open.0.sync_all()));
    synced.map_err(FileError::io(folder))
}

/// Syncs the folder of a path.
pub(crate) fn sync_folder_of(path: &Path) -> Result<(), FileError> {
    sync_folder(folder_of(path))
}
