//! How the ruptures of runs are distributed by their number of blocks, and what is fitted to it.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, Parts, run_names, with_parts};
use super::of_study::paper::{Item, Panel, Paper, Sample};
use super::plot::{Sheet, nth};
use super::scale::Scale;
use super::which::{Sort, sorted};
use crate::distributions::{Estimate, SizeFit, SizeLaw, half_band, survival};
use crate::run_data::RunData;

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Sizes {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// The runs, each with what the legend calls it.
    series: Vec<Labelled>,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// The smallest rupture that counts, in blocks.
    #[serde(default = "one")]
    from_blocks: u32,
    /// What is fitted: by maximum likelihood, to whole sizes from `from_blocks` to one block less than
    /// the slider has.
    #[serde(default)]
    fit: SizeLaw,
}

fn one() -> u32 {
    1
}

/// What is shown of a run.
pub(crate) struct Part {
    /// The blocks of each rupture that is no global slip.
    sizes: Vec<u32>,
    /// How many global slips there are.
    global_slips: usize,
    blocks: u32,
}

impl Figure for Sizes {
    type Part = Part;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        part(run, self.from_blocks)
    }

    fn sheet(&self, parts: Parts<Part>) -> Result<Sheet, String> {
        let paper = distribution(&with_parts(&self.series, &parts)?, self.from_blocks, self.fit)?;
        Ok(Sheet::Other(Arc::new(Paper { title: self.title.clone(), ..paper })))
    }
}

pub(super) fn part(run: &RunData, from_blocks: u32) -> Result<Part, String> {
    let ruptures = sorted(run)?;
    let size = |rupture: &asperity_record::Rupture| rupture.last_block - rupture.first_block + 1;
    let others = ruptures.iter().filter(|(_, sort)| *sort != Sort::GlobalSlip);
    Ok(Part {
        sizes: others.map(|(rupture, _)| size(rupture)).filter(|size| *size >= from_blocks).collect(),
        global_slips: ruptures.iter().filter(|(_, sort)| *sort == Sort::GlobalSlip).count(),
        blocks: run.header.blocks,
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
) -> Result<Paper, String> {
    let (mut behind, mut items, mut rows) = (Vec::new(), Vec::new(), Vec::new());
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
            behind.push(Item::Surface(band(&shares, half_band(count), lowest), color, 0.13));
        }
        items.push(Item::Marks(shares, marker, color));
        rows.push((Sample::Marks(marker, color), format!("{label}: {count}")));
        if part.global_slips > 0 {
            rows.push((Sample::Nothing, format!("global slips: {}", part.global_slips)));
        }
        match SizeFit::of(&part.sizes, law, from_blocks, part.blocks - 1) {
            Some(fit) => {
                let course = fit.survival();
                items.push(Item::Line(
                    course.into_iter().filter(|(_, p)| *p >= lowest).collect(),
                    dash,
                    color,
                ));
                rows.push((Sample::Line(dash, color), words(law, fit.theta)));
            }
            None if law == SizeLaw::None => {}
            None => rows.push((Sample::Nothing, "too few for a fit".to_owned())),
        }
    }
    if !behind.is_empty() {
        rows.push((Sample::Surface(nth(0).2, 0.13), "95 %".to_owned()));
    }
    behind.extend(items);
    let frame = [f64::from(from_blocks), largest];
    Ok(Paper {
        shape: None,
        title: String::new(),
        x: Scale::of("size s (blocks)", true, 0.04, frame.into_iter()),
        y: Scale::of("share of at least s", true, 0.0, [lowest, 1.25].into_iter()),
        panels: vec![Panel { title: String::new(), items: behind }],
        bar: None,
        heading: String::new(),
        rows,
    })
}

/// The law that was fitted.
fn words(law: SizeLaw, theta: Estimate) -> String {
    match law {
        SizeLaw::PowerLaw => format!("s^{{−α}}, α = {}", with_error(theta)),
        SizeLaw::Exponential => {
            let length = 1.0 / theta.value;
            format!("ξ = {}", with_error(Estimate { value: length, error: theta.error * length * length }))
        }
        SizeLaw::None => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Estimate, Item, SizeLaw, band, distribution, part, steps, with_error};
    use crate::made_up;

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

    #[test]
    fn global_slips_are_counted_apart() {
        let mut run = made_up::run("", &[(100, 101, &[1])]);
        let one: &[made_up::Passed] = &[(1, 100, Some(101))];
        let two: &[made_up::Passed] = &[(2, 200, Some(201)), (3, 201, Some(202))];
        let all: &[made_up::Passed] = &[(1, 300, None), (2, 301, None), (3, 302, None)];
        made_up::with_ruptures(&mut run, &[one, one, one, two, all, one, two]);
        let of_run = part(&run, 1).unwrap();
        assert_eq!((of_run.sizes.clone(), of_run.global_slips), (vec![1, 1, 1, 1, 2, 2], 1));
        assert_eq!(part(&run, 2).unwrap().sizes, [2, 2]);
        let paper = distribution(&[("A", &of_run)], 1, SizeLaw::PowerLaw).unwrap();
        // Four of one block and two of two: 2^-alpha = 1/2, and 1 / sqrt(6 (2/3) (1/3)) / ln 2.
        let words: Vec<&str> = paper.rows.iter().map(|(_, words)| words.as_str()).collect();
        assert_eq!(words, ["A: 6", "global slips: 1", "s^{−α}, α = 1.0 ± 1.2", "95 %"]);
        let marks = paper.panels[0].items.iter().find_map(|item| match item {
            Item::Marks(points, ..) => Some(points.clone()),
            _ => None,
        });
        let marks = marks.unwrap();
        assert!(marks[0] == (1.0, 1.0) && (marks[1].1 - 1.0 / 3.0).abs() < 1e-12, "{marks:?}");
        let few = distribution(&[("A", &part(&run, 2).unwrap())], 2, SizeLaw::Exponential).unwrap();
        assert!(few.rows.iter().any(|(_, words)| words == "too few for a fit"));
    }
}
