//! How a slip pulse ends where the prestress falls: prestress and slip along the slider, and the
//! speed of the pulse below.

use asperity_model::front::relative_prestress;
use asperity_numbers::fronts;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_row, of_one_run};
use super::plot::{Axis, BLUE, Corner, Dash, GREY, INK, Marker, Panel, RED, Series, Sheet};

keys! {
    Arrest: file, run, title;
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
        let end = |low: f64, high: f64| Series::line("", vec![(last, low), (last, high)], Dash::Dotted, GREY);
        let arrest = theory.arrest_prestress();
        // Block 1 bears more than the others.
        let inside = || prestress[1..].iter().map(|(_, tau)| *tau).chain([0.0, arrest]);
        let (low, high) = (inside().fold(0.0, f64::min), inside().fold(0.0, f64::max) * 1.06);
        let marks = |points: &[(f64, f64)]| {
            points.iter().copied().skip(BETWEEN_MARKS).step_by(BETWEEN_MARKS).collect()
        };
        let level = vec![(0.0, arrest), (blocks as f64, arrest)];
        let x = Axis::new("", 0.0, blocks as f64);
        let y = Axis::new("τ; slip × γ/2", low, high);
        let series = vec![
            Series::line("prestress τ", prestress[1..].to_vec(), Dash::Solid, INK),
            Series::marks("slip × γ/2, in (μ_s − μ_d)p/k", marks(&slip), Marker::Circle, BLUE),
            Series::line("γ/(2 + γ): no pulse below", level, Dash::Dashed, RED),
            end(low, arrest),
        ];
        let upper = Panel::new(x, y, Corner::TopRight, series).titled(&self.title);
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
        let x = Axis::new("block n", 0.0, blocks as f64);
        let y = Axis::new("v/c", 0.0, fastest);
        let series = vec![
            Series::line("steady, in theory", steady, Dash::Solid, INK),
            Series::marks("simulated", marks(&speeds), Marker::Circle, BLUE),
            end(0.0, speeds.last().map_or(0.0, |(_, speed)| *speed)),
        ];
        let lower = Panel::new(x, y, Corner::TopRight, series);
        Ok(Sheet::stacked(upper, lower))
    }
}
