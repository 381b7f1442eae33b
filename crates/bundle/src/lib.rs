//! Bundles: an ended experiment as one self-verifying file, with all inputs of its results.
//!
//! A bundle is a ZIP archive and an [RO-Crate]. [`Bundle::read`] reads one without trusting it.
//! [`Verification`] repeats the experiment's evolution and returns a [`Proof`]. To prove the
//! fitness as well, the caller simulates the [batches](Batch) that it hands out.
//! `docs/howto/publish.md` has the format.
//!
//! [RO-Crate]: https://w3id.org/ro/crate/1.3

mod archive;
mod description;
mod directory;
mod files;
mod sample;
mod verification;

use std::fmt;

use evolution::{Digest, Real, Statistics};
use serde::{Deserialize, Serialize};

pub use archive::{LEN_MAX, UNPACKED_LEN_MAX, pack, sha256};
pub use files::champion_json;
pub use sample::Sample;
pub use verification::{Batch, Claim, Flaw, Proof, Verification};

/// An ended experiment, with all inputs of its results.
#[derive(Debug, Clone, PartialEq)]
pub struct Bundle {
    /// The versions and digests of the experiment.
    pub manifest: Manifest,
    /// The experiment file in canonical form, including the seed.
    pub config_json: String,
    /// Every generation, including those that a fork shares with its parent.
    pub history: Vec<GenerationRow>,
    /// The fitness log: for each generation that is not shared with a parent, the bytes of
    /// [`evolution::Told::to_bytes`].
    pub log: Vec<Vec<u8>>,
    /// States of evolution in order. The first one precedes the first entry of the log.
    pub keyframes: Keyframes,
    /// The champion, as [`champion_json`] writes it.
    pub champion_json: String,
}

/// States of evolution, each with the number of generations before it, in order.
pub type Keyframes = Vec<(u64, Vec<u8>)>;

/// The manifest of a bundle: versions, digests, and the end of the experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the format of bundles.
    pub format: u32,
    /// The program that wrote the bundle, with its version.
    pub program: String,
    /// Fingerprint of the simulation that computed fitness.
    pub simulation: String,
    /// Link -1 of the digest chain.
    pub config_digest: Digest,
    /// The last link of the digest chain, which covers everything.
    pub digest: Digest,
    /// How the experiment ended: `completed`, `failed` or `cancelled`.
    pub state: String,
    /// Why the experiment ended, if it did not complete its generations.
    pub reason: String,
    /// Time of submission, milliseconds since 1970 UTC.
    pub submitted_at_ms: u64,
    /// The origin of a fork; `None` for other experiments.
    pub fork: Option<ForkOf>,
}

/// The origin of a fork. A fork is an experiment that continues the state of another experiment,
/// its parent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForkOf {
    /// The last generation, from 0, that fork and parent share.
    pub generation: u64,
    /// The link of the digest chain before the fork's first own generation.
    pub link: Digest,
    /// The changes of the experiment file, one line each.
    pub changes: Vec<String>,
}

/// A row of the history, with the columns of `history.csv`.
///
/// It is not the row of the database, for two reasons: `csv` cannot flatten statistics into
/// columns, and digests are checked here, while in the database one damaged digest must not make a
/// list of experiments unreadable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GenerationRow {
    /// Index of the generation and of the row, from 0.
    pub generation: u64,
    /// Largest of the individuals' mean fitness.
    pub best: Real,
    /// Mean of the individuals' mean fitness.
    pub mean: Real,
    /// Smallest of the individuals' mean fitness.
    pub min: Real,
    /// Population standard deviation of the individuals' mean fitness.
    pub standard_deviation: Real,
    /// Number of simulated episodes.
    pub episodes: u64,
    /// Wall-clock time, ms.
    pub duration_ms: u64,
    /// Time of completion, milliseconds since 1970 UTC.
    pub completed_at_ms: u64,
    /// Number of connected workers at the end of the generation.
    pub workers: u64,
    /// Share of the fleet's time without computation, 0 to 1.
    pub idle_share: f64,
    /// Link of the digest chain.
    pub digest: Digest,
}

impl GenerationRow {
    /// Statistics of the individuals' mean fitness.
    pub fn statistics(&self) -> Statistics {
        let &Self { best, mean, min, standard_deviation, .. } = self;
        Statistics { best, mean, min, standard_deviation }
    }
}

/// Version of the format that this code reads and writes.
pub const FORMAT: u32 = 1;

/// Why a file is not a bundle, or a bundle that this program cannot check.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BundleError {
    /// The file is too large to read.
    #[error("it has {len} bytes, but a bundle has at most {LEN_MAX}")]
    TooLong {
        /// Its length.
        len: u64,
    },
    /// The file is not a ZIP archive, or is damaged.
    #[error("it is not a bundle, or it is cut off or damaged: {0}")]
    Archive(String),
    /// The unpacked files together are too large.
    #[error("unpacked it has more than {UNPACKED_LEN_MAX} bytes, so it is not a bundle")]
    UnpackedTooLong,
    /// One of the unpacked files is too large.
    #[error("its file `{file}` has more than {len_max} bytes, so it is not a bundle")]
    FileTooLong {
        /// The file.
        file: &'static str,
        /// Its largest size, bytes.
        len_max: u64,
    },
    /// An unexpected file.
    #[error("it has the file `{0}`, which is not part of a bundle")]
    ExtraFile(String),
    /// A missing file.
    #[error("it lacks the file `{0}`")]
    MissingFile(&'static str),
    /// A file with invalid content.
    #[error("its file `{file}` cannot be read: {what}")]
    Malformed {
        /// The file.
        file: &'static str,
        /// The mistake in it.
        what: String,
    },
    /// A file whose digest differs from the description.
    #[error("its file `{0}` does not have the SHA-256 that its description states")]
    OtherFile(&'static str),
    /// The bundle has another version of the format.
    #[error("it is a bundle of format {found}, written by {program}; use that version to read it")]
    Format {
        /// The format.
        found: u32,
        /// The program that wrote it.
        program: String,
    },
    /// Another version of the simulation computed the experiment.
    #[error(
        "it was computed by the simulation \"{simulation}\" and written by {program}; use that \
         version to check it, because this one has the simulation \"{}\"",
        sim_core::FINGERPRINT
    )]
    Simulation {
        /// The simulation.
        simulation: String,
        /// The program that wrote it.
        program: String,
    },
}

impl BundleError {
    /// An error about a file with invalid content. `what` may contain text from a stranger.
    fn malformed(file: &'static str, what: &dyn fmt::Display) -> Self {
        Self::Malformed { file, what: archive::printable(&what.to_string()) }
    }
}

impl Bundle {
    /// The first generation that is not shared with a parent.
    pub fn first_own(&self) -> u64 {
        self.manifest.fork.as_ref().map_or(0, |fork| fork.generation + 1)
    }
}

#[cfg(test)]
mod hostile;
#[cfg(test)]
mod tests;
