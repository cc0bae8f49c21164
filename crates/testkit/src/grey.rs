//! Pictures compared pixel by pixel: here, because tests that call the command are compiled without
//! optimisation.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// Largest difference of a value towards dark: the remainder of an edge that covers a quarter of a pixel,
/// and more if surfaces share that edge.
const SMOOTHED: u8 = 80;

/// A picture in grey.
#[derive(Debug, Clone, PartialEq)]
pub struct Grey {
    /// Width and height.
    pub size: (u32, u32),
    /// Row by row from the top, 0 for black.
    pub values: Vec<u8>,
}

impl Grey {
    /// Reads a PNG; colours become grey by their mean.
    ///
    /// # Panics
    /// If it is no PNG.
    #[must_use]
    pub fn read(path: &Path) -> Grey {
        let file = BufReader::new(File::open(path).expect("the picture is there"));
        let mut reader = png::Decoder::new(file).read_info().expect("it is a PNG");
        let mut bytes = vec![0; reader.output_buffer_size().expect("it fits into memory")];
        let frame = reader.next_frame(&mut bytes).expect("it is whole");
        let channels = frame.color_type.samples();
        let grey = |pixel: &[u8]| match *pixel {
            [grey] => grey,
            [r, g, b, ..] => ((u16::from(r) + u16::from(g) + u16::from(b)) / 3) as u8,
            _ => panic!("{channels} channels"),
        };
        Grey {
            size: (frame.width, frame.height),
            values: bytes[..frame.buffer_size()].chunks_exact(channels).map(grey).collect(),
        }
    }

    /// The share of the ink of both for which there is none so dark in the other within two pixels:
    /// edges of lines are smoothed in other ways, and lines along the axes may be moved to whole pixels.
    #[must_use]
    pub fn difference(&self, other: &Grey) -> f64 {
        self.share_beyond(other).max(other.share_beyond(self))
    }

    /// The share of its own ink for which there is none.
    fn share_beyond(&self, other: &Grey) -> f64 {
        let all: f64 = self.values.iter().map(|value| f64::from(255 - value)).sum();
        let darkest = other.darkest_around();
        let by_more = |(own, other): (&u8, u8)| other.saturating_sub(*own) > SMOOTHED;
        let ink = self.values.iter().zip(darkest).filter(|&pair| by_more(pair));
        ink.map(|(own, _)| f64::from(255 - own)).sum::<f64>() / all.max(1.0)
    }

    /// The darkest of each pixel and those up to two to each side, above and below.
    fn darkest_around(&self) -> Vec<u8> {
        let width = self.size.0 as usize;
        let along = |values: &[u8], step: usize| -> Vec<u8> {
            let mut darkest = values.to_vec();
            for by in [step, 2 * step] {
                darkest.iter_mut().zip(&values[by..]).for_each(|(one, &after)| *one = after.min(*one));
                darkest[by..].iter_mut().zip(values).for_each(|(one, &before)| *one = before.min(*one));
            }
            darkest
        };
        along(&along(&self.values, 1), width)
    }
}
