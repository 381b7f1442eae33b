//! Descriptions of evolutionary algorithms, for experiment files.
//!
//! An algorithm states its name, its parameters with their domains and defaults, and its limits
//! once, as an [`AlgorithmDescription`], next to its code in the crate `evolution`. The reader, the
//! JSON Schema, the checks, `docs/keys.md` and the table in `docs/algorithms.md` follow from the
//! list of descriptions, which is an argument of
//! [`ExperimentConfig::from_json`](crate::ExperimentConfig::from_json). So this crate knows no
//! algorithm, and programs that only simulate need none.

mod schema;

use crate::Parameter;

pub(crate) use schema::describe_algorithms;

/// The description of an algorithm: its keys in experiment files, its limits, and its costs.
#[derive(Debug, Clone, Copy)]
pub struct AlgorithmDescription {
    /// Its name in the file, such as `"SNES"`.
    pub name: &'static str,
    /// Its name in words, as in "Separable natural evolution strategy".
    pub title: &'static str,
    /// The state that it adapts from generation to generation, for people.
    pub learns: &'static str,
    /// Number of values that it keeps between generations, as a formula in the genes d and the
    /// individuals P.
    pub state: &'static str,
    /// The largest part of that state, for estimates of memory.
    pub keeps: Keeps,
    /// Fewest individuals per generation, at least 1.
    pub individuals_min: u32,
    /// The way in which it learns from the individuals of a generation.
    pub learns_from: LearnsFrom,
    /// Most genes of all populations together; `None` if the algorithm has no such limit.
    pub genes_max: Option<u64>,
    /// In the order of the canonical form.
    pub parameters: &'static [Parameter],
}

/// The largest part of an algorithm's state between generations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Keeps {
    /// A few vectors of genes.
    Vectors,
    /// A matrix with a row and a column per gene.
    Matrix,
    /// A population.
    Population,
    /// Elites of a repertoire or of a front, up to [`limits::ELITES`](crate::limits::ELITES).
    Repertoire,
}

/// How an algorithm makes use of the individuals of a generation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LearnsFrom {
    /// It learns from their ranks.
    Ranks,
    /// It learns from their ranks, and draws individuals in pairs, on both sides of the mean.
    Pairs,
    /// It learns from fitness and [descriptors](crate::DescriptorConfig).
    Descriptors,
    /// It learns from fitness and [aims](crate::AimConfig).
    Aims,
}

/// Number of individuals below which an algorithm learns next to nothing.
const FEW_INDIVIDUALS: u32 = 4;

impl AlgorithmDescription {
    /// The description of this name, if there is one.
    pub fn find<'a>(descriptions: &'a [Self], name: &str) -> Option<&'a Self> {
        descriptions.iter().find(|description| description.name == name)
    }

    /// A warning about an allowed but unfavourable size of the population, if there is one.
    pub fn advice(&self, population_size: u32) -> Option<String> {
        let name = self.name;
        match population_size {
            0 => None,
            1 => Some(format!(
                "with a single individual, {name} never learns, because it compares \
                 individuals; take {FEW_INDIVIDUALS} individuals or more"
            )),
            size if size < FEW_INDIVIDUALS => Some(format!(
                "{size} individuals teach {name} next to nothing; take {FEW_INDIVIDUALS} or more"
            )),
            size if self.learns_from == LearnsFrom::Pairs && size % 2 == 1 => Some(format!(
                "{name} draws individuals in pairs; the last one of {size} is the mean itself, \
                 which teaches nothing; take {} or {}",
                size - 1,
                size + 1
            )),
            _ => None,
        }
    }

    /// Whether the algorithm has a parameter of this key.
    pub fn has(&self, key: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter.key == key)
    }
}
