//! The page of a diff in a real browser: that its script runs, draws every
//! event, and leads from a finding to its place.
//!
//! Needs Chromium; without it these tests skip with a message, or fail with `ASPERITY_NO_SKIPS=1`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{ends, run, succeed, text};
use crate::support::browser::{Tab, browser};

/// The attributes `data-*` that the page's script leaves on the root element, after the page has been loaded and
/// `script` has run.
fn loaded(tab: &mut Tab, page: &Path, script: &str) -> BTreeMap<String, String> {
    tab.go(page, [1280, 1000], "light");
    // Pictures may be drawn later than a script ends; before printing they are drawn at once.
    tab.eval(&format!("{{ {script}; window.dispatchEvent(new Event(\"beforeprint\")) }}"));
    tab.assert_quiet();
    serde_json::from_value(tab.eval("({ ...document.documentElement.dataset })"))
        .expect("its values are texts")
}

fn number(attributes: &BTreeMap<String, String>, name: &str) -> usize {
    attributes
        .get(name)
        .and_then(|value| value.parse().ok())
        .unwrap_or_else(|| panic!("data-{name} is no number: {attributes:?}"))
}

/// Diffs two tables, which must differ, and gives the page.
fn page(folder: &Path, old: &Path, new: &Path) -> PathBuf {
    let page = folder.join("page.html");
    ends(1, &["diff", text(old), text(new), "--page", text(&page)], &[]);
    page
}

fn golden(run: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../fixtures/golden/chapter5/{run}.csv"))
}

fn rows(table: &Path) -> usize {
    fs::read_to_string(table).expect("the table can be read").lines().count() - 1
}

#[test]
fn a_split_and_a_missing_event_are_drawn_and_found() {
    let Some(browser) = browser() else { return };
    let mut tab = Tab::start(&browser);
    let folder = asperity_testkit::folder();
    let table = |name: &str, rows: &str| {
        let path = folder.path().join(name);
        let header = "onset_s,end_s,first_block,last_block,max_sliding,ft_fn_onset,ft_fn_end\n";
        fs::write(&path, header.to_owned() + rows).expect("the folder can be written");
        path
    };
    let old = table(
        "old.csv",
        "0.1,0.11,1,5,5,0.1,0.1\n0.2,0.22,1,9,9,0.2,0.2\n0.3,0.31,1,4,4,0.3,0.3\n0.4,0.41,1,12,12,0.4,0.4\n",
    );
    let new = table(
        "new.csv",
        "0.1,0.11,1,5,5,0.1,0.1\n0.2,0.209,1,5,5,0.2,0.2\n0.211,0.22,5,9,5,0.2,0.2\n0.4,0.41,1,12,12,0.4,0.4\n",
    );
    let page = page(folder.path(), &old, &new);
    let seen = loaded(&mut tab, &page, "");
    assert_eq!((number(&seen, "drawn"), number(&seen, "events")), (8, 8));

    // A click on the first finding leads to it, and no other stays in view.
    let click = "document.querySelector('tr[data-finding]').click()";
    let seen = loaded(&mut tab, &page, click);
    assert_eq!(number(&seen, "chosen"), 0);
    assert_eq!(number(&seen, "drawn"), 3, "one old and two new events");

    // Events that are filtered out are neither drawn nor listed.
    let filter = "const box = document.querySelector('input[data-class=identical]'); box.click(); \
                  document.documentElement.dataset.rows = \
                  [...document.querySelectorAll('tr[data-finding]')].filter((row) => !row.hidden).length";
    let seen = loaded(&mut tab, &page, filter);
    assert_eq!((number(&seen, "drawn"), number(&seen, "rows")), (4, 2));
}

#[test]
fn one_changed_event_of_a_whole_run_is_found() {
    let Some(browser) = browser() else { return };
    let mut tab = Tab::start(&browser);
    let folder = asperity_testkit::folder();
    let old = golden("default");
    let csv = fs::read_to_string(&old).expect("the table can be read");
    let mut lines: Vec<String> = csv.lines().map(ToOwned::to_owned).collect();
    let row = lines.len() / 2;
    let mut cells: Vec<&str> = lines[row].split(',').collect();
    let last_block = (cells[3].parse::<u32>().expect("a block") + 1).to_string();
    cells[3] = &last_block;
    lines[row] = cells.join(",");
    let new = folder.path().join("default.csv");
    fs::write(&new, lines.join("\n") + "\n").expect("the folder can be written");

    let page = page(folder.path(), &old, &new);
    let seen = loaded(&mut tab, &page, "");
    assert_eq!(number(&seen, "drawn"), 2 * rows(&old));
    let seen = loaded(&mut tab, &page, "document.querySelector('tr[data-finding]').click()");
    assert!((2..20).contains(&number(&seen, "drawn")), "{seen:?}");
    let rows = "document.documentElement.dataset.rows = document.querySelectorAll('tr[data-finding]').length";
    assert_eq!(number(&loaded(&mut tab, &page, rows), "rows"), 1);
}

/// As when two chaotic runs part: from a third of the run on, of every three events one is missing, one is
/// longer, and one is unchanged.
#[test]
fn thousands_of_events_that_differ_are_drawn() {
    let Some(browser) = browser() else { return };
    let mut tab = Tab::start(&browser);
    let folder = asperity_testkit::folder();
    let old = golden("load-on-far-end");
    let csv = fs::read_to_string(&old).expect("the table can be read");
    let third = csv.lines().count() / 3;
    let lines = csv.lines().enumerate().filter_map(|(row, line)| match row % 3 {
        0 if row > third => None,
        1 if row > third => {
            let mut cells: Vec<String> = line.split(',').map(ToOwned::to_owned).collect();
            let last_block: u32 = cells[3].parse().expect("a block");
            cells[3] = (last_block + 7).min(100).to_string();
            Some(cells.join(","))
        }
        _ => Some(line.to_owned()),
    });
    let new = folder.path().join("load-on-far-end.csv");
    fs::write(&new, lines.collect::<Vec<_>>().join("\n") + "\n").expect("the folder can be written");
    let page = page(folder.path(), &old, &new);
    let seen = loaded(&mut tab, &page, "");
    let all = rows(&old) + rows(&new);
    assert!(all > 12_000, "{all} events are not many");
    assert_eq!((number(&seen, "drawn"), number(&seen, "events")), (all, all));
    let zoomed = loaded(&mut tab, &page, "document.querySelector('button[data-action=in]').click()");
    assert!(number(&zoomed, "drawn") < all, "{zoomed:?}");
}

#[test]
fn ruptures_are_drawn_first_and_the_slip_events_of_a_finding_are_one_click_away() {
    let Some(browser) = browser() else { return };
    let mut tab = Tab::start(&browser);
    let folder = asperity_testkit::folder();
    let [old, new] = ["old.mcap", "new.mcap"].map(|name| folder.path().join(name));
    let set = ["default", "--set", "time.duration_s=0.5", "--set"];
    run(&[&set[..], &["time.step_s=1e-7"]].concat(), &old);
    run(&[&set[..], &["time.step_s=2e-7"]].concat(), &new);
    let page = page(folder.path(), &old, &new);
    let html = fs::read_to_string(&page).expect("the page can be read");
    let place = |words: &str| html.find(words).unwrap_or_else(|| panic!("no {words:?} on the page"));
    let first = ["<h2>The runs in numbers</h2>", "precursor_count", "<h2>Ruptures</h2>", "<h2>Classes</h2>"];
    const UNFOLD: &str = "document.querySelectorAll('details').forEach((fold) => { fold.open = true })";
    assert!(first.map(place).is_sorted());

    let count = |log: &Path, kind: &str| {
        let out = log.with_extension("tables");
        if !out.exists() {
            succeed(&["reduce", text(log), "--out", text(&out)]);
        }
        rows(&out.join(format!("{kind}.csv")))
    };
    let both = |kind: &str| count(&old, kind) + count(&new, kind);
    let seen = loaded(&mut tab, &page, UNFOLD);
    assert_eq!((number(&seen, "drawn"), number(&seen, "events")), (both("ruptures"), both("ruptures")));
    let click = format!("{UNFOLD}; document.querySelector('tr[data-finding]').click()");
    let seen = loaded(&mut tab, &page, &click);
    assert_eq!(number(&seen, "events"), both("events"), "a finding is one of slip events");
}

/// The policy of a page names its own scripts and styles by their hashes.
#[test]
fn only_scripts_and_styles_of_the_page_itself_are_applied() {
    let Some(browser) = browser() else { return };
    let mut tab = Tab::start(&browser);
    let folder = asperity_testkit::folder();
    let page = page(folder.path(), &golden("default"), &golden("load-on-far-end"));
    let html = fs::read_to_string(&page).expect("the page can be read");
    const SCRIPT: &str = "<script>document.title = 'changed'</script>";
    const HANDLER: &str = "<img alt=\"\" src=\"data:,\" onerror=\"document.title = 'changed'\">";
    // What is put in instead of what, whether the page is drawn, and what the browser says that it refused.
    let cases = [
        ("</script>\n</body>", " </script>\n</body>", false, "script"),
        ("</body>", &format!("{SCRIPT}</body>"), true, "script"),
        ("</main>", &format!("{HANDLER}</main>"), true, "event handler"),
        ("</style>", "main { display: none }</style>", true, "style"),
        ("<main>", "<main style=\"display: none\">", true, "style"),
    ];
    for (place, changed, is_drawn, refused) in cases {
        assert!(html.contains(place), "{place}");
        let tried = folder.path().join("tried.html");
        fs::write(&tried, html.replacen(place, changed, 1)).expect("the folder can be written");
        tab.go(&tried, [1280, 1000], "light");
        let said = tab.refused();
        assert!(said.len() == 1 && said[0].contains(refused), "{changed}: {said:?}");
        assert_eq!(tab.eval("'drawn' in document.documentElement.dataset"), is_drawn, "{changed}");
        assert_eq!(
            tab.eval("document.title === 'changed' || !document.querySelector('main').offsetWidth"),
            false
        );
    }
}
