//! Rules of slip weakening.

use crate::law::weakening::MOST_CORNERS;
use crate::plan::Plan;
use crate::scenario::Scenario;
use crate::scenario::choices::DetachBy;
use crate::scenario::source::Refusals;
use crate::theory::weakening::fall_time_s;
use asperity_record::{counted, short};

/// Refuses keys that contradict each other, and those of a weakening that is not there.
pub(super) fn weakening_is_known(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let friction = &scenario.friction;
    if !friction.law.uses("friction.weakening_slip_m") {
        return;
    }
    let slips_m = scenario.weakening_slip_m();
    if let Some(n) = slips_m.iter().position(|slip_m| *slip_m < 0.0) {
        let key = "friction.weakening_slip_offsets_m";
        refusals.refuse(
            key,
            format!("block {} gets D_c = {} m", n + 1, short(slips_m[n])),
            "D_c >= 0 for every block",
        );
    }
    let (x, s) = (&friction.weakening_fractions, &friction.weakening_shares);
    if s.len() != x.len() {
        let problem =
            format!("{} at {}", counted(s.len() as u64, "share"), counted(x.len() as u64, "fraction"));
        refusals.refuse("friction.weakening_shares", problem, "as many as friction.weakening_fractions");
    }
    if x.len() > MOST_CORNERS || !x.is_sorted_by(|a, b| a < b) {
        let accepted = format!("up to {MOST_CORNERS} ascending numbers above 0 and below 1");
        refusals.refuse("friction.weakening_fractions", format!("{x:?}"), accepted);
    }
    if !scenario.weakens_by_slip() {
        let unused = [
            ("friction.weakening_fractions", !x.is_empty()),
            ("friction.slip_memory_s", friction.slip_memory_s > 0.0),
        ];
        for (key, _) in unused.into_iter().filter(|(_, is_given)| *is_given) {
            refusals.refuse(
                key,
                "friction does not weaken by slip",
                "friction.weakening_slip_m above 0, or no such key",
            );
        }
        return;
    }
    if friction.ageing_coefficient > 0.0 {
        let problem = format!(
            "{} beside friction.weakening_slip_m: how both change mu_s is not known",
            friction.ageing_coefficient
        );
        refusals.refuse("friction.ageing_coefficient", problem, "0, or friction.weakening_slip_m = 0");
    }
    if friction.detach_by == DetachBy::Spring {
        let problem = "\"spring\" beside friction.weakening_slip_m: a contact would detach below the friction it begins with";
        refusals.refuse("friction.detach_by", problem, "\"force\", or friction.weakening_slip_m = 0");
    }
}

/// Refuses a step in which friction falls by more than the inertia of a block allows. For scenarios that obey all rules.
pub(super) fn steps_resolve_the_fall(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    if !scenario.weakens_by_slip() {
        return;
    }
    let plan = Plan::without_given_state(scenario);
    if let Some(longest_s) = fall_time_s(&plan).filter(|time_s| scenario.time.step_s > *time_s) {
        let problem = format!(
            "{:e} is above the time sqrt(m / k_w) in which friction falls, by friction.weakening_slip_m",
            scenario.time.step_s
        );
        refusals.refuse("time.step_s", problem, format!("a number above 0 and up to {longest_s:.3e}"));
    }
}
