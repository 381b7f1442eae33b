//! The digest chain: one hash that covers every bit of a run so far.
//!
//! Link -1 is SHA-256 of the UTF-8 text `swarmevo digest 1\n<fingerprint of the
//! simulation>\n<canonical config>`, where the canonical configuration includes the seed, but
//! omits values that cannot change a bit of a generation: the name is empty, `generations` is 0,
//! `target_fitness` and `judgement_trials` are absent. Link g is SHA-256 of link g-1 (32 bytes),
//! g (u64), every gene of every individual, every fitness of every trial of every individual
//! (f64, bit for bit), and every descriptor or aim of every trial of every individual, if the
//! experiment has any; numbers little-endian, individuals in index order.
//!
//! A fork continues the chain of its parent. If the fork changes anything that link -1 covers, an
//! extra link follows the parent's last one: SHA-256 of `swarmevo fork digest 1\n`, the parent's
//! last link, and link -1 of the changed configuration.
//!
//! Re-evaluations of candidates have a chain of their own, which depends on the first chain. This
//! chain starts with 32 zero bytes. After each block of held-out trials, the next link is SHA-256
//! of the previous link, the link of the latest generation, every gene of every candidate that met
//! the block, and the fitness of each of these candidates in every trial. The judgement of the
//! champion adds a link in the same way, and then that of the elites of a repertoire, with the
//! fitness and the descriptors of every trial.

use std::{
    fmt,
    str::FromStr,
    sync::{Arc, OnceLock},
};

use experiment_file::ExperimentConfig;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{Evaluations, Genotype, Population};

/// One link of the chain.
#[derive(Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Digest([u8; 32]);

impl Digest {
    /// Link -1. `simulation`: the fingerprint of the code that computes fitness.
    pub fn of_config(config: &ExperimentConfig, simulation: &str) -> Self {
        let config = Self::covered(config.clone());
        let mut hash = Sha256::new();
        hash.update("swarmevo digest 1\n");
        hash.update(simulation);
        hash.update("\n");
        hash.update(config.to_canonical_json());
        Self(hash.finalize().into())
    }

    /// The configuration without the values that cannot change a bit of a generation.
    pub fn covered(mut config: ExperimentConfig) -> ExperimentConfig {
        config.name.clear();
        config.algorithm.generations = 0;
        config.algorithm.target_fitness = None;
        config.algorithm.judgement_trials = 0;
        config
    }

    /// Link -1 of an evolution without an experiment file, from the text that describes its
    /// setup.
    pub(crate) fn of_text(setup: &str) -> Self {
        let mut hash = Sha256::new();
        hash.update("swarmevo setup digest 1\n");
        hash.update(setup);
        Self(hash.finalize().into())
    }

    /// The first link of a fork that continues after this link with another configuration;
    /// `config`: link -1 of that configuration.
    #[must_use]
    pub fn forked(self, config: Self) -> Self {
        let mut hash = Sha256::new();
        hash.update("swarmevo fork digest 1\n");
        hash.update(self.0);
        hash.update(config.0);
        Self(hash.finalize().into())
    }

    /// The link after this one.
    pub fn next<'a>(
        self,
        generation: u64,
        genotypes: &[Genotype],
        told: impl Into<Evaluations<'a>>,
    ) -> Self {
        OpenLink::new(self, generation, genotypes).close(told.into())
    }

    /// The link after this one in the chain of re-evaluations; `generation`: the link of the
    /// latest generation.
    pub fn next_champion<'a>(
        self,
        generation: Self,
        genotypes: impl Iterator<Item = &'a [f64]>,
        trial_fitness: &'a [Vec<f64>],
    ) -> Self {
        let mut hash = Sha256::new();
        hash.update(self.0);
        hash.update(generation.0);
        for value in genotypes.flatten().chain(trial_fitness.iter().flatten()) {
            hash.update(value.to_bits().to_le_bytes());
        }
        Self(hash.finalize().into())
    }
}

/// A link that lacks the evaluations, which come after the genes.
#[derive(Debug, Clone)]
struct OpenLink(Sha256);

impl OpenLink {
    fn new(previous: Digest, generation: u64, genotypes: &[Genotype]) -> Self {
        let mut hash = Sha256::new();
        hash.update(previous.0);
        hash.update(generation.to_le_bytes());
        let mut link = Self(hash);
        link.extend(genotypes);
        link
    }

    fn close(mut self, Evaluations { fitness, descriptors }: Evaluations<'_>) -> Digest {
        self.extend(fitness);
        self.extend(descriptors);
        Digest(self.0.finalize().into())
    }

    fn extend(&mut self, rows: &[Vec<f64>]) {
        let mut bytes = Vec::new();
        for values in rows {
            bytes.resize(size_of_val(&values[..]), 0);
            for (bytes, value) in bytes.chunks_exact_mut(size_of::<f64>()).zip(values) {
                bytes.copy_from_slice(&value.to_bits().to_le_bytes());
            }
            self.0.update(&bytes);
        }
    }
}

/// The link of a generation whose evaluations are not known yet. Hashing the genes takes a third of
/// the time of [`Evolution::tell`](super::Evolution::tell), which finds this done if somebody has
/// called [`hash_genes`](Self::hash_genes) while the generation was evaluated.
#[derive(Debug)]
pub struct NextLink {
    previous: Digest,
    generation: u64,
    genotypes: Population,
    open: OnceLock<OpenLink>,
}

/// Equal if the links will be equal for equal evaluations.
impl PartialEq for NextLink {
    fn eq(&self, other: &Self) -> bool {
        (self.previous, self.generation, &self.genotypes)
            == (other.previous, other.generation, &other.genotypes)
    }
}

impl NextLink {
    pub(crate) fn new(previous: Digest, generation: u64, genotypes: &Population) -> Self {
        let genotypes = Arc::clone(genotypes);
        Self { previous, generation, genotypes, open: OnceLock::new() }
    }

    /// Hashes the genes, unless that is done.
    pub fn hash_genes(&self) {
        self.open();
    }

    /// The link after `previous`, with the evaluations. A generation may also be told to an
    /// evolution that has not drawn it, whose chain is another one.
    pub(crate) fn close(&self, previous: Digest, evaluations: Evaluations<'_>) -> Digest {
        if previous == self.previous {
            return self.open().clone().close(evaluations);
        }
        previous.next(self.generation, &self.genotypes, evaluations)
    }

    fn open(&self) -> &OpenLink {
        let Self { previous, generation, genotypes, open } = self;
        open.get_or_init(|| OpenLink::new(*previous, *generation, genotypes))
    }
}

impl fmt::Display for Digest {
    /// Writes 64 hexadecimal digits.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The text is not 64 hexadecimal digits.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("a digest is 64 hexadecimal digits")]
pub struct ParseDigestError;

impl FromStr for Digest {
    type Err = ParseDigestError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut bytes = [0; 32];
        if text.len() != 64 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(ParseDigestError);
        }
        for (i, byte) in bytes.iter_mut().enumerate() {
            *byte =
                u8::from_str_radix(&text[2 * i..2 * i + 2], 16).map_err(|_| ParseDigestError)?;
        }
        Ok(Self(bytes))
    }
}

impl From<Digest> for String {
    fn from(digest: Digest) -> Self {
        digest.to_string()
    }
}

impl TryFrom<String> for Digest {
    type Error = ParseDigestError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        text.parse()
    }
}
