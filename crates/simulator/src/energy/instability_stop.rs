//! Stops a run whose time step itself adds more energy than an accurate run can gain from it.
//!
//! While nothing switches, Euler-Cromer conserves an energy that differs from the slider's by `dt v F / 2`,
//! with `F` all forces on a block, at any step below the bound of linear stability. A switch changes `F`,
//! and with it that energy: where the force on a block that moves at `v` rises by `Df`, the scheme does the
//! work `dt v Df / 2`. In an accurate run a slip has one such switch, the detachment, with `Df` at most
//! `(mu_s - mu_d) p`; a block that re-attaches hardly moves. No slip is shorter than a single swing on the
//! stiffest springs `K`: its speed is at most `Df / sqrt(m K)`, its displacement `2 Df / K`, over which
//! friction dissipates `mu_d p` times it. So the scheme does at most
//!
//! ```text
//! (dt sqrt(K / m) / 4) Df / (mu_d p) = (dt / dt_max) (mu_s / mu_d - 1) / 2
//! ```
//!
//! of the energy dissipated by friction, which never exceeds the energy put in. With the coefficients of
//! the default slider the share is at most 0.28 at any step that the scheme admits, hence
//! [`MOST_SCHEME_SHARE`]. Where blocks switch back and forth every few steps, as they do close to `dt_max`,
//! each switch adds work, and the sum is unbounded.
//!
//! A slider released with stored energy may move at once. Then the `dt v F / 2` above contributes by
//! itself: for a swing on `K` it is at most `dt / dt_max` of the energy in motion, which is therefore
//! allowed besides ([`InstabilityStop::stops`]).
//!
//! Only steps in which a block switches are checked. They are recorded whatever the cadences, so a run
//! stops in the same step however it is sampled, and its log contains the evidence.

use asperity_model::Plan;
use asperity_record::StepRecord;

use crate::records::solver::SimulationError;

/// Most work of the scheme, as a share of the energy that was put in.
pub const MOST_SCHEME_SHARE: f64 = 0.3;

/// Compares the work of the scheme with the energy put in.
#[derive(Debug, Clone)]
pub(crate) struct InstabilityStop {
    step_share: f64,
    initial_j: f64,
    threshold_j: f64,
}

impl InstabilityStop {
    /// For runs of a plan, with the initial energy `initial_j`.
    pub(crate) fn of(plan: &Plan, initial_j: f64) -> InstabilityStop {
        let drive = plan.drive.stiffness_n_per_m(plan.elastic.nodes());
        let thresholds = plan.friction.static_threshold_n.iter().zip(drive).enumerate();
        let parts_j = thresholds.map(|(n, (threshold_n, drive_n_per_m))| {
            let held_by_n_per_m =
                plan.elastic.diagonal_n_per_m(n) + plan.friction.springs_n_per_m[n] + drive_n_per_m;
            0.5 * threshold_n * threshold_n / held_by_n_per_m
        });
        InstabilityStop { step_share: plan.step_share(), initial_j, threshold_j: parts_j.sum() }
    }

    /// The error that stops the run in the step of this record, if any.
    pub(crate) fn stops(&self, record: &StepRecord) -> Option<SimulationError> {
        if record.switches.is_empty() {
            return None;
        }
        let energy = &record.energy;
        let scheme_work_j = energy.scheme_work_j;
        // Lower bound on the scale, since the drive's work is zero at the start of a front or where it
        // does not move: the energy of springs at every block that pull with `mu_s p`.
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
