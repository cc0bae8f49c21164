//! The keys of friction.

use std::ops::Bound::{Excluded, Included, Unbounded};

use asperity_record::bounds::LONGEST_NAME_BYTES;

use super::section::section;
use crate::law::laws::{self, FrictionLaw};
use crate::law::rate_and_state::Evolution;
use crate::scenario::choices::{DetachBy, JunctionStart, Reattach};
use crate::scenario::key::Kind::{Count, Flag, Number, Numbers, Text, Word};
use crate::scenario::key::Need::{Chain, OneRowAcross};
use crate::scenario::key::{NOT_NEGATIVE, POSITIVE};
use crate::scenario::keys::List;

/// Most junctions of a contact.
const MOST_JUNCTIONS: u64 = 10_000;
/// Largest perturbation of a start, `ln(V / V_l)`: from nanometres to kilometres per second.
const MOST_PERTURBATION: f64 = 30.0;
/// Largest friction while a contact weakens, above sliding friction, over that at which it detaches.
const MOST_SHARE: f64 = 10.0;

section! {
    /// `[friction]`
    Friction "friction." {
        /// The law of friction.
        law: FrictionLaw = "interfacial-springs"; Word(FrictionLaw::WORDS) => laws::MEANING;
        /// A stuck block detaches at |tau_n| >= mu_s p_n; a junction breaks at mu_s of its load.
        static_coefficient: f64 = 0.7; NOT_NEGATIVE, "mu_s";
        /// A sliding block feels -mu_d p_n sign(v_n), a slipping junction mu_d of its load; not above
        /// static_coefficient.
        dynamic_coefficient: f64 = 0.45; NOT_NEGATIVE, "mu_d";
        /// Stiffness of the friction spring of a stuck block (5.12) over that between blocks. Of a chain,
        /// friction.decay_length_m may be written instead, which stays where the number of blocks changes.
        interfacial_stiffness_ratio: f64 = 1.0; POSITIVE, "k_t / k";
        /// When a sliding block re-attaches: one-way, at a new velocity <= 0 (the thesis' program); two-way, where the
        /// velocity changes sign or vanishes, and so after one step if it has never moved; turn, over an area and only
        /// there, where the velocity has turned by a right angle or more from the direction of the slip. The laws rigid
        /// and velocity-weakening are two-way: there a block stops where its velocity changes sign, and goes on from
        /// exactly 0.
        reattach: Reattach = "one-way"; Word(Reattach::WORDS);
        /// Of interfacial-springs: which force detaches a stuck block where it reaches mu_s p_n: force, the sum |tau_n|
        /// of all forces but friction (5.13); spring, that of its friction spring, |k_t (u_n - u_stick,n)|. At rest
        /// they are equal; before a front tau_n is larger. Of chains and single blocks.
        detach_by: DetachBy = "force"; Word(DetachBy::WORDS);
        needs &[(Chain, "how contacts of this body detach by their springs is not derived")];
        /// Of velocity-weakening: sliding friction is mu_d p / (1 + |v| / v_c) (2.4).
        weakening_velocity_m_per_s: f64 = 0.1; POSITIVE, "v_c";
        /// Of rigid and velocity-weakening: whether mu_d p resists a block from the first step of its slip, in which it
        /// begins at rest. Otherwise nothing resists in that step, which adds mu_d p dt / m to its velocity: small
        /// beside a slip of mu_s - mu_d, unless the two are nearly equal.
        drag_at_rest: bool = false; Flag;
        /// Damping -E v of a sliding block, as by waves that it radiates (2.4); of chains, not by junctions.
        radiation_kg_per_s: f64 = 0.0; NOT_NEGATIVE, "E";
        needs &[(Chain, "this body carries the waves away itself; radiation is that of a chain's contacts")];
        /// Of junctions: how many each contact has.
        junction_count: u32 = 100; Count(1, MOST_JUNCTIONS), "N_s";
        /// Of junctions: one that bears the load f at rest is a spring of stiffness sqrt(kappa f).
        junction_constant_n_per_m2: f64 = 39.2e9; POSITIVE, "kappa";
        /// Of junctions: mean time for which a broken one slips before it is pinned again. Ruptures link detachments up
        /// to twice this time apart, or longer by detection.link_time_ratio.
        healing_time_s: f64 = 0.002; POSITIVE, "t_R";
        /// Of junctions: standard deviation of that time, which is normally distributed and above 0.
        healing_deviation_s: f64 = 0.0006; NOT_NEGATIVE;
        /// Of junctions: width of the uniform distribution of their forces at the start, over the load that each bears.
        junction_width: f64 = 0.05; NOT_NEGATIVE, "w";
        /// Of junctions: whether these forces are evenly spread or drawn.
        junction_start: JunctionStart = "even"; Word(JunctionStart::WORDS);
        /// Of junctions: seed of the slip times and of a drawn start (docs/contacts.md), the same on every machine.
        junction_seed: u32 = 1; Count(0, 4_294_967_295);
        /// Of junctions: a contact slides while at least this share of its junctions slips.
        sliding_share: f64 = 0.5; Number(Excluded(0.0), Included(1.0));
        /// Of rate-and-state: the rise of friction over the normal load with the logarithm of the velocity, while the
        /// state is the same.
        direct_effect: f64 = 0.01; POSITIVE, "a";
        /// Of rate-and-state: the rise of friction over the normal load with the logarithm of the state theta. Steady
        /// friction falls with velocity where b > a.
        evolution_effect: f64 = 0.015; POSITIVE, "b";
        /// Of rate-and-state: what is added to b, block by block; empty for nothing. Every sum is above 0.
        evolution_offsets: List = List::new(); Numbers(Unbounded, Unbounded);
        /// Of rate-and-state: the slip over which the state changes.
        critical_slip_m: f64 = 1e-6; POSITIVE, "D_c";
        /// Of rate-and-state: the velocity at which steady friction over the normal load is f_0.
        reference_velocity_m_per_s: f64 = 1e-6; POSITIVE, "V_0";
        /// Of rate-and-state: friction over the normal load in steady sliding at V_0.
        reference_coefficient: f64 = 0.6; POSITIVE, "f_0";
        /// Of rate-and-state, how the state theta changes: ageing, by 1 - |v| theta / D_c, at rest as well; slip, by
        /// -(|v| theta / D_c) ln(|v| theta / D_c), by slip alone; prz, by 1 - (v theta / 2 D_c)^2.
        evolution: Evolution = "ageing"; Word(Evolution::WORDS);
        /// Of rate-and-state: whether blocks have inertia. Without it (quasi-dynamic) the forces on each block, -E v
        /// among them, balance at every time; radiation_kg_per_s must be above 0 and slider.relative_damping 0, and
        /// slider.mass_kg sets only the link time of ruptures and the wave speed that front speeds are compared with.
        inertia: bool = true; Flag;
        /// Of rate-and-state with time.start = "loaded": blocks begin at the velocity V e^x in the state of steady
        /// sliding at V, the velocity of the drive, perturbed by x, with springs that balance the friction of this start.
        initial_kick: f64 = 0.01; Number(Included(-MOST_PERTURBATION), Included(MOST_PERTURBATION)), "x";
        /// Of rate-and-state with time.start = "loaded": the velocity at which all blocks begin instead; 0 for V e^x.
        /// With it the drive may begin at rest.
        initial_velocity_m_per_s: f64 = 0.0; NOT_NEGATIVE, "V(0)";
        /// Such velocities block by block, instead of the key; empty for none.
        initial_velocities_m_per_s: List = List::new(); Numbers(Excluded(0.0), Unbounded);
        /// Of rate-and-state: the state in which all contacts begin; 0 for that of steady sliding at the velocity of the
        /// drive, or of the block if the drive begins at rest.
        initial_theta_s: f64 = 0.0; NOT_NEGATIVE, "theta(0)";
        /// Such states block by block, instead of the key; empty for none.
        initial_thetas_s: List = List::new(); Numbers(Excluded(0.0), Unbounded);
        /// A file of columns x_over_l, velocity_m_per_s and theta_s, named from the current folder: both lists,
        /// interpolated between its rows in their logarithms; of a single block one row. It is read once; the run's log
        /// holds what it said.
        initial_csv: String = ""; Text(LONGEST_NAME_BYTES);
        /// Of rate-and-state, which never sticks: a block counts as detached from where its speed rises above V_th to
        /// where it falls below V_th / 2. Must exceed the speeds of drive and blocks at the start; 0 for 10 times the
        /// largest speed of the drive, or less in a course with short fast parts (docs/contacts.md); in a medium 0 for
        /// 1 mm/s. Never changes the
        /// run, but onsets and durations of events depend on it.
        event_speed_m_per_s: f64 = 0.0; NOT_NEGATIVE, "V_th";
        /// Ageing of interfacial-springs: mu_s grows as mu_s + b ln(1 + t_w / t_0) with the time t_w for which a block
        /// has stuck.
        ageing_coefficient: f64 = 0.0; NOT_NEGATIVE, "b";
        needs &[(OneRowAcross, "the strength of contacts that age is not checked for forces along a vector")];
        /// Time scale of ageing.
        ageing_time_s: f64 = 1.0; POSITIVE, "t_0";
        /// What is added to mu_s, block by block; empty for nothing.
        static_offsets: List = List::new(); Numbers(Unbounded, Unbounded);
        /// What is added to mu_d, block by block; empty for nothing.
        dynamic_offsets: List = List::new(); Numbers(Unbounded, Unbounded);
        /// The slip over which friction falls from mu_s p to mu_d p (docs/slip-weakening.md), of rigid and
        /// interfacial-springs; 0 for at once.
        weakening_slip_m: f64 = 0.0; NOT_NEGATIVE, "D_c";
        needs &[(OneRowAcross, "slip along a vector has no length that is known here")];
        /// What is added to D_c, block by block; empty for nothing. Every sum is 0 or above.
        weakening_slip_offsets_m: List = List::new(); Numbers(Unbounded, Unbounded);
        needs &[(OneRowAcross, "slip along a vector has no length that is known here")];
        /// Up to three slips over D_c, ascending, at which the fall of friction changes its slope.
        weakening_fractions: List = List::new(); Numbers(Excluded(0.0), Excluded(1.0)), "x_i";
        /// Friction at these slips: mu_d p + s_i (mu_s - mu_d) p.
        weakening_shares: List = List::new(); Numbers(Included(0.0), Included(MOST_SHARE)), "s_i";
        /// Of rigid: how long a block must rest before it detaches at mu_s p again, instead of at the friction to which
        /// it had weakened when it stopped. 0 for at once.
        slip_memory_s: f64 = 0.0; NOT_NEGATIVE, "t_h";
        /// Blocks that never detach, unless nothing presses them, counted from 1, ascending: their mu_s is 1e6.
        stuck_blocks: List = List::new(); Numbers(Included(1.0), Unbounded);
        /// Random spread that is added to mu_s, block by block: by disorder.distribution half the width, the standard
        /// deviation, or half the distance of two values; what was drawn stands in the table drawn.
        static_spread: f64 = 0.0; NOT_NEGATIVE;
        /// The same for mu_d.
        dynamic_spread: f64 = 0.0; NOT_NEGATIVE;
        /// Seed of the spread: SplitMix64 of seed and block (docs/rules.md), the same on every machine.
        spread_seed: u32 = 1; Count(0, 4_294_967_295);
    }
}
