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
pub(super) const ENDINGS: [&str; 3] = ["png", "svg", "pdf"];

/// The files of a figure that is asked for as `NAME.png`: that, `NAME.svg` and `NAME.pdf`.
pub fn files_of(file: &Path) -> [PathBuf; 3] {
    ENDINGS.map(|ending| file.with_extension(ending))
}

/// Writes files of a figure, each in the format of its ending, as files of a set.
pub(super) fn write(
    page: &Page,
    about: &About,
    files: &FileSet,
    paths: &[PathBuf],
) -> Result<(), FigureError> {
    for path in paths {
        let failed = |problem: String| FigureError::Figure { file: path.display().to_string(), problem };
        let bytes = match path.extension().and_then(|ending| ending.to_str()) {
            Some("svg") => svg::bytes(page, about).map_err(failed)?,
            Some("pdf") => pdf::bytes(page, about),
            _ => png::bytes(page, about).map_err(failed)?,
        };
        files.write(path, bytes)?;
    }
    Ok(())
}
