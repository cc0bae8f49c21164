//! What a command reads, and so never writes over.

use std::path::{Path, PathBuf};

use crate::error::FileError;
use crate::identity::Identity;
use crate::place::{Place, with_suffix};

/// Where an unfinished run log stands until it is whole.
pub fn partial_path(path: &Path) -> PathBuf {
    with_suffix(path, ".partial")
}

/// The files that a command reads. None of them is ever written over, by whatever name or link it
/// is reached, nor is what stands beside it as its unfinished [`partial_path`].
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    all: Vec<Input>,
}

#[derive(Debug, Clone)]
struct Input {
    path: PathBuf,
    /// None if nothing is there, which whoever reads it will say.
    identity: Option<Identity>,
    place: Option<Place>,
}

impl Inputs {
    /// Takes down which files a command reads.
    pub fn of<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Inputs {
        let mut inputs = Inputs::default();
        inputs.add(paths);
        inputs
    }

    /// Adds further ones.
    pub fn add<P: AsRef<Path>>(&mut self, paths: impl IntoIterator<Item = P>) {
        for path in paths {
            let path = path.as_ref();
            for path in [path.to_owned(), partial_path(path)] {
                let (identity, place) = (Identity::of_path(&path).ok(), Place::of(&path).ok());
                self.all.push(Input { path, identity, place });
            }
        }
    }

    /// Makes sure that a file that is to be written is none of them.
    ///
    /// # Errors
    /// If it is.
    pub fn check(&self, path: &Path) -> Result<(), FileError> {
        let (identity, place) = (Identity::of_path(path).ok(), Place::of(path).ok());
        let is_it = |input: &&Input| {
            (identity.is_some() && identity == input.identity) || (place.is_some() && place == input.place)
        };
        match self.all.iter().find(is_it) {
            None => Ok(()),
            Some(input) => Err(FileError::Input { path: path.to_owned(), input: input.path.clone() }),
        }
    }
}
