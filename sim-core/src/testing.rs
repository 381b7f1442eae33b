//! The shipped experiments, for tests to vary.

use experiment_file::{ExperimentConfig, ObjectConfig, RobotConfig};
use numeric::random::{Purpose, Stream};

/// Leader selection.
pub(crate) fn experiment_a() -> ExperimentConfig {
    read(include_str!("../../configs/leader_selection_snes.json"))
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
