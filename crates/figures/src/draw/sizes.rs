//! How the ruptures of runs are distributed by their number of blocks, and what is fitted to it.

use std::ops::Range;

use asperity_numbers::distributions::{SizeFit, SizeLaw, half_band, survival};
use asperity_numbers::estimate::Estimate;
use asperity_numbers::goodness::Test;
use asperity_numbers::run_data::RunData;
use asperity_record::Rupture;
use plotters::prelude::RGBColor;

use super::kind::{Figure, keys, of_runs_in};
use super::rupture_selector::{Sort, before_first_global_slip, sorted};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Pen, Point, Sheet};

keys! {
    Sizes: series;

    /// The smallest rupture that counts, in blocks.
    #[serde(default = "super::kind::number::<1>")]
    from_blocks: u32,
    /// The law that is fitted, by maximum likelihood, to the sizes of ruptures after the first global
    /// slip: whole numbers from `from_blocks` to one block less than the slider has.
    #[serde(default)]
    fit: SizeLaw,
}

impl Figure for Sizes {
    of_runs_in!(series);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let mut sheet = distribution(run, pen, self.from_blocks, self.fit)?;
        // Of several runs without a fit, shares alone: whose law it were, nothing would say.
        if self.fit == SizeLaw::None && self.series.len() > 1 {
            let law = of_magnitudes(run);
            sheet.panels[0].layers.retain(|layer| !law.contains(layer));
        }
        Ok(sheet)
    }
}

/// The ruptures of a run that are no global slips, after the first of these; all, where there is none.
pub(super) fn distribution(
    run: &RunData,
    pen: Pen<'_>,
    from_blocks: u32,
    law: SizeLaw,
) -> Result<Sheet, String> {
    let ruptures = sorted(run)?;
    let first_global = before_first_global_slip(&ruptures);
    let (before, after) = ruptures.split_at(first_global.unwrap_or(0));
    let of = |ruptures: &[(&Rupture, Sort)]| -> Vec<u32> {
        let others = ruptures.iter().filter(|(_, sort)| *sort != Sort::GlobalSlip);
        others.map(|(rupture, _)| rupture.slipped()).filter(|size| *size >= from_blocks).collect()
    };
    let sizes = of(after);
    let (count, lowest) = (sizes.len(), lowest(&sizes));
    let shares = survival(&sizes.iter().copied().map(f64::from).collect::<Vec<f64>>());
    let mut layers = Vec::from_iter((count > 0).then(|| band(&shares, half_band(count), lowest, pen)));
    layers.push(pen.called(&format!("{}: {count}", pen.label)).marks(shares));
    if first_global.is_some() {
        let global_slips = after.iter().filter(|(_, sort)| *sort == Sort::GlobalSlip).count();
        layers.push(Layer::remark(format!("global slips: {global_slips}, before: {}", of(before).len())));
    }
    layers.extend(of_magnitudes(run));
    if law != SizeLaw::None {
        let fitted = fitted(&sizes, law, from_blocks..run.header.blocks);
        layers.extend(fit_layers(fitted, first_global.is_some(), pen.look.1, pen.look.2));
    }
    let unit = if run.of_one_row().is_some() { "blocks" } else { "contacts" };
    let x = Scale::free_powers(&format!("size s ({unit})"));
    Ok(Sheet::single(x, Scale::free_powers("share of at least s"), layers))
}

/// `b` of the magnitudes of all ruptures, or why there is none, in the words of the summary.
pub(super) fn of_magnitudes(run: &RunData) -> Vec<Layer> {
    let words = run.summary.gutenberg_richter_test.as_deref().unwrap_or_default();
    let lines = words.replace(" above ", "\nabove ").replace(": ", ":\n").replace('-', "−");
    lines.lines().map(Layer::remark).collect()
}

/// Half of the smallest share, so that all are in the frame.
fn lowest(sizes: &[u32]) -> f64 {
    0.5 / sizes.len().max(5) as f64
}

/// A law that is fitted to sizes in a range.
fn fitted(sizes: &[u32], law: SizeLaw, range: Range<u32>) -> Option<Fitted> {
    let fit = SizeFit::of(sizes, law, range.start, range.end - 1)?;
    let course = fit.survival().into_iter().filter(|(_, p)| *p >= lowest(sizes)).collect();
    let test = Test::of_sizes(&fit, sizes, law);
    let (law, parameter) = words(law, fit.theta);
    Some(Fitted { law, parameters: vec![parameter], test, course })
}

/// Steps downwards at each value.
pub(super) fn steps(shares: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut course = Vec::new();
    for (n, (value, share)) in shares.iter().enumerate() {
        if n > 0 {
            course.push((shares[n - 1].0, *share));
        }
        course.push((*value, *share));
    }
    course
}

/// The band about a course of shares, no lower than `lowest`.
pub(super) fn band(course: &[(f64, f64)], half: f64, lowest: f64, pen: Pen<'_>) -> Layer {
    let moved = |by: f64| course.iter().map(move |(x, share)| (*x, (share + by).clamp(lowest, 1.0)));
    let below: Vec<(f64, f64)> = moved(-half).collect();
    let outline = moved(half).chain(below.into_iter().rev());
    Layer::surface("95 %", outline.collect(), 0.13, pen.look.2)
}

/// The law that was fitted, and its parameter.
fn words(law: SizeLaw, theta: Estimate) -> (&'static str, String) {
    match law {
        SizeLaw::PowerLaw => ("s^{−α}", format!("α = {theta}")),
        SizeLaw::Exponential => {
            let length = 1.0 / theta.value;
            let length = Estimate { value: length, error: theta.error * length * length };
            ("exp(−s/ξ)", format!("ξ = {length}"))
        }
        SizeLaw::None => ("", String::new()),
    }
}

/// A law that was fitted: its parameters in words, the test, and its line.
pub(super) struct Fitted {
    pub(super) law: &'static str,
    pub(super) parameters: Vec<String>,
    pub(super) test: Test,
    pub(super) course: Vec<Point>,
}

/// A fit, of which there is none from few numbers, nor before a global slip.
pub(super) fn fit_layers(
    fit: Option<Fitted>,
    has_global_slip: bool,
    dash: Dash,
    color: RGBColor,
) -> Vec<Layer> {
    let Fitted { law, parameters, test, course } = match fit {
        _ if !has_global_slip => return vec![Layer::remark("no fit before a global slip")],
        None => return vec![Layer::remark("too few for a fit")],
        Some(fitted) => fitted,
    };
    // Of a law that is rejected there are no parameters and no line.
    if test.rejects() {
        return vec![Layer::remark(format!("{law} rejected: {}", test.words()))];
    }
    let mut remarks = parameters.into_iter().chain([test.words()]);
    let first = remarks.next().unwrap_or_default();
    let line = Layer::line(format!("{law}, {first}"), course, dash, color);
    [line].into_iter().chain(remarks.map(Layer::remark)).collect()
}

#[cfg(test)]
mod tests {
    use super::{
        Dash, Estimate, Layer, Pen, RunData, Sheet, SizeLaw, band, distribution, fit_layers, fitted, steps,
    };
    use crate::draw::sheet::INK;
    use asperity_testkit::made_up;

    #[test]
    fn numbers_have_two_digits_of_their_error() {
        let text = |value, error| Estimate { value, error }.to_string();
        assert_eq!(text(1.2345, 0.0678), "1.234 ± 0.068");
        assert_eq!(text(-12.3, 3.4), "−12.3 ± 3.4");
        assert_eq!(text(1234.5, 67.8), "1234 ± 68");
    }

    #[test]
    fn a_band_lies_about_its_course() {
        assert_eq!(
            band(&[(1.0, 1.0), (2.0, 0.5)], 0.25, 0.3, Pen::nth(0, "")).points(),
            [(1.0, 1.0), (2.0, 0.75), (2.0, 0.3), (1.0, 0.75)]
        );
        assert_eq!(steps(&[(1.0, 1.0), (2.0, 0.5)]), [(1.0, 1.0), (1.0, 0.5), (2.0, 0.5)]);
    }

    /// Ruptures of one block and of two, before the slip of all three and after it.
    fn slipped(after: &[u32]) -> RunData {
        let mut run = made_up::run("", &[(100, 101, &[1])]);
        let passed = |blocks: u32, onset: u64| -> Vec<made_up::Passed> {
            (1..=blocks).map(|block| (block, onset + u64::from(block), Some(onset + 10))).collect()
        };
        let mut ruptures = vec![passed(1, 100), passed(2, 200), passed(2, 250)];
        if !after.is_empty() {
            ruptures.push(passed(3, 300));
        }
        ruptures.extend(after.iter().zip(0..).map(|(blocks, n)| passed(*blocks, 400 + 20 * n)));
        made_up::with_ruptures(&mut run, &ruptures.iter().map(Vec::as_slice).collect::<Vec<_>>());
        run
    }

    fn sheet(run: &RunData, law: SizeLaw) -> Sheet {
        distribution(run, Pen::nth(0, "A"), 1, law).unwrap()
    }

    fn words<'a>(layers: impl Iterator<Item = &'a Layer>) -> Vec<String> {
        layers.map(|layer| layer.label.clone()).filter(|label| !label.is_empty()).collect()
    }

    fn words_of(run: &RunData, law: SizeLaw) -> Vec<String> {
        words(sheet(run, law).layers())
    }

    #[test]
    fn sizes_are_those_after_the_first_global_slip() {
        let of_run = slipped(&[1, 2, 1, 3, 1, 2, 1]);
        let sheet = sheet(&of_run, SizeLaw::PowerLaw);
        let marks = sheet.panels[0].layers[1].points();
        assert!(marks[0] == (1.0, 1.0) && (marks[1].1 - 1.0 / 3.0).abs() < 1e-12, "{marks:?}");
        // Four of one block and two of two: 2^-alpha = 1/2, and 1 / sqrt(6 (2/3) (1/3)) / ln 2. A law
        // of two sizes fits every sample.
        assert_eq!(
            words_of(&of_run, SizeLaw::PowerLaw),
            ["95 %", "A: 6", "global slips: 2, before: 3", "s^{−α}, α = 1.0 ± 1.2", "KS 0.000 ≤ 0.000"]
        );
        assert!(words_of(&slipped(&[2]), SizeLaw::PowerLaw).contains(&"too few for a fit".to_owned()));
    }

    #[test]
    fn without_a_global_slip_all_are_shown_and_nothing_is_fitted() {
        let of_run = slipped(&[]);
        assert_eq!(words_of(&of_run, SizeLaw::PowerLaw), ["95 %", "A: 3", "no fit before a global slip"]);
        assert_eq!(words_of(&of_run, SizeLaw::None), ["95 %", "A: 3"]);
    }

    #[test]
    fn the_key_has_b_where_the_summary_has() {
        let b = Some("b = 0.800 ± 0.100 above -6.000; n = 60 (KS 0.050 ≤ 0.110)".to_owned());
        let mut of_run = slipped(&[]);
        of_run.run.summary.gutenberg_richter_test = b;
        let words = words_of(&of_run, SizeLaw::None);
        let key = ["95 %", "A: 3", "b = 0.800 ± 0.100", "above −6.000; n = 60 (KS 0.050 ≤ 0.110)"];
        assert_eq!(words, key);
    }

    /// As many of one block as of all the others together, which are large: no power law has that.
    #[test]
    fn a_fit_that_is_rejected_has_no_error() {
        let sizes: Vec<u32> = (0..60).map(|n| if n % 2 == 0 { 1 } else { 70 + n % 9 }).collect();
        for (law, name) in [(SizeLaw::PowerLaw, "s^{−α}"), (SizeLaw::Exponential, "exp(−s/ξ)")] {
            let words = words(fit_layers(fitted(&sizes, law, 1..100), true, Dash::Solid, INK).iter());
            assert!(words[0].starts_with(&format!("{name} rejected: KS 0.")), "{words:?}");
            assert!(words[0].contains(" > 0."), "{words:?}");
            assert!(!words.iter().any(|words| words.contains('±')), "{words:?}");
        }
    }
}
