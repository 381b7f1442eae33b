//! Bundles: an ended experiment as one file, with everything that its results follow from.
//!
//! A bundle is a ZIP archive and an [RO-Crate]. [`Bundle::read`] takes one apart, and trusts
//! nothing of it; [`Verification`] goes through the experiment again and says what was proven;
//! whoever simulates the [batches](Batch) that it hands out proves the fitness, too.
//! `docs/history.md` has the format.
//!
//! [RO-Crate]: https://w3id.org/ro/crate/1.3

mod archive;
mod description;
mod directory;
mod files;
mod sample;
mod verification;

use std::fmt;

use evolution::{Digest, Statistics};
use serde::{Deserialize, Serialize};

pub use archive::{LEN_MAX, UNPACKED_LEN_MAX};
pub use files::champion_json;
pub use sample::Sample;
pub use verification::{Batch, Claim, Flaw, Proof, Verification};

/// An ended experiment, and everything that its results follow from.
#[derive(Debug, Clone, PartialEq)]
pub struct Bundle {
    /// What it is about.
    pub manifest: Manifest,
    /// The experiment file in canonical form, seed included.
    pub config_json: String,
    /// Every generation, with those that a fork shares with its parent.
    pub history: Vec<GenerationRow>,
    /// What evolution was told of each generation of its own, as
    /// [`evolution::Told::to_bytes`] writes it.
    pub log: Vec<Vec<u8>>,
    /// Evolution's state, by the number of generations before it; in order, the first one
    /// before the first generation of its own.
    pub keyframes: Keyframes,
    /// The champion, as [`champion_json`] writes it.
    pub champion_json: String,
}

/// States of evolution, by the number of generations before each; in order.
pub type Keyframes = Vec<(u64, Vec<u8>)>;

/// What a bundle is about.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of the format of bundles.
    pub format: u32,
    /// The program that wrote it, with its version.
    pub program: String,
    /// Fingerprint of the simulation that computed fitness.
    pub simulation: String,
    /// Link -1 of the digest chain.
    pub config_digest: Digest,
    /// The last link of the digest chain, which covers everything.
    pub digest: Digest,
    /// How it ended: `completed`, `failed` or `cancelled`.
    pub state: String,
    /// Why, if not by completing its generations.
    pub reason: String,
    /// Milliseconds since 1970 UTC.
    pub submitted_at_ms: u64,
    /// Where it comes from, if it is a fork.
    pub fork: Option<ForkOf>,
}

/// Where an experiment comes from that goes on from the state of another one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForkOf {
    /// The last generation that both have.
    pub generation: u64,
    /// The link of the digest chain on which its own first generation hangs.
    pub link: Digest,
    /// What is changed, one line each.
    pub changes: Vec<String>,
}

/// A row of the history.
#[derive(Debug, Clone, PartialEq)]
pub struct GenerationRow {
    /// Of the individuals' mean fitness.
    pub statistics: Statistics,
    /// Episodes simulated.
    pub episodes: u64,
    /// Wall-clock time.
    pub duration_ms: u64,
    /// Milliseconds since 1970 UTC.
    pub completed_at_ms: u64,
    /// Workers at its end.
    pub workers: u64,
    /// Share of the fleet's time not spent computing.
    pub idle_share: f64,
    /// Link of the digest chain.
    pub digest: Digest,
}

/// Version of the format that this code reads and writes.
pub const FORMAT: u32 = 1;

/// Why a file is no bundle, or none that this program can check.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BundleError {
    /// Too large to look at.
    #[error("it has {len} bytes, and a bundle at most {LEN_MAX}")]
    TooLong {
        /// Its length.
        len: u64,
    },
    /// No archive, or a damaged one.
    #[error("it is no bundle, or cut off or damaged: {0}")]
    Archive(String),
    /// Unpacked, it would take too much room.
    #[error("unpacked it has more than {UNPACKED_LEN_MAX} bytes, so it is no bundle")]
    UnpackedTooLong,
    /// So would one of its files.
    #[error("its file `{file}` has more than {len_max} bytes, so it is no bundle")]
    FileTooLong {
        /// The file.
        file: &'static str,
        /// Most bytes of it.
        len_max: u64,
    },
    /// A file too many.
    #[error("it has the file `{0}`, which is not part of a bundle")]
    ExtraFile(String),
    /// A file too few.
    #[error("it lacks the file `{0}`")]
    MissingFile(&'static str),
    /// A file that says something else.
    #[error("its file `{file}` cannot be read: {what}")]
    Malformed {
        /// The file.
        file: &'static str,
        /// What is wrong.
        what: String,
    },
    /// A file that is not the one that was described.
    #[error("its file `{0}` is not the one that its description has the SHA-256 of")]
    OtherFile(&'static str),
    /// Written in another version of the format.
    #[error("it has the format {found} of bundles, written by {program}: that version reads it")]
    Format {
        /// The format.
        found: u32,
        /// The program that wrote it.
        program: String,
    },
    /// Computed by another version of the simulation.
    #[error(
        "it was computed by the simulation \"{simulation}\" and written by {program}, which can \
         check it; this version has \"{}\"",
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
    /// A file that says something else. `what`: may have a stranger's words in it.
    fn malformed(file: &'static str, what: &dyn fmt::Display) -> Self {
        Self::Malformed { file, what: archive::printable(&what.to_string()) }
    }
}

impl Bundle {
    /// The first generation of its own.
    pub fn first_own(&self) -> u64 {
        self.manifest.fork.as_ref().map_or(0, |fork| fork.generation + 1)
    }
}

#[cfg(test)]
mod hostile;
#[cfg(test)]
mod tests;
