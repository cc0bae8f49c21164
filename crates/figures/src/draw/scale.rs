//! Axes and colour bars: where a value stands, and which values are labelled.

use asperity_record::rounded;

/// Least and largest magnitude of an end of an axis that is not zero: beyond them the power of ten that
/// is taken out of its numbers is no double.
const LEAST: f64 = 1e-290;
const LARGEST: f64 = 1e290;

/// Least length of an axis over its larger end: a hundred marks are still different doubles.
const LEAST_LENGTH: f64 = 1e-12;

/// Least length of a logarithmic axis, in powers of ten.
const LEAST_POWERS: f64 = 1e-6;

/// Two ends that an axis can have, of a logarithmic one as decimal logarithms: finite, in ascending order, and apart.
///
/// The load of a slider at rest, the length of precursors of which there are none or the time of a run
/// that has none give two ends alike, and a number that overflowed gives none. Ends that are too close
/// for marks between them move apart by a tenth, or by half a decade, to either side; zero alone, or what is no
/// number, becomes 0 to 1.
fn ends(log: bool, from: f64, to: f64) -> (f64, f64) {
    let bounded = |end: f64| match end.abs() {
        _ if log => end.clamp(LEAST.log10(), LARGEST.log10()),
        size if size < LEAST => 0.0,
        size if size > LARGEST => LARGEST.copysign(end),
        _ => end,
    };
    // An end that is no number gives way to the other.
    let there = || [from, to].into_iter().filter(|end| end.is_finite()).map(bounded);
    let (Some(from), Some(to)) = (there().reduce(f64::min), there().reduce(f64::max)) else {
        return (0.0, 1.0);
    };
    let larger = from.abs().max(to.abs());
    let (least, apart) = if log { (LEAST_POWERS, 0.5) } else { (LEAST_LENGTH * larger, 0.1 * larger) };
    match to - from {
        _ if !log && larger == 0.0 => (0.0, 1.0),
        length if length < least => (from - apart, to + apart),
        _ => (from, to),
    }
}

/// Ends that hold no value.
const NOTHING: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

/// What a free axis leaves empty beyond its values, over their range.
const ROOM: f64 = 0.06;

/// An axis, or a colour bar.
#[derive(Debug, Clone)]
pub(crate) struct Scale {
    pub(super) label: String,
    from: f64,
    to: f64,
    log: bool,
    /// Names of the values 0, 1 and so on, if it is one of words.
    words: Vec<String>,
    /// Whether only whole numbers are labelled.
    whole: bool,
    /// The values that are labelled, where these are chosen; else they are round.
    marked: Vec<f64>,
    /// What it leaves empty beyond what is drawn, over its range, if its ends follow from that.
    room: Option<f64>,
    /// Whether it then begins at zero, unless that leaves more than half of it empty.
    from_zero: bool,
    /// Whether its values grow towards its beginning, as depth does.
    is_downwards: bool,
}

/// A mark on an axis; those between bear no label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub(crate) at: f64,
    pub(crate) label: String,
}

impl Scale {
    /// A scale that holds these values, with a margin as a share of its length on both sides.
    /// Values that have no place on a logarithmic scale are left out.
    pub(crate) fn of(
        label: &str,
        log: bool,
        margin: f64,
        values: impl Iterator<Item = f64> + Clone,
    ) -> Scale {
        let whole = !log && values.clone().all(|value| value.fract() == 0.0);
        let scale = Scale { log, whole, room: Some(margin), ..Scale::between(label, 0.0, 1.0) };
        Scale { room: None, ..scale.fitted(values) }
    }

    /// It with these places as its ends.
    fn with_places(self, (from, to): (f64, f64)) -> Scale {
        let (from, to) = ends(self.log, from, to);
        Scale { from, to, ..self }
    }

    /// The least and the largest of two places and those of values that have one.
    fn reach(&self, values: impl Iterator<Item = f64>, ends: (f64, f64)) -> (f64, f64) {
        let places = values.map(|value| self.place(value)).filter(|place| place.is_finite());
        places.fold(ends, |(low, high), at| (low.min(at), high.max(at)))
    }

    /// A scale whose ends follow from what is drawn, with a little room on both sides; from zero where that leaves no
    /// more than half of it empty.
    pub(crate) fn free(label: &str) -> Scale {
        Scale { room: Some(ROOM), from_zero: true, ..Scale::between(label, 0.0, 1.0) }
    }

    /// The same, which ends with what is drawn.
    pub(crate) fn tight(label: &str) -> Scale {
        Scale { room: Some(0.0), ..Scale::free(label) }
    }

    /// The same, logarithmic.
    pub(crate) fn free_powers(label: &str) -> Scale {
        Scale { log: true, ..Scale::free(label) }
    }

    /// It, logarithmic if so.
    pub(crate) fn in_powers(self, log: bool) -> Scale {
        Scale { log, ..self }
    }

    /// It with ends that hold these values, if it is free.
    pub(crate) fn fitted(&self, values: impl Iterator<Item = f64> + Clone) -> Scale {
        let Some(room) = self.room else { return self.clone() };
        let whole = self.whole || values.clone().all(|value| value.fract() == 0.0);
        let (low, high) = self.reach(values, NOTHING);
        // Nothing, or zero alone, is shown from 0 to 1.
        if low > high || (!self.log && low == 0.0 && high == 0.0) {
            return self.clone();
        }
        let least = if self.log { 0.5 } else { 0.1 * low.abs() };
        let room = if high > low { room * (high - low) } else { (1.0 + 2.0 * room) * least };
        let from_zero = self.from_zero && !self.log && low >= 0.0 && low <= 0.5 * high;
        let ends = (if from_zero { 0.0 } else { low - room }, high + room);
        Scale { whole, room: None, ..self.clone() }.with_places(ends)
    }

    /// Where a value stands, in the unit of the ends; no number where it has no place.
    fn place(&self, value: f64) -> f64 {
        if self.log { value.log10() } else { value }
    }

    /// The value that stands at a place.
    fn value(&self, place: f64) -> f64 {
        if self.log { 10f64.powf(place) } else { place }
    }

    /// A scale of words, one after the other.
    pub(crate) fn of_words(label: &str, words: &[String]) -> Scale {
        let to = words.len() as f64 - 0.5;
        Scale { words: words.to_vec(), whole: true, ..Scale::between(label, -0.5, to) }
    }

    /// A scale with these ends, whatever values it holds; two alike, or no numbers, give way to [`ends`].
    pub(crate) fn between(label: &str, from: f64, to: f64) -> Scale {
        let (from, to) = ends(false, from, to);
        let (label, log, words, marked) = (label.to_owned(), false, Vec::new(), Vec::new());
        let (whole, from_zero, is_downwards) = (false, false, false);
        Scale { label, from, to, log, words, whole, marked, room: None, from_zero, is_downwards }
    }

    /// It with values that grow downwards, if so.
    pub(crate) fn downwards(self, is_downwards: bool) -> Scale {
        Scale { is_downwards, ..self }
    }

    /// Labels only whole numbers, if `whole`.
    pub(super) fn in_whole_numbers(self, whole: bool) -> Scale {
        Scale { whole, ..self }
    }

    /// Labels these values in ascending order, or as many of them as there is room for, and no others.
    pub(crate) fn marked_at(self, values: &[f64]) -> Scale {
        Scale { marked: values.to_vec(), ..self }
    }

    /// A logarithmic scale with these values as its ends.
    pub(crate) fn powers_between(label: &str, from: f64, to: f64) -> Scale {
        Scale { log: true, ..Scale::between(label, 0.0, 1.0) }.reaching(from, to)
    }

    /// A scale with these ends, given as its values.
    pub(crate) fn reaching(self, from: f64, to: f64) -> Scale {
        let ends = (self.place(from), self.place(to));
        self.with_places(ends)
    }

    /// It with ends that hold these values as well, and a little room beyond those that it did not hold.
    pub(crate) fn holding(self, values: impl Iterator<Item = f64>) -> Scale {
        if self.room.is_some() {
            return self;
        }
        let (from, to) = (self.from, self.to);
        let (low, high) = self.reach(values, (from, to));
        let beyond = |end: f64, old: f64| {
            if end == old { old } else { end + ROOM * (end - old).signum() * (high - low) }
        };
        Scale { from: beyond(low, from), to: beyond(high, to), ..self }
    }

    /// A scale with zero in its middle, if it has values of both signs: one that is a millionth of
    /// the other is rounding.
    pub(crate) fn about_zero(&self) -> Option<Scale> {
        let (low, high) = (-self.from, self.to);
        let is_signed = !self.log && self.words.is_empty() && low.min(high) > 1e-6 * low.max(high);
        is_signed.then(|| self.clone().reaching(-low.max(high), low.max(high)))
    }

    /// How far along it a value stands, from 0 to 1; less or more beyond its ends, and no number where it has no place.
    pub(crate) fn way(&self, value: f64) -> f64 {
        let way = (self.place(value) - self.from) / (self.to - self.from);
        if self.is_downwards { 1.0 - way } else { way }
    }

    /// How far along it a value stands, from 0 to 1; none if it is not on it.
    pub(crate) fn share(&self, value: f64) -> Option<f64> {
        Some(self.way(value)).filter(|share| (-1e-9..=1.0 + 1e-9).contains(share))
    }

    /// Its ends, as values.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.value(self.from), self.value(self.to))
    }

    /// Where cells about values in ascending order begin and end; that of a number alone is the whole scale.
    pub(crate) fn cell_edges(&self, values: &[f64]) -> Vec<f64> {
        let places: Vec<f64> = values.iter().map(|value| self.place(*value)).collect();
        let half = |n: usize| (places[n + 1] - places[n]) / 2.0;
        let edges = match &places[..] {
            [] => Vec::new(),
            [word] if !self.words.is_empty() => vec![word - 0.5, word + 0.5],
            [_] => vec![self.from, self.to],
            [first, .., last] => {
                let between = places.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0);
                let ends = (first - half(0), last + half(places.len() - 2));
                std::iter::once(ends.0).chain(between).chain([ends.1]).collect()
            }
        };
        edges.into_iter().map(|place| self.value(place)).collect()
    }

    /// Its label, with the power of ten that is taken out of its numbers.
    pub(crate) fn label(&self) -> String {
        let power = self.power();
        if power == 0 {
            return self.label.clone();
        }
        let ten = power_of_ten(power);
        match self.label.rfind('(') {
            Some(at) if self.label.ends_with(')') => {
                format!("{}({ten} {}", &self.label[..at], &self.label[at + 1..])
            }
            _ => format!("{} ({ten})", self.label),
        }
    }

    fn power(&self) -> i32 {
        let largest = self.from.abs().max(self.to.abs());
        let is_plain = self.log || !self.words.is_empty() || (1e-2..1e5).contains(&largest) || largest == 0.0;
        if is_plain { 0 } else { (largest.log10() + 1e-9).floor() as i32 }
    }

    /// The ticks of the axis, at most about as many between the ends as there is room for.
    pub(crate) fn ticks_at_most(&self, most: f64) -> Vec<Tick> {
        if !self.words.is_empty() {
            let tick = |(n, word): (usize, &String)| Tick { at: n as f64, label: word.clone() };
            return self.words.iter().enumerate().map(tick).collect();
        }
        if !self.marked.is_empty() {
            return self.ticks_at_values(most);
        }
        if self.log {
            return self.decades();
        }
        let unit = 10f64.powi(self.power());
        let (from, to) = (self.from / unit, self.to / unit);
        let rough = (to - from) / most.max(2.0);
        let decade = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|factor| factor * decade);
        let step = step.into_iter().find(|step| *step >= rough * 0.999).unwrap_or(10.0 * decade);
        let step = if self.whole && unit == 1.0 { step.max(1.0) } else { step };
        let decimals = (-(step.log10() + 1e-9).floor()).max(0.0) as usize;
        let (first, last) = ((from / step - 1e-9).ceil() as i64, (to / step + 1e-9).floor() as i64);
        (first..=last)
            .map(|n| {
                let value = n as f64 * step;
                Tick { at: value * unit, label: minus(&format!("{value:.decimals$}")) }
            })
            .collect()
    }

    /// The ticks of a colour bar: those of an axis, and its ends, which what is beyond them has the colours of.
    pub(crate) fn ticks_with_ends(&self, most: f64) -> Vec<Tick> {
        let (from, to) = self.ends();
        let unit = 10f64.powi(self.power());
        let end = |at: f64| Tick { at, label: number(rounded(at / unit, 3)) };
        let clear = 0.6 / most.max(2.0);
        let is_clear = |tick: &Tick| (clear..1.0 - clear).contains(&self.way(tick.at));
        let between = self.ticks_at_most(most).into_iter().filter(is_clear);
        std::iter::once(end(from)).chain(between).chain([end(to)]).collect()
    }

    /// Ticks at the values that are to be labelled, without those that stand too near to the one before.
    fn ticks_at_values(&self, most: f64) -> Vec<Tick> {
        let least = 1.0 / (most + 1.0) - 1e-9;
        let mut last = f64::NEG_INFINITY;
        let mut values = self.marked.clone();
        values.retain(|value| {
            let share = self.share(*value).filter(|share| share - last >= least);
            last = share.unwrap_or(last);
            share.is_some()
        });
        if self.log {
            return values.into_iter().map(|at| Tick { at, label: number(at) }).collect();
        }
        let unit = 10f64.powi(self.power());
        let largest = values.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        // As many decimals as four digits of the largest have, if that many are needed.
        let shown = |value: f64, decimals: usize| format!("{:.decimals$}", value / unit);
        let is_near = |value: f64, decimals: usize| {
            let read: f64 = shown(value, decimals).parse().unwrap_or(f64::NAN);
            (read * unit - value).abs() <= 5e-5 * largest
        };
        let decimals = (0..6).find(|&decimals| values.iter().all(|value| is_near(*value, decimals)));
        let label = |value: f64| minus(&shown(value, decimals.unwrap_or(6)));
        values.into_iter().map(|at| Tick { at, label: label(at) }).collect()
    }

    /// Powers of ten, and where there are few of them numbers between.
    fn decades(&self) -> Vec<Tick> {
        let (first, last) = ((self.from - 1e-9).ceil() as i32, (self.to + 1e-9).floor() as i32);
        let every = ((last - first) / 8 + 1).max(1) as usize;
        if last - first >= 2 {
            // All in the same way: 0.1 beside 10^{−4} is harder to read.
            let are_plain = first >= -2 && last <= 3;
            let label = |n: i32| if are_plain { number(10f64.powi(n)) } else { power_of_ten(n) };
            let tick = |n: i32| Tick { at: 10f64.powi(n), label: label(n) };
            return (first..=last).step_by(every).map(tick).collect();
        }
        let is_within = |value: &f64| (self.from - 1e-9..=self.to + 1e-9).contains(&value.log10());
        let all = |factors: &[f64]| -> Vec<f64> {
            let values =
                (first - 1..=last).flat_map(|n| factors.iter().map(move |factor| factor * 10f64.powi(n)));
            values.filter(is_within).collect()
        };
        let few = all(&[1.0, 2.0, 5.0]);
        let values = if few.len() < 3 { all(&[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]) } else { few };
        values.into_iter().map(|at| Tick { at, label: number(at) }).collect()
    }

    /// Values marked without a label: those between powers of ten.
    pub(crate) fn between_ticks(&self) -> Vec<f64> {
        if !self.log || !self.marked.is_empty() {
            return Vec::new();
        }
        let decades = self.from.floor() as i32..=self.to.ceil() as i32;
        let values = decades.flat_map(|n| (1..10).map(move |factor| f64::from(factor) * 10f64.powi(n)));
        values.filter(|value| self.share(*value).is_some()).collect()
    }
}

fn power_of_ten(n: i32) -> String {
    format!("10^{{{}}}", minus(&n.to_string()))
}

/// A number as it stands in a figure: four digits, and very large and small ones with a power of
/// ten.
pub(crate) fn number(value: f64) -> String {
    let plain = |value: f64| {
        let decimals = (3 - value.abs().log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.decimals$}");
        let short = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        minus(short)
    };
    if value == 0.0 {
        return "0".to_owned();
    }
    if (1e-3..1e5).contains(&value.abs()) {
        return plain(value);
    }
    let power = (value.abs().log10() + 1e-12).floor() as i32;
    let (digits, ten) = (plain(value / 10f64.powi(power)), power_of_ten(power));
    if digits == "1" { ten } else { format!("{digits}·{ten}") }
}

/// With the sign as it is printed; a rounded zero has none.
fn minus(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(zero) if zero.chars().all(|c| c == '0' || c == '.') => zero.to_owned(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::{Scale, ends, number};

    fn labels(scale: &Scale) -> Vec<String> {
        scale.ticks_at_most(7.0).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn ticks_are_round_and_powers_of_ten_are_powers() {
        let of = |log, values: &[f64]| Scale::of("t (s)", log, 0.0, values.iter().copied());
        assert_eq!(labels(&of(false, &[-0.5, 0.5])), ["−0.4", "−0.2", "0.0", "0.2", "0.4"]);
        assert_eq!(labels(&of(false, &[0.0, 3.0])), ["0", "1", "2", "3"]);
        let small = of(false, &[1e-8, 4e-8]);
        assert_eq!(
            (labels(&small).concat().as_str(), small.label().as_str()),
            ("1.01.52.02.53.03.54.0", "t (10^{−8} s)")
        );
        assert_eq!(labels(&of(true, &[1e-8, 1e-4])), ["10^{−8}", "10^{−7}", "10^{−6}", "10^{−5}", "10^{−4}"]);
        assert_eq!(labels(&of(true, &[0.04, 0.6])), ["0.05", "0.1", "0.2", "0.5"]);
        assert_eq!(of(true, &[0.01, 1.0]).share(0.1), Some(0.5));
        // One value, none, and one that has no place.
        assert!((of(false, &[2.0]).share(2.0).unwrap() - 0.5).abs() < 1e-12);
        assert!(!labels(&of(false, &[])).is_empty());
        assert_eq!(of(true, &[0.0, 1.0, 100.0]).share(10.0), Some(0.5));
    }

    #[test]
    fn values_that_are_chosen_are_labelled_as_long_as_there_is_room() {
        let of = |log, values: &[f64]| Scale::of("x", log, 0.1, values.iter().copied()).marked_at(values);
        assert_eq!(labels(&of(false, &[-0.5, 0.0, 0.5])), ["−0.5", "0.0", "0.5"]);
        assert_eq!(labels(&of(false, &[0.6, 0.65, 0.7])), ["0.60", "0.65", "0.70"]);
        assert_eq!(labels(&of(false, &[0.1 + 0.2, 1.0])), ["0.3", "1.0"]);
        assert_eq!(labels(&of(false, &[2e-8, 4e-8])), ["2", "4"]);
        assert_eq!(labels(&of(false, &[1.0 / 3.0, 2.0 / 3.0])), ["0.3333", "0.6667"]);
        assert_eq!(labels(&of(true, &[0.25, 1.0, 4.0])), ["0.25", "1", "4"]);
        assert!(of(true, &[0.25, 1.0, 4.0]).between_ticks().is_empty());
        let many: Vec<f64> = (1..=20).map(f64::from).collect();
        assert_eq!(labels(&of(false, &many)), ["1", "4", "7", "10", "13", "16", "19"]);
        // Those that stand together have one number.
        assert_eq!(labels(&of(false, &[1.0, 2.0, 4.0, 100.0])), ["1", "100"]);
    }

    /// A run of one step, a slider at rest and numbers that overflowed gave such ends; drawing their
    /// marks panicked.
    #[test]
    fn whatever_its_ends_an_axis_has_marks() {
        const ENDS: [f64; 15] = [
            0.0,
            -0.0,
            1.0,
            1.0 + f64::EPSILON,
            -3.0,
            5e-324,
            1e-320,
            2e-308,
            1e-12,
            1e5,
            1.7e308,
            -1.7e308,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::NAN,
        ];
        for (from, to) in ENDS.into_iter().flat_map(|from| ENDS.map(|to| (from, to))) {
            let scales = [
                Scale::between("x (m)", from, to),
                Scale::between("n", from, to).in_whole_numbers(true),
                Scale::between("x", 0.0, 1.0).reaching(from, to),
                Scale::of("x", true, 0.0, [1.0].into_iter()).reaching(from, to),
                Scale::of("x", true, 0.06, [from, to].into_iter()),
                Scale::free("x").fitted([from, to].into_iter()),
                Scale::free_powers("x").fitted([from, to].into_iter()),
                Scale::powers_between("x (m)", from, to),
            ];
            for scale in &scales {
                let ticks = scale.ticks_at_most(7.0);
                let is_on_it = |at: f64| scale.share(at).is_some();
                assert!(
                    ticks.len() < 20 && ticks.iter().all(|tick| is_on_it(tick.at)),
                    "{scale:?}: {ticks:?}"
                );
                assert!(!ticks.is_empty() || scale.whole, "{from} to {to}: {scale:?}");
                assert!(scale.from < scale.to && scale.label().len() < 40, "{from} to {to}: {scale:?}");
                scale.between_ticks();
            }
        }
        // What is of use stays as it is.
        for of_use in [(0.0, 3.0), (-2.5e-7, 1e-8), (1e4, 1e4 + 1e-6), (0.0, 1e-30)] {
            assert_eq!(ends(false, of_use.0, of_use.1), of_use);
        }
        let of = |from, to| ends(false, from, to);
        assert_eq!((of(0.0, 0.0), of(2.0, 2.0), of(3.0, 1.0)), ((0.0, 1.0), (1.8, 2.2), (1.0, 3.0)));
        assert_eq!((of(f64::NAN, 5.0), of(f64::NAN, f64::INFINITY)), ((4.5, 5.5), (0.0, 1.0)));
    }

    #[test]
    fn numbers_are_short() {
        let all = [0.0, -0.25, 1234.56, 1e-8, -2.5e-7, 1e5, 100.0];
        assert_eq!(all.map(number), ["0", "−0.25", "1235", "10^{−8}", "−2.5·10^{−7}", "10^{5}", "100"]);
    }
}
