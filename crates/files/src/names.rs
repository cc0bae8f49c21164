//! What the name of an output says about its format.

use std::path::{Path, PathBuf};

/// Endings of names that denote the type of a file.
const ENDINGS: [&str; 32] = [
    "arrow", "csv", "db", "eps", "gif", "gz", "h5", "hdf5", "htm", "html", "jpeg", "jpg", "json", "log",
    "mat", "mcap", "md", "nc", "ndjson", "npy", "npz", "parquet", "pdf", "png", "svg", "tif", "tiff", "toml",
    "tsv", "txt", "webp", "zip",
];

/// The ending of a name that denotes the format of a file, in small letters.
pub fn format_of(path: &Path) -> Option<String> {
    let ending = path.extension()?.to_str()?.to_lowercase();
    ENDINGS.contains(&ending.as_str()).then_some(ending)
}

/// A better name for an output whose ending denotes another format than its own, or a log in progress. Names of
/// the output end in `ending`; it is a folder if `ending` is empty.
pub fn better_name(path: &Path, ending: &str) -> Option<PathBuf> {
    if ending == "mcap" && path.extension().is_some_and(|ending| ending == "partial" || ending == "resumed") {
        return Some(path.with_extension(""));
    }
    format_of(path).is_some_and(|written| written != ending).then(|| path.with_extension(ending))
}
