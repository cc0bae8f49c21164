//! The page of a study, from its title to its last link.

use std::collections::BTreeSet;

use asperity_record::RunHeader;

use crate::claims;
use crate::derived;
use crate::html::markup::{counted, sections_with_contents, text};
use crate::html::{CURVES, Document, LONG_TABLE, MAP, Part};
use crate::parameter_table::{self, Parameters, differing, parameters};
use crate::sketch::{kind, sketch};
use crate::study::{Run, Study};
use crate::symbols::number;
use crate::verdict::verdict;
use crate::{figures, measured, over_area, runs};

/// Additions to the look of all pages: figures, sketches, and what else is only in reports.
pub const STYLE: Part =
    Part { style: concat!(include_str!("report.css"), include_str!("sketch.css")), script: "" };
const SCRIPT: Part = Part { style: "", script: include_str!("report.js") };

impl Study {
    /// The page.
    pub fn html(&self) -> String {
        let asked: Vec<Parameters> = self.runs.iter().map(Parameters::of_run).collect();
        let of_sketch =
            |run: &Run| if run.header.parts().recording { String::new() } else { sketch(&run.scenario) };
        let sketches: Vec<String> = self.runs.iter().map(of_sketch).collect();
        let simulated = || self.runs.iter().filter(|run| !run.header.parts().recording);
        let differing = differing(&simulated().map(Parameters::of_run).collect::<Vec<_>>());
        let ranges: Vec<_> = differing.iter().map(|key| parameter_table::range_of(key, &asked)).collect();
        let shared =
            if self.runs.len() == 1 { "All parameters" } else { "All parameters that the runs share" };
        let what = match self.runs.iter().position(|run| !run.header.parts().recording) {
            Some(first) => format!(
                "<div class=\"model\">{sketch}{}{}</div>\n{}<details><summary>{shared}</summary>\n{}</details>\n",
                parameter_table::main(&asked[first], &ranges),
                derived::list(simulated().map(|run| &run.scenario)),
                self.other_models(&sketches),
                parameters(&asked[first], &differing),
                sketch = sketches[first],
            ),
            None => String::new(),
        };
        let pair = runs::pair(&self.runs);
        let details = runs::details(&self.runs, &asked, &differing, &self.claims, &self.figures, &sketches);
        let result = figures::result(&self.figures, &self.claims);
        let rest = [
            ("Score", claims::scores(&self.claims)),
            ("What was measured", measured::section(&self.runs)),
            ("What was asked", what),
            ("Figures", figures::further(&self.figures, &self.claims)),
        ];
        let end = [
            (claims::ALL, claims::all(&self.claims, &|claim| figures::about(claim, &self.figures))),
            ("Files", runs::links(&self.links)),
        ];
        let main = match self.runs.as_slice() {
            [run] => {
                let sections = rest.into_iter().chain([("The run in numbers", details)]).chain(end);
                let sections = sections_with_contents(&sections.collect::<Vec<_>>());
                [self.heading(&verdict(run)), pair, result, sections].concat()
            }
            runs => {
                let table = runs::table_of(runs, &asked, &differing);
                let own = [("Runs", table), ("The runs, one by one", pair + &details)];
                let sections = rest.into_iter().chain(own).chain(end);
                [self.heading(""), result, sections_with_contents(&sections.collect::<Vec<_>>())].concat()
            }
        };
        let mut parts = vec![STYLE, CURVES, MAP, LONG_TABLE];
        parts.extend(over_area::is_needed(&self.runs).then_some(over_area::PART));
        parts.push(SCRIPT);
        Document {
            title: self.title.clone(),
            main: main + &footer(&self.made()),
            data: self.runs.iter().map(|run| runs::data(run, &self.runs)).collect(),
            parts: &parts,
        }
        .html()
    }

    /// The sketches of further models, which differ in drive or contact from those before.
    fn other_models(&self, sketches: &[String]) -> String {
        let kinds: Vec<_> = self.runs.iter().map(|run| kind(&run.scenario)).collect();
        let mut out = String::new();
        for (place, one) in kinds.iter().enumerate() {
            if place > 0 && !kinds[..place].contains(one) && !self.runs[place].header.parts().recording {
                let same = self.runs.iter().zip(&kinds).filter(|(_, kind)| *kind == one);
                out += &format!(
                    "<figure>{}<figcaption>The model of {}.</figcaption></figure>\n",
                    sketches[place],
                    claims::links(same.map(|(run, _)| &run.name))
                );
            }
        }
        if out.is_empty() { out } else { format!("<div class=\"model\">{out}</div>\n") }
    }

    /// The head of the page; for a single run also the verdict on it.
    fn heading(&self, verdict: &str) -> String {
        let count = |one: fn(&Run) -> u64| self.runs.iter().map(one).sum::<u64>();
        let mut out = format!("<header>\n<h1>{}</h1>\n", text(&self.title));
        out += &claims::heading(&self.claims, claims::SCORE);
        if self.runs.len() == 1 {
            return out + verdict + "</header>\n";
        }
        out += &format!(
            "<p class=\"soft\">{}, {}, {}.</p>\n{}</header>\n",
            counted(self.runs.len() as u64, "run"),
            counted(count(|run| run.collected.rupture_count), "rupture"),
            counted(self.figures.len() as u64, "figure"),
            self.as_coded()
        );
        out
    }

    /// States that runs are those of the thesis' program, with its slider.
    fn as_coded(&self) -> String {
        let coded = self.runs.iter().filter_map(|run| run.scenario.as_coded_in_words());
        let coded: Vec<String> = coded.collect();
        let Some(first) = coded.first() else { return String::new() };
        let others = if coded.iter().all(|words| words == first) { "" } else { " and others" };
        let share = match self.runs.len() {
            all if all == coded.len() => String::new(),
            all => format!(", in {} of {all} runs", coded.len()),
        };
        format!("<p>{}{others}{share}.</p>\n", text(first))
    }

    /// How the runs were made, unless the page must not say so.
    fn made(&self) -> String {
        let distinct = |value: &dyn Fn(&RunHeader) -> String| -> String {
            let values: BTreeSet<String> = self.runs.iter().map(|run| value(&run.header)).collect();
            values.into_iter().collect::<Vec<_>>().join(", ")
        };
        if !self.provenance || self.runs.is_empty() {
            return " ".to_owned();
        }
        format!(
            "Time step {} s; solver {}; code version <code>{}</code>. ",
            distinct(&|run| number(run.time_step_s)),
            text(distinct(&|run| run.solver.clone())),
            text(distinct(&|run| run.code_version.clone()))
        )
    }
}

/// The foot of a page; how its runs were made comes first, as HTML.
pub(crate) fn footer(made: &str) -> String {
    format!(
        "<footer class=\"soft\"><p>{made}Times are simulated time. Made by asperity; this file fetches nothing.</p>\
         </footer>\n"
    )
}
