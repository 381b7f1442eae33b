//! The fitness log: the input of evolution, generation by generation.
//!
//! [`ask`](super::Evolution::ask) and [`tell`](super::Evolution::tell) are pure functions, so the
//! log and one state of evolution determine every later state, and every genotype:
//! [`repeat`](super::Evolution::repeat) repeats them.
//!
//! An entry begins with a byte for the version of its format; the rest is in the format of
//! postcard, as in checkpoints. Entries with descriptors have a version of their own.

use serde::{Deserialize, Serialize};

use super::{
    CheckpointError,
    wire::{decode, encode},
};

/// Version of the format of entries with descriptors.
const DESCRIBED: u8 = 3;

/// Version of the format without descriptors.
const VERSION: u8 = 2;

/// The previous version, which lacks the end of a run.
const WITHOUT_END: u8 = 1;

/// An entry of the fitness log: the input of evolution for one generation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Fitness of every individual in every trial; shape `[individual][trial]`.
    pub trial_fitness: Vec<Vec<f64>>,
    /// The descriptors of every individual, for each trial all of them; empty if the experiment has
    /// neither descriptors nor aims. The values of aims are descriptors, too.
    pub descriptors: Vec<Vec<f64>>,
    /// Fitness in the re-evaluation after the generation; shape `[block][candidate][trial]`. Empty
    /// without a re-evaluation, or if the re-evaluation is in [`end`](Self::end).
    pub blocks: Vec<Vec<Vec<f64>>>,
    /// The evaluations at the end of the run.
    pub end: End,
}

/// The evaluations at the end of a run. If the run is continued, they have no effect.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// The blocks of an extra re-evaluation, as in [`Told::blocks`].
    pub blocks: Vec<Vec<Vec<f64>>>,
    /// The champion's fitness in every trial of its judgement; empty without a judgement.
    pub judgement: Vec<f64>,
    /// The judgement of every elite of a repertoire or of a front: for each trial its fitness and
    /// then its descriptors.
    pub elites: Vec<Vec<f64>>,
}

/// The fitness of a generation, and its descriptors, if the experiment has any.
#[derive(Debug, Clone, Copy)]
pub struct Evaluations<'a> {
    /// As [`Told::trial_fitness`].
    pub fitness: &'a [Vec<f64>],
    /// As [`Told::descriptors`].
    pub descriptors: &'a [Vec<f64>],
}

impl<'a> From<&'a Vec<Vec<f64>>> for Evaluations<'a> {
    fn from(fitness: &'a Vec<Vec<f64>>) -> Self {
        Self { fitness, descriptors: &[] }
    }
}

impl<'a, const N: usize> From<&'a [Vec<f64>; N]> for Evaluations<'a> {
    fn from(fitness: &'a [Vec<f64>; N]) -> Self {
        Self { fitness, descriptors: &[] }
    }
}

impl<'a> From<&'a Told> for Evaluations<'a> {
    fn from(told: &'a Told) -> Self {
        Self { fitness: &told.trial_fitness, descriptors: &told.descriptors }
    }
}

impl Told {
    /// An entry of a generation without a re-evaluation.
    pub fn from_fitness(trial_fitness: Vec<Vec<f64>>) -> Self {
        Self { trial_fitness, ..Self::default() }
    }

    /// An entry of a generation without a re-evaluation. `values`: for each trial of an individual
    /// its fitness and then its descriptors.
    pub fn from_values(values: &[Vec<f64>], n_descriptors: usize) -> Self {
        if n_descriptors == 0 {
            return Self::from_fitness(values.to_vec());
        }
        let n = 1 + n_descriptors;
        let fitness = |row: &Vec<f64>| row.chunks_exact(n).map(|trial| trial[0]).collect();
        let descriptors =
            |row: &Vec<f64>| row.chunks_exact(n).flat_map(|trial| trial[1..].to_vec()).collect();
        Self {
            trial_fitness: values.iter().map(fitness).collect(),
            descriptors: values.iter().map(descriptors).collect(),
            ..Self::default()
        }
    }

    /// For each trial of an individual its fitness and then its descriptors.
    pub fn values(&self) -> Vec<Vec<f64>> {
        let row = |(fitness, descriptors): (&Vec<f64>, &Vec<f64>)| {
            let n = descriptors.len() / fitness.len().max(1);
            let trial =
                |(t, fitness): (usize, &f64)| [&[*fitness], &descriptors[t * n..][..n]].concat();
            fitness.iter().enumerate().flat_map(trial).collect()
        };
        match self.descriptors.is_empty() {
            true => self.trial_fitness.clone(),
            false => self.trial_fitness.iter().zip(&self.descriptors).map(row).collect(),
        }
    }

    /// Whether there are as many individuals and descriptors as expected.
    pub(crate) fn has_shape(&self, n_individuals: usize, n_descriptors: usize) -> bool {
        let fits = |(fitness, descriptors): (&Vec<f64>, &Vec<f64>)| {
            descriptors.len() == n_descriptors * fitness.len()
        };
        let n_described = if n_descriptors == 0 { 0 } else { n_individuals };
        self.trial_fitness.len() == n_individuals
            && self.descriptors.len() == n_described
            && self.trial_fitness.iter().zip(&self.descriptors).all(fits)
    }

    /// Number of trials that evolution has learnt from.
    pub fn n_episodes(&self) -> u64 {
        self.trial_fitness.iter().map(|trials| trials.len() as u64).sum()
    }

    /// The entry as bytes, for storage.
    pub fn to_bytes(&self) -> Vec<u8> {
        let Self { trial_fitness, descriptors, blocks, end } = self;
        if descriptors.is_empty() && end.elites.is_empty() {
            return encode(VERSION, &(trial_fitness, blocks, &end.blocks, &end.judgement));
        }
        encode(DESCRIBED, self)
    }

    /// Reads the bytes of [`to_bytes`](Self::to_bytes), of these versions or the previous one.
    ///
    /// # Errors
    ///
    /// If the bytes are damaged, or of another version.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CheckpointError> {
        if bytes.first() == Some(&WITHOUT_END) {
            let (trial_fitness, blocks) = decode(WITHOUT_END, bytes)?;
            return Ok(Self { trial_fitness, blocks, ..Self::default() });
        }
        if bytes.first() == Some(&DESCRIBED) {
            return decode(DESCRIBED, bytes);
        }
        let (trial_fitness, blocks, end_blocks, judgement) = decode(VERSION, bytes)?;
        let end = End { blocks: end_blocks, judgement, elites: Vec::new() };
        Ok(Self { trial_fitness, descriptors: Vec::new(), blocks, end })
    }
}
