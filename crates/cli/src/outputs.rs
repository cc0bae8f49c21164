//! Failures of writing output files.

use std::path::Path;

use asperity_files::{FileError, create_folder as create};

use crate::exit::Failure;

/// Why a file is not written: invalid input, if another name would do.
pub(crate) fn refused(option: &str, error: &FileError, can_force: bool) -> Failure {
    let option = if option.is_empty() { String::new() } else { format!("{option} ") };
    let accepted = match error {
        FileError::Exists(_) if can_force => "another file, or --force",
        FileError::Exists(_) => "a path that does not exist",
        _ => "another file",
    };
    if error.is_of_name() {
        Failure::BadInput(format!("{option}{error} (accepted: {accepted})"))
    } else {
        Failure::failed(error)
    }
}

/// Creates the folder of an output.
pub(crate) fn create_folder(folder: &Path) -> Result<(), Failure> {
    create(folder).map_err(Failure::failed)
}
