//! What a text claims beside what was measured, with a verdict by a stated rule.
//!
//! The statements of a source and those of this project are told apart, and counted apart: the
//! latter are checks of what its manual says, and no score of the source.

use std::collections::BTreeMap;
use std::fmt::Write;

use asperity_record::RunHeader;
use asperity_summary::median;
use polars::prelude::{Column, DataFrame, NamedFrom, Series};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::AnalysisError;
use crate::measure::Measure;
use crate::run_data::RunData;
use crate::wants::Wants;

/// Relative deviation up to which a number stated is taken to agree.
const TOLERANCE: f64 = 0.02;

/// What an agreement is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
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

/// Whose statement a claim is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
pub enum Speaker {
    /// That of the text which the pipeline is about; the quote is verbatim.
    #[default]
    #[serde(rename = "the source")]
    Source,
    /// This project's own: its theory, its other reading of the source, or what it expects.
    #[serde(rename = "this project")]
    Project,
}

impl Speaker {
    fn word(self) -> &'static str {
        match self {
            Speaker::Source => "the source",
            Speaker::Project => "this project",
        }
    }
}

/// One claim, as the pipeline has it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Where it is made, or what it is about: a figure, equation or section.
    pub about: String,
    /// Whose statement it is.
    #[serde(default)]
    pub of: Speaker,
    /// The words of whoever makes it.
    pub quote: String,
    /// The run to measure.
    pub run: String,
    /// A run whose value is taken off: the claim is about the difference.
    pub minus: Option<String>,
    /// Runs, or ensembles of runs, that differ from the run in what should not matter, a kick of
    /// 1e-9 m/s say. A number stated is then compared with the spread of all of them, give or
    /// take what is allowed of any number, and the rule says how many lie below it. To lie in
    /// the spread says no more than that nothing speaks against it, and is not counted as
    /// agreement. Where the source speaks in words, their median is judged.
    #[serde(default)]
    pub spread: Vec<String>,
    /// As many that are taken off, one from each of the spread.
    #[serde(default)]
    pub minus_spread: Vec<String>,
    /// The same runs with the parameter set `as-stated`, where the claim is to be
    /// judged in them as well.
    pub as_stated: Option<Runs>,
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
    /// where that is not the number claimed.
    pub near: Option<f64>,
    /// Where the source speaks in words: the largest value that bears it out.
    pub at_most: Option<f64>,
    /// Where the source speaks in words: the smallest value that bears it out.
    pub at_least: Option<f64>,
    /// What a reader should know of the outcome.
    #[serde(default)]
    pub note: String,
}

/// What a claim is measured in.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Runs {
    /// The run to measure.
    pub run: String,
    /// A run whose value is taken off.
    pub minus: Option<String>,
    /// Runs, or ensembles of runs, that differ from the run in what should not matter.
    #[serde(default)]
    pub spread: Vec<String>,
    /// As many that are taken off, one from each of the spread.
    #[serde(default)]
    pub minus_spread: Vec<String>,
}

impl Claim {
    /// All runs that it speaks of.
    pub(crate) fn runs(&self) -> impl Iterator<Item = &str> {
        let second = self.as_stated.as_ref();
        let own = [Some(&self.run), self.minus.as_ref()].into_iter().flatten();
        let own = own.chain(&self.spread).chain(&self.minus_spread);
        let others = second.into_iter().flat_map(|runs| {
            let pair = [Some(&runs.run), runs.minus.as_ref()].into_iter().flatten();
            pair.chain(&runs.spread).chain(&runs.minus_spread)
        });
        own.chain(others).map(String::as_str)
    }

    /// What it reads of each of its runs.
    pub(crate) fn wants(&self) -> Wants {
        self.measure.wants()
    }

    /// The number stated.
    fn stated(&self) -> Option<f64> {
        self.stated.as_ref().and_then(|text| text.parse().ok())
    }

    /// Its lists of runs, in which an ensemble may stand for its members.
    pub(crate) fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<String>> {
        let second = self.as_stated.iter_mut().flat_map(|runs| [&mut runs.spread, &mut runs.minus_spread]);
        [&mut self.spread, &mut self.minus_spread].into_iter().chain(second)
    }

    /// Checks that the claim can be judged.
    ///
    /// # Errors
    /// In words: key, value and what would be accepted.
    pub(crate) fn check(&self) -> Result<(), String> {
        if let Some(text) = self.stated.as_ref().filter(|text| text.parse::<f64>().is_err()) {
            return Err(format!("stated: {text:?} is not a number (accepted: a number in quotes)"));
        }
        let rules = [self.stated.is_some(), self.at_most.is_some(), self.at_least.is_some()];
        if rules.iter().filter(|&&given| given).count() != 1 {
            return Err("needs exactly one of stated, at_most and at_least".to_owned());
        }
        let own = (&self.minus, &self.spread, &self.minus_spread);
        let second = self.as_stated.as_ref().map(|runs| (&runs.minus, &runs.spread, &runs.minus_spread));
        for (minus, spread, minus_spread) in [Some(own), second].into_iter().flatten() {
            let needed = if minus.is_some() { spread.len() } else { 0 };
            if minus_spread.len() != needed {
                return Err(format!(
                    "minus_spread: {} runs are not accepted (accepted: {needed}, {})",
                    minus_spread.len(),
                    if minus.is_some() { "one for each of spread" } else { "without minus" }
                ));
            }
        }
        Ok(())
    }
}

/// A claim, measured.
#[derive(Debug, Clone)]
pub struct Outcome<'a> {
    /// The claim.
    pub claim: &'a Claim,
    /// Measured in its own runs.
    pub own: Judgement,
    /// Measured in those with the parameter set `as-stated`, where it names them.
    pub as_stated: Option<Judgement>,
}

/// What was measured, and how it stands to what is claimed.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// What was measured; `None` where the run does not have it.
    pub ours: Option<f64>,
    /// Ours minus stated.
    pub deviation: Option<f64>,
    /// The rule in words.
    pub rule: String,
    /// `agrees`, `differs`, `not reached`, or `in the spread` where no more can be said.
    pub verdict: &'static str,
}

/// What the claims of a list measure in one run, in their order; `None` for those that do not speak
/// of it, and where the run does not have it.
#[derive(Debug, Clone)]
pub struct Measured(Vec<Option<f64>>);

impl Measured {
    /// Measures a run.
    pub fn of(claims: &[Claim], run: &RunData) -> Measured {
        let speaks = |claim: &Claim| claim.runs().any(|name| name == run.name);
        let measure = |claim: &Claim| claim.measure.of(run, claim.near.or(claim.stated()));
        Measured(claims.iter().map(|claim| speaks(claim).then(|| measure(claim)).flatten()).collect())
    }
}

/// Judges every claim by what was measured in the runs, by their names.
pub fn judge<'a>(claims: &'a [Claim], runs: &BTreeMap<&str, &Measured>) -> Vec<Outcome<'a>> {
    claims
        .iter()
        .enumerate()
        .map(|(index, claim)| {
            let measured = |run: &str| runs.get(run).and_then(|measured| measured.0[index]);
            let own = Runs {
                run: claim.run.clone(),
                minus: claim.minus.clone(),
                spread: claim.spread.clone(),
                minus_spread: claim.minus_spread.clone(),
            };
            let as_stated = claim.as_stated.as_ref().map(|second| judge_in(claim, second, &measured));
            Outcome { claim, own: judge_in(claim, &own, &measured), as_stated }
        })
        .collect()
}

fn judge_in(claim: &Claim, of: &Runs, measure: &dyn Fn(&str) -> Option<f64>) -> Judgement {
    let stated = claim.stated();
    let difference = |name: &String, minus: Option<&String>| match minus {
        None => measure(name),
        Some(other) => Some(measure(name)? - measure(other)?),
    };
    let own = difference(&of.run, of.minus.as_ref());
    let is_spread = !of.spread.is_empty();
    let mut draws: Vec<f64> = of
        .spread
        .iter()
        .enumerate()
        .filter_map(|(index, name)| difference(name, of.minus_spread.get(index)))
        .chain(own.filter(|_| is_spread))
        .collect();
    draws.sort_by(f64::total_cmp);
    // Of one run's number in words there is no more than itself.
    let ours = if is_spread && stated.is_none() { median(draws.iter().copied()) } else { own };
    let deviation = ours.zip(stated).map(|(ours, stated)| ours - stated);
    let of_runs = if is_spread { format!(", the median of {} runs", draws.len()) } else { String::new() };
    let (rule, holds): (String, Option<bool>) = match (stated, claim.at_most, claim.at_least) {
        (Some(stated), ..) if is_spread => {
            let tolerance = TOLERANCE * stated.abs();
            match draws.first().zip(draws.last()) {
                None => ("within the spread of runs, of which none has it".to_owned(), None),
                Some((low, high)) => (
                    format!(
                        "within 2 % of {low:.4} to {high:.4}, the spread of {} runs; median {:.4}, {} below",
                        draws.len(),
                        median(draws.iter().copied()).unwrap_or(f64::NAN),
                        draws.iter().filter(|&&draw| draw < stated).count()
                    ),
                    Some((low - tolerance..=high + tolerance).contains(&stated)),
                ),
            }
        }
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
        (None, Some(limit), _) => (format!("at most {limit}{of_runs}"), ours.map(|ours| ours <= limit)),
        (None, None, Some(limit)) => (format!("at least {limit}{of_runs}"), ours.map(|ours| ours >= limit)),
        (None, None, None) => ("none".to_owned(), None),
    };
    let verdict = match holds {
        Some(true) if is_spread && stated.is_some() => "in the spread",
        Some(true) => "agrees",
        Some(false) => "differs",
        None => "not reached",
    };
    Judgement { ours, deviation, rule, verdict }
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
    let mut columns = vec![
        texts("about", &|outcome| outcome.claim.about.clone()),
        texts("of", &|outcome| outcome.claim.of.word().to_owned()),
        texts("run", &|outcome| outcome.claim.run.clone()),
        texts("quote", &|outcome| outcome.claim.quote.clone()),
        texts("measure", &|outcome| outcome.claim.measure.name()),
        texts("stated", &|outcome| outcome.claim.stated.clone().unwrap_or_default()),
        numbers("ours", &|outcome| outcome.own.ours),
        numbers("deviation", &|outcome| outcome.own.deviation),
        texts("rule", &|outcome| outcome.own.rule.clone()),
        texts("verdict", &|outcome| outcome.own.verdict.to_owned()),
        texts("kind", &|outcome| outcome.claim.kind.word().to_owned()),
        texts("note", &|outcome| outcome.claim.note.clone()),
    ];
    if outcomes.iter().any(|outcome| outcome.as_stated.is_some()) {
        let second = |outcome: &Outcome<'_>, text: &dyn Fn(&Judgement) -> String| {
            outcome.as_stated.as_ref().map_or(String::new(), text)
        };
        columns.extend([
            numbers("as_stated_ours", &|outcome| outcome.as_stated.as_ref()?.ours),
            texts("as_stated_rule", &|outcome| second(outcome, &|found| found.rule.clone())),
            texts("as_stated_verdict", &|outcome| second(outcome, &|found| found.verdict.to_owned())),
        ]);
    }
    Ok(DataFrame::new_infer_height(columns)?)
}

/// The claims as a page has them: as they are in the table.
pub(crate) fn told(outcomes: &[Outcome<'_>]) -> Vec<asperity_report::Claim> {
    let judgement = |found: &Judgement| asperity_report::Judgement {
        ours: found.ours,
        rule: found.rule.clone(),
        verdict: found.verdict.to_owned(),
    };
    let told = |outcome: &Outcome<'_>| asperity_report::Claim {
        about: outcome.claim.about.clone(),
        of: outcome.claim.of.word().to_owned(),
        run: outcome.claim.run.clone(),
        quote: outcome.claim.quote.clone(),
        measure: outcome.claim.measure.name(),
        stated: outcome.claim.stated.clone().unwrap_or_default(),
        own: judgement(&outcome.own),
        deviation: outcome.own.deviation,
        kind: outcome.claim.kind.word().to_owned(),
        note: outcome.claim.note.clone(),
        as_stated: outcome.as_stated.as_ref().map(judgement),
    };
    outcomes.iter().map(told).collect()
}

/// The claims as a page of Markdown, headed by what the runs were.
pub fn markdown(title: &str, outcomes: &[Outcome<'_>], runs: &[&RunHeader]) -> String {
    let distinct = |value: &dyn Fn(&RunHeader) -> String| -> String {
        let values: std::collections::BTreeSet<String> = runs.iter().map(|run| value(run)).collect();
        values.into_iter().collect::<Vec<_>>().join(", ")
    };
    let mut page = format!(
        "# {title}: claims\n\nParameter set {}; dt = {} s; solver {}; code version {}.\n\n",
        distinct(&|run| run.parameter_set.clone()),
        distinct(&|run| format!("{:e}", run.time_step_s)),
        distinct(&|run| run.solver.clone()),
        distinct(&|run| run.code_version.clone()),
    );
    for speaker in [Speaker::Source, Speaker::Project] {
        let of_speaker: Vec<&Outcome<'_>> =
            outcomes.iter().filter(|outcome| outcome.claim.of == speaker).collect();
        if !of_speaker.is_empty() {
            score(&mut page, speaker, &of_speaker);
        }
    }
    page.push_str("Deviations are ours minus stated. Limits of claims made in words are ours.\n");
    let has_second = outcomes.iter().any(|outcome| outcome.as_stated.is_some());
    let (heading, line) = if has_second {
        page.push_str(
            "The column \"as-stated\" holds the same claim against runs with that parameter set, the values of \
             the source's text; the columns before it are of the run named.\n",
        );
        (" as-stated |", "---|")
    } else {
        ("", "")
    };
    let number = |value: Option<f64>| match value {
        None => "-".to_owned(),
        Some(value) if value != 0.0 && value.abs() < 1e-3 => format!("{value:.1e}"),
        Some(value) => format!("{value:.4}"),
    };
    let signed = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:+.4}"));
    let mut speaker = None;
    let in_order = [Speaker::Source, Speaker::Project]
        .into_iter()
        .flat_map(|of| outcomes.iter().filter(move |outcome| outcome.claim.of == of));
    for outcome in in_order {
        let claim = outcome.claim;
        if speaker.replace(claim.of) != Some(claim.of) {
            writeln!(
                page,
                "\n| about | run | {} says | measured | stated | ours | deviation | rule | verdict | kind |{heading}\n\
                 |---|---|---|---|---|---|---|---|---|---|{line}",
                claim.of.word()
            )
            .expect("writing to a string cannot fail");
        }
        let note = if claim.note.is_empty() { String::new() } else { format!(" ({})", claim.note) };
        let run = match &claim.minus {
            None => claim.run.clone(),
            Some(other) => format!("{} minus {other}", claim.run),
        };
        let second = match &outcome.as_stated {
            None if has_second => " - |".to_owned(),
            None => String::new(),
            // Its rule is another one only where it is a spread.
            Some(found) if found.rule == outcome.own.rule => {
                format!(" {}, **{}** |", number(found.ours), found.verdict)
            }
            Some(found) => format!(" {}, {}, **{}** |", number(found.ours), found.rule, found.verdict),
        };
        writeln!(
            page,
            "| {} | {run} | {} | {} | {} | {} | {} | {} | **{}**{note} | {} |{second}",
            claim.about,
            claim.quote.replace('|', "\\|"),
            claim.measure.name(),
            claim.stated.as_deref().unwrap_or("-"),
            number(outcome.own.ours),
            signed(outcome.own.deviation),
            outcome.own.rule,
            outcome.own.verdict,
            claim.kind.word()
        )
        .expect("writing to a string cannot fail");
    }
    page
}

/// How the claims of one speaker came out, by kind.
fn score(page: &mut String, speaker: Speaker, outcomes: &[&Outcome<'_>]) {
    writeln!(page, "What {} says:\n", speaker.word()).expect("writing to a string cannot fail");
    for (kind, meaning) in [
        (Kind::Simulated, "measured in a run, which could have given something else"),
        (Kind::Arithmetic, "worked out from the parameters alone"),
        (Kind::Selection, "looked for in a run because the source shows it"),
        (Kind::Construction, "put in by the program itself"),
    ] {
        let count = |verdict| {
            let of_kind = outcomes.iter().filter(|outcome| outcome.claim.kind == kind);
            of_kind.filter(|outcome| outcome.own.verdict == verdict).count()
        };
        let spread = match count("in the spread") {
            0 => String::new(),
            some => format!(", {some} in a spread"),
        };
        writeln!(
            page,
            "- *{}* ({meaning}): {} agree, {} differ, {} not reached{spread}.",
            kind.word(),
            count("agrees"),
            count("differs"),
            count("not reached")
        )
        .expect("writing to a string cannot fail");
    }
    page.push('\n');
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Claim, Measured, Outcome, half_last_digit, judge, markdown, table};
    use crate::made_up;
    use crate::run_data::RunData;

    fn judged<'a>(claims: &'a [Claim], runs: &mut BTreeMap<String, RunData>) -> Vec<Outcome<'a>> {
        runs.iter_mut().for_each(|(name, run)| run.name.clone_from(name));
        let measured = runs.iter().map(|(name, run)| (name.as_str(), Measured::of(claims, run)));
        let measured: BTreeMap<&str, Measured> = measured.collect();
        judge(claims, &measured.iter().map(|(name, measured)| (*name, measured)).collect())
    }

    fn page_of(outcomes: &[Outcome<'_>], runs: &BTreeMap<String, RunData>) -> String {
        markdown("title", outcomes, &runs.values().map(|run| &run.header).collect::<Vec<_>>())
    }

    #[test]
    fn half_a_digit_is_read_off_the_text() {
        assert_eq!(half_last_digit("17"), 0.5);
        assert!((half_last_digit("3.55") - 0.005).abs() < 1e-15);
        assert!((half_last_digit("0.225") - 0.0005).abs() < 1e-15);
    }

    fn claim(rest: &str) -> Claim {
        let text = format!("about = \"a\"\nquote = \"q\"\nmeasure = \"first-global-slip-time\"\n{rest}");
        toml::from_str(&text).unwrap()
    }

    #[test]
    fn spreads_differences_and_second_runs_are_judged() {
        let global = |step: u64| made_up::run("", &[(step, step + 9, &[1, 2, 3])]);
        let mut runs = BTreeMap::from([
            ("early".to_owned(), global(10_000_000)),
            ("late".to_owned(), global(20_000_000)),
            ("none".to_owned(), made_up::run("", &[(1, 2, &[1])])),
        ]);
        let claims = [
            claim("run = \"early\"\nstated = \"1.5\""),
            claim("run = \"early\"\nspread = [\"late\", \"none\"]\nstated = \"1.5\""),
            claim("run = \"early\"\nspread = [\"late\"]\nstated = \"2.03\""),
            claim("run = \"early\"\nspread = [\"late\"]\nstated = \"2.1\""),
            claim(
                "run = \"late\"\nminus = \"early\"\nat_least = 0\nas_stated = { run = \"early\", minus = \"late\" }",
            ),
            claim("run = \"late\"\nminus = \"none\"\nat_least = 0"),
        ];
        let outcomes = judged(&claims, &mut runs);
        let verdicts: Vec<&str> = outcomes.iter().map(|outcome| outcome.own.verdict).collect();
        assert_eq!(
            verdicts,
            ["differs", "in the spread", "in the spread", "differs", "agrees", "not reached"]
        );
        assert_eq!(
            outcomes[1].own.rule,
            "within 2 % of 1.0000 to 2.0000, the spread of 2 runs; median 1.5000, 1 below"
        );
        assert_eq!(outcomes[4].own.ours, Some(1.0));
        let second = outcomes[4].as_stated.as_ref().unwrap();
        assert_eq!((second.ours, second.verdict), (Some(-1.0), "differs"));

        assert!(table(&outcomes).unwrap().column("as_stated_verdict").is_ok());
        let page = page_of(&outcomes, &runs);
        assert!(page.contains("1 agree, 2 differ, 1 not reached, 2 in a spread."), "{page}");
        assert!(page.contains("| late minus early |"), "{page}");
        assert!(page.contains(" -1.0000, **differs** |"), "{page}");
        // Without second runs neither has a column for them.
        assert!(table(&outcomes[..4]).unwrap().column("as_stated_verdict").is_err());
        assert!(!page_of(&outcomes[..4], &runs).contains("as-stated"));
    }

    #[test]
    fn claims_that_cannot_be_judged_are_refused() {
        let refused = |rest: &str| claim(rest).check().unwrap_err();
        assert_eq!(
            refused("run = \"r\"\nstated = \"two\""),
            "stated: \"two\" is not a number (accepted: a number in quotes)"
        );
        assert_eq!(refused("run = \"r\""), "needs exactly one of stated, at_most and at_least");
        assert_eq!(
            refused("run = \"r\"\nminus = \"s\"\nspread = [\"x\"]\nat_most = 1"),
            "minus_spread: 0 runs are not accepted (accepted: 1, one for each of spread)"
        );
        assert_eq!(
            refused("run = \"r\"\nminus_spread = [\"x\"]\nat_most = 1"),
            "minus_spread: 1 runs are not accepted (accepted: 0, without minus)"
        );
    }

    #[test]
    fn statements_in_words_are_judged_by_the_median_of_a_spread() {
        let global = |step: u64| made_up::run("", &[(step, step + 9, &[1, 2, 3])]);
        let steps = [10_000_000, 20_000_000, 40_000_000, 15_000_000];
        let names = ["one", "two", "four", "half"];
        let mut runs = names.map(str::to_owned).into_iter().zip(steps.map(global)).collect();
        let mut judged = |rest: &str| judged(&[claim(rest)], &mut runs)[0].own.clone();
        let median = judged("run = \"one\"\nspread = [\"four\", \"two\"]\nat_least = 1.5");
        assert_eq!((median.ours, median.verdict), (Some(2.0), "agrees"));
        assert_eq!(median.rule, "at least 1.5, the median of 3 runs");
        // 1.0 - 1.5 and 4.0 - 2.0.
        let differences = judged(
            "run = \"one\"\nminus = \"half\"\nspread = [\"four\"]\nminus_spread = [\"two\"]\nat_most = 0",
        );
        assert_eq!((differences.ours, differences.verdict), (Some(0.75), "differs"));
    }

    #[test]
    fn statements_of_the_project_stand_and_count_apart() {
        let mut runs = BTreeMap::from([("r".to_owned(), made_up::run("", &[(9, 19, &[1, 2, 3])]))]);
        let claims =
            [claim("run = \"r\"\nof = \"this project\"\nat_least = 5"), claim("run = \"r\"\nat_most = 5")];
        let outcomes = judged(&claims, &mut runs);
        let page = page_of(&outcomes, &runs);
        let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text}: {page}"));
        let ours = place("What this project says:");
        assert!(place("What the source says:") < ours);
        assert!(place("1 agree, 0 differ, 0 not reached.") < ours);
        assert!(ours < place("0 agree, 1 differ, 0 not reached."));
        assert!(place("| the source says |") < place("| this project says |"));
        assert_eq!(page.lines().filter(|line| line.starts_with("|---")).count(), 2, "{page}");
        let of = table(&outcomes).unwrap().column("of").unwrap().str().unwrap().get(0).unwrap().to_owned();
        assert_eq!(of, "this project");
        let refused = toml::from_str::<Claim>("about = \"a\"\nquote = \"q\"\nof = \"us\"").unwrap_err();
        assert!(refused.message().contains("`the source`"), "{refused}");
    }
}
