//! Whether the time step itself does more work than an honest run can have of it.
//!
//! While nothing switches, Euler-Cromer keeps an energy of its own, which is that of the slider but
//! for `dt v F / 2`, with `F` all forces on a block; any step below the bound of linear stability
//! will do. A switch changes `F`, and with it that energy: where the force on a block that moves at
//! `v` rises by `Df`, the scheme does the work `dt v Df / 2`. In an honest run a slip has one such
//! switch, the detachment, with `Df` at most `(mu_s - mu_d) p`; a block that re-attaches hardly
//! moves. No slip is shorter than a single swing on the stiffest springs `K`: its speed is at most
//! `Df / sqrt(m K)`, its way `2 Df / K`, on which friction takes `mu_d p` times it. So the scheme
//! does at most
//!
//! ```text
//! (dt sqrt(K / m) / 4) Df / (mu_d p) = (dt / dt_max) (mu_s / mu_d - 1) / 2
//! ```
//!
//! of what friction takes, and that is never more than was put in. With the coefficients of the
//! default slider no honest run has more than 0.28 of it at any step that the scheme admits: hence
//! [`MOST_SCHEME_SHARE`]. Where blocks switch back and forth every few steps, as they do close to
//! `dt_max`, each time is paid for, and the sum knows no bound.
//!
//! What was stored at the start may be in motion at once, where the slider is released there. Then the
//! `dt v F / 2` from above counts itself: for a swing on `K` it is at most `dt / dt_max` of the energy
//! in motion, and that much is allowed of it ([`InstabilityStop::stops`]).
//!
//! It looks at steps in which a block switches, which are recorded whatever the cadences: a
//! run ends in the same step however it is sampled, and what it is judged by is in its log.

use asperity_model::Plan;
use asperity_record::StepRecord;

use crate::solver::SimulationError;

/// Most work of the scheme, as a share of the energy that was put in.
pub const MOST_SCHEME_SHARE: f64 = 0.3;

/// Holds the work of the scheme against what was put in.
#[derive(Debug, Clone)]
pub(crate) struct InstabilityStop {
    step_share: f64,
    initial_j: f64,
    threshold_j: f64,
}

impl InstabilityStop {
    /// Of the runs of a plan, which begin with this energy.
    pub(crate) fn of(plan: &Plan, initial_j: f64) -> InstabilityStop {
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let drive = plan.drive.stiffness_n_per_m(plan.elastic.nodes());
        let thresholds = plan.friction.static_threshold_n.iter().zip(drive).enumerate();
        let parts_j = thresholds.map(|(n, (threshold_n, drive_n_per_m))| {
            let held_by_n_per_m = plan.elastic.diagonal_n_per_m(n) + kt + drive_n_per_m;
            0.5 * threshold_n * threshold_n / held_by_n_per_m
        });
        InstabilityStop { step_share: plan.step_share(), initial_j, threshold_j: parts_j.sum() }
    }

    /// Whether a run is stopped in the step of a record.
    pub(crate) fn stops(&self, record: &StepRecord) -> Option<SimulationError> {
        let energy = record.energy.as_ref().filter(|_| !record.switches.is_empty())?;
        let scheme_work_j = energy.scheme_work_j;
        // The drive is no measure where it does not move, and at the start of a front nothing has
        // been done yet: so it is never less than of what the springs at every block hold when they
        // pull with `mu_s p`.
        let kinds = [
            (MOST_SCHEME_SHARE, energy.drive_work_j, "the work of the drive"),
            (MOST_SCHEME_SHARE, energy.prestress_work_j, "the work of the prestress"),
            (MOST_SCHEME_SHARE.max(self.step_share), self.initial_j, "what was stored at the start"),
            (MOST_SCHEME_SHARE, self.threshold_j, "what springs hold at the thresholds of friction"),
        ];
        let most = kinds.into_iter().max_by(|a, b| (a.0 * a.1).total_cmp(&(b.0 * b.1)));
        let (share, put_in_j, put_in) = most.filter(|(share, j, _)| scheme_work_j.abs() > share * j)?;
        Some(SimulationError::Energy { step: record.step, scheme_work_j, share, put_in_j, put_in })
    }
}
