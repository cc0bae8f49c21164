//! Reads columns of numbers from CSV files: profiles along the slider, profiles over time, numbers of blocks.

use asperity_record::bounds::{MOST_COURSE_VALUES, MOST_MAGNITUDE};
use asperity_record::counted;

use crate::body::elastic::gaps;
use crate::scenario::rows::Rows;

/// What is wrong with a file: the line, and a description.
pub(crate) type Wrong = (usize, String);

/// The columns of a file under a heading with these names, in any order, and the line of each row. Without `all`, some
/// of the columns may be absent, and are empty.
///
/// # Errors
/// If the heading has other names, there are no rows, or a row is not a number for each column.
pub(crate) fn columns<const N: usize>(
    text: &str,
    names: [&str; N],
    all: bool,
) -> Result<(Vec<usize>, [Vec<f64>; N]), Wrong> {
    let mut rows = Rows::of(text);
    let heading = rows.next().unwrap_or_default();
    let mut places: Vec<usize> = Vec::new();
    for cell in &heading.cells {
        let place = names.iter().position(|name| *name == cell);
        places.extend(place.filter(|place| !places.contains(place)));
    }
    let is_short = places.len() < if all { N } else { heading.cells.len().max(1) };
    if is_short || places.len() < heading.cells.len() {
        return Err((heading.line.max(1), format!("the header is {:?}", heading.to_string())));
    }
    let (mut lines, mut columns) = (Vec::new(), [const { Vec::new() }; N]);
    for row in rows {
        if row.cells.len() != places.len() {
            let needed = counted(places.len() as u64, "number");
            return Err((row.line, format!("{:?} is not a row of {needed}", row.to_string())));
        }
        for (place, cell) in places.iter().zip(&row.cells) {
            let number = cell.parse().ok().filter(|number: &f64| number.is_finite());
            let problem = || format!("{} of {:?} is not a finite number", names[*place], row.to_string());
            columns[*place].push(number.ok_or_else(|| (row.line, problem()))?);
        }
        lines.push(row.line);
    }
    if lines.is_empty() { Err((1, "there are no rows".to_owned())) } else { Ok((lines, columns)) }
}

/// Refuses a file that has not a row for each block.
pub(crate) fn is_by_block(lines: &[usize], blocks: usize) -> Result<(), Wrong> {
    let rows = lines.len();
    let problem = || format!("{} for {}", counted(rows as u64, "row"), counted(blocks as u64, "block"));
    if rows == blocks { Ok(()) } else { Err((lines[blocks.min(rows - 1)], problem())) }
}

/// The format of a profile, as stated in errors.
pub(crate) const ACCEPTED: &str =
    "a CSV file with the header x_over_l,tau_over_p and rows by ascending x_over_l, the first 0, the last 1";

/// Reads a profile and interpolates it linearly to every block.
///
/// # Errors
/// If it is not such a profile.
pub(crate) fn parse_profile(text: &str, blocks: usize) -> Result<[Vec<f64>; 1], Wrong> {
    let (lines, [x, values]) = columns(text, ["x_over_l", "tau_over_p"], true)?;
    Ok([interpolated(&lines, &x, &values, blocks)?])
}

/// The format of a start by rate-and-state friction, as stated in errors.
pub(crate) const ACCEPTED_START: &str = "a CSV file with the header x_over_l,velocity_m_per_s,theta_s, numbers above 0 \
                                         below the last two, and rows by ascending x_over_l, the first 0, the last 1";

/// Reads velocities and states along the slider, and interpolates their logarithms linearly to every block.
///
/// # Errors
/// If it is not of that kind.
pub(crate) fn parse_start(text: &str, blocks: usize) -> Result<[Vec<f64>; 2], Wrong> {
    const NAMES: [&str; 3] = ["x_over_l", "velocity_m_per_s", "theta_s"];
    let (lines, [x, velocities, thetas]) = columns(text, NAMES, true)?;
    let along = |name: &str, values: &[f64]| {
        if let Some(n) = values.iter().position(|value| *value <= 0.0) {
            return Err((lines[n], format!("{name} is {}, not above 0", values[n])));
        }
        let logarithms: Vec<f64> = values.iter().map(|value| libm::log(*value)).collect();
        Ok(interpolated(&lines, &x, &logarithms, blocks)?.into_iter().map(libm::exp).collect())
    };
    Ok([along(NAMES[1], &velocities)?, along(NAMES[2], &thetas)?])
}

/// The columns of a profile over depth.
const DEPTH_COLUMNS: [&str; 5] =
    ["depth_m", "direct_effect", "evolution_effect", "critical_slip_m", "normal_stress_pa"];

/// The format of such a profile, as stated in errors.
pub(crate) const ACCEPTED_DEPTHS: &str = "a CSV file with the header depth_m,direct_effect,evolution_effect,critical_slip_m,normal_stress_pa and rows by \
     ascending depth_m from 0, evolution_effect from 0, the others above 0";

/// Reads a profile over depth: depths, and the values at them.
///
/// # Errors
/// If it is not of that kind.
pub(crate) fn parse_depths(text: &str) -> Result<[Vec<f64>; 5], Wrong> {
    let (lines, columns) = columns(text, DEPTH_COLUMNS, true)?;
    for (place, column) in columns.iter().enumerate() {
        let descends = |n: usize| place == 0 && n > 0 && column[n] <= column[n - 1];
        let is_wrong =
            |&n: &usize| column[n] < 0.0 || (column[n] == 0.0 && ![0, 2].contains(&place)) || descends(n);
        if let Some(n) = (0..lines.len()).find(is_wrong) {
            return Err((lines[n], format!("{} is {}", DEPTH_COLUMNS[place], column[n])));
        }
    }
    Ok(columns)
}

/// The values at all blocks between rows, not none, of places and values. For a single block, which is at 0, one row is
/// enough.
fn interpolated(lines: &[usize], x: &[f64], values: &[f64], blocks: usize) -> Result<Vec<f64>, Wrong> {
    for (n, line) in lines.iter().enumerate() {
        let problem = if n == 0 && x[0] != 0.0 {
            format!("the first row is at {}", x[0])
        } else if n > 0 && x[n] <= x[n - 1] {
            format!("{} is not above the row before", x[n])
        } else if values[n].abs() > MOST_MAGNITUDE {
            // Between larger ones, nothing can be interpolated.
            format!("{:e} is too large to calculate with, beyond {MOST_MAGNITUDE:e}", values[n])
        } else if n + 1 == lines.len() && x[n] != 1.0 && (n, blocks) != (0, 1) {
            format!("the last row is at {}", x[n])
        } else {
            continue;
        };
        return Err((*line, problem));
    }
    if blocks == 1 {
        return Ok(vec![values[0]]);
    }
    let mut behind = 1;
    let at_block = |n: usize| {
        let at = n as f64 / gaps(blocks) as f64;
        while behind + 1 < x.len() && x[behind] < at {
            behind += 1;
        }
        let (from, start) = (x[behind - 1], values[behind - 1]);
        start + (values[behind] - start) * ((at - from) / (x[behind] - from))
    };
    Ok((0..blocks).map(at_block).collect())
}

/// The format of a file with profiles over time, as stated in errors.
pub(crate) fn accepted_course(value: &str) -> String {
    format!(
        "a CSV file with the header time_s,x_over_l,{value} and, for each of its ascending times, rows by ascending \
         x_over_l, the first 0, the last 1"
    )
}

/// Reads profiles over time, and interpolates each to all blocks: the times, and the values of all blocks, time by time.
/// For a single block, places may be left out.
///
/// # Errors
/// If it is not of that kind.
pub(crate) fn parse_course(text: &str, value: &str, blocks: usize) -> Result<[Vec<f64>; 2], Wrong> {
    let (lines, [times_s, x, of_rows]) = if blocks == 1 && !text.contains("x_over_l") {
        let (lines, [times_s, of_rows]) = columns(text, ["time_s", value], true)?;
        let x = vec![0.0; lines.len()];
        (lines, [times_s, x, of_rows])
    } else {
        columns(text, ["time_s", "x_over_l", value], true)?
    };
    let (mut times, mut values, mut from) = (Vec::new(), Vec::new(), 0);
    // A profile that begins again at the same time is that behind a jump.
    let begins_again = |n: usize| x[n] == 0.0 && (blocks == 1 || x[n - 1] == 1.0);
    while from < times_s.len() {
        let is_next = |n: &usize| times_s[*n] != times_s[from] || begins_again(*n);
        let rows = from..(from + 1..times_s.len()).find(is_next).unwrap_or(times_s.len());
        if times.last().is_some_and(|last_s| times_s[from] < *last_s) {
            return Err((lines[from], format!("time {} is below the one before", times_s[from])));
        }
        if values.len() + blocks > MOST_COURSE_VALUES {
            let problem = format!("more than {MOST_COURSE_VALUES} values of {blocks} blocks at all times");
            return Err((lines[from], problem));
        }
        times.push(times_s[from]);
        from = rows.end;
        values.extend(interpolated(&lines[rows.clone()], &x[rows.clone()], &of_rows[rows], blocks)?);
    }
    Ok([times, values])
}

/// The columns that a file of blocks may have.
pub(crate) const BLOCK_COLUMNS: [&str; 4] =
    ["static_offset", "dynamic_offset", "stiffness_offset", "load_offset"];

/// The format of such a file, as stated in errors.
pub(crate) fn accepted_blocks(blocks: usize) -> String {
    format!("a CSV file with a header of some of {} and {blocks} rows of numbers", BLOCK_COLUMNS.join(","))
}

/// The numbers of a file of blocks: for each of [`BLOCK_COLUMNS`] one per block, or none without that column.
///
/// # Errors
/// If it is not such a file.
pub(crate) fn parse_blocks(text: &str, blocks: usize) -> Result<[Vec<f64>; 4], Wrong> {
    let (lines, columns) = columns(text, BLOCK_COLUMNS, false)?;
    is_by_block(&lines, blocks)?;
    Ok(columns)
}

#[cfg(test)]
mod tests {
    use super::{parse_blocks, parse_course, parse_profile, parse_start};

    #[test]
    fn a_file_that_is_too_long_is_refused() {
        let path = std::env::temp_dir().join(format!("asperity-long-{}.csv", std::process::id()));
        std::fs::File::create(&path).and_then(|file| file.set_len(1 << 40)).unwrap();
        let endless = crate::scenario::text::read(&path).unwrap_err().to_string();
        std::fs::remove_file(&path).unwrap();
        assert!(endless.contains("the file is longer than"), "{endless}");
    }

    #[test]
    fn profiles_over_time_are_interpolated_along_the_slider() {
        let read = |text: &str| parse_course(text, "factor", 3);
        let text = "time_s,x_over_l,factor\n0,0,1\n0,1,1\n2,0,1\n2,0.5,0\n2,1,0.5\n";
        assert_eq!(read(text).unwrap(), [vec![0.0, 2.0], vec![1.0, 1.0, 1.0, 1.0, 0.0, 0.5]]);
        let head = "time_s,x_over_l,factor\n";
        for (rows, line, problem) in [
            ("", 1, "there are no rows"),
            ("0,0,1\n0,0.5,1\n", 3, "the last row is at 0.5"),
            ("0,0,1\n0,1,1\n1,0.1,1\n1,1,1", 4, "the first row is at 0.1"),
            ("1,0,1\n1,1,1\n0,0,1", 4, "time 0 is below the one before"),
            ("x,0,1", 2, "time_s of \"x,0,1\" is not a finite number"),
            ("0,0,y", 2, "factor of \"0,0,y\" is not a finite number"),
        ] {
            assert_eq!(read(&format!("{head}{rows}")).unwrap_err(), (line, problem.to_owned()), "{rows:?}");
        }
        assert_eq!(read("time_s,x_over_l,ratio\n").unwrap_err().0, 1);
    }

    #[test]
    fn a_profile_that_begins_again_is_behind_a_jump_and_one_block_needs_one_row() {
        let text = "time_s,x_over_l,ratio\n1,0,0\n1,1,2\n1,0,3\n1,1,3\n2,0,0\n2,1,0\n";
        assert_eq!(
            parse_course(text, "ratio", 2).unwrap(),
            [vec![1.0, 1.0, 2.0], vec![0.0, 2.0, 3.0, 3.0, 0.0, 0.0]]
        );
        let expected = [vec![1.0, 1.0, 2.0], vec![0.0, 3.0, 1.0]];
        for text in ["time_s,x_over_l,ratio\n1,0,0\n1,0,3\n2,0,1\n2,1,9\n", "time_s,ratio\n1,0\n1,3\n2,1\n"] {
            assert_eq!(parse_course(text, "ratio", 1).unwrap(), expected, "{text}");
        }
        assert_eq!(parse_course("time_s,ratio\n1,0\n", "ratio", 2).unwrap_err().0, 1);
    }

    #[test]
    fn starts_are_interpolated_in_logarithms() {
        let read =
            |rows: &str, blocks| parse_start(&format!("theta_s,x_over_l,velocity_m_per_s\n{rows}"), blocks);
        let [v, theta] = read("1,0,1e-8\n100,1,1e-4\n", 3).unwrap();
        for (found, expected) in v.iter().zip([1e-8, 1e-6, 1e-4]).chain(theta.iter().zip([1.0, 10.0, 100.0]))
        {
            assert!((found / expected - 1.0).abs() < 1e-14, "{found} {expected}");
        }
        let [v, theta] = read("5,0,1e-6\n", 1).unwrap();
        assert!((v[0] / 1e-6 - 1.0).abs() < 1e-14 && (theta[0] / 5.0 - 1.0).abs() < 1e-14);
        for (rows, line, problem) in [
            ("1,0,0\n1,1,1\n", 2, "velocity_m_per_s is 0, not above 0"),
            ("1,0,1\n-1,1,1\n", 3, "theta_s is -1, not above 0"),
            ("1,0,1\n", 2, "the last row is at 0"),
            ("1,0.5,1\n1,1,1\n", 2, "the first row is at 0.5"),
        ] {
            assert_eq!(read(rows, 3).unwrap_err(), (line, problem.to_owned()), "{rows}");
        }
    }

    #[test]
    fn files_of_blocks_have_a_row_for_each() {
        let read = |text: &str| parse_blocks(text, 2);
        let [mu_s, mu_d, kt, p] = read("load_offset, static_offset\n0.5,-0.1\n\n-0.5,0.1\n").unwrap();
        assert_eq!((mu_s, p), (vec![-0.1, 0.1], vec![0.5, -0.5]));
        assert!(mu_d.is_empty() && kt.is_empty());
        for (text, line, problem) in [
            ("", 1, "the header is \"\""),
            ("load_offset,load_offset\n0,0\n0,0", 1, "the header is \"load_offset,load_offset\""),
            ("offset\n0\n0", 1, "the header is \"offset\""),
            ("load_offset\n0\n", 2, "1 row for 2 blocks"),
            ("load_offset\n", 1, "there are no rows"),
            ("load_offset\n0\n0\n0", 4, "3 rows for 2 blocks"),
            ("load_offset\n0\n0,1", 3, "\"0,1\" is not a row of 1 number"),
            ("load_offset\nnan\n0", 2, "load_offset of \"nan\" is not a finite number"),
        ] {
            assert_eq!(read(text).unwrap_err(), (line, problem.to_owned()), "{text:?}");
        }
    }

    #[test]
    fn wrong_files_are_refused_with_line_and_reason() {
        let wrong = |text: &str| parse_profile(text, 3).unwrap_err();
        assert_eq!(wrong("x,tau"), (1, "the header is \"x,tau\"".to_owned()));
        let head = "x_over_l,tau_over_p\n";
        assert_eq!(wrong(&format!("{head}0,0\n0.5,nan\n1,0")).0, 3);
        assert_eq!(wrong(&format!("{head}0,0\n0.5,0\n0.5,1\n1,0")).0, 4);
        assert_eq!(wrong(&format!("{head}0,0\n0.5,0\n")).1, "the last row is at 0.5");
        assert_eq!(wrong(head).1, "there are no rows");
        assert_eq!(parse_profile(&format!("{head}0,-1\n1,1\n"), 3).unwrap(), [[-1.0, 0.0, 1.0]]);
    }
}
