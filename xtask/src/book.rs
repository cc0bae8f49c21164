//! `cargo xtask book`: one site with a search, of the pages and of what the command and the Python package say of
//! themselves.

use std::fs;

use crate::python;
use crate::say::say;
use crate::workspace::{Failure, cargo, emptied, io, program, root, run, target_folder};

/// The version of mdBook.
const MDBOOK: &str = "0.5.4";

/// Makes the book, and tests that its links lead somewhere and that its search finds every name.
pub(crate) fn command() -> Result<(), Failure> {
    let python = python::installed()?;
    let folder = target_folder().join("book");
    emptied(&folder.join("source"))?;
    for name in ["book.toml", "book.css"] {
        fs::copy(root().join("docs/book").join(name), folder.join(name)).map_err(io("fill", &folder))?;
    }
    run(python::with(&python).arg("docs/book/pages.py").arg(folder.join("source")))?;
    let tools = target_folder().join("mdbook");
    let mdbook = tools.join("bin").join(format!("mdbook{}", std::env::consts::EXE_SUFFIX));
    // Compiling it optimised takes longer than it ever works here.
    if !mdbook.exists() {
        let install =
            ["install", "mdbook", "--version", MDBOOK, "--locked", "--debug", "--no-default-features"];
        let options = ["--features", "search", "--config", "profile.dev.debug=false", "--root"];
        run(cargo(&install).args(options).arg(&tools).env_remove("CARGO_TARGET_DIR"))?;
    }
    run(program(&mdbook).arg("build").arg(&folder))?;
    run(python::with(&python).args(["-m", "pytest", "--quiet", "-p", "no:cacheprovider", "tests/book"]))?;
    say!("{}", folder.join("html").join("index.html").display());
    Ok(())
}
