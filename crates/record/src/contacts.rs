//! The arrangement of contacts, and their neighbours.

use std::ops::RangeInclusive;

/// Positions of contacts: columns along the sliding direction, rows across it. Contacts are numbered
/// from 1, row by row, so in a single row the number of a contact is its column.
///
/// Neighbours differ by at most one column and one row: two in a single row, eight over an area, where
/// diagonals are bonds as well, so that an oblique front remains one rupture.
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Contacts {
    columns: u32,
    rows: u32,
}

impl From<u32> for Contacts {
    /// Contacts in a single row.
    fn from(columns: u32) -> Contacts {
        Contacts { columns, rows: 1 }
    }
}

impl Contacts {
    /// Contacts in rows of equal length; `None` if `count` is not a multiple of `rows`.
    pub fn in_rows(count: u32, rows: u32) -> Option<Contacts> {
        let columns = count.checked_div(rows)?;
        (columns * rows == count).then_some(Contacts { columns, rows })
    }

    /// Number of contacts.
    pub fn count(self) -> u32 {
        self.columns * self.rows
    }

    /// Number of contacts along the sliding direction.
    pub fn columns(self) -> u32 {
        self.columns
    }

    /// Number of contacts across the sliding direction.
    pub fn rows(self) -> u32 {
        self.rows
    }

    /// Whether they cover an area: whether there are several rows.
    pub fn is_area(self) -> bool {
        self.rows > 1
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

    /// A contact and its neighbours, in ascending order.
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
