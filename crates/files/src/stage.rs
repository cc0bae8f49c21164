//! Temporary folders beside the final names, for files of one process until they are renamed.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::lock::{Held, is_locked, open_folder};
use crate::open::entries;
use crate::place::is_taken;

/// The prefix of such a folder's name; random letters and digits follow.
const PREFIX: &str = ".asperity-";
/// Number of random characters.
const RANDOM: usize = 8;

/// A temporary folder, locked while this value lives, and removed with its contents.
#[derive(Debug)]
pub(crate) struct Stage {
    /// The parent folder, which the files are renamed into.
    pub(crate) folder: PathBuf,
    path: PathBuf,
    /// Open to keep the lock; None where folders cannot be opened.
    _lock: Option<Held>,
}

impl Stage {
    /// Creates one in a folder, and removes those of dead processes.
    pub(crate) fn begin(folder: &Path) -> io::Result<Stage> {
        remove_leftovers(folder);
        loop {
            let made = tempfile::Builder::new().prefix(PREFIX).rand_bytes(RANDOM).tempdir_in(folder)?;
            let path = made.keep();
            // Before it is locked, another process may take it for a leftover and remove it.
            let lock = match open_folder(&path) {
                Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
                lock => lock.inspect_err(|_| drop(fs::remove_dir(&path)))?,
            };
            if lock.as_ref().is_none_or(|lock| !is_locked(lock.0.try_lock())) && is_taken(&path) {
                return Ok(Stage { folder: folder.to_owned(), path, _lock: lock });
            }
        }
    }

    /// The temporary path of a file with that name.
    pub(crate) fn path(&self, name: &OsStr) -> PathBuf {
        self.path.join(name)
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        // Another process removes what remains.
        fs::remove_dir_all(&self.path).ok();
    }
}

/// Removes leftovers of dead processes in a folder. A free lock proves that the process is dead;
/// without locks nothing is removed.
fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten().filter(|entry| is_name(&entry.file_name())) {
        // Opening a named pipe would block.
        if !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let path = entry.path();
        let Ok(open) = File::open(&path).map(Held) else { continue };
        if open.0.try_lock().is_ok() && holds_files_alone(&path) {
            fs::remove_dir_all(&path).ok();
        }
    }
}

/// Whether a path is free or an empty folder. Temporary folders in it, of live or dead processes,
/// do not count.
///
/// # Errors
/// If something other than a folder is there, or the system refuses.
pub fn is_new_folder(path: &Path) -> io::Result<bool> {
    match entries(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        entries => Ok(entries?.iter().all(|entry| is_name(&entry.file_name()))),
    }
}

fn is_name(name: &OsStr) -> bool {
    let random = name.to_str().and_then(|name| name.strip_prefix(PREFIX));
    random.is_some_and(|random| random.len() == RANDOM && random.bytes().all(|c| c.is_ascii_alphanumeric()))
}

/// Whether a path is a folder that contains only files.
fn holds_files_alone(path: &Path) -> bool {
    let Ok(mut entries) = fs::read_dir(path) else { return false };
    entries.all(|entry| entry.and_then(|entry| entry.file_type()).is_ok_and(|kind| kind.is_file()))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{Stage, is_new_folder};

    #[test]
    fn leftovers_of_the_dead_are_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let living = Stage::begin(folder.path()).unwrap();
        fs::write(living.path("table.csv".as_ref()), "half").unwrap();
        // A killed process releases its lock and leaves the rest.
        let dead = path(".asperity-abcdEFG1");
        fs::create_dir(&dead).unwrap();
        fs::write(dead.join("table.csv"), "half").unwrap();
        let foreign = [".asperity-abc", ".asperity-abcdefgh.txt", ".asperity-abcdefg-", "asperity-abcdefgh"];
        for name in foreign {
            fs::create_dir(path(name)).unwrap();
        }
        fs::write(path(".asperity-file1234"), "a file").unwrap();
        fs::create_dir_all(path(".asperity-folders1/inside")).unwrap();

        let second = Stage::begin(folder.path()).unwrap();
        assert!(!dead.exists());
        assert!(!is_new_folder(folder.path()).unwrap());
        assert!(living.path("table.csv".as_ref()).exists());
        drop(second);
        drop(living);
        let mut left: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort();
        let mut expected = [&foreign[..], &[".asperity-file1234", ".asperity-folders1"]].concat();
        expected.sort_unstable();
        assert_eq!(left, expected);
    }
}
