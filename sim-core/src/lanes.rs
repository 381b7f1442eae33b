//! Matrices whose innermost index is the lane: one lane per simulated robot.
//!
//! All robots of all trials of a genotype share one network, so that a weight is read once and
//! applied to every lane. Rows are padded to whole vectors; no result depends on the values in
//! the padding.

/// Lanes per row are a multiple of this: one 512-bit vector of f32.
const PADDING: usize = 16;

/// A matrix `[row][lane]`.
#[derive(Debug, Clone)]
pub(crate) struct Lanes {
    /// Lanes per row, with padding.
    row_len: usize,
    values: Vec<f32>,
}

impl Lanes {
    /// All zero.
    pub fn new(n_rows: usize, n_lanes: usize) -> Self {
        let row_len = n_lanes.next_multiple_of(PADDING);
        Self { row_len, values: vec![0.0; n_rows * row_len] }
    }

    /// Number of rows; 0 without lanes.
    pub fn n_rows(&self) -> usize {
        self.values.len().checked_div(self.row_len).unwrap_or(0)
    }

    /// One row, with its padding.
    pub fn row(&self, row: usize) -> &[f32] {
        &self.values[row * self.row_len..][..self.row_len]
    }

    /// One row, with its padding.
    pub fn row_mut(&mut self, row: usize) -> &mut [f32] {
        &mut self.values[row * self.row_len..][..self.row_len]
    }

    /// One value.
    pub fn get(&self, row: usize, lane: usize) -> f32 {
        self.values[row * self.row_len + lane]
    }

    /// The values of one lane, row by row.
    pub fn column(&self, lane: usize) -> impl Iterator<Item = f32> {
        // An iterator that knows its length, so that lists grow once.
        self.values.chunks_exact(self.row_len.max(1)).map(move |row| row[lane])
    }

    /// Sets one value.
    pub fn set(&mut self, row: usize, lane: usize, value: f32) {
        self.values[row * self.row_len + lane] = value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stay_where_they_are_set() {
        let mut lanes = Lanes::new(3, 11);
        for row in 0..3 {
            for lane in 0..11 {
                lanes.set(row, lane, (row * 11 + lane) as f32);
            }
        }
        for row in 0..3 {
            for lane in 0..11 {
                assert_eq!(lanes.get(row, lane), (row * 11 + lane) as f32);
            }
            assert_eq!(lanes.row(row)[10], (row * 11 + 10) as f32);
        }
        assert_eq!(lanes.column(9).collect::<Vec<_>>(), [9.0, 20.0, 31.0]);
    }
}
