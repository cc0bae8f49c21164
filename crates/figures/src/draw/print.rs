//! Pages, and the files that are written of them: PNG, SVG and PDF.

pub(super) mod about;
pub(super) mod canvas;
pub(super) mod page;
mod pdf;
mod png;
pub(super) mod raster;
mod svg;

use std::path::{Path, PathBuf};

use about::About;
use asperity_files::FileSet;
use page::Page;

use crate::draw::error::FigureError;

/// What the names of the files of a figure end in.
const ENDINGS: [&str; 3] = ["png", "svg", "pdf"];

/// The files of a figure that is asked for as `NAME.png`: that, `NAME.svg` and `NAME.pdf`.
pub fn files_of(file: &Path) -> [PathBuf; 3] {
    ENDINGS.map(|ending| file.with_extension(ending))
}

/// Writes the files of a figure, as files of a set.
pub(super) fn write(page: &Page, about: &About, files: &FileSet, file: &Path) -> Result<(), FigureError> {
    let failed = |problem: String| FigureError::Figure { file: file.display().to_string(), problem };
    let bytes = [
        png::bytes(page, about).map_err(failed)?,
        svg::bytes(page, about).map_err(failed)?,
        pdf::bytes(page, about),
    ];
    for (path, bytes) in files_of(file).iter().zip(bytes) {
        files.write(path, bytes)?;
    }
    Ok(())
}
