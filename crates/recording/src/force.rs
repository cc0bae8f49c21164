//! Load drops, and the loads at any time, by straight lines through samples between the ramps of the tangential force.

use std::iter;
use std::ops::Range;

use asperity_record::{Line, LoadDrop};

use crate::description::Channel;
use crate::noise::plateaus;
use crate::pass::Piece;
use crate::pick::{Finders, Search};
use crate::ramp::Ramp;
use crate::samples::Rows;
use crate::survey::Part;

/// Windows of samples on either side of a drop through which lines are drawn.
const LINE_WINDOWS: u64 = 8;

/// Samples between a line and the ramp beside it.
const MARGIN: u64 = 2;

/// Windows in which the ramp behind a sample is known, and that a drop needs before it is known, with the lines.
const AHEAD: u64 = 21;
pub(crate) const BEHIND: u64 = 36;

/// The forces of a recording by windows of one width: in each part the ramps of `F_T`, as they are or not drops.
#[derive(Debug)]
pub(crate) struct Forces<'a> {
    pub(crate) parts: &'a [Part],
    pub(crate) ramps: Vec<Vec<Ramp>>,
    pub(crate) searches: Vec<Search>,
    /// The channels that are read, and which of them is `F_T`, and `F_N`, the load point and the pushed end if recorded.
    pub(crate) channels: Vec<&'a Channel>,
    pub(crate) places: [Option<usize>; 4],
    pub(crate) normal_force_n: Option<f64>,
    pub(crate) finder: Finders,
    pub(crate) drops: Vec<LoadDrop>,
    /// How many ramps of the part were judged.
    pub(crate) judged: usize,
}

/// The line through samples, the first at this place; none through fewer than four.
fn line(first: u64, samples: &[f64]) -> Option<Line> {
    let points = samples.iter().enumerate().map(|(n, y)| ((first + n as u64) as f64, *y));
    if samples.len() < 4 { None } else { Line::of(points) }
}

/// Loads at a time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Loads {
    pub(crate) driving_force_n: f64,
    pub(crate) normal_load_n: f64,
    /// Standard error of their ratio.
    pub(crate) ratio_error: Option<f64>,
}

/// A part, and samples of it.
type Near = (usize, Range<u64>);

/// Which samples tell the loads at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Those before a detachment.
    Before,
    /// Those behind a re-attachment.
    Behind,
}

/// The place of `F_T`, `F_N` and the load point in rows.
const FORCE: usize = 0;
const NORMAL: usize = 1;
const DRIVE: usize = 2;

impl Forces<'_> {
    fn quantity(&self, which: usize, rows: &Rows<'_>, samples: &Range<u64>) -> Option<Vec<f64>> {
        let channel = self.places[which]?;
        Some(rows.si(channel, self.channels[channel], samples.clone()).collect())
    }

    /// The lines before and behind a ramp, and the samples whose normal force counts.
    fn ranges(&self, part: usize, n: usize) -> [Range<u64>; 3] {
        let (ramps, samples, width) =
            (&self.ramps[part], self.parts[part].samples, self.searches[part].noise.width);
        let (begin, end) = (ramps[n].begin.floor() as u64, ramps[n].end.ceil() as u64);
        let from = |place: u64| place.min(samples);
        let least = n.checked_sub(1).map_or(0, |before| ramps[before].end.ceil() as u64 + MARGIN);
        let most =
            ramps.get(n + 1).map_or(samples, |next| (next.begin.floor() as u64 + 1).saturating_sub(MARGIN));
        let before =
            begin.saturating_sub(LINE_WINDOWS * width).max(least)..(begin + 1).saturating_sub(MARGIN);
        let behind = from(end + MARGIN)..from(end + LINE_WINDOWS * width + MARGIN).min(most);
        let start = ramps[n].begin.ceil() as u64;
        [before, behind, start.saturating_sub(width)..from(start + width)]
    }

    /// Adds samples of a part from `first` on, the last ones of the rows: finds ramps, and drops as soon as their lines
    /// are known.
    pub(crate) fn extend(&mut self, piece: &Piece, first: u64, rows: &Rows<'_>, is_last: bool) {
        let part = piece.part;
        if first == 0 {
            (self.judged, self.finder) = (0, Finders::new(&self.searches[part..=part], piece));
        }
        let (noise, ramps) = (self.searches[part].noise, &mut self.ramps[part]);
        self.finder.extend(rows, FORCE, is_last, &mut |_, ramp| {
            if !noise.is_clipped_at(plateaus(rows, FORCE, &ramp)) {
                ramps.push(ramp);
            }
        });
        let (end, width) = (rows.end(), self.searches[part].noise.width);
        while let Some(ramp) = self.ramps[part].get(self.judged)
            && (is_last || ramp.end.ceil() as u64 + AHEAD * width + 2 * MARGIN < end)
        {
            if let Some(mut drop) = self.drop(part, self.judged, rows) {
                drop.drop = self.drops.len() as u64;
                let before = self.drops.last().filter(|before| before.part == drop.part);
                drop.recurrence_s = before.map(|before| drop.onset_s - before.onset_s);
                self.drops.push(drop);
            }
            self.judged += 1;
        }
    }

    /// The load drop of a ramp, if it is one, without its number and recurrence.
    fn drop(&self, part: usize, n: usize, rows: &Rows<'_>) -> Option<LoadDrop> {
        let (of, ramp, search) = (&self.parts[part], self.ramps[part][n], &self.searches[part]);
        let [left, right, normal] = self.ranges(part, n);
        let line_of =
            |which: usize, samples: &Range<u64>| line(samples.start, &self.quantity(which, rows, samples)?);
        let (first, second) = (line_of(FORCE, &left)?, line_of(FORCE, &right)?);
        let ((ft_before_n, before_error), (ft_after_n, after_error)) =
            (first.at(ramp.begin), second.at(ramp.begin));
        let drop_n = ft_before_n - ft_after_n;
        if drop_n < search.least * self.channels[0].scale.abs() {
            return None;
        }
        let (onset_s, end_s) = (of.time_s(ramp.begin), of.time_s(ramp.end));
        let normal_n = self.quantity(NORMAL, rows, &normal).map(|n| n.iter().sum::<f64>() / n.len() as f64);
        let normal_n = normal_n.or(self.normal_force_n);
        // Rates by the samples' own times.
        let per_s = (left.end - 1 - left.start) as f64
            / (of.time_s((left.end - 1) as f64) - of.time_s(left.start as f64));
        let loading_rate_n_per_s = first.slope * per_s;
        let speed_m_per_s =
            line_of(DRIVE, &left).map(|line| line.slope * per_s).filter(|speed| *speed != 0.0);
        let stiffness_n_per_m = speed_m_per_s.map(|speed_m_per_s| loading_rate_n_per_s / speed_m_per_s);
        Some(LoadDrop {
            drop: 0,
            part: of.number,
            onset_s,
            end_s,
            ft_before_n,
            ft_after_n,
            drop_n,
            drop_error_n: before_error.hypot(after_error),
            ft_fn_before: normal_n.map(|normal_n| ft_before_n / normal_n),
            ft_fn_after: normal_n.map(|normal_n| ft_after_n / normal_n),
            recurrence_s: None,
            loading_rate_n_per_s,
            stiffness_n_per_m,
            load_point_slip_m: stiffness_n_per_m.filter(|k| *k != 0.0).map(|stiffness| drop_n / stiffness),
        })
    }

    /// The stretches of a part between the samples that belong to its ramps.
    pub(crate) fn free(&self, part: usize) -> Vec<Range<u64>> {
        let (mut from, samples) = (0, self.parts[part].samples);
        let taken = |ramp: &Ramp| (ramp.begin.floor() as u64).saturating_sub(1)..ramp.end.ceil() as u64 + 2;
        let taken = self.ramps[part].iter().map(taken).chain(iter::once(samples..samples));
        let free = taken.map(|taken| {
            let free = from..taken.start.min(samples);
            from = from.max(taken.end);
            free
        });
        free.filter(|free| !free.is_empty()).collect()
    }

    /// What tells the loads at a time, given what is free in each part.
    pub(crate) fn near(&self, time_s: f64, side: Side, free: &[Vec<Range<u64>>]) -> Near {
        let off = |part: &Part| (part.first_s() - time_s).max(time_s - part.last_s()).max(0.0);
        let nearest = self.parts.iter().enumerate().min_by(|(_, a), (_, b)| off(a).total_cmp(&off(b)));
        let (part, of) = nearest.expect("a stream has a part");
        let (width, free, last, place) =
            (self.searches[part].noise.width, &free[part], of.samples - 1, of.sample_at(time_s));
        let samples = match side {
            Side::Before => {
                let at = ((place - 1.0).floor().max(0.0) as u64).min(last);
                let before = free[..free.partition_point(|free| free.start <= at)].last();
                let Range { start, end } = before.map_or(0..1, |free| free.start..free.end.min(at + 1));
                end.saturating_sub(width).max(start)..end
            }
            Side::Behind => {
                let at = ((place + 1.0).ceil().max(0.0) as u64).min(last);
                let behind = free.get(free.partition_point(|free| free.end <= at));
                let Range { start, end } = behind.map_or(last..last + 1, |free| free.start.max(at)..free.end);
                start..end.min(start + width)
            }
        };
        (part, samples)
    }

    /// The loads at a time by the samples that tell them.
    pub(crate) fn loads(&self, time_s: f64, side: Side, near: &Near, rows: &Rows<'_>) -> Loads {
        let (part, samples) = near;
        let place = self.parts[*part].sample_at(time_s);
        let at = |which: usize| {
            let values = self.quantity(which, rows, samples)?;
            Some(match line(samples.start, &values) {
                Some(line) => (line.at(place).0, Some(line.at(place).1)),
                // Too few: the nearest.
                None if side == Side::Before => (values[values.len() - 1], None),
                None => (values[0], None),
            })
        };
        let (driving_force_n, force_error) = at(FORCE).expect("there are forces");
        let (normal_load_n, normal_error) =
            at(NORMAL).unwrap_or((self.normal_force_n.unwrap_or(1.0), Some(0.0)));
        let ratio = driving_force_n / normal_load_n;
        let of_ratio = |(force, normal): (f64, f64)| {
            (ratio * (force / driving_force_n).hypot(normal / normal_load_n)).abs()
        };
        let ratio_error = force_error.zip(normal_error).map(of_ratio).filter(|error| error.is_finite());
        Loads { driving_force_n, normal_load_n, ratio_error }
    }
}
