//! Experiment C and everything about wheels: motion, headings, their fitness functions,
//! uncontrollable robots.

use std::f64::consts::PI;

use experiment_file::{
    Activation, DecodingConfig, ExperimentConfig, FitnessFunction, Initializer, ObjectConfig,
    SendingDirection, UncontrollableRotationConfig,
};

use crate::configs::{experiment_c, experiment_d, receiver_mut, swarm_mut};
use crate::reference::Episode;
use crate::{assert_agreement, assert_varied_agreement, gentle_genotype, random_genotype, spread};

#[test]
fn full_experiments_agree() {
    let config = experiment_c();
    let episodes = assert_agreement(&config, &random_genotype(&config, 15), 0, 0..2);
    assert!(episodes.iter().any(|episode| episode.witness.n_relayed_receptions > 0));

    let mut config = experiment_d();
    config.algorithm.evaluation_steps = 300;
    for genotype in [random_genotype(&config, 0), gentle_genotype(&config, 1)] {
        let episodes = assert_agreement(&config, &genotype, 0, 0..2);
        assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.0);
        for Episode { witness, .. } in episodes {
            assert!(witness.n_light > 0 && witness.n_inhibited > 0, "{witness:?}");
        }
    }
}

#[test]
fn orientation_fitness_agrees_for_every_size() {
    for n in [1, 2, 5, 10] {
        let mut config = experiment_c();
        swarm_mut(&mut config).num_instances = n;
        config.algorithm.evaluation_steps = 40;
        assert_varied_agreement(&config);

        config.algorithm.fitness_function = FitnessFunction::Alignment;
        config.algorithm.evaluation_steps = 130;
        // Headings near 0 from both sides, so that few steps have fitness 0.
        swarm_mut(&mut config).initializers.orientations =
            Initializer::RandomUniform { low: -0.5, high: 0.5, size: 1 };
        assert_varied_agreement(&config);
    }
}

#[test]
fn a_relaying_swarm_that_turns_agrees() {
    let mut config = experiment_c();
    config.algorithm.evaluation_steps = 100;
    config.topology.decoding["outC"] = DecodingConfig::ThresholdDecoding { stochastic: true };
    // Reach shorter than the swarm, so that frames need several hops; six sectors.
    receiver_mut(&mut config).range = 80.0;
    receiver_mut(&mut config).n_sectors = 6;
    let emitter = assert_varied_agreement(&config);
    assert!(emitter.iter().any(|episode| episode.witness.max_hops > 4));
    receiver_mut(&mut config).sending_direction = SendingDirection::Originator;
    let originator = assert_varied_agreement(&config);
    let differ = |(a, b): (&Episode, &Episode)| a.fitness != b.fitness;
    assert!(emitter.iter().zip(&originator).any(differ));
}

#[test]
fn motion_agrees_for_every_kind_of_drive() {
    // Robots of the first two cases move on arcs. Robots of the last case move straight ahead,
    // around one wheel, or not at all. All cross the border. The gentle genotypes avoid wheels that
    // differ only by rounding, because their arc is a small difference of large numbers.
    let identity = DecodingConfig::IdentityDecoding {};
    let bits = DecodingConfig::ThresholdDecoding { stochastic: true };
    type Genotype = fn(&ExperimentConfig, u64) -> Vec<f64>;
    let cases: [(_, _, Genotype); 3] = [
        (identity, Activation::Tanh, gentle_genotype),
        (identity, Activation::Sigmoid, gentle_genotype),
        (bits, Activation::Sigmoid, random_genotype),
    ];
    for (decoding, activation, genotype) in cases {
        let mut config = experiment_d();
        config.algorithm.fitness_function = FitnessFunction::Grouping;
        config.algorithm.evaluation_steps = 60;
        config.topology.decoding["outB"] = decoding;
        config.topology.ensembles["OUT_MOT"].activation = Some(activation);
        let swarm = swarm_mut(&mut config);
        swarm.num_instances = 5;
        swarm.perturbations.stimuli_inhibition.clear();
        swarm.initializers.positions =
            Initializer::RandomGraph { max_rad: 100.0, initial_pos: [995.0, 3.0] };
        let wheels = swarm.actuators.wheel_actuator.as_mut().unwrap();
        wheels.max_speed = 12.0;
        wheels.axle_length = 9.0;
        wheels.step_duration = 0.2;
        let fitness: Vec<f64> = (0..6)
            .flat_map(|seed| assert_agreement(&config, &genotype(&config, seed), 0, 0..2))
            .map(|episode| episode.fitness)
            .collect();
        assert!(spread(fitness.iter().copied()) > 0.1, "{fitness:?}");
        assert!(fitness.iter().filter(|&&fitness| fitness > 0.0).count() > 6, "{fitness:?}");
    }
}

#[test]
fn uncontrollable_robots_agree() {
    let mut config = experiment_c();
    config.algorithm.evaluation_steps = 100;
    let obedient: Vec<f64> =
        assert_varied_agreement(&config).iter().map(|episode| episode.fitness).collect();
    swarm_mut(&mut config).perturbations.uncontrollable_rotation =
        Some(UncontrollableRotationConfig {
            affected_robots: 4,
            start: 20,
            targets: vec![0.1, PI, 5.0],
            switch_at: 30,
            speed: 0.2,
        });
    let episodes = assert_varied_agreement(&config);
    let disturbed: Vec<f64> = episodes.iter().map(|episode| episode.fitness).collect();
    assert!(obedient.iter().zip(&disturbed).all(|(a, b)| a != b));
    for Episode { witness, .. } in episodes {
        assert_eq!(witness.n_uncontrollable, 80 * 4);
    }
}

#[test]
fn robots_at_one_place_agree() {
    let mut config = experiment_c();
    config.algorithm.evaluation_steps = 60;
    config.topology.decoding["outC"] = DecodingConfig::ThresholdDecoding { stochastic: true };
    swarm_mut(&mut config).initializers.positions =
        Initializer::Fixed { values: vec![vec![1000.0, -30.0]] };
    let episodes = assert_varied_agreement(&config);
    assert!(episodes.iter().all(|episode| episode.witness.n_receptions > 100));
}

#[test]
fn a_robot_between_two_sectors_is_heard_in_both() {
    let mut config = experiment_c();
    config.algorithm.evaluation_steps = 60;
    let swarm = swarm_mut(&mut config);
    swarm.num_instances = 2;
    // Wheels do not turn, so the first robot keeps its heading of 0 and hears the other robot
    // exactly between its first two sectors. Every angle involved is pi/4 or pi/2 to the last bit.
    swarm.actuators.wheel_actuator.as_mut().unwrap().max_speed = 0.0;
    swarm.initializers.positions =
        Initializer::Fixed { values: vec![vec![500.0, 500.0], vec![550.0, 550.0]] };
    swarm.initializers.orientations = Initializer::Fixed { values: vec![vec![0.0], vec![1.0]] };
    let episodes = assert_varied_agreement(&config);
    assert!(episodes.iter().any(|episode| episode.witness.n_choices > 0));
}

#[test]
fn swarms_that_share_the_ether_agree() {
    let mut config = experiment_c();
    config.algorithm.evaluation_steps = 60;
    config.topology.decoding["outC"] = DecodingConfig::ThresholdDecoding { stochastic: true };
    let mut other = swarm_mut(&mut config).clone();
    other.num_instances = 4;
    other.initializers.positions =
        Initializer::RandomCircumference { radius: 85.0, center: [500.0, 500.0] };
    if let Some(receiver) = &mut other.sensors.wireless_receiver {
        receiver.n_sectors = 3;
        receiver.range = 120.0;
        receiver.decay_phi = 0.3;
    }
    if let Some(transmitter) = &mut other.actuators.wireless_transmitter {
        transmitter.range = 90.0;
        transmitter.quantize = false;
    }
    config.world.objects.insert("others".into(), ObjectConfig::Robot(other));
    let episodes = assert_varied_agreement(&config);
    assert!(episodes.iter().any(|episode| episode.witness.max_hops > 2));
}
