//! Logs that are being written: they stand under a temporary name, locked, until they are whole.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileSet, Inputs, LockedFile, is_taken, partial_path};

use crate::problem::WriteError;
use crate::read::{RunReader, Topics};

/// Where a run that goes on is written until it holds what the log of the unfinished one
/// holds.
fn resumed_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".resumed");
    path.with_file_name(name)
}

/// An unfinished log that no other process writes, for as long as this lives.
#[derive(Debug)]
pub struct Unfinished {
    path: PathBuf,
    locked: LockedFile,
}

impl Unfinished {
    /// Takes hold of what stands for `path` until that is whole, if there is any of it.
    ///
    /// # Errors
    /// If another process writes it, it is a link or no run log, or the system refuses.
    pub fn of(path: &Path) -> Result<Option<Unfinished>, WriteError> {
        let Some(locked) = LockedFile::open(&partial_path(path))? else { return Ok(None) };
        must_be_ours(locked.path())?;
        Ok(Some(Unfinished { path: path.to_owned(), locked }))
    }

    /// Where it is.
    pub fn partial_path(&self) -> PathBuf {
        self.locked.path().to_owned()
    }

    /// Removes it, with what another run that went on from it left.
    ///
    /// # Errors
    /// If another process writes that, it lost its name, or the system refuses.
    pub fn remove(self) -> Result<(), WriteError> {
        if let Some(resumed) = LockedFile::open(&resumed_path(&self.path))? {
            must_be_ours(resumed.path())?;
            resumed.remove()?;
        }
        Ok(self.locked.remove()?)
    }

    /// Gives it its final name, which only a whole one may have.
    ///
    /// # Errors
    /// If a log stands there that is not to be replaced, it is no longer the one that was taken
    /// hold of, or the system refuses.
    pub fn publish(mut self, existing: Existing) -> Result<(), WriteError> {
        let file = self.locked.file().sync_all();
        file.map_err(|error| WriteError::Io { path: self.partial_path(), error })?;
        Ok(self.locked.rename(&self.path, existing)?)
    }
}

/// Where a log is written, and how it gets its name.
#[derive(Debug)]
pub(crate) struct Place {
    path: PathBuf,
    existing: Existing,
    stand: Stand,
}

#[derive(Debug)]
enum Stand {
    /// Under a name by which a run can go on with it.
    Found {
        locked: LockedFile,
        /// The unfinished log that this one is to take the place of, once it holds as much.
        takes_place_of: Option<Unfinished>,
    },
    /// Where nobody looks for it.
    Hidden { files: FileSet, file: File },
}

impl Place {
    /// For the log of a run. What an earlier run left there is emptied.
    pub(crate) fn of_run(path: &Path, existing: Existing) -> Result<Place, WriteError> {
        must_be_free(path, existing)?;
        let locked = emptied(&partial_path(path))?;
        // Whoever held it until now may have finished.
        if let Err(error) = must_be_free(path, existing) {
            locked.remove()?;
            return Err(error);
        }
        let stand = Stand::Found { locked, takes_place_of: None };
        Ok(Place { path: path.to_owned(), existing, stand })
    }

    /// For the log of a run that goes on.
    pub(crate) fn resuming(unfinished: Unfinished, existing: Existing) -> Result<Place, WriteError> {
        let path = unfinished.path.clone();
        must_be_free(&path, existing)?;
        let locked = emptied(&resumed_path(&path))?;
        Ok(Place { path, existing, stand: Stand::Found { locked, takes_place_of: Some(unfinished) } })
    }

    /// For a log that is made of another, which no run goes on with.
    pub(crate) fn hidden(path: &Path, input: &Path) -> Result<Place, WriteError> {
        let existing = Existing::Refuse;
        let files = FileSet::new(existing, Inputs::of([input]));
        let file = files.create(path)?;
        Ok(Place { path: path.to_owned(), existing, stand: Stand::Hidden { files, file } })
    }

    /// Where it is to be told that something is wrong with it.
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

    /// The file, to be written from its beginning.
    pub(crate) fn writer(&self) -> Result<File, WriteError> {
        self.file().try_clone().map_err(|error| self.io(error))
    }

    /// Sees to it that what was written is on the disk, and still has its name: a run whose log is
    /// lost should say so soon.
    pub(crate) fn sync(&self) -> Result<(), WriteError> {
        self.file().sync_data().map_err(|error| self.io(error))?;
        match &self.stand {
            Stand::Found { locked, .. } => Ok(locked.check()?),
            Stand::Hidden { .. } => Ok(()),
        }
    }

    /// The log holds as much as the one that it goes on from, and takes its place.
    pub(crate) fn has_caught_up(&mut self) -> Result<(), WriteError> {
        if let Stand::Found { locked, takes_place_of } = &mut self.stand
            && let Some(unfinished) = takes_place_of.take()
        {
            unfinished.locked.check()?;
            locked.rename(unfinished.locked.path(), Existing::Replace)?;
        }
        Ok(())
    }

    /// Leaves it unfinished, for a run that goes on, unless it holds less than the one that it
    /// was to go on from.
    pub(crate) fn leave(self) -> Result<(), WriteError> {
        self.file().sync_all().map_err(|error| self.io(error))?;
        match self.stand {
            Stand::Found { locked, takes_place_of: Some(_) } => Ok(locked.remove()?),
            Stand::Found { locked, takes_place_of: None } => Ok(locked.check()?),
            Stand::Hidden { .. } => Ok(()),
        }
    }

    /// Removes what there is of it, which nobody can go on with.
    pub(crate) fn discard(&self) -> Result<(), WriteError> {
        match &self.stand {
            Stand::Found { locked, .. } => Ok(locked.remove()?),
            // Gone as soon as it is let go.
            Stand::Hidden { .. } => Ok(()),
        }
    }

    /// Gives it its final name.
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
        WriteError::Io { path: self.path().to_owned(), error }
    }
}

fn must_be_free(path: &Path, existing: Existing) -> Result<(), WriteError> {
    if existing == Existing::Refuse && is_taken(path) {
        return Err(WriteError::Exists(path.to_owned()));
    }
    Ok(())
}

/// Takes hold of a file that a run may have left, and empties it; whatever else has that name is
/// somebody else's.
fn emptied(path: &Path) -> Result<LockedFile, WriteError> {
    let locked = LockedFile::create(path)?;
    must_be_ours(path)?;
    locked.file().set_len(0).map_err(|error| WriteError::Io { path: path.to_owned(), error })?;
    Ok(locked)
}

/// Makes sure that a file is a run log, or the beginning of one, of which an empty file may be one.
fn must_be_ours(path: &Path) -> Result<(), WriteError> {
    match RunReader::open(path, Topics::NONE) {
        Err(error) if error.problem.is_no_run_log() && !error.problem.is_early_end() => {
            Err(WriteError::Foreign(Box::new(error)))
        }
        _ => Ok(()),
    }
}
