//! `cargo xtask convergence`: the dependence of each number of a summary on the time step and the number of
//! blocks, as a page of the manual.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;

use crate::reproduce::{self, SETS};
use crate::say::say;
use crate::workspace::{Failure, absolute, asperity, read, root, run, write};

const PIPELINE: &str = "convergence";
const PAGE: &str = "docs/internals/convergence.md";

/// This command writes the text between these marks on the page.
const BEGIN: &str = "<!-- begin: cargo xtask convergence -->";
const END: &str = "<!-- end -->";

const SLIDERS: [&str; 3] = ["even", "tilted", "creeping"];
/// The run that all others of a slider are variants of.
const BASE: &str = "50-ns";
const STEPS: [&str; 5] = ["10-ns", "20-ns", BASE, "100-ns", "200-ns"];
const BLOCKS: [&str; 5] = ["25-blocks", "50-blocks", BASE, "200-blocks", "400-blocks"];

/// The keys whose numbers are inputs or describe the work of the solver, and are no results.
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
    let out = absolute(&arguments.out)?;
    let mut tables = Vec::new();
    for set in SETS {
        let folder = out.join(set);
        let mut reproduce = asperity()?;
        reproduce.args(["reproduce", &reproduce::pipeline(PIPELINE), "--out"]).arg(&folder);
        run(reproduce.args(["--set", &format!("parameter_set={set}")]))?;
        tables.push(read(&folder.join("tables/summary.csv"))?);
    }
    let made = tables_of_page(&tables).map_err(Failure::Check)?;
    let page = root().join(PAGE);
    let text = replaced(&read(&page)?, &made)
        .ok_or_else(|| Failure::Check(format!("{PAGE}: it has no lines {BEGIN} and {END}")))?;
    write(&page, &text)?;
    say!("{PAGE}");
    Ok(())
}

/// The page with other tables.
fn replaced(page: &str, tables: &str) -> Option<String> {
    let (before, rest) = page.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    Some(format!("{before}{BEGIN}\n\n{tables}\n{END}{after}"))
}

/// The numbers of some runs of a table; none if one of them lacks it. No cell is quoted: names of runs and scenarios of a
/// pipeline are plain.
fn numbers(table: &str, slider: &str, variants: &[&str], key: &str) -> Result<Option<Vec<f64>>, String> {
    let mut lines = table.lines().map(|line| line.split(','));
    let column =
        lines.next().and_then(|mut keys| keys.position(|name| name == key)).ok_or("it lacks a key")?;
    let rows: BTreeMap<&str, Option<f64>> = lines
        .filter_map(|mut cells| Some((cells.clone().next()?, cells.nth(column)?.parse().ok())))
        .collect();
    let number = |variant: &&str| {
        let name = format!("{slider}-{variant}");
        rows.get(name.as_str()).copied().ok_or_else(|| format!("there is no run {name}"))
    };
    variants.iter().map(number).collect()
}

/// Values, and their changes with either.
fn tables_of_page(tables: &[String]) -> Result<String, String> {
    let mut text = String::new();
    let first: fn(&[f64]) -> String = |values| rounded(values[0]);
    let columns: Vec<_> = SLIDERS
        .iter()
        .flat_map(|slider| SETS.iter().zip(tables).map(move |(set, table)| (slider, set, table)))
        .collect();
    let headings: String =
        columns.iter().map(|(slider, set, _)| format!(" {slider}, {} |", set.replace('-', " "))).collect();
    let keys = tables.first().and_then(|table| table.lines().next()).unwrap_or_default().split(',');
    for (heading, variants, cell) in [
        ("With the time step: 10, 20, 50, 100 and 200 ns", &STEPS[..], percent as fn(&[f64]) -> String),
        ("With the number of blocks: 25, 50, 100, 200 and 400", &BLOCKS[..], percent),
        ("The numbers themselves: 100 blocks, 50 ns", &[BASE][..], first),
    ] {
        text += &format!("### {heading}\n\n| key |{headings}\n|---|{}\n", "---|".repeat(columns.len()));
        for key in keys.clone().filter(|key| !LEFT_OUT.contains(key)) {
            let cell = |(slider, _, table): &(&&str, &&str, &String)| {
                let values = numbers(table, slider, variants, key)?;
                Ok(values.map_or("-".to_owned(), |values| cell(&values)))
            };
            let row: Vec<String> = columns.iter().map(cell).collect::<Result<_, String>>()?;
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
    use super::{BEGIN, END, numbers, percent, replaced, rounded};

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
        let of = |variants: &[&str], key| {
            numbers("run,a_s,b\neven-10-ns,1.5,\neven-20-ns,2e-7,3\n", "even", variants, key)
        };
        assert_eq!(of(&["10-ns", "20-ns"], "a_s"), Ok(Some(vec![1.5, 2e-7])));
        assert_eq!(of(&["10-ns", "20-ns"], "b"), Ok(None));
        assert!(of(&["50-ns"], "b").is_err());
    }

    #[test]
    fn only_the_tables_of_the_page_are_replaced() {
        let page = format!("above\n{BEGIN}\nold\n{END}\nbelow\n");
        assert_eq!(replaced(&page, "new\n"), Some(format!("above\n{BEGIN}\n\nnew\n\n{END}\nbelow\n")));
        assert!(replaced("no such lines", "new").is_none());
    }
}
