//! How fast fronts ran, over the stress that they found on their way.

use asperity_numbers::fronts::{ACROSS, FROM_BLOCKS, over_stress};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Labelled, keys, levels, of_runs_in, overlaid, wave_speed_name};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Pen, Shape, Sheet};

keys! {
    FrontStress;

    /// The runs, each with its label in the legend: their precursors and first global slips are shown.
    series: Vec<Labelled>,
    /// Fewest blocks of a rupture that is shown.
    #[serde(default = "super::kind::number::<FROM_BLOCKS>")]
    from_blocks: u32,
    /// Number of spacings over which speed and stress are taken.
    #[serde(default = "super::kind::number::<ACROSS>")]
    across: u32,
    /// The upper end of the axis of speeds, over `c`. Faster fronts are not shown.
    to_speed: f64,
}

/// What speeds are taken over: over an area the contacts around each.
pub(super) fn over(run: &RunData, across: u32) -> String {
    match run.of_one_row() {
        Some(_) => format!("over {} spacings", across.max(1)),
        None => "over an area: by the contacts around".to_owned(),
    }
}

/// Radius of a disc, in pixels.
const DISC: f64 = 8.0;

/// Beyond any stress: lines across reach so far on both sides.
const ACROSS_ALL: f64 = 1e3;

impl Figure for FrontStress {
    of_runs_in!(series, RequiredData::fronts());

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let mut fronts = over_stress(run, run.of_fronts()?, self.from_blocks, self.across.max(1));
        fronts.iter_mut().for_each(|of| of.retain(|point| (0.0..=self.to_speed).contains(&point.1)));
        let name = wave_speed_name(run);
        let wave_m_per_s = run.plan.scales.wave_speed_m_per_s();
        let level = |name: &str, ratio: f64, dash| {
            let label = format!("{name} = {:.0} m/s", ratio * wave_m_per_s);
            Layer::line(label, vec![(-ACROSS_ALL, ratio), (ACROSS_ALL, ratio)], dash, GREY)
        };
        let mut layers = vec![level(name, 1.0, Dash::Dashed)];
        let longitudinal = run.plan.elastic.longitudinal_over_shear().filter(|ratio| *ratio <= self.to_speed);
        layers.extend(longitudinal.map(|ratio| level("c_L", ratio, Dash::Dotted)));
        layers.extend(levels(run, |at| vec![(at, 0.0), (at, self.to_speed)]));
        // The legend distinguishes them where there are both.
        let remarks = ["open: precursors", "discs: first global slip"].into_iter().zip(fronts.clone());
        let remarks = remarks.filter(|(_, fronts)| !fronts.is_empty()).map(|(text, _)| Layer::remark(text));
        let [precursors, global_slip] = fronts;
        // Marks of a global slip are filled, to be distinguishable in grey.
        layers.extend([pen.marks(precursors), Layer::discs("", global_slip, DISC, pen.look.2)]);
        layers.extend(remarks.chain([Layer::remark(over(run, self.across))]));
        let y = Scale::between(&format!("v/{name}"), 0.0, self.to_speed);
        Ok(Sheet::single(Scale::free("τ_n/p_n before the rupture"), y, layers))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let mut panel = overlaid(parts).panels.remove(0);
        if panel
            .layers
            .iter()
            .all(|layer| matches!(layer.shape, Shape::Line(..)) || layer.points().is_empty())
        {
            return Err(format!(
                "no rupture of {} blocks or more has a front up to {} c, and a state at its onset",
                self.from_blocks, self.to_speed
            ));
        }
        let points = panel.layers.iter().flat_map(Layer::points).map(|point| point.0);
        let stresses = points.filter(|stress| stress.abs() < ACROSS_ALL);
        panel.x = Scale::of(&panel.x.label(), false, 0.05, stresses.collect::<Vec<_>>().into_iter());
        panel.layers.sort_by_key(|layer| layer.shape == Shape::Remark);
        Ok(Sheet::of(vec![panel]))
    }
}
