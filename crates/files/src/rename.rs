//! Giving a file its name.

use std::fs;
use std::io;
use std::path::Path;

use tempfile::TempPath;

use crate::error::FileError;
use crate::lock::open_folder;
use crate::place::{folder_of, is_taken};

/// What becomes of a file that has the name which another is to get.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Existing {
    /// It stays, and the other does not get the name.
    #[default]
    Refuse,
    /// It is replaced, once the other is whole. Of a link, the link is replaced; what it leads to
    /// stays.
    Replace,
}

/// Gives a file another name. Whether that is free is asked and answered in one with taking it.
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
        // Some file systems neither know such a renaming nor two names of one file.
        Err(refused) if refused.error.kind() != io::ErrorKind::NotFound => fs::rename(from, to).map_err(at),
        Err(refused) => Err(at(refused.error)),
    }
}

/// Sees to it that new names in the folder of a path outlive a crash of the machine, where folders
/// can be opened.
pub(crate) fn sync_folder_of(path: &Path) -> Result<(), FileError> {
    let folder = open_folder(folder_of(path)).map_err(FileError::io(path))?;
    folder.map_or(Ok(()), |folder| folder.sync_all()).map_err(FileError::io(path))
}
