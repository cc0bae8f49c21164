//! The law of junctions as docs/contacts.md states it: applied to every junction in every step, by one contact
//! and by a chain. It is what faster programs are compared with.

use asperity_model::{Junctions, Plan};

/// One contact.
pub struct DirectContact {
    law: Junctions,
    /// Which contact, counted from 0.
    n: usize,
    k: f64,
    coefficients: [f64; 2],
    step_s: f64,
    anchors_m: Vec<f64>,
    /// The last step of slip of each junction; 0 if it is pinned.
    slips_until: Vec<u64>,
    breaks: Vec<u64>,
}

impl DirectContact {
    /// Contact `n` at the start of a plan, counted from 0.
    pub fn of(plan: &Plan, n: usize) -> DirectContact {
        let law = plan.friction.law.junctions().expect("a plan with junctions");
        let k = plan.friction.contact_stiffness_n_per_m[n] / law.count as f64;
        let (mean_m, borne_n) = (plan.initial.stick_position_m[n], plan.normal_load_n[n] / law.count as f64);
        DirectContact {
            law,
            n,
            k,
            coefficients: [plan.friction.static_coefficients[n], plan.friction.dynamic_coefficients[n]],
            step_s: plan.grid.step_s(),
            anchors_m: law.offsets(n).iter().map(|q| mean_m + law.width * borne_n * q / k).collect(),
            slips_until: vec![0; law.count],
            breaks: vec![0; law.count],
        }
    }

    /// The friction, N, in a step that begins at `u` under a normal load; junctions break.
    pub fn pull_n(&mut self, step: u64, u: f64, normal_load_n: f64) -> f64 {
        let (k, count) = (self.k, self.law.count as f64);
        let [strength_n, sliding_n] = self.coefficients.map(|mu| mu * normal_load_n / count);
        let d = sliding_n / k;
        for (x, until) in self.anchors_m.iter_mut().zip(&self.slips_until) {
            let dragged = x.max(u - d).min(u + d);
            *x = if *until > 0 { dragged } else { *x };
        }
        // In lanes, which compilers vectorise.
        let mut lanes = [0.0; 8];
        let (groups, rest) = self.anchors_m.as_chunks::<8>();
        for group in groups {
            for (lane, x) in lanes.iter_mut().zip(group) {
                *lane += x;
            }
        }
        let sum = lanes.iter().chain(rest).sum::<f64>();
        let friction_n = k * (count * u - sum);
        let yields = |x: f64, until: u64| (until == 0) & (k * (u - x).abs() >= strength_n);
        let junctions = self.anchors_m.iter().zip(&self.slips_until);
        if junctions.fold(false, |any, (x, until)| any | yields(*x, *until)) {
            for j in 0..self.law.count {
                let stretch = u - self.anchors_m[j];
                if yields(self.anchors_m[j], self.slips_until[j]) {
                    self.anchors_m[j] = if stretch == 0.0 { u } else { u - d * stretch.signum() };
                    self.breaks[j] += 1;
                    let steps = self.law.slip_steps(self.n, j, self.breaks[j], self.step_s);
                    self.slips_until[j] = step.saturating_add(steps);
                }
            }
        }
        friction_n
    }

    /// Pins the junctions that have slipped long enough at the end of a step, at the new `u`.
    pub fn pin(&mut self, step: u64, u: f64, normal_load_n: f64) {
        if normal_load_n > 0.0 {
            for (x, until) in self.anchors_m.iter_mut().zip(&mut self.slips_until) {
                if *until > 0 && *until <= step {
                    (*x, *until) = (u, 0);
                }
            }
        }
    }

    /// How many junctions slip.
    pub fn slipping(&self) -> usize {
        self.slips_until.iter().filter(|until| **until > 0).count()
    }

    /// How often junctions have broken.
    pub fn breaks(&self) -> u64 {
        self.breaks.iter().sum()
    }

    /// Energy of the junctions at `u`, J.
    pub fn energy_j(&self, u: f64) -> f64 {
        self.anchors_m.iter().map(|x| 0.5 * self.k * (u - x) * (u - x)).sum()
    }
}

/// A chain whose drive does not stop.
pub struct DirectChain {
    plan: Plan,
    /// Of each block.
    pub contacts: Vec<DirectContact>,
    /// Displacements and velocities.
    pub u: Vec<f64>,
    /// Velocities.
    pub v: Vec<f64>,
    /// Whether each block slides in the next step.
    pub slides: Vec<bool>,
    tau_n: Vec<f64>,
    step: u64,
}

impl DirectChain {
    /// At the start of a plan.
    pub fn of(plan: Plan) -> DirectChain {
        DirectChain {
            contacts: (0..plan.blocks).map(|n| DirectContact::of(&plan, n)).collect(),
            u: plan.initial.displacement_m.clone(),
            v: plan.initial.velocity_m_per_s.clone(),
            slides: vec![false; plan.blocks],
            tau_n: vec![0.0; plan.blocks],
            step: 0,
            plan,
        }
    }

    /// Takes a step; calls `switched` with every block that begins or ceases to slide, counted from 1.
    pub fn step(&mut self, mut switched: impl FnMut(u64, u32)) {
        let DirectChain { plan, contacts, u, v, slides, tau_n, step } = self;
        *step += 1;
        let dt = plan.grid.step_s();
        plan.elastic.as_chain().expect("a chain").pull(tau_n, u, v);
        for spring in &plan.drive.springs {
            tau_n[spring.block] += spring.force_n(plan.outside(*step, u64::MAX).point_m, u[spring.block]);
        }
        for (tau_n, prestress_n) in tau_n.iter_mut().zip(&plan.prestress_n) {
            *tau_n += prestress_n;
        }
        let factor = plan.outside(*step, u64::MAX).load().scaled_n(1.0);
        for (n, contact) in contacts.iter_mut().enumerate() {
            let normal_load_n = plan.normal_load_n[n] * factor;
            let friction_n = contact.pull_n(*step, u[n], normal_load_n);
            v[n] += (tau_n[n] - friction_n) * dt / plan.block_mass_kg;
            u[n] += dt * v[n];
            contact.pin(*step, u[n], normal_load_n);
            let share = contact.law.sliding_share * contact.law.count as f64;
            let now = contact.slipping() as f64 >= share;
            if now != slides[n] {
                slides[n] = now;
                switched(*step, n as u32 + 1);
            }
        }
    }
}
