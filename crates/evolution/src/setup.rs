//! Evolution without an experiment file, which maximises any function of genes in \[0, 1\].

use std::fmt;

use experiment_file::{AlgorithmDescription, Direction, LearnsFrom, Params, limits};

use super::{ALGORITHMS, Algorithm, Axis, BesideFitness, Digest, Evolution};

/// The algorithm and the shape of an evolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// Name of the algorithm, as in experiment files.
    pub algorithm: String,
    /// Its parameters; absent ones have their defaults.
    pub params: Params,
    /// Number of genes of a genotype, at least 1.
    pub n_genes: usize,
    /// Number of genotypes per generation; each algorithm has a minimum.
    pub population_size: u32,
    /// Seed of all random draws.
    pub seed: u64,
    /// The grid of descriptors, for algorithms that evolve a repertoire.
    pub axes: Vec<Axis>,
    /// The aims beside fitness, for algorithms that evolve a front.
    pub aims: Vec<Direction>,
}

/// All mistakes of a [`Setup`], one sentence each; never empty. The caller has to change the
/// setup.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct SetupError {
    /// Each mistake, and the allowed values.
    pub problems: Vec<String>,
}

impl Setup {
    /// A setup for `n_genes` genes and the algorithm of this name, with its default parameters,
    /// 20 individuals per generation and seed 0.
    pub fn new(algorithm: &str, n_genes: usize) -> Self {
        Self {
            algorithm: algorithm.to_owned(),
            params: Params::default(),
            n_genes,
            population_size: 20,
            seed: 0,
            axes: Vec::new(),
            aims: Vec::new(),
        }
    }

    /// Checks the setup, without taking memory for it.
    ///
    /// # Errors
    ///
    /// If the algorithm or a parameter is unknown, or if a value is not allowed.
    pub fn check(&self) -> Result<(), SetupError> {
        let problems = self.problems();
        if problems.is_empty() { Ok(()) } else { Err(SetupError { problems }) }
    }

    /// The evolution before its first generation.
    ///
    /// # Errors
    ///
    /// As [`check`](Self::check).
    pub fn start(&self) -> Result<Evolution, SetupError> {
        self.check()?;
        let beside = BesideFitness { axes: self.axes.clone(), aims: self.aims.clone() };
        let algorithm = Algorithm::new(&self.algorithm, &self.params, self.n_genes, &beside);
        let population = algorithm.expect("the algorithm is known");
        let size = self.population_size as usize;
        Ok(Evolution::from_parts(self.seed, size, vec![population], Digest::of_text(&self.text())))
    }

    /// The mistakes of the setup, by the rules of experiment files, from the same descriptions.
    fn problems(&self) -> Vec<String> {
        let Some(algorithm) = AlgorithmDescription::find(ALGORITHMS, &self.algorithm) else {
            let known: Vec<&str> = ALGORITHMS.iter().map(|algorithm| algorithm.name).collect();
            let name = &self.algorithm;
            return vec![format!("no algorithm is named `{name}`; known: {}", known.join(", "))];
        };
        let mut problems = Vec::new();
        let (d, size) = (self.n_genes, self.population_size);
        if d == 0 {
            problems.push("a genotype needs at least 1 gene".to_owned());
        }
        if let Some(max) = algorithm.genes_max.filter(|&max| d as u64 > max) {
            problems.push(format!("{} takes at most {max} genes, not {d}", algorithm.name));
        }
        let min = algorithm.individuals_min;
        if size < min {
            let name = algorithm.name;
            problems.push(format!("{name} needs at least {min} individuals, not {size}"));
        }
        let needs_axes = algorithm.learns_from == LearnsFrom::Descriptors;
        if needs_axes == self.axes.is_empty() {
            let name = algorithm.name;
            problems.push(match needs_axes {
                true => format!("{name} needs descriptors: run an experiment file that has them"),
                false => format!("{name} knows no descriptors"),
            });
        }
        problems.extend(self.problems_of_aims(algorithm));
        for parameter in algorithm.parameters {
            let value = self.params.get(parameter);
            if let Some(value) = value.filter(|value| !parameter.domain.contains(value, size)) {
                let (key, domain) = (parameter.key, parameter.domain);
                problems.push(format!("`{key}` must be {domain}, is {value}"));
            }
        }
        for (key, _) in self.params.iter().filter(|(key, _)| !algorithm.has(key)) {
            problems.push(format!("{} has no parameter `{key}`", algorithm.name));
        }
        problems
    }

    /// The mistakes of the aims, and of the size of a front.
    fn problems_of_aims(&self, algorithm: &AlgorithmDescription) -> Vec<String> {
        let (name, n_aims, size) = (algorithm.name, self.aims.len(), self.population_size);
        let mut problems = Vec::new();
        if algorithm.learns_from != LearnsFrom::Aims {
            if n_aims > 0 {
                problems.push(format!("{name} knows no aims beside fitness"));
            }
            return problems;
        }
        if !(1..=limits::AIMS).contains(&n_aims) {
            let max = limits::AIMS;
            problems.push(format!("{name} needs 1 to {max} aims beside fitness, not {n_aims}"));
        }
        if size > limits::ELITES {
            let max = limits::ELITES;
            problems.push(format!("{name} takes at most {max} individuals, not {size}"));
        }
        problems
    }

    /// The whole setup as text, for the digest.
    fn text(&self) -> String {
        let Self { algorithm, params, n_genes, population_size, seed, axes, aims } = self;
        let mut text = format!("{algorithm}\n{n_genes}\n{population_size}\n{seed}\n");
        for (key, value) in params.iter() {
            text += &format!("{key} {value}\n");
        }
        for Axis { low, high, n_cells } in axes {
            text += &format!("axis {low} {high} {n_cells}\n");
        }
        for aim in aims {
            text += match aim {
                Direction::Maximise => "maximise\n",
                Direction::Minimise => "minimise\n",
            };
        }
        text
    }
}

impl fmt::Display for SetupError {
    /// One problem per line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.problems.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::by_fitness;

    fn problems(setup: &Setup) -> Vec<String> {
        setup.start().unwrap_err().problems
    }

    #[test]
    fn every_algorithm_starts_with_its_defaults() {
        for algorithm in by_fitness() {
            let evolution = Setup::new(algorithm.name, 3).start().unwrap();
            assert_eq!(evolution.ask().genotypes.len(), 20, "{}", algorithm.name);
        }
    }

    #[test]
    fn all_mistakes_of_a_setup_are_reported() {
        let params = Params::default().with("sigma_init", 2.0).with("eta_mu", 1.0);
        let setup = Setup { params, population_size: 1, ..Setup::new("CMA-ES", 1001) };
        let expected = [
            "CMA-ES takes at most 1000 genes, not 1001",
            "CMA-ES needs at least 2 individuals, not 1",
            "`sigma_init` must be between 0.000000001 and 1, is 2",
            "CMA-ES has no parameter `eta_mu`",
        ];
        assert_eq!(problems(&setup), expected);
        assert_eq!(problems(&Setup::new("SNES", 0)), ["a genotype needs at least 1 gene"]);
        let expected = "no algorithm is named `PSO`; known: GA, SNES, ";
        assert!(problems(&Setup::new("PSO", 1))[0].starts_with(expected));
    }

    #[test]
    fn aims_belong_to_fronts_and_are_part_of_the_digest() {
        let aims = |aims: &[Direction], name| Setup { aims: aims.to_vec(), ..Setup::new(name, 2) };
        let [most, least] = [Direction::Maximise, Direction::Minimise];
        assert_eq!(problems(&aims(&[most], "GA")), ["GA knows no aims beside fitness"]);
        let large = Setup { population_size: 16_385, ..aims(&[], "NSGA-II") };
        let expected = [
            "NSGA-II needs 1 to 2 aims beside fitness, not 0",
            "NSGA-II takes at most 16384 individuals, not 16385",
        ];
        assert_eq!(problems(&large), expected);
        assert_eq!(problems(&aims(&[most; 3], "NSGA-II")).len(), 1);
        let digest = |aim| aims(&[aim], "NSGA-II").start().unwrap().digest();
        assert_ne!(digest(most), digest(least));
    }

    #[test]
    fn an_elite_leaves_room_for_children() {
        let params = Params::default().with("num_elite", 4_u32);
        let setup = Setup { params, population_size: 4, ..Setup::new("GA", 2) };
        let expected = "`num_elite` must be a whole number below the population size, is 4";
        assert_eq!(problems(&setup), [expected]);
        assert!(Setup { population_size: 5, ..setup }.start().is_ok());
    }

    #[test]
    fn every_part_of_a_setup_enters_the_digest() {
        let digest = |setup: Setup| setup.start().unwrap().digest();
        let base = || Setup::new("SNES", 2);
        let eta = Params::default().with("eta_mu", 0.5);
        assert_eq!(digest(base()), digest(base()));
        assert_ne!(digest(base()), digest(Setup { seed: 1, ..base() }));
        assert_ne!(digest(base()), digest(Setup { params: eta, ..base() }));
    }
}
