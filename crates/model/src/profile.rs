//! Reads a profile along the slider from a CSV file.

use asperity_record::bounds::{MOST_COURSE_VALUES, MOST_MAGNITUDE};

use crate::elastic::gaps;
use crate::rows::Rows;

/// The format of such a file, as stated in errors.
pub(crate) const ACCEPTED: &str =
    "a CSV file with the header x_over_l,tau_over_p and rows by ascending x_over_l, the first 0, the last 1";

/// Reads a profile and interpolates it linearly to every block.
///
/// # Errors
/// Line and description, if it is not such a profile.
pub(crate) fn parse_profile(text: &str, blocks: usize) -> Result<[Vec<f64>; 1], (usize, String)> {
    Ok([interpolated(&parse(text)?, blocks)])
}

/// The header of a profile.
const HEADER: &str = "x_over_l,tau_over_p";

/// The value at every block.
fn interpolated(rows: &[(f64, f64)], blocks: usize) -> Vec<f64> {
    let mut behind = 1;
    let at_block = |n: usize| {
        let x = n as f64 / gaps(blocks) as f64;
        while behind + 1 < rows.len() && rows[behind].0 < x {
            behind += 1;
        }
        let ((from, start), (to, end)) = (rows[behind - 1], rows[behind]);
        start + (end - start) * ((x - from) / (to - from))
    };
    (0..blocks).map(at_block).collect()
}

/// The format of a file with profiles over time, as stated in errors.
pub(crate) fn accepted_course(value: &str) -> String {
    format!(
        "a CSV file with the header time_s,x_over_l,{value} and, for each of its ascending times, rows by ascending \
         x_over_l, the first 0, the last 1"
    )
}

/// Reads profiles over time, and interpolates each to all blocks: the times, and the values of all blocks, time by time.
///
/// # Errors
/// Line and description, if it is not of that kind.
pub(crate) fn parse_course(text: &str, value: &str, blocks: usize) -> Result<[Vec<f64>; 2], (usize, String)> {
    let rows = Rows::with_heading(text, &format!("time_s,x_over_l,{value}"))?;
    let (mut times, mut values) = (Vec::new(), Vec::new());
    // The line of the last row, and the rows of its time.
    let (mut line, mut pairs) = (1, Vec::new());
    for row in rows {
        let numbers = row.numbers().and_then(|numbers| <[f64; 3]>::try_from(numbers).ok());
        let [time_s, pair @ ..] =
            numbers.ok_or_else(|| (row.line, format!("{:?} is not three numbers", row.to_string())))?;
        match times.last() {
            Some(last_s) if *last_s == time_s => {}
            Some(last_s) if time_s < *last_s => {
                return Err((row.line, format!("time {time_s} is below the one before")));
            }
            last_s => {
                if last_s.is_some() {
                    values.extend(interpolated(&whole(std::mem::take(&mut pairs), line)?, blocks));
                }
                if values.len() + blocks > MOST_COURSE_VALUES {
                    let problem =
                        format!("more than {MOST_COURSE_VALUES} values of {blocks} blocks at all times");
                    return Err((row.line, problem));
                }
                times.push(time_s);
            }
        }
        line = row.line;
        push(&mut pairs, pair, line)?;
    }
    values.extend(interpolated(&whole(pairs, line)?, blocks));
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
/// Line and description, if it is not such a file.
pub(crate) fn parse_blocks(text: &str, blocks: usize) -> Result<[Vec<f64>; 4], (usize, String)> {
    let mut rows = Rows::of(text);
    let heading = rows.next().unwrap_or_default();
    let mut places = Vec::new();
    for name in &heading.cells {
        let place = BLOCK_COLUMNS.iter().position(|column| *column == name);
        places.extend(place.filter(|place| !places.contains(place)));
    }
    if places.is_empty() || places.len() < heading.cells.len() {
        return Err((heading.line.max(1), format!("the header is {:?}", heading.to_string())));
    }
    let lines = rows.lines();
    let mut columns: [Vec<f64>; 4] = Default::default();
    for row in rows {
        let fits = |numbers: &Vec<f64>| numbers.len() == places.len();
        let numbers = row.numbers().filter(fits).ok_or_else(|| {
            (row.line, format!("{:?} is not a row of {} numbers", row.to_string(), places.len()))
        })?;
        for (place, value) in places.iter().zip(numbers) {
            columns[*place].push(value);
        }
        if columns[places[0]].len() > blocks {
            return Err((row.line, format!("a row beyond the last of {blocks} blocks")));
        }
    }
    match columns[places[0]].len() {
        rows if rows == blocks => Ok(columns),
        rows => Err((lines, format!("{rows} rows for {blocks} blocks"))),
    }
}

/// Parses pairs of place and value; the error is the line number and a description.
fn parse(text: &str) -> Result<Vec<(f64, f64)>, (usize, String)> {
    let (mut line, mut pairs) = (1, Vec::new());
    for row in Rows::with_heading(text, HEADER)? {
        let numbers = row.numbers().and_then(|numbers| <[f64; 2]>::try_from(numbers).ok());
        let pair =
            numbers.ok_or_else(|| (row.line, format!("{:?} is not a pair of numbers", row.to_string())))?;
        line = row.line;
        push(&mut pairs, pair, line)?;
    }
    whole(pairs, line)
}

/// Adds a pair of place and value, in a line, to those before.
fn push(pairs: &mut Vec<(f64, f64)>, [x, value]: [f64; 2], line: usize) -> Result<(), (usize, String)> {
    match pairs.last() {
        None if x != 0.0 => return Err((line, format!("the first row is at {x}"))),
        Some((before, _)) if x <= *before => return Err((line, format!("{x} is not above the row before"))),
        // Between larger ones, nothing can be interpolated.
        _ if value.abs() > MOST_MAGNITUDE => {
            return Err((
                line,
                format!("{value:e} is too large to calculate with, beyond {MOST_MAGNITUDE:e}"),
            ));
        }
        _ => pairs.push((x, value)),
    }
    Ok(())
}

/// The pairs, the last of them in a line, if they reach the other end.
fn whole(pairs: Vec<(f64, f64)>, line: usize) -> Result<Vec<(f64, f64)>, (usize, String)> {
    match pairs.last() {
        Some((1.0, _)) => Ok(pairs),
        Some((x, _)) => Err((line, format!("the last row is at {x}"))),
        None => Err((1, "there are no rows".to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::{parse, parse_blocks, parse_course};

    #[test]
    fn a_file_that_is_too_long_is_refused() {
        let path = std::env::temp_dir().join(format!("asperity-long-{}.csv", std::process::id()));
        std::fs::File::create(&path).and_then(|file| file.set_len(1 << 40)).unwrap();
        let endless = crate::text::read(&path).unwrap_err().to_string();
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
            ("x,0,1", 2, "\"x,0,1\" is not three numbers"),
            ("0,0,y", 2, "\"0,0,y\" is not three numbers"),
        ] {
            assert_eq!(read(&format!("{head}{rows}")).unwrap_err(), (line, problem.to_owned()), "{rows:?}");
        }
        assert_eq!(read("time_s,x_over_l,ratio\n").unwrap_err().0, 1);
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
            ("load_offset\n0\n", 2, "1 rows for 2 blocks"),
            ("load_offset\n0\n0\n0", 4, "a row beyond the last of 2 blocks"),
            ("load_offset\n0\n0,1", 3, "\"0,1\" is not a row of 1 numbers"),
            ("load_offset\nnan\n0", 2, "\"nan\" is not a row of 1 numbers"),
        ] {
            assert_eq!(read(text).unwrap_err(), (line, problem.to_owned()), "{text:?}");
        }
    }

    #[test]
    fn wrong_files_are_refused_with_line_and_reason() {
        let wrong = |text: &str| parse(text).unwrap_err();
        assert_eq!(wrong("x,tau"), (1, "the header is \"x,tau\"".to_owned()));
        let head = "x_over_l,tau_over_p\n";
        assert_eq!(wrong(&format!("{head}0,0\n0.5,nan\n1,0")).0, 3);
        assert_eq!(wrong(&format!("{head}0,0\n0.5,0\n0.5,1\n1,0")).0, 4);
        assert_eq!(wrong(&format!("{head}0,0\n0.5,0\n")).1, "the last row is at 0.5");
        assert_eq!(wrong(head).1, "there are no rows");
        assert_eq!(parse(&format!("{head}0,-1\n1,1\n")).unwrap(), [(0.0, -1.0), (1.0, 1.0)]);
    }
}
