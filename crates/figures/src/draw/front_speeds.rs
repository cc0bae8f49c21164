//! How fast fronts ran everywhere in all ruptures: a histogram of local speeds, in which slow fronts show.

use std::ops::Range;

use asperity_numbers::fronts::{ACROSS, FROM_BLOCKS, SLOW, slow_ratio, speeds};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::front_stress::over;
use super::kind::{Figure, Group, keys, of_runs_in, overlaid, wave_speed_name};
use super::rupture_selector::no_ruptures;
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Panel, Pen, Point, Shape, Sheet, nth};

keys! {
    FrontSpeeds;

    /// Runs that belong together, such as those of several seeds. An ensemble stands for its runs.
    pub(super) series: Vec<Group>,
    /// Fewest blocks of a rupture that counts.
    #[serde(default = "super::kind::number::<FROM_BLOCKS>")]
    from_blocks: u32,
    /// Number of spacings over which a speed is taken.
    #[serde(default = "super::kind::number::<ACROSS>")]
    across: u32,
    /// Number of bins in a power of ten, 1 to 50.
    #[serde(default = "super::kind::number::<5>")]
    bins_per_decade: u32,
    /// The lower end of the axis of speeds, over `c`, in the lowest bin; by default that of the slowest
    /// front. Speeds beyond an end count in all shares, and the legend has their number.
    from_speed: Option<f64>,
    /// The upper end of the axis of speeds, over `c`, in the highest bin; by default that of the fastest
    /// front, or 10 where it is lower: blocks on an earlier peak of stress slide before a front comes.
    to_speed: Option<f64>,
}

impl FrontSpeeds {
    /// Where a speed, or an end of the axis, stands: in bins from the wave speed.
    fn place(&self, speed: f64) -> f64 {
        f64::from(self.bins_per_decade) * speed.log10()
    }

    /// The bins on the axis; each holds its lower end.
    fn bins(&self, all: &[f64]) -> Range<i64> {
        let bin = |speed: &f64| self.place(*speed).floor() as i64;
        // The line of slow fronts is on the axis.
        let from = all.iter().map(bin).fold(bin(&SLOW) - 1, i64::min);
        let to = (all.iter().map(bin).fold(bin(&SLOW), i64::max) + 1).min(bin(&FASTEST));
        let from = self.from_speed.map_or(from, |speed| bin(&speed));
        from..self.to_speed.map_or(to, |speed| self.place(speed).ceil() as i64).max(from + 1)
    }

    /// The lower end of a bin, or a place within.
    fn edge(&self, place: f64) -> f64 {
        10f64.powf(place / f64::from(self.bins_per_decade))
    }

    /// The share of speeds in each bin.
    fn shares(&self, speeds: &[f64], bins: &Range<i64>) -> Vec<f64> {
        let places: Vec<f64> = speeds.iter().map(|speed| self.place(*speed).floor()).collect();
        let count = |bin: i64| places.iter().filter(|place| **place == bin as f64).count();
        bins.clone().map(|bin| count(bin) as f64 / speeds.len() as f64).collect()
    }

    /// The outline of all bins.
    fn outline(&self, shares: &[f64], bins: &Range<i64>) -> Vec<Point> {
        let edge = |bin: i64| self.edge(bin as f64);
        let steps =
            bins.clone().zip(shares).flat_map(|(bin, share)| [bin, bin + 1].map(|at| (edge(at), *share)));
        let ends = [bins.start, bins.end].map(|bin| (edge(bin), 0.0));
        ends[..1].iter().copied().chain(steps).chain([ends[1]]).collect()
    }

    /// A line from the smallest to the largest share in a run for each bin, at this place within it, with gaps between.
    fn whiskers(&self, runs: &[Vec<f64>], bins: &Range<i64>, within: f64) -> Vec<Point> {
        let runs = runs.iter().filter(|speeds| !speeds.is_empty());
        let shares: Vec<Vec<f64>> = runs.map(|speeds| self.shares(speeds, bins)).collect();
        let whisker = |(n, bin): (usize, i64)| {
            let of_runs = || shares.iter().map(|shares| shares[n]);
            let (least, most) = (of_runs().fold(1.0, f64::min), of_runs().fold(0.0, f64::max));
            let at = self.edge(bin as f64 + within);
            let line = [(at, least), (at, most), (f64::NAN, f64::NAN)];
            line.into_iter().filter(move |_| most > least)
        };
        bins.clone().enumerate().flat_map(whisker).collect()
    }
}

/// What the legend says of a group.
fn words(label: &str, speeds: &[f64]) -> String {
    let slow = slow_ratio(speeds).map(|share| {
        let percent = 100.0 * share;
        let decimals = usize::from(percent > 0.0 && percent < 10.0);
        format!(", {percent:.decimals$} % slow")
    });
    format!("{label}: {}{}", speeds.len(), slow.unwrap_or_default())
}

impl Figure for FrontSpeeds {
    of_runs_in!(series);

    fn check(&self) -> Result<(), String> {
        let refused = |key: &str, value: f64, accepted: &str| {
            Err(format!("{key} = {value} is not accepted (accepted: {accepted})"))
        };
        let (from, to) = (self.from_speed.unwrap_or(1e-300), self.to_speed.unwrap_or(1e300));
        if !(1..=50).contains(&self.bins_per_decade) {
            return refused("bins_per_decade", f64::from(self.bins_per_decade), "1 to 50");
        }
        if !(from >= 1e-300 && from < to) {
            return refused("from_speed", from, "a number above 0 and below to_speed");
        }
        if !(to > from && to <= 1e300) {
            return refused("to_speed", to, "a number above from_speed");
        }
        Ok(())
    }

    fn required_data(&self) -> RequiredData {
        RequiredData::arrivals()
    }

    /// The speeds of a run, which become shares together with those of others.
    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let speeds = speeds(run, run.arrivals()?, self.from_blocks, self.across.max(1));
        let speeds = speeds.ok_or_else(|| no_ruptures(run))?;
        Ok(of_run(pen, &speeds, wave_speed_name(run), over(run, self.across)))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let speeds = |part: &Sheet| part.panels[0].layers[0].points().iter().map(|point| point.0).collect();
        let of_runs: Vec<Vec<f64>> = parts.iter().map(speeds).collect();
        let all = of_runs.concat();
        if all.is_empty() {
            return Err(format!(
                "no rupture of {} blocks or more has a front over {} spacings",
                self.from_blocks, self.across
            ));
        }
        let bins = self.bins(&all);
        let (mut surfaces, mut lines, mut whiskers) = (Vec::new(), Vec::new(), Vec::new());
        let mut from = 0;
        for (index, group) in self.series.iter().enumerate() {
            let (_, dash, color) = nth(index);
            let runs = &of_runs[from..from + group.runs.len()];
            from += group.runs.len();
            let together = runs.concat();
            let label = words(&group.label, &together);
            let mut outline = self.outline(&self.shares(&together, &bins), &bins);
            outline.retain(|_| !together.is_empty());
            surfaces.push(Layer::surface("", outline.clone(), 0.13, color));
            lines.push(Layer::line(label, outline, dash, color));
            // Those of groups are side by side in a bin.
            let within = (index as f64 + 1.0) / (self.series.len() as f64 + 1.0);
            let of_group = self.whiskers(runs, &bins, within);
            whiskers.extend((!of_group.is_empty()).then(|| Layer::line("", of_group, Dash::Solid, color)));
        }
        if !whiskers.is_empty() {
            whiskers.push(Layer::remark("whiskers: range over runs"));
        }
        lines.append(&mut whiskers);
        let shares = lines.iter().flat_map(Layer::points).map(|(_, share)| share);
        // Where all speeds are beyond the axis, it has no share.
        let top = 1.08 * Some(shares.fold(0.0, f64::max)).filter(|top| *top > 0.0).unwrap_or(1.0);
        let (from, to) = (self.edge(bins.start as f64), self.edge(bins.end as f64));
        let Panel { x, layers, .. } = overlaid(parts).panels.remove(0);
        for layer in layers {
            match layer.shape {
                Shape::Line(..) if (from..to).contains(&SLOW) => {
                    let course = vec![(SLOW, 0.0), (SLOW, top)];
                    surfaces.push(Layer::line(layer.label, course, Dash::Dashed, GREY));
                }
                Shape::Remark => lines.push(layer),
                _ => {}
            }
        }
        let beyond = all.iter().filter(|speed| !bins.contains(&(self.place(**speed).floor() as i64))).count();
        lines.extend((beyond > 0).then(|| Layer::remark(format!("beyond the axis: {beyond}"))));
        surfaces.extend(lines);
        let x = Scale::of(&x.label(), true, 0.0, [from, to].into_iter());
        let y = Scale::between("share of local front speeds", 0.0, top);
        Ok(Sheet::single(x, y, surfaces))
    }
}

/// The speeds of a run, what is slow among them, and what they are taken over.
fn of_run(pen: Pen<'_>, speeds: &[f64], c: &str, over: String) -> Sheet {
    let speeds = speeds.iter().map(|speed| (*speed, 0.0)).collect();
    let slow = Layer::line(format!("slow: v < {SLOW} {c}"), Vec::new(), Dash::Dashed, GREY);
    let x = Scale::free_powers(&format!("local front speed v/{c}"));
    Sheet::single(x, Scale::free(""), vec![pen.marks(speeds), slow, Layer::remark(over)])
}

/// The upper end of the axis at most, over `c`, unless the figure states it.
const FASTEST: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::{Figure, FrontSpeeds, Pen, Sheet, of_run};
    use crate::draw::sheet::Shape;
    use asperity_testkit::made_up;

    fn figure(keys: &str) -> FrontSpeeds {
        let series = "series = [{ label = \"A\", runs = [\"a\", \"b\"] }, { label = \"B\", runs = [\"c\"] }]";
        toml::from_str(&format!("file = \"f.png\"\n{keys}\n{series}")).unwrap()
    }

    fn parts() -> Vec<Sheet> {
        let part = |speeds: &[f64]| of_run(Pen::nth(0, ""), speeds, "c_S", "over 4 spacings".to_owned());
        vec![part(&[0.05, 0.1, 0.12, 2.0]), part(&[0.05, 0.06]), part(&[])]
    }

    fn words(figure: &FrontSpeeds) -> Vec<String> {
        figure.sheet(parts()).unwrap().labels()
    }

    /// Five bins in a power of ten: 0.05 and 0.06 share that from 0.0398 to 0.0631, and 0.1 begins one.
    #[test]
    fn shares_are_those_of_all_runs_of_a_group_and_whiskers_those_of_each() {
        let sheet = figure("").sheet(parts()).unwrap();
        let line =
            |shape: &Shape| if let Shape::Line(points, _) = shape { Some(points.clone()) } else { None };
        let is_shown = |points: &Vec<(f64, f64)>| !points.is_empty();
        let lines: Vec<_> = sheet.layers().filter_map(|layer| line(&layer.shape)).filter(is_shown).collect();
        let mut steps = lines[1].clone();
        steps.retain(|(_, share)| *share > 0.0);
        let shares: Vec<f64> = steps.iter().step_by(2).map(|(_, share)| *share).collect();
        assert_eq!(shares, [0.5, 1.0 / 3.0, 1.0 / 6.0], "three of six, two and one");
        let is = |place: f64, expected: f64| (place / 10f64.powf(expected) - 1.0).abs() < 1e-12;
        assert!(is(steps[0].0, -1.4) && is(steps[1].0, -1.2) && is(steps[2].0, -1.0), "{steps:?}");
        // From a quarter of run a to all of run b; and between a half, or a quarter, and none.
        let ranges: Vec<(f64, f64)> = lines[2].chunks(3).map(|line| (line[0].1, line[1].1)).collect();
        assert_eq!(ranges, [(0.25, 1.0), (0.0, 0.5), (0.0, 0.25)]);
        assert_eq!(
            words(&figure("")),
            ["slow: v < 0.1 c_S", "A: 6, 50 % slow", "B: 0", "whiskers: range over runs", "over 4 spacings"]
        );
    }

    #[test]
    fn speeds_beyond_a_stated_end_count_and_bad_ends_are_refused() {
        let narrow = words(&figure("from_speed = 0.09\nto_speed = 1"));
        assert_eq!((narrow[1].as_str(), narrow[5].as_str()), ("A: 6, 50 % slow", "beyond the axis: 4"));
        let none = words(&figure("from_speed = 7\nto_speed = 8"));
        assert!(none.contains(&"beyond the axis: 6".to_owned()), "{none:?}");
        let check = |keys: &str| figure(keys).check().unwrap_err();
        assert_eq!(
            check("from_speed = 0"),
            "from_speed = 0 is not accepted (accepted: a number above 0 and below to_speed)"
        );
        assert!(check("from_speed = 2\nto_speed = 1").contains("below to_speed"));
        assert!(check("to_speed = inf").contains("to_speed = inf is not accepted"));
        assert!(check("bins_per_decade = 51").ends_with("(accepted: 1 to 50)"));
        figure("from_speed = 0.001\nto_speed = 10").check().unwrap();
        assert_eq!(figure("").bins(&[0.5, 0.7, 2000.0]), -6..5, "up to 10 c");
    }

    #[test]
    fn a_run_has_speeds_only_in_ruptures_of_enough_blocks() {
        let mut run = made_up::run("", &[]);
        let figure = figure("from_blocks = 3\nacross = 2");
        assert!(figure.part(&run, Pen::nth(0, "")).is_err_and(|why| why.contains("has no ruptures")));
        made_up::with_ruptures(&mut run, &[&[(1, 10, None), (2, 20, None), (3, 30, None)], &[(1, 50, None)]]);
        let part = figure.part(&run, Pen::nth(0, "")).unwrap();
        assert_eq!(part.panels[0].layers[0].points().len(), 1);
        assert_eq!(part.panels[0].x.label(), "local front speed v/c");
        let none = parts().split_off(2);
        assert_eq!(
            figure.together(none).unwrap_err(),
            "no rupture of 3 blocks or more has a front over 2 spacings"
        );
    }
}
