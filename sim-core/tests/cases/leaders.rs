//! Experiment A: the radio, the decoders, leaders and their failure.

use experiment_file::{
    Activation, ActuatorQuery, DecodingConfig, ExperimentConfig, FitnessFunction,
    LeaderFailureConfig,
};

use crate::configs::{experiment_a, receiver_mut, set_msg_length, swarm_mut, transmitter_mut};
use crate::reference::Episode;
use crate::{assert_agreement, random_genotype, spread};

/// Seeds of genotypes under which robots switch between sending and relaying and
/// turn their LEDs on and off.
const LIVELY: [u64; 4] = [517, 175, 66, 1374];

/// Experiment A, scored like B, so that every LED of every step counts.
fn scored_by_every_led() -> ExperimentConfig {
    let mut config = experiment_a();
    config.algorithm.fitness_function = FitnessFunction::IdentifyBorderline;
    config
}

/// Asserts agreement in one trial of every lively genotype.
fn assert_lively_agreement(config: &ExperimentConfig) -> Vec<Episode> {
    LIVELY
        .iter()
        .flat_map(|&seed| assert_agreement(config, &random_genotype(config, seed), 3, 1..2))
        .collect()
}

#[test]
fn full_experiments_agree_in_all_their_trials() {
    let config = experiment_a();
    let genotype = random_genotype(&config, 517);
    let episodes = assert_agreement(&config, &genotype, 0, 0..5);
    assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.01);
    for Episode { witness, .. } in &episodes {
        assert!(witness.n_relayed_receptions > 100 && witness.max_hops > 3, "{witness:?}");
        assert!(witness.n_choices > 1000 && witness.n_rewarded > 0, "{witness:?}");
    }
}

#[test]
fn swarms_of_every_size_agree() {
    for n in [1, 2, 5, 10, 20] {
        for fitness in [FitnessFunction::IdentifyLeader, FitnessFunction::IdentifyBorderline] {
            let mut config = experiment_a();
            config.algorithm.fitness_function = fitness;
            config.algorithm.evaluation_steps = 100;
            swarm_mut(&mut config).num_instances = n;
            let episodes = assert_lively_agreement(&config);
            assert!(episodes.iter().any(|episode| episode.fitness != 0.0));
            let hops = episodes.iter().map(|episode| episode.witness.max_hops).max();
            assert_eq!(hops > Some(1), n > 2, "{n} robots, {hops:?} hops");
        }
    }
}

#[test]
fn generations_trials_and_seeds_of_the_experiment_give_different_fitness() {
    let mut config = scored_by_every_led();
    config.algorithm.evaluation_steps = 50;
    let genotype = random_genotype(&config, 66);
    let mut fitness = Vec::new();
    for seed in [0, 1, u64::MAX] {
        config.seed = seed;
        for generation in [0, 1, 1 << 40] {
            let episodes = assert_agreement(&config, &genotype, generation, 2..4);
            fitness.extend(episodes.iter().map(|episode| episode.fitness));
        }
    }
    fitness.sort_by(f64::total_cmp);
    fitness.dedup();
    assert_eq!(fitness.len(), 18);
}

#[test]
fn message_lengths_and_alphabets_agree() {
    for (msg_length, n_symbols) in [(1, 16), (2, 16), (3, 16), (1, 2), (2, 4), (3, 64), (4, 81)] {
        let mut config = scored_by_every_led();
        config.algorithm.evaluation_steps = 60;
        set_msg_length(&mut config, msg_length);
        transmitter_mut(&mut config).n_symbols = n_symbols;
        // A temperature at which symbols other than the nearest occur.
        transmitter_mut(&mut config).beta = 10.0;
        let episodes = assert_lively_agreement(&config);
        assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.01);
    }
}

#[test]
fn messages_without_quantisation_agree() {
    let mut config = scored_by_every_led();
    config.algorithm.evaluation_steps = 100;
    let quantised: Vec<f64> =
        assert_lively_agreement(&config).iter().map(|episode| episode.fitness).collect();
    transmitter_mut(&mut config).quantize = false;
    let raw: Vec<f64> =
        assert_lively_agreement(&config).iter().map(|episode| episode.fitness).collect();
    assert_ne!(quantised, raw);
}

#[test]
fn messages_outside_the_lattice_agree() {
    let mut config = scored_by_every_led();
    config.algorithm.evaluation_steps = 100;
    config.topology.ensembles["OUT_COMM"].activation = Some(Activation::Tanh);
    // At this temperature, an unclipped message of -1 would draw other symbols than a message
    // clipped to 0.
    transmitter_mut(&mut config).beta = 5.0;
    let episodes = assert_lively_agreement(&config);
    assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.01);
}

#[test]
fn receivers_and_transmitters_of_every_kind_agree() {
    // Sectors, reach of receiver and transmitter, hops, decays.
    for (n_sectors, heard, sent, max_hops, decay_rho, decay_phi) in [
        (1, 100.0, 100.0, 10, 0.05, 1.0),
        (3, 70.0, 200.0, 10, 0.005, 0.5),
        (7, 200.0, 90.0, 4, 0.05, 0.0),
        (2, 1000.0, 1000.0, 100, 0.0, 3.0),
        (4, 100.0, 30.0, 10, 0.05, 1.0),
        (4, 100.0, 100.0, 1, 0.05, 1.0),
    ] {
        let mut config = scored_by_every_led();
        config.algorithm.evaluation_steps = 60;
        transmitter_mut(&mut config).range = sent;
        let receiver = receiver_mut(&mut config);
        receiver.n_sectors = n_sectors;
        receiver.range = heard;
        receiver.max_hops = max_hops;
        receiver.decay_rho = decay_rho;
        receiver.decay_phi = decay_phi;
        config.topology.decoding["outC"] = DecodingConfig::ThresholdDecoding { stochastic: true };
        for Episode { witness, .. } in assert_lively_agreement(&config) {
            // A range of 30 cm reaches no robot. A new frame has one hop already.
            let is_silent = sent < 40.0 || max_hops == 1;
            assert_eq!(witness.n_receptions == 0, is_silent, "{witness:?}");
            assert_eq!(witness.n_choices == 0, is_silent || n_sectors == 1, "{witness:?}");
            assert!(is_silent || (2..max_hops).contains(&witness.max_hops), "{witness:?}");
        }
    }
}

#[test]
fn decoders_of_every_kind_agree() {
    let stochastic = DecodingConfig::ThresholdDecoding { stochastic: true };
    let deterministic = DecodingConfig::ThresholdDecoding { stochastic: false };
    let softmax = DecodingConfig::SoftmaxDecoding {};
    // The decoder of messages; decoder and number of neurons of the LED, and of the mode.
    for (message, (led, n_led), (mode, n_mode)) in [
        (DecodingConfig::IdentityDecoding {}, (deterministic, 1), (stochastic, 1)),
        (stochastic, (stochastic, 1), (softmax, 2)),
        (deterministic, (softmax, 4), (stochastic, 1)),
    ] {
        let mut config = scored_by_every_led();
        config.algorithm.evaluation_steps = 100;
        let topology = &mut config.topology;
        topology.ensembles["OUT_LED"].n = n_led;
        topology.ensembles["OUT_ST"].n = n_mode;
        for (output, decoding) in [("outA", message), ("outB", led), ("outC", mode)] {
            topology.decoding[output] = decoding;
        }
        let episodes = assert_lively_agreement(&config);
        assert!(spread(episodes.iter().map(|episode| episode.fitness)) > 0.01);
        let witnesses = || episodes.iter().map(|episode| &episode.witness);
        assert!(witnesses().any(|witness| witness.n_relaying > 0 && witness.n_sending > 100));
        assert!(witnesses().any(|witness| witness.max_color == (n_led - 1).max(1)));
    }
}

#[test]
fn an_activity_of_one_half_is_over_the_threshold() {
    let mut config = scored_by_every_led();
    config.topology.decoding["outB"] = DecodingConfig::ThresholdDecoding { stochastic: false };
    swarm_mut(&mut config).num_instances = 3;
    let genotype = vec![0.5; random_genotype(&config, 0).len()];
    let episodes = assert_agreement(&config, &genotype, 0, 0..1);
    assert_eq!(episodes[0].fitness, 1.0);
    assert_eq!(episodes[0].witness.n_relaying, 0);
}

#[test]
fn robots_without_mode_or_message_agree() {
    for (actuator, output) in [(ActuatorQuery::Mode, "outC"), (ActuatorQuery::Message, "outA")] {
        let mut config = scored_by_every_led();
        config.algorithm.evaluation_steps = 100;
        config.topology.outputs.shift_remove(output);
        config.topology.decoding.shift_remove(output);
        let episodes = assert_lively_agreement(&config);
        let relays = episodes.iter().any(|episode| episode.witness.n_relaying > 0);
        assert_eq!(relays, actuator != ActuatorQuery::Mode);
    }
}

#[test]
fn a_single_robot_leads_for_fifty_steps() {
    let mut config = experiment_a();
    swarm_mut(&mut config).num_instances = 1;
    // This robot's LED is always on.
    let episodes = assert_agreement(&config, &random_genotype(&config, 0), 0, 0..1);
    assert!((episodes[0].fitness - 122.5 / 300.0).abs() < 1e-12);
    assert_eq!(episodes[0].witness.n_faults, 1);

    // A leader that never fails finally gets 5 per step.
    swarm_mut(&mut config).perturbations.leader_failure = None;
    let episodes = assert_agreement(&config, &random_genotype(&config, 0), 0, 0..1);
    assert!((episodes[0].fitness - (122.5 + 250.0 * 5.0) / 300.0).abs() < 1e-12);
}

#[test]
fn leaders_that_fail_agree() {
    for (n, time_to_failure) in [(1, 3), (2, 4), (5, 2), (10, 2), (10, 1)] {
        let mut config = experiment_a();
        let swarm = swarm_mut(&mut config);
        swarm.num_instances = n;
        swarm.perturbations.leader_failure = Some(LeaderFailureConfig { time_to_failure });
        let mut n_faults = 0;
        let mut fitness = Vec::new();
        for function in [FitnessFunction::IdentifyLeader, FitnessFunction::IdentifyBorderline] {
            config.algorithm.fitness_function = function;
            let episodes = assert_lively_agreement(&config);
            n_faults += episodes.iter().map(|episode| episode.witness.n_faults).sum::<usize>();
            fitness.extend(episodes.iter().map(|episode| episode.fitness));
        }
        assert!(n_faults > 0 && spread(fitness) > 0.0, "{n} {time_to_failure}: {n_faults}");
    }
}
