//! Reads a profile along the slider from a CSV file.

use std::path::Path;

use crate::elastic::gaps;
use crate::keys::MOST_MAGNITUDE;
use crate::text;

/// The format of such a file, as stated in errors.
pub(crate) const ACCEPTED: &str =
    "a CSV file with the header x_over_l,tau_over_p and rows by ascending x_over_l, the first 0, the last 1";

/// Reads the profile and interpolates it linearly to every block.
///
/// # Errors
/// A message with file and line, if the file cannot be read or is not such a profile.
pub(crate) fn read(path: &Path, blocks: usize) -> Result<Vec<f64>, String> {
    let text = text::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let rows = parse(&text).map_err(|(line, problem)| format!("{}:{line}: {problem}", path.display()))?;
    Ok(interpolated(&rows, blocks))
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

/// Reads profiles over time from a file, and interpolates each to all blocks: the times, and the values of all blocks,
/// time by time.
///
/// # Errors
/// A message with file and line, if the file cannot be read or is not of that kind.
pub(crate) fn read_course(path: &Path, value: &str, blocks: usize) -> Result<(Vec<f64>, Vec<f64>), String> {
    let text = text::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    parse_course(&text, value, blocks)
        .map_err(|(line, problem)| format!("{}:{line}: {problem}", path.display()))
}

/// Most values of a course, which a log stores as text.
const MOST_COURSE_VALUES: usize = 200_000;

fn parse_course(text: &str, value: &str, blocks: usize) -> Result<(Vec<f64>, Vec<f64>), (usize, String)> {
    let mut lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty());
    let header = lines.next().map_or("", |(_, line)| line);
    if header != format!("time_s,x_over_l,{value}") {
        return Err((1, format!("the header is {header:?}")));
    }
    // The rows of each time, without it, with the number of the first.
    let mut profiles: Vec<(f64, usize, String)> = Vec::new();
    for (index, line) in lines {
        let (time, rest) = line.split_once(',').unwrap_or((line, ""));
        let time_s = time.trim().parse::<f64>().ok().filter(|time_s| time_s.is_finite());
        let time_s = time_s.ok_or_else(|| (index + 1, format!("{time:?} is not a time")))?;
        match profiles.last_mut() {
            Some((last_s, _, rows)) if *last_s == time_s => {
                rows.push('\n');
                rows.push_str(rest);
            }
            Some((last_s, ..)) if time_s < *last_s => {
                return Err((index + 1, format!("time {time_s} is below the one before")));
            }
            _ => profiles.push((time_s, index, rest.to_owned())),
        }
    }
    if profiles.is_empty() {
        return Err((1, "there are no rows".to_owned()));
    }
    let mut values = Vec::new();
    for (_, first, rows) in &profiles {
        if values.len() + blocks > MOST_COURSE_VALUES {
            let problem = format!("more than {MOST_COURSE_VALUES} values of {blocks} blocks at all times");
            return Err((first + 1, problem));
        }
        let text = format!("{HEADER}\n{rows}");
        let rows = parse(&text).map_err(|(line, problem)| (first + line.max(2) - 1, problem))?;
        values.extend(interpolated(&rows, blocks));
    }
    Ok((profiles.into_iter().map(|(time_s, ..)| time_s).collect(), values))
}

/// The columns that a file of blocks may have.
pub(crate) const BLOCK_COLUMNS: [&str; 4] =
    ["static_offset", "dynamic_offset", "stiffness_offset", "load_offset"];

/// The numbers of a file of blocks: for each of [`BLOCK_COLUMNS`] one per block, or none without that column.
///
/// # Errors
/// A message with file and line, if the file cannot be read or is not such a file.
pub(crate) fn read_blocks(path: &Path, blocks: usize) -> Result<[Vec<f64>; 4], String> {
    let text = text::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    parse_blocks(&text, blocks).map_err(|(line, problem)| format!("{}:{line}: {problem}", path.display()))
}

/// The format of such a file, as stated in errors.
pub(crate) fn accepted_blocks(blocks: usize) -> String {
    format!("a CSV file with a header of some of {} and {blocks} rows of numbers", BLOCK_COLUMNS.join(","))
}

fn parse_blocks(text: &str, blocks: usize) -> Result<[Vec<f64>; 4], (usize, String)> {
    let mut lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty());
    let header = lines.next().map_or("", |(_, line)| line);
    let mut places = Vec::new();
    for name in header.split(',').map(str::trim) {
        let place = BLOCK_COLUMNS.iter().position(|column| *column == name);
        match place.filter(|place| !places.contains(place)) {
            Some(place) => places.push(place),
            None => return Err((1, format!("the header is {header:?}"))),
        }
    }
    let mut columns: [Vec<f64>; 4] = Default::default();
    for (index, line) in lines {
        let cells = line
            .split(',')
            .map(|cell| cell.trim().parse::<f64>().ok().filter(|value| value.abs() <= MOST_MAGNITUDE));
        let row: Option<Vec<f64>> = cells.collect();
        let row = row.filter(|row| row.len() == places.len());
        let row =
            row.ok_or_else(|| (index + 1, format!("{line:?} is not a row of {} numbers", places.len())))?;
        for (place, value) in places.iter().zip(row) {
            columns[*place].push(value);
        }
        if columns[places[0]].len() > blocks {
            return Err((index + 1, format!("a row beyond the last of {blocks} blocks")));
        }
    }
    match columns[places[0]].len() {
        rows if rows == blocks => Ok(columns),
        rows => Err((text.lines().count(), format!("{rows} rows for {blocks} blocks"))),
    }
}

/// Parses pairs of place and value; the error is the line number and a description.
fn parse(text: &str) -> Result<Vec<(f64, f64)>, (usize, String)> {
    let mut lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty());
    let header = lines.next().map_or("", |(_, line)| line);
    if header != HEADER {
        return Err((1, format!("the header is {header:?}")));
    }
    let mut rows: Vec<(f64, f64)> = Vec::new();
    for (index, line) in lines {
        let number = index + 1;
        let values: Vec<f64> = line
            .split(',')
            .map(|cell| cell.trim().parse::<f64>().ok().filter(|value| value.is_finite()))
            .collect::<Option<_>>()
            .ok_or_else(|| (number, format!("{line:?} is not a pair of numbers")))?;
        let &[x, tau] = values.as_slice() else {
            return Err((number, format!("{line:?} is not a pair of numbers")));
        };
        if rows.is_empty() && x != 0.0 {
            return Err((number, format!("the first row is at {x}")));
        }
        if rows.last().is_some_and(|(before, _)| x <= *before) {
            return Err((number, format!("{x} is not above the row before")));
        }
        rows.push((x, tau));
    }
    match rows.last() {
        Some((1.0, _)) if rows.len() > 1 => Ok(rows),
        Some((x, _)) => Err((text.lines().count(), format!("the last row is at {x}"))),
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
        let endless = super::read(&path, 10).unwrap_err();
        std::fs::remove_file(&path).unwrap();
        assert!(endless.contains(": the file is longer than"), "{endless}");
    }

    #[test]
    fn profiles_over_time_are_interpolated_along_the_slider() {
        let read = |text: &str| parse_course(text, "factor", 3);
        let text = "time_s,x_over_l,factor\n0,0,1\n0,1,1\n2,0,1\n2,0.5,0\n2,1,0.5\n";
        assert_eq!(read(text).unwrap(), (vec![0.0, 2.0], vec![1.0, 1.0, 1.0, 1.0, 0.0, 0.5]));
        let head = "time_s,x_over_l,factor\n";
        for (rows, line, problem) in [
            ("", 1, "there are no rows"),
            ("0,0,1\n0,0.5,1\n", 3, "the last row is at 0.5"),
            ("0,0,1\n0,1,1\n1,0.1,1\n1,1,1", 4, "the first row is at 0.1"),
            ("1,0,1\n1,1,1\n0,0,1", 4, "time 0 is below the one before"),
            ("x,0,1", 2, "\"x\" is not a time"),
            ("0,0,y", 2, "\"0,y\" is not a pair of numbers"),
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
