//! What a text claims beside what was measured, with a verdict by a stated rule.

use std::collections::BTreeMap;
use std::fmt::Write;

use polars::prelude::{Column, DataFrame, NamedFrom, Series};
use serde::Deserialize;

use crate::AnalysisError;
use crate::measure::Measure;
use crate::run_data::RunData;

/// Relative deviation up to which a number stated is taken to agree.
const TOLERANCE: f64 = 0.02;

/// What an agreement is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Measured in a run, which could have given something else.
    #[default]
    Simulated,
    /// Worked out from the parameters alone.
    Arithmetic,
    /// Looked for in a run because the source shows it: it exists, no more.
    Selection,
    /// Put in by the program itself: a check of the program.
    Construction,
}

impl Kind {
    fn word(self) -> &'static str {
        match self {
            Kind::Simulated => "simulated",
            Kind::Arithmetic => "arithmetic",
            Kind::Selection => "selection",
            Kind::Construction => "construction",
        }
    }
}

/// One claim, as the pipeline has it.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Where the source makes it: a figure, equation or section.
    pub about: String,
    /// The source's own words.
    pub quote: String,
    /// The run to measure.
    pub run: String,
    /// A run to measure against: what counts is the value in `run` less that in
    /// this one, for claims about trends.
    pub against: Option<String>,
    /// What to measure in it.
    pub measure: Measure,
    /// What an agreement is worth.
    #[serde(default)]
    pub kind: Kind,
    /// Whether the source gives the number as approximate: then half a unit of its
    /// last digit is allowed as well.
    #[serde(default)]
    pub approximate: bool,
    /// The number claimed, with the digits the source gives; absent where the
    /// source speaks in words.
    pub stated: Option<String>,
    /// For measures that look for the nearest precursor: its number of blocks,
    /// where that is not the number claimed; for those taken at a load, `F_T / F_N`.
    pub near: Option<f64>,
    /// Where the source speaks in words: the largest value that bears it out.
    pub at_most: Option<f64>,
    /// The same for the smallest value.
    pub at_least: Option<f64>,
    /// What a reader should know of the outcome.
    #[serde(default)]
    pub note: String,
}

impl Claim {
    /// The run, or the difference of runs, in words.
    fn runs(&self) -> String {
        match &self.against {
            None => self.run.clone(),
            Some(against) => format!("{} less {against}", self.run),
        }
    }
}

/// A claim, measured.
#[derive(Debug, Clone)]
pub struct Outcome<'a> {
    /// The claim.
    pub claim: &'a Claim,
    /// What was measured; `None` where the run does not have it.
    pub ours: Option<f64>,
    /// Ours minus stated.
    pub deviation: Option<f64>,
    /// The rule in words.
    pub rule: String,
    /// `agrees`, `differs` or `not reached`.
    pub verdict: &'static str,
}

/// Measures every claim.
pub fn judge<'a>(claims: &'a [Claim], runs: &BTreeMap<String, RunData>) -> Vec<Outcome<'a>> {
    claims
        .iter()
        .map(|claim| {
            let stated: Option<f64> = claim.stated.as_ref().and_then(|text| text.parse().ok());
            let of =
                |name: &String| runs.get(name).and_then(|run| claim.measure.of(run, claim.near.or(stated)));
            let ours = match &claim.against {
                None => of(&claim.run),
                Some(against) => of(&claim.run).zip(of(against)).map(|(value, other)| value - other),
            };
            let deviation = ours.zip(stated).map(|(ours, stated)| ours - stated);
            let (rule, holds): (String, Option<bool>) = match (stated, claim.at_most, claim.at_least) {
                (Some(stated), ..) => {
                    let digit = half_last_digit(claim.stated.as_deref().unwrap_or_default());
                    let relative = TOLERANCE * stated.abs();
                    let (tolerance, rule) = if claim.approximate && digit > relative {
                        (digit, "half the last digit given")
                    } else {
                        (relative, "2 %")
                    };
                    let holds = deviation.map(|deviation| deviation.abs() <= tolerance);
                    (format!("within {tolerance:.4}, {rule}"), holds)
                }
                (None, Some(limit), _) => (format!("at most {limit}"), ours.map(|ours| ours <= limit)),
                (None, None, Some(limit)) => (format!("at least {limit}"), ours.map(|ours| ours >= limit)),
                (None, None, None) => ("none".to_owned(), None),
            };
            let verdict = match holds {
                Some(true) => "agrees",
                Some(false) => "differs",
                None => "not reached",
            };
            Outcome { claim, ours, deviation, rule, verdict }
        })
        .collect()
}

/// Half a unit of the last digit of a decimal number as written.
fn half_last_digit(text: &str) -> f64 {
    let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    0.5 * 0.1f64.powi(decimals as i32)
}

/// The claims as a table.
///
/// # Errors
/// If polars refuses.
pub fn table(outcomes: &[Outcome<'_>]) -> Result<DataFrame, AnalysisError> {
    let texts = |name: &str, value: &dyn Fn(&Outcome<'_>) -> String| -> Column {
        Series::new(name.into(), outcomes.iter().map(value).collect::<Vec<String>>()).into()
    };
    let numbers = |name: &str, value: &dyn Fn(&Outcome<'_>) -> Option<f64>| -> Column {
        Series::new(name.into(), outcomes.iter().map(value).collect::<Vec<Option<f64>>>()).into()
    };
    Ok(DataFrame::new_infer_height(vec![
        texts("about", &|outcome| outcome.claim.about.clone()),
        texts("run", &|outcome| outcome.claim.runs()),
        texts("quote", &|outcome| outcome.claim.quote.clone()),
        texts("measure", &|outcome| measure_name(outcome.claim.measure)),
        texts("stated", &|outcome| outcome.claim.stated.clone().unwrap_or_default()),
        numbers("ours", &|outcome| outcome.ours),
        numbers("deviation", &|outcome| outcome.deviation),
        texts("rule", &|outcome| outcome.rule.clone()),
        texts("verdict", &|outcome| outcome.verdict.to_owned()),
        texts("kind", &|outcome| outcome.claim.kind.word().to_owned()),
        texts("note", &|outcome| outcome.claim.note.clone()),
    ])?)
}

/// The claims as a page of Markdown, headed by what the runs were.
pub fn markdown(title: &str, outcomes: &[Outcome<'_>], runs: &BTreeMap<String, RunData>) -> String {
    let distinct = |value: &dyn Fn(&RunData) -> String| -> String {
        let values: std::collections::BTreeSet<String> = runs.values().map(value).collect();
        values.into_iter().collect::<Vec<_>>().join(", ")
    };
    let mut page = format!(
        "# {title}: claims\n\nParameter set {}; dt = {} s; solver {}; code version {}.\n\n",
        distinct(&|run| run.header.parameter_set.clone()),
        distinct(&|run| format!("{:e}", run.header.time_step_s)),
        distinct(&|run| run.header.solver.clone()),
        distinct(&|run| run.header.code_version.clone()),
    );
    for (kind, meaning) in [
        (Kind::Simulated, "measured in a run, which could have given something else"),
        (Kind::Arithmetic, "worked out from the parameters alone"),
        (Kind::Selection, "looked for in a run because the source shows it"),
        (Kind::Construction, "put in by the program itself"),
    ] {
        let count = |verdict| {
            let of_kind = outcomes.iter().filter(|outcome| outcome.claim.kind == kind);
            of_kind.filter(|outcome| outcome.verdict == verdict).count()
        };
        writeln!(
            page,
            "- *{}* ({meaning}): {} agree, {} differ, {} not reached.",
            kind.word(),
            count("agrees"),
            count("differs"),
            count("not reached")
        )
        .expect("writing to a string cannot fail");
    }
    page.push_str(
        "\nDeviations are ours minus stated. Limits of claims that the source makes in words are ours.\n\n\
         | about | run | the source says | measured | stated | ours | deviation | rule | verdict | kind |\n\
         |---|---|---|---|---|---|---|---|---|---|\n",
    );
    let number = |value: Option<f64>| match value {
        None => "-".to_owned(),
        Some(value) if value != 0.0 && value.abs() < 1e-3 => format!("{value:.1e}"),
        Some(value) => format!("{value:.4}"),
    };
    let signed = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:+.4}"));
    for outcome in outcomes {
        let claim = outcome.claim;
        let note = if claim.note.is_empty() { String::new() } else { format!(" ({})", claim.note) };
        writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} | {} | {} | **{}**{note} | {} |",
            claim.about,
            claim.runs(),
            claim.quote.replace('|', "\\|"),
            measure_name(claim.measure),
            claim.stated.as_deref().unwrap_or("-"),
            number(outcome.ours),
            signed(outcome.deviation),
            outcome.rule,
            outcome.verdict,
            claim.kind.word()
        )
        .expect("writing to a string cannot fail");
    }
    page
}

/// A measure in words: its name with spaces.
pub(crate) fn measure_name(measure: Measure) -> String {
    let mut words = String::new();
    for letter in format!("{measure:?}").chars() {
        if letter.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(letter.to_lowercase());
    }
    words
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Claim, half_last_digit, judge};
    use crate::precursors::tests::{EVENTS, run};

    #[test]
    fn a_trend_is_the_difference_of_two_runs() {
        let claim = |limit: &str| -> Claim {
            let text = format!(
                "about = \"a\"\nquote = \"b\"\nrun = \"many\"\nagainst = \"few\"\n\
                 measure = \"precursor-count\"\n{limit}"
            );
            toml::from_str(&text).unwrap()
        };
        let runs = BTreeMap::from([("many".to_owned(), run(&EVENTS)), ("few".to_owned(), run(&EVENTS[5..]))]);
        let claims = [
            claim("at_least = 1"),
            claim("at_most = 0"),
            Claim { run: "gone".to_owned(), ..claim("at_least = 1") },
        ];
        let outcomes = judge(&claims, &runs);
        assert_eq!(outcomes[0].ours, Some(3.0));
        let verdicts: Vec<&str> = outcomes.iter().map(|outcome| outcome.verdict).collect();
        assert_eq!(verdicts, ["agrees", "differs", "not reached"]);
        assert_eq!(claims[0].runs(), "many less few");
    }

    #[test]
    fn half_a_digit_is_read_off_the_text() {
        assert_eq!(half_last_digit("17"), 0.5);
        assert!((half_last_digit("3.55") - 0.005).abs() < 1e-15);
        assert!((half_last_digit("0.225") - 0.0005).abs() < 1e-15);
    }
}
