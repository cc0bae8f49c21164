//! How small a step each sensor of a recording can see, and how large those are that it saw.

use std::collections::BTreeMap;

use asperity_numbers::quantile;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Marker, Pen, Sheet};

keys! {
    Noise: run;

}

impl Figure for Noise {
    of_one_run!(RequiredData { measured: true, ..RequiredData::arrivals() });

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let sensors = &run.header.sensors.clone().unwrap_or_default();
        let mut of_sensors: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
        for row in &run.noise {
            of_sensors.entry(row.sensor).or_default().push(row.sigma);
        }
        let steps = run.arrivals()?.iter().filter_map(|of| Some((of.x_m? * 1e3, of.step?.abs())));
        let mut layers = vec![Layer::discs("steps", steps.collect(), 3.5, GREY)];
        let least = |sigma: f64| sensors.least_step(sigma);
        let shown: [(_, _, _, &dyn Fn(f64) -> f64); 2] = [
            ("least step that counts", Marker::Triangle, BLUE, &least),
            ("noise σ", Marker::Circle, INK, &|sigma| sigma),
        ];
        for (label, marker, colour, value) in shown {
            let (mut medians, mut halves) = (Vec::new(), Vec::new());
            for (sensor, sigmas) in &mut of_sensors {
                let Some(x_mm) = sensors.x_m(*sensor).map(|x_m| x_m * 1e3) else { continue };
                sigmas.sort_by(f64::total_cmp);
                let at = |share| (x_mm, value(quantile(sigmas, share).unwrap_or_default()));
                medians.push(at(0.5));
                halves.extend([at(0.25), at(0.75), (f64::NAN, f64::NAN)]);
            }
            layers.push(Layer::line("", halves, Dash::Solid, colour));
            layers.push(Layer::marks(label, medians, marker, colour));
        }
        let unit = if sensors.are_of_slip { "m" } else { "unit of the sensors" };
        let y = Scale::free_powers(&format!("step ({unit})"));
        Ok(Sheet::single(Scale::between("x (mm)", 0.0, sensors.length_m * 1e3), y, layers))
    }
}
