//! The page of a parameter study: what varies, its figures, and a table of its runs.

use std::collections::BTreeSet;

use asperity_model::Scenario;
use asperity_model::keys::{KEYS, Key};
use asperity_numbers::claim::Claim;
use asperity_record::Cell as Stored;

use crate::claims;
use crate::figures::{Figure, figures};
use crate::html::Document;
use crate::html::markup::{Cell, Row, paragraph, section, sortable_table, table, text};
use crate::page::STYLE;
use crate::parameter_table::{Parameters, main as main_of, parameters};
use crate::runs::links;
use crate::sketch::sketch;
use crate::study::Link;
use crate::symbols::{rounded, symbol};

/// A parameter study.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// What it is about.
    pub title: String,
    /// The scenario of its first run that one accepts; none where there is none.
    pub scenario: Option<Scenario>,
    /// The keys that vary, and the values of each in words.
    pub varied: Vec<(String, String)>,
    /// How many of its runs are done, in words.
    pub state: String,
    /// The headings of the table of runs: name and unit.
    pub columns: Vec<(String, Option<&'static str>)>,
    /// The rows that there is room for.
    pub rows: Vec<Vec<Stored>>,
    /// How many there are.
    pub row_count: u64,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// Its claims.
    pub claims: Vec<Claim>,
    /// Its tables.
    pub links: Vec<Link>,
    /// The code that made its runs; none if the page is not to say.
    pub code_version: Option<String>,
}

impl Sweep {
    /// Most rows of runs on a page.
    pub const ROWS: usize = 2000;

    /// The page.
    pub fn html(&self) -> String {
        let varied: Vec<&'static Key> =
            self.varied.iter().filter_map(|(path, _)| KEYS.iter().find(|key| key.path == path)).collect();
        let asked = self.scenario.as_ref().map_or(String::new(), |scenario| {
            let asked = Parameters::of(scenario);
            format!(
                "<div class=\"model\">{}{}</div>\n<details><summary>Parameters that all runs share</summary>\n<div class=\"wide\">{}</div></details>\n",
                sketch(scenario),
                main_of(&asked, &varied),
                parameters(&asked, &varied)
            )
        });
        let rows = self.varied.iter().map(|(path, values)| {
            let key = KEYS.iter().find(|key| key.path == path);
            Row::from(vec![
                Cell::Html(key.map_or(String::new(), |key| symbol(key.symbol))),
                Cell::Html(format!("<code>{}</code>", text(path))),
                Cell::text(values),
                Cell::Html(format!("<span class=\"soft\">{}</span>", text(key.map_or("", |key| key.doc)))),
            ])
        });
        let varied = table("What varies", &["symbol", "key", "values", "meaning"], rows);
        let made = self
            .code_version
            .as_ref()
            .map_or(String::new(), |version| format!("Code version <code>{}</code>. ", text(version)));
        let main = [
            format!(
                "<header>\n<h1>{}</h1>\n{}<p class=\"score\">{}</p>\n</header>\n",
                text(&self.title),
                claims::heading(&self.claims),
                text(format!("{}.", self.state))
            ),
            section("What was asked", &format!("{asked}{varied}")),
            section("Score", &claims::scores(&self.claims)),
            figures(&self.figures, &self.claims),
            section("Runs", &self.runs()),
            claims::all(&self.claims),
            section("Files", &links(&self.links)),
            format!(
                "<footer class=\"soft\"><p>{made}Times are simulated time. Made by asperity; this file fetches nothing.</p>\
                 </footer>\n"
            ),
        ];
        Document { title: self.title.clone(), main: main.concat(), data: Vec::new(), parts: &[STYLE] }.html()
    }

    fn runs(&self) -> String {
        let headings: Vec<String> = self
            .columns
            .iter()
            .enumerate()
            .map(|(n, (name, unit))| {
                // Numbers, and what stands for one that there is none of, are set to the right.
                let is_word = |cells: &Vec<Stored>| {
                    let number = |cell: &Stored| {
                        matches!(cell, Stored::Empty | Stored::Number(_) | Stored::Count(_) | Stored::Step(_))
                    };
                    cells.get(n).is_some_and(|cell| !number(cell))
                };
                let mark = if self.rows.iter().any(is_word) { "" } else { "#" };
                match unit {
                    Some("1") | None => format!("{mark}{name}"),
                    Some(unit) => format!("{mark}{name} ({unit})"),
                }
            })
            .collect();
        let headings: Vec<&str> = headings.iter().map(String::as_str).collect();
        let claimed: BTreeSet<&str> = self.claims.iter().map(|claim| claim.run.as_str()).collect();
        let rows = self.rows.iter().map(|cells| {
            // Claims link to their runs.
            let run = cells.first().map(ToString::to_string).filter(|run| claimed.contains(run.as_str()));
            let attributes = run.map_or(String::new(), |run| format!(" id=\"run-{}\"", text(run)));
            Row { attributes, cells: cells.iter().map(cell).collect() }
        });
        let left_out = self.row_count - self.rows.len() as u64;
        let more = if left_out > 0 {
            paragraph(&format!("The first {}; {left_out} more are in the table of runs.", self.rows.len()))
        } else {
            String::new()
        };
        format!("{more}{}", sortable_table("runs", "", &headings, rows))
    }
}

fn cell(cell: &Stored) -> Cell {
    match cell {
        Stored::Empty => Cell::None,
        Stored::Number(value) => Cell::Value(*value, rounded(*value, 5)),
        Stored::Count(count) => Cell::number(count),
        Stored::Step(step) => Cell::number(step),
        Stored::Flag(flag) => Cell::text(if *flag { "yes" } else { "no" }),
        other => Cell::text(other.to_string()),
    }
}
