//! How the shortest wave dies away: undamped, under-damped, critical and
//! over-damped, simulated and after (5.28) (Figure 5.5).

use asperity_numbers::curves::ring_down;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Labelled, Parts, keys, of_one_row, of_runs_in, with_pens};
use super::scale::Scale;
use super::sheet::Sheet;

keys! {
    Damping;

    /// The runs, each with its label in the legend.
    series: Vec<Labelled>,
}

/// How many marks a series bears.
const MARKS: usize = 40;

impl Figure for Damping {
    of_runs_in!(series, Vec<(f64, f64, f64)>);

    fn required_data(&self) -> RequiredData {
        RequiredData::WINDOWS
    }

    fn part(&self, run: &RunData) -> Result<Self::Part, String> {
        of_one_row(run)?;
        Ok(ring_down(run, run.windows()?))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut longest: f64 = 0.0;
        for (pen, points) in with_pens(&self.series, &parts)? {
            longest = points.iter().fold(longest, |longest, (phase, ..)| longest.max(*phase));
            let every = points.len().div_ceil(MARKS).max(1);
            let marked = points.iter().step_by(every);
            series.push(pen.line(points.iter().map(|&(phase, _, theory)| (phase, theory)).collect()));
            series.push(pen.marks(marked.map(|&(phase, ours, _)| (phase, ours)).collect()));
        }
        let x = Scale::between("t √(k/m)", 0.0, longest);
        let y = Scale::between("v_1(t)/v_1(0)", -1.1, 1.1);
        let note = "marks: simulated, lines: eq. (5.28)";
        Ok(Sheet::single(x, y, series).noted(note))
    }
}
