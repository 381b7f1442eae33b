//! Seals: keyed digests of the data on which runs depend. They reveal rows that were changed by
//! accident or by hand, or moved to another place.
//!
//! A seal is a keyed BLAKE3 hash of a row's content and its place. The random key is in the
//! database itself, so that a copy can be checked alone. Programs that can read the key can make
//! seals, so seals do not protect against an attacker who can write to the database.

use blake3::Hasher;
use rusqlite::Connection;

use super::GenerationRecord;
use crate::ids::ExperimentId;

/// A keyed digest.
pub type Seal = [u8; 32];

/// Makes the seals of a database.
#[derive(Debug, Clone)]
pub struct Sealer(Hasher);

impl Sealer {
    /// The sealer of a database.
    pub fn from_database(connection: &Connection) -> rusqlite::Result<Self> {
        connection.query_row("SELECT seal_key FROM identity", [], |row| {
            Ok(Self(Hasher::new_keyed(&row.get(0)?)))
        })
    }

    /// The seal of an experiment's configuration and of the values that identify its bits.
    pub fn experiment(
        &self,
        id: ExperimentId,
        config: &[u8],
        config_digest: &str,
        fingerprint: &str,
        genotype_len: u64,
    ) -> Seal {
        self.begin("experiment", id)
            .text(config)
            .text(config_digest.as_bytes())
            .text(fingerprint.as_bytes())
            .number(genotype_len)
            .finish()
    }

    /// The seal of a keyframe, which follows the `latest` generation.
    pub fn keyframe(
        &self,
        id: ExperimentId,
        latest: Option<&GenerationRecord>,
        state: &[u8],
    ) -> Seal {
        // Older versions used these names for the rows.
        self.begin("checkpoint", id)
            .number(latest.map_or(0, |latest| latest.generation + 1))
            .text(latest.map_or("", |latest| latest.digest.as_str()).as_bytes())
            .text(state)
            .finish()
    }

    /// The seal of a generation's fitness.
    pub fn told(&self, id: ExperimentId, of: &GenerationRecord, told: &[u8]) -> Seal {
        self.begin("step", id).number(of.generation).text(of.digest.as_bytes()).text(told).finish()
    }

    /// The seal of a row of the history.
    pub fn generation(&self, id: ExperimentId, generation: &GenerationRecord) -> Seal {
        let statistics = &generation.statistics;
        self.begin("generation", id)
            .number(generation.generation)
            .real(statistics.best.get())
            .real(statistics.mean.get())
            .real(statistics.min.get())
            .real(statistics.standard_deviation.get())
            .text(generation.digest.as_bytes())
            .number(generation.duration_ms)
            .number(generation.episodes)
            .number(generation.workers)
            .real(generation.idle_share)
            .finish()
    }

    /// The beginning of the seal of a row of an experiment.
    pub fn begin(&self, kind: &str, id: ExperimentId) -> Unfinished {
        Unfinished(self.0.clone()).text(kind.as_bytes()).number(id.0)
    }
}

/// An incomplete seal of a row.
pub struct Unfinished(Hasher);

impl Unfinished {
    /// Adds text, or bytes, with their length.
    pub fn text(self, bytes: &[u8]) -> Self {
        let mut with = self.number(bytes.len() as u64);
        with.0.update(bytes);
        with
    }

    /// Adds a whole number.
    pub fn number(mut self, number: u64) -> Self {
        self.0.update(&number.to_le_bytes());
        self
    }

    /// Adds a number, without the sign of zero, which SQLite does not keep.
    pub fn real(self, number: f64) -> Self {
        self.number((number + 0.0).to_bits())
    }

    /// The seal.
    pub fn finish(self) -> Seal {
        self.0.finalize().into()
    }
}
