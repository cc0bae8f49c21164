//! The claims and their verdicts, as a page.

use std::fmt::Write;

use asperity_model::scenario::keys::AS_CODED;
use asperity_record::RunHeader;

use super::{ClaimSpec, Kind, Speaker, Verdict};
use crate::claim::{Claim, Judgement};

/// The claims as a page of Markdown, headed by the runs; `specs` are the claims before their verdicts,
/// `claims` those after.
pub fn markdown(title: &str, specs: &[ClaimSpec], claims: &[Claim], runs: &[&RunHeader]) -> String {
    let distinct = |value: &dyn Fn(&RunHeader) -> String| -> String {
        let values: std::collections::BTreeSet<String> = runs.iter().map(|run| value(run)).collect();
        values.into_iter().collect::<Vec<_>>().join(", ")
    };
    let mut page = format!(
        "# {title}: claims\n\n{}dt = {} s; solver {}; code version {}.\n\n",
        Some(distinct(&|run| run.parameter_set.clone()))
            .filter(|sets| sets.contains(AS_CODED))
            .map_or_else(String::new, |sets| format!("Parameter set {sets}; ")),
        distinct(&|run| format!("{:e}", run.time_step_s)),
        distinct(&|run| run.solver.clone()),
        distinct(&|run| run.code_version.clone()),
    );
    for (speaker, _) in Speaker::ALL {
        let of_speaker: Vec<&Claim> = claims.iter().filter(|claim| claim.of == speaker).collect();
        if !of_speaker.is_empty() {
            score(&mut page, speaker, &of_speaker);
        }
    }
    page.push_str(
        "Deviations are ours minus stated. Limits of claims made in words are ours. Behind ± is a standard \
         error; a claim whose limit it reaches over is undecided.\n",
    );
    let has_second = claims.iter().any(|claim| claim.as_stated.is_some());
    let (heading, line) = if has_second {
        page.push_str(
            "The column \"as-stated\" holds the same claim against runs with that parameter set, the values of \
             the thesis' text; the columns before it are of the run named.\n",
        );
        (" as-stated |", "---|")
    } else {
        ("", "")
    };
    let number = |value: f64| match value.abs() {
        small if small != 0.0 && small < 1e-3 => format!("{value:.1e}"),
        _ => format!("{value:.4}"),
    };
    let number = |found: &Judgement| match (found.ours, found.error) {
        (None, _) => "-".to_owned(),
        (Some(value), None) => number(value),
        (Some(value), Some(error)) => format!("{} ± {}", number(value), number(error)),
    };
    // As precise as the number itself.
    let signed = |claim: &Claim| match (claim.deviation, claim.own.ours) {
        (None, _) => "-".to_owned(),
        (Some(value), Some(ours)) if ours != 0.0 && ours.abs() < 1e-3 => format!("{value:+.1e}"),
        (Some(value), _) => format!("{value:+.4}"),
    };
    let mut speaker = None;
    let all = specs.iter().zip(claims);
    let in_order =
        Speaker::ALL.into_iter().flat_map(|(of, _)| all.clone().filter(move |(spec, _)| spec.of == of));
    for (spec, claim) in in_order {
        if speaker.replace(spec.of) != Some(spec.of) {
            writeln!(
                page,
                "\n| about | run | {} says | measured | stated | ours | deviation | rule | verdict | kind |{heading}\n\
                 |---|---|---|---|---|---|---|---|---|---|{line}",
                claim.of.word()
            )
            .expect("writing to a string cannot fail");
        }
        let note = if claim.note.is_empty() { String::new() } else { format!(" ({})", claim.note) };
        let run = match &spec.minus {
            None => claim.run.clone(),
            Some(other) if spec.power_of.is_some() => format!("{other} to {}", claim.run),
            Some(other) => format!("{} minus {other}", claim.run),
        };
        let second = match &claim.as_stated {
            None if has_second => " - |".to_owned(),
            None => String::new(),
            // Its rule is another one only where it is a spread.
            Some(found) if found.rule == claim.own.rule => {
                format!(" {}, **{}** |", number(found), found.verdict.word())
            }
            Some(found) => format!(" {}, {}, **{}** |", number(found), found.rule, found.verdict.word()),
        };
        writeln!(
            page,
            "| {} | {run} | {} | {} | {} | {} | {} | {} | **{}**{note} | {} |{second}",
            claim.about,
            claim.quote.replace('|', "\\|"),
            claim.measure,
            spec.stated.as_deref().unwrap_or("-"),
            number(&claim.own),
            signed(claim),
            claim.own.rule,
            claim.own.verdict.word(),
            claim.kind.word()
        )
        .expect("writing to a string cannot fail");
    }
    page
}

/// How the claims of one speaker came out, by kind.
fn score(page: &mut String, speaker: Speaker, claims: &[&Claim]) {
    writeln!(page, "What {} says:\n", speaker.word()).expect("writing to a string cannot fail");
    for (kind, word, meaning) in Kind::ALL {
        let count = |verdict| {
            let of_kind = claims.iter().filter(|claim| claim.kind == kind);
            of_kind.filter(|claim| claim.own.verdict == verdict).count()
        };
        let some = |verdict, words: &str| match count(verdict) {
            0 => String::new(),
            some => format!(", {some} {words}"),
        };
        writeln!(
            page,
            "- *{word}* ({meaning}): {} agree, {} differ, {} not reached{}{}.",
            count(Verdict::Agrees),
            count(Verdict::Differs),
            count(Verdict::NotReached),
            some(Verdict::Undecided, "undecided"),
            some(Verdict::InTheSpread, "in a spread")
        )
        .expect("writing to a string cannot fail");
    }
    page.push('\n');
}
