//! SVG and PDF of figures as programs of others show them, beside the PNG.
//!
//! Needs `rsvg-convert` and `pdftoppm` (Debian packages librsvg2-bin and poppler-utils), without which
//! the test skips, and says so; with `ASPERITY_NO_SKIPS=1` it fails instead.

use std::collections::BTreeMap;
use std::env;
use std::fs::File;
use std::io::{BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use crate::look::{drawn, files};
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

/// Width, height and grey values.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Grey {
    pub(crate) size: (u32, u32),
    pub(crate) values: Vec<u8>,
}

impl Grey {
    pub(crate) fn read(path: &Path) -> Grey {
        let file = BufReader::new(File::open(path).expect("the picture is there"));
        let mut reader = png::Decoder::new(file).read_info().expect("it is a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("it fits into memory")];
        let frame = reader.next_frame(&mut bytes).expect("it is whole");
        let channels = frame.color_type.samples();
        let grey = |pixel: &[u8]| match *pixel {
            [grey] => grey,
            [r, g, b, ..] => ((u16::from(r) + u16::from(g) + u16::from(b)) / 3) as u8,
            _ => panic!("{channels} channels"),
        };
        Grey {
            size: (frame.width, frame.height),
            values: bytes[..frame.buffer_size()].chunks_exact(channels).map(grey).collect(),
        }
    }

    /// The differences of all values, over what is not white.
    fn difference(&self, other: &Grey) -> f64 {
        let differences =
            self.values.iter().zip(&other.values).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>();
        let ink: f64 = self.values.iter().map(|value| f64::from(255 - value)).sum();
        differences / ink
    }
}

/// How much of the ink may lie elsewhere: edges of lines are smoothed in other ways.
const ELSEWHERE: f64 = 0.3;

fn shown(by: &mut Command, at: &Path) -> Grey {
    let output = by.output().expect("it can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Grey::read(at)
}

#[test]
fn other_programs_show_the_same_picture() {
    if !are_there() {
        return;
    }
    let drawn = drawn();
    let folder = asperity_testkit::folder();
    let mut pictures = BTreeMap::new();
    for (name, path) in files(&drawn.with, "png") {
        let own = Grey::read(&path);
        let to = folder.path().join("shown.png");
        let by_svg = shown(
            Command::new("rsvg-convert")
                .args(["--dpi-x", "300", "--dpi-y", "300", "-o", text(&to)])
                .arg(path.with_extension("svg")),
            &to,
        );
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
        pictures.insert(name, own);
    }
    // What is not the same picture is not taken for it, nor is one that is shifted by a line's width.
    let load = &pictures["with/load"];
    let mut shifted = load.clone();
    shifted.values.rotate_right(4 * load.size.0 as usize + 4);
    assert!(load.difference(&shifted) > ELSEWHERE, "{}", load.difference(&shifted));
    let others = pictures.values().filter(|other| other.size == load.size && *other != load);
    assert!(others.clone().count() > 0 && others.into_iter().all(|other| load.difference(other) > ELSEWHERE));
}
