//! How the ruptures of runs are distributed by their number of blocks, and what is fitted to it.

use asperity_numbers::distributions::{SizeFit, SizeLaw, half_band, survival};
use asperity_numbers::estimate::Estimate;
use asperity_numbers::goodness::Test;
use asperity_numbers::run_data::RunData;
use plotters::prelude::RGBColor;

use super::kind::{Figure, Parts, keys, of_runs_in, with_parts};
use super::rupture_selector::{Sort, before_first_global_slip, sorted};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Point, Sheet, nth};

keys! {
    Sizes: series;

    /// The smallest rupture that counts, in blocks.
    #[serde(default = "one")]
    from_blocks: u32,
    /// The law that is fitted, by maximum likelihood, to the sizes of ruptures after the first global
    /// slip: whole numbers from `from_blocks` to one block less than the slider has.
    #[serde(default)]
    fit: SizeLaw,
}

fn one() -> u32 {
    1
}

/// What is shown of a run.
pub(crate) struct Part {
    /// The blocks of each rupture that is no global slip, after the first of them; of all, where there
    /// is none.
    sizes: Vec<u32>,
    /// How many came before it.
    before: Option<usize>,
    /// How many global slips there are.
    global_slips: usize,
    blocks: u32,
    /// What they are called.
    unit: &'static str,
    /// `b` of the magnitudes of all ruptures, or why there is none, in the words of the summary.
    b: Option<String>,
}

impl Figure for Sizes {
    of_runs_in!(series, Part);

    fn part(&self, run: &RunData) -> Result<Part, String> {
        part(run, self.from_blocks)
    }

    fn sheet(&self, parts: Parts<Part>) -> Result<Sheet, String> {
        distribution(&with_parts(&self.series, &parts)?, self.from_blocks, self.fit)
    }
}

pub(super) fn part(run: &RunData, from_blocks: u32) -> Result<Part, String> {
    let ruptures = sorted(run)?;
    let first_global = before_first_global_slip(&ruptures);
    let (before, after) = ruptures.split_at(first_global.unwrap_or(0));
    let of = |ruptures: &[(&asperity_record::Rupture, Sort)]| -> Vec<u32> {
        let others = ruptures.iter().filter(|(_, sort)| *sort != Sort::GlobalSlip);
        others.map(|(rupture, _)| rupture.slipped()).filter(|size| *size >= from_blocks).collect()
    };
    Ok(Part {
        sizes: of(after),
        before: first_global.map(|_| of(before).len()),
        global_slips: after.iter().filter(|(_, sort)| *sort == Sort::GlobalSlip).count(),
        blocks: run.header.blocks,
        unit: if run.of_one_row().is_some() { "blocks" } else { "contacts" },
        b: run.summary.gutenberg_richter_test.clone(),
    })
}

/// A number with its error, both to two digits of the error.
pub(super) fn with_error(Estimate { value, error }: Estimate) -> String {
    let decimals = (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.decimals$} ± {error:.decimals$}").replace('-', "\u{2212}")
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
pub(super) fn band(course: &[(f64, f64)], half: f64, lowest: f64) -> Vec<(f64, f64)> {
    let moved = |by: f64| course.iter().map(move |(x, share)| (*x, (share + by).clamp(lowest, 1.0)));
    let below: Vec<(f64, f64)> = moved(-half).collect();
    moved(half).chain(below.into_iter().rev()).collect()
}

pub(super) fn distribution(
    series: &[(&str, &Part)],
    from_blocks: u32,
    law: SizeLaw,
) -> Result<Sheet, String> {
    let (mut behind, mut layers) = (Vec::new(), Vec::new());
    let most = series.iter().map(|(_, part)| part.sizes.len()).max().unwrap_or(0);
    // Half of the smallest share, so that all are in the frame.
    let lowest = 0.5 / most.max(5) as f64;
    let mut largest = f64::from(from_blocks) + 1.0;
    for (index, (label, part)) in series.iter().enumerate() {
        let (marker, dash, color) = nth(index);
        let count = part.sizes.len();
        let sizes: Vec<f64> = part.sizes.iter().map(|size| f64::from(*size)).collect();
        let shares = survival(&sizes);
        largest = sizes.iter().copied().fold(largest, f64::max);
        if count > 0 {
            let outline = band(&shares, half_band(count), lowest);
            behind.push(Layer::surface(if index == 0 { "95 %" } else { "" }, outline, 0.13, color));
        }
        layers.push(Layer::marks(format!("{label}: {count}"), shares, marker, color));
        if let Some(before) = part.before {
            layers.push(Layer::remark(format!("global slips: {}, before: {before}", part.global_slips)));
        }
        if let Some(b) = &part.b {
            let lines = b.replace(" above ", "\nabove ").replace(": ", ":\n").replace('-', "−");
            layers.extend(lines.lines().map(Layer::remark));
        }
        let fit = (law != SizeLaw::None).then(|| SizeFit::of(&part.sizes, law, from_blocks, part.blocks - 1));
        let fitted = fit.map(|fit| {
            fit.map(|fit| {
                let course = fit.survival().into_iter().filter(|(_, p)| *p >= lowest).collect();
                let test = Test::of_sizes(&fit, &part.sizes, law);
                let (law, parameter) = words(law, fit.theta);
                Fitted { law, parameters: vec![parameter], test, course }
            })
        });
        layers.extend(fit_layers(fitted, part.before.is_some(), dash, color));
    }
    behind.extend(layers);
    let frame = [f64::from(from_blocks), largest];
    let unit = series.first().map_or("blocks", |(_, part)| part.unit);
    let unit = if series.iter().all(|(_, part)| part.unit == unit) { unit } else { "blocks" };
    let x = Scale::of(&format!("size s ({unit})"), true, 0.04, frame.into_iter());
    let y = Scale::of("share of at least s", true, 0.0, [lowest, 1.25].into_iter());
    Ok(Sheet::single(x, y, behind))
}

/// The law that was fitted, and its parameter.
fn words(law: SizeLaw, theta: Estimate) -> (&'static str, String) {
    match law {
        SizeLaw::PowerLaw => ("s^{−α}", format!("α = {}", with_error(theta))),
        SizeLaw::Exponential => {
            let length = 1.0 / theta.value;
            let length = Estimate { value: length, error: theta.error * length * length };
            ("exp(−s/ξ)", format!("ξ = {}", with_error(length)))
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

/// A fit, if one is asked for, of which there is none from few numbers, nor before a global slip.
pub(super) fn fit_layers(
    fit: Option<Option<Fitted>>,
    has_global_slip: bool,
    dash: Dash,
    color: RGBColor,
) -> Vec<Layer> {
    let Fitted { law, parameters, test, course } = match fit {
        None => return Vec::new(),
        Some(_) if !has_global_slip => return vec![Layer::remark("no fit before a global slip")],
        Some(None) => return vec![Layer::remark("too few for a fit")],
        Some(Some(fitted)) => fitted,
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
    use super::{Estimate, SizeLaw, band, distribution, part, steps, with_error};
    use asperity_testkit::made_up;

    #[test]
    fn numbers_have_two_digits_of_their_error() {
        let text = |value, error| with_error(Estimate { value, error });
        assert_eq!(text(1.2345, 0.0678), "1.234 ± 0.068");
        assert_eq!(text(-12.3, 3.4), "−12.3 ± 3.4");
        assert_eq!(text(1234.5, 67.8), "1234 ± 68");
    }

    #[test]
    fn a_band_lies_about_its_course() {
        assert_eq!(
            band(&[(1.0, 1.0), (2.0, 0.5)], 0.25, 0.3),
            [(1.0, 1.0), (2.0, 0.75), (2.0, 0.3), (1.0, 0.75)]
        );
        assert_eq!(steps(&[(1.0, 1.0), (2.0, 0.5)]), [(1.0, 1.0), (1.0, 0.5), (2.0, 0.5)]);
    }

    /// Ruptures of one block and of two, before the slip of all three and after it.
    fn slipped(after: &[u32]) -> super::Part {
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
        part(&run, 1).unwrap()
    }

    fn words_of(part: &super::Part, law: SizeLaw) -> Vec<String> {
        let sheet = distribution(&[("A", part)], 1, law).unwrap();
        sheet.layers().map(|layer| layer.label.clone()).filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn sizes_are_those_after_the_first_global_slip() {
        let of_run = slipped(&[1, 2, 1, 3, 1, 2, 1]);
        assert_eq!((of_run.sizes.clone(), of_run.before), (vec![1, 2, 1, 1, 2, 1], Some(3)));
        let sheet = distribution(&[("A", &of_run)], 1, SizeLaw::PowerLaw).unwrap();
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
        assert_eq!((of_run.sizes.len(), of_run.before), (3, None));
        assert_eq!(words_of(&of_run, SizeLaw::PowerLaw), ["95 %", "A: 3", "no fit before a global slip"]);
        assert_eq!(words_of(&of_run, SizeLaw::None), ["95 %", "A: 3"]);
    }

    #[test]
    fn the_key_has_b_where_the_summary_has() {
        let b = Some("b = 0.800 ± 0.100 above -6.000; n = 60 (KS 0.050 ≤ 0.110)".to_owned());
        let of_run = super::Part { b, ..slipped(&[]) };
        let words = words_of(&of_run, SizeLaw::None);
        let key = ["95 %", "A: 3", "b = 0.800 ± 0.100", "above −6.000; n = 60 (KS 0.050 ≤ 0.110)"];
        assert_eq!(words, key);
    }

    /// As many of one block as of all the others together, which are large: no power law has that.
    #[test]
    fn a_fit_that_is_rejected_has_no_error() {
        let sizes: Vec<u32> = (0..60).map(|n| if n % 2 == 0 { 1 } else { 70 + n % 9 }).collect();
        let of_run =
            super::Part { sizes, before: Some(0), global_slips: 1, blocks: 100, unit: "blocks", b: None };
        for (law, name) in [(SizeLaw::PowerLaw, "s^{−α}"), (SizeLaw::Exponential, "exp(−s/ξ)")] {
            let words = words_of(&of_run, law);
            assert!(words[3].starts_with(&format!("{name} rejected: KS 0.")), "{words:?}");
            assert!(words[3].contains(" > 0."), "{words:?}");
            assert!(!words.iter().any(|words| words.contains('±')), "{words:?}");
        }
    }
}
