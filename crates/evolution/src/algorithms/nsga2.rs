//! NSGA-II: a front of compromises between fitness and other aims.
//!
//! Deb, Pratap, Agarwal, Meyarivan: "A fast and elitist multiobjective genetic algorithm: NSGA-II",
//! IEEE Transactions on Evolutionary Computation 6 (2002). As in repertoires, a share of every
//! generation are kept individuals that meet its trials, too, and all trials of a life count:
//! otherwise, the front fills with individuals that one generation's trials favoured.

use determinism::random::Stream;
use experiment_file::{
    AlgorithmDescription, DefaultValue, Direction, Domain, Keeps, LearnsFrom, Parameter, Params,
    limits,
};
use serde::{Deserialize, Serialize};

use super::{
    Behaviours, Sample,
    bounded::{mutate, simulated_binary},
    ga::shuffle,
    repertoire::{
        Elite, REEVALUATED,
        kept::{self, Family},
    },
};
use crate::{
    Birth, Evaluations, Genotype,
    dominance::{Standing, fronts},
    front::costs,
};

/// Time to find the standing of an individual, ns (`cargo bench -p evolution`).
const SORTING_NS: u64 = 1_500;

/// A population between two generations. Its elites are its first front.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Nsga2 {
    d: usize,
    aims: Vec<Direction>,
    reevaluated: f64,
    crossover_prob: f64,
    eta_c: f64,
    mutation_prob: f64,
    eta_m: f64,
    /// In the order in which they came.
    kept: Vec<Elite>,
}

const CROSSOVER_PROB: Parameter =
    Parameter::unit("crossover_prob", 0.9, "Probability that a pair is crossed");
const ETA_C: Parameter = Parameter::between(
    "eta_c",
    [0.0, 1000.0],
    20.0,
    "Distribution index of the crossover: the larger, the closer children are to their parents",
);
const MUTATION_PROB: Parameter = Parameter::of(
    "mutation_prob",
    Domain::Between(0.0, 1.0),
    DefaultValue::Formula("1/d"),
    "Probability that a gene mutates",
);
const ETA_M: Parameter = Parameter::between(
    "eta_m",
    [0.0, 1000.0],
    20.0,
    "Distribution index of the mutation: the larger, the smaller mutations are",
);

impl Nsga2 {
    /// Name, parameters and limits of the algorithm.
    pub const DESCRIPTION: AlgorithmDescription = AlgorithmDescription {
        name: "NSGA-II",
        title: "Non-dominated sorting genetic algorithm",
        learns: "population, its front",
        state: "P d",
        keeps: Keeps::Repertoire,
        individuals_min: 2,
        learns_from: LearnsFrom::Aims,
        genes_max: None,
        parameters: &[REEVALUATED, CROSSOVER_PROB, ETA_C, MUTATION_PROB, ETA_M],
    };

    /// Its state before the first generation, over `d` genes.
    pub fn start(params: &Params, d: usize, aims: &[Direction]) -> Self {
        let mutation_prob = params.value_of::<Option<f64>>(&MUTATION_PROB);
        Self {
            d,
            aims: aims.to_vec(),
            reevaluated: params.value_of(&REEVALUATED),
            crossover_prob: params.value_of(&CROSSOVER_PROB),
            eta_c: params.value_of(&ETA_C),
            mutation_prob: mutation_prob.unwrap_or(1.0 / d as f64),
            eta_m: params.value_of(&ETA_M),
            kept: Vec::new(),
        }
    }

    fn costs(&self) -> Vec<Vec<f64>> {
        self.kept.iter().map(|elite| costs_of(elite, &self.aims)).collect()
    }

    /// The kept individuals that the next generation evaluates again.
    fn again(&self, population_size: usize, standing: &Standing) -> Vec<usize> {
        let first: Vec<usize> = (0..self.kept.len()).filter(|&i| standing.rank[i] == 0).collect();
        let n = kept::n_again(&self.kept, self.reevaluated, population_size);
        kept::again(&self.kept, n, &first)
    }

    /// The first generation, U(0, 1)^d. Later ones have individuals to evaluate again, and then
    /// children. Parents are named by their places.
    fn draw(&self, population_size: usize, rng: &mut Stream) -> Vec<(Genotype, Family)> {
        if self.kept.is_empty() {
            let mut genes = || (0..self.d).map(|_| rng.uniform()).collect();
            return (0..population_size).map(|_| (genes(), Family::None)).collect();
        }
        let standing = Standing::new(&self.costs());
        let again = self.again(population_size, &standing);
        let mut drawn: Vec<(Genotype, Family)> = Vec::with_capacity(population_size + 1);
        drawn.extend(again.iter().map(|&i| (self.kept[i].genotype.clone(), Family::Again(i))));
        let mut tournaments = Tournaments { standing: &standing, left: Vec::new() };
        while drawn.len() < population_size {
            let [a, b] = [(); 2].map(|()| tournaments.winner(rng));
            let mut children = [a, b].map(|i| (self.kept[i].genotype.clone(), Family::Mutated(i)));
            if rng.bernoulli(self.crossover_prob) {
                let [(first, of_first), (second, of_second)] = &mut children;
                simulated_binary(first, second, self.eta_c, rng);
                [*of_first, *of_second] = [Family::Crossed(a, b), Family::Crossed(b, a)];
            }
            for (genes, _) in &mut children {
                mutate(genes, self.mutation_prob, self.eta_m, rng);
            }
            drawn.extend(children);
        }
        drawn.truncate(population_size);
        drawn
    }
}

/// Tournaments of two: pairs of a random order, so that all individuals compete about equally often.
struct Tournaments<'a> {
    standing: &'a Standing,
    /// Those who have yet to compete.
    left: Vec<usize>,
}

impl Tournaments<'_> {
    /// The next winner, the first of equals.
    fn winner(&mut self, rng: &mut Stream) -> usize {
        if self.left.len() < 2 {
            self.left = (0..self.standing.rank.len()).collect();
            shuffle(&mut self.left, rng);
        }
        let a = self.left.pop().expect("somebody is kept");
        let b = self.left.pop().unwrap_or(a);
        if self.standing.is_better(b, a) { b } else { a }
    }
}

fn costs_of(elite: &Elite, aims: &[Direction]) -> Vec<f64> {
    costs(elite.fitness(), &elite.descriptors(), aims)
}

#[cfg(test)]
impl Nsga2 {
    /// The population.
    pub fn kept(&self) -> &[Elite] {
        &self.kept
    }
}

impl Behaviours for Nsga2 {
    fn n_genes(&self) -> usize {
        self.d
    }

    fn n_kept(&self) -> usize {
        self.kept.len()
    }

    fn aims(&self) -> &[Direction] {
        &self.aims
    }

    fn is_sound(&self) -> bool {
        (1..=limits::AIMS).contains(&self.aims.len())
            && self.kept.len() <= limits::POPULATION as usize
            && kept::fit(&self.kept, self.d, self.aims.len())
    }

    /// A generation sorts its parents twice, and then parents and children together.
    fn search_ns(&self, population_size: u64) -> u64 {
        4 * SORTING_NS * population_size
    }

    fn elites(&self) -> Vec<&Elite> {
        let first = fronts(&self.costs()).into_iter().next().unwrap_or_default();
        first.into_iter().map(|i| &self.kept[i]).collect()
    }

    fn sample(&self, population_size: usize, rng: &mut Stream) -> Sample {
        let drawn = self.draw(population_size, rng).into_iter();
        Sample::new(drawn.map(|(genes, _)| genes).collect(), Vec::new())
    }

    fn births(&self, population_size: usize, rng: &mut Stream) -> Option<Vec<Birth>> {
        Some(kept::births(&self.kept, self.draw(population_size, rng)))
    }

    fn learn(&mut self, generation: u64, sample: &Sample, told: Evaluations<'_>) {
        let size = sample.genotypes.len();
        let costs = self.costs();
        let again = self.again(size, &Standing::new(&costs));
        let Self { aims, kept, .. } = self;
        let results = kept::Results { generation, genotypes: &sample.genotypes, told };
        let survivors = |pool: &[Vec<f64>], _| Standing::new(pool).best(size);
        kept::learn(kept, costs, &again, &results, |elite| costs_of(elite, aims), survivors);
    }
}
