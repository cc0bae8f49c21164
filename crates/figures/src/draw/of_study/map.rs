//! Phase maps: a number as colour over two keys.

use std::collections::BTreeMap;

use asperity_record::Cell;

use super::gather::{Gathered, Values};
use crate::Statistic;
use crate::draw::colours::{Colours, On};
use crate::draw::scale::{Scale, number};
use crate::draw::sheet::{GREY, Layer, Marker, Panel, Point, Shape, Sheet, Tile};

/// The radius of a place where places are scattered.
const DISC: f64 = 22.0;

/// What is in a place: the numbers of its runs, and whether any of them is done.
#[derive(Debug, Default)]
struct Spot {
    numbers: Vec<f64>,
    done: bool,
}

/// What a panel shows: values, and the places without one.
#[derive(Default)]
struct Shown {
    discs: Vec<Layer>,
    cells: Vec<Tile>,
    none: Vec<Point>,
    no_run: Vec<Point>,
}

/// The places of the map, by panel, x and y.
fn spots(gathered: &Gathered) -> BTreeMap<(usize, u64, u64), Spot> {
    let mut spots: BTreeMap<(usize, u64, u64), Spot> = BTreeMap::new();
    for sample in gathered.samples.iter().filter(|sample| sample.x.is_finite() && sample.y.is_finite()) {
        let spot = spots.entry((sample.group.0, bits(sample.x), bits(sample.y))).or_default();
        spot.numbers.extend(sample.value);
        spot.done |= sample.done;
    }
    spots
}

/// What stands for several runs in a cell, in words; none if no cell has several.
pub(super) fn shared(gathered: &Gathered, statistic: Statistic) -> Option<String> {
    statistic.of_runs_per_cell(spots(gathered).values().map(|spot| spot.numbers.len()))
}

pub(super) fn sheet(gathered: &Gathered, statistic: Statistic, scattered: bool) -> Result<Sheet, String> {
    let figure = &gathered.figure;
    let mut spots = spots(gathered);
    for spot in spots.values_mut() {
        spot.numbers.sort_by(f64::total_cmp);
    }
    let value = |spot: &Spot| statistic.of(&spot.numbers);
    let values: Vec<f64> = spots.values().filter_map(value).collect();
    let colour = figure.colour.as_ref().ok_or("a phase map has colours")?;
    let colours =
        Colours::of(Scale::of(&colour.label, colour.log, 0.0, values.iter().copied()), On::Surfaces);

    let (xs, ys) = (sorted(spots.keys().map(|(_, x, _)| *x)), sorted(spots.keys().map(|(.., y)| *y)));
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

    let mut panels: BTreeMap<usize, Shown> = BTreeMap::new();
    for ((panel, at_x, at_y), spot) in &spots {
        let at = (f64::from_bits(*at_x), f64::from_bits(*at_y));
        let Shown { discs, cells, none, no_run } = panels.entry(*panel).or_default();
        match value(spot).and_then(|value| colours.of_number(value)) {
            Some(color) if scattered => discs.push(Layer::discs("", vec![at], DISC, color)),
            Some(color) => {
                let (nx, ny) = (index(&xs, at.0), index(&ys, at.1));
                cells.push(([(edges_x[nx], edges_y[ny]), (edges_x[nx + 1], edges_y[ny + 1])], color));
            }
            None if spot.done => none.push(at),
            None => no_run.push(at),
        }
    }
    let layers = |Shown { discs: mut layers, cells, none, no_run }: Shown| {
        layers.extend((!cells.is_empty()).then(|| Layer::cells(cells)));
        layers.extend((!none.is_empty()).then(|| match scattered {
            true => Layer::marks("none", none, Marker::Circle, GREY),
            false => Layer::new("none", Shape::Cells(Vec::new()), plotters::prelude::WHITE),
        }));
        layers.extend((!no_run.is_empty()).then(|| Layer::marks("no run", no_run, Marker::Cross, GREY)));
        layers
    };
    let panels = panels.into_iter().map(|(panel, shown)| (panel, layers(shown))).collect();
    Ok(Sheet { bar: Some(colours), ..Sheet::of(in_order(gathered, panels, &x, &y)) })
}

/// The panels in the order of their values, each with its title.
pub(super) fn in_order(
    gathered: &Gathered,
    mut layers: BTreeMap<usize, Vec<Layer>>,
    x: &Scale,
    y: &Scale,
) -> Vec<Panel> {
    let mut panel = |n: usize| Panel::new(x.clone(), y.clone(), layers.remove(&n).unwrap_or_default());
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
