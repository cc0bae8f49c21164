//! Figures, pages and comparisons of recordings: they show what was measured with its errors, and no parameter or theory
//! of a simulation.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{names, outcome, succeed, text};
use crate::support::clients::file;
use crate::support::small;

/// The log of the recording with sensors of slip.
fn lab(folder: &Path) -> PathBuf {
    let log = folder.join("lab.mcap");
    let description = file("fixtures/recordings/slip/recording.toml");
    succeed(&["--quiet", "recording", "read", text(&description), "-o", text(&log)]);
    log
}

/// What the description of a figure says.
fn said(log: &Path, kind: &str, set: &[&str]) -> String {
    let out = log.with_file_name(format!("{kind}.svg"));
    let mut words = vec!["draw", text(log), "--kind", kind, "--force", "-o", text(&out)];
    set.iter().for_each(|set| words.extend(["--set", set]));
    succeed(&words);
    let svg = fs::read_to_string(&out).expect("it is drawn");
    let (_, from) = svg.split_once("<desc>").expect("it is described");
    from.split_once("</desc>").expect("the description ends").0.to_owned()
}

#[test]
fn usual_figures_show_what_was_measured_and_no_theory() {
    let folder = asperity_testkit::folder();
    let log = lab(folder.path());
    succeed(&["draw", text(&log)]);
    let drawn = names(&folder.path().join("lab.figures"));
    for kind in ["load", "lengths", "space-time", "traces", "noise"] {
        assert!(drawn.contains(&format!("{kind}.pdf")), "{drawn:?}");
    }
    assert!(!drawn.contains("overview.png") && !drawn.contains("stress-sequence.png"), "{drawn:?}");
    assert!(
        said(&log, "load", &[]).ends_with("F_T (N); F_N (N) against t (s). Shown: F_T, 64 load drops, F_N.")
    );
    assert!(said(&log, "lengths", &[]).ends_with("L_p/L against F_T/F_N. Shown: lab."));
    // The rows of the independent program have 1269 and 29 m/s.
    let zoomed = said(&log, "space-time", &["which=first-global-slip"]);
    assert!(zoomed.contains("x (mm)") && zoomed.contains("front, 1270 ± 29 m/s, arrivals"), "{zoomed}");
    assert!(said(&log, "noise", &[]).contains("steps, least step that counts, noise σ"));
    let traces = said(&log, "traces", &["which=first-global-slip"]);
    assert!(
        traces.contains(": rupture 13. x (mm) against t − 2.433866 s (µs). Shown: front, 1270 ± 29 m/s, arrivals, 10 mm upwards: "),
        "{traces}"
    );
    for kind in ["load-ruptures", "recurrence", "moment-duration"] {
        let said = said(&log, kind, &[]);
        assert!(!["μ", "theory", "block"].iter().any(|word| said.contains(word)), "{said}");
    }
}

#[test]
fn what_nobody_measured_is_not_drawn() {
    let folder = asperity_testkit::folder();
    let log = lab(folder.path());
    let refused = |words: &[&str]| {
        let out = folder.path().join("refused.png");
        let (code, _, said) = outcome(&[&["draw", text(&log), "-o", text(&out)], words].concat());
        assert!(code != 0 && !out.exists(), "{words:?}");
        said
    };
    for kind in ["stress", "overview", "forces", "front-profile"] {
        let said = refused(&["--kind", kind]);
        assert!(
            said.contains("shows what only a simulation knows (accepted: load, lengths, space-time,"),
            "{said}"
        );
    }
    let said = refused(&["--kind", "lengths", "--set", "law=linear"]);
    assert!(said.contains("no run is of one (accepted: no law"), "{said}");
    let run = folder.path().join("mine.mcap");
    small::run(&run);
    for kind in ["noise", "traces"] {
        let (code, _, said) = outcome(&["draw", text(&run), "--kind", kind]);
        assert!(code == 1 && said.contains("has nothing that figures of this kind show"), "{said}");
    }
}

#[test]
fn a_page_says_what_was_measured_and_how_well() {
    let folder = asperity_testkit::folder();
    let (log, page) = (lab(folder.path()), folder.path().join("lab.html"));
    succeed(&["report", text(&log), "-o", text(&page)]);
    let page = fs::read_to_string(page).expect("the page is there");
    let (words, _) = page.split_once("<script").expect("the page has a script");
    for part in [
        "<h2>What was measured</h2>",
        "8 sensors of slip from 18.18 to 94.95 mm",
        "<dt>load drops</dt><dd><b>64</b>",
        "0.899 ± 0.029",
        "0.875 ± 0.020",
        "alt=\"Lengths of precursors",
    ] {
        assert!(words.contains(part), "{part}");
    }
    for foreign in ["What was asked", "All parameters", "μ<sub>", "Young", "href=\"lab-"] {
        assert!(!words.contains(foreign), "{foreign}");
    }
}

#[test]
fn a_recording_is_compared_with_a_run() {
    let folder = asperity_testkit::folder();
    let (log, run, page) =
        (lab(folder.path()), folder.path().join("mine.mcap"), folder.path().join("diff.html"));
    small::run(&run);
    let (code, said, _) = outcome(&["diff", text(&log), text(&run), "--page", text(&page)]);
    assert_eq!(code, 1, "{said}");
    for part in [
        "sizes below the whole slider, L: ",
        "fronts, m/s: ",
        "falls of F_T/F_N: ",
        "ft_fn when L_p/L >= 0.5",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    assert!(!said.contains("set differently"), "a description has other keys than a scenario: {said}");
    let page = fs::read_to_string(page).expect("the page is there");
    assert!(page.contains("old: slip, measured") && page.contains("Load against time"), "both are drawn");
}
