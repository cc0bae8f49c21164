//! The load curve with its ruptures, which have their numbers.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::Rupture;

use super::kind::{Figure, keys, levels, load_name, of_one_run};
use super::rupture_selector::{Clock, Sort, color_of, sorted};
use super::scale::Scale;
use super::sheet::{Dash, INK, Layer, Marker, Pen, Shape, Sheet};

keys! {
    LoadRuptures: run;

    /// Start of the time axis; by default that of the run.
    from_s: Option<f64>,
    /// End of the time axis; by default that of the run.
    to_s: Option<f64>,
}

impl Figure for LoadRuptures {
    of_one_run!(RequiredData::LOADS);

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        curve(run, self.from_s, self.to_s)
    }
}

/// Numbers side by side that fit across the panel.
const NUMBERS: f64 = 36.0;

/// A number stands no farther from its mark than so much of its width; others are left out.
const FARTHEST: f64 = 0.5;

/// The load curve of a run, or of a part of it.
pub(super) fn curve(run: &RunData, from_s: Option<f64>, to_s: Option<f64>) -> Result<Sheet, String> {
    let is_part = from_s.is_some() || to_s.is_some();
    let from_s = from_s.unwrap_or(0.0);
    let to_s = to_s.unwrap_or_else(|| run.plan.grid.time_s(run.header.steps));
    let in_view = |time_s: f64| (from_s..=to_s).contains(&time_s);
    let loads = run.loads()?.iter().filter(|load| in_view(load.time_s));
    let load: Vec<(f64, f64)> = loads.map(|load| (load.time_s, load.load_ratio())).collect();
    if load.is_empty() {
        return Err(format!("run {} has no records from {from_s} s to {to_s} s", run.name));
    }
    let ruptures = sorted(run)?;
    let clock = Clock::of(from_s, to_s, from_s);
    let place = |time_s: f64| clock.place(time_s);
    let (from, to) = (place(from_s), place(to_s));
    // A part of a run is shown as large as it is, the whole from zero to what contacts can bear.
    let is_free = is_part || run.is_measured();
    let whole = [0.0, run.plan.friction.static_coefficient].into_iter().filter(|_| !is_free);
    let ratios = || load.iter().map(|(_, ratio)| *ratio).chain(whole.clone());
    let (low, high) = (ratios().fold(f64::INFINITY, f64::min), ratios().fold(f64::NEG_INFINITY, f64::max));
    let height = (high - low).max(1e-9 * high.abs());
    let bottom = if low == 0.0 { 0.0 } else { low - 0.05 * height };
    let top = high + if is_part { 0.2 } else { 0.08 } * height;
    let mut layers = levels(run, |level| vec![(from, level), (to, level)]);
    layers.retain(|level| (bottom..=top).contains(&level.points()[0].1));
    let points = load.iter().map(|(time_s, ratio)| (place(*time_s), *ratio)).collect();
    layers.push(Layer::line("F_T/F_N", points, Dash::Solid, INK));
    // Others are too many for marks.
    for (sort, marker) in [(Sort::GlobalSlip, Marker::Square), (Sort::Precursor, Marker::Triangle)] {
        let of_sort = ruptures.iter().filter(|(rupture, of)| *of == sort && in_view(rupture.onset_s));
        let at = of_sort.map(|(rupture, _)| (place(rupture.onset_s), rupture.ft_fn_onset));
        let marks = Layer::marks(sort.label(), at.collect(), marker, color_of(sort));
        layers.extend((!marks.points().is_empty()).then_some(marks));
    }
    // Where they are crowded they move to the left, since the load rises to the right.
    let width = (to - from) / NUMBERS;
    let mut free_to = to;
    let is_numbered = |(rupture, sort): &&(&Rupture, Sort)| *sort != Sort::Other && in_view(rupture.onset_s);
    for (rupture, _) in ruptures.iter().rev().filter(is_numbered) {
        let at = place(rupture.onset_s);
        let beside = at.min(free_to);
        if at - beside <= FARTHEST * width && beside > from {
            let above = rupture.ft_fn_onset + 0.045 * (top - bottom);
            layers.push(Layer::new("", Shape::Words((beside, above), rupture.rupture.to_string()), INK));
            free_to = beside - width;
        }
    }
    let x = Scale::between(&clock.label("t"), from, to);
    let y = Scale::between(load_name(run)?, bottom, top);
    Ok(Sheet::single(x, y, layers))
}

#[cfg(test)]
mod tests {
    use super::{Shape, curve};
    use asperity_testkit::made_up::{self, EVENTS};

    #[test]
    fn precursors_and_global_slips_have_their_numbers() {
        let mut run = made_up::run("", &EVENTS);
        run.header.steps = 1000;
        made_up::with_ruptures(
            &mut run,
            &[
                &[(1, 100, Some(101))],
                &[(3, 200, Some(201))],
                &[(1, 300, Some(310)), (2, 301, Some(310))],
                &[(1, 306, Some(310)), (2, 307, Some(310)), (3, 308, Some(310))],
            ],
        );
        let shown = |from_s, to_s| {
            let sheet = curve(&run, from_s, to_s).unwrap();
            let marks = sheet.layers().filter_map(|layer| match &layer.shape {
                Shape::Marks(points, _) => Some(points.len()),
                _ => None,
            });
            let words = sheet.layers().filter_map(|layer| match &layer.shape {
                Shape::Words(_, words) => Some(words.clone()),
                _ => None,
            });
            (marks.collect::<Vec<usize>>(), words.collect::<Vec<String>>())
        };
        // Global slips are drawn above precursors; 2 and 3 are too close for both numbers.
        assert_eq!(shown(None, None), (vec![1, 2], vec!["3".to_owned(), "0".to_owned()]));
        assert_eq!(shown(Some(2.9e-5), Some(3.2e-5)).1, ["3", "2"]);
        assert_eq!(curve(&run, Some(1.0), None).unwrap_err(), "run test has no records from 1 s to 0.0001 s");
    }
}
