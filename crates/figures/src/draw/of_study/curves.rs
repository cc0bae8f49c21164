//! Families of curves, and precursor lengths against the load.

use std::collections::BTreeMap;

use asperity_model::analytic::{LengthLaw, LengthLawParameters};
use asperity_numbers::quantile;
use asperity_record::Cell;
use plotters::prelude::RGBColor;

use super::gather::{Gathered, LEVELS, Loads, ScenarioOf};
use super::map::in_order;
use crate::Theory;
use crate::draw::colours::{Colours, On, WORDS};
use crate::draw::scale::Scale;
use crate::draw::sheet::{Dash, GREY, INK, Layer, Marker, Shape, Sheet};

/// Strengths of the bands between extremes and between quartiles.
const EXTREMES: f64 = 0.13;
const QUARTILES: f64 = 0.28;

/// Points of one colour with marks; more are a line, or dots.
const MOST_MARKS: usize = 60;

/// The radius of a dot where marks would hide each other.
const DOT: f64 = 5.0;

/// Laws that may differ from run to run of one colour; more would be a tangle.
const MOST_LAWS: usize = 12;

/// How each of the colours looks, by its number.
struct Looks {
    all: Vec<(Marker, RGBColor)>,
    bar: Option<Colours>,
    /// What the legend calls each, below what all of them are.
    legend: Vec<Layer>,
}

/// Marks of words, which tell them apart in grey as well.
const MARKERS: [Marker; 5] =
    [Marker::Circle, Marker::Triangle, Marker::Square, Marker::Diamond, Marker::Cross];

impl Looks {
    /// Of the colours of a figure: numbers on a scale, words one by one.
    fn of(gathered: &Gathered, has_lines: bool, has_marks: bool) -> Looks {
        let places = &gathered.colours.places;
        let Some(colour) = &gathered.figure.colour else {
            let all = vec![(Marker::Circle, INK); places.len().max(1)];
            return Looks { all, bar: None, legend: Vec::new() };
        };
        let numbers = || places.iter().filter_map(Cell::number);
        if !colour.is_word {
            let scale = Scale::of(&colour.label, colour.log, 0.0, numbers().collect::<Vec<_>>().into_iter());
            let colours = Colours::of(scale, On::Lines);
            let look = |value| (Marker::Circle, colours.at(colours.scale.nearest_share(value)));
            return Looks { all: numbers().map(look).collect(), bar: Some(colours), legend: Vec::new() };
        }
        let looks = MARKERS.into_iter().cycle().zip(WORDS.into_iter().cycle());
        let all: Vec<(Marker, RGBColor)> = looks.take(places.len()).collect();
        let mut legend = vec![Layer::remark(&colour.label)];
        for ((marker, color), word) in all.iter().zip(gathered.colours.words()) {
            legend.extend(has_lines.then(|| Layer::line(&word, Vec::new(), Dash::Solid, *color)));
            legend.extend(has_marks.then(|| Layer::marks(&word, Vec::new(), *marker, *color)));
        }
        Looks { all, bar: None, legend }
    }
}

/// The rows of the legend that explain lines and bands.
fn explain(legend: &mut Vec<Layer>, bands: bool, theory: Option<(Dash, &str)>) {
    if bands {
        legend.push(Layer::line("median", Vec::new(), Dash::Solid, GREY));
        legend.push(Layer::surface("quartiles", Vec::new(), QUARTILES + EXTREMES, INK));
        legend.push(Layer::surface("extremes", Vec::new(), EXTREMES, INK));
    }
    if let Some((dash, label)) = theory {
        legend.push(Layer::line(label, Vec::new(), dash, GREY));
    }
}

/// Numbers of runs in one place across, in ascending order; none where no run has the number.
type Column = (f64, Vec<f64>);

/// A run in a family: across, upwards, and its number if it is done.
type Shown = (f64, f64, Option<u64>);

/// A surface between two courses, one for each stretch without gaps.
fn surfaces(columns: &[Column], low: f64, high: f64, color: RGBColor, strength: f64) -> Vec<Layer> {
    let stretches = columns.split(|(_, values)| values.is_empty()).filter(|stretch| stretch.len() > 1);
    let course = |stretch: &[Column], share: f64| -> Vec<(f64, f64)> {
        stretch.iter().filter_map(|(x, values)| Some((*x, quantile(values, share)?))).collect()
    };
    let surface = |stretch: &[Column]| {
        let mut outline = course(stretch, low);
        outline.extend(course(stretch, high).into_iter().rev());
        Layer::surface("", outline, strength, color)
    };
    stretches.map(surface).collect()
}

/// Adds what theory says of a colour; one grey line where it says the same of several.
fn add_law(lines: &mut Vec<Layer>, course: Vec<(f64, f64)>, dash: Dash, color: RGBColor) {
    let same =
        |other: &&mut Layer| matches!(&other.shape, Shape::Line(known, _) if same_course(known, &course));
    match lines.iter_mut().find(same) {
        Some(shared) => shared.colour = GREY,
        None => lines.push(Layer::line("", course, dash, color)),
    }
}

fn same_course(a: &[(f64, f64)], b: &[(f64, f64)]) -> bool {
    let bits = |points: &[(f64, f64)]| -> Vec<(u64, u64)> {
        points.iter().map(|(x, y)| (x.to_bits(), y.to_bits())).collect()
    };
    bits(a) == bits(b)
}

/// The number below which a share of them lies, one of them.
fn rank(ascending: &[f64], share: f64) -> f64 {
    let last = ascending.len().saturating_sub(1);
    ascending.get((share * last as f64).round() as usize).copied().unwrap_or(f64::INFINITY)
}

pub(super) fn family(
    gathered: &Gathered,
    joined: bool,
    theory: Option<Theory>,
    scenario_of: ScenarioOf<'_>,
) -> Result<Sheet, String> {
    let figure = &gathered.figure;
    let mut series: BTreeMap<(usize, usize), Vec<Shown>> = BTreeMap::new();
    for sample in gathered.samples.iter().filter(|sample| sample.x.is_finite()) {
        let of = series.entry((sample.panel, sample.colour)).or_default();
        let run = sample.done.then_some(sample.run);
        of.push((sample.x, sample.y, run));
    }
    let Looks { all: looks, bar, mut legend } = Looks::of(gathered, joined, true);
    let mut panels: BTreeMap<usize, [Vec<Layer>; 4]> = BTreeMap::new();
    let (mut ys, mut bands, mut has_theory) = (Vec::new(), false, false);
    for ((panel, colour), mut points) in series {
        let (marker, color) = looks[colour];
        let [behind, lines, theories, marks] = panels.entry(panel).or_default();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        if !joined {
            let shown: Vec<(f64, f64)> =
                points.iter().filter(|(_, y, _)| y.is_finite()).map(|(x, y, _)| (*x, *y)).collect();
            ys.extend(shown.iter().map(|(_, y)| *y));
            marks.push(if shown.len() > MOST_MARKS {
                Layer::discs("", shown, DOT, color)
            } else {
                Layer::marks("", shown, marker, color)
            });
        }
        let columns: Vec<Column> = points
            .chunk_by(|a, b| a.0 == b.0)
            .map(|runs| {
                let mut values: Vec<f64> =
                    runs.iter().map(|(_, y, _)| *y).filter(|y| y.is_finite()).collect();
                values.sort_by(f64::total_cmp);
                (runs[0].0, values)
            })
            .collect();
        if joined {
            ys.extend(columns.iter().flat_map(|(_, values)| [values.first(), values.last()]).flatten());
            if columns.iter().any(|(_, values)| values.len() > 1) {
                bands = true;
                behind.extend(surfaces(&columns, 0.0, 1.0, color, EXTREMES));
                behind.extend(surfaces(&columns, 0.25, 0.75, color, QUARTILES));
            }
            // A place without the number is a gap.
            let course: Vec<(f64, f64)> =
                columns.iter().map(|(x, values)| (*x, quantile(values, 0.5).unwrap_or(f64::NAN))).collect();
            lines.push(Layer::line("", course.clone(), Dash::Solid, color));
            let alone = |n: &usize| {
                let is_gap = |n: usize| course.get(n).is_none_or(|(_, y)| y.is_nan());
                is_gap(n.wrapping_sub(1)) && is_gap(n + 1)
            };
            let is_marked = course.len() <= MOST_MARKS;
            let marked = (0..course.len()).filter(|n| is_marked || alone(n)).map(|n| course[n]);
            marks.push(Layer::marks("", marked.filter(|(_, y)| y.is_finite()).collect(), marker, color));
        }
        if let Some(theory) = theory {
            let mut course = Vec::new();
            for runs in points.chunk_by(|a, b| a.0 == b.0) {
                // Of runs that share a place, the first one speaks.
                let y = match runs.iter().find_map(|(.., run)| *run) {
                    Some(run) => theory.of(&scenario_of(run)?).unwrap_or(f64::NAN),
                    None => f64::NAN,
                };
                course.push((runs[0].0, y));
            }
            let finite: Vec<f64> = course.iter().map(|(_, y)| *y).filter(|y| y.is_finite()).collect();
            has_theory |= !finite.is_empty();
            ys.extend(finite);
            add_law(theories, course, Dash::Dashed, color);
        }
    }
    explain(&mut legend, bands, has_theory.then_some((Dash::Dashed, "theory")));
    let mut xs: Vec<f64> = gathered.samples.iter().map(|sample| sample.x).collect();
    let measured = figure.measured.iter().flat_map(|measured| measured.layers([figure.x.log, figure.y.log]));
    for layer in measured {
        let (across, upwards): (Vec<f64>, Vec<f64>) = layer.points().into_iter().unzip();
        xs.extend(across);
        ys.extend(upwards.into_iter().filter(|y| y.is_finite()));
        legend.push(layer);
    }
    let lowest = ys.iter().copied().fold(f64::INFINITY, f64::min);
    let x = Scale::of(&figure.x.label, figure.x.log, 0.04, xs.into_iter().filter(|x| x.is_finite()));
    let y = Scale::of(&figure.y.label, figure.y.log, 0.06, ys.into_iter()).down_to_zero(lowest);
    Ok(sheet(gathered, panels, legend, bar, [x, y]))
}

pub(super) fn lengths(
    gathered: &Gathered,
    law: Option<LengthLaw>,
    scenario_of: ScenarioOf<'_>,
) -> Result<Sheet, String> {
    let figure = &gathered.figure;
    let Looks { all: looks, bar, mut legend } = Looks::of(gathered, figure.is_spread, !figure.is_spread);
    let mut panels: BTreeMap<usize, [Vec<Layer>; 3]> = BTreeMap::new();
    let mut largest: f64 = 0.0;
    let mut labels: Vec<String> = Vec::new();
    let mut is_tangled = false;
    let mut runs: BTreeMap<(usize, usize), Vec<u64>> = BTreeMap::new();
    for sample in gathered.samples.iter().filter(|sample| sample.done) {
        runs.entry((sample.panel, sample.colour)).or_default().push(sample.run);
    }
    for ((panel, colour), runs) in runs {
        let (_, color) = looks[colour];
        let [_, lines, _] = panels.entry(panel).or_default();
        let mut laws: Vec<(LengthLaw, LengthLawParameters)> = Vec::new();
        for run in runs {
            let scenario = scenario_of(run)?;
            if !LengthLaw::is_for(&scenario) {
                continue;
            }
            let of = law.unwrap_or_else(|| LengthLaw::natural(&scenario));
            let found = (of, LengthLawParameters::of(&scenario));
            if !laws.contains(&found) {
                laws.push(found);
            }
            if laws.len() > MOST_LAWS {
                break;
            }
        }
        if laws.len() > MOST_LAWS {
            is_tangled = true;
            continue;
        }
        for (law, parameters) in laws {
            let shares = (0..=200).map(|n| f64::from(n) / 200.0);
            let course: Vec<(f64, f64)> =
                shares.map(|length| (law.load_ratio(&parameters, length), length)).collect();
            largest = course.iter().fold(largest, |largest, (load, _)| largest.max(*load));
            let dash = if figure.is_spread { Dash::Dashed } else { Dash::Solid };
            add_law(lines, course, dash, color);
            if !labels.contains(&law.label()) {
                labels.push(law.label());
            }
        }
    }
    let loads = gathered.loads.values().flat_map(|loads| loads.at_levels.iter().flatten());
    largest = loads.fold(largest, |largest, load| largest.max(*load));
    let marked = gathered.marks.iter().map(|(.., load, _)| f64::from_bits(*load));
    largest = marked.fold(largest, f64::max);
    let mut tallest: f64 = 1.05;
    for layer in figure.measured.iter().flat_map(|measured| measured.layers([false; 2])) {
        for (load, length) in layer.points() {
            (largest, tallest) = (largest.max(load), tallest.max(length * 1.06));
        }
        legend.push(layer);
    }
    let to = if largest > 0.0 { largest * 1.06 } else { 1.0 };
    for (&(panel, colour), Loads { runs, at_levels }) in &gathered.loads {
        let (_, color) = looks[colour];
        let [behind, lines, _] = panels.entry(panel).or_default();
        // A run that has not come to a length would need a load beyond all others.
        let beyond = |loads: &Vec<f64>| {
            let mut all = loads.clone();
            all.sort_by(f64::total_cmp);
            all.resize(*runs, f64::INFINITY);
            all
        };
        let columns: Vec<Vec<f64>> = at_levels.iter().map(beyond).collect();
        let level = |n: usize| (n + 1) as f64 / LEVELS as f64;
        let course = |share: f64| -> Vec<(f64, f64)> {
            let loads = columns.iter().map(|loads| rank(loads, share));
            loads.enumerate().map(|(n, load)| (load, level(n))).collect()
        };
        for (low, high, strength) in [(0.0, 1.0, EXTREMES), (0.25, 0.75, QUARTILES)] {
            let low = course(low).into_iter().filter(|(load, _)| load.is_finite());
            let mut outline: Vec<(f64, f64)> = low.collect();
            let high = course(high).into_iter().take(outline.len());
            let right: Vec<(f64, f64)> = high.map(|(load, length)| (load.min(to), length)).collect();
            outline.extend(right.into_iter().rev());
            behind.push(Layer::surface("", outline, strength, color));
        }
        lines.push(Layer::line("", course(0.5), Dash::Solid, color));
    }
    let mut marks: BTreeMap<(usize, usize), Vec<(f64, f64)>> = BTreeMap::new();
    for (panel, colour, load, length) in &gathered.marks {
        let point = (f64::from_bits(*load), f64::from_bits(*length));
        marks.entry((*panel, *colour)).or_default().push(point);
    }
    for ((panel, colour), points) in marks {
        let (marker, color) = looks[colour];
        let [.., on_top] = panels.entry(panel).or_default();
        let is_many = points.len() > 4 * MOST_MARKS;
        on_top.push(if is_many {
            Layer::discs("", points, DOT, color)
        } else {
            Layer::marks("", points, marker, color)
        });
    }
    let label = match &labels[..] {
        [] => None,
        [only] => Some(only.as_str()),
        _ => Some("length law"),
    };
    let dash = if figure.is_spread { Dash::Dashed } else { Dash::Solid };
    if !figure.is_spread {
        legend.push(Layer::marks("simulated", Vec::new(), Marker::Circle, GREY));
    }
    explain(&mut legend, figure.is_spread, label.map(|label| (dash, label)));
    if is_tangled {
        legend.push(Layer::remark("laws differ"));
    }
    let axes = [Scale::between(&figure.x.label, 0.0, to), Scale::between(&figure.y.label, 0.0, tallest)];
    Ok(sheet(gathered, panels, legend, bar, axes))
}

/// The panels in the order of their values, with the legend of all.
fn sheet<const N: usize>(
    gathered: &Gathered,
    panels: BTreeMap<usize, [Vec<Layer>; N]>,
    legend: Vec<Layer>,
    bar: Option<Colours>,
    [x, y]: [Scale; 2],
) -> Sheet {
    let with_legend =
        |(panel, layers): (usize, [Vec<Layer>; N])| (panel, [layers.concat(), legend.clone()].concat());
    let panels = panels.into_iter().map(with_legend).collect();
    Sheet { bar, ..Sheet::of(in_order(gathered, panels, &x, &y)) }
}
