//! How fast fronts ran, over the stress that they found on their way.

use asperity_numbers::fronts::{ACROSS, FROM_BLOCKS, over_stress};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Labelled, Level, Parts, keys, levels, of_runs_in, with_parts};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Sheet, nth};

keys! {
    FrontStress;

    /// The runs, each with its label in the legend: their precursors and first global slips are shown.
    series: Vec<Labelled>,
    /// Fewest blocks of a rupture that is shown.
    #[serde(default = "five")]
    from_blocks: u32,
    /// Number of spacings over which speed and stress are taken.
    #[serde(default = "four")]
    across: u32,
    /// The upper end of the axis of speeds, over `c`. Faster fronts are not shown.
    to_speed: f64,
}

pub(super) fn five() -> u32 {
    FROM_BLOCKS
}

pub(super) fn four() -> u32 {
    ACROSS
}

/// What speeds are taken over: over an area the contacts around each.
pub(super) fn over(run: &RunData, across: u32) -> String {
    match run.of_one_row() {
        Some(_) => format!("over {} spacings", across.max(1)),
        None => "over an area: by the contacts around".to_owned(),
    }
}

/// What is shown of a run.
pub(crate) struct Part {
    /// Stress and speed of the fronts of precursors, and of the global slip.
    marks: [Vec<(f64, f64)>; 2],
    /// Levels of friction over load.
    levels: Vec<Level>,
    /// The wave speed, and that of longitudinal waves over it where there are any.
    wave_m_per_s: f64,
    longitudinal: Option<f64>,
    /// What speeds are taken over.
    over: String,
}

impl Figure for FrontStress {
    of_runs_in!(series, Part);

    fn required_data(&self) -> RequiredData {
        RequiredData::fronts()
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        Ok(Part {
            marks: over_stress(run, run.of_fronts()?, self.from_blocks, self.across.max(1)),
            levels: levels(run),
            wave_m_per_s: run.plan.scales.wave_speed_m_per_s(),
            longitudinal: run.plan.elastic.longitudinal_over_shear(),
            over: over(run, self.across),
        })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let all = with_parts(&self.series, &parts)?;
        let shown = |point: &&(f64, f64)| (0.0..=self.to_speed).contains(&point.1);
        let of =
            |n: usize| all.iter().flat_map(move |(_, part)| &part.marks[n]).filter(shown).map(|(x, _)| *x);
        let stresses = || of(0).chain(of(1));
        if stresses().next().is_none() {
            return Err(format!(
                "no rupture of {} blocks or more has a front up to {} c, and a state at its onset",
                self.from_blocks, self.to_speed
            ));
        }
        let Some((_, first)) = all.first() else { return Err("no run is named".to_owned()) };
        let friction = || first.levels.iter().map(|(level, ..)| *level);
        let x = Scale::of("τ_n/p_n before the rupture", false, 0.05, stresses().chain(friction()));
        let (from, to) = x.ends();
        let name = if first.longitudinal.is_some() { "c_S" } else { "c" };
        let level = |label: String, at: f64, dash| Layer::line(label, vec![(from, at), (to, at)], dash, GREY);
        let mut layers = vec![level(format!("{name} = {:.0} m/s", first.wave_m_per_s), 1.0, Dash::Dashed)];
        if let Some(ratio) = first.longitudinal.filter(|ratio| *ratio <= self.to_speed) {
            layers.push(level(format!("c_L = {:.0} m/s", ratio * first.wave_m_per_s), ratio, Dash::Dotted));
        }
        layers.extend(first.levels.iter().map(|&(at, dash, color, label)| {
            Layer::line(label, vec![(at, 0.0), (at, self.to_speed)], dash, color)
        }));
        for (index, (label, part)) in all.iter().enumerate() {
            let (marker, _, color) = nth(index);
            let [precursors, global_slip] = part.marks.clone();
            layers.push(Layer::marks(*label, precursors, marker, color));
            // Marks of a global slip are filled, to be distinguishable in grey.
            layers.push(Layer::discs("", global_slip, DISC, color));
        }
        // The legend distinguishes them where there are both.
        layers.extend(of(0).next().map(|_| Layer::remark("open: precursors")));
        layers.extend(of(1).next().map(|_| Layer::remark("discs: first global slip")));
        layers.push(Layer::remark(&first.over));
        let y = Scale::between(&format!("v/{name}"), 0.0, self.to_speed);
        Ok(Sheet::single(x, y, layers))
    }
}

/// Radius of a disc, in pixels.
const DISC: f64 = 8.0;
