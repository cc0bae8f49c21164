//! How contacts lie, and which are neighbours.

use std::ops::RangeInclusive;

/// Places of contacts: columns along the sliding direction, rows across it. Contacts are numbered
/// from 1, row by row, so that in one row the number of a contact is its column.
///
/// Neighbours are apart by no more than a column and a row: two in one row, eight over an area,
/// where diagonals are bonds as well, so that a front that runs obliquely stays in one piece.
///
/// ```
/// use asperity_record::Contacts;
///
/// let area = Contacts::in_rows(24, 4).expect("4 rows of 6");
/// assert_eq!(area.around(9).collect::<Vec<u32>>(), [2, 3, 4, 8, 9, 10, 14, 15, 16]);
/// // Number 6 ends the first row, number 7 begins the second.
/// assert!(!area.around(6).any(|near| near == 7));
/// // A number alone is that of blocks in one row.
/// assert_eq!(Contacts::from(24).around(6).collect::<Vec<u32>>(), [5, 6, 7]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Contacts {
    columns: u32,
    rows: u32,
}

impl From<u32> for Contacts {
    /// So many contacts in one row.
    fn from(columns: u32) -> Contacts {
        Contacts { columns, rows: 1 }
    }
}

impl Contacts {
    /// So many contacts in rows of equal length; none if the rows do not come out even.
    pub fn in_rows(count: u32, rows: u32) -> Option<Contacts> {
        let columns = count.checked_div(rows)?;
        (columns * rows == count).then_some(Contacts { columns, rows })
    }

    /// How many there are.
    pub fn count(self) -> u32 {
        self.columns * self.rows
    }

    /// How many lie one behind the other, along the sliding direction.
    pub fn columns(self) -> u32 {
        self.columns
    }

    /// How many lie side by side.
    pub fn rows(self) -> u32 {
        self.rows
    }

    /// The column of a contact, counted from 1.
    pub fn column(self, contact: u32) -> u32 {
        (contact - 1) % self.columns + 1
    }

    /// The row of a contact, counted from 1.
    pub fn row(self, contact: u32) -> u32 {
        (contact - 1) / self.columns + 1
    }

    /// The contacts of a row.
    pub(crate) fn of_row(self, row: u32) -> RangeInclusive<u32> {
        (row - 1) * self.columns + 1..=row * self.columns
    }

    /// A contact and its neighbours, the lowest number first.
    pub fn around(self, contact: u32) -> impl Iterator<Item = u32> {
        // Column and row counted from 0.
        let (column, row) = ((contact - 1) % self.columns, (contact - 1) / self.columns);
        let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
        let rows = row.saturating_sub(1)..(row + 2).min(self.rows);
        rows.flat_map(move |row| {
            let first = row * self.columns + 1;
            first + columns.start..first + columns.end
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Contacts;

    #[test]
    fn neighbours_are_those_of_the_definition() {
        for (columns, rows) in [(1, 1), (2, 1), (7, 1), (1, 5), (2, 2), (6, 4), (5, 3)] {
            let contacts = Contacts::in_rows(columns * rows, rows).unwrap();
            assert_eq!((contacts.columns(), contacts.rows()), (columns, rows));
            let all = 1..=contacts.count();
            for a in all.clone() {
                assert_eq!((contacts.row(a) - 1) * columns + contacts.column(a), a);
                assert!(contacts.of_row(contacts.row(a)).contains(&a));
                let is_near = |b: &u32| {
                    contacts.column(a).abs_diff(contacts.column(*b)) <= 1
                        && contacts.row(a).abs_diff(contacts.row(*b)) <= 1
                };
                let near: Vec<u32> = all.clone().filter(is_near).collect();
                assert_eq!(contacts.around(a).collect::<Vec<u32>>(), near, "{a} of {columns} x {rows}");
            }
        }
    }

    #[test]
    fn rows_are_of_equal_length() {
        assert_eq!(Contacts::in_rows(10, 3), None);
        assert_eq!(Contacts::in_rows(10, 0), None);
        assert_eq!(Contacts::in_rows(10, 1), Some(Contacts::from(10)));
    }
}
