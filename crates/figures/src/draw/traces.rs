//! The samples of all sensors of a recording about a rupture, each at the place of its sensor, with arrivals and the
//! front that is fitted to them.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Arrival, Rupture, Sensors, TraceRecord, short};

use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, Film, RuptureSelector, film};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, INK, Layer, Pen, Point, RED, Sheet};
use super::space_time::speeds_of_front;

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
            let (name, number) = (&run.name, rupture.rupture);
            return Err(format!("the log of run {name} has no samples of sensors about rupture {number}"));
        };
        let time_s = |record: &TraceRecord, n: u32| record.time_s + f64::from(n) * record.interval_s;
        let (from_s, to_s) = (first.time_s, time_s(last, last.samples));
        let clock = Clock::of(from_s, to_s, rupture.onset_s);
        let traces: Vec<(f64, Vec<Point>)> = (sensors.x_m.iter().enumerate())
            .map(|(n, x_m)| {
                let samples = records.iter().flat_map(|record| {
                    let values =
                        record.values.chunks(record.samples.max(1) as usize).nth(n).unwrap_or_default();
                    (0..).zip(values).map(|(n, value)| (time_s(record, n), *value))
                });
                (x_m * 1e3, from_rest(samples.collect(), rupture.onset_s))
            })
            .collect();
        let deviations = traces.iter().flat_map(|(_, trace)| trace).map(|(_, value)| value.abs());
        let largest = deviations.fold(f64::MIN_POSITIVE, f64::max);
        let length_mm = sensors.length_m * 1e3;
        let height_mm = HEIGHT * length_mm / sensors.x_m.len() as f64;
        let mut layers: Vec<Layer> = (traces.into_iter())
            .map(|(x_mm, trace)| {
                let up = |value: f64| x_mm + value / largest * height_mm;
                let points = trace.iter().map(|(time_s, value)| (clock.place(*time_s), up(*value))).collect();
                Layer::line("", points, Dash::Solid, INK)
            })
            .collect();
        let of_rupture = |of: &&Arrival| of.rupture == rupture.rupture;
        let arrivals: Vec<&Arrival> = run.arrivals()?.iter().filter(of_rupture).collect();
        for (label, front) in fronts(rupture, &arrivals, sensors) {
            let points = front.iter().map(|(time_s, x_m)| (clock.place(*time_s), x_m * 1e3)).collect();
            layers.push(Layer::line(label, points, Dash::Dashed, BLUE));
        }
        layers.extend(super::space_time::picks(
            &clock,
            &arrivals,
            |of| of.x_m.unwrap_or_default() * 1e3,
            RED,
        ));
        let unit = if sensors.are_of_slip { "m" } else { "units of the sensors" };
        layers.push(Layer::remark(format!("10 mm upwards: {} {unit}", short(10.0 * largest / height_mm))));
        let x = Scale::between(&clock.label("t"), clock.place(from_s), clock.place(to_s));
        let sheet = Sheet::single(x, Scale::between("x (mm)", 0.0, length_mm + height_mm), layers);
        Ok(sheet.titled(format!("rupture {}", rupture.rupture)))
    }
}

/// Samples less their mean before the onset, or the first where there is none.
fn from_rest(mut samples: Vec<Point>, onset_s: f64) -> Vec<Point> {
    let before = samples.partition_point(|(time_s, _)| *time_s < onset_s).clamp(1, samples.len().max(1));
    let rest: f64 = samples.iter().take(before).map(|(_, value)| value).sum::<f64>() / before as f64;
    samples.iter_mut().for_each(|(_, value)| *value -= rest);
    samples
}

/// The fronts towards either end, as straight lines of the speeds that were fitted through the median of the arrivals:
/// what each is called, and its ends, s and m.
fn fronts(rupture: &Rupture, arrivals: &[&Arrival], sensors: &Sensors) -> Vec<(String, Vec<Point>)> {
    let beginning = rupture.nucleation_block;
    let Some(from_m) = sensors.x_m(beginning) else { return Vec::new() };
    let sides = [(1.0, rupture.last_block), (-1.0, rupture.first_block)];
    let front = |((sign, end), (speed, words)): ((f64, u32), (f64, String))| {
        let way_s = |x_m: f64| sign * (x_m - from_m) / speed;
        let is_on_it = |of: &&&Arrival| (beginning.min(end)..=beginning.max(end)).contains(&of.block);
        let mut starts_s: Vec<f64> =
            (arrivals.iter().filter(is_on_it)).filter_map(|of| Some(of.arrival_s - way_s(of.x_m?))).collect();
        starts_s.sort_by(f64::total_cmp);
        let (start_s, to_m) = (starts_s.get(starts_s.len() / 2)?, sensors.x_m(end)?);
        Some((words, vec![(*start_s, from_m), (start_s + way_s(to_m), to_m)]))
    };
    let known = sides.into_iter().zip(speeds_of_front(rupture));
    known.filter_map(|(side, speed)| front((side, speed?))).collect()
}
