//! Predictions of the theory, for tables, figures and tests.
//!
//! Lengths are relative to the slider length (`x = L_p / L`), loads relative to the normal load,
//! unless a unit is named. Transcendental functions come from the `libm` crate, so that tables are
//! byte-identical on every machine.

use crate::plan::Plan;
use crate::plan::disorder::Quantity;
use crate::plan::initial;
use crate::plan::load::Load;
use crate::scenario::Scenario;
use crate::scenario::choices::DriveKind;

/// The prediction of `F_T / F_N` at a precursor length that a table is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
pub enum LengthLaw {
    /// (5.22) of the thesis, for a tilted load.
    #[serde(rename = "tilted")]
    Tilted,
    /// (5.52), for an initial shear profile.
    #[serde(rename = "initial-shear")]
    InitialShear,
    /// (5.57), the straight line.
    #[serde(rename = "linear")]
    Linear,
    /// The balance of a front under any drive, [`balance_load_ratio`]; not an equation of the
    /// thesis.
    #[serde(rename = "balance")]
    Balance,
    /// (5.22) with the shear that the stuck blocks ahead of the front carry,
    /// [`screened_load_ratio`]; not an equation of the thesis.
    #[serde(rename = "screened")]
    Screened,
}

impl LengthLaw {
    /// The law that fits a scenario: the balance for a drive from the top, (5.52) with initial
    /// shear, (5.22) with a tilted load, otherwise the straight line (5.57).
    pub fn natural(scenario: &Scenario) -> LengthLaw {
        if scenario.drive.kind == DriveKind::Top {
            LengthLaw::Balance
        } else if initial::beta(scenario) != 0.0 {
            LengthLaw::InitialShear
        } else if scenario.normal_load.tilt != 0.0 {
            LengthLaw::Tilted
        } else {
            LengthLaw::Linear
        }
    }

    /// Whether there are laws for its slider and its friction: a chain with free ends by whose friction blocks stick.
    pub fn are_known(scenario: &Scenario) -> bool {
        scenario.has_theory() && scenario.friction.law.sticks()
    }

    /// Whether the laws apply to a scenario: to a chain that is driven in one direction and whose
    /// prestress is smaller than sliding friction on every block. All laws balance the growing
    /// force of a drive with the friction behind the front. Without a drive nothing grows; and
    /// where the prestress exceeds friction, a front needs no drive and never stops.
    pub fn is_for(scenario: &Scenario) -> bool {
        let drive = &scenario.drive;
        let is_driven =
            drive.velocity_m_per_s > 0.0 && drive.course_s.is_empty() && drive.stiffness_n_per_m > 0.0;
        let is_known = !matches!(drive.kind, DriveKind::LeftRight | DriveKind::Force | DriveKind::Plate);
        let is_even = Quantity::Load.is_even(scenario);
        if !is_known || !LengthLaw::are_known(scenario) || !is_driven || !is_even {
            return false;
        }
        let plan = Plan::new(scenario);
        if plan.has_contact_courses() {
            return false;
        }
        let taken_n = &plan.friction.dynamic_friction_n;
        plan.prestress_n.iter().zip(taken_n).all(|(given_n, taken_n)| *given_n <= 0.0 || given_n < taken_n)
    }

    /// Its name in pipelines, tables and file names.
    pub fn word(self) -> &'static str {
        match self {
            LengthLaw::Tilted => "tilted",
            LengthLaw::InitialShear => "initial-shear",
            LengthLaw::Linear => "linear",
            LengthLaw::Balance => "balance",
            LengthLaw::Screened => "screened",
        }
    }

    /// The label in legends.
    pub fn label(self) -> &'static str {
        match self {
            LengthLaw::Tilted => "theory of a tilted load",
            LengthLaw::InitialShear => "theory with initial shear",
            LengthLaw::Linear => "F_T/F_N = μ_d L_p/L",
            LengthLaw::Balance => "quasi-static balance",
            LengthLaw::Screened => "with the shear ahead of the front",
        }
    }

    /// The prediction of `F_T / F_N` for a precursor of length `x = L_p / L`.
    pub fn load_ratio(self, parameters: &LengthLawParameters, x: f64) -> f64 {
        match self {
            LengthLaw::Tilted => tilted_load_ratio(parameters.mu_d, parameters.theta, x),
            LengthLaw::InitialShear => initial_shear_load_ratio(parameters, x),
            LengthLaw::Linear => parameters.mu_d * x,
            LengthLaw::Balance => balance_load_ratio(parameters, x),
            LengthLaw::Screened => screened_load_ratio(parameters, x),
        }
    }
}

/// The distribution of the driving force along the slider while displacements are small compared
/// with the travel of the drive point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriveShare {
    /// All at the driven end.
    End,
    /// Along the whole slider, with this tilt towards the driven end.
    Tilted(f64),
    /// Decaying from the driven end over this length, relative to the slider length.
    Decaying(f64),
}

impl DriveShare {
    fn of(scenario: &Scenario) -> DriveShare {
        let drive = &scenario.drive;
        match drive.kind {
            DriveKind::Side | DriveKind::LeftRight | DriveKind::Force | DriveKind::Plate => DriveShare::End,
            DriveKind::Top if drive.decay_length_m > 0.0 => {
                DriveShare::Decaying(drive.decay_length_m / scenario.slider.length_m)
            }
            DriveKind::Top => DriveShare::Tilted(drive.tilt),
        }
    }

    /// Share of the driving force that acts on the first `x` of the slider.
    fn behind(self, x: f64) -> f64 {
        match self {
            DriveShare::End => 1.0,
            DriveShare::Tilted(tilt) => x * (1.0 + tilt * (1.0 - x)),
            DriveShare::Decaying(length) => (1.0 - libm::exp(-x / length)) / (1.0 - libm::exp(-1.0 / length)),
        }
    }
}

/// The parameters of the predictions; all dimensionless.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthLawParameters {
    /// Static coefficient minus the uniform prestress ratio: for a slider that slides forward, a
    /// force in proportion to the normal load is equivalent to weaker friction.
    pub mu_s: f64,
    /// Dynamic coefficient, `mu_k` in the thesis' Chapter 5, minus the prestress ratio.
    pub mu_d: f64,
    /// Tilt of the normal load.
    pub theta: f64,
    /// Amplitude of the initial shear, including that of Poisson's expansion.
    pub beta: f64,
    /// Screening length over slider length, `l_0 / L`.
    pub screening: f64,
    /// Where the drive acts.
    pub drive: DriveShare,
}

impl LengthLawParameters {
    /// The parameters of a scenario.
    pub fn of(scenario: &Scenario) -> LengthLawParameters {
        let plan = Plan::new(scenario);
        LengthLawParameters {
            mu_s: plan.friction.static_coefficient - scenario.prestress.ratio,
            mu_d: plan.friction.dynamic_coefficient - scenario.prestress.ratio,
            theta: scenario.normal_load.tilt,
            beta: initial::beta(scenario),
            screening: plan.screening_length_m() / plan.length_m,
            drive: DriveShare::of(scenario),
        }
    }
}

/// `mu_k x (1 + theta (1 - x))` (5.22).
pub fn tilted_load_ratio(mu_d: f64, theta: f64, x: f64) -> f64 {
    mu_d * x * (1.0 + theta * (1.0 - x))
}

/// `mu_k` and `theta` of [`tilted_load_ratio`] by points, each a length and a load ratio, with their standard errors, by
/// least squares; none of fewer than four points. What the law neglects makes the errors up to ten times too small.
pub fn tilted_law(points: &[[f64; 2]]) -> Option<[[f64; 2]; 2]> {
    let [mut aa, mut ab, mut bb, mut ay, mut by] = [0.0; 5];
    for [x, y] in points {
        let bend = x - x * x;
        [aa, ab, bb, ay, by] = [aa + x * x, ab + x * bend, bb + bend * bend, ay + x * y, by + bend * y];
    }
    let determinant = aa * bb - ab * ab;
    let (a, b) = ((bb * ay - ab * by) / determinant, (aa * by - ab * ay) / determinant);
    let squares: f64 = points.iter().map(|[x, y]| (y - a * x - b * (x - x * x)).powi(2)).sum();
    let variance = squares / (points.len() as f64 - 2.0) / determinant;
    let (a_error, b_error) = ((variance * bb).sqrt(), (variance * aa).sqrt());
    let is_fit = points.len() > 3 && determinant > 0.0 && a > 0.0;
    is_fit.then(|| [[a, a_error], [b / a, (b_error / a).hypot(b * a_error / (a * a))]])
}

/// `mu_k P(x) / D(x)`, with the shares `P` of the normal load and `D` of the driving
/// force on the first `x` of the slider.
///
/// Slipped blocks carry sliding friction, and stuck blocks carry the part of the drive that acts on
/// them, so the drive behind the front balances the friction there. A drive at the end alone gives
/// (5.22) and (5.57); a uniform drive and load give `mu_k` at every length: nothing stops a front.
/// Neglected are screening (5.39), initial shear and the relief of driving springs by slip.
pub fn balance_load_ratio(parameters: &LengthLawParameters, x: f64) -> f64 {
    // The limit of small x, where both shares vanish.
    let x = x.max(1e-9);
    tilted_load_ratio(parameters.mu_d, parameters.theta, x) / parameters.drive.behind(x)
}

/// `F_T / F_N` at which the first block of an evenly loaded slider detaches under a
/// top drive that falls off over `decay_length_m` from it:
/// `mu_s (d + l0) / L (1 - exp(-L / d))`.
///
/// From `kt u - k a^2 u'' = K_n V t` with a free end at `x = 0` and `l0` as in (5.39),
/// for a slider much longer than `l0`.
pub fn decaying_drive_onset(mu_s: f64, decay_length_m: f64, screening_length_m: f64, length_m: f64) -> f64 {
    mu_s * (decay_length_m + screening_length_m) / length_m * (1.0 - libm::exp(-length_m / decay_length_m))
}

/// (5.52): sliding friction behind the tip, a decay from `alpha p` with
/// `alpha = (mu_s + mu_k) / 2` ahead of it, on top of the initial shear.
pub fn initial_shear_load_ratio(parameters: &LengthLawParameters, x: f64) -> f64 {
    let LengthLawParameters { mu_s, mu_d, beta, screening: l, .. } = *parameters;
    let alpha = (mu_s + mu_d) / 2.0;
    let decayed = libm::exp(-(1.0 - x) / l);
    mu_d * x
        + 2.0 * beta * l * l * (decayed - 1.0)
        + beta * (1.0 - x) * x
        + l * (beta * (1.0 + decayed - 2.0 * x) + alpha * (1.0 - decayed))
}

/// `mu_k x (1 + theta (1 - x)) + alpha (1 + theta (1 - 2 x)) l (1 - exp(-(1 - x) / l))`, with
/// `l = l_0 / L`: (5.22) plus the force on the stuck blocks ahead of the tip.
///
/// The second term is the integral of `alpha p(L_p) exp(-(x - L_p) / l_0)` in (5.48), for the
/// normal load `p` at the tip (5.18), without initial shear. A uniform load reduces it to (5.52).
/// It explains why a straight line through precursors has the intercept `alpha l_0 / L`, where
/// (5.22) and (5.57) have none.
pub fn screened_load_ratio(parameters: &LengthLawParameters, x: f64) -> f64 {
    let LengthLawParameters { mu_s, mu_d, theta, screening, .. } = *parameters;
    let ahead = screening * (1.0 - libm::exp(-(1.0 - x) / screening));
    let load_at_tip = 1.0 + theta * (1.0 - 2.0 * x);
    tilted_load_ratio(mu_d, theta, x) + (mu_s + mu_d) / 2.0 * load_at_tip * ahead
}

/// The load of a side-driven slider over time while precursors grow, up to the first slip of the
/// whole slider; not an equation of the thesis.
///
/// The driving spring has `F_T = K (V t - u_1)` (5.8), so the displacement of block 1 is needed.
/// The first `L_p` of the slider has slipped and carries sliding friction; the rest has hardly
/// moved. The force along the slider therefore decreases from `F_T` at the driven end to 0 at `L_p`
/// by the friction in between, linearly for a uniform load. Its mean there is `F_T / 2`, it
/// compresses that part by `F_T L_p / (2 E A)`, and (5.57) has `L_p = L F_T / (mu_k F_N)`:
///
/// `K V t = F_T [1 + (K L / 2 E A) F_T / (mu_k F_N)]`.
///
/// At `F_T = mu_k F_N` this is `t = mu_k F_N / (K V) [1 + K L / (2 E A)]`. The mean slope of
/// `F_T / F_N` up to `mu_k` therefore follows from `K`, `V`, `F_N` and the slider's stiffness
/// `E A / L` alone, independent of the coefficients of friction: the thesis' 0.17 /s (5.56). A
/// tilted load replaces (5.57) by (5.22). Neglected are vibrations and screening (5.39), which
/// moves block 1 by at most another `alpha F_N l_0 / (E A)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadCurve {
    /// `K`.
    drive_n_per_m: f64,
    /// `V`.
    velocity_m_per_s: f64,
    /// `E A / L`.
    slider_n_per_m: f64,
    /// `F_N`.
    normal_load_n: f64,
    /// `mu_k`, minus the ratio of a uniform prestress.
    mu_d: f64,
    /// Tilt of the normal load.
    theta: f64,
    /// The time at which the drive or the normal load first changes its course.
    until_s: f64,
    /// The load ratio at which the drive point stops.
    until_ratio: f64,
}

impl LoadCurve {
    /// The curve of a scenario that meets its assumptions: a chain with free ends and a drive at the side, a
    /// normal load that is constant at the start, no initial shear, at most a uniform prestress,
    /// blocks that can all slide, and sliding friction in proportion to the normal load. `None` for others.
    pub fn of(scenario: &Scenario) -> Option<LoadCurve> {
        let (friction, prestress) = (&scenario.friction, &scenario.prestress);
        let law = scenario.contact_law();
        let is_plain_friction = law.affine().is_some()
            && law.radiation_kg_per_s() == 0.0
            && friction.stuck_blocks.is_empty()
            && friction.dynamic_offsets.iter().all(|offset| *offset == 0.0)
            && friction.dynamic_spread == 0.0
            && Quantity::Stiffness.is_even(scenario);
        let is_unstrained = initial::beta(scenario) == 0.0 && scenario.initial_shear.profile.is_empty();
        let is_even_prestress = prestress.first_block_ratio == 0.0
            && prestress.rise_ratio == 0.0
            && prestress.from_blocks.is_empty()
            && prestress.profile.is_empty();
        let mu_d = friction.dynamic_coefficient - prestress.ratio;
        let is_from_the_side = scenario.drive.kind == DriveKind::Side && LengthLaw::is_for(scenario);
        if !(is_from_the_side && is_plain_friction && is_unstrained && is_even_prestress && mu_d > 0.0) {
            return None;
        }
        let plan = Plan::new(scenario);
        let hold_step = plan.drive.hold_from_step.unwrap_or(u64::MAX);
        let is_constant =
            [0, 1, 2].iter().all(|&step| plan.outside(step, hold_step).load() == Load::OF_START);
        is_constant.then(|| LoadCurve {
            drive_n_per_m: scenario.drive.stiffness_n_per_m,
            velocity_m_per_s: plan.drive.velocity_m_per_s,
            slider_n_per_m: plan.elastic.stiffness_n_per_m * plan.spacing_m / plan.length_m,
            normal_load_n: plan.total_normal_load_n,
            mu_d,
            theta: scenario.normal_load.tilt,
            until_s: plan.grid.time_s(plan.outside(0, hold_step).steady_until_step().min(plan.steps)),
            until_ratio: plan.drive.until_load_ratio.unwrap_or(f64::INFINITY),
        })
    }

    /// `F_T / F_N` with the front at `x = L_p / L` (5.22).
    fn load_ratio(&self, x: f64) -> f64 {
        tilted_load_ratio(self.mu_d, self.theta, x)
    }

    /// The time at which the front is at `x = L_p / L`, s.
    fn time_at_s(&self, x: f64) -> f64 {
        let force_n = self.load_ratio(x) * self.normal_load_n;
        // The mean of the force behind the front over the slider, from (5.22) by one integration.
        let mean_force_n =
            self.mu_d * self.normal_load_n * x * x * (0.5 + self.theta * (0.5 - 2.0 * x / 3.0));
        let stretch_m = mean_force_n / self.slider_n_per_m;
        (force_n / self.drive_n_per_m + stretch_m) / self.velocity_m_per_s
    }

    /// The time at which `F_T / F_N` reaches `mu_k` and the whole slider slides, s; `None` if the
    /// drive stops or the normal load changes before that.
    pub fn time_to_dynamic_s(&self) -> Option<f64> {
        let time_s = self.time_at_s(1.0);
        (time_s <= self.until_s && self.mu_d <= self.until_ratio).then_some(time_s)
    }

    /// `F_T / F_N` up to `mu_k`, over time in s, until the drive or the normal load changes its
    /// course.
    pub fn points(&self) -> Vec<(f64, f64)> {
        const PIECES: u32 = 200;
        (0..=PIECES)
            .map(|piece| f64::from(piece) / f64::from(PIECES))
            .map(|x| (self.time_at_s(x), self.load_ratio(x)))
            .take_while(|&(time_s, ratio)| time_s <= self.until_s && ratio <= self.until_ratio)
            .collect()
    }
}

/// Tangential force along a stuck chain just before the first block detaches (5.45):
/// `(tau_1 - tau0(x)) exp(-x / l0) + tau0(x)`, in any one unit of force.
pub fn stuck_tangential_force(first: f64, initial: f64, distance_m: f64, screening_length_m: f64) -> f64 {
    (first - initial) * libm::exp(-distance_m / screening_length_m) + initial
}

/// The factor by which the force in a stuck discrete chain decreases from block to block: the root
/// below 1 of `q + 1/q = 2 + k_t / k`.
pub fn discrete_decay_per_block(stiffness_ratio: f64) -> f64 {
    let half = 1.0 + stiffness_ratio / 2.0;
    // Written as a quotient, because half - sqrt(half^2 - 1) cancels.
    1.0 / (half + (stiffness_ratio * (1.0 + stiffness_ratio / 4.0)).sqrt())
}

/// Number of blocks of a stuck chain, including block 1, that carry more than `threshold` of the
/// force on block 1.
pub fn affected_blocks(stiffness_ratio: f64, threshold: f64) -> u32 {
    let decay = discrete_decay_per_block(stiffness_ratio);
    let mut blocks = 0;
    let mut force = 1.0;
    while force > threshold {
        blocks += 1;
        force *= decay;
    }
    blocks
}

/// Velocity of one mode of the free chain after a unit impulse at `t = 0`, from the
/// roots (5.28) of `m z^2 + eta s z + k s = 0` with `s = 4 sin^2(kappa a / 2)`.
///
/// `relative_damping` is `eta / sqrt(k m)` and `phase` is `t sqrt(k / m)`.
pub fn mode_velocity(shape: f64, relative_damping: f64, phase: f64) -> f64 {
    let rate = relative_damping * shape / 2.0;
    let discriminant = rate * rate - shape;
    let decay = libm::exp(-rate * phase);
    if discriminant < 0.0 {
        let omega = (-discriminant).sqrt();
        decay * (libm::cos(omega * phase) - rate / omega * libm::sin(omega * phase))
    } else if discriminant > 0.0 {
        let root = discriminant.sqrt();
        // Both exponents are negative, so nothing overflows at long times.
        let slow = libm::exp((root - rate) * phase);
        let fast = libm::exp((-root - rate) * phase);
        ((1.0 - rate / root) * slow + (1.0 + rate / root) * fast) / 2.0
    } else {
        decay * (1.0 - rate * phase)
    }
}

/// `s = 4 sin^2(kappa a / 2)` of mode `j` of a free chain of `blocks` blocks,
/// `kappa a = pi j / N`.
pub fn mode_shape(mode: u32, blocks: u32) -> f64 {
    let sine = libm::sin(std::f64::consts::PI * f64::from(mode) / (2.0 * f64::from(blocks)));
    4.0 * sine * sine
}

/// Number of over-damped modes of a free chain with damping `eta / sqrt(k m)`: those with
/// `eta > sqrt(k m) / sin(kappa a / 2)` (5.30).
pub fn overdamped_modes(relative_damping: f64, blocks: u32) -> u32 {
    let is_overdamped = |mode: &u32| relative_damping * mode_shape(*mode, blocks).sqrt() > 2.0;
    (1..blocks).filter(is_overdamped).count() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn theory_is_of_free_ends_alone() {
        let of = |sets: &[&str]| {
            let scenario = crate::resolve("default", sets).unwrap();
            let plan = Plan::new(&scenario);
            let is_known = [LengthLaw::is_for(&scenario), LengthLaw::are_known(&scenario), plan.has_decay()];
            let has_curve = LoadCurve::of(&scenario).is_some();
            assert!(is_known.iter().all(|known| *known == has_curve), "{sets:?} {is_known:?} {has_curve}");
            has_curve
        };
        assert!(of(&[]) && of(&["friction.detach_by=spring"]));
        for end in ["clamped", "absorbing"] {
            assert!(!of(&[&format!("slider.right_end={end}")]) && !of(&[&format!("slider.left_end={end}")]));
        }
        assert!(!of(&["slider.left_end=periodic", "slider.right_end=periodic"]));
    }

    const DEFAULT: LengthLawParameters = LengthLawParameters {
        mu_s: 0.7,
        mu_d: 0.45,
        theta: 0.0,
        beta: 0.0,
        screening: 1.0 / 99.0,
        drive: DriveShare::End,
    };

    /// (5.48) with its missing parentheses, integrated by Simpson's rule.
    fn integrated(p: &LengthLawParameters, lp: f64) -> f64 {
        let alpha = (p.mu_s + p.mu_d) / 2.0;
        let tau0 = |x: f64| p.beta * (2.0 * x - 1.0);
        let ahead = |x: f64| (alpha - tau0(x)) * (-(x - lp) / p.screening).exp() + tau0(x);
        let panels = 20_000;
        let h = (1.0 - lp) / f64::from(panels);
        let sum: f64 = (0..panels)
            .map(|i| {
                let x = lp + f64::from(i) * h;
                (ahead(x) + 4.0 * ahead(x + h / 2.0) + ahead(x + h)) * h / 6.0
            })
            .sum();
        p.mu_d * lp + sum
    }

    #[test]
    fn closed_form_5_52_is_the_integral_5_48() {
        for beta in [0.0, 0.225, 0.45, -0.3] {
            for screening in [1.0 / 99.0, 0.07] {
                let p = LengthLawParameters { beta, screening, ..DEFAULT };
                for lp in [0.0, 0.1, 0.5, 0.93, 1.0] {
                    let (closed, direct) = (initial_shear_load_ratio(&p, lp), integrated(&p, lp));
                    assert!((closed - direct).abs() < 1e-9, "beta {beta}, Lp/L {lp}: {closed} {direct}");
                }
            }
        }
    }

    #[test]
    fn there_is_no_length_law_where_nothing_drives_or_nothing_holds() {
        assert!(LengthLaw::is_for(&scenario("")));
        assert!(LengthLaw::is_for(&scenario("prestress.ratio = 0.44")));
        for none in [
            "drive.velocity_m_per_s = 0.0",
            "drive.stiffness_n_per_m = 0.0",
            "drive.kind = \"left-right\"\nfriction.reattach = \"two-way\"",
            // mu_d = 0.45: the prestress is as large as sliding friction.
            "prestress.ratio = 0.45",
            "prestress.ratio = 0.6",
            "prestress.ratio = 0.2\nprestress.rise_ratio = 0.3",
        ] {
            assert!(!LengthLaw::is_for(&scenario(none)), "{none}");
        }
    }

    #[test]
    fn predictions_end_at_the_dynamic_coefficient() {
        let p = LengthLawParameters { theta: 0.8333, beta: 0.45, ..DEFAULT };
        for law in [LengthLaw::Tilted, LengthLaw::InitialShear, LengthLaw::Linear, LengthLaw::Screened] {
            assert!((law.load_ratio(&p, 1.0) - 0.45).abs() < 1e-15, "{law:?}");
        }
    }

    #[test]
    fn the_shear_ahead_of_the_front_is_that_of_5_52() {
        for x in [0.0, 0.3, 0.97, 1.0] {
            let initial_shear = initial_shear_load_ratio(&DEFAULT, x);
            assert!((screened_load_ratio(&DEFAULT, x) - initial_shear).abs() < 1e-15, "{x}");
        }
        // alpha l_0 / L = 0.575 / 99 far from the end, and 1.5 times that at 1.5 times the load.
        assert!((screened_load_ratio(&DEFAULT, 0.5) - (0.225 + 0.575 / 99.0)).abs() < 1e-15);
        let tilted = LengthLawParameters { theta: 0.5, ..DEFAULT };
        assert!((screened_load_ratio(&tilted, 0.0) - 1.5 * 0.575 / 99.0).abs() < 1e-15);
    }

    fn scenario(toml: &str) -> Scenario {
        Scenario::resolve(&crate::ScenarioSource::new("test", toml)).unwrap()
    }

    fn load_curve(toml: &str) -> Option<LoadCurve> {
        LoadCurve::of(&scenario(toml))
    }

    #[test]
    fn the_load_curve_comes_to_mu_k_when_worked_out_by_hand() {
        // K L / (2 E A) = 0.16, so t = 1.16 mu_k 400 N / (80 N/s) = 5.8 mu_k.
        for (mu_d, time_s) in [(0.45, 2.610), (0.9, 5.220), (0.225, 1.305), (0.6, 3.480), (0.3, 1.740)] {
            let coefficients = format!("dynamic_coefficient = {mu_d}, static_coefficient = 1.4");
            let curve = load_curve(&format!("friction = {{ {coefficients} }}\ntime.duration_s = 6")).unwrap();
            let ours = curve.time_to_dynamic_s().unwrap();
            assert!((ours - time_s).abs() < 1e-9, "mu_k {mu_d}: {ours}");
            assert!((mu_d / ours - 0.172_413_793).abs() < 1e-8);
            let last = curve.points().pop().unwrap();
            assert!((last.0 - time_s).abs() < 1e-9 && (last.1 - mu_d).abs() < 1e-15, "{last:?}");
        }
    }

    #[test]
    fn blocks_that_never_slide_have_no_load_curve() {
        assert!(load_curve("slider.blocks = 50").is_some());
        assert!(load_curve("slider.blocks = 50\nfriction.stuck_blocks = [50]").is_none());
    }

    #[test]
    fn the_load_curve_is_its_closed_form_and_that_of_a_chain_block_by_block() {
        for theta in [0.0, -0.8333, 0.5] {
            let scenario = scenario(&format!("slider.blocks = 1000\nnormal_load.tilt = {theta}"));
            let curve = LoadCurve::of(&scenario).unwrap();
            let plan = Plan::new(&scenario);
            for (time_s, ratio) in curve.points().into_iter().skip(1).step_by(33) {
                let force_n = 400.0 * ratio;
                if theta == 0.0 {
                    let closed = force_n * (1.0 + 0.16 * force_n / (0.45 * 400.0));
                    assert!((80.0 * time_s - closed).abs() < 1e-9, "{time_s} s: {closed}");
                }
                // Blocks slide from block 1 on until their friction balances the load.
                let (mut left_n, mut stretch_m) = (force_n, 0.0);
                for friction_n in &plan.friction.dynamic_friction_n {
                    left_n -= friction_n;
                    if left_n <= 0.0 {
                        break;
                    }
                    stretch_m += left_n / plan.elastic.stiffness_n_per_m;
                }
                let by_blocks = (force_n / 8e5 + stretch_m) / 1e-4;
                assert!((time_s / by_blocks - 1.0).abs() < 2e-3, "tilt {theta}: {time_s} {by_blocks}");
            }
        }
    }

    #[test]
    fn there_is_a_load_curve_for_simple_cases_and_as_long_as_they_are() {
        for other in [
            "drive.kind = \"top\"",
            "drive.velocity_m_per_s = 0",
            "initial_shear.beta = 0.2",
            "prestress.rise_ratio = 0.1",
            "prestress.first_block_ratio = 0.1",
            "friction.law = \"velocity-weakening\"",
            "friction.dynamic_spread = 0.1",
        ] {
            assert_eq!(load_curve(other), None, "{other}");
        }
        let held = load_curve("drive.hold_from_s = 1.0").unwrap();
        assert_eq!(held.time_to_dynamic_s(), None);
        let (time_s, ratio) = held.points().pop().unwrap();
        assert!((0.98..=1.0).contains(&time_s) && (0.17..0.2).contains(&ratio), "{time_s} {ratio}");
        let stopped = load_curve("drive.until_load_ratio = 0.3").unwrap();
        assert_eq!(stopped.time_to_dynamic_s(), None);
        assert!((stopped.points().pop().unwrap().1 - 0.3).abs() < 0.003);
        let unloaded = "normal_load = { schedule_s = [1.0, 2.0], schedule_n = [400.0, 100.0] }";
        assert!(load_curve(unloaded).unwrap().points().pop().unwrap().0 <= 1.0);
        // A uniform prestress is equivalent to weaker friction.
        let helped = load_curve("prestress.ratio = 0.2").unwrap();
        assert!((helped.time_to_dynamic_s().unwrap() - 5.8 * 0.25).abs() < 1e-9);
    }

    #[test]
    fn the_balance_is_the_known_laws_for_a_drive_at_the_end_and_flat_for_an_even_one() {
        for theta in [-0.8333, 0.0, 0.5] {
            let p = LengthLawParameters { theta, ..DEFAULT };
            for x in [0.1, 0.5, 1.0] {
                let tilted = tilted_load_ratio(0.45, theta, x);
                assert!((balance_load_ratio(&p, x) - tilted).abs() < 1e-15);
                // A drive with the distribution of the load has the same balance at every length.
                let top = LengthLawParameters { drive: DriveShare::Tilted(theta), ..p };
                assert!((balance_load_ratio(&top, x) - 0.45).abs() < 1e-14);
            }
        }
        let at = |length: f64, x: f64| {
            balance_load_ratio(&LengthLawParameters { drive: DriveShare::Decaying(length), ..DEFAULT }, x)
        };
        // Short decay: a drive at the end. Long decay: a uniform drive.
        assert!((at(1e-3, 0.3) - 0.135).abs() < 1e-12 && (at(1e4, 0.3) - 0.45).abs() < 1e-4);
        assert!((at(0.2, 1.0) - 0.45).abs() < 1e-15);
    }

    #[test]
    fn a_decaying_drive_detaches_block_1_where_worked_out_by_hand() {
        // 0.7 * 0.11 * (1 - e^-10), and the uniform drive's 0.7 for a very long decay.
        assert!((decaying_drive_onset(0.7, 0.01, 0.001, 0.1) - 0.076_996_504_2).abs() < 1e-9);
        assert!((decaying_drive_onset(0.7, 1e3, 0.001, 0.1) - 0.7).abs() < 1e-4);
    }

    #[test]
    fn values_worked_out_by_hand() {
        // 0.45 * 0.3 * (1 + 0.8333 * 0.7) = 0.135 * 1.58331
        assert!((tilted_load_ratio(0.45, 0.8333, 0.3) - 0.213_746_85).abs() < 1e-12);
        // q + 1/q = 3 has the root (3 - sqrt 5) / 2, the square of the golden section.
        assert!((discrete_decay_per_block(1.0) - 0.381_966_011_250_105).abs() < 1e-15);
        // 28 - 16 = 12 N over one length l0: 16 + 12 / e
        assert!((stuck_tangential_force(28.0, 16.0, 2.0, 2.0) - 20.414_553_294_057_307).abs() < 1e-12);
    }

    #[test]
    fn affected_blocks_of_the_discrete_chain() {
        let counts = [0.1, 0.5, 2.0, 10.0].map(|ratio| affected_blocks(ratio, 0.0049));
        assert_eq!(counts, [17, 8, 5, 3]);
    }

    #[test]
    fn mode_velocity_solves_its_equation_in_every_regime() {
        for damping in [0.0, 0.2, 1.0, 10f64.sqrt()] {
            let shape = 4.0;
            let v = |t: f64| mode_velocity(shape, damping, t);
            assert!((v(0.0) - 1.0).abs() < 1e-15);
            // v'' + eta s v' + s v = 0 by central differences.
            for t in [0.2, 1.0, 3.0] {
                let h = 1e-4;
                let first = (v(t + h) - v(t - h)) / (2.0 * h);
                let second = (v(t + h) - 2.0 * v(t) + v(t - h)) / (h * h);
                let residual = second + damping * shape * first + shape * v(t);
                assert!(residual.abs() < 1e-5, "damping {damping}, t {t}: {residual}");
            }
        }
    }

    #[test]
    fn critical_damping_of_the_shortest_wave_leaves_all_others_under_damped() {
        assert_eq!(overdamped_modes(1.0, 100), 0);
        // sin(pi j / 200) > 1 / sqrt 10 from j = 21 on: waves shorter than 9.8 blocks.
        assert_eq!(overdamped_modes(10f64.sqrt(), 100), 79);
    }

    #[test]
    fn shortest_wave_is_critical_at_5_31() {
        assert!((mode_shape(99, 100) - 4.0).abs() < 1e-3);
        assert_eq!(mode_shape(0, 100), 0.0);
    }
}
