//! The curves that figures, tables and Python ask for by name.
//!
//! To add one: a function and an entry.

use asperity_model::law::weakening::Weakening;
use asperity_model::theory::analytic::LengthLaw;
use asperity_model::theory::front::{Front, relative_prestress};
use asperity_model::{Course, Evolution};
use asperity_record::WindowRecord;

use crate::curve::{Against, Curve, CurveKeys, Role, curves};
use crate::curves::{event_in_window, front_profile, growing_slips, pull_ratio, ring_down};
use crate::fault_line::{largest_velocity, slip_profiles, stations};
use crate::fronts;
use crate::precursors::one_by_one;
use crate::required_data::RequiredData;
use crate::run_data::{RunData, RunEvents};

curves! {
    /// Velocities of one mode under several dampings.
    "damping": ["v_1(t)/v_1(0)"], over "t √(k/m)", [], |_| RequiredData::WINDOWS, ringing;
    /// Displacement of chosen blocks against time.
    "displacement": ["u_n (mm)"], over "t (s)", ["at_blocks"],
        |keys| RequiredData { displacements_of: keys.at_blocks.iter().copied().collect(), ..RequiredData::NOTHING },
        displacement;
    /// `tau / p` along the slider after a precursor.
    "front": ["τ_n/p_n"], over "block n", ["blocks"], |_| RequiredData::LOADS | RequiredData::STATES, front;
    /// Initial shear profiles.
    "initial-shear": ["τ_0/p"], over "x/L", [], |_| RequiredData::STATES, initial_shear;
    /// Normal load and driving force against time.
    "loads": ["force (N)"], over "t (s)", [], |_| RequiredData::LOADS, loads;
    /// `F_T`, `F_N`, `mu_s F_N` and `mu_d F_N` against time; of rate-and-state friction `f_0 F_N`.
    "forces": ["force (N)"], over "t (s)", ["from_s" "to_s"], |_| RequiredData::LOADS, forces;
    /// Velocities of some blocks during a slip event.
    "velocities": ["v_n (mm/s)", "blocks sliding"], over "t − t_0 (ms)", ["blocks"], |_| RequiredData::WINDOWS,
        velocities;
    /// Share of the blocks that slid, against the load, wherever slip began.
    "slipped": ["share of blocks that slid"], over "F_T/F_N", [], |_| RequiredData::LOADS, slipped;
    /// Velocity and slip of blocks that a slip pulse passes.
    "pulse": ["velocity × √(km)/[(μ_s − μ_d)p]", "slip × k/[(μ_s − μ_d)p]"],
        over "time since the pulse came, over a/c", ["before" "after"], |_| RequiredData::WINDOWS, pulse;
    /// Slip and speed of a pulse along the slider, and where it ends.
    "arrest": ["τ; slip × γ/2", "v/c"], over "block n", [], |_| RequiredData::NOTHING, arrest;
    /// Speed of the front of a run with one front, such as the scenario `front`, along the slider: from the
    /// first slip of each block in the run. For one rupture among others, see `front-profile`.
    "front-transient": ["v/c between n − 1 and n"], over "block n", [], |_| RequiredData::NOTHING, front_transient;
    /// Forces of pinned junctions along the slider at chosen instants: their mean and, below, the width of a
    /// uniform distribution with their deviation, both over `p_n / N_s`.
    "junction-forces": ["mean force/(p_n/N_s)", "width"], over "x (mm)", ["at_s" "after_slips"],
        |keys| RequiredData { states: keys.after_slips, states_near_s: keys.at_s.clone(), ..RequiredData::NOTHING },
        junction_forces;
    /// Rate-and-state friction of a block, from dense windows: against its velocity, with steady sliding, or against slip
    /// after a step of the drive, with its closed form. Friction is the force that pulls the block less radiation, over
    /// its load; inertia counts as friction. Of contacts that weaken by slip, from a dense window of every step, friction
    /// without inertia against slip, from the step in which it is largest, beside the law.
    "friction": ["friction over load F/p"], over "v (m/s)", ["against" "block"], |_| RequiredData::WINDOWS, friction;
    /// Slip of a fault line in a medium against depth, in recorded states: one in each interval of `every_s` in which
    /// nothing slides, by default 5 years, and of `event_every_s` from the onset of each slip event on, by default 1 s.
    "slip-profiles": ["depth (km)"], over "slip (m)", ["every_s" "event_every_s"],
        |_| RequiredData { displacements: true, ..RequiredData::WINDOWS }, slip_profiles;
    /// Largest speed of the blocks against time, where steps of the solver end.
    "largest-velocity": ["largest velocity (m/s)"], over "t (s)", ["from_s" "to_s"], |_| RequiredData::series(),
        largest_velocity;
    /// Slip rate, shear stress and state of stations of a fault line in a medium against time, where steps of the solver
    /// end: of `at_blocks`, or else of up to five of those recorded.
    "stations": ["slip rate (m/s)", "shear stress (MPa)", "state θ (s)"], over "t (s)", ["at_blocks"],
        |_| RequiredData::series(), stations;
}

/// What the dynamic coefficient is called; chapter 5 of the thesis writes `mu_k`, chapter 6 `mu_d`.
pub const DYNAMIC: &str = "μ_d";

/// Levels of friction over load that the law of a run has: the two coefficients, or `f_0`.
pub fn levels(run: &RunEvents) -> Vec<(f64, Role, &'static str)> {
    let friction = &run.plan.friction;
    match friction.law.rate_and_state() {
        // Nobody knows those of a recording.
        _ if run.is_measured() => Vec::new(),
        Some(law) => vec![(law.reference_coefficient, Role::Static, "f_0")],
        None => vec![
            (friction.static_coefficient, Role::Static, "μ_s"),
            (friction.dynamic_coefficient, Role::Sliding, DYNAMIC),
        ],
    }
}

/// Refuses runs over an area in curves of what blocks do one after the other.
///
/// # Errors
/// In words, with what is accepted.
pub fn of_one_row(run: &RunEvents) -> Result<(), String> {
    run.of_one_row().map(drop).ok_or_else(|| {
        format!(
            "the contacts of run {} cover an area, and this figure follows blocks along a row (accepted: a run of a \
             chain or a slab; arrival-map and film-strip show fronts over an area)",
            run.name
        )
    })
}

/// A quantity along the slider: over an area the mean of each column of contacts.
pub fn along(run: &RunEvents, values: &[f64]) -> Vec<f64> {
    let contacts = run.header.contacts();
    if !contacts.is_area() {
        return values.to_vec();
    }
    let columns = contacts.columns() as usize;
    let mean =
        |column: usize| values[column..].iter().step_by(columns).sum::<f64>() / f64::from(contacts.rows());
    (0..columns).map(mean).collect()
}

/// A quantity along the slider by the place of each block, mm.
pub fn by_mm(run: &RunEvents, values: &[f64]) -> Vec<(f64, f64)> {
    let place_mm = |n: usize| n as f64 * run.plan.spacing_m * 1e3;
    along(run, values).into_iter().enumerate().map(|(n, value)| (place_mm(n), value)).collect()
}

/// How the shortest wave dies away: undamped, under-damped, critical and over-damped, simulated and after
/// (5.28) (Figure 5.5).
fn ringing(run: &RunData, _: &CurveKeys) -> Result<Vec<Curve>, String> {
    /// About how many marks a series bears.
    const MARKS: usize = 40;
    of_one_row(run)?;
    let all = ring_down(run, run.windows()?);
    let measured = all.iter().map(|&(phase, measured, _)| (phase, measured)).collect();
    Ok(vec![
        Curve::new(Role::Theory, "", all.iter().map(|&(phase, _, theory)| (phase, theory)).collect()),
        Curve::new(Role::Marked(all.len().div_ceil(MARKS).max(1)), "", measured),
        Curve::remark("marks: simulated, lines: theory"),
    ])
}

/// Blocks are counted from 1; over an area contacts, row by row (Figure 6.7).
fn displacement(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    if keys.at_blocks.is_empty() {
        return Err(format!("at_blocks: none (accepted: blocks from 1 to {})", run.header.blocks));
    }
    let mut curves = Vec::new();
    for &block in &keys.at_blocks {
        if !(1..=run.header.blocks).contains(&block) {
            let (name, blocks) = (&run.name, run.header.blocks);
            return Err(format!("at_blocks: {block} is not in run {name} (accepted: 1 to {blocks})"));
        }
        let contacts = run.header.contacts();
        let label = match run.of_one_row() {
            Some(_) => format!("block {block}"),
            None => {
                format!("contact {block}: column {}, row {}", contacts.column(block), contacts.row(block))
            }
        };
        let course = run.states()?.displacement_of(block);
        let points = course.iter().map(|(time_s, displacement_m)| (*time_s, displacement_m * 1e3)).collect();
        curves.push(Curve::new(Role::Measured, label, points));
    }
    if curves.iter().flat_map(|curve| &curve.points).all(|(_, displacement_mm)| *displacement_mm <= 0.0) {
        return Err(format!("no displacement of its blocks is recorded in run {}", run.name));
    }
    Ok(curves)
}

/// The precursor is that whose length is nearest to `blocks`, by default half of them (Figure 5.6).
fn front(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    let blocks = f64::from(keys.blocks.unwrap_or(run.columns().div_ceil(2)));
    let (precursor, profile) = front_profile(run, run.loads()?, run.states()?, blocks)
        .ok_or_else(|| format!("run {} has no precursor with fields at its end", run.name))?;
    let end_s = precursor.end.end_s.unwrap_or(precursor.end.onset_s);
    let (last, tip) = (f64::from(run.columns()), f64::from(precursor.last_block) + 0.5);
    let place = if run.of_one_row().is_some() { "block" } else { "column" };
    let line = |(mu, role, label)| Curve::new(role, label, vec![(0.0, mu), (last, mu)]);
    let mut curves: Vec<Curve> = levels(run).into_iter().map(line).collect();
    let up_to = vec![(tip, 0.0), (tip, run.plan.friction.static_coefficient)];
    curves.push(Curve::new(Role::Guide, format!("front, {place} {}", precursor.last_block), up_to));
    let profile = (1..).map(f64::from).zip(along(run, &profile)).collect();
    curves.push(Curve::new(Role::Measured, format!("simulated, t = {end_s:.3} s"), profile));
    Ok(curves)
}

/// As set up, and as (5.50) asks (Figure 5.7); of slabs what their load leaves.
fn initial_shear(run: &RunData, _: &CurveKeys) -> Result<Vec<Curve>, String> {
    /// One block in this many is marked, so that the lines beneath can be seen.
    const MARKED: usize = 6;
    let fields = run.states()?.first();
    let fields = fields.ok_or_else(|| format!("run {} has no initial fields", run.name))?;
    let shear = fields.tangential_force_n.iter().zip(&run.plan.normal_load_n);
    let shear = along(run, &shear.map(|(tau, p)| tau / p).collect::<Vec<f64>>());
    let at = |n: usize| n as f64 * run.plan.spacing_m / run.plan.length_m;
    let shear: Vec<(f64, f64)> = shear.into_iter().enumerate().map(|(n, ratio)| (at(n), ratio)).collect();
    let beta = run.scenario.initial_shear.beta;
    let (line, remark) = match (run.plan.elastic.has_foundation(), run.of_one_row()) {
        (true, Some(_)) => (Curve::new(Role::Measured, "", shear.clone()), "slabs at rest"),
        (true, None) => (Curve::new(Role::Measured, "", shear.clone()), "at rest, means of columns"),
        (false, _) => {
            let asked = Curve::new(Role::Theory, "", vec![(0.0, -beta), (1.0, beta)]);
            (asked, "marks: set up, lines: the profile asked for")
        }
    };
    Ok(vec![line, Curve::new(Role::Marked(MARKED), "", shear), Curve::remark(remark)])
}

/// Figures 6.3, 6.14, 6.16, 6.18, 6.20 and 6.22.
fn loads(run: &RunData, _: &CurveKeys) -> Result<Vec<Curve>, String> {
    let loads = run.loads()?.iter();
    let normal = loads.clone().map(|load| (load.time_s, load.normal_load_n)).collect();
    let driving = loads.map(|load| (load.time_s, load.driving_force_n)).collect();
    Ok(vec![Curve::new(Role::Measured, "F_N", normal), Curve::new(Role::Measured, "F_T", driving)])
}

fn forces(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    let from_s = keys.from_s.unwrap_or(0.0);
    let to_s = keys.to_s.unwrap_or(run.plan.grid.time_s(run.header.steps));
    let shown: Vec<_> = run.loads()?.iter().filter(|load| (from_s..=to_s).contains(&load.time_s)).collect();
    if shown.len() < 2 {
        return Err(format!("run {} has no records from {from_s} s to {to_s} s", run.name));
    }
    let over_time = |role, label: String, ratio: &dyn Fn(&crate::run_data::Load) -> f64| {
        let points = shown.iter().map(|load| (load.time_s, ratio(load) * load.normal_load_n));
        Curve::new(role, label, points.collect())
    };
    let mut curves = vec![over_time(Role::Measured, "F_N".to_owned(), &|_| 1.0)];
    for (level, role, label) in levels(run) {
        curves.push(over_time(role, format!("{label} F_N"), &|_| level));
    }
    let both = if run.plan.drive.pulls_both_ways() { ", both ends added" } else { "" };
    curves.push(over_time(Role::Measured, format!("F_T{both}"), &pull_ratio));
    Ok(curves)
}

/// The slip event is that within the dense window whose length is nearest to `blocks`, by default all; up to
/// the next event, so that no other takes over the axes (Figures A.1, A.2).
fn velocities(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    /// How much of the axis lies before the event and after it, over its duration.
    const BEFORE: f64 = 0.08;
    const AFTER: f64 = 0.12;
    let missing = || format!("run {} has no slip event that begins and ends in a dense window", run.name);
    let blocks = f64::from(keys.blocks.unwrap_or(run.columns()));
    let event = event_in_window(run, blocks).ok_or_else(missing)?;
    let duration_s = event.end_s.ok_or_else(missing)? - event.onset_s;
    let since_ms = |record: &WindowRecord| (record.time_s - event.onset_s) * 1e3;
    let shown = -BEFORE * duration_s * 1e3..=(1.0 + AFTER) * duration_s * 1e3;
    let next_step = run.slips.iter().map(|slip| slip.onset_step).find(|step| *step > event.onset_step);
    let records = run.windows()?.iter();
    let records: Vec<&WindowRecord> = records
        .filter(|record| record.window == 0 && shown.contains(&since_ms(record)))
        .take_while(|record| next_step.is_none_or(|step| record.step < step))
        .collect();
    let (first, last) = records.first().zip(records.last()).ok_or_else(missing)?;
    let ends = vec![(since_ms(first), 0.0), (since_ms(last), 0.0)];
    let course = |of: &dyn Fn(&WindowRecord) -> f64| {
        records.iter().map(|record| (since_ms(record), of(record))).collect::<Vec<_>>()
    };
    let of_block = |index: usize| {
        let label = format!("block {}", first.first_block as usize + index);
        Curve::new(Role::Measured, label, course(&|record| record.velocity_m_per_s[index] * 1e3))
    };
    let mut curves = vec![Curve::new(Role::Guide, "", ends)];
    curves.extend((0..first.velocity_m_per_s.len()).map(of_block));
    curves.push(Curve::remark(format!("t_0 = {:.5} s", event.onset_s)));
    curves.push(Curve::new(Role::Measured, "", course(&|record| f64::from(record.sliding))).below());
    Ok(curves)
}

/// For events larger than all before them, wherever they began: for drives from the top and from both ends,
/// where fronts need not start at block 1. In a chain what slid bears `mu_d` and nothing else anything.
fn slipped(run: &RunData, _: &CurveKeys) -> Result<Vec<Curve>, String> {
    let line = vec![(0.0, 0.0), (run.plan.friction.dynamic_coefficient, 1.0)];
    let theory =
        LengthLaw::are_known(&run.scenario).then(|| Curve::new(Role::Theory, "F_T/F_N = μ_d × share", line));
    let measured = Curve::new(Role::Marked(1), "", growing_slips(run, run.loads()?));
    Ok(theory.into_iter().chain([measured]).collect())
}

/// Velocity and slip against the time since the pulse came, which lie on each other where it is steady.
fn pulse(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    of_one_row(run)?;
    let (from, to) = (-keys.before.unwrap_or(0.5), keys.after.unwrap_or(6.0));
    let crossing_s = fronts::crossing_s(run);
    let unit_m = fronts::unit_m(run)
        .ok_or_else(|| format!("run {} has no difference of static and sliding friction", run.name))?;
    let passages = fronts::passages(run);
    let mut traces = std::collections::BTreeMap::<u32, [Vec<(f64, f64)>; 2]>::new();
    for record in run.windows()? {
        let moved = record.displacement_m.iter().zip(&record.velocity_m_per_s);
        for (block, (displacement_m, velocity_m_per_s)) in (record.first_block..).zip(moved) {
            let Some(passage) = passages.get(block as usize - 1) else { continue };
            let since = (record.time_s - passage.arrival_s) / crossing_s;
            if (from..=to).contains(&since) {
                let [velocity, slip] = traces.entry(block).or_default();
                velocity.push((since, velocity_m_per_s / unit_m * crossing_s));
                let rest_m = run.plan.initial.displacement_m[block as usize - 1];
                slip.push((since, (displacement_m - rest_m) / unit_m));
            }
        }
    }
    if traces.is_empty() {
        return Err(format!("run {} has no dense window of blocks that a pulse passes", run.name));
    }
    let mut curves = Vec::new();
    for [velocity, slip] in traces.into_values() {
        curves.push(Curve::new(Role::Measured, "", velocity));
        curves.push(Curve::new(Role::Measured, "", slip).below());
    }
    if let Some((theory, slip)) = fronts::theory(run).and_then(|theory| Some((theory, theory.pulse_slip()?)))
    {
        let formula = if theory.weakening_slip > 0.0 { "[τ + √(τ² − γd)]/γ" } else { "2τ/γ" };
        curves.push(Curve::new(Role::Guide, "", vec![(from, slip), (to, slip)]).below());
        curves.push(Curve::remark(format!("dotted: {formula}")).below());
    }
    Ok(curves)
}

/// How fronts become steady.
fn front_transient(run: &RunData, _: &CurveKeys) -> Result<Vec<Curve>, String> {
    of_one_row(run)?;
    let local = fronts::local_speeds(run);
    if local.is_empty() {
        return Err(format!("run {} has no front from block 1", run.name));
    }
    let theory = fronts::theory(run).and_then(|theory| theory.speed_over_c());
    let level = |steady| Curve::new(Role::Guide, "", vec![(1.0, steady), (run.plan.blocks as f64, steady)]);
    let remark = theory.map(|_| Curve::remark("dotted: steady, in theory"));
    let curves = [Curve::new(Role::Measured, "", local)].into_iter().chain(remark);
    Ok(curves.chain(theory.map(level)).collect())
}

/// How a pulse ends where the prestress falls.
fn arrest(run: &RunData, _: &CurveKeys) -> Result<Vec<Curve>, String> {
    /// Blocks between marks, which keeps them apart.
    const BETWEEN: usize = 12;
    of_one_row(run)?;
    let theory = fronts::theory(run).filter(|theory| theory.top_stiffness > 0.0).zip(fronts::unit_m(run));
    let (theory, unit_m) =
        theory.ok_or_else(|| format!("run {} has no rigid contacts under a held top drive", run.name))?;
    let blocks = 1..run.plan.blocks;
    let prestress = blocks.filter_map(|n| Some((n as f64 + 1.0, relative_prestress(&run.plan, n)?)));
    let prestress: Vec<(f64, f64)> = prestress.collect();
    let steady = prestress
        .iter()
        .filter_map(|&(block, prestress)| Some((block, Front { prestress, ..theory }.speed_over_c()?)));
    let steady = Curve::new(Role::Theory, "steady, in theory", steady.collect()).below();
    // The slip of a steady pulse, 2 tau / gamma, is drawn as the tau that it belongs to.
    let scale = theory.top_stiffness / 2.0 / unit_m;
    let passages = fronts::passages(run);
    let slip =
        passages.iter().filter_map(|passage| Some((f64::from(passage.block), passage.slip_m? * scale)));
    let speeds = fronts::local_speeds(run);
    let (last, arrest) = (passages.len() as f64, theory.arrest_prestress());
    let end = |high: f64| Curve::new(Role::Guide, "", vec![(last, 0.0), (last, high)]);
    let marked = |label: &str, points: Vec<(f64, f64)>| {
        Curve::new(Role::Marked(BETWEEN), label, points.into_iter().skip(BETWEEN).collect())
    };
    let level = vec![(0.0, arrest), (run.plan.blocks as f64, arrest)];
    Ok(vec![
        Curve::new(Role::Measured, "prestress τ", prestress),
        marked("slip × γ/2, in (μ_s − μ_d)p/k", slip.collect()),
        Curve::new(Role::Guide, "γ/(2 + γ): no pulse below", level),
        end(arrest),
        steady,
        end(speeds.last().map_or(0.0, |(_, speed)| *speed)).below(),
        marked("simulated", speeds).below(),
    ])
}

/// States are those recorded nearest to instants, and if asked for those after the first precursor of five blocks or
/// more and after the first global slip, among slip events. Where no junction is pinned, nothing is shown.
fn junction_forces(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    let law = run.plan.friction.law.junctions().ok_or_else(|| {
        format!("run {} has no junctions (accepted: friction.law = \"junctions\")", run.name)
    })?;
    let recorded = run.states()?;
    let mut states = Vec::from_iter(keys.at_s.iter().filter_map(|at_s| recorded.near(*at_s)));
    if keys.after_slips {
        let precursors = one_by_one(run);
        let first = |least: u32| precursors.iter().find(|precursor| precursor.blocks_slipped >= least);
        let least = [fronts::FROM_BLOCKS, run.header.blocks].into_iter();
        let ends = least.filter_map(|least| first(least)?.end.end_step);
        states.extend(ends.filter_map(|step| recorded.at_precursor_end(step)));
    }
    // Each once, in time.
    states.retain(|state| !state.junctions_slipping.is_empty());
    states.sort_by_key(|state| state.step);
    states.dedup_by_key(|state| state.step);
    if states.is_empty() {
        return Err(format!("run {} has no states with junctions at these instants", run.name));
    }
    let across =
        |role, label, level| Curve::new(role, label, vec![(0.0, level), (run.plan.length_m * 1e3, level)]);
    let mut curves: Vec<Curve> =
        levels(run).into_iter().map(|(mu, role, label)| across(role, label, mu)).collect();
    curves.push(across(Role::Guide, "w at the start", law.width).below());
    for state in states {
        let course = |label, values: &[f64]| {
            let pinned = state.junctions_slipping.iter().map(|slipping| (*slipping as usize) < law.count);
            let shown = values.iter().zip(pinned).map(|(value, is)| if is { *value } else { f64::NAN });
            Curve::new(Role::Measured, label, by_mm(run, &shown.collect::<Vec<f64>>()))
        };
        curves.push(course(format!("t = {:.4} s", state.time_s), &state.pinned_mean_ratio));
        curves.push(course(String::new(), &state.pinned_width_ratio).below());
    }
    Ok(curves)
}

/// Friction of a block by rate and state. Over slip, one record in about a twenty-fourth of the way is marked.
fn friction(run: &RunData, keys: &CurveKeys) -> Result<Vec<Curve>, String> {
    const POINTS: u32 = 200;
    const MARKS: f64 = 24.0;
    let block = keys.block.unwrap_or(1);
    let lacks = |what: &str| format!("run {} has no {what}", run.name);
    let friction = &run.plan.friction;
    let place = block.checked_sub(1).filter(|_| block <= run.header.blocks);
    let place = place.ok_or_else(|| lacks(&format!("block {block}")))? as usize;
    if let Some(fall) = friction.law.weakening() {
        return weakening(run, fall, place)
            .ok_or_else(|| lacks(&format!("dense window of every step with block {block}")));
    }
    let law = friction
        .law
        .rate_and_state()
        .ok_or_else(|| lacks("friction by rate and state, or that weakens by slip"))?;
    let b = friction.evolution_effects[place];
    let hold_step = run.plan.drive.hold_from_step.unwrap_or(u64::MAX);
    // Time, slip, velocity, and friction without inertia over the load.
    let of = |record: &WindowRecord| {
        let at = block.checked_sub(record.first_block)? as usize;
        let (slip_m, m_per_s) = (*record.displacement_m.get(at)?, *record.velocity_m_per_s.get(at)?);
        let friction_n = record.tangential_force_n.get(at)? - law.radiation_kg_per_s * m_per_s;
        let load_n = run.plan.outside(record.step, hold_step).loads_n()[place];
        Some([record.time_s, slip_m, m_per_s, friction_n / load_n])
    };
    let mut course: Vec<[f64; 4]> = run.windows()?.iter().filter_map(of).collect();
    course.sort_by(|a, b| a[0].total_cmp(&b[0]));
    if course.is_empty() {
        return Err(lacks(&format!("dense window with block {block}")));
    }
    if keys.against == Against::Velocity {
        let forward = course.iter().filter(|at| at[2] > 0.0);
        let measured: Vec<(f64, f64)> = forward.map(|at| (at[2], at[3])).collect();
        if measured.is_empty() {
            return Err(lacks("record in which the block slides forwards"));
        }
        let steady = |m_per_s: f64| (m_per_s, law.coefficient(m_per_s, law.steady_state(b, m_per_s)));
        let speeds = || measured.iter().map(|at| at.0);
        let ends = [speeds().fold(f64::MAX, f64::min), speeds().fold(0.0, f64::max)];
        let steady = Curve::new(Role::Static, "steady sliding", ends.map(steady).into());
        return Ok(vec![Curve::new(Role::Measured, "", measured), steady]);
    }
    // Slip counts from the last record before the drive's step, as the closed form does, wherever the window begins.
    let jump = run.plan.drive.course.as_ref().and_then(Course::last_jump);
    let before_step =
        course.partition_point(|at| jump.is_some_and(|step| at[0] < run.plan.grid.time_s(step)));
    let course = &course[before_step.saturating_sub(1)..];
    let ([_, start_m, before, _], [_, end_m, after, _]) = (course[0], course[course.len() - 1]);
    let slips = |m: f64| (m - start_m) / law.critical_slip_m;
    let theory = |n: u32| {
        let slip = slips(end_m) * f64::from(n) / f64::from(POINTS);
        // The state over that of steady sliding at the velocity after the step.
        let state = match law.evolution {
            Evolution::Ageing => (1.0 + (after / before - 1.0) * (-slip).exp()).ln(),
            Evolution::Slip => (after / before).ln() * (-slip).exp(),
            Evolution::Prz => {
                let (jump, worn) = (after / before, (0.5 * slip).tanh());
                ((jump + worn) / (1.0 + jump * worn)).ln()
            }
        };
        (slip, law.coefficient(after, law.steady_state(b, after) + b * state))
    };
    // About evenly: each the first record beyond a place.
    let every = slips(end_m) / MARKS;
    let mut from = f64::MIN;
    let mut measured: Vec<(f64, f64)> = course.iter().map(|at| (slips(at[1]), at[3])).collect();
    measured.retain(|at| {
        let is_next = at.0 >= from;
        from = if is_next { at.0.max(0.0) + every } else { from };
        is_next
    });
    Ok(vec![
        Curve::new(Role::Theory, "", (0..=POINTS).map(theory).collect()),
        Curve::new(Role::Marked(1), "", measured),
        Curve::remark("marks: simulated, lines: closed form"),
    ])
}

/// Friction of a block that weakens by slip, and its law; `None` without a window of consecutive steps.
fn weakening(run: &RunData, fall: Weakening, place: usize) -> Option<Vec<Curve>> {
    const POINTS: u32 = 200;
    const MARKS: usize = 24;
    let (plan, friction) = (&run.plan, &run.plan.friction);
    let at = |record: &WindowRecord| {
        let at = (place + 1).checked_sub(record.first_block as usize)?;
        let values = [&record.displacement_m, &record.velocity_m_per_s, &record.tangential_force_n];
        let [u, v, tau] = values.map(|values| values.get(at).copied());
        Some((record.step, [u?, v?, tau?]))
    };
    let course: Vec<_> = run.windows().ok()?.iter().filter_map(at).collect();
    let per_step = plan.block_mass_kg / plan.grid.step_s();
    let rubbing = |pair: &[(u64, [f64; 3])]| {
        let [(before, [_, v, _]), (step, [new_u, new_v, tau])] = [pair[0], pair[1]];
        let radiated_n = friction.law.radiation_kg_per_s() * v;
        let load_n = plan.outside(step, u64::MAX).loads_n()[place];
        (step == before + 1).then(|| (new_u, (tau - radiated_n - per_step * (new_v - v)) / load_n))
    };
    let rubbed: Vec<(f64, f64)> = course.windows(2).filter_map(rubbing).collect();
    // From the largest friction to the end of the slip.
    let largest = |of: &[f64]| (0..of.len()).max_by(|a, b| of[*a].total_cmp(&of[*b]).then(b.cmp(a)));
    let (ways_m, coefficients): (Vec<f64>, Vec<f64>) = rubbed.iter().copied().unzip();
    let first = largest(&coefficients)?;
    let last = first + largest(&ways_m[first..])?;
    let d_m = friction.weakening_slip_m[place];
    let slips: Vec<(f64, f64)> =
        rubbed[first..=last].iter().map(|(u, mu)| ((u - ways_m[first]) / d_m, *mu)).collect();
    let most = slips.iter().fold(1.0, |most: f64, (slip, _)| most.max(*slip));
    let [high, low] = [friction.static_coefficients[place], friction.dynamic_coefficients[place]];
    let law = |n: u32| {
        let slip = most * f64::from(n) / f64::from(POINTS);
        (slip, low + (high - low) * fall.share(slip))
    };
    Some(vec![
        Curve::new(Role::Theory, "", (0..=POINTS).map(law).collect()),
        Curve::new(Role::Marked(slips.len().div_ceil(MARKS)), "", slips),
        Curve::remark("marks: simulated, lines: the law"),
    ])
}

#[cfg(test)]
mod tests {
    use asperity_model::Course;
    use asperity_record::WindowRecord;

    use crate::curve::{NamedCurves, Role};
    use crate::made_up;
    use crate::run_data::RunData;

    #[test]
    fn a_slab_has_the_shear_of_all_its_contacts() {
        let mut run = made_up::slab(&[]);
        // As the run begins: each contact bears its part of the load.
        run.plan.normal_load_n = vec![100.0, 200.0, 100.0];
        let named = NamedCurves::find("initial-shear").unwrap();
        let curves = named.of(&run, &named.keys_of(&[]).unwrap()).unwrap();
        assert_eq!(curves[0].points, [(0.0, -0.2), (0.5, 0.0), (1.0, 0.2)]);
        assert_eq!(curves[1].points, curves[0].points);
        assert_eq!((curves[2].label.as_str(), curves[2].role), ("slabs at rest", Role::Remark));
    }

    #[test]
    fn names_and_keys_are_checked() {
        let named = NamedCurves::find("forces").unwrap();
        assert_eq!(named.keys_of(&["to_s=2".to_owned()]).unwrap().to_s, Some(2.0));
        let refused = |set: &str| named.keys_of(&[set.to_owned()]).unwrap_err();
        assert_eq!(refused("blocks=3"), "blocks: curves forces have no such key (accepted: from_s, to_s)");
        assert!(refused("to_s=\"soon\"").contains("invalid type: string"), "{}", refused("to_s=\"soon\""));
        let unknown = NamedCurves::find("force").unwrap_err();
        assert!(unknown.starts_with("there is no curve \"force\"; did you mean forces?"), "{unknown}");
    }

    /// Block 2 of three, 400 N on each of them, slips `D_c` after a step from 1 to 10 µm/s.
    fn step(evolution: &str) -> RunData {
        let law = "friction.law = \"rate-and-state\"\nfriction.direct_effect = 0.01\nfriction.critical_slip_m = 1e-5\n\
                   friction.evolution_effect = 0.015\nfriction.reference_velocity_m_per_s = 1e-6\n\
                   friction.radiation_kg_per_s = 1e6\nnormal_load.total_n = 1200\nslider.relative_damping = 0";
        let mut run = made_up::run(&format!("{law}\nfriction.evolution = \"{evolution}\""), &[]);
        let record = |(time_s, slip_m, m_per_s, pull_n)| WindowRecord {
            time_s,
            first_block: 2,
            displacement_m: vec![slip_m],
            velocity_m_per_s: vec![m_per_s],
            tangential_force_n: vec![pull_n],
            ..WindowRecord::default()
        };
        run.windows = [(2.0, 2e-5, 1e-5, 250.0), (1.0, 1e-5, 1e-6, 241.0)].map(record).to_vec();
        run.kept.windows = true;
        run
    }

    fn friction(against: &str, block: u32, run: &RunData) -> Result<[Vec<(f64, f64)>; 2], String> {
        let curves = NamedCurves::find("friction").unwrap();
        let set = [format!("against = \"{against}\""), format!("block = {block}")];
        let found = curves.of(run, &curves.keys_of(&set).unwrap())?;
        Ok([0, 1].map(|n: usize| found[n].points.clone()))
    }

    fn near(found: (f64, f64), expected: (f64, f64)) {
        let is_near = (found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9;
        assert!(is_near, "{found:?} {expected:?}");
    }

    #[test]
    fn friction_is_the_pull_without_radiation_beside_its_closed_form() {
        let steady = 0.6 - 0.005 * 10f64.ln();
        // Of prz theta over its steady value follows a hyperbolic cotangent from 10 on: (11 e + 9) / (11 e - 9) behind D_c.
        let e = 1f64.exp();
        for (evolution, state) in [
            ("ageing", (1.0 + 9.0 / e).ln()),
            ("slip", 10f64.ln() / e),
            ("prz", ((11.0 * e + 9.0) / (11.0 * e - 9.0)).ln()),
        ] {
            let [theory, measured] = friction("slip", 2, &step(evolution)).unwrap();
            near(measured[0], (0.0, 0.6));
            near(measured[1], (1.0, 0.6));
            near(theory[0], (0.0, 0.6 + 0.01 * 10f64.ln()));
            near(*theory.last().unwrap(), (1.0, steady + 0.015 * state));
        }
        let [measured, theory] = friction("velocity", 2, &step("slip")).unwrap();
        near(measured[1], (1e-5, 0.6));
        near(theory[0], (1e-6, 0.6));
        near(theory[1], (1e-5, steady));
    }

    /// A window that begins long before the step shows the same from the step on.
    #[test]
    fn slip_counts_from_the_step_of_the_drive() {
        let mut run = step("slip");
        let expected = friction("slip", 2, &run).unwrap();
        let early = WindowRecord { time_s: 0.0, displacement_m: vec![-3e-5], ..run.windows[1].clone() };
        run.windows.push(early);
        assert_ne!(friction("slip", 2, &run).unwrap(), expected);
        let steps = vec![run.plan.grid.nearest_step(1.5); 2];
        run.plan.drive.course = Some(Course::new(1e-6, steps, vec![1e-6, 1e-5], false));
        assert_eq!(friction("slip", 2, &run).unwrap(), expected);
    }

    /// The force without friction is that on the block, and the friction of the law.
    #[test]
    fn friction_that_weakens_follows_its_law_over_slip() {
        let mut run = made_up::run("friction.law = \"rigid\"\nfriction.weakening_slip_m = 1e-6", &[]);
        let per_step = run.plan.block_mass_kg / run.plan.grid.step_s();
        let p = run.plan.normal_load_n[1];
        let rows = [(0.0, 0.0, 0.6), (0.0, 0.0, 0.7), (4e-7, 1e-3, 0.6), (1.5e-6, 3e-3, 0.45)];
        let mut v_before = 0.0;
        run.windows = (1..)
            .zip(rows)
            .map(|(step, (u, v, mu))| {
                let pull_n = mu * p + per_step * (v - v_before);
                v_before = v;
                let [u, v, tau] = [u, v, pull_n].map(|value| vec![value]);
                let (first_block, blocks) = (2, WindowRecord::default());
                WindowRecord {
                    step,
                    first_block,
                    displacement_m: u,
                    velocity_m_per_s: v,
                    tangential_force_n: tau,
                    ..blocks
                }
            })
            .collect();
        run.kept.windows = true;
        let [law, measured] = friction("slip", 2, &run).unwrap();
        assert_eq!(measured.len(), 3, "{measured:?}");
        near(measured[0], (0.0, 0.7));
        near(measured[1], (0.4, 0.6));
        near(measured[2], (1.5, 0.45));
        near(law[0], (0.0, 0.7));
        near(*law.last().unwrap(), (1.5, 0.45));
        run.windows.retain(|record| record.step != 2 && record.step != 3);
        let why = "run test has no dense window of every step with block 2";
        assert_eq!(friction("slip", 2, &run).unwrap_err(), why);
    }

    #[test]
    fn what_a_run_lacks_is_said() {
        let lacks = |block, run: &RunData| friction("slip", block, run).unwrap_err();
        assert_eq!(lacks(1, &step("slip")), "run test has no dense window with block 1");
        assert_eq!(lacks(4, &step("slip")), "run test has no block 4");
        assert_eq!(
            lacks(1, &made_up::run("", &[])),
            "run test has no friction by rate and state, or that weakens by slip"
        );
    }
}
