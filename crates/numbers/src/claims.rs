//! Compares claims with measurements, and gives each a verdict by a stated rule.
//!
//! The statements of the thesis and those of this project are counted separately: the latter check
//! this manual, and are no score of the thesis.
//!
//! A limit belongs to its claim. If it lies within the standard error of the measurement, the claim
//! is undecided.

mod shown;

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use asperity_record::counted;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::claim::{Claim, Judgement};

pub use shown::markdown;

use crate::estimate::{Estimate, median_of};
use crate::number::Number;
use crate::required_data::RequiredData;
use crate::run_data::RunData;
use crate::summary::Summary;

/// Relative deviation up to which a number stated is taken to agree.
const TOLERANCE: f64 = 0.02;

/// The kind of evidence that an agreement gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Measured in a run, which could have given something else.
    #[default]
    Simulated,
    /// Worked out from the parameters alone.
    Arithmetic,
    /// Looked for in a run because the thesis shows it: it exists, no more.
    Selection,
    /// Put in by the program itself: a check of the program.
    Construction,
}

impl Kind {
    /// All, each with its word and what it means.
    pub const ALL: [(Kind, &str, &str); 4] = [
        (Kind::Simulated, "simulated", "measured in a run, which could have given something else"),
        (Kind::Arithmetic, "arithmetic", "worked out from the parameters alone"),
        (Kind::Selection, "selection", "looked for in a run because the thesis shows it"),
        (Kind::Construction, "construction", "put in by the program itself"),
    ];

    /// The word for it.
    pub fn word(self) -> &'static str {
        Kind::ALL[self as usize].1
    }
}

/// Whose statement a claim is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
pub enum Speaker {
    /// That of the thesis; the quote is verbatim.
    #[default]
    #[serde(rename = "the thesis")]
    Thesis,
    /// This project's own: its theory, its other reading of the thesis, or what it expects.
    #[serde(rename = "this project")]
    Project,
}

impl Speaker {
    /// Both, each with its words.
    pub const ALL: [(Speaker, &str); 2] =
        [(Speaker::Thesis, "the thesis"), (Speaker::Project, "this project")];

    /// The words for it.
    pub fn word(self) -> &'static str {
        Speaker::ALL[self as usize].1
    }
}

/// How a claim came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Verdict {
    /// The measured number bears it out.
    Agrees,
    /// It contradicts it.
    Differs,
    /// The standard error of the number reaches across the limit.
    Undecided,
    /// The number stated lies among those of several runs, from which no more follows.
    InTheSpread,
    /// The run does not have the number.
    #[default]
    NotReached,
}

impl Verdict {
    /// All, each with its word and how a number of claims is said to have come out so.
    pub const ALL: [(Verdict, &str, &str); 5] = [
        (Verdict::Agrees, "agrees", "agree"),
        (Verdict::Differs, "differs", "differ"),
        (Verdict::Undecided, "undecided", "undecided"),
        (Verdict::InTheSpread, "in the spread", "in the spread of runs"),
        (Verdict::NotReached, "not reached", "not reached"),
    ];

    /// The word for it.
    pub fn word(self) -> &'static str {
        Verdict::ALL[self as usize].1
    }
}

/// A claim, before it is judged.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Claim")]
pub struct ClaimSpec {
    /// Its place or its subject: a figure, equation or section.
    pub about: String,
    /// The files of the figures of this pipeline that show it, such as `figure-5.09.png`.
    #[serde(default)]
    pub figures: Vec<String>,
    /// The author of the claim.
    #[serde(default)]
    pub of: Speaker,
    /// The claim in the words of its author.
    pub quote: String,
    /// The run to measure: its name, or the number of a run over axes, of which numbers of the summary can
    /// be measured.
    #[serde(default)]
    pub run: String,
    /// Instead of `run`, values of keys, such as `normal_load.tilt=0.5`: the runs over axes that have
    /// them. The first is measured, and the others are its `spread`.
    #[serde(default)]
    pub at: Vec<String>,
    /// A run whose value is subtracted: the claim is about the difference.
    pub minus: Option<String>,
    /// Runs, or ensembles of runs, whose difference from the run should not matter, such as a first velocity of
    /// 1e-9 m/s. A stated number is then compared with the spread of all of them, widened by the
    /// tolerance of any number, and the rule says how many of them lie below it. A number within the
    /// spread is not contradicted, but this does not count as agreement. Where the thesis gives no
    /// number, the median of the runs is judged.
    #[serde(default)]
    pub spread: Vec<String>,
    /// Runs whose values are subtracted, one from each run of `spread`.
    #[serde(default)]
    pub minus_spread: Vec<String>,
    /// The same runs with the parameter set `as-stated`, if the claim is to be judged in them as well.
    pub as_stated: Option<Runs>,
    /// The number to measure.
    pub measure: Number,
    /// With `minus`, another number: the claim is about the exponent of the number as a power of this one, the
    /// difference of the logarithms of the number over that of these.
    pub power_of: Option<Number>,
    /// The kind of evidence that an agreement gives.
    #[serde(default)]
    pub kind: Kind,
    /// Whether the thesis gives the number as approximate: then half a unit of its
    /// last digit is allowed as well.
    #[serde(default)]
    pub approximate: bool,
    /// The number claimed, with the digits of the thesis; absent where the thesis gives no number.
    pub stated: Option<String>,
    /// For numbers of the nearest precursor: its number of blocks, if that is not the number claimed. For
    /// numbers at a load, or up to a time in s: that load or time.
    pub near: Option<f64>,
    /// Where the thesis gives no number: the largest value that supports the claim. With `at_least` it is
    /// a range.
    pub at_most: Option<f64>,
    /// Where the thesis gives no number: the smallest value that supports the claim.
    pub at_least: Option<f64>,
    /// A remark for readers on the outcome.
    #[serde(default)]
    pub note: String,
}

/// What a claim is measured in.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Runs {
    /// The run to measure.
    pub run: String,
    /// A run whose value is subtracted.
    pub minus: Option<String>,
    /// Runs, or ensembles of runs, whose difference from the run should not matter.
    #[serde(default)]
    pub spread: Vec<String>,
    /// Runs whose values are subtracted, one from each run of `spread`.
    #[serde(default)]
    pub minus_spread: Vec<String>,
}

/// The run to measure, the one whose value is subtracted, and the lists of others, of each.
type Measurement<'a> = (&'a String, Option<&'a String>, [&'a [String]; 2]);

impl ClaimSpec {
    /// What is measured for its judgement, and for that with the parameter set `as-stated`.
    fn measurements(&self) -> impl Iterator<Item = Measurement<'_>> {
        let own = (&self.run, self.minus.as_ref(), [&self.spread[..], &self.minus_spread]);
        let second = self.as_stated.as_ref();
        let second = second.map(|of| (&of.run, of.minus.as_ref(), [&of.spread[..], &of.minus_spread]));
        [Some(own), second].into_iter().flatten()
    }

    /// All runs that it speaks of.
    pub fn runs(&self) -> impl Iterator<Item = &str> {
        self.measurements()
            .flat_map(|(run, minus, lists)| [run].into_iter().chain(minus).chain(lists.into_iter().flatten()))
            .map(String::as_str)
            .filter(|run| !run.is_empty())
    }

    /// What it reads of each of its runs.
    pub fn required_data(&self) -> RequiredData {
        self.measure.required_data() | self.power_of.map_or(RequiredData::NOTHING, Number::required_data)
    }

    /// What it measures.
    fn measured(&self) -> String {
        let power = self.power_of.map_or(String::new(), |of| format!(", exponent against {}", of.name()));
        self.measure.name().to_owned() + &power
    }

    /// The number stated.
    fn stated(&self) -> Option<f64> {
        self.stated.as_ref().and_then(|text| text.parse().ok())
    }

    /// The values that bear it out, and the rule in words.
    fn range(&self) -> (RangeInclusive<f64>, String) {
        let Some(stated) = self.stated() else {
            let rule = match (self.at_least, self.at_most) {
                (Some(low), Some(high)) => format!("{low} to {high}"),
                (Some(low), None) => format!("at least {low}"),
                (_, high) => format!("at most {}", high.unwrap_or(f64::INFINITY)),
            };
            let [low, high] = [(self.at_least, f64::NEG_INFINITY), (self.at_most, f64::INFINITY)]
                .map(|(limit, open)| limit.unwrap_or(open));
            return (low..=high, rule);
        };
        let digit = half_last_digit(self.stated.as_deref().unwrap_or_default());
        let relative = TOLERANCE * stated.abs();
        let (tolerance, rule) = if self.approximate && digit > relative {
            (digit, "half the last digit given")
        } else {
            (relative, "2 %")
        };
        let shown = if tolerance > 0.0 && tolerance < 5e-5 {
            format!("{tolerance:.1e}")
        } else {
            format!("{tolerance:.4}")
        };
        (stated - tolerance..=stated + tolerance, format!("within {shown}, {rule}"))
    }

    /// Puts the runs over axes that it is `at` in their places.
    pub fn choose(&mut self, runs: &[u64]) {
        let mut names = runs.iter().map(u64::to_string);
        self.run = names.next().unwrap_or_default();
        self.spread = names.collect();
    }

    /// Its lists of runs, in which an ensemble may stand for its members.
    pub fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<String>> {
        let second = self.as_stated.iter_mut().flat_map(|runs| [&mut runs.spread, &mut runs.minus_spread]);
        [&mut self.spread, &mut self.minus_spread].into_iter().chain(second)
    }

    /// Checks that the claim can be judged.
    ///
    /// # Errors
    /// In words: key, value and what would be accepted.
    pub fn check(&self) -> Result<(), String> {
        if let Some(text) = self.stated.as_ref().filter(|text| text.parse::<f64>().is_err()) {
            return Err(format!("stated: {text:?} is not a number (accepted: a number in quotes)"));
        }
        let has_limit = self.at_most.is_some() || self.at_least.is_some();
        if self.stated.is_some() == has_limit {
            return Err("needs stated, or at_most, at_least or both".to_owned());
        }
        if let (Some(low), Some(high)) = (self.at_least, self.at_most)
            && low > high
        {
            return Err(format!("at_least: {low} is not accepted (accepted: up to at_most, {high})"));
        }
        let second_lacks_minus = self.as_stated.as_ref().is_some_and(|runs| runs.minus.is_none());
        if self.power_of.is_some() && (self.minus.is_none() || second_lacks_minus) {
            let of = if self.minus.is_none() { "" } else { " of as_stated" };
            return Err(format!("power_of needs minus{of}, the other run"));
        }
        let names_runs = !self.run.is_empty() || !self.spread.is_empty() || self.minus.is_some();
        if names_runs != self.at.is_empty() {
            return Err("needs run, or at without run, spread and minus".to_owned());
        }
        for (_, minus, [spread, minus_spread]) in self.measurements() {
            let needed = if minus.is_some() { spread.len() } else { 0 };
            if minus_spread.len() != needed {
                return Err(format!(
                    "minus_spread: {} (accepted: {needed}, {})",
                    counted(minus_spread.len() as u64, "run"),
                    if minus.is_some() { "one for each of spread" } else { "without minus" }
                ));
            }
        }
        Ok(())
    }
}

/// What the claims of a list measure in one run, in their order; `None` for those that do not speak
/// of it, and where the run does not have it. Behind each stands the number of `power_of`, or 1.
#[derive(Debug, Clone)]
pub struct Measured(Vec<Option<[Estimate; 2]>>);

impl Measured {
    /// Takes the numbers of a run's summary, if it has one.
    pub fn of_summary(claims: &[ClaimSpec], run: &str, summary: Option<&Summary>) -> Measured {
        Measured::by(claims, run, &|measure: Number, _| measure.of_summary(summary?).map(Estimate::exact))
    }

    /// Measures a run.
    pub fn of(claims: &[ClaimSpec], run: &RunData) -> Measured {
        Measured::by(claims, &run.name, &|measure, near| measure.estimate(run, near))
    }

    fn by(
        claims: &[ClaimSpec],
        run: &str,
        measure: &dyn Fn(Number, Option<f64>) -> Option<Estimate>,
    ) -> Measured {
        let of = |claim: &ClaimSpec| {
            claim.runs().find(|name| *name == run)?;
            let near = claim.near.or(claim.stated());
            let power = claim.power_of.map_or(Some(Estimate::exact(1.0)), |of| measure(of, near))?;
            Some([measure(claim.measure, near)?, power])
        };
        Measured(claims.iter().map(of).collect())
    }
}

/// Judges every claim by what was measured in the runs, by their names.
pub fn judge(claims: &[ClaimSpec], runs: &BTreeMap<&str, &Measured>) -> Vec<Claim> {
    let judged = claims.iter().enumerate().map(|(index, claim)| {
        let measured = |run: &str| runs.get(run).and_then(|measured| measured.0[index]);
        let mut judgements = claim.measurements().map(|of| judge_in(claim, of, &measured));
        let own = judgements.next().unwrap_or_default();
        Claim {
            about: claim.about.clone(),
            figures: claim.figures.clone(),
            of: claim.of,
            run: claim.run.clone(),
            quote: claim.quote.clone(),
            measure: claim.measured(),
            stated: claim.stated.clone().unwrap_or_default(),
            deviation: own.ours.zip(claim.stated()).map(|(ours, stated)| ours - stated),
            own,
            kind: claim.kind,
            note: claim.note.clone(),
            as_stated: judgements.next(),
        }
    });
    judged.collect()
}

fn judge_in(
    claim: &ClaimSpec,
    (run, minus, [spread, minus_spread]): Measurement<'_>,
    measure: &dyn Fn(&str) -> Option<[Estimate; 2]>,
) -> Judgement {
    let difference = |name: &String, minus: Option<&String>| match minus {
        None => Some(measure(name)?[0]),
        Some(other) => {
            let ([ours, power], [other, other_power]) = (measure(name)?, measure(other)?);
            if claim.power_of.is_none() {
                return Some(ours.minus(other));
            }
            // Numbers of 0 or less have no logarithm, and equal ones no exponent.
            let exponent = ours.ln().minus(other.ln()).over(power.ln().minus(other_power.ln()).value);
            Some(exponent).filter(|exponent| exponent.value.is_finite())
        }
    };
    let judgement = |ours: Option<Estimate>, rule: String, verdict: Verdict| Judgement {
        ours: ours.map(|ours| ours.value),
        error: ours.map(|ours| ours.error).filter(|error| *error > 0.0),
        rule,
        verdict,
    };
    let own = difference(run, minus);
    let (range, rule) = claim.range();
    if spread.is_empty() {
        return judgement(own, rule, verdict(own, &range));
    }
    let others = spread.iter().enumerate();
    let others = others.filter_map(|(index, name)| difference(name, minus_spread.get(index)));
    let mut draws: Vec<f64> = others.chain(own).map(|draw| draw.value).collect();
    draws.sort_by(f64::total_cmp);
    let middle = median_of(&draws);
    let Some(stated) = claim.stated() else {
        // Of one run's number in words there is no more than itself.
        let rule = format!("{rule}, the median of {} runs", draws.len());
        return judgement(middle, rule, verdict(middle, &range));
    };
    let (Some(low), Some(high), Some(middle)) = (draws.first(), draws.last(), middle) else {
        return judgement(
            own,
            "within the spread of runs, of which none has it".to_owned(),
            Verdict::NotReached,
        );
    };
    let tolerance = TOLERANCE * stated.abs();
    let rule = format!(
        "within 2 % of {low:.4} to {high:.4}, the spread of {} runs; median {:.4}, {} below",
        draws.len(),
        middle.value,
        draws.iter().filter(|&&draw| draw < stated).count()
    );
    let is_in = (low - tolerance..=high + tolerance).contains(&stated);
    judgement(own, rule, if is_in { Verdict::InTheSpread } else { Verdict::Differs })
}

/// How a number stands to the range that bears a claim out.
fn verdict(ours: Option<Estimate>, range: &RangeInclusive<f64>) -> Verdict {
    let Some(ours) = ours else { return Verdict::NotReached };
    let is_open = |limit: &f64| (ours.value - limit).abs() < ours.error;
    match range.contains(&ours.value) {
        _ if is_open(range.start()) || is_open(range.end()) => Verdict::Undecided,
        true => Verdict::Agrees,
        false => Verdict::Differs,
    }
}

/// Half a unit of the last digit of a decimal number as written.
fn half_last_digit(text: &str) -> f64 {
    let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    0.5 * 0.1f64.powi(decimals as i32)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use crate::claim::{Claim, columns};

    use super::{ClaimSpec, Measured, Speaker, Verdict, half_last_digit, judge, markdown, verdict};
    use crate::estimate::Estimate;
    use crate::made_up;
    use crate::number::Number;
    use crate::run_data::RunData;

    fn judged(claims: &[ClaimSpec], runs: &mut BTreeMap<String, RunData>) -> Vec<Claim> {
        runs.iter_mut().for_each(|(name, run)| run.name.clone_from(name));
        let measured = runs.iter().map(|(name, run)| (name.as_str(), Measured::of(claims, run)));
        let measured: BTreeMap<&str, Measured> = measured.collect();
        judge(claims, &measured.iter().map(|(name, measured)| (*name, measured)).collect())
    }

    fn page_of(specs: &[ClaimSpec], outcomes: &[Claim], runs: &BTreeMap<String, RunData>) -> String {
        markdown("title", specs, outcomes, &runs.values().map(|run| &run.header).collect::<Vec<_>>())
    }

    fn has_second(claims: &[Claim]) -> bool {
        columns(claims).iter().any(|(column, _)| column.name == "as_stated_verdict")
    }

    #[test]
    fn half_a_digit_is_read_off_the_text() {
        assert_eq!(half_last_digit("17"), 0.5);
        assert!((half_last_digit("3.55") - 0.005).abs() < 1e-15);
        assert!((half_last_digit("0.225") - 0.0005).abs() < 1e-15);
    }

    fn claim(rest: &str) -> ClaimSpec {
        let text = format!("about = \"a\"\nquote = \"q\"\nmeasure = \"first_global_event_onset_s\"\n{rest}");
        toml::from_str(&text).unwrap()
    }

    /// A run whose one event is a global slip.
    fn global(onset_step: u64) -> RunData {
        made_up::run("", &[(onset_step, onset_step + 9, &[1, 2, 3])])
    }

    /// A number stated allows 2 %, and one that is approximate half a unit of its last digit as well, if that is more.
    #[test]
    fn a_number_stated_allows_two_percent_or_half_a_digit() {
        let range = |stated: &str| claim(&format!("run = \"a\"\nstated = {stated}")).range();
        let (exact, rule) = range("\"100\"");
        assert_eq!((*exact.start(), *exact.end(), rule.as_str()), (98.0, 102.0, "within 2.0000, 2 %"));
        let (about, rule) = range("\"17\"\napproximate = true");
        assert_eq!((*about.start(), *about.end()), (16.5, 17.5), "{rule}");
        let (about, _) = range("\"170\"\napproximate = true");
        assert_eq!((*about.start(), *about.end()), (166.6, 173.4));
    }

    /// The onset doubles, so a rate up to it halves; without `minus` there is no other run.
    #[test]
    fn an_exponent_is_that_of_two_runs() {
        let mut runs = BTreeMap::from([
            ("early".to_owned(), global(10_000_000)),
            ("late".to_owned(), global(20_000_000)),
        ]);
        let power = "power_of = \"slope_to_first_event_per_s\"\nstated = \"-1\"";
        let claims = [claim(&format!("run = \"late\"\nminus = \"early\"\n{power}"))];
        claims[0].check().unwrap();
        let judged = judged(&claims, &mut runs);
        assert!((judged[0].own.ours.unwrap() + 1.0).abs() < 1e-6, "{judged:?}");
        assert_eq!(judged[0].own.verdict, Verdict::Agrees);
        assert!(judged[0].measure.ends_with(", exponent against slope_to_first_event_per_s"), "{judged:?}");
        assert!(page_of(&claims, &judged, &runs).contains("| early to late |"));
        assert!(claim(&format!("run = \"late\"\n{power}")).check().unwrap_err().contains("needs minus"));
        let second = |runs: &str| {
            let own = "run = \"late\"\nminus = \"early\"";
            claim(&format!("{own}\nas_stated = {{ run = \"late\"{runs} }}\n{power}")).check()
        };
        assert!(second("").unwrap_err().contains("needs minus of as_stated"));
        second(", minus = \"early\"").unwrap();
    }

    /// Equal numbers, of which one is to be a power of the other, and a number of 0.
    #[test]
    fn without_logarithms_there_is_no_exponent() {
        let mut runs =
            BTreeMap::from([("early".to_owned(), global(10_000)), ("late".to_owned(), global(20_000))]);
        let equal = "run = \"late\"\nminus = \"early\"\npower_of = \"coefficient_ratio\"\nstated = \"1\"";
        let mut zero = claim(&equal.replace("coefficient_ratio", "slope_to_first_event_per_s"));
        zero.measure = Number::find("precursor_event_count").unwrap();
        for claim in [claim(equal), zero] {
            let judged = &judged(&[claim], &mut runs)[0].own;
            assert_eq!((judged.ours, judged.verdict), (None, Verdict::NotReached));
        }
    }

    #[test]
    fn spreads_differences_and_second_runs_are_judged() {
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
        let verdicts: Vec<Verdict> = outcomes.iter().map(|outcome| outcome.own.verdict).collect();
        assert_eq!(
            verdicts,
            [
                Verdict::Differs,
                Verdict::InTheSpread,
                Verdict::InTheSpread,
                Verdict::Differs,
                Verdict::Agrees,
                Verdict::NotReached
            ]
        );
        assert_eq!(
            outcomes[1].own.rule,
            "within 2 % of 1.0000 to 2.0000, the spread of 2 runs; median 1.5000, 1 below"
        );
        assert_eq!((outcomes[4].own.ours, outcomes[4].own.error), (Some(1.0), None));
        let second = outcomes[4].as_stated.as_ref().unwrap();
        assert_eq!((second.ours, second.verdict), (Some(-1.0), Verdict::Differs));

        assert!(has_second(&outcomes));
        let page = page_of(&claims, &outcomes, &runs);
        assert!(page.contains("1 agree, 2 differ, 1 not reached, 2 in a spread."), "{page}");
        assert!(page.contains("| late minus early |"), "{page}");
        assert!(page.contains(" -1.0000, **differs** |"), "{page}");
        // Without second runs neither has a column for them.
        assert!(!has_second(&outcomes[..4]));
        assert!(!page_of(&claims[..4], &outcomes[..4], &runs).contains("as-stated"));
    }

    /// The limit of (5.48) is 5 %, and the mean shear ahead of fronts has an error of about 2 %.
    #[test]
    fn a_limit_within_the_standard_error_is_undecided() {
        let of = |value, error, range| verdict(Some(Estimate { value, error }), &range);
        let at_most = f64::NEG_INFINITY..=0.05;
        assert_eq!(of(0.044, 0.020, at_most.clone()), Verdict::Undecided);
        assert_eq!(of(0.058, 0.023, at_most.clone()), Verdict::Undecided);
        assert_eq!(of(0.044, 0.005, at_most.clone()), Verdict::Agrees);
        assert_eq!(of(0.195, 0.023, at_most.clone()), Verdict::Differs);
        // Without an error the limit itself still agrees.
        assert_eq!(of(0.05, 0.0, at_most), Verdict::Agrees);
        assert_eq!([of(0.9, 0.2, 0.0..=1.0), of(0.1, 0.2, 0.0..=1.0)], [Verdict::Undecided; 2]);
        assert_eq!(of(0.5, 0.2, 0.0..=1.0), Verdict::Agrees);
        assert_eq!(verdict(None, &(0.0..=1.0)), Verdict::NotReached);
    }

    /// Precursors that reach each of three blocks, and the slip of all of them, whose load fits no line.
    #[test]
    fn lines_through_precursors_leave_the_first_global_slip_out_and_may_be_undecided() {
        let mut run = made_up::run("", &made_up::EVENTS);
        for (slip, load) in [(0, 0.15), (1, 0.301), (4, 0.45), (5, 0.9)] {
            run.slips[slip].ft_fn_onset = load;
        }
        let judged = |limit: &str, run: &RunData| {
            let text = format!(
                "about = \"a\"\nquote = \"q\"\nrun = \"r\"\nmeasure = \"event_intercept_error_linear_ratio\"\nat_most = {limit}"
            );
            let claims = [toml::from_str(&text).unwrap()];
            let mut runs = BTreeMap::from([("r".to_owned(), run.clone())]);
            let outcomes = self::judged(&claims, &mut runs);
            (page_of(&claims, &outcomes, &runs), outcomes[0].own.clone())
        };
        // By hand: slope 1, intercept 0.001 / 3 over 0.45, and an error of 0.0021.
        let (page, own) = judged("0.01", &run);
        assert!((own.ours.unwrap() - 0.001 / 3.0 / 0.45).abs() < 1e-9, "{own:?}");
        assert_eq!(own.verdict, Verdict::Agrees);
        assert!(page.contains("| 7.4e-4 ± "), "{page}");
        let (page, own) = judged("0.0007", &run);
        assert_eq!(own.verdict, Verdict::Undecided, "{own:?}");
        assert!(page.contains("0 agree, 0 differ, 0 not reached, 1 undecided."), "{page}");
    }

    #[test]
    fn claims_that_cannot_be_judged_are_refused() {
        let refused = |rest: &str| claim(rest).check().unwrap_err();
        assert_eq!(
            refused("run = \"r\"\nstated = \"two\""),
            "stated: \"two\" is not a number (accepted: a number in quotes)"
        );
        let needs = "needs stated, or at_most, at_least or both";
        assert_eq!(refused("run = \"r\""), needs);
        assert_eq!(refused("run = \"r\"\nstated = \"2\"\nat_most = 3"), needs);
        assert_eq!(
            refused("run = \"r\"\nat_least = 2\nat_most = 1"),
            "at_least: 2 is not accepted (accepted: up to at_most, 1)"
        );
        assert_eq!(
            refused("run = \"r\"\nminus = \"s\"\nspread = [\"x\"]\nat_most = 1"),
            "minus_spread: 0 runs (accepted: 1, one for each of spread)"
        );
        assert_eq!(
            refused("run = \"r\"\nminus_spread = [\"x\"]\nat_most = 1"),
            "minus_spread: 1 run (accepted: 0, without minus)"
        );
    }

    #[test]
    fn statements_in_words_are_judged_by_the_median_of_a_spread() {
        let steps = [10_000_000, 20_000_000, 40_000_000, 15_000_000];
        let names = ["one", "two", "four", "half"];
        let mut runs = names.map(str::to_owned).into_iter().zip(steps.map(global)).collect();
        let mut judged = |rest: &str| judged(&[claim(rest)], &mut runs)[0].own.clone();
        let median = judged("run = \"one\"\nspread = [\"four\", \"two\"]\nat_least = 1.2");
        assert_eq!((median.ours, median.verdict), (Some(2.0), Verdict::Agrees));
        assert_eq!(median.rule, "at least 1.2, the median of 3 runs");
        // 1.0 - 1.5 and 4.0 - 2.0.
        let differences = judged(
            "run = \"one\"\nminus = \"half\"\nspread = [\"four\"]\nminus_spread = [\"two\"]\nat_most = 0",
        );
        assert_eq!((differences.ours, differences.verdict), (Some(0.75), Verdict::Differs));
    }

    #[test]
    fn statements_of_the_project_stand_and_count_apart() {
        let mut runs = BTreeMap::from([("r".to_owned(), made_up::run("", &[(9, 19, &[1, 2, 3])]))]);
        let claims =
            [claim("run = \"r\"\nof = \"this project\"\nat_least = 5"), claim("run = \"r\"\nat_most = 5")];
        let outcomes = judged(&claims, &mut runs);
        let page = page_of(&claims, &outcomes, &runs);
        let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text}: {page}"));
        let ours = place("What this project says:");
        assert!(place("What the thesis says:") < ours);
        assert!(place("1 agree, 0 differ, 0 not reached.") < ours);
        assert!(ours < place("0 agree, 1 differ, 0 not reached."));
        assert!(place("| the thesis says |") < place("| this project says |"));
        assert_eq!(page.lines().filter(|line| line.starts_with("|---")).count(), 2, "{page}");
        assert_eq!(outcomes[0].of, Speaker::Project);
        let refused = toml::from_str::<ClaimSpec>("about = \"a\"\nquote = \"q\"\nof = \"us\"").unwrap_err();
        assert!(refused.message().contains("`the thesis`"), "{refused}");
    }
}
