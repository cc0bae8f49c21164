//! Families of curves, and precursor lengths against the load.

use std::collections::BTreeMap;

use asperity_model::theory::analytic::{LengthLaw, LengthLawParameters};
use asperity_numbers::quantile;
use asperity_record::Cell;
use plotters::prelude::RGBColor;

use super::gather::{Gathered, Group, LEVELS, Sample, ScenarioOf, level};
use super::map::in_order;
use crate::draw::colours::{Colours, On, WORDS};
use crate::draw::lengths::course;
use crate::draw::scale::Scale;
use crate::draw::sheet::{Dash, GREY, INK, Layer, Marker, Point, Shape, Sheet};
use crate::spec::theory;

/// The bands between extremes and between quartiles: from which share to which, and their strengths.
const BANDS: [(f64, f64, f64); 2] = [(0.0, 1.0, EXTREMES), (0.25, 0.75, QUARTILES)];
const EXTREMES: f64 = 0.13;
const QUARTILES: f64 = 0.28;

/// Points of one colour with marks; more are a line, or dots.
const MOST_MARKS: usize = 60;

/// The radius of a dot where marks would hide each other.
const DOT: f64 = 5.0;

/// Laws that may differ from run to run of one colour; more would be a tangle.
const MOST_LAWS: usize = 12;

/// Marks of words, which tell them apart in grey as well.
const MARKERS: [Marker; 5] =
    [Marker::Circle, Marker::Triangle, Marker::Square, Marker::Diamond, Marker::Cross];

/// What is drawn so far.
struct Drawing<'a> {
    gathered: &'a Gathered,
    /// How each of the colours looks, by its number.
    looks: Vec<(Marker, RGBColor)>,
    bar: Option<Colours>,
    /// What the legend calls each, below what all of them are.
    legend: Vec<Layer>,
    /// By panel what is behind, lines, theory, and marks.
    panels: BTreeMap<usize, [Vec<Layer>; 4]>,
}

impl<'a> Drawing<'a> {
    /// With the colours of a figure: numbers on a scale, words one by one.
    fn of(gathered: &'a Gathered, has_lines: bool, has_marks: bool) -> Drawing<'a> {
        let places = &gathered.colours.places;
        let (mut bar, mut legend) = (None, Vec::new());
        let looks = match &gathered.figure.colour {
            None => vec![(Marker::Circle, INK); places.len().max(1)],
            Some(colour) if colour.is_word => {
                let looks = MARKERS.into_iter().cycle().zip(WORDS.into_iter().cycle());
                let all: Vec<(Marker, RGBColor)> = looks.take(places.len()).collect();
                legend.push(Layer::remark(&colour.label));
                for ((marker, color), word) in all.iter().zip(gathered.colours.words()) {
                    legend.extend(has_lines.then(|| Layer::line(&word, Vec::new(), Dash::Solid, *color)));
                    legend.extend(has_marks.then(|| Layer::marks(&word, Vec::new(), *marker, *color)));
                }
                all
            }
            Some(colour) => {
                let numbers: Vec<f64> = places.iter().filter_map(Cell::number).collect();
                let scale = Scale::of(&colour.label, colour.log, 0.0, numbers.iter().copied());
                let colours = bar.insert(Colours::of(scale, On::Lines));
                numbers.iter().map(|value| (Marker::Circle, colours.nearest(*value))).collect()
            }
        };
        Drawing { gathered, looks, bar, legend, panels: BTreeMap::new() }
    }

    /// The layers of a panel, and how its colour looks.
    fn of_group(&mut self, (panel, colour): Group) -> (&mut [Vec<Layer>; 4], (Marker, RGBColor)) {
        (self.panels.entry(panel).or_default(), self.looks[colour])
    }

    /// Explains lines and bands in the legend.
    fn explain(&mut self, bands: bool, theory: Option<(Dash, &str)>) {
        let line = |label: &str, dash| Layer::line(label, Vec::new(), dash, GREY);
        if bands {
            let surface = |label: &str, strength| Layer::surface(label, Vec::new(), strength, INK);
            self.legend.push(line("median", Dash::Solid));
            self.legend.extend([surface("quartiles", QUARTILES + EXTREMES), surface("extremes", EXTREMES)]);
        }
        self.legend.extend(theory.map(|(dash, label)| line(label, dash)));
    }

    /// The panels in the order of their values, with the legend of all.
    fn sheet(self, [x, y]: [Scale; 2]) -> Sheet {
        let layers = |n: usize| {
            let shown = self.panels.get(&n).map(|layers| [layers.concat(), self.legend.clone()].concat());
            shown.unwrap_or_default()
        };
        Sheet { bar: self.bar.clone(), ..Sheet::of(in_order(self.gathered, layers, &x, &y)) }
    }
}

/// Points as marks, or as dots if there are more of them than these.
fn marks(points: Vec<Point>, most: usize, (marker, color): (Marker, RGBColor)) -> Layer {
    if points.len() > most {
        Layer::discs("", points, DOT, color)
    } else {
        Layer::marks("", points, marker, color)
    }
}

/// A surface between two courses.
fn surface(mut low: Vec<Point>, high: Vec<Point>, strength: f64, color: RGBColor) -> Layer {
    low.extend(high.into_iter().rev());
    Layer::surface("", low, strength, color)
}

/// Adds what theory says of a colour; one grey line where it says the same of several.
fn add_law(lines: &mut Vec<Layer>, course: Vec<Point>, dash: Dash, color: RGBColor) {
    let bits = |points: &[Point]| -> Vec<(u64, u64)> {
        points.iter().map(|(x, y)| (x.to_bits(), y.to_bits())).collect()
    };
    let same =
        |other: &&mut Layer| matches!(&other.shape, Shape::Line(known, _) if bits(known) == bits(&course));
    match lines.iter_mut().find(same) {
        Some(shared) => shared.colour = GREY,
        None => lines.push(Layer::line("", course, dash, color)),
    }
}

/// Samples by panel and colour.
fn by_group<'a>(samples: impl Iterator<Item = &'a Sample>) -> BTreeMap<Group, Vec<&'a Sample>> {
    let mut groups: BTreeMap<Group, Vec<&Sample>> = BTreeMap::new();
    samples.for_each(|sample| groups.entry(sample.group).or_default().push(sample));
    groups
}

pub(super) fn family(
    gathered: &Gathered,
    joined: bool,
    with_theory: bool,
    scenario_of: ScenarioOf<'_>,
) -> Result<Sheet, String> {
    let figure = &gathered.figure;
    let mut drawing = Drawing::of(gathered, joined, true);
    let (mut ys, mut bands, mut has_theory) = (Vec::new(), false, false);
    let placed = || gathered.samples.iter().filter(|sample| sample.x.is_finite());
    for (group, mut samples) in by_group(placed()) {
        let ([behind, lines, theories, on_top], look) = drawing.of_group(group);
        samples.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.done.cmp(&b.done)).then(a.run.cmp(&b.run)));
        let places = || samples.chunk_by(|a, b| a.x == b.x);
        let with_number = |runs: &[&Sample]| -> Vec<Point> {
            runs.iter().filter(|run| run.y.is_finite()).map(|run| (run.x, run.y)).collect()
        };
        ys.extend(samples.iter().map(|sample| sample.y).filter(|y| y.is_finite()));
        if joined {
            // Numbers of runs in one place across, in ascending order; none where no run has the number.
            let place = |runs: &[&Sample]| {
                let mut values: Vec<f64> = with_number(runs).into_iter().map(|(_, y)| y).collect();
                values.sort_by(f64::total_cmp);
                (runs[0].x, values)
            };
            let columns: Vec<(f64, Vec<f64>)> = places().map(place).collect();
            let course = |columns: &[(f64, Vec<f64>)], share: f64| -> Vec<Point> {
                columns.iter().map(|(x, values)| (*x, quantile(values, share).unwrap_or(f64::NAN))).collect()
            };
            if columns.iter().any(|(_, values)| values.len() > 1) {
                bands = true;
                for (low, high, strength) in BANDS {
                    let stretches = columns.split(|(_, values)| values.is_empty());
                    behind.extend(stretches.filter(|stretch| stretch.len() > 1).map(|stretch| {
                        surface(course(stretch, low), course(stretch, high), strength, look.1)
                    }));
                }
            }
            // A place without the number is a gap.
            let median = course(&columns, 0.5);
            let is_gap = |n: usize| median.get(n).is_none_or(|(_, y)| y.is_nan());
            let is_alone = |n: usize| is_gap(n.wrapping_sub(1)) && is_gap(n + 1);
            let is_marked = |n: &usize| !is_gap(*n) && (median.len() <= MOST_MARKS || is_alone(*n));
            let marked = (0..median.len()).filter(is_marked).map(|n| median[n]).collect();
            on_top.push(marks(marked, usize::MAX, look));
            lines.push(Layer::line("", median, Dash::Solid, look.1));
        } else {
            on_top.push(marks(with_number(&samples), MOST_MARKS, look));
        }
        if with_theory {
            let mut course = Vec::new();
            for runs in places() {
                // Of runs that share a place, the first one speaks.
                let first = runs.iter().find(|run| run.done).map(|run| scenario_of(run.run)).transpose()?;
                let y = first.and_then(|scenario| theory(&figure.y.column, &scenario)).unwrap_or(f64::NAN);
                course.push((runs[0].x, y));
            }
            let known = ys.len();
            ys.extend(course.iter().map(|(_, y)| *y).filter(|y| y.is_finite()));
            has_theory |= ys.len() > known;
            add_law(theories, course, Dash::Dashed, look.1);
        }
    }
    drawing.explain(bands, has_theory.then_some((Dash::Dashed, "theory")));
    let xs: Vec<f64> = placed().map(|sample| sample.x).collect();
    let x = Scale::of(&figure.x.label, figure.x.log, 0.04, xs.into_iter());
    let y = Scale::free(&figure.y.label).in_powers(figure.y.log).fitted(ys.into_iter());
    Ok(drawing.sheet([x, y]))
}

pub(super) fn lengths(
    gathered: &Gathered,
    law: Option<LengthLaw>,
    scenario_of: ScenarioOf<'_>,
) -> Result<Sheet, String> {
    let figure = &gathered.figure;
    let dash = if figure.is_spread { Dash::Dashed } else { Dash::Solid };
    let mut drawing = Drawing::of(gathered, figure.is_spread, !figure.is_spread);
    let mut largest: f64 = 0.0;
    let mut labels = Vec::new();
    let mut is_tangled = false;
    for (group, runs) in by_group(gathered.samples.iter().filter(|sample| sample.done)) {
        let ([_, lines, ..], (_, color)) = drawing.of_group(group);
        let mut laws: Vec<(LengthLaw, LengthLawParameters)> = Vec::new();
        for run in runs {
            let scenario = scenario_of(run.run)?;
            let of = law.unwrap_or_else(|| LengthLaw::natural(&scenario));
            let found = (of, LengthLawParameters::of(&scenario));
            if LengthLaw::is_for(&scenario) && !laws.contains(&found) {
                laws.push(found);
            }
            if laws.len() > MOST_LAWS {
                is_tangled = true;
                laws.clear();
                break;
            }
        }
        for (law, parameters) in laws {
            let course = course(law, &parameters, 200);
            largest = course.iter().fold(largest, |largest, (load, _)| largest.max(*load));
            add_law(lines, course, dash, color);
            if !labels.contains(&law.label()) {
                labels.push(law.label());
            }
        }
    }
    let of_runs = gathered.loads.values().flatten().flatten().copied();
    let marked = gathered.marks.values().flatten().map(|(load, _)| f64::from_bits(*load));
    largest = of_runs.chain(marked).fold(largest, f64::max);
    let to = if largest > 0.0 { largest * 1.06 } else { 1.0 };
    for (group, loads) in &gathered.loads {
        let ([behind, lines, ..], (_, color)) = drawing.of_group(*group);
        let column = |n: usize| {
            // A run that has not come to a length would need a load beyond all others.
            let of_runs = loads.iter().map(|of_run| of_run.get(n).copied().unwrap_or(f64::INFINITY));
            let mut all: Vec<f64> = of_runs.collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let columns: Vec<Vec<f64>> = (0..LEVELS).map(column).collect();
        // The load below which a share of the runs lie, that of one of them.
        let course = |share: f64| {
            let rank = (share * loads.len().saturating_sub(1) as f64).round() as usize;
            columns.iter().enumerate().map(move |(n, loads)| (loads[rank], level(n)))
        };
        for (low, high, strength) in BANDS {
            let low: Vec<Point> = course(low).filter(|(load, _)| load.is_finite()).collect();
            let high = course(high).take(low.len()).map(|(load, length)| (load.min(to), length));
            behind.push(surface(low, high.collect(), strength, color));
        }
        lines.push(Layer::line("", course(0.5).collect(), Dash::Solid, color));
    }
    for (group, points) in &gathered.marks {
        let ([.., on_top], look) = drawing.of_group(*group);
        let points = points.iter().map(|(load, length)| (f64::from_bits(*load), f64::from_bits(*length)));
        on_top.push(marks(points.collect(), 4 * MOST_MARKS, look));
    }
    let label = match &labels[..] {
        [only] => only,
        _ => "length law",
    };
    let simulated = || Layer::marks("simulated", Vec::new(), Marker::Circle, GREY);
    drawing.legend.extend((!figure.is_spread).then(simulated));
    drawing.explain(figure.is_spread, (!labels.is_empty()).then_some((dash, label)));
    drawing.legend.extend(is_tangled.then(|| Layer::remark("laws differ")));
    let (x, y) = (Scale::between(&figure.x.label, 0.0, to), Scale::between(&figure.y.label, 0.0, 1.05));
    Ok(drawing.sheet([x, y]))
}
