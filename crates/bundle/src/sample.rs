//! Chooses the generations to simulate again. The run's digest determines them, so nobody can
//! choose favourable ones.

use std::collections::BTreeSet;

use evolution::Digest;
use sha2::{Digest as _, Sha256};

/// The generations to simulate again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sample {
    /// All.
    All,
    /// This many generations, drawn by the last link of the digest chain.
    Drawn(u64),
}

impl Sample {
    /// The sampled generations within `first..end`. `digest`: the last link.
    ///
    /// Draw k is the first 8 bytes, little-endian, of the SHA-256 of `swarmevo verify 1\n<link,
    /// hexadecimal>\n<k>`, modulo the number of generations; repeated draws are skipped.
    pub fn generations(self, digest: Digest, first: u64, end: u64) -> BTreeSet<u64> {
        let n_generations = end.saturating_sub(first);
        let n_wanted = match self {
            Self::All => n_generations,
            Self::Drawn(n_wanted) => n_wanted.min(n_generations),
        };
        if n_wanted == n_generations {
            return (first..end).collect();
        }
        let mut drawn = BTreeSet::new();
        for k in 0u64.. {
            if drawn.len() as u64 == n_wanted {
                break;
            }
            let hash = Sha256::digest(format!("swarmevo verify 1\n{digest}\n{k}"));
            let (number, _) = hash.split_first_chunk().expect("32 bytes");
            drawn.insert(first + u64::from_le_bytes(*number) % n_generations);
        }
        drawn
    }
}
