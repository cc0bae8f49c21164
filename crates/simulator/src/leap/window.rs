//! Windows: many steps at once while no block switches.
//!
//! A state is expanded in terms ([`expansion`]), which give it after any number of steps. A window
//! extends as far as bounds on each block's motion exclude a switch ([`certificate`]), truncation and
//! rounding included ([`crate::leap::norms`]). `rows` has the layout in memory.

mod certificate;
mod expansion;
mod rows;

use asperity_model::body::elastic::Chain;
use asperity_model::{Plan, SliderState};

use crate::energy::Accounts;
use crate::leap::chebyshev::Length;
use crate::leap::cost::GRID_STEPS;
use crate::leap::cost::{self, LONG_CHAIN, Work};
use crate::leap::window::certificate::Certificate;
use crate::leap::window::expansion::Expansion;

/// The open window, or the last one.
#[derive(Debug, Clone)]
pub(crate) struct Window {
    expansion: Expansion,
    certificate: Certificate,
    /// Steps until the first switch, as predicted when it was opened.
    foreseen_steps: f64,
    /// Terms used for it.
    terms_taken: usize,
    /// Whether no length of window pays in this chain, which is long; then none is tried.
    pub(crate) never_pays: bool,
    /// Sums of displacements over the states inside the window.
    sums_m: Vec<f64>,
}

impl Window {
    pub(crate) fn new(plan: &Plan, chain: &Chain) -> Window {
        let expansion = Expansion::new(plan, chain);
        let lengths = &expansion.basis.lengths;
        let pays = |length: &Length| length.steps > cost::least_window_steps(length.terms as u64);
        Window {
            never_pays: plan.blocks > LONG_CHAIN && !lengths.iter().any(pays),
            expansion,
            certificate: Certificate::new(plan),
            foreseen_steps: 0.0,
            terms_taken: 0,
            sums_m: vec![0.0; plan.blocks],
        }
    }

    /// Steps of the window with this length index.
    pub(crate) fn steps(&self, index: usize) -> u64 {
        self.expansion.basis.lengths[index].steps
    }

    /// Steps of the shortest window.
    pub(crate) fn shortest(&self) -> u64 {
        if self.never_pays {
            return u64::MAX;
        }
        self.expansion.basis.lengths.first().map_or(u64::MAX, |length| length.steps)
    }

    /// Number of differences and terms computed, for the counters.
    pub(crate) fn applications(&self) -> u64 {
        self.expansion.applications
    }

    /// Work of the last attempt to open a window.
    pub(crate) fn work(&self) -> Work {
        Work { terms: self.terms_taken as u64, places: self.certificate.places }
    }

    /// Predicts the steps until the first switch, by linear extrapolation of forces and velocities.
    pub(crate) fn foresee(&mut self, plan: &Plan, state: &SliderState) -> f64 {
        if self.expansion.start(plan, state) { self.expansion.foreseen_steps() } else { 0.0 }
    }

    /// Opens a window of at most `most_steps` steps. Returns the index of its length if the bounds
    /// exclude a switch of any block over that length, or else the number of steps to take singly.
    pub(crate) fn open(&mut self, plan: &Plan, state: &SliderState, most_steps: u64) -> Result<usize, u64> {
        let shortest = self.shortest();
        if shortest == u64::MAX {
            return Err(WITHOUT_WINDOWS);
        }
        if most_steps < shortest {
            return Err(most_steps);
        }
        self.terms_taken = 0;
        self.certificate.places = 0;
        if !self.expansion.start(plan, state) {
            return Err(1);
        }
        let foreseen = self.expansion.foreseen_steps();
        self.foreseen_steps = foreseen;
        if let Some(single_steps) = self.refused_by(foreseen) {
            return Err(single_steps);
        }
        let fitting = self
            .expansion
            .basis
            .lengths
            .partition_point(|length| {
                length.steps <= most_steps && length.steps as f64 <= FORESIGHT * foreseen
            })
            .max(1);
        let index = fitting - 1;
        let sizes = self.expansion.sizes(plan);
        let ends = self.expansion.take_enough_terms(plan, index, &sizes);
        self.terms_taken = self.expansion.terms;
        match self.certificate.longest(plan, state, &self.expansion, index, &sizes, ends) {
            Some(index) => Ok(index),
            None => Err(shortest),
        }
    }

    /// The number of steps to take singly if the predicted switch is nearer than the shortest window.
    pub(crate) fn refused_by(&self, foreseen_steps: f64) -> Option<u64> {
        let shortest = self.shortest();
        let refused = shortest < u64::MAX && foreseen_steps < shortest as f64;
        refused.then_some((foreseen_steps as u64).max(1))
    }

    /// Whether a switch is predicted just after the end of the open window.
    pub(crate) fn ends_near_switch(&self, index: usize) -> bool {
        self.refused_by(self.foreseen_steps - self.steps(index) as f64).is_some()
    }

    /// Goes on by a number of steps on the grid of [`GRID_STEPS`], as many as fit into `steps`, and adds their energies.
    pub(crate) fn advance(&mut self, plan: &Plan, steps: u64, state: &mut SliderState, accounts: &Accounts) {
        let Window { expansion, sums_m, .. } = self;
        let steps = steps / GRID_STEPS * GRID_STEPS;
        expansion.compose(plan, steps, state);
        let from_step = state.step;
        state.step += steps;
        state.sliding = state.detached;
        let coefficients = &expansion.basis.triple_sum(steps)[..expansion.terms];
        let start_m = &expansion.first_u.row(0)[..plan.blocks];
        let first_m = |n: usize| start_m[n];
        if !accounts.corrects_heat() && plan.drive.springs.len() <= FEW_SPRINGS {
            let sum_m = |n: usize| expansion.displacement_sum_m(n, steps, coefficients);
            Accounts::add_drive(plan, state, from_step, steps, sum_m, first_m);
            return;
        }
        expansion.displacement_sums_m(sums_m, steps, coefficients);
        Accounts::add_drive(plan, state, from_step, steps, |n| sums_m[n], first_m);
        // Sum over the states after each step: without the first state, with the last.
        accounts.correct_heat(plan, &mut state.energy, sums_m, 1.0);
        accounts.correct_heat(plan, &mut state.energy, start_m, -1.0);
        accounts.correct_heat(plan, &mut state.energy, &state.displacement_m, 1.0);
    }
}

/// Largest number of driving springs for which sums are computed separately.
const FEW_SPRINGS: usize = 4;

/// Number of single steps between attempts to jump where there are no windows.
const WITHOUT_WINDOWS: u64 = 1000;

/// How much longer than the predicted switch a window may be.
const FORESIGHT: f64 = 1.1;

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, Scenario, ScenarioSource, SliderState};

    use super::Window;
    use crate::kernels;
    use crate::records::solver::Solver;
    use crate::step::plain::Plain;

    /// A chain without switches for a long time: thresholds out of reach, some blocks slide fast, the
    /// others stick.
    fn free_run(set: &str) -> (Plan, Plain) {
        let source = ScenarioSource::new("test", "parameter_set = \"as-coded\"\ntime.duration_s = 1")
            .with_override(set);
        let mut plan = Plan::new(&Scenario::resolve(&source).unwrap());
        plan.friction.static_threshold_n.fill(1e9);
        plan.friction.dynamic_friction_n.fill(0.1);
        let mut plain = Plain::new(plan.clone());
        let mut state = plain.state().clone();
        for n in 0..plan.blocks {
            // Waves of all lengths.
            let pattern = ((n * n * 7919) % 101) as f64 / 101.0;
            state.displacement_m[n] = 1e-6 * pattern;
            state.velocity_m_per_s[n] = 1e-3 * pattern;
            if n % 3 == 0 {
                state.velocity_m_per_s[n] += 10.0;
                state.slip[n] = 1.0;
                state.detached += 1;
            }
        }
        plain.restore(&state.clone().into());
        (plan, plain)
    }

    fn land(window: &Window, plan: &Plan, index: usize, state: &mut SliderState) {
        window.expansion.compose(plan, window.steps(index), state);
        state.step += window.steps(index);
    }

    #[test]
    fn windows_of_every_length_land_where_single_steps_do() {
        for set in ["parameter_set=as-coded", "parameter_set=as-stated", "slider.relative_damping=0"] {
            let (plan, start) = free_run(set);
            let mut window = Window::new(&plan, &plan.elastic.as_chain().unwrap());
            let lengths = window.expansion.basis.lengths.len();
            let mut compared = 0;
            for opened in 0..lengths {
                let state = start.state().clone();
                assert!(window.expansion.start(&plan, &state));
                window.expansion.scale_springs(&plan);
                window.expansion.take_terms(&plan, 0, window.expansion.basis.lengths[opened].terms);
                let left_out = |index: usize| {
                    let length = &window.expansion.basis.lengths[index];
                    let factors = length.left_out_of_sum(window.expansion.terms);
                    [window.expansion.terms - 1, window.expansion.terms]
                        .iter()
                        .zip(factors)
                        .map(|(&j, factor)| factor * kernels::largest(window.expansion.v.row(j)))
                        .sum::<f64>()
                };
                let mut plain = Plain::new(plan.clone());
                plain.restore(&state.clone().into());
                'lengths: for index in 0..=opened {
                    while plain.step() < window.steps(index) {
                        plain.take_step();
                        if !plain.switched().is_empty() {
                            break 'lengths;
                        }
                    }
                    compared += 1;
                    let mut landed = state.clone();
                    land(&window, &plan, index, &mut landed);
                    let exact = plain.state();
                    assert_eq!(landed.step, exact.step);
                    // In displacement per step, as `left_out`.
                    let dt = plan.grid.step_s();
                    let allowed = 10.0 * left_out(index) + 1e-11 * dt;
                    for n in 0..plan.blocks {
                        let off = (landed.velocity_m_per_s[n] - exact.velocity_m_per_s[n]).abs() * dt;
                        assert!(off <= allowed, "{set}, {index} of {opened}, block {n}: {off} {allowed}");
                    }
                    assert!(index == 0 || left_out(index - 1) <= left_out(index), "less for fewer steps");
                }
            }
            assert!(compared > 20, "{set}: {compared}");
        }
    }

    #[test]
    fn calm_states_take_fewer_terms_and_land_as_exactly() {
        for set in ["parameter_set=as-coded", "parameter_set=as-stated"] {
            let (plan, start) = free_run(set);
            let mut window = Window::new(&plan, &plan.elastic.as_chain().unwrap());
            let (mut fewer, lengths) = (0, window.expansion.basis.lengths.len());
            for index in 0..lengths {
                let mut counts = Vec::new();
                for agitation in [1e-12, 1e-6, 1.0] {
                    // All blocks slide towards the driven side, and vibrate a little.
                    let mut state = start.state().clone();
                    state.step = (1e-3 / (plan.drive.velocity_m_per_s * plan.grid.step_s())) as u64;
                    for n in 0..plan.blocks {
                        let pattern = ((n * n * 7919) % 101) as f64 / 101.0;
                        state.displacement_m[n] = 1e-3;
                        state.velocity_m_per_s[n] = 10.0 + agitation * pattern;
                        state.slip[n] = 1.0;
                    }
                    state.detached = plan.blocks as u32;
                    assert!(window.expansion.start(&plan, &state));
                    let sizes = window.expansion.sizes(&plan);
                    let ends = window.expansion.take_enough_terms(&plan, index, &sizes);
                    let length = &window.expansion.basis.lengths[index];
                    let left_out = length.left_out_of(window.expansion.terms, ends);
                    assert!(window.expansion.terms == length.terms || sizes.are_negligible(left_out));
                    counts.push(window.expansion.terms);

                    let mut plain = Plain::new(plan.clone());
                    plain.restore(&state.clone().into());
                    while plain.step() < state.step + window.steps(index) {
                        plain.take_step();
                        assert!(plain.switched().is_empty());
                    }
                    land(&window, &plan, index, &mut state);
                    let exact = plain.state();
                    for n in 0..plan.blocks {
                        let off_m = (state.displacement_m[n] - exact.displacement_m[n]).abs();
                        let off_m_per_s = (state.velocity_m_per_s[n] - exact.velocity_m_per_s[n]).abs();
                        assert!(
                            off_m <= 1e-3 * 1e-12 && off_m_per_s <= 10.0 * 1e-12,
                            "{off_m} {off_m_per_s}"
                        );
                    }
                }
                assert!(counts.is_sorted(), "{set}, length {index}: {counts:?}");
                fewer += usize::from(counts[0] < counts[2]);
            }
            assert!(2 * fewer > lengths, "{set}: {fewer} of {lengths}");
        }
    }
}
