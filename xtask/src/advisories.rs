//! `cargo xtask advisories`: the packages of `Cargo.lock` against the advisories of RustSec.

use std::env;
use std::fs;
use std::path::Path;

use clap::Args;
use semver::{Version, VersionReq};
use toml::{Table, Value};

use crate::say::say;
use crate::workspace::{Failure, read, root};

/// Names a checkout of the database.
const DATABASE: &str = "ASPERITY_ADVISORIES";

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  git clone https://github.com/rustsec/advisory-db out/advisory-db
  ASPERITY_ADVISORIES=out/advisory-db cargo xtask advisories

Without ASPERITY_ADVISORIES, nothing is checked, which is a failure here and a
note in `cargo xtask ci`. A known vulnerability is a failure; other advisories
are listed.")]
pub(crate) struct AdvisoriesArguments {}

pub(crate) fn command(_arguments: &AdvisoriesArguments) -> Result<(), Failure> {
    let database = env::var_os(DATABASE).ok_or_else(|| {
        let problem = "names no checkout of https://github.com/rustsec/advisory-db";
        Failure::NotChecked(format!("{DATABASE} {problem}"))
    })?;
    let found = advisories(&read(&root().join("Cargo.lock"))?, Path::new(&database))?;
    found.iter().for_each(|(advisory, _)| say!("advisories: {advisory}"));
    if found.iter().any(|(_, is_vulnerability)| *is_vulnerability) {
        return Err(Failure::Check("Cargo.lock has packages with known vulnerabilities".to_owned()));
    }
    say!("advisories: checked, no known vulnerability");
    Ok(())
}

/// The advisories on packages of a lock file, and whether each is a vulnerability; others say that a package is no
/// longer maintained, for instance.
fn advisories(lock: &str, database: &Path) -> Result<Vec<(String, bool)>, Failure> {
    let unreadable = |path: &Path| Failure::Check(format!("{} cannot be read as what it is", path.display()));
    let of_all = database.join("crates");
    if !of_all.is_dir() {
        return Err(Failure::Check(format!("{DATABASE}: {} is not there", of_all.display())));
    }
    let packages = packages(lock).ok_or_else(|| unreadable(Path::new("Cargo.lock")))?;
    let mut found = Vec::new();
    for (name, version) in packages {
        // Most packages have no folder.
        for entry in fs::read_dir(of_all.join(&name)).into_iter().flatten().flatten() {
            let path = entry.path();
            let advisory = advisory(&read(&path)?, &version).ok_or_else(|| unreadable(&path))?;
            let line = |(id, is)| (format!("{name} {version}: https://rustsec.org/advisories/{id}"), is);
            found.extend(advisory.map(line));
        }
    }
    found.sort();
    Ok(found)
}

/// Name and version of each package; None if it is no lock file.
fn packages(lock: &str) -> Option<Vec<(String, Version)>> {
    let lock: Table = lock.parse().ok()?;
    let text = |package: &Value, key| Some(package.get(key)?.as_str()?.to_owned());
    let package = |package| Some((text(package, "name")?, text(package, "version")?.parse().ok()?));
    lock.get("package")?.as_array()?.iter().map(package).collect()
}

/// Outside None if it is no advisory, inside if it does not concern the version; else its name and whether it is a
/// vulnerability.
fn advisory(text: &str, version: &Version) -> Option<Option<(String, bool)>> {
    // TOML between fences, then words.
    let (front, _) = text.strip_prefix("```toml")?.split_once("```")?;
    let front: Table = front.parse().ok()?;
    let (advisory, versions) = (front.get("advisory")?, front.get("versions")?);
    let ranges = ["patched", "unaffected"].iter().filter_map(|key| versions.get(key)?.as_array()).flatten();
    let ranges: Vec<VersionReq> = ranges.map(|range| range.as_str()?.parse().ok()).collect::<Option<_>>()?;
    let concerns = advisory.get("withdrawn").is_none() && !ranges.iter().any(|range| range.matches(version));
    let id = advisory.get("id")?.as_str()?;
    Some(concerns.then(|| (id.to_owned(), advisory.get("informational").is_none())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_that_are_not_patched_are_found() {
        let folder = tempfile::tempdir().expect("a folder can be made");
        let write = |package: &str, id: &str, more: &str, versions: &str| {
            let folder = folder.path().join("crates").join(package);
            fs::create_dir_all(&folder).expect("the folder can be written");
            let front =
                format!("[advisory]\nid = {id:?}\npackage = {package:?}\n{more}\n[versions]\n{versions}\n");
            fs::write(folder.join(format!("{id}.md")), format!("```toml\n{front}```\n\n# Words\n"))
                .expect("likewise");
        };
        write("a", "RUSTSEC-2020-0001", "", "patched = [\">= 1.2.3\", \"^1.0.9, < 1.1\"]");
        write("a", "RUSTSEC-2020-0002", "withdrawn = \"2020-02-01\"", "patched = []");
        write(
            "a",
            "RUSTSEC-2020-0003",
            "informational = \"unmaintained\"",
            "patched = []\nunaffected = [\"< 1.1\"]",
        );
        write("b", "RUSTSEC-2020-0004", "", "patched = []");
        let found = |version: &str| {
            let lock = format!("version = 4\n[[package]]\nname = \"a\"\nversion = {version:?}\n");
            let found = advisories(&lock, folder.path()).expect("the database can be read");
            found.into_iter().map(|(line, is)| (line[line.len() - 4..].to_owned(), is)).collect::<Vec<_>>()
        };
        let [one, three] = [("0001".to_owned(), true), ("0003".to_owned(), false)];
        assert_eq!(found("1.2.2"), [one.clone(), three.clone()]);
        assert_eq!(found("1.2.3"), [three]);
        assert_eq!(found("1.0.8"), [one]);
        assert_eq!(found("1.0.9"), []);
        write("a", "RUSTSEC-2020-0005", "", "patched = [\"newer\"]");
        let lock = "[[package]]\nname = \"a\"\nversion = \"1.0.0\"\n";
        let failure = advisories(lock, folder.path()).expect_err("a range is none").to_string();
        assert!(failure.contains("RUSTSEC-2020-0005.md"), "{failure}");
        let failure =
            advisories(lock, &folder.path().join("elsewhere")).expect_err("no database").to_string();
        assert!(failure.starts_with("ASPERITY_ADVISORIES: "), "{failure}");
    }
}
