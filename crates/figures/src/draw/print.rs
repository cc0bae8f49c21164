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
        let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
        let failed = |problem: String| FigureError::Figure { file: path.display().to_string(), problem };
        files.write(path, bytes(page, about, ending).map_err(failed)?)?;
    }
    Ok(())
}

/// The contents of a figure's file with this ending.
pub(super) fn bytes(page: &Page, about: &About, ending: &str) -> Result<Vec<u8>, String> {
    match ending {
        "svg" => svg::bytes(page, about),
        "pdf" => Ok(pdf::bytes(page, about)),
        _ => png::bytes(page, about),
    }
}
