//! Which sources shape a run: those of the crate that makes it, and of every crate of the
//! workspace that it is built from, as their manifests say. Part of the build script, and tested
//! as part of the crate.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// How packages of the workspace begin; the rest of the name is the crate's folder.
const OURS: &str = "asperity-";

/// The dependency whose functions enter initial states; its version counts as well.
const LIBM: &str = "libm";

/// The files that shape a run, by their path from the workspace: manifests and sources of the
/// crate in that folder below `crates`, and of all that it depends on.
///
/// # Errors
/// If a folder or manifest cannot be read.
pub(crate) fn sources(workspace: &Path, first: &str) -> io::Result<BTreeMap<String, PathBuf>> {
    let crates = workspace.join("crates");
    let mut names = vec![first.to_owned()];
    let mut files = BTreeMap::new();
    let mut next = 0;
    while let Some(name) = names.get(next).cloned() {
        next += 1;
        let manifest = crates.join(&name).join("Cargo.toml");
        for used in dependencies(&fs::read_to_string(&manifest)?) {
            if !names.contains(&used) {
                names.push(used);
            }
        }
        let mut found = vec![manifest];
        collect(&crates.join(&name).join("src"), &mut found)?;
        for path in found {
            let inside = path.strip_prefix(workspace).unwrap_or(&path);
            let inside: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
            files.insert(inside.join("/"), path);
        }
    }
    Ok(files)
}

/// The crates of the workspace that a manifest names under `[dependencies]`.
fn dependencies(manifest: &str) -> Vec<String> {
    let mut section = "";
    let mut names = Vec::new();
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            section = line;
        } else if section == "[dependencies]"
            && let Some(rest) = line.strip_prefix(OURS)
        {
            let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '-' || c == '_'));
            names.push(rest[..end.unwrap_or(rest.len())].to_owned());
        }
    }
    names
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

/// The hash over these files and the version of libm, 16 hexadecimal digits.
///
/// # Errors
/// If a file cannot be read, or the lock file does not name libm.
pub(crate) fn hash(sources: &BTreeMap<String, PathBuf>, lock: &str) -> io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    for (name, path) in sources {
        let content = fs::read(path)?;
        hasher.update(name.as_bytes()).update(&[0]);
        hasher.update(&(content.len() as u64).to_le_bytes()).update(&content);
    }
    let package = format!("name = \"{LIBM}\"");
    let mut lines = lock.lines().skip_while(|line| *line != package).skip(1);
    let version = lines.next().ok_or_else(|| io::Error::other("Cargo.lock does not name libm"))?;
    hasher.update(version.as_bytes());
    Ok(hasher.finalize().to_hex()[..16].to_owned())
}

#[cfg(test)]
mod tests {
    use super::{hash, sources};
    use std::fs;
    use std::path::Path;

    const LOCK: &str = "[[package]]\nname = \"libm\"\nversion = \"0.2.1\"\n";

    fn write(workspace: &Path, name: &str, text: &str) {
        let path = workspace.join(name);
        fs::create_dir_all(path.parent().expect("files lie in folders")).expect("folders can be made");
        fs::write(path, text).expect("files can be written");
    }

    fn version(workspace: &Path) -> String {
        hash(&sources(workspace, "run").expect("all is there"), LOCK).expect("all can be read")
    }

    #[test]
    fn the_version_follows_whatever_a_run_is_built_from_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let workspace = folder.path();
        let manifest = |uses: &str| format!("[package]\nname = \"x\"\n\n[dependencies]\n{uses}");
        write(workspace, "crates/run/Cargo.toml", &manifest("asperity-stream.workspace = true\n"));
        write(workspace, "crates/run/src/lib.rs", "run");
        write(workspace, "crates/stream/Cargo.toml", &manifest("asperity-record = { workspace = true }\n"));
        write(workspace, "crates/stream/src/lib.rs", "stream");
        write(
            workspace,
            "crates/record/Cargo.toml",
            &(manifest("serde.workspace = true\n")
                + "[dev-dependencies]\nasperity-testkit.workspace = true\n"),
        );
        write(workspace, "crates/record/src/deep/step.rs", "step");
        write(workspace, "crates/figures/Cargo.toml", &manifest(""));
        write(workspace, "crates/figures/src/lib.rs", "figures");
        let names: Vec<String> = sources(workspace, "run").expect("all is there").into_keys().collect();
        assert_eq!(
            names,
            [
                "crates/record/Cargo.toml",
                "crates/record/src/deep/step.rs",
                "crates/run/Cargo.toml",
                "crates/run/src/lib.rs",
                "crates/stream/Cargo.toml",
                "crates/stream/src/lib.rs",
            ]
        );
        let before = version(workspace);

        write(workspace, "crates/figures/src/lib.rs", "other figures");
        assert_eq!(version(workspace), before, "a figure shapes no run");

        write(workspace, "crates/record/src/deep/step.rs", "another step");
        let step = version(workspace);
        assert_ne!(step, before, "a source far below does");

        write(workspace, "crates/detect-new/Cargo.toml", &manifest(""));
        write(workspace, "crates/detect-new/src/lib.rs", "new");
        assert_eq!(version(workspace), step, "a crate that nothing uses does not");
        let both = "asperity-detect-new.workspace = true\nasperity-stream.workspace = true\n";
        write(workspace, "crates/run/Cargo.toml", &manifest(both));
        let with = version(workspace);
        assert_ne!(with, step, "a detector that is added does");
        write(workspace, "crates/detect-new/src/lib.rs", "newer");
        assert_ne!(version(workspace), with, "and so does what it does");

        let files = sources(workspace, "run").expect("all is there");
        let newer = hash(&files, &LOCK.replace("0.2.1", "0.2.2")).expect("all can be read");
        assert_ne!(newer, version(workspace), "the version of libm does");
        assert!(hash(&files, "").is_err());
    }

    #[test]
    fn this_program_bears_the_version_of_its_sources() {
        let workspace =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("it is there");
        let files = sources(&workspace, "run").expect("the sources are there");
        assert!(files.contains_key("crates/simulator/src/plain.rs"));
        assert!(files.contains_key("crates/detect-extent/src/lib.rs"));
        assert!(files.keys().all(|name| !name.starts_with("crates/cli/")));
        let lock = fs::read_to_string(workspace.join("Cargo.lock")).expect("it is there");
        assert_eq!(hash(&files, &lock).expect("all can be read"), crate::CODE_VERSION);
    }
}
