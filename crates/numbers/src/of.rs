//! What a number is taken of. The variant says at once what must be kept of a run for it and what its
//! function receives, so that a function cannot read what nobody keeps.

use asperity_record::WindowRecord;

use crate::estimate::Estimate;
use crate::required_data::RequiredData;
use crate::run_data::{Load, NotKept, OfFronts, RunData, RunEvents};
use crate::states::States;

/// A number of blocks, for numbers of the nearest precursor, or the load `F_T / F_N` at which one is
/// taken.
pub(crate) type Near = Option<f64>;

/// What a number is taken of, and the function that takes it: `None` where the run does not have it.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Of {
    /// The summary, of which it is the key at this place.
    Summary(usize),
    /// What is kept of every run.
    Events(fn(&RunEvents, Near) -> Option<Estimate>),
    /// The loads as well.
    Loads(fn(&RunEvents, &[Load], Near) -> Option<Estimate>),
    /// States of all blocks.
    States(fn(&RunEvents, &States, Near) -> Option<Estimate>),
    /// Both.
    LoadsAndStates(fn(&RunEvents, &[Load], &States, Near) -> Option<Estimate>),
    /// Dense windows.
    Windows(fn(&RunEvents, &[WindowRecord], Near) -> Option<Estimate>),
    /// How fronts passed, and what they found.
    Fronts(fn(&RunEvents, OfFronts<'_>) -> Option<Estimate>),
}

impl Of {
    /// What must be kept of a run for it.
    pub(crate) fn required_data(self) -> RequiredData {
        match self {
            Of::Summary(_) | Of::Events(_) => RequiredData::NOTHING,
            Of::Loads(_) => RequiredData::LOADS,
            Of::States(_) => RequiredData::STATES,
            Of::LoadsAndStates(_) => RequiredData::LOADS | RequiredData::STATES,
            Of::Windows(_) => RequiredData::WINDOWS,
            Of::Fronts(_) => RequiredData::fronts(),
        }
    }

    /// The number of a run.
    pub(crate) fn estimate(self, run: &RunData, near: Near) -> Result<Option<Estimate>, NotKept> {
        Ok(match self {
            Of::Summary(place) => match &run.summary.values()[place] {
                serde_json::Value::Bool(flag) => Some(f64::from(u8::from(*flag))),
                value => value.as_f64(),
            }
            .map(Estimate::exact),
            Of::Events(of) => of(run, near),
            Of::Loads(of) => of(run, run.loads()?, near),
            Of::States(of) => of(run, run.states()?, near),
            Of::LoadsAndStates(of) => of(run, run.loads()?, run.states()?, near),
            Of::Windows(of) => of(run, run.windows()?, near),
            Of::Fronts(of) => of(run, run.of_fronts()?),
        })
    }
}

/// Declares the numbers that are taken of a run when a file asks for them: a list of each key and
/// the function that takes it, which the variant of [`Of`] gives what it reads.
macro_rules! numbers {
    ($(
        $group:literal {
            $(
                $(#[doc = $doc:tt])*
                $name:ident: $type:ty $([unit = $unit:literal])? [was = $was:literal $(, words = $words:literal)?]
                    = $of:ident |$($argument:pat_param),+| $body:expr;
            )+
        }
    )+) => {
        /// The numbers in their order on pages, each with the function that takes it.
        pub(crate) const NUMBERS: &[($crate::key::Key, $crate::of::Of)] = &[
            $($((
                $crate::key::key!(
                    $group, $name, $type, concat!($($doc,)* "")
                    $(, unit = $unit)?, was = $was $(, words = $words)?
                ),
                $crate::of::Of::$of(|$($argument),+| ($body).map($crate::estimate::Estimate::from)),
            ),)+)+
        ];
    };
}

pub(crate) use numbers;
