//! The keys of what differs from contact to contact.

use std::ops::Bound::{Excluded, Included, Unbounded};

use asperity_record::bounds::LONGEST_NAME_BYTES;

use super::section::section;
use crate::scenario::choices::Distribution;
use crate::scenario::key::Kind::{Number, Numbers, Text, Word};
use crate::scenario::key::Need::{Chain, OneRow};
use crate::scenario::key::{NOT_NEGATIVE, Need};
use crate::scenario::keys::List;

const STIFFNESS: &[(Need, &str)] = &[(Chain, "its contacts have no k_t of their own")];
const LOAD: &[(Need, &str)] = &[(OneRow, "its contacts have no p of their own")];

section! {
    /// `[disorder]`
    Disorder "disorder." {
        /// How all that is drawn is distributed (friction.static_spread, dynamic_spread, stiffness_spread,
        /// load_spread): uniform, from mean - spread to mean + spread; normal, lognormal and weibull, with the spread
        /// as standard deviation; two-valued, mean + spread in asperities, mean - spread elsewhere, so that the mean of
        /// all shifts by (2 asperity_share - 1) spread.
        distribution: Distribution = "uniform"; Word(Distribution::WORDS);
        /// Of weibull: the modulus of the distribution, which is scaled and shifted to mean and spread.
        weibull_modulus: f64 = 2.0; Number(Included(0.1), Included(1e3));
        /// Of two-valued: the probability that a contact is in an asperity.
        asperity_share: f64 = 0.5; Number(Excluded(0.0), Excluded(1.0));
        /// Length over which what is drawn for two contacts is related: the normal numbers behind it have the
        /// correlation exp(-(|dx| + |dy|) / length); 0 for draws of their own.
        correlation_length_m: f64 = 0.0; NOT_NEGATIVE;
        /// Spread of the friction springs' stiffness k_t of the blocks of a chain, over its mean; 0 for none.
        stiffness_spread: f64 = 0.0; NOT_NEGATIVE; needs STIFFNESS;
        /// Spread of the normal load p of the contacts of a chain or a sheet, over p; 0 for none. The loads are scaled
        /// so that they add up to normal_load.total_n.
        load_spread: f64 = 0.0; NOT_NEGATIVE; needs LOAD;
        /// What is added to k_t, over k_t, block by block; empty for nothing.
        stiffness_offsets: List = List::new(); Numbers(Unbounded, Unbounded); needs STIFFNESS;
        /// What is added to p, over p, block by block, before the scaling to the total; empty for nothing.
        load_offsets: List = List::new(); Numbers(Unbounded, Unbounded); needs LOAD;
        /// A file, named from the current folder, with a row for each block and one or more of the columns
        /// static_offset, dynamic_offset, stiffness_offset and load_offset, which fill the lists of these names. It is
        /// read unless one of these lists is given, and once; the run's log holds what it said.
        contacts_csv: String = ""; Text(LONGEST_NAME_BYTES);
    }
}
