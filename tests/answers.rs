//! Pages in a real browser, on a desktop and on a phone, in light and dark mode: the verdict on a run
//! without scrolling, the front of a rupture, the run behind each cell and row, symbols instead of markup.
//!
//! Tests that need Chromium skip without it, see `support/browser.rs`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::report::study;
use crate::support::binary::{ends, rows, run, succeed, text};
use crate::support::browser::{Tab, browser};

const DESK: [u32; 2] = [1400, 900];
const PHONE: [u32; 2] = [390, 844];

/// A run in which the whole slider slips, its log and its page.
fn page_of_a_run(folder: &Path, duration_s: f64) -> [PathBuf; 2] {
    let [log, page] = ["one.mcap", "one.html"].map(|name| folder.join(name));
    let duration = format!("time.duration_s={duration_s}");
    run(&["default", "--set", "slider.blocks=40", "--set", "time.step_s=1e-7", "--set", &duration], &log);
    succeed(&["report", text(&log), "--out", text(&page)]);
    [log, page]
}

/// A study over two keys, with a phase map and a claim that differs, and its page.
fn page_of_a_sweep(folder: &Path) -> [PathBuf; 2] {
    let sweep = folder.join("tilts.toml");
    fs::write(
        &sweep,
        "title = \"Tilts\"\nscenario = \"default\"\nkeep = [\"events\", \"ruptures\", \"log\"]\n\
         set = [\"slider.blocks=10\", \"time.step_s=1e-7\", \"time.duration_s=0.5\"]\n\
         [[axis]]\nkey = \"normal_load.tilt\"\nvalues = [-0.5, 0, 0.5]\n\
         [[axis]]\nkey = \"friction.static_coefficient\"\nvalues = [0.6, 0.7]\n\
         [[figure.family]]\nfile = \"counts.png\"\ntitle = \"Slip events\"\nx = \"normal_load.tilt\"\n\
         y = \"friction.static_coefficient\"\ncolour = \"event_count\"\n\
         [[claim]]\nabout = \"Slip events\"\nfigures = [\"counts.png\"]\nof = \"this project\"\nquote = \"F_T/F_N stays below 10^-8\"\n\
         at = [\"normal_load.tilt=0.5\"]\nmeasure = \"largest_ft_fn\"\nat_most = 1e-8\n",
    )
    .expect("the folder can be written");
    let out = folder.join("tilts");
    succeed(&["reproduce", text(&sweep), "-o", text(&out), "--quiet"]);
    let page = out.join("report.html");
    [out, page]
}

#[test]
fn a_run_begins_with_its_verdict_its_curve_and_its_map() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let [log, page] = page_of_a_run(folder.path(), 3.2);
    let summary: serde_json::Value =
        serde_json::from_str(&succeed(&["summary", text(&log), "--format", "json"])).expect("it is JSON");
    let number = |key: &str| summary[key].as_f64().unwrap_or_else(|| panic!("no {key} in {summary}"));
    let mut tab = Tab::start(&browser);
    for (size, scheme) in [(DESK, "light"), (DESK, "dark"), (PHONE, "light"), (PHONE, "dark")] {
        tab.go(&page, size, scheme);
        let answer = |tab: &mut Tab, n: usize| -> (f64, String) {
            let words = tab.says(&format!("document.querySelectorAll('.answers dd')[{n}].innerText"));
            let digits = words.trim_start_matches("v/c = ");
            let end = digits.find(|c: char| c != '.' && !c.is_ascii_digit()).unwrap_or(digits.len());
            (digits[..end].parse().unwrap_or(f64::NAN), words)
        };
        let near = |(found, words): (f64, String), value: f64| {
            assert!((found / value - 1.0).abs() < 2e-3, "{found} in {words:?}, not {value}");
            words
        };
        let slip = near(answer(&mut tab, 0), number("first_global_rupture_onset_s"));
        let load = format!("{:.3}", number("first_global_rupture_ft_fn"));
        assert!(slip.contains(&format!("at FT/FN = {}", &load[..4])), "{slip}, {load}");
        let precursors = near(answer(&mut tab, 1), number("precursor_count"));
        assert!(precursors.contains("the longest Lp/L = "), "{precursors}");
        let fronts = near(answer(&mut tab, 2), number("front_speed_over_wave_speed_ratio"));
        let said = |name: &str| -> f64 {
            let (_, rest) = fronts.split_once(name).unwrap_or_else(|| panic!("no {name:?} in {fronts:?}"));
            let digits = rest.trim_start().split(|c: char| c != '.' && !c.is_ascii_digit());
            digits.into_iter().next().and_then(|digits| digits.parse().ok()).expect("a number")
        };
        // What is printed of the ratio follows from the speeds that are printed, but for the last digit.
        let [ratio, v, c] = ["v/c =", "median of all fronts: v =", ", c ="].map(said);
        assert!((v / c / ratio - 1.0).abs() < 1.2e-3, "{fronts}");
        assert!((ratio / number("front_speed_over_wave_speed_ratio") - 1.0).abs() < 1e-3, "{fronts}");
        let first = number("first_global_rupture_front_speed_m_per_s") / number("wave_speed_m_per_s");
        assert!((said("first global slip: v/c =") / first - 1.0).abs() < 1e-3, "{fronts}, not {first}");
        let slider = answer(&mut tab, 3).1;
        assert!(slider.starts_with("as coded: 12 kg, c = 46 m/s"), "{slider}");
        let bottom = tab.says("Math.round(document.getElementById('map').getBoundingClientRect().bottom)");
        let bottom: u32 = bottom.parse().expect("a number");
        assert!(bottom <= size[1], "the map ends at {bottom} of {size:?}");
        tab.assert_quiet();
    }
    // The page of a run without a global slip states that.
    let short = asperity_testkit::folder();
    let [_, page] = page_of_a_run(short.path(), 0.5);
    let html = fs::read_to_string(page).expect("the page is there");
    assert!(
        html.contains("<dt>first global slip</dt><dd><b>none</b><span>in 0.5 s; F<sub>T</sub>"),
        "{html}"
    );
}

#[test]
fn a_rupture_that_is_zoomed_to_shows_its_front_block_by_block() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let [log, page] = page_of_a_run(folder.path(), 3.2);
    let mut tab = Tab::open(&browser, &page, DESK, "light");
    let fronts = "document.documentElement.dataset.fronts";
    assert_eq!(tab.says(fronts), "0", "the whole run has no room for fronts");
    tab.click_on("a[data-rupture]");
    assert_eq!(tab.says(fronts), "1");
    let number = tab.says("document.documentElement.dataset.chosen");
    assert!(tab.says("document.getElementById('chosen').textContent").contains("global slip"));
    // The drawing agrees with the log for each block.
    let tables = folder.path().join("replayed");
    succeed(&["replay", text(&log), "-o", text(&tables), "--quiet"]);
    let arrivals = rows(&fs::read(tables.join("one.arrivals.csv")).expect("the table is there"));
    let mut logged: Vec<[u64; 2]> = Vec::new();
    for row in arrivals {
        if row["rupture"] == number {
            logged.push(["arrival_step", "stop_step"].map(|step| row[step].parse().expect("a step")));
        }
    }
    assert_eq!(logged.len(), 40);
    let shown = tab.says(&format!(
        "(() => {{ const r = JSON.parse(document.querySelector('script.run').textContent).ruptures.find((r) => \
         r[0] === {number}); return JSON.stringify(r[12][0].map((t, n) => [r[1] + t, r[1] + r[12][1][n]])); }})()"
    ));
    assert_eq!(shown, serde_json::to_string(&logged).expect("numbers are JSON"));
    // Every dot between arrival and stop of a block is filled, and those before its arrival are not: the middle of the
    // block that the front came to last.
    let coloured = "(() => { const map = document.getElementById('map'), pen = map.getContext('2d'); \
                    const run = JSON.parse(document.querySelector('script.run').textContent); \
                    const r = run.ruptures.find((r) => String(r[0]) === document.documentElement.dataset.chosen); \
                    const [at, stop] = r[12], late = at.indexOf(Math.max(...at)), span = r[2] - r[1]; \
                    const across = map.clientWidth - 76, x = (t) => 62 + (t / span + .15) / 1.3 * across; \
                    const legend = 30, high = map.clientHeight - 12 - 44 - legend, y = 12 + high * (1 - (late + .5) / run.blocks); \
                    const row = pen.getImageData(0, Math.round(y), map.width, 1).data; \
                    const dot = (t) => [...row.slice(4 * Math.round(x(t))).slice(0, 4)].join(); \
                    return [dot(at[late] / 2), dot((at[late] + stop[late]) / 2)]; })()";
    let dots = tab.eval(coloured);
    assert_ne!(dots[0], dots[1], "before the front came, and behind it");
    // On a phone there is a button.
    tab.click_on("button[data-action=whole]");
    assert_eq!(tab.says(fronts), "0");
    tab.click_on("#to-front");
    assert_eq!(tab.says(fronts), "1");
    tab.assert_quiet();
}

#[test]
fn cells_and_rows_lead_to_runs_and_to_the_command_that_makes_their_log() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let [out, page] = page_of_a_sweep(folder.path());
    let mut tab = Tab::open(&browser, &page, DESK, "light");
    // Six cells, each with a run, in the order of the axes.
    let cells = "[...document.querySelectorAll('#part-maps-cell-by-cell td a')].map((a) => a.getAttribute('href')).join()";
    assert_eq!(tab.says(cells), "#run-2,#run-4,#run-6,#run-1,#run-3,#run-5");
    let counts =
        "[...document.querySelectorAll('#part-maps-cell-by-cell td a')].map((a) => a.textContent).join()";
    let runs = rows(&fs::read(out.join("tables/runs.csv")).expect("the table is there"));
    assert_eq!(tab.says(counts), [1, 3, 5, 0, 2, 4].map(|n| runs[n]["event_count"].as_str()).join(","));
    // A cell leads to its row, where the command unfolds.
    tab.click_on("#part-maps-cell-by-cell td a");
    let command = "(() => { const one = document.querySelector(':target'); return one.checkVisibility() ? one.textContent : ''; })()";
    assert_eq!(tab.says(command), "asperity sweep log . 2 -o 2.mcap");
    assert_eq!(tab.says("document.querySelector('tr:has(:target) a').getAttribute('href')"), "logs/2.mcap");
    assert!(out.join("logs/2.mcap").is_file());
    // The claim that differs is the first section, and leads to its run; contents lead to all sections.
    assert_eq!(tab.says("document.querySelector('section').id"), "part-claims-that-differ");
    // It names its figure by the title, and what is measured in words.
    assert_eq!(tab.says("document.querySelector('section h3 a').getAttribute('href')"), "#figure-of-counts");
    assert_eq!(tab.says("document.querySelector('section h3').textContent"), "Slip events");
    let measure = "document.querySelector('section .claims span[title=largest_ft_fn]').textContent";
    assert_eq!(tab.says(measure), "largest FT/FN");
    assert_eq!(tab.says("document.querySelector('section .claims a').getAttribute('href')"), "#run-5");
    let lost = "[...document.querySelectorAll('nav a, a[href^=\"#\"]')].filter((a) => \
                !document.getElementById(a.getAttribute('href').slice(1))).length";
    assert_eq!(tab.says(lost), "0");
    assert_eq!(
        tab.says("document.querySelectorAll('nav a').length"),
        tab.says("document.querySelectorAll('main > section').length")
    );
    tab.assert_quiet();
}

/// The page of a study begins with what it found: nobody has to scroll for its first figure and a claim that differs.
#[test]
fn a_study_begins_with_its_first_figure_and_the_claims_that_differ() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let [_, sweep] = page_of_a_sweep(folder.path());
    let pipeline = study(folder.path()).join("report.html");
    let mut tab = Tab::start(&browser);
    for page in [sweep, pipeline] {
        for (size, scheme) in [(DESK, "light"), (DESK, "dark"), (PHONE, "light"), (PHONE, "dark")] {
            tab.go(&page, size, scheme);
            for part in [".result figure img", ".result .claims li", ".score"] {
                let bottom = tab.says(&format!(
                    "Math.ceil(document.querySelector('{part}').getBoundingClientRect().bottom + scrollY)"
                ));
                let bottom: u32 = bottom.parse().expect("a number");
                assert!(bottom <= size[1], "{part} ends at {bottom} of {size:?} on {}", page.display());
            }
            let asked = "document.querySelector('.result').compareDocumentPosition(document.querySelector('.model')) & 4";
            assert_eq!(tab.says(asked), "4", "the answer comes before what was asked");
            // Its first figure is there once.
            let figures = "[...document.querySelectorAll('.figure')].map((one) => one.id)";
            assert_eq!(tab.says(&format!("{figures}.length - new Set({figures}).size")), "0");
            tab.assert_quiet();
        }
    }
}

/// Elements that extend beyond the window, with everything unfolded; areas that scroll do not count.
const OVERFLOW: &str = "(() => { document.querySelectorAll('details').forEach((one) => { one.open = true; }); \
                        return document.documentElement.scrollWidth <= innerWidth ? '' : \
                        [...document.querySelectorAll('main *')].filter((one) => one.getBoundingClientRect().right > innerWidth) \
                        .map((one) => one.outerHTML.slice(0, 80)).slice(-5).join(' | '); })()";
/// Text that looks like markup or code outside of code.
const RAW: &str = "(() => { const copy = document.querySelector('main').cloneNode(true); \
                   copy.querySelectorAll('code, script, select').forEach((one) => one.remove()); \
                   copy.querySelectorAll('td, th, dt, dd, p, li, div').forEach((one) => one.append(' ')); \
                   const raw = /\\S*(_\\{|\\^|\\\\[a-z]|`|\\$|\\b[A-Za-zμτ]_[A-Za-z]\\b|\\b(mu|tau|theta|beta|alpha)\\b|\\d[eE]-\\d|[<>]=)\\S*/g; \
                   return [...copy.textContent.matchAll(raw)].map(([found]) => found).join(' | '); })()";
/// Cells whose numbers break, or whose words are pressed into a narrow column, where the table could scroll.
const PRESSED: &str = "[...document.querySelectorAll('.wide td')].filter((one) => one.checkVisibility() && !one.children.length).filter((one) => { \
                       const range = document.createRange(); range.selectNodeContents(one); \
                       return range.getClientRects().length > (one.clientWidth < 90 || one.matches('.number') ? 1 : 99); \
                       }).map((one) => one.outerHTML).join(' | ')";
/// Names that break in the middle of a word.
const BROKEN: &str = "[...document.querySelectorAll('code.name')].filter((one) => !one.textContent.includes(' ')).filter((one) => { \
                      const words = one.textContent.split(/(?<=[._])/), range = document.createRange(); \
                      const texts = [...one.childNodes].filter((node) => node.nodeType === 3); \
                      return texts.some((text) => { range.selectNode(text); return range.getClientRects().length > 1; }) || words.length < texts.length; \
                      }).map((one) => one.textContent).join()";

#[test]
fn no_page_overflows_a_phone_and_none_has_raw_markup() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let [log, run] = page_of_a_run(folder.path(), 0.5);
    let [_, sweep] = page_of_a_sweep(folder.path());
    let two = study(folder.path());
    let index = folder.path().join("index.html");
    succeed(&["report", text(&two), text(&folder.path().join("tilts")), "--out", text(&index)]);
    let mut tab = Tab::start(&browser);
    for page in [run, two.join("report.html"), sweep, index] {
        for (size, scheme) in [(PHONE, "light"), (DESK, "dark")] {
            tab.go(&page, size, scheme);
            for rule in [OVERFLOW, RAW, BROKEN] {
                assert_eq!(tab.says(rule), "", "{} at {size:?}", page.display());
            }
        }
    }
    // The page of a diff, with names as long as they come.
    let other = asperity_testkit::folder();
    let [longer, _] = page_of_a_run(other.path(), 0.6);
    let long_name = other.path().join(format!("{}.mcap", "a_long_name_".repeat(7)));
    fs::rename(longer, &long_name).expect("the folder can be written");
    let page = folder.path().join("diff.html");
    ends(1, &["diff", text(&log), text(&long_name), "--page", text(&page)], &[]);
    for scheme in ["light", "dark"] {
        tab.go(&page, PHONE, scheme);
        for rule in [OVERFLOW, BROKEN, PRESSED] {
            assert_eq!(tab.says(rule), "", "{} at {PHONE:?}", page.display());
        }
    }
    // Violations of the rules are detected.
    tab.go(&two.join("report.html"), PHONE, "light");
    let broken = "(() => { const main = document.querySelector('main'); main.insertAdjacentHTML('beforeend', '<p>|mu_{s}| of 10^-8</p>\
                  <div>w</div><p><code class=\"name\">precursors</code></p>'); \
                  const [wide, narrow] = [...main.children].slice(-2); wide.style.width = '500px'; \
                  narrow.style.width = '20px'; narrow.firstChild.style.overflowWrap = 'anywhere'; })()";
    tab.eval(broken);
    assert!(tab.says(OVERFLOW).contains("500px") && tab.says(BROKEN) == "precursors");
    assert_eq!(tab.says(RAW), "|mu_{s}| | 10^-8");
}
