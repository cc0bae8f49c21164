//! How a slip pulse ends where the prestress falls: prestress and slip along the slider, and the
//! speed of the pulse below.

use asperity_model::front::relative_prestress;
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_row, of_one_run};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Marker, Panel, RED, Sheet};

keys! {
    Arrest: run;
}

/// Blocks between marks, which keeps them apart.
const BETWEEN_MARKS: usize = 12;

impl Figure for Arrest {
    of_one_run!();

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        of_one_row(run)?;
        let blocks = run.plan.blocks;
        let (theory, unit_m) = fronts::theory(run)
            .filter(|theory| theory.top_stiffness > 0.0)
            .zip(fronts::unit_m(run))
            .ok_or_else(|| format!("run {} has no rigid contacts under a held top drive", run.name))?;
        let prestress: Vec<(f64, f64)> = (0..blocks)
            .filter_map(|block| Some((block as f64 + 1.0, relative_prestress(&run.plan, block)?)))
            .collect();
        // The slip of a steady pulse, 2 tau / gamma, is drawn as the tau that it belongs to.
        let scale = theory.top_stiffness / 2.0 / unit_m;
        let passages = fronts::passages(run);
        let slip: Vec<(f64, f64)> = passages
            .iter()
            .filter_map(|passage| Some((f64::from(passage.block), passage.slip_m? * scale)))
            .collect();
        let last = passages.len() as f64;
        let end = |high: f64| Layer::line("", vec![(last, 0.0), (last, high)], Dash::Dotted, GREY);
        let arrest = theory.arrest_prestress();
        let marks = |points: &[(f64, f64)]| {
            points.iter().copied().skip(BETWEEN_MARKS).step_by(BETWEEN_MARKS).collect()
        };
        let level = vec![(0.0, arrest), (blocks as f64, arrest)];
        let x = Scale::between("", 0.0, blocks as f64);
        let y = Scale::free("τ; slip × γ/2");
        let series = vec![
            Layer::line("prestress τ", prestress[1..].to_vec(), Dash::Solid, INK),
            Layer::marks("slip × γ/2, in (μ_s − μ_d)p/k", marks(&slip), Marker::Circle, BLUE),
            Layer::line("γ/(2 + γ): no pulse below", level, Dash::Dashed, RED),
            end(arrest),
        ];
        let upper = Panel::new(x, y, series);
        let speeds = fronts::local_speeds(run);
        let fastest = speeds.iter().skip(BETWEEN_MARKS).map(|(_, speed)| *speed).fold(1.0, f64::max) * 1.15;
        let curve = theory.curve(fastest);
        let steady: Vec<(f64, f64)> = prestress[1..]
            .iter()
            .filter_map(|(block, tau)| {
                let above = curve.partition_point(|(prestress, _)| prestress < tau);
                let ((t0, v0), (t1, v1)) = (*curve.get(above.checked_sub(1)?)?, *curve.get(above)?);
                Some((*block, v0 + (v1 - v0) * (tau - t0) / (t1 - t0)))
            })
            .collect();
        let x = Scale::between("block n", 0.0, blocks as f64);
        let y = Scale::between("v/c", 0.0, fastest);
        let series = vec![
            Layer::line("steady, in theory", steady, Dash::Solid, INK),
            Layer::marks("simulated", marks(&speeds), Marker::Circle, BLUE),
            end(speeds.last().map_or(0.0, |(_, speed)| *speed)),
        ];
        let lower = Panel::new(x, y, series);
        Ok(Sheet::stacked(upper, lower))
    }
}
