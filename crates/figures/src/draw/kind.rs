//! What the kinds of figures have in common.

use std::any::Any;
use std::collections::BTreeMap;

use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;

use super::plot::{BLUE, Dash, Look, RED, Series, Sheet};

/// A kind of figure. It takes its part of every run as runs go by, one after the other, and is drawn
/// from these parts once it has all.
pub(super) trait Figure: Sync {
    /// What it takes of a run: the points that it shows, and no more.
    type Part: Send + 'static;

    /// The file to write, without folder.
    fn file(&self) -> &str;

    /// The runs it is made of.
    fn runs(&self) -> Vec<&str>;

    /// Whether it is made of single runs, and not of the tables of runs over axes.
    fn is_of_runs(&self) -> bool {
        true
    }

    /// What it reads of a run beside slip events, ruptures and switches.
    fn wants(&self) -> Wants {
        Wants::NOTHING
    }

    /// Its part of a run; in words, what the run lacks.
    fn part(&self, run: &RunData) -> Result<Self::Part, String>;

    /// What is on it, made of the parts of all its runs; in words, what they lack.
    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String>;
}

/// Parts by the name of their run.
pub(super) type Parts<P> = BTreeMap<String, P>;

/// A figure of whichever kind.
pub(super) trait AnyFigure: Sync {
    fn file(&self) -> &str;
    fn runs(&self) -> Vec<&str>;
    fn wants(&self) -> Wants;
    fn part(&self, run: &RunData) -> Result<AnyPart, String>;
    fn sheet(&self, parts: Parts<AnyPart>) -> Result<Sheet, String>;
}

/// A part of a figure of whichever kind.
pub(super) type AnyPart = Box<dyn Any + Send>;

impl<F: Figure> AnyFigure for F {
    fn file(&self) -> &str {
        Figure::file(self)
    }

    fn runs(&self) -> Vec<&str> {
        Figure::runs(self)
    }

    fn wants(&self) -> Wants {
        Figure::wants(self)
    }

    fn part(&self, run: &RunData) -> Result<AnyPart, String> {
        Ok(Box::new(Figure::part(self, run)?))
    }

    fn sheet(&self, parts: Parts<AnyPart>) -> Result<Sheet, String> {
        let own = |part: AnyPart| *part.downcast().expect("a figure gets back the parts that it took");
        Figure::sheet(self, parts.into_iter().map(|(run, part)| (run, own(part))).collect())
    }
}

/// In a [`Figure`] with the fields `file` and `run`: the part of its one run is all of it.
macro_rules! of_one_run {
    () => {
        type Part = $crate::draw::plot::Sheet;

        fn file(&self) -> &str {
            &self.file
        }

        fn runs(&self) -> Vec<&str> {
            vec![&self.run]
        }

        fn sheet(
            &self,
            parts: $crate::draw::kind::Parts<Self::Part>,
        ) -> Result<$crate::draw::plot::Sheet, String> {
            $crate::draw::kind::find(&parts, &self.run).cloned()
        }
    };
}

pub(super) use of_one_run;

pub(super) use crate::spec::Labelled;

impl Labelled {
    pub(super) fn find<'a, P>(&self, parts: &'a Parts<P>) -> Result<&'a P, String> {
        find(parts, &self.run)
    }
}

/// The runs of a figure's series, each with what the legend calls it and its part.
pub(super) fn with_parts<'a, P>(
    series: &'a [Labelled],
    parts: &'a Parts<P>,
) -> Result<Vec<(&'a str, &'a P)>, String> {
    series.iter().map(|labelled| Ok((labelled.label.as_str(), labelled.find(parts)?))).collect()
}

/// The runs of a figure's series or panels.
pub(super) fn run_names(labelled: &[Labelled]) -> Vec<&str> {
    labelled.iter().map(|labelled| labelled.run.as_str()).collect()
}

/// What the dynamic coefficient is called in all figures; chapter 5 of the thesis writes `mu_k`,
/// chapter 6 `mu_d`.
pub(super) const DYNAMIC: &str = "μ_d";

/// The friction coefficients as lines across a figure.
pub(super) fn coefficient_lines(run: &RunData, to_x: f64) -> [Series; 2] {
    let friction = &run.plan.friction;
    let line = |label: &str, mu: f64, look: Look| Series {
        label: label.to_owned(),
        points: vec![(0.0, mu), (to_x, mu)],
        look,
    };
    [
        line("μ_s", friction.static_coefficient, Look::Line(Dash::Dashed, BLUE)),
        line(DYNAMIC, friction.dynamic_coefficient, Look::Line(Dash::DotDashed, RED)),
    ]
}

/// The part of the run of this name.
pub(super) fn find<'a, P>(parts: &'a Parts<P>, name: &str) -> Result<&'a P, String> {
    parts.get(name).ok_or_else(|| format!("there is no run {name}"))
}
