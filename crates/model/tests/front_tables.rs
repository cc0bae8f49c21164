//! The theory of fronts with radiation beside tables of an independent program, `fixtures/reference/fronts`.

use std::fs;

use asperity_model::theory::front::Front;

/// The rows of a table: its numbers, NaN where a cell has none.
fn rows(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/../../fixtures/reference/fronts/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
    let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
    text.lines().skip(1).map(numbers).collect()
}

fn front(alpha: f64, beta: f64, gamma: f64, tau: f64) -> Front {
    Front {
        prestress: tau,
        relative_damping: beta,
        top_stiffness: gamma,
        relative_radiation: alpha,
        ..Front::default()
    }
}

/// The largest relative deviation of speeds, given as fronts with the speed of a table, times a factor.
fn largest_deviation(speeds: &[(Front, f64)]) -> f64 {
    speeds.iter().fold(0.0, |most: f64, (front, expected)| {
        let speed = front.speed_over_c().unwrap_or_else(|| panic!("{front:?} has no speed"));
        let off = (speed / expected - 1.0).abs();
        assert!(off < 1e-4, "{front:?}: {speed}, by the table {expected}");
        most.max(off)
    })
}

#[test]
fn speeds_with_radiation_are_those_of_the_tables() {
    let mut speeds: Vec<(Front, f64)> =
        rows("front-speed-alpha").iter().map(|row| (front(row[0], 0.0, 0.0, row[1]), row[2])).collect();
    assert_eq!(speeds.len(), 99);
    let of_others = rows("front-alpha-beta");
    assert_eq!(of_others.len(), 8);
    speeds.extend(of_others.iter().map(|row| (front(row[0], row[1], row[2], row[3]), row[4])));
    // Of the slowest, six decimals are 1.6e-4: a unit of the last.
    let largest = largest_deviation(&speeds);
    assert!(largest < 1e-4, "{largest}");
}

/// Where `alpha beta = 1`, the speed times `alpha` does not depend on `alpha`.
#[test]
fn overdamped_fronts_have_one_speed_times_alpha() {
    let rows = rows("front-overdamped");
    assert_eq!(rows.len(), 13);
    for alpha in [0.5, 1.0, 10.0] {
        let of = |row: &Vec<f64>| (front(alpha, 1.0 / alpha, 0.0, row[0]), row[1] / alpha);
        let largest = largest_deviation(&rows.iter().map(of).collect::<Vec<_>>());
        assert!(largest < 1e-4, "{alpha}: {largest}");
    }
}

/// As radiation vanishes, faster fronts become those without.
#[test]
fn little_radiation_changes_little() {
    for (beta, gamma, tau) in [(0.0, 0.0, 0.6), (0.3, 0.0, 0.6), (0.0, 0.65, 0.8), (0.2, 0.65, 0.8)] {
        let without = front(0.0, beta, gamma, tau).speed_over_c().unwrap();
        let [some, less] =
            [2e-2, 1e-2].map(|alpha| front(alpha, beta, gamma, tau).speed_over_c().unwrap() / without - 1.0);
        assert!(some.abs() < 0.02 && (some / less - 2.0).abs() < 0.1, "{beta} {gamma}: {some} {less}");
    }
}

#[test]
fn a_curve_reaches_below_the_speed_of_waves() {
    let front = front(1.0, 0.0, 0.0, 0.5);
    let curve = front.curve(2.0);
    assert!(curve.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1) && curve[0].1 < 0.01 && curve[0].0 < 0.02);
    let speed = front.speed_over_c().unwrap();
    let above = curve.partition_point(|(tau, _)| *tau < 0.5);
    assert!(curve[above - 1].1 < speed && speed < curve[above].1, "{speed}");
}
