//! The one writer of files: every table, page, figure, record and run log of the project gets its
//! name here. What a command reads is opened here as well.
//!
//! A file gets its name once it is whole, and files that belong together get theirs together.
//! Until then they stand in a folder of their own beside their names, which is locked while its
//! process lives; so two processes never share a file, and what a killed one left behind is known
//! as such and removed. What exists is replaced only if that is asked for, what the same command
//! reads is never replaced, and a name is given only to the very file that was written.
//!
//! ```
//! use asperity_files::{Existing, FileError, FileSet, Inputs};
//!
//! # let folder = tempfile::tempdir()?;
//! # let [log, table, record] = ["run.mcap", "run.csv", "run.json"].map(|name| folder.path().join(name));
//! # let write = || {
//! let files = FileSet::new(Existing::Refuse, Inputs::of([&log]));
//! files.write(&table, "time_s,ft_fn\n")?;
//! // What says which files there are comes last.
//! files.write_record(&record, "{\"tables\":[\"run.csv\"]}\n")?;
//! assert!(!table.exists());
//! files.publish()
//! # };
//! # write()?;
//! assert!(table.exists() && record.exists());
//! // A second time they are there already.
//! assert!(matches!(write(), Err(FileError::Exists(path)) if path == table));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! In reading order:
//!
//! - `error`: why a file is not written.
//! - `identity`, `place`: which file it is, whatever its names are; where a name stands.
//! - [`Inputs`]: what is never written over.
//! - `lock`, `rename`: keeping processes apart, and giving a name.
//! - [`FileSet`], in a `stage`: files that appear together or not at all.
//! - [`open()`]: the one way to what a command reads, which is a file.
//! - [`LockedFile`]: a file that has a name while it is written, as an unfinished run log; [`FolderLock`]:
//!   a folder that one process at a time writes into.

mod error;
mod identity;
mod inputs;
mod lock;
mod locked_file;
mod open;
mod place;
mod rename;
mod set;
mod stage;

pub use error::FileError;
pub use inputs::{Inputs, partial_path};
pub use locked_file::{FolderLock, LockedFile};
pub use open::{NoFile, open, open_text, read};
pub use place::is_taken;
pub use rename::Existing;
pub use set::FileSet;
pub use stage::is_new_folder;

use std::fs;
use std::path::Path;

/// Makes sure that there is a folder, with those that it stands in.
///
/// # Errors
/// If the system refuses.
pub fn create_folder(folder: &Path) -> Result<(), FileError> {
    fs::create_dir_all(folder).map_err(|error| FileError::Folder { path: folder.to_owned(), error })
}
