//! How small a step each sensor of a recording can see, and how large those are that it saw.

use std::collections::BTreeMap;

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::Noise as Row;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Marker, Pen, Sheet};

keys! {
    Noise: run;

}

impl Figure for Noise {
    of_one_run!(RequiredData { measured: true, ..RequiredData::arrivals() });

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let Some(sensors) = &run.header.sensors else {
            return Err(format!("run {} has no sensors (accepted: a recording)", run.name));
        };
        let mut of_sensors: BTreeMap<u32, Vec<&Row>> = BTreeMap::new();
        for row in run.measured()?.1 {
            row.sensor.iter().for_each(|sensor| of_sensors.entry(*sensor).or_default().push(row));
        }
        let steps = run.arrivals()?.iter().filter_map(|of| Some((of.x_m? * 1e3, of.step?.abs())));
        let mut layers = vec![Layer::discs("steps", steps.collect(), 3.5, GREY)];
        let shown: [(_, fn(&Row) -> f64, _, _); 2] = [
            ("least step that counts", |row| row.sigma, Marker::Triangle, BLUE),
            ("noise σ", |row| row.sigma, Marker::Circle, INK),
        ];
        for (label, value, marker, colour) in shown {
            let (mut medians, mut ranges) = (Vec::new(), Vec::new());
            for (sensor, rows) in &of_sensors {
                let Some(x_mm) = sensors.x_m(*sensor).map(|x_m| x_m * 1e3) else { continue };
                let mut all: Vec<f64> = rows.iter().map(|row| value(row)).collect();
                all.sort_by(f64::total_cmp);
                medians.push((x_mm, all[all.len() / 2]));
                ranges.extend([(x_mm, all[0]), (x_mm, all[all.len() - 1]), (f64::NAN, f64::NAN)]);
            }
            layers.push(Layer::line("", ranges, Dash::Solid, colour));
            layers.push(Layer::marks(label, medians, marker, colour));
        }
        let unit = if sensors.are_of_slip { "m" } else { "unit of the sensors" };
        let y = Scale::free_powers(&format!("step ({unit})"));
        Ok(Sheet::single(Scale::between("x (mm)", 0.0, sensors.length_m * 1e3), y, layers))
    }
}
