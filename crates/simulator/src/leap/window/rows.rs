//! Arrays of one number per block for many states, aligned for vector loads.

/// Rows of one number per block, each aligned for vector loads.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    values: Vec<f64>,
    pub(super) pitch: usize,
    from: usize,
}

impl Rows {
    const ALIGNED_BYTES: usize = 64;

    pub(super) fn new(blocks: usize, rows: usize) -> Rows {
        let aligned = Rows::ALIGNED_BYTES / size_of::<f64>();
        let pitch = blocks.next_multiple_of(aligned);
        let values = vec![0.0; pitch * rows + aligned];
        let from = values.as_ptr().align_offset(Rows::ALIGNED_BYTES).min(aligned);
        Rows { values, pitch, from }
    }

    /// All rows from the first on.
    pub(super) fn all(&self) -> &[f64] {
        &self.values[self.from..]
    }

    pub(super) fn all_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.from..]
    }

    pub(super) fn row(&self, row: usize) -> &[f64] {
        &self.values[self.from + row * self.pitch..][..self.pitch]
    }

    pub(super) fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.values[self.from + row * self.pitch..][..self.pitch]
    }

    /// The first two rows.
    pub(super) fn both(&self, blocks: usize) -> (&[f64], &[f64]) {
        (&self.row(0)[..blocks], &self.row(1)[..blocks])
    }

    pub(super) fn both_mut(&mut self, blocks: usize) -> (&mut [f64], &mut [f64]) {
        let (first, second) = self.values[self.from..].split_at_mut(self.pitch);
        (&mut first[..blocks], &mut second[..blocks])
    }

    /// The second row, and one number on either side of it.
    pub(super) fn with_image(&mut self, blocks: usize) -> &mut [f64] {
        let at = self.from + self.pitch - 1;
        &mut self.values[at..at + blocks + 2]
    }
}
