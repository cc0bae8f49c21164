//! Logs in progress: under a temporary name, locked, until they are whole.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::{
    Existing, FileError, FileSet, Inputs, LockedFile, create_folder, is_taken, partial_path,
};
use asperity_record::RunHeader;

use crate::ahead::Ahead;
use crate::problem::{LogError, LogProblem, NoRunLog, WriteError};
use crate::read::RunReader;
use crate::records::Records;

/// The temporary path of a resumed run, until its log contains everything of the unfinished one.
fn resumed_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".resumed");
    path.with_file_name(name)
}

/// An unfinished log, locked against other processes while this value lives.
#[derive(Debug)]
pub struct Unfinished {
    path: PathBuf,
    locked: LockedFile,
}

impl Unfinished {
    /// Opens and locks the unfinished log for `path`, if there is one.
    ///
    /// # Errors
    /// If another process writes it, it is a link or not a run log, or the system refuses.
    pub fn of(path: &Path) -> Result<Option<Unfinished>, WriteError> {
        let Some(locked) = LockedFile::open(&partial_path(path))? else { return Ok(None) };
        must_be_ours(locked.path())?;
        Ok(Some(Unfinished { path: path.to_owned(), locked }))
    }

    /// Its temporary path.
    pub fn partial_path(&self) -> PathBuf {
        self.locked.path().to_owned()
    }

    /// The header and the scenario of its run; none if it ends before them.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn begun(&self) -> Result<Option<(RunHeader, String)>, LogError> {
        RunReader::head_of(self.locked.path())
    }

    /// Removes it, and the leftover of another run that resumed from it.
    ///
    /// # Errors
    /// If another process writes that, its name was lost, or the system refuses.
    pub fn remove(self) -> Result<(), WriteError> {
        if let Some(resumed) = LockedFile::open(&resumed_path(&self.path))? {
            must_be_ours(resumed.path())?;
            resumed.remove()?;
        }
        Ok(self.locked.remove()?)
    }

    /// Renames it to its final name, which is reserved for whole logs.
    ///
    /// # Errors
    /// If a log there must not be replaced, the temporary name no longer belongs to it, or the
    /// system refuses.
    pub fn publish(mut self, existing: Existing) -> Result<(), WriteError> {
        let file = self.locked.file().sync_all();
        file.map_err(|error| WriteError::io(self.locked.path(), error))?;
        Ok(self.locked.rename(&self.path, existing)?)
    }
}

/// The place of a log being written, and its way to the final name.
#[derive(Debug)]
pub(crate) struct Place {
    path: PathBuf,
    existing: Existing,
    stand: Stand,
}

#[derive(Debug)]
enum Stand {
    /// Under the temporary name from which a run can be resumed.
    Found {
        locked: LockedFile,
        /// The unfinished log that this one replaces once it contains as much.
        takes_place_of: Option<Unfinished>,
    },
    /// In a temporary folder, for logs that are never resumed.
    Hidden { files: FileSet, file: File },
}

impl Place {
    /// The place of a run's log. Truncates what an earlier run left there.
    pub(crate) fn of_run(path: &Path, existing: Existing) -> Result<Place, WriteError> {
        must_be_free(path, existing)?;
        let locked = emptied(&partial_path(path))?;
        // The previous owner of the lock may have finished.
        if let Err(error) = must_be_free(path, existing) {
            locked.remove()?;
            return Err(error);
        }
        let stand = Stand::Found { locked, takes_place_of: None };
        Ok(Place { path: path.to_owned(), existing, stand })
    }

    /// The place of a resumed run's log.
    pub(crate) fn resuming(unfinished: Unfinished, existing: Existing) -> Result<Place, WriteError> {
        let path = unfinished.path.clone();
        must_be_free(&path, existing)?;
        let locked = emptied(&resumed_path(&path))?;
        Ok(Place { path, existing, stand: Stand::Found { locked, takes_place_of: Some(unfinished) } })
    }

    /// The place of a log derived from another, which is never resumed.
    pub(crate) fn hidden(path: &Path, input: &Path) -> Result<Place, WriteError> {
        let existing = Existing::Refuse;
        let files = FileSet::new(existing, Inputs::of([input]));
        let file = files.create(path)?;
        Ok(Place { path: path.to_owned(), existing, stand: Stand::Hidden { files, file } })
    }

    /// The path to report in errors.
    pub(crate) fn path(&self) -> &Path {
        match &self.stand {
            Stand::Found { locked, .. } => locked.path(),
            Stand::Hidden { .. } => &self.path,
        }
    }

    fn file(&self) -> &File {
        match &self.stand {
            Stand::Found { locked, .. } => locked.file(),
            Stand::Hidden { file, .. } => file,
        }
    }

    /// The file, positioned at its beginning.
    pub(crate) fn writer(&self) -> Result<File, WriteError> {
        self.file().try_clone().map_err(|error| self.io(error))
    }

    /// Syncs the file to disk and checks that it still has its name: a run whose log is lost should
    /// fail soon.
    pub(crate) fn sync(&mut self) -> Result<(), WriteError> {
        match &mut self.stand {
            Stand::Found { locked, .. } => {
                locked.sync()?;
                Ok(locked.check()?)
            }
            // It is synced when it gets its name.
            Stand::Hidden { .. } => Ok(()),
        }
    }

    /// Replaces the unfinished log, once this one contains as much.
    pub(crate) fn has_caught_up(&mut self) -> Result<(), WriteError> {
        if let Stand::Found { locked, takes_place_of } = &mut self.stand
            && let Some(unfinished) = takes_place_of.take()
        {
            unfinished.locked.check()?;
            locked.rename(unfinished.locked.path(), Existing::Replace)?;
        }
        Ok(())
    }

    /// Leaves the log for a later run to resume from, unless it contains less than the one it
    /// resumed from.
    pub(crate) fn leave(self) -> Result<(), WriteError> {
        match self.stand {
            Stand::Found { locked, takes_place_of: Some(_) } => Ok(locked.remove()?),
            Stand::Found { mut locked, takes_place_of: None } => {
                locked.sync()?;
                Ok(locked.check()?)
            }
            Stand::Hidden { .. } => Ok(()),
        }
    }

    /// Removes the log.
    pub(crate) fn discard(&self) -> Result<(), WriteError> {
        match &self.stand {
            Stand::Found { locked, .. } => Ok(locked.remove()?),
            // Removed when it is dropped.
            Stand::Hidden { .. } => Ok(()),
        }
    }

    /// Renames it to its final name.
    pub(crate) fn publish(self) -> Result<(), WriteError> {
        self.file().sync_all().map_err(|error| self.io(error))?;
        match self.stand {
            Stand::Found { mut locked, takes_place_of } => {
                locked.rename(&self.path, self.existing)?;
                takes_place_of.map_or(Ok(()), |unfinished| Ok(unfinished.locked.remove()?))
            }
            Stand::Hidden { files, .. } => Ok(files.publish()?),
        }
    }

    fn io(&self, error: io::Error) -> WriteError {
        WriteError::io(self.path(), error)
    }
}

fn must_be_free(path: &Path, existing: Existing) -> Result<(), WriteError> {
    if existing == Existing::Refuse && is_taken(path) {
        return Err(FileError::Exists(path.to_owned()).into());
    }
    Ok(())
}

/// Locks and truncates a file that an earlier run may have left; refuses anything else of that
/// name.
fn emptied(path: &Path) -> Result<LockedFile, WriteError> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        create_folder(folder)?;
    }
    let locked = LockedFile::create(path)?;
    must_be_ours(path)?;
    locked.file().set_len(0).map_err(|error| WriteError::io(path, error))?;
    Ok(locked)
}

/// Checks by its first bytes that a file is a run log or the beginning of one, which may be replaced. An empty file
/// counts, and one whose first bytes a power cut left as zeros.
///
/// # Errors
/// If it is of another program, or cannot be read.
pub fn must_be_ours(path: &Path) -> Result<(), LogError> {
    let foreign = Records::open(path, &Ahead::default())
        .map_err(LogProblem::from)
        .and_then(|mut records| records.foreign());
    let problem = match foreign {
        Ok(None | Some(NoRunLog::Empty | NoRunLog::Torn)) => return Ok(()),
        Ok(Some(foreign)) => foreign.into(),
        Err(problem) => problem,
    };
    Err(LogError { path: path.to_owned(), problem })
}
