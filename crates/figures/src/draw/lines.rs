//! Curves on a page: as much of them as a frame holds, and as many points as can be seen.

use super::print::page::Point;

/// How wide a column of the page is within which no more than four points of a curve are drawn: where
/// it comes in, its ends upwards and downwards, and where it goes out.
const COLUMN: f64 = 0.5;

/// A curve without the points that change nothing that can be seen.
pub(super) fn thinned(points: &[Point]) -> Vec<Point> {
    let mut thin: Vec<Point> = Vec::new();
    let column = |point: &Point| (point.0 / COLUMN).floor();
    for stretch in points.chunk_by(|a, b| column(a) == column(b)) {
        let by_height = |a: &usize, b: &usize| stretch[*a].1.total_cmp(&stretch[*b].1);
        let all = || 0..stretch.len();
        let ends = [Some(0), all().min_by(by_height), all().max_by(by_height), stretch.len().checked_sub(1)];
        let mut kept: Vec<usize> = ends.into_iter().flatten().collect();
        kept.sort_unstable();
        kept.dedup();
        thin.extend(kept.into_iter().map(|n| stretch[n]));
    }
    thin.dedup();
    thin
}

/// The stretches of a curve between two corners.
pub(super) fn clipped(points: &[Point], low: Point, high: Point) -> Vec<Vec<Point>> {
    let mut stretches: Vec<Vec<Point>> = Vec::new();
    let mut open = false;
    for ends in points.windows(2) {
        let Some((from, to)) = within(ends[0], ends[1], low, high) else {
            open = false;
            continue;
        };
        match stretches.last_mut() {
            Some(stretch) if open && stretch.last() == Some(&from) => stretch.push(to),
            _ => stretches.push(vec![from, to]),
        }
        open = to == ends[1];
    }
    stretches
}

/// The part of a straight line between two corners, none if it misses what is between them.
pub(super) fn within(from: Point, to: Point, low: Point, high: Point) -> Option<(Point, Point)> {
    let (mut begin, mut end) = (0.0f64, 1.0f64);
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    for (direction, distance) in
        [(-dx, from.0 - low.0), (dx, high.0 - from.0), (-dy, from.1 - low.1), (dy, high.1 - from.1)]
    {
        if direction == 0.0 {
            if distance < 0.0 {
                return None;
            }
        } else if direction < 0.0 {
            begin = begin.max(distance / direction);
        } else {
            end = end.min(distance / direction);
        }
    }
    let at = |share: f64| (from.0 + share * dx, from.1 + share * dy);
    let from = if begin > 0.0 { at(begin) } else { from };
    let to = if end < 1.0 { at(end) } else { to };
    (begin <= end).then_some((from, to))
}

#[cfg(test)]
mod tests {
    use super::{clipped, thinned};

    #[test]
    fn a_thin_curve_reaches_as_far_as_the_whole_one() {
        let curve: Vec<(f64, f64)> =
            (0..10_000).map(|n| (f64::from(n) * 0.001, f64::from(n * 7919 % 101))).collect();
        let thin = thinned(&curve);
        assert!(thin.len() <= 80 && thin.first() == curve.first() && thin.last() == curve.last());
        assert!(thin.iter().any(|(_, y)| *y == 0.0) && thin.iter().any(|(_, y)| *y == 100.0));
        // A curve of few points stays as it is, also straight up and down.
        let few = [(0.0, 0.0), (0.1, 1.0), (7.0, 3.0), (7.0, -3.0)];
        assert_eq!(thinned(&few), few);
    }

    #[test]
    fn curves_go_up_to_the_frame_and_no_farther() {
        let curve = [(-1.0, 1.0), (1.0, 1.0), (1.0, 5.0), (1.5, 5.0), (1.5, 1.0)];
        let inside = clipped(&curve, (0.0, 0.0), (2.0, 2.0));
        assert_eq!(inside, [vec![(0.0, 1.0), (1.0, 1.0), (1.0, 2.0)], vec![(1.5, 2.0), (1.5, 1.0)]]);
        assert!(clipped(&[(3.0, 0.0), (3.0, 2.0)], (0.0, 0.0), (2.0, 2.0)).is_empty());
    }
}
