//! The samples of all sensors of a recording about a rupture, each at the place of its sensor, with arrivals and the
//! front that is fitted to them.

use asperity_numbers::median;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Arrival, TraceRecord, rounded};

use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, Film, RuptureSelector, film};
use super::scale::{Scale, number};
use super::sheet::{BLUE, Dash, INK, Layer, Pen, Point, RED, Sheet};
use super::space_time::{picks, speeds_of_front};

keys! {
    Traces: run;

    /// The number of the rupture, as in its table.
    rupture: Option<u64>,
    /// The rupture, where `rupture` gives no number; if absent that at most sensors.
    which: Option<RuptureSelector>,
}

/// How high the largest deviation is drawn, in mean distances of sensors.
const HEIGHT: f64 = 1.5;

impl Traces {
    fn film(&self) -> Result<Film, String> {
        film(self.rupture, self.which, 0, None)
    }
}

impl Figure for Traces {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { traces: self.film().into_iter().collect(), ..RequiredData::arrivals() }
    }

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let rupture = self.film()?.rupture(run)?;
        let of_rupture = |record: &&TraceRecord| record.rupture == rupture.rupture;
        let records: Vec<&TraceRecord> = run.traces.iter().filter(of_rupture).collect();
        let (Some(sensors), Some((first, last))) = (&run.header.sensors, records.first().zip(records.last()))
        else {
            return Ok(Sheet::single(Scale::free("t (s)"), Scale::free("x (mm)"), Vec::new()));
        };
        let time_s = |record: &TraceRecord, n: u32| record.time_s + f64::from(n) * record.interval_s;
        let (from_s, to_s) = (first.time_s, time_s(last, last.samples));
        let clock = Clock::of(from_s, to_s, rupture.onset_s);
        let trace = |(n, x_m): (usize, &f64)| {
            let samples = records.iter().flat_map(|record| {
                let values = record.values.chunks(record.samples.max(1) as usize).nth(n).unwrap_or_default();
                (0..).zip(values).map(|(n, value)| (time_s(record, n), *value))
            });
            let samples: Vec<Point> = samples.collect();
            let before =
                samples.iter().filter(|(time_s, _)| *time_s < rupture.onset_s).map(|(_, value)| *value);
            (x_m * 1e3, median(before).unwrap_or_default(), samples)
        };
        let traces: Vec<_> = sensors.x_m.iter().enumerate().map(trace).collect();
        let largest =
            traces.iter().flat_map(|(_, rest, samples)| samples.iter().map(move |of| (of.1 - rest).abs()));
        let largest = largest.fold(f64::MIN_POSITIVE, f64::max);
        let length_mm = sensors.length_m * 1e3;
        let height_mm = HEIGHT * length_mm / sensors.x_m.len() as f64;
        let mut layers = Vec::new();
        for (x_mm, rest, samples) in &traces {
            let up = |value: f64| x_mm + (value - rest) / largest * height_mm;
            let points = samples.iter().map(|(time_s, value)| (clock.place(*time_s), up(*value))).collect();
            layers.push(Layer::line("", points, Dash::Solid, INK));
        }
        let of_rupture = |of: &&Arrival| of.rupture == rupture.rupture;
        let arrivals: Vec<Arrival> = run.arrivals()?.iter().filter(of_rupture).cloned().collect();
        // Straight lines of the speeds that were fitted, through the median of the arrivals.
        let (beginning, sides) =
            (rupture.nucleation_block, [(1.0, rupture.last_block), (-1.0, rupture.first_block)]);
        for ((sign, end), front) in sides.into_iter().zip(speeds_of_front(rupture)) {
            let ends_m = sensors.x_m(beginning).zip(sensors.x_m(end));
            let (Some(speed), Some((from_m, to_m))) = (front, ends_m) else { continue };
            let way_s = |x_m: f64| sign * (x_m - from_m) / speed.value;
            let on_it =
                arrivals.iter().filter(|of| (beginning.min(end)..=beginning.max(end)).contains(&of.block));
            let start_s =
                median(on_it.filter_map(|of| Some(of.arrival_s - way_s(of.x_m?)))).unwrap_or_default();
            let ends = [from_m, to_m].map(|x_m| (clock.place(start_s + way_s(x_m)), x_m * 1e3));
            layers.push(Layer::line(format!("front, {speed} m/s"), ends.into(), Dash::Dashed, BLUE));
        }
        layers.extend(picks(&clock, &arrivals, |of| of.x_m.unwrap_or_default() * 1e3, RED));
        let unit = if sensors.are_of_slip { "m" } else { "units of the sensors" };
        layers.push(Layer::remark(format!(
            "10 mm upwards: {} {unit}",
            number(rounded(10.0 * largest / height_mm, 2))
        )));
        let x = Scale::between(&clock.label("t"), clock.place(from_s), clock.place(to_s));
        let sheet = Sheet::single(x, Scale::between("x (mm)", 0.0, length_mm + height_mm), layers);
        Ok(sheet.titled(format!("rupture {}", rupture.rupture)))
    }
}
