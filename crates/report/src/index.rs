//! Several studies on one page: their scores and every figure as a thumbnail, with links to the
//! reports.

use asperity_numbers::claim::Claim;

use crate::claims::{SCORE, heading};
use crate::figures::Figure;
use crate::html::Document;
use crate::html::markup::{counted, text};
use crate::page::STYLE;
use crate::symbols::lettered;

/// A study among several.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its subject.
    pub title: String,
    /// Its report, from the folder of the page; none if it has none.
    pub report: Option<String>,
    /// How many runs it has.
    pub runs: u64,
    /// Its claims.
    pub claims: Vec<Claim>,
    /// Its figures, which are beside the page.
    pub figures: Vec<Figure>,
}

/// The page of several studies. Its pictures are files beside it.
pub fn index(title: &str, entries: &[Entry]) -> String {
    let mut main = format!("<header>\n<h1>{}</h1>\n", text(title));
    let all: Vec<Claim> = entries.iter().flat_map(|entry| entry.claims.clone()).collect();
    main += &heading(&all, SCORE);
    let studies = if entries.len() == 1 { "study" } else { "studies" };
    main += &format!("<p class=\"soft\">{} {studies}.</p>\n</header>\n", entries.len());
    for entry in entries {
        let title = match &entry.report {
            Some(report) => format!("<a href=\"{}\">{}</a>", text(report), text(&entry.title)),
            None => text(&entry.title),
        };
        main += &format!("<section>\n<h2>{title}</h2>\n");
        main += &heading(&entry.claims, "");
        main += &format!(
            "<p class=\"soft\">{}, {}.</p>\n<div class=\"thumbnails\">\n",
            counted(entry.runs, "run"),
            counted(entry.figures.len() as u64, "figure")
        );
        for figure in &entry.figures {
            let target = match &entry.report {
                Some(report) => format!("{report}#{}", figure.place()),
                None => figure.file.clone(),
            };
            main += &format!(
                "<a href=\"{}\"><img loading=\"lazy\" src=\"{}\" alt=\"{}\"><span>{}</span></a>\n",
                text(target),
                text(&figure.file),
                // A thumbnail has no room for more than a sentence.
                text(figure.caption.split_inclusive(". ").next().unwrap_or_default().trim_end()),
                lettered(&figure.name())
            );
        }
        main += "</div>\n</section>\n";
    }
    Document { title: title.to_owned(), main, data: Vec::new(), parts: &[STYLE] }
        .with_pictures_from("data: 'self' file:")
}

#[cfg(test)]
mod tests {
    use super::{Entry, index};
    use crate::figures::Figure;

    #[test]
    fn every_figure_leads_to_its_place_in_the_report() {
        let figure = |words: [&str; 3]| {
            let [file, title, caption] = words.map(str::to_owned);
            Figure { file, title, caption, ..Figure::default() }
        };
        let entry = Entry {
            title: "A & B".to_owned(),
            report: Some("a/report.html".to_owned()),
            runs: 2,
            claims: Vec::new(),
            figures: vec![
                figure(["a/figures/figure-5.09.png", "", "Lengths at 0.5 s. Shown: all."]),
                figure(["a/figures/load.png", "Load: tilt 0.5", "Load. Shown: all."]),
            ],
        };
        let html = index("All", &[entry.clone(), Entry { report: None, ..entry }]);
        assert!(
            html.contains("href=\"a/report.html#figure-of-figure-5.09\"><img loading=\"lazy\""),
            "{html}"
        );
        assert!(html.contains("alt=\"Lengths at 0.5 s.\""), "{html}");
        assert!(html.contains("<span>Figure 5.9</span>") && html.contains("<span>Load: tilt 0.5</span>"));
        assert!(html.contains("<h2>A &amp; B</h2>") && html.contains("2 studies"));
    }
}
