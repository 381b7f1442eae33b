//! The shipped experiments, for tests to vary.

use determinism::random::{Purpose, Stream};
use experiment_file::{
    ExperimentConfig, GenotypeQuery, NeuronModel, ObjectConfig, RobotConfig, SynapseSelector,
};

/// Leader selection.
pub(crate) fn experiment_a() -> ExperimentConfig {
    read(include_str!("../../configs/leader_selection_snes.json"))
}

/// Leader selection with spiking neurons of a model; weights evolve.
pub(crate) fn experiment_a_spiking(model: NeuronModel) -> ExperimentConfig {
    let mut config = read(include_str!("../../configs/spiking/leader_selection_lif.json"));
    config.topology.neuron_model = model;
    for ensemble in config.topology.ensembles.values_mut() {
        ensemble.params = model.default_params();
    }
    let population = &mut config.algorithm.populations[0];
    population.objects = vec![GenotypeQuery::Weights(SynapseSelector::All)];
    (population.min_vals, population.max_vals) = (vec![-100.0], vec![250.0]);
    config
}

/// Borderline identification.
pub(crate) fn experiment_b() -> ExperimentConfig {
    read(include_str!("../../configs/borderline_snes.json"))
}

/// Orientation consensus.
pub(crate) fn experiment_c() -> ExperimentConfig {
    read(include_str!("../../configs/orientation_consensus_snes.json"))
}

/// Light follower, with noise.
pub(crate) fn experiment_d() -> ExperimentConfig {
    read(include_str!("../../configs/light_follower_thesis_sensors_snes.json"))
}

fn read(text: &str) -> ExperimentConfig {
    ExperimentConfig::from_json(text, "test", evolution::ALGORITHMS).unwrap().0
}

/// The first robots of a configuration.
pub(crate) fn robot(config: &mut ExperimentConfig) -> &mut RobotConfig {
    match config.world.objects.values_mut().next() {
        Some(ObjectConfig::Robot(robot)) => robot,
        other => panic!("not a robot: {other:?}"),
    }
}

/// A reproducible genotype.
pub(crate) fn genotype(len: usize, seed: u64) -> Vec<f64> {
    let mut stream = Stream::new(seed, 0, 0, Purpose::Evolution, 0);
    (0..len).map(|_| stream.uniform()).collect()
}
