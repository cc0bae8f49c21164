//! A report on a terminal, on one screen whatever the tables.

use crate::document::{self, Block, Cell, Table, parts};
use crate::report::Report;

pub use crate::document::KEPT_OF_A_CLASS;

/// The summary, line by line.
pub fn lines(report: &Report) -> Vec<String> {
    let policy = report.policy.as_deref().unwrap_or("exact: every difference counts");
    let mut lines = vec![
        format!("old     {}", report.old),
        format!("new     {}", report.new),
        format!("policy  {policy}"),
    ];
    for block in parts(report, &document::listed(report)).into_iter().flat_map(|part| part.blocks) {
        match block {
            Block::Words(words) | Block::OnScreen(words) => lines.push(words),
            Block::Table(table) => rows(&table, &mut lines),
            Block::Fold { words, .. } => {
                lines.push(format!("{words}; all of them: --page FILE.html or --format json"));
            }
            Block::OnPage(_) | Block::Figures(_) => {}
        }
    }
    lines.push(document::verdict(report));
    lines
}

/// The first rows of a table: lines, or cells in columns below the headings.
fn rows(table: &Table, lines: &mut Vec<String>) {
    let shown = &table.rows[..table.on_screen.min(table.rows.len())];
    if shown.is_empty() {
        return;
    }
    if shown[0].line.is_some() {
        lines.extend(shown.iter().flat_map(|row| row.line.clone()));
    } else {
        let cells = shown.iter().map(|row| row.cells.iter().map(plain).collect());
        lines.extend(aligned(&table.headings, cells.collect()));
    }
    let more = (table.rows.len() - shown.len()) as u64 + table.left_out;
    if let Some(what) = table.more.filter(|_| more > 0) {
        let words = format!("  ... and {more} more {what}");
        lines.push(format!("{}, see --format json", words.trim_end()));
    }
}

fn plain(cell: &Cell) -> String {
    match cell {
        Cell::Text(words) | Cell::Number(words) | Cell::Key(words) | Cell::Run(_, words) => words.clone(),
        Cell::Class(class) => class.name().to_owned(),
        Cell::Events(_) | Cell::Lines(_) => String::new(),
    }
}

/// Rows below a heading, in columns; numbers flush right.
fn aligned(headings: &[String], rows: Vec<Vec<String>>) -> Vec<String> {
    let head = headings.iter().map(|heading| heading.trim_start_matches('#').to_owned()).collect();
    let rows: Vec<Vec<String>> = [head].into_iter().chain(rows).collect();
    let width = |place: usize| rows.iter().map(|row| row[place].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..headings.len()).map(width).collect();
    let line = |(number, row): (usize, &Vec<String>)| {
        let first = format!("{}{}", if number == 0 { "" } else { "  " }, row[0]);
        let mut line = format!("{first:0$}", widths[0] + 2);
        for ((cell, width), heading) in row.iter().zip(&widths).zip(headings).skip(1) {
            line += "  ";
            line +=
                &if heading.starts_with('#') { format!("{cell:>width$}") } else { format!("{cell:width$}") };
        }
        line.trim_end().to_owned()
    };
    rows.iter().enumerate().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::aligned;

    #[test]
    fn columns_are_aligned_whatever_is_in_them() {
        let row = |cells: [&str; 5]| cells.map(str::to_owned).to_vec();
        let rows = vec![row(["a_s", "1.5", "10.25", "+8.75", "+1 %"]), row(["longer", "2", "-", "", ""])];
        let lines = aligned(&row(["the runs", "#old", "#new", "#by", "#change"]), rows);
        assert_eq!(
            lines,
            [
                "the runs    old    new     by  change",
                "  a_s       1.5  10.25  +8.75    +1 %",
                "  longer      2      -"
            ]
        );
    }
}
