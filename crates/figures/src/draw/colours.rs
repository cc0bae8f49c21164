//! Colours that stay apart for colour-blind eyes, and in grey but for those of numbers of both signs.

use plotters::prelude::RGBColor;

use crate::draw::print::raster::Rgb;
use crate::draw::scale::Scale;

/// The scale viridis of matplotlib, which rises evenly in lightness, at equal distances.
const VIRIDIS: [Rgb; 10] = [
    (0x44, 0x01, 0x54),
    (0x48, 0x28, 0x78),
    (0x3e, 0x49, 0x89),
    (0x31, 0x68, 0x8e),
    (0x26, 0x82, 0x8e),
    (0x1f, 0x9e, 0x89),
    (0x35, 0xb7, 0x79),
    (0x6e, 0xce, 0x58),
    (0xb5, 0xde, 0x2b),
    (0xfd, 0xe7, 0x25),
];

/// Colours for words, by Okabe and Ito, without their yellow, which is lost on white.
pub(crate) const WORDS: [RGBColor; 8] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(130, 130, 130),
];

/// The scale coolwarm of Moreland (Proc. ISVC 2009), at equal distances: blue below the middle, red above
/// it, and between them a grey that is not the white of the page.
const COOLWARM: [Rgb; 9] = [
    (59, 76, 192),
    (98, 130, 234),
    (141, 176, 254),
    (184, 208, 249),
    (221, 221, 221),
    (245, 196, 173),
    (244, 154, 123),
    (222, 96, 77),
    (180, 4, 38),
];

/// Its ends with a darker middle, on which lines and marks are seen as well.
const COOLWARM_LINES: [Rgb; 3] = [COOLWARM[0], (70, 70, 70), COOLWARM[8]];

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
        match scale.about_zero() {
            Some(scale) => Colours { scale, on, diverges: true },
            None => Colours { scale, on, diverges: false },
        }
    }

    /// That of a number; none if it is not on the scale.
    pub(crate) fn of_number(&self, value: f64) -> Option<RGBColor> {
        self.scale.share(value).map(|share| self.at(share))
    }

    /// That at a share of the scale.
    pub(crate) fn at(&self, share: f64) -> RGBColor {
        match (self.diverges, self.on) {
            (false, On::Surfaces) => mixed(&VIRIDIS, share),
            (false, On::Lines) => mixed(&VIRIDIS, LINES * share),
            (true, On::Surfaces) => mixed(&COOLWARM, share),
            (true, On::Lines) => mixed(&COOLWARM_LINES, share),
        }
    }
}

/// The colour at a share of a scale.
fn mixed(colours: &[Rgb], share: f64) -> RGBColor {
    let at = share.clamp(0.0, 1.0) * (colours.len() - 1) as f64;
    let low = (at.floor() as usize).min(colours.len() - 2);
    let between = at - low as f64;
    let (a, b) = (colours[low], colours[low + 1]);
    let mix = |a: u8, b: u8| (f64::from(a) + (f64::from(b) - f64::from(a)) * between).round() as u8;
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
        let end = |colours: &Colours, value: f64| colours.of_number(value).unwrap();
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
