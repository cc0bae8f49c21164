//! Computes the code version from everything that shapes a run. Part of the build script, and
//! tested as part of the crate.
//!
//! | input | what |
//! |---|---|
//! | `crates/NAME/...` | manifests and sources of the crate that makes runs, and of every crate of the workspace that it is built from, as their manifests say |
//! | `features NAME` | the workspace manifest's entry of a package that one of these uses: its version and features |
//! | `package NAME VERSION` | the checksum in the lock file of that package, and of all that it is built from |
//! | `rustc` | the compiler's version |
//!
//! Figures, tables and the command line are in crates that a run does not depend on.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The prefix of the workspace's packages; the rest of the name is the crate's folder.
const OURS: &str = "asperity-";

/// Everything that shapes a run, by name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Inputs {
    /// Files, by their path in the workspace.
    pub(crate) files: BTreeMap<String, PathBuf>,
    /// All other inputs.
    pub(crate) words: BTreeMap<String, String>,
}

impl Inputs {
    /// Collects what shapes the runs of the crate in that folder of `crates`, compiled by that
    /// rustc.
    ///
    /// # Errors
    /// If a file cannot be read, or manifests and lock file do not agree.
    pub(crate) fn of(workspace: &Path, first: &str, rustc: &str) -> io::Result<Inputs> {
        let read = |name: &str| {
            let path = workspace.join(name);
            fs::read_to_string(&path)
                .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", path.display())))
        };
        let manifest = read("Cargo.toml")?;
        let lock = Lock::parse(&read("Cargo.lock")?);
        let mut inputs = Inputs { files: BTreeMap::new(), words: BTreeMap::new() };
        inputs.words.insert("rustc".to_owned(), rustc.to_owned());
        let mut names = vec![first.to_owned()];
        let mut next = 0;
        while let Some(name) = names.get(next).cloned() {
            next += 1;
            inputs.add_crate(workspace, &name)?;
            for used in dependencies(&read(&format!("crates/{name}/Cargo.toml"))?)? {
                match used.strip_prefix(OURS) {
                    Some(ours) if names.iter().all(|name| name != ours) => names.push(ours.to_owned()),
                    Some(_) => {}
                    None => {
                        inputs.words.insert(format!("features {used}"), features(&manifest, &used)?);
                        let of_crate = lock.find(&format!("{OURS}{name}"))?;
                        inputs.add_packages(&lock, lock.used_by(of_crate, &used)?)?;
                    }
                }
            }
        }
        Ok(inputs)
    }

    fn add_crate(&mut self, workspace: &Path, name: &str) -> io::Result<()> {
        let folder = workspace.join("crates").join(name);
        let mut found = vec![folder.join("Cargo.toml")];
        collect(&folder.join("src"), &mut found)?;
        for path in found {
            let inside = path.strip_prefix(workspace).unwrap_or(&path);
            let inside: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
            self.files.insert(inside.join("/"), path);
        }
        Ok(())
    }

    /// Adds a package of the lock file and all its dependencies.
    fn add_packages(&mut self, lock: &Lock, first: &Package) -> io::Result<()> {
        let mut left = vec![first];
        while let Some(package) = left.pop() {
            let name = format!("package {} {}", package.name, package.version);
            if self.words.insert(name, package.checksum.clone()).is_none() {
                for used in &package.uses {
                    left.push(lock.find(used)?);
                }
            }
        }
        Ok(())
    }

    /// The hash over all inputs, 16 hexadecimal digits.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub(crate) fn version(&self) -> io::Result<String> {
        let mut hasher = blake3::Hasher::new();
        let mut add = |name: &str, content: &[u8]| {
            for bytes in [name.as_bytes(), content] {
                hasher.update(&(bytes.len() as u64).to_le_bytes());
                hasher.update(bytes);
            }
        };
        for (name, path) in &self.files {
            add(name, &fs::read(path)?);
        }
        for (name, word) in &self.words {
            add(name, word.as_bytes());
        }
        Ok(hasher.finalize().to_hex()[..16].to_owned())
    }
}

/// The packages that a manifest names under `[dependencies]`.
fn dependencies(manifest: &str) -> io::Result<Vec<String>> {
    let mut section = "";
    let mut names = Vec::new();
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            section = line;
            if section.starts_with("[dependencies.") || section.starts_with("[target.") {
                return Err(io::Error::other(format!(
                    "{section} (accepted: one line for each package under [dependencies])"
                )));
            }
        } else if section == "[dependencies]" && !line.is_empty() && !line.starts_with('#') {
            names.push(line[..line.find(['.', '=', ' ']).unwrap_or(line.len())].to_owned());
        }
    }
    Ok(names)
}

/// The workspace manifest's entry for a package.
fn features(manifest: &str, package: &str) -> io::Result<String> {
    let lines = manifest.lines().skip_while(|line| *line != "[workspace.dependencies]").skip(1);
    lines
        .take_while(|line| !line.starts_with('['))
        .filter_map(|line| line.split_once('='))
        .find(|(name, _)| name.trim() == package)
        .map(|(_, says)| says.trim().to_owned())
        .filter(|says| says.matches(['[', '{']).count() == says.matches([']', '}']).count())
        .ok_or_else(|| {
            io::Error::other(format!("{package} has no line of its own under [workspace.dependencies]"))
        })
}

/// The packages of a lock file.
struct Lock(Vec<Package>);

#[derive(Default)]
struct Package {
    name: String,
    version: String,
    checksum: String,
    /// `NAME`, or `NAME VERSION` where there are several.
    uses: Vec<String>,
}

impl Lock {
    fn parse(text: &str) -> Lock {
        let mut packages: Vec<Package> = Vec::new();
        for line in text.lines() {
            if line == "[[package]]" {
                packages.push(Package::default());
            }
            let Some(package) = packages.last_mut() else { continue };
            let quoted = || line.split('"').nth(1).unwrap_or_default().to_owned();
            match line.split(' ').next().unwrap_or_default() {
                "name" => package.name = quoted(),
                "version" => package.version = quoted(),
                "checksum" => package.checksum = quoted(),
                "" if line.starts_with(" \"") => package.uses.push(quoted()),
                _ => {}
            }
        }
        Lock(packages)
    }

    /// Finds a package by `NAME` or `NAME VERSION`.
    fn find(&self, used: &str) -> io::Result<&Package> {
        let (name, version) = used.split_once(' ').unwrap_or((used, ""));
        // The source of the package, if given, follows the version.
        let version = version.split(' ').next().unwrap_or_default();
        let is_it =
            |package: &&Package| package.name == name && (version.is_empty() || package.version == version);
        self.0.iter().find(is_it).ok_or_else(|| io::Error::other(format!("Cargo.lock does not have {used}")))
    }

    /// The package of that name among the dependencies of another.
    fn used_by(&self, package: &Package, name: &str) -> io::Result<&Package> {
        let is_it = |used: &&String| used.split(' ').next() == Some(name);
        match package.uses.iter().find(is_it) {
            Some(used) => self.find(used),
            None => Err(io::Error::other(format!(
                "Cargo.lock does not have {name} among what {} uses",
                package.name
            ))),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::Inputs;
    use std::fs;
    use std::path::Path;

    const LOCK: &str = "\
[[package]]
name = \"asperity-run\"
version = \"0.1.0\"
dependencies = [
 \"asperity-stream\",
]

[[package]]
name = \"asperity-record\"
version = \"0.1.0\"
dependencies = [
 \"packed 2.0.0\",
 \"tested\",
]

[[package]]
name = \"packed\"
version = \"1.0.0\"
checksum = \"old\"

[[package]]
name = \"packed\"
version = \"2.0.0\"
checksum = \"packed-sum\"
dependencies = [
 \"deep\",
]

[[package]]
name = \"deep\"
version = \"0.3.0\"
checksum = \"deep-sum\"

[[package]]
name = \"tested\"
version = \"7.0.0\"
checksum = \"tested-sum\"
";

    const WORKSPACE: &str = "\
[workspace.dependencies]
asperity-stream = { path = \"crates/stream\" }
packed = { version = \"2\", features = [\"one\"] }
tested = \"7\"

[workspace.lints.rust]
";

    fn write(workspace: &Path, name: &str, text: &str) {
        let path = workspace.join(name);
        fs::create_dir_all(path.parent().expect("files lie in folders")).expect("folders can be made");
        fs::write(path, text).expect("files can be written");
    }

    fn inputs(workspace: &Path) -> Inputs {
        Inputs::of(workspace, "run", "rustc 1.95.0").expect("all is there")
    }

    fn version(workspace: &Path) -> String {
        inputs(workspace).version().expect("all can be read")
    }

    #[test]
    fn the_version_follows_whatever_a_run_is_built_from_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let workspace = folder.path();
        let manifest = |uses: &str| format!("[package]\nname = \"x\"\n\n[dependencies]\n{uses}");
        write(workspace, "Cargo.toml", WORKSPACE);
        write(workspace, "Cargo.lock", LOCK);
        write(workspace, "crates/run/Cargo.toml", &manifest("asperity-stream.workspace = true\n"));
        write(workspace, "crates/run/src/lib.rs", "run");
        write(workspace, "crates/stream/Cargo.toml", &manifest("asperity-record = { workspace = true }\n"));
        write(workspace, "crates/stream/src/lib.rs", "stream");
        let record = manifest("packed.workspace = true\n") + "[dev-dependencies]\ntested.workspace = true\n";
        write(workspace, "crates/record/Cargo.toml", &record);
        write(workspace, "crates/record/src/deep/step.rs", "step");
        write(workspace, "crates/figures/Cargo.toml", &manifest(""));
        write(workspace, "crates/figures/src/lib.rs", "figures");
        let before = inputs(workspace);
        let names: Vec<&str> = before.files.keys().map(String::as_str).collect();
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
        let words: Vec<(&str, &str)> =
            before.words.iter().map(|(name, word)| (name.as_str(), word.as_str())).collect();
        assert_eq!(
            words,
            [
                ("features packed", "{ version = \"2\", features = [\"one\"] }"),
                ("package deep 0.3.0", "deep-sum"),
                ("package packed 2.0.0", "packed-sum"),
                ("rustc", "rustc 1.95.0"),
            ]
        );
        let before = version(workspace);

        // Inputs that do not affect runs: a figure, a dev-dependency, another version of a package beside
        // ours.
        write(workspace, "crates/figures/src/lib.rs", "other figures");
        write(workspace, "Cargo.lock", &LOCK.replace("tested-sum", "x").replace("\"old\"", "\"older\""));
        write(workspace, "Cargo.toml", &WORKSPACE.replace("tested = \"7\"", "tested = \"8\""));
        assert_eq!(version(workspace), before);

        // Inputs that affect runs: sources, packages, their features, the compiler.
        let mut seen = vec![before];
        let mut is_new = |what: &str, version: String| {
            assert!(!seen.contains(&version), "{what}");
            seen.push(version);
        };
        write(workspace, "crates/record/src/deep/step.rs", "another step");
        is_new("a source far below", version(workspace));
        write(workspace, "Cargo.lock", &LOCK.replace("deep-sum", "other-sum"));
        is_new("a package that a package uses", version(workspace));
        write(workspace, "Cargo.lock", &LOCK.replace("2.0.0", "2.0.1"));
        is_new("the version of a package", version(workspace));
        write(workspace, "Cargo.toml", &WORKSPACE.replace("one", "two"));
        is_new("a feature", version(workspace));
        let other = Inputs::of(workspace, "run", "rustc 1.96.0").expect("all is there");
        is_new("the compiler", other.version().expect("all can be read"));

        write(workspace, "crates/detect-new/Cargo.toml", &manifest(""));
        write(workspace, "crates/detect-new/src/lib.rs", "new");
        let without = version(workspace);
        let both = "asperity-detect-new.workspace = true\nasperity-stream.workspace = true\n";
        write(workspace, "crates/run/Cargo.toml", &manifest(both));
        is_new("a detector that is added", version(workspace));
        write(workspace, "crates/detect-new/src/lib.rs", "newer");
        is_new("what it does", version(workspace));
        write(workspace, "crates/run/Cargo.toml", &manifest("asperity-stream.workspace = true\n"));
        assert_eq!(version(workspace), without, "a crate that nothing uses does not count");
    }

    #[test]
    fn what_cannot_be_followed_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let workspace = folder.path();
        write(workspace, "crates/run/src/lib.rs", "run");
        let refused = |manifest: &str, root: &str, lock: &str| {
            write(workspace, "crates/run/Cargo.toml", manifest);
            write(workspace, "Cargo.toml", root);
            write(workspace, "Cargo.lock", lock);
            Inputs::of(workspace, "run", "").expect_err("it cannot be followed").to_string()
        };
        let uses = "[dependencies]\npacked.workspace = true\n";
        let several = WORKSPACE.replace("features = [\"one\"] }", "features = [");
        assert!(refused("[dependencies.packed]\nversion = \"2\"\n", WORKSPACE, LOCK).contains("one line"));
        assert!(refused(uses, "[workspace.dependencies]\n", LOCK).contains("packed has no line of its own"));
        assert!(refused(uses, &several, LOCK).contains("packed has no line of its own"));
        assert!(refused(uses, WORKSPACE, LOCK).contains("Cargo.lock does not have packed among what"));
        assert!(refused(uses, WORKSPACE, "").contains("Cargo.lock does not have asperity-run"));
    }

    #[test]
    fn this_program_bears_the_version_of_its_sources() {
        let workspace =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("it is there");
        let inputs = Inputs::of(&workspace, "run", env!("ASPERITY_RUSTC")).expect("the sources are there");
        for file in [
            "simulator/src/step/plain.rs",
            "run/src/stream.rs",
            "runlog/src/write.rs",
            "run/src/detectors.rs",
        ] {
            assert!(inputs.files.contains_key(&format!("crates/{file}")), "{file}");
        }
        assert!(inputs.files.keys().all(|name| {
            !["cli", "analysis", "export", "diff"]
                .iter()
                .any(|other| name.starts_with(&format!("crates/{other}/")))
        }));
        for package in ["libm", "mcap", "zstd-sys", "serde_json"] {
            let is_it = |name: &String| name.starts_with(&format!("package {package} "));
            assert!(inputs.words.keys().any(is_it), "{package}");
        }
        assert!(inputs.words.keys().all(|name| !name.contains("polars") && !name.contains("clap")));
        assert!(inputs.words["features serde_json"].contains("float_roundtrip"));
        assert_eq!(inputs.version().expect("all can be read"), crate::CODE_VERSION);
    }
}
