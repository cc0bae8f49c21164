//! Rate-and-state friction of a block against its velocity, with steady sliding, or against slip after a step of the
//! drive, with its closed form.

use asperity_model::Evolution;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::WindowRecord;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, keys, of_runs_in, overlaid};
use super::scale::Scale;
use super::sheet::{Dash, INK, Layer, Pen, Sheet};

keys! {
    Friction;

    /// What friction is drawn against.
    against: Against,
    /// The block, counted from 1.
    #[serde(default = "super::kind::number::<1>")]
    block: u32,
    /// The runs, each with its label in the legend: of chains, with dense windows of the block.
    series: Vec<Labelled>,
}

/// What friction of a block is drawn against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Against {
    /// Its velocity, with friction in steady sliding.
    Velocity,
    /// Its slip from the first record, over `D_c`, with the closed form for a step from the velocity of the first
    /// record to that of the last one in a stiff machine.
    Slip,
}

/// Points of a closed form, and marks beside it.
const POINTS: u32 = 200;
const MARKS: f64 = 24.0;

impl Figure for Friction {
    of_runs_in!(series, RequiredData::WINDOWS);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let lacks = |what: &str| format!("run {} has no {what}", run.name);
        let friction = &run.plan.friction;
        let law = friction.law.rate_and_state().ok_or_else(|| lacks("rate-and-state friction"))?;
        let place = self.block.checked_sub(1).filter(|_| self.block <= run.header.blocks);
        let place = place.ok_or_else(|| lacks(&format!("block {}", self.block)))? as usize;
        let b = friction.evolution_effects[place];
        let hold_step = run.plan.drive.hold_from_step.unwrap_or(u64::MAX);
        // Time, slip, velocity, and friction without inertia over the load.
        let of = |record: &WindowRecord| {
            let at = self.block.checked_sub(record.first_block)? as usize;
            let (slip_m, m_per_s) = (*record.displacement_m.get(at)?, *record.velocity_m_per_s.get(at)?);
            let friction_n = record.tangential_force_n.get(at)? - law.radiation_kg_per_s * m_per_s;
            let load_n = run.plan.loads_n(record.step, hold_step)[place];
            Some([record.time_s, slip_m, m_per_s, friction_n / load_n])
        };
        let mut course: Vec<[f64; 4]> = run.windows()?.iter().filter_map(of).collect();
        course.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (Some(&[_, start_m, before, _]), Some(&[_, end_m, after, _])) = (course.first(), course.last())
        else {
            return Err(lacks(&format!("dense window with block {}", self.block)));
        };
        let y = Scale::free("friction over load F/p");
        if self.against == Against::Velocity {
            let forward = course.iter().filter(|at| at[2] > 0.0);
            let measured: Vec<(f64, f64)> = forward.map(|at| (at[2], at[3])).collect();
            if measured.is_empty() {
                return Err(lacks("record in which the block slides forwards"));
            }
            let steady = |m_per_s: f64| (m_per_s, law.coefficient(m_per_s, law.steady_state(b, m_per_s)));
            let speeds = || measured.iter().map(|at| at.0);
            let ends = [speeds().fold(f64::MAX, f64::min), speeds().fold(0.0, f64::max)];
            let steady = Layer::line("steady sliding", ends.map(steady).into(), Dash::Dashed, INK);
            return Ok(Sheet::single(Scale::free_powers("v (m/s)"), y, vec![pen.line(measured), steady]));
        }
        let slips = |m: f64| (m - start_m) / law.critical_slip_m;
        let theory = |n: u32| {
            let slip = slips(end_m) * f64::from(n) / f64::from(POINTS);
            // The state over that of steady sliding at the velocity after the step.
            let state = match law.evolution {
                Evolution::Ageing => (1.0 + (after / before - 1.0) * (-slip).exp()).ln(),
                Evolution::Slip => (after / before).ln() * (-slip).exp(),
            };
            (slip, law.coefficient(after, law.steady_state(b, after) + b * state))
        };
        let theory = Layer::line("", (0..=POINTS).map(theory).collect(), Dash::Solid, pen.look.2);
        // About evenly: each the first record beyond a place.
        let every = slips(end_m) / MARKS;
        let mut from = f64::MIN;
        let mut measured: Vec<(f64, f64)> = course.iter().map(|at| (slips(at[1]), at[3])).collect();
        measured.retain(|at| {
            let is_next = at.0 >= from;
            from = if is_next { at.0.max(0.0) + every } else { from };
            is_next
        });
        Ok(Sheet::single(Scale::free("slip over D_c"), y, vec![theory, pen.marks(measured)]))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let is_of_slip = self.against == Against::Slip;
        Ok(overlaid(parts).noted(if is_of_slip { "marks: simulated, lines: closed form" } else { "" }))
    }
}

#[cfg(test)]
mod tests {
    use asperity_numbers::run_data::RunData;
    use asperity_record::WindowRecord;
    use asperity_testkit::made_up;

    use super::{Figure, Friction, Pen};

    fn figure(against: &str, block: u32) -> Friction {
        let series = "series = [{ run = \"test\", label = \"A\" }]";
        let keys =
            format!("file = \"a.png\"\ntitle = \"\"\nagainst = \"{against}\"\nblock = {block}\n{series}");
        toml::from_str(&keys).unwrap()
    }

    /// Block 2 of three, 400 N on each of them, slips `D_c` after a step from 1 to 10 µm/s.
    fn step(evolution: &str) -> RunData {
        let law = "friction.law = \"rate-and-state\"\nfriction.direct_effect = 0.01\nfriction.critical_slip_m = 1e-5\n\
                   friction.evolution_effect = 0.015\nfriction.reference_velocity_m_per_s = 1e-6\n\
                   friction.radiation_kg_per_s = 1e6\nnormal_load.total_n = 1200\nslider.relative_damping = 0";
        let mut run = made_up::run(&format!("{law}\nfriction.evolution = \"{evolution}\""), &[]);
        let record = |(time_s, slip_m, m_per_s, pull_n)| WindowRecord {
            window: 0,
            step: 0,
            time_s,
            sliding: 0,
            first_block: 2,
            displacement_m: vec![slip_m],
            velocity_m_per_s: vec![m_per_s],
            tangential_force_n: vec![pull_n],
            displacement_across_m: Vec::new(),
            velocity_across_m_per_s: Vec::new(),
            tangential_force_across_n: Vec::new(),
        };
        run.windows = [(2.0, 2e-5, 1e-5, 250.0), (1.0, 1e-5, 1e-6, 241.0)].map(record).to_vec();
        run.kept.windows = true;
        run
    }

    fn layers(against: &str, run: RunData) -> [Vec<(f64, f64)>; 2] {
        let layers = figure(against, 2).part(&run, Pen::nth(0, "A")).unwrap().panels.remove(0).layers;
        [layers[0].points(), layers[1].points()]
    }

    fn near(found: (f64, f64), expected: (f64, f64)) {
        assert!(
            (found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9,
            "{found:?} {expected:?}"
        );
    }

    #[test]
    fn friction_is_the_pull_without_radiation_beside_its_closed_form() {
        let steady = 0.6 - 0.005 * 10f64.ln();
        for (evolution, state) in
            [("ageing", (1.0 + 9.0 * (-1f64).exp()).ln()), ("slip", 10f64.ln() * (-1f64).exp())]
        {
            let [theory, measured] = layers("slip", step(evolution));
            near(measured[0], (0.0, 0.6));
            near(measured[1], (1.0, 0.6));
            near(theory[0], (0.0, 0.6 + 0.01 * 10f64.ln()));
            near(*theory.last().unwrap(), (1.0, steady + 0.015 * state));
        }
        let [measured, theory] = layers("velocity", step("slip"));
        near(measured[1], (1e-5, 0.6));
        near(theory[0], (1e-6, 0.6));
        near(theory[1], (1e-5, steady));
    }

    #[test]
    fn what_a_run_lacks_is_said() {
        let lacks = |block, run: &RunData| figure("slip", block).part(run, Pen::nth(0, "A")).unwrap_err();
        assert_eq!(lacks(1, &step("slip")), "run test has no dense window with block 1");
        assert_eq!(lacks(4, &step("slip")), "run test has no block 4");
        assert_eq!(lacks(1, &made_up::run("", &[])), "run test has no rate-and-state friction");
    }
}
