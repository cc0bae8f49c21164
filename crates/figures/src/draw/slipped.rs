//! Share of the blocks that slid against the load, for events larger than all
//! before them, wherever they began: for drives from the top and from both ends,
//! where fronts need not start at block 1.

use asperity_numbers::curves::growing_slips;
use asperity_numbers::run_data::RunData;
use asperity_numbers::wants::Wants;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, Labelled, Parts, run_names};
use super::plot::{Axis, Corner, Dash, GREY, Look, Panel, Series, Sheet, nth};

#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Slipped {
    /// The file, ending in `.png`; it stands in the folder `figures`.
    file: String,
    /// Stands above the figure.
    #[serde(default)]
    title: String,
    /// The runs, each with what the legend calls it.
    series: Vec<Labelled>,
}

/// What is shown of a run.
pub(crate) struct Part {
    points: Vec<(f64, f64)>,
    /// `mu_d` of a chain, in which what slid bears it and nothing else bears anything.
    dynamic_coefficient: Option<f64>,
}

impl Figure for Slipped {
    type Part = Part;

    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn wants(&self) -> Wants {
        Wants::LOADS
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let has_theory = run.plan.elastic.has_theory();
        let dynamic_coefficient = has_theory.then_some(run.plan.friction.dynamic_coefficient);
        Ok(Part { points: growing_slips(run, run.loads()?), dynamic_coefficient })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut highest: f64 = 0.0;
        for (index, labelled) in self.series.iter().enumerate() {
            let (marker, _, color) = nth(index);
            let points = labelled.find(&parts)?.points.clone();
            highest = points.iter().fold(highest, |highest, (load, _)| highest.max(*load));
            series.push(Series { label: labelled.label.clone(), points, look: Look::Marks(marker, color) });
        }
        let first = self.series.iter().find_map(|labelled| parts.get(&labelled.run)?.dynamic_coefficient);
        if let Some(mu_d) = first {
            let line = Series {
                label: "F_T/F_N = μ_d × share".to_owned(),
                points: vec![(0.0, 0.0), (mu_d, 1.0)],
                look: Look::Line(Dash::Dashed, GREY),
            };
            highest = highest.max(mu_d);
            series.insert(0, line);
        }
        // In whichever corner hides fewer marks.
        let marks = |corner: &dyn Fn(f64, f64) -> bool| {
            let points = series.iter().skip(usize::from(first.is_some())).flat_map(|series| &series.points);
            points.filter(|(load, share)| corner(load / highest, *share)).count()
        };
        let upper = marks(&|load, share| load < 0.5 && share > 0.6);
        let lower = marks(&|load, share| load > 0.5 && share < 0.5);
        let legend = if upper < lower { Corner::TopLeft } else { Corner::BottomRight };
        Ok(Sheet::Single(Box::new(Panel {
            title: self.title.clone(),
            x: Axis::new("F_T/F_N", 0.0, highest * 1.06),
            y: Axis::new("share of blocks that slid", 0.0, 1.08),
            series,
            legend,
            note: String::new(),
        })))
    }
}
