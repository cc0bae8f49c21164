//! Colours that stay apart for colour-blind eyes, and in grey but for those of numbers of both signs.

use plotters::prelude::RGBColor;

use crate::draw::scale::Scale;

/// The scale viridis of matplotlib, which rises evenly in lightness, at equal distances.
const VIRIDIS: [RGBColor; 10] = of_digits([
    0x440154, 0x482878, 0x3e4989, 0x31688e, 0x26828e, 0x1f9e89, 0x35b779, 0x6ece58, 0xb5de2b, 0xfde725,
]);

/// Colours for words, by Okabe and Ito, without their yellow, which is lost on white.
pub(crate) const WORDS: [RGBColor; 8] =
    of_digits([0x000000, 0x0072b2, 0xd55e00, 0x009e73, 0xcc79a7, 0x56b4e9, 0xe69f00, 0x828282]);

/// The scale coolwarm of Moreland (Proc. ISVC 2009), at equal distances: blue below the middle, red above
/// it, and between them a grey that is not the white of the page.
const COOLWARM: [RGBColor; 9] =
    of_digits([0x3b4cc0, 0x6282ea, 0x8db0fe, 0xb8d0f9, 0xdddddd, 0xf5c4ad, 0xf49a7b, 0xde604d, 0xb40426]);

/// Its ends with a darker middle, on which lines and marks are seen as well.
const COOLWARM_LINES: [RGBColor; 3] = of_digits([0x3b4cc0, 0x464646, 0xb40426]);

/// Colours as six hexadecimal digits say them.
const fn of_digits<const N: usize>(digits: [u32; N]) -> [RGBColor; N] {
    let (mut colours, mut n) = ([RGBColor(0, 0, 0); N], 0);
    while n < N {
        let [_, r, g, b] = digits[n].to_be_bytes();
        colours[n] = RGBColor(r, g, b);
        n += 1;
    }
    colours
}

/// How much of viridis lines and marks use: its light end is lost on white.
const LINES: f64 = 0.88;

/// What is coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum On {
    /// Cells and discs.
    Surfaces,
    /// Lines and hollow marks.
    Lines,
}

/// The colours of numbers on a scale.
#[derive(Debug, Clone)]
pub(crate) struct Colours {
    pub(crate) scale: Scale,
    on: On,
    /// Whether its numbers have both signs, and the middle is zero.
    diverges: bool,
}

impl Colours {
    /// For numbers on this scale: from dark to light, or, where they have both signs, from one hue to
    /// another with zero between, as far to either side.
    pub(crate) fn of(scale: Scale, on: On) -> Colours {
        let centred = scale.about_zero();
        Colours { on, diverges: centred.is_some(), scale: centred.unwrap_or(scale) }
    }

    /// The same on surfaces, for numbers between the ends of these.
    pub(crate) fn between(label: &str, values: &[f64]) -> Colours {
        Colours::of(Scale::of(label, false, 0.0, values.iter().copied()), On::Surfaces)
    }

    /// That of a number, or of the end of the scale that is next to it.
    pub(crate) fn nearest(&self, value: f64) -> RGBColor {
        self.at(self.scale.way(value))
    }

    /// That at a share of the scale, or at the end that is next to it.
    pub(crate) fn at(&self, share: f64) -> RGBColor {
        let share = share.clamp(0.0, 1.0);
        match (self.diverges, self.on) {
            (false, On::Surfaces) => mixed(&VIRIDIS, share),
            (false, On::Lines) => mixed(&VIRIDIS, LINES * share),
            (true, On::Surfaces) => mixed(&COOLWARM, share),
            (true, On::Lines) => mixed(&COOLWARM_LINES, share),
        }
    }
}

/// The colour at a share of a scale of colours at equal distances.
pub(crate) fn mixed(colours: &[RGBColor], share: f64) -> RGBColor {
    let at = share.clamp(0.0, 1.0) * (colours.len() - 1) as f64;
    let low = (at.floor() as usize).min(colours.len() - 2);
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * (at - low as f64)).round() as u8;
    let (a, b) = (colours[low], colours[low + 1]);
    RGBColor(mix(a.0, b.0), mix(a.1, b.1), mix(a.2, b.2))
}

#[cfg(test)]
mod tests {
    use plotters::prelude::RGBColor;

    use super::{Colours, On};
    use crate::draw::scale::Scale;

    #[test]
    fn numbers_of_both_signs_have_zero_in_the_middle() {
        let of = |log, values: &[f64], on| Colours::of(Scale::of("x", log, 0.0, values.iter().copied()), on);
        let signed = of(false, &[-1.0, 4.0], On::Surfaces);
        let end = |colours: &Colours, value: f64| colours.nearest(value);
        assert_eq!(end(&signed, 0.0), RGBColor(221, 221, 221));
        assert_eq!((end(&signed, -4.0), end(&signed, 4.0)), (RGBColor(59, 76, 192), RGBColor(180, 4, 38)));
        // On the white page lines are seen all along the scale.
        let lines = of(false, &[-1.0, 4.0], On::Lines);
        let grey = |RGBColor(r, g, b)| (f64::from(r) + f64::from(g) + f64::from(b)) / 3.0;
        assert!((0..=100).all(|n| grey(lines.at(f64::from(n) / 100.0)) < 160.0));
        // Of one sign, or but for rounding, they go from dark to light over their own range.
        for (log, values) in [
            (false, [1.0, 4.0]),
            (false, [-4.0, -1.0]),
            (false, [0.0, 4.0]),
            (true, [0.1, 4.0]),
            (false, [-1e-12, 4.0]),
        ] {
            let plain = of(log, &values, On::Surfaces);
            assert_eq!(end(&plain, values[0]), RGBColor(0x44, 0x01, 0x54), "{values:?}");
            assert_eq!(end(&plain, values[1]), RGBColor(0xfd, 0xe7, 0x25), "{values:?}");
        }
    }
}
