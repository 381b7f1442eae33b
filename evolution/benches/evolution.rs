//! What a generation costs the coordinator, apart from waiting for its fitness:
//! ask and tell of 100 individuals with 455 genes, the size of experiment A.

use divan::{Bencher, counter::ItemsCount};
use experiment_file::{
    AlgorithmConfig, AlgorithmName, AlgorithmParams, CmaEsParams, CrossoverOperator,
    ExperimentConfig, FitnessFunction, GaParams, MatingOperator, MutationOperator, NamedMap,
    OpenAiEsParams, PopulationConfig, SelectionOperator, SnesParams, TopologyConfig, WorldConfig,
    XnesParams,
};

use evolution::{Asked, Evolution};

const POPULATION_SIZE: u32 = 100;
const N_GENES: usize = 455;
const N_TRIALS: usize = 5;

fn main() {
    divan::main();
}

#[divan::bench]
fn ga(bencher: Bencher) {
    let params = GaParams {
        selection_operator: SelectionOperator::Tournament,
        tournament_size: 3,
        mating_operator: MatingOperator::Random,
        crossover_operator: CrossoverOperator::BlxAlpha,
        alpha: 0.5,
        crossover_prob: 0.9,
        mutation_operator: MutationOperator::Gaussian,
        mutation_prob: 0.05,
        mutation_sigma: 0.5,
        num_elite: 3,
    };
    generation(bencher, AlgorithmName::Ga, AlgorithmParams::Ga(params));
}

#[divan::bench]
fn snes(bencher: Bencher) {
    let params = SnesParams { eta_mu: 1.0, eta_sigma: None, mu_init: 0.5, sigma_init: 0.2 };
    generation(bencher, AlgorithmName::Snes, AlgorithmParams::Snes(params));
}

#[divan::bench]
fn openai_es(bencher: Bencher) {
    let params = OpenAiEsParams {
        mu_init: 0.5,
        sigma: 0.1,
        learning_rate: 0.02,
        beta1: 0.9,
        beta2: 0.999,
        weight_decay: 0.0,
    };
    generation(bencher, AlgorithmName::OpenAiEs, AlgorithmParams::OpenAiEs(params));
}

#[divan::bench]
fn sep_cma_es(bencher: Bencher) {
    generation(bencher, AlgorithmName::SepCmaEs, cma_es_params());
}

#[divan::bench(sample_count = 10)]
fn cma_es(bencher: Bencher) {
    generation(bencher, AlgorithmName::CmaEs, cma_es_params());
}

#[divan::bench(sample_count = 10)]
fn xnes(bencher: Bencher) {
    let params =
        XnesParams { eta_mu: 1.0, eta_sigma: None, eta_b: None, mu_init: 0.5, sigma_init: 0.2 };
    generation(bencher, AlgorithmName::Xnes, AlgorithmParams::Xnes(params));
}

fn cma_es_params() -> AlgorithmParams {
    AlgorithmParams::CmaEs(CmaEsParams { mu_init: 0.5, sigma_init: 0.2 })
}

/// Tells a generation and asks the next.
fn generation(bencher: Bencher, name: AlgorithmName, params: AlgorithmParams) {
    let config = config(name, params);
    let segment = 0..N_GENES;
    let mut evolution = Evolution::new(&config, std::slice::from_ref(&segment), "bench")
        .expect("the parameters are the defaults");
    // The first generations are special: identity matrices, no parents.
    let mut asked = evolution.ask();
    for _ in 0..2 {
        asked = step(&mut evolution, asked);
    }
    bencher
        .counter(ItemsCount::new(POPULATION_SIZE))
        .with_inputs(|| (evolution.clone(), asked.clone()))
        .bench_values(|(mut evolution, asked)| step(&mut evolution, asked));
}

fn step(evolution: &mut Evolution, asked: Asked) -> Asked {
    let sphere = |genes: &Vec<f64>| -genes.iter().map(|g| (g - 0.3) * (g - 0.3)).sum::<f64>();
    let trial_fitness: Vec<Vec<f64>> =
        asked.genotypes.iter().map(|genes| vec![sphere(genes); N_TRIALS]).collect();
    evolution.tell(asked, &trial_fitness).expect("all fitness is finite");
    evolution.ask()
}

/// A configuration as far as evolution looks at it.
fn config(name: AlgorithmName, params: AlgorithmParams) -> ExperimentConfig {
    let population = PopulationConfig {
        objects: Vec::new(),
        max_vals: Vec::new(),
        min_vals: Vec::new(),
        params,
    };
    ExperimentConfig {
        name: "bench".to_owned(),
        seed: 1,
        topology: TopologyConfig {
            dt: 0.1,
            time_scale: 20,
            seed: 821,
            stimuli: NamedMap::new(),
            ensembles: NamedMap::new(),
            outputs: NamedMap::new(),
            synapses: NamedMap::new(),
            decoding: NamedMap::new(),
        },
        algorithm: AlgorithmConfig {
            name,
            evolvable_object: "robot".to_owned(),
            population_size: POPULATION_SIZE,
            generations: 1000,
            evaluation_steps: 300,
            num_evaluations: N_TRIALS as u32,
            fitness_function: FitnessFunction::IdentifyLeader,
            target_fitness: None,
            champion_every: 10,
            champion_trials: 50,
            populations: NamedMap::from([("all".to_owned(), population)]),
        },
        world: WorldConfig { height: 1000.0, width: 1000.0, objects: NamedMap::new() },
    }
}
