//! What a figure keeps of the rows that pass.

use std::collections::{BTreeMap, BTreeSet};

use asperity_model::Scenario;
use asperity_numbers::RuptureGrowth;
use asperity_record::{Cell, Column, Reach};

use crate::{Figure, Kind, Quantity, place};

/// Gives the scenario of a run by its number, for theories.
pub type ScenarioOf<'a> = &'a dyn Fn(u64) -> Result<Scenario, String>;

/// A run as a figure shows it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) run: u64,
    /// Its panel and its colour: which of the figure's values they are.
    pub(super) panel: usize,
    pub(super) colour: usize,
    pub(super) x: f64,
    pub(super) y: f64,
    /// The number that a phase map shows.
    pub(super) value: Option<f64>,
    pub(super) done: bool,
}

/// The values that a quantity has in the runs shown, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Values {
    known: BTreeMap<String, usize>,
    pub(super) places: Vec<Cell>,
}

impl Values {
    fn index(&mut self, cell: &Cell) -> Option<usize> {
        let (next, place) = (self.places.len(), place(cell)?);
        let index = *self.known.entry(place.to_string()).or_insert(next);
        if index == next {
            self.places.push(place);
        }
        Some(index)
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

fn as_number(cell: &Cell) -> Option<f64> {
    cell.number().filter(|number| number.is_finite())
}

/// Where the quantities of a figure stand in a row of the table of runs.
#[derive(Debug, Default)]
struct Columns {
    run: usize,
    status: usize,
    blocks: usize,
    longest_precursor_ratio: usize,
    x: usize,
    y: usize,
    colour: Option<usize>,
    facet: Option<usize>,
    /// The column and the value of each key that has one value in the figure.
    at: Vec<(usize, Cell)>,
}

/// The parts of a figure taken from a row of the table of ruptures.
#[derive(Debug, Default)]
struct RuptureColumns {
    onset_step: usize,
    rupture: usize,
    first_block: usize,
    last_block: usize,
    reached_every_block: usize,
    ft_fn_onset: usize,
}

/// A rupture from block 1 that reaches farther than all before it.
#[derive(Debug, Clone, Copy)]
struct Farther {
    reached_every_block: bool,
    ft_fn_onset: f64,
}

/// Lengths at which the loads of several runs are compared: these shares of the slider.
pub(super) const LEVELS: usize = 50;

/// What several runs have come to.
#[derive(Debug)]
pub(super) struct Loads {
    /// How many runs there are.
    pub(super) runs: usize,
    /// The loads at each of the [`LEVELS`], of the runs that have come to it.
    pub(super) at_levels: Vec<Vec<f64>>,
}

/// What is kept for one figure.
#[derive(Debug)]
pub(super) struct Gathered {
    pub(super) figure: Figure,
    columns: Columns,
    of_ruptures: RuptureColumns,
    /// Of the run that comes next.
    farther: RuptureGrowth<Farther>,
    pub(super) samples: Vec<Sample>,
    pub(super) panels: Values,
    pub(super) colours: Values,
    /// Words across and upwards.
    pub(super) across: Values,
    pub(super) upwards: Values,
    /// Panel, colour, load and length of precursors, so far apart as can be seen.
    pub(super) marks: BTreeSet<(usize, usize, u64, u64)>,
    /// Loads at lengths by panel and colour, where several runs belong together.
    pub(super) loads: BTreeMap<(usize, usize), Loads>,
}

impl Gathered {
    pub(super) fn new(figure: Figure) -> Gathered {
        Gathered {
            figure,
            columns: Columns::default(),
            of_ruptures: RuptureColumns::default(),
            farther: RuptureGrowth::default(),
            samples: Vec::new(),
            panels: Values::default(),
            colours: Values::default(),
            across: Values::default(),
            upwards: Values::default(),
            marks: BTreeSet::new(),
            loads: BTreeMap::new(),
        }
    }

    fn is_lengths(&self) -> bool {
        matches!(self.figure.kind, Kind::Lengths { .. })
    }

    pub(super) fn find_columns(&mut self, columns: &[Column]) {
        let find = |name: &str| columns.iter().position(|column| column.name == name).unwrap_or(usize::MAX);
        let of = |quantity: &Option<Quantity>| quantity.as_ref().map(|quantity| find(&quantity.column));
        let Figure { x, y, colour, facet, at, .. } = &self.figure;
        self.columns = Columns {
            run: find("run"),
            status: find("status"),
            blocks: find("blocks"),
            longest_precursor_ratio: find("longest_precursor_ratio"),
            x: find(&x.column),
            y: find(&y.column),
            colour: of(colour),
            facet: of(facet),
            at: at.iter().map(|(key, place)| (find(key), place.clone())).collect(),
        };
    }

    pub(super) fn find_rupture_columns(&mut self, columns: &[Column]) {
        let find = |name: &str| columns.iter().position(|column| column.name == name).unwrap_or(usize::MAX);
        self.of_ruptures = RuptureColumns {
            onset_step: find("onset_step"),
            rupture: find("rupture"),
            first_block: find("first_block"),
            last_block: find("last_block"),
            reached_every_block: find("reached_every_block"),
            ft_fn_onset: find("ft_fn_onset"),
        };
    }

    /// Takes a rupture of the run that comes next. They come in the order in which they became
    /// certain.
    pub(super) fn rupture(&mut self, cells: &[Cell]) {
        if !self.is_lengths() {
            return;
        }
        let of = &self.of_ruptures;
        let cell = |at: usize| cells.get(at).unwrap_or(&Cell::Empty);
        let (
            &Cell::Count(first),
            &Cell::Count(last),
            &Cell::Flag(reached_every_block),
            &Cell::Number(ft_fn_onset),
            &Cell::Step(onset_step),
            &Cell::Step(rupture),
        ) = (
            cell(of.first_block),
            cell(of.last_block),
            cell(of.reached_every_block),
            cell(of.ft_fn_onset),
            cell(of.onset_step),
            cell(of.rupture),
        )
        else {
            return;
        };
        let new = || Farther { reached_every_block, ft_fn_onset };
        self.farther.take((onset_step, rupture), Reach { first, last }, new);
    }

    /// Takes a run.
    pub(super) fn run(&mut self, cells: &[Cell]) {
        let farther = std::mem::take(&mut self.farther);
        let of = &self.columns;
        let cell = |at: usize| cells.get(at).unwrap_or(&Cell::Empty);
        let is_shown = of.at.iter().all(|(at, wanted)| place(cell(*at)).as_ref() == Some(wanted));
        let &Cell::Step(run) = cell(of.run) else { return };
        if !is_shown {
            return;
        }
        let value = |cell: &Cell, quantity: &Quantity, words: &mut Values| {
            if quantity.is_word { words.index(cell).map(|index| index as f64) } else { as_number(cell) }
        };
        let is_map = matches!(self.figure.kind, Kind::PhaseMap { .. });
        let index = |at: Option<usize>, values: &mut Values| at.map_or(Some(0), |at| values.index(cell(at)));
        let panel = index(of.facet, &mut self.panels);
        let colour = if is_map { Some(0) } else { index(of.colour, &mut self.colours) };
        let (Some(panel), Some(colour)) = (panel, colour) else { return };
        let sample = Sample {
            run,
            panel,
            colour,
            x: value(cell(of.x), &self.figure.x, &mut self.across).unwrap_or(f64::NAN),
            y: value(cell(of.y), &self.figure.y, &mut self.upwards).unwrap_or(f64::NAN),
            value: of.colour.filter(|_| is_map).and_then(|at| as_number(cell(at))),
            done: *cell(of.status) == Cell::Word("done".into()),
        };
        self.samples.push(sample);
        if let (true, Some(blocks)) = (self.is_lengths(), as_number(cell(of.blocks))) {
            // Over an area lengths are shares of the columns, of which the longest precursor says how many.
            let alone = farther.iter().filter(|(_, rupture)| !rupture.reached_every_block);
            let longest = alone.last().zip(as_number(cell(of.longest_precursor_ratio)));
            let columns = longest.map_or(blocks, |((to, _), ratio)| (f64::from(to) / ratio).round());
            self.lengths(&farther, (panel, colour), columns);
        }
    }

    fn lengths(&mut self, farther: &RuptureGrowth<Farther>, (panel, colour): (usize, usize), blocks: f64) {
        // The length of each, and the load.
        let precursors = || {
            let alone = farther.iter().filter(|(_, rupture)| !rupture.reached_every_block);
            alone.map(|(to, rupture)| (f64::from(to) / blocks, rupture.ft_fn_onset))
        };
        if !self.figure.is_spread {
            let marks = precursors().map(|(length, ft_fn)| (panel, colour, coarse(ft_fn), coarse(length)));
            self.marks.extend(marks);
            return;
        }
        let none = || Loads { runs: 0, at_levels: vec![Vec::new(); LEVELS] };
        let loads = self.loads.entry((panel, colour)).or_insert_with(none);
        loads.runs += 1;
        for (n, loads) in loads.at_levels.iter_mut().enumerate() {
            let level = (n + 1) as f64 / LEVELS as f64;
            let come = precursors().find(|(length, _)| *length >= level - 1e-12);
            loads.extend(come.map(|(_, ft_fn)| ft_fn));
        }
    }
}

/// A number to thirteen binary digits, less than half a pixel of an axis that begins at zero.
fn coarse(value: f64) -> u64 {
    const DIGITS_LEFT: u64 = (1 << 39) - 1;
    value.to_bits().saturating_add(1 << 38) & !DIGITS_LEFT
}
