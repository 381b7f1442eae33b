//! Forks: an evolution that goes on from the state of another one, with something changed.

use std::ops::Range;

use experiment_file::ExperimentConfig;

use super::{Digest, Evolution, algorithms::Strategy as _};

/// What a fork is made of.
#[derive(Debug, Clone, Copy)]
pub struct Fork<'a> {
    /// The configuration under which the state came about.
    pub parent: &'a ExperimentConfig,
    /// The fingerprint of what computed fitness then.
    pub parent_simulation: &'a str,
    /// The configuration under which it goes on.
    pub child: &'a ExperimentConfig,
    /// The genes of each population of the child.
    pub segments: &'a [Range<usize>],
    /// The fingerprint of what computes its fitness.
    pub simulation: &'a str,
}

/// Everything that a state cannot carry over, one line each, by its place in the experiment
/// file; never empty. The caller has to leave these as they are.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", problems.join("\n"))]
pub struct ForkError {
    /// What it is, and why.
    pub problems: Vec<String>,
}

impl Evolution {
    /// Goes on as another experiment. One of which nothing is changed that its bits depend on
    /// has the digests of its parent; the link on which any other begins covers the parent's
    /// last link and its own configuration. The champion stays if fitness means the same.
    pub fn fork(self, fork: &Fork<'_>) -> Result<Self, ForkError> {
        let problems = self.problems(fork);
        if !problems.is_empty() {
            return Err(ForkError { problems });
        }
        let Fork { parent, parent_simulation, child, simulation, .. } = fork;
        let its_own = Digest::of_config(child, simulation);
        let is_changed = Digest::of_config(parent, parent_simulation) != its_own;
        let means_the_same = parent_simulation == simulation && task(parent) == task(child);
        Ok(Self {
            seed: child.seed,
            population_size: child.algorithm.population_size as usize,
            digest: if is_changed { self.digest.forked(its_own) } else { self.digest },
            champion: self.champion.filter(|_| means_the_same),
            challenger: self.challenger.filter(|_| means_the_same),
            ..self
        })
    }

    fn problems(&self, fork: &Fork<'_>) -> Vec<String> {
        let (parent, child) = (&fork.parent.algorithm, &fork.child.algorithm);
        let mut problems = Vec::new();
        if parent.name != child.name {
            problems.push(format!(
                "algorithm.name: is {}, and the state is one of {}",
                child.name, parent.name
            ));
        }
        if child.generations <= self.n_generations {
            problems.push(format!(
                "algorithm.generations: is {}, and {} are done; ask for more",
                child.generations, self.n_generations
            ));
        }
        let names = |populations: &[&str]| populations.join(", ");
        let of_parent: Vec<&str> = parent.populations.iter().map(|(name, _)| &**name).collect();
        let of_child: Vec<&str> = child.populations.iter().map(|(name, _)| &**name).collect();
        if of_parent != of_child {
            problems.push(format!(
                "algorithm.populations: are {}, and those of the state {}",
                names(&of_child),
                names(&of_parent)
            ));
            return problems;
        }
        let populations = parent.populations.iter().zip(child.populations.values());
        for (((name, before), after), (state, segment)) in
            populations.zip(self.populations.iter().zip(fork.segments))
        {
            if before.params != after.params {
                problems.push(format!(
                    "algorithm.populations.{name}.params: are part of the state of {}, and cannot \
                     change in a fork",
                    parent.name
                ));
            }
            let (n_now, n_before) = (segment.len(), state.n_genes());
            if n_now != n_before {
                problems.push(format!(
                    "algorithm.populations.{name}: its genotypes have {n_now} genes, and those of \
                     the state {n_before}"
                ));
            }
        }
        problems
    }
}

/// What of a configuration a fitness depends on, but for chance.
fn task(config: &ExperimentConfig) -> ExperimentConfig {
    let mut config = config.clone();
    config.name.clear();
    config.seed = 0;
    let algorithm = &mut config.algorithm;
    algorithm.population_size = 0;
    algorithm.generations = 0;
    algorithm.num_evaluations = 0;
    algorithm.target_fitness = None;
    algorithm.champion_every = 0;
    algorithm.champion_trials = 0;
    algorithm.judgement_trials = 0;
    config
}
