//! `cargo xtask notices`: the software of others in what users install, with its licences and their texts, which
//! `asperity --notices` prints.

use std::collections::BTreeSet;
use std::env;
use std::path::{Path, PathBuf};

use crate::say::say;
use crate::workspace::{self, Failure, cargo, entries, output, read, root};

/// What `asperity --notices` prints.
const FILE: &str = "crates/cli/src/notices.txt";

/// What users install.
const INSTALLED: [&str; 2] = ["asperity-cli", "asperity-python"];

/// Where they install it; other processors use the same packages.
const PLATFORMS: [&str; 3] = ["x86_64-unknown-linux-gnu", "aarch64-apple-darwin", "x86_64-pc-windows-msvc"];

/// The licences under which we use what is not ours. Where a package leaves the choice, the first of them applies.
const ACCEPTED: [&str; 7] =
    ["MIT", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "BSL-1.0", "Zlib", "Bitstream-Vera"];

/// The texts of accepted licences in this repository, for packages that contain none.
const OWN_TEXTS: [(&str, &str); 2] = [("MIT", "LICENSE-MIT"), ("Apache-2.0", "LICENSE-APACHE")];

/// What cargo does not list: name, licence, source and text, in this repository if we have it.
const NOT_OF_CARGO: [[&str; 4]; 3] = [
    [
        "DejaVu Sans 2.37",
        "Bitstream-Vera",
        "https://dejavu-fonts.github.io",
        "crates/figures/fonts/LICENSE-DejaVu",
    ],
    [
        "uPlot 1.6.32",
        "MIT",
        "https://github.com/leeoniya/uPlot",
        "crates/report/src/html/vendor/uplot/LICENSE",
    ],
    ["The Rust standard library", "MIT OR Apache-2.0", "https://github.com/rust-lang/rust", ""],
];

/// How the names of files begin in which a package has the texts of its licence.
const NAMES: [&str; 6] = ["license", "licence", "unlicense", "copying", "copyright", "notice"];

/// Folders of packages from which nothing is compiled into the package.
const NOT_COMPILED: [&str; 6] = ["benches", "contrib", "doc", "examples", "programs", "tests"];

const HEADING: &str = "\
The asperity command and its Python package are licensed under MIT or Apache-2.0, at your option. They contain the
software listed here, on some platforms not all of it: its name and version, its licence, where its source is. The texts
of the licences follow, each with the packages that it comes from.
";

/// Writes the notices of the present dependencies.
pub(crate) fn write() -> Result<(), Failure> {
    workspace::write(&root().join(FILE), &notices()?)?;
    say!("wrote {FILE}");
    Ok(())
}

/// Checks that the committed file is that of the present dependencies, and that their licences are accepted.
pub(crate) fn check() -> Result<(), Failure> {
    if read(&root().join(FILE))? == notices()? {
        return Ok(());
    }
    Err(Failure::Check(format!("{FILE} is out of date; `cargo xtask notices` writes it")))
}

struct Package {
    /// Name and version.
    name: String,
    /// As an SPDX expression.
    licence: String,
    /// The address of its source.
    source: String,
    /// The texts of its licence.
    texts: Vec<String>,
    /// Those of parts that it has from others.
    of_parts: Vec<String>,
}

fn notices() -> Result<String, Failure> {
    let mut packages = packages_of_cargo()?;
    for [name, licence, source, text] in NOT_OF_CARGO.map(|row| row.map(str::to_owned)) {
        let texts = if text.is_empty() { Vec::new() } else { vec![read(&root().join(text))?] };
        packages.push(Package { name, licence, source, texts, of_parts: Vec::new() });
    }
    let mut out = format!("{HEADING}\n");
    // What it says, one of the texts that say so, and the names of their packages.
    let mut texts: Vec<(String, String, Vec<&str>)> = Vec::new();
    for package in &packages {
        let Package { name, licence, source, .. } = package;
        out += &format!("{name}: {licence}, {source}\n");
        for text in texts_for(package, &packages)?.into_iter().chain(package.of_parts.clone()) {
            let says = essence(&text);
            match texts.iter_mut().find(|(known, ..)| *known == says) {
                Some((.., names)) => names.push(name),
                None => texts.push((says, text, vec![name])),
            }
        }
    }
    for (_, text, mut names) in texts {
        names.dedup();
        let names: Vec<String> = names.chunks(5).map(|names| names.join(", ")).collect();
        let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
        let (names, text) = (names.join(",\n"), lines.join("\n"));
        out += &format!("\n{}\n{names}:\n\n{}\n", "=".repeat(80), text.trim_matches('\n'));
    }
    Ok(out)
}

/// The texts of a package; or, if it contains none, of another package with the same source; or the general texts.
fn texts_for(package: &Package, all: &[Package]) -> Result<Vec<String>, Failure> {
    let Package { name, licence, source, texts, .. } = package;
    let demanded = demanded(licence).ok_or_else(|| {
        Failure::Check(format!("the licence of {name} is {licence} (accepted: {})", ACCEPTED.join(", ")))
    })?;
    let of_source = || all.iter().map(|other| (&other.source, &other.texts));
    let mut found = [(source, texts)].into_iter().chain(of_source());
    if let Some((_, texts)) = found.find(|(other, texts)| *other == source && !texts.is_empty()) {
        return Ok(texts.clone());
    }
    let text = |licence: &&str| {
        let own = OWN_TEXTS.iter().find(|(name, _)| name == licence);
        let (_, file) =
            own.ok_or_else(|| Failure::Check(format!("{name} contains no text of its licence, {licence}")))?;
        Ok(read(&root().join(file))?.replace("2026 the Asperity authors", "the authors of these packages"))
    };
    demanded.iter().map(text).collect()
}

/// The packages that cargo compiles into what users install.
fn packages_of_cargo() -> Result<Vec<Package>, Failure> {
    let mut tree = cargo(&["tree", "--locked", "--all-features", "--edges", "normal,no-proc-macro"]);
    tree.args(["--prefix", "none", "--format", "{p}\t{l}\t{r}\t"]);
    tree.args(INSTALLED.iter().flat_map(|package| ["--package", package]));
    tree.args(PLATFORMS.iter().flat_map(|platform| ["--target", platform]));
    let listed = output(&mut tree)?;
    let lines: BTreeSet<[&str; 3]> = listed
        .lines()
        .filter_map(|line| line.split('\t').collect::<Vec<_>>().first_chunk::<3>().copied())
        // Ours have a folder behind the version.
        .filter(|[package, ..]| !package.ends_with(')'))
        .collect();
    let sources = sources()?;
    let package = |[package, licence, source]: [&str; 3]| {
        let name = package.replacen(" v", " ", 1);
        let folder = name.replacen(' ', "-", 1);
        let folder = sources.iter().map(|source| source.join(&folder)).find(|folder| folder.is_dir());
        let folder = folder
            .ok_or_else(|| Failure::Check(format!("cargo has not unpacked {name} into its registry/src")))?;
        let [licence, source] = [licence, source].map(str::to_owned);
        Ok(Package {
            name,
            licence,
            source,
            texts: texts_in(&folder, &NAMES)?,
            of_parts: texts_below(&folder)?,
        })
    };
    lines.into_iter().map(package).collect()
}

/// Where cargo unpacks packages: a folder for each registry.
fn sources() -> Result<Vec<PathBuf>, Failure> {
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| Some(env::home_dir()?.join(".cargo"))).unwrap_or_default();
    entries(&home.join("registry/src"))
}

/// The texts of licences in a folder: of files whose names begin so.
fn texts_in(folder: &Path, names: &[&str]) -> Result<Vec<String>, Failure> {
    let is_text = |path: &&PathBuf| {
        let name = name_of(path);
        path.is_file() && names.iter().any(|start| name.starts_with(start)) && !name.ends_with(".rs")
    };
    entries(folder)?.iter().filter(is_text).map(|path| read(path)).collect()
}

/// The texts of licences in the folders below a folder.
fn texts_below(folder: &Path) -> Result<Vec<String>, Failure> {
    let mut found = Vec::new();
    for path in entries(folder)? {
        if path.is_dir() && !NOT_COMPILED.contains(&name_of(&path).as_str()) {
            // There, COPYING is of a program, or of a licence that is left as a choice.
            found.extend(texts_in(&path, &["license"])?);
            found.extend(texts_below(&path)?);
        }
    }
    Ok(found)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// What is the same in texts that say the same: letters and digits, of the Apache licence without its appendix, which
/// says how to apply it.
fn essence(text: &str) -> String {
    let all: String = text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
    match all.split_once("endoftermsandconditions") {
        Some((terms, _)) if terms.starts_with("apachelicense") => terms.to_owned(),
        _ => all,
    }
}

/// The accepted licences that an SPDX expression demands, or None if others remain. It is taken as alternatives between
/// ANDs, as if OR bound more tightly and without parentheses, which demands more than the expression or as much, never
/// less. In older packages a stroke means OR.
fn demanded(expression: &str) -> Option<BTreeSet<&'static str>> {
    let plain = expression.replace(['(', ')'], "").replace('/', " OR ");
    let one_of = |alternatives: &str| {
        let is_one = |accepted: &&str| alternatives.split(" OR ").any(|licence| licence.trim() == *accepted);
        ACCEPTED.into_iter().find(is_one)
    };
    plain.split(" AND ").map(one_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn licences_are_demanded_in_full() {
        let cases: [(&str, Option<&[&str]>); 12] = [
            ("MIT", Some(&["MIT"])),
            ("Apache-2.0 OR MIT", Some(&["MIT"])),
            ("Unlicense/MIT", Some(&["MIT"])),
            ("MIT AND (GPL-3.0-only OR Apache-2.0)", Some(&["Apache-2.0", "MIT"])),
            ("Apache-2.0 WITH LLVM-exception OR Zlib", Some(&["Zlib"])),
            ("GPL-3.0-only", None),
            ("MIT AND GPL-3.0-only", None),
            ("MIT OR Zlib AND GPL-3.0-only", None),
            ("(MIT OR Zlib) AND GPL-3.0-only", None),
            ("Apache-2.0 WITH LLVM-exception", None),
            ("MIT Zlib", None),
            ("", None),
        ];
        for (expression, expected) in cases {
            let expected = expected.map(|names| names.iter().copied().collect());
            assert_eq!(demanded(expression), expected, "{expression}");
        }
    }

    #[test]
    fn texts_that_say_the_same_are_one() {
        let apache = read(&root().join("LICENSE-APACHE")).expect("it is there");
        let (terms, _) = apache.split_once("APPENDIX").unwrap_or((&apache, ""));
        assert_eq!(essence(&apache), essence(&terms.replace('\n', "\r\n")));
        assert_ne!(essence("MIT, by one"), essence("MIT, by another"));
    }

    /// Code, fonts and styles of others in our crates stand beside their licence.
    #[test]
    fn what_cargo_does_not_list_is_listed() {
        let mut found = texts_below(&root().join("crates")).expect("the crates can be read");
        let mut listed: Vec<String> = NOT_OF_CARGO
            .iter()
            .filter(|row| !row[3].is_empty())
            .map(|row| read(&root().join(row[3])).expect("it is there"))
            .collect();
        found.sort();
        listed.sort();
        assert_eq!(found, listed);
    }
}
