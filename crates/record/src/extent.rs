//! The set of contacts of an event, and the range that it spans.

use std::ops::RangeInclusive;

use crate::Contacts;

/// A range of columns or of rows, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Reach {
    /// The lowest.
    pub first: u32,
    /// The highest.
    pub last: u32,
}

impl Reach {
    /// The smallest range that includes all of these; `None` for no ranges.
    pub fn over(all: impl IntoIterator<Item = Reach>) -> Option<Reach> {
        let join = |a: Reach, b: Reach| Reach { first: a.first.min(b.first), last: a.last.max(b.last) };
        all.into_iter().reduce(join)
    }

    /// Length of the range; at least 1, since tables from other programs may have any numbers.
    pub fn count(self) -> u32 {
        self.last.saturating_sub(self.first).saturating_add(1)
    }

    /// Whether the range includes a column or row.
    pub fn contains(self, place: u32) -> bool {
        (self.first..=self.last).contains(&place)
    }

    /// Length of the overlap with another range.
    pub fn common(self, other: Reach) -> u32 {
        (self.last.min(other.last) + 1).saturating_sub(self.first.max(other.first))
    }

    /// Whether it is a valid range among `count` columns or rows.
    pub fn is_within(self, count: u32) -> bool {
        1 <= self.first && self.first <= self.last && self.last <= count
    }

    /// Whether an event with this range begins at the driven end and extends farther than `farthest`,
    /// the farthest column of the events before it; 0 if there were none.
    pub fn extends(self, farthest: u32) -> bool {
        self.first == 1 && self.last > farthest
    }

    /// Length relative to that of the slider, `L_p / L` (5.17), for `columns` columns.
    pub fn length_ratio(self, columns: u32) -> f64 {
        f64::from(self.last) / f64::from(columns)
    }
}

/// The smallest rectangle of columns and rows that includes all contacts of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct BoundingBox {
    /// Its columns.
    pub columns: Reach,
    /// Its rows: row 1 where contacts lie in a single one.
    pub rows: Reach,
}

impl BoundingBox {
    /// The single row that a slider without an area of contact has.
    const ONLY_ROW: Reach = Reach { first: 1, last: 1 };

    /// The box of an event with these columns, and these first and last rows if it has rows.
    pub fn new(columns: Reach, first_across: Option<u32>, last_across: Option<u32>) -> BoundingBox {
        let rows = first_across.zip(last_across).map(|(first, last)| Reach { first, last });
        BoundingBox { columns, rows: rows.unwrap_or(BoundingBox::ONLY_ROW) }
    }

    /// The smallest box that includes all of these; `None` for no boxes.
    pub fn over(all: impl IntoIterator<Item = BoundingBox> + Clone) -> Option<BoundingBox> {
        let columns = Reach::over(all.clone().into_iter().map(|one| one.columns))?;
        Some(BoundingBox { columns, rows: Reach::over(all.into_iter().map(|one| one.rows))? })
    }

    /// Whether it lies in a single row, that of a slider without an area of contact or the first.
    pub fn is_in_first_row(self) -> bool {
        self.rows == BoundingBox::ONLY_ROW
    }

    /// Number of contacts in it.
    pub fn count(self) -> u64 {
        u64::from(self.columns.count()) * u64::from(self.rows.count())
    }

    /// Number of contacts in both of two boxes.
    pub fn common(self, other: BoundingBox) -> u64 {
        u64::from(self.columns.common(other.columns)) * u64::from(self.rows.common(other.rows))
    }
}

/// A set of contacts, one bit each, since many events include nearly all.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Extent {
    of: Contacts,
    /// Contacts 1 to 64 first; bits beyond the last contact are 0.
    words: Vec<u64>,
    count: u32,
}

impl Extent {
    /// An empty set.
    pub fn none(of: impl Into<Contacts>) -> Extent {
        let of = of.into();
        Extent { of, words: vec![0; of.count().div_ceil(u64::BITS) as usize], count: 0 }
    }

    /// The set of these contacts.
    pub fn with(of: impl Into<Contacts>, contacts: impl IntoIterator<Item = u32>) -> Extent {
        let mut extent = Extent::none(of);
        contacts.into_iter().for_each(|contact| extent.insert(contact));
        extent
    }

    /// Word index and mask of a contact's bit.
    fn bit(&self, contact: u32) -> (usize, u64) {
        assert!((1..=self.of.count()).contains(&contact), "contact {contact} of {}", self.of.count());
        let index = contact - 1;
        ((index / u64::BITS) as usize, 1 << (index % u64::BITS))
    }

    /// Inserts a contact.
    pub fn insert(&mut self, contact: u32) {
        let (word, bit) = self.bit(contact);
        self.count += u32::from(self.words[word] & bit == 0);
        self.words[word] |= bit;
    }

    /// Removes a contact.
    pub fn remove(&mut self, contact: u32) {
        let (word, bit) = self.bit(contact);
        self.count -= u32::from(self.words[word] & bit != 0);
        self.words[word] &= !bit;
    }

    /// Inserts all contacts of another set.
    pub fn add(&mut self, other: &Extent) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word |= other;
        }
        self.count = self.words.iter().map(|word| word.count_ones()).sum();
    }

    /// Whether the set has a contact.
    pub fn contains(&self, contact: u32) -> bool {
        let (word, bit) = self.bit(contact);
        self.words[word] & bit != 0
    }

    /// Number of contacts in the set.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Whether the set has all contacts of the slider.
    pub fn is_whole(&self) -> bool {
        self.count == self.of.count()
    }

    /// The range of columns; `None` for an empty set.
    pub fn columns(&self) -> Option<Reach> {
        let of_row = |row: u32| {
            let Reach { first, last } = self.between(self.of.of_row(row))?;
            Some(Reach { first: self.of.column(first), last: self.of.column(last) })
        };
        Reach::over((1..=self.of.rows()).filter_map(of_row))
    }

    /// The range of rows; `None` for an empty set.
    pub fn rows(&self) -> Option<Reach> {
        let Reach { first, last } = self.between(1..=self.of.count())?;
        Some(Reach { first: self.of.row(first), last: self.of.row(last) })
    }

    /// The columns and rows together; `None` for an empty set.
    pub fn bounding_box(&self) -> Option<BoundingBox> {
        Some(BoundingBox { columns: self.columns()?, rows: self.rows()? })
    }

    /// The first and last contact of the set within a range of numbers.
    fn between(&self, numbers: RangeInclusive<u32>) -> Option<Reach> {
        let ((from, low), (to, high)) = (self.bit(*numbers.start()), self.bit(*numbers.end()));
        // The bits from `low` on, and those up to `high`.
        let masked = |at: usize| {
            let above = if at == from { low.wrapping_neg() } else { u64::MAX };
            let below = if at == to { high | (high - 1) } else { u64::MAX };
            self.words[at] & above & below
        };
        let first = (from..=to).find(|&at| masked(at) != 0)?;
        let last = (first..=to).rfind(|&at| masked(at) != 0)?;
        let number = |at: usize, bit: u32| at as u32 * u64::BITS + bit + 1;
        Some(Reach {
            first: number(first, masked(first).trailing_zeros()),
            last: number(last, masked(last).ilog2()),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::{Extent, Reach};
    use crate::Contacts;

    /// Pseudo-random numbers (Knuth's MMIX generator), below a bound.
    fn below(state: &mut u64, bound: u32) -> u32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 33) % u64::from(bound)) as u32
    }

    fn over(places: impl Iterator<Item = u32>) -> Option<Reach> {
        Reach::over(places.map(|place| Reach { first: place, last: place }))
    }

    fn assert_same(extent: &Extent, naive: &BTreeSet<u32>, of: Contacts) {
        assert_eq!(extent.count() as usize, naive.len());
        assert_eq!(extent.is_whole(), naive.len() == of.count() as usize);
        assert_eq!(extent.columns(), over(naive.iter().map(|contact| of.column(*contact))));
        assert_eq!(extent.rows(), over(naive.iter().map(|contact| of.row(*contact))));
        assert!((1..=of.count()).all(|contact| extent.contains(contact) == naive.contains(&contact)));
        assert_eq!(extent, &Extent::with(of, naive.iter().copied()));
    }

    #[test]
    fn an_extent_is_a_set_with_bounds() {
        let mut random = 1;
        for (columns, rows) in
            [(1, 1), (5, 1), (64, 1), (65, 1), (200, 1), (6, 4), (1, 70), (64, 3), (50, 11)]
        {
            let of = Contacts::in_rows(columns * rows, rows).unwrap();
            let mut sets = [(Extent::none(of), BTreeSet::new()), (Extent::none(of), BTreeSet::new())];
            for turn in 0..300 {
                let [(extent, naive), (other, other_naive)] = &mut sets;
                let contact = below(&mut random, of.count()) + 1;
                match below(&mut random, 8) {
                    0..=2 => {
                        extent.insert(contact);
                        naive.insert(contact);
                    }
                    3..=5 => {
                        extent.remove(contact);
                        naive.remove(&contact);
                    }
                    6 if turn % 5 == 0 => {
                        extent.add(other);
                        naive.append(&mut other_naive.clone());
                    }
                    _ => sets.swap(0, 1),
                }
                assert_same(&sets[0].0, &sets[0].1, of);
            }
            let all = Extent::with(of, 1..=of.count());
            assert!(all.is_whole());
            assert_same(&all, &(1..=of.count()).collect(), of);
        }
    }

    #[test]
    #[should_panic(expected = "contact 71 of 70")]
    fn no_contact_lies_beyond_the_last() {
        Extent::none(70).insert(71);
    }

    #[test]
    fn reaches_are_compared_as_sets_of_places() {
        for (a, b, c, d) in (0..6u32.pow(4)).map(|n| (n % 6 + 1, n / 6 % 6 + 1, n / 36 % 6 + 1, n / 216 + 1))
        {
            let (one, other) = (Reach { first: a, last: b }, Reach { first: c, last: d });
            assert_eq!(one.is_within(5), a <= b && b <= 5);
            if a > b || c > d {
                continue;
            }
            let places = |reach: Reach| (reach.first..=reach.last).collect::<BTreeSet<u32>>();
            assert_eq!(one.count() as usize, places(one).len());
            assert_eq!(one.common(other) as usize, places(one).intersection(&places(other)).count());
            assert_eq!(one.contains(c), places(one).contains(&c));
            assert_eq!(Reach::over([one, other]), over(places(one).union(&places(other)).copied()));
            assert_eq!(one.extends(c), places(one).contains(&1) && b > c);
        }
        assert_eq!(Reach::over([]), None);
    }
}
