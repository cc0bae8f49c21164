//! Rules for the look of figures, checked on one figure of each kind: the examples of `asperity figures`.
//! Every rule is also tested on a figure that violates it.
//!
//! `support/svg.rs` reads the SVG; `print.rs` has independent programs open it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, Weak};

use asperity_figures::keys::EXAMPLES;

use crate::colours::is_bar;
use crate::support::binary::{succeed, text};
use crate::support::svg::{Bounds, Drawing, Item};

/// The folders of figures with the code named in them, and without.
pub(crate) struct Drawn {
    _folder: tempfile::TempDir,
    pub(crate) with: Vec<PathBuf>,
    without: Vec<PathBuf>,
}

/// Figures of the example that are also drawn without the code version.
const WITHOUT_CODE: [&str; 3] = ["load", "front-profile", "curve"];

/// The example without all other figures, and their runs.
fn without_others(example: &str) -> String {
    let mut left: toml::Table = example.parse().expect("it is TOML");
    let figures = left["figure"].as_table_mut().expect("it has figures");
    figures.retain(|kind, _| WITHOUT_CODE.contains(&kind));
    assert_eq!(figures.len(), WITHOUT_CODE.len());
    let figures = figures.to_string();
    let runs = left["run"].as_array_mut().expect("it has runs");
    runs.retain(|run| figures.contains(&run["name"].to_string()));
    left.retain(|key, _| matches!(key, "title" | "run" | "figure"));
    left.to_string()
}

/// One of each kind, drawn once for all tests that run at the same time.
pub(crate) fn drawn() -> Arc<Drawn> {
    static DRAWN: Mutex<Weak<Drawn>> = Mutex::new(Weak::new());
    let mut kept = DRAWN.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    kept.upgrade().unwrap_or_else(|| {
        let drawn = Arc::new(draw());
        *kept = Arc::downgrade(&drawn);
        drawn
    })
}

fn draw() -> Drawn {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let [kinds_toml, family_toml] = EXAMPLES;
    fs::write(path("kinds.toml"), kinds_toml).expect("the folder can be written");
    fs::write(path("few.toml"), without_others(kinds_toml)).expect("the folder can be written");
    fs::write(path("pictures.toml"), family_toml).expect("the folder can be written");
    let (kinds, study) = (path("kinds"), path("study"));
    succeed(&["reproduce", text(&path("kinds.toml")), "--quiet", "--out", text(&kinds)]);
    succeed(&["sweep", "plan", text(&path("pictures.toml")), "-o", text(&study), "--quiet"]);
    succeed(&["sweep", "run", text(&study), "--quiet"]);
    succeed(&["sweep", "collect", text(&study), "--quiet"]);
    // Some without the code version, of the same runs.
    let copied = path("with");
    fs::rename(kinds.join("figures"), &copied).expect("the folder can be written");
    succeed(&["reproduce", text(&path("few.toml")), "--quiet", "--out", text(&kinds), "--no-provenance"]);
    let plain = path("plain");
    succeed(&["sweep", "draw", text(&study), "-o", text(&plain), "--no-provenance", "--quiet"]);
    let with = vec![copied, study.join("figures")];
    Drawn { _folder: folder, with, without: vec![kinds.join("figures"), plain] }
}

/// The files of folders that end so, by name.
pub(crate) fn files(folders: &[PathBuf], ending: &str) -> BTreeMap<String, PathBuf> {
    let mut files = BTreeMap::new();
    for folder in folders {
        for entry in fs::read_dir(folder).expect("the folder is there") {
            let path = entry.expect("it can be read").path();
            if path.extension().is_some_and(|known| known == ending) {
                let stem = path.file_stem().expect("files have names").to_string_lossy().into_owned();
                let folder = folder.file_name().expect("folders have names").to_string_lossy().into_owned();
                files.insert(format!("{folder}/{stem}"), path);
            }
        }
    }
    files
}

fn drawing(path: &Path) -> Drawing {
    Drawing::read(&fs::read_to_string(path).expect("the SVG is text"))
}

/// Violations of the rules in a figure.
type Rule = fn(&Drawing) -> Vec<String>;

/// A violation of a rule.
type Damage<'a> = &'a dyn Fn(&mut Drawing);

/// Largest distance of a number from its mark.
const A_PIXEL: f64 = 1.0;

fn everything_is_on_the_page(drawing: &Drawing) -> Vec<String> {
    let outside = drawing.items.iter().filter(|item| !item.bounds.is_within(&drawing.page));
    outside.map(|item| format!("{} {:?} is off the page", item.class, item.words)).collect()
}

fn numbers_are_on_their_marks(drawing: &Drawing) -> Vec<String> {
    let ticks: Vec<&Item> = drawing.of("tick").collect();
    let mut flaws = Vec::new();
    for (class, across) in [("number-across", true), ("number-upwards", false)] {
        for number in drawing.of(class) {
            let at = |bounds: &Bounds| if across { bounds.middle().0 } else { bounds.middle().1 };
            let is_along = |tick: &Item| (tick.bounds.width() < tick.bounds.height()) == across;
            let nearest = ticks.iter().filter(|tick| is_along(tick));
            let off =
                nearest.map(|tick| (at(&tick.bounds) - at(&number.bounds)).abs()).fold(f64::MAX, f64::min);
            if off > A_PIXEL {
                flaws.push(format!("the number {:?} is {off:.1} pixels off its mark", number.words));
            }
        }
    }
    flaws
}

fn text_is_not_upon_text(drawing: &Drawing) -> Vec<String> {
    let texts: Vec<&Item> = drawing.items.iter().filter(|item| !item.words.is_empty()).collect();
    let mut flaws = Vec::new();
    for (n, a) in texts.iter().enumerate() {
        let upon = texts[..n].iter().filter(|b| a.bounds.meets(&b.bounds));
        flaws.extend(upon.map(|b| format!("{:?} lies upon {:?}", a.words, b.words)));
    }
    flaws
}

fn legends_hide_no_data(drawing: &Drawing) -> Vec<String> {
    let mut flaws = Vec::new();
    for legend in drawing.of("legend").chain(drawing.of("sample")) {
        if let Some(data) = drawing.of("data").find(|data| data.passes(&legend.bounds)) {
            flaws.push(format!("the legend's {:?} lies upon data at {:?}", legend.words, data.bounds));
        }
    }
    flaws
}

fn a_legend_says_a_thing_once(drawing: &Drawing) -> Vec<String> {
    let words: Vec<&str> = drawing.of("legend").map(|item| item.words.as_str()).collect();
    let again = words.iter().enumerate().filter(|(n, word)| words[..*n].contains(word));
    again.map(|(_, word)| format!("the legend says {word:?} twice")).collect()
}

/// Curves have one width and ends of bars another, whichever way they go; on maps, lines and arrows have a third,
/// and a light edge of a fourth.
fn strokes_have_one_width(drawing: &Drawing) -> Vec<String> {
    let odd = |item: &&Item| item.stroke_width.is_some_and(|width| ![4.0, 2.0, 3.0, 8.0].contains(&width));
    let flaws =
        drawing.of("data").filter(odd).map(|item| format!("a stroke is {:?} wide", item.stroke_width));
    let count = |width: f64| drawing.of("data").filter(|item| item.stroke_width == Some(width)).count();
    let without_edge =
        (count(3.0) != count(8.0)).then(|| "a stroke on a map has no edge of its own".to_owned());
    flaws.chain(without_edge).collect()
}

/// Least share of an axis that data must cover, for axes without given ends.
const FULL: f64 = 0.55;

fn axes_are_not_empty(drawing: &Drawing) -> Vec<String> {
    let mut flaws = Vec::new();
    for frame in drawing.of("frame").filter(|frame| frame.bounds.width() > 300.0) {
        let mut data = drawing.of("data").filter(|item| item.bounds.is_within(&frame.bounds.wider(30.0)));
        let Some(first) = data.next() else { continue };
        let all = data.fold(first.bounds, |all, item| all.with(&item.bounds));
        let shares = [all.width() / frame.bounds.width(), all.height() / frame.bounds.height()];
        for (share, axis) in shares.into_iter().zip(["across", "upwards"]) {
            if share < FULL {
                flaws.push(format!("data fill {:.0} % of an axis {axis}", 100.0 * share));
            }
        }
    }
    flaws
}

/// Largest share of the marks in a frame that may lie on its floor, where they carry no information.
const ON_THE_FLOOR: f64 = 0.7;

fn marks_say_something(drawing: &Drawing) -> Vec<String> {
    let mut flaws = Vec::new();
    for frame in drawing.of("frame") {
        let is_mark = |item: &&Item| {
            let is_small = (5.0..40.0).contains(&item.bounds.width());
            is_small && item.stroke_width == Some(4.0) && item.bounds.is_within(&frame.bounds.wider(30.0))
        };
        let heights: Vec<f64> =
            drawing.of("data").filter(is_mark).map(|mark| mark.bounds.middle().1).collect();
        let lowest = heights.iter().copied().fold(f64::MIN, f64::max);
        let idle = heights.iter().filter(|height| lowest - **height < 0.01 * frame.bounds.height()).count();
        let share = idle as f64 / heights.len() as f64;
        // Marks of equal height show that a number is constant.
        if heights.len() > 10 && share > ON_THE_FLOOR && share < 1.0 {
            flaws.push(format!("{:.0} % of the marks lie on the floor", 100.0 * share));
        }
    }
    flaws
}

/// How much of a frame's width may be black with bars.
const DARK: f64 = 0.5;

fn bars_are_not_one_surface(drawing: &Drawing) -> Vec<String> {
    let mut flaws = Vec::new();
    for frame in drawing.of("frame") {
        let within =
            |item: &&Item| item.stroke_width == Some(2.0) && item.bounds.is_within(&frame.bounds.wider(5.0));
        let bars: std::collections::BTreeSet<i64> =
            drawing.of("data").filter(within).map(|item| item.bounds.middle().0.round() as i64 / 2).collect();
        let dark = bars.len() as f64 * 2.0 / frame.bounds.width();
        if dark > DARK {
            flaws.push(format!("{:.0} % of a frame is black with bars", 100.0 * dark));
        }
    }
    flaws
}

/// 8 points; digits have three quarters of that height.
const LEAST_DIGIT: f64 = 8.0 / 72.0 * 300.0 * 0.72;
/// A page of two columns.
const WIDEST: f64 = 7.5 * 300.0;
/// A sheet of paper.
const A4_HEIGHT: f64 = 11.69 * 300.0;

fn letters_are_of_full_size(drawing: &Drawing) -> Vec<String> {
    // A whole sheet of paper is printed as it is.
    let is_sheet = drawing.page.height() >= A4_HEIGHT;
    let shrunk = if is_sheet { 1.0 } else { (drawing.page.width() / WIDEST).max(1.0) };
    let is_digits = |item: &&Item| item.words.chars().all(|c| c.is_ascii_digit());
    let numbers = drawing.of("number-across").chain(drawing.of("number-upwards")).filter(is_digits);
    let small = numbers.filter(|item| item.bounds.height() / shrunk < LEAST_DIGIT);
    small
        .map(|item| format!("the digits of {:?} are {:.0} pixels high", item.words, item.bounds.height()))
        .collect()
}

fn words_are_those_of_the_field(drawing: &Drawing) -> Vec<String> {
    let wrong = |words: &str| {
        // A version of the code is no number, and may look like one.
        let words = words.split_once(" · code ").map_or(words, |(words, _)| words);
        let power = words.split(|c: char| !(c.is_ascii_alphanumeric() || c == '−' || c == '-')).any(|word| {
            word.split_once('e')
                .is_some_and(|(digits, _)| !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit()))
        });
        power || words.contains("F_X") || words.contains("μ_k")
    };
    let wrong = drawing.items.iter().filter(|item| wrong(&item.words));
    wrong.map(|item| format!("{:?} is not how the field writes it", item.words)).collect()
}

const RULES: [(&str, Rule); 11] = [
    ("page", everything_is_on_the_page),
    ("marks", numbers_are_on_their_marks),
    ("text", text_is_not_upon_text),
    ("legend", legends_hide_no_data),
    ("twice", a_legend_says_a_thing_once),
    ("strokes", strokes_have_one_width),
    ("empty", axes_are_not_empty),
    ("floor", marks_say_something),
    ("bars", bars_are_not_one_surface),
    ("letters", letters_are_of_full_size),
    ("words", words_are_those_of_the_field),
];

/// Axes whose ends are given by the example, figures of a single run, and maps of the whole area.
const EMPTY_BY_REQUEST: [&str; 6] =
    ["with/front-speed", "with/spread", "with/study", "with/slipped", "with/arrival-map", "with/outlines"];

/// Of recordings; those of runs say that there is nothing to draw.
pub(crate) const OF_RECORDINGS: [&str; 2] = ["with/noise", "with/traces"];

/// One test, so that figures are drawn once, even if tests run one after the other.
#[test]
fn every_kind_of_figure_looks_right_and_says_what_it_is() {
    let folders = drawn();
    figures_look_right(&folders);
    figures_say_what_they_are_and_the_code_only_if_wanted(&folders);
    every_rule_can_fail(&folders.with[0].join("load.svg"));
}

fn figures_look_right(folders: &Drawn) {
    let drawn = files(&folders.with, "svg");
    assert!(drawn.len() >= 21, "{:?}", drawn.keys());
    let (mut flaws, mut bars) = (Vec::new(), 0);
    for (name, path) in drawn.iter().filter(|(name, _)| !OF_RECORDINGS.contains(&name.as_str())) {
        let drawing = drawing(path);
        bars += drawing.items.iter().filter(|item| is_bar(item)).count();
        assert!(drawing.of("data").count() > 0 && drawing.of("frame").count() > 0, "{name}");
        for (rule, check) in RULES {
            let is_asked_for = rule == "empty" && EMPTY_BY_REQUEST.contains(&name.as_str());
            // Each picture of that page has its legend.
            if is_asked_for || (rule == "twice" && name == "with/overview") {
                continue;
            }
            flaws.extend(check(&drawing).into_iter().map(|flaw| format!("{name}: {rule}: {flaw}")));
        }
    }
    assert!(EMPTY_BY_REQUEST.iter().all(|name| drawn.contains_key(*name)), "{:?}", drawn.keys());
    assert!(flaws.is_empty(), "{}", flaws.join("\n"));
    assert!(bars >= 5, "{bars} colour bars");
}

/// Each rule finds its own flaw in a figure that has it.
fn every_rule_can_fail(svg: &Path) {
    let load = || drawing(svg);
    let first = |drawing: &Drawing, class: &str| {
        let at = drawing.items.iter().position(|item| item.class == class);
        at.unwrap_or_else(|| panic!("{class} is on the figure"))
    };
    let broken: [(&str, Damage<'_>); 12] = [
        ("page", &|drawing| {
            let label = first(drawing, "label");
            drawing.items[label].shift(-300.0, 0.0);
        }),
        ("marks", &|drawing| {
            let number = first(drawing, "number-upwards");
            drawing.items[number].shift(0.0, -7.0);
        }),
        ("marks", &|drawing| {
            let number = first(drawing, "number-across");
            drawing.items[number].shift(2.0, 0.0);
        }),
        ("text", &|drawing| {
            let (label, number) = (first(drawing, "label"), first(drawing, "number-upwards"));
            let ((x, y), (to_x, to_y)) =
                (drawing.items[label].bounds.middle(), drawing.items[number].bounds.middle());
            drawing.items[label].shift(to_x - x, to_y - y);
        }),
        ("legend", &|drawing| {
            let (legend, data) = (first(drawing, "legend"), first(drawing, "data"));
            let ((x, y), (to_x, to_y)) =
                (drawing.items[legend].bounds.middle(), drawing.items[data].bounds.middle());
            drawing.items[legend].shift(to_x - x, to_y - y);
        }),
        ("twice", &|drawing| {
            let again = drawing.items[first(drawing, "legend")].clone();
            drawing.items.push(again);
        }),
        ("strokes", &|drawing| {
            let data = first(drawing, "data");
            drawing.items[data].stroke_width = Some(2.8);
        }),
        ("empty", &|drawing| {
            for item in drawing.items.iter_mut().filter(|item| item.class == "data") {
                item.squeeze(0.4);
            }
        }),
        ("floor", &|drawing| {
            let frame = drawing.items[first(drawing, "frame")].bounds;
            let data = drawing.items[first(drawing, "data")].clone();
            for n in 0..60 {
                let (x, y) =
                    (frame.left + 20.0 * f64::from(n), if n == 0 { frame.top } else { frame.bottom });
                drawing.items.push(data.clone().at(&[(x, y), (x + 10.0, y)]));
            }
        }),
        ("bars", &|drawing| {
            let frame = drawing.items[first(drawing, "frame")].bounds;
            let data = drawing.items[first(drawing, "data")].clone();
            for n in 0..(frame.width() / 2.0) as usize {
                let (x, y) = (frame.left + 2.0 * n as f64, frame.middle().1);
                let mut bar = data.clone();
                bar.stroke_width = Some(2.0);
                drawing.items.push(bar.at(&[(x, y), (x, y + 10.0)]));
            }
        }),
        ("letters", &|drawing| drawing.page.right *= 2.0),
        ("words", &|drawing| {
            let number = first(drawing, "number-across");
            drawing.items[number].words = "1e-8".to_owned();
        }),
    ];
    for (name, (_, check)) in RULES.iter().map(|rule| (rule.0, rule)) {
        assert!(check(&load()).is_empty(), "{name}: the figure is right before it is broken");
        let mine: Vec<_> = broken.iter().filter(|(rule, _)| *rule == name).collect();
        assert!(!mine.is_empty(), "{name} is broken by nothing");
        for (_, damage) in mine {
            let mut drawing = load();
            damage(&mut drawing);
            assert!(!check(&drawing).is_empty(), "{name} sees nothing wrong");
        }
    }
    let field = |words: &str| {
        let mut drawing = load();
        let label = first(&drawing, "label");
        drawing.items[label].words = words.to_owned();
        words_are_those_of_the_field(&drawing).len()
    };
    assert_eq!(["F_X/F_N", "μ_k", "10^−8 s", "the slider"].map(field), [1, 1, 0, 0]);
}

/// The code version, hexadecimal, as the figures have it.
fn code_version(svg: &str) -> Option<&str> {
    svg.split_once("<code-version>")?.1.split_once('<').map(|(version, _)| version)
}

/// A PDF without its compressed streams, whose bytes are arbitrary.
fn outside_streams(pdf: &[u8]) -> Vec<u8> {
    let at = |bytes: &[u8], words: &[u8]| bytes.windows(words.len()).position(|part| part == words);
    let (mut rest, mut outside) = (pdf, Vec::new());
    while let Some(begin) = at(rest, b"stream\n") {
        outside.extend(&rest[..begin]);
        let end = at(&rest[begin..], b"endstream").expect("a stream ends");
        rest = &rest[begin + end + b"endstream".len()..];
    }
    outside.extend(rest);
    outside
}

/// The chunks of a PNG before those of its pixels, each from its name to the end of its data.
fn chunks_before_the_pixels(png: &[u8]) -> Vec<&[u8]> {
    let (mut rest, mut chunks) = (&png[8..], Vec::new());
    while !rest[4..].starts_with(b"IDAT") {
        let length = u32::from_be_bytes(rest[..4].try_into().expect("four bytes")) as usize;
        chunks.push(&rest[4..8 + length]);
        rest = &rest[12 + length..];
    }
    chunks
}

fn figures_say_what_they_are_and_the_code_only_if_wanted(folders: &Drawn) {
    let contains =
        |bytes: &[u8], words: &str| bytes.windows(words.len()).any(|part| part == words.as_bytes());
    let (with, without) = (files(&folders.with, "svg"), files(&folders.without, "svg"));
    assert!(without.len() > WITHOUT_CODE.len(), "of a study, too: {:?}", without.keys());
    for (name, path) in &with {
        let svg = fs::read_to_string(path).expect("the SVG is text");
        for element in ["title", "desc", "scenario", "parameter-set", "time-step"] {
            let begun =
                svg.split_once(&format!("<{element}>")).unwrap_or_else(|| panic!("{name}: no {element}"));
            assert!(begun.1.find('<').is_some_and(|length| length > 2), "{name}: {element} is empty");
        }
        let version = code_version(&svg).unwrap_or_else(|| panic!("{name} names no code"));
        assert_eq!(drawing(path).of("foot").count(), 1, "{name}");
        let short = &version[..12];
        let read = |ending: &str| fs::read(path.with_extension(ending)).expect("it is there");
        // No date, which PDF would have as (D:2026...), and no random name.
        let pdf = outside_streams(&read("pdf"));
        assert!(contains(&pdf, short), "{name}.pdf names no code");
        assert!(!contains(&pdf, "(D:") && !contains(&pdf, "/ID"), "{name}.pdf");
        let png = read("png");
        assert!(contains(&png, short), "{name}.png names no code");
        let chunks = chunks_before_the_pixels(&png);
        let has = |name: &[u8]| chunks.iter().any(|chunk| chunk.starts_with(name));
        assert!(has(b"pHYs") && !has(b"tIME"), "{name}.png has no resolution, or a date");
        for keyword in ["Title\0", "time-step\0", "Description\0"] {
            assert!(
                chunks.iter().any(|chunk| chunk[4..].starts_with(keyword.as_bytes())),
                "{name}.png has no {keyword:?}"
            );
        }
    }
    for (name, path) in &without {
        let svg = fs::read_to_string(path).expect("the SVG is text");
        assert_eq!((code_version(&svg), drawing(path).of("foot").count()), (None, 0), "{name}");
        let version =
            with.values().next().and_then(|path| fs::read_to_string(path).ok()).expect("it is there");
        let version = code_version(&version).expect("it names the code")[..12].to_owned();
        for ending in ["svg", "png", "pdf"] {
            let bytes = fs::read(path.with_extension(ending)).expect("it is there");
            assert!(!contains(&bytes, &version), "{name}.{ending} names the code");
        }
        assert!(svg.contains("<scenario>"), "{name}");
    }
}
