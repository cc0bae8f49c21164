//! Phase maps: a number as colour over two keys.

use std::collections::BTreeMap;

use asperity_record::Cell;

use super::gather::{Gathered, Sample, Values};
use crate::Statistic;
use crate::draw::colours::{Colours, On};
use crate::draw::scale::{Scale, number};
use crate::draw::sheet::{GREY, Layer, Marker, Panel, Shape, Sheet};

/// The radius of a place where places are scattered.
const DISC: f64 = 22.0;

/// The runs of each place of the map, by panel, x and y.
fn places(gathered: &Gathered) -> BTreeMap<(usize, u64, u64), Vec<&Sample>> {
    let mut places: BTreeMap<_, Vec<&Sample>> = BTreeMap::new();
    for sample in gathered.samples.iter().filter(|sample| sample.x.is_finite() && sample.y.is_finite()) {
        places.entry((sample.group.0, bits(sample.x), bits(sample.y))).or_default().push(sample);
    }
    places
}

/// What stands for several runs in a cell, in words; none if no cell has several.
pub(super) fn shared(gathered: &Gathered, statistic: Statistic) -> Option<String> {
    let count = |runs: &Vec<&Sample>| runs.iter().filter(|run| run.value.is_some()).count();
    statistic.of_runs_per_cell(places(gathered).values().map(count))
}

pub(super) fn sheet(gathered: &Gathered, statistic: Statistic, scattered: bool) -> Result<Sheet, String> {
    let figure = &gathered.figure;
    let places = places(gathered);
    let value = |runs: &Vec<&Sample>| {
        let mut numbers: Vec<f64> = runs.iter().filter_map(|run| run.value).collect();
        numbers.sort_by(f64::total_cmp);
        statistic.of(&numbers)
    };
    let values: Vec<f64> = places.values().filter_map(value).collect();
    let colour = figure.colour.as_ref().ok_or("a phase map has colours")?;
    let colours =
        Colours::of(Scale::of(&colour.label, colour.log, 0.0, values.iter().copied()), On::Surfaces);

    let (xs, ys) = (sorted(places.keys().map(|(_, x, _)| *x)), sorted(places.keys().map(|(.., y)| *y)));
    let margin = if scattered { 0.06 } else { 0.0 };
    let scale = |quantity: &crate::Quantity, words: &Values, values: &[f64]| {
        if quantity.is_word {
            Scale::of_words(&quantity.label, &words.words())
        } else {
            let scale = Scale::of(&quantity.label, quantity.log, margin, values.iter().copied());
            let edges = scale.cell_edges(values);
            match (scattered, &edges[..]) {
                (false, [first, .., last]) => scale.reaching(*first, *last).marked_at(values),
                _ => scale,
            }
        }
    };
    let x = scale(&figure.x, &gathered.across, &xs);
    let y = scale(&figure.y, &gathered.upwards, &ys);
    let (edges_x, edges_y) = (x.cell_edges(&xs), y.cell_edges(&ys));
    let index = |all: &[f64], value: f64| all.partition_point(|other| *other < value);

    let layers = |panel: usize| {
        let (mut layers, mut cells) = (Vec::new(), Vec::new());
        let [mut none, mut no_run] = [Vec::new(), Vec::new()];
        for ((_, at_x, at_y), runs) in places.iter().filter(|((of, ..), _)| *of == panel) {
            let at = (f64::from_bits(*at_x), f64::from_bits(*at_y));
            let share = value(runs).and_then(|value| colours.scale.share(value));
            match share.map(|share| colours.at(share)) {
                Some(color) if scattered => layers.push(Layer::discs("", vec![at], DISC, color)),
                Some(color) => {
                    let (nx, ny) = (index(&xs, at.0), index(&ys, at.1));
                    cells.push(([(edges_x[nx], edges_y[ny]), (edges_x[nx + 1], edges_y[ny + 1])], color));
                }
                None if runs.iter().any(|run| run.done) => none.push(at),
                None => no_run.push(at),
            }
        }
        layers.extend((!cells.is_empty()).then(|| Layer::cells(cells)));
        layers.extend((!none.is_empty()).then(|| match scattered {
            true => Layer::marks("none", none, Marker::Circle, GREY),
            false => Layer::new("none", Shape::Cells(Vec::new()), plotters::prelude::WHITE),
        }));
        layers.extend((!no_run.is_empty()).then(|| Layer::marks("no run", no_run, Marker::Cross, GREY)));
        layers
    };
    Ok(Sheet { bar: Some(colours.clone()), ..Sheet::of(in_order(gathered, layers, &x, &y)) })
}

/// The panels in the order of their values, each with its title.
pub(super) fn in_order(
    gathered: &Gathered,
    mut layers: impl FnMut(usize) -> Vec<Layer>,
    x: &Scale,
    y: &Scale,
) -> Vec<Panel> {
    let mut panel = |n: usize| Panel::new(x.clone(), y.clone(), layers(n));
    let Some(facet) = &gathered.figure.facet else {
        return vec![panel(0)];
    };
    let title = |place: &Cell| {
        let (label, unit) = match facet.label.rfind(" (") {
            Some(at) if facet.label.ends_with(')') => facet.label.split_at(at),
            _ => (facet.label.as_str(), ""),
        };
        let value = place.number().map_or_else(|| place.to_string(), number);
        format!("{label} = {value}{}", unit.replace(['(', ')'], ""))
    };
    let order = gathered.panels.in_order().into_iter();
    order.map(|n| panel(n).titled(title(&gathered.panels.places[n]))).collect()
}

/// A key for ordered maps; positive and negative zero are one.
fn bits(value: f64) -> u64 {
    (value + 0.0).to_bits()
}

fn sorted(bits: impl Iterator<Item = u64>) -> Vec<f64> {
    let mut values: Vec<f64> = bits.map(f64::from_bits).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}
