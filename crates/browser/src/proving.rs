//! The proof of a bundle, step by step.

use std::collections::VecDeque;

use bundle::{Batch, Bundle, Sample, Verification, sha256};

/// A bundle whose claims are being proven.
pub struct Proving {
    /// Name and digest of the file.
    file: String,
    sha256: String,
    bundle: &'static Bundle,
    verification: Verification<'static>,
    /// Batches of the repeated generation that are not simulated yet.
    batches: VecDeque<Batch>,
}

impl Proving {
    /// Reads a bundle, and checks everything before the first generation.
    pub fn begin(file: String, bytes: &[u8], sample: Sample) -> Result<Self, String> {
        let bundle = Bundle::read(bytes).map_err(|error| error.to_string())?;
        // A module proves one bundle, and ends with the page's thread.
        let bundle: &'static Bundle = Box::leak(Box::new(bundle));
        let verification = Verification::begin(bundle, sample).map_err(|flaw| flaw.to_string())?;
        let sha256 = sha256(bytes);
        Ok(Self { file, sha256, bundle, verification, batches: VecDeque::new() })
    }

    /// The experiment file.
    pub fn config_json(&self) -> &'static str {
        &self.bundle.config_json
    }

    /// The number of repeated generations, and the number of generations to repeat.
    pub fn progress(&self) -> (u64, u64) {
        self.verification.progress()
    }

    /// The next batch to simulate. Repeats generations until there is one, or at most `n_max` of
    /// them.
    pub fn next(&mut self, n_max: u32) -> Result<Option<&Batch>, String> {
        for _ in 0..n_max {
            if !self.batches.is_empty() {
                break;
            }
            match self.verification.advance().map_err(|flaw| flaw.to_string())? {
                Some(batches) => self.batches.extend(batches),
                None => break,
            }
        }
        Ok(self.batches.front())
    }

    /// Whether nothing is left to repeat or to simulate.
    pub fn is_over(&self) -> bool {
        let (n_done, n_all) = self.progress();
        n_done == n_all && self.batches.is_empty()
    }

    /// Compares the first batch with the simulated numbers of all its genotypes, in order.
    pub fn compare(&mut self, values: &[f64]) -> Result<(), String> {
        let batch = self.batches.pop_front().ok_or("there is nothing to compare")?;
        let per_genotype = batch.values.first().map_or(1, |values| values.len().max(1));
        let simulated: Vec<Vec<f64>> = values.chunks(per_genotype).map(<[f64]>::to_vec).collect();
        batch.compare(&simulated).map_err(|flaw| flaw.to_string())
    }

    /// The proof for people.
    pub fn finish(self) -> Result<String, String> {
        if !self.is_over() {
            return Err("the proof is not complete".to_owned());
        }
        Ok(self.verification.finish().to_text(&self.file, &self.sha256))
    }
}
