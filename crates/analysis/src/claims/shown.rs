//! The claims and what became of them, as a table and as pages.

use std::fmt::Write;

use asperity_record::RunHeader;
use polars::prelude::{Column, DataFrame, NamedFrom, Series};

use super::{Judgement, Kind, Outcome, Speaker};
use crate::error::AnalysisError;

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
        numbers("ours", &|outcome| outcome.own.value()),
        numbers("standard_error", &|outcome| outcome.own.error()),
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
            numbers("as_stated_ours", &|outcome| outcome.as_stated.as_ref()?.value()),
            numbers("as_stated_standard_error", &|outcome| outcome.as_stated.as_ref()?.error()),
            texts("as_stated_rule", &|outcome| second(outcome, &|found| found.rule.clone())),
            texts("as_stated_verdict", &|outcome| second(outcome, &|found| found.verdict.to_owned())),
        ]);
    }
    Ok(DataFrame::new_infer_height(columns)?)
}

/// The claims as a page has them: as they are in the table.
pub(crate) fn told(outcomes: &[Outcome<'_>]) -> Vec<asperity_report::Claim> {
    let judgement = |found: &Judgement| asperity_report::Judgement {
        ours: found.value(),
        error: found.error(),
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
    page.push_str(
        "Deviations are ours minus stated. Limits of claims made in words are ours. Behind ± is a standard \
         error; a claim whose limit it reaches over is undecided.\n",
    );
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
    let number = |value: f64| match value.abs() {
        small if small != 0.0 && small < 1e-3 => format!("{value:.1e}"),
        _ => format!("{value:.4}"),
    };
    let number = |found: &Judgement| match (found.value(), found.error()) {
        (None, _) => "-".to_owned(),
        (Some(value), None) => number(value),
        (Some(value), Some(error)) => format!("{} ± {}", number(value), number(error)),
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
                format!(" {}, **{}** |", number(found), found.verdict)
            }
            Some(found) => format!(" {}, {}, **{}** |", number(found), found.rule, found.verdict),
        };
        writeln!(
            page,
            "| {} | {run} | {} | {} | {} | {} | {} | {} | **{}**{note} | {} |{second}",
            claim.about,
            claim.quote.replace('|', "\\|"),
            claim.measure.name(),
            claim.stated.as_deref().unwrap_or("-"),
            number(&outcome.own),
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
        let some = |verdict, words: &str| match count(verdict) {
            0 => String::new(),
            some => format!(", {some} {words}"),
        };
        writeln!(
            page,
            "- *{}* ({meaning}): {} agree, {} differ, {} not reached{}{}.",
            kind.word(),
            count("agrees"),
            count("differs"),
            count("not reached"),
            some("undecided", "undecided"),
            some("in the spread", "in a spread")
        )
        .expect("writing to a string cannot fail");
    }
    page.push('\n');
}
