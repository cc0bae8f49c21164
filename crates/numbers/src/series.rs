//! Events in series as solved, as the SEAS benchmarks define them: from where the largest speed of the blocks rises to
//! the event speed to where it falls below it, with its logarithm linear between rows. The grid of steps does not round
//! their times, and there is no hysteresis.

use asperity_record::{Series, SeriesBlock};

use crate::run_data::{OfSeries, RunEvents};

/// An event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Event {
    pub(crate) onset_s: f64,
    /// None of one that lasts to the end.
    pub(crate) end_s: Option<f64>,
    pub(crate) peak_m_per_s: f64,
    /// The fastest block in the first row.
    pub(crate) block: u32,
}

/// The events of a run with series, in order; of laws without a state there are none.
pub(crate) fn events(run: &RunEvents, series: &[Series]) -> Vec<Event> {
    let Some(law) = run.plan.friction.law.rate_and_state() else { return Vec::new() };
    let threshold = law.event_speed_m_per_s;
    let mut all: Vec<Event> = Vec::new();
    let crossing_s = |before: &Series, after: &Series| {
        let [a, b] = [before, after].map(|row| libm::log(row.v_max_m_per_s / threshold));
        before.time_s - a / (b - a) * (after.time_s - before.time_s)
    };
    for pair in series.windows(2) {
        let [before, after] = pair else { continue };
        let is_fast = [before, after].map(|row| row.v_max_m_per_s >= threshold);
        match (is_fast, all.last_mut()) {
            ([false, true], _) => all.push(Event {
                onset_s: crossing_s(before, after),
                end_s: None,
                peak_m_per_s: after.v_max_m_per_s,
                block: after.v_max_block,
            }),
            ([true, true], Some(last)) => last.peak_m_per_s = last.peak_m_per_s.max(after.v_max_m_per_s),
            ([true, false], Some(last)) => last.end_s = Some(crossing_s(before, after)),
            _ => {}
        }
    }
    all
}

/// The event of a number, counted from 1.
pub(crate) fn event(run: &RunEvents, (series, _): OfSeries<'_>, number: f64) -> Option<Event> {
    events(run, series).get((number as usize).checked_sub(1)?).copied()
}

/// Slip of the first block of the series from the onset to the end of an event, m, linear between rows.
pub(crate) fn first_slip_m(run: &RunEvents, of: OfSeries<'_>, number: f64) -> Option<f64> {
    let Event { onset_s, end_s, .. } = event(run, of, number)?;
    let first = of.1.first()?.block;
    let rows: Vec<&SeriesBlock> = of.1.iter().filter(|row| row.block == first).collect();
    let slip_m = |at_s: f64| {
        let after = rows.partition_point(|row| row.time_s < at_s);
        let (before, after) = (rows.get(after.checked_sub(1)?)?, rows.get(after)?);
        let way = (at_s - before.time_s) / (after.time_s - before.time_s);
        Some(before.slip_m + way * (after.slip_m - before.slip_m))
    };
    Some(slip_m(end_s?)? - slip_m(onset_s)?)
}

#[cfg(test)]
mod tests {
    use asperity_record::{Series, SeriesBlock};

    use crate::made_up;
    use crate::number::number;

    /// Speeds are whole powers of ten; the event speed is 1e-4 m/s.
    #[test]
    fn events_begin_and_end_where_the_logarithm_of_the_speed_passes() {
        let law = "friction.law = \"rate-and-state\"\nfriction.event_speed_m_per_s = 1e-4\ndrive.velocity_m_per_s = 1e-9";
        let mut run = made_up::run(law, &[]);
        let rows = [(0.0, 1e-9), (1.0, 1e-5), (2.0, 1e-2), (3.0, 1.0), (4.0, 1e-6), (9.0, 1e-3)];
        run.series = rows
            .map(|(time_s, v_max_m_per_s)| Series {
                time_s,
                v_max_m_per_s,
                v_max_block: 2,
                ..Series::default()
            })
            .to_vec();
        let slip = |(time_s, _): &(f64, f64)| SeriesBlock {
            time_s: *time_s,
            block: 3,
            slip_m: 2.0 * time_s,
            ..SeriesBlock::default()
        };
        run.series_blocks = rows.iter().map(slip).collect();
        let near = |name: &str, event: f64, expected: f64| {
            let found = number(name, &run, Some(event)).unwrap_or_else(|| panic!("no {name}"));
            assert!((found - expected).abs() < 1e-12, "{name}: {found}, not {expected}");
        };
        near("series_event_onset_s", 1.0, 1.0 + 1.0 / 3.0);
        near("series_event_duration_s", 1.0, 3.0 + 4.0 / 6.0 - 4.0 / 3.0);
        near("series_event_peak_velocity_m_per_s", 1.0, 1.0);
        near("series_event_slip_m", 1.0, 2.0 * (7.0 / 3.0));
        near("series_event_onset_s", 2.0, 4.0 + 5.0 * 2.0 / 3.0);
        near("series_event_count", 0.0, 2.0);
        for name in ["series_event_duration_s", "series_event_slip_m"] {
            assert_eq!(number(name, &run, Some(2.0)), None, "it lasts to the end");
        }
        assert_eq!(number("series_event_onset_s", &run, Some(3.0)), None);
    }
}
