//! Memory for vectors.

/// Vectors are aligned to this many bytes: a cache line.
const ALIGNMENT: usize = 64;

/// Values in whole cache lines, so that no vector crosses two of them.
#[derive(Debug)]
pub(super) struct Aligned {
    /// Where the values start in `memory`.
    start: usize,
    len: usize,
    memory: Vec<f32>,
}

impl Aligned {
    /// All zero.
    pub fn new(len: usize) -> Self {
        let memory = vec![0.0; len + ALIGNMENT / size_of::<f32>()];
        let start = memory.as_ptr().align_offset(ALIGNMENT).min(memory.len() - len);
        Self { start, len, memory }
    }

    #[inline(always)]
    pub fn values(&self) -> &[f32] {
        &self.memory[self.start..][..self.len]
    }

    #[inline(always)]
    pub fn values_mut(&mut self) -> &mut [f32] {
        &mut self.memory[self.start..][..self.len]
    }
}
