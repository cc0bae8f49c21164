//! The contacts against the law applied to every junction in every step, and against closed forms
//! (docs/contacts.md).

use asperity_model::resolve;
use asperity_model::{JunctionState, Junctions, Plan, SavedJunctions, mixed};
use asperity_record::JunctionTotals;
use asperity_testkit::DirectContact;

use super::JunctionLoops;
use crate::kernels::by_all;
use crate::step::strength::Strength;

fn plan(sets: &[&str]) -> Plan {
    Plan::new(
        &resolve("chain-junctions", &[&["time.step_s=1e-7"], sets].concat())
            .unwrap_or_else(|error| panic!("{error}")),
    )
}

fn law(plan: &Plan) -> Junctions {
    plan.friction.law.junctions().unwrap()
}

/// Contacts that are moved as prescribed.
struct Rig {
    plan: Plan,
    loops: JunctionLoops,
    state: Box<JunctionState>,
    mean_anchor: Vec<f64>,
    step: u64,
}

impl Rig {
    fn of(plan: Plan) -> Rig {
        let (loops, state) = (JunctionLoops::of(&plan).unwrap(), JunctionState::initial(&plan).unwrap());
        Rig { loops, state, mean_anchor: plan.initial.stick_position_m.clone(), step: 0, plan }
    }

    /// A step of all contacts from `u` to `new_u` under the loads `p`; returns friction and heat.
    fn step(&mut self, u: &[f64], new_u: &[f64], p: &[f64]) -> (Vec<f64>, f64) {
        self.step += 1;
        let mut strength = Strength::new(&self.plan);
        strength.update(&self.plan, p);
        let mut outer = vec![0.0; u.len()];
        self.loops.pull(&mut self.state, &mut self.mean_anchor, &mut outer, &strength, (self.step, u));
        let slip = vec![0.0; u.len()];
        self.loops.repin(&mut self.state, &mut self.mean_anchor, &slip, &strength, (self.step, new_u));
        let v: Vec<f64> = u.iter().zip(new_u).map(|(u, new)| (new - u) / self.plan.grid.step_s()).collect();
        (self.loops.friction_n.clone(), self.loops.heat_and_scheme_j(&v)[0])
    }
}

/// A number from -1 to 1.
fn noise(n: u64, step: u64, kind: u64) -> f64 {
    (mixed(n << 40 ^ step << 4 ^ kind) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

#[test]
fn contacts_do_what_all_of_their_junctions_do() {
    by_random_motion(10_000);
}

#[test]
#[ignore = "a minute: cargo xtask nightly"]
fn contacts_do_so_for_long() {
    by_random_motion(400_000);
}

/// Moves 60 contacts at random, back and forth, fast and slow, under loads that change and lift off.
fn by_random_motion(steps: u64) {
    // Slip times of 20 to 300 steps.
    let sets = ["slider.blocks=60", "friction.healing_time_s=1e-5", "friction.healing_deviation_s=5e-6"];
    let sets = [&sets[..], &["friction.junction_start=drawn", "time.duration_s=1e-3"]].concat();
    let (mut rig, plan) = (Rig::of(plan(&sets)), plan(&sets));
    let mut direct: Vec<DirectContact> = (0..60).map(|n| DirectContact::of(&plan, n)).collect();
    let largest_n = plan.normal_load_n[0];
    let mut u = vec![0.0; 60];
    let (mut aloft, mut heat_j, mut largest_w) = (0, 0.0, 0.0_f64);
    for step in 1..=steps {
        let (mut p, mut new_u) = (vec![0.0; 60], u.clone());
        for n in 0..60 {
            // Each contact has phases of its own: direction and speed, course of the load.
            let (phase, id) = (step / (50 + 7 * n), n + 1);
            let speed_m = 3e-8 * noise(id, phase, 1).powi(5);
            new_u[n as usize] += speed_m + 2e-9 * noise(id, step, 2);
            let load = 0.7 + noise(id, step / 1000, 3) + 0.2 * (step as f64 * 0.01).sin();
            p[n as usize] = largest_n * load.max(0.0);
            aloft += u64::from(load <= 0.0);
        }
        let before: f64 = direct.iter().zip(&new_u).map(|(direct, u)| direct.energy_j(*u)).sum();
        let (friction, heat) = rig.step(&u, &new_u, &p);
        for (n, direct) in direct.iter_mut().enumerate() {
            let pulled = direct.pull_n(step, u[n], p[n]);
            assert!(
                (friction[n] - pulled).abs() < 1e-11 * largest_n,
                "{n} in {step}: {} {pulled}",
                friction[n]
            );
            direct.pin(step, new_u[n], p[n]);
            assert_eq!(rig.state.slipping(n) as usize, direct.slipping(), "contact {n} in step {step}");
        }
        // Where anchors move before the motion, heat is less than the loss at the new place by their work.
        let after: f64 = direct.iter().zip(&new_u).map(|(direct, u)| direct.energy_j(*u)).sum();
        assert!(heat >= 0.0, "{heat}");
        heat_j += heat;
        largest_w = largest_w.max((before - after - heat).abs());
        u = new_u;
    }
    let breaks = direct.iter().map(DirectContact::breaks).sum::<u64>();
    assert_eq!(rig.state.kept.totals.breaks, breaks);
    assert!(breaks > steps && aloft > steps && heat_j > 0.0 && largest_w < 1e-3 * heat_j, "{breaks} {aloft}");
    let slipping: usize = direct.iter().map(DirectContact::slipping).sum();
    assert_eq!(breaks - rig.state.kept.totals.repins, slipping as u64);
}

#[test]
fn all_instruction_sets_give_the_same_bits_and_a_restored_state_goes_on_to_the_bit() {
    let run = |restore: bool| {
        let sets = ["slider.blocks=11", "friction.healing_time_s=1e-5", "friction.healing_deviation_s=5e-6"];
        let mut rig = Rig::of(plan(&[&sets[..], &["time.duration_s=1e-3"]].concat()));
        let mut u = vec![0.0; 11];
        let mut bits = Vec::new();
        for step in 1..4000 {
            let new_u: Vec<f64> =
                u.iter().zip(1..).map(|(u, n)| u + 5e-9 * (1.0 + 2.0 * noise(n, step / 200, 1))).collect();
            let p: Vec<f64> = (1..12).map(|n| 8.0 + noise(n, step / 100, 2)).collect();
            let (friction, heat) = rig.step(&u, &new_u, &p);
            bits.extend(friction.iter().chain([&heat]).chain(&rig.mean_anchor).map(|x| x.to_bits()));
            u = new_u;
            if restore && step % 37 == 0 {
                let restored = JunctionState::try_from(SavedJunctions::from((*rig.state).clone())).unwrap();
                assert!(restored == *rig.state);
                *rig.state = restored;
            }
        }
        bits
    };
    let through = by_all(|| run(false));
    assert!(run(true) == through, "a restored state");
}

#[test]
fn incomplete_states_are_refused() {
    let stored = || SavedJunctions::from(*JunctionState::initial(&plan(&[])).unwrap());
    assert!(JunctionState::try_from(stored()).is_ok());
    for wrong in [
        SavedJunctions { count: 0, ..stored() },
        SavedJunctions { count: 77, ..stored() },
        SavedJunctions { breaks: Vec::new(), ..stored() },
        SavedJunctions { slips_until_step: vec![0; 4999], ..stored() },
    ] {
        assert!(JunctionState::try_from(wrong).is_err());
    }
    let plan = plan(&[]);
    let still = vec![0.0; plan.blocks];
    let fits = |stored: SavedJunctions| {
        JunctionState::try_from(stored).is_ok_and(|state| state.fits(&plan, 9, &still))
    };
    assert!(fits(stored()));
    let mut breaks = vec![0; 5000];
    breaks[..2].fill(u64::MAX);
    let one = JunctionTotals { breaks: 1, repins: 0 };
    // A contact with half of its junctions slipping slides; no junction breaks more often than there are steps.
    let slips = |count: usize, times: u64| {
        let mut stored = stored();
        stored.breaks[..count].fill(times);
        stored.slips_until_step[..count].fill(12);
        let breaks = count as u64 * times;
        SavedJunctions { totals: JunctionTotals { breaks, repins: breaks - count as u64 }, ..stored }
    };
    assert!(fits(slips(49, 9)));
    for wrong in [
        SavedJunctions { anchor_m: vec![f64::INFINITY; 5000], ..stored() },
        SavedJunctions { breaks, ..stored() },
        SavedJunctions { totals: one, ..stored() },
        SavedJunctions { totals_before: one, ..stored() },
        SavedJunctions { slips_until_step: vec![7; 5000], ..stored() },
        slips(50, 9),
        slips(49, 10),
    ] {
        assert!(!fits(wrong));
    }
}

/// One contact under the load `P`, moved as prescribed.
fn single(sets: &[&str]) -> Rig {
    Rig::of(Plan::new(&resolve("junction-slider", sets).unwrap_or_else(|error| panic!("{error}"))))
}

#[test]
fn steady_sliding_falls_from_half_of_mu_s_to_mu_d_with_velocity() {
    for (v, expected, step_s, steps) in [(1e-5, 0.19950, 1e-5, 1_000_000), (1e-3, 0.18109, 1e-6, 200_000)] {
        let mut rig = single(&[&format!("time.step_s={step_s}")]);
        let p = rig.plan.normal_load_n.clone();
        let form = law(&rig.plan).steady_coefficient([0.4, 0.17], p[0], v);
        assert!((form - expected).abs() < 6e-6, "{form}");
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..steps {
            let at = |i: u64| [v * step_s * i as f64];
            let (friction, _) = rig.step(&at(i), &at(i + 1), &p);
            if i >= steps / 5 {
                sum += friction[0];
                count += 1.0;
            }
        }
        let found = sum / count / p[0];
        assert!((found - form).abs() < 3e-4, "{v}: {found} {form}");
    }
}

#[test]
fn a_wide_distribution_yields_earlier() {
    for w in [0.0, 0.05, 0.1, 0.2, 0.35, 0.5] {
        // In 50 us none is pinned again.
        let mut rig = single(&[&format!("friction.junction_width={w}"), "time.step_s=1e-9"]);
        let (p, k) = (rig.plan.normal_load_n.clone(), rig.plan.friction.contact_stiffness_n_per_m[0]);
        let way = 0.5 * p[0] / k / 50_000.0;
        let peak = (0..50_000).map(|i| rig.step(&[way * i as f64], &[way * (i + 1) as f64], &p).0[0]);
        let peak = peak.fold(0.0, f64::max) / p[0];
        let form = law(&rig.plan).peak_coefficient(0.4, 0.17);
        // Of many junctions it is mu_s - w / 2, or mu_d + D^2 / (2 w) of a wide distribution.
        let d: f64 = 0.4 - 0.17;
        let of_many = if w <= d { 0.4 - 0.5 * w } else { 0.17 + 0.5 * d * d / w };
        assert!(
            (peak - form).abs() < 2e-5 && (form - of_many).abs() < 6e-3,
            "w = {w}: {peak} {form} {of_many}"
        );
        assert!(w != 0.05 || (form - 0.37525).abs() < 1e-12, "{form}");
    }
}

#[test]
fn behind_an_arrested_front_contacts_slip_slowly() {
    for (spring_n_per_m, sum_um, log_um) in
        [(13.5e6, 0.30591, 0.30689), (4e6, 0.66945, 0.67472), (2e6, 0.93919, 0.95125)]
    {
        let slow_slip = |seed: u64| {
            let mut rig = single(&[
                &format!("friction.junction_seed={seed}"),
                "time.step_s=1e-6",
                "time.duration_s=0.01",
            ]);
            let (p, contact) = (rig.plan.normal_load_n[0], rig.plan.friction.contact_stiffness_n_per_m[0]);
            let (k, d) = (contact / 100.0, 0.17 * p / contact);
            let law = law(&rig.plan);
            // All slip forwards, in balance with the spring at u = 0.
            let steps = (0..100).map(|j| law.slip_steps(0, j, 1, 1e-6)).collect();
            *rig.state = JunctionState::of(SavedJunctions {
                count: 100,
                anchor_m: vec![-d; 100],
                slips_until_step: steps,
                breaks: vec![1; 100],
                totals: JunctionTotals::default(),
                totals_before: JunctionTotals::default(),
            });
            let mut u = 0.0;
            for _ in 0..9000 {
                // Without mass: the spring balances the pinned and the slipping junctions.
                let pinned: Vec<f64> =
                    rig.state.junctions(0).filter(|(_, slips)| !slips).map(|(x, _)| x).collect();
                let slipping = 100.0 - pinned.len() as f64;
                let pull = 0.17 * p - slipping * 0.17 * p / 100.0 + k * pinned.iter().sum::<f64>();
                let new_u = f64::max(u, pull / (spring_n_per_m + k * pinned.len() as f64));
                rig.step(&[u], &[new_u], &[p]);
                u = new_u;
            }
            let f_slip = 0.17 * p / 100.0;
            let sum = law.slow_slip_m(0.17, p, spring_n_per_m);
            let log = f_slip / k * (contact / spring_n_per_m).ln_1p();
            assert!((1e6 * sum - sum_um).abs() < 2e-4 && (1e6 * log - log_um).abs() < 2e-4, "{sum} {log}");
            (u, sum)
        };
        let runs: Vec<(f64, f64)> = (1..=8).map(slow_slip).collect();
        let (mean, sum) = (runs.iter().map(|(u, _)| u).sum::<f64>() / 8.0, runs[0].1);
        assert!(runs.iter().all(|(u, sum)| *u <= sum + 1e-12 && *u > sum - 1e-9), "{runs:?}");
        assert!((1e6 * (mean - sum)).abs() < 5e-4, "{mean} {sum}");
    }
}
