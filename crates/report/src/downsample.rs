//! Much in little room: a curve of few points that has lost no drop, and the widest of many.

/// The smallest and the largest value of each column of time, and the ends.
#[derive(Debug, Clone)]
pub(crate) struct Curve {
    columns: Vec<Option<[(u64, f64); 2]>>,
    /// Steps of a column.
    width: u64,
    ends: Option<[(u64, f64); 2]>,
}

impl Curve {
    /// A curve over a run with that many steps, in at most that many columns.
    pub(crate) fn new(steps: u64, columns: usize) -> Curve {
        let width = (steps / columns as u64 + 1).max(1);
        Curve { columns: vec![None; columns], width, ends: None }
    }

    /// A point of it, later than those before.
    pub(crate) fn push(&mut self, step: u64, value: f64) {
        let point = (step, value);
        let last = self.columns.len() - 1;
        let column = &mut self.columns[((step / self.width) as usize).min(last)];
        let [low, high] = column.get_or_insert([point, point]);
        if value < low.1 {
            *low = point;
        }
        if value > high.1 {
            *high = point;
        }
        self.ends.get_or_insert([point, point])[1] = point;
    }

    /// Its points, in order.
    pub(crate) fn points(&self) -> Vec<(u64, f64)> {
        let of_columns = self.columns.iter().flatten().flatten();
        let mut points: Vec<(u64, f64)> = of_columns.chain(self.ends.iter().flatten()).copied().collect();
        points.sort_by_key(|point| point.0);
        points.dedup_by_key(|point| point.0);
        points
    }
}

/// Widens the elements of a list that must be kept, by the given blocks.
pub(crate) type Stays<T> = dyn Fn(&mut [(u32, T)]);

/// Collects the widest elements, the first among equals; holds a few more while collecting.
#[derive(Debug, Clone)]
pub(crate) struct Widest<T> {
    kept: Vec<(u32, T)>,
    most: usize,
    seen: u64,
}

impl<T> Widest<T> {
    pub(crate) fn new(most: usize) -> Widest<T> {
        Widest { kept: Vec::new(), most, seen: 0 }
    }

    /// Adds an item of that many blocks. `stays` receives the items so far and decides which are
    /// kept however narrow they are.
    pub(crate) fn push(&mut self, blocks: u32, one: T, stays: &Stays<T>) {
        self.seen += 1;
        self.kept.push((blocks, one));
        if self.kept.len() >= 2 * self.most.max(1) {
            self.thin(stays);
        }
    }

    /// Those collected so far, each with the blocks that rank it.
    pub(crate) fn ranked(&mut self, stays: &Stays<T>) -> &[(u32, T)] {
        stays(&mut self.kept);
        &self.kept
    }

    fn thin(&mut self, stays: &Stays<T>) {
        stays(&mut self.kept);
        // Stable: of equals the first ones stay.
        self.kept.sort_by_key(|(blocks, _)| std::cmp::Reverse(*blocks));
        self.kept.truncate(self.most);
    }

    /// Those that are kept, and the number of all.
    pub(crate) fn finish(mut self, stays: &Stays<T>) -> (Vec<T>, u64) {
        if self.kept.len() > self.most {
            self.thin(stays);
        }
        (self.kept.into_iter().map(|(_, one)| one).collect(), self.seen)
    }
}

#[cfg(test)]
mod tests {
    use super::{Curve, Widest};

    #[test]
    fn every_extreme_of_a_column_stays_and_no_point_is_made_up() {
        let value = |step: u64| ((step * 7919) % 1000) as f64;
        let mut curve = Curve::new(100_000, 50);
        (0..=100_000).for_each(|step| curve.push(step, value(step)));
        let points = curve.points();
        assert!(points.len() <= 102 && points.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert!(points.iter().all(|&(step, found)| found == value(step)));
        for column in 0..49 {
            let of_column = |step: &u64| *step / 2001 == column;
            let all = || (0..=100_000).filter(of_column).map(value);
            let (low, high) = (all().fold(f64::MAX, f64::min), all().fold(f64::MIN, f64::max));
            let kept: Vec<f64> = points.iter().filter(|(step, _)| of_column(step)).map(|p| p.1).collect();
            assert!(kept.contains(&low) && kept.contains(&high), "column {column}");
        }
        assert_eq!((points[0].0, points.last().unwrap().0), (0, 100_000));
    }

    #[test]
    fn the_widest_stay_and_of_equals_the_first() {
        let mut widest = Widest::new(3);
        for (number, blocks) in [5, 1, 9, 5, 2, 9, 5, 1, 1, 1, 7].into_iter().enumerate() {
            widest.push(blocks, number, &|_| {});
        }
        assert_eq!(widest.finish(&|_| {}), (vec![2, 5, 10], 11));
        let mut all = Widest::new(3);
        all.push(1, 'a', &|_| {});
        assert_eq!(all.finish(&|_| {}), (vec!['a'], 1));
        // The caller widens elements that must be kept.
        let mut marked = Widest::new(2);
        let stays = |kept: &mut [(u32, usize)]| {
            kept.iter_mut().filter(|(_, one)| *one == 1).for_each(|(blocks, _)| *blocks = u32::MAX);
        };
        (0..9).for_each(|number| marked.push(9 - number as u32, number, &stays));
        assert_eq!(marked.finish(&stays).0, [1, 0]);
    }
}
