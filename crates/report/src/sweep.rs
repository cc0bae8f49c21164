//! The page of a parameter study: its axes, its figures, and a table of its runs.

use std::collections::BTreeMap;

use asperity_model::Scenario;
use asperity_model::scenario::keys::{self, Key};
use asperity_numbers::claim::Claim;
use asperity_numbers::text::what_marks_mean;
use asperity_numbers::{Convergence, Summary};
use asperity_record::Cell as Stored;

use crate::claims;
use crate::figures::{Figure, about, further, result};
use crate::html::Document;
use crate::html::markup::{self, Cell, Row, paragraph, sections_with_contents, table, text};
use crate::page::{STYLE, footer};
use crate::parameter_table::{self, Parameters, main as main_of, meaning, parameters};
use crate::runs::links;
use crate::sketch::sketch;
use crate::study::Link;
use crate::symbols::{lettered, rounded, symbol};

/// A parameter study.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Its subject.
    pub title: String,
    /// The scenario of its first run that one accepts; none where there is none.
    pub scenario: Option<Scenario>,
    /// The keys that vary, and the values of each in words.
    pub varied: Vec<(String, String)>,
    /// How many of its runs are done, in words.
    pub state: String,
    /// The headings of the table of runs: name and unit.
    pub columns: Vec<(String, Option<&'static str>)>,
    /// The rows that fit on the page.
    pub rows: Vec<Vec<Stored>>,
    /// How many there are.
    pub row_count: u64,
    /// Its figures.
    pub figures: Vec<Figure>,
    /// The phase maps among them: the columns across, upwards, and in colour.
    pub maps: Vec<[String; 3]>,
    /// Its folder in a command, from that of the page.
    pub folder: String,
    /// The link to the folder of its logs; none if it keeps none.
    pub logs: Option<String>,
    /// The links to pages of its runs, by number.
    pub pages: BTreeMap<u64, String>,
    /// Its claims.
    pub claims: Vec<Claim>,
    /// Its tables.
    pub links: Vec<Link>,
    /// The code that made its runs; none if the page must not name it.
    pub code_version: Option<String>,
}

impl Sweep {
    /// Most rows of runs on a page.
    pub const ROWS: usize = 2000;

    /// Values of several runs in one cell of a map that are shown.
    const IN_A_CELL: usize = 4;

    /// The page.
    pub fn html(&self) -> String {
        let varied: Vec<&'static Key> =
            self.varied.iter().filter_map(|(path, _)| keys::named(path)).collect();
        let asked = self.scenario.as_ref().map_or(String::new(), |scenario| {
            let asked = Parameters::of(scenario);
            format!(
                "<div class=\"model\">{}{}</div>\n<details><summary>Parameters that all runs share</summary>\n{}</details>\n",
                sketch(scenario),
                main_of(&asked, &self.varied.iter().map(|(key, values)| (key.clone(), text(values))).collect::<Vec<_>>()),
                parameters(&asked, &varied)
            )
        });
        let rows = self.varied.iter().map(|(path, values)| {
            let key = keys::named(path);
            Row::from(vec![
                Cell::Html(key.map_or(String::new(), |key| symbol(key.symbol))),
                Cell::Html(markup::name(path)),
                Cell::text(values),
                key.map_or(Cell::None, |key| Cell::Html(meaning(key))),
            ])
        });
        let varied = table("", "What varies", &["symbol", "key", "values", "meaning"], rows);
        let made = self
            .code_version
            .as_ref()
            .map_or(String::new(), |version| format!("Code version <code>{}</code>. ", text(version)));
        let main = [
            format!(
                "<header>\n<h1>{}</h1>\n{}<p class=\"score\">{}</p>\n</header>\n",
                text(&self.title),
                claims::heading(&self.claims, claims::SCORE),
                text(format!("{}.", self.state))
            ),
            result(&self.figures, &self.claims),
            sections_with_contents(&[
                ("Score", claims::scores(&self.claims)),
                ("What was asked", format!("{asked}{varied}")),
                ("Figures", further(&self.figures, &self.claims)),
                ("Maps, cell by cell", self.maps.iter().filter_map(|map| self.cells_of(map)).collect()),
                ("Runs", self.runs()),
                (claims::ALL, claims::all(&self.claims, &|claim| about(claim, &self.figures))),
                ("Files", links(&self.links)),
            ]),
            footer(&made),
        ];
        Document { title: self.title.clone(), main: main.concat(), data: Vec::new(), parts: &[STYLE] }.html()
    }

    /// A phase map as a table whose cells link to their runs; none if its places are too scattered for one.
    fn cells_of(&self, [x, y, value]: &[String; 3]) -> Option<String> {
        let column = |name: &String| self.columns.iter().position(|(column, _)| column == name);
        let [x, y, value] = [column(x)?, column(y)?, column(value)?];
        let values = |column: usize| {
            let mut values: Vec<&Stored> = Vec::new();
            for row in &self.rows {
                if !values.contains(&&row[column]) {
                    values.push(&row[column]);
                }
            }
            values.sort_by(|a, b| match (a, b) {
                (Stored::Number(a), Stored::Number(b)) => a.total_cmp(b),
                _ => std::cmp::Ordering::Equal,
            });
            values
        };
        let (across, upwards) = (values(x), values(y));
        if across.len() * upwards.len() > Sweep::ROWS {
            return None;
        }
        let mut headings = vec![format!("{} ↑, {} →", self.heading(y), self.heading(x))];
        headings.extend(across.iter().map(|value| format!("#{}", html(value))));
        let rows = upwards.iter().rev().map(|up| {
            let mut cells = vec![Cell::Html(format!("<b>{}</b>", html(up)))];
            cells.extend(across.iter().map(|across| {
                let of: Vec<&Vec<Stored>> =
                    self.rows.iter().filter(|row| row[x] == **across && row[y] == **up).collect();
                let shown = of.iter().take(Sweep::IN_A_CELL).map(|row| {
                    let number = match &row[value] {
                        Stored::Empty => "–".to_owned(),
                        Stored::Number(number) => rounded(*number, 3),
                        other => html(other),
                    };
                    format!("<a href=\"#run-{0}\" title=\"run {0}\">{number}</a>", row[0])
                });
                let shown: Vec<String> = shown.collect();
                let more = match of.len().saturating_sub(shown.len()) {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                Cell::Html(shown.join(", ") + &more)
            }));
            Row::from(cells)
        });
        Some(format!("<h3>{}</h3>\n{}", self.heading(value), table("", "", &headings, rows)))
    }

    /// The name of a column, with its unit.
    fn heading(&self, column: usize) -> String {
        let (name, unit) = &self.columns[column];
        let of_summary = Summary::KEYS.iter().find(|key| key.column.name == name.as_str());
        let words = match (keys::named(name), of_summary) {
            (Some(key), _) => parameter_table::name(key),
            (None, Some(key)) => lettered(&key.label()),
            (None, None) => text(name),
        };
        let unit =
            unit.filter(|unit| *unit != "1").map_or(String::new(), |unit| format!(" ({})", text(unit)));
        let class = of_summary.map(|key| key.convergence).filter(|class| !class.mark().is_empty());
        let mark =
            |class: Convergence| format!(" <span title=\"{}\">{}</span>", text(class.why()), class.mark());
        words + &unit + &class.map_or(String::new(), mark)
    }

    fn runs(&self) -> String {
        let is_done = |cells: &Vec<Stored>| cells.contains(&Stored::Word("done".into()));
        // Where all are done, they say the same in every row.
        let needless: &[&str] = if self.rows.iter().all(is_done) { &["status", "reason"] } else { &[] };
        let is_shown = |n: &usize| !needless.contains(&self.columns[*n].0.as_str());
        let headings: Vec<String> = (0..self.columns.len())
            .filter(is_shown)
            .map(|n| {
                // Numbers, and the mark for a missing one, are aligned to the right.
                let is_word = |cells: &Vec<Stored>| {
                    let number = |cell: &Stored| {
                        matches!(cell, Stored::Empty | Stored::Number(_) | Stored::Count(_) | Stored::Step(_))
                    };
                    cells.get(n).is_some_and(|cell| !number(cell))
                };
                let mark = if self.rows.iter().any(is_word) { "" } else { "#" };
                format!("{mark}{}", self.heading(n))
            })
            .collect();
        let rows = self.rows.iter().map(|cells| {
            let shown = (0..cells.len()).filter(is_shown);
            let mut shown: Vec<Cell> = shown.map(|n| Cell::of(&cells[n], 5)).collect();
            if let (Some(first), Some(Stored::Step(run))) = (shown.first_mut(), cells.first()) {
                *first = self.run(*run, is_done(cells));
            }
            Row::from(shown)
        });
        let left_out = self.row_count - self.rows.len() as u64;
        let mut said = format!(
            "<p>The number of a run unfolds the command that makes its log, in the folder of this page{}; <code>asperity \
             report</code> makes a page of a log, which is linked here once it is <code>logs/RUN.html</code>.</p>\n",
            if self.folder == UNNAMED { ", with the folder of the study for DIR" } else { "" }
        );
        if left_out > 0 {
            said += &paragraph(&format!(
                "The first {}; {left_out} more are in the table of runs.",
                self.rows.len()
            ));
        }
        said + &what_marks_mean().lines().map(paragraph).collect::<String>()
            + &table("runs", "", &headings, rows)
    }

    /// The number of a run, with the command that makes its log, and links to its log and page, where there are any.
    fn run(&self, run: u64, is_done: bool) -> Cell {
        let link = |to: &str, ending| format!("<br><a href=\"{}\">{run}.{ending}</a>", text(to));
        let log =
            self.logs.as_ref().filter(|_| is_done).map(|logs| link(&format!("{logs}{run}.mcap"), "mcap"));
        let page = self.pages.get(&run).map(|page| link(page, "html"));
        let links = [log, page].map(Option::unwrap_or_default).concat();
        Cell::Value(
            run as f64,
            format!(
                "<details><summary>{run}</summary><code id=\"run-{run}\">asperity sweep log {} {run} -o {run}.mcap</code>\
                 {links}</details>",
                text(&self.folder)
            ),
        )
    }
}

/// The folder of a study in a command, where its name needs quoting.
pub const UNNAMED: &str = "DIR";

/// A value as HTML.
fn html(cell: &Stored) -> String {
    match cell {
        Stored::Number(value) => rounded(*value, 5),
        Stored::Flag(flag) => if *flag { "yes" } else { "no" }.to_owned(),
        other => text(other),
    }
}
