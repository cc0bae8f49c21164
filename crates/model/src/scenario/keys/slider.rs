//! The keys of the scenario itself and of the slider.

use asperity_record::MOST_BLOCKS;
use asperity_record::bounds::LONGEST_NAME_BYTES;
use toml::Value;

use super::section::section;
use crate::law::laws::FrictionLaw;
use crate::scenario::choices::{End, MediumChoice, ParameterSet};
use crate::scenario::key::Kind::{Count, Text, Word};
use crate::scenario::key::Need::{Blocks, Chain, Laws};
use crate::scenario::key::{AS_STATED, Key, MOST_ROWS, NOT_NEGATIVE, Need, POSITIVE};

/// The keys of the scenario itself, in the order in which they are shown.
pub(super) fn names() -> Vec<Key> {
    let key = |path, kind, default: &str, doc| Key {
        path,
        symbol: "",
        doc,
        kind,
        defaults: Some([default, default].map(Value::from)),
        needs: &[],
    };
    let line = Text(LONGEST_NAME_BYTES);
    let sets = "Parameter set, which gives the defaults of mass and damping: as-stated follows the text of the thesis, a \
                slider of 0.012 kg; as-coded follows the computations of its program, a slider of 12 kg, because the \
                units of the program were inconsistent by a factor of 1000 (docs/model.md).";
    vec![
        key("name", line, "unnamed", "Name of the scenario; does not affect the run."),
        key("summary", line, "", "One line on what it is for; does not affect the run."),
        key("parameter_set", Word(ParameterSet::WORDS), AS_STATED, sets),
    ]
}

const ENDS: &[(Need, &str)] = &[
    (Chain, "it is an end of a chain, and this body has sides"),
    (Blocks, "it is an end of a chain, and one block has none"),
    (Laws(FrictionLaw::has_two_states), "it is not derived for this law"),
];

section! {
    /// `[slider]`
    Slider "slider." {
        /// Number of blocks in the chain, 1 for a block on its driving spring; of a slab, a sheet and a body, number of
        /// nodes along the sliding direction, and so of contacts in a row, from 2.
        blocks: u32 = 100; Count(1, MOST_BLOCKS), "N";
        /// Rows of contacts across the sliding direction: 1 for a chain or a slab, more for a sheet, or with
        /// slider.rows above 1 for a body (docs/bodies.md).
        across: u32 = 1; Count(1, MOST_ROWS), "N_y";
        /// Rows of nodes, one above the other: 1 for a chain or a sheet, more for a slab (docs/bodies.md) or a body; the
        /// nodes at the bottom rub.
        rows: u32 = 1; Count(1, MOST_ROWS), "N_z";
        /// Length of the slider in the direction of sliding; the spacing is a = L / (N - 1), L of a single
        /// block. In a medium, that of the fault line.
        length_m: f64 = 0.1; POSITIVE, "L_x";
        /// Width of the slider; over an area, L_y / (N_y - 1) must be the spacing a.
        width_m: f64 = 0.005; POSITIVE, "L_y";
        /// Height of the slider; of a slab and of a body, L_z / (N_z - 1) must be the spacing a; of a sheet, its
        /// thickness.
        height_m: f64 = 0.02; POSITIVE, "L_z";
        /// Mass of the whole slider; the blocks of a chain share it evenly, m = M / N, and so do the nodes of other
        /// sliders. slider.density_kg_per_m3 may be written instead. Where neither is, and a side changes, the density
        /// stays; as-coded has 12 kg all the same.
        mass_kg: f64 = 12.0, as_stated 0.012; POSITIVE, "M";
        /// Young's modulus; the springs between blocks have k = E (N - 1) L_y L_z / L_x (5.5), those of a slab k = 3 E
        /// L_y / 4, of a sheet k = 3 E L_z / 4, both k / 2 along diagonals, those of a body k = 0.4 E a. A single block
        /// has no such spring; of its k = E L_y L_z / L_x there follow k_t and the wave speed.
        youngs_modulus_pa: f64 = 2.5e9; POSITIVE, "E";
        /// Viscous damping between neighbours (5.7) over its critical value sqrt(k m) (5.31).
        relative_damping: f64 = 3.162_277_660_168_379_5, as_stated 0.1; NOT_NEGATIVE, "eta / sqrt(k m)";
        /// What block 1 of a chain is joined to besides block 2: free, nothing; clamped, a wall at rest, by a spring k
        /// and a damper eta like those between blocks; absorbing, a dashpot of the impedance sqrt(k m), which takes up
        /// long waves (docs/model.md); periodic, block N, by a spring and a damper. All are relaxed at the start. Of
        /// chains of 2 blocks or more whose blocks stick.
        left_end: End = "free"; Word(End::WORDS); needs ENDS;
        /// What block N is joined to, likewise; either both ends are periodic or neither.
        right_end: End = "free"; Word(End::WORDS); needs ENDS;
        /// What joins the blocks: none, their bonds; or the stress that slip causes in an elastic medium around a fault
        /// line, of which they are the nodes, by depth: half-space, below a free surface; whole-space; periodic, where
        /// the line repeats itself. Forces are then per metre of strike, friction is rate-and-state without inertia, and
        /// the keys of medium say what nodes and medium are.
        medium: MediumChoice = "none"; Word(MediumChoice::WORDS);
    }
}
