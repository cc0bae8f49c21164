//! Colours of figures as programs of others show them, beside those of the PNG.
//!
//! A colour bar of a thousand slivers had smoothed edges between them, through which the page shone: its
//! dark end was (124, 80, 138) in Chromium, and (68, 4, 87) on the scale.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::look::{drawn, files};
use crate::print::are_there;
use crate::support::binary::text;
use crate::support::browser::{Tab, browser};
use crate::support::svg::{Bounds, Drawing, Item};

/// Pixels to an inch of the PNG, and of a window.
const OWN: f64 = 300.0;
const WINDOW: f64 = 96.0;

/// Pixels of three colours each.
struct Picture {
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

impl Picture {
    fn read(png: &[u8]) -> Picture {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().expect("it is a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("it fits into memory")];
        let frame = reader.next_frame(&mut bytes).expect("it is whole");
        let samples = frame.color_type.samples();
        assert!(samples >= 3, "{samples} samples");
        let rgb = bytes[..frame.buffer_size()]
            .chunks_exact(samples)
            .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]);
        Picture { width: frame.width as usize, height: frame.height as usize, rgb: rgb.collect() }
    }

    fn at(&self, x: usize, y: usize) -> [f64; 3] {
        let at = 3 * (y * self.width + x);
        [0, 1, 2].map(|part| f64::from(self.rgb[at + part]))
    }

    /// The colour of a window pixel for this picture: the mean over its area.
    fn in_window(&self, x: usize, y: usize) -> [f64; 3] {
        let ends = |n: usize| (n as f64 * OWN / WINDOW, (n + 1) as f64 * OWN / WINDOW);
        let ((left, right), (top, bottom)) = (ends(x), ends(y));
        let share = |n: usize, (low, high): (f64, f64)| {
            ((n as f64 + 1.0).min(high) - (n as f64).max(low)).max(0.0) / (high - low)
        };
        let mut mean = [0.0; 3];
        for row in top as usize..(bottom.ceil() as usize).min(self.height) {
            for column in left as usize..(right.ceil() as usize).min(self.width) {
                let weight = share(row, (top, bottom)) * share(column, (left, right));
                let pixel = self.at(column, row);
                mean.iter_mut().zip(pixel).for_each(|(mean, part)| *mean += weight * part);
            }
        }
        mean
    }
}

/// By how much a colour may be off: pictures are made smaller in other ways.
const OFF: f64 = 12.0;

/// The share of a map's pixels that may be off by more: those at the edges of cells, lines and marks.
const EDGES: f64 = 0.25;

/// The width of a colour bar.
const BAR: f64 = 56.0;

pub(crate) fn is_bar(item: &Item) -> bool {
    item.is_image && (item.bounds.width() - BAR).abs() < 0.5
}

/// By how much the colours in a rectangle are off, pixel by pixel of a window.
fn offs(own: &Picture, shown: &Picture, bounds: &Bounds) -> Vec<f64> {
    let inside = bounds.wider(-8.0);
    let whole =
        |from: f64, to: f64| (from * WINDOW / OWN).ceil() as usize..((to * WINDOW / OWN).floor() as usize);
    let mut offs = Vec::new();
    for y in whole(inside.top, inside.bottom) {
        for x in whole(inside.left, inside.right) {
            let (a, b) = (own.in_window(x, y), shown.at(x, y));
            offs.push(a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max));
        }
    }
    offs
}

/// Errors in the colours that a program shows for a figure.
fn flaws(drawing: &Drawing, own: &Picture, shown: &Picture) -> Vec<String> {
    let mut flaws = Vec::new();
    for image in drawing.items.iter().filter(|item| item.is_image) {
        let offs = offs(own, shown, &image.bounds);
        let worst = offs.iter().copied().fold(0.0, f64::max);
        let share = offs.iter().filter(|off| **off > OFF).count() as f64 / offs.len().max(1) as f64;
        if is_bar(image) && (worst > OFF || offs.len() < 100) {
            flaws.push(format!("a colour of the bar is off by {worst:.0} of 255"));
        }
        if !is_bar(image) && share > EDGES {
            flaws.push(format!("{:.0} % of a map are off by more than {OFF}", 100.0 * share));
        }
    }
    flaws
}

fn in_browser(tab: &mut Tab, svg: &Path, own: &Picture) -> Picture {
    let size = [own.width, own.height].map(|size| (size as f64 * WINDOW / OWN).round() as u32);
    tab.go(svg, size, "light");
    Picture::read(&tab.picture())
}

fn by(program: &mut Command, to: &Path) -> Picture {
    let output = program.output().expect("it can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Picture::read(&fs::read(to).expect("it has written"))
}

/// An SVG whose colour bar is as many slivers as it is high, as it was.
fn in_slivers(svg: &str, own: &Picture, drawing: &Drawing) -> String {
    let bar = drawing.items.iter().find(|item| is_bar(item));
    let Bounds { left, top, right, bottom } = bar.expect("it has a colour bar").bounds;
    let sliver = |y: usize| {
        let [r, g, b] = own.at(left as usize + 20, y).map(|part| part as u8);
        format!(
            "<path class=\"data\" fill=\"#{r:02x}{g:02x}{b:02x}\" d=\"M{left} {y}L{right} {y}L{right} {0}L{left} {0}Z\"/>",
            y + 1
        )
    };
    let slivers: Vec<String> = (top as usize..bottom as usize).map(sliver).collect();
    let is_it = |line: &str| line.starts_with("<image ") && line.contains(&format!(" width=\"{BAR}\""));
    let mut lines: Vec<&str> = svg.lines().collect();
    let at = lines.iter().position(|line| is_it(line)).expect("it is a line");
    lines.splice(at..=at, slivers.iter().map(String::as_str));
    lines.join("\n")
}

#[test]
fn other_programs_show_the_same_colours() {
    let (mut tab, others) = (browser().map(|browser| Tab::start(&browser)), are_there());
    if tab.is_none() && !others {
        return;
    }
    let drawn = drawn();
    let folder = asperity_testkit::folder();
    let to = folder.path().join("shown.png");
    for (name, path) in files(&drawn.with, "svg") {
        let svg = fs::read_to_string(&path).expect("the SVG is text");
        let drawing = Drawing::read(&svg);
        if !drawing.items.iter().any(|item| item.is_image) {
            continue;
        }
        let own = Picture::read(&fs::read(path.with_extension("png")).expect("it is there"));
        let mut shown = Vec::new();
        if let Some(tab) = &mut tab {
            shown.push(("Chromium", in_browser(tab, &path, &own)));
        }
        if others {
            let mut rsvg = Command::new("rsvg-convert");
            shown.push(("rsvg-convert", by(rsvg.args(["-o", text(&to), text(&path)]), &to)));
            let mut poppler = Command::new("pdftoppm");
            poppler.args(["-r", "96", "-png", "-singlefile"]);
            poppler.args([&path.with_extension("pdf"), &to.with_extension("")]);
            shown.push(("pdftoppm", by(&mut poppler, &to)));
        }
        for (program, shown) in &shown {
            let flaws = flaws(&drawing, &own, shown);
            assert!(flaws.is_empty(), "{name} by {program}: {}", flaws.join("; "));
        }
        // The old form is detected as wrong.
        if let (Some(tab), true) = (&mut tab, name.ends_with("/slab-field")) {
            let slivers = folder.path().join("slivers.svg");
            fs::write(&slivers, in_slivers(&svg, &own, &drawing)).expect("the folder can be written");
            let flaws = flaws(&drawing, &own, &in_browser(tab, &slivers, &own));
            assert!(flaws.iter().any(|flaw| flaw.contains("of the bar")), "slivers are not seen: {flaws:?}");
        }
    }
}
