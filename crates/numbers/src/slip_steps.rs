//! When slip events began and ended: all that a reduction keeps of each, so that it can have millions of them.

use asperity_record::SlipEvent;

/// Onsets, ends and numbers of slip events, in order.
#[derive(Debug, Clone, Default)]
pub struct SlipSteps {
    /// First step, and the step after the last; the largest number of those that are open.
    pub(crate) spans: Vec<(u64, u64)>,
    /// Their numbers, which have gaps in salvaged logs; four bytes count more than memory holds.
    numbers: Vec<u32>,
}

impl SlipSteps {
    /// Adds the next event.
    pub fn push(&mut self, slip: &SlipEvent) {
        self.spans.push((slip.onset_step, slip.end_step.unwrap_or(u64::MAX)));
        self.numbers.push(slip.event.try_into().unwrap_or(u32::MAX));
    }

    /// The event in progress at a step: its number and its onset.
    pub fn event_at(&self, step: u64) -> Option<(u64, u64)> {
        let place = self.spans.partition_point(|(onset, _)| *onset <= step).checked_sub(1)?;
        let (onset, end) = self.spans[place];
        (step < end).then(|| (self.numbers[place].into(), onset))
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::SlipEvent;
    use asperity_testkit::slip_event;

    use super::SlipSteps;

    /// Numbers have gaps in salvaged logs, and the last event may be open.
    #[test]
    fn events_are_found_by_their_steps() {
        let long = 1 << 40;
        let events: [(u64, u64, Option<u64>); 6] = [
            (0, 5, Some(7)),
            (1, 7, Some(8)),
            (4, 20, Some(30)),
            (5, 40, Some(long)),
            (6, long + 3, Some(long + 9)),
            (7, 2 * long, None),
        ];
        let mut steps = SlipSteps::default();
        for (event, onset_step, end_step) in events {
            let of_one_block = slip_event(onset_step, onset_step + 1, 1..=1);
            steps.push(&SlipEvent { event, onset_step, end_step, ..of_one_block });
        }
        for (event, onset, end) in events {
            assert_eq!(steps.event_at(onset), Some((event, onset)));
            assert_eq!(steps.event_at(end.map_or(u64::MAX - 1, |end| end - 1)), Some((event, onset)));
        }
        assert_eq!([4, 8, 19, 30, long, 2 * long - 1].map(|step| steps.event_at(step)), [None; 6]);
    }
}
