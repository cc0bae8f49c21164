//! The one writer of files: tables, pages, figures, records and run logs all get their names here.
//! It also opens the inputs of commands.
//!
//! A file is renamed to its name once it is complete, and files that belong together are renamed
//! together. Until then they are in a temporary folder beside their names, locked while its process
//! lives. Two processes therefore never share a file, and the leftovers of a killed process are
//! recognised and removed. Existing files are replaced only on request, inputs of the same command
//! never.
//!
//! ```
//! use asperity_files::{Existing, FileError, FileSet, Inputs};
//!
//! # let folder = tempfile::tempdir()?;
//! # let [log, table, record] = ["run.mcap", "run.csv", "run.json"].map(|name| folder.path().join(name));
//! # let write = || {
//! let files = FileSet::new(Existing::Refuse, Inputs::of([&log]));
//! files.write(&table, "time_s,ft_fn\n")?;
//! // The file that lists the others comes last.
//! files.write_record(&record, "{\"tables\":[\"run.csv\"]}\n")?;
//! assert!(!table.exists());
//! files.publish()
//! # };
//! # write()?;
//! assert!(table.exists() && record.exists());
//! // The second time they exist.
//! assert!(matches!(write(), Err(FileError::Exists(path)) if path == table));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In reading order:
//!
//! - `error`: reasons why a file is not written.
//! - `identity`, `place`: the identity of a file, independent of its names; the place of a name.
//! - [`Inputs`]: files that are never overwritten.
//! - `lock`, `rename`: exclude other processes, and rename atomically.
//! - [`FileSet`], in a `stage`: files that appear together or not at all.
//! - [`better_name`]: refuses outputs whose names denote another format.
//! - [`open()`]: opens the inputs of commands, which must be files; [`ShortLines`] bounds their lines; [`fill`] reads on
//!   after a signal.
//! - [`UntilRefused`]: a writer that stops at the first refused write.
//! - [`at_once()`]: jobs on all processors, most of which read and write files.
//! - [`PartlyHashed`]: the hash of a file, most of which is hashed where it is read for another purpose.
//! - [`LockedFile`]: a file with a name known to others while it is written, such as an unfinished
//!   run log; [`FolderLock`]: a folder that one process at a time writes into.

mod at_once;
mod error;
mod hash;
mod identity;
mod inputs;
mod lines;
mod lock;
mod locked_file;
mod names;
mod open;
mod place;
mod rename;
mod set;
mod stage;
mod until_refused;

pub use at_once::at_once;
pub use error::FileError;
pub use hash::{Hashing, PartlyHashed};
pub use inputs::{Inputs, partial_path};
pub use lines::{ShortLines, fill};
pub use lock::is_being_written;
pub use locked_file::{FolderLock, LockedFile};
pub use names::{better_name, format_of};
pub use open::{NoFile, entries, open, open_text, read, read_if_there};
pub use place::is_taken;
pub use rename::Existing;
pub use set::FileSet;
pub use stage::is_new_folder;
pub use until_refused::{Refusal, UntilRefused};

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rename::sync_folder_of;

/// What is written first and read then: in memory, or beyond so many bytes in a file without a name in the folder for
/// temporary files.
pub fn spool(in_memory_bytes: usize) -> Spool {
    tempfile::spooled_tempfile(in_memory_bytes)
}

/// See [`spool`].
pub type Spool = tempfile::SpooledTempFile;

/// Removes a file that belonged to what others have replaced.
///
/// # Errors
/// If the system refuses.
pub fn remove_file(path: &Path) -> Result<(), FileError> {
    fs::remove_file(path).map_err(FileError::io(path))
}

/// Creates a folder and its missing parents, and syncs their names, so that they survive a power cut.
/// Returns the new ones, parents first.
///
/// # Errors
/// If a file is in its place or in that of a parent, or the system refuses.
pub fn create_folder(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let is_new = |folder: &&Path| !folder.as_os_str().is_empty() && !is_taken(folder);
    let mut new: Vec<PathBuf> = folder.ancestors().take_while(is_new).map(Path::to_owned).collect();
    new.reverse();
    fs::create_dir_all(folder).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => FileError::NoFile { path: folder.to_owned(), what: "no folder" },
        _ => FileError::io(folder)(error),
    })?;
    new.iter().try_for_each(|folder| sync_folder_of(folder))?;
    Ok(new)
}
