//! Velocities of the blocks of a dense window through a slip event, and the number of
//! sliding blocks beneath (Figures A.1, A.2).

use asperity_numbers::curves::event_in_window;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{Dash, GREY, INK, Layer, Panel, Sheet, nth};

keys! {
    Velocities: run;

    /// The length of the event; the nearest one within the dense window is shown.
    blocks: u32,
}

/// How much of the axis lies before the event and after it, over its duration.
const BEFORE: f64 = 0.08;
const AFTER: f64 = 0.12;

impl Figure for Velocities {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData::WINDOWS
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let missing = || format!("run {} has no slip event that begins and ends in a dense window", run.name);
        let event = event_in_window(run, f64::from(self.blocks)).ok_or_else(missing)?;
        let duration_s = event.end_s.ok_or_else(missing)? - event.onset_s;
        // Milliseconds, or microseconds where these would be small fractions.
        let (unit, per_second) = if duration_s >= 1e-3 { ("ms", 1e3) } else { ("μs", 1e6) };
        let since = |time_s: f64| (time_s - event.onset_s) * per_second;
        let (from, to) = (-BEFORE * duration_s * per_second, (1.0 + AFTER) * duration_s * per_second);
        // Up to the next event, so that no other takes over the axes.
        let next_step = run.slips.iter().map(|slip| slip.onset_step).find(|step| *step > event.onset_step);
        let records: Vec<_> = run
            .windows()?
            .iter()
            .filter(|record| record.window == 0 && (from..=to).contains(&since(record.time_s)))
            .take_while(|record| next_step.is_none_or(|step| record.step < step))
            .collect();
        let first = records.first().ok_or_else(missing)?;
        // The axes end with what is shown.
        let to = records.last().map_or(to, |last| since(last.time_s));
        let from = since(first.time_s);
        let mut series: Vec<Layer> = (0..first.velocity_m_per_s.len())
            .map(|index| {
                let (_, dash, color) = nth(index);
                let speed = |velocity_m_per_s: &[f64]| velocity_m_per_s[index] * 1e3;
                Layer::line(
                    format!("block {}", first.first_block as usize + index),
                    records
                        .iter()
                        .map(|record| (since(record.time_s), speed(&record.velocity_m_per_s)))
                        .collect(),
                    dash,
                    color,
                )
            })
            .collect();
        series.insert(0, Layer::line("", vec![(from, 0.0), (to, 0.0)], Dash::Dotted, GREY));
        let sliding: Vec<(f64, f64)> =
            records.iter().map(|record| (since(record.time_s), f64::from(record.sliding))).collect();
        let most = sliding.iter().fold(1.0f64, |most, (_, count)| most.max(*count));
        let x = Scale::between("", from, to);
        let upper =
            Panel::new(x, Scale::free("v_n (mm/s)"), series).noted(&format!("t_0 = {:.5} s", event.onset_s));
        let x = Scale::between(&format!("t − t_0 ({unit})"), from, to);
        let y = Scale::counts("blocks sliding", most);
        let series = vec![Layer::line("", sliding, Dash::Solid, INK)];
        let lower = Panel::new(x, y, series);
        Ok(Sheet::stacked(upper, lower))
    }
}
