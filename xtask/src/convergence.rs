//! `cargo xtask convergence`: how far each number of a summary moves with the time step and with the
//! number of blocks, as a page of the manual.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::reproduce;
use crate::say::say;
use crate::workspace::{Failure, asperity, root, run};

const PIPELINE: &str = "convergence";
const PAGE: &str = "docs/internals/convergence.md";

/// What stands between them on the page is written by this command.
const BEGIN: &str = "<!-- begin: cargo xtask convergence -->";
const END: &str = "<!-- end -->";

const SLIDERS: [&str; 3] = ["even", "tilted", "creeping"];
const SETS: [&str; 2] = ["as-coded", "as-stated"];
/// The run that all others of a slider are variants of.
const BASE: &str = "50-ns";
const STEPS: [&str; 5] = ["10-ns", "20-ns", BASE, "100-ns", "200-ns"];
const BLOCKS: [&str; 5] = ["25-blocks", "50-blocks", BASE, "200-blocks", "400-blocks"];

/// The keys whose numbers are what was put in, or say how the solver worked, and not what came out.
const LEFT_OUT: [&str; 12] = [
    "blocks",
    "time_step_s",
    "simulated_s",
    "link_time_s",
    "wave_speed_m_per_s",
    "last_step",
    "step_record_count",
    "plain_steps",
    "window_steps",
    "windows",
    "jump_steps",
    "jumps",
];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask convergence
  cargo xtask convergence --out /tmp/convergence

Makes 54 runs, those of pipelines/convergence.toml in both parameter sets, and
writes the tables of docs/internals/convergence.md. Runs found in the folder are
used again if their scenario and the code that made them are the same.")]
pub(crate) struct ConvergenceArguments {
    /// Folder for the runs and tables of both sets.
    #[arg(short, long, value_name = "FOLDER", default_value = "out/convergence")]
    out: PathBuf,
}

pub(crate) fn command(arguments: &ConvergenceArguments) -> Result<(), Failure> {
    let io = |what: &str, path: &Path| {
        let what = format!("{what} {}", path.display());
        move |error| Failure::Io { what, error }
    };
    let out = std::path::absolute(&arguments.out).map_err(io("find", &arguments.out))?;
    let mut tables = Vec::new();
    for set in SETS {
        let folder = out.join(set);
        let mut reproduce = asperity()?;
        reproduce.args(["reproduce", &reproduce::pipeline(PIPELINE), "--out"]).arg(&folder);
        run(reproduce.args(["--set", &format!("parameter_set={set}")]))?;
        let table = folder.join("tables/summary.csv");
        let text = fs::read_to_string(&table).map_err(io("read", &table))?;
        tables.push(
            Table::parse(&text)
                .map_err(|problem| Failure::Check(format!("{}: {problem}", table.display())))?,
        );
    }
    let made = tables_of_page(&tables).map_err(Failure::Check)?;
    let page = root().join(PAGE);
    let text = fs::read_to_string(&page).map_err(io("read", &page))?;
    let text = replaced(&text, &made).map_err(|problem| Failure::Check(format!("{PAGE}: {problem}")))?;
    fs::write(&page, text).map_err(io("write", &page))?;
    say!("{PAGE}");
    Ok(())
}

/// The page with other tables.
fn replaced(page: &str, tables: &str) -> Result<String, String> {
    let missing = || format!("it has no lines {BEGIN} and {END}");
    let (before, rest) = page.split_once(BEGIN).ok_or_else(missing)?;
    let (_, after) = rest.split_once(END).ok_or_else(missing)?;
    Ok(format!("{before}{BEGIN}\n\n{tables}\n{END}{after}"))
}

/// The numbers of a table, by run and key; those that are missing are not in it.
struct Table {
    keys: Vec<String>,
    rows: BTreeMap<String, BTreeMap<String, f64>>,
}

impl Table {
    fn parse(text: &str) -> Result<Table, String> {
        // Names of runs and scenarios of a pipeline are plain, so no cell is quoted.
        let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<String>>());
        let keys = lines.next().ok_or("it is empty")?;
        let rows = lines.map(|cells| {
            let name = cells.first().cloned().unwrap_or_default();
            let numbers =
                keys.iter().zip(&cells).filter_map(|(key, cell)| Some((key.clone(), cell.parse().ok()?)));
            (name, numbers.collect())
        });
        Ok(Table { rows: rows.collect(), keys: keys.clone() })
    }

    /// A number of some runs; none if one of them lacks it.
    fn of(&self, slider: &str, variants: &[&str], key: &str) -> Result<Option<Vec<f64>>, String> {
        let mut found = Vec::new();
        for variant in variants {
            let name = format!("{slider}-{variant}");
            let row = self.rows.get(&name).ok_or_else(|| format!("there is no run {name}"))?;
            found.push(row.get(key).copied());
        }
        Ok(found.into_iter().collect())
    }
}

/// Values, and how far they move with either.
fn tables_of_page(tables: &[Table]) -> Result<String, String> {
    let mut text = String::new();
    let spread: fn(&[f64]) -> String = |values| percent(values);
    let first: fn(&[f64]) -> String = |values| rounded(values[0]);
    for (heading, variants, cell) in [
        ("With the time step: 10, 20, 50, 100 and 200 ns", &STEPS[..], spread),
        ("With the number of blocks: 25, 50, 100, 200 and 400", &BLOCKS[..], spread),
        ("The numbers themselves: 100 blocks, 50 ns", &[BASE][..], first),
    ] {
        write!(text, "### {heading}\n\n| key |").expect("a text can be written to");
        let columns = SLIDERS
            .iter()
            .flat_map(|slider| SETS.iter().zip(tables).map(move |(set, table)| (slider, set, table)));
        let columns: Vec<_> = columns.collect();
        columns
            .iter()
            .for_each(|(slider, set, _)| text += &format!(" {slider}, {} |", set.replace('-', " ")));
        text += &format!("\n|---|{}\n", "---|".repeat(columns.len()));
        let keys = tables.first().map_or(&[][..], |table| &table.keys[..]);
        for key in keys.iter().filter(|key| !LEFT_OUT.contains(&key.as_str())) {
            let mut row = Vec::new();
            for (slider, _, table) in &columns {
                row.push(table.of(slider, variants, key)?.map_or("-".to_owned(), |values| cell(&values)));
            }
            if row.iter().any(|cell| cell != "-") {
                text += &format!("| `{key}` | {} |\n", row.join(" | "));
            }
        }
        text.push('\n');
    }
    Ok(text.trim_end().to_owned() + "\n")
}

/// Largest less smallest, over the median, in per cent.
fn percent(values: &[f64]) -> String {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let range = sorted[sorted.len() - 1] - sorted[0];
    let median = sorted[sorted.len() / 2].abs();
    match 100.0 * range / median {
        _ if range == 0.0 => "0".to_owned(),
        share if share < 0.1 => "< 0.1".to_owned(),
        share if share < 10.0 => format!("{share:.1}"),
        share if share <= 1000.0 => format!("{share:.0}"),
        _ => "> 1000".to_owned(),
    }
}

/// Four digits.
fn rounded(number: f64) -> String {
    let short: f64 = format!("{number:.3e}").parse().expect("what was printed is a number");
    if short != 0.0 && !(1e-3..1e6).contains(&short.abs()) { format!("{short:e}") } else { short.to_string() }
}

#[cfg(test)]
mod tests {
    use super::{BEGIN, END, Table, percent, replaced, rounded};

    #[test]
    fn spreads_are_over_the_median() {
        assert_eq!(percent(&[2.0, 1.0, 1.5]), "67");
        assert_eq!(percent(&[1000.0, 1001.0, 1000.5]), "< 0.1");
        assert_eq!(percent(&[50.0, 51.0, 50.0]), "2.0");
        assert_eq!(percent(&[0.0, 0.0]), "0");
        assert_eq!(percent(&[-1.0, 0.0, 1.0]), "> 1000");
        assert_eq!((rounded(0.012_343), rounded(1.234_56e-7)), ("0.01234".to_owned(), "1.235e-7".to_owned()));
    }

    #[test]
    fn a_number_that_one_run_lacks_has_no_spread() {
        let table = Table::parse("run,a_s,b\neven-10-ns,1.5,\neven-20-ns,2e-7,3\n").unwrap();
        assert_eq!(table.of("even", &["10-ns", "20-ns"], "a_s"), Ok(Some(vec![1.5, 2e-7])));
        assert_eq!(table.of("even", &["10-ns", "20-ns"], "b"), Ok(None));
        assert!(table.of("even", &["50-ns"], "b").is_err());
    }

    #[test]
    fn only_the_tables_of_the_page_are_replaced() {
        let page = format!("above\n{BEGIN}\nold\n{END}\nbelow\n");
        assert_eq!(replaced(&page, "new\n"), Ok(format!("above\n{BEGIN}\n\nnew\n\n{END}\nbelow\n")));
        assert!(replaced("no such lines", "new").is_err());
    }
}
