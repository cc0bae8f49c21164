//! Other units of length, mass and time change every column of every table by the factor that its unit says, to the
//! bit: no constant with a dimension is hidden in the program. The factors are powers of two, which only move exponents.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use asperity_record::unit_of;

use crate::support::binary::{outcome, run, succeed, text};

/// The exponents of two by which length, mass and time are scaled. Those of mass are even, so that those of stiffness
/// are: the square roots of its factors would round otherwise.
const SCALES: [[i32; 3]; 2] = [[3, 4, -2], [-5, -2, 3]];

/// Scenarios, with overrides that make them short, and steps of powers of two. The first five have all bodies, and
/// keys and columns of all units.
const CASES: [&[&str]; 12] = [
    &["default", "parameter_set=\"as-coded\"", "normal_load.tilt=0.4", "drive.velocity_m_per_s=4e-4"],
    &[
        "velocity-weakening",
        "friction.weakening_velocity_m_per_s=0.01",
        "drive.velocity_m_per_s=2e-3",
        "time.duration_s=0.1875",
        "slider.blocks=20",
    ],
    &["rate-and-state", "slider.blocks=6", "friction.evolution_offsets=[]", "friction.radiation_kg_per_s=1"],
    &["sheet-coarse"],
    &[
        "slab-junctions",
        "slider.blocks=13",
        "slider.rows=5",
        "slider.length_m=0.06",
        "slider.height_m=0.02",
        "time.duration_s=0.0625",
        "drive.velocity_m_per_s=2e-3",
    ],
    &["default"],
    &["rigid-contacts"],
    &[
        "rigid-contacts",
        "friction.weakening_slip_m=1e-8",
        "friction.slip_memory_s=0.0078125",
        "drive.velocity_m_per_s=4e-4",
    ],
    &["ageing-contacts"],
    &["default", "friction.radiation_kg_per_s=20", "initial_shear.beta=0.3"],
    &["junction-slider"],
    &["slab", "slider.blocks=13", "slider.rows=5", "slider.length_m=0.06", "slider.height_m=0.02"],
];

/// The exponent of two of a unit, written as in tables; `None` of no unit.
fn exponent(unit: &str, [length, mass, time]: [i32; 3]) -> Option<i32> {
    let of_base = |word: &str| -> Option<i32> {
        let (word, power) = match word.strip_suffix(|digit: char| ('2'..='3').contains(&digit)) {
            Some(base) => (base, word[base.len()..].parse().expect("a digit")),
            None => (word, 1),
        };
        let one = match word {
            "m" => length,
            "mm" => return None,
            "kg" => mass,
            "s" => time,
            "Hz" => -time,
            "N" => mass + length - 2 * time,
            "Pa" => mass - length - 2 * time,
            "J" => mass + 2 * length - 2 * time,
            "W" => mass + 2 * length - 3 * time,
            "1" | "rad" => 0,
            _ => return None,
        };
        Some(power * one)
    };
    let product = |words: &str| words.split(' ').map(of_base).sum::<Option<i32>>();
    match unit.split_once('/') {
        Some((above, below)) => Some(product(above)? - product(below)?),
        None => product(unit),
    }
}

/// The exponent of a key or a column.
fn exponent_of(name: &str, scales: [i32; 3]) -> Option<i32> {
    exponent(unit_of(name)?, scales)
}

fn scaled(value: f64, exponent: i32) -> f64 {
    value * 2f64.powi(exponent)
}

/// Overrides that scale every key of a scenario with a dimension.
fn overrides(case: &[String], scales: [i32; 3]) -> Vec<String> {
    let shown = succeed(&[&["scenario", "show"], &words(case)[..]].concat());
    let mut section = String::new();
    let mut all = Vec::new();
    for line in shown.lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            section = format!("{name}.");
        }
        let Some((key, value)) = line.split_once(" = ").filter(|_| !line.starts_with('#')) else { continue };
        let Some(exponent) = exponent_of(key, scales).filter(|exponent| *exponent != 0) else { continue };
        let of_number = |number: &str| -> String {
            let number: f64 = number.trim().parse().expect("a number");
            format!("{:e}", scaled(number, exponent))
        };
        let value = match value.strip_prefix('[').and_then(|list| list.strip_suffix(']')) {
            Some("") => continue,
            Some(list) => format!("[{}]", list.split(',').map(of_number).collect::<Vec<_>>().join(",")),
            None => of_number(value),
        };
        all.extend(["--set".to_owned(), format!("{section}{key}={value}")]);
    }
    assert!(all.len() > 20, "{shown}");
    // Keys of other laws and bodies must stay as they are.
    let (_, _, refused) = outcome(&[&["scenario", "show"], &words(case)[..], &words(&all)].concat());
    let meaningless: Vec<&str> = refused.lines().filter(|line| line.contains("has no meaning")).collect();
    let has_meaning = |set: &&[String]| {
        !meaningless.iter().any(|line| line.starts_with(&format!("error: --set {}: ", set[1])))
    };
    all.chunks(2).filter(has_meaning).flatten().cloned().collect()
}

fn words(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).collect()
}

/// All tables of a run: by name, the columns and the rows.
fn tables(scenario: &[String], folder: &Path) -> BTreeMap<String, Vec<Vec<String>>> {
    let log = folder.join("run.mcap");
    run(&words(scenario), &log);
    let [exported, reduced, printed] = ["exported", "reduced", "printed"].map(|name| folder.join(name));
    succeed(&["export", text(&log), "--to", "csv", "--out", text(&exported), "--quiet"]);
    fs::create_dir_all(&reduced).expect("the folder is ours");
    succeed(&["reduce", text(&log), "--out", text(&reduced), "--quiet"]);
    fs::create_dir_all(&printed).expect("the folder is ours");
    for arguments in [&["catalogue"][..], &["summary", "--format", "csv"]] {
        let table = succeed(&[arguments, &[text(&log)]].concat());
        fs::write(printed.join(format!("{}.csv", arguments[0])), table).expect("it can be written");
    }
    let mut all = BTreeMap::new();
    for folder in [exported, reduced, printed] {
        for entry in fs::read_dir(&folder).expect("the folder is there") {
            let path = entry.expect("an entry").path();
            // Slow slip begins 0.5 ms after an arrival, whatever the units (docs/ruptures.md).
            let is_fixed = path.ends_with("slow-slip.csv");
            if !is_fixed && path.extension().is_some_and(|extension| extension == "csv") {
                let table = fs::read_to_string(&path).expect("a table");
                let rows = table.lines().map(|line| line.split(',').map(str::to_owned).collect());
                all.insert(
                    path.to_string_lossy()
                        .into_owned()
                        .split_off(text(folder.parent().expect("a folder")).len()),
                    rows.collect(),
                );
            }
        }
    }
    all
}

#[test]
fn tables_in_other_units_are_the_same_to_the_bit() {
    compare(&CASES[..5]);
}

#[test]
#[ignore = "half a minute: cargo xtask nightly"]
fn tables_of_all_laws_in_other_units_are_the_same_to_the_bit() {
    compare(&CASES);
}

fn compare(cases: &[&[&str]]) {
    let mut compared = BTreeMap::new();
    for (case, scales) in cases.iter().zip(SCALES.into_iter().cycle()) {
        let (name, settings) = case.split_first().expect("a scenario");
        let mut scenario = vec![(*name).to_owned()];
        let short = [
            "time.step_s=5.9604644775390625e-8",
            "time.duration_s=0.5",
            "recording.sample_s=0.0009765625",
            "recording.fields_s=0.015625",
            // Other than what the parameter set gives, which is not shown.
            "slider.mass_kg=0.0125",
        ];
        for setting in short.iter().chain(settings) {
            scenario.extend(["--set".to_owned(), (*setting).to_owned()]);
        }
        let folder = asperity_testkit::folder();
        let before = tables(&scenario, folder.path());
        let others = [&scenario[..], &overrides(&scenario, scales)].concat();
        let folder = asperity_testkit::folder();
        let after = tables(&others, folder.path());
        assert!(before["/exported/run.events.rupture.csv"].len() > 1, "{case:?}: nothing slips");
        assert_eq!(before.keys().collect::<Vec<_>>(), after.keys().collect::<Vec<_>>());
        for (table, rows) in &before {
            let expected = rows.len();
            assert_eq!(after[table].len(), expected, "{name}: {table}");
            for (n, (row, other)) in rows.iter().zip(&after[table]).enumerate().skip(1) {
                for ((column, value), other) in rows[0].iter().zip(row).zip(other) {
                    // Logarithms of sizes and what is fitted to them, and names of times, places and files.
                    let is_logarithm =
                        column.ends_with("magnitude") || column.starts_with("gutenberg_richter");
                    if is_logarithm || ["time", "longitude", "path"].contains(&column.as_str()) {
                        continue;
                    }
                    let same = match (exponent_of(column, scales), value.parse::<f64>()) {
                        (Some(exponent), Ok(value)) => {
                            other.parse().is_ok_and(|other: f64| other == scaled(value, exponent))
                        }
                        _ => value == other,
                    };
                    assert!(same, "{case:?} {scales:?}: {table} row {n}: {column} = {value}, now {other}");
                    *compared.entry(unit_of(column).unwrap_or("none")).or_insert(0) += 1;
                }
            }
        }
    }
    for unit in ["s", "m", "m/s", "N", "J", "1", "m2", "m3", "N m", "Pa"] {
        assert!(compared.get(unit) >= Some(&100), "{unit}: {compared:?}");
    }
}
