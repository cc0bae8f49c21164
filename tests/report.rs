//! The page of a run, of a study, of a sweep and of several, as files and in a real browser.
//!
//! Tests that need Chromium skip without it, see `support/browser.rs`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use asperity_testkit::Grey;

use crate::print::are_there;
use crate::support::binary::{asperity, ends, outcome, rows, run, succeed, text, with_sets};
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

/// A run that its energies stop after a third of the planned steps, and its page.
fn page_of_a_stopped_run(folder: &Path) -> PathBuf {
    let log = folder.join("stopped.mcap");
    let set = ["slider.blocks=24", "time.step_s=2.5e-6"];
    ends(1, &with_sets(&["run", "rigid-contacts", "-o", text(&log), "--quiet"], &set), &["stopped"]);
    let page = folder.join("stopped.html");
    asperity(&["report", text(&log), "--out", text(&page)]);
    page
}

/// Scrolls to the map and returns the position of a rupture on it: a script for the one that `which`
/// selects, as `[number, x, y]`.
fn place_on_map(which: &str) -> String {
    format!(
        "(() => {{ const run = JSON.parse(document.querySelector('script.run').textContent); \
         const r = {which}, end = r[2] ?? run.last; \
         const canvas = document.getElementById('map'); canvas.scrollIntoView({{ block: 'end' }}); \
         const box = canvas.getBoundingClientRect(), whole = run.dt * run.last; \
         const x = ((r[1] + end) / 2 * run.dt + .01 * whole) / (1.02 * whole) * (canvas.clientWidth - 76); \
         return [r[0], box.x + canvas.clientLeft + 62.7 + x, box.y + 12 + (box.height - 86) * (1 - r[4] / 2 / run.blocks)]; }})()"
    )
}

const CHOSEN: &str = "document.documentElement.dataset.chosen";
const SELECTED: &str = "document.querySelector('#ruptures tr[aria-selected=true] td').textContent";
const SAID: &str = "document.getElementById('chosen').textContent";

/// A pipeline of two short runs with figures and claims.
pub(crate) fn study(folder: &Path) -> PathBuf {
    let pipeline = folder.join("two.toml");
    let of_run = |name: &str, tilt: &str| {
        format!(
            "[[run]]\nname = \"{name}\"\nscenario = \"default\"\n\
             set = [\"parameter_set=as-coded\", \"slider.blocks=20\", \"time.step_s=1e-7\", \"time.duration_s=1.5\", \"normal_load.tilt={tilt}\"]\n\
             [[figure.load]]\nfile = \"figure-1.0{}.png\"\nrun = \"{name}\"\nsliding = true\ntitle = \"tilt {tilt}\"\n",
            name.len()
        )
    };
    let claim = |about: &str, of: &str, quote: &str, most: &str| {
        let figures = if about == "Figure 1.1" { "figures = [\"figure-1.01.png\"]\n" } else { "" };
        format!(
            "[[claim]]\nabout = \"{about}\"\n{figures}of = \"{of}\"\nquote = \"{quote}\"\nrun = \"a\"\n\
             measure = \"largest_ft_fn\"\nat_most = {most}\n"
        )
    };
    let parts = [
        "title = \"Two <runs> & a tilt\"\n".to_owned(),
        of_run("a", "0.0"),
        of_run("bb", "0.5"),
        claim("Figure 1.1", "the thesis", "it stays below $\\\\mu_{s}$", "0.7"),
        claim("Figure 1.1", "the thesis", "it stays below nothing", "1e-9"),
        claim("section 2", "this project", "it is small", "10"),
    ];
    fs::write(&pipeline, parts.concat()).expect("the folder can be written");
    let out = folder.join("two");
    succeed(&["reproduce", text(&pipeline), "--out", text(&out), "--quiet"]);
    out
}

/// All values of `name="` in a page.
fn attributes<'a>(html: &'a str, name: &str) -> Vec<&'a str> {
    let behind = format!("{name}=\"");
    html.split(behind.as_str()).skip(1).filter_map(|rest| rest.split('"').next()).collect()
}

/// Of a rupture that still slides at the end there is no drop and no mean slip, which is not 0.
#[test]
fn what_a_rupture_has_not_come_to_is_left_out() {
    let folder = asperity_testkit::folder();
    let [log, page] = ["front.mcap", "front.html"].map(|name| folder.path().join(name));
    run(&["front", "--set", "slider.blocks=100", "--set", "time.duration_s=1e-5"], &log);
    succeed(&["report", text(&log), "--out", text(&page)]);
    let html = read(&page);
    let (_, rows) = html.split_once("Its ruptures, the widest first").expect("it has one");
    let (_, row) = rows.split_once("<tbody>\n<tr>").expect("it is in a row");
    let cells: Vec<&str> = row.split("</tr>").next().expect("it ends").split("<td").collect();
    assert!(
        cells[6..].iter().zip(1..).all(|(cell, n)| (n == 2) == cell.contains(char::is_numeric)),
        "{cells:?}"
    );
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

    // The widest rupture in the map.
    let widest = "[...run.ruptures].sort((a, b) => b[4] - b[3] - a[4] + a[3])[0]";
    let at = tab.eval(&place_on_map(widest));
    let place = |n: usize| at[n].as_f64().expect("a number");
    let number = at[0].to_string();
    tab.click(place(1), place(2));
    assert_eq!(tab.says(CHOSEN), number);
    assert_eq!(tab.says(SELECTED), number, "the table has it in view");
    let said = tab.says(SAID);
    assert!(said.starts_with(&format!("Rupture {number},")) && said.contains("first sliding "), "{said}");
    // In the unit of the table.
    let drop = "document.querySelector('#ruptures tr[aria-selected=true]').cells[7].textContent";
    assert!(said.contains(&format!("drop {} · 10⁻³", tab.says(drop))), "{said}");

    // From the table to the others.
    let before = "document.querySelector('#ruptures tr:has(+ [aria-selected=true]) td').textContent";
    let first = tab.says(before);
    tab.click_on("#ruptures tr:has(+ [aria-selected=true])");
    assert_eq!(tab.says(CHOSEN), first);

    // From the load curve: the middle of its panel is near some rupture.
    tab.click_on("#load .u-over");
    let near = tab.says(CHOSEN);
    assert!(near.parse::<u64>().is_ok() && near != first, "{near:?} after {first}");
    assert_eq!(tab.says(SELECTED), near);
    assert!(tab.says(SAID).starts_with(&format!("Rupture {near},")));

    // A double click zooms in about its position, on the curve as on the map, and selects nothing else.
    let drawn = "Number(document.documentElement.dataset.drawn)";
    for picture in ["#load .u-over", "#map"] {
        tab.click_on("button[data-action=whole]");
        let all = tab.eval(drawn).as_u64().expect("a number");
        tab.click_on(picture);
        let one = tab.says(CHOSEN);
        tab.double_click_on(picture);
        let some = tab.eval(drawn).as_u64().expect("a number");
        assert!(some < all, "{picture}: {some} of {all} in view");
        assert_eq!(tab.says(CHOSEN), one, "{picture}");
    }
    tab.assert_quiet();
}

/// A run may stop before it was planned to.
#[test]
fn nothing_goes_on_behind_the_last_step_of_a_stopped_run() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let page = page_of_a_stopped_run(folder.path());
    let html = read(&page);
    assert!(html.contains("\"last\":728503,"), "1.8212575 s");
    let (_, summary) = html.split_once("<summary>stopped ").expect("the run has a line of its own");
    assert!(summary.split("</summary>").next().expect("it ends").contains("class=\"lacks\""));
    let mut tab = Tab::open(&browser, &page, SIZE, "light");
    let open = "run.ruptures.findLast((one) => one[2] === null)";
    let at = tab.eval(&place_on_map(open));
    let place = |n: usize| at[n].as_f64().expect("a number");
    tab.click(place(1), place(2));
    assert_eq!(tab.says(CHOSEN), at[0].to_string());
    let said = tab.says(SAID);
    assert!(said.contains(" s to the last step of the log; "), "{said}");
    // The missing part is stated above the pair.
    let lacks = "(() => { const one = document.getElementById('lacks'); return one.getClientRects().length ? \
                 one.textContent : ''; })()";
    assert!(tab.says(lacks).starts_with("Not all of this run is there: stopped"), "{}", tab.says(lacks));
    // A step is 2.5 µs, which needs seven decimals.
    let onsets = tab.says("[...document.querySelectorAll('#ruptures tr[data-row]')].map((row) => row.cells[2].textContent).join()");
    let exact = tab.says(
        "JSON.parse(document.querySelector('script.run').textContent).ruptures.map((r) => (r[1] * 25 / 1e7).toFixed(7)).join()",
    );
    assert!(exact.contains(&onsets) && onsets.len() > 40, "{onsets} of {exact}");
    tab.assert_quiet();
}

/// A front that starts near the last block runs farther downwards.
#[test]
fn fronts_have_the_speed_of_the_side_where_they_ran_farther() {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let log = path("both.mcap");
    run(&["left-right-driven", "--set", "time.step_s=5e-7", "--set", "time.duration_s=4"], &log);
    let (page, tables) = (path("both.html"), path("tables"));
    succeed(&["report", text(&log), "--out", text(&page)]);
    succeed(&["reduce", text(&log), "--out", text(&tables), "--quiet"]);
    let html = read(&page);
    let (_, data) = html.split_once("class=\"run\"").expect("the page holds the run");
    let (_, data) = data.split_once('>').expect("a tag ends");
    let (data, _) = data.split_once("</script>").expect("so does the data");
    let data: serde_json::Value = serde_json::from_str(data).expect("it is JSON");
    // Across the load curve, static friction above sliding friction.
    assert_eq!(data["lines"], serde_json::json!([["μ_s", 0.7], ["μ_d", 0.45]]));
    let mut speeds = std::collections::BTreeMap::new();
    for row in data["ruptures"].as_array().expect("a list") {
        speeds.insert(row[0].to_string(), row[10].as_f64());
    }
    let mut downwards = 0;
    for row in rows(&fs::read(tables.join("ruptures.csv")).expect("the table is there")) {
        let block = |name: &str| row[name].parse::<i64>().expect("a block");
        let speed = |name: &str| row[name].parse::<f64>().ok();
        let (up, down) = (speed("front_speed_up_m_per_s"), speed("front_speed_down_m_per_s"));
        let nucleation = block("nucleation_block");
        let is_up = block("last_block") - nucleation >= nucleation - block("first_block");
        let farther = if is_up { up.or(down) } else { down.or(up) };
        let shown = speeds[&row["rupture"]];
        match (farther, shown) {
            (Some(farther), Some(shown)) => {
                assert!((shown / farther - 1.0).abs() < 1e-3, "{}: {shown}, not {farther}", row["rupture"]);
            }
            (farther, shown) => assert_eq!(farther, shown, "{}", row["rupture"]),
        }
        downwards += usize::from(!is_up && up.is_some() && down.is_some());
    }
    assert!(downwards > 0, "no rupture tells the sides apart");
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
    assert!(["theme", "load", "map", "in", "grid"].map(place).is_sorted(), "{order:?}");

    let drawn = "document.documentElement.dataset.drawn";
    for id in ["map", "load"] {
        tab.eval(&format!("document.getElementById('{id}').focus()"));
        tab.press("0");
        tab.press("ArrowRight");
        let first = tab.says(CHOSEN);
        tab.press("ArrowRight");
        let second = tab.says(CHOSEN);
        assert!(first != second && !second.is_empty(), "{id}: {first}, {second}");
        tab.press("ArrowLeft");
        assert_eq!(tab.says(CHOSEN), first, "{id}");
        let all: usize = tab.says(drawn).parse().expect("a number");
        tab.press("Enter");
        let near: usize = tab.says(drawn).parse().expect("a number");
        assert!(near < all, "{id}: {near} of {all} in view");
        tab.press("Escape");
        assert_eq!(tab.says(CHOSEN), "", "{id}");
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
             .map((row) => row.cells[at].textContent.split('–').map(Number)).map((span) => span.at(-1) - span[0]); }})()"
        )
    };
    let numbers = |value: serde_json::Value| -> Vec<f64> {
        let list = value.as_array().expect("a list").clone();
        list.iter().map(|one| one.as_f64().expect("a number")).collect()
    };
    tab.click_on("#ruptures th:nth-child(5) button");
    assert!(numbers(tab.eval(&column("x (mm)"))).is_sorted());
    tab.click_on("#ruptures th:nth-child(5) button");
    let widest = numbers(tab.eval(&column("x (mm)")));
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
    // A hidden event is no longer selected.
    let other = "[...document.querySelectorAll('#ruptures tr[data-row]')].find((row) => row.cells[1].textContent === 'rupture').click()";
    tab.eval(other);
    tab.painted();
    assert!(tab.says(SAID).contains(", rupture;"), "{}", tab.says(SAID));
    tab.click_on("input[data-kind='0']");
    let precursors = listed(&mut tab);
    assert!(precursors < wide && precursors > 0, "{precursors} of {wide}");
    assert_eq!((tab.says(CHOSEN), tab.says(SAID)), (String::new(), "No rupture is picked.".to_owned()));
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
        assert!(pdf.starts_with(b"%PDF") && pdf.len() > 20_000, "{} bytes of PDF", pdf.len());
        // Once it is printed, the page is as it was.
        tab.painted();
        assert_eq!(tab.eval(colours), other);
        seen.push((by_system, other));
        tab.assert_quiet();
    }
    let (light, dark) = (seen[0].clone(), seen[1].clone());
    assert!(light.0 == dark.1 && light.1 == dark.0, "{seen:?}");
}

/// The text of a PDF, and its first page as a picture.
fn printed(pdf: &[u8], folder: &Path) -> (String, Grey) {
    let (paper, first) = (folder.join("printed.pdf"), folder.join("printed"));
    fs::write(&paper, pdf).expect("the folder can be written");
    let words = Command::new("pdftotext").args([text(&paper), "-"]).output().expect("pdftotext starts");
    let arguments = ["-r", "60", "-l", "1", "-png", "-singlefile", text(&paper), text(&first)];
    assert!(Command::new("pdftoppm").args(arguments).status().expect("pdftoppm starts").success());
    (String::from_utf8_lossy(&words.stdout).into_owned(), Grey::read(&first.with_extension("png")))
}

/// Also of a study that is read by night, with each run folded away.
#[test]
fn paper_is_white_and_has_the_words_of_every_run() {
    let Some(browser) = browser() else { return };
    if !are_there() {
        return;
    }
    let folder = asperity_testkit::folder();
    let out = study(folder.path());
    let mut tab = Tab::open(&browser, &out.join("report.html"), SIZE, "dark");
    let unfolded = "document.querySelectorAll('details[open]').length";
    assert_eq!(tab.says(unfolded), "0");
    let (words, first) = printed(&tab.pdf(), folder.path());
    assert!(
        words.contains("The 10 widest of 18 ruptures") && words.contains("Its ruptures, the widest first"),
        "{words}"
    );
    for part in ["What was asked", "Figures", "The runs, one by one", "Claims", "All parameters"] {
        assert!(words.contains(part), "no {part:?} in {words}");
    }
    let white = first.values.iter().filter(|&&value| value == 255).count() as f64 / first.values.len() as f64;
    assert!(white > 0.6, "{:.0} % of the paper is white", 100.0 * white);
    let corners = [0, first.size.0 as usize - 1, first.values.len() - 1];
    assert!(corners.iter().all(|&corner| first.values[corner] == 255));
    // Once it is printed, all is folded again.
    tab.painted();
    assert_eq!(tab.says(unfolded), "0");
    tab.assert_quiet();
}

/// Figures whose files are named like parts of the page, several runs, and enough claims to search.
fn named_as_parts(folder: &Path) -> PathBuf {
    let pipeline = folder.join("parts.toml");
    let mut toml = "title = \"Parts\"\nmain_figure = \"map.png\"\n".to_owned();
    for name in ["a", "b"] {
        toml += &format!(
            "[[run]]\nname = \"{name}\"\nscenario = \"ten-blocks\"\nset = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=1\"]\n"
        );
    }
    for file in
        ["load", "map", "run", "runs", "events", "keys", "pair", "chosen", "ruptures", "run-a", "theme"]
    {
        toml += &format!("[[figure.load]]\nfile = \"{file}.png\"\nrun = \"a\"\nsliding = true\n");
    }
    for n in 0..12 {
        toml += &format!(
            "[[claim]]\nabout = \"section {n}\"\nof = \"this project\"\nquote = \"claim number {n}\"\nrun = \"{}\"\n\
             measure = \"largest_ft_fn\"\nat_most = {}\n",
            if n % 2 == 0 { "a" } else { "b" },
            [1e-9, 10.0][usize::from(n < 5)]
        );
    }
    fs::write(&pipeline, toml).expect("the folder can be written");
    let out = folder.join("parts");
    succeed(&["reproduce", text(&pipeline), "--out", text(&out), "--quiet"]);
    out
}

#[test]
fn figures_may_be_called_as_parts_of_the_page_are() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let out = named_as_parts(folder.path());
    let page = out.join("report.html");
    let mut tab = Tab::open(&browser, &page, SIZE, "light");
    let twice = "(() => { const all = [...document.querySelectorAll('[id]')].map((one) => one.id); \
                 return all.filter((id, n) => all.indexOf(id) < n).join(); })()";
    assert_eq!(tab.says(twice), "", "two parts of the page have one id");
    assert_eq!(tab.says("document.querySelectorAll('#pair #load .uplot').length"), "1");
    assert_eq!(tab.says("document.querySelectorAll('.figures .uplot').length"), "0");
    assert_ne!(tab.says("document.documentElement.dataset.ruptures"), "0");
    assert_eq!(
        tab.says("[...document.images].every((one) => one.complete && one.naturalWidth > 100)"),
        "true"
    );
    tab.assert_quiet();
    // Each thumbnail of an index leads to its figure.
    let index = folder.path().join("index.html");
    succeed(&["report", text(&out), text(&out), "--out", text(&index)]);
    let html = read(&index);
    let leads = attributes(&html, "<a href").into_iter().filter_map(|to| to.split_once('#'));
    let there: Vec<String> = leads.map(|(_, id)| format!("id=\"{id}\"")).collect();
    let report = read(&page);
    assert!(report.split("figure-of-load").next().unwrap().contains("figure-of-map"), "main_figure first");
    assert!(there.len() == 22 && there.iter().all(|id| report.matches(id).count() == 1), "{there:?}");
}

#[test]
fn links_lead_to_runs_and_claims_are_sorted_and_filtered() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let out = named_as_parts(folder.path());
    let run = "document.documentElement.dataset.run";
    let asked = out.join("report.html#run=b&rupture=1");
    let mut tab = Tab::open(&browser, &asked, SIZE, "dark");
    assert_eq!((tab.says(run), tab.says(CHOSEN), tab.says(SELECTED)), ("b".into(), "1".into(), "1".into()));
    tab.click_on("a[data-run=a]");
    assert_eq!((tab.says(run), tab.says(CHOSEN)), ("a".into(), String::new()));
    assert_eq!(tab.says("document.getElementById('run-a').open"), "true");
    assert_eq!(tab.says("document.getElementById('run').value"), "a");

    let rows = "[...document.querySelectorAll('table#claims-1 tbody tr')].filter((row) => !row.hidden)";
    let column = |at: usize| format!("{rows}.map((row) => row.cells[{at}].textContent).join()");
    assert_eq!(tab.says(&format!("{rows}.length")), "12");
    let about = tab.says(&column(1));
    tab.click_on("table#claims-1 th:first-child button");
    let verdicts = tab.says(&column(0));
    assert!(verdicts.starts_with("✓") && verdicts.ends_with("✗ differs"), "{verdicts}");
    tab.click_on("table#claims-1 th:first-child button");
    assert!(tab.says(&column(0)).starts_with("✗"), "the other way round");
    tab.click_on("table#claims-1 th:nth-child(2) button");
    assert_eq!(tab.says(&column(1)), about, "by number, and not 1, 10, 11");
    tab.eval("document.querySelector('input[data-filters=claims-1]').focus()");
    for key in ["a", "g", "r", "e", "e", "s"] {
        tab.press(key);
    }
    assert_eq!(tab.says(&column(1)), "section 0,section 1,section 2,section 3,section 4");
    assert!(tab.says("document.body.textContent").contains("5 of 12"), "it says how many there are");
    tab.assert_quiet();
}

/// The texts on canvases, and their font.
#[test]
fn pictures_are_lettered_in_one_font_and_stay_within_their_frame() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let page = page_of_a_run(folder.path());
    let mut tab = Tab::open(&browser, &page, [400, 800], "light");
    tab.eval(
        "window.written = []; const fill = CanvasRenderingContext2D.prototype.fillText; \
         const font = Object.getOwnPropertyDescriptor(CanvasRenderingContext2D.prototype, 'font'); \
         Object.defineProperty(CanvasRenderingContext2D.prototype, 'font', { get: font.get, \
         set(value) { written.push(['font', value]); font.set.call(this, value); } }); \
         CanvasRenderingContext2D.prototype.fillText = function (words, x, y) { \
         written.push([words, x + this.measureText(words).width]); fill.call(this, words, x, y); }; 0",
    );
    tab.click_on("#events");
    tab.click_on("#theme");
    let fonts =
        "[...new Set(written.filter(([what]) => what === 'font').map(([, value]) => value))].join(' | ')";
    let fonts = tab.says(fonts);
    assert!(fonts.contains("system-ui") && !fonts.contains("undefined"), "{fonts}");
    let legend =
        "written.filter(([what]) => /^(global slips|precursors|other ruptures|slip events)/.test(what))";
    let count: usize =
        tab.says(&format!("new Set({legend}.map(([what]) => what)).size")).parse().expect("a number");
    assert_eq!(count, 4);
    let farthest = format!(
        "Math.max(...{legend}.map(([, right]) => right)) <= document.getElementById('map').clientWidth"
    );
    assert_eq!(tab.says(&farthest), "true");
    tab.assert_quiet();
}

#[test]
fn a_study_shows_claims_beside_figures_and_each_run() {
    let folder = asperity_testkit::folder();
    let out = study(folder.path());
    let html = read(&out.join("report.html"));
    assert!(read(&out.join("reproduce.json")).contains("\"report.html\""), "it is listed");
    assert!(html.contains("<h1>Two &lt;runs&gt; &amp; a tilt</h1>"));
    assert!(html.contains("<b>The thesis:</b> 1 of 2 agree, 1 differ."));
    assert!(html.contains("<b>This project:</b> 1 of 1 agree."));
    // The claims of the figure are beside it; the other one is with the run.
    let (_, figure) = html.split_once("id=\"figure-of-figure-1.01\"").expect("the figure is there");
    let (figure, rest) = figure.split_once("id=\"figure-of-figure-1.02\"").expect("so is the next");
    assert!(figure.contains("“it stays below μ<sub>s</sub>”") && figure.contains("✗ differs"));
    assert!(!figure.contains("it is small"));
    let (_, of_run) = rest.split_once("id=\"run-a\"").expect("so are the runs");
    let (of_run, _) = of_run.split_once("id=\"run-bb\"").expect("one after the other");
    assert!(of_run.contains("This project says") && of_run.contains("it is small"));
    // Every picture has a description, and is embedded in the page.
    let (pictures, words) = (attributes(&html, "<img alt"), attributes(&html, " src"));
    assert_eq!((pictures.len(), words.len()), (2, 2));
    assert!(
        pictures.iter().all(|words| words.contains("Figure 1.") && words.contains(": tilt 0.")),
        "{pictures:?}"
    );
    assert!(words.iter().all(|source| source.starts_with("data:image/")));
    // Every file that it leads to is there.
    let links: Vec<&str> = attributes(&html, "href").into_iter().filter(|to| !to.starts_with('#')).collect();
    assert!(links.len() > 10 && links.contains(&"runs/a.mcap") && links.contains(&"tables/claims.csv"));
    for link in links {
        assert!(out.join(link).is_file(), "{link}");
    }
    // The page contains both runs, with a column for each difference.
    assert_eq!(html.matches("<script type=\"application/json\" class=\"run\"").count(), 2);
    assert!(html.contains("<i>θ</i></th>"), "{html}");
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
    let expected = "a.mcap: its run is not the run that reproduce.json names (accepted: ";
    ends(2, &["report", text(&out), "--out", text(&folder.path().join("c.html"))], &[expected]);
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
    assert!(html.contains("<b>The thesis:</b> 2 of 4 agree, 2 differ."), "all of them");
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
         set = [\"parameter_set=as-coded\", \"slider.blocks=10\", \"time.step_s=1e-7\", \"time.duration_s=0.5\"]\n\
         [[axis]]\nkey = \"normal_load.tilt\"\nvalues = [-0.5, -0.4, -0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3, 0.4]\n\
         [[figure.family]]\nfile = \"counts.png\"\nx = \"normal_load.tilt\"\ny = \"precursor_count\"\n",
    )
    .expect("the folder can be written");
    let out = folder.path().join("tilts");
    succeed(&["sweep", "plan", text(&sweep), "-o", text(&out)]);
    succeed(&["sweep", "run", text(&out), "--quiet"]);
    succeed(&["sweep", "collect", text(&out), "--quiet"]);
    let html = read(&out.join("report.html"));
    assert!(html.contains("<h1>Tilts</h1>") && html.contains("10 of 10 runs done"));
    assert!(
        html.contains("-0.5, -0.4, -0.3, -0.2, -0.1, 0, 0.1, 0.2, 0.3, 0.4") && html.contains("<i>θ</i>")
    );
    assert_eq!(html.matches("src=\"data:image/").count(), 1);
    let (_, table) = html.split_once("id=\"runs\"").expect("the table of runs");
    assert_eq!(table.matches("<tr>").count(), 11, "headings and ten runs");
    // Columns of numbers have number headings, with or without a unit, and with the mark of what is not robust.
    let ratio = "first global rupture F<sub>T</sub>/F<sub>N</sub></th>";
    for heading in ["<i>θ</i></th>", "precursor count <span title=\"one draw of a chaotic series: ", ratio] {
        assert!(table.contains(&format!("class=\"number\">{heading}")), "{heading}: {table}");
    }
    assert!(!table.contains("status</th>") && !table.contains("reason</th>"));
    let page = out.join("logs/3.html");
    fs::create_dir_all(out.join("logs")).expect("the folder can be written");
    fs::write(&page, "").expect("the folder can be written");
    succeed(&["sweep", "collect", text(&out), "--quiet"]);
    let linked = read(&out.join("report.html"));
    assert_eq!(linked.matches("logs/3.html\">3.html</a></details>").count(), 1);
    assert_eq!(linked.replace("<br><a href=\"logs/3.html\">3.html</a>", ""), html, "another run has a link");
    fs::remove_file(&page).expect("it was just written");
    succeed(&["sweep", "collect", text(&out), "--quiet"]);
    for link in attributes(&html, "href").into_iter().filter(|link| !link.starts_with('#')) {
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
        let (code, _, said) = outcome(&[&["report", text(of), "--out", text(&page)], more].concat());
        (code, said)
    };
    let (code, said) = report(&path("nothing.mcap"), &[]);
    assert!(code == 2 && said.contains("nothing.mcap"), "{said}");
    let (code, said) = report(folder.path(), &[]);
    assert!(code == 2 && said.contains("neither a pipeline nor a sweep (accepted: "), "{said}");
    // Damage, and a log that ends too early.
    let bytes = fs::read(&log).expect("the log can be read");
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0x10;
    fs::write(path("damaged.mcap"), damaged).expect("the folder can be written");
    let (code, said) = report(&path("damaged.mcap"), &[]);
    assert!(code == 4 && said.contains("(accepted: what asperity salvage makes of it)"), "{said}");
    assert!(!page.exists());
    fs::write(path("cut.mcap"), &bytes[..bytes.len() - 2000]).expect("the folder can be written");
    let (code, said) = report(&path("cut.mcap"), &[]);
    assert_eq!(code, 3, "{said}");
    assert!(read(&page).contains("Not all of this run is there: incomplete"));
    // Existing files are replaced only on request, and inputs never.
    let (code, said) = report(&log, &[]);
    assert!(code == 2 && said.contains("(accepted: another file, or --force)"), "{said}");
    assert_eq!(report(&log, &["--force"]).0, 0);
    let whole = read(&page);
    assert_eq!(report(&log, &["--force"]).0, 0);
    assert!(read(&page) == whole, "the same log, another page");
    ends(2, &["report", text(&log), "--out", text(&log), "--force"], &[]);
    assert!(fs::read(&log).expect("the log can be read") == bytes);
    // Without scripts all text is there.
    assert!(whole.contains("class=\"without-script\"") && whole.contains("widest of"), "{whole}");
}
