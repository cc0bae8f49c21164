//! `docs/gallery.md` shows a picture of each kind of figure, made by the commands beside it.
//!
//! To draw the pictures anew: `cargo xtask gallery`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::as_given;
use crate::support::clients::file;
use crate::support::markdown::links;

pub(crate) const PAGE: &str = "docs/gallery.md";

/// The names of the pictures of the page, without their ending.
fn pictures() -> BTreeSet<String> {
    let page = fs::read_to_string(file(PAGE)).expect("the page is there");
    let targets = page.lines().flat_map(links);
    targets.filter_map(|to| Some(to.strip_prefix("gallery/")?.strip_suffix(".png")?.to_owned())).collect()
}

#[test]
fn each_kind_has_a_picture_and_a_heading() {
    let page = fs::read_to_string(file(PAGE)).expect("the page is there");
    let headings: BTreeSet<&str> =
        page.lines().filter_map(|line| line.strip_prefix("### `")?.strip_suffix('`')).collect();
    let pictures = pictures();
    assert!(pictures.iter().map(String::as_str).eq(headings.iter().copied()), "{pictures:?} {headings:?}");
    let kinds = asperity_figures::keys::figures();
    let missing: Vec<_> = kinds.iter().filter(|kind| !headings.contains(&*kind.name)).collect();
    assert!(missing.is_empty() && headings.len() > kinds.len(), "no picture of {missing:?}");
    let files = fs::read_dir(file("docs/gallery")).expect("the pictures are there");
    let files: BTreeSet<String> = files
        .map(|entry| entry.expect("the folder can be read").path())
        .map(|path| path.file_stem().expect("it has a name").to_string_lossy().into_owned())
        .collect();
    assert_eq!(files, pictures);
}

/// The picture of this name that commands left in a folder.
fn found(folder: &Path, name: &str) -> PathBuf {
    let places = ["", "several/figures", "sweep/figures", "refined/figures"]
        .map(|place| folder.join(place).join(name));
    places.into_iter().find(|path| path.exists()).unwrap_or_else(|| panic!("no command makes {name}"))
}

mod in_ci {
    use super::*;
    use crate::support::markdown::blocks;

    #[test]
    #[ignore = "half a minute of runs: cargo xtask ci"]
    fn its_commands_make_its_pictures() {
        let page = fs::read_to_string(file(PAGE)).expect("the page is there");
        let folder = asperity_testkit::folder();
        let [out, fixtures] = [folder.path(), &file("fixtures")].map(|at| format!(" {}/", at.display()));
        let moved = |text: &str| text.replace(" out/", &out).replace(" fixtures/", &fixtures);
        for block in blocks(&page) {
            match block.language.as_str() {
                "toml" => {
                    let (first, _) = block.text.split_once('\n').expect("it names its file");
                    let path = moved(first.trim_start_matches('#'));
                    fs::write(path.trim_start(), &block.text).expect("it can be written");
                }
                _ => block.text.lines().for_each(|line| run(&moved(line))),
            }
        }
        let update = std::env::var_os("UPDATE_EXPECT").is_some();
        for name in pictures() {
            let drawn = found(folder.path(), &format!("{name}.png"));
            let kept = file("docs/gallery").join(format!("{name}.png"));
            if update {
                fs::copy(drawn, kept).expect("the picture can be written");
                continue;
            }
            let [drawn, kept] = [drawn, kept].map(|path| fs::read(path).expect("it is there"));
            assert!(drawn == kept, "{name}: another picture than docs/gallery has: cargo xtask gallery");
        }
    }

    /// Runs a command, without provenance and as wide as the page says.
    fn run(line: &str) {
        let mut quoted = false;
        let words = line.split(|c| {
            quoted ^= c == '\'';
            c == ' ' && !quoted
        });
        let words: Vec<String> = words.map(|word| word.replace('\'', "")).collect();
        let mut words: Vec<&str> = words.iter().map(String::as_str).collect();
        match words[1] {
            "draw" if line.contains("width_mm") => words.push("--no-provenance"),
            "draw" => words.extend(["--no-provenance", "--set", "width_mm=80"]),
            "reproduce" | "sweep" => words.push("--no-provenance"),
            _ => {}
        }
        let output = as_given(&words[1..]);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    }
}
