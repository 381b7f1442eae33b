//! Forks: evolutions that continue the state of another one with a changed configuration.

use std::ops::Range;

use experiment_file::ExperimentConfig;

use super::{Digest, Evolution};

/// The arguments of [`Evolution::fork`].
#[derive(Debug, Clone, Copy)]
pub struct Fork<'a> {
    /// The configuration that led to the state.
    pub parent: &'a ExperimentConfig,
    /// The fingerprint of the simulation that computed the parent's fitness.
    pub parent_simulation: &'a str,
    /// The configuration with which the fork continues.
    pub child: &'a ExperimentConfig,
    /// The ranges of genes of each population of the child.
    pub segments: &'a [Range<usize>],
    /// The fingerprint of the simulation that computes the child's fitness.
    pub simulation: &'a str,
}

impl Fork<'_> {
    /// Whether parent and child mean the same by fitness.
    fn means_the_same(&self) -> bool {
        self.parent_simulation == self.simulation && task(self.parent) == task(self.child)
    }
}

/// All changes that a fork does not allow, one line each, by their place in the experiment file;
/// never empty. The caller has to undo them.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}", problems.join("\n"))]
pub struct ForkError {
    /// Each change, and the reason why a fork does not allow it.
    pub problems: Vec<String>,
}

impl Evolution {
    /// Continues as another experiment. If the changes affect no bits, the fork has the digests
    /// of its parent. Otherwise its first link covers the parent's last link and its own
    /// configuration. The champion stays if the meaning of fitness is the same.
    ///
    /// # Errors
    ///
    /// If the child's configuration changes the algorithm, the populations, their parameters or
    /// numbers of genes, or asks for no more generations than the parent has; or if it changes the
    /// meaning of fitness, and the state has elites with evidence.
    pub fn fork(self, fork: &Fork<'_>) -> Result<Self, ForkError> {
        let problems = self.problems(fork);
        if !problems.is_empty() {
            return Err(ForkError { problems });
        }
        let Fork { parent, parent_simulation, child, simulation, .. } = fork;
        let its_own = Digest::of_config(child, simulation);
        let is_changed = Digest::of_config(parent, parent_simulation) != its_own;
        let means_the_same = fork.means_the_same();
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
                "algorithm.name: is {}, but the state is of {}",
                child.name, parent.name
            ));
        }
        if child.generations <= self.n_generations {
            problems.push(format!(
                "algorithm.generations: is {}, but {} are done; ask for more",
                child.generations, self.n_generations
            ));
        }
        let are_changed = [
            ("descriptors", parent.descriptors != child.descriptors),
            ("aims", parent.aims != child.aims),
        ];
        for (key, _) in are_changed.into_iter().filter(|(_, is_changed)| *is_changed) {
            problems.push(format!(
                "algorithm.{key}: are part of the state of {}, and cannot change in a fork",
                parent.name
            ));
        }
        if self.behaviours().is_some() && !fork.means_the_same() {
            problems.push(format!(
                "algorithm.name: the elites of {} keep the evidence of the parent's task, so a fork \
                 cannot change the task; submit it as an experiment of its own",
                parent.name
            ));
        }
        let names = |populations: &[&str]| populations.join(", ");
        let of_parent: Vec<&str> = parent.populations.iter().map(|(name, _)| &**name).collect();
        let of_child: Vec<&str> = child.populations.iter().map(|(name, _)| &**name).collect();
        if of_parent != of_child {
            problems.push(format!(
                "algorithm.populations: are {}, but those of the state are {}",
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
                    "algorithm.populations.{name}: its genotypes have {n_now} genes, but those of \
                     the state have {n_before}"
                ));
            }
        }
        problems
    }
}

/// The part of a configuration that determines fitness, apart from chance.
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
