//! A report as one HTML page: shows the fate of events to people, who may share it.
//!
//! The page is a single file that fetches nothing, so that it can be sent and
//! kept; a policy in its head makes the browser enforce that. Its words
//! and tables need no scripts; a script adds the two space-time
//! timelines, drawn on a canvas because there may be ten thousand events.

use std::fmt::Display;

use asperity_report::html::markup::{Cell as Td, Row as Tr, json, paragraph, section, table, text};
use asperity_report::html::{Document, MAP, Part};
use asperity_report::{Figure, STYLE};

use crate::document::{self, Block, Cell, Row, Table, title};
use crate::reading::number;
use crate::report::{Class, Counts, Extent, Report, Verdict};
use crate::timeline::{self, Thinning};

const OWN: Part = Part { style: include_str!("page/diff.css"), script: include_str!("page/diff.js") };

/// How many findings of each class a report has to keep of a pair of runs for a page.
pub const FINDINGS_OF_A_CLASS: usize = 1000;
/// How many matches a report has to keep of a pair of runs for a page.
pub const MATCHES_OF_A_RUN: usize = 200_000;

/// The page of a report.
pub fn page(report: &Report) -> String {
    let listed = document::listed(report);
    let footer = paragraph(
        "A split or merge is one match of several events. Times are simulated time. Made by asperity diff; this file \
         fetches nothing.",
    );
    let footer = format!("<footer class=\"soft\">{footer}</footer>\n");
    let main = heading(report) + &sections(report, document::parts(report, &listed)) + &footer;
    let data = (" id=\"data\"".to_owned(), json(&timeline::timeline(report, &listed)));
    let heading = format!("{} and {} compared", report.old, report.new);
    let has_figures = document::side_by_side(report).is_some();
    let parts: &[Part] = if has_figures { &[STYLE, MAP, OWN] } else { &[MAP, OWN] };
    Document { title: heading, main, data: vec![data], parts }.html()
}

fn sections(report: &Report, parts: Vec<document::Part>) -> String {
    let one = |part: document::Part| {
        let mut body: String = part.blocks.into_iter().map(|of| block(report, of)).collect();
        if part.title == "Findings" && !body.is_empty() {
            body = format!(
                "<p class=\"needs-script\">Those of the run and classes that are shown above; a click leads to the \
                 place in the timelines.</p>\n<div class=\"list\">{body}</div>\n"
            );
        }
        let before = if part.title == "Findings" { timelines(report) } else { String::new() };
        before + &section(part.title, &body)
    };
    parts.into_iter().map(one).collect()
}

/// The head: the outcome in one word and one sentence.
fn heading(report: &Report) -> String {
    let class = if report.verdict == Verdict::Differs { "differs" } else { "within" };
    let policy = match &report.policy {
        Some(policy) => format!("<code>{}</code>", text(policy)),
        None => "exact: nothing may differ".to_owned(),
    };
    // Of two parameter sets single events come last.
    let events = document::side_by_side(report)
        .map_or_else(|| paragraph(&document::events(report)), |_| String::new());
    format!(
        "<header>\n<h1>What differs between the runs</h1>\n<p><span class=\"verdict {class}\">{}</span></p>\n\
         {events}<p>OLD <code>{}</code><br>NEW <code>{}</code><br>policy {policy}</p>\n</header>\n",
        text(document::verdict(report)),
        text(&report.old),
        text(&report.new),
    )
}

fn block(report: &Report, block: Block) -> String {
    match block {
        Block::Words(words) | Block::OnPage(words) => paragraph(words.trim_start()),
        Block::OnScreen(_) => String::new(),
        Block::Table(of) => set(of),
        Block::Figures(of) if of.is_empty() => String::new(),
        Block::Figures(of) => {
            format!("<div class=\"figures\">\n{}</div>\n", of.iter().map(figure).collect::<String>())
        }
        Block::Fold { words, is_open, parts } => format!(
            "<details{}><summary>{}</summary>\n{}</details>\n",
            if is_open { " open" } else { "" },
            text(words),
            sections(report, parts)
        ),
    }
}

fn figure(of: &Figure) -> String {
    let (title, runs) = (text(&of.title), text(of.runs.join(", ")));
    let picture = of.picture.as_deref().unwrap_or_default();
    format!(
        "<div class=\"figure alone\">\n<figure><a><img alt=\"{title}: {runs}\" src=\"{picture}\"></a>\n\
         <figcaption>{title}</figcaption></figure>\n</div>\n"
    )
}

/// A table; one with a caption is folded below that.
fn set(of: Table) -> String {
    let Table { caption, headings, rows, is_of_runs, left_out, .. } = of;
    let rows = rows.iter().map(row);
    let out = table(if is_of_runs { "runs" } else { "" }, "", &headings, rows);
    let mut out = format!("<div class=\"wide\">{out}</div>\n");
    if left_out > 0 {
        let words = format!("{left_out} more are not listed here; --format json and --matches have them.");
        out = paragraph(&words) + &out;
    }
    match caption.is_empty() {
        true => out,
        false => format!("<details><summary>{}</summary>\n{out}</details>\n", text(caption)),
    }
}

fn row(row: &Row) -> Tr {
    let attributes =
        row.finding.map_or_else(String::new, |n| format!(" data-finding=\"{n}\" tabindex=\"0\""));
    Tr { attributes, cells: row.cells.iter().map(cell).collect() }
}

fn cell(cell: &Cell) -> Td {
    let lines = |lines: &mut dyn Iterator<Item = String>| match lines.collect::<Vec<_>>() {
        none if none.is_empty() => Td::None,
        some => Td::Html(some.join("<br>")),
    };
    match cell {
        Cell::Text(words) => Td::text(words),
        Cell::Number(number) if number.is_empty() => Td::None,
        Cell::Number(number) => Td::number(number),
        Cell::Key(key) => {
            let key = text(key);
            let breaking = key.replace('.', ".<wbr>").replace('_', "_<wbr>");
            Td::Html(format!("<code data-key=\"{key}\">{breaking}</code>"))
        }
        Cell::Class(class) => {
            Td::Html(format!("<span class=\"class\">{}{}</span>", key(*class), text(title(*class))))
        }
        Cell::Run(place, name) => {
            Td::Html(format!("<a href=\"#timeline\" data-run=\"{place}\">{}</a>", text(name)))
        }
        Cell::Events(events) => lines(&mut events.iter().map(event)),
        Cell::Lines(words) => lines(&mut words.iter().map(|words| text(words).to_string())),
    }
}

/// An event by number, with its times and blocks.
fn event(event: &Extent) -> String {
    let end: &dyn Display = match event.end_s {
        Some(end_s) => &format!("{} s", number(end_s)),
        None => &"the run's end",
    };
    let blocks = Extent::words(event.bounding_box(), event.first_across.is_some(), " to ");
    let (number, onset) = (event.event, number(event.onset_s));
    format!("<b>{number}</b> <span class=\"value\">{onset} s to {end}</span>, {blocks}")
}

/// The swatch of a class, as the timeline draws it.
fn key(class: Class) -> String {
    format!(
        "<canvas class=\"key needs-script\" width=\"22\" height=\"14\" data-look=\"{}\" aria-hidden=\"true\"></canvas>",
        class.name()
    )
}

fn timelines(report: &Report) -> String {
    if report.runs.is_empty() {
        return String::new();
    }
    let ruptures = report.runs.iter().filter_map(|run| run.ruptures.as_ref());
    let drawn: Counts = ruptures.map(|ruptures| &ruptures.table.counts).chain([&report.counts]).sum();
    let boxes: String = drawn
        .there()
        .map(|(class, _)| {
            format!(
                "<label><input type=\"checkbox\" checked data-class=\"{}\"> {}{}</label>",
                class.name(),
                key(class),
                text(title(class))
            )
        })
        .collect();
    let thinned = Thinning::of(report, timeline::EVENTS_MOST).words();
    let left_out: u64 = report.runs.iter().map(|run| run.events.matches_left_out).sum();
    let left_out = (left_out > 0)
        .then(|| format!("For lack of space, the report itself leaves out {left_out} matches."));
    let notes: String = [thinned, left_out].into_iter().flatten().map(|words| paragraph(&words)).collect();
    section(
        "Timelines",
        &format!(
            "<p class=\"without-script\">The timelines are drawn by a script, which this browser does not run.</p>\n\
             {notes}<div class=\"controls needs-script\">\n\
             <label>run <select id=\"run\"></select></label>\n\
             <button data-action=\"in\">zoom in</button><button data-action=\"out\">zoom out</button>\
             <button data-action=\"left\" aria-label=\"earlier\">◀</button>\
             <button data-action=\"right\" aria-label=\"later\">▶</button>\
             <button data-action=\"whole\">whole run</button><button data-action=\"save\">save as PNG</button>\n</div>\n\
             <div class=\"controls needs-script\"><fieldset><legend>show</legend>{boxes}</fieldset></div>\n\
             <figure class=\"needs-script\">\n<canvas id=\"timeline\" class=\"map\" tabindex=\"0\" role=\"img\" aria-label=\"Space-time \
             timelines of the old run above and the new run below; every event a rectangle from its onset to its end and \
             from its first to its last block. The same is in the tables of this page.\"></canvas>\n\
             <figcaption>Each rectangle is a rupture or a slip event: onset to end across, first to last block up; none is drawn \
             thinner than 1.5 dots. Between the timelines, marks stand where events differ, and lines lead to those \
             that belong together; where there are too many, bars count the matches of each class. Drag to move; the wheel zooms once the picture has been clicked; with the keyboard: \
             arrows, +, -, 0. <span id=\"drawn\"></span></figcaption>\n</figure>\n<div id=\"hover\" role=\"status\"></div>\n"
        ),
    )
}

#[cfg(test)]
mod tests {
    use asperity_files::{Existing, FileSet, Inputs};
    use serde_json::json;

    use super::{Thinning, page};
    use crate::document::events::LISTED_MOST;
    use crate::report::{Finding, NumberChange, ProvenanceChange, Report, SettingChange};
    use crate::{Settings, compare};

    /// A run of a few events: one splits, one moves, one is missing. Some of the rest is made up.
    fn made_up(name: &str) -> Report {
        let folder = tempfile::tempdir().unwrap();
        let table = |side: &str, changed: &str| {
            let same = (0..5).map(|n| format!("0.{0},0.{0}1,1,{1}\n", n + 1, 10 + n));
            let table =
                format!("onset_s,end_s,first_block,last_block\n{}{changed}", same.collect::<String>());
            let path = folder.path().join(format!("{side}.csv"));
            std::fs::write(&path, table).unwrap();
            path
        };
        let old = table("old", "0.6,0.61,1,15\n0.7,0.71,1,16\n0.8,0.81,1,17\n");
        let new = table("new", "0.6,0.604,1,8\n0.606,0.61,9,15\n0.803,0.813,1,17\n");
        let files = FileSet::new(Existing::Refuse, Inputs::default());
        let keep = Settings { keep_findings: 9, keep_matches: 99, ..Settings::default() };
        let mut report = compare(&old, &new, &keep, &files).unwrap().report;
        let run = &mut report.runs[0];
        (run.old.name, run.new.name) = (name.to_owned(), name.to_owned());
        run.set_differently = vec![SettingChange {
            change: NumberChange::between("normal_load.total_n", &json!(19.200000000000003), &json!(20.5)),
            unit: Some("N"),
            shapes_motion: true,
        }];
        run.summary = [("precursor_count", 57, 51), ("blocks", 100, 100), ("steps", 45, 45)]
            .map(|(key, old, new)| NumberChange::between(key, &json!(old), &json!(new)))
            .into();
        let [old, new] = ["0123", "4567"].map(|code| Some(code.to_owned()));
        run.provenance = vec![ProvenanceChange { key: "code_version".to_owned(), old, new }];
        report
    }

    /// The data for the script.
    fn data(page: &str) -> serde_json::Value {
        let (_, rest) = page.split_once("id=\"data\">").expect("the page has data");
        let (data, _) = rest.split_once("</script>").expect("the data end");
        serde_json::from_str(data).expect("the data are JSON")
    }

    #[test]
    fn what_it_says_in_words_needs_no_script() {
        let page = page(&made_up("default"));
        let (words, _) = page.split_once("<script").expect("the page has a script");
        for part in [
            "1 run, 8 old and 8 new events: 5 identical, 1 shifted, 1 split, 1 missing",
            "differs</span>",
            "several new events lie in its time and blocks",
            "duration not conserved",
            "onset_s 0.8 → 0.803",
            "0.8 s to 0.81 s",
            "code_version",
            "normal_<wbr>load.<wbr>total_<wbr>n (N)</code></td><td class=\"number\">19.2</td><td class=\"number\">20.5</td><td class=\"number\">+1.3</td>",
            "<summary>2 identical</summary>",
        ] {
            assert!(words.contains(part), "{part}");
        }
        // One row each for the finding, its old and its new events.
        assert_eq!(words.matches("data-finding=").count(), 3);
        // Differences in settings come first.
        let place = |heading: &str| words.find(&format!("<h2>{heading}</h2>"));
        assert!(
            place("Set differently").is_some() && place("Set differently") < place("The runs in numbers")
        );
    }

    #[test]
    fn nothing_is_fetched_and_names_cannot_break_out() {
        let page = page(&made_up("</script><img title=x>&\"'"));
        assert!(!page.contains("<img"), "a name is text");
        for outward in ["http:", "https:", "//www", " src=", "@import", "url(", "<link"] {
            assert!(!page.contains(outward), "{outward}");
        }
        // None ends but those that begin.
        assert_eq!(page.matches("</script>").count(), page.matches("<script").count());
        assert_eq!(data(&page)["runs"][0]["name"], "</script><img title=x>&\"'");
    }

    #[test]
    fn the_timeline_holds_every_event_and_findings_lead_to_theirs() {
        let report = made_up("default");
        let data = data(&page(&report));
        let run = &data["runs"][0];
        for (side, events) in [("old", 8), ("new", 8)] {
            assert_eq!(run[side].as_array().map(Vec::len), Some(events), "{side}");
        }
        let findings = data["findings"].as_array().expect("a list");
        assert_eq!(findings.len(), 3);
        for (finding, listed) in findings.iter().zip(&report.runs[0].events.findings) {
            let place = finding["match"].as_u64().expect("every finding is a match");
            let found = &report.runs[0].events.matches[place as usize];
            assert_eq!((found.class, &found.old, &found.new), (listed.class, &listed.old, &listed.new));
            let is_there = |side: &str| {
                let events = run[side].as_array().expect("a list");
                events.iter().filter(|event| event[6] == place).count()
            };
            assert_eq!((is_there("old"), is_there("new")), (found.old.len(), found.new.len()));
        }
    }

    #[test]
    fn too_many_events_are_thinned_and_it_says_so() {
        let mut report = made_up("default");
        let run = &mut report.runs[0];
        let same = run.events.matches[0].clone();
        run.events.matches.extend(std::iter::repeat_n(same, 1000));
        assert_eq!(Thinning::of(&report, 3000).words(), None);
        let words = Thinning::of(&report, 500).words().expect("there is no room for all");
        assert!(words.contains("draws all of those that differ and one in 5 of those"), "{words}");
        let words = Thinning::of(&report, 3).words().expect("there is no room even for what differs");
        assert!(words.contains("one in 2 of those that differ"), "{words}");
    }

    #[test]
    fn of_many_findings_those_not_allowed_are_listed_first() {
        let mut report = made_up("default");
        let run = &mut report.runs[0];
        let allowed =
            Finding { allowed: true, rule: "let pass".to_owned(), ..run.events.findings[2].clone() };
        run.events.findings.splice(0..0, std::iter::repeat_n(allowed, LISTED_MOST));
        let page = page(&report);
        assert!(page.contains("several new events lie in its") && page.contains("same blocks, another time"));
        assert!(page.contains("3 more are not listed here"));
        assert_eq!(page.matches("<tr data-finding=").count(), LISTED_MOST);
    }
}
