//! What a page says of a recording: in place of a model and its parameters, what was measured and how well.

use asperity_numbers::median;
use asperity_record::{Event, LoadDrop, LoadNoise, Noise, Observer, Record, Sensors};

use crate::claims::link;
use crate::html::markup::counted;
use crate::study::Run;
use crate::symbols::{lettered, rounded};

/// Noise and load drops of a recording.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measured {
    /// Scatter of the step statistic of the sensors in the parts of their stream.
    noise: Vec<f64>,
    /// Likewise of `F_T`, N.
    load_noise_n: Vec<f64>,
    drops: Vec<LoadDrop>,
}

impl Observer for Measured {
    fn record(&mut self, record: &Record) {
        if let Record::Row(row) = record {
            self.noise.extend(row.values.get::<Noise>().map(|noise| noise.sigma));
            self.load_noise_n.extend(row.values.get::<LoadNoise>().map(|noise| noise.sigma_n));
        }
    }

    fn event(&mut self, event: &Event) {
        self.drops.extend(event.get::<LoadDrop>().cloned());
    }
}

/// The section on what was measured in runs, without those that are no recordings.
pub(crate) fn section(runs: &[Run]) -> String {
    let of = |run: &Run| Some(slider(run, run.header.sensors.as_ref()?));
    runs.iter().filter_map(of).collect()
}

/// What was measured, and how small a step its noise allows to see.
fn slider(run: &Run, sensors: &Sensors) -> String {
    let Measured { noise, load_noise_n, .. } = &run.collected.measured;
    let mm = |at_m: &f64| rounded(at_m * 1e3, 4);
    let unit = if sensors.are_of_slip { " m" } else { "" };
    let array = sensors.x_m.first().zip(sensors.x_m.last()).map_or_else(String::new, |(first_m, last_m)| {
        let count = counted(sensors.x_m.len() as u64, "sensor");
        format!(
            ", with {count}{} from {} to {} mm",
            if sensors.are_of_slip { " of slip" } else { "" },
            mm(first_m),
            mm(last_m)
        )
    });
    let noise = median(noise.iter().copied()).map_or_else(String::new, |sigma| {
        let least = rounded(sensors.least_step(sigma), 3);
        format!(
            " The noise of the sensors has a scatter of {}{unit}; steps from {least}{unit} on count.",
            rounded(sigma, 3)
        )
    });
    let of_load = median(load_noise_n.iter().copied()).map_or_else(String::new, |sigma_n| {
        format!(" That of {} has {} N.", lettered("F_T"), rounded(sigma_n, 3))
    });
    format!(
        "<p>{}: a slider of {} mm, in which waves run at {} m/s{array}.{noise}{of_load} These are medians over the parts of \
         streams. What no sensor measured is not here: parameters, theory, energies.</p>\n",
        link(&run.name),
        mm(&sensors.length_m),
        rounded(run.header.scales.wave_speed_m_per_s(), 5),
    )
}

/// How often the load fell, by how much, and how long after the fall before.
pub(crate) fn fell(run: &Run) -> [String; 2] {
    let drops = &run.collected.measured.drops;
    let size_n = median(drops.iter().map(|drop| drop.drop_n));
    let recurrence_s = median(drops.iter().filter_map(|drop| drop.recurrence_s));
    let medians = size_n.zip(recurrence_s).map_or_else(String::new, |(size_n, recurrence_s)| {
        format!("by {} N, {} s apart (medians)", rounded(size_n, 3), rounded(recurrence_s, 3))
    });
    [drops.len().to_string(), medians]
}
