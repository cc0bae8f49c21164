//! The source of a number. The variant determines both the data kept of a run and the argument of the
//! function, so a function cannot read data that were not kept.

use asperity_record::{Arrival, WindowRecord};

use crate::estimate::Estimate;
use crate::required_data::RequiredData;
use crate::run_data::{Load, NotKept, OfFronts, OfMotion, OfSeries, RunData, RunEvents};
use crate::states::States;

/// A number of blocks, for numbers of the nearest precursor, the load `F_T / F_N` for numbers at a given
/// load, or a time, s, for numbers up to it.
pub(crate) type Near = Option<f64>;

/// The source of a number, and the function that computes it: `None` if the run does not have it.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Of {
    /// The summary, where it is the key at this index.
    Summary(usize),
    /// The data kept of every run.
    Events(fn(&RunEvents, Near) -> Option<Estimate>),
    /// The loads as well.
    Loads(fn(&RunEvents, &[Load], Near) -> Option<Estimate>),
    /// States of all blocks.
    States(fn(&RunEvents, &States, Near) -> Option<Estimate>),
    /// Both.
    LoadsAndStates(fn(&RunEvents, &[Load], &States, Near) -> Option<Estimate>),
    /// Dense windows.
    Windows(fn(&RunEvents, &[WindowRecord], Near) -> Option<Estimate>),
    /// The passage of fronts.
    Arrivals(fn(&RunEvents, &[Arrival]) -> Option<Estimate>),
    /// The passage of fronts, and the stress ahead of them.
    Fronts(fn(&RunEvents, OfFronts<'_>) -> Option<Estimate>),
    /// The passage of fronts, and the displacement of blocks.
    Motion(fn(&RunEvents, OfMotion<'_>, Near) -> Option<Estimate>),
    /// Series as solved.
    Series(fn(&RunEvents, OfSeries<'_>, Near) -> Option<Estimate>),
}

impl Of {
    /// The data of a run that it requires.
    pub(crate) fn required_data(self) -> RequiredData {
        match self {
            Of::Summary(_) | Of::Events(_) => RequiredData::NOTHING,
            Of::Loads(_) => RequiredData::LOADS,
            Of::States(_) => RequiredData::STATES,
            Of::LoadsAndStates(_) => RequiredData::LOADS | RequiredData::STATES,
            Of::Windows(_) => RequiredData::WINDOWS,
            Of::Arrivals(_) => RequiredData::arrivals(),
            Of::Fronts(_) => RequiredData::fronts(),
            Of::Motion(_) => RequiredData::motion(),
            Of::Series(_) => RequiredData::series(),
        }
    }

    /// The number of a run.
    pub(crate) fn estimate(self, run: &RunData, near: Near) -> Result<Option<Estimate>, NotKept> {
        Ok(match self {
            Of::Summary(place) => run.summary.number(place).map(Estimate::exact),
            Of::Events(of) => of(run, near),
            Of::Loads(of) => of(run, run.loads()?, near),
            Of::States(of) => of(run, run.states()?, near),
            Of::LoadsAndStates(of) => of(run, run.loads()?, run.states()?, near),
            Of::Windows(of) => of(run, run.windows()?, near),
            Of::Arrivals(of) => of(run, run.arrivals()?),
            Of::Fronts(of) => of(run, run.of_fronts()?),
            Of::Motion(of) => of(run, (run.arrivals()?, run.states()?, run.windows()?), near),
            Of::Series(of) => of(run, run.series()?, near),
        })
    }
}

/// Declares the numbers that are computed when a file requests them: a list of keys and functions, whose
/// arguments follow from the variant of [`Of`].
macro_rules! numbers {
    ($(
        $group:literal $class:ident {
            $(
                $(#[doc = $doc:tt])*
                $name:ident: $type:ty $([unit = $unit:literal])? $(as $own:ident)? = $of:ident |$($argument:pat_param),+| $body:expr;
            )+
        }
    )+) => {
        /// The numbers in their order on pages, each with its function.
        pub(crate) const NUMBERS: &[($crate::key::Key, $crate::of::Of)] = &[
            $($((
                $crate::key::key!(
                    $group $class $(as $own)?, $name: $type, concat!($($doc,)* "")
                    $(, unit = $unit)?
                ),
                $crate::of::Of::$of(|$($argument),+| ($body).map($crate::estimate::Estimate::from)),
            ),)+)+
        ];
    };
}

pub(crate) use numbers;
