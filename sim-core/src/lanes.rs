//! Matrices whose innermost index is the lane: one lane per simulated robot.
//!
//! All robots of all trials of a genotype share one network, so that a weight is
//! read once and applied to every lane. Lanes are padded to whole blocks; the
//! padding holds values like any other, and nobody reads them.

/// Lanes per block: one 512-bit register of f64.
pub(crate) const BLOCK: usize = 8;

/// A block of neighbouring lanes.
pub(crate) type Block = [f64; BLOCK];

/// A matrix `[row][lane]`.
#[derive(Debug, Clone)]
pub(crate) struct Lanes {
    /// Blocks per row.
    n_blocks: usize,
    blocks: Vec<Block>,
}

impl Lanes {
    /// All zero.
    pub fn new(n_rows: usize, n_lanes: usize) -> Self {
        let n_blocks = n_lanes.div_ceil(BLOCK);
        Self { n_blocks, blocks: vec![[0.0; BLOCK]; n_rows * n_blocks] }
    }

    /// One row, as blocks.
    pub fn row(&self, row: usize) -> &[Block] {
        &self.blocks[row * self.n_blocks..][..self.n_blocks]
    }

    /// One row, as blocks.
    pub fn row_mut(&mut self, row: usize) -> &mut [Block] {
        &mut self.blocks[row * self.n_blocks..][..self.n_blocks]
    }

    /// One value.
    pub fn get(&self, row: usize, lane: usize) -> f64 {
        self.blocks[row * self.n_blocks + lane / BLOCK][lane % BLOCK]
    }

    /// Sets one value.
    pub fn set(&mut self, row: usize, lane: usize, value: f64) {
        self.blocks[row * self.n_blocks + lane / BLOCK][lane % BLOCK] = value;
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
                lanes.set(row, lane, (row * 11 + lane) as f64);
            }
        }
        for row in 0..3 {
            for lane in 0..11 {
                assert_eq!(lanes.get(row, lane), (row * 11 + lane) as f64);
            }
            assert_eq!(lanes.row(row)[1][2], (row * 11 + 10) as f64);
        }
    }
}
