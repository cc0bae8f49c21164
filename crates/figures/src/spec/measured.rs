//! Points that were measured elsewhere, in a file of comma-separated values that a figure names.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A file of measured points, as a figure names it.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(from = "String")]
#[schemars(with = "String")]
pub struct MeasuredFile {
    path: String,
    /// None before it is read.
    text: Option<String>,
}

impl From<String> for MeasuredFile {
    fn from(path: String) -> MeasuredFile {
        MeasuredFile { path, text: None }
    }
}

/// What the columns of an axis may be called, and whether only numbers above 0 have a place on it.
pub(crate) type MeasuredAxis<'a> = ([&'a str; 2], bool);

/// Measured points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// What the legend calls them.
    pub label: String,
    /// Across and upwards, each with its error, which is 0 where the file has none.
    pub points: Vec<[[f64; 2]; 2]>,
}

impl MeasuredFile {
    /// Reads it, given what reads the text of a file.
    ///
    /// # Errors
    /// In words, with the file, if it cannot be read.
    pub fn read(&mut self, read: impl FnOnce(&str) -> Result<String, String>) -> Result<(), String> {
        let text = read(&self.path).map_err(|error| {
            format!("measured = {:?} cannot be read: {error} (accepted: a CSV file)", self.path)
        })?;
        self.text = Some(text);
        Ok(())
    }

    /// Its path as the figure has it, and its text, which is empty before it is read.
    pub fn read_text(&self) -> (&str, &str) {
        (&self.path, self.text.as_deref().unwrap_or_default())
    }

    /// The points of a file, if there is one, on these axes. Without a label the legend calls them by the name of the
    /// file without its ending.
    ///
    /// # Errors
    /// In words, with file, line, column, value and what is accepted.
    pub(crate) fn points(
        file: &Option<MeasuredFile>,
        label: &Option<String>,
        axes: [MeasuredAxis<'_>; 2],
    ) -> Result<Option<Measured>, String> {
        let Some(MeasuredFile { path, text }) = file else { return Ok(None) };
        let stem = || std::path::Path::new(path).file_stem().unwrap_or_default().to_string_lossy();
        let label = label.clone().unwrap_or_else(|| stem().replace('_', "\\_"));
        let text = text.as_deref().ok_or_else(|| format!("measured = {path:?} was not read"))?;
        let points = parse(text, axes).map_err(|problem| format!("measured = {path:?}: {problem}"))?;
        Ok(Some(Measured { label, points }))
    }
}

fn parse(text: &str, axes: [MeasuredAxis<'_>; 2]) -> Result<Vec<[[f64; 2]; 2]>, String> {
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.comment(Some(b'#')).trim(csv::Trim::All).from_reader(text.as_bytes());
    let heads = reader.headers().map_err(|error| error.to_string())?.clone();
    let find = |name: &str| heads.iter().position(|head| head == name);
    if let Some(twice) = heads.iter().enumerate().find(|(n, head)| find(head) != Some(*n)) {
        return Err(format!("line 1, column {:?} appears twice (accepted: different names)", twice.1));
    }
    let lone = |head: &&str| head.strip_suffix("_error").is_some_and(|name| find(name).is_none());
    if let Some(lone) = heads.iter().find(lone) {
        return Err(format!(
            "line 1, column {lone:?} is the error of no column (accepted: NAME_error beside NAME)"
        ));
    }
    // The column of each axis and that of its errors.
    let columns = |(names, _): MeasuredAxis<'_>| {
        let of = |name: &&str| Some((find(name)?, find(&format!("{name}_error"))));
        names.iter().find_map(of).ok_or_else(|| {
            let [name, other] = names;
            let has = heads.iter().map(|head| format!("{head:?}")).collect::<Vec<_>>().join(", ");
            format!("line 1: no column {name:?} (accepted: {name:?} or {other:?}, between commas; there are {has})")
        })
    };
    let columns = [columns(axes[0])?, columns(axes[1])?];
    let mut points = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|error| error.to_string())?;
        let line = row.position().map_or(0, csv::Position::line);
        let number = |column: usize, (least, accepted): (f64, &str)| {
            let is_accepted = |value: &f64| value.is_finite() && *value >= least;
            row[column].parse().ok().filter(is_accepted).ok_or_else(|| {
                format!("line {line}, column {:?}: {:?} (accepted: {accepted})", &heads[column], &row[column])
            })
        };
        let mut point = [[0.0; 2]; 2];
        for (n, (value, error)) in columns.into_iter().enumerate() {
            let least = match axes[n].1 {
                true => (f64::MIN_POSITIVE, "a number above 0, on a logarithmic axis"),
                false => (f64::MIN, "a number"),
            };
            point[n][0] = number(value, least)?;
            point[n][1] = error.map_or(Ok(0.0), |error| number(error, (0.0, "a number from 0")))?;
        }
        points.push(point);
    }
    if points.is_empty() {
        return Err("no points (accepted: one or more lines below the names of the columns)".to_owned());
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::{Measured, MeasuredFile};

    fn points(text: &str, log: bool) -> Result<Measured, String> {
        let mut file = MeasuredFile::from("lab/my_points.csv".to_owned());
        file.read(|path| {
            assert_eq!(path, "lab/my_points.csv");
            Ok(text.to_owned())
        })?;
        let points = MeasuredFile::points(
            &Some(file),
            &None,
            [(["ft_fn", "F_T/F_N"], log), (["length", "L_p/L"], false)],
        );
        points.map(|points| points.expect("there is a file"))
    }

    #[test]
    fn columns_are_found_by_either_name_with_their_errors() {
        let text = "# by hand\nrun,L_p/L,F_T/F_N,L_p/L_error\na, 0.5, 0.2, 0.1\nb,0.75,0.3,0\n";
        let Measured { label, points } = points(text, true).unwrap();
        assert_eq!(label, "my\\_points");
        assert_eq!(points, [[[0.2, 0.0], [0.5, 0.1]], [[0.3, 0.0], [0.75, 0.0]]]);
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        let refused = [
            (
                "length\n1\n",
                "line 1: no column \"ft_fn\" (accepted: \"ft_fn\" or \"F_T/F_N\", between commas; there are \"length\")",
            ),
            (
                "ft_fn,length,lenth_error\n1,1,1\n",
                "line 1, column \"lenth_error\" is the error of no column (accepted: NAME_error",
            ),
            ("ft_fn,length,ft_fn\n1,1,1\n", "line 1, column \"ft_fn\" appears twice"),
            ("ft_fn,length\n1,1\n2,far\n", "line 3, column \"length\": \"far\" (accepted: a number)"),
            ("ft_fn,length\n1,NaN\n", "line 2, column \"length\": \"NaN\" (accepted: a number)"),
            ("ft_fn,length\n0,1\n", "line 2, column \"ft_fn\": \"0\" (accepted: a number above 0"),
            (
                "ft_fn,length,length_error\n1,1,-1\n",
                "line 2, column \"length_error\": \"-1\" (accepted: a number from 0)",
            ),
            ("ft_fn,length\n1,1,1\n", "CSV error: record 1 (line: 2, byte: 13): found record with 3 fields"),
            ("ft_fn,length\n", "no points (accepted: one or more lines"),
            ("", "line 1: no column \"ft_fn\""),
        ];
        for (text, says) in refused {
            let said = points(text, true).unwrap_err();
            assert!(said.starts_with("measured = \"lab/my_points.csv\": ") && said.contains(says), "{said}");
        }
        let mut file = MeasuredFile::from("a.csv".to_owned());
        let said = file.read(|_| Err("no such file".to_owned())).unwrap_err();
        assert_eq!(said, "measured = \"a.csv\" cannot be read: no such file (accepted: a CSV file)");
    }
}
