//! Claims on a page: the score, the lines beside a figure or a run, and the table of all.

use std::collections::BTreeSet;

use asperity_model::scenario::keys::KEYS;
use asperity_numbers::Number;
use asperity_numbers::claim::{Claim, Judgement};
use asperity_numbers::claims::{Kind, Speaker, Verdict};

use crate::html::markup::{self, Cell, Row, section_id, table, text};
use crate::symbols::{formulas, lettered, number, rounded, symbol};

/// The mark that a verdict has beside its word, and the class of its colour.
fn mark(verdict: Verdict) -> (&'static str, &'static str) {
    match verdict {
        Verdict::Agrees => ("✓", "agrees"),
        Verdict::Differs => ("✗", "differs"),
        Verdict::Undecided => ("±", "undecided"),
        Verdict::InTheSpread => ("≈", "spread"),
        Verdict::NotReached => ("○", "none"),
    }
}

/// Whether the measurement contradicts a claim.
pub(crate) fn differs(claim: &Claim) -> bool {
    claim.own.verdict == Verdict::Differs
}

/// Headings of the sections of claims: those that differ, and all.
pub(crate) const DIFFERING: &str = "Claims that differ";
pub(crate) const ALL: &str = "Claims";

/// How the claims of a speaker came out, as in `83 of 101 agree, 12 differ`; none without claims.
fn score(claims: &[Claim], speaker: Speaker) -> Option<String> {
    let of: Vec<Verdict> =
        claims.iter().filter(|claim| claim.of == speaker).map(|claim| claim.own.verdict).collect();
    let count = |verdict| of.iter().filter(|other| **other == verdict).count();
    let mut words = format!("{} of {} agree", count(Verdict::Agrees), of.len());
    for (verdict, _, said) in Verdict::ALL.into_iter().skip(1).filter(|(verdict, ..)| count(*verdict) > 0) {
        words += &format!(", {} {said}", count(verdict));
    }
    (!of.is_empty()).then_some(words)
}

/// Both speakers, and their headings.
const SPEAKERS: [(Speaker, &str); 2] = [(Speaker::Thesis, "The thesis"), (Speaker::Project, "This project")];

/// The attribute of lines of scores at the head of a page.
pub(crate) const SCORE: &str = " class=\"score\"";

/// The scores as lines, with these attributes of their tags.
pub(crate) fn heading(claims: &[Claim], attributes: &str) -> String {
    let line = |(speaker, title)| {
        let score = score(claims, speaker)?;
        Some(format!("<p{attributes}><b>{title}:</b> {}.</p>\n", text(score)))
    };
    SPEAKERS.into_iter().filter_map(line).collect()
}

/// The scores as a table, speaker by speaker and kind by kind.
pub(crate) fn scores(claims: &[Claim]) -> String {
    let (mut rows, mut known) = (Vec::new(), BTreeSet::new());
    for (speaker, title) in SPEAKERS {
        for (kind, word, meaning) in Kind::ALL {
            let of: Vec<&Claim> =
                claims.iter().filter(|claim| claim.of == speaker && claim.kind == kind).collect();
            if of.is_empty() {
                continue;
            }
            // Explained once.
            let meaning = match known.insert(word) {
                true => format!(" <span class=\"soft\">({meaning})</span>"),
                false => String::new(),
            };
            let mut cells = vec![Cell::text(title), Cell::Html(format!("{word}{meaning}"))];
            cells.extend(Verdict::ALL.map(|(verdict, ..)| {
                match of.iter().filter(|claim| claim.own.verdict == verdict).count() {
                    0 => Cell::None,
                    count => {
                        let section = section_id(if verdict == Verdict::Differs { DIFFERING } else { ALL });
                        Cell::Value(count as f64, format!("<a href=\"#{section}\">{count}</a>"))
                    }
                }
            }));
            rows.push(Row::from(cells));
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let verdicts = Verdict::ALL.map(|(verdict, word, _)| format!("#{} {word}", mark(verdict).0));
    table("", "", &[["says", "kind"].map(str::to_owned).as_slice(), &verdicts].concat(), rows)
}

/// A verdict, distinguished by word, mark and colour.
fn verdict(verdict: Verdict) -> String {
    let (mark, class) = mark(verdict);
    format!("<span class=\"outcome {class}\">{mark} {}</span>", verdict.word())
}

/// The measured value, with its standard error.
fn with_error(judgement: &Judgement) -> String {
    let ours = judgement.ours.map_or("–".to_owned(), |ours| rounded(ours, 4));
    judgement.error.map_or(ours.clone(), |error| format!("{ours} ± {}", rounded(error, 2)))
}

fn measured(judgement: &Judgement) -> String {
    format!("<span title=\"{}\">{}</span>", text(&judgement.rule), with_error(judgement))
}

/// The claims beside their subject: first those of the thesis, then separately those of this project.
/// Claims with the same words are grouped below them.
pub(crate) fn beside(claims: &[&Claim]) -> String {
    let mut out = String::new();
    for (speaker, title) in SPEAKERS {
        let mut quotes: Vec<(&str, Vec<&Claim>)> = Vec::new();
        for claim in claims.iter().filter(|claim| claim.of == speaker) {
            match quotes.iter_mut().find(|(quote, _)| *quote == claim.quote) {
                Some((_, same)) => same.push(claim),
                None => quotes.push((&claim.quote, vec![claim])),
            }
        }
        if quotes.is_empty() {
            continue;
        }
        out += &format!("<h4>{title} says</h4>\n");
        for (_, same) in quotes {
            out += &format!("<p class=\"quote\">{}</p>\n<ul class=\"claims\">\n", quoted(same[0]));
            for (n, claim) in same.iter().enumerate() {
                let stated = match claim.stated.as_str() {
                    "" => worded(&claim.own.rule),
                    stated => format!("stated {}", lettered(stated)),
                };
                let note = match claim.note.as_str() {
                    note if same[..n].iter().any(|before| before.note == note) => String::new(),
                    "" => String::new(),
                    note => format!("; {}", worded(note)),
                };
                out += &format!(
                    "<li>{} {} <span class=\"soft\">{}, run {}; {stated}{note}</span></li>\n",
                    verdict(claim.own.verdict),
                    measured(&claim.own),
                    measure(&claim.measure),
                    link(&claim.run),
                );
            }
            out += "</ul>\n";
        }
    }
    out
}

/// The name of a run as a link to its section of the page.
pub(crate) fn link(run: &str) -> String {
    format!("<a href=\"#run-{0}\" data-run=\"{0}\">{0}</a>", text(run))
}

/// The names of runs as [`link`]s, of more than eight the first.
pub(crate) fn links<'a>(runs: impl IntoIterator<Item = &'a String>) -> String {
    let mut links: Vec<String> = runs.into_iter().map(|run| link(run)).collect();
    let more = links.len().saturating_sub(8);
    links.truncate(8);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    links.join(", ") + &more
}

/// The words of the thesis in quotation marks.
fn quoted(claim: &Claim) -> String {
    if claim.of == Speaker::Thesis {
        format!("“{}”", formulas(&claim.quote))
    } else {
        worded(&claim.quote)
    }
}

/// The number that a claim measures, in words; its name appears on hovering.
fn measure(name: &str) -> String {
    match Number::find(name) {
        Ok(found) => named(found.name(), &lettered(&found.key.label())),
        Err(_) => markup::name(name),
    }
}

/// Text shown instead of a name, which appears on hovering.
fn named(name: &str, shown: &str) -> String {
    format!("<span title=\"{}\">{shown}</span>", text(name))
}

/// Words of our own as HTML: with symbols instead of the names of keys, words instead of those of numbers, and powers
/// of ten instead of zeros that would have to be counted. Code in backquotes stays as it is.
fn worded(words: &str) -> String {
    if words.contains(['$', '\\']) {
        return formulas(words);
    }
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.';
    let (mut out, mut told, mut at) = (String::new(), 0, 0);
    while let Some(start) = words[at..].find(is_of_name).map(|start| at + start) {
        let end = words[start..].find(|c| !is_of_name(c)).map_or(words.len(), |end| start + end);
        let name = words[start..end].trim_end_matches('.');
        let is_code = words[..start].ends_with('`');
        if let Some(shown) = shown_instead(name).filter(|_| !is_code) {
            out += &lettered(&words[told..start]);
            out += &shown;
            told = start + name.len();
        }
        at = end;
    }
    out + &lettered(&words[told..])
}

/// Replaces a key, a number's name or a small number for readers; `None` if it stays as it is.
fn shown_instead(name: &str) -> Option<String> {
    if name.starts_with("0.000") {
        return name.parse().ok().map(number);
    }
    if let Some(key) = KEYS.iter().find(|key| key.path == name && !key.symbol.is_empty()) {
        return Some(named(name, &symbol(key.symbol)));
    }
    let found = Number::all().find(|number| number.name() == name && name.contains('_'))?;
    Some(named(name, &lettered(&found.key.label())))
}

/// The subject of a claim as HTML; it may link to figures.
pub(crate) type About<'a> = &'a dyn Fn(&Claim) -> String;

/// The claims that differ, each with its subject, for readers who trust the rest.
pub(crate) fn differing(claims: &[Claim], what: About<'_>) -> String {
    let mut out = String::new();
    let differing: Vec<&Claim> = claims.iter().filter(|claim| differs(claim)).collect();
    let mut about: Vec<&str> = Vec::new();
    for claim in &differing {
        if !about.contains(&claim.about.as_str()) {
            about.push(&claim.about);
        }
    }
    for about in about {
        let of: Vec<&Claim> = differing.iter().filter(|claim| claim.about == about).copied().collect();
        out += &format!("<h3>{}</h3>\n{}", what(of[0]), beside(&of));
    }
    out
}

/// All claims, a table for each speaker.
pub(crate) fn all(claims: &[Claim], about: About<'_>) -> String {
    let mut out = String::new();
    for (number, (speaker, title)) in SPEAKERS.into_iter().enumerate() {
        let of: Vec<&Claim> = claims.iter().filter(|claim| claim.of == speaker).collect();
        if of.is_empty() {
            continue;
        }
        let has_second = of.iter().any(|claim| claim.as_stated.is_some());
        let says = format!("{} says", speaker.word());
        let mut headings = vec![
            "verdict",
            "about",
            "run",
            &says,
            "measured",
            "#stated",
            "#ours",
            "#deviation",
            "rule",
            "kind",
        ];
        if has_second {
            headings.push("as-stated");
        }
        let rows = of.iter().map(|claim| {
            let optional = |value: Option<f64>, words: String| {
                value.map_or(Cell::None, |value| Cell::Value(value, words))
            };
            let deviation = claim.deviation.map_or_else(String::new, |deviation| rounded(deviation, 2));
            let note = if claim.note.is_empty() {
                String::new()
            } else {
                format!("<br><span class=\"soft\">{}</span>", worded(&claim.note))
            };
            let mut cells = vec![
                Cell::Html(verdict(claim.own.verdict)),
                Cell::Html(about(claim)),
                Cell::Html(link(&claim.run)),
                Cell::Html(format!("{}{note}", quoted(claim))),
                Cell::Html(measure(&claim.measure)),
                if claim.stated.is_empty() { Cell::None } else { Cell::number(&claim.stated) },
                optional(claim.own.ours, with_error(&claim.own)),
                optional(claim.deviation, deviation),
                Cell::Html(worded(&claim.own.rule)),
                Cell::text(claim.kind.word()),
            ];
            if has_second {
                cells.push(claim.as_stated.as_ref().map_or(Cell::None, |found| {
                    Cell::Html(format!("{} {}", measured(found), verdict(found.verdict)))
                }));
            }
            Row::from(cells)
        });
        out += &format!("<h3>{title}</h3>\n");
        out += &table(&format!("claims-{number}"), "", &headings, rows);
    }
    out
}

#[cfg(test)]
mod tests {
    use asperity_numbers::claim::{Claim, Judgement};
    use asperity_numbers::claims::{Kind, Speaker, Verdict};

    use super::{all, beside, differing, score, scores, worded};
    use crate::symbols::lettered;

    /// As where there are no figures.
    fn about(claim: &Claim) -> String {
        lettered(&claim.about)
    }

    fn claim(of: Speaker, verdict: Verdict) -> Claim {
        Claim {
            about: "Figure 5.9".to_owned(),
            figures: Vec::new(),
            of,
            run: "default".to_owned(),
            quote: "it <slips>".to_owned(),
            measure: "precursor_event_count".to_owned(),
            stated: "3".to_owned(),
            own: Judgement { ours: Some(2.0), error: None, rule: "within 2 %".to_owned(), verdict },
            deviation: Some(-1.0),
            kind: Kind::Simulated,
            note: String::new(),
            as_stated: None,
        }
    }

    #[test]
    fn what_the_source_says_is_counted_apart() {
        let claims = [
            claim(Speaker::Thesis, Verdict::Agrees),
            claim(Speaker::Thesis, Verdict::Differs),
            claim(Speaker::Project, Verdict::Agrees),
        ];
        assert_eq!(score(&claims, Speaker::Thesis).unwrap(), "1 of 2 agree, 1 differ");
        assert_eq!(score(&claims, Speaker::Project).unwrap(), "1 of 1 agree");
        assert_eq!(scores(&claims).matches("<tr>").count(), 3, "headings and two speakers");
        let first = differing(&claims, &about);
        assert_eq!((first.matches("<li>").count(), first.matches("<h3>Figure 5.9</h3>").count()), (1, 1));
        assert!(differing(&claims[..1], &about).is_empty());
        let listed = beside(&claims.iter().collect::<Vec<_>>());
        let (source, project) = listed.split_once("This project says").unwrap();
        assert!(source.matches("<li>").count() == 2 && project.matches("<li>").count() == 1);
        // The words once, and without quotation marks where they are ours.
        assert_eq!(source.matches("“it &lt;slips&gt;”").count(), 1);
        assert!(project.contains(">it &lt;slips&gt;</p>"), "{project}");
        let table = all(&claims, &about);
        assert_eq!(table.matches("<table").count(), 2);
        assert!(table.contains("−1"), "{table}");
    }

    #[test]
    fn undecided_claims_show_their_error_and_count_by_themselves() {
        let mut open = claim(Speaker::Thesis, Verdict::Undecided);
        open.own.error = Some(0.25);
        let claims = [open, claim(Speaker::Thesis, Verdict::Agrees)];
        assert_eq!(score(&claims, Speaker::Thesis).unwrap(), "1 of 2 agree, 1 undecided");
        let shown = beside(&claims.iter().collect::<Vec<_>>());
        assert!(shown.contains("<span class=\"outcome undecided\">± undecided</span>"), "{shown}");
        assert!(shown.contains(">2 ± 0.25</span>"), "{shown}");
        assert!(all(&claims, &about).contains("data-value=\"2\">2 ± 0.25</td>"));
        assert!(scores(&claims).contains("± undecided"));
    }

    #[test]
    fn what_is_measured_is_said_in_words_and_keys_are_letters() {
        let measured =
            Claim { measure: "largest_ft_fn".to_owned(), ..claim(Speaker::Project, Verdict::Agrees) };
        let shown = beside(&[&measured]);
        let words = "<span title=\"largest_ft_fn\">largest F<sub>T</sub>/F<sub>N</sub></span>";
        assert!(shown.contains(words) && !shown.contains(">largest_ft_fn"), "{shown}");
        assert!(all(&[measured], &about).contains(words));
        assert_eq!(
            worded("precursor_count grows with friction.static_coefficient."),
            "<span title=\"precursor_count\">precursor count</span> grows with <span \
             title=\"friction.static_coefficient\"><i>μ</i><sub>s</sub></span>."
        );
        assert_eq!(
            worded("at most 0.00000001, sin(pi/10) of mu_d"),
            "at most 10<sup>−8</sup>, sin(π/10) of μ<sub>d</sub>"
        );
        // Code, and names of nothing.
        assert_eq!(worded("`precursor_count` of a_b_c"), "<code>precursor_count</code> of a_b_c");
        assert_eq!(worded("at $\\mu_{s}$"), "at μ<sub>s</sub>");
    }
}
