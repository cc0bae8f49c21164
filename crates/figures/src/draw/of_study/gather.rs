//! What a figure keeps of the rows that pass.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use asperity_model::Scenario;
use asperity_numbers::RuptureGrowth;
use asperity_numbers::refined::Refined;
use asperity_record::{Cell, Reach};

use crate::{Figure, Kind, Quantity, place};

/// Gives the scenario of a run by its number, for theories.
pub type ScenarioOf<'a> = &'a dyn Fn(u64) -> Result<Scenario, String>;

/// A panel and a colour: which of the figure's values they are.
pub(super) type Group = (usize, usize);

/// A run as a figure shows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) run: u64,
    pub(super) group: Group,
    pub(super) x: f64,
    pub(super) y: f64,
    /// The number that a phase map shows.
    pub(super) value: Option<f64>,
    pub(super) done: bool,
}

/// The values that a quantity has in the runs shown, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Values {
    pub(super) places: Vec<Cell>,
}

impl Values {
    fn index(&mut self, cell: &Cell) -> Option<usize> {
        let place = place(cell)?;
        Some(self.places.iter().position(|known| *known == place).unwrap_or_else(|| {
            self.places.push(place);
            self.places.len() - 1
        }))
    }

    /// The words among them.
    pub(super) fn words(&self) -> Vec<String> {
        self.places.iter().map(Cell::to_string).collect()
    }

    /// The indexes, numbers in ascending order.
    pub(super) fn in_order(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        order.sort_by(|a, b| match (&self.places[*a], &self.places[*b]) {
            (Cell::Number(a), Cell::Number(b)) => a.total_cmp(b),
            _ => a.cmp(b),
        });
        order
    }
}

/// Where the columns of a table stand in its rows, by their names.
pub(super) type Heads = HashMap<String, usize>;

/// A row of a table.
#[derive(Clone, Copy)]
pub(super) struct Row<'a>(pub(super) &'a Heads, pub(super) &'a [Cell]);

impl<'a> Row<'a> {
    /// The cell of a column; empty where there is none.
    fn cell(self, column: &str) -> &'a Cell {
        self.0.get(column).and_then(|at| self.1.get(*at)).unwrap_or(&Cell::Empty)
    }

    fn number(self, column: &str) -> Option<f64> {
        self.cell(column).number().filter(|number| number.is_finite())
    }
}

/// Lengths at which the loads of several runs are compared: these shares of the slider.
pub(super) const LEVELS: usize = 50;

/// What is kept for one figure.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub(super) figure: Figure,
    /// Of the run that comes next, the ruptures from block 1 that reach farther than all before them: whether each
    /// reached every block, and its load.
    pub(super) farther: RuptureGrowth<(bool, f64)>,
    pub(super) samples: Vec<Sample>,
    /// Of each run of a refinement, the numbers that are judged.
    pub(super) refined: Vec<Vec<Option<f64>>>,
    pub(super) panels: Values,
    pub(super) colours: Values,
    /// Words across and upwards.
    pub(super) across: Values,
    pub(super) upwards: Values,
    /// Load and length of precursors, so far apart as can be seen.
    pub(super) marks: BTreeMap<Group, BTreeSet<(u64, u64)>>,
    /// Of each run, where several belong together, the load at each of the [`LEVELS`] that it has come to.
    pub(super) loads: BTreeMap<Group, Vec<Vec<f64>>>,
}

impl Gathered {
    /// Takes a rupture of the run that comes next. They come in the order in which they became
    /// certain.
    pub(super) fn rupture(&mut self, row: Row<'_>) {
        let number = |name| row.number(name);
        let reach = number("first_block").zip(number("last_block"));
        let order = number("onset_step").zip(number("rupture"));
        let (Some((first, last)), Some((onset_step, rupture)), Some(ft_fn)) =
            (reach, order, number("ft_fn_onset"))
        else {
            return;
        };
        let every = *row.cell("reached_every_block") == Cell::Flag(true);
        let reach = Reach { first: first as u32, last: last as u32 };
        self.farther.take((onset_step as u64, rupture as u64), reach, || (every, ft_fn));
    }

    /// Takes a run.
    pub(super) fn run(&mut self, row: Row<'_>) {
        let farther = std::mem::take(&mut self.farther);
        let Figure { kind, x, y, colour, facet, at, .. } = &self.figure;
        if *kind == Kind::Refinement {
            self.refined.push(Refined::numbers().map(|number| row.number(number.name())).collect());
            return;
        }
        let &Cell::Step(run) = row.cell("run") else { return };
        if at.iter().any(|(key, wanted)| place(row.cell(key)).as_ref() != Some(wanted)) {
            return;
        }
        let value = |quantity: &Quantity, words: &mut Values| match quantity.is_word {
            true => words.index(row.cell(&quantity.column)).map(|index| index as f64),
            false => row.number(&quantity.column),
        };
        let index = |quantity: Option<&Quantity>, values: &mut Values| {
            quantity.map_or(Some(0), |quantity| values.index(row.cell(&quantity.column)))
        };
        // In a map the colour is of a number.
        let (number, colour) = match (kind, colour) {
            (Kind::PhaseMap { .. }, colour) => (colour.as_ref(), None),
            (_, colour) => (None, colour.as_ref()),
        };
        let group = index(facet.as_ref(), &mut self.panels).zip(index(colour, &mut self.colours));
        let Some(group) = group else { return };
        self.samples.push(Sample {
            run,
            group,
            x: value(x, &mut self.across).unwrap_or(f64::NAN),
            y: value(y, &mut self.upwards).unwrap_or(f64::NAN),
            value: number.and_then(|number| row.number(&number.column)),
            done: *row.cell("status") == Cell::Word("done".into()),
        });
        let (Kind::Lengths { .. }, Some(blocks)) = (kind, row.number("blocks")) else { return };
        let alone = farther.iter().filter(|(_, (every, _))| !every);
        let alone: Vec<(f64, f64)> = alone.map(|(to, (_, ft_fn))| (*ft_fn, f64::from(to))).collect();
        // Over an area lengths are shares of the columns, of which the longest precursor says how many.
        let longest = alone.last().zip(row.number("longest_precursor_ratio"));
        let columns = longest.map_or(blocks, |((_, to), ratio)| (to / ratio).round());
        let precursors = alone.into_iter().map(|(ft_fn, to)| (ft_fn, to / columns));
        if !self.figure.is_spread {
            let marks = precursors.map(|(ft_fn, length)| (coarse(ft_fn), coarse(length)));
            self.marks.entry(group).or_default().extend(marks);
            return;
        }
        // They are ever longer.
        let mut precursors = precursors.peekable();
        let at_level = |n| {
            while precursors.next_if(|(_, length)| *length < level(n) - 1e-12).is_some() {}
            precursors.peek().map(|(ft_fn, _)| *ft_fn)
        };
        self.loads.entry(group).or_default().push((0..LEVELS).map_while(at_level).collect());
    }
}

/// The length of this number.
pub(super) fn level(n: usize) -> f64 {
    (n + 1) as f64 / LEVELS as f64
}

/// A number to thirteen binary digits, less than half a pixel of an axis that begins at zero.
fn coarse(value: f64) -> u64 {
    const DIGITS_LEFT: u64 = (1 << 39) - 1;
    value.to_bits().saturating_add(1 << 38) & !DIGITS_LEFT
}
