//! `asperity draw`: figures of one run without a pipeline; where no key and no foot are beside the panels,
//! they have the bytes of a pipeline's.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use asperity_figures::draw::of_one_run::Kind;

use crate::support::binary::{names, outcome, succeed, text, with_sets};
use crate::support::clients::file;
use crate::support::small;

/// The exit code, and the output on both streams.
fn draw(arguments: &[&str]) -> (i32, String, String) {
    outcome(&[&["draw"], arguments].concat())
}

#[test]
fn the_usual_kinds_stand_beside_the_log() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("mine.mcap");
    small::run(&log);
    let (code, out, err) = draw(&[text(&log)]);
    assert_eq!(code, 0, "{err}");
    let figures = folder.path().join("mine.figures");
    let printed: BTreeSet<String> =
        out.lines().map(|line| line.rsplit('/').next().expect("a name").to_owned()).collect();
    assert_eq!(printed, names(&figures));
    for kind in ["overview", "lengths", "space-time", "front-profile"] {
        for ending in ["png", "svg", "pdf"] {
            assert!(printed.contains(&format!("{kind}.{ending}")), "{printed:?}");
        }
    }
    // Draws the figure if states are recorded at the events of this run, or reports that there are none.
    assert!(printed.contains("stress-sequence.png") != err.contains("stress-sequence"), "{err}");
    let before = fs::read(figures.join("overview.png")).expect("it is there");
    let (code, _, err) = draw(&[text(&log)]);
    assert!(code == 2 && err.contains("exists already") && err.contains("--force"), "{code}: {err}");
    assert_eq!(draw(&[text(&log), "--force"]).0, 0);
    assert_eq!(fs::read(figures.join("overview.png")).expect("it is there"), before);
}

/// Each kind of the list is drawn, or reports what the run lacks and leaves no file.
#[test]
fn every_kind_is_drawn_or_says_why_not() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("mine.mcap");
    small::run(&log);
    let mut drawn = 0;
    for Kind { name: kind } in Kind::all() {
        let out = folder.path().join(kind);
        let (code, _, err) = draw(&[text(&log), "--kind", kind, "-o", text(&out)]);
        match code {
            0 => {
                assert_eq!(names(&out).len(), 3, "{kind}");
                drawn += 1;
            }
            _ => {
                let says = err.starts_with(&format!("error: figure {kind}: "));
                assert!(code == 1 && says && !out.exists(), "{kind}: {code}: {err}");
            }
        }
    }
    assert!(drawn > 14, "{drawn} kinds");
}

#[test]
fn a_figure_has_the_bytes_of_a_pipeline() {
    let folder = asperity_testkit::folder();
    let pipeline = folder.path().join("p.toml");
    let toml = format!(
        "title = 'One'\n[[run]]\nname = 'a'\nscenario = 'ten-blocks'\nset = {:?}\n\
         [figure]\nload = [{{ file = 'load.png', run = 'a', sliding = true }}]\n\
         curve = [{{ curve = 'forces', file = 'forces.png', run = 'a', keys.from_s = 0.5, title = 'Late' }}, \
         {{ curve = 'slipped', file = 'slipped.png', series = [{{ run = 'a', label = 'a' }}] }}]\n",
        small::SETS
    );
    fs::write(&pipeline, toml).expect("the folder can be written");
    let made = folder.path().join("made");
    succeed(&["reproduce", text(&pipeline), "--quiet", "--no-provenance", "-o", text(&made)]);
    let log = made.join("runs/a.mcap");
    let sets: [(&str, &[&str]); 3] =
        [("load", &[]), ("forces", &["from_s=0.5", "title=Late"]), ("slipped", &[])];
    for (kind, set) in sets {
        let out = folder.path().join("drawn");
        let draw_to = |out: &Path| {
            let words = [text(&log), "--kind", kind, "--no-provenance", "-o", text(out)];
            assert_eq!(draw(&with_sets(&words, set)).0, 0, "{kind}");
        };
        draw_to(&out);
        for ending in ["png", "svg", "pdf"] {
            let file = format!("{kind}.{ending}");
            let bytes = |folder: &Path| fs::read(folder.join(&file)).expect("it is there");
            assert!(bytes(&out) == bytes(&made.join("figures")), "{file} differs");
            // A single file has the bytes of that in a folder.
            let alone = folder.path().join(&file);
            draw_to(&alone);
            assert!(fs::read(&alone).expect("it is there") == bytes(&out), "{file} differs");
        }
    }
    assert_eq!(names(folder.path()).len(), 2 + 1 + 9);
}

/// No window is recorded: the velocities of a rupture of a chain are computed, unless another version made the log.
#[test]
fn a_rupture_has_velocities_without_a_window() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("mine.mcap");
    small::run(&log);
    let drawn = |log: &Path, more: &[&str]| {
        let out = folder.path().join("map.svg");
        let words = [text(log), "--kind", "space-time", "--force", "-o", text(&out)];
        let (_, _, err) = draw(&with_sets(&words, more));
        (fs::read_to_string(&out).expect("it is drawn").contains("|v_n| (m/s)"), err)
    };
    assert!(drawn(&log, &["which=widest"]).0);
    assert!(!drawn(&log, &["which=widest", "recorded_only=true"]).0);
    assert!(!drawn(&log, &[]).0);
    let (has_velocities, err) = drawn(&file("fixtures/logs/interrupted.mcap"), &["which=widest"]);
    assert!(!has_velocities && err.contains("no states are computed: "), "{err}");
}

/// Errors in the arguments are reported before the log is read.
#[test]
fn wrong_words_are_refused_at_once() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("not-read.mcap");
    fs::write(&log, "not a log").expect("the folder can be written");
    let refused: [(&[&str], &str); 8] = [
        (
            &["--kind", "space-tim"],
            "--kind space-tim is no kind of figure; did you mean space-time? (accepted: ",
        ),
        (
            &["-o", "map.jpg"],
            "--out map.jpg: figures are not written in this format (accepted: a name that ends in",
        ),
        (&["--kind", "study"], "--kind study is no kind of figure"),
        (&["--set", "title=A"], "--set title=A: several kinds are drawn"),
        (&["--kind", "load,stress", "--set", "title=A"], "accepted: --set with one --kind"),
        (
            &["--kind", "stress", "--set", "at=1"],
            "--set at: figures of the kind stress have no such key (accepted: at_s, title, width_mm)",
        ),
        (&["--kind", "stress", "--set", "at_s=soon"], "--set at_s=soon is not accepted (accepted: a list)"),
        (&["-o", "one.png"], "--out one.png is one file, and several kinds are drawn"),
    ];
    for (words, says) in refused {
        let (code, _, err) = draw(&[&[text(&log)], words].concat());
        assert!(code == 2 && err.contains(says), "{words:?}: {code}: {err}");
    }
    assert_eq!(draw(&[text(&log)]).0, 2);
    assert_eq!(draw(&[]).0, 2);
    assert_eq!(names(folder.path()).len(), 1);
}
