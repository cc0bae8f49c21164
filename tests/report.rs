//! The page of a run, of a study, of a sweep and of several, as files and in a real browser.
//!
//! What needs Chromium skips without it, see `support/browser.rs`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{asperity, run, succeed, text};
use crate::support::browser::{Tab, browser};

const SIZE: [u32; 2] = [1280, 1000];

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A run of 2 s, and its page.
fn page_of_a_run(folder: &Path) -> PathBuf {
    let log = folder.join("one.mcap");
    run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=2"], &log);
    let page = folder.join("one.html");
    succeed(&["report", text(&log), "--out", text(&page)]);
    page
}

/// A pipeline of two short runs with figures and claims.
fn study(folder: &Path) -> PathBuf {
    let pipeline = folder.join("two.toml");
    let of_run = |name: &str, tilt: &str| {
        format!(
            "[[run]]\nname = \"{name}\"\nscenario = \"default\"\n\
             set = [\"slider.blocks=20\", \"time.step_s=1e-7\", \"time.duration_s=1.5\", \"normal_load.tilt={tilt}\"]\n\
             [[figure.load]]\nfile = \"figure-1.0{}.png\"\nrun = \"{name}\"\nsliding = true\ntitle = \"tilt {tilt}\"\n",
            name.len()
        )
    };
    let claim = |about: &str, of: &str, quote: &str, most: &str| {
        format!(
            "[[claim]]\nabout = \"{about}\"\nof = \"{of}\"\nquote = \"{quote}\"\nrun = \"a\"\n\
             measure = \"largest-load-ratio\"\nat_most = {most}\n"
        )
    };
    let parts = [
        "title = \"Two <runs> & a tilt\"\n".to_owned(),
        of_run("a", "0.0"),
        of_run("bb", "0.5"),
        claim("Figure 1.1", "the source", "it stays below $\\\\mu_{s}$", "0.7"),
        claim("Figure 1.1", "the source", "it stays below nothing", "1e-9"),
        claim("section 2", "this project", "it is small", "10"),
    ];
    fs::write(&pipeline, parts.concat()).expect("the folder can be written");
    let out = folder.join("two");
    succeed(&["reproduce", text(&pipeline), "--out", text(&out), "--quiet"]);
    out
}

/// All that stands behind `name="` in a page.
fn attributes<'a>(html: &'a str, name: &str) -> Vec<&'a str> {
    let behind = format!("{name}=\"");
    html.split(behind.as_str()).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

#[test]
fn a_rupture_picked_in_one_is_shown_in_all() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let page = page_of_a_run(folder.path());
    let mut tab = Tab::open(&browser, &page, SIZE, "light");
    let count: usize = tab.says("document.documentElement.dataset.ruptures").parse().expect("a number");
    assert!(count > 40, "{count} ruptures");
    assert_eq!(tab.says("document.documentElement.dataset.drawn"), count.to_string());

    // Where the widest rupture is in the map, and which it is.
    let widest = "(() => { const run = JSON.parse(document.querySelector('script.run').textContent); \
                  const all = [...run.ruptures].sort((a, b) => b[4] - b[3] - a[4] + a[3]), r = all[0]; \
                  const canvas = document.getElementById('map'); canvas.scrollIntoView({ block: 'end' }); \
                  const box = canvas.getBoundingClientRect(), whole = run.dt * run.steps; \
                  const x = (r[1] * run.dt + .01 * whole) / (1.02 * whole) * (canvas.clientWidth - 76); \
                  return [r[0], box.x + canvas.clientLeft + 62.7 + x, box.y + 12 + (box.height - 86) * (1 - r[4] / 2 / run.blocks)]; })()";
    let at = tab.eval(widest);
    let place = |n: usize| at[n].as_f64().expect("a number");
    let number = at[0].to_string();
    tab.click(place(1), place(2));
    let chosen = "document.documentElement.dataset.chosen";
    assert_eq!(tab.says(chosen), number);
    let selected = "document.querySelector('#ruptures tr[aria-selected=true] td').textContent";
    assert_eq!(tab.says(selected), number, "the table has it in view");
    assert!(
        tab.says("document.getElementById('chosen').textContent").starts_with(&format!("Rupture {number},"))
    );

    // From the table to the others.
    let before = "document.querySelector('#ruptures tr:has(+ [aria-selected=true]) td').textContent";
    let first = tab.says(before);
    tab.click_on("#ruptures tr:has(+ [aria-selected=true])");
    assert_eq!(tab.says(chosen), first);

    // From the load curve: the middle of its panel is near some rupture.
    tab.click_on("#load .u-over");
    assert_ne!(tab.says(chosen), first);
    tab.assert_quiet();
}

#[test]
fn everything_can_be_done_with_keys() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let page = page_of_a_run(folder.path());
    let mut tab = Tab::open(&browser, &page, SIZE, "light");
    // From the top of the page by Tab alone.
    let mut order = Vec::new();
    for _ in 0..40 {
        tab.press("Tab");
        let here = tab.says(
            "(() => { const e = document.activeElement; return e.id || e.dataset.action || e.dataset.kind || \
             e.getAttribute('role') || e.tagName; })()",
        );
        order.push(here);
    }
    let place = |id: &str| {
        let found = order.iter().position(|here| here == id);
        found.unwrap_or_else(|| panic!("no {id} in {order:?}"))
    };
    assert!(["theme", "in", "load", "map", "grid"].map(place).is_sorted(), "{order:?}");

    let chosen = "document.documentElement.dataset.chosen";
    let drawn = "document.documentElement.dataset.drawn";
    for id in ["map", "load"] {
        tab.eval(&format!("document.getElementById('{id}').focus()"));
        tab.press("0");
        tab.press("ArrowRight");
        let first = tab.says(chosen);
        tab.press("ArrowRight");
        let second = tab.says(chosen);
        assert!(first != second && !second.is_empty(), "{id}: {first}, {second}");
        tab.press("ArrowLeft");
        assert_eq!(tab.says(chosen), first, "{id}");
        let all: usize = tab.says(drawn).parse().expect("a number");
        tab.press("Enter");
        let near: usize = tab.says(drawn).parse().expect("a number");
        assert!(near < all, "{id}: {near} of {all} in view");
        tab.press("Escape");
        assert_eq!(tab.says(chosen), "", "{id}");
        tab.press("0");
        assert_eq!(tab.says(drawn), all.to_string(), "{id}");
    }
    tab.eval("document.querySelector('#ruptures table').focus()");
    tab.press("ArrowDown");
    tab.press("ArrowDown");
    let row = "document.querySelector('#ruptures tr[aria-selected=true]').getAttribute('aria-rowindex')";
    assert_eq!(tab.says(row), "3", "the second below the headings");
    let active = "document.querySelector('#ruptures table').getAttribute('aria-activedescendant') === \
                  document.querySelector('#ruptures tr[aria-selected=true]').id";
    assert_eq!(tab.says(active), "true");
    tab.assert_quiet();
}

#[test]
fn ruptures_are_sorted_and_filtered() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let page = page_of_a_run(folder.path());
    let mut tab = Tab::open(&browser, &page, SIZE, "light");
    let column = |name: &str| {
        format!(
            "(() => {{ const at = [...document.querySelectorAll('#ruptures th')].findIndex((th) => \
             th.textContent.startsWith({name:?})); return [...document.querySelectorAll('#ruptures tr[data-row]')]\
             .map((row) => parseFloat(row.cells[at].textContent)); }})()"
        )
    };
    let numbers = |value: serde_json::Value| -> Vec<f64> {
        let list = value.as_array().expect("a list").clone();
        list.iter().map(|one| one.as_f64().expect("a number")).collect()
    };
    tab.click_on("#ruptures th:nth-child(5) button");
    assert!(numbers(tab.eval(&column("blocks"))).is_sorted());
    tab.click_on("#ruptures th:nth-child(5) button");
    let widest = numbers(tab.eval(&column("blocks")));
    assert!(widest.iter().rev().is_sorted() && widest[0] > 50.0, "{widest:?}");

    let listed = |tab: &mut Tab| -> usize {
        tab.says("document.documentElement.dataset.listed").parse().expect("a number")
    };
    let all = listed(&mut tab);
    tab.eval("document.getElementById('least').select()");
    tab.press("2");
    tab.press("0");
    let wide = listed(&mut tab);
    let counted = "JSON.parse(document.querySelector('script.run').textContent).ruptures.filter((r) => \
                   r[4] - r[3] >= 19).length";
    assert_eq!(wide.to_string(), tab.says(counted));
    assert!(wide < all && wide > 0);
    assert_eq!(
        tab.says("document.documentElement.dataset.drawn"),
        wide.to_string(),
        "the map shows the same"
    );
    tab.click_on("input[data-kind='0']");
    let precursors = listed(&mut tab);
    assert!(precursors < wide && precursors > 0, "{precursors} of {wide}");
    tab.click_on("#events");
    let drawn: usize = tab.says("document.documentElement.dataset.drawn").parse().expect("a number");
    assert!(drawn > precursors, "slip events as well");
    tab.click_on("#in-view");
    tab.click_on("button[data-action=in]");
    assert!(listed(&mut tab) < precursors);
    tab.assert_quiet();
}

#[test]
fn pages_are_light_dark_and_printed() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let page = page_of_a_run(folder.path());
    // The corner of the map's panel, and the page around it.
    let colours = "(() => { const copy = document.createElement('canvas').getContext('2d', { willReadFrequently: true }); \
                   copy.drawImage(document.getElementById('map'), 0, 0); \
                   const dot = [...copy.getImageData(2, 2, 1, 1).data].slice(0, 3); \
                   return [getComputedStyle(document.body).backgroundColor, `rgb(${dot.join(', ')})`]; })()";
    let mut seen = Vec::new();
    for scheme in ["light", "dark"] {
        let mut tab = Tab::open(&browser, &page, SIZE, scheme);
        let by_system = tab.eval(colours);
        assert_eq!(by_system[0], by_system[1], "{scheme}: page and map");
        tab.click_on("#theme");
        let other = tab.eval(colours);
        assert!(other[0] == other[1] && other != by_system, "{scheme}: {other} {by_system}");
        let pdf = tab.pdf();
        assert!(pdf.starts_with("JVBERi0") && pdf.len() > 20_000, "{} characters of PDF", pdf.len());
        // Once it is printed, the page is as it was.
        tab.painted();
        assert_eq!(tab.eval(colours), other);
        seen.push((by_system, other));
        tab.assert_quiet();
    }
    let (light, dark) = (seen[0].clone(), seen[1].clone());
    assert!(light.0 == dark.1 && light.1 == dark.0, "{seen:?}");
}

#[test]
fn a_study_shows_claims_beside_figures_and_each_run() {
    let folder = asperity_testkit::folder();
    let out = study(folder.path());
    let html = read(&out.join("report.html"));
    assert!(read(&out.join("reproduce.json")).contains("\"report.html\""), "it is listed");
    assert!(html.contains("<h1>Two &lt;runs&gt; &amp; a tilt</h1>"));
    assert!(html.contains("<b>The source:</b> 1 of 2 agree, 1 differ."));
    assert!(html.contains("<b>This project:</b> 1 of 1 agree."));
    // The claims of the figure stand beside it; the other one stands with the run.
    let (_, figure) = html.split_once("id=\"figure-1.01\"").expect("the figure is there");
    let (figure, rest) = figure.split_once("id=\"figure-1.02\"").expect("so is the next");
    assert!(figure.contains("“it stays below μ<sub>s</sub>”") && figure.contains("✗ differs"));
    assert!(!figure.contains("it is small"));
    let (_, of_run) = rest.split_once("id=\"run-a\"").expect("so are the runs");
    let (of_run, _) = of_run.split_once("id=\"run-bb\"").expect("one after the other");
    assert!(of_run.contains("This project says") && of_run.contains("it is small"));
    // Every picture has words, and stands in the page itself.
    let (pictures, words) = (attributes(&html, "<img alt"), attributes(&html, " src"));
    assert_eq!((pictures.len(), words.len()), (2, 2));
    assert!(
        pictures.iter().all(|words| words.contains("Figure 1.") && words.contains(". Tilt 0.")),
        "{pictures:?}"
    );
    assert!(words.iter().all(|source| source.starts_with("data:image/")));
    // Every file that it leads to is there.
    let links: Vec<&str> = attributes(&html, "href").into_iter().filter(|to| !to.starts_with('#')).collect();
    assert!(links.len() > 10 && links.contains(&"runs/a.mcap") && links.contains(&"tables/claims.csv"));
    for link in links {
        assert!(out.join(link).is_file(), "{link}");
    }
    // Both runs are held by the page, and what differs between them has a column.
    assert_eq!(html.matches("<script type=\"application/json\" class=\"run\"").count(), 2);
    assert!(html.contains(">θ</th>"), "{html}");
}

#[test]
fn the_page_out_of_the_folder_is_that_of_the_reproduction() {
    let folder = asperity_testkit::folder();
    let out = study(folder.path());
    let [again, elsewhere, bare] =
        [out.join("again.html"), folder.path().join("page.html"), out.join("bare.html")];
    succeed(&["report", text(&out), "--out", text(&again)]);
    assert!(read(&again) == read(&out.join("report.html")), "the pages differ");
    succeed(&["report", text(&out), "--out", text(&elsewhere)]);
    assert!(read(&elsewhere).contains("href=\"two/runs/a.mcap\""));
    succeed(&["report", text(&out), "--out", text(&bare), "--no-provenance"]);
    let version = |html: &str| html.contains("code version");
    assert!(version(&read(&again)) && !version(&read(&bare)));

    // A log that is not the one of the record is not shown as if it were.
    fs::copy(out.join("runs/bb.mcap"), out.join("runs/a.mcap")).expect("the log can be copied");
    let output = asperity(&["report", text(&out), "--out", text(&folder.path().join("c.html"))]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("a.mcap: it is of another run than reproduce.json says (accepted: "), "{said}");
}

#[test]
fn the_index_leads_to_every_study() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let out = study(folder.path());
    let index = folder.path().join("index.html");
    succeed(&["report", text(&out), text(&out), "--out", text(&index)]);
    let html = read(&index);
    assert_eq!(html.matches("href=\"two/report.html\"").count(), 2);
    assert!(html.contains("<b>The source:</b> 2 of 4 agree, 2 differ."), "all of them");
    let mut tab = Tab::open(&browser, &index, SIZE, "light");
    let there = "[...document.images].every((one) => one.complete && one.naturalWidth > 100)";
    tab.eval("window.scrollTo(0, document.body.scrollHeight)");
    tab.eval("Promise.all([...document.images].map((one) => one.decode()))");
    assert_eq!(tab.says(there), "true");
    assert_eq!(tab.says("document.images.length"), "4");
}

#[test]
fn a_sweep_has_a_page_with_its_runs() {
    let folder = asperity_testkit::folder();
    let sweep = folder.path().join("tilts.toml");
    fs::write(
        &sweep,
        "title = \"Tilts\"\nscenario = \"default\"\n\
         set = [\"slider.blocks=10\", \"time.step_s=1e-7\", \"time.duration_s=0.5\"]\n\
         [[axis]]\nkey = \"normal_load.tilt\"\nvalues = [-0.5, 0, 0.5]\n\
         [[figure.family]]\nfile = \"counts.png\"\nx = \"normal_load.tilt\"\ny = \"precursor_count\"\n",
    )
    .expect("the folder can be written");
    let out = folder.path().join("tilts");
    succeed(&["sweep", "plan", text(&sweep), "-o", text(&out)]);
    succeed(&["sweep", "run", text(&out), "--quiet"]);
    succeed(&["sweep", "collect", text(&out), "--quiet"]);
    let html = read(&out.join("report.html"));
    assert!(html.contains("<h1>Tilts</h1>") && html.contains("3 of 3 runs done"));
    assert!(html.contains("-0.5, 0, 0.5") && html.contains("<i>θ</i>"));
    assert_eq!(html.matches("src=\"data:image/").count(), 1);
    let (_, table) = html.split_once("id=\"runs\"").expect("the table of runs");
    assert_eq!(table.matches("<tr>").count(), 4, "headings and three runs");
    for link in attributes(&html, "href") {
        assert!(out.join(link).is_file(), "{link}");
    }
    let again = out.join("again.html");
    succeed(&["report", text(&out), "--out", text(&again)]);
    assert!(read(&again) == html, "the pages differ");
}

#[test]
fn what_cannot_be_shown_is_refused_and_what_is_missing_is_said() {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let (log, page) = (path("one.mcap"), path("page.html"));
    run(&["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1"], &log);
    let report = |of: &Path, more: &[&str]| {
        let output = asperity(&[&["report", text(of), "--out", text(&page)], more].concat());
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = report(&path("nothing.mcap"), &[]);
    assert!(code == Some(2) && said.contains("nothing.mcap"), "{said}");
    let (code, said) = report(folder.path(), &[]);
    assert!(
        code == Some(2) && said.contains("neither a pipeline nor a sweep (accepted: run logs;"),
        "{said}"
    );
    // Damage, and a log that ends too early.
    let bytes = fs::read(&log).expect("the log can be read");
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0x10;
    fs::write(path("damaged.mcap"), damaged).expect("the folder can be written");
    let (code, said) = report(&path("damaged.mcap"), &[]);
    assert!(code == Some(4) && said.contains("(accepted: what asperity salvage makes of it)"), "{said}");
    assert!(!page.exists());
    fs::write(path("cut.mcap"), &bytes[..bytes.len() - 2000]).expect("the folder can be written");
    let (code, said) = report(&path("cut.mcap"), &[]);
    assert_eq!(code, Some(3), "{said}");
    assert!(read(&page).contains("Not all of this run is there: incomplete"));
    // What exists is replaced only if that is asked for, and what is read never.
    let (code, said) = report(&log, &[]);
    assert!(code == Some(2) && said.contains("(accepted: another file, or --force)"), "{said}");
    assert_eq!(report(&log, &["--force"]).0, Some(0));
    let whole = read(&page);
    assert_eq!(report(&log, &["--force"]).0, Some(0));
    assert!(read(&page) == whole, "the same log, another page");
    let output = asperity(&["report", text(&log), "--out", text(&log), "--force"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(fs::read(&log).expect("the log can be read") == bytes);
    // Without scripts it says what there is to say.
    assert!(whole.contains("class=\"without-script\"") && whole.contains("widest of"), "{whole}");
}
