//! Reads a profile along the slider from a CSV file.

use std::path::Path;

use crate::elastic::gaps;
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
    let mut behind = 1;
    let at_block = |n: usize| {
        let x = n as f64 / gaps(blocks) as f64;
        while behind + 1 < rows.len() && rows[behind].0 < x {
            behind += 1;
        }
        let ((from, start), (to, end)) = (rows[behind - 1], rows[behind]);
        start + (end - start) * ((x - from) / (to - from))
    };
    Ok((0..blocks).map(at_block).collect())
}

/// Parses pairs of place and value; the error is the line number and a description.
fn parse(text: &str) -> Result<Vec<(f64, f64)>, (usize, String)> {
    let mut lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty());
    let header = lines.next().map_or("", |(_, line)| line);
    if header != "x_over_l,tau_over_p" {
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
    use super::parse;

    #[test]
    fn a_file_that_is_too_long_is_refused() {
        let path = std::env::temp_dir().join(format!("asperity-long-{}.csv", std::process::id()));
        std::fs::File::create(&path).and_then(|file| file.set_len(1 << 40)).unwrap();
        let endless = super::read(&path, 10).unwrap_err();
        std::fs::remove_file(&path).unwrap();
        assert!(endless.contains(": the file is longer than"), "{endless}");
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
