//! Figures of a parameter study: they show the values of the tables, however they were made, and unknown
//! names are refused before any run is made.

use std::fs;
use std::path::Path;

use crate::support::binary::{contents, ends, succeed, text};
use crate::sweep::Study;

/// A sweep of a few seconds: tilts, stiffnesses by factors, and a spread of friction with two seeds.
const SWEEP: &str = "
title = 'Short runs'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=1.5', 'friction.static_spread=0.05']
[[axis]]
key = 'normal_load.tilt'
values = [-0.5, 0, 0.5]
[[axis]]
key = 'friction.interfacial_stiffness_ratio'
from = 0.05
to = 0.5
count = 2
spacing = 'log'
[[axis]]
key = 'friction.spread_seed'
values = [1, 2]
";

const FIGURES: &str = "
[[figure.family]]
file = 'map.png'
x = 'normal_load.tilt'
y = 'friction.interfacial_stiffness_ratio'
colour = 'first_slip_s'
over = ['friction.spread_seed']
[[figure.family]]
file = 'family.png'
x = 'normal_load.tilt'
y = 'first_slip_ft_fn'
colour = 'friction.interfacial_stiffness_ratio'
over = ['friction.spread_seed']
[[figure.family]]
file = 'lengths.png'
x = 'ft_fn_onset'
y = 'length_ratio'
colour = 'normal_load.tilt'
facet = 'friction.interfacial_stiffness_ratio'
at = ['friction.spread_seed=1']
";

/// The bytes of the figures in a folder, by name.
fn pictures(folder: &Path) -> Vec<(String, Vec<u8>)> {
    contents(folder).into_iter().collect()
}

fn names(pictures: &[(String, Vec<u8>)]) -> Vec<&str> {
    pictures.iter().map(|(name, _)| name.as_str()).collect()
}

/// The files of the figures.
const NAMES: [&str; 9] = [
    "family.pdf",
    "family.png",
    "family.svg",
    "lengths.pdf",
    "lengths.png",
    "lengths.svg",
    "map.pdf",
    "map.png",
    "map.svg",
];

/// In parts and another order, from results or with tables of any format: the same bytes.
#[test]
fn figures_depend_on_the_plan_alone() {
    let study = Study::of(&format!("{SWEEP}{FIGURES}"));
    let one = study.plan("one");
    succeed(&["sweep", "run", text(&one), "--jobs", "1"]);
    let said = succeed(&["sweep", "collect", text(&one)]);
    assert!(said.contains("one/figures/lengths.png"), "{said}");
    let expected = pictures(&one.join("figures"));
    assert_eq!(names(&expected), NAMES);
    assert!(expected.iter().all(|(_, bytes)| bytes.len() > 5000));
    // The page and the files name the two seeds of a cell.
    let page = fs::read_to_string(one.join("report.html")).expect("the page is there");
    let svg = fs::read_to_string(one.join("figures/map.svg")).expect("the figure is there");
    for place in [page, svg] {
        assert!(place.contains("; median of 2 runs per cell."));
    }

    let parts = study.plan("parts");
    for part in ["3/3", "1/3", "2/3"] {
        succeed(&["sweep", "run", text(&parts), "--chunk", part]);
    }
    succeed(&["sweep", "collect", text(&parts), "--to", "csv", "-o", text(&study.path("csv"))]);
    assert!(expected == pictures(&study.path("csv/figures")), "by parts, beside tables as CSV");
    assert!(!parts.join("figures").exists());
    succeed(&["sweep", "draw", text(&parts)]);
    assert!(expected == pictures(&parts.join("figures")), "without tables");
    assert!(!parts.join("tables").exists());
    // Other figures of the same runs; the plan stays as it is.
    let plan = fs::read(parts.join("plan.ndjson")).expect("it is there");
    study.write("other.toml", &format!("{SWEEP}{}", FIGURES.replace("first_slip_s", "event_count")));
    let other = study.path("other");
    succeed(&["sweep", "draw", text(&parts), "--from", text(&study.path("other.toml")), "-o", text(&other)]);
    let drawn = pictures(&other);
    assert!(drawn[..6] == expected[..6] && drawn[7] != expected[7]);
    assert_eq!(plan, fs::read(parts.join("plan.ndjson")).expect("it is there"));
}

/// A missing value is no zero: an empty place, not the colour or the height of zero.
#[test]
fn a_number_that_is_missing_is_a_gap() {
    let study = Study::of(&format!("{SWEEP}{FIGURES}"));
    let out = study.plan("study");
    // Before any run is made there are only frames.
    ends(3, &["sweep", "draw", text(&out)], &[]);
    let empty = pictures(&out.join("figures"));
    assert_eq!(names(&empty), NAMES);
    // Both seeds of the first place, then all places but that.
    succeed(&["sweep", "run", text(&out), "--index", "1-2"]);
    ends(3, &["sweep", "draw", text(&out)], &[]);
    let some = pictures(&out.join("figures"));
    succeed(&["sweep", "run", text(&out), "--index", "3-12"]);
    succeed(&["sweep", "draw", text(&out)]);
    let whole = pictures(&out.join("figures"));
    for ((empty, some), whole) in empty.iter().zip(&some).zip(&whole) {
        assert!(empty != some && some != whole, "{}", empty.0);
    }
    // In a second and a half no slider slips as a whole: all places are empty, and none is crossed out.
    let none = FIGURES.replace("first_slip_s", "recurrence_steady_s");
    let none = none.replace("first_slip_ft_fn", "recurrence_steady_s");
    study.write("none.toml", &format!("{SWEEP}{none}"));
    let to = study.path("none");
    succeed(&["sweep", "draw", text(&out), "--from", text(&study.path("none.toml")), "-o", text(&to)]);
    let none = pictures(&to);
    assert!(none[2] != empty[2], "runs without the number are no missing runs");
}

#[test]
fn figures_are_drawn_of_what_the_plan_has() {
    let study = Study::of(SWEEP);
    let out = study.plan("study");
    let refused = |arguments: &[&str], problem: &str| {
        ends(2, &[&["sweep", "draw", text(&out)], arguments].concat(), &[problem]);
        assert!(!out.join("figures").exists());
    };
    refused(&[], "plan.ndjson asks for no figures (accepted: [[figure.family]]");
    study.write(
        "other.toml",
        &SWEEP.replace("normal_load.tilt", "slider.mass_kg").replace("[-0.5, 0, 0.5]", "[1]"),
    );
    refused(&["--from", text(&study.path("other.toml"))], "it varies slider.mass_kg, ");
    study.write("torn.toml", "title = ");
    refused(&["--from", text(&study.path("torn.toml"))], "torn.toml: ");
}

/// Length laws are those of chains.
#[test]
fn precursors_of_slabs_have_no_law() {
    let study = Study::of(
        "title = 'Slabs'\nscenario = 'slab'\nset = ['slider.blocks=29', 'slider.rows=16', \
         'time.step_s=4e-7', 'time.duration_s=0.21']\n[[axis]]\nkey = 'friction.dynamic_coefficient'\n\
         values = [0.17, 0.2]\n[[figure.family]]\nfile = 'lengths.png'\nx = 'ft_fn_onset'\n\
         y = 'length_ratio'\ncolour = 'friction.dynamic_coefficient'",
    );
    let out = study.plan("study");
    succeed(&["sweep", "run", text(&out)]);
    succeed(&["sweep", "collect", text(&out)]);
    let drawing = fs::read_to_string(out.join("figures/lengths.svg")).expect("it was drawn");
    let (_, said) = drawing.split_once("<desc>").expect("a figure says what it shows");
    let (said, _) = said.split_once("</desc>").expect("in one place");
    assert!(said.contains("Shown: ") && said.contains("simulated"), "{said}");
    assert!(!said.contains("5.57"), "{said}");
}
