//! What a page says of a recording: in place of a model and its parameters, what was measured and how well.

use asperity_numbers::median;
use asperity_record::Sensors;

use crate::claims::link;
use crate::html::markup::counted;
use crate::study::Run;
use crate::symbols::rounded;

/// The section on what was measured in runs, without those that are no recordings.
pub(crate) fn section(runs: &[Run]) -> String {
    let of = |run: &Run| Some(slider(run, run.header.sensors.as_ref()?));
    runs.iter().filter_map(of).collect()
}

/// What was measured, and how small a step its noise allows to see.
fn slider(run: &Run, sensors: &Sensors) -> String {
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
    let noise = median(run.noise.iter().map(|noise| noise.sigma)).map_or_else(String::new, |sigma| {
        let [sigma, least] = [sigma, sensors.least_step(sigma)].map(|size| rounded(size, 3) + unit);
        format!(" The noise of the sensors has a scatter of {sigma}, and steps from {least} on count: medians over their parts.")
    });
    format!(
        "<p>{}: a slider of {} mm, in which waves run at {} m/s{array}.{noise} What no sensor measured is not here: \
         parameters, theory, energies.</p>\n",
        link(&run.name),
        mm(&sensors.length_m),
        rounded(run.header.scales.wave_speed_m_per_s(), 5),
    )
}

/// Whether runs are recordings of forces alone, which have no ruptures.
pub(crate) fn are_forces(runs: &[Run]) -> bool {
    runs.iter().all(|run| run.header.sensors.as_ref().is_some_and(|sensors| sensors.x_m.is_empty()))
}

/// How often the load fell, by how much, and how long after the fall before.
pub(crate) fn fell(run: &Run) -> [String; 2] {
    let of = run.summary.of_recording.clone().unwrap_or_default();
    let medians = of.median_load_drop_n.zip(of.median_load_drop_recurrence_s);
    let medians = medians.map_or_else(String::new, |(size_n, recurrence_s)| {
        format!("by {} N, {} s apart (medians)", rounded(size_n, 3), rounded(recurrence_s, 3))
    });
    [of.load_drop_count.map_or("no force".to_owned(), |count| count.to_string()), medians]
}
