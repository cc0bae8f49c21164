//! Pictures of contacts over an area: figures of a run and its page, of small sheets and bodies.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{outcome, run, succeed, text, with_sets};
use crate::support::browser::{Tab, browser};
use crate::support::small;

/// A sheet of 11 columns and 3 rows, with two precursors in 1 s.
fn sheet(folder: &Path) -> PathBuf {
    let log = folder.join("sheet.mcap");
    let set = ["slider.blocks=11", "slider.across=3", "time.step_s=1e-6", "time.duration_s=1"];
    run(&with_sets(&["sheet-coarse"], &set), &log);
    log
}

/// A body of 8 x 2 x 5 nodes, which moves for a few steps.
fn body(folder: &Path) -> PathBuf {
    let log = folder.join("body.mcap");
    let set = [
        "slider.blocks=8",
        "slider.across=2",
        "slider.rows=5",
        "slider.height_m=0.08",
        "time.duration_s=4e-6",
    ];
    run(&with_sets(&["body-coarse"], &set), &log);
    log
}

/// What a figure of a kind is refused for.
fn refused(log: &Path, kind: &str, set: &[&str], out: &Path) -> String {
    let draw = ["draw", text(log), "--kind", kind, "-o", text(out), "--force"];
    let (code, _, said) = outcome(&with_sets(&draw, set));
    assert_ne!(code, 0, "{kind} {set:?}");
    said
}

#[test]
fn each_kind_is_drawn_of_a_log_with_the_same_bytes_each_time() {
    let folder = asperity_testkit::folder();
    let (sheet, body) = (sheet(folder.path()), body(folder.path()));
    let figures: [(&Path, &str, &[&str]); 8] = [
        (&sheet, "arrival-map", &[]),
        (&sheet, "arrival-map", &["shows=slip", "which=longest-precursor"]),
        (&sheet, "area-field", &["at_s=[0.9]", "shows=slip"]),
        (&sheet, "film-strip", &["panels=3", "shows=stress", "arrows=true"]),
        (&sheet, "outlines", &[]),
        (&body, "area-field", &["at_s=[0.0]"]),
        (&body, "slab-field", &["shows=pressure"]),
        (&body, "slab-field", &["row=2"]),
    ];
    for (log, kind, set) in figures {
        for ending in ["png", "svg", "pdf"] {
            let files = ["a", "b"].map(|name| folder.path().join(format!("{name}.{ending}")));
            for file in &files {
                let draw = ["draw", text(log), "--kind", kind, "-o", text(file), "--force"];
                succeed(&with_sets(&draw, set));
            }
            let [one, again] = files.map(|file| fs::read(file).expect("it was written"));
            assert!(one == again && one.len() > 1000, "{kind} {set:?} {ending}: {} bytes", one.len());
        }
    }
    // Without a kind, those over an area are among the usual ones; of a chain they are not.
    let drawn = succeed(&["draw", text(&sheet)]);
    assert!(drawn.contains("arrival-map.svg") && drawn.contains("outlines.pdf"), "{drawn}");
    let chain = folder.path().join("chain.mcap");
    small::run(&chain);
    assert!(!succeed(&["draw", text(&chain)]).contains("arrival-map"));
    let out = folder.path().join("a.png");
    let row = refused(&chain, "film-strip", &[], &out);
    assert!(
        row.contains("the contacts of run chain lie in a single row (accepted: a run over an area"),
        "{row}"
    );
    let field = refused(&sheet, "slab-field", &[], &out);
    assert!(field.contains("run sheet is of a sheet, which has no inside"), "{field}");
    let blocks = refused(&sheet, "front-transient", &[], &out);
    assert!(blocks.contains("cover an area, and this figure follows blocks along a row"), "{blocks}");
    let key = refused(&sheet, "area-field", &["shows=speed"], &out);
    assert!(
        key.contains("--set shows=speed is not accepted (accepted: stress, slip, velocity, normal-load)"),
        "{key}"
    );
}

/// A film's times are known only once the run has passed; a pipeline computes them as `draw` does.
#[test]
fn a_pipeline_draws_films_of_ruptures() {
    let folder = asperity_testkit::folder();
    let pipeline = folder.path().join("film.toml");
    let toml = "title = \"A film\"\n[[run]]\nname = \"sheet\"\nscenario = \"sheet-coarse\"\n\
                set = [\"slider.blocks=11\", \"slider.across=3\", \"time.step_s=1e-6\", \"time.duration_s=1\"]\n\
                [[figure.film-strip]]\nfile = \"film.png\"\nrun = \"sheet\"\npanels = 3\n";
    fs::write(&pipeline, toml).expect("the folder can be written");
    let out = folder.path().join("film");
    succeed(&["reproduce", text(&pipeline), "-o", text(&out), "--quiet", "--no-provenance"]);
    let log = out.join("runs/sheet.mcap");
    let drawn = folder.path().join("drawn.png");
    succeed(&[
        "draw",
        text(&log),
        "--kind",
        "film-strip",
        "--set",
        "panels=3",
        "-o",
        text(&drawn),
        "--no-provenance",
    ]);
    let [of_pipeline, of_log] =
        [out.join("figures/film.png"), drawn].map(|file| fs::read(file).expect("it was drawn"));
    assert!(of_pipeline == of_log);
    // The page of the study has the map of the run, and its figures.
    let page = fs::read_to_string(out.join("report.html")).expect("the study has a page");
    assert!(page.contains("<g class=\"cells\">") && page.contains("film.png"));
}

#[test]
fn the_page_of_a_run_has_a_map_over_the_area_without_scripts_and_with_them() {
    let folder = asperity_testkit::folder();
    let log = sheet(folder.path());
    let page = folder.path().join("sheet.html");
    succeed(&["report", text(&log), "--out", text(&page)]);
    let html = fs::read_to_string(&page).expect("the page is there");
    let (_, map) = html.split_once("<g class=\"cells\">").expect("the page has a map");
    let (cells, _) = map.split_once("</g>").expect("the map ends");
    assert_eq!(cells.matches("<path").count(), 33);
    let slid = cells.matches("class=\"b").count();
    assert!(slid >= 6 && cells.matches("class=\"n\"").count() == 33 - slid, "{slid}");
    assert!(html.contains("a lattice all of whose nodes rub, 11 × 3 nodes"));
    let chain = folder.path().join("chain.mcap");
    small::run(&chain);
    let of_chain = folder.path().join("chain.html");
    succeed(&["report", text(&chain), "--out", text(&of_chain)]);
    assert!(!fs::read_to_string(&of_chain).unwrap().contains("class=\"over-area\""));

    let Some(browser) = browser() else { return };
    let mut tab = Tab::open(&browser, &page, [1280, 1400], "light");
    const SHOWN: &str = "document.documentElement.dataset.overArea";
    let widest = tab.says(SHOWN);
    assert!(widest.ends_with(&format!(" arrival {slid}")), "{widest}");
    // The copy has the colours of the map that the page has.
    let colours =
        "[...document.querySelectorAll('WHERE .cells path')].map((one) => one.className.baseVal).join()";
    let of = |place: &str| colours.replace("WHERE", place);
    assert_eq!(tab.says(&of("#over-area")), tab.says(&of("#run-sheet")));
    let marks = "document.querySelectorAll('WHERE .first circle').length";
    assert_eq!(
        tab.says(&marks.replace("WHERE", "#over-area")),
        tab.says(&marks.replace("WHERE", "#run-sheet"))
    );
    // The one that is picked in the table is shown.
    tab.click_on("#ruptures tbody tr");
    let picked = tab.says("document.documentElement.dataset.chosen");
    assert!(tab.says(SHOWN).starts_with(&format!("{picked} arrival ")), "{}", tab.says(SHOWN));
    let said = tab.says("document.querySelector('#over-area .about').textContent");
    assert!(
        said.starts_with(&format!("Rupture {picked}, ")) && said.contains("when its front came"),
        "{said}"
    );
    tab.eval(
        "(() => { const shows = document.getElementById('over-area-shows'); shows.value = 'slip'; \
         shows.dispatchEvent(new Event('change')); })()",
    );
    assert!(tab.says(SHOWN).starts_with(&format!("{picked} slip ")));
    assert!(tab.says("document.querySelector('#over-area .to').textContent").ends_with(" µm"));
    tab.press("Escape");
    tab.assert_quiet();
}
