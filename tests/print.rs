//! SVG and PDF of figures as programs of others show them, beside the PNG.
//!
//! Needs `rsvg-convert` and `pdftoppm` (Debian packages librsvg2-bin and poppler-utils), without which the
//! test skips with a message, or fails with `ASPERITY_NO_SKIPS=1`.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use asperity_testkit::Grey;

use crate::look::{OF_RECORDINGS, drawn, files};
use crate::support::binary::text;

/// Whether the programs are there, unless the test skips.
pub(crate) fn are_there() -> bool {
    let lacks = |name: &&str| {
        let mut version = Command::new(name);
        version.arg("-v").stdout(Stdio::null()).stderr(Stdio::null());
        !version.status().is_ok_and(|status| status.success())
    };
    let lacking: Vec<&str> = ["rsvg-convert", "pdftoppm"].into_iter().filter(lacks).collect();
    if lacking.is_empty() {
        return true;
    }
    let reason = format!(
        "{} not installed (accepted: Debian packages librsvg2-bin and poppler-utils)",
        lacking.join(" and ")
    );
    let no_skips = env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
    assert!(!no_skips, "print must not be skipped: {reason}");
    // Not eprintln, which the test harness captures: a skip must be seen.
    writeln!(std::io::stderr(), "SKIPPED print: {reason}").expect("stderr can be written");
    false
}

/// How much of the ink may lie elsewhere.
const ELSEWHERE: f64 = 0.003;

fn shown(by: &mut Command, at: &Path) -> Grey {
    let output = by.output().expect("it can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Grey::read(at)
}

fn by_rsvg(svg: &Path, to: &Path) -> Grey {
    let resolution = ["--dpi-x", "300", "--dpi-y", "300"];
    shown(Command::new("rsvg-convert").args(resolution).args(["-o", text(to), text(svg)]), to)
}

/// An SVG without some of its paths, a path a line; none if there are no such.
fn without(svg: &str, is_one: impl Fn(&str) -> bool) -> Option<String> {
    let kept: Vec<&str> = svg.lines().filter(|line| !is_one(line)).collect();
    (kept.len() < svg.lines().count()).then(|| kept.join("\n"))
}

#[test]
fn other_programs_show_the_same_picture() {
    if !are_there() {
        return;
    }
    let drawn = drawn();
    let folder = asperity_testkit::folder();
    let (to, damaged) = (folder.path().join("shown.png"), folder.path().join("damaged.svg"));
    let mut pictures = BTreeMap::new();
    let mut gone = 0;
    let of_runs =
        files(&drawn.with, "png").into_iter().filter(|(name, _)| !OF_RECORDINGS.contains(&name.as_str()));
    for (number, (name, path)) in of_runs.enumerate() {
        let own = Grey::read(&path);
        let by_svg = by_rsvg(&path.with_extension("svg"), &to);
        let by_pdf = shown(
            Command::new("pdftoppm")
                .args(["-r", "300", "-png", "-singlefile"])
                .args([&path.with_extension("pdf"), &to.with_extension("")]),
            &to,
        );
        for (other, program) in [(&by_svg, "rsvg-convert"), (&by_pdf, "pdftoppm")] {
            assert_eq!(own.size, other.size, "{name} by {program}");
            let difference = own.difference(other);
            assert!(difference < ELSEWHERE, "{name} by {program}: {difference:.3} of the ink lies elsewhere");
        }
        // A picture without its data, or without its words, is not accepted.
        let svg = fs::read_to_string(path.with_extension("svg")).expect("the SVG is text");
        for (what, left) in [
            ("data", without(&svg, |line| line.contains(" class=\"data\""))),
            ("text", without(&svg, |line| line.contains(" aria-label=\"") && line.starts_with("<path "))),
        ] {
            let left = left.unwrap_or_else(|| panic!("{name} has no {what}"));
            // Each takes as long as the whole picture.
            if number % 4 > 0 {
                continue;
            }
            fs::write(&damaged, left).expect("the folder can be written");
            let difference = own.difference(&by_rsvg(&damaged, &to));
            assert!(
                difference > 2.0 * ELSEWHERE,
                "{name} without {what}: {difference:.3} of the ink is missed"
            );
            gone += 1;
        }
        pictures.insert(name, own);
    }
    assert!(gone > 10, "{gone} pictures without a part");
    // Nor is another picture, or one that is shifted by a line's width.
    let load = &pictures["with/load"];
    let mut shifted = load.clone();
    shifted.values.rotate_right(4 * load.size.0 as usize + 4);
    assert!(load.difference(&shifted) > ELSEWHERE, "{}", load.difference(&shifted));
    let others = pictures.values().filter(|other| other.size == load.size && *other != load);
    assert!(others.clone().count() > 0 && others.into_iter().all(|other| load.difference(other) > ELSEWHERE));
}
