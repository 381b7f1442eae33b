//! Networks whose weights change while robots live.

use experiment_file::{
    ExperimentConfig, FitnessFunction, GenotypeQuery, GroupSelector, LearningConfig, NeuronModel,
    RewardConfig,
};

use super::spiking::{encode, spiking};
use crate::configs::experiment_c;
use crate::{assert_agreement, random_genotype, reference, spread};

/// Orientation consensus with plastic synapses; some coefficients evolve.
fn plastic(
    mut config: ExperimentConfig,
    synapses: &[&str],
    learning_rate: f64,
) -> ExperimentConfig {
    config.algorithm.fitness_function = FitnessFunction::OrientationConsensus;
    config.algorithm.evaluation_steps = 12;
    config.topology.learning = Some(LearningConfig {
        learning_rate,
        max_weight: if config.topology.neuron_model.is_spiking() { 200.0 } else { 3.5 },
        a: 1.0,
        b: -0.5,
        c: 0.25,
        d: 0.0,
        synapses: synapses.iter().map(|&name| name.to_owned()).collect(),
        reward: None,
    });
    let population = &mut config.algorithm.populations[0];
    population.objects.push(GenotypeQuery::Learning(GroupSelector::Named(synapses[0].into())));
    population.min_vals.push(-1.0);
    population.max_vals.push(1.0);
    config
}

/// Fitness of some genotypes, with and without learning; asserts that both implementations agree.
fn agreed(config: &ExperimentConfig) -> Vec<[f64; 2]> {
    let mut rigid = config.clone();
    rigid.topology.learning.as_mut().expect("it learns").learning_rate = 0.0;
    let fitness = (0..5).map(|seed| {
        let genotype = random_genotype(config, seed);
        let episodes = assert_agreement(config, &genotype, 0, 0..1);
        [episodes[0].fitness, reference::run(&rigid, &genotype, 0, 0).fitness]
    });
    fitness.collect()
}

fn assert_learned(fitness: &[[f64; 2]]) {
    assert!(spread(fitness.iter().map(|[plastic, _]| *plastic)) > 0.001, "{fitness:?}");
    assert!(fitness.iter().any(|[plastic, rigid]| (plastic - rigid).abs() > 1e-4), "{fitness:?}");
}

#[test]
fn rate_neurons_that_learn_agree() {
    let synapses = ["H2-OUT_COMM", "I1-H1", "H1-H1", "OUT_MOT-H1"];
    assert_learned(&agreed(&plastic(experiment_c(), &synapses, 0.3)));
}

#[test]
fn learning_by_delayed_reward_agrees() {
    let synapses = ["I1-H1", "H1-H1", "H1-H2"];
    let mut config = plastic(experiment_c(), &synapses, 0.5);
    config.topology.learning.as_mut().expect("it learns").reward =
        Some(RewardConfig { delay: 3, discount: 0.8 });
    assert_learned(&agreed(&config));
}

#[test]
fn spiking_neurons_that_learn_agree() {
    let mut config = spiking(experiment_c(), NeuronModel::Lif);
    encode(&mut config);
    let config = plastic(config, &["I1-H1", "I3-H1", "H1-H1", "H1-H2"], 0.9);
    assert_learned(&agreed(&config));
}
